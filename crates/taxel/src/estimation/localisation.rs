//! Where a round contact presses a soft cover, from the profile of the elements
//! below it.

use rayon::prelude::*;

use crate::mechanics::{Base, Contact, SoftCover};

/// What finds the place of one contact from the forces on all elements.
///
/// The profile that a press of known size gives ([`ProfileFit`]) needs no
/// calibration; a map that was trained with the device may take its place. The
/// centre of force ([`Centroid`]) is the baseline both are measured against.
pub trait Placing: std::fmt::Debug + Send + Sync {
    /// The place for the forces on the elements with their standard
    /// deviations, N. `None` where they hold no information on it.
    fn place(&self, forces: &[f64], deviations: &[f64]) -> Option<Place>;
}

/// Where a contact is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Centre on the developed surface, m.
    pub centre: [f64; 2],
    /// Its covariance xx, xy, yy, m².
    pub covariance: [f64; 3],
    /// Total force, N; of the centre of force, what the elements carry.
    pub force: f64,
    /// Radius of the contact, m, where the method knows it.
    pub radius: Option<f64>,
    /// Sum of the squared misfits over their variances; `NaN` without a model.
    pub misfit: f64,
    /// How it was found.
    pub method: Method,
}

/// How a place was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Centre of the forces on the elements.
    Centroid,
    /// Least squares on the profile of the soft cover, the radius among the
    /// stated ones.
    Profile,
    /// A map trained with presses on the device.
    Trained,
}

/// A profile whose highest force is below this many standard deviations tells
/// nothing.
const LEAST_PEAK: f64 = 6.0;

/// Centre of the forces on the elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Centroid {
    /// Centre of each element, m.
    pub positions: Vec<[f64; 2]>,
    /// Spacing of the elements x, y, m; a contact in a cell may be anywhere in
    /// it.
    pub pitch: [f64; 2],
}

impl Placing for Centroid {
    fn place(&self, forces: &[f64], deviations: &[f64]) -> Option<Place> {
        peak(forces, deviations)?;
        let readings = || self.positions.iter().zip(forces).zip(deviations);
        let pressing = || readings().filter(|((_, force), _)| **force > 0.0);
        let total: f64 = pressing().map(|((_, force), _)| force).sum();
        let mean = |axis: usize| -> f64 {
            pressing()
                .map(|((at, force), _)| at[axis] * force)
                .sum::<f64>()
                / total
        };
        let centre = [mean(0), mean(1)];
        let mut covariance = [
            self.pitch[0].powi(2) / 12.0,
            0.0,
            self.pitch[1].powi(2) / 12.0,
        ];
        for ((at, _), deviation) in pressing() {
            let [x, y] = [at[0] - centre[0], at[1] - centre[1]];
            let variance = (deviation / total).powi(2);
            for (sum, factor) in covariance.iter_mut().zip([x * x, x * y, y * y]) {
                *sum += variance * factor;
            }
        }
        Some(Place {
            centre,
            covariance,
            force: total,
            radius: None,
            misfit: f64::NAN,
            method: Method::Centroid,
        })
    }
}

/// Index of the highest force, if it is significant.
pub(super) fn peak(forces: &[f64], deviations: &[f64]) -> Option<usize> {
    let all_known = forces
        .iter()
        .chain(deviations)
        .all(|value| value.is_finite());
    let (index, force) = forces
        .iter()
        .enumerate()
        .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (all_known && *force > LEAST_PEAK * deviations[index]).then_some(index)
}

/// A grid of elements below a soft cover and the sizes a contact may have.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileModel {
    /// Rows of elements; row 0 is at +y.
    pub rows: usize,
    /// Columns of elements; column 0 is at -x.
    pub columns: usize,
    /// Spacing of the elements x, y, m.
    pub pitch: [f64; 2],
    /// Side of an element, m.
    pub side: f64,
    /// Thickness of the cover over the elements, m.
    pub thickness: f64,
    /// Radii that the contact may have, m: one when it is known.
    pub radii: Vec<f64>,
    /// Standard deviation of the gains of the elements against each other.
    pub gain_deviation: f64,
    /// How far beyond the centres of the outer elements a contact may be, as a
    /// share of the pitch, at most a half. Out there one element feels it
    /// alone, and its place is hardly known.
    pub margin: f64,
}

impl ProfileModel {
    /// The cover below a round contact of this radius, m.
    pub(crate) fn cover(&self, radius: f64) -> SoftCover {
        SoftCover {
            thickness: self.thickness,
            base: Base::Rigid,
            contact: Contact::Hertz(radius),
        }
    }

    /// The centre of force on the same elements.
    pub fn centroid(&self) -> Centroid {
        let elements = 0..self.rows * self.columns;
        Centroid {
            positions: elements.map(|index| flat_position(self, index)).collect(),
            pitch: self.pitch,
        }
    }

    /// Radii from half the thickness of the cover to `largest`, each an
    /// eighth larger than the last: for a contact of unknown size.
    pub fn unknown_radii(thickness: f64, largest: f64) -> Vec<f64> {
        std::iter::successors(Some(0.5 * thickness), |radius| Some(1.12 * radius))
            .take_while(|radius| *radius <= largest)
            .collect()
    }
}

/// Place, size and force of a contact by least squares on the profile of the
/// soft cover, averaged by how well each place and size of a grid fits.
///
/// With σᵢ of noise and gain, shares sᵢ(x, y, a) and the best force F at each
/// place, χ² = Σ (Fᵢ − F sᵢ)²/σᵢ² and the weight is exp(−χ²/2). All places over
/// the elements are as likely beforehand, and all radii and forces on a
/// logarithmic scale. Where the best misfit exceeds its degrees of freedom the
/// profile is not that of the model, and all misfits count less by that ratio.
#[derive(Debug, Clone)]
pub struct ProfileFit {
    model: ProfileModel,
    /// For each radius the share at offsets of i, j steps along x and y.
    shares: Vec<Vec<f64>>,
}

/// Steps of the grid from one element to the next.
const STEPS: usize = 32;
/// Elements up to so many rows or columns from the highest one are used.
const NEAR: usize = 3;
/// Steps from the highest element within which the contact is looked for.
const WINDOW: usize = 32;
/// Offsets of a table along one axis.
const OFFSETS: usize = NEAR * STEPS + WINDOW + 1;

/// Steps between places that are looked at first.
const COARSE: usize = 4;
/// Weight below which the surroundings of a place are not looked at.
const NEGLIGIBLE: f64 = 1e-9;

/// One place and size of the grid.
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

/// An element near the highest one: offset from it in steps, force, weight.
#[derive(Debug, Clone, Copy)]
struct Reading {
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
        let shares = model.radii.par_iter().map(|a| table(&model, *a)).collect();
        Some(Self { model, shares })
    }

    /// The same for elements whose gains are known to `gain_deviation`.
    #[must_use]
    pub fn with_gain_deviation(mut self, gain_deviation: f64) -> Self {
        self.model.gain_deviation = gain_deviation;
        self
    }

    /// What it was made for.
    pub fn model(&self) -> &ProfileModel {
        &self.model
    }

    fn readings(&self, top: usize, forces: &[f64], deviations: &[f64]) -> Vec<Reading> {
        let columns = self.model.columns;
        let (row, column) = (top / columns, top % columns);
        let gain = self.model.gain_deviation;
        let place = |index: usize| [index % columns, index / columns];
        (0..forces.len())
            .filter(|index| {
                let [c, r] = place(*index);
                c.abs_diff(column) <= NEAR && r.abs_diff(row) <= NEAR
            })
            .map(|index| {
                let [c, r] = place(index);
                let apart = |to: usize, from: usize| {
                    STEPS.cast_signed() * (to.cast_signed() - from.cast_signed())
                };
                Reading {
                    // Rows count downwards, y upwards.
                    offset: [apart(c, column), apart(row, r)],
                    force: forces[index],
                    weight: 1.0 / (deviations[index].powi(2) + (gain * forces[index]).powi(2)),
                }
            })
            .collect()
    }

    /// Places over the elements, every [`COARSE`] steps, with all radii.
    fn survey(&self, top: usize, readings: &[Reading]) -> Vec<Candidate> {
        let [along_x, along_y] = self.reach(top);
        let mut found = Vec::new();
        for radius in 0..self.shares.len() {
            for i in along_x.clone().step_by(COARSE) {
                let row = along_y.clone().step_by(COARSE);
                found.extend(row.filter_map(|j| self.candidate(radius, [i, j], readings)));
            }
        }
        found
    }

    /// All places in the tile round a surveyed one, of the same radius.
    fn tile(&self, top: usize, about: &Candidate, readings: &[Reading]) -> Vec<Candidate> {
        let [along_x, along_y] = self.reach(top);
        let half = COARSE.cast_signed() / 2;
        let around = move |at: isize| at - half..at - half + COARSE.cast_signed();
        let [x, y] = about.steps;
        around(x)
            .filter(|i| along_x.contains(i))
            .flat_map(|i| around(y).map(move |j| [i, j]))
            .filter(|steps| along_y.contains(&steps[1]))
            .filter_map(|steps| self.candidate(about.radius, steps, readings))
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

    /// The best force at one place and radius, with its misfit less that of no
    /// force; `None` where it would pull.
    fn candidate(
        &self,
        radius: usize,
        steps: [isize; 2],
        readings: &[Reading],
    ) -> Option<Candidate> {
        let shares = &self.shares[radius];
        let (mut cross, mut square) = (0.0, 0.0);
        for one in readings {
            let x = one.offset[0].abs_diff(steps[0]);
            let y = one.offset[1].abs_diff(steps[1]);
            let share = shares[x * OFFSETS + y];
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

impl Placing for ProfileFit {
    fn place(&self, forces: &[f64], deviations: &[f64]) -> Option<Place> {
        let elements = self.model.rows * self.model.columns;
        if forces.len() != elements || deviations.len() != elements {
            return None;
        }
        let top = peak(forces, deviations)?;
        let readings = self.readings(top, forces, deviations);
        let silent: f64 = readings
            .iter()
            .map(|one| one.force * one.force * one.weight)
            .sum();
        // Place, size and force are four unknowns.
        let freedom = readings.len().saturating_sub(4).max(1) as f64;
        let surveyed = self.survey(top, &readings);
        let temper = |gain: f64| ((silent - gain) / freedom).max(1.0);
        let weight = |one: &Candidate, best: f64| (0.5 * (one.gain - best) / temper(best)).exp();
        let most = best(&surveyed);
        let candidates: Vec<Candidate> = surveyed
            .iter()
            .filter(|one| weight(one, most) > NEGLIGIBLE)
            .flat_map(|one| self.tile(top, one, &readings))
            .collect();
        let most = best(&candidates);
        let middle = flat_position(&self.model, top);
        // Weight, then the sums of x, y, force, radius, xx, xy, yy.
        let mut sums = [0.0; 8];
        for one in &candidates {
            let weight = weight(one, most);
            let at = |axis: usize| {
                middle[axis] + one.steps[axis] as f64 * self.model.pitch[axis] / STEPS as f64
            };
            let (x, y, radius) = (at(0), at(1), self.model.radii[one.radius]);
            let terms = [1.0, x, y, one.force, radius, x * x, x * y, y * y];
            for (sum, term) in sums.iter_mut().zip(terms) {
                *sum += weight * term;
            }
        }
        let [_, x, y, force, radius, xx, xy, yy] = sums.map(|sum| sum / sums[0]);
        // The true place is between the steps of the grid.
        let step = self
            .model
            .pitch
            .map(|pitch| (pitch / STEPS as f64).powi(2) / 12.0);
        let covariance = [xx - x * x + step[0], xy - x * y, yy - y * y + step[1]];
        let [px, py] = self.model.pitch;
        let known = 4.0 * covariance[0] < px * px && 4.0 * covariance[2] < py * py;
        known.then_some(Place {
            centre: [x, y],
            covariance,
            force,
            radius: Some(radius),
            misfit: silent - most,
            method: Method::Profile,
        })
    }
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

fn flat_position(model: &ProfileModel, index: usize) -> [f64; 2] {
    let (row, column) = (index / model.columns, index % model.columns);
    let x = (column as f64 - 0.5 * (model.columns as f64 - 1.0)) * model.pitch[0];
    let y = (0.5 * (model.rows as f64 - 1.0) - row as f64) * model.pitch[1];
    [x, y]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    const THICKNESS: f64 = 1.11e-3;

    fn positions() -> Vec<[f64; 2]> {
        (0..8)
            .map(|i| {
                [
                    f64::from(i % 4) * 4e-3 - 6e-3,
                    2e-3 - f64::from(i / 4) * 4e-3,
                ]
            })
            .collect()
    }

    fn fit(radii: Vec<f64>) -> ProfileFit {
        ProfileFit::new(ProfileModel {
            rows: 2,
            columns: 4,
            pitch: [4e-3; 2],
            side: 2e-3,
            thickness: THICKNESS,
            radii,
            gain_deviation: 0.02,
            margin: 0.0,
        })
        .unwrap()
    }

    /// A device with gains 2 % apart under a probe, at a signal of 100
    /// deviations.
    pub(in crate::estimation) struct Presses {
        table: crate::mechanics::ShareTable,
        gains: Vec<f64>,
        random: rand_chacha::ChaCha8Rng,
    }

    impl Presses {
        pub(in crate::estimation) fn new(radius: f64, seed: u64) -> Self {
            let cover = SoftCover {
                thickness: THICKNESS,
                base: Base::Rigid,
                contact: Contact::Hertz(radius),
            };
            let mut presses = Self {
                table: cover.table(),
                gains: Vec::new(),
                random: rand_chacha::ChaCha8Rng::seed_from_u64(11),
            };
            presses.gains = (0..8).map(|_| 1.0 + 0.02 * presses.normal()).collect();
            presses.random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            presses
        }

        fn normal(&mut self) -> f64 {
            (0..12).map(|_| self.random.random_range(-0.5..0.5)).sum()
        }

        /// Forces on the elements for a press of 1 N, and their deviation.
        pub(in crate::estimation) fn forces(&mut self, place: [f64; 2]) -> (Vec<f64>, f64) {
            let offset = |at: [f64; 2]| [at[0] - place[0], at[1] - place[1]];
            let share = |at: [f64; 2]| self.table.share(offset(at), 2e-3);
            let shares: Vec<f64> = positions().into_iter().map(share).collect();
            let sigma = 0.01 * shares.iter().copied().fold(0.0, f64::max);
            let felt = (0..8).map(|i| shares[i] * self.gains[i] + sigma * self.normal());
            (felt.collect(), sigma)
        }
    }

    /// Root mean square error over random places in the rectangle of the
    /// elements' centres, and the mean square of the error over its stated
    /// deviation, per axis.
    pub(in crate::estimation) fn rms(placing: &dyn Placing, radius: f64) -> [f64; 2] {
        let mut presses = Presses::new(radius, 13);
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(12);
        let (mut squares, mut ratios) = (0.0, 0.0);
        let trials = 300;
        for _ in 0..trials {
            let true_centre = [
                random.random_range(-6e-3..6e-3),
                random.random_range(-2e-3..2e-3),
            ];
            let (forces, sigma) = presses.forces(true_centre);
            let place = placing.place(&forces, &[sigma; 8]).unwrap();
            for (axis, truth) in true_centre.iter().enumerate() {
                let error = place.centre[axis] - truth;
                squares += error * error / f64::from(trials);
                ratios += error * error / place.covariance[2 * axis] / f64::from(2 * trials);
            }
        }
        [squares.sqrt(), ratios]
    }

    #[test]
    fn a_contact_of_unknown_radius_is_placed_within_its_covariance() {
        let fit = fit(ProfileModel::unknown_radii(THICKNESS, 8e-3));
        let centroid = Centroid {
            positions: positions(),
            pitch: [4e-3; 2],
        };
        let mut squares = 0.0;
        for radius in [1.5e-3, 2.3e-3, 2.9e-3, 3.6e-3, 5e-3] {
            let [error, ratio] = rms(&fit, radius);
            squares += error * error / 5.0;
            // The mean of 600 squares of a model that holds is within 1 ± 0.2;
            // radii and places between the steps of the grid add to it.
            assert!(ratio < 1.5, "{radius}: {ratio}");
            // The centre of force may be lucky for one size, not for all.
            assert!(error < 1.2 * rms(&centroid, radius)[0] || error < 0.4e-3);
        }
        // The goal where nobody knows the radius.
        assert!(squares.sqrt() < 0.35e-3, "{}", squares.sqrt());
    }

    #[test]
    fn a_flat_or_silent_profile_is_no_information() {
        let fit = fit(vec![2e-3, 4e-3]);
        assert_eq!(fit.place(&[0.0; 8], &[1e-3; 8]), None);
        assert_eq!(fit.place(&[f64::NAN; 8], &[1e-3; 8]), None);
        // One element alone: the place behind it is open.
        let mut one = [0.0; 8];
        one[0] = 0.01;
        let place = fit.place(&one, &[1.6e-3; 8]);
        assert!(
            place.is_none_or(|place| place.covariance[0] > 1e-7),
            "{place:?}"
        );
    }
}
