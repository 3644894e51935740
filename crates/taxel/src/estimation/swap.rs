//! Two capacitors of a three-axis unit that changed places.

use super::unit::{SearchOptions, estimate_unit};
use crate::transduction::ThreeAxisModel;

/// All pairs of the capacitors 11, 12, 21, 22.
const PAIRS: [[usize; 2]; 6] = [[0, 1], [2, 3], [0, 2], [1, 3], [0, 3], [1, 2]];
/// Sums of squares beyond their mean by this many deviations are no chance.
const BEYOND: f64 = 6.0;

/// The pairs of capacitors (0 to 3 for 11, 12, 21, 22) whose exchange explains
/// `readings`, F, that contradict the model as they are; empty when they do not,
/// or when no exchange helps.
///
/// A unit is symmetric: 11 with 12 looks like 21 with 22 under the mirrored
/// shear, so two pairs are named unless their capacitances at rest differ by
/// more than the noise `sigma`, F. An exchange across the diagonal turns the
/// shear and contradicts nothing; only such a difference at rest shows it. A rest
/// that was captured after the exchange has changed places with the capacitors:
/// both are looked at, and then two pairs are named again.
pub fn swapped(unit: &ThreeAxisModel, readings: &[[f64; 4]], sigma: [f64; 4]) -> Vec<[usize; 2]> {
    let count = readings.len() as f64;
    let bound = count + BEYOND * (2.0 * count).sqrt();
    if misfit(unit, readings, sigma, None) <= bound {
        return Vec::new();
    }
    let explains = |pair: &[usize; 2]| {
        [*unit, with_rest_exchanged(*unit, *pair)]
            .iter()
            .any(|unit| misfit(unit, readings, sigma, Some(*pair)) <= bound)
    };
    PAIRS.into_iter().filter(explains).collect()
}

/// Collects readings of units that contradict themselves, and looks whether an
/// exchange of two capacitors explains them.
#[derive(Debug, Clone)]
pub struct SwapWatch {
    units: Vec<Suspect>,
}

#[derive(Debug, Clone, Default)]
struct Suspect {
    last: Option<[f64; 4]>,
    readings: Vec<[f64; 4]>,
    pairs: Vec<[usize; 2]>,
}

/// Readings that are judged together ...
const READINGS: usize = 12;
/// ... of several loads: one and the same reading may be explained by chance. Each
/// differs from the one before by more than this many deviations.
const APART: f64 = 10.0;

impl SwapWatch {
    /// For an array of so many units.
    pub fn new(units: usize) -> Self {
        Self {
            units: vec![Suspect::default(); units],
        }
    }

    /// Takes the capacitances, F, of a unit in a frame that contradict its model
    /// with the noise `sigma`, F.
    pub fn push(
        &mut self,
        unit: usize,
        reading: [f64; 4],
        model: &ThreeAxisModel,
        sigma: [f64; 4],
    ) {
        let Some(suspect) = self.units.get_mut(unit) else {
            return;
        };
        let differs = suspect
            .last
            .is_none_or(|last| (0..4).any(|i| (reading[i] - last[i]).abs() > APART * sigma[i]));
        if !differs || reading.iter().any(|value| !value.is_finite()) {
            return;
        }
        suspect.last = Some(reading);
        suspect.readings.push(reading);
        if suspect.readings.len() == READINGS {
            suspect.pairs = swapped(model, &suspect.readings, sigma);
            suspect.readings.clear();
        }
    }

    /// The pairs of capacitors of a unit, one of which has changed places according
    /// to its last readings; empty when none explains them.
    pub fn pairs(&self, unit: usize) -> &[[usize; 2]] {
        self.units.get(unit).map_or(&[], |unit| &unit.pairs)
    }

    /// Begins anew, as after new rest values.
    pub fn forget(&mut self) {
        self.units.fill(Suspect::default());
    }
}

/// The unit whose rest was captured with the pair in each other's place.
fn with_rest_exchanged(mut unit: ThreeAxisModel, [a, b]: [usize; 2]) -> ThreeAxisModel {
    unit.plates.air_gap.swap(a, b);
    unit.plates.parallel_capacitance.swap(a, b);
    unit
}

/// Sum of the misfits of all readings, each of one degree of freedom, with a
/// pair exchanged.
fn misfit(
    unit: &ThreeAxisModel,
    readings: &[[f64; 4]],
    sigma: [f64; 4],
    pair: Option<[usize; 2]>,
) -> f64 {
    let options = SearchOptions::default();
    let one = |reading: &[f64; 4]| {
        let mut reading = *reading;
        if let Some([a, b]) = pair {
            reading.swap(a, b);
        }
        let found = estimate_unit(unit, reading, sigma, [true; 4], &options);
        // Without a force nothing is explained.
        if found.chi2.is_nan() {
            f64::INFINITY
        } else {
            found.chi2
        }
    };
    readings.iter().map(one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::Sensor;

    fn readings(unit: &ThreeAxisModel) -> Vec<[f64; 4]> {
        let forces = [
            [3e-3, 0.0, 8e-3],
            [0.0, 3e-3, 8e-3],
            [-2e-3, 1e-3, 6e-3],
            [1e-3, -3e-3, 9e-3],
            [0.0, 0.0, 0.0],
        ];
        let capacitance = |force| unit.predict(force).1.capacitance();
        forces.into_iter().map(capacitance).collect()
    }

    #[test]
    fn a_swap_is_named_with_its_mirror_and_a_sound_unit_has_none() {
        let sensor = Sensor::shipped("three-axis-8x8").unwrap();
        let unit = sensor.three_axis().unwrap().unit_model();
        let sound = readings(&unit);
        assert!(swapped(&unit, &sound, [1e-16; 4]).is_empty());
        for (pair, named) in [
            ([0, 1], vec![[0, 1], [2, 3]]),
            ([2, 3], vec![[0, 1], [2, 3]]),
            ([0, 2], vec![[0, 2], [1, 3]]),
            ([0, 3], vec![]),
        ] {
            let mut wrong = sound.clone();
            for reading in &mut wrong {
                reading.swap(pair[0], pair[1]);
            }
            assert_eq!(swapped(&unit, &wrong, [1e-16; 4]), named, "{pair:?}");
        }
    }

    #[test]
    fn a_rest_captured_after_the_swap_names_the_pair_and_its_mirror() {
        let sensor = Sensor::shipped("three-axis-8x8").unwrap();
        let mut unit = sensor.three_axis().unwrap().unit_model();
        for (gap, scatter) in unit.plates.air_gap.iter_mut().zip([1.03, 0.96, 0.99, 0.99]) {
            *gap *= scatter;
        }
        let mut wrong = readings(&unit);
        for reading in &mut wrong {
            reading.swap(0, 1);
        }
        assert_eq!(swapped(&unit, &wrong, [1e-16; 4]), [[0, 1]]);
        let captured = with_rest_exchanged(unit, [0, 1]);
        assert_eq!(swapped(&captured, &wrong, [1e-16; 4]), [[0, 1], [2, 3]]);
    }

    #[test]
    fn a_swap_is_watched_for_under_changing_loads_only() {
        let sensor = Sensor::shipped("three-axis-8x8").unwrap();
        let unit = sensor.three_axis().unwrap().unit_model();
        let mut wrong = readings(&unit);
        for reading in &mut wrong {
            reading.swap(0, 1);
        }
        let mut watch = SwapWatch::new(2);
        for _ in 0..100 {
            watch.push(0, wrong[0], &unit, [1e-16; 4]);
        }
        assert!(watch.pairs(0).is_empty());
        for reading in wrong.iter().cycle().take(READINGS) {
            watch.push(1, *reading, &unit, [1e-16; 4]);
        }
        assert_eq!(watch.pairs(1), [[0, 1], [2, 3]]);
        watch.forget();
        assert!(watch.pairs(1).is_empty());
    }

    #[test]
    fn what_no_exchange_explains_names_none() {
        let sensor = Sensor::shipped("three-axis-8x8").unwrap();
        let unit = sensor.three_axis().unwrap().unit_model();
        let mut wrong = readings(&unit);
        for reading in &mut wrong {
            reading[0] *= 1.05;
        }
        assert!(swapped(&unit, &wrong, [1e-16; 4]).is_empty());
    }
}
