//! Numbers at times of their own, and their values at other times.

use std::sync::Arc;

use taxel::InputError;
use taxel_ground::separator_of;

/// Rows of numbers with rising times.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    times: Vec<f64>,
    /// Copies of a series share them: those of a thousand channels are as large as all the rest.
    rows: Arc<Vec<Vec<f64>>>,
    /// Rows that were left out because they repeat the one before.
    doubled: usize,
}

/// Longest cell that is quoted in a message.
const QUOTED: usize = 40;

impl Series {
    /// A series; `None` unless the times (s) rise strictly, are finite, and
    /// each has one row of the same length.
    pub fn new(times: Vec<f64>, rows: Vec<Vec<f64>>) -> Option<Self> {
        let rising = times.windows(2).all(|pair| pair[0] < pair[1]);
        let even = rows.windows(2).all(|pair| pair[0].len() == pair[1].len());
        let finite = times.iter().all(|time| time.is_finite());
        (rising && even && finite && times.len() == rows.len()).then_some(Self {
            times,
            rows: Arc::new(rows),
            doubled: 0,
        })
    }

    /// Reads rows of numbers without a header, the time in seconds first. Commas,
    /// semicolons or tabs part them; with the last two `1,5` may be a number.
    /// Lines that begin with `#` are comments. An empty cell and `nan` are a
    /// missing reading; last columns that are empty throughout are none. A row that repeats the
    /// one before, time and all, is left out.
    ///
    /// # Errors
    /// [`InputError`] at the first cell that is no number, the first row of
    /// another length, the first time that does not rise.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let mut series = Self {
            times: Vec::new(),
            rows: Arc::default(),
            doubled: 0,
        };
        let separator = separator_of(text);
        for (line, content) in rows_of(text) {
            series.read_line(file, line, content, separator)?;
        }
        if series.times.len() < 2 {
            let found = series.times.len();
            return Err(InputError::whole(
                file,
                format!("{found} rows of numbers, at least 2 are needed"),
            )
            .help("give comma-separated numbers without a header, time in seconds first"));
        }
        series.drop_empty_end();
        Ok(series)
    }

    /// True if a text has numbers from its first row on.
    pub(crate) fn recognises(text: &str) -> bool {
        let separator = separator_of(text);
        let numbers = |(_, line): (usize, &str)| {
            let mut cells = line.split(char::from(separator));
            let time = cells.next().and_then(|cell| number(cell, separator));
            time.is_some_and(f64::is_finite) && cells.all(|cell| number(cell, separator).is_some())
        };
        rows_of(text).next().is_some_and(numbers)
    }

    /// Refuses a missing reading in the columns of a text that are `needed`,
    /// counted from 0, the time.
    ///
    /// # Errors
    /// [`InputError`] at the cell.
    pub(crate) fn refuse_missing(
        file: &str,
        text: &str,
        needed: impl Fn(usize) -> bool,
    ) -> Result<(), InputError> {
        let separator = separator_of(text);
        for (line, content) in rows_of(text) {
            let mut column = 1;
            for (index, cell) in content.split(char::from(separator)).enumerate() {
                let width = cell.chars().count();
                let missing = number(cell, separator).is_some_and(f64::is_nan);
                if missing && needed(index) {
                    let message = "there is no number here";
                    return Err(
                        InputError::on_line(file, line, content, column, width, message)
                            .help("remove the row: a map is trained on whole rows; or mask the channel in the sensor file"),
                    );
                }
                column += width + 1;
            }
        }
        Ok(())
    }

    fn read_line(
        &mut self,
        file: &str,
        line: usize,
        content: &str,
        separator: u8,
    ) -> Result<(), InputError> {
        let mut row = Vec::new();
        let mut column = 1;
        for cell in content.split(char::from(separator)) {
            let valid = number(cell, separator).filter(|n| n.is_finite() || !row.is_empty());
            let width = cell.chars().count();
            let Some(number) = valid else {
                let shown: String = cell.trim().chars().take(QUOTED).collect();
                let message = format!("\"{shown}\" is not a finite number");
                return Err(
                    InputError::on_line(file, line, content, column, width, message).help(
                        "a row is the time in seconds and one number for each channel, or nan",
                    ),
                );
            };
            row.push(number);
            column += width + 1;
        }
        let values = row.split_off(1);
        let width = content.chars().count();
        if let Some(first) = self.rows.first()
            && first.len() != values.len()
        {
            let message = format!(
                "the row has {} numbers, the first one has {}",
                values.len() + 1,
                first.len() + 1
            );
            return Err(InputError::on_line(file, line, content, 1, width, message)
                .help("remove the row, which may be cut short"));
        }
        // The same reading at the same time was written twice.
        let again = |last: &Vec<f64>| {
            let same = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
            last.iter().zip(&values).all(same)
        };
        if self.times.last() == Some(&row[0]) && self.rows.last().is_some_and(again) {
            self.doubled += 1;
            return Ok(());
        }
        if let Some(last) = self.times.last()
            && row[0] <= *last
        {
            let message = format!("the time {} s does not come after {last} s", row[0]);
            let width = content.find(char::from(separator)).unwrap_or(width);
            return Err(InputError::on_line(file, line, content, 1, width, message)
                .help("times must rise from row to row"));
        }
        self.times.push(row[0]);
        Arc::make_mut(&mut self.rows).push(values);
        Ok(())
    }

    /// Forgets last columns without any number.
    fn drop_empty_end(&mut self) {
        let used = |row: &Vec<f64>| row.iter().rposition(|value| !value.is_nan());
        let last = self.rows.iter().filter_map(used).max();
        for row in Arc::make_mut(&mut self.rows) {
            row.truncate(last.map_or(0, |last| last + 1));
        }
    }

    /// Times, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Rows, one per time.
    pub fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }

    /// Puts zero in the columns of masked channels: a channel that does not change
    /// trains nothing.
    pub(crate) fn silence(&mut self, masked: &[bool]) {
        for row in Arc::make_mut(&mut self.rows) {
            for (value, masked) in row.iter_mut().zip(masked) {
                if *masked {
                    *value = 0.0;
                }
            }
        }
    }

    /// Rows of the text that repeated the one before, time and readings, and were left out.
    pub(crate) fn doubled(&self) -> usize {
        self.doubled
    }

    /// Numbers in a row.
    pub fn width(&self) -> usize {
        self.rows.first().map_or(0, Vec::len)
    }

    /// Longest step between two times, s.
    pub fn longest_step(&self) -> f64 {
        let steps = self.times.windows(2).map(|pair| pair[1] - pair[0]);
        steps.fold(0.0, f64::max)
    }

    /// The step between two times that half of the steps do not exceed, s.
    pub fn usual_step(&self) -> f64 {
        let mut steps: Vec<f64> = self
            .times
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied().unwrap_or(0.0)
    }

    /// Distance of `time` from the nearest row, s.
    pub fn distance(&self, time: f64) -> f64 {
        let after = self.times.partition_point(|t| *t < time);
        let near = self.times[after.saturating_sub(1)..].iter().take(2);
        near.fold(f64::INFINITY, |least, t| least.min((t - time).abs()))
    }

    /// The row at `time`, on straight lines between the rows; `None` farther
    /// than `reach` (s) from a row on either side.
    pub fn at(&self, time: f64, reach: f64) -> Option<Vec<f64>> {
        let after = self.times.partition_point(|t| *t < time);
        let (low, high) = match (after.checked_sub(1), self.times.get(after)) {
            (_, Some(next)) if *next == time => return Some(self.rows[after].clone()),
            (Some(before), Some(_)) => (before, after),
            (Some(before), None) => (before, before),
            (None, Some(_)) => (after, after),
            (None, None) => return None,
        };
        if (time - self.times[low])
            .abs()
            .min((self.times[high] - time).abs())
            > reach
        {
            return None;
        }
        if low == high {
            return Some(self.rows[low].clone());
        }
        let share = (time - self.times[low]) / (self.times[high] - self.times[low]);
        let between = |(a, b): (&f64, &f64)| a + share * (b - a);
        Some(
            self.rows[low]
                .iter()
                .zip(&self.rows[high])
                .map(between)
                .collect(),
        )
    }
}

/// Rows with their lines, from 1.
fn rows_of(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let said = |(_, line): &(usize, &str)| !line.trim().is_empty() && !line.starts_with('#');
    (1..).zip(text.lines()).filter(said)
}

/// A finite number; `NaN` where the cell says that there is none.
fn number(cell: &str, separator: u8) -> Option<f64> {
    let cell = cell.trim();
    if cell.is_empty() || cell.eq_ignore_ascii_case("nan") {
        return Some(f64::NAN);
    }
    let number: Option<f64> = if separator == b',' {
        cell.parse().ok()
    } else {
        cell.replacen(',', ".", 1).parse().ok()
    };
    number.filter(|number| number.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_on_straight_lines_and_not_in_outages() {
        let series = Series::parse("s.csv", "0,1,2\n1,3,2\n\n9,0,0\n").unwrap();
        assert_eq!(series.at(0.25, 0.5), Some(vec![1.5, 2.0]));
        assert_eq!(series.at(1.0, 0.0), Some(vec![3.0, 2.0]));
        assert_eq!(series.at(5.0, 0.5), None);
        assert_eq!(series.at(9.2, 0.5), Some(vec![0.0, 0.0]));
        assert_eq!(series.at(-1.0, 0.5), None);
        assert_eq!(series.longest_step(), 8.0);
        assert_eq!(series.usual_step(), 8.0);
        let distances = [-1.0, 0.0, 0.25, 5.0, 9.5].map(|time| series.distance(time));
        assert_eq!(distances, [1.0, 0.0, 0.25, 4.0, 0.5]);
    }

    #[test]
    fn mistakes_are_shown_in_their_place() {
        let message = |text: &str| Series::parse("s.csv", text).unwrap_err().to_string();
        assert!(message("0,1\n1,x2\n").starts_with("s.csv:2:3\n 2 | 1,x2\n   |   ^^\n\"x2\""));
        assert!(message("0,1\n1,2,3\n").contains("the row has 3 numbers, the first one has 2"));
        assert_eq!(
            Series::parse("s.csv", "1,1\n1,1\n2,2\n").unwrap().doubled(),
            1
        );
        assert!(message("1,1\n1,2\n").contains("the time 1 s does not come after 1 s"));
        assert!(message("nan,1\n").contains("\"nan\" is not a finite number"));
        assert!(message("").contains("0 rows"));
        assert!(Series::parse("s.csv", "0,nan\n1,2").unwrap().rows()[0][0].is_nan());
        let missing =
            |text: &str, columns| Series::refuse_missing("s.csv", text, |column| column < columns);
        let error = missing("0,1,2\n1,,2\n", 3).unwrap_err().to_string();
        assert!(error.starts_with("s.csv:2:3"), "{error}");
        assert!(missing("0,1,\n1,1,nan\n", 2).is_ok());
    }

    #[test]
    fn ways_to_save_the_same_rows_are_the_same() {
        let plain = "0.5,1,-2.5\n1.5,3,4\n";
        let expected = Series::parse("s.csv", plain).unwrap();
        for text in [
            "# by us\n0.5,1,-2.5\r\n\r\n1.5,3,4\r\n",
            "0,5;1;-2,5\n1,5;3;4\n",
            "0.5\t1\t-2.5\n1.5\t3\t4\n",
            "0.5, 1, -2.5,,\n1.5, 3, 4,,\n",
        ] {
            assert!(Series::recognises(text), "{text}");
            assert_eq!(Series::parse("s.csv", text).unwrap(), expected, "{text}");
        }
        assert!(!Series::recognises("time,a\n0,1\n"));
        assert!(Series::recognises("0,1,\n1,2,3\n"));
        assert_eq!(Series::parse("s.csv", "0,1,\n1,2,3\n").unwrap().width(), 2);
    }
}
