//! Parts of a mesh that come together where they have no common nodes: cells that fill the same
//! place, and sides of cells that lie on each other.

use std::collections::HashMap;

use taxel_numerics::dense::{cross, dot3 as dot};

use super::boxes::{bounds, pairs};
use super::{Facet, Mesh};

/// Places are one within this share of the size of the mesh: what is left of coordinates that were
/// written with seven digits.
pub const SAME_PLACE: f64 = 1e-6;

/// Cosine of the greatest turn between two sides of one arc, that of a hexagon: sides that turn by
/// more meet in a corner.
const ARC: f64 = 0.5;

/// Cells that fill the same place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// The two that are deepest in each other.
    pub cells: [u32; 2],
    /// In the middle of what they have in common, in the unit of the mesh.
    pub place: [f64; 3],
    /// How far one has to be moved to be out of the other, in the unit of the mesh.
    pub depth: f64,
    /// Number of pairs of cells.
    pub pairs: usize,
}

/// Cells that fill the same place by more than their sides are curved; pairs for which `apart` is
/// true, as where a contact keeps them apart, are left out.
pub fn overlap(mesh: &Mesh, apart: impl Fn([u32; 2]) -> bool) -> Option<Overlap> {
    let hulls: Vec<Hull> = (0..mesh.cell_count())
        .map(|cell| Hull::of(mesh, cell))
        .collect();
    let boxes: Vec<_> = hulls
        .iter()
        .map(|hull| bounds(hull.points.iter().copied()))
        .collect();
    let same = SAME_PLACE * mesh.size();
    let mut deepest: Option<Overlap> = None;
    let mut count = 0;
    let mut add = |cells: [u32; 2], depth: f64| {
        let [a, b] = cells.map(|cell| boxes[cell as usize]);
        if apart(cells) {
            return;
        }
        count += 1;
        if deepest.is_none_or(|known| depth > known.depth) {
            let middle = |d: usize| f64::midpoint(a[0][d].max(b[0][d]), a[1][d].min(b[1][d]));
            deepest = Some(Overlap {
                cells,
                place: [middle(0), middle(1), middle(2)],
                depth,
                pairs: 0,
            });
        }
    };
    let beside = on_one_side(mesh);
    pairs(&boxes, |one, other| {
        let [a, b] = [one, other].map(|cell| &hulls[cell]);
        let least = a.bulge + b.bulge + same;
        if let Some(depth) = a.depth_in(b, least) {
            add([one as u32, other as u32], depth);
        }
    });
    for (cells, side) in beside {
        // Curved as they may be, they have a side in common and lie on one side of it.
        add(cells, side);
    }
    deepest.map(|overlap| Overlap {
        pairs: count,
        ..overlap
    })
}

/// Pairs of cells on one side of a facet with common corners, with the length of its first side.
fn on_one_side(mesh: &Mesh) -> Vec<([u32; 2], f64)> {
    let mut known: HashMap<(Vec<u32>, bool), u32> = HashMap::new();
    let mut found = Vec::new();
    for cell in 0..mesh.cell_count() as u32 {
        let shape = mesh.shape(cell as usize);
        for side in 0..shape.sides().len() as u8 {
            let nodes = mesh.facet_nodes(Facet { cell, side });
            let mut corners: Vec<u32> = nodes.take(shape.facet_shape().corner_count()).collect();
            let first = (0..corners.len()).min_by_key(|&k| corners[k]).unwrap_or(0);
            corners.rotate_left(first);
            // Seen from outside, neighbours run round their common side in opposite directions.
            let forward = corners.get(1) < corners.last() || corners.len() == 2 && first == 0;
            let [a, b] = [0, 1].map(|k| mesh.points[corners[k] as usize]);
            let length = norm(minus(a, b));
            corners.sort_unstable();
            if let Some(other) = known.insert((corners, forward), cell) {
                found.push(([other, cell], length));
            }
        }
    }
    found
}

/// Facets of the boundary that lie on each other, face to face, without common nodes there: each
/// pair once. What two curved sides, or the sides of an arc that is drawn straight, leave between
/// them counts as nothing.
pub fn abutting(mesh: &Mesh, boundary: &[Facet]) -> Vec<[Facet; 2]> {
    let sides: Vec<Side> = boundary
        .iter()
        .map(|&facet| Side::of(mesh, facet))
        .collect();
    let same = SAME_PLACE * mesh.size();
    let sags = sags(&sides);
    let boxes: Vec<_> = sides
        .iter()
        .zip(&sags)
        .map(|(side, sag)| {
            let [low, high] = bounds(side.corners.iter().copied());
            let wide = sag + same;
            [low.map(|x| x - wide), high.map(|x| x + wide)]
        })
        .collect();
    let mut found = Vec::new();
    pairs(&boxes, |one, other| {
        let between = sags[one] + sags[other] + same;
        if sides[one].lies_on(&sides[other], between) {
            found.push([boundary[one], boundary[other]]);
        }
    });
    found.sort_unstable();
    found
}

/// Outward unit normal of a facet by its corners; zero of one without area.
pub(super) fn outward(mesh: &Mesh, facet: Facet) -> [f64; 3] {
    unit(Side::of(mesh, facet).normal).unwrap_or_default()
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|d| a[d] - b[d])
}

fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// The unit vector; none of a vector without length.
pub(super) fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = norm(a);
    (length > 0.0).then(|| a.map(|x| x / length))
}

/// Normal of a polygon by Newell's sum, its length twice the area; in the plane that of the line
/// from its first corner to its second, to the right.
fn normal(corners: &[[f64; 3]]) -> [f64; 3] {
    if let &[a, b] = corners {
        return [b[1] - a[1], a[0] - b[0], 0.0];
    }
    let mut sum = [0.0; 3];
    for (k, &a) in corners.iter().enumerate() {
        let part = cross(a, corners[(k + 1) % corners.len()]);
        sum = std::array::from_fn(|d| sum[d] + part[d]);
    }
    sum
}

/// How far the sides of a cell are bent out of what its corners span.
pub(super) fn bulge(mesh: &Mesh, cell: usize) -> f64 {
    Hull::of(mesh, cell).bulge
}

/// A cell by its corners.
struct Hull {
    points: Vec<[f64; 3]>,
    /// Unit normals of its sides.
    normals: Vec<[f64; 3]>,
    /// Directions of its edges; none in the plane, where the normals decide alone.
    edges: Vec<[f64; 3]>,
    /// How far its sides are bent out of what its corners span.
    bulge: f64,
}

impl Hull {
    fn of(mesh: &Mesh, cell: usize) -> Self {
        let shape = mesh.shape(cell);
        let nodes = &mesh.cell(cell)[..shape.corner_count()];
        let mut hull = Self {
            points: nodes
                .iter()
                .map(|&node| mesh.points[node as usize])
                .collect(),
            normals: Vec::new(),
            edges: Vec::new(),
            bulge: 0.0,
        };
        for side in 0..shape.sides().len() as u8 {
            let side = Side::of(
                mesh,
                Facet {
                    cell: cell as u32,
                    side,
                },
            );
            hull.bulge = hull.bulge.max(side.bulge);
            let corners = &side.corners;
            if corners.len() == 4 {
                // A side of four corners that is not flat has a normal on each of its triangles.
                for k in 0..4 {
                    let three = [k, (k + 1) % 4, (k + 2) % 4].map(|k| corners[k]);
                    hull.normals.extend(unit(normal(&three)));
                }
            } else {
                hull.normals.extend(unit(side.normal));
            }
            if corners.len() > 2 {
                for (k, &a) in corners.iter().enumerate() {
                    hull.edges
                        .extend(unit(minus(corners[(k + 1) % corners.len()], a)));
                }
            }
        }
        hull
    }

    /// How deep the two are in each other, if by more than `least`.
    fn depth_in(&self, other: &Self, least: f64) -> Option<f64> {
        let mut depth = f64::INFINITY;
        let mut separate = |axis: [f64; 3]| {
            let reach = |points: &[[f64; 3]]| {
                let along = points.iter().map(|&point| dot(axis, point));
                along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                    [low.min(x), high.max(x)]
                })
            };
            let (a, b) = (reach(&self.points), reach(&other.points));
            depth = depth.min((a[1] - b[0]).min(b[1] - a[0]));
            depth <= least
        };
        if self
            .normals
            .iter()
            .chain(&other.normals)
            .any(|&axis| separate(axis))
        {
            return None;
        }
        for &one in &self.edges {
            for &other in &other.edges {
                // Edges that are parallel have no common normal of their own.
                if unit(cross(one, other)).is_some_and(&mut separate) {
                    return None;
                }
            }
        }
        Some(depth)
    }
}

/// A facet by its corners.
pub(super) struct Side {
    nodes: Vec<u32>,
    pub(super) corners: Vec<[f64; 3]>,
    pub(super) middle: [f64; 3],
    /// Outward; see [`normal`].
    pub(super) normal: [f64; 3],
    /// How far its nodes are off what its corners span.
    bulge: f64,
}

impl Side {
    pub(super) fn of(mesh: &Mesh, facet: Facet) -> Self {
        let all: Vec<u32> = mesh.facet_nodes(facet).collect();
        let place = |node: &u32| mesh.points[*node as usize];
        let count = mesh.shape(facet.cell as usize).facet_shape().corner_count();
        let corners: Vec<[f64; 3]> = all[..count].iter().map(place).collect();
        let middle = std::array::from_fn(|d| {
            corners.iter().map(|corner| corner[d]).sum::<f64>() / count as f64
        });
        let normal = normal(&corners);
        let across = unit(normal).unwrap_or_default();
        let off = all
            .iter()
            .map(|node| dot(across, minus(place(node), middle)).abs());
        Self {
            middle,
            normal,
            bulge: off.fold(0.0, f64::max),
            nodes: all[..count].to_vec(),
            corners,
        }
    }

    fn longest(&self) -> f64 {
        let next = self.corners.iter().cycle().skip(1);
        let lengths = self
            .corners
            .iter()
            .zip(next)
            .map(|(&a, &b)| norm(minus(a, b)));
        lengths.fold(0.0, f64::max)
    }

    /// True if they face each other with no more than `between` anywhere between them, over an area
    /// wider than that.
    fn lies_on(&self, other: &Self, between: f64) -> bool {
        let (Some(own), Some(across)) = (unit(self.normal), unit(other.normal)) else {
            return false;
        };
        if dot(own, across) > -ARC {
            return false;
        }
        let common = self.over(other);
        let near = |place: &[f64; 3]| dot(across, minus(*place, other.middle)).abs() <= between;
        !common.is_empty() && common.iter().all(near) && width(&common, across) > between
    }

    /// Its borders: a point of each, and the direction inward from it. In the plane each end of a line
    /// is a border.
    pub(super) fn inward(&self) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + '_ {
        let count = self.corners.len();
        (0..count).map(move |k| {
            let [a, b] = [k, (k + 1) % count].map(|k| self.corners[k]);
            let along = minus(b, a);
            let inward = if count == 2 {
                along
            } else {
                cross(self.normal, along)
            };
            (a, inward)
        })
    }

    /// The part of this facet that lies over another one.
    fn over(&self, other: &Self) -> Vec<[f64; 3]> {
        let mut part = self.corners.clone();
        for (at, inward) in other.inward() {
            let inside = |place: &[f64; 3]| dot(inward, minus(*place, at));
            let mut kept = Vec::new();
            for (k, place) in part.iter().enumerate() {
                let next = part[(k + 1) % part.len()];
                let [now, then] = [inside(place), inside(&next)];
                if now >= 0.0 {
                    kept.push(*place);
                }
                let last = part.len() == 2 && k == 1;
                if (now >= 0.0) != (then >= 0.0) && !last {
                    let share = now / (now - then);
                    kept.push(std::array::from_fn(|d| {
                        place[d] + share * (next[d] - place[d])
                    }));
                }
            }
            part = kept;
        }
        part
    }
}

/// Width of a polygon: its area over its longest side; in the plane the length of the line.
fn width(corners: &[[f64; 3]], across: [f64; 3]) -> f64 {
    let longest = |corners: &[[f64; 3]]| {
        let next = corners.iter().cycle().skip(1);
        let lengths = corners.iter().zip(next).map(|(&a, &b)| norm(minus(a, b)));
        lengths.fold(0.0, f64::max)
    };
    match corners.len() {
        0 | 1 => 0.0,
        2 => longest(corners),
        _ => {
            // About its first corner, so that the origin may be far away.
            let about: Vec<[f64; 3]> = corners.iter().map(|&c| minus(c, corners[0])).collect();
            0.5 * dot(normal(&about), across).abs() / longest(corners).max(f64::MIN_POSITIVE)
        }
    }
}

/// How far each facet may lie off the surface that it is a part of: its own bulge, or the height of
/// the arc over it as it turns against its neighbours.
fn sags(sides: &[Side]) -> Vec<f64> {
    let mut sags: Vec<f64> = sides.iter().map(|side| side.bulge).collect();
    let mut known: HashMap<Vec<u32>, usize> = HashMap::new();
    for (number, side) in sides.iter().enumerate() {
        let count = side.nodes.len();
        for k in 0..count {
            let mut edge = match count {
                2 => vec![side.nodes[k]],
                _ => vec![side.nodes[k], side.nodes[(k + 1) % count]],
            };
            edge.sort_unstable();
            let Some(other) = known.insert(edge, number) else {
                continue;
            };
            let (Some(a), Some(b)) = (unit(side.normal), unit(sides[other].normal)) else {
                continue;
            };
            let cosine = dot(a, b);
            if cosine > ARC {
                // A chord of length h under an arc that turns by t is h/2 tan(t/4) below it.
                let rise = 0.5 * libm::tan(0.25 * libm::acos(cosine.min(1.0)));
                for one in [number, other] {
                    sags[one] = sags[one].max(rise * sides[one].longest());
                }
            }
        }
    }
    sags
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Axis, Grid2, Grid3};

    fn block([low, high]: [[f64; 3]; 2], counts: [usize; 3]) -> Mesh {
        let axis = |d: usize| Axis::uniform(low[d], high[d], counts[d]).unwrap();
        if counts[2] == 0 {
            return Grid2::new([axis(0), axis(1)], "rubber").mesh().unwrap();
        }
        Grid3::new([axis(0), axis(1), axis(2)], "rubber")
            .mesh()
            .unwrap()
    }

    /// A block of 4 x 4 x 2 and another body, without common nodes.
    fn with(other: &Mesh) -> Mesh {
        let dimension = other.dimension();
        let flat = usize::from(dimension == 3);
        let box_ = block([[0.0; 3], [4.0, 4.0, 2.0]], [4, 3, 2 * flat]);
        Mesh::joined(&[("box", &box_), ("other", other)], |_| false)
    }

    #[test]
    fn what_fills_one_place_is_found_with_its_depth() {
        for flat in [0, 1] {
            for (low, high, counts, depths) in [
                // A post inside whose cells lie askew to the others: no corner of one meets another's.
                ([1.3, 1.4, 0.3], [2.8, 2.9, 1.7], [1, 1, 1], [0.5, 1.5]),
                // Deeper in by a thousandth of a side.
                (
                    [3.999, 0.0, 0.0],
                    [5.0, 4.0, 2.0],
                    [1, 3, 2],
                    [0.999e-3, 1.001e-3],
                ),
                // The same body twice.
                ([0.0, 0.0, 0.0], [4.0, 4.0, 2.0], [4, 3, 2], [0.999, 1.001]),
            ] {
                let other = block([low, high], [counts[0], counts[1], flat * counts[2]]);
                let mesh = with(&other);
                let found = overlap(&mesh, |_| false).unwrap();
                assert_eq!(
                    found.cells.map(|cell| mesh.region_of(cell as usize)),
                    [0, 1]
                );
                assert!((depths[0]..depths[1]).contains(&found.depth), "{found:?}");
                assert!((0..2).all(|d| (low[d]..=high[d]).contains(&found.place[d])));
                assert_eq!(overlap(&mesh, |_| true), None);
            }
        }
    }

    #[test]
    fn bodies_that_touch_or_stay_away_fill_no_place_twice() {
        for flat in [0, 1] {
            for low in [4.0, 4.1, 4.0 - 1e-9] {
                let mesh = with(&block([[low, 1.0, 0.5], [6.0, 5.0, 3.0]], [2, 5, 3 * flat]));
                assert_eq!(overlap(&mesh, |_| false), None);
            }
        }
    }

    #[test]
    fn cells_on_one_side_of_common_nodes_fill_one_place() {
        let mut mesh = block([[0.0; 3], [2.0, 1.0, 0.0]], [2, 1, 0]);
        assert_eq!(overlap(&mesh, |_| false), None);
        let nodes = mesh.cell(1).to_vec();
        mesh.add_cell(mesh.shape(1), 0, &nodes);
        assert_eq!(overlap(&mesh, |_| false).unwrap().cells, [1, 2]);
    }

    #[test]
    fn sides_that_lie_on_each_other_are_found_whatever_their_meshes() {
        for flat in [0, 1] {
            for (low, high, expected) in [
                // As wide, narrower, shifted, by a corner only, apart.
                (0.0, 4.0, true),
                (1.3, 2.7, true),
                (2.0, 6.0, true),
                (4.0, 8.0, false),
            ] {
                for gap in [0.0, 1e-3] {
                    let other = block([[4.0 + gap, low, 0.0], [6.0, high, 2.0]], [2, 5, 3 * flat]);
                    let mesh = with(&other);
                    let found = abutting(&mesh, &mesh.boundary());
                    assert_eq!(
                        !found.is_empty(),
                        expected && gap == 0.0,
                        "{low} {high} {gap}"
                    );
                    for [one, other] in found {
                        assert_eq!(
                            [one, other].map(|f| mesh.region_of(f.cell as usize)),
                            [0, 1]
                        );
                    }
                }
            }
        }
    }

    /// An arc inside another one, each drawn by its own straight sides: between them is what they cut off.
    #[test]
    fn sides_of_arcs_lie_on_each_other() {
        let ring = |radii: [f64; 2], count: usize| {
            let axes = [
                Axis::uniform(radii[0], radii[1], 1),
                Axis::uniform(0.0, 1.0, count),
            ];
            let mut mesh = Grid2::new(axes.map(Result::unwrap), "rubber")
                .mesh()
                .unwrap();
            for point in &mut mesh.points {
                // On the chord, as in a mesh of first order.
                let at = point[1] * count as f64;
                let (sin, cos) = libm::sincos(at.floor() / count as f64);
                let (next_sin, next_cos) = libm::sincos(at.ceil() / count as f64);
                let part = at - at.floor();
                let radius = point[0];
                point[0] = radius * (cos + part * (next_cos - cos));
                point[1] = radius * (sin + part * (next_sin - sin));
            }
            mesh
        };
        for (outer, expected) in [(1.0, true), (1.05, false)] {
            let bodies = [ring([0.5, 1.0], 4), ring([outer, 2.0], 7)];
            let mesh = Mesh::joined(&[("inner", &bodies[0]), ("outer", &bodies[1])], |_| false);
            let found = abutting(&mesh, &mesh.boundary());
            assert_eq!(!found.is_empty(), expected);
        }
    }
}
