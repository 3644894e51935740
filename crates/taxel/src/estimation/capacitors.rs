//! Channels that carry capacitances, of any device.

use super::FrameError;
use super::health::ChannelFacts;
use crate::acquisition::{Quantity, SignalUnit};
use crate::signal::NumberScale;

/// Capacitances that were recorded in the place of counts: without steps and a largest value.
const CAPACITANCES: NumberScale = NumberScale {
    ends: [0.0, f64::INFINITY],
    ..NumberScale::VALUES
};

/// Numbers of frames of `found` to capacitances, for a board whose numbers have `unit` and are
/// read by `scale`.
///
/// # Errors
/// [`FrameError::Quantity`] when these cannot be frames of the board.
pub(super) fn capacitor_scale(
    scale: NumberScale,
    unit: &SignalUnit,
    found: Quantity,
) -> Result<NumberScale, FrameError> {
    if found == unit.quantity {
        Ok(scale)
    } else if found == Quantity::Capacitance {
        Ok(CAPACITANCES)
    } else {
        Err(FrameError::quantity(found, unit))
    }
}

/// Facts of the channel of a capacitor with the noise `deviation`, F, whose numbers are read
/// by `scale`.
pub(super) fn capacitor_facts(scale: &NumberScale, deviation: f64, masked: bool) -> ChannelFacts {
    ChannelFacts {
        deviation: deviation / scale.per_number.abs(),
        resolution: scale.step,
        span: scale.alive(),
        ..ChannelFacts::unknown(!masked)
    }
}
