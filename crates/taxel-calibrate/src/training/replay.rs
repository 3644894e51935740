//! Held-out figures of the estimator that runs live: the frames of a run through the same code.

use rayon::prelude::*;
use taxel::acquisition::Frame;
use taxel::estimation::{ArrayEstimator, Scale, Touch, TrainedArea, TrainedReader};
use taxel::trained::{ForceMap, Relation, RestStatistics, Ridge, TrainedMaps, TrainingError};

use super::force::{blocks_of, known_before, moments_of, moments_of_all};
use super::{ForceOptions, HeldOutForce, Series, Session, TrainingRun};

/// Frames of the rest capture at the start of a run, as live takes it.
pub(crate) const REST_FRAMES: usize = 50;

/// An estimate of a touch with its standard deviation, SI; `NaN` where there is none.
pub(super) type Of<'a> = &'a (dyn Fn(&Touch) -> [f64; 2] + Sync);

/// Runs with what live knows beside the map of the force.
pub(super) struct Live<'a> {
    pub(super) runs: &'a [Session],
    pub(super) rest: &'a RestStatistics,
    pub(super) relation: Option<&'a Relation>,
}

impl Live<'_> {
    /// An estimate with its standard deviation of every frame of a run, as `taxel live` and
    /// `taxel estimate` give it: with their rest capture, baseline and health of channels.
    pub(super) fn played(
        &self,
        map: ForceMap,
        run: usize,
        of: Of<'_>,
    ) -> Result<Series, TrainingError> {
        let maps = TrainedMaps {
            channels: map.standard.channels,
            rest: Some(self.rest.clone()),
            position: None,
            force: Some(map),
            relation: self.relation.cloned(),
        };
        let sensor = &self.runs[run].sensor;
        let frames = replayed(maps, sensor, of)?.into_iter().map(Vec::from);
        Series::new(sensor.times().to_vec(), frames.collect()).ok_or(TrainingError::TooFew {
            found: 0,
            needed: 2,
        })
    }

    /// Estimates of the readings that are held out, over the frames of the whole runs, of maps of the
    /// features of `form`. `map` is the map of a ridge, without the factors that the held-out rows
    /// have yet to give.
    pub(super) fn held_out(
        &self,
        readings: &[TrainingRun],
        (form, options): (&ForceMap, &ForceOptions),
        map: &(dyn Fn(Ridge) -> ForceMap + Sync),
        of: Of<'_>,
    ) -> Result<HeldOutForce, TrainingError> {
        let blocks = blocks_of(readings, options);
        let parts = moments_of(readings, &blocks)?;
        let all = moments_of_all(&parts)?;
        let found: Vec<HeldOutForce> = blocks
            .par_iter()
            .enumerate()
            .filter_map(|(number, block)| {
                let known = (number, options.learned_from);
                Some((block, known_before(&blocks, &parts, &all, known)?))
            })
            .map(|(block, known)| {
                let ridge = options.ridge(&known, form)?;
                let map = map(ridge.clone());
                let [offset, longest_step] = [map.offset, map.longest_step];
                let estimates = self.played(map, block.run, of)?;
                let run = &readings[block.run];
                let mut found = HeldOutForce::default();
                for row in block.rows.clone() {
                    let time = run.times[row];
                    let estimate = estimates.at(time - offset, longest_step);
                    let Some(&[value, deviation]) = estimate.as_deref() else {
                        continue;
                    };
                    if f64::is_finite(value) {
                        let noise = ridge.noise_variance().sqrt();
                        let own = noise * (1.0 + ridge.leverage(&run.features[row])).sqrt();
                        let beside = (deviation * deviation - own * own).max(0.0).sqrt();
                        let reading = [time, run.force[row]];
                        found.push(block.run, reading, [value, own], [noise, beside]);
                    }
                }
                Ok(found)
            })
            .collect::<Result<_, TrainingError>>()?;
        let mut held_out = HeldOutForce::default();
        for part in found {
            held_out.append(part);
        }
        Ok(held_out)
    }
}

fn replayed(
    maps: TrainedMaps,
    sensor: &Series,
    of: Of<'_>,
) -> Result<Vec<[f64; 2]>, TrainingError> {
    let area = TrainedArea {
        rows: 1,
        columns: 1,
        pitch: [1.0; 2],
    };
    let names = (1..=maps.channels).map(|number| number.to_string());
    let reading = Scale::new("reading", "counts", 1.0);
    let reader = TrainedReader::new(maps, area, names.collect(), reading, 1.0)?;
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
        let touch = estimator.push(&frame).ok();
        touch.map_or([f64::NAN; 2], |(touch, _)| of(touch))
    });
    Ok(estimates.collect())
}
