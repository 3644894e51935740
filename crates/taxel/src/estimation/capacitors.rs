//! Channels that carry capacitances, of any device.

use super::health::ChannelFacts;
use super::touch::{ChannelReadings, ChannelState};
use crate::acquisition::Quantity;
use crate::calibration::ChannelScale;

/// Facts of the channel of a capacitor with the noise `deviation`, F, in frames of
/// `quantity`. Capacitances may have been rounded: their step is not known.
pub(super) fn capacitor_facts(
    scale: &ChannelScale,
    deviation: f64,
    masked: bool,
    quantity: Quantity,
) -> ChannelFacts {
    if quantity == Quantity::Counts {
        ChannelFacts {
            deviation: deviation / scale.farad_per_count.abs(),
            resolution: 1.0,
            span: [0.0, scale.highest_code],
            masked,
        }
    } else {
        ChannelFacts {
            deviation,
            resolution: 0.0,
            span: [0.0, f64::INFINITY],
            masked,
        }
    }
}

/// Capacitances of a frame, F, as [`super::Reader::convert`] asks for them.
///
/// The codes at either end of the range say nothing but "outside": at code zero
/// a line is open, at the highest a capacitance is too large.
pub(super) fn convert_capacitances(
    scale: &ChannelScale,
    quantity: Quantity,
    values: &[f64],
    channels: &mut ChannelReadings,
) -> usize {
    let mut clipped = 0;
    let slots = channels.readings.iter_mut().zip(&mut channels.states);
    for ((reading, state), value) in slots.zip(values) {
        *reading = if quantity == Quantity::Capacitance {
            *value
        } else {
            scale.capacitance(*value).unwrap_or(f64::NAN)
        };
        if !reading.is_nan() || *state == ChannelState::Masked {
            continue;
        }
        clipped += usize::from(!value.is_nan());
        *state = if *value >= scale.highest_code {
            ChannelState::Saturated
        } else {
            ChannelState::Faulty
        };
    }
    clipped
}
