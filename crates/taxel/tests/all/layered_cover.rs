//! Soft layers on a rigid base against tables that another program computed, and against
//! themselves.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use crate::common::{Row, table};
use taxel::mechanics::{CoverArea, CoverError, CoverLayer, LayeredCover};
use taxel_numerics::special::gauss_panel;

fn layer(thickness: f64, shear_modulus: f64, poisson: f64) -> CoverLayer {
    CoverLayer {
        thickness,
        shear_modulus,
        poisson,
    }
}

/// Rounding of an integral whose parts are of the order of one, some ten times 1e-16.
const ROUNDING: f64 = 2e-15;

/// The bodies of the table, thickness 1 in all.
fn body(row: &Row) -> LayeredCover {
    let layers = match row.text("body") {
        "single" => vec![layer(1.0, 1.0, row.at("nu [1]"))],
        "skin" => vec![layer(0.2, 10.0, 0.49), layer(0.8, 1.0, 0.49)],
        "soft_top" => vec![layer(0.5, 1.0, 0.49), layer(0.5, 5.0, 0.49)],
        other => panic!("{other}"),
    };
    LayeredCover::new(&layers).unwrap()
}

#[test]
fn rows_of_the_table_come_back() {
    let (mut values, mut worst) = (0, 0.0_f64);
    for row in table("own_layer_green.csv") {
        let (cover, radius) = (body(&row), row.at("r [h]"));
        let mut compare = |column: &str, found: f64| {
            let expected = row.at(column);
            // Half of the last of twelve digits as printed, the error of the row, and the rounding
            // of a sum whose terms are of the order of one.
            let printed = 0.5 * 10.0_f64.powf(expected.abs().log10().floor() - 11.0);
            let off = ((found - expected).abs() - printed).max(0.0);
            worst = worst.max(off);
            values += 1;
            let allowed = row.at("error") + ROUNDING;
            let what = [row.text("body"), row.text("kind"), column];
            assert!(
                off <= allowed,
                "{what:?} at {radius}: {found:e}, {expected:e}, off {off:e}"
            );
        };
        if row.text("kind") == "point" {
            compare("u_z", cover.sinking(0.0, radius));
            compare("u_r", cover.radial_displacement(radius));
            compare("s_base", cover.base_pressure(0.0, radius));
            let [along, across] = cover.tangential_displacement(radius);
            compare("ux_along", along);
            compare("ux_across", across);
        } else {
            let load = row.at("a [h]");
            let force = PI * load * load;
            compare("u_z", force * cover.sinking(load, radius));
            compare("s_base", force * cover.base_pressure(load, radius));
        }
    }
    println!("{values} values, beyond their last digit the worst by {worst:.1e}");
    // 5 bodies with 14 points of 5 values and 21 discs of 2.
    assert_eq!(values, 560);
}

fn cover(layers: &[CoverLayer]) -> LayeredCover {
    LayeredCover::new(layers).unwrap()
}

/// Rubber 2 mm thick, and the same under a stiff skin.
fn samples() -> [LayeredCover; 3] {
    let rubber = layer(2e-3, 0.2e6, 0.49);
    let skin = layer(0.2e-3, 2e6, 0.45);
    [
        cover(&[rubber]),
        cover(&[skin, rubber]),
        cover(&[layer(2e-3, 0.2e6, 0.5)]),
    ]
}

#[test]
fn transforms_of_one_layer_are_the_closed_ones() {
    for poisson in [0.0, 0.3, 0.45, 0.49, 0.5] {
        let cover = cover(&[layer(2.0, 3.0, poisson)]);
        for q in [0.3_f64, 1.0, 2.5, 5.0, 20.0, 300.0] {
            let k = q / 2.0;
            let e = (-2.0 * q).exp();
            let (sinh, cosh) = (0.5 * (1.0 - e * e), 0.5 * (1.0 + e * e));
            let (f, rest) = (
                3.0 - 4.0 * poisson,
                5.0 - 12.0 * poisson + 8.0 * poisson * poisson,
            );
            let closed = (1.0 - poisson) / (3.0 * k) * (f * sinh - 2.0 * q * e)
                / (f * cosh + (2.0 * q * q + rest) * e);
            // Where two growing solutions are separated, q² of the rounding is lost; at q = 0.3
            // the sinking is a thirtieth of what cancels in it.
            let error = 1e-15 * (30.0 + q * q);
            assert!(
                (cover.sinking_transform(k) / closed - 1.0).abs() < error,
                "{poisson} {q}"
            );
            let across = q.tanh() / (3.0 * k);
            assert!((cover.tangential_transforms(k)[1] / across - 1.0).abs() < 1e-14);
        }
        // Even pressure: the layer is squeezed by its modulus without sideways motion.
        let even = 2.0 * (1.0 - 2.0 * poisson) / (2.0 * 3.0 * (1.0 - poisson));
        // kh = 1e-9 stands for zero: rounding over it remains.
        assert!((cover.sinking_transform(0.0) - even).abs() < 1e-15);
        assert!((cover.base_transform(0.0) - 1.0).abs() < 1e-15);
    }
    // Printed with three digits in the specification of the kernel.
    let cover = cover(&[layer(1.0, 1.0, 0.49)]);
    assert!((cover.base_transform(1.0) - 0.807).abs() < 5e-4);
    assert!((cover.base_transform(5.0) - 0.079).abs() < 5e-4);
}

#[test]
fn a_layer_cut_in_two_is_the_same_layer() {
    let (half, whole) = (layer(1e-3, 0.2e6, 0.49), layer(2e-3, 0.2e6, 0.49));
    let (halves, whole) = (cover(&[half, half]), cover(&[whole]));
    for radius in [0.3e-3, 2e-3, 7e-3] {
        let pairs = [&halves, &whole].map(|cover| {
            let [along, across] = cover.tangential_displacement(radius);
            let scale = 0.2e6 * 2e-3;
            let displacements = [cover.sinking(1e-3, radius), along, across];
            let [a, b, c] = displacements.map(|displacement| displacement * scale);
            [a, b, c, cover.base_pressure(0.0, radius) * 4e-6]
        });
        for (a, b) in pairs[0].into_iter().zip(pairs[1]) {
            // Rounding of two integrals of the order of one, with twice the exponentials.
            assert!((a - b).abs() < 4.0 * ROUNDING, "{radius}: {a:e} {b:e}");
        }
    }
}

#[test]
fn means_are_those_of_the_pressure_of_discs_over_a_footprint() {
    for cover in samples() {
        let disc = CoverArea::Disc(1.5e-3);
        let halves = [1e-3, 0.6e-3];
        for offset in [[0.0, 0.0], [1.2e-3, -0.4e-3], [6e-3, 2e-3]] {
            let pressure = |x: f64, y: f64| {
                let area = PI * 1.5e-3 * 1.5e-3;
                area * cover.base_pressure(1.5e-3, f64::hypot(x - offset[0], y - offset[1]))
            };
            // A rectangle: the pressure on the base is smooth over half a thickness.
            let along_y = |x: f64| gauss_panel(-halves[1], halves[1], |y| pressure(x, y));
            let nested =
                gauss_panel(-halves[0], halves[0], along_y) / (4.0 * halves[0] * halves[1]);
            let found = cover.base_pressure_mean(CoverArea::Rectangle(halves), disc, offset);
            // What the mean states.
            assert!(
                (found - nested).abs() < 1e-9,
                "{offset:?}: {found} {nested}"
            );
            // Swapped, both carry the same force.
            let swapped = cover.base_pressure_mean(disc, CoverArea::Rectangle(halves), offset);
            let areas = PI * 1.5e-3 * 1.5e-3 / (4.0 * halves[0] * halves[1]);
            assert!((swapped * areas - found).abs() < 1e-12);
            // A port much smaller than the thickness reads the pressure at its middle: the next
            // term is (port/thickness)²/8 of it.
            let port = cover.base_pressure_mean(CoverArea::Disc(1e-6), disc, offset);
            assert!((port - pressure(0.0, 0.0)).abs() < 1e-6);
        }
    }
}

#[test]
fn a_grid_carries_the_whole_load_and_far_cells_are_cut() {
    for cover in samples() {
        let pitch = 4e-3;
        let square = CoverArea::Rectangle([0.5 * pitch; 2]);
        let offsets: Vec<f64> = (0..32).map(|i| f64::from(i) * pitch).collect();
        let begin = std::time::Instant::now();
        let means = cover.base_pressure_means(square, square, [&offsets, &offsets], 0.0);
        let all = begin.elapsed();
        // Mirrored: all but the first row and column stand for two.
        let times = |index: usize| if index == 0 { 1.0 } else { 2.0 };
        let parts = means.iter().enumerate();
        let total: f64 = parts
            .map(|(i, mean)| times(i % 32) * times(i / 32) * mean)
            .sum();
        // The means that are not of the tails, some hundred, are each off by 1e-9 at most; beyond
        // 57 thicknesses there is less.
        assert!((total - 1.0).abs() < 1e-8, "{total}");
        for (x, y) in [(0, 0), (3, 1), (12, 5)] {
            let one = cover.base_pressure_mean(square, square, [offsets[x], offsets[y]]);
            // Another period: the images of both.
            assert!((means[32 * y + x] - one).abs() < 1e-9);
            assert!((means[32 * x + y] - one).abs() < 1e-9);
        }
        let begin = std::time::Instant::now();
        let cut = cover.base_pressure_means(square, square, [&offsets, &offsets], 1e-6);
        println!(
            "1024 offsets: {all:?}, cut {:?}, reach {:.1} mm",
            begin.elapsed(),
            1e3 * cover.reach(1e-6)
        );
        // What the cut states: the patch is four of the least thickness squared.
        let worst = means.iter().zip(&cut).map(|(a, b)| (a - b).abs());
        assert!(worst.fold(0.0, f64::max) < 4e-6);
        assert_eq!(cut[31], 0.0);
    }
}

#[test]
fn finer_patterns_are_lost_below_the_resolution_length() {
    for cover in samples() {
        let mut before = f64::INFINITY;
        for share in [0.9, 0.5, 0.1, 1e-3] {
            let length = cover.resolution_length(share).unwrap();
            // The root is found to the last bits.
            assert!((cover.base_transform(2.0 * PI / length) / share - 1.0).abs() < 1e-10);
            assert!(length < before);
            before = length;
        }
        for share in [0.0, 1.0, -1.0, f64::NAN] {
            assert_eq!(cover.resolution_length(share), None);
        }
    }
}

#[test]
fn what_is_no_cover_is_refused_with_its_layer() {
    assert_eq!(LayeredCover::new(&[]).unwrap_err(), CoverError::NoLayer);
    let good = layer(1e-3, 0.2e6, 0.49);
    for bad in [
        layer(0.0, 0.2e6, 0.49),
        layer(1e-3, f64::NAN, 0.49),
        layer(1e-3, 0.2e6, 0.51),
        layer(f64::INFINITY, 0.2e6, 0.49),
    ] {
        let error = LayeredCover::new(&[good, bad]).unwrap_err();
        assert!(error.to_string().contains("layer 2"), "{error}");
    }
}
