//! Arrays without a physical model, from recordings to live touch, at the
//! boundary of the program.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use common::{Folder, done, refused};

const SENSOR: &str = "eflesh-lattice";

/// Excerpts of recordings of five magnetometers under a lattice.
fn excerpt() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../taxel-calibrate/tests/data/eflesh")
}

/// The run whose files are those of the excerpt called `kind`, changed.
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
        let text = fs::read_to_string(excerpt().join(format!("{kind}_{name}.csv"))).unwrap();
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
    let data = excerpt();
    let data = data.to_string_lossy();
    let text = done(&["calibrate", SENSOR, &data, "-o", &file, "--report", &page]);
    assert!(
        text.contains("inverted surface") && text.contains("five nearest neighbours"),
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
    // A press of the other run has a place.
    let found = live(
        &format!("replay:{data}/position_sensor.csv"),
        &["--no-tare"],
    );
    assert_eq!(found["last_sequence"], 604);
    // Its last press was at (292, -95) mm, the middle of all at (287, -100) mm.
    for axis in 0..2 {
        let place = found["last_centre_of_pressure_m"][axis].as_f64().unwrap();
        assert!((place - 5e-3).abs() < 1e-3, "{found}");
    }
}

/// The reading of the scale at or before a row, g.
fn grams_at(row: usize) -> f64 {
    let text = fs::read_to_string(excerpt().join("force_states.csv")).unwrap();
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
    // The presses in the middle (287, -100 mm) read 600 on average.
    let text = fs::read_to_string(excerpt().join("position_states.csv")).unwrap();
    let frames = fs::read_to_string(excerpt().join("position_sensor.csv")).unwrap();
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
    let recording = excerpt().join("force_sensor.csv");
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
        ("noise_variance = ", "noise_variance = -", "trained.ridge"),
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
    let found = done(&["calibrate", SENSOR, &data, "--format", "json"]);
    let found: Value = serde_json::from_str(&found).unwrap();
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
    let frames = fs::read_to_string(excerpt().join("force_sensor.csv")).unwrap();
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
    let pressed = excerpt();
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
