//! Recordings of touches that are known by construction, in the formats of their vendors.
//!
//! Every sample has a function for its truth (forces in N, lengths in m, times in s), so that
//! a test compares what is decoded with what was pressed. The same seed gives the same bytes.
#![allow(
    dead_code,
    reason = "tests read what is true, the example what is written"
)]

pub(crate) mod lattice;
pub(crate) mod tekscan;
pub(crate) mod walk;
pub(crate) mod xsensor;

/// Names and contents of all sample recordings.
pub(crate) fn all() -> Vec<(&'static str, String)> {
    let [force, position] = [lattice::force_run(), lattice::position_run()];
    vec![
        ("fingertip.csv", tekscan::fingertip()),
        ("foot.asf", tekscan::foot()),
        ("insoles.csv", xsensor::insoles()),
        ("lattice/force_sensor.csv", force.sensor),
        ("lattice/force_states.csv", force.states),
        ("lattice/position_sensor.csv", position.sensor),
        ("lattice/position_states.csv", position.states),
    ]
}

/// A round contact with the pressure of Hertz, p(r) = 3 F/(2 pi a^2) sqrt(1 - r^2/a^2).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    /// Middle, along the rows and along the columns, m from the corner of the map.
    pub(crate) centre: [f64; 2],
    /// Radius a, m.
    pub(crate) radius: f64,
    /// Force F, N.
    pub(crate) force: f64,
}

/// Points along each side of a sensel at which its pressure is taken.
const POINTS: usize = 8;

impl Contact {
    fn pressure(&self, place: [f64; 2]) -> f64 {
        let square: f64 = (0..2).map(|i| (place[i] - self.centre[i]).powi(2)).sum();
        if self.radius == 0.0 {
            return 0.0;
        }
        let rest = 1.0 - square / self.radius.powi(2);
        1.5 * self.force / (std::f64::consts::PI * self.radius.powi(2)) * rest.max(0.0).sqrt()
    }

    /// Mean pressure on the sensel of a map of the given pitch, Pa.
    pub(crate) fn on_sensel(&self, row: usize, column: usize, pitch: f64) -> f64 {
        let at = |cell: usize, point: usize| {
            pitch * (cell as f64 + (point as f64 + 0.5) / POINTS as f64)
        };
        let points = (0..POINTS * POINTS).map(|p| [at(row, p / POINTS), at(column, p % POINTS)]);
        points.map(|place| self.pressure(place)).sum::<f64>() / (POINTS * POINTS) as f64
    }
}

/// Force on the sensels of a map (rows and columns, pitch in m) that carry less than a threshold (Pa), N.
pub(crate) fn below(threshold: f64, contacts: &[Contact], shape: [usize; 2], pitch: f64) -> f64 {
    let cells = (0..shape[0] * shape[1]).map(|at| (at / shape[1], at % shape[1]));
    let pressures = cells.map(|(row, column)| -> f64 {
        let on_sensel = |one: &Contact| one.on_sensel(row, column, pitch);
        contacts.iter().map(on_sensel).sum()
    });
    pressures
        .filter(|pressure| *pressure < threshold)
        .sum::<f64>()
        * pitch
        * pitch
}

/// From 0 to 1 while `time` goes from `start` to `end`, without a jump of the speed.
pub(crate) fn ramp(time: f64, start: f64, end: f64) -> f64 {
    let share = ((time - start) / (end - start)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// Pseudorandom numbers (SplitMix64).
#[derive(Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Uniform from 0 to 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((word ^ (word >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Mean 0, deviation 1: the sum of twelve uniform numbers.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
