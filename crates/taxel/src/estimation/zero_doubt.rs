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
    /// Means of pauses: sums of their squares and of the stated variances, and their number,
    /// forgotten in time; a short pause counts for less.
    squares: f64,
    stated: f64,
    number: f64,
    /// Since the zero was taken, and since the last mean, s.
    age: f64,
    since: f64,
    /// What the empty body shows of late.
    level: f64,
}

/// The empty body since the last contact: sums of estimates, variances and time. The end is looked
/// at only once it is not the beginning of the next contact.
#[derive(Debug, Clone, Copy, Default)]
struct Pause {
    /// Since the contact went, s.
    age: f64,
    sums: [f64; 3],
    /// The same at two earlier times.
    earlier: [[f64; 3]; 2],
    /// Since the newer of them, s.
    since: f64,
}

/// What a pause, or a part of a long one, says of the zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PauseMean {
    /// Mean of the estimates.
    pub(super) value: f64,
    /// Their time, and the time since the mean before, s.
    pub(super) time: f64,
    pub(super) since: f64,
}

/// Time over which pauses are forgotten, s.
const MEMORY: f64 = 600.0;
/// Time after a contact until the estimates count, and time of one mean at most, s.
const SETTLING: f64 = 0.25;
const MEAN: f64 = 2.0;
/// An excess of this many of its deviations is none of chance.
const CHANCE: f64 = 2.0;

impl Pause {
    fn push(&mut self, elapsed: f64, [value, deviation]: [f64; 2]) {
        self.age += elapsed;
        if self.age < SETTLING {
            return;
        }
        let [values, variances, time] = self.sums;
        let variance = deviation * deviation;
        self.sums = [
            values + value * elapsed,
            variances + variance * elapsed,
            time + elapsed,
        ];
        self.since += elapsed;
        if self.since >= SETTLING {
            self.since = 0.0;
            self.earlier = [self.sums, self.earlier[0]];
        }
    }

    /// Takes the mean with its stated variance and its time out, if it is over `least` s or more.
    fn take(&mut self, least: f64) -> Option<[f64; 3]> {
        let taken @ [values, variances, time] = self.earlier[1];
        if time <= 0.0 || time < least {
            return None;
        }
        let less = |sums: &mut [f64; 3]| sums.iter_mut().zip(taken).for_each(|(a, b)| *a -= b);
        less(&mut self.sums);
        self.earlier.iter_mut().for_each(less);
        Some([values / time, variances / time, time])
    }
}

impl ZeroDoubt {
    /// A frame `elapsed` s after the one before. `free` is the estimate, with its stated
    /// deviation, of a body that nothing touches; none while it is touched. The mean of a pause
    /// that this frame completes.
    pub(super) fn push(&mut self, elapsed: f64, free: Option<[f64; 2]>) -> Option<PauseMean> {
        self.age += elapsed;
        self.since += elapsed;
        let found = if let Some(estimate) = free {
            self.pause.push(elapsed, estimate);
            self.pause.take(MEAN)
        } else {
            std::mem::take(&mut self.pause).take(0.0)
        };
        let [value, stated, time] = found?;
        let weight = (time / MEAN).min(1.0);
        let since = std::mem::take(&mut self.since);
        let stay = (-since / MEMORY).exp();
        self.squares = stay * self.squares + weight * value * value;
        self.stated = stay * self.stated + weight * stated;
        self.number = stay * self.number + weight;
        Some(PauseMean { value, time, since })
    }

    /// What the empty body shows of late: a contact shows more.
    pub(super) fn level(&self) -> f64 {
        self.level
    }

    /// Comes after what a pause shows, at no more than the `fastest` rate of a drift: what comes
    /// faster is a contact.
    pub(super) fn show(&mut self, pause: &PauseMean, fastest: f64) {
        let most = fastest * pause.since;
        self.level += (pause.value - self.level).clamp(-most, most);
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
        for _ in 0..36_000 {
            let _ = doubt.push(0.1, None);
        }
        let held = doubt.deviation();
        assert!((1.45..1.55).contains(&(held / found)), "{held} {found}");
        // The zero is right again.
        after(&mut doubt, 3600.0, |_| 0.0);
        assert_eq!(doubt.deviation(), 0.0);
    }

    #[test]
    fn a_pause_of_a_second_is_seen_without_its_end() {
        let mut doubt = ZeroDoubt::default();
        // A second of 1, and the beginning of a contact.
        let free = (0..24).map(|frame| if frame < 20 { 1.0 } else { 9.0 });
        for value in free {
            assert_eq!(doubt.push(0.05, Some([value, 1.0])), None);
        }
        let pause = doubt.push(0.05, None).unwrap();
        assert_eq!(pause.value, 1.0);
        assert!((0.45..0.8).contains(&pause.time), "{pause:?}");
        assert!((pause.since - 1.25).abs() < 1e-9, "{pause:?}");
        // What it shows is followed no faster than a drift may be.
        doubt.show(&pause, 0.4);
        assert!((doubt.level() - 0.5).abs() < 1e-9);
        assert_eq!(doubt.push(0.05, None), None);
    }
}
