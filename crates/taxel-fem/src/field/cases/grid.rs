//! Grids of the cases: products of graded lines.

use crate::mesh::{CellShape, Mesh};

/// Sizes of the cells of a line.
#[derive(Clone, Copy)]
pub(in crate::field) struct Sizes {
    /// Growth from cell to cell.
    pub(in crate::field) growth: f64,
    /// Largest size.
    pub(in crate::field) largest: f64,
}

impl Sizes {
    /// Appends the ends of cells from the last coordinate of `line` to `to`, small at
    /// the ends with a given size and growing away from them.
    pub(in crate::field) fn extend(
        self,
        line: &mut Vec<f64>,
        to: f64,
        at_start: Option<f64>,
        at_end: Option<f64>,
    ) {
        let start = line.last().copied().unwrap_or_default();
        let length = to - start;
        let largest = self.largest.min(length);
        let mut next = [at_start, at_end].map(|size| size.unwrap_or(largest).min(largest));
        let mut steps = [Vec::new(), Vec::new()];
        let mut covered = 0.0;
        while covered < length * (1.0 - 1e-9) {
            let side = usize::from(next[1] < next[0]);
            steps[side].push(next[side]);
            covered += next[side];
            next[side] = (next[side] * self.growth).min(largest);
        }
        let scale = length / covered;
        let mut at = start;
        let count = steps[0].len() + steps[1].len();
        let all = steps[0].iter().chain(steps[1].iter().rev());
        for step in all.take(count - 1) {
            at += scale * step;
            line.push(at);
        }
        line.push(to);
    }
}

/// Ends of cells through several marks, small at all of them (or at none but these).
pub(in crate::field) fn line(sizes: Sizes, marks: &[(f64, Option<f64>)]) -> Vec<f64> {
    let mut line = vec![marks[0].0];
    for pair in marks.windows(2) {
        sizes.extend(&mut line, pair[1].0, pair[0].1, pair[1].1);
    }
    line
}

/// Ends and middles of cells.
fn with_middles(line: &[f64]) -> Vec<f64> {
    let mut points = vec![line[0]];
    for pair in line.windows(2) {
        points.push(f64::midpoint(pair[0], pair[1]));
        points.push(pair[1]);
    }
    points
}

/// A grid in a plane; `region` names the region at a place, none where there is a hole.
pub(in crate::field) fn plane(
    xs: &[f64],
    ys: &[f64],
    region: &dyn Fn([f64; 2]) -> Option<&'static str>,
) -> Mesh {
    let (px, py) = (with_middles(xs), with_middles(ys));
    let mut mesh = Mesh::default();
    for &y in &py {
        mesh.points.extend(px.iter().map(|&x| [x, y, 0.0]));
    }
    for j in 0..ys.len() - 1 {
        for i in 0..xs.len() - 1 {
            if let Some(name) = region([px[2 * i + 1], py[2 * j + 1]]) {
                let region = mesh.region(name);
                let nodes: [u32; 9] = std::array::from_fn(|k| {
                    let at = CellShape::Quad9.node_at(k);
                    let column = 2 * i + (at[0] + 1.0) as usize;
                    let row = 2 * j + (at[1] + 1.0) as usize;
                    (row * px.len() + column) as u32
                });
                mesh.add_cell(CellShape::Quad9, region, &nodes);
            }
        }
    }
    mesh
}

/// A grid of one region in space.
pub(in crate::field) fn solid(axes: [&[f64]; 3], name: &'static str) -> Mesh {
    space(axes, &|_| name)
}

/// A grid in space; `region` names the region at a place.
pub(in crate::field) fn space(
    axes: [&[f64]; 3],
    region: &dyn Fn([f64; 3]) -> &'static str,
) -> Mesh {
    let points = axes.map(with_middles);
    let counts = axes.map(|axis| axis.len() - 1);
    let mut mesh = Mesh::default();
    for &z in &points[2] {
        for &y in &points[1] {
            mesh.points.extend(points[0].iter().map(|&x| [x, y, z]));
        }
    }
    for cell in 0..counts.iter().product() {
        let at = [
            cell % counts[0],
            cell / counts[0] % counts[1],
            cell / (counts[0] * counts[1]),
        ];
        let middle = std::array::from_fn(|d| points[d][2 * at[d] + 1]);
        let region = mesh.region(region(middle));
        let nodes: [u32; 27] = std::array::from_fn(|k| {
            let local = CellShape::Hex27.node_at(k);
            let place: [usize; 3] = std::array::from_fn(|d| 2 * at[d] + (local[d] + 1.0) as usize);
            ((place[2] * points[1].len() + place[1]) * points[0].len() + place[0]) as u32
        });
        mesh.add_cell(CellShape::Hex27, region, &nodes);
    }
    mesh
}

/// Names the nodes that satisfy a condition.
pub(in crate::field) fn name_nodes(
    mesh: &mut Mesh,
    name: &str,
    condition: &dyn Fn([f64; 3]) -> bool,
) {
    let nodes = (0..mesh.points.len() as u32)
        .filter(|&node| condition(mesh.points[node as usize]))
        .collect();
    mesh.node_sets.insert(name.to_owned(), nodes);
}
