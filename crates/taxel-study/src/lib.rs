//! Design studies: what becomes of a sensor when its file is varied.
//!
//! A study file ([`mod@file`]) names a sensor, its variables and what is asked of each design.
//! [`study`] reads it and evaluates designs; [`run`] does so on all cores and with what is kept
//! in a [`store`]. [`sweep`] computes a plan, [`optimise`] looks for the best design,
//! [`tolerance`] asks what made devices do, [`made`] puts it beside a prediction, [`place`] where elements tell most.

pub mod answers;
pub mod exponents;
pub mod expression;
pub mod figures;
pub mod file;
pub mod keys;
pub mod made;
pub mod optimise;
pub mod place;
pub mod plans;
pub mod run;
mod shipped;
pub mod spread;
pub mod store;
pub mod study;
pub mod sweep;
pub mod tolerance;

pub use shipped::{shipped_names, shipped_text};
