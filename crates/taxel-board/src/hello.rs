//! The hello of taxel-wire-1: a board that says itself what its frames hold.
//!
//! A hello becomes a board file, so that the same rules, messages and recordings hold for it
//! as for a written one. It can name neither a port nor a path nor a command.

use std::fmt::Write as _;

use serde::Deserialize;
use serde_json::{Map, Value};
use taxel_ground::shown;

use crate::board::layout::{Conversion, PlacedField, Role};
use crate::board::{Board, Format, Framing, LONGEST_HELLO, Order};
use crate::check::CheckKind;
use crate::names;
use crate::wire::{self, HEADER, HELLO, from_cobs, to_cobs};

/// What a board of taxel-wire-1 is asked for its hello.
pub const HELLO_QUESTION: &[u8] = b"?";

/// Finds the first hello in a stream of bytes; holds no more than one packet of the longest
/// length.
#[derive(Debug, Clone, Default)]
pub struct HelloFinder {
    packet: Vec<u8>,
    /// True until the end of a packet that is too long.
    too_long: bool,
}

/// What a hello says; other keys are passed over.
#[derive(Deserialize)]
struct Hello {
    name: String,
    #[serde(default)]
    firmware: String,
    #[serde(default)]
    rate: Option<Value>,
    fields: Vec<Map<String, Value>>,
}

impl HelloFinder {
    /// Takes bytes: the JSON of the first hello that ends in them.
    pub fn push(&mut self, bytes: &[u8]) -> Option<String> {
        for byte in bytes {
            if *byte != 0 {
                self.too_long |= self.packet.len() == LONGEST_HELLO;
                if !self.too_long {
                    self.packet.push(*byte);
                }
                continue;
            }
            let mut packet = Vec::new();
            let whole = !std::mem::take(&mut self.too_long)
                && from_cobs(&self.packet, &mut packet).is_some();
            self.packet.clear();
            let hello = wire::content(&packet, HELLO)
                .filter(|_| whole)
                .map(<[u8]>::to_vec);
            if let Some(hello) = hello.and_then(|hello| String::from_utf8(hello).ok()) {
                return Some(hello);
            }
        }
        None
    }
}

/// The board file that a hello stands for.
///
/// ```
/// use taxel_board::{Board, board_file_of_hello};
///
/// let hello = r#"{"name":"glove","firmware":"1.2","rate":"100 Hz",
///     "fields":[{"is":"value","name":"f{1..2}.{x,z}","type":"i16","scale":0.01,"unit":"N"}]}"#;
/// let text = board_file_of_hello(hello).expect("a right hello");
/// let board = Board::parse("hello", &text).expect("a right board file");
/// assert_eq!(board.names().collect::<Vec<_>>(), ["f1.x", "f1.z", "f2.x", "f2.z"]);
/// ```
///
/// # Errors
/// A message for people where it is no such JSON.
pub fn board_file_of_hello(hello: &str) -> Result<String, String> {
    let hello: Hello = serde_json::from_str(hello).map_err(|error| {
        format!("the hello of the board is not what taxel-wire-1 says: {error}; it needs name and fields")
    })?;
    let name = match hello.firmware.as_str() {
        "" => hello.name,
        firmware => format!("{}, firmware {firmware}", hello.name),
    };
    let name = name.replace(char::is_control, " ");
    let mut file = format!(
        "# From the hello of the board.\nschema = 1\nname = {}\n",
        shown::toml(&name)
    );
    match &hello.rate {
        None | Some(Value::Null) => {}
        // A number without a unit is one of Hz.
        Some(Value::Number(hertz)) => push(&mut file, &format!("rate = \"{hertz} Hz\"\n")),
        Some(rate) => push(&mut file, &format!("rate = {}\n", toml(rate)?)),
    }
    let fields: Vec<String> = hello.fields.iter().map(table).collect::<Result<_, _>>()?;
    push(
        &mut file,
        "\n[framing.cobs]\nhello = true\n\n[packet]\norder = \"little\"\nfields = [\n  \
         { is = \"mark\", equals = \"01\" },\n  { is = \"mark\", equals = \"00\" },\n  \
         { is = \"sequence\", type = \"u32\" },\n  \
         { is = \"time\", type = \"u64\", unit = \"us\" },\n",
    );
    for field in fields {
        push(&mut file, &format!("  {field},\n"));
    }
    push(&mut file, "]\ncheck = { kind = \"CRC-32/ISO-HDLC\" }\n");
    Ok(file)
}

fn push(file: &mut String, text: &str) {
    file.push_str(text);
}

/// An inline table.
fn table(keys: &Map<String, Value>) -> Result<String, String> {
    let mut pairs = Vec::new();
    for (key, value) in keys.iter().filter(|(_, value)| !value.is_null()) {
        pairs.push(format!("{} = {}", shown::toml(key), toml(value)?));
    }
    Ok(format!("{{ {} }}", pairs.join(", ")))
}

fn toml(value: &Value) -> Result<String, String> {
    Ok(match value {
        Value::String(text) => shown::toml(text),
        Value::Array(values) => {
            let values: Vec<_> = values.iter().map(toml).collect::<Result<_, String>>()?;
            format!("[{}]", values.join(", "))
        }
        Value::Object(keys) => table(keys)?,
        Value::Null => return Err("the hello of the board has a list with null in it".into()),
        Value::Bool(_) | Value::Number(_) => value.to_string(),
    })
}

/// The JSON of a hello of a board with so many channels in this unit, as 32-bit floating point.
pub fn hello_of_channels(name: &str, rate: Option<f64>, channels: usize, symbol: &str) -> String {
    let mut hello = Map::new();
    hello.insert("name".into(), name.into());
    if let Some(rate) = rate {
        hello.insert("rate".into(), format!("{rate} Hz").into());
    }
    let mut field = Map::new();
    let names = format!("c{{1..{channels}}}");
    for (key, value) in [("is", "value"), ("name", &names), ("type", "f32")] {
        field.insert(key.into(), value.into());
    }
    if symbol != "counts" {
        field.insert("unit".into(), symbol.into());
    }
    hello.insert("fields".into(), Value::Array(vec![Value::Object(field)]));
    Value::Object(hello).to_string()
}

impl Board {
    /// True if the board says itself what its frames hold (taxel-wire-1).
    pub fn says_hello(&self) -> bool {
        matches!(&self.framing, Framing::Cobs(cobs) if cobs.hello)
    }

    /// The packet in which the board says what its frames hold; `None` where it does not.
    pub fn hello(&self) -> Option<Vec<u8>> {
        let json = self.hello_json().filter(|_| self.says_hello())?;
        let mut packet = vec![HELLO];
        packet.resize(HEADER, 0);
        packet.extend_from_slice(json.as_bytes());
        let check = CheckKind::Crc32IsoHdlc.of(&packet);
        packet.extend_from_slice(&check.to_le_bytes());
        let mut wire = Vec::new();
        to_cobs(&packet, &mut wire);
        (wire.len() <= LONGEST_HELLO).then_some(wire)
    }

    fn hello_json(&self) -> Option<String> {
        let mut said: Vec<(String, Vec<&str>)> = Vec::new();
        for (about, name) in self.said()? {
            match (said.last_mut(), name) {
                (Some((last, names)), Some(name)) if *last == about && !names.is_empty() => {
                    names.push(name);
                }
                _ => said.push((about, name.into_iter().collect())),
            }
        }
        let fields: Vec<String> = said
            .into_iter()
            .map(|(about, names)| match names[..] {
                [] => format!("{{{about}}}"),
                _ => format!(
                    "{{{about},\"name\":{}}}",
                    shown::toml(&names::contracted(&names))
                ),
            })
            .collect();
        let rate = self
            .rate
            .map_or(String::new(), |rate| format!("\"rate\":\"{rate} Hz\","));
        let name = shown::toml(&self.name);
        Some(format!(
            "{{\"name\":{name},{rate}\"fields\":[{}]}}",
            fields.join(",")
        ))
    }

    /// What a hello says of each field, and its name where it is a value; `None` where a hello
    /// cannot say what a frame holds.
    fn said(&self) -> Option<Vec<(String, Option<&str>)>> {
        let Format::Packet(layout) = &self.format else {
            return None;
        };
        let mut fields: Vec<&PlacedField> = layout.fields.iter().collect();
        fields.sort_by_key(|field| field.bit);
        let mut said = Vec::new();
        let mut end = 8 * HEADER;
        for field in fields.into_iter().filter(|field| field.bit >= 8 * HEADER) {
            if field.bit > end && !field.kind.is_bits() {
                let bytes = (field.bit - end) / 8;
                said.push((format!("\"is\":\"skip\",\"bytes\":{bytes}"), None));
            }
            end = field.bit + field.kind.bits();
            said.push(match &field.role {
                Role::Value(place, conversion) => {
                    let value = self.values.get(*place)?;
                    let about = about(field, conversion, &value.unit);
                    (about, Some(value.name.as_str()))
                }
                Role::Status(status) => {
                    let good = format!("{:?}", status.good);
                    let kind = field.kind;
                    let about = format!("\"is\":\"status\",\"type\":\"{kind}\",\"good\":{good}");
                    (about, None)
                }
                // A frame of taxel-wire-1 has all others before its values.
                _ => return None,
            });
        }
        Some(said)
    }

    /// What a hello says that is not what frames of this board hold: nothing where they agree,
    /// whatever name, firmware and rate it says. An error for a text that is no hello.
    pub(crate) fn differs_from(&self, hello: &str) -> Result<Option<String>, serde_json::Error> {
        serde_json::from_str::<Hello>(hello)?;
        Ok(self.difference(hello))
    }

    fn difference(&self, hello: &str) -> Option<String> {
        let board = match board_file_of_hello(hello) {
            Ok(text) => Board::parse("hello of the board", &text).map_err(|error| error.message),
            Err(message) => Err(message),
        };
        let board = match board {
            Ok(board) => board,
            Err(message) => return Some(format!("its new hello cannot be read: {message}")),
        };
        let (before, now) = (self.said()?, board.said()?);
        if before.len() != now.len() {
            let [before, now] = [self, &board].map(|board| board.values.len());
            return Some(format!("its frames hold {now} values, before {before}"));
        }
        let shown = |(about, name): &(String, Option<&str>)| match name {
            Some(name) => format!("{name} {{{}}}", about.replace('"', "")),
            None => format!("{{{}}}", about.replace('"', "")),
        };
        let mut pairs = before.iter().zip(&now);
        let (before, now) = pairs.find(|(before, now)| before != now)?;
        Some(format!(
            "its frames hold {}, before {}",
            shown(now),
            shown(before)
        ))
    }
}

/// What a hello says of a value, but for its name.
fn about(
    field: &PlacedField,
    conversion: &Conversion,
    unit: &taxel_recording::SignalUnit,
) -> String {
    let si = unit.si_per_unit;
    let mut about = format!("\"is\":\"value\",\"type\":\"{}\"", field.kind);
    let mut add = |key: &str, value: String| {
        let written = write!(about, ",\"{key}\":{value}");
        debug_assert!(written.is_ok(), "memory takes all");
    };
    if field.order == Order::Big && (field.kind.is_bits() || field.kind.bits() > 8) {
        add("order", "\"big\"".into());
    }
    if unit.symbol != "counts" {
        add("unit", shown::toml(&unit.symbol));
    }
    let in_unit = |value: f64| format!("{:?}", value / si);
    if (conversion.scale / si - 1.0).abs() > 1e-12 {
        add("scale", in_unit(conversion.scale));
    }
    if conversion.offset != 0.0 {
        add("offset", in_unit(conversion.offset));
    }
    if let Some(mask) = conversion.mask {
        add("mask", mask.to_string());
    }
    if conversion.shift > 0 {
        add("shift", conversion.shift.to_string());
    }
    if let Some(from) = conversion.invert_from {
        add("invert_from", format!("{from:?}"));
    }
    match &conversion.missing[..] {
        [] => {}
        several => {
            let written = |[low, high]: &[f64; 2]| {
                if low == high {
                    format!("{low:?}")
                } else {
                    format!("[{low:?},{high:?}]")
                }
            };
            let written: Vec<String> = several.iter().map(written).collect();
            match &written[..] {
                [one] if !one.starts_with('[') => add("missing", one.clone()),
                _ => add("missing", format!("[{}]", written.join(", "))),
            }
        }
    }
    if let Some([low, high]) = conversion.range {
        add("range", format!("[{},{}]", in_unit(low), in_unit(high)));
    }
    about
}
