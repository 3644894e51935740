//! Design studies: how a sensor changes when its file is varied.
//!
//! A study file ([`mod@file`]) names a sensor, its variables and what is asked of each design.
//! [`study`] reads it and evaluates designs; [`run`] does so on all cores and with what is kept
//! in a [`store`]. [`sweep`] computes a plan, [`optimise`] looks for the best design,
//! [`tolerance`] asks how manufactured devices scatter, [`made`] gives a prediction their interval,
//! [`place`] finds the positions of elements that resolve most.
//!
//! # Example: a sweep of a shipped study
//! ```
//! use taxel::sensor::Sensor;
//! use taxel::solutions::TablesOnly;
//! use taxel_study::{run::Runner, shipped_text, study::{SensorText, Study}, sweep::designs};
//!
//! let text = shipped_text("p2-gaps").expect("a shipped study");
//! let name = "three-axis-8x8";
//! let sensor = SensorText { name, text: Sensor::shipped_text(name).expect("a shipped sensor") };
//! let study = Study::parse("p2-gaps", text, &sensor, Box::new(|| Box::new(TablesOnly)))?;
//! let points = designs(&study, None)?; // 10 air gaps by 11 insulations
//! let rows = Runner::new(&study).rows(&points[..2])?;
//! let resolution = rows[0].as_ref().and_then(|row| row.answers[0].number());
//! assert!(resolution.is_some_and(|newtons| newtons > 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
mod surrogate;
pub mod sweep;
pub mod tolerance;

pub use shipped::{shipped_names, shipped_text};
