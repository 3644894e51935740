//! Places by what presses on a device taught of it.

use std::sync::Arc;

use super::kernel_regression::{KernelRegression, Press};
use super::localisation::{Place, Placing, ProfileFit};
use crate::trained::{PlaceFinder, PlaceMap, TrainingError};

/// What finds places as `map` says, with `profile` for the device as drawn.
/// Forces are given over the gains of the map.
///
/// # Errors
/// [`TrainingError`] for a map that no regression can be made of.
pub fn placing(map: &PlaceMap, profile: ProfileFit) -> Result<Arc<dyn Placing>, TrainingError> {
    let pitch = profile.model().pitch;
    let kernel = || {
        let pairs = map.directions.iter().zip(&map.places);
        let press = |(direction, place): (&Vec<f64>, &[f64; 2])| Press {
            forces: direction.clone(),
            place: *place,
        };
        let presses: Vec<Press> = pairs.map(press).collect();
        KernelRegression::observe(map.kernel(), &presses, pitch)
    };
    Ok(match map.finder {
        PlaceFinder::Centroid => Arc::new(profile.model().centroid()),
        PlaceFinder::Profile => Arc::new(profile.with_gain_deviation(map.gain_deviation)),
        PlaceFinder::Kernel => Arc::new(kernel()?),
        PlaceFinder::KernelOrProfile => Arc::new(Checked {
            kernel: kernel()?,
            profile: profile.with_gain_deviation(map.gain_deviation),
        }),
    })
}

/// A learned map beside the profile: a map knows only contacts like those that
/// it was trained with, and says nothing when another one comes.
#[derive(Debug, Clone)]
struct Checked {
    kernel: KernelRegression,
    profile: ProfileFit,
}

/// χ² of two degrees of freedom that one sound pair of places in a hundred
/// exceeds.
const CONTRADICTION: f64 = 9.21;

impl Placing for Checked {
    fn place(&self, forces: &[f64], deviations: &[f64]) -> Option<Place> {
        let learned = self.kernel.place(forces, deviations);
        let fitted = self.profile.place(forces, deviations);
        match (learned, fitted) {
            (Some(learned), Some(fitted)) if apart(&learned, &fitted) > CONTRADICTION => {
                Some(fitted)
            }
            // The profile has the whole force and the size, too.
            (Some(learned), Some(fitted)) => Some(Place {
                force: fitted.force,
                radius: fitted.radius,
                misfit: fitted.misfit,
                ..learned
            }),
            (learned, fitted) => learned.or(fitted),
        }
    }
}

/// Squared distance of two places in their deviations.
fn apart(a: &Place, b: &Place) -> f64 {
    let [x, y] = [0, 1].map(|axis| a.centre[axis] - b.centre[axis]);
    let [xx, xy, yy] = [0, 1, 2].map(|entry| a.covariance[entry] + b.covariance[entry]);
    (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
}
