//! Slip along the rows of an array: how long a texture takes from one taxel to
//! the next.

use std::collections::VecDeque;

/// What is known of the array and of the slips that may occur.
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
    /// Its standard deviation, m/s, from how far the pairs of taxels agree.
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
/// A slip must explain the signals better by this than that all feel the same at
/// once: what fades after a press looks alike at any small lag.
const AT_ONCE: f64 = 0.15;
/// Two signals are compared where at least this share of them overlaps.
const OVERLAP: f64 = 0.4;

/// Correlation of one pair of taxels at all lags.
struct Pair {
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
        let (energy_a, energy_b) = (energies(a), energies(b));
        let all = energy_a[POINTS].min(energy_b[POINTS]);
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
                let energy = |sums: &[f64], from: usize| sums[from + count] - sums[from];
                // A quiet overlap says nothing.
                let both = energy(&energy_a, from_a) * energy(&energy_b, from_b);
                product / both.max(0.0).sqrt().max(0.1 * all)
            })
            .collect();
        let delay = |taxel: usize| self.options.delays.get(taxel).copied().unwrap_or(0.0);
        Some(Pair {
            distance,
            skew: delay(other) - delay(one),
            correlation,
        })
    }

    fn find(&self, pairs: &[Pair], step: f64) -> Option<Slip> {
        if pairs.is_empty() {
            return None;
        }
        let stack = |slowness: f64| {
            let sum: f64 = pairs.iter().map(|pair| pair.at(slowness, step)).sum();
            sum / pairs.len() as f64
        };
        let [slow, fast] = self.options.speeds;
        let ratio = (fast / slow).powf(1.0 / (SLOWNESSES - 1) as f64);
        let grid = (0..SLOWNESSES).map(|index| ratio.powf(index as f64) / fast);
        let best = grid
            .flat_map(|slowness| [slowness, -slowness])
            .max_by(|a, b| stack(*a).total_cmp(&stack(*b)))?;
        let around = best.abs() * (ratio - 1.0);
        let slowness = highest(best - around, best + around, stack);
        let score = stack(slowness);
        // What all feel at once does not move along the row.
        if score < self.options.least_score || score < stack(0.0) + AT_ONCE {
            return None;
        }
        // Each pair's own peak near that of all.
        let width = 4.0 * around;
        let own: Vec<f64> = pairs
            .iter()
            .map(|pair| highest(slowness - width, slowness + width, |s| pair.at(s, step)))
            .collect();
        let count = own.len() as f64;
        let variance = own.iter().map(|own| (own - slowness).powi(2)).sum::<f64>() / count;
        let velocity = 1.0 / slowness;
        Some(Slip {
            velocity,
            deviation: variance.sqrt() / count.sqrt() * velocity * velocity,
            score,
        })
    }
}

/// Sums of the squares of all values before each one.
fn energies(trace: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = Vec::with_capacity(trace.len() + 1);
    sums.push(sum);
    sums.extend(trace.iter().map(|value| {
        sum += value * value;
        sum
    }));
    sums
}

impl Pair {
    /// Correlation at the lag of a slowness, by the parabola through the three
    /// nearest steps; zero beyond what overlaps.
    fn at(&self, slowness: f64, step: f64) -> f64 {
        let reach = (self.correlation.len() / 2) as f64;
        // The second reading is later by the skew, so the texture seems to
        // arrive earlier in its frames.
        let place = (slowness * self.distance - self.skew) / step + reach;
        let middle = place.round();
        if middle < 1.0 || middle + 1.0 >= self.correlation.len() as f64 {
            return 0.0;
        }
        let t = place - middle;
        let index = middle as usize;
        let [a, b, c] = [-1, 0, 1].map(|off| self.correlation[index.wrapping_add_signed(off)]);
        b + 0.5 * t * (c - a) + 0.5 * t * t * (a - 2.0 * b + c)
    }
}

/// Place of the highest value between two bounds, by golden section.
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
    fn feel(texture: &Texture, velocity: f64, noise: f64, window: f64) -> Option<Slip> {
        let mut estimator = SlipEstimator::new(SlipOptions {
            window,
            ..options()
        });
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
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
                let found = feel(&Texture::new(seed), velocity, 0.05, 0.04 / speed).unwrap();
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
    fn noise_silence_and_a_press_on_all_are_no_slip() {
        let silent = Texture { waves: Vec::new() };
        assert_eq!(feel(&silent, 0.05, 1.0, 0.5), None);
        assert_eq!(feel(&silent, 0.05, 0.0, 0.5), None);
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
