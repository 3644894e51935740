//! Smooth functions of a few variables through computed points.

use crate::dense::{Rows, cholesky, cholesky_solve, dot, square};

/// Lengths of the kernel that are tried, over the sides of the box: below the first the points of a
/// hundred in four dimensions do not see each other, beyond the last the kernel is a parabola, which
/// the trend has.
const LENGTHS: [f64; 2] = [0.05, 20.0];
/// Variance of the noise of values that are computed, over that of the process: a deviation of 1e-5, above
/// what an iteration leaves of a solution and below what anyone asks of a surface. A free one would take
/// for noise what one variable bends by a little.
const NUGGET: f64 = 1e-10;
/// Most rounds of the search over all lengths: some ten settle them, and a round more costs little.
const MOST_ROUNDS: usize = 30;
/// Steps of a search along a line: they shorten its bracket of ln 400 to 0.02, lengths known within 2 %, which moves
/// the likelihood by less than any choice of points does. A round that moves no length by more ends the search.
const STEPS: usize = 12;
const SETTLED: f64 = 0.02;

/// Ordinary kriging of several outputs over the unit cube: a quadratic trend, and on what it leaves a
/// Matérn kernel of order 5/2 with one length for each variable, the same for all outputs
/// (Rasmussen and Williams 2006, equations 4.17 and 5.8).
///
/// # Example
/// ```
/// use taxel_numerics::Kriging;
/// let points: Vec<Vec<f64>> = (0..81)
///     .map(|i| vec![f64::from(i % 9) / 8.0, f64::from(i / 9) / 8.0])
///     .collect();
/// let values: Vec<Vec<f64>> = points.iter().map(|x| vec![(2.0 * x[0]).sin() * x[1].exp()]).collect();
/// let surface = Kriging::fit(&points, &values).unwrap();
/// let mut answer = vec![[0.0; 5]];
/// surface.at(&[0.3, 0.6], &mut answer);
/// let error = answer[0][0] - 0.6_f64.sin() * 0.6_f64.exp();
/// assert!(error.abs() < 2e-3, "{error}");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Kriging {
    lengths: Vec<f64>,
    nugget: f64,
    points: Rows,
    /// Of each output the coefficients of the trend.
    trend: Rows,
    /// ... and the weights of the kernel at each point.
    weights: Rows,
    /// Cholesky's factor of the correlations of the points.
    factor: Rows,
    /// Standard deviation of the process of each output.
    deviations: Vec<f64>,
}

/// Value and slopes of an output by up to four variables.
pub type Answer = [f64; 5];

impl Kriging {
    /// The surface through `values`, a row for each of `points`, whose lengths make the values
    /// likeliest. None without twice as many points as the trend has coefficients.
    pub fn fit(points: &[Vec<f64>], values: &[Vec<f64>]) -> Option<Self> {
        let count = points.first()?.len();
        // Natural logarithms.
        let mut at = vec![0.0; count];
        let left = residuals(points, values)?;
        let ends = LENGTHS.map(f64::ln);
        for _ in 0..MOST_ROUNDS {
            let before = at.clone();
            // All by one factor, because a smooth function leaves a ridge along it, then each by itself.
            for which in std::iter::once(0..count).chain((0..count).map(|one| one..one + 1)) {
                let moved = |by: f64| {
                    let mut there = at.clone();
                    there[which.clone()].iter_mut().for_each(|ln| *ln += by);
                    there
                };
                let span = at[which.clone()].iter();
                let [low, high] = [
                    span.clone().copied().fold(f64::INFINITY, f64::min),
                    span.copied().fold(f64::NEG_INFINITY, f64::max),
                ];
                let by = least([ends[0] - low, ends[1] - high], |by| {
                    unlikelihood(points, &left, &moved(by))
                });
                at = moved(by);
            }
            let moves = at.iter().zip(&before).map(|(now, then)| (now - then).abs());
            if moves.fold(0.0, f64::max) < SETTLED {
                break;
            }
        }
        let lengths = at.iter().map(|ln| ln.exp()).collect();
        Self::with(points, values, lengths, NUGGET)
    }

    /// The surface of these lengths and this variance of the noise over that of the process.
    ///
    /// None where points coincide, or are too few.
    pub fn with(
        points: &[Vec<f64>],
        values: &[Vec<f64>],
        lengths: Vec<f64>,
        nugget: f64,
    ) -> Option<Self> {
        let trend = trend(points, values)?;
        let left = left(points, values, &trend);
        let factor = cholesky(correlations(points, &lengths, nugget))?;
        let weights: Rows = left.iter().map(|of| cholesky_solve(&factor, of)).collect();
        let count = points.len() as f64;
        let pairs = weights.iter().zip(&left);
        let deviations = pairs.map(|(weights, left)| (dot(weights, left) / count).sqrt());
        Some(Self {
            deviations: deviations.collect(),
            lengths,
            nugget,
            points: points.to_vec(),
            trend,
            weights,
            factor,
        })
    }

    /// Length of the kernel along each variable.
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// Variance of the noise over that of the process.
    pub fn nugget(&self) -> f64 {
        self.nugget
    }

    /// Value and slopes of the first outputs, as many as `answer` has, at a point.
    pub fn at(&self, x: &[f64], answer: &mut [Answer]) {
        let count = x.len();
        let mut terms = [0.0; MOST_TERMS];
        let mut slopes = [[0.0; MOST_TERMS]; 4];
        let used = terms_at(x, &mut terms);
        for (along, slopes) in slopes[..count].iter_mut().enumerate() {
            term_slopes(x, along, slopes);
        }
        for (output, trend) in answer.iter_mut().zip(&self.trend) {
            *output = [0.0; 5];
            output[0] = dot(trend, &terms[..used]);
            for (slope, along) in output[1..].iter_mut().zip(&slopes[..count]) {
                *slope = dot(trend, &along[..used]);
            }
        }
        for (number, point) in self.points.iter().enumerate() {
            let distance = distance(x, point, &self.lengths);
            let decay = (-ROOT_5 * distance).exp();
            let value = (1.0 + ROOT_5 * distance + 5.0 / 3.0 * distance * distance) * decay;
            let by_distance = -5.0 / 3.0 * (1.0 + ROOT_5 * distance) * decay;
            let mut kernel = [0.0; 5];
            kernel[0] = value;
            for along in 0..count {
                let length = self.lengths[along];
                kernel[1 + along] = by_distance * (x[along] - point[along]) / (length * length);
            }
            for (output, weights) in answer.iter_mut().zip(&self.weights) {
                for (sum, part) in output.iter_mut().zip(kernel) {
                    *sum += weights[number] * part;
                }
            }
        }
    }

    /// Standard deviation of each output at a point, by the distance from the points that are known.
    pub fn deviation(&self, x: &[f64]) -> Vec<f64> {
        let points = self.points.iter();
        let near: Vec<f64> = points
            .map(|point| kernel(distance(x, point, &self.lengths)))
            .collect();
        let known = dot(&near, &cholesky_solve(&self.factor, &near));
        let share = (1.0 - known).max(0.0).sqrt();
        self.deviations.iter().map(|own| own * share).collect()
    }

    /// What each output misses each point by that is left out, from the surface through the others
    /// with the same trend: [K⁻¹ y]ᵢ / [K⁻¹]ᵢᵢ. A row for each output.
    pub fn left_out(&self) -> Rows {
        let count = self.points.len();
        let diagonal = (0..count).map(|i| {
            let unit: Vec<f64> = (0..count).map(|j| f64::from(u8::from(i == j))).collect();
            cholesky_solve(&self.factor, &unit)[i]
        });
        let diagonal: Vec<f64> = diagonal.collect();
        let of_output = |weights: &Vec<f64>| {
            let pairs = weights.iter().zip(&diagonal);
            pairs.map(|(weight, own)| weight / own).collect()
        };
        self.weights.iter().map(of_output).collect()
    }
}

const ROOT_5: f64 = 2.236_067_977_499_79;
/// Rounding of a least-squares solution over the size of its values: a thousand units in the last
/// place, for matrices whose condition is that of a quadratic on a cube.
const ROUNDING: f64 = 1e3 * f64::EPSILON;
/// Terms of a quadratic of four variables.
const MOST_TERMS: usize = 15;

/// Matérn 5/2.
fn kernel(distance: f64) -> f64 {
    let r = ROOT_5 * distance;
    (1.0 + r + r * r / 3.0) * (-r).exp()
}

fn distance(a: &[f64], b: &[f64], lengths: &[f64]) -> f64 {
    let sides = a.iter().zip(b).zip(lengths);
    sides
        .map(|((a, b), length)| ((a - b) / length).powi(2))
        .sum::<f64>()
        .sqrt()
}

fn correlations(points: &[Vec<f64>], lengths: &[f64], nugget: f64) -> Rows {
    square(points.len(), |i, j| {
        let own = if i == j { nugget } else { 0.0 };
        kernel(distance(&points[i], &points[j], lengths)) + own
    })
}

/// The terms 1, t, and all products of two t with t = 2 x - 1.
fn terms_at(x: &[f64], terms: &mut [f64; MOST_TERMS]) -> usize {
    terms[0] = 1.0;
    let mut used = 1;
    for i in 0..x.len() {
        let t = 2.0 * x[i] - 1.0;
        terms[used] = t;
        used += 1;
        for other in &x[..=i] {
            terms[used] = t * (2.0 * other - 1.0);
            used += 1;
        }
    }
    used
}

/// Their slopes by one variable.
fn term_slopes(x: &[f64], along: usize, slopes: &mut [f64; MOST_TERMS]) {
    let mut used = 1;
    let own = |i: usize| if i == along { 2.0 } else { 0.0 };
    for i in 0..x.len() {
        slopes[used] = own(i);
        used += 1;
        for j in 0..=i {
            slopes[used] = own(i) * (2.0 * x[j] - 1.0) + own(j) * (2.0 * x[i] - 1.0);
            used += 1;
        }
    }
}

/// Coefficients of the quadratic trend of each output, by least squares.
fn trend(points: &[Vec<f64>], values: &[Vec<f64>]) -> Option<Rows> {
    let design: Rows = points
        .iter()
        .map(|x| {
            let mut terms = [0.0; MOST_TERMS];
            let used = terms_at(x, &mut terms);
            terms[..used].to_vec()
        })
        .collect();
    if points.len() < 2 * design.first()?.len() {
        return None;
    }
    let outputs = 0..values[0].len();
    let solved = outputs.map(|output| {
        let target: Vec<f64> = values.iter().map(|row| row[output]).collect();
        Some(crate::least_squares::linear::solve(&design, &target)?.coefficients)
    });
    solved.collect()
}

/// What the trend leaves of each output.
fn left(points: &[Vec<f64>], values: &[Vec<f64>], trend: &[Vec<f64>]) -> Rows {
    let of_output = |(output, trend): (usize, &Vec<f64>)| {
        let rows = points.iter().zip(values);
        rows.map(|(x, row)| {
            let mut terms = [0.0; MOST_TERMS];
            let used = terms_at(x, &mut terms);
            row[output] - dot(trend, &terms[..used])
        })
        .collect()
    };
    trend.iter().enumerate().map(of_output).collect()
}

/// The same without outputs of which the trend leaves no more than rounding: noise that says nothing
/// of the kernel.
fn residuals(points: &[Vec<f64>], values: &[Vec<f64>]) -> Option<Rows> {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let left = left(points, values, &trend(points, values)?);
    let outputs = left.into_iter().enumerate();
    let is_bent = |(output, left): &(usize, Vec<f64>)| {
        let size = largest(&mut values.iter().map(|row| row[*output].abs()));
        largest(&mut left.iter().map(|left| left.abs())) > ROUNDING * size
    };
    Some(outputs.filter(is_bent).map(|(_, left)| left).collect())
}

/// The negative logarithm of the likelihood of what the trend leaves, without constants, each output
/// with its own likeliest deviation.
fn unlikelihood(points: &[Vec<f64>], left: &[Vec<f64>], at: &[f64]) -> f64 {
    let lengths: Vec<f64> = at.iter().map(|ln| ln.exp()).collect();
    let Some(factor) = cholesky(correlations(points, &lengths, NUGGET)) else {
        return f64::INFINITY;
    };
    let determinant: f64 = (0..points.len()).map(|i| factor[i][i].ln()).sum();
    let count = points.len() as f64;
    let of_output = |values: &Vec<f64>| {
        let square = dot(values, &cholesky_solve(&factor, values)) / count;
        0.5 * count * square.ln() + determinant
    };
    left.iter().map(of_output).sum()
}

/// The place of the least value between two ends, by golden sections.
fn least([mut low, mut high]: [f64; 2], value: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let mut inner = [high - golden * (high - low), low + golden * (high - low)];
    let mut at = inner.map(&value);
    for _ in 0..STEPS {
        if at[0] < at[1] {
            high = inner[1];
            inner = [high - golden * (high - low), inner[0]];
            at = [value(inner[0]), at[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + golden * (high - low)];
            at = [at[1], value(inner[1])];
        }
    }
    if at[0] < at[1] { inner[0] } else { inner[1] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sobol;

    fn smooth(x: &[f64]) -> Vec<f64> {
        let bent = (3.0 * x[0]).sin() * (1.0 + x[1] * x[1]) + x[2].exp();
        vec![bent, x[0] * x[1] - 0.5 * x[2]]
    }

    /// Through the corners of the cube and points within, as tables have them.
    fn surface(count: usize) -> Kriging {
        let side = |corner: usize, bit: usize| f64::from(u8::from(corner >> bit & 1 == 1));
        let corners = (0..8).map(|corner| (0..3).map(|bit| side(corner, bit)).collect());
        let points: Rows = corners.chain(sobol(3, count - 8, Some(7))).collect();
        let values: Rows = points.iter().map(|x| smooth(x)).collect();
        Kriging::fit(&points, &values).unwrap()
    }

    #[test]
    fn a_smooth_function_is_met_between_its_points_and_slopes_are_those_of_the_surface() {
        let surface = surface(80);
        let mut answer = [[0.0; 5]; 2];
        let mut moved = answer;
        for x in sobol(3, 200, Some(99)) {
            surface.at(&x, &mut answer);
            let truth = smooth(&x);
            // Half a hundredth of the range of 4: a sixth of a period of the sine lies in the cube. The bilinear output
            // is in the trend.
            assert!((answer[0][0] - truth[0]).abs() < 2e-2, "{x:?}");
            assert!((answer[1][0] - truth[1]).abs() < 1e-9, "{x:?}");
            for along in 0..3 {
                let slope = [-1e-6, 1e-6].map(|step| {
                    let mut there = x.clone();
                    there[along] += step;
                    surface.at(&there, &mut moved);
                    moved[0][0]
                });
                // Central differences: round-off of 1e-16 times weights of 1e4 over the step.
                let by_difference = (slope[1] - slope[0]) / 2e-6;
                assert!((answer[0][1 + along] - by_difference).abs() < 1e-4);
            }
        }
    }

    /// No factor on one length, on some or on all of them makes the values likelier: the search does not stop on the
    /// ridge that smooth functions leave along a common factor. (An independent program finds 2.1 to 2.2, 4.4 and 7.1 to
    /// 7.5 for this function.)
    #[test]
    fn the_lengths_are_the_likeliest() {
        let surface = surface(80);
        let values: Rows = surface.points.iter().map(|x| smooth(x)).collect();
        let left = residuals(&surface.points, &values).unwrap();
        let own: Vec<f64> = surface.lengths.iter().map(|length| length.ln()).collect();
        let best = unlikelihood(&surface.points, &left, &own);
        for which in 1..8_usize {
            for by in [-0.3, 0.3] {
                let side =
                    |(at, ln): (usize, &f64)| if which >> at & 1 == 1 { ln + by } else { *ln };
                let there: Vec<f64> = own.iter().enumerate().map(side).collect();
                let other = unlikelihood(&surface.points, &left, &there);
                assert!(other > best, "{which} {by}: {other} {best}");
            }
        }
    }

    #[test]
    fn a_point_left_out_is_missed_as_the_surface_without_it_misses_it() {
        let all = surface(40);
        let values: Rows = all.points.iter().map(|x| smooth(x)).collect();
        let errors = all.left_out();
        // The trend is that of all points in both, so that only the kernel leaves the point out.
        let left = left(&all.points, &values, &all.trend);
        for out in 0..40 {
            let keep = |index: &usize| *index != out;
            let kept: Rows = (0..40)
                .filter(keep)
                .map(|i| all.points[i].clone())
                .collect();
            let target: Vec<f64> = (0..40).filter(keep).map(|i| left[0][i]).collect();
            let factor = cholesky(correlations(&kept, &all.lengths, all.nugget)).unwrap();
            let weights = cholesky_solve(&factor, &target);
            let near: Vec<f64> = kept
                .iter()
                .map(|x| kernel(distance(x, &all.points[out], &all.lengths)))
                .collect();
            let missed = left[0][out] - dot(&near, &weights);
            // Round-off times the condition of the correlations, some 1e8.
            assert!((errors[0][out] - missed).abs() < 1e-6, "{out}");
        }
    }

    #[test]
    fn nothing_is_known_far_away_and_all_at_a_point() {
        let surface = surface(60);
        let [at, far] = [surface.points[5].clone(), vec![9.0; 3]].map(|x| surface.deviation(&x)[0]);
        // What rounding and the noise leave of it.
        assert!(at < 1e-2 * surface.deviations[0]);
        assert!(far > 0.5 * surface.deviations[0]);
    }
}
