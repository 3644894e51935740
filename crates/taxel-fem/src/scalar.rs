//! One arithmetic for single numbers, for several points at once, and for
//! automatic derivatives: a material law is written once, over [`Scalar`].

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number type that a material law computes with.
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A constant.
    fn constant(value: f64) -> Self;
    /// Applies a function that has no arithmetic of its own here, lane by lane.
    #[must_use]
    fn power(self, exponent: f64) -> Self;
    /// The reciprocal of the cube root, for positive numbers.
    #[must_use]
    fn inverse_cube_root(self) -> Self;
    /// Natural logarithm, for positive numbers.
    #[must_use]
    fn logarithm(self) -> Self;
    /// Natural logarithm of one plus a number, with all digits of a small one; not a number
    /// below -1.
    #[must_use]
    fn logarithm_of_one_plus(self) -> Self;
    /// Square root, for numbers not negative.
    #[must_use]
    fn root(self) -> Self;
    /// Applies a function of a single point to each point, for what has no arithmetic
    /// in lanes (principal values, say).
    fn per_point<const IN: usize, const OUT: usize>(
        numbers: &[Self; IN],
        function: impl Fn(&[f64; IN]) -> [f64; OUT],
    ) -> [Self; OUT];
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn power(self, exponent: f64) -> Self {
        libm::pow(self, exponent)
    }
    #[inline(always)]
    fn inverse_cube_root(self) -> Self {
        1.0 / libm::cbrt(self)
    }
    #[inline(always)]
    fn logarithm(self) -> Self {
        libm::log(self)
    }
    #[inline(always)]
    fn logarithm_of_one_plus(self) -> Self {
        libm::log1p(self)
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn per_point<const IN: usize, const OUT: usize>(
        numbers: &[Self; IN],
        function: impl Fn(&[f64; IN]) -> [f64; OUT],
    ) -> [Self; OUT] {
        function(numbers)
    }
}

/// As many points as one wide register holds; all operations act on each.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes(pub [f64; Lanes::COUNT]);

impl Lanes {
    /// Points treated at once.
    pub const COUNT: usize = 8;

    /// `self * factor + other`, fused.
    #[inline(always)]
    #[must_use]
    pub fn times_plus(self, factor: f64, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self([
            a[0].mul_add(factor, b[0]),
            a[1].mul_add(factor, b[1]),
            a[2].mul_add(factor, b[2]),
            a[3].mul_add(factor, b[3]),
            a[4].mul_add(factor, b[4]),
            a[5].mul_add(factor, b[5]),
            a[6].mul_add(factor, b[6]),
            a[7].mul_add(factor, b[7]),
        ])
    }

    /// `self * factor + other` lane by lane, fused.
    #[inline(always)]
    #[must_use]
    pub fn fused(self, factor: Self, other: Self) -> Self {
        let (a, b, c) = (self.0, factor.0, other.0);
        Self([
            a[0].mul_add(b[0], c[0]),
            a[1].mul_add(b[1], c[1]),
            a[2].mul_add(b[2], c[2]),
            a[3].mul_add(b[3], c[3]),
            a[4].mul_add(b[4], c[4]),
            a[5].mul_add(b[5], c[5]),
            a[6].mul_add(b[6], c[6]),
            a[7].mul_add(b[7], c[7]),
        ])
    }

    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }
}

/// An operation on each lane, spelled out: a closure or an iterator that is not
/// inlined into the loop around a law would not be compiled for its registers.
macro_rules! each_lane {
    ($name:ident, $function:ident, $operator:tt) => {
        impl $name for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                let (a, b) = (self.0, other.0);
                Self([
                    a[0] $operator b[0],
                    a[1] $operator b[1],
                    a[2] $operator b[2],
                    a[3] $operator b[3],
                    a[4] $operator b[4],
                    a[5] $operator b[5],
                    a[6] $operator b[6],
                    a[7] $operator b[7],
                ])
            }
        }
    };
}
each_lane!(Add, add, +);
each_lane!(Sub, sub, -);
each_lane!(Mul, mul, *);
each_lane!(Div, div, /);
impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let a = self.0;
        Self([-a[0], -a[1], -a[2], -a[3], -a[4], -a[5], -a[6], -a[7]])
    }
}
impl Scalar for Lanes {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self([value; Self::COUNT])
    }
    #[inline(always)]
    fn power(self, exponent: f64) -> Self {
        self.map(|a| libm::pow(a, exponent))
    }
    #[inline(always)]
    fn inverse_cube_root(self) -> Self {
        // Volume ratios are near one: Newton's method on y^-3 = a from the tangent
        // stays in the registers; its error of 0.023 at most falls to 1e-3, 2e-6,
        // 1e-11 and below the rounding. Numbers far from one go one by one.
        let mut near = true;
        for lane in 0..Self::COUNT {
            near &= (self.0[lane] - 1.0).abs() < 0.3;
        }
        if !near {
            return self.map(|a| 1.0 / libm::cbrt(a));
        }
        let third = self * Self::constant(1.0 / 3.0);
        let four_thirds = Self::constant(4.0 / 3.0);
        let mut y = four_thirds - third;
        for _ in 0..4 {
            y = y * (four_thirds - third * y * y * y);
        }
        y
    }
    #[inline(always)]
    fn logarithm(self) -> Self {
        self.map(libm::log)
    }
    #[inline(always)]
    fn logarithm_of_one_plus(self) -> Self {
        self.map(libm::log1p)
    }
    #[inline(always)]
    fn root(self) -> Self {
        let a = self.0;
        Self([
            a[0].sqrt(),
            a[1].sqrt(),
            a[2].sqrt(),
            a[3].sqrt(),
            a[4].sqrt(),
            a[5].sqrt(),
            a[6].sqrt(),
            a[7].sqrt(),
        ])
    }
    #[inline(always)]
    fn per_point<const IN: usize, const OUT: usize>(
        numbers: &[Self; IN],
        function: impl Fn(&[f64; IN]) -> [f64; OUT],
    ) -> [Self; OUT] {
        let mut answers = [Self::constant(0.0); OUT];
        for lane in 0..Self::COUNT {
            let answer = function(&std::array::from_fn(|n| numbers[n].0[lane]));
            for n in 0..OUT {
                answers[n].0[lane] = answer[n];
            }
        }
        answers
    }
}

/// A 3 x 3 tensor, row first.
pub type Tensor<S> = [[S; 3]; 3];

/// A symmetric tensor in the order 11, 22, 33, 12, 23, 13.
pub type Symmetric<S> = [S; 6];

/// Rows and columns of the six entries of a [`Symmetric`].
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Place of entry `(row, column)` in a [`Symmetric`].
pub const PLACE: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

/// Determinant.
#[inline(always)]
pub fn determinant<S: Scalar>(a: &Tensor<S>) -> S {
    a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1])
        - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0])
        + a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0])
}

/// Inverse by cofactors, given the determinant.
#[inline(always)]
pub fn inverse<S: Scalar>(a: &Tensor<S>, determinant: S) -> Tensor<S> {
    let r = S::constant(1.0) / determinant;
    let m = |i: usize, j: usize, k: usize, l: usize| (a[i][j] * a[k][l] - a[i][l] * a[k][j]) * r;
    [
        [m(1, 1, 2, 2), m(0, 2, 2, 1), m(0, 1, 1, 2)],
        [m(1, 2, 2, 0), m(0, 0, 2, 2), m(0, 2, 1, 0)],
        [m(1, 0, 2, 1), m(0, 1, 2, 0), m(0, 0, 1, 1)],
    ]
}

/// `b = F F^T`, the left Cauchy-Green tensor.
#[inline(always)]
pub fn left_cauchy_green<S: Scalar>(f: &Tensor<S>) -> Symmetric<S> {
    let dot = |i: usize, j: usize| f[i][0] * f[j][0] + f[i][1] * f[j][1] + f[i][2] * f[j][2];
    [
        dot(0, 0),
        dot(1, 1),
        dot(2, 2),
        dot(0, 1),
        dot(1, 2),
        dot(0, 2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_times_its_tensor_is_the_identity() {
        let f = [[1.2, 0.3, -0.1], [0.05, 0.8, 0.2], [-0.3, 0.1, 1.5]];
        let g = inverse(&f, determinant(&f));
        for i in 0..3 {
            for j in 0..3 {
                let entry: f64 = (0..3).map(|k| g[i][k] * f[k][j]).sum();
                assert!((entry - f64::from(u8::from(i == j))).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn the_lanes_take_the_cube_root_of_each() {
        let near = Lanes([0.71, 0.8, 0.9, 1.0, 1.1, 1.2, 1.25, 1.29]);
        let far = Lanes([0.1, 0.8, 0.9, 1.0, 1.1, 1.2, 5.0, 50.0]);
        for numbers in [near, far] {
            let found = numbers.inverse_cube_root();
            for lane in 0..Lanes::COUNT {
                let expected = 1.0 / libm::cbrt(numbers.0[lane]);
                assert!((found.0[lane] / expected - 1.0).abs() < 1e-15);
            }
        }
    }
}
