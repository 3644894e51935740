//! Properties of any unit and any load (section 11 of the physics of P2).
#![allow(clippy::unwrap_used, clippy::needless_range_loop)]

use proptest::prelude::*;
use taxel::acquisition::{Frame, Quantity, Stimulus};
use taxel::estimation::{
    ArrayEstimator, Certainty, ChannelState, Outcome, SearchOptions, State, ThreeAxisOptions,
    ThreeAxisReader, estimate_unit,
};
use taxel::mechanics::{Relaxation, RelaxationTerm};
use taxel::predict::Loads;
use taxel::sensor::Sensor;
use taxel::table::Cell;
use taxel::transduction::ThreeAxisModel;
use taxel::transduction::mean_inverse_gap;

const SIGMA: [f64; 4] = [1e-16; 4];

fn nominal() -> ThreeAxisModel {
    Sensor::shipped("three-axis-8x8")
        .unwrap()
        .three_axis()
        .unwrap()
        .unit_model()
}

/// Any unit that could be built: scattered gaps, parallel capacitances, tilt
/// shares, stiffnesses and a little cross-talk.
fn any_unit() -> impl Strategy<Value = ThreeAxisModel> {
    let gaps = prop::array::uniform4(4.5e-6..7e-6_f64);
    let parallel = prop::array::uniform4(0.0..40e-15_f64);
    let stiffness = prop::array::uniform3(8e3..15e3_f64);
    (gaps, parallel, stiffness, 0.0..=1.0_f64, -0.03..0.03_f64).prop_map(
        |(air_gap, parallel_capacitance, k, tile_tilt, crosstalk)| {
            let mut unit = nominal();
            unit.plates.air_gap = air_gap;
            unit.plates.parallel_capacitance = parallel_capacitance;
            unit.suspension.tile_tilt = tile_tilt;
            for axis in 0..3 {
                unit.suspension.compliance[axis][axis] = 1.0 / k[axis];
                unit.suspension.compliance[axis][(axis + 1) % 3] = crosstalk / k[axis];
            }
            unit
        },
    )
}

/// Loads that leave the thinnest of those units open: all axes within 12 mN.
fn any_load() -> impl Strategy<Value = [f64; 3]> {
    (-12e-3..12e-3_f64, -12e-3..12e-3_f64, -5e-3..12e-3_f64).prop_map(|(x, y, z)| [x, y, z])
}

fn capacitance(unit: &ThreeAxisModel, force: [f64; 3]) -> [f64; 4] {
    unit.predict(force).1.capacitance()
}

fn close(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn exchanging_x_and_y_permutes_the_capacitors(force in any_load(), tilt in 0.0..=1.0_f64) {
        let mut unit = nominal();
        unit.suspension.compliance[0][0] = unit.suspension.compliance[1][1];
        unit.suspension.tile_tilt = tilt;
        let [x, y, z] = force;
        let c = capacitance(&unit, [x, y, z]);
        // +x closes 12, 22 and +y closes 11, 12: mirrored at x = y, 11 and 22
        // change places with each other.
        let swapped = capacitance(&unit, [y, x, z]);
        for (i, j) in [(0, 3), (1, 1), (2, 2), (3, 0)] {
            prop_assert!(close(c[i], swapped[j], 1e-14));
        }
        // Mirrored at x = -y, 12 and 21 change places.
        let mirrored = capacitance(&unit, [-y, -x, z]);
        for (i, j) in [(0, 0), (1, 2), (2, 1), (3, 3)] {
            prop_assert!(close(c[i], mirrored[j], 1e-14));
        }
    }

    #[test]
    fn reversing_x_swaps_the_columns_and_y_the_rows(force in any_load()) {
        let unit = nominal();
        let [x, y, z] = force;
        let c = capacitance(&unit, force);
        let (by_x, by_y) = (capacitance(&unit, [-x, y, z]), capacitance(&unit, [x, -y, z]));
        for i in 0..4 {
            prop_assert!(close(c[i], by_x[i ^ 1], 1e-14));
            prop_assert!(close(c[i], by_y[i ^ 2], 1e-14));
        }
    }

    #[test]
    fn tilt_only_raises_the_mean_and_closing_too(
        g in 1e-6..1e-5_f64, rise in 0.0..0.999_f64, share in 0.0..=1.0_f64
    ) {
        let (p, q) = (rise * share * g, rise * (1.0 - share) * g);
        let m = mean_inverse_gap(g, p, q).unwrap();
        // Equality only at zero tilt; below 1e-7 it is lost in rounding.
        prop_assert!(m.value * g >= 1.0 - 1e-15);
        if p.max(q) > 1e-7 * g {
            prop_assert!(m.value > 1.0 / g);
        }
        prop_assert!(m.by_gap < 0.0 && m.by_p >= 0.0 && m.by_q >= 0.0);
        let closer = mean_inverse_gap(0.9999 * g, p * 0.9999, q * 0.9999).unwrap();
        prop_assert!(closer.value > m.value);
        // Order and sign of the slopes do not matter.
        let turned = mean_inverse_gap(g, q, p).unwrap();
        prop_assert!(close(m.value, turned.value, 2e-15) && close(m.by_p, turned.by_q, 1e-12));
    }

    #[test]
    fn mean_inverse_gap_agrees_with_quadrature(rise in 0.0..0.95_f64, share in 0.0..=1.0_f64) {
        let (p, q) = (rise * share, rise * (1.0 - share));
        // Second method: midpoints in s, exact in t by a logarithm; Richardson
        // once. Good to 1e-9 where the corner stays 5 % open.
        let strips = |n: u32| {
            let sum: f64 = (0..n).map(|i| {
                let s = (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
                let gap = 1.0 + p * s;
                if q > 1e-6 { (q / gap).atanh() / q } else { 1.0 / gap + q * q / (3.0 * gap.powi(3)) }
            }).sum();
            sum / f64::from(n)
        };
        let quadrature = (4.0 * strips(8000) - strips(4000)) / 3.0;
        prop_assert!(close(mean_inverse_gap(1.0, p, q).unwrap().value, quadrature, 1e-9));
    }

    #[test]
    fn jacobian_is_the_derivative(unit in any_unit(), force in any_load()) {
        let Some(at) = unit.linearise(force) else { return Ok(()) };
        // Central differences of 1 uN: curvature 1e-8, rounding 1e-9 of the slope.
        let step = 1e-6;
        for axis in 0..3 {
            let (mut up, mut down) = (force, force);
            up[axis] += step;
            down[axis] -= step;
            prop_assume!(force[axis].abs() > 2.0 * step);
            let (up, down) = (capacitance(&unit, up), capacitance(&unit, down));
            for i in 0..4 {
                let difference = (up[i] - down[i]) / (2.0 * step);
                let off = (difference - at.jacobian[i][axis]).abs();
                prop_assert!(off < 1e-6 * 2e-12, "{i} {axis}: {difference:e} {:e}", at.jacobian[i][axis]);
            }
        }
        let direct = capacitance(&unit, force);
        for (linearised, direct) in at.capacitance.iter().zip(direct) {
            prop_assert!(close(*linearised, direct, 1e-14));
        }
    }

    #[test]
    fn parallel_tiles_make_the_published_inverse_exact(unit in any_unit(), force in any_load()) {
        let mut unit = unit;
        unit.suspension.tile_tilt = 0.0;
        prop_assume!(unit.predict(force).1.least_air_gap() > 0.0);
        let back = unit.effective_force(unit.rest(), capacitance(&unit, force)).unwrap();
        for axis in 0..3 {
            prop_assert!((back[axis] - force[axis]).abs() < 1e-14);
        }
        prop_assert!(unit.effective_motion(unit.rest(), capacitance(&unit, force)).twist.abs() < 1e-19);
    }

    #[test]
    fn scaling_the_noise_scales_deviation_and_misfit(
        unit in any_unit(), force in any_load(), scale in 0.2..5.0_f64, off in prop::array::uniform4(-1.0..1.0_f64)
    ) {
        prop_assume!(unit.predict(force).1.least_air_gap() > 0.2e-6);
        let mut readings = capacitance(&unit, force);
        readings.iter_mut().zip(off).for_each(|(reading, off)| *reading += off * 1e-16);
        let one = estimate_unit(&unit, readings, SIGMA, [true; 4], &SearchOptions::default());
        let other = estimate_unit(&unit, readings, SIGMA.map(|s| scale * s), [true; 4], &SearchOptions::default());
        for axis in 0..3 {
            // Both searches end 1e-7 of their own standard deviations short, of
            // up to 0.25 mN here.
            prop_assert!((one.force[axis] - other.force[axis]).abs() < 5e-11);
            prop_assert!(close(scale * one.deviation()[axis], other.deviation()[axis], 1e-6));
        }
        prop_assert!((one.chi2 / (scale * scale) - other.chi2).abs() < 1e-6 * (1.0 + other.chi2));
    }

    #[test]
    fn any_masked_capacitor_leaves_the_force(unit in any_unit(), force in any_load(), masked in 0..4_usize) {
        prop_assume!(unit.predict(force).1.least_air_gap() > 0.1e-6);
        let mut readings = capacitance(&unit, force);
        readings[masked] = f64::NAN;
        let usable = std::array::from_fn(|i| i != masked);
        let found = estimate_unit(&unit, readings, SIGMA, usable, &SearchOptions::default());
        prop_assert_eq!(found.outcome, Outcome::Converged);
        for axis in 0..3 {
            prop_assert!((found.force[axis] - force[axis]).abs() < 1e-10, "{:?}", found);
        }
        prop_assert!(found.chi2.is_nan() && found.signed_residual.is_nan());
    }

    #[test]
    fn rest_capture_recovers_the_gaps(unit in any_unit()) {
        let mut drawn = unit;
        drawn.plates.air_gap = [6e-6; 4];
        let found = drawn.at_rest(unit.rest()).unwrap();
        for i in 0..4 {
            prop_assert!(close(found.plates.air_gap[i], unit.plates.air_gap[i], 1e-12));
        }
    }

    #[test]
    fn relaxation_is_linear_and_causal(
        steps in prop::collection::vec((0.0..2.0_f64, -1.0..1.0_f64), 1..30), factor in -3.0..3.0_f64
    ) {
        let terms = [RelaxationTerm { ratio: 0.2, time: 0.1 }, RelaxationTerm { ratio: 0.5, time: 3.0 }];
        let (mut one, mut scaled) = (Relaxation::<1>::new(&terms), Relaxation::<1>::new(&terms));
        for (dt, value) in steps {
            let (a, b) = (one.push([value], dt)[0], scaled.push([factor * value], dt)[0]);
            prop_assert!((factor * a - b).abs() < 1e-12);
            // Never more than the sum of all springs at once.
            prop_assert!(a.abs() <= 1.0 + 2.0 * 0.7 * 2.0);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn inverse_returns_the_force_of_any_open_unit(unit in any_unit(), force in any_load()) {
        prop_assume!(unit.predict(force).1.least_air_gap() > 0.05e-6);
        let readings = capacitance(&unit, force);
        let found = estimate_unit(&unit, readings, SIGMA, [true; 4], &SearchOptions::default());
        prop_assert_eq!(found.outcome, Outcome::Converged);
        for axis in 0..3 {
            // 1e-10 N is 0.4 % of one standard deviation at 0.1 fF.
            prop_assert!((found.force[axis] - force[axis]).abs() < 1e-10, "{:?}", found);
        }
        prop_assert!(found.chi2 < 1e-6);
    }
}

/// Side forces and pressing or pulling forces up to 2 N in any direction.
fn any_overload() -> impl Strategy<Value = [f64; 3]> {
    let direction = (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64);
    (direction, 0.02..2.0_f64).prop_filter_map("no direction", |((x, y, z), size)| {
        let length = (x * x + y * y + z * z).sqrt();
        (length > 1e-3).then(|| [x, y, z].map(|part| size * part / length))
    })
}

/// An estimator of the shipped array that reads capacitances, and its first unit.
fn reading_capacitances() -> (ArrayEstimator, ThreeAxisModel) {
    let sensor = Sensor::shipped("three-axis-8x8").unwrap();
    let calibration = sensor.three_axis().unwrap().calibration();
    let unit = calibration.units[0];
    let options = ThreeAxisOptions::default();
    let reader = ThreeAxisReader::new(calibration, Quantity::Capacitance, options).unwrap();
    (ArrayEstimator::new(Box::new(reader)), unit)
}

/// A frame with `first` on the first taxel and rest on the others.
fn frame(first: [f64; 4], rest: [f64; 4]) -> Frame {
    let taxels = std::iter::once(first).chain(std::iter::repeat_n(rest, 63));
    Frame {
        sequence: 0,
        time_ns: 0,
        values: taxels.flatten().collect(),
        ..Frame::default()
    }
}

proptest! {
    // About every fourth load leaves the unit open.
    #![proptest_config(ProptestConfig {
        max_global_rejects: 30_000,
        ..ProptestConfig::with_cases(3_000)
    })]

    #[test]
    fn no_capacitance_falls_after_first_contact(
        unit in any_unit(), force in any_overload(), more in 1.0..20.0_f64
    ) {
        let (_, touching) = unit.predict(force);
        prop_assume!(touching.closed().contains(&true));
        let (_, pressed) = unit.predict(force.map(|part| more * part));
        for i in 0..4 {
            let (first, later) = (touching.plates[i], pressed.plates[i]);
            prop_assert!(later.capacitance >= first.capacitance * (1.0 - 1e-12));
            prop_assert!(later.least_air_gap >= 0.0);
            if touching.closed()[i] {
                prop_assert!(pressed.closed()[i]);
                // A plate that is pulled may touch with a corner and open at its centre.
                let pulled = force[2] < 0.0;
                prop_assert!(pulled || first.capacitance > unit.plates.rest_capacitance(i));
            }
        }
        // The way up to contact is continuous.
        let share = unit.open_share(force);
        let before = capacitance(&unit, force.map(|part| 0.999_999 * share * part));
        for i in 0..4 {
            prop_assert!(close(before[i], touching.plates[i].capacitance, 1e-4));
        }
    }

}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn no_touching_load_reads_ok(
        force in any_overload(), noise in prop::array::uniform4(-3e-16..3e-16_f64)
    ) {
        let (mut estimator, unit) = reading_capacitances();
        let share = unit.open_share(force);
        prop_assume!(share < 1.0);
        let exact = capacitance(&unit, force);
        let readings = std::array::from_fn(|i| exact[i] + noise[i]);
        let touch = estimator.push(&frame(readings, unit.rest())).unwrap().0;
        let taxel = touch.taxels[0];
        // Pulled far off on the other side, a plate reads nothing.
        let lost = readings.iter().any(|c| *c < 0.2 * unit.rest()[0]);
        let expected = if lost { State::Faulty } else { State::Closed };
        prop_assert_eq!(taxel.state, expected, "{:?} {:?}", taxel, readings);
        if !lost {
            for axis in 0..3 {
                let bound = share * force[axis];
                // Noise of at most 3 of its standard deviations on all four.
                let slack = 8.0 * taxel.deviation()[axis];
                prop_assert!(taxel.value[axis] * bound.signum() > bound.abs() - slack, "{:?}", taxel);
            }
            prop_assert!(taxel.counted);
        }
    }

    #[test]
    fn one_wrong_capacitor_at_rest_is_inconsistent(wrong in 0..4_usize, reading in 350e-15..660e-15_f64) {
        let (mut estimator, unit) = reading_capacitances();
        let mut readings = unit.rest();
        readings[wrong] = reading;
        let touch = estimator.push(&frame(readings, unit.rest())).unwrap().0;
        prop_assert_eq!(touch.taxels[0].state, State::Inconsistent, "{:?}", touch.taxels[0]);
        prop_assert!(!touch.channels.states.contains(&ChannelState::Closed));
        prop_assert_eq!(touch.left_out, 1);
        prop_assert_eq!(touch.total_certainty, Certainty::AtLeast);
        prop_assert!(touch.total.force[2].abs() < 1e-9);
        prop_assert!(touch.contacts.is_empty());
    }
}

/// Readings that no unit gives, beside good ones.
fn absurd() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(0.0),
        Just(-172e-15),
        Just(1e300),
        Just(f64::MIN_POSITIVE),
        -1e-12..1e-12_f64,
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3_000))]

    #[test]
    fn absurd_readings_never_give_a_force_without_a_flag(
        readings in prop::array::uniform4(prop_oneof![Just(172.3e-15), absurd()])
    ) {
        let text = Sensor::shipped_text("three-axis-unit").unwrap();
        let text = text.replace("[\"30.7023 fF\", \"31.7023 fF\", \"17.7023 fF\", \"32.7023 fF\"]", "\"0 fF\"");
        let sensor = Sensor::parse("unit", &text).unwrap();
        let options = ThreeAxisOptions { residual_persistence: 1, ..ThreeAxisOptions::default() };
        let calibration = sensor.three_axis().unwrap().calibration();
        let reader = ThreeAxisReader::new(calibration, Quantity::Capacitance, options).unwrap();
        let mut estimator = ArrayEstimator::new(Box::new(reader));
        let frame = Frame { sequence: 0, time_ns: 0, values: readings.to_vec(), ..Frame::default() };
        let taxel = estimator.push(&frame).unwrap().0.taxels[0];
        let possible = |c: f64| (0.2 * 172.2e-15..1.06 * 638e-15).contains(&c);
        if !readings.iter().all(|c| possible(*c)) {
            prop_assert_eq!(taxel.state, State::Faulty, "{:?}", readings);
        }
        if taxel.state == State::Ok {
            prop_assert!(taxel.value.iter().all(|f| f.is_finite() && f.abs() <= 20e-3));
            prop_assert!(taxel.residual.abs() <= 4.0);
        }
        prop_assert!(taxel.state == State::Faulty || taxel.value.iter().all(|f| f.is_finite()));
    }

    #[test]
    fn broken_descriptions_never_panic(cut in 0..4000_usize, put in "[a-z0-9\"\\[\\]{}=., \n-]{0,6}", skip in 0..12_usize) {
        for text in [Sensor::shipped_text("three-axis-8x8").unwrap(), Stimulus::shipped_text("finger").unwrap()] {
            let cut = cut % text.len();
            let end = (cut + skip).min(text.len());
            if text.is_char_boundary(cut) && text.is_char_boundary(end) {
                let broken = format!("{}{put}{}", &text[..cut], &text[end..]);
                if let Err(error) = Sensor::parse("broken", &broken) {
                    prop_assert!(!error.message.is_empty());
                    let _ = error.to_string();
                }
                let _ = Stimulus::parse("broken", &broken).map_err(|error| error.to_string());
            }
        }
    }
}

#[test]
fn the_states_of_an_answer_are_states() {
    for name in Sensor::shipped_names() {
        let sensor = Sensor::shipped(name).unwrap();
        let Some(predictor) = sensor.device().unwrap().predictor() else {
            continue;
        };
        let load = match sensor.element.key() {
            "microchannel" | "cells" => "p=5 kPa",
            "piezoelectric" => "profile=step, fz=0.1 N, ramp=10 ms",
            "in_plane_capacitor" => "fz=5 mN",
            _ => "fx=0 N, fy=0 N, fz=5 mN",
        };
        let loads = Loads::one(load, predictor.load_columns()).unwrap();
        let mut row = Vec::new();
        predictor.answer(&loads.load(0), &mut row).unwrap();
        for (column, cell) in predictor.columns().iter().zip(&row) {
            let named = column.name == "state" || column.name.ends_with("_state");
            let is_state = matches!(cell, Cell::State(_));
            assert_eq!(is_state, named, "{name}: {} {cell:?}", column.name);
        }
    }
}
