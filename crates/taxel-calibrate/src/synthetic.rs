//! Parts of synthetic tables that devices share.

use std::fmt::Write as _;

use crate::options::{IndentationOptions, SyntheticOptions};

impl SyntheticOptions {
    /// First lines of a table, with those of the options `hysteresis`, `drift` and
    /// `tilt` that mean something in it.
    pub(crate) fn head(&self, meant: &[&str]) -> String {
        let mut text = head(self.seed, self.noise);
        for (name, value, unit) in [
            ("hysteresis", self.hysteresis, ""),
            ("drift", self.drift, ""),
            ("tilt", self.tilt, " rad"),
        ] {
            if meant.contains(&name) {
                let _ = write!(text, ", {name} {value}{unit}");
            }
        }
        text.push('\n');
        text
    }

    /// Position of a reading within its cycle of loading and unloading, from 0 to 1.
    pub(crate) fn phase(&self, index: usize) -> f64 {
        (self.cycles as f64 * index as f64 / self.readings as f64).fract()
    }

    /// The drift of a signal of this range up to a reading.
    pub(crate) fn drifted(&self, range: f64, index: usize) -> f64 {
        self.drift * range * index as f64 / self.readings as f64
    }
}

impl IndentationOptions {
    /// First lines of a table.
    pub(crate) fn head(&self) -> String {
        head(self.seed, self.noise) + "\n"
    }
}

fn head(seed: u64, noise: f64) -> String {
    format!("# synthetic calibration data\n# seed {seed}, noise {noise}")
}

/// A load that goes up and down once in a cycle: its share of the largest.
pub(crate) fn triangle(phase: f64) -> f64 {
    let turn = 2.0 * phase;
    if turn < 1.0 { turn } else { 2.0 - turn }
}

/// A comment with the true value of a constant.
pub(crate) fn truth(name: &str, value: f64, unit: &str) -> String {
    format!("# truth {name} = {value:e} {unit}\n")
}
