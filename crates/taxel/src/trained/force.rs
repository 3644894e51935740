//! Channels to forces, with the memory of the body.
//!
//! A force is the mean of several maps from simple to rich, each linear in some of the features of the
//! stream of frames ([`FeatureLaw`]), with the shares that best predict what was held out. Where they
//! disagree little is known, and the deviation says so.

use serde::{Deserialize, Serialize};
use taxel_numerics::dense::long_dot;

use super::features::Slopes;
use super::{
    Block, Estimate, FeatureLaw, FeatureStream, SURELY, Standard, Support, TrainingError, USUAL,
};

/// What a map errs by is known, from frames that were held out, up to this share of the distance from
/// which on a frame is outside.
const FARTHEST: f64 = 0.5;

/// Touches like those of training let a body creep by up to this much more in hours than in the
/// minutes of training.
const BY_CHANCE: f64 = 1.5;

/// Deviation of an estimate within its run: it grows with the size of the estimate and with what the maps
/// differ by.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorLaw {
    /// At zero of maps that agree, SI.
    pub constant: f64,
    /// Per size of the estimate.
    pub of_size: f64,
    /// Per deviation of the maps from their mean.
    pub of_difference: f64,
}

impl ErrorLaw {
    /// The deviation of an estimate of maps that differ by `difference`, SI.
    pub fn at(&self, estimate: f64, difference: f64) -> f64 {
        self.constant + self.of_size * estimate.abs() + self.of_difference * difference
    }

    /// The law of deviations `factor` times as large.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            constant: factor * self.constant,
            of_size: factor * self.of_size,
            of_difference: factor * self.of_difference,
        }
    }
}

/// Difference of the force of one run from that of others under one map: deviations of which 1.96
/// hold 95 %, with Student's factor of few runs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BetweenRuns {
    /// Deviation of an offset, N.
    pub offset: f64,
    /// Relative deviation of the gain.
    pub gain: f64,
    /// Runs that both were estimated from; with one they are the usual ones of soft
    /// bodies.
    pub runs: usize,
}

impl BetweenRuns {
    /// Deviation at a force, N.
    pub fn at(&self, force: f64) -> f64 {
        self.offset.hypot(self.gain * force)
    }
}

/// A component of force or moment beside the pressing force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// Force along x, N.
    ForceX,
    /// Force along y, N.
    ForceY,
    /// Moment about x, N m.
    MomentX,
    /// Moment about y, N m.
    MomentY,
    /// Moment about z, N m.
    MomentZ,
}

impl Component {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::ForceX,
        Self::ForceY,
        Self::MomentX,
        Self::MomentY,
        Self::MomentZ,
    ];

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::ForceX => "force_x",
            Self::ForceY => "force_y",
            Self::MomentX => "moment_x",
            Self::MomentY => "moment_y",
            Self::MomentZ => "moment_z",
        }
    }

    /// SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::ForceX | Self::ForceY => "N",
            _ => "N m",
        }
    }
}

/// One of the maps of a force: a sum of the features of some blocks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MemberMap {
    /// Its share in the estimate.
    pub share: f64,
    /// Blocks of features that it takes.
    pub blocks: Vec<Block>,
    /// Estimate where all features are zero, SI.
    pub constant: f64,
    /// Weights of the features of its blocks, one after the other.
    pub weights: Vec<f64>,
}

impl MemberMap {
    /// Its estimate for all features of a frame, SI.
    pub fn estimate(&self, law: &FeatureLaw, features: &[f64]) -> f64 {
        let mut weights = &self.weights[..];
        let mut sum = self.constant;
        for block in &self.blocks {
            let features = &features[law.range(*block)];
            let (own, others) = weights.split_at(features.len());
            sum += long_dot(own, features);
            weights = others;
        }
        sum
    }
}

impl MemberMap {
    pub(super) fn is_sound(&self, law: &FeatureLaw) -> bool {
        let count: usize = self.blocks.iter().map(|block| law.count(*block)).sum();
        let mut blocks = self.blocks.clone();
        blocks.dedup();
        self.weights.len() == count
            && blocks.len() == self.blocks.len()
            && self.weights.iter().all(|weight| weight.is_finite())
            && self.constant.is_finite()
            && self.share >= 0.0
            && self.share.is_finite()
    }
}

/// The map of a force or of a component of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MixedMap {
    /// Maps with shares that sum to one.
    pub members: Vec<MemberMap>,
    /// Deviation within a run, of which 1.96 hold 95 % of what was held out.
    pub error: ErrorLaw,
    /// Differences between runs.
    pub between_runs: BetweenRuns,
    /// Least and largest value of training, SI.
    pub range: [f64; 2],
}

impl MixedMap {
    /// Estimate for all features of a frame, and the deviation of the maps from their mean, SI.
    pub fn estimate(&self, law: &FeatureLaw, features: &[f64]) -> [f64; 2] {
        let (mut sum, mut mean, mut square) = (0.0, 0.0, 0.0);
        for (count, member) in (1..).zip(&self.members) {
            let value = member.estimate(law, features);
            sum += member.share * value;
            let off = value - mean;
            mean += off / f64::from(count);
            square += off * (value - mean);
        }
        let count = self.members.len().max(1) as f64;
        [sum, (square / count).sqrt()]
    }

    /// Deviation of an estimate of maps that differ by `difference`, SI.
    pub fn deviation(&self, estimate: f64, difference: f64) -> f64 {
        self.error
            .at(estimate, difference)
            .hypot(self.between_runs.at(estimate))
    }

    /// Weight of every feature in the estimate.
    fn weights(&self, law: &FeatureLaw) -> Vec<f64> {
        let mut sums = vec![0.0; law.len()];
        for member in &self.members {
            let mut weights = member.weights.iter();
            for block in &member.blocks {
                for (sum, weight) in sums[law.range(*block)].iter_mut().zip(&mut weights) {
                    *sum += member.share * weight;
                }
            }
        }
        sums
    }

    fn is_sound(&self, law: &FeatureLaw) -> bool {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let positive = |values: &[f64]| finite(values) && values.iter().all(|value| *value >= 0.0);
        let ErrorLaw {
            constant,
            of_size,
            of_difference,
        } = self.error;
        !self.members.is_empty()
            && self.members.iter().all(|member| member.is_sound(law))
            && positive(&[constant, of_size, of_difference])
            && positive(&[self.between_runs.offset, self.between_runs.gain])
            && finite(&self.range)
    }
}

/// Map of another component than the pressing force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComponentMap {
    /// The component.
    pub component: Component,
    /// Its map, of the same features.
    pub map: MixedMap,
}

/// A trained map from channels to force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceMap {
    /// Channels and their scale; the centre is that of the rest and stays zero.
    pub standard: Standard,
    /// Features of all maps.
    pub law: FeatureLaw,
    /// The pressing force, N.
    pub pressing: MixedMap,
    /// Square of the distance of the components from the nearest centre of the kernels, above which a frame is
    /// unlike those of training.
    pub farthest: f64,
    /// For each time of the memory the largest of what it held over training.
    pub slow_reach: Vec<f64>,
    /// Longest step between frames over which memory is kept, s.
    pub longest_step: f64,
    /// By how much the scale of training came after the sensor, s.
    pub offset: f64,
    /// Maps of other components, of the same features.
    #[serde(default)]
    pub components: Vec<ComponentMap>,
}

impl ForceMap {
    /// Checks that the parts of a map from a file belong together.
    pub(super) fn check(&self) -> Result<(), TrainingError> {
        let sound = |least: f64| move |value: &f64| *value >= least && value.is_finite();
        let (law, width) = (&self.law, self.standard.used.len());
        if !self.standard.is_sound() {
            return Err(TrainingError::Unsound { table: "standard" });
        }
        if !law.is_sound(width) {
            return Err(TrainingError::Unsound { table: "law" });
        }
        for (sound, table) in [
            (self.pressing.is_sound(law), "pressing"),
            (self.farthest > 0.0, "farthest"),
            (
                self.slow_reach.len() + 1 == law.times.len()
                    && self.slow_reach.iter().all(sound(0.0)),
                "slow_reach",
            ),
            (sound(0.0)(&self.longest_step), "longest_step"),
            (self.offset.is_finite(), "offset"),
            (
                self.components.iter().all(|one| one.map.is_sound(law)),
                "components",
            ),
        ] {
            if !sound {
                return Err(TrainingError::Unsound { table });
            }
        }
        Ok(())
    }

    /// The map of the pressing force, then those of the other components.
    fn maps(&self) -> impl Iterator<Item = &MixedMap> {
        let others = self.components.iter().map(|one| &one.map);
        std::iter::once(&self.pressing).chain(others)
    }
}

/// By how much an estimate changes with the reading of a channel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ChannelSlope {
    /// With one that came so slowly that creep has followed it.
    pub slow: f64,
    /// With one that came at once.
    pub fast: f64,
}

/// What estimates may be off by because a frame is unlike those of training.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BeyondTraining {
    /// Standard deviations beside those stated: of the pressing force, then of each other component, SI.
    pub deviations: Vec<f64>,
    /// True if an estimate is beyond all of training by more than chance.
    pub surely: bool,
    /// True if it is the pressing force, and greater.
    pub pressed_harder: bool,
}

/// Frames to forces, in real time.
#[derive(Debug, Clone)]
pub struct ForceEstimator {
    map: ForceMap,
    stream: FeatureStream,
    /// Weights of the features in the estimate of each map.
    weights: Vec<Vec<f64>>,
    /// Estimates of the last frame as the maps give them, with what their members differ by.
    found: Vec<[f64; 2]>,
    /// Square of the distance of the last frame.
    distance: f64,
}

impl ForceEstimator {
    /// An estimator for a device that rests, with its readings `rest`.
    ///
    /// # Errors
    /// [`TrainingError`] for readings at rest of another length or with a missing
    /// one, or for a map that was changed by hand.
    pub fn new(map: ForceMap, rest: Vec<f64>) -> Result<Self, TrainingError> {
        map.check()?;
        map.standard.apply(&rest)?;
        Ok(Self {
            stream: FeatureStream::new(&map.law, rest, map.longest_step),
            weights: map.maps().map(|one| one.weights(&map.law)).collect(),
            found: Vec::new(),
            distance: 0.0,
            map,
        })
    }

    /// Takes the frame at `time` (s) and estimates the force.
    ///
    /// After an outage the memory is unknown, and the deviation says so until
    /// it has faded.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing
    /// reading; the frame then leaves no trace.
    pub fn push(&mut self, time: f64, frame: &[f64]) -> Result<Estimate, TrainingError> {
        let map = &self.map;
        self.stream.push((&map.standard, &map.law), time, frame)?;
        let features = self.stream.features();
        self.found.clear();
        self.found
            .extend(map.maps().map(|one| one.estimate(&map.law, features)));
        self.distance = map.law.distance(self.stream.components());
        let [value, difference] = self.found[0];
        // A scale that never showed less than zero will not do so now.
        let value = value.max(map.pressing.range[0]);
        let mut deviation = map.pressing.deviation(value, difference);
        if let Some(unknown) = self.stream.unknown(&map.law) {
            let memory = self.stream.slopes(&map.law, &self.weights[0]).memory;
            let terms = unknown.iter().zip(memory).map(|(u, w)| (u * w).powi(2));
            deviation = deviation.hypot(terms.sum::<f64>().sqrt());
        }
        Ok(Estimate {
            value,
            deviation,
            support: if self.distance > map.farthest {
                Support::Outside
            } else {
                Support::Trained
            },
        })
    }

    /// The other components of the last frame, each with its standard deviation, SI.
    pub fn components(&self) -> Vec<(Component, [f64; 2])> {
        let found = self.found.iter().skip(1);
        let maps = self.map.components.iter().zip(found);
        let estimate = |(one, [value, difference]): (&ComponentMap, &[f64; 2])| {
            let deviation = one.map.deviation(*value, *difference);
            (one.component, [*value, deviation])
        };
        maps.map(estimate).collect()
    }

    /// By how much the maps of the last estimate, then of each other component, differ, SI.
    pub fn differences(&self) -> impl Iterator<Item = f64> + '_ {
        self.found.iter().map(|[_, difference]| *difference)
    }

    /// The last estimate as the map gives it, also where it is less than any force of training, N.
    pub fn unbounded(&self) -> f64 {
        self.found.first().map_or(f64::NAN, |[value, _]| *value)
    }

    /// By how much the last estimate, then each other component, changes with the reading of each
    /// channel, SI per unit of a reading.
    pub fn slopes(&self) -> impl Iterator<Item = Vec<ChannelSlope>> + '_ {
        self.weights.iter().map(|weights| self.slopes_of(weights))
    }

    fn slopes_of(&self, weights: &[f64]) -> Vec<ChannelSlope> {
        let standard = &self.map.standard;
        let mut found = vec![ChannelSlope::default(); standard.channels];
        let Slopes { slow, fast, .. } = self.stream.slopes(&self.map.law, weights);
        let used = standard.used.iter().zip(&standard.scale);
        for ((channel, scale), (slow, fast)) in used.zip(slow.iter().zip(&fast)) {
            found[*channel] = ChannelSlope {
                slow: slow / scale,
                fast: fast / scale,
            };
        }
        found
    }

    /// What the last estimate, then each other component, may be off by beyond its deviation because
    /// the frame is unlike those of training.
    ///
    /// `unexplained` is the size of a change of the channels over their scale that no frame of training
    /// explains; it counts as if it lay in the direction in which the estimate changes most, or as much as all of
    /// the frame. Farther
    /// from the frames of training than any that was held out a map errs by what it does not know of the
    /// body, which grows with the square of the distance. After contacts so long that the body has crept
    /// clearly more than ever in training it errs by as many of its deviations as the creep is greater.
    /// Nothing of this is off by more than the range of the forces of training and what the estimate is
    /// beyond it, times the distance, or as much in proportion. An estimate beyond all of training is off
    /// by the square of what is beyond over the range, or by all of it. `estimates` are those of the
    /// frame, as the map gives them, with their deviations; `slopes` gives [`slopes`](Self::slopes), if
    /// they are needed.
    pub fn beyond_training<'a>(
        &self,
        unexplained: f64,
        estimates: &[[f64; 2]],
        slopes: impl FnOnce() -> &'a [Vec<ChannelSlope>],
    ) -> BeyondTraining {
        let map = &self.map;
        let mut beyond = BeyondTraining {
            deviations: vec![0.0; self.weights.len()],
            ..BeyondTraining::default()
        };
        if self.found.is_empty() {
            return beyond;
        }
        let farther = (self.distance / (FARTHEST * map.farthest)).max(1.0);
        let slow = self.stream.slow_sizes().zip(&map.slow_reach);
        let slow = slow.filter(|(_, reach)| **reach > 0.0);
        let crept = slow.fold(BY_CHANCE, |most: f64, (size, reach)| most.max(size / reach));
        let distance = (farther * farther - 1.0).sqrt();
        let distance = distance.hypot((crept * crept - BY_CHANCE * BY_CHANCE).sqrt());
        if unexplained > 0.0 || distance > 0.0 {
            let standard = &map.standard;
            let all = map.maps().zip(&self.found).zip(slopes());
            let found = all.map(|((one, [value, difference]), slopes)| {
                let used = standard.used.iter().zip(&standard.scale);
                let squares = used.map(|(channel, scale)| (slopes[*channel].fast * scale).powi(2));
                // A map that was trained along few directions may be flat across them.
                let along = (value / self.stream.size().max(f64::MIN_POSITIVE)).abs();
                let of_channels = unexplained * squares.sum::<f64>().sqrt().max(along);
                let own = one.error.at(*value, *difference).hypot(*difference);
                of_channels.hypot(distance * own)
            });
            beyond.deviations = found.collect();
            let [low, high] = map.pressing.range;
            let value = estimates.first().map_or(low, |[value, _]| *value);
            let reach = (high.max(value) - low.min(value)) * farther.sqrt();
            let share = (reach / beyond.deviations[0]).min(1.0);
            beyond.deviations.iter_mut().for_each(|own| *own *= share);
        }
        let far = self.distance > map.farthest;
        let all = beyond.deviations.iter_mut().zip(map.maps()).zip(estimates);
        for (number, ((own, one), [value, deviation])) in all.enumerate() {
            let [low, high] = one.range;
            let excess = (value - high).max(low - value);
            if excess > USUAL * deviation {
                *own = own.hypot(excess * (excess / (high - low)).min(1.0));
            }
            let surely = excess > SURELY * deviation;
            beyond.pressed_harder |= surely && number == 0 && *value > high;
            // Neither the frame nor its estimate is one of training, or the interval is wider than all of it.
            let wide = USUAL * deviation.hypot(*own) > high - low;
            beyond.surely |= surely || far && (excess > 0.0 || wide);
        }
        beyond
    }

    /// The map.
    pub fn map(&self) -> &ForceMap {
        &self.map
    }
}
