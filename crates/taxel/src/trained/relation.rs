//! How the channels of a device hang together: what each must read beside the others.
//!
//! The scaled readings z of all frames of training have a covariance C with the inverse P.
//! Under a normal law a channel is expected, beside the others, at
//! ẑᵢ = −Σⱼ Pᵢⱼ zⱼ/Pᵢᵢ with the variance 1/Pᵢᵢ, and the frame as a whole has the misfit
//! χ² = zᵀPz. Without channel m the inverse is P − p pᵀ/Pₘₘ with p its column m, so χ² falls by
//! (Pz)ₘ²/Pₘₘ (the sweep operator; A. P. Dempster, *Elements of Continuous Multivariate
//! Analysis*, 1969). A reading that alone makes a frame unlike training is wrong; a frame that
//! stays unlike it is another touch.
//!
//! What readings of the empty body leave of zero against the relation is drift, d: each frame of it
//! takes dᵢ by (P(z − z₀ − d))ᵢ/Pᵢᵢ times its share of the time of following, with z₀ the body at
//! rest. Creep is in the frames of training, so along it P is small and it is not taken.

use serde::{Deserialize, Serialize};
use taxel_numerics::dense::{cholesky, cholesky_solve, long_dot};

use super::{Standard, TrainingError};

/// A relation of the channels, learned from frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relation {
    /// True if it is one of readings less those at rest.
    pub tared: bool,
    /// Channels and their scale.
    pub standard: Standard,
    /// P, rows of the lower triangle one after the other.
    pub precision: Vec<f64>,
    /// Standard deviation of each scaled channel about what the others say, of held-out frames of the empty
    /// body.
    pub deviation: Vec<f64>,
    /// By how much it grows with the load of the others, the root of the sum of their squares: a press on one
    /// channel is no fault.
    pub of_load: Vec<f64>,
    /// A reading that contradicts is farther than these deviations by this factor: no sound frame that was held out
    /// came half as far.
    pub tolerance: f64,
    /// Largest χ² of a frame that was held out.
    pub largest_misfit: f64,
}

/// Channels of a frame that contradict the others, and what they must read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Judged {
    /// For each channel in use its distance from what the others say, in deviations times the tolerance; `NaN`
    /// without a reading.
    pub scores: Vec<f64>,
    /// For each channel in use whether its reading is wrong or missing.
    pub left_out: Vec<bool>,
    /// Standard deviation of the readings that were replaced, in the unit of a channel; zero of
    /// the others.
    pub deviation: Vec<f64>,
    /// By how much the readings in use, over their scale, differ from what the others say beyond
    /// what frames of training do: the root of the sum of the squares.
    pub unexplained: f64,
    /// True if the frame is unlike all of training, whichever channels are left out.
    pub unlike: bool,
}

/// A reading this many deviations from what the others say is suspected; and one that was left
/// out is taken again below half of it.
pub const CONTRADICTS: f64 = 8.0;
/// Frames of training differ by up to this many deviations from what the others say.
const USUAL: f64 = 2.0;
/// A frame with less than this many times the largest misfit of training is like training.
const LIKE: f64 = 2.0;
/// At most this share of the channels can be wrong beside the others.
const MOST_WRONG: f64 = 1.0 / 3.0;

impl Relation {
    /// Checks that the parts of a relation from a file belong together.
    ///
    /// # Errors
    /// [`TrainingError::Unsound`].
    pub(super) fn check(&self) -> Result<(), TrainingError> {
        let width = self.standard.used.len();
        let positive = |values: &[f64]| values.iter().all(|v| *v > 0.0 && v.is_finite());
        let diagonal: Vec<f64> = (1..=width)
            .filter_map(|i| self.precision.get(i * (i + 1) / 2 - 1).copied())
            .collect();
        let sound = self.standard.is_sound()
            && self.precision.len() == width * (width + 1) / 2
            && self.precision.iter().all(|entry| entry.is_finite())
            && positive(&diagonal)
            && self.deviation.len() == width
            && positive(&self.deviation)
            && self.of_load.len() == width
            && self
                .of_load
                .iter()
                .all(|of_load| *of_load >= 0.0 && of_load.is_finite())
            && positive(&[self.largest_misfit, self.tolerance]);
        if sound {
            Ok(())
        } else {
            Err(TrainingError::Unsound { table: "relation" })
        }
    }

    fn entry(&self, i: usize, j: usize) -> f64 {
        let (row, column) = if i >= j { (i, j) } else { (j, i) };
        self.precision[row * (row + 1) / 2 + column]
    }
}

/// Judges frame by frame, with what was wrong before.
#[derive(Debug, Clone)]
pub struct RelationWatch {
    relation: Relation,
    /// P in full, and the work copy without the channels that are left out.
    full: Vec<f64>,
    swept: Vec<f64>,
    /// True while the work copy is P itself.
    whole: bool,
    scaled: Vec<f64>,
    product: Vec<f64>,
    /// Channels that were wrong in the frame before.
    before: Vec<bool>,
    /// Scaled drift of each channel in use, and its rate, 1/s.
    drift: Vec<f64>,
    rate: Vec<f64>,
    /// Sum of the scaled readings of a pause over its time, and the time, s.
    pause: Vec<f64>,
    paused: f64,
    /// For how long each of them has agreed again, s.
    agrees: Vec<f64>,
    /// Channels that are left out, each with what the others say of it and the growth of its
    /// variance.
    said: Vec<(usize, [f64; 2])>,
    judged: Judged,
}

/// A channel that was left out is used again when it has agreed with the others for this time, s.
const RECOVERED: f64 = 2.0;

impl RelationWatch {
    /// A watch over channels that are all well.
    ///
    /// # Errors
    /// [`TrainingError::Unsound`] for a relation that was changed by hand.
    pub fn new(relation: Relation) -> Result<Self, TrainingError> {
        relation.check()?;
        let width = relation.standard.used.len();
        let full: Vec<f64> = (0..width * width)
            .map(|k| relation.entry(k / width, k % width))
            .collect();
        Ok(Self {
            swept: full.clone(),
            whole: true,
            full,
            scaled: vec![0.0; width],
            product: vec![0.0; width],
            before: vec![false; width],
            drift: vec![0.0; width],
            rate: vec![0.0; width],
            pause: vec![0.0; width],
            paused: 0.0,
            agrees: vec![0.0; width],
            said: Vec::new(),
            judged: Judged {
                scores: vec![0.0; width],
                left_out: vec![false; width],
                deviation: vec![0.0; width],
                unexplained: 0.0,
                unlike: false,
            },
            relation,
        })
    }

    /// The relation.
    pub fn relation(&self) -> &Relation {
        &self.relation
    }

    /// Judges a frame, `elapsed` s after the one before: takes its drift off, and replaces the
    /// readings that are wrong or missing (`NaN`) by what the others say. A frame of which too many readings are
    /// missing stays as it is. With `missing_only` no reading is called wrong: the rest of the
    /// device is not known yet.
    pub fn judge(&mut self, elapsed: f64, frame: &mut [f64], missing_only: bool) -> &Judged {
        let width = self.scaled.len();
        let most = (MOST_WRONG * width as f64) as usize;
        let standard = &self.relation.standard;
        let mut missing = 0;
        for (i, channel) in standard.used.iter().enumerate() {
            self.drift[i] += self.rate[i] * elapsed;
            let drift = standard.scale[i] * self.drift[i];
            let value = frame.get_mut(*channel).map_or(f64::NAN, |value| {
                *value -= drift;
                *value
            });
            let scaled = (value - standard.centre[i]) / standard.scale[i];
            self.judged.left_out[i] = !scaled.is_finite();
            missing += usize::from(!scaled.is_finite());
            self.scaled[i] = if scaled.is_finite() { scaled } else { 0.0 };
        }
        self.judged.deviation.fill(0.0);
        self.judged.unexplained = 0.0;
        self.judged.unlike = false;
        self.judged.scores.fill(f64::NAN);
        if missing > most {
            return &self.judged;
        }
        let absent = self.judged.left_out.clone();
        // What was wrong is not believed at once.
        for i in 0..width {
            self.judged.left_out[i] |= self.before[i];
        }
        if missing_only {
            self.before.fill(false);
            self.judged.left_out.clone_from(&absent);
            self.sweep();
            self.say();
            self.replace(frame);
            return &self.judged;
        }
        if !self.explain(most) {
            self.judged.unlike = true;
            self.judged.left_out.clone_from(&absent);
            self.sweep();
            self.multiply();
        }
        let mut changed = false;
        self.say();
        let mut said = self.said.iter().peekable();
        let mut scores = vec![0.0; width];
        for (i, score) in scores.iter_mut().enumerate() {
            *score = match said.next_if(|(channel, _)| *channel == i) {
                Some((_, [expected, _])) => (self.scaled[i] - expected).abs() / self.deviation(i),
                None => self.score(i),
            };
        }
        for (i, (absent, score)) in absent.into_iter().zip(scores).enumerate() {
            self.judged.scores[i] = if absent { f64::NAN } else { score };
            let agrees = !absent && score < 0.5 * CONTRADICTS;
            self.agrees[i] = if agrees {
                self.agrees[i] + elapsed
            } else {
                0.0
            };
            if self.judged.left_out[i] && self.agrees[i] >= RECOVERED {
                self.judged.left_out[i] = false;
                changed = true;
            }
            self.before[i] = self.judged.left_out[i] && !absent;
        }
        if changed {
            self.sweep();
            self.say();
        }
        self.judged.unexplained = self.unexplained();
        self.replace(frame);
        &self.judged
    }

    /// By how much the readings in use differ from what the others say, beyond what they may.
    fn unexplained(&self) -> f64 {
        let used = (0..self.scaled.len()).filter(|i| !self.judged.left_out[*i]);
        let squares = used.map(|i| {
            let score = self.judged.scores[i] * self.relation.tolerance;
            let beyond = (score * score - USUAL * USUAL).max(0.0);
            self.deviation(i).powi(2) * beyond
        });
        squares.sum::<f64>().sqrt()
    }

    /// The frame that was judged is one of a pause, `elapsed` s after the one before.
    pub fn rest(&mut self, elapsed: f64) {
        for (sum, scaled) in self.pause.iter_mut().zip(&self.scaled) {
            *sum += scaled * elapsed;
        }
        self.paused += elapsed;
    }

    /// Forgets the frames of the pause.
    pub fn forget_pause(&mut self) {
        self.pause.fill(0.0);
        self.paused = 0.0;
    }

    /// Takes what the frames of the pause leave of zero for drift: a share of it, and another, 1/s, for
    /// its rate; those of `gains[1]` where a channel is off by more than its deviation. Only readings that
    /// are tared have a zero.
    pub fn follow(&mut self, gains: [[f64; 2]; 2]) {
        let width = self.scaled.len();
        let paused = self.paused;
        if self.relation.tared && paused > 0.0 {
            let standard = &self.relation.standard;
            let off: Vec<f64> = (0..width)
                .map(|i| self.pause[i] / paused + standard.centre[i] / standard.scale[i])
                .collect();
            for i in (0..width).filter(|i| !self.judged.left_out[*i]) {
                let row = &self.swept[i * width..(i + 1) * width];
                let residual: f64 = row.iter().zip(&off).map(|(p, z)| p * z).sum();
                let residual = residual / row[i];
                let beyond = residual.abs() > self.relation.deviation[i];
                let [share, rate] = gains[usize::from(beyond)];
                self.drift[i] += share * residual;
                self.rate[i] += rate * residual;
            }
        }
        self.forget_pause();
    }

    /// Takes `drift` of a channel, in its unit, off the readings that follow, and what its `rate`,
    /// 1/s, adds in time.
    pub fn take_off(&mut self, channel: usize, drift: f64, rate: f64) {
        let standard = &self.relation.standard;
        if let Some(i) = standard.used.iter().position(|used| *used == channel) {
            self.drift[i] += drift / standard.scale[i];
            self.rate[i] += rate / standard.scale[i];
        }
    }

    /// While the drift is not seen its rates fade to the share `steady`.
    pub fn fade(&mut self, steady: f64) {
        self.rate.iter_mut().for_each(|rate| *rate *= steady);
    }

    /// Of the drift of a channel, `taken`, in its unit, was taken off elsewhere.
    pub fn give(&mut self, channel: usize, taken: f64) {
        let standard = &self.relation.standard;
        if let Some(i) = standard.used.iter().position(|used| *used == channel) {
            let [taken, own] = [taken / standard.scale[i], self.drift[i]];
            if taken * own > 0.0 {
                self.drift[i] -= own.signum() * taken.abs().min(own.abs());
            }
        }
    }

    /// Forgets the drift: the rest of the device was captured.
    pub fn forget_drift(&mut self) {
        self.drift.fill(0.0);
        self.rate.fill(0.0);
        self.forget_pause();
    }

    /// Leaves out one channel after the other that contradicts the rest; false if the frame
    /// stays unlike training.
    fn explain(&mut self, most: usize) -> bool {
        let limit = LIKE * self.relation.largest_misfit;
        self.sweep();
        loop {
            let misfit = self.multiply();
            let width = self.scaled.len();
            let used = (0..width).filter(|i| !self.judged.left_out[*i]);
            let gain = |i: usize| self.product[i] * self.product[i] / self.swept[i * width + i];
            let suspect = used.max_by(|a, b| gain(*a).total_cmp(&gain(*b)));
            let wrong = suspect.filter(|i| self.score(*i) > CONTRADICTS);
            let Some(wrong) = wrong else {
                return misfit <= limit;
            };
            let left_out = self.judged.left_out.iter().filter(|left_out| **left_out);
            if left_out.count() >= most {
                return false;
            }
            self.judged.left_out[wrong] = true;
            self.sweep_one(wrong);
        }
    }

    /// The inverse without all channels that are left out.
    fn sweep(&mut self) {
        if !self.whole {
            self.swept.copy_from_slice(&self.full);
            self.whole = true;
        }
        for i in 0..self.scaled.len() {
            if self.judged.left_out[i] {
                self.sweep_one(i);
            }
        }
    }

    fn sweep_one(&mut self, m: usize) {
        let width = self.scaled.len();
        self.whole = false;
        let pivot = self.swept[m * width + m];
        let column: Vec<f64> = (0..width).map(|i| self.swept[i * width + m]).collect();
        for i in 0..width {
            let factor = column[i] / pivot;
            let row = &mut self.swept[i * width..(i + 1) * width];
            for (entry, column) in row.iter_mut().zip(&column) {
                *entry -= factor * column;
            }
        }
        for i in 0..width {
            self.swept[i * width + m] = 0.0;
            self.swept[m * width + i] = 0.0;
        }
    }

    /// P z of the channels in use, and χ².
    fn multiply(&mut self) -> f64 {
        let width = self.scaled.len();
        let mut misfit = 0.0;
        for i in 0..width {
            let row = &self.swept[i * width..(i + 1) * width];
            let sum = long_dot(row, &self.scaled);
            self.product[i] = sum;
            misfit += if self.judged.left_out[i] {
                0.0
            } else {
                sum * self.scaled[i]
            };
        }
        misfit
    }

    /// Distance of a channel in use from what the others say, in deviations times the tolerance.
    fn score(&self, i: usize) -> f64 {
        let width = self.scaled.len();
        let off = (self.product[i] / self.swept[i * width + i]).abs();
        off / (self.relation.tolerance * self.deviation(i))
    }

    /// Deviation of a channel about what the others say, at their load.
    fn deviation(&self, i: usize) -> f64 {
        let used = (0..self.scaled.len()).filter(|j| *j != i && !self.judged.left_out[*j]);
        let square: f64 = used.map(|j| self.scaled[j] * self.scaled[j]).sum();
        let of_load = self.relation.of_load[i];
        (self.relation.deviation[i].powi(2) + of_load * of_load * square).sqrt()
    }

    /// What the channels in use say of each that is left out, and the variance of it over that
    /// beside all the others: Σ P_mn z_n over those left out is −Σ P_mj z_j over the others.
    fn say(&mut self) {
        let width = self.scaled.len();
        let left_out: Vec<usize> = (0..width).filter(|i| self.judged.left_out[*i]).collect();
        self.said.clear();
        if left_out.is_empty() {
            return;
        }
        let at = |i: usize, j: usize| self.full[i * width + j];
        let row = |m: &usize| left_out.iter().map(|n| at(*m, *n)).collect();
        // Not definite only after a change by hand: nothing is known then.
        let factor = cholesky(left_out.iter().map(row).collect());
        let solve = |right: &[f64]| match &factor {
            Some(factor) => cholesky_solve(factor, right),
            None => vec![f64::NAN; right.len()],
        };
        let outside = |m: &usize| -> f64 {
            let used = (0..width).filter(|j| !self.judged.left_out[*j]);
            -used.map(|j| at(*m, j) * self.scaled[j]).sum::<f64>()
        };
        let expected = solve(&left_out.iter().map(outside).collect::<Vec<f64>>());
        for (k, (channel, expected)) in left_out.iter().zip(expected).enumerate() {
            let mut unit = vec![0.0; left_out.len()];
            unit[k] = 1.0;
            let growth = solve(&unit)[k] * at(*channel, *channel);
            self.said.push((*channel, [expected, growth]));
        }
    }

    fn replace(&mut self, frame: &mut [f64]) {
        let standard = &self.relation.standard;
        for (i, [expected, growth]) in &self.said {
            if let Some(value) = frame.get_mut(standard.used[*i]) {
                *value = standard.centre[*i] + standard.scale[*i] * expected;
            }
            let deviation = self.deviation(*i) * growth.max(1.0).sqrt();
            self.judged.deviation[*i] = standard.scale[*i] * deviation;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four channels that read twice the same touch: z, z, 2z, 2z with a noise of 0.1.
    fn watch() -> RelationWatch {
        let directions = [1.0, 1.0, 2.0, 2.0, 1.5, 1.0];
        let width = directions.len();
        // Inverse of 0.01 I + d dᵀ (Sherman and Morrison).
        let square: f64 = directions.iter().map(|d| d * d).sum();
        let precision = (0..width).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let precision = precision.map(|(i, j)| {
            let own = if i == j { 100.0 } else { 0.0 };
            own - 1e4 * directions[i] * directions[j] / (1.0 + 100.0 * square)
        });
        RelationWatch::new(Relation {
            tared: true,
            standard: Standard {
                channels: width,
                used: (0..width).collect(),
                centre: vec![0.0; width],
                scale: vec![1.0; width],
            },
            precision: precision.collect(),
            deviation: vec![0.12; width],
            of_load: vec![0.0; width],
            tolerance: 1.0,
            largest_misfit: 20.0,
        })
        .unwrap()
    }

    #[test]
    fn a_wrong_reading_is_replaced_by_what_the_others_say() {
        let mut watch = watch();
        for wrong in [30.0, 0.0, f64::NAN] {
            let mut frame = [3.0, 3.0, 6.0, 6.0, 4.5, 3.0];
            frame[2] = wrong;
            let judged = watch.judge(0.01, &mut frame, false).clone();
            assert_eq!(judged.left_out, [false, false, true, false, false, false]);
            // The others know z to 0.1 over the root of their squares.
            assert!((frame[2] - 6.0).abs() < 0.02, "{frame:?}");
            assert!(judged.deviation[2] > 0.1 && judged.deviation[3] == 0.0);
        }
    }

    #[test]
    fn a_reading_is_believed_again_after_it_has_agreed_for_long() {
        let mut watch = watch();
        let sound = [3.0, 3.0, 6.0, 6.0, 4.5, 3.0];
        let mut frame = sound;
        frame[0] = 9.0;
        assert!(watch.judge(0.1, &mut frame, false).left_out[0]);
        let used = (0..30).position(|_| {
            let mut frame = sound;
            !watch.judge(0.1, &mut frame, false).left_out[0]
        });
        // Two seconds of frames 0.1 s apart.
        assert!((18..=21).contains(&used.unwrap()), "{used:?}");
    }

    #[test]
    fn drift_of_the_empty_body_is_followed_and_what_looks_like_a_touch_is_not() {
        let mut watch = watch();
        // Half an hour: a drift of one channel by 3 (25 deviations), and a touch of 0.5.
        let directions = [1.0, 1.0, 2.0, 2.0, 1.5, 1.0];
        let square: f64 = directions.iter().map(|d| d * d).sum();
        let (mut last, mut drift) = ([0.0; 6], 0.0);
        for second in 0..1800 {
            drift = 3.0 * f64::from(second) / 1800.0;
            last = directions.map(|d| 0.5 * d);
            last[2] += drift;
            let judged = watch.judge(1.0, &mut last, false);
            assert!(judged.left_out.iter().all(|left_out| !left_out));
            watch.rest(1.0);
            let stay = f64::exp(-1.0 / 300.0);
            watch.follow([[1.0 - stay * stay, (1.0 - stay).powi(2)]; 2]);
        }
        // The part of the drift that looks like a touch stays.
        let along: f64 = last.iter().zip(directions).map(|(v, d)| v * d).sum();
        let touch = along / square;
        let expected = 0.5 + drift * directions[2] / square;
        assert!((touch - expected).abs() < 0.08, "{touch} {expected}");
        for (value, direction) in last.iter().zip(directions) {
            assert!((value - touch * direction).abs() < 0.3, "{last:?}");
        }
        watch.forget_drift();
        let mut frame = directions;
        watch.judge(1.0, &mut frame, false);
        assert_eq!(frame, directions);
    }

    #[test]
    fn a_touch_unlike_training_is_no_fault() {
        let mut watch = watch();
        let mut frame = [3.0, -3.0, 6.0, -6.0, 4.5, -3.0];
        let judged = watch.judge(0.01, &mut frame, false);
        assert!(judged.left_out.iter().all(|left_out| !left_out));
    }
}
