//! Positions learned from presses on an array whose elements have a model.

use serde::{Deserialize, Serialize};

use super::{Kernel, TrainingError};

/// Fewer presses make no map.
pub(crate) const FEWEST_PRESSES: usize = 8;

/// Method that estimates the position of a contact on such an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionMethod {
    /// Centre of the forces on the elements.
    Centroid,
    /// Least squares on the profile of the soft cover.
    Profile,
    /// Kernel regression on the presses.
    Kernel,
    /// Kernel regression for contacts like those that pressed, the profile for
    /// all others.
    KernelOrProfile,
}

/// Map learned from indentations of one array at known positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IndentationMap {
    /// Method that estimates a position.
    pub finder: PositionMethod,
    /// Gain of each element over their mean.
    pub gains: Vec<f64>,
    /// Standard deviation to which the gains are known.
    pub gain_deviation: f64,
    /// Factor on the deviations of the profile that held-out presses ask for.
    pub profile_spread: f64,
    /// The kernel on positions: deviation of the forces, of vectors of unit
    /// length, length in m, and scatter of a force.
    pub kernel: [f64; 3],
    /// Factor on the deviations of the regression that held-out presses ask
    /// for.
    pub spread: f64,
    /// Misfit over its degrees of freedom above which a contact is unlike all
    /// that pressed.
    pub reach: f64,
    /// Forces on all elements, each over its gain, as a vector of unit length;
    /// one for each press.
    pub directions: Vec<Vec<f64>>,
    /// Centre of each press on the developed surface, m.
    #[serde(rename = "places")]
    pub positions: Vec<[f64; 2]>,
    /// Radius of the contact of each press, m; none where they are not known.
    pub radii: Vec<f64>,
}

impl IndentationMap {
    /// The kernel of the regression.
    pub fn kernel(&self) -> Kernel {
        let [deviation, length, noise] = self.kernel;
        Kernel {
            deviation,
            length,
            slope: 0.0,
            noise,
        }
    }

    /// Checks that the tables of a map from a file belong together.
    ///
    /// # Errors
    /// [`TrainingError::Unsound`] names the first that does not.
    pub fn check(&self) -> Result<(), TrainingError> {
        let unsound = |table| Err(TrainingError::Unsound { table });
        let positive = |value: &f64| *value > 0.0 && value.is_finite();
        if self.gains.is_empty() || !self.gains.iter().all(positive) {
            return unsound("gains");
        }
        if !(self.gain_deviation >= 0.0 && self.gain_deviation.is_finite()) {
            return unsound("gain_deviation");
        }
        for (table, values) in [
            ("kernel", &self.kernel[..]),
            ("spread", &[self.spread]),
            ("profile_spread", &[self.profile_spread]),
            ("reach", &[self.reach]),
            ("radii", &self.radii),
        ] {
            if !values.iter().all(positive) {
                return unsound(table);
            }
        }
        let whole = |row: &Vec<f64>| {
            row.len() == self.gains.len() && row.iter().all(|value| value.is_finite())
        };
        // Of rounded numbers.
        let unit = |row: &Vec<f64>| (row.iter().map(|f| f * f).sum::<f64>() - 1.0).abs() < 1e-3;
        let sound = |row: &Vec<f64>| whole(row) && unit(row);
        if self.directions.len() < FEWEST_PRESSES || !self.directions.iter().all(sound) {
            return unsound("directions");
        }
        let finite = |position: &[f64; 2]| position.iter().all(|value| value.is_finite());
        if self.positions.len() != self.directions.len() || !self.positions.iter().all(finite) {
            return unsound("places");
        }
        if !self.radii.is_empty() && self.radii.len() != self.positions.len() {
            return unsound("radii");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_no_regression_can_be_made_of_is_refused() {
        let sound = IndentationMap {
            finder: PositionMethod::Kernel,
            gains: vec![1.0; 2],
            gain_deviation: 0.01,
            profile_spread: 1.0,
            kernel: [1.0, 1e-3, 1e-2],
            spread: 1.0,
            reach: 3.0,
            directions: vec![vec![0.6, 0.8]; FEWEST_PRESSES],
            positions: vec![[0.0; 2]; FEWEST_PRESSES],
            radii: Vec::new(),
        };
        assert_eq!(sound.check(), Ok(()));
        let refused = |change: &dyn Fn(&mut IndentationMap)| {
            let mut map = sound.clone();
            change(&mut map);
            let found = map.check();
            matches!(
                found,
                Err(TrainingError::Unsound {
                    table: "directions"
                })
            )
        };
        assert!(refused(&|map| map.directions[3] = vec![0.0; 2]));
        assert!(refused(&|map| map.directions.truncate(FEWEST_PRESSES - 1)));
        assert!(refused(&|map| map.directions[0] = vec![1.0]));
    }
}
