//! Frames of a map that describes itself: its readings are its values.

use super::reader::{
    Division, Drift, Known, Meaning, Picture, Reader, RestRules, Rules, Scale, Threshold, Total,
    counting,
};
use super::touch::{ChannelReadings, ChannelState, State, TaxelTouch, Touch};
use super::{CAPACITORS, ChannelFacts, MapNoise, Wiring};
use crate::acquisition::{Quantity, Stream};
use crate::layout::{ArrayDescription, Layout, Mount};

/// A touch on a bare device begins above so many standard deviations of a sensel.
const DEVIATIONS: f64 = 6.0;
/// A touch begins at so many times the reading down to which it holds.
const TOUCH: f64 = 2.0;
/// The smallest contact, m²: less is a crease of the sheet, not a fingertip.
const LEAST_AREA: f64 = 6e-6;

/// What is known of a map beside its stream.
#[derive(Debug, Clone, Default)]
pub struct MapOptions {
    /// Its noise.
    pub noise: MapNoise,
    /// True if contacts also have events of force and motion: steps, impacts, cycles, slips.
    /// What walks or sits gives them all the time.
    pub all_events: bool,
    /// Names of the channels, as a board file gives them; empty for those of rows and columns.
    pub names: Vec<String>,
    /// Step of each channel, SI, as a board file gives it: 0 for readings without steps, `NaN`
    /// where it is not known. Empty where there is none.
    pub steps: Vec<f64>,
    /// Number of the kind of each channel: those of one have the same unit and type, and are
    /// compared with each other. Empty if all are of one kind.
    pub kinds: Vec<usize>,
    /// True if readings fall under pressure.
    pub falls: bool,
}

/// Reads a map of pressures, forces or anything else: values less the rest values.
#[derive(Debug, Clone)]
pub struct MapReader {
    meaning: Meaning,
    channels: Vec<ChannelFacts>,
    threshold: f64,
    /// Taxels of the smallest contact.
    least: usize,
    /// True if the readings are those of a bare device, whose zero is anywhere.
    bare: bool,
    /// True if readings fall under pressure.
    falls: bool,
    /// Sensels that were stuck while the noise was found.
    stuck: Vec<bool>,
    rest: Vec<f64>,
}

impl MapReader {
    /// A reader of the frames of `stream`, in which `noise` was found, whose channels are all of
    /// one kind.
    pub fn new(stream: &Stream, noise: &MapNoise) -> Self {
        Self::of_kinds(stream, noise, &[])
    }

    /// The same with channels of several kinds, which `kinds` numbers. Readings of a bare device
    /// that are whole numbers are of another kind than others.
    pub fn of_kinds(stream: &Stream, noise: &MapNoise, kinds: &[usize]) -> Self {
        let kind = |channel: usize| {
            let stated = kinds.get(channel).copied().unwrap_or(0);
            2 * stated + usize::from(bare(stream) && noise.is_whole(channel))
        };
        let kinds: Vec<usize> = (0..stream.present.len()).map(kind).collect();
        let channels = noise.facts(&stream.present, &kinds);
        let stated = stream.threshold.unwrap_or(0.0);
        let sensels = |[rows, columns]: [f64; 2]| (LEAST_AREA / (rows * columns)).ceil() as usize;
        Self {
            meaning: meaning(stream),
            stuck: noise.stuck(&channels),
            channels,
            threshold: TOUCH * noise.least_hold(&kinds).max(stated),
            least: stream.pitch.map_or(1, sensels).max(1),
            bare: bare(stream),
            falls: false,
            rest: vec![0.0; stream.channels()],
        }
    }

    /// The same with channels of these names, if there are as many.
    #[must_use]
    pub fn named(mut self, names: &[String]) -> Self {
        if names.len() == self.meaning.channels.len() {
            self.meaning.channels = names.to_vec();
        }
        self
    }

    /// The same where readings fall under pressure, if they do.
    #[must_use]
    pub fn falling(self, falls: bool) -> Self {
        Self { falls, ..self }
    }
}

/// True if the readings of `stream` are not those of a map, but of the channels of a device.
fn bare(stream: &Stream) -> bool {
    matches!(
        stream.unit.quantity,
        Quantity::Counts | Quantity::Capacitance
    )
}

impl Reader for MapReader {
    fn meaning(&self) -> &Meaning {
        &self.meaning
    }

    fn channels(&self) -> &[ChannelFacts] {
        &self.channels
    }

    fn set_steps(&mut self, steps: &[f64]) {
        ChannelFacts::coarsen(&mut self.channels, steps);
    }

    fn rules(&self) -> Rules {
        Rules {
            threshold: Threshold::Deviations(DEVIATIONS, self.threshold),
            division: Division::Regions { least: self.least },
            counted: counting(&[State::Ok]),
            total: Total::Counted,
            drift: Drift::None,
            rest: RestRules {
                refused: None,
                // A recording may begin under load; the readings of a bare device say nothing
                // without their rest values.
                at_start: self.bare,
                channels_per_unit: 1,
                unit: "sensel",
                measures_noise: self.bare,
                ends_at_touch: false,
            },
        }
    }

    /// No recording states its noise; a rest capture of a bare device measures it.
    fn noise(&self) -> Vec<f64> {
        vec![f64::NAN; self.rest.len()]
    }

    fn rest(&self) -> Vec<f64> {
        self.rest.clone()
    }

    fn convert(&mut self, values: &[f64], channels: &mut ChannelReadings) -> usize {
        channels.readings.copy_from_slice(values);
        let sensels = channels.states.iter_mut().zip(values).zip(&self.stuck);
        for ((state, value), stuck) in sensels {
            if (value.is_nan() || *stuck) && *state != ChannelState::Masked {
                *state = ChannelState::Faulty;
            }
        }
        0
    }

    fn read(&mut self, known: &Known<'_>, touch: &mut Touch) {
        let channels = &touch.channels;
        let slots = touch.taxels.iter_mut().zip(&self.rest).enumerate();
        for (index, (taxel, rest)) in slots {
            // Noise that was not seen is not none.
            let deviation = Some(known.noise[index]).filter(|noise| *noise > 0.0);
            let deviation = deviation.unwrap_or(f64::NAN);
            let state = match channels.states[index] {
                ChannelState::Masked => State::Masked,
                ChannelState::Faulty => State::Faulty,
                _ => State::Ok,
            };
            let rise = channels.readings[index] - rest;
            let value = if self.falls { -rise } else { rise };
            *taxel = TaxelTouch::pressing(value, deviation, state);
        }
    }

    fn exists(&self, taxel: usize) -> bool {
        !self.channels[taxel].masked
    }

    fn set_rest(&mut self, rest: &[f64], _noise: &[f64]) {
        for (own, rest) in self.rest.iter_mut().zip(rest) {
            *own = if rest.is_nan() { 0.0 } else { *rest };
        }
    }
}

fn meaning(stream: &Stream) -> Meaning {
    let quantity = stream.unit.quantity;
    let columns = stream.columns * stream.channels_per_taxel;
    let [down, across] = stream.pitch.unwrap_or([1.0; 2]);
    let value = Scale {
        quantity: quantity.name().into(),
        symbol: stream.unit.symbol.clone().into(),
        si_per_unit: stream.unit.si_per_unit,
    };
    let newtons = match quantity {
        Quantity::Pressure => stream.pitch,
        Quantity::Force => Some([1.0; 2]),
        _ => None,
    };
    Meaning {
        layout: Layout::new(&ArrayDescription {
            rows: stream.rows,
            columns,
            pitch: [across, down],
            mount: Mount::Flat,
        }),
        in_metres: stream.pitch.is_some(),
        channels: (0..stream.rows * columns)
            .map(|sensel| channel_name(stream, sensel))
            .collect(),
        wiring: Wiring::PerTaxel(1),
        reading: value.clone(),
        value,
        components: 1,
        signed: bare(stream),
        full_scale: None,
        verified: None,
        picture: Picture::Map,
        newtons,
        total_known: newtons.is_some(),
    }
}

/// Name of a channel as recordings write it.
fn channel_name(stream: &Stream, channel: usize) -> String {
    let per_taxel = stream.channels_per_taxel.max(1);
    let taxel = channel / per_taxel;
    let (row, column) = (taxel / stream.columns, taxel % stream.columns);
    match CAPACITORS.get(channel % per_taxel) {
        Some(capacitor) if per_taxel == CAPACITORS.len() => format!("r{row}c{column}.{capacitor}"),
        _ => format!("r{row}c{column}"),
    }
}
