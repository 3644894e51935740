//! Which deviation decides whether a contact goes on: that of its beginning, as long as
//! nothing falls.

/// A contact that falls below this share of what it was has lifted off, if drift can explain
/// the rest.
const FALLS: f64 = 0.5;
/// Time over which "what it was" is averaged, s.
const TIME: f64 = 10.0;

/// Thresholds of taxels that are touched.
///
/// The longer a contact lasts, the less is known of the reading below it, and the threshold
/// of a touch, so many deviations of the force, grows. But drift is slow: it cannot begin nor
/// end a touch at once. So a contact that stays is judged by the threshold at which it began.
#[derive(Debug, Clone)]
pub(super) struct Holding {
    held: Vec<Option<Held>>,
}

#[derive(Debug, Clone, Copy)]
struct Held {
    /// Threshold at which it began.
    threshold: f64,
    /// Its value, averaged.
    level: f64,
}

impl Holding {
    pub(super) fn new(taxels: usize) -> Self {
        Self {
            held: vec![None; taxels],
        }
    }

    /// The threshold in force of a taxel of this value and threshold; `touched` in the
    /// frame before, `elapsed` seconds ago.
    pub(super) fn threshold(
        &mut self,
        taxel: usize,
        touched: bool,
        elapsed: f64,
        [value, threshold]: [f64; 2],
    ) -> f64 {
        let slot = &mut self.held[taxel];
        if !touched || value.is_nan() {
            *slot = None;
            return threshold;
        }
        let held = slot.get_or_insert(Held {
            threshold,
            level: value,
        });
        held.threshold = held.threshold.min(threshold);
        if value <= FALLS * held.level {
            return threshold;
        }
        held.level += (elapsed / TIME).min(1.0) * (value - held.level);
        held.threshold
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Thresholds after so many seconds of a threshold that grows from 1 by 0.1 a second.
    fn after(seconds: usize, value: impl Fn(usize) -> f64) -> f64 {
        let mut holding = Holding::new(1);
        let mut last = f64::NAN;
        for second in 0..=seconds {
            let threshold = 1.0 + 0.1 * second as f64;
            last = holding.threshold(0, second > 0, 1.0, [value(second), threshold]);
        }
        last
    }

    #[test]
    fn what_stays_keeps_the_threshold_at_which_it_began() {
        assert_eq!(after(0, |_| 5.0), 1.0);
        assert_eq!(after(3600, |_| 5.0), 1.1);
        // Slowly less is no release.
        assert_eq!(after(3600, |second| 5.0 - 1e-3 * second as f64), 1.1);
    }

    #[test]
    fn what_falls_is_judged_by_what_is_known_now() {
        assert_eq!(
            after(100, |second| if second < 100 { 5.0 } else { 2.0 }),
            11.0
        );
        let rising = after(101, |second| if second == 100 { 2.0 } else { 5.0 });
        assert_eq!(rising, 1.1);
    }
}
