//! Conditions at the ends of a compressed layer: the factor χ of its bottom shear.

use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::Deserialize;

use super::layer_range::{LARGEST_COMPRESSION, LEAST_ASPECT, LayerError};
use crate::quantity::{self, Checked, EndFactor, EndParameter};
use crate::solved_table::{Curve, SolvedTable};
use taxel_numerics::special::{beta, gamma};
use taxel_numerics::table::interpolate;

/// Reading of the ends of the loaded length, through which the constant Π of
/// the pressure follows from the balance of horizontal forces.
///
/// P1 names two calibration factors ζ and m for it and does not define them;
/// `tapered` and `tail` are two readings of them, and the others come from
/// finite elements.
///
/// The factor is χ = (true total bottom shear of one half) / (that of the
/// layer model out to the end of the loaded length).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum EndCondition {
    /// The layer ends with the load and its ends carry no resultant: χ = 1.
    Free,
    /// Free ends of a real layer on a wider base: χ = 1 − 0.25 H/L from L/H = 5
    /// on; below, down to 1, a smooth curve in H/L through finite elements.
    ShortLayer,
    /// The shear tapers to zero inside the loaded length,
    /// τ = τ_model·(1 − (x/L)^ζ)^m: χ = (2/ζ)·B(2/ζ, m+1).
    Tapered(EndShear),
    /// The shear goes on outside the loaded length,
    /// τ = τ_model(L)·exp(−ζ ((x−L)/L)^m): χ = 1 + 2 Γ(1+1/m) ζ^(−1/m).
    Tail(EndShear),
    /// A probe on a much wider layer: χ = 1 + 2 δ/L, with δ of about 2.2, 1.8,
    /// 1.6 H for L/H = 1, 2, 5 and above, interpolated in finite elements
    /// (3 %).
    WideLayer,
    /// The factor itself.
    Given(GivenFactor),
}

/// The two calibration factors ζ and m of an end condition.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EndShear {
    /// ζ.
    #[serde(deserialize_with = "quantity::one::<EndParameter, _>")]
    #[schemars(with = "Checked<EndParameter>")]
    pub zeta: f64,
    /// m.
    #[serde(deserialize_with = "quantity::one::<EndParameter, _>")]
    #[schemars(with = "Checked<EndParameter>")]
    pub m: f64,
}

/// A factor χ that is known from elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenFactor {
    /// χ.
    #[serde(deserialize_with = "quantity::one::<EndFactor, _>")]
    #[schemars(with = "Checked<EndFactor>")]
    pub chi: f64,
}

/// L/H at which the tables begin.
const LEAST_TABULATED: f64 = 1.0;
/// L/H of the table for a wide layer.
const TAIL_ASPECTS: [f64; 3] = [1.0, 2.0, 5.0];

/// What makes the model carry the force of finite elements, against the relative compression
/// (`tables/p1_ends.csv`).
struct SolvedEnds {
    /// χ with free ends on a wider base, for L/H = 1 and 2.
    short: [Curve; 2],
    /// δ/H of [`EndCondition::WideLayer`], for each of [`TAIL_ASPECTS`].
    wide: [Curve; 3],
}

static ENDS: LazyLock<SolvedEnds> = LazyLock::new(|| {
    let table = SolvedTable::parse(include_str!("../../tables/p1_ends.csv"));
    let curve = |end: &str, aspect: f64| {
        table.curve("compression", "value", |row| {
            row.text("end") == end && row.number("half_length_over_thickness") == aspect
        })
    };
    SolvedEnds {
        short: [1.0, 2.0].map(|aspect| curve("short", aspect)),
        wide: TAIL_ASPECTS.map(|aspect| curve("wide", aspect)),
    }
});

/// Slope of the rule for long layers against H/L ...
const RULE_SLOPE: f64 = -0.25;
/// ... and the L/H from which it holds.
const RULE_FROM: f64 = 5.0;
/// Below this χ the force of a long layer falls again before a compression of
/// 0.4: for χ = 0.6 it does at 0.39, for 0.7 at 0.50.
const LEAST_FACTOR: f64 = 0.65;

/// χ of free ends on a wider base: one curve in H/L with a continuous slope.
///
/// From L/H = 1 to 2 a straight line through the table, from 5 on the rule
/// 1 − 0.25 H/L, and between them the cubic that continues both.
fn short_layer(aspect: f64, compression: f64) -> f64 {
    let inverse = 1.0 / aspect;
    let rule = 1.0 + RULE_SLOPE * inverse;
    if aspect >= RULE_FROM {
        return rule;
    }
    let [one, two] = ENDS.short.each_ref().map(|curve| curve.at(compression));
    let slope = 2.0 * (one - two);
    if aspect <= 2.0 {
        return two + slope * (inverse - 0.5);
    }
    // Hermite's cubic in H/L from the rule's end to the table's.
    let start = 1.0 / RULE_FROM;
    let (width, from) = (0.5 - start, 1.0 + RULE_SLOPE * start);
    let t = (inverse - start) / width;
    let (blend, back) = (t * t * (3.0 - 2.0 * t), 1.0 - t);
    from + blend * (two - from) + width * t * back * (RULE_SLOPE * back - slope * t)
}

impl EndCondition {
    /// Its key in a sensor file.
    pub fn key(&self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::ShortLayer => "short_layer",
            Self::Tapered(_) => "tapered",
            Self::Tail(_) => "tail",
            Self::WideLayer => "wide_layer",
            Self::Given(_) => "given",
        }
    }

    /// χ for a layer of `aspect` L/H at a relative compression.
    ///
    /// # Errors
    /// [`LayerError::AspectOutsideTable`] when the factor comes from a table
    /// that begins at L/H = 1; [`LayerError::EndFactor`] when ζ and m give a χ
    /// below 0.65, with which the force would not rise up to e = 0.4.
    ///
    /// ```
    /// use taxel::mechanics::{EndCondition, EndShear};
    /// // The published pair ζ = 20, m = 1 in the two readings.
    /// let shear = EndShear { zeta: 20.0, m: 1.0 };
    /// let tapered = EndCondition::Tapered(shear).factor(2.0, 0.1)?;
    /// let tail = EndCondition::Tail(shear).factor(2.0, 0.1)?;
    /// assert!((tapered - 20.0 / 22.0).abs() < 1e-14 && (tail - 1.1).abs() < 1e-14);
    /// assert!(EndCondition::WideLayer.factor(0.9, 0.1).is_err());
    /// # Ok::<(), taxel::mechanics::LayerError>(())
    /// ```
    pub fn factor(self, aspect: f64, compression: f64) -> Result<f64, LayerError> {
        let tabulated = matches!(self, Self::ShortLayer | Self::WideLayer);
        if tabulated && aspect < LEAST_TABULATED {
            let least = LEAST_TABULATED;
            return Err(LayerError::AspectOutsideTable { aspect, least });
        }
        Ok(match self {
            Self::Free => 1.0,
            Self::ShortLayer => short_layer(aspect, compression),
            Self::Tapered(EndShear { zeta, m }) => {
                let chi = 2.0 / zeta * beta(2.0 / zeta, m + 1.0);
                if chi < LEAST_FACTOR {
                    let least = LEAST_FACTOR;
                    return Err(LayerError::EndFactor { chi, least });
                }
                chi
            }
            Self::Tail(EndShear { zeta, m }) => {
                1.0 + 2.0 * gamma(1.0 + 1.0 / m) * zeta.powf(-1.0 / m)
            }
            Self::WideLayer => {
                let by_aspect = ENDS.wide.each_ref().map(|curve| curve.at(compression));
                1.0 + 2.0 * interpolate(&TAIL_ASPECTS, &by_aspect, aspect) / aspect
            }
            Self::Given(GivenFactor { chi }) => chi,
        })
    }

    /// Largest compression for which the factor was compared with finite
    /// elements.
    pub fn verified_compression(self, aspect: f64) -> f64 {
        match self {
            Self::WideLayer if aspect <= 2.0 => 0.15,
            Self::WideLayer => 0.05,
            _ => LARGEST_COMPRESSION,
        }
    }

    /// Least L/H for which the force was compared with finite elements.
    pub fn verified_aspect(self) -> f64 {
        match self {
            Self::ShortLayer | Self::WideLayer => LEAST_TABULATED,
            _ => LEAST_ASPECT,
        }
    }
}
