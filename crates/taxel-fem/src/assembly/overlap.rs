//! Points of integration of a facet that end where the facets over it do: what is interpolated on
//! those has kinks there.

use crate::mesh::{FacetShape, QuadraturePoint};

/// Least part of a facet that is integrated on its own, over the whole.
const SLIVER: f64 = 5e-3;
/// Least part of a line between the ends of others, in its reference coordinate.
const SLIVER_OF_LINE: f64 = 1e-6;

/// Six points, exact to degree 4 (Dunavant), in barycentric coordinates with weights that add up
/// to one.
const TRIANGLE: [(f64, f64); 2] = [
    (0.445948490915965, 0.223381589678011),
    (0.091576213509771, 0.109951743655322),
];

/// Points of a line that is divided at these reference coordinates.
pub(super) fn of_line(cuts: &[f64]) -> Vec<QuadraturePoint> {
    let mut ends = vec![-1.0, 1.0];
    ends.extend(cuts.iter().filter(|cut| cut.abs() < 1.0));
    ends.sort_unstable_by(f64::total_cmp);
    let mut kept = vec![ends[0]];
    for &end in &ends[1..ends.len() - 1] {
        if end - kept[kept.len() - 1] > SLIVER_OF_LINE && 1.0 - end > SLIVER_OF_LINE {
            kept.push(end);
        }
    }
    kept.push(1.0);
    let usual = FacetShape::Line3.quadrature();
    let parts = kept.windows(2).flat_map(|ends| {
        let half = 0.5 * (ends[1] - ends[0]);
        usual.iter().map(move |point| QuadraturePoint {
            at: [ends[0] + half * (1.0 + point.at[0]), 0.0, 0.0],
            weight: half * point.weight,
        })
    });
    parts.collect()
}

type Polygon = Vec<[f64; 2]>;

/// Points of a facet in space that is divided by the outlines of others, convex polygons in its
/// reference coordinates.
pub(super) fn of_facet(shape: FacetShape, outlines: &[Polygon]) -> Vec<QuadraturePoint> {
    let whole: Polygon = if shape == FacetShape::Tri7 {
        vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    } else {
        vec![[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
    };
    let size = area(&whole);
    let mut open = vec![whole];
    let mut done = Vec::new();
    for outline in outlines {
        // Their normals face each other, so an outline may run either way.
        let mut outline = outline.clone();
        if area(&outline) < 0.0 {
            outline.reverse();
        }
        let mut next = Vec::new();
        for piece in open {
            let (within, beside) = divided(&piece, &outline, SLIVER * size);
            match within {
                Some(within) => {
                    done.push(within);
                    next.extend(beside);
                }
                None => next.push(piece),
            }
        }
        open = next;
    }
    if done.len() + open.len() == 1 {
        return shape.quadrature();
    }
    done.extend(open);
    let mut points = Vec::new();
    for piece in done {
        for k in 1..piece.len() - 1 {
            let corners = [piece[0], piece[k], piece[k + 1]];
            let part = area(&corners);
            for (a, weight) in TRIANGLE {
                for odd in 0..3 {
                    let share = |n: usize| if n == odd { 1.0 - 2.0 * a } else { a };
                    let at = |d: usize| (0..3).map(|n| share(n) * corners[n][d]).sum();
                    points.push(QuadraturePoint {
                        at: [at(0), at(1), 0.0],
                        weight: part * weight,
                    });
                }
            }
        }
    }
    points
}

/// Area of a polygon, positive if it runs to the left.
fn area(polygon: &[[f64; 2]]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let twice = polygon
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0]);
    0.5 * twice.sum::<f64>()
}

/// The part of a convex polygon within another one, none if there is none, and the parts beside.
fn divided(piece: &Polygon, outline: &Polygon, least: f64) -> (Option<Polygon>, Vec<Polygon>) {
    let mut rest = piece.clone();
    let mut beside = Vec::new();
    for k in 0..outline.len() {
        let (a, b) = (outline[k], outline[(k + 1) % outline.len()]);
        // Positive to the left of the side.
        let height = |x: &[f64; 2]| (b[0] - a[0]) * (x[1] - a[1]) - (b[1] - a[1]) * (x[0] - a[0]);
        let outside = cut(&rest, &|x| -height(x));
        if area(&outside) > least {
            rest = cut(&rest, &height);
            beside.push(outside);
        }
        if area(&rest) <= least {
            return (None, Vec::new());
        }
    }
    (Some(rest), beside)
}

/// The part of a convex polygon where a linear function is not negative.
fn cut(polygon: &[[f64; 2]], height: &dyn Fn(&[f64; 2]) -> f64) -> Polygon {
    let mut kept = Vec::new();
    for (k, here) in polygon.iter().enumerate() {
        let next = &polygon[(k + 1) % polygon.len()];
        let (from, to) = (height(here), height(next));
        if from >= 0.0 {
            kept.push(*here);
        }
        if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
            let share = from / (from - to);
            kept.push(std::array::from_fn(|d| {
                here[d] + share * (next[d] - here[d])
            }));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral of `x^m y^n`.
    fn integral(points: &[QuadraturePoint], m: i32, n: i32) -> f64 {
        let value = |p: &QuadraturePoint| p.weight * p.at[0].powi(m) * p.at[1].powi(n);
        points.iter().map(value).sum()
    }

    #[test]
    fn parts_of_a_facet_make_up_the_whole_and_end_at_the_outlines() {
        // Two outlines that share a side, one of each direction, and one far away.
        let outlines: Vec<Polygon> = vec![
            vec![[-2.0, -2.0], [0.2, -2.0], [0.2, 0.3], [-2.0, 0.3]],
            vec![[0.2, -2.0], [0.2, 0.3], [3.0, 0.3], [3.0, -2.0]],
            vec![[5.0, 5.0], [6.0, 5.0], [6.0, 6.0]],
        ];
        for shape in [FacetShape::Quad9, FacetShape::Tri7] {
            let (parts, usual) = (of_facet(shape, &outlines), shape.quadrature());
            for (m, n) in [(0, 0), (1, 0), (2, 2), (1, 3), (0, 4)] {
                let difference = integral(&parts, m, n) - integral(&usual, m, n);
                assert!(difference.abs() < 1e-13, "{shape:?} {m} {n} {difference}");
            }
            // A kink on the common side, and one at the upper end.
            let kinked = |p: &QuadraturePoint| p.weight * (p.at[0] - 0.2).abs();
            let exact = match shape {
                // 2 * (1.2^2 + 0.8^2) / 2
                FacetShape::Quad9 => 2.08,
                // int_0^1 |x - 0.2| (1 - x) dx
                _ => 0.5 / 3.0 - 0.1 + 2.0 * (0.2_f64.powi(2) / 2.0 - 0.2_f64.powi(3) / 6.0),
            };
            let found: f64 = parts
                .iter()
                .filter(|p| p.at[1] < 0.3)
                .map(kinked)
                .sum::<f64>();
            let above: f64 = usual_above(shape);
            assert!((found + above - exact).abs() < 1e-12, "{shape:?} {found}");
        }
        assert_eq!(of_facet(FacetShape::Quad9, &outlines[2..]).len(), 9);
    }

    /// The kinked function above the outlines, where it is not divided at its kink: by parts.
    fn usual_above(shape: FacetShape) -> f64 {
        if shape == FacetShape::Quad9 {
            // 0.7 * (1.2^2 + 0.8^2) / 2
            return 0.728;
        }
        // int_0.3^1 dy int_0^(1-y) |x - 0.2| dx, by x: int_0^0.7 |x - 0.2| (0.7 - x) dx
        let primitive = |x: f64| 0.35 * x * x - x.powi(3) / 3.0 - 0.2 * 0.7 * x + 0.1 * x * x;
        primitive(0.7) - 2.0 * primitive(0.2)
    }

    #[test]
    fn parts_of_a_line_end_at_the_cuts() {
        let points = of_line(&[0.4, -3.0, 0.4, 1.0 - 1e-9]);
        assert_eq!(points.len(), 6);
        let kinked: f64 = points
            .iter()
            .map(|p| p.weight * (p.at[0] - 0.4).abs())
            .sum();
        assert!((kinked - f64::midpoint(1.4_f64.powi(2), 0.6_f64.powi(2))).abs() < 1e-14);
    }
}
