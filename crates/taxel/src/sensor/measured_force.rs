//! Taxels whose board gives forces, as a sensor file describes them.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::mechanics::ForceAxes;
use crate::quantity::{self, Checked, PositiveForce};

/// Taxels whose board gives forces already: nothing is left to invert. Unit, noise and range
/// of the forces are those of `electronics.readout.measured`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredForce {
    /// Forces of a taxel in the order of a frame.
    pub axes: ForceAxes,
    /// Force at the end of the colour scale, N; a contact begins above a hundredth of it.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub full_scale: f64,
}
