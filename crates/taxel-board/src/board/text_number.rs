//! A number as text: in a line, or in a JSON message.

use super::field::{Digits, Field, Type};

/// Longest number, characters.
const LONGEST: usize = 64;

/// How a number is written as text, and what it can be.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct TextNumber {
    pub(crate) digits: Digits,
    pub(crate) kind: Option<Type>,
}

/// What printf, `Print` of Arduino, Python and JSON write where a number is none.
const NO_NUMBER: [&str; 7] = ["nan", "inf", "infinity", "ovf", "null", "none", "na"];

/// True for a word that stands where a number is none, with or without a sign.
pub(crate) fn is_no_number(word: &str) -> bool {
    let word = word.strip_prefix(['+', '-']).unwrap_or(word);
    NO_NUMBER.iter().any(|none| word.eq_ignore_ascii_case(none))
}

impl TextNumber {
    pub(crate) fn of(field: &Field) -> Self {
        Self {
            digits: field.digits.unwrap_or_default(),
            kind: field.kind,
        }
    }

    /// The number of a word; `None` for one that is none, or that its type cannot hold.
    pub(crate) fn read(&self, word: &str) -> Option<f64> {
        if word.len() > LONGEST {
            return None;
        }
        match self.digits {
            Digits::Decimal => {
                let is_number = |c: u8| c.is_ascii_digit() || b"+-.eE".contains(&c);
                let number: f64 = word.bytes().all(is_number).then(|| word.parse().ok())??;
                (number.is_finite() && self.holds(number)).then_some(number)
            }
            Digits::Hexadecimal => {
                let whole = self.bits_of(word)?;
                Some(match self.kind {
                    Some(kind @ (Type::Signed(_) | Type::SignedBits(_))) => {
                        let shift = 64 - kind.bits();
                        ((whole << shift).cast_signed() >> shift) as f64
                    }
                    _ => whole as f64,
                })
            }
        }
    }

    /// A whole number without sign.
    pub(crate) fn whole(&self, word: &str) -> Option<u64> {
        match self.digits {
            Digits::Decimal => {
                let whole: u64 = word.parse().ok()?;
                self.holds(whole as f64).then_some(whole)
            }
            Digits::Hexadecimal => self.bits_of(word),
        }
    }

    /// True if the type has this number.
    pub(crate) fn holds(&self, number: f64) -> bool {
        self.kind.is_none_or(|kind| {
            let [least, most] = kind.limits();
            kind.is_float() || (number.fract() == 0.0 && (least..=most).contains(&number))
        })
    }

    fn bits_of(&self, word: &str) -> Option<u64> {
        let digits = word.strip_prefix("0x").unwrap_or(word);
        let is_hex = !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
        let whole = is_hex.then(|| u64::from_str_radix(digits, 16).ok())??;
        let bits = self.kind.map_or(64, Type::number_bits);
        (bits == 64 || whole >> bits == 0).then_some(whole)
    }

    /// A number as text.
    pub(crate) fn write(&self, number: f64) -> String {
        match self.digits {
            Digits::Decimal => number.to_string(),
            Digits::Hexadecimal => {
                let bits = self.kind.map_or(32, Type::number_bits);
                let mask = u64::MAX >> (64 - bits);
                let whole = (number.round() as i64).cast_unsigned() & mask;
                format!("{whole:0width$X}", width = bits.div_ceil(4))
            }
        }
    }
}
