//! Solving a body over its load for its table.
//!
//! Points are added in rounds that follow from what was solved before, and never from the order in
//! which the points of a round are done; then fresh points say how far off the table is.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use taxel::transduction::{Certificate, ResponseFile, ResponseTable};
use taxel_numerics::{Kriging, sobol, split_mix};

/// Intervals of the first table over one parameter.
const FEWEST: usize = 8;
/// Points of the first table over several, for each of them, beside the corners and the middle.
const FIRST: usize = 8;
/// Points of a round over several parameters: as many as two machines of two cores solve at once.
const ROUND: usize = 4;
/// Places that are looked at for the next point, for each parameter.
const CANDIDATES: usize = 64;
/// Fresh points: if all keep to the tolerance, at least 95 % of the box does with a confidence of
/// 95 %, because 0.95⁵⁹ < 0.05.
const FRESH: usize = 59;
/// Share of the box that may be beyond the tolerance, and the chance that a table with more of it is taken.
const BEYOND: f64 = 0.05;
/// Seeds of the first points and of the fresh ones.
const SEED: u64 = 52;
const FRESH_SEED: u64 = 1052;

/// How a table of a body is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseOptions {
    /// Most points of the table, beside the fresh ones; default 200.
    pub most_points: usize,
    /// Points that are solved at a time; default 1. The table does not depend on it.
    pub jobs: usize,
}

impl Default for ResponseOptions {
    fn default() -> Self {
        Self {
            most_points: 200,
            jobs: 1,
        }
    }
}

/// Why a point has no solution.
#[derive(Debug, Clone, PartialEq)]
pub struct PointEnd {
    /// Depth of the pressing parameter up to which there is one, SI.
    pub reached: f64,
    /// Why it ends there.
    pub reason: String,
}

/// Outputs at a point, SI, or why there are none.
pub type PointAnswer = Result<Vec<f64>, PointEnd>;

/// Where solved points are kept.
pub trait Points: Sync {
    /// What was kept of a point.
    fn known(&self, at: &[f64]) -> Option<PointAnswer>;

    /// Keeps a point.
    fn keep(&self, at: &[f64], answer: &PointAnswer);
}

/// Keeps nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoPoints;

impl Points for NoPoints {
    fn known(&self, _at: &[f64]) -> Option<PointAnswer> {
        None
    }

    fn keep(&self, _at: &[f64], _answer: &PointAnswer) {}
}

/// Why there is no table of a body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoResponse {
    /// The problem does not have what the sensor file asks for, or no mesh that can be solved.
    #[error("{0}")]
    Problem(String),
    /// There is no solution near rest.
    #[error("the body has no solution near rest: {0}")]
    Unsolved(String),
    /// The points do not suffice.
    #[error(
        "{points} points leave an error of {:.2} % of the range of {output}, above the tolerance of {:.2} %\n\
         help: give more --points, a larger --tolerance or a smaller load", 100.0 * .error, 100.0 * .tolerance
    )]
    Tolerance {
        /// Points of the table.
        points: usize,
        /// Output that is off most.
        output: String,
        /// Its error over its range.
        error: f64,
        /// Tolerance.
        tolerance: f64,
    },
}

/// Solves points and keeps them.
pub(crate) struct Batch<'a> {
    pub(crate) solve: &'a (dyn Fn(&[f64]) -> PointAnswer + Sync),
    pub(crate) points: &'a dyn Points,
    pub(crate) options: ResponseOptions,
}

impl Batch<'_> {
    fn one(&self, at: &[f64]) -> PointAnswer {
        self.points.known(at).unwrap_or_else(|| {
            let answer = (self.solve)(at);
            self.points.keep(at, &answer);
            answer
        })
    }

    /// Outputs at all of these points, in their order; `heard` hears how many are done.
    fn all(
        &self,
        at: &[Vec<f64>],
        heard: &mut dyn FnMut(usize),
    ) -> Result<Vec<Vec<f64>>, PointEnd> {
        let next = AtomicUsize::new(0);
        let (done, answers) = (AtomicUsize::new(0), Mutex::new(vec![None; at.len()]));
        let work = || {
            while let Some(index) =
                Some(next.fetch_add(1, Ordering::Relaxed)).filter(|i| *i < at.len())
            {
                let answer = self.one(&at[index]);
                let mut answers = answers.lock().unwrap_or_else(PoisonError::into_inner);
                answers[index] = Some(answer);
                done.fetch_add(1, Ordering::Relaxed);
            }
        };
        rayon::in_place_scope(|scope| {
            for _ in 1..self.options.jobs.min(at.len()) {
                scope.spawn(|_| work());
            }
            work();
        });
        heard(done.into_inner());
        let answers = answers.into_inner().unwrap_or_else(PoisonError::into_inner);
        // Every index was taken once.
        let answers: Vec<PointAnswer> = answers.into_iter().flatten().collect();
        let ends = answers.iter().filter_map(|answer| answer.as_ref().err());
        // The earliest end, whichever was found first.
        let earliest = ends.min_by(|a, b| a.reached.total_cmp(&b.reached)).cloned();
        match earliest {
            Some(end) => Err(end),
            None => Ok(answers.into_iter().flatten().collect()),
        }
    }
}

/// Fills the table of `file`; `progress` hears the fraction.
///
/// # Errors
/// [`NoResponse`].
pub(crate) fn tabulate(
    mut file: ResponseFile,
    tolerance: f64,
    batch: &Batch<'_>,
    progress: &mut dyn FnMut(f64),
) -> Result<ResponseTable, NoResponse> {
    loop {
        let pressing = file.pressing;
        let asked = file.parameters[pressing].range[1];
        match attempt(&mut file, tolerance, batch, progress) {
            Err(Stopped::Ended(end)) => {
                // A box that ends where the last one did cannot be solved to its end.
                if !(end.reached > 0.0 && end.reached < asked) {
                    return Err(NoResponse::Unsolved(end.reason));
                }
                file.parameters[pressing].range[1] = end.reached;
                file.ended = Some(end.reason);
            }
            Err(Stopped::No(no)) => return Err(no),
            Ok(table) => return Ok(table),
        }
    }
}

/// Why an attempt came to nothing.
enum Stopped {
    Ended(PointEnd),
    No(NoResponse),
}

impl From<PointEnd> for Stopped {
    fn from(end: PointEnd) -> Self {
        Self::Ended(end)
    }
}

fn attempt(
    file: &mut ResponseFile,
    tolerance: f64,
    batch: &Batch<'_>,
    progress: &mut dyn FnMut(f64),
) -> Result<ResponseTable, Stopped> {
    let dimensions = file.parameters.len();
    (file.points, file.values) = (Vec::new(), Vec::new());
    let first: Vec<Vec<f64>> = if dimensions == 1 {
        (0..=FEWEST)
            .map(|node| vec![node as f64 / FEWEST as f64])
            .collect()
    } else {
        let corners = (0..1_usize << dimensions).map(|corner| {
            let side = |along: usize| f64::from(u8::from(corner >> along & 1 == 1));
            (0..dimensions).map(side).collect()
        });
        let inner = sobol(dimensions, FIRST * dimensions, Some(SEED));
        corners
            .chain([vec![0.5; dimensions]])
            .chain(inner)
            .collect()
    };
    let mut solved = 0;
    let mut hear = |done: usize, open: usize| {
        solved += done;
        progress(solved as f64 / (solved + open + FRESH) as f64);
    };
    add(file, &first, batch, &mut |done| hear(done, ROUND))?;
    let mut round = 0;
    loop {
        if dimensions == 1 {
            bisect(file, tolerance, batch, &mut hear)?;
        } else {
            fill(file, tolerance, batch, &mut hear)?;
        }
        let table = through(file).ok_or_else(|| no_surface(file))?;
        let (certificate, missed) = certify(&table, tolerance, round, batch)?;
        if missed.is_empty() {
            file.certificate = certificate;
            progress(1.0);
            return through(file).ok_or_else(|| no_surface(file));
        }
        if file.points.len() + missed.len() > batch.options.most_points {
            let worst = certificate.worst.iter().enumerate();
            let worst = worst.max_by(|a, b| a.1.total_cmp(b.1));
            let (output, error) = worst.map_or((0, f64::NAN), |(output, error)| (output, *error));
            return Err(Stopped::No(NoResponse::Tolerance {
                points: file.points.len(),
                output: file.outputs[output].name.clone(),
                error,
                tolerance,
            }));
        }
        add(file, &missed, batch, &mut |_| {})?;
        round += 1;
    }
}

fn no_surface(file: &ResponseFile) -> Stopped {
    let points = file.points.len();
    let message = format!("no surface passes through its {points} points");
    Stopped::No(NoResponse::Problem(message))
}

/// Solves points of the unit cube and adds them.
fn add(
    file: &mut ResponseFile,
    points: &[Vec<f64>],
    batch: &Batch<'_>,
    heard: &mut dyn FnMut(usize),
) -> Result<(), PointEnd> {
    let at: Vec<Vec<f64>> = points.iter().map(|point| file.in_box(point)).collect();
    let values = batch.all(&at, heard)?;
    file.points.extend(at);
    file.values.extend(values);
    if file.parameters.len() == 1 {
        let mut both: Vec<_> = file.points.drain(..).zip(file.values.drain(..)).collect();
        both.sort_by(|(a, _), (b, _)| a[0].total_cmp(&b[0]));
        both.dedup_by(|(a, _), (b, _)| a == b);
        (file.points, file.values) = both.into_iter().unzip();
    }
    Ok(())
}

/// The table of the points so far; over several parameters with lengths that make them likeliest.
fn through(file: &mut ResponseFile) -> Option<ResponseTable> {
    if file.parameters.len() > 1 {
        let points: Vec<_> = file.points.iter().map(|x| file.over_box(x)).collect();
        let kriging = Kriging::fit(&points, &file.values)?;
        file.lengths = kriging.lengths().to_vec();
        file.nugget = kriging.nugget();
    }
    ResponseTable::new(file.clone())
}

/// Ranges of the outputs.
fn ranges(file: &ResponseFile) -> Vec<f64> {
    let spans = (0..file.outputs.len()).map(|output| file.span(output));
    spans
        .map(|[low, high]| (high - low).max(f64::MIN_POSITIVE))
        .collect()
}

/// Differences of a table from solved outputs, over their ranges.
fn off(table: &ResponseTable, at: &[f64], solved: &[f64], ranges: &[f64]) -> Vec<f64> {
    let read = table.at(at);
    let each = read.iter().zip(solved).zip(ranges);
    each.map(|((read, solved), range)| (read.value - solved).abs() / range)
        .collect()
}

fn largest(off: &[f64]) -> f64 {
    off.iter().copied().fold(0.0, f64::max)
}

/// Halves each interval whose middle is off by more than the tolerance, until there is none: the
/// cubics of its halves are off by at most an eighth of that, as their slopes are of third order.
fn bisect(
    file: &mut ResponseFile,
    tolerance: f64,
    batch: &Batch<'_>,
    hear: &mut dyn FnMut(usize, usize),
) -> Result<(), Stopped> {
    let ends = |file: &ResponseFile| -> Vec<[f64; 2]> {
        let pairs = file.points.windows(2);
        pairs.map(|pair| [pair[0][0], pair[1][0]]).collect()
    };
    let mut open = ends(file);
    while !open.is_empty() && file.points.len() + open.len() <= batch.options.most_points {
        let table = through(file).ok_or_else(|| no_surface(file))?;
        let middles: Vec<f64> = open.iter().map(|[low, high]| 0.5 * (low + high)).collect();
        let over: Vec<_> = middles.iter().map(|x| file.over_box(&[*x])).collect();
        let count = over.len();
        add(file, &over, batch, &mut |done| hear(done, count))?;
        let ranges = ranges(file);
        let mut halves = Vec::new();
        for ([low, high], over) in open.into_iter().zip(&over) {
            // As the box gives it, to the last digit.
            let middle = file.in_box(over);
            let row = file.points.iter().position(|point| *point == middle);
            let missed = row.map_or(0.0, |row| {
                largest(&off(&table, &middle, &file.values[row], &ranges))
            });
            if missed > tolerance {
                halves.extend([[low, middle[0]], [middle[0], high]]);
            }
        }
        open = halves;
    }
    Ok(())
}

/// Adds points where the surface is known least, until two of its own deviations keep to the
/// tolerance everywhere.
fn fill(
    file: &mut ResponseFile,
    tolerance: f64,
    batch: &Batch<'_>,
    hear: &mut dyn FnMut(usize, usize),
) -> Result<(), Stopped> {
    let dimensions = file.parameters.len();
    while file.points.len() + ROUND <= batch.options.most_points {
        let ranges = ranges(file);
        let mut points: Vec<_> = file.points.iter().map(|x| file.over_box(x)).collect();
        let mut values = file.values.clone();
        let Some(mut surface) = Kriging::fit(&points, &values) else {
            return Err(no_surface(file));
        };
        let seed = SEED + points.len() as u64;
        let places = sobol(dimensions, CANDIDATES * dimensions, Some(seed));
        let mut next = Vec::new();
        while next.len() < ROUND {
            let doubt = |place: &Vec<f64>| {
                let deviations = surface.deviation(place);
                let shares = deviations.iter().zip(&ranges);
                largest(&shares.map(|(own, range)| own / range).collect::<Vec<_>>())
            };
            let doubts: Vec<f64> = places.iter().map(doubt).collect();
            let worst = (0..places.len()).max_by(|a, b| doubts[*a].total_cmp(&doubts[*b]));
            let Some(worst) = worst.filter(|at| 2.0 * doubts[*at] > tolerance) else {
                break;
            };
            let mut answer = vec![[0.0; 5]; ranges.len()];
            surface.at(&places[worst], &mut answer);
            points.push(places[worst].clone());
            values.push(answer.iter().map(|answer| answer[0]).collect());
            next.push(places[worst].clone());
            let lengths = surface.lengths().to_vec();
            match Kriging::with(&points, &values, lengths, surface.nugget()) {
                Some(known) => surface = known,
                None => break,
            }
        }
        if next.is_empty() {
            break;
        }
        add(file, &next, batch, &mut |done| hear(done, ROUND))?;
    }
    Ok(())
}

/// How many fresh points decide in a round: the first 59, of which a table that is beyond its tolerance in 5 % of the
/// box misses none with a chance of 0.95⁵⁹ < 5 %; a later one as many as keep all rounds together below 5 %, each with
/// half of what is left of it.
fn fresh_points(round: u64) -> usize {
    let within = 1.0 - BEYOND;
    let (mut left, mut count) = (BEYOND, FRESH as f64);
    for _ in 0..round {
        left -= within.powf(count);
        count = ((0.5 * left).ln() / within.ln()).ceil();
    }
    count as usize
}

/// What fresh points say of a table, and those over the unit cube that it misses.
fn certify(
    table: &ResponseTable,
    tolerance: f64,
    round: u64,
    batch: &Batch<'_>,
) -> Result<(Certificate, Vec<Vec<f64>>), PointEnd> {
    let file = table.file();
    let (dimensions, ranges) = (file.parameters.len(), ranges(file));
    let (seed, count) = (FRESH_SEED + round, fresh_points(round));
    let uniform = |number: usize| (split_mix(seed, number as u64) >> 11) as f64 / 2.0_f64.powi(53);
    let fresh: Vec<Vec<f64>> = (0..count)
        .map(|point| {
            (0..dimensions)
                .map(|along| uniform(point * dimensions + along))
                .collect()
        })
        .collect();
    let at: Vec<_> = fresh.iter().map(|point| file.in_box(point)).collect();
    let solved = batch.all(&at, &mut |_| {})?;
    let errors: Vec<_> = at
        .iter()
        .zip(&solved)
        .map(|(at, solved)| off(table, at, solved, &ranges))
        .collect();
    let outputs = 0..ranges.len();
    let of_output = |output: usize| errors.iter().map(move |error| error[output]);
    let worst = (0..count).max_by(|a, b| largest(&errors[*a]).total_cmp(&largest(&errors[*b])));
    let certificate = Certificate {
        tolerance,
        points: count,
        seed,
        worst: outputs
            .clone()
            .map(|output| of_output(output).fold(0.0, f64::max))
            .collect(),
        worst_at: worst.map_or_else(Vec::new, |worst| at[worst].clone()),
        deviations: outputs
            .map(|output| {
                let sum: f64 = of_output(output).map(|error| error * error).sum();
                (sum / count as f64).sqrt() * ranges[output]
            })
            .collect(),
    };
    let missed = fresh.into_iter().zip(&errors);
    let missed = missed.filter(|(_, error)| largest(error) > tolerance);
    Ok((certificate, missed.map(|(point, _)| point).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever the number of rounds, a table that is beyond its tolerance in 5 % of the box is taken with a chance
    /// below 5 %.
    #[test]
    fn all_rounds_together_keep_the_confidence() {
        assert_eq!([0, 1].map(fresh_points), [FRESH, 141]);
        let chance = |round| (1.0 - BEYOND).powf(fresh_points(round) as f64);
        let sum: f64 = (0..30).map(chance).sum();
        assert!(sum < BEYOND, "{sum}");
    }
}
