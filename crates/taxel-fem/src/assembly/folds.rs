//! Sharp corners about which a surface folds onto itself.

use std::collections::BTreeMap;
use taxel_numerics::dense::dot3;

use super::foot::{Foot, directions, duals, foot, frame, middle_of, minus};
use super::points::{ContactPoint, each_point_of};
use crate::mesh::{Facet, FacetShape, Mesh, Parts};
use crate::problem::load::FacetTable;
use crate::problem::{Pairing, Problem, WallPoint, Walls};

/// Usual stiffness of folding corners over the shear modulus.
pub const FOLDING: f64 = 100.0;
/// Cosines of the angles by which the surface turns at a corner: 30 to 150 degrees.
const TURN: f64 = 0.866;
/// Nodes lie on a plane, facets on one, and points on a facet, within this share of a facet.
const FLAT: f64 = 1e-6;
/// The faces are followed from the corner over this share of the narrower one.
const FOLLOWED: f64 = 0.5;

/// A facet before deformation.
struct Side {
    shape: FacetShape,
    nodes: Vec<u32>,
    places: Vec<[f64; 3]>,
    middle: [f64; 3],
    /// Out of the body.
    normal: [f64; 3],
    /// Greatest distance of a node from the middle.
    size: f64,
}

impl Side {
    fn new(mesh: &Mesh, facet: Facet) -> Self {
        let shape = mesh.shape(facet.cell as usize).facet_shape();
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        let places: Vec<_> = nodes.iter().map(|&n| mesh.points[n as usize]).collect();
        let (middle, _, normal) = frame(shape, &shape.shapes(middle_of(shape)), &places);
        let from = places.iter().map(|&x| minus(x, middle));
        let size = from.fold(0.0_f64, |most, x| most.max(dot3(x, x))).sqrt();
        Self {
            shape,
            nodes,
            places,
            middle,
            normal,
            size,
        }
    }

    /// Distance of a place from its plane, over its size.
    fn above(&self, place: [f64; 3]) -> f64 {
        dot3(minus(place, self.middle), self.normal) / self.size
    }

    fn holds(&self, places: &[[f64; 3]]) -> bool {
        places.iter().all(|&x| self.above(x).abs() < FLAT)
    }

    /// Its edges by their corners; in the plane its two ends.
    fn edges(&self) -> Vec<Vec<u32>> {
        let corners = &self.nodes[..self.shape.corner_count()];
        if corners.len() == 2 {
            return corners.iter().map(|&node| vec![node]).collect();
        }
        let next = corners.iter().cycle().skip(1);
        let edges = corners.iter().zip(next);
        edges.map(|(&a, &b)| vec![a.min(b), a.max(b)]).collect()
    }
}

/// A straight corner between two flat faces of a surface.
struct Corner {
    origin: [f64; 3],
    /// Unit vector along the edge; zero in the plane.
    along: [f64; 3],
    /// Where it lies on the edge, from the origin.
    reaches: Vec<[f64; 2]>,
    /// The faces, by a number of each, and the directions away from the edge in them.
    faces: [u32; 2],
    away: [[f64; 3]; 2],
}

/// The contact of a surface with itself at its sharp corners, where two flat faces meet at an angle
/// and face each other, as at the edges of a rectangular channel: pairs of points at equal
/// distance from the edge, which may not turn past each other about it ([`Pairing::Folding`]).
/// `stiffness` in Pa, usually [`FOLDING`] times the shear modulus. Rounded corners have no pairs, nor have
/// faces that bend.
pub fn folds(problem: &Problem, surface: &[Facet], stiffness: f64) -> Walls {
    let sides: Vec<Side> = surface
        .iter()
        .map(|&facet| Side::new(&problem.mesh, facet))
        .collect();
    let mut points = Vec::new();
    let (corners, face_of) = corners(&problem.mesh, &sides);
    let tables = [FacetShape::Line3, FacetShape::Quad9, FacetShape::Tri7]
        .map(|shape| FacetTable::at(shape, shape.fine_quadrature()));
    let table_of = |_, shape: FacetShape| match shape {
        FacetShape::Line3 => &tables[0],
        FacetShape::Quad9 => &tables[1],
        FacetShape::Tri7 => &tables[2],
    };
    for corner in corners {
        let faces = (surface, sides.as_slice(), face_of.as_slice());
        corner.pair(problem, faces, (&table_of, stiffness), &mut points);
    }
    Walls {
        points,
        stiffness: 0.0,
        overlap_limit: f64::INFINITY,
    }
}

/// The corners of a surface, and the face of each of its facets.
fn corners(mesh: &Mesh, sides: &[Side]) -> (Vec<Corner>, Vec<u32>) {
    let mut beside = BTreeMap::<Vec<u32>, Vec<usize>>::new();
    for (number, side) in sides.iter().enumerate() {
        for edge in side.edges() {
            beside.entry(edge).or_default().push(number);
        }
    }
    let pairs = || beside.iter().filter(|(_, at)| at.len() == 2);
    let mut faces = Parts::apart(sides.len());
    for (_, at) in pairs() {
        let [one, other] = [&sides[at[0]], &sides[at[1]]];
        if one.holds(&one.places) && one.holds(&other.places) {
            faces.join(at[0] as u32, at[1] as u32);
        }
    }
    let face_of: Vec<u32> = (0..sides.len() as u32).map(|k| faces.root(k)).collect();
    let mut found = BTreeMap::<[u32; 2], Corner>::new();
    for (edge, at) in pairs() {
        let [one, other] = [&sides[at[0]], &sides[at[1]]];
        let flat = one.holds(&one.places) && other.holds(&other.places);
        let facing = one.above(other.middle) > 0.0 && other.above(one.middle) > 0.0;
        if !flat || !facing || dot3(one.normal, other.normal).abs() > TURN {
            continue;
        }
        let own = [face_of[at[0]], face_of[at[1]]];
        let (key, [one, other]) = if own[0] < own[1] {
            (own, [one, other])
        } else {
            ([own[1], own[0]], [other, one])
        };
        let ends: Vec<[f64; 3]> = edge.iter().map(|&n| mesh.points[n as usize]).collect();
        let corner = found
            .entry(key)
            .or_insert_with(|| Corner::new(&ends, key, [one, other]));
        let place = |x: [f64; 3]| dot3(minus(x, corner.origin), corner.along);
        let ends = [place(ends[0]), place(ends[ends.len() - 1])];
        corner
            .reaches
            .push([ends[0].min(ends[1]), ends[0].max(ends[1])]);
    }
    (found.into_values().collect(), face_of)
}

impl Corner {
    fn new(ends: &[[f64; 3]], faces: [u32; 2], sides: [&Side; 2]) -> Self {
        let origin = ends[0];
        let along = ends
            .get(1)
            .map_or([0.0; 3], |&end| unit(minus(end, origin)));
        let away = sides.map(|side| {
            let from = minus(side.middle, origin);
            let off = dot3(from, along);
            unit(std::array::from_fn(|d| from[d] - off * along[d]))
        });
        Self {
            origin,
            along,
            reaches: Vec::new(),
            faces,
            away,
        }
    }

    /// Two unit vectors across the edge; in the plane its own axes.
    fn across(&self) -> [[f64; 3]; 2] {
        if self.along == [0.0; 3] {
            return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        }
        let [one, along] = [self.away[0], self.along];
        let other = std::array::from_fn(|d| {
            let [e, f] = [(d + 1) % 3, (d + 2) % 3];
            along[e] * one[f] - along[f] * one[e]
        });
        [one, other]
    }

    /// How far a face goes on from the edge.
    fn extent(&self, face: usize, (sides, face_of): (&[Side], &[u32])) -> f64 {
        let own = sides.iter().zip(face_of);
        let own = own.filter(|(_, number)| **number == self.faces[face]);
        let places = own.flat_map(|(side, _)| &side.places);
        let distances = places.map(|&x| dot3(minus(x, self.origin), self.away[face]));
        distances.fold(0.0, f64::max)
    }

    fn pair<'t>(
        &self,
        problem: &Problem,
        (surface, sides, face_of): (&[Facet], &[Side], &[u32]),
        (table_of, stiffness): (&dyn Fn(usize, FacetShape) -> &'t FacetTable, f64),
        points: &mut Vec<WallPoint>,
    ) {
        let extents = [0, 1].map(|face| self.extent(face, (sides, face_of)));
        let reach = FOLLOWED * extents[0].min(extents[1]);
        let of_face = |face: usize| -> Vec<usize> {
            (0..sides.len())
                .filter(|&k| face_of[k] == self.faces[face])
                .collect()
        };
        let others = of_face(1);
        let own: Vec<Facet> = of_face(0).into_iter().map(|k| surface[k]).collect();
        each_point_of(
            problem,
            &own,
            (table_of, &problem.mesh.points),
            &mut |point| {
                let from = minus(point.rest, self.origin);
                let (arm, place) = (dot3(from, self.away[0]), dot3(from, self.along));
                let beside = |[start, end]: &[f64; 2]| *start <= place && place <= *end;
                if arm > reach || !self.reaches.iter().any(beside) {
                    return;
                }
                let partner: [f64; 3] = std::array::from_fn(|d| {
                    self.origin[d] + place * self.along[d] + arm * self.away[1][d]
                });
                let met = others.iter().find_map(|&k| {
                    let side = &sides[k];
                    let foot = foot(side.shape, &side.places, partner)?;
                    (foot.from_facet <= FLAT * side.size).then_some((side, foot))
                });
                if let Some((side, foot)) = met {
                    points.push(self.point(&problem.mesh, (point, arm), (side, &foot), stiffness));
                }
            },
        );
    }

    fn point(
        &self,
        mesh: &Mesh,
        (point, arm): (&ContactPoint<'_>, f64),
        (side, foot): (&Side, &Foot),
        stiffness: f64,
    ) -> WallPoint {
        // Slopes of the functions of a facet by the distance from the edge.
        let carried = |nodes: &[u32],
                       (values, gradients): (&[f64], &[[f64; 3]]),
                       (tangents, normal): ([[f64; 3]; 2], [f64; 3]),
                       away: [f64; 3]|
         -> Vec<(u32, f64, f64)> {
            let count = directions(side.shape);
            let duals = duals(tangents, normal, count).unwrap_or_default();
            let slope = |g: &[f64; 3]| g[0] * dot3(duals[0], away) + g[1] * dot3(duals[1], away);
            let all = nodes.iter().zip(values).zip(gradients);
            all.map(|((&node, &value), gradient)| (node, value, slope(gradient)))
                .collect()
        };
        let own = carried(
            point.nodes,
            (point.values, point.slopes),
            point.frame(&mesh.points),
            self.away[0],
        );
        let shapes = &foot.shapes;
        let other = carried(
            &side.nodes,
            (&shapes.values, &shapes.gradients),
            (foot.tangents, foot.normal),
            self.away[1],
        );
        let paired = |turn: f64| {
            let pairing = Pairing::Folding {
                arm,
                turn,
                stiffness,
                across: self.across(),
            };
            WallPoint::new(&own, &other, point.area, pairing)
        };
        // The open corner of the undeformed body has a positive angle.
        let open = paired(1.0);
        if open.gap(&mesh.points) < 0.0 {
            paired(-1.0)
        } else {
            open
        }
    }
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot3(v, v).sqrt();
    v.map(|x| x / length)
}
