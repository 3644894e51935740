//! Trained maps against closed forms, brute force and invariances.
#![allow(clippy::unwrap_used)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use taxel::trained::{
    Block, FeatureStream, ForceEstimator, ForceMap, GaussianProcess, Kernel, PositionEstimator,
    Standard, Support, TrainingError,
};
use taxel_calibrate::training::{
    NORMAL_95, PositionOptions, Series, Session, TrainedForces, delay_of_scale, train_forces,
    train_position,
};

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

#[test]
fn a_process_of_two_observations_is_the_closed_form() {
    let kernel = Kernel {
        deviation: 1.3,
        length: 0.8,
        slope: 0.4,
        noise: 0.2,
    };
    let inputs = [vec![0.0], vec![1.0]];
    let process = GaussianProcess::observe(kernel, &inputs, &[vec![2.0], vec![-1.0]]).unwrap();
    let k = |a: f64, b: f64| {
        let r = 5f64.sqrt() * (a - b).abs() / 0.8;
        1.69 * (1.0 + r + r * r / 3.0) * (-r).exp() + 0.16 * a * b
    };
    let (a, b, d) = (k(0.0, 0.0) + 0.04, k(0.0, 1.0), k(1.0, 1.0) + 0.04);
    let determinant = a * d - b * b;
    let inverse = [
        [d / determinant, -b / determinant],
        [-b / determinant, a / determinant],
    ];
    let near = [k(0.0, 0.3), k(1.0, 0.3)];
    let weights = [0, 1].map(|i| inverse[i][0] * near[0] + inverse[i][1] * near[1]);
    let (mean, variance) = process.estimate(&[0.3]);
    assert!((mean[0] - (0.5 + 1.5 * weights[0] - 1.5 * weights[1])).abs() < 1e-12);
    let known = weights[0] * near[0] + weights[1] * near[1];
    assert!((variance - (k(0.3, 0.3) + 0.04 - known)).abs() < 1e-12);
    let fit = 2.25 * (inverse[0][0] - 2.0 * inverse[0][1] + inverse[1][1]);
    let expected = -0.5 * (fit + determinant.ln()) - (2.0 * std::f64::consts::PI).ln();
    assert!((process.log_likelihood() - expected).abs() < 1e-12);
}

/// A body of two dimensions seen by `channels` smooth channels.
fn answer(place: [f64; 2], channels: usize) -> Vec<f64> {
    let centre = |c: usize| [(c % 3) as f64 * 5e-3, (c / 3) as f64 * 5e-3];
    (0..channels)
        .map(|c| {
            let [x, y] = centre(c);
            let r2 = (place[0] - x).powi(2) + (place[1] - y).powi(2);
            100.0 + 40.0 * (-r2 / 7e-3f64.powi(2)).exp()
        })
        .collect()
}

/// Four passes over a grid of 1 mm, with noise of one unit in each channel.
fn passes(noise: f64, seed: u64) -> (Vec<Vec<f64>>, Vec<[f64; 2]>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..4 * 121)
        .map(|k| {
            let place = [f64::from(k / 11 % 11) * 1e-3, f64::from(k % 11) * 1e-3];
            let frame = answer(place, 9);
            let noisy = frame.iter().map(|v| v + noise * normal(&mut random));
            (noisy.collect::<Vec<f64>>(), place)
        })
        .unzip()
}

const OPTIONS: [PositionOptions; 1] = [PositionOptions {
    smoothing: 1e-2,
    run_in: 0.0,
    fading: f64::INFINITY,
    spacing: 1.0,
    depths: 0,
}];

#[test]
fn places_between_those_of_training_are_found() {
    let (frames, places) = passes(0.0, 1);
    let (map, _) = train_position(
        &frames,
        &places,
        &[PositionOptions {
            smoothing: 1e-9,
            run_in: 0.0,
            ..PositionOptions::default()
        }],
    )
    .unwrap();
    let mut estimator = PositionEstimator::new(map).unwrap();
    for place in [[2.3e-3, 7.6e-3], [5.5e-3, 5.5e-3], [9.7e-3, 0.4e-3]] {
        let estimate = estimator.estimate(&answer(place, 9)).unwrap();
        for (axis, truth) in place.iter().enumerate() {
            // Cubic splines of 1 mm on bells of 7 mm: (1/7)⁴ of their height.
            assert!(
                (estimate.position[axis] - truth).abs() < 5e-6,
                "{estimate:?}"
            );
        }
    }
}

#[test]
fn intervals_of_places_cover_what_they_claim() {
    let (frames, places) = passes(1.0, 2);
    let (map, _) = train_position(&frames, &places, &OPTIONS).unwrap();
    let mut estimator = PositionEstimator::new(map).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut covered = 0;
    for _ in 0..1000 {
        // Away from the edge, where the search stops at it.
        let place = [0, 1].map(|_| 1e-3 + 8e-3 * random.random::<f64>());
        let frame: Vec<f64> = answer(place, 9)
            .iter()
            .map(|v| v + normal(&mut random))
            .collect();
        let estimate = estimator.estimate(&frame).unwrap();
        covered += (0..2)
            .filter(|a| {
                let error = (estimate.position[*a] - place[*a]).abs();
                error <= NORMAL_95 * estimate.deviation()[*a]
            })
            .count();
    }
    // 1900 ± 10 by chance, and as much again from the factor, which is itself
    // the quantile of 242 errors.
    assert!((1860..=1940).contains(&covered), "{covered} of 2000");
}

#[test]
fn a_frame_unlike_training_is_outside_and_uncertain() {
    let (frames, places) = passes(1.0, 4);
    let (map, _) = train_position(&frames, &places, &OPTIONS).unwrap();
    let mut estimator = PositionEstimator::new(map).unwrap();
    let inside = estimator.estimate(&frames[60]).unwrap();
    assert_eq!(inside.support, Support::Trained);
    let rest = estimator.estimate(&[100.0; 9]).unwrap();
    assert_eq!(rest.support, Support::Outside);
    assert!(rest.deviation()[0] > 3.0 * inside.deviation()[0]);
    let far = estimator.estimate(&[1e12; 9]).unwrap();
    // At most the size of the rectangle, and finite.
    assert!(far.deviation()[0] <= 10.01e-3 && far.position[0].is_finite());
}

/// Presses beside the area that training pressed: no place is stated that does not hold them.
#[test]
fn a_press_beside_the_trained_area_gets_no_false_place() {
    let (frames, places) = passes(0.2, 5);
    let inner = |place: &[f64; 2]| place.iter().all(|x| (2.5e-3..7.5e-3).contains(x));
    let (trained, known): (Vec<_>, Vec<_>) = frames
        .iter()
        .cloned()
        .zip(places.iter().copied())
        .filter(|(_, place)| inner(place))
        .unzip();
    let (map, _) = train_position(&trained, &known, &OPTIONS).unwrap();
    let mut estimator = PositionEstimator::new(map).unwrap();
    // Of presses inside and of those 1 mm or more outside: all, those said to be outside, and those
    // with a place that is not held.
    let mut counts = [[0.0; 3]; 2];
    for (frame, place) in passes(0.2, 6).0.iter().zip(&places) {
        let found = estimator.estimate(frame).unwrap();
        let outside = found.support == Support::Outside;
        let off = found.position.iter().zip(place).zip(found.deviation());
        let mut off = off.map(|((a, b), deviation)| (a - b).abs() / deviation);
        let held = off.all(|ratio| ratio <= 1.96);
        let [all, flagged, wrong] = &mut counts[usize::from(!inner(place))];
        *all += 1.0;
        *flagged += f64::from(u8::from(outside));
        *wrong += f64::from(u8::from(!outside && !held));
    }
    let shares = counts.map(|[all, flagged, wrong]| [flagged / all, wrong / all]);
    let [[flagged_inside, _], [flagged_outside, wrong]] = shares;
    assert!(
        flagged_inside < 0.02 && flagged_outside > 0.8 && wrong < 0.06,
        "{shares:?}"
    );
}

/// `map` as text and back, at rounding of the decimal numbers.
fn through_text<T: serde::Serialize + serde::de::DeserializeOwned>(map: &T) -> T {
    serde_json::from_str(&serde_json::to_string(map).unwrap()).unwrap()
}

#[test]
fn maps_survive_a_file() {
    let (frames, places) = passes(1.0, 5);
    let (map, _) = train_position(&frames, &places, &OPTIONS).unwrap();
    let again = PositionEstimator::new(through_text(&map))
        .unwrap()
        .estimate(&frames[17]);
    let before = PositionEstimator::new(map)
        .unwrap()
        .estimate(&frames[17])
        .unwrap();
    let again = again.unwrap();
    assert!((again.position[0] - before.position[0]).abs() < 1e-12);
    assert!((again.deviation()[1] / before.deviation()[1] - 1.0).abs() < 1e-9);
    let session = cycles(3, 0.0);
    let map = trained(&session).map;
    let of = |map: ForceMap| {
        let mut live = ForceEstimator::new(map, session.baseline()).unwrap();
        live.push(1.0, &session.sensor.rows()[400]).unwrap()
    };
    let (again, before) = (of(through_text(&map)), of(map.clone()));
    assert!((again.value - before.value).abs() < 1e-9);
    assert!((again.deviation / before.deviation - 1.0).abs() < 1e-9);
}

#[test]
fn a_map_changed_by_hand_is_refused() {
    let (frames, places) = passes(1.0, 8);
    let (mut map, _) = train_position(&frames, &places, &OPTIONS).unwrap();
    map.surface.intervals[0] = 0;
    let found = PositionEstimator::new(map).err();
    assert_eq!(found, Some(TrainingError::Unsound { table: "surface" }));
    let session = cycles(3, 0.0);
    let map = trained(&session).map;
    let refused = |change: &dyn Fn(&mut ForceMap)| {
        let mut map = map.clone();
        change(&mut map);
        ForceEstimator::new(map, session.baseline()).err()
    };
    for (table, change) in [
        (
            "law",
            &(|map: &mut ForceMap| map.law.times.clear()) as &dyn Fn(&mut ForceMap),
        ),
        ("pressing", &|map| {
            map.pressing.members[1].weights.truncate(3);
        }),
        ("slow_reach", &|map| map.slow_reach.push(1.0)),
        ("farthest", &|map| map.farthest = 0.0),
    ] {
        assert_eq!(refused(change), Some(TrainingError::Unsound { table }));
    }
}

#[test]
fn a_dead_or_missing_channel_is_named() {
    let (mut frames, places) = passes(1.0, 6);
    for frame in &mut frames {
        frame[4] = 100.0;
    }
    let (map, _) = train_position(&frames, &places, &OPTIONS).unwrap();
    assert_eq!(map.standard.left_out(), [5]);
    let mut estimator = PositionEstimator::new(map).unwrap();
    let mut frame = frames[7].clone();
    frame[4] = f64::NAN;
    assert!(estimator.estimate(&frame).is_ok());
    frame[2] = f64::NAN;
    assert_eq!(
        estimator.estimate(&frame),
        Err(TrainingError::Dead { channel: 3 })
    );
    assert_eq!(
        estimator.estimate(&frame[..8]),
        Err(TrainingError::Channels {
            found: 8,
            expected: 9
        })
    );
}

/// Cycles of a probe on a body that creeps: three channels, a scale.
fn cycles(count: usize, delay: f64) -> Session {
    let depth = |t: f64| (0.5 - 0.5 * (t * 0.3).cos()) * f64::from(u8::from(t > 0.0));
    let (mut slow, mut last) = (0.0, 0.0);
    let (mut sensor, mut stage) = (Vec::new(), Vec::new());
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let times: Vec<f64> = (0..count * 300).map(|i| i as f64 * 0.07 - 2.0).collect();
    let mut forces = Vec::new();
    for time in &times {
        let z = depth(*time) * (1.0 + 0.1 * (time * 0.07).sin());
        slow += (z - slow) * (1.0 - (-(time - last) / 3.0f64).exp());
        last = *time;
        forces.push(10.0 * z + 5.0 * z * z + 4.0 * (z - slow));
        let channels = [100.0 * z, 50.0 * z * z, 20.0 * z - 30.0];
        sensor.push(
            channels
                .iter()
                .map(|c| c + 0.01 * normal(&mut random))
                .collect(),
        );
    }
    let force = Series::new(times.clone(), forces.iter().map(|f| vec![*f]).collect()).unwrap();
    for time in &times {
        let newtons = force.at(time - delay, 100.0).unwrap()[0];
        let grams = newtons / 9.80665e-3;
        stage.push(vec![1.0, 2.0, 10.0 - depth(*time), grams]);
    }
    let sensor = Series::new(times.clone(), sensor).unwrap();
    Session::new("stage", sensor, &Series::new(times, stage).unwrap()).unwrap()
}

fn trained(session: &Session) -> TrainedForces {
    train_forces(std::slice::from_ref(session), 0.0, true).unwrap()
}

#[test]
fn creep_of_the_body_is_learned() {
    // One run does not show what the next one has in common with it.
    let found = train_forces(&[cycles(6, 0.0), cycles(5, 0.0)], 0.0, true).unwrap();
    let alone = |memory: bool| {
        let maps = found.candidates[0].iter();
        let slow = |block: &Block| matches!(block, Block::Slow | Block::SlowSums);
        let maps = maps.filter(|one| one.blocks.iter().any(slow) == memory);
        maps.map(|one| one.error).fold(f64::INFINITY, f64::min)
    };
    // The body keeps 4 N of a fast press back; noise is 0.01 in channels of 0.1 N each unit.
    let (with, without) = (alone(true), alone(false));
    assert!(with < 0.1 * without, "{with} {without}");
    let rms = found.held_out[0].score().rms;
    // Live follows the zero, too.
    assert!(rms < 0.1 * without, "{rms} {without}");
}

#[test]
fn a_late_scale_is_noticed() {
    let found = |delay| delay_of_scale(&[cycles(6, delay)]).unwrap();
    // A map with memory makes up for a little; of more it notices that the scale is late, and
    // the creep of the body turns the phase on by up to 0.3 s.
    for (delay, least) in [(0.0, 0.0), (0.4, 0.0), (1.2, 1.0)] {
        let found = found(delay);
        assert!(
            (least..=1.26 * delay).contains(&found),
            "{delay} s: {found} s"
        );
    }
}

#[test]
fn the_estimator_repeats_what_training_did() {
    let session = cycles(4, 0.0);
    let map = trained(&session).map;
    let mut stream = FeatureStream::new(&map.law, session.baseline(), map.longest_step);
    let mut live = ForceEstimator::new(map.clone(), session.baseline()).unwrap();
    for (time, frame) in session.sensor.times().iter().zip(session.sensor.rows()) {
        let estimate = live.push(*time, frame).unwrap();
        stream
            .push((&map.standard, &map.law), *time, frame)
            .unwrap();
        let [value, difference] = map.pressing.estimate(&map.law, stream.features());
        assert_eq!(estimate.value, value.max(map.pressing.range[0]));
        let deviation = map.pressing.deviation(estimate.value, difference);
        assert_eq!(estimate.deviation, deviation);
    }
}

#[test]
fn after_an_outage_the_deviation_is_larger_until_it_has_faded() {
    let session = cycles(6, 0.0);
    let runs = [session.clone(), cycles(5, 0.0)];
    let map = train_forces(&runs, 0.0, true).unwrap().map;
    let (times, frames) = (session.sensor.times(), session.sensor.rows());
    let deviations = |outage: std::ops::Range<usize>| {
        let mut live = ForceEstimator::new(map.clone(), session.baseline()).unwrap();
        let seen = (0..1500).filter(|at| !outage.contains(at));
        let of = |at: usize| (at, live.push(times[at], &frames[at]).unwrap().deviation);
        seen.map(of).collect::<Vec<_>>()
    };
    // The deviation also grows with the force: that of the same frames without an outage is what fades to.
    let (with, without) = (deviations(500..600), deviations(0..0));
    let ratio = |at: usize| {
        let (_, own) = with.iter().find(|(other, _)| *other == at).unwrap();
        own / without[at].1
    };
    assert!(ratio(600) > 3.0, "{}", ratio(600));
    // 60 s are twenty times the time of creep.
    assert!((ratio(1490) - 1.0).abs() < 0.5, "{}", ratio(1490));
}

#[test]
fn a_force_beyond_training_is_outside() {
    let session = cycles(4, 0.0);
    let map = trained(&session).map;
    let mut live = ForceEstimator::new(map, session.baseline()).unwrap();
    assert_eq!(
        live.push(0.0, &session.baseline()).unwrap().support,
        Support::Trained
    );
    let estimate = live.push(0.1, &[900.0, -700.0, 3000.0]).unwrap();
    assert_eq!(estimate.support, Support::Outside);
    assert!(estimate.deviation > 1.0 && estimate.deviation.is_finite());
    assert!(ForceEstimator::new(live.map().clone(), vec![0.0; 2]).is_err());
}

#[test]
fn a_scale_of_one_kind_of_channel_only_is_no_matter() {
    // The same frames in other units give the same map.
    let (frames, places) = passes(1.0, 7);
    let scaled: Vec<Vec<f64>> = frames
        .iter()
        .map(|f| {
            f.iter()
                .enumerate()
                .map(|(c, v)| v * 10f64.powf(c as f64 - 4.0) - 3.0)
                .collect()
        })
        .collect();
    let estimate = |frames: &[Vec<f64>]| {
        let (map, _) = train_position(frames, &places, &OPTIONS).unwrap();
        PositionEstimator::new(map)
            .unwrap()
            .estimate(&frames[30])
            .unwrap()
            .position
    };
    let (a, b) = (estimate(&frames), estimate(&scaled));
    assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9);
    assert_eq!(Standard::of(&frames).unwrap().used.len(), 9);
}
