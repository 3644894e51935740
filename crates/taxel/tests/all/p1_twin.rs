//! The in-plane twin through its estimator, and the rules of its sensor file.
#![allow(clippy::unwrap_used)]

use taxel::acquisition::{Delivery, Frame, Quantity, Stimulus, Twin};
use taxel::device::ChainReader;
use taxel::estimation::{ArrayEstimator, FrameError, State, Touch};
use taxel::predict::{Load, LoadValue};
use taxel::sensor::Sensor;
use taxel::solutions::{Question, Solutions};
use taxel::stage::{CellLaw as _, InPlaneCell};
use taxel::summary::Value;
use taxel::table::Cell;
use taxel::transduction::InPlaneModel;

const REST_FRAMES: usize = 50;

fn shipped(gap: u32) -> Sensor {
    Sensor::shipped(&format!("in-plane-{gap}um")).unwrap()
}

fn edited(gap: u32, edits: &[(&str, &str)]) -> Result<Sensor, taxel::InputError> {
    let mut text = Sensor::shipped_text(&format!("in-plane-{gap}um"))
        .unwrap()
        .to_owned();
    for (from, to) in edits {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    Sensor::parse("edited.toml", &text)
}

struct Run {
    twin: Twin,
    estimator: ArrayEstimator,
}

fn estimator(sensor: &Sensor, quantity: Quantity) -> ArrayEstimator {
    let chain = sensor.in_plane().unwrap().chain().unwrap();
    ArrayEstimator::new(Box::new(chain.chain_reader(quantity).unwrap()))
}

impl Run {
    /// The gap by which the only taxel is read.
    fn gap(&self) -> f64 {
        let reader = self.estimator.reader::<ChainReader>().unwrap();
        let mut gap = f64::NAN;
        reader.chain().clone().parameters(&mut |parameter, value| {
            assert_eq!(parameter.name, "gap");
            gap = *value;
        });
        gap
    }

    fn new(sensor: &Sensor, script: &str) -> Self {
        Self::seeded(sensor, script, 11)
    }

    fn seeded(sensor: &Sensor, script: &str, seed: u64) -> Self {
        let stimulus = Stimulus::parse("script", script).unwrap();
        let twin = Twin::new(sensor, &stimulus, seed).unwrap();
        let mut estimator = estimator(sensor, Quantity::Counts);
        estimator.begin_rest_capture(REST_FRAMES);
        Self { twin, estimator }
    }

    fn frame(&mut self) -> Frame {
        loop {
            if let Delivery::Frame(frame) = self.twin.next_delivery() {
                return frame;
            }
        }
    }

    /// The next frame with its true pressing force on taxel 0.
    fn step(&mut self) -> (Touch, f64, f64) {
        let frame = self.frame();
        let truth = self.twin.true_forces(frame.time_ns)[0][2];
        let (touch, ended) = self.estimator.push(&frame).unwrap();
        assert!(!matches!(ended, Some(Err(_))), "{ended:?}");
        (touch.clone(), truth, frame.time_ns as f64 * 1e-9)
    }

    fn at(&mut self, time: f64) -> (Touch, f64) {
        loop {
            let (touch, truth, now) = self.step();
            if now >= time {
                return (touch, truth);
            }
        }
    }
}

fn hold(force: &str) -> String {
    format!(
        "schema = 1\nname = \"hold\"\nduration = \"20 s\"\n[[probe]]\ntaxel = [0, 0]\npath = [\n\
         {{ time = \"1.5 s\", force = [\"0 N\", \"0 N\", \"0 N\"] }},\n\
         {{ time = \"2 s\", force = [\"0 N\", \"0 N\", \"{force}\"] }},\n\
         {{ time = \"19 s\", force = [\"0 N\", \"0 N\", \"{force}\"] }}]\n"
    )
}

#[test]
fn shipped_press_is_estimated_within_its_own_error_bars() {
    for gap in [20, 50, 100] {
        let (mut squares, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
        for seed in 0..24 {
            let script = Stimulus::shipped_text("press").unwrap();
            let mut run = Run::seeded(&shipped(gap), script, seed);
            for _ in 0..1200 {
                let (touch, truth, time) = run.step();
                if time < 0.6 {
                    continue;
                }
                let taxel = touch.taxels[0];
                assert_eq!(taxel.state, State::Ok);
                let off = (taxel.pressed() - truth) / taxel.pressed_deviation();
                squares += off * off;
                worst = worst.max(off.abs());
                count += 1.0;
                let alone = [taxel.pressed(), taxel.pressed_deviation()];
                assert_eq!(touch.pressing_force().unwrap(), alone);
            }
        }
        let mean = squares / count;
        // Each run measures its noise over 50 frames, to 10 %: the mean square
        // of a run scatters by 20 %, that of 24 by 4 %, about 49/47 (the mean of
        // 1/s²); four of these. The largest of 27 000 normal draws is about 4.2,
        // more by a tenth or two where the noise was measured too small.
        assert!((mean - 49.0 / 47.0).abs() < 0.16, "gap {gap}: {mean}");
        assert!(worst < 5.5, "gap {gap}: {worst}");
    }
}

#[test]
fn the_rest_capture_finds_the_made_gap() {
    let sensor = shipped(50);
    let device = sensor.in_plane().unwrap();
    let made = device.element.fabricate(1)[0].electrodes.gap;
    let drawn = device.model().electrodes.gap;
    assert!((made - drawn).abs() > 1e-7, "the piece has no scatter");
    let mut run = Run::new(&sensor, &hold("10 N"));
    for _ in 0..REST_FRAMES {
        run.step();
    }
    assert!(!run.estimator.capturing());
    let found = run.gap();
    // 0.15 fF/√50 of 1115 fF, whose slope is about -0.5 C/D: 2e-9 m; five of them.
    assert!((found - made).abs() < 1e-8, "{found} {made}");
    run.estimator.clear_rest();
    assert_eq!(run.gap(), drawn);
}

#[test]
fn a_moving_rest_capture_is_refused_and_changes_nothing() {
    let sensor = shipped(20);
    let mut run = Run::new(&sensor, &hold("10 N"));
    run.at(1.6);
    run.estimator.begin_rest_capture(REST_FRAMES);
    let before = run.gap();
    let refused = (0..REST_FRAMES).find_map(|_| {
        let frame = run.frame();
        run.estimator.push(&frame).unwrap().1
    });
    let message = refused.unwrap().unwrap_err().to_string();
    assert!(message.contains("moved during it"), "{message}");
    assert_eq!(run.gap(), before);
}

#[test]
fn what_cannot_be_read_is_a_state_with_its_limit() {
    // By mechanics the range ends at a compression of 0.3.
    let sensor = shipped(50);
    let last = sensor.in_plane().unwrap().model().inverse().unwrap();
    let mut found = estimator(&sensor, Quantity::Capacitance);
    let mut read = |capacitance: f64| {
        let frame = Frame {
            sequence: 0,
            time_ns: 0,
            values: vec![capacitance],
            ..Frame::default()
        };
        let touch = found.push(&frame).unwrap().0.clone();
        (touch.taxels[0], touch.pressing_force())
    };
    let end = last.last();
    let (taxel, total) = read(end.capacitance - 1e-15);
    assert_eq!(taxel.state, State::OutOfRange);
    assert_eq!(taxel.pressed(), end.layer.force);
    // The only taxel does not count: there is no total, not one of zero.
    assert_eq!(total, None);
    let rest = last.model().rest_capacitance();
    assert_eq!(read(rest + 2e-15).0.state, State::BelowZero);
    assert_eq!(read(0.3 * rest).0.state, State::Faulty);
    assert_eq!(read(f64::NAN).0.state, State::Faulty);
    // Noise about zero has no bias: as much pull as push.
    let [push, pull] = [-1e-16, 1e-16].map(|off| read(rest + off).0);
    assert_eq!(push.state, State::Ok);
    // A change of 1e-16 F is a difference of values near 1e-12 F.
    assert!(
        (push.pressed() + pull.pressed()).abs() < 1e-10,
        "{push:?} {pull:?}"
    );
    // The published curve of the narrow gap turns.
    let published = edited(20, &[("law = \"mechanics\"", "law = \"published\"")]).unwrap();
    let inverse = published.in_plane().unwrap().model().inverse().unwrap();
    let mut estimator = estimator(&published, Quantity::Capacitance);
    let frame = |capacitance| Frame {
        sequence: 0,
        time_ns: 0,
        values: vec![capacitance],
        ..Frame::default()
    };
    let beyond = inverse.last().capacitance - 1e-15;
    let touch = estimator.push(&frame(beyond)).unwrap().0;
    assert_eq!(touch.taxels[0].state, State::Ambiguous);
    // At rest its slope is infinite, yet the deviation of the force is not zero.
    let touch = estimator
        .push(&frame(inverse.model().rest_capacitance()))
        .unwrap()
        .0;
    assert!(touch.taxels[0].pressed_deviation() > 0.0);
}

#[test]
fn a_dead_line_is_faulty_and_a_masked_taxel_is_not_used() {
    let dead = "schema = 1\nname = \"dead\"\nduration = \"9 s\"\n[[fault]]\nchannel = { taxel = [0, 0] }\n\
                reads = \"dead\"\nfrom = \"1 s\"\nto = \"2 s\"\n";
    let mut run = Run::new(&shipped(20), dead);
    let (touch, _) = run.at(1.5);
    assert_eq!(touch.taxels[0].state, State::Faulty);
    assert_eq!(touch.clipped, 1);
    assert!(touch.contacts.is_empty());
    let text =
        Sensor::shipped_text("in-plane-20um").unwrap().to_owned() + "\n[[mask]]\ntaxel = [0, 0]\n";
    let sensor = Sensor::parse("masked.toml", &text).unwrap();
    let (touch, _) = Run::new(&sensor, &hold("10 N")).at(2.5);
    assert_eq!(touch.taxels[0].state, State::Masked);
    assert!(touch.taxels[0].pressed().is_nan());
}

#[test]
fn frames_of_another_device_are_refused() {
    let sensor = shipped(20);
    let chain = sensor.in_plane().unwrap().chain().unwrap();
    assert!(chain.chain_reader(Quantity::Pressure).is_err());
    let mut estimator = estimator(&sensor, Quantity::Counts);
    let frame = Frame {
        sequence: 0,
        time_ns: 0,
        values: vec![1.0; 2],
        ..Frame::default()
    };
    let refused = estimator.push(&frame).unwrap_err();
    assert_eq!(
        refused,
        FrameError::Channels {
            found: 2,
            expected: 1
        }
    );
}

#[test]
fn same_seed_gives_the_same_frames_and_touches() {
    let run = || Run::new(&shipped(100), &hold("5 N"));
    let (mut a, mut b) = (run(), run());
    for _ in 0..300 {
        assert_eq!(format!("{:?}", a.step()), format!("{:?}", b.step()));
    }
}

#[test]
fn mistakes_in_the_sensor_file_are_shown_at_their_key() {
    let element = "element.in_plane_capacitor";
    for (from, to, key, part) in [
        (
            "height = \"550 um\"",
            "height = \"900 um\"",
            "electrodes.height",
            "do not lie in a layer of 950 um",
        ),
        (
            "contact_half_length = \"1750 um\"",
            "contact_half_length = \"2 mm\"",
            "layer.contact_half_length",
            "the layer is 3500 um wide",
        ),
        (
            "width = \"1 mm\"",
            "width = \"500 um\"",
            "electrodes",
            "electrode width over electrode thickness = 5.0000 is outside 9.9000 to 10.1000",
        ),
        (
            "end_condition = \"short_layer\"",
            "end_condition = { tapered = { zeta = 1, m = 1 } }",
            "layer.end_condition",
            "an end factor of 0.333 is below 0.65",
        ),
        (
            "end_condition = \"short_layer\"",
            "end_condition = { given = { chi = 0.5 } }",
            "layer.end_condition.given.chi",
            "must be at least 0.65",
        ),
        (
            "top = \"frictionless\"",
            "top = \"gripped\"",
            "electrodes",
            "frictionless layers between base and probe",
        ),
        (
            "gap_deviation = \"0.4 um\"",
            "gap_deviation = \"1 um\"",
            "fabrication.gap_deviation",
            "more than a tenth of the gap of 20 um",
        ),
    ] {
        let error = edited(20, &[(from, to)]).unwrap_err();
        assert_eq!(error.key, format!("{element}.{key}"), "{error}");
        assert!(error.to_string().contains(part), "{error}");
    }
    let error = edited(20, &[("feedback = \"2.2 pF\"", "feedback = \"1 pF\"")]).unwrap_err();
    assert_eq!(error.key, "electronics.converter.range");
    let fit = "thinning = { least_thickness = 0.7, rate = 25 }\nfringe = { scale = 1.85, exponent = -0.4 }\n";
    let edits = [
        ("law = \"mechanics\"", "law = \"published\""),
        ("[element.in_plane_capacitor.published_fit]\n", ""),
        (fit, ""),
    ];
    let error = edited(20, &edits).unwrap_err();
    assert_eq!(error.key, "element.in_plane_capacitor.law");
    // A soft electrode needs no table, whatever its place and width.
    let soft = [
        (
            "stiffness = { modulus = { youngs_modulus = \"2.1 MPa\" } }",
            "stiffness = \"as_layer\"",
        ),
        ("width = \"1 mm\"", "width = \"500 um\""),
        ("height = \"550 um\"", "height = \"300 um\""),
        ("top = \"frictionless\"", "top = \"gripped\""),
    ];
    assert!(edited(20, &soft).is_ok());
}

#[test]
fn grounded_base_shortens_what_can_be_read_back() {
    let grounded = |gap: u32| {
        let edit = (
            "surroundings = \"uniform\"",
            "surroundings = \"grounded_base\"",
        );
        edited(gap, &[edit]).map(|sensor| sensor.in_plane().unwrap().model())
    };
    // The differential capacitance of the wide gap falls, then rises again as
    // the electrodes come nearer to the base.
    let wide: InPlaneModel = grounded(100).unwrap();
    let inverse = wide.inverse().unwrap();
    assert!(inverse.turning().is_some());
    assert!(inverse.last().layer.kinematics.compression() < 0.1);
    assert_eq!(grounded(20).unwrap().inverse().unwrap().turning(), None);
}

#[test]
fn the_table_of_answers_has_a_cell_for_every_column() {
    for gap in [20, 50, 100] {
        let sensor = shipped(gap);
        let device = sensor.device().unwrap();
        let predictor = device.predictor().unwrap();
        for (column, values) in [
            (0, vec![0.0, 95e-6, 300e-6, 500e-6]),
            (1, vec![0.0, 0.1, 0.35, 0.5, 0.75]),
            (2, vec![0.0, 1.0, 80.0, 1e6]),
            (3, vec![0.0, 1e-14, 1e-10]),
        ] {
            for value in values {
                let mut load = [None; 4];
                load[column] = Some(LoadValue::Number(value));
                let mut row = Vec::new();
                predictor.answer(&Load::of(&load), &mut row).unwrap();
                assert_eq!(row.len(), predictor.columns().len());
                let finite = row.iter().all(|cell| match cell {
                    Cell::Number(number) => number.is_finite(),
                    _ => true,
                });
                assert!(finite, "{column} {value}: {row:?}");
            }
            // Where the force of the law would fall, and where there is no layer.
            for refused in [0.77, 0.9999, 1.0] {
                let mut load = [None; 4];
                load[1] = Some(LoadValue::Number(refused));
                let error = predictor
                    .answer(&Load::of(&load), &mut Vec::new())
                    .unwrap_err();
                assert_eq!(error.column, 1);
            }
        }
    }
}

/// The curve of the way back passes within 1e-7 of the force at its end by the tolerance that it is
/// made with; the search of a root is exact but for rounding.
#[test]
fn the_way_back_is_that_of_any_law() {
    for gap in [20, 50, 100] {
        let model = shipped(gap).in_plane().unwrap().model();
        let largest = model.inverse().unwrap().last().layer.force;
        let searched = InPlaneCell::new(model.clone());
        let looked_up = InPlaneCell::invertible(model).unwrap();
        for step in -40..=40 {
            let force = largest * f64::from(step) / 40.0 * (1.0 - 1e-9);
            let value = looked_up.value(force);
            let by_root = searched.inverse(value, largest);
            // The bracket ends at a ten-digit root of capacitances that differ by a few per cent.
            assert!(
                (by_root - force).abs() < 1e-9 * largest,
                "{gap}: {by_root} {force}"
            );
            let by_curve = looked_up.inverse(value, largest);
            assert!(
                (by_curve - force).abs() < 1e-7 * largest,
                "{gap}: {by_curve} {force}"
            );
        }
    }
}

/// A tenth of 300 um over three is 10 um: bounds are compared as decimals, in every unit.
#[test]
fn a_bound_that_is_met_exactly_is_kept() {
    let with = |deviation: &str| {
        edited(
            50,
            &[
                ("gap = \"50 um\"", "gap = \"90 um\""),
                (
                    "gap_deviation = \"1 um\"",
                    &format!("gap_deviation = \"{deviation}\""),
                ),
            ],
        )
    };
    for exact in ["3 um", "0.003 mm", "3000 nm", "3e-6 m"] {
        assert!(
            with(exact).is_ok(),
            "{exact}: {:?}",
            with(exact).unwrap_err()
        );
    }
    let error = with("3.000001 um").unwrap_err();
    assert_eq!(error.help, "give at most 3 um");
    // The layer is as wide as its electrodes, and its pitch as the layer.
    let widths = [
        ("layer_width = \"3.5 mm\"", "layer_width = \"2.05 mm\""),
        (
            "contact_half_length = \"1750 um\"",
            "contact_half_length = \"1025 um\"",
        ),
        (
            "pitch = [\"3.5 mm\", \"10 mm\"]",
            "pitch = [\"2050 um\", \"10 mm\"]",
        ),
    ];
    edited(50, &widths).unwrap();
}

/// Whoever solves it here fails the test.
struct Unasked;

impl Solutions for Unasked {
    fn kept(&mut self, question: &Question) -> Option<String> {
        panic!("asked for the {}", question.what)
    }

    fn keep(&mut self, _: &Question, _: &str) {}
}

/// What is wrong with the board is said before a solution of half a minute.
#[test]
fn rules_of_the_board_come_before_solutions() {
    // A wide gap needs a solution.
    let wide = |from: &str, to: &str| {
        let text = Sensor::shipped_text("in-plane-50um").unwrap();
        assert!(text.contains(from), "{from}");
        let text = text
            .replace("gap = \"50 um\"", "gap = \"150 um\"")
            .replace(from, to);
        Sensor::parse_with("wide.toml", &text, &mut Unasked).unwrap_err()
    };
    for (from, to, key, says) in [
        (
            "feedback = \"1.5 pF\"",
            "feedback = \"0.1 pF\"",
            "electronics.converter.range",
            "facing sides alone",
        ),
        (
            "frame_rate = \"100 Hz\"",
            "frame_rate = \"10 kHz\"",
            "electronics.frame_rate",
            "one scan takes",
        ),
    ] {
        let error = wide(from, to);
        assert_eq!(error.key, key, "{error}");
        assert!(error.to_string().contains(says), "{error}");
    }
}

/// `check` states the error that `predict` states at the worst of the loads that were compared.
#[test]
fn check_and_predict_state_one_error_of_the_force() {
    for end in ["short_layer", "wide_layer"] {
        let to = format!("end_condition = \"{end}\"");
        let sensor = edited(50, &[("end_condition = \"short_layer\"", &to)]).unwrap();
        let facts = taxel::summary::summary(&sensor).unwrap();
        let stated = facts
            .iter()
            .find(|fact| fact.name == "force_error")
            .unwrap();
        let Value::Number { si: stated, .. } = stated.value else {
            panic!("{end}: {stated:?}");
        };
        let model = sensor.in_plane().unwrap().model();
        let last = model
            .inverse()
            .unwrap()
            .last()
            .layer
            .kinematics
            .compression();
        let errors = (0..=600).map(|step| model.force_error(last * f64::from(step) / 600.0));
        let most = errors.flatten().fold(0.0, f64::max);
        assert_eq!(stated, most, "{end}");
    }
}

/// The three things that are asked first are the first three lines, for every shipped sensor.
#[test]
fn a_summary_begins_with_range_resolution_and_what_limits_them() {
    for name in Sensor::shipped_names() {
        let sensor = Sensor::shipped(name).unwrap();
        let facts = taxel::summary::summary(&sensor).unwrap();
        let first: Vec<&str> = facts[..3].iter().map(|fact| fact.name.as_str()).collect();
        assert_eq!(first, ["range", "resolution", "limited_by"], "{name}");
        let number = |index: usize| match facts[index].value {
            Value::Number { si, .. } => Some(si),
            Value::Text(_) => None,
        };
        // Nothing of a trained array is known before its training.
        let trained = sensor.trained().is_ok();
        assert!(number(0).is_some_and(|range| range > 0.0), "{name}");
        assert_eq!(number(1).is_none(), trained, "{name}");
        if let Some(resolution) = number(1) {
            assert!(
                resolution > 0.0 && resolution < number(0).unwrap(),
                "{name}"
            );
        }
    }
}
