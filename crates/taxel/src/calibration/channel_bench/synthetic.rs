//! A bench for crossing channels that exists in the computer only: its truth is
//! known.

use std::fmt::Write as _;

use super::ChannelCalibrator;
use super::problem::{Load, Reading};
use crate::calibration::outcome::BenchOptions;
use crate::electronics::Noise;
use crate::mechanics::LARGEST_COMPRESSION;

/// Readings of all channels, one after the other, as CSV.
///
/// The pressure, even along the channel, goes up and down as a triangle over
/// time. The largest compression 0.4 of the options stands for the pressure at
/// which the closing curve ends. Loading changes the voltage more than
/// unloading by `hysteresis`; the tilt has no meaning here.
pub(super) fn bench(calibrator: &ChannelCalibrator<'_>, options: &BenchOptions) -> String {
    let mut noise = Noise::seeded(options.seed);
    let mut text =
        String::from("# synthetic: readings of a bench that exists in the computer only\n");
    let _ = writeln!(
        text,
        "# seed {}, noise {}, hysteresis {}, drift {}",
        options.seed, options.noise, options.hysteresis, options.drift
    );
    text.push_str("time [s],channel,pressure [kPa],voltage [mV]\n");
    let at = calibrator.drawn();
    for channel in calibrator.all.iter().copied() {
        let layer = calibrator.layer_of(channel);
        let highest = calibrator.highest[layer] * options.compression / LARGEST_COMPRESSION;
        let voltage = |pressure: f64| {
            let reading = Reading {
                channel,
                layer,
                load: Load::Pressure(pressure),
                share: 1.0,
                voltage: 0.0,
                deviation: None,
                marked: false,
            };
            calibrator
                .bench_of(&calibrator.all, &[])
                .predict(&at, &reading)
        };
        let (Some(rest), Some(most)) = (voltage(0.0), voltage(highest)) else {
            continue;
        };
        for index in 0..options.readings {
            let phase = options.cycles as f64 * index as f64 / options.readings as f64;
            let turn = 2.0 * phase.fract();
            let (share, sign) = if turn < 1.0 {
                (turn, 1.0)
            } else {
                (2.0 - turn, -1.0)
            };
            let Some(exact) = voltage(share * highest) else {
                continue;
            };
            let drift = options.drift * index as f64 / options.readings as f64;
            let change = (exact - rest) * (1.0 + 0.5 * sign * options.hysteresis);
            let off = (drift + options.noise * noise.normal()) * (most - rest);
            let _ = writeln!(
                text,
                "{:.1},{channel},{:.6},{:.6}",
                0.1 * index as f64,
                share * highest * 1e-3,
                (rest + change + off) * 1e3
            );
        }
    }
    text
}
