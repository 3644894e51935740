//! Training of a device without a physical model, from recordings of indentations of
//! known position and force.

mod broken;
mod force;
mod place;
mod plausible;
mod presses;
mod readings;

use crate::options::{CalibrateOptions, NamedSensor};
use crate::outcome::{Outcome, Provenance};
use crate::readings::MEANT;
use crate::remark::Remark;
use crate::split::HoldOut;
use crate::toml_tables::{append, rounded};
use taxel::InputError;
use taxel::estimation::rest_at_start;
use taxel::trained::{Relation, RestStatistics, Standard, TrainedMaps, TrainingError};

use crate::training::{Compared, REST_FRAMES, Session, trained_relation};

use readings::Run;

pub use readings::TrainingFile;

/// Result of a training: that of any calibration, and the maps.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainedOutcome {
    /// Residuals of held-out rows, comparisons, remarks and figures; it has no
    /// parameters.
    pub outcome: Outcome,
    /// The maps as the file keeps them, numbers of nine digits.
    pub maps: TrainedMaps,
}

/// Frames of the empty body that are averaged, and deviations of their mean that are noise.
const BLOCK: usize = 25;
const SURELY: f64 = 4.0;
/// Time in which what a body shows of a contact that has gone falls to 1/e at the latest, s. The
/// public recordings of a printed lattice halve it in less than a minute.
const CREEP_FADES: f64 = 300.0;

/// Trains the maps that the recordings determine: positions on an area give a map of
/// the position, readings of a scale one of the force. Files of one group lie
/// together; a recording without a header is joined with the stage's of its
/// group that has the same times.
///
/// # Errors
/// Error of a file, or of all of them.
pub fn train(
    named: &NamedSensor<'_>,
    groups: &[Vec<TrainingFile>],
    options: &CalibrateOptions,
) -> Result<TrainedOutcome, InputError> {
    let first = groups.iter().flatten().next();
    let file = first.map_or("recordings", |file| file.name.as_str());
    let array = named
        .sensor
        .trained()
        .map_err(|unreadable| InputError::whole(named.name, unreadable.to_string()))?;
    if options.model.is_some() || options.profile || options.robust {
        let message = "maps that are learned have no model, profile or robust loss to choose";
        return Err(InputError::whole(file, message).help("leave out --model, --profile, --robust"));
    }
    if options.hold_out != HoldOut::default() {
        let message = "maps that are learned hold out whole runs and blocks of them";
        return Err(InputError::whole(file, message).help("leave out --hold-out"));
    }
    let masked = array.body.masked(&named.sensor.mask);
    let mut remarks = Vec::new();
    let wanted = (array.body.full_scale, options);
    let mut runs = readings::runs(&masked, groups, wanted, &mut remarks)?;
    if runs.is_empty() {
        return Err(InputError::whole(file, "there is no recording")
            .help("give tables, or folders with the CSV files of the sensor and of the stage"));
    }
    let mut found = Outcome {
        noise: String::from("from held-out rows"),
        remarks,
        ..Outcome::new("trained", &[(named, "")])
    };
    plausible::check(&runs, array.body.full_scale)?;
    found.remarks.extend(other_rate(named, options));
    let broken = broken::leave_out(&mut runs, &array.body.channels(), &mut found.remarks);
    let position = place::train(&runs, &array.area(), &mut found)?;
    let weighs = runs.iter().any(|run| run.session.force.is_some());
    let rest = weighs.then(|| rest(&mut runs));
    let noisier = rest.as_ref().and_then(|rest| noisier(named, rest, &broken));
    found.remarks.extend(noisier);
    let tared = position.is_none();
    let relation = relation(&runs, tared).map_err(|error| failed(file, &error))?;
    let learned = (rest.as_ref(), relation.as_ref());
    let force = force::train(
        &runs,
        named.sensor.electronics.frame_rate,
        learned,
        &mut found,
    )?;
    if position.is_none() && force.is_none() {
        let message = "the recordings have neither positions all over an area nor forces: there is nothing to train";
        let help =
            "press at many positions, or record a scale; a table needs columns x and y, or force_z";
        let mut remarks = found.remarks.iter().map(ToString::to_string);
        let help = match remarks.find(|remark| remark.contains(MEANT)) {
            Some(remark) => format!("{remark}; {help}"),
            None => help.to_owned(),
        };
        return Err(InputError::whole(file, message).help(help));
    }
    let rest = rest.filter(|_| force.is_some());
    if let Some(rest) = rest.as_ref().filter(|rest| rest.recovery > 0.0) {
        found.remarks.push(Remark::whole(format!(
            "zero: the empty body creeps after a contact, so a drift that looks like a touch is followed only when nothing has \
             touched for {:.0} s; until then the stated deviation has what the pauses between touches show of it",
            rest.recovery
        )));
    }
    let maps = TrainedMaps {
        channels: masked.len(),
        rest,
        position,
        force,
        relation,
    };
    let maps = rounded(maps).ok_or_else(|| {
        InputError::whole(file, "the maps have no finite numbers").help("check the readings")
    })?;
    left_out(named, &maps, &broken, &mut found.remarks);
    Ok(TrainedOutcome {
        outcome: found,
        maps,
    })
}

impl TrainedOutcome {
    /// The calibration file as text.
    pub fn to_toml(&self, about: &Provenance<'_>) -> String {
        let mut text = self.outcome.to_toml(about);
        append(&mut text, &self.maps);
        text
    }
}

/// Runs of which a force is known.
fn weighed(runs: &[Run]) -> impl Iterator<Item = &Run> {
    runs.iter().filter(|run| run.session.force.is_some())
}

/// The relation of the channels over all runs: tared where each begins at rest.
fn relation(runs: &[Run], tared: bool) -> Result<Option<Relation>, TrainingError> {
    let of = |run: &Run| -> Vec<Vec<f64>> {
        let rows = run.session.sensor.rows();
        if !tared {
            return rows.to_vec();
        }
        let rest = run.session.baseline();
        let less = |row: &Vec<f64>| row.iter().zip(&rest).map(|(x, b)| x - b).collect();
        rows.iter().map(less).collect()
    };
    let used = runs
        .iter()
        .filter(|run| !tared || run.session.force.is_some());
    let rows: Vec<Vec<Vec<f64>>> = used.map(of).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    trained_relation(&rows, tared)
}

/// Readings without contact over all runs that begin so; each run gets the rest that a capture at
/// its start takes live.
fn rest(runs: &mut [Run]) -> RestStatistics {
    let deviation = deviations(runs);
    for run in runs.iter_mut().filter(|run| run.session.force.is_some()) {
        let frames = run.session.sensor.rows();
        run.session.rest = Some(rest_at_start(frames, &deviation, REST_FRAMES));
    }
    let baselines: Vec<Vec<f64>> = weighed(runs).map(|run| run.session.baseline()).collect();
    let mean = |channel: usize| {
        baselines.iter().map(|row| row[channel]).sum::<f64>() / baselines.len() as f64
    };
    let width = deviation.len();
    RestStatistics {
        mean: (0..width).map(mean).collect(),
        step: (0..width)
            .map(|channel| least_step(runs, channel))
            .collect(),
        recovery: recovery(runs, &deviation),
        deviation,
    }
}

/// Time after a contact until what the body shows of it is less than the noise of a reading, s.
///
/// What it shows is the mean of a block of frames in which the scale reads nothing, less the
/// reading at rest, beyond the noise of both means; of all channels the largest over its noise.
fn recovery(runs: &[Run], deviation: &[f64]) -> f64 {
    let mut most = 1.0_f64;
    for run in weighed(runs) {
        let session = &run.session;
        let Some(force) = &session.force else {
            continue;
        };
        let nothing = session.no_force();
        let empty = |time: f64| {
            let pressed = force.at(time, f64::INFINITY);
            pressed.is_some_and(|force| force[0] <= nothing)
        };
        let frames = session.sensor.times().iter().zip(session.sensor.rows());
        let frames = frames.filter(|(time, _)| empty(**time));
        let frames: Vec<&Vec<f64>> = frames.map(|(_, row)| row).collect();
        let counts = [BLOCK, session.rest_frames().len().max(1)];
        let noise = counts.map(|count| 1.0 / count as f64);
        let noise = (noise[0] + noise[1]).sqrt();
        let channels = session.baseline().into_iter().zip(deviation).enumerate();
        for (channel, (rest, deviation)) in channels {
            let shown = frames.iter().map(|row| row[channel] - rest);
            let shown: Vec<f64> = shown.filter(|shown| shown.is_finite()).collect();
            // What is left over is too short for a mean.
            for block in shown.chunks_exact(BLOCK) {
                let mean = block.iter().sum::<f64>() / BLOCK as f64;
                most = most.max(mean.abs() / deviation - SURELY * noise);
            }
        }
    }
    CREEP_FADES * most.ln()
}

/// Standard deviation of one reading of each channel before the first contact of each run.
fn deviations(runs: &[Run]) -> Vec<f64> {
    let baselines: Vec<Vec<f64>> = weighed(runs).map(|run| run.session.baseline()).collect();
    let deviation = |channel: usize| {
        let frames = weighed(runs).zip(&baselines).flat_map(|(run, baseline)| {
            let rows = run.session.rest_frames().iter();
            rows.map(move |row| (row[channel] - baseline[channel]).powi(2))
        });
        let (sum, count) = frames.fold((0.0, 0.0), |(sum, count), square| {
            (sum + square, count + 1.0)
        });
        // A quiet channel steps by its least digit.
        (sum / f64::max(count, 1.0))
            .sqrt()
            .max(least_step(runs, channel))
            .max(f64::MIN_POSITIVE)
    };
    let width = baselines.first().map_or(0, Vec::len);
    (0..width).map(deviation).collect()
}

/// Smallest change of a channel from frame to frame.
fn least_step(runs: &[Run], channel: usize) -> f64 {
    let pairs = weighed(runs).flat_map(|run| run.session.sensor.rows().windows(2));
    let steps = pairs.map(|pair| (pair[1][channel] - pair[0][channel]).abs());
    let least = steps
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// Rates of `--rate` and of the sensor file that differ by more than this factor are not the same.
const SAME_RATE: f64 = 1.2;

/// A rate of the rows that is not that of the device.
fn other_rate(named: &NamedSensor<'_>, options: &CalibrateOptions) -> Option<Remark> {
    let (asked, drawn) = (options.rate?, named.sensor.electronics.frame_rate);
    let same = (1.0 / SAME_RATE..=SAME_RATE).contains(&(asked / drawn));
    (!same).then(|| {
        Remark::whole(format!(
            "time: --rate says {asked} Hz and the sensor file {drawn} Hz; creep and delays are learned with the times of \
             --rate, and are wrong if the device comes at the other rate: correct one of the two"
        ))
    })
}

/// Noise at rest this many times that of the sensor file is more than it says.
const MORE_NOISE: f64 = 1.5;

/// Readings that scatter at rest by more than the sensor file says.
fn noisier(named: &NamedSensor<'_>, rest: &RestStatistics, broken: &[bool]) -> Option<Remark> {
    let unit = named.sensor.trained().ok()?.unit;
    let drawn = named.sensor.electronics.measured()?.deviation() / unit.si_per_unit;
    let found = rest.deviation.iter().zip(broken);
    let mut found: Vec<f64> = found
        .filter(|(_, broken)| !**broken)
        .map(|(d, _)| *d)
        .collect();
    found.sort_by(f64::total_cmp);
    let middle = *found.get(found.len() / 2)?;
    (middle > MORE_NOISE * drawn).then(|| {
        Remark::whole(format!(
            "noise: at rest half of the channels scatter by {middle:.3} {symbol} or more, and the sensor file says {drawn:.3} {symbol}; \
             what was measured counts",
            symbol = unit.symbol
        ))
    })
}

/// Says which channels the maps do without.
fn left_out(
    named: &NamedSensor<'_>,
    maps: &TrainedMaps,
    broken: &[bool],
    remarks: &mut Vec<Remark>,
) {
    let (names, masked) = named.sensor.trained().map_or_else(
        |_| Default::default(),
        |array| (array.body.channels(), array.body.masked(&named.sensor.mask)),
    );
    let standards = [
        maps.position.as_ref().map(|map| &map.standard),
        maps.force.as_ref().map(|map| &map.standard),
    ];
    let mut out: Vec<usize> = standards
        .into_iter()
        .flatten()
        .flat_map(Standard::left_out)
        .collect();
    out.sort_unstable();
    out.dedup();
    // Those were named when they were found.
    out.retain(|channel| broken.get(channel - 1) != Some(&true));
    let is_masked = |channel: &usize| masked.get(channel - 1) == Some(&true);
    let (masked, constant): (Vec<usize>, Vec<usize>) = out.into_iter().partition(is_masked);
    for (channels, what) in [
        (masked, "masked channels are left out"),
        (constant, "channels that do not change are left out"),
    ] {
        let named = |channel: &usize| {
            let name = names.get(channel - 1).map_or("", String::as_str);
            format!("{channel} ({name})")
        };
        let channels: Vec<String> = channels.iter().map(named).collect();
        remarks.extend(Remark::of_each(what, &channels));
    }
}

/// A training that failed, about a run or all of them.
fn failed(run: &str, error: &TrainingError) -> InputError {
    InputError::whole(run, error.to_string()).help(match error {
        TrainingError::TooFew { .. } => "give longer recordings",
        TrainingError::NoSignal => "check that the sensor was read: all its channels are constant",
        TrainingError::NoArea(..) => "press at positions all over the area, not along a line",
        _ => "give more varied presses",
    })
}

/// A comparison, the best first; shown scores are `scale` times SI.
fn compared(what: &str, mut all: Vec<Compared>, unit: &str, scale: f64) -> Vec<Remark> {
    all.sort_by(|a, b| b.score.log_likelihood.total_cmp(&a.score.log_likelihood));
    let line = |(rank, one): (usize, Compared)| {
        Remark::whole(format!(
            "{what}, {}. of the maps by held-out likelihood: {}, {:.3} {unit} rms, log likelihood {:.2}, coverage {:.1} %",
            rank + 1,
            one.name,
            one.score.rms * scale,
            one.score.log_likelihood - scale.ln(),
            100.0 * one.score.coverage
        ))
    };
    all.into_iter().enumerate().map(line).collect()
}

/// Sessions of runs.
fn sessions(runs: &[&Run]) -> Vec<Session> {
    runs.iter().map(|run| run.session.clone()).collect()
}
