//! The map of the force, and what runs say of the next one.

use rayon::prelude::*;

use super::readings::{LEAST_READINGS, Run};
use super::{failed, sessions, weighed};
use crate::outcome::{ModelComparison, Outcome, ResidualSummary, Scope};
use crate::remark::Remark;
use crate::training::{
    CONTACT_SHARE, Candidate, DELAY_READINGS, HeldOutReadings, NORMAL_95, Quick, ScaleClock,
    Series, Session, TrainedForces, WITHIN_ANOTHER, delay_of_scale, maps_of, train_forces,
};
use taxel::InputError;
use taxel::electronics::times_in_another_unit;
use taxel::figure::{Axis, Chart, Figure, Series as Curve, Style};
use taxel::trained::{Block, ForceMap};

/// Runs shorter than this show little of how the body creeps, s.
const SHORT: f64 = 60.0;
/// A map whose held-out errors exceed this share of the spread of the forces
/// leaves half of their variance: it does not determine the force.
const USELESS: f64 = 0.7;
/// An error without memory above this share of the spread may come from clocks.
const SUSPECT: f64 = 0.1;
/// Delays of the scale that are looked for when none of the usual is best, s.
const FARTHEST: i32 = 30;
/// Another delay is the right one when it leaves less than this share of the
/// error.
const CLEARLY_LESS: f64 = 0.7;
/// A delay that leaves fewer readings than this share is not considered: a map
/// may suit the few by chance.
const OVERLAP: f64 = 0.75;

/// The map of the force, where runs have a scale; `frame_rate` in Hz is that of
/// the device.
pub(super) fn train(
    runs: &[Run],
    frame_rate: f64,
    tared: bool,
    found: &mut Outcome,
) -> Result<Option<ForceMap>, InputError> {
    let runs = touched(runs, found)?;
    let Some(last) = runs.last() else {
        return Ok(None);
    };
    for run in &runs {
        begins_free(run)?;
        same_unit(run, frame_rate)?;
    }
    enough(&runs, found)?;
    let failed = |error| failed(&last.name, &error);
    let mut sessions = sessions(&runs);
    for (session, run) in sessions.iter_mut().zip(&runs) {
        session.scale_clock = ScaleClock::of(session).map_err(failed)?;
        found
            .remarks
            .extend(session.scale_clock.map(|clock| of_clock(&run.name, clock)));
    }
    let offset = delay_of_scale(&sessions).map_err(failed)?;
    same_clock(&last.name, &sessions)?;
    let trained = train_forces(&sessions, offset, tared).map_err(failed)?;
    tells_force(&last.name, &sessions, &trained)?;
    found.remarks.extend(mixture(&trained));
    found.remarks.extend(of_changes(&trained));
    found.remarks.push(among(&trained, runs.len()));
    found.remarks.push(of_runs(&trained, runs.len()));
    report(&trained, runs.len(), found);
    for ((component, map), held_out) in maps_of(&trained.map).into_iter().zip(&trained.held_out) {
        let Some(component) = component else { continue };
        let (name, unit) = (component.name(), component.unit());
        let largest = map.range[1].max(-map.range[0]);
        let score = held_out.score();
        found.remarks.push(Remark::whole(format!(
            "{name}: held out {:.4} {unit} rms of at most {largest:.3} {unit}, {:.1} % within the 95 % intervals",
            score.rms,
            100.0 * score.coverage
        )));
        found.hold_out.push(ResidualSummary::of(
            name.into(),
            unit,
            &held_out.errors,
            largest,
        ));
        found.scope.push(Scope {
            name: name.into(),
            unit,
            range: [-largest, largest],
        });
    }
    Ok(Some(trained.map))
}

/// Runs with a scale, without those in which nothing touches: they say nothing
/// of a force, and a map of them alone predicts no other run.
fn touched<'a>(runs: &'a [Run], found: &mut Outcome) -> Result<Vec<&'a Run>, InputError> {
    let runs: Vec<&Run> = weighed(runs).collect();
    let peaks = runs.iter().map(|run| run.session.peak_force());
    let peak = peaks.fold(0.0, f64::max);
    if let Some(run) = runs.first().filter(|_| peak <= 0.0) {
        return Err(InputError::whole(&run.name, "no force is above zero")
            .key("force_z")
            .help("pressing is positive"));
    }
    let (touched, free): (Vec<_>, Vec<_>) = runs
        .into_iter()
        .partition(|run| run.session.peak_force() > CONTACT_SHARE * peak);
    for run in free {
        found.remarks.push(Remark::whole(format!(
            "{}: its forces stay below {:.3} N, and others reach {peak:.3} N: nothing touches, and the run is left out",
            run.name,
            run.session.peak_force().max(0.0) + 0.0005
        )));
    }
    Ok(touched)
}

/// True if there are enough readings, and whether they last long enough.
fn enough(runs: &[&Run], found: &mut Outcome) -> Result<(), InputError> {
    let readings = |run: &&Run| {
        run.session
            .force
            .as_ref()
            .map_or(0, |force| force.times().len())
    };
    let count: usize = runs.iter().map(readings).sum();
    if count < LEAST_READINGS {
        let message =
            format!("{count} readings of the scale; at least {LEAST_READINGS} are needed");
        let help = "load and unload over the whole range, several times, for a minute or more";
        let name = runs.last().map_or("", |run| &run.name);
        return Err(InputError::whole(name, message).key("force_z").help(help));
    }
    let length = |run: &&Run| {
        let times = run.session.force.iter().flat_map(Series::times);
        times.clone().last().unwrap_or(&0.0) - times.clone().next().unwrap_or(&0.0)
    };
    let longest = runs.iter().map(length).fold(0.0, f64::max);
    if longest < SHORT {
        found.remarks.push(Remark::whole(format!(
            "force: the longest run lasts {longest:.0} s: what the body does over a minute of load is not learned"
        )));
    }
    Ok(())
}

/// Refuses times that are not in seconds.
fn same_unit(run: &Run, frame_rate: f64) -> Result<(), InputError> {
    match times_in_another_unit(run.session.sensor.usual_step(), frame_rate) {
        Some([message, help]) => Err(InputError::whole(&run.name, message).key("time").help(help)),
        None => Ok(()),
    }
}

/// Refuses a scale whose clock is not that of the sensor.
///
/// A map with memory learns presses that come evenly at any delay: channels alone show it.
fn same_clock(name: &str, runs: &[Session]) -> Result<(), InputError> {
    // One press is near each of its delays.
    if presses(runs) < 2 {
        return Ok(());
    }
    let Ok(quick) = Quick::of(runs) else {
        return Ok(());
    };
    let all: usize = runs
        .iter()
        .flat_map(|run| &run.force)
        .map(|force| force.times().len())
        .sum();
    // Error of a delay over the spread of the readings that it leaves.
    let error = |offset: f64| {
        let (squares, count) = quick.errors(offset, &[(&[Block::Channels], 0.0)]).ok()?;
        let enough = count as f64 >= OVERLAP * (all.min(DELAY_READINGS) as f64);
        enough.then(|| squares[0].sqrt())
    };
    // A scale may be a little late.
    let tenths: Vec<i32> = (-5..=15).collect();
    let near = tenths
        .into_par_iter()
        .filter_map(|tenths| error(0.1 * f64::from(tenths)));
    let usual = near.min_by(f64::total_cmp).unwrap_or(f64::INFINITY);
    if usual < SUSPECT {
        return Ok(());
    }
    let seconds: Vec<i32> = (-2 * FARTHEST..=2 * FARTHEST).collect();
    let tried = seconds.into_par_iter().filter_map(|halves| {
        let offset = 0.5 * f64::from(halves);
        Some((error(offset)?, offset))
    });
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, offset)) = best.filter(|(least, _)| *least < CLEARLY_LESS * usual) else {
        return Ok(());
    };
    let side = if offset < 0.0 { "before" } else { "after" };
    let message = format!(
        "the scale shows each press about {:.1} s {side} the sensor: their clocks differ",
        offset.abs()
    );
    Err(InputError::whole(name, message).key("time").help(format!(
        "correct the times of one of the two by {:.1} s, or record both with one clock",
        offset.abs()
    )))
}

/// Refuses a map that predicts held-out forces hardly better than their mean.
fn tells_force(name: &str, runs: &[Session], trained: &TrainedForces) -> Result<(), InputError> {
    let held_out = &trained.held_out[0];
    let (rms, spread) = (held_out.score().rms, spread(held_out));
    if rms <= USELESS * spread {
        return Ok(());
    }
    let message = format!(
        "the channels do not determine the force: held-out readings are predicted to {rms:.3} N rms, and they spread by {spread:.3} N themselves"
    );
    let help = if presses(runs) < 2 {
        "the force rises once only, which is too little to learn from: load and unload over the whole range, several times"
    } else {
        "check that the probe touches, and that both files are of one recording with one clock"
    };
    Err(InputError::whole(name, message).key("force_z").help(help))
}

/// How often the force rises above half of its peak.
fn presses(runs: &[Session]) -> usize {
    let rises = |run: &Session| {
        let half = 0.5 * run.peak_force();
        let rows = run.force.iter().flat_map(Series::rows);
        let above: Vec<bool> = rows.map(|row| row[0] > half).collect();
        above.windows(2).filter(|pair| !pair[0] && pair[1]).count()
    };
    runs.iter().map(rises).sum()
}

/// Standard deviation of the forces that were held out, N.
fn spread(held_out: &HeldOutReadings) -> f64 {
    let errors = held_out.estimates.iter().zip(&held_out.errors);
    let truth: Vec<f64> = errors.map(|(estimate, error)| estimate - error).collect();
    let mean = truth.iter().sum::<f64>() / truth.len().max(1) as f64;
    let squares: f64 = truth.iter().map(|force| (force - mean).powi(2)).sum();
    (squares / truth.len().max(1) as f64).sqrt()
}

/// The rest of a run is read from its first frames.
fn begins_free(run: &Run) -> Result<(), InputError> {
    let session = &run.session;
    let first = session.force.iter().flat_map(Series::rows).next();
    let first = first.map_or(0.0, |row| row[0]);
    let peak = session.peak_force();
    if first > CONTACT_SHARE * peak {
        let message = format!("the recording begins with {first:.3} N of at most {peak:.3} N");
        return Err(InputError::whole(&run.name, message)
            .key("force_z")
            .help("begin each recording before the first contact: its first frames give the readings at rest"));
    }
    Ok(())
}

/// What a scale with a clock of its own means for its readings.
fn of_clock(name: &str, clock: ScaleClock) -> Remark {
    Remark::whole(format!(
        "{name}: the scale measures every {:.4} s by a clock of its own, and a reading shows the last measurement, up to {:.2} s \
         older or younger than on average. The map is trained with the force of the time when it was measured; errors are \
         those at the times of the readings, of which {:.3} N rms are this age",
        clock.period,
        0.5 * clock.period,
        clock.error
    ))
}

/// What the map of the pressing force mixes, from simple to rich, and what each would do alone.
fn mixture(trained: &TrainedForces) -> Vec<Remark> {
    let name = |blocks: &[Block]| {
        let names: Vec<&str> = blocks.iter().map(|block| block.name()).collect();
        names.join(", ")
    };
    let of = |one: &Candidate| {
        Remark::whole(format!(
            "force, share {:.2} of the map of {}: {:.4} N rms of held-out readings alone, prior {}",
            one.share,
            name(&one.blocks),
            one.error,
            one.prior
        ))
    };
    trained.candidates[0].iter().map(of).collect()
}

/// That the channels see changes only, where what they do at the moment tells less of the force than what
/// they did lately adds to it.
fn of_changes(trained: &TrainedForces) -> Option<Remark> {
    let law = &trained.map.law;
    let least = |memory: bool| {
        let candidates = trained.candidates[0].iter();
        let candidates = candidates
            .filter(|one| memory || one.blocks.iter().all(|block| law.memory(*block).is_none()));
        candidates
            .map(|one| one.error)
            .fold(f64::INFINITY, f64::min)
    };
    let errors = [spread(&trained.held_out[0]), least(false), least(true)];
    let [all, present, past] = errors.map(|error| error * error);
    (all - present < present - past).then(|| {
        Remark::whole(format!(
            "force: the channels see changes: of forces that spread by {:.3} N what they show at the moment leaves {:.3} N, \
             with what they did lately {:.3} N. A force that is held is known from how it came, and after a gap in the frames \
             it is not known",
            errors[0], errors[1], errors[2]
        ))
    })
}

/// What is held out, and what is not.
fn among(trained: &TrainedForces, runs: usize) -> Remark {
    let score = trained.held_out[0].score();
    let times: Vec<String> = trained
        .map
        .law
        .times
        .iter()
        .map(|time| format!("{time:.3}"))
        .collect();
    Remark::whole(format!(
        "force: the mixture of these maps, with memory over {} s, scale {:.1} s after the sensor. Held out from all that is \
         learned, maps, priors, shares, relation and rest, {} have {:.4} N rms as live, {:.1} % within the 95 % intervals. The \
         readings of the training, replayed live, have {:.4} N rms",
        times.join(", "),
        trained.map.offset,
        if runs > 1 {
            "whole runs"
        } else {
            "fifths of the run"
        },
        score.rms,
        100.0 * score.coverage,
        trained.replayed
    ))
}

/// What no run shows of presses that none of them has.
const OTHER_PRESSES: &str = "They hold for presses as those of the runs: a probe of another width or shape loads the channels \
     otherwise, which readings that look alike do not show; press with every kind of probe that is to be weighed";

/// Range in which the intervals hold.
fn of_runs(trained: &TrainedForces, runs: usize) -> Remark {
    let between = &trained.map.pressing.between_runs;
    Remark::whole(if runs > 1 {
        format!(
            "force: each of {runs} runs was predicted from the others; from run to run the gain differs by {:.1} % and the \
             offset by {:.2} N (standard deviations, in the intervals). {OTHER_PRESSES}",
            100.0 * between.gain,
            between.offset
        )
    } else {
        format!(
            "force: one run does not show how runs differ, and its held-out errors hold for this run only. The intervals \
             leave a gain of {:.1} %, an offset of {:.2} N and {:.0} % more error within the run free, as usual for \
             soft bodies; train on two runs or more. {OTHER_PRESSES}",
            100.0 * between.gain,
            between.offset,
            100.0 * (WITHIN_ANOTHER - 1.0)
        )
    })
}

fn report(trained: &TrainedForces, runs: usize, found: &mut Outcome) {
    let held_out = &trained.held_out[0];
    let peak = trained.map.pressing.range[1];
    let summary = ResidualSummary::of("force".into(), "N", &held_out.errors, peak);
    found.models.push(ModelComparison {
        name: "force with memory",
        about: "a mixture of maps of channels, of their sums and products, and of what they did lately",
        unknowns: trained.map.law.len(),
        residual: summary.root_mean_square / peak,
        hold_out: Some(summary.root_mean_square / peak),
    });
    for run in 0..runs {
        let rows = (0..held_out.runs.len()).filter(|row| held_out.runs[*row] == run);
        let errors: Vec<f64> = rows.map(|row| held_out.errors[row]).collect();
        let name = format!("force, run {}", run + 1);
        found
            .hold_out
            .push(ResidualSummary::of(name, "N", &errors, peak));
    }
    let which = if runs > 1 {
        "each run, from the others"
    } else {
        "each fifth of the run, from the others"
    };
    join(&mut found.held_out, which);
    let rows = format!(
        "{} readings of a scale in {runs} {}",
        held_out.runs.len(),
        if runs > 1 { "runs" } else { "run" }
    );
    join(&mut found.search, &rows);
    found.scope.push(Scope {
        name: "force".into(),
        unit: "N",
        range: trained.map.pressing.range,
    });
    found.figures.push(figure(held_out, runs));
}

fn join(text: &mut String, more: &str) {
    if !text.is_empty() {
        text.push_str("; ");
    }
    text.push_str(more);
}

/// Truth, estimate and interval over time of the last run, and the error over the force.
fn figure(held_out: &HeldOutReadings, runs: usize) -> Figure {
    let begin = held_out.runs.partition_point(|run| *run + 1 < runs);
    let rows = begin..held_out.runs.len();
    let start = held_out.times.get(begin).copied().unwrap_or(0.0);
    let curve = |name: &str, of: &dyn Fn(usize) -> f64, style| {
        let points = rows.clone().map(|i| [held_out.times[i] - start, of(i)]);
        Curve::new(name, points.collect(), style)
    };
    let end = |sign: f64| {
        let at = |i: usize| held_out.estimates[i] + sign * NORMAL_95 * held_out.deviations[i];
        curve("95 % interval", &at, Style::Dashed).points
    };
    // The gap parts the lower end from the upper one.
    let interval = [end(-1.0), vec![[f64::NAN; 2]], end(1.0)].concat();
    let errors = rows.clone().map(|i| {
        [
            held_out.estimates[i] - held_out.errors[i],
            held_out.errors[i],
        ]
    });
    let loops = Curve::new("mixture of maps", errors.collect(), Style::Line);
    let truth = |i: usize| held_out.estimates[i] - held_out.errors[i];
    let over_time = Chart {
        title: String::new(),
        x: Axis::new("time", "s"),
        y: Axis::new("force", "N"),
        series: vec![
            curve("truth", &truth, Style::Line),
            curve("estimate", &|i| held_out.estimates[i], Style::Marks),
            Curve::new("95 % interval", interval, Style::Dashed),
        ],
    };
    let over_force = Chart {
        title: "Error over the force: what is left of the loop".into(),
        x: Axis::new("force", "N"),
        y: Axis::new("error", "N"),
        series: vec![loops],
    };
    Figure {
        title: "Force of held-out rows, last run".into(),
        charts: vec![over_time, over_force],
        caption: "Estimates of a map that was trained without these rows.".into(),
    }
}
