//! Rules between keys that every framing has, and their messages.

use taxel_recording::{Quantity, SignalUnit};

use super::field::Field;
use super::layout::Conversion;
use super::one_or_several::Amount;
use super::{MOST_LONGEST, ValueOfBoard, unit};

/// A broken rule: where, what, and what to do.
#[derive(Debug)]
pub(super) struct Broken {
    pub(super) path: Vec<String>,
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
        message: message.into(),
        help: help.into(),
    }
}

impl Broken {
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
    Ok(Conversion {
        mask: field.mask,
        shift: field.shift.unwrap_or(0),
        invert_from: field.invert_from,
        missing: field.missing,
        scale: scale * si,
        offset: field.offset.unwrap_or(0.0) * si,
        range,
    })
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
