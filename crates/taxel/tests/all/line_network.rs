//! Rows x columns of admittances against tables that another program computed, and against
//! themselves.
#![allow(clippy::unwrap_used)]

use std::time::Instant;

use crate::common::table;
use taxel::transduction::{IdleLines, LineNetwork, LineWiring, NetworkError};
use taxel_numerics::{Noise, split_mix};

const SUPPLY: f64 = 3.3;
/// Rest and pressed, ohm.
const REST: f64 = 200e3;
const PRESSED: f64 = 2e3;

fn zero_potential([drive_resistance, idle_resistance, column_resistance]: [f64; 3]) -> LineWiring {
    LineWiring::ZeroPotential {
        drive_resistance,
        idle_resistance,
        column_resistance,
        supply: SUPPLY,
        feedback: 2e3,
    }
}

fn divider(idle: IdleLines) -> LineWiring {
    LineWiring::Divider {
        reference: 10e3,
        supply: SUPPLY,
        idle,
    }
}

/// Every kind of wiring.
fn wirings() -> [LineWiring; 5] {
    [
        LineWiring::Floating,
        divider(IdleLines::Open),
        divider(IdleLines::Grounded(0.0)),
        divider(IdleLines::Grounded(150.0)),
        zero_potential([70.0, 20.0, 5.0]),
    ]
}

fn read(network: &LineNetwork, admittance: &[f64]) -> Vec<f64> {
    let mut readings = vec![0.0; admittance.len()];
    network.read(admittance, &mut readings).unwrap();
    readings
}

/// Rails beyond all that the wiring can read.
fn wide(network: &LineNetwork) -> [f64; 2] {
    match network.wiring {
        LineWiring::Divider { supply, .. } => [1e-12, supply * (1.0 - 1e-12)],
        _ => [1e-12, 1e15],
    }
}

/// Numbers between 0 and 1 from a seed.
fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut number = 0;
    move || {
        number += 1;
        (split_mix(seed, number) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Admittances from that of rest to that of a hard press, evenly in the logarithm.
fn random_matrix(count: usize, seed: u64) -> Vec<f64> {
    let mut random = uniform(seed);
    (0..count)
        .map(|_| (random() * (REST / PRESSED).ln()).exp() / REST)
        .collect()
}

#[test]
fn rows_of_the_table_come_back() {
    // Of each wiring its column, and the error of the table: fractions and pseudoinverse in the
    // head of the file, 1e-11 of a second program; 1e-9 ohm stands for ideal, both here and
    // there, but the drive of a divider is ideal here: two pressed crossings of its row take
    // 1e-12 from one of 1e-9 ohm. The rounding of sums over eight lines is below 4e-15.
    let ideal = 1e-9;
    let wirings = [
        ("float [ohm]", LineWiring::Floating, 8e-15),
        ("divider_open [V]", divider(IdleLines::Open), 2e-13),
        (
            "divider_grounded [V]",
            divider(IdleLines::Grounded(ideal)),
            1.2e-12,
        ),
        ("zero_ideal [V]", zero_potential([ideal; 3]), 2e-13),
        ("zero_real [V]", zero_potential([70.0, 20.0, 5.0]), 1e-11),
    ];
    let rows = table("own_resistive_matrix.csv");
    assert_eq!(rows.len(), 4 * 64);
    for (column, wiring, error) in wirings {
        let network = LineNetwork {
            rows: 8,
            columns: 8,
            wiring,
        };
        let mut worst = [0.0_f64; 2];
        for pattern in rows.chunks(64) {
            let truth: Vec<f64> = pattern
                .iter()
                .map(|row| 1.0 / row.at("R_true [ohm]"))
                .collect();
            let expected: Vec<f64> = pattern.iter().map(|row| row.at(column)).collect();
            for (found, expected) in read(&network, &truth).iter().zip(&expected) {
                worst[0] = worst[0].max((found / expected - 1.0).abs());
            }
            let inverse = network.invert(&expected, wide(&network), None).unwrap();
            for (x, truth) in inverse.ln_admittance.iter().zip(&truth) {
                worst[1] = worst[1].max((x - truth.ln()).abs());
            }
            assert!(inverse.steps <= 11, "{column}: {} steps", inverse.steps);
        }
        println!(
            "{column}: readings {:.1e}, inverse {:.1e}",
            worst[0], worst[1]
        );
        assert!(worst[0] <= error, "{column}: {:e}", worst[0]);
        // What remains of the readings, times the largest noise gain of a sum of errors.
        assert!(worst[1] <= 1e-10, "{column}: {:e}", worst[1]);
    }
}

#[test]
fn uniform_matrices_read_the_closed_form() {
    for rows in 1..=32 {
        for columns in [1, 2, 3, 8, 17, 32] {
            let network = LineNetwork {
                rows,
                columns,
                wiring: LineWiring::Floating,
            };
            let count = rows * columns;
            let closed = REST * (rows + columns - 1) as f64 / count as f64;
            for reading in read(&network, &vec![1.0 / REST; count]) {
                // Rounding of sums over at most 32 lines.
                assert!((reading / closed - 1.0).abs() < 1e-13, "{rows} x {columns}");
            }
            let ideal = LineNetwork {
                wiring: zero_potential([0.0; 3]),
                ..network
            };
            let matrix = random_matrix(count, count as u64);
            for (reading, admittance) in read(&ideal, &matrix).iter().zip(&matrix) {
                assert!((reading / (SUPPLY * 2e3 * admittance) - 1.0).abs() < 1e-13);
            }
        }
    }
}

#[test]
fn three_pressed_corners_make_a_ghost() {
    let mut matrix = vec![1.0 / REST; 64];
    for corner in [(1, 1), (1, 6), (4, 1)] {
        matrix[8 * corner.0 + corner.1] = 1.0 / PRESSED;
    }
    let ghost = |wiring| {
        let network = LineNetwork {
            rows: 8,
            columns: 8,
            wiring,
        };
        read(&network, &matrix)[8 * 4 + 6]
    };
    // Printed with four digits in the specification.
    assert!((ghost(LineWiring::Floating) - 5324.0).abs() < 0.5);
    assert!((ghost(divider(IdleLines::Open)) - 2.153).abs() < 5e-4);
    assert!((ghost(divider(IdleLines::Grounded(0.0))) - 0.026).abs() < 5e-4);
}

#[test]
fn noise_gains_are_those_of_the_table() {
    let network = LineNetwork {
        rows: 8,
        columns: 8,
        wiring: LineWiring::Floating,
    };
    let patterns = [&[][..], &[0, 1, 8]].map(|corners: &[usize]| {
        let mut pattern = vec![1.0 / REST; 64];
        for corner in corners {
            pattern[*corner] = 1.0 / PRESSED;
        }
        pattern
    });
    let gains = |network: LineNetwork| {
        let gain = |pattern: &Vec<f64>| network.noise_gain(pattern).unwrap();
        [gain(&patterns[0]), gain(&patterns[1])]
    };
    let [empty, ghost] = gains(network);
    // Six digits in the comments of the table.
    assert!((empty - 6.62201).abs() < 5e-6, "{empty}");
    assert!((ghost - 67.0997).abs() < 5e-5, "{ghost}");
    let [empty, ghost] = gains(LineNetwork {
        wiring: zero_potential([70.0, 20.0, 5.0]),
        ..network
    });
    println!("zero potential: empty {empty:.3}, ghost {ghost:.3}");
    // Near one: the row of a pressed crossing loses a few percent to its multiplexer.
    assert!(empty < 1.01 && ghost < 1.1, "{empty} {ghost}");
}

#[test]
fn slopes_are_those_of_the_readings() {
    for wiring in wirings() {
        for (rows, columns) in [(1, 1), (3, 5), (6, 4)] {
            let network = LineNetwork {
                rows,
                columns,
                wiring,
            };
            let count = rows * columns;
            let matrix = random_matrix(count, 5);
            let slopes = network.slopes(&matrix).unwrap();
            let scale = read(&network, &matrix);
            for of in 0..count {
                let h = 1e-4;
                let [more, less] = [h, -h].map(|h: f64| {
                    let mut moved = matrix.clone();
                    moved[of] *= h.exp();
                    read(&network, &moved)
                });
                for at in 0..count {
                    let difference = (more[at] - less[at]) / (2.0 * h);
                    let off = (slopes[at][of] - difference) / scale[at];
                    // h² of third slopes of the order of one, and rounding over h.
                    assert!(off.abs() < 1e-8, "{wiring:?} {at} {of}: {off:e}");
                }
            }
        }
    }
}

#[test]
fn inversion_undoes_reading() {
    for wiring in wirings() {
        let (mut worst, mut most) = (0.0_f64, 0);
        for case in 0..60_u64 {
            let mut random = uniform(split_mix(7, case));
            let mut side = || 1 + (random() * 32.0) as usize;
            let (rows, columns) = if case == 0 { (1, 1) } else { (side(), side()) };
            let network = LineNetwork {
                rows,
                columns,
                wiring,
            };
            let matrix = random_matrix(rows * columns, case);
            let inverse = network
                .invert(&read(&network, &matrix), wide(&network), None)
                .unwrap_or_else(|error| panic!("{wiring:?} {rows} x {columns}: {error}"));
            most = most.max(inverse.steps);
            for (x, y) in inverse.ln_admittance.iter().zip(&matrix) {
                worst = worst.max((x - y.ln()).abs());
            }
        }
        println!("{wiring:?}: {worst:.1e} in {most} steps at most");
        // The readings agree to 1e-12; a floating matrix passes that on up to a thousandfold.
        assert!(worst < 1e-9, "{wiring:?}: {worst:e}");
    }
}

#[test]
fn a_live_frame_of_32_x_32_is_inverted_from_the_last() {
    for (wiring, name) in [
        (zero_potential([70.0, 20.0, 5.0]), "zero potential"),
        (divider(IdleLines::Grounded(0.0)), "grounded divider"),
        (LineWiring::Floating, "floating"),
    ] {
        let network = LineNetwork {
            rows: 32,
            columns: 32,
            wiring,
        };
        // A finger of 6 x 6 crossings that moves and presses, 0.1 % of noise.
        let pressed = |frame: f64| -> Vec<f64> {
            let at = |i: usize| {
                let (x, y) = ((i % 32) as f64 - 8.0 - 0.3 * frame, (i / 32) as f64 - 12.0);
                let press = (-(x * x + y * y) / 9.0).exp();
                (press * (REST / PRESSED).ln()).exp() / REST
            };
            (0..1024).map(at).collect()
        };
        let mut noise = Noise::seeded(3);
        let mut last = network
            .invert(&read(&network, &pressed(0.0)), wide(&network), None)
            .unwrap();
        let mut times = Vec::new();
        let mut steps = 0;
        for frame in 1..=20 {
            let truth = pressed(f64::from(frame));
            let readings = read(&network, &truth);
            let noisy: Vec<f64> = readings
                .iter()
                .map(|r| r * (1.0 + 1e-3 * noise.normal()))
                .collect();
            let begin = Instant::now();
            last = network
                .invert(&noisy, wide(&network), Some(&last.ln_admittance))
                .unwrap();
            times.push(begin.elapsed());
            steps = steps.max(last.steps);
            let off = last
                .ln_admittance
                .iter()
                .zip(&truth)
                .map(|(x, y)| (x - y.ln()).abs());
            let worst = off.fold(0.0, f64::max);
            // Six deviations of the noise, times the gain: of a divider the supply over what a
            // hard press leaves of it, of a floating matrix what the neighbours pass on.
            let gain = match wiring {
                LineWiring::Floating => 150.0,
                LineWiring::Divider { .. } => 1.0 + 10e3 / PRESSED,
                LineWiring::ZeroPotential { .. } => 1.2,
            };
            assert!(worst < 6e-3 * gain, "{name} {worst}");
        }
        times.sort();
        println!(
            "{name} 32 x 32: median {:?}, longest {:?}, {steps} steps at most",
            times[10], times[19]
        );
    }
}

#[test]
fn readings_at_a_rail_are_named_and_nonsense_is_refused() {
    for wiring in wirings() {
        let network = LineNetwork {
            rows: 4,
            columns: 3,
            wiring,
        };
        let matrix = vec![1.0 / REST; 12];
        let mut readings = read(&network, &matrix);
        let limits = [0.9 * readings[0], 1.1 * readings[0]];
        for beyond in [0.0, -1.0, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            readings[7] = beyond;
            let inverse = network.invert(&readings, limits, None).unwrap();
            assert_eq!(inverse.saturated, [7]);
            assert!(inverse.ln_admittance.iter().all(|x| x.is_finite()));
        }
        // A start from nowhere is left for the usual one.
        readings[7] = readings[0];
        for start in [f64::NAN, f64::INFINITY, -900.0, 900.0] {
            let inverse = network
                .invert(&readings, limits, Some(&[start; 12]))
                .unwrap();
            assert!(inverse.residual < 1e-12);
        }
        readings[7] = f64::NAN;
        let error = network.invert(&readings, limits, None).unwrap_err();
        assert!(
            matches!(error, NetworkError::OutOfRange { crossing: 7, .. }),
            "{error}"
        );
        // Any positive readings at all: an answer that reads like this, or an error.
        for seed in 0..50 {
            let mut random = uniform(seed);
            let wild: Vec<f64> = (0..12).map(|_| (20.0 * random() - 15.0).exp()).collect();
            match network.invert(&wild, wide(&network), None) {
                Ok(inverse) => {
                    assert!(inverse.residual < 1e-12);
                    assert!(inverse.ln_admittance.iter().all(|x| x.is_finite()));
                }
                Err(error) => assert!(matches!(error, NetworkError::NotConverged { .. })),
            }
        }
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut matrix = matrix.clone();
            matrix[5] = bad;
            let error = network.read(&matrix, &mut readings).unwrap_err();
            assert!(
                matches!(error, NetworkError::OutOfRange { crossing: 5, .. }),
                "{error}"
            );
        }
        let error = network.read(&matrix[1..], &mut readings).unwrap_err();
        assert!(matches!(error, NetworkError::WrongCount { given: 11, .. }));
    }
}

#[test]
fn covariance_is_that_of_many_noisy_frames() {
    let network = LineNetwork {
        rows: 3,
        columns: 2,
        wiring: LineWiring::Floating,
    };
    let matrix = random_matrix(6, 9);
    let readings = read(&network, &matrix);
    let deviations: Vec<f64> = readings.iter().map(|r| 1e-4 * r).collect();
    let spread = network.spread(&matrix, &deviations).unwrap();
    let covariance = &spread * spread.transpose();
    let diagonal = network.deviations(&matrix, &deviations).unwrap();
    let mut noise = Noise::seeded(11);
    let mut sums = [[0.0; 6]; 6];
    let frames = 4000;
    for _ in 0..frames {
        let noisy: Vec<f64> = readings
            .iter()
            .zip(&deviations)
            .map(|(r, d)| r + d * noise.normal())
            .collect();
        let inverse = network.invert(&noisy, wide(&network), None).unwrap();
        let off: Vec<f64> = inverse
            .ln_admittance
            .iter()
            .zip(&matrix)
            .map(|(x, y)| x - y.ln())
            .collect();
        for (sums, a) in sums.iter_mut().zip(&off) {
            sums.iter_mut().zip(&off).for_each(|(sum, b)| *sum += a * b);
        }
    }
    for i in 0..6 {
        for j in 0..6 {
            let scale = diagonal[i] * diagonal[j];
            let off = (sums[i][j] / f64::from(frames) - covariance[(i, j)]) / scale;
            // Four deviations of a variance of 4000 draws, √2/√4000 each.
            assert!(off.abs() < 0.09, "{i} {j}: {off}");
        }
        assert!((diagonal[i].powi(2) / covariance[(i, i)] - 1.0).abs() < 1e-12);
    }
}

/// Two minutes in a release build: `cargo test --release -p taxel --test all intervals_hold -- --ignored`.
#[test]
#[ignore = "long"]
fn intervals_hold_the_truth_of_a_thousand_random_matrices() {
    for wiring in wirings() {
        let (mut within, mut all, mut failed, mut least) = (0, 0, 0, f64::INFINITY);
        for case in 0..1000_u64 {
            let mut random = uniform(split_mix(17, case));
            let mut side = || 2 + (random() * 31.0) as usize;
            let (rows, columns) = (side(), side());
            let network = LineNetwork {
                rows,
                columns,
                wiring,
            };
            let matrix = random_matrix(rows * columns, case);
            let readings = read(&network, &matrix);
            let deviations: Vec<f64> = readings.iter().map(|r| 1e-3 * r).collect();
            let mut noise = Noise::seeded(case);
            let noisy: Vec<f64> = readings
                .iter()
                .zip(&deviations)
                .map(|(r, d)| r + d * noise.normal())
                .collect();
            let Ok(inverse) = network.invert(&noisy, wide(&network), None) else {
                let stated = network.deviations(&matrix, &deviations).unwrap();
                least = least.min(stated.into_iter().fold(0.0, f64::max));
                failed += 1;
                continue;
            };
            let found: Vec<f64> = inverse.ln_admittance.iter().map(|x| x.exp()).collect();
            let stated = network.deviations(&found, &deviations).unwrap();
            for ((x, y), deviation) in inverse.ln_admittance.iter().zip(&matrix).zip(stated) {
                all += 1;
                within += usize::from((x - y.ln()).abs() <= 1.959964 * deviation);
            }
        }
        let share = within as f64 / f64::from(all);
        println!(
            "{wiring:?}: {:.2} % of {all} within, {failed} without an answer, of {least:.2} at least",
            100.0 * share
        );
        assert!((0.93..=0.97).contains(&share));
        // Noise of a quarter of an admittance takes it to zero within four deviations: such
        // readings may be those of no admittances, others not.
        assert!(least >= 0.25, "{wiring:?}: {least}");
    }
}
