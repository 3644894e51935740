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
use taxel::trained::{RestStatistics, Standard, TrainedMaps, TrainingError};

use crate::training::{Session, rest_of, trained_relation};

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
    train_saying(named, groups, options, &|_| ())
}

/// The same; `said` hears what is learned next, in words.
///
/// # Errors
/// As [`train`].
pub fn train_saying(
    named: &NamedSensor<'_>,
    groups: &[Vec<TrainingFile>],
    options: &CalibrateOptions,
    said: &dyn Fn(&str),
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
    for run in &mut runs {
        run.session.capture_rest();
    }
    // Positions are learned from readings less those at rest where every run shows its rest.
    let weighs = runs.iter().any(|run| run.session.rest.is_some());
    let tared = runs.iter().all(|run| run.session.rest.is_some());
    let rest = weighs.then(|| rest_of(&weighed(&runs).map(|run| &run.session).collect::<Vec<_>>()));
    let noisier = rest.as_ref().and_then(|rest| noisier(named, rest, &broken));
    found.remarks.extend(noisier);
    let at_rest = rest.as_ref().map(|rest| &rest.mean[..]);
    let frames: usize = runs
        .iter()
        .map(|run| run.session.sensor.times().len())
        .sum();
    let size = format!("{frames} frames of {} channels", masked.len());
    said(&format!("positions of {size}"));
    let (position, place) =
        place::train(&runs, &array.area(), at_rest.filter(|_| tared), &mut found)?;
    let tared = tared || position.is_none();
    said(&format!("forces of {size}, each part held out in turn"));
    let force = force::train(
        &runs,
        named.sensor.electronics.frame_rate,
        tared,
        &mut found,
    )?;
    let sessions: Vec<Session> = runs.iter().map(|run| run.session.clone()).collect();
    said(&format!("how the channels of {size} hang together"));
    let relation =
        trained_relation(&sessions, None, tared).map_err(|error| failed(file, &error))?;
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
    drop((sessions, runs));
    let rest = rest.filter(|_| force.is_some() || tared);
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
        place,
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

/// Sessions of runs.
fn sessions(runs: &[&Run]) -> Vec<Session> {
    runs.iter().map(|run| run.session.clone()).collect()
}
