//! The elastic unit of P2 solved by finite elements, from its drawing.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use taxel_fem::solver::failure::Failure;
use taxel_fem::solver::newton::Solver;
use taxel_fem::study::bump_block::{
    BlockAnswer, BlockSides, BumpBlock, PressedBlock, TopAnswer, large_strain, linear,
};

pub use taxel_fem::study::bump_block::{BlockDivision, Pressed, TopForce};

use super::SolvedBody;
use super::elastic_unit::{
    AIR_PRESSURE, Cavity, ElasticDescription, FlankCompliance, SOLVED_ERROR, UnitCompliance,
    UnitDrawing,
};
use super::solved_voids::NotSolved;
use crate::solutions::{Question, Solutions, Unsolved, answer, digits};

/// Copper of the electrodes: Young's modulus, Pa, and Poisson's ratio. Only that it is stiff
/// matters: at the moduli of rubber the closings do not depend on it.
const COPPER: [f64; 2] = [117e9, 0.34];
/// Young's modulus of the elastomer that is solved, Pa: closings times modulus do not depend on it.
const SOFT: f64 = 1e6;

/// Number of this way of solving: another one has other kept solutions.
const METHOD: u32 = 2;
/// Force of a solution with nonlinear terms that is to be linear, N.
const SMALL_FORCE: f64 = 1e-5;

/// A unit solved by linear elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolvedUnit {
    /// Closings, slopes and volumes per force and pressure, times Young's modulus.
    pub compliance: UnitCompliance,
    /// Unknowns of the larger solution.
    pub unknowns: usize,
}

/// What is solved beside the drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitSolution {
    /// Poisson's ratio of the elastomer, below 0.5.
    pub poisson: f64,
    /// True for mirror images beside the block; false for a block that is cut out.
    pub symmetric: bool,
    /// Numbers of cells.
    pub division: BlockDivision,
}

impl Default for UnitSolution {
    /// Free sides, Poisson's ratio 0.49, the usual cells.
    fn default() -> Self {
        Self {
            poisson: 0.49,
            symmetric: false,
            division: BlockDivision::USUAL,
        }
    }
}

/// What a force on one unit of a row does to the next one, whose elastomer is of one piece with
/// it, by linear elasticity: mean closing of the near and of the far cavities of the neighbour over
/// that of the pressed unit on the same side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crosstalk {
    /// Under a normal force: near, far.
    pub normal: [f64; 2],
    /// Under a side force along the row: near, far.
    pub side: [f64; 2],
}

/// A unit with vented cavities under normal forces on its flat top, at large strain and with
/// contact of floor and roof.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedUnit {
    /// By rising force, from rest on; the first touch is one of them.
    pub states: Vec<Pressed>,
    /// At the force at which floor and roof of a cavity touch first; none below it.
    pub touch: Option<Pressed>,
    /// Why it ends before the largest force; none where it does not.
    pub ended: Option<String>,
    /// A quarter of it under the last force.
    pub body: SolvedBody,
}

impl PressedUnit {
    /// The unit under a normal force, N: straight lines between the solved states, of the
    /// capacitance those of its reciprocal, the effective gap; beyond the last state that one, a
    /// bound. `None` for a pull.
    pub fn at(&self, force: f64) -> Option<Pressed> {
        let next = self.states.partition_point(|state| state.force < force);
        let end = *self.states.get(next).or(self.states.last())?;
        if end.force <= force {
            return Some(end);
        }
        let start = self.states.get(next.checked_sub(1)?)?;
        let share = (force - start.force) / (end.force - start.force);
        let between = |a: f64, b: f64| a + share * (b - a);
        Some(Pressed {
            force,
            closing: between(start.closing, end.closing),
            least_gap: between(start.least_gap, end.least_gap),
            least_at: end.least_at,
            touching: between(start.touching, end.touching),
            capacitance: 1.0 / between(1.0 / start.capacitance, 1.0 / end.capacitance),
            edge_gaps: [0, 1].map(|edge| between(start.edge_gaps[edge], end.edge_gaps[edge])),
        })
    }
}

/// Closings per force of a drawing that no table has: solved once, and kept.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SolvedStiffness {
    /// Of a unit that is cut out of the array, and of one with mirror images beside it.
    pub(crate) sides: [UnitCompliance; 2],
}

impl SolvedStiffness {
    /// The solution of a drawing.
    ///
    /// # Errors
    /// [`Unsolved`] when there is none, with what the solver could not get over.
    pub fn of_unit(drawing: &UnitDrawing, solutions: &mut dyn Solutions) -> Result<Self, Unsolved> {
        answer(&question(drawing), solutions, Self::is_sound, |progress| {
            Self::solve(drawing, progress)
        })
    }

    /// The error is what a mesh of a quarter of the unknowns is off, and no less than that of
    /// the table.
    fn solve(drawing: &UnitDrawing, progress: &mut dyn FnMut(f64)) -> Result<Self, String> {
        let solved = |symmetric: bool, division: BlockDivision| {
            let solution = UnitSolution {
                symmetric,
                division,
                ..UnitSolution::default()
            };
            let unit = drawing.solve(&solution);
            unit.map(|unit| unit.compliance)
                .map_err(|failure| failure.to_string())
        };
        let coarse = solved(false, BlockDivision::COARSE)?;
        progress(0.1);
        let free = solved(false, BlockDivision::USUAL)?;
        progress(0.5);
        let among = solved(true, BlockDivision::USUAL)?;
        let closings = |of: &UnitCompliance| [of.c_zz, of.c_xx];
        let pairs = closings(&coarse).into_iter().zip(closings(&free));
        let error = pairs.fold(SOLVED_ERROR, |most, (coarse, fine)| {
            most.max((coarse / fine - 1.0).abs())
        });
        Ok(Self {
            sides: [free, among].map(|side| UnitCompliance { error, ..side }),
        })
    }

    /// True of numbers that a unit may have.
    fn is_sound(&self) -> bool {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        self.sides.iter().all(|side| {
            let strips = side.strips.iter().flat_map(|strip| {
                let [a, b] = [strip.by_side_force, strip.by_downward_force];
                [a[0], a[1], b[0], b[1], strip.stick]
            });
            let [along, across] = side.tilt_x;
            let finite = [side.tilt_z, along, across];
            let mut all = strips.chain(finite);
            [side.c_zz, side.c_xx, side.hot_z, side.hot_x, side.error].map(positive) == [true; 5]
                && [side.volume_by_force, side.volume_by_pressure].map(positive) == [true; 2]
                && [side.opening_by_pressure, side.cavity_volume].map(positive) == [true; 2]
                && all.all(f64::is_finite)
        })
    }
}

/// A quarter of a unit under a force, N.
fn body(solver: &Solver, along: TopForce, force: f64) -> SolvedBody {
    let (name, axis) = match along {
        TopForce::Normal => ("unit-normal", "z"),
        TopForce::Side => ("unit-side", "x"),
    };
    let words = format!("f{axis} = {:.4} mN", 1e3 * force);
    SolvedBody::of(solver, name, words, "section")
}

/// All that the stiffness of a unit follows from.
fn question(drawing: &UnitDrawing) -> Question {
    let lengths = [
        ("electrode", drawing.electrode),
        ("electrode_thickness", drawing.electrode_thickness),
        ("centre_distance", drawing.centre_distance),
        ("unit_side", drawing.unit_side),
        ("wall_width", drawing.wall_width),
        ("lower_layer", drawing.lower_layer),
        ("upper_layer", drawing.upper_layer),
        ("bump_height", drawing.bump_height),
        ("bump_base", drawing.bump_base),
        ("bump_top", drawing.bump_top),
        ("air_gap", drawing.air_gap),
        ("insulation", drawing.insulation),
        ("pitch", drawing.pitch),
    ];
    let mut statement = format!(
        "solution = closings of an elastic unit\n\
         solver = taxel-fem {} method {METHOD}\n\
         material = Poisson's ratio 0.49, closings times Young's modulus\n",
        taxel_fem::VERSION,
    );
    for (name, length) in lengths {
        writeln!(statement, "{name} = {} m", digits(length)).expect("a String takes any text");
    }
    Question {
        what: String::from("stiffness of the unit"),
        statement,
    }
}

impl UnitDrawing {
    /// True if the lengths make a unit: a wall, electrodes within their cavities, and a frame
    /// round these.
    pub fn is_unit(&self) -> bool {
        let rising = [
            0.0,
            self.wall_width,
            self.centre_distance - self.electrode,
            self.centre_distance + self.electrode,
            self.unit_side,
            self.pitch,
        ];
        let layers = self.lower_layer.min(self.upper_layer);
        let [inner, outer] = self.bump_bases();
        rising.windows(2).all(|pair| pair[0] < pair[1])
            && [
                self.bump_height,
                self.air_gap,
                self.insulation,
                self.electrode_thickness,
            ]
            .iter()
            .all(|length| *length > 0.0)
            && self.electrode_thickness < layers
            && self.bump_top > 0.0
            && self.bump_top <= self.bump_base
            && inner < self.bump_base
            && self.bump_base < outer
    }

    /// Sides between which a bump's base ends over the electrodes, where its cells and theirs meet, m.
    pub fn bump_bases(&self) -> [f64; 2] {
        [-1.0, 1.0].map(|side| self.centre_distance + side * self.electrode)
    }

    /// Solves a quarter of the unit, vented, under normal forces on its flat top up to `largest`,
    /// N, in `steps` equal steps: neo-Hookean elastomer of this modulus, Pa, contact of floor and
    /// roof without friction. `permittivity` is that of the insulation; `progress` hears the share
    /// that is done.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit.
    pub fn press(
        &self,
        (modulus, permittivity): (f64, f64),
        solution: &UnitSolution,
        (largest, steps): (f64, u32),
        progress: &mut dyn FnMut(f64),
    ) -> Result<PressedUnit, NotSolved> {
        let (block, _) = self.block(solution, false);
        let of = self.pressed(modulus, permittivity, solution);
        let forces: Vec<f64> = (0..=steps)
            .map(|step| largest * f64::from(step) / f64::from(steps))
            .collect();
        let (path, solver) = block
            .press(&of, &forces, |state| progress(state.force / largest))
            .map_err(|failure| NotSolved::Solver(failure.to_string()))?;
        let mut states = path.states;
        let reached = states.last().map_or(0.0, |state| state.force);
        states.extend(path.touch);
        states.sort_by(|a, b| a.force.total_cmp(&b.force));
        Ok(PressedUnit {
            states,
            touch: path.touch,
            ended: path.ended.map(|failure| failure.to_string()),
            body: body(&solver, TopForce::Normal, reached),
        })
    }

    /// A quarter of the unit under a normal or a side force on its flat top, N, by linear elasticity.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn body(
        &self,
        elastic: &ElasticDescription,
        solution: &UnitSolution,
        (along, force): (TopForce, f64),
    ) -> Result<SolvedBody, NotSolved> {
        let (block, sides) = self.block(solution, false);
        let [copper, ratio] = COPPER;
        let solids = [
            linear(elastic.modulus, solution.poisson),
            linear(copper, ratio),
        ];
        let gas = (elastic.cavity == Cavity::Sealed).then_some(AIR_PRESSURE);
        let solver = block.loaded(solids, sides, solution.division, (along, force), gas);
        let solver = solver.map_err(|failure| NotSolved::Solver(failure.to_string()))?;
        Ok(body(&solver, along, force))
    }

    /// The unit at the normal force on its flat top at which electrodes touch first, vented: as
    /// [`UnitDrawing::press`].
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution ends before.
    pub fn solve_first_touch(
        &self,
        modulus: f64,
        solution: &UnitSolution,
    ) -> Result<Pressed, NotSolved> {
        let (block, _) = self.block(solution, false);
        block
            .first_touch(&self.pressed(modulus, 1.0, solution))
            .map_err(|failure| NotSolved::Solver(failure.to_string()))
    }

    fn pressed(&self, modulus: f64, permittivity: f64, solution: &UnitSolution) -> PressedBlock {
        let (_, sides) = self.block(solution, false);
        let [copper, ratio] = COPPER;
        PressedBlock {
            solids: [
                large_strain(modulus, solution.poisson),
                linear(copper, ratio),
            ],
            sides,
            division: solution.division,
            permittivity,
        }
    }

    /// Solves a quarter of the unit under forces on the top of its bump and on strips of a
    /// flank, and under a pressure in its cavities, with hexahedra of quadratic displacement and
    /// linear pressure.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn solve(&self, solution: &UnitSolution) -> Result<SolvedUnit, NotSolved> {
        let answer = self.answer(solution, false)?;
        let BlockAnswer { normal, side, .. } = answer;
        let half = 0.5 * self.electrode;
        // The other side opens as much.
        let c_xx = 2.0 * SOFT * side.closing;
        let strips = answer.strips.map(|strip| {
            // The table has the flank on the other side.
            let closings = |[mean, more]: [f64; 2]| [-2.0 * SOFT * more, SOFT * mean];
            FlankCompliance {
                by_side_force: closings(strip.by_side_force),
                by_downward_force: closings(strip.by_downward_force),
                stick: -strip.rise[0] / strip.rise[1],
            }
        });
        let compliance = UnitCompliance {
            c_zz: SOFT * normal.closing,
            c_xx,
            hot_z: normal.hottest,
            hot_x: side.hottest,
            tilt_z: normal.slopes[0] * half / normal.closing,
            tilt_x: side
                .slopes
                .map(|slope| SOFT * slope * self.centre_distance / c_xx),
            strips,
            volume_by_force: SOFT * normal.volume,
            volume_by_pressure: SOFT * answer.pressure.volume,
            opening_by_pressure: SOFT * answer.pressure.opening,
            cavity_volume: answer.cavity,
            error: SOLVED_ERROR,
        };
        Ok(SolvedUnit {
            compliance,
            unknowns: answer.unknowns,
        })
    }

    /// Normal stiffness of a unit whose cavities keep their air, N/m, for a modulus in Pa: the
    /// pressure of the air is an unknown of the solution, isothermal at [`AIR_PRESSURE`]. The
    /// force closes a few ten thousandths of the air gap, so that the answer is that of small
    /// loads.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn solve_sealed(&self, modulus: f64, solution: &UnitSolution) -> Result<f64, NotSolved> {
        let (block, sides) = self.block(solution, false);
        let [copper, ratio] = COPPER;
        let solids = [linear(modulus, solution.poisson), linear(copper, ratio)];
        let loads = [AIR_PRESSURE, SMALL_FORCE];
        let answer = block.solve_sealed(solids, sides, solution.division, loads);
        let [closing, _] = answer.map_err(|failure| NotSolved::Solver(failure.to_string()))?;
        Ok(SMALL_FORCE / closing)
    }

    /// Solves three units in a row, of which the middle one is pressed: cut out as one piece, or
    /// with mirror images beside it.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn crosstalk(&self, solution: &UnitSolution) -> Result<Crosstalk, NotSolved> {
        let answer = self.answer(solution, true)?;
        let over = |top: TopAnswer| {
            let beside = top.beside.unwrap_or([f64::NAN; 2]);
            beside.map(|closing| closing / top.closing)
        };
        Ok(Crosstalk {
            normal: over(answer.normal),
            side: over(answer.side),
        })
    }

    fn block(&self, solution: &UnitSolution, in_row: bool) -> (BumpBlock, BlockSides) {
        let half = |length: f64| 0.5 * length;
        let block = BumpBlock {
            half: half(self.pitch),
            cavity: [half(self.wall_width), half(self.unit_side)],
            plate: [
                half(self.centre_distance - self.electrode),
                half(self.centre_distance + self.electrode),
            ],
            plate_thickness: self.electrode_thickness,
            lower: self.lower_layer,
            insulation: self.insulation,
            air: self.air_gap,
            upper: self.upper_layer,
            bump: self.bump_height,
            bump_half: [half(self.bump_base), half(self.bump_top)],
            in_row,
        };
        let sides = if solution.symmetric {
            BlockSides::Symmetric
        } else {
            BlockSides::Free
        };
        (block, sides)
    }

    fn answer(&self, solution: &UnitSolution, in_row: bool) -> Result<BlockAnswer, NotSolved> {
        let (block, sides) = self.block(solution, in_row);
        let [copper, ratio] = COPPER;
        let solids = [linear(SOFT, solution.poisson), linear(copper, ratio)];
        let answer = block.solve(solids, sides, solution.division);
        answer.map_err(|failure: Failure| NotSolved::Solver(failure.to_string()))
    }
}
