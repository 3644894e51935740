//! Load to deformation.

mod bent_unit;
mod bonded_disc;
mod choice;
mod compressed_layer;
pub mod crossing_microchannels;
mod elastic_unit;
mod electrodes;
mod end_condition;
mod force_axes;
mod force_error;
mod force_hysteresis;
mod layer_range;
mod material;
mod microchannel;
pub mod microchannel_block;
pub mod microchannel_cell;
mod plate;
mod preload;
mod profile;
mod relaxation;
mod seated_element;
mod soft_cover;
mod solved_block;
mod solved_body;
mod solved_cell;
mod solved_unit;
mod solved_voids;
mod sphere_on_layer;
mod suspension;
mod tabulated_cells;

pub use bent_unit::BentGap;
pub use bonded_disc::{BondedDisc, DiscGrip, DiscPressure, LayerRim, OutsideDiscTable};
pub use choice::Mechanics;
pub use compressed_layer::{
    CompressedLayer, LayerKinematics, LayerState, PlaneStress, StressConstants, TopFace,
};
pub use elastic_unit::{
    AIR_PRESSURE, Bar, Cavity, ElasticDescription, FlankCompliance, Grip, OutsideUnit,
    SOLVED_ERROR, STRIPS, SideContact, UnitCompliance, UnitDrawing,
};
pub use electrodes::{
    DeformedElectrodes, ElectrodeModulus, ElectrodeStiffness, Electrodes, OutsideTable,
    PublishedThinning,
};
pub use end_condition::{EndCondition, EndShear, GivenFactor};
pub use force_axes::ForceAxes;
pub use force_error::force_error;
pub use force_hysteresis::{ForceHysteresis, LoadHistory, REVERSALS};
pub use layer_range::{LARGEST_COMPRESSION, LEAST_ASPECT, LayerError, LayerRange};
pub use material::{Hyperelastic, LinearElastic, MooneyRivlin};
pub use microchannel::{
    AlongChannel, CellGeometry, ClosingCurve, ClosingPoint, ClosingState, CurveSource, LiquidPoint,
    MicrochannelClosed, MicrochannelError, MicrochannelSection, MicrochannelShape, PaperLaw,
    PressureLaw, SectionClosure, SectionShape, SettledChannel, Stretch,
};
pub use plate::{Plate, PlateMotion, bending_stiffness};
pub use preload::{LayerLaw, PreloadError, Preloaded, SoftLayer};
pub use profile::{Profile, SINE_POINTS};
pub use relaxation::{Relaxation, RelaxationTerm};
pub use seated_element::{OutsideElementTable, SeatedElement, SeatedSetting};
pub use soft_cover::{
    Base, Contact, ShareSlopeTable, ShareTable, ShearTable, SoftCover,
    half_space_shear_transmission, half_space_transmission, layer_shear_transmission,
    layer_transmission,
};
pub use solved_block::{LocalLoad, LocalLoads, MicrochannelBlock, SolvedBlock};
pub use solved_body::SolvedBody;
pub use solved_cell::SolvedCell;
pub(crate) use solved_cell::{void_cell, void_study};
pub use solved_unit::{
    BlockDivision, Crosstalk, Pressed, PressedUnit, SolvedStiffness, SolvedUnit, TopForce,
    UnitSolution,
};
pub(crate) use solved_voids::{Fineness, filling as fillings, solid as solids};
pub use solved_voids::{NotSolved, SolvedLayer, SolvedVoids, VoidStack};
pub use sphere_on_layer::SpherePressure;
pub use suspension::{Deformation, SIDE_X, SIDE_Y, Suspension, SuspensionDescription};
