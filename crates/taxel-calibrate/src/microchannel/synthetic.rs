//! Synthetic calibration data of crossing microchannels, of known true constants.

use std::fmt::Write as _;

use super::MicrochannelCalibrator;
use super::problem::{Load, Reading};
use crate::hysteresis;
use crate::options::SyntheticOptions;
use crate::synthetic::triangle;
use taxel::mechanics::{LARGEST_COMPRESSION, LoadHistory};
use taxel_numerics::Noise;

/// Readings of all channels, one after the other, as CSV.
///
/// The pressure, even along the channel, goes up and down as a triangle over
/// time. The largest compression 0.4 of the options stands for the pressure at
/// which the closing curve ends. A channel closes as the triangle says; the
/// pressure that closes it so is larger on loading than on unloading by
/// `hysteresis`. Its signal rises to the share `saturation` of its largest
/// change and no further. The tilt has no meaning here.
pub(super) fn table(calibrator: &MicrochannelCalibrator<'_>, options: &SyntheticOptions) -> String {
    let mut noise = Noise::seeded(options.seed);
    let mut text = options.head(&["hysteresis", "drift"]);
    let signal = &calibrator.board.signal;
    let ((name, _), (unit, scale)) = (signal.unit(), signal.shown());
    let _ = writeln!(text, "time [s],channel,pressure [kPa],{name} [{unit}]");
    let law = hysteresis::synthetic(options.hysteresis);
    let at = calibrator.drawn();
    for channel in calibrator.all.iter().copied() {
        let layer = calibrator.layer_of(channel);
        let highest = calibrator.highest[layer] * options.compression / LARGEST_COMPRESSION;
        let signal = |pressure: f64| {
            let reading = Reading {
                channel,
                layer,
                load: Load::Pressure(pressure),
                share: 1.0,
                signal: 0.0,
                deviation: None,
                saturated: false,
                marked: false,
            };
            calibrator
                .bench_of(&calibrator.all, &[])
                .predict(&at, &reading)
        };
        let (Some(rest), Some(most)) = (signal(0.0), signal(highest)) else {
            continue;
        };
        let mut history = LoadHistory::default();
        for index in 0..options.readings {
            let share = triangle(options.phase(index));
            let Some(exact) = signal(share * highest) else {
                continue;
            };
            let drift = options.drifted(1.0, index);
            let change = (exact - rest).min(options.saturation * (most - rest));
            let carried = share * highest * law.share(&history.push(share * highest));
            let off = (drift + options.noise * noise.normal()) * (most - rest);
            let _ = writeln!(
                text,
                "{:.1},{channel},{:.6},{:.6}",
                0.1 * index as f64,
                carried * 1e-3,
                (rest + change + off) / scale
            );
        }
    }
    text
}
