//! The elastic unit of P2 solved by finite elements, from its drawing.

use taxel::mechanics::{
    AIR_PRESSURE, Cavity, ElasticDescription, FlankCompliance, Pressed, PressedUnit, SOLVED_ERROR,
    SolvedStiffness, UnitCompliance, UnitDrawing,
};
use taxel_fem::solver::failure::Failure;
use taxel_fem::solver::newton::Solver;
use taxel_fem::study::bump_block::{
    self, BlockAnswer, BlockSides, BumpBlock, PressedBlock, TopAnswer, large_strain, linear,
};

pub use taxel_fem::study::bump_block::{BlockDivision, TopForce};

use super::DeformedBody;
use super::solved_voids::NotSolved;

/// Copper of the electrodes: Young's modulus, Pa, and Poisson's ratio. Only that it is stiff
/// matters: at the moduli of rubber the closings do not depend on it.
const COPPER: [f64; 2] = [117e9, 0.34];
/// Young's modulus of the elastomer that is solved, Pa: closings times modulus do not depend on it.
const SOFT: f64 = 1e6;

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

/// How a unit is solved.
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

/// Closings per force of a drawing; `progress` hears the fraction. The error is what a mesh of a
/// quarter of the unknowns is off, and no less than that of the table.
///
/// # Errors
/// A sentence when the solution fails.
pub(crate) fn solve_stiffness(
    drawing: &UnitDrawing,
    progress: &mut dyn FnMut(f64),
) -> Result<SolvedStiffness, String> {
    let solved = |symmetric: bool, division: BlockDivision| {
        let solution = UnitSolution {
            symmetric,
            division,
            ..UnitSolution::default()
        };
        let drawing = *drawing;
        let unit = ElasticUnit { drawing, solution }.solve();
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
    Ok(SolvedStiffness {
        sides: [free, among].map(|side| UnitCompliance { error, ..side }),
    })
}

/// A quarter of a unit under a force, N.
fn body(solver: &Solver, along: TopForce, force: f64) -> DeformedBody {
    let (name, axis) = match along {
        TopForce::Normal => ("unit-normal", "z"),
        TopForce::Side => ("unit-side", "x"),
    };
    let words = format!("f{axis} = {:.4} mN", 1e3 * force);
    DeformedBody::of(solver, name, words, "section")
}

/// A state of the block as one of the unit.
fn pressed(block: bump_block::Pressed) -> Pressed {
    Pressed {
        force: block.force,
        closing: block.closing,
        least_gap: block.least_gap,
        least_at: block.least_at,
        touching: block.touching,
        capacitance: block.capacitance,
        edge_gaps: block.edge_gaps,
    }
}

/// A unit to be solved by finite elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticUnit {
    /// Its lengths.
    pub drawing: UnitDrawing,
    /// How it is solved.
    pub solution: UnitSolution,
}

impl ElasticUnit {
    /// A unit solved the usual way.
    pub fn new(drawing: UnitDrawing) -> Self {
        let solution = UnitSolution::default();
        Self { drawing, solution }
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
        (largest, steps): (f64, u32),
        progress: &mut dyn FnMut(f64),
    ) -> Result<(PressedUnit, DeformedBody), NotSolved> {
        let (block, _) = self.block(false);
        let of = self.pressed(modulus, permittivity);
        let forces: Vec<f64> = (0..=steps)
            .map(|step| largest * f64::from(step) / f64::from(steps))
            .collect();
        let (path, solver) = block
            .press(&of, &forces, |state| progress(state.force / largest))
            .map_err(|failure| NotSolved::Solver(failure.to_string()))?;
        let mut states: Vec<Pressed> = path.states.into_iter().map(pressed).collect();
        let reached = states.last().map_or(0.0, |state| state.force);
        let touch = path.touch.map(pressed);
        states.extend(touch);
        states.sort_by(|a, b| a.force.total_cmp(&b.force));
        let unit = PressedUnit {
            states,
            touch,
            ended: path.ended.map(|failure| failure.to_string()),
        };
        Ok((unit, body(&solver, TopForce::Normal, reached)))
    }

    /// A quarter of the unit under a normal or a side force on its flat top, N, by linear elasticity.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn body(
        &self,
        elastic: &ElasticDescription,
        (along, force): (TopForce, f64),
    ) -> Result<DeformedBody, NotSolved> {
        let (block, sides) = self.block(false);
        let [copper, ratio] = COPPER;
        let solids = [
            linear(elastic.modulus, self.solution.poisson),
            linear(copper, ratio),
        ];
        let gas = (elastic.cavity == Cavity::Sealed).then_some(AIR_PRESSURE);
        let solver = block.loaded(solids, sides, self.solution.division, (along, force), gas);
        let solver = solver.map_err(|failure| NotSolved::Solver(failure.to_string()))?;
        Ok(body(&solver, along, force))
    }

    /// The unit at the normal force on its flat top at which electrodes touch first, vented: as
    /// [`ElasticUnit::press`].
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution ends before.
    pub fn solve_first_touch(&self, modulus: f64) -> Result<Pressed, NotSolved> {
        let (block, _) = self.block(false);
        block
            .first_touch(&self.pressed(modulus, 1.0))
            .map(pressed)
            .map_err(|failure| NotSolved::Solver(failure.to_string()))
    }

    fn pressed(&self, modulus: f64, permittivity: f64) -> PressedBlock {
        let (_, sides) = self.block(false);
        let [copper, ratio] = COPPER;
        PressedBlock {
            solids: [
                large_strain(modulus, self.solution.poisson),
                linear(copper, ratio),
            ],
            sides,
            division: self.solution.division,
            permittivity,
        }
    }

    /// Solves a quarter of the unit under forces on the top of its bump and on strips of a
    /// flank, and under a pressure in its cavities, with hexahedra of quadratic displacement and
    /// linear pressure.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn solve(&self) -> Result<SolvedUnit, NotSolved> {
        let answer = self.answer(false)?;
        let BlockAnswer { normal, side, .. } = answer;
        let half = 0.5 * self.drawing.electrode;
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
                .map(|slope| SOFT * slope * self.drawing.centre_distance / c_xx),
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
    pub fn solve_sealed(&self, modulus: f64) -> Result<f64, NotSolved> {
        let (block, sides) = self.block(false);
        let [copper, ratio] = COPPER;
        let solids = [
            linear(modulus, self.solution.poisson),
            linear(copper, ratio),
        ];
        let loads = [AIR_PRESSURE, SMALL_FORCE];
        let answer = block.solve_sealed(solids, sides, self.solution.division, loads);
        let [closing, _] = answer.map_err(|failure| NotSolved::Solver(failure.to_string()))?;
        Ok(SMALL_FORCE / closing)
    }

    /// Solves three units in a row, of which the middle one is pressed: cut out as one piece, or
    /// with mirror images beside it.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn crosstalk(&self) -> Result<Crosstalk, NotSolved> {
        let answer = self.answer(true)?;
        let over = |top: TopAnswer| {
            let beside = top.beside.unwrap_or([f64::NAN; 2]);
            beside.map(|closing| closing / top.closing)
        };
        Ok(Crosstalk {
            normal: over(answer.normal),
            side: over(answer.side),
        })
    }

    fn block(&self, in_row: bool) -> (BumpBlock, BlockSides) {
        let half = |length: f64| 0.5 * length;
        let block = BumpBlock {
            half: half(self.drawing.pitch),
            cavity: [half(self.drawing.wall_width), half(self.drawing.unit_side)],
            plate: [
                half(self.drawing.centre_distance - self.drawing.electrode),
                half(self.drawing.centre_distance + self.drawing.electrode),
            ],
            plate_thickness: self.drawing.electrode_thickness,
            lower: self.drawing.lower_layer,
            insulation: self.drawing.insulation,
            air: self.drawing.air_gap,
            upper: self.drawing.upper_layer,
            bump: self.drawing.bump_height,
            bump_half: [half(self.drawing.bump_base), half(self.drawing.bump_top)],
            in_row,
        };
        let sides = if self.solution.symmetric {
            BlockSides::Symmetric
        } else {
            BlockSides::Free
        };
        (block, sides)
    }

    fn answer(&self, in_row: bool) -> Result<BlockAnswer, NotSolved> {
        let (block, sides) = self.block(in_row);
        let [copper, ratio] = COPPER;
        let solids = [linear(SOFT, self.solution.poisson), linear(copper, ratio)];
        let answer = block.solve(solids, sides, self.solution.division);
        answer.map_err(|failure: Failure| NotSolved::Solver(failure.to_string()))
    }
}
