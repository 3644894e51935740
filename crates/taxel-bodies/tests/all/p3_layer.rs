//! The table of a bonded layer under a rigid disc (P3) against the solver.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use taxel::mechanics::{BondedDisc, DiscGrip, LayerRim};
use taxel_fem::study::disc::{DiscAnswer, PressedDisc};

const MM: f64 = 1e-3;

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

/// A disc on a layer of unit thickness by the solver.
fn solved(aspect: f64, rim: LayerRim, grip: DiscGrip) -> DiscAnswer {
    let disc = PressedDisc {
        radius: aspect,
        beyond: if rim == LayerRim::Wide { 6.0 } else { 0.0 },
        gripped: grip == DiscGrip::Gripped,
        largest: 0.05 * aspect.max(1.0),
        smallest: 0.01,
    };
    disc.solve().unwrap()
}

/// Between the rows of the table, against the solver.
#[test]
fn discs_between_the_rows_agree_with_the_solver() {
    let mut wrong: Vec<String> = Vec::new();
    for words in ["gripped_flush", "slip_flush", "gripped_wide", "slip_wide"] {
        let (rim, grip) = contact(words);
        for aspect in [0.55, 0.66, 0.78, 0.92, 1.2, 2.2, 4.4, 6.2, 8.6] {
            let pressed = BondedDisc {
                radius: aspect * MM,
                thickness: MM,
                rim,
                grip,
            };
            let pressed = pressed.pressed().unwrap();
            let solved = solved(aspect, rim, grip);
            let area = std::f64::consts::PI * (aspect * MM).powi(2);
            let mut near = |what: String, found: f64, expected: f64| {
                // Of the interpolation, with what this mesh leaves.
                if (found / expected - 1.0).abs() > 5e-3 {
                    wrong.push(format!("{words} {aspect} {what}: {found} for {expected}"));
                }
            };
            let stiffness = pressed.stiffness(1.0) * MM / area;
            near("stiffness".into(), stiffness, solved.stiffness);
            let inner = solved.pressure.iter().filter(|point| point[0] < 0.8);
            for [r, expected] in inner {
                let found = pressed.pressure(r * aspect * MM).unwrap();
                near(format!("pressure at {r:.3}"), found, *expected);
            }
        }
    }
    assert!(wrong.is_empty(), "{} {wrong:#?}", wrong.len());
}

/// Random layers under random discs, with square elements anywhere under them, against the solver.
#[test]
#[ignore = "a minute: cargo test --release -p taxel-bodies --test all p3_layer::shares_of_a_hundred -- --ignored --nocapture"]
fn shares_of_a_hundred_random_drawings_agree_with_the_solver() {
    let mut random = ChaCha8Rng::seed_from_u64(16);
    let mut worst = [0.0_f64; 2];
    for count in 1..=100 {
        let words = ["gripped_flush", "slip_flush", "gripped_wide", "slip_wide"][count % 4];
        let (rim, grip) = contact(words);
        let aspect = 0.5 * f64::powf(20.0, random.random());
        let disc = BondedDisc {
            radius: aspect * MM,
            thickness: MM,
            rim,
            grip,
        };
        let pressed = disc.pressed().unwrap();
        let solved = solved(aspect, rim, grip);
        // The nearest rim is at 0.8 radii: beyond, the pressure has no bound.
        let side = aspect * (0.1 + 0.4 * random.random::<f64>());
        let reach = (0.8 * aspect - 0.5_f64.sqrt() * side).max(0.0) * random.random::<f64>();
        let angle = std::f64::consts::TAU * random.random::<f64>();
        let centre = [reach * angle.cos(), reach * angle.sin()];
        let found = pressed
            .share(centre.map(|along| along * MM), side * MM)
            .unwrap();
        // Midpoints of 60 x 60 parts.
        let parts = 60;
        let at = |axis: usize, part: i32| {
            centre[axis] + side * ((f64::from(part) + 0.5) / f64::from(parts) - 0.5)
        };
        let mean: f64 = (0..parts * parts)
            .map(|k| {
                let [x, y] = [at(0, k % parts), at(1, k / parts)];
                solved.pressure_at(x.hypot(y) / aspect)
            })
            .sum::<f64>()
            / f64::from(parts * parts);
        let expected = mean * side * side / (std::f64::consts::PI * aspect * aspect);
        let area = std::f64::consts::PI * (aspect * MM).powi(2);
        let stiffness = pressed.stiffness(1.0) * MM / area;
        let off = [found / expected - 1.0, stiffness / solved.stiffness - 1.0];
        for (worst, off) in worst.iter_mut().zip(off) {
            if off.abs() > worst.abs() {
                *worst = off;
                println!(
                    "{count}: {off:+.1e}, {words}, a/h {aspect:.3}, side {side:.3} at {reach:.3}"
                );
            }
        }
    }
    println!("share {:+.1e}, stiffness {:+.1e}", worst[0], worst[1]);
    assert!(worst.iter().all(|worst| worst.abs() <= 5e-3), "{worst:?}");
}
