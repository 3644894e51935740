//! Surroundings of the two electrodes, and the capacitance that the board measures.

use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::Deserialize;

use super::tilted_plate::VACUUM_PERMITTIVITY;
use crate::mechanics::{CompressedLayer, Electrodes, OutsideTable};
use crate::solved_table::{Curve, SolvedTable};
use taxel_numerics::table::extrapolate;

/// Surroundings of the layer. P1 prints nothing about them, and they matter:
/// by 4 % of the change for the narrowest gap under air, by 57 % for the
/// widest over a grounded base (compressions of 0.05 to 0.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Surroundings {
    /// The dielectric everywhere, nothing grounded: a closed form.
    Uniform,
    /// Air above and beside the layer, its own permittivity below.
    AirAbove,
    /// Air above, glass (relative permittivity 5.5) below.
    AirAboveGlassBelow,
    /// Air all round.
    AirAboveBelow,
    /// Base at 0 V, air above; the board sees the differential capacitance:
    /// the mutual one and half of that from one electrode to ground.
    GroundedBase,
    /// The same; a guarded readout sees the mutual capacitance alone.
    GroundedBaseMutual,
    /// Base at 0 V, the dielectric above; differential capacitance.
    GroundedBaseUniform,
    /// The same; mutual capacitance alone.
    GroundedBaseUniformMutual,
}

/// Name of the table in messages.
const TABLE: &str = "the table of surroundings";
/// Gaps over electrode thickness of the table.
const GAPS: [f64; 3] = [0.2, 0.5, 1.0];

impl Surroundings {
    /// True with a base at 0 V, which takes field lines away from the electrodes.
    pub fn has_ground(self) -> bool {
        match self {
            Self::Uniform | Self::AirAbove | Self::AirAboveGlassBelow | Self::AirAboveBelow => {
                false
            }
            Self::GroundedBase
            | Self::GroundedBaseMutual
            | Self::GroundedBaseUniform
            | Self::GroundedBaseUniformMutual => true,
        }
    }

    /// Capacitance that the surroundings add in a uniform medium, F.
    ///
    /// Finite elements of the deformed published cross-section, C − C_uniform
    /// over ε₀ w_e to about 0.02, interpolated in the logarithm of the gap and
    /// in the compression. Range as [`Surroundings::check`] says.
    pub fn offset(self, gap_over_thickness: f64, compression: f64, depth: f64) -> f64 {
        let Some(table) = self.table() else {
            return 0.0;
        };
        let by_gap = table.each_ref().map(|curve| curve.at(compression));
        VACUUM_PERMITTIVITY
            * depth
            * extrapolate(&GAPS.map(f64::ln), &by_gap, gap_over_thickness.ln())
    }

    /// Largest compression of the table; none for a closed form.
    pub fn largest_compression(self) -> Option<f64> {
        self.table().map(|table| table[0].end())
    }

    /// Checks that [`Surroundings::offset`] holds for a device: nothing is asked
    /// of `uniform`; for all others ε_r = 2.4, a frictionless top and the
    /// published cross-section (S = 5.5 T, H = 9.5 T, b = 10 T), each to 1 %,
    /// with a gap from 0.2 to 1 T (10 % beyond).
    ///
    /// # Errors
    /// [`OutsideTable`] naming the first quantity that differs.
    pub fn check(
        self,
        layer: &CompressedLayer,
        electrodes: &Electrodes,
        permittivity: f64,
    ) -> Result<(), OutsideTable> {
        if self.table().is_none() {
            return Ok(());
        }
        let range = [2.4 * 0.99, 2.4 * 1.01];
        OutsideTable::check(TABLE, "relative permittivity", permittivity, range)?;
        electrodes.check_section(layer, TABLE)
    }

    /// (C − C_uniform)/(ε₀ w_e) for each of [`GAPS`] against the compression.
    fn table(self) -> Option<&'static [Curve; 3]> {
        TABLES
            .iter()
            .find(|(of, _)| *of == self)
            .map(|(_, table)| table)
    }
}

/// The surroundings of `tables/p1_surroundings.csv`, for each of [`GAPS`] against the
/// compression.
static TABLES: LazyLock<Vec<(Surroundings, [Curve; 3])>> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/p1_surroundings.csv"));
    TABULATED
        .iter()
        .map(|(name, surroundings)| {
            let by_gap = GAPS.map(|gap| {
                table.curve("compression", "added", |row| {
                    row.text("surroundings") == *name && row.number("gap_over_thickness") == gap
                })
            });
            (*surroundings, by_gap)
        })
        .collect()
});

/// The surroundings that are tabulated, by their names in the table.
const TABULATED: [(&str, Surroundings); 7] = [
    ("air_above", Surroundings::AirAbove),
    ("air_above_glass_below", Surroundings::AirAboveGlassBelow),
    ("air_above_below", Surroundings::AirAboveBelow),
    ("grounded_base", Surroundings::GroundedBase),
    ("grounded_base_mutual", Surroundings::GroundedBaseMutual),
    ("grounded_base_uniform", Surroundings::GroundedBaseUniform),
    (
        "grounded_base_uniform_mutual",
        Surroundings::GroundedBaseUniformMutual,
    ),
];
