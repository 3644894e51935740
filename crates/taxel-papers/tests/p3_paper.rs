//! Published numbers of paper P3; each expects the printed value within its
//! printed digits, or states why it cannot be met (`papers/p3.toml`).
#![allow(clippy::unwrap_used)]

use taxel::electronics::FirstOrderFilter;
use taxel::mechanics::{LayerLaw, Profile, SoftLayer, bending_stiffness};
use taxel::transduction::{
    Ceramic, PiezoelectricElement, PiezoelectricLaw, SiliconePath, VACUUM_PERMITTIVITY,
};
use taxel_numerics::linear_chain::Chain;
use taxel_papers::Paper;

const FILTER: FirstOrderFilter = FirstOrderFilter {
    input_resistance: 82e3,
    feedback_resistance: 390e3,
    feedback_capacitance: 47e-9,
};

fn ceramic() -> Ceramic {
    Ceramic {
        area: 4e-6,
        thickness: 0.127e-3,
        modulus: 5e10,
        density: 7800.0,
        damping_ratio: 1.0,
    }
}

fn element(leak_resistance: f64) -> PiezoelectricElement {
    PiezoelectricElement::new(&ceramic(), 650e-12, 875e-12, leak_resistance)
}

fn silicone(thickness: f64) -> SiliconePath {
    SiliconePath::of_layer(8e4, 10.0, 4e-6, thickness)
}

/// Sum of the amplitudes A1 + A2 at the output for `profile`, 10 D high.
fn sum(leak_resistance: f64, profile: Profile, window: [f64; 2]) -> f64 {
    let transfer = element(leak_resistance)
        .voltage_per_displacement(silicone(1e-3))
        .then(&FILTER.transfer());
    let chain = Chain::new(&transfer).unwrap();
    let [lowest, highest] = chain.extremes(&profile.knots(46.3e-6), window[0], window[1]);
    highest - lowest
}

const STEP: Profile = Profile::Step { ramp: 0.01 };
const IMPACT: Profile = Profile::Impact {
    ramp: 0.01,
    dwell: 0.2,
};

fn cyclic(period: f64) -> Profile {
    Profile::Cyclic {
        ramp: 0.01,
        period,
        cycles: 12,
    }
}

/// Impact and steady cyclic sum over that of the step.
fn ratios(leak_resistance: f64) -> [f64; 2] {
    let step = sum(leak_resistance, STEP, [0.0, 1.0]);
    let impact = sum(leak_resistance, IMPACT, [0.0, 1.0]);
    let cyclic = sum(leak_resistance, cyclic(0.35), [11.0 * 0.35, 12.0 * 0.35]);
    [impact / step, cyclic / step]
}

#[test]
fn p3_section_2_derived_constants() {
    let (element, path) = (element(280e6), silicone(1e-3));
    for (value, expected, digit) in [
        (element.stiffness, 1.5748e9, 1e5),
        (element.mass, 3.9624e-6, 1e-10),
        ((element.stiffness / element.mass).sqrt(), 1.994e7, 1e4),
        (path.stiffness, 320.0, 1e-9),
        (path.damping, 0.04, 1e-12),
        (
            path.stiffness / (path.stiffness + element.stiffness),
            2.032e-7,
            1e-10,
        ),
    ] {
        assert!(
            (value - expected).abs() <= 0.5 * digit,
            "{value} {expected}"
        );
    }
}

#[test]
fn p3_eq4_capacitance() {
    // C_s = ε₀ ε_r A/t: 875 pF at 0.127 mm is a relative permittivity of 3138.
    let farad = VACUUM_PERMITTIVITY * 3138.0 * 4e-6 / 0.127e-3;
    assert_eq!((farad * 1e12).round(), 875.0);
}

#[test]
fn p3_eq9_to_11_short_circuit_constant() {
    // Free along y, no field: D_z/σ_z must be d₃₃ = d-form of the same law.
    let law = PiezoelectricLaw {
        stiffness: [1.2e11, 0.8e11, 1.1e11],
        piezoelectric: [-6.0, 20.0],
        permittivity: 1.5e-8,
    };
    let (e_z, ratio) = (1e-5, 0.8 / 1.2);
    let state = law.respond(-ratio * e_z, e_z, 0.0);
    assert!(state.stress_y.abs() < 1e-9 * state.stress_z);
    // Eliminating ε_y: d = (e₃₃ − e₃₁c₁₃/c₁₁)/(c₃₃ − c₁₃²/c₁₁).
    let d = (20.0 + 6.0 * ratio) / (1.1e11 - 0.8e11 * ratio);
    assert!((state.electric_displacement / state.stress_z / d - 1.0).abs() < 1e-14);
    // The field alone: stresses −e E, displacement εE.
    let state = law.respond(0.0, 0.0, 1e3);
    assert_eq!([state.stress_y, state.stress_z], [6e3, -20e3]);
    assert!((state.electric_displacement - 1.5e-5).abs() < 1e-20);
}

#[test]
fn p3_eq26_27_filter() {
    // Printed 4.75 and 8.67 Hz; the parts give 4.756 and 8.683 Hz.
    assert!((FILTER.gain() + 4.75610).abs() < 5e-6);
    let corner = 1.0 / (std::f64::consts::TAU * FILTER.time_constant());
    assert!((corner - 8.68276).abs() < 5e-6);
    assert!(
        (FILTER.transfer().at_frequency(corner).norm() / 4.75610 - 0.5_f64.sqrt()).abs() < 1e-6
    );
}

#[test]
fn p3_section_2_3_least_deformation() {
    // Printed 0.027 nm: C ΔV/(d₃₃ k_p) with table 1 and 110e-12 C/N.
    for (thickness, expected) in [(0.127e-3, 0.0264e-9), (0.130e-3, 0.0270e-9)] {
        let ceramic = Ceramic {
            modulus: 8e9,
            thickness,
            ..ceramic()
        };
        let element = PiezoelectricElement::new(&ceramic, 110e-12, 610e-12, 160e3);
        let least = 610e-12 * 1.2e-3 / element.charge_per_compression();
        assert!((least - expected).abs() <= 0.5e-13, "{least}");
    }
}

#[test]
fn p3_eq22_bending_stiffness() {
    // ν = 1/2: E t³/9.
    assert!((bending_stiffness(8e4, 1e-3, 0.5) - 8.88888888888889e-6).abs() < 1e-20);
}

#[test]
fn p3_section_3_3_preloaded_thickness() {
    let pressed = |thickness, modulus, law, force| {
        let layer = SoftLayer {
            thickness,
            modulus,
            law,
        };
        layer.preloaded(force, 100e-6).unwrap()
    };
    let pair = |modulus, law| {
        [
            pressed(1.5e-3, modulus, law, 2.68),
            pressed(2.3e-3, modulus, law, 4.2),
        ]
    };
    let check = |found: f64, expected: f64| {
        // Half of the last digit.
        assert!((found - expected).abs() <= 0.5e-4, "{found} {expected}");
    };
    let gain = |[thin, thick]: [taxel::mechanics::Preloaded; 2]| {
        thin.stiffness_per_area / thick.stiffness_per_area
    };
    // Printed 1 mm and 1.11 mm; 4.2 N give 1.0925 mm.
    let linear = pair(80e3, LayerLaw::Linear);
    check(linear[0].thickness * 1e3, 0.9975);
    check(linear[1].thickness * 1e3, 1.0925);
    check(gain(linear), 1.0952);
    let maker = pair(82.7e3, LayerLaw::Linear);
    check(maker[0].thickness * 1e3, 1.0139);
    check(maker[1].thickness * 1e3, 1.1319);
    check(gain(maker), 1.1164);
    let large = pair(80e3, LayerLaw::NeoHookean);
    check(large[0].thickness * 1e3, 1.1310);
    check(large[1].thickness * 1e3, 1.5358);
    check(large[0].thickness / 1.5e-3, 0.75399);
    check(large[1].thickness / 2.3e-3, 0.66774);
    // N/mm over the 100 mm² of the contact.
    check(large[0].stiffness_per_area * 100e-6 * 1e-3, 10.0725);
    check(large[1].stiffness_per_area * 100e-6 * 1e-3, 8.9477);
    check(gain(large), 1.1257);
}

#[test]
fn p3_figure_14_thickness_ratio() {
    // |Vout| per displacement at 1.0 and 1.11 mm.
    let element = element(280e6);
    let output = |thickness| {
        element
            .voltage_per_displacement(silicone(thickness))
            .then(&FILTER.transfer())
    };
    let (thin, thick) = (output(1.0e-3), output(1.11e-3));
    for i in 0..=50 {
        let hertz = 10.0_f64.powf(-1.0 + 0.1 * f64::from(i));
        let ratio = thin.at_frequency(hertz).norm() / thick.at_frequency(hertz).norm();
        // k_s/k_p of the thin layer, 2e-7, times 11 %.
        assert!(ratio < 1.11 && ratio > 1.11 - 3e-8, "{hertz} {ratio}");
    }
}

#[test]
fn p3_figure_5_output_falls_as_the_inverse_thickness() {
    let element = PiezoelectricElement::new(
        &Ceramic {
            modulus: 8e9,
            ..ceramic()
        },
        110e-12,
        610e-12,
        160e3,
    );
    let peak = |thickness| {
        let transfer = element.voltage_per_displacement(silicone(thickness));
        let chain = Chain::new(&transfer).unwrap();
        chain.extremes(&STEP.knots(46.3e-6), 0.0, 0.1)[1]
    };
    // Measured -1.3e-4: k_s/k_p is 2.5e-5, and b_s adds 1 % to the damping of
    // the element, whose lag of 1 us takes 1 % off a peak that leaks in 0.1 ms.
    assert!((peak(0.05e-3) / peak(0.5e-3) / 10.0 - 1.0).abs() < 2e-4);
}

#[test]
fn p3_section_6_leak_resistance() {
    // tau = 0.242 s fits impact/step and cyclic/step at once.
    let [impact, cyclic] = ratios(0.242 / 875e-12);
    assert_eq!((impact * 1e3).round(), 1555.0);
    assert_eq!((cyclic * 1e3).round(), 1304.0);
    // The printed 160 kΩ makes a differentiator of the element.
    let [impact, cyclic] = ratios(160e3);
    assert!((impact - 2.0).abs() < 5e-4 && (cyclic - 2.0).abs() < 5e-4);
}

#[test]
fn p3_section_6_ramps_move_the_leak_little() {
    // Best τ for the mean ratios of table 2, on a grid of 4 ms.
    let best = |ramp: f64| {
        let mismatch = |tau: f64| {
            let leak = tau / 875e-12;
            let dwell = 0.2;
            let (step, impact) = (Profile::Step { ramp }, Profile::Impact { ramp, dwell });
            let cyclic = Profile::Cyclic {
                ramp,
                period: 0.35,
                cycles: 12,
            };
            let one = sum(leak, step, [0.0, 1.0]);
            let impact = sum(leak, impact, [0.0, 1.0]) / one;
            let cyclic = sum(leak, cyclic, [11.0 * 0.35, 12.0 * 0.35]) / one;
            (impact / 1.558 - 1.0).hypot(cyclic / 1.3005 - 1.0)
        };
        let grid = (0..30).map(|i| 0.2 + 0.004 * f64::from(i));
        grid.min_by(|a, b| mismatch(*a).total_cmp(&mismatch(*b)))
            .unwrap()
    };
    // 0.237 and 0.289 s on a fine grid.
    assert!((best(1e-3) - 0.237).abs() < 0.0025);
    assert!((best(80e-3) - 0.289).abs() < 0.0025);
}

#[test]
fn p3_section_4_cycles_become_symmetric() {
    let transfer = element(0.25 / 875e-12)
        .voltage_per_displacement(silicone(1e-3))
        .then(&FILTER.transfer());
    let chain = Chain::new(&transfer).unwrap();
    let asymmetry = |cycle: f64| {
        let [lowest, highest] = chain.extremes(
            &cyclic(0.35).knots(46.3e-6),
            (cycle - 1.0) * 0.35,
            cycle * 0.35,
        );
        (-lowest / highest - 1.0).abs()
    };
    assert!(asymmetry(1.0) > 0.5);
    assert!(asymmetry(5.0) < 3e-3 && asymmetry(5.0) > 1e-3);
    assert!(asymmetry(7.0) < 2.5e-4);
}

#[test]
fn p3_section_4_1_frequency_of_cycles() {
    // "2-5 Hz caused no changes": the steady sum over the step, per form.
    let leak = 0.242 / 875e-12;
    let step = sum(leak, STEP, [0.0, 1.0]);
    let steady = |profile, period: f64| sum(leak, profile, [11.0 * period, 12.0 * period]) / step;
    for (period, trapezoid, sine) in [(0.2, 1.16, 1.06), (0.5, 1.44, 1.14)] {
        let found = [
            steady(cyclic(period), period),
            steady(Profile::Sine { period, cycles: 12 }, period),
        ];
        for (found, expected) in found.into_iter().zip([trapezoid, sine]) {
            assert!(
                (found - expected).abs() <= 0.005,
                "{period} {found} {expected}"
            );
        }
    }
}

#[test]
fn p3_every_equation_and_figure_is_there() {
    let ledger = Paper::P3.ledger();
    // Every numbered equation is there.
    for number in 1..=27 {
        let place = format!("Eq. {number}");
        assert!(
            ledger.entries.iter().any(|entry| entry.row.place == place),
            "{place}"
        );
    }
    let places: Vec<_> = ledger.figures.iter().map(|figure| &figure.place).collect();
    assert_eq!(
        places,
        [
            "Figure 5",
            "Figure 14",
            "Figure 15",
            "Figure 16",
            "Figure 17",
            "Figure 18",
            "Figure 19",
            "Figure 20"
        ]
    );
}
