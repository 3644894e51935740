//! How far the zero of an estimate may be off, as the estimates show while nothing touches.
//!
//! The readings of a body that creeps cannot be followed between touches: its zero may drift
//! unseen. What is seen is the estimate in the pauses, which should be zero within its stated
//! deviation. The mean square by which it is not, beyond what is stated and what chance does,
//! is the variance of the zero.

/// The doubt about the zero of one estimate, in its unit.
#[derive(Debug, Clone, Default)]
pub(super) struct ZeroDoubt {
    pause: Pause,
    /// The last mean, its stated variance: it counts once the next one is complete, as it may be the
    /// beginning of a contact.
    last: Option<[f64; 2]>,
    /// Means of pauses: sums of their squares and of the stated variances, and their number,
    /// forgotten in time.
    squares: f64,
    stated: f64,
    number: f64,
    /// Since the zero was taken, and since the last mean, s.
    age: f64,
    since: f64,
}

/// The empty body since the last contact or the last mean.
#[derive(Debug, Clone, Copy, Default)]
struct Pause {
    estimates: f64,
    variances: f64,
    frames: f64,
    time: f64,
}

/// Time over which pauses are forgotten, s.
const MEMORY: f64 = 600.0;
/// Time after a contact until the estimates count, and time of one mean, s.
const SETTLING: f64 = 0.25;
pub(super) const MEAN: f64 = 2.0;
/// An excess of this many of its deviations is none of chance.
const CHANCE: f64 = 2.0;

impl ZeroDoubt {
    /// A frame `elapsed` s after the one before. `free` is the estimate, with its stated
    /// deviation, of a body that nothing touches; none while it is touched. The mean of a pause
    /// that this frame completes.
    pub(super) fn push(&mut self, elapsed: f64, free: Option<[f64; 2]>) -> Option<f64> {
        self.age += elapsed;
        self.since += elapsed;
        let Some([value, deviation]) = free else {
            (self.pause, self.last) = (Pause::default(), None);
            return None;
        };
        let pause = &mut self.pause;
        pause.time += elapsed;
        if pause.time < SETTLING {
            return None;
        }
        pause.estimates += value;
        pause.variances += deviation * deviation;
        pause.frames += 1.0;
        if pause.time < SETTLING + MEAN {
            return None;
        }
        let mean = [pause.estimates, pause.variances].map(|sum| sum / pause.frames);
        // A long pause goes on.
        *pause = Pause {
            time: SETTLING,
            ..Pause::default()
        };
        let [mean, stated] = self.last.replace(mean)?;
        let stay = (-self.since / MEMORY).exp();
        self.squares = stay * self.squares + mean * mean;
        self.stated = stay * self.stated + stated;
        self.number = stay * self.number + 1.0;
        self.since = 0.0;
        Some(mean)
    }

    /// Standard deviation of the zero. Where it drifted it goes on drifting as it did on
    /// average since it was taken.
    pub(super) fn deviation(&self) -> f64 {
        if self.number < 1.0 {
            return 0.0;
        }
        let chance = 1.0 + CHANCE * (2.0 / self.number).sqrt();
        let excess = (self.squares - chance * self.stated).max(0.0) / self.number;
        let seen = (self.age - self.since).max(MEMORY);
        excess.sqrt() * (1.0 + self.since / seen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pauses of 5 s every 10 s with the estimate `of` the time, over `seconds`, stated as 1.
    fn after(doubt: &mut ZeroDoubt, seconds: f64, of: impl Fn(f64) -> f64) {
        let step = 0.05;
        let mut time = 0.0;
        while time < seconds {
            let free = (time % 10.0 > 5.0).then(|| [of(time), 1.0]);
            let _ = doubt.push(step, free);
            time += step;
        }
    }

    #[test]
    fn a_zero_within_its_stated_deviation_leaves_no_doubt() {
        let mut doubt = ZeroDoubt::default();
        after(&mut doubt, 3600.0, |time| {
            if time % 20.0 < 10.0 { 1.0 } else { -1.0 }
        });
        assert_eq!(doubt.deviation(), 0.0);
    }

    #[test]
    fn a_zero_that_is_off_is_doubted_by_as_much_and_goes_on_while_it_is_not_seen() {
        let mut doubt = ZeroDoubt::default();
        // 4 in an hour.
        after(&mut doubt, 7200.0, |time| time / 900.0);
        let found = doubt.deviation();
        assert!((6.5..8.0).contains(&found), "{found}");
        (0..36_000).for_each(|_| assert_eq!(doubt.push(0.1, None), None));
        let held = doubt.deviation();
        assert!((1.45..1.55).contains(&(held / found)), "{held} {found}");
        // The zero is right again.
        after(&mut doubt, 3600.0, |_| 0.0);
        assert_eq!(doubt.deviation(), 0.0);
    }
}
