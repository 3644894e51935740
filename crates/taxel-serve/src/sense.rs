//! The estimator that fits a source: three axes, one value per taxel, or a
//! pressure map.

use taxel::acquisition::{Frame, Stream};
use taxel::calibration::Calibration;
use taxel::device;
use taxel::estimation::{
    Estimator, EstimatorOptions, FrameError, MapEstimator, MapTouch, RestEnd, SignalEstimator,
    SignalMeaning, SignalTouch, State, Touch,
};

/// Estimation of any kind of device.
pub enum Sense {
    /// An array of three-axis units.
    ThreeAxis(Box<ThreeAxis>),
    /// A device of one value per taxel.
    Signals(Box<dyn SignalEstimator>),
    /// A map of one value per cell.
    Map(Box<MapEstimator>),
}

/// A three-axis estimator and the calibration it began with.
#[derive(Debug)]
pub struct ThreeAxis {
    estimator: Estimator,
    start: Calibration,
}

/// What one frame felt like.
#[derive(Debug, Clone, Copy)]
pub enum Felt<'a> {
    /// On an array of three-axis units.
    ThreeAxis(&'a Touch),
    /// On a device of one value per taxel.
    Signals(&'a SignalTouch),
    /// On a map.
    Map(&'a MapTouch),
}

impl Sense {
    /// The estimation of a device for frames as `stream` describes them.
    ///
    /// # Errors
    /// [`FrameError`] when the frames cannot be of the device.
    pub fn of(device: &dyn device::Device, stream: &Stream) -> Result<Self, FrameError> {
        match device.sense(stream)? {
            device::Sense::Signals(estimator) => Ok(Self::Signals(estimator)),
            device::Sense::ThreeAxis(calibration) => {
                let start = (*calibration).clone();
                let options = EstimatorOptions::default();
                let estimator = Estimator::new(*calibration, stream.unit.quantity, options)?;
                Ok(Self::ThreeAxis(Box::new(ThreeAxis { estimator, start })))
            }
        }
    }

    /// A pressure map.
    pub fn map(stream: &Stream) -> Self {
        Self::Map(Box::new(MapEstimator::new(stream)))
    }

    /// Begins a rest capture.
    pub fn begin_rest_capture(&mut self, frames: usize) {
        match self {
            Self::ThreeAxis(sense) => sense.estimator.begin_rest_capture(frames),
            Self::Signals(sense) => sense.begin_rest_capture(frames),
            Self::Map(sense) => sense.begin_rest_capture(frames),
        }
    }

    /// Returns to the rest values of the start.
    pub fn clear_rest(&mut self) {
        match self {
            Self::ThreeAxis(sense) => sense.estimator.recalibrate(sense.start.clone()),
            Self::Signals(sense) => sense.clear_rest(),
            Self::Map(sense) => sense.clear_rest(),
        }
    }

    /// Whether a rest capture is under way.
    pub fn capturing(&self) -> bool {
        match self {
            Self::ThreeAxis(sense) => sense.estimator.capturing(),
            Self::Signals(sense) => sense.capturing(),
            Self::Map(sense) => sense.capturing(),
        }
    }

    /// Estimates one frame; the second value is the end of a rest capture, with
    /// the reason when it was refused.
    ///
    /// # Errors
    /// [`FrameError`] for a frame of another device.
    pub fn push(&mut self, frame: &Frame) -> Result<(Felt<'_>, RestEnd), FrameError> {
        match self {
            Self::ThreeAxis(sense) => {
                let (touch, captured) = sense.estimator.push(frame)?;
                let captured = captured.map(|ended| ended.map_err(|refused| refused.to_string()));
                Ok((Felt::ThreeAxis(touch), captured))
            }
            Self::Signals(sense) => {
                let (touch, captured) = sense.push(frame)?;
                Ok((Felt::Signals(touch), captured))
            }
            Self::Map(sense) => {
                let (touch, captured) = sense.push(frame)?;
                Ok((Felt::Map(touch), captured.then_some(Ok(()))))
            }
        }
    }

    /// The calibration in force of three-axis units.
    pub fn calibration(&self) -> Option<&Calibration> {
        match self {
            Self::ThreeAxis(sense) => Some(sense.estimator.calibration()),
            Self::Signals(_) | Self::Map(_) => None,
        }
    }

    /// What the numbers of a device of one value per taxel are.
    pub fn meaning(&self) -> Option<&SignalMeaning> {
        match self {
            Self::Signals(sense) => Some(sense.meaning()),
            Self::ThreeAxis(_) | Self::Map(_) => None,
        }
    }

    /// Whether the device has rest values of its own, which a capture at the
    /// start should replace.
    pub fn has_rest(&self) -> bool {
        !matches!(self, Self::Map(_))
    }
}

impl Felt<'_> {
    /// Channels whose reading was clipped.
    pub fn clipped(&self) -> usize {
        match self {
            Self::ThreeAxis(touch) => touch.clipped,
            Self::Signals(touch) => touch.clipped,
            Self::Map(_) => 0,
        }
    }

    /// Number of taxels in each state, in the order of the state codes.
    pub fn state_counts(&self) -> [usize; State::ALL.len()] {
        let mut counts = [0; State::ALL.len()];
        match self {
            Self::ThreeAxis(touch) => {
                touch
                    .taxels
                    .iter()
                    .for_each(|taxel| counts[taxel.state as usize] += 1);
            }
            Self::Signals(touch) => touch
                .taxels
                .iter()
                .for_each(|taxel| counts[taxel.state as usize] += 1),
            Self::Map(touch) => touch
                .states
                .iter()
                .for_each(|state| counts[*state as usize] += 1),
        }
        counts
    }
}
