//! Several meshes as one.

use std::collections::HashMap;

use super::Mesh;

impl Mesh {
    /// Puts the meshes of several bodies into one, each with a name: region, surface and node set
    /// `x` of body `b` become `b_x`. Nodes at the same place become one where `weld` says so of
    /// that place; all others stay apart, so that bodies may touch and slide.
    ///
    /// # Example
    /// ```
    /// use taxel_fem::mesh::{Axis, Grid2, Mesh};
    ///
    /// let unit = || Axis::uniform(0.0, 1.0, 2);
    /// let lower = Grid2::new([unit()?, Axis::uniform(-1.0, 0.0, 3)?], "rubber").mesh()?;
    /// let upper = Grid2::new([unit()?, unit()?], "rubber").mesh()?;
    /// let bodies = [("lower", &lower), ("upper", &upper)];
    /// let apart = Mesh::joined(&bodies, |_| false);
    /// assert_eq!(apart.regions, ["lower_rubber", "upper_rubber"]);
    /// assert_eq!(apart.points.len(), lower.points.len() + upper.points.len());
    /// // The five nodes between them become one each.
    /// let whole = Mesh::joined(&bodies, |x| x[1] == 0.0);
    /// assert_eq!(whole.points.len(), apart.points.len() - 5);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn joined(bodies: &[(&str, &Self)], weld: impl Fn([f64; 3]) -> bool) -> Self {
        let mut whole = Self::default();
        let mut welded = HashMap::<[u64; 3], u32>::new();
        for &(body, mesh) in bodies {
            let named = |name: &str| format!("{body}_{name}");
            let nodes: Vec<u32> = mesh
                .points
                .iter()
                .map(|&place| {
                    let next = whole.points.len() as u32;
                    let number = if weld(place) {
                        // Zeros of either sign are the same.
                        let key = place.map(|x| (x + 0.0).to_bits());
                        *welded.entry(key).or_insert(next)
                    } else {
                        next
                    };
                    if number == next {
                        whole.points.push(place);
                    }
                    number
                })
                .collect();
            let first_cell = whole.cell_count() as u32;
            for cell in 0..mesh.cell_count() {
                let region = whole.region(&named(&mesh.regions[mesh.region_of(cell)]));
                let own: Vec<u32> = mesh.cell(cell).iter().map(|&n| nodes[n as usize]).collect();
                whole.add_cell(mesh.shape(cell), region, &own);
            }
            for (name, surface) in &mesh.surfaces {
                let mut surface = surface.clone();
                for facet in &mut surface {
                    facet.cell += first_cell;
                }
                whole.surfaces.insert(named(name), surface);
            }
            for (name, set) in &mesh.node_sets {
                let set = set.iter().map(|&n| nodes[n as usize]).collect();
                whole.node_sets.insert(named(name), set);
            }
        }
        whole
    }
}
