//! The closing curve of a cell that no table has, by finite elements.

use taxel::mechanics::{CellGeometry, SectionShape, SolvedCell};
use taxel_fem::material::{Law, Material};
use taxel_fem::mesh::{CornerDivision, VoidCell};
use taxel_fem::solver::failure::Failure;

use super::microchannel_cell::{Closure, Filling, VoidStudy, WallContact};

/// Area ratios that are solved, as far as the solution goes: close enough that the curve
/// through them is better than the mesh, and beyond the touch as the tables have them.
const RATIOS: [f64; 34] = [
    0.99, 0.98, 0.96, 0.94, 0.92, 0.9, 0.875, 0.85, 0.825, 0.8, 0.775, 0.75, 0.7, 0.65, 0.6, 0.55,
    0.5, 0.45, 0.4, 0.36, 0.33, 0.3, 0.275, 0.25, 0.225, 0.2, 0.18, 0.16, 0.14, 0.12, 0.105, 0.09,
    0.075, 0.06,
];
/// Area ratios of the bulging cell that are solved, as far as the solution goes.
const BULGED: [f64; 8] = [1.03, 1.08, 1.15, 1.25, 1.4, 1.6, 1.8, 2.0];
/// Fewest of them that make a curve.
const FEWEST_BULGED: usize = 2;
/// Area ratios at which a coarser mesh is solved too.
const COMPARED: [f64; 5] = [0.98, 0.9, 0.75, 0.5, 0.3];
/// The same of the bulging cell.
const COMPARED_BULGED: [f64; 2] = [1.25, 2.0];
/// Area ratios of the touch and of the next point that lie closer are one.
const CLOSEST: f64 = 2e-3;
/// Error of the net pressure that is stated at least: what the verified cells show.
const LEAST_ERROR: f64 = 1e-3;

/// Height over width above which folds need small cells.
const TALL: f64 = 0.15;

/// Half a cell for the solver, with a mesh on which net pressures stand within 0.1 %:
/// folds of low microchannels stay small, those of tall ones need more cells.
pub(crate) fn void_cell(cell: &CellGeometry) -> VoidCell {
    let section = cell.section;
    VoidCell {
        width: section.width,
        height: section.height,
        cover: cell.roof,
        base: cell.thickness - section.height - cell.roof,
        pitch: cell.pitch,
        fillet: 0.0,
        division: match section.shape {
            SectionShape::Ellipse => ROUND,
            SectionShape::Rectangle => CornerDivision {
                smallest: if section.height > TALL * section.width {
                    0.01
                } else {
                    1.0 / 30.0
                },
                ..CornerDivision::default()
            },
        },
    }
}

/// Cells of an ellipse: none grow small at its smooth corners.
const ROUND: CornerDivision = CornerDivision {
    smallest: 0.125,
    segments: 4,
    growth: 1.25,
    largest: f64::INFINITY,
};

/// Half of the cells along each side.
fn coarser(division: CornerDivision, shape: SectionShape) -> CornerDivision {
    match shape {
        SectionShape::Rectangle => CornerDivision {
            smallest: (2.0 * division.smallest).min(0.25),
            growth: 2.0,
            ..division
        },
        SectionShape::Ellipse => CornerDivision {
            smallest: 2.0 * division.smallest,
            segments: division.segments / 2,
            growth: 1.6,
            ..division
        },
    }
}

/// The study of a cell with the settings that follow its folds.
///
/// # Errors
/// When the lengths make no cell.
pub(crate) fn void_study(
    cell: &VoidCell,
    shape: SectionShape,
    material: Material,
    filling: &Filling,
) -> Result<VoidStudy, Failure> {
    let contact = WallContact::default();
    let mut study = match shape {
        SectionShape::Rectangle => VoidStudy::new(cell, material, filling, contact)?,
        SectionShape::Ellipse => VoidStudy::elliptic(cell, material, filling, contact)?,
    };
    let settings = &mut study.solver.settings;
    // A fold that cannot be followed is not found by ever smaller steps.
    settings.smallest_step = 0.03;
    // Folds grow all the time: half the line, and shorter steps instead of long iterations.
    settings.reach = 0.5;
    settings.stall_iterations = Some(8);
    // Far below what the mesh leaves: areas change by less than 1e-5.
    settings.tolerance = 1e-5;
    Ok(study)
}

/// Solves the closing curve of a cell; `progress` hears the fraction.
///
/// # Errors
/// A sentence when there is no curve, with what to change.
pub(crate) fn solve_cell(
    cell: &CellGeometry,
    progress: &mut dyn FnMut(f64),
) -> Result<SolvedCell, String> {
    // In units of the height and of the shear modulus.
    let unit = cell.section.height;
    let mut scaled = *cell;
    for length in [
        &mut scaled.section.width,
        &mut scaled.section.height,
        &mut scaled.roof,
        &mut scaled.thickness,
        &mut scaled.pitch,
    ] {
        *length /= unit;
    }
    let fine = void_cell(&scaled);
    let mut way = Way::new(&fine, cell.section.shape).map_err(|failure| advice(cell, &failure))?;
    // The coarser mesh takes about a quarter of the time.
    let count = (RATIOS.len() + BULGED.len()) as f64 / 0.8;
    for (number, &ratio) in RATIOS.iter().enumerate() {
        if !way.close(ratio) {
            break;
        }
        progress((number + 1) as f64 / count);
    }
    if way.states.len() < SolvedCell::FEWEST {
        return Err(match &way.ended {
            Some(reason) => format!(
                "the cell of {} closes to {:.3} of its area and no further: {reason}\nhelp: change the height \
                 of the channel or the solid above it, or give the curve as points (closing.points)",
                words(cell),
                way.states.last().map_or(1.0, |state| state.area_ratio),
            ),
            None => String::from("the solution has too few states"),
        });
    }
    let mut bulging =
        Way::new(&fine, cell.section.shape).map_err(|failure| advice(cell, &failure))?;
    for (number, &ratio) in BULGED.iter().enumerate() {
        if !bulging.close(ratio) {
            break;
        }
        // Beyond the greatest pressure that it holds it gives way.
        if let [.., before, now] = bulging.states[..]
            && now.pressure >= before.pressure
        {
            bulging.states.pop();
            break;
        }
        progress((RATIOS.len() + number + 1) as f64 / count);
    }
    // The slope at rest, which is known exactly, is better than a curve through one state.
    if bulging.states.len() < FEWEST_BULGED {
        bulging.states.clear();
    }
    let coarse = VoidCell {
        division: coarser(fine.division, cell.section.shape),
        ..fine
    };
    let error = way
        .difference(&coarse, &COMPARED)
        .max(bulging.difference(&coarse, &COMPARED_BULGED))
        .max(LEAST_ERROR);
    Ok(SolvedCell {
        compliance: way.compliance(),
        points: way
            .states
            .iter()
            .map(|state| [state.pressure, state.area_ratio])
            .collect(),
        bulged: bulging
            .states
            .iter()
            .map(|state| [-state.pressure, state.area_ratio])
            .collect(),
        touch: way.touch,
        error,
        ended: way.ended,
    })
}

/// A cell in words.
fn words(cell: &CellGeometry) -> String {
    let um = |length: f64| {
        format!("{:.4}", length * 1e6)
            .trim_end_matches('0')
            .trim_end_matches('.')
            .to_owned()
    };
    format!(
        "{} x {} um under {} um in a sheet of {} um at a pitch of {} um",
        um(cell.section.width),
        um(cell.section.height),
        um(cell.roof),
        um(cell.thickness),
        um(cell.pitch)
    )
}

/// Why a cell has no mesh, and what to change.
fn advice(cell: &CellGeometry, failure: &Failure) -> String {
    format!(
        "the cell of {} has no mesh: {}\nhelp: give each part of it, the wall between two channels, the roof and the \
         solid below, at least a hundredth of the height of a channel, or give the curve as points (closing.points)",
        words(cell),
        failure.reason
    )
}

/// A cell being closed, or bulged.
struct Way {
    study: VoidStudy,
    shape: SectionShape,
    states: Vec<Closure>,
    touch: Option<f64>,
    ended: Option<String>,
}

impl Way {
    fn new(cell: &VoidCell, shape: SectionShape) -> Result<Self, Failure> {
        let solid = Material::incompressible(Law::MooneyRivlin { c10: 0.5, c01: 0.0 });
        Ok(Self {
            study: void_study(cell, shape, solid, &Filling::Vented)?,
            shape,
            states: Vec::new(),
            touch: None,
            ended: None,
        })
    }

    /// Closes to an area ratio, by the first touch where that lies on the way; false when the
    /// solution ends.
    fn close(&mut self, ratio: f64) -> bool {
        let solver = &self.study.solver;
        let before = (solver.state().clone(), solver.targets().to_vec());
        let mut closed = self.to(ratio);
        if self.touch.is_none() && closed.as_ref().is_ok_and(|state| state.touches) {
            self.touch_first(before, ratio);
            if self.touch.is_some_and(|touch| touch < ratio + CLOSEST) {
                return true;
            }
            closed = self.to(ratio);
        }
        match closed {
            Ok(state) => self.states.push(state),
            Err(failure) => self.ended = Some(failure.reason.to_string()),
        }
        self.ended.is_none()
    }

    /// The state at an area ratio, which it has but for the tolerance of the solver.
    fn to(&mut self, area_ratio: f64) -> Result<Closure, Failure> {
        let state = self.study.close(area_ratio)?;
        Ok(Closure {
            area_ratio,
            ..state
        })
    }

    /// The state at the first touch, where the curve bends. From `state` they do not touch yet, at
    /// `reached` they do: what lies between is narrowed from both sides until it is worth less than the
    /// error that is stated.
    fn touch_first(
        &mut self,
        (mut state, mut targets): (taxel_fem::assembly::state::State, Vec<f64>),
        reached: f64,
    ) {
        let [.., mut before, mut open] = self.states[..] else {
            return;
        };
        let place = |solver: &taxel_fem::solver::newton::Solver| {
            (solver.state().clone(), solver.targets().to_vec())
        };
        let end = place(&self.study.solver);
        let mut touching: Option<Closure> = None;
        loop {
            let least = touching.map_or(reached, |touching| touching.area_ratio);
            let width = open.area_ratio - least;
            if touching.is_some() && width <= LEAST_ERROR * least {
                break;
            }
            // Where the line of the gap ends, inside of what is left.
            let slope = (before.gap - open.gap) / (before.area_ratio - open.area_ratio);
            let margin = 0.1 * width;
            let ratio = (open.area_ratio - open.gap / slope)
                .clamp(least + margin, open.area_ratio - margin);
            self.study.solver.restart(state.clone(), targets.clone());
            match self.to(ratio) {
                Ok(found) if found.touches => touching = Some(found),
                Ok(found) => {
                    (before, open) = (open, found);
                    (state, targets) = place(&self.study.solver);
                }
                Err(_) => break,
            }
        }
        if let Some(found) = touching {
            self.study.solver.restart(state, targets);
            if self.to(found.area_ratio).is_ok() {
                self.touch = Some(found.area_ratio);
                self.states.push(found);
                return;
            }
        }
        self.study.solver.restart(end.0, end.1);
    }

    /// Share of the area lost per net pressure at rest: the secants of the first two states
    /// on a line to rest.
    fn compliance(&self) -> f64 {
        let secant = |state: &Closure| (1.0 - state.area_ratio) / state.pressure;
        let [one, two, ..] = self.states[..] else {
            return f64::NAN;
        };
        let [a, b] = [1.0 - one.area_ratio, 1.0 - two.area_ratio];
        (secant(&one) * b - secant(&two) * a) / (b - a)
    }

    /// Greatest difference of the net pressure of a coarser mesh, as a share: more than the
    /// error of the finer one. One where the coarser has no solution.
    fn difference(&self, coarse: &VoidCell, ratios: &[f64]) -> f64 {
        let Ok(mut other) = Self::new(coarse, self.shape) else {
            return 1.0;
        };
        let mut most = 0.0_f64;
        for ratio in ratios {
            let same = |state: &&Closure| (state.area_ratio - ratio).abs() < 1e-9;
            let Some(known) = self.states.iter().find(same) else {
                break;
            };
            match other.study.close(*ratio) {
                Ok(state) => most = most.max((state.pressure / known.pressure - 1.0).abs()),
                Err(_) => break,
            }
        }
        most
    }
}
