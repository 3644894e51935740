//! Dimensions as exponents of metre, kilogram, second, ampere and kelvin.

use taxel::quantity::{self, Dimension};

/// Exponents of m, kg, s, A, K.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponents(pub [f64; 5]);

/// Of a plain number.
pub const NONE: Exponents = Exponents([0.0; 5]);

/// SI units by the symbol that ends a key, and by that of files.
const UNITS: &[(&str, [f64; 5])] = &[
    ("m", [1.0, 0.0, 0.0, 0.0, 0.0]),
    ("s", [0.0, 0.0, 1.0, 0.0, 0.0]),
    ("hz", [0.0, 0.0, -1.0, 0.0, 0.0]),
    ("n", [1.0, 1.0, -2.0, 0.0, 0.0]),
    ("pa", [-1.0, 1.0, -2.0, 0.0, 0.0]),
    ("f", [-2.0, -1.0, 4.0, 2.0, 0.0]),
    ("kg", [0.0, 1.0, 0.0, 0.0, 0.0]),
    ("c", [0.0, 0.0, 1.0, 1.0, 0.0]),
    ("ohm", [2.0, 1.0, -3.0, -2.0, 0.0]),
    ("siemens", [-2.0, -1.0, 3.0, 2.0, 0.0]),
    ("v", [2.0, 1.0, -3.0, -1.0, 0.0]),
    ("j", [2.0, 1.0, -2.0, 0.0, 0.0]),
    ("t", [0.0, 1.0, -2.0, -1.0, 0.0]),
    ("k", [0.0, 0.0, 0.0, 0.0, 1.0]),
    ("rad", [0.0; 5]),
    ("share", [0.0; 5]),
    ("ratio", [0.0; 5]),
    ("1", [0.0; 5]),
    ("", [0.0; 5]),
];

impl Exponents {
    /// Of a unit as it ends a key of JSON, such as `n_per_m`; none for one that is not known.
    pub fn of_key(key: &str) -> Option<Self> {
        let mut sum = [0.0; 5];
        let mut sign = 1.0;
        for word in key.split('_') {
            if word == "per" {
                sign = -1.0;
                continue;
            }
            let (base, power) = match word.strip_suffix(['2', '3']) {
                Some(base) => (base, if word.ends_with('2') { 2.0 } else { 3.0 }),
                None => (word, 1.0),
            };
            let (_, unit) = UNITS.iter().find(|(name, _)| *name == base)?;
            for (total, exponent) in sum.iter_mut().zip(unit) {
                *total += sign * power * exponent;
            }
        }
        Some(Self(sum))
    }

    /// Of a dimension of files.
    pub fn of(dimension: &Dimension) -> Self {
        // In small letters the siemens would be a second.
        let key = match dimension.si {
            "S" => String::from("siemens"),
            si => si.to_lowercase(),
        };
        let key = key.replace('/', "_per_").replace(' ', "_");
        // Every unit of files is made of those above.
        Self::of_key(&key).unwrap_or(NONE)
    }

    /// The dimension of files that this is.
    pub fn dimension(self) -> Option<&'static Dimension> {
        quantity::dimensions().find(|dimension| Self::of(dimension) == self)
    }

    /// Name for messages: `a length`, `a plain number`, or the exponents.
    pub fn name(self) -> String {
        if self == NONE {
            return String::from("a plain number");
        }
        self.dimension()
            .map_or_else(|| self.unit(), |dimension| dimension.name.to_owned())
    }

    /// The product of base units, such as `kg m^-1 s^-2`.
    pub fn unit(self) -> String {
        let parts = ["m", "kg", "s", "A", "K"].iter().zip(self.0);
        let parts = parts.filter(|(_, power)| *power != 0.0);
        let words: Vec<_> = parts
            .map(|(name, power)| {
                if power == 1.0 {
                    (*name).to_owned()
                } else {
                    format!("{name}^{power}")
                }
            })
            .collect();
        words.join(" ")
    }

    pub(crate) fn plus(self, other: Self, sign: f64) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + sign * other.0[i]))
    }

    pub(crate) fn times(self, power: f64) -> Self {
        Self(self.0.map(|exponent| exponent * power))
    }
}

/// The dimension and SI value of a text such as `"20 um"`; none for other text.
pub(crate) fn quantity_of(text: &str) -> Option<(&'static Dimension, &'static str, f64)> {
    let trimmed = text.trim();
    let symbol = trimmed
        .trim_start_matches(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | ' '));
    // An exponent belongs to the number.
    let symbol = match symbol.strip_prefix(['e', 'E']) {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+') => {
            rest.trim_start_matches(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | ' '))
        }
        _ => symbol,
    };
    if symbol.len() == trimmed.len() {
        return None;
    }
    quantity::dimensions().find_map(|dimension| {
        let (unit, _) = dimension.entry(symbol)?;
        Some((dimension, unit, dimension.parse(trimmed).ok()?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_dimension_of_files_has_exponents_of_its_own() {
        for dimension in quantity::dimensions() {
            let found = Exponents::of(dimension).dimension();
            assert_eq!(found.map(|found| found.name), Some(dimension.name));
        }
    }

    #[test]
    fn texts_with_units_are_quantities() {
        for (text, si) in [("20 um", 20e-6), ("1e3 N", 1e3), ("2.5e-2 kPa", 25.0)] {
            let (_, _, value) = quantity_of(text).unwrap_or_else(|| panic!("{text}"));
            assert!((value / si - 1.0).abs() < 1e-15, "{text}");
        }
        for word in ["free", "short_layer", "20", "20 furlong", ""] {
            assert!(quantity_of(word).is_none(), "{word}");
        }
    }
}
