//! Scales, directions and centres of the features of recordings: readings settle them, never a force.

use faer::{Mat, Side};
use taxel::trained::{FeatureLaw, SLOW, SUMS, Standard, TrainingError};
use taxel_numerics::split_mix;

use super::Session;
use super::fold::{BLOCKS, Fold};

/// Times of the memory that are tried, s, if what is held out lasts this many times as long: slower creep is drift.
const TIMES: [f64; 6] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0];
const SEEN: f64 = 3.5;
/// Rows that scales and directions are settled with at most: more teach little, and time and memory grow
/// with them.
const LAW_ROWS: usize = 5000;
/// Directions that are kept, and components at most.
const DIRECTIONS: usize = 48;
const COMPONENTS: usize = 24;
/// Directions with less than this share of the variance of the first are rounding.
const ROUNDING: f64 = 1e-6;
/// A direction counts when frames vary along it by this many times the variance of noise.
const OVER_NOISE: f64 = 4.0;
/// Centres of kernels: of few components more, as they can fill their space.
const CENTRES: [usize; 2] = [400, 250];
const FEW_COMPONENTS: usize = 6;

/// Frames of a run that are not left out, less the rest.
fn tared<'a>(
    (number, run): (usize, &'a Session),
    except: Option<&'a Fold>,
) -> impl Iterator<Item = Vec<f64>> + 'a {
    let rest = run.baseline();
    let frames = run.sensor.times().iter().zip(run.sensor.rows());
    let frames =
        frames.filter(move |(time, _)| except.is_none_or(|fold| !fold.has(number, **time)));
    frames.map(move |(_, row)| row.iter().zip(&rest).map(|(x, b)| x - b).collect())
}

/// Scale of the channels of runs, and their noise at rest over it.
///
/// # Errors
/// [`TrainingError`] where no channel changes.
pub(super) fn scale_of(
    runs: &[Session],
    except: Option<&Fold>,
) -> Result<(Standard, Vec<f64>), TrainingError> {
    let rows = rows_of(runs, except);
    let mut standard = Standard::of(&rows)?;
    standard.centre.fill(0.0);
    let mut noise = rest_noise(runs, except, &standard);
    // A channel that shows at rest nearly all that it ever shows is noise: its prior is stronger.
    for (scale, noise) in standard.scale.iter_mut().zip(&mut noise) {
        *scale /= (1.0 - (*noise / *scale).powi(2)).max(0.01).sqrt();
        *noise /= *scale;
    }
    Ok((standard, noise))
}

fn rows_of(runs: &[Session], except: Option<&Fold>) -> Vec<Vec<f64>> {
    let rows = runs.iter().enumerate().flat_map(|run| tared(run, except));
    let rows: Vec<Vec<f64>> = rows.collect();
    let step = rows.len().div_ceil(LAW_ROWS).max(1);
    rows.into_iter().step_by(step).collect()
}

/// Scales, directions and centres of the features of runs.
///
/// # Errors
/// [`TrainingError`].
pub(super) fn law_of(
    runs: &[Session],
    except: Option<&Fold>,
) -> Result<(Standard, FeatureLaw), TrainingError> {
    let (standard, noise) = scale_of(runs, except)?;
    let rows = rows_of(runs, except);
    let scaled: Vec<Vec<f64>> = rows
        .iter()
        .filter_map(|row| standard.apply(row).ok())
        .collect();
    let common = median(standard.scale.clone());
    let relative = standard.scale.iter().map(|scale| scale / common).collect();
    let longest = runs.iter().map(|run| {
        let times = run.sensor.times();
        times[times.len() - 1] - times[0]
    });
    // A block of the only run tells nothing of a memory that goes on in its neighbours.
    let groups = if runs.len() == 1 { BLOCKS } else { 1 };
    let longest = longest.fold(0.0, f64::max) / groups as f64;
    let steps = runs.iter().map(|run| run.sensor.usual_step());
    let step = steps.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let slower = TIMES
        .into_iter()
        .filter(|time| *time > step && SEEN * time <= longest);
    let times = std::iter::once(step).chain(slower).collect();
    let law = law_of_rows(&scaled, &noise, relative, times)?;
    Ok((standard, law))
}

/// Directions and centres of rows of scaled readings with some `noise`, or of patterns, that have none; see
/// [`FeatureLaw`] for `relative` and `times`.
///
/// # Errors
/// [`TrainingError`].
pub(super) fn law_of_rows(
    scaled: &[Vec<f64>],
    noise: &[f64],
    relative: Vec<f64>,
    times: Vec<f64>,
) -> Result<FeatureLaw, TrainingError> {
    if scaled.len() < 2 {
        return Err(TrainingError::TooFew {
            found: scaled.len(),
            needed: 2,
        });
    }
    let width = relative.len();
    let design = Mat::from_fn(scaled.len(), width, |i, j| scaled[i][j]);
    let moments = design.transpose() * &design * faer::Scale(1.0 / scaled.len() as f64);
    let decomposed = moments
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| TrainingError::Dependent { features: width })?;
    let (vectors, values) = (decomposed.U(), decomposed.S());
    // The largest come last.
    let kept: Vec<usize> = (0..width).rev().take(DIRECTIONS).collect();
    let first = values[width - 1];
    let floor = (OVER_NOISE * median(noise.iter().map(|n| n * n).collect())).max(ROUNDING * first);
    let components = kept.iter().filter(|at| values[**at] > floor).count();
    let sizes = scaled
        .iter()
        .flat_map(|row| row.iter().zip(&relative).map(|(x, r)| (x * r).abs()));
    let slow = components.clamp(2, COMPONENTS).min(kept.len());
    let mut law = FeatureLaw {
        most: sizes.fold(f64::MIN_POSITIVE, f64::max),
        directions: kept
            .iter()
            .map(|at| (0..width).map(|j| vectors[(j, *at)]).collect())
            .collect(),
        components: slow,
        size: first.sqrt().max(f64::MIN_POSITIVE),
        tops: vec![1.0; SUMS],
        slow_spread: vec![0.0; (times.len() - 1) * slow.min(SLOW) + times.len() * SUMS],
        times,
        centres: Vec::new(),
        length: 1.0,
        relative,
    };
    let sums: Vec<[f64; SUMS]> = scaled.iter().map(|row| law.sums(row)).collect();
    for (at, top) in law.tops.iter_mut().enumerate() {
        *top = root_mean_square(sums.iter().map(|sums| sums[at])).max(f64::MIN_POSITIVE);
    }
    let components: Vec<Vec<f64>> = scaled.iter().map(|row| law.along(row)).collect();
    let count = CENTRES[usize::from(law.components > FEW_COMPONENTS)];
    law.centres = centres(&components, count);
    law.length = median_distance(&law.centres);
    Ok(law)
}

/// Standard deviation of the channels in use before the first contact.
fn rest_noise(runs: &[Session], except: Option<&Fold>, standard: &Standard) -> Vec<f64> {
    let whole = |(number, _): &(usize, &Session)| {
        except.is_none_or(|fold| fold.run != *number || fold.times.start.is_finite())
    };
    let mut squares = vec![0.0; standard.used.len()];
    let mut count = 0.0_f64;
    for (_, run) in runs.iter().enumerate().filter(whole) {
        let frames = run.rest_frames();
        for (square, channel) in squares.iter_mut().zip(&standard.used) {
            let of = || {
                frames
                    .iter()
                    .map(|row| row[*channel])
                    .filter(|x| x.is_finite())
            };
            let mean = of().sum::<f64>() / of().count().max(1) as f64;
            *square += of().map(|x| (x - mean).powi(2)).sum::<f64>();
        }
        count += frames.len() as f64;
    }
    let deviation = |square: f64| (square / count.max(1.0)).sqrt();
    squares.into_iter().map(deviation).collect()
}

pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    f64::sqrt(sum / f64::max(count, 1.0))
}

pub(super) fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Centres among rows: in turn the row that is farthest from all centres, and any.
fn centres(rows: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let any = |number: usize| (split_mix(0, number as u64) % rows.len() as u64) as usize;
    let mut chosen = vec![any(0)];
    let mut nearest: Vec<f64> = rows
        .iter()
        .map(|row| apart(row, &rows[chosen[0]]))
        .collect();
    while chosen.len() < count.min(rows.len()) {
        let far = (0..rows.len()).max_by(|a, b| nearest[*a].total_cmp(&nearest[*b]));
        let next = match far {
            Some(far) if chosen.len() % 2 == 1 => far,
            _ => any(chosen.len()),
        };
        // A centre twice would say nothing.
        let next = if nearest[next] > 0.0 {
            next
        } else {
            far.unwrap_or(next)
        };
        if nearest[next] <= 0.0 {
            break;
        }
        chosen.push(next);
        for (nearest, row) in nearest.iter_mut().zip(rows) {
            *nearest = nearest.min(apart(row, &rows[next]));
        }
    }
    chosen.into_iter().map(|at| rows[at].clone()).collect()
}

fn median_distance(centres: &[Vec<f64>]) -> f64 {
    let pairs = centres.iter().enumerate();
    let distances = pairs.flat_map(|(i, a)| centres[..i].iter().map(|b| apart(a, b)));
    median(distances.collect()).sqrt().max(f64::MIN_POSITIVE)
}
