//! How a plan is written.

/// Which side of the edges a mask fills.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Polarity {
    /// Figures are the parts themselves.
    #[default]
    AsDrawn,
    /// Figures are what is left of the field around the parts.
    Inverted,
}

/// How masks and moulds are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Share by which a cast part shrinks when it cures, from 0 to below 1; default 0. Moulds are
    /// larger by 1/(1 - shrink).
    pub shrink: f64,
    /// Whether masks are mirrored along x, for exposure from behind; default false.
    pub mirror: bool,
    /// Which side of the edges masks fill; default [`Polarity::AsDrawn`].
    pub polarity: Polarity,
    /// Whether each mask has crosses outside the corners of the field, at the same places in all
    /// masks; default false.
    pub marks: bool,
    /// Coordinates of masks are multiples of this length, m; default 1 nm.
    pub grid: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            shrink: 0.0,
            mirror: false,
            polarity: Polarity::AsDrawn,
            marks: false,
            grid: 1e-9,
        }
    }
}
