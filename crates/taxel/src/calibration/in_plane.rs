//! What is known of an array of in-plane capacitive sensors, and its rest
//! capture.

use super::ChannelScale;
use super::rest::{Against, RestReadings, deviation};
use crate::layout::Layout;
use crate::mechanics::ForceHysteresis;
use crate::transduction::InPlaneModel;

/// All that estimation needs to know of an array of in-plane sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct InPlaneCalibration {
    /// Where the taxels are.
    pub layout: Layout,
    /// Counts to capacitance.
    pub channel: ChannelScale,
    /// The model of each taxel.
    pub models: Vec<InPlaneModel>,
    /// Standard deviation of one reading of each taxel, F.
    pub deviation: Vec<f64>,
    /// Taxels that are not used.
    pub masked: Vec<bool>,
    /// What unloading carries less than loading, where slow loops told it.
    pub hysteresis: Option<ForceHysteresis>,
}

/// Collects readings at rest and turns them into a calibration.
#[derive(Debug, Clone)]
pub struct InPlaneRestCapture(RestReadings);

/// Why a rest capture was refused; the calibration stays as it was.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum InPlaneRestRefused {
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
    /// The mean readings belong to no gap near the drawn one.
    #[error(
        "rest capture refused: taxel {taxel} reads {femtofarad:.1} fF, which belongs to no gap near the drawn one of \
         {micrometres:.1} um; check it or mask it"
    )]
    Impossible {
        /// The first such taxel.
        taxel: usize,
        /// Its reading.
        femtofarad: f64,
        /// The drawn gap.
        micrometres: f64,
    },
}

impl InPlaneRestCapture {
    /// Averages over `frames` frames of `taxels` taxels.
    pub fn new(taxels: usize, frames: usize) -> Self {
        Self(RestReadings::new(taxels, frames))
    }

    /// Adds the capacitances of one frame, F; `NaN` for no reading. Returns
    /// whether the capture is complete.
    pub fn push(&mut self, capacitance: &[f64]) -> bool {
        self.0.push(capacitance.iter().copied())
    }

    /// The calibration with the gaps and the noise that the capture found.
    ///
    /// A taxel that moved, is impossible or gave no reading keeps its old
    /// values, unless there are so many that the device cannot have been at
    /// rest.
    ///
    /// # Errors
    /// [`InPlaneRestRefused`], and then nothing has changed.
    pub fn finish(
        &self,
        calibration: &InPlaneCalibration,
    ) -> Result<InPlaneCalibration, InPlaneRestRefused> {
        let taxels = calibration.models.len();
        let tolerated = Against::tolerated(taxels);
        let mut found = calibration.clone();
        let mut against = Against::default();
        for (taxel, running) in self.0.channels().iter().enumerate().take(taxels) {
            let noise = calibration.deviation[taxel];
            let ratio = running.deviation() / noise;
            if calibration.masked[taxel] || ratio.is_nan() {
                continue;
            }
            if against.moved(taxel, ratio) {
                continue;
            }
            let rest = running.mean_or_nan();
            match calibration.models[taxel].at_rest(rest) {
                Some(model) => {
                    found.models[taxel] = model;
                    found.deviation[taxel] = deviation(running, noise);
                }
                None => against.cannot_be(taxel, rest),
            }
        }
        if against.moving > tolerated {
            return Err(InPlaneRestRefused::Moving {
                moving: against.moving,
                taxels,
                taxel: against.most.0,
                ratio: against.most.1,
            });
        }
        if against.impossible > tolerated {
            let (taxel, reading) = against.first;
            return Err(InPlaneRestRefused::Impossible {
                taxel,
                femtofarad: 1e15 * reading,
                micrometres: 1e6 * calibration.models[taxel].electrodes.gap,
            });
        }
        Ok(found)
    }
}
