//! The hysteresis of the rubber round channels: pressure of loading by the
//! voltage beside that of the bench.

use super::super::loops::{Curve, Loops, Named, Sample, identify, samples};
use super::problem::{BIAS, Load, Reading};
use super::{CalibrateOptions, ChannelCalibrator, Fitted};
use crate::numerics;

/// The hysteresis that the readings of all channels in their order tell, those
/// of unloading included; `None` when they tell none.
pub(super) fn of_array(
    calibrator: &ChannelCalibrator<'_>,
    fitted: &Fitted,
    all: &[Reading],
    options: &CalibrateOptions,
) -> Option<Loops> {
    let (mut found, mut held): (Vec<Sample>, Vec<bool>) = (Vec::new(), Vec::new());
    let bias = fitted.fit.estimates[BIAS].value;
    for channel in &fitted.channels {
        let of = all.iter().filter(|reading| reading.channel == *channel);
        let of: Vec<&Reading> = of.collect();
        let pressures: Vec<f64> = of.iter().map(|r| r.load.pressure(bias)).collect();
        let highest = BEYOND * pressures.iter().copied().fold(0.0, f64::max);
        let loading = |reading: &&Reading| loading(calibrator, fitted, reading, highest);
        let loading: Vec<f64> = of.iter().map(loading).collect();
        let marked: Vec<bool> = of.iter().map(|reading| reading.marked).collect();
        found.extend(samples(&loading, &pressures, &pressures));
        held.extend(options.hold_out.held(&marked));
    }
    let named = Named {
        prefix: "",
        title: "Hysteresis of all channels".into(),
        quantity: "pressure",
        unit: ("kPa", 1e3),
    };
    identify(&found, &held, Curve::Loading, &named)
}

/// Pressures on loading are looked for up to this factor of the largest one.
const BEYOND: f64 = 1.5;

/// Pressure on loading up to `highest` at which the model has the voltage of a
/// reading, Pa.
fn loading(
    calibrator: &ChannelCalibrator<'_>,
    fitted: &Fitted,
    reading: &Reading,
    highest: f64,
) -> f64 {
    let at = fitted.fit.values();
    let bench = calibrator.bench_of(&fitted.channels, &[]);
    let misfit = |pressure: f64| {
        let such = Reading {
            load: Load::Pressure(pressure),
            ..*reading
        };
        let voltage = bench.predict(&at, &such);
        voltage.map_or(f64::NAN, |voltage| voltage - reading.voltage)
    };
    // Not a number where the model has no answer: then there is no load.
    let (below, beyond) = (misfit(0.0) < 0.0, misfit(highest) > 0.0);
    match (below, beyond) {
        (true, true) => numerics::ridders([0.0, highest], misfit),
        (true, false) => highest,
        _ => 0.0,
    }
}
