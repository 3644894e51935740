//! The elastic unit of P2 solved by finite elements, from its drawing.

use taxel_fem::solver::failure::Failure;
use taxel_fem::study::bump_block::{BlockAnswer, BlockSides, BumpBlock, TopAnswer, linear};

pub use taxel_fem::study::bump_block::BlockDivision;

use super::elastic_unit::{
    AIR_PRESSURE, FlankCompliance, SOLVED_ERROR, UnitCompliance, UnitDrawing,
};
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

/// What is solved beside the drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitSolution {
    /// Poisson's ratio of the elastomer, below 0.5.
    pub poisson: f64,
    /// Side of the block, m: the pitch of the array.
    pub block: f64,
    /// True for mirror images beside the block; false for a block that is cut out.
    pub symmetric: bool,
    /// Numbers of cells.
    pub division: BlockDivision,
}

impl Default for UnitSolution {
    /// A block of 2 mm with free sides, Poisson's ratio 0.49, the usual cells.
    fn default() -> Self {
        Self {
            poisson: 0.49,
            block: 2e-3,
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

impl UnitDrawing {
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
            half: half(solution.block),
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
