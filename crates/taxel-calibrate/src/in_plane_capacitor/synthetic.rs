//! Synthetic calibration data of in-plane sensors, of known true constants.

use std::fmt::Write as _;

use super::checks::micrometres;
use crate::hysteresis;
use crate::options::SyntheticOptions;
use crate::synthetic::triangle;
use taxel::mechanics::LoadHistory;
use taxel::transduction::InPlaneModel;
use taxel_numerics::Noise;

/// Readings of all `models`, one after the other, as CSV.
///
/// The displacement goes up and down as a triangle over time and is read
/// without error. Forces follow from the layer pressed flat, or by a tilted
/// probe from the mean over its two Gauss points; the force on loading exceeds
/// that on unloading by `hysteresis`; capacitances drift along a straight line.
pub(super) fn table(models: &[InPlaneModel], options: &SyntheticOptions) -> String {
    let mut noise = Noise::seeded(options.seed);
    let mut text = options.head(&["hysteresis", "drift", "tilt"]);
    text.push_str("time [s],gap [um],displacement [um],force_z [N],capacitance [fF]\n");
    let law = hysteresis::synthetic(options.hysteresis);
    for model in models {
        let mut history = LoadHistory::default();
        let states: Vec<[f64; 3]> = (0..options.readings)
            .filter_map(|i| state(model, options, i))
            .map(|[displacement, loading, capacitance]| {
                let force = loading * law.share(&history.push(loading));
                [displacement, force, capacitance]
            })
            .collect();
        let largest = |column: usize, zero: f64| {
            let sizes = states.iter().map(|state| (state[column] - zero).abs());
            sizes.fold(0.0, f64::max)
        };
        let rest = model.rest_capacitance();
        let full = [largest(1, 0.0), largest(2, rest)];
        for (i, [displacement, force, capacitance]) in states.iter().enumerate() {
            let time = 0.1 * i as f64;
            let drift = options.drifted(full[1], i);
            let _ = writeln!(
                text,
                "{time:.1},{},{:.4},{:.6},{:.5}",
                micrometres(model),
                displacement * 1e6,
                force + options.noise * full[0] * noise.normal(),
                (capacitance + drift + options.noise * full[1] * noise.normal()) * 1e15
            );
        }
    }
    text
}

/// Displacement, force of loading and capacitance of a reading without noise;
/// `None` beyond the models.
fn state(model: &InPlaneModel, options: &SyntheticOptions, index: usize) -> Option<[f64; 3]> {
    let compression = triangle(options.phase(index)) * options.compression;
    let force = tilted_force(model, compression, options.tilt)?;
    let capacitance = model.respond(compression).ok()?.capacitance;
    Some([compression * model.layer.thickness, force, capacitance])
}

fn tilted_force(model: &InPlaneModel, compression: f64, tilt: f64) -> Option<f64> {
    let layer = &model.layer;
    let lift = tilt.abs() * layer.contact_half_length / (3.0_f64.sqrt() * layer.thickness);
    let at = |compression: f64| Some(model.compress(compression.max(0.0)).ok()?.force);
    Some(0.5 * (at(compression - lift)? + at(compression + lift)?))
}
