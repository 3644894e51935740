//! Numbers that P4 prints, and what follows from them.
#![allow(clippy::unwrap_used)]

#[path = "../../taxel/tests/common/mod.rs"]
mod common;

use common::{UM, assert_near, p4_cell, p4_law};
use taxel::electronics::VoltageDivider;
use taxel::mechanics::{
    ClosingCurve, ClosingState, Hyperelastic, LinearElastic, MicrochannelSection,
    MicrochannelShape, MooneyRivlin, PressureLaw, Stretch,
};
use taxel::transduction::{Conductor, mean_inverse_area_ratio};
use taxel_papers::Paper;

const KPA: f64 = 1e3;

/// Printed number of a row, in its printed unit.
fn printed(id: &str) -> f64 {
    Paper::P4.table().number(id, 0)
}

const MATERIAL: Hyperelastic = Hyperelastic::MooneyRivlin(MooneyRivlin {
    c10: 75.5e3,
    c01: 5.7e3,
});
const PRINTED: LinearElastic = LinearElastic {
    young_modulus: 500e3,
    poisson_ratio: 0.5,
};
const DIVIDER: VoltageDivider = VoltageDivider {
    supply: 2.0,
    reference: 10.0,
    lead: 0.0,
    saturation: 1.97,
    noise: 0.0,
};

fn section(height: f64) -> MicrochannelSection {
    MicrochannelSection::rectangle(400.0 * UM, height * UM)
}

/// Pressure on the whole top at which a cell has lost `loss` of its area, kPa.
fn pressure_at_loss(height: f64, roof: f64, loss: f64) -> f64 {
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if 1.0 - cell_ratio(height, roof, middle).0 < loss {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Area ratio and state of a cell under Eq. 2 at `pressure`, kPa.
fn cell_ratio(height: f64, roof: f64, pressure: f64) -> (f64, ClosingState) {
    let curve = ClosingCurve::of_cell(&p4_cell(height, roof), MATERIAL.shear_modulus()).unwrap();
    let load = [Stretch {
        share: 1.0,
        pressure: pressure * KPA,
    }];
    let channel = curve.settle(&PressureLaw::Paper(p4_law()), &load).unwrap();
    (channel.volume_ratio, channel.sections[0].state)
}

#[test]
fn p4_material_constants_do_not_agree() {
    // 2 (75.5 + 5.7) kPa, three times that; printed are G = 250 and E = 500.
    assert_near(MATERIAL.shear_modulus(), 162.4e3, 1e-15, 0.0, "mu");
    let solid = MATERIAL.small_strain();
    assert_near(solid.young_modulus, 487.2e3, 1e-15, 0.0, "E");
    assert_near(
        printed("youngs_modulus") / 487.2 - 1.0,
        0.026,
        0.0,
        5e-4,
        "E = 500 kPa is 2.6 % more",
    );
}

#[test]
fn p4_eq1_closing_pressures() {
    for (height, kilopascal) in [(20.0, 16.7), (60.0, 50.0), (100.0, 83.3), (200.0, 166.7)] {
        let closing = section(height).closing_pressure(&PRINTED) / KPA;
        // Stated with one decimal.
        assert_near(closing, kilopascal, 0.0, 0.05, "closing pressure");
    }
    // All channels below 30 um are closed for Eq. 1 at the least load of the sweep.
    assert!(
        section(30.0)
            .published_area_ratio(&PRINTED, 25.0 * KPA)
            .is_err()
    );
    assert!(
        section(30.1)
            .published_area_ratio(&PRINTED, 25.0 * KPA)
            .is_ok()
    );
}

/// Eq. 1 takes the largest closing of a slit as its mean: 4/pi too much.
#[test]
fn p4_eq1_overstates_the_slit_by_four_over_pi() {
    let solid = MATERIAL.small_strain();
    let slit = MicrochannelShape::Slit
        .compliance(section(20.0), MATERIAL.shear_modulus())
        .unwrap();
    let eq1 = 1.0 / section(20.0).closing_pressure(&solid);
    assert_near(slit / eq1, std::f64::consts::FRAC_PI_4, 1e-15, 0.0, "pi/4");
}

#[test]
fn p4_small_load_forms() {
    let c0 = |shape: MicrochannelShape, ratio: f64| {
        shape.compliance(section(400.0 / ratio), 1.0).unwrap()
    };
    for (ratio, slit, rectangle, eq1) in [
        (20.0, 7.85, 8.30, 10.0),
        (5.0, 1.96, 2.465, 2.5),
        (1.0, 0.39, 1.207, 0.5),
    ] {
        // Stated with three digits.
        assert_near(c0(MicrochannelShape::Slit, ratio), slit, 0.0, 0.005, "slit");
        assert_near(
            c0(MicrochannelShape::Rectangle, ratio),
            rectangle,
            0.0,
            1e-6,
            "rectangle",
        );
        let unit = LinearElastic {
            young_modulus: 3.0,
            poisson_ratio: 0.5,
        };
        let closing = section(400.0 / ratio).closing_pressure(&unit);
        assert_near(1.0 / closing, eq1, 1e-12, 0.0, "Eq. 1");
    }
    // (400² + 20²)/(2·400·20) = 10.025, and a circle is 1.
    assert_near(
        c0(MicrochannelShape::Ellipse, 20.0),
        10.025,
        1e-12,
        0.0,
        "ellipse",
    );
    assert_near(
        c0(MicrochannelShape::Ellipse, 1.0),
        1.0,
        1e-15,
        0.0,
        "circle",
    );
    for outside in [0.99, 20.1] {
        assert_eq!(
            MicrochannelShape::Rectangle.compliance(section(400.0 / outside), 1.0),
            None
        );
    }
    // The real cell of 20 um under 140 um: 2.06 times the endless body and
    // 1.71 times Eq. 1 (two decimals).
    let cell = ClosingCurve::of_cell(&p4_cell(20.0, 140.0), 162.4e3)
        .unwrap()
        .compliance();
    let endless = MicrochannelShape::Rectangle
        .compliance(section(20.0), 162.4e3)
        .unwrap();
    assert_near(cell / endless, 2.06, 0.0, 0.005, "endless body");
    let eq1 = 1.0 / section(20.0).closing_pressure(&MATERIAL.small_strain());
    assert_near(cell / eq1, 1.71, 0.0, 0.005, "Eq. 1");
}

#[test]
fn p4_area_losses_and_resistance_increases_agree() {
    let increase = |loss: f64| mean_inverse_area_ratio([(1.0, 1.0 - loss)]) - 1.0;
    // Printed +228 % and +62 %.
    assert_near(
        increase(0.01 * printed("upper_loss")),
        2.279,
        0.0,
        5e-4,
        "top",
    );
    assert_near(
        increase(0.01 * printed("lower_loss")),
        0.618,
        0.0,
        5e-4,
        "bottom",
    );
}

/// With Eq. 2 a loss needs a pressure, whatever the channel (section 4.4).
#[test]
fn p4_eq2_bounds_the_published_losses() {
    let law = p4_law();
    assert_near(
        law.expansion * law.atmosphere,
        20.265e3,
        1e-12,
        0.0,
        "eta P_atm",
    );
    assert_near(law.pressure(1.0 - 0.695) / KPA, 46.18, 0.0, 0.005, "69.5 %");
    assert_near(law.pressure(1.0 - 0.382) / KPA, 12.53, 0.0, 0.005, "38.2 %");
    // In the cell of the paper: 52.66 kPa, and 68.3 % at 50 kPa.
    let needed = pressure_at_loss(20.0, 140.0, 0.695);
    assert_near(needed, 52.66, 0.0, 0.01, "pressure of 69.5 %");
    assert_near(
        1.0 - cell_ratio(20.0, 140.0, 50.0).0,
        0.683,
        0.0,
        5e-4,
        "loss at 50 kPa",
    );
}

#[test]
fn p4_sweep_claims() {
    // "as low as 3.6 %" at 25 mN: not reproduced, 31 to 61 % for the tabulated
    // designs of 100 to 160 um under more than 100 um.
    let increase = |height, roof, pressure| 1.0 / cell_ratio(height, roof, pressure).0 - 1.0;
    assert_near(increase(160.0, 200.0, 25.0), 0.31, 0.0, 0.005, "stiffest");
    for (height, roof) in [(100.0, 140.0), (160.0, 120.0), (160.0, 200.0)] {
        assert!((0.305..0.615).contains(&increase(height, roof, 25.0)));
    }
    // 3.6 % of the stiffest needs 3.3 kPa.
    let needed = pressure_at_loss(160.0, 200.0, 1.0 - 1.0 / 1.036);
    assert_near(needed, 3.3, 0.0, 0.05, "3.6 %");
    // The best range, 20 to 60 um under 100 to 160 um: 65 to 108 %.
    for (height, roof) in [
        (20.0, 100.0),
        (20.0, 140.0),
        (40.0, 100.0),
        (40.0, 140.0),
        (60.0, 120.0),
        (60.0, 160.0),
    ] {
        assert!((0.645..1.085).contains(&increase(height, roof, 25.0)));
    }
}

/// Eq. 2 never lets a channel close: the state at the end of a sweep is the
/// first touch of the roof, not a closed channel.
#[test]
fn p4_eq2_never_closes() {
    let (ratio, state) = cell_ratio(20.0, 140.0, 250.0);
    assert!(
        ratio > 0.06 && state == ClosingState::Closed,
        "{ratio} {state:?}"
    );
    assert_eq!(cell_ratio(20.0, 140.0, 64.8).1, ClosingState::Open);
    // The first touch at 64.863 kPa.
    assert_eq!(cell_ratio(20.0, 140.0, 65.0).1, ClosingState::Closed);
    assert!(matches!(
        cell_ratio(20.0, 140.0, 400.0).1,
        ClosingState::Beyond { .. }
    ));
}

#[test]
fn p4_divider_numbers() {
    let rest = DIVIDER.resistance(printed("rest_voltage")).unwrap();
    // Three decimals; printed is 3.67 ohm, which would read 0.537 V.
    assert_near(rest, 3.378, 0.0, 5e-4, "rest");
    assert_near(
        DIVIDER.voltage(printed("rest_resistance")),
        0.537,
        0.0,
        5e-4,
        "3.67 ohm",
    );
    let pressed = DIVIDER.resistance(printed("pressed_voltage")).unwrap();
    assert_near(pressed, 5.773, 0.0, 5e-4, "0.732 V");
    // "approximately 45 %" is of the voltage; of the resistance it is 70.9 %.
    assert_near(
        printed("pressed_voltage") / printed("rest_voltage"),
        1.4495,
        0.0,
        5e-5,
        "voltage",
    );
    assert_near(pressed / rest, 1.709, 0.0, 5e-4, "resistance");
    let saturated = DIVIDER.resistance(printed("collapsed_voltage")).unwrap();
    assert_near(saturated, 657.0, 0.0, 0.5, "1.97 V");
    assert_near(saturated / rest, 194.0, 0.0, 0.6, "times rest");
    assert!(DIVIDER.saturated(1.97) && !DIVIDER.saturated(1.9699));
    // A change of 1 % of the voltage: dR/R = (dV/V)(1 + R/R_ref).
    let change = 0.01 * printed("rest_voltage") / (DIVIDER.slope(rest) * rest);
    assert_near(change, 0.0134, 0.0, 5e-5, "neighbour");
    for voltage in [2.0, 2.1, 0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(DIVIDER.resistance(voltage).is_err(), "{voltage} V");
    }
}

#[test]
fn p4_rest_resistance() {
    let channel = Conductor {
        resistivity: 29.4e-8,
        length: 0.1,
        section: section(20.0),
    };
    // 36.75 ohm/m: the printed 3.67 ohm would be 100 mm.
    assert_near(channel.rest_resistance(), 3.675, 1e-12, 0.0, "100 mm");
}

#[test]
fn p4_loads_in_other_units() {
    let area = std::f64::consts::PI * 0.25e-3 * 0.25e-3;
    // 180 mN and 1008 mN under a round punch of 0.5 mm.
    let [upper, lower] = ["upper_saturation", "lower_saturation"].map(|id| 1e-3 * printed(id));
    assert_near(upper / area / KPA, 917.0, 0.0, 0.5, "top saturates");
    assert_near(lower / area * 1e-6, 5.1, 0.0, 0.05, "bottom saturates");
}

/// One force as a point load and spread over four taxels: by hand from the closing curve of the
/// upper layer and Eq. 2 with the volume of the whole channel.
#[test]
fn a_point_load_deforms_more() {
    let curve = ClosingCurve::of_cell(&p4_cell(20.0, 140.0), MATERIAL.shear_modulus()).unwrap();
    let (force, length) = (1e-3, 91.92e-3);
    let change = |area: f64, along: f64| {
        let share = along / length;
        let load = [
            Stretch {
                share,
                pressure: force / area,
            },
            Stretch {
                share: 1.0 - share,
                pressure: 0.0,
            },
        ];
        let channel = curve.settle(&PressureLaw::Paper(p4_law()), &load).unwrap();
        let ratios = channel.sections.iter().map(|section| section.area_ratio);
        let shares = [share, 1.0 - share];
        let change = mean_inverse_area_ratio(shares.into_iter().zip(ratios)) - 1.0;
        (change, 1.0 - channel.sections[0].area_ratio)
    };
    let pad = 1e-6 * printed("pads");
    let point = change(std::f64::consts::FRAC_PI_4 * pad * pad, pad);
    let even = change(1e-6, 1e-3);
    let ledger = Paper::P4.ledger();
    let note = &ledger.entry("point_and_distributed").unwrap().note;
    let times = format!("by {:.1} times", point.0 / even.0);
    let losses = format!(
        "{:.0} % in place of {:.0} %",
        100.0 * point.1,
        100.0 * even.1
    );
    assert!(
        point.0 > even.0 && note.contains(&times) && note.contains(&losses),
        "{note}"
    );
}
