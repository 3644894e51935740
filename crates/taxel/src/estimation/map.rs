//! Frames of a pressure map: what they have without a three-axis calibration.

use super::contact::{Cell, Contact, normal_only};
use super::segmentation::Segmentation;
use super::{FrameError, State};
use crate::acquisition::{Frame, Quantity, Stream};

/// What a pressure map shows in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct MapTouch {
    /// Sequence number of the frame.
    pub sequence: u64,
    /// Device time of the frame, ns.
    pub time_ns: u64,
    /// Values less the rest values, SI; `NaN` where there is no sensel or no
    /// reading.
    pub values: Vec<f64>,
    /// Masked where there is no sensel, faulty where a reading is missing.
    pub states: Vec<State>,
    /// Sum of the values, SI.
    pub sum: f64,
    /// Σ pressure x cell area, N; `None` when the values are no pressure or
    /// the pitch is unknown.
    pub force: Option<f64>,
    /// Centre over all contacts, m (in cells when the pitch is unknown).
    /// A recording states no noise, so there is no covariance.
    pub centre_of_pressure: Option<[f64; 2]>,
    /// Contact regions, strongest first; the covariance is not known (`NaN`),
    /// and the force is (0, 0, Σ).
    pub contacts: Vec<Contact>,
    /// Index of the contact of each taxel, row by row.
    pub regions: Vec<Option<u32>>,
}

/// Turns frames of a pressure map into contacts and totals.
#[derive(Debug, Clone)]
pub struct MapEstimator {
    stream: Stream,
    segmentation: Segmentation,
    rest: Vec<f64>,
    capture: Option<(usize, usize, Vec<f64>)>,
    touch: MapTouch,
}

impl MapEstimator {
    /// An estimator for the frames of `stream`.
    pub fn new(stream: &Stream) -> Self {
        let cells = stream.channels();
        Self {
            segmentation: Segmentation::new(
                stream.rows,
                stream.columns * stream.channels_per_taxel,
                stream
                    .pitch
                    .map_or([1.0; 2], |[down, across]| [across, down]),
            ),
            rest: vec![0.0; cells],
            capture: None,
            touch: MapTouch {
                sequence: 0,
                time_ns: 0,
                values: vec![f64::NAN; cells],
                states: vec![State::Masked; cells],
                sum: 0.0,
                force: None,
                centre_of_pressure: None,
                contacts: Vec::new(),
                regions: Vec::new(),
            },
            stream: stream.clone(),
        }
    }

    /// Begins a rest capture over the next `frames` frames: their mean is
    /// subtracted from then on.
    pub fn begin_rest_capture(&mut self, frames: usize) {
        self.capture = Some((frames.max(1), 0, vec![0.0; self.rest.len()]));
    }

    /// Whether a rest capture is under way.
    pub fn capturing(&self) -> bool {
        self.capture.is_some()
    }

    /// Forgets the rest values.
    pub fn clear_rest(&mut self) {
        self.rest.fill(0.0);
    }

    /// Rest values in force, SI.
    pub fn rest(&self) -> &[f64] {
        &self.rest
    }

    /// Puts back rest values.
    pub fn restore_rest(&mut self, rest: &[f64]) {
        self.rest.clear();
        self.rest.extend_from_slice(rest);
    }

    /// Takes one frame; the second value says whether it ended a rest capture.
    ///
    /// # Errors
    /// [`FrameError::Channels`] for a frame of another device.
    pub fn push(&mut self, frame: &Frame) -> Result<(&MapTouch, bool), FrameError> {
        let expected = self.rest.len();
        if frame.values.len() != expected {
            return Err(FrameError::Channels {
                found: frame.values.len(),
                expected,
            });
        }
        let captured = self.capture_frame(&frame.values);
        let touch = &mut self.touch;
        touch.sequence = frame.sequence;
        touch.time_ns = frame.time_ns;
        for (index, value) in frame.values.iter().enumerate() {
            touch.values[index] = value - self.rest[index];
            touch.states[index] = match (self.stream.present[index], value.is_nan()) {
                (false, _) => State::Masked,
                (true, true) => State::Faulty,
                (true, false) => State::Ok,
            };
        }
        self.sum_up();
        Ok((&self.touch, captured))
    }

    fn capture_frame(&mut self, values: &[f64]) -> bool {
        let Some((wanted, taken, sums)) = &mut self.capture else {
            return false;
        };
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += value;
        }
        *taken += 1;
        if taken < wanted {
            return false;
        }
        let frames = *wanted as f64;
        for (rest, sum) in self.rest.iter_mut().zip(sums) {
            // A sensel without a reading during the capture keeps its rest.
            if sum.is_finite() {
                *rest = *sum / frames;
            }
        }
        self.capture = None;
        true
    }

    fn sum_up(&mut self) {
        let stream = &self.stream;
        let (rows, columns) = (stream.rows, stream.columns * stream.channels_per_taxel);
        let pitch = stream.pitch.unwrap_or([1.0, 1.0]);
        let threshold = stream.threshold.unwrap_or(0.0);
        let values = &self.touch.values;
        self.touch.sum = values.iter().filter(|value| value.is_finite()).sum();
        self.touch.force = stream
            .pitch
            .filter(|_| stream.unit.quantity == Quantity::Pressure)
            .map(|[down, across]| self.touch.sum * down * across);
        let area = if self.touch.force.is_some() {
            pitch[0] * pitch[1]
        } else {
            1.0
        };
        let cell = |index: usize| {
            let (row, column) = (index / columns, index % columns);
            let x = (column as f64 - 0.5 * (columns as f64 - 1.0)) * pitch[1];
            let y = (0.5 * (rows as f64 - 1.0) - row as f64) * pitch[0];
            Cell {
                position: [x, y],
                weight: values[index],
                deviation: f64::NAN,
                threshold,
                force: [0.0, 0.0, values[index] * area],
                force_covariance: normal_only(f64::NAN),
                state: self.touch.states[index],
            }
        };
        let centre = self.segmentation.run(cell, &mut self.touch.contacts);
        self.touch.centre_of_pressure = centre.map(|(centre, _)| centre);
        self.segmentation.label(&mut self.touch.regions);
    }
}
