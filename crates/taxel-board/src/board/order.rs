//! Order of the bytes of a number.

use schemars::JsonSchema;
use serde::Deserialize;

/// Order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Lowest byte first.
    #[default]
    Little,
    /// Highest byte first.
    Big,
}

impl Order {
    /// Reads a whole number.
    pub(crate) fn join(self, bytes: &[u8]) -> u64 {
        self.join_bits(bytes, 8)
    }

    /// The same of the lowest `bits` of each byte.
    pub(crate) fn join_bits(self, bytes: &[u8], bits: u32) -> u64 {
        let mask = u8::MAX >> (8 - bits);
        let join = |whole: u64, byte: &u8| whole << bits | u64::from(*byte & mask);
        match self {
            Self::Big => bytes.iter().fold(0, join),
            Self::Little => bytes.iter().rev().fold(0, join),
        }
    }
}
