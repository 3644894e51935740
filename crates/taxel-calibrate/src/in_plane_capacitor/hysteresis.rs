//! The hysteresis of in-plane sensors: force of loading by the capacitance of each
//! beside that of the gauge.

use super::problem::{self, Reading};
use super::{Fitted, InPlaneCalibrator, law};
use crate::hysteresis::{Loops, Named, identify, samples, steps};
use taxel::transduction::InPlaneModel;

impl InPlaneCalibrator<'_> {
    /// The hysteresis of one sensor from its readings in their order; `None` when they
    /// identify none. `held` says which readings are held out.
    pub(super) fn loops(&self, fitted: &Fitted, of: &[Reading], held: &[bool]) -> Option<Loops> {
        let sensor = of.first()?.sensor;
        let by_capacitance = |at: &[f64]| {
            let model = problem::calibrated(&self.models[sensor], law(fitted), sensor, at);
            forces(&model, of)
        };
        let named = Named {
            prefix: &self.prefixes[sensor],
            title: format!("{}: hysteresis", self.title(sensor)),
            quantity: "force",
            unit: ("N", 1.0),
        };
        let read: Vec<f64> = of.iter().map(Reading::force).collect::<Option<_>>()?;
        let driven: Vec<f64> = of.iter().map(Reading::drive).collect();
        let samples = samples(&by_capacitance(&fitted.fit.values())?, &read, &driven);
        let steps = steps(&fitted.fit);
        let mut moved = steps.iter().filter_map(|at| by_capacitance(at));
        identify(&samples, &mut moved, held, &named)
    }
}

/// Forces on loading by the capacitances, N; `None` where the model cannot be
/// inverted.
fn forces(model: &InPlaneModel, readings: &[Reading]) -> Option<Vec<f64>> {
    let inverse = model.inverse().ok()?;
    let last = inverse.last().change;
    let loading = |reading: &Reading| {
        let change = model.rest_capacitance() - reading.capacitance;
        inverse.force_from_change(change.min(last))
    };
    Some(readings.iter().map(loading).collect())
}
