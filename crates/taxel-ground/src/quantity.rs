//! Numbers with units at the human boundary.
//!
//! In files a quantity is a string (`"400 um"`, `"9.62 kN/m"`); inside it is an
//! `f64` in SI. A number without a unit, a unit of another dimension and a
//! value outside its range are refused while parsing, so that the mistake is
//! reported under the very word.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Deserialize, Deserializer, SeqAccess, Visitor};

/// Key under which a schema says what a value is; a field's own description
/// stands in the place of `description`.
pub const VALUE: &str = "x-value";

/// Marks the start of the advice inside an error text; serde carries only text.
pub const HELP: &str = "\u{1}help:";

/// A physical dimension and the units that files may use for it.
#[derive(Debug)]
pub struct Dimension {
    /// Name with its article, for messages: `a length`.
    pub name: &'static str,
    /// Symbol and SI value of each unit; the SI unit itself is among them.
    pub units: &'static [(&'static str, f64)],
    /// Symbol of the SI unit.
    pub si: &'static str,
    /// Smallest and largest size of a value that is not zero, SI: far beyond what a
    /// sensor has, so that what is computed from it stays finite.
    pub sizes: [f64; 2],
}

macro_rules! dimensions {
    ($($(#[$doc:meta])* $name:ident = $text:literal, $si:literal, $sizes:tt:
        [$($unit:literal = $scale:literal),+];)+) => {
        $($(#[$doc])*
        pub static $name: Dimension =
            Dimension { name: $text, units: &[$(($unit, $scale)),+], si: $si, sizes: $sizes };)+
        static ALL: &[&Dimension] = &[$(&$name),+];
    };
}

dimensions! {
    /// Length, m.
    LENGTH = "a length", "m", [1e-12, 1e3]:
        ["nm" = 1e-9, "um" = 1e-6, "mm" = 1e-3, "cm" = 1e-2, "m" = 1.0];
    /// Time, s.
    TIME = "a time", "s", [1e-12, 1e9]:
        ["ns" = 1e-9, "us" = 1e-6, "ms" = 1e-3, "s" = 1.0, "min" = 60.0];
    /// Frequency, Hz.
    FREQUENCY = "a frequency", "Hz", [1e-6, 1e12]:
        ["Hz" = 1.0, "kHz" = 1e3, "MHz" = 1e6];
    /// Force, N.
    FORCE = "a force", "N", [1e-12, 1e6]:
        ["uN" = 1e-6, "mN" = 1e-3, "N" = 1.0, "kN" = 1e3];
    /// Moment of forces, N m.
    MOMENT = "a moment", "N m", [1e-12, 1e6]:
        ["uN m" = 1e-6, "mN m" = 1e-3, "N mm" = 1e-3, "N m" = 1.0];
    /// Angle, rad.
    ANGLE = "an angle", "rad", [1e-12, 1e6]:
        ["mrad" = 1e-3, "deg" = 0.017453292519943295, "rad" = 1.0];
    /// Stiffness of a spring, N/m.
    STIFFNESS = "a stiffness", "N/m", [1e-9, 1e12]:
        ["N/m" = 1.0, "kN/m" = 1e3, "N/mm" = 1e3, "MN/m" = 1e6];
    /// Stress or pressure, Pa.
    STRESS = "a stress", "Pa", [1e-6, 1e13]:
        ["Pa" = 1.0, "kPa" = 1e3, "MPa" = 1e6, "GPa" = 1e9];
    /// Capacitance, F.
    CAPACITANCE = "a capacitance", "F", [1e-24, 1e3]:
        ["aF" = 1e-18, "fF" = 1e-15, "pF" = 1e-12, "nF" = 1e-9, "F" = 1.0];
    /// Density, kg/m³.
    DENSITY = "a density", "kg/m3", [1e-3, 1e6]:
        ["kg/m3" = 1.0, "g/cm3" = 1e3];
    /// Viscosity, Pa s.
    VISCOSITY = "a viscosity", "Pa s", [1e-9, 1e9]:
        ["mPa s" = 1e-3, "Pa s" = 1.0];
    /// Speed, m/s.
    SPEED = "a speed", "m/s", [1e-12, 1e6]:
        ["mm/s" = 1e-3, "m/s" = 1.0];
    /// Charge per force, C/N.
    CHARGE_PER_FORCE = "a charge per force", "C/N", [1e-18, 1.0]:
        ["pC/N" = 1e-12, "nC/N" = 1e-9, "C/N" = 1.0];
    /// Electrical resistance, Ω.
    RESISTANCE = "a resistance", "ohm", [1e-9, 1e18]:
        ["mohm" = 1e-3, "ohm" = 1.0, "kohm" = 1e3, "Mohm" = 1e6, "Gohm" = 1e9];
    /// Electrical conductance, S.
    CONDUCTANCE = "a conductance", "S", [1e-18, 1e9]:
        ["nS" = 1e-9, "uS" = 1e-6, "mS" = 1e-3, "S" = 1.0];
    /// Electrical resistivity, Ω m.
    RESISTIVITY = "a resistivity", "ohm m", [1e-12, 1e18]:
        ["nohm m" = 1e-9, "uohm m" = 1e-6, "ohm m" = 1.0];
    /// Area, m².
    AREA = "an area", "m2", [1e-20, 1e6]:
        ["um2" = 1e-12, "mm2" = 1e-6, "cm2" = 1e-4, "m2" = 1.0];
    /// Volume, m³.
    VOLUME = "a volume", "m3", [1e-30, 1e6]:
        ["um3" = 1e-18, "mm3" = 1e-9, "ml" = 1e-6, "m3" = 1.0];
    /// Charge, C.
    CHARGE = "a charge", "C", [1e-21, 1e6]:
        ["fC" = 1e-15, "pC" = 1e-12, "nC" = 1e-9, "C" = 1.0];
    /// Magnetic flux density, T.
    FLUX_DENSITY = "a flux density", "T", [1e-15, 1e3]:
        ["nT" = 1e-9, "uT" = 1e-6, "mT" = 1e-3, "T" = 1.0];
    /// Difference of temperatures, K.
    TEMPERATURE_DIFFERENCE = "a temperature difference", "K", [1e-9, 1e4]:
        ["mK" = 1e-3, "K" = 1.0];
    /// Relative change per temperature, 1/K.
    TEMPERATURE_COEFFICIENT = "a temperature coefficient", "1/K", [1e-12, 1.0]:
        ["ppm/K" = 1e-6, "%/K" = 1e-2, "1/K" = 1.0];
    /// Displacement per force, m/N.
    COMPLIANCE = "a compliance", "m/N", [1e-12, 1e6]:
        ["um/N" = 1e-6, "mm/N" = 1e-3, "m/N" = 1.0];
    /// Angle per force, rad/N.
    TILT_PER_FORCE = "a tilt per force", "rad/N", [1e-12, 1e6]:
        ["mrad/N" = 1e-3, "deg/N" = 0.017453292519943295, "rad/N" = 1.0];
    /// Voltage, V.
    VOLTAGE = "a voltage", "V", [1e-12, 1e6]:
        ["nV" = 1e-9, "uV" = 1e-6, "mV" = 1e-3, "V" = 1.0];
}

/// How many of a unit one SI unit is, for a unit that is a whole part of it. Dividing by it is
/// exact for the common case of a decimal below one ("6 um" is 6e-6, not 5.999...e-6).
pub(crate) fn whole_parts(scale: f64) -> Option<f64> {
    let parts = (1.0 / scale).round();
    (scale < 1.0 && (parts * scale - 1.0).abs() < 1e-12).then_some(parts)
}

/// All dimensions that files know.
pub fn dimensions() -> impl Iterator<Item = &'static Dimension> {
    ALL.iter().copied()
}

impl PartialEq for Dimension {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Dimension {
    /// A number, SI, in one of the units; the number itself for a unit that is none of them.
    /// Reading it back gives the number again but for rounding.
    pub fn in_unit(&self, si: f64, symbol: &str) -> f64 {
        let scale = self.unit(symbol).unwrap_or(1.0);
        whole_parts(scale).map_or(si / scale, |parts| si * parts)
    }

    /// SI value of one `symbol`, if it is a unit of this dimension.
    pub fn unit(&self, symbol: &str) -> Option<f64> {
        self.entry(symbol).map(|(_, scale)| scale)
    }

    /// The unit called `symbol`, as it is written here, with its SI value.
    pub fn entry(&self, symbol: &str) -> Option<(&'static str, f64)> {
        let symbol = plain_micro(symbol);
        self.units.iter().find(|(name, _)| *name == symbol).copied()
    }

    /// Name without its article: `length`.
    pub fn noun(&self) -> &'static str {
        self.name.trim_start_matches("a ").trim_start_matches("an ")
    }

    /// The symbols, for messages: `nm, um, mm, cm, m`.
    pub fn symbols(&self) -> String {
        self.units
            .iter()
            .map(|(symbol, _)| *symbol)
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// Reads `"400 um"` as an SI value.
    ///
    /// # Errors
    /// A message for people when there is no finite number, no unit, or a unit
    /// of another dimension.
    pub fn parse(&self, text: &str) -> Result<f64, String> {
        self.read(text)
            .map_err(|message| message.replace(HELP, "; "))
    }

    /// As [`Self::read`], of either sign and no more than the largest size.
    ///
    /// # Errors
    /// As [`Self::read`]; a size above the largest.
    pub fn read_sized(&self, text: &str) -> Result<f64, String> {
        let value = self.read(text)?;
        let [_, largest] = self.sizes;
        if at_most(value.abs(), largest) {
            return Ok(value);
        }
        Err(format!(
            "\"{text}\" is out of range: its size must be at most {largest:e} {}",
            self.si
        ))
    }

    /// As [`Self::parse`]; what to do stands in the message behind [`HELP`].
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn read(&self, text: &str) -> Result<f64, String> {
        let trimmed = text.trim();
        let split = number_length(trimmed);
        let (number, symbol) = (&trimmed[..split], trimmed[split..].trim());
        let value: f64 = number
            .parse()
            .ok()
            .filter(|value: &f64| value.is_finite())
            .ok_or_else(|| {
                let fault = if starts_not_finite(trimmed) {
                    "is not a finite number"
                } else {
                    "does not start with a number"
                };
                format!(
                    "\"{text}\" {fault}{HELP}write {} such as \"1.5 {}\"",
                    self.name, self.si
                )
            })?;
        if symbol.is_empty() {
            return Err(format!(
                "\"{text}\" has no unit{HELP}add one of: {}",
                self.symbols()
            ));
        }
        match self.unit(symbol) {
            Some(scale) => Ok(whole_parts(scale).map_or(value * scale, |parts| value / parts)),
            None => Err(self.wrong_unit(symbol)),
        }
    }

    fn wrong_unit(&self, symbol: &str) -> String {
        let belongs = ALL
            .iter()
            .find(|dimension| dimension.unit(symbol).is_some());
        let what = belongs.map_or(String::from("no known unit"), |dimension| {
            format!("a unit of {}", dimension.noun())
        });
        format!(
            "\"{symbol}\" is {what}; {} is needed here{HELP}use one of: {}",
            self.name,
            self.symbols()
        )
    }
}

/// The Greek and the micro sign both mean `u`.
fn plain_micro(symbol: &str) -> Cow<'_, str> {
    if symbol.contains(['µ', 'μ']) {
        Cow::Owned(symbol.replace(['µ', 'μ'], "u"))
    } else {
        Cow::Borrowed(symbol)
    }
}

/// Length in bytes of the number at the start of `text`.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        let exponent = matches!(bytes[at], b'e' | b'E')
            && at > 0
            && bytes
                .get(at + 1)
                .is_some_and(|next| next.is_ascii_digit() || matches!(next, b'+' | b'-'));
        if !(bytes[at].is_ascii_digit() || matches!(bytes[at], b'+' | b'-' | b'.') || exponent) {
            break;
        }
        at += 1;
    }
    at
}

/// True if `text` starts with a number that is not finite: `nan`, `-inf` or `1e999`.
fn starts_not_finite(text: &str) -> bool {
    let word = text.split_whitespace().next().unwrap_or_default();
    let mut starts = [&text[..number_length(text)], word].into_iter();
    starts.any(|start| start.parse().is_ok_and(|value: f64| !value.is_finite()))
}

/// Significant digits of a decimal: no file states more, and the few products and sums of a rule
/// between keys round the sixteenth.
const DECIMALS: usize = 12;

/// The decimal that a number stands for, without what conversions of units and sums have rounded.
pub fn decimal(value: f64) -> f64 {
    // What is written so is read so; what is not finite stays so.
    format!("{value:.*e}", DECIMALS - 1)
        .parse()
        .unwrap_or(value)
}

/// True if `value` is at most `bound`, as decimals: 10 um is at most a thirtieth of 300 um, which
/// binary numbers deny.
///
/// ```
/// use taxel_ground::quantity::{LENGTH, at_most};
/// let (deviation, gap) = (LENGTH.parse("10 um").unwrap(), LENGTH.parse("300 um").unwrap());
/// assert!(at_most(3.0 * deviation, 0.1 * gap));
/// assert!(!at_most(3.00000001 * deviation, 0.1 * gap));
/// ```
pub fn at_most(value: f64, bound: f64) -> bool {
    decimal(value) <= decimal(bound)
}

/// True if `value` is less than `bound`, as decimals.
pub fn below(value: f64, bound: f64) -> bool {
    decimal(value) < decimal(bound)
}

/// Rule for one value of a file: its dimension and its range.
pub trait Rule {
    /// `None` for a plain number.
    const DIMENSION: Option<&'static Dimension>;
    /// Smallest value, SI.
    const LOWEST: f64;
    /// True if the smallest value itself is refused.
    const OPEN: bool;
    /// Largest value, SI.
    const HIGHEST: f64;
    /// Smallest and largest size of a value that is not zero, SI.
    const SIZES: [f64; 2] = match Self::DIMENSION {
        Some(dimension) => dimension.sizes,
        None => NUMBERS,
    };
}

/// Sizes of plain numbers, as [`Dimension::sizes`].
const NUMBERS: [f64; 2] = [1e-15, 1e15];

/// Range of values under the rule `R`, within the sizes of its dimension, SI.
fn limits<R: Rule>() -> [f64; 2] {
    let [_, largest] = R::SIZES;
    [R::LOWEST.max(-largest), R::HIGHEST.min(largest)]
}

macro_rules! rules {
    ($($(#[$doc:meta])* $name:ident: $dimension:expr, $lowest:expr, $open:literal, $highest:expr;)+) => {
        $($(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name;
        impl Rule for $name {
            const DIMENSION: Option<&'static Dimension> = $dimension;
            const LOWEST: f64 = $lowest;
            const OPEN: bool = $open;
            const HIGHEST: f64 = $highest;
        })+
    };
}

/// No other limit than the sizes of the dimension.
const NO_LIMIT: f64 = f64::INFINITY;

rules! {
    /// Any length.
    AnyLength: Some(&LENGTH), -NO_LIMIT, false, NO_LIMIT;
    /// A length above zero, at most 10 m.
    PositiveLength: Some(&LENGTH), 0.0, true, 10.0;
    /// A length of zero or more, at most 10 m.
    NonNegativeLength: Some(&LENGTH), 0.0, false, 10.0;
    /// A time above zero.
    PositiveTime: Some(&TIME), 0.0, true, 1e9;
    /// A time of zero or more.
    NonNegativeTime: Some(&TIME), 0.0, false, 1e9;
    /// A frequency from 1 mHz to 1 MHz: rates of frames.
    FrameRate: Some(&FREQUENCY), 1e-3, false, 1e6;
    /// Any force.
    AnyForce: Some(&FORCE), -NO_LIMIT, false, NO_LIMIT;
    /// A force above zero.
    PositiveForce: Some(&FORCE), 0.0, true, NO_LIMIT;
    /// A force of zero or more.
    NonNegativeForce: Some(&FORCE), 0.0, false, NO_LIMIT;
    /// A stiffness above zero.
    PositiveStiffness: Some(&STIFFNESS), 0.0, true, NO_LIMIT;
    /// Any stress.
    AnyStress: Some(&STRESS), -NO_LIMIT, false, NO_LIMIT;
    /// A stress above zero.
    PositiveStress: Some(&STRESS), 0.0, true, NO_LIMIT;
    /// A stress or pressure of zero or more.
    NonNegativeStress: Some(&STRESS), 0.0, false, NO_LIMIT;
    /// A resistance above zero.
    PositiveResistance: Some(&RESISTANCE), 0.0, true, NO_LIMIT;
    /// A resistance of zero or more.
    NonNegativeResistance: Some(&RESISTANCE), 0.0, false, NO_LIMIT;
    /// A conductance above zero.
    PositiveConductance: Some(&CONDUCTANCE), 0.0, true, NO_LIMIT;
    /// Exponent of a conductance against pressure, from 0.3 to 1.5.
    ConductanceExponent: None, 0.3, false, 1.5;
    /// A share of a pressure that does not arrive, from 0 to 0.95.
    TrappedAir: None, 0.0, false, 0.95;
    /// A resistivity above zero.
    PositiveResistivity: Some(&RESISTIVITY), 0.0, true, NO_LIMIT;
    /// A capacitance above zero.
    PositiveCapacitance: Some(&CAPACITANCE), 0.0, true, NO_LIMIT;
    /// Any capacitance.
    AnyCapacitance: Some(&CAPACITANCE), -NO_LIMIT, false, NO_LIMIT;
    /// A capacitance of zero or more.
    NonNegativeCapacitance: Some(&CAPACITANCE), 0.0, false, NO_LIMIT;
    /// Any voltage.
    AnyVoltage: Some(&VOLTAGE), -NO_LIMIT, false, NO_LIMIT;
    /// A voltage above zero.
    PositiveVoltage: Some(&VOLTAGE), 0.0, true, NO_LIMIT;
    /// A voltage of zero or more.
    NonNegativeVoltage: Some(&VOLTAGE), 0.0, false, NO_LIMIT;
    /// An area above zero.
    PositiveArea: Some(&AREA), 0.0, true, 100.0;
    /// A density above zero.
    PositiveDensity: Some(&DENSITY), 0.0, true, 1e5;
    /// A viscosity of zero or more.
    NonNegativeViscosity: Some(&VISCOSITY), 0.0, false, NO_LIMIT;
    /// Any flux density.
    AnyFluxDensity: Some(&FLUX_DENSITY), -NO_LIMIT, false, NO_LIMIT;
    /// A flux density of zero or more.
    NonNegativeFluxDensity: Some(&FLUX_DENSITY), 0.0, false, NO_LIMIT;
    /// A temperature difference of zero or more.
    NonNegativeTemperature: Some(&TEMPERATURE_DIFFERENCE), 0.0, false, 1e3;
    /// A relative change per temperature, of at most 10 % per kelvin either way.
    AnyTemperatureCoefficient: Some(&TEMPERATURE_COEFFICIENT), -0.1, false, 0.1;
    /// Any displacement per force.
    AnyCompliance: Some(&COMPLIANCE), -NO_LIMIT, false, NO_LIMIT;
    /// Any angle per force.
    AnyTiltPerForce: Some(&TILT_PER_FORCE), -NO_LIMIT, false, NO_LIMIT;
    /// An angle from zero to 1 rad.
    SmallAngle: Some(&ANGLE), 0.0, false, 1.0;
    /// A speed above zero.
    PositiveSpeed: Some(&SPEED), 0.0, true, 1e3;
    /// A charge per force above zero.
    PositiveChargePerForce: Some(&CHARGE_PER_FORCE), 0.0, true, NO_LIMIT;
    /// Any charge per force.
    AnyChargePerForce: Some(&CHARGE_PER_FORCE), -NO_LIMIT, false, NO_LIMIT;
    /// A gain of an amplifier without feedback, from 1 to 1e12.
    OpenLoopGain: None, 1.0, false, 1e12;
    /// A gain above zero, at most 1e6.
    PositiveGain: None, 0.0, true, 1e6;
    /// Noise of numbers without a unit.
    Noise: None, 0.0, false, 1e9;
    /// A number from 0 to 1.
    Fraction: None, 0.0, false, 1.0;
    /// A number of zero or more, at most 100: ratios such as a relaxing share.
    Ratio: None, 0.0, false, 100.0;
    /// A number from -0.9 to 0.9: relative errors.
    RelativeError: None, -0.9, false, 0.9;
    /// A calibration factor of an end condition, from 0.01 to 1e6.
    EndParameter: None, 0.01, false, 1e6;
    /// A factor of the bottom shear of a layer: below 0.65 the force of a long
    /// layer falls again before a compression of 0.4.
    EndFactor: None, 0.65, false, 100.0;
    /// Any number.
    AnyNumber: None, -NO_LIMIT, false, NO_LIMIT;
    /// Any number above zero.
    PositiveNumber: None, 0.0, true, NO_LIMIT;
    /// A number above zero, at most 100.
    PositiveRatio: None, 0.0, true, 100.0;
    /// Exponent of a published fringe factor, above -1 and at most 10.
    FringeExponent: None, -1.0, true, 10.0;
    /// Height of a line on the flank of a bump over the height of the bump: strips of
    /// a quarter were solved.
    BarHeight: None, 0.125, false, 0.875;
    /// A Poisson's ratio from 0 to 0.5.
    PoissonRatio: None, 0.0, false, 0.5;
    /// A number above zero, at most 1: the share that is left of something.
    PositiveFraction: None, 0.0, true, 1.0;
    /// A relative permittivity, from 1 to 1e5.
    RelativePermittivity: None, 1.0, false, 1e5;
}

/// Checks `value` (SI) against the range of `R`; `shown` is what the file says.
fn in_range<R: Rule>(value: f64, shown: &str) -> Result<f64, String> {
    let [lowest, highest] = limits::<R>();
    let low = if R::OPEN {
        below(lowest, value)
    } else {
        at_most(lowest, value)
    };
    let [smallest, _] = R::SIZES;
    if !(low && at_most(value, highest)) {
        let range = range_text::<R>();
        return Err(format!("{shown} is out of range: must be {range}"));
    }
    if value != 0.0 && below(value.abs(), smallest) {
        let unit = unit_text::<R>();
        let or_zero = if R::OPEN { "" } else { "; 0 is also possible" };
        return Err(format!(
            "{shown} is out of range: its size must be at least {smallest:e}{unit}{or_zero}"
        ));
    }
    Ok(value)
}

fn unit_text<R: Rule>() -> String {
    R::DIMENSION.map_or(String::new(), |dimension| format!(" {}", dimension.si))
}

fn range_text<R: Rule>() -> String {
    let unit = unit_text::<R>();
    let low = if R::OPEN { "greater than" } else { "at least" };
    let [lowest, highest] = limits::<R>().map(limit);
    format!("{low} {lowest}{unit} and at most {highest}{unit}")
}

/// A limit without its zeros: `1e9`, `0.65`.
fn limit(value: f64) -> String {
    if value.abs() >= 1e5 {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

/// Numbers before a unit as far as a pattern can describe them: their form and their sign.
fn number_pattern<R: Rule>() -> String {
    let sign_and_digits = if R::LOWEST < 0.0 {
        r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)"
    } else if R::OPEN || R::LOWEST > 0.0 {
        r"\+?(0*[1-9][0-9]*\.?[0-9]*|0*\.0*[1-9][0-9]*)"
    } else {
        r"(\+?([0-9]+\.?[0-9]*|\.[0-9]+)|-(0+\.?0*|\.0+))"
    };
    format!("{sign_and_digits}([eE][-+]?[0-9]+)?")
}

/// One value of a file under the rule `R`, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked<R>(pub f64, PhantomData<R>);

struct CheckedVisitor<R>(PhantomData<R>);

impl<R: Rule> CheckedVisitor<R> {
    fn number<E: de::Error>(value: f64) -> Result<Checked<R>, E> {
        if let Some(dimension) = R::DIMENSION {
            let text = format!(
                "{value} has no unit{HELP}write it in quotes with its unit, such as \"{value} {}\"; units: {}",
                dimension.si,
                dimension.symbols()
            );
            return Err(E::custom(text));
        }
        let shown = if value.abs() < 1e15 {
            value.to_string()
        } else {
            format!("{value:e}")
        };
        in_range::<R>(value, &shown)
            .map(|value| Checked(value, PhantomData))
            .map_err(E::custom)
    }
}

impl<R: Rule> Visitor<'_> for CheckedVisitor<R> {
    type Value = Checked<R>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match R::DIMENSION {
            Some(dimension) => write!(
                f,
                "{} in quotes, such as \"1.5 {}\"",
                dimension.name, dimension.si
            ),
            None => write!(f, "a number, {}", range_text::<R>()),
        }
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Checked<R>, E> {
        let Some(dimension) = R::DIMENSION else {
            return Err(E::custom(format!(
                "\"{text}\" is text; a plain number is needed here"
            )));
        };
        let value = dimension.read(text).map_err(E::custom)?;
        in_range::<R>(value, &format!("\"{text}\""))
            .map(|value| Checked(value, PhantomData))
            .map_err(E::custom)
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Checked<R>, E> {
        Self::number(value)
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Checked<R>, E> {
        Self::number(value as f64)
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Checked<R>, E> {
        Self::number(value as f64)
    }
}

impl<'de, R: Rule> Deserialize<'de> for Checked<R> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(CheckedVisitor(PhantomData))
    }
}

impl<R: Rule> JsonSchema for Checked<R> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Quantity".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let kind = R::DIMENSION.map_or("a number", |dimension| dimension.name);
        let value = format!("{kind}, {}", range_text::<R>());
        let Some(dimension) = R::DIMENSION else {
            let mut schema =
                json_schema!({"type": "number", "description": range_text::<R>(), VALUE: value});
            let lowest = if R::OPEN {
                "exclusiveMinimum"
            } else {
                "minimum"
            };
            for (keyword, limit) in [lowest, "maximum"].into_iter().zip(limits::<R>()) {
                schema.insert(keyword.into(), limit.into());
            }
            return schema;
        };
        let units: Vec<_> = dimension.units.iter().map(|(symbol, _)| *symbol).collect();
        // A file may write the micro sign.
        let symbols = units.join("|").replace('u', "[uµμ]");
        let pattern = format!(r"^\s*{}\s*({symbols})\s*$", number_pattern::<R>());
        let text = format!(
            "{} with its unit ({}), {}",
            dimension.name,
            units.join(", "),
            range_text::<R>()
        );
        json_schema!({"type": "string", "pattern": pattern, "description": text, VALUE: value})
    }
}

/// A quantity of any dimension, SI; what it must be follows from its use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnyQuantity {
    /// SI.
    pub value: f64,
    /// Its dimension.
    pub dimension: &'static Dimension,
}

impl AnyQuantity {
    fn read(text: &str) -> Result<Self, String> {
        let trimmed = text.trim();
        let symbol = trimmed[number_length(trimmed)..].trim();
        let dimension = dimensions().find(|dimension| dimension.unit(symbol).is_some());
        // Without one, the message of any dimension asks for the number and the unit.
        let dimension = dimension.ok_or_else(|| {
            if symbol.is_empty() {
                format!(
                    "\"{text}\" has no unit{HELP}write it such as \"1.5 mm\", \"2 kPa\" or \"3 N\""
                )
            } else if starts_not_finite(trimmed) {
                format!(
                    "\"{text}\" is not a finite number{HELP}write it such as \"1.5 mm\", \"2 kPa\" or \"3 N\""
                )
            } else {
                let known: Vec<String> = dimensions()
                    .map(|dimension| format!("{}: {}", dimension.name, dimension.symbols()))
                    .collect();
                format!(
                    "\"{symbol}\" is no known unit{HELP}use one of {}",
                    known.join("; ")
                )
            }
        })?;
        let value = dimension.read_sized(text)?;
        Ok(Self { value, dimension })
    }
}

struct AnyQuantityVisitor;

impl Visitor<'_> for AnyQuantityVisitor {
    type Value = AnyQuantity;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a quantity in quotes, such as \"1.5 mm\"")
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<AnyQuantity, E> {
        AnyQuantity::read(text).map_err(E::custom)
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<AnyQuantity, E> {
        Err(E::custom(format!(
            "{value} has no unit{HELP}write it in quotes with its unit, such as \"{value} mm\""
        )))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<AnyQuantity, E> {
        self.visit_f64(value as f64)
    }
}

impl<'de> Deserialize<'de> for AnyQuantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AnyQuantityVisitor)
    }
}

impl JsonSchema for AnyQuantity {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "AnyQuantity".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let symbols = dimensions().flat_map(|dimension| dimension.units.iter());
        let symbols: Vec<_> = symbols.map(|(symbol, _)| *symbol).collect();
        let symbols = symbols.join("|").replace('u', "[uµμ]");
        let number = r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?";
        let pattern = format!(r"^\s*{number}\s*({symbols})\s*$");
        let value = "a quantity with its unit";
        json_schema!({"type": "string", "pattern": pattern, "description": value, VALUE: value})
    }
}

/// Reads one value under the rule `R`.
///
/// # Errors
/// The deserializer's error, with a message that names value, range and units.
pub fn one<'de, R: Rule, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Checked::<R>::deserialize(deserializer)?.0)
}

/// Reads a value under the rule `R` for a key that may be left out.
///
/// # Errors
/// As [`one`].
pub fn some<'de, R: Rule, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    one::<R, D>(deserializer).map(Some)
}

/// Reads a list of exactly `N` values under the rule `R`.
///
/// # Errors
/// As [`one`], and when the list has another length.
pub fn list<'de, const N: usize, R: Rule, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<[f64; N], D::Error> {
    deserializer.deserialize_seq(ListVisitor::<N, R>(PhantomData))
}

/// Reads a list of `N` values, or one value that stands for all of them.
///
/// # Errors
/// As [`list`].
pub fn one_or_list<'de, const N: usize, R: Rule, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<[f64; N], D::Error> {
    deserializer.deserialize_any(ListVisitor::<N, R>(PhantomData))
}

/// As [`list`], for a key that may be missing: with `#[serde(default)]`.
///
/// # Errors
/// As [`list`].
pub fn optional_list<'de, const N: usize, R: Rule, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<[f64; N]>, D::Error> {
    list::<N, R, D>(deserializer).map(Some)
}

/// As [`one_or_list`], for a key that may be missing: with `#[serde(default)]`.
///
/// # Errors
/// As [`one_or_list`].
pub fn optional_one_or_list<'de, const N: usize, R: Rule, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<[f64; N]>, D::Error> {
    one_or_list::<N, R, D>(deserializer).map(Some)
}

/// As [`one`], for a key that may be missing: with `#[serde(default)]`.
///
/// # Errors
/// As [`one`].
pub fn optional<'de, R: Rule, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<f64>, D::Error> {
    one::<R, D>(deserializer).map(Some)
}

struct ListVisitor<const N: usize, R>(PhantomData<R>);

impl<'de, const N: usize, R: Rule> Visitor<'de> for ListVisitor<N, R> {
    type Value = [f64; N];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a list of {N}, each ")?;
        CheckedVisitor::<R>(PhantomData).expecting(f)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<[f64; N], A::Error> {
        let mut values = [0.0; N];
        let mut found = 0;
        while let Some(Checked(value, _)) = sequence.next_element::<Checked<R>>()? {
            if let Some(slot) = values.get_mut(found) {
                *slot = value;
            }
            found += 1;
        }
        if found == N {
            Ok(values)
        } else {
            Err(de::Error::custom(format!(
                "the list has {found} values; exactly {N} are needed"
            )))
        }
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<[f64; N], E> {
        CheckedVisitor::<R>(PhantomData)
            .visit_str(text)
            .map(|Checked(value, _)| [value; N])
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<[f64; N], E> {
        CheckedVisitor::<R>::number(value).map(|Checked(value, _)| [value; N])
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<[f64; N], E> {
        self.visit_f64(value as f64)
    }
}

/// Schema of [`one_or_list`].
#[derive(Debug)]
pub struct OneOrList<const N: usize, R>(PhantomData<R>);

impl<const N: usize, R: Rule> JsonSchema for OneOrList<N, R> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "OneOrList".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let item = Checked::<R>::json_schema(generator);
        json_schema!({"oneOf": [item, {"type": "array", "items": item, "minItems": N, "maxItems": N}]})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_with_units_become_si() {
        assert_eq!(LENGTH.parse("6 um"), Ok(6e-6));
        assert_eq!(LENGTH.parse("400µm"), Ok(400e-6));
        assert_eq!(STIFFNESS.parse("9.62 kN/m"), Ok(9620.0));
        assert_eq!(CAPACITANCE.parse(" 1.5e2 fF "), Ok(150e-15));
        assert_eq!(TIME.parse("-2 ms"), Ok(-2e-3));
    }

    #[test]
    fn sizes_are_finite_and_leave_zero() {
        for dimension in dimensions() {
            let [smallest, largest] = dimension.sizes;
            assert!(smallest > 0.0 && smallest < 1.0 && largest.is_finite());
        }
        assert_eq!(in_range::<AnyVoltage>(0.0, ""), Ok(0.0));
        assert_eq!(in_range::<AnyVoltage>(-1e6, ""), Ok(-1e6));
        for wrong in [-1e308, f64::INFINITY, f64::NAN, 5e-324, -5e-324] {
            assert!(in_range::<AnyVoltage>(wrong, "").is_err(), "{wrong}");
            assert!(in_range::<PositiveResistance>(wrong, "").is_err());
            assert!(in_range::<PositiveGain>(wrong, "").is_err(), "{wrong}");
        }
        let message = in_range::<PositiveResistance>(5e-324, "\"5e-324 ohm\"").unwrap_err();
        assert!(message.contains("at least 1e-9 ohm"), "{message}");
    }

    #[test]
    fn mistakes_name_the_units() {
        for (text, part) in [
            (
                "75.5 um",
                "\"um\" is a unit of length; a stress is needed here",
            ),
            ("75.5", "has no unit"),
            ("kPa", "does not start with a number"),
            ("1e999 kPa", "is not a finite number"),
            ("nan kPa", "is not a finite number"),
            ("-inf kPa", "is not a finite number"),
            ("nano kPa", "does not start with a number"),
            ("3 furlong", "\"furlong\" is no known unit"),
            ("", "does not start with a number"),
        ] {
            let message = STRESS.parse(text).unwrap_err();
            assert!(
                message.contains(part) && message.contains("Pa") && !message.contains(HELP),
                "{text}: {message}"
            );
        }
    }
}
