//! What outlets and inlets of the lab streaming layer share: its clock, and where streams are asked for.

use std::net::Ipv4Addr;
use std::ops::Range;
use std::time::{Duration, Instant};

/// Port of the questions of all.
pub(crate) const PORT: u16 = 16_571;
/// Ports that an outlet tries before it takes any.
pub(crate) const RANGE: Range<u16> = 16_572..16_604;
/// Groups by which outlets are asked: those of the machine, of the site and of the organisation.
pub(crate) const GROUPS: [Ipv4Addr; 2] = [
    Ipv4Addr::new(224, 0, 0, 183),
    Ipv4Addr::new(239, 255, 172, 215),
];

/// Time of the clock of the layer, s: on Unix that of its library, so that programs of one machine need not
/// compare their clocks.
pub(crate) fn clock() -> f64 {
    #[cfg(unix)]
    {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
        now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(unix))]
    {
        crate::clock::Epoch::of_process().at.elapsed().as_secs_f64()
    }
}

/// Time of a moment by the clock of the layer, s.
pub(crate) fn stamp(at: Instant) -> f64 {
    let ahead = at.saturating_duration_since(Instant::now()).as_secs_f64();
    clock() + ahead - at.elapsed().as_secs_f64()
}

/// The moment of a time by the clock of the layer; `None` where it is not within `most` of now.
pub(crate) fn moment(stamp: f64, most: Duration) -> Option<Instant> {
    let (age, now) = (clock() - stamp, Instant::now());
    let size = Duration::try_from_secs_f64(age.abs()).ok();
    let size = size.filter(|size| *size <= most)?;
    if age < 0.0 {
        now.checked_add(size)
    } else {
        now.checked_sub(size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_near_now_has_a_time_and_comes_back() {
        let most = Duration::from_mins(1);
        let now = Instant::now();
        for at in [now, now + most / 2] {
            let again = moment(stamp(at), most).unwrap();
            let apart = again
                .saturating_duration_since(at)
                .max(at.saturating_duration_since(again));
            // Four looks at clocks lie between; a busy machine may put the thread to sleep.
            assert!(apart < Duration::from_millis(100), "{apart:?}");
        }
        for far in [f64::NAN, f64::INFINITY, 1e300, -1e300, clock() + 61.0] {
            assert_eq!(moment(far, most), None, "{far}");
        }
    }
}
