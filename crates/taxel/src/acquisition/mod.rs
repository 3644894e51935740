//! Frames and where they come from: the simulated twin. Recordings are read by
//! [`taxel_recording`].

mod slider;
mod stimulus;
mod twin;

pub use taxel_recording::{Frame, FrameFlags, Quantity, SignalUnit, Stream};

pub use slider::Slider;
pub(crate) use stimulus::patch_share;
pub use stimulus::{
    Fault, FaultReading, Finger, FingerPoint, Link, Outage, Patch, Probe, ProbePoint, Script,
    Stimulus, Stuck,
};
pub use twin::{Delivery, Press, Simulated, TrueForces, Twin};
