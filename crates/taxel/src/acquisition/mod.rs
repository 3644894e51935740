//! Frames and where they come from: the simulated twin, a recording.

mod frame;
pub mod recording;
mod slider;
mod stimulus;
mod twin;

pub use frame::{Frame, Quantity, SignalUnit, Stream};
pub use slider::Slider;
pub use stimulus::{
    Fault, FaultReading, Finger, FingerPoint, Link, Outage, Patch, Probe, ProbePoint, Script,
    Stimulus, Stuck,
};
pub use twin::{Delivery, Simulated, TrueForces, Twin};
