//! Frames of in-plane capacitive sensors to the force on each.

use super::baseline::{Baseline, BaselineOptions};
use super::contact::{Cell, normal_only};
use super::segmentation::Segmentation;
use super::{
    FrameError, Picture, RestEnd, RestState, Scale, SignalEstimator, SignalMeaning, SignalTouch,
    State, TaxelValue,
};
use crate::acquisition::{Frame, Quantity};
use crate::calibration::{InPlaneCalibration, InPlaneRestCapture};
use crate::mechanics::LoadHistory;
use crate::transduction::{InPlaneError, InPlaneInverse, InPlaneModel};

/// A reading below this share of the least capacitance of the model, or above
/// its reciprocal times the rest value, is no capacitor.
const LEAST_SHARE: f64 = 0.5;
/// Above its rest value by more standard deviations than this, a capacitor
/// contradicts the model: noise alone does so once in 10⁹ frames.
const ABOVE_REST: f64 = 6.0;
/// A taxel is touched above this many standard deviations of its force.
pub const CONTACT_DEVIATIONS: f64 = 6.0;
/// ... and above this share of the full scale.
pub const CONTACT_SHARE: f64 = 0.01;

/// Turns frames of in-plane sensors into forces.
#[derive(Debug, Clone)]
pub struct InPlaneEstimator {
    drawn: InPlaneCalibration,
    calibration: InPlaneCalibration,
    inverses: Vec<InPlaneInverse>,
    quantity: Quantity,
    meaning: SignalMeaning,
    segmentation: Segmentation,
    baseline: Baseline,
    histories: Vec<LoadHistory>,
    capture: Option<InPlaneRestCapture>,
    touch: SignalTouch,
}

/// Why there is no estimator.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum InPlaneEstimatorError {
    /// The frames cannot be of this device.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A taxel's model has no way back.
    #[error(transparent)]
    Model(#[from] InPlaneError),
}

impl InPlaneEstimator {
    /// An estimator for frames whose values are `quantity`.
    ///
    /// # Errors
    /// [`InPlaneEstimatorError`].
    pub fn new(
        calibration: InPlaneCalibration,
        quantity: Quantity,
    ) -> Result<Self, InPlaneEstimatorError> {
        if !matches!(quantity, Quantity::Counts | Quantity::Capacitance) {
            return Err(FrameError::Quantity { found: quantity }.into());
        }
        let inverses = inverses(&calibration)?;
        let taxels = calibration.layout.taxels();
        let nothing = TaxelValue {
            value: f64::NAN,
            deviation: f64::NAN,
            state: State::Masked,
        };
        let mut baseline = Baseline::new(BaselineOptions::new(calibration.deviation.clone()));
        baseline.tare(0, &rest(&calibration));
        Ok(Self {
            drawn: calibration.clone(),
            baseline,
            histories: vec![LoadHistory::default(); taxels],
            meaning: meaning(&calibration, &inverses),
            segmentation: Segmentation::new(
                calibration.layout.rows,
                calibration.layout.columns,
                calibration.layout.pitch,
            ),
            touch: SignalTouch {
                signals: vec![f64::NAN; taxels],
                rest: rest(&calibration),
                taxels: vec![nothing; taxels],
                ..SignalTouch::default()
            },
            inverses,
            calibration,
            quantity,
            capture: None,
        })
    }

    /// The calibration in force.
    pub fn calibration(&self) -> &InPlaneCalibration {
        &self.calibration
    }

    fn recalibrate(
        &mut self,
        calibration: InPlaneCalibration,
    ) -> Result<(), InPlaneEstimatorError> {
        self.inverses = inverses(&calibration)?;
        self.touch.rest = rest(&calibration);
        self.baseline.set_noise(calibration.deviation.clone());
        self.baseline.tare(self.touch.time_ns, &self.touch.rest);
        self.histories.fill(LoadHistory::default());
        self.calibration = calibration;
        Ok(())
    }

    /// Capacitance of a channel, F; `NaN` for none.
    fn capacitance(&mut self, taxel: usize, value: f64) -> f64 {
        if self.quantity == Quantity::Capacitance {
            return value;
        }
        self.calibration
            .channel
            .capacitance(value)
            .unwrap_or_else(|| {
                let masked = self.calibration.masked[taxel];
                self.touch.clipped += usize::from(!value.is_nan() && !masked);
                f64::NAN
            })
    }

    /// The force that is left of the force of loading.
    fn carried(&mut self, taxel: usize, loading: TaxelValue) -> TaxelValue {
        let Some(law) = self.calibration.hysteresis else {
            return loading;
        };
        let share = law.share(&self.histories[taxel].push(loading.value));
        TaxelValue {
            value: share * loading.value,
            deviation: share * loading.deviation,
            state: loading.state,
        }
    }

    fn capture_frame(&mut self) -> RestEnd {
        let capture = self.capture.as_mut()?;
        if !capture.push(&self.touch.signals) {
            return None;
        }
        let found = capture.finish(&self.calibration);
        self.capture = None;
        Some(match found {
            Ok(calibration) => self
                .recalibrate(calibration)
                .map_err(|error| error.to_string()),
            Err(refused) => Err(refused.to_string()),
        })
    }

    fn sum_up(&mut self) {
        let counting = self.touch.taxels.iter().filter(|taxel| counts(taxel));
        let [force, variance] = counting.fold([0.0; 2], |[force, variance], taxel| {
            [force + taxel.value, variance + taxel.deviation.powi(2)]
        });
        self.touch.force = Some([force, variance.sqrt()]);
        let (layout, taxels) = (&self.calibration.layout, &self.touch.taxels);
        let floor = CONTACT_SHARE * self.meaning.full_scale;
        let cell = |index: usize| {
            let taxel = &taxels[index];
            let weight = if counts(taxel) { taxel.value } else { f64::NAN };
            Cell {
                position: layout.flat_position(index),
                weight,
                deviation: taxel.deviation,
                threshold: floor.max(CONTACT_DEVIATIONS * taxel.deviation),
                force: [0.0, 0.0, weight],
                force_covariance: normal_only(taxel.deviation),
                state: taxel.state,
            }
        };
        self.touch.centre_of_pressure = self.segmentation.run(cell, &mut self.touch.contacts);
        self.segmentation.label(&mut self.touch.regions);
    }
}

impl SignalEstimator for InPlaneEstimator {
    fn meaning(&self) -> &SignalMeaning {
        &self.meaning
    }

    fn push(&mut self, frame: &Frame) -> Result<(&SignalTouch, RestEnd), FrameError> {
        let expected = self.inverses.len();
        if frame.values.len() != expected {
            return Err(FrameError::Channels {
                found: frame.values.len(),
                expected,
            });
        }
        self.touch.sequence = frame.sequence;
        self.touch.time_ns = frame.time_ns;
        self.touch.clipped = 0;
        for (taxel, value) in frame.values.iter().enumerate() {
            let capacitance = self.capacitance(taxel, *value);
            self.touch.signals[taxel] = capacitance;
            self.touch.taxels[taxel] = if self.calibration.masked[taxel] {
                without_value(State::Masked)
            } else {
                let noise = self.calibration.deviation[taxel];
                let loading = felt(
                    &self.inverses[taxel],
                    capacitance - self.baseline.drift(taxel),
                    noise.hypot(self.baseline.deviation(taxel)),
                );
                self.carried(taxel, loading)
            };
        }
        let ended = self.capture_frame();
        self.sum_up();
        let regions = &self.touch.regions;
        self.baseline
            .push(frame.time_ns, &self.touch.signals, |taxel| {
                regions[taxel].is_some()
            });
        Ok((&self.touch, ended))
    }

    fn begin_rest_capture(&mut self, frames: usize) {
        self.capture = Some(InPlaneRestCapture::new(self.inverses.len(), frames));
    }

    fn capturing(&self) -> bool {
        self.capture.is_some()
    }

    fn baseline(&self) -> Option<&Baseline> {
        Some(&self.baseline)
    }

    fn clear_rest(&mut self) {
        // The drawn calibration was accepted when the estimator was made.
        let drawn = self.drawn.clone();
        let _ = self.recalibrate(drawn);
    }

    fn rest_state(&self) -> Option<RestState> {
        Some(RestState::InPlane(Box::new(self.calibration.clone())))
    }

    fn restore_rest(&mut self, rest: &RestState) {
        if let RestState::InPlane(calibration) = rest {
            // It was in force before.
            let _ = self.recalibrate(calibration.as_ref().clone());
        }
    }
}

/// Force of one reading, F, with the standard deviation `sigma`, F.
fn felt(inverse: &InPlaneInverse, capacitance: f64, sigma: f64) -> TaxelValue {
    let last = inverse.last();
    let rest = inverse.model().rest_capacitance();
    let possible = LEAST_SHARE * last.capacitance..=rest / LEAST_SHARE;
    if !possible.contains(&capacitance) {
        return without_value(State::Faulty);
    }
    let change = rest - capacitance;
    if change < -ABOVE_REST * sigma {
        return without_value(State::Inconsistent);
    }
    if change > last.change {
        // The force at the end of the range is a lower bound.
        return TaxelValue {
            value: last.layer.force,
            deviation: f64::NAN,
            state: match inverse.turning() {
                Some(_) => State::Ambiguous,
                None => State::OutOfRange,
            },
        };
    }
    // Over two standard deviations rather than by the slope: the published law
    // has none at rest.
    let [low, high] = [change - sigma, (change + sigma).min(last.change)];
    let spread = inverse.force_from_change(high) - inverse.force_from_change(low);
    TaxelValue {
        value: inverse.force_from_change(change),
        deviation: sigma * spread / (high - low),
        state: State::Ok,
    }
}

/// Whether a value belongs into the total and the contacts.
fn counts(taxel: &TaxelValue) -> bool {
    taxel.state == State::Ok
}

fn without_value(state: State) -> TaxelValue {
    TaxelValue {
        value: f64::NAN,
        deviation: f64::NAN,
        state,
    }
}

fn inverses(calibration: &InPlaneCalibration) -> Result<Vec<InPlaneInverse>, InPlaneError> {
    let models = calibration.models.iter();
    models.map(InPlaneModel::inverse).collect()
}

fn rest(calibration: &InPlaneCalibration) -> Vec<f64> {
    let models = calibration.models.iter();
    models.map(InPlaneModel::rest_capacitance).collect()
}

fn meaning(calibration: &InPlaneCalibration, inverses: &[InPlaneInverse]) -> SignalMeaning {
    let layout = &calibration.layout;
    let full_scale = inverses
        .iter()
        .map(|inverse| inverse.last().layer.force)
        .fold(0.0, f64::max);
    SignalMeaning {
        rows: layout.rows,
        columns: layout.columns,
        pitch: [layout.pitch[1], layout.pitch[0]],
        channels: (0..layout.taxels())
            .map(|taxel| {
                let (row, column) = (taxel / layout.columns, taxel % layout.columns);
                format!("row {row}, column {column}")
            })
            .collect(),
        signal: Scale {
            quantity: "capacitance",
            symbol: "fF",
            si_per_unit: 1e-15,
        },
        value: Scale {
            quantity: "force",
            symbol: "N",
            si_per_unit: 1.0,
        },
        full_scale,
        signed: false,
        picture: Picture::Heat,
    }
}
