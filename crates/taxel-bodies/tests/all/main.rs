//! The tests of the crate: one is compiled and linked once, and its tests share the cores. Those of
//! one file run with `cargo test -p taxel-bodies --test all FILE::`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a panic is how a test fails, and figures are printed"
)]

#[path = "../../../taxel/tests/common/mod.rs"]
mod common;
#[path = "../../../taxel/tests/common/extremes.rs"]
mod extremes;

mod electrode_section;
mod files;
mod loaded_parts;
mod microchannel_block;
mod microchannel_cell;
mod own_bodies;
mod own_dome;
mod p1_field;
mod p2_edges;
mod p2_unit_solved;
mod p3_layer;
mod p4_local;
mod path_table;
mod problem;
mod response_table;
mod solved_drawings;
mod stranger_meshes;
