//! Rules between keys that every framing has, and their messages.

use std::ops::Range;

use taxel_recording::{Quantity, SignalUnit};

use super::field::{CountedBySequence, Field, Is, Type, Within};
use super::layout::{AddressRange, Conversion, Counting};
use super::one_or_several::{Amount, Missing};
use super::{MOST_LONGEST, ValueOfBoard, unit};
use crate::names::MOST_VALUES;

/// A broken rule: where, what, and what to do.
#[derive(Debug)]
pub(super) struct Broken {
    pub(super) path: Vec<String>,
    /// The part of a text that it is about, bytes; `None` for the whole value.
    pub(super) within: Option<Range<usize>>,
    pub(super) message: String,
    pub(super) help: String,
}

/// A broken rule at `path`, whose segments are keys and places in lists.
pub(super) fn broken(
    path: &[&dyn std::fmt::Display],
    message: impl Into<String>,
    help: impl Into<String>,
) -> Broken {
    Broken {
        path: path.iter().map(ToString::to_string).collect(),
        within: None,
        message: message.into(),
        help: help.into(),
    }
}

impl Broken {
    /// The same rule about these bytes of a text.
    pub(super) fn within(self, within: Range<usize>) -> Self {
        Self {
            within: Some(within),
            ..self
        }
    }

    /// The same rule where the table `packet` stands for the message of this place.
    pub(super) fn in_message(mut self, place: usize) -> Self {
        if self.path.first().is_some_and(|key| key == "packet") {
            self.path
                .splice(..1, ["message".to_owned(), place.to_string()]);
        }
        self
    }
}

/// `a, b, … z`
pub(crate) fn shortened(names: &[&str]) -> String {
    match names {
        [first @ .., last] if names.len() > 12 => {
            format!("{}, … {last}", first[..8].join(", "))
        }
        _ => names.join(", "),
    }
}

/// A value of this name, in counts without a unit.
pub(super) fn value_of_board(name: String, symbol: Option<&str>) -> Result<ValueOfBoard, String> {
    let unit = match symbol {
        None => SignalUnit {
            quantity: Quantity::Counts,
            symbol: "counts".into(),
            si_per_unit: 1.0,
        },
        Some(symbol) => unit::of_value(symbol)?,
    };
    Ok(ValueOfBoard { name, unit })
}

/// The longest packet of a framing, checked.
pub(crate) fn longest(given: Option<usize>, default: usize, kind: &str) -> Result<usize, Broken> {
    match given {
        None => Ok(default),
        Some(longest @ 1..=MOST_LONGEST) => Ok(longest),
        Some(longest) => Err(broken(
            &[&"framing", &kind, &"longest"],
            format!("{longest} is out of range: must be at least 1 and at most {MOST_LONGEST}"),
            "",
        )),
    }
}

/// Refuses keys that say nothing of a field, and what its type cannot hold.
pub(super) fn check_keys(field: &Field, within: Within, place: usize) -> Result<(), Broken> {
    if let Some((key, help)) = field.meaningless(within) {
        let message = format!("`{key}` says nothing of {}", field.called(within));
        return Err(broken(&[&"packet", &"fields", &place, &key], message, help));
    }
    check_numbers(field, within, place)?;
    if field.is == Is::Address {
        return check_address(field, place);
    }
    check_counting(field, place)
}

/// What an address needs to say which packets make a frame.
fn check_address(field: &Field, place: usize) -> Result<(), Broken> {
    let at = |key: &'static str, message: &str, help: &str| {
        Err(broken(&[&"packet", &"fields", &place, &key], message, help))
    };
    if !matches!(field.count, Some(2..=MOST_VALUES)) {
        return at(
            "is",
            "how many packets make a frame?",
            "add count, from 2 to 4096, such as count = 8; and first and step where they are not 0 and 1",
        );
    }
    if field
        .step
        .is_some_and(|step| !(1..=LARGEST_COUNT).contains(&step))
    {
        return at("step", "out of range: must be at least 1", "");
    }
    Ok(())
}

/// What a sequence needs to count.
fn check_counting(field: &Field, place: usize) -> Result<(), Broken> {
    for (key, given) in [
        ("step", field.step),
        ("modulus", field.modulus),
        ("repeats", field.repeats),
    ] {
        let least = if key == "modulus" { 2 } else { 1 };
        if let Some(given) = given.filter(|given| !(least..=LARGEST_COUNT).contains(given)) {
            let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", &place, &key];
            let message =
                format!("{given} is out of range: must be from {least} to {LARGEST_COUNT}");
            return Err(broken(&path, message, ""));
        }
    }
    if field.repeats.is_some() && field.counts == Some(CountedBySequence::Packets) {
        let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", &place, &"repeats"];
        let message = "a counter of packets has another number for each".to_owned();
        let help =
            "leave it out, or leave `counts` out where all packets of a frame have one number";
        return Err(broken(&path, message, help));
    }
    let whole = field
        .kind
        .filter(|kind| !kind.is_float() && kind.bits() < 63);
    let of_type = whole.map(|kind| 1_u64 << kind.bits());
    if let (Some(modulus), Some(most)) = (field.modulus, of_type)
        && modulus > most
    {
        let message = format!("{modulus} is out of range: the type has {most} numbers");
        let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", &place, &"modulus"];
        return Err(broken(&path, message, ""));
    }
    if let (Some(step), Some(numbers)) = (field.step, field.modulus.or(of_type))
        && numbers % step != 0
    {
        let message = format!("{numbers} numbers are no multiple of {step}");
        let help = "give `modulus`: the number at which the counter begins again from 0";
        let path: [&dyn std::fmt::Display; 4] = [&"packet", &"fields", &place, &"step"];
        return Err(broken(&path, message, help));
    }
    Ok(())
}

/// Largest number that says how a counter counts.
const LARGEST_COUNT: u64 = 1 << 40;

/// Refuses what the type of a field cannot hold.
fn check_numbers(field: &Field, within: Within, place: usize) -> Result<(), Broken> {
    let at = |key: &'static str, message: String, help: &str| {
        broken(&[&"packet", &"fields", &place, &key], message, help)
    };
    let word = |missing: &Missing| matches!(missing, Missing::Word(_));
    if within == Within::Bytes && field.missing.iter().any(word) {
        let message = "a packet of bytes has no words".to_owned();
        return Err(at("missing", message, "write the number that stands there"));
    }
    let one_byte = field
        .kind
        .is_some_and(|kind| !kind.is_bits() && kind.bits() == 8);
    if field.order.is_some() && one_byte {
        let message = "one byte has no order".to_owned();
        return Err(at("order", message, "leave it out"));
    }
    let Some(kind) = field.kind.filter(|kind| !kind.is_float()) else {
        return Ok(());
    };
    let (bits, limits) = (kind.number_bits(), kind.limits());
    let [least, most] = limits;
    let span = format!("from {least} to {most}");
    let held = |number: f64| number.fract() == 0.0 && (least..=most).contains(&number);
    let never = |missing: &&Missing| match missing {
        Missing::Number(number) => !held(*number),
        Missing::Stretch([low, high]) => *high < least || *low > most,
        Missing::Word(_) => false,
    };
    if let Some(missing) = field.missing.iter().find(never) {
        let missing = match missing {
            Missing::Number(number) => number.to_string(),
            Missing::Stretch([low, high]) => format!("{low} to {high}"),
            Missing::Word(word) => word.clone(),
        };
        let message = format!("{missing} never comes: {kind} holds whole numbers {span}");
        return Err(at("missing", message, ""));
    }
    let beyond = |number: u64| bits < 64 && number >> bits != 0;
    if let Some(mask) = field.mask.filter(|mask| *mask == 0 || beyond(*mask)) {
        let all = u64::MAX >> (64 - bits);
        let message = format!("{mask:#x} is out of range: {kind} has {bits} bits");
        let help = format!("write a mask from 0x1 to {all:#x}");
        return Err(at("mask", message, &help));
    }
    if let Some(shift) = field.shift.filter(|shift| *shift as usize >= bits) {
        let message = format!("{shift} is out of range: must be at most {}", bits - 1);
        return Err(at("shift", message, "nothing is left of the number"));
    }
    if let Some(good) = field.good.iter().find(|good| beyond(**good)) {
        let message = format!("{good:#x} never comes: {kind} has {bits} bits");
        return Err(at("good", message, ""));
    }
    if let Some((name, bit)) = field.bits.iter().find(|(_, bit)| **bit as usize >= bits) {
        let message = format!(
            "{name} = {bit} is out of range: {kind} has the bits 0 to {}",
            bits - 1
        );
        return Err(at("bits", message, ""));
    }
    if field.is == Is::Address {
        let range = AddressRange::of(field);
        let [first, last] = [0, range.count.saturating_sub(1)].map(|slot| range.at(slot) as f64);
        if !held(first) || !held(last) {
            let message =
                format!("the addresses {first} to {last} never come all: {kind} holds {span}");
            let key = if field.count.is_some() { "count" } else { "is" };
            return Err(at(key, message, ""));
        }
    }
    Ok(())
}

/// Refuses a range that no number of this type reaches.
fn check_reached(conversion: &Conversion, kind: Option<Type>) -> Result<(), String> {
    let Some(kind) = kind.filter(|kind| !kind.is_float()) else {
        return Ok(());
    };
    let Some([low, high]) = conversion.range else {
        return Ok(());
    };
    let numbers = match conversion.mask {
        Some(mask) => [0.0, mask as f64],
        None => kind.limits(),
    };
    let free = Conversion {
        mask: None,
        missing: Vec::new(),
        range: None,
        ..conversion.clone()
    };
    let ends = numbers.map(|number| free.value(number).unwrap_or(f64::NAN));
    let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    if low > most || high < least {
        Err(format!(
            "no number of {kind} gives a value in this range: they reach from {least} to {most} in SI"
        ))
    } else {
        Ok(())
    }
}

/// Number to value of a field whose unit has `si` in SI.
pub(super) fn conversion(field: &Field, si: f64, place: usize) -> Result<Conversion, Broken> {
    let at = |key: &'static str, message: String, help: &str| {
        broken(&[&"packet", &"fields", &place, &key], message, help)
    };
    let scale = field.scale.unwrap_or(1.0);
    if scale == 0.0 || !scale.is_finite() || !(1e-30..=1e30).contains(&scale.abs()) {
        let message = format!("{scale} is out of range: its size must be from 1e-30 to 1e30");
        return Err(at("scale", message, ""));
    }
    let mut missing = Vec::new();
    let mut missing_words = Vec::new();
    for one in &field.missing {
        match one {
            Missing::Number(number) => missing.push([*number; 2]),
            Missing::Stretch(stretch) => missing.push(*stretch),
            Missing::Word(word) => missing_words.push(word.clone()),
        }
    }
    let given = [("offset", field.offset), ("invert_from", field.invert_from)];
    let given = given
        .iter()
        .filter_map(|(key, number)| Some((*key, (*number)?)));
    if let Some([low, high]) = missing.iter().find(|[low, high]| low > high) {
        let message =
            format!("[{low}, {high}] is no stretch: its second number must be the larger");
        return Err(at("missing", message, ""));
    }
    let numbers = missing.iter().flatten().map(|number| ("missing", *number));
    for (key, number) in given.chain(numbers) {
        if !number.is_finite() || number.abs() > 1e30 {
            return Err(at(key, "must be a number of at most 1e30".into(), ""));
        }
    }
    let spoken = |word: &&String| word.trim().is_empty() || word.contains(char::is_whitespace);
    if let Some(word) = missing_words.iter().find(spoken) {
        let message = format!("\"{word}\" is no word of a line");
        return Err(at("missing", message, "write it without blanks"));
    }
    if (field.mask.is_some() || field.shift.is_some())
        && field.kind.is_some_and(|kind| !kind.is_unsigned())
    {
        let key = if field.mask.is_some() {
            "mask"
        } else {
            "shift"
        };
        let message = "only whole numbers without sign are masked and shifted".to_owned();
        return Err(at(key, message, "use type = \"u16\" or the like"));
    }
    let range = match &field.range {
        None => None,
        Some([low, high]) => {
            let bound = |amount: &Amount| match amount {
                Amount::Number(number) => Ok(number * si),
                Amount::Text(text) => of_text(text, field.unit.as_deref()),
            };
            let bounds = [bound(low), bound(high)];
            let [Ok(low), Ok(high)] = bounds else {
                let [low, high] = bounds;
                let message = low.err().or(high.err()).unwrap_or_default();
                return Err(at(
                    "range",
                    message,
                    "write numbers in the unit of the field",
                ));
            };
            if low.is_nan() || high.is_nan() || low >= high {
                let message = "the range is empty: its second value must be the larger".to_owned();
                return Err(at("range", message, ""));
            }
            Some([low, high])
        }
    };
    let conversion = Conversion {
        mask: field.mask,
        shift: field.shift.unwrap_or(0),
        invert_from: field.invert_from,
        missing,
        missing_words,
        scale: scale * si,
        offset: field.offset.unwrap_or(0.0) * si,
        range,
    };
    check_reached(&conversion, field.kind)
        .map_err(|message| at("range", message, "compare scale, offset and unit"))?;
    Ok(conversion)
}

/// How the sequence of a field counts.
pub(super) fn counting(field: &Field) -> Counting {
    Counting {
        step: field.step.unwrap_or(1),
        modulus: field.modulus,
        repeats: field.repeats.unwrap_or(1),
        packets: field.counts == Some(CountedBySequence::Packets),
    }
}

/// SI value of `2.5 pF` in a field with the unit `symbol`.
fn of_text(text: &str, symbol: Option<&str>) -> Result<f64, String> {
    let (number, unit) = text.trim().split_once(' ').unwrap_or((text, ""));
    let wrong = || format!("\"{text}\" is no number with its unit");
    let number: f64 = number.parse().map_err(|_| wrong())?;
    let found = value_of_board(String::new(), Some(unit.trim()))?.unit;
    let own = value_of_board(String::new(), symbol)?.unit;
    let same = found.quantity == own.quantity
        && (found.quantity != Quantity::Raw || found.symbol == own.symbol);
    if same {
        Ok(number * found.si_per_unit)
    } else {
        Err(format!(
            "\"{text}\" is in {}; the field is in {}",
            found.symbol, own.symbol
        ))
    }
}
