//! Tables of loads: CSV with units in the header.

use crate::input::InputError;
use crate::quantity::FORCE;

/// A table of loads with all its columns, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// Header of the file.
    pub header: Vec<String>,
    /// One load per row.
    pub rows: Vec<Load>,
}

/// One row of a table of loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Load {
    /// All fields as they are in the file.
    pub fields: Vec<String>,
    /// Force x, y, pressing, N.
    pub force: [f64; 3],
}

/// Names of the force columns.
const COLUMNS: [&str; 3] = ["force_x", "force_y", "force_z"];
/// Largest force that is taken for a force on a taxel, N.
const LARGEST: f64 = 1e3;
const EXAMPLE: &str = "the header must name force_x, force_y and force_z with their unit, \
                       such as: force_x [mN],force_y [mN],force_z [mN]";

impl Loads {
    /// Reads a table; `file` is its name for messages. Columns other than the
    /// forces are kept and passed on.
    ///
    /// # Errors
    /// The first mistake, with its line and column.
    ///
    /// # Example
    /// ```
    /// let text = "name,force_x [mN],force_y [mN],force_z [mN]\npress,0,0,5\n";
    /// let loads = taxel::loads::Loads::parse("loads.csv", text)?;
    /// assert_eq!(loads.rows[0].force, [0.0, 0.0, 5e-3]);
    /// # Ok::<(), taxel::InputError>(())
    /// ```
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let text = text.trim_start_matches('\u{feff}');
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let header: Vec<String> = match reader.headers() {
            Ok(header) => header.iter().map(str::to_owned).collect(),
            Err(error) => return Err(InputError::whole(file, error.to_string())),
        };
        let columns = find_columns(file, text, &header)?;
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| InputError::whole(file, error.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line) as usize;
            let row = Row {
                file,
                text: line_text(text, line),
                line,
                header: &header,
            };
            if record.len() != header.len() {
                let message = format!(
                    "this row has {} fields; the header has {}",
                    record.len(),
                    header.len()
                );
                return Err(row.error(0, &message));
            }
            let mut force = [0.0; 3];
            for (value, (column, unit)) in force.iter_mut().zip(columns) {
                *value = row.force(column, &record[column], unit)?;
            }
            rows.push(Load {
                fields: record.iter().map(str::to_owned).collect(),
                force,
            });
        }
        if rows.is_empty() {
            return Err(InputError::whole(file, "the table has no loads")
                .help("add one row per load below the header"));
        }
        Ok(Self { header, rows })
    }

    /// Reads one load of the command line: `"fx=1 mN, fz=5 mN"`; axes that are
    /// not named are zero.
    ///
    /// # Errors
    /// The mistake, as an error of the "file" `--load`.
    pub fn parse_one(spec: &str) -> Result<[f64; 3], InputError> {
        let mut force = [None; 3];
        let mut at = 0;
        for part in spec.split(',') {
            let span = at + part.len() - part.trim_start().len()..at + part.trim_end().len();
            at += part.len() + 1;
            let error = |message: String, help: &str| {
                InputError::at("--load", spec, span.clone(), message).help(help)
            };
            let form = "write axes with units, such as \"fx=1 mN, fz=5 mN\"";
            let Some((axis, value)) = part.split_once('=') else {
                return Err(error(
                    format!("\"{}\" is no force of an axis", part.trim()),
                    form,
                ));
            };
            let axis = ["fx", "fy", "fz"]
                .iter()
                .position(|name| *name == axis.trim());
            let Some(axis) = axis else {
                return Err(error("the axes are fx, fy and fz".into(), form));
            };
            let value = FORCE.parse(value).map_err(|message| {
                let (message, help) = message
                    .split_once(crate::quantity::HELP)
                    .unwrap_or((&message, form));
                error(message.into(), help.trim())
            })?;
            if value.abs() > LARGEST {
                return Err(error(
                    format!("{value} N is out of range: at most {LARGEST} N"),
                    form,
                ));
            }
            if force[axis].replace(value).is_some() {
                return Err(error("this axis is given twice".into(), form));
            }
        }
        Ok(force.map(|value| value.unwrap_or(0.0)))
    }
}

/// Position and unit (SI) of the three force columns.
fn find_columns(
    file: &str,
    text: &str,
    header: &[String],
) -> Result<[(usize, f64); 3], InputError> {
    let row = Row {
        file,
        text: line_text(text, 1),
        line: 1,
        header,
    };
    let mut found = [None; 3];
    for (column, title) in header.iter().enumerate() {
        let (name, unit) = split_title(title);
        let Some(axis) = COLUMNS.iter().position(|wanted| *wanted == name) else {
            continue;
        };
        let Some(unit) = unit else {
            return Err(row.error(column, "this column has no unit").help(EXAMPLE));
        };
        let Some(scale) = FORCE.unit(unit) else {
            let message = format!("\"{unit}\" is not a unit of force");
            return Err(row
                .error(column, &message)
                .help(format!("use one of: {}", FORCE.symbols())));
        };
        if found[axis].replace((column, scale)).is_some() {
            return Err(row.error(column, "this column appears twice"));
        }
    }
    let missing = COLUMNS.iter().zip(found).find(|(_, found)| found.is_none());
    if let Some((name, _)) = missing {
        let error =
            InputError::on_line(file, 1, row.text, 1, 1, format!("column {name} is missing"));
        return Err(error.key(*name).help(EXAMPLE));
    }
    Ok(found.map(|found| found.unwrap_or((0, 1.0))))
}

/// `force_x [mN]` to its name and unit.
fn split_title(title: &str) -> (&str, Option<&str>) {
    match title.split_once('[') {
        Some((name, rest)) => (
            name.trim(),
            rest.split_once(']').map(|(unit, _)| unit.trim()),
        ),
        None => (title.trim(), None),
    }
}

struct Row<'a> {
    file: &'a str,
    text: &'a str,
    line: usize,
    header: &'a [String],
}

impl Row<'_> {
    fn force(&self, column: usize, field: &str, unit: f64) -> Result<f64, InputError> {
        let value: f64 = field.parse().map_err(|_| {
            self.error(column, &format!("\"{field}\" is not a number"))
                .help("write numbers with a decimal point, such as 1.5")
        })?;
        let force = if unit < 1.0 {
            value / (1.0 / unit).round()
        } else {
            value * unit
        };
        if !force.is_finite() || force.abs() > LARGEST {
            let message = format!(
                "{field} is out of range: a force must be a number from -{LARGEST} N to {LARGEST} N"
            );
            return Err(self
                .error(column, &message)
                .help("correct or remove this row"));
        }
        Ok(force)
    }

    fn error(&self, column: usize, message: &str) -> InputError {
        // Fields in quotes with commas would move the caret; then the whole
        // line is marked.
        let plain = !self.text.contains('"');
        let parts: Vec<&str> = self.text.split(',').collect();
        let (start, width) = match parts.get(column) {
            Some(part) if plain => {
                let before: usize = parts[..column].iter().map(|p| p.chars().count() + 1).sum();
                (before + 1, part.chars().count())
            }
            _ => (1, self.text.chars().count()),
        };
        let key = self.header.get(column).map_or("", String::as_str);
        InputError::on_line(self.file, self.line, self.text, start, width, message).key(key)
    }
}

fn line_text(text: &str, line: usize) -> &str {
    text.lines().nth(line.saturating_sub(1)).unwrap_or("")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> InputError {
        Loads::parse("loads.csv", text).unwrap_err()
    }

    #[test]
    fn mistakes_name_line_and_column() {
        let head = "force_x [mN],force_y [mN],force_z [mN]\n";
        let wrong = error(&format!("{head}0,0,1\n0,nan,1\n"));
        assert_eq!(
            (wrong.place.as_ref().unwrap().line, wrong.key.as_str()),
            (3, "force_y [mN]")
        );
        assert_eq!(wrong.place.unwrap().column, 3);
        assert!(
            error(&format!("{head}0,1\n"))
                .message
                .contains("2 fields; the header has 3")
        );
        assert!(
            error(&format!("{head}0,x,1\n"))
                .message
                .contains("\"x\" is not a number")
        );
        assert!(
            error(&format!("{head}0,0,1e9\n"))
                .message
                .contains("out of range")
        );
        assert!(error(head).message.contains("no loads"));
        assert!(
            error("force_x [mN],force_y [mN]\n")
                .message
                .contains("force_z is missing")
        );
        assert!(
            error("force_x [mm],force_y [mN],force_z [mN]\n")
                .help
                .contains("mN")
        );
        assert!(
            error("force_x,force_y [mN],force_z [mN]\n")
                .message
                .contains("no unit")
        );
        assert!(error("").message.contains("missing"));
    }

    #[test]
    fn one_load_of_the_command_line() {
        assert_eq!(
            Loads::parse_one("fz=5 mN, fx = -1 uN"),
            Ok([-1e-6, 0.0, 5e-3])
        );
        for wrong in [
            "",
            "fz",
            "fq=1 mN",
            "fz=1",
            "fz=1 mm",
            "fz=1 mN,fz=2 mN",
            "fz=1e9 N",
        ] {
            assert!(Loads::parse_one(wrong).is_err(), "{wrong}");
        }
    }
}
