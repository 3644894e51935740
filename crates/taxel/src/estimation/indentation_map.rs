//! Positions from a map of indentations of the device.

use std::sync::Arc;

use super::kernel_regression::{IndentationForces, KernelRegression, Trust};
use super::localisation::{ContactPosition, Localiser, Located};
use super::position_fit::ProfileFit;
use crate::trained::{IndentationMap, PositionMethod, TrainingError};

/// Localiser that `map` asks for, with `profile` for the device as drawn.
/// Forces are given over the gains of the map.
///
/// # Errors
/// [`TrainingError`] for a map that no regression can be made of.
pub fn localiser(
    map: &IndentationMap,
    profile: ProfileFit,
) -> Result<Arc<dyn Localiser>, TrainingError> {
    let profile = profile.with_gain_deviation(map.gain_deviation);
    let profile = ScaledProfile {
        fit: profile,
        spread: map.profile_spread,
    };
    Ok(match map.finder {
        PositionMethod::Centroid => Arc::new(profile.fit.model().centroid()),
        PositionMethod::Profile => Arc::new(profile),
        PositionMethod::Kernel => Arc::new(regression(map, &profile.fit)?),
        PositionMethod::KernelOrProfile => Arc::new(KernelOrProfile {
            kernel: regression(map, &profile.fit)?,
            profile,
        }),
    })
}

/// Kernel regression on the indentations of `map`.
///
/// # Errors
/// As [`localiser`].
pub fn regression(
    map: &IndentationMap,
    profile: &ProfileFit,
) -> Result<KernelRegression, TrainingError> {
    let press = |index: usize| IndentationForces {
        forces: map.directions[index].clone(),
        position: map.positions[index],
        radius: map.radii.get(index).copied(),
    };
    let presses: Vec<IndentationForces> = (0..map.positions.len()).map(press).collect();
    let kernel = KernelRegression::observe(map.kernel(), &presses, profile.model())?;
    Ok(kernel.with_trust(Trust {
        spread: map.spread,
        reach: map.reach,
    }))
}

/// Profile with the factor on its deviations from held-out indentations.
#[derive(Debug, Clone)]
struct ScaledProfile {
    fit: ProfileFit,
    spread: f64,
}

impl ScaledProfile {
    fn scaled(&self, position: ContactPosition) -> Option<ContactPosition> {
        let position = position.spread(self.spread);
        position
            .is_known(self.fit.model().pitch)
            .then_some(position)
    }
}

impl Localiser for ScaledProfile {
    fn position(&self, forces: &[f64], deviations: &[f64]) -> Option<ContactPosition> {
        self.scaled(self.fit.position(forces, deviations)?)
    }

    fn positions(&self, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
        let mut found = self.fit.positions(forces, deviations);
        for one in &mut found {
            one.position = one.position.and_then(|position| self.scaled(position));
        }
        found
    }
}

/// Kernel regression for contacts like those of the map; the profile for all
/// others, and for several at a time.
#[derive(Debug, Clone)]
struct KernelOrProfile {
    kernel: KernelRegression,
    profile: ScaledProfile,
}

impl Localiser for KernelOrProfile {
    fn position(&self, forces: &[f64], deviations: &[f64]) -> Option<ContactPosition> {
        let learned = self.kernel.position(forces, deviations);
        learned.or_else(|| self.profile.position(forces, deviations))
    }

    fn positions(&self, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
        match self.kernel.position(forces, deviations) {
            Some(position) => vec![Located {
                position: Some(position),
                carried: forces.to_vec(),
            }],
            None => self.profile.positions(forces, deviations),
        }
    }
}
