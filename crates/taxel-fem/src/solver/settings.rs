//! Settings of a solution, and what its steps report.

use super::volume::LeastVolume;
use crate::assembly::contact::Multipliers;
use crate::assembly::kernel::ELIMINATION_RATIO;
use crate::sparse::Definiteness;

/// Settings of the solution. The defaults suit rubber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The iteration ends when `sqrt(|R . du|)` has fallen to this fraction of the
    /// step's first.
    pub tolerance: f64,
    /// Iterations after which a step is given up.
    pub iterations: usize,
    /// After a step of at most this many iterations the next step grows; after more than twice as
    /// many it shrinks.
    pub easy_iterations: usize,
    /// First step as a fraction of the path.
    pub first_step: f64,
    /// Largest step.
    pub largest_step: f64,
    /// Smallest step; below it the solution fails.
    pub smallest_step: f64,
    /// Starts each step on the straight line through the last two states.
    pub extrapolate: bool,
    /// Reach along that line, as a share of the step: where contacts change, the whole
    /// line leads too far.
    pub reach: f64,
    /// Gives up a stalled step: after this many iterations the energy norm must have fallen to a
    /// tenth; before, it may not double; and half of them may not pass without a new minimum. `None`
    /// gives up a step by `iterations` alone. For bodies that fold, where a shorter step costs less
    /// than a stalled iteration.
    pub stall_iterations: Option<usize>,
    /// Rounds of contact multipliers in a step.
    pub rounds: usize,
    /// Where the multipliers of obstacles and surfaces stand.
    pub multipliers: Multipliers,
    /// Accepts no state in which a cell is inside out anywhere, corners and points between those
    /// of integration included: such a cell gets more points of integration first, and what is
    /// then still inside out is refused. Without, the state is accepted and reported
    /// ([`Step::least_volume`], `Solver::least_volume_ratio`): at a bonded corner, where the
    /// stretch has no bound, that is often as good elsewhere, and goes further.
    pub whole_cells: bool,
    /// Steps in which a body may creep, against a drag, to the equilibrium that it jumps to where the
    /// smallest step fails on a rough contact ([`Step::jump`]): points that begin to slide together
    /// have none nearby. Rigid bodies, constraints and an iterative solver do not creep. With 0 no
    /// jump is accepted, neither by a creep nor by a step that hops over a fold.
    pub jump_steps: usize,
    /// Jumps under one load after which the solution ends.
    pub jumps: usize,
    /// Under given loads only stable equilibria are accepted: beyond a limit point the
    /// iteration may find another one far away.
    pub stable: bool,
    /// Bulk over shear modulus by which pressures are eliminated where a solid keeps its
    /// volume. The result does not depend on it: the more, the fewer iterations; the less,
    /// the less rounding in the pressure (1e-15 of a shear modulus times this).
    pub elimination: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: 1e-7,
            iterations: 14,
            easy_iterations: 5,
            first_step: 0.1,
            largest_step: 1.0,
            smallest_step: 1e-4,
            extrapolate: true,
            reach: 1.0,
            stall_iterations: None,
            rounds: 8,
            multipliers: Multipliers::Automatic,
            whole_cells: false,
            jump_steps: 200,
            jumps: 100,
            stable: true,
            elimination: ELIMINATION_RATIO,
        }
    }
}

/// A jump to an equilibrium that is not near to the last one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// Greatest way of a node, m.
    pub way: f64,
    /// Undeformed place of that node.
    pub place: [f64; 3],
}

/// Record of a converged step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Newton iterations, all rounds together.
    pub iterations: usize,
    /// Those before the first round of contact multipliers, as many as with a new tangent in each.
    pub before_rounds: usize,
    /// The least volume ratio over all cells; none for a body without cells.
    pub least_volume: Option<LeastVolume>,
    /// Sign of the tangent at the end.
    pub definiteness: Definiteness,
    /// Fraction of the way that has been gone.
    pub fraction: f64,
    /// Set if the body lost its equilibrium and jumped to this one.
    pub jump: Option<Jump>,
    /// Energy norms of the last three iterations before the first round, the last one last; zero
    /// where there were fewer.
    pub energies: [f64; 3],
}

/// Decision after an accepted step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continue {
    /// Go on.
    Yes,
    /// Stop here; the accepted state stays.
    Stop,
}
