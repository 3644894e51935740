//! The tests of the crate that need no program of their own: one is compiled and linked once, and
//! its tests share the cores. Those of one file run with `cargo test -p taxel --test all FILE::`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a panic is how a test fails, and figures are printed"
)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/extremes.rs"]
mod extremes;

mod architecture;
mod body;
mod cells;
mod certainty;
mod contacts;
mod coverage;
mod documents;
mod drift;
mod editor_schema;
mod extreme_values;
mod faults;
mod invariants;
mod layered_cover;
mod line_network;
mod magnet;
mod magnetic_skin;
mod measured;
mod module_graph;
mod p1_properties;
mod p1_reference;
mod p1_twin;
mod p2_edges;
mod p2_reference;
mod p2_unit;
mod p3_contact;
mod p3_device;
mod p3_layer;
mod p3_properties;
mod p3_reference;
mod p3_shear;
mod p3_slip;
mod p3_zero;
mod p4_device;
mod p4_properties;
mod p4_reference;
mod properties;
mod shipped_pages;
mod twin;
mod whole_counts;
mod zero;
