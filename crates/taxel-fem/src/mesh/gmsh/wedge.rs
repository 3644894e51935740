//! Wedges cut into tetrahedra: every side is cut from its corner of the smallest number, so that
//! neighbours agree (Dompierre, Labbe, Vallet and Camarero 1999, "How to subdivide pyramids,
//! prisms and hexahedra into tetrahedra").

use std::collections::{HashMap, HashSet};

use crate::mesh::promote::key;

/// Corners of a wedge in an order that begins with each of them and keeps its orientation.
const BEGINNING: [[usize; 6]; 6] = [
    [0, 1, 2, 3, 4, 5],
    [1, 2, 0, 4, 5, 3],
    [2, 0, 1, 5, 3, 4],
    [3, 5, 4, 0, 2, 1],
    [4, 3, 5, 1, 0, 2],
    [5, 4, 3, 2, 1, 0],
];
/// The two ways to cut it from its first corner.
const CUTS: [[[usize; 4]; 3]; 2] = [
    [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]],
    [[0, 1, 2, 4], [0, 4, 2, 5], [0, 4, 5, 3]],
];
/// Edges in the order of Gmsh (its manual, "Node ordering"), behind the corners.
const EDGES: [[usize; 2]; 9] = [
    [0, 1],
    [0, 2],
    [0, 3],
    [1, 2],
    [1, 4],
    [2, 5],
    [3, 4],
    [3, 5],
    [4, 5],
];
/// Sides of four corners, around, in the order of Gmsh.
const SIDES: [[usize; 4]; 3] = [[0, 1, 4, 3], [0, 2, 5, 3], [1, 2, 5, 4]];
/// Edges of a tetrahedron in VTK's order.
const TETRAHEDRON: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
/// Sides of a hexahedron by its corners in VTK's order.
const HEXAHEDRON: [[usize; 4]; 6] = [
    [0, 4, 7, 3],
    [1, 2, 6, 5],
    [0, 1, 5, 4],
    [3, 7, 6, 2],
    [0, 3, 2, 1],
    [4, 5, 6, 7],
];

/// Sides of all wedges so far.
#[derive(Default)]
pub(super) struct Wedges {
    sides: HashSet<[u32; 8]>,
    /// Middles of the sides of wedges of second order.
    middles: HashMap<[u32; 8], u32>,
}

impl Wedges {
    /// Nodes of the three tetrahedra of a wedge of 6, 15 or 18 nodes in Gmsh's order: 4 each of
    /// one of 6, else 10. The middles of sides that a wedge of 15 nodes lacks are added.
    pub(super) fn cut(&mut self, nodes: &[u32], points: &mut Vec<[f64; 3]>) -> [Vec<u32>; 3] {
        let first = (0..6).min_by_key(|&corner| nodes[corner]).unwrap_or(0);
        let order = BEGINNING[first];
        let at = |k: usize| nodes[order[k]];
        let cut = CUTS[usize::from(at(1).min(at(5)) > at(2).min(at(4)))];
        for side in SIDES {
            let side = key(side.iter().map(|&corner| nodes[corner]));
            self.sides.insert(side);
        }
        let middles = self.middles_of(nodes, points);
        cut.map(|corners| {
            let corners = corners.map(at);
            let mut all = corners.to_vec();
            if nodes.len() > 6 {
                for edge in TETRAHEDRON {
                    let ends = key(edge.iter().map(|&end| corners[end]));
                    all.extend(middles.get(&ends));
                }
            }
            all
        })
    }

    /// Middles of the edges and of both diagonals of the sides of a wedge of second order.
    fn middles_of(&mut self, nodes: &[u32], points: &mut Vec<[f64; 3]>) -> HashMap<[u32; 8], u32> {
        let mut middles = HashMap::new();
        if nodes.len() == 6 {
            return middles;
        }
        let ends = |pair: [usize; 2]| key(pair.iter().map(|&corner| nodes[corner]));
        for (number, edge) in EDGES.into_iter().enumerate() {
            middles.insert(ends(edge), nodes[6 + number]);
        }
        for (number, side) in SIDES.into_iter().enumerate() {
            let around = key(side.iter().map(|&corner| nodes[corner]));
            let given = nodes.get(15 + number).copied();
            let middle = *self.middles.entry(around).or_insert_with(|| {
                given.unwrap_or_else(|| {
                    // The value there of the functions of corners and edges.
                    let mut point = [0.0; 3];
                    let mut add = |node: u32, weight: f64| {
                        for (x, given) in point.iter_mut().zip(points[node as usize]) {
                            *x += weight * given;
                        }
                    };
                    for k in 0..4 {
                        add(nodes[side[k]], -0.25);
                        let edge = ends([side[k], side[(k + 1) % 4]]);
                        add(middles[&edge], 0.5);
                    }
                    points.push(point);
                    points.len() as u32 - 1
                })
            });
            middles.insert(ends([side[0], side[2]]), middle);
            middles.insert(ends([side[1], side[3]]), middle);
        }
        middles
    }

    /// True if a hexahedron has a side of a wedge.
    pub(super) fn touch(&self, hexahedron: &[u32]) -> bool {
        HEXAHEDRON.iter().any(|side| {
            let side = key(side.iter().map(|&corner| hexahedron[corner]));
            self.sides.contains(&side)
        })
    }
}
