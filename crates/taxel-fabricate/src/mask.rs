//! Figures of one step, and moulds.

use crate::rectangle::{Rectangle, complement};
use crate::relief::{Mesh, Relief};

/// The figures of one step, seen from above.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    /// Name, such as `lower-electrodes`.
    pub name: &'static str,
    /// Figures; they do not overlap, but may touch.
    pub figures: Vec<Rectangle>,
}

/// A mould into which a part is cast, or a master.
#[derive(Debug, Clone, PartialEq)]
pub struct Mould {
    /// Name, such as `mould-bumps`.
    pub name: &'static str,
    /// What it is for, in a few words.
    pub about: String,
    /// The body that is solid between z = 0 and this relief.
    pub relief: Relief,
}

impl Mask {
    /// Area of all figures, m².
    pub fn area(&self) -> f64 {
        self.figures.iter().map(Rectangle::area).sum()
    }

    /// The field without the figures.
    pub(crate) fn inverted(&self, field: &Rectangle) -> Self {
        Self {
            name: self.name,
            figures: complement(field, &self.figures),
        }
    }
}

impl Mould {
    /// Its closed surface, m.
    pub fn mesh(&self) -> Mesh {
        self.relief.mesh()
    }
}
