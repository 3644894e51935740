//! Channels to the place of a contact by a mixture of maps of their pattern.
//!
//! Where a body presses shows in the pattern of the readings, how hard in their size: features are those of the
//! tared channels over their size, as they are and as they changed lately (a body that creeps still shows the
//! last place). Beside the maps stands the mean of the nearest patterns of training.

use serde::{Deserialize, Serialize};
use taxel_numerics::dense::long_dot;

use super::memory::Memory;
use super::{ErrorLaw, FeatureLaw, MemberMap, PositionEstimate, Standard, Support, TrainingError};

/// Times over which the pattern of what changed lately is taken, s.
const LATELY: [f64; 2] = [1.0, 4.0];
/// Size of the scaled readings below which a pattern fades: a reading of rest has none.
const FADES: f64 = 0.3;
/// The logarithm of the size beside the pattern.
const OF_SIZE: f64 = 0.3;
/// Nearest patterns that are averaged, and the square of a distance that counts as none.
const NEIGHBOURS: usize = 5;
const NO_DISTANCE: f64 = 1e-4;

/// Patterns of a stream of frames.
#[derive(Debug, Clone)]
pub struct PatternStream {
    rest: Vec<f64>,
    memory: Memory,
    longest_step: f64,
    last: Option<f64>,
    /// The pattern, and with it those of what changed lately.
    patterns: [Vec<f64>; 2],
    size: f64,
}

impl PatternStream {
    /// A stream of a device at rest with the readings `rest`; over steps of more than half as much again as
    /// `longest_step`, s, the memory is lost.
    pub fn new(standard: &Standard, rest: Vec<f64>, longest_step: f64) -> Self {
        Self {
            memory: Memory::at_rest(&LATELY, standard.used.len()),
            rest,
            longest_step,
            last: None,
            patterns: [Vec::new(), Vec::new()],
            size: 0.0,
        }
    }

    /// Takes the frame at `time`, s.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing reading; the frame then leaves
    /// no trace.
    pub fn push(
        &mut self,
        standard: &Standard,
        time: f64,
        frame: &[f64],
    ) -> Result<(), TrainingError> {
        let tared: Vec<f64> = frame.iter().zip(&self.rest).map(|(x, b)| x - b).collect();
        let x = standard.apply(&tared)?;
        if self
            .last
            .is_some_and(|last| time - last > 1.5 * self.longest_step)
        {
            self.memory.forget();
        }
        self.last = Some(time);
        let mut lately = Vec::new();
        self.memory.push(time, &x, &mut lately);
        let [own, both] = &mut self.patterns;
        own.clear();
        self.size = append(&x, own);
        both.clone_from(own);
        for part in lately.chunks(x.len().max(1)) {
            append(part, both);
        }
        Ok(())
    }

    /// The pattern of the last frame, and the same with those of what changed lately.
    pub fn patterns(&self) -> &[Vec<f64>; 2] {
        &self.patterns
    }

    /// Size of the scaled readings of the last frame.
    pub fn size(&self) -> f64 {
        self.size
    }
}

/// Appends the readings over their size, and its logarithm; returns the size.
fn append(x: &[f64], pattern: &mut Vec<f64>) -> f64 {
    let size = x.iter().map(|x| x * x).sum::<f64>().sqrt() + FADES;
    pattern.extend(x.iter().map(|x| x / size));
    pattern.push(OF_SIZE * size.ln());
    size
}

/// Patterns of training with their places.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NearestPatterns {
    /// Patterns along the directions of their law.
    pub patterns: Vec<Vec<f64>>,
    /// Their places, m.
    pub places: Vec<[f64; 2]>,
}

impl NearestPatterns {
    /// Mean place of the nearest ones of a pattern along the directions, m.
    pub fn place(&self, pattern: &[f64]) -> [f64; 2] {
        let mut nearest: Vec<(f64, usize)> = Vec::with_capacity(NEIGHBOURS + 1);
        for (at, own) in self.patterns.iter().enumerate() {
            let square: f64 = own
                .iter()
                .zip(pattern)
                .map(|(a, b)| (a - b) * (a - b))
                .sum();
            if nearest.len() == NEIGHBOURS && nearest[NEIGHBOURS - 1].0 <= square {
                continue;
            }
            let place = nearest.partition_point(|(other, _)| *other <= square);
            nearest.insert(place, (square, at));
            nearest.truncate(NEIGHBOURS);
        }
        let (mut sums, mut weights) = ([0.0; 2], 0.0);
        for (square, at) in nearest {
            let weight = 1.0 / (square + NO_DISTANCE);
            weights += weight;
            for (sum, place) in sums.iter_mut().zip(self.places[at]) {
                *sum += weight * place;
            }
        }
        sums.map(|sum| sum / weights)
    }
}

/// A map of one coordinate, of the features of the pattern (0) or of that with what changed lately (1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatternMap {
    /// Which features it takes.
    pub law: usize,
    /// The map.
    pub map: MemberMap,
}

/// One coordinate of a place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisMap {
    /// Maps with their shares.
    pub members: Vec<PatternMap>,
    /// Share of the nearest patterns.
    pub nearest: f64,
    /// Deviation, m; instead of the size of the estimate it grows with one over that of the readings.
    pub error: ErrorLaw,
    /// Least and largest coordinate of training, m.
    pub range: [f64; 2],
}

/// A trained map from channels to the place of a contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaceMap {
    /// Channels and their scale; the centre is that of the rest and stays zero.
    pub standard: Standard,
    /// Features of the pattern, and of that with what changed lately.
    pub laws: [FeatureLaw; 2],
    /// Patterns of training.
    pub nearest: NearestPatterns,
    /// x and y.
    pub axes: [AxisMap; 2],
    /// Root mean square of each component of the pattern over training.
    pub spread: Vec<f64>,
    /// Square of the distance of the components from zero, each over its spread, above which a pattern is
    /// unlike those of training.
    pub farthest: f64,
    /// Longest step between frames over which memory is kept, s.
    pub longest_step: f64,
}

impl PlaceMap {
    /// Checks that the parts of a map from a file belong together.
    pub(super) fn check(&self) -> Result<(), TrainingError> {
        let width = self.standard.used.len();
        let [own, both] = &self.laws;
        let wide = (1 + LATELY.len()) * (width + 1);
        let positive = |values: &[f64]| values.iter().all(|v| *v > 0.0 && v.is_finite());
        let axis = |axis: &AxisMap| {
            let member = |one: &PatternMap| {
                self.laws
                    .get(one.law)
                    .is_some_and(|law| one.map.is_sound(law))
            };
            let ErrorLaw {
                constant,
                of_size,
                of_difference,
            } = axis.error;
            let numbers = [constant, of_size, of_difference, axis.nearest];
            axis.members.iter().all(member)
                && numbers.iter().all(|v| *v >= 0.0 && v.is_finite())
                && axis.range.iter().all(|v| v.is_finite())
        };
        let nearest = &self.nearest;
        let pattern =
            |row: &Vec<f64>| row.len() == own.directions.len() && row.iter().all(|x| x.is_finite());
        for (sound, table) in [
            (self.standard.is_sound(), "place.standard"),
            (own.is_sound(width + 1) && both.is_sound(wide), "place.laws"),
            (self.axes.iter().all(axis), "place.axes"),
            (
                !nearest.patterns.is_empty()
                    && nearest.patterns.len() == nearest.places.len()
                    && nearest.patterns.iter().all(pattern)
                    && nearest.places.iter().flatten().all(|x| x.is_finite()),
                "place.nearest",
            ),
            (
                self.spread.len() == own.components && positive(&self.spread),
                "place.spread",
            ),
            (self.farthest > 0.0, "place.farthest"),
            (self.longest_step >= 0.0, "place.longest_step"),
        ] {
            if !sound {
                return Err(TrainingError::Unsound { table });
            }
        }
        Ok(())
    }

    /// Square of the distance of a pattern from none, each component over its spread.
    pub fn distance(&self, pattern: &[f64]) -> f64 {
        let components = self.laws[0].along(pattern);
        let terms = components.iter().zip(&self.spread);
        terms.map(|(u, spread)| (u / spread).powi(2)).sum()
    }

    /// Place, m, of patterns of readings of a size, and its deviation along x and y.
    pub fn place(&self, patterns: &[Vec<f64>; 2], size: f64) -> [[f64; 2]; 2] {
        let features = [0, 1].map(|law| self.laws[law].instant(&patterns[law]));
        let directions = self.laws[0].directions.iter();
        let along: Vec<f64> = directions.map(|d| long_dot(d, &patterns[0])).collect();
        let nearest = self.nearest.place(&along);
        let mut found = [[0.0; 2]; 2];
        for (number, axis) in self.axes.iter().enumerate() {
            let maps = axis.members.iter().map(|one| {
                let value = one.map.estimate(&self.laws[one.law], &features[one.law]);
                (one.map.share, value)
            });
            let all: Vec<(f64, f64)> = maps.chain([(axis.nearest, nearest[number])]).collect();
            let count = all.len() as f64;
            let mean = all.iter().map(|(_, value)| value).sum::<f64>() / count;
            let square = all
                .iter()
                .map(|(_, value)| (value - mean).powi(2))
                .sum::<f64>();
            let difference = (square / count).sqrt();
            let [low, high] = axis.range;
            let value = all.iter().map(|(share, value)| share * value).sum::<f64>();
            found[0][number] = value.clamp(low, high);
            found[1][number] = axis.error.at(1.0 / size, difference);
        }
        found
    }
}

/// Frames to places, in real time.
#[derive(Debug, Clone)]
pub struct PlaceEstimator {
    map: PlaceMap,
    stream: PatternStream,
}

impl PlaceEstimator {
    /// An estimator for a device that rests, with its readings `rest`.
    ///
    /// # Errors
    /// [`TrainingError`] for a map that was changed by hand, or for other readings at rest than its own.
    pub fn new(map: PlaceMap, rest: Vec<f64>) -> Result<Self, TrainingError> {
        map.check()?;
        map.standard.apply(&rest)?;
        Ok(Self {
            stream: PatternStream::new(&map.standard, rest, map.longest_step),
            map,
        })
    }

    /// Takes the frame at `time` (s) and estimates the place of what touches; `open` are standard deviations
    /// of readings that are not known exactly.
    ///
    /// # Errors
    /// [`TrainingError`] for a frame of another length or with a missing reading; the frame then leaves
    /// no trace.
    pub fn push(
        &mut self,
        time: f64,
        frame: &[f64],
        open: &[f64],
    ) -> Result<PositionEstimate, TrainingError> {
        let map = &self.map;
        self.stream.push(&map.standard, time, frame)?;
        let size = self.stream.size();
        let [position, deviation] = map.place(self.stream.patterns(), size);
        // What is open of the readings, over their size, moves the pattern by as much.
        let used = map.standard.used.iter().zip(&map.standard.scale);
        let moved = used.map(|(channel, scale)| {
            open.get(*channel)
                .map_or(0.0, |open| (open / scale / size).powi(2))
        });
        let moved = moved.sum::<f64>().sqrt();
        let half = map
            .axes
            .each_ref()
            .map(|axis| 0.5 * (axis.range[1] - axis.range[0]));
        let [x, y] = [0, 1].map(|axis| deviation[axis].hypot(half[axis] * moved).powi(2));
        let misfit = map.distance(&self.stream.patterns()[0]);
        Ok(PositionEstimate {
            position,
            covariance: [[x, 0.0], [0.0, y]],
            depth: None,
            misfit,
            support: if misfit > map.farthest {
                Support::Outside
            } else {
                Support::Trained
            },
        })
    }
}
