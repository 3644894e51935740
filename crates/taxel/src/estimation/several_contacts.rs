//! Several contacts below a soft cover, whose profiles overlap: as many as the
//! forces need, all fitted together.

mod joint_fit;
mod lone;
mod population;
mod profile;
mod raster;

use std::cell::LazyCell;

use population::{Population, Spread};
use raster::Raster;

use super::localisation::{ContactPosition, Localiser, Located, Method, flat_position, peak};
use super::position_fit::{NEAR, ProfileFit, STEPS};

/// More contacts than this are not looked for.
const MOST: usize = 4;
/// Unknowns of a contact: position x, y, size, force.
const OWN: usize = 4;
/// One sound fit in ten thousand misfits more: normal deviate of that level.
const LEVEL: f64 = 3.72;
/// Another contact must lower χ² by so much: four unknowns do so by chance once
/// in ten thousand positions, and there are some ten positions to choose from.
const WORTH: f64 = 28.0;
/// A quick fit of one contact that misfits by so many times more than noise allows leaves no
/// doubt that there are more.
const CLEARLY: f64 = 10.0;
/// Two contacts are apart by so many deviations of their distance, or one.
const APART: f64 = 4.0;
/// Steps between positions, and between sizes, that are looked at first.
const COARSE: [usize; 2] = [8, 4];
/// Rounds in which the contacts make room for each other.
const ROUNDS: usize = 2;

impl Localiser for ProfileFit {
    fn position(&self, forces: &[f64], deviations: &[f64]) -> Option<ContactPosition> {
        let position = Scene::new(self, forces, deviations).lone(deviations)?;
        position.is_known(self.model.pitch).then_some(position)
    }

    fn positions(&self, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
        several(self, forces, deviations)
    }
}

/// Contacts of all sizes on the elements, as far as the forces need them.
///
/// One is looked for first; as finely as its position can be known only where a quick fit
/// leaves a doubt. As long as the misfit is more than the noise allows, the contact that
/// explains most of what is left comes beside those before; each gives way to the others in
/// turn, then positions, sizes and forces of all are fitted together. The population of all
/// that explain the forces begins at these fits and at those of other sizes. The contact
/// stays if χ² falls by more than chance can do and all contacts of the population lie apart
/// by four deviations; if not, two are one that is as wide as both. Positions and covariances
/// are those of the population.
pub(super) fn several(fit: &ProfileFit, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
    let elements = fit.model.rows * fit.model.columns;
    let complete = forces.len() == elements && deviations.len() == elements;
    if !complete || peak(forces, deviations).is_none() {
        return Vec::new();
    }
    let scene = Scene::new(fit, forces, deviations);
    let one = |position: ContactPosition| Located {
        position: position.is_known(fit.model.pitch).then_some(position),
        carried: forces.to_vec(),
    };
    let lone = LazyCell::new(|| scene.lone(deviations));
    let alone = || lone.map(one).into_iter().collect();
    let raster = Raster::new(&scene);
    let (mut fitted, mut found) = (scene.one(&raster), None);
    if fitted.misfit <= CLEARLY * scene.allowed(1) {
        let sum = lone.map(|lone| lone.misfit + scene.far());
        if sum.is_none_or(|misfit| misfit <= scene.allowed(1)) {
            return alone();
        }
    }
    while fitted.shapes.len() < MOST && fitted.misfit > scene.allowed(fitted.shapes.len()) {
        let fits = scene.one_more(&raster, &fitted);
        let Some(best) = fits
            .first()
            .filter(|best| fitted.misfit - best.misfit >= WORTH)
        else {
            break;
        };
        let Some(population) = scene.population(&fits) else {
            break;
        };
        if population.apart() < APART {
            if found.is_none() {
                return vec![one(scene.joined(&population))];
            }
            break;
        }
        (fitted, found) = (best.clone(), Some(population));
    }
    found.map_or_else(alone, |found| scene.located(&found))
}

/// A contact: position in steps from the lower left element, index of the radius,
/// which may be between two, and force, N.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shape {
    at: [f64; 2],
    size: f64,
    force: f64,
}

/// Contacts with their misfit.
#[derive(Debug, Clone)]
struct Fitted {
    shapes: Vec<Shape>,
    misfit: f64,
}

/// The forces over their deviations, and where the elements are.
struct Scene<'a> {
    fit: &'a ProfileFit,
    tables: &'a [Vec<f64>],
    /// In steps from the lower left one.
    elements: Vec<[f64; 2]>,
    forces: &'a [f64],
    /// One over the deviation of each force.
    roots: Vec<f64>,
    /// Forces over their deviations.
    weighted: Vec<f64>,
}

impl<'a> Scene<'a> {
    fn new(fit: &'a ProfileFit, forces: &'a [f64], deviations: &[f64]) -> Self {
        let (rows, columns) = (fit.model.rows, fit.model.columns);
        let element = |index: usize| {
            let cells = [index % columns, rows - 1 - index / columns];
            cells.map(|cells| (cells * STEPS) as f64)
        };
        let gain = fit.model.gain_deviation;
        let pairs = forces.iter().zip(deviations);
        let roots: Vec<f64> = pairs
            .map(|(force, deviation)| deviation.hypot(gain * force).recip())
            .collect();
        Self {
            fit,
            tables: fit.shares(),
            elements: (0..forces.len()).map(element).collect(),
            forces,
            weighted: forces.iter().zip(&roots).map(|(f, w)| f * w).collect(),
            roots,
        }
    }

    /// Misfit of the elements that are too far from the highest one for its
    /// contact.
    fn far(&self) -> f64 {
        let highest = self.forces.iter().enumerate();
        let highest = highest.max_by(|(_, a), (_, b)| a.total_cmp(b));
        let top = highest.map_or([0.0; 2], |(index, _)| self.elements[index]);
        let pairs = self.elements.iter().zip(&self.weighted);
        pairs
            .filter(|(at, _)| !within(**at, top, (NEAR * STEPS) as f64))
            .map(|(_, force)| force * force)
            .sum()
    }

    /// The misfit that noise alone hardly ever exceeds (Wilson and Hilferty).
    fn allowed(&self, contacts: usize) -> f64 {
        let freedom = self.forces.len().saturating_sub(OWN * contacts);
        if freedom == 0 {
            return f64::INFINITY;
        }
        let freedom = freedom as f64;
        let width = 2.0 / (9.0 * freedom);
        freedom * (1.0 - width + LEVEL * width.sqrt()).powi(3)
    }

    /// Greatest steps of a position along an axis, and greatest index of a size.
    fn limits(&self) -> [f64; 3] {
        let model = &self.fit.model;
        let steps = |cells: usize| ((cells - 1) * STEPS) as f64;
        let sizes = self.tables.len() - 1;
        [steps(model.columns), steps(model.rows), sizes as f64]
    }

    /// All contacts, each with what it carries.
    fn located(&self, found: &Population) -> Vec<Located> {
        let located = |spread: &Spread| {
            let position = self.position(spread, found.misfit);
            Located {
                position: position.is_known(self.fit.model.pitch).then_some(position),
                carried: self.carried(&spread.mean),
            }
        };
        found.spreads().iter().map(located).collect()
    }

    fn position(&self, spread: &Spread, misfit: f64) -> ContactPosition {
        let model = &self.fit.model;
        let Shape { at, size, force } = spread.mean;
        let corner = flat_position(model, (model.rows - 1) * model.columns);
        let step = model.pitch.map(|pitch| pitch / STEPS as f64);
        let [xx, xy, yy] = spread.covariance;
        let cell = size as usize;
        let radius = |cell: usize| model.radii[cell.min(model.radii.len() - 1)];
        ContactPosition {
            centre: [0, 1].map(|axis| corner[axis] + at[axis] * step[axis]),
            covariance: [
                xx * step[0] * step[0],
                xy * step[0] * step[1],
                yy * step[1] * step[1],
            ],
            force,
            radius: Some(radius(cell) + (size - cell as f64) * (radius(cell + 1) - radius(cell))),
            misfit,
            method: Method::Profile,
        }
    }

    /// Two contacts that are not apart as one that is as wide as both.
    fn joined(&self, found: &Population) -> ContactPosition {
        let spreads = found.spreads();
        let force: f64 = spreads.iter().map(|one| one.mean.force).sum();
        let mean = |of: &dyn Fn(&Spread) -> f64| -> f64 {
            spreads
                .iter()
                .map(|one| one.mean.force / force * of(one))
                .sum()
        };
        let middle = [0, 1].map(|axis| mean(&|one| one.mean.at[axis]));
        let off = |one: &Spread, axis: usize| one.mean.at[axis] - middle[axis];
        let entries = [[0, 0], [0, 1], [1, 1]].into_iter().enumerate();
        let mut covariance = [0.0; 3];
        for (entry, [p, q]) in entries {
            covariance[entry] = mean(&|one| one.covariance[entry] + off(one, p) * off(one, q));
        }
        let mean = Shape {
            at: middle,
            size: mean(&|one| one.mean.size),
            force,
        };
        self.position(&Spread { mean, covariance }, found.misfit)
    }
}

/// Elements from which a further contact is looked for.
const SEEDS: usize = 6;
/// An element with less than this share of the highest force has no contact of
/// its own.
const OWN_CONTACT: f64 = 0.05;

/// True if two positions are no further apart along x and along y.
fn within(a: [f64; 2], b: [f64; 2], reach: f64) -> bool {
    (0..2).all(|axis| (a[axis] - b[axis]).abs() <= reach)
}

#[cfg(test)]
mod tests;
