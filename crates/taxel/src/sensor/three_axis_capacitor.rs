//! The three-axis capacitive taxel as a sensor file describes it.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::mechanics::{ForceHysteresis, RelaxationTerm, SuspensionDescription};
use crate::quantity::{self, Checked, NonNegativeLength, PositiveForce, PositiveLength};
use crate::transduction::PlatesDescription;
use crate::transduction::UnitModel;
use taxel_numerics::Noise;

/// Four capacitors under one bump (P2).
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThreeAxisCapacitor {
    /// The four plate pairs.
    pub plates: PlatesDescription,
    /// Suspension that carries the bump and the upper plates.
    pub suspension: SuspensionDescription,
    /// Relaxing springs beside the long-time stiffness; an empty list is a
    /// unit that does not creep.
    pub relaxation: Vec<RelaxationTerm>,
    /// Force on each axis that the device is meant for, N.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub full_scale: f64,
    /// Force on each axis up to which the model was verified, N.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub usable_force: f64,
    /// The drawing around the electrodes.
    pub outline: Outline,
    /// Scatter of fabricated devices about the drawing; used by the twin.
    pub fabrication: Fabrication,
    /// Taxels that were calibrated, in the place of their drawing: a sensor
    /// file has no such key, a calibration file sets it.
    #[serde(skip)]
    pub calibrated: Vec<CalibratedUnit>,
    /// Hysteresis of the force along x, y and z, where a calibration identified it.
    #[serde(skip)]
    pub hysteresis: [Option<ForceHysteresis>; 3],
}

/// The model of one calibrated taxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibratedUnit {
    /// Number of the taxel, row by row.
    pub taxel: usize,
    /// Its model.
    pub unit: UnitModel,
}

/// Scatter of the made device about its drawing.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fabrication {
    /// Standard deviation of the air gap from capacitor to capacitor, m.
    #[serde(deserialize_with = "quantity::one::<NonNegativeLength, _>")]
    #[schemars(with = "Checked<NonNegativeLength>")]
    pub air_gap_deviation: f64,
    /// Seed of this scatter: the same seed is the same piece.
    pub seed: u64,
}

/// Lengths of the drawing that the electrical model does not use.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Outline {
    /// Side of the unit, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub unit_side: f64,
    /// Width of the wall between neighbouring capacitors, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub wall_width: f64,
    /// Side of the bump at its base, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub bump_base: f64,
    /// Side of the flat top of the bump, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub bump_top: f64,
    /// Height of the bump, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub bump_height: f64,
    /// Layer between bump and upper electrode layer, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub bump_layer: f64,
    /// Electrode layer with its electrodes, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub electrode_layer: f64,
    /// Electrode thickness, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub electrode_thickness: f64,
}

impl ThreeAxisCapacitor {
    /// The model of one unit.
    pub fn unit_model(&self) -> UnitModel {
        UnitModel {
            suspension: self.suspension.model(),
            plates: self.plates.model(),
        }
    }

    /// The models of all taxels: as calibrated, or else as drawn.
    pub fn unit_models(&self, taxels: usize) -> Vec<UnitModel> {
        self.with_calibrated(vec![self.unit_model(); taxels])
    }

    fn with_calibrated(&self, mut units: Vec<UnitModel>) -> Vec<UnitModel> {
        for calibrated in &self.calibrated {
            if let Some(unit) = units.get_mut(calibrated.taxel) {
                *unit = calibrated.unit;
            }
        }
        units
    }

    /// The units of one piece of fabrication: the air gap of each capacitor
    /// scattered about its drawing, cut at three standard deviations; taxels
    /// that were calibrated are as found.
    pub fn fabricate(&self, taxels: usize) -> Vec<UnitModel> {
        let mut scatter = Noise::seeded(self.fabrication.seed);
        let made = (0..taxels).map(|_| {
            let mut unit = self.unit_model();
            for air in &mut unit.plates.air_gap {
                *air += self.fabrication.air_gap_deviation * scatter.normal().clamp(-3.0, 3.0);
            }
            unit
        });
        self.with_calibrated(made.collect())
    }

    /// Height of the bump's top above the air gap, m: the lever of a side force.
    pub fn lever(&self) -> f64 {
        self.outline.bump_height + self.outline.bump_layer + self.outline.electrode_layer
    }

    /// Torsion coefficients κ = k·h·L about y (from x forces) and about x,
    /// N m/rad (P2 Eqs. 1-5 with height h and centre distance L kept apart).
    pub fn torsion(&self) -> [f64; 2] {
        let arm = self.lever() * self.suspension.centre_distance;
        [
            self.suspension.stiffness[0] * arm,
            self.suspension.stiffness[1] * arm,
        ]
    }
}
