//! Trained maps on the sample recordings of a printed lattice (see the `README.md` beside them).
#![allow(clippy::unwrap_used)]

use taxel::trained::{MemoryLaw, PositionEstimator, Support};
use taxel_calibrate::training::{
    ForceOptions, Nearest, PositionOptions, Score, Series, Session, train_force, train_position,
};

fn session(sensor: &str, stage: &str) -> Session {
    let sensor = Series::parse("sensor.csv", sensor).unwrap();
    Session::new(
        "states.csv",
        sensor,
        &Series::parse("states.csv", stage).unwrap(),
    )
    .unwrap()
}

fn position_run() -> Session {
    session(
        include_str!("../../taxel-recording/tests/recordings/lattice/position_sensor.csv"),
        include_str!("../../taxel-recording/tests/recordings/lattice/position_states.csv"),
    )
}

fn force_run() -> Session {
    session(
        include_str!("../../taxel-recording/tests/recordings/lattice/force_sensor.csv"),
        include_str!("../../taxel-recording/tests/recordings/lattice/force_states.csv"),
    )
}

#[test]
fn places_of_the_last_pass_are_found_better_than_by_neighbours() {
    let run = position_run();
    let frames = run.sensor.rows();
    let places: Vec<[f64; 2]> = run
        .place
        .rows()
        .iter()
        .map(|row| [row[0], row[1]])
        .collect();
    let train = frames.len() * 4 / 5;
    let options = [0.0, 0.25].map(|run_in| PositionOptions {
        smoothing: 1e-4,
        run_in,
        ..PositionOptions::default()
    });
    let (map, _) = train_position(&frames[..train], &places[..train], &options).unwrap();
    let targets: Vec<Vec<f64>> = places.iter().map(|p| p.to_vec()).collect();
    let nearest = Nearest::train(&frames[..train], &targets[..train], 5).unwrap();
    let mut estimator = PositionEstimator::new(map).unwrap();
    let (mut errors, mut deviations, mut neighbours) = (Vec::new(), Vec::new(), Vec::new());
    let mut outside = 0;
    for (frame, place) in frames[train..].iter().zip(&places[train..]) {
        let estimate = estimator.estimate(frame).unwrap();
        outside += usize::from(estimate.support == Support::Outside);
        for (axis, truth) in place.iter().enumerate() {
            errors.push(estimate.position[axis] - truth);
            deviations.push(estimate.deviation()[axis]);
            neighbours.push(nearest.estimate(frame).unwrap()[axis][0] - truth);
        }
    }
    // Each pass creeps a little beyond those before it.
    assert!(outside * 20 <= frames.len() - train, "{outside} outside");
    let score = Score::of(&errors, &deviations);
    let yardstick = Score::of(&neighbours, &deviations);
    assert!(score.rms < 0.8 * yardstick.rms, "{score:?} {yardstick:?}");
    // 242 errors of one pass move together: more than chance alone.
    assert!(score.coverage > 0.88, "{score:?}");
}

#[test]
fn memory_lowers_the_error_of_the_force() {
    let run = force_run();
    let options = |times: &[f64]| ForceOptions {
        memory: MemoryLaw {
            creep_times: times.to_vec(),
            play_thresholds: Vec::new(),
        },
        prior: 0.3,
        blocks: 3,
        learned_from: 0.4,
        ..ForceOptions::default()
    };
    let (_, without) = train_force(std::slice::from_ref(&run), &options(&[])).unwrap();
    let (_, with) = train_force(std::slice::from_ref(&run), &options(&[1.5, 15.0, 60.0])).unwrap();
    // The body relaxes by a tenth of its force within a cycle, at the times that are given here.
    assert!(with.rms < 0.9 * without.rms, "{with:?} {without:?}");
    assert!(
        with.log_likelihood > without.log_likelihood,
        "{with:?} {without:?}"
    );
}

#[test]
fn the_start_of_a_run_is_its_baseline() {
    let run = force_run();
    let baseline = run.baseline();
    assert_eq!(baseline.len(), 15);
    for (mean, first) in baseline.iter().zip(&run.sensor.rows()[0]) {
        // Noise of the magnetometers.
        assert!((mean - first).abs() < 20.0);
    }
}
