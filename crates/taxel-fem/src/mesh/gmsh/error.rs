//! Errors in files of Gmsh.

use thiserror::Error;

use crate::mesh::MeshError;

/// Where in a file: lines of text from 1, bytes of a binary part from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// A line.
    Line(usize),
    /// A byte.
    Byte(usize),
}

impl std::fmt::Display for Position {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// Name of a type of element by its number in Gmsh's manual.
fn named(code: i64) -> String {
    let name = match code {
        7 => "pyramids of first order",
        14 | 19 => "pyramids of second order",
        20..=25 => "triangles of an order above the second",
        36..=40 => "quadrilaterals of an order above the second",
        26..=28 => "lines of an order above the second",
        29..=31 => "tetrahedra of an order above the second",
        90 | 91 => "wedges of an order above the second",
        92 | 93 => "hexahedra of an order above the second",
        _ => return format!("elements of Gmsh's type {code}"),
    };
    name.to_owned()
}

/// A file is not a mesh that can be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum GmshError {
    /// The file does not begin as a mesh of Gmsh.
    #[error("{line}: expected $MeshFormat; give a file that Gmsh saved as MSH 2.2 or 4.1")]
    Format {
        /// Line of the file.
        line: Position,
    },
    /// The version of the format is not read.
    #[error(
        "{line}: version {version} of the format; save as MSH 2.2 or 4.1 (Mesh.MshFileVersion)"
    )]
    Version {
        /// Line of the file.
        line: Position,
        /// Version of the file.
        version: String,
    },
    /// Numbers of a binary file are of another size.
    #[error(
        "{line}: the numbers of a binary file must have 8 bytes and follow the number one of 4 bytes; save it anew with Gmsh"
    )]
    Binary {
        /// Line of the file.
        line: Position,
    },
    /// The text of a file is no text.
    #[error("{line}: bytes that are no text, in a file that is said to be text")]
    NotText {
        /// Where.
        line: Position,
    },
    /// A binary file ends inside a section.
    #[error("{line}: the file ends inside section {section}")]
    Short {
        /// Where the bytes that are missing should begin.
        line: Position,
        /// Name of the section.
        section: String,
    },
    /// Wedges and hexahedra meet in a quadrilateral.
    #[error(
        "{line}: a hexahedron shares a side with a wedge, which is cut into tetrahedra; recombine all layers, or none"
    )]
    WedgeBesideHexahedron {
        /// Where the hexahedron stands.
        line: Position,
    },
    /// A word is not the number that belongs there.
    #[error("{line}: \"{word}\" is not {expected}")]
    NotANumber {
        /// Line of the file.
        line: Position,
        /// The word.
        word: String,
        /// Text that belongs there.
        expected: &'static str,
    },
    /// A line or a section has too few or too many entries.
    #[error("{line}: {found} {what}, expected {expected}")]
    Count {
        /// Line of the file.
        line: Position,
        /// Objects that were counted.
        what: &'static str,
        /// Entries there.
        found: usize,
        /// Entries announced or needed.
        expected: usize,
    },
    /// The file ends inside a section.
    #[error("the file ends inside section {section}, after {line}")]
    EndOfFile {
        /// Last line of the file.
        line: Position,
        /// Name of the section.
        section: String,
    },
    /// A type of element that is not read.
    #[error(
        "{line}: the solver has no element for the {count} {} of this file, the first of them here; mesh with triangles, quadrilaterals, tetrahedra, hexahedra or wedges of first or second order", named(*.code)
    )]
    UnknownType {
        /// Line of the file.
        line: Position,
        /// Gmsh's number of the type.
        code: i64,
        /// Number of such elements in the file.
        count: usize,
    },
    /// An element has a node that is not in the file.
    #[error("{line}: node {node} is not in the file")]
    MissingNode {
        /// Line of the element.
        line: Position,
        /// Tag of the node.
        node: i64,
    },
    /// Two nodes have one tag.
    #[error("{line}: a second node {node}")]
    RepeatedNode {
        /// Line of the later one.
        line: Position,
        /// Tag of the node.
        node: i64,
    },
    /// A cell belongs to no group, so to no region.
    #[error(
        "{line}: the cell belongs to no physical group; put every surface (in space: volume) in a named one"
    )]
    NoRegion {
        /// Line of the element.
        line: Position,
    },
    /// A cell belongs to several groups.
    #[error("{line}: the cell belongs to regions \"{first}\" and \"{second}\"; a cell has one")]
    SeveralRegions {
        /// Line of the element.
        line: Position,
        /// One region.
        first: String,
        /// Another one.
        second: String,
    },
    /// Dimensions are mixed: a named surface element is no side of a cell.
    #[error(
        "{line}: an element of surface \"{name}\" is not a side of any cell; meshes of mixed dimension are not read"
    )]
    NotASide {
        /// Line of the element.
        line: Position,
        /// Name of the surface.
        name: String,
    },
    /// A named point or curve is not on the cells.
    #[error("{line}: node {node} of set \"{name}\" belongs to no cell")]
    OffTheCells {
        /// Line of the element.
        line: Position,
        /// Tag of the node.
        node: i64,
        /// Name of the set.
        name: String,
    },
    /// A plane mesh leaves its plane, which is one of two axes.
    #[error(
        "{line}: node {node} is {off:.3e} out of the plane of the mesh, which has no element of volume: a shell is not solved; mesh its volume (in Gmsh: Surface Loop, Volume and Mesh 3, or -3), or put all nodes of a plane mesh at one x, y or z"
    )]
    NotPlane {
        /// Line of the element.
        line: Position,
        /// Tag of the node.
        node: i64,
        /// Distance from the plane, in the unit of the mesh.
        off: f64,
    },
    /// There are no cells.
    #[error("the file has no cells; mesh it in two or three dimensions before saving")]
    NoCells,
    /// A cell does not fit its neighbours.
    #[error("{line}: {source}")]
    Cell {
        /// Line of the element.
        line: Position,
        /// Error of the mesh; nodes are counted from 0 in order of the cells.
        source: MeshError,
    },
}
