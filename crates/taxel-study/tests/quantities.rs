//! Quantities of `estimate` beside deviations, each against its definition computed here.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod common;

use std::f64::consts::TAU;

use taxel::mechanics::{Base, ContactPressure, SoftCover};
use taxel::predict::Loads;
use taxel::sensor::Sensor;
use taxel::table::Cell;
use taxel_study::answers::{Outcome, WAY_COLUMN};
use taxel_study::study::{Row, Status};
use taxel_study::{figures, sweep};

use common::{near, read, study_of};

/// A study that asks one thing of a shipped sensor with changes.
fn asking(sensor: &str, set: &str, quantity: &str, more: &str) -> String {
    format!(
        "schema = 2\nname = \"one\"\nsensor = \"{sensor}\"\n[set]\n{set}\n\
         [answers.it]\nof = \"estimate\"\nquantity = \"{quantity}\"\n{more}\n"
    )
}

fn outcome(sensor: &str, set: &str, quantity: &str, more: &str) -> Outcome {
    let row = study_of(&asking(sensor, set, quantity, more)).evaluate(&[]);
    assert_ne!(row.status, Status::Refused, "{}", row.reason);
    row.answers[0].clone()
}

#[track_caller]
fn number(sensor: &str, set: &str, quantity: &str, more: &str) -> f64 {
    let text = asking(sensor, set, quantity, more);
    let row = study_of(&text).evaluate(&[]);
    assert_eq!(row.status, Status::Done, "{}", row.reason);
    row.answers[0].number().unwrap()
}

#[track_caller]
fn refused(sensor: &str, quantity: &str, more: &str, says: &str) {
    let error = read(&asking(sensor, "", quantity, more))
        .map(|_| ())
        .unwrap_err();
    assert!(error.to_string().contains(says), "{error}");
}

/// Least of the greatest distances from lines through the first value, by trying slopes.
fn off_line(values: &[f64]) -> f64 {
    let last = values[values.len() - 1] - values[0];
    let steps = (values.len() - 1) as f64;
    let distance = |slope: f64| {
        let far = |(step, value): (usize, &f64)| {
            ((value - values[0]) / last - slope * step as f64 / steps).abs()
        };
        values.iter().enumerate().map(far).fold(0.0, f64::max)
    };
    let tried = (0..=40_000).map(|step| 0.5 + f64::from(step) * 2.5e-5);
    tried.map(distance).fold(f64::INFINITY, f64::min)
}

#[test]
fn linearity_is_the_distance_from_the_best_line_through_rest() {
    for (name, end) in [("in-plane-50um", 5.0), ("in-plane-50um", 20.0)] {
        let sensor = Sensor::shipped(name).unwrap();
        let model = sensor.in_plane().unwrap().model();
        let reading = |force: f64| {
            let compression = model.compression_from_force(force).unwrap();
            model.respond(compression).unwrap().capacitance
        };
        let readings: Vec<f64> = (0..=100)
            .map(|step| reading(end * f64::from(step) / 100.0))
            .collect();
        let found = number(name, "", "linearity", &format!("load = \"fz={end} N\""));
        // The slope is tried in steps of 2.5e-5.
        assert!((found - off_line(&readings)).abs() < 3e-5, "{found}");
        assert!(found > 1e-3);
    }
    // Charge is proportional to force.
    let load = "load = \"fz=50 mN, profile=step, ramp=10 ms\"";
    let found = number("piezo-1.5mm", "", "linearity", load);
    assert!(found < 1e-9, "{found}");
    // Four capacitors: the worst of them.
    let sensor = Sensor::shipped("three-axis-8x8").unwrap();
    let unit = sensor.three_axis().unwrap().unit_model();
    let at = |share: f64| unit.predict([2e-3 * share, 0.0, 10e-3 * share]).1;
    let worst = (0..4)
        .map(|channel| {
            let reading = |step: i32| at(f64::from(step) / 100.0).capacitance()[channel];
            off_line(&(0..=100).map(reading).collect::<Vec<_>>())
        })
        .fold(0.0, f64::max);
    let load = "load = \"fx=2 mN, fz=10 mN\"";
    let found = number("three-axis-8x8", "", "linearity", load);
    assert!((found - worst).abs() < 3e-5, "{found} {worst}");
}

#[test]
fn crosstalk_of_three_axes_is_that_of_a_read_out_with_the_slopes_at_rest() {
    let sensor = Sensor::shipped("three-axis-8x8").unwrap();
    let unit = sensor.three_axis().unwrap().unit_model();
    let at = |force: [f64; 3]| unit.predict(force).1.capacitance();
    // Slopes by differences, and the force of least squares: the noise of all channels is alike.
    let step = 1e-6;
    let rest = at([0.0; 3]);
    let slopes: [[f64; 4]; 3] = std::array::from_fn(|axis| {
        let to = |sign: f64| {
            let mut force = [0.0; 3];
            force[axis] = sign * step;
            at(force)
        };
        let (up, down) = (to(1.0), to(-1.0));
        std::array::from_fn(|i| (up[i] - down[i]) / (2.0 * step))
    });
    for loaded in 0..3 {
        let mut force = [0.0; 3];
        force[loaded] = 8e-3;
        let change: [f64; 4] = std::array::from_fn(|i| at(force)[i] - rest[i]);
        // Rows of opposite signs: the slopes of the axes are orthogonal.
        let read: [f64; 3] = std::array::from_fn(|axis| {
            let sum =
                |other: &[f64; 4]| -> f64 { (0..4).map(|i| slopes[axis][i] * other[i]).sum() };
            sum(&change) / sum(&slopes[axis])
        });
        let others = (0..3).filter(|axis| *axis != loaded);
        let expected = others.map(|axis| read[axis].abs()).fold(0.0, f64::max) / read[loaded].abs();
        let axis = ["x", "y", "z"][loaded];
        let found = number(
            "three-axis-8x8",
            "",
            "crosstalk",
            &format!("load = \"f{axis}=8 mN\""),
        );
        assert!(
            (found - expected).abs() < 1e-6,
            "{axis}: {found} {expected}"
        );
        // Pressing alone tilts nothing; shear closes the gaps on one side more than it opens others.
        assert_eq!(found > 1e-3, loaded < 2, "{axis}: {found}");
    }
    let both = outcome(
        "three-axis-8x8",
        "",
        "crosstalk",
        "load = \"fx=1 mN, fz=1 mN\"",
    );
    assert!(matches!(both, Outcome::Outside(why) if why.contains("one axis")));
}

#[test]
fn crosstalk_of_elements_is_what_the_cover_carries_to_the_next_one() {
    let sensor = Sensor::shipped("piezo-1.5mm").unwrap();
    let array = sensor.piezoelectric().unwrap();
    let place = array.places()[1];
    let cover = SoftCover {
        thickness: array.description.depth(),
        base: Base::Rigid,
        contact: ContactPressure::Uniform(2e-3),
    };
    let side = array.description.ceramic.side;
    let share = |other: &[f64; 2]| cover.share([other[0] - place[0], other[1] - place[1]], side);
    let mut shares: Vec<f64> = array.places().iter().map(share).collect();
    shares.sort_by(f64::total_cmp);
    let expected = shares[shares.len() - 2] / shares[shares.len() - 1];
    let [x, y] = place.map(|along| along * 1e3);
    let load = format!("load = \"fz=100 mN, x={x} mm, y={y} mm, radius=2 mm\"");
    // The tables of the cover are interpolated.
    near(
        number("piezo-1.5mm", "", "crosstalk", &load),
        expected,
        1e-4,
        "next element",
    );
}

#[test]
fn times_and_bands_are_those_of_the_model() {
    let facts = taxel::summary::summary(&Sensor::shipped("piezo-1.5mm").unwrap()).unwrap();
    let fact = |name: &str| {
        let found = facts.iter().find(|fact| fact.name == name);
        match found.map(|fact| &fact.value) {
            Some(taxel::summary::Value::Number { si, .. }) => *si,
            other => panic!("{name}: {other:?}"),
        }
    };
    let [high_pass, low_pass] = ["high_pass_corner", "low_pass_corner"].map(fact);
    let slowest = number("piezo-1.5mm", "", "time_constant", "");
    near(slowest, 1.0 / (TAU * high_pass), 1e-12, "leak");
    let band = number("piezo-1.5mm", "", "bandwidth", "");
    near(band, low_pass - high_pass, 1e-12, "band");
    let relaxation = "\"element.three_axis_capacitor.relaxation\" = \
                      [{ ratio = 0.05, time = \"2 s\" }, { ratio = 0.1, time = \"40 ms\" }]";
    near(
        number("three-axis-8x8", relaxation, "time_constant", ""),
        2.0,
        1e-12,
        "relaxation",
    );
}

#[test]
fn the_stretch_is_that_of_the_top_of_the_layer() {
    let model = Sensor::shipped("in-plane-50um").unwrap();
    let model = model.in_plane().unwrap().model();
    let compression = model.compression_from_force(10.0).unwrap();
    let expected = model
        .compress(compression)
        .unwrap()
        .kinematics
        .top_stretch();
    let found = number(
        "in-plane-50um",
        "",
        "greatest_stretch",
        "load = \"fz=10 N\"",
    );
    near(found, expected, 1e-12, "stretch");
    assert!(found > 1.0);
}

#[test]
fn a_range_ends_where_a_converter_clips() {
    let load = "load = \"fz=20 N, profile=step, ramp=10 ms\"";
    let ended = outcome("piezo-1.5mm", "", "range_ended_by", load);
    assert_eq!(ended, Outcome::Word(String::from("clipped")));
    let range = number("piezo-1.5mm", "", "range", load);
    let sensor = Sensor::shipped("piezo-1.5mm").unwrap();
    let predictor = sensor.device().unwrap().predictor().unwrap();
    let clipped = |force: f64| {
        let load = format!("fz={force} N, profile=step, ramp=10 ms");
        let loads = Loads::one(&load, predictor.load_columns()).unwrap();
        let mut row = Vec::new();
        predictor.answer(&loads.load(0), &mut row).unwrap();
        let place = predictor
            .columns()
            .iter()
            .position(|one| one.name == "clipped");
        !matches!(&row[place.unwrap()], Cell::Text(text) if text.is_empty())
    };
    assert!(
        !clipped(range * (1.0 - 1e-9)) && clipped(range * (1.0 + 1e-9)),
        "{range}"
    );
    // Within its range nothing ends it.
    let load = "load = \"fz=50 mN, profile=step, ramp=10 ms\"";
    let ended = outcome("piezo-1.5mm", "", "range_ended_by", load);
    assert_eq!(ended, Outcome::Word(String::from("not_reached")));
}

#[test]
fn what_a_device_has_nothing_of_is_refused_when_the_study_is_read() {
    refused(
        "in-plane-50um",
        "crosstalk",
        "load = \"fz=1 N\"",
        "no crosstalk",
    );
    refused("in-plane-50um", "time_constant", "", "takes time");
    refused("in-plane-50um", "bandwidth", "", "no band");
    refused(
        "three-axis-8x8",
        "greatest_stretch",
        "load = \"fz=1 mN\"",
        "no stretch",
    );
    refused(
        "piezo-1.5mm",
        "bandwidth",
        "load = \"fz=1 mN\"",
        "does not use load",
    );
    refused("in-plane-50um", "linearity", "", "needs a load");
}

#[test]
fn an_estimate_over_a_range_of_loads_is_the_worst_of_it() {
    let over = |more: &str| {
        let more = format!("over = \"fz = 5 mN .. 50 N\"\n{more}");
        number("in-plane-50um", "", "deviation", &more)
    };
    let at = |load: &str| {
        number(
            "in-plane-50um",
            "",
            "deviation",
            &format!("load = \"{load}\""),
        )
    };
    // The resolution of this sensor falls off towards its end.
    let [first, last] = [at("fz=5 mN"), at("fz=50 N")];
    near(over(""), last, 1e-12, "worst without a word");
    near(over("take = \"worst\""), last, 1e-12, "worst");
    near(over("take = \"least\""), first, 1e-12, "least");
    let mean = over("take = \"mean\"");
    assert!(first < mean && mean < last, "{first} {mean} {last}");
    // Equal ratios, as equal steps of half a newton would leap over the first load.
    let loads = (0..=100).map(|step| 5e-3 * 1e4f64.powf(f64::from(step) / 100.0));
    let deviations: Vec<f64> = loads.map(|load| at(&format!("fz={load} N"))).collect();
    // Texts of loads round in their last digit.
    near(mean, deviations.iter().sum::<f64>() / 101.0, 1e-9, "mean");
    // What else is loaded stays.
    let over = "over = \"fz=20 mN..200 mN, x=0 mm, y=0 mm, radius=4 mm\"\ntake = \"least\"";
    let one = "load = \"fz=200 mN, x=0 mm, y=0 mm, radius=4 mm\"";
    near(
        number("piezo-1.5mm", "", "deviation_place", over),
        number("piezo-1.5mm", "", "deviation_place", one),
        1e-12,
        "place",
    );
    refused(
        "in-plane-50um",
        "linearity",
        "over = \"fz=0..5 N\"",
        "over a range of loads deviations",
    );
    for (range, says) in [
        ("fz=5 mN", "has no two ends"),
        ("fz=5 mm..5 N", "numbers of one dimension"),
        ("fz=5 N..50 mN", "is empty"),
    ] {
        let more = format!("over = \"{range}\"");
        refused("in-plane-50um", "deviation", &more, says);
    }
}

/// Nothing of a place is known when it is no better than anywhere on the sheet.
#[test]
fn a_place_as_unsure_as_the_sheet_is_no_information() {
    let sensor = Sensor::shipped("piezo-1.5mm").unwrap();
    let [x, y] = [
        sensor.array.columns as f64 * sensor.array.pitch[0],
        sensor.array.rows as f64 * sensor.array.pitch[1],
    ];
    let anywhere = (x * x / 12.0 + y * y / 12.0).sqrt();
    let of = |force: f64| {
        let load = format!("load = \"fz={force} mN, x=1 mm, y=1 mm, radius=4 mm\"");
        outcome("piezo-1.5mm", "", "deviation_place", &load)
    };
    // The deviation falls with the force: from one side of the size of the sheet to the other.
    let known = of(100.0).number().unwrap();
    assert!(known < anywhere, "{known}");
    let enough = 100.0 * known / anywhere;
    assert!(
        of(1.1 * enough)
            .number()
            .is_some_and(|place| place < anywhere)
    );
    assert_eq!(of(0.9 * enough), Outcome::Outside("no_information".into()));
}

/// A curve through designs that are answered in two ways says so.
#[test]
fn designs_that_are_answered_in_two_ways_are_told_apart() {
    let text = "schema = 2\nname = \"gaps\"\nsensor = \"in-plane-50um\"\n\
        [set]\n\"element.in_plane_capacitor.electrodes.stiffness\" = \"as_layer\"\n\
        [variables.gap]\nkey = \"element.in_plane_capacitor.electrodes.gap\"\nvalues = [\"100 um\", \"119 um\", \"121 um\"]\n\
        [answers.rest]\nof = \"check\"\nquantity = \"rest_capacitance\"\n";
    let study = study_of(text);
    let rows: Vec<_> = sweep::designs(&study, None)
        .unwrap()
        .iter()
        .map(|point| study.evaluate(point))
        .collect();
    let names = |rows: &[Row]| -> Vec<String> {
        let (columns, _) = sweep::table(&study, rows);
        columns.into_iter().map(|column| column.name).collect()
    };
    // The closed form was compared to gaps of 1.2 thicknesses; this test solves nothing.
    assert_eq!(
        names(&rows),
        ["gap", "rest", WAY_COLUMN, "status", "reason"]
    );
    assert_eq!(names(&rows[..2]), ["gap", "rest", "status", "reason"]);
    let ways = [(2, "closed form"), (1, "closed form, not compared")];
    assert_eq!(
        sweep::ways(&study, &rows),
        ways.map(|(n, way)| (n, way.to_owned()))
    );
    let marks = |rows: &[Row]| {
        figures::sweep(&study, rows)
            .matches("class=\"limit\"")
            .count()
    };
    assert_eq!([marks(&rows), marks(&rows[..2])], [1, 0]);
}
