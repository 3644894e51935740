//! A monotone curve through measured or computed points.

/// A piecewise cubic through points that rise in x and rise or fall in y.
///
/// Slopes at the points are those of the parabola through three neighbours,
/// limited so that the curve is monotone between points (Fritsch and Carlson
/// 1980, Hyman 1983). Where the limiter is idle the error is of third order in
/// the spacing.
#[derive(Debug, Clone, PartialEq)]
pub struct MonotoneCurve {
    points: Vec<[f64; 2]>,
    slopes: Vec<f64>,
}

/// Where on a [`MonotoneCurve`] an x lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OnCurve {
    /// Below the first point, which is carried.
    Below([f64; 2]),
    /// Between the ends: the value and its slope.
    Inside {
        /// y(x).
        value: f64,
        /// dy/dx.
        slope: f64,
    },
    /// Above the last point, which is carried.
    Above([f64; 2]),
}

/// Points that make no monotone curve.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// Fewer than two points.
    #[error("a curve needs at least two points; there are {found}")]
    TooFew {
        /// Number of points.
        found: usize,
    },
    /// x does not rise, or y turns back, or a number is not finite.
    #[error(
        "point {index} ({x}, {y}) breaks the curve: x must rise from point to point, \
         y must always rise or always fall"
    )]
    NotMonotone {
        /// Position of the point in the list.
        index: usize,
        /// Its x.
        x: f64,
        /// Its y.
        y: f64,
    },
}

impl MonotoneCurve {
    /// The curve through `points` = [x, y]; `start_slope` is dy/dx at the first
    /// point where it is known.
    ///
    /// # Errors
    /// [`CurveError`] for fewer than two points, or points that are not
    /// monotone in x and in y.
    pub fn new(points: Vec<[f64; 2]>, start_slope: Option<f64>) -> Result<Self, CurveError> {
        if points.len() < 2 {
            return Err(CurveError::TooFew {
                found: points.len(),
            });
        }
        let chords: Vec<f64> = points.windows(2).map(chord).collect();
        for (index, pair) in points.windows(2).enumerate() {
            let sound = pair[1][0] > pair[0][0]
                && chords[index].is_finite()
                && chords[index] * chords[0] > 0.0;
            if !sound {
                let [x, y] = pair[1];
                return Err(CurveError::NotMonotone {
                    index: index + 1,
                    x,
                    y,
                });
            }
        }
        let last = points.len() - 1;
        let slopes = (0..=last)
            .map(|i| match (i, start_slope) {
                (0, Some(slope)) => limited(slope, chords[0], chords[0]),
                _ => limited(
                    parabola_slope(&points, &chords, i),
                    chords[i.saturating_sub(1)],
                    chords[i.min(last - 1)],
                ),
            })
            .collect();
        Ok(Self { points, slopes })
    }

    /// The curve through `points` and others between them, each half way in y, which `at` gives: as many as it
    /// takes to be off by no more than `tolerance` in y there. Where the slope jumps they lie close.
    ///
    /// # Errors
    /// As [`MonotoneCurve::new`], and those of `at`.
    pub fn refined<E: From<CurveError>>(
        mut points: Vec<[f64; 2]>,
        tolerance: f64,
        at: impl Fn(f64) -> Result<[f64; 2], E>,
    ) -> Result<Self, E> {
        // True for the piece before a point, when it needs no point within.
        let mut fine = vec![false; points.len()];
        loop {
            let curve = Self::new(points, None)?;
            if fine[1..].iter().all(|fine| *fine) {
                return Ok(curve);
            }
            let (mut next, mut next_fine) = (vec![curve.points[0]], vec![true]);
            for (pair, fine) in curve.points.windows(2).zip(&fine[1..]) {
                let mut done = *fine;
                let [from, to] = [pair[0], pair[1]];
                // A piece of so little height cannot be off by more.
                if !done && (to[1] - from[1]).abs() > tolerance {
                    let middle = at(f64::midpoint(from[1], to[1]))?;
                    let off = match curve.at(middle[0]) {
                        OnCurve::Inside { value, .. } => (value - middle[1]).abs(),
                        _ => f64::INFINITY,
                    };
                    done = off <= tolerance;
                    next.push(middle);
                    next_fine.push(done);
                } else {
                    done = true;
                }
                next.push(to);
                next_fine.push(done);
            }
            (points, fine) = (next, next_fine);
        }
    }

    /// The curve through `points` whose slopes dy/dx are known there; they are limited so that it is
    /// monotone between points.
    ///
    /// # Errors
    /// As [`MonotoneCurve::new`]; also for slopes that are not finite or not as many as points.
    pub fn with_slopes(points: Vec<[f64; 2]>, slopes: &[f64]) -> Result<Self, CurveError> {
        let mut curve = Self::new(points, None)?;
        let points = &curve.points;
        let wrong = points.iter().enumerate().find(|(index, _)| {
            let slope = slopes.get(*index);
            !slope.is_some_and(|slope| slope.is_finite())
        });
        if let Some((index, [x, y])) = wrong {
            return Err(CurveError::NotMonotone {
                index,
                x: *x,
                y: *y,
            });
        }
        let chords: Vec<f64> = points.windows(2).map(chord).collect();
        let last = chords.len() - 1;
        curve.slopes = (0..points.len())
            .map(|i| limited(slopes[i], chords[i.saturating_sub(1)], chords[i.min(last)]))
            .collect();
        Ok(curve)
    }

    /// The same curve with all x multiplied by a positive `factor`.
    #[must_use]
    pub fn stretched(mut self, factor: f64) -> Self {
        for (point, slope) in self.points.iter_mut().zip(&mut self.slopes) {
            point[0] *= factor;
            *slope /= factor;
        }
        self
    }

    /// Value and slope at `x`; a NaN counts as below.
    pub fn at(&self, x: f64) -> OnCurve {
        let (first, last) = (self.points[0], self.end());
        if x > last[0] {
            return OnCurve::Above(last);
        }
        if x.is_nan() || x < first[0] {
            return OnCurve::Below(first);
        }
        let right = self
            .points
            .partition_point(|point| point[0] < x)
            .clamp(1, self.points.len() - 1);
        let (a, b) = (self.points[right - 1], self.points[right]);
        let (from, to) = (self.slopes[right - 1], self.slopes[right]);
        let width = b[0] - a[0];
        let t = (x - a[0]) / width;
        let chord = (b[1] - a[1]) / width;
        // Hermite's cubic in Horner form about the left point.
        let cubic = from + to - 2.0 * chord;
        let square = chord - from - cubic;
        OnCurve::Inside {
            value: a[1] + width * t * (from + t * (square + t * cubic)),
            slope: from + t * (2.0 * square + t * 3.0 * cubic),
        }
    }

    /// The points.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The last point.
    pub fn end(&self) -> [f64; 2] {
        self.points[self.points.len() - 1]
    }

    /// dy/dx at the first point.
    pub fn start_slope(&self) -> f64 {
        self.slopes[0]
    }

    /// dy/dx at the last point.
    pub fn end_slope(&self) -> f64 {
        self.slopes[self.slopes.len() - 1]
    }
}

fn chord(pair: &[[f64; 2]]) -> f64 {
    (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0])
}

/// Slope at point `i` of the parabola through it and its neighbours, or the
/// nearest two at an end.
fn parabola_slope(points: &[[f64; 2]], chords: &[f64], i: usize) -> f64 {
    let Some(&[a, b]) = chords
        .get(i.saturating_sub(1).min(chords.len().saturating_sub(2))..)
        .and_then(|rest| rest.first_chunk::<2>())
    else {
        return chords[0];
    };
    let middle = i.clamp(1, points.len() - 2);
    let left = points[middle][0] - points[middle - 1][0];
    let right = points[middle + 1][0] - points[middle][0];
    // Newton's second divided difference gives the bend of the parabola.
    let bend = (b - a) / (left + right);
    match i {
        0 => a - bend * left,
        _ if i == points.len() - 1 => b + bend * right,
        _ => a + bend * left,
    }
}

/// `slope` with the sign of its two chords and at most three times the smaller.
fn limited(slope: f64, left: f64, right: f64) -> f64 {
    let most = 3.0 * left.abs().min(right.abs());
    (slope * left.signum()).clamp(0.0, most) * left.signum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(curve: &MonotoneCurve, x: f64) -> f64 {
        match curve.at(x) {
            OnCurve::Inside { value, .. } => value,
            outside => panic!("{outside:?}"),
        }
    }

    #[test]
    fn a_parabola_is_reproduced() {
        let points = [0.0, 0.7, 1.0, 2.5].map(|x: f64| [x, x + x * x]).to_vec();
        let curve = MonotoneCurve::new(points, None).unwrap();
        for x in [0.0, 0.2, 0.7, 0.9, 1.9, 2.5] {
            // Rounding of numbers below 10.
            assert!((value(&curve, x) - (x + x * x)).abs() < 1e-14, "{x}");
        }
    }

    #[test]
    fn known_slopes_give_a_cubic_and_steep_ones_are_limited() {
        let cubic = |x: f64| x + 0.5 * x * x + x.powi(3);
        let nodes = [0.0, 0.8, 1.3, 2.0];
        let slopes = nodes.map(|x: f64| 1.0 + x + 3.0 * x * x);
        let points = nodes.map(|x| [x, cubic(x)]).to_vec();
        let curve = MonotoneCurve::with_slopes(points.clone(), &slopes).unwrap();
        for x in [0.0, 0.3, 0.8, 1.0, 1.7, 2.0] {
            // Rounding of numbers below 20.
            assert!((value(&curve, x) - cubic(x)).abs() < 1e-14, "{x}");
        }
        let steep = MonotoneCurve::with_slopes(points.clone(), &slopes.map(|s| 50.0 * s)).unwrap();
        let mut before = 0.0;
        for step in 0..=200 {
            let here = value(&steep, 0.01 * f64::from(step));
            assert!(here >= before, "{step}");
            before = here;
        }
        for wrong in [&slopes[..3], &[1.0, f64::NAN, 1.0, 1.0]] {
            assert!(MonotoneCurve::with_slopes(points.clone(), wrong).is_err());
        }
    }

    /// A law with a bend at 0.3137, rising and falling: no point is off by more than twice the tolerance, which is
    /// kept half way, with a sixth of the points that it takes everywhere.
    #[test]
    fn a_bend_between_points_is_found() {
        for sign in [1.0, -1.0] {
            let law = |y: f64| y + 0.1 * y * y + 5.0 * (y - 0.3137).max(0.0);
            let at = |y: f64| Ok::<_, CurveError>([law(sign * y), y]);
            let points: Vec<_> = (0..=8)
                .map(|i| at(sign * f64::from(i) / 8.0).unwrap())
                .collect();
            let curve = MonotoneCurve::refined(points, 1e-5, at).unwrap();
            for i in 0..10_000 {
                let y = sign * f64::from(i) / 10_000.0;
                let off = (value(&curve, law(y.abs())) - y).abs();
                assert!(off < 2e-5, "{y}: {off}");
            }
            assert!(curve.points().len() < 80, "{}", curve.points().len());
        }
    }

    #[test]
    fn slope_is_the_derivative() {
        let points = vec![[0.0, 1.0], [1.0, 0.5], [1.5, 0.45], [4.0, 0.1]];
        let curve = MonotoneCurve::new(points, Some(-0.6)).unwrap();
        assert_eq!(curve.start_slope(), -0.6);
        for x in [0.1, 0.6, 1.2, 2.0, 3.7] {
            let OnCurve::Inside { slope, .. } = curve.at(x) else {
                panic!()
            };
            let difference = (value(&curve, x + 1e-6) - value(&curve, x - 1e-6)) / 2e-6;
            // Central difference: rounding 1e-16/1e-6, third derivative below 10.
            assert!((slope - difference).abs() < 1e-9);
        }
    }

    #[test]
    fn ends_are_reported_and_bad_points_refused() {
        let curve = MonotoneCurve::new(vec![[0.0, 1.0], [1.0, 0.5]], None).unwrap();
        assert_eq!(curve.at(-0.1), OnCurve::Below([0.0, 1.0]));
        assert_eq!(curve.at(1.1), OnCurve::Above([1.0, 0.5]));
        assert_eq!(curve.at(f64::NAN), OnCurve::Below([0.0, 1.0]));
        let refused = |points: Vec<[f64; 2]>| MonotoneCurve::new(points, None).unwrap_err();
        assert_eq!(refused(vec![[0.0, 1.0]]), CurveError::TooFew { found: 1 });
        for bad in [
            vec![[0.0, 1.0], [1.0, 0.5], [1.0, 0.4]],
            vec![[0.0, 1.0], [1.0, 0.5], [2.0, 0.6]],
            vec![[0.0, 1.0], [1.0, 0.5], [2.0, f64::NAN]],
        ] {
            assert!(matches!(
                refused(bad),
                CurveError::NotMonotone { index: 2, .. }
            ));
        }
    }
}
