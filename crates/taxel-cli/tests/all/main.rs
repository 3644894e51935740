//! The tests of the command: one program is compiled and linked once, and its tests share the
//! cores. Those of one file run with `cargo test -p taxel-cli --test all FILE::`. Times of a
//! service at full rate are measured alone, in `load.rs`.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a panic is how a test fails, and figures are printed"
)]

#[cfg(unix)]
#[path = "../common/board.rs"]
mod board;
#[path = "../common/mod.rs"]
mod common;
#[path = "../python/mod.rs"]
mod python;

mod calibrate;
mod cli;
#[cfg(unix)]
mod clients;
mod dependencies;
mod devices;
mod documents;
mod estimate;
mod fabricate;
mod foreign;
mod guide;
mod habits;
mod in_plane;
#[cfg(unix)]
mod links;
mod maps;
mod material;
#[cfg(unix)]
mod outputs;
#[cfg(unix)]
mod programs;
mod recording;
mod simulators;
mod solutions;
mod solve;
mod solver;
mod spread;
#[cfg(unix)]
mod studies;
mod tabulate;
mod trained;
mod waits;
mod wrong_boards;
