//! Soft solids by their constants.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{self, Checked, NonNegativeStress, PoissonRatio, PositiveStress};

/// Law of a soft solid; the header in the file names the model.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Hyperelastic {
    /// Incompressible Mooney-Rivlin solid.
    MooneyRivlin(MooneyRivlin),
}

/// W = C10 (I1 − 3) + C01 (I2 − 3), incompressible.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MooneyRivlin {
    /// First constant C10, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub c10: f64,
    /// Second constant C01, Pa.
    #[serde(deserialize_with = "quantity::one::<NonNegativeStress, _>")]
    #[schemars(with = "Checked<NonNegativeStress>")]
    pub c01: f64,
}

/// An isotropic linear elastic solid.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinearElastic {
    /// Young's modulus E, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub young_modulus: f64,
    /// Poisson's ratio ν, 0 to 0.5.
    #[serde(deserialize_with = "quantity::one::<PoissonRatio, _>")]
    #[schemars(with = "Checked<PoissonRatio>")]
    pub poisson_ratio: f64,
}

impl Hyperelastic {
    /// Shear modulus at rest, Pa.
    pub fn shear_modulus(&self) -> f64 {
        match self {
            Self::MooneyRivlin(material) => material.shear_modulus(),
        }
    }

    /// The same solid for small strains: E = 3 μ, ν = 1/2.
    pub fn small_strain(&self) -> LinearElastic {
        LinearElastic {
            young_modulus: 3.0 * self.shear_modulus(),
            poisson_ratio: 0.5,
        }
    }
}

impl MooneyRivlin {
    /// Shear modulus at rest μ = 2 (C10 + C01), Pa.
    ///
    /// In incompressible plane strain I1 = I2, so only this sum matters there.
    pub fn shear_modulus(&self) -> f64 {
        2.0 * (self.c10 + self.c01)
    }
}

impl LinearElastic {
    /// Plane-strain modulus E/(1 − ν²), Pa.
    pub fn plane_strain_modulus(&self) -> f64 {
        self.young_modulus / (1.0 - self.poisson_ratio * self.poisson_ratio)
    }
}
