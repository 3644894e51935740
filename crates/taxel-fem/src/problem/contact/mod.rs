//! Contact: a surface against an obstacle of simple shape, surfaces against each other, and
//! walls that are paired beforehand.
//!
//! All are energies of the overlap, `1/2 k o^2` per undeformed area, with a
//! multiplier that takes over the pressure (augmented Lagrangian): a contact whose
//! overlap exceeds its limit is solved again with the multiplier at the pressure
//! found, so that the result does not hang on the stiffness `k`. Friction follows the pressure
//! of the same iteration.

mod facing;
mod obstacle;
mod surfaces;
mod walls;

pub use facing::{facing_pairs, lattice_points};
pub use obstacle::{Gap, Obstacle, Shape};
pub use surfaces::SurfacePair;
pub use walls::{Pairing, WallPoint, Walls};

/// Something that keeps parts from passing through each other.
#[derive(Clone, Debug, PartialEq)]
pub enum Contact {
    /// A surface of the body against a rigid obstacle.
    Obstacle(Obstacle),
    /// A surface of the mesh against another one, or against itself.
    Surfaces(SurfacePair),
    /// Walls of the body against each other.
    Walls(Walls),
}

/// State of a contact in a solution.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactState {
    /// Multiplier of each contact point, Pa.
    pub multipliers: Vec<f64>,
    /// The anchor of each point of a rough obstacle or of a surface; none where it meets nothing.
    pub anchors: Vec<Option<Anchor>>,
    /// Numbers of points that stick in the present iteration, whatever their friction.
    pub(crate) stuck: Vec<usize>,
}

/// Where a contact point was when the last step ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anchor {
    /// Where a point that touches would rest without traction, where another one is: in the frame of the obstacle, or in the
    /// reference coordinates of a facet of the second surface.
    pub place: [f64; 3],
    /// Number of that facet in the second surface; none on an obstacle.
    pub facet: Option<u32>,
}

impl ContactState {
    /// Multiplier of a contact point, Pa; zero before the first round.
    pub(crate) fn multiplier(&self, point: usize) -> f64 {
        self.multipliers.get(point).copied().unwrap_or(0.0)
    }

    /// Greatest friction of a point at a coefficient and a pressure, Pa.
    pub(crate) fn bound(&self, point: usize, coefficient: f64, pressure: f64) -> f64 {
        if self.stuck.contains(&point) {
            f64::INFINITY
        } else {
            coefficient * pressure
        }
    }

    /// Anchor of a contact point that rubs.
    pub(crate) fn anchor(&self, point: usize) -> Option<Anchor> {
        self.anchors.get(point).copied().flatten()
    }
}

impl Contact {
    /// True if its points rub from the first step on: those of a body that rests on another one
    /// are not pressed yet, and begin with the second.
    pub(crate) fn rubs_at_once(&self) -> bool {
        matches!(self, Self::Obstacle(obstacle) if obstacle.friction > 0.0)
    }

    /// Pressure in Pa up to which a point counts as free: that of a millionth of the overlap that is
    /// accepted. Where a gap closes at rest, so much is rounding.
    pub fn least_pressure(&self) -> f64 {
        let stiffness = match self {
            Self::Obstacle(obstacle) => obstacle.stiffness,
            Self::Surfaces(pair) => pair.stiffness,
            Self::Walls(walls) => walls.stiffness,
        };
        1e-6 * stiffness * self.overlap_limit()
    }

    /// Overlap in m above which the multipliers are renewed.
    pub fn overlap_limit(&self) -> f64 {
        match self {
            Self::Obstacle(obstacle) => obstacle.overlap_limit,
            Self::Surfaces(pair) => pair.overlap_limit,
            Self::Walls(walls) => walls.overlap_limit,
        }
    }
}
