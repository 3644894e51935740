//! Devices that feel one value per taxel: in-plane capacitor, piezoelectric
//! elements, crossed channels.

use super::baseline::Baseline;
use super::contact::Contact;
use super::{FrameError, State};
use crate::acquisition::Frame;
use crate::calibration::InPlaneCalibration;
use crate::transduction::InPlaneModel;

/// Turns frames into one value per taxel; the same frames give the same values.
pub trait SignalEstimator: Send {
    /// What the signals and values are; does not change.
    fn meaning(&self) -> &SignalMeaning;

    /// Takes one frame.
    ///
    /// # Errors
    /// [`FrameError`] for a frame of another device.
    fn push(&mut self, frame: &Frame) -> Result<(&SignalTouch, RestEnd), FrameError>;

    /// Begins a rest capture over the next `frames` frames.
    fn begin_rest_capture(&mut self, frames: usize);

    /// Whether a rest capture is under way.
    fn capturing(&self) -> bool;

    /// Returns to the rest values of the calibration.
    fn clear_rest(&mut self);

    /// The rest values in force, to be put back later; `None` for an estimator
    /// that has none.
    fn rest_state(&self) -> Option<RestState> {
        None
    }

    /// Puts back rest values that this estimator gave, bit for bit.
    fn restore_rest(&mut self, _rest: &RestState) {}

    /// The readings of the empty device, and every change of them; none for a
    /// device that feels changes only.
    fn baseline(&self) -> Option<&Baseline> {
        None
    }
}

/// Rest values of an estimator, as it keeps them.
#[derive(Debug, Clone, PartialEq)]
pub enum RestState {
    /// The signal of each channel, SI.
    Signals(Vec<f64>),
    /// The calibration of in-plane sensors.
    InPlane(Box<InPlaneCalibration>),
}

impl RestState {
    /// Signal of each channel at rest, SI.
    pub fn signals(&self) -> Vec<f64> {
        match self {
            Self::Signals(signals) => signals.clone(),
            Self::InPlane(calibration) => {
                let models = calibration.models.iter();
                models.map(InPlaneModel::rest_capacitance).collect()
            }
        }
    }
}

/// End of a rest capture, if a frame was its last, with the reason when it was
/// refused.
pub type RestEnd = Option<Result<(), String>>;

/// What the numbers of a [`SignalTouch`] are, for people and programs.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalMeaning {
    /// Rows of taxels; row 0 is at +y.
    pub rows: usize,
    /// Columns of taxels; column 0 is at -x.
    pub columns: usize,
    /// Spacing of rows and of columns, m.
    pub pitch: [f64; 2],
    /// Name of each channel in the order of a frame, such as `row 0`.
    pub channels: Vec<String>,
    /// What a channel carries, such as a resistance.
    pub signal: Scale,
    /// What a taxel feels, such as a force.
    pub value: Scale,
    /// Value at the end of the colour scale, SI.
    pub full_scale: f64,
    /// Whether values of either sign occur in normal use.
    pub signed: bool,
    /// How the image of the taxels is coloured.
    pub picture: Picture,
}

/// A quantity and the unit in which people read it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Name, such as `resistance`.
    pub quantity: &'static str,
    /// Unit for people, such as `ohm`.
    pub symbol: &'static str,
    /// SI value of one such unit.
    pub si_per_unit: f64,
}

/// Colours of an image of taxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Picture {
    /// From nothing to full scale through the colours of heat.
    Heat,
    /// From black to white by the size of the value.
    Grayscale,
}

/// What a device of one value per taxel feels in one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SignalTouch {
    /// Sequence number of the frame.
    pub sequence: u64,
    /// Device time of the frame, ns.
    pub time_ns: u64,
    /// Signal of each channel, SI; `NaN` for no reading.
    pub signals: Vec<f64>,
    /// The same at rest, SI; `NaN` where a channel has no rest value.
    pub rest: Vec<f64>,
    /// Each taxel, row by row.
    pub taxels: Vec<TaxelValue>,
    /// Total normal force and its standard deviation, N, where the device
    /// knows it.
    pub force: Option<[f64; 2]>,
    /// Centre over all contacts, m, and its covariance xx, xy, yy, m² (`NaN`
    /// where it is not known).
    pub centre_of_pressure: Option<([f64; 2], [f64; 3])>,
    /// Contact regions, strongest first.
    pub contacts: Vec<Contact>,
    /// Index of the contact of each taxel, row by row.
    pub regions: Vec<Option<u32>>,
    /// Channels whose reading was clipped.
    pub clipped: usize,
}

/// What one taxel feels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaxelValue {
    /// The value, SI; `NaN` for none.
    pub value: f64,
    /// Its standard deviation, SI; `NaN` where it is not known.
    pub deviation: f64,
    /// How far it can be trusted.
    pub state: State,
}
