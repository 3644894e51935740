//! Bodies of devices and of problem files, solved by finite elements.
//!
//! `taxel` answers by closed forms and tables, and asks a
//! [`Solver`](taxel::solutions::Solver) for what no table has. Here is that solver,
//! [`FiniteElements`], with the bodies that it solves; [`field_predictor`] answers loads by the
//! body of a whole device, [`tabulate`] makes its load path a table, and [`problem`] solves bodies
//! of a user's own.
//!
//! # Example: a channel that no table has
//! ```no_run
//! use taxel::sensor::Sensor;
//! use taxel_bodies::Afresh;
//! # let text = Sensor::shipped_text("liquid-metal-2x4").unwrap();
//! let text = text.replace("roof = \"140 um\"", "roof = \"150 um\"");
//! assert!(Sensor::parse("mine.toml", &text).is_err());
//! // Seconds.
//! let sensor = Sensor::parse_with("mine.toml", &text, &mut Afresh)?;
//! # Ok::<(), taxel::InputError>(())
//! ```

pub mod device;
pub mod mechanics;
pub mod microchannel_section;
pub mod problem;
mod solver;
pub mod transduction;

pub use device::{
    NotSolvable, NotTabulated, field_predictor, solve_point, tabulate, tabulate_body,
};
pub use solver::{Afresh, FiniteElements};
