//! Bodies that are solved often: from a few lengths to a problem ready to be solved.

pub mod crossing_voids;
pub mod embedded_bars;
pub mod layer;
pub mod void_block;
pub mod void_cell;
