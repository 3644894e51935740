//! Preload: how far a soft layer is already pressed before the test begins.

use schemars::JsonSchema;
use serde::Deserialize;

/// Law of the layer under uniform uniaxial pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LayerLaw {
    /// Stress proportional to strain, t = t₀(1 − P/(A E)): small strains only.
    Linear,
    /// P/A = (E/3)(λ⁻² − λ), t = λ t₀: incompressible, for large strains.
    NeoHookean,
}

/// A soft layer before it is pressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftLayer {
    /// Thickness without load t₀, m; above zero.
    pub thickness: f64,
    /// Modulus of elasticity E, Pa; above zero.
    pub modulus: f64,
    /// Law under pressure.
    pub law: LayerLaw,
}

/// A layer under its preload.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preloaded {
    /// Thickness, m.
    pub thickness: f64,
    /// Stiffness per area that a further small displacement meets, Pa/m: E/t
    /// of the pressed layer for the linear law, as P3 Eq. 17 takes it, and the
    /// slope of the law for the neo-Hookean one.
    pub stiffness_per_area: f64,
}

/// The preload cannot be carried.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PreloadError {
    /// The linear law leaves no thickness.
    #[error("a preload of {force} N leaves no thickness: the linear law holds below {limit} N")]
    Crushed {
        /// The preload, N.
        force: f64,
        /// Force at which the linear law reaches zero thickness, A E, N.
        limit: f64,
    },
    /// Preload or area is not usable.
    #[error(
        "a preload of {force} N on {area} m^2: the force must be zero or more and the area above zero"
    )]
    OutOfRange {
        /// The preload, N.
        force: f64,
        /// Its area, m².
        area: f64,
    },
}

impl SoftLayer {
    /// The layer under `force`, N, spread evenly over `area`, m².
    ///
    /// Linear: t = t₀(1 − P/(A E)), slope E/t. Neo-Hookean: t = λ t₀ with
    /// P/A = (E/3)(λ⁻² − λ), slope (E/3)(1 + 2λ⁻³)/t₀ (P3 section 3.3 gives the
    /// linear one).
    ///
    /// # Errors
    /// [`PreloadError::Crushed`] where the linear law leaves no thickness;
    /// [`PreloadError::OutOfRange`] for a pull or an area of nothing.
    ///
    /// # Example
    /// ```
    /// use taxel::mechanics::{LayerLaw, SoftLayer};
    /// let layer = SoftLayer { thickness: 1.5e-3, modulus: 80e3, law: LayerLaw::Linear };
    /// let pressed = layer.preloaded(2.68, 100e-6)?;
    /// assert!((pressed.thickness - 0.9975e-3).abs() < 1e-12);
    /// assert!(layer.preloaded(8.0, 100e-6).is_err());
    /// # Ok::<(), taxel::mechanics::PreloadError>(())
    /// ```
    pub fn preloaded(&self, force: f64, area: f64) -> Result<Preloaded, PreloadError> {
        let possible = force >= 0.0 && force.is_finite() && area > 0.0 && area.is_finite();
        if !possible {
            return Err(PreloadError::OutOfRange { force, area });
        }
        match self.law {
            LayerLaw::Linear => self.linear(force, area),
            LayerLaw::NeoHookean => Ok(self.neo_hookean(force / area)),
        }
    }

    fn linear(&self, force: f64, area: f64) -> Result<Preloaded, PreloadError> {
        let limit = area * self.modulus;
        if force >= limit {
            return Err(PreloadError::Crushed { force, limit });
        }
        let thickness = self.thickness * (1.0 - force / limit);
        Ok(Preloaded {
            thickness,
            stiffness_per_area: self.modulus / thickness,
        })
    }

    fn neo_hookean(&self, pressure: f64) -> Preloaded {
        let stretch = compressed_stretch(3.0 * pressure / self.modulus);
        let slope = self.modulus / 3.0 * (1.0 + 2.0 / stretch.powi(3));
        Preloaded {
            thickness: stretch * self.thickness,
            stiffness_per_area: slope / self.thickness,
        }
    }
}

/// Solves λ⁻² − λ = `load` ≥ 0 by Newton's method.
///
/// Multiplied by λ² the equation is convex, and Newton comes down to the root
/// from λ = 1 without passing it.
fn compressed_stretch(load: f64) -> f64 {
    let mut stretch = 1.0_f64;
    for _ in 0..200 {
        let excess = stretch.powi(3) + load * stretch * stretch - 1.0;
        let next = stretch - excess / (3.0 * stretch * stretch + 2.0 * load * stretch);
        if next >= stretch {
            break;
        }
        stretch = next;
    }
    stretch
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neo_hookean_stretch_solves_its_equation_up_to_high_pressure() {
        for load in [0.0, 1e-9, 0.1, 1.0, 50.0, 1e6] {
            let stretch = compressed_stretch(load);
            assert!(stretch > 0.0 && stretch <= 1.0);
            // A few roundings of the larger side.
            let residual = 1.0 / (stretch * stretch) - stretch - load;
            assert!(residual.abs() < 1e-14 * (1.0 + load), "{load}: {residual}");
        }
    }

    #[test]
    fn slope_is_the_derivative_of_pressure() {
        for law in [LayerLaw::Linear, LayerLaw::NeoHookean] {
            let layer = SoftLayer {
                thickness: 2e-3,
                modulus: 80e3,
                law,
            };
            let [low, mid, high] =
                [3.0 - 1e-5, 3.0, 3.0 + 1e-5].map(|force| layer.preloaded(force, 1e-4).unwrap());
            let slope = 2e-5 / 1e-4 / (low.thickness - high.thickness);
            // The linear law takes stress per deformed length as the modulus,
            // E/t as P3 does in its Eq. 17, not the slope E/t₀ of its own line.
            let expected = match law {
                LayerLaw::Linear => layer.modulus / layer.thickness,
                LayerLaw::NeoHookean => mid.stiffness_per_area,
            };
            // Central difference: error (1e-5/3)², and 1e-16/1e-6 of rounding.
            assert!((slope / expected - 1.0).abs() < 1e-9, "{law:?}");
        }
    }
}
