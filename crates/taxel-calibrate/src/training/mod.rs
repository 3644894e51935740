//! Training of maps from recordings, for devices without a physical model.
//!
//! [`Series`] and [`Session`] bring recordings to one time, [`train_position`]
//! learns where a probe of fixed depth presses, [`train_forces`] how hard, with
//! the memory of a creeping body. `docs/theory/trained-maps.md` has the equations
//! and what the maps reach on real recordings.

mod across;
mod blocks;
mod design;
mod fold;
mod force;
mod law;
mod next_run;
mod place;
mod position;
mod relation;
mod rest;
mod scale_clock;
mod series;
mod session;

pub(crate) use across::{REST_FRAMES, WITHIN_ANOTHER, maps_of};
pub use across::{TrainedForces, delay_of_scale, train_forces};
pub use blocks::{Score, blocks_of_time, interval_factor};
pub use design::{Candidate, HeldOutReadings};
pub use force::LearnedForces;
pub(crate) use force::{DELAY_READINGS, Quick};
pub(crate) use place::{TrainedPlace, train_place};
pub(crate) use position::{PlacedRows, Split, for_the_next_run, trained_position};
pub use position::{PositionOptions, train_position};
pub(crate) use relation::trained_relation;
pub(crate) use rest::rest_of;
pub use scale_clock::ScaleClock;
pub use series::Series;
pub(crate) use session::CONTACT_SHARE;
pub use session::{STANDARD_GRAVITY, Session};
pub use taxel_numerics::least_squares::NORMAL_95;
