//! Laws of rubber-like and stiff solids: energy, stress and tangent by hand.
//!
//! A [`Material`] is an isochoric [`Law`] and a [`Volumetric`] law. The isochoric
//! law sees the deformation gradient `F` and answers with energy, Kirchhoff stress
//! and spatial tangent per reference volume; the pressure is an unknown of its own
//! (`Pi = W(F) + p (J - 1) - U*(p)`), so that the limit of no compressibility is
//! an ordinary case.

mod constants;
mod dual;
mod energy;
pub mod homogeneous;
mod invariants;
mod ogden;
mod principal;
pub mod stability;
#[cfg(test)]
mod tests;
pub mod viscoelastic;

pub use constants::MaterialError;
pub use dual::Dual;
pub use energy::EnergyFunction;

use crate::scalar::{Scalar, Symmetric, Tensor};
use invariants::{Isochoric, Slopes};

/// Response of an isochoric law at one deformation gradient.
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

/// Energy, stress and the upper triangle of the tangent at one point, row after row.
type Answer = [f64; 28];

impl<S: Scalar> Response<S> {
    /// The response of a law that takes each point on its own, from left Cauchy-Green tensors.
    #[inline(always)]
    fn point_by_point(b: &Symmetric<S>, at_point: impl Fn(&Symmetric<f64>) -> Answer) -> Self {
        let answer = S::per_point(b, at_point);
        let mut tangent = [[answer[0]; 6]; 6];
        let mut next = 7;
        for v in 0..6 {
            for w in v..6 {
                tangent[v][w] = answer[next];
                tangent[w][v] = answer[next];
                next += 1;
            }
        }
        Self {
            energy: answer[0],
            stress: std::array::from_fn(|v| answer[1 + v]),
            tangent,
        }
    }
}

/// The part of the energy that resists a change of shape. `I1bar`, `I2bar` and `l` are
/// invariants and principal stretches of `J^-1/3 F`. [`Material::new`] checks constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// `W = c10 (I1bar - 3) + c01 (I2bar - 3)`; `c01 = 0` is neo-Hookean. Pa.
    MooneyRivlin {
        /// Factor of the first invariant, Pa.
        c10: f64,
        /// Factor of the second invariant, Pa.
        c01: f64,
    },
    /// `W = c10 x + c20 x^2 + c30 x^3` with `x = I1bar - 3` (Yeoh 1993).
    Yeoh {
        /// Factor of `x`, Pa.
        c10: f64,
        /// Factor of `x^2`, Pa.
        c20: f64,
        /// Factor of `x^3`, Pa.
        c30: f64,
    },
    /// `W = -mu Jm / 2 ln(1 - (I1bar - 3) / Jm)` (Gent 1996): stiffens without bound where
    /// `I1bar - 3` comes near the limit `Jm`, and is not a number beyond.
    Gent {
        /// Shear modulus `mu`, Pa.
        shear: f64,
        /// Limit `Jm` of `I1bar - 3`.
        limit: f64,
    },
    /// `W = sum mu/a (l1^a + l2^a + l3^a - 3)` (Ogden 1972).
    Ogden {
        /// The terms; those of modulus zero count for nothing.
        terms: [OgdenTerm; 4],
    },
    /// `W = G dev E : dev E`, `E = (J^-2/3 F^T F - 1) / 2`: Saint Venant and Kirchhoff's
    /// law for stiff parts. With a [`Volumetric`] law it is linear elasticity at small
    /// strain and exact at any rotation. It is no law of large strain: it is not stable
    /// beyond a stretch of 4^(1/3) = 1.59 in uniaxial tension.
    LinearElastic {
        /// Shear modulus `G`, Pa.
        shear: f64,
    },
    /// An energy of the invariants, given as a function.
    Energy(EnergyFunction),
}

/// One term `mu/a (l1^a + l2^a + l3^a - 3)` of Ogden's law; its part of the shear
/// modulus is `mu a / 2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OgdenTerm {
    /// `mu`, Pa.
    pub modulus: f64,
    /// `a`, not zero.
    pub exponent: f64,
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

/// A solid. It is made by [`Material::new`] or one of its like, which check the constants:
/// a solid of a negative bulk modulus cannot be written down.
///
/// ```compile_fail
/// use taxel_fem::material::{Law, Material, Volumetric};
/// let volumetric = Volumetric::Quadratic(-1.0);
/// let solid = Material { law: Law::neo_hookean(1.0), volumetric };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    pub(crate) law: Law,
    pub(crate) volumetric: Volumetric,
}

impl Law {
    /// Shear modulus at small strain, Pa.
    pub fn shear_modulus(&self) -> f64 {
        match self {
            Self::MooneyRivlin { c10, c01 } => 2.0 * (c10 + c01),
            Self::Yeoh { c10, .. } => 2.0 * c10,
            Self::Ogden { terms } => terms.iter().map(|t| t.modulus * t.exponent / 2.0).sum(),
            Self::LinearElastic { shear } | Self::Gent { shear, .. } => *shear,
            Self::Energy(energy) => {
                let [first, second] = energy.derived([3.0; 2]).first;
                2.0 * (first + second)
            }
        }
    }

    /// Name of the law.
    pub fn name(&self) -> &'static str {
        match self {
            Self::MooneyRivlin { c01: 0.0, .. } => "neo-Hookean",
            Self::MooneyRivlin { .. } => "Mooney-Rivlin",
            Self::Yeoh { .. } => "Yeoh",
            Self::Gent { .. } => "Gent",
            Self::Ogden { .. } => "Ogden",
            Self::LinearElastic { .. } => "linear elastic",
            Self::Energy(_) => "an energy of its own",
        }
    }

    /// Energy, stress and tangent at the deformation gradient `f`, of positive volume
    /// ratio; not a number, or of no meaning, at any other.
    #[inline(always)]
    pub fn response<S: Scalar>(&self, f: &Tensor<S>) -> Response<S> {
        if let Self::Ogden { terms } = self {
            return ogden::response(f, terms);
        }
        if let Self::Energy(energy) = self {
            return energy::response(f, *energy);
        }
        let at = invariants::isochoric(f);
        let (slopes, c2) = self.slopes(&at);
        invariants::response(&at, &slopes, c2)
    }

    /// Derivatives of an energy `w(I1bar) + c2 I2bar`, and `c2`.
    #[inline(always)]
    fn slopes<S: Scalar>(&self, at: &Isochoric<S>) -> (Slopes<S>, f64) {
        let k = S::constant;
        let (x, y) = (at.first - k(3.0), at.second - k(3.0));
        let (energy, first, curvature, c2) = match *self {
            Self::MooneyRivlin { c10, c01 } => (k(c10) * x, k(c10), k(0.0), c01),
            Self::Yeoh { c10, c20, c30 } => (
                ((k(c30) * x + k(c20)) * x + k(c10)) * x,
                (k(3.0 * c30) * x + k(2.0 * c20)) * x + k(c10),
                k(6.0 * c30) * x + k(2.0 * c20),
                0.0,
            ),
            Self::Gent { shear, limit } => {
                // The root keeps what is beyond the limit from a stress that looks like one.
                let room = (k(1.0) - x * k(1.0 / limit)).root();
                let first = k(shear / 2.0) / (room * room);
                (
                    (x * k(-1.0 / limit)).logarithm_of_one_plus() * k(-shear * limit / 2.0),
                    first,
                    first / (room * room * k(limit)),
                    0.0,
                )
            }
            // dev E : dev E = I1^2 / 6 - I2 / 2
            Self::LinearElastic { shear } => (
                (x * k(1.0 / 6.0) + k(1.0)) * x * k(shear),
                at.first * k(shear / 3.0),
                k(shear / 3.0),
                -shear / 2.0,
            ),
            // By their own ways.
            Self::Ogden { .. } | Self::Energy(_) => (k(0.0), k(0.0), k(0.0), 0.0),
        };
        let slopes = Slopes {
            energy: energy + k(c2) * y,
            first,
            curvature,
        };
        (slopes, c2)
    }
}

impl Volumetric {
    /// Volume ratio `J` that the mean stress `p` (tension positive, Pa) asks for, and
    /// its derivative `dJ/dp` in 1/Pa.
    pub fn volume_ratio(&self, pressure: f64) -> (f64, f64) {
        let (growth, slope) = self.growth(pressure);
        (1.0 + growth, slope)
    }

    /// `J - 1` and `dJ/dp` in 1/Pa at a mean stress: small changes keep their digits.
    #[inline(always)]
    pub(crate) fn growth(&self, pressure: f64) -> (f64, f64) {
        match *self {
            Self::Incompressible => (0.0, 0.0),
            Self::Quadratic(bulk) => (pressure / bulk, 1.0 / bulk),
            Self::Logarithmic(bulk) => {
                // U' = K/2 (J - 1/J) = p
                let x = pressure / bulk;
                let root = (x * x + 1.0).sqrt();
                (x + x * x / (1.0 + root), (1.0 + x / root) / bulk)
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
