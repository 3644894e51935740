//! Bodies that are solved often: from a few lengths to a problem ready to be solved.

pub mod bump_block;
pub mod disc;
pub mod layer;
pub mod seated;
