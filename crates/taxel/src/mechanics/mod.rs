//! Load to deformation.

mod material;
mod microchannel;
mod monotone_curve;
mod relaxation;
mod suspension;
mod tabulated_cells;

pub use material::{Hyperelastic, LinearElastic, MooneyRivlin};
pub use microchannel::{
    CellGeometry, ChannelClosed, ChannelError, ChannelSection, ChannelShape, ClosingCurve,
    ClosingPoint, ClosingState, LiquidPoint, PaperLaw, PressureLaw, SectionClosure, SettledChannel,
    Stretch,
};
pub use monotone_curve::{CurveError, MonotoneCurve, OnCurve};
pub use relaxation::{Relaxation, RelaxationTerm};
pub use suspension::{Deformation, SIDE_X, SIDE_Y, Suspension, SuspensionDescription};
