//! Use of the three directions by a body.

/// Kinematics of the third direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kinematics {
    /// Two dimensions, no stretch along the third; per unit depth.
    PlaneStrain,
    /// Radius first, axis second; the whole turn.
    Axisymmetric,
    /// Three dimensions.
    Solid,
}

impl Kinematics {
    /// Components of displacement.
    pub const fn components(self) -> usize {
        match self {
            Self::PlaneStrain | Self::Axisymmetric => 2,
            Self::Solid => 3,
        }
    }

    /// Directions in which a displacement varies (the hoop is the third).
    pub(crate) const fn directions(self) -> usize {
        match self {
            Self::PlaneStrain => 2,
            Self::Axisymmetric | Self::Solid => 3,
        }
    }

    /// Pressure functions of a cell.
    pub const fn pressures(self) -> usize {
        self.components() + 1
    }
}
