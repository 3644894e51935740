//! Stiffness map: gauge forces on the displacements of the published inverse
//! (P2 physics section 7.3).
//!
//! The regression never uses the four closings directly: rigid data fill only
//! three directions of them, and a later fault in one capacitor would go
//! straight into the forces. The twist has no column here.

use taxel_numerics::least_squares::linear;

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
    /// Coefficients of d_x, d_y, d_z (N/m), and the constant (N).
    pub(super) coefficients: Vec<f64>,
    /// Their standard deviations.
    pub(super) deviations: Vec<f64>,
    /// √(Σ residual²/(n − number of coefficients)), N.
    pub(super) residual_deviation: f64,
    /// 1 − Σ residual²/Σ (force − mean)².
    pub(super) r_squared: f64,
}

/// Least squares of each force component on (d_x, d_y, d_z, 1); the rows of
/// the result are x, y, z.
///
/// `None` when there are too few observations, or they do not move all of
/// the displacements independently.
pub(super) fn fit_stiffness(observations: &[Observation]) -> Option<[StiffnessFit; 3]> {
    let columns = |o: &Observation| {
        let [x, y, z] = o.displacement;
        vec![x, y, z, 1.0]
    };
    let design: Vec<Vec<f64>> = observations.iter().map(columns).collect();
    let fit = |axis: usize| {
        let target: Vec<f64> = observations.iter().map(|o| o.force[axis]).collect();
        fit_component(&design, &target)
    };
    Some([fit(0)?, fit(1)?, fit(2)?])
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
        deviations: (0..solution.coefficients.len())
            .map(|i| (variance * solution.covariance[i][i]).sqrt())
            .collect(),
        coefficients: solution.coefficients,
        residual_deviation: variance.sqrt(),
        r_squared: 1.0 - solution.misfit / spread,
    })
}
