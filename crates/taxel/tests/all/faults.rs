//! Devices by faults: what holds for one device holds for all.
//!
//! One channel of each device is dead, stuck or masked while another taxel is pressed.
//! The tare works, the channel is faulty (or masked) and never saturated, and what is
//! pressed elsewhere reads as on the sound device, or says why not.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use taxel::acquisition::{Delivery, Frame, Quantity, SignalUnit, Stimulus, Stream, Twin};
use taxel::estimation::{
    ArrayEstimator, ChannelState, MapNoise, MapReader, RestRefused, State, Touch,
};
use taxel::sensor::Sensor;

/// Frames of the rest capture, as in the paper.
const REST_FRAMES: usize = 50;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    None,
    /// Code zero: an open line.
    Dead,
    /// The highest code: a short circuit, or an open lead of a divider.
    AtEnd,
    /// No reading.
    Missing,
    /// The first reading again and again.
    Stuck,
    /// Dead, and masked in the sensor file.
    Masked,
}

/// One device in use.
struct Case {
    sensor: &'static str,
    /// The taxel that is pressed at [`Case::pressed_at`], and with what, N.
    taxel: [usize; 2],
    force: &'static str,
    /// The value of that taxel, N or Pa.
    value: f64,
    /// The channel with the fault, and the masks that take it out.
    channel: usize,
    masks: &'static [[usize; 2]],
    /// Taxels that read from that channel.
    taxels: &'static [usize],
    /// Time at which the touch is looked at, s: behind the capture, and long
    /// enough after the begin for a channel that stands still to be seen.
    looked_at: f64,
}

const CASES: [Case; 4] = [
    Case {
        sensor: "three-axis-8x8",
        taxel: [4, 4],
        force: "8 mN",
        value: 8e-3,
        channel: 0,
        masks: &[[0, 0]],
        taxels: &[0],
        looked_at: 3.0,
    },
    // Of the array below: shipped ones have one taxel.
    Case {
        sensor: "in-plane-50um",
        taxel: [1, 1],
        force: "4 N",
        value: 4.0,
        channel: 0,
        masks: &[[0, 0]],
        taxels: &[0],
        looked_at: 3.0,
    },
    Case {
        sensor: "piezo-1.5mm",
        taxel: [1, 3],
        force: "0.2 N",
        value: 0.2,
        channel: 0,
        masks: &[[0, 0]],
        taxels: &[0],
        looked_at: 2.05,
    },
    // Channel 5 is column 3, which pad b does not press.
    Case {
        sensor: "liquid-metal-2x4",
        taxel: [0, 1],
        force: "3.78 mN",
        value: 10_500.0,
        channel: 5,
        masks: &[[0, 3], [1, 3]],
        taxels: &[3, 7],
        looked_at: 3.0,
    },
];

impl Case {
    fn sensor(&self, fault: Fault) -> Sensor {
        let mut text = Sensor::shipped_text(self.sensor).unwrap().to_owned();
        if self.sensor.starts_with("in-plane") {
            text = text
                .replace("rows = 1", "rows = 2")
                .replace("columns = 1", "columns = 2");
        }
        if fault == Fault::Masked {
            for [row, column] in self.masks {
                write!(text, "\n[[mask]]\ntaxel = [{row}, {column}]\n").unwrap();
            }
        }
        Sensor::parse("case.toml", &text).unwrap()
    }

    fn pressed(&self) -> usize {
        let columns = if self.sensor.starts_with("in-plane") {
            2
        } else {
            self.columns()
        };
        self.taxel[0] * columns + self.taxel[1]
    }

    fn columns(&self) -> usize {
        Sensor::shipped(self.sensor).unwrap().array.columns
    }

    /// Touch under the press, and the end of the rest capture before it.
    fn run(&self, fault: Fault) -> (Touch, Result<(), RestRefused>) {
        let sensor = self.sensor(fault);
        let nothing = "force = [\"0 N\", \"0 N\", \"0 N\"] }";
        let held = format!("force = [\"0 N\", \"0 N\", \"{}\"] }}", self.force);
        let script = format!(
            "schema = 1\nname = \"press\"\nduration = \"20 s\"\n[[probe]]\ntaxel = {:?}\npath = [\n\
             {{ time = \"1.8 s\", {nothing}, {{ time = \"2 s\", {held}, {{ time = \"9 s\", {held}]\n",
            self.taxel
        );
        let stimulus = Stimulus::parse("press", &script).unwrap();
        let mut twin = Twin::new(&sensor, &stimulus, 5).unwrap();
        let device = sensor.device().unwrap();
        let mut estimator = ArrayEstimator::new(device.reader(&twin.stream()).unwrap());
        estimator.begin_rest_capture(REST_FRAMES);
        let highest = estimator.channels()[self.channel].span[1];
        let (mut stuck, mut rest) = (None, None);
        loop {
            let Delivery::Frame(mut frame) = twin.next_delivery() else {
                continue;
            };
            let reading = &mut frame.values[self.channel];
            match fault {
                Fault::None => {}
                Fault::Dead | Fault::Masked => *reading = 0.0,
                Fault::AtEnd => *reading = highest,
                Fault::Missing => *reading = f64::NAN,
                Fault::Stuck => *reading = *stuck.get_or_insert(*reading),
            }
            let (touch, captured) = estimator.push(&frame).unwrap();
            let touch = touch.clone();
            rest = captured.or(rest);
            if frame.time_ns as f64 * 1e-9 >= self.looked_at {
                return (touch, rest.unwrap());
            }
        }
    }
}

#[test]
fn a_broken_channel_blocks_nothing_and_biases_nothing() {
    for case in &CASES {
        let name = case.sensor;
        let (sound, rest) = case.run(Fault::None);
        assert_eq!(rest, Ok(()), "{name}");
        let pressed = case.pressed();
        let truth = sound.taxels[pressed];
        assert_eq!(truth.state, State::Ok, "{name}: {truth:?}");
        assert!(
            truth.pressed() > 6.0 * truth.pressed_deviation(),
            "{name}: {truth:?}"
        );
        for fault in [
            Fault::Dead,
            Fault::AtEnd,
            Fault::Missing,
            Fault::Stuck,
            Fault::Masked,
        ] {
            let what = format!("{name}, {fault:?}");
            let (touch, rest) = case.run(fault);
            assert_eq!(rest, Ok(()), "{what}");
            let (channel, expected) = match fault {
                Fault::Masked => (ChannelState::Masked, State::Masked),
                _ => (ChannelState::Faulty, State::Faulty),
            };
            let mut states = touch.channels.states.clone();
            assert_eq!(states.remove(case.channel), channel, "{what}");
            // A masked taxel of three axes masks its four capacitors.
            let others = states
                .iter()
                .filter(|state| **state != ChannelState::Masked);
            assert!(
                others.clone().all(|state| *state == ChannelState::Ok),
                "{what}: {states:?}"
            );
            for taxel in case.taxels {
                let state = touch.taxels[*taxel].state;
                // Where a second channel reads nothing, nothing touches.
                let quiet = name.starts_with("liquid") && fault != Fault::Masked && *taxel == 7;
                let expected = if quiet { State::Ok } else { expected };
                assert_eq!(state, expected, "{what}: taxel {taxel}");
            }
            assert!(
                touch
                    .taxels
                    .iter()
                    .all(|taxel| taxel.state != State::Saturated),
                "{what}"
            );
            let found = touch.taxels[pressed];
            assert_eq!(found.state, State::Ok, "{what}: {found:?}");
            // As the sound device, or nearer to the truth: of two crossing
            // channels that scatter, the mean of both is no better than one.
            let near = |value: f64| (found.pressed() - value).abs();
            let off = near(truth.pressed()).min(near(case.value));
            let bound = 4.0 * found.pressed_deviation().max(truth.pressed_deviation());
            assert!(
                off < bound,
                "{what}: {} instead of {}",
                found.pressed(),
                truth.pressed()
            );
            assert_eq!(touch.contacts.len(), 1, "{what}");
            assert_eq!(touch.contacts[0].peak_taxel, pressed, "{what}");
        }
    }
}

#[test]
fn the_reading_of_pad_b_survives_a_dead_channel() {
    let case = &CASES[3];
    let (touch, _) = case.run(Fault::Dead);
    let taxel = touch.taxels[case.pressed()];
    // 3.78 mN on 0.36 mm2 are 10.5 kPa.
    let deviation = taxel.pressed_deviation();
    assert!(
        (taxel.pressed() - 10_500.0).abs() < 3.0 * deviation + 30.0,
        "{} +- {deviation} Pa",
        taxel.pressed()
    );
    // A touch on the dead column cannot be excluded: no total.
    assert_eq!(touch.taxels[3].state, State::Faulty);
    assert_eq!(touch.pressing_force(), None);
}

/// With row 1 masked a touch is read from row 0 alone, which is at the end of its curve:
/// a bound, in every frame, and no total.
#[test]
fn a_bound_is_called_one_whatever_the_noise() {
    let mut text = Sensor::shipped_text("liquid-metal-2x4").unwrap().to_owned();
    for column in 0..4 {
        write!(text, "\n[[mask]]\ntaxel = [1, {column}]\n").unwrap();
    }
    let sensor = Sensor::parse("masked.toml", &text).unwrap();
    let script = Stimulus::shipped_text("pad-b").unwrap();
    let mut twin = Twin::new(&sensor, &Stimulus::parse("pad-b", script).unwrap(), 1).unwrap();
    let reader = sensor.device().unwrap().reader(&twin.stream()).unwrap();
    let mut estimator = ArrayEstimator::new(reader);
    estimator.begin_rest_capture(REST_FRAMES);
    let (mut bounds, mut frames) = (0, 0);
    while frames < 400 {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        frames += 1;
        let (touch, _) = estimator.push(&frame).unwrap();
        let taxel = touch.taxels[1];
        if frames > 300 {
            assert_eq!(taxel.state, State::Saturated, "frame {frames}: {taxel:?}");
            assert!(taxel.pressed() > 7_000.0, "frame {frames}: {taxel:?}");
            bounds += 1;
        }
    }
    assert!(bounds > 50, "{bounds}");
}

/// Without a taxel that counts there is no total: not even zero.
#[test]
fn nothing_that_counts_has_no_total() {
    let mut text = Sensor::shipped_text("in-plane-50um").unwrap().to_owned();
    text.push_str("\n[[mask]]\ntaxel = [0, 0]\n");
    let sensor = Sensor::parse("masked.toml", &text).unwrap();
    let script = Stimulus::shipped_text("press").unwrap();
    let mut twin = Twin::new(&sensor, &Stimulus::parse("press", script).unwrap(), 1).unwrap();
    let reader = sensor.device().unwrap().reader(&twin.stream()).unwrap();
    let mut estimator = ArrayEstimator::new(reader);
    let frame =
        std::iter::repeat_with(|| twin.next_delivery()).find_map(|delivery| match delivery {
            Delivery::Frame(frame) => Some(frame),
            Delivery::Nothing(_) => None,
        });
    let (touch, _) = estimator.push(&frame.unwrap()).unwrap();
    assert_eq!(touch.left_out, 1);
    assert_eq!(touch.pressing_force(), None);
    assert!(touch.total_covariance[2][2].is_nan());
}

#[test]
fn a_map_shows_a_missing_sensel_as_faulty_and_an_absent_one_as_masked() {
    let stream = Stream {
        name: String::new(),
        rows: 1,
        columns: 4,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity: Quantity::Pressure,
            symbol: "kPa".into(),
            si_per_unit: 1e3,
        },
        pitch: Some([5e-3, 5e-3]),
        period: None,
        threshold: None,
        present: vec![true, true, false, true],
    };
    let mut estimator =
        ArrayEstimator::new(Box::new(MapReader::new(&stream, &MapNoise::default())));
    estimator.begin_rest_capture(3);
    let mut ended = None;
    for sequence in 0..4 {
        let pressed = if sequence == 3 { 5e3 } else { 0.0 };
        let frame = Frame {
            sequence,
            time_ns: sequence * 1_000_000,
            values: vec![1e3 + pressed, f64::NAN, f64::NAN, 2e3],
            ..Frame::default()
        };
        ended = estimator.push(&frame).unwrap().1.or(ended);
    }
    assert_eq!(ended, Some(Ok(())));
    let touch = estimator.touch();
    let states: Vec<State> = touch.taxels.iter().map(|taxel| taxel.state).collect();
    assert_eq!(states, [State::Ok, State::Faulty, State::Masked, State::Ok]);
    assert_eq!(touch.taxels[0].pressed(), 5e3);
    assert_eq!(touch.sum, 5e3);
    assert_eq!(touch.left_out, 2);
    assert_eq!(touch.contacts.len(), 1);
}

/// A map of 4 x 8 sensels whose noise shows; from frame 300 a pad loads its right half up to the
/// end of the range.
fn noisy_map(cut: bool, mut fault: impl FnMut(usize, &mut [f64])) -> (MapNoise, Vec<Frame>) {
    let mut random = taxel_numerics::Noise::seeded(3);
    let mut noise = MapNoise::default();
    let frames: Vec<Frame> = (0..600)
        .map(|at| {
            let mut values: Vec<f64> = (0..32)
                .map(|sensel| {
                    let load = if at >= 300 && sensel % 8 >= 4 {
                        400.0
                    } else {
                        0.0
                    };
                    let value = (load + 2.0 * random.normal()).round();
                    value.clamp(if cut { 0.0 } else { f64::MIN }, 255.0)
                })
                .collect();
            fault(at, &mut values);
            Frame {
                sequence: at as u64,
                time_ns: at as u64 * 10_000_000,
                values,
                ..Frame::default()
            }
        })
        .collect();
    for frame in &frames {
        noise.push(frame);
    }
    (noise, frames)
}

/// Faulty sensels of the map after each frame of `looked`.
fn faulty(noise: &MapNoise, frames: &[Frame], looked: &[usize]) -> Vec<Vec<usize>> {
    let stream = Stream {
        name: "map".into(),
        rows: 4,
        columns: 8,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity: Quantity::Pressure,
            symbol: "kPa".into(),
            si_per_unit: 1e3,
        },
        pitch: Some([5e-3; 2]),
        period: Some(0.01),
        threshold: None,
        present: vec![true; 32],
    };
    let mut estimator = ArrayEstimator::new(Box::new(MapReader::new(&stream, noise)));
    let mut found = Vec::new();
    for (at, frame) in frames.iter().enumerate() {
        let touch = estimator.push(frame).unwrap().0;
        if looked.contains(&at) {
            let states = touch.taxels.iter().enumerate();
            let faulty = states.filter(|(_, taxel)| taxel.state == State::Faulty);
            found.push(faulty.map(|(index, _)| index).collect());
        }
    }
    found
}

#[test]
fn a_sensel_of_a_map_that_lost_its_noise_is_faulty_and_one_at_an_end_is_not() {
    let looked = [50, 290, 599];
    let none: Vec<usize> = Vec::new();
    for cut in [false, true] {
        // Zeros where noise is cut off, and a pad at the end of the range.
        let (noise, frames) = noisy_map(cut, |_, _| {});
        assert_eq!(
            faulty(&noise, &frames, &looked),
            vec![none.clone(); 3],
            "{cut}"
        );
        // A column that always reads the same, whatever it is.
        for value in [255.0, 40.0] {
            let column =
                |values: &mut [f64]| values.iter_mut().step_by(8).for_each(|one| *one = value);
            let (noise, frames) = noisy_map(cut, |_, values| column(values));
            let stuck = vec![vec![0, 8, 16, 24]; 3];
            assert_eq!(faulty(&noise, &frames, &looked), stuck, "{cut} {value}");
        }
        // One that freezes.
        let (noise, frames) = noisy_map(cut, |at, values| {
            if at > 150 {
                values[9] = 7.0;
            }
        });
        let frozen = vec![none.clone(), vec![9], vec![9]];
        assert_eq!(faulty(&noise, &frames, &looked), frozen, "{cut}");
    }
    // Zero is a fault only where others show their noise around it.
    let dead = |_: usize, values: &mut [f64]| values[9] = 0.0;
    let (noise, frames) = noisy_map(false, dead);
    assert_eq!(faulty(&noise, &frames, &looked), vec![vec![9]; 3]);
    let (noise, frames) = noisy_map(true, dead);
    assert_eq!(faulty(&noise, &frames, &looked), vec![none; 3]);
}
