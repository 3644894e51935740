//! Positions of trained arrays from recordings made here: presses of many rows, rest between them,
//! light and hard ones, several runs.
#![allow(clippy::unwrap_used)]

mod tables;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use taxel::estimation::ArrayEstimator;
use taxel::sensor::Sensor;
use taxel_calibrate::training::NORMAL_95;
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, NamedSensor, Provenance, TrainedOutcome, TrainingFile, train,
};
use taxel_numerics::Noise;
use taxel_recording::Frame;

const CHANNELS: usize = 12;
/// Half of the side that is pressed, mm.
const HALF: f64 = 9.0;
/// Rows at rest before a press, on the way to its force and back, and at it.
const PHASES: [usize; 3] = [10, 4, 8];

fn text() -> String {
    let names: Vec<String> = (1..=CHANNELS).map(|c| format!("\"{c}\"")).collect();
    format!(
        "schema = 2\nname = \"grid\"\n[array]\nrows = 10\ncolumns = 10\npitch = \"2 mm\"\nmount = \"flat\"\n\
         [element.trained]\nfull_scale = \"10 N\"\ngroups = [{{ name = \"grid\", channels = [{}] }}]\n\
         [electronics]\nframe_rate = \"25 Hz\"\nscan = \"simultaneous\"\nreadout = {{ digital = {{ unit = \"counts\" }} }}\n",
        names.join(", ")
    )
}

/// What channels on a grid of 4 x 3 read of a force at x, y in mm; the body of this run has the `gain`.
fn readings([x, y]: [f64; 2], force: f64, gain: f64, noise: &mut Noise) -> Vec<f64> {
    let channel = |c: usize| {
        let [across, along] = [6.0 * (c % 4) as f64 - 9.0, 6.0 * (c / 4) as f64 - 6.0];
        let square = (x - across).powi(2) + (y - along).powi(2);
        let pressed = force * (1.0 - 0.01 * force) * (-square / 150.0).exp();
        500.0 + 60.0 * gain * pressed + 3.0 * noise.normal()
    };
    (0..CHANNELS).map(channel).collect()
}

/// A row: time, s; x, y in mm and the force, N; readings.
type Row = (f64, [f64; 3], Vec<f64>);

/// Presses at random places, or of a grid of so many, of forces up to 10 N, or of one.
fn run(seed: u64, presses: usize, grid: Option<usize>, force: Option<f64>) -> Vec<Row> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = Noise::seeded(seed);
    let gain = 1.0 + 0.005 * noise.normal();
    let mut rows = Vec::new();
    for press in 0..presses {
        let anywhere = [(); 3].map(|()| random.random_range(0.0..1.0));
        let place = match grid {
            Some(side) => [press / side % side, press % side]
                .map(|at| HALF * (2.0 * at as f64 / (side - 1) as f64 - 1.0)),
            None => [0, 1].map(|axis| HALF * (2.0 * anywhere[axis] - 1.0)),
        };
        let most = force.unwrap_or(1.0 + 9.0 * anywhere[2]);
        let [rest, way, held] = PHASES;
        for row in 0..rest + 2 * way + held {
            let on = (row as f64 - rest as f64 + 1.0).min((rest + 2 * way + held - row) as f64);
            let force = most * (on / (way + 1) as f64).clamp(0.0, 1.0);
            let time = 0.04 * rows.len() as f64;
            let read = readings(place, force, gain, &mut noise);
            rows.push((time, [place[0], place[1], force], read));
        }
    }
    rows
}

/// The rows of a run in which the force is held, one of each press.
fn one_of_each(run: Vec<Row>) -> Vec<Row> {
    let [rest, way, held] = PHASES;
    let rows = run.into_iter().skip(rest + way + held / 2);
    rows.step_by(rest + 2 * way + held).collect()
}

fn table(number: usize, rows: &[Row], with_force: bool) -> Vec<TrainingFile> {
    let truths = if with_force { 3 } else { 2 };
    let columns = ["x [mm],y [mm]", "x [mm],y [mm],force_z [N]"][truths - 2];
    let rows = rows.iter();
    let rows = rows.map(|(time, truth, read)| (*time, truth[..truths].to_vec(), read.clone()));
    tables::table(format!("run{number}.csv"), columns, rows)
}

fn trained(runs: &[Vec<Row>], with_force: bool) -> (TrainedOutcome, Sensor) {
    let text = text();
    let sensor = Sensor::parse("grid.toml", &text).unwrap();
    let named = NamedSensor {
        name: "grid.toml",
        text: &text,
        sensor: &sensor,
    };
    let groups: Vec<_> = (0..)
        .zip(runs)
        .map(|(n, rows)| table(n, rows, with_force))
        .collect();
    let found = train(&named, &groups, &CalibrateOptions::default()).unwrap();
    let file = found.to_toml(&Provenance {
        version: "0",
        date: "2026-01-01",
        data: "runs",
        data_hash: "0",
    });
    let file = CalibrationFile::parse("c.toml", &file).unwrap();
    let calibrated = file.apply("c.toml", &named).unwrap();
    (found, calibrated)
}

/// Forces of rows, errors of a coordinate and their deviations, mm, where the estimator states them.
fn errors(calibrated: &Sensor, rows: &[Row], with_force: bool) -> Vec<[f64; 3]> {
    let stream = calibrated.trained().unwrap().stream();
    let mut estimator = ArrayEstimator::new(calibrated.device().unwrap().reader(&stream).unwrap());
    if with_force {
        estimator.begin_unasked_rest_capture(50);
    }
    let mut found = Vec::new();
    for (sequence, (time, truth, values)) in (0..).zip(rows) {
        let frame = Frame {
            sequence,
            time_ns: (time * 1e9) as u64,
            values: values.clone(),
            ..Frame::default()
        };
        let touch = estimator.push(&frame).unwrap().0;
        let contact = touch
            .contacts
            .first()
            .filter(|contact| contact.bound.is_none());
        let Some(contact) = contact.filter(|_| truth[2] > 0.0) else {
            continue;
        };
        let [xx, _, yy] = contact.covariance;
        for (axis, variance) in [xx, yy].into_iter().enumerate() {
            let error = contact.centre[axis] * 1e3 - truth[axis];
            found.push([truth[2], error, variance.sqrt() * 1e3]);
        }
    }
    found
}

/// Root mean square of the errors and the share of them within the 95 % intervals.
fn judged<'a>(all: impl IntoIterator<Item = &'a [f64; 3]>) -> [f64; 2] {
    let (mut squares, mut held, mut count) = (0.0, 0.0, 0.0);
    for [_, error, deviation] in all {
        squares += error * error;
        held += f64::from(u8::from(error.abs() <= NORMAL_95 * deviation));
        count += 1.0;
    }
    [f64::sqrt(squares / count), held / count]
}

fn says(found: &TrainedOutcome, text: &str) -> bool {
    found
        .outcome
        .remarks
        .iter()
        .any(|remark| remark.to_string().contains(text))
}

/// Rows of one press are one press: those that are held out are whole, and the intervals hold the
/// places of light and hard touches of other runs.
#[test]
fn rows_of_one_press_count_as_one() {
    let runs = [run(1, 60, None, None), run(2, 60, None, None)];
    let (found, calibrated) = trained(&runs, true);
    for name in ["run0.csv", "run1.csv"] {
        assert!(
            says(&found, &format!("{name} has 60 presses in")),
            "{:?}",
            found.outcome.remarks
        );
    }
    assert!(
        found.outcome.search.starts_with("120 presses in "),
        "{}",
        found.outcome.search
    );
    assert!(
        found.outcome.held_out.contains("each run in turn"),
        "{}",
        found.outcome.held_out
    );
    let mut all = Vec::new();
    for seed in 3..7 {
        all.extend(errors(&calibrated, &run(seed, 60, None, None), true));
    }
    for range in [[0.5, 2.0], [2.0, 5.0], [5.0, 10.0]] {
        let [rms, held] = judged(
            all.iter()
                .filter(|[f, ..]| (range[0]..range[1]).contains(f)),
        );
        // One factor for all touches is a little too small for the lightest.
        let least = if range[0] < 1.0 { 0.85 } else { 0.92 };
        assert!(held > least, "{held} of {range:?} N, {rms} mm");
        let stated = found
            .outcome
            .hold_out
            .iter()
            .filter(|one| one.name.starts_with("place"));
        let largest = stated
            .map(|one| one.root_mean_square * 1e3)
            .fold(0.0, f64::max);
        assert!(
            range[0] < 5.0 || rms < 2.0 * largest,
            "{rms} mm beside {largest} mm held out"
        );
    }
}

/// Without a force readings at rest are recognised, as they are the same at all places.
#[test]
fn rows_at_rest_train_no_place() {
    let raster = run(11, 81, Some(9), Some(8.0));
    let [rest, way, _] = PHASES;
    let (found, calibrated) = trained(&[raster], false);
    assert!(
        says(&found, "has 81 presses in"),
        "{:?}",
        found.outcome.remarks
    );
    let left_out = 81 * rest;
    let count = found.outcome.remarks.iter().find_map(|remark| {
        let text = remark.to_string();
        let (_, after) = text.split_once(" rows; ")?;
        after.split(' ').next()?.parse::<usize>().ok()
    });
    let count = count.unwrap();
    assert!(
        (left_out..=left_out + 81 * 2 * way).contains(&count),
        "{count} of {left_out}"
    );
    let fresh = run(12, 60, None, Some(8.0));
    let all = errors(&calibrated, &fresh, false);
    let [rms, held] = judged(all.iter().filter(|[force, ..]| *force > 7.9));
    let deviations: f64 = all
        .iter()
        .map(|[_, _, deviation]| deviation * deviation)
        .sum();
    let stated = (deviations / all.len() as f64).sqrt();
    assert!(rms < 0.6 && held > 0.9, "{rms} mm, {held}");
    assert!(stated < 5.0 * rms, "{stated} mm stated for {rms} mm");
}

/// One row of each press, in runs whose gains differ by 0.5 %: the intervals are those of the next run.
#[test]
fn the_intervals_are_those_of_the_next_run() {
    let of = |seed: u64| one_of_each(run(seed, 225, Some(15), Some(8.0)));
    let runs = [of(21), of(22), of(23)];
    let fresh: Vec<Vec<Row>> = (31..39)
        .map(|seed| one_of_each(run(seed, 100, None, Some(8.0))))
        .collect();
    for count in 1..=3 {
        let (found, calibrated) = trained(&runs[..count], false);
        assert_eq!(
            says(&found, "one run does not show how runs differ"),
            count == 1
        );
        assert_eq!(
            found.outcome.held_out.contains("each run in turn"),
            count > 1
        );
        let all: Vec<[f64; 3]> = fresh
            .iter()
            .flat_map(|rows| errors(&calibrated, rows, false))
            .collect();
        let [rms, held] = judged(&all);
        assert!(held > 0.92, "{count} runs: {held}, {rms} mm");
        let stated = all
            .iter()
            .map(|[_, _, deviation]| deviation * deviation)
            .sum::<f64>();
        let stated = (stated / all.len() as f64).sqrt();
        assert!(
            stated < 8.0 * rms,
            "{count} runs: {stated} mm stated for {rms} mm"
        );
    }
}
