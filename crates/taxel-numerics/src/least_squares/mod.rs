//! Nonlinear least squares: estimates with their covariance, and the
//! combinations of parameters that the readings do not identify.
//!
//! A [`Problem`] gives residuals (measured − model)/σ for values of its
//! [`Parameter`]s; [`fit`] finds the values with the least
//!
//! Σ ρ(rᵢ²) + Σ ((θⱼ − priorⱼ)/σⱼ)²
//!
//! inside their bounds by the method of Levenberg and Marquardt on a QR
//! factorisation. A parameter that the readings do not identify to within its own
//! [`Parameter::size`] gets no confident number: its [`Status`] says so, and
//! its interval is that of its prior or its bounds.

mod dense;
mod identifiability;
mod iteration;
pub mod linear;
mod loss;
mod profile;
mod quantile;
mod reweighted;

pub use identifiability::{Direction, Member};
pub use iteration::Stop;
pub use loss::Loss;
pub use profile::{leave_groups_out, profile_interval, wide_profile_interval};
pub use quantile::{NORMAL_95, student_quantile};

pub use dense::singular_values;

use iteration::Minimum;

/// One unknown of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name, as in files.
    pub name: String,
    /// SI unit; empty for a plain number.
    pub unit: &'static str,
    /// Where the search starts.
    pub start: f64,
    /// Least and largest value; equal ones hold the parameter fixed.
    pub bounds: [f64; 2],
    /// A difference of this size matters, and no more than this is expected:
    /// an estimate that is worse counts as not identifiable.
    pub size: f64,
    /// Prior knowledge beside the readings.
    pub prior: Option<Prior>,
}

/// Prior of a parameter: a normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Mean.
    pub value: f64,
    /// Standard deviation, above zero.
    pub deviation: f64,
}

impl Parameter {
    /// A parameter without unit, bounds and prior, whose size is that of its
    /// start (1 for a start at zero).
    pub fn new(name: impl Into<String>, start: f64) -> Self {
        Self {
            name: name.into(),
            unit: "",
            start,
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
            size: if start == 0.0 { 1.0 } else { start.abs() },
            prior: None,
        }
    }

    /// True if its bounds leave it anything to fit.
    pub fn is_free(&self) -> bool {
        self.bounds[0] < self.bounds[1]
    }
}

/// Readings with a model for them.
pub trait Problem {
    /// Number of readings.
    fn readings(&self) -> usize;

    /// Writes (measured − model)/σ of each reading for the parameters `at`;
    /// `false` where the model has no answer.
    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool;

    /// Writes the slopes of all residuals, one column for each parameter;
    /// `false` where there is none. Without an own one: differences to both
    /// sides, of a relative error of about 1e-10.
    fn slopes(&self, parameters: &[Parameter], at: &[f64], columns: &mut [Vec<f64>]) -> bool {
        differences(self, parameters, at, columns)
    }

    /// Measurement that would identify these parameters separately, as a sentence
    /// without a full stop; empty when the problem knows none.
    fn remedy(&self, together: &[usize]) -> String {
        let _ = together;
        String::new()
    }
}

/// Size of the noise of the readings: given, or estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NoiseSize {
    /// The σ in the residuals is right; χ² then tests the model.
    #[default]
    Given,
    /// The σ is right up to one common factor, which the residuals determine.
    Estimated,
}

/// Options of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Size of the noise; by default given.
    pub noise: NoiseSize,
    /// Loss of a residual; by default its square.
    pub loss: Loss,
    /// Most iterations; by default 500.
    pub iterations: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            noise: NoiseSize::Given,
            loss: Loss::Square,
            iterations: 500,
        }
    }
}

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// Fewer readings and priors than unknowns, or as many.
    #[error("{readings} readings do not determine {unknowns} unknowns; at least {} are needed", unknowns + 1)]
    TooFew {
        /// Readings and priors.
        readings: usize,
        /// Free parameters.
        unknowns: usize,
    },
    /// The model has no answer at the start.
    #[error("the model has no answer at the start of the search, {name} = {value}")]
    NoStart {
        /// The first parameter.
        name: String,
        /// Its start.
        value: f64,
    },
}

/// Status of a parameter after a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The readings determine it.
    Identified,
    /// The readings do not determine it; interval and deviation are those of its
    /// bounds.
    NotIdentifiable,
    /// Its prior says more of it than the readings do.
    PriorOnly,
    /// The best value lies on a bound; the interval goes from there to one side.
    AtBound,
    /// It was not fitted.
    Fixed,
}

impl Status {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Identified,
        Self::NotIdentifiable,
        Self::PriorOnly,
        Self::AtBound,
        Self::Fixed,
    ];

    /// Name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Identified => "identified",
            Self::NotIdentifiable => "not identifiable",
            Self::PriorOnly => "prior only",
            Self::AtBound => "at bound",
            Self::Fixed => "fixed",
        }
    }
}

/// Estimate of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// Standard deviation; see [`Fit::covariance`].
    pub deviation: f64,
    /// 95 % interval inside the bounds; of a parameter that is not identifiable,
    /// that of its prior or its bounds.
    pub interval: [f64; 2],
    /// Status of the parameter.
    pub status: Status,
}

/// A finished fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// In the order of the parameters.
    pub estimates: Vec<Estimate>,
    /// Covariance of all parameters (that of fixed ones is zero). Along
    /// combinations that the readings do not determine at all it is large, not
    /// infinite.
    pub covariance: Vec<Vec<f64>>,
    /// (measured − model)/σ at the best values.
    pub residuals: Vec<f64>,
    /// Share of each reading in its own fitted value, 0 to 1.
    pub leverage: Vec<f64>,
    /// Σ residual², priors included.
    pub chi_square: f64,
    /// Readings and priors less free parameters.
    pub freedom: usize,
    /// Standard deviation of a residual that intervals are made with: 1 for
    /// given noise, unless χ² refutes it.
    pub scale: f64,
    /// Combinations that the readings do not identify.
    pub directions: Vec<Direction>,
    /// Why the search ended.
    pub stop: Stop,
    /// Slopes that it took.
    pub iterations: usize,
}

impl Fit {
    /// Best values.
    pub fn values(&self) -> Vec<f64> {
        self.estimates.iter().map(|e| e.value).collect()
    }

    /// χ² over the degrees of freedom.
    pub fn reduced_chi_square(&self) -> f64 {
        self.chi_square / self.freedom as f64
    }

    /// Residual of each reading from a fit without it: r/(1 − leverage), exact
    /// for a linear model.
    pub fn left_out_residuals(&self) -> Vec<f64> {
        let pairs = self.residuals.iter().zip(&self.leverage);
        pairs
            .map(|(r, h)| r / (1.0 - h).max(f64::EPSILON))
            .collect()
    }
}

/// Fits `parameters` to the readings of `problem`.
///
/// # Errors
/// [`FitError`]. A search that stops early is no error: see [`Fit::stop`].
///
/// ```
/// use taxel_numerics::least_squares::{Parameter, Problem, FitOptions, fit};
/// struct Line([f64; 3]);
/// impl Problem for Line {
///     fn readings(&self) -> usize {
///         3
///     }
///     fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
///         for (i, residual) in residuals.iter_mut().enumerate() {
///             *residual = self.0[i] - at[0] - at[1] * i as f64;
///         }
///         true
///     }
/// }
/// let parameters = [Parameter::new("offset", 0.0), Parameter::new("slope", 1.0)];
/// let fit = fit(&Line([1.0, 3.0, 5.0]), &parameters, &FitOptions::default())?;
/// assert!((fit.estimates[1].value - 2.0).abs() < 1e-12);
/// # Ok::<(), taxel_numerics::least_squares::FitError>(())
/// ```
pub fn fit(
    problem: &dyn Problem,
    parameters: &[Parameter],
    options: &FitOptions,
) -> Result<Fit, FitError> {
    let free = parameters.iter().filter(|p| p.is_free()).count();
    let priors = parameters
        .iter()
        .filter(|p| p.is_free() && p.prior.is_some())
        .count();
    let readings = problem.readings() + priors;
    if readings <= free {
        return Err(FitError::TooFew {
            readings,
            unknowns: free,
        });
    }
    let (minimum, scale) = reweighted::search(problem, parameters, options, readings - free)?;
    Ok(report(problem, parameters, options, &minimum, scale))
}

/// χ² above this many of its standard deviations refutes the given noise.
const REFUTED: f64 = 3.0;
/// A prior of which the readings leave more than this share knows more than
/// they do: where both know as much, the deviation falls by √2.
const PRIOR_ONLY: f64 = std::f64::consts::FRAC_1_SQRT_2;

fn report(
    problem: &dyn Problem,
    parameters: &[Parameter],
    options: &FitOptions,
    minimum: &Minimum,
    noise: f64,
) -> Fit {
    let free: Vec<usize> = (0..parameters.len())
        .filter(|j| parameters[*j].is_free())
        .collect();
    let priors = free
        .iter()
        .filter(|j| parameters[**j].prior.is_some())
        .count();
    let freedom = minimum.residuals.len() + priors - free.len();
    let chi_square = minimum.square_sum(parameters, noise);
    let scale = match options.noise {
        NoiseSize::Estimated => noise,
        NoiseSize::Given => {
            let reduced = chi_square / freedom as f64;
            let expected = 1.0 + REFUTED * (2.0 / freedom as f64).sqrt();
            if reduced > expected {
                reduced.sqrt()
            } else {
                1.0
            }
        }
    };
    let spectrum = |with_priors| {
        let triangle = minimum.triangle(parameters, &free, scale, with_priors);
        triangle.spectrum()
    };
    let data = spectrum(false);
    let inverse = match priors {
        0 => data.bounded_inverse(),
        _ => spectrum(true).bounded_inverse(),
    };
    let leverage = minimum.leverage(parameters, &free, scale, &inverse);
    let of_data = data.deviations();
    let quantile = quantile(scale, options.noise, freedom);
    let mut slopes = vec![0.0; parameters.len()];
    for &j in &free {
        slopes[j] = minimum.slope_of_cost(parameters, j, scale);
    }
    let mut covariance = vec![vec![0.0; parameters.len()]; parameters.len()];
    for (a, &i) in free.iter().enumerate() {
        for (b, &j) in free.iter().enumerate() {
            let product: f64 = (0..free.len()).map(|k| inverse[a][k] * inverse[b][k]).sum();
            covariance[i][j] = product * parameters[i].size * parameters[j].size;
        }
    }
    let estimates = parameters
        .iter()
        .enumerate()
        .map(|(j, parameter)| {
            let place = free.iter().position(|k| *k == j);
            let of_data = place.map(|place| of_data[place]);
            let deviation = covariance[j][j].sqrt();
            // Where the sum would be least if there were no bounds.
            let pairs = free.iter().map(|k| covariance[j][*k] * slopes[*k]);
            let beyond = pairs.sum::<f64>().abs();
            let half = one_sided(quantile * deviation, beyond);
            estimate(parameter, minimum.at[j], deviation, of_data, half)
        })
        .collect();
    Fit {
        estimates,
        covariance,
        leverage,
        chi_square,
        freedom,
        scale,
        directions: identifiability::directions(problem, &data, &free),
        stop: minimum.stop,
        iterations: minimum.iterations,
        residuals: minimum.residuals.clone(),
    }
}

/// Half a 95 % interval in standard deviations; a scale that comes from the
/// residuals is itself uncertain.
fn quantile(scale: f64, noise: NoiseSize, freedom: usize) -> f64 {
    let known = noise == NoiseSize::Given && scale == 1.0;
    student_quantile(0.975, if known { f64::INFINITY } else { freedom as f64 })
}

/// Reach of an interval from a value that a bound keeps `beyond` away from the least sum:
/// that sum costs t² more there than at the bound. Without a bound in the way it is t·σ.
fn one_sided(half: f64, beyond: f64) -> f64 {
    half * half / (half.hypot(beyond) + beyond).max(f64::MIN_POSITIVE)
}

/// `of_data` is the deviation that the readings alone leave, in sizes; `None` for
/// a fixed parameter; `half` is half the interval.
fn estimate(
    parameter: &Parameter,
    value: f64,
    deviation: f64,
    of_data: Option<f64>,
    half: f64,
) -> Estimate {
    let [low, high] = parameter.bounds;
    let around = |centre: f64, half: f64| [(centre - half).max(low), (centre + half).min(high)];
    let (status, interval) = match (of_data, parameter.prior) {
        (None, _) => (Status::Fixed, [value; 2]),
        (Some(_), Some(prior)) if deviation > PRIOR_ONLY * prior.deviation => {
            let half = NORMAL_95 * prior.deviation;
            (Status::PriorOnly, around(prior.value, half))
        }
        (Some(of_data), None) if of_data > 1.0 => (Status::NotIdentifiable, [low, high]),
        _ if value <= low || value >= high => (Status::AtBound, around(value, half)),
        _ => (Status::Identified, around(value, half)),
    };
    Estimate {
        value,
        deviation,
        interval,
        status,
    }
}

/// Slopes by differences inside the bounds.
fn differences<P: Problem + ?Sized>(
    problem: &P,
    parameters: &[Parameter],
    at: &[f64],
    columns: &mut [Vec<f64>],
) -> bool {
    let mut place = at.to_vec();
    let mut below = vec![0.0; problem.readings()];
    for (j, parameter) in parameters.iter().enumerate() {
        columns[j].fill(0.0);
        if !parameter.is_free() {
            continue;
        }
        // The cube root of the rounding: errors by curvature and by rounding
        // are then of one size.
        let step = 6e-6 * at[j].abs().max(1e-2 * parameter.size);
        let [low, high] =
            [at[j] - step, at[j] + step].map(|x| x.clamp(parameter.bounds[0], parameter.bounds[1]));
        place[j] = low;
        let mut there = problem.residuals(&place, &mut below);
        place[j] = high;
        there &= problem.residuals(&place, &mut columns[j]);
        place[j] = at[j];
        if !there {
            return false;
        }
        for (above, below) in columns[j].iter_mut().zip(&below) {
            *above = (*above - below) / (high - low);
        }
    }
    true
}

#[cfg(test)]
mod tests;
