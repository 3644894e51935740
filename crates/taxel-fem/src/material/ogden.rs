//! Ogden's law in the principal stretches.

use super::principal::principal;
use super::{Answer, OgdenTerm, Response};
use crate::scalar::{PAIRS, Scalar, Symmetric, Tensor, left_cauchy_green};

/// Energy, stress and tangent of `W = sum mu/a (l1^a + l2^a + l3^a - 3)`, where `l`
/// are the isochoric principal stretches. Each point on its own.
#[inline(always)]
pub(super) fn response<S: Scalar>(f: &Tensor<S>, terms: &[OgdenTerm]) -> Response<S> {
    Response::point_by_point(&left_cauchy_green(f), |b| at_point(b, terms))
}

/// Energy and its derivatives in principal axes.
struct Principal {
    energy: f64,
    /// `tau_i`.
    stress: [f64; 3],
    /// `d tau_i / d ln l_j - 2 tau_i delta_ij`.
    normal: Tensor<f64>,
    /// `c_ijij` of the pairs of axes 12, 23, 13.
    shear: [f64; 3],
}

/// Never inlined: nothing here runs in wide registers, and once is enough.
#[inline(never)]
fn at_point(b: &Symmetric<f64>, terms: &[OgdenTerm]) -> Answer {
    let (values, n) = principal(b);
    let axes = in_principal_axes(values, terms);
    // Columns: n_i x n_i, then n_i x n_j + n_j x n_i.
    let dyads: [Symmetric<f64>; 6] = std::array::from_fn(|pair| {
        let (i, j) = PAIRS[pair];
        PAIRS.map(|(k, l)| {
            let one = n[i][k] * n[j][l];
            if i == j { one } else { one + n[j][k] * n[i][l] }
        })
    });
    let mut answer = [0.0; 28];
    answer[0] = axes.energy;
    for v in 0..6 {
        answer[1 + v] = (0..3).map(|i| axes.stress[i] * dyads[i][v]).sum();
    }
    // One side of the tangent: what each dyad is multiplied by.
    let sides: [Symmetric<f64>; 6] = std::array::from_fn(|pair| {
        std::array::from_fn(|w| match pair {
            0..3 => (0..3).map(|j| axes.normal[pair][j] * dyads[j][w]).sum(),
            _ => axes.shear[pair - 3] * dyads[pair][w],
        })
    });
    let mut next = 7;
    for v in 0..6 {
        for w in v..6 {
            answer[next] = (0..6).map(|pair| dyads[pair][v] * sides[pair][w]).sum();
            next += 1;
        }
    }
    answer
}

/// With `x = ln l`, `beta_i = sum mu l_i^a` and `gamma_i = d beta_i / d x_i`: the stress
/// is `tau = dev beta`, its derivative
/// `d tau_i / d x_j = gamma_i delta_ij - (gamma_i + gamma_j) / 3 + sum gamma / 9`.
///
/// The shear entry `(tau_i l_j^2 - tau_j l_i^2) / (l_i^2 - l_j^2)` (Ogden 1984, chapter 6)
/// is `c_ijij = [(beta_i - beta_j) coth(x_i - x_j) - tau_i - tau_j] / 2`, see [`secant`].
fn in_principal_axes(squares: [f64; 3], terms: &[OgdenTerm]) -> Principal {
    let logarithms = squares.map(|square| 0.5 * libm::log(square));
    let mean = (logarithms[0] + logarithms[1] + logarithms[2]) / 3.0;
    let x = logarithms.map(|logarithm| logarithm - mean);
    let (mut energy, mut beta, mut gamma) = (0.0, [0.0; 3], [0.0; 3]);
    for term in used(terms) {
        for i in 0..3 {
            // No loss near the undeformed state.
            let growth = libm::expm1(term.exponent * x[i]);
            energy += term.modulus / term.exponent * growth;
            // A part that is equal in all axes changes neither dev nor a difference.
            beta[i] += term.modulus * growth;
            gamma[i] += term.modulus * term.exponent * (1.0 + growth);
        }
    }
    let third = (beta[0] + beta[1] + beta[2]) / 3.0;
    let stress = beta.map(|beta| beta - third);
    let ninth = (gamma[0] + gamma[1] + gamma[2]) / 9.0;
    let normal = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let own = gamma[i] - 2.0 * stress[i];
            ninth - (gamma[i] + gamma[j]) / 3.0 + if i == j { own } else { 0.0 }
        })
    });
    let shear = [(0, 1), (1, 2), (0, 2)].map(|(i, j)| {
        let slope = used(terms)
            .map(|term| secant(term, x[i], x[j]))
            .sum::<f64>();
        slope - 0.5 * (stress[i] + stress[j])
    });
    Principal {
        energy,
        stress,
        normal,
        shear,
    }
}

/// The terms that are not empty.
fn used(terms: &[OgdenTerm]) -> impl Iterator<Item = &OgdenTerm> {
    terms.iter().filter(|term| term.modulus != 0.0)
}

/// `mu (l_i^a - l_j^a) / 2 coth(x_i - x_j)`, by the identity
/// `l_i^a - l_j^a = 2 (l_i l_j)^(a/2) sinh(a (x_i - x_j) / 2)`; no digit is lost where
/// the stretches are nearly equal, and equal ones have the limit `a / 2`.
fn secant(term: &OgdenTerm, x: f64, y: f64) -> f64 {
    let difference = x - y;
    let half = 0.5 * term.exponent;
    let ratio = if difference == 0.0 {
        half
    } else {
        libm::sinh(half * difference) / libm::tanh(difference)
    };
    term.modulus * libm::exp(half * (x + y)) * ratio
}
