//! Derived quantities of a sensor file, as `taxel check` prints them.

use std::borrow::Cow;

/// One derived quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Fact {
    /// Group, in the order of the signal.
    pub group: &'static str,
    /// Name, usable as a key.
    pub name: String,
    /// SI value, or a word.
    pub value: Value,
    /// Part of the sensor file that it follows from.
    pub source: Cow<'static, str>,
}

/// A value of a fact.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// SI value with its SI unit, and the unit and scale for people.
    Number {
        /// SI.
        si: f64,
        /// SI unit as it ends a key.
        key: &'static str,
        /// Unit for people.
        unit: &'static str,
        /// SI value of that unit.
        scale: f64,
    },
    /// Words.
    Text(String),
}

/// A derived quantity.
pub fn fact(
    group: &'static str,
    name: impl Into<String>,
    value: Value,
    source: impl Into<Cow<'static, str>>,
) -> Fact {
    Fact {
        group,
        name: name.into(),
        value,
        source: source.into(),
    }
}

/// A number with its units.
pub fn number(si: f64, key: &'static str, unit: &'static str, scale: f64) -> Value {
    Value::Number {
        si,
        key,
        unit,
        scale,
    }
}

/// Words, or a whole number.
pub fn text(value: &(impl ToString + ?Sized)) -> Value {
    Value::Text(value.to_string())
}
