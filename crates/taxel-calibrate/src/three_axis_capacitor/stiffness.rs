//! Stiffness map: gauge forces on the displacements of the published inverse
//! (P2 physics section 7.3).
//!
//! The regression never uses the four closings directly: rigid data fill only
//! three directions of them, and a later fault in one capacitor would go
//! straight into the forces. The twist has no column here.

use super::problem::{AXES, Reading, with_values};
use super::{Fitted, SIZE, ThreeAxisCalibrator, name_of};
use crate::outcome::Derived;
use taxel::transduction::ThreeAxisModel;
use taxel_numerics::dense::dot;
use taxel_numerics::least_squares::linear;

/// Step of a parameter over its size for slopes by differences to both sides: curvature adds
/// 1e-8 of them, rounding 1e-10.
const STEP: f64 = 1e-3;

impl ThreeAxisCalibrator<'_> {
    /// Stiffnesses along the axes that a gauge read.
    ///
    /// The value is that of the fitted unit under the forces of the bench, so it follows from
    /// the parameters alone, and σ² = gᵀ·cov·g with its slopes g by all parameters. One that
    /// is known worse than [`SIZE`] is not identifiable. R² is that of the readings.
    pub(super) fn stiffnesses(&self, fitted: &Fitted) -> Option<Vec<Derived>> {
        let (readings, name) = (&fitted.readings, name_of(&fitted.readings));
        let gauged = |axis: &usize| readings.iter().any(|r| r.gauged[*axis]);
        let axes: Vec<usize> = (0..AXES.len()).filter(gauged).collect();
        let at = fitted.fit.values();
        let values = |at: &[f64]| of_unit(&with_values(&self.drawn, at), readings, &axes);
        let read = of_readings(&self.unit(fitted), readings, &axes)?;
        let best = values(&at)?;
        let free = (0..at.len()).filter(|j| fitted.parameters[*j].is_free());
        let mut slopes = vec![vec![0.0; at.len()]; best.len()];
        for j in free {
            let step = STEP * fitted.parameters[j].size;
            let side = |sign: f64| {
                let mut moved = at.clone();
                moved[j] += sign * step;
                values(&moved)
            };
            let (below, above) = (side(-1.0)?, side(1.0)?);
            for (entry, slopes) in slopes.iter_mut().enumerate() {
                slopes[j] = (above[entry] - below[entry]) / (2.0 * step);
            }
        }
        let deviation = |slopes: &[f64]| {
            let rows = fitted.fit.covariance.iter().map(|row| dot(row, slopes));
            dot(&rows.collect::<Vec<f64>>(), slopes).sqrt()
        };
        let own = |k: usize| best[k * axes.len() + k].abs();
        let derived = |entry: usize| {
            let (row, column) = (entry / axes.len(), entry % axes.len());
            let [force, axis] = [row, column].map(|k| AXES[axes[k]]);
            let (value, deviation) = (best[entry], deviation(&slopes[entry]));
            let identified = deviation <= SIZE * (own(row) * own(column)).sqrt();
            let half = fitted.quantile() * deviation;
            Derived {
                name: format!("{name}.stiffness_{force}{axis}"),
                value,
                interval: identified.then_some([value - half, value + half]),
                about: format!(
                    "N/m, force_{force} over d_{axis} of the published inverse by a straight line, R^2 {:.6}",
                    read[row].r_squared
                ),
            }
        };
        Some((0..best.len()).map(derived).collect())
    }
}

/// Straight lines through the readings.
pub(super) fn of_readings(
    unit: &ThreeAxisModel,
    readings: &[Reading],
    axes: &[usize],
) -> Option<Vec<StiffnessFit>> {
    let rest = unit.rest();
    let observation = |r: &Reading| Observation {
        displacement: unit.effective_motion(rest, r.capacitance).displacement,
        force: r.force,
    };
    let observations: Vec<Observation> = readings.iter().map(observation).collect();
    fit_stiffness(&observations, axes)
}

/// Coefficients of the straight lines through what the unit itself would read under the same
/// forces, force by force; `None` where a tile touches.
fn of_unit(unit: &ThreeAxisModel, readings: &[Reading], axes: &[usize]) -> Option<Vec<f64>> {
    let predicted = |r: &Reading| {
        let (_, response) = unit.predict(r.force);
        let open = !response.closed().contains(&true);
        open.then(|| Reading {
            capacitance: response.capacitance(),
            ..*r
        })
    };
    let predicted: Vec<Reading> = readings.iter().map(predicted).collect::<Option<_>>()?;
    let lines = of_readings(unit, &predicted, axes)?;
    let coefficients = lines
        .iter()
        .flat_map(|line| &line.coefficients[..axes.len()]);
    Some(coefficients.copied().collect())
}

/// One loading of the bench: displacements (m) and gauge forces (N).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Observation {
    /// d_x, d_y, d_z, m.
    pub(super) displacement: [f64; 3],
    /// Gauge force x, y, z, N.
    pub(super) force: [f64; 3],
}

/// Fit of one force component.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StiffnessFit {
    /// Coefficients of the displacements (N/m), and the constant (N).
    pub(super) coefficients: Vec<f64>,
    /// √(Σ residual²/(n − number of coefficients)), N.
    pub(super) residual_deviation: f64,
    /// 1 − Σ residual²/Σ (force − mean)².
    pub(super) r_squared: f64,
}

/// Least squares of the forces along `axes` on the displacements along them and a constant;
/// the rows of the result are in the order of `axes`.
///
/// `None` when there are too few observations, or they do not move all of
/// the displacements independently.
pub(super) fn fit_stiffness(
    observations: &[Observation],
    axes: &[usize],
) -> Option<Vec<StiffnessFit>> {
    let columns = |o: &Observation| {
        let along = axes.iter().map(|axis| o.displacement[*axis]);
        along.chain([1.0]).collect()
    };
    let design: Vec<Vec<f64>> = observations.iter().map(columns).collect();
    let fit = |axis: &usize| {
        let target: Vec<f64> = observations.iter().map(|o| o.force[*axis]).collect();
        fit_component(&design, &target)
    };
    axes.iter().map(fit).collect()
}

fn fit_component(design: &[Vec<f64>], target: &[f64]) -> Option<StiffnessFit> {
    let solution = linear::solve(design, target)?;
    let freedom = design.len() - solution.coefficients.len();
    if freedom == 0 {
        return None;
    }
    let variance = solution.misfit / freedom as f64;
    let mean = target.iter().sum::<f64>() / target.len() as f64;
    let spread: f64 = target.iter().map(|force| (force - mean).powi(2)).sum();
    Some(StiffnessFit {
        coefficients: solution.coefficients,
        residual_deviation: variance.sqrt(),
        r_squared: 1.0 - solution.misfit / spread,
    })
}
