//! Training of the relation of the channels: what each reads beside the others.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use taxel::trained::{Relation, Standard, TrainingError};

use super::blocks_of_time;

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

/// The relation of the channels of `runs`, rows of readings each, `tared` or as they come.
/// Deviation and largest misfit are those of runs, or blocks of the only one, that are held out.
/// None for fewer than four channels.
///
/// # Errors
/// [`TrainingError`] without rows, or where no channel changes.
pub(crate) fn trained_relation(
    runs: &[Vec<Vec<f64>>],
    tared: bool,
) -> Result<Option<Relation>, TrainingError> {
    let count: usize = runs.iter().map(Vec::len).sum();
    let step = count.div_ceil(MOST_ROWS).max(1);
    let thin = |run: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        let rows = run.iter().step_by(step);
        let whole = rows.filter(|row| row.iter().all(|value| value.is_finite()));
        whole.cloned().collect()
    };
    let runs: Vec<Vec<Vec<f64>>> = runs.iter().map(thin).collect();
    let all: Vec<Vec<f64>> = runs.iter().flatten().cloned().collect();
    let mut standard = Standard::of(&all)?;
    let width = standard.used.len();
    if width < FEWEST {
        return Ok(None);
    }
    if tared {
        standard.centre.fill(0.0);
    }
    let scaled: Vec<Vec<Vec<f64>>> = runs
        .iter()
        .map(|run| {
            run.iter()
                .filter_map(|row| standard.apply(row).ok())
                .collect()
        })
        .collect();
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
    let mut squares = vec![0.0; width];
    let (mut rows, mut largest) = (0.0, 0.0_f64);
    for (number, part) in parts.iter().enumerate() {
        let others = parts
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != number);
        let others: Vec<&[Vec<f64>]> = others.map(|(_, part)| *part).collect();
        let precision = precision(&others, width)?;
        for row in *part {
            rows += 1.0;
            let mut misfit = 0.0;
            for i in 0..width {
                let product: f64 = (0..width).map(|j| precision[(i, j)] * row[j]).sum();
                misfit += row[i] * product;
                squares[i] += (product / precision[(i, i)]).powi(2);
            }
            largest = largest.max(misfit);
        }
    }
    let whole: Vec<&[Vec<f64>]> = scaled.iter().map(Vec::as_slice).collect();
    let precision = precision(&whole, width)?;
    let deviation = |square: &f64| (factor * (square / f64::max(rows, 1.0)).sqrt()).max(1e-6);
    Ok(Some(Relation {
        tared,
        precision: (0..width)
            .flat_map(|i| (0..=i).map(move |j| (i, j)))
            .map(|(i, j)| precision[(i, j)])
            .collect(),
        deviation: squares.iter().map(deviation).collect(),
        largest_misfit: (factor * factor * largest).max(width as f64),
        standard,
    }))
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
