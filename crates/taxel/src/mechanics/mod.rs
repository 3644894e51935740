//! Load to deformation.

mod compressed_layer;
mod electrodes;
mod end_condition;
mod relaxation;
mod suspension;

pub use compressed_layer::{
    CompressedLayer, LARGEST_COMPRESSION, LEAST_ASPECT, LayerError, LayerKinematics, LayerRange,
    LayerState, MooneyRivlin, PlaneStress, TopFace,
};
pub use electrodes::{
    DeformedElectrodes, ElectrodeModulus, ElectrodeStiffness, Electrodes, OutsideTable,
    PublishedThinning,
};
pub use end_condition::{EndCondition, EndShear, GivenFactor};
pub use relaxation::{Relaxation, RelaxationTerm};
pub use suspension::{Deformation, SIDE_X, SIDE_Y, Suspension, SuspensionDescription};
