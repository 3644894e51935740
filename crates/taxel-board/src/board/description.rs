//! The board file as it is written.

use schemars::JsonSchema;
use serde::Deserialize;
use taxel::quantity::{self, FrameRate};

use super::field::{Field, Type};
use super::link::{self, Link};
use super::messages::{Message, Messages};
use super::one_or_several;
use super::order::Order;
use crate::check::CheckKind;
use crate::pattern::BytePattern;

/// The board file: what the bytes of one board mean.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoardFile {
    /// Version of this format: 1.
    #[schemars(extend("const" = 1))]
    pub schema: u32,
    /// Name of the board.
    pub name: String,
    /// Nominal rate of frames; the measured one is shown beside it.
    #[serde(default, deserialize_with = "link::rate")]
    #[schemars(with = "Option<quantity::Checked<FrameRate>>")]
    pub rate: Option<f64>,
    /// How it is connected.
    #[serde(default)]
    pub link: Link,
    /// How the bytes are cut into packets.
    pub framing: Framing,
    /// What a packet holds.
    #[serde(default)]
    pub packet: Packet,
    /// The messages that make a frame, for the framing `messages`, in place of `packet.fields`.
    #[serde(default, rename = "message")]
    pub messages: Vec<Message>,
    /// A decoder of this program, in place of `packet`, for packets that describe themselves.
    #[serde(default)]
    pub decoder: Option<BuiltIn>,
    /// Names of the values that are the channels of the sensor, in the order of its channels;
    /// default all values in their order.
    #[serde(default)]
    pub wiring: Vec<String>,
}

/// How the bytes are cut into packets; the header in the file names the kind.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Framing {
    /// Lines of text.
    Lines(Lines),
    /// Packets of one length.
    Fixed(Fixed),
    /// Packets between a head and a tail.
    Marked(Marked),
    /// Packets that say how long they are.
    Length(Length),
    /// Packets without zeros, ended by a zero (consistent overhead byte stuffing).
    Cobs(Cobs),
    /// Packets between the bytes 0xc0 (RFC 1055).
    Slip(Stuffed),
    /// Several messages that make a frame: CAN messages as text, JSON objects.
    Messages(Messages),
}

/// Lines of text.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Lines {
    /// End of a line; default a line feed. A carriage return before it is dropped.
    pub end: Option<BytePattern>,
    /// Characters between numbers; default blank, tab, comma and semicolon.
    pub delimiters: Option<String>,
    /// What nothing between two delimiters is; default that delimiters in a run count as one.
    pub empty: Option<Empty>,
    /// The line: words that must be there, and in braces what stands between them: `{value x}`,
    /// `{value c1..c4 pF}`, `{sequence}`, `{time ms}`, `{skip}`. One text, or a list of several
    /// kinds of lines. Default: the fields of `packet` in their order.
    #[serde(deserialize_with = "one_or_several::texts")]
    #[schemars(with = "one_or_several::Texts")]
    pub template: Vec<String>,
    /// When the lines of several templates make a frame; default with each line.
    pub frame: FrameEnd,
    /// Decimal sign; default a point.
    pub decimal: Decimal,
    /// Longest line in bytes; default 65536.
    pub longest: Option<usize>,
}

/// What nothing between two delimiters is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Empty {
    /// A missing value.
    Missing,
}

/// When lines of several templates make a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrameEnd {
    /// Each line with a value is a frame.
    #[default]
    Each,
    /// With the line of the last template that has a value.
    Last,
}

/// Decimal sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
pub enum Decimal {
    /// A point.
    #[default]
    #[serde(rename = ".")]
    Point,
    /// A comma.
    #[serde(rename = ",")]
    Comma,
}

/// Packets of one length.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fixed {
    /// Bytes of a packet, with head, tail and check.
    pub length: usize,
    /// Bytes at its beginning.
    #[serde(default)]
    pub head: Option<BytePattern>,
    /// Bytes at its end.
    #[serde(default)]
    pub tail: Option<BytePattern>,
}

/// Packets between a head and a tail; a tail inside the packet, where the check does not hold,
/// is passed over.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Marked {
    /// Bytes at its beginning.
    pub head: BytePattern,
    /// Bytes at its end.
    pub tail: BytePattern,
    /// Longest packet in bytes; default 4096.
    #[serde(default)]
    pub longest: Option<usize>,
}

/// Packets that say how long they are.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Length {
    /// Bytes at its beginning.
    pub head: BytePattern,
    /// Place of the length in the packet, bytes from its beginning.
    pub at: usize,
    /// Type of the length: a whole number without sign.
    #[serde(rename = "type")]
    pub kind: Type,
    /// Order of its bytes; default that of `packet`.
    #[serde(default)]
    pub order: Option<Order>,
    /// What it counts.
    pub counts: Counted,
    /// Longest packet in bytes; default 4096.
    #[serde(default)]
    pub longest: Option<usize>,
}

/// What the length of a packet counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Counted {
    /// The bytes between the length and the check.
    Payload,
    /// All bytes after the length.
    Rest,
    /// The whole packet.
    All,
}

/// Packets without zeros, ended by a zero.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Cobs {
    /// Longest packet on the wire in bytes; default 4096, with `hello` 65536.
    pub longest: Option<usize>,
    /// Whether the packets are those of taxel-wire-1, where the board says itself what its
    /// frames hold: its hello counts, in place of the fields of the file. Default: no.
    pub hello: bool,
}

impl Cobs {
    /// Longest packet on the wire, bytes.
    pub(crate) fn longest(&self) -> usize {
        let usual = if self.hello {
            crate::hello::LONGEST
        } else {
            super::LONGEST_PACKET
        };
        self.longest.unwrap_or(usual)
    }
}

/// Packets in stuffed bytes.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stuffed {
    /// Longest packet on the wire in bytes; default 4096.
    pub longest: Option<usize>,
}

/// What a packet holds.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Packet {
    /// Order of the bytes of a number; default little.
    pub order: Option<Order>,
    /// Its fields, in order from its first byte; a head or tail that no field names is passed
    /// over. For lines, the fields of the line, or what the values of its template are.
    pub fields: Vec<Field>,
    /// A check, behind the last field unless it says where.
    pub check: Option<Check>,
    /// Largest step from frame to frame that is believed at once, in the unit of each value;
    /// a larger one waits for the next frame. Default: learned in the first 10 s, on a wire
    /// whose damage cannot be seen.
    #[serde(deserialize_with = "one_or_several::step")]
    #[schemars(with = "Option<f64>")]
    pub step_limit: Option<f64>,
}

/// A check of a packet.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// Its kind.
    pub kind: CheckKind,
    /// First byte and the one behind the last that it covers; default all before it.
    #[serde(default)]
    pub over: Option<[usize; 2]>,
    /// Place of its first byte; default behind the last field.
    #[serde(default)]
    pub at: Option<usize>,
    /// Order of its bytes; default that of the packet.
    #[serde(default)]
    pub order: Option<Order>,
}

/// A decoder of this program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BuiltIn {
    /// Contactile PapillArray: blocks with tables of their own places.
    Papillarray,
}
