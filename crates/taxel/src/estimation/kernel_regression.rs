//! Where a contact presses, learned from presses on the device itself.

use rayon::prelude::*;

use super::localisation::{ContactPosition, Localiser, Method, ProfileModel};
use super::position_fit::{ProfileFit, grid};
use crate::mechanics::ShareTable;
use crate::trained::{FEWEST_PRESSES, GaussianProcess, Kernel, TrainingError};

/// One indentation at a known position.
#[derive(Debug, Clone, PartialEq)]
pub struct IndentationForces {
    /// Forces on all elements, N.
    pub forces: Vec<f64>,
    /// Centre on the developed surface, m.
    pub position: [f64; 2],
    /// Radius of the contact, m, where it is known.
    pub radius: Option<f64>,
}

/// Kernel regression over position of the difference of the indentations from the
/// profile, one for each radius, and the positions that explain given forces.
///
/// It learns directions of the forces, vectors of unit length. Of presses whose
/// radius is not known there is no profile, and it learns the whole. The
/// regression goes from position to forces, as
/// the body does: the same forces may come from two positions, so that a map from
/// forces to position would be between both and sure of it. Forces that no position
/// explains are of a contact unlike those that pressed: no information.
#[derive(Debug, Clone)]
pub struct KernelRegression {
    fit: ProfileFit,
    sizes_known: bool,
    trust: Trust,
}

/// Trust in a regression, from indentations that it has not seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trust {
    /// Factor on the stated deviations.
    pub spread: f64,
    /// Misfit over its degrees of freedom above which a contact is unlike all
    /// that was learned.
    pub reach: f64,
}

impl Trust {
    /// Trust in a regression before any test.
    pub const UNTRIED: Self = Self {
        spread: 1.0,
        reach: f64::INFINITY,
    };
}

/// Widths that are tried, over the pitch.
const LENGTHS: [f64; 5] = [0.25, 0.5, 0.75, 1.0, 1.5];
/// Deviations of the smooth part that are tried, of vectors of unit length.
const DEVIATIONS: [f64; 3] = [0.003, 0.03, 0.3];
/// Scatter of one force that is tried, of vectors of unit length.
const NOISES: [f64; 5] = [0.001, 0.003, 0.01, 0.03, 0.1];

impl KernelRegression {
    /// The kernel of the largest marginal likelihood: width in m, the rest
    /// without unit.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn kernel(
        presses: &[IndentationForces],
        model: &ProfileModel,
    ) -> Result<Kernel, TrainingError> {
        let groups = groups(presses, model)?;
        let pitch = model.pitch;
        let kernel = |length: f64, deviation: f64, noise: f64| Kernel {
            deviation,
            length: length * pitch[0].max(pitch[1]),
            slope: 0.0,
            noise,
        };
        let noises = |length, deviation| NOISES.map(|noise| kernel(length, deviation, noise));
        let tried: Vec<(f64, Kernel)> = LENGTHS
            .into_iter()
            .flat_map(|length| DEVIATIONS.map(|deviation| noises(length, deviation)))
            .flatten()
            .collect::<Vec<Kernel>>()
            .into_par_iter()
            .map(|kernel| {
                let likelihoods = groups.iter().map(|group| {
                    let process = group.process(kernel)?;
                    Ok(process.log_likelihood())
                });
                let sum: Result<f64, TrainingError> = likelihoods.sum();
                Ok((sum?, kernel))
            })
            .collect::<Result<_, TrainingError>>()?;
        let best = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, kernel)| kernel)
            .ok_or(TrainingError::NoSignal)
    }

    /// Learns from presses on the elements of `model` with a kernel that is
    /// known.
    ///
    /// # Errors
    /// [`TrainingError`] for too few presses, presses in one position, forces of
    /// another number of elements, or none at all.
    pub fn observe(
        kernel: Kernel,
        presses: &[IndentationForces],
        model: &ProfileModel,
    ) -> Result<Self, TrainingError> {
        let groups = groups(presses, model)?;
        let positions: Vec<[f64; 2]> = grid(model).collect();
        let table = |group: &Group| {
            let process = group.process(kernel)?;
            let forces = |at: &[f64; 2]| sum(&group.expected(*at), &process.mean(at));
            Ok(positions.par_iter().flat_map_iter(forces).collect())
        };
        let tables: Result<Vec<Vec<f64>>, TrainingError> = groups.par_iter().map(table).collect();
        let learned = ProfileModel {
            radii: groups
                .iter()
                .map(|group| group.radius.unwrap_or(0.0))
                .collect(),
            gain_deviation: 0.0,
            margin: 0.0,
            ..model.clone()
        };
        Ok(Self {
            fit: ProfileFit::learned(learned, tables?, kernel.noise),
            sizes_known: groups.iter().all(|group| group.radius.is_some()),
            trust: Trust::UNTRIED,
        })
    }

    /// The same, trusted as far as presses that it has not seen allow.
    #[must_use]
    pub fn with_trust(self, trust: Trust) -> Self {
        Self { trust, ..self }
    }

    /// The position by what was learned, however unlike the contact and however
    /// badly known, with the misfit over its degrees of freedom.
    pub fn search(&self, forces: &[f64], deviations: &[f64]) -> Option<(ContactPosition, f64)> {
        let (position, score) = self.fit.search(forces, deviations)?;
        let position = ContactPosition {
            force: forces.iter().sum(),
            radius: position.radius.filter(|_| self.sizes_known),
            method: Method::Trained,
            ..position
        };
        Some((position.spread(self.trust.spread), score))
    }
}

impl Localiser for KernelRegression {
    fn position(&self, forces: &[f64], deviations: &[f64]) -> Option<ContactPosition> {
        let (position, score) = self.search(forces, deviations)?;
        let like = score <= self.trust.reach;
        (like && position.is_known(self.fit.model().pitch)).then_some(position)
    }
}

/// Presses of one radius.
struct Group {
    radius: Option<f64>,
    profile: Option<ShareTable>,
    elements: Vec<[f64; 2]>,
    side: f64,
    positions: Vec<Vec<f64>>,
    /// Difference of the directions from those of the profile.
    beyond: Vec<Vec<f64>>,
}

impl Group {
    fn new(
        radius: Option<f64>,
        presses: &[&IndentationForces],
        model: &ProfileModel,
    ) -> Result<Self, TrainingError> {
        let mut group = Self {
            radius,
            profile: radius.map(|radius| model.cover(radius).table()),
            elements: model.centroid().positions,
            side: model.side,
            positions: presses
                .iter()
                .map(|press| press.position.to_vec())
                .collect(),
            beyond: Vec::new(),
        };
        for press in presses {
            let measured = direction(&press.forces).ok_or(TrainingError::NoSignal)?;
            let expected = group.expected(press.position);
            let pairs = measured.iter().zip(&expected);
            group.beyond.push(
                pairs
                    .map(|(measured, expected)| measured - expected)
                    .collect(),
            );
        }
        Ok(group)
    }

    /// Direction of the forces of a press at a position by the profile; zero
    /// without one.
    fn expected(&self, position: [f64; 2]) -> Vec<f64> {
        let Some(profile) = &self.profile else {
            return vec![0.0; self.elements.len()];
        };
        let offset = |at: &[f64; 2]| [at[0] - position[0], at[1] - position[1]];
        let shares = self.elements.iter();
        let shares: Vec<f64> = shares
            .map(|at| profile.share(offset(at), self.side))
            .collect();
        direction(&shares).unwrap_or(shares)
    }

    fn process(&self, kernel: Kernel) -> Result<GaussianProcess, TrainingError> {
        GaussianProcess::observe(kernel, &self.positions, &self.beyond)
    }
}

/// Presses by their radius; all together where one radius has too few, or none
/// is known.
fn groups(
    presses: &[IndentationForces],
    model: &ProfileModel,
) -> Result<Vec<Group>, TrainingError> {
    let (found, needed) = (presses.len(), FEWEST_PRESSES);
    let Some(first) = presses.first().filter(|_| found >= needed) else {
        return Err(TrainingError::TooFew { found, needed });
    };
    let expected = model.rows * model.columns;
    if let Some(other) = presses.iter().find(|press| press.forces.len() != expected) {
        let found = other.forces.len();
        return Err(TrainingError::Channels { found, expected });
    }
    if presses.iter().all(|press| press.position == first.position) {
        return Err(TrainingError::NoArea(0.0, 0.0));
    }
    let mut radii: Vec<Option<f64>> = presses.iter().map(|press| press.radius).collect();
    radii.sort_by(|a, b| a.unwrap_or(0.0).total_cmp(&b.unwrap_or(0.0)));
    radii.dedup();
    let of = |radius: &Option<f64>| -> Vec<&IndentationForces> {
        let such = presses.iter().filter(|press| press.radius == *radius);
        such.collect()
    };
    let parts: Vec<Vec<&IndentationForces>> = radii.iter().map(of).collect();
    if parts.iter().any(|part| part.len() < FEWEST_PRESSES) {
        let all: Vec<&IndentationForces> = presses.iter().collect();
        return Ok(vec![Group::new(None, &all, model)?]);
    }
    let pairs = radii.into_iter().zip(&parts);
    pairs
        .map(|(radius, part)| Group::new(radius, part, model))
        .collect()
}

/// Forces as a vector of unit length.
fn direction(forces: &[f64]) -> Option<Vec<f64>> {
    let length = forces.iter().map(|force| force * force).sum::<f64>().sqrt();
    let sound = length > 0.0 && length.is_finite();
    sound.then(|| forces.iter().map(|force| force / length).collect())
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

#[cfg(test)]
mod tests {
    use super::super::indentation_map::{localiser, regression};
    use super::super::localisation::tests::{Presses, THICKNESS, fit, rms};
    use super::*;
    use crate::trained::{IndentationMap, PositionMethod};

    /// Presses of each radius on a grid of 1 mm.
    fn presses(radii: &[f64]) -> Vec<IndentationForces> {
        let mut presses = Vec::new();
        for radius in radii {
            let mut bench = Presses::new(*radius, 5);
            for index in 0..65 {
                let position = [
                    f64::from(index % 13) * 1e-3 - 6e-3,
                    f64::from(index / 13) * 1e-3 - 2e-3,
                ];
                let (forces, _) = bench.forces(position);
                presses.push(IndentationForces {
                    forces,
                    position,
                    radius: Some(*radius),
                });
            }
        }
        presses
    }

    fn model() -> ProfileModel {
        fit(ProfileModel::unknown_radii(THICKNESS, 8e-3))
            .model()
            .clone()
    }

    fn trained(presses: &[IndentationForces]) -> Result<KernelRegression, TrainingError> {
        let model = model();
        let kernel = KernelRegression::kernel(presses, &model)?;
        KernelRegression::observe(kernel, presses, &model)
    }

    #[test]
    fn a_probe_that_was_trained_is_placed_better_than_by_any_model() {
        let [error, ratio] = rms(&trained(&presses(&[3.6e-3])).unwrap(), 3.6e-3);
        // Half of the 0.11 mm of a map from forces to position in the
        // specification's own simulation.
        assert!(error < 0.07e-3, "{error}");
        // The noise of training is in the tables and in the forces: too wide
        // until presses are held out.
        assert!((0.2..1.6).contains(&ratio), "{ratio}");
    }

    #[test]
    fn presses_of_unknown_radius_are_learned_whole() {
        let mut presses = presses(&[3.6e-3]);
        for press in &mut presses {
            press.radius = None;
        }
        let learned = trained(&presses).unwrap();
        let [error, _] = rms(&learned, 3.6e-3);
        // Without the profile the grid of 1 mm alone determines all.
        assert!(error < 0.11e-3, "{error}");
        let (forces, sigma) = Presses::new(3.6e-3, 1).forces([1e-3, 0.5e-3]);
        assert_eq!(learned.position(&forces, &[sigma; 8]).unwrap().radius, None);
    }

    #[test]
    fn forces_that_no_place_explains_are_no_information() {
        let learned = trained(&presses(&[3.6e-3])).unwrap();
        let strange = |radius: f64| {
            let mut bench = Presses::new(radius, 3);
            let mut all: Vec<f64> = (0..50)
                .map(|index| {
                    let part = |step: f64| (f64::from(index) * step).fract() - 0.5;
                    let at = [12e-3 * part(0.754_877_67), 4e-3 * part(0.569_840_29)];
                    let (forces, sigma) = bench.forces(at);
                    learned.search(&forces, &[sigma; 8]).unwrap().1
                })
                .collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let like = strange(3.6e-3);
        let unlike = strange(1.5e-3);
        // Nine in ten contacts of less than half the radius are distinguished
        // from all that pressed; the others look like them.
        assert!(unlike[5] > like[49], "{unlike:?} {like:?}");
        let careful = learned.with_trust(Trust {
            spread: 1.0,
            reach: like[49],
        });
        let (forces, sigma) = Presses::new(1.5e-3, 3).forces([1.5e-3, 1.0e-3]);
        assert_eq!(careful.position(&forces, &[sigma; 8]), None);
        let (forces, sigma) = Presses::new(3.6e-3, 3).forces([0.0; 2]);
        assert!(careful.position(&forces, &[sigma; 8]).is_some());
    }

    /// `finder` after presses of 3.6 mm on a device whose elements lie by `shift`
    /// along x beside their drawing.
    fn finder(finder: PositionMethod, shift: f64) -> std::sync::Arc<dyn Localiser> {
        let mut presses = presses(&[3.6e-3]);
        let mut bench = Presses::new(3.6e-3, 5);
        for press in &mut presses {
            press.forces = bench
                .forces([press.position[0] - shift, press.position[1]])
                .0;
        }
        let profile = fit(ProfileModel::unknown_radii(THICKNESS, 8e-3));
        let kernel = KernelRegression::kernel(&presses, profile.model()).unwrap();
        let mut map = IndentationMap {
            finder,
            gains: vec![1.0; 8],
            gain_deviation: 0.02,
            profile_spread: 1.0,
            kernel: [kernel.deviation, kernel.length, kernel.noise],
            spread: 1.0,
            reach: f64::MAX,
            directions: presses.iter().map(|one| one.forces.clone()).collect(),
            positions: presses.iter().map(|one| one.position).collect(),
            radii: vec![3.6e-3; presses.len()],
        };
        // As calibration does: what presses that it has not seen hardly exceed.
        let learned = regression(&map, &profile).unwrap();
        let strange = positions().map(|at| {
            let (forces, sigma) = bench.forces([at[0] - shift, at[1]]);
            learned.search(&forces, &[sigma; 8]).unwrap().1
        });
        map.reach = strange.fold(0.0, f64::max);
        localiser(&map, profile).unwrap()
    }

    /// Fifty positions all over the elements.
    fn positions() -> impl Iterator<Item = [f64; 2]> {
        (0..50).map(|index| {
            let part = |step: f64| (f64::from(index) * step).fract() - 0.5;
            [11e-3 * part(0.754_877_67), 3.6e-3 * part(0.569_840_29)]
        })
    }

    /// Median error, m, and share of the positions that came from the regression.
    fn median(finder: &dyn Localiser, radius: f64, shift: f64) -> [f64; 2] {
        let mut bench = Presses::new(radius, 17);
        let (mut errors, mut learned) = (Vec::new(), 0.0);
        for at in positions() {
            let (forces, sigma) = bench.forces([at[0] - shift, at[1]]);
            let Some(position) = finder.position(&forces, &[sigma; 8]) else {
                continue;
            };
            errors.push((position.centre[0] - at[0]).hypot(position.centre[1] - at[1]));
            learned += f64::from(u8::from(position.method == Method::Trained));
        }
        errors.sort_by(f64::total_cmp);
        assert!(errors.len() > 30, "{}", errors.len());
        [errors[errors.len() / 2], learned / errors.len() as f64]
    }

    #[test]
    fn kernel_or_profile_takes_the_one_that_is_right() {
        // A small contact after presses of a large one: the kernel is wrong.
        let both = finder(PositionMethod::KernelOrProfile, 0.0);
        let [error, learned] = median(&*both, 1.5e-3, 0.0);
        let [right, _] = median(&*finder(PositionMethod::Profile, 0.0), 1.5e-3, 0.0);
        assert!(learned < 0.2, "{learned}");
        assert!(error < 1.2 * right, "{error} {right}");
        // Elements that lie half a millimetre beside the drawing: the profile is.
        let both = finder(PositionMethod::KernelOrProfile, 0.5e-3);
        let [error, learned] = median(&*both, 3.6e-3, 0.5e-3);
        let [wrong, _] = median(&*finder(PositionMethod::Profile, 0.5e-3), 3.6e-3, 0.5e-3);
        assert!(learned > 0.9, "{learned}");
        assert!(error < 0.1e-3 && wrong > 0.4e-3, "{error} {wrong}");
    }

    #[test]
    fn what_cannot_be_learned_is_named() {
        let sound = presses(&[2.9e-3]);
        let refused = |change: &dyn Fn(&mut Vec<IndentationForces>)| {
            let mut presses = sound.clone();
            change(&mut presses);
            trained(&presses).unwrap_err()
        };
        let found = refused(&|presses| presses.truncate(3));
        assert!(matches!(found, TrainingError::TooFew { found: 3, .. }));
        let found = refused(&|presses| presses.iter_mut().for_each(|one| one.position = [0.0; 2]));
        assert!(matches!(found, TrainingError::NoArea(..)));
        let found = refused(&|presses| presses[4].forces = vec![0.0; 8]);
        assert!(matches!(found, TrainingError::NoSignal));
        let found = refused(&|presses| presses[4].forces = vec![1.0; 3]);
        assert!(matches!(found, TrainingError::Channels { found: 3, .. }));
        let regression = trained(&sound).unwrap();
        assert_eq!(regression.position(&[0.0; 8], &[1e-3; 8]), None);
        assert_eq!(regression.position(&[1.0; 3], &[1e-3; 3]), None);
    }
}
