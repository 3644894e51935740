//! Spreads of made devices and limits of answers.

use crate::exponents::{Exponents, NONE, quantity_of};
use crate::file::{Bound, LimitFile, SpreadFile};

/// Distribution of a made value about the drawn one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Its shape.
    pub shape: Shape,
    /// Half width or standard deviation: SI, or a share of the drawn value.
    pub size: f64,
    /// True if the size is a share of the drawn value.
    pub relative: bool,
}

/// Shape of a distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Even within plus or minus the size.
    Uniform,
    /// Normal with the size as standard deviation.
    Normal,
    /// A triangle within plus or minus the size.
    Triangular,
    /// Its logarithm is normal with the size as standard deviation.
    Lognormal {
        /// Logarithm of the median over the drawn value.
        median: f64,
    },
}

/// Limits of one answer, SI.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limit {
    /// Greatest value.
    pub at_most: Option<f64>,
    /// Least value.
    pub at_least: Option<f64>,
    /// Greatest difference from the nominal answer, and whether it is a share of it.
    pub within: Option<(f64, bool)>,
}

/// A size: SI, or a share of a value; whether a share may stand here is `shares`.
fn size(bound: &Bound, exponents: Exponents, shares: bool) -> Result<(f64, bool), String> {
    let needed = if shares {
        format!("{} or a percentage", exponents.name())
    } else {
        exponents.name()
    };
    let found = match bound {
        Bound::Text(text) => match text.trim().strip_suffix('%') {
            Some(percent) => {
                let number: Option<f64> = percent.trim().parse().ok();
                let number = number.ok_or_else(|| format!("\"{text}\" is no percentage"))?;
                (number / 100.0, true)
            }
            None => match quantity_of(text) {
                Some((dimension, _, si)) if Exponents::of(dimension) == exponents => (si, false),
                Some((dimension, _, _)) => {
                    return Err(format!(
                        "\"{text}\" is {}; {needed} is needed here",
                        dimension.name
                    ));
                }
                None => return Err(format!("\"{text}\" is neither a quantity nor a percentage")),
            },
        },
        Bound::Number(number) if exponents == NONE => (*number, false),
        Bound::Whole(whole) if exponents == NONE => (*whole as f64, false),
        _ => return Err(format!("{} with its unit is needed here", exponents.name())),
    };
    if found.0.is_finite() {
        Ok(found)
    } else {
        Err(String::from("the size is not finite"))
    }
}

impl SpreadFile {
    /// Key of the size.
    pub(crate) fn key(&self) -> &'static str {
        match self {
            Self::Uniform(_) => "uniform",
            Self::Normal(_) => "normal",
            Self::Triangular(_) => "triangular",
            Self::Lognormal(_) => "lognormal",
        }
    }
}

impl Spread {
    /// Reads a spread of a value of the dimension `exponents`.
    pub(crate) fn read(written: &SpreadFile, exponents: Exponents) -> Result<Self, String> {
        let (shape, bound) = match written {
            SpreadFile::Uniform(bound) => (Shape::Uniform, bound),
            SpreadFile::Normal(bound) => (Shape::Normal, bound),
            SpreadFile::Triangular(bound) => (Shape::Triangular, bound),
            SpreadFile::Lognormal(bound) => (Shape::Lognormal { median: 0.0 }, bound),
        };
        let (size, relative) = size(bound, exponents, true)?;
        if size <= 0.0 {
            return Err(format!("a spread of {size} is not above zero"));
        }
        if matches!(shape, Shape::Lognormal { .. }) && !relative {
            return Err(String::from("a lognormal spread is a percentage"));
        }
        Ok(Self {
            shape,
            size,
            relative,
        })
    }

    fn scale(&self, drawn: f64) -> f64 {
        if self.relative {
            self.size * drawn.abs()
        } else {
            self.size
        }
    }

    /// The made value at the share `u` of the distribution, 0 to 1, with its width times
    /// `factor`.
    pub fn value(&self, drawn: f64, u: f64, factor: f64) -> f64 {
        let scale = factor * self.scale(drawn);
        match self.shape {
            Shape::Uniform => drawn + scale * (2.0 * u - 1.0),
            Shape::Normal => drawn + scale * normal_quantile(u),
            Shape::Triangular if u < 0.5 => drawn + scale * ((2.0 * u).sqrt() - 1.0),
            Shape::Triangular => drawn + scale * (1.0 - (2.0 * (1.0 - u)).sqrt()),
            Shape::Lognormal { median } => {
                drawn * (median + factor * self.size * normal_quantile(u)).exp()
            }
        }
    }

    /// Share of the distribution below `value`.
    pub fn below(&self, drawn: f64, value: f64) -> f64 {
        let x = (value - drawn) / self.scale(drawn);
        match self.shape {
            Shape::Uniform => (0.5 * (x + 1.0)).clamp(0.0, 1.0),
            Shape::Normal => normal_below(x),
            Shape::Triangular if x < 0.0 => 0.5 * (1.0 + x).max(0.0).powi(2),
            Shape::Triangular => 1.0 - 0.5 * (1.0 - x).max(0.0).powi(2),
            Shape::Lognormal { .. } if value <= 0.0 => 0.0,
            Shape::Lognormal { median } => {
                normal_below(((value / drawn).ln() - median) / self.size)
            }
        }
    }
}

impl Limit {
    /// Reads the limits of an answer of the dimension `exponents`.
    ///
    /// # Errors
    /// The key that is wrong, none if there is no limit, and a sentence.
    pub(crate) fn read(
        written: &LimitFile,
        exponents: Exponents,
    ) -> Result<Self, (Option<&'static str>, String)> {
        let absolute = |key, bound: &Option<Bound>| match bound {
            None => Ok(None),
            Some(bound) => match size(bound, exponents, false) {
                Ok((value, false)) => Ok(Some(value)),
                Ok((_, true)) => Err((Some(key), "a percentage belongs to within".into())),
                Err(message) => Err((Some(key), message)),
            },
        };
        let within = written.within.as_ref();
        let within = within.map(|bound| size(bound, exponents, true));
        let limit = Self {
            at_most: absolute("at_most", &written.at_most)?,
            at_least: absolute("at_least", &written.at_least)?,
            within: within
                .transpose()
                .map_err(|message| (Some("within"), message))?,
        };
        if limit == Self::default() {
            return Err((None, String::from("no limit is given")));
        }
        Ok(limit)
    }

    /// True if `value` is within the limits; what is not a number is not.
    pub fn holds(&self, value: f64, nominal: f64) -> bool {
        let width = self.width(nominal);
        value.is_finite()
            && self.at_most.is_none_or(|most| value <= most)
            && self.at_least.is_none_or(|least| value >= least)
            && width.is_none_or(|width| (value - nominal).abs() <= width)
    }

    /// Greatest difference from the nominal answer.
    pub fn width(&self, nominal: f64) -> Option<f64> {
        self.within
            .map(|(size, relative)| if relative { size * nominal.abs() } else { size })
    }
}

/// Φ(x): share of the standard normal distribution below `x`.
pub(crate) fn normal_below(x: f64) -> f64 {
    0.5 * libm::erfc(-x / std::f64::consts::SQRT_2)
}

/// The place below which the share `u` of the standard normal distribution lies.
pub(crate) fn normal_quantile(u: f64) -> f64 {
    // Beyond 38 standard deviations nothing is left of a double.
    let (mut low, mut high) = (-38.0, 38.0);
    let mut x = 0.0;
    for _ in 0..200 {
        let excess = normal_below(x) - u;
        if excess > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let density = (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let newton = x - excess / density;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - x).abs() <= 1e-15 * (1.0 + x.abs()) {
            return next;
        }
        x = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_invert_the_distribution() {
        for shape in [
            Shape::Uniform,
            Shape::Normal,
            Shape::Triangular,
            Shape::Lognormal { median: 0.02 },
        ] {
            let spread = Spread {
                shape,
                size: 0.1,
                relative: true,
            };
            for u in [0.01, 0.3, 0.5, 0.77, 0.999] {
                let value = spread.value(6e-6, u, 1.0);
                assert!(
                    (spread.below(6e-6, value) - u).abs() < 1e-12,
                    "{shape:?} {u}"
                );
            }
        }
        // Table of the normal distribution.
        assert!((normal_quantile(0.975) - 1.959963984540054).abs() < 1e-12);
    }

    #[test]
    fn a_limit_without_a_value_does_not_hold() {
        let limit = Limit {
            within: Some((0.05, true)),
            ..Limit::default()
        };
        assert!(limit.holds(104.9, 100.0) && !limit.holds(105.1, 100.0));
        assert!(!limit.holds(f64::NAN, 100.0));
    }
}
