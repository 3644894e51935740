//! Arrays without a physical model, from recordings to live touch, at the
//! boundary of the program.
#![allow(clippy::too_many_lines)]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::common::{Folder, done, refused};

const SENSOR: &str = "eflesh-lattice";

/// Sample recordings of five magnetometers under a lattice.
fn lattice() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../taxel-recording/tests/recordings/lattice")
}

/// The run whose files are those of the sample called `kind`, changed.
fn run(
    folder: &Folder,
    kind: &str,
    sensor: impl Fn(&str) -> String,
    stage: impl Fn(&str) -> String,
) -> String {
    fs::create_dir_all(folder.path("run")).unwrap();
    for (name, change) in [
        ("sensor", &sensor as &dyn Fn(&str) -> String),
        ("states", &stage),
    ] {
        let text = fs::read_to_string(lattice().join(format!("{kind}_{name}.csv"))).unwrap();
        fs::write(folder.path(&format!("run/{name}.csv")), change(&text)).unwrap();
    }
    folder.path("run")
}

fn same(text: &str) -> String {
    text.to_owned()
}

/// Every line through `change`, which takes its cells.
fn lines(text: &str, change: impl Fn(usize, &mut Vec<String>)) -> String {
    let mut out = String::new();
    for (number, line) in text.lines().enumerate() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        change(number, &mut cells);
        out.push_str(&cells.join(","));
        out.push('\n');
    }
    out
}

#[test]
fn recordings_become_a_calibration_that_feels() {
    let folder = Folder::new("trained");
    let (file, page, saved) = (
        folder.path("c.toml"),
        folder.path("c.html"),
        folder.path("s.csv"),
    );
    let data = lattice();
    let data = data.to_string_lossy();
    let text = done(&["calibrate", SENSOR, &data, "-o", &file, "--report", &page]);
    assert!(
        text.contains("surface, x") && text.contains("force, share"),
        "{text}"
    );
    assert!(
        text.contains("one run does not show how runs differ"),
        "{text}"
    );
    assert!(fs::read_to_string(&page).unwrap().contains("<svg"));
    let live = |source: &str, more: &[&str]| -> Value {
        let mut arguments = vec!["live", SENSOR, "--calibration", &file, "--source", source];
        arguments.extend(["--headless", "--speed", "max", "--format", "json"]);
        arguments.extend(more);
        serde_json::from_str(&done(&arguments)).unwrap()
    };
    // Held near the top of the first press.
    let source = format!("replay:{data}/force_sensor.csv");
    let found = live(&source, &["--frames", "550", "--save", &saved]);
    assert_eq!(
        (&found["frames"], &found["channels"]),
        (&550.into(), &15.into())
    );
    assert_eq!(found["tare"], "done", "{}", found["notice"]);
    let reading = |found: &Value| {
        let number = |key: &str| found[key][2].as_f64().unwrap();
        [number("last_force_n"), number("last_force_deviation_n")]
    };
    let [force, deviation] = reading(&found);
    let truth = grams_at(550) * 9.80665e-3;
    assert!(
        (force - truth).abs() < 3.0 * deviation,
        "{force} {truth} {deviation}"
    );
    assert_eq!(found["last_contacts"], 1);
    // The same frames give the same touch, through a recording of our own.
    assert_eq!(
        reading(&live(&format!("replay:{saved}"), &[])),
        [force, deviation]
    );
    // Trained on the presses all over the area, a press has a position.
    let presses = run(&folder, "position", same, same);
    done(&["calibrate", SENSOR, &presses, "-o", &file, "--force"]);
    let found = live(&format!("replay:{presses}/sensor.csv"), &["--no-tare"]);
    assert_eq!(found["last_sequence"], 604);
    // Its last press was at (292, -95) mm, the middle of all at (287, -100) mm.
    for axis in 0..2 {
        let place = found["last_centre_of_pressure_m"][axis].as_f64().unwrap();
        assert!((place - 5e-3).abs() < 1e-3, "{found}");
    }
}

/// The reading of the scale at or before a row, g.
fn grams_at(row: usize) -> f64 {
    let text = fs::read_to_string(lattice().join("force_states.csv")).unwrap();
    let readings = text.lines().take(row).filter_map(|line| {
        let grams: f64 = line.split(',').nth(4)?.parse().ok()?;
        (grams >= 0.0).then_some(grams)
    });
    readings.last().unwrap()
}

#[test]
fn a_surface_of_channels_predicts_a_press() {
    let folder = Folder::new("trained-place");
    let run = run(&folder, "position", same, same);
    let file = folder.path("c.toml");
    done(&["calibrate", SENSOR, &run, "-o", &file]);
    let predict = |load: &str| {
        let arguments = ["predict", SENSOR, "--calibration", &file, "--load", load];
        [&arguments[..], &["--format", "json"]]
            .concat()
            .iter()
            .map(|a| (*a).to_owned())
            .collect::<Vec<_>>()
    };
    let arguments = predict("x=0 mm, y=0 mm");
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let whole: Value = serde_json::from_str(&done(&arguments)).unwrap();
    // What the presses in the middle (287, -100 mm) read on average.
    let text = fs::read_to_string(lattice().join("position_states.csv")).unwrap();
    let frames = fs::read_to_string(lattice().join("position_sensor.csv")).unwrap();
    let middle = text.lines().zip(frames.lines()).filter(|(place, _)| {
        let cells: Vec<f64> = place.split(',').map(|cell| cell.parse().unwrap()).collect();
        (cells[1] - 287.0).abs() < 0.1 && (cells[2] + 100.0).abs() < 0.1
    });
    let readings: Vec<f64> = middle
        .map(|(_, frame)| frame.split(',').nth(3).unwrap().parse().unwrap())
        .collect();
    let mean = readings.iter().sum::<f64>() / readings.len() as f64;
    let found = &whole["rows"][0];
    let value = found["magnetometer_1_z"].as_f64().unwrap();
    let deviation = found["magnetometer_1_z_deviation"].as_f64().unwrap();
    // The mean of five passes that creep.
    assert!(
        (value - mean).abs() < 3.0 * deviation,
        "{value} {mean} {deviation}"
    );
    let arguments = predict("x=50 mm, y=0 mm");
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    assert!(refused(&arguments).contains("outside of the presses"));
}

#[test]
fn nothing_follows_before_training() {
    for arguments in [
        vec!["predict", SENSOR, "--load", "x=0 mm, y=0 mm"],
        vec!["live", SENSOR, "--headless", "--frames", "3"],
        vec!["twin", SENSOR, "--calibration-data"],
    ] {
        let message = refused(&arguments);
        assert!(message.contains("no physical model"), "{message}");
        assert!(message.contains("taxel calibrate"), "{message}");
    }
    let recording = lattice().join("force_sensor.csv");
    let source = format!("replay:{}", recording.to_str().unwrap());
    let message = refused(&["live", SENSOR, "--headless", "--source", &source]);
    assert!(message.contains("train first"), "{message}");
    // Without the sensor file nobody knows what the numbers are.
    let message = refused(&["live", "--headless", "--source", &source]);
    assert!(message.contains("no header"), "{message}");
    assert!(done(&["check", SENSOR]).contains("learned by"));
}

#[test]
fn what_cannot_be_trained_is_refused_with_one_message_and_no_file() {
    let folder = Folder::new("trained-refused");
    let file = folder.path("c.toml");
    let check = |run: &str, message: &str| {
        let found = refused(&["calibrate", SENSOR, run, "-o", &file]);
        assert!(found.contains(message), "{message}: {found}");
        assert_eq!(found.matches("error:").count(), 1);
        assert!(!Path::new(&file).exists());
    };
    let narrower = |text: &str| lines(text, |_, cells| cells.truncate(15));
    check(
        &run(&folder, "force", narrower, same),
        "14 numbers beside the time; the sensor has 15",
    );
    let constant = |text: &str| lines(text, |_, cells| cells[1..].fill("7".into()));
    check(
        &run(&folder, "force", constant, same),
        "all its channels are constant",
    );
    let line = |text: &str| lines(text, |_, cells| cells[1] = "282".into());
    check(&run(&folder, "position", same, line), "not along a line");
    let later = |text: &str| lines(text, |row, cells| cells[0] = (1e6 + row as f64).to_string());
    check(
        &run(&folder, "force", same, later),
        "the stage moved from 1000000 s",
    );
    let cut = |text: &str| text[..text.rfind(',').unwrap()].to_owned();
    check(&run(&folder, "force", cut, same), "cut short");
    let missing = |text: &str| {
        lines(text, |row, cells| {
            if row == 70 {
                cells[3] = "nan".into();
            }
        })
    };
    check(&run(&folder, "force", missing, same), "sensor.csv:71:");
    let timeless = |text: &str| lines(text, |_, cells| drop(cells.remove(0)));
    check(
        &run(&folder, "force", timeless, same),
        "does not come after",
    );
    let pressed = |text: &str| {
        lines(text, |_, cells| {
            if cells[4] != "-1" {
                cells[4] = (500.0 + cells[4].parse::<f64>().unwrap()).to_string();
            }
        })
    };
    check(
        &run(&folder, "force", same, pressed),
        "begin each recording before the first contact",
    );
    fs::remove_file(folder.path("run/states.csv")).unwrap();
    check(&folder.path("run"), "no file with the positions or forces");
}

#[test]
fn a_calibration_of_another_sensor_and_a_tampered_one_are_refused() {
    let folder = Folder::new("trained-tampered");
    let file = folder.path("c.toml");
    let run = run(&folder, "force", same, same);
    done(&["calibrate", SENSOR, &run, "-o", &file]);
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.len() < 1 << 20);
    let shipped =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../taxel/sensors/eflesh-lattice.toml");
    let other = folder.path("other.toml");
    let changed = fs::read_to_string(shipped).unwrap().replace("35 N", "30 N");
    fs::write(&other, changed).unwrap();
    let source = format!("replay:{}", folder.path("run/sensor.csv"));
    let live = |sensor: &str| {
        refused(&[
            "live",
            sensor,
            "--calibration",
            &file,
            "--headless",
            "--source",
            &source,
        ])
    };
    assert!(live(&other).contains("full_scale was 35 N, is 30 N"));
    for (from, to, key) in [
        ("channels = 15", "channels = 14", "trained."),
        ("longest_step = ", "longest_step = -", "longest_step"),
        ("farthest = ", "farthest = -", "farthest"),
        ("scale = [\n  ", "scale = [\n  nan, ", "trained.standard"),
        ("[trained.rest]", "[trained.peace]", "peace"),
    ] {
        assert!(text.contains(from), "{from}");
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        let message = live(SENSOR);
        assert!(
            message.contains(key) && message.contains("c.toml"),
            "{from}: {message}"
        );
    }
}

#[test]
fn a_table_with_a_header_is_a_run() {
    let folder = Folder::new("trained-table");
    let mut text = String::from("time [ms],force_z [mN]");
    for channel in 1..=15 {
        write!(text, ",channel_{channel}").unwrap();
    }
    text.push('\n');
    for row in 0..400 {
        let phase = 0.05 * f64::from(row);
        let press = (0.5 - 0.5 * (phase.max(1.0) - 1.0).cos()) * 3.0;
        write!(text, "{},{}", 40 * row, 1e3 * press).unwrap();
        for c in (0..15).map(f64::from) {
            let reading = 100.0 + press * (10.0 + c) + (phase + c).sin();
            write!(text, ",{reading}").unwrap();
        }
        text.push('\n');
    }
    let data = folder.path("run.csv");
    fs::write(&data, &text).unwrap();
    let calibration = folder.path("run.toml");
    let found = done(&[
        "calibrate",
        SENSOR,
        &data,
        "--format",
        "json",
        "-o",
        &calibration,
    ]);
    let found: Value = serde_json::from_str(&found).unwrap();
    // Its readings are a recording, and what was measured beside them is not used.
    let touch = estimated(&data, &calibration, &folder.path("touch.csv"));
    assert_eq!(column(&touch, "force_z [N]").len(), 400);
    let blind = text.replace("force_z [mN]", "moment_z [N mm]");
    fs::write(&data, blind).unwrap();
    assert_eq!(
        touch,
        estimated(&data, &calibration, &folder.path("touch.csv"))
    );
    let error = found["hold_out"][0]["root_mean_square"].as_f64().unwrap();
    // Fifteen channels with a wave of 1 of 30 to 75: well below 0.1 N of 3 N.
    assert!(error < 0.1, "{error}");
    fs::write(&data, text.replacen("channel_15", "channel_16", 1)).unwrap();
    assert!(refused(&["calibrate", SENSOR, &data]).contains("the sensor has 15 channels"));
    fs::write(&data, text.replacen("time [ms]", "clock [ms]", 1)).unwrap();
    assert!(refused(&["calibrate", SENSOR, &data]).contains("column time [s] is missing"));
}

/// The result of a training that succeeds, for people.
fn trained(run: &str) -> String {
    done(&["calibrate", SENSOR, run])
}

/// Without the cell `nan` of a scale a reading is as missing as with -1.
#[test]
fn ways_to_save_a_recording_train_the_same_map() {
    let folder = Folder::new("trained-ways");
    let plain = trained(&run(&folder, "force", same, same));
    let continental = |text: &str| text.replace(',', ";").replace('.', ",");
    assert_eq!(trained(&run(&folder, "force", continental, same)), plain);
    let noted = |text: &str| format!("\u{feff}# by us\n{}", text.replace('\n', ",\r\n"));
    assert_eq!(trained(&run(&folder, "force", noted, same)), plain);
    let missing = |text: &str| text.replace(",-1\n", ",nan\n");
    assert_eq!(trained(&run(&folder, "force", same, missing)), plain);
    let empty = |text: &str| text.replace(",-1\n", ",\n");
    assert_eq!(trained(&run(&folder, "force", same, empty)), plain);
}

/// The error in a line of held-out readings, percent of their range.
fn share(line: &str) -> f64 {
    let (_, after) = line.split_once('(').unwrap();
    let (percent, _) = after.split_once(' ').unwrap();
    percent.parse().unwrap()
}

/// Times of a line within an outage of the sensor.
fn in_outage(cells: &[String]) -> bool {
    let time: f64 = cells[0].parse().unwrap();
    (60.0..80.0).contains(&time)
}

#[test]
fn nothing_is_learned_from_when_the_sensor_was_not_read() {
    let folder = Folder::new("trained-outage");
    let outage = |text: &str| -> String {
        let kept = text.lines().filter(|line| {
            let cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            !in_outage(&cells)
        });
        kept.flat_map(|line| [line, "\n"]).collect()
    };
    let found = trained(&run(&folder, "force", outage, same));
    assert!(found.contains("when the sensor was not read"), "{found}");
    // Had the outage been bridged by straight lines, the error would be that of
    // a map that knows nothing of a press: several newtons.
    let force = found.lines().find(|line| line.contains("force, run 1: "));
    assert!(force.is_some_and(|line| share(line) < 4.0), "{found}");
    let half = |text: &str| text[..=text[..text.len() / 2].rfind('\n').unwrap()].to_owned();
    let found = trained(&run(&folder, "force", same, half));
    assert!(found.contains("train nothing"), "{found}");
}

#[test]
fn runs_that_determine_no_force_are_named() {
    let folder = Folder::new("trained-free");
    let file = folder.path("c.toml");
    let check = |run: &str, message: &str| {
        let found = refused(&["calibrate", SENSOR, run, "-o", &file]);
        assert!(found.contains(message), "{message}: {found}");
        assert!(!Path::new(&file).exists());
    };
    // A scale that shows its own noise: nothing touches.
    let noise = |text: &str| {
        lines(text, |row, cells| {
            if cells[4] != "-1" {
                cells[4] =
                    (f64::from((row as u32).wrapping_mul(2_654_435_761) >> 24) / 256.0).to_string();
            }
        })
    };
    let frames = fs::read_to_string(lattice().join("force_sensor.csv")).unwrap();
    let first: Vec<&str> = frames.lines().take(40).collect();
    let still = |text: &str| {
        lines(text, |row, cells| {
            let time = cells[0].clone();
            *cells = first[row % 40].split(',').map(str::to_owned).collect();
            cells[0] = time;
        })
    };
    check(
        &run(&folder, "force", still, noise),
        "the channels do not determine the force",
    );
    // Beside a run with contact it is left out.
    let pressed = lattice();
    let pressed = pressed.to_string_lossy();
    let found = done(&["calibrate", SENSOR, &pressed, &folder.path("run")]);
    assert!(found.contains("nothing touches, and the run is left out"));
    let milliseconds = |text: &str| {
        lines(text, |_, cells| {
            cells[0] = (1e3 * cells[0].parse::<f64>().unwrap()).to_string();
        })
    };
    check(
        &run(&folder, "force", milliseconds, milliseconds),
        "the times are in another unit",
    );
    let later = |text: &str| {
        lines(text, |_, cells| {
            cells[0] = (5.0 + cells[0].parse::<f64>().unwrap()).to_string();
        })
    };
    check(
        &run(&folder, "force", same, later),
        "after the sensor: their clocks differ",
    );
    let short = |text: &str| {
        text.lines()
            .take(60)
            .flat_map(|line| [line, "\n"])
            .collect()
    };
    check(
        &run(&folder, "force", short, short),
        "at least 50 are needed",
    );
}

#[test]
fn a_single_pass_over_the_area_is_judged_among_its_presses() {
    let folder = Folder::new("trained-pass");
    let pass = |text: &str| {
        text.lines()
            .take(121)
            .flat_map(|line| [line, "\n"])
            .collect()
    };
    let found = trained(&run(&folder, "position", pass, pass));
    assert!(found.contains("every fourth press"), "{found}");
    // The grid is 1 mm of 10 mm; a map that had to extrapolate beyond it would err by more.
    let held_out = found
        .lines()
        .filter(|line| line.starts_with("held out  place."));
    let errors: Vec<f64> = held_out.map(share).collect();
    assert_eq!(errors.len(), 2, "{found}");
    assert!(errors.iter().all(|share| *share < 10.0), "{found}");
}

/// What `taxel estimate` makes of a recording, written over `table`.
fn estimated(recording: &str, calibration: &str, table: &str) -> String {
    let from = ["estimate", SENSOR, recording, "--calibration", calibration];
    done(&[&from[..], &["-o", table, "--force"]].concat());
    fs::read_to_string(table).unwrap()
}

/// Columns of a table that the program wrote, by their names.
fn column(table: &str, wanted: &str) -> Vec<String> {
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = names.iter().position(|name| *name == wanted).unwrap();
    let cells = lines.map(|line| line.split(',').nth(at).unwrap().to_owned());
    cells.collect()
}

fn numbers(table: &str, wanted: &str) -> Vec<f64> {
    let cells = column(table, wanted).into_iter();
    cells.map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()
}

/// Times and forces of the scale of the sample, s and N.
fn scale() -> Vec<[f64; 2]> {
    let text = fs::read_to_string(lattice().join("force_states.csv")).unwrap();
    let rows = text.lines().filter_map(|line| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        (cells[4] != -1.0).then_some([cells[0], cells[4] * 9.80665e-3])
    });
    rows.collect()
}

/// Errors of a table of estimates at the readings of the scale, with their deviations.
fn errors(table: &str) -> Vec<[f64; 2]> {
    let times = numbers(table, "time [s]");
    let (force, deviation) = (
        numbers(table, "force_z [N]"),
        numbers(table, "force_z_deviation [N]"),
    );
    let at = |values: &[f64], time: f64| {
        let after = times
            .partition_point(|t| *t < time)
            .clamp(1, times.len() - 1);
        let share = (time - times[after - 1]) / (times[after] - times[after - 1]);
        let share = share.clamp(0.0, 1.0);
        values[after - 1] + share * (values[after] - values[after - 1])
    };
    let readings = scale().into_iter();
    let errors = readings.map(|[time, truth]| [at(&force, time) - truth, at(&deviation, time)]);
    errors.filter(|[error, _]| error.is_finite()).collect()
}

fn rms(errors: &[[f64; 2]]) -> f64 {
    let squares: f64 = errors.iter().map(|[error, _]| error * error).sum();
    (squares / errors.len() as f64).sqrt()
}

/// The training says what its own readings replayed live err by; a user who replays them finds
/// the same.
#[test]
fn a_training_run_replayed_has_the_residuals_of_the_training() {
    let folder = Folder::new("trained-replay");
    let run = run(&folder, "force", same, same);
    let (file, table) = (folder.path("c.toml"), folder.path("t.csv"));
    let text = done(&["calibrate", SENSOR, &run, "-o", &file]);
    let (_, after) = text.split_once("replayed live, have ").unwrap();
    let printed: f64 = after.split(' ').next().unwrap().parse().unwrap();
    let recording = format!("{run}/sensor.csv");
    let text = estimated(&recording, &file, &table);
    let errors = errors(&text);
    // Four printed digits, and one reading of 523 after the last frame, which adds at most its share.
    assert!(
        (rms(&errors) - printed).abs() < 5e-4,
        "{} {printed}",
        rms(&errors)
    );
    // Live: the same frames, the last one digit for digit.
    let live = [
        "live",
        SENSOR,
        "--calibration",
        &file,
        "--headless",
        "--speed",
        "max",
    ];
    let source = format!("replay:{recording}");
    let found = done(&[&live[..], &["--format", "json", "--source", &source]].concat());
    let found: Value = serde_json::from_str(&found).unwrap();
    let last = found["last_force_n"][2].as_f64().unwrap();
    assert_eq!(numbers(&text, "force_z [N]").last(), Some(&last));
}

/// What is wrong with a channel, how it is made, and whether it must be wrong from the start.
type Fault = (&'static str, fn(usize, f64) -> f64);

/// One channel after the other is broken in mid-run: it is named within a second of frames, the
/// force goes on from the rest, and its interval holds.
#[test]
fn a_broken_channel_is_named_and_the_force_goes_on() {
    let folder = Folder::new("trained-health");
    let run = run(&folder, "force", same, same);
    let (file, table) = (folder.path("c.toml"), folder.path("t.csv"));
    done(&["calibrate", SENSOR, &run, "-o", &file]);
    let text = fs::read_to_string(lattice().join("force_sensor.csv")).unwrap();
    let frozen = text.lines().nth(500).unwrap().split(',').nth(6).unwrap();
    let frozen: f64 = frozen.parse().unwrap();
    assert!(frozen.is_finite());
    let faults: [Fault; 5] = [
        ("missing", |_, _| f64::NAN),
        ("zero", |_, _| 0.0),
        ("jumped", |_, value| value + 3000.0),
        ("divided", |_, value| value / 1000.0),
        ("noisy", |row, value| {
            let wave = (row as u32).wrapping_mul(2_654_435_761) >> 24;
            value + 10.0 * (f64::from(wave) - 128.0)
        }),
    ];
    let sound = {
        let recording = format!("{run}/sensor.csv");
        estimated(&recording, &file, &table)
    };
    let usual = rms(&errors(&sound));
    assert!(
        column(&sound, "wrong_channels")
            .iter()
            .all(String::is_empty)
    );
    for (name, fault) in faults {
        let broken = lines(&text, |row, cells| {
            if row >= 500 {
                let value: f64 = cells[6].parse().unwrap();
                cells[6] = fault(row, value).to_string();
            }
        });
        let recording = folder.path(&format!("{name}.csv"));
        fs::write(&recording, broken).unwrap();
        let found = estimated(&recording, &file, &table);
        let wrong = column(&found, "wrong_channels");
        let times = numbers(&found, "time [s]");
        let named = wrong.iter().position(|wrong| wrong == "magnetometer 2 z");
        let after = named.map_or(f64::INFINITY, |row| times[row] - times[500]);
        assert!(
            (0.0..=1.1).contains(&after),
            "{name}: named after {after} s"
        );
        assert!(
            wrong
                .iter()
                .all(|wrong| wrong.is_empty() || wrong == "magnetometer 2 z")
        );
        let errors = errors(&found);
        // The frames of the rest capture are no forces yet.
        assert!(
            errors.len() + 55 > scale().len(),
            "{name}: {}",
            errors.len()
        );
        // The others determine the channel to a hundredth of what it does.
        assert!(
            rms(&errors) < 2.0 * usual + 0.1,
            "{name}: {} N",
            rms(&errors)
        );
        let wider = numbers(&found, "force_z_deviation [N]");
        let before = numbers(&sound, "force_z_deviation [N]");
        let [wider, before] = [wider, before].map(|all| all[600..].iter().sum::<f64>());
        assert!(wider > before, "{name}: {wider} {before}");
    }
    // All channels at once: nothing is estimated from them, and all are named.
    let broken = lines(&text, |row, cells| {
        for cell in cells.iter_mut().skip(1).filter(|_| row >= 500) {
            *cell = (1e-3 * cell.parse::<f64>().unwrap()).to_string();
        }
    });
    let recording = folder.path("all.csv");
    fs::write(&recording, broken).unwrap();
    let found = estimated(&recording, &file, &table);
    let wrong = column(&found, "wrong_channels");
    assert_eq!(wrong.last().unwrap().split(';').count(), 15);
    assert_eq!(column(&found, "state").last().unwrap(), "faulty");
}

/// A table with a header: a body of 15 channels under cycles of force.
fn cycles(header: &str, row: impl Fn(usize, f64, f64) -> String) -> String {
    let mut text = String::from(header);
    for channel in 1..=15 {
        write!(text, ",channel_{channel}").unwrap();
    }
    text.push('\n');
    for index in 0..400 {
        let phase = 0.05 * index as f64;
        let press = (0.5 - 0.5 * (phase.max(1.0) - 1.0).cos()) * 3.0;
        text.push_str(&row(index, 0.04 * index as f64, press));
        for c in (0..15).map(f64::from) {
            let reading = 100.0 + press * (10.0 + c) + (phase + c).sin();
            write!(text, ",{reading}").unwrap();
        }
        text.push('\n');
    }
    text
}

/// Tables that were made wrong on purpose, each with what its message says: what was found, and
/// the smallest thing to do.
#[test]
fn twenty_tables_that_are_wrong_each_have_their_message() {
    let folder = Folder::new("trained-wrong");
    let table = folder.path("run.csv");
    let whole = cycles("time [s],force_z [N]", |_, time, press| {
        format!("{time},{press}")
    });
    let timeless = cycles("force_z [N]", |_, _, press| format!("{press}"));
    let plain = |_: usize, time: f64, press: f64| format!("{time},{press}");
    let short: String = whole
        .lines()
        .take(30)
        .flat_map(|line| [line, "\n"])
        .collect();
    let placed = |x: f64| {
        cycles("time [s],x [mm],y [mm]", |index, time, _| {
            let [row, column] = [index / 20, index % 20].map(|at| at as f64);
            format!("{time},{},{}", x * row, column)
        })
    };
    let tables: Vec<(&str, String, Vec<&str>, Vec<&str>)> = vec![
        ("nothing in it", String::new(), vec![], vec!["run.csv"]),
        (
            "a header alone",
            whole.lines().next().unwrap().to_owned(),
            vec![],
            vec!["no readings", "one row per reading"],
        ),
        (
            "no time",
            timeless.clone(),
            vec![],
            vec!["column time [s] is missing", "--rate \"28 Hz\""],
        ),
        (
            "a rate without unit",
            timeless,
            vec!["--rate", "28"],
            vec!["is not a rate", "such as \"28 Hz\""],
        ),
        (
            "no unit",
            cycles("time [s],force_z", plain),
            vec![],
            vec!["force_z", "unit"],
        ),
        (
            "an unknown unit",
            cycles("time [s],force_z [lb]", plain),
            vec![],
            vec!["run.csv:1:10", "lb", "mN"],
        ),
        (
            "a unit of a plain number",
            whole.replacen("channel_1,", "channel_1 [kohm],", 1),
            vec![],
            vec![
                "run.csv:1:22",
                "of plain numbers, not of [kohm]",
                "write channel_1",
            ],
        ),
        (
            "a name with a wrong letter",
            cycles("time [s],forze_z [N]", plain),
            vec![],
            vec![
                "there is nothing to train",
                "forze_z [N] (is force_z [N] meant?)",
            ],
        ),
        (
            "one step",
            cycles("time [s],force_z [N]", |index, time, _| {
                format!("{time},{}", if index < 100 { 0 } else { 5 })
            }),
            vec![],
            vec![
                "the channels do not determine the force",
                "the force rises once only",
            ],
        ),
        (
            "a column twice",
            cycles("time [s],time [s]", plain),
            vec![],
            vec!["appears twice"],
        ),
        (
            "x without y",
            cycles("time [s],x [mm]", plain),
            vec![],
            vec!["a place needs x and y", "give x and y, or neither"],
        ),
        (
            "a channel too many",
            whole.replacen("channel_15", "channel_16", 1),
            vec![],
            vec!["the sensor has 15 channels", "of this sensor"],
        ),
        (
            "a channel too few",
            whole.replacen("channel_15", "spare", 1),
            vec![],
            vec!["column channel_15 is missing"],
        ),
        (
            "text in a cell",
            whole.replacen("\n0.04,", "\nabc,", 1),
            vec![],
            vec!["run.csv:3", "abc"],
        ),
        (
            "a row cut short",
            whole[..whole.rfind(',').unwrap()].to_owned(),
            vec![],
            vec!["this row has 16 fields; the header has 17"],
        ),
        (
            "pulling for pressing",
            cycles("time [s],force_z [N]", |_, time, press| {
                format!("{time},{}", -press)
            }),
            vec![],
            vec!["pressing is positive", "pressing is positive"],
        ),
        (
            "pressed from the start",
            cycles("time [s],force_z [N]", |_, time, press| {
                format!("{time},{}", 2.0 + press)
            }),
            vec![],
            vec!["begins with 2.000 N", "before the first contact"],
        ),
        (
            "too short",
            short,
            vec![],
            vec!["at least 50 are needed", "for a minute or more"],
        ),
        (
            "times in ms",
            cycles("time [s],force_z [N]", |_, time, press| {
                format!("{},{press}", 1e3 * time)
            }),
            vec![],
            vec!["the times are in another unit", "electronics.frame_rate"],
        ),
        (
            "neither place nor force",
            cycles("time [s],height [mm]", plain),
            vec![],
            vec!["there is nothing to train", "x and y, or force_z"],
        ),
        (
            "an area too large",
            placed(5.0),
            vec![],
            vec!["the presses span", "the area of the sensor file"],
        ),
        ("a line", placed(0.0), vec![], vec!["not along a line"]),
        (
            "a model",
            whole.clone(),
            vec!["--model", "x"],
            vec!["no model", "leave out --model"],
        ),
        (
            "a scale of the other sign",
            cycles("time [s],force_z [N]", |_, time, press| {
                format!("{time},{}", 0.2 - press)
            }),
            vec![],
            vec!["pressing is positive", "change the sign"],
        ),
        (
            "a scale in another unit",
            cycles("time [s],force_z [N]", |_, time, press| {
                format!("{time},{}", 1e3 * press)
            }),
            vec![],
            vec!["of a full scale of 35 N", "correct the unit"],
        ),
        (
            "a rate beside times",
            whole.clone(),
            vec!["--rate", "25 Hz"],
            vec!["a rate is given as well", "leave out --rate"],
        ),
        (
            "a unit beside a unit",
            whole.clone(),
            vec!["--scale-unit", "g"],
            vec!["leave out --scale-unit"],
        ),
        (
            "another way to hold out",
            whole.clone(),
            vec!["--hold-out", "none"],
            vec!["hold out whole runs", "leave out --hold-out"],
        ),
        (
            "force and channels apart",
            cycles("time [s],force_z [N]", |index, time, _| {
                let wave = (index as u32).wrapping_mul(2_654_435_761) >> 24;
                format!(
                    "{time},{}",
                    if index < 30 {
                        0.0
                    } else {
                        f64::from(wave) / 256.0
                    }
                )
            }),
            vec![],
            vec!["the channels do not determine the force", "one clock"],
        ),
    ];
    assert!(tables.len() >= 20);
    for (what, text, options, says) in tables {
        fs::write(&table, &text).unwrap();
        let file = folder.path("c.toml");
        let arguments = ["calibrate", SENSOR, &table, "-o", &file];
        let message = refused(&[&arguments[..], &options].concat());
        for part in says {
            assert!(
                message.contains(part),
                "{what}: \"{part}\" is not in {message}"
            );
        }
        assert_eq!(message.matches("error:").count(), 1, "{what}: {message}");
        assert!(!Path::new(&file).exists(), "{what}");
    }
    // A run and its copy are one run.
    let copy = folder.path("copy.csv");
    for path in [&table, &copy] {
        fs::write(path, &whole).unwrap();
    }
    let message = refused(&["calibrate", SENSOR, &table, &copy]);
    assert!(message.contains("give each run once"), "{message}");
    // The same rows with a rate are a run, and what is not used is named.
    let spare = cycles("force_z [N],height [mm]", |_, time, press| {
        format!("{press},{time}")
    });
    fs::write(&table, spare).unwrap();
    let found = done(&["calibrate", SENSOR, &table, "--rate", "25 Hz"]);
    assert!(
        found.contains("its rows are taken 0.040000 s apart"),
        "{found}"
    );
    assert!(
        found.contains("column height [mm] is no column of this device; not used"),
        "{found}"
    );
}

/// What a folder as published holds beside the recordings, and rows that were written twice, change
/// nothing; a scale in newtons is asked about.
#[test]
fn a_folder_as_published_trains_the_same_map() {
    let folder = Folder::new("trained-published");
    let plain = run(&folder, "force", same, same);
    let without_names = |text: &str| -> String {
        let lines = text.lines().filter(|line| !line.contains("csv"));
        lines.flat_map(|line| [line, "\n"]).collect()
    };
    let expected = without_names(&trained(&plain));
    let text = fs::read_to_string(format!("{plain}/sensor.csv")).unwrap();
    let first: Vec<f64> = text
        .lines()
        .next()
        .unwrap()
        .split(',')
        .map(|cell| cell.parse().unwrap())
        .collect();
    let tared = lines(&text, |_, cells| {
        for (cell, first) in cells.iter_mut().zip(&first).skip(1) {
            *cell = (cell.parse::<f64>().unwrap() - first).to_string();
        }
    });
    fs::write(format!("{plain}/sensor_post_baselines.csv"), tared).unwrap();
    let found = trained(&plain);
    assert!(
        found.contains("less a constant of each channel; it is left out"),
        "{found}"
    );
    assert_eq!(without_names(&found), expected);
    fs::remove_file(format!("{plain}/sensor_post_baselines.csv")).unwrap();
    let doubled = |text: &str| -> String {
        let lines = text.lines().enumerate();
        let twice = |(row, line): (usize, &str)| {
            let line = format!("{line}\n");
            if row % 9 == 0 { line.repeat(2) } else { line }
        };
        lines.map(twice).collect()
    };
    let found = trained(&run(&folder, "force", doubled, doubled));
    assert!(found.contains("rows repeat the one before"), "{found}");
    assert_eq!(without_names(&found), expected);
    let newtons = |text: &str| {
        lines(text, |_, cells| {
            let grams: f64 = cells[4].parse().unwrap();
            if grams != -1.0 {
                cells[4] = (grams * 9.80665e-3).to_string();
            }
        })
    };
    let run = run(&folder, "force", same, newtons);
    let message = refused(&["calibrate", SENSOR, &run]);
    assert!(
        message.contains("as newtons") && message.contains("--scale-unit N"),
        "{message}"
    );
    let found = done(&["calibrate", SENSOR, &run, "--scale-unit", "N"]);
    let error = |text: &str| {
        share(
            text.lines()
                .find(|line| line.contains("force, run 1: "))
                .unwrap(),
        )
    };
    assert!((error(&found) - error(&expected)).abs() < 0.02, "{found}");
}

/// A body that is sheared and turned, too: what the table has is learned, and said.
#[test]
fn all_components_of_a_table_are_learned() {
    let folder = Folder::new("trained-components");
    let mut text = String::from("time [s],force_x [N],force_y [N],force_z [N],moment_z [N mm]");
    (1..=15).for_each(|channel| write!(text, ",channel_{channel}").unwrap());
    text.push('\n');
    let mut truth = Vec::new();
    for index in 0..1200 {
        let time = 0.04 * f64::from(index);
        let moving = f64::from(u8::from(index > 30));
        let wave = |period: f64| moving * (time / period).sin();
        let [x, y, turn] = [wave(1.3), wave(1.9), 2.0 * wave(2.7)];
        let z = 3.0 * moving * (0.5 - 0.5 * (time / 1.1).cos());
        truth.push([x, y, z, 1e-3 * turn]);
        write!(text, "{time},{x},{y},{z},{turn}").unwrap();
        for c in (0..15).map(f64::from) {
            let [a, b, d, e] = [1.0, 2.0, 3.0, 4.0].map(|k: f64| 20.0 * (k * (c + 1.0)).sin());
            let noise = (f64::from(index) * (1.7 + 0.13 * c)).sin();
            let reading = 1000.0 + a * x + b * y + d * z + e * turn + 0.2 * noise;
            write!(text, ",{reading}").unwrap();
        }
        text.push('\n');
    }
    let [data, file, frames, table] =
        ["run.csv", "c.toml", "frames.csv", "t.csv"].map(|name| folder.path(name));
    fs::write(&data, &text).unwrap();
    let found = done(&["calibrate", SENSOR, &data, "-o", &file]);
    for name in ["force_x", "force_y", "moment_z"] {
        assert!(
            found.contains(&format!("held out  {name}: ")),
            "{name}: {found}"
        );
    }
    let bare = lines(text.split_once('\n').unwrap().1, |_, cells| {
        drop(cells.drain(1..5));
    });
    fs::write(&frames, bare).unwrap();
    let found = estimated(&frames, &file, &table);
    for (name, unit, component, largest) in [
        ("force_x", "N", 0, 1.0),
        ("force_y", "N", 1, 1.0),
        ("force_z", "N", 2, 3.0),
        ("moment_z", "N m", 3, 2e-3),
    ] {
        let values = numbers(&found, &format!("{name} [{unit}]"));
        let deviations = numbers(&found, &format!("{name}_deviation [{unit}]"));
        for (row, truth) in truth.iter().enumerate().skip(100) {
            let error: f64 = values[row] - truth[component];
            // Noise of 0.2 in 15 channels of 20 for each unit.
            assert!(error.abs() < 0.05 * largest, "{name}, row {row}: {error}");
            assert!(
                error.abs() < 6.0 * deviations[row],
                "{name}, row {row}: {error}"
            );
        }
    }
}
