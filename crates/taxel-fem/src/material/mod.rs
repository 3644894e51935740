//! Laws of rubber-like and stiff solids: energy, stress and tangent by hand.
//!
//! A [`Material`] is an isochoric [`Law`] and a [`Volumetric`] law. The isochoric
//! law sees the deformation gradient `F` and answers with energy, Kirchhoff stress
//! and spatial tangent per reference volume; the pressure is an unknown of its own
//! (`Pi = W(F) + p (J - 1) - U*(p)`), so that the limit of no compressibility is
//! an ordinary case.

#[cfg(test)]
mod dual;
mod invariants;
#[cfg(test)]
mod tests;

use invariants::Slopes;

use crate::scalar::{Scalar, Symmetric, Tensor};

/// What an isochoric law answers at one deformation gradient.
#[derive(Clone, Copy, Debug)]
pub struct Response<S> {
    /// Energy per reference volume, Pa.
    pub energy: S,
    /// Kirchhoff stress `tau = P F^T`, Pa.
    pub stress: Symmetric<S>,
    /// Spatial tangent `c` of the Kirchhoff stress (Lie derivative), Pa: with it
    /// `dP_iI/dF_jJ = F^-1_Ik F^-1_Jl (c_ikjl + delta_ij tau_kl)`. Symmetric, rows and
    /// columns in the order 11, 22, 33, 12, 23, 13.
    pub tangent: [[S; 6]; 6],
}

/// The part of the energy that resists a change of shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// `W = c10 (I1bar - 3) + c01 (I2bar - 3)`; `c01 = 0` is neo-Hookean. Pa.
    MooneyRivlin {
        /// Factor of the first invariant, Pa.
        c10: f64,
        /// Factor of the second invariant, Pa.
        c01: f64,
    },
}

/// The part of the energy that resists a change of volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Volumetric {
    /// `J = 1`.
    Incompressible,
    /// `U = K/2 (J - 1)^2`, bulk modulus in Pa.
    Quadratic(f64),
    /// `U = K/4 (J^2 - 1 - 2 ln J)`, bulk modulus in Pa.
    Logarithmic(f64),
}

/// A solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Resistance to a change of shape.
    pub law: Law,
    /// Resistance to a change of volume.
    pub volumetric: Volumetric,
}

impl Law {
    /// Neo-Hookean, of this shear modulus in Pa.
    pub fn neo_hookean(shear_modulus: f64) -> Self {
        Self::MooneyRivlin {
            c10: shear_modulus / 2.0,
            c01: 0.0,
        }
    }

    /// Shear modulus at small strain, Pa.
    pub fn shear_modulus(&self) -> f64 {
        match self {
            Self::MooneyRivlin { c10, c01 } => 2.0 * (c10 + c01),
        }
    }

    /// Energy, stress and tangent at the deformation gradient `f`.
    #[inline(always)]
    pub fn response<S: Scalar>(&self, f: &Tensor<S>) -> Response<S> {
        let k = S::constant;
        let at = invariants::isochoric(f);
        let (x, y) = (at.first - k(3.0), at.second - k(3.0));
        let (slopes, c2) = match *self {
            Self::MooneyRivlin { c10, c01 } => (
                Slopes {
                    energy: k(c10) * x + k(c01) * y,
                    first: k(c10),
                    curvature: k(0.0),
                },
                c01,
            ),
        };
        invariants::response(&at, &slopes, c2)
    }
}

impl Volumetric {
    /// Volume ratio `J` that the mean stress `p` (tension positive, Pa) asks for, and
    /// its derivative `dJ/dp` in 1/Pa.
    #[inline(always)]
    pub fn volume_ratio(&self, pressure: f64) -> (f64, f64) {
        match *self {
            Self::Incompressible => (1.0, 0.0),
            Self::Quadratic(bulk) => (1.0 + pressure / bulk, 1.0 / bulk),
            Self::Logarithmic(bulk) => {
                // U' = K/2 (J - 1/J) = p
                let x = pressure / bulk;
                let root = (x * x + 1.0).sqrt();
                (x + root, (1.0 + x / root) / bulk)
            }
        }
    }

    /// Bulk modulus in Pa; none where the solid keeps its volume.
    pub fn bulk_modulus(&self) -> Option<f64> {
        match *self {
            Self::Incompressible => None,
            Self::Quadratic(bulk) | Self::Logarithmic(bulk) => Some(bulk),
        }
    }
}
