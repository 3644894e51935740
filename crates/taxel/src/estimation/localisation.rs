//! Where a round contact presses a soft cover, from the profile of the elements
//! below it.

use crate::mechanics::{Base, ContactPressure, SoftCover};

/// Estimator of the position of one contact from the forces on all elements.
///
/// The profile that a press of known size gives ([`super::ProfileFit`]) needs no
/// calibration; a map that was trained with the device may take its place. The
/// centre of force ([`Centroid`]) is the baseline both are measured against.
pub trait Localiser: std::fmt::Debug + Send + Sync {
    /// Position for the forces on the elements with their standard
    /// deviations, N. `None` where they hold no information on it.
    fn position(&self, forces: &[f64], deviations: &[f64]) -> Option<ContactPosition>;

    /// All contacts that the forces need, each with its position; none where no
    /// force is significant. One that holds no information on its position is
    /// still there.
    fn positions(&self, forces: &[f64], deviations: &[f64]) -> Vec<Located> {
        let found = peak(forces, deviations);
        let one = |_| Located {
            position: self.position(forces, deviations),
            carried: forces.to_vec(),
        };
        found.map(one).into_iter().collect()
    }
}

/// One of the contacts below a cover.
#[derive(Debug, Clone, PartialEq)]
pub struct Located {
    /// Its position; `None` where the forces do not determine it.
    pub position: Option<ContactPosition>,
    /// Force on each element by this contact, N.
    pub carried: Vec<f64>,
}

/// Estimated position of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPosition {
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
    /// Method that found it.
    pub method: Method,
}

/// Squared distance in deviations within which 95 % of a normal law of two
/// coordinates lie.
pub const ELLIPSE_95: f64 = 5.991;

/// Square of the distance of a point from a middle, in the deviations of a covariance xx, xy, yy.
fn distance_in([xx, xy, yy]: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
}

/// A covariance xx, xy, yy about the mean of all that a position may be, at least as wide as
/// its ellipse of 95 % must be to hold 95 % of it, which may lie along a bend: of each, the
/// offset from the mean and how likely it is.
pub(super) fn holding_95(
    covariance: [f64; 3],
    possible: impl Iterator<Item = ([f64; 2], f64)>,
) -> [f64; 3] {
    let mut all = 0.0;
    // Only what the ellipse does not hold can widen it: few of many.
    let mut beyond: Vec<(f64, f64)> = Vec::new();
    for (off, weight) in possible {
        all += weight;
        let far = distance_in(covariance, off);
        if far > ELLIPSE_95 {
            beyond.push((far, weight));
        }
    }
    beyond.sort_unstable_by(|(a, _), (b, _)| b.total_cmp(a));
    let mut outside = 0.05 * all;
    let last = beyond.iter().find(|(_, weight)| {
        outside -= weight;
        outside < 0.0
    });
    let wider = last.map_or(1.0, |(far, _)| far / ELLIPSE_95);
    covariance.map(|entry| wider * entry)
}

impl ContactPosition {
    /// True if it is known better than to half of this pitch x, y, m.
    pub(super) fn is_known(&self, pitch: [f64; 2]) -> bool {
        let within = |axis: usize| 4.0 * self.covariance[2 * axis] < pitch[axis].powi(2);
        within(0) && within(1)
    }

    /// Square of its distance from `truth`, m, in its deviations.
    pub fn distance(&self, truth: [f64; 2]) -> f64 {
        let off = [0, 1].map(|axis| self.centre[axis] - truth[axis]);
        distance_in(self.covariance, off)
    }

    /// The same with this factor on its deviations.
    pub(super) fn spread(self, factor: f64) -> Self {
        Self {
            covariance: self.covariance.map(|entry| factor * factor * entry),
            ..self
        }
    }
}

/// Method that found a position.
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

/// A profile whose highest force is below this many standard deviations gives no
/// information.
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

impl Localiser for Centroid {
    fn position(&self, forces: &[f64], deviations: &[f64]) -> Option<ContactPosition> {
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
        Some(ContactPosition {
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
    /// Distance beyond the centres of the outer elements that a contact may have, as a
    /// share of the pitch, at most a half. Out there one element carries it alone, and
    /// its position is hardly known.
    pub margin: f64,
}

impl ProfileModel {
    /// The cover below a round contact of this radius, m.
    pub fn cover(&self, radius: f64) -> SoftCover {
        SoftCover {
            thickness: self.thickness,
            base: Base::Rigid,
            contact: ContactPressure::Hertz(radius),
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

    /// Radii from half the thickness of the cover to `largest`, for a contact of unknown size:
    /// each an eighth larger than the last, and by no more than a quarter of the thickness,
    /// over which the rim of a contact is blurred.
    pub fn unknown_radii(thickness: f64, largest: f64) -> Vec<f64> {
        let next = |radius: &f64| Some(radius + (0.12 * radius).min(0.25 * thickness));
        std::iter::successors(Some(0.5 * thickness), next)
            .take_while(|radius| *radius <= largest)
            .collect()
    }
}

/// Centre of an element, m.
pub(super) fn flat_position(model: &ProfileModel, index: usize) -> [f64; 2] {
    let (row, column) = (index / model.columns, index % model.columns);
    let x = (column as f64 - 0.5 * (model.columns as f64 - 1.0)) * model.pitch[0];
    let y = (0.5 * (model.rows as f64 - 1.0) - row as f64) * model.pitch[1];
    [x, y]
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::ProfileFit;
    use super::*;
    use rand::{RngExt, SeedableRng};

    pub(in crate::estimation) const THICKNESS: f64 = 1.11e-3;

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

    pub(in crate::estimation) fn fit(radii: Vec<f64>) -> ProfileFit {
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
                contact: ContactPressure::Hertz(radius),
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
        pub(in crate::estimation) fn forces(&mut self, position: [f64; 2]) -> (Vec<f64>, f64) {
            let offset = |at: [f64; 2]| [at[0] - position[0], at[1] - position[1]];
            let share = |at: [f64; 2]| self.table.share(offset(at), 2e-3);
            let shares: Vec<f64> = positions().into_iter().map(share).collect();
            let sigma = 0.01 * shares.iter().copied().fold(0.0, f64::max);
            let forces = (0..8).map(|i| shares[i] * self.gains[i] + sigma * self.normal());
            (forces.collect(), sigma)
        }
    }

    /// Root mean square error over random positions in the rectangle of the
    /// elements' centres, and the mean square of the error over its stated
    /// deviation, per axis.
    pub(in crate::estimation) fn rms(localiser: &dyn Localiser, radius: f64) -> [f64; 2] {
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
            let position = localiser.position(&forces, &[sigma; 8]).unwrap();
            for (axis, truth) in true_centre.iter().enumerate() {
                let error = position.centre[axis] - truth;
                squares += error * error / f64::from(trials);
                ratios += error * error / position.covariance[2 * axis] / f64::from(2 * trials);
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
            // radii and positions between the steps of the grid add to it.
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
        assert_eq!(fit.position(&[0.0; 8], &[1e-3; 8]), None);
        assert_eq!(fit.position(&[f64::NAN; 8], &[1e-3; 8]), None);
        // One element alone: the position behind it is open.
        let mut one = [0.0; 8];
        one[0] = 0.01;
        let position = fit.position(&one, &[1.6e-3; 8]);
        assert!(
            position.is_none_or(|position| position.covariance[0] > 1e-7),
            "{position:?}"
        );
    }
}
