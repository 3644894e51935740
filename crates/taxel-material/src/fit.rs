//! The fit of one law to the points of one or more tests.
//!
//! The stress is linear in the moduli of every law; these are found inside, so that a search
//! has only the other constants: Gent's limit, Ogden's exponents, the slack.

use crate::interval::{self, student};
use crate::law::{Law, Mode};
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
}

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
    /// Slack that was taken out, a strain.
    pub slack: f64,
    /// True if the slack is one of the fitted constants.
    pub slack_fitted: bool,
    /// Shear modulus, Pa.
    pub shear_modulus: f64,
    /// Mean square of the weighted residuals.
    pub misfit: f64,
    /// Effective number of points.
    pub effective: f64,
    /// Degrees of freedom.
    pub freedom: f64,
    /// Interval of 95 % of the shear modulus by its profile, Pa; none where the misfit is
    /// systematic.
    pub interval: Option<[f64; 2]>,
    /// Standard error of each modulus (Pa), then of the limit.
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
        }
    }

    /// Number of constants.
    pub fn constants(self) -> usize {
        match self {
            Self::NeoHookean => 1,
            Self::MooneyRivlin | Self::Gent | Self::GentShare(_) => 2,
            Self::Yeoh => 3,
        }
    }

    pub(crate) fn has_limit(self) -> bool {
        matches!(self, Self::Gent | Self::GentShare(_))
    }

    /// Stress of each modulus of one; infinite beyond the limit.
    fn basis(self, mode: Mode, l: f64, limit: f64) -> [f64; 3] {
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
        }
    }

    /// Shear modulus of each modulus of one.
    fn shear(self) -> &'static [f64] {
        match self {
            Self::NeoHookean | Self::Gent | Self::GentShare(_) => &[1.0],
            Self::MooneyRivlin => &[2.0, 2.0],
            Self::Yeoh => &[2.0, 0.0, 0.0],
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
pub(crate) struct Data {
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
pub(crate) struct Outer {
    pub(crate) limit: f64,
    pub(crate) slack: f64,
    /// Strain of the preload, which is added to all.
    shift: f64,
}

/// Moduli that fit best, with the weighted residuals.
pub(crate) struct Inner {
    moduli: Vec<f64>,
    residuals: Vec<f64>,
    pub(crate) misfit: f64,
}

pub(crate) struct Problem<'d> {
    pub(crate) form: Form,
    data: &'d Data,
}

impl Problem<'_> {
    fn stretch(point: &Point, outer: Outer) -> f64 {
        let l = 1.0 + point.strain + outer.shift;
        if point.compression {
            l
        } else {
            (l / (1.0 + outer.slack)).max(1.0)
        }
    }

    /// The weighted columns of the moduli, for the given outer constants.
    fn columns(&self, outer: Outer) -> Vec<Vec<f64>> {
        let count = self.form.shear().len();
        let mut columns = vec![Vec::with_capacity(self.data.points.len()); count];
        for point in &self.data.points {
            let basis = self
                .form
                .basis(point.mode, Self::stretch(point, outer), outer.limit);
            for (column, basis) in columns.iter_mut().zip(basis) {
                column.push(basis * point.weight);
            }
        }
        columns
    }

    /// The best moduli; with `shear`, those of this shear modulus. None where the tests do not
    /// tell the moduli apart, or a point is beyond the limit.
    pub(crate) fn inner(&self, outer: Outer, shear: Option<f64>) -> Option<Inner> {
        let mut columns = self.columns(outer);
        let mut target: Vec<f64> = self
            .data
            .points
            .iter()
            .map(|p| p.stress * p.weight)
            .collect();
        let of_shear = self.form.shear();
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
    pub(crate) fn searched(
        &self,
        outer: Outer,
        fit_slack: bool,
        shear: Option<f64>,
    ) -> (Outer, f64) {
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
        if fit_slack {
            derived(1e-5, &|step| Outer {
                slack: outer.slack + step,
                ..outer
            });
        }
        columns
    }
}

/// The least value of a function: on a grid between the ends, then by golden sections between
/// the neighbours of the best, to the root of the rounding.
fn least(ends: [f64; 2], count: usize, value: impl Fn(f64) -> f64) -> (f64, f64) {
    let step = (ends[1] - ends[0]) / (count - 1) as f64;
    let at = |n: usize| ends[0] + step * n as f64;
    let (mut best, mut least) = (ends[0], f64::INFINITY);
    for n in 0..count {
        let found = value(at(n));
        if found < least {
            (best, least) = (at(n), found);
        }
    }
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = ((best - step).max(ends[0]), (best + step).min(ends[1]));
    let mut inner =
        [high - golden * (high - low), low + golden * (high - low)].map(|x| (x, value(x)));
    while high - low > 1e-9 * step.max(low.abs()) {
        let [a, b] = inner;
        let better = if a.1 <= b.1 { a } else { b };
        if better.1 < least {
            (best, least) = better;
        }
        // One of the two points within stays.
        if a.1 <= b.1 {
            high = b.0;
            let x = high - golden * (high - low);
            inner = [(x, value(x)), a];
        } else {
            low = a.0;
            let x = low + golden * (high - low);
            inner = [b, (x, value(x))];
        }
    }
    (best, least)
}

/// Least squares on columns by modified Gram-Schmidt: the coefficients and the residuals,
/// target less columns. None where a column depends on those before it to 1e-9 of its length.
fn solved(mut columns: Vec<Vec<f64>>, mut target: Vec<f64>) -> Option<(Vec<f64>, Vec<f64>)> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let count = columns.len();
    let mut r = vec![vec![0.0; count + 1]; count];
    for k in 0..count {
        let before = dot(&columns[k], &columns[k]).sqrt();
        if !(before > 0.0 && before.is_finite()) {
            return None;
        }
        for j in 0..k {
            let part = dot(&columns[j], &columns[k]);
            r[j][k] = part;
            let (done, rest) = columns.split_at_mut(k);
            for (entry, unit) in rest[0].iter_mut().zip(&done[j]) {
                *entry -= part * unit;
            }
        }
        let length = dot(&columns[k], &columns[k]).sqrt();
        if length < 1e-9 * before {
            return None;
        }
        r[k][k] = length;
        columns[k].iter_mut().for_each(|entry| *entry /= length);
        let part = dot(&columns[k], &target);
        r[k][count] = part;
        for (entry, unit) in target.iter_mut().zip(&columns[k]) {
            *entry -= part * unit;
        }
    }
    let mut found = vec![0.0; count];
    for k in (0..count).rev() {
        let known: f64 = (k + 1..count).map(|j| r[k][j] * found[j]).sum();
        found[k] = (r[k][count] - known) / r[k][k];
    }
    Some((found, target))
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
        }
    }

    /// Nominal stress, Pa.
    pub fn nominal_stress(&self, mode: Mode, l: f64) -> f64 {
        let basis = self
            .form
            .basis(mode, l, self.limit.unwrap_or(f64::INFINITY));
        self.moduli.iter().zip(basis).map(|(m, b)| m * b).sum()
    }
}

/// Fits one law.
///
/// # Errors
/// [`FitError`]
pub fn fit(
    tests: &[Specimen],
    form: Form,
    slack: Slack,
    weights: Weights,
    measure: Measure,
    pooled: bool,
) -> Result<Fit, FitError> {
    let first = tests.first().ok_or(FitError::NoTest)?;
    let data = Data::new(tests, weights, measure, pooled);
    let problem = Problem { form, data: &data };
    let pressed = tests.iter().any(|test| test.compression);
    let given = |slack: f64, shift: f64| Outer {
        limit: f64::INFINITY,
        slack,
        shift,
    };
    if tests.iter().any(|test| test.preload != first.preload) {
        return Err(FitError::Preloads);
    }
    if let Some(preload) = first.preload {
        if !matches!(slack, Slack::WhereItMatters | Slack::Given(0.0)) {
            return Err(FitError::SlackAndPreload);
        }
        return preloaded(&problem, first.mode, preload);
    }
    let kept = match slack {
        Slack::Given(slack) => Some(slack),
        // The foot of a compression test is contact that comes, not slack.
        _ if pressed => Some(0.0),
        _ => None,
    };
    let without = |slack: f64| {
        let (outer, _) = problem.searched(given(slack, 0.0), false, None);
        finished(&problem, outer, false)
    };
    if let Some(slack) = kept {
        return without(slack);
    }
    let (outer, _) = problem.searched(given(0.0, 0.0), true, None);
    let with = finished(&problem, outer, true)?;
    if slack == Slack::Fitted {
        return Ok(with);
    }
    let without = without(0.0)?;
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
        .zip(form.shear())
        .map(|(m, part)| m * part)
        .sum();
    let effective = effective(&inner.residuals, &problem.data.ends);
    let constants = form.constants() + usize::from(fit_slack);
    let freedom = (effective - constants as f64).max(1.0);
    let errors = variances(&problem.jacobian(outer, &inner.moduli, fit_slack)).map(|variances| {
        let of = |variance: &f64| (variance * inner.misfit / freedom).sqrt();
        variances.iter().map(of).take(form.constants()).collect()
    });
    let known = effective >= constants as f64 + 1.0;
    let interval = known.then(|| {
        let most = inner.misfit * (1.0 + student(freedom).powi(2) / freedom);
        let misfit = |shear: f64| problem.searched(outer, fit_slack, Some(shear)).1;
        interval::of_shear_modulus(misfit, shear, most)
    });
    Ok(Fit {
        form,
        moduli: inner.moduli,
        limit: form.has_limit().then_some(outer.limit),
        slack: outer.slack,
        slack_fitted: fit_slack,
        shear_modulus: shear,
        misfit: inner.misfit,
        effective,
        freedom,
        interval,
        standard_errors: errors,
        preload_stretch: 1.0 + outer.shift,
    })
}

/// A test that begins at a preload: its first stretch is that of the preload by the law itself,
/// found by turns.
fn preloaded(problem: &Problem<'_>, mode: Mode, preload: f64) -> Result<Fit, FitError> {
    let mut shift = 0.0;
    for _ in 0..MOST_TURNS {
        let start = Outer {
            limit: f64::INFINITY,
            slack: 0.0,
            shift,
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
