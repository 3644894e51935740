//! Forms, weights of old readings and priors that are tried for a force.

use rayon::prelude::*;
use taxel::trained::{MemoryLaw, Polynomial, TrainingError};

use super::across::mean;
use super::force::trained_force;
use super::{ForceOptions, Session};

/// Times of creep that are tried, s.
const CREEP: [&[f64]; 5] = [
    &[],
    &[1.0, 10.0],
    &[1.0, 10.0, 100.0],
    &[1.0, 3.0, 10.0, 30.0, 100.0],
    &[1.0, 3.0, 10.0, 30.0, 100.0, 300.0],
];
/// Directions of the body whose products with their creep are tried.
const DIRECTIONS: usize = 3;
/// Time in which the weight of a reading falls to 1/e where a body changes, s: two to three presses of
/// the public recordings.
const FADING: f64 = 100.0;
/// Strength of a prior over the firm one, and the shares of it of the channels, of the memory and of
/// the products with it.
type Prior = (f64, [f64; 3]);
const FIRST: Prior = (1.0, [1.0, 1.0, 1.0]);
/// Priors beside the first for the best forms. Blocks of one run resemble each other more than the
/// next run does: of one run the weakest would be chosen, and err on the next.
const OF_ONE: [Prior; 4] = [
    (0.01, [1.0, 1.0, 1.0]),
    (0.1, [1.0, 1.0, 1.0]),
    (3.0, [1.0, 1.0, 1.0]),
    (10.0, [1.0, 1.0, 1.0]),
];
const OF_SEVERAL: [Prior; 8] = [
    (0.1, [1.0, 1.0, 1.0]),
    (0.3, [1.0, 1.0, 1.0]),
    (1.0, [1.0, 0.3, 0.3]),
    (1.0, [1.0, 0.1, 1.0]),
    (3.0, [1.0, 1.0, 1.0]),
    (3.0, [1.0, 0.3, 0.3]),
    (3.0, [1.0, 0.1, 0.1]),
    (10.0, [1.0, 1.0, 1.0]),
];

/// Strength of the prior that a map of one run has unless a weaker one is clearly better. It was chosen
/// on the two public force runs, between the rest of a run, which asks for a weaker one, and the
/// next run, which asks for a stronger one.
pub(super) fn firm(fading: f64) -> f64 {
    if fading.is_finite() { 2.0 } else { 10.0 }
}

/// Forms whose other priors are tried.
const BEST_FORMS: usize = 2;
/// Forms that are compared to the end.
const KEPT_FORMS: usize = 6;
/// Another time between scale and sensor than none must leave less than this share of the mean
/// square error: a map with memory makes up for a scale that is a little late, and its force is
/// then what the scale shows at the time of the frame.
const CLEARLY_LATE: f64 = 0.7;

/// Products, creep times and priors that are tried for a force: all forms with one prior, the
/// best six and the best without memory to the end, and the best two with more priors, where old
/// readings fade and where all count the same. The scale is
/// taken to show the force of its time, unless a time from −0.5 s to 1.5 s after the sensor leaves
/// clearly less error of maps with memory, of a strong and of a weak prior.
///
/// # Errors
/// [`TrainingError`].
pub fn usual_candidates(runs: &[Session]) -> Result<Vec<ForceOptions>, TrainingError> {
    let error = |options: &ForceOptions| -> Result<f64, TrainingError> {
        let (_, held_out) = trained_force(runs, options)?;
        let squares: Vec<f64> = held_out.errors.iter().map(|error| error * error).collect();
        Ok(mean(&squares))
    };
    let fading = if runs.len() > 1 {
        f64::INFINITY
    } else {
        FADING
    };
    let late = |prior: Prior| -> Result<f64, TrainingError> {
        let tried: Vec<(f64, f64)> = (-5..=15)
            .into_par_iter()
            .map(|tenths| {
                let offset = 0.1 * f64::from(tenths);
                Ok((
                    error(&options(1, CREEP[2], f64::INFINITY, prior, offset))?,
                    offset,
                ))
            })
            .collect::<Result<_, TrainingError>>()?;
        let least = tried.iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let prompt = tried.iter().find(|(_, offset)| *offset == 0.0);
        Ok(match (least, prompt) {
            (Some((least, offset)), Some((prompt, _))) if *least < CLEARLY_LATE * prompt => *offset,
            _ => 0.0,
        })
    };
    // What a strong prior keeps back, and what a weak one makes of noise, are no delay.
    let [one, other] = [late(FIRST)?, late(OF_ONE[0])?];
    let offset = if one.abs() < other.abs() { one } else { other };
    let shapes: &[(u8, bool)] = if one_sided(runs) {
        &[(1, false), (2, false), (1, true), (2, true)]
    } else {
        &[(1, false), (2, false)]
    };
    // What takes longer than a run is not seen in it.
    let length = |run: &Session| {
        let times = run.sensor.times();
        times[times.len() - 1] - times[0]
    };
    let longest = runs.iter().map(length).fold(0.0, f64::max);
    let seen = |creep: &[f64]| -> Vec<f64> {
        creep
            .iter()
            .copied()
            .filter(|time| *time <= longest)
            .collect()
    };
    let mut creep_times: Vec<Vec<f64>> = CREEP.map(seen).to_vec();
    creep_times.dedup();
    let memories = creep_times.iter().flat_map(|creep| {
        let directions = [0, if creep.is_empty() { 0 } else { DIRECTIONS }];
        let count = 1 + usize::from(!creep.is_empty());
        directions
            .into_iter()
            .take(count)
            .map(move |mixed| (creep, mixed))
    });
    let forms: Vec<ForceOptions> = memories
        .flat_map(|(creep, mixed)| {
            shapes.iter().map(move |(degree, reciprocal)| ForceOptions {
                reciprocal: *reciprocal,
                mixed,
                ..options(*degree, creep, fading, FIRST, offset)
            })
        })
        .collect();
    let mut order: Vec<(f64, ForceOptions)> = forms
        .into_par_iter()
        .map(|form| Ok((error(&form)?, form)))
        .collect::<Result<_, TrainingError>>()?;
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let more: &[Prior] = if runs.len() > 1 { &OF_SEVERAL } else { &OF_ONE };
    let weighings = [f64::INFINITY, FADING]
        .map(|fading| (fading, FIRST))
        .into_iter();
    let weighings = weighings.flat_map(|(fading, first)| {
        let priors = [first].into_iter().chain(more.iter().copied());
        priors.map(move |prior| (fading, prior))
    });
    let others: Vec<(f64, Prior)> = weighings
        .filter(|weighing| *weighing != (fading, FIRST))
        .collect();
    let memoryless = |form: &ForceOptions| form.memory.creep_times.is_empty();
    let without = order.iter().position(|(_, form)| memoryless(form));
    let mut all = Vec::new();
    for (rank, (_, form)) in order.into_iter().enumerate() {
        if rank >= KEPT_FORMS && Some(rank) != without {
            continue;
        }
        let others = if rank < BEST_FORMS { &others[..] } else { &[] };
        let others = others
            .iter()
            .map(|(fading, prior)| weighed(&form, *fading, *prior));
        let others: Vec<ForceOptions> = others.collect();
        all.push(form);
        all.extend(others);
    }
    Ok(all)
}

/// Readings stay this far from zero, over those at rest, where reciprocals are tried.
const FROM_ZERO: f64 = 0.02;

/// True if no reading of any channel that changes comes near to zero or changes its sign.
fn one_sided(runs: &[Session]) -> bool {
    runs.iter().all(|run| {
        let rest = run.baseline();
        let far = |row: &Vec<f64>| {
            let mut channels = row.iter().zip(&rest);
            channels.all(|(x, b)| x.is_nan() || (*x == 0.0 && *b == 0.0) || x / b > FROM_ZERO)
        };
        run.sensor.rows().iter().all(far)
    })
}

/// A form with another fading and prior.
fn weighed(form: &ForceOptions, fading: f64, (share, prior_shares): Prior) -> ForceOptions {
    ForceOptions {
        fading,
        prior: share * firm(fading),
        prior_shares,
        ..form.clone()
    }
}

fn options(
    degree: u8,
    creep_times: &[f64],
    fading: f64,
    prior: Prior,
    offset: f64,
) -> ForceOptions {
    let form = ForceOptions {
        polynomial: Polynomial { degree },
        memory: MemoryLaw {
            creep_times: creep_times.to_vec(),
            play_thresholds: Vec::new(),
        },
        offset,
        whole_runs: true,
        ..ForceOptions::default()
    };
    weighed(&form, fading, prior)
}
