//! Readings in whole counts: a cell that toggles between two of them is not touched, and one that
//! stands still is not broken.

use taxel::acquisition::{Frame, Quantity, SignalUnit, Stimulus, Stream, Twin};
use taxel::estimation::{MapNoise, MapOptions, State, TouchSession};
use taxel::sensor::Sensor;
use taxel_numerics::Noise;

/// Frames of the rest capture with which a run begins.
const REST: usize = 50;

fn mat([rows, columns]: [usize; 2], quantity: Quantity) -> Stream {
    Stream {
        name: "mat".into(),
        rows,
        columns,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity,
            symbol: "counts".into(),
            si_per_unit: 1.0,
        },
        pitch: None,
        period: Some(0.02),
        threshold: None,
        present: vec![true; rows * columns],
    }
}

/// A raw board under a session.
struct Run {
    session: TouchSession,
    frames: u64,
    contacts: usize,
    faulty: usize,
}

impl Run {
    fn new(stream: &Stream, options: &MapOptions) -> Self {
        let mut session = TouchSession::map(stream, options);
        session.begin_unasked_rest_capture(REST);
        Self {
            session,
            frames: 0,
            contacts: 0,
            faulty: 0,
        }
    }

    fn push(&mut self, values: Vec<f64>) {
        let frame = Frame {
            sequence: self.frames,
            time_ns: self.frames * 20_000_000,
            values,
            ..Frame::default()
        };
        self.frames += 1;
        let touch = self.session.push(&frame).unwrap().touch;
        self.contacts += touch.contacts.len();
        let faulty = |taxel: &&taxel::estimation::TaxelTouch| taxel.state == State::Faulty;
        self.faulty += touch.taxels.iter().filter(faulty).count();
    }
}

/// An untouched mat: the true value of each cell lies anywhere between two counts, noise of this
/// deviation is added, and the sum is rounded.
struct Quiet {
    truth: Vec<f64>,
    deviation: f64,
    highest: f64,
    random: Noise,
}

impl Quiet {
    fn new(cells: usize, bits: u32, deviation: f64, seed: u64) -> Self {
        let mut random = Noise::seeded(seed);
        let highest = f64::from((1_u32 << bits) - 1);
        // In the lower half of the range, as of mats at rest, some at its end.
        let truth = (0..cells).map(|_| (random.normal() * highest / 8.0).abs());
        Self {
            truth: truth.collect(),
            deviation,
            highest,
            random,
        }
    }

    fn next(&mut self, pressed: Option<f64>) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.truth.len());
        for truth in &self.truth {
            let load = pressed.filter(|_| values.is_empty()).unwrap_or(0.0);
            let value = truth + load + self.deviation * self.random.normal();
            values.push(value.round().clamp(0.0, self.highest));
        }
        values
    }
}

#[test]
fn a_quiet_mat_of_any_converter_is_not_touched_and_a_finger_is_found() {
    let mut seed = 0;
    for size in [[1, 1], [1, 2], [5, 7], [12, 32], [24, 32]] {
        for bits in [6, 8, 10, 12] {
            for deviation in [0.0, 0.2, 0.5, 1.0, 2.0] {
                seed += 1;
                let case = format!("{size:?} of {bits} bits, noise {deviation}, seed {seed}");
                let mut quiet = Quiet::new(size[0] * size[1], bits, deviation, seed);
                let mut run = Run::new(&mat(size, Quantity::Counts), &MapOptions::default());
                for _ in 0..400 {
                    run.push(quiet.next(None));
                }
                assert_eq!((run.contacts, run.faulty), (0, 0), "{case}");
                // What stands out of noise is a touch: above six deviations of noise, rounding and
                // their doubt (1.23 of 50 readings), by three more that the reading itself may lack.
                let finger = (3.0 + 12.0 * deviation).max(5.0);
                run.push(quiet.next(Some(finger)));
                assert_eq!(run.contacts, 1, "{case}: {finger}");
            }
        }
    }
}

/// One hour of a mat of 8 bits, 25 frames a second: 35 million readings, and none of them a touch.
#[test]
fn a_quiet_mat_of_eight_bits_is_not_touched_in_an_hour() {
    let mut quiet = Quiet::new(384, 8, 0.4, 11);
    let mut run = Run::new(&mat([12, 32], Quantity::Counts), &MapOptions::default());
    for _ in 0..3600 * 25 {
        run.push(quiet.next(None));
    }
    assert_eq!((run.contacts, run.faulty), (0, 0));
    run.push(quiet.next(Some(5.0)));
    assert_eq!(run.contacts, 1);
}

/// The same where the noise was looked for in all frames of a recording first.
#[test]
fn a_quiet_cell_is_not_stuck_because_its_neighbours_are_noisy() {
    for noisy in [1, 40, 200] {
        let mut quiet = Quiet::new(384, 8, 0.05, 12);
        let mut random = Noise::seeded(13);
        let frames: Vec<Vec<f64>> = (0..600)
            .map(|_| {
                let mut values = quiet.next(None);
                for value in values.iter_mut().take(noisy) {
                    *value = (20.0 + 3.0 * random.normal()).round();
                }
                values
            })
            .collect();
        let mut noise = MapNoise::default();
        for (at, values) in (0..).zip(&frames) {
            noise.push(&Frame {
                sequence: at,
                time_ns: at * 20_000_000,
                values: values.clone(),
                ..Frame::default()
            });
        }
        let options = MapOptions {
            noise,
            ..MapOptions::default()
        };
        let mut run = Run::new(&mat([12, 32], Quantity::Counts), &options);
        for values in frames {
            run.push(values);
        }
        assert_eq!((run.contacts, run.faulty), (0, 0), "{noisy}");
    }
}

/// Nine floats of an inertial sensor among 251 cells of 8 bits: no kind is judged by the other.
#[test]
fn channels_of_different_kinds_are_not_compared() {
    let mut quiet = Quiet::new(251, 8, 0.05, 14);
    let mut random = Noise::seeded(15);
    let frames: Vec<Vec<f64>> = (0..600)
        .map(|_| {
            let mut values = quiet.next(None);
            values.extend((0..9).map(|axis| f64::from(axis) + 0.01 * random.normal()));
            values
        })
        .collect();
    let mut noise = MapNoise::default();
    for values in &frames {
        noise.push(&Frame {
            values: values.clone(),
            ..Frame::default()
        });
    }
    let mut kinds = vec![0; 251];
    kinds.extend([1; 9]);
    for (kinds, steps) in [
        (Vec::new(), Vec::new()),
        (kinds, [vec![1.0; 251], vec![0.0; 9]].concat()),
    ] {
        let options = MapOptions {
            noise: noise.clone(),
            kinds,
            steps,
            ..MapOptions::default()
        };
        let mut run = Run::new(&mat([1, 260], Quantity::Counts), &options);
        for values in &frames {
            run.push(values.clone());
        }
        assert_eq!((run.contacts, run.faulty), (0, 0));
        // Half a unit is fifty deviations of the floats and half a step of the cells.
        let mut pressed = frames[0].clone();
        pressed[259] += 0.5;
        pressed[0] += 1.0;
        run.push(pressed);
        assert_eq!(run.contacts, 1);
    }
}

/// Means of counts are no whole ones: there a touch may be less than two.
#[test]
fn counts_that_are_not_whole_have_no_step() {
    let mut random = Noise::seeded(16);
    let mut run = Run::new(&mat([1, 2], Quantity::Counts), &MapOptions::default());
    let mut quiet = || vec![7.5 + 0.02 * random.normal(), 3.25 + 0.02 * random.normal()];
    for _ in 0..200 {
        run.push(quiet());
    }
    assert_eq!(run.contacts, 0);
    let mut pressed = quiet();
    pressed[1] += 0.5;
    run.push(pressed);
    assert_eq!(run.contacts, 1);
}

/// A board that gives newtons in coarse steps: one step is no touch, five are.
#[test]
fn forces_in_coarse_steps_are_touched_above_two() {
    let sensor = Sensor::shipped("force-4x4").unwrap();
    let device = sensor.device().unwrap();
    let stream = Stream {
        unit: SignalUnit {
            quantity: Quantity::Force,
            symbol: "N".into(),
            si_per_unit: 1.0,
        },
        ..mat([4, 4], Quantity::Force)
    };
    let channels = 48;
    let stream = Stream {
        channels_per_taxel: 3,
        present: vec![true; channels],
        ..stream
    };
    let step = 0.4;
    // Where the steps are not known one is touch, and the noise that does not show a fault.
    for (stated, expected) in [(Some(step), [false, true]), (None, [true, false])] {
        let mut session = device.session(&stream).unwrap();
        session.set_steps(&stated.map_or(Vec::new(), |step| vec![step; channels]));
        session.begin_rest_capture(REST);
        let mut contacts = [0; 2];
        for frame in 0..200_u64 {
            let mut values = vec![0.0; channels];
            let steps = match frame {
                190.. => 5.0,
                50.. if frame % 10 == 0 => 1.0,
                _ => 0.0,
            };
            values[channels - 1] = steps * step;
            let frame = Frame {
                sequence: frame,
                time_ns: frame * 20_000_000,
                values,
                ..Frame::default()
            };
            let found = session.push(&frame).unwrap().touch.contacts.len();
            contacts[usize::from(frame.sequence >= 190)] += found;
        }
        assert_eq!(
            contacts.map(|contacts| contacts > 0),
            expected,
            "{stated:?}"
        );
    }
}

/// A mat whose readings fall when it is pressed.
#[test]
fn readings_that_fall_under_pressure_are_pressed() {
    let options = MapOptions {
        falls: true,
        ..MapOptions::default()
    };
    let mut quiet = Quiet::new(16, 10, 0.3, 17);
    quiet.truth[0] = 300.0;
    let mut run = Run::new(&mat([4, 4], Quantity::Counts), &options);
    for _ in 0..200 {
        run.push(quiet.next(None));
    }
    run.push(quiet.next(Some(40.0)));
    assert_eq!(run.contacts, 0);
    run.push(quiet.next(Some(-40.0)));
    assert_eq!(run.contacts, 1);
    // Within a count of rounding at each end and four of noise.
    assert!((run.session.estimator().touch().taxels[0].pressed() - 40.0).abs() < 3.0);
}

/// Which shipped sensors state a larger deviation because a reading is no surer than a third of a step:
/// `cargo test -p taxel --test all shipped_boards_of_coarse_steps -- --nocapture`.
#[test]
#[allow(clippy::print_stdout, reason = "the list is what is asked for")]
fn shipped_boards_of_coarse_steps_state_at_most_a_sixth_more() {
    for name in Sensor::shipped_names() {
        let sensor = Sensor::shipped(name).unwrap();
        let device = sensor.device().unwrap();
        let script = Stimulus::parse("press", Stimulus::shipped_text("press").unwrap()).unwrap();
        // A body that is not trained has no twin.
        let Ok(twin) = Twin::new(&sensor, &script, 1) else {
            continue;
        };
        let reader = device.reader(&twin.stream()).unwrap();
        let grows =
            |facts: &taxel::estimation::ChannelFacts| facts.resolution / 3.0 / facts.deviation;
        let most = reader.channels().iter().map(grows).fold(0.0, f64::max);
        if most > 1.0 {
            println!("{name}: {most:.3} times");
        }
        // A third of a step over rounding alone, which is 1/√12 of it.
        assert!(most < 12.0_f64.sqrt() / 3.0 + 1e-12, "{name}: {most}");
    }
}
