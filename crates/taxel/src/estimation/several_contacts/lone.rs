//! One contact whose position is known better than the steps of the grid: size by size, a
//! normal law about the best position.

use super::super::localisation::{ContactPosition, holding_95};
use super::population::Spread;
use super::{Scene, Shape};

/// Sizes between two of the tables.
const BETWEEN: usize = 6;
/// Steps of the search for the best position of a size.
const ITERATIONS: usize = 8;
/// Sizes whose misfit is larger than the least one by so many variances are not refined.
const LIKELY: f64 = 40.0;
/// A step shorter than this, in steps of the grid, ends it.
const SETTLED: f64 = 1e-2;

/// The best contact of one size: misfit, covariance of its position xx, xy, yy, and the
/// logarithm of the volume of what is as likely.
#[derive(Debug, Clone, Copy)]
struct Best {
    shape: Shape,
    misfit: f64,
    covariance: [f64; 3],
    volume: f64,
}

/// Directions and, in deviations, distances of the points that stand for a normal law of two
/// coordinates: the medians of its thirds by distance.
const DIRECTIONS: usize = 6;
const DISTANCES: [f64; 3] = [0.604, 1.177, 1.893];

/// Points that stand for a normal law of this covariance xx, xy, yy about a middle.
fn around([x, y]: [f64; 2], [xx, xy, yy]: [f64; 3]) -> impl Iterator<Item = [f64; 2]> {
    let along = xx.sqrt();
    let across = (yy - xy * xy / xx).max(0.0).sqrt();
    (0..DIRECTIONS).flat_map(move |direction| {
        let turn = std::f64::consts::TAU * direction as f64 / DIRECTIONS as f64;
        let (sine, cosine) = turn.sin_cos();
        DISTANCES.map(|far| {
            let [a, b] = [far * cosine, far * sine];
            [x + along * a, y + xy / along * a + across * b]
        })
    })
}

/// Adds what is not there yet.
fn add(all: &mut Vec<Best>, one: Best) {
    let same = |other: &Best| {
        let off = |axis: usize| (one.shape.at[axis] - other.shape.at[axis]).abs();
        (one.shape.size - other.shape.size).abs() < 0.5 / BETWEEN as f64 && off(0).max(off(1)) < 1.0
    };
    if !all.iter().any(same) {
        all.push(one);
    }
}

impl Scene<'_> {
    /// Position, size and force of a lone contact; given however badly they are known.
    ///
    /// The grid is enough for a position that spreads over many of its steps. Otherwise each
    /// likely size has a best position and a normal law about it, and the position is that
    /// of their mixture, each weighed by exp(−χ²/2) and the square root of the determinant
    /// of its covariance (Laplace's method). Sizes lie as close as their own spread needs;
    /// the bend of the positions over the size is kept.
    pub(super) fn lone(&self, deviations: &[f64]) -> Option<ContactPosition> {
        let elements = self.fit.model.rows * self.fit.model.columns;
        if self.forces.len() != elements || deviations.len() != elements {
            return None;
        }
        let found = self.fit.searched(self.forces, deviations)?;
        if found.narrow.is_empty() {
            return Some(found.position);
        }
        let starts = found.narrow.iter();
        let nodes = starts.filter_map(|(at, radius)| self.of_size(*at, *radius as f64));
        let nodes: Vec<Best> = nodes.collect();
        let least = nodes.iter().map(|one| one.misfit);
        let least = least.fold(f64::INFINITY, f64::min);
        let mut all: Vec<Best> = Vec::new();
        let most = least + LIKELY * ((least / found.freedom).max(1.0));
        for node in nodes.iter().filter(|node| node.misfit <= most) {
            add(&mut all, *node);
            for side in [-1.0, 1.0] {
                let mut at = node.shape.at;
                for part in 1..BETWEEN {
                    let size = node.shape.size + side * part as f64 / BETWEEN as f64;
                    if !(0.0..=self.limits()[2]).contains(&size) {
                        break;
                    }
                    let Some(best) = self.of_size(at, size) else {
                        break;
                    };
                    at = best.shape.at;
                    add(&mut all, best);
                }
            }
        }
        let far = self.far();
        let least = all.iter().map(|one| one.misfit);
        let least = least.fold(f64::INFINITY, f64::min);
        // Where the grid found a better one, these are not the whole.
        if !least.is_finite() || least - far > found.position.misfit + 1.0 {
            return Some(found.position);
        }
        let misfit = (least - far).max(0.0);
        let worse = (misfit / found.freedom).max(1.0);
        let weight = |one: &Best| (0.5 * (least - one.misfit) / worse + one.volume).exp();
        let sum: f64 = all.iter().map(weight).sum();
        let mean = |of: &dyn Fn(&Best) -> f64| -> f64 {
            all.iter().map(|one| weight(one) * of(one)).sum::<f64>() / sum
        };
        let at = [0, 1].map(|axis| mean(&|one| one.shape.at[axis]));
        let covariance = [[0, 0], [0, 1], [1, 1]].map(|[p, q]| {
            let entry = p + q;
            mean(&|one| {
                let [off, other] = [p, q].map(|axis| one.shape.at[axis] - at[axis]);
                worse * one.covariance[entry] + off * other
            })
        });
        let possible = all.iter().flat_map(|one| {
            let off = [0, 1].map(|axis| one.shape.at[axis] - at[axis]);
            let law = one.covariance.map(|entry| worse * entry);
            around(off, law).map(move |off| (off, weight(one)))
        });
        let covariance = holding_95(covariance, possible);
        let mean = Shape {
            at,
            size: mean(&|one| one.shape.size),
            force: mean(&|one| one.shape.force),
        };
        Some(self.position(&Spread { mean, covariance }, misfit))
    }

    /// The best position of a contact of one size near `at`; `None` where it would pull.
    fn of_size(&self, at: [f64; 2], size: f64) -> Option<Best> {
        let limits = self.limits();
        let mut at = at;
        let mut best: Option<Best> = None;
        for _ in 0..ITERATIONS {
            let (next, step) = self.normal_law(at, size)?;
            if best.is_some_and(|best| next.misfit >= best.misfit) {
                break;
            }
            best = Some(next);
            let moved = [0, 1].map(|axis| (at[axis] + step[axis]).clamp(0.0, limits[axis]));
            if (0..2).all(|axis| (moved[axis] - at[axis]).abs() < SETTLED) {
                break;
            }
            at = moved;
        }
        best
    }

    /// The contact of this position and size with the best force, and the step of Gauss and
    /// Newton from there.
    fn normal_law(&self, at: [f64; 2], size: f64) -> Option<(Best, [f64; 2])> {
        // Sums of products of share, slopes along x and y, and force.
        let mut sums = [[0.0; 4]; 3];
        // Straight lines between the logarithms in place of the shares.
        let logs = self.fit.logs();
        Scene::each(
            logs,
            &self.fit.model,
            at,
            size,
            |element, [log, x, y, _]| {
                let share = log.exp() * self.roots[element];
                let row = [share, x * share, y * share, self.weighted[element]];
                for (sums, a) in sums.iter_mut().zip(row) {
                    for (sum, b) in sums.iter_mut().zip(row) {
                        *sum += a * b;
                    }
                }
            },
        );
        let [share, x, y] = sums;
        let force = share[3] / share[0];
        if force.is_nan() || force <= 0.0 {
            return None;
        }
        // What the force does not take up of the slopes.
        let own = |a: [f64; 4], b: usize| a[b] - a[0] * share[b] / share[0];
        let [xx, xy, yy] = [own(x, 1), own(x, 2), own(y, 2)].map(|entry| force * force * entry);
        let [dx, dy] = [own(x, 3), own(y, 3)].map(|entry| force * entry);
        // Anywhere on the array beforehand: keeps what is open within it.
        let limits = self.limits();
        let [along_x, along_y] = [0, 1].map(|axis| 12.0 / limits[axis].max(1.0).powi(2));
        let (xx, yy) = (xx + along_x, yy + along_y);
        let determinant = xx * yy - xy * xy;
        let covariance = [yy, -xy, xx].map(|entry| entry / determinant);
        let [cxx, cxy, cyy] = covariance;
        let square: f64 = self.weighted.iter().map(|force| force * force).sum();
        let best = Best {
            shape: Shape { at, size, force },
            misfit: square - force * share[3],
            covariance,
            volume: -0.5 * determinant.ln(),
        };
        Some((best, [cxx * dx + cxy * dy, cxy * dx + cyy * dy]))
    }
}
