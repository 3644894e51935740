//! Shear on the cover of P3: what the base carries in front of it and behind it.
#![allow(clippy::unwrap_used)]

use crate::common::{assert_near, table};
use taxel::mechanics::{Base, ContactPressure, SoftCover};

const MM: f64 = 1e-3;
/// Side of an element of P3, m.
const SIDE: f64 = 2e-3;

fn cover(thickness: f64, contact: ContactPressure) -> SoftCover {
    SoftCover {
        thickness,
        base: Base::Rigid,
        contact,
    }
}

/// The picture of a pushed contact: the cells together have its force, and the moment of its
/// shear about the base, N m, is the shear times the thickness. Pressed in front, pulled behind.
#[test]
fn cells_of_a_picture_have_the_force_and_its_moment() {
    let cover = SoftCover {
        thickness: 1.15e-3,
        base: Base::Rigid,
        contact: ContactPressure::Uniform(2e-3),
    };
    let (cell, count) = (0.25e-3, 96_usize);
    let half = 0.5 * cell * count as f64;
    let stress = cover.base_stress([0.5, 0.0, 1.0], [-half; 2], cell, [count; 2]);
    let x = |index: usize| ((index % count) as f64 + 0.5) * cell - half;
    let area = cell * cell;
    let force: f64 = stress.iter().map(|stress| stress * area).sum();
    let moment: f64 = stress
        .iter()
        .enumerate()
        .map(|(i, stress)| stress * area * x(i))
        .sum();
    assert!((force - 1.0).abs() < 1e-3, "{force}");
    assert!((moment / (0.5 * 1.15e-3) - 1.0).abs() < 1e-2, "{moment}");
    let middle = count / 2 * count;
    let [behind, front] = [-1.9e-3, 1.9e-3].map(|at| {
        let column = ((at + half) / cell) as usize;
        stress[middle + column]
    });
    assert!(front > 2.0 * behind, "{front} {behind}");
}

#[test]
fn solved_shares_of_a_shear_force() {
    let mut rows = 0;
    for row in table("solved_p3_shear.csv") {
        let [thickness, radius] = ["h_mm", "a_mm"].map(|column| row.si(column, MM));
        let cover = cover(thickness, ContactPressure::Uniform(radius));
        let fast = cover.shear_table();
        for distance in [1_u32, 2, 3, 4, 6, 8] {
            let offset = [f64::from(distance) * MM, 0.0];
            let expected = row.at(&format!("share_{distance}mm"));
            let [share, across] = cover.shear_shares(offset, SIDE);
            let what = format!("{cover:?} {distance} mm");
            // The table's own error is 1e-4.
            assert_near(share, expected, 0.0, 1e-4, &what);
            assert!(across.abs() < 1e-12, "{what}");
            let [found, _] = fast.shares(offset, SIDE);
            assert_near(found, share, 0.0, 1e-6, &what);
        }
        rows += 1;
    }
    assert_eq!(rows, 16);
}

/// The double integral over wave numbers from which the edges were derived.
#[test]
fn edges_of_the_element_agree_with_the_integral_over_wave_numbers() {
    let (h, a, x, y) = (1.15, 2.0, 2.0, 0.7);
    let transform = |k: f64| 2.0 * taxel_numerics::special::j1(k * a) / (k * a);
    let sinc = |z: f64| if z == 0.0 { 1.0 } else { z.sin() / z };
    // Midpoints of cells of 0.05 up to 24: S(24 h) is below 1e-10. The sum of midpoints of a
    // smooth, even and decaying function converges faster than any power.
    let (step, cells) = (0.05, 480_u32);
    let mut sum = 0.0;
    for i in 0..cells {
        for j in 0..cells {
            let [kx, ky] = [i, j].map(|cell| (f64::from(cell) + 0.5) * step);
            let k = f64::hypot(kx, ky);
            let kernel = taxel::mechanics::layer_shear_transmission(k * h) * transform(k);
            let element = 4.0 * sinc(kx) * sinc(ky) * (kx * x).sin() * (ky * y).cos();
            sum += kx / k * kernel * element;
        }
    }
    let expected = sum * step * step / std::f64::consts::PI.powi(2);
    let [share, _] =
        cover(h * MM, ContactPressure::Uniform(a * MM)).shear_shares([x * MM, y * MM], SIDE);
    assert_near(share, expected, 0.0, 1e-6, "share");
}

/// A square of elements that reaches so far that the base carries nothing beyond it.
fn tiling() -> impl Iterator<Item = [f64; 2]> {
    let along = || (-12..=12).map(|cell| f64::from(cell) * SIDE + 0.3 * MM);
    along().flat_map(move |x| along().map(move |y| [x, y]))
}

#[test]
fn a_shear_force_presses_as_much_as_it_pulls() {
    for contact in [
        ContactPressure::Point,
        ContactPressure::Uniform(2.0 * MM),
        ContactPressure::Hertz(3.0 * MM),
    ] {
        let table = cover(1.15 * MM, contact).shear_table();
        let sums = tiling()
            .map(|offset| table.shares(offset, SIDE))
            .fold([0.0; 2], |[x, y], [dx, dy]| [x + dx, y + dy]);
        // Facing edges cancel; exp(-0.739 21) is left at the far ones.
        assert!(
            sums.iter().all(|sum| sum.abs() < 1e-6),
            "{contact:?} {sums:?}"
        );
    }
}

#[test]
fn the_base_turns_the_moment_of_the_shear() {
    let thickness = 1.15 * MM;
    for contact in [
        ContactPressure::Uniform(2.0 * MM),
        ContactPressure::Hertz(3.0 * MM),
    ] {
        let table = cover(thickness, contact).shear_table();
        // Small elements: the pressure times the distance of their middle, over a quarter of
        // the base as far as exp(-0.739 24) of it is left.
        let side = 0.25 * MM;
        let along = || (0..120).map(|cell| (f64::from(cell) + 0.5) * side);
        let quarter: f64 = along()
            .flat_map(|x| along().map(move |y| [x, y]))
            .map(|offset| offset[0] * table.shares(offset, side)[0])
            .sum();
        // What a change of the pressure within an element adds sums to zero over the base.
        let what = format!("{contact:?}");
        assert_near(4.0 * quarter, thickness, 1e-4, 0.0, &what);
    }
}

#[test]
fn the_share_is_odd_along_the_shear_and_even_across_it() {
    let cover = cover(1.0 * MM, ContactPressure::Hertz(2.5 * MM));
    let [x, y] = [2.2 * MM, 1.3 * MM];
    let [share, other] = cover.shear_shares([x, y], SIDE);
    let [behind, _] = cover.shear_shares([-x, y], SIDE);
    let [mirrored, _] = cover.shear_shares([x, -y], SIDE);
    let [turned, _] = cover.shear_shares([y, x], SIDE);
    assert!(share > 0.0);
    // The same numbers in another order.
    assert_near(behind, -share, 0.0, 1e-14, "behind");
    assert_near(mirrored, share, 0.0, 1e-14, "mirrored");
    assert_near(turned, other, 0.0, 1e-14, "along y");
    // Without a lever there is no pressure.
    assert!(cover.shear_shares([0.0, y], SIDE)[0].abs() < 1e-14);
}
