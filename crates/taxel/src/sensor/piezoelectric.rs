//! The piezoelectric element in silicone as a sensor file describes it.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::mechanics::{
    DiscGrip, LayerLaw, LayerRim, PreloadError, Preloaded, SeatedSetting, SoftLayer,
};
use crate::quantity::{
    self, AnyChargePerForce, Checked, Fraction, NonNegativeForce, NonNegativeViscosity,
    PositiveArea, PositiveCapacitance, PositiveChargePerForce, PositiveDensity, PositiveForce,
    PositiveLength, PositiveResistance, PositiveStress, Ratio,
};
use crate::trained::IndentationMap;
use crate::transduction::{Ceramic, PiezoelectricElement, SiliconePath};
use taxel_numerics::Noise;

/// Piezoelectric plates in a soft cover (P3).
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Piezoelectric {
    /// Force on one element at the end of the colour scale, N.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub full_scale: f64,
    /// The plate and its circuit.
    pub ceramic: CeramicDescription,
    /// Where the plate lies in the silicone under a rigid disc, for `in_plane = "bonded"`;
    /// without it, where `cover.share_above` puts it.
    #[serde(default)]
    pub seat: Option<Seat>,
    /// Whether the silicone stretches the plate in its plane under a rigid disc; default
    /// `ignored`. For `taxel predict`.
    #[serde(default)]
    pub in_plane: InPlane,
    /// The silicone around it.
    pub cover: CoverDescription,
    /// Scatter of fabricated devices about the drawing; used by the twin.
    pub fabrication: PiezoelectricFabrication,
    /// Map from indentations of this device; only a calibration gives it.
    #[serde(skip)]
    pub indentations: Option<IndentationMap>,
}

/// Where a plate lies in the silicone.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Seat {
    /// On the base.
    Base,
    /// In the middle of the silicone.
    Middle,
    /// Elsewhere.
    At(SeatHeight),
}

/// A plate at a height.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SeatHeight {
    /// Middle of the plate above the base, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub height: f64,
}

/// Stress in the plane of a plate under a rigid disc.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InPlane {
    /// Left out: the charge is d33 times the force normal to the plate.
    #[default]
    Ignored,
    /// Of a stiff plate that is bonded to the silicone; needs
    /// `ceramic.charge_per_force_transverse`.
    Bonded,
}

/// Contact of a load.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CoverContact {
    /// An even pressure over a disc, on the silicone above the plate.
    #[default]
    Pressure,
    /// The pressure of a frictionless sphere on the silicone above the plate.
    Sphere,
    /// A rigid disc on all of the silicone.
    RigidDisc,
}

/// A square plate poled through its thickness.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CeramicDescription {
    /// Side of the square, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub side: f64,
    /// Thickness, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub thickness: f64,
    /// Modulus of elasticity through the thickness, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub modulus: f64,
    /// Density, kg/m³.
    #[serde(deserialize_with = "quantity::one::<PositiveDensity, _>")]
    #[schemars(with = "Checked<PositiveDensity>")]
    pub density: f64,
    /// Damping ratio of the plate alone.
    #[serde(deserialize_with = "quantity::one::<Ratio, _>")]
    #[schemars(with = "Checked<Ratio>")]
    pub damping_ratio: f64,
    /// Charge per force d33, C/N.
    #[serde(deserialize_with = "quantity::one::<PositiveChargePerForce, _>")]
    #[schemars(with = "Checked<PositiveChargePerForce>")]
    pub charge_per_force: f64,
    /// Charge per force in the plane d31, C/N; below zero for PZT. Without it the interval of
    /// the charge is not known.
    #[serde(default, deserialize_with = "quantity::some::<AnyChargePerForce, _>")]
    #[schemars(with = "Option<Checked<AnyChargePerForce>>")]
    pub charge_per_force_transverse: Option<f64>,
    /// Capacitance of element, cable and input, F.
    #[serde(deserialize_with = "quantity::one::<PositiveCapacitance, _>")]
    #[schemars(with = "Checked<PositiveCapacitance>")]
    pub capacitance: f64,
    /// Resistance through which the charge leaks, ohm.
    #[serde(deserialize_with = "quantity::one::<PositiveResistance, _>")]
    #[schemars(with = "Checked<PositiveResistance>")]
    pub leak_resistance: f64,
}

/// The silicone in which the plates lie.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoverDescription {
    /// All silicone in the way of the force, above and below the plate, without
    /// load, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub thickness: f64,
    /// Share of it above the plate: the cover that spreads a load.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    #[schemars(with = "Checked<Fraction>")]
    pub share_above: f64,
    /// Modulus of elasticity, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub modulus: f64,
    /// Viscosity, Pa s.
    #[serde(deserialize_with = "quantity::one::<NonNegativeViscosity, _>")]
    #[schemars(with = "Checked<NonNegativeViscosity>")]
    pub viscosity: f64,
    /// Area of the silicone column that presses on one plate, m².
    #[serde(deserialize_with = "quantity::one::<PositiveArea, _>")]
    #[schemars(with = "Checked<PositiveArea>")]
    pub column_area: f64,
    /// Law under the preload.
    pub law: LayerLaw,
    /// Force with which the tester is held against the cover, N.
    #[serde(deserialize_with = "quantity::one::<NonNegativeForce, _>")]
    #[schemars(with = "Checked<NonNegativeForce>")]
    pub preload: f64,
    /// Area on which the preload stands, m².
    #[serde(deserialize_with = "quantity::one::<PositiveArea, _>")]
    #[schemars(with = "Checked<PositiveArea>")]
    pub preload_area: f64,
    /// Contact of a load that `taxel predict` places by its radius; default `pressure`.
    #[serde(default)]
    pub contact: CoverContact,
    /// Where the silicone ends, for a rigid disc; default `flush`.
    #[serde(default)]
    pub rim: LayerRim,
    /// Whether the silicone slides along a rigid disc; default `gripped`.
    #[serde(default)]
    pub grip: DiscGrip,
}

/// Scatter of the made device about its drawing.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PiezoelectricFabrication {
    /// Relative standard deviation of the signal from element to element.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    #[schemars(with = "Checked<Fraction>")]
    pub gain_deviation: f64,
    /// Seed of this scatter: the same seed is the same piece.
    pub seed: u64,
}

impl Piezoelectric {
    /// The model of one element.
    pub fn element(&self) -> PiezoelectricElement {
        let ceramic = &self.ceramic;
        let plate = Ceramic {
            area: ceramic.side * ceramic.side,
            thickness: ceramic.thickness,
            modulus: ceramic.modulus,
            density: ceramic.density,
            damping_ratio: ceramic.damping_ratio,
        };
        PiezoelectricElement::new(
            &plate,
            ceramic.charge_per_force,
            ceramic.capacitance,
            ceramic.leak_resistance,
        )
    }

    /// The silicone under its preload.
    ///
    /// # Errors
    /// [`PreloadError`] where its law cannot carry the preload.
    pub fn preloaded(&self) -> Result<Preloaded, PreloadError> {
        let cover = &self.cover;
        let layer = SoftLayer {
            thickness: cover.thickness,
            modulus: cover.modulus,
            law: cover.law,
        };
        layer.preloaded(cover.preload, cover.preload_area)
    }

    /// The silicone column over one element under its preload: the stiffness of
    /// the law (P3 Eq. 17 for the linear one), and b_s = μ A_e/t_e.
    ///
    /// # Errors
    /// As [`Piezoelectric::preloaded`].
    pub fn path(&self) -> Result<SiliconePath, PreloadError> {
        let pressed = self.preloaded()?;
        Ok(SiliconePath {
            stiffness: pressed.stiffness_per_area * self.cover.column_area,
            damping: self.cover.viscosity * self.cover.column_area / pressed.thickness,
        })
    }

    /// Silicone above the elements without preload, m: what spreads a touch.
    pub fn depth(&self) -> f64 {
        self.cover.share_above * self.cover.thickness
    }

    /// Height of the middle of the elements above the base, without preload, m.
    pub fn seat_height(&self) -> f64 {
        let (cover, plate) = (&self.cover, self.ceramic.thickness);
        match self.seat {
            Some(Seat::Base) => 0.5 * plate,
            Some(Seat::Middle) => 0.5 * cover.thickness,
            Some(Seat::At(seat)) => seat.height,
            None => 0.5 * plate + (1.0 - cover.share_above) * (cover.thickness - plate),
        }
    }

    /// What the table of elements in their layer was solved for, under a disc of this area, m².
    pub fn seated(&self, disc_area: f64) -> SeatedSetting {
        SeatedSetting {
            disc_area,
            element_area: self.ceramic.side * self.ceramic.side,
            element_thickness: self.ceramic.thickness,
            thickness: self.cover.thickness,
        }
    }

    /// d33 and d31, C/N; `None` without d31.
    pub fn charge_constants(&self) -> Option<[f64; 2]> {
        let ceramic = &self.ceramic;
        let transverse = ceramic.charge_per_force_transverse?;
        Some([ceramic.charge_per_force, transverse])
    }

    /// Gain of each of `elements` elements of one piece about the drawing, cut
    /// at three standard deviations.
    pub fn fabricate(&self, elements: usize) -> Vec<f64> {
        let mut scatter = Noise::seeded(self.fabrication.seed);
        let spread = self.fabrication.gain_deviation;
        (0..elements)
            .map(|_| 1.0 + spread * scatter.normal().clamp(-3.0, 3.0))
            .collect()
    }
}
