//! Surfaces that touch each other: which facets meet, and their place in the matrix.

use std::collections::{BTreeMap, BTreeSet};
use taxel_numerics::dense::dot3;

use super::dofs::Unknowns;
use super::foot::{Foot, directions, foot, frame, inverse, middle_of, minus, seen};
use super::overlap::{of_facet, of_line};
use super::points::{ContactPoint, each_point_of};
use crate::mesh::{Facet, FacetShape, Mesh};
use crate::problem::contact::Anchor;
use crate::problem::load::FacetTable;
use crate::problem::{Pairing, Problem, ProblemError, SurfacePair, WallPoint, Walls};

/// Cosine between the normals of two facets above which they do not face each other.
const FACING: f64 = -0.1;
/// Way beside a facet over the distance from it up to which a point belongs to it: the edges of
/// facets are kinks.
const BESIDE: f64 = 0.5;
/// The same for a point on the surface, over the side of the facet.
const AT_EDGE: f64 = 1e-6;
/// Facets whose boxes are nearest to a point that are looked at.
const LOOKED_AT: usize = 12;

/// A pair of surfaces with what is made of it once.
pub(super) struct PairTables {
    /// Points of integration of each facet of the first surface.
    pub(super) tables: Vec<FacetTable>,
    /// Nodes of each facet.
    first: Vec<Vec<u32>>,
    pub(super) second: Vec<Vec<u32>>,
    shapes: Vec<FacetShape>,
    /// Facets of the second surface that share a node with each facet of the first and do not face
    /// it before the body is loaded: they never touch.
    adjacent: Vec<Vec<usize>>,
    /// The same for each facet of the second, with itself.
    around: Vec<Vec<usize>>,
    /// Share of its area that a point stands for.
    pub(super) share: f64,
    /// Contact stiffness over the square of a multiplier, 1/(Pa m).
    pub(super) hardening: f64,
    side: f64,
    reach: f64,
    /// Pairs of facets that the matrix has a place for, with that place.
    covered: BTreeMap<(usize, usize), Vec<u32>>,
}

fn nodes_of(mesh: &Mesh, surface: &[Facet]) -> Vec<Vec<u32>> {
    let nodes = surface
        .iter()
        .map(|&facet| mesh.facet_nodes(facet).collect());
    nodes.collect()
}

/// For each facet of one surface the facets of another that share a node with it.
fn sharing(one: &[Vec<u32>], other: &[Vec<u32>]) -> Vec<Vec<usize>> {
    let mut holders = BTreeMap::<u32, Vec<usize>>::new();
    for (facet, nodes) in other.iter().enumerate() {
        for &node in nodes {
            holders.entry(node).or_default().push(facet);
        }
    }
    let around = one.iter().map(|nodes| {
        let all = nodes.iter().filter_map(|node| holders.get(node)).flatten();
        let all: BTreeSet<usize> = all.copied().collect();
        all.into_iter().collect()
    });
    around.collect()
}

/// True if all corners lie on one side of a box of this half width round a place.
fn apart(corners: &[[f64; 3]], middle: [f64; 3], half: f64) -> bool {
    (0..3).any(|d| {
        corners.iter().all(|x| x[d] < middle[d] - half)
            || corners.iter().all(|x| x[d] > middle[d] + half)
    })
}

impl PairTables {
    pub(super) fn new(mesh: &Mesh, pair: &SurfacePair, hardening: f64) -> Self {
        let (first, second) = (nodes_of(mesh, &pair.first), nodes_of(mesh, &pair.second));
        let shape = |facet: &Facet| mesh.shape(facet.cell as usize).facet_shape();
        let mut tables = Self {
            tables: Vec::new(),
            adjacent: sharing(&first, &second),
            around: sharing(&second, &second),
            first,
            second,
            shapes: pair.second.iter().map(shape).collect(),
            share: if pair.meets_itself() { 0.5 } else { 1.0 },
            hardening,
            side: mesh.mean_side(&pair.second),
            reach: pair.reach,
            covered: BTreeMap::new(),
        };
        let each = pair.first.iter().enumerate();
        let facing = |nodes: &[u32], shape: FacetShape| {
            let nodes = Self::places(nodes, &mesh.points);
            frame(shape, &shape.shapes(middle_of(shape)), &nodes).2
        };
        for (number, facet) in pair.first.iter().enumerate() {
            let own = facing(&tables.first[number], shape(facet));
            tables.adjacent[number].retain(|&other| {
                let nodes = &tables.second[other];
                dot3(own, facing(nodes, tables.shapes[other])) > FACING
            });
        }
        tables.tables = each
            .map(|(number, facet)| tables.table(mesh, number, shape(facet)))
            .collect();
        tables
    }

    /// Points of integration of a facet, between the ends of those that it faces within a side
    /// before the body is loaded.
    fn table(&self, mesh: &Mesh, number: usize, shape: FacetShape) -> FacetTable {
        let own = Self::places(&self.first[number], &mesh.points);
        let middle = middle_of(shape);
        let (origin, tangents, normal) = frame(shape, &shape.shapes(middle), &own);
        let reach = self.reach.min(self.side);
        let size = own.iter().fold(0.0, |most: f64, &x| {
            let from = minus(x, origin);
            most.max(dot3(from, from))
        });
        let mut outlines = Vec::new();
        for (other, nodes) in self.second.iter().enumerate() {
            if self.adjacent[number].contains(&other) {
                continue;
            }
            let nodes = Self::places(nodes, &mesh.points);
            let corners = &nodes[..self.shapes[other].corner_count()];
            // No corner, and not the whole facet, is far.
            let far = |x: &[f64; 3]| dot3(minus(*x, origin), normal).abs() > reach;
            let own_shape = self.shapes[other];
            let (_, _, facing) = frame(own_shape, &own_shape.shapes(middle_of(own_shape)), &nodes);
            if corners.iter().any(far)
                || dot3(facing, normal) > FACING
                || apart(corners, origin, size.sqrt() + reach)
            {
                continue;
            }
            // In the reference coordinates of a flat facet.
            let metric: [[f64; 2]; 2] =
                std::array::from_fn(|k| std::array::from_fn(|l| dot3(tangents[k], tangents[l])));
            let Some(inverse) = inverse(metric, directions(shape)) else {
                continue;
            };
            let outline = corners.iter().map(|&x| {
                let from = minus(x, origin);
                let along = [dot3(from, tangents[0]), dot3(from, tangents[1])];
                std::array::from_fn(|k| {
                    middle[k] + inverse[k][0] * along[0] + inverse[k][1] * along[1]
                })
            });
            let outline: Vec<[f64; 2]> = outline.collect();
            outlines.push(outline);
        }
        let points = if shape == FacetShape::Line3 {
            let cuts: Vec<f64> = outlines.iter().flatten().map(|x| x[0]).collect();
            of_line(&cuts)
        } else {
            of_facet(shape, &outlines)
        };
        FacetTable::at(shape, points)
    }

    fn places(nodes: &[u32], places: &[[f64; 3]]) -> Vec<[f64; 3]> {
        nodes.iter().map(|&node| places[node as usize]).collect()
    }

    /// Nodes of the first facet of a pair, then those that only the second has.
    pub(super) fn nodes(&self, (one, other): (usize, usize)) -> Vec<u32> {
        let mut nodes = self.first[one].clone();
        let own = |node: &&u32| !self.first[one].contains(node);
        nodes.extend(self.second[other].iter().filter(own));
        nodes
    }

    /// For each node of [`Self::nodes`] its number in the first facet and in the second.
    pub(super) fn numbers(&self, (one, other): (usize, usize)) -> Vec<[Option<usize>; 2]> {
        let within = |nodes: &[u32], node: u32| nodes.iter().position(|&known| known == node);
        let nodes = self.nodes((one, other)).into_iter();
        let numbers = nodes.map(|node| {
            [
                within(&self.first[one], node),
                within(&self.second[other], node),
            ]
        });
        numbers.collect()
    }

    /// Places of a pair of facets in the matrix; none if it has none for them.
    pub(super) fn places_of(&self, pair: (usize, usize)) -> Option<&[u32]> {
        self.covered.get(&pair).map(Vec::as_slice)
    }

    /// Where a point of the second surface is, by its facet and reference coordinates, and the
    /// shape functions of the facet there.
    pub(super) fn place_on(
        &self,
        facet: usize,
        at: [f64; 3],
        places: &[[f64; 3]],
    ) -> ([f64; 3], Vec<f64>) {
        let nodes = Self::places(&self.second[facet], places);
        let shapes = self.shapes[facet].shapes(at);
        (frame(self.shapes[facet], &shapes, &nodes).0, shapes.values)
    }

    /// The anchor of a point that would rest at a place near its foot on the surface: ahead of the
    /// place along the normal of the point, so that it leaves the friction as it is; on the facet of
    /// the foot where that reaches, else on a facet beside it.
    pub(super) fn anchor_at(
        &self,
        (foot_at, facet): (&Foot, usize),
        rest: ([f64; 3], [f64; 3]),
        places: &[[f64; 3]],
    ) -> Anchor {
        let mut best: Option<(f64, usize, [f64; 3])> = None;
        for &other in &self.around[facet] {
            let nodes = Self::places(&self.second[other], places);
            let Some(found) = seen(self.shapes[other], &nodes, rest) else {
                continue;
            };
            if best.is_none_or(|(least, ..)| found.overshoot < least) {
                best = Some((found.overshoot, other, found.at));
            }
        }
        let (facet, at) = best.map_or((facet, foot_at.at), |(_, facet, at)| (facet, at));
        Anchor {
            place: at,
            facet: Some(facet as u32),
        }
    }

    /// Nodes of a facet of the second surface.
    pub(super) fn second_nodes(&self, facet: usize) -> &[u32] {
        &self.second[facet]
    }

    /// Takes these pairs of facets as those that the matrix has a place for.
    pub(super) fn cover(&mut self, pairs: &BTreeSet<(usize, usize)>, unknowns: &Unknowns) {
        let places = pairs
            .iter()
            .map(|&pair| (pair, unknowns.places(&self.nodes(pair))));
        self.covered = places.collect();
    }

    /// Adds the pairs of facets that may meet soon when a point is over `facet`.
    pub(super) fn add_near(&self, one: usize, facet: usize, pairs: &mut BTreeSet<(usize, usize)>) {
        let own = |other: &&usize| !self.adjacent[one].contains(other);
        let near = self.around[facet].iter().filter(own);
        pairs.extend(near.map(|&other| (one, other)));
    }

    /// Distance up to which the facets that a point is over get a place in the matrix.
    pub(super) fn near(&self) -> f64 {
        0.5 * self.side
    }
}

/// The second surface of a pair in a state.
pub(super) struct Search<'t> {
    tables: &'t PairTables,
    places: &'t [[f64; 3]],
    boxes: Vec<[[f64; 3]; 2]>,
    near: Vec<(f64, usize)>,
}

/// Where a point is found on a facet of this shape and these places of nodes.
type FootOn<'a> = dyn Fn(FacetShape, &[[f64; 3]]) -> Option<Foot> + 'a;

impl<'t> Search<'t> {
    pub(super) fn new(tables: &'t PairTables, places: &'t [[f64; 3]]) -> Self {
        let boxes = tables.second.iter().map(|nodes| {
            let mut ends = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
            for &node in nodes {
                for d in 0..3 {
                    let x = places[node as usize][d];
                    ends[0][d] = ends[0][d].min(x);
                    ends[1][d] = ends[1][d].max(x);
                }
            }
            ends
        });
        Self {
            tables,
            places,
            boxes: boxes.collect(),
            near: Vec::new(),
        }
    }

    /// The facet of the second surface that a point of the first looks at along the normal of its
    /// own surface, ahead or, where it is inside, behind it; none within reach. The distance
    /// changes steadily as the point moves from one facet to the next, and the direction does not
    /// change at all.
    pub(super) fn ahead(&mut self, point: &ContactPoint<'_>) -> Option<(usize, Foot)> {
        let (_, facing) = point.frame(self.places);
        let line = (point.place, facing);
        let on = |shape, nodes: &[[f64; 3]]| seen(shape, nodes, line);
        // Facets join each other: a line that meets the surface meets one.
        self.best((point.facet, line), 0.0, &on)
    }

    /// The facet of the second surface that a point of the first is over or in, with the foot of
    /// the point on it; none within reach.
    pub(super) fn nearest(&mut self, point: &ContactPoint<'_>) -> Option<(usize, Foot)> {
        let (_, facing) = point.frame(self.places);
        let on = |shape, nodes: &[[f64; 3]]| foot(shape, nodes, point.place);
        self.best((point.facet, (point.place, facing)), BESIDE, &on)
    }

    /// The nearest facet on which a point of a facet is found, up to `beside` of its distance
    /// beside it.
    fn best(
        &mut self,
        (own, (place, facing)): (usize, ([f64; 3], [f64; 3])),
        beside: f64,
        on: &FootOn<'_>,
    ) -> Option<(usize, Foot)> {
        let Self {
            tables,
            places,
            boxes,
            near,
        } = self;
        near.clear();
        for (facet, [low, high]) in boxes.iter().enumerate() {
            let mut square = 0.0;
            for d in 0..3 {
                let beside = (low[d] - place[d]).max(place[d] - high[d]).max(0.0);
                square += beside * beside;
            }
            if square <= tables.reach * tables.reach && !tables.adjacent[own].contains(&facet) {
                near.push((square, facet));
            }
        }
        if near.is_empty() {
            return None;
        }
        if near.len() > LOOKED_AT {
            near.select_nth_unstable_by(LOOKED_AT, |a, b| a.0.total_cmp(&b.0));
            near.truncate(LOOKED_AT);
        }
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut best: Option<(usize, Foot)> = None;
        let mut nodes = Vec::new();
        for &(square, facet) in near.iter() {
            let nearest = best.as_ref().map(|(_, foot)| foot.from_facet);
            if nearest.is_some_and(|nearest| square.sqrt() > nearest * (1.0 + 1e-9)) {
                break;
            }
            nodes.clear();
            nodes.extend(
                tables.second[facet]
                    .iter()
                    .map(|&node| places[node as usize]),
            );
            let Some(foot) = on(tables.shapes[facet], &nodes) else {
                continue;
            };
            let beside = beside * foot.distance.abs() + AT_EDGE * tables.side;
            if foot.overshoot > beside
                || foot.distance.abs() > tables.reach
                || dot3(foot.normal, facing) > FACING
            {
                continue;
            }
            // On the way round an edge both facets are as near: the greater distance belongs to
            // both sides of it.
            let better = best.as_ref().is_none_or(|(_, known)| {
                let difference = foot.from_facet - known.from_facet;
                let same = 1e-9 * (known.from_facet + AT_EDGE * tables.side);
                difference < -same
                    || (difference <= same && foot.distance.abs() > known.distance.abs())
            });
            if better {
                best = Some((facet, foot));
            }
        }
        best
    }
}

/// Stiffness of a tie over the shear modulus and the mean side of a facet.
const TIED: f64 = 1000.0;
/// Distance over that side within which surfaces are tied.
const TIED_WITHIN: f64 = 0.1;
/// Separation that is accepted, over that side.
const TIED_TO: f64 = 1e-6;

/// Ties a surface to another one whose mesh does not match: every point of integration of the
/// first keeps its distance from the place of the second that it lies on in the undeformed body,
/// within 0.1 of the mean side of a facet. An even stress passes through flat ties as if the
/// mesh went on. Name the finer or softer surface first; `shear_modulus` (Pa) is that of the
/// stiffer body. The separation that is accepted is 1e-6 of the side.
///
/// # Errors
/// When a part of the first surface lies on nothing.
pub fn tie(
    problem: &Problem,
    surfaces: [Vec<Facet>; 2],
    shear_modulus: f64,
) -> Result<Walls, ProblemError> {
    let mesh = &problem.mesh;
    let [first, second] = surfaces;
    let side = mesh.mean_side(&first);
    let reach = TIED_WITHIN * side;
    let pair = SurfacePair {
        reach,
        ..SurfacePair::new(mesh, [first, second], shear_modulus)
    };
    let tables = PairTables::new(mesh, &pair, 0.0);
    let mut search = Search::new(&tables, &mesh.points);
    let mut points = Vec::new();
    let mut lost = None;
    let table_of = |facet, _| &tables.tables[facet];
    let at_rest = (&table_of as &dyn Fn(_, _) -> _, mesh.points.as_slice());
    each_point_of(problem, &pair.first, at_rest, &mut |point| {
        let Some((facet, foot)) = search.nearest(point) else {
            lost.get_or_insert(point.place);
            return;
        };
        let carried = |nodes: &[u32], values: &[f64]| -> Vec<(u32, f64, f64)> {
            let pairs = nodes.iter().zip(values);
            pairs.map(|(&node, &value)| (node, value, 0.0)).collect()
        };
        let own = carried(point.nodes, point.values);
        let other = carried(&tables.second[facet], &foot.shapes.values);
        for d in 0..problem.kinematics.components() {
            let along = std::array::from_fn(|k| f64::from(u8::from(k == d)));
            let pairing = Pairing::Bound {
                along,
                rest: -foot.distance * foot.normal[d],
            };
            points.push(WallPoint::new(&own, &other, point.area, pairing));
        }
    });
    match lost {
        Some(place) => Err(ProblemError::NotTied { place, reach }),
        None => Ok(Walls {
            points,
            stiffness: TIED * shear_modulus / side,
            overlap_limit: TIED_TO * side,
        }),
    }
}

impl PairTables {
    /// Greatest way of a node of the surfaces between two states, m.
    pub(super) fn greatest_way(&self, before: &[[f64; 3]], after: &[[f64; 3]]) -> f64 {
        let nodes = self.first.iter().chain(&self.second).flatten();
        nodes.fold(0.0, |most: f64, &node| {
            let way = minus(after[node as usize], before[node as usize]);
            most.max(dot3(way, way).sqrt())
        })
    }
}
