//! Recordings of a device that is to be trained: their shape shows what
//! the files hold.

use std::sync::LazyLock;

use crate::readings::ReadingTable;
use crate::remark::Remark;
use crate::training::{Series, Session};
use taxel::predict::{LoadColumn, LoadKind};
use taxel::quantity::{FORCE, LENGTH, TIME};
use taxel_recording::InputError;

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
/// Columns of a table before those of the channels.
const TRUTHS: usize = 5;
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
    remarks: &mut Vec<Remark>,
) -> Result<Vec<Run>, InputError> {
    let mut runs = Vec::new();
    for group in groups {
        let (bare, tables): (Vec<_>, Vec<_>) = group
            .iter()
            .partition(|file| Series::recognises(&file.text));
        for file in tables {
            runs.push(table(masked, file, remarks)?);
        }
        pairs(masked, &bare, &mut runs, remarks)?;
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
    runs: &mut Vec<Run>,
    remarks: &mut Vec<Remark>,
) -> Result<(), InputError> {
    let channels = masked.len();
    let (mut sensors, mut stages) = (Vec::new(), Vec::new());
    for file in files {
        let series = Series::parse(&file.name, &file.text)?;
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
    for (file, sensor) in sensors {
        let overlap = |stage: &Series| {
            let ([a, b], [c, d]) = (ends(&sensor), ends(stage));
            b.min(d) - a.max(c)
        };
        let best = (0..stages.len())
            .max_by(|a, b| overlap(&stages[*a].1).total_cmp(&overlap(&stages[*b].1)));
        let Some(best) = best else {
            let message =
                "there is no file with the positions or forces of this recording beside it";
            return Err(InputError::whole(&file.name, message).help(
                "a stage's file has the time [s], x, y, z [mm] and, with a scale, its reading [g]",
            ));
        };
        let (stage_file, stage) = stages.swap_remove(best);
        let session = Session::new(&stage_file.name, sensor, &stage)?;
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

/// First and last time.
fn ends(series: &Series) -> [f64; 2] {
    [series.times()[0], series.times()[series.times().len() - 1]]
}

/// A table with a header: one row for each frame.
fn table(
    masked: &[bool],
    file: &TrainingFile,
    remarks: &mut Vec<Remark>,
) -> Result<Run, InputError> {
    let channels = masked.len();
    refuse_more_channels(channels, file)?;
    let columns = columns(channels);
    let data = ReadingTable::parse(&file.name, &file.text, &columns, "")?;
    for remark in &data.remarks {
        remarks.push(Remark::whole(format!("{}: {remark}", file.name)));
    }
    let [time, x, y, z, force] = [0, 1, 2, 3, 4];
    if data.given[x] != data.given[y] {
        let help = "give x and y, or neither";
        return Err(data.error("x", "a place needs x and y", help));
    }
    let rows = 0..data.len();
    let at = |row: usize, column: usize| data.number(row, column).unwrap_or(0.0);
    let whole = |row: &usize| {
        [x, y]
            .iter()
            .all(|c| !data.given[*c] || data.number(*row, *c).is_some())
    };
    let series = |rows: &[usize], columns: &[usize]| {
        let times = rows.iter().map(|row| at(*row, time)).collect();
        let values = rows
            .iter()
            .map(|row| columns.iter().map(|c| at(*row, *c)).collect());
        Series::new(times, values.collect())
    };
    let rising = || data.error("time", "the times do not rise", "correct the times");
    let all: Vec<usize> = rows.clone().filter(whole).collect();
    let weighed: Vec<usize> = rows
        .filter(|row| data.number(*row, force).is_some())
        .collect();
    let readings: Vec<usize> = (TRUTHS..TRUTHS + channels).collect();
    if all.len() < 2 {
        return Err(data.error("x", "fewer than two rows have a place", "fill the columns"));
    }
    Ok(Run {
        name: file.name.clone(),
        session: Session {
            sensor: series(&all, &readings).ok_or_else(rising)?,
            place: series(&all, &[x, y, z]).ok_or_else(rising)?,
            force: series(&weighed, &[force]).filter(|force| force.times().len() > 1),
        },
        placed: data.given[x],
    })
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
