//! Boards that give the physical value in place of counts: every element read by an
//! instrument, and taxels whose board gives forces.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
#![allow(clippy::too_many_lines, reason = "a table of mistakes is read as one")]

use std::fmt::Write as _;

use proptest::prelude::*;
use taxel::acquisition::{Delivery, Frame, Quantity, Stimulus, Stream, Twin};
use taxel::estimation::{
    Certainty, ChannelState, Condition, FrameError, ObserverOptions, State, Touch, TouchEventKind,
    TouchSession,
};
use taxel::predict::Loads;
use taxel::sensor::Sensor;

/// A shipped sensor as drawn, without scatter of its fabrication, read by an instrument.
fn text_of(name: &str, unit: &str, noise: &str, range: [&str; 2]) -> String {
    let text = Sensor::shipped_text(name).unwrap();
    let (head, _) = text.split_once("[electronics.readout").unwrap();
    let exact = |line: &str| match line.split_once('=') {
        Some((key, _)) if key.trim().ends_with("gain_deviation") => format!("{key}= 0.0"),
        Some((key, _)) if key.trim().ends_with("_deviation") => format!("{key}= \"0 um\""),
        _ => line.to_owned(),
    };
    let lines: Vec<String> = head.lines().map(exact).collect();
    let [low, high] = range;
    format!(
        "{}\n[electronics.readout.measured]\nunit = \"{unit}\"\nnoise = {noise}\nrange = [\"{low}\", \"{high}\"]\n",
        lines.join("\n")
    )
}

fn sensor_of(name: &str, unit: &str, noise: &str, range: [&str; 2]) -> Sensor {
    let text = text_of(name, unit, &format!("\"{noise}\""), range);
    Sensor::parse("measured.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

/// An instrument for each element, with a load on its taxel [0, 0] in the middle of its range.
fn each() -> Vec<(Sensor, Quantity, [f64; 3])> {
    let of = |name, unit, noise, range, quantity, load| {
        (sensor_of(name, unit, noise, range), quantity, load)
    };
    let range = ["0 fF", "3 pF"];
    let (capacitance, voltage) = (Quantity::Capacitance, Quantity::Voltage);
    let shear = [2e-3, -1e-3, 8e-3];
    vec![
        of("three-axis-8x8", "fF", "0.1 fF", range, capacitance, shear),
        of("three-axis-unit", "pF", "50 aF", range, capacitance, shear),
        of(
            "in-plane-50um",
            "pF",
            "0.5 fF",
            range,
            capacitance,
            [0.0, 0.0, 6.0],
        ),
        of(
            "liquid-metal-2x4",
            "mohm",
            "0.2 mohm",
            ["0 ohm", "1 kohm"],
            Quantity::Resistance,
            [0.0, 0.0, 4e-3],
        ),
        of(
            "piezo-1.5mm",
            "pC",
            "0.2 pC",
            ["-1 nC", "1 nC"],
            Quantity::Charge,
            [0.0, 0.0, 0.3],
        ),
        of(
            "piezo-1.5mm",
            "mV",
            "1 mV",
            ["-10 V", "10 V"],
            voltage,
            [0.0, 0.0, 0.3],
        ),
        of(
            "force-4x4",
            "mN",
            "10 mN",
            ["-20 N", "20 N"],
            Quantity::Force,
            [0.5, -0.3, 3.0],
        ),
    ]
}

/// A probe on taxel [0, 0] that presses from `from` to `to`, s, and faults.
fn probe(force: [f64; 3], [from, to]: [f64; 2], more: &str) -> Stimulus {
    let [x, y, z] = force;
    let text = format!(
        "schema = 1\nname = \"probe\"\nduration = \"1000 s\"\n\n[[probe]]\ntaxel = [0, 0]\npath = [\n  \
         {{ time = \"{from} s\", force = [\"{x} N\", \"{y} N\", \"{z} N\"] }},\n  \
         {{ time = \"{to} s\", force = [\"{x} N\", \"{y} N\", \"{z} N\"] }},\n]\n{more}"
    );
    Stimulus::parse("probe.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

/// The frames of `count` from the twin, through a session of its device.
fn run(
    sensor: &Sensor,
    stimulus: &Stimulus,
    seed: u64,
    count: usize,
    mut each: impl FnMut(&Frame, &Touch, &[[f64; 3]]),
) -> TouchSession {
    let mut twin = Twin::new(sensor, stimulus, seed).unwrap();
    let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
    for _ in 0..count {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        let truth = twin.true_forces(frame.time_ns);
        let observed = session.push(&frame).unwrap();
        each(&frame, observed.touch, &truth);
    }
    session
}

#[test]
fn frames_carry_the_quantity_of_the_instrument_in_si() {
    for (sensor, quantity, load) in each() {
        let element = sensor.element.key();
        let twin = Twin::new(&sensor, &probe(load, [0.0, 900.0], ""), 1).unwrap();
        let stream = twin.stream();
        assert_eq!(stream.unit.quantity, quantity, "{element}");
        let session = sensor.device().unwrap().session(&stream).unwrap();
        let reading = &session.meaning().reading;
        assert_eq!(reading.symbol, stream.unit.symbol, "{element}");
        assert_eq!(reading.quantity, quantity.name(), "{element}");
        assert_eq!(reading.si_per_unit, stream.unit.si_per_unit, "{element}");
    }
}

/// A reading of an instrument without noise is what `predict` says, and counts of the same
/// device lead to the same touch.
#[test]
fn the_twin_reads_what_is_predicted() {
    let quiet = sensor_of("three-axis-8x8", "fF", "1e-6 fF", ["0 fF", "1 pF"]);
    let predictor = taxel::device::ThreeAxisPredictor::new(&quiet.three_axis().unwrap());
    let force = [2e-3, -1e-3, 8e-3];
    let expected = predictor.predict(force).response.capacitance();
    run(
        &quiet,
        &probe(force, [0.0, 900.0], ""),
        1,
        3,
        |frame, touch, truth| {
            for (value, expected) in frame.values[..4].iter().zip(expected) {
                // Six deviations of the noise.
                assert!((value - expected).abs() < 6e-21, "{value} {expected}");
            }
            for (axis, truth) in truth[0].iter().enumerate() {
                let off = touch.taxels[0].value[axis] - truth;
                assert!(off.abs() < 1e-8, "{axis}: {off}");
            }
        },
    );
}

/// Intervals of 95 % from the noise of the sensor file alone hold 93 to 97 % of the truth,
/// pressed and not, for every element.
#[test]
fn intervals_follow_from_the_stated_noise() {
    for (sensor, _, load) in each() {
        let element = sensor.element.key();
        let unit = sensor.electronics.measured().unwrap().unit.symbol;
        let charge = element == "piezoelectric";
        // A force that is held fades; the same noise is on it while nothing presses.
        let load = if charge { [0.0; 3] } else { load };
        let count = match (sensor.array.rows, charge) {
            (_, true) => 3000,
            (8, _) => 60,
            _ => 2500,
        };
        // The quiet channels of the liquid read exactly nothing.
        let pressed_alone = element == "microchannel";
        let (mut held, mut all) = (0_usize, 0_usize);
        let (mut squares, mut stated) = (0.0, 0.0);
        run(
            &sensor,
            &probe(load, [0.0, 900.0], ""),
            7,
            count,
            |_, touch, truth| {
                let taxels = touch.taxels.iter().zip(truth);
                for (taxel, truth) in taxels.take(if pressed_alone { 1 } else { usize::MAX }) {
                    let newtons = if pressed_alone {
                        sensor.array.pitch[0] * sensor.array.pitch[1]
                    } else {
                        1.0
                    };
                    for (axis, truth) in truth.iter().enumerate() {
                        let off = taxel.value[axis] * newtons - truth;
                        let deviation = taxel.deviation()[axis] * newtons;
                        if off.is_finite() && deviation > 0.0 {
                            held += usize::from(off.abs() < 1.959_964 * deviation);
                            squares += off * off;
                            stated += deviation * deviation;
                            all += 1;
                        }
                    }
                }
            },
        );
        let share = held as f64 / all as f64;
        assert!(all >= 2400, "{element} in {unit}: {all}");
        let wide = f64::sqrt(stated / squares);
        let what = format!("{element} in {unit}: {share} of {all}, {wide} times the scatter");
        if charge {
            // An offset that drifts is integrated: in the first seconds nothing has excluded one,
            // and the interval of a change of force is a bound, but not any.
            assert!(share >= 0.93 && wide < 3.0, "{what}");
        } else {
            assert!((0.93..=0.97).contains(&share), "{what}");
        }
    }
}

/// A touch is found, with its force; of charges the change of force is.
#[test]
fn a_touch_is_found_with_its_force() {
    for (sensor, _, load) in each() {
        let element = sensor.element.key();
        let rate = sensor.electronics.frame_rate;
        let frames = |seconds: f64| (seconds * rate) as usize;
        let newtons = match element {
            "microchannel" => sensor.array.pitch[0] * sensor.array.pitch[1],
            _ => 1.0,
        };
        let mut found = f64::NAN;
        let mut contacts = 0;
        let stimulus = probe(load, [2.0, 4.0], "");
        let session = run(&sensor, &stimulus, 3, frames(6.0), |frame, touch, _| {
            let time = frame.time_ns as f64 * 1e-9;
            if (2.04..2.06 + 1.0 / rate).contains(&time) {
                (found, contacts) = (touch.taxels[0].pressed() * newtons, touch.contacts.len());
            }
        });
        // The noise of one reading and 1 % of the drift guard.
        assert!((found / load[2] - 1.0).abs() < 0.05, "{element}: {found}");
        assert_eq!(contacts, 1, "{element}");
        let events: Vec<TouchEventKind> =
            session.observer().events().iter().map(|e| e.kind).collect();
        assert!(events.len() < 20, "{element}: {events:?}");
    }
}

/// A dead line gives no number: the channel is named, the others go on.
#[test]
fn a_dead_channel_is_named() {
    let fault = "\n[[fault]]\nchannel = { taxel = [0, 0] }\nreads = \"dead\"\nfrom = \"2 s\"\nto = \"900 s\"\n";
    for (sensor, _, _) in each() {
        let element = sensor.element.key();
        let count = (4.0 * sensor.electronics.frame_rate) as usize;
        let (mut state, mut channel) = (State::Ok, ChannelState::Ok);
        let mut without = 0;
        let session = run(
            &sensor,
            &probe([0.0; 3], [0.0, 1.0], fault),
            5,
            count,
            |frame, touch, _| {
                (state, channel) = (touch.taxels[0].state, touch.channels.states[0]);
                without = frame.values.iter().filter(|value| value.is_nan()).count();
            },
        );
        assert!(without > 0, "{element}");
        assert_eq!(channel, ChannelState::Faulty, "{element}");
        if element != "microchannel" {
            assert_eq!(state, State::Faulty, "{element}");
        }
        let health = session.observer().health();
        assert_eq!(health.channels()[0].condition, Condition::Dead, "{element}");
        let last = health.channels().last().unwrap();
        assert_eq!(
            last.condition.wrong(),
            sensor.array.rows * sensor.array.columns == 1,
            "{element}"
        );
    }
}

/// Frames in which one channel has `value`, after some at rest.
fn with_value(sensor: &Sensor, channel: usize, value: f64) -> (Touch, usize) {
    let mut twin = Twin::new(sensor, &probe([0.0; 3], [0.0, 1.0], ""), 2).unwrap();
    let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
    let mut last = None;
    for index in 0..20 {
        let Delivery::Frame(mut frame) = twin.next_delivery() else {
            panic!("no frame")
        };
        if index == 19 {
            frame.values[channel] = value;
        }
        let touch = session.push(&frame).unwrap().touch;
        last = Some((touch.clone(), touch.clipped));
    }
    last.unwrap()
}

#[test]
fn readings_at_or_outside_the_range_are_clipped() {
    for (sensor, _, _) in each() {
        let element = sensor.element.key();
        let [low, high] = sensor.electronics.measured().unwrap().ends();
        let beyond = high + 0.1 * (high - low);
        for value in [high, beyond] {
            let (touch, clipped) = with_value(&sensor, 0, value);
            assert_eq!(clipped, 1, "{element}");
            assert_eq!(
                touch.channels.states[0],
                ChannelState::Saturated,
                "{element}"
            );
        }
        // Below zero a signal is at the end of its range, else a line is open.
        let expected = if low < 0.0 {
            ChannelState::Saturated
        } else {
            ChannelState::Faulty
        };
        for value in [low, low - 0.1 * (high - low)] {
            let (touch, clipped) = with_value(&sensor, 0, value);
            assert_eq!(
                (touch.channels.states[0], clipped),
                (expected, 1),
                "{element}"
            );
        }
        let (touch, clipped) = with_value(&sensor, 0, f64::NAN);
        assert_eq!(touch.channels.states[0], ChannelState::Faulty, "{element}");
        assert_eq!(clipped, 0, "{element}");
    }
}

#[test]
fn frames_of_another_quantity_are_refused_with_the_readout_to_choose() {
    let counts = Sensor::shipped("three-axis-8x8").unwrap();
    for (sensor, quantity, _) in each() {
        let element = sensor.element.key();
        let twin = Twin::new(&sensor, &probe([0.0; 3], [0.0, 1.0], ""), 1).unwrap();
        let mut stream = twin.stream();
        stream.unit.quantity = Quantity::Counts;
        let Err(error) = sensor.device().unwrap().session(&stream) else {
            panic!("{element}")
        };
        assert!(matches!(error, FrameError::Quantity { .. }), "{element}");
        let message = error.to_string();
        for part in [
            "the frames carry counts",
            quantity.name(),
            "electronics.converter",
        ] {
            assert!(message.contains(part), "{element}: {message}");
        }
    }
    let twin = Twin::new(&counts, &probe([0.0; 3], [0.0, 1.0], ""), 1).unwrap();
    let mut stream = twin.stream();
    stream.unit.quantity = Quantity::Voltage;
    let Err(error) = counts.device().unwrap().session(&stream) else {
        panic!("volts are no counts")
    };
    let message = error.to_string();
    assert!(
        message.contains("voltage") && message.contains("electronics.readout.measured"),
        "{message}"
    );
}

#[test]
fn mistakes_are_shown_at_their_key() {
    let measured = |key: &str| format!("electronics.readout.measured.{key}");
    let of = |name: &str, unit: &str, noise: &str, range: [&str; 2]| {
        let text = text_of(name, unit, noise, range);
        Sensor::parse("bad.toml", &text).unwrap_err()
    };
    let fine = "\"0.05 fF\"";
    let range = ["0 fF", "600 fF"];
    for (name, unit, noise, range, key, parts) in [
        (
            "three-axis-8x8",
            "V",
            fine,
            range,
            "unit",
            ["\"V\" is a unit of voltage", "fF, pF"],
        ),
        (
            "in-plane-50um",
            "ohm",
            fine,
            range,
            "unit",
            ["unit of resistance", "aF, fF"],
        ),
        (
            "liquid-metal-2x4",
            "V",
            "\"1 mV\"",
            ["0 V", "5 V"],
            "unit",
            ["gives a resistance", "voltage_divider"],
        ),
        (
            "piezo-1.5mm",
            "fF",
            fine,
            range,
            "unit",
            ["a charge or a voltage", "nC"],
        ),
        (
            "force-4x4",
            "V",
            "\"1 mV\"",
            ["-1 V", "1 V"],
            "unit",
            ["gives a force", "mN"],
        ),
        (
            "three-axis-8x8",
            "furlong",
            fine,
            range,
            "unit",
            ["no unit of a reading", "fF"],
        ),
        (
            "three-axis-8x8",
            "fF",
            "\"0.1 mV\"",
            range,
            "noise",
            ["this is a voltage", "a capacitance"],
        ),
        (
            "three-axis-8x8",
            "fF",
            "\"0 fF\"",
            range,
            "noise",
            ["no uncertainty", "standard deviation"],
        ),
        (
            "three-axis-8x8",
            "fF",
            "\"-1 fF\"",
            range,
            "noise",
            ["-1 fF", "no uncertainty"],
        ),
        (
            "three-axis-8x8",
            "fF",
            "0.05",
            range,
            "noise",
            ["has no unit", "in quotes"],
        ),
        (
            "three-axis-8x8",
            "fF",
            "\"1e30 F\"",
            range,
            "noise",
            ["out of range", "1e3 F"],
        ),
        (
            "three-axis-8x8",
            "fF",
            "[\"1 fF\", \"1 fF\", \"2 fF\"]",
            range,
            "noise",
            ["three axes", "measured_force"],
        ),
        (
            "force-4x4",
            "N",
            "[\"1 mN\", \"1 mN\"]",
            ["-9 N", "9 N"],
            "noise",
            ["2 values", "exactly 3"],
        ),
        (
            "three-axis-8x8",
            "fF",
            fine,
            ["600 fF", "0 fF"],
            "range",
            ["from 600 fF to 0 fF", "lowest"],
        ),
        (
            "three-axis-8x8",
            "fF",
            fine,
            ["0 fF", "1 V"],
            "range.1",
            ["this is a voltage", "a capacitance"],
        ),
        (
            "three-axis-8x8",
            "fF",
            fine,
            ["0 fF", "100 fF"],
            "range",
            ["172.30 fF", "outside"],
        ),
        (
            "liquid-metal-2x4",
            "ohm",
            "\"1 mohm\"",
            ["0 ohm", "1 ohm"],
            "range",
            ["3.3781 ohm", "saturated"],
        ),
        (
            "piezo-1.5mm",
            "pC",
            "\"1 pC\"",
            ["1 pC", "9 pC"],
            "range",
            ["charge at rest of 0 pC", "1 to 9 pC"],
        ),
        (
            "force-4x4",
            "N",
            "\"1 mN\"",
            ["0 N", "9 N"],
            "range",
            ["no force at all", "around zero"],
        ),
    ] {
        let error = of(name, unit, noise, range);
        assert_eq!(error.key, measured(key), "{error}");
        for part in parts {
            assert!(error.to_string().contains(part), "{part}: {error}");
        }
    }
    let with_more = |more: &str| {
        let text = text_of("three-axis-8x8", "fF", fine, range) + more;
        Sensor::parse("bad.toml", &text).unwrap_err()
    };
    let error = with_more("[electronics.converter]\nbits = 16\nrange = [\"0 V\", \"1 V\"]\n");
    assert_eq!(error.key, "electronics.converter");
    let stage = "stage = { voltage_amplifier = { gain = 1.0, output = { noise = \"1 mV\", offset = \"0 V\", limit = \"9 V\", settling = \"0 s\" } } }\n";
    let error = with_more(stage);
    assert_eq!(error.key, measured("stage"));
    assert!(error.to_string().contains("charge_amplifier"), "{error}");
}

/// A DAQ card after the stage of the shipped file gives the same touch as its converter.
#[test]
fn volts_behind_a_stage_are_the_counts_of_a_converter() {
    let stages = [
        ("three-axis-8x8", "charge_amplifier", [0.0, 0.0, 8e-3]),
        ("liquid-metal-2x4", "voltage_divider", [0.0, 0.0, 4e-3]),
        ("piezo-1.5mm", "voltage_amplifier", [0.0, 0.0, 0.3]),
    ];
    for (name, stage, load) in stages {
        let shipped = Sensor::shipped_text(name).unwrap();
        let (head, tail) = shipped.split_once("[electronics.converter]").unwrap();
        let mut rest = tail
            .split_once("\n[")
            .map_or(String::new(), |(_, rest)| format!("[{rest}"));
        let mut text = head.replace(
            &format!("[electronics.readout.{stage}"),
            &format!("[electronics.readout.measured.stage.{stage}"),
        );
        rest = rest.replace(
            &format!("[electronics.readout.{stage}"),
            &format!("[electronics.readout.measured.stage.{stage}"),
        );
        let _ = write!(
            text,
            "[electronics.readout.measured]\nunit = \"V\"\nnoise = \"1 nV\"\nrange = [\"-10 V\", \"10 V\"]\n{rest}"
        );
        let measured = Sensor::parse("daq.toml", &text).unwrap_or_else(|error| panic!("{error}"));
        let counts = Sensor::shipped(name).unwrap();
        let pressed = |sensor: &Sensor| {
            let count = (1.05 * sensor.electronics.frame_rate) as usize + 2;
            let mut last = [f64::NAN; 2];
            run(
                sensor,
                &probe(load, [1.0, 900.0], ""),
                4,
                count,
                |_, touch, _| {
                    let taxel = &touch.taxels[0];
                    last = [taxel.pressed(), taxel.pressed_deviation()];
                },
            );
            last
        };
        let [[a, s], [b, t]] = [pressed(&measured), pressed(&counts)];
        // Rounding to counts is what differs.
        assert!((a - b).abs() < 6.0 * t, "{name}: {a} {b} {t}");
        assert!(s > 0.0 && s < 1.05 * t, "{name}: {s} {t}");
    }
}

#[test]
fn a_prediction_shows_the_reading_in_its_unit() {
    for (name, unit, noise, range, load, column) in [
        (
            "three-axis-8x8",
            "pF",
            "0.1 fF",
            ["0 fF", "1 pF"],
            "fx=1 mN, fy=0 mN, fz=8 mN",
            "reading_11 [pF]",
        ),
        (
            "in-plane-50um",
            "pF",
            "0.1 fF",
            ["0 fF", "3 pF"],
            "fz=6 N",
            "reading [pF]",
        ),
        (
            "liquid-metal-2x4",
            "mohm",
            "1 mohm",
            ["0 ohm", "1 kohm"],
            "p=5 kPa",
            "row_reading [mohm]",
        ),
        (
            "piezo-1.5mm",
            "pC",
            "1 pC",
            ["-1 nC", "1 nC"],
            "profile=step, fz=0.1 N, ramp=10 ms",
            "a1 [pC]",
        ),
        (
            "force-4x4",
            "mN",
            "1 mN",
            ["-9 N", "9 N"],
            "fx=1 N, fy=0 N, fz=3 N",
            "reading_z [mN]",
        ),
    ] {
        let sensor = sensor_of(name, unit, noise, range);
        let device = sensor.device().unwrap();
        let predictor = device.predictor().unwrap();
        let columns = predictor.columns();
        let titles: Vec<String> = columns
            .iter()
            .map(|column| format!("{} [{}]", column.name, column.unit))
            .collect();
        assert!(
            titles.iter().any(|title| title == column),
            "{name}: {titles:?}"
        );
        let voltage = titles.iter().any(|title| title.contains("voltage"));
        assert!(
            !voltage && !titles.iter().any(|title| title.contains("counts")),
            "{titles:?}"
        );
        let loads = Loads::one(load, predictor.load_columns()).unwrap();
        let mut row = Vec::new();
        predictor.answer(&loads.load(0), &mut row).unwrap();
        assert_eq!(row.len(), columns.len(), "{name}");
    }
}

/// An 8 x 8 skin, `axes` each.
fn skin(axes: &str, noise: &str, range: [&str; 2]) -> Sensor {
    let text = text_of("force-4x4", "N", noise, range)
        .replace("rows = 4", "rows = 8")
        .replace("columns = 4", "columns = 8")
        .replace("axes = \"xyz\"", &format!("axes = \"{axes}\""));
    Sensor::parse("skin.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn two_fingers_on_measured_forces_are_two_contacts_with_their_forces() {
    let fingers = "schema = 1\nname = \"two\"\nduration = \"20 s\"\n
        [[finger]]\nradius = \"2 mm\"\npath = [
          { time = \"1 s\", at = [\"-11.75 mm\", \"11.75 mm\"], force = [\"0 N\", \"0 N\", \"0 N\"] },
          { time = \"2 s\", at = [\"-11.75 mm\", \"11.75 mm\"], force = [\"1 N\", \"0 N\", \"4 N\"] },
          { time = \"9 s\", at = [\"-11.75 mm\", \"11.75 mm\"], force = [\"1 N\", \"0 N\", \"4 N\"] } ]
        [[finger]]\nradius = \"2 mm\"\npath = [
          { time = \"1 s\", at = [\"7.05 mm\", \"-7.05 mm\"], force = [\"0 N\", \"0 N\", \"0 N\"] },
          { time = \"2 s\", at = [\"7.05 mm\", \"-7.05 mm\"], force = [\"0 N\", \"-0.5 N\", \"2 N\"] },
          { time = \"9 s\", at = [\"7.05 mm\", \"-7.05 mm\"], force = [\"0 N\", \"-0.5 N\", \"2 N\"] } ]\n";
    let fingers = Stimulus::parse("two.toml", fingers).unwrap_or_else(|error| panic!("{error}"));
    for (axes, noise) in [
        ("xyz", "[\"5 mN\", \"5 mN\", \"10 mN\"]"),
        ("z", "\"10 mN\""),
    ] {
        let sensor = skin(axes, noise, ["-20 N", "20 N"]);
        let mut twin = Twin::new(&sensor, &fingers, 1).unwrap();
        assert_eq!(twin.stream().channels(), 64 * axes.len());
        let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
        session.begin_rest_capture(50);
        let mut touches = 0;
        for _ in 0..400 {
            let Delivery::Frame(frame) = twin.next_delivery() else {
                continue;
            };
            let observed = session.push(&frame).unwrap();
            let began = observed
                .events
                .iter()
                .filter(|event| event.kind == TouchEventKind::Touch);
            touches += began.count();
        }
        let touch = session.estimator().touch();
        assert_eq!((touch.contacts.len(), touches), (2, 2), "{axes}");
        // Each finger lies within a cell: six deviations of its noise.
        for (contact, expected) in touch
            .contacts
            .iter()
            .zip([[1.0, 0.0, 4.0], [0.0, -0.5, 2.0]])
        {
            assert!(
                (contact.force[2] - expected[2]).abs() < 0.06,
                "{axes}: {:?}",
                contact.force
            );
            if axes == "xyz" {
                for (axis, expected) in expected.iter().take(2).enumerate() {
                    assert!(
                        (contact.force[axis] - expected).abs() < 0.03,
                        "{:?}",
                        contact.force
                    );
                }
            }
        }
        let [total, deviation] = touch.pressing_force().unwrap();
        assert!(
            (total - 6.0).abs() < 4.0 * deviation,
            "{axes}: {total} +- {deviation}"
        );
        assert!((deviation / 0.08 - 1.0).abs() < 0.2, "{axes}: {deviation}");
        if axes == "xyz" {
            assert!(
                (touch.total.force[0] - 1.0).abs() < 0.2,
                "{:?}",
                touch.total.force
            );
        }
    }
}

/// A tare takes the zero of a board that is off; a saturated axis is said of its taxel, and
/// the value is a bound.
#[test]
fn measured_forces_take_a_tare_and_state_their_bounds() {
    let sensor = skin("xyz", "\"10 mN\"", ["-5 N", "5 N"]);
    let mut twin = Twin::new(&sensor, &probe([0.0; 3], [0.0, 1.0], ""), 6).unwrap();
    let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
    session.begin_rest_capture(50);
    for index in 0..120 {
        let Delivery::Frame(mut frame) = twin.next_delivery() else {
            continue;
        };
        for value in &mut frame.values {
            *value += 0.4;
        }
        if index == 119 {
            frame.values[5] = 5.0;
        }
        session.push(&frame).unwrap();
    }
    let touch = session.estimator().touch();
    let (total, deviation) = (touch.total.force[2], touch.total_deviation()[2]);
    assert_eq!(touch.total_certainty, Certainty::AtLeast);
    assert!(touch.total.force[0].is_nan());
    let taxel = &touch.taxels[1];
    assert_eq!(taxel.state, State::Saturated);
    // The end of the range less the zero.
    assert!((taxel.pressed() - 4.6).abs() < 0.02, "{}", taxel.pressed());
    assert!(
        (total - 4.6).abs() < 1.0 && deviation.is_nan(),
        "{total} {deviation}"
    );
    assert_eq!((touch.clipped, touch.contacts.len()), (1, 1));
    assert!(touch.taxels[2].pressed().abs() < 0.06);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Whatever the range, a reading inside it is that force, one at an end or outside is
    /// clipped and at most the end, and no number at all is a fault.
    #[test]
    fn forces_within_any_range_are_themselves(
        low in -1e3_f64..-1e-2,
        high in 1e-2_f64..1e3,
        share in -0.5_f64..1.5,
        taxel in 0_usize..64,
    ) {
        let range = [format!("{low} N"), format!("{high} N")];
        let sensor = skin("z", "\"1 uN\"", [&range[0], &range[1]]);
        let stream = Twin::new(&sensor, &probe([0.0; 3], [0.0, 1.0], ""), 1).unwrap().stream();
        let force = low + share * (high - low);
        let (touch, inside) = (pushed(&sensor, &stream, taxel, force), force > low && force < high);
        let found = &touch.taxels[taxel];
        prop_assert_eq!(touch.clipped, usize::from(!inside));
        prop_assert_eq!(found.state == State::Saturated, !inside);
        prop_assert!((found.pressed() - force.clamp(low, high)).abs() <= 1e-12 * high.max(-low));
        let nothing = pushed(&sensor, &stream, taxel, f64::NAN);
        prop_assert_eq!(nothing.taxels[taxel].state, State::Faulty);
        prop_assert!(nothing.taxels[taxel].pressed().is_nan());
        prop_assert_eq!(nothing.taxels.iter().filter(|t| t.state != State::Ok).count(), 1);
    }
}

/// Touch of one frame in which one taxel has a force.
fn pushed(sensor: &Sensor, stream: &Stream, taxel: usize, force: f64) -> Touch {
    let mut session = TouchSession::new(
        sensor.device().unwrap().reader(stream).unwrap(),
        ObserverOptions::new(stream),
    );
    let mut values = vec![0.0; stream.channels()];
    values[taxel] = force;
    let frame = Frame {
        values,
        ..Frame::default()
    };
    session.push(&frame).unwrap().touch.clone()
}
