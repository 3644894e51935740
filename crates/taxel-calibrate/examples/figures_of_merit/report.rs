//! The figures, one table per question.

use std::time::Instant;

use taxel::figure::{Axis, Chart, Figure, Series as Curve, Style};
use taxel::trained::{
    ForceEstimator, ForceMap, GaussianProcess, Kernel, Moments, Polynomial, PositionEstimator,
    Ridge, Standard, Support, TrainingError,
};
use taxel_calibrate::training::{
    AcrossRuns, ForceOptions, Nearest, PositionOptions, ScaleClock, Score, Series, Session,
    features_of, interval_factor, train_position, usual_candidates,
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
    others(&frames, &places, train)?;
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

/// The maps that go straight from channels to place.
fn others(frames: &[Vec<f64>], places: &[[f64; 2]], train: usize) -> Shown<()> {
    let targets: Vec<Vec<f64>> = places.iter().map(|p| p.to_vec()).collect();
    let nearest = shown(Nearest::train(&frames[..train], &targets[..train], 5))?;
    let (mut errors, mut deviations) = (Vec::new(), Vec::new());
    for (frame, place) in frames[train..].iter().zip(&places[train..]) {
        for (axis, [mean, variance]) in shown(nearest.estimate(frame))?.iter().enumerate() {
            errors.push(mean - place[axis]);
            // Neighbours at one place have no spread: the grid is the least.
            deviations.push(variance.sqrt().max(1e-4));
        }
    }
    line(
        "five nearest neighbours",
        of_place(&errors, &deviations),
        METRES,
        "",
    );
    let standard = shown(Standard::of(&frames[..train]))?;
    let inputs: Vec<Vec<f64>> = shown(frames.iter().map(|f| standard.apply(f)).collect())?;
    for degree in 1..=3 {
        let features: Vec<Vec<f64>> = inputs
            .iter()
            .map(|z| {
                let mut row = Vec::new();
                Polynomial { degree }.expand(z, &mut row);
                row
            })
            .collect();
        let (mut errors, mut deviations) = (Vec::new(), Vec::new());
        for axis in 0..2 {
            let target: Vec<f64> = places.iter().map(|p| p[axis]).collect();
            let moments = shown(Moments::of(&features[..train], &target[..train]))?;
            let ridge = shown(Ridge::fit(&moments, 1e-2))?;
            for (row, truth) in features[train..].iter().zip(&target[train..]) {
                errors.push(ridge.mean(row) - truth);
                deviations.push((ridge.noise_variance() * (1.0 + ridge.leverage(row))).sqrt());
            }
        }
        let name = format!("polynomial ridge, degree {degree}");
        line(&name, of_place(&errors, &deviations), METRES, "");
    }
    process(&inputs, &targets, train)
}

/// A Gaussian process on every third frame, as an exact one is slow.
fn process(inputs: &[Vec<f64>], targets: &[Vec<f64>], train: usize) -> Shown<()> {
    let thin = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> { rows.iter().step_by(3).cloned().collect() };
    let kernel = Kernel {
        deviation: 10e-3,
        length: 2.0,
        slope: 1e-3,
        noise: 0.3e-3,
    };
    let process = shown(GaussianProcess::observe(
        kernel,
        &thin(&inputs[..train]),
        &thin(&targets[..train]),
    ))?;
    let (mut errors, mut deviations) = (Vec::new(), Vec::new());
    for (input, target) in inputs[train..].iter().zip(&targets[train..]) {
        let (means, variance) = process.estimate(input);
        for (mean, truth) in means.iter().zip(target) {
            errors.push(mean - truth);
            deviations.push(variance.sqrt());
        }
    }
    let score = of_place(&errors, &deviations);
    line(
        "Gaussian process, every third press",
        score,
        METRES,
        "too slow for live use",
    );
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

/// The runs with the clocks of their scales.
fn clocked(runs: &[Session]) -> Shown<Vec<Session>> {
    let of = |run: &Session| {
        Ok(Session {
            scale_clock: shown(ScaleClock::of(run))?,
            ..run.clone()
        })
    };
    runs.iter().map(of).collect()
}

/// The map that `taxel calibrate` makes of these runs.
fn trained(runs: &[Session]) -> Shown<AcrossRuns> {
    let runs = &clocked(runs)?;
    let candidates = shown(usual_candidates(runs))?;
    shown(AcrossRuns::choose(runs, &candidates))
}

fn name_of(options: &ForceOptions) -> String {
    let [own, memory, mixed] = options.prior_shares;
    let products = if options.mixed > 0 {
        " with products"
    } else {
        ""
    };
    format!(
        "degree {}, creep {:?} s{products}, prior {} x (1, {own}, {memory}, {mixed})",
        options.polynomial.degree, options.memory.creep_times, options.prior
    )
}

/// Errors, deviations, whether the probe loads (+1), unloads (−1) or rests, times.
struct Tested {
    errors: Vec<f64>,
    deviations: Vec<f64>,
    branch: Vec<i8>,
    times: Vec<f64>,
    truth: Vec<f64>,
    outside: usize,
}

fn test(map: &ForceMap, session: &Session) -> Shown<Tested> {
    let rows = shown(features_of(map, session))?;
    let mut tested = Tested {
        errors: Vec::new(),
        deviations: Vec::new(),
        branch: Vec::new(),
        times: rows.times.clone(),
        truth: rows.force.clone(),
        outside: 0,
    };
    for ((row, force), time) in rows.learned().iter().zip(&rows.force).zip(&rows.times) {
        let estimate = map.estimate(row);
        tested.errors.push(estimate.value - force);
        tested.deviations.push(estimate.deviation);
        tested.outside += usize::from(estimate.support == Support::Outside);
        tested.branch.push(branch(session, *time));
    }
    Ok(tested)
}

/// True if the probe goes down (1) or up (−1) around `time`, by more than 20 um.
fn branch(session: &Session, time: f64) -> i8 {
    let height = |t: f64| session.place.at(t, 10.0).map_or(0.0, |row| row[2]);
    let change = height(time + 0.3) - height(time - 0.3);
    if change.abs() < 2e-5 {
        0
    } else if change < 0.0 {
        1
    } else {
        -1
    }
}

impl Tested {
    fn score(&self, keep: impl Fn(usize) -> bool) -> Score {
        let rows: Vec<usize> = (0..self.errors.len()).filter(|i| keep(*i)).collect();
        let take = |of: &[f64]| rows.iter().map(|i| of[*i]).collect::<Vec<_>>();
        Score::of(&take(&self.errors), &take(&self.deviations))
    }

    fn show(&self, name: &str) {
        line(name, self.score(|_| true), 1.0, "");
        line("    loading", self.score(|i| self.branch[i] > 0), 1.0, "");
        line("    unloading", self.score(|i| self.branch[i] < 0), 1.0, "");
        println!(
            "    {} of {} readings outside",
            self.outside,
            self.errors.len()
        );
    }

    /// Mean of unloading minus loading error: the width of the loop that is left, N.
    fn loop_width(&self) -> f64 {
        let mean = |sign: i8| {
            let members = (0..self.errors.len()).filter(|i| self.branch[*i] == sign);
            let members = members.filter(|i| self.truth[*i] > 1.0);
            let (sum, count) = members.fold((0.0, 0.0), |(s, c), i| (s + self.errors[i], c + 1.0));
            sum / f64::max(count, 1.0)
        };
        mean(1) - mean(-1)
    }
}

fn force(runs: &[&Run], page: &mut Figure) -> Shown<()> {
    let sessions: Vec<Session> = runs.iter().map(|run| run.session.clone()).collect();
    let Some(first) = sessions.first() else {
        return Ok(());
    };
    println!(
        "\nForce, {} channels: {} run(s)",
        first.sensor.width(),
        runs.len()
    );
    let chosen = trained(&sessions)?;
    println!(
        "  the scale comes {:.1} s after the sensor",
        chosen.options.offset
    );
    let held_out = if runs.len() > 1 {
        "Force, candidates: each run from the others [N]"
    } else {
        "Force, candidates: each of the last three tenths of the run from what comes before it [N]"
    };
    head(held_out, "rms");
    for (options, score) in &chosen.tried {
        let best = *options == chosen.options;
        let note = if best { "chosen" } else { "" };
        line(&name_of(options), *score, 1.0, note);
    }
    for run in runs {
        last_fifth(run)?;
    }
    head("Force, last half of the last run held out [N]", "rms");
    last_half(&sessions, page)?;
    if runs.len() > 1 {
        head("Force, one run held out, trained on the others [N]", "rms");
    }
    for (held, run) in runs.iter().enumerate().filter(|_| runs.len() > 1) {
        let others: Vec<Session> = (0..runs.len())
            .filter(|i| *i != held)
            .map(|i| sessions[i].clone())
            .collect();
        let found = trained(&others)?;
        println!("  {}", name_of(&found.options));
        test(&found.map, &run.session)?.show(&format!("test on {}", run.name));
        let others = (0..runs.len()).filter(|i| *i != held);
        let others: Vec<(&Run, f64)> = others.map(|i| (runs[i], f64::INFINITY)).collect();
        live("    live", &others, run, f64::NEG_INFINITY)?;
    }
    let map = &chosen.map;
    let mut estimator = shown(ForceEstimator::new(map.clone(), first.baseline()))?;
    let (times, frames) = (first.sensor.times(), first.sensor.rows());
    let time = microseconds(frames.len(), |i| {
        estimator
            .push(times[i], &frames[i])
            .map_or(0.0, |e| e.value)
    });
    println!(
        "  one frame: {time:.1} us, {} features",
        map.ridge.weights().len()
    );
    Ok(())
}

/// A run without the readings of its scale after `last` of them.
fn begun(run: &Session, last: usize) -> Session {
    let force = run.force.as_ref().and_then(|force| {
        Series::new(
            force.times()[..last].to_vec(),
            force.rows()[..last].to_vec(),
        )
    });
    Session {
        force,
        ..run.clone()
    }
}

/// The last fifth of the readings of a run is the test, at the times of the readings and at those
/// when a scale with a clock of its own measured what they show.
fn last_fifth(run: &Run) -> Shown<()> {
    let Some(force) = &run.session.force else {
        return Ok(());
    };
    let count = force.times().len() * 4 / 5;
    let begun = [begun(&run.session, count)];
    let found = trained(&begun)?;
    head(
        &format!(
            "Force, {}: first 80 % trains, last 20 % tests [N]",
            run.name
        ),
        "rms",
    );
    let later = |mut tested: Tested| {
        tested.errors.drain(..count);
        tested.deviations.drain(..count);
        tested.score(|_| true)
    };
    let score = later(test(&found.map, &run.session)?);
    line(&name_of(&found.options), score, 1.0, "");
    let end = force.times()[count];
    live("the same, live", &[(run, end)], run, end)?;
    let Some(clock) = shown(ScaleClock::of(&run.session))? else {
        return Ok(());
    };
    let clocked = Session {
        scale_clock: Some(clock),
        ..run.session.clone()
    };
    line(
        "the same, at the times of the measurements",
        later(test(&found.map, &clocked)?),
        1.0,
        "",
    );
    println!(
        "  the scale measures every {:.5} s by its own clock; the age of its readings is {:.3} N rms of them",
        clock.period, clock.error
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

/// The last run's second half is the test; memory runs through.
fn last_half(sessions: &[Session], page: &mut Figure) -> Shown<()> {
    let Some((last, before)) = sessions.split_last() else {
        return Ok(());
    };
    let Some(force) = &last.force else {
        return Ok(());
    };
    let half = force.times()[force.times().len() / 2];
    let mut training = before.to_vec();
    let count = force.times().partition_point(|t| *t < half);
    training.push(begun(last, count));
    let training = clocked(&training)?;
    let candidates = shown(usual_candidates(&training))?;
    let memoryless: Vec<ForceOptions> = candidates
        .iter()
        .filter(|options| options.memory.creep_times.is_empty())
        .cloned()
        .collect();
    let mut curves = Vec::new();
    for (name, candidates) in [("without memory", &memoryless), ("chosen", &candidates)] {
        let map = shown(AcrossRuns::choose(&training, candidates))?.map;
        let mut tested = test(&map, last)?;
        let begin = tested.times.partition_point(|t| *t < half);
        tested.errors.drain(..begin);
        tested.deviations.drain(..begin);
        tested.branch.drain(..begin);
        tested.times.drain(..begin);
        tested.truth.drain(..begin);
        tested.show(name);
        println!("    loop that is left: {:.3} N wide", tested.loop_width());
        let points = tested.times.iter().zip(&tested.errors);
        let points = points.map(|(t, e)| [t - half, *e]).collect();
        curves.push(Curve::new(name, points, Style::Line));
        let factor = interval_factor(&tested.errors, &tested.deviations);
        println!("    deviations would have to be {factor:.2} times as large for 95 %");
    }
    page.charts.push(Chart {
        title: "Force, last half of the last run: error".to_owned(),
        x: Axis::new("time", "s"),
        y: Axis::new("error", "N"),
        series: curves,
    });
    Ok(())
}
