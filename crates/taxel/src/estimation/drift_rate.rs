//! How fast the empty channels of a device drift, as those that nothing touches show.

/// The variance of the rates of drift, over that of a reading, 1/s².
///
/// Before anything was observed a rate is as likely anything up to the fastest. The
/// square of an observed rate less that of its noise is an unbiased sample; samples are
/// averaged over all channels and a time of forgetting. When a mean of all channels is
/// more than the noise of the samples allows, the past is forgotten: a drift has begun.
#[derive(Debug, Clone)]
pub(super) struct DriftRate {
    /// The fastest rate.
    fastest: f64,
    /// Variance before anything was observed.
    prior: f64,
    /// Sum and number of the samples, forgotten in time.
    sum: f64,
    count: f64,
    /// The standard deviation that follows.
    deviation: f64,
    /// Since the last samples, s.
    elapsed: f64,
}

/// The rate of an empty channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// In deviations of a reading per second.
    pub(super) rate: f64,
    /// Variance of its noise as large as it may be, and the least that it has.
    pub(super) noise: [f64; 2],
    /// True if it is followed all the time, not measured now.
    pub(super) followed: bool,
}

/// Time between samples, s.
const EVERY: f64 = 20.0;
/// ... when a channel that is held was seen to drift.
const SOON: f64 = 1.0;
/// Time over which samples are forgotten, s.
const MEMORY: f64 = 600.0;
/// Samples that what is expected beforehand is worth.
const EXPECTED: f64 = 0.3;
/// A rate may exceed the fastest by this many deviations of its noise.
const LEAST: f64 = 3.0;
/// Rates up to this many of their deviations belong to a drift.
const FASTEST: f64 = 3.0;
/// A drift of this share of the fastest is followed though none was seen before.
const SLOW: f64 = 0.15;
/// A mean of samples this many of its deviations above what is known is a new drift.
const NEW: f64 = 5.0;

impl DriftRate {
    /// Of channels that drift by at most `fastest` deviations of a reading per second.
    pub(super) fn new(fastest: f64) -> Self {
        let prior = fastest * fastest / 3.0;
        Self {
            fastest,
            prior,
            sum: 0.0,
            count: 0.0,
            deviation: prior.sqrt(),
            elapsed: 0.0,
        }
    }

    /// Standard deviation of the rates, in deviations of a reading per second.
    pub(super) fn deviation(&self) -> f64 {
        self.deviation
    }

    /// A channel whose reading changes faster does not drift, as far as is known.
    pub(super) fn fastest(&self) -> f64 {
        (FASTEST * self.deviation).clamp(SLOW * self.fastest, self.fastest)
    }

    /// True when it is time for samples; `step` s have passed, and a channel that is held
    /// was `seen` to drift or not.
    pub(super) fn is_due(&mut self, step: f64, seen: bool) -> bool {
        self.elapsed += step;
        self.elapsed >= if seen { SOON } else { EVERY }
    }

    /// Takes observed rates, whose noise has about the variance `noise` or more. True if they
    /// show that a drift has begun.
    ///
    /// The larger variance says what a rate may be and what it weighs; the least is taken
    /// from its square: more would let a drift that goes on be forgotten.
    pub(super) fn learn(&mut self, rates: impl Iterator<Item = Seen>, noise: f64) -> bool {
        let elapsed = std::mem::take(&mut self.elapsed);
        let known = self.deviation * self.deviation;
        let [mut sum, mut count, mut surprise, mut number] = [0.0; 4];
        for seen in rates {
            let (rate, [variance, least]) = (seen.rate, seen.noise);
            // Faster is no drift.
            if rate.abs() > self.fastest + LEAST * variance.sqrt() {
                continue;
            }
            let share = if seen.followed { elapsed / EVERY } else { 1.0 };
            let weight = share * 2.0 * noise / (noise + variance);
            sum += weight * (rate * rate - least);
            count += weight;
            surprise += rate * rate / (known + variance);
            number += 1.0;
        }
        if count == 0.0 {
            return false;
        }
        let new = surprise > number + NEW * f64::sqrt(2.0 * number);
        let stay = if new { 0.0 } else { (-elapsed / MEMORY).exp() };
        self.sum = stay * self.sum + sum;
        self.count = stay * self.count + count;
        // The mean of the samples and of what is expected, and its deviation.
        let count = EXPECTED + self.count;
        let mean = (EXPECTED * self.prior + self.sum) / count;
        self.deviation = (mean.max(0.0) + noise * (2.0 / count).sqrt()).sqrt();
        new
    }
}
