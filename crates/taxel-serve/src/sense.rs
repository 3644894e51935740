//! The estimator that fits a source (three axes, one value per taxel, or a
//! pressure map), and what is observed of its frames over time.

use taxel::acquisition::{Frame, Quantity, Stream};
use taxel::calibration::Calibration;
use taxel::device;
use taxel::estimation::{
    Baseline, Contact, Estimator, EstimatorOptions, FrameError, MapEstimator, MapTouch, Observer,
    ObserverOptions, RestEnd, RestState, Seen, SignalEstimator, SignalMeaning, SignalTouch, State,
    Touch, Wiring,
};

/// Estimation and observation of any kind of device.
pub struct Sense {
    feel: Feel,
    observer: Observer,
    /// Three-axis units that contradicted themselves in the last frame, with
    /// their capacitances, F.
    suspects: Vec<(usize, [f64; 4])>,
    force_unit: &'static str,
    speed_unit: &'static str,
    columns: usize,
}

/// The estimator.
enum Feel {
    ThreeAxis(Box<ThreeAxis>),
    Signals(Box<dyn SignalEstimator>),
    Map(Box<MapEstimator>),
}

/// A three-axis estimator and the calibration it began with.
struct ThreeAxis {
    estimator: Estimator,
    start: Calibration,
}

/// What one frame felt like.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Felt<'a> {
    /// On an array of three-axis units.
    ThreeAxis(&'a Touch),
    /// On a device of one value per taxel.
    Signals(&'a SignalTouch),
    /// On a map.
    Map(&'a MapTouch),
}

/// What came of one frame.
pub(crate) struct Sensed<'a> {
    pub(crate) felt: Felt<'a>,
    pub(crate) observer: &'a Observer,
    /// End of a rest capture.
    pub(crate) captured: RestEnd,
}

/// Rest values, to be put back bit for bit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Rest {
    ThreeAxis(Box<Calibration>),
    Signals(Option<RestState>),
    Map(Vec<f64>),
}

impl Sense {
    /// The estimation of a device for frames as `stream` describes them.
    ///
    /// # Errors
    /// [`FrameError`] when the frames cannot be of the device.
    pub fn of(device: &dyn device::Device, stream: &Stream) -> Result<Self, FrameError> {
        let feel = match device.sense(stream)? {
            device::Sense::Signals(estimator) => Feel::Signals(estimator),
            device::Sense::ThreeAxis(calibration) => {
                let start = (*calibration).clone();
                let options = EstimatorOptions::default();
                let estimator = Estimator::new(*calibration, stream.unit.quantity, options)?;
                Feel::ThreeAxis(Box::new(ThreeAxis { estimator, start }))
            }
        };
        Ok(Self::new(feel, device.observed(stream), stream))
    }

    /// A pressure map.
    pub fn map(stream: &Stream) -> Self {
        let feel = Feel::Map(Box::new(MapEstimator::new(stream)));
        let mut sense = Self::new(feel, ObserverOptions::new(stream), stream);
        // What a map adds up has a unit of force only over known areas of pressure.
        sense.force_unit = match (stream.unit.quantity, stream.pitch) {
            (Quantity::Pressure, Some(_)) => "N",
            (Quantity::Pressure, None) => "Pa",
            _ => "1",
        };
        sense
    }

    fn new(feel: Feel, options: ObserverOptions, stream: &Stream) -> Self {
        Self {
            feel,
            observer: Observer::new(options),
            suspects: Vec::new(),
            force_unit: "N",
            speed_unit: if stream.pitch.is_some() {
                "m/s"
            } else {
                "cells/s"
            },
            columns: stream.columns,
        }
    }

    /// Begins a rest capture.
    pub(crate) fn begin_rest_capture(&mut self, frames: usize) {
        match &mut self.feel {
            Feel::ThreeAxis(sense) => sense.estimator.begin_rest_capture(frames),
            Feel::Signals(sense) => sense.begin_rest_capture(frames),
            Feel::Map(sense) => sense.begin_rest_capture(frames),
        }
    }

    /// Returns to the rest values of the start.
    pub(crate) fn clear_rest(&mut self) {
        match &mut self.feel {
            Feel::ThreeAxis(sense) => sense.estimator.recalibrate(sense.start.clone()),
            Feel::Signals(sense) => sense.clear_rest(),
            Feel::Map(sense) => sense.clear_rest(),
        }
        self.observer.forget();
    }

    /// The rest values in force.
    pub(crate) fn rest(&self) -> Rest {
        match &self.feel {
            Feel::ThreeAxis(sense) => {
                Rest::ThreeAxis(Box::new(sense.estimator.calibration().clone()))
            }
            Feel::Signals(sense) => Rest::Signals(sense.rest_state()),
            Feel::Map(sense) => Rest::Map(sense.rest().to_vec()),
        }
    }

    /// Puts back rest values of this device.
    pub(crate) fn restore(&mut self, rest: &Rest) {
        match (&mut self.feel, rest) {
            (Feel::ThreeAxis(sense), Rest::ThreeAxis(calibration)) => {
                sense.estimator.recalibrate(calibration.as_ref().clone());
            }
            (Feel::Signals(sense), Rest::Signals(Some(rest))) => sense.restore_rest(rest),
            (Feel::Map(sense), Rest::Map(rest)) => sense.restore_rest(rest),
            _ => {}
        }
        self.observer.forget();
    }

    /// The readings of the empty device with their changes; none for a device
    /// that has none.
    pub(crate) fn baseline(&self) -> Option<&Baseline> {
        match &self.feel {
            Feel::ThreeAxis(sense) => Some(sense.estimator.baseline()),
            Feel::Signals(sense) => sense.baseline(),
            Feel::Map(_) => None,
        }
    }

    /// Whether a rest capture is under way.
    pub(crate) fn capturing(&self) -> bool {
        match &self.feel {
            Feel::ThreeAxis(sense) => sense.estimator.capturing(),
            Feel::Signals(sense) => sense.capturing(),
            Feel::Map(sense) => sense.capturing(),
        }
    }

    /// Whether a frame with a new number is the last one sent again, and must
    /// not be used.
    pub(crate) fn repeats(&self, frame: &Frame) -> bool {
        self.observer.repeats(frame)
    }

    /// Estimates and observes one frame.
    ///
    /// # Errors
    /// [`FrameError`] for a frame of another device.
    pub(crate) fn push(&mut self, frame: &Frame) -> Result<Sensed<'_>, FrameError> {
        self.look_for_swaps();
        let capturing = self.capturing();
        let (felt, captured) = match &mut self.feel {
            Feel::ThreeAxis(sense) => {
                let (touch, captured) = sense.estimator.push(frame)?;
                let captured = captured.map(|ended| ended.map_err(|refused| refused.to_string()));
                (Felt::ThreeAxis(touch), captured)
            }
            Feel::Signals(sense) => {
                let (touch, captured) = sense.push(frame)?;
                (Felt::Signals(touch), captured)
            }
            Feel::Map(sense) => {
                let (touch, captured) = sense.push(frame)?;
                (Felt::Map(touch), captured.then_some(Ok(())))
            }
        };
        if capturing {
            self.observer.push_at_rest(frame);
        } else {
            let (contacts, regions) = felt.contacts();
            let taxel = |taxel| felt.taxel(taxel);
            let seen = Seen {
                contacts,
                regions,
                taxel: &taxel,
            };
            self.observer.push(frame, &seen);
            felt.suspects(&mut self.suspects);
        }
        Ok(Sensed {
            felt,
            observer: &self.observer,
            captured,
        })
    }

    /// Of the units that contradicted themselves in the frame before.
    fn look_for_swaps(&mut self) {
        if let Feel::ThreeAxis(sense) = &self.feel {
            let calibration = sense.estimator.calibration();
            for (unit, reading) in self.suspects.drain(..) {
                let (model, sigma) = (&calibration.units[unit], calibration.deviation[unit]);
                self.observer.suspect(unit, reading, model, sigma);
            }
        }
    }

    /// What was observed so far.
    pub(crate) fn observer(&self) -> &Observer {
        &self.observer
    }

    /// The calibration in force of three-axis units.
    pub fn calibration(&self) -> Option<&Calibration> {
        match &self.feel {
            Feel::ThreeAxis(sense) => Some(sense.estimator.calibration()),
            Feel::Signals(_) | Feel::Map(_) => None,
        }
    }

    /// What the numbers of a device of one value per taxel are.
    pub fn meaning(&self) -> Option<&SignalMeaning> {
        match &self.feel {
            Feel::Signals(sense) => Some(sense.meaning()),
            Feel::ThreeAxis(_) | Feel::Map(_) => None,
        }
    }

    /// Whether the device has rest values of its own, which a capture at the
    /// start should replace.
    pub(crate) fn has_rest(&self) -> bool {
        !matches!(self.feel, Feel::Map(_))
    }

    /// Kind of the device in messages.
    pub(crate) fn kind(&self) -> &'static str {
        match self.feel {
            Feel::ThreeAxis(_) => "three_axis",
            Feel::Signals(_) => "signals",
            Feel::Map(_) => "pressure_map",
        }
    }

    /// Unit of the forces of contacts.
    pub(crate) fn force_unit(&self) -> &'static str {
        self.force_unit
    }

    /// Unit of the speeds of contacts.
    pub(crate) fn speed_unit(&self) -> &'static str {
        self.speed_unit
    }

    /// Name of a channel, as recordings have it.
    pub(crate) fn channel_name(&self, channel: usize) -> String {
        let of_taxel = |taxel: usize| format!("r{}c{}", taxel / self.columns, taxel % self.columns);
        match (self.meaning(), self.observer.wiring()) {
            (Some(meaning), _) => meaning.channels.get(channel).cloned().unwrap_or_default(),
            (None, Wiring::PerTaxel(4)) => {
                format!("{}.{}", of_taxel(channel / 4), capacitor_name(channel % 4))
            }
            _ => of_taxel(channel),
        }
    }
}

/// Name of the capacitors 0 to 3 of a unit.
pub(crate) fn capacitor_name(capacitor: usize) -> &'static str {
    ["11", "12", "21", "22"]
        .get(capacitor)
        .copied()
        .unwrap_or("")
}

impl Rest {
    /// The rest value of each channel, SI.
    pub(crate) fn values(&self) -> Vec<f64> {
        match self {
            Self::ThreeAxis(calibration) => calibration.rest(),
            Self::Signals(rest) => rest.as_ref().map_or(Vec::new(), RestState::signals),
            Self::Map(rest) => rest.clone(),
        }
    }
}

impl<'a> Felt<'a> {
    /// Channels whose reading was clipped.
    pub(crate) fn clipped(self) -> usize {
        match self {
            Self::ThreeAxis(touch) => touch.clipped,
            Self::Signals(touch) => touch.clipped,
            Self::Map(_) => 0,
        }
    }

    /// Contacts, and the one of each taxel.
    pub(crate) fn contacts(self) -> (&'a [Contact], &'a [Option<u32>]) {
        match self {
            Self::ThreeAxis(touch) => (&touch.contacts, &touch.regions),
            Self::Signals(touch) => (&touch.contacts, &touch.regions),
            Self::Map(touch) => (&touch.contacts, &touch.regions),
        }
    }

    /// State of a taxel, and its residual in deviations.
    fn taxel(self, index: usize) -> (State, f64) {
        let state = match self {
            Self::ThreeAxis(touch) => {
                let taxel = touch.taxels.get(index);
                return taxel.map_or((State::Masked, f64::NAN), |taxel| {
                    (taxel.state, taxel.residual)
                });
            }
            Self::Signals(touch) => touch.taxels.get(index).map(|taxel| taxel.state),
            Self::Map(touch) => touch.states.get(index).copied(),
        };
        (state.unwrap_or(State::Masked), f64::NAN)
    }

    fn suspects(self, suspects: &mut Vec<(usize, [f64; 4])>) {
        if let Self::ThreeAxis(touch) = self {
            let taxels = touch.taxels.iter().enumerate();
            let contradicts = taxels.filter(|(_, taxel)| taxel.state == State::Inconsistent);
            suspects.extend(contradicts.map(|(index, taxel)| (index, taxel.capacitance)));
        }
    }

    /// Number of taxels in each state, in the order of the state codes.
    pub(crate) fn state_counts(self) -> [usize; State::ALL.len()] {
        let mut counts = [0; State::ALL.len()];
        let mut count = |state: State| counts[state as usize] += 1;
        match self {
            Self::ThreeAxis(touch) => touch.taxels.iter().for_each(|taxel| count(taxel.state)),
            Self::Signals(touch) => touch.taxels.iter().for_each(|taxel| count(taxel.state)),
            Self::Map(touch) => touch.states.iter().for_each(|state| count(*state)),
        }
        counts
    }
}
