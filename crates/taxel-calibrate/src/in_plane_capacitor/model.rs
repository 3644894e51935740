//! The models that readings of in-plane sensors are fitted with.

use taxel::transduction::CapacitanceLaw;

pub(super) static MODELS: [&str; 3] = ["model-1", "model-2", "first-principles"];

/// Which parameters are free under which law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Model {
    /// P1 Eqs. 7 and 8.
    One,
    /// Parallel plates with the published thickness: q = 1, γ = 0.
    Two,
    /// Mechanics and fields; only the rest capacitance is free.
    FirstPrinciples,
}

impl Model {
    pub(super) const ALL: [Self; 3] = [Self::One, Self::Two, Self::FirstPrinciples];

    pub(super) fn name(self) -> &'static str {
        MODELS[self as usize]
    }

    pub(super) fn about(self) -> &'static str {
        match self {
            Self::One => "change of parallel plates times q (U/D)^gamma, thickness by t_min and n",
            Self::Two => "change of parallel plates, thickness by t_min and n",
            Self::FirstPrinciples => "mechanics and field of the drawing; no fitted change",
        }
    }

    pub(super) fn law(self) -> CapacitanceLaw {
        match self {
            Self::FirstPrinciples => CapacitanceLaw::Mechanics,
            _ => CapacitanceLaw::Published,
        }
    }
}
