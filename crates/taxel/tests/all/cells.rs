//! Arrays of cells, from the sensor file to touch and back, over networks, covers and cells.
#![allow(clippy::unwrap_used)]

use taxel::acquisition::{Delivery, Frame, Stimulus, Twin};
use taxel::estimation::{State, TouchSession};
use taxel::sensor::Sensor;
use taxel::stage::{Chain, Inverted};
use taxel_numerics::Noise;

use crate::common::{assert_near, table};

/// The shipped mat with another network and its readout.
fn mat(network: &str, readout: &str) -> Sensor {
    let text = Sensor::shipped_text("resistive-mat-8x8").unwrap();
    let without = |text: &str, table: &str| {
        let (head, rest) = text.split_once(table).unwrap();
        let rest = rest
            .split_once("\n[")
            .map_or(String::new(), |(_, rest)| format!("[{rest}"));
        format!("{head}{rest}")
    };
    let mut text = without(text, "[element.cells.network.zero_potential]");
    text = without(&text, "[electronics.readout.transimpedance]");
    if readout.starts_with("measured") {
        text = without(&text, "[electronics.converter]");
    }
    text = text.replace(
        "[element.cells]\n",
        &format!("[element.cells]\nnetwork = {network}\n"),
    );
    text = text.replace(
        "[electronics]\n",
        &format!("[electronics]\nreadout.{readout}\n"),
    );
    Sensor::parse("mat.toml", &text).unwrap()
}

const TRANSIMPEDANCE: &str =
    "transimpedance = { supply = \"3.3 V\", feedback = \"2 kohm\", noise = \"0.5 mV\" }";
const DIVIDER: &str =
    "reference_divider = { supply = \"3.3 V\", reference = \"10 kohm\", noise = \"0.5 mV\" }";
const OHMS: &str =
    "measured = { unit = \"ohm\", noise = \"30 ohm\", range = [\"0 ohm\", \"1 Mohm\"] }";

/// Each network with its readout, and the column of the reference with what the board reads.
fn networks() -> [(Sensor, &'static str); 5] {
    let zero = |drive: u32, idle: u32, column: u32| {
        format!(
            "{{ zero_potential = {{ drive_resistance = \"{drive} ohm\", idle_resistance = \"{idle} ohm\", column_resistance = \"{column} ohm\" }} }}"
        )
    };
    [
        (mat(&zero(70, 20, 5), TRANSIMPEDANCE), "zero_real [V]"),
        (mat(&zero(0, 0, 0), TRANSIMPEDANCE), "zero_ideal [V]"),
        (
            mat("{ divider = \"grounded\" }", DIVIDER),
            "divider_grounded [V]",
        ),
        (mat("{ divider = \"open\" }", DIVIDER), "divider_open [V]"),
        (mat("\"floating\"", OHMS), "float [ohm]"),
    ]
}

#[test]
fn every_network_reads_the_reference_matrix_and_is_inverted() {
    let rows = table("own_resistive_matrix.csv");
    for (sensor, column) in networks() {
        let device = sensor.cells().unwrap();
        let chain = device.chain();
        for pattern in rows.chunks(64) {
            let name = format!("{} {column}", pattern[0].text("pattern"));
            let values: Vec<f64> = pattern
                .iter()
                .map(|row| 1.0 / row.at("R_true [ohm]"))
                .collect();
            let signals = chain.signals(&values);
            for (row, signal) in pattern.iter().zip(&signals) {
                // The reference has its ideal drives as 1e-9 ohm: 1e-9 over 2 kohm.
                assert_near(chain.input(*signal), row.at(column), 1e-11, 0.0, &name);
            }
            let mut found = Inverted {
                values: chain.values(&[0.0; 64]),
                ..Inverted::default()
            };
            chain.network.invert(&signals, &[1e-15; 64], &mut found);
            for (found, value) in found.values.iter().zip(&values) {
                // Rounding of the readings times the noise gain, 67 of the worst pattern.
                assert_near(*found, *value, 1e-11, 0.0, &name);
            }
        }
    }
}

/// One frame of a chain under these pressures, Pa, with the noise of its board.
fn frame(chain: &Chain, pressures: &[f64], sequence: u64, noise: &mut Noise) -> Frame {
    frame_of(chain, &chain.respond(pressures).signals, sequence, noise)
}

/// One frame with these signals and the noise of its board.
fn frame_of(chain: &Chain, signals: &[f64], sequence: u64, noise: &mut Noise) -> Frame {
    let sigma = chain.readout.noise().hypot(chain.last.noise());
    let number = |signal: &f64| {
        chain
            .last
            .deliver(chain.input(*signal) + sigma * noise.normal())
            .number
    };
    Frame {
        sequence,
        time_ns: 20_000_000 * sequence,
        values: signals.iter().map(number).collect(),
        ..Frame::default()
    }
}

fn session(sensor: &Sensor) -> TouchSession {
    let script = Stimulus::parse("press", Stimulus::shipped_text("press").unwrap()).unwrap();
    let stream = Twin::new(sensor, &script, 1).unwrap().stream();
    sensor.device().unwrap().session(&stream).unwrap()
}

#[test]
fn intervals_of_pressures_and_of_the_total_hold_the_truth() {
    let mut random = Noise::seeded(5);
    let sensors = networks().map(|(sensor, _)| sensor).into_iter();
    let sensors = sensors.chain([Sensor::shipped("pressure-chips-1x8").unwrap()]);
    for sensor in sensors {
        let device = sensor.cells().unwrap();
        let chain = device.chain();
        let name = &sensor.name;
        let (mut within, mut all, mut total_within, mut totals) = (0_u32, 0_u32, 0_u32, 0_u32);
        for _ in 0..60 {
            // A new session for each frame: what is asked is the interval of one frame.
            let mut session = session(&sensor);
            let pressed = |_| match random.normal() {
                weight if weight > 0.0 => (0.2 * weight).min(0.8) * chain.full_scale,
                _ => 0.0,
            };
            let pressures: Vec<f64> = (0..chain.count()).map(pressed).collect();
            // ... and a new piece of fabrication.
            let made = device.scattered(&mut || random.normal());
            let loads = made.cell_loads(&pressures);
            session
                .push(&frame(&made, &pressures, 0, &mut random))
                .unwrap();
            let touch = session.estimator().touch();
            for (taxel, load) in touch.taxels.iter().zip(&loads) {
                // A value without a deviation is a bound, and is not counted; nor is an empty cell,
                // which reads no less than nothing: too little conductance is no error there.
                if *load > 0.0 && taxel.counted && taxel.pressed_deviation().is_finite() {
                    all += 1;
                    within += u32::from(
                        (taxel.pressed() - load).abs() <= 1.96 * taxel.pressed_deviation(),
                    );
                }
            }
            if let Some([force, deviation]) = touch.pressing_force() {
                let truth: f64 = pressures.iter().sum::<f64>() * chain.area();
                totals += 1;
                total_within += u32::from((force - truth).abs() <= 1.96 * deviation);
            }
        }
        let share = f64::from(within) / f64::from(all);
        println!(
            "{name} {:?}: {share:.3} of {all}; total {total_within} of {totals}",
            chain.network
        );
        // Three standard errors of 95 % of `all`, and the cells of a frame share their noise.
        let error = 3.0 * (0.95 * 0.05 / f64::from(all)).sqrt() + 0.01;
        assert!((share - 0.95).abs() < error, "{name}: {share} of {all}");
        let [held, totals] = [total_within, totals].map(f64::from);
        // Three standard errors of the binomial distribution.
        assert!(
            held >= 0.95 * totals - 3.0 * (0.95 * 0.05 * totals).sqrt(),
            "{name}: {held} of {totals}"
        );
    }
}

#[test]
fn three_pressed_corners_make_no_ghost() {
    let sensor = Sensor::shipped("resistive-mat-8x8").unwrap();
    let script =
        Stimulus::parse("mat-ghost", Stimulus::shipped_text("mat-ghost").unwrap()).unwrap();
    let mut twin = Twin::new(&sensor, &script, 7).unwrap();
    let mut session = sensor.device().unwrap().session(&twin.stream()).unwrap();
    session.begin_rest_capture(50);
    let mut largest: f64 = 0.0;
    for _ in 0..225 {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        session.push(&frame).unwrap();
        let touch = session.estimator().touch();
        if frame.time_ns > 2_600_000_000 {
            let ghost = touch.taxels[8 + 1];
            largest = largest.max(ghost.pressed().abs() / ghost.pressed_deviation());
            assert_eq!(touch.contacts.len(), 3, "at {} ns", frame.time_ns);
            for corner in [8 + 5, 48 + 5, 48 + 1] {
                // Cells are made within 5 %; 5 N on a pitch of 10 mm are 50 kPa, m = 0.7.
                assert_near(touch.taxels[corner].pressed(), 50e3, 0.25, 0.0, "corner");
            }
        }
    }
    // Of 95 frames one in 500 is beyond 3.1 deviations; 4.5 once in 10^5.
    assert!(largest < 4.5, "{largest}");
}

#[test]
fn a_dead_crossing_is_faulty_and_what_shares_its_lines_says_so() {
    for (sensor, column) in networks() {
        let device = sensor.cells().unwrap();
        let chain = device.chain();
        let mut session = session(&sensor);
        let mut random = Noise::seeded(3);
        let mut pressures = vec![0.0; 64];
        pressures[27] = 40e3;
        let mut dead = frame(chain, &pressures, 0, &mut random);
        dead.values[26] = chain.last.dead();
        session.push(&dead).unwrap();
        let touch = session.estimator().touch();
        assert_eq!(touch.taxels[26].state, State::Faulty, "{column}");
        assert!(touch.taxels[26].pressed().is_nan());
        let pressed = touch.taxels[27];
        if pressed.pressed_deviation().is_nan() {
            let unknown = [State::Ambiguous, State::NotConverged];
            assert!(unknown.contains(&pressed.state), "{column}: {pressed:?}");
        } else {
            // Five deviations of the model that is linear in what is missing.
            assert!(
                (pressed.pressed() - 40e3).abs() < 5.0 * pressed.pressed_deviation(),
                "{column}: {pressed:?}"
            );
        }
    }
}

/// A row whose trace is broken after the capture at rest: its cells have no pressure, the others keep
/// theirs.
#[test]
fn the_cells_of_a_broken_line_are_faulty() {
    for (sensor, column) in networks() {
        let device = sensor.cells().unwrap();
        let chain = device.chain();
        let mut session = session(&sensor);
        session.begin_rest_capture(20);
        let mut random = Noise::seeded(6);
        for sequence in 0..20 {
            session
                .push(&frame(chain, &[0.0; 64], sequence, &mut random))
                .unwrap();
        }
        let mut pressures = vec![0.0; 64];
        pressures[27] = 40e3;
        let mut values = chain.values(&pressures);
        let mut push = |values: &[f64], sequence| {
            let signals = chain.signals(values);
            session
                .push(&frame_of(chain, &signals, sequence, &mut random))
                .unwrap();
            session.estimator().touch().clone()
        };
        let whole = push(&values, 20);
        assert!(
            whole
                .taxels
                .iter()
                .all(|taxel| taxel.state != State::Faulty)
        );
        // A femtosiemens is that of air across a cut.
        values[16..24].fill(1e-15);
        let broken = push(&values, 21);
        for (index, taxel) in broken.taxels.iter().enumerate() {
            let on_it = (16..24).contains(&index);
            assert_eq!(
                taxel.state == State::Faulty,
                on_it,
                "{column}: {index} {taxel:?}"
            );
        }
        let pressed = broken.taxels[27];
        assert!(
            (pressed.pressed() - 40e3).abs() < 5.0 * pressed.pressed_deviation(),
            "{column}: {pressed:?}"
        );
    }
}

/// A conductance at the end of the range is a pressed cell; a resistance there is an open line.
#[test]
fn a_reading_at_the_end_bounds_the_pressure_only_where_a_press_leads_there() {
    for (sensor, column) in networks() {
        let device = sensor.cells().unwrap();
        let chain = device.chain();
        let mut session = session(&sensor);
        let mut at_end = frame(chain, &[0.0; 64], 0, &mut Noise::seeded(4));
        at_end.values[26] = chain.last.scale().ends[1];
        session.push(&at_end).unwrap();
        let taxel = session.estimator().touch().taxels[26];
        assert_eq!(taxel.state, State::Saturated, "{column}");
        let bounded = taxel.pressed() == chain.full_scale;
        let falls = column.starts_with("float");
        assert!(
            if falls {
                taxel.pressed().is_nan()
            } else {
                bounded
            },
            "{column}: {taxel:?}"
        );
    }
}

#[test]
fn mistakes_are_shown_at_their_key() {
    let text = Sensor::shipped_text("resistive-mat-8x8").unwrap();
    for (from, to, key, message) in [
        (
            "rest = \"5 uS\"",
            "rest = \"5 fF\"",
            "element.cells.cell.resistor.conductance.rest",
            "a unit of capacitance; a conductance is needed",
        ),
        (
            "exponent = 0.7",
            "exponent = 7",
            "element.cells.cell.resistor.conductance.exponent",
            "out of range",
        ),
        (
            "rest_conductance = 0.1",
            "rest = 0.1",
            "element.cells.fabrication.rest",
            "no part of this device has a number \"rest\"",
        ),
        (
            "feedback = \"2 kohm\"",
            "feedback = \"20 kohm\"",
            "electronics.converter.range",
            "with one cell at full scale",
        ),
        (
            "full_scale = \"100 kPa\"",
            "full_scale = \"100 kPa\"\nrelaxaton = []",
            "element.cells.relaxaton",
            "unknown field",
        ),
    ] {
        let error = Sensor::parse("mat.toml", &text.replace(from, to)).unwrap_err();
        assert_eq!(error.key, key, "{error}");
        assert!(error.to_string().contains(message), "{error}");
    }
    let other = text
        .replace("transimpedance]", "reference_divider]")
        .replace("feedback", "reference");
    let error = Sensor::parse("mat.toml", &other).unwrap_err();
    assert!(error.to_string().contains("transimpedance"), "{error}");
}

/// A raw board of 12 x 32 cells with whole counts of 8 bits, as people have it: no electronics but
/// what the cells read at known pressures.
fn raw_board(points: &str) -> Sensor {
    Sensor::parse("raw.toml", &raw_text(points)).unwrap()
}

fn raw_text(points: &str) -> String {
    format!(
        r#"
schema = 2
name = "raw mat"
array = {{ rows = 12, columns = 32, pitch = "10 mm", mount = "flat" }}
[element.cells]
full_scale = "60 kPa"
cell.points = [{points}]
[electronics]
frame_rate = "50 Hz"
scan = "simultaneous"
readout = {{ digital = {{ unit = "counts", noise = 0.4 }} }}
"#
    )
}

const RISING: &str = r#"
    { pressure = "0 kPa", reading = 3 }, { pressure = "10 kPa", reading = 60 },
    { pressure = "30 kPa", reading = 140 }, { pressure = "80 kPa", reading = 255 }"#;
const FALLING: &str = r#"
    { pressure = "0 kPa", reading = 250.0 }, { pressure = "20 kPa", reading = 90 },
    { pressure = "80 kPa", reading = 0 }"#;

/// Counts of a board become kilopascals and newtons by the points alone, whatever each cell reads at
/// rest and whichever way its readings go.
#[test]
fn counts_of_a_raw_board_become_kilopascals_and_newtons() {
    for (points, rest, pressed, end) in [(RISING, 3.0, 140.0, 255.0), (FALLING, 250.0, 90.0, 0.0)] {
        let sensor = raw_board(points);
        let mut session = session(&sensor);
        session.begin_rest_capture(50);
        // Each cell has an offset of its own, and one count of flicker now and then.
        let offset = |cell: usize| (cell % 3) as f64;
        let mut push = |sequence: u64, change: f64| {
            let flicker =
                |cell: usize| f64::from(u8::from((cell as u64 + 7 * sequence).is_multiple_of(11)));
            let values = (0..384).map(|cell| {
                let moved = if cell == 100 { change } else { 0.0 };
                let reading = rest - offset(cell) * f64::from(u8::from(cell != 100)) + moved;
                (reading + if cell == 100 { 0.0 } else { -flicker(cell) }).max(0.0)
            });
            let frame = Frame {
                sequence,
                time_ns: 20_000_000 * sequence,
                values: values.collect(),
                ..Frame::default()
            };
            session.push(&frame).unwrap();
            session.estimator().touch().clone()
        };
        for sequence in 0..50 {
            push(sequence, 0.0);
        }
        let touch = push(50, pressed - rest);
        let at = if rest < pressed { 30e3 } else { 20e3 };
        let cell = touch.taxels[100];
        assert_eq!(cell.state, State::Ok);
        // The curve goes through its points: what is left is half a count of some 3 to 4 a kPa.
        assert!((cell.pressed() - at).abs() < 0.5e3, "{cell:?}");
        assert!(cell.pressed_deviation() < 0.5e3, "{cell:?}");
        assert_eq!(touch.contacts.len(), 1);
        // On a pitch of 1 cm².
        let force = touch.contacts[0].force[2];
        assert!((force - at * 1e-4).abs() < 0.05, "{force}");
        // The last number of the board is that of any greater pressure.
        let most = push(51, end - rest).taxels[100];
        assert_eq!(most.state, State::OutOfRange, "{most:?}");
        assert!(most.pressed() >= 55e3, "{most:?}");
    }
}

/// Cells that were measured one by one: the same reading is another pressure on each.
#[test]
fn each_cell_can_have_a_curve_of_its_own() {
    let readings = |of_cell: &dyn Fn(usize) -> f64| {
        let all: Vec<_> = (0..384).map(|cell| of_cell(cell).to_string()).collect();
        format!("[{}]", all.join(", "))
    };
    let gain = |cell: usize| 1.0 + 0.5 * (cell % 2) as f64;
    let points = |ends: String| {
        let middle = readings(&|cell| 3.0 + 60.0 * gain(cell));
        format!(
            "{{ pressure = \"0 kPa\", reading = 3 }}, {{ pressure = \"30 kPa\", reading = {middle} }}, {{ pressure = \"80 kPa\", reading = {ends} }}"
        )
    };
    let sensor = raw_board(&points(readings(&|cell| 3.0 + 130.0 * gain(cell))));
    let chain = sensor.cells().unwrap().chain().clone();
    assert_eq!(chain.laws(), 384);
    for cell in [100, 101] {
        // A curve goes through its points.
        assert_eq!(chain.cell(cell).value(30e3), 3.0 + 60.0 * gain(cell));
    }
    let mut session = session(&sensor);
    session.begin_rest_capture(50);
    for sequence in 0..51 {
        let reading = |cell: usize| match cell {
            100 | 101 if sequence == 50 => 63.0,
            _ => 3.0,
        };
        let frame = Frame {
            sequence,
            time_ns: 20_000_000 * sequence,
            values: (0..384).map(reading).collect(),
            ..Frame::default()
        };
        session.push(&frame).unwrap();
    }
    let touch = session.estimator().touch();
    let [one, other] = [100, 101].map(|cell| touch.taxels[cell].pressed());
    // Half a count of 60 is 0.25 kPa.
    assert!((one - 30e3).abs() < 0.25e3, "{one}");
    assert!(one - other > 5e3, "{one} {other}");
    // A calibration tells what all curves have in common.
    let mut names = Vec::new();
    let mut shared = chain.cell(0).boxed();
    shared.parameters(&mut |parameter, _| names.push((parameter.name, parameter.fitted)));
    assert_eq!(names, [("gain", true)]);
    let refused = |text: &str, message: &str| {
        let file = Sensor::parse("raw.toml", &raw_text(text)).unwrap_err();
        assert!(file.to_string().contains(message), "{file}");
    };
    refused(&points("[4, 5]".into()), "lists of different lengths");
    let two = "{ pressure = \"0 kPa\", reading = 0 }, { pressure = \"80 kPa\", reading = [9, 8] }";
    refused(two, "curves of 2 cells, and the array has 384");
    refused(
        &points(readings(&|cell| if cell == 5 { 0.0 } else { 300.0 })),
        "reading 6 of the lists: ",
    );
}

#[test]
fn points_are_checked_where_they_stand() {
    let point = |pressure: f64, reading: &str| {
        format!("{{ pressure = \"{pressure} kPa\", reading = {reading} }}")
    };
    let file = |points: &[String]| {
        let text = Sensor::shipped_text("pressure-chips-1x8").unwrap();
        let (head, rest) = text
            .split_once("[element.cells.cell.pressure_port]")
            .unwrap();
        let (_, rest) = rest.split_once("[element.cells.cover]").unwrap();
        let (cover, _) = rest.split_once("[electronics.readout").unwrap();
        let cover = cover.replace("cover_thickness = 0.03", "gain = 0.1");
        let cells = head.replace(
            "[element.cells]",
            &format!("[element.cells]\ncell.points = [{}]", points.join(", ")),
        );
        format!(
            "{cells}[element.cells.cover]{cover}[electronics.readout]\ndigital = {{ unit = \"counts\" }}\n"
        )
    };
    let sound = file(&[point(0.0, "0"), point(5.0, "80"), point(20.0, "200")]);
    let sensor = Sensor::parse("points.toml", &sound).unwrap();
    let chain = sensor.cells().unwrap().chain().clone();
    assert_eq!(chain.cell(0).value(5e3), 80.0);
    for (text, key, message) in [
        (
            file(&[point(0.0, "0")]),
            "element.cells.cell.points",
            "needs 2 points",
        ),
        (
            file(&[point(1.0, "0"), point(20.0, "9")]),
            "element.cells.cell.points",
            "first point",
        ),
        (
            file(&[point(0.0, "0"), point(5.0, "80"), point(20.0, "70")]),
            "element.cells.cell.points",
            "must always rise or always fall",
        ),
        (
            file(&[point(0.0, "0"), point(20.0, "\"3 pF\"")]),
            "element.cells.cell.points",
            "one reading is a plain number, another a capacitance",
        ),
        (
            file(&[point(0.0, "0"), point(9.0, "9")]),
            "element.cells.full_scale",
            "last point",
        ),
        (
            sound.replace(
                "[electronics]",
                "[electronics]\nconverter = { bits = 8, range = [\"0 V\", \"1 V\"] }",
            ),
            "electronics.converter",
            "converter of their own",
        ),
        (
            file(&[point(0.0, "\"9 kohm\""), point(20.0, "\"2 kohm\"")])
                .replace("[element.cells]", "[element.cells]\nnetwork = \"floating\"")
                .replace("digital = { unit = \"counts\" }", OHMS),
            "element.cells.network",
            "joins resistors alone",
        ),
    ] {
        let error = Sensor::parse("points.toml", &text).unwrap_err();
        assert_eq!(error.key, key, "{error}");
        assert!(error.to_string().contains(message), "{error}");
    }
}
