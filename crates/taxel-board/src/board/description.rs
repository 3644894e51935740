//! The board file as it is written.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};
use taxel_ground::quantity::{self, FrameRate, PositiveTime};

use super::field::{Field, Type};
use super::link::{self, Link};
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
    /// The messages that make a frame, in place of `packet.fields`; in other framings than
    /// `messages` packets of several kinds, which marks or their length tell apart.
    #[serde(default, rename = "message")]
    pub messages: Vec<Message>,
    /// A decoder of this program, in place of `packet`, for packets that describe themselves.
    #[serde(default)]
    pub decoder: Option<BuiltIn>,
    /// Names of the values that are the channels of the sensor, in the order of its channels;
    /// default all values in their order.
    #[serde(default)]
    pub wiring: Vec<String>,
    /// Rows and columns in which the channels are shown, row by row; default those of names such as `r{0..11}c{0..31}`,
    /// otherwise one row.
    #[serde(default)]
    pub layout: Option<GridOfChannels>,
    /// What the readings do under pressure, where no sensor file says it; default they rise.
    #[serde(default)]
    pub pressed: Pressed,
}

/// What readings do under pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pressed {
    /// They grow.
    #[default]
    Rises,
    /// They fall.
    Falls,
}

/// Rows and columns of the channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridOfChannels {
    /// Rows; times the columns as many as there are channels.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
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
    /// `{value c1..c4 pF}`, `{sequence}`, `{time ms}`, `{address}`, `{skip}`. One text, or a list of several
    /// kinds of lines. Default: the fields of `packet` in their order.
    #[serde(deserialize_with = "one_or_several::texts")]
    #[schemars(with = "one_or_several::Texts")]
    pub template: Vec<String>,
    /// When the lines of several templates make a frame; default with each line.
    pub frame: FrameEnd,
    /// Lines of a frame that follow each other, one a row, with a blank line behind the last.
    pub rows: Option<usize>,
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
            super::LONGEST_HELLO
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

/// Several messages that make a frame.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Messages {
    /// What carries them.
    pub carrier: Carrier,
    /// When a frame is complete; default with one of each message.
    #[serde(default)]
    pub frame: MessageFrame,
    /// Longest message on the wire in bytes; default 4096 for `can`, 65536 for `json`.
    #[serde(default)]
    pub longest: Option<usize>,
}

/// What carries messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Carrier {
    /// CAN messages as text, one in a line: SLCAN such as `t71380081f679d0753c00`, or what
    /// `candump` prints, with `-L`, `-a`, `-x` or `-t` too. Those of CAN FD have up to 64 bytes.
    Can,
    /// JSON objects, with a line feed between them or with nothing.
    Json,
}

/// When a frame of several messages is complete.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MessageFrame {
    /// Id of the message that ends a frame; the frame is delivered if all others have come.
    pub ends_with: Option<Id>,
    /// Ids of the messages that a frame must have; of the others the last values are kept.
    /// Default: all.
    pub all_of: Vec<Id>,
    /// Longest time from the first to the last message of a frame.
    #[serde(deserialize_with = "time")]
    #[schemars(with = "Option<quantity::Checked<PositiveTime>>")]
    pub within: Option<f64>,
}

/// A message of a frame; of an `id_range` or a list of ids, one message of each id.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Message {
    /// Its id, or several: a number, or text such as `0x713`; in JSON any text. The values of
    /// several have the number of the message behind their names.
    #[serde(default, deserialize_with = "ids")]
    #[schemars(with = "Option<Ids>")]
    pub id: Vec<Id>,
    /// First and last id of several, in place of `id`.
    #[serde(default)]
    pub id_range: Option<[Id; 2]>,
    /// Number of the first of several messages in the names of its values; default 0.
    #[serde(default)]
    pub first: Option<usize>,
    /// Whether a CAN id has 29 bits; default if it needs them.
    #[serde(default)]
    pub extended: Option<bool>,
    /// Where the id stands in a JSON message; without ids, a key that the message must have.
    #[serde(default)]
    pub key: Option<String>,
    /// Bytes of a CAN message; default at least those of its fields.
    #[serde(default)]
    pub length: Option<usize>,
    /// Order of the bytes of a number; default that of `packet`.
    #[serde(default)]
    pub order: Option<Order>,
    /// Its fields, as those of `packet`.
    pub fields: Vec<Field>,
    /// The frames of one JSON message, where it holds a list of several.
    #[serde(default)]
    pub samples: Option<Samples>,
    /// A check of the bytes of a CAN message.
    #[serde(default)]
    pub check: Option<Check>,
}

/// Id of a message.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(from = "NumberOrText")]
#[schemars(with = "NumberOrText")]
pub enum Id {
    /// A number; text such as `0x713` is one.
    Number(u64),
    /// Text.
    Text(String),
}

#[derive(Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "an id is needed here: a whole number of 0 or more such as 0x713, or text"
)]
enum NumberOrText {
    Number(u64),
    Text(String),
}

/// One id or several.
#[derive(Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "an id is needed here: a whole number of 0 or more such as 0x713, or text; or a list of ids"
)]
enum Ids {
    One(Id),
    Several(Vec<Id>),
}

impl From<NumberOrText> for Id {
    fn from(given: NumberOrText) -> Self {
        match given {
            NumberOrText::Number(number) => Self::Number(number),
            NumberOrText::Text(text) => {
                let digits = text.strip_prefix("0x");
                match digits.and_then(|digits| u64::from_str_radix(digits, 16).ok()) {
                    Some(number) => Self::Number(number),
                    None => Self::Text(text),
                }
            }
        }
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number:#x}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}

fn ids<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Id>, D::Error> {
    Ok(match Ids::deserialize(deserializer)? {
        Ids::One(id) => vec![id],
        Ids::Several(ids) => ids,
    })
}

fn time<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    quantity::one::<PositiveTime, D>(deserializer).map(Some)
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
    /// The frames of one packet, where it holds several: the fields from the first value to the
    /// last come again for each.
    pub samples: Option<Samples>,
}

/// Several frames in one packet or message.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Samples {
    /// How many; of a JSON message needed only where its sequence counts messages.
    pub count: Option<usize>,
    /// Where the list of them stands in a JSON message; the keys of the fields begin in each of
    /// its entries.
    pub key: Option<String>,
    /// Time from one to the next; default by the rate.
    #[serde(deserialize_with = "time")]
    #[schemars(with = "Option<quantity::Checked<PositiveTime>>")]
    pub every: Option<f64>,
    /// Which of them the time of the packet is that of; default the last.
    pub stamp: Stamped,
}

/// Which of several frames has the time of their packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stamped {
    /// The first.
    First,
    /// The last.
    #[default]
    Last,
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
