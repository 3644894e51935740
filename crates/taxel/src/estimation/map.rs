//! Frames of a pressure map that describes itself: its readings are its values.

use super::reader::{
    Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total, counting,
};
use super::touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch};
use super::{ChannelFacts, Wiring};
use crate::acquisition::{Quantity, Stream};
use crate::layout::{ArrayDescription, Layout, Mount};

/// Reads a pressure map: values less the rest values.
#[derive(Debug, Clone)]
pub struct MapReader {
    meaning: Meaning,
    channels: Vec<ChannelFacts>,
    threshold: f64,
    rest: Vec<f64>,
}

impl MapReader {
    /// A reader of the frames of `stream`.
    pub fn new(stream: &Stream) -> Self {
        let exists = stream.present.iter();
        Self {
            meaning: meaning(stream),
            channels: exists
                .map(|exists| ChannelFacts::unknown(*exists))
                .collect(),
            threshold: stream.threshold.unwrap_or(0.0),
            rest: vec![0.0; stream.channels()],
        }
    }
}

impl Reader for MapReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.channels
    }

    fn rules(&self) -> Rules {
        Rules {
            threshold: Threshold::Fixed(self.threshold),
            counted: counting(&[State::Ok]),
            total: Total::Counted,
            drifts: false,
            rest: RestRules {
                refused: None,
                // A recording may begin under load.
                at_start: false,
                channels_per_unit: 1,
                unit: "sensel",
                measures_noise: false,
                ends_at_touch: false,
            },
        }
    }

    /// A recording states no noise.
    fn noise(&self) -> Vec<f64> {
        vec![f64::NAN; self.rest.len()]
    }

    fn rest(&self) -> Vec<f64> {
        self.rest.clone()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        channels.readings.copy_from_slice(values);
        for (state, value) in channels.states.iter_mut().zip(values) {
            if value.is_nan() && *state != ChannelState::Masked {
                *state = ChannelState::Faulty;
            }
        }
        0
    }

    fn read(&mut self, _known: &Known<'_>, touch: &mut Touch) {
        let channels = &touch.channels;
        let slots = touch.taxels.iter_mut().zip(&self.rest).enumerate();
        for (index, (taxel, rest)) in slots {
            let state = match channels.states[index] {
                ChannelState::Masked => State::Masked,
                ChannelState::Faulty => State::Faulty,
                _ => State::Ok,
            };
            *taxel = TaxelTouch::pressing(channels.readings[index] - rest, f64::NAN, state);
        }
    }

    fn set_rest(&mut self, rest: &[f64], _noise: &[f64]) {
        for (own, rest) in self.rest.iter_mut().zip(rest) {
            *own = if rest.is_nan() { 0.0 } else { *rest };
        }
    }
}

fn meaning(stream: &Stream) -> Meaning {
    let pressure = stream.unit.quantity == Quantity::Pressure;
    let columns = stream.columns * stream.channels_per_taxel;
    let [down, across] = stream.pitch.unwrap_or([1.0; 2]);
    let value = Scale {
        quantity: if pressure { "pressure" } else { "raw" }.into(),
        symbol: stream.unit.symbol.clone().into(),
        si_per_unit: stream.unit.si_per_unit,
    };
    let newtons = stream.pitch.filter(|_| pressure);
    Meaning {
        layout: Layout::new(&ArrayDescription {
            rows: stream.rows,
            columns,
            pitch: [across, down],
            mount: Mount::Flat,
        }),
        in_metres: stream.pitch.is_some(),
        channels: (0..stream.rows * columns)
            .map(|sensel| format!("r{}c{}", sensel / columns, sensel % columns))
            .collect(),
        wiring: Wiring::PerTaxel(1),
        reading: value.clone(),
        value,
        components: 1,
        signed: false,
        full_scale: None,
        verified: None,
        picture: Picture::Map,
        newtons,
        total_known: newtons.is_some(),
    }
}
