//! Places of the fields of a packet, one behind the other, and rules between them.

use super::description::{Check, Framing, Packet};
use super::field::{Field, Is, Type, Within};
use super::layout::{AddressRange, PacketLayout, PlacedCheck, PlacedField, Role, Status};
use super::rules::{self, Broken, broken, conversion, value_of_board};
use super::{MOST_LONGEST, ValueOfBoard, unit};
use crate::names::{self, MOST_VALUES};
use crate::pattern::BytePattern;

/// Where the fields of a packet stand, and its values.
pub(super) fn layout(
    framing: &Framing,
    packet: &Packet,
) -> Result<(PacketLayout, Vec<ValueOfBoard>), Broken> {
    let (head, tail) = marks(framing);
    let mut places = Placement {
        packet,
        head,
        next_bit: 0,
        bits_begin: None,
        taken: Vec::new(),
        fields: Vec::new(),
        values: Vec::new(),
        sample: 0,
        placed: 0,
        address: None,
        check_at: None,
    };
    // A head needs no field of its own.
    let begins_with_mark = packet.fields.first().is_some_and(|field| {
        let over_head = |equals: &BytePattern| head.is_none_or(|head| head.agrees(equals));
        let is_head = field.is == Is::Mark && field.equals.as_ref().is_none_or(over_head);
        is_head || field.at.is_some()
    });
    if !begins_with_mark {
        places.next_bit = 8 * head.map_or(0, BytePattern::len);
    }
    let count = packet.samples.as_ref().and_then(|samples| samples.count);
    let is_value = |field: &Field| field.is == Is::Value;
    let first = packet.fields.iter().position(is_value).unwrap_or(0);
    let behind = packet
        .fields
        .iter()
        .rposition(is_value)
        .map_or(0, |last| last + 1);
    if let Some(place) = (first..behind).find(|place| {
        let field = &packet.fields[*place];
        count.is_some() && (field.at.is_some() || field.bit.is_some())
    }) {
        let message = "what comes again for each sample stands behind what is before it";
        let path: [&dyn std::fmt::Display; 3] = [&"packet", &"fields", &place];
        return Err(broken(&path, message, "leave out `at` and `bit`"));
    }
    for place in 0..first {
        places.add(place)?;
    }
    for sample in 0..count.unwrap_or(1) {
        places.sample = sample;
        for place in first..behind {
            places.add(place)?;
        }
    }
    for place in behind..packet.fields.len() {
        places.add(place)?;
    }
    places.finish(framing, tail)
}

fn marks(framing: &Framing) -> (Option<&BytePattern>, Option<&BytePattern>) {
    match framing {
        Framing::Fixed(fixed) => (fixed.head.as_ref(), fixed.tail.as_ref()),
        Framing::Marked(marked) => (Some(&marked.head), Some(&marked.tail)),
        Framing::Length(length) => (Some(&length.head), None),
        Framing::Lines(_) | Framing::Cobs(_) | Framing::Slip(_) | Framing::Messages(_) => {
            (None, None)
        }
    }
}

/// Fields put one behind the other.
struct Placement<'a> {
    packet: &'a Packet,
    head: Option<&'a BytePattern>,
    next_bit: usize,
    /// First bit of the fields of bits that are beside each other.
    bits_begin: Option<usize>,
    /// First bit, bit behind the last, and field.
    taken: Vec<(usize, usize, usize)>,
    fields: Vec<PlacedField>,
    /// Values of one frame.
    values: Vec<ValueOfBoard>,
    /// The frame of the packet that is placed, and the values of all so far.
    sample: usize,
    placed: usize,
    address: Option<AddressRange>,
    check_at: Option<usize>,
}

impl Placement<'_> {
    fn add(&mut self, place: usize) -> Result<(), Broken> {
        let field = &self.packet.fields[place];
        let at = |key: &'static str, message: String, help: &str| {
            broken(&[&"packet", &"fields", &place, &key], message, help)
        };
        rules::check_keys(field, Within::Bytes, place)?;
        self.check_needs(place)?;
        let names = match &field.name {
            Some(pattern) => names::expanded(pattern).map_err(|message| at("name", message, ""))?,
            None => Vec::new(),
        };
        let count = match field.is {
            Is::Value | Is::Status => names.len().max(1),
            _ => 1,
        };
        for number in 0..count {
            let kind = field.kind;
            let bits = match (kind, field.bytes, field.is) {
                (_, _, Is::Check) => {
                    8 * self
                        .packet
                        .check
                        .as_ref()
                        .map_or(0, |check| check.kind.bytes())
                }
                (Some(kind), _, _) => kind.bits(),
                (None, Some(bytes), _) => 8 * bytes,
                (None, None, _) => 8 * field.equals.as_ref().map_or(0, BytePattern::len),
            };
            let begin = self.begin(field, number, bits);
            let end = begin + bits;
            if let Some((_, _, other)) = self
                .taken
                .iter()
                .find(|(from, to, _)| begin < *to && *from < end)
            {
                let message = format!(
                    "the field lies over bytes {} to {}, which field {} has",
                    begin / 8,
                    end.div_ceil(8).saturating_sub(1),
                    other + 1
                );
                let key = if field.at.is_some() { "at" } else { "is" };
                return Err(at(key, message, "move one of the two"));
            }
            if end > 8 * MOST_LONGEST {
                let message = format!("the packet is longer than {MOST_LONGEST} bytes");
                return Err(at("is", message, "shorten it"));
            }
            self.taken.push((begin, end, place));
            self.next_bit = end;
            let name = names.get(number).cloned();
            self.role(place, field, name, begin)?;
        }
        Ok(())
    }

    /// First bit of the field, or of its entry `number`.
    fn begin(&mut self, field: &Field, number: usize, bits: usize) -> usize {
        let packed = field.kind.is_some_and(Type::is_bits);
        let next = if packed {
            let begin = *self
                .bits_begin
                .get_or_insert_with(|| self.next_bit.next_multiple_of(8));
            match field.bit {
                Some(bit) => begin + bit + number * bits,
                None => self.next_bit.max(begin),
            }
        } else {
            self.bits_begin = None;
            self.next_bit.next_multiple_of(8)
        };
        match field.at {
            Some(at) if packed => {
                self.bits_begin = Some(8 * at);
                8 * at + field.bit.unwrap_or(0) + number * bits
            }
            Some(at) => 8 * at + number * bits,
            None => next,
        }
    }

    /// Keys that a field needs, and what they may be.
    fn check_needs(&self, place: usize) -> Result<(), Broken> {
        let field = &self.packet.fields[place];
        let at = |key: &'static str, message: &str, help: &str| {
            Err(broken(&[&"packet", &"fields", &place, &key], message, help))
        };
        let numeric = matches!(
            field.is,
            Is::Value | Is::Sequence | Is::Time | Is::Status | Is::Address
        );
        if numeric && field.kind.is_none() {
            return at(
                "is",
                "the field has no type",
                "add one, such as type = \"u16\" or \"f32\"",
            );
        }
        let wrong_type = match (field.is, field.kind) {
            (Is::Sequence, Some(kind)) => !kind.is_unsigned(),
            (Is::Address | Is::Status, Some(kind)) => {
                kind.is_float() && (field.is == Is::Address || !field.good.is_empty())
            }
            _ => false,
        };
        if wrong_type {
            return at(
                "type",
                "a whole number without sign is needed here",
                "use u8, u16 or u32",
            );
        }
        if field.bits.values().any(|bit| *bit > 63) {
            return at("bits", "a bit is a number from 0 to 63", "");
        }
        self.check_bytes(place)?;
        if field.is == Is::Value && field.name.is_none() {
            return at(
                "is",
                "the value has no name",
                "add one, such as name = \"c{1..4}\"",
            );
        }
        if field
            .bytes
            .is_some_and(|bytes| bytes == 0 || bytes > MOST_LONGEST)
        {
            return at(
                "bytes",
                "out of range: must be at least 1 and at most 1048576",
                "",
            );
        }
        if field.shift.is_some_and(|shift| shift > 63) {
            return at("shift", "out of range: must be at most 63", "");
        }
        if field.bit.is_some() && !field.kind.is_some_and(Type::is_bits) {
            return at(
                "bit",
                "only fields of type bits(n) have a first bit",
                "use `at` for bytes",
            );
        }
        if field.at.is_some_and(|at| at > MOST_LONGEST) || field.bit.is_some_and(|bit| bit > 4096) {
            return at("at", "lies behind the longest packet", "");
        }
        Ok(())
    }

    /// How many bytes a mark has, or what is skipped, and which.
    fn check_bytes(&self, place: usize) -> Result<(), Broken> {
        let field = &self.packet.fields[place];
        let at = |key: &'static str, message: &str, help: &str| {
            Err(broken(&[&"packet", &"fields", &place, &key], message, help))
        };
        if field.is == Is::Skip && field.bytes.is_none() && field.kind.is_none() {
            return at("is", "how much is skipped?", "add bytes = 2, or a type");
        }
        if field.is == Is::Mark && field.bytes.is_none() && field.equals.is_none() {
            return at(
                "is",
                "the mark has no bytes",
                "add bytes = 2, or equals = \"aa 07\"",
            );
        }
        if field.is == Is::Mark && place > 0 && field.equals.is_none() && field.kind.is_none() {
            let last = place + 1 == self.packet.fields.len();
            if !last {
                return at(
                    "is",
                    "nothing says what bytes stand there",
                    "add equals = \"aa 07\", or use is = \"skip\"",
                );
            }
        }
        if let (Some(bytes), Some(equals)) = (field.bytes, &field.equals)
            && bytes != equals.len()
        {
            return at(
                "bytes",
                "the mark has another number of bytes",
                "leave it out",
            );
        }
        if field.is == Is::Skip && field.bytes.is_some() && field.kind.is_some() {
            return at(
                "type",
                "how much is skipped is said twice",
                "leave out `bytes` or `type`",
            );
        }
        Ok(())
    }

    fn role(
        &mut self,
        place: usize,
        field: &Field,
        name: Option<String>,
        bit: usize,
    ) -> Result<(), Broken> {
        let at = |key: &'static str, message: String, help: String| {
            broken(&[&"packet", &"fields", &place, &key], message, help)
        };
        let only = |roles: &[PlacedField], is: &str, found: fn(&Role) -> bool| {
            if roles.iter().any(|field| found(&field.role)) {
                let message = format!("a second {is}; a packet has one");
                Err(broken(&[&"packet", &"fields", &place, &"is"], message, ""))
            } else {
                Ok(())
            }
        };
        let kind = field.kind.unwrap_or(Type::Unsigned(1));
        let role = match field.is {
            Is::Value => {
                let name = name.unwrap_or_default();
                let again = self.sample > 0;
                if !again && self.values.iter().any(|value| value.name == name) {
                    let message = format!("a second value is called \"{name}\"");
                    return Err(at("name", message, "give each its own name".into()));
                }
                let value = value_of_board(name, field.unit.as_deref()).map_err(|message| {
                    let help = format!("use counts or one of: {}", unit::symbols());
                    at("unit", message, help)
                })?;
                let conversion = conversion(field, value.unit.si_per_unit, place)?;
                if !again {
                    self.values.push(value);
                }
                self.placed += 1;
                if self.values.len() > MOST_VALUES {
                    let message = format!("more than {MOST_VALUES} values");
                    return Err(at("name", message, String::new()));
                }
                Role::Value(self.placed - 1, conversion)
            }
            Is::Sequence => {
                only(&self.fields, "sequence", |role| {
                    matches!(role, Role::Sequence(_))
                })?;
                Role::Sequence(rules::counting(field))
            }
            Is::Time => {
                only(&self.fields, "time", |role| matches!(role, Role::Time(_)))?;
                let step = field.unit.as_deref().and_then(unit::of_time);
                let step = step.ok_or_else(|| {
                    let message = "a time needs its unit".to_owned();
                    at("unit", message, "use one of: s, ms, us, ns".into())
                })?;
                let scale = field.scale.unwrap_or(1.0);
                if !(scale > 0.0 && scale.is_finite()) {
                    let message = format!("{scale} is out of range: must be greater than 0");
                    return Err(at("scale", message, String::new()));
                }
                Role::Time(step * scale)
            }
            Is::Status => Role::Status(Status {
                name: name.unwrap_or_else(|| "status".into()),
                good: field.good.clone(),
                bits: field.bits.clone(),
            }),
            Is::Address => {
                only(&self.fields, "address", |role| *role == Role::Address)?;
                self.address = Some(AddressRange::of(field));
                Role::Address
            }
            Is::Mark => match &field.equals {
                Some(bytes) => Role::Mark(bytes.clone()),
                None => return Ok(()),
            },
            Is::Skip => return Ok(()),
            Is::Check => {
                if self.packet.check.is_none() {
                    let message = "what kind of check is it?".to_owned();
                    let help = "add packet.check, such as check = { kind = \"sum16\" }";
                    return Err(at("is", message, help.into()));
                }
                self.check_at = Some(bit / 8);
                return Ok(());
            }
        };
        self.fields.push(PlacedField {
            bit,
            kind,
            order: field.order.or(self.packet.order).unwrap_or_default(),
            role,
        });
        Ok(())
    }

    fn finish(
        mut self,
        framing: &Framing,
        tail: Option<&BytePattern>,
    ) -> Result<(PacketLayout, Vec<ValueOfBoard>), Broken> {
        let mut end = self
            .taken
            .iter()
            .map(|(_, to, _)| to.div_ceil(8))
            .max()
            .unwrap_or(8 * self.head.map_or(0, BytePattern::len) / 8);
        let check = match &self.packet.check {
            None => None,
            Some(check) => {
                let (placed, at) = self.check(check, &mut end)?;
                Some((placed, at))
            }
        };
        // A tail needs no field of its own.
        let with_mark = self
            .packet
            .fields
            .last()
            .is_some_and(|field| field.is == Is::Mark && self.packet.fields.len() > 1)
            && check.as_ref().is_none_or(|(_, at)| *at < end);
        let tail_bytes = tail.map_or(0, BytePattern::len);
        let mut length = end;
        if tail_bytes > 0 && !with_mark {
            length += tail_bytes;
        }
        if let Framing::Fixed(fixed) = framing {
            // Without its own field the tail may lie over what the fields leave free.
            if length != fixed.length && end != fixed.length {
                let message = format!(
                    "fields, check and tail cover {length} bytes of {}",
                    fixed.length
                );
                let help = if length > fixed.length {
                    format!("write length = {length}, or leave fields out")
                } else {
                    let more = fixed.length - length;
                    format!(
                        "add {{ is = \"skip\", bytes = {more} }} where bytes stand that do not matter, or write length = {length}"
                    )
                };
                return Err(broken(&[&"framing", &"fixed", &"length"], message, help));
            }
            length = fixed.length;
        }
        self.check_marks(length, tail_bytes)?;
        let values = self.placed;
        let check = check.map(|(mut placed, at)| {
            placed.from_end = length - at;
            placed
        });
        let values_of_board = match self.address {
            None => std::mem::take(&mut self.values),
            Some(address) => address.values(&self.values),
        };
        if values_of_board.len() > MOST_VALUES {
            let message = format!("a frame has more than {MOST_VALUES} values");
            return Err(broken(&[&"packet", &"fields"], message, ""));
        }
        Ok((
            PacketLayout {
                length,
                fields: self.fields,
                check,
                values,
                address: self.address,
            },
            values_of_board,
        ))
    }

    /// Refuses fields that lie over what is known of the head, or over the tail.
    fn check_marks(&self, length: usize, tail: usize) -> Result<(), Broken> {
        let head = self.head.map_or(0, BytePattern::len);
        for (from, to, place) in &self.taken {
            let field = &self.packet.fields[*place];
            if matches!(field.is, Is::Mark | Is::Skip) {
                continue;
            }
            let [first, last] = [from / 8, to.div_ceil(8)];
            let known = |pattern: &BytePattern| (first..last).any(|at| pattern.is_known(at));
            let over_head = first < head && self.head.is_some_and(known);
            let what = match (over_head, last > length - tail.min(length)) {
                (true, _) => "head",
                (_, true) => "tail",
                _ => continue,
            };
            let message = format!(
                "the field lies over bytes {first} to {} of {length}, where the {what} stands",
                last.saturating_sub(1)
            );
            let key = if field.at.is_some() { "at" } else { "is" };
            let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", place, &key];
            return Err(broken(
                &path,
                message,
                "move it, or give the packet its whole length",
            ));
        }
        Ok(())
    }

    /// The check and the place of its first byte; `end` is moved behind it.
    fn check(&self, check: &Check, end: &mut usize) -> Result<(PlacedCheck, usize), Broken> {
        let at = |key: &'static str, message: String, help: &str| {
            broken(&[&"packet", &"check", &key], message, help)
        };
        let bytes = check.kind.bytes();
        let place = match (check.at, self.check_at) {
            (Some(_), Some(_)) => {
                let message = "the place of the check is given twice".to_owned();
                return Err(at("at", message, "leave out `at`, or the field"));
            }
            (Some(at), None) | (None, Some(at)) => at,
            (None, None) => *end,
        };
        if place > MOST_LONGEST {
            return Err(at("at", "lies behind the longest packet".into(), ""));
        }
        if self.check_at.is_none()
            && let Some((_, _, field)) = self
                .taken
                .iter()
                .find(|(from, to, _)| 8 * place < *to && *from < 8 * (place + bytes))
        {
            let message = format!("the check lies over the bytes of field {}", field + 1);
            return Err(at("at", message, "move one of the two"));
        }
        *end = (*end).max(place + bytes);
        let over = check
            .over
            .unwrap_or([0, if bytes == 0 { *end } else { place }]);
        let [from, to] = over;
        if from >= to || to > *end {
            let message = format!("[{from}, {to}] is no stretch of the {end} bytes of the packet");
            return Err(at(
                "over",
                message,
                "give its first byte and the one behind its last",
            ));
        }
        if bytes > 0 && from < place + bytes && place < to {
            let message = format!(
                "the check stands at bytes {place} to {} and covers itself",
                place + bytes - 1
            );
            return Err(at("over", message, "end it before its own bytes"));
        }
        let placed = PlacedCheck {
            kind: check.kind,
            over,
            from_end: 0,
            order: check.order.or(self.packet.order).unwrap_or_default(),
        };
        Ok((placed, place))
    }
}
