//! Parallel capacitance, gap and stiffness from a normal sweep (P2 physics
//! section 7.2): C_i(F) = C_par,i + ε₀ab/(g_i − F/k_z), jointly for the four
//! capacitors of a unit.
//!
//! Unique in theory, hard in practice: over 0 to 15 mN with a gauge of 1 mN
//! the parallel capacitance is known to 56 fF. The gauge's error is therefore
//! part of the fit (the true forces are unknowns with the readings as priors),
//! and the fit says itself when it is no use.

use taxel_numerics::least_squares::{Fit, FitOptions, Parameter, Prior, Problem, fit};

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

/// Fits a sweep; `area` is ε₀ab, F m.
///
/// `None` when the points are too few, or have no model at `start`.
pub fn fit_normal_sweep(
    points: &[SweepPoint],
    area: f64,
    noise: &SweepNoise,
    start: &SweepStart,
) -> Option<SweepFit> {
    let sweep = Sweep {
        points,
        area,
        noise,
    };
    let found = fit(&sweep, &sweep.parameters(start)?, &FitOptions::default()).ok()?;
    Some(sweep.report(&found))
}

struct Sweep<'a> {
    points: &'a [SweepPoint],
    area: f64,
    noise: &'a SweepNoise,
}

impl Sweep<'_> {
    fn gauge_is_exact(&self) -> bool {
        self.noise.force <= 0.0
    }

    fn least_capacitance(&self) -> f64 {
        let all = self.points.iter().map(|point| point.capacitance[0]);
        all.fold(f64::INFINITY, f64::min)
    }

    /// Unknowns in natural units: fF, um, kN/m, mN. The gauge's readings are
    /// priors of the true forces.
    fn parameters(&self, start: &SweepStart) -> Option<Vec<Parameter>> {
        let by_force = |a: &&SweepPoint, b: &&SweepPoint| a.force.total_cmp(&b.force);
        let rest = self.points.iter().min_by(by_force)?;
        let measured = self.noise.measured_parallel;
        let mut parameters: Vec<Parameter> = (0..4)
            .map(|i| Parameter {
                size: USELESS * self.least_capacitance() * 1e15,
                prior: measured.map(|(parallel, deviation)| Prior {
                    value: parallel[i] * 1e15,
                    deviation: deviation * 1e15,
                }),
                ..Parameter::new("parallel_capacitance", start.parallel_capacitance[i] * 1e15)
            })
            .collect();
        for i in 0..4 {
            let plate = rest.capacitance[i] - start.parallel_capacitance[i];
            let gap = (self.area / plate + rest.force / start.stiffness) * 1e6;
            parameters.push(Parameter {
                size: USELESS * gap.abs(),
                ..Parameter::new("gap", gap)
            });
        }
        let stiffness = start.stiffness * 1e-3;
        parameters.push(Parameter {
            size: USELESS * stiffness,
            ..Parameter::new("stiffness", stiffness)
        });
        if !self.gauge_is_exact() {
            parameters.extend(self.points.iter().map(|point| {
                let prior = Prior {
                    value: point.force * 1e3,
                    deviation: self.noise.force * 1e3,
                };
                Parameter {
                    size: prior.deviation,
                    prior: Some(prior),
                    ..Parameter::new("force", prior.value)
                }
            }));
        }
        let finite = parameters
            .iter()
            .all(|parameter| parameter.start.is_finite());
        finite.then_some(parameters)
    }

    /// Force of a point, mN, and its gaps, um.
    fn state(&self, at: &[f64], index: usize) -> (f64, [f64; 4]) {
        let force = if self.gauge_is_exact() {
            self.points[index].force * 1e3
        } else {
            at[SHARED + index]
        };
        (force, std::array::from_fn(|i| at[4 + i] - force / at[8]))
    }

    fn report(&self, found: &Fit) -> SweepFit {
        let value = |j: usize| found.estimates[j].value;
        let deviation = |j: usize| found.estimates[j].deviation;
        let mut fit = SweepFit {
            parallel_capacitance: std::array::from_fn(|i| value(i) * 1e-15),
            parallel_deviation: std::array::from_fn(|i| deviation(i) * 1e-15),
            gap: std::array::from_fn(|i| value(4 + i) * 1e-6),
            gap_deviation: std::array::from_fn(|i| deviation(4 + i) * 1e-6),
            stiffness: value(8) * 1e3,
            stiffness_deviation: deviation(8) * 1e3,
            chi2: found.chi_square,
            warning: None,
        };
        fit.warning = self.warning(&fit);
        fit
    }

    fn warning(&self, fit: &SweepFit) -> Option<String> {
        let rest = self.least_capacitance();
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

impl Problem for Sweep<'_> {
    fn readings(&self) -> usize {
        4 * self.points.len()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let (area, weight) = (self.area * 1e21, 1e-15 / self.noise.capacitance); // fF um
        for (index, point) in self.points.iter().enumerate() {
            let (_, gaps) = self.state(at, index);
            // A closed gap, or one that is not a number, has no capacitance.
            if !gaps.iter().all(|gap| *gap > 0.0) {
                return false;
            }
            for i in 0..4 {
                let model = at[i] + area / gaps[i];
                residuals[4 * index + i] = (point.capacitance[i] * 1e15 - model) * weight;
            }
        }
        true
    }

    fn slopes(&self, _: &[Parameter], at: &[f64], columns: &mut [Vec<f64>]) -> bool {
        let (area, weight) = (self.area * 1e21, 1e-15 / self.noise.capacitance);
        for column in columns.iter_mut() {
            column.fill(0.0);
        }
        for index in 0..self.points.len() {
            let (force, gaps) = self.state(at, index);
            for i in 0..4 {
                let (row, slope) = (4 * index + i, area / gaps[i].powi(2) * weight);
                columns[i][row] = -weight;
                columns[4 + i][row] = slope;
                columns[8][row] = slope * force / at[8].powi(2);
                if !self.gauge_is_exact() {
                    columns[SHARED + index][row] = -slope / at[8];
                }
            }
        }
        true
    }
}
