//! Runs of training as tables.

use std::fmt::Write as _;

use taxel_calibrate::TrainingFile;

/// A run of rows of time, s, truth and channels; `columns` are the names of the truth with units.
pub(crate) fn table(
    name: impl Into<String>,
    columns: &str,
    rows: impl IntoIterator<Item = (f64, Vec<f64>, Vec<f64>)>,
) -> Vec<TrainingFile> {
    let mut rows = rows.into_iter().peekable();
    let mut text = format!("time [s],{columns}");
    let channels = rows.peek().map_or(0, |(_, _, readings)| readings.len());
    (1..=channels).for_each(|channel| write!(text, ",channel_{channel}").unwrap());
    text.push('\n');
    for (time, truth, readings) in rows {
        write!(text, "{time}").unwrap();
        let numbers = truth.iter().chain(&readings);
        numbers.for_each(|number| write!(text, ",{number}").unwrap());
        text.push('\n');
    }
    let name = name.into();
    vec![TrainingFile { name, text }]
}
