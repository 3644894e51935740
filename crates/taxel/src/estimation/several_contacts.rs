//! Several contacts below a soft cover, whose profiles overlap: as many as the
//! forces need, all fitted together.

mod lone;
mod population;
mod raster;

use population::{Population, Spread};
use taxel_numerics::dense::{cholesky, cholesky_solve, dot};

use super::localisation::{ContactPosition, Localiser, Located, Method, flat_position};
use super::position_fit::{NEAR, OFFSETS, ProfileFit, STEPS, WINDOW};

/// More contacts than this are not looked for.
const MOST: usize = 4;
/// Unknowns of a contact: position x, y, size, force.
const OWN: usize = 4;
/// One sound fit in ten thousand misfits more: normal deviate of that level.
const LEVEL: f64 = 3.72;
/// Another contact must lower χ² by so much: four unknowns do so by chance once
/// in ten thousand positions, and there are some ten positions to choose from.
const WORTH: f64 = 28.0;
/// Two contacts are apart by so many deviations of their distance, or one.
const APART: f64 = 4.0;
/// Steps between positions, and between sizes, that are looked at first.
const COARSE: [usize; 2] = [8, 4];
/// Rounds in which the contacts make room for each other.
const ROUNDS: usize = 2;
/// Steps of the joint fit.
const ITERATIONS: usize = 15;

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
/// One is looked for first. As long as the misfit is more than the noise
/// allows, the contact that explains most of what is left comes beside those
/// before; each gives way to the others in turn, then positions, sizes and forces
/// of all are fitted together. The population of all that explain the forces
/// begins at these fits and at those of other sizes. The contact stays if χ²
/// falls by more than chance can do and all contacts of the population lie
/// apart by four deviations; if not, two are one that is as wide as both.
/// Positions and covariances are those of the population.
pub(super) fn several(fit: &ProfileFit, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
    let mut scene = Scene::new(fit, forces, deviations);
    let Some(lone) = scene.lone(deviations) else {
        return Vec::new();
    };
    let one = |position: ContactPosition| Located {
        position: position.is_known(fit.model.pitch).then_some(position),
        carried: forces.to_vec(),
    };
    if lone.misfit + scene.far() <= scene.allowed(1) {
        return vec![one(lone)];
    }
    scene.raster();
    let (mut fitted, mut found) = (scene.one(), None);
    while fitted.shapes.len() < MOST && fitted.misfit > scene.allowed(fitted.shapes.len()) {
        let fits = scene.one_more(&fitted);
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
    found.map_or_else(|| vec![one(lone)], |found| scene.located(&found))
}

/// A contact: position in steps from the lower left element, index of the radius,
/// which may be between two, and force, N.
#[derive(Debug, Clone, Copy)]
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
    /// Candidates that are tried first.
    raster: Vec<Trial>,
}

/// A position and size of the raster with its shares over the deviations.
struct Trial {
    shape: Shape,
    row: Vec<f64>,
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
            raster: Vec::new(),
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

    /// Share of a contact on an element, with its slopes along x, y and size.
    fn share(&self, at: [f64; 2], size: f64, element: usize) -> [f64; 4] {
        let position = self.elements[element];
        let [dx, dy] = [0, 1].map(|axis| at[axis] - position[axis]);
        let cut = |value: f64, last: usize| {
            let cell = (value as usize).min(last - 1);
            (cell, value - cell as f64)
        };
        let last = OFFSETS - 1;
        if dx.abs() > last as f64 || dy.abs() > last as f64 {
            return [0.0; 4];
        }
        let ((i, u), (j, v)) = (cut(dx.abs(), last), cut(dy.abs(), last));
        let plane = |size: usize| {
            let at = |i: usize, j: usize| self.tables[size][i * OFFSETS + j];
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
            let [low, high] = [a + u * (b - a), c + u * (d - c)];
            let along_x = (1.0 - v) * (b - a) + v * (d - c);
            [low + v * (high - low), along_x, high - low]
        };
        let sizes = self.tables.len();
        let (near, far, w) = if sizes == 1 {
            (plane(0), plane(0), 0.0)
        } else {
            let (cell, w) = cut(size, sizes - 1);
            (plane(cell), plane(cell + 1), w)
        };
        let [share, x, y] = [0, 1, 2].map(|k| near[k] + w * (far[k] - near[k]));
        [share, x * dx.signum(), y * dy.signum(), far[0] - near[0]]
    }

    /// Shares on all elements over the deviations of the forces: as
    /// [`Self::share`], without slopes, for the many members of a population.
    fn weighed(&self, at: [f64; 2], size: f64) -> Vec<f64> {
        let last = self.tables.len() - 1;
        let cell = (size as usize).min(last.saturating_sub(1));
        let (near, far) = (&self.tables[cell], &self.tables[(cell + 1).min(last)]);
        let part = size - cell as f64;
        let weigh = |(position, root): (&[f64; 2], &f64)| {
            let [x, y] = [0, 1].map(|axis| (at[axis] - position[axis]).abs());
            let (i, j) = (x as usize, y as usize);
            if i + 1 >= OFFSETS || j + 1 >= OFFSETS {
                return 0.0;
            }
            let (u, v) = (x - i as f64, y - j as f64);
            let blend = |table: &[f64]| {
                let first = &table[i * OFFSETS + j..][..2];
                let second = &table[(i + 1) * OFFSETS + j..][..2];
                let [low, high] = [0, 1].map(|k| first[k] + u * (second[k] - first[k]));
                low + v * (high - low)
            };
            let [near, far] = [near, far].map(|table| blend(table));
            root * (near + part * (far - near))
        };
        self.elements.iter().zip(&self.roots).map(weigh).collect()
    }

    /// Residuals of the forces over their deviations.
    fn residuals(&self, shapes: &[Shape]) -> Vec<f64> {
        let predicted = |element: usize| -> f64 {
            let shares = shapes.iter();
            shares
                .map(|one| one.force * self.share(one.at, one.size, element)[0])
                .sum()
        };
        let forces = self.forces.iter().zip(&self.roots).enumerate();
        forces
            .map(|(element, (force, root))| (force - predicted(element)) * root)
            .collect()
    }

    fn misfit(&self, shapes: &[Shape]) -> f64 {
        self.residuals(shapes).iter().map(|left| left * left).sum()
    }

    /// Positions, sizes and forces together, by Levenberg and Marquardt.
    fn refined(&self, mut shapes: Vec<Shape>) -> Fitted {
        self.share_out(&mut shapes);
        let limits = self.limits();
        let mut misfit = self.misfit(&shapes);
        let mut damping = 1e-2;
        for _ in 0..ITERATIONS {
            let (mut matrix, slope) = self.normal(&shapes);
            for (k, row) in matrix.iter_mut().enumerate() {
                row[k] *= 1.0 + damping;
            }
            let Some(factor) = cholesky(matrix) else {
                break;
            };
            let step = cholesky_solve(&factor, &slope);
            let moved: Vec<Shape> = shapes
                .iter()
                .zip(step.chunks(OWN))
                .map(|(one, step)| Shape {
                    at: [0, 1].map(|axis| (one.at[axis] + step[axis]).clamp(0.0, limits[axis])),
                    size: (one.size + step[2]).clamp(0.0, limits[2]),
                    force: (one.force + step[3]).max(0.1 * one.force),
                })
                .collect();
            let next = self.misfit(&moved);
            if next < misfit {
                let done = misfit - next < 1e-3;
                (shapes, misfit, damping) = (moved, next, 0.2 * damping);
                if done {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        Fitted { shapes, misfit }
    }

    /// The forces that fit best at the positions and sizes as they are.
    fn share_out(&self, shapes: &mut [Shape]) {
        let rows: Vec<Vec<f64>> = shapes
            .iter()
            .map(|one| self.weighed(one.at, one.size))
            .collect();
        let matrix = rows
            .iter()
            .map(|a| rows.iter().map(|b| dot(a, b)).collect())
            .collect();
        let right: Vec<f64> = rows.iter().map(|row| dot(row, &self.weighted)).collect();
        let Some(factor) = cholesky(matrix) else {
            return;
        };
        for (one, force) in shapes.iter_mut().zip(cholesky_solve(&factor, &right)) {
            if force > 0.0 {
                one.force = force;
            }
        }
    }

    /// Fisher matrix of all unknowns with what is known of them beforehand, and
    /// the slope of half the misfit downwards.
    fn normal(&self, shapes: &[Shape]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let unknowns = OWN * shapes.len();
        let (mut matrix, mut slope) = (vec![vec![0.0; unknowns]; unknowns], vec![0.0; unknowns]);
        let mut row = vec![0.0; unknowns];
        for (element, root) in self.roots.iter().enumerate() {
            let mut left = self.forces[element];
            for (one, row) in shapes.iter().zip(row.chunks_mut(OWN)) {
                let [share, x, y, size] = self.share(one.at, one.size, element);
                left -= one.force * share;
                let slopes = [one.force * x, one.force * y, one.force * size, share];
                row.copy_from_slice(&slopes.map(|slope| slope * root));
            }
            for i in 0..unknowns {
                slope[i] += row[i] * left * root;
                for j in 0..unknowns {
                    matrix[i][j] += row[i] * row[j];
                }
            }
        }
        // Anywhere within the window, of any of the sizes: variances of even
        // distributions.
        let along_axis = 12.0 / (2.0 * WINDOW as f64).powi(2);
        let size = 12.0 / (self.tables.len() as f64).powi(2);
        for (k, one) in shapes.iter().enumerate() {
            let priors = [along_axis, along_axis, size, one.force.powi(-2)];
            for (own, prior) in priors.into_iter().enumerate() {
                matrix[OWN * k + own][OWN * k + own] += prior;
            }
        }
        (matrix, slope)
    }

    /// All contacts, each with what it carries.
    fn located(&self, found: &Population) -> Vec<Located> {
        let located = |spread: &Spread| {
            let Shape { at, size, force } = spread.mean;
            let carried =
                (0..self.forces.len()).map(|element| force * self.share(at, size, element)[0]);
            let position = self.position(spread, found.misfit);
            Located {
                position: position.is_known(self.fit.model.pitch).then_some(position),
                carried: carried.collect(),
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
