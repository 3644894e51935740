//! Synthetic calibration data of a piezoelectric element.

use std::fmt::Write as _;

use super::PiezoelectricCalibrator;
use super::problem::{Device, Drive, NAMES, OWN, Reading, Table, UNITS, What};
use crate::options::{IndentationOptions, SyntheticOptions};
use taxel::mechanics::Profile;
use taxel::sensor::Sensor;
use taxel_numerics::Noise;

/// Share of the output's range that the largest peak fills.
const FILLED: f64 = 0.6;
/// Loads of each profile from the least to the largest.
const LOADS: usize = 10;
const RAMP: f64 = 10e-3;
const DWELL: f64 = 0.2;
const PERIOD: f64 = 0.35;
const CYCLES: u32 = 8;

/// Peaks of steps, impacts and cyclic loads over the displacement, as CSV with
/// the truth of the sensor file in comments.
///
/// Voltages grow by `drift` from the first reading to the last. A displacement
/// has neither hysteresis nor tilt. The largest one fills 60 % of the output's
/// range, but never more than `compression` of the silicone.
pub(super) fn table(sensor: &Sensor, options: &SyntheticOptions) -> String {
    let device = Device::new(sensor, Drive::Displacement);
    let truth = device.drawn();
    let table = Table {
        profiles: profiles().to_vec(),
        ..Table::new(device)
    };
    let unit = |(profile, first)| Reading {
        line: 0,
        load: 1.0,
        voltage: 0.0,
        deviation: None,
        marked: false,
        what: What::Peak { profile, first },
    };
    let both = (0..table.profiles.len()).flat_map(|profile| [(profile, true), (profile, false)]);
    let both: Vec<Reading> = both.map(unit).collect();
    let peaks = table.voltages(&both, &truth).unwrap_or_default();
    let most = peaks
        .iter()
        .fold(0.0_f64, |most, peak| most.max(peak.abs()));
    let largest = largest(sensor, options.compression, most);
    let deviation = options.noise * most * largest;
    let mut noise = Noise::seeded(options.seed);
    let mut text = options.head(&["drift"]);
    for place in 0..OWN {
        text.push_str(&crate::synthetic::truth(
            NAMES[place],
            truth[place],
            UNITS[place],
        ));
    }
    let shown = sensor.piezoelectric().map(|array| array.board.unit());
    let (unit, scale) = shown.map_or(("mV", 1e-3), |unit| (unit.symbol, unit.si_per_unit));
    let _ = writeln!(
        text,
        "time [s],displacement [um],ramp [ms],dwell [ms],period [ms],cycles,a1 [{unit}],a2 [{unit}]"
    );
    for i in 0..options.readings {
        let place = i % table.profiles.len();
        let load = largest * (1 + i / table.profiles.len() % LOADS) as f64 / LOADS as f64;
        let grown = 1.0 + options.drifted(1.0, i);
        let mut read = |peak: Option<&f64>| {
            (peak.unwrap_or(&0.0) * load * grown + deviation * noise.normal()) / scale
        };
        let [a1, a2] = [read(peaks.get(2 * place)), read(peaks.get(2 * place + 1))];
        let shape = match table.profiles[place] {
            Profile::Impact { ramp, dwell } => format!("{},{},,", ramp * 1e3, dwell * 1e3),
            Profile::Cyclic {
                ramp,
                period,
                cycles,
            } => format!("{},,{},{cycles}", ramp * 1e3, period * 1e3),
            Profile::Step { ramp } | Profile::Sine { period: ramp, .. } => {
                format!("{},,,", ramp * 1e3)
            }
        };
        let a2 = if matches!(table.profiles[place], Profile::Step { .. }) {
            String::new()
        } else {
            format!("{a2:.6}")
        };
        let _ = writeln!(text, "{i},{:.4},{shape},{a1:.6},{a2}", load * 1e6);
    }
    text
}

/// Presses of each probe on a grid over the elements, as CSV with the gains of
/// the piece of fabrication in comments.
///
/// A press gives each element its share; the highest output over the grid fills
/// 60 % of its range. The deviation of all signals of a press is `noise` of its
/// highest one.
pub(super) fn indentations(
    calibrator: &PiezoelectricCalibrator<'_>,
    options: &IndentationOptions,
) -> Option<String> {
    let sensor = calibrator.named.sensor;
    let array = sensor.piezoelectric().ok()?;
    let model = &calibrator.profile;
    let positions = model.centroid().positions;
    let gains = array.description.fabricate(positions.len());
    let mut noise = Noise::seeded(options.seed);
    let mut text = options.head();
    for (element, gain) in gains.iter().enumerate() {
        let _ = writeln!(text, "# truth gain_{} = {gain:.6}", element + 1);
    }
    let (name, shown) = (calibrator.unit.quantity, &calibrator.unit);
    let (unit, scale) = (shown.symbol, shown.si_per_unit);
    let _ = write!(
        text,
        "press,x [mm],y [mm],radius [mm],{name}_deviation [{unit}]"
    );
    for element in 1..=gains.len() {
        let _ = write!(text, ",{name}_{element} [{unit}]");
    }
    text.push('\n');
    let steps = |cells: usize, pitch: f64| {
        let half = 0.5 * (cells as f64 - 1.0) * pitch;
        let count = (2.0 * half / options.grid).floor() as usize;
        let first = -0.5 * count as f64 * options.grid;
        (0..=count).map(move |i| first + i as f64 * options.grid)
    };
    let mut number = 0;
    for radius in &options.radii {
        let table = model.cover(*radius).table();
        let share =
            |at: &[f64; 2], [x, y]: [f64; 2]| table.share([at[0] - x, at[1] - y], model.side);
        let [low, high] = calibrator.span;
        let most = FILLED * high.min(-low) / share(&[0.0; 2], [0.0; 2]);
        let most = most * calibrator.output_per_newton.signum();
        for y in steps(model.rows, model.pitch[1]) {
            for x in steps(model.columns, model.pitch[0]) {
                let elements = positions.iter().zip(&gains);
                let exact: Vec<f64> = elements
                    .map(|(at, gain)| most * gain * share(at, [x, y]))
                    .collect();
                let highest = exact
                    .iter()
                    .fold(0.0_f64, |most, volt| most.max(volt.abs()));
                let deviation = options.noise * highest;
                let _ = write!(
                    text,
                    "{number},{:.4},{:.4},{:.4},{:.6}",
                    1e3 * x,
                    1e3 * y,
                    1e3 * radius,
                    deviation / scale
                );
                for volt in exact {
                    let _ = write!(text, ",{:.6}", (volt + deviation * noise.normal()) / scale);
                }
                text.push('\n');
                number += 1;
            }
        }
    }
    Some(text)
}

fn profiles() -> [Profile; 3] {
    [
        Profile::Step { ramp: RAMP },
        Profile::Impact {
            ramp: RAMP,
            dwell: DWELL,
        },
        Profile::Cyclic {
            ramp: RAMP,
            period: PERIOD,
            cycles: CYCLES,
        },
    ]
}

/// The largest displacement, m, for peaks of at most `most` V/m.
fn largest(sensor: &Sensor, compression: f64, most: f64) -> f64 {
    let by_output = sensor.piezoelectric().map_or(f64::INFINITY, |array| {
        let [low, high] = array.board.span();
        FILLED * high.min(-low) / most
    });
    let thickness = match &sensor.element {
        taxel::sensor::Element::Piezoelectric(element) => element.cover.thickness,
        _ => 0.0,
    };
    // In steps of the readings' last digit, so that the table says it exactly.
    let finest = 1e-10 * LOADS as f64;
    (by_output.min(compression * thickness) / finest).floor() * finest
}
