//! Materials from their constants, which are checked here.

use super::stability::{self, Instability};
use super::{Law, Material, OgdenTerm, Volumetric};

/// Error in the constants of a material.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// A constant, or a sum of constants, outside of its range.
    #[error("{constant} = {value:?} must be {allowed}")]
    OutOfRange {
        /// The constant, with its unit.
        constant: &'static str,
        /// Value that was given.
        value: f64,
        /// Range that is allowed.
        allowed: &'static str,
    },
    /// A number of terms that a law does not have.
    #[error("{law} has {given} terms, must be 1 to {most}; fit the law again with fewer terms")]
    Terms {
        /// The law.
        law: &'static str,
        /// Number of terms given.
        given: usize,
        /// The most that are allowed.
        most: usize,
    },
    /// A law that loses its stability in the range of stretches that was asked for.
    #[error("the material {0}; use a smaller range of stretches, or another law or fit")]
    Unstable(#[from] Instability),
}

const POSITIVE: &str = "greater than 0 and finite";
const FINITE: &str = "a finite number";

pub(super) fn positive(constant: &'static str, value: f64) -> Result<f64, MaterialError> {
    within(constant, value, POSITIVE, value > 0.0 && value.is_finite())
}

fn finite(constant: &'static str, value: f64) -> Result<f64, MaterialError> {
    within(constant, value, FINITE, value.is_finite())
}

pub(super) fn within(
    constant: &'static str,
    value: f64,
    allowed: &'static str,
    holds: bool,
) -> Result<f64, MaterialError> {
    if holds {
        Ok(value)
    } else {
        Err(MaterialError::OutOfRange {
            constant,
            value,
            allowed,
        })
    }
}

/// Shear modulus in Pa and volumetric law of Young's modulus (Pa) and Poisson's ratio.
fn from_young(young: f64, poisson: f64) -> Result<(f64, Volumetric), MaterialError> {
    positive("Young's modulus [Pa]", young)?;
    let allowed = "greater than -1 and at most 0.5 (incompressible)";
    let holds = poisson > -1.0 && poisson <= 0.5;
    within("Poisson's ratio", poisson, allowed, holds)?;
    let volumetric = if poisson == 0.5 {
        Volumetric::Incompressible
    } else {
        Volumetric::Quadratic(young / (3.0 * (1.0 - 2.0 * poisson)))
    };
    Ok((young / (2.0 * (1.0 + poisson)), volumetric))
}

impl Material {
    /// A solid of checked constants: every one a finite number, shear modulus at small
    /// strain and bulk modulus greater than zero.
    ///
    /// # Errors
    /// [`MaterialError::OutOfRange`] names the constant.
    ///
    /// # Example
    /// ```
    /// use taxel_fem::material::{Law, Material, Volumetric};
    ///
    /// let law = Law::Yeoh { c10: 0.18e6, c20: -2e3, c30: 50.0 };
    /// assert!(Material::new(law, Volumetric::Incompressible).is_ok());
    ///
    /// let law = Law::LinearElastic { shear: -1e5 };
    /// let error = Material::new(law, Volumetric::Incompressible).unwrap_err();
    /// assert!(error.to_string().contains("-100000.0 must be greater than 0"));
    /// ```
    pub fn new(law: Law, volumetric: Volumetric) -> Result<Self, MaterialError> {
        law.check()?;
        if let Some(bulk) = volumetric.bulk_modulus() {
            positive("bulk modulus [Pa]", bulk)?;
        }
        Ok(Self { law, volumetric })
    }

    /// A solid that keeps its volume. The constants of its law are checked where a problem is
    /// posed ([`Problem::check`](crate::problem::Problem::check)); [`Self::new`] checks them at once.
    pub const fn incompressible(law: Law) -> Self {
        Self {
            law,
            volumetric: Volumetric::Incompressible,
        }
    }

    /// Poisson's ratio at small strain, `(3K - 2G) / (6K + 2G)`.
    pub fn poisson_ratio(&self) -> f64 {
        let shear = self.law.shear_modulus();
        match self.volumetric.bulk_modulus() {
            None => 0.5,
            Some(bulk) => (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear),
        }
    }

    /// Resistance to a change of shape.
    pub const fn law(&self) -> &Law {
        &self.law
    }

    /// Resistance to a change of volume.
    pub const fn volumetric(&self) -> Volumetric {
        self.volumetric
    }

    /// Mooney and Rivlin's law with `U = (J - 1)^2 / d1`, that is `K = 2 / d1`; `c10` and
    /// `c01` in Pa, `d1` in 1/Pa, zero where the solid keeps its volume.
    ///
    /// # Errors
    /// [`MaterialError::OutOfRange`], also where `c10 + c01` is not positive.
    pub fn mooney_rivlin(c10: f64, c01: f64, d1: f64) -> Result<Self, MaterialError> {
        let holds = d1 >= 0.0 && d1.is_finite();
        within("d1 [1/Pa]", d1, "0 or greater, and finite", holds)?;
        let volumetric = if d1 == 0.0 {
            Volumetric::Incompressible
        } else {
            Volumetric::Quadratic(2.0 / d1)
        };
        Self::new(Law::MooneyRivlin { c10, c01 }, volumetric)
    }

    /// Neo-Hookean solid of Young's modulus (Pa) and Poisson's ratio at small strain; 0.5
    /// is incompressible.
    ///
    /// # Errors
    /// [`MaterialError::OutOfRange`]
    pub fn neo_hookean(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        let (shear, volumetric) = from_young(young, poisson)?;
        Self::new(Law::neo_hookean(shear), volumetric)
    }

    /// Stiff part of Young's modulus (Pa) and Poisson's ratio, see [`Law::LinearElastic`].
    ///
    /// # Errors
    /// [`MaterialError::OutOfRange`]
    pub fn linear_elastic(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        let (shear, volumetric) = from_young(young, poisson)?;
        Self::new(Law::LinearElastic { shear }, volumetric)
    }

    /// Refuses a law that is not stable at the stretches `smallest` (0.05 to 1) to `largest`
    /// (1 to 20) of an incompressible solid in uniaxial and equibiaxial stretching and pure shear.
    ///
    /// Asked for are a positive shear modulus at small strain, [`Criterion::Drucker`] and
    /// [`Criterion::BakerEricksen`]. Stretches are tried from one outwards in steps of
    /// half a per cent; a loss within less than that may be missed.
    ///
    /// # Errors
    /// [`MaterialError::Unstable`] with the loss that is nearest to the undeformed state, by
    /// the largest logarithm of its principal stretches; [`MaterialError::OutOfRange`] for
    /// other ranges.
    ///
    /// # Example
    /// ```
    /// use taxel_fem::material::{Law, Material, Volumetric};
    ///
    /// // Softening that nothing stops.
    /// let law = Law::Yeoh { c10: 1e5, c20: -1e4, c30: 0.0 };
    /// let material = Material::new(law, Volumetric::Incompressible)?;
    /// assert!(material.require_stable(0.9, 1.2).is_ok());
    ///
    /// let error = material.require_stable(0.5, 4.0).unwrap_err();
    /// let start = "the material loses stability at stretch 1.9081 in pure shear";
    /// assert!(error.to_string().starts_with(start));
    /// # Ok::<(), taxel_fem::material::MaterialError>(())
    /// ```
    ///
    /// [`Criterion::Drucker`]: stability::Criterion::Drucker
    /// [`Criterion::BakerEricksen`]: stability::Criterion::BakerEricksen
    pub fn require_stable(&self, smallest: f64, largest: f64) -> Result<(), MaterialError> {
        let allowed = "0.05 to 1";
        let holds = (0.05..=1.0).contains(&smallest);
        within("smallest stretch", smallest, allowed, holds)?;
        let holds = (1.0..=20.0).contains(&largest);
        within("largest stretch", largest, "1 to 20", holds)?;
        Ok(stability::over_range(&self.law, smallest, largest)?)
    }
}

impl Law {
    /// Neo-Hookean, of this shear modulus in Pa.
    pub fn neo_hookean(shear_modulus: f64) -> Self {
        Self::MooneyRivlin {
            c10: shear_modulus / 2.0,
            c01: 0.0,
        }
    }

    /// Ogden's law of one to four terms, each a modulus in Pa and an exponent.
    ///
    /// # Errors
    /// [`MaterialError::Terms`]; [`MaterialError::OutOfRange`] for an exponent of zero.
    pub fn ogden(terms: &[OgdenTerm]) -> Result<Self, MaterialError> {
        let none = OgdenTerm {
            modulus: 0.0,
            exponent: 1.0,
        };
        let mut all = [none; 4];
        if terms.is_empty() || terms.len() > all.len() {
            return Err(MaterialError::Terms {
                law: "Ogden's law",
                given: terms.len(),
                most: all.len(),
            });
        }
        all[..terms.len()].copy_from_slice(terms);
        let law = Self::Ogden { terms: all };
        law.check()?;
        Ok(law)
    }

    fn check(&self) -> Result<(), MaterialError> {
        match self {
            Self::MooneyRivlin { c10, c01 } => {
                finite("c10 [Pa]", *c10)?;
                finite("c01 [Pa]", *c01)?;
                positive("c10 + c01 [Pa]", c10 + c01)?;
            }
            Self::Yeoh { c10, c20, c30 } => {
                positive("c10 [Pa]", *c10)?;
                finite("c20 [Pa]", *c20)?;
                finite("c30 [Pa]", *c30)?;
            }
            Self::Gent { shear, limit } => {
                positive("shear modulus [Pa]", *shear)?;
                positive("limit of I1 - 3", *limit)?;
            }
            Self::Ogden { terms } => {
                for term in terms {
                    finite("modulus of a term of Ogden's law [Pa]", term.modulus)?;
                    let holds = term.exponent != 0.0 && term.exponent.is_finite();
                    let allowed = "finite and not 0";
                    within(
                        "exponent of a term of Ogden's law",
                        term.exponent,
                        allowed,
                        holds,
                    )?;
                }
                positive("sum of modulus x exponent / 2 [Pa]", self.shear_modulus())?;
            }
            Self::LinearElastic { shear } => {
                positive("shear modulus [Pa]", *shear)?;
            }
            Self::Energy(_) => {
                positive("2 (dW/dI1 + dW/dI2) at rest [Pa]", self.shear_modulus())?;
            }
        }
        Ok(())
    }
}
