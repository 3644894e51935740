//! Slip along the rows of an array: how long a texture takes from one taxel to
//! the next.

use std::collections::VecDeque;

/// Options of the array and of the slips that may occur.
#[derive(Debug, Clone, PartialEq)]
pub struct SlipOptions {
    /// Rows of taxels.
    pub rows: usize,
    /// Columns of taxels; at least two.
    pub columns: usize,
    /// Spacing along a row, m.
    pub pitch: f64,
    /// When each taxel is read after the start of its frame, s.
    pub delays: Vec<f64>,
    /// Length of signal that is compared, s.
    pub window: f64,
    /// Least and greatest speed that is looked for, m/s.
    pub speeds: [f64; 2],
    /// A correlation below this is no slip; default 0.5.
    pub least_score: f64,
    /// A pause between frames after which the signal begins anew, s.
    pub longest_pause: f64,
}

/// A slip along the rows.
///
/// The component across the rows is not known: of textures like these two rows
/// leave the direction in the plane open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slip {
    /// Velocity along +x, m/s.
    pub velocity: f64,
    /// Its standard deviation, m/s, from how much each taxel changes it; 1.96 of
    /// them hold the truth in 95 % of slips.
    pub deviation: f64,
    /// Mean correlation of all pairs at this velocity, at most 1.
    pub score: f64,
}

/// Follows the signals of an array and finds the slip of the last window.
///
/// The normalised cross-correlations of all pairs in a row are stacked at the
/// lag slowness x distance; the slowness of the highest stack counts.
#[derive(Debug, Clone)]
pub struct SlipEstimator {
    options: SlipOptions,
    times: VecDeque<u64>,
    signals: VecDeque<f64>,
}

/// Samples of a window; the signals are brought to this number of even steps.
const POINTS: usize = 512;
/// Steps of the search through slownesses of one sign.
const SLOWNESSES: usize = 240;
/// A slip must explain the signals better by this than equal signals at the same
/// time: what fades after a press looks alike at any small lag.
const AT_ONCE: f64 = 0.15;
/// Share of the slowness within which it is looked for without one taxel.
const NEAR: f64 = 0.1;
/// Two signals are compared where at least this share of them overlaps.
const OVERLAP: f64 = 0.4;

/// Correlation of one pair of taxels at all lags.
struct Pair {
    taxels: [usize; 2],
    /// Distance along +x, m.
    distance: f64,
    /// Delay of the second reading after the first, s.
    skew: f64,
    /// From lag -reach to +reach.
    correlation: Vec<f64>,
}

impl SlipEstimator {
    /// An estimator without history.
    pub fn new(options: SlipOptions) -> Self {
        Self {
            options,
            times: VecDeque::new(),
            signals: VecDeque::new(),
        }
    }

    /// Takes the signals of a frame, row by row; one that is not newer than the
    /// last changes nothing, a signal that is no number counts as none.
    pub fn push(&mut self, time_ns: u64, signals: &[f64]) {
        let taxels = self.options.rows * self.options.columns;
        if signals.len() != taxels || self.times.back().is_some_and(|last| *last >= time_ns) {
            return;
        }
        let pause = self.times.back().map_or(0, |last| time_ns - last);
        if pause as f64 * 1e-9 > self.options.longest_pause {
            self.forget();
        }
        self.times.push_back(time_ns);
        let finite = |signal: &f64| if signal.is_finite() { *signal } else { 0.0 };
        self.signals.extend(signals.iter().map(finite));
        while self.times.len() > 2 && self.length(1) >= self.options.window {
            self.times.pop_front();
            self.signals.drain(..taxels);
        }
    }

    /// Begins anew.
    pub fn forget(&mut self) {
        self.times.clear();
        self.signals.clear();
    }

    /// Time from sample `first` to the newest one, s.
    fn length(&self, first: usize) -> f64 {
        match (self.times.get(first), self.times.back()) {
            (Some(first), Some(last)) => (last - first) as f64 * 1e-9,
            _ => 0.0,
        }
    }

    /// The slip of the last window; `None` while the window is not full or
    /// nothing moves along the rows.
    pub fn estimate(&self) -> Option<Slip> {
        if self.length(0) < self.options.window {
            return None;
        }
        let step = self.options.window / (POINTS - 1) as f64;
        let columns = self.options.columns;
        let traces: Vec<Vec<f64>> = (0..self.options.rows * columns)
            .map(|taxel| self.trace(taxel, step))
            .collect();
        let mut pairs = Vec::new();
        for one in 0..traces.len() {
            let end = (one / columns + 1) * columns;
            for other in one + 1..end {
                pairs.extend(self.pair(&traces, [one, other], step));
            }
        }
        self.find(&pairs, step)
    }

    /// The signal of a taxel in even steps, without its mean.
    fn trace(&self, taxel: usize, step: f64) -> Vec<f64> {
        let taxels = self.options.rows * self.options.columns;
        let newest = self.times.back().copied().unwrap_or(0);
        let before = |index: usize| (newest - self.times[index]) as f64 * 1e-9;
        let value = |index: usize| self.signals[index * taxels + taxel];
        let mut at = 0;
        let mut trace: Vec<f64> = (0..POINTS)
            .map(|point| (POINTS - 1 - point) as f64 * step)
            .map(|age| {
                while at + 2 < self.times.len() && before(at + 1) > age {
                    at += 1;
                }
                let (early, late) = (before(at), before(at + 1));
                let share = ((early - age) / (early - late)).clamp(0.0, 1.0);
                value(at) + share * (value(at + 1) - value(at))
            })
            .collect();
        let mean = trace.iter().sum::<f64>() / POINTS as f64;
        for value in &mut trace {
            *value -= mean;
        }
        trace
    }

    /// Correlation of two taxels; none where one of them is silent.
    fn pair(&self, traces: &[Vec<f64>], [one, other]: [usize; 2], step: f64) -> Option<Pair> {
        let distance = (other - one) as f64 * self.options.pitch;
        let longest = distance / self.options.speeds[0] / step;
        let reach = longest.min((1.0 - OVERLAP) * POINTS as f64) as usize;
        let (a, b) = (&traces[one], &traces[other]);
        let (sums_a, sums_b) = (sums(a), sums(b));
        let all = spread(&sums_a, 0, POINTS).min(spread(&sums_b, 0, POINTS));
        if all <= 0.0 {
            return None;
        }
        let correlation = (0..=2 * reach)
            .map(|index| {
                // b follows a by `index` - `reach` steps.
                let (from_a, from_b) = (reach.saturating_sub(index), index.saturating_sub(reach));
                let count = POINTS - from_a - from_b;
                let pairs = a[from_a..][..count].iter().zip(&b[from_b..][..count]);
                let product: f64 = pairs.map(|(a, b)| a * b).sum();
                // About the means of the overlap: those of the whole windows are
                // of different parts of the texture.
                let total = |sums: &[[f64; 2]], from: usize| sums[from + count][0] - sums[from][0];
                let means = total(&sums_a, from_a) * total(&sums_b, from_b) / count as f64;
                let both = spread(&sums_a, from_a, count) * spread(&sums_b, from_b, count);
                // A quiet overlap says nothing.
                (product - means) / both.max(0.0).sqrt().max(0.1 * all)
            })
            .collect();
        let delay = |taxel: usize| self.options.delays.get(taxel).copied().unwrap_or(0.0);
        Some(Pair {
            taxels: [one, other],
            distance,
            skew: delay(other) - delay(one),
            correlation,
        })
    }

    fn find(&self, pairs: &[Pair], step: f64) -> Option<Slip> {
        if pairs.is_empty() {
            return None;
        }
        let stack = |slowness: f64| stack(pairs.iter(), slowness, step);
        let [slow, fast] = self.options.speeds;
        let ratio = (fast / slow).powf(1.0 / (SLOWNESSES - 1) as f64);
        let grid = (0..SLOWNESSES).map(|index| ratio.powf(index as f64) / fast);
        let best = grid
            .flat_map(|slowness| [slowness, -slowness])
            .max_by(|a, b| stack(*a).total_cmp(&stack(*b)))?;
        let around = best.abs() * (ratio - 1.0);
        let slowness = highest(best - around, best + around, stack);
        let score = stack(slowness);
        // A signal of all at the same time does not move along the row.
        if score < self.options.least_score || score < stack(0.0) + AT_ONCE {
            return None;
        }
        let deviation = jackknife(pairs, slowness, step).unwrap_or_else(|| {
            let ends = [stack(slowness - around), score, stack(slowness + around)];
            by_width(ends, around, self.times.len())
        });
        let velocity = 1.0 / slowness;
        Some(Slip {
            velocity,
            deviation: deviation * velocity * velocity,
            score,
        })
    }
}

/// Mean correlation of the pairs that overlap at the lag of a slowness. Those
/// that do not say nothing: counted as zero they would draw a slow slip to
/// where they just overlap.
fn stack<'a>(pairs: impl Iterator<Item = &'a Pair>, slowness: f64, step: f64) -> f64 {
    let found = pairs.filter_map(|pair| pair.at(slowness, step));
    let [sum, count] = found.fold([0.0; 2], |[sum, count], at| [sum + at, count + 1.0]);
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Standard deviation of the slowness, by the jackknife over taxels: pairs that
/// share one share its error, so that the scatter of the pairs would say too
/// little. `None` for too few taxels.
fn jackknife(pairs: &[Pair], slowness: f64, step: f64) -> Option<f64> {
    let mut taxels: Vec<usize> = pairs.iter().flat_map(|pair| pair.taxels).collect();
    taxels.sort_unstable();
    taxels.dedup();
    let width = NEAR * slowness.abs();
    let without = |taxel: &usize| {
        let left = || pairs.iter().filter(|pair| !pair.taxels.contains(taxel));
        let stack = |slowness: f64| stack(left(), slowness, step);
        (left().count() > 0).then(|| highest(slowness - width, slowness + width, stack))
    };
    let found: Vec<f64> = taxels.iter().filter_map(without).collect();
    let count = found.len() as f64;
    let squares: f64 = found.iter().map(|one| (one - slowness).powi(2)).sum();
    (found.len() > 2).then(|| ((count - 1.0) / count * squares).sqrt())
}

/// The same from the width of the peak ρ(s) alone, for independent noise of so
/// many readings: σ² = (1 − ρ²)/(−ρ ρ″ N).
fn by_width([below, score, above]: [f64; 3], step: f64, readings: usize) -> f64 {
    let bend = ((2.0 * score - below - above) / (step * step)).max(f64::MIN_POSITIVE);
    ((1.0 - score * score).max(0.0) / (score * bend * readings as f64)).sqrt()
}

/// Sums of all values before each one, and of their squares.
fn sums(trace: &[f64]) -> Vec<[f64; 2]> {
    let mut sum = [0.0; 2];
    let mut sums = Vec::with_capacity(trace.len() + 1);
    sums.push(sum);
    sums.extend(trace.iter().map(|value| {
        sum = [sum[0] + value, sum[1] + value * value];
        sum
    }));
    sums
}

/// Sum of the squares of `count` values from `from` about their mean.
fn spread(sums: &[[f64; 2]], from: usize, count: usize) -> f64 {
    let [total, squares] = [0, 1].map(|k| sums[from + count][k] - sums[from][k]);
    squares - total * total / count as f64
}

impl Pair {
    /// Correlation at the lag of a slowness, by the parabola through the three
    /// nearest steps; none beyond what overlaps.
    fn at(&self, slowness: f64, step: f64) -> Option<f64> {
        let reach = (self.correlation.len() / 2) as f64;
        // The second reading is later by the skew, so the texture seems to
        // arrive earlier in its frames.
        let index = (slowness * self.distance - self.skew) / step + reach;
        let middle = index.round();
        if middle < 1.0 || middle + 1.0 >= self.correlation.len() as f64 {
            return None;
        }
        let t = index - middle;
        let index = middle as usize;
        let [a, b, c] = [-1, 0, 1].map(|off| self.correlation[index.wrapping_add_signed(off)]);
        Some(b + 0.5 * t * (c - a) + 0.5 * t * t * (a - 2.0 * b + c))
    }
}

/// Position of the highest value between two bounds, by golden section.
fn highest(mut low: f64, mut high: f64, value: impl Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    for _ in 0..30 {
        let span = GOLDEN * (high - low);
        if value(high - span) > value(low + span) {
            high = low + span;
        } else {
            low = high - span;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rayon::prelude::*;
    use std::f64::consts::TAU;

    fn options() -> SlipOptions {
        SlipOptions {
            rows: 2,
            columns: 4,
            pitch: 4e-3,
            delays: (0..8).map(|taxel| 1e-4 * f64::from(taxel)).collect(),
            window: 0.5,
            speeds: [10e-3, 300e-3],
            least_score: 0.5,
            longest_pause: 0.02,
        }
    }

    /// A texture of waves from 3 to 20 mm that moves along +x with `velocity`.
    struct Texture {
        waves: Vec<[f64; 2]>,
    }

    impl Texture {
        fn new(seed: u64) -> Self {
            let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut wave = || {
                [
                    random.random_range(0.05..0.33),
                    random.random_range(0.0..TAU),
                ]
            };
            Self {
                waves: (0..20).map(|_| wave()).collect(),
            }
        }

        fn at(&self, metres: f64) -> f64 {
            let wave = |[per_mm, phase]: &[f64; 2]| (TAU * per_mm * metres * 1e3 + phase).sin();
            self.waves.iter().map(wave).sum()
        }
    }

    /// Frames with uneven steps; `noise` in deviations of the texture over the
    /// noise.
    fn estimated(texture: &Texture, velocity: f64, noise: f64, window: f64) -> Option<Slip> {
        let mut estimator = SlipEstimator::new(SlipOptions {
            window,
            ..options()
        });
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7 + (1e6 * velocity.abs()) as u64);
        let mut time_ns = 0_u64;
        while (time_ns as f64) < 1.1e9 * window {
            let signals: Vec<f64> = (0..8)
                .map(|taxel| {
                    let time = time_ns as f64 * 1e-9 + 1e-4 * f64::from(taxel);
                    let x = 4e-3 * f64::from(taxel % 4);
                    // The deviation of twenty waves is √10; that of twelve even numbers is one.
                    let even: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
                    texture.at(x - velocity * time) + noise * 10f64.sqrt() * even
                })
                .collect();
            estimator.push(time_ns, &signals);
            time_ns += random.random_range(700_000..1_300_000);
        }
        estimator.estimate()
    }

    #[test]
    fn sign_is_always_right_and_the_median_error_below_two_percent() {
        let mut errors = Vec::new();
        for (seed, speed) in
            (0..4).flat_map(|seed| [20e-3, 50e-3, 100e-3, 150e-3].map(|v| (seed, v)))
        {
            for velocity in [speed, -speed] {
                // 40 mm of travel, signal over noise 20.
                let found = estimated(&Texture::new(seed), velocity, 0.05, 0.04 / speed).unwrap();
                assert!(found.velocity * velocity > 0.0, "{velocity} {found:?}");
                errors.push((found.velocity / velocity - 1.0).abs());
            }
        }
        errors.sort_by(f64::total_cmp);
        // The goals for such textures: median 2 %, nine of ten within 5 %.
        assert!(errors[errors.len() / 2] < 0.02, "{errors:?}");
        assert!(errors[errors.len() * 9 / 10] < 0.05, "{errors:?}");
    }

    #[test]
    fn ninety_five_per_cent_intervals_hold_the_truth_of_two_hundred_slips() {
        let slips: Vec<f64> = (0..200_u64)
            .into_par_iter()
            .map(|seed| {
                let speed = 20e-3 * 7.5_f64.powf((seed % 20) as f64 / 19.0);
                let velocity = if seed % 2 == 0 { speed } else { -speed };
                let found = estimated(&Texture::new(seed), velocity, 0.05, 0.04 / speed).unwrap();
                (found.velocity - velocity) / found.deviation
            })
            .collect();
        let held = slips.iter().filter(|ratio| ratio.abs() < 1.96).count();
        assert!((180..=198).contains(&held), "{held} {slips:?}");
    }

    #[test]
    fn two_taxels_alone_give_a_speed_with_a_deviation() {
        let mut estimator = SlipEstimator::new(SlipOptions {
            rows: 1,
            columns: 2,
            delays: Vec::new(),
            ..options()
        });
        let (texture, mut random) = (Texture::new(1), rand_chacha::ChaCha8Rng::seed_from_u64(3));
        for index in 0..600_u64 {
            let at = |x: f64| texture.at(x - 0.08 * index as f64 * 1e-3);
            let mut noise = || 0.1 * random.random_range(-1.0..1.0);
            let signals = [at(0.0) + noise(), at(4e-3) + noise()];
            estimator.push(index * 1_000_000, &signals);
        }
        let found = estimator.estimate().unwrap();
        assert!(
            found.deviation > 0.0 && found.deviation < 0.1 * 0.08,
            "{found:?}"
        );
        // Four deviations: 1 in 16 000 lies farther.
        assert!(
            (found.velocity - 0.08).abs() < 4.0 * found.deviation,
            "{found:?}"
        );
    }

    #[test]
    fn noise_silence_and_a_press_on_all_are_no_slip() {
        let silent = Texture { waves: Vec::new() };
        assert_eq!(estimated(&silent, 0.05, 1.0, 0.5), None);
        assert_eq!(estimated(&silent, 0.05, 0.0, 0.5), None);
        let mut options = options();
        options.delays.clear();
        let mut estimator = SlipEstimator::new(options);
        for index in 0..600_u64 {
            let press = (index as f64 - 300.0) / 20.0;
            estimator.push(index * 1_000_000, &[(-press * press).exp(); 8]);
        }
        assert_eq!(estimator.estimate(), None);
    }

    #[test]
    fn a_pause_begins_anew() {
        let mut estimator = SlipEstimator::new(options());
        for index in 0..400_u64 {
            estimator.push(index * 1_000_000, &[index as f64; 8]);
        }
        estimator.push(430_000_000, &[0.0; 8]);
        assert_eq!(estimator.times.len(), 1);
    }
}
