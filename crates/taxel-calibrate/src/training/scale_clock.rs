//! The clock of a scale: a reading shows what the scale measured last, some time ago.
//!
//! A scale that measures every T, and is asked every d, shows values of an age that grows by d − T
//! from reading to reading until it skips a measurement: a sawtooth of the height T. While the
//! force changes with F′ a reading is wrong by F′ times its age. The mean age is the delay of the
//! scale; the clock has the rest.

use std::f64::consts::TAU;

use rayon::prelude::*;
use taxel::trained::{Block, TrainingError};

use super::{Quick, Session};

/// Features of the map whose errors show a clock.
const RICH: [Block; 6] = [
    Block::Channels,
    Block::Powers,
    Block::Sums,
    Block::Products,
    Block::SlowSums,
    Block::Slow,
];

/// A scale with a clock of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScaleClock {
    /// Time from measurement to measurement, s.
    pub period: f64,
    /// When a reading is of mean age for the first time, s.
    pub start: f64,
    /// Error of the readings because their age varies, N rms.
    pub error: f64,
}

/// Periods that are looked for, over the usual time between readings.
const PERIODS: [f64; 2] = [0.9, 1.1];
/// Frequencies for each that the length of a run tells apart.
const FINENESS: f64 = 4.0;
/// Steps of a period and of a frequency in which the sawtooth is fitted.
const STEPS: i32 = 40;
/// A sawtooth of fewer teeth is no clock, but drift of the delay.
const FEWEST_TEETH: f64 = 3.0;
/// Fewest readings.
const FEWEST: usize = 100;
/// The clock leaves less than this share of the mean square error, or is none.
const CLEARLY: f64 = 0.7;

impl ScaleClock {
    /// By how much longer ago than on average the reading at `time` was measured, s.
    pub fn age(&self, time: f64) -> f64 {
        let turns = (time - self.start) / self.period + 0.5;
        self.period * (turns - turns.floor() - 0.5)
    }

    /// The clock of a run, from the errors of a map of the run itself; `None` where they show none.
    ///
    /// # Errors
    /// [`TrainingError`].
    pub fn of(run: &Session) -> Result<Option<Self>, TrainingError> {
        let quick = Quick::of(std::slice::from_ref(run))?;
        let errors = quick.own_errors(&RICH)?;
        let [times, readings, errors] =
            [0, 1, 2].map(|column| errors.iter().map(|row| row[column]).collect::<Vec<f64>>());
        Ok(Self::fitted(&times, &errors, &slopes(&times, &readings)))
    }

    /// The clock whose ages, times the slopes of the force (N/s), leave least of the errors (N).
    fn fitted(times: &[f64], errors: &[f64], slopes: &[f64]) -> Option<Self> {
        if times.len() < FEWEST {
            return None;
        }
        let first = times[0];
        let span = times[times.len() - 1] - first;
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let usual = steps[steps.len() / 2];
        let step = 1.0 / (FINENESS * span);
        // A delay that stays the same is none of the clock's.
        let products = |of: &[f64]| of.iter().zip(slopes).map(|(a, b)| a * b).sum::<f64>();
        let delay = products(errors) / products(slopes);
        let rows = errors.iter().zip(slopes);
        let errors: Vec<f64> = rows.map(|(error, slope)| error - delay * slope).collect();
        let [lowest, highest] = [1.0 / (PERIODS[1] * usual), 1.0 / (PERIODS[0] * usual)];
        // A sine of each frequency times the slopes: the first of the sawtooth's.
        let gain = |frequency: f64| {
            let (mut gram, mut moment) = ([0.0; 3], [0.0; 2]);
            for ((time, error), slope) in times.iter().zip(&errors).zip(slopes) {
                let (sin, cos) = (TAU * frequency * (time - first)).sin_cos();
                let [sin, cos] = [slope * sin, slope * cos];
                gram = [
                    gram[0] + sin * sin,
                    gram[1] + sin * cos,
                    gram[2] + cos * cos,
                ];
                moment = [moment[0] + sin * error, moment[1] + cos * error];
            }
            let [ss, sc, cc] = gram;
            let [s, c] = moment;
            (s * s * cc - 2.0 * s * c * sc + c * c * ss) / (ss * cc - sc * sc)
        };
        // Even readings cannot tell a scale that is faster than they are from one that is as much
        // slower: the age of one grows in a tooth, and falls of the other.
        let best = |lowest: f64, highest: f64| {
            let count = ((highest - lowest) / step) as usize;
            let frequencies = (0..=count).into_par_iter();
            let gains = frequencies
                .map(|number| lowest + number as f64 * step)
                .map(|frequency| (gain(frequency), frequency))
                .filter(|(gain, _)| gain.is_finite());
            gains.max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let apart = FEWEST_TEETH / span;
        let sides = [
            (lowest, 1.0 / usual - apart),
            (1.0 / usual + apart, highest),
        ];
        let sides = sides.into_iter().filter(|(from, to)| from < to);
        let sides: Vec<f64> = sides
            .filter_map(|(from, to)| best(from, to).map(|(_, frequency)| frequency))
            .collect();
        let left = |clock: &Self| {
            let rows = times.iter().zip(&errors).zip(slopes);
            let left = rows.map(|((time, error), slope)| error - slope * clock.age(*time));
            left.map(|error| error * error).sum::<f64>()
        };
        let of = |frequency: f64, fine: i32, phase: i32| {
            let share = |number: i32| f64::from(number) / f64::from(STEPS);
            let period = 1.0 / (frequency + step * (2.0 * share(fine) - 1.0));
            Self {
                period,
                start: first + period * share(phase),
                error: 0.0,
            }
        };
        let (least, best) = sides
            .into_par_iter()
            .flat_map(|frequency| {
                (0..=STEPS)
                    .into_par_iter()
                    .map(move |fine| (frequency, fine))
            })
            .flat_map_iter(|(frequency, fine)| {
                (0..STEPS).map(move |phase| of(frequency, fine, phase))
            })
            .map(|clock| (left(&clock), clock))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let before: f64 = errors.iter().map(|error| error * error).sum();
        let made = times.iter().zip(slopes);
        let made = made.map(|(time, slope)| (slope * best.age(*time)).powi(2));
        let error = (made.sum::<f64>() / times.len() as f64).sqrt();
        (least < CLEARLY * before).then_some(Self { error, ..best })
    }
}

/// Slopes over two readings to either side: one that skips a measurement makes a false one.
fn slopes(times: &[f64], forces: &[f64]) -> Vec<f64> {
    let last = times.len().saturating_sub(1);
    let slope = |at: usize| {
        let (from, to) = (at.saturating_sub(2), (at + 2).min(last));
        (forces[to] - forces[from]) / (times[to] - times[from]).max(f64::MIN_POSITIVE)
    };
    (0..times.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel_numerics::Noise;

    /// Readings every 0.2047 s, for 300 s, of a force that comes and goes; `age` of each.
    fn errors(age: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut noise = Noise::seeded(1);
        let times: Vec<f64> = (0..1500).map(|k| 100.0 + 0.2047 * f64::from(k)).collect();
        let slopes: Vec<f64> = times.iter().map(|t| 3.0 * (t / 6.0).sin()).collect();
        let errors = times.iter().zip(&slopes);
        let errors = errors.map(|(t, slope)| slope * age(*t) + 0.05 * noise.normal());
        let errors = errors.collect();
        (times, errors, slopes)
    }

    #[test]
    fn the_clock_of_a_scale_is_found_in_its_readings() {
        let truth = ScaleClock {
            period: 0.19993,
            start: 100.07,
            error: 0.0,
        };
        let (times, errors, slopes) = errors(|time| truth.age(time));
        let found = ScaleClock::fitted(&times, &errors, &slopes).unwrap();
        assert!((found.period - truth.period).abs() < 1e-5, "{found:?}");
        // A sawtooth of the height T times a sine of 3 N/s.
        let expected = 0.19993 / 12f64.sqrt() * 3.0 / 2f64.sqrt();
        assert!((found.error / expected - 1.0).abs() < 0.05, "{found:?}");
        let wrong = times.iter().map(|t| (found.age(*t) - truth.age(*t)).abs());
        let mut wrong: Vec<f64> = wrong.collect();
        wrong.sort_by(f64::total_cmp);
        assert!(wrong[wrong.len() / 2] < 0.005, "{}", wrong[wrong.len() / 2]);
    }

    #[test]
    fn a_scale_that_shows_its_time_has_no_clock() {
        for delay in [0.0, 0.05] {
            let (times, errors, slopes) = errors(|_| delay);
            assert_eq!(ScaleClock::fitted(&times, &errors, &slopes), None);
        }
    }
}
