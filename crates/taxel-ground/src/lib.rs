//! What taxel's crates stand on: quantities with units, mistakes in files shown at the very
//! word, the schema and the reference of a file, tables, figures and drawings. It knows no
//! sensor and no solver, and opens no file.
//!
//! # Example: a unit of another dimension is shown under the very word
//! ```
//! use schemars::JsonSchema;
//! use serde::Deserialize;
//! use taxel_ground::quantity::{self, PositiveLength};
//! use taxel_ground::toml_input;
//!
//! #[derive(Debug, Deserialize, JsonSchema)]
//! struct Layer {
//!     /// Thickness, m.
//!     #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
//!     #[schemars(with = "quantity::Checked<PositiveLength>")]
//!     thickness: f64,
//! }
//!
//! let layer: Layer = toml_input::parse("layer.toml", "thickness = \"350 um\"")?;
//! assert_eq!(layer.thickness, 350e-6);
//! let error = toml_input::parse::<Layer>("layer.toml", "thickness = \"350 kPa\"").unwrap_err();
//! assert!(error.to_string().contains("| thickness = \"350 kPa\"\n   |             ^^^^^^^^^"));
//! # Ok::<(), taxel_ground::InputError>(())
//! ```

pub mod drawing;
pub mod figure;
mod input;
pub mod quantity;
pub mod schema;
pub mod shown;
pub mod stress_map;
pub mod summary;
pub mod svg;
pub mod table;
pub mod toml_input;
pub mod words;
pub mod work;

pub use input::{InputError, Place, Utf16, separator_of, text_of};
