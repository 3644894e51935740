//! The units that recordings are written in.

use crate::frame::{Quantity, SignalUnit};

struct Entry {
    quantity: Quantity,
    symbol: &'static str,
    si_per_unit: f64,
}

const fn unit(quantity: Quantity, symbol: &'static str, si_per_unit: f64) -> Entry {
    Entry {
        quantity,
        symbol,
        si_per_unit,
    }
}

/// Standard gravity is 9.80665 m/s², a pound 0.45359237 kg, an inch 0.0254 m;
/// mercury and water are the conventional ones.
const UNITS: [Entry; 52] = [
    unit(Quantity::Capacitance, "aF", 1e-18),
    unit(Quantity::Capacitance, "fF", 1e-15),
    unit(Quantity::Capacitance, "pF", 1e-12),
    unit(Quantity::Capacitance, "nF", 1e-9),
    unit(Quantity::Capacitance, "F", 1.0),
    unit(Quantity::Voltage, "V", 1.0),
    unit(Quantity::Voltage, "mV", 1e-3),
    unit(Quantity::Voltage, "uV", 1e-6),
    unit(Quantity::Voltage, "nV", 1e-9),
    unit(Quantity::Resistance, "ohm", 1.0),
    unit(Quantity::Resistance, "kohm", 1e3),
    unit(Quantity::Resistance, "Mohm", 1e6),
    unit(Quantity::Resistance, "mohm", 1e-3),
    unit(Quantity::Resistance, "Gohm", 1e9),
    unit(Quantity::Charge, "C", 1.0),
    unit(Quantity::Charge, "nC", 1e-9),
    unit(Quantity::Charge, "pC", 1e-12),
    unit(Quantity::Charge, "fC", 1e-15),
    unit(Quantity::FluxDensity, "nT", 1e-9),
    unit(Quantity::FluxDensity, "uT", 1e-6),
    unit(Quantity::FluxDensity, "mT", 1e-3),
    unit(Quantity::FluxDensity, "T", 1.0),
    unit(Quantity::Counts, "counts", 1.0),
    unit(Quantity::Raw, "raw", 1.0),
    unit(Quantity::Force, "N", 1.0),
    unit(Quantity::Force, "mN", 1e-3),
    unit(Quantity::Force, "uN", 1e-6),
    unit(Quantity::Force, "kN", 1e3),
    unit(Quantity::Force, "kgf", 9.80665),
    unit(Quantity::Force, "gf", 9.80665e-3),
    unit(Quantity::Force, "lbf", 4.4482216152605),
    unit(Quantity::Pressure, "Pa", 1.0),
    unit(Quantity::Pressure, "hPa", 1e2),
    unit(Quantity::Pressure, "kPa", 1e3),
    unit(Quantity::Pressure, "MPa", 1e6),
    unit(Quantity::Pressure, "GPa", 1e9),
    unit(Quantity::Pressure, "psi", 6894.757293168361),
    unit(Quantity::Pressure, "mmHg", 133.322387415),
    unit(Quantity::Pressure, "inHg", 3386.388640341),
    unit(Quantity::Pressure, "cmH2O", 98.0665),
    unit(Quantity::Pressure, "kg/cm2", 98066.5),
    unit(Quantity::Pressure, "kgf/cm2", 98066.5),
    unit(Quantity::Pressure, "g/cm2", 98.0665),
    unit(Quantity::Pressure, "N/cm2", 1e4),
    unit(Quantity::Pressure, "N/mm2", 1e6),
    unit(Quantity::Pressure, "N/m2", 1.0),
    unit(Quantity::Pressure, "bar", 1e5),
    unit(Quantity::Pressure, "mbar", 1e2),
    unit(Quantity::Pressure, "atm", 101325.0),
    unit(Quantity::Pressure, "Torr", 101325.0 / 760.0),
    unit(Quantity::Pressure, "lb/in2", 6894.757293168361),
    unit(Quantity::Pressure, "lbf/in2", 6894.757293168361),
];

/// The unit called `symbol`, whatever the case of its letters where that leaves no doubt;
/// `²` and `^2` are `2`.
pub(super) fn find(symbol: &str) -> Option<SignalUnit> {
    let symbol = symbol.trim().replace('²', "2").replace('^', "");
    let exact = UNITS.iter().find(|unit| unit.symbol == symbol);
    exact
        .or_else(|| {
            UNITS
                .iter()
                .find(|unit| unit.symbol.eq_ignore_ascii_case(&symbol))
        })
        .map(|unit| SignalUnit {
            quantity: unit.quantity,
            symbol: unit.symbol.to_owned(),
            si_per_unit: unit.si_per_unit,
        })
}

impl SignalUnit {
    /// The unit that recordings call `symbol`, whatever the case of its letters where that
    /// leaves no doubt.
    ///
    /// ```
    /// use taxel_recording::SignalUnit;
    ///
    /// let unit = SignalUnit::named("pF");
    /// assert_eq!(unit.map(|unit| unit.si_per_unit), Some(1e-12));
    /// ```
    pub fn named(symbol: &str) -> Option<Self> {
        find(symbol)
    }

    /// The units that recordings know, for messages: `aF, fF, pF, …`.
    pub fn symbols() -> String {
        list(|_| true)
    }
}

/// The units of the quantities for which `wanted` is true, for messages.
pub(crate) fn list(wanted: impl Fn(Quantity) -> bool) -> String {
    let symbols: Vec<_> = UNITS
        .iter()
        .filter(|unit| wanted(unit.quantity))
        .map(|unit| unit.symbol)
        .collect();
    symbols.join(", ")
}

/// A unit of length, m.
pub(super) fn length(symbol: &str) -> Option<f64> {
    Some(match symbol.trim().to_ascii_lowercase().as_str() {
        "um" | "micrometers" | "micrometres" => 1e-6,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 1e-3,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 1e-2,
        "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
        "in" | "inch" | "inches" => 0.0254,
        _ => return None,
    })
}

/// Units of length, for messages.
pub(super) const LENGTHS: &str = "mm, cm, centimeters, m, meters, in, inches";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_are_found_in_any_case_and_shown_in_one() {
        for (written, shown) in [
            ("KPa", "kPa"),
            ("PSI", "psi"),
            ("mmhg", "mmHg"),
            ("N/cm²", "N/cm2"),
            ("N/cm^2", "N/cm2"),
        ] {
            assert_eq!(
                find(written).map(|unit| unit.symbol).as_deref(),
                Some(shown)
            );
        }
        assert!(find("furlong").is_none());
    }

    #[test]
    fn pounds_per_square_inch_follow_from_their_definition() {
        let psi = 0.45359237 * 9.80665 / (0.0254 * 0.0254);
        let found = find("psi").map_or(f64::NAN, |unit| unit.si_per_unit);
        // The literal has 16 digits; a few roundings of 1e-16 on the way.
        assert!((found / psi - 1.0).abs() < 1e-15);
    }
}
