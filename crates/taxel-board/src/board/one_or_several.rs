//! Values that a file may write as one or as a list.

use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

/// One text or several.
#[derive(Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "text in quotes is needed here, or a list of them"
)]
pub enum Texts {
    /// One.
    One(String),
    /// Several.
    Several(Vec<String>),
}

pub(super) fn texts<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<String>, D::Error> {
    Ok(match Texts::deserialize(deserializer)? {
        Texts::One(text) => vec![text],
        Texts::Several(texts) => texts,
    })
}

/// A whole number, or text such as `0x0fff`.
#[derive(Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a whole number of 0 or more is needed here, such as 15 or \"0x000f\""
)]
pub enum Whole {
    /// A number.
    Number(u64),
    /// Hexadecimal digits behind `0x`.
    Text(String),
}

impl Whole {
    fn value<E: serde::de::Error>(self) -> Result<u64, E> {
        match self {
            Self::Number(number) => Ok(number),
            Self::Text(text) => text
                .strip_prefix("0x")
                .and_then(|digits| u64::from_str_radix(digits, 16).ok())
                .ok_or_else(|| {
                    E::custom(format!(
                        "\"{text}\" is no whole number; write one such as 15 or \"0x000f\""
                    ))
                }),
        }
    }
}

pub(super) fn whole<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u64>, D::Error> {
    Whole::deserialize(deserializer)?.value().map(Some)
}

/// One whole number or several.
#[derive(Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a whole number of 0 or more is needed here, such as 15 or \"0x000f\", or a list of them"
)]
pub enum Wholes {
    /// One.
    One(Whole),
    /// Several.
    Several(Vec<Whole>),
}

pub(super) fn wholes<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u64>, D::Error> {
    match Wholes::deserialize(deserializer)? {
        Wholes::One(one) => Ok(vec![one.value()?]),
        Wholes::Several(several) => several.into_iter().map(Whole::value).collect(),
    }
}

/// What stands in the place of a reading: a number, all from one to another, or a word of a line.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a number is needed here, two in brackets for all between them, or a word such as \"over\""
)]
pub enum Missing {
    /// The number itself.
    Number(f64),
    /// From the first to the second, such as an end of the range: `[4090, 4095]`.
    Stretch([f64; 2]),
    /// A word.
    Word(String),
}

/// One or several of them.
#[derive(Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a number is needed here, or a word such as \"over\", or a list of them, in which [4090, 4095] is all between two"
)]
pub enum Missings {
    /// One.
    Number(f64),
    /// A word.
    Word(String),
    /// Several.
    Several(Vec<Missing>),
}

pub(super) fn missing<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<Missing>, D::Error> {
    Ok(match Missings::deserialize(deserializer)? {
        Missings::Number(number) => vec![Missing::Number(number)],
        Missings::Word(word) => vec![Missing::Word(word)],
        Missings::Several(several) => several,
    })
}

/// A number, or text with a unit.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a number is needed here, or text with a unit such as \"2.5 pF\""
)]
pub enum Amount {
    /// In the unit of the field.
    Number(f64),
    /// With its own unit.
    Text(String),
}

pub(super) fn step<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    let step = f64::deserialize(deserializer)?;
    if step > 0.0 && step.is_finite() {
        Ok(Some(step))
    } else {
        Err(D::Error::custom(format!(
            "{step} is out of range: must be greater than 0"
        )))
    }
}
