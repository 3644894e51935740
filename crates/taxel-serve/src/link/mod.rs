//! Links: ways to the bytes of a board, each with one reading thread.

mod address;
mod advice;
mod clock;
mod error;
mod exec;
mod heard;
mod options;
mod port;
mod ports;
mod reader;
mod running;
mod serial;
mod socket;
mod state;
mod stream;
mod tracker;
mod way;
mod web_socket;
mod wire;

pub use address::{LinkAddress, SerialName};
pub use clock::ClockRelation;
pub(crate) use clock::ClockWatch;
pub use error::LinkError;
pub use heard::Heard;
pub use options::{LinkObserver, LinkOptions, Reconnect};
pub use port::Others;
pub use ports::{FoundPort, Holder, UsbNames, found_ports};
pub(crate) use reader::Item;
pub(crate) use running::Running;
pub use serial::{SerialSettings, UsbMatch};
pub use state::{LinkHandle, LinkState, LinkStatus};
pub use wire::{Decode, Greeting, Poll, WireCounts};
