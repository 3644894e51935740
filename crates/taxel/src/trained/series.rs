//! Numbers at times of their own, and their values at other times.

use crate::InputError;

/// Rows of numbers with rising times.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    times: Vec<f64>,
    rows: Vec<Vec<f64>>,
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
        (rising && even && finite && times.len() == rows.len()).then_some(Self { times, rows })
    }

    /// Reads comma-separated numbers without a header, the time in seconds
    /// first. The cell `nan` is a missing reading.
    ///
    /// # Errors
    /// [`InputError`] at the first cell that is no number, the first row of
    /// another length, the first time that does not rise.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let mut series = Self {
            times: Vec::new(),
            rows: Vec::new(),
        };
        for (line, content) in (1..).zip(text.lines()) {
            if !content.trim().is_empty() {
                series.read_line(file, line, content)?;
            }
        }
        if series.times.len() < 2 {
            let found = series.times.len();
            return Err(InputError::whole(
                file,
                format!("{found} rows of numbers, at least 2 are needed"),
            )
            .help("give comma-separated numbers without a header, time in seconds first"));
        }
        Ok(series)
    }

    fn read_line(&mut self, file: &str, line: usize, content: &str) -> Result<(), InputError> {
        let mut row = Vec::new();
        let mut column = 1;
        for cell in content.split(',') {
            let number: Option<f64> = cell.trim().parse().ok();
            let valid = number.filter(|n| n.is_finite() || (n.is_nan() && !row.is_empty()));
            let Some(number) = valid else {
                let shown: String = cell.trim().chars().take(QUOTED).collect();
                let width = cell.chars().count();
                let message = format!("\"{shown}\" is not a finite number");
                return Err(
                    InputError::on_line(file, line, content, column, width, message).help(
                        "a row is the time in seconds and one number for each channel, or nan",
                    ),
                );
            };
            row.push(number);
            column += cell.chars().count() + 1;
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
        if let Some(last) = self.times.last()
            && row[0] <= *last
        {
            let message = format!("the time {} s does not come after {last} s", row[0]);
            let width = content.find(',').unwrap_or(width);
            return Err(InputError::on_line(file, line, content, 1, width, message)
                .help("times must rise from row to row"));
        }
        self.times.push(row[0]);
        self.rows.push(values);
        Ok(())
    }

    /// Times, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Rows, one per time.
    pub fn rows(&self) -> &[Vec<f64>] {
        &self.rows
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
    }

    #[test]
    fn mistakes_are_shown_in_their_place() {
        let message = |text: &str| Series::parse("s.csv", text).unwrap_err().to_string();
        assert!(message("0,1\n1,x2\n").starts_with("s.csv:2:3\n 2 | 1,x2\n   |   ^^\n\"x2\""));
        assert!(message("0,1\n1,2,3\n").contains("the row has 3 numbers, the first one has 2"));
        assert!(message("1,1\n1,2\n").contains("the time 1 s does not come after 1 s"));
        assert!(message("nan,1\n").contains("\"nan\" is not a finite number"));
        assert!(message("").contains("0 rows"));
        assert!(Series::parse("s.csv", "0,nan\n1,2").unwrap().rows()[0][0].is_nan());
    }
}
