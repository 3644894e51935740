//! The in-plane capacitive sensor as a sensor file describes it.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::Solvable;
use super::checks::{self, Broken, micrometres, require, rounded_down};
use crate::layout::ArrayDescription;
use crate::mechanics::{CompressedLayer, Electrodes, ForceHysteresis};
use crate::quantity::{self, Checked, NonNegativeLength, PositiveLength, at_most, below};
use crate::solutions::{OfDrawing, Solutions};
use crate::transduction::{
    CapacitanceLaw, Dielectric, DrawnTable, InPlaneModel, PublishedFit, SolvedSection,
};
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
    /// The cross-section solved, where no table has it.
    #[serde(skip)]
    #[schemars(skip)]
    pub(crate) solved: OfDrawing<Arc<SolvedSection>>,
    /// Its load path by finite elements, where `mechanics` names a table.
    #[serde(skip)]
    #[schemars(skip)]
    pub(crate) table: OfDrawing<Arc<DrawnTable>>,
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

impl Solvable for InPlaneCapacitor {
    fn check_lengths(&self, array: &ArrayDescription) -> Result<(), Broken> {
        self.check(array.pitch)
    }

    fn solve(
        &mut self,
        _: &ArrayDescription,
        table: Option<(&str, &str)>,
        solutions: &mut dyn Solutions,
    ) -> Result<(), Broken> {
        self.table = OfDrawing(None);
        match table {
            Some((name, text)) => self.take_table(name, text),
            None => self.solve_section(solutions),
        }
    }
}

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
            solved: self.solved.0.clone(),
            table: self.table.0.clone(),
        }
    }

    /// Takes the text of the table that the sensor file names.
    ///
    /// # Errors
    /// A law that no table has, a text that is none, and the table of another drawing.
    fn take_table(&mut self, name: &str, text: &str) -> Result<(), Broken> {
        require(
            self.law == CapacitanceLaw::Mechanics,
            &key("law"),
            || "the published law has its own thinning and fringe, and takes no table".into(),
            "write law = \"mechanics\", or leave mechanics = { table = … } out",
        )?;
        let mut model = self.model();
        model
            .take_table(text)
            .map_err(|wrong| checks::wrong_table(name, &wrong))?;
        self.table = OfDrawing(model.table);
        Ok(())
    }

    /// Solves the cross-section if a table that it needs does not have it.
    ///
    /// # Errors
    /// The key of a drawing that has no solution.
    fn solve_section(&mut self, solutions: &mut dyn Solutions) -> Result<(), Broken> {
        self.solved = OfDrawing(None);
        let mut model = self.model();
        // A calibration may have found another gap; the drawn one is solved.
        model.solve(solutions).map_err(|unsolved| {
            let help = "change the drawing: higher electrodes or a wider gap fold less, and electrodes as soft as the layer \
                        do not fold at all";
            Broken::new(&key("electrodes"), unsolved.to_string(), help)
        })?;
        self.solved = OfDrawing(model.solved);
        Ok(())
    }

    /// Rules between the lengths of the drawing.
    ///
    /// # Errors
    /// The first broken rule, shown at its key.
    fn check(&self, pitch: [f64; 2]) -> Result<(), Broken> {
        let (layer, electrodes) = (&self.layer, &self.electrodes);
        let top = electrodes.height + electrodes.thickness;
        require(
            below(top, layer.thickness),
            &key("electrodes.height"),
            || {
                format!(
                    "electrodes up to {} do not lie in a layer of {}",
                    micrometres(top),
                    micrometres(layer.thickness)
                )
            },
            "give lower or thinner electrodes, or a thicker layer",
        )?;
        let across = electrodes.gap + 2.0 * electrodes.width;
        let loaded = 2.0 * layer.contact_half_length;
        for (name, length, what) in [
            ("electrodes.width", across, "two electrodes and their gap"),
            ("layer.contact_half_length", loaded, "the loaded length"),
        ] {
            require(
                at_most(length, self.layer_width),
                &key(name),
                || {
                    let width = micrometres(self.layer_width);
                    format!(
                        "{what} need {}; the layer is {width} wide",
                        micrometres(length)
                    )
                },
                "give a smaller length or a wider layer",
            )?;
        }
        for (pitch, need, what) in [
            (pitch[0], self.layer_width, "the layer is"),
            (pitch[1], electrodes.depth, "the electrodes are"),
            (pitch[1], layer.contact_depth, "the loaded part is"),
        ] {
            require(
                at_most(need, pitch),
                "array.pitch",
                || {
                    format!(
                        "{what} {}, more than a pitch of {}",
                        micrometres(need),
                        micrometres(pitch)
                    )
                },
                "give a larger pitch",
            )?;
        }
        let scatter = self.fabrication.gap_deviation;
        let most = 0.1 * electrodes.gap / MOST_SCATTER;
        require(
            at_most(scatter, most),
            &key("fabrication.gap_deviation"),
            || {
                let gap = micrometres(electrodes.gap);
                format!(
                    "{MOST_SCATTER} of these deviations are more than a tenth of the gap of {gap}"
                )
            },
            &format!("give at most {} um", rounded_down(most * 1e6)),
        )
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

fn key(name: &str) -> String {
    format!("element.in_plane_capacitor.{name}")
}
