//! Position, size and force of one contact: the grid of all positions and sizes,
//! weighed by how well each explains the forces on the elements.

use rayon::prelude::*;
use taxel_ground::work::Parts;

use super::localisation::{ContactPosition, Method, ProfileModel, flat_position, holding_95, peak};

/// Position, size and force of a contact by least squares on the profile of the
/// soft cover, averaged by how well each position and size of a grid fits.
///
/// With σᵢ of noise and gain, shares sᵢ(x, y, a) and the best force F at each
/// position, χ² = Σ (Fᵢ − F sᵢ)²/σᵢ² and the weight is exp(−χ²/2). All positions over
/// the elements are as likely beforehand, and all radii and forces on a
/// logarithmic scale. Where the best misfit exceeds its degrees of freedom the
/// profile is not that of the model, and all misfits count less by that ratio.
#[derive(Debug, Clone)]
pub struct ProfileFit {
    pub(super) model: ProfileModel,
    tables: Tables,
    /// Standard deviation of the tables over the length of the forces.
    scatter: f64,
}

/// Forces of a contact of each size on the elements.
#[derive(Debug, Clone)]
enum Tables {
    /// The share at offsets of i, j steps along x and y: all elements are
    /// alike.
    Cover {
        shares: Vec<Vec<f64>>,
        /// Their logarithms.
        logs: Vec<Vec<f64>>,
    },
    /// The signals of all elements at each position, i, j steps from the lower
    /// left element, as presses taught them.
    Learned(Vec<Vec<f64>>),
}

/// Steps of the grid from one element to the next.
pub(super) const STEPS: usize = 32;
/// Elements up to so many rows or columns from the highest one are used.
pub(super) const NEAR: usize = 3;
/// Steps from the highest element within which the contact is looked for.
pub(super) const WINDOW: usize = 32;
/// Offsets of a table along one axis.
pub(super) const OFFSETS: usize = NEAR * STEPS + WINDOW + 1;

/// No share counts as less: its logarithm must be finite.
const LEAST_SHARE: f64 = 1e-12;

/// Steps between positions that are looked at first.
const COARSE: usize = 4;
/// Weight below which the surroundings of a position are not looked at.
const NEGLIGIBLE: f64 = 1e-9;

/// With so many equal weights mean and spread are known without the finer grid ...
const BROAD: f64 = 60.0;
/// ... and with so many, positions below this weight are unlikely.
const SEVERAL: f64 = 8.0;
const UNLIKELY: f64 = 1e-4;

/// With fewer equal weights on the finer grid the position is known better than its steps.
const NARROW: f64 = 5.0;
/// Positions of each radius from which a finer search starts, and steps between them.
const STARTS: usize = 3;
const APART: usize = 8;

/// One position and size of the grid.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    /// From the highest element.
    steps: [isize; 2],
    /// Index of the radius.
    radius: usize,
    force: f64,
    /// By how much it lowers the misfit.
    gain: f64,
}

/// The elements near the highest one.
struct View {
    /// Steps of the highest element from the lower left one.
    origin: [isize; 2],
    readings: Vec<Reading>,
}

/// An element near the highest one: offset from it in steps, force, weight.
#[derive(Debug, Clone, Copy)]
struct Reading {
    element: usize,
    offset: [isize; 2],
    force: f64,
    weight: f64,
}

impl ProfileFit {
    /// Prepares the tables of all radii: some tenths of a second of work.
    ///
    /// `None` for fewer than three elements or no radius.
    pub fn new(model: ProfileModel) -> Option<Self> {
        if model.rows * model.columns < 3 || model.radii.is_empty() {
            return None;
        }
        let parts = Parts::new("profiles of the cover", model.radii.len() as u64);
        let of_radius = |radius: &f64| {
            let table = table(&model, *radius);
            parts.done(1);
            table
        };
        let shares: Vec<Vec<f64>> = model.radii.par_iter().map(of_radius).collect();
        let log = |share: &f64| share.max(LEAST_SHARE).ln();
        let logs = shares.iter().map(|one| one.iter().map(log).collect());
        Some(Self {
            model,
            tables: Tables::Cover {
                logs: logs.collect(),
                shares,
            },
            scatter: 0.0,
        })
    }

    /// For the signals that presses of the radii of `model` taught: of each
    /// radius those of all elements at the positions of [`grid`], with their
    /// deviation over the length of such a row.
    pub(super) fn learned(model: ProfileModel, signals: Vec<Vec<f64>>, scatter: f64) -> Self {
        Self {
            model,
            tables: Tables::Learned(signals),
            scatter,
        }
    }

    /// The share at offsets of i, j steps for each radius; none of learned
    /// signals.
    pub(super) fn shares(&self) -> &[Vec<f64>] {
        match &self.tables {
            Tables::Cover { shares, .. } => shares,
            Tables::Learned(_) => &[],
        }
    }

    /// Their logarithms.
    pub(super) fn logs(&self) -> &[Vec<f64>] {
        match &self.tables {
            Tables::Cover { logs, .. } => logs,
            Tables::Learned(_) => &[],
        }
    }

    /// The same for elements whose gains are known to `gain_deviation`.
    #[must_use]
    pub fn with_gain_deviation(mut self, gain_deviation: f64) -> Self {
        self.model.gain_deviation = gain_deviation;
        self
    }

    /// Model of the elements and the cover.
    pub fn model(&self) -> &ProfileModel {
        &self.model
    }

    fn view(&self, top: usize, forces: &[f64], deviations: &[f64]) -> View {
        let columns = self.model.columns;
        let (row, column) = (top / columns, top % columns);
        let gain = self.model.gain_deviation;
        let own = self.scatter.powi(2) * forces.iter().map(|force| force * force).sum::<f64>();
        let cell = |index: usize| [index % columns, index / columns];
        let readings = (0..forces.len())
            .filter(|index| {
                let [c, r] = cell(*index);
                c.abs_diff(column) <= NEAR && r.abs_diff(row) <= NEAR
            })
            .map(|index| {
                let [c, r] = cell(index);
                let apart = |to: usize, from: usize| {
                    STEPS.cast_signed() * (to.cast_signed() - from.cast_signed())
                };
                let noise = deviations[index].powi(2) + (gain * forces[index]).powi(2);
                Reading {
                    element: index,
                    // Rows count downwards, y upwards.
                    offset: [apart(c, column), apart(row, r)],
                    force: forces[index],
                    weight: 1.0 / (noise + own),
                }
            })
            .collect();
        let up = self.model.rows - 1 - row;
        View {
            origin: [column, up].map(|cells| (cells * STEPS).cast_signed()),
            readings,
        }
    }

    /// Positions over the elements, every [`COARSE`] steps, with all radii.
    fn survey(&self, top: usize, view: &View) -> Vec<Candidate> {
        let [along_x, along_y] = self.reach(top);
        let mut found = Vec::new();
        for radius in 0..self.model.radii.len() {
            for i in along_x.clone().step_by(COARSE) {
                let row = along_y.clone().step_by(COARSE);
                found.extend(row.filter_map(|j| self.candidate(radius, [i, j], view)));
            }
        }
        found
    }

    /// All positions in the tile round a surveyed one, of the same radius.
    fn tile(&self, top: usize, about: &Candidate, view: &View) -> Vec<Candidate> {
        let [along_x, along_y] = self.reach(top);
        let half = COARSE.cast_signed() / 2;
        let around = move |at: isize| at - half..at - half + COARSE.cast_signed();
        let [x, y] = about.steps;
        around(x)
            .filter(|i| along_x.contains(i))
            .flat_map(|i| around(y).map(move |j| [i, j]))
            .filter(|steps| along_y.contains(&steps[1]))
            .filter_map(|steps| self.candidate(about.radius, steps, view))
            .collect()
    }

    /// Steps from the highest element within which a contact may be.
    fn reach(&self, top: usize) -> [std::ops::RangeInclusive<isize>; 2] {
        let model = &self.model;
        let (row, column) = (top / model.columns, top % model.columns);
        let margin = (model.margin.clamp(0.0, 0.5) * STEPS as f64) as usize;
        [
            within(column, model.columns - 1 - column, margin),
            within(model.rows - 1 - row, row, margin),
        ]
    }

    /// The best force at one position and radius, with its misfit less that of no
    /// force; `None` where it would pull.
    fn candidate<'a>(&'a self, radius: usize, steps: [isize; 2], view: &View) -> Option<Candidate> {
        let (mut cross, mut square) = (0.0, 0.0);
        let offset = |one: &Reading, axis: usize| one.offset[axis].abs_diff(steps[axis]);
        let learned = |signals: &'a [f64]| {
            let [x, y] = [0, 1].map(|axis| (view.origin[axis] + steps[axis]).cast_unsigned());
            let rows = (self.model.rows - 1) * STEPS + 1;
            let elements = self.model.rows * self.model.columns;
            &signals[(x * rows + y) * elements..][..elements]
        };
        let row = match &self.tables {
            Tables::Cover { .. } => &[],
            Tables::Learned(signals) => learned(&signals[radius]),
        };
        for one in &view.readings {
            let share = match &self.tables {
                Tables::Cover { shares, .. } => {
                    shares[radius][offset(one, 0) * OFFSETS + offset(one, 1)]
                }
                Tables::Learned(_) => row[one.element],
            };
            cross += share * one.force * one.weight;
            square += share * share * one.weight;
        }
        (cross > 0.0).then(|| Candidate {
            steps,
            radius,
            force: cross / square,
            gain: cross * cross / square,
        })
    }
}

/// The largest gain among candidates.
fn best(candidates: &[Candidate]) -> f64 {
    candidates.iter().map(|one| one.gain).fold(0.0, f64::max)
}

/// What the grid says of a contact.
pub(super) struct Searched {
    pub(super) position: ContactPosition,
    /// Unknown less than the elements that were used.
    pub(super) freedom: f64,
    /// Where the grid is too coarse for how well the position is known: positions from which a
    /// finer search starts, in steps from the lower left element, with the index of the radius.
    pub(super) narrow: Vec<([f64; 2], usize)>,
}

impl ProfileFit {
    /// The position with its misfit over the degrees of freedom; the position is
    /// given however badly it is known.
    pub(super) fn search(
        &self,
        forces: &[f64],
        deviations: &[f64],
    ) -> Option<(ContactPosition, f64)> {
        let found = self.searched(forces, deviations)?;
        Some((found.position, found.position.misfit / found.freedom))
    }

    /// The same with what a finer search needs.
    pub(super) fn searched(&self, forces: &[f64], deviations: &[f64]) -> Option<Searched> {
        let elements = self.model.rows * self.model.columns;
        if forces.len() != elements || deviations.len() != elements {
            return None;
        }
        let top = peak(forces, deviations)?;
        let view = self.view(top, forces, deviations);
        let silent: f64 = view
            .readings
            .iter()
            .map(|one| one.force * one.force * one.weight)
            .sum();
        // Position, size and force are four unknowns.
        let freedom = view.readings.len().saturating_sub(4).max(1) as f64;
        let surveyed = self.survey(top, &view);
        let temper = |gain: f64| ((silent - gain) / freedom).max(1.0);
        let weight = |one: &Candidate, best: f64| (0.5 * (one.gain - best) / temper(best)).exp();
        let most = best(&surveyed);
        let weights = || surveyed.iter().map(|one| weight(one, most));
        let squares: f64 = weights().map(|weight| weight * weight).sum();
        let alike = weights().sum::<f64>().powi(2) / squares;
        let broad = alike > BROAD;
        // Where one position stands out, its neighbours on the coarse grid may
        // miss a better one.
        let least = if alike > SEVERAL {
            UNLIKELY
        } else {
            NEGLIGIBLE
        };
        let likely = surveyed.iter().filter(|one| weight(one, most) > least);
        let (candidates, steps): (Vec<Candidate>, usize) = if broad {
            (likely.copied().collect(), STEPS / COARSE)
        } else {
            let fine = likely.flat_map(|one| self.tile(top, one, &view));
            (fine.collect(), STEPS)
        };
        let most = best(&candidates);
        let middle = flat_position(&self.model, top);
        let at = |one: &Candidate, axis: usize| {
            middle[axis] + one.steps[axis] as f64 * self.model.pitch[axis] / STEPS as f64
        };
        // Weight, then the sums of x, y, force, radius, xx, xy, yy.
        let mut sums = [0.0; 8];
        for one in &candidates {
            let weight = weight(one, most);
            let (x, y, radius) = (at(one, 0), at(one, 1), self.model.radii[one.radius]);
            let terms = [1.0, x, y, one.force, radius, x * x, x * y, y * y];
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum += weight * term;
            }
        }
        let [_, x, y, force, radius, xx, xy, yy] = sums.map(|sum| sum / sums[0]);
        // The true position is between the steps of the grid.
        let step = self
            .model
            .pitch
            .map(|pitch| (pitch / steps as f64).powi(2) / 12.0);
        let covariance = [xx - x * x + step[0], xy - x * y, yy - y * y + step[1]];
        let possible = candidates
            .iter()
            .map(|one| ([at(one, 0) - x, at(one, 1) - y], weight(one, most)));
        let position = ContactPosition {
            centre: [x, y],
            covariance: holding_95(covariance, possible),
            force,
            radius: Some(radius),
            misfit: silent - most,
            method: Method::Profile,
        };
        let sum: f64 = candidates.iter().map(|one| weight(one, most)).sum();
        let squares = candidates.iter().map(|one| weight(one, most).powi(2));
        let fine = broad || sum * sum / squares.sum::<f64>() > NARROW;
        let narrow = if fine || self.shares().is_empty() {
            Vec::new()
        } else {
            starts(&surveyed, view.origin)
        };
        Some(Searched {
            position,
            freedom,
            narrow,
        })
    }
}

/// Surveyed positions of each radius, the best and others apart from it, in steps from the
/// lower left element: a position that is known better than the steps of a survey may
/// look unlikely in it.
fn starts(surveyed: &[Candidate], origin: [isize; 2]) -> Vec<([f64; 2], usize)> {
    let mut found: Vec<&Candidate> = Vec::new();
    for of in surveyed.chunk_by(|a, b| a.radius == b.radius) {
        let first = found.len();
        for _ in 0..STARTS {
            let apart = |one: &&Candidate| {
                found[first..].iter().all(|other| {
                    let off = |axis: usize| one.steps[axis].abs_diff(other.steps[axis]);
                    off(0).max(off(1)) > APART
                })
            };
            let best = of.iter().filter(apart);
            found.extend(best.max_by(|a, b| a.gain.total_cmp(&b.gain)));
        }
    }
    let at = |one: &Candidate| {
        let steps = [0, 1].map(|axis| (origin[axis] + one.steps[axis]) as f64);
        (steps, one.radius)
    };
    found.into_iter().map(at).collect()
}

/// Steps from an element with so many elements before and behind it.
fn within(before: usize, behind: usize, margin: usize) -> std::ops::RangeInclusive<isize> {
    let reach = |elements: usize| (elements * STEPS + margin).min(WINDOW).cast_signed();
    -reach(before)..=reach(behind)
}

/// Shares of a contact of this radius on an element at each offset.
fn table(model: &ProfileModel, radius: f64) -> Vec<f64> {
    let table = model.cover(radius).table();
    let [x, y] = model.pitch.map(|pitch| pitch / STEPS as f64);
    let share = |i: usize, j: usize| table.share([i as f64 * x, j as f64 * y], model.side);
    let mut shares = vec![0.0; OFFSETS * OFFSETS];
    // Elements are square: equal spacings leave half of the work.
    let alike = x == y;
    for i in 0..OFFSETS {
        for j in 0..OFFSETS {
            shares[i * OFFSETS + j] = if alike && j < i {
                shares[j * OFFSETS + i]
            } else {
                share(i, j)
            };
        }
    }
    shares
}

/// All positions over the elements that learned signals are given for, m: x by x
/// from the lower left element.
pub(super) fn grid(model: &ProfileModel) -> impl Iterator<Item = [f64; 2]> {
    let axis = |cells: usize, pitch: f64| {
        let middle = 0.5 * (cells as f64 - 1.0);
        let steps = 0..=(cells - 1) * STEPS;
        steps.map(move |step| (step as f64 / STEPS as f64 - middle) * pitch)
    };
    let ys = axis(model.rows, model.pitch[1]);
    axis(model.columns, model.pitch[0]).flat_map(move |x| ys.clone().map(move |y| [x, y]))
}
