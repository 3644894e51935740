//! Rules between keys that every framing has, and their messages.

use std::ops::Range;

use taxel_recording::{Quantity, SignalUnit};

use super::field::{Field, Is, Type};
use super::layout::Conversion;
use super::one_or_several::Amount;
use super::{MOST_LONGEST, ValueOfBoard, unit};

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

/// Refuses what only a reading has in a field that is none, and what its type cannot hold.
pub(super) fn check_numbers(field: &Field, place: usize) -> Result<(), Broken> {
    let at = |key: &'static str, message: String, help: &str| {
        broken(&[&"packet", &"fields", &place, &key], message, help)
    };
    if field.is != Is::Value {
        for (given, key) in [
            (field.offset.is_some(), "offset"),
            (field.mask.is_some(), "mask"),
            (field.shift.is_some(), "shift"),
            (field.invert_from.is_some(), "invert_from"),
            (field.range.is_some(), "range"),
            (field.missing.is_some(), "missing"),
        ] {
            if given {
                let message = format!("only a field that is a value has `{key}`");
                let help = "leave it out; type = \"bits(12)\" takes part of a number";
                return Err(at(key, message, help));
            }
        }
    }
    let Some(kind) = field.kind.filter(|kind| !kind.is_float()) else {
        return Ok(());
    };
    let (bits, limits) = (kind.bits(), kind.limits());
    let [least, most] = limits;
    let span = format!("from {least} to {most}");
    let held = |number: f64| number.fract() == 0.0 && (least..=most).contains(&number);
    if let Some(missing) = field.missing.filter(|missing| !held(*missing)) {
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
        let first = field.first.unwrap_or(0) as f64;
        let last = first + field.count.unwrap_or(1) as f64 - 1.0;
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
        missing: None,
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
    for (key, number) in [
        ("offset", field.offset),
        ("invert_from", field.invert_from),
        ("missing", field.missing),
    ] {
        if number.is_some_and(|number| !number.is_finite() || number.abs() > 1e30) {
            return Err(at(key, "must be a number of at most 1e30".into(), ""));
        }
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
        missing: field.missing,
        scale: scale * si,
        offset: field.offset.unwrap_or(0.0) * si,
        range,
    };
    check_reached(&conversion, field.kind)
        .map_err(|message| at("range", message, "compare scale, offset and unit"))?;
    Ok(conversion)
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
