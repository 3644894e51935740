//! The hysteresis of one in-plane sensor: force of loading by its capacitance
//! beside that of the gauge.

use super::super::loops::{Curve, Loops, Named, identify, samples};
use super::problem::Reading;
use crate::transduction::InPlaneModel;

/// The hysteresis of the sensor that reads as `model` does on loading, from
/// readings in their order; `None` when they tell none. `held` says which
/// readings are held out.
pub(super) fn of_sensor(
    model: &InPlaneModel,
    readings: &[Reading],
    held: &[bool],
    prefix: &str,
) -> Option<Loops> {
    let inverse = model.inverse().ok()?;
    let last = inverse.last().change;
    let loading = |reading: &Reading| {
        let change = model.rest_capacitance() - reading.capacitance;
        inverse.force_from_change(change.min(last))
    };
    let driven = |reading: &Reading| reading.displacement.unwrap_or(reading.force);
    let [loading, forces, driven]: [Vec<f64>; 3] = [
        readings.iter().map(loading).collect(),
        readings.iter().map(|reading| reading.force).collect(),
        readings.iter().map(driven).collect(),
    ];
    let name = prefix.trim_end_matches('.').replace('_', " ");
    let named = Named {
        prefix,
        title: format!("{name}: hysteresis"),
        quantity: "force",
        unit: ("N", 1.0),
    };
    identify(
        &samples(&loading, &forces, &driven),
        held,
        Curve::Loading,
        &named,
    )
}
