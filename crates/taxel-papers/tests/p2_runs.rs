//! Runs of `papers/p2.toml`: finite elements of the three-axis unit.
#![allow(clippy::unwrap_used)]

use taxel::sensor::Sensor;
use taxel_bodies::mechanics::{BlockDivision, ElasticUnit, UnitSolution};
use taxel_papers::Paper;

/// On few cells.
#[test]
fn crosstalk_of_the_shipped_drawing() {
    let sensor = Sensor::shipped("three-axis-8x8").unwrap();
    let array = sensor.three_axis().unwrap();
    let solution = UnitSolution {
        division: BlockDivision::COARSE,
        ..UnitSolution::default()
    };
    let drawing = array.unit_drawing();
    let found = ElasticUnit { drawing, solution }.crosstalk().unwrap();
    let stored = &Paper::P2.table().run("crosstalk").unwrap().values;
    for (name, found) in [
        ("near_z", found.normal[0]),
        ("far_z", found.normal[1]),
        ("near_x", found.side[0]),
        ("far_x", found.side[1]),
    ] {
        // Stored with one decimal; these cells take up to 0.07 off.
        let found = 100.0 * found;
        assert!((found - stored[name]).abs() < 0.12, "{name} {found}");
    }
}

/// The first touch of a unit of 9.31 kN/m by contact at large strain on few cells, which are stiffer, and
/// the fall of the slope of its capacitance there.
#[test]
fn first_touch_of_a_pressed_unit() {
    let sensor = Sensor::shipped("three-axis-8x8").unwrap();
    let drawing = sensor.three_axis().unwrap().unit_drawing();
    let modulus = 9.31e3 * drawing.compliance().unwrap().c_zz;
    let solution = UnitSolution {
        division: BlockDivision::COARSE,
        ..UnitSolution::default()
    };
    let found = ElasticUnit { drawing, solution }.press((modulus, 2.7), (40e-3, 4), &mut |_| ());
    let (found, _) = found.unwrap();
    let touch = found.touch.unwrap();
    let stored = &Paper::P2.table().run("first_touch").unwrap().values;
    assert!(
        (touch.force * 1e3 - stored["force"]).abs() < 1.5,
        "{touch:?}"
    );
    let slope = |a: f64, b: f64| {
        let [a, b] = [a, b].map(|force| found.at(force).unwrap());
        1e12 * (b.capacitance - a.capacitance) / (b.force - a.force)
    };
    let slopes = [slope(30e-3, touch.force), slope(touch.force, 40e-3)];
    for (found, name) in slopes.into_iter().zip(["before", "after"]) {
        assert!((found / stored[name] - 1.0).abs() < 0.15, "{name} {found}");
    }
}
