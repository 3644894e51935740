//! Numbers that carry two first derivatives and their mixed second one: they derive an energy
//! that is given as a function, and are the independent judge of stresses and tangents that
//! were derived by hand.

use crate::scalar::Scalar;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `value + first x + second y + mixed x y` with `x^2 = y^2 = 0` (a hyper-dual number, Fike and
/// Alonso 2011): a function of such numbers comes with its derivatives, exact to rounding.
///
/// ```
/// use taxel_fem::material::Dual;
///
/// let two = Dual::from(2.0);
/// assert_eq!((two * 3.0 + 1.0).value(), 7.0);
/// assert_eq!((two.powf(3.0) - two.exp() / two.exp()).value(), 7.0);
/// ```
#[derive(Clone, Copy, Debug)]
#[must_use]
pub struct Dual {
    pub(super) value: f64,
    pub(super) first: f64,
    pub(super) second: f64,
    pub(super) mixed: f64,
}

impl Dual {
    /// The number without its derivatives.
    pub fn value(self) -> f64 {
        self.value
    }

    /// Power of a positive number.
    pub fn powf(self, exponent: f64) -> Self {
        self.power(exponent)
    }

    /// Square root of a positive number.
    pub fn sqrt(self) -> Self {
        self.power(0.5)
    }

    /// Exponential function.
    pub fn exp(self) -> Self {
        let value = libm::exp(self.value);
        self.through(value, value, value)
    }

    /// Natural logarithm of a positive number.
    pub fn ln(self) -> Self {
        self.logarithm()
    }

    /// A function of this number, from its value and its two derivatives there.
    fn through(self, value: f64, slope: f64, curvature: f64) -> Self {
        Self {
            value,
            first: slope * self.first,
            second: slope * self.second,
            mixed: slope * self.mixed + curvature * self.first * self.second,
        }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            first: self.first + other.first,
            second: self.second + other.second,
            mixed: self.mixed + other.mixed,
        }
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self.through(-self.value, -1.0, 0.0)
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            first: self.first * other.value + self.value * other.first,
            second: self.second * other.value + self.value * other.second,
            mixed: self.mixed * other.value
                + self.first * other.second
                + self.second * other.first
                + self.value * other.mixed,
        }
    }
}
impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        self * other.power(-1.0)
    }
}
impl From<f64> for Dual {
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}
impl Add<f64> for Dual {
    type Output = Self;
    fn add(self, other: f64) -> Self {
        self + Self::constant(other)
    }
}
impl Sub<f64> for Dual {
    type Output = Self;
    fn sub(self, other: f64) -> Self {
        self + Self::constant(-other)
    }
}
impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, other: f64) -> Self {
        self * Self::constant(other)
    }
}
impl Mul<Dual> for f64 {
    type Output = Dual;
    fn mul(self, other: Dual) -> Dual {
        other * self
    }
}
impl Scalar for Dual {
    fn constant(value: f64) -> Self {
        Self {
            value,
            first: 0.0,
            second: 0.0,
            mixed: 0.0,
        }
    }
    fn power(self, n: f64) -> Self {
        let of = |n: f64| self.value.powf(n);
        self.through(of(n), n * of(n - 1.0), n * (n - 1.0) * of(n - 2.0))
    }
    fn inverse_cube_root(self) -> Self {
        self.power(-1.0 / 3.0)
    }
    fn logarithm(self) -> Self {
        let slope = 1.0 / self.value;
        self.through(self.value.ln(), slope, -slope * slope)
    }
    fn logarithm_of_one_plus(self) -> Self {
        let slope = 1.0 / (1.0 + self.value);
        self.through(libm::log1p(self.value), slope, -slope * slope)
    }
    fn root(self) -> Self {
        self.power(0.5)
    }
    /// Values without derivatives: what asks for those gets no number.
    fn per_point<const IN: usize, const OUT: usize>(
        numbers: &[Self; IN],
        function: impl Fn(&[f64; IN]) -> [f64; OUT],
    ) -> [Self; OUT] {
        function(&numbers.map(|number| number.value))
            .map(|value| Self::constant(value).through(value, f64::NAN, f64::NAN))
    }
}
