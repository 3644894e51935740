//! Bytes that stand in a packet, as hexadecimal text.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error as _};

/// Most bytes of a pattern or of what is sent to a board.
const MOST_BYTES: usize = 256;

/// Bytes that stand in every packet: `aa 07 c0-c6 ??` is 0xaa, 0x07, one from 0xc0 to 0xc6,
/// and any.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BytePattern(Vec<[u8; 2]>);

impl BytePattern {
    /// Number of bytes.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True without any byte.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// True if `bytes` begin with it.
    pub fn begins(&self, bytes: &[u8]) -> bool {
        bytes.len() >= self.len()
            && self
                .0
                .iter()
                .zip(bytes)
                .all(|([low, high], byte)| (low..=high).contains(&byte))
    }

    /// True if `bytes` end with it.
    pub fn ends(&self, bytes: &[u8]) -> bool {
        bytes.len() >= self.len() && self.begins(&bytes[bytes.len() - self.len()..])
    }

    /// True if it may begin with `byte`.
    pub fn may_begin(&self, byte: u8) -> bool {
        let first = self.0.first();
        first.is_none_or(|[low, high]| (*low..=*high).contains(&byte))
    }

    /// The least bytes that fit.
    pub fn example(&self) -> impl Iterator<Item = u8> {
        self.0.iter().map(|[low, _]| *low)
    }

    /// True if one begins as the other.
    pub(crate) fn agrees(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(own, other)| own == other)
    }

    /// True if it says which byte stands at this place.
    pub(crate) fn is_known(&self, place: usize) -> bool {
        self.0.get(place).is_some_and(|[low, high]| low == high)
    }

    /// Probability that random bytes fit.
    pub fn chance(&self) -> f64 {
        self.0
            .iter()
            .map(|[low, high]| (f64::from(*high) - f64::from(*low) + 1.0) / 256.0)
            .product()
    }

    fn parse(text: &str) -> Result<Self, String> {
        let byte = |digits: &str| {
            (digits.len() == 2)
                .then(|| u8::from_str_radix(digits, 16).ok())
                .flatten()
                .ok_or_else(|| {
                    format!(
                        "\"{digits}\" is no byte; write two hexadecimal digits, such as \"aa 07\""
                    )
                })
        };
        let bytes: Vec<_> = text
            .split_whitespace()
            .map(|word| match word.split_once('-') {
                _ if word == "??" => Ok([0, 255]),
                Some((low, high)) => {
                    let (low, high) = (byte(low)?, byte(high)?);
                    if low > high {
                        return Err(format!("\"{word}\" is no range of bytes: it must rise"));
                    }
                    Ok([low, high])
                }
                None => byte(word).map(|byte| [byte, byte]),
            })
            .collect::<Result<_, String>>()?;
        if bytes.is_empty() || bytes.len() > MOST_BYTES {
            return Err(format!("give 1 to {MOST_BYTES} bytes, such as \"aa 07\""));
        }
        Ok(Self(bytes))
    }
}

impl fmt::Display for BytePattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, [low, high]) in self.0.iter().enumerate() {
            let blank = if place == 0 { "" } else { " " };
            match (low, high) {
                (0, 255) => write!(f, "{blank}??")?,
                (low, high) if low == high => write!(f, "{blank}{low:02x}")?,
                (low, high) => write!(f, "{blank}{low:02x}-{high:02x}")?,
            }
        }
        Ok(())
    }
}

impl<'de> Deserialize<'de> for BytePattern {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).map_err(D::Error::custom)
    }
}

impl JsonSchema for BytePattern {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "BytePattern".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "description": "bytes as two hexadecimal digits each, such as \"aa 07\"; c0-c6 is a range, ?? any byte"})
    }
}

/// Bytes that are sent to a board: pairs of hexadecimal digits with blanks between them, or
/// else the text itself.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sent(pub Vec<u8>);

impl<'de> Deserialize<'de> for Sent {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        if text.is_empty() || text.len() > 4 * MOST_BYTES {
            let message =
                format!("give 1 to {MOST_BYTES} bytes, such as \"aa 00 32\" or \"start\\n\"");
            return Err(D::Error::custom(message));
        }
        let pairs = text
            .split_whitespace()
            .all(|word| word.len() == 2 && word.bytes().all(|byte| byte.is_ascii_hexdigit()));
        let bytes = if pairs && !text.trim().is_empty() {
            text.split_whitespace()
                .filter_map(|word| u8::from_str_radix(word, 16).ok())
                .collect()
        } else {
            text.into_bytes()
        };
        Ok(Self(bytes))
    }
}

impl JsonSchema for Sent {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Sent".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "description": "pairs of hexadecimal digits, such as \"aa 00 32\"; any other text is sent as it is, such as \"f1000\\n\""})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_take_ranges_and_any() {
        let pattern = BytePattern::parse("aa c0-c6 ??").unwrap_or_default();
        assert!(pattern.begins(&[0xaa, 0xc3, 0x12, 9]) && pattern.ends(&[1, 0xaa, 0xc6, 0]));
        assert!(!pattern.begins(&[0xaa, 0xc7, 0x12]) && !pattern.begins(&[0xaa, 0xc3]));
        assert_eq!(pattern.to_string(), "aa c0-c6 ??");
        for wrong in ["", "a", "0xaa", "c6-c0", "gg"] {
            assert!(BytePattern::parse(wrong).is_err(), "{wrong}");
        }
    }
}
