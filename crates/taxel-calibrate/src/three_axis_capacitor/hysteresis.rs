//! The hysteresis of three-axis units along each axis: force by the four
//! capacitances beside that of the gauge.

use super::problem::{AXES, Reading, force_error, with_values};
use super::{Fitted, ThreeAxisCalibrator};
use crate::hysteresis::{Loops, Named, Sample, identify, samples, steps};
use taxel::transduction::ThreeAxisModel;

/// Prefix of the names of the weights along an axis.
pub(super) fn prefix(axis: usize) -> String {
    format!("force_{}.", AXES[axis])
}

impl ThreeAxisCalibrator<'_> {
    /// The hysteresis along each axis from all readings of the taxels, those
    /// of unloading included.
    pub(super) fn loops(
        &self,
        fits: &[Fitted],
        taxels: &[Vec<Reading>],
        held: &[bool],
    ) -> Vec<Loops> {
        let estimated =
            |(fitted, of): (&Fitted, &Vec<Reading>)| by_capacitances(&self.unit(fitted), of);
        let estimated: Vec<Vec<[f64; 3]>> = fits.iter().zip(taxels).map(estimated).collect();
        // Of each taxel, with its constants at each step.
        let stepped = |(fitted, of): (&Fitted, &Vec<Reading>)| -> Vec<Vec<[f64; 3]>> {
            let forces = |at: &Vec<f64>| by_capacitances(&with_values(&self.drawn, at), of);
            steps(&fitted.fit).iter().map(forces).collect()
        };
        let stepped: Vec<_> = fits.iter().zip(taxels).map(stepped).collect();
        let of_axis = |axis: usize| {
            let own =
                |forces: &[[f64; 3]]| forces.iter().map(|force| force[axis]).collect::<Vec<_>>();
            let beside = |(estimated, of): (&Vec<[f64; 3]>, &Vec<Reading>)| {
                let forces: Vec<f64> = of.iter().map(|r| r.force[axis]).collect();
                samples(&own(estimated), &forces, &forces)
            };
            let all: Vec<Sample> = estimated.iter().zip(taxels).flat_map(beside).collect();
            let mut moved = stepped.iter().enumerate().flat_map(|(place, steps)| {
                let [before, behind] =
                    [&estimated[..place], &estimated[place + 1..]].map(<[_]>::concat);
                let step = move |step: &Vec<_>| own(&[&before[..], step, &behind].concat());
                steps.iter().map(step)
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
}

/// Forces that the capacitances would have on loading, N; none where no gauge
/// read them.
fn by_capacitances(unit: &ThreeAxisModel, of: &[Reading]) -> Vec<[f64; 3]> {
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
