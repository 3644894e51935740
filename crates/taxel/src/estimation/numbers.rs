//! Numbers of a frame to readings, as every board's ends of its range say.

use super::touch::{ChannelReadings, ChannelState};
use crate::signal::{NumberScale, Position};

/// Readings of a frame, SI, as [`super::Reader::convert`] asks for them.
///
/// The numbers at either end of the range say nothing but "outside": at the low end of a
/// quantity without sign a line is open, at the others a signal is too large.
pub(crate) fn convert_within(
    scale: &NumberScale,
    values: &[f64],
    channels: &mut ChannelReadings,
) -> usize {
    let mut clipped = 0;
    let slots = channels.readings.iter_mut().zip(&mut channels.states);
    for ((reading, state), value) in slots.zip(values) {
        let position = scale.position(*value);
        *reading = if position == Position::Inside {
            scale.input(*value)
        } else {
            f64::NAN
        };
        if position == Position::Inside || *state == ChannelState::Masked {
            continue;
        }
        clipped += usize::from(!value.is_nan());
        *state = if position == Position::AtEnd {
            ChannelState::Saturated
        } else {
            ChannelState::Faulty
        };
    }
    clipped
}
