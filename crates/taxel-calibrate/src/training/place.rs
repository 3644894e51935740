//! Training of the mixture of maps from patterns of channels to the place of a contact.

use rayon::prelude::*;
use taxel::trained::{
    AxisMap, Block, FeatureLaw, NearestPatterns, PatternMap, PatternStream, PlaceMap, Standard,
    TrainingError,
};
use taxel_numerics::dense::long_dot;

use super::design::{Design, Form, HeldOutReadings, Mixture, error_law};
use super::force::{MARGIN, interpolated};
use super::law::{law_of_rows, scale_of};
use super::{NORMAL_95, Session, interval_factor};

/// Maps of the pattern, then of that with what changed lately, from simple to rich.
const FORMS: [Form; 6] = [
    (0, &[Block::Channels]),
    (0, &[Block::Channels, Block::Products]),
    (
        0,
        &[
            Block::Channels,
            Block::Powers,
            Block::Products,
            Block::Broad,
        ],
    ),
    (0, &[Block::Channels, Block::Products, Block::Sharp]),
    (
        1,
        &[
            Block::Channels,
            Block::Powers,
            Block::Products,
            Block::Broad,
        ],
    ),
    (1, &[Block::Channels, Block::Products, Block::Sharp]),
];
const BLOCKS: [Block; 5] = [
    Block::Channels,
    Block::Powers,
    Block::Products,
    Block::Broad,
    Block::Sharp,
];
/// Patterns that are kept as neighbours at most, and rows that settle the features.
const PATTERNS: usize = 2000;
const LAW_ROWS: usize = 5000;
/// Runs differ in how far places are off by about this share: so much counts as two runs, before any is seen.
const USUAL: f64 = 0.15;

/// A mixture of maps of places, with what was held out of x and of y, m.
pub(crate) struct TrainedPlace {
    pub(crate) map: PlaceMap,
    pub(crate) held_out: [HeldOutReadings; 2],
}

/// Trains on `readings`: for each run times and places, m, of contacts. Each run begins without one.
///
/// # Errors
/// [`TrainingError`].
pub(crate) fn train_place(
    runs: &[Session],
    readings: &[Vec<(f64, [f64; 2])>],
) -> Result<TrainedPlace, TrainingError> {
    let (standard, _) = scale_of(runs, None)?;
    let longest = runs.iter().map(|run| run.sensor.longest_step());
    let longest_step = longest.fold(0.0, f64::max);
    let Patterns {
        rows,
        sizes,
        places,
    } = patterns_of(runs, readings, &standard, longest_step);
    if rows.is_empty() {
        return Err(TrainingError::TooFew {
            found: 0,
            needed: 1,
        });
    }
    // The pattern by itself is the beginning of that with what changed lately.
    let width = standard.used.len() + 1;
    let own: Vec<&[f64]> = rows.iter().map(|row| &row[..width]).collect();
    let both: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
    let laws = [law_of_patterns(&own)?, law_of_patterns(&both)?];
    let features = features_of(&laws, &own, &both);
    let parts = [(&laws[0], &BLOCKS[..]), (&laws[1], &BLOCKS[..])];
    let directions = |pattern: &&[f64]| -> Vec<f64> {
        laws[0]
            .directions
            .iter()
            .map(|d| long_dot(d, pattern))
            .collect()
    };
    let along: Vec<Vec<f64>> = own.iter().map(directions).collect();
    let place_of = |[run, at]: &[usize; 2]| readings[*run][*at].1;
    let design = Design::of(&parts, features, &places)?;
    let index = |wanted: &[usize; 2]| places.binary_search(wanted).ok();
    let neighbours = |keep: &dyn Fn(usize) -> bool| -> NearestPatterns {
        let groups = design
            .places
            .iter()
            .enumerate()
            .filter(|(group, _)| keep(*group));
        let rows: Vec<usize> = groups
            .flat_map(|(_, rows)| rows.iter().filter_map(index))
            .collect();
        let step = rows.len().div_ceil(PATTERNS).max(1);
        let rows = rows.into_iter().step_by(step);
        let (patterns, places) = rows
            .map(|row| (along[row].clone(), place_of(&places[row])))
            .unzip();
        NearestPatterns { patterns, places }
    };
    // Of each group the places of the nearest patterns of the others.
    let nearest: Vec<Vec<[f64; 2]>> = (0..design.places.len())
        .into_par_iter()
        .map(|group| {
            let others = neighbours(&|other| other != group);
            let rows = design.places[group].iter().filter_map(index);
            rows.map(|row| others.place(&along[row])).collect()
        })
        .collect();
    let axis = |axis: usize| -> Result<(AxisMap, HeldOutReadings), TrainingError> {
        let coordinates = |run: &Vec<(f64, [f64; 2])>| {
            run.iter()
                .map(|(time, place)| [*time, place[axis]])
                .collect()
        };
        let targets: Vec<Vec<[f64; 2]>> = readings.iter().map(coordinates).collect();
        let beside = |group: &Vec<[f64; 2]>| group.iter().map(|place| place[axis]).collect();
        let beside: Vec<Vec<f64>> = nearest.iter().map(beside).collect();
        let mixture = design.mixed(&FORMS, &targets, Some(&beside))?;
        let order = design.places.iter().flatten().filter_map(index);
        Ok(axis_of(mixture, order.map(|row| sizes[row])))
    };
    let [x, y] = [axis(0)?, axis(1)?];
    let components: Vec<Vec<f64>> = own.iter().map(|pattern| laws[0].along(pattern)).collect();
    let spread = |at: usize| {
        let sum: f64 = components.iter().map(|row| row[at] * row[at]).sum();
        (sum / components.len() as f64)
            .sqrt()
            .max(f64::MIN_POSITIVE)
    };
    let mut map = PlaceMap {
        nearest: neighbours(&|_| true),
        axes: [x.0, y.0],
        spread: (0..laws[0].components).map(spread).collect(),
        farthest: f64::INFINITY,
        standard,
        laws: laws.clone(),
        longest_step,
    };
    let farthest = own
        .iter()
        .map(|pattern| map.distance(pattern))
        .fold(0.0, f64::max);
    map.farthest = MARGIN * farthest;
    Ok(TrainedPlace {
        map,
        held_out: [x.1, y.1],
    })
}

/// Patterns of readings.
#[derive(Default)]
struct Patterns {
    /// Of each reading the pattern with what changed lately.
    rows: Vec<Vec<f64>>,
    /// Its size.
    sizes: Vec<f64>,
    /// Its run and number.
    places: Vec<[usize; 2]>,
}

fn patterns_of(
    runs: &[Session],
    readings: &[Vec<(f64, [f64; 2])>],
    standard: &Standard,
    longest_step: f64,
) -> Patterns {
    let mut all = Patterns::default();
    for (number, (run, readings)) in runs.iter().zip(readings).enumerate() {
        let wanted: Vec<(usize, f64)> = readings
            .iter()
            .enumerate()
            .map(|(at, (time, _))| (at, *time))
            .collect();
        let mut stream = PatternStream::new(standard, run.baseline(), longest_step);
        let found = interpolated(run, longest_step, &wanted, |time, frame| {
            stream.push(standard, time, frame).ok()?;
            let [_, both] = stream.patterns();
            let mut row = both.clone();
            row.push(stream.size());
            Some(row)
        });
        for (at, mut row) in found {
            all.places.push([number, at]);
            all.sizes.extend(row.pop());
            all.rows.push(row);
        }
    }
    all
}

fn law_of_patterns(rows: &[&[f64]]) -> Result<FeatureLaw, TrainingError> {
    let thin = rows.iter().step_by(rows.len().div_ceil(LAW_ROWS));
    let thin: Vec<Vec<f64>> = thin.map(|row| row.to_vec()).collect();
    law_of_rows(&thin, &[], vec![1.0; rows[0].len()], vec![1.0])
}

/// Features of each pattern by itself, then with what changed lately.
fn features_of(laws: &[FeatureLaw; 2], own: &[&[f64]], both: &[&[f64]]) -> Vec<Vec<f64>> {
    let of = |law: usize, pattern: &[f64]| {
        let all = laws[law].instant(pattern);
        let ranges = BLOCKS.iter().map(|block| laws[law].range(*block));
        ranges
            .flat_map(|range| all[range].to_vec())
            .collect::<Vec<f64>>()
    };
    own.par_iter()
        .zip(both)
        .map(|(own, both)| [of(0, own), of(1, both)].concat())
        .collect()
}

/// The map along an axis, with what was held out of readings of some sizes.
fn axis_of(mixture: Mixture, sizes: impl Iterator<Item = f64>) -> (AxisMap, HeldOutReadings) {
    let Mixture {
        members,
        beside,
        mut held_out,
        range,
        ..
    } = mixture;
    // The deviation is one of the size of the readings instead of that of the estimate.
    let sizes = sizes.map(f64::recip).collect();
    let estimates = std::mem::replace(&mut held_out.estimates, sizes);
    let error = error_law(&held_out, &held_out.errors);
    let error = error.times(wider(&held_out, |size, difference| {
        error.at(size, difference)
    }));
    held_out.deviations = (0..estimates.len())
        .map(|row| error.at(held_out.estimates[row], held_out.differences[row]))
        .collect();
    held_out.estimates = estimates;
    let members = members.into_iter().zip(FORMS);
    let members = members.map(|(map, (law, _))| PatternMap { law, map });
    let map = AxisMap {
        members: members.collect(),
        nearest: beside,
        error,
        range,
    };
    (map, held_out)
}

/// Factor on the deviations for a further run: runs differ in how far places are off.
fn wider(found: &HeldOutReadings, deviation: impl Fn(f64, f64) -> f64) -> f64 {
    let groups = found.runs.chunk_by(|a, b| a == b);
    let mut begin = 0;
    let mut ratios = Vec::new();
    for group in groups {
        let rows = begin..begin + group.len();
        begin = rows.end;
        let deviations: Vec<f64> = rows
            .clone()
            .map(|row| deviation(found.estimates[row], found.differences[row]))
            .collect();
        ratios.push((interval_factor(&found.errors[rows], &deviations) * NORMAL_95).ln());
    }
    let count = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / count;
    let apart: f64 = ratios.iter().map(|ratio| (ratio - mean).powi(2)).sum();
    let variance = (2.0 * USUAL * USUAL + apart) / (count + 1.0);
    // The mean of a logarithmic normal law.
    (0.5 * variance * (1.0 + 1.0 / count)).exp()
}
