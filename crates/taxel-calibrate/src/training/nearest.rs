//! The mean of the nearest training frames: the yardstick of other maps.

use taxel::trained::{Standard, TrainingError};

/// Training frames with their targets.
#[derive(Debug, Clone)]
pub struct Nearest {
    standard: Standard,
    frames: Vec<Vec<f64>>,
    targets: Vec<Vec<f64>>,
    neighbours: usize,
}

impl Nearest {
    /// Keeps `frames` and `targets`; an estimate is the mean of the
    /// `neighbours` nearest ones, in deviations of the channels.
    ///
    /// # Errors
    /// [`TrainingError`] for fewer frames than neighbours.
    pub fn train(
        frames: &[Vec<f64>],
        targets: &[Vec<f64>],
        neighbours: usize,
    ) -> Result<Self, TrainingError> {
        let found = frames.len();
        let needed = neighbours.max(2);
        if found < needed {
            return Err(TrainingError::TooFew { found, needed });
        }
        let standard = Standard::of(frames)?;
        let frames = frames.iter().map(|frame| standard.apply(frame));
        Ok(Self {
            frames: frames.collect::<Result<_, _>>()?,
            targets: targets.to_vec(),
            neighbours: needed,
            standard,
        })
    }

    /// Mean and variance of the targets of the nearest frames.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another kind.
    pub fn estimate(&self, frame: &[f64]) -> Result<Vec<[f64; 2]>, TrainingError> {
        let z = self.standard.apply(frame)?;
        let distance =
            |other: &Vec<f64>| -> f64 { other.iter().zip(&z).map(|(a, b)| (a - b).powi(2)).sum() };
        let mut order: Vec<(f64, usize)> = self.frames.iter().map(distance).zip(0..).collect();
        order.select_nth_unstable_by(self.neighbours - 1, |a, b| a.0.total_cmp(&b.0));
        let chosen = &order[..self.neighbours];
        let count = chosen.len() as f64;
        let estimate = |target: usize| {
            let values = || chosen.iter().map(|(_, row)| self.targets[*row][target]);
            let mean = values().sum::<f64>() / count;
            let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
            // Neighbours that agree say little: one in `count` more may differ.
            [mean, variance * (1.0 + 1.0 / count)]
        };
        let width = self.targets.first().map_or(0, Vec::len);
        Ok((0..width).map(estimate).collect())
    }
}
