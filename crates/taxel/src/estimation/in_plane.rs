//! One capacitance of each taxel to the force on it, in-plane sensors (P1).

use super::capacitors::{capacitor_facts, capacitor_scale};
use super::numbers::convert_within;
use super::reader::{
    Division, Drift, Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total,
    counting,
};
use super::touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch};
use super::{ChannelFacts, FrameError, Wiring};
use crate::acquisition::Quantity;
use crate::calibration::InPlaneCalibration;
use crate::mechanics::LoadHistory;
use crate::signal::NumberScale;
use crate::transduction::{ForceCurve, InPlaneError, InPlaneModel};

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

/// Reads arrays of in-plane sensors.
#[derive(Debug, Clone)]
pub struct InPlaneReader {
    drawn: InPlaneCalibration,
    calibration: InPlaneCalibration,
    curves: Vec<ForceCurve>,
    /// Numbers of a frame to capacitances.
    scale: NumberScale,
    meaning: Meaning,
    channels: Vec<ChannelFacts>,
    histories: Vec<LoadHistory>,
}

/// Why an in-plane sensor cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InPlaneReaderError {
    /// The frames cannot be of this device.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A taxel's model has no way back.
    #[error(transparent)]
    Model(#[from] InPlaneError),
}

impl InPlaneReader {
    /// A reader of frames whose values are `quantity`.
    ///
    /// # Errors
    /// [`InPlaneReaderError`].
    pub fn new(
        calibration: InPlaneCalibration,
        quantity: Quantity,
    ) -> Result<Self, InPlaneReaderError> {
        let scale = capacitor_scale(calibration.channel, &calibration.unit, quantity)?;
        let mut curves: Vec<ForceCurve> = Vec::with_capacity(calibration.models.len());
        for model in &calibration.models {
            // As drawn, all taxels are alike.
            let alike = curves
                .last()
                .filter(|curve| curve.inverse().model() == model);
            let curve = if let Some(curve) = alike {
                curve.clone()
            } else {
                let inverse = model.inverse()?;
                inverse.check()?;
                ForceCurve::new(inverse)
            };
            curves.push(curve);
        }
        let channels = calibration.deviation.iter().zip(&calibration.masked);
        Ok(Self {
            channels: channels
                .map(|(sigma, masked)| capacitor_facts(&scale, *sigma, *masked))
                .collect(),
            histories: vec![LoadHistory::default(); calibration.layout.taxels()],
            meaning: meaning(&calibration, &curves),
            curves,
            drawn: calibration.clone(),
            calibration,
            scale,
        })
    }

    /// The calibration in force.
    pub fn calibration(&self) -> &InPlaneCalibration {
        &self.calibration
    }

    /// The force that is left of the force of loading.
    fn carried(&mut self, taxel: usize, loading: TaxelTouch) -> TaxelTouch {
        let Some(law) = self.calibration.hysteresis else {
            return loading;
        };
        let share = law.share(&self.histories[taxel].push(loading.pressed()));
        TaxelTouch::pressing(
            share * loading.pressed(),
            share * loading.pressed_deviation(),
            loading.state,
        )
    }
}

impl Reader for InPlaneReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.channels
    }

    fn rules(&self) -> Rules {
        let full_scale = self.meaning.full_scale.unwrap_or(0.0);
        Rules {
            division: Division::Peaks,
            threshold: Threshold::Deviations(CONTACT_DEVIATIONS, CONTACT_SHARE * full_scale),
            counted: counting(&[State::Ok]),
            total: Total::Counted,
            drift: Drift::Followed,
            rest: RestRules {
                refused: None,
                at_start: true,
                channels_per_unit: 1,
                unit: "taxel",
                measures_noise: true,
                ends_at_touch: false,
            },
        }
    }

    fn noise(&self) -> Vec<f64> {
        self.drawn.deviation.clone()
    }

    fn rest(&self) -> Vec<f64> {
        let models = self.calibration.models.iter();
        models.map(InPlaneModel::rest_capacitance).collect()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        convert_within(&self.scale, values, channels)
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        let channels = &mut touch.channels;
        let slots = channels.readings.iter().zip(&mut channels.states);
        for (taxel, (capacitance, state)) in slots.enumerate() {
            touch.taxels[taxel] = match state {
                ChannelState::Masked => TaxelTouch::without_value(State::Masked),
                ChannelState::Faulty | ChannelState::Saturated => {
                    TaxelTouch::without_value(State::Faulty)
                }
                ChannelState::Ok | ChannelState::Closed => {
                    let noise = known.noise[taxel];
                    let loading = estimated(
                        &self.curves[taxel],
                        capacitance - known.drift(taxel),
                        (noise * noise + known.drift_variance(taxel)).sqrt(),
                    );
                    if loading.state == State::Faulty {
                        *state = ChannelState::Faulty;
                    }
                    self.carried(taxel, loading)
                }
            };
        }
    }

    fn rest_problem(&self, unit: usize, rest: &[f64]) -> Option<String> {
        let drawn = &self.drawn.models[unit];
        let reading = rest.first().copied().filter(|reading| !reading.is_nan())?;
        drawn.at_rest(reading).is_none().then(|| {
            format!(
                "taxel {unit} reads {:.1} fF, which belongs to no gap near the drawn one of \
                 {:.1} um; check it or mask it",
                1e15 * reading,
                1e6 * drawn.electrodes.gap
            )
        })
    }

    fn set_rest(&mut self, rest: &[f64], noise: &[f64]) {
        for (taxel, (rest, noise)) in rest.iter().zip(noise).enumerate() {
            let drawn = &self.drawn.models[taxel];
            // The value was accepted when it was captured; without a way back
            // the taxel stays as drawn.
            let model = drawn.at_rest(*rest);
            let found = model.and_then(|model| {
                let inverse = model.inverse().ok()?;
                inverse.check().is_ok().then_some((inverse, model))
            });
            let (inverse, model) = match found {
                Some(found) => found,
                None => match drawn.inverse() {
                    Ok(inverse) => (inverse, drawn.clone()),
                    Err(_) => continue,
                },
            };
            self.curves[taxel] = ForceCurve::new(inverse);
            self.calibration.models[taxel] = model;
            self.calibration.deviation[taxel] = *noise;
        }
        self.histories.fill(LoadHistory::default());
    }
}

/// Force of one reading, F, with the standard deviation `sigma`, F.
fn estimated(curve: &ForceCurve, capacitance: f64, sigma: f64) -> TaxelTouch {
    let inverse = curve.inverse();
    let last = inverse.last();
    let rest = inverse.model().rest_capacitance();
    let possible = LEAST_SHARE * last.capacitance..=rest / LEAST_SHARE;
    if !possible.contains(&capacitance) {
        return TaxelTouch::without_value(State::Faulty);
    }
    let change = rest - capacitance;
    if change < -ABOVE_REST * sigma {
        return TaxelTouch::without_value(State::BelowZero);
    }
    if change > last.change {
        // The force at the end of the range is a lower bound.
        let state = match inverse.turning() {
            Some(_) => State::Ambiguous,
            None => State::OutOfRange,
        };
        return TaxelTouch::pressing(last.layer.force, f64::NAN, state);
    }
    // Over two standard deviations rather than by the slope: the published law
    // has none at rest.
    let [low, high] = [change - sigma, (change + sigma).min(last.change)];
    let spread = curve.force(high) - curve.force(low);
    TaxelTouch::pressing(
        curve.force(change),
        sigma * spread / (high - low),
        State::Ok,
    )
}

fn meaning(calibration: &InPlaneCalibration, curves: &[ForceCurve]) -> Meaning {
    let layout = &calibration.layout;
    let full_scale = curves
        .iter()
        .map(|curve| curve.inverse().last().layer.force)
        .fold(0.0, f64::max);
    Meaning {
        layout: layout.clone(),
        in_metres: true,
        channels: (0..layout.taxels())
            .map(|taxel| {
                let (row, column) = (taxel / layout.columns, taxel % layout.columns);
                format!("row {row}, column {column}")
            })
            .collect(),
        wiring: Wiring::PerTaxel(1),
        reading: Scale::of(&calibration.unit, Scale::new("capacitance", "fF", 1e-15)),
        value: Scale::new("force", "N", 1.0),
        components: 1,
        signed: false,
        full_scale: Some(full_scale),
        verified: None,
        picture: Picture::Heat,
        newtons: Some([1.0; 2]),
        total_known: true,
    }
}
