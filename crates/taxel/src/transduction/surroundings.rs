//! Surroundings of the two electrodes, and the capacitance that the board measures.

use schemars::JsonSchema;
use serde::Deserialize;

use super::tilted_plate::VACUUM_PERMITTIVITY;
use crate::mechanics::{CompressedLayer, Electrodes, OutsideTable};
use taxel_numerics::table::{extrapolate, interpolate};

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
/// Compressions of the table.
const COMPRESSIONS: [f64; 5] = [0.0, 0.05, 0.1, 0.2, 0.3];
/// Gaps over electrode thickness of the table.
const GAPS: [f64; 3] = [0.2, 0.5, 1.0];

impl Surroundings {
    /// Capacitance that the surroundings add in a uniform medium, F.
    ///
    /// Finite elements of the deformed published cross-section, C − C_uniform
    /// over ε₀ w_e to about 0.02, interpolated in the logarithm of the gap and
    /// in the compression. Range as [`Surroundings::check`] says.
    pub fn offset(self, gap_over_thickness: f64, compression: f64, depth: f64) -> f64 {
        let Some(table) = self.table() else {
            return 0.0;
        };
        let by_gap = table.map(|row| interpolate(&COMPRESSIONS, &row, compression));
        VACUUM_PERMITTIVITY
            * depth
            * extrapolate(&GAPS.map(f64::ln), &by_gap, gap_over_thickness.ln())
    }

    /// Largest compression of the table; none for a closed form.
    pub fn largest_compression(self) -> Option<f64> {
        self.table().map(|_| COMPRESSIONS[COMPRESSIONS.len() - 1])
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

    /// (C − C_uniform)/(ε₀ w_e) for each of [`GAPS`] at each of
    /// [`COMPRESSIONS`].
    fn table(self) -> Option<[[f64; 5]; 3]> {
        Some(match self {
            Self::Uniform => return None,
            Self::AirAbove => [
                [-0.6161, -0.6760, -0.7409, -0.8870, -1.0574],
                [-0.6235, -0.6834, -0.7483, -0.8939, -1.0627],
                [-0.6349, -0.6947, -0.7591, -0.9025, -1.0658],
            ],
            Self::AirAboveGlassBelow => [
                [-0.2273, -0.2375, -0.2447, -0.2446, -0.2135],
                [-0.2282, -0.2378, -0.2443, -0.2420, -0.2077],
                [-0.2292, -0.2376, -0.2425, -0.2359, -0.1938],
            ],
            Self::AirAboveBelow => [
                [-0.9700, -1.0660, -1.1713, -1.4130, -1.7033],
                [-0.9822, -1.0785, -1.1840, -1.4257, -1.7147],
                [-1.0013, -1.0979, -1.2033, -1.4433, -1.7266],
            ],
            Self::GroundedBase => [
                [0.5094, 0.6232, 0.7695, 1.2061, 1.9651],
                [0.5242, 0.6414, 0.7917, 1.2396, 2.0169],
                [0.5490, 0.6718, 0.8290, 1.2961, 2.1048],
            ],
            Self::GroundedBaseMutual => [
                [-2.9558, -3.0869, -3.2289, -3.5492, -3.9268],
                [-2.9714, -3.1028, -3.2449, -3.5649, -3.9408],
                [-2.9958, -3.1271, -3.2689, -3.5863, -3.9549],
            ],
            Self::GroundedBaseUniform => [
                [1.0806, 1.2548, 1.4685, 2.0620, 3.0111],
                [1.1045, 1.2822, 1.5000, 2.1047, 3.0706],
                [1.1439, 1.3273, 1.5518, 2.1740, 3.1658],
            ],
            Self::GroundedBaseUniformMutual => [
                [-2.7682, -2.8502, -2.9382, -3.1350, -3.3651],
                [-2.7801, -2.8621, -2.9502, -3.1468, -3.3763],
                [-2.7987, -2.8807, -2.9686, -3.1641, -3.3909],
            ],
        })
    }
}
