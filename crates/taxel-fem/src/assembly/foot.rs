//! The point of a deformed facet that is nearest to a place, or that lies ahead of it.

use taxel_numerics::dense::dot3;

use crate::mesh::{FacetShape, Shapes};

/// Iterations of the search.
const ITERATIONS: usize = 25;
/// Change of the reference coordinates at which it ends, and that which is enough where rounding
/// allows for no less.
const SETTLED: [f64; 2] = [1e-13, 1e-9];
/// Reference coordinates beyond which the search is given up.
const FAR: f64 = 3.0;

/// A place over a facet.
#[derive(Clone, Debug)]
pub(super) struct Foot {
    /// Reference coordinates of the point of the facet; may lie a little outside.
    pub(super) at: [f64; 3],
    /// Shape functions of the facet there.
    pub(super) shapes: Shapes,
    /// Tangents along the reference coordinates, m.
    pub(super) tangents: [[f64; 3]; 2],
    /// Unit normal out of the body of the facet.
    pub(super) normal: [f64; 3],
    /// Distance, m; negative inside.
    pub(super) distance: f64,
    /// Way from the point to the facet, m; zero inside.
    pub(super) overshoot: f64,
    /// Distance from the facet itself, m.
    pub(super) from_facet: f64,
}

pub(super) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A sum over nodes.
fn sum(values: impl Iterator<Item = f64>, nodes: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (value, x) in values.zip(nodes) {
        for d in 0..3 {
            sum[d] += value * x[d];
        }
    }
    sum
}

/// Number of reference coordinates of a facet.
pub(super) const fn directions(shape: FacetShape) -> usize {
    match shape {
        FacetShape::Line3 => 1,
        FacetShape::Quad9 | FacetShape::Tri7 => 2,
    }
}

/// Reference coordinates of the middle of a facet.
pub(super) const fn middle_of(shape: FacetShape) -> [f64; 3] {
    match shape {
        FacetShape::Tri7 => [1.0 / 3.0, 1.0 / 3.0, 0.0],
        FacetShape::Line3 | FacetShape::Quad9 => [0.0; 3],
    }
}

/// Place, tangents and normal of a facet.
pub(super) fn frame(
    shape: FacetShape,
    shapes: &Shapes,
    nodes: &[[f64; 3]],
) -> ([f64; 3], [[f64; 3]; 2], [f64; 3]) {
    let place = sum(shapes.values.iter().copied(), nodes);
    let tangents: [[f64; 3]; 2] =
        std::array::from_fn(|k| sum(shapes.gradients.iter().map(|g| g[k]), nodes));
    (place, tangents, normal_of(directions(shape), tangents))
}

/// Unit normal of a facet with so many tangents.
pub(super) fn normal_of(count: usize, [s, t]: [[f64; 3]; 2]) -> [f64; 3] {
    let normal = if count == 1 {
        [s[1], -s[0], 0.0]
    } else {
        [
            s[1] * t[2] - s[2] * t[1],
            s[2] * t[0] - s[0] * t[2],
            s[0] * t[1] - s[1] * t[0],
        ]
    };
    let length = dot3(normal, normal).sqrt();
    normal.map(|x| x / length)
}

/// The nearest point of the facet's own range.
fn within(shape: FacetShape, at: [f64; 3]) -> [f64; 3] {
    match shape {
        FacetShape::Line3 => [at[0].clamp(-1.0, 1.0), 0.0, 0.0],
        FacetShape::Quad9 => [at[0].clamp(-1.0, 1.0), at[1].clamp(-1.0, 1.0), 0.0],
        FacetShape::Tri7 => {
            let over = (at[0] + at[1] - 1.0).max(0.0) / 2.0;
            let x = (at[0] - over).clamp(0.0, 1.0);
            [x, (at[1] - over).clamp(0.0, 1.0 - x), 0.0]
        }
    }
}

/// Derivatives of the tangents. The shape functions are of third degree at most in each
/// coordinate, for which central differences of their slopes are exact.
fn bends(shape: FacetShape, at: [f64; 3], nodes: &[[f64; 3]]) -> [[[f64; 3]; 2]; 2] {
    let mut bends = [[[0.0; 3]; 2]; 2];
    for along in 0..directions(shape) {
        let slopes = [0.5, -0.5].map(|step| {
            let mut moved = at;
            moved[along] += step;
            shape.shapes(moved).gradients
        });
        for k in 0..directions(shape) {
            let change = slopes[0].iter().zip(&slopes[1]).map(|(a, b)| a[k] - b[k]);
            bends[k][along] = sum(change, nodes);
        }
    }
    bends
}

/// Inverse of a symmetric matrix of the reference coordinates; none if it is not positive.
pub(super) fn inverse(matrix: [[f64; 2]; 2], directions: usize) -> Option<[[f64; 2]; 2]> {
    if directions == 1 {
        return (matrix[0][0] > 0.0).then(|| [[1.0 / matrix[0][0], 0.0], [0.0, 0.0]]);
    }
    let determinant = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0];
    (determinant > 0.0 && matrix[0][0] > 0.0).then(|| {
        [
            [matrix[1][1] / determinant, -matrix[0][1] / determinant],
            [-matrix[1][0] / determinant, matrix[0][0] / determinant],
        ]
    })
}

/// Reference coordinates of a point of a facet by Newton's method from the middle, with the change
/// that is to be made at some of them; none far beside the facet, or where they do not settle.
fn approached(
    shape: FacetShape,
    nodes: &[[f64; 3]],
    change: impl Fn([f64; 3], [f64; 3], [[f64; 3]; 2]) -> Option<[f64; 2]>,
) -> Option<[f64; 3]> {
    let (mut at, mut most) = (middle_of(shape), f64::INFINITY);
    for _ in 0..ITERATIONS {
        let (point, tangents, _) = frame(shape, &shape.shapes(at), nodes);
        let step = change(at, point, tangents)?;
        most = step[0].abs().max(step[1].abs());
        let share = if most > 1.0 { 1.0 / most } else { 1.0 };
        for (at, step) in at.iter_mut().zip(step) {
            *at += share * step;
        }
        if at.iter().any(|x| x.abs() > FAR) || !most.is_finite() {
            return None;
        }
        if most < SETTLED[0] {
            break;
        }
    }
    (most < SETTLED[1]).then_some(at)
}

/// The foot of a place on a facet with these places of its nodes; none far beside it.
pub(super) fn foot(shape: FacetShape, nodes: &[[f64; 3]], place: [f64; 3]) -> Option<Foot> {
    let count = directions(shape);
    let at = approached(shape, nodes, |at, point, tangents| {
        let from = minus(place, point);
        let bends = bends(shape, at, nodes);
        let first: [[f64; 2]; 2] =
            std::array::from_fn(|k| std::array::from_fn(|l| dot3(tangents[k], tangents[l])));
        let whole: [[f64; 2]; 2] =
            std::array::from_fn(|k| std::array::from_fn(|l| first[k][l] - dot3(from, bends[k][l])));
        // Where the distance has no minimum near, along the tangents alone.
        let inverse = inverse(whole, count).or_else(|| inverse(first, count))?;
        let force = [dot3(from, tangents[0]), dot3(from, tangents[1])];
        Some(inverse.map(|row| row[0] * force[0] + row[1] * force[1]))
    })?;
    let mut found = found(shape, nodes, (place, at));
    if found.overshoot == 0.0 {
        found.from_facet = found.distance.abs();
    }
    Some(found)
}

/// The facet at some reference coordinates, with the distance along its normal.
fn found(shape: FacetShape, nodes: &[[f64; 3]], (place, at): ([f64; 3], [f64; 3])) -> Foot {
    let shapes = shape.shapes(at);
    let (point, tangents, normal) = frame(shape, &shapes, nodes);
    let nearest = within(shape, at);
    let own = if nearest == at {
        point
    } else {
        frame(shape, &shape.shapes(nearest), nodes).0
    };
    let length = |v: [f64; 3]| dot3(v, v).sqrt();
    Foot {
        distance: dot3(minus(place, point), normal),
        at,
        shapes,
        tangents,
        normal,
        overshoot: length(minus(point, own)),
        from_facet: length(minus(place, own)),
    }
}

/// Unit vectors across a unit vector; in a plane one that lies in it, and none.
fn across(direction: [f64; 3], count: usize) -> [[f64; 3]; 2] {
    let [x, y, z] = direction;
    if count == 1 {
        return [[-y, x, 0.0], [0.0; 3]];
    }
    // From the axis that is farthest from it.
    let first = if x.abs() <= y.abs() && x.abs() <= z.abs() {
        [0.0, -z, y]
    } else if y.abs() <= z.abs() {
        [z, 0.0, -x]
    } else {
        [-y, x, 0.0]
    };
    let length = dot3(first, first).sqrt();
    let first = first.map(|x| x / length);
    let second = [
        y * first[2] - z * first[1],
        z * first[0] - x * first[2],
        x * first[1] - y * first[0],
    ];
    [first, second]
}

/// Vectors across a direction whose products with the tangents of a facet are one with their own
/// and zero with the other: change of the reference coordinates of the point that lies ahead by a
/// motion of the facet or of the place. None where the facet is seen edge-on.
pub(super) fn duals(
    tangents: [[f64; 3]; 2],
    direction: [f64; 3],
    count: usize,
) -> Option<[[f64; 3]; 2]> {
    let across = across(direction, count);
    let of = |i: usize, k: usize| dot3(across[i], tangents[k]);
    if count == 1 {
        let own = of(0, 0);
        return (own != 0.0).then(|| [across[0].map(|x| x / own), [0.0; 3]]);
    }
    let determinant = of(0, 0) * of(1, 1) - of(0, 1) * of(1, 0);
    (determinant != 0.0).then(|| {
        let row = |a: f64, b: f64| {
            std::array::from_fn(|d| (a * across[0][d] + b * across[1][d]) / determinant)
        };
        [row(of(1, 1), -of(0, 1)), row(-of(1, 0), of(0, 0))]
    })
}

/// The point of a facet on the straight line through a place, with the distance from it on the
/// way `ahead`, a unit vector; none far beside the facet.
pub(super) fn seen(
    shape: FacetShape,
    nodes: &[[f64; 3]],
    (place, ahead): ([f64; 3], [f64; 3]),
) -> Option<Foot> {
    let at = approached(shape, nodes, |_, point, tangents| {
        let from = minus(place, point);
        let duals = duals(tangents, ahead, directions(shape))?;
        Some(duals.map(|dual| dot3(dual, from)))
    })?;
    let mut found = found(shape, nodes, (place, at));
    let (point, ..) = frame(shape, &found.shapes, nodes);
    found.distance = dot3(minus(point, place), ahead);
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bent facet of a shape and a place near it.
    fn bent(shape: FacetShape) -> Vec<[f64; 3]> {
        let at = |n: usize| match shape {
            FacetShape::Line3 => [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]][n],
            FacetShape::Quad9 => crate::mesh::CellShape::Quad9.node_at(n),
            FacetShape::Tri7 => crate::mesh::CellShape::Tri7.node_at(n),
        };
        (0..shape.node_count())
            .map(at)
            .map(|[x, y, _]| {
                if shape == FacetShape::Line3 {
                    [x + 0.1 * x * x, 0.2 * x - 0.3 * x * x, 0.0]
                } else {
                    [
                        x + 0.1 * x * y,
                        y - 0.1 * x * x,
                        0.2 * x * x - 0.3 * x * y + 0.1 * y,
                    ]
                }
            })
            .collect()
    }

    #[test]
    fn a_line_that_passes_by_a_facet_meets_nothing() {
        // Over the crest of a parabola: Newton's method goes to and fro on it without end.
        let nodes = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.5, 0.0]];
        let met = seen(
            FacetShape::Line3,
            &nodes,
            ([1.2, 0.6, 0.0], [-0.96, 0.28, 0.0]),
        );
        assert!(met.is_none(), "{met:?}");
        let met = seen(
            FacetShape::Line3,
            &nodes,
            ([1.2, 0.4, 0.0], [-0.96, -0.28, 0.0]),
        );
        assert!(met.is_some_and(|foot| foot.overshoot == 0.0));
    }

    #[test]
    fn the_point_ahead_lies_on_the_facet_and_on_the_line() {
        for shape in [FacetShape::Line3, FacetShape::Quad9, FacetShape::Tri7] {
            let nodes = bent(shape);
            let (place, ahead) = if shape == FacetShape::Line3 {
                ([0.27, 0.2, 0.0], [0.6, -0.8, 0.0])
            } else {
                ([0.26, 0.24, 0.4], [0.48, -0.36, -0.8])
            };
            let found = seen(shape, &nodes, (place, ahead)).unwrap_or_else(|| panic!("{shape:?}"));
            let (point, ..) = frame(shape, &found.shapes, &nodes);
            for d in 0..3 {
                let on_line = place[d] + found.distance * ahead[d];
                assert!((point[d] - on_line).abs() < 1e-13, "{shape:?} {point:?}");
            }
            // Along the normal it is the foot of the perpendicular.
            let foot = foot(shape, &nodes, place).unwrap_or_else(|| panic!("{shape:?}"));
            let same = seen(shape, &nodes, (place, foot.normal.map(|x| -x)));
            let same = same.unwrap_or_else(|| panic!("{shape:?}"));
            assert!((same.distance - foot.distance).abs() < 1e-13, "{shape:?}");
            assert!(
                foot.overshoot == 0.0 && foot.distance.abs() > 0.02,
                "{foot:?}"
            );
        }
    }
}
