//! The readings of crossing channels as a least-squares problem.

use crate::split::OfSeries;
use taxel::mechanics::{ClosingState, PressureLaw, Stretch};
use taxel::signal::ResistanceSignal;
use taxel::transduction::{MicrochannelLayer, mean_inverse_area_ratio};
use taxel_numerics::least_squares::{Parameter, Problem};

/// Places of the parameters that all channels share; the rest resistances of
/// the channels that were read follow.
pub(super) const LEAD: usize = 0;
pub(super) const STIFFNESS: [usize; 2] = [1, 2];
pub(super) const EXPANSION: usize = 3;
pub(super) const BIAS: usize = 4;
pub(super) const SHARED: usize = 5;

/// One reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reading {
    pub(super) channel: usize,
    /// 0 for rows, 1 for columns.
    pub(super) layer: usize,
    pub(super) load: Load,
    /// Loaded share of the length.
    pub(super) share: f64,
    /// Voltage of the divider, V, or resistance with the leads, Ω, as the board gives it.
    pub(super) signal: f64,
    /// Standard deviation that the bench gives, in the same unit.
    pub(super) deviation: Option<f64>,
    /// True if the signal says no more than that the load is at least as large.
    pub(super) saturated: bool,
    pub(super) marked: bool,
}

impl OfSeries for Reading {
    fn series(&self) -> usize {
        self.channel
    }

    fn is_marked(&self) -> bool {
        self.marked
    }
}

/// Load on a microchannel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Load {
    /// Pa.
    Pressure(f64),
    /// N on an area in m².
    Force(f64, f64),
}

impl Load {
    /// Pressure for a force bias in N, Pa: none below it.
    pub(super) fn pressure(self, bias: f64) -> f64 {
        match self {
            Self::Pressure(pressure) => pressure.max(0.0),
            Self::Force(force, area) => ((force - bias) / area).max(0.0),
        }
    }
}

/// The problem of some readings.
pub(super) struct Bench<'a> {
    pub(super) layers: &'a [MicrochannelLayer; 2],
    pub(super) signal: ResistanceSignal,
    /// Channels that were read, in the order of their parameters.
    pub(super) channels: Vec<usize>,
    pub(super) readings: &'a [Reading],
    /// Standard deviation of each reading.
    pub(super) noise: Vec<f64>,
}

/// A reading by the model.
pub(super) struct Predicted {
    /// Resistance over that at rest.
    pub(super) ratio: f64,
    /// True if the closing curve does not reach so far.
    pub(super) beyond: bool,
}

impl Bench<'_> {
    /// Index of the rest resistance of a reading's channel.
    fn rest(&self, reading: &Reading) -> usize {
        let found = self.channels.iter().position(|c| *c == reading.channel);
        SHARED + found.unwrap_or(0)
    }

    /// Resistance over that at rest: pressures over the stiffness are those of
    /// the drawn closing curve, and so is the law of the liquid.
    pub(super) fn ratio(&self, at: &[f64], reading: &Reading) -> Option<Predicted> {
        let stiffness = at[STIFFNESS[reading.layer]];
        let layer = &self.layers[reading.layer];
        let pressure = reading.load.pressure(at[BIAS]) / stiffness;
        let stretches = [
            Stretch {
                share: reading.share,
                pressure,
            },
            Stretch {
                share: 1.0 - reading.share,
                pressure: 0.0,
            },
        ];
        let settled = layer
            .closing
            .settle(
                &softened(&layer.liquid, stiffness, at[EXPANSION]),
                &stretches,
            )
            .ok()?;
        let parts = stretches.iter().zip(&settled.sections);
        Some(Predicted {
            ratio: mean_inverse_area_ratio(parts.map(|(part, at)| (part.share, at.conductance))),
            beyond: matches!(settled.sections[0].state, ClosingState::Beyond { .. }),
        })
    }

    /// Signal by the model.
    pub(super) fn predict(&self, at: &[f64], reading: &Reading) -> Option<f64> {
        let ratio = self.ratio(at, reading)?.ratio;
        let signal = self.signal.with_lead(at[LEAD]);
        Some(signal.of(at[self.rest(reading)] * ratio))
    }
}

/// The law with its pressures divided by `stiffness`, with the expansion η.
fn softened(law: &PressureLaw, stiffness: f64, expansion: f64) -> PressureLaw {
    let mut law = law.clone();
    match &mut law {
        PressureLaw::Paper(paper) => {
            paper.expansion = expansion;
            paper.atmosphere /= stiffness;
        }
        PressureLaw::Tabulated(points) => {
            for point in points {
                point.pressure /= stiffness;
            }
        }
        PressureLaw::Vented | PressureLaw::Sealed => {}
    }
    law
}

impl Problem for Bench<'_> {
    fn readings(&self) -> usize {
        self.readings.len()
    }

    fn residuals(&self, at: &[f64], residuals: &mut [f64]) -> bool {
        let pairs = self.readings.iter().zip(&self.noise);
        for (residual, (reading, noise)) in residuals.iter_mut().zip(pairs) {
            let Some(signal) = self.predict(at, reading) else {
                return false;
            };
            *residual = (reading.signal - signal) / noise;
        }
        true
    }

    /// Leads and rest resistances in closed form, the others by differences of
    /// the closing.
    fn slopes(&self, parameters: &[Parameter], at: &[f64], columns: &mut [Vec<f64>]) -> bool {
        for column in columns.iter_mut() {
            column.fill(0.0);
        }
        let mut moved = at.to_vec();
        for (i, (reading, noise)) in self.readings.iter().zip(&self.noise).enumerate() {
            let Some(here) = self.ratio(at, reading) else {
                return false;
            };
            let rest = self.rest(reading);
            // Of the signal, with the sign of measured less model.
            let signal = self.signal.with_lead(at[LEAD]);
            let slope = -signal.slope(at[rest] * here.ratio) / noise;
            columns[LEAD][i] = slope;
            columns[rest][i] = slope * here.ratio;
            for j in [STIFFNESS[reading.layer], EXPANSION, BIAS] {
                let parameter = &parameters[j];
                let [low, high] = parameter.bounds;
                let unmoved = j == BIAS && matches!(reading.load, Load::Pressure(_));
                if low >= high || unmoved {
                    continue;
                }
                // The cube root of the rounding.
                let step = 6e-6 * at[j].abs().max(0.1 * parameter.size);
                let ends = [at[j] - step, at[j] + step].map(|x| x.clamp(low, high));
                let [below, above] = ends.map(|end| {
                    moved[j] = end;
                    self.ratio(&moved, reading).map(|at| at.ratio)
                });
                moved[j] = at[j];
                let (Some(below), Some(above)) = (below, above) else {
                    return false;
                };
                columns[j][i] = slope * at[rest] * (above - below) / (ends[1] - ends[0]);
            }
        }
        true
    }

    fn remedy(&self, together: &[usize]) -> String {
        let any = |places: &[usize]| together.iter().any(|j| places.contains(j));
        let rest = together.iter().any(|j| *j >= SHARED);
        if any(&[BIAS]) {
            "begin well below the first touch, or zero the load cell".into()
        } else if any(&[LEAD]) && rest {
            "measure the leads with the channel bridged, or press until the area is halved".into()
        } else if any(&[EXPANSION]) || any(&STIFFNESS) {
            "press further: stiffness rules small loads, the liquid large ones".into()
        } else {
            "take more readings at rest".into()
        }
    }
}
