//! Soft layers bonded to the board: a pressure spreads on its way to the cells.

use std::f64::consts::{PI, TAU};

use schemars::JsonSchema;
use serde::de::{self, Deserialize, Deserializer};

use super::{ChainPart, Cover, PartError, PartParameter};
use crate::drawing::{DimensionLine, Part, Shape, View};
use crate::mechanics::{CoverArea, CoverLayer, LayeredCover};
use crate::quantity::{self, Checked, PoissonRatio, PositiveLength, PositiveStress};
use taxel_ground::summary::{Fact, fact, number, text};

/// Soft layers, the top one first; the last is bonded to the rigid board.
#[derive(Debug, Clone, PartialEq, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayeredRubber {
    /// The layers, at least one.
    #[serde(deserialize_with = "at_least_one")]
    #[schemars(length(min = 1))]
    pub layers: Vec<RubberLayer>,
}

fn at_least_one<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<RubberLayer>, D::Error> {
    let layers = Vec::deserialize(deserializer)?;
    if layers.is_empty() {
        return Err(de::Error::custom("a cover has at least one layer"));
    }
    Ok(layers)
}

/// One soft layer.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RubberLayer {
    /// Thickness, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub thickness: f64,
    /// Shear modulus, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub shear_modulus: f64,
    /// Poisson's ratio, 0 to 0.5.
    #[serde(deserialize_with = "quantity::one::<PoissonRatio, _>")]
    #[schemars(with = "Checked<PoissonRatio>")]
    pub poisson: f64,
}

/// What arrives of a point force over the square of the thickness counts as nothing below this
/// share: the step of a converter of 20 bits.
const LEAST_SHARE: f64 = 1e-6;
/// Up to this pressure over the least shear modulus pressures may be added up: 1.7 % of the peak
/// off at 0.2 (finite strain, two patches on an incompressible layer).
const LINEAR_PRESSURE: f64 = 0.2;
/// ... and up to this sinking over the thickness.
const LINEAR_SINKING: f64 = 0.03;
/// Largest pitch over the thickness: cells that are farther apart see nothing between them, and
/// the sums over wave numbers grow with the square.
const FARTHEST_APART: f64 = 20.0;

impl LayeredRubber {
    fn kernel(&self) -> LayeredCover {
        let layer = |layer: &RubberLayer| CoverLayer {
            thickness: layer.thickness,
            shear_modulus: layer.shear_modulus,
            poisson: layer.poisson,
        };
        let layers: Vec<CoverLayer> = self.layers.iter().map(layer).collect();
        LayeredCover::new(&layers).expect("a cover has at least one layer, and the ranges of the keys are within those of the kernel")
    }

    fn thickness(&self) -> f64 {
        self.layers.iter().map(|layer| layer.thickness).sum()
    }
}

impl ChainPart for LayeredRubber {
    fn parameters(&mut self, each: &mut dyn FnMut(PartParameter, &mut f64)) {
        for layer in &mut self.layers {
            let part = |name, unit, value: f64| PartParameter {
                name,
                unit,
                bounds: [0.5 * value, 2.0 * value],
                fitted: false,
                per_cell: false,
                absolute: false,
            };
            each(
                part("cover_thickness", "m", layer.thickness),
                &mut layer.thickness,
            );
            each(
                part("cover_shear_modulus", "Pa", layer.shear_modulus),
                &mut layer.shear_modulus,
            );
        }
    }

    fn facts(&self) -> Vec<Fact> {
        let source = "element.cells.cover";
        let thickness = number(self.thickness(), "m", "mm", 1e-3);
        let mut facts = vec![fact("mechanics", "cover_thickness", thickness, source)];
        if let Some(length) = self.kernel().resolution_length(1e-2) {
            let length = number(length, "m", "mm", 1e-3);
            facts.push(fact(
                "mechanics",
                "resolution_length_at_1_percent_noise",
                length,
                source,
            ));
        }
        let edge = format!(
            "the kernel has no edge: loads from {:.3} mm of it on",
            2e3 * self.thickness()
        );
        facts.push(fact("mechanics", "cover_holds_for", text(&edge), source));
        facts
    }

    fn views(&self) -> Vec<View> {
        let half = 4.0 * self.thickness();
        let mut view = View {
            title: String::from("cross-section of the cover"),
            ..View::default()
        };
        view.shapes.push(Shape::rectangle(
            Part::Base,
            [-half, -0.3 * self.thickness()],
            [half, 0.0],
        ));
        let mut low = 0.0;
        for layer in self.layers.iter().rev() {
            let high = low + layer.thickness;
            view.shapes.push(Shape::rectangle(
                Part::Elastomer,
                [-half, low],
                [half, high],
            ));
            view.dimensions
                .push(DimensionLine::new([half, low], [half, high], 14.0, "h"));
            low = high;
        }
        vec![view]
    }
}

impl Cover for LayeredRubber {
    fn boxed(&self) -> Box<dyn Cover> {
        Box::new(self.clone())
    }

    fn fits(&self, pitch: [f64; 2]) -> Result<(), PartError> {
        let [most, thickness] = [pitch[0].max(pitch[1]), self.thickness()];
        if most <= FARTHEST_APART * thickness {
            return Ok(());
        }
        Err(PartError {
            key: "cover.layers".into(),
            message: format!(
                "a cover of {:.4} mm spreads nothing to cells {:.4} mm apart",
                1e3 * thickness,
                1e3 * most
            ),
            help: format!("give at least a {FARTHEST_APART}th of the pitch, or leave cover out"),
        })
    }

    fn shares(&self, cell: [f64; 2], patch: [f64; 2], [x, y]: [&[f64]; 2]) -> Vec<f64> {
        let [cell, patch] =
            [cell, patch].map(|sides| CoverArea::Rectangle(sides.map(|side| 0.5 * side)));
        self.kernel()
            .base_pressure_means(cell, patch, [x, y], LEAST_SHARE)
    }

    fn reach(&self) -> f64 {
        self.kernel().reach(LEAST_SHARE)
    }

    /// By Poisson's summation: √ΣS(G)²sinc²(Gx a/2)sinc²(Gy b/2) over the reciprocal lattice.
    fn sampling(&self, cell: [f64; 2], pitch: [f64; 2]) -> f64 {
        let kernel = self.kernel();
        let wave = |axis: usize, order: i32| TAU * f64::from(order) / pitch[axis];
        // Beyond 36 over the thickness S² is below 1e-28.
        let end = 36.0 / self.thickness();
        let sinc = |x: f64| if x == 0.0 { 1.0 } else { x.sin() / x };
        let term = |i: i32, j: i32| {
            let [x, y] = [wave(0, i), wave(1, j)];
            if x.hypot(y) > end {
                return 0.0;
            }
            let seen = sinc(0.5 * x * cell[0]) * sinc(0.5 * y * cell[1]);
            (kernel.base_transform(x.hypot(y)) * seen).powi(2)
        };
        let orders = |axis: usize| (end * pitch[axis] / TAU).floor() as i32;
        let [across, up] = [orders(0), orders(1)];
        let all = (-across..=across).flat_map(|i| (-up..=up).map(move |j| (i, j)));
        let sum: f64 = all
            .filter(|order| *order != (0, 0))
            .map(|(i, j)| term(i, j))
            .sum();
        sum.sqrt()
    }

    fn beyond(&self, pressure: f64, patch: [f64; 2]) -> Option<&'static str> {
        let softest = self
            .layers
            .iter()
            .map(|layer| layer.shear_modulus)
            .fold(f64::INFINITY, f64::min);
        let radius = (patch[0] * patch[1] / PI).sqrt();
        let sinking = self.kernel().sinking(radius, 0.0) * pressure * patch[0] * patch[1];
        let linear =
            pressure <= LINEAR_PRESSURE * softest && sinking <= LINEAR_SINKING * self.thickness();
        (!linear).then_some("nonlinear")
    }
}
