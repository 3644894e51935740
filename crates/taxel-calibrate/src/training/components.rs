//! Training of the other components of a force: of the features of the pressing force, with what
//! runs say of the next one.

use taxel::trained::{Component, ComponentMap, ForceMap, Ridge, TrainingError};

use super::across::{Divided, mean};
use super::force::{blocks_of, features_at, known_before, moments_of, moments_of_all};
use super::{ForceOptions, HeldOutForce, Series, Session, TrainingRun, interval_factor};

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
/// force, with its options; whole runs are held out in turn, or blocks of the only one.
///
/// # Errors
/// [`TrainingError`].
pub fn trained_components(
    map: &ForceMap,
    runs: &[Session],
    options: &ForceOptions,
) -> Result<Vec<TrainedComponent>, TrainingError> {
    let mut found = Vec::new();
    for component in Component::ALL {
        let of = |run: &Session| -> Option<Series> {
            let all = run.components.iter();
            let mut own = all.filter(|(other, _)| *other == component);
            own.next().map(|(_, series)| series.clone())
        };
        let readings: Vec<TrainingRun> = runs
            .iter()
            .filter_map(|run| of(run).map(|series| features_at(map, run, Some(&series))))
            .collect::<Result<_, _>>()?;
        if !readings.is_empty() {
            found.push(trained(component, map, &readings, options)?);
        }
    }
    Ok(found)
}

fn trained(
    component: Component,
    map: &ForceMap,
    readings: &[TrainingRun],
    options: &ForceOptions,
) -> Result<TrainedComponent, TrainingError> {
    let (mut held_out, ridge) = fitted(map, readings, options)?;
    let in_blocks = ForceOptions {
        whole_runs: false,
        ..options.clone()
    };
    let (blocks, _) = fitted(map, readings, &in_blocks)?;
    let squares: Vec<f64> = blocks.errors.iter().map(|error| error * error).collect();
    let forces = readings.iter().flat_map(|run| &run.force);
    let largest = forces.fold(0.0, |most: f64, force| most.max(force.abs()));
    let divided = Divided::of(&held_out, (readings.len(), mean(&squares)));
    let within = divided.within(&held_out);
    let mut own = ComponentMap {
        component,
        ridge,
        interval_factor: interval_factor(within.errors, within.deviations),
        between_runs: divided.of_held_out(largest),
    };
    for (deviation, estimate) in held_out.deviations.iter_mut().zip(&held_out.estimates) {
        *deviation = own.deviation(*estimate, *deviation);
    }
    own.interval_factor *= divided.of_all(&held_out, &own.ridge);
    own.between_runs = divided.of_next(largest);
    Ok(TrainedComponent {
        map: own,
        held_out,
        largest,
    })
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
        let Some(known) = known_before(&blocks, &parts, &all, number) else {
            continue;
        };
        let ridge = options.ridge(&known, map)?;
        let run = &readings[block.run];
        for row in block.rows.clone() {
            let features = &run.features[row];
            let noise = ridge.noise_variance().sqrt();
            let deviation = noise * (1.0 + ridge.leverage(features)).sqrt();
            let reading = [run.times[row], run.force[row]];
            held_out.push(block.run, reading, [ridge.mean(features), deviation], noise);
        }
    }
    Ok((held_out, options.ridge(&all, map)?))
}
