//! Laws in the invariants of the isochoric left Cauchy-Green tensor, with an
//! energy `W = w(I1bar) + c2 I2bar`.
//!
//! Sums are written out entry by entry: a loop or a closure is not unrolled into
//! the wide registers of the loop over points, and costs a factor of ten.

use super::Response;
use crate::scalar::{PAIRS, PLACE, Scalar, Symmetric, Tensor, determinant, left_cauchy_green};

/// `b = J^-2/3 F F^T` with its invariants.
pub(super) struct Isochoric<S> {
    b: Symmetric<S>,
    square: Symmetric<S>,
    pub(super) first: S,
    pub(super) second: S,
}

/// The energy at a point, with its derivatives for the first invariant; Pa.
pub(super) struct Slopes<S> {
    pub(super) energy: S,
    pub(super) first: S,
    pub(super) curvature: S,
}

/// Parts of the entries of the tangent, see [`response`].
struct Parts<S> {
    b: Symmetric<S>,
    /// `s = dev b` and `4 w'' s`.
    deviator: Symmetric<S>,
    bent: Symmetric<S>,
    side: Symmetric<S>,
    same: S,
    second: S,
}

#[inline(always)]
pub(super) fn isochoric<S: Scalar>(f: &Tensor<S>) -> Isochoric<S> {
    let r = determinant(f).inverse_cube_root();
    with_invariants(scaled(&left_cauchy_green(f), r * r))
}

/// The same from `F F^T`.
pub(super) fn of_left(b: &Symmetric<f64>) -> Isochoric<f64> {
    let full = std::array::from_fn(|i| std::array::from_fn(|j| b[PLACE[i][j]]));
    with_invariants(scaled(b, determinant(&full).inverse_cube_root()))
}

#[inline(always)]
fn with_invariants<S: Scalar>(b: Symmetric<S>) -> Isochoric<S> {
    let square = square(&b);
    let first = b[0] + b[1] + b[2];
    Isochoric {
        b,
        square,
        first,
        second: (first * first - (square[0] + square[1] + square[2])) * S::constant(0.5),
    }
}

impl Isochoric<f64> {
    /// `dev b` and `dev (I1 b - b^2)`: half of what the invariants change with a rate of strain.
    pub(super) fn slopes(&self) -> [Symmetric<f64>; 2] {
        let second = sum(&scaled(&self.b, self.first), &scaled(&self.square, -1.0));
        let mean = |a: &Symmetric<f64>| (a[0] + a[1] + a[2]) / 3.0;
        [
            deviator(&self.b, mean(&self.b)),
            deviator(&second, mean(&second)),
        ]
    }
}

/// Energy, stress and tangent from the derivatives `w'`, `w''` and `c2`.
///
/// With `s = dev b`, `T = 2 (w' b + c2 (I1 b - b^2))` and `tau = dev T`:
/// `c = 4 w'' s x s + dev [4 c2 (b x b - b.b)] + 2/3 tr T (Is - 1 x 1 / 3)
///    - 2/3 (tau x 1 + 1 x tau)` (Holzapfel 2000, section 6.6, moved
/// to space), where `(b.b)_ijkl = (b_ik b_jl + b_il b_jk) / 2` and its deviator on both
/// sides is `b.b - (b^2 x 1 + 1 x b^2) / 3 + tr b^2 / 9 1 x 1`.
#[inline(always)]
pub(super) fn response<S: Scalar>(at: &Isochoric<S>, w: &Slopes<S>, c2: f64) -> Response<S> {
    let k = S::constant;
    let (a1, a2) = (w.first * k(2.0), k(2.0 * c2));
    let slope = a1 + a2 * at.first;
    let deviator = deviator(&at.b, at.first * k(1.0 / 3.0));
    let total = sum(&scaled(&at.b, slope), &scaled(&at.square, -a2));
    let trace = total[0] + total[1] + total[2];
    let stress = self::deviator(&total, trace * k(1.0 / 3.0));
    let same = trace * k(2.0 / 3.0);
    // Half of the factor of 1 x 1 goes to each side.
    let squares = at.square[0] + at.square[1] + at.square[2];
    let unit = same * k(1.0 / 6.0) + a2 * squares * k(1.0 / 9.0);
    let side = sum(
        &scaled(&stress, k(-2.0 / 3.0)),
        &scaled(&at.square, a2 * k(2.0 / 3.0)),
    );
    let parts = Parts {
        b: at.b,
        deviator,
        bent: scaled(&deviator, (w.curvature + k(c2)) * k(4.0)),
        side: self::deviator(&side, unit),
        same,
        second: a2,
    };
    Response {
        energy: w.energy,
        stress,
        tangent: table(&parts),
    }
}

/// Entry of the tangent; rows and columns as in [`PAIRS`].
#[inline(always)]
fn entry<S: Scalar>(parts: &Parts<S>, v: usize, w: usize) -> S {
    let (i, j) = PAIRS[v];
    let (m, n) = PAIRS[w];
    let b = |i: usize, j: usize| parts.b[PLACE[i][j]];
    // Twice (b.b); the two products are the same where a pair repeats an index.
    let product = if i == j || m == n {
        b(i, m) * b(j, n) * S::constant(2.0)
    } else {
        b(i, m) * b(j, n) + b(i, n) * b(j, m)
    };
    let mut entry = parts.bent[v] * parts.deviator[w] - parts.second * product;
    if v < 3 {
        entry = entry + parts.side[w];
    }
    if w < 3 {
        entry = entry + parts.side[v];
    }
    if v == w {
        entry = entry + parts.same * S::constant(if v < 3 { 1.0 } else { 0.5 });
    }
    entry
}

/// The tangent from the 21 entries of its upper triangle.
#[inline(always)]
fn table<S: Scalar>(parts: &Parts<S>) -> [[S; 6]; 6] {
    let [e00, e01, e02] = [entry(parts, 0, 0), entry(parts, 0, 1), entry(parts, 0, 2)];
    let [e03, e04, e05] = [entry(parts, 0, 3), entry(parts, 0, 4), entry(parts, 0, 5)];
    let [e11, e12, e13] = [entry(parts, 1, 1), entry(parts, 1, 2), entry(parts, 1, 3)];
    let [e14, e15, e22] = [entry(parts, 1, 4), entry(parts, 1, 5), entry(parts, 2, 2)];
    let [e23, e24, e25] = [entry(parts, 2, 3), entry(parts, 2, 4), entry(parts, 2, 5)];
    let [e33, e34, e35] = [entry(parts, 3, 3), entry(parts, 3, 4), entry(parts, 3, 5)];
    let [e44, e45, e55] = [entry(parts, 4, 4), entry(parts, 4, 5), entry(parts, 5, 5)];
    [
        [e00, e01, e02, e03, e04, e05],
        [e01, e11, e12, e13, e14, e15],
        [e02, e12, e22, e23, e24, e25],
        [e03, e13, e23, e33, e34, e35],
        [e04, e14, e24, e34, e44, e45],
        [e05, e15, e25, e35, e45, e55],
    ]
}

/// `b^2` of a symmetric tensor.
#[inline(always)]
fn square<S: Scalar>(b: &Symmetric<S>) -> Symmetric<S> {
    let (xy, yz, xz) = (b[3] * b[3], b[4] * b[4], b[5] * b[5]);
    [
        b[0] * b[0] + xy + xz,
        b[1] * b[1] + xy + yz,
        b[2] * b[2] + xz + yz,
        b[3] * (b[0] + b[1]) + b[5] * b[4],
        b[4] * (b[1] + b[2]) + b[3] * b[5],
        b[5] * (b[0] + b[2]) + b[3] * b[4],
    ]
}

#[inline(always)]
fn scaled<S: Scalar>(a: &Symmetric<S>, r: S) -> Symmetric<S> {
    [a[0] * r, a[1] * r, a[2] * r, a[3] * r, a[4] * r, a[5] * r]
}

#[inline(always)]
fn sum<S: Scalar>(a: &Symmetric<S>, b: &Symmetric<S>) -> Symmetric<S> {
    [
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
    ]
}

/// A tensor less a multiple of the identity.
#[inline(always)]
fn deviator<S: Scalar>(a: &Symmetric<S>, mean: S) -> Symmetric<S> {
    [a[0] - mean, a[1] - mean, a[2] - mean, a[3], a[4], a[5]]
}
