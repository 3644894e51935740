mod wrong_tables;

use std::fmt::Write as _;

use super::problem::Device;
use super::*;
use crate::device_model::DeviceReadings;
use crate::driver::Calibrator;
use crate::options::CalibrateOptions;
use crate::testing::{self, no_hold_out};
use crate::{CalibrationFile, Provenance};
use taxel::estimation::{ELLIPSE_95, Localiser, ProfileFit, localiser};
use taxel::mechanics::{Base, ContactPressure, SoftCover};
use taxel::sensor::Element;
use taxel::trained::PositionMethod;
use taxel_numerics::Noise;

fn with<T>(run: impl FnOnce(&PiezoelectricCalibrator<'_>) -> T) -> T {
    on(&Sensor::shipped("piezo-1.5mm").unwrap(), run)
}

fn on<T>(sensor: &Sensor, run: impl FnOnce(&PiezoelectricCalibrator<'_>) -> T) -> T {
    let named = NamedSensor {
        name: "piezo",
        text: "",
        sensor,
    };
    run(&PiezoelectricCalibrator::new(&named).unwrap())
}

fn parse(text: &str) -> ReadingTable {
    ReadingTable::parse("bench.csv", text, &columns::WITH_ELEMENTS, "").unwrap()
}

fn quiet() -> SyntheticOptions {
    SyntheticOptions {
        noise: 0.001,
        readings: 90,
        ..SyntheticOptions::default()
    }
}

/// Number of `runs` intervals that hold each constant.
fn covered(
    runs: u64,
    readings: impl Fn(&PiezoelectricCalibrator<'_>, u64) -> String + Sync,
) -> Vec<usize> {
    with(|calibrator| {
        let truth = Device::new(calibrator.named.sensor, Drive::Displacement).drawn();
        testing::covered(runs, &truth, |seed| {
            let data = parse(&readings(calibrator, seed));
            let (table, readings) = calibrator.readings(&data, &mut Vec::new()).unwrap();
            let task = Task {
                context: &table,
                model: Model::Dynamic as usize,
                readings: &readings,
                options: &no_hold_out(),
                from: None,
            };
            calibrator.fit(&task).unwrap().fit.estimates
        })
    })
}

#[test]
fn intervals_cover_the_truth_of_a_thousand_recordings() {
    let covered = covered(1000, |calibrator, seed| {
        recording(calibrator, "displacement [um]", seed)
    });
    // 95 % of 1000 with three deviations of that count.
    assert!(
        covered.iter().all(|count| (930..=970).contains(count)),
        "{covered:?}"
    );
}

#[test]
fn intervals_cover_the_truth_of_tables_of_peaks() {
    let covered = covered(100, |calibrator, seed| {
        let text = calibrator.synthetic(&SyntheticOptions { seed, ..quiet() });
        // Steps and impacts: cyclic loads take long to solve.
        let kept = text.lines().filter(|line| !line.contains(",350,"));
        kept.collect::<Vec<_>>().join("\n")
    });
    // 95 % of 100 with three deviations of that count, 2.2 each.
    assert!(
        covered[..VISCOSITY]
            .iter()
            .all(|count| (89..=100).contains(count)),
        "{covered:?}"
    );
}

/// A recording of presses under a force or a displacement, with 0.1 % of noise.
fn recording(calibrator: &PiezoelectricCalibrator<'_>, title: &str, seed: u64) -> String {
    let drive = if title.starts_with("force") {
        Drive::Force
    } else {
        Drive::Displacement
    };
    let device = Device::new(calibrator.named.sensor, drive);
    let knots = [
        [0.0, 0.0],
        [0.1, 0.0],
        [0.101, 1.0],
        [0.5, 1.0],
        [0.52, 0.2],
        [1.0, 0.2],
    ];
    let largest = if drive == Drive::Force { 0.1 } else { 100e-6 };
    let times: Vec<f64> = (0..200)
        .map(|i| f64::from(i) * 5e-3)
        .chain(knots.iter().map(|knot| knot[0] + 2.5e-4))
        .chain([0.101])
        .collect();
    let mut times = times;
    times.sort_by(f64::total_cmp);
    times.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let [at, load]: [Vec<f64>; 2] = [0, 1].map(|k| knots.iter().map(|knot| knot[k]).collect());
    let loads = times
        .iter()
        .map(|time| largest * taxel_numerics::table::interpolate(&at, &load, *time));
    let path: Vec<[f64; 2]> = times
        .iter()
        .copied()
        .zip(loads)
        .map(|(t, x)| [t, x])
        .collect();
    let readings: Vec<Reading> = times
        .iter()
        .map(|time| Reading {
            line: 0,
            load: 0.0,
            voltage: 0.0,
            deviation: None,
            marked: false,
            what: problem::What::Sample(*time),
        })
        .collect();
    let drawn = device.drawn();
    let table = Table {
        path: path.clone(),
        ..Table::new(device)
    };
    let voltages = table.voltages(&readings, &drawn).unwrap();
    let most = voltages.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let mut noise = Noise::seeded(seed);
    let mut text = format!("time [s],{title},voltage [mV]\n");
    for ([time, load], voltage) in path.iter().zip(&voltages) {
        let read = (voltage + 1e-3 * most * noise.normal()) * 1e3;
        let load = load * if drive == Drive::Force { 1e3 } else { 1e6 };
        let _ = writeln!(text, "{time:?},{load:?},{read:?}");
    }
    text
}

/// The clock check holds here, too, though charge leaks.
#[test]
fn a_recording_of_two_clocks_is_refused() {
    with(|calibrator| {
        for title in ["displacement [um]", "force_z [mN]"] {
            let text = recording(calibrator, title, 1);
            let lines: Vec<&str> = text.lines().collect();
            let cells: Vec<[&str; 2]> = lines[1..]
                .iter()
                .map(|line| line.rsplit_once(',').map(|(a, b)| [a, b]).unwrap())
                .collect();
            let rows = cells.len();
            for (rows_later, side) in [(6, "after"), (rows - 6, "before")] {
                let late = (0..rows).map(|row| {
                    let voltage = cells[(row + rows - rows_later) % rows][1];
                    format!("{},{voltage}", cells[row][0])
                });
                let late: Vec<String> = late.collect();
                let text = format!("{}\n{}\n", lines[0], late.join("\n"));
                let error = calibrator.calibrate(&parse(&text), &no_hold_out());
                let error = error.unwrap_err().to_string();
                assert!(error.contains("clocks differ"), "{title}: {error}");
                assert!(error.contains(side), "{title}: {error}");
            }
            assert!(calibrator.calibrate(&parse(&text), &no_hold_out()).is_ok());
        }
    });
}

#[test]
fn a_recording_gives_the_same_constants() {
    with(|calibrator| {
        let truth = Device::new(calibrator.named.sensor, Drive::Displacement).drawn();
        for title in ["displacement [um]", "force_z [mN]"] {
            let text = recording(calibrator, title, 3);
            let outcome = calibrator
                .calibrate(&parse(&text), &CalibrateOptions::default())
                .unwrap();
            for (place, (parameter, estimate)) in outcome.parameters.iter().enumerate() {
                // Four deviations: one in 16 000 lies farther.
                let off = (estimate.value - truth[place]).abs();
                assert!(
                    off <= 4.0 * estimate.deviation,
                    "{title} {}: {estimate:?}",
                    parameter.name
                );
                let fixed = title.starts_with("force") && place == VISCOSITY;
                let wanted = if fixed {
                    Status::Fixed
                } else {
                    Status::Identified
                };
                assert_eq!(estimate.status, wanted, "{title} {}", parameter.name);
            }
        }
    });
}

/// Slopes of a table without noise, for ramps of 10 ms, 200 ms and 350 ms.
#[test]
fn slopes_have_the_published_ratios() {
    with(|calibrator| {
        let mut text = String::from(
            "displacement [um],ramp [ms],dwell [ms],period [ms],cycles,a1 [mV],a2 [mV]\n",
        );
        let drawn = calibrator.synthetic(&SyntheticOptions {
            noise: 0.0,
            readings: 90,
            ..SyntheticOptions::default()
        });
        for line in drawn.lines().filter(|line| line.contains(",10,")) {
            let (_, row) = line.split_once(',').unwrap();
            let _ = writeln!(text, "{row}");
        }
        let outcome = calibrator.calibrate(&parse(&text), &no_hold_out()).unwrap();
        let slope = |name: &str| {
            let of = outcome.derived.iter().find(|d| d.name.starts_with(name));
            of.unwrap().value
        };
        // P3 table 2 gives 1.553 and 1.303; 1.555 and 1.304 are the
        // model's at 0.242 s.
        for (name, printed) in [("slope_impact", 1.555), ("slope_cyclic", 1.304)] {
            let ratio = slope(name) / slope("slope_step");
            assert!((ratio - printed).abs() < 2e-3, "{name}: {ratio}");
        }
        let constant = outcome
            .derived
            .iter()
            .find(|d| d.name == "leak_time_constant");
        assert!((constant.unwrap().value - 0.2415).abs() < 1e-4);
    });
}

#[test]
fn peaks_leave_the_viscosity_as_drawn() {
    with(|calibrator| {
        let outcome = calibrator
            .calibrate(&parse(&calibrator.synthetic(&quiet())), &no_hold_out())
            .unwrap();
        let statuses = outcome.parameters.iter().map(|(_, e)| e.status);
        let wanted = [Status::Identified, Status::Identified, Status::Fixed];
        assert!(statuses.eq(wanted));
        assert!(outcome.open.is_empty(), "{:?}", outcome.open);
    });
}

#[test]
fn readings_that_cannot_be_are_named() {
    with(|calibrator| {
        let text = calibrator.synthetic(&quiet());
        let few: Vec<&str> = text.lines().take(8).collect();
        for (text, message) in [
            (
                text.replace("a1 [mV],a2 [mV]", "a1 [V],a2 [V]"),
                "1000 times",
            ),
            (
                text.replace("displacement [um]", "displacement [nm]"),
                "1000 times",
            ),
            (
                text.replace("displacement [um]", "force_z [mN]")
                    .replace("time [s]", "displacement [um]"),
                "both there",
            ),
            (
                text.replace("displacement [um]", "other"),
                "neither displacement nor",
            ),
            (text.replace("ramp [ms]", "other"), "no ramp above zero"),
            (text.replace("a1 [mV]", "a1"), "no unit"),
            (text.replace("a1 [mV]", "other"), "neither a voltage"),
            (few.join("\n"), "at least 8"),
        ] {
            let found = ReadingTable::parse("bench.csv", &text, &columns::WITH_ELEMENTS, "")
                .and_then(|data| calibrator.calibrate(&data, &no_hold_out()));
            let error = found.unwrap_err().to_string();
            assert!(error.contains(message), "{message}: {error}");
        }
    });
}

#[test]
fn a_calibration_file_puts_the_constants_into_the_sensor() {
    with(|calibrator| {
        let outcome = calibrator
            .calibrate(
                &parse(&calibrator.synthetic(&quiet())),
                &CalibrateOptions::default(),
            )
            .unwrap();
        assert!(outcome.models[0].hold_out.unwrap() < 0.002);
        let file = testing::file(&outcome);
        let calibrated = file.apply("calibration.toml", calibrator.named).unwrap();
        let found: Vec<f64> = outcome.parameters.iter().map(|(_, e)| e.value).collect();
        assert_eq!(
            Device::new(&calibrated, Drive::Force).drawn().to_vec(),
            found
        );
        let model = calibrated.piezoelectric().unwrap().model();
        let drawn = calibrator.named.sensor.piezoelectric().unwrap().model();
        assert!((model.high_pass / drawn.high_pass - found[LEAK] / 276e6).abs() < 1e-12);
    });
}

/// Presses of probes 1 mm apart at a signal of 100 deviations.
fn presses(radii: &[f64], seed: u64) -> IndentationOptions {
    IndentationOptions {
        seed,
        radii: radii.to_vec(),
        grid: 1e-3,
        noise: 0.01,
    }
}

fn pressed(radii: &[f64], seed: u64) -> String {
    with(|calibrator| {
        calibrator
            .synthetic_indentations(&presses(radii, seed))
            .unwrap()
    })
}

fn held_out(outcome: &Outcome, name: &str) -> f64 {
    let of = outcome.hold_out.iter().find(|one| one.name == name);
    of.unwrap_or_else(|| panic!("{name}: {:?}", outcome.hold_out))
        .root_mean_square
}

#[test]
fn a_probe_that_was_trained_is_placed_within_a_tenth_of_a_millimetre() {
    with(|calibrator| {
        let data = parse(&pressed(&[3.6e-3], 1));
        let outcome = calibrator.calibrate(&data, &no_hold_out()).unwrap();
        let of = |finder: &str| held_out(&outcome, &format!("place.{finder}.radius_3.60mm"));
        // The specification's own simulation has 0.11 mm for a grid of 1 mm;
        // four fifths of it are left where a fifth is held out. One press in a
        // hundred is taken for foreign and placed by the profile.
        let learned = of("kernel_or_profile");
        assert!(learned < 0.12e-3, "{:?}", outcome.hold_out);
        let models = of("profile").min(of("centroid"));
        assert!(learned < 0.5 * models, "{:?}", outcome.hold_out);
        let map = outcome.places.as_ref().unwrap();
        assert!(matches!(
            map.finder,
            PositionMethod::Kernel | PositionMethod::KernelOrProfile
        ));
        // Nothing was said of the constants, which stay as drawn.
        let drawn = Device::new(calibrator.named.sensor, Drive::Force).drawn();
        for ((_, estimate), drawn) in outcome.parameters.iter().zip(drawn) {
            assert_eq!((estimate.value, estimate.status), (drawn, Status::Fixed));
        }
    });
}

#[test]
fn gains_come_back_and_a_probe_of_another_size_is_placed_too() {
    // Under 1.11 mm of silicone, as in the specification, and under the
    // 0.75 mm of the shipped drawing. With exact gains and the true noise the
    // best that forces determine without the radius is 0.34 mm at both.
    for (share_above, least) in [(0.74, 0.35e-3), (0.5, 0.45e-3)] {
        let mut sensor = Sensor::shipped("piezo-1.5mm").unwrap();
        if let Element::Piezoelectric(element) = &mut sensor.element {
            element.cover.share_above = share_above;
        }
        on(&sensor, |calibrator| places_between(calibrator, least));
    }
}

fn places_between(calibrator: &PiezoelectricCalibrator<'_>, least: f64) {
    let text = calibrator.synthetic_indentations(&presses(&[1.5e-3, 2.9e-3, 5e-3], 2));
    let data = parse(&text.unwrap());
    let outcome = calibrator.calibrate(&data, &no_hold_out()).unwrap();
    let map = outcome.places.as_ref().unwrap();
    let sensor = calibrator.named.sensor;
    let made = sensor.piezoelectric().unwrap().description.fabricate(8);
    let mean = made.iter().sum::<f64>() / 8.0;
    for (found, made) in map.gains.iter().zip(made) {
        // Some 195 presses with 1 % of noise, about ten over each element.
        assert!((found - made / mean).abs() < 0.005, "{map:?}");
    }
    // Probes of sizes between those, at places anywhere over the elements.
    let profile = ProfileFit::new(calibrator.profile.clone()).unwrap();
    let localiser = localiser(map, profile).unwrap();
    let of = |radius: f64| off(calibrator, &*localiser, &map.gains, radius);
    let found = [2.3e-3, 3.6e-3].map(of);
    let learned = (found.iter().map(|[square, _]| square).sum::<f64>() / 2.0).sqrt();
    // The specification's own simulation has 0.38 to 0.75 mm.
    assert!(learned < least, "{learned} {:?}", map.finder);
    for [_, inside] in found {
        // The goal is 93 %, of 300 places within 1.5 %: two deviations.
        assert!(inside > 0.90, "{inside} {}", map.profile_spread);
    }
}

/// Mean square error, m², of places of a probe by forces over `gains`, and the
/// share of them within their ellipses of 95 %.
fn off(
    calibrator: &PiezoelectricCalibrator<'_>,
    localiser: &dyn Localiser,
    gains: &[f64],
    radius: f64,
) -> [f64; 2] {
    let model = &calibrator.profile;
    let table = SoftCover {
        thickness: model.thickness,
        base: Base::Rigid,
        contact: ContactPressure::Hertz(radius),
    }
    .table();
    let sensor = calibrator.named.sensor.piezoelectric().unwrap();
    let made = sensor.description.fabricate(8);
    let mut noise = Noise::seeded(17);
    let (mut found, mut squares, mut inside) = (0.0, 0.0, 0.0);
    for trial in 0..300 {
        let part = |step: f64| (f64::from(trial) * step).fract() - 0.5;
        let place = [12e-3 * part(0.754_877_67), 4e-3 * part(0.569_840_29)];
        let positions = model.centroid().positions;
        let offset = |at: &[f64; 2]| [at[0] - place[0], at[1] - place[1]];
        let shares: Vec<f64> = positions
            .iter()
            .zip(&made)
            .map(|(at, gain)| gain * table.share(offset(at), model.side))
            .collect();
        let sigma = 0.01 * shares.iter().copied().fold(0.0, f64::max);
        let forces: Vec<f64> = shares
            .iter()
            .zip(gains)
            .map(|(share, gain)| (share + sigma * noise.normal()) / gain)
            .collect();
        if let Some(at) = localiser.position(&forces, &[sigma; 8]) {
            found += 1.0;
            squares += (at.centre[0] - place[0]).powi(2) + (at.centre[1] - place[1]).powi(2);
            inside += f64::from(u8::from(at.distance(place) < ELLIPSE_95));
        }
    }
    // The wider deviations leave some positions unknown.
    assert!(found > 240.0, "{found}");
    [squares / found, inside / found]
}

#[test]
fn both_tables_make_one_calibration_that_live_touch_uses() {
    with(|calibrator| {
        let tables = [
            parse(&calibrator.synthetic(&quiet())),
            parse(&pressed(&[2.5e-3], 3)),
        ];
        let outcome = calibrator.calibrate_all(&tables, &no_hold_out()).unwrap();
        assert_eq!(outcome.parameters[GAIN].1.status, Status::Identified);
        let about = Provenance {
            version: "0",
            date: "2000-01-01",
            data: "bench.csv, presses.csv",
            data_hash: "00",
        };
        let text = outcome.to_toml(&about);
        let file = CalibrationFile::parse("calibration.toml", &text).unwrap();
        let sensor = file.apply("calibration.toml", calibrator.named).unwrap();
        let model = sensor.piezoelectric().unwrap().model();
        assert_eq!(model.gains, file.places.as_ref().unwrap().gains);
        let same = [tables[0].clone(), tables[0].clone()];
        let twice = calibrator.calibrate_all(&same, &no_hold_out());
        assert!(twice.unwrap_err().to_string().contains("same kind"));
        for (from, to, message) in [
            ("finder = \"", "finder = \"x", "is not known here"),
            ("gain_deviation = ", "gain_deviation = -", "gain_deviation"),
            ("kernel = [", "kernel = [0.0, ", "kernel"),
            (
                "\nvalue = ",
                "\nvalue = 9",
                "the interval of this parameter",
            ),
            (
                "\nvalue = ",
                "\nvalue = nan # ",
                "the interval of this parameter",
            ),
            (
                "\ninterval = [",
                "\ninterval = [-1e300, 1e300] # [",
                "-1e30 to 1e30",
            ),
            ("\ndeviation = ", "\ndeviation = -", "0 or more"),
        ] {
            let wrong = CalibrationFile::parse("c.toml", &text.replacen(from, to, 1));
            let error = wrong.unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    });
}

#[test]
fn presses_that_cannot_be_are_named() {
    with(|calibrator| {
        let text = pressed(&[3.6e-3], 1);
        let few: Vec<&str> = text.lines().take(25).collect();
        // One line of each of two probes: y is the third field.
        let two = pressed(&[1e-3, 2e-3], 1);
        let on_a_line = |line: &&str| {
            let y = line.split(',').nth(2).unwrap_or("");
            line.starts_with("press") || y == "-2.0000"
        };
        let along: String = two.lines().filter(on_a_line).collect::<Vec<_>>().join("\n");
        for (text, message) in [
            (text.replace("x [mm]", "x [cm]"), "outside the array"),
            (
                text.replace("voltage_3 [mV]", "other"),
                "voltage_3 is missing",
            ),
            (
                text.replace("voltage_", "other_"),
                "no signal of an element",
            ),
            (
                text.replace(",-0.", ",0.")
                    .replace("voltage_deviation [mV]", "other [mV]")
                    .replace("[mV]", "[nV]"),
                "no positive signal",
            ),
            (few.join("\n"), "must be from 20"),
            (along, "along y"),
        ] {
            let found = ReadingTable::parse("presses.csv", &text, &columns::WITH_ELEMENTS, "")
                .and_then(|data| calibrator.calibrate(&data, &no_hold_out()));
            let error = found.map(|_| ()).unwrap_err().to_string();
            assert!(error.contains(message), "{message}: {error}");
        }
    });
}
