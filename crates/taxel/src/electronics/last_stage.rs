//! Last stage of a board: what is at its input to the number in a frame, and back. This is
//! where counts and physical values differ; nothing else of a device knows which it has.

use super::{Converter, Measured};
use crate::quantity::{Dimension, VOLTAGE};
use crate::signal::NumberScale;
use taxel_recording::{Quantity, SignalUnit};

/// Largest step that the digits of an instrument have, over the noise that its sensor file
/// states: rounding to it is a third of the variance. A reading that repeats is no fault before
/// it has done so more often than such digits explain.
const LARGEST_STEP: f64 = 2.0;

/// Last stage of a board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LastStage {
    /// A converter: a voltage to counts.
    Converter(Converter),
    /// An instrument: a quantity to its own value, SI.
    Instrument(Measured),
}

/// One number of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delivered {
    /// Counts, or the value in SI.
    pub number: f64,
    /// True if the input was at an end of the range or outside.
    pub clipped: bool,
}

impl LastStage {
    /// The number for an input, SI, with its noise.
    pub fn deliver(&self, input: f64) -> Delivered {
        match self {
            Self::Converter(converter) => {
                let code = converter.convert(input);
                Delivered {
                    number: f64::from(code.counts),
                    clipped: code.clipped,
                }
            }
            Self::Instrument(measured) => {
                let [low, high] = measured.ends();
                let number = match input {
                    _ if input <= low => low,
                    _ if input >= high => high,
                    _ if measured.step() > 0.0 => input.round(),
                    _ => input,
                };
                Delivered {
                    number,
                    clipped: !(input > low && input < high),
                }
            }
        }
    }

    /// The number of a line without a signal.
    pub fn dead(&self) -> f64 {
        match self {
            Self::Converter(_) => 0.0,
            Self::Instrument(_) => f64::NAN,
        }
    }

    /// Numbers to inputs.
    pub fn scale(&self) -> NumberScale {
        match self {
            Self::Converter(converter) => NumberScale {
                at_zero: converter.voltage(0.0),
                per_number: converter.step(),
                ends: [0.0, f64::from(converter.highest())],
                step: 1.0,
            },
            Self::Instrument(measured) => NumberScale {
                ends: measured.ends(),
                step: if measured.step() > 0.0 {
                    measured.step()
                } else {
                    let noises = measured.deviations().into_iter();
                    LARGEST_STEP * noises.fold(f64::INFINITY, f64::min)
                },
                ..NumberScale::VALUES
            },
        }
    }

    /// The least and the greatest input that is not clipped, SI.
    pub fn range(&self) -> [f64; 2] {
        match self {
            Self::Converter(converter) => converter.range,
            Self::Instrument(measured) => measured.ends(),
        }
    }

    /// Width of one step of the numbers at the input, SI.
    pub fn step(&self) -> f64 {
        match self {
            Self::Converter(converter) => converter.step(),
            Self::Instrument(measured) => measured.step(),
        }
    }

    /// Standard deviation that this stage adds to a reading, SI: rounding to counts, or the
    /// noise of the instrument.
    pub fn deviation(&self) -> f64 {
        self.deviation_along(2)
    }

    /// The same of a reading along x, y or z, for an element with axes.
    pub fn deviation_along(&self, axis: usize) -> f64 {
        match self {
            Self::Converter(converter) => converter.step() / 12.0_f64.sqrt(),
            Self::Instrument(measured) => {
                measured.deviations()[axis].hypot(measured.step() / 12.0_f64.sqrt())
            }
        }
    }

    /// Noise of this stage that a draw of the standard normal distribution scales, SI; that of
    /// rounding comes by itself.
    pub fn noise(&self) -> f64 {
        self.noise_along(2)
    }

    /// The same of a reading along x, y or z, for an element with axes.
    pub fn noise_along(&self, axis: usize) -> f64 {
        match self {
            Self::Converter(_) => 0.0,
            Self::Instrument(measured) => measured.deviations()[axis],
        }
    }

    /// Quantity and unit of the numbers.
    pub fn unit(&self) -> SignalUnit {
        match self {
            Self::Converter(_) => SignalUnit {
                quantity: Quantity::Counts,
                symbol: "counts".into(),
                si_per_unit: 1.0,
            },
            Self::Instrument(measured) => measured.unit.signal(),
        }
    }

    /// True if a quantity of this dimension can stand at the input.
    pub(crate) fn takes(&self, dimension: &Dimension) -> bool {
        match self {
            Self::Converter(_) => *dimension == VOLTAGE,
            Self::Instrument(measured) => measured.unit.dimension == dimension,
        }
    }

    /// Key of the range in a sensor file.
    pub(crate) fn range_key(&self) -> &'static str {
        match self {
            Self::Converter(_) => "electronics.converter.range",
            Self::Instrument(_) => "electronics.readout.measured.range",
        }
    }
}
