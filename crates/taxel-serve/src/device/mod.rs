//! The virtual device: plays a twin or a recording through the encoder of a board onto a wire,
//! with faults.

mod control;
mod damage;
mod error;
mod faults;
mod outlet;
mod player;
mod timing;
mod truth;

pub use control::ControlPlace;
pub use error::DeviceError;
pub use faults::Faults;
pub use outlet::DevicePlace;
pub use player::{Device, DeviceOptions, DeviceSummary, Encode, Player};
