//! Readings of a device that nothing touches.

use taxel::estimation::rest_at_start;
use taxel::trained::RestStatistics;

use super::{REST_FRAMES, Session};

/// Frames of the empty body that are averaged, and deviations of their mean that are noise.
const BLOCK: usize = 25;
const SURELY: f64 = 4.0;
/// Time in which what a body shows of a contact that has gone falls to 1/e at the latest, s. The
/// public recordings of a printed lattice halve it in less than a minute.
const CREEP_FADES: f64 = 300.0;

impl Session {
    /// Takes the rest that a capture at the start of the run takes live, if a scale shows that nothing touches.
    pub(crate) fn capture_rest(&mut self) {
        if self.force.is_some() {
            let deviation = deviations(&[self]);
            self.rest = Some(rest_at_start(self.sensor.rows(), &deviation, REST_FRAMES));
        }
    }
}

/// Readings without contact over runs that begin so.
pub(crate) fn rest_of(runs: &[&Session]) -> RestStatistics {
    let deviation = deviations(runs);
    let baselines: Vec<Vec<f64>> = runs.iter().map(|run| run.baseline()).collect();
    let mean = |channel: usize| {
        baselines.iter().map(|row| row[channel]).sum::<f64>() / baselines.len() as f64
    };
    let width = deviation.len();
    RestStatistics {
        mean: (0..width).map(mean).collect(),
        step: (0..width)
            .map(|channel| least_step(runs, channel))
            .collect(),
        recovery: recovery(runs, &deviation),
        deviation,
    }
}

/// Time after a contact until what the body shows of it is less than the noise of a reading, s.
///
/// What it shows is the mean of a block of frames in which the scale reads nothing, less the
/// reading at rest, beyond the noise of both means; of all channels the largest over its noise.
fn recovery(runs: &[&Session], deviation: &[f64]) -> f64 {
    let mut most = 1.0_f64;
    for session in runs {
        let Some(force) = &session.force else {
            continue;
        };
        let nothing = session.no_force();
        let empty = |time: f64| {
            let pressed = force.at(time, f64::INFINITY);
            pressed.is_some_and(|force| force[0] <= nothing)
        };
        let frames = session.sensor.times().iter().zip(session.sensor.rows());
        let frames = frames.filter(|(time, _)| empty(**time));
        let frames: Vec<&Vec<f64>> = frames.map(|(_, row)| row).collect();
        let counts = [BLOCK, session.rest_frames().len().max(1)];
        let noise = counts.map(|count| 1.0 / count as f64);
        let noise = (noise[0] + noise[1]).sqrt();
        let channels = session.baseline().into_iter().zip(deviation).enumerate();
        for (channel, (rest, deviation)) in channels {
            let shown = frames.iter().map(|row| row[channel] - rest);
            let shown: Vec<f64> = shown.filter(|shown| shown.is_finite()).collect();
            // What is left over is too short for a mean.
            for block in shown.chunks_exact(BLOCK) {
                let mean = block.iter().sum::<f64>() / BLOCK as f64;
                most = most.max(mean.abs() / deviation - SURELY * noise);
            }
        }
    }
    CREEP_FADES * most.ln()
}

/// Standard deviation of one reading of each channel before the first contact of each run.
fn deviations(runs: &[&Session]) -> Vec<f64> {
    let baselines: Vec<Vec<f64>> = runs.iter().map(|run| run.baseline()).collect();
    let deviation = |channel: usize| {
        let frames = runs.iter().zip(&baselines).flat_map(|(run, baseline)| {
            let rows = run.rest_frames().iter();
            rows.map(move |row| (row[channel] - baseline[channel]).powi(2))
        });
        let (sum, count) = frames.fold((0.0, 0.0), |(sum, count), square| {
            (sum + square, count + 1.0)
        });
        // A quiet channel steps by its least digit.
        (sum / f64::max(count, 1.0))
            .sqrt()
            .max(least_step(runs, channel))
            .max(f64::MIN_POSITIVE)
    };
    let width = baselines.first().map_or(0, Vec::len);
    (0..width).map(deviation).collect()
}

/// Smallest change of a channel from frame to frame.
fn least_step(runs: &[&Session], channel: usize) -> f64 {
    let pairs = runs.iter().flat_map(|run| run.sensor.rows().windows(2));
    let steps = pairs.map(|pair| (pair[1][channel] - pair[0][channel]).abs());
    let least = steps
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}
