//! Checks of tables that devices share.

use taxel::InputError;
use taxel_numerics::least_squares::linear;

use crate::readings::ReadingTable;

/// Between readings and drawing a factor in here is a wrong prefix of a unit, no
/// scatter of fabrication.
const PREFIX: [f64; 2] = [1000.0 / 3.0, 3000.0];
/// A signal at rest off by more than this factor is of another device.
const OTHER: f64 = 3.0;
/// The readings at rest are this part of all, those with the least loads.
const AT_REST: usize = 50;

/// Refuses a factor of about a thousand between readings and drawing; `expected`
/// is what the drawing gives, such as `, 12.000 fF at rest`.
///
/// # Errors
/// The column and its factor.
pub(crate) fn right_prefix(
    table: &ReadingTable,
    column: &str,
    ratio: f64,
    expected: &str,
) -> Result<(), InputError> {
    let [low, high] = PREFIX;
    let (times, size) = if (low..high).contains(&ratio) {
        ("1000 times", "large")
    } else if (low..high).contains(&(1.0 / ratio)) {
        ("a thousandth of", "small")
    } else {
        return Ok(());
    };
    let message = format!(
        "the readings are about {times} what the drawing gives{expected} (factor {ratio:.3e})"
    );
    let help = format!("is the unit of this column a thousand times too {size}?");
    Err(table.error(column, message, &help))
}

/// Refuses a signal at rest that is not that of the drawing; `name` says of what it
/// is, `words` how large.
///
/// # Errors
/// Value read, and value of the drawing.
pub(crate) fn of_this_device(
    table: &ReadingTable,
    column: &str,
    name: &str,
    [read, drawn]: [f64; 2],
    words: impl Fn(f64) -> String,
    help: &str,
) -> Result<(), InputError> {
    if (1.0 / OTHER..=OTHER).contains(&(read / drawn)) {
        return Ok(());
    }
    let (read, drawn) = (words(read), words(drawn));
    let message = format!("{name}{read} at rest; the sensor file says {drawn}");
    Err(table.error(column, message, help))
}

/// Refuses loads whose largest one, `most`, does not press.
///
/// # Errors
/// Values not above zero.
pub(crate) fn pressing(
    table: &ReadingTable,
    column: &str,
    what: &str,
    most: f64,
) -> Result<(), InputError> {
    if most > 0.0 {
        return Ok(());
    }
    let message = format!("no {what} is above zero; pressing is positive");
    Err(table.error(column, message, "turn the sign of the column"))
}

/// True if, of two kinds of columns, the table has the second.
///
/// # Errors
/// `both` or `neither`, at `column`.
pub(crate) fn is_second(
    table: &ReadingTable,
    there: [bool; 2],
    column: &str,
    [both, neither]: [&str; 2],
    help: &str,
) -> Result<bool, InputError> {
    match there {
        [true, false] => Ok(false),
        [false, true] => Ok(true),
        [true, true] => Err(table.error(column, both, help)),
        [false, false] => Err(table.error(column, neither, help)),
    }
}

/// Fewer readings than these, and a line is no sign of a dead channel.
const LEAST_TO_FOLLOW: usize = 12;
/// A signal of which a line through the loads explains no more than three times what it would
/// of noise, and no more than this share of its variance, does not follow them.
const FOLLOWS: f64 = 0.1;

/// Refuses a signal that does not follow the loads at all: a dead channel, which would bias what
/// it shares with others. `name` says of what it is; a row has its loads and the signal, all of
/// any unit.
///
/// # Errors
/// The channel, and how little of its signal the loads explain.
pub(crate) fn follows<const N: usize>(
    table: &ReadingTable,
    column: &str,
    name: &str,
    rows: &[([f64; N], f64)],
) -> Result<(), InputError> {
    let count = rows.len() as f64;
    let mean = rows.iter().map(|(_, signal)| signal).sum::<f64>() / count;
    let target: Vec<f64> = rows.iter().map(|(_, signal)| signal - mean).collect();
    // Loads that do not change explain nothing.
    let changes = |axis: &usize| {
        rows.iter()
            .any(|(loads, _)| loads[*axis] != rows[0].0[*axis])
    };
    let axes: Vec<usize> = (0..N).filter(changes).collect();
    if rows.len() < LEAST_TO_FOLLOW || axes.is_empty() {
        return Ok(());
    }
    let row = |(loads, _): &([f64; N], f64)| -> Vec<f64> {
        let moved = axes.iter().map(|axis| loads[*axis]);
        moved.chain([1.0]).collect()
    };
    let design: Vec<Vec<f64>> = rows.iter().map(row).collect();
    let Some(line) = linear::solve(&design, &target) else {
        return Ok(());
    };
    let all: f64 = target.iter().map(|off| off * off).sum();
    // A signal that never changes has the rounding of its mean as its variance.
    let still = all <= count * (1e-12 * mean).powi(2);
    let explained = if still { 0.0 } else { 1.0 - line.misfit / all };
    if explained > FOLLOWS.min(3.0 * axes.len() as f64 / count) {
        return Ok(());
    }
    let message = if still {
        format!(
            "{name} reads the same in all {} rows, whatever the load",
            rows.len()
        )
    } else {
        format!(
            "{name} does not follow the load: it explains {:.1} % of what the signal does",
            100.0 * explained
        )
    };
    let help = "the channel is dead or not connected: measure again, or leave its rows out";
    Err(table.error(column, message, help))
}

/// Signal at rest of pairs of load and signal: the mean at the least loads.
pub(crate) fn at_rest(pairs: impl Iterator<Item = [f64; 2]>) -> f64 {
    let mut pairs: Vec<[f64; 2]> = pairs.collect();
    pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let few = (pairs.len() / AT_REST).max(1);
    let least = pairs.iter().take(few).map(|[_, signal]| signal);
    least.sum::<f64>() / few as f64
}
