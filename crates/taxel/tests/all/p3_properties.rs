//! Properties of the piezoelectric array whatever the numbers are.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use proptest::prelude::*;
use taxel::electronics::{ChargeMode, FirstOrderFilter, Output};
use taxel::mechanics::{Base, ContactPressure, LayerLaw, Plate, Profile, SoftCover, SoftLayer};
use taxel::transduction::{Ceramic, PiezoelectricElement, SiliconePath};
use taxel_numerics::linear_chain::{Chain, Transfer};
use taxel_numerics::special::j0;

prop_compose! {
    /// Elements of any usual size, damped from ringing to sluggish.
    fn any_element()(
        side in 0.5e-3..5e-3,
        thickness in 0.1e-3..0.5e-3,
        modulus in 8e9..7e10,
        damping_ratio in prop_oneof![Just(1.0), Just(0.0156), 0.01..3.0],
        charge_per_force in 1e-10..1e-9,
        capacitance in 1e-10..2e-9,
        leak_resistance in prop_oneof![1e5..1e6, 1e7..1e9],
    ) -> PiezoelectricElement {
        let ceramic = Ceramic { area: side * side, thickness, modulus, density: 7800.0, damping_ratio };
        PiezoelectricElement::new(&ceramic, charge_per_force, capacitance, leak_resistance)
    }
}

prop_compose! {
    fn any_filter()(
        input_resistance in 1e4..1e6,
        feedback_resistance in 1e4..1e6,
        feedback_capacitance in 1e-9..1e-7,
    ) -> FirstOrderFilter {
        FirstOrderFilter { input_resistance, feedback_resistance, feedback_capacitance }
    }
}

fn any_path() -> impl Strategy<Value = SiliconePath> {
    (0.05e-3..3e-3, prop_oneof![Just(0.0), 0.1..50.0])
        .prop_map(|(thickness, viscosity)| SiliconePath::of_layer(8e4, viscosity, 4e-6, thickness))
}

fn any_chain() -> impl Strategy<Value = Chain> {
    (any_element(), any_path(), any_filter(), any::<bool>()).prop_map(
        |(element, path, filter, by_force)| {
            let open = if by_force {
                element.voltage_per_force()
            } else {
                element.voltage_per_displacement(path)
            };
            Chain::new(&open.then(&filter.transfer())).unwrap()
        },
    )
}

/// Inputs through corners that lie on whole milliseconds.
fn any_input() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec((1_u32..40, -1.0..1.0), 1..8).prop_map(|corners| {
        let mut time = 0;
        let mut knots = vec![[0.0, 0.0]];
        for (wait, value) in corners {
            time += wait;
            knots.push([f64::from(time) / 1e3, value * 1e-5]);
        }
        knots
    })
}

/// Whole milliseconds, `per_millisecond` steps apart: the values at 1 kHz.
fn sampled(chain: &Chain, knots: &[[f64; 2]], per_millisecond: usize) -> Vec<f64> {
    let times: Vec<f64> = (1..=200 * per_millisecond)
        .map(|i| i as f64 / (1e3 * per_millisecond as f64))
        .collect();
    let all = chain.respond(knots, &times);
    all.into_iter()
        .skip(per_millisecond - 1)
        .step_by(per_millisecond)
        .collect()
}

fn largest(values: &[f64]) -> f64 {
    values
        .iter()
        .fold(0.0, |largest: f64, value| largest.max(value.abs()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn values_do_not_depend_on_the_sampling_rate(chain in any_chain(), knots in any_input()) {
        let (slow, fast) = (sampled(&chain, &knots, 1), sampled(&chain, &knots, 100));
        let scale = largest(&slow);
        for (slow, fast) in slow.iter().zip(&fast) {
            // What is asked for. 2e4 roundings, of which a leak of 0.1 ms leaves 1 %, and two poles that
            // are 1 % apart two digits: with those 1.01e-10 was found.
            prop_assert!((slow - fast).abs() <= 1e-9 * scale, "{slow:e} {fast:e} of {scale:e}");
        }
    }

    #[test]
    fn the_response_is_linear(chain in any_chain(), a in any_input(), factor in -5.0..5.0_f64) {
        let scaled: Vec<_> = a.iter().map(|[time, value]| [*time, factor * value]).collect();
        let (one, many) = (sampled(&chain, &a, 1), sampled(&chain, &scaled, 1));
        let scale = largest(&many);
        for (one, many) in one.iter().zip(&many) {
            // The input is rounded anew; a leak of 0.1 ms leaves 1 % of it, and two poles that are 0.1 %
            // apart three digits: with those 1.1e-11 was found.
            prop_assert!((factor * one - many).abs() <= 1e-10 * scale, "{} of {scale}", factor * one - many);
        }
    }

    #[test]
    fn two_loads_add(chain in any_chain(), knots in any_input(), ramp in 1_u32..30) {
        // On the corners of both, the sum of two inputs is a third one.
        let other = [[0.0, 0.0], [f64::from(ramp) / 1e3, 2e-6]];
        let value = |time: f64| 2e-6 * (1e3 * time / f64::from(ramp)).min(1.0);
        let mut both: Vec<[f64; 2]> = knots.iter().map(|[time, x]| [*time, x + value(*time)]).collect();
        let end = other[1][0];
        if let Some(after) = both.iter().position(|knot| knot[0] > end) {
            let [t0, x0] = knots[after - 1];
            let [t1, x1] = knots[after];
            both.insert(after, [end, x0 + (x1 - x0) * (end - t0) / (t1 - t0) + 2e-6]);
        } else if both.last().unwrap()[0] < end {
            both.push([end, knots.last().unwrap()[1] + 2e-6]);
        }
        let [a, b, sum] = [&knots[..], &other, &both].map(|knots| sampled(&chain, knots, 1));
        let scale = largest(&sum).max(largest(&a)).max(largest(&b));
        for i in 0..sum.len() {
            prop_assert!((a[i] + b[i] - sum[i]).abs() <= 1e-10 * scale);
        }
    }

    #[test]
    fn a_later_load_gives_the_same_later(chain in any_chain(), knots in any_input(), shift in 1_usize..50) {
        let later: Vec<_> = knots.iter().map(|[time, value]| [time + shift as f64 / 1e3, *value]).collect();
        let (now, then) = (sampled(&chain, &knots, 1), sampled(&chain, &later, 1));
        let scale = largest(&now);
        for (now, then) in now.iter().zip(&then[shift..]) {
            // Times of seconds are rounded to 1e-16, a slope passes in 1e-3 s.
            prop_assert!((now - then).abs() <= 1e-10 * scale);
        }
    }

    #[test]
    fn extremes_enclose_what_a_fine_sampling_finds(chain in any_chain(), knots in any_input()) {
        let [lowest, highest] = chain.extremes(&knots, 0.0, 0.2);
        let values = sampled(&chain, &knots, 10);
        let slack = 1e-9 * largest(&values);
        for value in values {
            prop_assert!(value >= lowest - slack && value <= highest + slack);
        }
    }

    #[test]
    fn static_gain_and_dimensionless_compression(element in any_element(), path in any_path()) {
        let transfer = element.compression_per_displacement(path);
        let gain = transfer.at(0.0.into()).re;
        // Three roundings.
        prop_assert!((gain / (path.stiffness / (element.stiffness + path.stiffness)) - 1.0).abs() < 1e-14);
        // The same chain in other units of length: no unit is left.
        let mut longer = element;
        longer.stiffness *= 7.0;
        longer.damping *= 7.0;
        longer.mass *= 7.0;
        let stiffer = SiliconePath { stiffness: 7.0 * path.stiffness, damping: 7.0 * path.damping };
        let (one, other) = (transfer.at_frequency(50.0), longer.compression_per_displacement(stiffer).at_frequency(50.0));
        prop_assert!((one - other).norm() < 1e-13 * one.norm());
    }

    #[test]
    fn the_charge_amplifier_hides_the_element_as_its_gain_grows(
        feedback_resistance in 1e5..1e9,
        feedback_capacitance in 1e-10..1e-7,
        capacitance in 1e-10..1e-8,
        hertz in 0.01..1e5,
    ) {
        let amplifier = |open_loop_gain| ChargeMode { feedback_resistance, feedback_capacitance, open_loop_gain, filter: None, output: Output::IDEAL };
        let s = num_complex::Complex64::new(0.0, 2.0 * PI * hertz);
        // Case of the closed form: −Q jωR_f/(1 + jωR_f C_f).
        let closed = -s * feedback_resistance / (1.0 + s * feedback_resistance * feedback_capacitance);
        let ideal = amplifier(f64::INFINITY).band(capacitance, 280e6).transfer().at(s);
        prop_assert!((ideal - closed).norm() < 1e-14 * closed.norm());
        let real = amplifier(1e4).band(capacitance, 280e6).transfer().at(s);
        // By C_f → C_f + (C + C_f)/A₀, and by (1 + R_f/R)/A₀ of the leak.
        let bound = (1.0 + capacitance / feedback_capacitance + feedback_resistance / 280e6) / 1e4;
        let off = (real / ideal - 1.0).norm();
        prop_assert!(off <= bound, "{off} {bound}");
        prop_assert!(off > 0.0);
    }

    #[test]
    fn a_step_of_charge_decays_with_the_feedback(resistance in 1e5..1e8, farad in 1e-9..1e-7) {
        let ideal = ChargeMode {
            feedback_resistance: resistance,
            feedback_capacitance: farad,
            open_loop_gain: f64::INFINITY,
            filter: None,
            output: Output::IDEAL,
        };
        let chain = Chain::new(&ideal.band(875e-12, 280e6).transfer()).unwrap();
        let tau = resistance * farad;
        let knots = [[0.0, 0.0], [1e-6 * tau, 1e-9]];
        let values = chain.respond(&knots, &[1e-6 * tau, tau, 3.0 * tau]);
        for (value, after) in values.iter().zip([0.0, 1.0, 3.0]) {
            // The ramp of 1e-6 τ stands for the step: relative error 1e-6.
            prop_assert!((value / (-1e-9 / farad * f64::exp(-after)) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn preload_is_monotonic_and_refuses_what_it_cannot_carry(
        thickness in 0.1e-3..5e-3, modulus in 1e4..1e6, area in 1e-6..1e-3, share in 0.0..0.999,
    ) {
        for law in [LayerLaw::Linear, LayerLaw::NeoHookean] {
            let layer = SoftLayer { thickness, modulus, law };
            let limit = area * modulus;
            let pressed = layer.preloaded(share * limit, area).unwrap();
            let less = layer.preloaded(0.9 * share * limit, area).unwrap();
            prop_assert!(pressed.thickness > 0.0 && pressed.thickness <= less.thickness);
            prop_assert!(pressed.stiffness_per_area >= less.stiffness_per_area);
            prop_assert!(layer.preloaded(-1e-9, area).is_err());
            prop_assert!(layer.preloaded(f64::NAN, area).is_err());
            prop_assert_eq!(layer.preloaded(1.01 * limit, area).is_err(), law == LayerLaw::Linear);
        }
    }
}

proptest! {
    // Each case takes some milliseconds of quadrature.
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn the_table_of_shares_agrees_with_the_integral(
        thickness in 0.4e-3..2e-3,
        radius in 0.0..6e-3,
        hertz in any::<bool>(),
        x in -8e-3..8e-3,
        y in -8e-3..8e-3,
    ) {
        let contact = if hertz { ContactPressure::Hertz(radius) } else { ContactPressure::Uniform(radius) };
        let cover = SoftCover { thickness, base: Base::Rigid, contact };
        let off = (cover.table().share([x, y], 2e-3) - cover.share([x, y], 2e-3)).abs();
        // What ShareTable states.
        prop_assert!(off < 1e-6, "{off:e}");
    }

    #[test]
    fn the_whole_load_arrives(thickness in 0.4e-3..1.5e-3, radius in 0.0..5e-3, x in -1e-3..1e-3, y in -1e-3..1e-3) {
        let cover = SoftCover { thickness, base: Base::Rigid, contact: ContactPressure::Uniform(radius) };
        let table = cover.table();
        let cells = (-20..=20).flat_map(|i| (-20..=20).map(move |j| (i, j)));
        let total: f64 = cells
            .map(|(i, j)| table.share([f64::from(i) * 2e-3 + x, f64::from(j) * 2e-3 + y], 2e-3))
            .sum();
        // Beyond 40 mm exp(−0.739·35/1.5) = 3e-8 is left; common edges cancel.
        prop_assert!((total - 1.0).abs() < 1e-6, "{total}");
    }

    #[test]
    fn damped_plates_against_direct_quadrature(damping in 0.0..3000.0, distance in 0.5e-3..4e-3, time in 0.5e-3..5e-3) {
        let plate = Plate { bending_stiffness: 8.89e-6, mass_per_area: 1.07, damping };
        let motion = plate.impulse_response(distance, time).unwrap();
        let off = motion.deflection - plate_by_wave_numbers(&plate, distance, time);
        // Simpson's rule with 100 steps in a half period: (π/100)⁴/180 = 5e-9.
        prop_assert!(off.abs() < 1e-8 * plate.first_deflection(), "{off:e}");
        let step = 1e-4 * time;
        let [after, before] = [time + step, time - step].map(|t| plate.impulse_response(distance, t).unwrap().deflection);
        let slope = (after - before) / (2.0 * step);
        // Central difference: (1e-4)²/6 times the third power of the phase, at most 8.
        prop_assert!((slope - motion.velocity).abs() < 1e-5 * plate.first_deflection() / time);
    }
}

/// u = 1/(2πm) ∫ k J₀(kr) exp(−at) sin(wt)/w dk by its own half periods in wt.
fn plate_by_wave_numbers(plate: &Plate, distance: f64, time: f64) -> f64 {
    let g = (plate.bending_stiffness / plate.mass_per_area).sqrt();
    let a = plate.damping / (2.0 * plate.mass_per_area);
    let integrand = |k: f64| {
        let square = (g * k * k).powi(2) - a * a;
        let w = square.abs().sqrt() * time;
        let wave = if w < 1e-6 {
            time
        } else if square > 0.0 {
            w.sin() / w * time
        } else {
            w.sinh() / w * time
        };
        k * j0(k * distance) * wave
    };
    let corner = |n: f64| ((n * PI / time).hypot(a) / g).sqrt();
    let simpson = |from: f64, to: f64, n: usize| {
        let h = (to - from) / n as f64;
        let inner: f64 = (1..n)
            .map(|i| if i % 2 == 1 { 4.0 } else { 2.0 } * integrand(from + i as f64 * h))
            .sum();
        h / 3.0 * (integrand(from) + inner + integrand(to))
    };
    let mut sum = simpson(0.0, corner(1.0), 4000);
    let mut sums = Vec::new();
    for n in 1..1200 {
        sum += simpson(corner(f64::from(n)), corner(f64::from(n + 1)), 100);
        if n >= 1180 {
            sums.push(sum);
        }
    }
    while sums.len() > 1 {
        sums = sums
            .windows(2)
            .map(|pair| 0.5 * (pair[0] + pair[1]))
            .collect();
    }
    (-a * time).exp() * sums[0] / (2.0 * PI * plate.mass_per_area)
}

#[test]
fn sums_of_amplitudes_are_ordered_step_cyclic_impact() {
    let ceramic = Ceramic {
        area: 4e-6,
        thickness: 1.27e-4,
        modulus: 5e10,
        density: 7800.0,
        damping_ratio: 1.0,
    };
    let element = PiezoelectricElement::new(&ceramic, 650e-12, 875e-12, 276e6);
    let filter = FirstOrderFilter {
        input_resistance: 82e3,
        feedback_resistance: 390e3,
        feedback_capacitance: 47e-9,
    };
    let path = SiliconePath::of_layer(8e4, 10.0, 4e-6, 1e-3);
    let chain = Chain::new(
        &element
            .voltage_per_displacement(path)
            .then(&filter.transfer()),
    )
    .unwrap();
    let sum = |profile: &Profile, window: [f64; 2]| {
        let [lowest, highest] = chain.extremes(&profile.knots(4.63e-5), window[0], window[1]);
        highest - lowest
    };
    for ramp in [1e-3, 10e-3, 80e-3] {
        let step = sum(&Profile::Step { ramp }, [0.0, 1.0]);
        for dwell in [0.15, 0.2, 0.25] {
            let impact = sum(&Profile::Impact { ramp, dwell }, [0.0, 1.0]);
            // A cycle that holds longer than the impact may exceed it.
            for period in [0.2, 0.3, dwell + 0.15] {
                let cyclic = Profile::Cyclic {
                    ramp,
                    period,
                    cycles: 12,
                };
                let cyclic = sum(&cyclic, [11.0 * period, 12.0 * period]);
                assert!(step < cyclic && cyclic < impact, "{ramp} {dwell} {period}");
            }
        }
    }
}

#[test]
fn a_transfer_is_its_stages() {
    let stage = Transfer::high_pass(2.0, 0.1);
    let both = stage.clone().then(&Transfer::low_pass(3.0, 0.2));
    let (s, t) = (both.at_frequency(1.0), stage.at_frequency(1.0));
    let expected = t * 3.0 / num_complex::Complex64::new(1.0, 0.4 * PI);
    assert!((s - expected).norm() < 1e-15 * expected.norm() * 4.0);
}
