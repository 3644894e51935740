//! What lies between two surfaces along straight lines: the mesh, or a void.

use taxel_numerics::dense::dot3 as dot;

use super::boxes::bounds;
use super::neighbours::{SAME_PLACE, Side, minus, unit};
use super::{Facet, Mesh};

/// Lines that are drawn from a surface at most: each is compared with all of the boundary.
const LINES: usize = 200;

/// A void on the lines between two surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Void {
    /// The longest way through it on one of the lines, in the unit of the mesh.
    pub length: f64,
    /// In the middle of the void on that line.
    pub place: [f64; 3],
    /// Share of the lines that pass through it.
    pub share: f64,
}

/// The void that straight lines pass from the middles of the facets of one surface to the nearest
/// of those of another; none where they stay in the mesh, or run along its surface.
pub fn void_between(mesh: &Mesh, from: &[Facet], to: &[Facet]) -> Option<Void> {
    let boundary: Vec<(Facet, Side)> = mesh
        .boundary()
        .into_iter()
        .map(|facet| (facet, Side::of(mesh, facet)))
        .collect();
    let outward = |facet: &Facet, direction| {
        let own = boundary.binary_search_by_key(facet, |(facet, _)| *facet);
        own.map_or(0.0, |at| dot(boundary[at].1.normal, direction))
    };
    let ends: Vec<(Facet, Side)> = to
        .iter()
        .map(|&facet| (facet, Side::of(mesh, facet)))
        .collect();
    let least = SAME_PLACE * mesh.size();
    let stride = from.len().div_ceil(LINES).max(1);
    let (mut longest, mut through, mut lines) = (None::<Void>, 0, 0);
    for &start in from.iter().step_by(stride) {
        let begin = Side::of(mesh, start).middle;
        let distance = |side: &Side| dot(minus(side.middle, begin), minus(side.middle, begin));
        let nearest = ends
            .iter()
            .min_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1)));
        let Some((goal, side)) = nearest else {
            continue;
        };
        let way = minus(side.middle, begin);
        let length = dot(way, way).sqrt();
        // Where the line leaves the body and where it enters it, as shares of its length.
        let mut crossings: Vec<(f64, bool)> = Vec::new();
        for (end, at, facing) in [(&start, 0.0, 1.0), (goal, 1.0, -1.0)] {
            if facing * outward(end, way) > SAME_PLACE * length * length {
                crossings.push((at, facing > 0.0));
            }
        }
        for (facet, side) in &boundary {
            if *facet != start
                && facet != goal
                && let Some(at) = side.crossing(begin, way)
            {
                crossings.push((at, dot(side.normal, way) > 0.0));
            }
        }
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let gaps = crossings.windows(2).filter(|pair| pair[0].1 && !pair[1].1);
        let widest = gaps
            .map(|pair| (pair[0].0, pair[1].0))
            .max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)));
        lines += 1;
        let Some((leaves, enters)) = widest.filter(|(a, b)| (b - a) * length > least) else {
            continue;
        };
        through += 1;
        if longest.is_none_or(|known| (enters - leaves) * length > known.length) {
            let middle = f64::midpoint(leaves, enters);
            longest = Some(Void {
                length: (enters - leaves) * length,
                place: std::array::from_fn(|d| begin[d] + middle * way[d]),
                share: 0.0,
            });
        }
    }
    longest.map(|void| Void {
        share: f64::from(through) / f64::from(lines.max(1)),
        ..void
    })
}

/// The least thickness of a body behind a surface, in the unit of the mesh: the shortest way from the
/// middle of a facet straight inward to the surface again; infinite where none meets it.
pub fn thickness(mesh: &Mesh, surface: &[Facet]) -> f64 {
    let sides: Vec<Side> = surface.iter().map(|&facet| Side::of(mesh, facet)).collect();
    let far = mesh.size();
    let stride = sides.len().div_ceil(LINES).max(1);
    let mut least = f64::INFINITY;
    for side in sides.iter().step_by(stride) {
        let Some(outward) = unit(side.normal) else {
            continue;
        };
        let way = outward.map(|x| -far * x);
        let leaves = |other: &&Side| dot(other.normal, way) > 0.0;
        let ends = sides.iter().filter(leaves);
        let ends = ends.filter_map(|other| other.crossing(side.middle, way));
        // What lies on the facet from outside is another body.
        let ends = ends.filter(|at| *at > SAME_PLACE);
        least = ends.fold(least, |least, at| least.min(at * far));
    }
    least
}

impl Side {
    /// Where on a line from `begin` along `way` it is passed, as a share of `way` between 0 and 1;
    /// none where the line misses it or runs along it.
    fn crossing(&self, begin: [f64; 3], way: [f64; 3]) -> Option<f64> {
        let along = dot(self.normal, way);
        let size = (dot(self.normal, self.normal) * dot(way, way)).sqrt();
        if along.abs() <= SAME_PLACE * size {
            return None;
        }
        let at = dot(self.normal, minus(self.middle, begin)) / along;
        if !(0.0..=1.0).contains(&at) {
            return None;
        }
        let place = std::array::from_fn(|d| begin[d] + at * way[d]);
        self.covers(place).then_some(at)
    }

    /// True if a point of its plane lies within its corners.
    fn covers(&self, place: [f64; 3]) -> bool {
        if let &[a, b] = &self.corners[..] {
            let [low, high] = bounds([a, b]);
            // The one of the two axes along which it is longer.
            let d = usize::from(high[1] - low[1] > high[0] - low[0]);
            return (low[d]..=high[d]).contains(&place[d]);
        }
        self.inward()
            .all(|(at, inward)| dot(inward, minus(place, at)) >= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Axis, Grid2, Grid3, Part};

    /// A body of 4 x 3 (x 2) whose middle third of height is missing between x = 1 and 3, open to one
    /// side or closed.
    fn body(flat: bool, holed: bool) -> Mesh {
        let axis = |high: f64, count| Axis::uniform(0.0, high, count).unwrap();
        let [x, y, z] = [axis(4.0, 8), axis(3.0, 6), axis(2.0, 2)];
        let hole =
            |at: [f64; 3]| holed && (1.0..3.0).contains(&at[0]) && (1.0..2.0).contains(&at[1]);
        let part = |at| {
            if hole(at) {
                Part::Void("hole")
            } else {
                Part::Region("rubber")
            }
        };
        if flat {
            Grid2::new([x, y], "rubber").mesh_by(&part).unwrap()
        } else {
            Grid3::new([x, y, z], "rubber").mesh_by(&part).unwrap()
        }
    }

    #[test]
    fn a_void_between_two_surfaces_is_seen_and_none_where_there_is_none() {
        for flat in [true, false] {
            for (holed, expected) in [(true, Some(1.0)), (false, None)] {
                let mesh = body(flat, holed);
                let [bottom, top] = [0.0, 3.0].map(|y| {
                    let mut named = mesh.clone();
                    named.name_boundary("side", |place| (place[1] - y).abs() < 1e-9);
                    named.surfaces["side"].clone()
                });
                let found = void_between(&mesh, &bottom, &top);
                assert_eq!(
                    found.map(|void| (1e9 * void.length).round() / 1e9),
                    expected
                );
                if let Some(void) = found {
                    assert!((void.share - 0.5).abs() < 1e-12, "{void:?}");
                    assert!((void.place[1] - 1.5).abs() < 1e-9);
                }
                // Along a flat side nothing is seen.
                let half = bottom.len() / 2;
                assert_eq!(void_between(&mesh, &bottom[..half], &bottom[half..]), None);
            }
            // The solid is 1 thick above and below the void and beside it; 3 without it.
            assert!(
                (thickness(&body(flat, true), &body(flat, true).boundary()) - 1.0).abs() < 1e-9
            );
            let whole = body(flat, false);
            let least = if flat { 3.0 } else { 2.0 };
            assert!((thickness(&whole, &whole.boundary()) - least).abs() < 1e-9);
            // The walls of the void see each other across it.
            let mesh = body(flat, true);
            let walls = [1.0, 2.0].map(|y| {
                let mut named = mesh.clone();
                named.name_boundary("wall", |p| {
                    (p[1] - y).abs() < 1e-9 && (0.9..3.1).contains(&p[0])
                });
                named.surfaces["wall"].clone()
            });
            let void = void_between(&mesh, &walls[0], &walls[1]).unwrap();
            assert!(
                (void.length - 1.0).abs() < 1e-9 && void.share == 1.0,
                "{void:?}"
            );
        }
    }
}
