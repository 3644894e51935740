//! The capacitance between two electrodes that lie side by side (P1).

use schemars::JsonSchema;
use serde::Deserialize;

use super::surroundings::Surroundings;
use super::tilted_plate::VACUUM_PERMITTIVITY;
use crate::mechanics::DeformedElectrodes;
use crate::quantity::{self, Checked, FringeExponent, PositiveRatio, RelativePermittivity};
use taxel_numerics::special::complete_elliptic_k;

/// The dielectric as a sensor file gives it.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dielectric {
    /// Relative permittivity of layer and electrodes' surroundings in it (ε_r).
    #[serde(deserialize_with = "quantity::one::<RelativePermittivity, _>")]
    #[schemars(with = "Checked<RelativePermittivity>")]
    pub permittivity: f64,
    /// Media above and below, grounded parts, and the capacitance that the readout measures.
    pub surroundings: Surroundings,
}

/// The published factor q (U/D)^γ on the change of the parallel plates
/// (P1 Eq. 7).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PublishedFringe {
    /// q.
    #[serde(deserialize_with = "quantity::one::<PositiveRatio, _>")]
    #[schemars(with = "Checked<PositiveRatio>")]
    pub scale: f64,
    /// γ, above −1: at −1 and below the change would not start at zero.
    #[serde(deserialize_with = "quantity::one::<FringeExponent, _>")]
    #[schemars(with = "Checked<FringeExponent>")]
    pub exponent: f64,
}

/// T/D of two electrodes: the field between the facing sides alone.
pub fn facing_sides(electrodes: &DeformedElectrodes) -> f64 {
    electrodes.thickness / electrodes.gap
}

/// Capacitance per length and permittivity of two thin coplanar strips in an
/// unbounded medium, `gap` apart and `width` wide:
///
/// C/(ε w) = K(k′)/K(k),  k = D/(D + 2b)
///
/// Exact for strips without thickness. Lengths above zero in one unit.
///
/// ```
/// use taxel::transduction::coplanar_strips;
/// assert!((coplanar_strips(20e-6, 1e-3) - 3.82060377).abs() < 5e-9);
/// ```
pub fn coplanar_strips(gap: f64, width: f64) -> f64 {
    let across = gap + 2.0 * width;
    let modulus = gap / across;
    // k′ = √(1 − k²) without the difference.
    let complement = 2.0 * (width * (gap + width)).sqrt() / across;
    complete_elliptic_k(modulus) / complete_elliptic_k(complement)
}

impl Dielectric {
    /// Capacitance of electrodes of length `depth`, F: facing sides and
    /// coplanar strips in a uniform medium,
    ///
    /// C = ε₀ ε_r w_e (t/d + K(k′)/K(k)),
    ///
    /// to which [`Surroundings::offset`] is to be added. Below the full field
    /// by 1 to 2.2 % for b = 10 T, by 3.3 to 8 % for b = T (P1's gaps).
    pub fn uniform(&self, electrodes: &DeformedElectrodes, depth: f64) -> f64 {
        self.scale(depth)
            * (facing_sides(electrodes) + coplanar_strips(electrodes.gap, electrodes.width))
    }

    /// ε₀ ε_r w_e, F.
    pub fn scale(&self, depth: f64) -> f64 {
        VACUUM_PERMITTIVITY * self.permittivity * depth
    }
}

impl PublishedFringe {
    /// The factor q (U/D)^γ times `change`, the change of the facing sides;
    /// 0 where nothing is compressed. For γ < 0 the slope there is infinite.
    pub fn change(&self, change: f64, displacement_over_gap: f64) -> f64 {
        if displacement_over_gap <= 0.0 {
            return 0.0;
        }
        change * self.scale * displacement_over_gap.powf(self.exponent)
    }
}
