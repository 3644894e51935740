//! Training of the relation of the channels: what each reads beside the others.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use taxel::trained::{CONTRADICTS, Relation, Standard, TrainingError};

use super::fold::Fold;
use super::{Session, blocks_of_time};

/// Rows that a relation is learned from at most; more teach it nothing.
const MOST_ROWS: usize = 4000;
/// Least variance of a scaled channel that the others leave open.
const LEAST: f64 = 1e-4;
/// Fewer channels have no relation.
const FEWEST: usize = 4;
/// Blocks that are held out where there is one run, and the factor on deviation and misfit:
/// blocks of one run resemble each other more than the next run does. Of the public recordings
/// another run has up to 3 times the deviation.
const BLOCKS: usize = 5;
pub(super) const OF_ONE_RUN: f64 = 3.0;

/// The relation of the channels of `runs`, of readings less those at rest or as they come, without what is
/// left out. Deviations and largest misfit are those of runs, or blocks of the only one, that are held out.
/// None for fewer than four channels.
///
/// # Errors
/// [`TrainingError`] without rows, or where no channel changes.
pub(crate) fn trained_relation(
    runs: &[Session],
    except: Option<&Fold>,
    tared: bool,
) -> Result<Option<Relation>, TrainingError> {
    let runs = runs
        .iter()
        .enumerate()
        .filter(|(_, run)| !tared || run.force.is_some());
    let runs: Vec<(Vec<f64>, Vec<&Vec<f64>>)> =
        runs.map(|run| rows_of(run, except, tared)).collect();
    let count: usize = runs.iter().map(|(_, rows)| rows.len()).sum();
    let step = count.div_ceil(MOST_ROWS).max(1);
    let thin = |(rest, rows): &(Vec<f64>, Vec<&Vec<f64>>)| {
        let less = |row: &&Vec<f64>| row.iter().zip(rest).map(|(x, b)| x - b).collect();
        rows.iter().step_by(step).map(less).collect()
    };
    let runs: Vec<Vec<Vec<f64>>> = runs
        .iter()
        .map(thin)
        .filter(|run: &Vec<_>| !run.is_empty())
        .collect();
    let all: Vec<Vec<f64>> = runs.iter().flatten().cloned().collect();
    if all.is_empty() {
        return Ok(None);
    }
    let mut standard = Standard::of(&all)?;
    let width = standard.used.len();
    if width < FEWEST {
        return Ok(None);
    }
    if tared {
        standard.centre.fill(0.0);
    }
    let scaled = |run: &Vec<Vec<f64>>| {
        run.iter()
            .filter_map(|row| standard.apply(row).ok())
            .collect()
    };
    let scaled: Vec<Vec<Vec<f64>>> = runs.iter().map(scaled).collect();
    let (parts, factor): (Vec<&[Vec<f64>]>, f64) = match &scaled[..] {
        [one] => {
            let blocks = blocks_of_time(one.len(), BLOCKS);
            (
                blocks.into_iter().map(|rows| &one[rows]).collect(),
                OF_ONE_RUN,
            )
        }
        several => (several.iter().map(Vec::as_slice).collect(), 1.0),
    };
    let mut largest = 0.0_f64;
    // Of each channel: what held-out frames differ by from what the others say, with the load of the others.
    let mut residuals: Vec<Vec<[f64; 2]>> = vec![Vec::new(); width];
    for (number, part) in parts.iter().enumerate() {
        let others = parts
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != number);
        let others: Vec<&[Vec<f64>]> = others.map(|(_, part)| *part).collect();
        let precision = precision(&others, width)?;
        let frames = Mat::from_fn(part.len(), width, |i, j| part[i][j]);
        let products = &frames * &precision;
        for (k, row) in part.iter().enumerate() {
            let square: f64 = row.iter().map(|z| z * z).sum();
            let mut misfit = 0.0;
            for i in 0..width {
                let product = products[(k, i)];
                misfit += row[i] * product;
                let load = (square - row[i] * row[i]).max(0.0).sqrt();
                residuals[i].push([product / precision[(i, i)], load]);
            }
            largest = largest.max(misfit);
        }
    }
    let whole: Vec<&[Vec<f64>]> = scaled.iter().map(Vec::as_slice).collect();
    let precision = precision(&whole, width)?;
    let ([deviation, of_load], tolerance) = deviations(&residuals, factor);
    Ok(Some(Relation {
        tared,
        precision: (0..width)
            .flat_map(|i| (0..=i).map(move |j| (i, j)))
            .map(|(i, j)| precision[(i, j)])
            .collect(),
        deviation,
        of_load,
        tolerance,
        largest_misfit: (factor * factor * largest).max(width as f64),
        standard,
    }))
}

/// What is subtracted of a run, its rest where that is wanted, and its whole frames that are not left out.
fn rows_of<'a>(
    (number, run): (usize, &'a Session),
    except: Option<&Fold>,
    tared: bool,
) -> (Vec<f64>, Vec<&'a Vec<f64>>) {
    let rest = if tared {
        run.baseline()
    } else {
        vec![0.0; run.sensor.width()]
    };
    let frames = run.sensor.times().iter().zip(run.sensor.rows());
    let kept = frames.filter(|(time, _)| except.is_none_or(|fold| !fold.has(number, **time)));
    let whole = |row: &&Vec<f64>| row.iter().zip(&rest).all(|(x, b)| (x - b).is_finite());
    let kept = kept.map(|(_, row)| row).filter(whole).collect();
    (rest, kept)
}

/// Deviations of the channels about what the others say, of an empty body and per load of the others, and the
/// factor with which no frame that was held out is farther on any channel than half of what contradicts. Few
/// presses are on each channel, so none gets by with less per load than half of the channels have.
fn deviations(residuals: &[Vec<[f64; 2]>], factor: f64) -> ([Vec<f64>; 2], f64) {
    let mean = |squares: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), s| (sum + s, count + 1.0));
        sum / f64::max(count, 1.0)
    };
    let of_channel = |own: &Vec<[f64; 2]>| {
        let middle = median(own.iter().map(|[_, load]| *load).collect());
        let mut light = own
            .iter()
            .filter(|[_, load]| *load <= middle)
            .map(|[off, _]| off * off);
        let base = mean(&mut light).sqrt().max(LEAST.sqrt());
        let loaded = own.iter().filter(|[_, load]| *load > middle);
        let mut of_load =
            loaded.map(|[off, load]| (off * off - base * base).max(0.0) / (load * load));
        (base, mean(&mut of_load).sqrt())
    };
    let (base, mut of_load): (Vec<f64>, Vec<f64>) = residuals.iter().map(of_channel).unzip();
    let usual = median(of_load.clone());
    for own in &mut of_load {
        *own = own.max(usual);
    }
    let farthest =
        residuals
            .iter()
            .zip(base.iter().zip(&of_load))
            .flat_map(|(own, (base, of_load))| {
                own.iter()
                    .map(move |[off, load]| off.abs() / base.hypot(of_load * load))
            });
    let wider = (farthest.fold(0.0, f64::max) / (0.5 * CONTRADICTS)).max(1.0);
    let wide = [base, of_load].map(|own| {
        own.into_iter()
            .map(|deviation| factor * deviation)
            .collect()
    });
    (wide, wider)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Inverse of the second moments of rows of scaled channels.
fn precision(parts: &[&[Vec<f64>]], width: usize) -> Result<Mat<f64>, TrainingError> {
    let rows: Vec<&Vec<f64>> = parts.iter().flat_map(|part| part.iter()).collect();
    let (found, needed) = (rows.len(), 2);
    if found < needed {
        return Err(TrainingError::TooFew { found, needed });
    }
    let design = Mat::from_fn(found, width, |i, j| rows[i][j]);
    let mut moments = design.transpose() * &design;
    for i in 0..width {
        for j in 0..width {
            moments[(i, j)] /= found as f64;
        }
        moments[(i, i)] += LEAST;
    }
    let factor = moments
        .llt(Side::Lower)
        .map_err(|_| TrainingError::Dependent { features: width })?;
    Ok(factor.inverse())
}
