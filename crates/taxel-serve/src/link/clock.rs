//! The clock of a board against that of this computer.

use serde::Serialize;
use taxel::acquisition::{Frame, FrameFlags};
use taxel_board::DeviceClockMap;

/// Time from one word on the clocks to the next, ns.
const EVERY_NS: u64 = 1_000_000_000;

/// Relation of the clock of a board to that of this computer at one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClockRelation {
    /// Device time of the frame, ns.
    pub device_time_ns: u64,
    /// Time of the steady clock at which it was read, ns since the program began.
    pub host_ns: u64,
    /// Seconds of this computer in one of the board, less 1.
    pub rate_difference: f64,
    /// The frame was read at most so long before that time, s; `None` where the smallest delay
    /// of the link is not known.
    pub before_s: Option<f64>,
    /// And at most so long behind it, s.
    pub behind_s: f64,
    /// Segments of the clock so far.
    pub segments: u64,
}

/// Follows the clock of a board.
#[derive(Debug)]
pub(crate) struct ClockWatch {
    map: DeviceClockMap,
    told_ns: Option<u64>,
}

impl ClockWatch {
    /// `delay` is the smallest and the largest delay that the link has at least, s.
    pub(crate) fn new(delay: Option<[f64; 2]>) -> Self {
        Self {
            map: DeviceClockMap::new(delay),
            told_ns: None,
        }
    }

    /// Takes a frame; once a second, how the clocks stand. `counted` says that the frames of
    /// the board have numbers: then a time that follows from them is one of the board, too.
    pub(crate) fn push(&mut self, frame: &Frame, counted: bool) -> Option<ClockRelation> {
        let host_ns = frame.host_ns?;
        if frame.flags.has(FrameFlags::INFERRED_TIME) && !counted {
            return None;
        }
        self.map.push(frame.time_ns, host_ns);
        let due = |told: u64| host_ns.saturating_sub(told) >= EVERY_NS;
        if !self.told_ns.is_none_or(due) {
            return None;
        }
        let host = self.map.host(frame.time_ns)?;
        self.told_ns = Some(host_ns);
        Some(ClockRelation {
            device_time_ns: frame.time_ns,
            host_ns: host.time_ns,
            rate_difference: self.map.rate_difference(),
            before_s: host.before,
            behind_s: host.behind,
            segments: self.map.segments(),
        })
    }

    /// Time of the steady clock at which a frame of this device time was read, ns since the program began;
    /// `None` while nothing is known of the clock of the board.
    pub(crate) fn host_ns(&self, device_time_ns: u64) -> Option<u64> {
        self.map.host(device_time_ns).map(|host| host.time_ns)
    }

    /// The link is open again.
    pub(crate) fn reconnected(&mut self) {
        self.map.reset();
        self.told_ns = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(step: u64, flags: FrameFlags) -> Frame {
        let device = step * 10_000_000;
        Frame {
            sequence: step,
            time_ns: device,
            host_ns: Some(3_000_000_000 + device + device / 10_000 + step * 7919 % 13 * 20_000),
            flags,
            ..Frame::default()
        }
    }

    #[test]
    fn once_a_second_the_clocks_are_told() {
        let mut watch = ClockWatch::new(None);
        let told: Vec<_> = (0..6000)
            .filter_map(|step| watch.push(&frame(step, FrameFlags::NONE), true))
            .collect();
        assert!((59..=61).contains(&told.len()), "{}", told.len());
        let last = told[told.len() - 1];
        // The clock of the board is slow by 100 ppm.
        assert!((last.rate_difference - 1e-4).abs() < 5e-6, "{last:?}");
        let read = 3_000_000_000 + last.device_time_ns + last.device_time_ns / 10_000;
        assert!(last.host_ns.abs_diff(read) < 30_000, "{last:?}");
        assert_eq!((last.before_s, last.segments), (None, 1));
    }

    #[test]
    fn an_arrival_says_nothing_of_a_clock() {
        let mut watch = ClockWatch::new(None);
        let inferred = frame(1, FrameFlags::INFERRED_TIME);
        assert_eq!(watch.push(&inferred, false), None);
        assert!(watch.push(&inferred, true).is_some());
    }
}
