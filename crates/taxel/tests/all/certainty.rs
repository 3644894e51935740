//! Devices by faults by moments: no number says more than is known.
//!
//! A taxel is pressed, held and left; one of its channels fails before, while it is held, or
//! after. In every frame the total is right within its interval, or a true bound, or none; what
//! is held stays a contact; and nothing is released while it is held.
#![allow(clippy::unwrap_used)]

use taxel::acquisition::{Delivery, Frame, Quantity, SignalUnit, Stimulus, Stream, Twin};
use taxel::estimation::{Certainty, MapOptions, Observed, State, TouchEventKind, TouchSession};
use taxel::sensor::Sensor;

/// Frames of the rest capture, as in the paper.
const REST_FRAMES: usize = 50;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// Code zero: an open line.
    Dead,
    /// The reading at rest again and again.
    Stuck,
    /// The reading of the moment in which it fails again and again.
    Frozen,
    /// Somewhere in the range, anew in each frame.
    Jumping,
    /// The highest code.
    AtEnd,
}

const FAULTS: [Fault; 5] = [
    Fault::Dead,
    Fault::Stuck,
    Fault::Frozen,
    Fault::Jumping,
    Fault::AtEnd,
];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Moment {
    Before,
    Held,
    After,
}

struct Device {
    sensor: &'static str,
    taxel: [usize; 2],
    force: &'static str,
    /// A channel of that taxel.
    channel: usize,
    /// True if a reading alone does not show that it jumps or stands: nothing contradicts it.
    alone: bool,
    moments: &'static [Moment],
}

const MOMENTS: [Moment; 3] = [Moment::Before, Moment::Held, Moment::After];

const DEVICES: [Device; 8] = [
    Device {
        sensor: "three-axis-8x8",
        taxel: [4, 4],
        force: "8 mN",
        channel: 4 * 36 + 2,
        alone: false,
        moments: &MOMENTS,
    },
    Device {
        sensor: "in-plane-50um",
        taxel: [1, 1],
        force: "4 N",
        channel: 3,
        alone: true,
        moments: &MOMENTS,
    },
    Device {
        sensor: "force-4x4",
        taxel: [1, 2],
        force: "2 N",
        channel: 3 * 6 + 2,
        alone: true,
        moments: &MOMENTS,
    },
    Device {
        sensor: "liquid-metal-2x4",
        taxel: [0, 1],
        force: "3.78 mN",
        channel: 3,
        alone: true,
        moments: &MOMENTS,
    },
    Device {
        sensor: "resistive-mat-8x8",
        taxel: [3, 3],
        force: "5 N",
        channel: 27,
        alone: true,
        moments: &MOMENTS,
    },
    Device {
        sensor: "pressure-chips-1x8",
        taxel: [0, 4],
        force: "0.4 N",
        channel: 4,
        alone: true,
        moments: &MOMENTS,
    },
    Device {
        sensor: "magnet-over-four-hall",
        taxel: [0, 0],
        force: "0.5 N",
        channel: 2,
        alone: false,
        moments: &MOMENTS,
    },
    // A thousand frames a second: the moment that matters alone.
    Device {
        sensor: "piezo-2.3mm",
        taxel: [0, 1],
        force: "150 mN",
        channel: 1,
        alone: true,
        moments: &[Moment::Held],
    },
];

/// Begin and end of the load, s.
const HELD: [f64; 2] = [2.0, 5.0];

impl Device {
    fn sensor(&self) -> Sensor {
        let mut text = Sensor::shipped_text(self.sensor).unwrap().to_owned();
        if self.sensor.starts_with("in-plane") {
            text = text
                .replace("rows = 1", "rows = 2")
                .replace("columns = 1", "columns = 2");
        }
        Sensor::parse("case.toml", &text).unwrap()
    }

    fn twin(&self) -> (Twin, TouchSession) {
        let sensor = self.sensor();
        let [begin, end] = HELD;
        let force = |force: &str| format!("force = [\"0 N\", \"0 N\", \"{force}\"] }}");
        let (nothing, held) = (force("0 N"), force(self.force));
        let script = format!(
            "schema = 1\nname = \"press\"\nduration = \"20 s\"\n[[probe]]\ntaxel = {:?}\npath = [\n\
             {{ time = \"{} s\", {nothing}, {{ time = \"{begin} s\", {held}, {{ time = \"{end} s\", {held}, \
             {{ time = \"{} s\", {nothing}]\n",
            self.taxel,
            begin - 0.2,
            end + 0.2
        );
        let stimulus = Stimulus::parse("press", &script).unwrap();
        let twin = Twin::new(&sensor, &stimulus, 5).unwrap();
        let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
        session.begin_rest_capture(REST_FRAMES);
        (twin, session)
    }

    fn run(&self, fault: Option<Fault>, moment: Moment) {
        let (mut twin, mut session) = self.twin();
        let mut failing = Failing::new(
            fault,
            moment,
            session.estimator().channels()[self.channel].span,
        );
        let mut counts = [0; 3];
        loop {
            let Delivery::Frame(mut frame) = twin.next_delivery() else {
                continue;
            };
            let time = frame.time_ns as f64 * 1e-9;
            if time > 8.0 {
                break;
            }
            failing.fail(time, &mut frame.values[self.channel]);
            let truth = twin
                .true_forces(frame.time_ns)
                .iter()
                .map(|force| force[2])
                .sum();
            let observed = session.push(&frame).unwrap();
            if time < REST_UNTIL {
                continue;
            }
            counts[observed.touch.total_certainty as usize] += 1;
            self.check(&failing, time, truth, &observed);
        }
        println!(
            "{}, {fault:?}, {moment:?}: exact, at least, unknown {counts:?}",
            self.sensor
        );
    }

    /// What must hold of a frame under so much force, N.
    fn check(&self, failing: &Failing, time: f64, truth: f64, observed: &Observed<'_>) {
        let (fault, moment) = (failing.fault, failing.moment);
        let what = format!("{}, {fault:?}, {moment:?}, {time}", self.sensor);
        let touch = observed.touch;
        let [begin, end] = HELD;
        let failed = fault.is_some() && time >= failing.since;
        // A single reading that is wrong, and has not stood for a second, is not known to be; one
        // that jumps looks like touches, and one at its high end like an overload.
        let unseen = self.alone
            && failed
            && (time < failing.since + 1.2 || matches!(fault, Some(Fault::Jumping | Fault::AtEnd)));
        let steady = (begin..end).contains(&time) || !(begin - 0.2..end + 0.2).contains(&time);
        if !unseen && steady {
            let [force, deviation] = [touch.total.force[2], touch.total_deviation()[2]];
            let spread = if deviation.is_nan() { 0.0 } else { deviation };
            // Five deviations, and a tenth of the load for what the material remembers.
            let slack = 5.0 * spread + 0.1 * truth;
            match touch.total_certainty {
                Certainty::Exact => {
                    assert!(
                        (force - truth).abs() <= slack,
                        "{what}: {force} +- {deviation}, true {truth}"
                    );
                }
                Certainty::AtLeast => {
                    assert!(
                        force <= truth + slack,
                        "{what}: at least {force}, true {truth}"
                    );
                    let others = [touch.total.force[0], touch.total.moment[0]];
                    assert!(others.iter().all(|value| value.is_nan()), "{what}");
                    assert!(touch.total_reason.is_some(), "{what}");
                }
                Certainty::Unknown => assert!(force.is_nan(), "{what}: {force}"),
            }
        }
        // On one channel alone a reading that stands at rest looks like a release.
        let looks_touched = !self.alone || !matches!(fault, Some(Fault::Stuck | Fault::Jumping));
        let held = (begin + 0.1..end).contains(&time) && moment != Moment::Before;
        if looks_touched && held && (!unseen || fault == Some(Fault::Dead)) {
            assert_eq!(
                touch.contacts.len(),
                1,
                "{what}: {:?}",
                touch.state_counts()
            );
            let mut events = observed.events.iter();
            let released = events.find(|event| event.kind == TouchEventKind::Release);
            assert!(released.is_none(), "{what}: {released:?}");
        }
    }
}

/// A channel that fails.
struct Failing {
    fault: Option<Fault>,
    moment: Moment,
    since: f64,
    span: [f64; 2],
    rest: Option<f64>,
    frozen: Option<f64>,
    random: taxel_numerics::Noise,
}

impl Failing {
    fn new(fault: Option<Fault>, moment: Moment, span: [f64; 2]) -> Self {
        let since = match moment {
            Moment::Before => 1.5,
            Moment::Held => 3.0,
            Moment::After => 6.0,
        };
        Self {
            fault,
            moment,
            since,
            span,
            rest: None,
            frozen: None,
            random: taxel_numerics::Noise::seeded(3),
        }
    }

    fn fail(&mut self, time: f64, reading: &mut f64) {
        let rest = *self.rest.get_or_insert(*reading);
        let Some(fault) = self.fault.filter(|_| time >= self.since) else {
            return;
        };
        let known = self.span[1].is_finite();
        let [low, high] = if known {
            self.span
        } else {
            [0.9 * rest, 1.1 * rest]
        };
        *reading = match fault {
            Fault::Dead if known => low.min(0.0),
            Fault::Dead => f64::NAN,
            Fault::Stuck => rest,
            Fault::Frozen => *self.frozen.get_or_insert(*reading),
            Fault::AtEnd => high,
            Fault::Jumping => {
                low + (0.5 + 0.5 * (0.9 * self.random.normal()).tanh()) * (high - low)
            }
        };
    }
}

/// The rest is captured until then, s.
const REST_UNTIL: f64 = 1.4;

#[test]
fn no_number_says_more_than_is_known() {
    for device in &DEVICES {
        device.run(None, Moment::After);
        for fault in FAULTS {
            for moment in device.moments {
                device.run(Some(fault), *moment);
            }
        }
    }
}

/// Frames of a map of 1 x 3 cells, of which the last does not exist.
fn map(quantity: Quantity) -> TouchSession {
    let stream = Stream {
        name: String::new(),
        rows: 1,
        columns: 3,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity,
            symbol: "kPa".into(),
            si_per_unit: 1e3,
        },
        pitch: Some([5e-3, 5e-3]),
        period: None,
        threshold: None,
        present: vec![true, true, false],
    };
    TouchSession::map(&stream, &MapOptions::default())
}

fn pushed(
    session: &mut TouchSession,
    number: u64,
    values: [f64; 2],
) -> (Certainty, Option<State>, usize) {
    let frame = Frame {
        sequence: number,
        time_ns: 10_000_000 * number,
        values: vec![values[0], values[1], f64::NAN],
        ..Frame::default()
    };
    let touch = session.push(&frame).unwrap().touch;
    (
        touch.total_certainty,
        touch.total_reason,
        touch.contacts.len(),
    )
}

/// A cell that a map does not have is missing nowhere; one that gives no reading is, and on a bare
/// device, whose readings go both ways, not even a bound is left.
#[test]
fn a_map_without_a_reading_is_a_bound() {
    let mut session = map(Quantity::Pressure);
    assert_eq!(
        pushed(&mut session, 0, [0.0, 5e3]),
        (Certainty::Exact, None, 1)
    );
    let faulty = Some(State::Faulty);
    // What was held there is a contact still, of which nothing is known.
    assert_eq!(
        pushed(&mut session, 1, [0.0, f64::NAN]),
        (Certainty::Unknown, faulty, 1)
    );
    assert_eq!(
        pushed(&mut session, 2, [0.0, 0.0]),
        (Certainty::Exact, None, 0)
    );
    assert_eq!(
        pushed(&mut session, 3, [0.0, f64::NAN]),
        (Certainty::AtLeast, faulty, 0)
    );
    let mut session = map(Quantity::Counts);
    assert_eq!(
        pushed(&mut session, 0, [0.0, f64::NAN]).0,
        Certainty::Unknown
    );
}

/// A masked taxel of a device carries what nobody sees.
#[test]
fn a_masked_taxel_leaves_a_bound() {
    let mut text = Sensor::shipped_text("three-axis-8x8").unwrap().to_owned();
    text.push_str("\n[[mask]]\ntaxel = [0, 0]\n");
    let sensor = Sensor::parse("masked.toml", &text).unwrap();
    let script = Stimulus::parse("press", Stimulus::shipped_text("press").unwrap()).unwrap();
    let mut twin = Twin::new(&sensor, &script, 1).unwrap();
    let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
    session.begin_rest_capture(REST_FRAMES);
    for _ in 0..=REST_FRAMES {
        if let Delivery::Frame(frame) = twin.next_delivery() {
            session.push(&frame).unwrap();
        }
    }
    let touch = session.estimator().touch();
    assert_eq!(
        (touch.total_certainty, touch.total_reason),
        (Certainty::AtLeast, Some(State::Masked))
    );
}

/// A block of channels that does not come while the rest is captured has no zero: it leaves a bound, also when
/// it comes, and joins the total with the next tare.
#[test]
fn a_block_that_is_absent_at_the_start_joins_with_a_tare() {
    const COMES: f64 = 3.5;
    const TARE: f64 = 6.0;
    for (device, absent) in [(&DEVICES[0], 0..4 * 8), (&DEVICES[2], 0..3 * 4)] {
        let (mut twin, mut session) = device.twin();
        let failing = Failing::new(None, Moment::After, [0.0; 2]);
        let (mut tared, mut joined) = (false, None);
        loop {
            let Delivery::Frame(mut frame) = twin.next_delivery() else {
                continue;
            };
            let time = frame.time_ns as f64 * 1e-9;
            if time > 8.0 {
                break;
            }
            if time < COMES {
                frame.values[absent.clone()].fill(f64::NAN);
            }
            if time > TARE && !tared {
                tared = true;
                session.begin_rest_capture(REST_FRAMES);
            }
            let forces = twin.true_forces(frame.time_ns);
            let truth = forces.iter().map(|force| force[2]).sum();
            let capturing = session.capturing();
            let observed = session.push(&frame).unwrap();
            let touch = observed.touch;
            let said = (touch.total_certainty, touch.total_reason);
            if time < REST_UNTIL || capturing {
                continue;
            }
            if !tared {
                let bound = (Certainty::AtLeast, Some(State::Faulty));
                assert_eq!(said, bound, "{}, {time}", device.sensor);
            } else if said.0 == Certainty::Exact {
                joined.get_or_insert(time);
            } else {
                assert_eq!(joined, None, "{}, {time}: {said:?}", device.sensor);
            }
            device.check(&failing, time, truth, &observed);
        }
        assert!(joined.is_some(), "{}", device.sensor);
    }
}

/// Far beyond the range the force is a bound in total, contact and events, and passing the full
/// scale is said once, however long it is held.
#[test]
fn an_overload_is_a_bound_everywhere() {
    overload("three-axis-8x8", 4, "100 mN", &["overload", "closed"]);
    overload("in-plane-50um", 0, "90 N", &["overload"]);
}

fn overload(name: &str, taxel: usize, force: &str, said: &[&str]) {
    let sensor = Sensor::shipped(name).unwrap();
    let script = format!(
        "schema = 1\nname = \"press\"\nduration = \"20 s\"\n[[probe]]\ntaxel = [{taxel}, {taxel}]\npath = [\n\
         {{ time = \"2 s\", force = [\"0 N\", \"0 N\", \"0 N\"] }}, {{ time = \"4 s\", force = [\"0 N\", \"0 N\", \"{force}\"] }},\n\
         {{ time = \"9 s\", force = [\"0 N\", \"0 N\", \"{force}\"] }}]\n"
    );
    let stimulus = Stimulus::parse("press", &script).unwrap();
    let mut twin = Twin::new(&sensor, &stimulus, 5).unwrap();
    let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
    session.begin_rest_capture(REST_FRAMES);
    let full_scale = session.meaning().full_scale.unwrap();
    let vector = session.meaning().components == 3;
    let mut kinds = Vec::new();
    loop {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        let time = frame.time_ns as f64 * 1e-9;
        if time > 8.0 {
            break;
        }
        let truth: f64 = twin
            .true_forces(frame.time_ns)
            .iter()
            .map(|force| force[2])
            .sum();
        let observed = session.push(&frame).unwrap();
        for event in observed.events {
            if matches!(
                event.kind,
                TouchEventKind::Overload | TouchEventKind::Closed
            ) {
                assert_eq!(event.certainty, Certainty::AtLeast, "{event:?}");
                kinds.push(event.kind.name());
            }
        }
        let touch = observed.touch;
        if truth > 1.02 * full_scale {
            let contact = touch.contacts[0];
            for certainty in [touch.total_certainty, contact.certainty] {
                assert_eq!(certainty, Certainty::AtLeast, "{time}: {truth}");
            }
            // Five deviations of what was left of the range.
            let slack = 5.0 * touch.total_deviation()[2].max(0.0);
            assert!(contact.force[2] <= truth + slack && touch.total.force[2] <= truth + slack);
            assert!(!vector || contact.force[0].is_nan());
        }
    }
    assert_eq!(kinds, said, "{name}");
}

/// Six channels of a bare board, of which one is pressed while the rest is captured: the capture is
/// refused, and nothing that comes before one is a force.
#[test]
fn a_load_that_comes_during_the_capture_of_a_bare_board_is_no_zero() {
    let stream = Stream {
        name: String::new(),
        rows: 1,
        columns: 6,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity: Quantity::Counts,
            symbol: "counts".into(),
            si_per_unit: 1.0,
        },
        pitch: None,
        period: None,
        threshold: None,
        present: vec![true; 6],
    };
    let mut random = taxel_numerics::Noise::seeded(3);
    let shapes: [fn(f64) -> f64; 5] = [
        |_| 0.0,
        |share| 292.0 * share,
        |share| if share > 0.5 { 292.0 } else { 0.0 },
        |share| {
            if (0.3..0.7).contains(&share) {
                292.0
            } else {
                0.0
            }
        },
        // Three periods of a hum are no motion.
        |share| (30.0 * (std::f64::consts::TAU * 3.0 * share).sin()).round(),
    ];
    for (number, shape) in shapes.iter().enumerate() {
        for noise in [0.0, 0.4, 3.0] {
            let mut session = TouchSession::map(&stream, &MapOptions::default());
            session.begin_rest_capture(REST_FRAMES);
            let mut ended = None;
            for sequence in 0..=REST_FRAMES as u64 {
                let share = sequence as f64 / REST_FRAMES as f64;
                let mut values = vec![0.0; 6];
                for (channel, value) in values.iter_mut().enumerate() {
                    let load = if channel == 0 { shape(share) } else { 0.0 };
                    *value = (513.0 + load + noise * random.normal()).round();
                }
                let frame = Frame {
                    sequence,
                    time_ns: 10_000_000 * sequence,
                    values,
                    ..Frame::default()
                };
                let observed = session.push(&frame).unwrap();
                ended = observed.captured.or(ended);
                let touch = observed.touch;
                let taken = ended == Some(Ok(())) && sequence as usize == REST_FRAMES;
                assert_eq!(touch.zero_known, taken, "{number}, {noise}, {sequence}");
                if !taken {
                    assert!(touch.contacts.is_empty() && touch.sum.is_nan());
                    assert_eq!(touch.total_certainty, Certainty::Unknown);
                }
            }
            let moves = (1..4).contains(&number);
            assert_eq!(ended.unwrap().is_err(), moves, "{number}, {noise}");
        }
    }
}

/// A channel of a bare board that had noise and has it no longer stands still, and says so; one that
/// was as constant before, and one that only went to and fro between two counts, do not.
#[test]
fn a_channel_of_a_bare_board_that_loses_its_noise_is_stuck() {
    let stream = Stream {
        name: String::new(),
        rows: 1,
        columns: 4,
        channels_per_taxel: 1,
        unit: SignalUnit {
            quantity: Quantity::Counts,
            symbol: "counts".into(),
            si_per_unit: 1.0,
        },
        pitch: None,
        period: None,
        threshold: None,
        present: vec![true; 4],
    };
    let mut random = taxel_numerics::Noise::seeded(4);
    let mut session = TouchSession::map(&stream, &MapOptions::default());
    session.begin_rest_capture(REST_FRAMES);
    let mut states = Vec::new();
    for sequence in 0..800 {
        // Noise of a count; the same, and none from 3 s on; none at all; and a tenth of a count at
        // the border between two, then in the middle of one.
        let fails = sequence >= 300;
        let border = if fails { 0.0 } else { 0.5 };
        let noise = [1.0, f64::from(u8::from(!fails)), 0.0, 0.1];
        let values = noise.map(|noise| noise * random.normal());
        let values = [values[0], values[1], values[2], border + values[3]];
        let frame = Frame {
            sequence,
            time_ns: 10_000_000 * sequence,
            values: values.map(|value| (513.0 + value).round()).to_vec(),
            ..Frame::default()
        };
        let touch = session.push(&frame).unwrap().touch;
        let taxels = touch.taxels.iter().map(|taxel| taxel.state);
        states.push((taxels.collect::<Vec<_>>(), touch.total_certainty));
    }
    let (ok, stuck) = (State::Ok, State::Faulty);
    for (states, certainty) in &states[REST_FRAMES + 1..300] {
        assert_eq!((&states[..], *certainty), (&[ok; 4][..], Certainty::Exact));
    }
    // A count of noise gives the same reading in 0.38 of frames at most: 22 in a row are chance once in
    // 10^9, and nothing is said before a second has passed.
    let (last, certainty) = &states[410];
    assert_eq!(
        (&last[..], *certainty),
        (&[ok, stuck, ok, ok][..], Certainty::Unknown)
    );
    let health = session.observer().health().channels();
    let conditions: Vec<_> = health
        .iter()
        .map(|health| health.condition.name())
        .collect();
    assert_eq!(conditions, ["well", "stuck", "well", "well"]);
}
