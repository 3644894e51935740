//! Sequence of frames: gaps, late and duplicate frames.

use crate::acquisition::Frame;

/// Counts what was lost and decides which frames count as new data.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Continuity {
    newest: Option<u64>,
    newest_ns: u64,
    /// Frames accepted as new.
    pub accepted: u64,
    /// Frames that never came (gaps in the sequence, less those that came late).
    pub lost: u64,
    /// Frames older than the newest one, by their number or by their time; not
    /// used.
    pub late: u64,
    /// Frames that repeat the newest one; not used.
    pub duplicate: u64,
    /// Frames that repeat its readings under a new number; not used.
    pub repeated: u64,
    /// Times the device began a new sequence.
    pub restarts: u64,
    behind: u32,
}

/// Late frames in a row after which the device is taken to have restarted.
const RESTART_AFTER: u32 = 10;

impl Continuity {
    /// Counts `frame`; `false` when it is not new and must not be used.
    pub fn accept(&mut self, frame: &Frame) -> bool {
        if let Some(newest) = self.newest {
            let behind = frame.sequence < newest;
            if frame.sequence == newest {
                self.duplicate += 1;
                return false;
            }
            if !behind {
                self.lost += frame.sequence - newest - 1;
            }
            if (behind || frame.time_ns < self.newest_ns) && self.is_late() {
                if behind {
                    // It was counted lost when the newer one came.
                    self.lost = self.lost.saturating_sub(1);
                } else {
                    self.newest = Some(frame.sequence);
                }
                return false;
            }
        }
        self.behind = 0;
        self.newest = Some(frame.sequence);
        self.newest_ns = frame.time_ns;
        self.accepted += 1;
        true
    }

    /// The frames that follow continue nothing: their numbers and times begin anew, as after
    /// a new connection.
    pub fn begin_segment(&mut self) {
        self.newest = None;
        self.newest_ns = 0;
        self.behind = 0;
    }

    /// Counts a frame that is behind the newest; `false` when so many were that
    /// the device has begun anew.
    fn is_late(&mut self) -> bool {
        self.behind += 1;
        let late = self.behind < RESTART_AFTER;
        if late {
            self.late += 1;
        } else {
            self.restarts += 1;
        }
        late
    }

    /// Takes back the last accepted frame: its readings were those of the one
    /// before, sent again.
    pub fn repeat(&mut self) {
        self.accepted = self.accepted.saturating_sub(1);
        self.repeated += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(sequences: &[u64]) -> (Continuity, Vec<u64>) {
        let mut continuity = Continuity::default();
        let taken = sequences
            .iter()
            .copied()
            .filter(|sequence| {
                continuity.accept(&Frame {
                    sequence: *sequence,
                    time_ns: 0,
                    values: Vec::new(),
                    ..Frame::default()
                })
            })
            .collect();
        (continuity, taken)
    }

    #[test]
    fn gaps_late_and_duplicates_are_distinguished() {
        let (counts, taken) = run(&[5, 6, 6, 9, 7, 10]);
        assert_eq!(taken, [5, 6, 9, 10]);
        assert_eq!((counts.lost, counts.late, counts.duplicate), (1, 1, 1));
    }

    #[test]
    fn rows_out_of_the_order_of_time_are_late() {
        let mut continuity = Continuity::default();
        let taken: Vec<bool> = [0, 10, 5, 20, 30]
            .into_iter()
            .zip(0..)
            .map(|(time_ns, sequence)| {
                let values = Vec::new();
                continuity.accept(&Frame {
                    sequence,
                    time_ns,
                    values,
                    ..Frame::default()
                })
            })
            .collect();
        assert_eq!(taken, [true, true, false, true, true]);
        // Its number came, if too late: nothing is lost.
        assert_eq!((continuity.late, continuity.lost), (1, 0));
    }

    #[test]
    fn a_restarted_device_is_followed() {
        let sequences: Vec<u64> = (1000..1005).chain(0..20).collect();
        let (counts, taken) = run(&sequences);
        assert_eq!(counts.restarts, 1);
        assert_eq!(taken.last(), Some(&19));
    }
}
