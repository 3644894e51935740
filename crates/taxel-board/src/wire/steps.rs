//! Steps that are too large to be believed at once, on a wire whose damage cannot be seen.

use taxel_recording::Frame;

/// Time in which the usual steps are learned, ns.
const LEARNED_NS: u64 = 10_000_000_000;
/// A step is large above so many times the step that one frame in a thousand exceeds.
const TIMES: f64 = 4.0;
/// Largest steps kept of each channel: one in a thousand of 32 000 frames.
const KEPT: usize = 32;

/// Holds a frame back whose step is large until the next confirms it.
#[derive(Debug, Clone)]
pub(super) struct StepGuard {
    /// Largest believed step of each channel, SI; empty while it is learned.
    limits: Vec<f64>,
    stated: Option<f64>,
    /// Smallest step that a number can make, SI, channel by channel.
    steps: Vec<f64>,
    largest: Vec<[f64; KEPT]>,
    frames: usize,
    began: Option<u64>,
    last: Vec<f64>,
    held: Option<Frame>,
    pub(super) unconfirmed: u64,
}

impl StepGuard {
    /// `stated` is the limit in the board file, in the unit of each channel; `units` and
    /// `steps` are the unit and the smallest step of each, SI.
    pub(super) fn new(stated: Option<f64>, units: &[f64], steps: Vec<f64>) -> Self {
        let limits = match stated {
            Some(limit) => units.iter().map(|unit| limit * unit).collect(),
            None => Vec::new(),
        };
        Self {
            limits,
            stated,
            largest: vec![[0.0; KEPT]; steps.len()],
            steps,
            frames: 0,
            began: None,
            last: Vec::new(),
            held: None,
            unconfirmed: 0,
        }
    }

    pub(super) fn push(&mut self, frame: Frame, out: &mut impl FnMut(Frame)) {
        if self.last.is_empty() {
            self.last.clone_from(&frame.values);
            self.began = Some(frame.time_ns);
            out(frame);
            return;
        }
        if self.limits.is_empty() {
            self.learn(&frame);
        }
        if let Some(held) = self.held.take() {
            if self.confirms(&held, &frame) {
                self.last.clone_from(&held.values);
                out(held);
            } else {
                self.unconfirmed += 1;
            }
        }
        if self.is_large(&frame) {
            self.held = Some(frame);
        } else {
            self.last.clone_from(&frame.values);
            out(frame);
        }
    }

    /// A new connection or the end: what is held was never confirmed.
    pub(super) fn reset(&mut self) {
        self.unconfirmed += u64::from(self.held.take().is_some());
        self.last.clear();
    }

    fn is_large(&self, frame: &Frame) -> bool {
        let steps = frame.values.iter().zip(&self.last).zip(&self.limits);
        steps
            .into_iter()
            .any(|((value, last), limit)| (value - last).abs() > *limit)
    }

    /// True if the next frame lies nearer to the held one than to the last, wherever that made
    /// a large step.
    fn confirms(&self, held: &Frame, next: &Frame) -> bool {
        let values = held.values.iter().zip(&next.values);
        values
            .zip(self.last.iter().zip(&self.limits))
            .all(|((held, next), (last, limit))| {
                let large = (held - last).abs() > *limit;
                !large || (next - held).abs() <= (next - last).abs()
            })
    }

    fn learn(&mut self, frame: &Frame) {
        for ((value, last), largest) in frame.values.iter().zip(&self.last).zip(&mut self.largest) {
            let step = (value - last).abs();
            if step > largest[KEPT - 1] {
                let at = largest.partition_point(|kept| *kept > step);
                largest.copy_within(at..KEPT - 1, at + 1);
                largest[at] = step;
            }
        }
        self.frames += 1;
        let began = self.began.unwrap_or(0);
        if self.stated.is_none() && frame.time_ns.saturating_sub(began) >= LEARNED_NS {
            let one_in_a_thousand = (self.frames / 1000).min(KEPT - 1);
            self.limits = self
                .largest
                .iter()
                .zip(&self.steps)
                .map(|(largest, step)| {
                    let limit = TIMES * largest[one_in_a_thousand].max(*step);
                    if limit > 0.0 { limit } else { f64::INFINITY }
                })
                .collect();
        }
    }
}
