//! The map of the force, and what runs say of the next one.

use rayon::prelude::*;

use super::readings::{LEAST_READINGS, Run};
use super::{compared, failed, sessions, weighed};
use crate::outcome::{ModelComparison, Outcome, ResidualSummary, Scope};
use crate::remark::Remark;
use crate::training::{
    AcrossRuns, CONTACT_SHARE, Compared, ForceOptions, HeldOutForce, NORMAL_95, ScaleClock, Score,
    Series, Session, WITHIN_ANOTHER, compared_forces, trained_components, usual_candidates,
};
use taxel::InputError;
use taxel::electronics::times_in_another_unit;
use taxel::figure::{Axis, Chart, Figure, Series as Curve, Style};
use taxel::trained::{ForceMap, MemoryLaw, Polynomial, Relation, RestStatistics};

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
    (rest, relation): (Option<&RestStatistics>, Option<&Relation>),
    found: &mut Outcome,
) -> Result<Option<ForceMap>, InputError> {
    let runs = touched(runs, found)?;
    let Some(last) = runs.last() else {
        return Ok(None);
    };
    let Some(rest) = rest else { return Ok(None) };
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
    let candidates = usual_candidates(&sessions).map_err(failed)?;
    let chosen = AcrossRuns::choose(&sessions, &candidates).map_err(failed)?;
    same_clock(&last.name, &sessions, &chosen)?;
    tells_force(&last.name, &sessions, &chosen)?;
    let chosen = chosen
        .judged_live(&sessions, rest, relation)
        .map_err(failed)?;
    let mut all = compared_forces(&sessions, chosen.options.offset).map_err(failed)?;
    all.push(Compared {
        name: String::from("chosen map"),
        score: of_last(&chosen.held_out, sessions.len()),
    });
    let tested = if runs.len() > 1 {
        "force, the last run from the others"
    } else {
        "force, last quarter"
    };
    found.remarks.extend(compared(tested, all, "N", 1.0));
    found.remarks.push(among(&chosen, runs.len()));
    found.remarks.push(of_runs(&chosen, runs.len()));
    report(&chosen, runs.len(), found);
    let (map, options) = (&chosen.map, &chosen.options);
    let components =
        trained_components(map, &sessions, options, (rest, relation)).map_err(failed)?;
    for one in &components {
        let (name, unit) = (one.map.component.name(), one.map.component.unit());
        let held_out = &one.held_out;
        let summary = ResidualSummary::of(name.into(), unit, &held_out.errors, one.largest);
        let score = Score::of(&held_out.errors, &held_out.deviations);
        found.remarks.push(Remark::whole(format!(
            "{name}: held out {:.4} {unit} rms of at most {:.3} {unit}, {:.1} % within the 95 % intervals",
            score.rms,
            one.largest,
            100.0 * score.coverage
        )));
        found.hold_out.push(summary);
        found.scope.push(Scope {
            name: name.into(),
            unit,
            range: [-one.largest, one.largest],
        });
    }
    Ok(Some(ForceMap {
        components: components.into_iter().map(|one| one.map).collect(),
        ..chosen.map
    }))
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
fn same_clock(name: &str, runs: &[Session], chosen: &AcrossRuns) -> Result<(), InputError> {
    let least = OVERLAP * chosen.held_out.errors.len() as f64;
    // Error of a delay over the spread of the readings that it leaves.
    let error = |offset: f64| {
        let options = ForceOptions {
            polynomial: Polynomial { degree: 1 },
            memory: MemoryLaw::default(),
            offset,
            ..chosen.options.clone()
        };
        let found = AcrossRuns::choose(runs, &[options]).ok()?;
        let overlaps = found.held_out.errors.len() as f64 >= least;
        overlaps.then(|| found.score().rms / spread(&found.held_out))
    };
    // A scale may be a little late.
    let tenths: Vec<i32> = (-5..=15).collect();
    let near = tenths
        .into_par_iter()
        .filter_map(|tenths| error(0.1 * f64::from(tenths)));
    let usual = near.min_by(f64::total_cmp).unwrap_or(f64::INFINITY);
    // One press is near each of its delays.
    if usual < SUSPECT || presses(runs) < 2 {
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
fn tells_force(name: &str, runs: &[Session], chosen: &AcrossRuns) -> Result<(), InputError> {
    let (rms, spread) = (chosen.score().rms, spread(&chosen.held_out));
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
fn spread(held_out: &HeldOutForce) -> f64 {
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

/// Score of the rows of the last run, or of the last quarter of the only one, of which the last
/// three tenths are held out.
fn of_last(held_out: &HeldOutForce, runs: usize) -> Score {
    let count = held_out.runs.len();
    let begin = if runs > 1 {
        held_out.runs.partition_point(|run| *run + 1 < runs)
    } else {
        count / 6
    };
    Score::of(&held_out.errors[begin..], &held_out.deviations[begin..])
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

/// Candidates that the chosen options won against.
fn among(chosen: &AcrossRuns, runs: usize) -> Remark {
    let rms = |of: &HeldOutForce| Score::of(&of.errors, &of.deviations).rms;
    let without = chosen.without_memory.as_ref().map_or(0.0, rms);
    let (options, score) = (&chosen.options, chosen.score());
    Remark::whole(format!(
        "force: products of up to {} {}, creep times {:?} s, products with creep along {} directions, prior {} (channels x {}, memory x {}, its products x {}), scale {:.1} s \
         after the sensor; best of {} candidates by the error of held-out {}: live, {:.3} N rms (best without memory {without:.3} N), \
         {:.1} % within the 95 % intervals. In {:.0} % of resamplings of the blocks of time no other degree or memory does \
         better. The readings of the training, replayed live, have {:.4} N rms",
        options.polynomial.degree,
        if options.reciprocal {
            "reciprocal channels"
        } else {
            "channels"
        },
        options.memory.creep_times,
        options.mixed,
        options.prior,
        options.prior_shares[0],
        options.prior_shares[1],
        options.prior_shares[2],
        options.offset,
        chosen.tried.len(),
        if runs > 1 {
            "runs and blocks"
        } else {
            "blocks of time"
        },
        score.rms,
        100.0 * score.coverage,
        100.0 * chosen.certainty,
        chosen.replayed
    ))
}

/// Range in which the intervals hold.
fn of_runs(chosen: &AcrossRuns, runs: usize) -> Remark {
    let between = &chosen.map.between_runs;
    Remark::whole(if runs > 1 {
        format!(
            "force: each of {runs} runs was predicted from the others; from run to run the gain differs by {:.1} % and the \
             offset by {:.2} N (standard deviations, in the intervals)",
            100.0 * between.gain,
            between.offset
        )
    } else {
        format!(
            "force: one run does not show how runs differ, and its held-out errors hold for this run only. The intervals \
             leave a gain of {:.1} %, an offset of {:.2} N and {:.0} % more error within the run free, as usual for \
             soft bodies; train on two runs or more",
            100.0 * between.gain,
            between.offset,
            100.0 * (WITHIN_ANOTHER - 1.0)
        )
    })
}

fn report(chosen: &AcrossRuns, runs: usize, found: &mut Outcome) {
    let held_out = &chosen.held_out;
    let peak = chosen.map.range[1];
    let summary = ResidualSummary::of("force".into(), "N", &held_out.errors, peak);
    found.models.push(ModelComparison {
        name: "force with memory",
        about: "products of channels, and what each channel did lately",
        unknowns: chosen.map.ridge.weights().len(),
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
        "each of the last three tenths of the run, from what comes before it"
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
        range: chosen.map.range,
    });
    found.figures.push(figure(chosen, runs));
}

fn join(text: &mut String, more: &str) {
    if !text.is_empty() {
        text.push_str("; ");
    }
    text.push_str(more);
}

/// Truth, estimate and interval over time of the last run, and the loop of the
/// error over the force with memory and without.
fn figure(chosen: &AcrossRuns, runs: usize) -> Figure {
    let held_out = &chosen.held_out;
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
    let loops = |name: &str, of: &HeldOutForce, style| {
        let points = rows
            .clone()
            .map(|i| [of.estimates[i] - of.errors[i], of.errors[i]]);
        Curve::new(name, points.collect(), style)
    };
    let without = chosen.without_memory.iter();
    let without = without.map(|of| loops("without memory", of, Style::Dashed));
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
        series: without
            .chain([loops("chosen map", held_out, Style::Line)])
            .collect(),
    };
    Figure {
        title: "Force of held-out rows, last run".into(),
        charts: vec![over_time, over_force],
        caption: "Estimates of a map that was trained without these rows.".into(),
    }
}
