//! Training of maps from recordings, for devices without a physical model.
//!
//! [`Series`] and [`Session`] bring recordings to one time, [`train_position`]
//! learns where a probe of fixed depth presses, [`train_force`] how hard, with
//! the memory of a creeping body. `docs/theory/trained-maps.md` has the equations
//! and what the maps reach on real recordings.

mod across;
mod blocks;
mod compare;
mod components;
mod force;
mod nearest;
mod network;
mod next_run;
mod position;
mod relation;
mod replay;
mod scale_clock;
mod series;
mod session;

pub(crate) use across::WITHIN_ANOTHER;
pub use across::{AcrossRuns, usual_candidates};
pub use blocks::{NORMAL_95, Score, blocks_of_time, interval_factor};
pub(crate) use compare::compared_places;
pub use compare::{Compared, compared_forces};
pub use components::{TrainedComponent, trained_components};
pub use force::{ForceOptions, HeldOutForce, TrainingRun, features_of, train_force};
pub use nearest::Nearest;
pub(crate) use position::{PlacedRows, Split, for_the_next_run, trained_position};
pub use position::{PositionOptions, train_position};
pub(crate) use relation::trained_relation;
pub(crate) use replay::REST_FRAMES;
pub use scale_clock::ScaleClock;
pub use series::Series;
pub(crate) use session::CONTACT_SHARE;
pub use session::{STANDARD_GRAVITY, Session};
