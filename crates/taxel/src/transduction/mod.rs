//! Deformation to electrical response.

mod coplanar_capacitor;
mod in_plane_inverse;
mod in_plane_model;
mod in_plane_statement;
mod in_plane_study;
pub mod in_plane_table;
mod line_network;
mod magnet;
mod microchannel;
pub mod microchannel_table;
pub mod path_table;
mod piezoelectric;
mod response_table;
mod solved_edges;
mod solved_section;
mod surroundings;
mod three_axis_capacitor;
mod tile_edges;
mod tilted_plate;
mod unit_model;

pub use coplanar_capacitor::{Dielectric, PublishedFringe, coplanar_strips, facing_sides};
pub use in_plane_inverse::{ForceCurve, InPlaneInverse, Turning};
pub use in_plane_model::{CapacitanceLaw, InPlaneError, InPlaneModel, InPlaneState, PublishedFit};
pub use in_plane_study::{StudyCurve, StudyParameter, StudyPoint, study};
pub use in_plane_table::DrawnTable;
pub use line_network::{IdleLines, Inverse, LineNetwork, LineWiring, NetworkError};
pub use magnet::{
    CuboidMagnet, CylinderMagnet, MagnetField, MagnetPose, MagnetShape, SphereMagnet,
    VACUUM_PERMEABILITY,
};
pub use microchannel::{
    Conductor, MicrochannelLayer, MicrochannelResponse, ThinnestPoint, mean_inverse_area_ratio,
};
pub use microchannel_table::{DrawnLayers, LayersTable};
pub use path_table::{PathTable, PathVariable, TableErrors, WrongTable};
pub use piezoelectric::{
    Ceramic, PiezoelectricElement, PiezoelectricLaw, PiezoelectricState, SiliconePath,
};
pub use response_table::{
    Certificate, MOST_PARAMETERS, NoResponseTable, Response, ResponseFile, ResponseTable,
    SketchPart, TableOutput, TableParameter,
};
pub use solved_edges::SolvedEdges;
pub use solved_section::{SectionErrors, SolvedSection};
pub use surroundings::Surroundings;
pub use three_axis_capacitor::{
    PlateReading, PlateSlopes, Plates, PlatesDescription, RestReading, ThreeAxisResponse,
};
pub use tile_edges::{
    DrawnEdges, EDGE_ERROR, EdgeDrawing, EdgeEnvironment, EdgeLaw, EdgeSlopes, INNER_DISTANCE,
    OUTER_DISTANCE, OutsideEdges, TileEdges, corner_capacitance,
};
pub use tilted_plate::{MeanInverseGap, VACUUM_PERMITTIVITY, mean_inverse_gap};
pub use unit_model::{EffectiveMotion, PublishedInverse, ThreeAxisLinearisation, ThreeAxisModel};
