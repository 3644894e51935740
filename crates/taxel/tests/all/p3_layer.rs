//! The silicone of P3 as a bonded layer under a rigid disc, and the element in it, against
//! tables that another program computed.
#![allow(clippy::unwrap_used)]

use crate::common::{assert_near, table};
use taxel::mechanics::{
    BondedDisc, ContactPressure, DiscGrip, DiscPressure, LayerRim, SeatedElement, SeatedSetting,
    SoftCover, SpherePressure,
};

const MM: f64 = 1e-3;
const SIDE: f64 = 2e-3;
/// The disc of 100 mm².
const AREA: f64 = 100e-6;
/// d33 and d31 of the table of elements, C/N.
const CONSTANTS: [f64; 2] = [650e-12, -320e-12];

fn disc(thickness: f64, rim: LayerRim, grip: DiscGrip) -> DiscPressure {
    let radius = (AREA / std::f64::consts::PI).sqrt();
    let disc = BondedDisc {
        radius,
        thickness,
        rim,
        grip,
    };
    disc.pressed().unwrap()
}

fn contact(words: &str) -> (LayerRim, DiscGrip) {
    let (grip, rim) = words.split_once('_').unwrap();
    let rim = if rim == "flush" {
        LayerRim::Flush
    } else {
        LayerRim::Wide
    };
    let grip = if grip == "slip" {
        DiscGrip::Slip
    } else {
        DiscGrip::Gripped
    };
    (rim, grip)
}

#[test]
fn rows_of_the_layer_come_back() {
    let mut rows = 0;
    for row in table("solved_p3_layer.csv") {
        let (rim, grip) = contact(row.text("contact"));
        let aspect = row.at("a_over_h");
        let disc = BondedDisc {
            radius: aspect * MM,
            thickness: MM,
            rim,
            grip,
        };
        let pressed = disc.pressed().unwrap();
        let what = format!("{disc:?}");
        let area = std::f64::consts::PI * disc.radius * disc.radius;
        let stiffness = pressed.stiffness(2.0) * MM / (2.0 * area);
        assert_near(stiffness, row.at("stiffness"), 1e-12, 0.0, &what);
        for percent in [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 95] {
            let radius = f64::from(percent) / 100.0 * disc.radius;
            let expected = row.at(&format!("p_{percent:02}"));
            assert_near(
                pressed.pressure(radius).unwrap(),
                expected,
                1e-9,
                0.0,
                &what,
            );
        }
        if rim == LayerRim::Flush {
            // A square beyond the disc holds the whole force.
            let whole = pressed.share([0.0; 2], 3.0 * disc.radius).unwrap();
            assert_near(whole, 1.0, 1e-6, 0.0, &what);
        }
        rows += 1;
    }
    assert_eq!(rows, 40);
}

/// The rows at 2.453 and 3.761 belong to the layers of the paper; without the disc's own table
/// these are the numbers of the specimen.
#[test]
fn shares_on_an_element_of_the_specimen() {
    for (thickness, rim, grip, share, stiffness) in [
        (1.5, LayerRim::Flush, DiscGrip::Gripped, 1.8154, 41.9),
        (2.3, LayerRim::Flush, DiscGrip::Gripped, 1.6416, 13.6),
        (1.5, LayerRim::Wide, DiscGrip::Slip, 1.1484, 33.6),
        (2.3, LayerRim::Wide, DiscGrip::Slip, 0.9788, 15.3),
    ] {
        let pressed = disc(thickness * MM, rim, grip);
        let found = pressed.share([0.0; 2], SIDE).unwrap() * AREA / (SIDE * SIDE);
        let what = format!("{thickness} {rim:?} {grip:?}");
        // 0.1 % of the table and the interpolation along the radius.
        assert_near(found, share, 1.5e-3, 0.0, &what);
        // The printed digits.
        assert_near(pressed.stiffness(80e3) * 1e-3, stiffness, 0.0, 0.05, &what);
    }
}

#[test]
fn shares_off_the_middle_of_the_disc() {
    for (thickness, shares) in [
        (1.5, [1.759, 1.639, 1.561, 1.363]),
        (2.3, [1.593, 1.491, 1.425, 1.256]),
    ] {
        let pressed = disc(thickness * MM, LayerRim::Flush, DiscGrip::Gripped);
        let places = [[1.0, 0.0], [1.25, 1.25], [1.5, 1.5], [2.0, 2.0]];
        for (place, share) in places.into_iter().zip(shares) {
            let offset = place.map(|along| along * MM);
            let found = pressed.share(offset, SIDE).unwrap() * AREA / (SIDE * SIDE);
            assert_near(found, share, 2e-3, 0.0, &format!("{thickness} {place:?}"));
        }
    }
}

/// Slipping on a disc is the half of a layer of twice the thickness that is gripped on both
/// sides: the pressure at a/h is that of the gripped disc at a/2h.
#[test]
fn a_sliding_disc_is_a_gripped_one_on_twice_the_layer() {
    // Between the rows of both.
    for aspect in [1.2, 2.2, 4.4, 8.0] {
        let pressed = |aspect: f64, grip| {
            let disc = BondedDisc {
                radius: aspect * MM,
                thickness: MM,
                rim: LayerRim::Flush,
                grip,
            };
            disc.pressed().unwrap()
        };
        let slip = pressed(aspect, DiscGrip::Slip);
        let gripped = pressed(0.5 * aspect, DiscGrip::Gripped);
        for part in [0.0, 0.3, 0.6, 0.8] {
            let [found, expected] = [
                slip.pressure(part * aspect * MM).unwrap(),
                gripped.pressure(part * 0.5 * aspect * MM).unwrap(),
            ];
            // Two interpolations, mostly between the same rows.
            assert_near(found, expected, 5e-3, 0.0, &format!("{aspect} {part}"));
        }
    }
}

#[test]
fn ten_steps_of_the_tester_need_the_force_of_the_bonded_layer() {
    let pressed = disc(1.5 * MM, LayerRim::Flush, DiscGrip::Gripped);
    let force = pressed.stiffness(80e3) * 10.0 * 4.63e-6;
    assert_near(force, 1.94, 0.0, 5e-3, "force");
}

#[test]
fn discs_outside_the_table_are_refused() {
    for radius in [0.49, 10.1, f64::NAN] {
        let disc = BondedDisc {
            radius: radius * MM,
            thickness: MM,
            rim: LayerRim::Flush,
            grip: DiscGrip::Gripped,
        };
        let error = disc.pressed().unwrap_err();
        assert!(error.to_string().contains("from 0.5 to 10"), "{error}");
    }
    // What lies beside the disc of a layer that goes on is not tabulated.
    let wide = disc(1.5 * MM, LayerRim::Wide, DiscGrip::Slip);
    assert_eq!(wide.share([5.0 * MM, 0.0], SIDE), None);
    let flush = disc(1.5 * MM, LayerRim::Flush, DiscGrip::Gripped);
    assert_near(
        flush.share([8.0 * MM, 0.0], SIDE).unwrap(),
        0.0,
        0.0,
        1e-6,
        "beside",
    );
}

fn setting(thickness: f64) -> SeatedSetting {
    SeatedSetting {
        disc_area: AREA,
        element_area: SIDE * SIDE,
        element_thickness: 0.127 * MM,
        thickness,
    }
}

#[test]
fn rows_of_the_element_come_back() {
    let mut rows = 0;
    for row in table("solved_p3_element.csv") {
        let case = row.text("case");
        let (rim, grip) = match case {
            "base" | "low" | "mid" => (LayerRim::Flush, DiscGrip::Gripped),
            "mid_wide" => (LayerRim::Wide, DiscGrip::Gripped),
            "mid_wide_slip" => (LayerRim::Wide, DiscGrip::Slip),
            _ => continue,
        };
        let setting = setting(row.si("h_mm", MM));
        let found = match setting.element(row.si("z_mm", MM), rim, grip) {
            Ok(found) => found,
            Err(error) => {
                // The two thicknesses of the preloaded layer were solved for two cases alone.
                assert!(setting.thickness < 1.5 * MM, "{error}");
                continue;
            }
        };
        // The heights of the base are rounded in the table.
        assert_near(found.share, row.at("share"), 1e-3, 0.0, case);
        assert_near(found.in_plane, row.at("s"), 0.0, 2e-3, case);
        let factor = found.charge_per_force(CONSTANTS) / CONSTANTS[0];
        assert_near(factor, row.at("charge_factor"), 3e-3, 0.0, case);
        // Without d31 it is the share.
        let alone = found.charge_per_force([CONSTANTS[0], 0.0]) / CONSTANTS[0];
        assert_near(alone, found.share, 1e-12, 0.0, case);
        rows += 1;
    }
    assert_eq!(rows, 10);
}

/// A row that is left out lies on the straight line between those of the thinner and the thicker layer,
/// which are further apart than those that are read: what is stated beyond the error of the rows.
#[test]
fn a_row_that_is_left_out_shows_the_error_between_the_thicknesses() {
    for case in ["mid", "low"] {
        let of = |thickness: f64| {
            let rows = table("solved_p3_element.csv");
            let found = rows
                .iter()
                .find(|row| row.text("case") == case && row.at("h_mm") == thickness);
            let row = found.unwrap();
            [row.at("share"), row.at("s")]
        };
        let [thin, left_out, thick] = [1.11, 1.5, 2.3];
        let part = (left_out - thin) / (thick - thin);
        let [below, exact, above] = [thin, left_out, thick].map(of);
        let read = [0, 1].map(|k| below[k] + part * (above[k] - below[k]));
        let charge = |[share, in_plane]: [f64; 2]| {
            SeatedElement { share, in_plane }.charge_per_force(CONSTANTS)
        };
        let errors =
            [read[0] / exact[0], charge(read) / charge(exact)].map(|one| (one - 1.0).abs());
        println!("{case}: share and charge are off by {errors:?}");
        // The rows are good to 1 and to 3 %.
        assert!(errors[0] < SeatedSetting::SHARE_ERROR - 0.01);
        assert!(errors[1] < SeatedSetting::CHARGE_ERROR - 0.03);
    }
}

#[test]
fn the_interval_holds_every_case_and_a_tolerance_of_d33() {
    for (thickness, least, greatest) in [(1.5, 0.693_725, 3.191_42), (2.3, 0.879_413, 3.973_55)] {
        let found = setting(thickness * MM).charge_interval(CONSTANTS).unwrap();
        // The charge factors of the element on the base and with its rim in a void.
        let expected = [0.8 * least, 1.2 * greatest].map(|factor| factor * CONSTANTS[0]);
        for (found, expected) in found.into_iter().zip(expected) {
            assert_near(found, expected, 1e-5, 0.0, &format!("{thickness}"));
        }
    }
    let error = setting(3.0 * MM).charge_interval(CONSTANTS).unwrap_err();
    assert!(error.to_string().contains("1.5 to 2.3 mm"), "{error}");
}

/// Upside down the layer between a bonded base and a gripped disc is the same.
#[test]
fn an_element_below_the_disc_is_one_above_the_base() {
    let setting = setting(1.5 * MM);
    let at = |height| {
        setting
            .element(height, LayerRim::Flush, DiscGrip::Gripped)
            .unwrap()
    };
    let [below, above] = [at(0.4 * MM), at(1.1 * MM)];
    assert_near(below.share, above.share, 1e-12, 0.0, "share");
    assert_near(below.in_plane, above.in_plane, 0.0, 1e-12, "in the plane");
}

#[test]
fn a_sphere_on_a_thick_cover_presses_as_hertz() {
    let cover = |contact| SoftCover {
        thickness: 40.0 * MM,
        base: taxel::mechanics::Base::HalfSpace,
        contact,
    };
    let sphere = SpherePressure::on_layer(0.2 * MM, 40.0 * MM).unwrap();
    let found = cover(ContactPressure::Sphere(sphere)).share([0.0; 2], SIDE);
    let hertz = cover(ContactPressure::Hertz(0.2 * MM)).share([0.0; 2], SIDE);
    // Both are points from there.
    assert_near(found, hertz, 1e-5, 0.0, "share");
}
