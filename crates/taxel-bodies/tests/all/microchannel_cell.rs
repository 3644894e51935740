//! The closing void against independent, mesh-converged tables (lengths um, kPa).
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use taxel_bodies::mechanics::crossing_microchannels::CrossingStudy;
use taxel_bodies::mechanics::microchannel_cell::{Filling, VoidStudy, WallContact};
use taxel_fem::mesh::{CornerDivision, CrossingVoids, VoidCell};

use crate::microchannel_block::{RUBBER, p4_voids};

/// Rows of a reference table whose first columns are height, cover and total thickness.
fn rows(table: &str, height: f64, cover: f64) -> Vec<Vec<f64>> {
    table
        .lines()
        .filter(|line| !line.starts_with('#'))
        .skip(1)
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().unwrap_or(f64::NAN))
                .collect::<Vec<f64>>()
        })
        .filter(|row| row[0] == height && row[1] == cover)
        .collect()
}

fn cell(height: f64, cover: f64, smallest: f64) -> VoidCell {
    VoidCell {
        width: 400.0,
        height,
        cover,
        base: 500.0 - height - cover,
        pitch: 600.0,
        fillet: 0.0,
        division: CornerDivision {
            smallest,
            ..CornerDivision::default()
        },
    }
}

/// Greatest relative error of the net pressure over the rows of a design.
fn net_pressure_error(height: f64, cover: f64, smallest: f64, least: f64) -> f64 {
    let table = include_str!("../../../taxel/tests/reference/p4_net_pressure.csv");
    let cell = cell(height, cover, smallest);
    let mut study =
        VoidStudy::new(&cell, RUBBER, &Filling::Vented, WallContact::default()).unwrap();
    println!("{} cells", study.solver.problem().mesh.cell_count());
    let (mut worst, mut widest) = (0.0_f64, [0.0_f64; 2]);
    for row in rows(table, height, cover) {
        if row[5] < least {
            break;
        }
        let before = study.solver.iterations;
        let found = study.close(row[5]).unwrap();
        let error = found.pressure / row[6] - 1.0;
        println!(
            "{height}/{cover} a {:.3} q {:.5} ref {:.5} error {error:.1e} gap {:.3} ref {:.3} fold {:.3} its {}",
            row[5],
            found.pressure,
            row[6],
            found.gap,
            row[8],
            found.fold,
            study.solver.iterations - before
        );
        worst = worst.max(error.abs());
        // 0.5 %; of a gap that is nearly closed 5e-4 of the height. The table has three digits.
        let off = (found.gap - row[8]).abs() - 5e-4;
        let allowed = f64::max(5e-3 * row[8], 5e-4 * height);
        let near = usize::from(5e-3 * row[8] < 5e-4 * height);
        widest[near] = widest[near].max(off / [row[8], height][near]);
        assert!(off < allowed, "gap {} for {}", found.gap, row[8]);
    }
    println!(
        "{height}/{cover}: gap within {:.2} % of itself, below a tenth of the height within {:.2} % of the height",
        100.0 * widest[0],
        100.0 * widest[1]
    );
    worst
}

#[test]
fn net_pressures_are_those_of_the_converged_cell() {
    for (height, cover, smallest) in [(20.0, 140.0, 1.0 / 30.0), (40.0, 140.0, 1.0 / 32.0)] {
        let error = net_pressure_error(height, cover, smallest, 0.3);
        assert!(error < 2e-3, "{height}/{cover}: {error}");
    }
}

/// `cargo test --locked -p taxel-bodies --test all close_by_a_ten_thousandth -- --nocapture`
#[test]
fn fifteen_cells_close_by_a_ten_thousandth() {
    let mut most = 0.0_f64;
    for height in [20.0, 40.0, 60.0, 100.0, 160.0] {
        for cover in [100.0, 140.0, 200.0] {
            let cell = cell(height, cover, 1.0 / 30.0);
            let mut study =
                VoidStudy::new(&cell, RUBBER, &Filling::Vented, WallContact::default()).unwrap();
            let light = study.close(0.9999).unwrap();
            let twice = study.close(0.9998).unwrap();
            assert!(
                (light.area_ratio - 0.9999).abs() < 1e-10,
                "{height}/{cover}"
            );
            // So little is linear.
            let off = twice.pressure / light.pressure / 2.0 - 1.0;
            most = most.max(off.abs());
            assert!(off.abs() < 1e-3, "{height}/{cover}: {off:.1e}");
        }
    }
    println!("pressure of twice the change over twice the pressure: off by up to {most:.1e}");
}

/// `cargo test --locked -p taxel-bodies --test all all_net_pressures -- --ignored --nocapture`
#[test]
#[ignore = "all designs of the table: minutes"]
fn all_net_pressures() {
    for (height, cover) in [
        (20.0, 100.0),
        (20.0, 140.0),
        (20.0, 200.0),
        (40.0, 100.0),
        (40.0, 140.0),
        (60.0, 60.0),
        (60.0, 120.0),
        (60.0, 160.0),
        (100.0, 100.0),
        (100.0, 140.0),
        (160.0, 120.0),
        (160.0, 200.0),
    ] {
        let smallest = if height <= 60.0 { 1.0 / 30.0 } else { 0.01 };
        let error = net_pressure_error(height, cover, smallest, 0.3);
        println!("{height}/{cover}: {error:.1e}");
        assert!(error < 2e-3, "{height}/{cover}: {error}");
    }
}

#[test]
fn crossing_voids_close_as_in_space() {
    let cell = CrossingVoids {
        largest: 150.0,
        ..p4_voids(20.0)
    };
    let mut study =
        CrossingStudy::new(&cell, RUBBER, &Filling::Gas(20.265), WallContact::default()).unwrap();
    println!(
        "{} cells {} unknowns",
        study.solver.problem().mesh.cell_count(),
        study.solver.unknowns()
    );
    for line in include_str!("../../../taxel/tests/reference/p4_two_layer_3d.csv")
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
    {
        let row: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let found = study.press(row[0]).unwrap();
        println!("{row:?}\n{found:.5?} {}", study.solver.iterations);
        for (number, column) in [(0, 1), (1, 2)] {
            let error = found.volume_ratio[number] / row[column] - 1.0;
            assert!(error.abs() < 5e-3, "volume {error}");
            assert!((found.thinnest[number] - row[column + 2]).abs() < 0.01);
            assert!((found.thickest[number] - row[column + 4]).abs() < 0.01);
            assert!((found.gap[number] - row[column + 8]).abs() < 0.05, "gap");
        }
    }
}

/// First response of rectangles in a body that is large beside them, times the shear modulus,
/// as `tables/p4_rectangle.csv` has it.
#[test]
fn rectangles_in_an_endless_body() {
    for (height, expected) in [(2.0, 8.30), (8.0, 2.465), (40.0, 1.207)] {
        let cell = VoidCell {
            width: 40.0,
            height,
            cover: 0.5 * (1600.0 - height),
            base: 0.5 * (1600.0 - height),
            pitch: 1600.0,
            fillet: 0.0,
            division: CornerDivision {
                smallest: 1.0 / 30.0,
                ..CornerDivision::default()
            },
        };
        let mut study =
            VoidStudy::new(&cell, RUBBER, &Filling::Vented, WallContact::default()).unwrap();
        // In kPa, a ten thousandth of the modulus and less.
        let pressure = 0.01 / expected;
        let lost = 1.0 - study.press(pressure).unwrap().area_ratio;
        let found = lost / pressure * 162.4;
        // Its own error of 3e-3, and as much for this mesh and the ends of the body.
        assert!(
            (found / expected - 1.0).abs() < 6e-3,
            "{height}: {found} for {expected}"
        );
    }
}
