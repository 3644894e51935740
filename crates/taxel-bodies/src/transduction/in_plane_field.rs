//! The in-plane capacitive sensor (P1) by finite elements: its whole cross-section at
//! large strain, and the electric field in the deformed shape.

use super::electrode_section::{BarStudy, Media};
use taxel_fem::material::{Law, Material};
use taxel_fem::solver::failure::Failure;
use taxel_fem::solver::newton::Settings;
use taxel_fem::study::layer::{Bar, Layer, LayerDivision, SideFace};

use crate::mechanics::DeformedBody;
use taxel::mechanics::{ElectrodeStiffness, EndCondition, LARGEST_COMPRESSION, TopFace};
use taxel::transduction::{InPlaneModel, Surroundings, VACUUM_PERMITTIVITY};

/// State of the cross-section at one compression.
///
/// Found from the drawing alone: no fitted factor of the closed forms enters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldState {
    /// Relative compression e = U/H.
    pub compression: f64,
    /// Force over the loaded area at rest, Pa, with the electrodes as stiff as they are.
    pub mean_stress: f64,
    /// Gap, mean over the height of the facing sides at rest, m.
    pub gap: f64,
    /// Gap at the lower edges, m.
    pub gap_bottom: f64,
    /// Gap at the upper edges, m.
    pub gap_top: f64,
    /// Thickness of the electrodes at the facing sides, m.
    pub thickness: f64,
    /// Thickness, mean along their width at rest, m.
    pub mean_thickness: f64,
    /// Width of one electrode at half its thickness, m.
    pub width: f64,
    /// Capacitance that the readout sees, F.
    pub capacitance: f64,
    /// Length of the side face, at rest, that lies on the base, m.
    pub on_base: f64,
    /// Greatest von Mises stress, Pa. It lies at a corner, where it depends on the size
    /// of the cells.
    pub greatest_stress: f64,
}

/// Why there is no solution by finite elements.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoField {
    /// The end condition names no body.
    #[error(
        "end_condition = {{ {} = … }} is a factor, and no body that could be solved: \
         give short_layer (free ends on a wider base), free (free ends, base no wider) or \
         wide_layer (a probe on a layer that goes on), or use the closed form",
        .0.key()
    )]
    EndCondition(EndCondition),
    /// Electrodes that stick out of the body.
    #[error(
        "gap and electrode reach {:.1} um from the middle, and the layer ends there or before, {:.1} um from it: give \
         narrower electrodes, a longer loaded half length, or end_condition = \"wide_layer\"", .reach * 1e6, .end * 1e6
    )]
    Reach {
        /// End of an electrode from the middle, m.
        reach: f64,
        /// End of the layer, m.
        end: f64,
    },
    /// A greatest compression out of range.
    #[error(
        "a greatest compression of {0} is outside 0 (excluded) to {LARGEST_COMPRESSION}: give one inside"
    )]
    Compression(f64),
    /// The solver stopped before the first states.
    #[error("{0}")]
    Solver(String),
}

/// The states of a sensor from rest to a compression, with the curve through them.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedInPlane {
    /// States at equal steps of compression, the first at rest.
    states: Vec<FieldState>,
    /// Why the solution ended before the compression asked for.
    pub ended: Option<String>,
    /// Half of the section at the last compression.
    pub body: Option<DeformedBody>,
}

/// Numbers of a [`FieldState`] on the curve.
const NUMBERS: usize = 10;
/// Fewest states for cubics.
const FEWEST: usize = 4;
/// States on the way to the greatest compression.
pub(crate) const STATES: usize = 24;
/// Least compression that is tried again when there are fewer than [`FEWEST`] states on the
/// way to it.
const LEAST: f64 = 1e-2;
/// Length of a layer beside the probe under `wide_layer`, over its thickness.
const BEYOND: f64 = 4.0;

impl FieldState {
    fn numbers(&self) -> [f64; NUMBERS] {
        [
            self.mean_stress,
            self.gap,
            self.gap_bottom,
            self.gap_top,
            self.thickness,
            self.mean_thickness,
            self.width,
            self.capacitance,
            self.on_base,
            self.greatest_stress,
        ]
    }

    fn of(compression: f64, numbers: [f64; NUMBERS]) -> Self {
        let [
            mean_stress,
            gap,
            gap_bottom,
            gap_top,
            thickness,
            mean_thickness,
            width,
            capacitance,
            on_base,
            greatest_stress,
        ] = numbers;
        Self {
            compression,
            mean_stress,
            gap,
            gap_bottom,
            gap_top,
            thickness,
            mean_thickness,
            width,
            capacitance,
            on_base,
            greatest_stress,
        }
    }
}

/// A solution under way.
pub(crate) struct FieldStudy {
    study: BarStudy,
    media: Media,
    mutual: bool,
    depth: f64,
}

impl FieldStudy {
    /// The sensor at rest.
    pub(crate) fn new(model: &InPlaneModel) -> Result<Self, NoField> {
        let (layer, bar) = body(model)?;
        Self::of_body(model, layer, bar)
    }

    /// The same with cells about half again as large.
    pub(crate) fn coarse(model: &InPlaneModel) -> Result<Self, NoField> {
        let (mut layer, bar) = body(model)?;
        layer.division.at_bar *= 2.0;
        layer.division.largest *= 1.5;
        Self::of_body(model, layer, bar)
    }

    /// The same with cells half as large at the electrodes, and smaller elsewhere.
    pub(crate) fn fine(model: &InPlaneModel) -> Result<Self, NoField> {
        let (mut layer, bar) = body(model)?;
        layer.division.at_bar /= 2.0;
        layer.division.largest /= 1.5;
        Self::of_body(model, layer, bar)
    }

    fn of_body(model: &InPlaneModel, layer: Layer, bar: Bar) -> Result<Self, NoField> {
        let modulus = match model.electrodes.stiffness {
            ElectrodeStiffness::AsLayer => model.layer.youngs_modulus,
            ElectrodeStiffness::Modulus(modulus) => modulus.youngs_modulus,
        };
        let soft = incompressible(model.layer.youngs_modulus);
        let study =
            BarStudy::new(layer, bar, soft, incompressible(modulus)).map_err(|e| unsolved(&e))?;
        let (media, mutual) = media(model.dielectric.surroundings, model.dielectric.permittivity);
        Ok(Self {
            study,
            media,
            mutual,
            depth: model.electrodes.depth,
        })
    }

    /// The state at a compression.
    pub(crate) fn press(&mut self, compression: f64) -> Result<FieldState, NoField> {
        let pressed = self.study.study.press(compression);
        let pressed = pressed.map_err(|failure| self.ended(&failure))?;
        let shape = self.study.shape();
        let found = self.study.capacitance(&[self.media]);
        let found = found.map_err(|failure| self.ended(&failure))?[0];
        let per_depth = if self.mutual {
            found.mutual
        } else {
            found.differential
        };
        Ok(FieldState {
            compression,
            mean_stress: pressed.mean_stress,
            gap: shape.gap,
            gap_bottom: shape.gap_bottom,
            gap_top: shape.gap_top,
            thickness: shape.thickness_at_face,
            mean_thickness: shape.thickness,
            width: shape.width,
            capacitance: per_depth * VACUUM_PERMITTIVITY * self.depth,
            on_base: pressed.on_base,
            greatest_stress: pressed.stress,
        })
    }
}

impl FieldStudy {
    /// End of such a body, with the message of the solver.
    fn ended(&self, failure: &Failure) -> NoField {
        let layer = self.study.study.layer();
        let words = match (layer.beyond > 0.0, layer.side) {
            (true, _) => "beside the edge of the probe the layer rises and folds over it",
            (false, SideFace::Free) => "the side face turns under the edge of the base",
            (false, SideFace::OnBase) => {
                "the foot of the side face is drawn out along the base without bound"
            }
        };
        // The advice of the solver is for those who make meshes of their own.
        NoField::Solver(format!("{words} ({})", failure.reason))
    }
}

fn unsolved(failure: &Failure) -> NoField {
    NoField::Solver(failure.to_string())
}

/// J = 1, shear modulus E/3; in plane strain the second constant of Mooney and Rivlin
/// acts as the first.
fn incompressible(youngs_modulus: f64) -> Material {
    Material::incompressible(Law::MooneyRivlin {
        c10: youngs_modulus / 6.0,
        c01: 0.0,
    })
}

/// The body that the end condition means.
fn body(model: &InPlaneModel) -> Result<(Layer, Bar), NoField> {
    let thickness = model.layer.thickness;
    let (beyond, side) = match model.layer.end_condition {
        EndCondition::Free => (0.0, SideFace::Free),
        EndCondition::ShortLayer => (0.0, SideFace::OnBase),
        EndCondition::WideLayer => (BEYOND * thickness, SideFace::OnBase),
        other => return Err(NoField::EndCondition(other)),
    };
    let electrodes = &model.electrodes;
    let reach = 0.5 * electrodes.gap + electrodes.width;
    let end = model.layer.contact_half_length + beyond;
    if reach >= end {
        return Err(NoField::Reach { reach, end });
    }
    let aspect = model.layer.contact_half_length / thickness;
    let layer = Layer {
        thickness,
        loaded: model.layer.contact_half_length,
        beyond,
        side,
        bar: None,
        gripped: model.layer.top == TopFace::Gripped,
        division: match side {
            _ if beyond > 0.0 => LayerDivision::beside_probe(),
            SideFace::OnBase => LayerDivision::for_aspect(aspect),
            SideFace::Free => LayerDivision::at_free_end(aspect),
        },
    };
    let bar = Bar {
        inner: 0.5 * electrodes.gap,
        width: electrodes.width,
        height: electrodes.height,
        thickness: electrodes.thickness,
    };
    Ok((layer, bar))
}

/// Media round the layer, and whether the readout is guarded.
fn media(surroundings: Surroundings, permittivity: f64) -> (Media, bool) {
    /// Relative permittivities.
    const AIR: f64 = 1.0;
    const GLASS: f64 = 5.5;
    let own = permittivity;
    let (above, below, mutual) = match surroundings {
        Surroundings::Uniform => (own, Some(own), false),
        Surroundings::AirAbove => (AIR, Some(own), false),
        Surroundings::AirAboveGlassBelow => (AIR, Some(GLASS), false),
        Surroundings::AirAboveBelow => (AIR, Some(AIR), false),
        Surroundings::GroundedBase => (AIR, None, false),
        Surroundings::GroundedBaseMutual => (AIR, None, true),
        Surroundings::GroundedBaseUniform => (own, None, false),
        Surroundings::GroundedBaseUniformMutual => (own, None, true),
    };
    let layer = own;
    (
        Media {
            layer,
            above,
            below,
        },
        mutual,
    )
}

impl SolvedInPlane {
    /// Checks that `model` is a body that can be solved.
    ///
    /// # Errors
    /// [`NoField::EndCondition`] and [`NoField::Reach`].
    pub fn check(model: &InPlaneModel) -> Result<(), NoField> {
        body(model).map(drop)
    }

    /// Presses the cross-section of `model` step by step up to a compression of `most`, or as
    /// far as the solution goes, or until `enough` says so; `progress` hears the fraction.
    ///
    /// # Errors
    /// [`NoField`] when there are not even four states.
    pub fn solve(
        model: &InPlaneModel,
        most: f64,
        enough: &dyn Fn(&FieldState) -> bool,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, NoField> {
        let least = Settings::default().smallest_step;
        Self::solve_in((STATES, least), model, most, enough, progress)
    }

    /// The same in this many steps, of which no part below `least` is tried.
    pub(crate) fn solve_in(
        (steps, least): (usize, f64),
        model: &InPlaneModel,
        most: f64,
        enough: &dyn Fn(&FieldState) -> bool,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, NoField> {
        if !(most > 0.0 && most <= LARGEST_COMPRESSION) {
            return Err(NoField::Compression(most));
        }
        let mut study = FieldStudy::new(model)?;
        study.study.study.solver.settings.smallest_step = least;
        let mut solved = Self {
            states: vec![study.press(0.0)?],
            ended: None,
            body: None,
        };
        for step in 1..=steps {
            let fraction = step as f64 / steps as f64;
            match study.press(most * fraction) {
                Ok(state) => solved.states.push(state),
                Err(error) if solved.states.len() >= FEWEST => {
                    solved.ended = Some(error.to_string());
                    break;
                }
                // It ends before there are enough states: they have to lie closer.
                Err(error) if most > LEAST => {
                    let closer = most * FEWEST as f64 / steps as f64;
                    let mut closer =
                        Self::solve_in((steps, least), model, closer, enough, progress)?;
                    if !enough(closer.last()) {
                        closer.ended.get_or_insert(error.to_string());
                    }
                    return Ok(closer);
                }
                Err(error) => return Err(error),
            }
            progress(fraction);
            if solved.states.len() >= FEWEST && solved.states.last().is_some_and(enough) {
                break;
            }
        }
        let words = format!(
            "compressed by {:.4} of its thickness",
            solved.last().compression
        );
        let solver = &study.study.study.solver;
        solved.body = Some(DeformedBody::of(solver, "section", words, "top"));
        Ok(solved)
    }

    /// Step of compression between states.
    pub(crate) fn step(&self) -> f64 {
        self.states[1].compression
    }

    /// The states, the first at rest.
    pub(crate) fn states(&self) -> &[FieldState] {
        &self.states
    }

    /// The state at rest.
    pub fn rest(&self) -> &FieldState {
        &self.states[0]
    }

    /// The last state.
    pub fn last(&self) -> &FieldState {
        &self.states[self.states.len() - 1]
    }

    /// The state at a compression from 0 to that of [`SolvedInPlane::last`], on cubics through
    /// the four nearest solved states; none outside.
    pub fn at(&self, compression: f64) -> Option<FieldState> {
        let last = self.last().compression;
        if !(0.0..=last * (1.0 + 1e-12)).contains(&compression) {
            return None;
        }
        let step = self.states[1].compression;
        let first = (compression / step).floor() as usize;
        let first = first.saturating_sub(1).min(self.states.len() - FEWEST);
        let nearest = &self.states[first..first + FEWEST];
        let mut numbers = [0.0; NUMBERS];
        for (k, state) in nearest.iter().enumerate() {
            let others = nearest.iter().enumerate().filter(|(other, _)| *other != k);
            // Lagrange's polynomial of this state.
            let share: f64 = others
                .map(|(_, other)| {
                    (compression - other.compression) / (state.compression - other.compression)
                })
                .product();
            for (number, value) in numbers.iter_mut().zip(state.numbers()) {
                *number += share * value;
            }
        }
        // Lengths on the base do not begin smoothly.
        numbers[NUMBERS - 2] = numbers[NUMBERS - 2].max(0.0);
        Some(FieldState::of(compression, numbers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_pass_through_cubics() {
        let state = |e: f64| FieldState::of(e, [1.0 + e - 7.0 * e * e + 30.0 * e.powi(3); NUMBERS]);
        let solved = SolvedInPlane {
            states: (0..7).map(|k| state(0.05 * f64::from(k))).collect(),
            ended: None,
            body: None,
        };
        for e in [0.0, 0.01, 0.07, 0.149, 0.2, 0.26, 0.3] {
            let (found, exact) = (solved.at(e).unwrap(), state(e));
            assert!((found.gap - exact.gap).abs() < 1e-14);
        }
        assert!(solved.at(-0.01).is_none() && solved.at(0.31).is_none());
    }
}
