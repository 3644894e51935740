//! The elastic unit of P2 from its drawing against a table that another program computed.
#![allow(clippy::unwrap_used)]

use crate::common::{Row, UM, drawing, table};
use taxel::mechanics::{Bar, Cavity, Grip, SideContact, UnitCompliance, UnitDrawing};
use taxel::sensor::Sensor;

/// The row of a case.
fn case(name: &str) -> Row {
    table("solved_p2_unit.csv")
        .into_iter()
        .find(|row| row.text("case") == name)
        .unwrap()
}

fn base() -> UnitDrawing {
    drawing(&case("base"))
}

/// um/mN for 1 MPa.
fn per_modulus(value: f64) -> f64 {
    value / 1e3
}

/// Every row with free sides is its own drawing.
#[test]
fn the_law_goes_through_the_solved_cases() {
    let mut rows = 0;
    for row in table("solved_p2_unit.csv") {
        if row.text("sides") != "free" || row.at("poisson") != 0.49 {
            continue;
        }
        let found = drawing(&row).compliance().unwrap();
        let c = [found.c_zz, found.c_xx].map(per_modulus);
        for (value, column) in [
            (c[0], "c_zz"),
            (c[1], "c_xx"),
            (found.hot_z, "hot_z"),
            (found.tilt_z, "tilt_z"),
            (found.strips[1].stick, "stick_2"),
            (found.strips[2].by_side_force[0] / 1e3, "cxx_3"),
            (found.strips[2].by_downward_force[0] / 1e3, "cxz_3"),
        ] {
            let solved = row.at(column);
            // Two rows have the same lengths of layers, cut differently: 2e-4 apart.
            assert!(
                (value / solved - 1.0).abs() < 5e-4,
                "{} {column} {value}",
                row.text("case")
            );
        }
        rows += 1;
    }
    assert_eq!(rows, 14);
}

#[test]
fn base_case_of_the_drawing() {
    let found = base().compliance().unwrap();
    let c = per_modulus(found.c_zz);
    assert!((c - 0.326).abs() < 0.005, "{c}");
    assert!((found.c_zz / found.c_xx - 0.451).abs() < 0.005);
    // Among neighbours the unit is 5 % stiffer.
    let near = base().compliance_in_array().unwrap();
    assert!((near.c_zz / found.c_zz - 0.95).abs() < 0.005);
}

/// A wider wall and a lower bump, by the exponents.
#[test]
fn wall_and_bump_change_what_they_hold() {
    let of = |unit: UnitDrawing| unit.compliance().unwrap();
    let base = base();
    let wall = of(UnitDrawing {
        wall_width: 140e-6,
        ..base
    });
    let change = wall.c_zz / of(base).c_zz - 1.0;
    assert!((change + 0.14).abs() < 0.02, "{change}");
    let low = of(drawing(&case("bump150")));
    let change = low.c_xx / of(base).c_xx - 1.0;
    assert!((change + 0.34).abs() < 0.02, "{change}");
    assert!((low.c_zz / of(base).c_zz - 1.0).abs() < 0.02);
}

/// A bar that sticks: k_x/k_z, and the pressing that it adds.
#[test]
fn a_bar_that_sticks() {
    let found = base().compliance().unwrap();
    for (height, ratio, sinking) in [
        (0.125, 1.93, 0.38),
        (0.375, 1.15, 0.32),
        (0.625, 0.77, 0.24),
        (0.875, 0.59, 0.24),
    ] {
        let bar = Bar {
            height,
            grip: Grip::Sticks,
        };
        let (x, added) = found.side(1e6, SideContact::Bar(bar));
        let z = found.normal(1e6, Cavity::Vented);
        assert!((z / x / ratio - 1.0).abs() < 0.01, "{height} {}", z / x);
        let displacements = added * z / x;
        // The last digit that is given of d_z/d_x.
        assert!(
            (displacements - sinking).abs() < 0.006,
            "{height} {displacements}"
        );
    }
    let slips = Bar {
        height: 0.375,
        grip: Grip::Slips,
    };
    let (x, _) = found.side(1e6, SideContact::Bar(slips));
    assert!((per_modulus(x * 1e6) - 0.396_033).abs() < 1e-5);
}

/// Air that stays in the cavities.
#[test]
fn sealed_cavities() {
    let found = base().compliance().unwrap();
    for (modulus, open, sealed) in [(1.32e6, 4.04, 25.7), (2e6, 6.12, 28.7), (2.6e6, 7.96, 31.1)] {
        let k = |cavity| 1e-3 / found.normal(modulus, cavity);
        assert!((k(Cavity::Vented) / open - 1.0).abs() < 0.02);
        assert!(
            (k(Cavity::Sealed) / sealed - 1.0).abs() < 0.03,
            "{}",
            k(Cavity::Sealed)
        );
    }
}

/// First touch for the moduli that give the two readings of the printed stiffness.
#[test]
fn first_touch() {
    let found = base().compliance().unwrap();
    for (stiffness, force) in [(7.85e3, 27e-3), (9.31e3, 33e-3), (10.4e3, 36e-3)] {
        let modulus = stiffness * found.c_zz;
        let touch = found.first_touch(modulus, 6e-6);
        assert!((touch - force).abs() < 1e-3, "{touch}");
    }
}

/// Twice the modulus halves every closing; twice the size does too.
#[test]
fn modulus_and_size() {
    let found = base().compliance().unwrap();
    let mut drawing = base();
    for length in [
        &mut drawing.electrode,
        &mut drawing.electrode_thickness,
        &mut drawing.centre_distance,
        &mut drawing.unit_side,
        &mut drawing.wall_width,
        &mut drawing.lower_layer,
        &mut drawing.upper_layer,
        &mut drawing.bump_height,
        &mut drawing.bump_base,
        &mut drawing.bump_top,
        &mut drawing.air_gap,
        &mut drawing.insulation,
        &mut drawing.pitch,
    ] {
        *length *= 2.0;
    }
    let large = drawing.compliance().unwrap();
    assert!((large.c_zz / found.c_zz - 0.5).abs() < 1e-9);
    // The stiffness of the kept air scales as well: pressures do not depend on size.
    let k = |of: &UnitCompliance| 1.0 / of.normal(2e6, Cavity::Sealed);
    assert!((k(&large) / k(&found) - 2.0).abs() < 1e-9);
    let k = |modulus| 1.0 / found.normal(modulus, Cavity::Vented);
    assert!((k(2e6) / k(1e6) - 2.0).abs() < 1e-12);
}

#[test]
fn drawings_beyond_the_table_are_named() {
    let thick = UnitDrawing {
        wall_width: 300e-6,
        ..base()
    };
    let outside = thick.compliance().unwrap_err();
    assert_eq!(outside.key, "outline.wall_width");
    assert!(
        outside
            .to_string()
            .contains("from 83.3 um to 120.0 um, not 300.0 um")
    );
    let steep = UnitDrawing {
        bump_top: 600e-6,
        ..base()
    };
    assert_eq!(steep.compliance().unwrap_err().key, "outline.bump_top");
    for insulation in [0.0, -0.0, f64::NAN] {
        let bare = UnitDrawing {
            insulation,
            ..base()
        };
        assert_eq!(bare.compliance().unwrap_err().key, "plates.insulation");
    }
}

/// Bending is linear in the curvature and in the plane.
#[test]
fn bending_to_a_radius() {
    let unit = base();
    let closing = |radius: f64, plane: f64| unit.bent(2e-3, radius, plane).unwrap();
    for row in table("solved_p2_bending.csv") {
        if row.text("bottom") == "sliding" && row.at("poisson") == 0.49 {
            let found = closing(4e-3, row.si("neutral_z_um", UM)).closing;
            assert!((found - row.si("closing_um_at_4mm", UM)).abs() < 1e-12);
        }
    }
    let bottom = closing(4e-3, -312e-6);
    assert!((bottom.closing - 3.85e-6).abs() < 0.15e-6);
    assert!((bottom.glued - 5.76e-6).abs() < 0.01e-6);
    assert!((closing(4e-3, -6e-6).closing - 0.275e-6).abs() < 0.02e-6);
    let ratio = closing(8e-3, 50e-6).closing / closing(4e-3, 50e-6).closing;
    assert!((ratio - 0.5).abs() < 1e-12);
    // The law k (1100 um² + 46.7 um (z_gap - z_n)), to the rounding of its constants.
    for plane in [-200e-6, 0.0, 300e-6] {
        let law = (1100e-12 + 46.7e-6 * (-6e-6 - plane)) / 4e-3;
        assert!(
            (closing(4e-3, plane).closing - law).abs() < 0.01e-6,
            "{plane}"
        );
    }
    let other = UnitDrawing {
        lower_layer: 150e-6,
        ..unit
    };
    assert_eq!(other.bent(2e-3, 4e-3, 0.0), None);
}

/// A sensor file whose stiffness follows from its drawing.
fn from_drawing(change: &[(&str, &str)]) -> Result<Sensor, String> {
    let text = Sensor::shipped_text("three-axis-8x8").unwrap();
    let typed_in = ["stiffness", "tile_tilt", "bump_sinking"];
    let lines = text
        .lines()
        .filter(|line| !typed_in.iter().any(|key| line.starts_with(key)));
    let mut text = lines.collect::<Vec<_>>().join("\n");
    let table = "\n[element.three_axis_capacitor.suspension.from_drawing]\nmodulus = \"2.6 MPa\"\n\
                 side_contact = \"top\"\ncavity = \"vented\"\n\n[element.three_axis_capacitor.outline]";
    text = text.replace("[element.three_axis_capacitor.outline]", table);
    for (from, to) in change {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    Sensor::parse("from-drawing.toml", &text).map_err(|error| error.to_string())
}

/// Doubling the wall changes what a force does to the capacitances.
#[test]
fn the_wall_changes_the_prediction() {
    let rise = |wall: &str| {
        let wall = format!("wall_width = \"{wall} um\"");
        let sensor = from_drawing(&[("wall_width = \"100 um\"", &wall)]).unwrap();
        let unit = sensor.three_axis().unwrap().unit_model();
        unit.predict([0.0, 0.0, 10e-3]).1.capacitance()[0] - unit.rest()[0]
    };
    assert!(rise("140") < 0.9 * rise("100"));
    let sensor = from_drawing(&[]).unwrap();
    let k = sensor
        .three_axis()
        .unwrap()
        .unit_model()
        .suspension
        .stiffness();
    // 2.6 MPa times 3.06 kN/m per MPa.
    assert!((k[2] - 7.96e3).abs() < 0.05e3, "{}", k[2]);
}

/// The estimator takes the same model as the twin: what a bar presses is not taken for a
/// force along z.
#[test]
fn predicted_capacitances_are_read_back() {
    use taxel::estimation::{Outcome, SearchOptions, estimate_unit};
    let bar = "side_contact = { bar = { height = 0.5, grip = \"sticks\" } }";
    let sensor = from_drawing(&[("side_contact = \"top\"", bar)]).unwrap();
    let unit = sensor.three_axis().unwrap().unit_model();
    assert!(unit.suspension.bump_sinking[0] > 0.2);
    for force in [[4e-3, 0.0, 0.0], [-3e-3, 5e-3, 8e-3], [0.0, -6e-3, 12e-3]] {
        let readings = unit.predict(force).1.capacitance();
        let found = estimate_unit(
            &unit,
            readings,
            [1e-16; 4],
            [true; 4],
            &SearchOptions::default(),
        );
        assert_eq!(found.outcome, Outcome::Converged);
        for (a, b) in found.force.iter().zip(force) {
            assert!((a - b).abs() < 1e-9, "{:?} {force:?}", found.force);
        }
    }
}

/// Mistakes are shown at the key, with what to do.
#[test]
fn a_stiffness_is_typed_in_or_drawn() {
    for (change, parts) in [
        (
            ("wall_width = \"100 um\"", "wall_width = \"420 um\""),
            ["outline.wall_width", "reaches the electrodes", "300 um"],
        ),
        (
            ("wall_width = \"100 um\"", "wall_width = \"200.5 um\""),
            ["outline.wall_width", "a wall", "83.3 um to 120.0 um"],
        ),
        (
            ("pitch = \"2 mm\"", "pitch = \"1.3 mm\""),
            ["array.pitch", "no elastomer", "1300 um"],
        ),
        (
            (
                "centre_distance = \"700 um\"",
                "centre_distance = \"700 um\"\ntile_tilt = 0.0",
            ),
            ["suspension.tile_tilt", "from_drawing", "remove this key"],
        ),
        (
            ("\"top\"", "{ bar = { height = 0.95, grip = \"sticks\" } }"),
            ["height", "at least 0.125", "at most 0.875"],
        ),
        (
            ("cavity = \"vented\"", "cavity = \"closed\""),
            ["cavity", "vented", "sealed"],
        ),
        (
            ("modulus = \"2.6 MPa\"", "modulus = \"2.6 mm\""),
            ["modulus", "unit of length", "MPa"],
        ),
        (
            (
                "mount = \"flat\"",
                "mount = { cylinder = { radius = \"4 mm\", unstretched_plane = \"-600 um\" } }",
            ),
            ["unstretched_plane", "closes", "nearer"],
        ),
    ] {
        let message = from_drawing(&[change]).unwrap_err();
        for part in parts {
            assert!(message.contains(part), "no {part} in {message}");
        }
    }
    let text = Sensor::shipped_text("three-axis-8x8").unwrap();
    let none = text.replace("tile_tilt = 1.0", "");
    let message = Sensor::parse("x.toml", &none).unwrap_err().to_string();
    assert!(
        message.contains("tile_tilt") && message.contains("from_drawing"),
        "{message}"
    );
    let thick = text.replace("insulation = \"6 um\"", "insulation = \"12 um\"");
    let message = Sensor::parse("x.toml", &thick).unwrap_err().to_string();
    assert!(
        message.contains("plates.insulation") && message.contains("parallel_capacitance"),
        "{message}"
    );
}
