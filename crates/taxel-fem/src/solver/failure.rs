//! Why a solution failed, and what would probably help.

use crate::assembly::system::InvertedCell;
use crate::mesh::error::{at, scale, short};
use crate::problem::{FreePart, ProblemError};
use crate::solver::volume::LeastVolume;
use crate::sparse::LinearError;

/// A solution that could not go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{reason}. The last good state is at {:.1} % of the way ({}). {}", .fraction * 100.0, listed(.parameters), .reason.advice())]
pub struct Failure {
    /// Why.
    pub reason: Reason,
    /// Fraction of the way at the last accepted state.
    pub fraction: f64,
    /// Parameters at the last accepted state, by name.
    pub parameters: Vec<(String, f64)>,
}

impl Failure {
    /// A failure before the first step.
    pub fn at_start(reason: Reason) -> Self {
        Self {
            reason,
            fraction: 0.0,
            parameters: Vec::new(),
        }
    }
}

fn listed(parameters: &[(String, f64)]) -> String {
    if parameters.is_empty() {
        return "at rest".to_owned();
    }
    let parts: Vec<String> = parameters
        .iter()
        .map(|(name, value)| format!("{name} = {value:.6e}"))
        .collect();
    parts.join(", ")
}

fn inside_out_at(LeastVolume { ratio, cell, place }: &LeastVolume) -> String {
    format!(
        "cell {cell} is inside out between its points of integration near {}, at a volume ratio of {ratio:.2}",
        at(place)
    )
}

fn before(least: Option<&LeastVolume>) -> String {
    least.map_or_else(String::new, |least| {
        format!("; before, {}", inside_out_at(least))
    })
}

/// The motion of a body against which it has the least stiffness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnstableMode {
    /// Undeformed place of the node that moves most.
    pub place: [f64; 3],
    /// Unit direction of its motion, of either sign.
    pub direction: [f64; 3],
}

impl std::fmt::Display for UnstableMode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [u, v, w] = self.direction;
        write!(
            f,
            "; the body gives way most near {}, along ({u:.2}, {v:.2}, {w:.2})",
            at(&self.place)
        )
    }
}

/// Reason of a failure.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Reason {
    /// The problem is not complete.
    #[error("{0}")]
    Problem(ProblemError),
    /// The geometry makes no mesh.
    #[error("{0}")]
    Mesh(crate::mesh::MeshError),
    /// A field in the deformed shape can't be found.
    #[error("{0}")]
    Field(crate::field::FieldError),
    /// A cell turned inside out.
    #[error("{0}")]
    Inverted(#[from] InvertedCell),
    /// The linear system has no good answer.
    #[error("{0}")]
    Linear(#[from] LinearError),
    /// A number is not finite.
    #[error("the iteration left the range of numbers")]
    NotANumber,
    /// The iteration did not end.
    #[error("the iteration did not converge in {} iterations (first and last energy norm {:.1e}, {:.1e}){}", .energies.len(), .energies.first().unwrap_or(&0.0), .energies.last().unwrap_or(&0.0), before(.inside_out.as_ref()))]
    NotConverged {
        /// Energy norms of the iterations.
        energies: Vec<f64>,
        /// The cell that is most inside out between its points of integration at the last
        /// accepted state, if any is.
        inside_out: Option<LeastVolume>,
    },
    /// A contact point changes between touching and not.
    #[error("contact {contact} chatters: a point near {} touches in one iteration and not in the next, without end", at(.place))]
    Chatter {
        /// Number of the contact.
        contact: usize,
        /// Undeformed place of the point of the greatest pressure that does.
        place: [f64; 3],
        /// Energy norms of the iterations.
        energies: Vec<f64>,
    },
    /// The linear system has no good answer, behind a state with a cell that is inside out.
    #[error("{error}; before, {}", inside_out_at(.least))]
    LinearInsideOut {
        /// Error of the linear system.
        error: LinearError,
        /// The cell that is most inside out between its points of integration at the last
        /// accepted state.
        least: LeastVolume,
    },
    /// The walls of a cavity have passed through each other.
    #[error(
        "the walls of cavity {cavity} pass through each other: its volume comes out as {share:.1e} of that at rest"
    )]
    CavityCrossed {
        /// Number of the cavity.
        cavity: usize,
        /// Its volume over that at rest.
        share: f64,
    },
    /// What touches is driven into each other.
    #[error(
        "contact {contact} overlaps by {}, though its pressure has grown round by round: what is prescribed drives its surface into what it touches", short(*.overlap)
    )]
    Overlapped {
        /// Number of the contact.
        contact: usize,
        /// Deepest overlap, m.
        overlap: f64,
    },
    /// A part that only contacts can hold is not held by them.
    #[error(
        "only a contact could hold {0}, and none does: it does not touch there, not in that direction, or with too little friction"
    )]
    HeldByContact(FreePart),
    /// Surfaces moved farther in a step than their contact looks.
    #[error(
        "a surface of contact {contact} moves by {} in one step, farther than its reach of {}", short(*.way), short(*.reach)
    )]
    Leapt {
        /// Number of the contact.
        contact: usize,
        /// Way of the node that moves most, m.
        way: f64,
        /// Reach of the contact, m.
        reach: f64,
    },
    /// A solid has no resistance left in some direction.
    #[error(
        "the solid {region:?} lost its ellipticity in cell {cell} near {}, at a stretch of {:.3}: it would form a crease or a band there", at(.place), .stretch
    )]
    LostEllipticity {
        /// Number of the cell.
        cell: usize,
        /// Name of its region.
        region: String,
        /// Undeformed place.
        place: [f64; 3],
        /// Greatest principal stretch there, or the inverse of the least where that is greater.
        stretch: f64,
    },
    /// The body has no room for the volume of a cell.
    #[error(
        "the volume that the solid {region:?} asks for has no room: cell {cell} near {} misses it by {:.1e} of itself and does not come nearer", at(.place), .missed
    )]
    Volume {
        /// Number of the cell.
        cell: usize,
        /// Name of its region.
        region: String,
        /// Undeformed place of its middle.
        place: [f64; 3],
        /// Share of its volume that is missed.
        missed: f64,
    },
    /// The equilibrium found is not near: no path leads there.
    #[error("no equilibrium was found beyond but one that is far: the body jumps by {} near {}", short(*.way), at(.place))]
    Hopped {
        /// Way of the node that the path explains least, m.
        way: f64,
        /// Undeformed place of that node.
        place: [f64; 3],
    },
    /// A body that jumps again and again.
    #[error("the body lost its equilibrium and jumped to another one {jumps} times under this load{}", before(.inside_out.as_ref()))]
    KeepsJumping {
        /// Number of jumps.
        jumps: usize,
        /// The cell that is most inside out between its points of integration at the last
        /// accepted state, if any is.
        inside_out: Option<LeastVolume>,
    },
    /// The equilibrium found under given loads is not stable.
    #[error("the equilibrium found is not stable: a limit point or a bifurcation lies before it{}", .mode.map(|mode| mode.to_string()).unwrap_or_default())]
    Unstable {
        /// The way in which the body would leave it; none where it was not looked for.
        mode: Option<UnstableMode>,
    },
    /// There is no equilibrium near beyond: a limit of the given loads. Followed by arc length, the
    /// load turns.
    #[error(
        "no equilibrium was found beyond: the body gives way {times:.0} times as fast as on the way so far, most near {}", at(.place)
    )]
    Limit {
        /// Slope of the displacement by the load over its mean so far.
        times: f64,
        /// Undeformed place of the node that goes fastest.
        place: [f64; 3],
    },
    /// The body gives way in a cell that is inside out between its points of integration: that is
    /// of the mesh, and neither a limit of the load nor an instability of the body.
    #[error("{}, and the body gives way there", inside_out_at(.0))]
    CellGivesWay(LeastVolume),
    /// It was asked to stop (`Solver::stop_when`).
    #[error("stopped on request")]
    Stopped,
    /// The quantity that controls the step does not respond to its parameter.
    #[error("the controlled quantity does not respond to its parameter")]
    ControlLost,
}

impl Reason {
    /// The same with its lengths in a unit in which they are `by` times as many; true if it has
    /// any.
    pub fn scale(&mut self, by: f64) -> bool {
        match self {
            Self::Problem(error) => error.scale(by),
            Self::Mesh(error) => error.scale(by),
            Self::Field(error) => error.scale(by),
            Self::HeldByContact(part) => part.scale(by),
            Self::Inverted(InvertedCell { place, .. })
            | Self::LinearInsideOut {
                least: LeastVolume { place, .. },
                ..
            }
            | Self::NotConverged {
                inside_out: Some(LeastVolume { place, .. }),
                ..
            }
            | Self::KeepsJumping {
                inside_out: Some(LeastVolume { place, .. }),
                ..
            }
            | Self::CellGivesWay(LeastVolume { place, .. })
            | Self::Unstable {
                mode: Some(UnstableMode { place, .. }),
            }
            | Self::Chatter { place, .. }
            | Self::LostEllipticity { place, .. }
            | Self::Volume { place, .. }
            | Self::Limit { place, .. } => scale(place, by),
            Self::Hopped { way, place } => {
                *way *= by;
                scale(place, by)
            }
            Self::Overlapped { overlap, .. } => {
                *overlap *= by;
                true
            }
            Self::Leapt { way, reach, .. } => {
                *way *= by;
                *reach *= by;
                true
            }
            _ => false,
        }
    }

    /// True when smaller steps can't help.
    pub(crate) fn is_final(&self) -> bool {
        match self {
            Self::Problem(_)
            | Self::Mesh(_)
            | Self::Field(_)
            | Self::Linear(LinearError::Memory { .. })
            | Self::Stopped => true,
            Self::Inverted(cell) => cell.undeformed,
            _ => false,
        }
    }

    /// Advice that probably helps.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::Problem(_) | Self::Mesh(_) | Self::Field(_) => "Mend the input",
            Self::Inverted(cell) if cell.undeformed => {
                "Check the geometry and the orientation of that cell"
            }
            Self::Inverted(_) => {
                "A fold or a bonded corner, or a step too large: give walls that meet there a contact, round the corner, or make the cells there larger; smaller ones turn inside out sooner at a corner without bound"
            }
            Self::Linear(LinearError::Singular) => {
                "Add a support in the direction that is free, or control by displacement instead of load"
            }
            Self::Linear(LinearError::Unsymmetric { .. }) => {
                "Allow smaller steps; less friction; hold what slides or turns away by a displacement"
            }
            Self::Linear(_) => "Check materials for extreme ratios of stiffness",
            Self::Limit { .. } | Self::Unstable { .. } | Self::Hopped { .. } => {
                "A limit of the load: control by displacement, volume or arc length goes beyond it"
            }
            Self::CavityCrossed { .. } => {
                "Give the walls that meet a contact; or end before, a cavity has a volume above 0"
            }
            Self::Overlapped { .. } => {
                "Move the surface less far, or leave it free where it touches; with free surfaces, take smaller steps or more rounds"
            }
            Self::CellGivesWay(_)
            | Self::LinearInsideOut { .. }
            | Self::NotConverged {
                inside_out: Some(_),
                ..
            } => {
                "The strain there outgrew the cells: give faces that fold onto each other there a contact; or larger cells, since smaller ones turn inside out sooner, or a rounder edge"
            }
            Self::NotANumber | Self::NotConverged { .. } => {
                "Allow smaller steps or more iterations; where surfaces touch, a stiffer contact; where the least volume ratio is near zero, larger cells"
            }
            Self::LostEllipticity { .. } => {
                "The law has left its range: use constants fitted to this strain, or a law that stiffens"
            }
            Self::KeepsJumping { .. } => {
                "Where a contact slips point by point, less friction, or larger cells at its surface; a rounder edge, or a contact between faces that fold onto each other, where a cell is inside out; go on from the last state with a shorter load"
            }
            Self::Chatter { .. } => {
                "Lower the contact stiffness or refine the touching surface; allow smaller steps or more iterations"
            }
            Self::HeldByContact(_) => {
                "Hold that motion by a support; or begin with the part in touch and drive it by a displacement until it is pressed, before it is loaded"
            }
            Self::Leapt { .. } => {
                "Allow smaller steps, or give the contact a larger reach, below the thickness of the body there"
            }
            Self::Volume { .. } => {
                "The supports, contacts and cavities leave no volume to go to: free a surface, or give the solid a bulk modulus"
            }
            Self::Stopped => "Go on from there",
            Self::ControlLost => {
                "Choose a quantity that the parameter changes; a force on what nothing but a contact links to the rest begins when a way has pressed it"
            }
        }
    }
}
