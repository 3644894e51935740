//! Channels brought to one scale, and their products.

use serde::{Deserialize, Serialize};
use taxel_numerics::dense::long_dot;

use super::TrainingError;

/// Which channels are used and how they are scaled: z = (x − centre)/scale.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standard {
    /// Number of channels of a frame.
    pub channels: usize,
    /// Channels in use, counted from 0; constant and dead ones are left out.
    pub used: Vec<usize>,
    /// Offset that is subtracted from each channel in use.
    pub centre: Vec<f64>,
    /// Deviation of each channel in use over the training frames.
    pub scale: Vec<f64>,
}

impl Standard {
    /// The scale of `frames`, all of the same length. A channel that never
    /// changes, or has no reading in more than half of them, is not used.
    ///
    /// # Errors
    /// [`TrainingError`] without frames or when no channel changes.
    pub fn of(frames: &[Vec<f64>]) -> Result<Self, TrainingError> {
        let Some(first) = frames.first() else {
            return Err(TrainingError::TooFew {
                found: 0,
                needed: 1,
            });
        };
        let mut standard = Self {
            channels: first.len(),
            used: Vec::new(),
            centre: Vec::new(),
            scale: Vec::new(),
        };
        for channel in 0..first.len() {
            let readings = || frames.iter().map(|f| f[channel]).filter(|x| x.is_finite());
            let count = readings().count() as f64;
            let mean = readings().sum::<f64>() / count;
            let deviation = (readings().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
            // Rounding of the mean alone makes 1e-16 of it.
            let changes = deviation > 1e-12 * mean.abs() && deviation > 0.0;
            if changes && 2.0 * count > frames.len() as f64 {
                standard.used.push(channel);
                standard.centre.push(mean);
                standard.scale.push(deviation);
            }
        }
        if standard.used.is_empty() {
            return Err(TrainingError::NoSignal);
        }
        Ok(standard)
    }

    /// True if a scale from a file is one.
    pub(super) fn is_sound(&self) -> bool {
        let count = self.used.len();
        count > 0
            && self.centre.len() == count
            && self.scale.len() == count
            && self.used.iter().all(|channel| *channel < self.channels)
            && self.centre.iter().all(|centre| centre.is_finite())
            && self
                .scale
                .iter()
                .all(|scale| *scale > 0.0 && scale.is_finite())
    }

    /// Channels that are not used, counted from 1, for people.
    pub fn left_out(&self) -> Vec<usize> {
        let unused = |channel: &usize| !self.used.contains(&(channel - 1));
        (1..=self.channels).filter(unused).collect()
    }

    /// The used channels of `frame`, scaled.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or a missing reading.
    pub fn apply(&self, frame: &[f64]) -> Result<Vec<f64>, TrainingError> {
        if frame.len() != self.channels {
            return Err(TrainingError::Channels {
                found: frame.len(),
                expected: self.channels,
            });
        }
        let scaled = self.used.iter().zip(self.centre.iter().zip(&self.scale));
        scaled
            .map(|(channel, (centre, scale))| {
                let value = (frame[*channel] - centre) / scale;
                if value.is_finite() {
                    Ok(value)
                } else {
                    Err(TrainingError::Dead {
                        channel: channel + 1,
                    })
                }
            })
            .collect()
    }
}

/// All products of at most `degree` inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Polynomial {
    /// Largest number of factors, 1 to 3.
    pub degree: u8,
}

impl Polynomial {
    /// Number of features of so many inputs, the constant among them.
    pub fn count(self, inputs: usize) -> usize {
        let degree = usize::from(self.degree);
        (1..=degree).fold(1, |count, factors| count * (inputs + factors) / factors)
    }

    /// Appends 1, zᵢ, zᵢzⱼ (i ≤ j), … of the inputs to `features`.
    pub fn expand(self, inputs: &[f64], features: &mut Vec<f64>) {
        features.push(1.0);
        features.extend_from_slice(inputs);
        match self.degree {
            ..2 => {}
            2 => {
                for (i, a) in inputs.iter().enumerate() {
                    features.extend(inputs[i..].iter().map(|b| a * b));
                }
            }
            _ => {
                for (i, a) in inputs.iter().enumerate() {
                    for (j, b) in inputs.iter().enumerate().skip(i) {
                        features.push(a * b);
                        features.extend(inputs[j..].iter().map(|c| a * b * c));
                    }
                }
            }
        }
    }

    /// By how much Σ wₖ fₖ of the features changes with each input, added to `slopes`.
    pub(super) fn slopes(self, weights: &[f64], inputs: &[f64], slopes: &mut [f64]) {
        let weights = weights.get(1..).unwrap_or_default();
        let (single, mut weights) = weights.split_at(weights.len().min(inputs.len()));
        for (slope, weight) in slopes.iter_mut().zip(single) {
            *slope += weight;
        }
        if self.degree == 2 {
            for (i, a) in inputs.iter().enumerate() {
                let (row, others) = weights.split_at(weights.len().min(inputs.len() - i));
                weights = others;
                for (slope, weight) in slopes[i..].iter_mut().zip(row) {
                    *slope += weight * a;
                }
                slopes[i] += long_dot(row, &inputs[i..]);
            }
        } else if self.degree > 2 {
            of_cubes(weights, inputs, slopes);
        }
    }
}

/// Slopes of the products of two and of three.
fn of_cubes(weights: &[f64], inputs: &[f64], slopes: &mut [f64]) {
    let mut weights = weights.iter();
    for (i, a) in inputs.iter().enumerate() {
        let mut along = 0.0;
        for (j, b) in inputs.iter().enumerate().skip(i) {
            let weight = weights.next().unwrap_or(&0.0);
            along += weight * b;
            slopes[j] += weight * a;
            for (k, c) in inputs.iter().enumerate().skip(j) {
                let weight = weights.next().unwrap_or(&0.0);
                along += weight * b * c;
                slopes[j] += weight * a * c;
                slopes[k] += weight * a * b;
            }
        }
        slopes[i] += along;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_numerics::dense::dot;

    #[test]
    fn slopes_are_those_of_the_sum() {
        let inputs = [0.3, -1.2, 0.8, 2.0];
        for degree in 1..=3 {
            let polynomial = Polynomial { degree };
            let expanded = |inputs: &[f64]| {
                let mut features = Vec::new();
                polynomial.expand(inputs, &mut features);
                features
            };
            let count = expanded(&inputs).len();
            let weights: Vec<f64> = (0..count).map(|k| (k as f64).cos()).collect();
            let mut slopes = [0.0; 4];
            polynomial.slopes(&weights, &inputs, &mut slopes);
            for (input, slope) in slopes.into_iter().enumerate() {
                let at = |off: f64| {
                    let mut moved = inputs;
                    moved[input] += off;
                    dot(&weights, &expanded(&moved))
                };
                let step = 1e-5;
                let expected = (at(step) - at(-step)) / (2.0 * step);
                assert!((slope - expected).abs() < 1e-8, "{slope} {expected}");
            }
        }
    }

    #[test]
    fn products_are_counted_once() {
        // n + k over k products of at most k of n inputs.
        for (degree, count) in [(1, 5), (2, 15), (3, 35)] {
            let mut features = Vec::new();
            Polynomial { degree }.expand(&[2.0, 3.0, 5.0, 7.0], &mut features);
            assert_eq!(features.len(), count);
            assert_eq!(Polynomial { degree }.count(4), count);
            features.sort_by(f64::total_cmp);
            features.dedup();
            assert_eq!(features.len(), count);
        }
    }

    #[test]
    fn constant_and_dead_channels_are_named() {
        let frames = [[1.0, 4.0, f64::NAN, 0.0], [3.0, 4.0, f64::NAN, 1.0]];
        let standard = Standard::of(&frames.map(Vec::from)).unwrap();
        assert_eq!(standard.left_out(), [2, 3]);
        assert_eq!(standard.apply(&frames[1]), Ok(vec![1.0, 1.0]));
        assert_eq!(
            standard.apply(&[1.0, 0.0, 0.0, f64::NAN]),
            Err(TrainingError::Dead { channel: 4 })
        );
        assert!(Standard::of(&[vec![1.0], vec![1.0]]).is_err());
    }
}
