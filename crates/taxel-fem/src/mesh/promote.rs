//! Cells with fewer nodes made into the shapes of [`CellShape`].

use std::collections::HashMap;

use super::error::MeshError;
use super::{CellShape, Mesh};

/// A cell with the first of its nodes, in VTK's order: its corners, with the middles of
/// its edges, or with all. Three, 6 or 7 nodes on a triangle; 4, 8 or 9 on a
/// quadrilateral; 4, 10 or 15 on a tetrahedron; 8, 20 or 27 on a hexahedron.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LowerCell {
    /// Shape of the cell when it is complete.
    pub shape: CellShape,
    /// Number of its region in the list of names.
    pub region: u16,
    /// Numbers of its nodes.
    pub nodes: Vec<u32>,
}

/// Nodes in the middles of edges, faces and cells, by the corners round them.
pub(super) type Middles = HashMap<[u32; 8], u32>;

impl Mesh {
    /// A mesh from cells with fewer nodes: the missing ones are placed by the map that the
    /// nodes at hand give their cell, and shared between neighbours.
    ///
    /// # Errors
    /// [`MeshError::NodeCount`], [`MeshError::NoSuchNode`], [`MeshError::NoSuchRegion`],
    /// [`MeshError::TwoMiddles`], [`MeshError::TwinCell`].
    ///
    /// # Example
    /// ```
    /// use taxel_fem::mesh::{CellShape, LowerCell, Mesh};
    /// let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    /// let nodes = vec![0, 1, 2, 3];
    /// let square = LowerCell { shape: CellShape::Quad9, region: 0, nodes };
    /// let mesh = Mesh::from_lower_cells(points, &[square], &["solid"])?;
    /// assert_eq!(mesh.points[8], [0.5, 0.5, 0.0]);
    /// # Ok::<(), taxel_fem::mesh::MeshError>(())
    /// ```
    pub fn from_lower_cells(
        points: Vec<[f64; 3]>,
        cells: &[LowerCell],
        regions: &[&str],
    ) -> Result<Self, MeshError> {
        let regions = regions.iter().map(|&name| name.to_owned()).collect();
        let (mesh, _) = promote(points, cells, regions).map_err(|(_, error)| error)?;
        Ok(mesh)
    }
}

/// The mesh and its middles; with an error the number of its cell.
pub(super) fn promote(
    points: Vec<[f64; 3]>,
    cells: &[LowerCell],
    regions: Vec<String>,
) -> Result<(Mesh, Middles), (usize, MeshError)> {
    let mut mesh = Mesh {
        points,
        regions,
        ..Mesh::default()
    };
    let mut middles = Middles::new();
    // Given middles first, so that a neighbour without them takes them over.
    for (number, cell) in cells.iter().enumerate() {
        check(&mesh, number, cell)
            .and_then(|()| note_given(&mut middles, number, cell))
            .map_err(|error| (number, error))?;
    }
    let mut complete = HashMap::new();
    for (number, cell) in cells.iter().enumerate() {
        let corners = key(cell.nodes[..cell.shape.corner_count()].iter().copied());
        if let Some(other) = complete.insert(corners, number) {
            let twin = MeshError::TwinCell {
                cell: number,
                other,
            };
            return Err((number, twin));
        }
        let nodes = fill(&mut mesh, &mut middles, cell);
        mesh.add_cell(cell.shape, cell.region, &nodes);
    }
    Ok((mesh, middles))
}

/// Key of an edge, face or cell in [`Middles`].
pub(super) fn key(corners: impl Iterator<Item = u32>) -> [u32; 8] {
    let mut key = [u32::MAX; 8];
    for (place, corner) in key.iter_mut().zip(corners) {
        *place = corner;
    }
    key.sort_unstable();
    key
}

fn check(mesh: &Mesh, number: usize, cell: &LowerCell) -> Result<(), MeshError> {
    let allowed: [usize; 3] = match cell.shape {
        CellShape::Tri7 => [3, 6, 7],
        CellShape::Quad9 => [4, 8, 9],
        CellShape::Tet15 => [4, 10, 15],
        CellShape::Hex27 => [8, 20, 27],
    };
    if !allowed.contains(&cell.nodes.len()) {
        return Err(MeshError::NodeCount {
            cell: number,
            found: cell.nodes.len(),
            allowed,
        });
    }
    let count = mesh.points.len();
    if let Some(&node) = cell.nodes.iter().find(|&&node| node as usize >= count) {
        return Err(MeshError::NoSuchNode {
            cell: number,
            node,
            count,
        });
    }
    if usize::from(cell.region) >= mesh.regions.len() {
        return Err(MeshError::NoSuchRegion {
            cell: number,
            region: cell.region,
            count: mesh.regions.len(),
        });
    }
    Ok(())
}

fn note_given(middles: &mut Middles, number: usize, cell: &LowerCell) -> Result<(), MeshError> {
    for local in cell.shape.corner_count()..cell.nodes.len() {
        let corners = corners_round(cell.shape, local);
        let node = cell.nodes[local];
        let known = *middles
            .entry(key(corners.iter().map(|&corner| cell.nodes[corner])))
            .or_insert(node);
        if known != node {
            return Err(MeshError::TwoMiddles {
                cell: number,
                first: known,
                second: node,
            });
        }
    }
    Ok(())
}

/// All nodes of a cell; new ones are added to the mesh.
fn fill(mesh: &mut Mesh, middles: &mut Middles, cell: &LowerCell) -> Vec<u32> {
    let shape = cell.shape;
    let mut nodes = cell.nodes.clone();
    for local in cell.nodes.len()..shape.node_count() {
        let corners = corners_round(shape, local);
        let place = key(corners.iter().map(|&corner| nodes[corner]));
        let node = middles.get(&place).copied().unwrap_or_else(|| {
            let mut point = [0.0; 3];
            for (&other, weight) in nodes.iter().zip(weights(shape, local, &corners)) {
                for (value, given) in point.iter_mut().zip(mesh.points[other as usize]) {
                    *value += weight * given;
                }
            }
            mesh.points.push(point);
            let node = mesh.points.len() as u32 - 1;
            middles.insert(place, node);
            node
        });
        nodes.push(node);
    }
    nodes
}

/// The corners of the edge, face or cell whose middle a node is.
fn corners_round(shape: CellShape, local: usize) -> Vec<usize> {
    let at = shape.node_at(local);
    let dimension = shape.dimension();
    let simplex = matches!(shape, CellShape::Tri7 | CellShape::Tet15);
    let holds = |corner: usize| {
        if !simplex {
            let place = shape.node_at(corner);
            (0..dimension).all(|k| at[k] == 0.0 || at[k] == place[k])
        } else if corner == 0 {
            at[..dimension].iter().sum::<f64>() < 1.0 - 1e-9
        } else {
            at[corner - 1] > 0.0
        }
    };
    (0..shape.corner_count())
        .filter(|&corner| holds(corner))
        .collect()
}

/// Weights of the nodes before a middle in its place: the value there of the functions
/// that corners, edges and (in a hexahedron) faces carry without it.
fn weights(shape: CellShape, local: usize, corners: &[usize]) -> Vec<f64> {
    let by_count = |of: usize| match (corners.len(), of, shape) {
        (3, 1, _) => -1.0 / 9.0,
        (3, 2, _) => 4.0 / 9.0,
        (4, 1, CellShape::Tet15) => -0.125,
        (4, 2, CellShape::Tet15) => 0.25,
        (2, 1, _) | (4, 2, _) | (8, 4, _) => 0.5,
        (4, 1, _) | (8, 2, _) => -0.25,
        (8, 1, _) => 0.125,
        _ => 0.0,
    };
    (0..local)
        .map(|other| {
            let round = corners_round(shape, other);
            let within = round.iter().all(|corner| corners.contains(corner));
            if within { by_count(round.len()) } else { 0.0 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::quality::measure;

    const ALL: [(CellShape, [usize; 2]); 4] = [
        (CellShape::Tri7, [3, 6]),
        (CellShape::Quad9, [4, 8]),
        (CellShape::Tet15, [4, 10]),
        (CellShape::Hex27, [8, 20]),
    ];

    /// One cell, its given nodes moved by `map`.
    fn one(shape: CellShape, given: usize, map: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
        let points: Vec<[f64; 3]> = (0..given).map(|n| map(shape.node_at(n))).collect();
        let nodes = (0..given as u32).collect();
        let cell = LowerCell {
            shape,
            region: 0,
            nodes,
        };
        Mesh::from_lower_cells(points, &[cell], &["solid"]).unwrap()
    }

    #[test]
    fn corners_give_an_affine_cell_all_its_nodes() {
        let map = |x: [f64; 3]| {
            [
                1.0 + 2.0 * x[0] + 0.3 * x[1],
                0.2 * x[0] + x[1] - 0.5 * x[2],
                x[2] * 1.5 - 0.1 * x[0],
            ]
        };
        for (shape, givens) in ALL {
            for given in givens {
                let mesh = one(shape, given, map);
                for (local, &node) in mesh.cell(0).iter().enumerate() {
                    let expected = map(shape.node_at(local));
                    for k in 0..3 {
                        let error = mesh.points[node as usize][k] - expected[k];
                        assert!(error.abs() < 1e-14, "{shape:?} {given} {local}");
                    }
                }
            }
        }
    }

    #[test]
    fn curved_edges_bend_the_inside_with_them() {
        // Serendipity and quadratic functions hold every quadratic map; the middles must
        // be those of that map.
        let map = |x: [f64; 3]| {
            [
                x[0] + 0.1 * x[0] * x[1] - 0.05 * x[2] * x[2],
                x[1] + 0.07 * x[0] * x[0] + 0.02 * x[1] * x[2],
                x[2] + 0.04 * x[1] * x[1] - 0.03 * x[0] * x[2],
            ]
        };
        for (shape, [_, given]) in ALL {
            let mesh = one(shape, given, map);
            for (local, &node) in mesh.cell(0).iter().enumerate() {
                let expected = map(shape.node_at(local));
                for k in 0..3 {
                    let error = mesh.points[node as usize][k] - expected[k];
                    assert!(error.abs() < 1e-14, "{shape:?} {local}");
                }
            }
        }
    }

    #[test]
    fn neighbours_share_their_middles() {
        let x = |i: f64, j: f64| [i, j, 0.0];
        let points = vec![
            x(0., 0.),
            x(1., 0.),
            x(2., 0.),
            x(0., 1.),
            x(1., 1.),
            x(2., 1.),
            x(1.1, 0.5),
        ];
        let plain = LowerCell {
            shape: CellShape::Quad9,
            region: 0,
            nodes: vec![0, 1, 4, 3],
        };
        let triangle = |nodes: &[u32]| LowerCell {
            shape: CellShape::Tri7,
            region: 0,
            nodes: nodes.to_vec(),
        };
        let cells = [plain, triangle(&[1, 5, 4]), triangle(&[1, 2, 5])];
        let mesh = Mesh::from_lower_cells(points.clone(), &cells, &["solid"]).unwrap();
        assert_eq!(mesh.cell(0)[5], mesh.cell(1)[5]);
        assert_eq!(mesh.cell(1)[3], mesh.cell(2)[5]);
        assert_eq!(mesh.boundary().len(), 6);
        let area: f64 = (0..3).map(|cell| measure(&mesh, cell)).sum();
        assert!((area - 2.0).abs() < 1e-14);
        // A middle that only the later cell brings serves the earlier one too.
        let points = [points, vec![x(1.5, 0.5), x(1.5, 1.0)]].concat();
        let cells = [cells[0].clone(), triangle(&[1, 5, 4, 7, 8, 6])];
        let mesh = Mesh::from_lower_cells(points, &cells, &["solid"]).unwrap();
        assert_eq!(mesh.cell(0)[5], 6);
        let centre = mesh.points[mesh.cell(0)[8] as usize];
        assert!((centre[0] - 0.55).abs() < 1e-14);
    }

    #[test]
    fn wrong_cells_are_refused() {
        let points = vec![[0.0; 3]; 8];
        let of = |cells: &[&[u32]]| {
            let cells: Vec<LowerCell> = cells
                .iter()
                .map(|nodes| LowerCell {
                    shape: CellShape::Tri7,
                    region: 0,
                    nodes: nodes.to_vec(),
                })
                .collect();
            Mesh::from_lower_cells(points.clone(), &cells, &["solid"]).unwrap_err()
        };
        assert!(matches!(
            of(&[&[0, 1, 2, 3]]),
            MeshError::NodeCount { found: 4, .. }
        ));
        assert!(matches!(
            of(&[&[0, 1, 8]]),
            MeshError::NoSuchNode { node: 8, .. }
        ));
        assert!(matches!(
            of(&[&[0, 1, 2], &[2, 0, 1]]),
            MeshError::TwinCell { cell: 1, other: 0 }
        ));
        assert!(matches!(
            of(&[&[0, 1, 2, 3, 4, 5], &[1, 0, 6, 7, 4, 5]]),
            MeshError::TwoMiddles {
                cell: 1,
                first: 3,
                second: 7
            }
        ));
        let cell = LowerCell {
            shape: CellShape::Tri7,
            region: 1,
            nodes: vec![0, 1, 2],
        };
        assert!(matches!(
            Mesh::from_lower_cells(points.clone(), &[cell], &["solid"]),
            Err(MeshError::NoSuchRegion { region: 1, .. })
        ));
    }
}
