//! Analogue-to-digital converter: voltage to counts.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{self, AnyVoltage, Checked};

/// An analogue-to-digital converter.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Converter {
    /// Resolution, bits, 1 to 32.
    #[schemars(range(min = 1, max = 32))]
    pub bits: u32,
    /// Input range [lowest, highest], V.
    #[serde(deserialize_with = "quantity::list::<2, AnyVoltage, _>")]
    #[schemars(with = "[Checked<AnyVoltage>; 2]")]
    pub range: [f64; 2],
}

/// One conversion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Code {
    /// Counts, 0 to [`Converter::highest`].
    pub counts: u32,
    /// True if the voltage was outside the range.
    pub clipped: bool,
}

impl Converter {
    /// Width of one count, V.
    pub fn step(&self) -> f64 {
        (self.range[1] - self.range[0]) / (f64::from(self.highest()) + 1.0)
    }

    /// The largest code.
    pub fn highest(&self) -> u32 {
        u32::MAX >> (32 - self.bits.clamp(1, 32))
    }

    /// Counts for a voltage; out of range gives the nearest code, clipped.
    pub fn convert(&self, voltage: f64) -> Code {
        let position = ((voltage - self.range[0]) / self.step()).floor();
        let clipped = !(position >= 0.0 && position <= f64::from(self.highest()));
        Code {
            counts: position.clamp(0.0, f64::from(self.highest())) as u32,
            clipped,
        }
    }

    /// Voltage at the middle of a code, V.
    pub fn voltage(&self, counts: f64) -> f64 {
        self.range[0] + (counts + 0.5) * self.step()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voltage_inverts_convert_to_half_a_count() {
        let converter = Converter {
            bits: 12,
            range: [-1.0, 2.0],
        };
        for i in 0..=1000 {
            let volts = -1.0 + 2.9999 * f64::from(i) / 1000.0;
            let code = converter.convert(volts);
            assert!(!code.clipped);
            // Half a count, and the rounding of the division.
            let off = (converter.voltage(f64::from(code.counts)) - volts).abs();
            assert!(off <= 0.5 * converter.step() * (1.0 + 1e-9));
        }
    }

    #[test]
    fn outside_the_range_is_clipped() {
        let converter = Converter {
            bits: 32,
            range: [0.0, 1.0],
        };
        assert_eq!(
            converter.convert(-1e-9),
            Code {
                counts: 0,
                clipped: true
            }
        );
        assert_eq!(
            converter.convert(1.0),
            Code {
                counts: u32::MAX,
                clipped: true
            }
        );
        assert!(converter.convert(f64::NAN).clipped);
    }
}
