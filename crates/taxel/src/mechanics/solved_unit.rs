//! The elastic unit of P2 solved by finite elements, from its drawing.

use taxel_fem::solver::failure::Failure;
use taxel_fem::study::bump_block::{BlockResponse, BlockSides, BumpBlock, TopForce, linear};

pub use taxel_fem::study::bump_block::BlockDivision;

use super::elastic_unit::{FlankCompliance, UnitCompliance, UnitDrawing};
use super::solved_voids::NotSolved;

/// Copper of the electrodes: Young's modulus, Pa, and Poisson's ratio. Only that it is stiff
/// matters: at the moduli of rubber the closings do not depend on it.
const COPPER: [f64; 2] = [117e9, 0.34];
/// Young's modulus of the elastomer that is solved, Pa: closings times modulus do not depend on it.
const SOFT: f64 = 1e6;

/// A unit under forces on the flat top of its bump, by linear elasticity; times Young's
/// modulus of the elastomer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolvedUnit {
    /// Mean closing per normal force, Pa m/N.
    pub c_zz: f64,
    /// d_x per side force, Pa m/N.
    pub c_xx: f64,
    /// Largest closing over the mean, under a normal and under a side force.
    pub hot: [f64; 2],
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

impl SolvedUnit {
    /// The compliance of this drawing by `table` with what was solved: what was not, forces
    /// on strips and air in the cavities, keeps its ratio to it.
    pub fn in_place_of(&self, table: &UnitCompliance) -> UnitCompliance {
        let [x, z] = [self.c_xx / table.c_xx, self.c_zz / table.c_zz];
        let scaled = |[along, down]: [f64; 2]| [x * along, z * down];
        UnitCompliance {
            c_zz: self.c_zz,
            c_xx: self.c_xx,
            hot_z: self.hot[0],
            hot_x: self.hot[1],
            strips: table.strips.map(|strip| FlankCompliance {
                by_side_force: scaled(strip.by_side_force),
                by_downward_force: scaled(strip.by_downward_force),
                ..strip
            }),
            volume_by_force: z * table.volume_by_force,
            ..*table
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
    /// Unknowns of the larger solution.
    pub unknowns: usize,
}

impl UnitDrawing {
    /// Solves a quarter of the unit under a normal and under a side force on the flat top of
    /// its bump, with hexahedra of quadratic displacement and linear pressure.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn solve(&self, solution: &UnitSolution) -> Result<SolvedUnit, NotSolved> {
        let solve = |force| self.response(solution, force, false);
        let (normal, side) = (solve(TopForce::Normal)?, solve(TopForce::Side)?);
        Ok(SolvedUnit {
            c_zz: SOFT * normal.closing,
            // The other side opens as much.
            c_xx: 2.0 * SOFT * side.closing,
            hot: [normal.hottest, side.hottest],
            unknowns: normal.unknowns.max(side.unknowns),
        })
    }

    /// Solves three units in a row, of which the middle one is pressed: cut out as one piece, or
    /// with mirror images beside it.
    ///
    /// # Errors
    /// [`NotSolved`] when the lengths make no unit, or the solution fails.
    pub fn crosstalk(&self, solution: &UnitSolution) -> Result<Crosstalk, NotSolved> {
        let solve = |force| {
            let response = self.response(solution, force, true)?;
            let beside = response.beside.unwrap_or([f64::NAN; 2]);
            let over = beside.map(|closing| closing / response.closing);
            Ok::<_, NotSolved>((over, response.unknowns))
        };
        let (normal, unknowns) = solve(TopForce::Normal)?;
        let (side, also) = solve(TopForce::Side)?;
        Ok(Crosstalk {
            normal,
            side,
            unknowns: unknowns.max(also),
        })
    }

    fn response(
        &self,
        solution: &UnitSolution,
        force: TopForce,
        in_row: bool,
    ) -> Result<BlockResponse, NotSolved> {
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
        let [copper, ratio] = COPPER;
        let solids = [linear(SOFT, solution.poisson), linear(copper, ratio)];
        let sides = if solution.symmetric {
            BlockSides::Symmetric
        } else {
            BlockSides::Free
        };
        let answer = block.solve(solids, sides, force, solution.division);
        answer.map_err(|failure: Failure| NotSolved::Solver(failure.to_string()))
    }
}
