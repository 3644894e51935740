//! Laws in the invariants of the isochoric left Cauchy-Green tensor.

use super::Response;
use crate::scalar::{PAIRS, PLACE, Scalar, Symmetric, Tensor, determinant, left_cauchy_green};

/// `b^2` of a symmetric tensor.
#[inline(always)]
fn square<S: Scalar>(b: &Symmetric<S>) -> Symmetric<S> {
    std::array::from_fn(|v| {
        let (i, j) = PAIRS[v];
        b[PLACE[i][0]] * b[PLACE[0][j]]
            + b[PLACE[i][1]] * b[PLACE[1][j]]
            + b[PLACE[i][2]] * b[PLACE[2][j]]
    })
}

/// Energy, stress and tangent of `W = c10 (I1bar - 3) + c01 (I2bar - 3)`.
///
/// With `b = J^-2/3 F F^T`, `B2 = I1 b - b^2` and `d2B`, the tangent of `B2`:
/// `tau = 2 dev(c10 b + c01 B2)`; `c` from the chain rule with the factors
/// `-2/3` and `-4/3` that the volume ratio contributes.
#[inline(always)]
pub(super) fn mooney_rivlin<S: Scalar>(f: &Tensor<S>, c10: f64, c01: f64) -> Response<S> {
    let k = S::constant;
    let r = determinant(f).inverse_cube_root();
    let r2 = r * r;
    let b = left_cauchy_green(f).map(|x| x * r2);
    let bb = square(&b);
    let i1 = b[0] + b[1] + b[2];
    let i2 = (i1 * i1 - (bb[0] + bb[1] + bb[2])) * k(0.5);
    let b2: Symmetric<S> = std::array::from_fn(|v| i1 * b[v] - bb[v]);
    let (a1, a2) = (k(2.0 * c10), k(2.0 * c01));
    let third = k(1.0 / 3.0);
    // s1 = dev b, s2 = dev B2 (trace of B2 is 2 I2).
    let mean1 = i1 * third;
    let mean2 = i2 * k(2.0 / 3.0);
    let unit = |v: usize| k(if v < 3 { 1.0 } else { 0.0 });
    let s1: Symmetric<S> = std::array::from_fn(|v| b[v] - mean1 * unit(v));
    let s2: Symmetric<S> = std::array::from_fn(|v| b2[v] - mean2 * unit(v));
    let stress = std::array::from_fn(|v| a1 * s1[v] + a2 * s2[v]);
    // c = 2 c10 [ -2/3 (1 x s1 + s1 x 1) + 2/3 I1 (Is - 1x1/3) ]
    //   + 2 c01 [ 2 (b x b - b.b) - 4/3 (1 x B2 + B2 x 1) + 8/9 I2 1x1 + 4/3 I2 Is ]
    let tangent = std::array::from_fn(|v| {
        std::array::from_fn(|w| {
            let (i, j) = PAIRS[v];
            let (m, n) = PAIRS[w];
            let (one, other) = (unit(v), unit(w));
            // Identity on symmetric tensors.
            let same = k(match (v == w, v < 3) {
                (true, true) => 1.0,
                (true, false) => 0.5,
                _ => 0.0,
            });
            let product =
                (b[PLACE[i][m]] * b[PLACE[j][n]] + b[PLACE[i][n]] * b[PLACE[j][m]]) * k(0.5);
            let first = (same - one * other * third) * i1 * k(2.0 / 3.0)
                - (one * s1[w] + s1[v] * other) * k(2.0 / 3.0);
            let second = (b[v] * b[w] - product) * k(2.0)
                - (one * b2[w] + b2[v] * other) * k(4.0 / 3.0)
                + i2 * (one * other * k(8.0 / 9.0) + same * k(4.0 / 3.0));
            a1 * first + a2 * second
        })
    });
    Response {
        energy: k(c10) * (i1 - k(3.0)) + k(c01) * (i2 - k(3.0)),
        stress,
        tangent,
    }
}
