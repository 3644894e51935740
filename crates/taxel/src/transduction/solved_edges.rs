//! What is solved of the edges of the electrodes of a three-axis unit (P2) for a drawing that no
//! table has.

use serde::{Deserialize, Serialize};

use super::tile_edges::{DrawnEdges, EdgeDrawing, EdgeLaw, TileEdges, corners_of};

/// Laws of the edges of a drawing that no table has: solved once, and kept.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SolvedEdges {
    /// Edges towards the middle of the unit that x and that y cross, all other electrodes grounded.
    pub inner: [EdgeLaw; 2],
    /// Edges towards the next unit.
    pub outer: [EdgeLaw; 2],
    /// Share of the excesses of the inner edges over a grounded plane, at the air gap of the drawing.
    pub inner_over_plane: [f64; 2],
    /// The same of the outer edges.
    pub outer_over_plane: [f64; 2],
    /// A tile alone: the edges that x and that y cross.
    pub alone: [EdgeLaw; 2],
    /// Largest relative error of an excess: of the law, of the mesh and of where the field ends.
    pub error: f64,
}

impl SolvedEdges {
    /// True of numbers that edges may have.
    pub(crate) fn is_sound(&self) -> bool {
        let shares = self.inner_over_plane.iter().chain(&self.outer_over_plane);
        let laws = self.inner.iter().chain(&self.outer).chain(&self.alone);
        laws.copied().all(EdgeLaw::is_sound)
            && { shares }.all(|share| *share > 0.0 && *share <= 1.0)
            && self.error > 0.0
            && self.error.is_finite()
    }

    /// The edges of the tiles of the drawing that was solved.
    pub fn edges(&self, drawing: &EdgeDrawing) -> DrawnEdges {
        let share = |[x, y]: [EdgeLaw; 2], [of_x, of_y]: [f64; 2]| [x.share(of_x), y.share(of_y)];
        DrawnEdges {
            grounded: TileEdges {
                inner: self.inner,
                outer: self.outer,
                corners: corners_of(drawing),
            },
            surroundings: [
                TileEdges {
                    inner: share(self.inner, self.inner_over_plane),
                    outer: share(self.outer, self.outer_over_plane),
                    corners: 0.0,
                },
                TileEdges {
                    inner: self.alone,
                    outer: self.alone,
                    corners: 0.0,
                },
            ],
            error: self.error,
        }
    }
}
