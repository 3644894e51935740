//! Held-out figures of the estimator that runs live: the frames of a run through the same code.

use taxel::acquisition::Frame;
use taxel::estimation::{ArrayEstimator, Scale, TrainedArea, TrainedReader};
use taxel::trained::{TrainedMaps, TrainingError};

use super::Series;

/// Frames of the rest capture at the start of a run, as live takes it.
pub(crate) const REST_FRAMES: usize = 50;

/// Force and its standard deviation, N, of every frame of a recording, as `taxel live` and
/// `taxel estimate` give them: with their rest capture, baseline and health of channels. `NaN`
/// where they give none.
///
/// # Errors
/// [`TrainingError`] for maps that do not belong together.
pub(crate) fn replayed(
    maps: &TrainedMaps,
    sensor: &Series,
) -> Result<Vec<[f64; 2]>, TrainingError> {
    let area = TrainedArea {
        rows: 1,
        columns: 1,
        pitch: [1.0; 2],
    };
    let names = (1..=maps.channels).map(|number| number.to_string());
    let force = TrainedMaps {
        position: None,
        ..maps.clone()
    };
    let reading = Scale::new("reading", "counts", 1.0);
    let reader = TrainedReader::new(force, area, names.collect(), reading, 1.0)?;
    let mut estimator = ArrayEstimator::new(Box::new(reader));
    estimator.begin_unasked_rest_capture(REST_FRAMES);
    let start = sensor.times().first().copied().unwrap_or(0.0);
    let frames = (0..).zip(sensor.times()).zip(sensor.rows());
    let estimates = frames.map(|((sequence, time), values)| {
        let frame = Frame {
            sequence,
            time_ns: ((time - start) * 1e9).round() as u64,
            values: values.clone(),
            ..Frame::default()
        };
        // Every frame of a recording has as many channels.
        let touch = estimator.push(&frame).ok().map(|(touch, _)| touch);
        let force = touch.and_then(taxel::estimation::Touch::pressing_force);
        force.unwrap_or([f64::NAN; 2])
    });
    Ok(estimates.collect())
}
