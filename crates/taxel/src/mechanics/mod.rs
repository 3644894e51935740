//! Load to deformation.

mod plate;
mod preload;
mod profile;
mod relaxation;
mod soft_cover;
mod suspension;

pub use plate::{Plate, PlateMotion, bending_stiffness};
pub use preload::{LayerLaw, PreloadError, Preloaded, SoftLayer};
pub use profile::{Profile, SINE_POINTS};
pub use relaxation::{Relaxation, RelaxationTerm};
pub use soft_cover::{
    Base, Contact, ShareTable, SoftCover, half_space_transmission, layer_transmission,
};
pub use suspension::{Deformation, SIDE_X, SIDE_Y, Suspension, SuspensionDescription};
