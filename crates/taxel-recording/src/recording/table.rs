//! Tables of other programs: rows of numbers, with names above them or without, whose columns are
//! recognised or named by the user ([`Columns`]).

use std::collections::VecDeque;
use std::io::BufRead;

use super::channels::{END, base_name, is_comment};
use super::columns::{Columns, Taken};
use super::lines::{Dialect, Lines, is_missing, quote, scaled_integer};
use super::remarks::Remarks;
use super::roles::{Facts, Otherwise, Roles, TimeForm, decide};
use super::{Change, Opened, RecordingError};
use crate::frame::{Frame, Stream};
use taxel_ground::InputError;

/// Rows whose numbers tell what the columns are: enough that a reading which only happens to rise
/// all the time has a probability below 10⁻⁸⁰.
const LOOKED_AT: usize = 64;

#[derive(Debug)]
pub(super) struct Decoder {
    dialect: Dialect,
    names: Vec<String>,
    /// The line above the rows, which may stand in the file again.
    header: Option<String>,
    roles: Roles,
    /// What the last row gave, for columns that give nothing of their own.
    row: u64,
    /// Time of the first row where it is negative, ns: times count from it.
    origin_ns: Option<i128>,
    changes: VecDeque<Change>,
}

/// What a table is, before it is decided what its columns are.
pub(super) struct Layout {
    dialect: Dialect,
    names: Vec<String>,
    header: Option<String>,
    facts: Vec<Facts>,
    /// Rows per second, where the head says that they have no times.
    rate: Option<f64>,
    /// Lines before the first row of numbers.
    before: usize,
}

impl Layout {
    /// The layout of a table that begins with the next line; `comment` is the line of a comment
    /// before it. `None` if these are no rows of numbers.
    pub(super) fn of<R: BufRead>(lines: &mut Lines<R>, comment: &str) -> Option<Self> {
        let mut ahead = lines.look(LOOKED_AT);
        let (dialect, at) =
            Dialect::of_table(&ahead, 2).or_else(|| Dialect::of_table(&ahead, 1))?;
        let rate = rate_of_labview(&ahead);
        let width = |line: &str| dialect.fields(line).count();
        let rows = ahead.split_off(at);
        let mut columns = width(&rows[0]);
        let named = |line: &str| {
            let fields = dialect.fields(line);
            let mut fields: Vec<_> = fields.map(|field| field.text().into_owned()).collect();
            // LabVIEW names times that it does not save, and a column of comments that no row has.
            if rate.is_some() && fields.len() > columns && fields[0] == "X_Value" {
                fields.remove(0);
            }
            if fields.len() == columns + 1 && fields[columns] == "Comment" {
                fields.pop();
            }
            let number = |text: &String| dialect.clone().number(text).is_some();
            (fields.len() == columns && !fields.iter().all(number)).then_some(fields)
        };
        // A comment may hold the names, as NumPy writes them.
        // A quotation mark before the sign of a comment is of the whole line, any other of a name.
        let bare = |line: &str| {
            let inner = line.trim_start_matches([' ', '"']);
            if inner.starts_with(['#', '%']) {
                inner.trim_start_matches(['#', '%', ' ', '"']).to_owned()
            } else {
                line.to_owned()
            }
        };
        let mut heads: Vec<_> = std::iter::once(comment.to_owned())
            .chain(ahead.iter().filter(|line| !dialect.is_blank(line)).cloned())
            .filter_map(|line| named(&bare(&line)).map(|fields| (fields, line)))
            .collect();
        let mut header = None;
        let mut names = vec![String::new(); columns];
        if let Some((last, line)) = heads.pop() {
            header = Some(line);
            // A second line of names that are all units says the units of the first.
            let is_unit = |text: &String| {
                let text = text.trim_matches(['[', ']', '(', ')']);
                text.is_empty()
                    || super::units::find(text).is_some()
                    || super::columns::time_power(text).is_some()
            };
            match heads.pop() {
                Some((first, _)) if last.iter().all(is_unit) => {
                    let joined = |(name, unit): (String, &String)| {
                        let unit = unit.trim_matches(['[', ']', '(', ')']);
                        if unit.is_empty() {
                            name
                        } else {
                            format!("{name} [{unit}]")
                        }
                    };
                    names = first.into_iter().zip(&last).map(joined).collect();
                }
                _ => names = last,
            }
        } else {
            // Without names a spreadsheet's empty fields behind all rows are no columns.
            let filled = |line: &String| {
                let fields = dialect.fields(line).enumerate();
                fields
                    .filter(|(_, field)| !field.raw.is_empty())
                    .last()
                    .map_or(0, |(at, _)| at + 1)
            };
            columns = rows.first().map_or(0, filled);
            names.truncate(columns);
        }
        let mut facts = vec![Facts::default(); columns];
        let mut numbers = dialect.clone();
        let again = |row: &&String| header.as_ref() != Some(*row);
        for row in rows
            .iter()
            .take_while(again)
            .filter(|row| !dialect.is_blank(row) && !is_passed(row))
        {
            for (facts, field) in facts.iter_mut().zip(dialect.fields(row)) {
                facts.cell(&field.text(), &mut numbers);
            }
        }
        Some(Self {
            dialect,
            names,
            header,
            facts,
            rate,
            before: at,
        })
    }

    /// True if no line names the columns.
    pub(super) fn is_bare(&self) -> bool {
        self.header.is_none()
    }

    /// What the columns are.
    pub(super) fn open<R: BufRead>(
        self,
        lines: &mut Lines<R>,
        columns: &Columns,
        otherwise: Otherwise,
        remarks: &Remarks,
    ) -> Result<Opened, RecordingError> {
        // Mistakes are those of the line above the rows, or of the first row.
        for _ in 0..self.before.max(1) {
            lines.advance()?;
        }
        let wrong = |(message, help): (String, String)| lines.line_error(message).help(help);
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let said = columns.rate();
        let columns = &columns.at_rate(self.rate);
        let mut roles = decide(&names, &self.facts, columns, otherwise, 0).map_err(wrong)?;
        if let Some(rate) = columns.rate().filter(|_| said.is_none()) {
            roles.taken.time = format!("none; frames come at {rate} Hz by the Delta_X of the file");
        }
        let mut stream = Stream {
            name: base_name(lines.file()).to_owned(),
            rows: roles.shape[0],
            columns: roles.shape[1],
            channels_per_taxel: roles.shape[2],
            unit: roles.unit.clone(),
            pitch: None,
            period: columns.rate().map(f64::recip),
            threshold: None,
            present: vec![true; roles.values.len()],
        };
        let si_per_number = remarks
            .complete(&mut stream)
            .map_err(|message| lines.line_error(message))?;
        if stream.unit != roles.unit {
            for (_, scale) in &mut roles.values {
                *scale = si_per_number;
            }
            roles.taken.values = format!(
                "{}, a number is {si_per_number} SI units by a comment",
                roles.taken.values
            );
        }
        if self.before == 0 {
            lines.again();
        }
        Ok(Opened {
            sensors: vec![stream.name.clone()],
            stream,
            decoder: super::Decoder::Table(Box::new(Decoder {
                dialect: self.dialect,
                names: self.names,
                header: self.header,
                roles,
                row: 0,
                origin_ns: None,
                changes: VecDeque::new(),
            })),
        })
    }
}

/// Rows per second of a file of LabVIEW whose head says that it saves no times: the step of the times is
/// in the head.
fn rate_of_labview(head: &[String]) -> Option<f64> {
    let value = |key: &str| {
        let mut lines = head.iter().rev().map(|line| line.split(['\t', ',', ';']));
        lines.find_map(|mut fields| (fields.next()?.trim() == key).then(|| fields.next())?)
    };
    let step = value("Delta_X").filter(|_| value("X_Columns").map(str::trim) == Some("No"))?;
    let step: f64 = step.trim().replace(',', ".").parse().ok()?;
    (step > 0.0 && step.is_finite()).then(|| step.recip())
}

/// True for a line that is no row: a comment.
fn is_passed(line: &str) -> bool {
    is_comment(line) || line.trim_start().starts_with(['%', '/'])
}

impl Decoder {
    pub(super) fn taken(&self) -> Taken {
        let mut taken = self.roles.taken.clone();
        let separator = self.dialect.separator_name();
        let of = if self.header.is_some() {
            "names above them"
        } else {
            "no names"
        };
        taken.time = format!("{} (columns between {separator}, {of})", taken.time);
        taken
    }

    pub(super) fn take_changes(&mut self) -> VecDeque<Change> {
        std::mem::take(&mut self.changes)
    }

    pub(super) fn read<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
    ) -> Result<Option<Frame>, RecordingError> {
        loop {
            if !lines.advance_to_row(&self.dialect)? {
                return Ok(None);
            }
            let text = lines.text();
            if self.header.as_deref() == Some(text) {
                // The logger was started again into the same file.
                if self.row > 0 {
                    self.changes.push_back(Change::Reconnected);
                }
                self.origin_ns = None;
            } else if !is_passed(text) || text.starts_with(END) && self.row == 0 {
                break;
            }
        }
        let expected = self.names.len();
        let all = self.dialect.fields(lines.text()).count();
        let rest = self.dialect.fields(lines.text()).skip(expected);
        let padding = rest.take_while(|field| field.raw.is_empty()).count();
        let found = all - padding;
        if found != expected {
            let error = lines.line_error(format!(
                "the row has {found} numbers, the first one has {expected}"
            ));
            let error = error.help("every row has one number for each column");
            return Err(if found < expected {
                lines.fault(error)
            } else {
                error.into()
            });
        }
        let frame = self.frame(lines)?;
        self.row += 1;
        Ok(Some(frame))
    }

    fn frame<R: BufRead>(&mut self, lines: &Lines<R>) -> Result<Frame, RecordingError> {
        let columns = self.names.len();
        let dialect = self.dialect.clone();
        let fields: Vec<_> = dialect.fields(lines.text()).take(columns).collect();
        let wrong = |at: usize, what: &str, hint: &str| -> RecordingError {
            let field = &fields[at];
            let message = format!("{} is not {what}", quote(&field.text()));
            let error: InputError = lines.error_at(field.raw, message).help(hint);
            // Only the last field of a line can have been cut.
            if at + 1 == columns {
                lines.fault(error)
            } else {
                error.into()
            }
        };
        let mut frame = Frame {
            sequence: self.row,
            time_ns: (self.row as f64 * 1e9 / self.roles.rate).round() as u64,
            values: Vec::with_capacity(self.roles.values.len()),
            ..Frame::default()
        };
        if let Some((at, form)) = self.roles.time {
            let text = fields[at].text();
            let time = match form {
                TimeForm::Date => super::lines::date_time(&text).map(i128::from),
                TimeForm::Number(power) => self.dialect.decimal(&text).and_then(|text| {
                    let (sign, text) = match text.strip_prefix('-') {
                        Some(text) => (-1, text),
                        None => (1, &*text),
                    };
                    Some(sign * i128::from(scaled_integer(text, power)?))
                }),
            };
            let time = time.ok_or_else(|| wrong(at, "a time", self.dialect.number_hint()))?;
            // A trigger may stand at 0 and the rows before it below.
            let origin = *self.origin_ns.get_or_insert(time.min(0));
            let hint = "the first row has the earliest time";
            frame.time_ns = u64::try_from(time - origin)
                .map_err(|_| wrong(at, "a time behind that of the first row", hint))?;
        }
        if let Some(at) = self.roles.sequence {
            let text = fields[at].text();
            let number = self.dialect.scaled_integer(&text, 0);
            frame.sequence = number.ok_or_else(|| {
                wrong(
                    at,
                    "a running number",
                    "allowed is a whole number of 0 or more",
                )
            })?;
        }
        for (at, scale) in &self.roles.values {
            let text = fields[*at].text();
            let cut = !lines.terminated() && *at + 1 == columns && text.is_empty();
            let value = if is_missing(&text) && !cut {
                f64::NAN
            } else {
                let quoted = fields[*at].raw.starts_with('"');
                let number = self
                    .dialect
                    .number(&text)
                    .filter(|_| !(quoted && is_doubtful(&text)));
                let value = number
                    .map(|number| number * scale)
                    .filter(|value| value.is_finite());
                value.ok_or_else(|| wrong(*at, "a number", self.dialect.number_hint()))?
            };
            frame.values.push(value);
        }
        Ok(frame)
    }
}

/// True for `1,234` between quotes: a thousand and more, or one and a bit.
fn is_doubtful(text: &str) -> bool {
    text.split_once(',').is_some_and(|(whole, rest)| {
        let whole = whole.trim_start_matches(['-', '+']);
        rest.len() == 3 && (1..=3).contains(&whole.len()) && !whole.starts_with('0')
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::super::{Recording, RecordingOptions};
    use super::*;
    use crate::frame::Quantity;

    #[derive(Debug)]
    struct Read {
        frames: Vec<(u64, u64, Vec<f64>)>,
        stream: Stream,
        taken: Taken,
    }

    fn read_with(text: &[u8], columns: &str, bare: bool) -> Result<Read, String> {
        let columns = if columns.is_empty() {
            Columns::default()
        } else {
            columns.parse()?
        };
        let options = RecordingOptions {
            bare,
            part: None,
            columns,
        };
        let recording =
            Recording::open_with("t.csv", text, &options).map_err(|error| error.to_string())?;
        let (stream, taken) = (recording.stream().clone(), recording.taken().unwrap());
        let frames = recording.map(|frame| {
            let frame = frame.map_err(|error| error.to_string())?;
            Ok((frame.sequence, frame.time_ns, frame.values))
        });
        Ok(Read {
            frames: frames.collect::<Result<_, String>>()?,
            stream,
            taken,
        })
    }

    fn read(text: &str, columns: &str) -> Read {
        read_with(text.as_bytes(), columns, false).unwrap()
    }

    fn refusal(text: &str, columns: &str) -> String {
        read_with(text.as_bytes(), columns, false)
            .map(|read| read.taken.to_string())
            .unwrap_err()
    }

    const UNIX_NS: u64 = 1_700_000_000_000_000_000;
    const MS: u64 = 1_000_000;

    #[test]
    fn unix_times_are_recognised_in_any_unit_and_any_column() {
        for (scale, unit) in [
            (1_000, "s"),
            (1_000_000, "ms"),
            (1_000_000_000, "us"),
            (1_000_000_000_000, "ns"),
        ] {
            // Every row 20 ms behind the one before, in units of which a whole number is 20 ms.
            let time = |row: u64| match unit {
                "s" => format!("1700000000.{:02}", 2 * row),
                _ => (1_700_000_000_u64 * (scale / 1000) + row * scale / 50_000).to_string(),
            };
            for order in 0..3 {
                let rows = (0..30).map(|row| {
                    let mut cells = vec![(300 + row % 7).to_string(), (row % 3).to_string()];
                    cells.insert(order, time(row));
                    cells.join(",") + "\n"
                });
                let found = read_with(rows.collect::<String>().as_bytes(), "", true).unwrap();
                assert_eq!(
                    found.frames[3],
                    (3, UNIX_NS + 60 * MS, vec![303.0, 0.0]),
                    "{unit} {order}"
                );
                assert_eq!(found.stream.unit.quantity, Quantity::Counts);
                let said = format!("column {} in {unit}, by its numbers", order + 1);
                assert!(found.taken.time.starts_with(&said), "{}", found.taken);
            }
        }
    }

    #[test]
    fn columns_are_named_by_number_name_and_range() {
        let rows = "5,7,20,9\n6,8,40,9\n";
        let found = read(rows, "time=3[ms],value=1-2[kPa],sequence=4");
        assert_eq!(found.frames[1], (9, 40 * MS, vec![6000.0, 8000.0]));
        assert_eq!(found.stream.unit.symbol, "kPa");
        let named = "left,right,when,lot,who\n5,7,20,9,ann\n6,8,40,9,bob\n";
        let found = read(named, "time=when[us],value=left..right");
        assert_eq!(found.frames[1], (1, 40_000, vec![6.0, 8.0]));
        assert_eq!(
            found.taken.ignored,
            "columns 4 to 5 \"lot\" to \"who\" (not named)"
        );
        let found = read(named, "time=when[s],ignore=lot");
        assert_eq!(
            found.taken.ignored,
            "column 4 \"lot\" (as said), column 5 \"who\" (no numbers)"
        );
        let found = read("3\n4\n5\n", "rate=250 Hz");
        assert_eq!(found.frames[2], (2, 8 * MS, vec![5.0]));
        assert_eq!(found.stream.period, Some(0.004));
    }

    #[test]
    fn a_key_that_means_nothing_is_refused() {
        let rows = "1,2,3\n2,2,4\n";
        for (columns, part) in [
            ("times=1", "no role"),
            ("2", "has no role"),
            ("time=1[kPa]", "not a unit of time"),
            ("value=2[ells]", "not a unit of a channel"),
            ("time=1[s],sequence=2[ms]", "only times and values"),
            ("time=1[s],ignore=2[N]", "only times and values"),
            ("time=1[s],value=4", "no column `4`; there are 3"),
            ("time=1[s],value=0", "counted from 1"),
            ("time=1[s],value=3-2", "goes up"),
            ("time=1[s],value=force", "no column `force`"),
            ("time=1[s],value=1", "a second time"),
            ("time=1[s],time=2[s]", "2 columns are said to be the time"),
            ("time=1[s],rate=100 Hz", "contradict"),
            ("rate=100", "no rate"),
            ("rate=0 Hz", "no rate"),
            ("rate=1 Hz,rate=2 Hz", "second time"),
            ("time=", "names no column"),
            ("time=1", "unit of the time"),
            ("time=1[s],value=2,3[kPa]", "mix quantities"),
        ] {
            assert!(
                refusal(rows, columns).contains(part),
                "{columns}: {}",
                refusal(rows, columns)
            );
        }
        for own in ["DATA_TYPE MOVIE\n", "File:,\"C:\\a.XSN\"\n"] {
            assert!(refusal(own, "time=1[s]").contains("leave it out"));
        }
    }

    #[test]
    fn names_are_recognised_however_they_are_written() {
        let expected = [
            (0, 500 * MS, vec![1.5, -2.0]),
            (1, 520 * MS, vec![1.6, f64::NAN]),
        ];
        let same = |text: &[u8]| {
            let read = read_with(text, "", false).unwrap();
            assert_eq!(
                format!("{:?}", read.frames),
                format!("{expected:?}"),
                "{}",
                String::from_utf8_lossy(text)
            );
            read
        };
        let tables = [
            "time_ms,a,b\n500,1.5,-2\n520,1.6,\n",
            "Time (s);a;b\n0,50;1,5;-2\n0,52;1,6;NaN\n",
            "t\ta\tb\n0.50\t1.5\t-2\n0.52\t1.6\tovf\n",
            "| timestamp [ms] | a | b |\n|---|---|---|\n| 500 | 1.5 | -2 |\n| 520 | 1.6 | - |\n",
            "elapsed [ms]  a   b\n500 1.5  -2\n520 1.6 nan\n",
            "# time_ms,a,b\n500,1.5,-2\n520,1.6,nan\n",
            "% time_ms a b\n500 1.5 -2\n# pause\n520 1.6 nan\n",
            "millis,a,b\n\"500\",\"1,5\",\"-2\"\n\"520\",\"1,6\",\"\"\n",
            "time,a,b\nms,,\n500,1.5,-2\n520,1.6,\n",
            "Logger 7\nSN 12-3, gain 4\nTime,a,b,note\n0.50,1.5,-2,x\n0.52,1.6,nan,y\n",
            "b,a,sample,time [us]\n-2,1.5,0,500000\nnan,1.6,1,520000\n",
        ];
        for (at, text) in tables.iter().enumerate() {
            if at == tables.len() - 1 {
                let found = read(text, "value=a,b");
                // The values stand in the order of the file.
                assert_eq!(found.frames[0], (0, 500 * MS, vec![-2.0, 1.5]));
                assert!(
                    found.taken.sequence.contains("by its name"),
                    "{}",
                    found.taken
                );
                continue;
            }
            let read = same(text.as_bytes());
            assert_eq!(read.stream.unit.quantity, Quantity::Raw);
            let wide = |bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
                text.encode_utf16().flat_map(bytes).collect()
            };
            same(&wide(u16::to_le_bytes));
            same(&[&[0xfe, 0xff], &wide(u16::to_be_bytes)[..]].concat());
        }
    }

    #[test]
    fn a_second_header_begins_anew() {
        let text = "time_ms,a\n500,1\n520,2\ntime_ms,a\n0,3\n20,4\n";
        let mut recording = Recording::open("t.csv", text.as_bytes()).unwrap();
        let times: Vec<_> = recording
            .by_ref()
            .take(2)
            .map(|frame| frame.unwrap().time_ns)
            .collect();
        assert_eq!(times, [500 * MS, 520 * MS]);
        assert!(recording.take_changes().is_empty());
        assert_eq!(recording.next().unwrap().unwrap().values, [3.0]);
        assert_eq!(recording.take_changes(), [Change::Reconnected]);
    }

    #[test]
    fn units_grids_and_negative_times_come_from_the_table() {
        let text = "r0c1 [kPa];when (s);r0c0 [Pa]\n1,5;-0,25;3\n2;0,25;4\n";
        let found = read(text, "time=when");
        assert_eq!(
            found.frames,
            [(0, 0, vec![3.0, 1500.0]), (1, 500 * MS, vec![4.0, 2000.0])]
        );
        assert_eq!(found.stream.unit.quantity, Quantity::Pressure);
        let message = refusal("time [s],force [N],warmth [C]\n0.5,1,20\n0.6,2,21\n", "");
        assert!(
            message.contains("mix quantities") && message.contains("value=2"),
            "{message}"
        );
    }

    #[test]
    fn what_is_doubtful_is_refused() {
        for (text, part) in [
            ("time,a\n5,1\n6,2\n", "unit of the time"),
            ("a,b\n5,1\n4,1\n", "no column is recognised as the time"),
            ("time_ms,a\n5,\"1,234\"\n6,\"2,345\"\n", "is not a number"),
            ("time_ms,a\n5,1\n6,2\n7,l2\n", "`l2` is not a number"),
            ("time_ms,a\n5,1\n6,2,3\n", "has 3 numbers"),
            ("time_min,a\n5,1\n6,2\n", "unit of the time"),
            ("hello\nworld\n", "no recording of a known format"),
            ("1,2\n3,4\n", "--columns"),
        ] {
            assert!(
                refusal(text, "").contains(part),
                "{text}: {}",
                refusal(text, "")
            );
        }
        // What is cut is said to be cut.
        let cut = Recording::open("t.csv", "time_ms,a,b\n5,1,2\n6,2".as_bytes()).unwrap();
        assert!(matches!(
            cut.last(),
            Some(Err(RecordingError::Truncated {
                complete_frames: 1,
                ..
            }))
        ));
    }

    /// Tables as loggers of others export them: each has a column that is easily taken for another.
    #[test]
    fn columns_of_loggers_are_what_they_are() {
        let rows = |head: &str, row: fn(u32) -> String| -> String {
            (0..70).fold(head.to_owned(), |text, n| text + &row(n))
        };
        // A number that counts from 0 to 15 is neither a time nor a reading.
        let counted = rows("# EndOfHeader\n", |n| {
            format!("{}\t0\t{}\t\n", n % 16, 500 + n * n % 7)
        });
        let refused = read_with(counted.as_bytes(), "", true).unwrap_err();
        assert!(refused.contains("counts and begins again"), "{refused}");
        let found = read(&counted, "rate=100 Hz");
        assert!(
            found
                .taken
                .ignored
                .contains("column 1 (a counter that begins again)"),
            "{:?}",
            found.taken
        );
        assert_eq!((found.frames[3].1, found.stream.columns), (30_000_000, 2));
        // Each channel has a time of its own, and all names stand in quotes.
        let own_times = rows(
            "\"X [s]\",\"EMG 1: EMG.A 1 [V]\",\"X [s].1\",\"EMG 2: EMG.B 2 [V]\"\n",
            |n| {
                let time = 0.01 * f64::from(n);
                format!("{time:.2},{},{time:.2},{}\n", n % 5, n % 7)
            },
        );
        let found = read(&own_times, "");
        assert!(
            found.taken.ignored.contains("\"X [s].1\" (another time)"),
            "{:?}",
            found.taken
        );
        assert_eq!(
            (found.stream.columns, found.stream.unit.quantity),
            (2, Quantity::Voltage)
        );
        // Names of LabVIEW have one for comments, which no row has.
        let comments = rows(
            "***End_of_Header***\t\t\t\nX_Value\tForce_0\tForce_1\tComment\n",
            |n| format!("{:.2}\t{}\t{}\n", 0.01 * f64::from(n), n % 5, n % 7),
        );
        let found = read(&comments, "");
        assert!(
            found.taken.values.contains("\"Force_0\" to \"Force_1\""),
            "{:?}",
            found.taken
        );
        // Times that are not saved follow from their step; rows may begin with an empty field.
        for (begin, step) in [("\n\t", "0.005"), ("\n", "0.02")] {
            let head = format!(
                "X_Columns\tNo\n***End_of_Header***\nDelta_X\t{step}\t{step}\n***End_of_Header***\nX_Value\tForce_0\tForce_1\tComment\n"
            );
            let untimed = rows(&head, |n| format!("\t{}\t{}\t\n", n % 5, n % 7));
            let untimed = untimed.replace("\n\t", begin);
            let found = read(&untimed, "");
            assert!(
                found.taken.values.contains("\"Force_0\" to \"Force_1\"")
                    && found.taken.time.contains("by the Delta_X"),
                "{:?}",
                found.taken
            );
            let period = (step.parse::<f64>().unwrap() * 1e9) as u64;
            assert_eq!((found.frames[3].1, found.stream.columns), (3 * period, 2));
            assert_eq!(read(&untimed, "rate=10 Hz").frames[3].1, 300_000_000);
        }
        // The index of a data frame has no name.
        let index = rows(",time,left\n", |n| {
            format!("{n},{:.2},{}\n", 0.01 * f64::from(n), n % 5)
        });
        let found = read(&index, "");
        assert_eq!(found.stream.columns, 1);
        assert!(
            found.taken.ignored.contains("an index of the rows"),
            "{:?}",
            found.taken
        );
        // What a board sends is no table, but `listen` reads it.
        for log in [
            "{\"t\": 0.1, \"v\": [1, 2]}\n",
            "14:22:31.000 -> 500,3,900\n",
        ] {
            let refused = read_with(log.repeat(70).as_bytes(), "", true).unwrap_err();
            assert!(
                refused.contains("taxel listen t.csv -o board.toml"),
                "{refused}"
            );
        }
    }

    #[test]
    fn empty_fields_behind_all_rows_are_no_channels() {
        let frames = |text: &str| read_with(text.as_bytes(), "", true).unwrap().frames;
        let plain = frames("0.5,1,2\n0.6,1.5,3\n");
        assert_eq!(frames("0.5,1,2,,\n0.6,1.5,3,,\n"), plain);
        assert_eq!(frames("0,5;1;2;\n0,6;1,5;3;\n"), plain);
        let error = read_with(b"0,1,2,\n1,1,2,9\n", "", true)
            .map(|_| ())
            .unwrap_err();
        assert!(
            error.contains("has 4 numbers, the first one has 3"),
            "{error}"
        );
    }
}
