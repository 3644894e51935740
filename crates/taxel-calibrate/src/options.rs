//! Options of a calibration.

use taxel::sensor::Sensor;

use crate::split::HoldOut;

/// A sensor with what files say of it.
#[derive(Debug, Clone, Copy)]
pub struct NamedSensor<'a> {
    /// Name of its file, or of a shipped one.
    pub name: &'a str,
    /// Text of its file: a calibration is bound to its values.
    pub text: &'a str,
    /// Description from the file.
    pub sensor: &'a Sensor,
}

/// Options of a calibration.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CalibrateOptions {
    /// Which readings are held out; by default the last 20 % in time.
    pub hold_out: HoldOut,
    /// Name of the model whose parameters are wanted; by default the first of
    /// [`crate::Calibratable::models`].
    pub model: Option<String>,
    /// True if intervals are taken from profiles of the likelihood.
    pub profile: bool,
    /// True if wrong readings are to be forgotten (Huber's loss).
    pub robust: bool,
    /// Rows a second of tables without a time, Hz, of a device that is trained.
    pub rate: Option<f64>,
    /// Unit of the scale in recordings without a header, of a device that is trained; by default
    /// grams, unless the largest reading speaks against it.
    pub scale_unit: Option<ScaleUnit>,
}

/// Unit of a scale whose recording does not say it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScaleUnit {
    /// Grams: the weight of as many at standard gravity.
    Grams,
    /// Newtons.
    Newtons,
}

/// Options of synthetic calibration data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SyntheticOptions {
    /// Seed of its noise.
    pub seed: u64,
    /// Readings of each sensor.
    pub readings: usize,
    /// Cycles of loading and unloading.
    pub cycles: usize,
    /// Largest relative compression.
    pub compression: f64,
    /// Standard deviation of a reading over the largest one, of forces and of
    /// changes of the signal.
    pub noise: f64,
    /// Force of loading over that of unloading, less one.
    pub hysteresis: f64,
    /// Change of the signal from the first reading to the last, over its range.
    pub drift: f64,
    /// Tilt of the probe along the gap, rad.
    pub tilt: f64,
    /// Share of the largest change of a channel from which it reads no more.
    pub saturation: f64,
}

impl Default for SyntheticOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            readings: 200,
            cycles: 2,
            compression: 0.28,
            noise: 0.01,
            hysteresis: 0.0,
            drift: 0.0,
            tilt: 0.0,
            saturation: 1.0,
        }
    }
}

/// Options of synthetic indentations at known positions.
#[derive(Debug, Clone, PartialEq)]
pub struct IndentationOptions {
    /// Seed of its noise.
    pub seed: u64,
    /// Radii of the contacts of the probes, m.
    pub radii: Vec<f64>,
    /// Distance of the indentations, m.
    pub grid: f64,
    /// Standard deviation of a signal over the highest one of its indentation.
    pub noise: f64,
}
