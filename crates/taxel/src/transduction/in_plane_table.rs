//! What is read from the table of an in-plane sensor.

use super::path_table::{Contents, Course, PathTable, PathVariable};
use crate::mechanics::{CompressedLayer, DeformedElectrodes, LARGEST_COMPRESSION};

/// Numbers of a node.
pub const NUMBERS: usize = 5;
/// Index of the mean stress among them, Pa.
pub const STRESS: usize = 0;
/// Index of the capacitance, F.
pub const CAPACITANCE: usize = 4;

/// What the table of an in-plane sensor holds.
pub static CONTENTS: Contents = Contents {
    device: "in_plane_capacitor",
    variable: PathVariable {
        name: "compression",
        unit: "",
        scale: 1.0,
        key: "",
    },
    largest: LARGEST_COMPRESSION,
    numbers: &[
        ("mean_stress_pa", Course::Rising),
        ("gap_m", Course::Positive),
        ("thickness_m", Course::Positive),
        ("width_m", Course::Positive),
        ("capacitance_f", Course::Positive),
    ],
    errors: ["force", "change"],
};

/// A table with the drawing that it belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnTable {
    /// The table.
    pub table: PathTable,
    /// Layer of the closed form, as drawn.
    pub(super) closed: CompressedLayer,
}

impl DrawnTable {
    /// Largest compression that was solved.
    pub(super) fn largest_compression(&self) -> f64 {
        self.table.end()
    }

    /// Mean stress of a layer at a compression, Pa, whose closed form gives `closed`: a calibrated
    /// layer differs from the drawn one as their closed forms do.
    pub(super) fn stress(&self, compression: f64, closed: f64) -> f64 {
        let drawn = self
            .closed
            .compress(compression)
            .map_or(0.0, |layer| layer.mean_stress);
        let ratio = if drawn > 0.0 { closed / drawn } else { 1.0 };
        ratio * self.table.at::<NUMBERS>(compression)[STRESS]
    }

    /// Gap, thickness and width at a compression for those at rest: a made gap opens as the drawn
    /// one does.
    pub(super) fn deform(&self, rest: &DeformedElectrodes, compression: f64) -> DeformedElectrodes {
        let [_, gap, thickness, width, _] = self.table.at::<NUMBERS>(compression);
        let [_, drawn_gap, drawn_thickness, drawn_width, _] = self.table.at::<NUMBERS>(0.0);
        DeformedElectrodes {
            gap: rest.gap * gap / drawn_gap,
            thickness: rest.thickness * thickness / drawn_thickness,
            width: rest.width * width / drawn_width,
        }
    }

    /// The drawn electrodes at a compression.
    pub(super) fn drawn(&self, compression: f64) -> DeformedElectrodes {
        let [_, gap, thickness, width, _] = self.table.at::<NUMBERS>(compression);
        DeformedElectrodes {
            gap,
            thickness,
            width,
        }
    }

    /// Capacitance of the drawn electrodes at a compression, F.
    pub(super) fn capacitance(&self, compression: f64) -> f64 {
        self.table.at::<NUMBERS>(compression)[CAPACITANCE]
    }

    /// Larger of the known errors of the force at a compression, as a share of it.
    pub(super) fn force_error(&self, compression: f64) -> Option<f64> {
        let errors = [&self.table.interpolation, &self.table.mesh];
        let error = errors
            .map(|errors| errors.of("force"))
            .into_iter()
            .fold(0.0, f64::max);
        let stress = self.table.at::<NUMBERS>(compression)[STRESS];
        let [_, end] = self.table.ends();
        (stress > 0.0).then(|| error * end[STRESS] / stress)
    }
}
