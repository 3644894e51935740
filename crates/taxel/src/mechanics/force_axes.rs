//! Which forces of a taxel are known.

use schemars::JsonSchema;
use serde::Deserialize;

/// Forces of a taxel in the order of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceAxes {
    /// The pressing force alone.
    Z,
    /// Along x and y of the taxel, and pressing.
    Xyz,
}

impl ForceAxes {
    /// Name of each force, in the order of a frame.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Self::Z => &["z"],
            Self::Xyz => &["x", "y", "z"],
        }
    }

    /// Number of forces of a taxel.
    pub fn count(self) -> usize {
        self.names().len()
    }

    /// Index of the first of them among x, y and z.
    pub fn first(self) -> usize {
        3 - self.count()
    }
}
