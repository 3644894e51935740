//! Pairs of points of two horizontal faces in space that lie above each other.

use std::collections::BTreeMap;

use super::{Pairing, WallPoint};
use crate::mesh::{CellShape, Facet, Mesh, QuadraturePoint};

/// Places of one column are equal within this share of the size of the mesh.
const SAME: f64 = 1e-9;

/// Pairs at these points of each facet of the floor, with the points at equal undeformed x and y
/// above it (or below): overlap is measured along z. `partners` are the nodes of the other face;
/// facets of which a node has no partner are left out. Facets are quadrilaterals.
pub fn facing_pairs(
    mesh: &Mesh,
    floor: &[Facet],
    partners: impl IntoIterator<Item = u32>,
    at: &[QuadraturePoint],
) -> Vec<WallPoint> {
    let size = mesh
        .points
        .iter()
        .flatten()
        .fold(0.0_f64, |m, x| m.max(x.abs()));
    let column = |node: u32| {
        let [x, y, _] = mesh.points[node as usize];
        [x, y].map(|x| (x / size / SAME).round() as i64)
    };
    let partners: BTreeMap<[i64; 2], u32> = partners
        .into_iter()
        .map(|node| (column(node), node))
        .collect();
    let tables: Vec<_> = at
        .iter()
        .map(|point| (point.weight, CellShape::Quad9.shapes(point.at)))
        .collect();
    let mut points = Vec::new();
    for facet in floor {
        let below: Vec<u32> = mesh.facet_nodes(*facet).collect();
        let above = below
            .iter()
            .map(|node| partners.get(&column(*node)).copied());
        let Some(above) = above.collect::<Option<Vec<u32>>>() else {
            continue;
        };
        for (weight, shapes) in &tables {
            let area = area_at(mesh, &below, &shapes.gradients) * weight;
            let side = |nodes: &[u32]| -> Vec<(u32, f64, f64)> {
                let values = nodes.iter().zip(&shapes.values);
                values.map(|(&node, &value)| (node, value, 0.0)).collect()
            };
            let pairing = Pairing::Opposite([0.0, 0.0, 1.0]);
            points.push(WallPoint::new(&side(&below), &side(&above), area, pairing));
        }
    }
    points
}

/// Points of a facet, on a lattice with its corners, at which a gap is looked at: their weight is
/// zero.
pub fn lattice_points() -> Vec<QuadraturePoint> {
    let step = |k: i32| 0.5 * f64::from(k) - 1.0;
    let point = |k: i32| QuadraturePoint {
        at: [step(k / 5), step(k % 5), 0.0],
        weight: 0.0,
    };
    (0..25).map(point).collect()
}

/// Area in the plane per unit of the reference cell.
fn area_at(mesh: &Mesh, nodes: &[u32], gradients: &[[f64; 3]]) -> f64 {
    let mut tangents = [[0.0; 2]; 2];
    for (&node, gradient) in nodes.iter().zip(gradients) {
        let x = mesh.points[node as usize];
        for (k, tangent) in tangents.iter_mut().enumerate() {
            tangent[0] += gradient[k] * x[0];
            tangent[1] += gradient[k] * x[1];
        }
    }
    (tangents[0][0] * tangents[1][1] - tangents[0][1] * tangents[1][0]).abs()
}
