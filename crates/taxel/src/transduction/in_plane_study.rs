//! Parametric studies of the in-plane sensor: the list of P1's conclusions.

use super::in_plane_model::{InPlaneError, InPlaneModel};
use crate::mechanics::{ElectrodeModulus, ElectrodeStiffness};

/// Parameter that a study varies; P1 names these five.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StudyParameter {
    /// Modulus of the layer, Pa. That of the electrodes stays.
    LayerModulus,
    /// Modulus of the electrodes, Pa.
    ElectrodeModulus,
    /// Height of the electrodes above the base, m.
    ElectrodeHeight,
    /// Thickness of the electrodes, m.
    ElectrodeThickness,
    /// Gap, m.
    Gap,
}

impl StudyParameter {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::LayerModulus,
        Self::ElectrodeModulus,
        Self::ElectrodeHeight,
        Self::ElectrodeThickness,
        Self::Gap,
    ];

    /// The device with this parameter set to `value`.
    pub fn applied(self, base: &InPlaneModel, value: f64) -> InPlaneModel {
        let mut model = base.clone();
        // A table belongs to one drawing.
        model.table = None;
        if self != Self::Gap {
            // Another cross-section than the one that was solved.
            model.solved = None;
        }
        match self {
            Self::LayerModulus => model.layer.youngs_modulus = value,
            Self::ElectrodeModulus => {
                let youngs_modulus = value;
                model.electrodes.stiffness =
                    ElectrodeStiffness::Modulus(ElectrodeModulus { youngs_modulus });
            }
            Self::ElectrodeHeight => model.electrodes.height = value,
            Self::ElectrodeThickness => model.electrodes.thickness = value,
            Self::Gap => model.electrodes.gap = value,
        }
        model
    }
}

/// One device of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyCurve {
    /// Value of the parameter, SI.
    pub value: f64,
    /// Its curve, or why it has none.
    pub points: Result<Vec<StudyPoint>, InPlaneError>,
}

/// One point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StudyPoint {
    /// Relative compression.
    pub compression: f64,
    /// Force, N.
    pub force: f64,
    /// C₀ − C, F.
    pub change: f64,
    /// (C₀ − C)/C₀.
    pub relative_change: f64,
}

/// Change of capacitance against force for several values of one parameter,
/// all else as in `base`, under its law.
///
/// A device outside a table that it needs has an error in place of a curve.
pub fn study(
    base: &InPlaneModel,
    parameter: StudyParameter,
    values: &[f64],
    compressions: &[f64],
) -> Vec<StudyCurve> {
    let curve = |&value: &f64| StudyCurve {
        value,
        points: points(&parameter.applied(base, value), compressions),
    };
    values.iter().map(curve).collect()
}

fn points(model: &InPlaneModel, compressions: &[f64]) -> Result<Vec<StudyPoint>, InPlaneError> {
    model.check()?;
    let rest = model.rest_capacitance();
    let point = |&compression: &f64| {
        model.respond(compression).map(|state| StudyPoint {
            compression,
            force: state.layer.force,
            change: state.change,
            relative_change: state.change / rest,
        })
    };
    compressions.iter().map(point).collect()
}
