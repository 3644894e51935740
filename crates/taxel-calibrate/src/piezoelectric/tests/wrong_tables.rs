//! Tables whose columns are not what they say.

use super::*;
use crate::driver::Calibrator;

/// Rows of a table with its title line, without comments.
fn rows(text: &str) -> Vec<Vec<String>> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let cells = |line: &str| line.split(',').map(str::to_owned).collect();
    lines.map(cells).collect()
}

/// The table with each number of the column `name` changed.
fn changed(text: &str, name: &str, change: impl Fn(usize, f64) -> f64) -> String {
    let mut rows = rows(text);
    let titled = |title: &String| title.split(' ').next() == Some(name);
    let column = rows[0].iter().position(titled).unwrap();
    for (row, cells) in rows.iter_mut().enumerate().skip(1) {
        if let Ok(number) = cells[column].parse::<f64>() {
            cells[column] = format!("{:?}", change(row, number));
        }
    }
    rows.iter().map(|cells| cells.join(",") + "\n").collect()
}

fn exchanged(text: &str, [a, b]: [&str; 2]) -> String {
    text.replace(a, "@").replace(b, a).replace('@', b)
}

fn refusal(calibrator: &PiezoelectricCalibrator<'_>, text: &str) -> String {
    let found = calibrator.calibrate(&parse(text), &no_hold_out());
    found.map(|_| ()).unwrap_err().to_string()
}

#[test]
fn peaks_of_other_loads_or_columns_are_named() {
    with(|calibrator| {
        let text = calibrator.synthetic(&SyntheticOptions {
            noise: 0.01,
            readings: 90,
            ..SyntheticOptions::default()
        });
        // Another order of the same numbers: 37 and 90 have no common factor.
        let read: Vec<f64> = rows(&text)[1..]
            .iter()
            .map(|cells| cells[6].parse().unwrap())
            .collect();
        let mixed = changed(&text, "a1", |row, _| read[row * 37 % 90]);
        for (text, message) in [
            (
                changed(&text, "displacement", |_, _| 50.0),
                "displacement is constant",
            ),
            (
                changed(&text, "a1", |_, v| -v),
                "a1\nthe readings have the other sign",
            ),
            (
                changed(&text, "a2", |_, v| -v),
                "a2\nthe readings have the other sign",
            ),
            (
                changed(&text, "a2", |_, v| 1e3 * v),
                "a2\nthe readings are about 1000",
            ),
            (
                changed(&text, "a2", |_, v| 1e-3 * v),
                "a2\nthe readings are about a thou",
            ),
            (changed(&text, "a2", |_, _| 1.0), "a2 is always 1.0000 mV"),
            (changed(&text, "a2", |_, _| 0.0), "a2 is always 0.0000 mV"),
            (
                exchanged(&text, ["a1 [", "a2 ["]),
                "a1 and a2 are exchanged",
            ),
            (mixed, "no better than its mean"),
        ] {
            let error = refusal(calibrator, &text);
            assert!(error.contains(message), "{message}: {error}");
        }
    });
}

#[test]
fn presses_of_other_places_or_elements_are_named() {
    with(|calibrator| {
        let text = calibrator.synthetic_indentations(&IndentationOptions {
            seed: 5,
            radii: vec![1.5e-3, 3e-3],
            grid: 2e-3,
            noise: 0.01,
        });
        let text = text.unwrap();
        for (text, message) in [
            (changed(&text, "x", |_, x| -x), "x has the other sign"),
            (changed(&text, "y", |_, y| -y), "y has the other sign"),
            (
                changed(&changed(&text, "x", |_, x| -x), "y", |_, y| -y),
                "x and y have the other sign",
            ),
            (
                changed(&text, "voltage_8", |_, v| 1e3 * v),
                "signals of the others",
            ),
            (
                changed(&text, "voltage_8", |_, v| 1e-3 * v),
                "voltage_8\nvoltage_8 is",
            ),
            (
                changed(&text, "voltage_8", |_, _| 5.0),
                "voltage_8 is the same in all presses",
            ),
            (
                changed(&text, "voltage_8", |_, v| -v),
                "voltage_8 does not answer",
            ),
            (
                exchanged(&text, ["voltage_3 [", "voltage_8 ["]),
                "voltage_3 behaves like voltage_8, voltage_8 behaves like voltage_3",
            ),
        ] {
            let error = refusal(calibrator, &text);
            assert!(error.contains(message), "{message}: {error}");
        }
    });
}

#[test]
fn noise_of_a_twentieth_and_drift_are_no_wrong_tables() {
    with(|calibrator| {
        for seed in 0..4 {
            let text = calibrator.synthetic(&SyntheticOptions {
                seed,
                noise: 0.05,
                drift: 0.15,
                readings: 60,
                ..SyntheticOptions::default()
            });
            calibrator.calibrate(&parse(&text), &no_hold_out()).unwrap();
            // The map itself takes longer, and is not asked for here.
            let text = calibrator.synthetic_indentations(&IndentationOptions {
                seed,
                radii: vec![1.5e-3, 3e-3],
                grid: 2e-3,
                noise: 0.05,
            });
            let data = parse(&text.unwrap());
            calibrator.indentations(&data, &mut Vec::new()).unwrap();
        }
    });
}
