//! The point of a deformed facet that is nearest to a place.

use crate::mesh::{FacetShape, Shapes};

/// Iterations of the search.
const ITERATIONS: usize = 25;
/// Reference coordinates beyond which the search is given up.
const FAR: f64 = 3.0;

/// A place over a facet: its distance with what the derivatives need.
#[derive(Clone, Debug)]
pub(super) struct Foot {
    /// Reference coordinates of the foot of the perpendicular; may lie a little outside.
    pub(super) at: [f64; 3],
    /// Shape functions of the facet there.
    pub(super) shapes: Shapes,
    /// Tangents along the reference coordinates, m.
    pub(super) tangents: [[f64; 3]; 2],
    /// Derivatives of the tangents, m.
    pub(super) bends: [[[f64; 3]; 2]; 2],
    /// Unit normal out of the body of the facet.
    pub(super) normal: [f64; 3],
    /// Distance along the normal, m; negative inside.
    pub(super) distance: f64,
    /// Way from the foot to the facet, m; zero inside.
    pub(super) overshoot: f64,
    /// Distance from the facet itself, m.
    pub(super) from_facet: f64,
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
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
    let tangents = std::array::from_fn(|k| sum(shapes.gradients.iter().map(|g| g[k]), nodes));
    let [s, t]: [[f64; 3]; 2] = tangents;
    let normal = if directions(shape) == 1 {
        [s[1], -s[0], 0.0]
    } else {
        [
            s[1] * t[2] - s[2] * t[1],
            s[2] * t[0] - s[0] * t[2],
            s[0] * t[1] - s[1] * t[0],
        ]
    };
    let length = dot(normal, normal).sqrt();
    (place, tangents, normal.map(|x| x / length))
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

/// The foot of a place on a facet with these places of its nodes; none far beside it.
pub(super) fn foot(shape: FacetShape, nodes: &[[f64; 3]], place: [f64; 3]) -> Option<Foot> {
    let count = directions(shape);
    let mut at = middle_of(shape);
    for _ in 0..ITERATIONS {
        let shapes = shape.shapes(at);
        let (point, tangents, _) = frame(shape, &shapes, nodes);
        let from = minus(place, point);
        let bends = bends(shape, at, nodes);
        let metric = |k: usize, l: usize| -> f64 {
            if k < count && l < count {
                dot(tangents[k], tangents[l])
            } else {
                0.0
            }
        };
        let first: [[f64; 2]; 2] = std::array::from_fn(|k| std::array::from_fn(|l| metric(k, l)));
        let whole: [[f64; 2]; 2] =
            std::array::from_fn(|k| std::array::from_fn(|l| first[k][l] - dot(from, bends[k][l])));
        // Where the distance has no minimum near, along the tangents alone.
        let inverse = inverse(whole, count).or_else(|| inverse(first, count))?;
        let force = [dot(from, tangents[0]), dot(from, tangents[1])];
        let mut most: f64 = 0.0;
        let mut step = [0.0; 2];
        for k in 0..count {
            step[k] = inverse[k][0] * force[0] + inverse[k][1] * force[1];
            most = most.max(step[k].abs());
        }
        let share = if most > 1.0 { 1.0 / most } else { 1.0 };
        for k in 0..count {
            at[k] += share * step[k];
        }
        if at.iter().any(|x| x.abs() > FAR) || !most.is_finite() {
            return None;
        }
        if most < 1e-13 {
            break;
        }
    }
    let shapes = shape.shapes(at);
    let (point, tangents, normal) = frame(shape, &shapes, nodes);
    let nearest = within(shape, at);
    let (overshoot, from_facet) = if nearest == at {
        (0.0, dot(minus(place, point), normal).abs())
    } else {
        let (own, ..) = frame(shape, &shape.shapes(nearest), nodes);
        let length = |v: [f64; 3]| dot(v, v).sqrt();
        (length(minus(point, own)), length(minus(place, own)))
    };
    Some(Foot {
        bends: bends(shape, at, nodes),
        distance: dot(minus(place, point), normal),
        at,
        shapes,
        tangents,
        normal,
        overshoot,
        from_facet,
    })
}

impl Foot {
    /// Second derivative of the distance by the nodes, row by row: three components each of the
    /// nodes of the point (`values` its shape functions), then of those of the facet. None where
    /// the place lies beyond the centre of curvature.
    pub(super) fn curvature(&self, values: &[f64]) -> Option<Vec<f64>> {
        let count = if self.tangents[1] == [0.0; 3] { 1 } else { 2 };
        let own = self.shapes.values.len();
        let size = 3 * (values.len() + own);
        let normal_part = |k: usize, l: usize| dot(self.normal, self.bends[k][l]);
        let metric: [[f64; 2]; 2] = std::array::from_fn(|k| {
            std::array::from_fn(|l| dot(self.tangents[k], self.tangents[l]))
        });
        let whole = std::array::from_fn(|k| {
            std::array::from_fn(|l| metric[k][l] - self.distance * normal_part(k, l))
        });
        let (inverse_metric, inverse_whole) = (inverse(metric, count)?, inverse(whole, count)?);
        // Linear forms over the components: along the tangents, the turn of the facet, and the
        // change of the reference coordinates.
        let mut along = [vec![0.0; size], vec![0.0; size]];
        let mut turn = [vec![0.0; size], vec![0.0; size]];
        let factors = values
            .iter()
            .copied()
            .chain(self.shapes.values.iter().map(|v| -v));
        for (node, factor) in factors.enumerate() {
            for d in 0..3 {
                for k in 0..count {
                    along[k][3 * node + d] = factor * self.tangents[k][d];
                    if node >= values.len() {
                        let slope = self.shapes.gradients[node - values.len()][k];
                        turn[k][3 * node + d] = slope * self.normal[d];
                    }
                }
            }
        }
        let mut shift = [vec![0.0; size], vec![0.0; size]];
        for k in 0..count {
            for l in 0..count {
                for (n, shift) in shift[k].iter_mut().enumerate() {
                    *shift += inverse_whole[k][l] * (along[l][n] + self.distance * turn[l][n]);
                }
            }
        }
        let mut bend = turn.clone();
        for k in 0..count {
            for l in 0..count {
                for (n, bend) in bend[k].iter_mut().enumerate() {
                    *bend += normal_part(k, l) * shift[l][n];
                }
            }
        }
        let mut raised = [vec![0.0; size], vec![0.0; size]];
        for k in 0..count {
            for l in 0..count {
                for (n, raised) in raised[k].iter_mut().enumerate() {
                    *raised += inverse_metric[k][l] * along[l][n];
                }
            }
        }
        let mut second = vec![0.0; size * size];
        for i in 0..size {
            for j in 0..=i {
                let mut value = 0.0;
                for k in 0..count {
                    value -= bend[k][i] * raised[k][j] + turn[k][j] * shift[k][i];
                }
                second[i * size + j] = value;
                second[j * size + i] = value;
            }
        }
        Some(second)
    }
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
    fn the_derivatives_of_the_distance_are_those_of_its_differences() {
        for shape in [FacetShape::Line3, FacetShape::Quad9, FacetShape::Tri7] {
            let plane = shape == FacetShape::Line3;
            let nodes = bent(shape);
            // Two nodes carry the point.
            let values = [0.3, 0.7];
            let ends = if plane {
                [[0.2, -0.5, 0.0], [0.3, 0.3, 0.0]]
            } else {
                [[0.2, 0.3, 0.5], [0.4, 0.1, 0.3]]
            };
            let at = |x: &[[f64; 3]]| {
                let place = std::array::from_fn(|d| values[0] * x[0][d] + values[1] * x[1][d]);
                foot(shape, &x[2..], place).unwrap_or_else(|| panic!("{shape:?}"))
            };
            let mut all = ends.to_vec();
            all.extend(nodes);
            let here = at(&all);
            assert!(
                here.overshoot == 0.0 && here.distance.abs() > 0.02,
                "{here:?}"
            );
            let factors: Vec<f64> = values
                .iter()
                .copied()
                .chain(here.shapes.values.iter().map(|v| -v))
                .collect();
            let second = here.curvature(&values).unwrap_or_default();
            let size = 3 * all.len();
            let step = 1e-5;
            let gradient = |foot: &Foot, n: usize, d: usize| {
                let factor = if n < 2 {
                    values[n]
                } else {
                    -foot.shapes.values[n - 2]
                };
                factor * foot.normal[d]
            };
            for n in 0..all.len() {
                for d in 0..if plane { 2 } else { 3 } {
                    let moved = |sign: f64| {
                        let mut moved = all.clone();
                        moved[n][d] += sign * step;
                        at(&moved)
                    };
                    let (up, down) = (moved(1.0), moved(-1.0));
                    let slope = (up.distance - down.distance) / (2.0 * step);
                    assert!(
                        (slope - factors[n] * here.normal[d]).abs() < 1e-8,
                        "{shape:?}"
                    );
                    for m in 0..all.len() {
                        for e in 0..if plane { 2 } else { 3 } {
                            let bend = (gradient(&up, m, e) - gradient(&down, m, e)) / (2.0 * step);
                            let exact = second[(3 * m + e) * size + 3 * n + d];
                            assert!(
                                (bend - exact).abs() < 1e-7,
                                "{shape:?} {n} {d} {m} {e}: {bend} {exact}"
                            );
                        }
                    }
                }
            }
        }
    }
}
