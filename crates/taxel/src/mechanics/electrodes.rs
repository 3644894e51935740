//! Two electrodes side by side in a compressed layer: their gap, thickness and
//! width (P1 section 2.3).

use schemars::JsonSchema;
use serde::Deserialize;

use super::compressed_layer::{CompressedLayer, LayerKinematics, TopFace};
use super::layer_range::LARGEST_COMPRESSION;
use crate::quantity::{self, Checked, Fraction, PositiveLength, PositiveStress, Ratio};
use taxel_numerics::table::{extrapolate, interpolate};

/// A quantity outside the table that would be needed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{quantity} = {value:.4} is outside {least:.4} to {most:.4}, the range of {table}")]
pub struct OutsideTable {
    /// The quantity.
    pub quantity: &'static str,
    /// Its value.
    pub value: f64,
    /// Least value of the table.
    pub least: f64,
    /// Largest value of the table.
    pub most: f64,
    /// The table.
    pub table: &'static str,
}

impl OutsideTable {
    /// Nothing if `value` lies from `least` to `most`.
    pub(crate) fn check(
        table: &'static str,
        quantity: &'static str,
        value: f64,
        [least, most]: [f64; 2],
    ) -> Result<(), Self> {
        if (least..=most).contains(&value) {
            return Ok(());
        }
        Err(Self {
            quantity,
            value,
            least,
            most,
            table,
        })
    }
}

/// The two electrodes as drawn.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Electrodes {
    /// Gap between the facing sides at rest (D), m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub gap: f64,
    /// Thickness at rest (T), m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub thickness: f64,
    /// Height of the lower face above the base at rest (S), m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub height: f64,
    /// Width of one electrode across the gap at rest (b), m. The fringe field
    /// grows with its logarithm without bound.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub width: f64,
    /// Length along the gap (w_e), m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub depth: f64,
    /// Stiffness of the electrodes beside the layer.
    pub stiffness: ElectrodeStiffness,
}

/// Stiffness of electrodes beside the layer.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ElectrodeStiffness {
    /// As the layer, or too thin to disturb it: exact.
    AsLayer,
    /// Electrodes of another modulus: tabulated finite elements of the published
    /// cross-section, any other solved once and kept.
    Modulus(ElectrodeModulus),
}

impl ElectrodeStiffness {
    /// The same electrodes with their modulus times `factor`.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        match self {
            Self::AsLayer => Self::AsLayer,
            Self::Modulus(ElectrodeModulus { youngs_modulus }) => Self::Modulus(ElectrodeModulus {
                youngs_modulus: factor * youngs_modulus,
            }),
        }
    }
}

/// The modulus of the electrodes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElectrodeModulus {
    /// Modulus of elasticity (E_e), Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub youngs_modulus: f64,
}

/// The published empirical thickness t = t_min + (T − t_min) e^{−n U/H}
/// (P1 Eq. 8, Table 1). A fit: its floor t_min does not exist in mechanics.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PublishedThinning {
    /// t_min over the thickness at rest.
    #[serde(deserialize_with = "quantity::one::<Fraction, _>")]
    #[schemars(with = "Checked<Fraction>")]
    pub least_thickness: f64,
    /// n.
    #[serde(deserialize_with = "quantity::one::<Ratio, _>")]
    #[schemars(with = "Checked<Ratio>")]
    pub rate: f64,
}

/// Electrodes after a deformation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeformedElectrodes {
    /// Mean gap (d), m.
    pub gap: f64,
    /// Thickness at the facing sides (t), m.
    pub thickness: f64,
    /// Width of one electrode, m.
    pub width: f64,
}

/// Name of the table in messages.
const TABLE: &str = "the table of stiff electrodes";
/// Compressions of the tables.
const COMPRESSIONS: [f64; 10] = [0.01, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2, 0.25, 0.3];
/// Gaps over electrode thickness of [`RATIO_1_75`].
const GAPS: [f64; 3] = [0.2, 0.5, 1.0];

/// Opening of the gap, thinning and widening at each compression, relative to
/// those of the layer alone.
type Factors = [[f64; 10]; 3];

/// E_e/E_d = 1.75, for each of [`GAPS`]: plane-strain finite elements of the
/// published cross-section, S = 5.5 T, H = 9.5 T, b = 10 T (errors: gap and
/// width 0.05 %, thickness 0.1 %).
#[expect(
    clippy::approx_constant,
    reason = "1.1284 is a factor like its neighbours"
)]
const RATIO_1_75: [Factors; 3] = [
    [
        [
            1.1704, 1.1741, 1.1809, 1.1884, 1.1963, 1.2047, 1.2283, 1.2565, 1.2901, 1.3299,
        ],
        [
            1.1214, 1.1215, 1.1223, 1.1229, 1.1237, 1.1244, 1.1259, 1.1273, 1.1284, 1.1291,
        ],
        [
            0.9624, 0.9622, 0.9626, 0.9630, 0.9632, 0.9636, 0.9647, 0.9662, 0.9682, 0.9709,
        ],
    ],
    [
        [
            1.2680, 1.2723, 1.2811, 1.2900, 1.2992, 1.3087, 1.3334, 1.3592, 1.3852, 1.4104,
        ],
        [
            1.1515, 1.1509, 1.1501, 1.1492, 1.1482, 1.1469, 1.1434, 1.1391, 1.1342, 1.1289,
        ],
        [
            0.9563, 0.9566, 0.9565, 0.9566, 0.9568, 0.9569, 0.9575, 0.9587, 0.9604, 0.9628,
        ],
    ],
    [
        [
            1.2939, 1.2964, 1.3020, 1.3074, 1.3127, 1.3179, 1.3301, 1.3412, 1.3506, 1.3584,
        ],
        [
            1.1229, 1.1215, 1.1195, 1.1175, 1.1153, 1.1132, 1.1078, 1.1026, 1.0980, 1.0942,
        ],
        [
            0.9472, 0.9472, 0.9474, 0.9475, 0.9476, 0.9478, 0.9485, 0.9499, 0.9519, 0.9544,
        ],
    ],
];

/// E_e/E_d = 3.5, for a gap of half the thickness only.
const RATIO_3_5: Factors = [
    [
        1.7831, 1.8041, 1.8481, 1.8949, 1.9444, 1.9967, 2.1362, 2.2794, 2.4118, 2.5282,
    ],
    [
        1.3578, 1.3613, 1.3675, 1.3738, 1.3797, 1.3853, 1.3968, 1.4051, 1.4118, 1.4109,
    ],
    [
        0.8732, 0.8731, 0.8725, 0.8720, 0.8716, 0.8710, 0.8696, 0.8685, 0.8681, 0.8655,
    ],
];

/// Modulus E_e/E_d of [`RATIO_1_75`].
const MIDDLE_RATIO: f64 = 1.75;
/// Modulus E_e/E_d of [`RATIO_3_5`].
const LARGEST_RATIO: f64 = 3.5;
/// A length that the tables hold at one value only may differ by this share.
const SAME: f64 = 0.01;
/// Gaps may lie outside the tables by this share: made ones scatter.
const BEYOND: f64 = 0.1;

impl Electrodes {
    /// The electrodes before any load.
    pub fn at_rest(&self) -> DeformedElectrodes {
        DeformedElectrodes {
            gap: self.gap,
            thickness: self.thickness,
            width: self.width,
        }
    }

    /// Height of their middle above the base, m.
    pub fn middle(&self) -> f64 {
        self.height + 0.5 * self.thickness
    }

    /// Largest compression at which [`Electrodes::deform`] has an answer.
    pub fn largest_compression(&self) -> f64 {
        match self.stiffness {
            ElectrodeStiffness::AsLayer => LARGEST_COMPRESSION,
            ElectrodeStiffness::Modulus(_) => COMPRESSIONS[COMPRESSIONS.len() - 1],
        }
    }

    /// Gap, thickness and width by mechanics.
    ///
    /// d = D (1 + κ_d (f − 1)),  T − t = κ_t (T − [g(S+T) − g(S)]),
    /// and the width as the gap with κ_b; f at the middle of the electrodes.
    ///
    /// Electrodes as soft as the layer have κ = 1: then d = D f is exact. For
    /// stiffer ones κ is interpolated in finite elements (0.1 %): compression
    /// up to 0.3 and a frictionless top; E_e/E_d from 1 to 1.75 for gaps of
    /// 0.2 to 1 thickness, up to 3.5 for a gap of 0.5 thickness, each gap 10 %
    /// beyond to let made ones scatter; S = 5.5 T, H = 9.5 T, b = 10 T to 1 %.
    /// Below e = 0.01 κ stays as it is there.
    ///
    /// # Errors
    /// [`OutsideTable`] for stiffer electrodes outside that range.
    pub fn deform(
        &self,
        layer: &CompressedLayer,
        kinematics: &LayerKinematics,
    ) -> Result<DeformedElectrodes, OutsideTable> {
        let [opening, thinning, widening] = self.factors(layer, kinematics.compression())?;
        let excess = layer.stretch_excess(kinematics, self.middle());
        let slab = layer.slab(kinematics, self.height, self.height + self.thickness);
        Ok(DeformedElectrodes {
            gap: self.gap * (1.0 + opening * excess),
            thickness: self.thickness - thinning * (self.thickness - slab),
            width: self.width * (1.0 + widening * excess),
        })
    }

    /// Gap of the layer alone, d = D f, and thickness by the published fit
    /// (P1 Eq. 8).
    pub fn deform_as_published(
        &self,
        layer: &CompressedLayer,
        kinematics: &LayerKinematics,
        thinning: &PublishedThinning,
    ) -> DeformedElectrodes {
        let stretch = 1.0 + layer.stretch_excess(kinematics, self.middle());
        let thinned = -(-thinning.rate * kinematics.compression()).exp_m1();
        DeformedElectrodes {
            gap: self.gap * stretch,
            thickness: self.thickness * (1.0 - (1.0 - thinning.least_thickness) * thinned),
            width: self.width * stretch,
        }
    }

    /// κ of gap, thickness and width.
    fn factors(&self, layer: &CompressedLayer, compression: f64) -> Result<[f64; 3], OutsideTable> {
        let ElectrodeStiffness::Modulus(ElectrodeModulus { youngs_modulus }) = self.stiffness
        else {
            return Ok([1.0; 3]);
        };
        let ratio = youngs_modulus / layer.youngs_modulus;
        self.check_section(layer, TABLE)?;
        let last = [0.0, self.largest_compression()];
        OutsideTable::check(TABLE, "compression", compression, last)?;
        let gap = self.gap / self.thickness;
        let most = if (gap / GAPS[1] - 1.0).abs() <= BEYOND {
            LARGEST_RATIO
        } else {
            MIDDLE_RATIO
        };
        let name = "electrode modulus over layer modulus";
        OutsideTable::check(TABLE, name, ratio, [1.0, most])?;
        let middle = |quantity: usize| {
            let by_gap =
                RATIO_1_75.map(|table| interpolate(&COMPRESSIONS, &table[quantity], compression));
            extrapolate(&GAPS.map(f64::ln), &by_gap, gap.ln())
        };
        Ok(std::array::from_fn(|quantity| {
            let largest = || interpolate(&COMPRESSIONS, &RATIO_3_5[quantity], compression);
            if ratio <= MIDDLE_RATIO {
                1.0 + (middle(quantity) - 1.0) * (ratio - 1.0) / (MIDDLE_RATIO - 1.0)
            } else {
                let share = (ratio - MIDDLE_RATIO) / (LARGEST_RATIO - MIDDLE_RATIO);
                middle(quantity) + share * (largest() - middle(quantity))
            }
        }))
    }

    /// Checks that this is the published cross-section, for which `table` was
    /// computed: any gap from 0.2 to 1 thickness (10 % beyond), all else in
    /// proportion.
    ///
    /// # Errors
    /// [`OutsideTable`] naming the first length that differs.
    pub(crate) fn check_section(
        &self,
        layer: &CompressedLayer,
        table: &'static str,
    ) -> Result<(), OutsideTable> {
        let about = |value: f64| [value * (1.0 - SAME), value * (1.0 + SAME)];
        let near_ends = [GAPS[0] * (1.0 - BEYOND), GAPS[2] * (1.0 + BEYOND)];
        let halves = match layer.top {
            TopFace::Frictionless => 1.0,
            TopFace::Gripped => 2.0,
        };
        for (quantity, value, range) in [
            (
                "frictionless layers between base and probe",
                halves,
                [1.0, 1.0],
            ),
            (
                "layer thickness over electrode thickness",
                layer.thickness / self.thickness,
                about(9.5),
            ),
            (
                "electrode height over electrode thickness",
                self.height / self.thickness,
                about(5.5),
            ),
            (
                "electrode width over electrode thickness",
                self.width / self.thickness,
                about(10.0),
            ),
            (
                "gap over electrode thickness",
                self.gap / self.thickness,
                near_ends,
            ),
        ] {
            OutsideTable::check(table, quantity, value, range)?;
        }
        Ok(())
    }
}
