//! The figures, one table per question.

use std::time::Instant;

use taxel::figure::{Axis, Chart, Figure, Series as Curve, Style};
use taxel::trained::{ForceEstimator, PositionEstimator, Support, TrainingError};
use taxel_calibrate::training::{
    PositionOptions, ScaleClock, Score, Session, delay_of_scale, train_forces, train_position,
};

use crate::Run;

type Shown<T> = Result<T, String>;

/// A probe that visits more distinct places than this is a position run.
const PLACES: usize = 25;

/// Prints all tables and returns the figures.
pub(crate) fn all(runs: &[Run]) -> Shown<Figure> {
    let mut page = Figure {
        title: "Trained maps on held-out recordings".to_owned(),
        ..Figure::default()
    };
    for run in runs.iter().filter(|run| is_position_run(&run.session)) {
        position(run, &mut page)?;
    }
    let mut widths: Vec<usize> = Vec::new();
    for run in runs.iter().filter(|run| run.session.force.is_some()) {
        let width = run.session.sensor.width();
        if !widths.contains(&width) {
            widths.push(width);
        }
    }
    for width in widths {
        let group: Vec<&Run> = runs
            .iter()
            .filter(|run| run.session.force.is_some() && run.session.sensor.width() == width)
            .collect();
        force(&group, &mut page)?;
    }
    Ok(page)
}

fn shown<T>(result: Result<T, TrainingError>) -> Shown<T> {
    result.map_err(|error| error.to_string())
}

fn is_position_run(session: &Session) -> bool {
    let mut places: Vec<[i64; 2]> = session
        .place
        .rows()
        .iter()
        // Tenths of a millimetre.
        .map(|row| [(row[0] * 1e4).round() as i64, (row[1] * 1e4).round() as i64])
        .collect();
    places.sort_unstable();
    places.dedup();
    session.force.is_none() && places.len() > PLACES
}

/// One line of a table of held-out scores, the numbers in units of 1/`unit`.
fn line(name: &str, score: Score, unit: f64, note: &str) {
    println!(
        "  {name:<44} {:>8.3} {:>9.3} {:>7.1} %  {note}",
        score.rms * unit,
        // A density per unit shown, not per metre.
        score.log_likelihood - unit.ln(),
        100.0 * score.coverage
    );
}

fn head(title: &str, rms: &str) {
    println!("\n{title}");
    println!(
        "  {:<44} {rms:>8} {:>9} {:>9}",
        "map", "log lik.", "95 % cov."
    );
}

// ---------------------------------------------------------------- position

const METRES: f64 = 1e3;

/// A score of single coordinates with the error of the place: both together.
fn of_place(errors: &[f64], deviations: &[f64]) -> Score {
    let score = Score::of(errors, deviations);
    Score {
        rms: score.rms * 2f64.sqrt(),
        ..score
    }
}

/// Frames of a session with their places, in the order of time.
fn presses(session: &Session) -> (Vec<Vec<f64>>, Vec<[f64; 2]>) {
    let reach = session.sensor.longest_step();
    let place = session.place.times().iter().zip(session.place.rows());
    place
        .filter_map(|(time, row)| Some((session.sensor.at(*time, reach)?, [row[0], row[1]])))
        .unzip()
}

fn position(run: &Run, page: &mut Figure) -> Shown<()> {
    let (frames, places) = presses(&run.session);
    let train = frames.len() * 4 / 5;
    println!(
        "\n{}: {} presses, {} channels",
        run.name,
        frames.len(),
        run.session.sensor.width()
    );
    head(
        "Place, first 80 % of time trains, last 20 % tests; rms distance [mm]",
        "rms",
    );
    let candidates = PositionOptions::of_one_depth();
    let start = Instant::now();
    let (map, scores) = shown(train_position(
        &frames[..train],
        &places[..train],
        &candidates,
    ))?;
    let seconds = start.elapsed().as_secs_f64();
    let mut estimator = shown(PositionEstimator::new(map.clone()))?;
    let mut errors = Vec::new();
    let (mut flat, mut deviations) = (Vec::new(), Vec::new());
    let mut outside = 0;
    for (frame, place) in frames[train..].iter().zip(&places[train..]) {
        let estimate = shown(estimator.estimate(frame))?;
        outside += usize::from(estimate.support == Support::Outside);
        let error = [
            estimate.position[0] - place[0],
            estimate.position[1] - place[1],
        ];
        errors.push(error);
        flat.extend(error);
        deviations.extend(estimate.deviation());
    }
    let score = of_place(&flat, &deviations);
    line("inverted surface", score, METRES, "chosen");
    println!("  {outside} of {} frames outside", errors.len());
    println!(
        "  trained in {seconds:.2} s; choice among (held out: last quarter of the training part):"
    );
    for (options, score) in candidates.iter().zip(&scores) {
        let name = format!(
            "    run-in {:.0} %, fading {:.2}, spacing {:.2}, smoothing {:.0e}",
            100.0 * options.run_in,
            options.fading,
            options.spacing,
            options.smoothing
        );
        line(&name, *score, METRES, "");
    }
    random_split(&frames, &places)?;
    let time = microseconds(frames.len(), |i| {
        estimator
            .estimate(&frames[i])
            .map_or(0.0, |e| e.position[0])
    });
    println!("  one frame: {time:.1} us");
    let ends = |axis: usize| {
        let points = errors
            .iter()
            .zip(0..)
            .map(|(e, i)| [f64::from(i), e[axis] * METRES]);
        points.collect()
    };
    page.charts.push(Chart {
        title: format!("{}: error of the place", run.name),
        x: Axis::new("held-out press", ""),
        y: Axis::new("error", "mm"),
        series: vec![
            Curve::new("x", ends(0), Style::Line),
            Curve::new("y", ends(1), Style::Line),
        ],
    });
    Ok(())
}

/// Result that a random split would claim: every fifth press is held out.
fn random_split(frames: &[Vec<f64>], places: &[[f64; 2]]) -> Shown<()> {
    let mut mixed: Vec<usize> = (0..frames.len()).collect();
    // A fixed shuffle: multiples of a number without common factor.
    let count = frames.len();
    let coprime = |f: &usize| gcd(*f, count) == 1;
    let factor = (count * 618 / 1000..count).find(coprime).unwrap_or(1);
    for (i, row) in mixed.iter_mut().enumerate() {
        *row = i * factor % count;
    }
    let train = count * 4 / 5;
    let frames: Vec<_> = mixed.iter().map(|i| frames[*i].clone()).collect();
    let places: Vec<_> = mixed.iter().map(|i| places[*i]).collect();
    let options = [PositionOptions {
        smoothing: 1e-6,
        run_in: 0.0,
        ..PositionOptions::default()
    }];
    let (map, _) = shown(train_position(&frames[..train], &places[..train], &options))?;
    let mut estimator = shown(PositionEstimator::new(map))?;
    let (mut errors, mut deviations) = (Vec::new(), Vec::new());
    for (frame, place) in frames[train..].iter().zip(&places[train..]) {
        let estimate = shown(estimator.estimate(frame))?;
        errors.extend([
            estimate.position[0] - place[0],
            estimate.position[1] - place[1],
        ]);
        deviations.extend(estimate.deviation());
    }
    let score = of_place(&errors, &deviations);
    line(
        "the same with a random split",
        score,
        METRES,
        "not a test: neighbours in time",
    );
    Ok(())
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Time of one estimate: the quickest of many batches, as others use the
/// processor too.
fn microseconds(frames: usize, mut estimate: impl FnMut(usize) -> f64) -> f64 {
    const BATCH: usize = 50;
    let batch = |begin: usize| {
        let start = Instant::now();
        let sum: f64 = (begin..begin + BATCH).map(&mut estimate).sum();
        std::hint::black_box(sum);
        start.elapsed().as_secs_f64() * 1e6 / BATCH as f64
    };
    let begins = (0..frames.saturating_sub(BATCH)).step_by(BATCH);
    begins.map(batch).fold(f64::INFINITY, f64::min)
}

// ------------------------------------------------------------------- force

fn force(runs: &[&Run], page: &mut Figure) -> Shown<()> {
    let mut sessions: Vec<Session> = runs.iter().map(|run| run.session.clone()).collect();
    let Some(width) = sessions.first().map(|first| first.sensor.width()) else {
        return Ok(());
    };
    println!("\nForce, {width} channels: {} run(s)", runs.len());
    for (session, run) in sessions.iter_mut().zip(runs) {
        session.scale_clock = shown(ScaleClock::of(session))?;
        if let Some(clock) = session.scale_clock {
            println!(
                "  {}: the scale measures every {:.5} s by its own clock; the age of its readings is {:.3} N rms",
                run.name, clock.period, clock.error
            );
        }
    }
    let offset = shown(delay_of_scale(&sessions))?;
    let start = Instant::now();
    let trained = shown(train_forces(&sessions, offset, true))?;
    println!(
        "  the scale comes {offset:.1} s after the sensor; trained in {:.1} s",
        start.elapsed().as_secs_f64()
    );
    println!(
        "  maps of the mixture, from simple to rich: error of held-out readings alone [N], share"
    );
    for one in &trained.candidates[0] {
        let names: Vec<&str> = one.blocks.iter().map(|block| block.name()).collect();
        println!(
            "  {:>8.3} {:>6.2}  {}",
            one.error,
            one.share,
            names.join(", ")
        );
    }
    head(
        "Force, held out from all that is learned, as live [N]",
        "rms",
    );
    let held_out = &trained.held_out[0];
    let which = if runs.len() > 1 {
        "runs"
    } else {
        "fifths of the run"
    };
    line(which, held_out.score(), 1.0, "");
    let points = held_out.times.iter().zip(&held_out.errors);
    page.charts.push(Chart {
        title: "Force, held out: error".to_owned(),
        x: Axis::new("time", "s"),
        y: Axis::new("error", "N"),
        series: vec![Curve::new(
            "error",
            points.map(|(time, error)| [*time, *error]).collect(),
            Style::Line,
        )],
    });
    head("Force, live, by training on [N]", "rms");
    for run in runs {
        let Some(force) = &run.session.force else {
            continue;
        };
        let end = force.times()[force.times().len() * 4 / 5];
        let name = format!("80 % of {}: the rest", run.name);
        live(&name, &[(run, end)], run, end)?;
    }
    for (held, run) in runs.iter().enumerate().filter(|_| runs.len() > 1) {
        let others = (0..runs.len()).filter(|i| *i != held);
        let others: Vec<(&Run, f64)> = others.map(|i| (runs[i], f64::INFINITY)).collect();
        live(
            &format!("the others: {}", run.name),
            &others,
            run,
            f64::NEG_INFINITY,
        )?;
    }
    let first = &sessions[0];
    let mut estimator = shown(ForceEstimator::new(trained.map, first.baseline()))?;
    let (times, frames) = (first.sensor.times(), first.sensor.rows());
    let time = microseconds(frames.len(), |i| {
        estimator
            .push(times[i], &frames[i])
            .map_or(0.0, |e| e.value)
    });
    println!(
        "  one frame: {time:.1} us, {} features",
        estimator.map().law.len()
    );
    Ok(())
}

/// The line of the force that live gives of a run from a time on, s, at the readings of its scale.
fn live(name: &str, training: &[(&Run, f64)], tested: &Run, from: f64) -> Shown<()> {
    let estimates = crate::live::forces(training, tested)?;
    let reach = tested.session.sensor.longest_step();
    let readings = tested
        .session
        .force
        .iter()
        .flat_map(|force| force.times().iter().zip(force.rows()));
    let (mut errors, mut deviations) = (Vec::new(), Vec::new());
    for (time, force) in readings.filter(|(time, _)| **time >= from) {
        if let Some(&[value, deviation]) = estimates.at(*time, reach).as_deref() {
            errors.push(value - force[0]);
            deviations.push(deviation);
        }
    }
    line(name, Score::of(&errors, &deviations), 1.0, "");
    Ok(())
}
