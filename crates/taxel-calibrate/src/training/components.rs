//! Training of the other components of a force: of the features of the pressing force, with what
//! runs say of the next one.

use rayon::prelude::*;
use taxel::estimation::Touch;
use taxel::trained::{
    BetweenRuns, Component, ComponentMap, ForceMap, Relation, RestStatistics, Ridge, TrainingError,
};

use super::across::{CLEARLY_LESS, Divided, NO_WORSE, mean};
use super::force::{blocks_of, features_at, known_before, moments_of, moments_of_all};
use super::replay::{Live, Of};
use super::{ForceOptions, HeldOutForce, Session, TrainingRun};

/// Held-out estimates of a component, with its map.
#[derive(Debug, Clone)]
pub struct TrainedComponent {
    /// The map.
    pub map: ComponentMap,
    /// Estimates of the readings, each from a map without their block or run, SI.
    pub held_out: HeldOutForce,
    /// Largest reading, SI.
    pub largest: f64,
}

/// Trains the other components of the runs on the features of `map`, the map of their pressing
/// force, with its options; whole runs are held out in turn, or blocks of the only one, and
/// judged as they run live.
///
/// # Errors
/// [`TrainingError`].
pub fn trained_components(
    map: &ForceMap,
    runs: &[Session],
    options: &ForceOptions,
    (rest, relation): (&RestStatistics, Option<&Relation>),
) -> Result<Vec<TrainedComponent>, TrainingError> {
    let mut found = Vec::new();
    for component in Component::ALL {
        let (mut with, mut readings) = (Vec::new(), Vec::new());
        for run in runs {
            let own = run.components.iter().find(|(other, _)| *other == component);
            if let Some((_, series)) = own {
                readings.push(features_at(map, run, Some(series))?);
                with.push(run.clone());
            }
        }
        if !readings.is_empty() {
            let live = Live {
                runs: &with,
                rest,
                relation,
            };
            found.push(trained(component, map, &readings, options, &live)?);
        }
    }
    Ok(found)
}

/// Priors that are tried, over that of the pressing force, the strongest first: a component may be in
/// small differences of channels, with larger weights.
const PRIORS: [f64; 4] = [1.0, 0.1, 0.01, 0.001];

/// A map with what is held out of its readings, and the mean square of the errors of blocks.
struct Tried {
    options: ForceOptions,
    held_out: HeldOutForce,
    ridge: Ridge,
    blocks: f64,
}

impl Tried {
    fn of(
        map: &ForceMap,
        readings: &[TrainingRun],
        options: ForceOptions,
    ) -> Result<Self, TrainingError> {
        let (held_out, ridge) = fitted(map, readings, &options)?;
        let in_blocks = ForceOptions {
            whole_runs: false,
            ..options.clone()
        };
        let (blocks, _) = fitted(map, readings, &in_blocks)?;
        Ok(Self {
            options,
            held_out,
            ridge,
            blocks: mean_square(&blocks),
        })
    }

    /// Mean squares of the errors of runs and of blocks.
    fn errors(&self) -> [f64; 2] {
        [mean_square(&self.held_out), self.blocks]
    }
}

fn mean_square(held_out: &HeldOutForce) -> f64 {
    let errors = held_out.errors.iter();
    mean(&errors.map(|error| error * error).collect::<Vec<_>>())
}

/// The map of the strongest prior that errs by hardly more than the best, as that of the pressing
/// force.
fn of_best_prior(
    map: &ForceMap,
    readings: &[TrainingRun],
    options: &ForceOptions,
) -> Result<Tried, TrainingError> {
    let with = |share: &f64| {
        let options = ForceOptions {
            prior: share * options.prior,
            ..options.clone()
        };
        Tried::of(map, readings, options)
    };
    let mut tried: Vec<Tried> = PRIORS.par_iter().map(with).collect::<Result<_, _>>()?;
    let errors: Vec<[f64; 2]> = tried.iter().map(Tried::errors).collect();
    let units = [0, 1].map(|kind| {
        let all = errors.iter().map(|errors| errors[kind]);
        all.fold(f64::INFINITY, f64::min).max(f64::MIN_POSITIVE)
    });
    let error = |number: usize| {
        let weak = readings.len() == 1 && number > 0;
        let share = if weak { CLEARLY_LESS } else { 1.0 };
        (errors[number][0] / units[0] + errors[number][1] / units[1]) / share
    };
    let least = (0..tried.len()).map(error).fold(f64::INFINITY, f64::min);
    let firmest = (0..tried.len()).find(|number| error(*number) <= NO_WORSE * least);
    Ok(tried.swap_remove(firmest.unwrap_or(0)))
}

fn trained(
    component: Component,
    map: &ForceMap,
    readings: &[TrainingRun],
    options: &ForceOptions,
    live: &Live<'_>,
) -> Result<TrainedComponent, TrainingError> {
    let Tried {
        options,
        ridge,
        blocks,
        ..
    } = of_best_prior(map, readings, options)?;
    let forces = || readings.iter().flat_map(|run| run.force.iter().copied());
    let range = [
        forces().fold(f64::INFINITY, f64::min),
        forces().fold(f64::NEG_INFINITY, f64::max),
    ];
    let largest = range[1].max(-range[0]);
    let of_ridge = |ridge| ComponentMap {
        component,
        ridge,
        interval_factor: 1.0,
        between_runs: BetweenRuns::default(),
        range: Some(range),
    };
    let with = |ridge| ForceMap {
        components: vec![of_ridge(ridge)],
        ..map.clone()
    };
    let estimate: Of<'_> = &|touch| of_touch(component, touch);
    let mut held_out = live.held_out(readings, (map, &options), &with, estimate)?;
    let divided = Divided::of(&held_out, (readings.len(), blocks));
    let within = divided.within(&held_out);
    let mut own = ComponentMap {
        interval_factor: within.factor(0..within.errors.len()),
        between_runs: divided.of_held_out(largest),
        ..of_ridge(ridge)
    };
    held_out.widen(|estimate, deviation| own.deviation(estimate, deviation));
    own.interval_factor *= divided.of_all(&held_out, &own.ridge);
    own.between_runs = divided.of_next(largest);
    Ok(TrainedComponent {
        map: own,
        held_out,
        largest,
    })
}

/// A component of a touch with its standard deviation, SI.
fn of_touch(component: Component, touch: &Touch) -> [f64; 2] {
    let force = |axis: usize| {
        let variance = touch.total_covariance[axis][axis];
        [touch.total.force[axis], variance.sqrt()]
    };
    let moment = |axis: usize| [touch.total.moment[axis], touch.moment_deviation[axis]];
    match component {
        Component::ForceX => force(0),
        Component::ForceY => force(1),
        Component::MomentX => moment(0),
        Component::MomentY => moment(1),
        Component::MomentZ => moment(2),
    }
}

/// Estimates of the readings that are held out, with deviations without factors, and the map of all.
fn fitted(
    map: &ForceMap,
    readings: &[TrainingRun],
    options: &ForceOptions,
) -> Result<(HeldOutForce, Ridge), TrainingError> {
    let blocks = blocks_of(readings, options);
    let parts = moments_of(readings, &blocks)?;
    let all = moments_of_all(&parts)?;
    let mut held_out = HeldOutForce::default();
    for (number, block) in blocks.iter().enumerate() {
        let Some(known) = known_before(&blocks, &parts, &all, (number, options.learned_from))
        else {
            continue;
        };
        let ridge = options.ridge(&known, map)?;
        let run = &readings[block.run];
        for row in block.rows.clone() {
            let features = &run.features[row];
            let noise = ridge.noise_variance().sqrt();
            let deviation = noise * (1.0 + ridge.leverage(features)).sqrt();
            let reading = [run.times[row], run.force[row]];
            let found = [ridge.mean(features), deviation];
            held_out.push(block.run, reading, found, [noise, 0.0]);
        }
    }
    Ok((held_out, options.ridge(&all, map)?))
}
