//! Several contacts below a soft cover, whose profiles overlap: as many as the
//! forces need, all fitted together.

mod matrix;
mod raster;

use matrix::{dot, factor, solve};

use super::localisation::{Located, Method, Place, Placing, flat_position};
use super::placing_fit::{NEAR, OFFSETS, ProfileFit, STEPS, WINDOW};

/// More contacts than this are not looked for.
const MOST: usize = 4;
/// Unknowns of a contact: place x, y, size, force.
const OWN: usize = 4;
/// One sound fit in ten thousand misfits more: normal deviate of that level.
const LEVEL: f64 = 3.72;
/// Another contact must lower χ² by so much: four unknowns do so by chance once
/// in ten thousand places, and there are some ten places to choose from.
const WORTH: f64 = 28.0;
/// Two contacts are apart by so many deviations of their distance, or one.
const APART: f64 = 4.0;
/// Steps between places, and between sizes, that are looked at first.
const COARSE: [usize; 2] = [8, 4];
/// Rounds in which the contacts make room for each other.
const ROUNDS: usize = 2;
/// Steps of the joint fit.
const ITERATIONS: usize = 15;

/// Contacts of all sizes on the elements, as far as the forces need them.
///
/// One is looked for first. As long as the misfit is more than the noise
/// allows, the contact that explains most of what is left comes beside those
/// before; each gives way to the others in turn, then places, sizes and forces
/// of all are fitted together. It stays if χ² falls by more than chance can do
/// and all contacts lie apart by four deviations; if not, two are one that is
/// as wide as both. In the end each is placed like a lone one by the forces
/// that the others leave, with what is not known of the others as noise.
pub(super) fn several(fit: &ProfileFit, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
    let Some((lone, _)) = fit.search(forces, deviations) else {
        return Vec::new();
    };
    let one = |place: Place| Located {
        place: place.is_known(fit.model.pitch).then_some(place),
        carried: forces.to_vec(),
    };
    let mut scene = Scene::new(fit, forces, deviations);
    if lone.misfit + scene.far() <= scene.allowed(1) {
        return vec![one(lone)];
    }
    scene.raster();
    let mut found = scene.one();
    while found.shapes.len() < MOST && found.misfit > scene.allowed(found.shapes.len()) {
        let more = scene.one_more(&found);
        if more.shapes.len() == found.shapes.len() || found.misfit - more.misfit < WORTH {
            break;
        }
        if scene.unresolved(&more) {
            if found.shapes.len() == 1 {
                return vec![one(scene.joined(&more))];
            }
            break;
        }
        found = more;
    }
    if found.shapes.len() < 2 {
        return vec![one(lone)];
    }
    scene.located(&found)
}

/// A contact: place in steps from the lower left element, index of the radius,
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
    felt: Vec<f64>,
    /// What is looked at first.
    raster: Vec<Trial>,
}

/// A place and size of the raster with its shares over the deviations.
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
            felt: forces.iter().zip(&roots).map(|(f, w)| f * w).collect(),
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
        let pairs = self.elements.iter().zip(&self.felt);
        pairs
            .filter(|(at, _)| !within(**at, top, (NEAR * STEPS) as f64))
            .map(|(_, felt)| felt * felt)
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

    /// Greatest steps of a place along an axis, and greatest index of a size.
    fn limits(&self) -> [f64; 3] {
        let model = &self.fit.model;
        let steps = |cells: usize| ((cells - 1) * STEPS) as f64;
        let sizes = self.tables.len() - 1;
        [steps(model.columns), steps(model.rows), sizes as f64]
    }

    /// Share of a contact on an element, with its slopes along x, y and size.
    fn share(&self, at: [f64; 2], size: f64, element: usize) -> [f64; 4] {
        let place = self.elements[element];
        let [dx, dy] = [0, 1].map(|axis| at[axis] - place[axis]);
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

    /// Shares on all elements over the deviations of the forces.
    fn weighed(&self, at: [f64; 2], size: f64) -> Vec<f64> {
        let roots = self.roots.iter().enumerate();
        roots
            .map(|(element, root)| root * self.share(at, size, element)[0])
            .collect()
    }

    /// What is left of the forces over their deviations.
    fn residuals(&self, shapes: &[Shape]) -> Vec<f64> {
        let felt = |element: usize| -> f64 {
            let shares = shapes.iter();
            shares
                .map(|one| one.force * self.share(one.at, one.size, element)[0])
                .sum()
        };
        let forces = self.forces.iter().zip(&self.roots).enumerate();
        forces
            .map(|(element, (force, root))| (force - felt(element)) * root)
            .collect()
    }

    fn misfit(&self, shapes: &[Shape]) -> f64 {
        self.residuals(shapes).iter().map(|left| left * left).sum()
    }

    /// Places, sizes and forces together, by Levenberg and Marquardt.
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
            let Some(factor) = factor(matrix) else { break };
            let step = solve(&factor, &slope);
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

    /// The forces that fit best at the places and sizes as they are.
    fn share_out(&self, shapes: &mut [Shape]) {
        let rows: Vec<Vec<f64>> = shapes
            .iter()
            .map(|one| self.weighed(one.at, one.size))
            .collect();
        let matrix = rows
            .iter()
            .map(|a| rows.iter().map(|b| dot(a, b)).collect())
            .collect();
        let right: Vec<f64> = rows.iter().map(|row| dot(row, &self.felt)).collect();
        let Some(factor) = factor(matrix) else { return };
        for (one, force) in shapes.iter_mut().zip(solve(&factor, &right)) {
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
        let place = 12.0 / (2.0 * WINDOW as f64).powi(2);
        let size = 12.0 / (self.tables.len() as f64).powi(2);
        for (k, one) in shapes.iter().enumerate() {
            let priors = [place, place, size, one.force.powi(-2)];
            for (own, prior) in priors.into_iter().enumerate() {
                matrix[OWN * k + own][OWN * k + own] += prior;
            }
        }
        (matrix, slope)
    }

    /// Covariance of all unknowns, wider where the fit is worse than the noise.
    fn covariance(&self, found: &Fitted) -> Option<Vec<Vec<f64>>> {
        let unknowns = OWN * found.shapes.len();
        let factor = factor(self.normal(&found.shapes).0)?;
        let freedom = self.forces.len().saturating_sub(unknowns).max(1) as f64;
        let worse = (found.misfit / freedom).max(1.0);
        let column = |k: usize| {
            let mut unit = vec![0.0; unknowns];
            unit[k] = worse;
            solve(&factor, &unit)
        };
        Some((0..unknowns).map(column).collect())
    }

    /// Whether two of the contacts may be one.
    fn unresolved(&self, found: &Fitted) -> bool {
        let Some(covariance) = self.covariance(found) else {
            return true;
        };
        let count = found.shapes.len();
        let mut pairs = (0..count).flat_map(|i| (0..i).map(move |j| [j, i]));
        pairs.any(|[i, j]| {
            let apart = [0, 1].map(|axis| found.shapes[i].at[axis] - found.shapes[j].at[axis]);
            let along = |a: usize, b: usize| -> f64 {
                let sum =
                    |p: usize, q: usize| covariance[OWN * a + p][OWN * b + q] * apart[p] * apart[q];
                (0..2).map(|p| sum(p, 0) + sum(p, 1)).sum()
            };
            let variance = along(i, i) + along(j, j) - along(i, j) - along(j, i);
            // Both over the squared distance.
            let square = apart[0] * apart[0] + apart[1] * apart[1];
            square * square <= APART * APART * variance
        })
    }

    /// All contacts, each with what it carries.
    fn located(&self, found: &Fitted) -> Vec<Located> {
        let Some(covariance) = self.covariance(found) else {
            return Vec::new();
        };
        let elements = 0..self.forces.len();
        let carried = |one: &Shape| -> Vec<f64> {
            let share = |element| one.force * self.share(one.at, one.size, element)[0];
            elements.clone().map(share).collect()
        };
        let parts: Vec<Vec<f64>> = found.shapes.iter().map(carried).collect();
        let others = |own: usize| {
            let others = (0..parts.len()).filter(move |other| *other != own);
            others.collect::<Vec<usize>>()
        };
        let located = |own: usize| {
            let others = others(own);
            let left = |element: usize| {
                let taken = others.iter().map(|other| parts[*other][element]);
                self.forces[element] - taken.sum::<f64>()
            };
            let noise = |element: usize| {
                let unknown = self.variance(found, &others, &covariance, element);
                unknown.sqrt().hypot(1.0 / self.roots[element])
            };
            let forces: Vec<f64> = elements.clone().map(left).collect();
            let deviations: Vec<f64> = elements.clone().map(noise).collect();
            Located {
                place: self.fit.place(&forces, &deviations),
                carried: parts[own].clone(),
            }
        };
        (0..parts.len()).map(located).collect()
    }

    /// Variance of what some contacts put on an element, N².
    fn variance(
        &self,
        found: &Fitted,
        contacts: &[usize],
        covariance: &[Vec<f64>],
        element: usize,
    ) -> f64 {
        let slopes = |&contact: &usize| {
            let one = &found.shapes[contact];
            let [share, x, y, size] = self.share(one.at, one.size, element);
            let slopes = [one.force * x, one.force * y, one.force * size, share];
            (0..OWN).map(move |own| (OWN * contact + own, slopes[own]))
        };
        let row: Vec<(usize, f64)> = contacts.iter().flat_map(slopes).collect();
        let pairs = row.iter().flat_map(|a| row.iter().map(move |b| (a, b)));
        let terms = pairs.map(|((i, a), (j, b))| covariance[*i][*j] * a * b);
        terms.sum::<f64>().max(0.0)
    }

    fn place(&self, found: &Fitted, one: &Shape, entry: impl Fn(usize, usize) -> f64) -> Place {
        let model = &self.fit.model;
        let corner = flat_position(model, (model.rows - 1) * model.columns);
        let step = model.pitch.map(|pitch| pitch / STEPS as f64);
        let cell = one.size as usize;
        let radius = |cell: usize| model.radii[cell.min(model.radii.len() - 1)];
        Place {
            centre: [0, 1].map(|axis| corner[axis] + one.at[axis] * step[axis]),
            covariance: [[0, 0], [0, 1], [1, 1]].map(|[p, q]| entry(p, q) * step[p] * step[q]),
            force: one.force,
            radius: Some(
                radius(cell) + (one.size - cell as f64) * (radius(cell + 1) - radius(cell)),
            ),
            misfit: found.misfit,
            method: Method::Profile,
        }
    }

    /// Two contacts that are not apart as one that is as wide as both.
    fn joined(&self, found: &Fitted) -> Place {
        let [one, other] = [0, 1].map(|place| found.shapes[place]);
        let part = one.force / (one.force + other.force);
        let middle = [0, 1].map(|axis| part * one.at[axis] + (1.0 - part) * other.at[axis]);
        let covariance = self.covariance(found);
        let entry = |p: usize, q: usize| {
            let spread = |weight: f64, shape: Shape, k: usize| {
                let own = covariance
                    .as_ref()
                    .map_or(f64::INFINITY, |c| c[OWN * k + p][OWN * k + q]);
                weight * (own + (shape.at[p] - middle[p]) * (shape.at[q] - middle[q]))
            };
            spread(part, one, 0) + spread(1.0 - part, other, 1)
        };
        let shape = Shape {
            at: middle,
            size: part * one.size + (1.0 - part) * other.size,
            force: one.force + other.force,
        };
        self.place(found, &shape, entry)
    }
}

/// Elements from which a further contact is looked for.
const SEEDS: usize = 6;
/// An element that feels less than this share of the highest force has no
/// contact of its own.
const FEELS: f64 = 0.05;

/// Whether two places are no further apart along x and along y.
fn within(a: [f64; 2], b: [f64; 2], reach: f64) -> bool {
    (0..2).all(|axis| (a[axis] - b[axis]).abs() <= reach)
}

#[cfg(test)]
mod tests;
