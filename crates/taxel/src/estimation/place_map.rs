//! Places by what presses on a device taught of it.

use std::sync::Arc;

use super::kernel_regression::{KernelRegression, Press, Trust};
use super::localisation::{Located, Place, Placing};
use super::placing_fit::ProfileFit;
use crate::trained::{PlaceFinder, PlaceMap, TrainingError};

/// What finds places as `map` says, with `profile` for the device as drawn.
/// Forces are given over the gains of the map.
///
/// # Errors
/// [`TrainingError`] for a map that no regression can be made of.
pub fn placing(map: &PlaceMap, profile: ProfileFit) -> Result<Arc<dyn Placing>, TrainingError> {
    let profile = profile.with_gain_deviation(map.gain_deviation);
    let profile = Honest {
        placing: profile,
        spread: map.profile_spread,
    };
    Ok(match map.finder {
        PlaceFinder::Centroid => Arc::new(profile.placing.model().centroid()),
        PlaceFinder::Profile => Arc::new(profile),
        PlaceFinder::Kernel => Arc::new(regression(map, &profile.placing)?),
        PlaceFinder::KernelOrProfile => Arc::new(Guarded {
            kernel: regression(map, &profile.placing)?,
            profile,
        }),
    })
}

/// What the presses of `map` taught.
///
/// # Errors
/// As [`placing`].
pub fn regression(map: &PlaceMap, profile: &ProfileFit) -> Result<KernelRegression, TrainingError> {
    let press = |index: usize| Press {
        forces: map.directions[index].clone(),
        place: map.places[index],
        radius: map.radii.get(index).copied(),
    };
    let presses: Vec<Press> = (0..map.places.len()).map(press).collect();
    let kernel = KernelRegression::observe(map.kernel(), &presses, profile.model())?;
    Ok(kernel.with_trust(Trust {
        spread: map.spread,
        reach: map.reach,
    }))
}

/// The profile with the factor on its deviations that presses ask for.
#[derive(Debug, Clone)]
struct Honest {
    placing: ProfileFit,
    spread: f64,
}

impl Honest {
    fn judged(&self, place: Place) -> Option<Place> {
        let place = place.spread(self.spread);
        place.is_known(self.placing.model().pitch).then_some(place)
    }
}

impl Placing for Honest {
    fn place(&self, forces: &[f64], deviations: &[f64]) -> Option<Place> {
        self.judged(self.placing.place(forces, deviations)?)
    }

    fn places(&self, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
        let mut found = self.placing.places(forces, deviations);
        for one in &mut found {
            one.place = one.place.and_then(|place| self.judged(place));
        }
        found
    }
}

/// What was learned, for contacts like those that pressed; the profile for all
/// others, and for several at a time.
#[derive(Debug, Clone)]
struct Guarded {
    kernel: KernelRegression,
    profile: Honest,
}

impl Placing for Guarded {
    fn place(&self, forces: &[f64], deviations: &[f64]) -> Option<Place> {
        let learned = self.kernel.place(forces, deviations);
        learned.or_else(|| self.profile.place(forces, deviations))
    }

    fn places(&self, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
        match self.kernel.place(forces, deviations) {
            Some(place) => vec![Located {
                place: Some(place),
                carried: forces.to_vec(),
            }],
            None => self.profile.places(forces, deviations),
        }
    }
}
