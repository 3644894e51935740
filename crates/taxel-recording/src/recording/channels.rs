//! Raw channels: one line per frame, one column per channel; see
//! [`super::ChannelWriter`].

use std::collections::HashSet;
use std::io::BufRead;

use super::columns::{Taken, column_names, split_unit, values_taken};
use super::lines::{Dialect, Field, Lines, quote};
use super::remarks::Remarks;
use super::{MOST_TAXELS, Opened, RecordingError, units};
use crate::frame::{Frame, SignalUnit, Stream};
use taxel_ground::InputError;

/// Names of the capacitors of a three-axis taxel, in the order of a frame.
pub(super) const CAPACITORS: [&str; 4] = ["11", "12", "21", "22"];
/// Names of the forces of a taxel, in the order of a frame.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// The names that the channels of a taxel have, one set or the other.
const SETS: [&[&str]; 2] = [&CAPACITORS, &AXES];

/// Begin of the names of the channels of a bench table, which count from 1.
const NUMBERED: &str = "channel_";
/// What else a bench table has: the touch, which an estimate is to find by itself.
const TRUTHS: [&str; 9] = [
    "x", "y", "z", "force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z",
];

/// A channel of several in a taxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Part {
    /// Index into [`SETS`].
    set: usize,
    /// Index into its names.
    at: usize,
}

/// Begin of the last line of a file that is whole.
pub(super) const END: &str = "# end of the recording:";

pub(super) fn is_comment(line: &str) -> bool {
    // A spreadsheet puts quotes around a comment that has a separator in it.
    line.trim_start().trim_start_matches('"').starts_with('#')
}

/// True for a header line that names channels, or nothing but a time and a running number.
pub(super) fn recognises(line: &str) -> bool {
    let dialect = Dialect::of_line(line);
    let named = |is: &dyn Fn(&str) -> bool, field: Field<'_>| is(split_unit(&field.text()).0);
    let is_channel = |name: &str| channel(name.split('.').next().unwrap_or(name)).is_some();
    let is_other = |name: &str| {
        ["time", "sequence"]
            .iter()
            .any(|known| name.eq_ignore_ascii_case(known))
    };
    dialect.fields(line).any(|field| named(&is_channel, field))
        || dialect.fields(line).all(|field| named(&is_other, field))
}

/// Rows, columns and channels of a taxel, and the place of each in a frame, of channels with these
/// names; `None` if they are not the names of all channels of a grid.
pub(super) fn layout(names: &[&str]) -> Option<([usize; 3], Vec<usize>)> {
    let channels: Vec<Channel> = names
        .iter()
        .map(|name| channel(name))
        .collect::<Option<_>>()?;
    let (rows, columns) = channels.iter().fold((0, 0), |(rows, columns), one| {
        (
            rows.max(one.row.saturating_add(1)),
            columns.max(one.column.saturating_add(1)),
        )
    });
    let set = |one: &Channel| one.part.map(|part| part.set);
    let first = set(channels.first()?);
    let each = first.map_or(1, |set| SETS[set].len());
    let full = u128::from(rows) * u128::from(columns) * each as u128 == names.len() as u128;
    let distinct: HashSet<_> = channels.iter().collect();
    if !full || distinct.len() != names.len() || channels.iter().any(|one| set(one) != first) {
        return None;
    }
    let grid = Grid {
        rows: rows as usize,
        columns: columns as usize,
        per_taxel: each,
    };
    let places = channels.into_iter().map(|one| grid.index(one)).collect();
    Some(([grid.rows, grid.columns, each], places))
}

#[derive(Debug)]
pub(super) struct Decoder {
    dialect: Dialect,
    header: String,
    columns: Vec<Column>,
    channels: usize,
    row: u64,
    /// True if a whole file has a mark at its end.
    end_is_marked: bool,
}

/// Contents of a column of the file.
#[derive(Debug, Clone)]
struct Column {
    name: String,
    role: Role,
}

#[derive(Debug, Clone, Copy)]
enum Role {
    Sequence,
    /// The unit is 10^`power` ns.
    Time {
        power: i32,
    },
    Channel {
        index: usize,
        si_per_unit: f64,
    },
    /// Not read.
    Truth,
}

/// `r<row>c<column>`, `r<row>c<column>.<capacitor>`, `r<row>c<column>.<axis>`, or `channel_<number>` in a row of taxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Channel {
    row: u64,
    column: u64,
    part: Option<Part>,
}

/// Meaning of the title of a column.
enum Entry {
    Sequence,
    Time { power: i32 },
    Channel(Channel, SignalUnit),
    Truth,
}

/// A channel with the column that has it.
struct Found<'a> {
    at: usize,
    field: Field<'a>,
    channel: Channel,
    unit: SignalUnit,
}

pub(super) fn open<R: BufRead>(
    lines: &mut Lines<R>,
    remarks: &Remarks,
) -> Result<Opened, RecordingError> {
    // Comments and blank lines were passed when the format was recognised.
    if !lines.advance()? {
        return Err(lines.truncated("there is no header line"));
    }
    if !lines.terminated() {
        return Err(lines.truncated("the file ends with its header line"));
    }
    let (mut stream, mut decoder) = read_header(lines)?;
    decoder.end_is_marked = remarks.end_is_marked;
    let si_per_number = remarks
        .complete(&mut stream)
        .map_err(|message| lines.line_error(message))?;
    if stream.unit.si_per_unit != si_per_number {
        decoder.count_in(si_per_number);
    }
    Ok(Opened {
        sensors: vec![stream.name.clone()],
        stream,
        decoder: super::Decoder::Channels(decoder),
    })
}

fn read_header<R: BufRead>(lines: &Lines<R>) -> Result<(Stream, Decoder), InputError> {
    let text = lines.text();
    let dialect = Dialect::of_line(text);
    let wrong = |field: &Field<'_>, message: String| {
        lines
            .error_at(field.raw, message)
            .key(field.text().into_owned())
    };
    let mut columns: Vec<Column> = Vec::new();
    let mut found: Vec<Found<'_>> = Vec::new();
    let (mut has_time, mut has_sequence) = (false, false);
    let numbered = |field: Field<'_>| field.text().trim_start().starts_with(NUMBERED);
    let is_bench = dialect.fields(text).any(numbered);
    for (at, field) in dialect.fields(text).enumerate() {
        let title = field.text().into_owned();
        let entry = title_entry(&title, is_bench)
            .map_err(|(message, help)| wrong(&field, message).help(help))?;
        let (role, twice) = match entry {
            Entry::Sequence => (Role::Sequence, std::mem::replace(&mut has_sequence, true)),
            Entry::Time { power } => (Role::Time { power }, std::mem::replace(&mut has_time, true)),
            Entry::Channel(channel, unit) => {
                let si_per_unit = unit.si_per_unit;
                found.push(Found {
                    at,
                    field,
                    channel,
                    unit,
                });
                let index = 0;
                (Role::Channel { index, si_per_unit }, false)
            }
            Entry::Truth => (Role::Truth, false),
        };
        if twice {
            return Err(wrong(
                &field,
                format!("{} is given a second time", quote(&title)),
            ));
        }
        columns.push(Column { name: title, role });
    }
    if !has_time {
        return Err(lines
            .line_error("there is no time column")
            .key("time")
            .help("add one called `time [s]`, `time [ms]`, `time [us]` or `time [ns]`"));
    }
    let Some(first) = found.first() else {
        return Err(lines
            .line_error("there is no channel")
            .help("name the columns by place and unit, such as `r0c0.11 [fF]` or `r0c0 [kPa]`"));
    };
    let unit = first.unit.clone();
    let grid = Grid::of(&found, |found, message| wrong(&found.field, message))?;
    for one in &found {
        if let Role::Channel { index, .. } = &mut columns[one.at].role {
            *index = grid.index(one.channel);
        }
    }
    let channels = found.len();
    let stream = Stream {
        name: base_name(lines.file()).to_owned(),
        rows: grid.rows,
        columns: grid.columns,
        channels_per_taxel: grid.per_taxel,
        unit,
        pitch: None,
        period: None,
        threshold: None,
        present: vec![true; channels],
    };
    let decoder = Decoder {
        dialect,
        header: text.trim_end().to_owned(),
        columns,
        channels,
        row: 0,
        end_is_marked: false,
    };
    Ok((stream, decoder))
}

/// Meaning of the title of a column; an error is the mistake and what to do.
fn title_entry(title: &str, is_bench: bool) -> Result<Entry, (String, String)> {
    let (name, unit) = split_unit(title);
    if is_bench && TRUTHS.contains(&name) {
        return Ok(Entry::Truth);
    }
    if name.eq_ignore_ascii_case("sequence") {
        return Ok(Entry::Sequence);
    }
    if name.eq_ignore_ascii_case("time") {
        let power = match unit {
            Some("s") => 9,
            Some("ms") => 6,
            Some("us" | "µs" | "μs") => 3,
            Some("ns") => 0,
            _ => {
                let message = "the time needs a unit in brackets: time [s], [ms], [us] or [ns]";
                return Err((message.to_owned(), String::new()));
            }
        };
        return Ok(Entry::Time { power });
    }
    let Some(channel) = channel(name) else {
        let help = "columns are `sequence`, `time [s]`, and for each channel its place and unit: \
             `r0c0.11 [fF]` to `r0c0.22 [fF]` for the four capacitors of a taxel, `r0c0.x [N]` to `r0c0.z [N]` for its forces, or `r0c0 [kPa]`; or `channel_1`, `channel_2` and so on, as in a table for calibrate";
        let message = format!("{} is no column of a recording", quote(title));
        return Err((message, help.to_owned()));
    };
    let unit = unit.or_else(|| name.starts_with(NUMBERED).then_some("counts"));
    let found = unit.and_then(units::find).ok_or_else(|| {
        let message = match unit {
            Some(unit) => format!("{} is not a unit of a channel", quote(unit)),
            None => format!("the channel {} has no unit in brackets", quote(name)),
        };
        (message, format!("use one of: {}", units::list(|_| true)))
    })?;
    Ok(Entry::Channel(channel, found))
}

/// The full grid that the channels of a header must be.
struct Grid {
    rows: usize,
    columns: usize,
    per_taxel: usize,
}

impl Grid {
    fn of(
        found: &[Found<'_>],
        wrong: impl Fn(&Found<'_>, String) -> InputError,
    ) -> Result<Self, InputError> {
        let mut seen = HashSet::with_capacity(found.len());
        let (mut rows, mut columns) = (0, 0);
        for one in found {
            let first = &found[0];
            if one.unit.quantity != first.unit.quantity {
                let message = format!(
                    "the channels mix quantities: {} here, {} before",
                    one.unit.symbol, first.unit.symbol
                );
                return Err(wrong(one, message));
            }
            let set = |found: &Found<'_>| found.channel.part.map(|part| part.set);
            if set(one) != set(first) {
                let message = "some channels name a capacitor (.11, .12, .21, .22) or an axis (.x, .y, .z), and some do not";
                return Err(wrong(one, message.into()));
            }
            if one.channel.row >= MOST_TAXELS || one.channel.column >= MOST_TAXELS {
                let message = format!("rows and columns are counted from 0 to {}", MOST_TAXELS - 1);
                return Err(wrong(one, message));
            }
            if !seen.insert(one.channel) {
                return Err(wrong(one, "the channel is given a second time".into()));
            }
            rows = rows.max(one.channel.row + 1);
            columns = columns.max(one.channel.column + 1);
        }
        let part = found.first().and_then(|one| one.channel.part);
        let per_taxel = part.map_or(1, |part| SETS[part.set].len());
        // A gap shows after as many steps as there are channels.
        let gap = (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (row, column)))
            .flat_map(|(row, column)| {
                (0..per_taxel).map(move |at| Channel {
                    row,
                    column,
                    part: part.map(|part| Part { at, ..part }),
                })
            })
            .find(|channel| !seen.contains(channel));
        let last = found
            .iter()
            .max_by_key(|one| (one.channel.row, one.channel.column));
        if let (Some(gap), Some(last)) = (gap, last) {
            let message = format!(
                "the channel {} is missing: the columns reach to {rows} rows x {columns} columns",
                gap.name()
            );
            return Err(wrong(last, message).key(gap.name()));
        }
        Ok(Self {
            rows: rows as usize,
            columns: columns as usize,
            per_taxel,
        })
    }

    fn index(&self, channel: Channel) -> usize {
        (channel.row as usize * self.columns + channel.column as usize) * self.per_taxel
            + channel.part.map_or(0, |part| part.at)
    }
}

impl Channel {
    fn name(self) -> String {
        let Self { row, column, .. } = self;
        match self.part {
            Some(Part { set, at }) => format!("r{row}c{column}.{}", SETS[set][at]),
            None => format!("r{row}c{column}"),
        }
    }
}

impl Decoder {
    /// What the header says, in words.
    pub(super) fn taken(&self, stream: &Stream) -> Taken {
        let names: Vec<&str> = self.columns.iter().map(|column| &*column.name).collect();
        let of = |is: &dyn Fn(Role) -> bool| -> Vec<usize> {
            let all = self.columns.iter().enumerate();
            all.filter(|(_, column)| is(column.role))
                .map(|(at, _)| at)
                .collect()
        };
        let listed = |is: &dyn Fn(Role) -> bool| column_names(&of(is), &names);
        let shape = [stream.rows, stream.columns, stream.channels_per_taxel];
        let values = listed(&|role| matches!(role, Role::Channel { .. }));
        let sequence = of(&|role| matches!(role, Role::Sequence));
        Taken {
            time: format!(
                "{}, by the header",
                listed(&|role| matches!(role, Role::Time { .. }))
            ),
            sequence: if sequence.is_empty() {
                "none, rows are counted".into()
            } else {
                column_names(&sequence, &names)
            },
            values: values_taken(&values, shape, &stream.unit),
            ignored: listed(&|role| matches!(role, Role::Truth)),
        }
    }

    /// Takes every channel for so many SI units a number.
    fn count_in(&mut self, si_per_number: f64) {
        for column in &mut self.columns {
            if let Role::Channel { si_per_unit, .. } = &mut column.role {
                *si_per_unit = si_per_number;
            }
        }
    }

    pub(super) fn read<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
    ) -> Result<Option<Frame>, RecordingError> {
        loop {
            if !lines.advance_to_row(&self.dialect)? {
                if self.end_is_marked {
                    return Err(lines.truncated("the mark of its end is missing"));
                }
                return Ok(None);
            }
            let text = lines.text();
            // An unfinished comment may be the beginning of the mark of the end.
            if !is_comment(text) || text.starts_with(END) || !lines.terminated() {
                break;
            }
        }
        if let Some(frames) = lines.text().strip_prefix(END) {
            let said = frames
                .split_whitespace()
                .next()
                .and_then(|n| n.parse().ok());
            if said != Some(self.row) {
                let message = format!("{} frames stand before this mark of the end", self.row);
                let error = lines.line_error(message);
                return Err(lines.fault(error.help("lines are missing or were added")));
            }
            if lines.advance_to_row(&self.dialect)? {
                return Err(lines
                    .line_error("this line stands behind the mark of the end")
                    .help("one file holds one recording; split it")
                    .into());
            }
            return Ok(None);
        }
        self.check_shape(lines)?;
        let mut frame = Frame {
            sequence: self.row,
            time_ns: 0,
            values: vec![f64::NAN; self.channels],
            ..Frame::default()
        };
        let last = self.columns.len() - 1;
        for (at, (column, field)) in self
            .columns
            .iter()
            .zip(self.dialect.clone().fields(lines.text()))
            .enumerate()
        {
            put(&mut frame, &mut self.dialect, column.role, &field).map_err(|message| {
                let error = lines.error_at(field.raw, message).key(&column.name);
                // Only the last field of a line can have been cut.
                if at == last {
                    lines.fault(error)
                } else {
                    error.into()
                }
            })?;
        }
        self.row += 1;
        Ok(Some(frame))
    }

    /// Refuses a line whose fields are not those of the header.
    fn check_shape<R: BufRead>(&self, lines: &Lines<R>) -> Result<(), RecordingError> {
        let text = lines.text();
        if text.trim_end() == self.header {
            let error = lines
                .line_error("the header line stands here a second time")
                .help("one file holds one recording; split it, or remove the line if the recordings belong together");
            return Err(error.into());
        }
        let expected = self.columns.len();
        let count = self.dialect.fields(text).count();
        if count == expected {
            // Behind the last separator a value may have been cut off.
            let last = self.dialect.fields(text).last();
            if !lines.terminated() && last.is_some_and(|field| field.raw.is_empty()) {
                return Err(lines.truncated("the last field of the line is empty"));
            }
            return Ok(());
        }
        let error = lines.line_error(format!(
            "the line has {count} fields, the header has {expected}"
        ));
        Err(if count < expected {
            lines.fault(error)
        } else {
            error.into()
        })
    }
}

/// Puts one field of a line into the frame; a fault is what is wrong.
fn put(
    frame: &mut Frame,
    dialect: &mut Dialect,
    role: Role,
    field: &Field<'_>,
) -> Result<(), String> {
    let text = field.text();
    match role {
        Role::Sequence => {
            frame.sequence = text.parse().map_err(|_| {
                format!(
                    "{} is not a running number; allowed is a whole number of 0 or more",
                    quote(&text)
                )
            })?;
        }
        Role::Time { power } => {
            frame.time_ns = dialect.scaled_integer(&text, power).ok_or_else(|| {
                format!(
                    "{} is not a time; allowed are 0 to 18446744073 s; {}",
                    quote(&text),
                    dialect.number_hint()
                )
            })?;
        }
        Role::Truth => {}
        Role::Channel { .. } if text.is_empty() || text.eq_ignore_ascii_case("nan") => {}
        Role::Channel { index, si_per_unit } => {
            let value = dialect
                .number(&text)
                .map(|value| value * si_per_unit)
                .filter(|value| value.is_finite());
            frame.values[index] = value.ok_or_else(|| {
                format!(
                    "{} is not a reading; allowed are finite numbers, and an empty field or nan where there is \
                     no reading; {}",
                    quote(&text),
                    dialect.number_hint()
                )
            })?;
        }
    }
    Ok(())
}

fn channel(name: &str) -> Option<Channel> {
    if let Some(number) = name.strip_prefix(NUMBERED) {
        let number: u64 = number.parse().ok()?;
        return Some(Channel {
            row: 0,
            column: number.checked_sub(1)?,
            part: None,
        });
    }
    let (row, rest) = name.strip_prefix(['r', 'R'])?.split_once(['c', 'C'])?;
    let (column, part) = match rest.split_once('.') {
        Some((column, name)) => {
            let named = |(set, names): (usize, &&[&str])| {
                let at = names.iter().position(|one| *one == name)?;
                Some(Part { set, at })
            };
            (column, Some(SETS.iter().enumerate().find_map(named)?))
        }
        None => (rest, None),
    };
    let number = |text: &str| {
        let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        digits.then(|| text.parse().unwrap_or(u64::MAX))
    };
    Some(Channel {
        row: number(row)?,
        column: number(column)?,
        part,
    })
}

pub(crate) fn base_name(file: &str) -> &str {
    file.rsplit(['/', '\\']).next().unwrap_or(file)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::super::Recording;
    use super::*;
    use crate::frame::Quantity;

    fn read(text: &str) -> Result<Vec<Frame>, RecordingError> {
        Recording::open("t.csv", text.as_bytes())?.collect()
    }

    #[test]
    fn a_table_for_calibrate_is_a_recording() {
        let text =
            "time [s],force_z [N],channel_2,channel_1,x [mm]\n0.5,nothing,20,10,\n0.6,1,21,,3\n";
        let frames = read(text).unwrap();
        assert_eq!(frames[0].values, [10.0, 20.0]);
        assert_eq!(frames[0].time_ns, 500_000_000);
        assert!(frames[1].values[0].is_nan() && frames[1].values[1] == 21.0);
        // Without its channels a force is no part of a recording, and one of them must not be missing.
        for text in [
            "time [s],force_z [N],r0c0 [kPa]\n",
            "time [s],channel_1,channel_3\n",
        ] {
            assert!(read(&format!("{text}0,1,2\n")).is_err());
        }
    }

    #[test]
    fn columns_may_stand_in_any_order() {
        let text = "# made by hand\n\"# a, b\"\nr0c1.22 [fF],r0c0.22 [fF],time [ms],r0c0.11 [fF],r0c0.12 [fF],r0c0.21 [fF],\
                    r0c1.21 [fF],r0c1.12 [fF],sequence,r0c1.11 [fF]\n8,4,2.5,1,2,,7,NaN,41,5\n";
        let recording = Recording::open("some/where.csv", text.as_bytes()).unwrap();
        let stream = recording.stream().clone();
        assert_eq!(
            (stream.rows, stream.columns, stream.channels_per_taxel),
            (1, 2, 4)
        );
        assert_eq!(
            (stream.unit.quantity, stream.unit.symbol.as_str()),
            (Quantity::Capacitance, "fF")
        );
        assert_eq!(stream.name, "where.csv");
        let frame = recording.map(Result::unwrap).next().unwrap();
        assert_eq!((frame.sequence, frame.time_ns), (41, 2_500_000));
        let shown: Vec<_> = frame.values.iter().map(|value| value / 1e-15).collect();
        assert!(shown[2].is_nan() && shown[5].is_nan());
        assert_eq!(
            [shown[0], shown[1], shown[3], shown[4], shown[6], shown[7]],
            [1.0, 2.0, 4.0, 5.0, 7.0, 8.0]
        );
    }

    #[test]
    fn decimal_commas_between_semicolons_are_numbers() {
        let points = read("time [s],r0c0 [kPa],r0c1 [kPa]\n0.25,1.5,-2e-1\n0.5,3,\n").unwrap();
        let commas =
            read("time [s];r0c0 [kPa];r0c1 [kPa]\r\n0,25;1,5;-2e-1\r\n0,5;3;nan\r\n").unwrap();
        assert_eq!(points[0], commas[0]);
        assert_eq!(points[1].time_ns, commas[1].time_ns);
        let error = read("time [s];r0c0 [kPa]\n0,25;1.234\n").unwrap_err();
        assert!(error.to_string().contains("look like 12,5"), "{error}");
    }

    #[test]
    fn late_and_double_frames_are_delivered_as_they_stand() {
        let frames = read("sequence,time [s],r0c0 [raw]\n5,2,1\n4,1,1\n4,1,1\n").unwrap();
        let numbers: Vec<_> = frames
            .iter()
            .map(|frame| (frame.sequence, frame.time_ns))
            .collect();
        assert_eq!(
            numbers,
            [(5, 2_000_000_000), (4, 1_000_000_000), (4, 1_000_000_000)]
        );
    }

    #[test]
    fn a_last_line_without_end_counts_if_it_has_all_fields() {
        let whole = read("time [s],r0c0 [raw],r0c1 [raw]\n0,1,2\n1,3,4").unwrap();
        assert_eq!(whole.len(), 2);
        for cut in ["1,3", "1", "1,3,", "1,3,4e", "1,3,na"] {
            let text = format!("time [s],r0c0 [raw],r0c1 [raw]\n0,1,2\n{cut}");
            let mut recording = Recording::open("t.csv", text.as_bytes()).unwrap();
            assert!(recording.next().unwrap().is_ok());
            let error = recording.next().unwrap().unwrap_err();
            assert!(
                matches!(
                    error,
                    RecordingError::Truncated {
                        complete_frames: 1,
                        ..
                    }
                ),
                "{error}"
            );
        }
    }

    #[test]
    fn a_file_whose_end_is_marked_is_whole_or_cut() {
        let head = "# end = marked\ntime [s],r0c0 [raw]\n0,1\n1,2\n";
        let whole = format!("{head}# end of the recording: 2 frames\n");
        assert_eq!(read(&whole).unwrap().len(), 2);
        let cut = |text: &str| matches!(read(text), Err(RecordingError::Truncated { .. }));
        for length in head.len() - 4..whole.len() - " frames\n".len() {
            assert!(cut(&whole[..length]), "{}", &whole[..length]);
        }
        let fewer = whole.replace("0,1\n", "");
        let error = read(&fewer).unwrap_err().to_string();
        assert!(error.contains("1 frames stand before"), "{error}");
        let more = format!("{whole}2,3\n");
        let error = read(&more).unwrap_err().to_string();
        assert!(error.contains("behind the mark"), "{error}");
        // Files of older versions announce no mark.
        assert_eq!(
            read(&head.replace("# end = marked\n", "")).unwrap().len(),
            2
        );
    }

    #[test]
    fn mistakes_are_named_with_column_and_line() {
        let cases = [
            ("time [s],r0c0.11 [fF]\n", 1, "r0c0.12 is missing"),
            ("time [s],r0c0 [kPa],r1c1 [kPa]\n", 1, "r0c1 is missing"),
            ("time [s],r0c0 [kPa],r0c0 [kPa]\n", 1, "second time"),
            ("time [s],r0c0 [kPa],r0c1 [fF]\n", 1, "mix quantities"),
            ("time [s],r0c0 [kPa],r0c1.11 [kPa]\n", 1, "some do not"),
            ("time [s],r0c0\n", 1, "no unit"),
            ("time [s],r0c0 [ell]\n", 1, "`ell` is not a unit"),
            ("time [s],r0c0.33 [fF]\n", 1, "no column of a recording"),
            (
                "time [s],temperature [C],r0c0 [raw]\n",
                1,
                "no column of a recording",
            ),
            ("time,r0c0 [raw]\n", 1, "needs a unit"),
            ("time [min],r0c0 [raw]\n", 1, "needs a unit"),
            ("r0c0 [raw]\n", 1, "no time column"),
            ("time [s]\n", 1, "no channel"),
            ("time [s],time [s],r0c0 [raw]\n", 1, "second time"),
            ("time [s],r999999999999c0 [raw]\n", 1, "0 to 999999"),
            (
                "time [s],r99999999999999999999999c0 [raw]\n",
                1,
                "0 to 999999",
            ),
            ("time [s],r999999c999999 [raw]\n", 1, "r0c0 is missing"),
            (
                "time [s],r0c0 [raw]\n0,1\n0,1,2\n",
                3,
                "3 fields, the header has 2",
            ),
            (
                "time [s],r0c0 [raw]\n0,1\n0\n",
                3,
                "1 fields, the header has 2",
            ),
            (
                "time [s],r0c0 [raw]\n0,1\n1,inf\n",
                3,
                "`inf` is not a reading",
            ),
            (
                "time [s],r0c0 [MPa]\n0,1e303\n",
                2,
                "`1e303` is not a reading",
            ),
            ("time [s],r0c0 [raw]\n-1,1\n", 2, "is not a time"),
            ("time [s],r0c0 [raw]\nnan,1\n", 2, "is not a time"),
            ("time [s],r0c0 [raw]\n1e30,1\n", 2, "is not a time"),
            (
                "sequence,time [s],r0c0 [raw]\n-1,0,1\n",
                2,
                "not a running number",
            ),
            (
                "time [s],r0c0 [raw]\n0,1\ntime [s],r0c0 [raw]\n",
                3,
                "a second time",
            ),
            ("0.1,5,6\n", 1, "time [s],r0c0.11 [fF]"),
            ("hello\n", 1, "DATA_TYPE MOVIE"),
        ];
        for (text, line, message) in cases {
            match read(text) {
                Err(RecordingError::Input(error)) => {
                    assert_eq!(
                        error.place.as_ref().map(|place| place.line),
                        Some(line),
                        "{error}"
                    );
                    assert!(error.to_string().contains(message), "{error}");
                }
                other => panic!("{text}: {other:?}"),
            }
        }
    }
}
