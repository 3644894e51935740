//! What is known of one device: the model that estimation inverts.

mod unit_model;

pub use unit_model::{EffectiveMotion, ForceRelaxation, Linearisation, UnitModel, force_relaxation};
