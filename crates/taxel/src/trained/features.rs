//! Features of a frame and of the frames before it: what a map of the force is linear in.
//!
//! The tared channels over their scale are x; u are their components along the directions in which the
//! frames of training vary most. A skin may answer by its channels one by one, by monotone functions of
//! each, by sums over all channels, by products, and with a memory: each is a [`Block`], and which blocks
//! a map takes is decided by what predicts runs that it has not seen. The features follow the stream of
//! frames, so training and live use do the same.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use taxel_numerics::dense::long_dot;

use super::memory::Memory;
use super::{Standard, TrainingError};

/// Channels beyond which a frame is taken along its directions only.
const MOST_CHANNELS_EACH: usize = 400;
/// Channels beyond which powers are those of components along directions.
const MOST_POWERS: usize = 66;
/// Components whose powers are taken then.
const POWERS: usize = 40;
/// Components whose products of two are features, and of three; of the few largest products of two are a block
/// of their own.
const SQUARES: usize = 10;
const CUBES: usize = 4;
/// Components that have a memory.
pub const SLOW: usize = 16;
/// The few largest, of which it is multiplied.
const SLOW_FACTORS: usize = 3;
/// Monotone functions whose sums over the channels are features.
pub const SUMS: usize = 6;
/// A reading at this many times the largest of training would be infinite of a channel that saturates.
const SATURATES: [f64; 2] = [1.02, 1.3];
/// Times whose part that recovers is a feature of its own: a body may load and unload otherwise.
const RECOVERING: usize = 3;
/// Lengths of the kernels over the median distance of their centres.
const LENGTHS: [f64; 2] = [0.6, 0.25];

/// Features that are taken together or not at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// The channels.
    Channels,
    /// The root, the square and the cube of each, with its sign.
    Powers,
    /// Sums over the channels of functions that rise.
    Sums,
    /// Products of two and of three of more components.
    Products,
    /// What the sums did lately.
    SlowSums,
    /// What the components did lately.
    Slow,
    /// Products of components with what they did lately.
    SlowProducts,
    /// Kernels of frames that differ broadly.
    Broad,
    /// Kernels of frames that differ little.
    Sharp,
}

impl Block {
    /// All of them in the order of the features.
    pub const ALL: [Self; 9] = [
        Self::Channels,
        Self::Powers,
        Self::Sums,
        Self::Products,
        Self::SlowSums,
        Self::Slow,
        Self::SlowProducts,
        Self::Broad,
        Self::Sharp,
    ];

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Channels => "channels",
            Self::Powers => "powers",
            Self::Sums => "sums",
            Self::Products => "products",
            Self::SlowSums => "memory of sums",
            Self::Slow => "memory",
            Self::SlowProducts => "products with memory",
            Self::Broad => "broad kernels",
            Self::Sharp => "sharp kernels",
        }
    }
}

/// Scales, directions and centres of the features; readings settle them, never a force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureLaw {
    /// Scale of each channel in use over the one that is common to all in sums.
    pub relative: Vec<f64>,
    /// Largest reading of training over the common scale.
    pub most: f64,
    /// Unit vectors in the scaled channels along which frames vary, the most first.
    pub directions: Vec<Vec<f64>>,
    /// How many of them are components u.
    pub components: usize,
    /// Root mean square of the first component before it is divided by it.
    pub size: f64,
    /// Root mean square of each sum.
    pub tops: Vec<f64>,
    /// Times of the memory, s; the first is that of the sums alone.
    pub times: Vec<f64>,
    /// Root mean square of what components did lately, then of what the sums did.
    pub slow_spread: Vec<f64>,
    /// Centres of the kernels, in components.
    pub centres: Vec<Vec<f64>>,
    /// Median distance of two of them.
    pub length: f64,
}

impl FeatureLaw {
    fn width(&self) -> usize {
        self.relative.len()
    }

    fn slow(&self) -> usize {
        self.components.min(SLOW)
    }

    fn powers(&self) -> usize {
        match self.width() {
            width if width <= MOST_POWERS => width,
            _ => self.directions.len().min(POWERS),
        }
    }

    /// Number of features of a block.
    pub fn count(&self, block: Block) -> usize {
        let times = self.times.len();
        let components = self.components;
        match block {
            Block::Channels if self.width() <= MOST_CHANNELS_EACH => self.width(),
            Block::Channels => self.directions.len(),
            Block::Powers => 3 * self.powers(),
            Block::Sums => SUMS,
            Block::Products => {
                let (n, m) = (components.min(SQUARES), components.min(CUBES));
                n * (n + 1) / 2 + m * (m + 1) * (m + 2) / 6
            }
            Block::SlowSums => SUMS * (times + times.min(RECOVERING)),
            Block::Slow => (times - 1) * self.slow(),
            Block::SlowProducts => {
                self.multiplied().count() * components.min(SLOW_FACTORS) * self.slow_factors()
            }
            Block::Broad | Block::Sharp => self.centres.len(),
        }
    }

    /// Times of the memory of components that is multiplied: every other one.
    fn multiplied(&self) -> impl Iterator<Item = usize> + use<> {
        (0..self.times.len() - 1).step_by(2)
    }

    fn slow_factors(&self) -> usize {
        self.slow().min(SLOW_FACTORS)
    }

    /// Number of features of the memory that a block has for each of its times; none if it is none of it.
    pub fn memory(&self, block: Block) -> Option<usize> {
        match block {
            Block::SlowSums => Some(SUMS),
            Block::Slow => Some(self.slow()),
            Block::SlowProducts => Some(self.components.min(SLOW_FACTORS) * self.slow_factors()),
            _ => None,
        }
    }

    /// Where a block lies among the features.
    pub fn range(&self, block: Block) -> Range<usize> {
        let before = Block::ALL.iter().take_while(|other| **other != block);
        let start = before.map(|other| self.count(*other)).sum();
        start..start + self.count(block)
    }

    /// Number of features.
    pub fn len(&self) -> usize {
        Block::ALL.iter().map(|block| self.count(*block)).sum()
    }

    /// True without features; no law is.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Checks that the parts of a law from a file belong together.
    pub(super) fn is_sound(&self, width: usize) -> bool {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let positive = |values: &[f64]| values.iter().all(|v| *v > 0.0 && v.is_finite());
        let rows = |rows: &[Vec<f64>], width: usize| {
            rows.iter().all(|row| row.len() == width && finite(row))
        };
        self.relative.len() == width
            && positive(&self.relative)
            && positive(&[self.most, self.size, self.length])
            && (1..=self.directions.len()).contains(&self.components)
            && rows(&self.directions, width)
            && self.tops.len() == SUMS
            && positive(&self.tops)
            && !self.times.is_empty()
            && positive(&self.times)
            && !self.centres.is_empty()
            && rows(&self.centres, self.components)
            && self.slow_spread.len()
                == (self.times.len() - 1) * self.slow() + self.times.len() * SUMS
            && self.slow_spread.iter().all(|s| *s >= 0.0 && s.is_finite())
    }

    /// Components of the scaled channels.
    pub fn along(&self, x: &[f64]) -> Vec<f64> {
        let directions = self.directions[..self.components].iter();
        directions.map(|d| long_dot(d, x) / self.size).collect()
    }

    /// Square of the distance of components from the nearest centre of the kernels.
    pub fn distance(&self, u: &[f64]) -> f64 {
        self.centres
            .iter()
            .map(|centre| apart(centre, u))
            .fold(f64::INFINITY, f64::min)
    }

    /// The kernel of a frame with the components `u` about a centre.
    pub fn kernel(&self, block: Block, centre: &[f64], u: &[f64]) -> f64 {
        let [broad, sharp] = LENGTHS;
        let length = self.length * if block == Block::Broad { broad } else { sharp };
        (-apart(centre, u) / (2.0 * length * length)).exp()
    }

    /// Sums over the channels of functions that rise with the reading, before they are divided by their tops.
    pub fn sums(&self, x: &[f64]) -> [f64; SUMS] {
        let mut sums = [0.0; SUMS];
        for (x, relative) in x.iter().zip(&self.relative) {
            let y = x * relative;
            sums[0] += y;
            sums[1] += rooted(y)[0];
            // Beyond all readings of training only what is straight or flatter goes on.
            let y = y.clamp(-self.most, self.most);
            let size = y.abs();
            sums[2] += y * size;
            sums[3] += y * y * y;
            for (sum, end) in sums[4..].iter_mut().zip(SATURATES) {
                *sum += y / (end * self.most - size);
            }
        }
        sums
    }

    /// What powers are taken of: the channels, or components of unit length.
    fn bases(&self, x: &[f64]) -> Vec<f64> {
        if self.width() <= MOST_POWERS {
            return x.to_vec();
        }
        let directions = self.directions[..self.powers()].iter();
        directions.map(|d| long_dot(d, x)).collect()
    }

    /// Features of the scaled channels x, in order; `slow` is what components and sums did lately.
    fn write(&self, x: &[f64], state: &State, features: &mut Vec<f64>) {
        features.clear();
        if self.width() <= MOST_CHANNELS_EACH {
            features.extend_from_slice(x);
        } else {
            features.extend(self.directions.iter().map(|d| long_dot(d, x)));
        }
        let bases = self.bases(x);
        features.extend(bases.iter().map(|g| rooted(*g)[0]));
        features.extend(bases.iter().map(|g| g * g.abs() / 3.0));
        features.extend(bases.iter().map(|g| g * g * g / 10.0));
        features.extend(state.sums);
        let u = &state.components;
        let p = &u[..u.len().min(SQUARES)];
        for (i, a) in p.iter().enumerate() {
            features.extend(p[i..].iter().map(|b| a * b));
        }
        let p = &u[..u.len().min(CUBES)];
        for (i, a) in p.iter().enumerate() {
            for (j, b) in p.iter().enumerate().skip(i) {
                features.extend(p[j..].iter().map(|c| a * b * c));
            }
        }
        features.extend_from_slice(&state.slow_sums);
        let recovering = self.times.len().min(RECOVERING) * SUMS;
        features.extend(state.slow_sums[..recovering].iter().map(|m| m.min(0.0)));
        features.extend_from_slice(&state.slow);
        for time in self.multiplied() {
            let slow = &state.slow[time * self.slow()..][..self.slow_factors()];
            for a in &u[..u.len().min(SLOW_FACTORS)] {
                features.extend(slow.iter().map(|m| a * m));
            }
        }
        let distances: Vec<f64> = self.centres.iter().map(|c| apart(c, u)).collect();
        for length in LENGTHS {
            let length = length * self.length;
            features.extend(
                distances
                    .iter()
                    .map(|d| (-d / (2.0 * length * length)).exp()),
            );
        }
    }

    /// Features of a frame by itself: nothing was before it.
    pub fn instant(&self, x: &[f64]) -> Vec<f64> {
        let state = State {
            components: self.along(x),
            sums: self.sums(x),
            slow: vec![0.0; (self.times.len() - 1) * self.slow()],
            slow_sums: vec![0.0; self.times.len() * SUMS],
        };
        let mut features = Vec::with_capacity(self.len());
        self.write(x, &state, &mut features);
        features
    }

    /// By how much Σ wₖ fₖ changes with each scaled channel: with one so slow that the memory has
    /// followed it, and with one that came at once; and with what components and sums did lately.
    fn slopes(&self, x: &[f64], state: &State, weights: &[f64]) -> Slopes {
        let of = |block| &weights[self.range(block)];
        let mut slow = vec![0.0; self.width()];
        let add = |slopes: &mut [f64], direction: &[f64], slope: f64| {
            for (sum, share) in slopes.iter_mut().zip(direction) {
                *sum += slope * share;
            }
        };
        let channels = of(Block::Channels);
        if self.width() <= MOST_CHANNELS_EACH {
            slow.copy_from_slice(channels);
        } else {
            for (direction, weight) in self.directions.iter().zip(channels) {
                add(&mut slow, direction, *weight);
            }
        }
        let bases = self.bases(x);
        let powers = of(Block::Powers);
        for (at, g) in bases.iter().enumerate() {
            let [root, square, cube] = [0, 1, 2].map(|power| powers[power * bases.len() + at]);
            let slope =
                root * rooted(*g)[1] + square * 2.0 * g.abs() / 3.0 + cube * 3.0 * g * g / 10.0;
            if self.width() <= MOST_POWERS {
                slow[at] += slope;
            } else {
                add(&mut slow, &self.directions[at], slope);
            }
        }
        let u = &state.components;
        let mut of_components = vec![0.0; u.len()];
        of_products(of(Block::Products), u, &mut of_components);
        let slow_sums = of(Block::SlowSums);
        let (all, recovering) = slow_sums.split_at(SUMS * self.times.len());
        let mut of_slow_sums = all.to_vec();
        for (at, weight) in recovering.iter().enumerate() {
            of_slow_sums[at] += if state.slow_sums[at] < 0.0 {
                *weight
            } else {
                0.0
            };
        }
        let mut of_slow = of(Block::Slow).to_vec();
        let mut weights_left = of(Block::SlowProducts).iter();
        for time in self.multiplied() {
            for i in 0..u.len().min(SLOW_FACTORS) {
                for j in 0..self.slow_factors() {
                    let weight = weights_left.next().copied().unwrap_or(0.0);
                    let at = time * self.slow() + j;
                    of_components[i] += weight * state.slow[at];
                    of_slow[at] += weight * u[i];
                }
            }
        }
        let kernels = [Block::Broad, Block::Sharp].into_iter().zip(LENGTHS);
        for (block, length) in kernels {
            let square = (length * self.length).powi(2);
            for (centre, weight) in self.centres.iter().zip(of(block)) {
                if *weight == 0.0 {
                    continue;
                }
                let slope = weight * (-apart(centre, u) / (2.0 * square)).exp() / square;
                for ((sum, c), u) in of_components.iter_mut().zip(centre).zip(u) {
                    *sum += slope * (c - u);
                }
            }
        }
        self.spread(&mut slow, x, &of_components, of(Block::Sums));
        // At once the memory changes with what it is of.
        let mut fast = slow.clone();
        let mut components = vec![0.0; u.len()];
        for row in of_slow.chunks(self.slow().max(1)) {
            for (sum, slope) in components.iter_mut().zip(row) {
                *sum += slope;
            }
        }
        let mut sums = [0.0; SUMS];
        for row in of_slow_sums.chunks(SUMS) {
            for ((sum, slope), top) in sums.iter_mut().zip(row).zip(&self.tops) {
                *sum += slope / top;
            }
        }
        self.spread(&mut fast, x, &components, &sums);
        of_slow.extend(of_slow_sums);
        Slopes {
            slow,
            fast,
            memory: of_slow,
        }
    }

    /// Adds to slopes by channel those by component and by sum.
    fn spread(&self, slopes: &mut [f64], x: &[f64], components: &[f64], sums: &[f64]) {
        for (direction, slope) in self.directions.iter().zip(components) {
            for (sum, share) in slopes.iter_mut().zip(direction) {
                *sum += slope * share / self.size;
            }
        }
        for ((slope, x), relative) in slopes.iter_mut().zip(x).zip(&self.relative) {
            let y = x * relative;
            let size = y.abs();
            let mut by = sums[0] + sums[1] * rooted(y)[1];
            if size < self.most {
                by += sums[2] * 2.0 * size + sums[3] * 3.0 * y * y;
                for (weight, end) in sums[4..].iter().zip(SATURATES) {
                    by += weight * end * self.most / (end * self.most - size).powi(2);
                }
            }
            *slope += by * relative;
        }
    }
}

/// Adds to the slopes of the components u those of Σ wₖ uᵢuⱼ and Σ wₖ uᵢuⱼuₖ.
fn of_products(weights: &[f64], u: &[f64], slopes: &mut [f64]) {
    let mut weights_left = weights.iter();
    let mut next = || weights_left.next().copied().unwrap_or(0.0);
    let n = u.len().min(SQUARES);
    for i in 0..n {
        for j in i..n {
            let weight = next();
            slopes[i] += weight * u[j];
            slopes[j] += weight * u[i];
        }
    }
    let n = u.len().min(CUBES);
    for i in 0..n {
        for j in i..n {
            for k in j..n {
                let weight = next();
                slopes[i] += weight * u[j] * u[k];
                slopes[j] += weight * u[i] * u[k];
                slopes[k] += weight * u[i] * u[j];
            }
        }
    }
}

/// A root is straight up to about this reading: nowhere more than twice as steep as the channel, as what drifts at
/// rest would weigh more than what presses.
const STRAIGHT: f64 = 1.0 / 16.0;

/// √|x| with the sign of x, straight near zero, and its slope.
fn rooted(x: f64) -> [f64; 2] {
    let root = (x.abs() + STRAIGHT).sqrt();
    [x.signum() * (root - STRAIGHT.sqrt()), 0.5 / root]
}

/// Square of the distance of two points.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// What features are made of, beside the channels.
#[derive(Debug, Clone, Default)]
struct State {
    components: Vec<f64>,
    sums: [f64; SUMS],
    slow: Vec<f64>,
    slow_sums: Vec<f64>,
}

/// Slopes of a sum of features.
#[derive(Debug, Clone, Default)]
pub(super) struct Slopes {
    /// By channel in use, of a change that memory has followed.
    pub(super) slow: Vec<f64>,
    /// By channel in use, of a change that came at once.
    pub(super) fast: Vec<f64>,
    /// By what components did lately, then sums.
    pub(super) memory: Vec<f64>,
}

/// Features of a stream of frames.
#[derive(Debug, Clone)]
pub struct FeatureStream {
    rest: Vec<f64>,
    x: Vec<f64>,
    state: State,
    memory: Memory,
    memory_of_sums: Memory,
    last: Option<f64>,
    longest_step: f64,
    features: Vec<f64>,
}

impl FeatureStream {
    /// A stream of a device at rest with the readings `rest`; over steps of more than half as much again as
    /// `longest_step`, s, the memory is lost.
    pub fn new(law: &FeatureLaw, rest: Vec<f64>, longest_step: f64) -> Self {
        Self {
            memory: Memory::at_rest(&law.times[1..], law.slow()),
            memory_of_sums: Memory::at_rest(&law.times, SUMS),
            rest,
            x: Vec::new(),
            state: State::default(),
            last: None,
            longest_step,
            features: Vec::new(),
        }
    }

    /// Takes the frame at `time`, s.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing reading; the frame then leaves
    /// no trace.
    pub fn push(
        &mut self,
        (standard, law): (&Standard, &FeatureLaw),
        time: f64,
        frame: &[f64],
    ) -> Result<(), TrainingError> {
        let tared: Vec<f64> = frame.iter().zip(&self.rest).map(|(x, b)| x - b).collect();
        self.x = standard.apply(&tared)?;
        if self
            .last
            .is_some_and(|last| time - last > 1.5 * self.longest_step)
        {
            self.memory.forget();
            self.memory_of_sums.forget();
        }
        self.last = Some(time);
        let state = &mut self.state;
        state.components = law.along(&self.x);
        state.sums = law.sums(&self.x);
        state.slow.clear();
        self.memory
            .push(time, &state.components[..law.slow()], &mut state.slow);
        let sums: Vec<f64> = state
            .sums
            .iter()
            .zip(&law.tops)
            .map(|(s, top)| s / top)
            .collect();
        state.slow_sums.clear();
        self.memory_of_sums.push(time, &sums, &mut state.slow_sums);
        law.write(&self.x, &self.state, &mut self.features);
        Ok(())
    }

    /// Features of the last frame; none before the first.
    pub fn features(&self) -> &[f64] {
        &self.features
    }

    /// Components of the last frame.
    pub fn components(&self) -> &[f64] {
        &self.state.components
    }

    /// What components did lately, then sums, as of the last frame.
    pub fn slow(&self) -> impl Iterator<Item = f64> + '_ {
        let state = &self.state;
        state.slow.iter().chain(&state.slow_sums).copied()
    }

    /// Root sum square of the scaled channels of the last frame.
    pub fn size(&self) -> f64 {
        self.x.iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Root sum square of what the memory of the components holds, for each of its times.
    pub fn slow_sizes(&self) -> impl Iterator<Item = f64> + '_ {
        self.memory.slow_sizes()
    }

    pub(super) fn slopes(&self, law: &FeatureLaw, weights: &[f64]) -> Slopes {
        if self.features.is_empty() {
            return Slopes::default();
        }
        law.slopes(&self.x, &self.state, weights)
    }

    /// Deviation of what components and sums did lately because the past is not known; none if it is.
    pub(super) fn unknown(&self, law: &FeatureLaw) -> Option<Vec<f64>> {
        let shares = self.memory.unknown().chain(self.memory_of_sums.unknown());
        let shares: Vec<f64> = shares.collect();
        let some = shares.iter().any(|share| *share > 0.0);
        some.then(|| {
            shares
                .iter()
                .zip(&law.slow_spread)
                .map(|(u, s)| u * s)
                .collect()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_numerics::Noise;
    use taxel_numerics::dense::dot;

    fn law(width: usize, noise: &mut Noise) -> FeatureLaw {
        let mut vector = |n: usize| -> Vec<f64> { (0..n).map(|_| noise.normal()).collect() };
        let components = width.min(5);
        let times = vec![0.05, 1.0, 10.0, 100.0];
        let directions: Vec<Vec<f64>> = (0..width.min(48)).map(|_| vector(width)).collect();
        FeatureLaw {
            relative: vec![1.1; width],
            most: 6.0,
            components,
            size: 2.0,
            tops: vec![2.0; SUMS],
            slow_spread: vec![1.0; 3 * components + 4 * SUMS],
            centres: (0..9).map(|_| vector(components)).collect(),
            length: 1.5,
            times,
            directions,
        }
    }

    /// Beyond all readings of training the sums that rise faster than a reading stay, so that one harder press on a
    /// channel is no more than a straight line makes of it.
    #[test]
    fn beyond_training_sums_rise_no_faster_than_a_reading() {
        let law = law(4, &mut Noise::seeded(4));
        let at = |x: f64| law.sums(&[x, 0.0, 0.0, 0.0]);
        let end = law.most / law.relative[0];
        for factor in [1.0, 1.5, 30.0] {
            let (found, last) = (at(factor * end), at(end));
            assert!((found[0] / last[0] - factor).abs() < 1e-12, "{factor}");
            assert!(found[1] <= factor * last[1]);
            assert_eq!(found[2..], last[2..], "{factor}");
        }
    }

    /// Slopes are the differences of the sum of the features, with the memory that stays and with one that
    /// comes along, of few channels and of so many that they are taken along directions.
    #[test]
    fn slopes_are_those_of_the_sum() {
        let mut noise = Noise::seeded(3);
        // The first reading within those of training, and beyond.
        for (width, first) in [(4, 0.3), (70, 0.3), (410, 0.3), (4, 7.0), (70, -7.0)] {
            let law = law(width, &mut noise);
            assert!(law.is_sound(width));
            let mut vector =
                |n: usize| -> Vec<f64> { (0..n).map(|_| 0.3 * noise.normal()).collect() };
            let mut x = vector(width);
            x[0] = first;
            let weights = vector(law.len());
            let slow = vector(3 * law.slow());
            let slow_sums = vector(4 * SUMS);
            // `along`: by how much the memory follows what it is of.
            let sum = |x: &[f64], along: f64, from: &[f64]| {
                let (components, sums) = (law.along(x), law.sums(x));
                let (before, sums_before) = (law.along(from), law.sums(from));
                let state = State {
                    slow: (0..slow.len())
                        .map(|k| {
                            let at = k % law.slow();
                            slow[k] + along * (components[at] - before[at])
                        })
                        .collect(),
                    slow_sums: (0..slow_sums.len())
                        .map(|k| {
                            let at = k % SUMS;
                            slow_sums[k] + along * (sums[at] - sums_before[at]) / law.tops[at]
                        })
                        .collect(),
                    components,
                    sums,
                };
                let mut features = Vec::new();
                law.write(x, &state, &mut features);
                assert_eq!(features.len(), law.len());
                (dot(&features, &weights), state)
            };
            let (_, state) = sum(&x, 0.0, &x);
            let slopes = law.slopes(&x, &state, &weights);
            for at in [0, 1, width - 1] {
                for (along, slope) in [(0.0, &slopes.slow), (1.0, &slopes.fast)] {
                    let moved = |step: f64| {
                        let mut moved = x.clone();
                        moved[at] += step;
                        sum(&moved, along, &x).0
                    };
                    let step = 1e-5;
                    let expected = (moved(step) - moved(-step)) / (2.0 * step);
                    // The square of the step times third derivatives, and rounding over the step.
                    let error = (slope[at] - expected).abs();
                    assert!(
                        error < 1e-5 * (1.0 + expected.abs()),
                        "{width} {at} {along}: {expected} {}",
                        slope[at]
                    );
                }
            }
        }
    }
}
