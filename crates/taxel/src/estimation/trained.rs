//! Frames of a body without a physical model to a contact with its place and
//! force, through maps that were learned.

use super::baseline::{Baseline, BaselineOptions};
use super::contact::{Contact, normal_only};
use super::{
    FrameError, Picture, RestEnd, Scale, SignalEstimator, SignalMeaning, SignalTouch, State,
    TaxelValue,
};
use crate::acquisition::Frame;
use crate::calibration::{MOVING, RestReadings, Running};
use crate::trained::{
    Estimate, ForceEstimator, PositionEstimate, PositionEstimator, Support, TrainedMaps,
    TrainingError,
};

/// The area that can be touched, in cells; its middle is the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainedArea {
    /// Rows of cells; row 0 is at +y.
    pub rows: usize,
    /// Columns of cells; column 0 is at -x.
    pub columns: usize,
    /// Size of a cell along x and y, m.
    pub pitch: [f64; 2],
}

impl TrainedArea {
    /// Half of its sides along x and y, m.
    pub fn half_sides(&self) -> [f64; 2] {
        [
            0.5 * self.pitch[0] * self.columns as f64,
            0.5 * self.pitch[1] * self.rows as f64,
        ]
    }

    /// Covariance xx, xy, yy of a place that may be anywhere on it, m².
    fn anywhere(&self) -> [f64; 3] {
        let [x, y] = self.half_sides();
        [x * x / 3.0, 0.0, y * y / 3.0]
    }
}

/// There is a contact above this many deviations of the force.
const CONTACT_DEVIATIONS: f64 = 3.0;
/// A cell is of the contact from this share of it on.
const CELL_SHARE: f64 = 0.05;

/// Turns frames into one contact; the same frames give the same contacts.
///
/// A cell holds the share of the force (without a force map: of the contact)
/// that the estimated place and its covariance put into it. A place that the
/// maps do not tell is the middle of the area with the covariance of anywhere.
#[derive(Debug, Clone)]
pub struct TrainedEstimator {
    maps: TrainedMaps,
    area: TrainedArea,
    meaning: SignalMeaning,
    position: Option<PositionEstimator>,
    force: Option<ForceEstimator>,
    /// Where rest is known.
    baseline: Option<Baseline>,
    /// The readings of a frame less the drift of the empty channels.
    values: Vec<f64>,
    capture: Option<Capture>,
    touch: SignalTouch,
}

/// A rest capture under way; it ends early when a touch begins.
#[derive(Debug, Clone)]
struct Capture {
    readings: RestReadings,
    /// The frames so far.
    frames: Vec<Vec<f64>>,
}

impl Capture {
    /// The rest of a capture that a touch has ended. It began before it was
    /// seen: the later half of the frames is left out.
    fn before_touch(&self) -> RestReadings {
        let kept = self.frames.len().div_ceil(2).max(LEAST_FRAMES);
        let mut rest = RestReadings::new(self.readings.channels().len(), kept);
        for frame in self.frames.iter().take(kept) {
            rest.push(frame.iter().copied());
        }
        rest
    }
}

/// Fewest frames of a rest capture that a touch has ended.
const LEAST_FRAMES: usize = 5;
/// A reading farther from the mean so far than this many standard deviations
/// is the beginning of a touch.
const TOUCHED: f64 = 6.0;

/// What the maps say of one frame.
struct Felt {
    place: Option<PositionEstimate>,
    force: Option<Estimate>,
}

impl TrainedEstimator {
    /// An estimator of the device whose channels are called `names` and read in
    /// `symbol`. `full_scale` is the force at the end of the colours, N.
    ///
    /// # Errors
    /// [`TrainingError`] for maps that were changed by hand.
    pub fn new(
        maps: TrainedMaps,
        area: TrainedArea,
        names: Vec<String>,
        symbol: &'static str,
        full_scale: f64,
    ) -> Result<Self, TrainingError> {
        maps.check()?;
        // Without places the area is one cell.
        let [x, y] = area.half_sides();
        let area = match maps.position {
            Some(_) => area,
            None => TrainedArea {
                rows: 1,
                columns: 1,
                pitch: [2.0 * x, 2.0 * y],
            },
        };
        let channels = names.len();
        let rest = maps.rest.as_ref().map(|rest| rest.mean.clone());
        let baseline = maps.rest.as_ref().map(|rest| {
            let mut baseline = Baseline::new(BaselineOptions::new(rest.deviation.clone()));
            baseline.tare(0, &rest.mean);
            baseline
        });
        Ok(Self {
            baseline,
            values: vec![f64::NAN; channels],
            meaning: meaning(&maps, &area, names, symbol, full_scale),
            position: maps
                .position
                .clone()
                .map(PositionEstimator::new)
                .transpose()?,
            force: force_estimator(&maps, rest.clone())?,
            capture: None,
            touch: SignalTouch {
                signals: vec![f64::NAN; channels],
                rest: rest.unwrap_or_else(|| vec![f64::NAN; channels]),
                ..SignalTouch::default()
            },
            area,
            maps,
        })
    }

    /// Takes the readings of a frame and follows the drift of those that nothing
    /// touches.
    fn follow(&mut self, frame: &Frame) {
        self.touch.signals.copy_from_slice(&frame.values);
        self.values.copy_from_slice(&frame.values);
        let Some(baseline) = &mut self.baseline else {
            return;
        };
        // Every channel feels every contact, that of the frame before.
        let touched = !self.touch.contacts.is_empty();
        baseline.push(frame.time_ns, &frame.values, |_| touched);
        for (channel, value) in self.values.iter_mut().enumerate() {
            *value -= baseline.drift(channel);
        }
    }

    fn feel(&mut self, time: f64) -> Result<Felt, TrainingError> {
        let values = &self.values;
        let force = self.force.as_mut().map(|force| force.push(time, values));
        let force = force.transpose()?;
        let place = self.position.as_mut().map(|map| map.estimate(values));
        Ok(Felt {
            // A frame unlike all presses tells no place.
            place: place
                .transpose()?
                .filter(|place| place.support == Support::Trained),
            force,
        })
    }

    /// Fills the touch from what was felt.
    fn sum_up(&mut self, felt: &Felt) {
        let pressed = |force: &Estimate| force.value > CONTACT_DEVIATIONS * force.deviation;
        let contact = match &felt.force {
            Some(force) if pressed(force) || force.support == Support::Trained => {
                Some(pressed(force))
            }
            // A frame unlike all presses may be one of another depth, or none.
            _ => felt.place.map(|_| true),
        };
        let (value, deviation) = match felt.force {
            Some(force) => (force.value, force.deviation),
            None => (1.0, f64::NAN),
        };
        let state = match felt.force.map(|force| force.support) {
            Some(Support::Outside) => State::OutOfRange,
            _ => State::Ok,
        };
        let shares = self.shares(felt.place.as_ref(), contact);
        self.touch.force = felt.force.map(|force| [force.value, force.deviation]);
        self.touch.taxels.clear();
        self.touch.regions.clear();
        for share in &shares {
            let free = contact == Some(false);
            self.touch.taxels.push(TaxelValue {
                value: if free { 0.0 } else { share * value },
                deviation: share * deviation,
                state: if share.is_nan() {
                    State::OutOfRange
                } else {
                    state
                },
            });
            let member = contact == Some(true) && (share.is_nan() || *share >= CELL_SHARE);
            self.touch.regions.push(member.then_some(0));
        }
        self.touch.contacts.clear();
        self.touch.centre_of_pressure = None;
        if contact == Some(true) {
            let contact = self.contact(felt, &shares, state);
            self.touch.centre_of_pressure = Some((contact.centre, contact.covariance));
            self.touch.contacts.push(contact);
        }
    }

    /// Share of the contact in each cell, row by row; even without a contact,
    /// `NaN` where it is not known.
    fn shares(&self, place: Option<&PositionEstimate>, contact: Option<bool>) -> Vec<f64> {
        let cells = self.area.rows * self.area.columns;
        let Some(place) = place.filter(|_| contact == Some(true)) else {
            let known = contact == Some(false) || (contact.is_some() && cells == 1);
            return vec![if known { 1.0 / cells as f64 } else { f64::NAN }; cells];
        };
        let [x, y] = self.area.half_sides();
        let [dx, dy] = place.deviation();
        let columns = slices(
            self.area.columns,
            -x,
            self.area.pitch[0],
            place.place[0],
            dx,
        );
        // Row 0 is at +y.
        let rows = slices(self.area.rows, -y, self.area.pitch[1], -place.place[1], dy);
        let cells = rows.iter().flat_map(|r| columns.iter().map(move |c| r * c));
        cells.collect()
    }

    fn contact(&self, felt: &Felt, shares: &[f64], state: State) -> Contact {
        let (centre, covariance) = match &felt.place {
            Some(place) => {
                let [[xx, xy], [_, yy]] = place.covariance;
                (place.place, [xx, xy, yy])
            }
            None => ([0.0; 2], self.area.anywhere()),
        };
        let [force, deviation] = self.touch.force.unwrap_or([f64::NAN; 2]);
        let taxels = self.touch.regions.iter().flatten().count();
        let greater = |a: &usize, b: &usize| shares[*a].total_cmp(&shares[*b]);
        let peak_taxel = (0..shares.len()).max_by(greater).unwrap_or(0);
        Contact {
            taxels,
            area: taxels as f64 * self.area.pitch[0] * self.area.pitch[1],
            centre,
            covariance,
            force: [0.0, 0.0, force],
            force_covariance: normal_only(deviation),
            torsion: f64::NAN,
            peak: self.touch.taxels[peak_taxel].value,
            peak_taxel,
            bound: (state == State::OutOfRange).then_some(state),
        }
    }

    /// A frame of which nothing is known.
    fn nothing(&mut self) {
        let cells = self.area.rows * self.area.columns;
        let faulty = TaxelValue {
            value: f64::NAN,
            deviation: f64::NAN,
            state: State::Faulty,
        };
        self.touch.force = None;
        self.touch.taxels = vec![faulty; cells];
        self.touch.regions = vec![None; cells];
        self.touch.contacts.clear();
        self.touch.centre_of_pressure = None;
    }

    fn capture_frame(&mut self, values: &[f64]) -> RestEnd {
        let capture = self.capture.as_mut()?;
        if self.force.is_none() {
            self.capture = None;
            return Some(Err(String::from(
                "no rest capture: these places are learned from readings as they come",
            )));
        }
        let noise = self.maps.rest.iter().flat_map(|rest| &rest.deviation);
        let so_far = capture.readings.channels().iter().zip(noise).zip(values);
        let touched = capture.frames.len() >= LEAST_FRAMES
            && so_far.into_iter().any(|((running, noise), value)| {
                (value - running.mean_or_nan()).abs() > TOUCHED * noise
            });
        if touched {
            let rest = capture.before_touch();
            self.capture = None;
            return Some(self.rest_from(rest.channels()));
        }
        capture.frames.push(values.to_vec());
        if !capture.readings.push(values.iter().copied()) {
            return None;
        }
        let capture = self.capture.take()?;
        Some(self.rest_from(capture.readings.channels()))
    }

    fn rest_from(&mut self, channels: &[Running]) -> Result<(), String> {
        let noise = self.maps.rest.as_ref().map(|rest| &rest.deviation);
        let noise = noise.into_iter().flatten();
        let moved = |(running, noise): (&Running, &f64)| running.deviation() > MOVING * noise;
        if let Some(channel) = channels.iter().zip(noise).position(moved) {
            let name = &self.meaning.channels[channel];
            return Err(format!(
                "rest capture refused: {name} moved during it; lift off and try again"
            ));
        }
        self.set_rest(channels.iter().map(Running::mean_or_nan).collect())
            .map_err(|error| format!("rest capture refused: {error}"))
    }

    /// Begins anew from a body at rest that reads `rest`.
    fn set_rest(&mut self, rest: Vec<f64>) -> Result<(), TrainingError> {
        self.force = force_estimator(&self.maps, Some(rest.clone()))?;
        if let Some(baseline) = &mut self.baseline {
            baseline.tare(self.touch.time_ns, &rest);
            self.values.copy_from_slice(&self.touch.signals);
        }
        self.touch.rest = rest;
        Ok(())
    }
}

impl SignalEstimator for TrainedEstimator {
    fn meaning(&self) -> &SignalMeaning {
        &self.meaning
    }

    fn push(&mut self, frame: &Frame) -> Result<(&SignalTouch, RestEnd), FrameError> {
        let (found, expected) = (frame.values.len(), self.meaning.channels.len());
        if found != expected {
            return Err(FrameError::Channels { found, expected });
        }
        self.touch.sequence = frame.sequence;
        self.touch.time_ns = frame.time_ns;
        self.follow(frame);
        let ended = self.capture_frame(&frame.values);
        // A channel that the maps need has no reading: nothing else can fail.
        match self.feel(frame.time_ns as f64 * 1e-9) {
            Ok(felt) => self.sum_up(&felt),
            Err(_) => self.nothing(),
        }
        Ok((&self.touch, ended))
    }

    fn baseline(&self) -> Option<&Baseline> {
        self.baseline.as_ref()
    }

    fn begin_rest_capture(&mut self, frames: usize) {
        self.capture = Some(Capture {
            readings: RestReadings::new(self.meaning.channels.len(), frames),
            frames: Vec::new(),
        });
    }

    fn capturing(&self) -> bool {
        self.capture.is_some()
    }

    fn clear_rest(&mut self) {
        if let Some(rest) = &self.maps.rest {
            // It was accepted when the estimator was made.
            let _ = self.set_rest(rest.mean.clone());
        }
    }
}

fn force_estimator(
    maps: &TrainedMaps,
    rest: Option<Vec<f64>>,
) -> Result<Option<ForceEstimator>, TrainingError> {
    match (&maps.force, rest) {
        (Some(force), Some(rest)) => ForceEstimator::new(force.clone(), rest).map(Some),
        _ => Ok(None),
    }
}

/// Share of the normal law about `mean` in each of `count` slices that begin
/// at `first`, the outermost with all that lies beyond.
fn slices(count: usize, first: f64, width: f64, mean: f64, deviation: f64) -> Vec<f64> {
    let below = |edge: usize| match edge {
        0 => 0.0,
        edge if edge == count => 1.0,
        edge => {
            let at = first + width * edge as f64;
            0.5 * libm::erfc((mean - at) / (deviation * std::f64::consts::SQRT_2))
        }
    };
    (0..count).map(|k| below(k + 1) - below(k)).collect()
}

fn meaning(
    maps: &TrainedMaps,
    area: &TrainedArea,
    channels: Vec<String>,
    symbol: &'static str,
    full_scale: f64,
) -> SignalMeaning {
    let force = maps.force.is_some();
    SignalMeaning {
        rows: area.rows,
        columns: area.columns,
        pitch: [area.pitch[1], area.pitch[0]],
        channels,
        signal: Scale {
            quantity: "reading",
            symbol,
            si_per_unit: 1.0,
        },
        value: Scale {
            quantity: if force {
                "force"
            } else {
                "share of the contact"
            },
            symbol: if force { "N" } else { "" },
            si_per_unit: 1.0,
        },
        full_scale: if force { full_scale } else { 1.0 },
        signed: false,
        picture: Picture::Heat,
    }
}
