//! Triangles round a layer, tied to its cells.

use std::collections::HashMap;
use taxel_fem::field::FieldError;
use taxel_fem::mesh::{Axis, CellShape, Grading, Growth, Mesh, polygon};

/// Cells along each side of the box.
const BOX_CELLS: usize = 8;
/// Largest distance of the middle of a curved edge from the straight one, over its length
/// and over the height of the triangles beside it: at a quarter the map of a cell loses
/// its volume.
const BEND: f64 = 0.2;
/// Growth of cells from the layer outward.
const GROWTH: f64 = 1.5;

/// Place of a node.
pub(super) type Node = [f64; 2];

/// Lines of nodes round the layer, corners and middles of edges by turns.
pub(super) struct Outline {
    /// Upper and lower nodes of the cells that are kept, left to right.
    pub(super) top: Vec<Node>,
    pub(super) bottom: Vec<Node>,
    /// Where these cells end, upwards.
    pub(super) across: Vec<Node>,
    /// From there on: below, up the side face, and back above.
    pub(super) far: Vec<Node>,
    /// Number of the node on it where the layer leaves the plane of its base.
    pub(super) foot: usize,
}

/// A part to be filled: region and closed line that runs round it in the positive sense.
type Part = (&'static str, Vec<Node>);

/// A plane mesh tied together from parts that share the digits of their places.
#[derive(Default)]
pub(super) struct Tied {
    pub(super) mesh: Mesh,
    known: HashMap<[u64; 2], u32>,
}

impl Tied {
    pub(super) fn cell(&mut self, shape: CellShape, region: &str, at: &[[f64; 2]]) {
        let nodes: Vec<u32> = at.iter().map(|&place| self.node(place)).collect();
        let region = self.mesh.region(region);
        self.mesh.add_cell(shape, region, &nodes);
    }

    fn node(&mut self, at: [f64; 2]) -> u32 {
        *self.known.entry(key(at)).or_insert_with(|| {
            self.mesh.points.push([at[0], at[1], 0.0]);
            self.mesh.points.len() as u32 - 1
        })
    }

    /// Fills the layer beyond its cells, and what is between it and a box of half side `size`,
    /// above the plane of the base and below. Returns the nodes of that plane.
    pub(super) fn surround(
        &mut self,
        outline: &Outline,
        size: f64,
    ) -> Result<Vec<u32>, FieldError> {
        let Outline {
            top,
            bottom,
            across,
            far,
            foot,
        } = outline;
        let foot = *foot;
        let base = base_plane(&far[foot..], size);
        let below = joined(&[bottom.clone(), far[..=foot].to_vec()]);
        let (start, head) = (bottom[0], top[0]);
        let upward = grown(head, [0.0, size], top[2][0] - head[0]);
        let downward = grown(start, [0.0, -size], bottom[2][0] - start[0]);
        let corners = [
            [0.0, -size],
            [size, -size],
            [size, 0.0],
            [size, size],
            [0.0, size],
        ];
        let side = |k: usize| even(corners[k], corners[k + 1]);
        let around = joined(&[
            base.clone(),
            side(2),
            side(3),
            reversed(&upward),
            top.clone(),
        ]);
        let under = joined(&[
            side(0),
            side(1),
            reversed(&base),
            reversed(&below),
            downward,
        ]);
        self.fill(&[
            ("above", joined(&[around, reversed(&far[foot..])])),
            ("below", under),
            ("layer", joined(&[far.clone(), reversed(across)])),
        ])?;
        let plane = below.iter().chain(&base);
        Ok(plane.map(|&place| self.node(place)).collect())
    }

    /// Fills parts with triangles.
    fn fill(&mut self, parts: &[Part]) -> Result<(), FieldError> {
        let mut filled = Vec::new();
        let mut middles = Middles::default();
        for (region, line) in parts {
            // The line ends where it begins.
            let corners: Vec<Node> = line[..line.len() - 1].iter().copied().step_by(2).collect();
            let triangles =
                polygon::fill(&corners).map_err(|[x, y]| FieldError::Folded { at: [x, y, 0.0] })?;
            for edge in line.windows(3).step_by(2) {
                middles.bend([edge[0], edge[2]], edge[1]);
            }
            for numbers in &triangles.corners {
                middles.make_room(numbers.map(|k| triangles.points[k]));
            }
            filled.push((*region, triangles));
        }
        for (region, triangles) in filled {
            for numbers in &triangles.corners {
                let [a, b, c] = numbers.map(|k| triangles.points[k]);
                let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|edge| middles.of(edge, self));
                // Where curved sides put it.
                let centre =
                    [0, 1].map(|d| (4.0 * (ab[d] + bc[d] + ca[d]) - (a[d] + b[d] + c[d])) / 9.0);
                self.cell(CellShape::Tri7, region, &[a, b, c, ab, bc, ca, centre]);
            }
        }
        Ok(())
    }
}

/// Middles of edges that are not straight, and how far they may be from there.
#[derive(Default)]
struct Middles(HashMap<[[u64; 2]; 2], Middle>);

struct Middle {
    place: Node,
    /// Greatest distance from the middle of the straight edge.
    room: f64,
}

impl Middles {
    fn key(edge: [Node; 2]) -> [[u64; 2]; 2] {
        let mut key = edge.map(key);
        key.sort_unstable();
        key
    }

    fn bend(&mut self, edge: [Node; 2], place: Node) {
        let room = BEND * distance(edge[0], edge[1]);
        let middle = Middle { place, room };
        self.0.entry(Self::key(edge)).or_insert(middle);
    }

    /// Keeps the curved sides of a triangle away from its third corner.
    fn make_room(&mut self, [a, b, c]: [Node; 3]) {
        let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        for edge in [[a, b], [b, c], [c, a]] {
            let height = twice / distance(edge[0], edge[1]);
            if let Some(middle) = self.0.get_mut(&Self::key(edge)) {
                middle.room = middle.room.min(BEND * height);
            }
        }
    }

    /// Middle of an edge: as the cells of the layer have it, where they share it, else as near
    /// to its own place as there is room.
    fn of(&self, edge: [Node; 2], tied: &Tied) -> Node {
        let straight = between(edge[0], edge[1]);
        let Some(&Middle { place, room }) = self.0.get(&Self::key(edge)) else {
            return straight;
        };
        let off = distance(place, straight);
        if off <= room || tied.known.contains_key(&key(place)) {
            place
        } else {
            blend(straight, place, room / off)
        }
    }
}

/// The plane of the base from the foot of the side face to the box, in cells that grow from the
/// size of those of the face.
fn base_plane(standing: &[[f64; 2]], size: f64) -> Vec<[f64; 2]> {
    let (foot, next) = (standing[0], standing[2]);
    let first = (next[0] - foot[0]).hypot(next[1] - foot[1]);
    let second = [foot[0] + first, 0.0];
    let mut plane = vec![foot, between(foot, second)];
    plane.extend(grown(second, [size, 0.0], GROWTH * first));
    plane
}

pub(super) fn between(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])]
}

pub(super) fn reversed(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    line.iter().rev().copied().collect()
}

/// One line from lines that each begin where the last one ends.
pub(super) fn joined(lines: &[Vec<Node>]) -> Vec<Node> {
    let mut joined: Vec<Node> = lines[0].clone();
    for line in &lines[1..] {
        joined.extend(&line[1..]);
    }
    joined
}

fn distance(a: Node, b: Node) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Digits of a place. Plus zero makes minus zero plus.
fn key(at: Node) -> [u64; 2] {
    at.map(|x| (x + 0.0).to_bits())
}

/// Nodes of equal cells along a side of the box.
fn even(from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    let shares = (0..=2 * BOX_CELLS).map(|k| k as f64 / (2 * BOX_CELLS) as f64);
    shares.map(|share| blend(from, to, share)).collect()
}

/// Nodes of cells that grow from `first` over a straight line.
fn grown(from: [f64; 2], to: [f64; 2], first: f64) -> Vec<[f64; 2]> {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    let growth = Growth {
        smallest: first.min(length),
        ratio: GROWTH,
        largest: f64::INFINITY,
    };
    let axis = Axis::new(&[0.0, length], &[Grading::FromStart(growth)]);
    let ends: Vec<f64> = match &axis {
        Ok(axis) => axis.positions().iter().map(|x| x / length).collect(),
        Err(_) => vec![0.0, 1.0],
    };
    let halves = ends
        .windows(2)
        .flat_map(|pair| [f64::midpoint(pair[0], pair[1]), pair[1]]);
    let mut line = vec![from];
    line.extend(halves.map(|share| blend(from, to, share)));
    line
}

fn blend(from: [f64; 2], to: [f64; 2], share: f64) -> [f64; 2] {
    if share == 1.0 {
        return to;
    }
    [0, 1].map(|d| from[d] + share * (to[d] - from[d]))
}
