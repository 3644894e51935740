//! Method that computes deformations.

use schemars::JsonSchema;
use serde::Deserialize;

/// Method that computes deformations.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mechanics {
    /// Closed forms and tables; answers at once.
    #[default]
    ClosedForm,
    /// Finite elements of the drawing; seconds to minutes.
    Fem,
    /// The way by finite elements that `taxel tabulate` solved before, in this file beside the
    /// sensor file; read like a closed form, by twin, estimation and studies too.
    Table(String),
}
