//! Two crossing rows of channels solved by finite elements.

use super::crossing_microchannels::{Crossing, CrossingStudy};
use super::microchannel_cell::{Filling, WallContact};
use taxel_fem::material::{Law, Material};
use taxel_fem::mesh::{CrossingVoids, VoidShape};
use taxel_fem::solver::failure::Failure;
use taxel_numerics::{MonotoneCurve, OnCurve};

use super::DeformedBody;
use taxel::mechanics::{
    AlongChannel, ClosingCurve, Hyperelastic, MicrochannelError, PressureLaw, SectionShape,
    VoidStack,
};

/// No solution, or none to speak of.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotSolved {
    /// The solver stopped before the first load.
    #[error("{0}")]
    Solver(String),
    /// A part of the drawing has no thickness.
    #[error(
        "the {part} is {:.4} um thick, and finite elements need solid there: give more than 0 um ({key})",
        .thickness * 1e6
    )]
    NoSolid {
        /// The part.
        part: &'static str,
        /// Its key.
        key: &'static str,
        /// Its thickness, m.
        thickness: f64,
    },
    /// Nothing closes.
    #[error(
        "a sealed liquid carries what presses on the whole top, and no channel closes: nothing is left to solve; leave \
         --mechanics fem out, or press a patch (patch_x, patch_y)"
    )]
    Sealed,
    /// The solved states make no curve.
    #[error(transparent)]
    Curve(#[from] MicrochannelError),
}

/// Solution of one layer, over the net pressure q = p − P_int.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedLayer {
    /// Mean area ratio V/V₀, with the sections along the channel.
    pub closing: ClosingCurve,
    /// Smallest distance between roof and floor, m.
    gap: Vec<[f64; 2]>,
}

/// Solution of both layers.
#[derive(Debug, Clone, PartialEq)]
pub struct SolvedVoids {
    /// The upper and the lower layer.
    pub layers: [SolvedLayer; 2],
    /// Greatest von Mises stress over the pressure on the top, Pa.
    stress: Vec<[f64; 2]>,
    /// Why the solution ended before the pressure asked for.
    pub ended: Option<String>,
    /// The cell at its greatest load.
    pub body: DeformedBody,
}

/// Size of the cells of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fineness {
    /// That of predictions.
    Usual,
    /// Half as large at the edges of the channels, two thirds elsewhere: to see what the mesh does.
    Finer,
}

/// States on the way to the greatest pressure.
const STATES: usize = 12;
/// Pressure that is light, over the shear modulus times height over width of a channel: an
/// eighth of a percent of the area. A strain much smaller than that of its twelfth part is
/// lost in the rounding of the stresses of a solid that keeps its volume; the answer to a
/// lighter load lies on the curve to this one.
const LIGHT: f64 = 0.125;

/// Checks that there is solid above, between and below the channels.
///
/// # Errors
/// [`NotSolved::NoSolid`] naming the first part without.
pub(crate) fn check_stack(stack: &VoidStack) -> Result<(), NotSolved> {
    let base = "element.microchannel.base";
    let roofs = "element.microchannel.rows.roof and columns.roof";
    for (part, key, thickness) in [
        ("solid below the lower channels", base, stack.base),
        ("solid between the layers", roofs, stack.between),
        ("roof of the upper channels", roofs, stack.cover),
    ] {
        // A billionth of the pitch is the rounding of a difference of lengths.
        if thickness <= 1e-9 * stack.pitch {
            return Err(NotSolved::NoSolid {
                part,
                key,
                thickness,
            });
        }
    }
    Ok(())
}

/// Cross-section of the voids in the mesh.
pub(crate) fn void_shape(stack: &VoidStack) -> VoidShape {
    match stack.section.shape {
        SectionShape::Rectangle => VoidShape::Rectangle,
        SectionShape::Ellipse => VoidShape::Ellipse,
    }
}

/// A pressure below which answers lie on a curve from rest, Pa.
pub(crate) fn light_pressure(stack: &VoidStack) -> f64 {
    LIGHT * stack.material.shear_modulus() * stack.section.height / stack.section.width
}

/// Poses the crossing cell at rest.
///
/// # Errors
/// [`NotSolved`] for lengths that make no cell.
pub(crate) fn crossing_study(
    stack: &VoidStack,
    fineness: Fineness,
) -> Result<CrossingStudy, NotSolved> {
    check_stack(stack)?;
    let (part, largest) = match fineness {
        Fineness::Usual => (1.0, 1.0),
        Fineness::Finer => (0.5, 1.0 / 1.5),
    };
    let smallest = part
        * match void_shape(stack) {
            VoidShape::Rectangle => stack.section.height,
            // Arcs on two edges each.
            VoidShape::Ellipse => 0.5 * stack.section.height,
        };
    let cell = CrossingVoids {
        width: stack.section.width,
        pitch: stack.pitch,
        base: stack.base,
        lower: stack.section.height,
        between: stack.between,
        upper: stack.section.height,
        cover: stack.cover,
        smallest,
        growth: 2.0,
        // High channels close together have no room for cells larger than those beside them.
        largest: (largest * stack.pitch / 4.0).max(smallest),
        shape: void_shape(stack),
    };
    let filling = filling(&stack.liquid);
    let contact = WallContact::default();
    CrossingStudy::new(&cell, solid(&stack.material), &filling, contact)
        .map_err(|failure| NotSolved::Solver(failure.to_string()))
}

/// Presses the whole top up to a pressure in Pa, or a light one where that is more;
/// `progress` hears the fraction.
///
/// # Errors
/// [`NotSolved`] when there is not even a first state.
pub fn solve_voids(
    stack: &VoidStack,
    pressure: f64,
    progress: &mut dyn FnMut(f64),
) -> Result<SolvedVoids, NotSolved> {
    if stack.liquid == PressureLaw::Sealed {
        return Err(NotSolved::Sealed);
    }
    let pressure = pressure.max(light_pressure(stack));
    let mut study = crossing_study(stack, Fineness::Usual)?;
    let mut states = Vec::new();
    let mut ended = None;
    for step in 1..=STATES {
        let fraction = step as f64 / STATES as f64;
        // A little beyond, so that the greatest pressure is inside the curve.
        match study.press(pressure * fraction * (1.0 + 1e-6)) {
            Ok(state) => states.push(state),
            Err(failure) if states.is_empty() => {
                return Err(NotSolved::Solver(failure.to_string()));
            }
            Err(failure) => {
                ended = Some(end(pressure, &states, &failure));
                break;
            }
        }
        progress(fraction);
    }
    Ok(SolvedVoids {
        layers: [SolvedLayer::new(&states, 0)?, SolvedLayer::new(&states, 1)?],
        stress: from_rest(states.iter().map(|s| [s.pressure, s.stress]), 0.0),
        ended,
        body: DeformedBody::of(
            &study.solver,
            "crossing-cell",
            format!("{:.4} kPa on the whole top", 1e-3 * states_end(&states)),
            "front",
        ),
    })
}

/// How far a solution came, and what to change.
fn end(asked: f64, states: &[Crossing], failure: &Failure) -> String {
    let gaps = states.last().map_or([f64::NAN; 2], |state| state.gap);
    let [upper, lower] = gaps.map(|gap| 1e6 * gap);
    format!(
        "the solution ends at {:.4} of {:.4} kPa on the top, where the upper and the lower channels have {upper:.2} and \
         {lower:.2} um left between roof and floor ({}): ask for less pressure, or draw higher or narrower channels",
        1e-3 * states_end(states),
        1e-3 * asked,
        failure.reason
    )
}

/// Greatest pressure that was solved, Pa.
fn states_end(states: &[Crossing]) -> f64 {
    states.last().map_or(0.0, |state| state.pressure)
}

/// The solid as the solver knows it.
pub(crate) fn solid(material: &Hyperelastic) -> Material {
    let Hyperelastic::MooneyRivlin(constants) = material;
    Material::incompressible(Law::MooneyRivlin {
        c10: constants.c10,
        c01: constants.c01,
    })
}

pub(crate) fn filling(liquid: &PressureLaw) -> Filling {
    match liquid {
        PressureLaw::Vented => Filling::Vented,
        PressureLaw::Sealed => Filling::Sealed,
        PressureLaw::Paper(law) => Filling::Gas(law.expansion * law.atmosphere),
        PressureLaw::Tabulated(points) => {
            let mut points: Vec<(f64, f64)> = points
                .iter()
                .map(|point| (point.volume_ratio, point.pressure))
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            Filling::Tabulated(points)
        }
    }
}

fn from_rest(points: impl Iterator<Item = [f64; 2]>, rest: f64) -> Vec<[f64; 2]> {
    std::iter::once([0.0, rest]).chain(points).collect()
}

impl SolvedLayer {
    fn new(states: &[Crossing], row: usize) -> Result<Self, NotSolved> {
        let net = |state: &Crossing| state.pressure - state.inside[row];
        let curve = |of: &dyn Fn(&Crossing) -> f64| {
            let points = from_rest(states.iter().map(|s| [net(s), of(s)]), 1.0);
            MonotoneCurve::new(points, None).map_err(MicrochannelError::from)
        };
        let along = AlongChannel {
            conductance: curve(&|state| 1.0 / state.resistance_ratio[row])?,
            thinnest: curve(&|state| state.thinnest[row])?,
        };
        let closing = curve(&|state| state.volume_ratio[row])?;
        let gap = from_rest(
            states.iter().map(|s| [net(s), s.gap[row]]),
            states.first().map_or(0.0, |state| state.rest_gap[row]),
        );
        // Where the line through the states before and after has no gap left.
        let touch = gap.windows(2).find(|pair| pair[1][1] <= 0.0);
        let touch = touch.and_then(|pair| {
            let [[q0, gap0], [q1, gap1]] = [pair[0], pair[1]];
            match closing.at(q0 + (q1 - q0) * gap0 / (gap0 - gap1)) {
                OnCurve::Inside { value, .. } => Some(value),
                _ => None,
            }
        });
        Ok(Self {
            closing: ClosingCurve::of_path(closing, touch, along),
            gap,
        })
    }

    /// Smallest distance between roof and floor, m.
    pub fn gap(&self, net_pressure: f64) -> Option<f64> {
        between(&self.gap, net_pressure)
    }
}

impl SolvedVoids {
    /// Greatest von Mises stress at a pressure on the top, Pa.
    pub fn stress(&self, pressure: f64) -> Option<f64> {
        between(&self.stress, pressure)
    }
}

/// On straight lines between points: for what contact bends.
fn between(points: &[[f64; 2]], x: f64) -> Option<f64> {
    let last = points.last()?[0];
    if !(0.0..=last * (1.0 + 1e-12)).contains(&x) {
        return None;
    }
    let upper = points
        .partition_point(|point| point[0] < x)
        .clamp(1, points.len() - 1);
    let ([x0, y0], [x1, y1]) = (points[upper - 1], points[upper]);
    Some(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
}
