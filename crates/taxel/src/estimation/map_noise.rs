//! Noise of a pressure map, from its own frames.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::ChannelFacts;
use crate::acquisition::Frame;

/// Frames of a block.
const BLOCK: usize = 8;
/// Blocks that make the quietest part.
const QUIETEST: usize = 4;
/// The smallest reading is a level of noise as long as it is below this share of the largest:
/// a map of few sizes may show nothing but touch.
const SHARE: f64 = 0.05;
/// Shares of zeros among readings that change between which their noise was cut off at zero: half
/// of it, within what few frames show.
const CUT_OFF: [f64; 2] = [0.3, 0.7];
/// Share of the deviation down to which readings above zero go where noise was cut off there.
const DOWN_TO_ZERO: f64 = 0.25;
/// Variance of a reading without load whose negative part is written as zero, of that of its
/// noise: 1/2 - 1/(2 pi).
const CUT_VARIANCE: f64 = 0.5 - 0.5 * std::f64::consts::FRAC_1_PI;
/// Zeros are where noise is cut off if they are more than this share of what changes.
const ZEROS: f64 = 0.01;
/// Lower quartile over sensels of the deviation that the median of one to four blocks shows, over
/// that of the noise: of normal noise, and of noise that was cut off at zero and made whole again.
/// By simulation of 200 000 sensels; the test of the bias checks what they leave.
const QUARTILE: [[f64; 2]; QUIETEST] = [
    [0.672, 0.562],
    [0.779, 0.706],
    [0.743, 0.649],
    [0.783, 0.706],
];
/// The largest deviation of readings that go to and fro between two, over their difference: a half,
/// over the least share of it that is taken for whole (0.672 above).
const IN_TURN: f64 = 0.5 / QUARTILE[0][0];
/// A contact holds above so many standard deviations of the noise.
const DEVIATIONS: f64 = 3.0;

/// Finds what is noise on a map: frames go in, all of a recording or those of its rest.
///
/// Two things say it. Programs that suppress noise write zeros below a level of theirs, so
/// that the smallest reading above zero is that level, or a twentieth of the largest if that is
/// less. And in the quietest part, the 32 frames
/// with the least load, readings scatter about a course that changes slowly: of second
/// differences in time a steady motion of the load leaves nothing.
///
/// # Example
/// ```
/// use taxel::acquisition::Frame;
/// use taxel::estimation::MapNoise;
///
/// let mut noise = MapNoise::default();
/// for sequence in 0..40 {
///     let values = vec![0.0, 5.0, if sequence > 30 { 200.0 } else { 0.0 }];
///     noise.push(&Frame { sequence, time_ns: sequence * 10_000_000, values, ..Frame::default() });
/// }
/// // The level that the program suppresses.
/// assert_eq!(noise.hold(), 5.0);
/// ```
#[derive(Debug, Clone, Default)]
pub struct MapNoise {
    block: Block,
    /// The last two frames of the block.
    before: [Vec<f64>; 2],
    quietest: Vec<Block>,
    sensels: Vec<Sensel>,
    frames: usize,
}

/// What all frames show of one sensel.
#[derive(Debug, Clone, Copy)]
struct Sensel {
    /// The smallest and the largest reading above zero.
    range: Option<[f64; 2]>,
    /// True if zeros were seen, and readings below zero: then none is cut off at zero.
    zeros: bool,
    below_zero: bool,
    /// True if every reading was a whole number.
    whole: bool,
    last: f64,
    /// The smallest difference of two readings in a row; none while all are the same.
    step: Option<f64>,
}

impl Sensel {
    const UNSEEN: Self = Self {
        range: None,
        zeros: false,
        below_zero: false,
        whole: true,
        last: f64::NAN,
        step: None,
    };

    fn push(&mut self, value: f64) {
        if value > 0.0 {
            let [smallest, largest] = self.range.get_or_insert([value; 2]);
            (*smallest, *largest) = (smallest.min(value), largest.max(value));
        }
        self.zeros |= value == 0.0;
        self.below_zero |= value < 0.0;
        self.whole &= value.is_nan() || value.fract() == 0.0;
        let difference = (value - self.last).abs();
        if difference > 0.0 {
            self.step = Some(self.step.map_or(difference, |step| step.min(difference)));
        }
        self.last = value;
    }

    /// What both show; the last reading and changes are those of one.
    fn with(self, other: &Self) -> Self {
        let least = |pair: [Option<f64>; 2]| pair.into_iter().flatten().reduce(f64::min);
        let range = match (self.range, other.range) {
            (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
            (one, other) => one.or(other),
        };
        Self {
            range,
            zeros: self.zeros | other.zeros,
            below_zero: self.below_zero | other.below_zero,
            whole: self.whole & other.whole,
            last: other.last,
            step: least([self.step, other.step]),
        }
    }
}

#[derive(Debug, Clone, Default)]
struct Block {
    frames: usize,
    /// Sum of the readings.
    load: f64,
    /// Sum of the squared second differences of each sensel.
    squares: Vec<f64>,
    /// Zeros of each sensel.
    zeros: Vec<u32>,
}

impl MapNoise {
    /// Takes the next frame, readings in SI units.
    pub fn push(&mut self, frame: &Frame) {
        let values = &frame.values;
        self.frames += 1;
        self.sensels.resize(values.len(), Sensel::UNSEEN);
        for (sensel, value) in self.sensels.iter_mut().zip(values) {
            sensel.push(*value);
        }
        let block = &mut self.block;
        block.squares.resize(values.len(), 0.0);
        block.zeros.resize(values.len(), 0);
        for (zeros, value) in block.zeros.iter_mut().zip(values) {
            *zeros += u32::from(*value == 0.0);
        }
        if block.frames >= 2 {
            let [first, second] = &self.before;
            let differences = values.iter().zip(first).zip(second);
            for (sum, ((new, first), second)) in block.squares.iter_mut().zip(differences) {
                let second_difference = new - 2.0 * second + first;
                if !second_difference.is_nan() {
                    *sum += second_difference * second_difference;
                }
            }
        }
        block.load += values.iter().filter(|value| !value.is_nan()).sum::<f64>();
        block.frames += 1;
        let [first, second] = &mut self.before;
        std::mem::swap(first, second);
        second.clone_from(values);
        if self.block.frames == BLOCK {
            self.keep();
        }
    }

    /// Keeps the block if it is one of the quietest.
    fn keep(&mut self) {
        let block = std::mem::take(&mut self.block);
        let at = self
            .quietest
            .partition_point(|kept| kept.load.total_cmp(&block.load) != Ordering::Greater);
        self.quietest.insert(at, block);
        self.quietest.truncate(QUIETEST);
    }

    /// Standard deviation of one reading in the quietest part, in the unit of the frames;
    /// none where nothing there changes, or less than eight frames were seen.
    ///
    /// Sensels whose reading does not change are left out: what they would show is
    /// suppressed. Of the others the lower quartile counts: a load may move on the rest. Where
    /// about half of their readings are zero, their noise was cut off there, which is undone.
    pub fn deviation(&self) -> Option<f64> {
        self.scatter(&self.all()).map(|[deviation, _]| deviation)
    }

    /// All sensels.
    fn all(&self) -> Vec<usize> {
        (0..self.sensels.len()).collect()
    }

    /// What these sensels show together.
    fn together(&self, sensels: &[usize]) -> Sensel {
        let seen = sensels.iter().filter_map(|at| self.sensels.get(*at));
        seen.fold(Sensel::UNSEEN, Sensel::with)
    }

    /// True if every reading of a sensel was a whole number.
    pub(super) fn is_whole(&self, sensel: usize) -> bool {
        self.sensels.get(sensel).is_none_or(|seen| seen.whole)
    }

    /// Deviation of these sensels, and the share of zeros among the readings in which it was found.
    fn scatter(&self, sensels: &[usize]) -> Option<[f64; 2]> {
        // A second difference of independent readings has six times their variance.
        let count = 6.0 * (BLOCK - 2) as f64;
        self.quietest.first()?;
        let mut squares = Vec::with_capacity(QUIETEST);
        // The median block: a touch may begin in one of them.
        let mut median = |sensel: usize| {
            let of = |block: &Block| block.squares.get(sensel).copied().unwrap_or(0.0);
            squares.clear();
            squares.extend(self.quietest.iter().map(of));
            squares.sort_unstable_by(f64::total_cmp);
            let last = squares.len() - 1;
            0.5 * (squares[last / 2] + squares[last.div_ceil(2)])
        };
        let sums = sensels.iter().map(|sensel| (*sensel, median(*sensel)));
        let (numbers, mut changing): (Vec<usize>, Vec<f64>) =
            sums.filter(|(_, sum)| *sum > 0.0).unzip();
        if changing.is_empty() {
            return None;
        }
        let zeros =
            |block: &Block| -> u32 { numbers.iter().filter_map(|at| block.zeros.get(*at)).sum() };
        let zeros: u32 = self.quietest.iter().map(zeros).sum();
        let readings = self.quietest.len() * BLOCK * numbers.len();
        let share = f64::from(zeros) / readings as f64;
        let at = changing.len() / 4;
        let (_, quartile, _) = changing.select_nth_unstable_by(at, f64::total_cmp);
        let deviation = (*quartile / count).sqrt();
        // A program that suppresses noise leaves nothing just above zero.
        let seen = self.together(sensels);
        let down_to_zero = |[smallest, _]: [f64; 2]| smallest < DOWN_TO_ZERO * deviation;
        let cut =
            (CUT_OFF[0]..=CUT_OFF[1]).contains(&share) && seen.range.is_some_and(down_to_zero);
        let [whole, half] = QUARTILE[self.quietest.len() - 1];
        let deviation = if cut {
            deviation / (CUT_VARIANCE.sqrt() * half)
        } else if seen.zeros {
            // Noise is not seen, but what moves under a load: as little of it as there is.
            deviation
        } else {
            deviation / whole
        };
        Some([deviation, share])
    }

    /// What is known of each channel of a map on which these sensels exist, where those of one
    /// kind have the same number in `kinds` (all are of one where that is empty).
    ///
    /// A sensel whose reading stays the same is stuck when noise would change it, but not at
    /// the largest reading, which may be the end of the range, and not at zero where the
    /// noise of others is cut off there.
    pub(super) fn facts(&self, present: &[bool], kinds: &[usize]) -> Vec<ChannelFacts> {
        let mut facts: Vec<ChannelFacts> = present
            .iter()
            .map(|exists| ChannelFacts::unknown(*exists))
            .collect();
        for sensels in of_each_kind(present.len(), kinds) {
            let seen = self.together(&sensels);
            let Some(step) = seen.step else { continue };
            let scatter = self.scatter(&sensels);
            let scatter = scatter.filter(|scatter| self.is_shared(&sensels, *scatter, step));
            // Where no noise is seen the least change may be that of a press: it is no step.
            let Some([deviation, zeros]) = scatter else {
                continue;
            };
            let least = if zeros > ZEROS && !seen.below_zero {
                0.0
            } else {
                f64::NAN
            };
            let most = seen.range.map_or(f64::NAN, |[_, largest]| largest);
            for sensel in sensels {
                facts[sensel] = ChannelFacts {
                    deviation,
                    resolution: step,
                    cut_off: [least, most],
                    quietest: true,
                    ..facts[sensel]
                };
            }
        }
        facts
    }

    /// True if the scatter of the sensels that change says something of the others: it is more
    /// than that of two neighbouring readings in turn, which any noise shows between them, and no
    /// more than a quarter, the lower quartile, stand still.
    fn is_shared(&self, sensels: &[usize], [deviation, zeros]: [f64; 2], step: f64) -> bool {
        let still = |sensel: &&usize| {
            self.sensels.get(**sensel).is_some_and(|seen| {
                seen.step.is_none() && seen.last.is_finite() && !(seen.zeros && zeros > ZEROS)
            })
        };
        deviation > IN_TURN * step && 4 * sensels.iter().filter(still).count() <= sensels.len()
    }

    /// The sensels whose reading was the same in every frame although noise would change it.
    pub(super) fn stuck(&self, facts: &[ChannelFacts]) -> Vec<bool> {
        let sensels = facts.iter().enumerate();
        sensels
            .map(|(sensel, facts)| {
                let seen = self.sensels.get(sensel).unwrap_or(&Sensel::UNSEEN);
                // The largest reading of all frames is no end of the range.
                let facts = ChannelFacts {
                    cut_off: [facts.cut_off[0], f64::NAN],
                    ..*facts
                };
                seen.step.is_none()
                    && seen.last.is_finite()
                    && facts.stands_still(seen.last, self.frames as f64 - 1.0)
            })
            .collect()
    }

    /// The reading down to which a contact holds, in the unit of the frames: what is above
    /// noise. A touch begins at twice of it.
    pub fn hold(&self) -> f64 {
        self.hold_of(&self.all())
    }

    fn hold_of(&self, sensels: &[usize]) -> f64 {
        let seen = self.together(sensels);
        let level = |[smallest, largest]: [f64; 2]| smallest.min(SHARE * largest);
        let level = seen.range.filter(|_| seen.zeros).map(level);
        let noise = self.scatter(sensels);
        let noise = noise.map_or(0.0, |[deviation, _]| DEVIATIONS * deviation);
        level.unwrap_or(0.0).max(noise)
    }

    /// The least of it over the kinds of sensels, which `kinds` numbers.
    pub(super) fn least_hold(&self, kinds: &[usize]) -> f64 {
        let of_each = of_each_kind(self.sensels.len(), kinds);
        let holds = of_each.iter().map(|sensels| self.hold_of(sensels));
        holds.reduce(f64::min).unwrap_or(0.0)
    }
}

/// The sensels of each kind.
fn of_each_kind(sensels: usize, kinds: &[usize]) -> Vec<Vec<usize>> {
    let mut of_each: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for sensel in 0..sensels {
        let kind = kinds.get(sensel).copied().unwrap_or(0);
        of_each.entry(kind).or_default().push(sensel);
    }
    of_each.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(frames: usize, value: impl Fn(usize, usize) -> f64) -> MapNoise {
        let mut noise = MapNoise::default();
        for at in 0..frames {
            noise.push(&Frame {
                sequence: at as u64,
                time_ns: at as u64 * 10_000_000,
                values: (0..64).map(|sensel| value(at, sensel)).collect(),
                ..Frame::default()
            });
        }
        noise
    }

    /// Independent readings of a standard deviation of one, roughly normal.
    fn scatter(at: usize, sensel: usize) -> f64 {
        let mut state = (at * 64 + sensel) as u64 + 1;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let mixed = (state ^ (state >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
            (mixed >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    #[test]
    fn the_noise_of_readings_is_found_beside_a_load_that_moves() {
        // A load passes over half of the sensels, except in the middle.
        let load = |at: usize, sensel: usize| match (at, sensel) {
            (100..=140, _) | (_, 32..) => 0.0,
            _ => 500.0 + 10.0 * at as f64 + 100.0 * (at as f64 * 0.5).sin(),
        };
        let deviation = noise(300, |at, sensel| load(at, sensel) + scatter(at, sensel)).deviation();
        assert!(
            deviation.is_some_and(|found| (0.8..1.25).contains(&found)),
            "{deviation:?}"
        );
        // Always loaded.
        let deviation = noise(300, |at, sensel| 1e3 + at as f64 + scatter(at, sensel)).deviation();
        assert!(
            deviation.is_some_and(|found| (0.8..1.25).contains(&found)),
            "{deviation:?}"
        );
    }

    #[test]
    fn noise_that_was_cut_off_at_zero_is_found_whole() {
        let whole = noise(300, |at, sensel| 0.3 * scatter(at, sensel)).deviation();
        let cut = noise(300, |at, sensel| (0.3 * scatter(at, sensel)).max(0.0)).deviation();
        let ratio = cut.zip(whole).map(|(cut, whole)| cut / whole);
        assert!(
            ratio.is_some_and(|ratio| (0.85..1.15).contains(&ratio)),
            "{ratio:?}"
        );
    }

    #[test]
    fn the_deviation_has_no_bias_however_few_frames_there_are() {
        for frames in [8, 16, 24, 32] {
            for cut in [false, true] {
                let mut sum = 0.0;
                let times = 60;
                for time in 0..times {
                    let found = noise(frames, |at, sensel| {
                        let value = scatter(at + 1000 * time, sensel);
                        if cut { value.max(0.0) } else { value }
                    });
                    sum += found.deviation().unwrap();
                }
                let mean = sum / times as f64;
                assert!(
                    (0.95..1.05).contains(&mean),
                    "{frames} frames, {cut}: {mean}"
                );
            }
        }
    }

    #[test]
    fn a_suppressed_level_is_the_smallest_reading() {
        let map = noise(60, |at, sensel| {
            if at > 30 && sensel < 9 {
                18.0 + 60.0 * sensel as f64
            } else {
                0.0
            }
        });
        assert_eq!((map.deviation(), map.hold()), (None, 18.0));
        let nothing = noise(60, |_, _| 0.0);
        assert_eq!(nothing.hold(), 0.0);
        let one_size = noise(
            60,
            |at, sensel| if at > 30 && sensel < 9 { 18.0 } else { 0.0 },
        );
        assert_eq!(one_size.hold(), SHARE * 18.0);
        let short = noise(3, |_, _| 4.0);
        assert_eq!((short.deviation(), short.hold()), (None, 0.0));
        let missing = noise(60, |_, _| f64::NAN);
        assert_eq!(missing.hold(), 0.0);
    }
}
