//! What cannot be drawn.

/// Why there are no files.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refused {
    /// The element says nothing of what is made.
    #[error(
        "nothing can be made from an array with the element `{element}`: it does not say of which parts the array consists\n\
         help: give a sensor of in_plane_capacitor, three_axis_capacitor, piezoelectric or microchannel"
    )]
    NoDrawing {
        /// Key of the element.
        element: &'static str,
    },
    /// Rounding to the grid moves an edge too far.
    #[error(
        "--grid {grid:e} m moves an edge of the mask {mask} by {moved:.1e} m; at most {allowed:.1e} m is allowed, 0.1 % of its \
         smallest distance between edges\n\
         help: give a finer grid"
    )]
    Grid {
        /// The grid, m.
        grid: f64,
        /// The mask.
        mask: &'static str,
        /// Farthest way of an edge, m.
        moved: f64,
        /// Farthest way that is allowed, m.
        allowed: f64,
    },
    /// The array is wider than the numbers of GDSII reach.
    #[error(
        "an array that reaches to {reach:e} m does not fit a grid of {grid:e} m: GDSII counts up to 2^31 of them\n\
         help: give a coarser grid"
    )]
    Reach {
        /// Farthest coordinate, m.
        reach: f64,
        /// The grid, m.
        grid: f64,
    },
}
