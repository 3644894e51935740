//! Deformation to electrical response.

mod liquid_metal_channel;
mod three_axis_capacitor;
mod tilted_plate;
mod unit_model;

pub use liquid_metal_channel::{
    ChannelLayer, ChannelResponse, Conductor, ThinnestPoint, mean_inverse_area_ratio,
};
pub use three_axis_capacitor::{PlateReading, PlateSlopes, Plates, PlatesDescription, Response};
pub use tilted_plate::{MeanInverseGap, VACUUM_PERMITTIVITY, mean_inverse_gap};
pub use unit_model::{EffectiveMotion, Linearisation, UnitModel};
