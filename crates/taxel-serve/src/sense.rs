//! The estimator that fits a source: three axes, or a pressure map.

use taxel::acquisition::{Frame, Stream};
use taxel::calibration::{Calibration, RestRefused};
use taxel::estimation::{
    Estimator, EstimatorOptions, FrameError, MapEstimator, MapTouch, State, Touch,
};

/// Estimation of either kind of device.
#[derive(Debug)]
pub enum Sense {
    /// An array of three-axis units.
    ThreeAxis(Box<ThreeAxis>),
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
    /// On a map.
    Map(&'a MapTouch),
}

impl Sense {
    /// An estimator with `calibration` for frames as `stream` describes them.
    ///
    /// # Errors
    /// [`FrameError`] when the frames cannot be of the calibrated device.
    pub fn three_axis(calibration: Calibration, stream: &Stream) -> Result<Self, FrameError> {
        let expected = 4 * calibration.layout.taxels();
        let fits = stream.channels() == expected && stream.columns == calibration.layout.columns;
        if !fits {
            return Err(FrameError::Channels {
                found: stream.channels(),
                expected,
            });
        }
        let start = calibration.clone();
        let options = EstimatorOptions::default();
        let estimator = Estimator::new(calibration, stream.unit.quantity, options)?;
        Ok(Self::ThreeAxis(Box::new(ThreeAxis { estimator, start })))
    }

    /// A pressure map.
    pub fn map(stream: &Stream) -> Self {
        Self::Map(Box::new(MapEstimator::new(stream)))
    }

    /// Begins a rest capture.
    pub fn begin_rest_capture(&mut self, frames: usize) {
        match self {
            Self::ThreeAxis(sense) => sense.estimator.begin_rest_capture(frames),
            Self::Map(sense) => sense.begin_rest_capture(frames),
        }
    }

    /// Returns to the rest values of the start.
    pub fn clear_rest(&mut self) {
        match self {
            Self::ThreeAxis(sense) => sense.estimator.recalibrate(sense.start.clone()),
            Self::Map(sense) => sense.clear_rest(),
        }
    }

    /// Whether a rest capture is under way.
    pub fn capturing(&self) -> bool {
        match self {
            Self::ThreeAxis(sense) => sense.estimator.capturing(),
            Self::Map(sense) => sense.capturing(),
        }
    }

    /// Estimates one frame; the second value is the end of a rest capture.
    ///
    /// # Errors
    /// [`FrameError`] for a frame of another device.
    pub fn push(
        &mut self,
        frame: &Frame,
    ) -> Result<(Felt<'_>, Option<Result<(), RestRefused>>), FrameError> {
        match self {
            Self::ThreeAxis(sense) => {
                let (touch, captured) = sense.estimator.push(frame)?;
                Ok((Felt::ThreeAxis(touch), captured))
            }
            Self::Map(sense) => {
                let (touch, captured) = sense.push(frame)?;
                Ok((Felt::Map(touch), captured.then_some(Ok(()))))
            }
        }
    }

    /// The calibration in force; a map has none.
    pub fn calibration(&self) -> Option<&Calibration> {
        match self {
            Self::ThreeAxis(sense) => Some(sense.estimator.calibration()),
            Self::Map(_) => None,
        }
    }
}

impl Felt<'_> {
    /// Channels whose reading was clipped.
    pub fn clipped(&self) -> usize {
        match self {
            Self::ThreeAxis(touch) => touch.clipped,
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
            Self::Map(touch) => touch
                .states
                .iter()
                .for_each(|state| counts[*state as usize] += 1),
        }
        counts
    }
}
