//! Readings of a bench: CSV with units in the header, as people save it.

use std::collections::BTreeMap;

use crate::remark::Remark;
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::Dimension;
use taxel_ground::{InputError, separator_of};

/// A table of readings, with what was noticed while reading it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadingTable {
    /// Name of the file for messages.
    pub file: String,
    /// For each column of the calibrator whether it is there.
    pub given: Vec<bool>,
    /// A number (SI) or none for each column of the calibrator, row by row.
    rows: Vec<Vec<Option<f64>>>,
    /// Line of each row in the file, from 1.
    lines: Vec<usize>,
    /// Remarks on what was left out or corrected.
    pub remarks: Vec<Remark>,
}

/// End of a remark on a column that is almost one of the device's.
pub(crate) const MEANT: &str = " meant?)";
/// Name of the column that orders the rows.
pub const TIME: &str = "time";

/// A column that a table may have.
pub(crate) const fn column(name: &'static str, kind: LoadKind, about: &'static str) -> LoadColumn {
    LoadColumn {
        name,
        short: name,
        kind,
        required: false,
        about,
    }
}

/// A column of a quantity of this size at most, of either sign.
pub(crate) const fn quantity(
    name: &'static str,
    dimension: &'static Dimension,
    largest: f64,
    about: &'static str,
) -> LoadColumn {
    let range = [-largest, largest];
    column(name, LoadKind::Quantity(dimension, range), about)
}

/// A column of a quantity that is not negative.
pub(crate) const fn size(
    name: &'static str,
    dimension: &'static Dimension,
    largest: f64,
    about: &'static str,
) -> LoadColumn {
    column(name, LoadKind::Quantity(dimension, [0.0, largest]), about)
}

/// A column of a number without unit.
pub(crate) const fn number(name: &'static str, range: [f64; 2], about: &'static str) -> LoadColumn {
    column(name, LoadKind::Number(range), about)
}

/// A table `COLUMNS` of columns, each behind the name of the constant that is its place.
macro_rules! columns {
    ($($place:ident = $column:expr;)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms, reason = "names of constants")]
        enum Place {
            $($place),*
        }

        $(
            #[allow(dead_code, reason = "not every column is asked for by its place")]
            pub(super) const $place: usize = Place::$place as usize;
        )*

        pub(super) static COLUMNS: [LoadColumn; [$(stringify!($place)),*].len()] = [$($column),*];
    };
}
pub(crate) use columns;

/// The column that says which readings are held out.
pub(crate) const fn hold_out() -> LoadColumn {
    number("hold_out", [0.0, 1.0], "1 where a reading is held out")
}

/// A column that a table must have.
pub(crate) const fn required(column: LoadColumn) -> LoadColumn {
    LoadColumn {
        required: true,
        ..column
    }
}

impl ReadingTable {
    /// Reads a table; `file` is its name for messages. Commas, semicolons or
    /// tabs part the fields; after the latter two a number may have a decimal
    /// comma. Other columns than `columns` are left alone.
    ///
    /// A table may be wide: where `group` is a column of whole numbers, `voltage_3` is the
    /// column `voltage` of group 3, and each row has the readings of all groups.
    ///
    /// Repeated header rows, rows without a required value, rows out of the
    /// order of time, and second rows of one time (and one value of the column
    /// `group`, if there is one) are put right and remarked.
    ///
    /// # Errors
    /// For what cannot be read, with its line and column.
    pub fn parse(
        file: &str,
        text: &str,
        columns: &[LoadColumn],
        group: &str,
    ) -> Result<Self, InputError> {
        let text = text.trim_start_matches('\u{feff}');
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator_of(text))
            .comment(Some(b'#'))
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut table = Table {
            file,
            text,
            columns,
            group: columns
                .iter()
                .position(|column| column.name == group)
                .filter(|at| matches!(columns[*at].kind, LoadKind::Number(_))),
            header: Vec::new(),
            places: Vec::new(),
            decimal_comma: separator_of(text) != b',',
        };
        let mut data = Self {
            file: file.to_owned(),
            given: vec![false; columns.len()],
            rows: Vec::new(),
            lines: Vec::new(),
            remarks: Vec::new(),
        };
        for record in reader.records() {
            let record = record.map_err(|error| InputError::whole(file, error.to_string()))?;
            let begin = record.position().map_or(1, csv::Position::line) as usize;
            let line = begin + notes_after(text, begin);
            let fields: Vec<&str> = record.iter().collect();
            if table.header.is_empty() {
                table.head(line, &fields)?;
                for place in table.places.iter().flatten() {
                    data.given[place.column] = true;
                    if let (Some(_), Some(column)) = (place.group, table.group) {
                        data.given[column] = true;
                    }
                }
                if let Some(message) = table.unknown() {
                    data.remark(line, &message);
                }
            } else if fields == table.header {
                data.remark(line, "the header again; left out");
            } else if !fields.iter().all(|field| field.is_empty()) {
                data.take(&table, line, &fields)?;
            }
        }
        if data.rows.is_empty() {
            return Err(InputError::whole(file, "the table has no readings")
                .help("add one row per reading below the header"));
        }
        data.put_in_order(columns, group);
        data.gather_remarks();
        Ok(data)
    }

    fn remark(&mut self, line: usize, message: &str) {
        self.remarks.push(Remark::at(line, message));
    }

    fn take(&mut self, table: &Table<'_>, line: usize, fields: &[&str]) -> Result<(), InputError> {
        if fields.len() != table.header.len() {
            let message = format!(
                "this row has {} fields; the header has {}",
                fields.len(),
                table.header.len()
            );
            return Err(table.error(line, None, message, ""));
        }
        let mut common = vec![None; table.columns.len()];
        // What a wide table says of each group, by the number of the group.
        let mut groups: BTreeMap<u32, Vec<(usize, Option<f64>)>> = BTreeMap::new();
        for (at, (field, place)) in fields.iter().zip(&table.places).enumerate() {
            let Some(place) = place else { continue };
            let value = table.number(line, at, field, place)?;
            match place.group {
                None => common[place.column] = value,
                Some(group) => groups.entry(group).or_default().push((place.column, value)),
            }
        }
        let Some(column) = table.group.filter(|_| !groups.is_empty()) else {
            self.keep(table, line, common);
            return Ok(());
        };
        for (group, values) in groups {
            let mut row = common.clone();
            row[column] = Some(f64::from(group));
            for (column, value) in values {
                row[column] = value;
            }
            self.keep(table, line, row);
        }
        Ok(())
    }

    /// Keeps a row that has what it must have.
    fn keep(&mut self, table: &Table<'_>, line: usize, row: Vec<Option<f64>>) {
        let missing = |(column, value): (&LoadColumn, &Option<f64>)| {
            (column.required && value.is_none()).then_some(column.name)
        };
        if let Some(name) = table.columns.iter().zip(&row).find_map(missing) {
            self.remark(line, &format!("no {name}; the row is left out"));
            return;
        }
        self.rows.push(row);
        self.lines.push(line);
    }

    fn put_in_order(&mut self, columns: &[LoadColumn], group: &str) {
        let Some(time) = columns.iter().position(|column| column.name == TIME) else {
            return;
        };
        let group = columns.iter().position(|column| column.name == group);
        let key = |row: &[Option<f64>]| {
            let of = |column: usize| row[column].unwrap_or(0.0);
            [group.map_or(0.0, of), of(time)]
        };
        if !self.given[time] {
            return;
        }
        let mut order: Vec<usize> = (0..self.rows.len()).collect();
        order.sort_by(|a, b| {
            let (a, b) = (key(&self.rows[*a]), key(&self.rows[*b]));
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
        });
        let back = self.back_in_time(key);
        if let Some(first) = back.first() {
            let message = format!(
                "time goes back in the file at {} {}; the rows were put in order",
                back.len(),
                if back.len() == 1 { "place" } else { "places" }
            );
            self.remarks.push(Remark::at(*first, &message));
        }
        let mut rows: Vec<Vec<Option<f64>>> = Vec::with_capacity(order.len());
        let mut lines = Vec::with_capacity(order.len());
        for index in order {
            let row = &self.rows[index];
            if row[time].is_some() && rows.last().is_some_and(|last| key(last) == key(row)) {
                let message = "a second row of the same time; left out";
                self.remarks.push(Remark::at(self.lines[index], message));
                continue;
            }
            rows.push(row.clone());
            lines.push(self.lines[index]);
        }
        self.rows = rows;
        self.lines = lines;
    }

    /// Says once, at its first line, what holds for many.
    fn gather_remarks(&mut self) {
        let mut gathered: Vec<(Remark, usize)> = Vec::new();
        for remark in std::mem::take(&mut self.remarks) {
            match gathered
                .iter_mut()
                .find(|(other, _)| other.message == remark.message)
            {
                Some((first, count)) => {
                    first.line = first.line.min(remark.line);
                    *count += 1;
                }
                None => gathered.push((remark, 1)),
            }
        }
        let said = |(remark, count): (Remark, usize)| match count {
            1 => remark,
            _ => Remark::at(
                remark.line,
                &format!("{}; {count} times, from here on", remark.message),
            ),
        };
        self.remarks = gathered.into_iter().map(said).collect();
    }

    /// Lines at which time goes back within a group; groups may alternate.
    fn back_in_time(&self, key: impl Fn(&[Option<f64>]) -> [f64; 2]) -> Vec<usize> {
        let mut latest: Vec<[f64; 2]> = Vec::new();
        let mut back = Vec::new();
        for (row, line) in self.rows.iter().zip(&self.lines) {
            let [group, time] = key(row);
            match latest.iter_mut().find(|latest| latest[0] == group) {
                None => latest.push([group, time]),
                Some(latest) if time < latest[1] => back.push(*line),
                Some(latest) => latest[1] = time,
            }
        }
        back
    }

    /// Number of readings.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The number in a column of a row, SI.
    pub fn number(&self, row: usize, column: usize) -> Option<f64> {
        self.rows[row][column]
    }

    /// The number in a column of a row, if it is above zero.
    pub(crate) fn positive(&self, row: usize, column: usize) -> Option<f64> {
        self.number(row, column).filter(|value| *value > 0.0)
    }

    /// True if a column of a row has another number than zero.
    pub(crate) fn flag(&self, row: usize, column: usize) -> bool {
        self.number(row, column).is_some_and(|value| value != 0.0)
    }

    /// Line of a row in the file, from 1.
    pub fn line(&self, row: usize) -> usize {
        self.lines[row]
    }

    /// An error about the file as a whole, at a column.
    pub fn error(&self, column: &str, message: impl Into<String>, help: &str) -> InputError {
        InputError::whole(&self.file, message)
            .key(column)
            .help(help)
    }
}

/// The file while it is read.
struct Table<'a> {
    file: &'a str,
    text: &'a str,
    columns: &'a [LoadColumn],
    /// The column of the group, where groups have whole numbers.
    group: Option<usize>,
    header: Vec<String>,
    /// For each field of a row the column that it is, if it is one.
    places: Vec<Option<Place>>,
    decimal_comma: bool,
}

struct Place {
    column: usize,
    /// Of a wide table: the group whose column it is.
    group: Option<u32>,
    /// SI value of its unit; 1 for a plain number.
    scale: f64,
}

impl Table<'_> {
    fn head(&mut self, line: usize, fields: &[&str]) -> Result<(), InputError> {
        self.header = fields.iter().map(|&field| field.to_owned()).collect();
        for (at, title) in fields.iter().enumerate() {
            let place = self
                .place(title)
                .map_err(|(message, help)| self.error(line, Some(at), message, &help))?;
            let twice = place.as_ref().is_some_and(|place| {
                let same = |other: &Place| {
                    other.column == place.column
                        && (other.group == place.group
                            || other.group.is_none()
                            || place.group.is_none())
                };
                self.places.iter().flatten().any(same)
            });
            if twice {
                return Err(self.error(line, Some(at), "this column appears twice".into(), ""));
            }
            self.places.push(place);
        }
        let wide = self
            .places
            .iter()
            .flatten()
            .any(|place| place.group.is_some());
        let grouped = |place: &Option<Place>| {
            let place = place.as_ref();
            place.is_some_and(|place| Some(place.column) == self.group)
        };
        if let (true, Some(at)) = (wide, self.places.iter().position(grouped)) {
            let message = "this column and columns of each group";
            let help =
                "remove one of them: in a wide table the columns say of which group they are";
            return Err(self.error(line, Some(at), message.into(), help));
        }
        let there = |name: &str| {
            let named = |place: &Place| self.columns[place.column].name == name;
            let group = self.group.is_some_and(|at| self.columns[at].name == name);
            self.places.iter().flatten().any(named) || wide && group
        };
        let missing = self.columns.iter().find(|c| c.required && !there(c.name));
        if let Some(column) = missing {
            let all: Vec<String> = self.columns.iter().map(LoadColumn::title).collect();
            let help = format!("columns of this device are: {}", all.join(", "));
            let message = format!("column {} is missing", column.title());
            return Err(self.error(line, None, message, &help));
        }
        Ok(())
    }

    /// The columns that are none of the device's, in words; each beside the column of the
    /// device whose name is almost the same.
    fn unknown(&self) -> Option<String> {
        let titles = self.header.iter().zip(&self.places);
        let unknown = titles.filter(|(title, place)| place.is_none() && !title.is_empty());
        let words: Vec<String> = unknown
            .map(|(title, _)| {
                let name = title.split('[').next().unwrap_or_default();
                let free = self.columns.iter().enumerate().filter(|(at, _)| {
                    let taken = |place: &Place| place.column == *at;
                    !self.places.iter().flatten().any(taken)
                });
                let near = free
                    .map(|(_, column)| (letters_between(name, column.name), column))
                    .filter(|(letters, _)| *letters <= ALMOST)
                    .min_by_key(|(letters, _)| *letters);
                match near {
                    Some((_, column)) => format!("{title} (is {}{MEANT}", column.title()),
                    None => title.clone(),
                }
            })
            .collect();
        let [is, a] = match words.len() {
            0 => return None,
            1 => ["is no column", ""],
            _ => ["are no columns", "s"],
        };
        let list = words.join(", ");
        Some(format!("column{a} {list} {is} of this device; not used"))
    }

    /// The column that a title names; what is wrong with it and what to do.
    fn place(&self, title: &str) -> Result<Option<Place>, (String, String)> {
        let (name, rest) = title.split_once('[').unwrap_or((title, ""));
        let unit = rest.trim_end().trim_end_matches(']').trim();
        let name = name.trim();
        let known = |name: &str| self.columns.iter().position(|column| column.name == name);
        let of_group = || {
            let (name, group) = name.rsplit_once('_')?;
            let group = group.parse::<u32>().ok().filter(|_| self.group.is_some())?;
            Some((known(name)?, Some(group)))
        };
        let Some((column, group)) = known(name).map(|column| (column, None)).or_else(of_group)
        else {
            return Ok(None);
        };
        let scale = match (self.columns[column].kind, unit) {
            (LoadKind::Quantity(dimension, _), "") => {
                let help = format!(
                    "write {name} [{}]; units: {}",
                    dimension.si,
                    dimension.symbols()
                );
                return Err(("this column has no unit".into(), help));
            }
            (LoadKind::Quantity(dimension, _), unit) => scale(dimension, unit)?,
            (_, "") => 1.0,
            (_, unit) => {
                let message = format!("this column is of plain numbers, not of [{unit}]");
                return Err((message, format!("write {name}")));
            }
        };
        Ok(Some(Place {
            column,
            group,
            scale,
        }))
    }

    fn number(
        &self,
        line: usize,
        at: usize,
        field: &str,
        place: &Place,
    ) -> Result<Option<f64>, InputError> {
        if field.is_empty() || field == "-" || field.eq_ignore_ascii_case("nan") {
            return Ok(None);
        }
        let plain = if self.decimal_comma && !field.contains('.') {
            field.replace(',', ".")
        } else {
            field.to_owned()
        };
        let value: Option<f64> = plain.parse().ok().filter(|value: &f64| value.is_finite());
        let Some(value) = value else {
            let message = format!("\"{field}\" is not a number");
            let help = "write 1.5; after semicolons or tabs also 1,5; leave a gap empty";
            return Err(self.error(line, Some(at), message, help));
        };
        // Dividing by a whole number is exact where multiplying by its
        // reciprocal is not.
        let value = if place.scale < 1.0 {
            value / (1.0 / place.scale).round()
        } else {
            value * place.scale
        };
        let (range, unit) = match self.columns[place.column].kind {
            LoadKind::Quantity(dimension, range) => (range, dimension.si),
            LoadKind::Number(range) => (range, ""),
            LoadKind::Word(_) => ([f64::NEG_INFINITY, f64::INFINITY], ""),
        };
        if !(range[0]..=range[1]).contains(&value) {
            let [low, high] = range;
            let message = format!("{field} is out of range: must be from {low} to {high} {unit}");
            return Err(self.error(line, Some(at), message, "correct or remove it"));
        }
        Ok(Some(value))
    }

    fn error(&self, line: usize, at: Option<usize>, message: String, help: &str) -> InputError {
        let text = self.text.lines().nth(line.saturating_sub(1)).unwrap_or("");
        let title = at.and_then(|at| self.header.get(at));
        let [column, width] = match at {
            Some(at) => field_of(text, char::from(separator_of(self.text)), at),
            None => [1, text.chars().count()],
        };
        InputError::on_line(self.file, line, text, column, width, message)
            .key(title.map_or("", String::as_str))
            .help(help)
    }
}

/// Column, from 1, and width of a field of a line; a separator between quotes parts nothing.
fn field_of(line: &str, separator: char, field: usize) -> [usize; 2] {
    let mut quoted = false;
    let mut fields = line.split(|c| {
        quoted ^= c == '"';
        c == separator && !quoted
    });
    let before: usize = fields
        .by_ref()
        .take(field)
        .map(|text| text.chars().count() + 1)
        .sum();
    let text = fields.next().unwrap_or_default();
    let blank = text.chars().take_while(|c| c.is_whitespace()).count();
    [1 + before + blank, text.trim().chars().count().max(1)]
}

/// Names that differ by so many letters are almost the same.
const ALMOST: usize = 2;

/// Letters to write, leave out or exchange to make one name of another; capitals, spaces,
/// hyphens and underscores do not count.
fn letters_between(one: &str, other: &str) -> usize {
    let plain = |name: &str| -> Vec<char> {
        let letters = name.chars().filter(|c| c.is_alphanumeric());
        letters.flat_map(char::to_lowercase).collect()
    };
    let (one, other) = (plain(one), plain(other));
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (i, a) in one.iter().enumerate() {
        let mut corner = std::mem::replace(&mut row[0], i + 1);
        for (j, b) in other.iter().enumerate() {
            let exchanged = corner + usize::from(a != b);
            corner = row[j + 1];
            row[j + 1] = exchanged.min(corner + 1).min(row[j] + 1);
        }
    }
    row[other.len()]
}

/// Comments and blank lines from line `begin` on: a record begins where the one
/// before it has ended.
fn notes_after(text: &str, begin: usize) -> usize {
    let lines = text.lines().skip(begin.saturating_sub(1));
    let note = |line: &&str| line.starts_with('#') || line.is_empty();
    lines.take_while(note).count()
}

fn scale(dimension: &Dimension, unit: &str) -> Result<f64, (String, String)> {
    dimension.unit(unit).ok_or_else(|| {
        let what = dimension.name.trim_start_matches("a ");
        let help = format!("use one of: {}", dimension.symbols());
        (format!("\"{unit}\" is not a unit of {what}"), help)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel::quantity::{FORCE, LENGTH, TIME as SECONDS};

    static COLUMNS: [LoadColumn; 3] = [
        column("time", LoadKind::Quantity(&SECONDS, [-1e9, 1e9]), ""),
        required(quantity("force_z", &FORCE, 1e3, "")),
        column("gap", LoadKind::Quantity(&LENGTH, [0.0, 1.0]), ""),
    ];

    fn parse(text: &str) -> Result<ReadingTable, InputError> {
        ReadingTable::parse("bench.csv", text, &COLUMNS, "gap")
    }

    #[test]
    fn what_people_save_is_read() {
        let text = "# note\ntime [s];note;force_z [mN]\n1,5;a;2,5\ntime [s];note;force_z [mN]\n\
                    0,5;b;1\n2;c;\n;;\n0,5;d;9\n";
        let data = parse(text).unwrap();
        let forces: Vec<_> = (0..data.len()).map(|row| data.number(row, 1)).collect();
        assert_eq!(forces, [Some(1e-3), Some(2.5e-3)]);
        let lines: Vec<_> = data.remarks.iter().map(|remark| remark.line).collect();
        // A column of one's own, the header again, no force, out of order, twice.
        assert_eq!(lines, [2, 4, 6, 5, 8]);
        assert_eq!(data.given, [true, true, false]);
    }

    #[test]
    fn a_column_that_is_not_used_is_named() {
        let remark = |text: &str| -> String {
            let data = parse(text).unwrap();
            data.remarks.iter().map(ToString::to_string).collect()
        };
        assert_eq!(
            remark("force_z [mN],Gapp [um]\n1,2\n"),
            "line 1: column Gapp [um] (is gap [m] meant?) is no column of this device; not used"
        );
        assert_eq!(
            remark("force_z [mN],by,Time\n1,2,3\n"),
            "line 1: columns by, Time (is time [s] meant?) are no columns of this device; not used"
        );
        // A column that is there is not what another one means.
        assert_eq!(
            remark("force_z [mN],force_x [mN]\n1,2\n"),
            "line 1: column force_x [mN] is no column of this device; not used"
        );
        assert_eq!(remark("force_z [mN]\n1\n"), "");
        // What holds for many rows is said once.
        assert_eq!(
            remark("time [s],force_z [mN]\n1,1\n2,1\n1,1\n2,1\n3,\n3,1\n3,1\n3,1\n"),
            "line 6: no force_z; the row is left outline 4: time goes back in the file at 1 place; the rows were put in order\
             line 4: a second row of the same time; left out; 4 times, from here on"
        );
        assert_eq!(letters_between("force z", "Force_Z"), 0);
        assert_eq!(letters_between("capacitance_12", "capacitence12"), 1);
    }

    #[test]
    fn a_line_is_found_below_comments_and_blank_lines() {
        let line = |text: &str| parse(text).unwrap_err().place.unwrap().line;
        assert_eq!(line("# a\n# b\n\nforce_z [mm]\n1\n"), 4);
        assert_eq!(line("# a\nforce_z [N]\n1\n# b\n\n# c\nx\n2\n"), 7);
    }

    #[test]
    fn two_groups_may_have_the_same_times() {
        let data =
            parse("time [s],gap [um],force_z [N]\n0,20,1\n0,50,2\n1,20,3\n1,50,4\n").unwrap();
        assert_eq!((data.len(), data.remarks.len()), (4, 0));
    }

    #[test]
    fn a_wide_table_is_that_of_its_groups() {
        static CHANNELS: [LoadColumn; 4] = [
            column("time", LoadKind::Quantity(&SECONDS, [-1e9, 1e9]), ""),
            required(number("channel", [0.0, 10.0], "")),
            required(quantity("force_z", &FORCE, 1e3, "")),
            quantity("displacement", &LENGTH, 1.0, ""),
        ];
        let parse = |text: &str| ReadingTable::parse("bench.csv", text, &CHANNELS, "channel");
        let wide = "time [s],force_z [N],displacement_2 [mm],displacement_0 [mm]\n\
                    0,1,3,\n1,2,5,4\n";
        let long = "time [s],channel,force_z [N],displacement [mm]\n\
                    0,0,1,\n1,0,2,4\n0,2,1,3\n1,2,2,5\n";
        let [wide, long] = [wide, long].map(|text| parse(text).unwrap());
        assert_eq!((wide.rows, wide.given), (long.rows, long.given));
        // Of both forms, one is meant.
        for text in [
            "channel,force_z [N],displacement_2 [mm]\n0,1,2\n",
            "force_z [N],displacement [mm],displacement_2 [mm]\n0,1,2\n",
        ] {
            let error = parse(text).unwrap_err();
            assert!(
                error.message.contains("of each group") || error.message.contains("twice"),
                "{error}"
            );
        }
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        for (text, message) in [
            ("", "no readings"),
            ("force_z [N]\n", "no readings"),
            ("time [s]\n1\n", "force_z [N] is missing"),
            ("force_z\n1\n", "no unit"),
            ("force_z [mm]\n1\n", "not a unit of force"),
            ("force_z [N],force_z [mN]\n1,1\n", "twice"),
            ("force_z [N]\nx\n", "\"x\" is not a number"),
            ("force_z [N]\n1e9\n", "out of range"),
            ("force_z [N],a\n1\n", "1 fields; the header has 2"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.message.contains(message), "{text}: {error}");
        }
        // The place is that of the field.
        let place = |text: &str| {
            let place = parse(text).unwrap_err().place.unwrap();
            [place.line, place.column, place.width]
        };
        assert_eq!(place("time [s], force_z [mm]\n1,1\n"), [1, 11, 12]);
        assert_eq!(place("\"time [s]\",\"a,b\",force_z\n1,1,1\n"), [1, 18, 7]);
        assert_eq!(place("time [s],force_z [N]\n1,abc\n"), [2, 3, 3]);
    }
}
