//! Presses of which parts are held out: gains of the elements, and maps of the
//! others.

use std::sync::Arc;

use rayon::prelude::*;

use super::PiezoelectricCalibrator;
use super::problem::Indentation;
use taxel::estimation::{
    ELLIPSE_95, IndentationForces, KernelRegression, Localiser, Method, ProfileFit, localiser,
    regression,
};
use taxel::mechanics::ShareTable;
use taxel::trained::{IndentationMap, Kernel, PositionMethod, TrainingError};
use taxel_numerics::dense::dot;

/// Presses of one probe are divided so often, each part held out in turn.
pub(super) const FOLDS: usize = 5;
/// Presses that the kernel is chosen with.
const FOR_KERNEL: usize = 300;
/// Rounds in which forces of presses and gains of elements settle.
const ROUNDS: usize = 30;
/// Gains of a drawing without scatter may differ by so much.
const LEAST_SCATTER: f64 = 1e-6;
/// Presses that must be left when those of a radius are held out.
const LEAST_LEFT: usize = 12;

/// Candidate for the estimation of positions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) by: PositionMethod,
    /// True if the gains that the presses taught are used.
    pub(super) with_gains: bool,
}

const fn candidate(name: &'static str, by: PositionMethod, with_gains: bool) -> Candidate {
    Candidate {
        name,
        by,
        with_gains,
    }
}

pub(super) const CANDIDATES: [Candidate; 5] = [
    candidate("centroid", PositionMethod::Centroid, false),
    candidate("profile", PositionMethod::Profile, false),
    candidate("profile_with_gains", PositionMethod::Profile, true),
    // Before the regression alone, which is no better where they are alike.
    candidate("kernel_or_profile", PositionMethod::KernelOrProfile, true),
    candidate("kernel", PositionMethod::Kernel, true),
];
/// A press that was held out, with where it was found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    /// Index of the press.
    pub(super) press: usize,
    /// True if other presses of its radius were seen.
    pub(super) radius_seen: bool,
    /// m.
    pub(super) error: [f64; 2],
    /// m.
    pub(super) deviation: [f64; 2],
    /// True if the position is within its ellipse of 95 %; none where the signals
    /// did not determine it.
    pub(super) inside: Option<bool>,
    /// True if it was estimated by what was learned, and not by the profile.
    pub(super) learned: bool,
}

impl Found {
    pub(super) fn distance(&self) -> f64 {
        self.error[0].hypot(self.error[1])
    }
}

/// Presses with all that does not change while parts of them are held out.
pub(super) struct CrossValidation<'a> {
    presses: &'a [Indentation],
    profile: ProfileFit,
    positions: Vec<[f64; 2]>,
    side: f64,
    /// Radii of the probes, m; none where the bench does not know them.
    pub(super) radii: Vec<f64>,
    /// Shares of the elements for each press, by its radius or the one that
    /// fits all presses best.
    shares: Vec<Vec<f64>>,
    kernel: Kernel,
    /// Scatter of the gains by the drawing.
    gain_deviation: f64,
    /// Deviation of places that are as likely all over the array, m.
    anywhere: [f64; 2],
}

/// Distances by the regression and by the profile of indentations that are held out.
pub(super) struct FoldDistances {
    /// True if other presses of these radii were seen.
    radius_seen: bool,
    distances: Vec<Distances>,
}

/// Squared distances of a place from the truth, in its deviations.
struct Distances {
    radius: Option<f64>,
    learned: Option<f64>,
    out_of_distribution: Option<f64>,
    profile: Option<f64>,
}

/// Share of the presses of known radii that are taken for known.
const IN_DISTRIBUTION: f64 = 0.99;
const WITH_GAINS: Candidate = Candidate {
    name: "",
    by: PositionMethod::Kernel,
    with_gains: true,
};

/// The map with what distances_of_folds say of its deviations.
///
/// The regression is for contacts of the radii that pressed, and its factor is
/// that of all of them together. The profile is for the others: its factor is
/// that of the radius at which it does worst, with nine in ten confidence: a
/// radius between those may do worse still.
pub(super) fn trusted<'a>(
    map: IndentationMap,
    distances_of_folds: impl Iterator<Item = &'a FoldDistances>,
) -> IndentationMap {
    let seen: Vec<&Distances> = distances_of_folds
        .filter(|fold| fold.radius_seen)
        .flat_map(|fold| &fold.distances)
        .collect();
    let all = |of: fn(&Distances) -> Option<f64>| {
        seen.iter().filter_map(|distances| of(distances)).collect()
    };
    let mut radii: Vec<Option<f64>> = seen.iter().map(|distances| distances.radius).collect();
    radii.sort_by(|a, b| a.unwrap_or(0.0).total_cmp(&b.unwrap_or(0.0)));
    radii.dedup();
    let of = |radius: &Option<f64>| {
        let such = seen.iter().filter(|distances| distances.radius == *radius);
        let distances: Vec<f64> = such.filter_map(|distances| distances.profile).collect();
        // Of fewer the largest one would decide.
        (distances.len() >= FEWEST_FOR_FACTOR).then(|| factor(distances, SURE))
    };
    IndentationMap {
        spread: factor(all(|distances| distances.learned), 0.0),
        reach: quantile(
            all(|distances| distances.out_of_distribution),
            IN_DISTRIBUTION,
        )
        .unwrap_or(f64::MAX),
        profile_spread: radii.iter().filter_map(of).fold(1.0, f64::max),
        ..map
    }
}

/// Least indentations of a radius for a factor on the deviations.
const FEWEST_FOR_FACTOR: usize = 20;

/// Nine in ten samples: normal deviate of that confidence.
const SURE: f64 = 1.28;

/// Factor on the deviations after which 95 % of these squared distances are
/// within the ellipses of 95 %, or as many of all future ones by a confidence
/// that is given as a normal deviate.
fn factor(distances: Vec<f64>, confidence: f64) -> f64 {
    let scatter = (0.95 * 0.05 / distances.len().max(1) as f64).sqrt();
    quantile(distances, 0.95 + confidence * scatter)
        .map_or(1.0, |distance| (distance / ELLIPSE_95).sqrt().max(0.1))
}

/// The value that this share of all future ones stays below: the
/// ⌈share (n + 1)⌉-th smallest, at most the largest.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let rank = (share * (values.len() + 1) as f64).ceil() as usize;
    values.get(rank.min(values.len()).checked_sub(1)?).copied()
}

/// A part of the presses that is held out.
pub(super) struct Part {
    held: Vec<bool>,
    /// True if others of the same radius are not.
    pub(super) radius_seen: bool,
}

impl<'a> CrossValidation<'a> {
    pub(super) fn new(
        calibrator: &PiezoelectricCalibrator<'_>,
        presses: &'a [Indentation],
    ) -> Result<Self, TrainingError> {
        let model = calibrator.profile.clone();
        let cells = [model.columns, model.rows];
        let stride = presses.len().div_ceil(FOR_KERNEL);
        let of = |press: &Indentation| IndentationForces {
            forces: press.forces.clone(),
            position: press.place,
            radius: press.radius,
        };
        let some: Vec<IndentationForces> = presses.iter().step_by(stride).map(of).collect();
        let mut radii: Vec<f64> = presses.iter().filter_map(|press| press.radius).collect();
        radii.sort_by(f64::total_cmp);
        radii.dedup();
        let mut validation = Self {
            presses,
            positions: model.centroid().positions,
            side: model.side,
            kernel: KernelRegression::kernel(&some, &model)?,
            gain_deviation: model.gain_deviation,
            anywhere: [0, 1].map(|axis| cells[axis] as f64 * model.pitch[axis] / 12.0_f64.sqrt()),
            shares: Vec::new(),
            radii,
            profile: ProfileFit::new(model).ok_or(TrainingError::NoSignal)?,
        };
        validation.shares = validation.known_shares();
        Ok(validation)
    }

    fn known_shares(&self) -> Vec<Vec<f64>> {
        let model = self.profile.model();
        let table = |radius: f64| model.cover(radius).table();
        let known: Vec<(f64, ShareTable)> = self.radii.iter().map(|a| (*a, table(*a))).collect();
        let guessed = self.presses.iter().any(|press| press.radius.is_none());
        let guess = guessed
            .then(|| {
                let fits = model.radii.par_iter().map(|radius| {
                    let table = table(*radius);
                    (self.misfit(&table), table)
                });
                fits.min_by(|a, b| a.0.total_cmp(&b.0))
            })
            .flatten();
        let of = |press: &Indentation| {
            let known = press
                .radius
                .and_then(|radius| known.iter().find(|(known, _)| *known == radius));
            let table = known.map(|(_, table)| table);
            let table = table.or(guess.as_ref().map(|(_, table)| table));
            table.map_or(Vec::new(), |table| self.shares_of(table, press))
        };
        self.presses.iter().map(of).collect()
    }

    fn shares_of(&self, table: &ShareTable, press: &Indentation) -> Vec<f64> {
        let offset = |at: &[f64; 2]| [at[0] - press.place[0], at[1] - press.place[1]];
        let positions = self.positions.iter();
        positions
            .map(|at| table.share(offset(at), self.side))
            .collect()
    }

    /// Squared misfit of all presses of an unknown radius with this table, each
    /// over its own size.
    fn misfit(&self, table: &ShareTable) -> f64 {
        let unknown = self.presses.iter().filter(|press| press.radius.is_none());
        unknown
            .map(|press| {
                let shares = self.shares_of(table, press);
                let force = ratio(&press.forces, &shares);
                let left = press.forces.iter().zip(&shares);
                let left: f64 = left.map(|(f, s)| (f - force * s).powi(2)).sum();
                left / dot(&press.forces, &press.forces)
            })
            .sum()
    }

    /// Gains over their mean and the deviation to which they are known, from
    /// fᵢ = F gᵢ sᵢ with the scatter of the drawing as prior.
    fn gains(&self, held: &[bool]) -> (Vec<f64>, f64) {
        let elements = self.positions.len();
        let seen: Vec<(&Indentation, &Vec<f64>)> = self.seen(held).collect();
        let prior = self.gain_deviation.max(LEAST_SCATTER).powi(-2);
        let mut gains = vec![1.0; elements];
        let mut weights = vec![prior; elements];
        let mut misfit = 0.0;
        for _ in 0..ROUNDS {
            let mut sums = vec![prior; elements];
            weights.fill(prior);
            misfit = 0.0;
            for (press, shares) in &seen {
                let pairs = gains.iter().zip(shares.iter());
                let expected: Vec<f64> = pairs.map(|(gain, share)| gain * share).collect();
                let force = ratio(&press.forces, &expected);
                for element in 0..elements {
                    let [size, noise] = [force * shares[element], press.deviation];
                    sums[element] += size * press.forces[element] / (noise * noise);
                    weights[element] += (size / noise).powi(2);
                    misfit += ((press.forces[element] - force * expected[element]) / noise).powi(2);
                }
            }
            for (gain, (sum, weight)) in gains.iter_mut().zip(sums.iter().zip(&weights)) {
                *gain = sum / weight;
            }
            let mean = gains.iter().sum::<f64>() / elements as f64;
            for gain in &mut gains {
                *gain /= mean;
            }
        }
        let freedom = (seen.len() * (elements - 1))
            .saturating_sub(elements)
            .max(1) as f64;
        let worst = weights.iter().copied().fold(f64::INFINITY, f64::min);
        let deviation = (misfit / freedom).max(1.0).sqrt() / worst.sqrt();
        (gains, deviation.min(self.gain_deviation))
    }

    /// Map learned without the indentations that are `held`, not yet judged by distances.
    pub(super) fn map_without(&self, candidate: &Candidate, held: &[bool]) -> IndentationMap {
        let (gains, gain_deviation) = if candidate.with_gains {
            self.gains(held)
        } else {
            (vec![1.0; self.positions.len()], self.gain_deviation)
        };
        let seen: Vec<&Indentation> = self.seen(held).map(|(press, _)| press).collect();
        let direction = |press: &&Indentation| {
            let responses = over(&press.forces, &gains);
            let length = dot(&responses, &responses).sqrt();
            responses.iter().map(|force| force / length).collect()
        };
        IndentationMap {
            finder: candidate.by,
            gain_deviation,
            profile_spread: 1.0,
            kernel: [self.kernel.deviation, self.kernel.length, self.kernel.noise],
            spread: 1.0,
            reach: f64::MAX,
            directions: seen.iter().map(direction).collect(),
            positions: seen.iter().map(|press| press.place).collect(),
            // All or none.
            radii: if seen.iter().all(|press| press.radius.is_some()) {
                seen.iter().filter_map(|press| press.radius).collect()
            } else {
                Vec::new()
            },
            gains,
        }
    }

    fn seen<'b>(
        &'b self,
        held: &'b [bool],
    ) -> impl Iterator<Item = (&'b Indentation, &'b Vec<f64>)> {
        let pairs = self.presses.iter().zip(&self.shares).zip(held);
        pairs.filter(|(_, held)| !**held).map(|(pair, _)| pair)
    }

    /// Parts of presses to be held out: some of all radii, then each radius.
    pub(super) fn parts(&self) -> Vec<Part> {
        let part = |radius_seen: bool, holds: &dyn Fn(usize, &Indentation) -> bool| Part {
            radius_seen,
            held: self
                .presses
                .iter()
                .enumerate()
                .map(|(i, p)| holds(i, p))
                .collect(),
        };
        let folds = (0..FOLDS).map(|fold| part(true, &|index, _| index % FOLDS == fold));
        let mut parts: Vec<Part> = folds.collect();
        if self.radii.len() > 1 {
            let of = |radius: &f64| part(false, &|_, press| press.radius == Some(*radius));
            let left = |part: &Part| part.held.iter().filter(|held| !**held).count();
            parts.extend(
                self.radii
                    .iter()
                    .map(of)
                    .filter(|part| left(part) >= LEAST_LEFT),
            );
        }
        parts
    }

    /// Distances of both ways to estimate positions on the indentations of each part,
    /// learned from the others.
    pub(super) fn distances_of_folds(
        &self,
        parts: &[Part],
    ) -> Result<Vec<FoldDistances>, TrainingError> {
        let distances_of_folds = parts.par_iter().map(|part| self.fold(part));
        distances_of_folds.collect()
    }

    fn fold(&self, part: &Part) -> Result<FoldDistances, TrainingError> {
        let map = self.map_without(&WITH_GAINS, &part.held);
        let profile = self.profile.clone().with_gain_deviation(map.gain_deviation);
        let kernel = regression(&map, &profile)?;
        let held = (0..self.presses.len()).filter(|press| part.held[*press]);
        let distances = held.map(|index| {
            let press = &self.presses[index];
            let forces = over(&press.forces, &map.gains);
            let deviations = over(&vec![press.deviation; map.gains.len()], &map.gains);
            let learned = kernel.search(&forces, &deviations);
            Distances {
                radius: press.radius,
                learned: learned.map(|(place, _)| place.distance(press.place)),
                out_of_distribution: learned.map(|(_, out_of_distribution)| out_of_distribution),
                profile: profile
                    .position(&forces, &deviations)
                    .map(|place| place.distance(press.place)),
            }
        });
        Ok(FoldDistances {
            radius_seen: part.radius_seen,
            distances: distances.collect(),
        })
    }

    /// Where `candidate` finds the presses of each part, learned from the others
    /// and trusted by the distances_of_folds of the other parts.
    pub(super) fn held_out(
        &self,
        candidate: &Candidate,
        parts: &[Part],
        distances_of_folds: &[FoldDistances],
    ) -> Result<Vec<Found>, TrainingError> {
        let mut all = Vec::new();
        for (place, part) in parts.iter().enumerate() {
            let others = distances_of_folds.iter().enumerate();
            let others = others.filter(|(other, _)| *other != place);
            let map = trusted(
                self.map_without(candidate, &part.held),
                others.map(|(_, fold)| fold),
            );
            let localiser = localiser(&map, self.profile.clone())?;
            let held = (0..self.presses.len()).filter(|press| part.held[*press]);
            all.extend(held.map(|press| Found {
                radius_seen: part.radius_seen,
                ..self.find(&localiser, &map.gains, press)
            }));
        }
        Ok(all)
    }

    fn find(&self, localiser: &Arc<dyn Localiser>, gains: &[f64], index: usize) -> Found {
        let press = &self.presses[index];
        let noise = vec![press.deviation; gains.len()];
        let place = localiser.position(&over(&press.forces, gains), &over(&noise, gains));
        let estimated = place.map(|place| {
            let variances = [place.covariance[0], place.covariance[2]];
            (place.centre, variances.map(f64::sqrt))
        });
        // Without information it may be anywhere.
        let (centre, deviation) = estimated.unwrap_or(([0.0; 2], self.anywhere));
        Found {
            press: index,
            radius_seen: true,
            error: [0, 1].map(|axis| centre[axis] - press.place[axis]),
            deviation,
            inside: place.map(|place| place.distance(press.place) <= ELLIPSE_95),
            learned: place.is_some_and(|place| place.method == Method::Trained),
        }
    }
}

/// Factor on `model` with the least squares to `values`.
fn ratio(values: &[f64], model: &[f64]) -> f64 {
    dot(values, model) / dot(model, model)
}

fn over(forces: &[f64], gains: &[f64]) -> Vec<f64> {
    forces.iter().zip(gains).map(|(f, g)| f / g).collect()
}
