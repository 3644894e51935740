//! Checks of a mesh before it is solved.

use std::collections::HashMap;

use super::cell::Shapes;
use super::neighbours::{SAME_PLACE, bulge};
use super::{CellShape, Facet, Mesh, MeshError, Parts};
use crate::scalar::{determinant, inverse};

/// A cell is degenerate where its map keeps less than this of the volume that its edges
/// would span at right angles.
const DEGENERATE: f64 = 1e-6;

/// The worst place of a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Distortion {
    /// Number of the cell.
    pub cell: usize,
    /// Name of its region.
    pub region: String,
    /// Where, in the coordinates of the mesh.
    pub place: [f64; 3],
    /// Determinant of the map from the reference cell there.
    pub determinant: f64,
    /// The determinant over the product of the lengths of the columns of the map: 1 at
    /// right angles, 0 where the cell is flat, negative where it is inside out.
    pub relative: f64,
}

/// Result of a check of a mesh.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Quality {
    /// Smallest relative determinant of all cells; none without cells.
    pub worst: Option<Distortion>,
    /// Cells inside out or flat at a node or a point of quadrature.
    pub inverted: Vec<Distortion>,
    /// Largest ratio of the longest to the shortest direction in the middle of a cell,
    /// and its cell.
    pub aspect: (f64, usize),
    /// Nodes of no cell.
    pub unreferenced: Vec<u32>,
    /// Pairs of nodes at one place: cracks, unless they are meant.
    pub coincident: Vec<[u32; 2]>,
    /// Regions without cells.
    pub empty_regions: Vec<String>,
}

impl Quality {
    /// Checks all cells at their nodes and points of quadrature, and all nodes.
    pub fn of(mesh: &Mesh) -> Self {
        let mut quality = Self {
            unreferenced: unreferenced(mesh),
            coincident: coincident(mesh),
            empty_regions: empty_regions(mesh),
            ..Self::default()
        };
        let mut probes = HashMap::new();
        for cell in 0..mesh.cell_count() {
            let shape = mesh.shape(cell);
            let probes = probes.entry(shape).or_insert_with(|| Probes::new(shape));
            let aspect = probes.aspect(mesh, cell);
            if cell == 0 || aspect > quality.aspect.0 {
                quality.aspect = (aspect, cell);
            }
            let distortion = probes.distortion(mesh, cell);
            if distortion.relative <= DEGENERATE {
                quality.inverted.push(distortion.clone());
            }
            let better = quality.worst.as_ref().map(|worst| worst.relative);
            if better.is_none_or(|better| distortion.relative < better) {
                quality.worst = Some(distortion);
            }
        }
        quality
    }

    /// Nothing, or the worst that was found: cells inside out before nodes of no cell,
    /// cracks and empty regions.
    ///
    /// # Errors
    /// [`MeshError::Distorted`], [`MeshError::Unreferenced`], [`MeshError::Coincident`],
    /// [`MeshError::EmptyRegion`].
    pub fn require(&self, mesh: &Mesh) -> Result<(), MeshError> {
        let by_relative = |a: &&Distortion, b: &&Distortion| a.relative.total_cmp(&b.relative);
        if let Some(worst) = self.inverted.iter().min_by(by_relative) {
            return Err(MeshError::Distorted {
                cell: worst.cell,
                region: worst.region.clone(),
                place: worst.place,
                relative: worst.relative,
                cells: self.inverted.len(),
            });
        }
        if let Some(&node) = self.unreferenced.first() {
            return Err(MeshError::Unreferenced {
                node,
                place: mesh.points[node as usize],
                nodes: self.unreferenced.len(),
            });
        }
        if let Some(&[first, second]) = self.coincident.first() {
            return Err(MeshError::Coincident {
                first,
                second,
                place: mesh.points[first as usize],
                pairs: self.coincident.len(),
            });
        }
        match self.empty_regions.first() {
            Some(name) => Err(MeshError::EmptyRegion { name: name.clone() }),
            None => Ok(()),
        }
    }
}

/// Nodes at which cells meet that no side joins there: parts of the body hang together by a point,
/// in space also by an edge, and turn about it freely.
pub fn hinges(mesh: &Mesh) -> Vec<u32> {
    // A cell at a node stands for all that sides around the node join to it.
    let mut at: Vec<(u32, u32)> = (0..mesh.cell_count())
        .flat_map(|cell| {
            let corners = mesh.cell(cell)[..mesh.shape(cell).corner_count()].iter();
            corners.map(move |&node| (node, cell as u32))
        })
        .collect();
    at.sort_unstable();
    let mut parts = Parts::apart(at.len());
    let mut sides: HashMap<Vec<u32>, u32> = HashMap::new();
    for cell in 0..mesh.cell_count() as u32 {
        let shape = mesh.shape(cell as usize);
        for side in 0..shape.sides().len() as u8 {
            let nodes = mesh.facet_nodes(Facet { cell, side });
            let mut corners: Vec<u32> = nodes.take(shape.facet_shape().corner_count()).collect();
            corners.sort_unstable();
            let Some(other) = sides.insert(corners.clone(), cell) else {
                continue;
            };
            for node in corners {
                let place = |cell| at.partition_point(|known| *known < (node, cell)) as u32;
                parts.join(place(cell), place(other));
            }
        }
    }
    let tops = (0..at.len() as u32).filter(|&place| parts.root(place) == place);
    let nodes: Vec<u32> = tops.map(|place| at[place as usize].0).collect();
    let mut twice: Vec<u32> = nodes
        .windows(2)
        .filter(|pair| pair[0] == pair[1])
        .map(|pair| pair[0])
        .collect();
    twice.dedup();
    twice
}

/// True if a side of a cell is bent: a node of it is off what its corners span.
pub fn is_curved(mesh: &Mesh, cell: usize) -> bool {
    bulge(mesh, cell) > SAME_PLACE * mesh.size()
}

/// Measure of a cell: its area or volume, negative when inverted.
pub fn measure(mesh: &Mesh, cell: usize) -> f64 {
    let points = mesh.shape(cell).quadrature();
    let part = |at, weight: f64| weight * determinant(&map_at(mesh, cell, at));
    points
        .iter()
        .map(|point| part(point.at, point.weight))
        .sum()
}

/// Gradient of the place in reference coordinates at a point of the reference cell.
pub(crate) fn map_at(mesh: &Mesh, cell: usize, at: [f64; 3]) -> [[f64; 3]; 3] {
    map(mesh, cell, &mesh.shape(cell).shapes(at))
}

/// Gradient of the place in reference coordinates; in the plane the third direction is
/// kept.
pub(crate) fn map(mesh: &Mesh, cell: usize, shapes: &Shapes) -> [[f64; 3]; 3] {
    let mut map = [[0.0; 3]; 3];
    for (gradient, &node) in shapes.gradients.iter().zip(mesh.cell(cell)) {
        let point = mesh.points[node as usize];
        for i in 0..3 {
            for j in 0..3 {
                map[i][j] += point[i] * gradient[j];
            }
        }
    }
    if mesh.shape(cell).dimension() == 2 {
        map[2][2] = 1.0;
    }
    map
}

/// Functions of a shape at its nodes and points of quadrature: the same for all cells.
struct Probes {
    /// The last node is the middle.
    nodes: Vec<Shapes>,
    points: Vec<Shapes>,
    /// From the regular cell to the reference cell.
    from_regular: [[f64; 3]; 3],
}

impl Probes {
    fn new(shape: CellShape) -> Self {
        let nodes = (0..shape.node_count()).map(|node| shape.shapes(shape.node_at(node)));
        let points = shape.quadrature().into_iter();
        let regular = regular_map(shape);
        Self {
            nodes: nodes.collect(),
            points: points.map(|point| shape.shapes(point.at)).collect(),
            from_regular: inverse(&regular, determinant(&regular)),
        }
    }

    fn distortion(&self, mesh: &Mesh, cell: usize) -> Distortion {
        let mut worst: Option<(f64, f64, &Shapes)> = None;
        for shapes in self.nodes.iter().chain(&self.points) {
            let map = map(mesh, cell, shapes);
            let determinant = determinant(&map);
            let column = |j: usize| map.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
            let span = column(0) * column(1) * column(2);
            // Places that are no numbers make a cell as useless as a flat one.
            let sound = span > 0.0 && determinant.is_finite();
            let relative = if sound { determinant / span } else { 0.0 };
            if worst.is_none_or(|(least, ..)| relative < least) {
                worst = Some((relative, determinant, shapes));
            }
        }
        let region = mesh.regions.get(mesh.region_of(cell)).cloned();
        let (relative, determinant, place) = worst.map_or((0.0, 0.0, [0.0; 3]), |worst| {
            (worst.0, worst.1, place(mesh, cell, worst.2))
        });
        Distortion {
            cell,
            region: region.unwrap_or_default(),
            place,
            determinant,
            relative,
        }
    }

    /// Ratio of the largest to the smallest stretch of the map from the regular cell.
    fn aspect(&self, mesh: &Mesh, cell: usize) -> f64 {
        let map = map(mesh, cell, &self.nodes[self.nodes.len() - 1]);
        let back = &self.from_regular;
        let stretch: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| map[i][k] * back[k][j]).sum())
        });
        let mut square: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| stretch[k][i] * stretch[k][j]).sum())
        });
        if mesh.shape(cell).dimension() == 2 {
            // Between the two others, so that it is neither the largest nor the smallest.
            square[2][2] = f64::midpoint(square[0][0], square[1][1]);
        }
        let [least, most] = extreme_eigenvalues(&square);
        (most / least.max(f64::MIN_POSITIVE)).sqrt()
    }
}

fn place(mesh: &Mesh, cell: usize, shapes: &Shapes) -> [f64; 3] {
    let mut place = [0.0; 3];
    for (value, &node) in shapes.values.iter().zip(mesh.cell(cell)) {
        for (sum, x) in place.iter_mut().zip(mesh.points[node as usize]) {
            *sum += value * x;
        }
    }
    place
}

/// Gradient of the map from the reference cell to the regular one.
fn regular_map(shape: CellShape) -> [[f64; 3]; 3] {
    let height = 0.75_f64.sqrt();
    match shape {
        CellShape::Quad9 | CellShape::Hex27 => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        CellShape::Tri7 => [[1.0, 0.5, 0.0], [0.0, height, 0.0], [0.0, 0.0, 1.0]],
        CellShape::Tet15 => [
            [1.0, 0.5, 0.5],
            [0.0, height, height / 3.0],
            [0.0, 0.0, (2.0_f64 / 3.0).sqrt()],
        ],
    }
}

/// Smallest and largest eigenvalue of a symmetric tensor, by the angle of its cubic.
pub(crate) fn extreme_eigenvalues(a: &[[f64; 3]; 3]) -> [f64; 2] {
    let mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
    let mut deviator = *a;
    for (k, row) in deviator.iter_mut().enumerate() {
        row[k] -= mean;
    }
    let size = (deviator.iter().flatten().map(|x| x * x).sum::<f64>() / 6.0).sqrt();
    if size <= 1e-14 * mean {
        return [mean, mean];
    }
    let cosine = (determinant(&deviator) / (2.0 * size * size * size)).clamp(-1.0, 1.0);
    let angle = libm::acos(cosine) / 3.0;
    let third = 2.0 * std::f64::consts::FRAC_PI_3;
    [
        mean + 2.0 * size * libm::cos(angle + third),
        mean + 2.0 * size * libm::cos(angle),
    ]
}

fn unreferenced(mesh: &Mesh) -> Vec<u32> {
    let mut used = vec![false; mesh.points.len()];
    for cell in 0..mesh.cell_count() {
        for &node in mesh.cell(cell) {
            used[node as usize] = true;
        }
    }
    let unused = used.iter().enumerate().filter(|(_, used)| !**used);
    unused.map(|(node, _)| node as u32).collect()
}

fn empty_regions(mesh: &Mesh) -> Vec<String> {
    let mut used = vec![false; mesh.regions.len()];
    for cell in 0..mesh.cell_count() {
        if let Some(used) = used.get_mut(mesh.region_of(cell)) {
            *used = true;
        }
    }
    let names = mesh.regions.iter().zip(used);
    names
        .filter(|(_, used)| !used)
        .map(|(name, _)| name.clone())
        .collect()
}

/// Pairs of nodes nearer to each other than a billionth of the mesh.
fn coincident(mesh: &Mesh) -> Vec<[u32; 2]> {
    let size = mesh
        .points
        .iter()
        .flatten()
        .fold(0.0, |most: f64, x| most.max(x.abs()));
    let near = (1e-9 * size).max(f64::MIN_POSITIVE);
    // Boxes far larger than the distance: a node seldom has to look into a second one.
    let number = |x: f64| (x / (1e3 * near)).floor() as i64;
    let mut boxes: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut pairs = Vec::new();
    for (node, point) in mesh.points.iter().enumerate() {
        let range = |axis: usize| number(point[axis] - near)..=number(point[axis] + near);
        for x in range(0) {
            for (y, z) in range(1).flat_map(|y| range(2).map(move |z| (y, z))) {
                for &other in boxes.get(&[x, y, z]).into_iter().flatten() {
                    let at = mesh.points[other as usize];
                    if (0..3).all(|k| (at[k] - point[k]).abs() <= near) {
                        pairs.push([other, node as u32]);
                    }
                }
            }
        }
        let home = point.map(number);
        boxes.entry(home).or_default().push(node as u32);
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Axis, Grid2, Grid3, LowerCell};

    fn plate() -> Mesh {
        let x = Axis::uniform(0.0, 8.0, 2).unwrap();
        let y = Axis::uniform(0.0, 1.0, 1).unwrap();
        Grid2::new([x, y], "solid").mesh().unwrap()
    }

    #[test]
    fn a_grid_is_sound_and_as_long_as_it_is_drawn() {
        let mesh = plate();
        let quality = Quality::of(&mesh);
        assert_eq!(quality.require(&mesh), Ok(()));
        assert!((quality.aspect.0 - 4.0).abs() < 1e-6);
        assert!((quality.worst.unwrap().relative - 1.0).abs() < 1e-12);
        let axis = |length| Axis::uniform(0.0, length, 1).unwrap();
        let brick = Grid3::new([axis(1.0), axis(2.0), axis(5.0)], "solid")
            .mesh()
            .unwrap();
        assert!((Quality::of(&brick).aspect.0 - 5.0).abs() < 1e-6);
        assert!((measure(&brick, 0) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn regular_simplices_are_as_long_as_wide() {
        for shape in [CellShape::Tri7, CellShape::Tet15] {
            let map = regular_map(shape);
            let corners = shape.corner_count();
            let points = (0..corners)
                .map(|n| {
                    let at = shape.node_at(n);
                    std::array::from_fn(|i| (0..shape.dimension()).map(|k| map[i][k] * at[k]).sum())
                })
                .collect();
            let nodes = (0..corners as u32).collect();
            let cell = LowerCell {
                shape,
                region: 0,
                nodes,
            };
            let mesh = Mesh::from_lower_cells(points, &[cell], &["solid"]).unwrap();
            assert!(
                (Quality::of(&mesh).aspect.0 - 1.0).abs() < 1e-6,
                "{shape:?}"
            );
            // All edges have length one.
            let [a, b] = [1, corners - 1].map(|n| mesh.points[n]);
            let length: f64 = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum();
            assert!((length - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_node_pulled_through_its_cell_is_found_there() {
        let mut mesh = plate();
        let corner = mesh.cell(1)[2];
        mesh.points[corner as usize] = [3.5, 0.2, 0.0];
        let error = Quality::of(&mesh).require(&mesh).unwrap_err();
        let MeshError::Distorted {
            cell,
            region,
            relative,
            cells,
            ..
        } = error
        else {
            panic!("{error}");
        };
        assert_eq!((cell, region.as_str(), cells), (1, "solid", 1));
        assert!(relative < 0.0);
    }

    #[test]
    fn a_flat_cell_is_degenerate() {
        let sheared = |x: [f64; 3]| [x[0] + x[1], 1e-8 * x[1], 0.0];
        let collapsed = |x: [f64; 3]| [x[0], 0.0, 0.0];
        let unknown = |x: [f64; 3]| [x[0], f64::NAN, 0.0];
        for map in [sheared, collapsed, unknown] {
            let mut mesh = plate();
            for point in &mut mesh.points {
                *point = map(*point);
            }
            assert!(matches!(
                Quality::of(&mesh).require(&mesh),
                Err(MeshError::Distorted { cells: 2, .. })
            ));
        }
    }

    #[test]
    fn cells_that_meet_in_a_node_alone_are_a_hinge() {
        assert_eq!(hinges(&plate()), [0; 0]);
        let points = [
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0, 1.0],
            [0.0, 1.0],
            [2.0, 1.0],
            [2.0, 2.0],
            [1.0, 2.0],
        ];
        let points = points.map(|[x, y]| [x, y, 0.0]).to_vec();
        let cell = |nodes: [u32; 4]| LowerCell {
            shape: CellShape::Quad9,
            region: 0,
            nodes: nodes.to_vec(),
        };
        let mut cells = vec![cell([0, 1, 2, 3]), cell([2, 4, 5, 6])];
        let mesh = Mesh::from_lower_cells(points.clone(), &cells, &["solid"]).unwrap();
        assert_eq!(hinges(&mesh), [2]);
        // A third cell in the corner between them joins both.
        cells.push(cell([3, 2, 6, 7]));
        let points = [points, vec![[0.0, 2.0, 0.0]]].concat();
        let mesh = Mesh::from_lower_cells(points, &cells, &["solid"]).unwrap();
        assert_eq!(hinges(&mesh), [0; 0]);
        // Two bricks along one edge.
        let axis = || Axis::uniform(0.0, 2.0, 2).unwrap();
        let brick = Grid3::new(
            [axis(), axis(), Axis::uniform(0.0, 1.0, 1).unwrap()],
            "solid",
        );
        let whole = brick.mesh().unwrap();
        let mut edge = Mesh {
            points: whole.points.clone(),
            ..Mesh::default()
        };
        edge.region("solid");
        for cell in [0, 3] {
            edge.add_cell(whole.shape(cell), 0, whole.cell(cell));
        }
        assert_eq!(hinges(&whole), [0; 0]);
        assert_eq!(hinges(&edge).len(), 2);
    }

    #[test]
    fn loose_nodes_cracks_and_empty_regions_are_found() {
        let mut mesh = plate();
        mesh.points.push([9.0, 9.0, 0.0]);
        let quality = Quality::of(&mesh);
        assert!(matches!(
            quality.require(&mesh),
            Err(MeshError::Unreferenced { nodes: 1, .. })
        ));
        let mut mesh = plate();
        mesh.region("spare");
        assert!(matches!(
            Quality::of(&mesh).require(&mesh),
            Err(MeshError::EmptyRegion { name }) if name == "spare"
        ));
        // Two cells side by side with nodes of their own on the line between.
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .iter()
            .flat_map(|&[x, y]| [[x, y, 0.0], [x + 1.0, y, 0.0]])
            .collect();
        let cell = |nodes: [u32; 4]| LowerCell {
            shape: CellShape::Quad9,
            region: 0,
            nodes: nodes.to_vec(),
        };
        let cells = [cell([0, 2, 4, 6]), cell([1, 3, 5, 7])];
        let mesh = Mesh::from_lower_cells(points, &cells, &["solid"]).unwrap();
        assert_eq!(Quality::of(&mesh).coincident.len(), 3);
        assert!(matches!(
            Quality::of(&mesh).require(&mesh),
            Err(MeshError::Coincident { pairs: 3, .. })
        ));
    }
}
