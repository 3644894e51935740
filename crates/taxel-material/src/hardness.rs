//! From a Shore number to a modulus of elasticity, with the interval that it has.

/// Scale of a durometer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Shore A.
    A,
    /// Shore 00.
    DoubleZero,
}

/// A hardness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hardness {
    /// Scale.
    pub scale: Scale,
    /// Shore number.
    pub shore: f64,
}

/// A text that is no hardness.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "\"{given}\" is no hardness: write \"30 A\" or \"00-30\", with a number above 0 and below 100"
)]
pub struct HardnessError {
    /// The text.
    pub given: String,
}

/// Median over the relation of Gent, and the factor of 95 % for the next silicone: 11 products of
/// one laboratory (Marechal et al. 2020) and both ends of Johnston et al. 2014.
const A: (f64, f64, [f64; 2]) = (0.52, 1.93, [2.0, 55.0]);
/// The same over Hertz's contact of the 00 tip: seven values.
const DOUBLE_ZERO: (f64, f64, [f64; 2]) = (0.64, 3.4, [10.0, 50.0]);

impl Hardness {
    /// Reads `"30 A"`, `"Shore A 30"`, `"00-30"` or `"30 00"`.
    ///
    /// # Errors
    /// [`HardnessError`]
    ///
    /// # Example
    /// ```
    /// use taxel_material::Hardness;
    ///
    /// let modulus = Hardness::parse("30 A")?.modulus();
    /// assert!((modulus.value / 1e6 - 0.59).abs() < 0.005);
    /// assert!(Hardness::parse("30 D").is_err());
    /// # Ok::<(), taxel_material::HardnessError>(())
    /// ```
    pub fn parse(text: &str) -> Result<Self, HardnessError> {
        let wrong = || HardnessError {
            given: text.to_owned(),
        };
        let plain = text
            .to_ascii_lowercase()
            .replace("shore", " ")
            .replace('-', " ");
        let words: Vec<&str> = plain.split_whitespace().collect();
        let (scale, number) = match words.as_slice() {
            ["a", number] | [number, "a"] => (Scale::A, *number),
            ["00" | "oo", number] | [number, "00" | "oo"] => (Scale::DoubleZero, *number),
            [joined] => (Scale::A, joined.strip_suffix('a').ok_or_else(wrong)?),
            _ => return Err(wrong()),
        };
        let shore: f64 = number.parse().map_err(|_| wrong())?;
        if shore > 0.0 && shore < 100.0 {
            Ok(Self { scale, shore })
        } else {
            Err(wrong())
        }
    }

    /// Modulus of elasticity by the formula of the durometer alone, Pa: Gent's for A, Hertz's
    /// for 00.
    pub fn formula(&self) -> f64 {
        let s = self.shore;
        match self.scale {
            Scale::A => 0.0981e6 * (56.0 + 7.62336 * s) / (0.137505 * (254.0 - 2.54 * s)),
            Scale::DoubleZero => {
                let (force, radius) = (0.203 + 0.00908 * s, 1.19e-3_f64);
                let depth = 2.54e-3 * (1.0 - s / 100.0);
                9.0 / 16.0 * force / (radius.sqrt() * depth.powf(1.5))
            }
        }
    }

    /// `log10 E [MPa] = 0.0235 S - 0.6403`, which some give beside Gent's formula for A, Pa.
    pub fn logarithmic(&self) -> f64 {
        1e6 * libm::pow(10.0, 0.0235 * self.shore - 0.6403)
    }

    /// The modulus of silicones of this hardness.
    pub fn modulus(&self) -> Modulus {
        let (share, factor, [low, high]) = match self.scale {
            Scale::A => A,
            Scale::DoubleZero => DOUBLE_ZERO,
        };
        let value = share * self.formula();
        Modulus {
            value,
            interval: [value / factor, value * factor],
            range: [low, high],
            within: (low..=high).contains(&self.shore),
        }
    }
}

/// A modulus of elasticity that follows from a hardness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modulus {
    /// Modulus of elasticity, Pa.
    pub value: f64,
    /// 95 % for the next silicone, Pa.
    pub interval: [f64; 2],
    /// Shore numbers that the relation was fitted to.
    pub range: [f64; 2],
    /// True if the hardness is within them; else only the formula stands.
    pub within: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hardness_gives_the_printed_moduli() {
        let of = |text| Hardness::parse(text).expect("a hardness");
        // Half of the last printed digit everywhere.
        let thirty = of("30 A");
        assert!((thirty.formula() / 1e6 - 1.142).abs() < 5e-4);
        assert!((thirty.logarithmic() / 1e6 - 1.161).abs() < 5e-4);
        let modulus = thirty.modulus();
        assert!((modulus.interval[0] / 1e6 - 0.31).abs() < 5e-3);
        assert!((modulus.interval[1] / 1e6 - 1.15).abs() < 5e-3);
        let soft = of("00-30");
        assert!((soft.formula() / 1e6 - 0.1034).abs() < 5e-5);
        assert!((soft.modulus().value / 1e6 - 0.066).abs() < 5e-4);
        assert!((soft.modulus().interval[0] / 1e6 - 0.020).abs() < 1e-3);
        assert!((soft.modulus().interval[1] / 1e6 - 0.23).abs() < 6e-3);
        assert!(!of("60 A").modulus().within);
        assert_eq!(of("shore 00-30"), of("30 00"));
    }
}
