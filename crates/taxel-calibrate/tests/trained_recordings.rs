//! Trained maps on the sample recordings of a printed lattice (see the `README.md` beside them).
#![allow(clippy::unwrap_used)]

use taxel::trained::{Block, PositionEstimator, Standard, Support};
use taxel_calibrate::training::{
    PositionOptions, Score, Series, Session, train_forces, train_position,
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
    // The mean of the five nearest frames, over the deviations of their channels.
    let standard = Standard::of(&frames[..train]).unwrap();
    let scaled: Vec<Vec<f64>> = frames
        .iter()
        .map(|frame| standard.apply(frame).unwrap())
        .collect();
    let nearest = |row: usize| -> [f64; 2] {
        let far = |other: &usize| -> f64 {
            scaled[row]
                .iter()
                .zip(&scaled[*other])
                .map(|(a, b)| (a - b).powi(2))
                .sum()
        };
        let mut others: Vec<usize> = (0..train).collect();
        others.sort_by(|a, b| far(a).total_cmp(&far(b)));
        [0, 1].map(|axis| others[..5].iter().map(|at| places[*at][axis]).sum::<f64>() / 5.0)
    };
    let mut estimator = PositionEstimator::new(map).unwrap();
    let (mut errors, mut deviations, mut neighbours) = (Vec::new(), Vec::new(), Vec::new());
    let mut outside = 0;
    for (row, (frame, place)) in (train..).zip(frames[train..].iter().zip(&places[train..])) {
        let yardstick = nearest(row);
        let estimate = estimator.estimate(frame).unwrap();
        outside += usize::from(estimate.support == Support::Outside);
        for (axis, truth) in place.iter().enumerate() {
            errors.push(estimate.position[axis] - truth);
            deviations.push(estimate.deviation()[axis]);
            neighbours.push(yardstick[axis] - truth);
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
    let found = train_forces(std::slice::from_ref(&run), 0.0, true).unwrap();
    let alone = |memory: bool| {
        let maps = found.candidates[0].iter();
        let slow = |block: &Block| matches!(block, Block::Slow | Block::SlowSums);
        let maps = maps.filter(|one| one.blocks.iter().any(slow) == memory);
        maps.map(|one| one.error).fold(f64::INFINITY, f64::min)
    };
    // The body relaxes by a tenth of its force within a cycle.
    let (with, without) = (alone(true), alone(false));
    assert!(with < 0.9 * without, "{with} {without}");
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
