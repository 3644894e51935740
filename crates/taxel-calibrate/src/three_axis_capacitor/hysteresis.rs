//! The hysteresis of three-axis units along each axis: force by the four
//! capacitances beside that of the gauge.

use super::problem::{AXES, Reading, with_values};
use super::result::force_error;
use super::{Fitted, PREFIX, Remark, ThreeAxisCalibrator, taxel};
use crate::hysteresis::{Loops, Named, Sample, identify, on_loading, samples, steps, unloading};
use crate::split::{branches, turns};
use taxel::transduction::UnitModel;

/// Prefix of the names of the weights along an axis.
pub(super) fn prefix(axis: usize) -> String {
    format!("force_{}.", AXES[axis])
}

/// A load that turns more often than at each of so many readings is in no
/// order: noise, or forces at random.
const IN_ORDER: usize = 4;

/// The readings of a taxel at which no axis unloads; remarks on the rest.
pub(super) fn loading(of: &[Reading], remarks: &mut Vec<Remark>) -> Vec<Reading> {
    let mut down = vec![false; of.len()];
    for axis in 0..AXES.len() {
        let forces = along(of, axis);
        let sizes: Vec<f64> = forces.iter().map(|force| force.abs()).collect();
        if IN_ORDER * turns(&branches(&sizes)) > of.len() {
            continue;
        }
        for (down, unloading) in down.iter_mut().zip(unloading(&forces)) {
            *down |= unloading;
        }
    }
    on_loading(&format!("{PREFIX}{}", taxel(of)), of, &down, "", remarks)
}

/// Forces of the gauge along an axis, N.
fn along(of: &[Reading], axis: usize) -> Vec<f64> {
    of.iter().map(|reading| reading.force[axis]).collect()
}

/// The hysteresis along each axis from all readings of the taxels, those
/// of unloading included.
pub(super) fn of_array(
    calibrator: &ThreeAxisCalibrator<'_>,
    fits: &[Fitted],
    taxels: &[Vec<Reading>],
    held: &[bool],
) -> Vec<Loops> {
    let pairs = || fits.iter().zip(taxels);
    let estimated: Vec<Vec<[f64; 3]>> = pairs()
        .map(|(fitted, of)| by_capacitances(&calibrator.unit(fitted), of))
        .collect();
    // Of each taxel, with its constants at each step.
    let step = |(fitted, of): (&Fitted, &Vec<Reading>)| -> Vec<Vec<[f64; 3]>> {
        let unit = |at: &Vec<f64>| with_values(&calibrator.drawn, at);
        let steps = steps(&fitted.fit);
        steps
            .iter()
            .map(|at| by_capacitances(&unit(at), of))
            .collect()
    };
    let stepped: Vec<Vec<Vec<[f64; 3]>>> = pairs().map(step).collect();
    let of_axis = |axis: usize| {
        let own = |forces: &[[f64; 3]]| forces.iter().map(|force| force[axis]).collect::<Vec<_>>();
        let beside = |(estimated, of): (&Vec<[f64; 3]>, &Vec<Reading>)| {
            let forces = along(of, axis);
            samples(&own(estimated), &forces, &forces)
        };
        let all: Vec<Sample> = estimated.iter().zip(taxels).flat_map(beside).collect();
        let mut moved = stepped.iter().enumerate().flat_map(|(place, steps)| {
            let [before, behind] =
                [&estimated[..place], &estimated[place + 1..]].map(<[_]>::concat);
            steps
                .iter()
                .map(move |step| own(&[&before[..], step, &behind].concat()))
        });
        let named = Named {
            prefix: &prefix(axis),
            title: format!("Hysteresis along {}", AXES[axis]),
            quantity: "force",
            unit: ("mN", 1e-3),
        };
        identify(&all, &mut moved, held, &named)
    };
    (0..AXES.len()).filter_map(of_axis).collect()
}

/// Forces that the capacitances would have on loading, N; none where no gauge
/// read them.
fn by_capacitances(unit: &UnitModel, of: &[Reading]) -> Vec<[f64; 3]> {
    let loading = |reading: &Reading| {
        let Some(error) = force_error(unit, reading) else {
            return [0.0; 3];
        };
        std::array::from_fn(|axis| {
            if reading.gauged[axis] {
                reading.force[axis] - error[axis]
            } else {
                0.0
            }
        })
    };
    of.iter().map(loading).collect()
}
