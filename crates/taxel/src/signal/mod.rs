//! Signals of channels and the numbers of frames: what a board makes of a response, and
//! estimation undoes.

mod number_scale;
mod resistance_signal;

use taxel_recording::Quantity;

pub use number_scale::{NumberScale, Position};
pub use resistance_signal::ResistanceSignal;

/// What the sensor file of a board whose frames carry `found` would have to say, at the end of
/// a sentence.
pub(crate) fn board_of(found: Quantity) -> &'static str {
    match found {
        Quantity::Counts => {
            "; a board that gives counts has electronics.converter and the stage before it in its sensor file"
        }
        Quantity::Raw => "; numbers without a unit are read by electronics.readout.digital alone",
        _ => {
            "; a board that gives a physical value is described by electronics.readout.measured, with its unit"
        }
    }
}
