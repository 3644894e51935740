//! Arrays of cells as a sensor file describes them: one choice for each stage.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    CellLaw, ChainPart as _, Cover, Creep, LayeredRubber, Memory, NetworkDescription,
    PartParameter, Parts, Points, PressurePort, Resistor,
};
use crate::mechanics::{ForceAxes, RelaxationTerm};
use crate::quantity::{self, Checked, Fraction, PositiveStress};

/// An array of cells on a cover, read through a network.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cells {
    /// Pressure up to which the law of the cells holds, and end of the colour scale, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub full_scale: f64,
    /// Soft layers above the cells; without the key each cell takes what presses on its pitch.
    #[serde(default)]
    pub cover: Option<LayeredRubber>,
    /// Law of a cell.
    pub cell: CellDescription,
    /// How the cells are joined to channels; default `"one_to_one"`.
    #[serde(default)]
    pub network: NetworkDescription,
    /// Relaxing springs of the cell beside its long-time law: it yields under a held pressure.
    #[serde(default)]
    pub relaxation: Vec<RelaxationTerm>,
    /// Standard deviations of what is made, over the value as drawn, by the name of the number;
    /// `taxel check` lists the names.
    #[serde(default)]
    pub fabrication: BTreeMap<String, Share>,
}

/// A standard deviation over the value as drawn.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Share(
    /// 0 to 1.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    #[schemars(with = "Checked<Fraction>")]
    pub f64,
);

/// Law of a cell.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CellDescription {
    /// A resistor that a pressure closes.
    Resistor(Resistor),
    /// The port of a pressure chip.
    PressurePort(PressurePort),
    /// A cell that was measured: its readings at pressures that rise from zero.
    Points(Points),
}

impl Cells {
    fn cell(&mut self) -> &mut dyn CellLaw {
        match &mut self.cell {
            CellDescription::Resistor(cell) => cell,
            CellDescription::PressurePort(cell) => cell,
            CellDescription::Points(cell) => cell,
        }
    }

    /// The parts of the chain of rows x columns; `reference` is the resistor of a divider, Ω.
    pub fn parts(&self, lines: [usize; 2], reference: Option<f64>) -> Parts {
        Parts {
            cover: self.cover.as_ref().map(Cover::boxed),
            cell: self.clone().cell().boxed(),
            axes: ForceAxes::Z,
            network: self.network.between(lines, reference),
            memory: Creep::new(&self.relaxation).map(|creep| Box::new(creep) as Box<dyn Memory>),
            full_scale: self.full_scale,
        }
    }

    /// Shows each number of the parts to `each`, which may change it.
    pub fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        if let Some(cover) = &mut self.cover {
            cover.parameters(each);
        }
        self.cell().parameters(each);
        self.network.parameters(each);
    }
}
