//! Time of one frame of trained maps: 15 channels to position and to force, and 30 channels to
//! position, depth and force through the estimator that runs live.

use std::fmt::Write as _;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use taxel::acquisition::Frame;
use taxel::estimation::ArrayEstimator;
use taxel::sensor::Sensor;
use taxel::trained::{ForceEstimator, PositionEstimator};
use taxel_calibrate::training::{PositionOptions, Series, Session, train_forces, train_position};
use taxel_calibrate::{
    CalibrateOptions, CalibrationFile, NamedSensor, Provenance, TrainingFile, train,
};

/// A recording that the tests keep.
fn session(sensor: &str, stage: &str) -> Session {
    let sensor = Series::parse("sensor", sensor).expect("a shipped recording");
    let stage = Series::parse("stage", stage).expect("a shipped recording");
    Session::new("stage", sensor, &stage).expect("a shipped recording")
}

macro_rules! recorded {
    ($name:literal) => {
        include_str!(concat!(
            "../../crates/taxel-recording/tests/recordings/lattice/",
            $name
        ))
    };
}

fn position(criterion: &mut Criterion) {
    let run = session(
        recorded!("position_sensor.csv"),
        recorded!("position_states.csv"),
    );
    let rows = run.place.rows().iter();
    let positions: Vec<[f64; 2]> = rows.map(|row| [row[0], row[1]]).collect();
    let options = [PositionOptions {
        smoothing: 1e-4,
        run_in: 0.0,
        ..PositionOptions::default()
    }];
    let (map, _) = train_position(run.sensor.rows(), &positions, &options).expect("trains");
    let mut estimator = PositionEstimator::new(map).expect("sound");
    let mut next = run.sensor.rows().iter().cycle();
    criterion.bench_function("15 channels to position", |bencher| {
        bencher.iter(|| estimator.estimate(black_box(next.next().expect("a cycle never ends"))));
    });
}

fn force(criterion: &mut Criterion) {
    let run = session(recorded!("force_sensor.csv"), recorded!("force_states.csv"));
    let runs = [run];
    let map = train_forces(&runs, 0.0, true).expect("trains").map;
    let run = &runs[0];
    let mut estimator = ForceEstimator::new(map, run.baseline()).expect("fits");
    let mut next = run.sensor.rows().iter().cycle();
    let mut time = 0.0;
    criterion.bench_function("15 channels to force, a mixture of seven maps", |bencher| {
        bencher.iter(|| {
            time += 0.07;
            estimator.push(time, black_box(next.next().expect("a cycle never ends")))
        });
    });
}

const CHANNELS: usize = 30;
/// Sides of the grid of places, and depths of the presses, mm.
const SIDE: usize = 14;
const DEPTHS: [f64; 4] = [1.0, 1.5, 2.0, 2.5];

/// What 30 channels on a grid of 6 x 5 read of a press at (x, y), mm, of a depth, mm.
fn readings(x: f64, y: f64, depth: f64, number: usize) -> Vec<f64> {
    let channel = |c: usize| {
        let [across, along] = [5.0 * (c % 6) as f64 - 12.5, 5.0 * (c / 6) as f64 - 10.0];
        let square = (x - across).powi(2) + (y - along).powi(2);
        let spread = 30.0 + 10.0 * depth;
        let noise = (number as f64 * (1.7 + 0.13 * c as f64)).sin();
        500.0 + 300.0 * depth * (-square / spread).exp() + noise
    };
    (0..CHANNELS).map(channel).collect()
}

/// Presses all over the area, each of two frames after two without contact: x, y, depth, force, readings.
fn presses() -> Vec<([f64; 3], f64, Vec<f64>)> {
    let mut found = Vec::new();
    for press in 0..SIDE * SIDE * DEPTHS.len() {
        // Neighbours in time are none in place.
        let at = press * 89 % (SIDE * SIDE * DEPTHS.len());
        let depth = DEPTHS[at / (SIDE * SIDE)];
        let [x, y] = [at % SIDE, at / SIDE % SIDE].map(|k| 2.0 * k as f64 - 13.0);
        for frame in 0..4 {
            let depth = if frame < 2 { 0.0 } else { depth };
            let values = readings(x, y, depth, found.len());
            found.push(([x, y, depth], 2.0 * depth + 0.3 * depth * depth, values));
        }
    }
    found
}

fn frame(criterion: &mut Criterion) {
    let groups: Vec<String> = (1..=10)
        .map(|chip| format!("{{ name = \"chip {chip}\", channels = [\"x\", \"y\", \"z\"] }}"))
        .collect();
    let text = format!(
        "schema = 2\nname = \"ten chips\"\n[array]\nrows = 16\ncolumns = 16\npitch = \"2 mm\"\n\
         mount = \"flat\"\n[element.trained]\nfull_scale = \"10 N\"\ngroups = [{}]\n\
         [electronics]\nframe_rate = \"28 Hz\"\nscan = \"simultaneous\"\n\
         readout = {{ digital = {{ unit = \"counts\" }} }}\n",
        groups.join(", ")
    );
    let sensor = Sensor::parse("ten.toml", &text).expect("a sensor file");
    let all = presses();
    let mut places = String::from("time [s],x [mm],y [mm],z [mm]");
    let mut forces = String::from("time [s],force_z [N]");
    for number in 1..=CHANNELS {
        for table in [&mut places, &mut forces] {
            write!(table, ",channel_{number}").expect("a text takes all");
        }
    }
    for (number, ([x, y, depth], force, values)) in all.iter().enumerate() {
        let values = values.iter().fold(String::new(), |mut text, value| {
            write!(text, ",{value}").expect("a text takes all");
            text
        });
        let time = number as f64 / 28.0;
        if *depth > 0.0 {
            write!(places, "\n{time},{x},{y},{depth}{values}").expect("a text takes all");
        }
        write!(forces, "\n{time},{force}{values}").expect("a text takes all");
    }
    let file = |name: &str, text: String| {
        vec![TrainingFile {
            name: name.into(),
            text: text + "\n",
        }]
    };
    let named = NamedSensor {
        name: "ten.toml",
        text: &text,
        sensor: &sensor,
    };
    let groups = [file("places.csv", places), file("forces.csv", forces)];
    let trained = train(&named, &groups, &CalibrateOptions::default()).expect("trains");
    let law = &trained.maps.force.as_ref().expect("a force").law;
    println!("30 channels: {} features of the force", law.len());
    let file = trained.to_toml(&Provenance {
        version: "0",
        date: "2026-01-01",
        data: "presses",
        data_hash: "0",
    });
    let file = CalibrationFile::parse("c.toml", &file).expect("as written");
    let calibrated = file.apply("c.toml", &named).expect("of this sensor");
    let stream = calibrated.trained().expect("a trained array").stream();
    let device = calibrated.device().expect("a device");
    let mut estimator = ArrayEstimator::new(device.reader(&stream).expect("a reader"));
    let mut frame = Frame::default();
    // All is estimated.
    for (_, _, values) in &all[..400] {
        frame.sequence += 1;
        frame.time_ns += 35_714_286;
        frame.values.clone_from(values);
        estimator.push(&frame).expect("a frame");
    }
    let touch = estimator.touch();
    assert!(touch.depth.is_some() && touch.pressing_force().is_some());
    let mut next = all.iter().cycle();
    criterion.bench_function(
        "30 channels, whole frame: position, depth, force",
        |bencher| {
            bencher.iter(|| {
                frame.sequence += 1;
                frame.time_ns += 35_714_286;
                let (_, _, values) = next.next().expect("a cycle never ends");
                frame.values.clone_from(values);
                black_box(estimator.push(&frame).expect("a frame").0.depth)
            });
        },
    );
}

criterion_group!(benches, position, force, frame);
criterion_main!(benches);
