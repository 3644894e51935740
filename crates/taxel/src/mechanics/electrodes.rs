//! Two electrodes side by side in a compressed layer: their gap, thickness and
//! width (P1 section 2.3).

use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::Deserialize;

use super::compressed_layer::{CompressedLayer, LayerKinematics, TopFace};
use super::layer_range::LARGEST_COMPRESSION;
use crate::quantity::{self, Checked, Fraction, PositiveLength, PositiveStress, Ratio};
use crate::solved_table::{Curve, SolvedTable};
use taxel_numerics::table::extrapolate;

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
/// Gaps over electrode thickness of the table, at [`MIDDLE_RATIO`].
const GAPS: [f64; 3] = [0.2, 0.5, 1.0];

/// Opening of the gap, thinning and widening against the compression, relative to those of
/// the layer alone.
type Factors = [Curve; 3];

/// Plane-strain finite elements of the published cross-section, S = 5.5 T, H = 9.5 T,
/// b = 10 T (`tables/p1_stiff_electrodes.csv`).
struct StiffElectrodes {
    /// At [`MIDDLE_RATIO`], for each of [`GAPS`].
    middle: [Factors; 3],
    /// At [`LARGEST_RATIO`], for a gap of half the thickness only.
    largest: Factors,
}

static STIFF: LazyLock<StiffElectrodes> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/p1_stiff_electrodes.csv"));
    let factors = |ratio: f64, gap: f64| {
        ["opening", "thinning", "widening"].map(|factor| {
            table.curve("compression", factor, |row| {
                row.number("modulus_ratio") == ratio && row.number("gap_over_thickness") == gap
            })
        })
    };
    StiffElectrodes {
        middle: GAPS.map(|gap| factors(MIDDLE_RATIO, gap)),
        largest: factors(LARGEST_RATIO, GAPS[1]),
    }
});

/// Modulus E_e/E_d at which all gaps were solved.
const MIDDLE_RATIO: f64 = 1.75;
/// Largest modulus E_e/E_d of the table.
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
            ElectrodeStiffness::Modulus(_) => STIFF.largest[0].end(),
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
            let middle = STIFF.middle.each_ref();
            let by_gap = middle.map(|factors| factors[quantity].at(compression));
            extrapolate(&GAPS.map(f64::ln), &by_gap, gap.ln())
        };
        Ok(std::array::from_fn(|quantity| {
            let largest = || STIFF.largest[quantity].at(compression);
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
