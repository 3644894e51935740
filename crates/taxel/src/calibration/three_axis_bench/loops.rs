//! The hysteresis of three-axis units along each axis: force by the four
//! capacitances beside that of the gauge.

use super::super::loops::{Curve, Loops, Named, Sample, identify, samples};
use super::problem::{AXES, Reading};
use super::result::force_error;
use super::{CalibrateOptions, Fitted, ThreeAxisCalibrator};

/// What the names of the weights along an axis begin with.
pub(super) fn prefix(axis: usize) -> String {
    format!("force_{}.", AXES[axis])
}

/// The hysteresis along each axis that the readings of all taxels tell, and the
/// readings with the forces that they would have on loading; `None` where they
/// tell none. The fits are to loading and unloading alike.
pub(super) fn of_array(
    calibrator: &ThreeAxisCalibrator<'_>,
    fits: &[Fitted],
    taxels: &[Vec<Reading>],
    options: &CalibrateOptions,
) -> Option<(Vec<Loops>, Vec<Vec<Reading>>)> {
    let held: Vec<bool> = taxels
        .iter()
        .flat_map(|of| {
            let marked: Vec<bool> = of.iter().map(|reading| reading.marked).collect();
            options.hold_out.held(&marked)
        })
        .collect();
    let mut corrected = taxels.to_vec();
    let mut found = Vec::new();
    for (axis, name) in AXES.iter().enumerate() {
        let pairs = fits.iter().zip(taxels);
        let all: Vec<Sample> = pairs
            .flat_map(|(fitted, of)| along(calibrator, fitted, of, axis))
            .collect();
        let named = Named {
            prefix: &prefix(axis),
            title: format!("Hysteresis along {name}"),
            quantity: "force",
            unit: ("mN", 1e-3),
        };
        let Some(loops) = identify(&all, &held, Curve::Mean, &named) else {
            continue;
        };
        let readings = corrected.iter_mut().flatten();
        for (reading, sample) in readings.zip(&all) {
            let sign = reading.force[axis].signum();
            if reading.gauged[axis] {
                reading.force[axis] = sign * sample.without(&loops.law).abs();
            }
        }
        found.push(loops);
    }
    (!found.is_empty()).then_some((found, corrected))
}

/// Samples of one taxel along an axis.
fn along(
    calibrator: &ThreeAxisCalibrator<'_>,
    fitted: &Fitted,
    of: &[Reading],
    axis: usize,
) -> Vec<Sample> {
    let unit = fitted.unit(&calibrator.drawn);
    // A force that no gauge read tells nothing.
    let loading = |reading: &Reading| match force_error(&unit, reading) {
        Some(error) if reading.gauged[axis] => reading.force[axis] - error[axis],
        _ => 0.0,
    };
    let [loading, forces, driven]: [Vec<f64>; 3] = [
        of.iter().map(loading).collect(),
        of.iter().map(|reading| reading.force[axis]).collect(),
        of.iter().map(|reading| reading.force[axis].abs()).collect(),
    ];
    samples(&loading, &forces, &driven)
}
