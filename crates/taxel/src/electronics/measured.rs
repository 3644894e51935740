//! An instrument that gives the quantity itself: farads, ohms, volts, coulombs or
//! newtons in place of counts.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{self, Deserializer, SeqAccess, Visitor};

use super::Stage;
use crate::quantity::{
    CAPACITANCE, CHARGE, Dimension, FLUX_DENSITY, FORCE, HELP, RESISTANCE, STRESS, VALUE, VOLTAGE,
};
use taxel_recording::{Quantity, SignalUnit};

/// What an instrument can give, with the quantity that frames carry then.
static GIVEN: [(&Dimension, Quantity); 7] = [
    (&CAPACITANCE, Quantity::Capacitance),
    (&VOLTAGE, Quantity::Voltage),
    (&RESISTANCE, Quantity::Resistance),
    (&CHARGE, Quantity::Charge),
    (&FORCE, Quantity::Force),
    (&STRESS, Quantity::Pressure),
    (&FLUX_DENSITY, Quantity::FluxDensity),
];

/// A number without a unit, as chips with a converter of their own give it.
pub static NUMBER: Dimension = Dimension {
    name: "a plain number",
    units: &[("counts", 1.0), ("raw", 1.0)],
    si: "counts",
    sizes: [1e-15, 1e15],
};

/// An instrument whose numbers are the physical quantity: a capacitance-to-digital
/// chip, an LCR meter, a DAQ card, a charge meter, a board that gives newtons.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// Unit in which people read the numbers; frames carry them in SI.
    pub unit: MeasuredUnit,
    /// Standard deviation of one reading, in a unit of the same quantity; one value, or of
    /// `element.measured_force` with three axes a list `[x, y, z]`.
    pub noise: Noises,
    /// Readings `[lowest, highest]`, in units of the same quantity: at an end or outside, a
    /// reading is clipped and says no more than that.
    pub range: [Stated; 2],
    /// The stage before an instrument that gives volts, as the same stage stands before a
    /// converter. Without it the instrument is at the element itself.
    #[serde(default)]
    pub stage: Option<Stage>,
}

/// Unit of the numbers of an instrument.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredUnit {
    /// Its dimension.
    pub dimension: &'static Dimension,
    /// Its symbol, such as `fF`.
    pub symbol: &'static str,
    /// SI value of one such unit.
    pub si_per_unit: f64,
    quantity: Quantity,
}

impl PartialEq for MeasuredUnit {
    fn eq(&self, other: &Self) -> bool {
        self.symbol == other.symbol
    }
}

impl MeasuredUnit {
    /// The unit called `symbol`.
    fn find(symbol: &str) -> Option<Self> {
        GIVEN.iter().find_map(|(dimension, quantity)| {
            let (symbol, si_per_unit) = dimension.entry(symbol.trim())?;
            Some(Self {
                dimension,
                symbol,
                si_per_unit,
                quantity: *quantity,
            })
        })
    }

    /// The SI unit as it ends a key.
    pub(crate) fn key(&self) -> &'static str {
        match self.quantity {
            Quantity::Capacitance => "f",
            Quantity::Resistance => "ohm",
            Quantity::Charge => "c",
            Quantity::Force => "n",
            Quantity::Pressure => "pa",
            Quantity::FluxDensity => "t",
            Quantity::Counts => "",
            _ => "v",
        }
    }

    /// The unit as frames name it.
    pub fn signal(&self) -> SignalUnit {
        SignalUnit {
            quantity: self.quantity,
            symbol: self.symbol.to_owned(),
            si_per_unit: self.si_per_unit,
        }
    }
}

/// Units that a file may name, for messages.
fn all_symbols() -> String {
    let each = GIVEN.iter().map(|(dimension, _)| dimension.symbols());
    each.collect::<Vec<_>>().join(", ")
}

impl<'de> Deserialize<'de> for MeasuredUnit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let symbol = Cow::<str>::deserialize(deserializer)?;
        Self::find(&symbol).ok_or_else(|| {
            de::Error::custom(format!(
                "\"{symbol}\" is no unit of a reading{HELP}use one of: {}; of numbers without a unit write readout = {{ digital = {{ unit = \"counts\" }} }}",
                all_symbols()
            ))
        })
    }
}

impl JsonSchema for MeasuredUnit {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "MeasuredUnit".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let symbols: Vec<&str> = GIVEN
            .iter()
            .flat_map(|(dimension, _)| dimension.units)
            .map(|(symbol, _)| *symbol)
            .collect();
        let value = format!("one of {}", all_symbols());
        json_schema!({"type": "string", "enum": symbols, VALUE: value})
    }
}

/// A value of any dimension that an instrument can have, as a file states it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stated {
    /// SI.
    pub value: f64,
    /// Its dimension.
    pub dimension: &'static Dimension,
}

impl Stated {
    fn parse(text: &str) -> Result<Self, String> {
        Self::with_unit(text).map(|(stated, _)| stated)
    }

    /// The same, and the unit in which it is stated.
    pub(crate) fn with_unit(text: &str) -> Result<(Self, &'static str), String> {
        let symbol = text.trim().trim_start_matches(|c: char| {
            c.is_ascii_digit() || matches!(c, '+' | '-' | '.') || c.is_whitespace()
        });
        let symbol = symbol
            .trim_start_matches(['e', 'E'])
            .trim_start_matches(|c: char| {
                c.is_ascii_digit() || matches!(c, '+' | '-') || c.is_whitespace()
            });
        let unit = MeasuredUnit::find(symbol).ok_or_else(|| {
                format!(
                    "\"{text}\" is no number with the unit of a reading{HELP}write it such as \"1.5 pF\"; units: {}",
                    all_symbols()
                )
            })?;
        let stated = Self {
            value: unit.dimension.read_sized(text)?,
            dimension: unit.dimension,
        };
        Ok((stated, unit.symbol))
    }
}

struct StatedVisitor;

impl Visitor<'_> for StatedVisitor {
    type Value = Stated;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a quantity in quotes, such as \"1.5 pF\"")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Stated, E> {
        Stated::parse(text).map_err(E::custom)
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Stated, E> {
        Err(E::custom(format!(
            "{value} has no unit{HELP}write it in quotes with its unit, such as \"{value} pF\"; units: {}",
            all_symbols()
        )))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Stated, E> {
        self.visit_f64(value as f64)
    }
}

impl<'de> Deserialize<'de> for Stated {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StatedVisitor)
    }
}

impl JsonSchema for Stated {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Stated".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let units: Vec<String> = GIVEN
            .iter()
            .map(|(dimension, _)| dimension.symbols().replace(", ", "|"))
            .collect();
        let symbols = units.join("|").replace('u', "[uµμ]");
        let number = r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?";
        let text = format!("a quantity with its unit ({})", all_symbols());
        let value = "a quantity of the kind of `unit`";
        let pattern = format!(r"^\s*{number}\s*({symbols})\s*$");
        json_schema!({"type": "string", "pattern": pattern, "description": text, VALUE: value})
    }
}

/// Standard deviation of a reading along x, y and z; one value stands for all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noises(pub [Stated; 3]);

struct NoisesVisitor;

impl<'de> Visitor<'de> for NoisesVisitor {
    type Value = Noises;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a quantity in quotes, such as \"1.5 pF\", or a list of three")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Noises, E> {
        let one = StatedVisitor.visit_str(text)?;
        Ok(Noises([one; 3]))
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Noises, E> {
        let one = StatedVisitor.visit_f64(value)?;
        Ok(Noises([one; 3]))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Noises, E> {
        self.visit_f64(value as f64)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Noises, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = sequence.next_element::<Stated>()? {
            values.push(value);
        }
        let found = values.len();
        values.try_into().map(Noises).map_err(|_| {
            de::Error::custom(format!(
                "the list has {found} values; exactly 3 are needed, of x, y and z"
            ))
        })
    }
}

impl<'de> Deserialize<'de> for Noises {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NoisesVisitor)
    }
}

impl JsonSchema for Noises {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Noises".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let item = Stated::json_schema(generator);
        json_schema!({"oneOf": [item, {"type": "array", "items": item, "minItems": 3, "maxItems": 3}]})
    }
}

impl Measured {
    /// An instrument that gives pressures in kPa, with this noise and range, Pa.
    pub(super) fn of_pressures(noise: f64, range: [f64; 2]) -> Self {
        let stated = |value| Stated {
            value,
            dimension: &STRESS,
        };
        Self {
            unit: MeasuredUnit {
                dimension: &STRESS,
                symbol: "kPa",
                si_per_unit: 1e3,
                quantity: Quantity::Pressure,
            },
            noise: Noises([stated(noise); 3]),
            range: range.map(stated),
            stage: None,
        }
    }

    /// Chips that give capacitances in fF, with this noise and range, F.
    pub(super) fn of_capacitances(noise: f64, range: [f64; 2]) -> Self {
        let stated = |value| Stated {
            value,
            dimension: &CAPACITANCE,
        };
        Self {
            unit: MeasuredUnit {
                dimension: &CAPACITANCE,
                symbol: "fF",
                si_per_unit: 1e-15,
                quantity: Quantity::Capacitance,
            },
            noise: Noises([stated(noise); 3]),
            range: range.map(stated),
            stage: None,
        }
    }

    /// Chips that give flux densities in uT, with this noise along each axis and range, T.
    pub(super) fn of_fields(noise: [f64; 3], range: [f64; 2]) -> Self {
        let stated = |value| Stated {
            value,
            dimension: &FLUX_DENSITY,
        };
        Self {
            unit: MeasuredUnit {
                dimension: &FLUX_DENSITY,
                symbol: "uT",
                si_per_unit: 1e-6,
                quantity: Quantity::FluxDensity,
            },
            noise: Noises(noise.map(stated)),
            range: range.map(stated),
            stage: None,
        }
    }

    /// Chips whose numbers are taken as they are, with this noise: no number is at an end.
    pub(super) fn of_numbers(symbol: &'static str, noise: f64) -> Self {
        let stated = |value| Stated {
            value,
            dimension: &NUMBER,
        };
        Self {
            unit: MeasuredUnit {
                dimension: &NUMBER,
                symbol,
                si_per_unit: 1.0,
                quantity: Quantity::Counts,
            },
            noise: Noises([stated(noise); 3]),
            range: [f64::NEG_INFINITY, f64::INFINITY].map(stated),
            stage: None,
        }
    }

    /// Step of the numbers, SI: one count; zero of an instrument, whose noise has that of its digits.
    pub fn step(&self) -> f64 {
        f64::from(u8::from(self.unit.symbol == "counts"))
    }

    /// Standard deviation of one reading, SI.
    pub fn deviation(&self) -> f64 {
        self.deviations()[2]
    }

    /// The same along x, y and z, for an element with axes.
    pub fn deviations(&self) -> [f64; 3] {
        self.noise.0.map(|noise| noise.value)
    }

    /// The lowest and the highest reading, SI.
    pub fn ends(&self) -> [f64; 2] {
        self.range.map(|end| end.value)
    }
}
