//! Channels brought to one scale.

use serde::{Deserialize, Serialize};

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

#[cfg(test)]
mod tests {
    use super::*;

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
