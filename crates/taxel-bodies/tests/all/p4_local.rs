//! A patch on one crossing of liquid-metal channels, from load to signal.
#![allow(clippy::unwrap_used)]

use taxel::predict::Loads;
use taxel::sensor::Sensor;
use taxel::table::Cell;

/// One crossing whose channels have this length.
fn one_crossing(length: &str) -> Sensor {
    let text = Sensor::shipped_text("liquid-metal-2x4").unwrap();
    let text = text
        .replace("rows = 2", "rows = 1")
        .replace("columns = 4", "columns = 1")
        .replace("91.92 mm", length);
    Sensor::parse("edited.toml", &text).unwrap()
}

/// Numbers of the answer by the names of their columns.
fn answer(sensor: &Sensor, load: &str) -> impl Fn(&str) -> f64 + use<> {
    let mut predictor = taxel_bodies::field_predictor(sensor).unwrap();
    let loads = Loads::one(load, predictor.load_columns()).unwrap();
    assert_eq!(predictor.combination(&loads.given.columns), Ok(()));
    let ended = predictor.prepare(&loads, &mut |_| {}).unwrap();
    assert_eq!(ended, None);
    let (mut row, columns) = (Vec::new(), predictor.columns());
    predictor.answer(&loads.load(0), &mut row).unwrap();
    assert_eq!(row.len(), columns.len());
    move |name| {
        let at = columns.iter().position(|column| column.name == name);
        match row[at.unwrap()] {
            Cell::Number(number) => number,
            ref other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_patch_closes_the_part_in_the_block_and_the_rest_takes_its_liquid() {
    // A block of 0.8 mm.
    let load = "p=3 kPa, px=0.4 mm, py=0.4 mm";
    let law = |volume: f64| 0.2 * 101.325e3 * (1.0 / volume - 1.0);
    let ending = answer(&one_crossing("0.8 mm"), load);
    assert!((ending("pressure") - 3e3).abs() < 1e-9);
    // The patch sinks as a bowl and turns part of the pressure aside.
    let force = ending("support_force") / (3e3 * 0.16e-6);
    assert!((0.97..1.0).contains(&force), "{force}");
    for layer in ["row", "column"] {
        let of = |what: &str| ending(&format!("{layer}_0_{what}"));
        let pressure = law(of("volume_ratio"));
        // The tolerance of the iteration.
        assert!((of("internal_pressure") / pressure - 1.0).abs() < 1e-4);
        assert!(of("thinnest_ratio") < of("volume_ratio"));
        assert!(of("volume_ratio") < of("thickest_ratio"));
        assert!(of("change") > 0.0);
    }
    // The upper channels, the columns, respond more to the patch.
    assert!(ending("column_greatest_change") > ending("row_greatest_change"));
    let long = answer(&one_crossing("8 mm"), load);
    for layer in ["row", "column"] {
        let of = |what: &str| long(&format!("{layer}_0_{what}"));
        let short = |what: &str| ending(&format!("{layer}_0_{what}"));
        // Ten times the liquid: a lower pressure, a more closed part, a smaller change of
        // the whole.
        assert!(of("internal_pressure") < 0.5 * short("internal_pressure"));
        assert!(of("volume_ratio") < short("volume_ratio"));
        assert!(of("change") < 0.5 * short("change"));
        assert!(of("change") > 0.0);
    }
}
