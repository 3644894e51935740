//! Two crossing layers of channels, as they are drawn.

use super::{Hyperelastic, MicrochannelSection, PressureLaw};

/// Two crossing layers of channels, from their drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct VoidStack {
    /// Cross-section of all channels.
    pub section: MicrochannelSection,
    /// Spacing of the channels of one layer, the same in both, m.
    pub pitch: f64,
    /// Solid below the lower channels, m.
    pub base: f64,
    /// Solid between the layers, m.
    pub between: f64,
    /// Solid above the upper channels, m.
    pub cover: f64,
    /// The solid.
    pub material: Hyperelastic,
    /// Law of the pressure of the liquid; microchannels pressed over all their length.
    pub liquid: PressureLaw,
}
