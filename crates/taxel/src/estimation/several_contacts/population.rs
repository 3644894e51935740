//! Posterior sample of several contacts: a population of all that explain the forces, in
//! place of the best one with its slopes.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::super::localisation::holding_95;
use super::{Fitted, OWN, Scene, Shape};
use taxel_numerics::dense::{cholesky, solve_transposed};

/// Members of a population.
const MEMBERS: usize = 40;
/// Rounds before it is counted, and while it is.
const SETTLING: usize = 10;
const COUNTED: usize = 20;
/// One round in so many may jump from one best fit to another.
const JUMPS: usize = 5;
/// Unknowns of a contact whose force follows from the others.
const FREE: usize = 3;
/// Factor on the deviations: radii of the tables an eighth apart leave a misfit
/// of up to twice the noise on many elements, and few members miss what is
/// rare. The tests and `figures_of_merit` say how many contacts the ellipses
/// hold with it.
const WIDER: f64 = 1.3;
/// Smallest random step, in steps of the grid.
const JITTER: f64 = 0.05;

/// One of the contacts over a population: mean of position, in steps, size and
/// force; covariance of the positions xx, xy, yy.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    pub(super) mean: Shape,
    pub(super) covariance: [f64; 3],
}

/// Contacts in each member of a population, in the same order.
pub(super) struct Population {
    members: Vec<Vec<Shape>>,
    pub(super) misfit: f64,
}

impl Scene<'_> {
    /// The population of contacts as likely as the forces leave them: exp(−χ²/2)
    /// over all positions and sizes alike with the best forces, by differential
    /// evolution (ter Braak 2006) from the best fits, the first one best.
    pub(super) fn population(&self, fits: &[Fitted]) -> Option<Population> {
        let best = fits.first()?;
        let unknowns = OWN * best.shapes.len();
        let freedom = self.forces.len().saturating_sub(unknowns).max(1) as f64;
        let worse = (best.misfit / freedom).max(1.0);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut members = self.drawn(fits, worse, &mut random);
        let pace = 2.38 / ((2 * FREE * best.shapes.len()) as f64).sqrt();
        let mut counted = Vec::with_capacity(COUNTED * members.len());
        for round in 0..SETTLING + COUNTED {
            let pace = if round % JUMPS == 0 { 1.0 } else { pace };
            for one in 0..members.len() {
                let mut other = || random.random_range(0..members.len());
                let pair = [other(), other()];
                let moved = self.moved(&members, one, pair, pace, &mut random);
                let Some(moved) = moved else { continue };
                let gain = 0.5 * (members[one].misfit - moved.misfit) / worse;
                if gain >= 0.0 || random.random::<f64>() < gain.exp() {
                    members[one] = moved;
                }
            }
            if round >= SETTLING {
                counted.extend(members.iter().map(|one| alike(&one.shapes, &best.shapes)));
            }
        }
        (!counted.is_empty()).then_some(Population {
            members: counted,
            misfit: best.misfit,
        })
    }

    /// Members about the best fits, of each as many as it is likely.
    fn drawn(&self, fits: &[Fitted], worse: f64, random: &mut ChaCha8Rng) -> Vec<Fitted> {
        let modes: Vec<(&Fitted, Vec<Vec<f64>>, f64)> = fits
            .iter()
            .filter_map(|fit| {
                let factor = cholesky(self.linearised(&fit.shapes).matrix)?;
                let narrow: f64 = (0..factor.len()).map(|k| factor[k][k].ln()).sum();
                Some((fit, factor, -0.5 * fit.misfit / worse - narrow))
            })
            .collect();
        let most = modes.iter().map(|(.., weight)| *weight);
        let most = most.fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = modes.iter().map(|mode| (mode.2 - most).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let mut members = Vec::with_capacity(MEMBERS);
        for ((fit, factor, _), weight) in modes.iter().zip(&weights) {
            let count = (weight / sum * MEMBERS as f64).round() as usize;
            for _ in 0..count {
                let deviates = (0..factor.len())
                    .map(|_| worse.sqrt() * random.sample::<f64, _>(StandardNormal));
                let step = solve_transposed(factor, deviates.collect());
                let mut shapes = fit.shapes.clone();
                for (one, step) in shapes.iter_mut().zip(step.chunks(OWN)) {
                    *one = self.inside(one.at, one.size, step);
                }
                members.extend(self.with_forces(shapes));
            }
        }
        members
    }

    /// A contact moved by a step, kept on the array and among the sizes.
    fn inside(&self, at: [f64; 2], size: f64, step: &[f64]) -> Shape {
        let limits = self.limits();
        Shape {
            at: [0, 1].map(|axis| (at[axis] + step[axis]).clamp(0.0, limits[axis])),
            size: (size + step[2]).clamp(0.0, limits[2]),
            force: 0.0,
        }
    }

    /// A member moved by the difference of two others.
    fn moved(
        &self,
        members: &[Fitted],
        one: usize,
        pair: [usize; 2],
        pace: f64,
        random: &mut ChaCha8Rng,
    ) -> Option<Fitted> {
        let limits = self.limits();
        let [from, to] = pair.map(|index| &members[index].shapes);
        let mut shapes = members[one].shapes.clone();
        for (k, shape) in shapes.iter_mut().enumerate() {
            let mut step =
                |from: f64, to: f64| pace * (to - from) + random.random_range(-JITTER..JITTER);
            shape.at = [0, 1].map(|axis| shape.at[axis] + step(from[k].at[axis], to[k].at[axis]));
            shape.size += step(from[k].size, to[k].size);
            let on = |axis: usize| (0.0..=limits[axis]).contains(&shape.at[axis]);
            if !(on(0) && on(1) && (0.0..=limits[2]).contains(&shape.size)) {
                return None;
            }
        }
        self.with_forces(shapes)
    }

    /// The contacts with the forces that fit best; none where one would pull.
    fn with_forces(&self, mut shapes: Vec<Shape>) -> Option<Fitted> {
        let (forces, misfit) = self.best_forces(&shapes)?;
        for (one, force) in shapes.iter_mut().zip(forces) {
            one.force = force;
        }
        let press = shapes.iter().all(|one| one.force > 0.0);
        press.then_some(Fitted { shapes, misfit })
    }
}

/// The contacts in the order of those that they are nearest to.
fn alike(shapes: &[Shape], order: &[Shape]) -> Vec<Shape> {
    let mut shapes = shapes.to_vec();
    let far = |a: &Shape, b: &Shape| (a.at[0] - b.at[0]).powi(2) + (a.at[1] - b.at[1]).powi(2);
    for i in 0..shapes.len() {
        for j in 0..i {
            let straight = far(&shapes[i], &order[i]) + far(&shapes[j], &order[j]);
            let crossed = far(&shapes[i], &order[j]) + far(&shapes[j], &order[i]);
            if crossed < straight {
                shapes.swap(i, j);
            }
        }
    }
    shapes
}

impl Population {
    fn contacts(&self) -> usize {
        self.members[0].len()
    }

    fn mean(&self, of: impl Fn(&[Shape]) -> f64) -> f64 {
        let sum: f64 = self.members.iter().map(|one| of(one)).sum();
        sum / self.members.len() as f64
    }

    /// Each contact with its spread: at least as wide as its ellipse of 95 % must
    /// be to hold 95 % of the members, who may lie along a bend.
    pub(super) fn spreads(&self) -> Vec<Spread> {
        let spread = |k: usize| {
            let at = [0, 1].map(|axis| self.mean(|one| one[k].at[axis]));
            let product = |p: usize, q: usize| {
                self.mean(|one| (one[k].at[p] - at[p]) * (one[k].at[q] - at[q]))
            };
            let [xx, xy, yy] = [product(0, 0), product(0, 1), product(1, 1)];
            let off = |one: &Vec<Shape>| [0, 1].map(|axis| one[k].at[axis] - at[axis]);
            let members = self.members.iter().map(|one| (off(one), 1.0));
            let covariance = holding_95([xx, xy, yy], members);
            Spread {
                mean: Shape {
                    at,
                    size: self.mean(|one| one[k].size),
                    force: self.mean(|one| one[k].force),
                },
                covariance: covariance.map(|entry| WIDER * WIDER * entry),
            }
        };
        (0..self.contacts()).map(spread).collect()
    }

    /// Least distance of two contacts along the line between them, in its
    /// deviations.
    pub(super) fn apart(&self) -> f64 {
        let spreads = self.spreads();
        let pairs = (0..spreads.len()).flat_map(|i| (0..i).map(move |j| [j, i]));
        pairs.fold(f64::INFINITY, |least, [i, j]| {
            let apart = [0, 1].map(|axis| spreads[i].mean.at[axis] - spreads[j].mean.at[axis]);
            let along = |one: &[Shape]| {
                let along = |axis: usize| apart[axis] * (one[i].at[axis] - one[j].at[axis]);
                along(0) + along(1)
            };
            let middle = self.mean(along);
            let variance = self.mean(|one| (along(one) - middle).powi(2));
            least.min(middle / variance.sqrt())
        })
    }
}
