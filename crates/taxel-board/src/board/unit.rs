//! Units of values and of times.

use taxel_recording::{Quantity, SignalUnit};

/// What some boards give beside the readings that a sensor has: symbol and SI value.
const OTHERS: [(&str, f64); 14] = [
    ("T", 1.0),
    ("mT", 1e-3),
    ("uT", 1e-6),
    ("degC", 1.0),
    ("K", 1.0),
    ("m", 1.0),
    ("mm", 1e-3),
    ("um", 1e-6),
    ("N m", 1.0),
    ("N mm", 1e-3),
    ("mN m", 1e-3),
    ("m/s2", 1.0),
    ("rad/s", 1.0),
    ("%", 0.01),
];

/// The unit called `symbol`.
pub(super) fn of_value(symbol: &str) -> Result<SignalUnit, String> {
    let symbol = symbol.replace(['µ', 'μ'], "u");
    let other = OTHERS.iter().find(|(name, _)| *name == symbol);
    let known = other.map(|(name, si)| SignalUnit {
        quantity: Quantity::Raw,
        symbol: (*name).to_owned(),
        si_per_unit: *si,
    });
    known
        .or_else(|| SignalUnit::named(&symbol))
        .ok_or_else(|| format!("\"{symbol}\" is no known unit"))
}

/// The symbols, for messages.
pub(super) fn symbols() -> String {
    let others: Vec<_> = OTHERS.iter().map(|(name, _)| *name).collect();
    format!("{}, {}", SignalUnit::symbols(), others.join(", "))
}

/// Nanoseconds of one unit of time.
pub(super) fn of_time(symbol: &str) -> Option<f64> {
    match symbol.replace(['µ', 'μ'], "u").as_str() {
        "s" => Some(1e9),
        "ms" => Some(1e6),
        "us" => Some(1e3),
        "ns" => Some(1.0),
        _ => None,
    }
}
