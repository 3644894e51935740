//! Time of one frame of trained maps: 15 channels to position and to force.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use taxel::trained::{ForceEstimator, PositionEstimator};
use taxel_calibrate::training::{
    ForceOptions, PositionOptions, Series, Session, train_force, train_position,
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
            "../../crates/taxel-calibrate/tests/data/eflesh/",
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
    let (map, _) = train_force(&runs, &ForceOptions::default()).expect("trains");
    let run = &runs[0];
    let mut estimator = ForceEstimator::new(map, run.baseline()).expect("fits");
    let mut next = run.sensor.rows().iter().cycle();
    let mut time = 0.0;
    criterion.bench_function("15 channels to force, creep of three times", |bencher| {
        bencher.iter(|| {
            time += 0.07;
            estimator.push(time, black_box(next.next().expect("a cycle never ends")))
        });
    });
}

criterion_group!(benches, position, force);
criterion_main!(benches);
