//! Parallel capacitance, gap and stiffness from a normal sweep (P2 physics
//! section 7.2): C_i(F) = C_par,i + ε₀ab/(g_i − F/k_z), jointly for the four
//! capacitors of a unit.
//!
//! Unique in theory, hard in practice: over 0 to 15 mN with a gauge of 1 mN
//! the parallel capacitance is known to 56 fF. The gauge's error is therefore
//! part of the fit (the true forces are unknowns with the readings as priors),
//! and the fit says itself when it is no use.

use super::least_squares;

/// One point of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepPoint {
    /// Normal force by the gauge, N.
    pub force: f64,
    /// Capacitances 11, 12, 21, 22, F.
    pub capacitance: [f64; 4],
}

/// Standard deviations of the bench.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepNoise {
    /// Of a capacitance, F.
    pub capacitance: f64,
    /// Of the gauge, N; zero for exact forces.
    pub force: f64,
    /// Parallel capacitances measured otherwise (an open fixture): value and
    /// standard deviation, F.
    pub measured_parallel: Option<([f64; 4], f64)>,
}

/// Where the search starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepStart {
    /// Parallel capacitances, F.
    pub parallel_capacitance: [f64; 4],
    /// Stiffness, N/m.
    pub stiffness: f64,
}

/// What a sweep tells.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepFit {
    /// Parallel capacitances, F.
    pub parallel_capacitance: [f64; 4],
    /// Their standard deviations, F.
    pub parallel_deviation: [f64; 4],
    /// Equivalent gaps, m.
    pub gap: [f64; 4],
    /// Their standard deviations, m.
    pub gap_deviation: [f64; 4],
    /// Stiffness along z, N/m.
    pub stiffness: f64,
    /// Its standard deviation, N/m.
    pub stiffness_deviation: f64,
    /// Σ (residual/σ)².
    pub chi2: f64,
    /// What the data cannot tell, in words; empty when the fit is sound.
    pub warning: Option<String>,
}

/// Unknowns before the true forces: four parallel capacitances, four gaps, one
/// stiffness.
const SHARED: usize = 9;
/// Relative standard deviation of the stiffness, and of C_par against the rest
/// capacitance, above which a fit is called no use.
const USELESS: f64 = 0.05;
const MOST_STEPS: usize = 200;

/// Fits a sweep; `area` is ε₀ab, F m.
///
/// `None` when the points do not determine the unknowns, or no step from
/// `start` improves the fit.
pub fn fit_normal_sweep(
    points: &[SweepPoint],
    area: f64,
    noise: &SweepNoise,
    start: &SweepStart,
) -> Option<SweepFit> {
    let problem = Problem {
        points,
        area,
        noise,
    };
    let mut unknowns = problem.start(start)?;
    let (mut design, mut residual) = problem.linearise(&unknowns)?;
    let mut misfit = square_sum(&residual);
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let step = damped_step(&design, &residual, damping)?;
        let moved: Vec<f64> = unknowns.iter().zip(&step).map(|(u, s)| u + s).collect();
        let trial = problem.linearise(&moved);
        let better = trial.filter(|(_, residual)| square_sum(residual) <= misfit);
        if let Some((next_design, next_residual)) = better {
            let small = unknowns
                .iter()
                .zip(&step)
                .all(|(u, s)| s.abs() <= 1e-12 * u.abs());
            (unknowns, design, residual) = (moved, next_design, next_residual);
            misfit = square_sum(&residual);
            damping *= 0.1;
            if small {
                break;
            }
        } else {
            damping = (damping * 10.0).max(1e-12);
            if damping > 1e12 {
                break;
            }
        }
    }
    problem.report(&unknowns, &design, &residual)
}

struct Problem<'a> {
    points: &'a [SweepPoint],
    area: f64,
    noise: &'a SweepNoise,
}

impl Problem<'_> {
    fn gauge_is_exact(&self) -> bool {
        self.noise.force <= 0.0
    }

    /// Unknowns in natural units: fF, um, kN/m, mN, all of the order of one
    /// to a few hundred.
    fn start(&self, start: &SweepStart) -> Option<Vec<f64>> {
        let rest = self
            .points
            .iter()
            .min_by(|a, b| a.force.total_cmp(&b.force))?;
        let mut unknowns: Vec<f64> = start
            .parallel_capacitance
            .iter()
            .map(|c| c * 1e15)
            .collect();
        for i in 0..4 {
            let plate = rest.capacitance[i] - start.parallel_capacitance[i];
            unknowns.push((self.area / plate + rest.force / start.stiffness) * 1e6);
        }
        unknowns.push(start.stiffness * 1e-3);
        if !self.gauge_is_exact() {
            unknowns.extend(self.points.iter().map(|point| point.force * 1e3));
        }
        unknowns
            .iter()
            .all(|value| value.is_finite())
            .then_some(unknowns)
    }

    /// Weighted slopes and residuals (measured − model); `None` when a gap of
    /// the trial is closed.
    fn linearise(&self, unknowns: &[f64]) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
        let (mut design, mut residual) = (Vec::new(), Vec::new());
        let area = self.area * 1e21; // fF um
        let stiffness = unknowns[8];
        for (index, point) in self.points.iter().enumerate() {
            let force = if self.gauge_is_exact() {
                point.force * 1e3
            } else {
                unknowns[SHARED + index]
            };
            for i in 0..4 {
                let gap = unknowns[4 + i] - force / stiffness;
                if gap.is_nan() || gap <= 0.0 {
                    return None;
                }
                let weight = 1e-15 / self.noise.capacitance;
                let slope = area / (gap * gap) * weight;
                let mut row = vec![0.0; unknowns.len()];
                row[i] = weight;
                row[4 + i] = -slope;
                row[8] = -slope * force / (stiffness * stiffness);
                if !self.gauge_is_exact() {
                    row[SHARED + index] = slope / stiffness;
                }
                design.push(row);
                let model = unknowns[i] + area / gap;
                residual.push((point.capacitance[i] * 1e15 - model) * weight);
            }
            if !self.gauge_is_exact() {
                let weight = 1e-3 / self.noise.force;
                let mut row = vec![0.0; unknowns.len()];
                row[SHARED + index] = weight;
                design.push(row);
                residual.push((point.force * 1e3 - force) * weight);
            }
        }
        if let Some((parallel, deviation)) = self.noise.measured_parallel {
            for i in 0..4 {
                let weight = 1e-15 / deviation;
                let mut row = vec![0.0; unknowns.len()];
                row[i] = weight;
                design.push(row);
                residual.push((parallel[i] * 1e15 - unknowns[i]) * weight);
            }
        }
        Some((design, residual))
    }

    fn report(&self, unknowns: &[f64], design: &[Vec<f64>], residual: &[f64]) -> Option<SweepFit> {
        let covariance = least_squares::solve(design, residual)?.covariance;
        let deviation = |i: usize| covariance[i][i].sqrt();
        let mut fit = SweepFit {
            parallel_capacitance: std::array::from_fn(|i| unknowns[i] * 1e-15),
            parallel_deviation: std::array::from_fn(|i| deviation(i) * 1e-15),
            gap: std::array::from_fn(|i| unknowns[4 + i] * 1e-6),
            gap_deviation: std::array::from_fn(|i| deviation(4 + i) * 1e-6),
            stiffness: unknowns[8] * 1e3,
            stiffness_deviation: deviation(8) * 1e3,
            chi2: square_sum(residual),
            warning: None,
        };
        fit.warning = self.warning(&fit);
        Some(fit)
    }

    fn warning(&self, fit: &SweepFit) -> Option<String> {
        let rest = self
            .points
            .iter()
            .map(|point| point.capacitance[0])
            .fold(f64::INFINITY, f64::min);
        let parallel = fit.parallel_deviation.iter().copied().fold(0.0, f64::max);
        let useless =
            fit.stiffness_deviation > USELESS * fit.stiffness || parallel > USELESS * rest;
        useless.then(|| {
            format!(
                "this sweep cannot separate parallel capacitance, gap and stiffness: their standard deviations are \
                 {:.2} fF, {:.3} um and {:.0} N/m; sweep to a higher force, use a finer gauge, or give a measured \
                 parallel capacitance",
                parallel * 1e15,
                fit.gap_deviation.iter().copied().fold(0.0, f64::max) * 1e6,
                fit.stiffness_deviation,
            )
        })
    }
}

/// Levenberg-Marquardt step: rows damping·|column| appended to the problem.
fn damped_step(design: &[Vec<f64>], residual: &[f64], damping: f64) -> Option<Vec<f64>> {
    let columns = design.first()?.len();
    let mut rows = design.to_vec();
    for j in 0..columns {
        let length = design.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
        let mut row = vec![0.0; columns];
        row[j] = damping.sqrt() * length;
        rows.push(row);
    }
    let mut target = residual.to_vec();
    target.resize(rows.len(), 0.0);
    Some(least_squares::solve(&rows, &target)?.coefficients)
}

fn square_sum(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}
