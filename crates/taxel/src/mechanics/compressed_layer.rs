//! A soft layer bonded to a rigid base and pressed flat from above (P1,
//! Eqs. 1-6, with the primes that its printed Eqs. 4c and 6 lose).
//!
//! Axis 1 lies along the electrode gap, axis 2 upwards from the base, axis 3
//! along the electrodes; nothing stretches along 3.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use schemars::JsonSchema;
use serde::Deserialize;

use super::end_condition::EndCondition;
use super::layer_range::{LARGEST_COMPRESSION, LayerError, LayerRange};
use crate::quantity::{self, Checked, PositiveLength, PositiveStress};
use taxel_numerics::roots;

/// Sideways motion of the pressed face.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TopFace {
    /// It slides without friction.
    Frictionless,
    /// The probe grips it. The middle plane is then a mirror without shear:
    /// each half is a frictionless layer of half the thickness.
    Gripped,
}

/// The loaded part of a soft layer.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CompressedLayer {
    /// Thickness at rest (H), m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub thickness: f64,
    /// Modulus of elasticity of the incompressible layer (E_d = 3 μ), Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub youngs_modulus: f64,
    /// Half of the loaded length along the gap (L_c), m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub contact_half_length: f64,
    /// Loaded length along the electrodes (w_c), m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub contact_depth: f64,
    /// Sideways motion of the pressed face.
    pub top: TopFace,
    /// Condition at the ends of the loaded length.
    pub end_condition: EndCondition,
    /// Factor on the factor of the end condition: 1 as drawn; a calibration finds that of
    /// a device.
    #[serde(skip, default = "as_drawn")]
    #[schemars(skip)]
    pub end_scale: f64,
}

/// State of a layer under a compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerState {
    /// Motion of its points.
    pub kinematics: LayerKinematics,
    /// Factor χ of the bottom shear.
    pub end_factor: f64,
    /// Force over the loaded area at rest, Pa; pressing is positive.
    pub mean_stress: f64,
    /// Force, N; pressing is positive (−F of P1 Eq. 6).
    pub force: f64,
    /// Range in which this force was verified.
    pub range: LayerRange,
}

impl CompressedLayer {
    /// Shear modulus μ = C₁ − C₂ = E/3, Pa.
    pub fn shear_modulus(&self) -> f64 {
        self.youngs_modulus / 3.0
    }

    /// Half length over the thickness of one frictionless layer (ℓ); a gripped
    /// layer is two of half the thickness.
    pub fn aspect(&self) -> f64 {
        match self.top {
            TopFace::Frictionless => self.contact_half_length / self.thickness,
            TopFace::Gripped => 2.0 * self.contact_half_length / self.thickness,
        }
    }

    /// Loaded area at rest, m².
    pub fn contact_area(&self) -> f64 {
        2.0 * self.contact_half_length * self.contact_depth
    }

    /// Motion and force at a relative compression e = U/H.
    ///
    /// N = 2 L_c w_c s̄,  s̄ from [`LayerKinematics::mean_stress`] (P1 Eq. 6).
    ///
    /// # Errors
    /// [`LayerError::Compression`] outside 0 ≤ e < 1, [`LayerError::Falling`]
    /// where the force of the model falls again, and the errors of
    /// [`EndCondition::factor`].
    ///
    /// ```
    /// use taxel::mechanics::{CompressedLayer, EndCondition, LayerRange, TopFace};
    /// let layer = CompressedLayer {
    ///     thickness: 950e-6,
    ///     youngs_modulus: 1.2e6,
    ///     contact_half_length: 1900e-6,
    ///     contact_depth: 3e-3,
    ///     top: TopFace::Frictionless,
    ///     end_condition: EndCondition::Free,
    ///     end_scale: 1.0,
    /// };
    /// let state = layer.compress(0.1)?;
    /// assert!((state.mean_stress / 0.4e6 - 1.092207991354).abs() < 1e-11);
    /// assert_eq!(state.range, LayerRange::Within);
    /// assert!(layer.compress(1.0).is_err());
    /// # Ok::<(), taxel::mechanics::LayerError>(())
    /// ```
    pub fn compress(&self, compression: f64) -> Result<LayerState, LayerError> {
        let state = self.state(compression)?;
        if compression > LARGEST_COMPRESSION {
            let limit = self.compression_of_greatest_force()?;
            if compression > limit {
                return Err(LayerError::Falling { compression, limit });
            }
        }
        Ok(state)
    }

    /// Motion and force as the formula gives them, also where it ends to hold.
    fn state(&self, compression: f64) -> Result<LayerState, LayerError> {
        let kinematics = LayerKinematics::new(compression)?;
        let aspect = self.aspect();
        let end_factor = self.end_scale * self.end_condition.factor(aspect, compression)?;
        let mean_stress = self.shear_modulus() * kinematics.mean_stress(aspect, end_factor);
        Ok(LayerState {
            kinematics,
            end_factor,
            mean_stress,
            force: self.contact_area() * mean_stress,
            range: self.range(compression),
        })
    }

    /// Compression above [`LARGEST_COMPRESSION`] at which the force of the model
    /// begins to fall.
    fn compression_of_greatest_force(&self) -> Result<f64, LayerError> {
        // Steps in proportion to the height that is left.
        let compressions =
            (0..MOST_STEPS).map(|i| 1.0 - (1.0 - LARGEST_COMPRESSION) * STEP.powi(i));
        let (mut before, mut last) = (LARGEST_COMPRESSION, LARGEST_COMPRESSION);
        let mut greatest = f64::NEG_INFINITY;
        for compression in compressions {
            let stress = self.state(compression)?.mean_stress;
            if stress < greatest {
                return self.summit(before, compression);
            }
            (before, last, greatest) = (last, compression, stress);
        }
        Ok(last)
    }

    /// Compression of the greatest force between two others, by halves.
    fn summit(&self, mut low: f64, mut high: f64) -> Result<f64, LayerError> {
        while high - low > SUMMIT_WIDTH {
            let (left, right) = (low + 0.45 * (high - low), low + 0.55 * (high - low));
            if self.state(left)?.mean_stress < self.state(right)?.mean_stress {
                low = left;
            } else {
                high = right;
            }
        }
        Ok(0.5 * (low + high))
    }

    /// Range in which the force at this compression was verified.
    pub fn range(&self, compression: f64) -> LayerRange {
        let aspect = self.aspect();
        let limit = self.end_condition.verified_compression(aspect);
        if compression > limit {
            LayerRange::CompressionAbove { limit }
        } else if aspect < self.end_condition.verified_aspect() {
            let limit = self.end_condition.verified_aspect();
            LayerRange::AspectBelow { aspect, limit }
        } else {
            LayerRange::Within
        }
    }

    /// The compression at which the layer carries `force`, N: the inverse of
    /// [`CompressedLayer::compress`] up to [`LARGEST_COMPRESSION`].
    ///
    /// # Errors
    /// [`LayerError::Force`] for a pull or a force above that range.
    pub fn compression_from_force(&self, force: f64) -> Result<f64, LayerError> {
        let limit = self.compress(LARGEST_COMPRESSION)?.force;
        if !(0.0..=limit).contains(&force) {
            return Err(LayerError::Force { force, limit });
        }
        // Inside the range `compress` has no error left.
        let misfit = |e: f64| self.compress(e).map_or(f64::NAN, |state| state.force) - force;
        Ok(roots::ridders([0.0, LARGEST_COMPRESSION], misfit))
    }

    /// Sideways stretch less one, f − 1, at the height `x2` above the base, m.
    ///
    /// Heights outside the layer count as its faces.
    pub fn stretch_excess(&self, kinematics: &LayerKinematics, x2: f64) -> f64 {
        let y = x2 / self.thickness;
        kinematics.stretch_excess(match self.top {
            TopFace::Frictionless => y,
            TopFace::Gripped => 2.0 * y.min(1.0 - y),
        })
    }

    /// Thickness, m, of what lay between the heights `low` and `high` above
    /// the base: g(high) − g(low).
    pub fn slab(&self, kinematics: &LayerKinematics, low: f64, high: f64) -> f64 {
        let (low, high) = (low / self.thickness, high / self.thickness);
        self.thickness
            * match self.top {
                TopFace::Frictionless => kinematics.slab(low, high),
                // Each half counted from its own bonded face.
                TopFace::Gripped => {
                    0.5 * (kinematics.slab(2.0 * low, 2.0 * high)
                        + kinematics.slab(2.0 * (1.0 - high), 2.0 * (1.0 - low)))
                }
            }
    }
}

/// Motion of the points of a frictionless layer of thickness 1.
///
/// y₁ = x₁ f(x₂),  y₂ = g(x₂),  g′ = 1/f   (P1 Eqs. 1-3)
///
/// Exact for an incompressible layer in plane strain. Lengths are in units of
/// the thickness, stresses in units of the shear modulus μ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerKinematics {
    compression: f64,
    /// a = α H.
    unknown: f64,
    /// π/2 − a, with its own digits where a is close to π/2.
    complement: f64,
}

/// Constants of the stress law σ = −P I + C₁ B + C₂ B⁻¹ (P1 Eq. 4), Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StressConstants {
    /// C₁, twice the first constant of the usual energy.
    pub c1: f64,
    /// C₂, zero or negative: minus twice its second constant.
    pub c2: f64,
}

impl StressConstants {
    /// μ = C₁ − C₂: in plane strain the two act only through it.
    pub fn shear_modulus(self) -> f64 {
        self.c1 - self.c2
    }
}

/// Cauchy stresses in the plane of the layer, Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneStress {
    /// σ₁₁, along the gap.
    pub sigma11: f64,
    /// σ₁₂.
    pub sigma12: f64,
    /// σ₂₂, upwards; negative under a pressed face.
    pub sigma22: f64,
}

/// The height that is left shrinks by this factor from one compression to the
/// next in the search for the greatest force ...
const STEP: f64 = 0.95;
/// ... of which so many reach to 0.996.
const MOST_STEPS: i32 = 100;
/// Width within which that compression is found.
const SUMMIT_WIDTH: f64 = 1e-6;
/// Below this a, e(a) and tan(a)/a − 1 come from their power series: the
/// closed forms would lose two digits to cancellation.
const SMALL: f64 = 0.25;
/// Above this e, π/2 − a is solved for instead of a.
const NEAR_ONE: f64 = 0.9;

/// Coefficients of e(a) = a²/3 + a⁶/315 + 2a⁸/2835 + …, by powers of a² from
/// a² on. At a = 0.25 the first term left out is below 1e-18.
const COMPRESSION_SERIES: [f64; 10] = [
    1.0 / 3.0,
    0.0,
    1.0 / 315.0,
    2.0 / 2835.0,
    1.924001924001924e-4,
    5.558227780450003e-5,
    1.684069408937134e-5,
    5.290417988830688e-6,
    1.709757377066536e-6,
    5.652841830154427e-7,
];

/// Coefficients of tan(a)/a − 1 = a²/3 + 2a⁴/15 + …, by powers of a² from a²
/// on; ended as [`COMPRESSION_SERIES`].
const TANGENT_SERIES: [f64; 12] = [
    1.0 / 3.0,
    2.0 / 15.0,
    17.0 / 315.0,
    62.0 / 2835.0,
    8.863235529902197e-3,
    3.592128036572481e-3,
    1.455834387051318e-3,
    5.90027440945586e-4,
    2.391291114243552e-4,
    9.691537956929451e-5,
    3.927832388331683e-5,
    1.591890506932896e-5,
];

impl LayerKinematics {
    /// The motion at a relative compression e = U/H.
    ///
    /// Solves e = 1 − cos(a)·asinh(tan a)/a for 0 ≤ a < π/2. The root is
    /// unique there and the equation has meaningless ones above π/2, so the
    /// search is bracketed.
    ///
    /// # Errors
    /// [`LayerError::Compression`] outside 0 ≤ e < 1.
    ///
    /// ```
    /// use taxel::mechanics::LayerKinematics;
    /// let layer = LayerKinematics::new(0.4)?;
    /// assert!((layer.unknown() - 1.08550713).abs() < 5e-9);
    /// assert!((layer.top_stretch() - 2.14378730).abs() < 5e-9);
    /// assert!(LayerKinematics::new(f64::NAN).is_err());
    /// # Ok::<(), taxel::mechanics::LayerError>(())
    /// ```
    pub fn new(compression: f64) -> Result<Self, LayerError> {
        if !(0.0..1.0).contains(&compression) {
            return Err(LayerError::Compression { compression });
        }
        let (unknown, complement) = if compression <= NEAR_ONE {
            let a = solve_unknown(compression);
            (a, FRAC_PI_2 - a)
        } else {
            let k = solve_complement(1.0 - compression);
            (FRAC_PI_2 - k, k)
        };
        Ok(Self {
            compression,
            unknown,
            complement,
        })
    }

    /// Relative compression e = U/H.
    pub fn compression(&self) -> f64 {
        self.compression
    }

    /// The kinematic unknown a = α H, from 0 to π/2.
    pub fn unknown(&self) -> f64 {
        self.unknown
    }

    /// Sideways stretch of the pressed face, λ = f(1) = 1/cos a.
    pub fn top_stretch(&self) -> f64 {
        1.0 / self.complement.sin()
    }

    /// Sideways stretch less one at the relative height `y`:
    /// f(y) − 1 = cos(a(1−y))/cos a − 1 (P1 Eq. 2), without cancellation.
    ///
    /// `y` is taken into 0 to 1.
    pub fn stretch_excess(&self, y: f64) -> f64 {
        let half = 0.5 * y.clamp(0.0, 1.0);
        let a = self.unknown;
        2.0 * (a * (1.0 - half)).sin() * (a * half).sin() / self.complement.sin()
    }

    /// Sideways stretch f at the relative height `y`.
    pub fn stretch(&self, y: f64) -> f64 {
        1.0 + self.stretch_excess(y)
    }

    /// f′ = a sin(a(1−y))/cos a.
    pub fn stretch_slope(&self, y: f64) -> f64 {
        let a = self.unknown;
        a * (a * (1.0 - y.clamp(0.0, 1.0))).sin() / self.complement.sin()
    }

    /// Present height g of what lay at the relative height `y` (P1 Eq. 3).
    pub fn height(&self, y: f64) -> f64 {
        self.slab(0.0, y)
    }

    /// g′ = 1/f.
    pub fn height_slope(&self, y: f64) -> f64 {
        1.0 / self.stretch(y)
    }

    /// Present thickness of what lay between two relative heights,
    /// g(high) − g(low); both are taken into 0 to 1.
    ///
    /// With ϑ = a y/2 and k = π/2 − a, P1 Eq. 3 is
    /// g = (cos a/a)·ln[tan(ϑ + k/2)/tan(k/2)], and the ratio of two tangents
    /// less one is a quotient of sines: no cancellation at either end.
    pub fn slab(&self, low: f64, high: f64) -> f64 {
        let (low, high) = (low.clamp(0.0, 1.0), high.clamp(0.0, 1.0));
        let (a, k) = (self.unknown, self.complement);
        if a == 0.0 {
            return high - low;
        }
        let (below, above) = (0.5 * a * low + 0.5 * k, 0.5 * a * high + 0.5 * k);
        let ratio_less_one = (0.5 * a * (high - low)).sin() / (below.sin() * above.cos());
        k.sin() / a * ratio_less_one.ln_1p()
    }

    /// The constant Π of the pressure over μ, from the balance of horizontal
    /// forces on one half of a layer of `aspect` ℓ with the end factor χ:
    ///
    /// Π/μ = [(tan a/a)(1 + χ a²ℓ²/2) − sin(2a)/(8a)]/(1 − e) − cos²(a)/4
    pub fn pressure_constant(&self, aspect: f64, end_factor: f64) -> f64 {
        let (a, cos) = (self.unknown, self.complement.sin());
        let sine_ratio = if a == 0.0 { 1.0 } else { a.sin() / a };
        let pull = (1.0 + self.tangent_excess()) * (1.0 + 0.5 * end_factor * (a * aspect).powi(2));
        (pull - 0.25 * sine_ratio * cos) / (1.0 - self.compression) - 0.25 * cos * cos
    }

    /// Mean nominal stress over μ, pressing positive:
    /// s̄/μ = λ (Π/μ − a²ℓ²λ²/6 − cos²(a)/2) (P1 Eq. 6).
    ///
    /// Small e: e (ℓ²(9χ−3)/6 + 9/2) + …; for χ = 1, e (ℓ² + 9/2).
    pub fn mean_stress(&self, aspect: f64, end_factor: f64) -> f64 {
        // Π put in and sorted: each bracket but the first adds positive terms.
        let (a, stretch, tangent) = (self.unknown, self.top_stretch(), self.tangent_excess());
        let height = 1.0 - self.compression;
        let by_length = end_factor * (1.0 + tangent) / (2.0 * height) - stretch * stretch / 6.0;
        let alone = 0.75 * (tangent + self.compression) / height
            + a.sin().powi(2) * ((1.0 + tangent) / (4.0 * height) + 0.75);
        stretch * ((a * aspect).powi(2) * by_length + alone)
    }

    /// tan(a)/a − 1.
    fn tangent_excess(&self) -> f64 {
        let a = self.unknown;
        if a < SMALL {
            series(&TANGENT_SERIES, a * a)
        } else {
            1.0 / (self.complement.tan() * a) - 1.0
        }
    }

    /// The pressure P at the material point (`x1`, `y`), Pa (P1 Eq. 5), with
    /// A = −a²:
    ///
    /// P = C₂x₁²f′² + (C₁−C₂)/2·A x₁²f² + (C₁+C₂)/2/f² + C₂f² + Π
    pub fn pressure(
        &self,
        material: StressConstants,
        pressure_constant: f64,
        [x1, y]: [f64; 2],
    ) -> f64 {
        let StressConstants { c1, c2 } = material;
        let (f, slope) = (self.stretch(y), self.stretch_slope(y));
        c2 * (x1 * slope).powi(2) - 0.5 * (c1 - c2) * (self.unknown * x1 * f).powi(2)
            + 0.5 * (c1 + c2) / (f * f)
            + c2 * f * f
            + material.shear_modulus() * pressure_constant
    }

    /// The stresses at the material point (`x1`, `y`), Pa (P1 Eq. 4 with the
    /// primes of 4c restored):
    ///
    /// σ₁₁ = −P + C₁(f² + (x₁f′)²) + C₂g′²,  σ₁₂ = (C₁−C₂) x₁f′g′,
    /// σ₂₂ = −P + C₁g′² + C₂(f² + x₁²f′²)
    ///
    /// `pressure_constant` is Π/μ.
    pub fn stress(
        &self,
        material: StressConstants,
        pressure_constant: f64,
        point: [f64; 2],
    ) -> PlaneStress {
        let StressConstants { c1, c2 } = material;
        let [x1, y] = point;
        let (f, squeeze) = (self.stretch(y), self.height_slope(y));
        let shear = x1 * self.stretch_slope(y);
        let pressure = self.pressure(material, pressure_constant, point);
        let (along, upwards) = (f * f + shear * shear, squeeze * squeeze);
        PlaneStress {
            sigma11: -pressure + c1 * along + c2 * upwards,
            sigma12: (c1 - c2) * shear * squeeze,
            sigma22: -pressure + c1 * upwards + c2 * along,
        }
    }
}

fn as_drawn() -> f64 {
    1.0
}

/// Σ cᵢ x^{i+1}.
fn series(coefficients: &[f64], x: f64) -> f64 {
    x * coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// a from e, 0 ≤ e ≤ [`NEAR_ONE`].
fn solve_unknown(compression: f64) -> f64 {
    if compression == 0.0 {
        return 0.0;
    }
    // a² = 3e − (9/35)e³ − (6/35)e⁴ − …: close from below 0.25, safe above.
    let e = compression;
    let start = (3.0 * e - 9.0 / 35.0 * e.powi(3) - 6.0 / 35.0 * e.powi(4)).sqrt();
    roots::newton(start, [0.0, FRAC_PI_2], |a| {
        let angle = a.tan().asinh();
        let at_a = if a < SMALL {
            series(&COMPRESSION_SERIES, a * a)
        } else {
            1.0 - a.cos() * angle / a
        };
        (at_a - e, (a.sin() * angle - at_a) / a)
    })
}

/// k = π/2 − a from 1 − e = sin(k)·asinh(cot k)/(π/2 − k), e > [`NEAR_ONE`].
fn solve_complement(height: f64) -> f64 {
    // k → 0: 1 − e → (2k/π) ln(2/k).
    let start = (0..3).fold(FRAC_PI_4 * height, |k, _| {
        FRAC_PI_2 * height / (2.0 / k).ln()
    });
    roots::newton(start, [0.0, 0.1], |k| {
        let (a, angle) = (FRAC_PI_2 - k, k.tan().recip().asinh());
        let at_k = k.sin() * angle / a;
        (at_k - height, (k.cos() * angle - 1.0 + at_k) / a)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_and_closed_form_meet() {
        let below = LayerKinematics::new(0.0208).unwrap();
        assert!(below.unknown() < SMALL);
        // The closed form loses two digits here.
        let closed = below.unknown().tan() / below.unknown() - 1.0;
        assert!((below.tangent_excess() / closed - 1.0).abs() < 1e-13);
        let a = below.unknown();
        let compression = 1.0 - a.cos() * a.tan().asinh() / a;
        assert!((compression / 0.0208 - 1.0).abs() < 1e-13);
    }

    #[test]
    fn forms_for_a_and_its_complement_meet() {
        // Just below and above 0.9; the unknown moves by 0.4 of the change.
        let [below, above] = [0.9, 0.9 + 1e-12].map(|e| LayerKinematics::new(e).unwrap());
        assert!((below.unknown() - above.unknown()).abs() < 1e-12);
        assert!((below.complement / above.complement - 1.0).abs() < 1e-10);
    }

    #[test]
    fn the_last_compression_below_one_has_a_finite_stretch() {
        let last = LayerKinematics::new(1.0 - f64::EPSILON / 2.0).unwrap();
        assert!(last.top_stretch() > 1e16 && last.top_stretch().is_finite());
        // The height of the whole layer is what is left of it.
        assert!((last.height(1.0) / (f64::EPSILON / 2.0) - 1.0).abs() < 1e-12);
    }
}
