//! Plane mesh of blocks that are tied node to node.

use std::collections::HashMap;

use super::{CellShape, Mesh};

/// Blocks of quadrilaterals whose nodes are one where they lie at one place.
pub(super) struct Patchwork {
    pub(super) mesh: Mesh,
    region: u16,
    /// Nodes by their place in units of `pace`, rounded.
    known: HashMap<[i64; 2], u32>,
    pace: f64,
}

impl Patchwork {
    /// Nodes closer than `pace` in either direction are one; it should lie far between the
    /// smallest cell and the rounding of its place.
    pub(super) fn new(region: &str, pace: f64) -> Self {
        let mut mesh = Mesh::default();
        let region = mesh.region(region);
        Self {
            mesh,
            region,
            known: HashMap::new(),
            pace,
        }
    }

    /// Adds `counts` cells along the two directions of a block. `place` says where a node
    /// lies; its numbers count half cells. Empty blocks are left out.
    pub(super) fn block(&mut self, counts: [usize; 2], place: &dyn Fn(usize, usize) -> [f64; 2]) {
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let at: [[f64; 2]; 9] = std::array::from_fn(|node| {
                    let [x, y, _] = CellShape::Quad9.node_at(node);
                    place(2 * i + (x + 1.0) as usize, 2 * j + (y + 1.0) as usize)
                });
                self.cell(at);
            }
        }
    }

    /// Adds the product of two lines.
    pub(super) fn product(&mut self, x: &[f64], y: &[f64]) {
        let counts = [x, y].map(|line| line.len().saturating_sub(1));
        self.block(counts, &|i, j| [between(x, i), between(y, j)]);
    }

    fn cell(&mut self, mut at: [[f64; 2]; 9]) {
        // Mirrored blocks run the other way round.
        let cross = (at[2][0] - at[0][0]) * (at[3][1] - at[1][1])
            - (at[2][1] - at[0][1]) * (at[3][0] - at[1][0]);
        if cross < 0.0 {
            at = [0, 3, 2, 1, 7, 6, 5, 4, 8].map(|node: usize| at[node]);
        }
        let nodes = at.map(|place| self.node(place));
        self.mesh.add_cell(CellShape::Quad9, self.region, &nodes);
    }

    fn node(&mut self, at: [f64; 2]) -> u32 {
        let key = at.map(|x| (x / self.pace).round() as i64);
        // A place near the edge of its square may have been rounded to the next one.
        for dx in -1..=1 {
            for dy in -1..=1 {
                if let Some(&node) = self.known.get(&[key[0] + dx, key[1] + dy]) {
                    return node;
                }
            }
        }
        let node = self.mesh.points.len() as u32;
        self.mesh.points.push([at[0], at[1], 0.0]);
        self.known.insert(key, node);
        node
    }
}

/// Position on a line at a number of half cells.
pub(super) fn between(line: &[f64], half: usize) -> f64 {
    0.5 * (line[half / 2] + line[half.div_ceil(2)])
}
