//! The tests of the crate that need no program of their own: one is compiled and linked once, and
//! its tests share the cores. Those of one file run with `cargo test -p taxel --test all FILE::`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a panic is how a test fails, and figures are printed"
)]

#[path = "../common/mod.rs"]
mod common;

mod architecture;
mod contacts;
mod documents;
mod drift;
mod editor_schema;
mod electrode_section;
mod extreme_values;
mod faults;
mod invariants;
mod loaded_parts;
mod measured;
mod microchannel_block;
mod microchannel_cell;
mod module_graph;
mod own_bodies;
mod p1_field;
mod p1_properties;
mod p1_reference;
mod p1_twin;
mod p2_edges;
mod p2_reference;
mod p2_unit;
mod p2_unit_solved;
mod p3_contact;
mod p3_device;
mod p3_layer;
mod p3_properties;
mod p3_reference;
mod p3_shear;
mod p3_slip;
mod p3_zero;
mod p4_device;
mod p4_local;
mod p4_properties;
mod p4_reference;
mod path_table;
mod problem;
mod properties;
mod solved_drawings;
mod twin;
mod zero;
