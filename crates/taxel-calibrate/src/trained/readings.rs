//! Recordings of a device that is to be trained: their shape shows what
//! the files hold.

use std::sync::LazyLock;

use crate::options::{CalibrateOptions, ScaleUnit};
use crate::readings::ReadingTable;
use crate::remark::Remark;
use crate::training::{STANDARD_GRAVITY, Series, Session};
use taxel::InputError;
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::{FORCE, LENGTH, MOMENT, TIME};
use taxel::trained::Component;

/// Readings of a scale that determine a map: ten for each fifth of a run.
pub(super) const LEAST_READINGS: usize = 50;

/// A file with its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrainingFile {
    /// Name for messages.
    pub name: String,
    /// Contents of the file.
    pub text: String,
}

/// One run with what its files hold.
#[derive(Debug)]
pub(super) struct Run {
    pub(super) name: String,
    pub(super) session: Session,
    /// True if it has places.
    pub(super) placed: bool,
}

/// Numbers of a stage beside the time: x, y, z, and the reading of a scale.
const STAGE: [usize; 2] = [3, 4];
/// Two recordings that begin and end this near to each other have one span, s.
const NEAR: f64 = 1.0;
/// Times of two versions of a recording differ by less than this, s, and their readings by less
/// than this share beside a constant.
const SAME_TIME: f64 = 1e-3;
const SAME_READING: f64 = 1e-6;
/// Forces this many times smaller than the full scale may be in another unit.
const FAR: f64 = 20.0;
/// Columns of a table before those of the channels.
const TRUTHS: usize = 10;
const CHANNEL: &str = "channel_";

static CHANNELS: LazyLock<Vec<String>> = LazyLock::new(|| {
    let count = taxel::sensor::MOST_CHANNELS;
    (1..=count).map(|i| format!("{CHANNEL}{i}")).collect()
});

/// Columns of a table of a device with so many channels.
fn columns(channels: usize) -> Vec<LoadColumn> {
    let column = |name, kind, required, about| LoadColumn {
        name,
        short: name,
        kind,
        required,
        about,
    };
    let place = LoadKind::Quantity(&LENGTH, [-10.0, 10.0]);
    let all = f64::MAX;
    let truths = [
        column("time", LoadKind::Quantity(&TIME, [-all, all]), true, "time"),
        column("x", place, false, "place of the probe"),
        column("y", place, false, "place of the probe"),
        column("z", place, false, "height of the probe"),
        column(
            "force_z",
            LoadKind::Quantity(&FORCE, [-1e4, 1e4]),
            false,
            "pressing force",
        ),
        column(
            "force_x",
            LoadKind::Quantity(&FORCE, [-1e4, 1e4]),
            false,
            "force along x",
        ),
        column(
            "force_y",
            LoadKind::Quantity(&FORCE, [-1e4, 1e4]),
            false,
            "force along y",
        ),
        column(
            "moment_x",
            LoadKind::Quantity(&MOMENT, [-1e4, 1e4]),
            false,
            "moment about x",
        ),
        column(
            "moment_y",
            LoadKind::Quantity(&MOMENT, [-1e4, 1e4]),
            false,
            "moment about y",
        ),
        column(
            "moment_z",
            LoadKind::Quantity(&MOMENT, [-1e4, 1e4]),
            false,
            "moment about z",
        ),
    ];
    let channel =
        |name: &'static String| column(name, LoadKind::Number([-all, all]), true, "reading");
    let channels = CHANNELS.iter().take(channels).map(channel);
    truths.into_iter().chain(channels).collect()
}

/// The runs in groups of files that lie together; `masked` says for each channel
/// whether the sensor file masks it.
pub(super) fn runs(
    masked: &[bool],
    groups: &[Vec<TrainingFile>],
    (full_scale, options): (f64, &CalibrateOptions),
    remarks: &mut Vec<Remark>,
) -> Result<Vec<Run>, InputError> {
    let mut runs = Vec::new();
    for group in groups {
        let (bare, tables): (Vec<_>, Vec<_>) = group
            .iter()
            .partition(|file| Series::recognises(&file.text));
        if let (Some(_), Some(file)) = (options.scale_unit, tables.first()) {
            let message = "the unit of a scale is that of the column force_z, in brackets";
            return Err(InputError::whole(&file.name, message).help("leave out --scale-unit"));
        }
        for file in tables {
            runs.push(table(masked, file, options.rate, remarks)?);
        }
        pairs(
            masked,
            &bare,
            (full_scale, options.scale_unit),
            &mut runs,
            remarks,
        )?;
    }
    for run in &mut runs {
        run.session.sensor.silence(masked);
    }
    Ok(runs)
}

/// Each sensor's series with the stage's that overlaps it most.
fn pairs(
    masked: &[bool],
    files: &[&TrainingFile],
    (full_scale, scale_unit): (f64, Option<ScaleUnit>),
    runs: &mut Vec<Run>,
    remarks: &mut Vec<Remark>,
) -> Result<(), InputError> {
    let channels = masked.len();
    let (mut sensors, mut stages) = (Vec::new(), Vec::new());
    for file in files {
        let series = Series::parse(&file.name, &file.text)?;
        if series.doubled() > 0 {
            remarks.push(Remark::whole(format!(
                "{}: {} rows repeat the one before, time and all, and are left out",
                file.name,
                series.doubled()
            )));
        }
        // A reading that is missing in training is a mistake, not a gap; but a
        // scale need not have one in each row.
        let needed = |column: usize| match series.width() {
            width if width == channels => match column.checked_sub(1) {
                Some(channel) => masked.get(channel) == Some(&false),
                None => true,
            },
            _ => column < 1 + STAGE[0],
        };
        Series::refuse_missing(&file.name, &file.text, needed)?;
        match series.width() {
            width if width == channels => sensors.push((*file, series)),
            width if STAGE.contains(&width) => stages.push((*file, series)),
            width => {
                let message = format!(
                    "a row has {width} numbers beside the time; the sensor has {channels} channels, and a stage 3 or 4"
                );
                return Err(InputError::whole(&file.name, message).help(
                    "give the recording of this sensor, or the sensor file of this recording",
                ));
            }
        }
    }
    leave_out_versions(&mut sensors, remarks);
    // The recording that a stage overlaps most takes it first.
    let most = |sensor: &Series| {
        let overlaps = stages.iter().map(|(_, stage)| common(sensor, stage));
        overlaps.fold(f64::NEG_INFINITY, f64::max)
    };
    sensors.sort_by(|a, b| most(&b.1).total_cmp(&most(&a.1)));
    let before = runs.len();
    for (file, sensor) in sensors {
        let overlap = |stage: &Series| common(&sensor, stage);
        let best = (0..stages.len())
            .max_by(|a, b| overlap(&stages[*a].1).total_cmp(&overlap(&stages[*b].1)));
        let Some(best) = best else {
            if runs.len() > before {
                remarks.push(Remark::whole(format!(
                    "{}: no file with positions or forces beside it is of this recording; it is left out",
                    file.name
                )));
                continue;
            }
            let message =
                "there is no file with the positions or forces of this recording beside it";
            return Err(InputError::whole(&file.name, message).help(
                "a stage's file has the time [s], x, y, z [mm] and, with a scale, its reading [g]",
            ));
        };
        let (stage_file, stage) = stages.swap_remove(best);
        let unit = unit_of(&stage_file.name, &stage, full_scale, scale_unit)?;
        let session = Session::with_scale(&stage_file.name, sensor, &stage, unit)?;
        let (all, used) = (stage.times().len(), session.place.times().len());
        if used < all {
            remarks.push(Remark::whole(format!(
                "{}: {} of {all} rows are from when the sensor was not read and are left out",
                stage_file.name,
                all - used
            )));
        }
        let [begin, end] = ends(&stage);
        let outside = |time: &&f64| !(begin - NEAR..=end + NEAR).contains(*time);
        let outside = session.sensor.times().iter().filter(outside).count();
        if outside > 0 {
            remarks.push(Remark::whole(format!(
                "{}: {outside} of {} frames are from before or after those of the stage and train nothing",
                file.name,
                session.sensor.times().len()
            )));
        }
        runs.push(Run {
            name: file.name.clone(),
            session,
            placed: true,
        });
    }
    match stages.first() {
        Some((file, _)) => Err(InputError::whole(
            &file.name,
            format!("there is no recording of {channels} channels beside it"),
        )
        .help("a sensor's file has the time [s] and its channels, without a header")),
        None => Ok(()),
    }
}

/// Time that two recordings have in common, s; negative for a pause between them.
fn common(a: &Series, b: &Series) -> f64 {
    let ([a, b], [c, d]) = (ends(a), ends(b));
    b.min(d) - a.max(c)
}

/// Leaves out recordings that are others less a constant of each channel, as a program saves
/// them beside those that came: the ones that came are kept.
fn leave_out_versions(sensors: &mut Vec<(&TrainingFile, Series)>, remarks: &mut Vec<Remark>) {
    let size = |series: &Series| -> f64 { series.rows()[0].iter().map(|value| value.abs()).sum() };
    let mut out: Vec<usize> = Vec::new();
    for (number, (_, own)) in sensors.iter().enumerate() {
        let raw = |(other, (_, series)): (usize, &(&TrainingFile, Series))| {
            other != number
                && is_version(own, series)
                && (size(series), number) > (size(own), other)
        };
        if sensors.iter().enumerate().any(raw) {
            out.push(number);
        }
    }
    for number in out.into_iter().rev() {
        let (file, _) = sensors.remove(number);
        remarks.push(Remark::whole(format!(
            "{}: the readings of another file beside it, less a constant of each channel; it is left out",
            file.name
        )));
    }
}

/// True if two series have the same times and differ by a constant of each channel.
fn is_version(a: &Series, b: &Series) -> bool {
    let same = |(a, b): (&f64, &f64)| (a - b).abs() < SAME_TIME;
    if a.times().len() != b.times().len() || !a.times().iter().zip(b.times()).all(same) {
        return false;
    }
    (0..a.width().min(b.width())).all(|channel| {
        let offset = a.rows()[0][channel] - b.rows()[0][channel];
        let pairs = a.rows().iter().zip(b.rows());
        let mut off = pairs.map(|(a, b)| (a[channel] - b[channel] - offset).abs());
        let size = a.rows()[0][channel].abs() + b.rows()[0][channel].abs() + 1.0;
        off.all(|off| off.is_nan() || off <= SAME_READING * size)
    })
}

/// Unit of a scale that does not say it: grams, unless they would be far from what the sensor is
/// drawn for while newtons would not.
fn unit_of(
    name: &str,
    stage: &Series,
    full_scale: f64,
    asked: Option<ScaleUnit>,
) -> Result<ScaleUnit, InputError> {
    if let Some(unit) = asked {
        return Ok(unit);
    }
    let readings = stage.rows().iter().filter_map(|row| row.get(3));
    let known: Vec<&f64> = readings.filter(|r| r.is_finite() && **r >= 0.0).collect();
    // A recording that is too short is refused for that.
    if known.len() < LEAST_READINGS {
        return Ok(ScaleUnit::Grams);
    }
    let largest = known.into_iter();
    let largest = largest.fold(0.0_f64, |most, reading| most.max(*reading));
    let grams = largest * 1e-3 * STANDARD_GRAVITY;
    let far = grams > 0.0 && grams < full_scale / FAR;
    if far && (full_scale / FAR..=full_scale * FAR).contains(&largest) {
        let message = format!(
            "the largest reading of the scale is {largest:.3}: as grams {grams:.3} N, as newtons {largest:.3} N, of a full scale of {full_scale} N"
        );
        return Err(InputError::whole(name, message).key("force_z").help(
            "say which it is with --scale-unit N or --scale-unit g; if it is grams, correct element.trained.full_scale",
        ));
    }
    Ok(ScaleUnit::Grams)
}

/// First and last time.
fn ends(series: &Series) -> [f64; 2] {
    [series.times()[0], series.times()[series.times().len() - 1]]
}

/// A table with a header: one row for each frame.
fn table(
    masked: &[bool],
    file: &TrainingFile,
    rate: Option<f64>,
    remarks: &mut Vec<Remark>,
) -> Result<Run, InputError> {
    let channels = masked.len();
    refuse_more_channels(channels, file)?;
    let mut columns = columns(channels);
    columns[0].required = rate.is_none();
    let data = ReadingTable::parse(&file.name, &file.text, &columns, "");
    let data = data.map_err(without_time)?;
    for remark in &data.remarks {
        remarks.push(Remark::whole(format!("{}: {remark}", file.name)));
    }
    let [time, x, y, z, force] = [0, 1, 2, 3, 4];
    if rate.is_some() && data.given[time] {
        let help = "leave out --rate, or the column";
        return Err(data.error(
            "time",
            "the rows have times, and a rate is given as well",
            help,
        ));
    }
    // Rows without a time come one period after the other.
    let period = rate.filter(|_| !data.given[time]).map(f64::recip);
    if let Some(period) = period {
        remarks.push(Remark::whole(format!(
            "{}: it has no time; its rows are taken {period:.6} s apart, as --rate says",
            file.name
        )));
    }
    if data.given[x] != data.given[y] {
        let help = "give x and y, or neither";
        return Err(data.error("x", "a place needs x and y", help));
    }
    let rows = 0..data.len();
    let filled = |row: usize| [x, y].iter().all(|c| data.number(row, *c).is_some());
    // Empty columns are none.
    let has_places = data.given[x] && rows.clone().any(filled);
    if data.given[x] && !has_places {
        remarks.push(Remark::whole(format!(
            "{}: x and y are empty; no position is learned",
            file.name
        )));
    }
    let at = |row: usize, column: usize| data.number(row, column).unwrap_or(0.0);
    let whole = |row: &usize| !has_places || filled(*row);
    let series = |rows: &[usize], columns: &[usize]| {
        let times = rows.iter().map(|row| match period {
            Some(period) => *row as f64 * period,
            None => at(*row, time),
        });
        let times = times.collect();
        let values = rows
            .iter()
            .map(|row| columns.iter().map(|c| at(*row, *c)).collect());
        Series::new(times, values.collect())
    };
    let rising = || data.error("time", "the times do not rise", "correct the times");
    let placed: Vec<usize> = rows.clone().filter(whole).collect();
    let all: Vec<usize> = rows.clone().collect();
    let weighed: Vec<usize> = rows
        .filter(|row| data.number(*row, force).is_some())
        .collect();
    let readings: Vec<usize> = (TRUTHS..TRUTHS + channels).collect();
    let mut components = Vec::new();
    for (at, component) in Component::ALL.into_iter().enumerate() {
        let column = force + 1 + at;
        let given = |row: &usize| data.number(*row, column).is_some();
        let known: Vec<usize> = (0..data.len()).filter(given).collect();
        if known.len() > 1 {
            components.push((component, series(&known, &[column]).ok_or_else(rising)?));
        }
    }
    if placed.len() < 2 {
        return Err(data.error("x", "fewer than two rows have a place", "fill the columns"));
    }
    if placed.len() < all.len() {
        remarks.push(Remark::whole(format!(
            "{}: {} of {} rows have no place; they are readings of the rest, of forces and of pauses",
            file.name,
            all.len() - placed.len(),
            all.len()
        )));
    }
    Ok(Run {
        name: file.name.clone(),
        session: Session {
            sensor: series(&all, &readings).ok_or_else(rising)?,
            place: series(&placed, &[x, y, z]).ok_or_else(rising)?,
            force: series(&weighed, &[force]).filter(|force| force.times().len() > 1),
            components,
            rest: None,
            scale_clock: None,
        },
        placed: has_places,
    })
}

/// A table without a time may have a rate.
fn without_time(error: InputError) -> InputError {
    if error.message.starts_with("column time ") {
        let help = "add the column time [s]; or, if the rows come at an even rate, give it, such as --rate \"28 Hz\"";
        return error.help(help);
    }
    error
}

/// A header that names more channels than the sensor has is of another one.
fn refuse_more_channels(channels: usize, file: &TrainingFile) -> Result<(), InputError> {
    let lines = (1..).zip(file.text.lines());
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let Some((number, line)) = lines.next() else {
        return Ok(());
    };
    let titles = line.split([',', ';', '\t']).map(str::trim);
    let of = |title: &str| {
        title
            .split('[')
            .next()?
            .trim()
            .strip_prefix(CHANNEL)?
            .parse::<usize>()
            .ok()
    };
    let Some(title) = titles
        .into_iter()
        .find(|title| of(title).is_some_and(|n| n > channels))
    else {
        return Ok(());
    };
    let column = line
        .find(title)
        .map_or(1, |at| line[..at].chars().count() + 1);
    let message = format!("the sensor has {channels} channels");
    let width = title.chars().count();
    Err(
        InputError::on_line(&file.name, number, line, column, width, message)
            .help("give the recording of this sensor, or the sensor file of this recording"),
    )
}
