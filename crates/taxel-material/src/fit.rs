//! The fit of one law to the points of one or more tests.
//!
//! The stress is linear in the moduli of every law; these are found inside, so that a search
//! has only the other constants: Gent's limit, Ogden's exponents, the slack.

use crate::interval::{self, student};
use crate::law::{Law, Mode};
use crate::minimum::{least, simplex, solved};
use crate::steps::Specimen;

/// Form of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// Neo-Hookean.
    NeoHookean,
    /// Mooney and Rivlin.
    MooneyRivlin,
    /// Yeoh, of three constants.
    Yeoh,
    /// Gent.
    Gent,
    /// Gent with this share of the second invariant in the shear modulus: what a pull cannot
    /// tell from Gent, and compression can.
    GentShare(f64),
    /// Ogden, of so many terms: one to [`MOST_TERMS`].
    Ogden(usize),
}

/// Most terms of Ogden's law that are fitted.
pub const MOST_TERMS: usize = 3;

/// What a residual is measured by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Weights {
    /// The stress, but at least a twentieth of the largest one (default).
    #[default]
    Relative,
    /// Nothing.
    Absolute,
}

/// What a point counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Measure {
    /// The strain that it stands for: thinning a file does not change the fit (default).
    #[default]
    Stretch,
    /// As much as any other.
    Points,
}

/// Whether the zero of the strain is that of the file.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Slack {
    /// Fitted, and kept where it matters (default).
    #[default]
    WhereItMatters,
    /// Fitted and kept.
    Fitted,
    /// This strain; 0: the file is right.
    Given(f64),
}

/// Why no law was fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// No test.
    #[error("there is no test")]
    NoTest,
    /// Tests begin at different preloads, or some at one and others at none.
    #[error("the tests begin at different preloads: fit those of one preload together")]
    Preloads,
    /// A slack is asked for of tests that begin at a preload.
    #[error("a test that begins at a preload has no slack: leave out --slack, or the preload")]
    SlackAndPreload,
    /// No stretch up to two has the preload.
    #[error(
        "no stretch up to 2 has the preload by the law {law}: look at the preload and the area"
    )]
    Preload {
        /// The law.
        law: &'static str,
    },
    /// The tests do not tell the constants apart.
    #[error("the tests do not tell the constants of {law} apart: {known}")]
    NotIdentified {
        /// The law.
        law: &'static str,
        /// What they say nevertheless.
        known: &'static str,
    },
}

/// A fitted law.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Form of the law.
    pub form: Form,
    /// Moduli in Pa, the linear constants.
    pub moduli: Vec<f64>,
    /// Gent's limit.
    pub limit: Option<f64>,
    /// Ogden's exponents, as many as moduli; none of other laws.
    pub exponents: Vec<f64>,
    /// Slack that was taken out, a strain.
    pub slack: f64,
    /// True if the slack is one of the fitted constants.
    pub slack_fitted: bool,
    /// Shear modulus of the same law fitted with the slack left in, Pa; none where none was taken out.
    pub modulus_with_slack: Option<f64>,
    /// Shear modulus, Pa.
    pub shear_modulus: f64,
    /// Mean square of the weighted residuals.
    pub misfit: f64,
    /// Effective number of points.
    pub effective: f64,
    /// Points of the files.
    pub points: usize,
    /// Degrees of freedom.
    pub freedom: f64,
    /// Interval of 95 % of the shear modulus by its profile, Pa; none where the misfit is
    /// systematic, and before [`with_interval`].
    pub interval: Option<[f64; 2]>,
    /// Standard error of each modulus (Pa), then of the limit or of the exponents.
    pub standard_errors: Option<Vec<f64>>,
    /// Stretch at which the preload begins; one without a preload.
    pub preload_stretch: f64,
}

/// Beyond this limit Gent's law is neo-Hookean to 1e-4 at any stretch of a silicone, and is
/// written so.
const NO_LIMIT: f64 = 1e4;
/// Most slack that is looked for.
pub(crate) const MOST_SLACK: f64 = 0.1;
/// Stretches between which a preload is looked for, and turns of the search at most: each takes most of the error
/// away, and fifty take all that a number has of a half each.
const PRELOADED: [f64; 2] = [1.0, 2.0];
const MOST_TURNS: usize = 50;
/// Least slack that is kept.
const LEAST_SLACK: f64 = 0.002;
/// Grid of the search for the slack, and of that for Gent's limit.
const SLACKS: usize = 41;
const LIMITS: usize = 400;

impl Form {
    /// Name of the law, as files have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::NeoHookean => "neo_hookean",
            Self::MooneyRivlin => "mooney_rivlin",
            Self::Yeoh => "yeoh",
            Self::Gent | Self::GentShare(_) => "gent",
            Self::Ogden(_) => "ogden",
        }
    }

    /// All laws that a name of the command stands for.
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::NeoHookean, Self::MooneyRivlin, Self::Gent, Self::Yeoh];
        all.extend((1..=MOST_TERMS).map(Self::Ogden));
        all
    }

    /// Name of the law, with the number of Ogden's terms: `ogden2`.
    pub fn label(self) -> String {
        match self {
            Self::Ogden(terms) => format!("ogden{terms}"),
            form => form.name().to_owned(),
        }
    }

    /// The laws of a label, or of `all`; none for another text.
    pub fn labelled(label: &str) -> Option<Vec<Self>> {
        let mut all = Self::all();
        if label != "all" {
            all.retain(|form| form.label() == label);
        }
        (!all.is_empty()).then_some(all)
    }

    /// Number of constants.
    pub fn constants(self) -> usize {
        match self {
            Self::NeoHookean => 1,
            Self::MooneyRivlin | Self::Gent | Self::GentShare(_) => 2,
            Self::Yeoh => 3,
            Self::Ogden(terms) => 2 * terms,
        }
    }

    pub(crate) fn has_limit(self) -> bool {
        matches!(self, Self::Gent | Self::GentShare(_))
    }

    /// Number of terms of Ogden's law; zero of the others.
    fn terms(self) -> usize {
        match self {
            Self::Ogden(terms) => terms,
            _ => 0,
        }
    }

    /// Stress of each modulus of one; infinite beyond the limit.
    fn basis(self, mode: Mode, l: f64, outer: &Outer) -> [f64; 3] {
        let limit = outer.limit;
        let (f, g, x) = mode.of_invariants(l);
        let gent = || {
            let room = 1.0 - x / limit;
            if room > 0.0 { f / room } else { f64::INFINITY }
        };
        match self {
            Self::NeoHookean => [f, 0.0, 0.0],
            Self::MooneyRivlin => [2.0 * f, 2.0 * f * g, 0.0],
            Self::Yeoh => [2.0 * f, 4.0 * f * x, 6.0 * f * x * x],
            Self::Gent => [gent(), 0.0, 0.0],
            Self::GentShare(share) => [(1.0 - share) * gent() + share * f * g, 0.0, 0.0],
            Self::Ogden(_) => {
                let third = mode.stretches(l)[2];
                outer.exponents.map(|a| (l.powf(a) - third.powf(a)) / l)
            }
        }
    }

    /// Shear modulus of each modulus of one.
    fn shear(self, outer: &Outer) -> Vec<f64> {
        match self {
            Self::NeoHookean | Self::Gent | Self::GentShare(_) => vec![1.0],
            Self::MooneyRivlin => vec![2.0, 2.0],
            Self::Yeoh => vec![2.0, 0.0, 0.0],
            Self::Ogden(terms) => outer.exponents[..terms].iter().map(|a| a / 2.0).collect(),
        }
    }
}

/// A point with the square root of its weight.
#[derive(Debug, Clone, Copy)]
struct Point {
    mode: Mode,
    strain: f64,
    stress: f64,
    weight: f64,
    compression: bool,
}

/// Points of all tests, and where each test ends.
struct Data {
    points: Vec<Point>,
    ends: Vec<usize>,
}

impl Data {
    fn new(tests: &[Specimen], weights: Weights, measure: Measure, pooled: bool) -> Self {
        let (mut points, mut ends) = (Vec::new(), Vec::new());
        let all: usize = tests.iter().map(|test| test.points.len()).sum();
        for test in tests {
            let n = test.points.len();
            let strain = |at: usize| test.points[at][0];
            let largest = test
                .points
                .iter()
                .fold(0.0_f64, |most, [_, p]| most.max(p.abs()));
            let span = strain(n - 1) - strain(0);
            for (at, [e, p]) in test.points.iter().enumerate() {
                let stands_for = match measure {
                    Measure::Points => 1.0 / n as f64,
                    Measure::Stretch => {
                        let (before, after) = (at.saturating_sub(1), (at + 1).min(n - 1));
                        (strain(after) - strain(before)).abs() / (2.0 * span.abs())
                    }
                };
                let share = if pooled {
                    n as f64 / all as f64
                } else {
                    1.0 / tests.len() as f64
                };
                let size = match weights {
                    Weights::Relative => p.abs().max(0.05 * largest),
                    Weights::Absolute => 1.0,
                };
                points.push(Point {
                    mode: test.mode,
                    strain: *e,
                    stress: *p,
                    weight: (stands_for * share).sqrt() / size,
                    compression: test.compression,
                });
            }
            ends.push(points.len());
        }
        Self { points, ends }
    }

    /// Largest `I1 - 3` of the points.
    fn largest(&self, shift: f64) -> f64 {
        let of = |point: &Point| point.mode.of_invariants(1.0 + point.strain + shift).2;
        self.points.iter().map(of).fold(0.0, f64::max)
    }
}

/// The constants that the search is over.
#[derive(Debug, Clone, Copy)]
struct Outer {
    limit: f64,
    // As many as MOST_TERMS; written out, because a named length stops the compiler.
    exponents: [f64; 3],
    slack: f64,
    /// Strain of the preload, which is added to all.
    shift: f64,
}

impl Outer {
    /// As the file has it, without a limit.
    fn given(slack: f64) -> Self {
        Self {
            limit: f64::INFINITY,
            exponents: [0.0; MOST_TERMS],
            slack,
            shift: 0.0,
        }
    }
}

/// Moduli that fit best, with the weighted residuals.
struct Inner {
    moduli: Vec<f64>,
    residuals: Vec<f64>,
    misfit: f64,
}

struct Problem<'d> {
    form: Form,
    data: &'d Data,
}

/// Stretch of the material at a strain of the file.
fn stretch(compression: bool, strain: f64, outer: Outer) -> f64 {
    let l = 1.0 + strain + outer.shift;
    if compression {
        l
    } else {
        (l / (1.0 + outer.slack)).max(1.0)
    }
}

/// Points of a profile.
const PROFILE: u32 = 40;

/// The least relative rms at shear moduli (Pa) about that of a fit, to one and a half of its interval on both sides; none
/// without an interval.
pub fn profile(tests: &[Specimen], fit: &Fit, options: &crate::Options) -> Vec<[f64; 2]> {
    let Some([low, high]) = fit.interval.filter(|ends| ends[1].is_finite()) else {
        return Vec::new();
    };
    let data = Data::new(tests, options.weights, options.measure, options.pooled);
    let problem = Problem {
        form: fit.form,
        data: &data,
    };
    let room = 0.25 * (high - low);
    let (low, high) = ((low - room).max(0.0), high + room);
    let at = |n: u32| low + (high - low) * f64::from(n) / f64::from(PROFILE);
    (0..=PROFILE)
        .map(at)
        .map(|shear| {
            let (_, misfit) = problem.searched(fit.outer(), fit.slack_fitted, Some(shear));
            [shear, misfit.sqrt()]
        })
        .collect()
}

impl Problem<'_> {
    /// The weighted columns of the moduli, for the given outer constants.
    fn columns(&self, outer: Outer) -> Vec<Vec<f64>> {
        let count = self.form.shear(&outer).len();
        let mut columns = vec![Vec::with_capacity(self.data.points.len()); count];
        for point in &self.data.points {
            let basis = self.form.basis(
                point.mode,
                stretch(point.compression, point.strain, outer),
                &outer,
            );
            for (column, basis) in columns.iter_mut().zip(basis) {
                column.push(basis * point.weight);
            }
        }
        columns
    }

    /// The best moduli; with `shear`, those of this shear modulus. None where the tests do not
    /// tell the moduli apart, or a point is beyond the limit.
    fn inner(&self, outer: Outer, shear: Option<f64>) -> Option<Inner> {
        let mut columns = self.columns(outer);
        let mut target: Vec<f64> = self
            .data
            .points
            .iter()
            .map(|p| p.stress * p.weight)
            .collect();
        let of_shear = self.form.shear(&outer);
        if let Some(shear) = shear {
            // The first modulus follows from the others and the shear modulus.
            let first = columns.remove(0);
            for (column, part) in columns.iter_mut().zip(&of_shear[1..]) {
                for (entry, first) in column.iter_mut().zip(&first) {
                    *entry -= part / of_shear[0] * first;
                }
            }
            for (target, first) in target.iter_mut().zip(&first) {
                *target -= shear / of_shear[0] * first;
            }
        }
        let (mut moduli, residuals) = solved(columns, target)?;
        if let Some(shear) = shear {
            let others: f64 = moduli
                .iter()
                .zip(&of_shear[1..])
                .map(|(m, part)| m * part)
                .sum();
            moduli.insert(0, (shear - others) / of_shear[0]);
        }
        let misfit: f64 = residuals.iter().map(|r| r * r).sum();
        misfit.is_finite().then_some(Inner {
            moduli,
            residuals,
            misfit,
        })
    }

    fn misfit(&self, outer: Outer, shear: Option<f64>) -> f64 {
        self.inner(outer, shear)
            .map_or(f64::INFINITY, |inner| inner.misfit)
    }

    /// The limit that fits best: on a grid of `Jm / (I1 - 3) - 1`, then by golden sections.
    fn with_limit(&self, outer: Outer, shear: Option<f64>) -> (Outer, f64) {
        if !self.form.has_limit() {
            return (outer, self.misfit(outer, shear));
        }
        let largest = self.data.largest(outer.shift) / (1.0 + outer.slack).powi(2);
        let at = |logarithm: f64| Outer {
            limit: largest * (1.0 + logarithm.exp()),
            ..outer
        };
        let ends = [1e-4_f64.ln(), 1e4_f64.ln()];
        let value = |logarithm: f64| self.misfit(at(logarithm), shear);
        let (logarithm, least) = least(ends, LIMITS, value);
        (at(logarithm), least)
    }

    /// The best outer constants.
    fn searched(&self, outer: Outer, fit_slack: bool, shear: Option<f64>) -> (Outer, f64) {
        if self.form.terms() > 0 {
            return self.with_exponents(outer, fit_slack, shear);
        }
        if !fit_slack {
            return self.with_limit(outer, shear);
        }
        let with = |slack: f64| self.with_limit(Outer { slack, ..outer }, shear);
        let (slack, _) = least([0.0, MOST_SLACK], SLACKS, |slack| with(slack).1);
        with(slack)
    }

    /// Columns of the derivatives of the weighted residuals: moduli, limit, slack.
    fn jacobian(&self, outer: Outer, moduli: &[f64], fit_slack: bool) -> Vec<Vec<f64>> {
        let mut columns = self.columns(outer);
        let stress = |outer: Outer| -> Vec<f64> {
            let columns = self.columns(outer);
            (0..self.data.points.len())
                .map(|at| columns.iter().zip(moduli).map(|(c, m)| c[at] * m).sum())
                .collect()
        };
        // Central differences: the error is the square of the step, 1e-10, and rounding over it.
        let mut derived = |step: f64, moved: &dyn Fn(f64) -> Outer| {
            let (one, other) = (stress(moved(step)), stress(moved(-step)));
            let slope = one.iter().zip(&other).map(|(a, b)| (a - b) / (2.0 * step));
            columns.push(slope.collect());
        };
        if self.form.has_limit() {
            derived(1e-5 * outer.limit, &|step| Outer {
                limit: outer.limit + step,
                ..outer
            });
        }
        for term in 0..self.form.terms() {
            derived(1e-5, &|step| {
                let mut exponents = outer.exponents;
                exponents[term] += step;
                Outer { exponents, ..outer }
            });
        }
        if fit_slack {
            derived(1e-5, &|step| Outer {
                slack: outer.slack + step,
                ..outer
            });
        }
        columns
    }
}

/// Exponents of the first look for Ogden's terms: dense where rubber has them.
const EXPONENTS: [f64; 20] = [
    -30.0, -20.0, -12.0, -8.0, -5.0, -3.0, -2.0, -1.0, -0.4, 0.3, 1.0, 1.5, 2.0, 3.0, 4.0, 5.5,
    8.0, 12.0, 17.0, 24.0,
];
/// Largest size of an exponent that is looked for.
const LARGEST_EXPONENT: f64 = 40.0;
/// Minima of the first look that are followed.
const FOLLOWED: usize = 16;
/// Two minima whose exponents differ by less than this are one.
const SAME: f64 = 1e-3;

impl Problem<'_> {
    /// The minima of Ogden's law, the least first: the best of a grid of exponents, each followed to
    /// its minimum.
    fn minima(&self, slack: f64) -> Vec<Outer> {
        let terms = self.form.terms();
        let mut first: Vec<(f64, Outer)> = Vec::new();
        let mut at = vec![0; terms];
        // Each set of exponents once, in order.
        for (place, index) in at.iter_mut().enumerate() {
            *index = place;
        }
        loop {
            let mut outer = Outer::given(slack);
            for (exponent, index) in outer.exponents.iter_mut().zip(&at) {
                *exponent = EXPONENTS[*index];
            }
            let misfit = self.misfit(outer, None);
            if misfit.is_finite() {
                first.push((misfit, outer));
            }
            let Some(place) =
                (0..terms).rfind(|place| at[*place] + terms - place < EXPONENTS.len())
            else {
                break;
            };
            at[place] += 1;
            for later in place + 1..terms {
                at[later] = at[later - 1] + 1;
            }
        }
        first.sort_by(|one, other| one.0.total_cmp(&other.0));
        // Neighbours on the grid lead to the same minimum.
        let mut starts: Vec<Outer> = Vec::new();
        for (_, outer) in first {
            let near = |other: &Outer| {
                let both = outer.exponents.iter().zip(&other.exponents);
                both.map(|(a, b)| (a - b).abs() / (1.0 + a.abs().max(b.abs())))
                    .fold(0.0, f64::max)
                    < 0.3
            };
            if starts.len() < FOLLOWED && !starts.iter().any(near) {
                starts.push(outer);
            }
        }
        let mut found: Vec<(f64, Outer)> = Vec::new();
        for start in starts {
            let (mut outer, misfit) = self.with_exponents(start, false, None);
            outer.exponents[..terms].sort_by(f64::total_cmp);
            let same = |(_, other): &(f64, Outer)| {
                let both = outer.exponents.iter().zip(&other.exponents);
                both.into_iter()
                    .all(|(a, b)| (a - b).abs() < SAME * (1.0 + a.abs()))
            };
            if misfit.is_finite() && !found.iter().any(same) {
                found.push((misfit, outer));
            }
        }
        found.sort_by(|one, other| one.0.total_cmp(&other.0));
        found.into_iter().map(|(_, outer)| outer).collect()
    }

    /// The minimum near `start` over exponents and slack: by a simplex, then by Gauss and Newton.
    fn with_exponents(&self, start: Outer, fit_slack: bool, shear: Option<f64>) -> (Outer, f64) {
        let terms = self.form.terms();
        let count = terms + usize::from(fit_slack);
        let of = |x: &[f64]| {
            let mut outer = start;
            outer.exponents[..terms].copy_from_slice(&x[..terms]);
            if fit_slack {
                outer.slack = x[terms];
            }
            outer
        };
        let value = |x: &[f64]| {
            let within = x[..terms].iter().all(|a| a.abs() <= LARGEST_EXPONENT)
                && (!fit_slack || (0.0..=MOST_SLACK).contains(&x[terms]));
            if within {
                self.misfit(of(x), shear)
            } else {
                f64::INFINITY
            }
        };
        let mut x = start.exponents[..terms].to_vec();
        let mut sizes: Vec<f64> = x.iter().map(|a| 0.1 * (1.0 + a.abs())).collect();
        if fit_slack {
            x.push(start.slack.min(0.9 * MOST_SLACK));
            sizes.push(0.005);
        }
        let mut least = f64::INFINITY;
        // A misfit of this size is rounding.
        let squares = self
            .data
            .points
            .iter()
            .map(|p| (p.stress * p.weight).powi(2));
        let floor = 1e-22 * squares.sum::<f64>();
        // With a given shear modulus the simplex is all: ends of intervals need 1e-4.
        let (rounds, tolerance) = if shear.is_some() {
            (2, 1e-7)
        } else {
            (8, 1e-12)
        };
        // A simplex that has shrunk on a slope begins anew, until nothing is gained.
        for _ in 0..rounds {
            let (found, misfit) = simplex(&x, &sizes, (tolerance, floor), &value);
            let gained = least - misfit > 1e-9 * misfit + floor;
            (x, least) = (found, misfit);
            if !gained {
                break;
            }
            for size in &mut sizes {
                *size *= 0.3;
            }
        }
        if shear.is_none() {
            for _ in 0..50 {
                let Some(step) = self.newton(of(&x), fit_slack) else {
                    break;
                };
                let mut size = 1.0;
                let better = loop {
                    let tried: Vec<f64> = x
                        .iter()
                        .zip(&step)
                        .map(|(x, step)| x + size * step)
                        .collect();
                    let misfit = value(&tried);
                    if misfit < least {
                        break Some((tried, misfit));
                    }
                    size *= 0.5;
                    if size < 1e-6 {
                        break None;
                    }
                };
                let Some((tried, misfit)) = better else {
                    break;
                };
                let small = step[..count]
                    .iter()
                    .zip(&x)
                    .all(|(step, x)| (size * step).abs() < 1e-10 * (1.0 + x.abs()));
                (x, least) = (tried, misfit);
                if small {
                    break;
                }
            }
        }
        (of(&x), least)
    }

    /// Step of Gauss and Newton of the constants outside: exponents, slack.
    fn newton(&self, outer: Outer, fit_slack: bool) -> Option<Vec<f64>> {
        let inner = self.inner(outer, None)?;
        let columns = self.jacobian(outer, &inner.moduli, fit_slack);
        let (step, _) = solved(columns, inner.residuals)?;
        Some(step[inner.moduli.len()..].to_vec())
    }
}

/// Diagonal of `(J^T J)^-1` for the columns of `J`; none where they depend on each other.
fn variances(columns: &[Vec<f64>]) -> Option<Vec<f64>> {
    let rows = columns.first()?.len();
    let design: Vec<Vec<f64>> = (0..rows)
        .map(|row| columns.iter().map(|column| column[row]).collect())
        .collect();
    let solution = taxel_numerics::least_squares::linear::solve(&design, &vec![0.0; rows])?;
    Some(
        (0..columns.len())
            .map(|k| solution.covariance[k][k])
            .collect(),
    )
}

/// Points less what neighbours say of each other: `n / (1 + 2 sum rho_j)` of each test, with the
/// autocorrelations up to the last before the first that is not positive.
fn effective(residuals: &[f64], ends: &[usize]) -> f64 {
    let mut start = 0;
    let of_test = ends.iter().map(|end| {
        let r = &residuals[start..*end];
        start = *end;
        let square: f64 = r.iter().map(|r| r * r).sum();
        if square == 0.0 {
            return r.len() as f64;
        }
        let correlation =
            |j: usize| r.iter().zip(&r[j..]).map(|(a, b)| a * b).sum::<f64>() / square;
        let sum: f64 = (1..r.len())
            .map(correlation)
            .take_while(|rho| *rho > 0.0)
            .sum();
        r.len() as f64 / (1.0 + 2.0 * sum)
    });
    of_test.sum()
}

impl Fit {
    /// Corrected criterion of Akaike with all points of the files. It takes the residuals for noise,
    /// which those of rubber are not, and so the law of most constants; nothing is chosen by it.
    pub fn aicc(&self) -> f64 {
        let n = self.points as f64;
        let k = (self.form.constants() + usize::from(self.slack_fitted) + 1) as f64;
        n * self.misfit.ln() + 2.0 * k + 2.0 * k * (k + 1.0) / (n - k - 1.0)
    }

    /// Root of the mean square of the weighted residuals.
    pub fn rms(&self) -> f64 {
        self.misfit.sqrt()
    }

    /// The law; a limit that no test can see makes it neo-Hookean.
    pub fn law(&self) -> Law {
        let m = &self.moduli;
        match self.form {
            Form::NeoHookean => Law::NeoHookean { shear: m[0] },
            Form::MooneyRivlin => Law::MooneyRivlin {
                c10: m[0],
                c01: m[1],
            },
            Form::Yeoh => Law::Yeoh {
                factors: [m[0], m[1], m[2]],
            },
            Form::Gent | Form::GentShare(_) => match self.limit {
                Some(limit) if limit <= NO_LIMIT => Law::Gent { shear: m[0], limit },
                _ => Law::NeoHookean { shear: m[0] },
            },
            Form::Ogden(_) => Law::Ogden {
                terms: m
                    .iter()
                    .zip(&self.exponents)
                    .map(|(m, a)| [*m, *a])
                    .collect(),
            },
        }
    }

    /// Stretch of the material at a strain of the file.
    pub fn stretch(&self, compression: bool, strain: f64) -> f64 {
        stretch(compression, strain, self.outer())
    }

    /// The constants outside of the linear ones.
    fn outer(&self) -> Outer {
        let mut outer = Outer::given(self.slack);
        outer.limit = self.limit.unwrap_or(f64::INFINITY);
        outer.exponents[..self.exponents.len()].copy_from_slice(&self.exponents);
        outer.shift = self.preload_stretch - 1.0;
        outer
    }

    /// Nominal stress, Pa.
    pub fn nominal_stress(&self, mode: Mode, l: f64) -> f64 {
        let basis = self.form.basis(mode, l, &self.outer());
        self.moduli.iter().zip(basis).map(|(m, b)| m * b).sum()
    }
}

/// Fits one law: all its minima, the least first, without the intervals of [`with_interval`]. Only
/// Ogden's law has several.
///
/// # Errors
/// [`FitError`]
pub fn fits(
    tests: &[Specimen],
    form: Form,
    slack: Slack,
    weights: Weights,
    measure: Measure,
    pooled: bool,
) -> Result<Vec<Fit>, FitError> {
    let first = tests.first().ok_or(FitError::NoTest)?;
    let data = Data::new(tests, weights, measure, pooled);
    let problem = Problem { form, data: &data };
    let pressed = tests.iter().any(|test| test.compression);
    if tests.iter().any(|test| test.preload != first.preload) {
        return Err(FitError::Preloads);
    }
    if let Some(preload) = first.preload {
        if !matches!(slack, Slack::WhereItMatters | Slack::Given(0.0)) {
            return Err(FitError::SlackAndPreload);
        }
        return preloaded(&problem, first.mode, preload).map(|fit| vec![fit]);
    }
    let kept = match slack {
        Slack::Given(slack) => Some(slack),
        // The foot of a compression test is contact that comes, not slack.
        _ if pressed => Some(0.0),
        _ => None,
    };
    let at = kept.unwrap_or(0.0);
    let starts = if form.terms() > 0 {
        problem.minima(at)
    } else {
        vec![Outer::given(at)]
    };
    if starts.is_empty() {
        return Err(not_identified(form));
    }
    let of_start = |start| from(&problem, start, (kept.is_none(), slack));
    let mut fits = starts
        .into_iter()
        .map(of_start)
        .collect::<Result<Vec<_>, _>>()?;
    fits.sort_by(|one, other| one.misfit.total_cmp(&other.misfit));
    Ok(fits)
}

/// A fit with the interval of its shear modulus; none where the misfit is systematic.
#[must_use]
pub fn with_interval(
    tests: &[Specimen],
    mut fit: Fit,
    weights: Weights,
    measure: Measure,
    pooled: bool,
) -> Fit {
    let data = Data::new(tests, weights, measure, pooled);
    let problem = Problem {
        form: fit.form,
        data: &data,
    };
    let constants = fit.form.constants() + usize::from(fit.slack_fitted);
    if fit.effective < constants as f64 + 1.0 {
        return fit;
    }
    let most = fit.misfit * (1.0 + student(fit.freedom).powi(2) / fit.freedom);
    let outer = fit.outer();
    let misfit = |shear: f64| problem.searched(outer, fit.slack_fitted, Some(shear)).1;
    fit.interval = Some(interval::of_shear_modulus(misfit, fit.shear_modulus, most));
    fit
}

/// The fit that a search from `start` ends at, with the slack fitted where it may be and kept where
/// it matters or is asked for.
fn from(
    problem: &Problem<'_>,
    start: Outer,
    (may_slack, slack): (bool, Slack),
) -> Result<Fit, FitError> {
    let without = || {
        let (outer, _) = problem.searched(start, false, None);
        finished(problem, outer, false)
    };
    if !may_slack {
        return without();
    }
    let (outer, _) = problem.searched(start, true, None);
    let without = without()?;
    let with = Fit {
        modulus_with_slack: Some(without.shear_modulus),
        ..finished(problem, outer, true)?
    };
    if slack == Slack::Fitted {
        return Ok(with);
    }
    // F of 95 % for one and some degrees of freedom is the square of Student's t.
    let needed = student(with.freedom).powi(2) / with.freedom;
    let matters = with.slack >= LEAST_SLACK && without.misfit / with.misfit - 1.0 > needed;
    Ok(if matters { with } else { without })
}

fn not_identified(form: Form) -> FitError {
    let known = match form {
        Form::MooneyRivlin => "only the sum of c10 and c01 follows from a planar test",
        _ => "give a test of a wider range",
    };
    FitError::NotIdentified {
        law: form.name(),
        known,
    }
}

fn finished(problem: &Problem<'_>, outer: Outer, fit_slack: bool) -> Result<Fit, FitError> {
    let form = problem.form;
    let inner = problem
        .inner(outer, None)
        .ok_or_else(|| not_identified(form))?;
    let shear: f64 = inner
        .moduli
        .iter()
        .zip(form.shear(&outer))
        .map(|(m, part)| m * part)
        .sum();
    let effective = effective(&inner.residuals, &problem.data.ends);
    let constants = form.constants() + usize::from(fit_slack);
    let freedom = (effective - constants as f64).max(1.0);
    let errors = variances(&problem.jacobian(outer, &inner.moduli, fit_slack)).map(|variances| {
        let of = |variance: &f64| (variance * inner.misfit / freedom).sqrt();
        variances.iter().map(of).take(form.constants()).collect()
    });
    Ok(Fit {
        form,
        moduli: inner.moduli,
        limit: form.has_limit().then_some(outer.limit),
        exponents: outer.exponents[..form.terms()].to_vec(),
        slack: outer.slack,
        slack_fitted: fit_slack,
        modulus_with_slack: None,
        shear_modulus: shear,
        misfit: inner.misfit,
        effective,
        points: inner.residuals.len(),
        freedom,
        interval: None,
        standard_errors: errors,
        preload_stretch: 1.0 + outer.shift,
    })
}

/// A test that begins at a preload: its first stretch is that of the preload by the law itself,
/// found by turns.
fn preloaded(problem: &Problem<'_>, mode: Mode, preload: f64) -> Result<Fit, FitError> {
    let mut shift = 0.0;
    for _ in 0..MOST_TURNS {
        let found = if problem.form.terms() > 0 {
            problem.minima(0.0).into_iter().next()
        } else {
            Some(Outer::given(0.0))
        };
        let start = Outer {
            shift,
            ..found.ok_or_else(|| not_identified(problem.form))?
        };
        let (outer, _) = problem.searched(start, false, None);
        let fit = finished(problem, outer, false)?;
        let misfit = |l: f64| fit.nominal_stress(mode, l) - preload;
        let between = misfit(PRELOADED[0]) <= 0.0 && misfit(PRELOADED[1]) >= 0.0;
        if !between {
            break;
        }
        let next = taxel_numerics::roots::ridders(PRELOADED, misfit) - 1.0;
        if (next - shift).abs() < 1e-12 {
            return Ok(fit);
        }
        shift = next;
    }
    Err(FitError::Preload {
        law: problem.form.name(),
    })
}
