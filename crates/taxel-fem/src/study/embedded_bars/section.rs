//! The field's mesh round a deformed layer.
//!
//! Around the layer, whose cells stay as they lie, triangles fill what is above and beside it
//! and what is below the plane of its base, however far the side face overhangs or the top folds
//! beside the probe ([`crate::mesh::polygon`]). They share the nodes of the outline. Beyond a box
//! the mesh is blended into a circle, outside of which all space is mapped inside
//! ([`crate::field::exterior`]).

use super::{BarCapacitance, Media};
use crate::field::FieldError;
use crate::field::electrostatics::{Electrostatics, Infinity, VACUUM_PERMITTIVITY};
use crate::field::exterior::{Ball, Exterior, Shell, add_exterior, surround};
use crate::field::laplace::{Coefficient, Domain, Geometry, Motion};
use crate::mesh::{Axis, CellShape, Grading, Growth, Mesh, polygon};
use crate::study::layer::{Layer, SideFace};
use std::collections::{BTreeMap, HashMap};

/// The deformed half section in unbounded space.
#[derive(Clone, Debug)]
pub struct Section {
    /// Regions `layer`, `bar`, `above`, `below` and their images.
    pub mesh: Mesh,
    exterior: Exterior,
}

/// Half the side of the box over the extent of the layer.
const BOX: f64 = 1.6;
/// Cells along each side of the box.
const BOX_CELLS: usize = 8;
/// Radius of the circle over half the side of the box.
const CIRCLE: f64 = 1.7;
/// Layers of cells from box to circle, and in its image.
const SHELL_LAYERS: usize = 4;
/// How far the middle of a curved edge may be from the straight one, over its length and over
/// the height of the triangles beside it: at a quarter the map of a cell loses its volume.
const BEND: f64 = 0.2;
/// Cosine below which a line turns back.
const TURNED_BACK: f64 = -0.9;
/// Growth of cells from the layer outward.
const GROWTH: f64 = 1.5;

impl Section {
    /// The section of a layer whose nodes have moved so.
    ///
    /// # Errors
    /// [`FieldError::Folded`] when the outline of the layer crosses itself.
    pub(super) fn new(
        solid: &Mesh,
        displacement: &[[f64; 3]],
        layer: &Layer,
    ) -> Result<Self, FieldError> {
        let mut places: Vec<[f64; 2]> = solid
            .points
            .iter()
            .zip(displacement)
            .map(|(x, u)| [x[0] + u[0], x[1] + u[1]])
            .collect();
        let line = |name: &str, by: usize| -> Vec<u32> {
            let mut nodes = solid.nodes_of(name).unwrap_or_default();
            let key = |node: u32| solid.points[node as usize][by];
            nodes.sort_by(|&a, &b| key(a).total_cmp(&key(b)));
            nodes
        };
        let (top, bottom, side) = (line("top", 0), line("bottom", 0), line("right", 1));
        if layer.side == SideFace::OnBase {
            lay_down(&mut places, &side, 2.0 * OVERLAP * layer.thickness);
        }
        let cut = cut_at(solid, &bottom, layer);
        let kept = |node: u32| solid.points[node as usize][0] <= cut;
        let mut sewn = Sewn::default();
        for cell in 0..solid.cell_count() {
            let nodes = solid.cell(cell);
            if nodes.iter().all(|&node| kept(node)) {
                let region = &solid.regions[solid.region_of(cell)];
                sewn.cell(CellShape::Quad9, region, &at(&places, nodes));
            }
        }
        let mut across = named(solid, &|p| p[0] == cut);
        across
            .sort_by(|&a, &b| solid.points[a as usize][1].total_cmp(&solid.points[b as usize][1]));
        let parted = |line: &[u32]| {
            let count = line.iter().filter(|&&node| kept(node)).count();
            [at(&places, &line[..count]), at(&places, &line[count - 1..])]
        };
        let [top, far_top] = parted(&top);
        let [bottom, far_bottom] = parted(&bottom);
        let mut far = unfolded(&joined(&[
            far_bottom,
            at(&places, &side),
            reversed(&far_top),
        ]));
        let outline = Outline {
            foot: foot_of(&mut far),
            far,
            top,
            bottom,
            across: at(&places, &across),
        };
        let extent = places
            .iter()
            .fold(0.0_f64, |most, at| most.max(at[0].max(at[1].abs())));
        let size = BOX * extent;
        let base = sewn.surround(&outline, size)?;
        let mut mesh = sewn.mesh;
        mesh.name_boundary("box", |p| p[0] == size || p[1].abs() == size);
        let ball = Ball {
            centre: [0.0; 3],
            radius: CIRCLE * size,
        };
        let shell = Shell {
            ball,
            layers: SHELL_LAYERS,
            growth: 1.0,
            region: None,
        };
        surround(&mut mesh, "box", shell, "ball")?;
        let exterior = add_exterior(&mut mesh, "ball", ball, SHELL_LAYERS)?;
        // Beyond the box the plane of the base is where the second number is zero.
        let mut plane = named(&mesh, &|p| p[0] > size && p[1] == 0.0);
        plane.extend(base);
        let sets = BTreeMap::from([
            ("odd".to_owned(), named(&mesh, &|p| p[0] == 0.0)),
            ("base".to_owned(), plane),
        ]);
        mesh.node_sets = sets;
        Ok(Self { mesh, exterior })
    }

    /// Capacitances among these media.
    ///
    /// # Errors
    /// [`FieldError`]: permittivities that are not positive, cells turned inside out.
    pub fn solve(&self, media: Media) -> Result<BarCapacitance, FieldError> {
        self.solve_moved(media, Motion::None)
    }

    /// The same on a mesh that moves, or pulled back.
    ///
    /// # Errors
    /// As [`Section::solve`].
    pub fn solve_moved(&self, media: Media, motion: Motion) -> Result<BarCapacitance, FieldError> {
        let permittivities = [
            ("layer", media.layer),
            ("above", media.above),
            ("below", media.below.unwrap_or(media.above)),
        ]
        .map(|(name, value)| (name, Coefficient::Scalar(value)));
        let with = |zero: &[&str]| -> Result<f64, FieldError> {
            let found = Electrostatics {
                domain: Domain {
                    mesh: &self.mesh,
                    geometry: Geometry::Plane,
                    motion,
                    exterior: Some(&self.exterior),
                },
                permittivities: &permittivities,
                conductors: &["bar"],
                floating: &[],
                zero,
                infinity: Infinity::Free,
            }
            .capacitance()?;
            Ok(found.matrix[0][0] / VACUUM_PERMITTIVITY)
        };
        // Half of the section carries one bar, at half the voltage.
        if media.below.is_some() {
            let differential = with(&["odd"])? / 2.0;
            return Ok(BarCapacitance {
                differential,
                mutual: differential,
            });
        }
        // The field below a base at zero is empty.
        let differential = with(&["odd", "base"])? / 2.0;
        let to_base = with(&["base"])?;
        Ok(BarCapacitance {
            differential,
            mutual: differential - to_base / 2.0,
        })
    }
}

/// Overlap below which the side face counts as lying on the base, over the thickness.
const OVERLAP: f64 = 1e-3;

/// Puts the part of the side face that touches the base onto it.
fn lay_down(places: &mut [[f64; 2]], side: &[u32], near: f64) {
    let height = |places: &[[f64; 2]], k: usize| places[side[k] as usize][1];
    let mut lying = 0;
    for k in (2..side.len()).step_by(2) {
        if height(places, k) < near {
            lying = k;
        }
    }
    for &node in &side[..=lying] {
        places[node as usize][1] = 0.0;
    }
    // The edge that rises from the base must rise all along: its middle lies at least
    // at a quarter of its end.
    if let Some(&end) = side.get(lying + 2) {
        let least = 0.26 * places[end as usize][1];
        let middle = &mut places[side[lying + 1] as usize][1];
        *middle = middle.max(least);
    }
}

/// Up to where along the layer at rest its cells carry the field: to a line of the mesh at a
/// quarter of the way from the bar to the end of the load, where cells fold, or to the bar itself.
fn cut_at(solid: &Mesh, bottom: &[u32], layer: &Layer) -> f64 {
    let bar = layer.bar.map_or(0.0, |bar| bar.inner + bar.width);
    let quarter = 0.75 * bar + 0.25 * layer.loaded;
    let corners = bottom
        .iter()
        .step_by(2)
        .map(|&node| solid.points[node as usize][0]);
    let near = 1e-9 * layer.loaded;
    corners
        .filter(|x| (bar - near..layer.loaded - near).contains(x))
        .min_by(|a, b| (a - quarter).abs().total_cmp(&(b - quarter).abs()))
        .unwrap_or(bar)
}

/// A line without the corners at which it turns back on itself: at the edge of a probe and at
/// the foot of a side face the outline folds within the size of a cell.
fn unfolded(line: &[Node]) -> Vec<Node> {
    let mut kept: Vec<Node> = vec![line[0]];
    for pair in line[1..].chunks_exact(2) {
        let (mut middle, next) = (pair[0], pair[1]);
        while let [.., before, _, last] = kept[..]
            && turns_back(before, last, next)
        {
            kept.truncate(kept.len() - 2);
            middle = between(before, next);
        }
        kept.extend([middle, next]);
    }
    kept
}

fn turns_back(a: Node, b: Node, c: Node) -> bool {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
    u[0] * v[0] + u[1] * v[1] < TURNED_BACK * u[0].hypot(u[1]) * v[0].hypot(v[1])
}

/// The corner of a line where it comes up through the plane of the base for the last time: what
/// passes below that plane displaces what is there. The nearest corner is moved to the crossing.
fn foot_of(line: &mut [Node]) -> usize {
    let below = (0..line.len())
        .step_by(2)
        .rev()
        .find(|&k| line[k][1] <= 0.0);
    let below = below.unwrap_or_default();
    let above = (below + 2).min(line.len() - 1);
    let (low, high) = (line[below], line[above]);
    if low[1] == 0.0 || high[1] <= 0.0 {
        return below;
    }
    let share = -low[1] / (high[1] - low[1]);
    let foot = if share < 0.5 { below } else { above };
    line[foot] = [low[0] + share * (high[0] - low[0]), 0.0];
    for middle in [foot - 1, foot + 1] {
        line[middle] = between(line[middle - 1], line[middle + 1]);
    }
    foot
}

/// Place of a node.
type Node = [f64; 2];

/// Lines of nodes round the layer, corners and middles of edges by turns.
struct Outline {
    /// Of the cells that are kept, left to right.
    top: Vec<Node>,
    bottom: Vec<Node>,
    /// Where these cells end, upwards.
    across: Vec<Node>,
    /// From there on: below, up the side face, and back above.
    far: Vec<Node>,
    /// Number of the node on it where the layer leaves the plane of its base.
    foot: usize,
}

/// A part to be filled: region and closed line that runs round it in the positive sense.
type Part = (&'static str, Vec<Node>);

/// A plane mesh sewn together from parts that share the digits of their places.
#[derive(Default)]
struct Sewn {
    mesh: Mesh,
    known: HashMap<[u64; 2], u32>,
}

impl Sewn {
    fn cell(&mut self, shape: CellShape, region: &str, at: &[[f64; 2]]) {
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
    fn surround(&mut self, outline: &Outline, size: f64) -> Result<Vec<u32>, FieldError> {
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
    fn of(&self, edge: [Node; 2], sewn: &Sewn) -> Node {
        let straight = between(edge[0], edge[1]);
        let Some(&Middle { place, room }) = self.0.get(&Self::key(edge)) else {
            return straight;
        };
        let off = distance(place, straight);
        if off <= room || sewn.known.contains_key(&key(place)) {
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

fn between(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])]
}

fn reversed(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    line.iter().rev().copied().collect()
}

/// One line from lines that each begin where the last one ends.
fn joined(lines: &[Vec<Node>]) -> Vec<Node> {
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

/// Places of some nodes.
fn at(places: &[Node], nodes: &[u32]) -> Vec<Node> {
    nodes.iter().map(|&node| places[node as usize]).collect()
}

/// Nodes whose places satisfy a condition.
fn named(mesh: &Mesh, condition: &dyn Fn([f64; 3]) -> bool) -> Vec<u32> {
    (0..mesh.points.len() as u32)
        .filter(|&node| condition(mesh.points[node as usize]))
        .collect()
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
