//! Properties of any compressed layer and any in-plane sensor.
#![allow(clippy::unwrap_used)]

use proptest::prelude::*;
use taxel::mechanics::{
    CompressedLayer, ElectrodeModulus, ElectrodeStiffness, Electrodes, EndCondition, EndShear,
    GivenFactor, LayerError, LayerKinematics, PublishedThinning, StressConstants, TopFace,
};
use taxel::transduction::{
    CapacitanceLaw, Dielectric, ForceCurve, InPlaneError, InPlaneModel, PublishedFit,
    PublishedFringe, StudyParameter, Surroundings, study,
};

fn layer(aspect: f64, end_condition: EndCondition) -> CompressedLayer {
    CompressedLayer {
        thickness: 950e-6,
        youngs_modulus: 1.2e6,
        contact_half_length: aspect * 950e-6,
        contact_depth: 3e-3,
        top: TopFace::Frictionless,
        end_condition,
        end_scale: 1.0,
    }
}

/// The published sensor of a gap, in um, with its constants n, q, γ.
fn device(gap: f64, [rate, scale, exponent]: [f64; 3], law: CapacitanceLaw) -> InPlaneModel {
    InPlaneModel {
        layer: layer(2.0, EndCondition::Free),
        electrodes: Electrodes {
            gap: gap * 1e-6,
            thickness: 100e-6,
            height: 550e-6,
            width: 1e-3,
            depth: 3e-3,
            stiffness: ElectrodeStiffness::Modulus(ElectrodeModulus {
                youngs_modulus: 2.1e6,
            }),
        },
        dielectric: Dielectric {
            permittivity: 2.4,
            surroundings: Surroundings::Uniform,
        },
        published_fit: Some(PublishedFit {
            thinning: PublishedThinning {
                least_thickness: 0.7,
                rate,
            },
            fringe: PublishedFringe { scale, exponent },
        }),
        law,
        stray_capacitance: 0.0,
        solved: None,
        table: None,
    }
}

const NARROW: (f64, [f64; 3]) = (20.0, [25.0, 1.85, -0.4]);
const MIDDLE: (f64, [f64; 3]) = (50.0, [10.0, 2.65, -0.3]);
const WIDE: (f64, [f64; 3]) = (100.0, [5.0, 0.65, -0.3]);

fn close(a: f64, b: f64, relative: f64) -> bool {
    (a - b).abs() <= relative * a.abs().max(b.abs())
}

/// First Piola-Kirchhoff stress P = σ F⁻ᵀ with F = [[f, x₁f′], [0, g′]].
fn nominal_stress(
    kinematics: &LayerKinematics,
    material: StressConstants,
    constant: f64,
    point: [f64; 2],
) -> [[f64; 2]; 2] {
    let stress = kinematics.stress(material, constant, point);
    let [x1, y] = point;
    let (f, squeeze) = (kinematics.stretch(y), kinematics.height_slope(y));
    let shear = x1 * kinematics.stretch_slope(y);
    [
        [
            stress.sigma11 * squeeze - stress.sigma12 * shear,
            stress.sigma12 * f,
        ],
        [
            stress.sigma12 * squeeze - stress.sigma22 * shear,
            stress.sigma22 * f,
        ],
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1_000))]

    #[test]
    fn volume_is_kept(e in 0.0..0.95_f64, y in 0.01..0.99_f64) {
        let kinematics = LayerKinematics::new(e).unwrap();
        // g′ by a central difference of 1e-5, without cancellation: its error
        // is g‴·1e-10/24, and g‴ < (a tan a)² g′ < 3000 g′ for e < 0.95.
        let by_difference = kinematics.slab(y - 5e-6, y + 5e-6) / 1e-5;
        prop_assert!((kinematics.stretch(y) * by_difference - 1.0).abs() < 2e-8);
        // Nothing is lost between two slabs, and the top sinks by e.
        let parts = kinematics.slab(0.0, y) + kinematics.slab(y, 1.0);
        prop_assert!(close(parts, 1.0 - e, 1e-12));
        prop_assert_eq!(kinematics.stretch_slope(1.0), 0.0);
    }

    #[test]
    fn printed_forms_of_f_and_g_are_the_same_functions(e in 0.001..0.9_f64, y in 0.0..=1.0_f64) {
        let kinematics = LayerKinematics::new(e).unwrap();
        let a = kinematics.unknown();
        // P1 Eq. 2.
        let f = (a * y).cos() + a.tan() * (a * y).sin();
        prop_assert!(close(f, kinematics.stretch(y), 1e-13));
        // P1 Eq. 3, the logarithms as printed; they cancel: 1e-15 of ln(…)/a.
        let s = a.sin();
        let q = (a.tan() - (a * y / 2.0).tan()) * a.cos();
        let g = a.cos() / a * (((1.0 + s) / (1.0 - s)).ln() - ((1.0 + q) / (1.0 - q)).ln());
        prop_assert!((g - kinematics.height(y)).abs() < 1e-13 / a);
    }

    #[test]
    fn stresses_are_in_equilibrium(
        e in 0.01..0.6_f64, x1 in -3.0..3.0_f64, y in 0.05..0.95_f64, c2 in -1.0..0.0_f64
    ) {
        let kinematics = LayerKinematics::new(e).unwrap();
        let material = StressConstants { c1: 1.0 + c2, c2 };
        let at = |x1: f64, y: f64| nominal_stress(&kinematics, material, 0.5, [x1, y]);
        let h = 1e-5;
        let (right, left) = (at(x1 + h, y), at(x1 - h, y));
        let (above, below) = (at(x1, y + h), at(x1, y - h));
        for i in 0..2 {
            let along = (right[i][0] - left[i][0]) / (2.0 * h);
            let upwards = (above[i][1] - below[i][1]) / (2.0 * h);
            // Central differences: third derivatives are below (a tan a)³ < 110
            // times the stress, so 2e-9 of it, plus rounding of 1e-15/h.
            let scale = 1.0 + along.abs() + above[i][1].abs();
            prop_assert!((along + upwards).abs() < 1e-8 * scale, "{i}: {along} {upwards}");
        }
    }

    #[test]
    fn force_is_the_integral_of_the_stress(
        e in 0.001..0.6_f64, aspect in 0.5..20.0_f64, chi in 0.5..3.0_f64, c2 in -2.0..0.0_f64
    ) {
        let kinematics = LayerKinematics::new(e).unwrap();
        let constant = kinematics.pressure_constant(aspect, chi);
        // Only C₁ − C₂ = μ may act.
        let material = StressConstants { c1: 1.0 + c2, c2 };
        let upwards = |x1: f64| nominal_stress(&kinematics, material, constant, [x1, 1.0])[1][1];
        // σ₂₂ is of second degree in x₁ on top: Simpson's rule is exact.
        let mean = (upwards(-aspect) + 4.0 * upwards(0.0) + upwards(aspect)) / 6.0;
        let stress = kinematics.mean_stress(aspect, chi);
        // The integral is a difference of terms of the size of Π.
        prop_assert!((mean + stress).abs() < 1e-13 * kinematics.top_stretch() * (constant.abs() + 4.0) * 10.0);
    }

    #[test]
    fn horizontal_forces_balance(
        e in 0.001..0.6_f64, aspect in 0.5..20.0_f64, chi in 0.5..3.0_f64
    ) {
        let kinematics = LayerKinematics::new(e).unwrap();
        let constant = kinematics.pressure_constant(aspect, chi);
        let material = StressConstants { c1: 1.0, c2: 0.0 };
        // Pull across the middle plane by Simpson's rule with 400 intervals:
        // an error of 1e-10 of the integrand.
        let pull = |y: f64| nominal_stress(&kinematics, material, constant, [0.0, y])[0][0];
        let n = 400;
        let sum: f64 = (0..=n).map(|i| {
            let weight = if i == 0 || i == n { 1.0 } else if i % 2 == 1 { 4.0 } else { 2.0 };
            weight * pull(f64::from(i) / f64::from(n))
        }).sum::<f64>() / (3.0 * f64::from(n));
        let a = kinematics.unknown();
        let shear = chi * a * a.tan() * aspect * aspect / 2.0;
        prop_assert!((sum + shear).abs() < 1e-8 * (1.0 + shear), "{sum} {shear}");
    }

    #[test]
    fn the_unknown_rises_with_compression(e in 0.0..0.98_f64, step in 1e-6..0.01_f64) {
        let [low, high] = [e, e + step].map(|e| LayerKinematics::new(e).unwrap());
        prop_assert!(low.unknown() < high.unknown() && high.unknown() < std::f64::consts::FRAC_PI_2);
    }

    #[test]
    fn the_force_rises_with_compression_inside_the_domain(
        e in 0.0..0.399_f64, step in 1e-6..1e-3_f64, aspect in 1.0..50.0_f64, chi in 0.65..10.0_f64
    ) {
        for end in [
            EndCondition::Given(GivenFactor { chi }), EndCondition::ShortLayer,
            EndCondition::WideLayer,
        ] {
            let [low, high] = [e, e + step].map(|e| layer(aspect, end).compress(e).unwrap().force);
            prop_assert!(low < high, "{end:?}: {low} {high}");
        }
    }

    #[test]
    fn the_force_never_falls_where_it_is_a_number(
        e in 0.3..0.999_f64, step in 1e-4..0.1_f64, aspect in 1.0..50.0_f64, chi in 0.65..10.0_f64
    ) {
        for end in [
            EndCondition::Given(GivenFactor { chi }), EndCondition::Free, EndCondition::ShortLayer,
            EndCondition::WideLayer,
        ] {
            let layer = layer(aspect, end);
            let Ok(high) = layer.compress((e + step).min(0.9999)) else { continue };
            let low = layer.compress(e).map(|state| state.force);
            // Within 1e-5 of the summit the force is level.
            prop_assert!(low.is_ok_and(|low| low <= high.force * (1.0 + 1e-9)), "{end:?}");
        }
    }

    #[test]
    fn the_short_layer_is_one_smooth_law(e in 0.0..0.4_f64, aspect in 1.1..8.0_f64) {
        let chi = |aspect: f64| EndCondition::ShortLayer.factor(aspect, e).unwrap();
        for at in [aspect, 2.0, 5.0] {
            let step = 1e-6 * at;
            let [left, middle, right] = [at - step, at, at + step].map(chi);
            prop_assert!((right - left).abs() < 2e-6, "{at}: {left} {right}");
            let bend = ((right - middle) - (middle - left)) / step;
            // A kink would be a change of slope of 0.1 and more.
            prop_assert!(bend.abs() < 1e-3, "{at}: {bend}");
        }
    }

    #[test]
    fn small_compressions_follow_the_series(exponent in -9.0..-3.0_f64, aspect in 0.5..20.0_f64) {
        let e = 10_f64.powf(exponent);
        let kinematics = LayerKinematics::new(e).unwrap();
        let square = 3.0 * e - 9.0 / 35.0 * e.powi(3) - 6.0 / 35.0 * e.powi(4)
            - 999.0 / 13475.0 * e.powi(5);
        // Up to e = 1e-3 the next terms are below 1e-17 of the first.
        prop_assert!(close(kinematics.unknown().powi(2), square, 1e-14));
        let stretch = 1.0 + 1.5 * e + 15.0 / 8.0 * e * e + 1209.0 / 560.0 * e.powi(3);
        // Next term of the order e⁴ < 3e-12.
        prop_assert!(close(kinematics.top_stretch(), stretch, 4.0 * e.powi(4) + 1e-15));
        // Third term: about 10 e³ (ℓ² + 1).
        let l2 = aspect * aspect;
        let stress = e * (l2 + 4.5) + e * e * (3.0 * l2 + 7.65);
        prop_assert!(close(kinematics.mean_stress(aspect, 1.0), stress, 10.0 * e * e + 1e-14));
    }

    #[test]
    fn near_total_compression_the_stretch_is_the_published_limit(exponent in -12.0..-6.0_f64) {
        let left = 10_f64.powf(exponent);
        let kinematics = LayerKinematics::new(1.0 - left).unwrap();
        let k = 1.0 / kinematics.top_stretch();
        // 1 − e → (2k/π) ln(2/k); next factor 1 + 2k/π, and 1 − e is itself
        // known to 1e-16.
        let limit = 2.0 * k / std::f64::consts::PI * (2.0 / k).ln();
        prop_assert!(close(limit, left, 2.0 * k + 2e-16 / left));
    }

    #[test]
    fn a_gripped_layer_is_two_of_half_the_thickness(e in 0.0..0.4_f64, x2 in 0.0..950e-6_f64) {
        let mut gripped = layer(2.0, EndCondition::Free);
        gripped.top = TopFace::Gripped;
        let mut half = layer(2.0, EndCondition::Free);
        half.thickness /= 2.0;
        let (state, one) = (gripped.compress(e).unwrap(), half.compress(e).unwrap());
        prop_assert_eq!(state.force, one.force);
        let mirrored = 950e-6 - x2;
        let stretch = gripped.stretch_excess(&state.kinematics, x2);
        let other = gripped.stretch_excess(&state.kinematics, mirrored);
        prop_assert!((stretch - other).abs() < 1e-14 * (1.0 + stretch));
        let low = x2.min(mirrored);
        let in_half = half.stretch_excess(&one.kinematics, low);
        prop_assert!((stretch - in_half).abs() < 1e-14 * (1.0 + stretch));
        let thickness = gripped.slab(&state.kinematics, 0.0, x2)
            + gripped.slab(&state.kinematics, x2, 950e-6);
        prop_assert!(close(thickness, 950e-6 * (1.0 - e), 1e-13));
    }

    #[test]
    fn compression_from_force_inverts_compress(
        e in 0.0..=0.4_f64, aspect in 1.0..20.0_f64, chi in 0.9..3.0_f64
    ) {
        let layer = layer(aspect, EndCondition::Given(GivenFactor { chi }));
        let force = layer.compress(e).unwrap().force;
        // Where the closed form begins, 1 − … is rounded to 1e-16, and a passes
        // on a few of them.
        let back = layer.compression_from_force(force).unwrap();
        prop_assert!((back - e).abs() <= 1e-14 * e + 1e-15, "{back}");
    }

    #[test]
    fn force_from_capacitance_inverts_respond(share in 0.0..=1.0_f64, which in 0..6_usize) {
        let (gap, fit) = [NARROW, MIDDLE, WIDE][which % 3];
        let law = [CapacitanceLaw::Mechanics, CapacitanceLaw::Published][which / 3];
        let model = device(gap, fit, law);
        let inverse = model.inverse().unwrap();
        let last = inverse.last().layer.kinematics.compression();
        let state = model.respond(share * last).unwrap();
        let back = inverse.state_from_change(state.change).unwrap();
        // The change is a difference of capacitances known to 1e-16 of C₀; at
        // the end of a range that turns, its slope is still a third of the mean.
        let e = back.layer.kinematics.compression();
        let slack = 1e-14 * model.rest_capacitance() / inverse.last().change;
        prop_assert!((e - share * last).abs() < 1e-12 * share + 10.0 * slack, "{e}");
        let beyond = inverse.last().change * (1.0 + 1e-9);
        let refused = inverse.state_from_change(beyond);
        prop_assert!(matches!(refused, Err(InPlaneError::BeyondInvertible { .. })), "{refused:?}");
    }

    #[test]
    fn a_force_looked_up_is_that_of_the_model(
        gap in 19.0..109.0_f64, kind in 0..3_usize, which in 0..2_usize,
        shares in prop::collection::vec(0.0..=1.0_f64, 60)
    ) {
        let law = [CapacitanceLaw::Mechanics, CapacitanceLaw::Published][which];
        let model = device(gap, [NARROW, MIDDLE, WIDE][kind].1, law);
        let curve = ForceCurve::new(model.inverse().unwrap());
        let last = *curve.inverse().last();
        for share in shares.into_iter().flat_map(|share| [share, share * 1e-3, share.powi(8)]) {
            let change = share * last.change;
            let exact = curve.inverse().force_from_change(change);
            prop_assert!(
                (curve.force(change) - exact).abs() <= 1e-7 * last.layer.force,
                "{share}: {} beside {exact}", curve.force(change)
            );
            prop_assert_eq!(curve.force(-change), -curve.force(change));
        }
        prop_assert_eq!(curve.force(2.0 * last.change), last.layer.force);
    }

    #[test]
    fn pressing_opens_the_gap_and_thins_the_electrodes(
        e in 0.0..0.29_f64, gap in 20.0..100.0_f64, ratio in 1.0..1.75_f64
    ) {
        let mut model = device(gap, NARROW.1, CapacitanceLaw::Mechanics);
        let youngs_modulus = ratio * 1.2e6;
        model.electrodes.stiffness = ElectrodeStiffness::Modulus(ElectrodeModulus { youngs_modulus });
        let [now, later] = [e, e + 0.01].map(|e| model.respond(e).unwrap());
        prop_assert!(now.electrodes.gap < later.electrodes.gap);
        prop_assert!(now.electrodes.thickness > later.electrodes.thickness);
        prop_assert!(now.change < later.change && now.capacitance > later.capacitance);
        // Stiffer electrodes open the gap more than soft ones.
        let stretch = 1.0 + model.layer.stretch_excess(&now.layer.kinematics, 600e-6);
        prop_assert!(now.electrodes.gap / model.electrodes.gap >= stretch * (1.0 - 1e-15));
    }

    #[test]
    fn nothing_is_ever_not_a_number(
        e in -1.0..2.0_f64, aspect in 0.1..100.0_f64, zeta in 0.01..1e6_f64, m in 0.01..100.0_f64
    ) {
        let shear = EndShear { zeta, m };
        for end in [
            EndCondition::Free, EndCondition::ShortLayer, EndCondition::WideLayer,
            EndCondition::Tapered(shear), EndCondition::Tail(shear),
        ] {
            match layer(aspect, end).compress(e) {
                Ok(state) => prop_assert!(state.force >= 0.0 && !state.end_factor.is_nan()),
                Err(LayerError::Compression { .. }) => prop_assert!(!(0.0..1.0).contains(&e)),
                Err(LayerError::AspectOutsideTable { .. }) => prop_assert!(aspect < 1.0),
                Err(LayerError::Falling { limit, .. }) => prop_assert!(e > limit && limit > 0.4),
                Err(error) => prop_assert!(matches!(end, EndCondition::Tapered(_)), "{error}"),
            }
        }
    }
}

#[test]
fn end_factor_tends_to_one_as_zeta_grows() {
    let chi = |zeta: f64, end: fn(EndShear) -> EndCondition| {
        end(EndShear { zeta, m: 1.0 }).factor(5.0, 0.1).unwrap()
    };
    // The published ζ = 20, m = 1: 20/22 and 1.1, exact for m = 1.
    assert!((chi(20.0, EndCondition::Tapered) - 20.0 / 22.0).abs() < 1e-14);
    assert!((chi(20.0, EndCondition::Tail) - 1.1).abs() < 1e-15);
    let mut before = [0.0, f64::INFINITY];
    for zeta in [4.0, 10.0, 100.0, 1e4, 1e6] {
        let now = [
            chi(zeta, EndCondition::Tapered),
            chi(zeta, EndCondition::Tail),
        ];
        assert!(before[0] < now[0] && now[0] < 1.0 && 1.0 < now[1] && now[1] < before[1]);
        before = now;
    }
    // ζ/(ζ+2) and 1 + 2/ζ at 1e6.
    assert!(before.iter().all(|chi| (chi - 1.0).abs() < 2.1e-6));
}

#[test]
fn too_little_shear_is_refused() {
    // Beyond χ = 0.65, ζ/(ζ+2) < 0.65 for ζ < 3.71.
    let chi = |zeta: f64| EndCondition::Tapered(EndShear { zeta, m: 1.0 }).factor(5.0, 0.1);
    assert!(matches!(
        chi(3.7),
        Err(LayerError::EndFactor { least: 0.65, .. })
    ));
    assert!(chi(3.72).is_ok());
    // Why: with the paper's own χ = 1 the force of a long layer falls again
    // beyond a compression of 0.74, far outside the domain.
    let stress = |e: f64| LayerKinematics::new(e).unwrap().mean_stress(1e3, 1.0);
    assert!(stress(0.70) < stress(0.74) && stress(0.74) > stress(0.78));
}

#[test]
fn tapered_factor_is_the_integral_of_its_shear() {
    // Second method: midpoints of 2s(1 − s^ζ)^m; 1e-6 with 20 000 of them.
    for (zeta, m) in [(20.0, 1.0), (12.0, 2.0), (30.0, 0.5)] {
        let integral: f64 = (0..20_000)
            .map(|i| (f64::from(i) + 0.5) / 20_000.0)
            .map(|s: f64| 2.0 * s * (1.0 - s.powf(zeta)).powf(m) / 20_000.0)
            .sum();
        let chi = EndCondition::Tapered(EndShear { zeta, m })
            .factor(2.0, 0.1)
            .unwrap();
        assert!(
            (chi - integral).abs() < 1e-6,
            "{zeta} {m}: {chi} {integral}"
        );
    }
}

#[test]
fn compressions_outside_zero_to_one_are_refused() {
    for e in [-1e-12, 1.0, 1.5, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            LayerKinematics::new(e),
            Err(LayerError::Compression { .. })
        ));
    }
    // Where an unguarded search falls into a root above π/2.
    for e in [0.75, 0.9, 0.999] {
        let unknown = LayerKinematics::new(e).unwrap().unknown();
        assert!(unknown < std::f64::consts::FRAC_PI_2);
    }
    assert_eq!(LayerKinematics::new(0.0).unwrap().top_stretch(), 1.0);
}

#[test]
fn forces_outside_the_range_are_refused_with_the_limit() {
    let layer = layer(2.0, EndCondition::Free);
    let limit = layer.compress(0.4).unwrap().force;
    for force in [-1e-9, limit * 1.000_001, f64::NAN] {
        let error = layer.compression_from_force(force).unwrap_err();
        assert!(matches!(error, LayerError::Force { limit: named, .. } if named == limit));
    }
}

#[test]
fn the_narrow_published_curve_is_inverted_up_to_its_later_minimum() {
    let model = device(NARROW.0, NARROW.1, CapacitanceLaw::Published);
    let per_depth = model.dielectric.scale(model.electrodes.depth);
    let inverse = model.inverse().unwrap();
    let turning = inverse.turning().unwrap();
    let change = |e: f64| model.respond(e).unwrap().change / per_depth;
    // Known to three and four digits: half of the last.
    assert!((turning.maximum - 0.098).abs() < 5e-4, "{turning:?}");
    assert!((change(turning.maximum) - 1.8277).abs() < 5e-5);
    assert!((turning.minimum - 0.228).abs() < 5e-4, "{turning:?}");
    assert!((change(turning.minimum) - 1.7885).abs() < 5e-5);
    let last = inverse.last();
    assert!((last.layer.kinematics.compression() - 0.063).abs() < 5e-4);
    assert!((last.change / per_depth - 1.7885).abs() < 5e-5);
    // The two wider sensors rise all the way.
    for (gap, fit) in [MIDDLE, WIDE] {
        let inverse = device(gap, fit, CapacitanceLaw::Published)
            .inverse()
            .unwrap();
        assert_eq!(inverse.turning(), None);
        assert_eq!(inverse.last().layer.kinematics.compression(), 0.4);
    }
}

#[test]
fn the_published_law_starts_at_zero_and_has_no_sensitivity_there() {
    let mut model = device(MIDDLE.0, MIDDLE.1, CapacitanceLaw::Published);
    let rest = model.respond(0.0).unwrap();
    assert_eq!(rest.change, 0.0);
    assert_eq!(rest.capacitance, model.rest_capacitance());
    assert_eq!(
        model.sensitivity(0.0),
        Err(InPlaneError::NoSensitivityAtRest { exponent: -0.3 })
    );
    assert!(model.sensitivity(0.01).unwrap() > 0.0);
    // Its slope grows without bound: U^γ, a factor of 10^0.3 for each decade.
    let slope = |e: f64| model.respond(e).unwrap().change / e;
    let growth = slope(1e-9) / slope(1e-8);
    assert!((growth / 10_f64.powf(0.3) - 1.0).abs() < 1e-5, "{growth}");
    model.law = CapacitanceLaw::Mechanics;
    assert!(model.sensitivity(0.0).unwrap() > 0.0);
}

#[test]
fn sensitivity_is_the_slope_of_change_against_force() {
    for law in [CapacitanceLaw::Mechanics, CapacitanceLaw::Published] {
        let model = device(MIDDLE.0, MIDDLE.1, law);
        let force = model.respond(0.123).unwrap().layer.force;
        let change = |force: f64| {
            let e = model.layer.compression_from_force(force).unwrap();
            model.respond(e).unwrap().change
        };
        let step = 1e-3 * force;
        let slope = (change(force + step) - change(force - step)) / (2.0 * step);
        // A difference over 2e-3 of the force: 1e-6 by curvature.
        assert!(close(model.sensitivity(0.123).unwrap(), slope, 3e-6));
    }
}

#[test]
fn studies_show_what_the_paper_concludes() {
    let base = device(MIDDLE.0, MIDDLE.1, CapacitanceLaw::Mechanics);
    let compressions = [0.0, 0.05, 0.1];
    let curve = |parameter, values: &[f64]| study(&base, parameter, values, &compressions);
    // "Higher sensing capabilities … softer materials and smaller electrode
    // gaps": the change at a force, and the change at a compression.
    let soft = curve(StudyParameter::Gap, &[20e-6, 50e-6, 100e-6]);
    let changes: Vec<f64> = soft
        .iter()
        .map(|curve| curve.points.as_ref().unwrap()[2].change)
        .collect();
    assert!(changes[0] > changes[1] && changes[1] > changes[2]);
    let mut as_layer = base.clone();
    as_layer.electrodes.stiffness = ElectrodeStiffness::AsLayer;
    let moduli = study(
        &as_layer,
        StudyParameter::LayerModulus,
        &[0.6e6, 1.2e6],
        &compressions,
    );
    let [soft, stiff] = [0, 1].map(|i: usize| moduli[i].points.as_ref().unwrap()[2]);
    assert_eq!(soft.change, stiff.change);
    assert!(close(2.0 * soft.force, stiff.force, 1e-15));
    // Nearer to the pressed face the layer spreads more.
    let heights = study(
        &as_layer,
        StudyParameter::ElectrodeHeight,
        &[200e-6, 550e-6],
        &compressions,
    );
    let [low, high] = [0, 1].map(|i: usize| heights[i].points.as_ref().unwrap()[2]);
    assert!(low.change < high.change);
    // Thicker electrodes face each other with more area.
    let thick = study(
        &as_layer,
        StudyParameter::ElectrodeThickness,
        &[50e-6, 100e-6],
        &compressions,
    );
    let [thin, thick] = [0, 1].map(|i: usize| thick[i].points.as_ref().unwrap()[2]);
    assert!(thin.change < thick.change);
    // Outside the table a curve is an error that names the limit.
    let far = curve(StudyParameter::ElectrodeModulus, &[2.1e6, 4.2e6, 5e6]);
    assert!(far[0].points.is_ok() && far[1].points.is_ok());
    assert!(matches!(&far[2].points, Err(InPlaneError::Table(error)) if error.most == 3.5));
}
