//! A law given as an energy function of the invariants.

use super::dual::Dual;
use super::invariants::{self, Slopes};
use super::{Answer, Response};
use crate::scalar::{Scalar, Symmetric, Tensor, left_cauchy_green};

/// An energy `W(I1bar, I2bar)` in Pa of the first and second invariant of the isochoric left
/// Cauchy-Green tensor, both 3 at rest. Stress and tangent follow from its derivatives, which
/// dual numbers give.
///
/// # Example
/// ```
/// use taxel_fem::material::{Dual, EnergyFunction, Law, Material, Volumetric};
///
/// // Gent's law, which stiffens without bound where I1 comes near 33 (Gent 1996).
/// fn gent([i1, _]: [Dual; 2]) -> Dual {
///     let (modulus, limit) = (1e5, 30.0);
///     -0.5 * modulus * limit * (Dual::from(1.0) - (i1 - 3.0) * (1.0 / limit)).ln()
/// }
///
/// let law = Law::Energy(EnergyFunction::new(gent));
/// assert!((law.shear_modulus() - 1e5).abs() < 1e-6);
/// let rubber = Material::new(law, Volumetric::Incompressible)?;
/// assert!(rubber.require_stable(0.5, 3.0).is_ok());
///
/// // An energy that falls is refused.
/// fn falling([i1, _]: [Dual; 2]) -> Dual {
///     -1e5 * (i1 - 3.0)
/// }
/// let law = Law::Energy(EnergyFunction::new(falling));
/// assert!(Material::new(law, Volumetric::Incompressible).is_err());
/// # Ok::<(), taxel_fem::material::MaterialError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct EnergyFunction(fn([Dual; 2]) -> Dual);

impl PartialEq for EnergyFunction {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::fn_addr_eq(self.0, other.0)
    }
}

/// Value and derivatives of an energy.
pub(crate) struct Derived {
    pub(crate) energy: f64,
    /// By the first and the second invariant.
    pub(crate) first: [f64; 2],
    /// Twice by the first, mixed, twice by the second.
    pub(crate) second: [f64; 3],
}

impl EnergyFunction {
    /// An energy as a function of the two invariants.
    pub const fn new(energy: fn([Dual; 2]) -> Dual) -> Self {
        Self(energy)
    }

    /// The energy of numbers with derivatives.
    #[cfg(test)]
    pub(super) fn of(self, invariants: [Dual; 2]) -> Dual {
        (self.0)(invariants)
    }

    /// The energy with its derivatives by the invariants.
    pub(crate) fn derived(self, invariants: [f64; 2]) -> Derived {
        let along = |one: usize, other: usize| {
            (self.0)(std::array::from_fn(|n| Dual {
                first: f64::from(u8::from(n == one)),
                second: f64::from(u8::from(n == other)),
                ..Dual::from(invariants[n])
            }))
        };
        let [twice, mixed, other] = [along(0, 0), along(0, 1), along(1, 1)];
        Derived {
            energy: mixed.value,
            first: [mixed.first, mixed.second],
            second: [twice.mixed, mixed.mixed, other.mixed],
        }
    }
}

/// Energy, stress and tangent, each point on its own.
#[inline(always)]
pub(super) fn response<S: Scalar>(f: &Tensor<S>, energy: EnergyFunction) -> Response<S> {
    Response::point_by_point(&left_cauchy_green(f), |b| at_point(b, energy))
}

/// With `s = dev b` and `t = dev (I1 b - b^2)` the stress is `2 (W1 s + W2 t)`. Its tangent is
/// that of constant `W2` with `4 W11 s x s`, and `4 W12 (s x t + t x s) + 4 W22 t x t`.
#[inline(never)]
fn at_point(b: &Symmetric<f64>, energy: EnergyFunction) -> Answer {
    let at = invariants::of_left(b);
    let derived = energy.derived([at.first, at.second]);
    let [w1, w2] = derived.first;
    let [w11, w12, w22] = derived.second;
    let slopes = Slopes {
        energy: derived.energy,
        first: w1,
        curvature: w11,
    };
    let response = invariants::response(&at, &slopes, w2);
    let [s, t] = at.slopes();
    let mut answer = [0.0; 28];
    answer[0] = response.energy;
    answer[1..7].copy_from_slice(&response.stress);
    let mut next = 7;
    for v in 0..6 {
        for w in v..6 {
            answer[next] = response.tangent[v][w]
                + 4.0 * (w12 * (s[v] * t[w] + t[v] * s[w]) + w22 * t[v] * t[w]);
            next += 1;
        }
    }
    answer
}
