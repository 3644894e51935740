//! The in-plane capacitive sensor as a sensor file describes it.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::mechanics::{CompressedLayer, Electrodes, ForceHysteresis};
use crate::quantity::{self, Checked, NonNegativeLength, PositiveLength};
use crate::transduction::{CapacitanceLaw, Dielectric, InPlaneModel, PublishedFit};
use taxel_numerics::Noise;

/// Two electrodes side by side in a soft layer (P1).
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InPlaneCapacitor {
    /// The loaded part of the layer.
    pub layer: CompressedLayer,
    /// The electrodes in it.
    pub electrodes: Electrodes,
    /// Dielectric between and around the electrodes.
    pub dielectric: Dielectric,
    /// Which law gives the capacitance.
    pub law: CapacitanceLaw,
    /// The published fit of this device; needed by the published law.
    pub published_fit: Option<PublishedFit>,
    /// Width of the whole layer across the gap (w_d), m; used by the drawing.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub layer_width: f64,
    /// Scatter of fabricated devices about the drawing; used by the twin.
    pub fabrication: GapScatter,
    /// Parallel capacitance, F; only a calibration gives it.
    #[serde(skip)]
    pub stray_capacitance: f64,
    /// Hysteresis of the force; only a calibration gives it.
    #[serde(skip)]
    pub hysteresis: Option<ForceHysteresis>,
}

/// Scatter of the made gap about its drawing.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GapScatter {
    /// Standard deviation of the gap from taxel to taxel, m.
    #[serde(deserialize_with = "quantity::one::<NonNegativeLength, _>")]
    #[schemars(with = "Checked<NonNegativeLength>")]
    pub gap_deviation: f64,
    /// Seed of this scatter: the same seed is the same piece.
    pub seed: u64,
}

/// Largest scatter of a piece, in standard deviations.
pub(crate) const MOST_SCATTER: f64 = 3.0;

impl InPlaneCapacitor {
    /// The model of one taxel as drawn.
    pub fn model(&self) -> InPlaneModel {
        InPlaneModel {
            layer: self.layer,
            electrodes: self.electrodes,
            dielectric: self.dielectric,
            published_fit: self.published_fit,
            law: self.law,
            stray_capacitance: self.stray_capacitance,
        }
    }

    /// The taxels of the piece of fabrication that the file describes.
    pub fn fabricate(&self, taxels: usize) -> Vec<InPlaneModel> {
        let mut scatter = Noise::seeded(self.fabrication.seed);
        (0..taxels)
            .map(|_| {
                let mut model = self.model();
                let normal = scatter.normal().clamp(-MOST_SCATTER, MOST_SCATTER);
                model.electrodes.gap += self.fabrication.gap_deviation * normal;
                model
            })
            .collect()
    }
}
