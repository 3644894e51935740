//! Rest capture (tare): the capacitances of the mounted, unloaded device.

use super::Calibration;

/// Collects readings at rest and turns them into a calibration.
#[derive(Debug, Clone)]
pub struct RestCapture {
    wanted: usize,
    frames: usize,
    /// Running mean and sum of squared deviations of every capacitor, F, F²,
    /// with the number of its readings (Welford).
    readings: Vec<[Running; 4]>,
}

/// Running mean and sum of squared deviations (Welford).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Running {
    count: f64,
    mean: f64,
    squares: f64,
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
pub(super) const MOVING: f64 = 3.0;
/// Taxels that may move or be impossible before the capture is refused: a few
/// broken ones must not block the others.
pub(super) const TOLERATED_SHARE: f64 = 0.1;

impl RestCapture {
    /// Averages over `frames` frames of `taxels` taxels; the paper uses 50.
    pub fn new(taxels: usize, frames: usize) -> Self {
        Self {
            wanted: frames.max(2),
            frames: 0,
            readings: vec![[Running::default(); 4]; taxels],
        }
    }

    /// Adds the capacitances of one frame, F; `NaN` for no reading. Returns
    /// whether the capture is complete.
    pub fn push(&mut self, capacitance: impl Iterator<Item = [f64; 4]>) -> bool {
        for (running, values) in self.readings.iter_mut().zip(capacitance) {
            for (running, value) in running.iter_mut().zip(values) {
                running.push(value);
            }
        }
        self.frames += 1;
        self.frames >= self.wanted
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
        let tolerated = (TOLERATED_SHARE * taxels as f64) as usize;
        let mut found = calibration.clone();
        let (mut moving, mut most) = (0, (0, 0.0));
        let mut impossible = Vec::new();
        for (taxel, running) in self.readings.iter().enumerate().take(taxels) {
            let noise = calibration.deviation[taxel];
            let ratio = (0..4)
                .filter(|i| !calibration.masked[taxel][*i] && running[*i].count > 1.0)
                .map(|i| running[i].deviation() / noise[i])
                .fold(0.0, f64::max);
            if ratio > MOVING {
                moving += 1;
                if ratio > most.1 {
                    most = (taxel, ratio);
                }
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
                None => impossible.push((taxel, rest)),
            }
        }
        if moving > tolerated {
            return Err(RestRefused::Moving {
                moving,
                taxels,
                taxel: most.0,
                ratio: most.1,
            });
        }
        match impossible.first() {
            Some((taxel, rest)) if impossible.len() > tolerated => {
                let femtofarad = 1e15 * rest.iter().copied().fold(0.0, f64::max);
                Err(RestRefused::Impossible {
                    taxel: *taxel,
                    femtofarad,
                })
            }
            _ => Ok(found),
        }
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
    pub(super) fn push(&mut self, value: f64) {
        if value.is_finite() {
            self.count += 1.0;
            let before = value - self.mean;
            self.mean += before / self.count;
            self.squares += before * (value - self.mean);
        }
    }

    pub(super) fn deviation(&self) -> f64 {
        (self.squares / (self.count - 1.0)).sqrt()
    }

    pub(super) fn mean_or_nan(&self) -> f64 {
        if self.count > 0.0 {
            self.mean
        } else {
            f64::NAN
        }
    }
}
