//! Several messages that make a frame: CAN messages as text, JSON objects.

use super::description::{Carrier, Framing, Id, Message, MessageFrame, Messages, Packet, Stuffed};
use super::field::{Digits, Field, Is, Type, Within};
use super::layout::{Conversion, Counting, FrameRule, PacketLayout, Status};
use super::rules::{self, Broken, broken};
use super::text_number::TextNumber;
use super::{Counter, Format, LONGEST_LINE, LONGEST_PACKET, ValueOfBoard, placement, unit};
use crate::names::{self, MOST_VALUES};

/// Largest id of a CAN message with 11 bits, and with 29.
pub(crate) const LARGEST_STANDARD_ID: u64 = 0x7ff;
const LARGEST_EXTENDED_ID: u64 = 0x1fff_ffff;
/// Most bytes of a CAN message, and of one that is not of CAN FD.
pub(crate) const MOST_CAN_BYTES: usize = 64;
pub(crate) const MOST_CLASSICAL: usize = 8;

/// How messages are read and written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MessageFormat {
    pub(crate) longest: usize,
    pub(crate) messages: Vec<MessageLayout>,
    pub(crate) rule: FrameRule,
}

/// One kind of message: one of each id, and of each address in its bytes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MessageLayout {
    pub(crate) ids: Vec<Id>,
    pub(crate) extended: bool,
    pub(crate) key: Option<String>,
    pub(crate) length: Option<usize>,
    /// JSON pointer of the list of its samples, where it holds several frames.
    pub(crate) samples: Option<String>,
    pub(crate) body: Body,
    /// Place of its first message in a frame.
    pub(crate) first_slot: usize,
    /// Place of its first value in a frame.
    pub(crate) first_value: usize,
    /// Values of one message.
    pub(crate) values: usize,
    /// Messages of one id.
    pub(crate) addresses: usize,
}

/// What a message holds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Body {
    Bytes(PacketLayout),
    Json(Vec<JsonField>),
}

/// A field of a JSON message.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JsonField {
    /// JSON pointer (RFC 6901).
    pub(crate) pointer: String,
    pub(crate) text: TextNumber,
    pub(crate) role: JsonRole,
}

/// What a field of a JSON message is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum JsonRole {
    /// So many values from this place of the message on.
    Values {
        first: usize,
        count: usize,
        conversion: Conversion,
    },
    Sequence(Counting),
    /// Time; nanoseconds of one unit.
    Time(f64),
    Status(Status),
}

impl MessageLayout {
    /// Messages of it in a frame.
    pub(crate) fn slots(&self) -> usize {
        self.ids.len().max(1) * self.addresses
    }

    /// Values of it in a frame.
    pub(crate) fn all_values(&self) -> usize {
        self.slots() * self.values
    }
}

impl MessageFormat {
    /// Type, where it has one, and conversion of the value at `place` of a frame.
    pub(crate) fn value(&self, place: usize) -> Option<(Option<Type>, &Conversion)> {
        let message = self.messages.iter().find(|message| {
            (message.first_value..message.first_value + message.all_values()).contains(&place)
        })?;
        let place = (place - message.first_value) % message.values.max(1);
        match &message.body {
            Body::Bytes(layout) => layout.value(place),
            Body::Json(fields) => fields.iter().find_map(|field| match &field.role {
                JsonRole::Values {
                    first,
                    count,
                    conversion,
                } if (*first..first + count).contains(&place) => {
                    Some((field.text.kind, conversion))
                }
                _ => None,
            }),
        }
    }

    /// Those of bytes.
    pub(crate) fn layouts(&self) -> impl Iterator<Item = &PacketLayout> {
        self.messages
            .iter()
            .filter_map(|message| match &message.body {
                Body::Bytes(layout) => Some(layout),
                Body::Json(_) => None,
            })
    }

    /// Its messages in words, place by place.
    pub(crate) fn slot_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for (number, message) in self.messages.iter().enumerate() {
            let addresses = match &message.body {
                Body::Bytes(layout) => layout.address,
                Body::Json(_) => None,
            };
            for slot in 0..message.slots() {
                let id = message.ids.get(slot / message.addresses);
                let key = || message.key.clone();
                let id = id.map(ToString::to_string).or_else(key);
                let address = addresses.map(|range| range.at(slot % message.addresses).to_string());
                let of_message = || format!("[[message]] {}", number + 1);
                names.push(match (id, address) {
                    (Some(id), Some(address)) => format!("{id} {address}"),
                    (Some(one), None) | (None, Some(one)) => one,
                    (None, None) => of_message(),
                });
            }
        }
        names
    }

    /// Numbers of the counter before it begins again.
    pub(crate) fn counter(&self) -> Option<Counter> {
        self.messages
            .iter()
            .find_map(|message| match &message.body {
                Body::Bytes(layout) => layout
                    .sequence()
                    .map(|(counting, kind)| Counter::new(counting, Some(kind))),
                Body::Json(fields) => fields.iter().find_map(|field| match field.role {
                    JsonRole::Sequence(counting) => Some(Counter::new(counting, field.text.kind)),
                    _ => None,
                }),
            })
    }

    /// Nanoseconds of one step of the clock, and its type.
    pub(crate) fn time(&self) -> Option<(f64, Option<Type>)> {
        self.messages
            .iter()
            .find_map(|message| match &message.body {
                Body::Bytes(layout) => layout.time().map(|(step, kind)| (step, Some(kind))),
                Body::Json(fields) => fields.iter().find_map(|field| match field.role {
                    JsonRole::Time(step) => Some((step, field.text.kind)),
                    _ => None,
                }),
            })
    }

    /// Bytes of a frame on the wire, where they are always as many.
    pub(crate) fn bytes_per_frame(&self) -> Option<usize> {
        let of_message = |message: &MessageLayout| match &message.body {
            Body::Json(_) => None,
            Body::Bytes(layout) => {
                let id = if message.extended { 8 } else { 3 };
                // The kind, the id, the number of bytes, the bytes, the end.
                let bytes = message.length.unwrap_or(layout.length);
                Some(message.slots() * (3 + id + 2 * bytes))
            }
        };
        self.messages.iter().map(of_message).sum()
    }
}

/// Packets of several kinds in one framing, which marks or their length tell apart.
pub(super) fn of_packets(
    framing: &Framing,
    described: &[Message],
    packet: &Packet,
) -> Result<(MessageFormat, Vec<ValueOfBoard>), Broken> {
    refuse_fields(packet)?;
    let mut messages: Vec<MessageLayout> = Vec::new();
    let mut values = Vec::new();
    for (place, message) in described.iter().enumerate() {
        for (given, key) in [
            (!message.id.is_empty(), "id"),
            (message.id_range.is_some(), "id_range"),
            (message.first.is_some(), "first"),
            (message.extended.is_some(), "extended"),
            (message.key.is_some(), "key"),
            (message.length.is_some(), "length"),
            (message.samples.is_some(), "samples"),
        ] {
            if given {
                let text = "packets are told apart by marks in their fields, or by their length";
                return Err(broken(&[&"message", &place, &key], text, "leave it out"));
            }
        }
        let (layout, own) = placement::layout(framing, &packet_of(message, packet))
            .map_err(|broken| broken.in_message(place))?;
        let alike = |other: &&MessageLayout| match &other.body {
            Body::Bytes(other) => {
                other.length == layout.length && !(other.has_marks() && layout.has_marks())
            }
            Body::Json(_) => false,
        };
        if messages.iter().find(alike).is_some() {
            let text = format!(
                "nothing tells it from another packet of {} bytes",
                layout.length
            );
            let help = "give both a mark, such as { is = \"mark\", equals = \"02\" }";
            return Err(broken(&[&"message", &place, &"fields"], text, help));
        }
        let addresses = layout.address.map_or(1, |address| address.count);
        let layout = MessageLayout {
            ids: Vec::new(),
            extended: false,
            key: None,
            length: None,
            samples: None,
            first_slot: messages.iter().map(MessageLayout::slots).sum(),
            first_value: values.len(),
            values: own.len() / addresses,
            addresses,
            body: Body::Bytes(layout),
        };
        add_values(&mut values, &own, message, &layout, place)?;
        messages.push(layout);
    }
    let slots = messages.iter().map(MessageLayout::slots).sum();
    let format = MessageFormat {
        longest: LONGEST_PACKET,
        rule: FrameRule::all(slots, values.len()),
        messages,
    };
    Ok((format, values))
}

/// A message as a packet.
fn packet_of(message: &Message, packet: &Packet) -> Packet {
    Packet {
        order: message.order.or(packet.order),
        fields: message.fields.clone(),
        check: message.check.clone(),
        step_limit: None,
        samples: None,
    }
}

fn refuse_fields(packet: &Packet) -> Result<(), Broken> {
    if packet.fields.is_empty() && packet.check.is_none() {
        return Ok(());
    }
    let message = "the fields of messages stand in the messages";
    let help = "write [[message]] with its fields";
    Err(broken(&[&"packet"], message, help))
}

pub(super) fn resolve(
    framing: &Messages,
    described: &[Message],
    packet: &Packet,
) -> Result<(Format, Vec<ValueOfBoard>), Broken> {
    refuse_fields(packet)?;
    if described.is_empty() {
        let help = "add [[message]] with id, or key for JSON, and fields";
        return Err(broken(
            &[&"framing", &"messages"],
            "no message is described",
            help,
        ));
    }
    let usual = match framing.carrier {
        Carrier::Can => LONGEST_PACKET,
        Carrier::Json => LONGEST_LINE,
    };
    let longest = rules::longest(framing.longest, usual, "messages")?;
    let mut messages: Vec<MessageLayout> = Vec::new();
    let mut values = Vec::new();
    let mut slots = 0;
    for (place, message) in described.iter().enumerate() {
        let numbered = numbered_ids(message, framing.carrier, place)?;
        let (body, own) = match framing.carrier {
            Carrier::Can => of_can(message, packet, place)?,
            Carrier::Json => of_json(message, place)?,
        };
        let addresses = match &body {
            Body::Bytes(layout) => layout.address.map_or(1, |address| address.count),
            Body::Json(_) => 1,
        };
        let extended = message.extended.unwrap_or_else(|| {
            let needs = |id: &Id| matches!(id, Id::Number(id) if *id > LARGEST_STANDARD_ID);
            numbered.iter().any(needs)
        });
        if message.first.is_some() && numbered.len() < 2 {
            let text = "one message has no number behind the names of its values";
            let help = "leave it out, or give several ids";
            return Err(broken(&[&"message", &place, &"first"], text, help));
        }
        let layout = MessageLayout {
            ids: numbered,
            extended,
            key: message.key.as_deref().map(pointer),
            length: message.length,
            samples: samples_key(message).map(pointer),
            first_slot: slots,
            first_value: values.len(),
            values: own.len() / addresses,
            addresses,
            body,
        };
        if let Some(twice) = messages.iter().find_map(|other| same_id(other, &layout)) {
            let message = format!("{twice} is the id of another message too");
            let help = "give each message its own id, or marks that tell them apart";
            return Err(broken(&[&"message", &place, &"id"], message, help));
        }
        slots += layout.slots();
        add_values(&mut values, &own, message, &layout, place)?;
        messages.push(layout);
    }
    let rule = frame_rule(&framing.frame, &messages, slots, values.len())?;
    let format = MessageFormat {
        longest,
        messages,
        rule,
    };
    Ok((Format::Messages(format), values))
}

/// The ids of a message, checked.
fn numbered_ids(message: &Message, carrier: Carrier, place: usize) -> Result<Vec<Id>, Broken> {
    let at = |key: &'static str, text: String, help: &str| {
        broken(&[&"message", &place, &key], text, help)
    };
    let ids = match (&message.id[..], &message.id_range) {
        (_, None) => message.id.clone(),
        ([], Some([Id::Number(from), Id::Number(to)])) if from <= to => {
            if to - from >= MOST_VALUES as u64 {
                let text = format!("more than {MOST_VALUES} ids");
                return Err(at("id_range", text, ""));
            }
            (*from..=*to).map(Id::Number).collect()
        }
        ([], Some(_)) => {
            let text = "a range of ids is two numbers that rise".to_owned();
            return Err(at("id_range", text, "such as [0x710, 0x71f]"));
        }
        (_, Some(_)) => {
            let text = "the ids are given twice".to_owned();
            return Err(at("id_range", text, "leave out id or id_range"));
        }
    };
    let key = if message.id_range.is_some() {
        "id_range"
    } else {
        "id"
    };
    if let Some(twice) = (1..ids.len()).find(|n| ids[..*n].contains(&ids[*n])) {
        return Err(at(key, format!("{} is named twice", ids[twice]), ""));
    }
    match carrier {
        Carrier::Can => {
            if ids.is_empty() {
                let text = "a CAN message is told by its id".to_owned();
                return Err(at("fields", text, "add id = 0x713, or id_range"));
            }
            let largest = match message.extended {
                Some(false) => LARGEST_STANDARD_ID,
                _ => LARGEST_EXTENDED_ID,
            };
            let fits = |id: &&Id| !matches!(id, Id::Number(id) if *id <= largest);
            if let Some(wrong) = ids.iter().find(fits) {
                let text = format!("{wrong} is no id: a number from 0 to {largest:#x}");
                return Err(at(key, text, ""));
            }
            if message.key.is_some() {
                let text = "CAN messages have no keys".to_owned();
                return Err(at("key", text, "leave it out"));
            }
        }
        Carrier::Json => {
            if !ids.is_empty() && message.key.is_none() {
                let text = "where does the id stand in the object?".to_owned();
                return Err(at(key, text, "add key, such as key = \"sensor\""));
            }
            for (given, key) in [
                (message.extended.is_some(), "extended"),
                (message.length.is_some(), "length"),
                (message.order.is_some(), "order"),
                (message.check.is_some(), "check"),
            ] {
                if given {
                    let text = "a JSON message has no bytes of its own".to_owned();
                    return Err(at(key, text, "leave it out"));
                }
            }
        }
    }
    Ok(ids)
}

/// An id that both have, where nothing else tells them apart.
fn same_id(one: &MessageLayout, other: &MessageLayout) -> Option<Id> {
    let marked = |message: &MessageLayout| match &message.body {
        Body::Bytes(layout) => layout.has_marks(),
        Body::Json(_) => true,
    };
    if (marked(one) && marked(other)) || one.extended != other.extended {
        return None;
    }
    one.ids.iter().find(|id| other.ids.contains(id)).cloned()
}

fn of_can(
    message: &Message,
    packet: &Packet,
    place: usize,
) -> Result<(Body, Vec<ValueOfBoard>), Broken> {
    let bytes = packet_of(message, packet);
    // Nothing stands around the bytes of a message.
    let nothing = Framing::Slip(Stuffed::default());
    let (layout, values) =
        placement::layout(&nothing, &bytes).map_err(|broken| broken.in_message(place))?;
    let at = |key: &'static str, text: String| broken(&[&"message", &place, &key], text, "");
    if layout.length > MOST_CAN_BYTES {
        let text = format!(
            "the fields have {} bytes; a CAN message has at most {MOST_CAN_BYTES}",
            layout.length
        );
        return Err(at("fields", text));
    }
    if let Some(length) = message.length
        && !(layout.length..=MOST_CAN_BYTES).contains(&length)
    {
        let text = format!(
            "{length} is out of range: must be at least the {} bytes of the fields and at most {MOST_CAN_BYTES}",
            layout.length
        );
        return Err(at("length", text));
    }
    Ok((Body::Bytes(layout), values))
}

fn of_json(message: &Message, place: usize) -> Result<(Body, Vec<ValueOfBoard>), Broken> {
    let mut fields = Vec::new();
    let mut values: Vec<ValueOfBoard> = Vec::new();
    for (number, field) in message.fields.iter().enumerate() {
        let at = |key: &'static str, text: String, help: &str| {
            broken(&[&"message", &place, &"fields", &number, &key], text, help)
        };
        rules::check_keys(field, Within::Json, number)
            .map_err(|broken| broken.in_message(place))?;
        check_json(field).map_err(|(key, text, help)| at(key, text, help))?;
        let Some(key) = &field.key else {
            let text = "where does it stand in the object?".to_owned();
            return Err(at("is", text, "add key, such as key = \"1/data\""));
        };
        let role = match field.is {
            Is::Value => {
                let first = values.len();
                let names = names::expanded(field.name.as_deref().unwrap_or(""))
                    .map_err(|text| at("name", text, "add a name, such as c1..c4"))?;
                let mut conversion = None;
                let count = names.len();
                for name in names {
                    if values.iter().any(|value| value.name == name) {
                        let text = format!("a second value is called \"{name}\"");
                        return Err(at("name", text, "give each its own name"));
                    }
                    let value =
                        rules::value_of_board(name, field.unit.as_deref()).map_err(|text| {
                            let help = format!("use counts or one of: {}", unit::symbols());
                            at("unit", text, &help)
                        })?;
                    if conversion.is_none() {
                        let si = value.unit.si_per_unit;
                        let found = rules::conversion(field, si, number);
                        conversion = Some(found.map_err(|broken| broken.in_message(place))?);
                    }
                    values.push(value);
                }
                JsonRole::Values {
                    first,
                    count,
                    conversion: conversion.unwrap_or_else(Conversion::plain),
                }
            }
            Is::Sequence | Is::Time
                if message.fields[..number]
                    .iter()
                    .any(|other| other.is == field.is) =>
            {
                let text = "a message has one of each: a sequence and a time".to_owned();
                return Err(at("is", text, "leave out the second"));
            }
            Is::Sequence => JsonRole::Sequence(rules::counting(field)),
            Is::Time => {
                let step = field.unit.as_deref().and_then(unit::of_time);
                let step = step.ok_or_else(|| {
                    at(
                        "is",
                        "a time needs its unit".into(),
                        "use one of: s, ms, us, ns",
                    )
                })?;
                let scale = field.scale.unwrap_or(1.0);
                if !(scale > 0.0 && scale.is_finite()) {
                    let text = format!("{scale} is out of range: must be greater than 0");
                    return Err(at("scale", text, ""));
                }
                JsonRole::Time(step * scale)
            }
            Is::Status => JsonRole::Status(Status {
                name: field.name.clone().unwrap_or_else(|| "status".into()),
                good: field.good.clone(),
                bits: field.bits.clone(),
            }),
            Is::Mark | Is::Skip | Is::Address | Is::Check => {
                let text = "a JSON message holds values, a sequence, a time and a status";
                let help = "tell messages apart by key and id; what no field names is skipped";
                return Err(at("is", text.into(), help));
            }
        };
        fields.push(JsonField {
            pointer: pointer(key),
            text: TextNumber::of(field),
            role,
        });
    }
    Ok((Body::Json(fields), values))
}

/// What the text of a field in JSON may be.
fn check_json(field: &Field) -> Result<(), (&'static str, String, &'static str)> {
    let whole = field.kind.is_none_or(|kind| !kind.is_float());
    if field.digits == Some(Digits::Hexadecimal) && !whole {
        let text = "hexadecimal digits are those of whole numbers".to_owned();
        return Err(("type", text, "use u16, i16 or the like"));
    }
    if field.is == Is::Sequence && field.kind.is_some_and(|kind| !kind.is_unsigned()) {
        let text = "a whole number without sign is needed here".to_owned();
        return Err(("type", text, "use u8, u16 or u32, or leave it out"));
    }
    if field.shift.is_some_and(|shift| shift > 63) {
        let text = "out of range: must be at most 63".to_owned();
        return Err(("shift", text, ""));
    }
    Ok(())
}

/// Where the samples of a message stand.
fn samples_key(message: &Message) -> Option<&str> {
    message.samples.as_ref()?.key.as_deref()
}

/// JSON pointer (RFC 6901) of `1/data`; nothing is the whole object.
fn pointer(key: &str) -> String {
    if key.starts_with('/') || key.is_empty() {
        key.to_owned()
    } else {
        format!("/{key}")
    }
}

/// Names the values of each message of one kind.
fn add_values(
    values: &mut Vec<ValueOfBoard>,
    own: &[ValueOfBoard],
    message: &Message,
    layout: &MessageLayout,
    place: usize,
) -> Result<(), Broken> {
    let at = |text: String, help: &str| broken(&[&"message", &place, &"fields"], text, help);
    let first = message.first.unwrap_or(0);
    let messages = layout.ids.len().max(1);
    if values
        .len()
        .saturating_add(messages.saturating_mul(own.len()))
        > MOST_VALUES
        || layout.slots() > MOST_VALUES
    {
        return Err(at(
            format!("a frame has more than {MOST_VALUES} values"),
            "",
        ));
    }
    for number in 0..messages {
        for value in own {
            let name = if messages == 1 {
                value.name.clone()
            } else {
                format!("{}.{}", value.name, first.saturating_add(number))
            };
            if values.iter().any(|other| other.name == name) {
                let text = format!("a second value is called \"{name}\"");
                return Err(at(text, "give the values of each message their own names"));
            }
            values.push(ValueOfBoard {
                name,
                unit: value.unit.clone(),
            });
        }
    }
    Ok(())
}

fn frame_rule(
    frame: &MessageFrame,
    messages: &[MessageLayout],
    slots: usize,
    values: usize,
) -> Result<FrameRule, Broken> {
    // First and last place of the messages with an id; of JSON without ids, the key is one.
    let slots_of = |id: &Id| {
        messages.iter().find_map(|message| {
            let by_key = matches!(id, Id::Text(key) if message.ids.is_empty()
                && message.key.as_deref() == Some(pointer(key).as_str()));
            let number = message.ids.iter().position(|own| own == id);
            let number = number.or(by_key.then_some(0))?;
            let from = message.first_slot + number * message.addresses;
            Some(from..from + message.addresses)
        })
    };
    let unknown = |key: &'static str, id: &Id| {
        broken(
            &[&"framing", &"messages", &"frame", &key],
            format!("no message has the id {id}"),
            "name the id of a [[message]]",
        )
    };
    let mut required = vec![frame.all_of.is_empty(); slots];
    for id in &frame.all_of {
        required[slots_of(id).ok_or_else(|| unknown("all_of", id))?].fill(true);
    }
    let ends_with = match &frame.ends_with {
        None => None,
        Some(id) => {
            let slots = slots_of(id).ok_or_else(|| unknown("ends_with", id))?;
            required[slots.clone()].fill(true);
            Some(slots.end - 1)
        }
    };
    let mut kept = vec![false; values];
    for message in messages {
        for slot in 0..message.slots() {
            let from = message.first_value + slot * message.values;
            kept[from..from + message.values].fill(!required[message.first_slot + slot]);
        }
    }
    Ok(FrameRule {
        required,
        kept,
        ends_with,
        within_ns: frame.within.map(|within| (1e9 * within) as u64),
        in_order: false,
    })
}
