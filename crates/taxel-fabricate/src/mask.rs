//! Figures of one step, and moulds.

use std::borrow::Cow;

use crate::options::Polarity;
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

    /// The mask as it is drawn in a field: the figures, or what they leave of it.
    pub fn drawn(&self, field: &Rectangle, polarity: Polarity) -> Cow<'_, Self> {
        match polarity {
            Polarity::AsDrawn => Cow::Borrowed(self),
            Polarity::Inverted => Cow::Owned(Self {
                name: self.name,
                figures: complement(field, &self.figures),
            }),
        }
    }
}

impl Mould {
    /// Its closed surface, m, for a part that shrinks by the share `shrink` when it cures: larger
    /// by 1/(1 - shrink).
    pub fn mesh(&self, shrink: f64) -> Mesh {
        self.relief.mesh().scaled(1.0 / (1.0 - shrink))
    }
}
