//! Fields of a packet.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer};

use super::one_or_several::{self, Amount, Missing};
use super::order::Order;
use crate::pattern::BytePattern;

/// One field of a packet, or several of one kind.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// What it is.
    pub is: Is,
    /// Its name; a pattern such as `m{1..5}.{x,y,z}` or `c1..c4` stands for several fields.
    #[serde(default)]
    pub name: Option<String>,
    /// Type of its number.
    #[serde(default, rename = "type")]
    pub kind: Option<Type>,
    /// Its bytes, for a mark or what is skipped.
    #[serde(default)]
    pub bytes: Option<usize>,
    /// Place of its first byte in the packet; default behind the field before.
    #[serde(default)]
    pub at: Option<usize>,
    /// Its first bit, counted from the first byte of the fields of bits beside it; default
    /// behind the field before.
    #[serde(default)]
    pub bit: Option<usize>,
    /// Order of its bytes; default that of the packet.
    #[serde(default)]
    pub order: Option<Order>,
    /// Value of one step of the number, in `unit`; default 1.
    #[serde(default)]
    pub scale: Option<f64>,
    /// Value of the number 0, in `unit`; default 0.
    #[serde(default)]
    pub offset: Option<f64>,
    /// Unit of the value; default counts. For a time s, ms, us or ns.
    #[serde(default)]
    pub unit: Option<String>,
    /// Bits of the number that count.
    #[serde(default, deserialize_with = "one_or_several::whole")]
    #[schemars(with = "Option<one_or_several::Whole>")]
    pub mask: Option<u64>,
    /// The number is shifted right by so many bits, after the mask.
    #[serde(default)]
    pub shift: Option<u32>,
    /// The number is this less what stands there.
    #[serde(default)]
    pub invert_from: Option<f64>,
    /// Least and largest value, in `unit`; outside, the packet is damaged.
    #[serde(default)]
    #[schemars(with = "Option<[Amount; 2]>")]
    pub range: Option<[Amount; 2]>,
    /// What stands where there is no reading: a number, or several, in which `[4090, 4095]` is all
    /// from one to the other; and in text words such as `over`.
    #[serde(default, deserialize_with = "one_or_several::missing")]
    #[schemars(with = "Option<one_or_several::Missings>")]
    pub missing: Vec<Missing>,
    /// Status that is good, or several; a packet with another is not delivered.
    #[serde(default, deserialize_with = "one_or_several::wholes")]
    #[schemars(with = "Option<one_or_several::Wholes>")]
    pub good: Vec<u64>,
    /// Names of the bits of a status.
    #[serde(default)]
    pub bits: BTreeMap<String, u32>,
    /// Bytes of a mark, where head and tail do not say them.
    #[serde(default)]
    pub equals: Option<BytePattern>,
    /// Number of packets that make a frame, for an address.
    #[serde(default)]
    pub count: Option<usize>,
    /// First address; default 0.
    #[serde(default)]
    pub first: Option<i64>,
    /// What a sequence counts, where a frame has several packets or messages; default frames.
    #[serde(default)]
    pub counts: Option<CountedBySequence>,
    /// Where it stands in a JSON message: keys, and places in lists, with `/` between them.
    #[serde(default)]
    pub key: Option<String>,
    /// How its numbers are written as text, in lines and in JSON messages; default decimal.
    #[serde(default)]
    pub digits: Option<Digits>,
    /// Of a sequence or an address: from one number to the next; default 1.
    #[serde(default)]
    pub step: Option<u64>,
    /// Of a sequence: the number behind its largest, at which it begins again from 0; default
    /// by its type.
    #[serde(default)]
    pub modulus: Option<u64>,
    /// Of a sequence: frames that have the same number; default 1.
    #[serde(default)]
    pub repeats: Option<u64>,
}

/// What carries a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Within {
    /// Bytes of a packet or a CAN message.
    Bytes,
    /// A line of text.
    Line,
    /// The template of a line: fields only say more of its values.
    Template,
    /// A JSON message.
    Json,
}

impl Within {
    fn name(self) -> &'static str {
        match self {
            Self::Bytes => "in bytes",
            Self::Line => "in a line",
            Self::Template => "of a template",
            Self::Json => "in a JSON message",
        }
    }
}

impl Field {
    /// Keys that the field has, beside `is`.
    fn given(&self) -> impl Iterator<Item = &'static str> {
        [
            (self.name.is_some(), "name"),
            (self.kind.is_some(), "type"),
            (self.bytes.is_some(), "bytes"),
            (self.at.is_some(), "at"),
            (self.bit.is_some(), "bit"),
            (self.order.is_some(), "order"),
            (self.scale.is_some(), "scale"),
            (self.offset.is_some(), "offset"),
            (self.unit.is_some(), "unit"),
            (self.mask.is_some(), "mask"),
            (self.shift.is_some(), "shift"),
            (self.invert_from.is_some(), "invert_from"),
            (self.range.is_some(), "range"),
            (!self.missing.is_empty(), "missing"),
            (!self.good.is_empty(), "good"),
            (!self.bits.is_empty(), "bits"),
            (self.equals.is_some(), "equals"),
            (self.count.is_some(), "count"),
            (self.first.is_some(), "first"),
            (self.counts.is_some(), "counts"),
            (self.key.is_some(), "key"),
            (self.digits.is_some(), "digits"),
            (self.step.is_some(), "step"),
            (self.modulus.is_some(), "modulus"),
            (self.repeats.is_some(), "repeats"),
        ]
        .into_iter()
        .filter_map(|(given, key)| given.then_some(key))
    }

    /// The first key that says nothing of such a field, and those that do.
    pub(super) fn meaningless(&self, within: Within) -> Option<(&'static str, String)> {
        let known = keys(self.is, within);
        let key = self
            .given()
            .find(|key| !known.iter().any(|keys| keys.contains(key)))?;
        let known: Vec<&str> = known.iter().copied().flatten().copied().collect();
        let help = match known[..] {
            [] => "leave it out".to_owned(),
            _ => format!("leave it out; it has: {}", known.join(", ")),
        };
        Some((key, help))
    }

    /// What the message about a key that says nothing calls the field.
    pub(super) fn called(&self, within: Within) -> String {
        let is = match self.is {
            Is::Value => "a value",
            Is::Sequence => "a sequence",
            Is::Time => "a time",
            Is::Status => "a status",
            Is::Mark => "a mark",
            Is::Skip => "what is skipped",
            Is::Address => "an address",
            Is::Check => "a check",
        };
        format!("{is} {}", within.name())
    }
}

/// Keys that say something of a field, in groups.
fn keys(is: Is, within: Within) -> Vec<&'static [&'static str]> {
    const VALUE: &[&str] = &[
        "name",
        "scale",
        "offset",
        "unit",
        "mask",
        "shift",
        "invert_from",
        "range",
        "missing",
    ];
    let place: &[&str] = match within {
        Within::Bytes => &["type", "at", "bit", "order"],
        Within::Line | Within::Template => &["type", "digits"],
        Within::Json => &["type", "digits", "key"],
    };
    let bytes = within == Within::Bytes;
    match is {
        Is::Value => vec![VALUE, place],
        Is::Sequence => vec![place, &["step", "modulus", "repeats", "counts"]],
        Is::Time => vec![place, &["unit", "scale"]],
        Is::Status if within == Within::Line => vec![place, &["good"]],
        Is::Status => vec![place, &["name", "good", "bits"]],
        Is::Mark => vec![&["bytes", "at", "equals"]],
        Is::Skip if bytes => vec![&["bytes", "type", "at", "bit"]],
        Is::Address => vec![place, &["count", "first", "step"]],
        Is::Check => vec![&["at"]],
        Is::Skip => Vec::new(),
    }
}

/// What a field is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Is {
    /// A reading.
    Value,
    /// Running number of the frame.
    Sequence,
    /// Time of the board.
    Time,
    /// Status: looked at, not delivered.
    Status,
    /// Bytes that stand in every packet.
    Mark,
    /// Nothing that matters.
    Skip,
    /// Which of the packets of a frame it is.
    Address,
    /// The check.
    Check,
}

/// What a sequence counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CountedBySequence {
    /// Each frame: its packets have one number.
    #[default]
    Frames,
    /// Each packet: those of a frame follow each other in the order of their addresses.
    Packets,
}

/// How numbers are written as text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Digits {
    /// `33270`
    #[default]
    Decimal,
    /// `81F6`
    Hexadecimal,
}

/// Type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    /// Whole number without sign, bytes.
    Unsigned(usize),
    /// Whole number with sign (two's complement), bytes.
    Signed(usize),
    /// Floating point, 4 bytes.
    F32,
    /// Floating point, 8 bytes.
    F64,
    /// Whole number without sign, bits.
    Bits(u32),
    /// Whole number with sign, bits.
    SignedBits(u32),
    /// Whole number without sign, seven bits in each of so many bytes.
    Sevens(usize),
}

/// Most bytes of seven bits: their number is one of 56 bits.
const MOST_SEVENS: u32 = 8;

impl Type {
    /// Names of the types.
    const NAMES: [(&'static str, Self); 12] = [
        ("u8", Self::Unsigned(1)),
        ("i8", Self::Signed(1)),
        ("u16", Self::Unsigned(2)),
        ("i16", Self::Signed(2)),
        ("u24", Self::Unsigned(3)),
        ("i24", Self::Signed(3)),
        ("u32", Self::Unsigned(4)),
        ("i32", Self::Signed(4)),
        ("u64", Self::Unsigned(8)),
        ("i64", Self::Signed(8)),
        ("f32", Self::F32),
        ("f64", Self::F64),
    ];

    /// Its size on the wire in bits.
    pub fn bits(self) -> usize {
        match self {
            Self::Unsigned(bytes) | Self::Signed(bytes) | Self::Sevens(bytes) => 8 * bytes,
            Self::F32 => 32,
            Self::F64 => 64,
            Self::Bits(bits) | Self::SignedBits(bits) => bits as usize,
        }
    }

    /// Bits of its number.
    pub(crate) fn number_bits(self) -> usize {
        match self {
            Self::Sevens(bytes) => 7 * bytes,
            kind => kind.bits(),
        }
    }

    /// Least and largest number of a whole type.
    pub(crate) fn limits(self) -> [f64; 2] {
        let bits = self.number_bits() as f64;
        match self {
            Self::Signed(_) | Self::SignedBits(_) => {
                let top = (bits - 1.0).exp2();
                [-top, top - 1.0]
            }
            _ => [0.0, bits.exp2() - 1.0],
        }
    }

    /// True for a type that is packed bit by bit.
    pub fn is_bits(self) -> bool {
        matches!(self, Self::Bits(_) | Self::SignedBits(_))
    }

    /// True for whole numbers without sign.
    pub fn is_unsigned(self) -> bool {
        matches!(self, Self::Unsigned(_) | Self::Bits(_) | Self::Sevens(_))
    }

    /// True for floating point.
    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    fn parse(text: &str) -> Option<Self> {
        if let Some((_, kind)) = Self::NAMES.iter().find(|(name, _)| *name == text) {
            return Some(*kind);
        }
        let bits = |prefix: &str| {
            let bits = text.strip_prefix(prefix)?.strip_suffix(')')?.trim();
            bits.parse().ok().filter(|bits| (1..=32).contains(bits))
        };
        bits("bits(")
            .map(Self::Bits)
            .or_else(|| bits("signed_bits(").map(Self::SignedBits))
            .or_else(|| {
                let bytes = bits("sevens(").filter(|bytes| (2..=MOST_SEVENS).contains(bytes));
                bytes.map(|bytes| Self::Sevens(bytes as usize))
            })
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bits(bits) => write!(f, "bits({bits})"),
            Self::SignedBits(bits) => write!(f, "signed_bits({bits})"),
            Self::Sevens(bytes) => write!(f, "sevens({bytes})"),
            kind => {
                let name = Self::NAMES.iter().find(|(_, other)| other == kind);
                f.write_str(name.map_or("", |(name, _)| name))
            }
        }
    }
}

impl<'de> Deserialize<'de> for Type {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).ok_or_else(|| {
            let names: Vec<_> = Self::NAMES.iter().map(|(name, _)| *name).collect();
            serde::de::Error::custom(format!(
                "\"{text}\" is no type; use one of: {}, bits(1) to bits(32), signed_bits(1) to signed_bits(32), sevens(2) to sevens({MOST_SEVENS})",
                names.join(", ")
            ))
        })
    }
}

impl JsonSchema for Type {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Type".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({"type": "string", "pattern": r"^([ui](8|16|24|32|64)|f32|f64|(signed_)?bits\([0-9]+\)|sevens\([2-8]\))$",
            "description": "u8, i8, u16, i16, u24, i24, u32, i32, u64, i64, f32, f64, bits(n), signed_bits(n), or sevens(n): seven bits in each of n bytes"})
    }
}
