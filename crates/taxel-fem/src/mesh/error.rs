//! Errors in descriptions of meshes.

use thiserror::Error;

/// A mesh cannot be made as described.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// An axis needs one grading for each interval between its breakpoints.
    #[error(
        "an axis with {breakpoints} breakpoints needs one grading per interval, but has {gradings}"
    )]
    Gradings {
        /// Number of breakpoints given; at least two.
        breakpoints: usize,
        /// Number of gradings given.
        gradings: usize,
    },
    /// Breakpoints of an axis must rise.
    #[error(
        "interval {interval} of an axis runs from {start} to {end}; give rising, finite breakpoints"
    )]
    Interval {
        /// Number of the interval from the start of the axis, from 0.
        interval: usize,
        /// Where it starts.
        start: f64,
        /// Where it ends.
        end: f64,
    },
    /// A number lies outside its range.
    #[error("{quantity} is {value}, allowed is {}", allowed([*.low, *.high]))]
    OutOfRange {
        /// Quantity that the number is.
        quantity: &'static str,
        /// Value that was given.
        value: f64,
        /// Least value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// The void leaves no solid beside it.
    #[error("a void of width {width} does not fit in a pitch of {pitch}; the pitch must be larger")]
    NoWall {
        /// Width of the void.
        width: f64,
        /// Distance from one void to the next.
        pitch: f64,
    },
    /// The grid would be larger than the numbers of its nodes can count.
    #[error(
        "the mesh would have {cells} cells, allowed are {limit}; make the smallest cells larger or their growth faster"
    )]
    TooManyCells {
        /// Cells asked for.
        cells: usize,
        /// Cells allowed.
        limit: usize,
    },
    /// A box must begin and end on breakpoints of the axes.
    #[error(
        "box \"{name}\" has a face at {value} on axis {axis}, where there is no breakpoint; the nearest is {nearest}"
    )]
    OffBreakpoint {
        /// Name of the box.
        name: String,
        /// Number of the axis, from 0.
        axis: usize,
        /// Where the face lies.
        value: f64,
        /// Nearest breakpoint.
        nearest: f64,
    },
    /// A box is empty or inside out.
    #[error(
        "box \"{name}\" runs from {start} to {end} on axis {axis}; its end must lie beyond its start"
    )]
    InsideOut {
        /// Name of the box.
        name: String,
        /// Number of the axis, from 0.
        axis: usize,
        /// Where the box starts.
        start: f64,
        /// Where the box ends.
        end: f64,
    },
    /// Two boxes claim the same cell.
    #[error(
        "boxes \"{first}\" and \"{second}\" both claim the cell at {}; move one of them or give both one name", at(.place)
    )]
    Contradiction {
        /// Name of the earlier box.
        first: String,
        /// Name of the later box.
        second: String,
        /// Middle of the cell.
        place: [f64; 3],
    },
    /// A void has the name of an outer side.
    #[error("\"{name}\" names an outer side of the grid; give the void another name")]
    ReservedName {
        /// The name.
        name: String,
    },
    /// Voids leave no solid.
    #[error("the voids leave no solid")]
    NothingLeft,
    /// Voids cut the solid.
    #[error("the voids cut the solid in {pieces} pieces; one of them holds {}", at(.place))]
    Pieces {
        /// Number of pieces.
        pieces: usize,
        /// Middle of the first cell of the second piece.
        place: [f64; 3],
    },
    /// A cell has a number of nodes that its shape does not know.
    #[error("cell {cell} has {found} nodes; its shape takes {allowed:?}")]
    NodeCount {
        /// Number of the cell.
        cell: usize,
        /// Nodes given.
        found: usize,
        /// Nodes allowed.
        allowed: [usize; 3],
    },
    /// A cell names a node that is not there.
    #[error("cell {cell} has node {node}, but there are {count} nodes, counted from 0")]
    NoSuchNode {
        /// Number of the cell.
        cell: usize,
        /// Number of the node.
        node: u32,
        /// Number of nodes.
        count: usize,
    },
    /// A cell names a region that is not there.
    #[error("cell {cell} is of region {region}, but there are {count} regions, counted from 0")]
    NoSuchRegion {
        /// Number of the cell.
        cell: usize,
        /// Number of the region.
        region: u16,
        /// Number of regions.
        count: usize,
    },
    /// Two cells disagree about the middle of a common edge or face.
    #[error(
        "cell {cell} has node {second} in the middle of an edge or face where its neighbour has node {first}; give both one node"
    )]
    TwoMiddles {
        /// Number of the later cell.
        cell: usize,
        /// Node of the earlier cell.
        first: u32,
        /// Node of the later cell.
        second: u32,
    },
    /// Two cells have the same corners.
    #[error("cell {cell} has the corners of cell {other}; leave one of them out")]
    TwinCell {
        /// Number of the later cell.
        cell: usize,
        /// Number of the earlier cell.
        other: usize,
    },
    /// A cell is inside out or flat.
    #[error(
        "cell {cell} of region \"{region}\" is inside out or flat at {} (relative determinant {relative:.2e}, at least 1e-6 is needed), as are {cells} cells in all; move its nodes or turn its order", at(.place)
    )]
    Distorted {
        /// Number of the worst cell.
        cell: usize,
        /// Name of its region.
        region: String,
        /// Its worst place.
        place: [f64; 3],
        /// Determinant of the map over the lengths of its columns.
        relative: f64,
        /// Number of such cells.
        cells: usize,
    },
    /// A node belongs to no cell.
    #[error("node {node} at {} belongs to no cell, as {nodes} nodes in all; leave them out", at(.place))]
    Unreferenced {
        /// Number of the first such node.
        node: u32,
        /// Where it is.
        place: [f64; 3],
        /// Number of such nodes.
        nodes: usize,
    },
    /// Two nodes lie at one place.
    #[error(
        "nodes {first} and {second} both lie at {}, one of {pairs} such pairs; make them one unless the solid is cut there", at(.place)
    )]
    Coincident {
        /// One node.
        first: u32,
        /// The other.
        second: u32,
        /// Where they are.
        place: [f64; 3],
        /// Number of such pairs.
        pairs: usize,
    },
    /// A region has no cells.
    #[error("region \"{name}\" has no cells")]
    EmptyRegion {
        /// Name of the region.
        name: String,
    },
}

/// A number between two limits, both allowed.
pub(super) fn in_range(
    quantity: &'static str,
    value: f64,
    low: f64,
    high: f64,
) -> Result<f64, MeshError> {
    if (low..=high).contains(&value) {
        Ok(value)
    } else {
        Err(MeshError::OutOfRange {
            quantity,
            value,
            low,
            high,
        })
    }
}

/// A place, in the units of the mesh.
pub(crate) fn at(place: &[f64]) -> String {
    let coordinates: Vec<String> = place.iter().map(|x| short(*x)).collect();
    format!("({})", coordinates.join(", "))
}

/// A number in six digits, without the zeros at its end.
pub(crate) fn short(number: f64) -> String {
    let rounded: f64 = format!("{number:.5e}").parse().unwrap_or(number);
    // A zero has no sign.
    let rounded = rounded + 0.0;
    if rounded == 0.0 || (1e-4..1e6).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// Takes lengths of a message to another unit, in which they are `by` times as many.
pub(crate) fn scale(lengths: &mut [f64], by: f64) -> bool {
    for length in lengths {
        *length *= by;
    }
    true
}

impl MeshError {
    /// The same with its places in a unit in which lengths are `by` times as many; true if it has
    /// any.
    pub fn scale(&mut self, by: f64) -> bool {
        match self {
            Self::Distorted { place, .. }
            | Self::Unreferenced { place, .. }
            | Self::Coincident { place, .. } => scale(place, by),
            _ => false,
        }
    }
}

/// A range in words: without the ends of what a number can be.
fn allowed([low, high]: [f64; 2]) -> String {
    match (low == f64::MIN_POSITIVE, high == f64::MAX) {
        (true, true) => "a number above 0".to_owned(),
        (true, false) => format!("a number above 0, up to {high}"),
        (false, true) => format!("a number from {low} on"),
        (false, false) => format!("{low} to {high}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_names_no_end_of_what_a_number_can_be() {
        let said = |low, high| {
            let quantity = "height";
            let value = f64::NAN;
            MeshError::OutOfRange {
                quantity,
                value,
                low,
                high,
            }
            .to_string()
        };
        let positive = said(f64::MIN_POSITIVE, f64::MAX);
        assert_eq!(positive, "height is NaN, allowed is a number above 0");
        assert!(said(f64::MIN_POSITIVE, 2.5).ends_with("a number above 0, up to 2.5"));
        assert!(said(1.0, f64::MAX).ends_with("a number from 1 on"));
        assert!(said(1.0, 2.5).ends_with("1 to 2.5"));
    }
}
