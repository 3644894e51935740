//! Errors of field problems.

use thiserror::Error;

use crate::mesh::error::{at as place, scale};

/// Why a field was not solved.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FieldError {
    /// A name that the mesh does not know.
    #[error("the mesh has no {kind} \"{name}\"; it has {known}")]
    UnknownName {
        /// Kind of the object looked for.
        kind: &'static str,
        /// Name that was given.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// A name without a node.
    #[error("\"{name}\" has no node in the field; name a part of its boundary")]
    Empty {
        /// Name that was given.
        name: String,
    },
    /// A region in the field without a coefficient.
    #[error("region \"{region}\" has no coefficient; give one, or name the region as a conductor")]
    NoCoefficient {
        /// Name of the region.
        region: String,
    },
    /// A coefficient that is not positive definite.
    #[error("the coefficient of region \"{region}\" is {value}; it must be positive")]
    NotPositive {
        /// Name of the region.
        region: String,
        /// The number, or the smallest leading minor of the tensor.
        value: f64,
    },
    /// A length or a count out of its range.
    #[error("{quantity} is {value}; allowed is {allowed}")]
    OutOfRange {
        /// Quantity that was given.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Range in words.
        allowed: &'static str,
    },
    /// A displacement for another number of nodes.
    #[error("the displacement has {given} nodes, the mesh {expected}")]
    WrongLength {
        /// Nodes of the displacement.
        given: usize,
        /// Nodes of the mesh.
        expected: usize,
    },
    /// A mesh of another number of dimensions.
    #[error("the mesh has {given} dimensions; a {geometry} field needs {expected}")]
    WrongDimension {
        /// Geometry that was asked for.
        geometry: &'static str,
        /// Dimensions of the mesh.
        given: usize,
        /// Dimensions needed.
        expected: usize,
    },
    /// A cell turned inside out.
    #[error(
        "cell {cell} of region \"{region}\" is turned inside out near {}: \
         volume ratio {ratio:.3e}, must be positive; refine there or move the mesh less",
        place(.at)
    )]
    Inverted {
        /// Number of the cell.
        cell: usize,
        /// Name of its region.
        region: String,
        /// Place, in the units of the mesh.
        at: [f64; 3],
        /// Determinant of the mapping there.
        ratio: f64,
    },
    /// The outline of a deformed solid crosses itself.
    #[error("the outline of the solid crosses itself near {}", place(&.at[..2]))]
    Folded {
        /// A place near the crossing, in the units of the mesh.
        at: [f64; 3],
    },
    /// A cell on the wrong side of the axis of revolution.
    #[error("cell {cell} reaches radius {radius:.3e}; radii (first coordinate) must be positive")]
    BehindAxis {
        /// Number of the cell.
        cell: usize,
        /// Radius, in the units of the mesh.
        radius: f64,
    },
    /// Two conductors that share a node.
    #[error(
        "\"{first}\" and \"{second}\" share node {node} at {}; \
         leave a gap, or make them one conductor",
        place(.at)
    )]
    Touching {
        /// One conductor.
        first: String,
        /// The other one.
        second: String,
        /// Number of the node.
        node: u32,
        /// Place, in the units of the mesh.
        at: [f64; 3],
    },
    /// A part of the field that no conductor reaches.
    #[error(
        "the potentials of {unknowns} nodes are not determined; each connected part of the field \
         needs a conductor or a surface at zero"
    )]
    Undetermined {
        /// Number of unknown potentials.
        unknowns: usize,
    },
    /// The linear system has no answer.
    #[error("the potentials: {0}")]
    Linear(#[from] crate::sparse::LinearError),
    /// The image of the unbounded space was moved.
    #[error("node {node} of the unbounded part moves by {distance:.3e}; it must stay at rest")]
    OutsideMoves {
        /// Number of the node.
        node: u32,
        /// Length of its displacement.
        distance: f64,
    },
    /// A boundary that is not the circle or sphere it should be.
    #[error(
        "node {node} of \"{surface}\" is {distance:.6e} from the centre, not {radius:.6e}; \
         the surface must be a circle or sphere"
    )]
    NotRound {
        /// Name of the surface.
        surface: String,
        /// Number of the node.
        node: u32,
        /// Its distance from the centre.
        distance: f64,
        /// Radius that was given.
        radius: f64,
    },
    /// A side of a cell that cannot be extruded.
    #[error(
        "side {side} of cell {cell} on \"{surface}\" is a triangle; use quadrilateral sides there"
    )]
    TriangularSide {
        /// Name of the surface.
        surface: String,
        /// Number of the cell.
        cell: u32,
        /// Side of the cell.
        side: u8,
    },
    /// A section whose edges do not make one line.
    #[error(
        "the wall \"{surface}\" has {edges} edges at {position:.6e} along the axis that do not \
         join to one line; give a position where the mesh has a plane of edges all around"
    )]
    BrokenSection {
        /// Name of the wall.
        surface: String,
        /// Position along the axis in the reference shape.
        position: f64,
        /// Number of edges found there.
        edges: usize,
    },
}

impl FieldError {
    /// The same with its places in a unit in which lengths are `by` times as many; true if it has
    /// any.
    pub fn scale(&mut self, by: f64) -> bool {
        match self {
            Self::Inverted { at, .. } | Self::Folded { at } | Self::Touching { at, .. } => {
                scale(at, by)
            }
            _ => false,
        }
    }
}
