//! Check that load and signal of each row are of one moment.

use crate::readings::{ReadingTable, quantity};
use taxel::InputError;
use taxel::predict::LoadColumn;
use taxel::quantity::TIME;

/// A load and the signals that it alone sets at once; the first pair that a
/// table has is looked at. The sum of four capacitances does not see shear. Charge
/// leaks: there the model stands between load and signal ([`no_delay`]).
const PAIRS: [(&str, &[&str]); 6] = [
    ("displacement", &["capacitance"]),
    ("force_z", &["capacitance"]),
    ("pressure", &["voltage"]),
    ("pressure", &["resistance"]),
    (
        "force_z",
        &[
            "capacitance_11",
            "capacitance_12",
            "capacitance_21",
            "capacitance_22",
        ],
    ),
    (
        "force_z",
        &["counts_11", "counts_12", "counts_21", "counts_22"],
    ),
];
/// Delays that are looked for, readings.
const FARTHEST: isize = 20;
/// Least readings of one sensor for a delay.
const LEAST: usize = 60;
/// Clocks differ when a delay leaves this share of the roughness. On synthetic
/// benches of all devices with loops of half of the load, no delay leaves less
/// than 0.15; true ones leave 0.002 to 0.07 up to 15 % of hysteresis.
const CLEARLY: f64 = 0.08;

const HELP: &str = "bring both to one clock, and save each row's readings of one moment";

/// The middle one of these values.
fn middle(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// The column with the sensor's own clock, beside `time`.
pub(crate) const fn sensor_clock() -> LoadColumn {
    quantity("sensor_time", &TIME, 1e12, "clock of the sensor")
}

/// Refuses a table with two clocks, `time` and `sensor_time`, that differ by
/// more than half a step; `columns` are those of `data`.
///
/// # Errors
/// By how much they differ.
pub(crate) fn one_clock(data: &ReadingTable, columns: &[LoadColumn]) -> Result<(), InputError> {
    let at = |name: &str| columns.iter().position(|column| column.name == name);
    let (Some(bench), Some(sensor)) = (at("time"), at("sensor_time")) else {
        return Ok(());
    };
    let pairs = (0..data.len())
        .filter_map(|row| Some((data.number(row, bench)?, data.number(row, sensor)?)));
    let pairs: Vec<(f64, f64)> = pairs.collect();
    let steps = pairs.windows(2).map(|pair| pair[1].0 - pair[0].0);
    let Some(step) = middle(steps.filter(|step| *step > 0.0).collect()) else {
        return Ok(());
    };
    let apart: Vec<f64> = pairs.iter().map(|(time, sensor)| sensor - time).collect();
    let least = apart.iter().copied().fold(f64::INFINITY, f64::min);
    let most = apart.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if least.abs().max(most.abs()) <= 0.5 * step {
        return Ok(());
    }
    let message = format!(
        "the clocks differ by {least:.4} to {most:.4} s, with a reading each {step:.4} s: load and signal are not of \
         the same moment"
    );
    Err(data.error("sensor_time", message, HELP))
}

/// Refuses a table whose signals would fit its loads if they had been read
/// earlier or later; `columns` are those of `data`, `group` the one that says
/// which sensor a row is of.
///
/// # Errors
/// The delay.
pub(crate) fn same_moment(
    data: &ReadingTable,
    columns: &[LoadColumn],
    group: &str,
) -> Result<(), InputError> {
    let at = |name: &str| columns.iter().position(|column| column.name == name);
    let given = |name: &str| at(name).filter(|column| data.given[*column]);
    let Some(time) = given("time") else {
        return Ok(());
    };
    let pair = PAIRS.iter().find_map(|(load, signals)| {
        let signals: Option<Vec<usize>> = signals.iter().map(|name| given(name)).collect();
        Some((load, given(load)?, signals?))
    });
    let Some((name, load, signals)) = pair else {
        return Ok(());
    };
    let group = at(group);
    let mut series: Vec<(f64, Vec<[f64; 2]>)> = Vec::new();
    let mut steps = Vec::new();
    let mut before: Option<(f64, f64)> = None;
    for row in 0..data.len() {
        let of = group
            .and_then(|column| data.number(row, column))
            .unwrap_or(0.0);
        let sum: Option<f64> = signals.iter().map(|signal| data.number(row, *signal)).sum();
        if let (Some(x), Some(y)) = (data.number(row, load), sum) {
            match series.last_mut().filter(|(same, _)| *same == of) {
                Some((_, rows)) => rows.push([x, y]),
                None => series.push((of, vec![[x, y]])),
            }
        }
        let now = data.number(row, time);
        if let (Some((same, last)), Some(now)) = (before, now)
            && same == of
        {
            steps.push(now - last);
        }
        before = now.map(|now| (of, now));
    }
    let series: Vec<Vec<[f64; 2]>> = series.into_iter().map(|(_, rows)| rows).collect();
    no_delay(data, name, &series, steps)
}

/// Refuses rows of a load, or of what a model makes of it, and a signal, that would
/// fit each other if the signal had been read earlier or later; `steps` are the
/// times between rows and `name` the column of the load.
///
/// # Errors
/// The delay.
pub(crate) fn no_delay(
    data: &ReadingTable,
    name: &str,
    series: &[Vec<[f64; 2]>],
    steps: Vec<f64>,
) -> Result<(), InputError> {
    let Some(delay) = delay(series) else {
        return Ok(());
    };
    let step = middle(steps).unwrap_or(0.0);
    let side = if delay > 0 { "after" } else { "before" };
    let message = format!(
        "the signal comes about {} readings ({:.3} s) {side} its load: their clocks differ",
        delay.abs(),
        delay.unsigned_abs() as f64 * step
    );
    Err(data.error(name, message, HELP))
}

/// By how many rows the signals (second of each pair) come after the loads, if
/// clearly another delay than none makes the signals a curve over the loads.
fn delay(series: &[Vec<[f64; 2]>]) -> Option<isize> {
    let long = || series.iter().filter(|rows| rows.len() >= LEAST);
    let sum = |delay: isize| long().map(|rows| roughness(rows, delay)).sum::<f64>();
    let delays: Vec<(isize, f64)> = (-FARTHEST..=FARTHEST).map(|k| (k, sum(k))).collect();
    let least = delays
        .iter()
        .map(|(_, rough)| *rough)
        .fold(f64::INFINITY, f64::min);
    if least.is_nan() || least >= CLEARLY * sum(0) {
        return None;
    }
    // After a whole cycle all comes again.
    let near = delays.iter().filter(|(_, rough)| *rough <= 2.0 * least);
    near.map(|(delay, _)| *delay)
        .min_by_key(|delay| delay.abs())
}

/// Mean square of the steps of the signal, when the rows are put in the order of
/// the load.
fn roughness(rows: &[[f64; 2]], delay: isize) -> f64 {
    let of = |row: usize| Some([rows[row][0], rows.get(row.checked_add_signed(delay)?)?[1]]);
    let mut pairs: Vec<[f64; 2]> = (0..rows.len()).filter_map(of).collect();
    pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let steps = pairs
        .windows(2)
        .map(|pair| (pair[1][1] - pair[0][1]).powi(2));
    steps.sum::<f64>() / pairs.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cycles of 100 rows; unloading has `loop_width` more signal at half load.
    fn cycles(shift: usize, loop_width: f64) -> Vec<[f64; 2]> {
        let phase = |row: usize| (row % 100) as f64 / 50.0;
        let load = |row: usize| 1.0 - (phase(row) - 1.0).abs();
        let signal = |row: usize| {
            let load = load(row);
            let width = if phase(row) > 1.0 { loop_width } else { 0.0 };
            load * load + 4.0 * width * load * (1.0 - load)
        };
        (0..200)
            .map(|row| [load(row), signal((row + 200 - shift) % 200)])
            .collect()
    }

    #[test]
    fn a_delay_is_found_and_a_loop_is_none() {
        for (shift, rows) in [(5, 5), (12, 12)] {
            assert_eq!(delay(&[cycles(shift, 0.0)]), Some(rows));
            // A loop looks like a row or so of delay.
            for (turned, truth) in [(shift, rows), (200 - shift, -rows)] {
                let found = delay(&[cycles(turned, 0.05)]);
                assert!(found.is_some_and(|found| (found - truth).abs() <= 1));
            }
        }
        // A fifth of the full scale wide.
        for width in [0.0, 0.05, 0.2] {
            assert_eq!(delay(&[cycles(0, width)]), None, "{width}");
        }
        // Constant signals, and too few rows, show no delay.
        assert_eq!(delay(&[vec![[1.0, 2.0]; 100]]), None);
        assert_eq!(delay(&[cycles(5, 0.0)[..40].to_vec()]), None);
        assert_eq!(delay(&[]), None);
    }
}
