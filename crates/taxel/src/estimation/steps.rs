//! Steps of readings: a reading in whole counts says no more than its rounding lets through.

use super::reader::Reader;

/// Noise is no less than this share of a step: rounding alone has 1/√12 = 0.289 of it, and a touch,
/// which is above six deviations, is above two steps.
const SHARE: f64 = 1.0 / 3.0;

/// The least noise that the steps of each channel leave.
#[derive(Debug, Clone)]
pub(super) struct Steps {
    /// In the unit of a frame; 0 for readings without steps, `NaN` where it is not known.
    widths: Vec<f64>,
    /// Drawn noise, SI, over that in the unit of a frame.
    per_unit: Vec<f64>,
    /// True as long as every reading of a channel whose step is not known was a whole count.
    whole: bool,
}

impl Steps {
    /// As the reader of a device knows them, whose channels have this noise, SI.
    pub(super) fn new(reader: &dyn Reader, noise: &[f64]) -> Self {
        let channels = || reader.channels().iter();
        let known = |step: f64| if step > 0.0 { step } else { f64::NAN };
        let per_unit = |(noise, own): (&f64, f64)| {
            let per_unit = noise / own;
            if per_unit.is_finite() { per_unit } else { 1.0 }
        };
        let deviations = channels().map(|facts| facts.deviation);
        Self {
            widths: channels().map(|facts| known(facts.resolution)).collect(),
            per_unit: noise.iter().zip(deviations).map(per_unit).collect(),
            whole: reader.meaning().reading.quantity == "counts",
        }
    }

    /// Takes those of the wire, in the unit of a frame.
    pub(super) fn state(&mut self, steps: &[f64]) {
        for (own, stated) in self.widths.iter_mut().zip(steps) {
            if !stated.is_nan() {
                *own = *stated;
            }
        }
    }

    /// Looks at the readings of a frame; true if they show that counts are not whole.
    pub(super) fn look(&mut self, values: &[f64]) -> bool {
        let broken =
            |(step, value): (&f64, &f64)| step.is_nan() && !value.is_nan() && value.fract() != 0.0;
        let found = self.whole && self.widths.iter().zip(values).any(broken);
        self.whole &= !found;
        found
    }

    /// Noise of a channel, SI, and no less than its steps leave; `NaN` where it is not known.
    pub(super) fn at_least(&self, channel: usize, noise: f64) -> f64 {
        let step = match self.widths[channel] {
            step if !step.is_nan() => step,
            _ if self.whole => 1.0,
            _ => 0.0,
        };
        let least = SHARE * step * self.per_unit[channel];
        if noise < least { least } else { noise }
    }
}
