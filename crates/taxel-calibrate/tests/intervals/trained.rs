//! Arrays that are trained on runs of a synthetic body and tried on another one: every number
//! that they print with an interval. Touches of training and of the trial have one distribution.

use std::f64::consts::TAU;

use crate::tables::table;
use crate::tally::{Case, Printed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use taxel::estimation::{ArrayEstimator, Touch};
use taxel::sensor::Sensor;
use taxel_calibrate::{CalibrateOptions, CalibrationFile, NamedSensor, Provenance, train};
use taxel_recording::Frame;

/// Half a 95 % interval in deviations.
const WIDTH: f64 = 1.96;
/// Noise of a reading, counts.
const NOISE: f64 = 0.3;
/// Standard deviation of the stiffness from run to run.
const STIFFNESS: f64 = 0.01;

/// A standard deviation as it is expected before any run: that of one run from another is 1 % with
/// two degrees of freedom.
fn expected_scatter(random: &mut ChaCha8Rng) -> f64 {
    let square = normal(random).powi(2) + normal(random).powi(2);
    STIFFNESS / square.sqrt()
}

/// A row of a run: time, s; truth by the names of the columns; readings.
struct Row {
    time: f64,
    truth: Vec<f64>,
    readings: Vec<f64>,
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    random.sample(StandardNormal)
}

fn sensor_text(side: usize, channels: usize) -> String {
    let names: Vec<String> = (1..=channels).map(|c| format!("\"{c}\"")).collect();
    format!(
        "schema = 2\nname = \"trained\"\n[array]\nrows = {side}\ncolumns = {side}\n\
         pitch = \"2 mm\"\nmount = \"flat\"\n[element.trained]\nfull_scale = \"20 N\"\n\
         groups = [{{ name = \"chip\", channels = [{}] }}]\n\
         [electronics]\nframe_rate = \"5 Hz\"\nscan = \"simultaneous\"\n\
         readout = {{ digital = {{ unit = \"counts\" }} }}\n",
        names.join(", ")
    )
}

/// The estimator of an array that was trained on runs, through its calibration file.
fn trained(text: &str, columns: &str, runs: &[Vec<Row>]) -> ArrayEstimator {
    let sensor = Sensor::parse("trained.toml", text).unwrap();
    let named = NamedSensor {
        name: "trained.toml",
        text,
        sensor: &sensor,
    };
    let table = |(number, rows): (usize, &Vec<Row>)| {
        let rows = rows.iter();
        let rows = rows.map(|row| (row.time, row.truth.clone(), row.readings.clone()));
        table(format!("run{number}.csv"), columns, rows)
    };
    let groups: Vec<_> = runs.iter().enumerate().map(table).collect();
    let found = train(&named, &groups, &CalibrateOptions::default()).unwrap();
    let file = found.to_toml(&Provenance {
        version: "0",
        date: "2026-01-01",
        data: "runs",
        data_hash: "0",
    });
    let file = CalibrationFile::parse("c.toml", &file).unwrap();
    let calibrated = file.apply("c.toml", &named).unwrap();
    let stream = calibrated.trained().unwrap().stream();
    let mut estimator = ArrayEstimator::new(calibrated.device().unwrap().reader(&stream).unwrap());
    estimator.begin_rest_capture(10);
    estimator
}

/// Takes a row as live does.
fn push<'a>(estimator: &'a mut ArrayEstimator, sequence: usize, row: &Row) -> &'a Touch {
    let frame = Frame {
        sequence: sequence as u64,
        time_ns: (row.time * 1e9) as u64,
        values: row.readings.clone(),
        ..Frame::default()
    };
    estimator.push(&frame).unwrap().0
}

fn holds(name: &str, [value, deviation]: [f64; 2], truth: f64) -> Printed {
    let held = (value - truth).abs() <= WIDTH * deviation;
    (name.to_owned(), held)
}

/// Components of the wrench of a touch: forces, N, and moments, N m.
const WRENCH: &str =
    "force_x [N],force_y [N],force_z [N],moment_x [N m],moment_y [N m],moment_z [N m]";
/// Time between readings of a body that is touched at one place, s.
const STEP: f64 = 0.2047;
/// Rows of a run, of which the first are at rest.
const ROWS: [usize; 2] = [600, 20];

/// How old what a scale shows is beside its mean: it measures every 0.1999 s by its own clock.
fn age(time: f64) -> f64 {
    let turns = time / 0.1999;
    0.1999 * (turns - turns.floor() - 0.5)
}

/// A run of touches of any wrench at one place; with `clock` the scale shows the pressing force
/// of when it measured.
fn wrenches(random: &mut ChaCha8Rng, scatter: f64, clock: bool) -> Vec<Row> {
    let stiffness = 1.0 + scatter * normal(random);
    let phases: [f64; 6] = [(); 6].map(|()| random.random_range(0.0..TAU));
    let touch = |time: f64| -> [f64; 6] {
        // A press every 5 s, of another height each; the others come and go with it.
        let start = STEP * ROWS[1] as f64;
        let press = if time < start {
            0.0
        } else {
            let height = 0.7 + 0.3 * (0.37 * time + phases[2]).sin();
            height * (0.2 * TAU * (time - start) / 2.0).sin().powi(2)
        };
        let along = |k: usize| {
            press
                * (0.5 + 0.11 * k as f64)
                * (0.23 * (1.0 + 0.17 * k as f64) * time + phases[k]).sin()
        };
        [0, 1, 2, 3, 4, 5].map(|k| if k == 2 { press } else { along(k) })
    };
    let wrench = |touch: [f64; 6]| -> Vec<f64> {
        let of = |(k, share): (usize, f64)| match k {
            2 => stiffness * (4.0 * share + 3.0 * share * share),
            0 | 1 => 2.0 * stiffness * share,
            _ => 0.01 * stiffness * share,
        };
        touch.into_iter().enumerate().map(of).collect()
    };
    let row = |number: usize| {
        let time = STEP * number as f64;
        let now = touch(time);
        let mut truth = wrench(now);
        if clock {
            truth[2] = wrench(touch(time - age(time)))[2];
        }
        let reading = |c: usize| {
            let gain = |k: usize| 60.0 * ((1 + c) as f64 * (1.3 + k as f64)).sin();
            let linear: f64 = now
                .iter()
                .enumerate()
                .map(|(k, share)| gain(k) * share)
                .sum();
            200.0 * c as f64 + linear + 6.0 * c as f64 * now[2] * now[2]
        };
        let readings = (0..8).map(|c| reading(c) + NOISE * normal(random));
        Row {
            time,
            truth,
            readings: readings.collect(),
        }
    };
    (0..ROWS[0]).map(row).collect()
}

/// The wrench in one frame of a run, after training on so many others; the stiffness of runs scatters
/// by 1 %, or by `any` that is expected.
fn at_one_place(seed: u64, count: usize, [any, clock]: [bool; 2]) -> Vec<Printed> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scatter = if any {
        expected_scatter(&mut random)
    } else {
        STIFFNESS
    };
    let mut run = || wrenches(&mut random, scatter, clock);
    let runs: Vec<_> = (0..count).map(|_| run()).collect();
    let mut estimator = trained(&sensor_text(1, 8), WRENCH, &runs);
    let run = run();
    // Anywhere in the second half, where it presses.
    let pressed = |row: &Row| row.truth[2] > 0.5;
    let mut tried = random.random_range(ROWS[0] / 2..ROWS[0]);
    while !pressed(&run[tried]) {
        tried = random.random_range(ROWS[0] / 2..ROWS[0]);
    }
    for (number, row) in run[..tried].iter().enumerate() {
        push(&mut estimator, number, row);
    }
    let row = &run[tried];
    let touch = push(&mut estimator, tried, row);
    let mut found = Vec::new();
    for (axis, name) in ["force_x", "force_y", "force_z"].into_iter().enumerate() {
        let deviation = touch.total_covariance[axis][axis].sqrt();
        found.push(holds(
            name,
            [touch.total.force[axis], deviation],
            row.truth[axis],
        ));
    }
    for (axis, name) in ["moment_x", "moment_y", "moment_z"].into_iter().enumerate() {
        let printed = [touch.total.moment[axis], touch.moment_deviation[axis]];
        found.push(holds(name, printed, row.truth[3 + axis]));
    }
    found
}

/// Presses of a run over the area, each of so many frames after as many at rest.
const PRESSES: usize = 160;
const FRAMES: usize = 3;
/// Half of the side of the area that is pressed, mm.
const HALF: f64 = 8.0;

/// Readings of twelve channels, three of each of four chips, of a press at x, y with a depth, mm, that
/// is dragged along x and y; the body repeats itself to 0.5 %.
fn readings_of([x, y, depth]: [f64; 3], drag: [f64; 2], random: &mut ChaCha8Rng) -> Vec<f64> {
    let repeats = 1.0 + 0.005 * normal(random);
    let mut all = Vec::new();
    for chip in 0..4 {
        let along = [6.0, -6.0][chip % 2];
        let across = [6.0, -6.0][chip / 2];
        let [dx, dy] = [x - along, y - across];
        let near = repeats * depth * (-(dx * dx + dy * dy) / 128.0).exp();
        for channel in [
            100.0 * near,
            near * (12.0 * dx + 30.0 * drag[0]),
            near * (12.0 * dy + 30.0 * drag[1]),
        ] {
            all.push(1000.0 + channel + NOISE * normal(random));
        }
    }
    all
}

/// A run of presses anywhere; their columns are x, y, z in mm and the force in N.
fn presses(random: &mut ChaCha8Rng) -> Vec<Row> {
    let stiffness = 1.0 + STIFFNESS * normal(random);
    let mut rows = Vec::new();
    for press in 0..PRESSES {
        let [x, y] = [(); 2].map(|()| random.random_range(-HALF..HALF));
        let deep = random.random_range(1.0..2.5);
        let drag = [(); 2].map(|()| random.random_range(-0.2..0.2));
        let rest = if press == 0 { 12 } else { FRAMES };
        for frame in 0..rest + FRAMES {
            let depth = if frame < rest { 0.0 } else { deep };
            let force = stiffness * (2.0 * depth + 0.3 * depth * depth);
            rows.push(Row {
                time: 0.1 * rows.len() as f64,
                truth: vec![x, y, depth, force],
                readings: readings_of([x, y, depth], drag, random),
            });
        }
    }
    rows
}

/// Time over which channels drift before the trial, s, and by how much each does, counts.
const DRIFTS: f64 = 300.0;
const DRIFT: f64 = 3.0;

/// Place, depth and force of one press, after training on two runs; the channels have `drifted` or not.
fn over_the_area(seed: u64, drifted: bool) -> Vec<Printed> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let runs = [(); 2].map(|()| presses(&mut random));
    let mut estimator = trained(
        &sensor_text(10, 12),
        "x [mm],y [mm],z [mm],force_z [N]",
        &runs,
    );
    let mut run = presses(&mut random);
    let press = random.random_range(1..PRESSES);
    run.truncate(12 + FRAMES + 2 * FRAMES * press);
    if drifted {
        let rates: Vec<f64> = (0..12)
            .map(|_| DRIFT / DRIFTS * normal(&mut random))
            .collect();
        // Empty for long, then the run.
        let empty = (0..(DRIFTS / 0.1) as usize).map(|number| Row {
            time: 0.1 * number as f64,
            truth: vec![0.0; 4],
            readings: readings_of([0.0; 3], [0.0; 2], &mut random),
        });
        let empty: Vec<Row> = empty.collect();
        for row in &mut run {
            row.time += DRIFTS;
        }
        run.splice(0..0, empty);
        for row in &mut run {
            let drift = rates.iter().map(|rate| rate * row.time);
            row.readings
                .iter_mut()
                .zip(drift)
                .for_each(|(reading, drift)| *reading += drift);
        }
    }
    let (last, before) = run.split_last().unwrap();
    for (number, row) in before.iter().enumerate() {
        push(&mut estimator, number, row);
    }
    let touch = push(&mut estimator, before.len(), last);
    let of = |name: &str| {
        if drifted {
            format!("{name}, channels drifted")
        } else {
            name.to_owned()
        }
    };
    let force = touch.pressing_force().unwrap();
    let mut found = vec![holds(&of("force_z"), force, last.truth[3])];
    if let Some(depth) = touch.depth {
        found.push(holds(
            &of("depth"),
            depth.map(|depth| depth * 1e3),
            last.truth[2],
        ));
    }
    if let Some((centre, [xx, _, yy])) = touch.centre_of_pressure.filter(|_| touch.depth.is_some())
    {
        for (name, value, variance, truth) in [
            ("x", centre[0], xx, last.truth[0]),
            ("y", centre[1], yy, last.truth[1]),
        ] {
            found.push(holds(
                &of(name),
                [value * 1e3, variance.sqrt() * 1e3],
                truth,
            ));
        }
    }
    found
}

pub(crate) fn all() -> Vec<Case> {
    let case = |name, run: Box<dyn Fn(u64) -> Vec<Printed> + Sync>| Case {
        name,
        short: false,
        reached: 1.0,
        run,
    };
    vec![
        Case {
            short: true,
            ..case(
                "trained, wrench",
                Box::new(|seed| at_one_place(seed, 2, [false, false])),
            )
        },
        case(
            "trained, wrench, any scatter",
            Box::new(|seed| at_one_place(seed, 2, [true, false])),
        ),
        case(
            "trained, wrench, four runs",
            Box::new(|seed| at_one_place(seed, 4, [false, false])),
        ),
        case(
            "trained, wrench, scale with a clock",
            Box::new(|seed| at_one_place(seed, 2, [false, true])),
        ),
        case(
            "trained, places",
            Box::new(|seed| over_the_area(seed, false)),
        ),
        case(
            "trained, places, drift",
            Box::new(|seed| over_the_area(seed, true)),
        ),
    ]
}
