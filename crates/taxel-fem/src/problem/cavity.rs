//! Cavities: their volume, and the pressure that follows from it.

use super::Parameter;
use super::load::FacetTable;
use crate::mesh::{Facet, Mesh};
use crate::problem::Kinematics;

/// A cavity whose wall carries one pressure.
///
/// Its volume is `- int (x_k - o) n_k da` over the wall, `o` the origin: the part of its
/// outline that the wall does not close (cuts by planes of symmetry, open ends) must lie
/// across another axis than `k`, or at `x_k = o`.
#[derive(Clone, Debug, PartialEq)]
pub struct Cavity {
    /// The wall.
    pub wall: Vec<Facet>,
    /// Axis `k` along which the volume is computed.
    pub axis: usize,
    /// Place `o` on that axis from which it is measured, m. It matters for an outline that
    /// is open: zero at a cut by a plane of symmetry, the middle of a void with open ends.
    pub origin: f64,
    /// Pressure inside, Pa.
    pub pressure: Parameter,
}

/// Pressure inside as a function of the volume, gauge.
#[derive(Clone, Debug, PartialEq)]
pub enum CavityLaw {
    /// `p = s (V0/V - 1)`: a trapped gas at the scale `s` in Pa.
    Gas {
        /// Pressure scale, Pa.
        scale: f64,
        /// Volume at rest; same unit as the volume of the cavity.
        rest: f64,
    },
    /// Straight lines through points of volume ratio (ascending) and pressure in Pa,
    /// continued by the outer lines.
    Tabulated {
        /// Volume ratio and pressure.
        points: Vec<(f64, f64)>,
        /// Volume at rest.
        rest: f64,
    },
}

impl CavityLaw {
    /// Pressure in Pa and its derivative by the volume.
    pub fn pressure(&self, volume: f64) -> (f64, f64) {
        match self {
            Self::Gas { scale, rest } => (
                scale * (rest / volume - 1.0),
                -scale * rest / (volume * volume),
            ),
            Self::Tabulated { points, rest } => {
                let ratio = volume / rest;
                match points.as_slice() {
                    [] => (0.0, 0.0),
                    [only] => (only.1, 0.0),
                    points => {
                        let upper = points
                            .partition_point(|point| point.0 < ratio)
                            .clamp(1, points.len() - 1);
                        let ((x0, y0), (x1, y1)) = (points[upper - 1], points[upper]);
                        let slope = (y1 - y0) / (x1 - x0);
                        (y0 + slope * (ratio - x0), slope / rest)
                    }
                }
            }
        }
    }
}

impl Cavity {
    /// Volume inside the wall for these places of the nodes (area in plane strain).
    pub fn volume(&self, mesh: &Mesh, kinematics: Kinematics, places: &[[f64; 3]]) -> f64 {
        let mut volume = 0.0;
        let mut nodes = Vec::new();
        let mut table: Option<(crate::mesh::FacetShape, FacetTable)> = None;
        for &facet in &self.wall {
            let shape = mesh.shape(facet.cell as usize).facet_shape();
            if table.as_ref().is_none_or(|(known, _)| *known != shape) {
                table = Some((shape, FacetTable::new(shape)));
            }
            nodes.clear();
            nodes.extend(mesh.facet_nodes(facet).map(|n| places[n as usize]));
            if let Some((_, table)) = &table {
                for point in table.points(&nodes, kinematics) {
                    // The radius sweeps its volume twice.
                    let twice = kinematics == Kinematics::Axisymmetric && self.axis == 0;
                    let share = if twice { 0.5 } else { 1.0 };
                    let from = point.place[self.axis] - self.origin;
                    volume -= share * from * point.normal[self.axis];
                }
            }
        }
        volume
    }
}
