//! The array of liquid-metal channels from file to touch.
#![allow(clippy::unwrap_used)]

use crate::common::{assert_near, table};
use taxel::acquisition::{Delivery, Frame, Stimulus, Twin};
use taxel::device::{Device, MicrochannelLayerState, MicrochannelPredictor};
use taxel::estimation::{ArrayEstimator, Certainty, Contact, State, Touch};
use taxel::mechanics::Stretch;
use taxel::predict::{Load, LoadValue, Loads, Predictor};
use taxel::sensor::Sensor;
use taxel::summary::{Value, summary};
use taxel::table::Cell;
use taxel::transduction::MicrochannelLayer;
use taxel_numerics::OnCurve;

const NAME: &str = "liquid-metal-2x4";
const KPA: f64 = 1e3;

fn sensor() -> Sensor {
    Sensor::shipped(NAME).unwrap()
}

fn edited(from: &str, to: &str) -> Result<Sensor, taxel::InputError> {
    let text = Sensor::shipped_text(NAME).unwrap();
    assert!(text.contains(from), "{from}");
    Sensor::parse("edited.toml", &text.replacen(from, to, 1))
}

fn fact(name: &str) -> f64 {
    let facts = summary(&sensor()).unwrap();
    let fact = facts.iter().find(|fact| fact.name == name);
    match fact.unwrap_or_else(|| panic!("no fact {name}")).value {
        Value::Number { si, .. } => si,
        Value::Text(ref text) => panic!("{text}"),
    }
}

#[test]
fn facts_are_those_of_the_paper() {
    assert_near(fact("shear_modulus"), 162.4e3, 1e-12, 0.0, "mu");
    assert_near(fact("stack_thickness"), 420e-6, 1e-12, 0.0, "stack");
    // Printed 0.505 V; the length of the file is rounded to 10 um.
    assert_near(fact("column_rest_voltage"), 0.505, 0.0, 5e-4, "rest");
    assert_near(fact("column_rest_resistance"), 3.378, 0.0, 5e-4, "rest");
    assert_near(
        fact("closed_form_closing_pressure") / KPA,
        16.67,
        0.0,
        0.005,
        "Eq. 1",
    );
    // First touch at 64.863 kPa in the reference.
    assert_near(
        fact("column_first_touch_pressure") / KPA,
        64.86,
        0.0,
        0.02,
        "touch",
    );
    assert_near(fact("saturation_resistance"), 656.67, 0.0, 0.005, "1.97 V");
    // The slope at rest with Eq. 2: c0/(1 + c0 eta P_atm).
    let c0 = 0.105234e-3;
    let slope = c0 / (1.0 + c0 * 20.265e3);
    // Taken over 1 Pa: curvature of 1e-4 of it.
    assert_near(fact("column_sensitivity"), slope, 1e-3, 0.0, "sensitivity");
    // The lower curve ends where the three-dimensional calculation does.
    assert_near(
        fact("row_curve_ends_at_pressure") / KPA,
        25.0,
        0.0,
        0.001,
        "end",
    );
    assert!(fact("row_resolution") > 0.0 && fact("column_resolution") < fact("row_resolution"));
}

#[test]
fn prediction_is_the_three_dimensional_calculation() {
    let sensor = sensor();
    let predictor = MicrochannelPredictor::new(&sensor.microchannels().unwrap());
    for row in table("p4_two_layer_3d.csv") {
        // A hair below the end of the curve of the lower layer.
        let answer = predictor
            .predict(row.at("p") * KPA * (1.0 - 1e-6), 1.0)
            .unwrap();
        let [rows, columns] = &answer.layers;
        // The file gives the lower layer by these rows, q to 5 digits.
        assert_near(rows.volume_ratio, row.at("vol_bottom"), 0.0, 1e-5, "bottom");
        assert_near(
            rows.parts[0].thinnest.unwrap(),
            row.at("worst_bottom"),
            0.0,
            1e-4,
            "worst bottom",
        );
        // The upper one by a plane-strain cell: 0.006 (see p4_reference.rs).
        assert_near(columns.volume_ratio, row.at("vol_top"), 0.0, 0.006, "top");
        // The thinnest section falls 1.4 times as fast as the mean.
        assert_near(
            columns.parts[0].thinnest.unwrap(),
            row.at("worst_top"),
            0.0,
            1.4 * 0.006,
            "worst top",
        );
        assert_eq!(rows.state, MicrochannelLayerState::Open);
    }
    let beyond = predictor.predict(26e3, 1.0).unwrap();
    assert_eq!(beyond.layers[0].state, MicrochannelLayerState::Beyond);
    assert_eq!(beyond.layers[1].state, MicrochannelLayerState::Open);
    assert_eq!(
        beyond.layers[0].parts[0].thinnest.map(|at| at >= 0.443),
        Some(true)
    );
}

#[test]
fn loads_are_pressures_or_forces_with_an_area() {
    let sensor = sensor();
    let device = sensor.device().unwrap();
    let predictor = device.predictor().unwrap();
    let answer = |spec: &str| {
        let loads = Loads::one(spec, predictor.load_columns()).unwrap();
        predictor.combination(&loads.given.columns)?;
        let mut row = Vec::new();
        predictor.answer(&loads.load(0), &mut row).unwrap();
        assert_eq!(row.len(), predictor.columns().len());
        Ok::<_, String>(row)
    };
    // 25 mN on 1.0 mm² are 25 kPa: the same answers but for one rounding.
    let by_pressure = answer("p=25 kPa").unwrap();
    for pair in by_pressure
        .iter()
        .zip(answer("fz=25 mN, area=1 mm2").unwrap())
    {
        match pair {
            (Cell::Number(a), Cell::Number(b)) => assert_near(*a, b, 1e-13, 0.0, "number"),
            (Cell::Whole(a), Cell::Whole(b)) => assert_eq!(*a, b),
            (Cell::Text(a), Cell::Text(b)) => assert_eq!(*a, b),
            (Cell::State(a), Cell::State(b)) => assert_eq!(*a, b),
            other => panic!("{other:?}"),
        }
    }
    assert!(matches!(&by_pressure[2], Cell::Text(word) if word == "closed"));
    let refused = answer("fz=25 mN").unwrap_err();
    assert!(refused.contains("without the area"), "{refused}");
    for wrong in [
        "area=1 mm2",
        "p=1 kPa, fz=1 mN",
        "share=0.5",
        "p=1 kPa, area=1 mm2",
    ] {
        assert!(answer(wrong).is_err(), "{wrong}");
    }
    // A curve lets the force grow and keeps the area.
    assert_eq!(
        [0, 1, 2, 3].map(|column| predictor.scales_with_load(column)),
        [true, true, false, false]
    );
}

#[test]
fn every_answer_is_a_number_or_a_word() {
    let sensor = sensor();
    let device = sensor.device().unwrap();
    let predictor = device.predictor().unwrap();
    for pressure in [0.0, 1.0, 1e3, 24e3, 30e3, 70e3, 340e3, 1e6, 100e6] {
        for share in [1e-6, 0.0065, 0.5, 1.0] {
            let load = [
                Some(LoadValue::Number(pressure)),
                None,
                None,
                Some(LoadValue::Number(share)),
            ];
            let mut row = Vec::new();
            predictor.answer(&Load::of(&load), &mut row).unwrap();
            for (cell, column) in row.iter().zip(predictor.columns()) {
                if let Cell::Number(value) = cell {
                    assert!(value.is_finite(), "{} at {pressure} Pa", column.name);
                }
            }
        }
    }
}

#[test]
fn mistakes_are_shown_at_their_key() {
    for (from, to, key) in [
        (
            "width = \"400 um\"",
            "width = \"600 um\"",
            "element.microchannel",
        ),
        (
            "roof = \"140 um\"",
            "roof = \"150 um\"",
            "element.microchannel.columns",
        ),
        (
            "roof = \"300 um\"",
            "roof = \"145 um\"",
            "element.microchannel.rows.roof",
        ),
        (
            "net_pressure = \"5.2334 kPa\"",
            "net_pressure = \"1 kPa\"",
            "element.microchannel.rows",
        ),
        (
            "length = \"91.92 mm\"",
            "length = \"1 mm\"",
            "element.microchannel.columns.length",
        ),
        (
            "saturation = \"1.97 V\"",
            "saturation = \"2 V\"",
            "electronics.readout.voltage_divider.saturation",
        ),
        (
            "noise = \"10 uV\"",
            "noise = \"10 ohm\"",
            "electronics.readout.voltage_divider.noise",
        ),
        (
            "height_deviation = \"0.5 um\"",
            "height_deviation = \"5 um\"",
            "element.microchannel.fabrication.height_deviation",
        ),
        (
            "[\"0 V\", \"2.5 V\"]",
            "[\"0 V\", \"0.5 V\"]",
            "electronics.converter.range",
        ),
    ] {
        let error = edited(from, to).unwrap_err();
        assert!(error.key.starts_with(key), "{to}: {error}");
    }
    let error = edited("roof = \"140 um\"", "roof = \"150 um\"").unwrap_err();
    assert!(
        error.message.contains("20/140"),
        "the known designs are named: {error}"
    );
}

fn estimator(sensor: &Sensor, twin: &Twin) -> ArrayEstimator {
    ArrayEstimator::new(
        sensor
            .microchannels()
            .unwrap()
            .reader(&twin.stream())
            .unwrap(),
    )
}

/// Runs a script and returns the touch at each time, s, after a rest capture in
/// the first 0.4 s.
fn run(script: &str, times: &[f64]) -> Vec<Touch> {
    let sensor = sensor();
    let stimulus = Stimulus::parse(script, Stimulus::shipped_text(script).unwrap()).unwrap();
    let mut twin = Twin::new(&sensor, &stimulus, 1).unwrap();
    let mut estimator = estimator(&sensor, &twin);
    estimator.begin_rest_capture(40);
    let mut found = Vec::new();
    while found.len() < times.len() {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            panic!()
        };
        let time = frame.time_ns as f64 * 1e-9;
        let (touch, ended) = estimator.push(&frame).unwrap();
        assert_eq!(ended.is_some(), frame.sequence == 39);
        assert!(ended.is_none_or(|ended| ended.is_ok()));
        if time >= times[found.len()] {
            found.push(touch.clone());
        }
    }
    found
}

#[test]
fn a_pad_is_found_on_its_taxel_with_its_pressure() {
    for (script, place) in [("pad-b", 1), ("pad-c", 2), ("pad-d", 5), ("pad-e", 6)] {
        let touches = run(script, &[0.45, 1.75, 4.0]);
        assert!(touches[0].contacts.is_empty(), "{script}");
        assert_eq!(touches[0].pressing_force().unwrap()[0], 0.0);
        // 1.25 of 3 s up to 4 mN, on a cell of 0.36 mm²; the frame starts
        // within 10 ms of the time, which is 13 uN.
        let force = 4e-3 * 1.25 / 3.0;
        let touch = &touches[1];
        let taxel = touch.taxels[place];
        assert_eq!(taxel.state, State::Ok);
        let [found, deviation] = touch.pressing_force().unwrap();
        // Noise, 13 uN of time, and 2.5 % of scatter of the heights, of which
        // rest capture takes all but its effect on the closing curve, none here.
        assert_near(found, force, 0.0, 13.4e-6 + 6.0 * deviation, script);
        assert_eq!(touch.contacts.len(), 1);
        assert_eq!(touch.contacts[0].peak_taxel, place);
        let quiet = touch
            .taxels
            .iter()
            .filter(|taxel| taxel.pressed() == 0.0)
            .count();
        assert_eq!(quiet, 7, "{script}");
        // At 4 mN the lower layer is beyond its curve; the upper one still reads.
        let touch = &touches[2];
        let [found, deviation] = touch.pressing_force().unwrap();
        assert_near(found, 4e-3, 1e-3, 6.0 * deviation, script);
        assert!(touch.taxels[place].state == State::Ok);
    }
}

#[test]
fn the_bar_presses_all_channels_and_is_not_placed() {
    let touch = &run("pad-a", &[4.0])[0];
    assert!(
        touch
            .taxels
            .iter()
            .all(|taxel| taxel.state == State::Ambiguous)
    );
    assert!(touch.taxels.iter().all(|taxel| taxel.pressed().is_nan()));
    assert_eq!(touch.pressing_force(), None);
    // What was touched as the bar came is a contact still, of which nothing is known.
    let unknown = |contact: &Contact| contact.certainty == Certainty::Unknown;
    assert!(touch.contacts.iter().all(unknown));
    for (signal, rest) in touch.channels.readings.iter().zip(&touch.channels.rest) {
        assert!(signal > rest);
    }
}

#[test]
fn channels_are_rows_from_plus_y_then_columns_from_minus_x() {
    let sensor = sensor();
    let stimulus = Stimulus::parse("b", Stimulus::shipped_text("pad-b").unwrap()).unwrap();
    let twin = Twin::new(&sensor, &stimulus, 1).unwrap();
    let estimator = estimator(&sensor, &twin);
    let names = [
        "row 0", "row 1", "column 0", "column 1", "column 2", "column 3",
    ];
    assert_eq!(estimator.meaning().channels, names);
    // Pad b presses channels 0 and 3.
    let touch = &run("pad-b", &[3.0])[0];
    let rise: Vec<_> = touch
        .channels
        .readings
        .iter()
        .zip(&touch.channels.rest)
        .map(|(now, rest)| now / rest - 1.0)
        .collect();
    for (channel, rise) in rise.into_iter().enumerate() {
        assert_eq!(
            rise > 1e-3,
            [0, 3].contains(&channel),
            "channel {channel}: {rise}"
        );
    }
}

#[test]
fn a_dead_channel_and_a_saturated_one_are_distinguished() {
    let sensor = sensor();
    let stimulus = Stimulus::parse("b", Stimulus::shipped_text("pad-b").unwrap()).unwrap();
    let mut twin = Twin::new(&sensor, &stimulus, 1).unwrap();
    let mut estimator = estimator(&sensor, &twin);
    estimator.begin_rest_capture(20);
    let frame = loop {
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        if estimator.push(&frame).unwrap().1.is_some() {
            break frame;
        }
    };
    let with = |channel: usize, counts: f64| {
        let mut frame = frame.clone();
        frame.values[channel] = counts;
        frame
    };
    let mut states = |frame: Frame| {
        let (touch, _) = estimator.push(&frame).unwrap();
        (
            touch
                .taxels
                .iter()
                .map(|taxel| taxel.state)
                .collect::<Vec<_>>(),
            touch.clipped,
        )
    };
    // Column 1 open (2.0 V of 2.5 V): somewhere on it is a touch that no row
    // shows; nobody knows where.
    let open = (2.0_f64 / 2.5 * 262144.0).floor();
    let (found, clipped) = states(with(3, open));
    assert_eq!(
        [found[1], found[5], found[0]],
        [State::Ambiguous, State::Ambiguous, State::Ok]
    );
    assert_eq!(clipped, 0);
    // Column 1 dead: nothing presses, so all is quiet.
    let (found, clipped) = states(with(3, 0.0));
    assert!(found.iter().all(|state| *state == State::Ok));
    assert_eq!(clipped, 1);
    // Column 1 dead and row 0 open: the touch may be on column 1.
    let mut both = with(3, 0.0);
    both.values[0] = open;
    let (found, _) = states(both);
    assert_eq!(found[1], State::Faulty);
    let channels = Frame {
        values: vec![0.0; 5],
        ..frame.clone()
    };
    assert!(estimator.push(&channels).is_err());
}

#[test]
fn a_rest_capture_under_load_is_refused() {
    let sensor = sensor();
    let stimulus = Stimulus::parse("b", Stimulus::shipped_text("pad-b").unwrap()).unwrap();
    let mut twin = Twin::new(&sensor, &stimulus, 1).unwrap();
    let mut estimator = estimator(&sensor, &twin);
    let mut ends = Vec::new();
    for sequence in 0..200 {
        if sequence == 100 {
            estimator.begin_rest_capture(50);
        }
        let Delivery::Frame(frame) = twin.next_delivery() else {
            panic!()
        };
        ends.extend(estimator.push(&frame).unwrap().1);
    }
    let refused = ends.remove(0).unwrap_err().to_string();
    // The two channels that pad b presses.
    assert!(refused.contains("2 of 6 channels moved"), "{refused}");
}

/// The shipped array with another law for its liquid.
fn with_law(law: &str) -> Sensor {
    let text = Sensor::shipped_text(NAME).unwrap();
    let start = text
        .find("[element.microchannel.liquid.pressure.paper]")
        .unwrap();
    let end = start + text[start..].find("\n\n").unwrap();
    let text = format!("{}{}", &text[..start], &text[end..]);
    let key = "resistivity = \"294 nohm m\"";
    assert!(text.contains(key));
    Sensor::parse(
        "law.toml",
        &text.replacen(key, &format!("pressure = {law}\n{key}"), 1),
    )
    .unwrap()
}

/// With every law a pressure on one taxel comes back from the two channels.
#[test]
fn the_estimator_inverts_the_model_with_every_law() {
    let table = "{ tabulated = [{ volume_ratio = 1.0, pressure = \"0 Pa\" }, \
                 { volume_ratio = 0.999, pressure = \"200 Pa\" }, { volume_ratio = 0.5, pressure = \"60 kPa\" }] }";
    let paper = "{ paper = { expansion = 0.2, atmosphere = \"101.325 kPa\" } }";
    for law in [paper, "\"vented\"", "\"sealed\"", table] {
        let sensor = with_law(law);
        let array = sensor.microchannels().unwrap();
        let calibration = array.calibration().unwrap();
        let models = [&calibration.rows[0], &calibration.columns[0]];
        for (layer, model) in models.into_iter().enumerate() {
            let share = array.taxel_share()[layer];
            let highest = model.highest_pressure();
            for step in 1..40 {
                // Between the 200 points of the curve, on all parts of it.
                let pressure = highest * (f64::from(step) + 0.37) / 40.5;
                let stretches = [
                    Stretch { share, pressure },
                    Stretch {
                        share: 1.0 - share,
                        pressure: 0.0,
                    },
                ];
                let change = array.layers[layer].respond(&stretches).unwrap().change;
                let OnCurve::Inside { value, .. } = model.pressure.at(change) else {
                    panic!("{law} {layer} {pressure}")
                };
                // 1e-3 of the range: the curve bends sharply at the first touch.
                assert_near(value, pressure, 0.0, 1e-3 * highest, law);
            }
        }
    }
}

#[test]
fn leads_are_taken_out_of_the_reading() {
    let sensor = edited("lead = \"0 ohm\"", "lead = \"0.5 ohm\"").unwrap();
    let stimulus = Stimulus::parse("b", Stimulus::shipped_text("pad-b").unwrap()).unwrap();
    let mut twin = Twin::new(&sensor, &stimulus, 1).unwrap();
    let mut estimator = estimator(&sensor, &twin);
    let Delivery::Frame(frame) = twin.next_delivery() else {
        panic!()
    };
    let (touch, _) = estimator.push(&frame).unwrap();
    for (channel, conductor) in touch.channels.readings.iter().zip(
        sensor
            .microchannels()
            .unwrap()
            .element
            .fabricate(&sensor.microchannels().unwrap().layers, [2, 4]),
    ) {
        // Six standard deviations of 10.4 uV at 9.6 ohm/V.
        assert_near(
            *channel,
            conductor.rest_resistance(),
            0.0,
            6.0 * 1e-4,
            "resistance",
        );
    }
}

/// Channels along x lie side by side along y, and are crossed along x.
#[test]
fn the_two_pitches_belong_to_the_two_directions() {
    let sensor = edited("pitch = \"600 um\"", "pitch = [\"600 um\", \"700 um\"]").unwrap();
    let array = sensor.microchannels().unwrap();
    // The plane-strain cell of the columns keeps its pitch of 600 um along x.
    let [rows, columns] = array.taxel_share();
    assert_near(rows, 0.6 / 91.92, 1e-12, 0.0, "rows");
    assert_near(columns, 0.7 / 91.92, 1e-12, 0.0, "columns");
    assert!(edited("pitch = \"600 um\"", "pitch = [\"700 um\", \"600 um\"]").is_err());
}

/// Two touches at once, on every pair of taxels: in one row or column both are
/// found, otherwise the four places are candidates and none is guessed.
#[test]
fn two_loads_at_once_are_one_number_in_prediction_and_twin() {
    let text = Sensor::shipped_text(NAME).unwrap();
    let text = text
        .replace(
            "height_deviation = \"0.5 um\"",
            "height_deviation = \"0 um\"",
        )
        .replace("noise = \"10 uV\"", "noise = \"0.001 uV\"");
    let sensor = Sensor::parse("exact.toml", &text).unwrap();
    let probe = |column: u32, force: &str| {
        let at = |time: &str| {
            format!("{{ time = \"{time}\", force = [\"0 mN\", \"0 mN\", \"{force}\"] }}")
        };
        let path = [at("0 s"), at("1 s")].join(", ");
        format!("[[probe]]\ntaxel = [0, {column}]\npath = [{path}]\n")
    };
    let script = [
        String::from("schema = 1\nname = \"two\"\nduration = \"1 s\"\n"),
        probe(0, "1.08 mN"),
        probe(3, "1.8 mN"),
    ];
    let script = &script.concat();
    let stimulus = Stimulus::parse("two.toml", script).unwrap();
    let mut twin = Twin::new(&sensor, &stimulus, 1).unwrap();
    let Delivery::Frame(frame) = twin.next_delivery() else {
        panic!()
    };
    // 0.6 mm of 91.92 mm, and a cell of 0.36 mm2.
    let share = 0.6 / 91.92;
    let of = |load: &str| {
        let mut predictor = sensor.device().unwrap().predictor().unwrap();
        let loads = Loads::one(load, predictor.load_columns()).unwrap();
        assert_eq!(predictor.combination(&loads.given.columns), Ok(()));
        predictor.prepare(&loads, &mut |_| {}).unwrap();
        let (mut row, columns) = (Vec::new(), predictor.columns());
        predictor.answer(&loads.load(0), &mut row).unwrap();
        assert_eq!(row.len(), columns.len());
        move |name: &str| {
            let at = columns.iter().position(|column| column.name == name);
            match row[at.unwrap_or_else(|| panic!("no {name}"))] {
                Cell::Number(number) => number,
                Cell::Whole(number) => number as f64,
                ref other => panic!("{other:?}"),
            }
        }
    };
    let both = of(&format!("p=3 kPa, share={share}, p2=5 kPa, share2={share}"));
    let alone = of(&format!("p=5 kPa, share={share}"));
    // A row carries both, each column one.
    let count = |answer: &dyn Fn(&str) -> f64, layer: &str| answer(&format!("{layer}_counts"));
    assert!((frame.values[0] - count(&both, "row")).abs() <= 1.0);
    assert!((frame.values[5] - count(&alone, "column")).abs() <= 1.0);
    // Each part closes by its own pressure, with the liquid of both.
    let net = ["row_net_pressure", "row_net_pressure_2"].map(&both);
    assert_near(net[1] - net[0], 2e3, 1e-12, 0.0, "net pressures");
    assert!(both("row_internal_pressure") > alone("row_internal_pressure"));
    assert!(both("row_area_ratio_2") < both("row_area_ratio"));
    // Two loads of one pressure are one load of both shares.
    let split = of("p=4 kPa, share=0.1, p2=4 kPa, share2=0.3");
    let whole = of("p=4 kPa, share=0.4");
    for name in ["row_change", "column_change", "closed_form_change"] {
        assert_near(split(name), whole(name), 1e-12, 0.0, name);
    }
}

#[test]
fn two_loads_that_lie_on_one_place_are_refused() {
    let sensor = sensor();
    let predictor = MicrochannelPredictor::new(&sensor.microchannels().unwrap());
    let combination = |load: &str| {
        let loads = Loads::one(load, Predictor::load_columns(&predictor)).unwrap();
        Predictor::combination(&predictor, &loads.given.columns)
    };
    for (load, words) in [
        ("p=1 kPa, p2=2 kPa", "loaded_share_2"),
        ("p=1 kPa, share=0.1, p2=2 kPa", "loaded_share_2"),
        (
            "p=1 kPa, share=0.1, fz2=2 mN, share2=0.1",
            "of the second load",
        ),
    ] {
        let refused = combination(load).unwrap_err();
        assert!(refused.contains(words), "{load}: {refused}");
    }
    let loads = Loads::one(
        "p=1 kPa, share=0.6, p2=2 kPa, share2=0.5",
        Predictor::load_columns(&predictor),
    )
    .unwrap();
    let refused = Predictor::answer(&predictor, &loads.load(0), &mut Vec::new()).unwrap_err();
    assert!(refused.message.contains("1.1"), "{refused:?}");
}

#[test]
fn two_touches_are_found_or_called_ambiguous() {
    let sensor = sensor();
    let array = sensor.microchannels().unwrap();
    let twin = Twin::new(
        &sensor,
        &Stimulus::parse("b", Stimulus::shipped_text("pad-b").unwrap()).unwrap(),
        1,
    )
    .unwrap();
    let mut estimator = estimator(&sensor, &twin);
    let pressures = [5e3, 3e3];
    for first in 0..8_usize {
        for second in (first + 1)..8 {
            let pressed = [first, second].map(|taxel| [taxel / 4, taxel % 4]);
            let values = (0..6).map(|channel| {
                let layer = usize::from(channel >= 2);
                let share = array.taxel_share()[layer];
                let mut stretches: Vec<_> = pressed
                    .iter()
                    .zip(pressures)
                    .filter(|([row, column], _)| [*row, column + 2].contains(&channel))
                    .map(|(_, pressure)| Stretch { share, pressure })
                    .collect();
                let rest = 1.0 - share * stretches.len() as f64;
                stretches.push(Stretch {
                    share: rest,
                    pressure: 0.0,
                });
                let resistance = array.layers[layer].respond(&stretches).unwrap().resistance;
                array.board.read(resistance, 0.0).number
            });
            let frame = Frame {
                sequence: 0,
                time_ns: 0,
                values: values.collect(),
                ..Frame::default()
            };
            let (touch, _) = estimator.push(&frame).unwrap();
            let [[r, c], [s, d]] = pressed;
            for (index, taxel) in touch.taxels.iter().enumerate() {
                let [row, column] = [index / 4, index % 4];
                let what = format!("{pressed:?}, taxel {row} {column}: {taxel:?}");
                if r != s && c != d {
                    let candidate = [r, s].contains(&row) && [c, d].contains(&column);
                    let expected = if candidate {
                        State::Ambiguous
                    } else {
                        State::Ok
                    };
                    assert_eq!(taxel.state, expected, "{what}");
                    assert_eq!(taxel.pressed().is_nan(), candidate, "{what}");
                } else {
                    let expected = match index {
                        _ if index == first => pressures[0],
                        _ if index == second => pressures[1],
                        _ => 0.0,
                    };
                    assert_eq!(taxel.state, State::Ok, "{what}");
                    // Counts: three times the deviation of a reading, of which
                    // rounding is a third; the curve, 1e-3 of 31 kPa.
                    assert_near(
                        taxel.pressed(),
                        expected,
                        0.0,
                        31.0 + 3.0 * taxel.pressed_deviation(),
                        &what,
                    );
                }
            }
        }
    }
}

/// Over-filled: pressures of the liquid begin at that of the filling, resistances at that of the
/// bulged channel, and the touch comes later. By hand from the curve of the drawn channel.
#[test]
fn an_over_filled_array_starts_from_its_filling() {
    let text = Sensor::shipped_text("liquid-metal-2x4").unwrap();
    let filled = text.replace(
        "resistivity = \"294 nohm m\"",
        "initial_pressure = \"5 kPa\"\nresistivity = \"294 nohm m\"",
    );
    let (filled, drawn) = (Sensor::parse("filled.toml", &filled).unwrap(), sensor());
    // Without solutions: the slope at rest of the tables.
    let (filled, drawn) = (
        filled.microchannels().unwrap(),
        drawn.microchannels().unwrap(),
    );
    let (upper, plain) = (&filled.layers[1], &drawn.layers[1]);
    let bulged = 1.0 + 5e3 * plain.closing.compliance();
    assert!((upper.bulged() - bulged).abs() < 1e-12);
    let rest = upper.conductor.rest_resistance() * bulged;
    assert!((rest / plain.conductor.rest_resistance() - 1.0).abs() < 1e-12);
    let predictor = MicrochannelPredictor::new(&filled);
    let at_rest = &predictor.predict(0.0, 1.0).unwrap().layers[1];
    assert_eq!((at_rest.internal_pressure, at_rest.change), (5e3, 0.0));
    for pressure in [2e3, 10e3, 30e3] {
        let pressed = &predictor.predict(pressure, 1.0).unwrap().layers[1];
        // Area over the drawn one, net pressure, and the gas from the filled state.
        let area = pressed.volume_ratio * bulged;
        let gas = 5e3 + 0.2 * (101.325e3 + 5e3) * (1.0 / pressed.volume_ratio - 1.0);
        assert!((pressed.internal_pressure / gas - 1.0).abs() < 1e-9);
        let net = pressure - gas;
        let expected = plain.closing.at(net).area_ratio;
        // Slopes of the curve where the straight part meets the table.
        assert!(
            (area - expected).abs() < 1e-3,
            "{pressure}: {area} {expected}"
        );
        let change = 1.0 / pressed.volume_ratio - 1.0;
        assert!((pressed.change - change).abs() < 1e-9);
    }
    let touch = |layer: &MicrochannelLayer| layer.closing.touch().unwrap();
    assert!((touch(upper) * bulged - touch(plain)).abs() < 1e-12);
    // The estimator reads the same model.
    assert!(filled.calibration().is_ok());
}

#[test]
fn a_filling_that_doubles_the_area_is_refused_at_the_layer() {
    let text = Sensor::shipped_text("liquid-metal-2x4").unwrap();
    let filled = text.replace(
        "resistivity = \"294 nohm m\"",
        "initial_pressure = \"20 kPa\"\nresistivity = \"294 nohm m\"",
    );
    let error = Sensor::parse("filled.toml", &filled).unwrap_err();
    assert!(error.key.contains("element.microchannel"), "{error}");
    assert!(error.message.contains("20.0000 kPa"), "{error}");
    assert!(error.message.contains("up to "), "{error}");
}

/// A part shorter than 1.4 times the stack of 420 um is answered with a remark.
#[test]
fn a_short_loaded_part_is_remarked_on() {
    let sensor = sensor();
    let mut predictor = MicrochannelPredictor::new(&sensor.microchannels().unwrap());
    let mut remark = |load: &str| {
        let loads = Loads::one(load, Predictor::load_columns(&predictor)).unwrap();
        Predictor::prepare(&mut predictor, &loads, &mut |_| {}).unwrap()
    };
    // One taxel: 600 um of 91.92 mm.
    assert_eq!(remark("p=1 kPa, share=0.00653"), None);
    // The columns of the shipped sensor are a plane-strain cell.
    let whole = remark("p=1 kPa").unwrap();
    assert!(
        whole.contains("whole top") && whole.contains("25 %"),
        "{whole}"
    );
    let short = remark("p=1 kPa, share=0.1, p2=2 kPa, share2=0.004").unwrap();
    for part in ["0.004", "367.68 um", "588 um", "--mechanics fem"] {
        assert!(short.contains(part), "{short}");
    }
}
