//! Connected parts: nodes, or other things with numbers, that are joined.

use super::Mesh;

/// Numbers that are joined to parts.
#[derive(Clone, Debug)]
pub struct Parts {
    above: Vec<u32>,
}

impl Parts {
    /// So many numbers, each a part of its own.
    pub fn apart(count: usize) -> Self {
        Self {
            above: (0..count as u32).collect(),
        }
    }

    /// Nodes of a mesh, joined by the cells of some of its regions, by number.
    pub fn of_cells(mesh: &Mesh, region: impl Fn(usize) -> bool) -> Self {
        let mut parts = Self::apart(mesh.points.len());
        for cell in (0..mesh.cell_count()).filter(|&cell| region(mesh.region_of(cell))) {
            let nodes = mesh.cell(cell);
            for &node in nodes {
                parts.join(nodes[0], node);
            }
        }
        parts
    }

    /// Makes one of the parts of two numbers.
    pub fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.root(one), self.root(other));
        self.above[other as usize] = one;
    }

    /// The number that stands for the part of a number.
    pub fn root(&mut self, mut number: u32) -> u32 {
        while self.above[number as usize] != number {
            let next = self.above[self.above[number as usize] as usize];
            self.above[number as usize] = next;
            number = next;
        }
        number
    }
}
