//! Checks of tables that devices share.

use taxel_recording::InputError;

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

/// Signal at rest of pairs of load and signal: the mean at the least loads.
pub(crate) fn at_rest(pairs: impl Iterator<Item = [f64; 2]>) -> f64 {
    let mut pairs: Vec<[f64; 2]> = pairs.collect();
    pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let few = (pairs.len() / AT_REST).max(1);
    let least = pairs.iter().take(few).map(|[_, signal]| signal);
    least.sum::<f64>() / few as f64
}
