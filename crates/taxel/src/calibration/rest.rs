//! Rest capture (tare): the readings of the mounted, unloaded device.

use super::Calibration;

/// Collects readings at rest and turns them into a calibration.
#[derive(Debug, Clone)]
pub struct RestCapture(RestReadings);

/// Mean and scatter of every channel over the frames of a rest capture, of any
/// device.
#[derive(Debug, Clone)]
pub struct RestReadings {
    wanted: usize,
    frames: usize,
    channels: Vec<Running>,
}

/// Running mean and sum of squared deviations of one channel (Welford).
#[derive(Debug, Clone, Copy, Default)]
pub struct Running {
    count: f64,
    mean: f64,
    squares: f64,
}

impl RestReadings {
    /// Collects over `frames` frames (at least two) of `channels` channels.
    pub fn new(channels: usize, frames: usize) -> Self {
        Self {
            wanted: frames.max(2),
            frames: 0,
            channels: vec![Running::default(); channels],
        }
    }

    /// Adds one frame; `NaN` for no reading. Returns whether the capture is
    /// complete.
    pub fn push(&mut self, values: impl IntoIterator<Item = f64>) -> bool {
        for (running, value) in self.channels.iter_mut().zip(values) {
            running.push(value);
        }
        self.frames += 1;
        self.frames >= self.wanted
    }

    /// What each channel read.
    pub fn channels(&self) -> &[Running] {
        &self.channels
    }
}

/// Taxels that stand against a capture: those that moved, and those whose mean
/// belongs to no unloaded device.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Against {
    pub(super) moving: usize,
    /// The taxel that moved most, and its scatter over its noise.
    pub(super) most: (usize, f64),
    pub(super) impossible: usize,
    /// The first impossible taxel and its reading, F.
    pub(super) first: (usize, f64),
}

impl Against {
    /// Whether a taxel moved by `ratio` times its noise; then it is counted.
    pub(super) fn moved(&mut self, taxel: usize, ratio: f64) -> bool {
        let moved = ratio > MOVING;
        self.moving += usize::from(moved);
        if moved && ratio > self.most.1 {
            self.most = (taxel, ratio);
        }
        moved
    }

    /// Counts a taxel whose mean reading, F, is impossible at rest.
    pub(super) fn cannot_be(&mut self, taxel: usize, reading: f64) {
        if self.impossible == 0 {
            self.first = (taxel, reading);
        }
        self.impossible += 1;
    }

    /// How many of `taxels` may stand against a capture.
    pub(super) fn tolerated(taxels: usize) -> usize {
        (TOLERATED_SHARE * taxels as f64) as usize
    }
}

/// Why a rest capture was refused; the calibration stays as it was.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RestRefused {
    /// Readings moved while they were captured.
    #[error(
        "rest capture refused: {moving} of {taxels} taxels moved during it (taxel {taxel} by {ratio:.0} times its noise); \
         lift off and try again"
    )]
    Moving {
        /// Taxels that moved.
        moving: usize,
        /// Taxels of the array.
        taxels: usize,
        /// The taxel that moved most.
        taxel: usize,
        /// Its scatter over its noise.
        ratio: f64,
    },
    /// The mean readings cannot belong to an unloaded device.
    #[error(
        "rest capture refused: taxel {taxel} reads {femtofarad:.1} fF, which leaves no air gap; check it or mask it"
    )]
    Impossible {
        /// The first such taxel.
        taxel: usize,
        /// Its reading.
        femtofarad: f64,
    },
}

/// Scatter over noise above which a taxel counts as moving. With 50 readings
/// the ratio of a quiet taxel stays below 1.4 in all but one of 10⁵ captures.
pub const MOVING: f64 = 3.0;
/// Taxels that may move or be impossible before the capture is refused: a few
/// broken ones must not block the others.
const TOLERATED_SHARE: f64 = 0.1;

impl RestCapture {
    /// Averages over `frames` frames of `taxels` taxels; the paper uses 50.
    pub fn new(taxels: usize, frames: usize) -> Self {
        Self(RestReadings::new(4 * taxels, frames))
    }

    /// Adds the capacitances of one frame, F; `NaN` for no reading. Returns
    /// whether the capture is complete.
    pub fn push(&mut self, capacitance: impl Iterator<Item = [f64; 4]>) -> bool {
        self.0.push(capacitance.flatten())
    }

    /// The calibration with the air gaps and the noise that the capture found.
    ///
    /// A taxel that moved or is impossible keeps its old values, unless there
    /// are so many that the device cannot have been at rest.
    ///
    /// # Errors
    /// [`RestRefused`], and then nothing has changed.
    pub fn finish(&self, calibration: &Calibration) -> Result<Calibration, RestRefused> {
        let taxels = calibration.units.len();
        let tolerated = Against::tolerated(taxels);
        let mut found = calibration.clone();
        let mut against = Against::default();
        let readings = self.0.channels().as_chunks::<4>().0;
        for (taxel, running) in readings.iter().enumerate().take(taxels) {
            let noise = calibration.deviation[taxel];
            let ratio = (0..4)
                .filter(|i| !calibration.masked[taxel][*i] && running[*i].count > 1.0)
                .map(|i| running[i].deviation() / noise[i])
                .fold(0.0, f64::max);
            if against.moved(taxel, ratio) {
                continue;
            }
            let rest: [f64; 4] = std::array::from_fn(|i| {
                if calibration.masked[taxel][i] {
                    f64::NAN
                } else {
                    running[i].mean_or_nan()
                }
            });
            match calibration.units[taxel].at_rest(rest) {
                Some(unit) => {
                    found.units[taxel] = unit;
                    found.deviation[taxel] = deviations(running, noise);
                }
                None => against.cannot_be(taxel, rest.iter().copied().fold(0.0, f64::max)),
            }
        }
        if against.moving > tolerated {
            return Err(RestRefused::Moving {
                moving: against.moving,
                taxels,
                taxel: against.most.0,
                ratio: against.most.1,
            });
        }
        if against.impossible > tolerated {
            return Err(RestRefused::Impossible {
                taxel: against.first.0,
                femtofarad: 1e15 * against.first.1,
            });
        }
        Ok(found)
    }
}

/// Noise of each capacitor, see [`deviation`].
fn deviations(running: &[Running; 4], promised: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| deviation(&running[i], promised[i]))
}

/// Noise of a reading: what was measured, but not less than half of what the
/// board promises (a reading that does not toggle a count hides it), with the
/// uncertainty of the rest value itself.
pub(super) fn deviation(running: &Running, promised: f64) -> f64 {
    if running.count < 2.0 {
        return promised;
    }
    let measured = running.deviation().max(0.5 * promised);
    measured * (1.0 + 1.0 / running.count).sqrt()
}

impl Running {
    fn push(&mut self, value: f64) {
        if value.is_finite() {
            self.count += 1.0;
            let before = value - self.mean;
            self.mean += before / self.count;
            self.squares += before * (value - self.mean);
        }
    }

    /// Standard deviation of the readings; `NaN` for fewer than two.
    pub fn deviation(&self) -> f64 {
        (self.squares / (self.count - 1.0)).sqrt()
    }

    /// Mean of the readings; `NaN` without any.
    pub fn mean_or_nan(&self) -> f64 {
        if self.count > 0.0 {
            self.mean
        } else {
            f64::NAN
        }
    }
}
