//! The hysteresis of one in-plane sensor: force of loading by its capacitance
//! beside that of the gauge.

use super::problem::Reading;
use crate::hysteresis::{Loops, Named, identify, samples};
use taxel::transduction::InPlaneModel;

/// The hysteresis of the sensor that reads as `model` does on loading, from
/// readings in their order; `None` when they identify none. `moved` are models with
/// their constants at the steps of the fit; `held` says which readings are held
/// out.
pub(super) fn of_sensor(
    model: &InPlaneModel,
    moved: &mut dyn Iterator<Item = InPlaneModel>,
    readings: &[Reading],
    held: &[bool],
    prefix: &str,
) -> Option<Loops> {
    let name = prefix.trim_end_matches('.').replace('_', " ");
    let named = Named {
        prefix,
        title: format!("{name}: hysteresis"),
        quantity: "force",
        unit: ("N", 1.0),
    };
    let [forces, driven]: [Vec<f64>; 2] = [
        readings.iter().map(|reading| reading.force).collect(),
        readings.iter().map(Reading::load).collect(),
    ];
    let samples = samples(&loading(model, readings)?, &forces, &driven);
    let mut moved = moved.filter_map(|model| loading(&model, readings));
    identify(&samples, &mut moved, held, &named)
}

/// Forces on loading by the capacitances, N; `None` where the model cannot be
/// inverted.
fn loading(model: &InPlaneModel, readings: &[Reading]) -> Option<Vec<f64>> {
    let inverse = model.inverse().ok()?;
    let last = inverse.last().change;
    let loading = |reading: &Reading| {
        let change = model.rest_capacitance() - reading.capacitance;
        inverse.force_from_change(change.min(last))
    };
    Some(readings.iter().map(loading).collect())
}
