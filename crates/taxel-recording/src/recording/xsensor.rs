//! CSV export of XSENSOR.
//!
//! A few lines `File:`, `Units:`, `Threshold:`, then for each frame
//!
//! ```text
//! FRAME,1464                                 number of the frame
//! Date, 2022 Aug 16
//! Time, 08:21:17.982                         time of day
//! SENSOR,HX210...-LF S0073                   one such block per sensor
//! Rows,31   Columns,11   Sensel Width (cm),0.86   Sensel Height (cm),0.86
//! Average Pressure (mmHg),452.85  ...        statistics of the sensor
//! SENSELS                                    Rows lines of Columns readings
//! GROUP,1   Name,Left Heel   Cells,36  ...   one such block per region
//! SENSELS                                    Cells readings, 20 to a line
//! ```
//!
//! each entry on a line of its own, padded with commas to 20 fields, and lines
//! of commas between them. So a line of 20 numbers is not a row of the sensor
//! but a stretch of a region's list.

use std::io::BufRead;

use super::lines::{Dialect, Lines, quote, scaled_integer};
use super::{Opened, RecordingError, shape_fault, side, spacing, units};
use crate::frame::{Frame, Quantity, SignalUnit, Stream};

/// Most sensors of one file; their names are kept.
const MOST_SENSORS: usize = 64;

const DAY_NS: i128 = 86_400_000_000_000;

pub(super) fn recognises(line: &str) -> bool {
    let dialect = Dialect::of_line(line);
    let first = dialect.fields(line).next();
    first.is_some_and(|field| ["File:", "Units:", "Threshold:", "FRAME"].contains(&&*field.text()))
}

#[derive(Debug)]
pub(super) struct Decoder {
    dialect: Dialect,
    unit: SignalUnit,
    /// The sensor that is delivered; the first one if none was asked for.
    wanted: Option<String>,
    layout: Option<Layout>,
    /// Sensors and groups of the first frame; later ones must not have fewer.
    blocks: usize,
    /// Fields of a row of readings, with the commas that pad it.
    row_fields: Option<usize>,
    clock: Clock,
    /// The first frame, read when the file was opened.
    first: Option<Frame>,
    /// End of the reading after the frame that was delivered last.
    ending: Option<RecordingError>,
}

/// Shape of the sensor that is delivered.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layout {
    rows: usize,
    columns: usize,
    pitch: Option<[f64; 2]>,
}

/// Time of day made to run on past midnight.
#[derive(Debug, Default)]
struct Clock {
    start: i128,
    latest: Option<i128>,
}

/// One frame as read.
#[derive(Debug, Default)]
struct Block {
    sequence: u64,
    time_ns: Option<u64>,
    sensors: Vec<String>,
    blocks: usize,
    values: Option<Vec<f64>>,
}

/// The part of a frame to which a line belongs.
#[derive(Debug)]
enum Section {
    Frame,
    Sensor(Sensor),
    Group { cells: Option<u64> },
}

#[derive(Debug, Default)]
struct Sensor {
    name: String,
    rows: Option<usize>,
    columns: Option<usize>,
    width: Option<f64>,
    height: Option<f64>,
}

pub(super) fn open<R: BufRead>(
    lines: &mut Lines<R>,
    wanted: Option<&str>,
) -> Result<Opened, RecordingError> {
    let (dialect, unit, threshold) = read_header(lines)?;
    let mut decoder = Decoder {
        dialect,
        unit,
        wanted: wanted.map(str::to_owned),
        layout: None,
        blocks: 0,
        row_fields: None,
        clock: Clock::default(),
        first: None,
        ending: None,
    };
    let Some(block) = decoder.block(lines)? else {
        return Err(lines.truncated("there is no FRAME"));
    };
    decoder.blocks = block.blocks;
    let sensors = block.sensors.clone();
    if let Some(name) = wanted
        && !sensors.iter().any(|sensor| sensor == name)
    {
        return Err(super::no_such_sensor(lines.file(), name, &sensors).into());
    }
    let frame = decoder.frame(lines, block)?;
    let layout = decoder.layout.unwrap_or(Layout {
        rows: 1,
        columns: frame.values.len(),
        pitch: None,
    });
    let stream = Stream {
        name: decoder.wanted.clone().unwrap_or_default(),
        rows: layout.rows,
        columns: layout.columns,
        channels_per_taxel: 1,
        unit: decoder.unit.clone(),
        pitch: layout.pitch,
        period: None,
        threshold,
        present: vec![true; frame.values.len()],
    };
    decoder.first = Some(frame);
    Ok(Opened {
        stream,
        sensors,
        decoder: super::Decoder::Xsensor(Box::new(decoder)),
    })
}

/// Reads to the first `FRAME`, which is left to be read again.
fn read_header<R: BufRead>(
    lines: &mut Lines<R>,
) -> Result<(Dialect, SignalUnit, Option<f64>), RecordingError> {
    let mut dialect = None;
    let mut unit: Option<SignalUnit> = None;
    let mut threshold = None;
    loop {
        if !lines.advance()? {
            return Err(lines.truncated("the file ends inside its header, before the first FRAME"));
        }
        let line = lines.text();
        let dialect = dialect.get_or_insert_with(|| Dialect::of_line(line));
        let mut fields = dialect.fields(line);
        let key = fields.next().map(|field| field.text()).unwrap_or_default();
        let raw = fields.next().map_or("", |field| field.raw);
        match &*key {
            "Units:" => {
                let known = |quantity| matches!(quantity, Quantity::Raw | Quantity::Pressure);
                let found = units::find(raw).filter(|unit| known(unit.quantity));
                unit = Some(found.ok_or_else(|| {
                    let message = format!("{} is not a unit of readings", quote(raw));
                    let error = lines.error_at(raw, message).key("Units:");
                    lines.fault(error.help(format!("use one of: {}", units::list(known))))
                })?);
            }
            "Threshold:" => {
                let value = dialect.number(raw).filter(|&value| value >= 0.0);
                threshold = Some(value.ok_or_else(|| {
                    let message =
                        format!("{} is not allowed here; allowed is 0 or more", quote(raw));
                    lines.fault(lines.error_at(raw, message).key("Threshold:"))
                })?);
            }
            "FRAME" => {
                let unit = unit.ok_or_else(|| {
                    lines
                        .line_error("the header has no line `Units:` before the first frame")
                        .key("Units:")
                })?;
                let threshold = threshold.map(|value| value * unit.si_per_unit);
                let dialect = dialect.clone();
                lines.again();
                return Ok((dialect, unit, threshold));
            }
            _ => {}
        }
    }
}

impl Decoder {
    pub(super) fn read<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
    ) -> Result<Option<Frame>, RecordingError> {
        if let Some(frame) = self.first.take() {
            return Ok(Some(frame));
        }
        if let Some(ending) = self.ending.take() {
            return Err(ending);
        }
        match self.block(lines)? {
            Some(block) => self.frame(lines, block).map(Some),
            None => Ok(None),
        }
    }

    /// The frame in a block that may lack it.
    fn frame<R: BufRead>(
        &mut self,
        lines: &Lines<R>,
        block: Block,
    ) -> Result<Frame, RecordingError> {
        let sequence = block.sequence;
        let missing = |what: String| lines.fault(lines.line_error(what).key("FRAME"));
        let values = block.values.ok_or_else(|| {
            let sensor = self.wanted.as_deref().unwrap_or("any sensor");
            missing(format!("frame {sequence} has no readings of {sensor}"))
        })?;
        let time_ns = block
            .time_ns
            .ok_or_else(|| missing(format!("frame {sequence} has no line `Time`")))?;
        Ok(Frame {
            sequence,
            time_ns,
            values,
            ..Frame::default()
        })
    }

    /// Reads from one `FRAME` to the next or to the end of the file.
    ///
    /// Reads the next block. An error behind the readings that are delivered is kept for
    /// after them.
    fn block<R: BufRead>(&mut self, lines: &mut Lines<R>) -> Result<Option<Block>, RecordingError> {
        if !lines.advance_to_row(&self.dialect)? {
            return Ok(None);
        }
        let mut block = Block {
            sequence: self.frame_number(lines)?,
            ..Block::default()
        };
        if let Err(error) = self.sections(lines, &mut block) {
            if block.values.is_none() || block.time_ns.is_none() {
                return Err(error);
            }
            self.ending = Some(error);
        }
        Ok(Some(block))
    }

    fn frame_number<R: BufRead>(&self, lines: &Lines<R>) -> Result<u64, RecordingError> {
        let mut fields = self.dialect.fields(lines.text());
        if fields.next().is_none_or(|field| field.text() != "FRAME") {
            return Err(lines.fault(lines.line_error("expected the next FRAME")));
        }
        let raw = fields.next().map_or("", |field| field.raw);
        raw.parse().map_err(|_| {
            let message = format!(
                "{} is not a frame number; allowed is a whole number of 0 or more",
                quote(raw)
            );
            lines.fault(lines.error_at(raw, message).key("FRAME"))
        })
    }

    fn sections<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
        block: &mut Block,
    ) -> Result<(), RecordingError> {
        let mut section = Section::Frame;
        loop {
            if !lines.advance()? {
                if block.blocks == 0 || block.blocks < self.blocks {
                    return Err(lines.truncated(format!(
                        "frame {} has {} of {} SENSOR and GROUP blocks",
                        block.sequence,
                        block.blocks,
                        self.blocks.max(1)
                    )));
                }
                return match section {
                    Section::Frame => Ok(()),
                    _ => Err(lines.truncated(format!(
                        "frame {} has a block without SENSELS",
                        block.sequence
                    ))),
                };
            }
            if self.dialect.is_blank(lines.text()) {
                continue;
            }
            let mut fields = self.dialect.fields(lines.text());
            let key = fields.next().map(|field| field.text()).unwrap_or_default();
            let raw = fields.next().map_or("", |field| field.raw);
            match (&*key, &mut section) {
                ("FRAME", _) => {
                    lines.again();
                    return Ok(());
                }
                ("Time", Section::Frame) => block.time_ns = Some(self.time(lines, raw)?),
                ("SENSOR", _) => {
                    let name = raw.trim_matches('"').to_owned();
                    section = self.sensor(lines, block, name)?;
                }
                ("GROUP", _) => {
                    block.blocks += 1;
                    section = Section::Group { cells: None };
                }
                ("Rows" | "Columns", Section::Sensor(sensor)) => {
                    let count = side(raw).ok_or_else(|| {
                        let message = format!(
                            "{} is not allowed here; allowed is a whole number from 1 to 1000000",
                            quote(raw)
                        );
                        lines.fault(lines.error_at(raw, message).key(&*key))
                    })?;
                    *(if key == "Rows" {
                        &mut sensor.rows
                    } else {
                        &mut sensor.columns
                    }) = Some(count);
                }
                ("Cells", Section::Group { cells }) => *cells = raw.parse().ok(),
                ("SENSELS", Section::Sensor(_)) => {
                    if let Section::Sensor(sensor) = std::mem::replace(&mut section, Section::Frame)
                    {
                        self.sensels(lines, block, &sensor)?;
                    }
                }
                ("SENSELS", Section::Group { cells }) => {
                    let cells = cells.take();
                    section = Section::Frame;
                    self.pass_over_group(lines, block.sequence, cells)?;
                }
                (key, Section::Sensor(sensor)) if key.starts_with("Sensel ") => {
                    let length = self.sensel_side(key, raw).ok_or_else(|| {
                        let message = format!(
                            "{} is not allowed here; allowed is a number above 0, up to 1 m, the unit in \
                             brackets after the name ({})",
                            quote(raw),
                            units::LENGTHS
                        );
                        lines.fault(lines.error_at(raw, message).key(key))
                    })?;
                    *(if key.starts_with("Sensel Width") {
                        &mut sensor.width
                    } else {
                        &mut sensor.height
                    }) = Some(length);
                }
                (key, _) if self.dialect.clone().number(key).is_some() => {
                    let message =
                        "a row of readings stands outside of the rows that SENSELS announces";
                    return Err(lines.fault(lines.line_error(message).key("SENSELS")));
                }
                // Statistics, names, dates.
                _ => {}
            }
        }
    }

    fn sensor<R: BufRead>(
        &mut self,
        lines: &Lines<R>,
        block: &mut Block,
        name: String,
    ) -> Result<Section, RecordingError> {
        if block.sensors.len() == MOST_SENSORS {
            let message = format!("the frame has more than the allowed {MOST_SENSORS} sensors");
            return Err(lines.line_error(message).key("SENSOR").into());
        }
        if !lines.terminated() {
            return Err(lines.truncated("the name of the sensor has no end"));
        }
        self.wanted.get_or_insert_with(|| name.clone());
        block.sensors.push(name.clone());
        block.blocks += 1;
        Ok(Section::Sensor(Sensor {
            name,
            ..Sensor::default()
        }))
    }

    /// Length of `Sensel Width (cm),0.86`, m.
    fn sensel_side(&mut self, key: &str, value: &str) -> Option<f64> {
        let (_, unit) = key.split_once('(')?;
        let unit = units::length(unit.trim_end().strip_suffix(')')?)?;
        spacing(self.dialect.number(value)?, unit)
    }

    /// Reads the rows of a sensor, and keeps them if it is the one delivered.
    fn sensels<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
        block: &mut Block,
        sensor: &Sensor,
    ) -> Result<(), RecordingError> {
        let wanted = self.wanted.as_deref() == Some(&sensor.name) && block.values.is_none();
        let missing = |key: &str| {
            let message = format!("the sensor has no line `{key}` before SENSELS");
            lines.fault(lines.line_error(message).key(key))
        };
        let layout = Layout {
            rows: sensor.rows.ok_or_else(|| missing("Rows"))?,
            columns: sensor.columns.ok_or_else(|| missing("Columns"))?,
            pitch: sensor
                .height
                .zip(sensor.width)
                .map(|(height, width)| [height, width]),
        };
        if let Some(fault) = shape_fault(layout.rows, layout.columns) {
            return Err(lines.line_error(fault).key("Rows, Columns").into());
        }
        if wanted {
            let first = *self.layout.get_or_insert(layout);
            if first != layout {
                let message = format!(
                    "the sensor is {} x {} in this frame and was {} x {} in the first, or its pitch differs",
                    layout.rows, layout.columns, first.rows, first.columns
                );
                return Err(lines.line_error(message).key("Rows, Columns").into());
            }
        }
        let mut values = Vec::with_capacity(layout.rows * layout.columns);
        for row in 0..layout.rows {
            self.row(lines, block.sequence, row, &layout, &mut values)?;
        }
        if wanted {
            block.values = Some(values);
        }
        Ok(())
    }

    fn row<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
        sequence: u64,
        row: usize,
        layout: &Layout,
        values: &mut Vec<f64>,
    ) -> Result<(), RecordingError> {
        let counted = || format!("frame {sequence} has {row} of {} rows", layout.rows);
        if !lines.advance_to_row(&self.dialect)? {
            return Err(lines.truncated(counted()));
        }
        let end = values.len() + layout.columns;
        let mut filled = 0;
        let mut count = 0;
        for field in self.dialect.clone().fields(lines.text()) {
            count += 1;
            if !field.raw.is_empty() {
                filled = count;
            }
            if count > layout.columns {
                continue;
            }
            let value = self
                .dialect
                .number(&field.text())
                .map(|value| value * self.unit.si_per_unit)
                .filter(|value| value.is_finite());
            values.push(value.ok_or_else(|| {
                let column = format!("column {count}");
                let message = if count == 1 {
                    format!("{}; {} is not a reading", counted(), quote(field.raw))
                } else {
                    format!(
                        "{} is not a reading; {}",
                        quote(field.raw),
                        self.dialect.number_hint()
                    )
                };
                lines.fault(lines.error_at(field.raw, message).key(column))
            })?);
        }
        if filled > layout.columns || values.len() < end {
            let message = format!(
                "the row has {filled} readings, Columns says {}",
                layout.columns
            );
            return Err(lines.fault(lines.line_error(message).key("Columns")));
        }
        // A line without end and without the commas of those before it may
        // have lost digits.
        let fields = *self.row_fields.get_or_insert(count);
        if !lines.terminated() && count < fields {
            return Err(lines.truncated(format!("{} and a part of the next", counted())));
        }
        Ok(())
    }

    /// Reads past the readings of a region: those of its cells once more.
    fn pass_over_group<R: BufRead>(
        &self,
        lines: &mut Lines<R>,
        sequence: u64,
        cells: Option<u64>,
    ) -> Result<(), RecordingError> {
        let cells = cells.unwrap_or(0);
        let mut seen = 0;
        while seen < cells {
            if !lines.advance()? {
                return Err(lines.truncated(format!(
                    "frame {sequence} has a group with {seen} of {cells} readings"
                )));
            }
            let mut dialect = self.dialect.clone();
            for field in self.dialect.fields(lines.text()) {
                if field.raw.is_empty() {
                    continue;
                }
                if dialect.number(&field.text()).is_none() {
                    // The next block; the group counted otherwise.
                    lines.again();
                    return Ok(());
                }
                seen += 1;
            }
        }
        Ok(())
    }

    fn time<R: BufRead>(&mut self, lines: &Lines<R>, raw: &str) -> Result<u64, RecordingError> {
        let of_day = time_of_day(raw).ok_or_else(|| {
            let message = format!("{} is not a time of day such as 08:21:17.982", quote(raw));
            lines.fault(lines.error_at(raw, message).key("Time"))
        })?;
        self.clock.elapsed(of_day).ok_or_else(|| {
            let message = format!("{} lies before the time of the first frame", quote(raw));
            lines.fault(lines.error_at(raw, message).key("Time"))
        })
    }
}

impl Clock {
    /// Time since the first call, ns, if it is not negative.
    fn elapsed(&mut self, of_day: i128) -> Option<u64> {
        let Some(latest) = self.latest else {
            self.start = of_day;
            self.latest = Some(of_day);
            return Some(0);
        };
        // The day that brings it nearest to the frame before.
        let step = (of_day - latest + DAY_NS / 2).rem_euclid(DAY_NS) - DAY_NS / 2;
        self.latest = Some(latest + step);
        u64::try_from(latest + step - self.start).ok()
    }
}

/// `08:21:17.982` or `8:21:17.982 PM`, ns since midnight.
fn time_of_day(text: &str) -> Option<i128> {
    let text = text.trim_matches('"').trim();
    let (clock, half) = match text.split_once(char::is_whitespace) {
        Some((clock, half)) => (clock, half.trim().to_ascii_lowercase().replace('.', "")),
        None => (text, String::new()),
    };
    let mut parts = clock.split(':');
    let mut hours = parts.next()?.parse::<u8>().ok()?;
    let minutes = parts.next()?.parse::<u8>().ok()?;
    let seconds = parts.next()?.replace(',', ".");
    let second_ns = scaled_integer(&seconds, 9)?;
    match half.as_str() {
        "" => {}
        "am" | "pm" if (1..=12).contains(&hours) => {
            hours = hours % 12 + if half == "pm" { 12 } else { 0 };
        }
        _ => return None,
    }
    // 61 s: a leap second.
    if parts.next().is_some() || hours > 23 || minutes > 59 || second_ns >= 61_000_000_000 {
        return None;
    }
    let minutes = i128::from(hours) * 60 + i128::from(minutes);
    Some(minutes * 60_000_000_000 + i128::from(second_ns))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::super::Recording;
    use super::*;

    /// Two frames of two sensors and one group, over midnight.
    fn small() -> String {
        let mut text =
            "\u{feff}File:,\"C:\\a,b.XSN\",,\n,,,\nUnits:,kPa,,\n,,,\nThreshold:,0.5,,\n,,,\n"
                .to_owned();
        for (frame, time, value) in [(7, "23:59:59.990", 1), (9, "00:00:00.005", 2)] {
            let head = format!("FRAME,{frame},,\n,,,\nDate, 2022 Aug 16,,\nTime, {time},,\n,,,\n");
            text.push_str(&head);
            for (sensor, first) in [("left", value), ("right", value + 10)] {
                let block = format!(
                    "SENSOR,{sensor},,\nRows,2,,\nColumns,3,,\nSensel Width (cm),0.86,,\n\
                     Sensel Height (mm),5,,\nPeak Pressure (kPa),9,,\n,,,\nSENSELS,,,\n\
                     {first},1.5,0,\n,,,\n0,0,9,\n,,,\n"
                );
                text.push_str(&block);
            }
            text.push_str(
                "GROUP,1,,\nName,toe,,\nCells,5,,\nSENSELS,,,\n,,,\n1,2,3,4\n,,,\n5,,,\n,,,\n",
            );
        }
        text
    }

    #[test]
    fn each_sensor_can_be_asked_for() {
        let text = small();
        let first = Recording::open("t.csv", text.as_bytes()).unwrap();
        assert_eq!(first.sensors(), ["left", "right"]);
        let stream = first.stream().clone();
        assert_eq!(
            (stream.name.as_str(), stream.rows, stream.columns),
            ("left", 2, 3)
        );
        // Row pitch is the height of a sensel; one rounding each.
        let pitch = stream.pitch.unwrap();
        assert!((pitch[0] - 0.005).abs() < 1e-17 && (pitch[1] - 0.0086).abs() < 1e-17);
        assert_eq!(stream.threshold, Some(500.0));
        let frames: Vec<_> = first.map(Result::unwrap).collect();
        assert_eq!(frames[1].values, [2000.0, 1500.0, 0.0, 0.0, 0.0, 9000.0]);

        let right = Recording::open_sensor("t.csv", text.as_bytes(), "right").unwrap();
        let frames: Vec<_> = right.map(Result::unwrap).collect();
        assert_eq!(frames[0].values[0], 11000.0);

        let error = Recording::open_sensor("t.csv", text.as_bytes(), "middle").unwrap_err();
        assert!(error.to_string().contains("it has left, right"), "{error}");
    }

    #[test]
    fn time_runs_on_past_midnight() {
        let text = small();
        let frames: Vec<_> = Recording::open("t.csv", text.as_bytes())
            .unwrap()
            .map(Result::unwrap)
            .collect();
        assert_eq!((frames[0].sequence, frames[0].time_ns), (7, 0));
        assert_eq!((frames[1].sequence, frames[1].time_ns), (9, 15_000_000));
    }

    #[test]
    fn times_of_day_with_and_without_halves() {
        let noon = 12 * 3_600_000_000_000;
        assert_eq!(time_of_day("12:00:00"), Some(noon));
        assert_eq!(time_of_day("12:00:00 PM"), Some(noon));
        assert_eq!(time_of_day("12:00:00.5 a.m."), Some(500_000_000));
        for wrong in [
            "",
            "12:00",
            "24:00:00",
            "12:60:00",
            "12:00:61",
            "-1:00:00",
            "1:2:3:4",
            "13:00:00 PM",
        ] {
            assert_eq!(time_of_day(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_missing_last_group_is_a_cut_recording_whose_frame_is_kept() {
        let text = small();
        let cut = &text[..text.rfind("GROUP").unwrap()];
        let mut recording = Recording::open("t.csv", cut.as_bytes()).unwrap();
        assert!(recording.by_ref().take(2).all(|frame| frame.is_ok()));
        match recording.next() {
            Some(Err(RecordingError::Truncated {
                complete_frames: 2,
                error,
            })) => {
                assert!(
                    error.message.contains("2 of 3 SENSOR and GROUP blocks"),
                    "{error}"
                );
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn mistakes_are_named_with_place_and_allowed_values() {
        let cases = [
            ("Units:,kPa", "Units:,ell", "mmHg"),
            ("Units:,kPa", "Unit:,kPa", "no line `Units:`"),
            ("Threshold:,0.5", "Threshold:,-1", "0 or more"),
            ("FRAME,9", "FRAME,nine", "not a frame number"),
            ("Time, 00:00:00.005", "Time, noon", "not a time of day"),
            (
                "Time, 00:00:00.005",
                "Time, 23:59:59.000",
                "before the time of the first frame",
            ),
            ("Rows,2", "Rows,1000000000", "1 to 1000000"),
            ("Rows,2", "Rows,900000", "2700000 taxels"),
            ("Rows,2", "Row,2", "no line `Rows`"),
            ("Rows,2", "Rows,1", "outside of the rows"),
            ("Rows,2", "Rows,3", "has 2 of 3 rows"),
            ("Columns,3", "Columns,2", "has 3 readings, Columns says 2"),
            ("Columns,3", "Columns,4", "`` is not a reading"),
            ("Width (cm),0.86", "Width (cm),NaN", "above 0, up to 1 m"),
            ("Width (cm),0.86", "Width (ell),0.86", "above 0, up to 1 m"),
            ("1.5,0,", "1.5.1,0,", "`1.5.1` is not a reading"),
        ];
        for (from, to, message) in cases {
            let text = small().replacen(from, to, 1);
            let result = Recording::open("t.csv", text.as_bytes())
                .and_then(Iterator::collect::<Result<Vec<_>, _>>);
            match result {
                Err(RecordingError::Input(error)) => {
                    assert!(error.place.is_some(), "{error}");
                    assert!(error.to_string().contains(message), "{error}");
                }
                other => panic!("{from} -> {to}: {other:?}"),
            }
        }
    }
}
