//! The board file: what the bytes of one board mean.

mod class;
mod description;
mod facts;
mod field;
pub(crate) mod layout;
pub(crate) mod line;
mod link;
pub(crate) mod messages;
mod one_or_several;
mod order;
mod placement;
mod resolve;
mod rules;
mod template;
pub(crate) mod text_number;
mod unit;
mod wording;

use taxel_ground::InputError;
use taxel_ground::toml_input;
use taxel_recording::{Quantity, SignalUnit, Stream};

use crate::names;

pub use class::{Class, Detection};
pub use description::{
    BoardFile, BuiltIn, Carrier, Check, Cobs, Counted, Decimal, Empty, Fixed, FrameEnd, Framing,
    Id, Length, Lines, Marked, Message, MessageFrame, Messages, Packet, Pressed, Samples, Stamped,
    Stuffed,
};

pub use field::{CountedBySequence, Digits, Field, Is, Type};
pub use link::{Link, Network, Poll, Serial, Usb, UsbName};
pub use one_or_several::{Amount, Missing, Missings, Texts, Whole, Wholes};
pub use order::Order;

pub(crate) use resolve::counted;
pub(crate) use rules::shortened;

use layout::{AddressRange, Conversion, Counting, FrameRule, PacketLayout};
use line::LineFormat;
use messages::MessageFormat;

/// The version of the board file that this program reads.
pub const SCHEMA_VERSION: u32 = 1;

/// Longest packet and line, bytes, where the file does not say it.
pub(crate) const LONGEST_PACKET: usize = 4096;
pub(crate) const LONGEST_LINE: usize = 65536;
/// Longest hello of a board on the wire, bytes.
pub(crate) const LONGEST_HELLO: usize = 65536;
/// Longest packet or line that a file may name, bytes.
pub(crate) const MOST_LONGEST: usize = 1 << 20;

macro_rules! shipped {
    ($($name:literal),+ $(,)?) => {
        /// Shipped board files: name and text.
        const SHIPPED: &[(&str, &str)] =
            &[$(($name, include_str!(concat!("../../boards/", $name, ".toml")))),+];
    };
}

shipped!(
    "anyskin-5x",
    "fdc1004-facebook",
    "openbci-cyton",
    "optoforce-16",
    "optoforce-22",
    "papillarray-2",
    "taxel-wire-1",
    "taxel-wire-1-256",
    "touch-board-mpr121",
    "xela-server",
    "xela-uskin-can",
);

/// A board: how its bytes are cut into packets, and what a packet holds.
///
/// ```
/// use taxel_board::Board;
///
/// let board = Board::shipped("optoforce-16").expect("shipped files are right");
/// assert_eq!(board.names().collect::<Vec<_>>(), ["fx", "fy", "fz"]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    /// Its name.
    pub name: String,
    /// Nominal rate of frames, Hz.
    pub rate: Option<f64>,
    /// How it is connected.
    pub link: Link,
    pub(crate) framing: Framing,
    pub(crate) format: Format,
    /// Values of a frame in the order of the wire.
    pub(crate) values: Vec<ValueOfBoard>,
    /// Places of the values that are channels; empty for all.
    wired: Vec<usize>,
    /// Rows and columns of the channels, where the file states them.
    grid: Option<[usize; 2]>,
    /// Largest step that is believed at once, SI, value by value; `None` where it is learned.
    pub(crate) step_limit: Option<f64>,
    /// The frames of one packet or message, where it holds several.
    pub(crate) samples: Option<SampleTimes>,
    /// What its readings do under pressure.
    pub pressed: Pressed,
}

/// Frames that come in one packet or message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SampleTimes {
    /// How many; 1 where it is not said.
    pub(crate) count: usize,
    /// Time between two, ns.
    pub(crate) every_ns: f64,
    /// Which has the time of the packet.
    pub(crate) stamp: Stamped,
}

/// One value of a board.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueOfBoard {
    /// Its name.
    pub name: String,
    /// Quantity and unit.
    pub unit: SignalUnit,
}

/// What packets hold.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Format {
    Packet(PacketLayout),
    Lines(LineFormat),
    Messages(MessageFormat),
    BuiltIn(BuiltIn),
}

impl Board {
    /// Reads a board file.
    ///
    /// # Errors
    /// The first mistake at its word: of the TOML, of a key, and of rules between keys, such as
    /// two fields over the same bytes.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let description: BoardFile = toml_input::parse(file, text).map_err(|error| {
            let help = error.help.replace("`taxel schema`", "`taxel schema board`");
            InputError { help, ..error }
        })?;
        resolve::board(&description).map_err(|broken| {
            let path: Vec<&str> = broken.path.iter().map(String::as_str).collect();
            let error = toml_input::at_key(file, text, &path, &broken.message, &broken.help);
            match broken.within {
                Some(within) => wording::narrowed(error, within),
                None => error,
            }
        })
    }

    /// Names of the shipped board files.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// Text of a shipped board file.
    pub fn shipped_text(name: &str) -> Option<&'static str> {
        let (_, text) = SHIPPED.iter().find(|(shipped, _)| *shipped == name)?;
        Some(text)
    }

    /// A shipped board.
    pub fn shipped(name: &str) -> Option<Self> {
        Self::shipped_text(name).and_then(|text| Self::parse(name, text).ok())
    }

    /// The JSON schema of the board file; editors complete and check with it.
    pub fn json_schema() -> String {
        taxel_ground::schema::json_schema::<BoardFile>()
    }

    /// The reference of the board file, Markdown: every key with its meaning and values, from
    /// the same types as [`Self::json_schema`].
    pub fn reference() -> String {
        taxel_ground::schema::reference::<BoardFile>(REFERENCE_HEAD)
    }

    /// All values of a frame of the board, in the order of the wire.
    pub fn values(&self) -> &[ValueOfBoard] {
        &self.values
    }

    /// The values that are channels, in the order of the channels.
    pub fn channels(&self) -> impl ExactSizeIterator<Item = &ValueOfBoard> {
        self.wired().into_iter().map(|place| &self.values[place])
    }

    /// Names of the channels in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.channels().map(|value| value.name.as_str())
    }

    /// Places of the channels among the values.
    pub(crate) fn wired(&self) -> Vec<usize> {
        if self.wired.is_empty() {
            (0..self.values.len()).collect()
        } else {
            self.wired.clone()
        }
    }

    /// The same board with channels of these names, in this order.
    ///
    /// # Errors
    /// The first name that the board does not have.
    pub fn wire(mut self, names: &[String]) -> Result<Self, String> {
        self.wired = resolve::places(&self.values, names)?;
        Ok(self)
    }

    /// Rows and columns of the channels: those of the file, those of names such as `r0c0` row by row, or one row.
    pub fn grid(&self) -> [usize; 2] {
        let names: Vec<&str> = self.names().collect();
        let stated = self
            .grid
            .filter(|[rows, columns]| rows * columns == names.len());
        stated
            .or_else(|| names::grid(&names))
            .unwrap_or([1, names.len()])
    }

    /// Meaning of the frames: the channels in SI, in their [grid](Self::grid).
    pub fn stream(&self) -> Stream {
        let [rows, columns] = self.grid();
        let mut units = self.channels().map(|value| &value.unit);
        let first = units.next().cloned();
        let unit = first
            .filter(|first| units.all(|unit| unit.quantity == first.quantity))
            .unwrap_or_else(|| SignalUnit {
                quantity: Quantity::Raw,
                symbol: "raw".into(),
                si_per_unit: 1.0,
            });
        Stream {
            name: self.name.clone(),
            rows,
            columns,
            channels_per_taxel: 1,
            unit,
            pitch: None,
            period: self.rate.map(f64::recip),
            threshold: None,
            present: vec![true; rows * columns],
        }
    }

    /// Step of each channel, SI: 0 for readings without steps, `NaN` where it is not known.
    pub fn steps(&self) -> Vec<f64> {
        let step = |place| match self.conversion(place) {
            Some((Some(kind), _)) if kind.is_float() => 0.0,
            Some((Some(_), conversion)) => conversion.scale.abs(),
            _ => f64::NAN,
        };
        self.wired().into_iter().map(step).collect()
    }

    /// Number of the kind of each channel: those of one have the same unit, type and scale.
    pub fn kinds(&self) -> Vec<usize> {
        let mut kinds = Vec::new();
        let kind = |place: usize| {
            let typed = self.conversion(place);
            let typed = typed.map(|(kind, conversion)| (kind, conversion.scale));
            let this = (self.values[place].unit.clone(), typed);
            let known = kinds.iter().position(|other| *other == this);
            known.unwrap_or_else(|| {
                kinds.push(this);
                kinds.len() - 1
            })
        };
        self.wired().into_iter().map(kind).collect()
    }

    /// True if the wire carries text.
    pub fn carries_text(&self) -> bool {
        matches!(self.framing, Framing::Lines(_) | Framing::Messages(_))
    }

    /// Bytes of one frame on the wire, where they are always as many.
    pub fn bytes_per_frame(&self) -> Option<usize> {
        match &self.format {
            Format::Packet(layout) => {
                let frames = self.samples.map_or(1, |samples| samples.count);
                Some(self.bytes_of(layout).div_ceil(frames))
            }
            Format::Messages(messages) => match self.framing {
                Framing::Messages(_) => messages.bytes_per_frame(),
                _ => Some(messages.layouts().map(|layout| self.bytes_of(layout)).sum()),
            },
            Format::Lines(_) | Format::BuiltIn(_) => None,
        }
    }

    /// Bytes of all packets of one kind on the wire.
    fn bytes_of(&self, layout: &PacketLayout) -> usize {
        let packets = layout.address.map_or(1, |address| address.count);
        // Stuffing adds one byte in 254, and the end.
        let stuffed = match self.framing {
            Framing::Cobs(_) => layout.length / 254 + 2,
            Framing::Slip(_) => 2,
            _ => 0,
        };
        packets * (layout.length + stuffed)
    }

    /// The counter of its frames, where it has one.
    pub(crate) fn counter(&self) -> Option<Counter> {
        let mut counter = self.counter_on_wire().map(Counter::of_frames)?;
        // The samples of a packet have its number.
        counter.counting.repeats *= self.samples.map_or(1, |samples| samples.count as u64);
        Some(counter)
    }

    /// Its counter as the wire has it: of frames, or of packets.
    pub(crate) fn counter_on_wire(&self) -> Option<Counter> {
        let of_type = |(counting, kind)| Counter::new(counting, kind);
        match &self.format {
            Format::Packet(layout) => {
                let typed = |(counting, kind)| Counter::new(counting, Some(kind));
                layout.sequence().map(typed)
            }
            Format::Messages(messages) => messages.counter(),
            Format::Lines(lines) => lines.sequence().map(of_type),
            Format::BuiltIn(BuiltIn::Papillarray) => {
                Some(Counter::new(Counting::PLAIN, Some(Type::Unsigned(4))))
            }
        }
    }

    /// Nanoseconds of one step of the board's clock, and the steps before it begins again.
    pub(crate) fn clock(&self) -> Option<DeviceClock> {
        match &self.format {
            Format::Packet(layout) => layout
                .time()
                .map(|(step_ns, kind)| DeviceClock::new(step_ns, Some(kind))),
            Format::Messages(messages) => messages
                .time()
                .map(|(step_ns, kind)| DeviceClock::new(step_ns, kind)),
            Format::Lines(lines) => lines
                .time()
                .map(|(step_ns, kind)| DeviceClock::new(step_ns, kind)),
            Format::BuiltIn(BuiltIn::Papillarray) => Some(DeviceClock {
                step_ns: 1e3,
                modulus: None,
            }),
        }
    }

    /// When the packets or messages of a frame make it whole.
    pub(crate) fn frame_rule(&self) -> FrameRule {
        let packets = match &self.format {
            Format::Messages(messages) => return messages.rule.clone(),
            Format::Packet(layout) => layout.address.map_or(1, |address| address.count),
            Format::Lines(lines) => lines.address.map_or(1, |address| address.count),
            Format::BuiltIn(_) => 1,
        };
        FrameRule {
            in_order: packets > 1,
            ..FrameRule::all(packets, self.values.len())
        }
    }

    /// The packets or messages of a frame in words, place by place.
    pub(crate) fn slot_names(&self) -> Vec<String> {
        let addresses = |address: Option<AddressRange>| match address {
            Some(address) => address.all().map(|address| address.to_string()).collect(),
            None => vec![String::new()],
        };
        match &self.format {
            Format::Packet(layout) => addresses(layout.address),
            Format::Lines(lines) => addresses(lines.address),
            Format::Messages(messages) => messages.slot_names(),
            Format::BuiltIn(_) => addresses(None),
        }
    }

    /// Type, where it has one, and conversion of the value at `place`.
    pub(crate) fn conversion(&self, place: usize) -> Option<(Option<Type>, &Conversion)> {
        match &self.format {
            Format::Packet(layout) => layout.value(place % layout.values.max(1)),
            Format::Messages(messages) => messages.value(place),
            Format::Lines(lines) => lines.value(place),
            Format::BuiltIn(_) => None,
        }
    }
}

/// Counter of the frames of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counter {
    counting: Counting,
    /// Its numbers on the wire; `None` for text, which does not end.
    numbers: Option<u64>,
}

impl Counter {
    /// A counter that counts so, of this type; text has none.
    fn new(counting: Counting, kind: Option<Type>) -> Self {
        let whole = kind.filter(|kind| !kind.is_float());
        Self {
            counting,
            numbers: counting.modulus.or(whole.map(modulus)),
        }
    }

    /// True if it counts packets, of which a frame has several.
    pub(crate) fn counts_packets(&self) -> bool {
        self.counting.packets
    }

    /// The counter of the frames of a counter of packets, which does not end.
    fn of_frames(self) -> Self {
        if self.counting.packets {
            Self::new(Counting::PLAIN, None)
        } else {
            self
        }
    }

    /// Numbers on the wire; `None` for text, which does not end.
    pub(crate) fn numbers(&self) -> Option<u64> {
        self.numbers
    }

    /// Frames before it begins again.
    pub(crate) fn frames(&self) -> Option<u64> {
        let Counting { step, repeats, .. } = self.counting;
        self.numbers.map(|numbers| numbers / step * repeats)
    }

    /// From one number to the next, and frames of the same number.
    pub(crate) fn counts(&self) -> [u64; 2] {
        [self.counting.step, self.counting.repeats]
    }

    /// The number of a frame whose counter reads `raw`, `before` frames behind the first with it.
    pub(crate) fn frame(&self, raw: u64, before: u64) -> u64 {
        let Counting { step, repeats, .. } = self.counting;
        let number = raw / step;
        number
            .wrapping_mul(repeats)
            .wrapping_add(before.min(repeats - 1))
    }

    /// What the counter reads in the frame of this number.
    pub(crate) fn raw(&self, frame: u64) -> u64 {
        let Counting { step, repeats, .. } = self.counting;
        let raw = (frame / repeats).wrapping_mul(step);
        self.numbers.map_or(raw, |numbers| raw % numbers)
    }
}

/// Clock of a board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DeviceClock {
    pub(crate) step_ns: f64,
    pub(crate) modulus: Option<u64>,
}

impl DeviceClock {
    /// A clock of steps of so many nanoseconds, of a number of this type; text has none.
    fn new(step_ns: f64, kind: Option<Type>) -> Self {
        let whole = kind.filter(|kind| !kind.is_float());
        Self {
            step_ns,
            modulus: whole.map(modulus),
        }
    }
}

/// Numbers of a whole type; a counter of 64 bits never comes to its end.
fn modulus(kind: Type) -> u64 {
    match kind.number_bits() {
        bits @ 0..=62 => 1 << bits,
        _ => 1 << 62,
    }
}

const REFERENCE_HEAD: &str = "\
# Board-file reference

Every key of a board file. `taxel schema board-reference` prints this page from the types that read the file, so it is
current. [The guide](board-file.md) explains how to write one.

Each section is a table of the file; its title is the path of the table, and the path of a key is that title, a dot and
the key. `[]` in a path stands for each entry of a list. A required key has no default. Any other key is refused.
";
