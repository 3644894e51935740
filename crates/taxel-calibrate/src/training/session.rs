//! A sensor and the motion stage that pressed it, each at its own times.

use super::{ScaleClock, Series};
use crate::options::ScaleUnit;
use taxel::InputError;
use taxel::trained::Component;

/// Standard acceleration of gravity, m/s²: grams of a scale to newtons.
pub const STANDARD_GRAVITY: f64 = 9.80665;
/// Value that the scale of a stage writes when it has nothing new.
const NO_READING: f64 = -1.0;
/// A stage has begun to move beyond this distance from its start, m.
const MOVED: f64 = 1e-6;
/// A force above this share of its peak is a contact.
pub(crate) const CONTACT_SHARE: f64 = 0.05;
/// A reading of the stage this many usual steps of the sensor from its next
/// frame was taken while the sensor was not read.
const APART: f64 = 2.0;
/// Frames of a baseline, at least and at most.
const BASELINE_FRAMES: [usize; 2] = [5, 50];

/// A recording of a sensor with the readings of its stage.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// Channels of the sensor, raw.
    pub sensor: Series,
    /// Place of the probe (x, y, z), m.
    pub place: Series,
    /// Force of the probe, N, at the times of new readings; `None` without a scale.
    pub force: Option<Series>,
    /// Other components of the force and the moment, SI, at the times of their readings.
    pub components: Vec<(Component, Series)>,
    /// Readings at rest, as a rest capture at the start of the run takes them; without it those
    /// before the probe moved.
    pub rest: Option<Vec<f64>>,
    /// When the scale measured what it showed at the times of its readings; `None`: just then.
    pub scale_clock: Option<ScaleClock>,
}

impl Session {
    /// Joins `sensor` with the readings of the stage: x, y, z in mm and, where
    /// it has a scale, its reading in grams (−1: nothing new). Readings of the stage
    /// before, after and in outages of the sensor are left out.
    ///
    /// # Errors
    /// [`InputError`] about `file`, the file of the stage, when its rows have
    /// another number of columns or the two do not overlap in time.
    pub fn new(file: &str, sensor: Series, stage: &Series) -> Result<Self, InputError> {
        Self::with_scale(file, sensor, stage, ScaleUnit::Grams)
    }

    /// The same for a scale that reads in `unit`.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_scale(
        file: &str,
        sensor: Series,
        stage: &Series,
        unit: ScaleUnit,
    ) -> Result<Self, InputError> {
        let newtons = match unit {
            ScaleUnit::Grams => 1e-3 * STANDARD_GRAVITY,
            ScaleUnit::Newtons => 1.0,
        };
        if !matches!(stage.width(), 3 | 4) {
            let message = format!("a row has {} numbers beside the time", stage.width());
            return Err(InputError::whole(file, message)
                .help("give time [s], x, y, z [mm] and, if there is a scale, its reading [g]"));
        }
        let ends = |series: &Series| [series.times()[0], series.times()[series.times().len() - 1]];
        let (sensor_ends, stage_ends) = (ends(&sensor), ends(stage));
        if sensor_ends[0] > stage_ends[1] || stage_ends[0] > sensor_ends[1] {
            let message = format!(
                "the stage moved from {} s to {} s, the sensor was read from {} s to {} s",
                stage_ends[0], stage_ends[1], sensor_ends[0], sensor_ends[1]
            );
            return Err(InputError::whole(file, message).help("give two files of one recording"));
        }
        let reach = APART * sensor.usual_step();
        let rows = stage.times().iter().zip(stage.rows());
        let read: Vec<_> = rows
            .filter(|(time, _)| sensor.distance(**time) <= reach)
            .collect();
        let place = |row: &Vec<f64>| row[..3].iter().map(|mm| mm * 1e-3).collect();
        let places = read.iter().map(|(time, row)| (**time, place(row)));
        let (place_times, places): (Vec<_>, Vec<_>) = places.unzip();
        if places.is_empty() {
            let message = "the stage has no reading while the sensor was read";
            return Err(InputError::whole(file, message).help("give two files of one recording"));
        }
        let readings = read.iter().filter_map(|(time, row)| {
            let reading = row.get(3).filter(|g| g.is_finite() && **g != NO_READING)?;
            Some((**time, vec![reading * newtons]))
        });
        let (times, forces): (Vec<_>, Vec<_>) = readings.unzip();
        Ok(Self {
            sensor,
            place: Series::new(place_times, places)
                .ok_or_else(|| InputError::whole(file, "the times do not rise"))?,
            force: Series::new(times, forces).filter(|force| force.times().len() > 1),
            components: Vec::new(),
            rest: None,
            scale_clock: None,
        })
    }

    /// The sensor without contact: the rest that was captured, or the mean of the frames before
    /// the probe began to move, at most 50 frames, and at least 5, as a pause may be missing.
    pub fn baseline(&self) -> Vec<f64> {
        if let Some(rest) = &self.rest {
            return rest.clone();
        }
        let frames = self.rest_frames();
        (0..self.sensor.width())
            .map(|c| frames.iter().map(|row| row[c]).sum::<f64>() / frames.len() as f64)
            .collect()
    }

    /// Those frames. Without a stage the force shows when contact begins, and
    /// shows it late: then they are the first half of the frames before.
    pub fn rest_frames(&self) -> &[Vec<f64>] {
        let start = &self.place.rows()[0];
        let moved = |row: &Vec<f64>| row.iter().zip(start).any(|(a, b)| (a - b).abs() > MOVED);
        let begin = self.place.rows().iter().position(moved);
        let begin = begin.map_or(f64::INFINITY, |row| self.place.times()[row]);
        // A place that is written from the first press on begins with it.
        let first = self.place.times()[0];
        let late = first - self.sensor.times()[0] > APART * self.sensor.usual_step();
        let begin = if late { first } else { begin };
        let pressed = self.first_force().unwrap_or(f64::INFINITY);
        let before = |time: f64| self.sensor.times().partition_point(|t| *t < time);
        let still = if pressed < begin {
            before(pressed) / 2
        } else {
            before(begin)
        };
        let [least, most] = BASELINE_FRAMES;
        &self.sensor.rows()[..still.clamp(least, most).min(self.sensor.rows().len())]
    }

    /// Largest reading of the scale, N; zero without one.
    pub fn peak_force(&self) -> f64 {
        let readings = self.force.iter().flat_map(Series::rows);
        readings.map(|row| row[0]).fold(0.0, f64::max)
    }

    /// Largest reading of the scale in the first half of the time before contact, N: of nothing.
    pub(crate) fn no_force(&self) -> f64 {
        let Some(force) = &self.force else { return 0.0 };
        let begin = self.first_force().unwrap_or(f64::INFINITY);
        let before = force.times().partition_point(|time| *time < begin);
        let rows = &force.rows()[..before.div_ceil(2)];
        rows.iter().fold(0.0, |most, row| row[0].max(most))
    }

    /// When the force first shows a contact, s.
    fn first_force(&self) -> Option<f64> {
        let force = self.force.as_ref()?;
        let least = CONTACT_SHARE * self.peak_force();
        let row = force.rows().iter().position(|row| row[0] > least)?;
        Some(force.times()[row])
    }
}
