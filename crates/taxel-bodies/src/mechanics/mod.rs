//! Bodies of devices under load.

pub mod crossing_microchannels;
mod deformed_body;
pub mod microchannel_block;
pub mod microchannel_cell;
mod solved_block;
mod solved_cell;
mod solved_unit;
mod solved_voids;

pub use deformed_body::DeformedBody;
pub use solved_block::{LocalLoad, LocalLoads, MicrochannelBlock, SolvedBlock};
pub(crate) use solved_cell::{solve_cell, void_cell, void_study};
pub(crate) use solved_unit::solve_stiffness;
pub use solved_unit::{BlockDivision, Crosstalk, ElasticUnit, SolvedUnit, TopForce, UnitSolution};
pub(crate) use solved_voids::{
    Fineness, check_stack, crossing_study, filling, light_pressure, solid,
};
pub use solved_voids::{NotSolved, SolvedLayer, SolvedVoids, solve_voids};
