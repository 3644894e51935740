//! Results as files of VTK and as pictures. Nothing here opens a file.

mod colour;
mod picture;
mod vtu;

pub use colour::ColourMap;
pub use picture::{Colours, Picture, Values};
pub use vtu::{Encoding, Vtu, pvd};

use thiserror::Error;

/// A result cannot be shown.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A field has too few or too many numbers.
    #[error(
        "field \"{field}\" has {found} numbers, expected {expected}: {components} for each of {items} {what}"
    )]
    Length {
        /// Name of the field.
        field: String,
        /// Numbers given.
        found: usize,
        /// Numbers needed.
        expected: usize,
        /// Numbers for each node or cell.
        components: usize,
        /// Number of nodes or cells.
        items: usize,
        /// Nodes or cells.
        what: &'static str,
    },
    /// The mesh has no surface of this name.
    #[error("no surface \"{name}\"; there are {known:?}")]
    NoSurface {
        /// The name.
        name: String,
        /// Names of the surfaces.
        known: Vec<String>,
    },
    /// A mesh in space is drawn by a surface of it.
    #[error("a mesh of {dimension} dimensions has no plane picture; name a plane surface of it")]
    NotPlane {
        /// Number of dimensions.
        dimension: usize,
    },
    /// There is nothing to draw.
    #[error("there are no cells to draw")]
    Nothing,
    /// A node to be drawn has no place.
    #[error("node {node} is drawn at {place:?}, which is no place")]
    NoPlace {
        /// Number of the node.
        node: u32,
        /// Its place.
        place: [f64; 2],
    },
}

/// Refuses a field of the wrong length.
fn check_length(
    field: &str,
    found: usize,
    components: usize,
    items: usize,
    what: &'static str,
) -> Result<(), OutputError> {
    let expected = components.saturating_mul(items);
    if found == expected {
        return Ok(());
    }
    Err(OutputError::Length {
        field: field.to_owned(),
        found,
        expected,
        components,
        items,
        what,
    })
}

/// Text that is safe in XML.
fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            // Not allowed in XML at all.
            letter if letter.is_control() => safe.push(' '),
            letter => safe.push(letter),
        }
    }
    safe
}
