//! Triangles that fill a polygon.
//!
//! Ears are cut off the polygon, and edges flipped until no circle through the corners of a
//! triangle holds another point that is seen from there (Lawson). Flat triangles then get a
//! point in the middle of their circle (Chew, Ruppert), unless it came too near to the
//! outline, which stays as it is: its edges belong to somebody else's cells, too.

use std::collections::{HashMap, VecDeque};

/// A point in the plane.
type Place = [f64; 2];

/// Triangles, the corners of each in the positive sense.
pub struct Triangles {
    /// The corners of the polygon in their order, then the points inside.
    pub points: Vec<Place>,
    /// Numbers of the corners.
    pub corners: Vec<[usize; 3]>,
}

/// Radius of the circle through the corners over the shortest edge from which on a triangle
/// is flat: 25 degrees. Below 1 the refinement need not end.
const FLAT: f64 = 1.2;
/// Most points inside over the corners of the polygon; a few times what is needed.
const MOST: usize = 100;
/// Sine of an angle that counts as none: far above rounding, far below an angle of use.
const NO_ANGLE: f64 = 1e-9;
/// Share of its terms by which a determinant counts as zero.
const ROUNDING: f64 = 1e-12;
/// No neighbour: the outline.
const OUTSIDE: usize = usize::MAX;

/// Fills a polygon whose inside lies to the left of its outline.
///
/// # Errors
/// A place where the outline crosses or touches itself, or runs the other way round.
pub fn fill(outline: &[Place]) -> Result<Triangles, Place> {
    if let Some(place) = crossing(outline) {
        return Err(place);
    }
    let corners = cut_ears(outline)?;
    let mut work = Work::new(outline, corners);
    work.flip_all();
    work.refine();
    Ok(Triangles {
        points: work.points,
        corners: work.corners,
    })
}

fn minus(a: Place, b: Place) -> Place {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: Place, b: Place) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: Place, b: Place) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Sine of the turn from `a` over `b` to `c`, positive to the left; zero for no turn.
fn turn(a: Place, b: Place, c: Place) -> f64 {
    let (first, second) = (minus(b, a), minus(c, a));
    let size = (dot(first, first) * dot(second, second)).sqrt();
    if size > 0.0 {
        cross(first, second) / size
    } else {
        0.0
    }
}

/// A corner at which two edges that are no neighbours cross.
fn crossing(outline: &[Place]) -> Option<Place> {
    let count = outline.len();
    let edge = |k: usize| (outline[k], outline[(k + 1) % count]);
    let parts =
        |(a, b): (Place, Place), (c, d): (Place, Place)| turn(a, b, c) * turn(a, b, d) < 0.0;
    let pairs = (0..count).flat_map(|k| (k + 2..count).map(move |l| (k, l)));
    pairs
        .filter(|&(k, l)| (l + 1) % count != k)
        .find(|&(k, l)| parts(edge(k), edge(l)) && parts(edge(l), edge(k)))
        .map(|(k, _)| outline[k])
}

/// Triangles between the corners of a polygon alone.
fn cut_ears(outline: &[Place]) -> Result<Vec<[usize; 3]>, Place> {
    let mut left: Vec<usize> = (0..outline.len()).collect();
    let mut triangles = Vec::new();
    let mut start = 0;
    while left.len() > 2 {
        let count = left.len();
        let around = |k: usize| [k + count - 1, k, k + 1].map(|k| left[k % count]);
        // From where the last ear was: no corner has all the triangles.
        let ear = (0..count)
            .map(|k| (start + k) % count)
            .find(|&k| is_ear(outline, &left, around(k)));
        let Some(ear) = ear else {
            return Err(outline[left[0]]);
        };
        triangles.push(around(ear));
        left.remove(ear);
        start = ear + 1;
    }
    Ok(triangles)
}

/// True if three corners that follow each other make a triangle without any other corner.
fn is_ear(outline: &[Place], left: &[usize], ear: [usize; 3]) -> bool {
    let [a, b, c] = ear.map(|k| outline[k]);
    let holds = |p: Place| {
        [(a, b), (b, c), (c, a)]
            .into_iter()
            .all(|(from, to)| turn(from, to, p) >= -NO_ANGLE)
    };
    turn(a, b, c) > NO_ANGLE
        && turn(b, c, a) > NO_ANGLE
        && turn(c, a, b) > NO_ANGLE
        && !left.iter().any(|k| !ear.contains(k) && holds(outline[*k]))
}

/// Depth of `p` inside the circle through `a`, `b`, `c`; not positive outside and, up to
/// rounding, on it.
fn inside_circle([a, b, c]: [Place; 3], p: Place) -> f64 {
    let [a, b, c] = [a, b, c].map(|corner| minus(corner, p));
    let terms = [
        dot(a, a) * cross(b, c),
        dot(b, b) * cross(c, a),
        dot(c, c) * cross(a, b),
    ];
    let size: f64 = terms.iter().map(|term| term.abs()).sum();
    terms.iter().sum::<f64>() - ROUNDING * size
}

/// Middle of the circle through three points, with its radius over their shortest distance.
fn circle([a, b, c]: [Place; 3]) -> (Place, f64) {
    let (u, v) = (minus(b, a), minus(c, a));
    let twice = 2.0 * cross(u, v);
    let (uu, vv) = (dot(u, u), dot(v, v));
    let to_middle = [
        (vv * u[1] - uu * v[1]) / -twice,
        (uu * v[0] - vv * u[0]) / -twice,
    ];
    let w = minus(c, b);
    let shortest = uu.min(vv).min(dot(w, w));
    let middle = [a[0] + to_middle[0], a[1] + to_middle[1]];
    (middle, (dot(to_middle, to_middle) / shortest).sqrt())
}

/// Triangles with their neighbours.
struct Work {
    points: Vec<Place>,
    corners: Vec<[usize; 3]>,
    /// Triangles beyond the edges from each corner to the next.
    across: Vec<[usize; 3]>,
    /// Most points.
    most: usize,
}

/// A side of the hole that a new point is put into: its ends, and the triangle beyond.
type Side = ([usize; 2], usize);

impl Work {
    fn new(outline: &[Place], corners: Vec<[usize; 3]>) -> Self {
        let mut edges = HashMap::new();
        for (number, triangle) in corners.iter().enumerate() {
            for k in 0..3 {
                edges.insert([triangle[k], triangle[(k + 1) % 3]], number);
            }
        }
        let beyond = |from: usize, to: usize| edges.get(&[to, from]).copied().unwrap_or(OUTSIDE);
        let across = corners
            .iter()
            .map(|&[a, b, c]| [beyond(a, b), beyond(b, c), beyond(c, a)])
            .collect();
        Self {
            points: outline.to_vec(),
            corners,
            across,
            most: (MOST + 1) * outline.len(),
        }
    }

    fn places(&self, triangle: usize) -> [Place; 3] {
        self.corners[triangle].map(|corner| self.points[corner])
    }

    /// Number of the edge of a triangle that starts at a corner.
    fn edge_from(&self, triangle: usize, corner: usize) -> usize {
        (0..2)
            .find(|&k| self.corners[triangle][k] == corner)
            .unwrap_or(2)
    }

    /// Tells a triangle, if there is one, its neighbour beyond the edge from a corner.
    fn join(&mut self, triangle: usize, from: usize, neighbour: usize) {
        if triangle != OUTSIDE {
            let edge = self.edge_from(triangle, from);
            self.across[triangle][edge] = neighbour;
        }
    }

    fn flip_all(&mut self) {
        let count = self.corners.len();
        let mut asked: Vec<(usize, usize)> =
            (0..count).flat_map(|t| [(t, 0), (t, 1), (t, 2)]).collect();
        // Every flip enlarges the least angles; the bound only says that it ends.
        for _ in 0..1000 * count {
            let Some((triangle, edge)) = asked.pop() else {
                break;
            };
            if let Some(other) = self.flip(triangle, edge) {
                asked.extend(
                    [triangle, other]
                        .into_iter()
                        .flat_map(|t| [(t, 0), (t, 1), (t, 2)]),
                );
            }
        }
    }

    /// Turns an edge round if that takes a point out of a circle; the triangle beyond.
    fn flip(&mut self, triangle: usize, edge: usize) -> Option<usize> {
        let other = self.across[triangle][edge];
        if other == OUTSIDE {
            return None;
        }
        let [a, b, c] = [0, 1, 2].map(|k| self.corners[triangle][(edge + k) % 3]);
        let back = self.edge_from(other, b);
        let d = self.corners[other][(back + 2) % 3];
        let [pa, pb, pc, pd] = [a, b, c, d].map(|corner| self.points[corner]);
        let convex = [(pc, pa, pd), (pa, pd, pc), (pd, pb, pc), (pb, pc, pd)]
            .into_iter()
            .all(|(p, q, r)| turn(p, q, r) > NO_ANGLE);
        if !convex || inside_circle([pa, pb, pc], pd) <= 0.0 {
            return None;
        }
        let beyond = |k: usize| self.across[triangle][(edge + k) % 3];
        let behind = |k: usize| self.across[other][(back + k) % 3];
        // Beyond b-c, c-a of the one and a-d, d-b of the other.
        let (bc, ca, ad, db) = (beyond(1), beyond(2), behind(1), behind(2));
        (self.corners[triangle], self.across[triangle]) = ([c, a, d], [ca, ad, other]);
        (self.corners[other], self.across[other]) = ([d, b, c], [db, bc, triangle]);
        self.join(ad, d, triangle);
        self.join(bc, c, other);
        Some(other)
    }

    /// Puts points into the circles of flat triangles.
    fn refine(&mut self) {
        let mut asked: VecDeque<[usize; 3]> = self.corners.iter().copied().collect();
        let mut numbers: HashMap<[usize; 3], usize> = self.numbered(0..self.corners.len());
        while let Some(corners) = asked.pop_front() {
            let Some(&triangle) = numbers.get(&corners) else {
                continue;
            };
            let (middle, flatness) = circle(self.places(triangle));
            if flatness <= FLAT || self.points.len() >= self.most {
                continue;
            }
            let Some((hole, sides)) = self.hole(triangle, middle) else {
                continue;
            };
            for &gone in &hole {
                numbers.remove(&self.corners[gone]);
            }
            let new = self.insert(middle, &hole, &sides);
            asked.extend(new.iter().map(|&t| self.corners[t]));
            numbers.extend(self.numbered(new));
        }
    }

    fn numbered(&self, triangles: impl IntoIterator<Item = usize>) -> HashMap<[usize; 3], usize> {
        let own = triangles.into_iter();
        own.map(|number| (self.corners[number], number)).collect()
    }

    /// The triangles whose circles hold a point, connected with the first, and the sides
    /// of the hole that they leave; none when the point does not see all sides well.
    fn hole(&self, first: usize, point: Place) -> Option<(Vec<usize>, Vec<Side>)> {
        let mut hole = vec![first];
        let mut sides = Vec::new();
        let mut next = 0;
        while let Some(&triangle) = hole.get(next) {
            next += 1;
            for edge in 0..3 {
                let other = self.across[triangle][edge];
                if hole.contains(&other) {
                    continue;
                }
                if other != OUTSIDE && inside_circle(self.places(other), point) > 0.0 {
                    hole.push(other);
                    continue;
                }
                let ends = [edge, (edge + 1) % 3].map(|k| self.corners[triangle][k]);
                sides.push((ends, other));
            }
        }
        // A corner within the hole would be lost.
        let whole = sides.len() == hole.len() + 2;
        let seen = whole
            && sides.iter().all(|&(ends, other)| {
                let [from, to] = ends.map(|corner| self.points[corner]);
                let near = dot(minus(from, point), minus(to, point)) <= 0.0;
                turn(from, to, point) > NO_ANGLE && !(near && other == OUTSIDE)
            });
        seen.then_some((hole, sides))
    }

    /// Fills a hole with the triangles between its sides and a new point in it.
    fn insert(&mut self, point: Place, hole: &[usize], sides: &[Side]) -> Vec<usize> {
        let tip = self.points.len();
        self.points.push(point);
        // There are two sides more than triangles in the hole.
        let count = self.corners.len();
        let numbers: Vec<usize> = hole.iter().copied().chain(count..count + 2).collect();
        self.corners.resize(count + 2, [0; 3]);
        self.across.resize(count + 2, [OUTSIDE; 3]);
        let starts: HashMap<usize, usize> = sides
            .iter()
            .zip(&numbers)
            .map(|((ends, _), &number)| (ends[0], number))
            .collect();
        for (&([from, to], other), &number) in sides.iter().zip(&numbers) {
            self.corners[number] = [from, to, tip];
            self.across[number][0] = other;
            self.join(other, to, number);
        }
        for (&([_, to], _), &number) in sides.iter().zip(&numbers) {
            // The sides go round: where one ends another one starts.
            if let Some(&next) = starts.get(&to) {
                self.across[number][1] = next;
                self.across[next][2] = number;
            }
        }
        numbers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    fn area(points: &[Place]) -> f64 {
        let next = points.iter().cycle().skip(1);
        points
            .iter()
            .zip(next)
            .map(|(a, b)| cross(*a, *b))
            .sum::<f64>()
            / 2.0
    }

    fn areas(triangles: &Triangles) -> Vec<f64> {
        let of = |corners: &[usize; 3]| area(&corners.map(|k| triangles.points[k]));
        triangles.corners.iter().map(of).collect()
    }

    /// Triangles fill the polygon, keep its edges, and meet edge to edge.
    fn check(outline: &[Place]) -> Triangles {
        let filled = fill(outline).unwrap();
        let count = outline.len();
        assert_eq!(filled.points[..count], *outline);
        let areas = areas(&filled);
        assert!(areas.iter().all(|area| *area > 0.0));
        // Rounding of a sum.
        assert!((areas.iter().sum::<f64>() / area(outline) - 1.0).abs() < 1e-12);
        let edges = filled
            .corners
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let edges: HashSet<[usize; 2]> = edges.collect();
        assert_eq!(edges.len(), 3 * filled.corners.len());
        let single = edges.iter().filter(|[a, b]| !edges.contains(&[*b, *a]));
        let single: Vec<[usize; 2]> = single.copied().collect();
        assert_eq!(single.len(), count);
        assert!(single.iter().all(|[a, b]| (a + 1) % count == *b));
        filled
    }

    fn least_angle(triangles: &Triangles) -> f64 {
        let angles = triangles.corners.iter().map(|corners| {
            let (_, flatness) = circle(corners.map(|k| triangles.points[k]));
            (0.5 / flatness).asin().to_degrees()
        });
        angles.fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn a_square_with_many_points_on_one_side_gets_no_flat_triangle() {
        let mut outline: Vec<Place> = (0..40).map(|k| [f64::from(k) / 40.0, 0.0]).collect();
        // The other sides grow from its cells, as those of a user must.
        let grown = |k: i32| (1.4_f64.powi(k) - 1.0) / (1.4_f64.powi(8) - 1.0);
        outline.extend((0..8).map(|k| [1.0, grown(k)]));
        outline.extend((0..4).map(|k| [1.0 - 0.25 * f64::from(k), 1.0]));
        outline.extend((1..=8).rev().map(|k| [0.0, grown(k)]));
        let filled = check(&outline);
        assert!(least_angle(&filled) > 20.0, "{}", least_angle(&filled));
        assert!(filled.corners.len() < 1000, "{}", filled.corners.len());
    }

    #[test]
    fn a_narrow_pocket_with_an_overhang_is_filled() {
        // A wedge of a thousandth that ends in a hook.
        check(&[
            [0.0, 0.0],
            [0.5, 0.0],
            [1.0, 0.0],
            [2.0, 0.0],
            [2.0, 2.0],
            [0.0, 2.0],
            [0.5, 1.0],
            [1.5, 0.9],
            [1.6, 0.5],
            [1.0, 0.001],
            [0.5, 0.0005],
        ]);
    }

    #[test]
    fn outlines_that_cross_or_run_backwards_are_refused() {
        assert!(fill(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]).is_err());
        assert!(fill(&[[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]).is_err());
        assert!(fill(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]).is_err());
        assert!(fill(&[[0.0, 0.0], [f64::NAN, 0.0], [1.0, 1.0]]).is_err());
    }

    proptest! {
        #[test]
        fn stars_are_filled_without_gaps(radii in prop::collection::vec(0.05..1.0_f64, 5..60)) {
            let step = std::f64::consts::TAU / radii.len() as f64;
            let outline: Vec<Place> = radii
                .iter()
                .enumerate()
                .map(|(k, r)| {
                    let angle = step * k as f64;
                    [r * angle.cos(), r * angle.sin()]
                })
                .collect();
            check(&outline);
        }
    }
}
