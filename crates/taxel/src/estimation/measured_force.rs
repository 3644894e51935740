//! Taxels whose board gives forces: the readings less the rest values are the touch.

use super::numbers::convert_within;
use super::reader::{
    Division, Drift, Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total,
    counting,
};
use super::touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch};
use super::{ChannelFacts, Wiring};
use crate::calibration::ForceModel;
use crate::mechanics::ForceAxes;

/// A taxel is touched above this many standard deviations of its pressing force.
const CONTACT_DEVIATIONS: f64 = 6.0;
/// ... and above this share of the full scale.
const CONTACT_SHARE: f64 = 0.01;

/// Reads taxels whose board gives forces.
#[derive(Debug, Clone)]
pub struct MeasuredForceReader {
    model: ForceModel,
    meaning: Meaning,
    channels: Vec<ChannelFacts>,
    rest: Vec<f64>,
    /// Readings of a frame, those at an end of the range at that end, N.
    bounded: Vec<f64>,
}

impl MeasuredForceReader {
    /// A reader of these taxels.
    pub fn new(model: ForceModel) -> Self {
        let channels = model.axes.count() * model.layout.taxels();
        Self {
            meaning: meaning(&model),
            channels: facts(&model),
            rest: vec![0.0; channels],
            bounded: vec![f64::NAN; channels],
            model,
        }
    }

    fn deviation(&self, channel: usize) -> f64 {
        let axes = self.model.axes;
        self.model.deviation[axes.first() + channel % axes.count()]
    }

    /// Touch on a taxel from its readings.
    fn taxel(&self, taxel: usize, known: &Known<'_>, states: &[ChannelState]) -> TaxelTouch {
        let axes = self.model.axes;
        let channels = axes.count() * taxel..axes.count() * (taxel + 1);
        let any = |wanted| states[channels.clone()].contains(&wanted);
        let state = if any(ChannelState::Masked) {
            State::Masked
        } else if any(ChannelState::Faulty) {
            State::Faulty
        } else if any(ChannelState::Saturated) {
            State::Saturated
        } else {
            State::Ok
        };
        let mut touch = TaxelTouch::without_value(state);
        if axes == ForceAxes::Xyz {
            touch.covariance = [[0.0; 3]; 3];
        }
        if state == State::Masked {
            return touch;
        }
        for (axis, channel) in (axes.first()..).zip(channels) {
            let noise = known.noise[channel];
            let variance = noise * noise + known.drift_variance(channel);
            let (value, variance) = match states[channel] {
                ChannelState::Ok | ChannelState::Closed => (self.bounded[channel], variance),
                ChannelState::Saturated => (self.bounded[channel], f64::NAN),
                ChannelState::Faulty | ChannelState::Masked => (f64::NAN, f64::NAN),
            };
            touch.value[axis] = value - self.rest[channel] - known.drift(channel);
            touch.covariance[axis][axis] = variance;
        }
        touch
    }
}

impl Reader for MeasuredForceReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.channels
    }

    fn rules(&self) -> Rules {
        Rules {
            division: Division::Peaks,
            threshold: Threshold::Deviations(
                CONTACT_DEVIATIONS,
                CONTACT_SHARE * self.model.full_scale,
            ),
            counted: counting(&[State::Ok, State::Saturated]),
            total: Total::Counted,
            drift: Drift::Followed,
            rest: RestRules {
                refused: None,
                at_start: true,
                channels_per_unit: self.model.axes.count(),
                unit: "taxel",
                measures_noise: true,
                ends_at_touch: false,
            },
        }
    }

    fn noise(&self) -> Vec<f64> {
        let channels = 0..self.rest.len();
        channels.map(|channel| self.deviation(channel)).collect()
    }

    fn rest(&self) -> Vec<f64> {
        self.rest.clone()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        let [low, high] = self.model.channel.ends;
        for (bounded, value) in self.bounded.iter_mut().zip(values) {
            *bounded = match *value {
                value if value < low => low,
                value if value > high => high,
                value => value,
            };
        }
        convert_within(&self.model.channel, values, channels)
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        let states = &touch.channels.states;
        for (taxel, touch) in touch.taxels.iter_mut().enumerate() {
            *touch = self.taxel(taxel, known, states);
        }
    }

    fn set_rest(&mut self, rest: &[f64], _noise: &[f64]) {
        for (own, rest) in self.rest.iter_mut().zip(rest) {
            *own = if rest.is_nan() { 0.0 } else { *rest };
        }
    }
}

fn facts(model: &ForceModel) -> Vec<ChannelFacts> {
    let axes = model.axes;
    let channel = |index: usize| ChannelFacts {
        deviation: model.deviation[axes.first() + index % axes.count()],
        resolution: model.channel.step,
        span: model.channel.alive(),
        ..ChannelFacts::unknown(!model.masked[index / axes.count()])
    };
    (0..axes.count() * model.layout.taxels())
        .map(channel)
        .collect()
}

fn meaning(model: &ForceModel) -> Meaning {
    let (layout, axes) = (&model.layout, model.axes);
    let name = |taxel: usize, axis: &str| {
        let (row, column) = (taxel / layout.columns, taxel % layout.columns);
        format!("r{row}c{column}.{axis}")
    };
    let force = Scale::of(&model.unit, Scale::new("force", "N", 1.0));
    Meaning {
        layout: layout.clone(),
        in_metres: true,
        channels: (0..layout.taxels())
            .flat_map(|taxel| axes.names().iter().map(move |axis| name(taxel, axis)))
            .collect(),
        wiring: Wiring::PerTaxel(axes.count()),
        reading: force.clone(),
        value: force,
        components: axes.count(),
        signed: axes == ForceAxes::Xyz,
        full_scale: Some(model.full_scale),
        verified: None,
        picture: Picture::Heat,
        newtons: Some([1.0; 2]),
        total_known: true,
    }
}
