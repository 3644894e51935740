//! Errors in files of Gmsh.

use thiserror::Error;

use crate::mesh::MeshError;

/// A file is not a mesh that can be used. Lines count from 1.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum GmshError {
    /// The file does not begin as a mesh of Gmsh.
    #[error("line {line}: expected $MeshFormat; give a file that Gmsh saved as MSH 2.2 or 4.1")]
    Format {
        /// Line of the file.
        line: usize,
    },
    /// The version of the format is not read.
    #[error(
        "line {line}: version {version} of the format; save as MSH 2.2 or 4.1 (Mesh.MshFileVersion)"
    )]
    Version {
        /// Line of the file.
        line: usize,
        /// Version of the file.
        version: String,
    },
    /// The file is binary.
    #[error("line {line}: the file is binary; save it as text (Mesh.Binary = 0)")]
    Binary {
        /// Line of the file.
        line: usize,
    },
    /// A word is not the number that belongs there.
    #[error("line {line}: \"{word}\" is not {expected}")]
    NotANumber {
        /// Line of the file.
        line: usize,
        /// The word.
        word: String,
        /// Text that belongs there.
        expected: &'static str,
    },
    /// A line or a section has too few or too many entries.
    #[error("line {line}: {found} {what}, expected {expected}")]
    Count {
        /// Line of the file.
        line: usize,
        /// Objects that were counted.
        what: &'static str,
        /// Entries there.
        found: usize,
        /// Entries announced or needed.
        expected: usize,
    },
    /// The file ends inside a section.
    #[error("the file ends inside section {section}, after line {line}")]
    EndOfFile {
        /// Last line of the file.
        line: usize,
        /// Name of the section.
        section: String,
    },
    /// A type of element that is not read.
    #[error(
        "line {line}: elements of type {code} are not read; use triangles, quadrilaterals, tetrahedra or hexahedra of first or second order"
    )]
    UnknownType {
        /// Line of the file.
        line: usize,
        /// Gmsh's number of the type.
        code: i64,
    },
    /// An element has a node that is not in the file.
    #[error("line {line}: node {node} is not in the file")]
    MissingNode {
        /// Line of the element.
        line: usize,
        /// Tag of the node.
        node: i64,
    },
    /// Two nodes have one tag.
    #[error("line {line}: a second node {node}")]
    RepeatedNode {
        /// Line of the later one.
        line: usize,
        /// Tag of the node.
        node: i64,
    },
    /// An element belongs to a group without a name.
    #[error(
        "line {line}: physical group {tag} of dimension {dimension} has no name; name it in Gmsh"
    )]
    UnnamedGroup {
        /// Line of the element.
        line: usize,
        /// Dimension of the group.
        dimension: usize,
        /// Tag of the group.
        tag: i64,
    },
    /// A cell belongs to no group, so to no region.
    #[error(
        "line {line}: the cell belongs to no physical group; put every surface (in space: volume) in a named one"
    )]
    NoRegion {
        /// Line of the element.
        line: usize,
    },
    /// A cell belongs to several groups.
    #[error(
        "line {line}: the cell belongs to regions \"{first}\" and \"{second}\"; a cell has one"
    )]
    SeveralRegions {
        /// Line of the element.
        line: usize,
        /// One region.
        first: String,
        /// Another one.
        second: String,
    },
    /// Dimensions are mixed: a named surface element is no side of a cell.
    #[error(
        "line {line}: an element of surface \"{name}\" is not a side of any cell; meshes of mixed dimension are not read"
    )]
    NotASide {
        /// Line of the element.
        line: usize,
        /// Name of the surface.
        name: String,
    },
    /// A named point or curve is not on the cells.
    #[error("line {line}: node {node} of set \"{name}\" belongs to no cell")]
    OffTheCells {
        /// Line of the element.
        line: usize,
        /// Tag of the node.
        node: i64,
        /// Name of the set.
        name: String,
    },
    /// One name means a surface and a set of nodes.
    #[error("\"{name}\" names groups of different dimensions; give each its own name")]
    MixedName {
        /// The name.
        name: String,
    },
    /// A plane mesh leaves its plane.
    #[error("line {line}: node {node} of a plane mesh lies at z = {z}; put the mesh in z = 0")]
    NotPlane {
        /// Line of the element.
        line: usize,
        /// Tag of the node.
        node: i64,
        /// Third coordinate.
        z: f64,
    },
    /// There are no cells.
    #[error("the file has no cells; mesh it in two or three dimensions before saving")]
    NoCells,
    /// A cell does not fit its neighbours.
    #[error("line {line}: {source}")]
    Cell {
        /// Line of the element.
        line: usize,
        /// Error of the mesh; nodes are counted from 0 in order of the cells.
        source: MeshError,
    },
}
