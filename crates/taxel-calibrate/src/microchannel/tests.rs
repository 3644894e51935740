use std::fmt::Write as _;

use super::*;
use crate::device_model::DeviceReadings;
use crate::driver::Calibrator;
use crate::outcome::Outcome;
use crate::readings::ReadingTable;
use crate::split::by_series;
use crate::testing;
use crate::testing::{covered, lost, lost_on_bench, no_hold_out, slopes_and_differences};
use problem::Load;
use taxel::estimation::{
    ArrayEstimator, MicrochannelOptions, MicrochannelReader, MicrochannelState,
};
use taxel_numerics::least_squares::Status;
use taxel_recording::Frame;

const NAME: &str = "liquid-metal-2x4";
/// Leads, stiffnesses, expansion and bias of a device that is not as drawn.
const TRUTH: [f64; SHARED] = [0.3, 1.3, 0.8, 0.25, 0.0];
/// Its resistances at rest, rows first, Ω.
const RESTS: [f64; 6] = [3.5, 3.3, 3.4, 3.45, 3.35, 3.2];

fn drawn() -> Sensor {
    Sensor::shipped(NAME).unwrap()
}

/// A device whose channels all have the resistance `rest`.
fn made(rest: f64) -> Sensor {
    let mut sensor = drawn();
    let value = |name: &str| {
        let shared = NAMES.iter().position(|known| *known == name);
        Some(shared.map_or(rest, |place| TRUTH[place]))
    };
    apply(&mut sensor, &value).unwrap();
    sensor
}

fn with<T>(sensor: &Sensor, run: impl Fn(&MicrochannelCalibrator<'_>) -> T) -> T {
    let named = [NamedSensor {
        name: NAME,
        text: "",
        sensor,
    }];
    run(&MicrochannelCalibrator::new(&named).unwrap())
}

/// Readings of a bench with `RESTS`; the channels in `wanted` alone.
fn bench(options: &SyntheticOptions, wanted: &[usize]) -> String {
    let mut text = String::from("time [s],channel,pressure [kPa],voltage [mV]\n");
    for channel in wanted {
        let all = with(&made(RESTS[*channel]), |truth| truth.synthetic(options));
        let of = |line: &&str| line.split(',').nth(1) == Some(channel.to_string().as_str());
        for line in all.lines().filter(of) {
            text.push_str(line);
            text.push('\n');
        }
    }
    text
}

fn parse(calibrator: &MicrochannelCalibrator<'_>, text: &str) -> ReadingTable {
    ReadingTable::parse("bench.csv", text, calibrator.columns(), calibrator.group()).unwrap()
}

/// The readings of loading of all channels, one after the other.
fn loading(calibrator: &MicrochannelCalibrator<'_>, all: &[Reading]) -> Vec<Reading> {
    let of = |of: &Vec<Reading>| calibrator.loading(&Vec::new(), of, &mut Vec::new());
    by_series(all).iter().flat_map(of).collect()
}

fn quiet() -> SyntheticOptions {
    SyntheticOptions {
        noise: 1e-4,
        compression: 0.39,
        readings: 60,
        ..SyntheticOptions::default()
    }
}

const ALL: [usize; 6] = [0, 1, 2, 3, 4, 5];

#[test]
fn slopes_are_those_of_differences() {
    with(&drawn(), |calibrator| {
        let mut at = calibrator.drawn();
        at[LEAD] = 0.4;
        at[BIAS] = 0.003;
        let reading = |channel: usize, load: Load, share: f64| Reading {
            channel,
            layer: calibrator.layer_of(channel),
            load,
            share,
            signal: 0.6,
            deviation: Some(1.0),
            saturated: false,
            marked: false,
        };
        let readings = [
            reading(0, Load::Pressure(3e3), 1.0),
            reading(1, Load::Force(0.02, 1e-6), 0.3),
            reading(4, Load::Force(0.012, 1e-6), 1.0),
            reading(5, Load::Pressure(0.0), 1.0),
        ];
        let parameters = calibrator.parameters(&calibrator.all, &readings, &at);
        let problem = calibrator.bench_of(&calibrator.all, &readings);
        let steps: Vec<f64> = at.iter().map(|at| 1e-5 * at).collect();
        let columns = slopes_and_differences(&problem, &parameters, &at, &steps);
        for (j, [column, differences]) in columns.iter().enumerate() {
            for (slope, difference) in column.iter().zip(differences) {
                // Differences over 2e-5 of smooth curves.
                let size = slope.abs().max(1e-6);
                assert!(
                    (slope - difference).abs() < 1e-5 * size,
                    "{j}: {slope} {difference}"
                );
            }
        }
    });
}

/// Channels of the columns, which are read at the same pressures.
const COLUMNS_READ: [usize; 4] = [2, 3, 4, 5];

/// The table of these channels side by side, each row `times` times in a row.
fn wide(text: &str, times: usize) -> String {
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let of = |channel: usize| {
        let rows = rows.iter().skip(1);
        rows.filter(move |row| row[1] == channel.to_string())
    };
    let mut text = String::from("time [s],pressure [kPa]");
    for channel in COLUMNS_READ {
        let _ = write!(text, ",voltage_{channel} [mV]");
    }
    for (index, row) in of(COLUMNS_READ[0]).enumerate() {
        for again in 0..times {
            let time: f64 = row[0].parse().unwrap();
            let _ = write!(text, "\n{},{}", time + 1e-4 * again as f64, row[2]);
            for channel in COLUMNS_READ {
                let _ = write!(text, ",{}", of(channel).nth(index).unwrap()[3]);
            }
        }
    }
    text + "\n"
}

#[test]
fn voltages_side_by_side_at_ten_kilohertz_are_fitted_by_their_means() {
    let text = bench(&quiet(), &COLUMNS_READ);
    let sensor = drawn();
    let [long, wide] = [text.clone(), wide(&text, 24)].map(|text| {
        with(&sensor, |calibrator| {
            calibrator.calibrate(&parse(calibrator, &text), &CalibrateOptions::default())
        })
        .unwrap()
    });
    let said = |outcome: &Outcome| {
        let remarks = outcome.remarks.iter();
        remarks
            .filter(|remark| remark.message.contains("their mean is fitted"))
            .count()
    };
    assert_eq!((said(&long), said(&wide)), (0, 1));
    // Means of readings that are alike: the same fit, to what a search leaves.
    for ((parameter, long), (_, wide)) in long.parameters.iter().zip(&wide.parameters) {
        let apart = (long.value - wide.value).abs();
        assert!(
            apart <= 0.01 * long.deviation,
            "{}: {long:?} {wide:?}",
            parameter.name
        );
    }
}

/// A curve as the paper prints one: one row, pressed by a pin far beyond the pressures at which
/// the drawing closes.
#[test]
fn a_curve_that_goes_far_beyond_the_drawing_is_kept_for_the_fit() {
    let mut text = String::from("time [s],channel,force_z [mN],area [mm2],voltage [mV]\n");
    for step in 0..41 {
        let force = 20.0 + 4.0 * f64::from(step);
        let resistance = 3.378 * (1.0 + 0.6 * (force - 20.0) / 160.0);
        let voltage = 2000.0 * resistance / (resistance + 10.0);
        let _ = writeln!(
            text,
            "{},0,{force},0.19635,{voltage:.3}",
            0.1 * f64::from(step)
        );
    }
    let outcome = with(&drawn(), |calibrator| {
        calibrator.calibrate(&parse(calibrator, &text), &CalibrateOptions::default())
    })
    .unwrap();
    // The layer that was not read stays as drawn.
    let unread = &outcome.parameters[STIFFNESS[1]].1;
    assert!((unread.value - 1.0).abs() < 1e-12, "{unread:?}");
    let kept = outcome.residuals[0].count;
    assert!(kept >= 30, "{kept} of 41");
    let mut remarks = outcome.remarks.iter();
    assert_eq!(
        kept < 41,
        remarks.any(|remark| remark
            .message
            .contains("beyond the end of the closing curves"))
    );
}

#[test]
fn a_device_comes_back_and_live_touch_inverts_it() {
    let text = bench(&quiet(), &ALL);
    let sensor = drawn();
    let outcome = with(&sensor, |calibrator| {
        calibrator.calibrate(&parse(calibrator, &text), &CalibrateOptions::default())
    })
    .unwrap();
    let truth = TRUTH.iter().chain(&RESTS);
    for ((parameter, estimate), truth) in outcome.parameters.iter().zip(truth) {
        // Four deviations: the chance of a miss is 1 in 16 000 for each.
        assert!(
            (estimate.value - truth).abs() <= 4.0 * estimate.deviation,
            "{}: {estimate:?} for {truth}",
            parameter.name
        );
    }
    assert!(outcome.open.is_empty(), "{:?}", outcome.open);
    // No channel saturates; that is said, with what is known.
    for (parameter, estimate) in &outcome.parameters[TRUTH.len() + RESTS.len()..] {
        assert!(parameter.name.ends_with("saturation_voltage"));
        assert_eq!(estimate.status, Status::NotIdentifiable);
        let [most, supply] = estimate.interval;
        let number = parameter.name.split(['_', '.']).nth(1);
        let volts = text.lines().filter(|line| line.split(',').nth(1) == number);
        let volts = volts.map(|line| line.split(',').nth(3).unwrap().parse::<f64>().unwrap());
        let read = volts.fold(0.0, f64::max) * 1e-3;
        assert!(
            (most - read).abs() < 1e-9 && supply == 2.0,
            "{estimate:?} {read}"
        );
    }
    let said = outcome.remarks.iter().map(ToString::to_string);
    let said = said.filter(|remark| remark.contains("saturation was not reached and is at least"));
    let said: Vec<String> = said.collect();
    assert_eq!(said.len(), 1);
    assert_eq!(said[0].matches("channel_").count(), RESTS.len());
    assert!(outcome.models[0].hold_out.unwrap() < 2e-4);
    let found = testing::calibrated(&outcome, &sensor);
    let model = found.microchannels().unwrap().calibration().unwrap();
    let rests = model.rows.iter().chain(&model.columns);
    for (channel, rest) in rests.zip(RESTS) {
        assert!((channel.rest_resistance / rest - 1.0).abs() < 0.01);
    }
    // The curves that are inverted live are those of the device.
    let truth = made(RESTS[0])
        .microchannels()
        .unwrap()
        .calibration()
        .unwrap();
    let before = sensor.microchannels().unwrap().calibration().unwrap();
    let slope = |of: &[MicrochannelModel]| of[0].pressure.start_slope();
    for (found, truth, before) in [
        (&model.rows, &truth.rows, &before.rows),
        (&model.columns, &truth.columns, &before.columns),
    ] {
        assert!((slope(found) / slope(truth) - 1.0).abs() < 0.02);
        assert!((slope(before) / slope(truth) - 1.0).abs() > 0.02);
    }
}

#[test]
fn a_force_bias_is_found_and_subtracted() {
    let text = bench(&quiet(), &[0, 2]);
    let mut forces = String::from("time [s],channel,force_z [mN],area [mm2],voltage [mV]\n");
    for line in text.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let force = fields[2].parse::<f64>().unwrap() + 5.0;
        writeln!(
            forces,
            "{},{},{force},1,{}",
            fields[0], fields[1], fields[3]
        )
        .unwrap();
    }
    with(&drawn(), |calibrator| {
        let outcome = calibrator
            .calibrate(&parse(calibrator, &forces), &no_hold_out())
            .unwrap();
        let (_, bias) = &outcome.parameters[BIAS];
        assert!(
            (bias.value - 5e-3).abs() <= 4.0 * bias.deviation,
            "{bias:?}"
        );
        assert_eq!(bias.status, Status::Identified);
    });
}

#[test]
fn intervals_cover_the_truth_of_a_thousand_benches() {
    let (row, column) = (RESTS[0], RESTS[2]);
    let sensor = drawn();
    let clean = SyntheticOptions {
        noise: 0.0,
        cycles: 1,
        readings: 36,
        ..quiet()
    };
    let text = bench(&clean, &[0, 2]);
    with(&sensor, |calibrator| {
        let data = parse(calibrator, &text);
        let all = calibrator.checked(&data, &mut Vec::new()).unwrap();
        let exact = loading(calibrator, &all);
        let truth: Vec<f64> = TRUTH.into_iter().chain([row, column]).collect();
        let starts = [truth.iter().map(|x| 1.02 * x).collect::<Vec<f64>>()];
        let covered = covered(1000, &truth, |seed| {
            let mut noise = taxel_numerics::Noise::seeded(seed);
            let mut readings = exact.clone();
            for reading in &mut readings {
                reading.signal += 2e-5 * noise.normal();
            }
            let found = calibrator
                .fit_from(&readings, &no_hold_out(), &starts)
                .unwrap();
            found.fit.estimates
        });
        for j in (0..truth.len()).filter(|j| *j != BIAS) {
            // 95 % of 1000 with three deviations of that count.
            assert!((930..=970).contains(&covered[j]), "{j}: {covered:?}");
        }
    });
}

#[test]
fn readings_that_cannot_be_are_named() {
    let text = bench(&quiet(), &[0, 2]);
    with(&drawn(), |calibrator| {
        let of = |text: &str| {
            let data = parse(calibrator, text);
            calibrator
                .calibrate(&data, &no_hold_out())
                .unwrap_err()
                .to_string()
        };
        let few: Vec<&str> = text.lines().take(5).collect();
        for (text, message) in [
            (few.join("\n"), "at least 6"),
            (text.replace("[mV]", "[V]"), "0 and the supply"),
            (text.replace("[mV]", "[uV]"), "at rest"),
            (text.replace("[kPa]", "[MPa]"), "units of pressure"),
            (
                text.replace("pressure [kPa]", "force_z [mN]"),
                "with its area",
            ),
            (text.replace("voltage [mV]", "other"), "neither voltage"),
            (text.replace(",0,", ",9,"), "no channel 9"),
        ] {
            let error = of(&text);
            assert!(error.contains(message), "{message}: {error}");
        }
    });
}

/// The sensor after the calibration from these readings.
fn calibrated(text: &str) -> (Outcome, Sensor) {
    let sensor = drawn();
    let outcome = with(&sensor, |calibrator| {
        calibrator.calibrate(&parse(calibrator, text), &no_hold_out())
    })
    .unwrap();
    let found = testing::calibrated(&outcome, &sensor);
    (outcome, found)
}

/// State of channel 0 at these changes of its resistance, one after the other;
/// the other channels are at rest.
fn states_at(sensor: &Sensor, changes: &[f64]) -> Vec<MicrochannelState> {
    let model = sensor.microchannels().unwrap().calibration().unwrap();
    let scale = model.scale.clone();
    let counts = |resistance: f64| scale.numbers.number(scale.signal.of(resistance));
    let rest: Vec<f64> = model
        .rows
        .iter()
        .chain(&model.columns)
        .map(|c| c.rest_resistance)
        .collect();
    let reader = MicrochannelReader::new(model, MicrochannelOptions::default());
    let mut estimator = ArrayEstimator::new(Box::new(reader));
    let mut states = Vec::new();
    for (index, change) in changes.iter().enumerate() {
        let mut values: Vec<f64> = rest.iter().map(|rest| counts(*rest)).collect();
        values[0] = counts(rest[0] * (1.0 + change));
        let frame = Frame {
            sequence: index as u64,
            time_ns: index as u64 * 1_000_000,
            values,
            ..Frame::default()
        };
        estimator.push(&frame).unwrap();
        let reader: &MicrochannelReader = estimator.reader().unwrap();
        states.push(reader.loads()[0].state);
    }
    states
}

#[test]
fn a_saturation_that_was_reached_is_fitted_and_estimated() {
    let saturating = SyntheticOptions {
        saturation: 0.8,
        noise: 1e-3,
        readings: 120,
        cycles: 1,
        ..quiet()
    };
    let (outcome, sensor) = calibrated(&bench(&saturating, &[0, 2]));
    let of = |name: &str| {
        let found = outcome.parameters.iter().find(|(p, _)| p.name == name);
        found.unwrap().1
    };
    // The same data without noise and saturation show where 80 % are.
    let exact = bench(
        &SyntheticOptions {
            noise: 0.0,
            saturation: 1.0,
            ..saturating
        },
        &[0, 2],
    );
    for channel in [0, 2] {
        let volts: Vec<f64> = exact
            .lines()
            .filter(|line| line.split(',').nth(1) == Some(channel.to_string().as_str()))
            .map(|line| line.split(',').nth(3).unwrap().parse::<f64>().unwrap() * 1e-3)
            .collect();
        let [low, high] = [
            volts.iter().copied().fold(f64::INFINITY, f64::min),
            volts.iter().copied().fold(0.0, f64::max),
        ];
        let plateau = low + 0.8 * (high - low);
        let found = of(&format!("channel_{channel}.saturation_voltage"));
        assert_eq!(found.status, Status::Identified);
        // Four deviations: 1 in 16 000 lies farther.
        assert!(
            (found.value - plateau).abs() < 4.0 * found.deviation,
            "{found:?} {plateau}"
        );
        // 0.1 % of the change over ten readings and more.
        assert!(found.deviation < 1e-3 * (high - low));
    }
    // The constants are those of the readings below it.
    let (stiffness, truth) = (of("row.stiffness"), TRUTH[STIFFNESS[0]]);
    assert!(
        (stiffness.value - truth).abs() < 4.0 * stiffness.deviation,
        "{stiffness:?}"
    );
    let model = sensor.microchannels().unwrap().calibration().unwrap();
    let (row, scale) = (&model.rows[0], &model.scale);
    let change = |voltage: f64| scale.resistance(voltage) / row.rest_resistance - 1.0;
    // The bench pressed the whole channel: one taxel cannot close it so far.
    let states = states_at(
        &sensor,
        &[0.5 * row.pressure.end()[0], change(1.001 * row.saturation)],
    );
    let MicrochannelState::Pressed { pressure, .. } = states[0] else {
        panic!("{states:?}");
    };
    let MicrochannelState::Saturated { at_least } = states[1] else {
        panic!("{states:?}");
    };
    assert!(at_least > pressure && at_least == row.highest_pressure());
    // A channel that saturates on the way says no more than where.
    let resistance = row.rest_resistance * (1.0 + 0.5 * row.pressure.end()[0]);
    let early = MicrochannelModel {
        saturation: scale.signal.of(resistance),
        ..row.clone()
    };
    assert!((early.saturated_pressure(scale) / pressure - 1.0).abs() < 0.01);
}

#[test]
fn a_loop_is_found_and_undone_live() {
    let looping = SyntheticOptions {
        hysteresis: 0.1,
        noise: 2e-4,
        readings: 160,
        cycles: 2,
        compression: 0.37,
        ..quiet()
    };
    let (outcome, sensor) = calibrated(&bench(&looping, &ALL));
    let said: Vec<String> = outcome.remarks.iter().map(ToString::to_string).collect();
    assert!(
        said.iter()
            .any(|remark| remark.contains("hysteresis: without it the pressure")),
        "{said:?}"
    );
    let model = sensor.microchannels().unwrap().calibration().unwrap();
    let end = model.rows[0].pressure.end()[0];
    let up: Vec<f64> = (1..=60).map(|i| 0.016 * end * f64::from(i)).collect();
    let down: Vec<f64> = up.iter().rev().copied().collect();
    let pressures: Vec<f64> = states_at(&sensor, &[up, down].concat())
        .into_iter()
        .map(|state| match state {
            MicrochannelState::Pressed { pressure, .. } => pressure,
            MicrochannelState::Quiet => 0.0,
            other => panic!("{other:?}"),
        })
        .collect();
    // All of it is lost wherever the load turned long ago; a tenth of the loop is
    // left to the noise.
    for place in 15..35 {
        let ratio = pressures[119 - place] / pressures[place];
        assert!((ratio - 1.0 / 1.1).abs() < 0.01, "{place}: {ratio}");
    }
    let (outcome, _) = calibrated(&bench(
        &SyntheticOptions {
            hysteresis: 0.0,
            ..looping
        },
        &[0, 2],
    ));
    assert!(
        outcome
            .parameters
            .iter()
            .all(|(p, _)| !p.name.contains("hysteresis"))
    );
}

/// With saturation the bench alone says how far a load went before it came back;
/// taken for a turn at the plateau, its loop would be one narrow play.
#[test]
fn intervals_cover_the_truth_of_benches_with_hysteresis_and_saturation() {
    let (hysteresis, wanted) = (0.1, [0, 2]);
    let rests = wanted.map(|channel| RESTS[channel]);
    let start = [&TRUTH[..], &rests].concat();
    let truth = [start.clone(), lost_on_bench(hysteresis)].concat();
    let sensor = drawn();
    for saturation in [1.0, 0.8] {
        let clean = SyntheticOptions {
            hysteresis,
            saturation,
            noise: 0.0,
            readings: 120,
            compression: 0.37,
            ..quiet()
        };
        let text = bench(&clean, &wanted);
        let covered = with(&sensor, |calibrator| {
            let data = parse(calibrator, &text);
            let exact = calibrator.checked(&data, &mut Vec::new()).unwrap();
            covered(200, &truth, |seed| {
                let mut noise = taxel_numerics::Noise::seeded(seed);
                let mut all = exact.clone();
                for reading in &mut all {
                    reading.signal += 1e-4 * noise.normal();
                }
                let plateaus = calibrator.plateaus(&mut all);
                let reached = wanted.map(|channel| plateaus[channel].is_some());
                assert_eq!(reached, [saturation < 1.0; 2], "{seed}");
                let kept = loading(calibrator, &all);
                let starts = [start.clone()];
                let fitted = calibrator.fit_from(&kept, &no_hold_out(), &starts).unwrap();
                let series = by_series(&all);
                let held: Vec<_> = series.iter().map(|of| vec![false; of.len()]).collect();
                let loops = calibrator.loops(&fitted, &series, &held).unwrap();
                [fitted.fit.estimates, lost(&loops)].concat()
            })
        });
        for (j, count) in covered.iter().enumerate().filter(|(j, _)| *j != BIAS) {
            // 95 % of 200 with three deviations of that count; weights have a
            // prior and a bound at none, and more of theirs may be covered.
            let most = if j < start.len() { 199 } else { 200 };
            assert!(
                (181..=most).contains(count),
                "{saturation} {j}: {covered:?}"
            );
        }
    }
}

/// Where loads are close to one another a curve joins its plateau little by little.
#[test]
fn plateaus_of_many_readings_are_found() {
    let sensor = drawn();
    // At the end how many deviations below a plateau a reading may be taken for one
    // of it: five of noise, and five that a plateau leaves, more where it has few
    // readings.
    for (saturation, readings, noise, below) in [
        (0.7, 600, 0.01, 10.0),
        (0.9, 600, 0.01, 10.0),
        (0.7, 120, 0.02, 14.0),
    ] {
        let clean = SyntheticOptions {
            saturation,
            readings,
            noise: 0.0,
            cycles: 3,
            ..quiet()
        };
        let text = bench(&clean, &[0]);
        with(&sensor, |calibrator| {
            let data = parse(calibrator, &text);
            let exact = calibrator.checked(&data, &mut Vec::new()).unwrap();
            let ends = |of: &[Reading]| {
                let voltages = of.iter().map(|reading| reading.signal);
                voltages.fold([f64::INFINITY, 0.0], |[low, high], v| {
                    [v.min(low), v.max(high)]
                })
            };
            let [low, high] = ends(&exact);
            let scatter = noise * (high - low);
            for seed in 0..100 {
                let mut random = taxel_numerics::Noise::seeded(seed);
                let mut all = exact.clone();
                for reading in &mut all {
                    reading.signal += scatter * random.normal();
                }
                let found = calibrator.plateaus(&mut all)[0];
                assert!(found.is_some(), "{saturation} {readings} {seed}");
                let missed = all
                    .iter()
                    .zip(&exact)
                    .filter(|(reading, exact)| !reading.saturated && exact.signal > high - 1e-9);
                let early = all.iter().zip(&exact).filter(|(reading, exact)| {
                    reading.saturated && exact.signal < high - below * scatter
                });
                assert_eq!([missed.count(), early.count()], [0, 0], "{readings} {seed}");
            }
        });
    }
}

/// A channel that reads one voltage, with noise or without, would bias what it shares with others.
#[test]
fn a_channel_that_does_not_follow_the_load_is_refused() {
    let sensor = Sensor::shipped("liquid-metal-2x4").unwrap();
    with(&sensor, |calibrator| {
        let text = calibrator.synthetic(&quiet());
        let error = |noise: f64| {
            let mut random = taxel_numerics::Noise::seeded(4);
            let of_line = |line: &str| {
                let mut fields: Vec<String> = line.split(',').map(String::from).collect();
                if fields.get(1).is_some_and(|channel| channel == "2") {
                    fields[3] = format!("{:.6}", 330.0 + noise * random.normal());
                }
                fields.join(",") + "\n"
            };
            let table = parse(calibrator, &text.lines().map(of_line).collect::<String>());
            let done = calibrator.calibrate(&table, &CalibrateOptions::default());
            done.unwrap_err().to_string()
        };
        let (still, noisy) = (error(0.0), error(0.5));
        assert!(still.contains("channel 2 reads the same in all"), "{still}");
        assert!(
            noisy.contains("channel 2 does not follow the load"),
            "{noisy}"
        );
    });
}
