//! Boundary-value problem: a mesh of solids, its supports and its loads.
//!
//! Everything that acts is driven by scalar parameters: a pressure, the travel of a
//! support or of an obstacle, the factor of a dead load. A [`Rule`] says for each
//! parameter whether a step gives its value, or gives a quantity that the parameter
//! has to bring about (a volume, a displacement, a force), or whether it follows a law.

pub mod cavity;
mod check;
pub(crate) mod constraint;
pub mod contact;
mod kinematics;
pub mod load;
mod rigid;
pub(crate) mod rigid_body;

use crate::material::viscoelastic::Relaxation;
use crate::material::{Material, MaterialError};
use crate::mesh::error::{at, scale, short};
use crate::mesh::{Facet, Mesh};
pub use cavity::{Cavity, CavityLaw};
pub use constraint::Constraint;
pub use contact::{Contact, Obstacle, Pairing, Shape, SurfacePair, WallPoint, Walls};
pub use kinematics::Kinematics;
pub use load::{DeadLoad, Pressure};
pub use rigid::{FreeMotion, FreePart};
pub(crate) use rigid::{Hold, free_part};
pub use rigid_body::{RigidBody, RigidMotion};

/// A scalar that drives loads; numbered in the order of [`Problem::parameter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Parameter(pub usize);

/// Equation that determines a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Rule {
    /// The step prescribes its value.
    Given,
    /// The step prescribes a quantity, and the parameter is solved for.
    Prescribes(Quantity),
    /// It follows a law of the volume of a cavity, by the number of the cavity.
    Follows(usize, CavityLaw),
}

/// A quantity that a step can prescribe.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantity {
    /// Volume of a cavity (area in plane strain), by its number.
    Volume(usize),
    /// Displacement of a node in one component.
    Displacement(u32, usize),
    /// Force that works along a parameter: on the supports and obstacles it moves, N
    /// (N/m in plane strain). Positive when the parameter has to push.
    Force(Parameter),
    /// Length of the path of displacements and parameter from the last accepted step
    /// (arc length); the second number scales the parameter into a displacement.
    Arc(f64),
}

/// Motion of a component that is not free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Fixed.
    Fixed,
    /// By a factor times a parameter.
    Driven(Parameter, f64),
}

/// A component of some nodes that is not free.
#[derive(Clone, Debug, PartialEq)]
pub struct Support {
    /// The nodes.
    pub nodes: Vec<u32>,
    /// Component of displacement.
    pub component: usize,
    /// Its motion.
    pub motion: Motion,
}

/// A boundary value problem.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The undeformed body.
    pub mesh: Mesh,
    /// Kinematics of the third direction.
    pub kinematics: Kinematics,
    /// Solid of each region of the mesh.
    pub materials: Vec<Material>,
    /// Relaxation of each region, for solids with memory; may be shorter.
    pub relaxations: Vec<Option<Relaxation>>,
    /// Fixed components.
    pub supports: Vec<Support>,
    /// Rigid bodies.
    pub rigid_bodies: Vec<RigidBody>,
    /// Components of displacement that follow others.
    pub constraints: Vec<Constraint>,
    /// Follower pressures.
    pub pressures: Vec<Pressure>,
    /// Loads of fixed direction.
    pub dead_loads: Vec<DeadLoad>,
    /// Cavities with a pressure inside.
    pub cavities: Vec<Cavity>,
    /// Obstacles and walls that touch each other.
    pub contacts: Vec<Contact>,
    names: Vec<String>,
    rules: Vec<Rule>,
}

/// Why a problem can't be posed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// No surface, node set or region of that name.
    #[error("the mesh has no {what} named {name:?}; it has {known}")]
    Unknown {
        /// Kind of the thing.
        what: &'static str,
        /// Name asked for.
        name: String,
        /// Names there are.
        known: String,
    },
    /// Cells and kinematics disagree.
    #[error("the mesh has cells of dimension {found}; {} needs {needed}", .kinematics.words())]
    Dimension {
        /// Dimension of the mesh.
        found: usize,
        /// Kinematics asked for.
        kinematics: Kinematics,
        /// Dimension it needs.
        needed: usize,
    },
    /// A region of cells has no solid.
    #[error("region {0:?} has no material")]
    NoMaterial(String),
    /// A solid that is not stable at moderate strain.
    #[error("region {region:?}: {reason}")]
    Unstable {
        /// Name of the region.
        region: String,
        /// Error in its constants.
        reason: MaterialError,
    },
    /// More solids, or relaxations of them, than regions.
    #[error(
        "{found} materials or relaxations for the regions {regions}: give one for each region, in their order"
    )]
    SurplusMaterials {
        /// Number given.
        found: usize,
        /// The regions.
        regions: String,
    },
    /// Nothing keeps the body from moving as a whole.
    #[error("nothing holds {0}: add a support or a contact")]
    NotFixed(FreePart),
    /// A component of displacement that there is not.
    #[error("there is no component {component} in {}: components are 0 to {last}", .kinematics.words())]
    Component {
        /// Component asked for.
        component: usize,
        /// Kinematics of the body.
        kinematics: Kinematics,
        /// The last component.
        last: usize,
    },
    /// Two supports ask a component of a node for different motions.
    #[error("supports contradict each other in component {component} of node {node} at {}: it is {first} and {second}; take the node out of one of them", at(.place))]
    Contradiction {
        /// The node.
        node: u32,
        /// Component of its displacement.
        component: usize,
        /// Undeformed place.
        place: [f64; 3],
        /// Motion of the first support.
        first: String,
        /// Motion of the second.
        second: String,
    },
    /// A constraint that says something else than a support or another constraint.
    #[error("constraint {constraint} contradicts {by}: component {component} of node {node} at {} follows something else there; let it follow once only, or let another component follow", at(.place))]
    GivenTwice {
        /// Number of the constraint.
        constraint: usize,
        /// The node.
        node: u32,
        /// Component of its displacement.
        component: usize,
        /// Undeformed place.
        place: [f64; 3],
        /// What gives it already.
        by: String,
    },
    /// Constraints that go round.
    #[error("constraint {constraint} goes round: component {component} of node {node} at {} follows itself; leave out one of the constraints", at(.place))]
    FollowsItself {
        /// Number of a constraint of the round.
        constraint: usize,
        /// The node.
        node: u32,
        /// Component of its displacement.
        component: usize,
        /// Undeformed place.
        place: [f64; 3],
    },
    /// A factor of a constraint that is no finite number.
    #[error("a factor of constraint {constraint} is {value}; give a finite number")]
    Factor {
        /// Number of the constraint.
        constraint: usize,
        /// The factor.
        value: f64,
    },
    /// Surfaces of a periodic pair whose meshes do not match.
    #[error("the node of surface {second:?} at {} has none of {first:?} opposite: both need the same mesh, one shifted from the other (Periodic Curve or Periodic Surface in Gmsh)", at(.place))]
    NotOpposite {
        /// Surface without the node.
        first: String,
        /// Surface of the node.
        second: String,
        /// Undeformed place of the node.
        place: [f64; 3],
    },
    /// A node of a rigid body that something else moves.
    #[error("node {node} at {} belongs to rigid body {body} and to {other}: end one before the other", at(.place))]
    RigidNode {
        /// Number of the rigid body.
        body: usize,
        /// The node.
        node: u32,
        /// Undeformed place.
        place: [f64; 3],
        /// What moves it as well.
        other: String,
    },
    /// A rigid body without nodes.
    #[error("rigid body {body} has no nodes: name a surface or a region of the mesh")]
    EmptyRigidBody {
        /// Number of the rigid body.
        body: usize,
    },
    /// A load on no facet.
    #[error("the surface of the {what} of parameter {parameter:?} has no facets")]
    EmptySurface {
        /// The load.
        what: &'static str,
        /// Name of its parameter.
        parameter: String,
    },
    /// A contact of a surface without facets, or with constants without sense.
    #[error("contact {contact}: {what} is {value:.6e}; give {allowed}")]
    Contact {
        /// Number of the contact.
        contact: usize,
        /// The quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed, with its unit.
        allowed: &'static str,
    },
    /// A point of a surface that is tied to nothing.
    #[error("a tied surface has nothing to be tied to within {} of {}: name the surface that covers it, or leave out what is not covered", short(*.reach), at(.place))]
    NotTied {
        /// Undeformed place of the point.
        place: [f64; 3],
        /// Distance within which it was looked for, m.
        reach: f64,
    },
    /// A number beyond the last.
    #[error("there is no {what} number {number}: there are {count}, numbered from 0")]
    NoSuch {
        /// Kind of the thing.
        what: &'static str,
        /// Number asked for.
        number: usize,
        /// How many there are.
        count: usize,
    },
    /// Another number of targets than of parameters.
    #[error("{found} targets for {} parameters ({}): give one for each, in their order", .parameters.len(), .parameters.join(", "))]
    Targets {
        /// Number of targets.
        found: usize,
        /// Names of the parameters.
        parameters: Vec<String>,
    },
    /// A target that is no finite number.
    #[error("the target of parameter {parameter:?} is {value}; give a finite number")]
    NotFinite {
        /// Name of the parameter.
        parameter: String,
        /// Its target.
        value: f64,
    },
}

impl ProblemError {
    /// The same with its lengths in a unit in which they are `by` times as many; true if it has
    /// any.
    pub fn scale(&mut self, by: f64) -> bool {
        match self {
            Self::Contradiction { place, .. }
            | Self::GivenTwice { place, .. }
            | Self::FollowsItself { place, .. }
            | Self::NotOpposite { place, .. }
            | Self::RigidNode { place, .. } => scale(place, by),
            Self::NotTied { place, reach } => {
                *reach *= by;
                scale(place, by)
            }
            Self::NotFixed(part) => part.scale(by),
            _ => false,
        }
    }
}

impl Problem {
    /// A body without supports and loads.
    ///
    /// # Errors
    /// When the mesh does not fit the kinematics.
    pub fn new(mesh: Mesh, kinematics: Kinematics) -> Result<Self, ProblemError> {
        let needed = kinematics.components();
        if mesh.dimension() != needed {
            return Err(ProblemError::Dimension {
                found: mesh.dimension(),
                kinematics,
                needed,
            });
        }
        Ok(Self {
            mesh,
            kinematics,
            materials: Vec::new(),
            relaxations: Vec::new(),
            supports: Vec::new(),
            rigid_bodies: Vec::new(),
            constraints: Vec::new(),
            pressures: Vec::new(),
            dead_loads: Vec::new(),
            cavities: Vec::new(),
            contacts: Vec::new(),
            names: Vec::new(),
            rules: Vec::new(),
        })
    }

    /// Adds a parameter; its value is zero at first.
    pub fn parameter(&mut self, name: &str, rule: Rule) -> Parameter {
        self.names.push(name.to_owned());
        self.rules.push(rule);
        Parameter(self.names.len() - 1)
    }

    /// Changes where the value of a parameter comes from.
    pub fn set_rule(&mut self, parameter: Parameter, rule: Rule) {
        self.rules[parameter.0] = rule;
    }

    /// Rules of all parameters.
    pub fn rules(&self) -> &[Rule] {
        &self.rules
    }

    /// Name of a parameter.
    pub fn name(&self, parameter: Parameter) -> &str {
        &self.names[parameter.0]
    }

    /// Holds or drives a component on a named surface or node set.
    ///
    /// # Errors
    /// When the mesh has no such name, or the body no such component.
    pub fn support(
        &mut self,
        name: &str,
        component: usize,
        motion: Motion,
    ) -> Result<(), ProblemError> {
        self.check_component(component)?;
        let nodes = self
            .mesh
            .nodes_of(name)
            .ok_or_else(|| self.unknown_surface(name))?;
        self.supports.push(Support {
            nodes,
            component,
            motion,
        });
        Ok(())
    }

    /// Holds all components on a named surface or node set.
    ///
    /// # Errors
    /// When the mesh has no such name.
    pub fn clamp(&mut self, name: &str) -> Result<(), ProblemError> {
        (0..self.kinematics.components())
            .try_for_each(|component| self.support(name, component, Motion::Fixed))
    }

    /// Facets of a named surface.
    ///
    /// # Errors
    /// When the mesh has no such name.
    pub fn surface(&self, name: &str) -> Result<Vec<Facet>, ProblemError> {
        self.mesh
            .surfaces
            .get(name)
            .cloned()
            .ok_or_else(|| self.unknown_surface(name))
    }

    fn unknown_surface(&self, name: &str) -> ProblemError {
        let known: Vec<&str> = self
            .mesh
            .surfaces
            .keys()
            .chain(self.mesh.node_sets.keys())
            .map(String::as_str)
            .collect();
        ProblemError::Unknown {
            what: "surface",
            name: name.to_owned(),
            known: known.join(", "),
        }
    }
}
