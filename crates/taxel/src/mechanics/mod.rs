//! Load to deformation.

mod bent_unit;
mod bonded_disc;
mod choice;
mod compressed_layer;
mod elastic_unit;
mod electrodes;
mod end_condition;
mod force_axes;
mod force_error;
mod force_hysteresis;
mod layer_range;
mod layered_cover;
mod material;
mod microchannel;
mod plate;
mod preload;
mod profile;
mod relaxation;
mod seated_element;
mod soft_cover;
mod solved_cell;
mod solved_unit;
mod sphere_on_layer;
mod suspension;
mod tabulated_cells;
mod void_stack;

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
pub use layered_cover::{CoverArea, CoverError, CoverLayer, LayeredCover};
pub use material::{Hyperelastic, LinearElastic, MooneyRivlin};
pub use microchannel::{
    AlongChannel, CellGeometry, ClosingCurve, ClosingPoint, ClosingState, CurveSource, LiquidPoint,
    MicrochannelClosed, MicrochannelError, MicrochannelSection, MicrochannelShape, PaperLaw,
    PressureLaw, SectionClosure, SectionShape, SettledChannel, Stretch, tabulated_pressure,
};
pub use plate::{Plate, PlateMotion, bending_stiffness};
pub use preload::{LayerLaw, PreloadError, Preloaded, SoftLayer};
pub use profile::{Profile, SINE_POINTS};
pub use relaxation::{Relaxation, RelaxationTerm};
pub use seated_element::{OutsideElementTable, SeatedElement, SeatedSetting};
pub use soft_cover::{
    Base, ContactPressure, ShareSlopeTable, ShareTable, ShearTable, SoftCover,
    half_space_shear_transmission, half_space_transmission, layer_shear_transmission,
    layer_transmission,
};
pub use solved_cell::SolvedCell;
pub use solved_unit::{Pressed, PressedUnit, SolvedStiffness};
pub use sphere_on_layer::SpherePressure;
pub use suspension::{SIDE_X, SIDE_Y, Suspension, SuspensionDescription, ThreeAxisDeformation};
pub use void_stack::VoidStack;
