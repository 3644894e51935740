//! Loss of a residual.

/// Cost ρ of a squared residual, in units of the noise.
///
/// The square is right for normal noise. Readings that are wrong now and then
/// call for [`Loss::Huber`]: it is convex, so that a fit keeps one minimum, and
/// loses 5 % of precision on normal noise. [`Loss::SoftL1`] is its smooth
/// likeness; [`Loss::Cauchy`] forgets gross errors altogether, and may then
/// have minima beside the right one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Loss {
    /// r².
    #[default]
    Square,
    /// r² up to 1.345, then its tangent.
    Huber,
    /// 2(√(1 + r²) − 1).
    SoftL1,
    /// ln(1 + (r/2.385)²)·2.385².
    Cauchy,
}

/// 95 % efficient on normal noise.
const HUBER: f64 = 1.345;
const CAUCHY: f64 = 2.3849;

impl Loss {
    /// Cost of a residual.
    pub(super) fn cost(self, residual: f64) -> f64 {
        let square = residual * residual;
        match self {
            Self::Huber if square > HUBER * HUBER => 2.0 * HUBER * residual.abs() - HUBER * HUBER,
            Self::Square | Self::Huber => square,
            Self::SoftL1 => 2.0 * ((1.0 + square).sqrt() - 1.0),
            Self::Cauchy => CAUCHY * CAUCHY * (square / (CAUCHY * CAUCHY)).ln_1p(),
        }
    }

    /// dρ/d(r²): the weight of a squared residual.
    pub(super) fn weight(self, residual: f64) -> f64 {
        let square = residual * residual;
        match self {
            Self::Huber if square > HUBER * HUBER => HUBER / residual.abs(),
            Self::Square | Self::Huber => 1.0,
            Self::SoftL1 => 1.0 / (1.0 + square).sqrt(),
            Self::Cauchy => 1.0 / (1.0 + square / (CAUCHY * CAUCHY)),
        }
    }
}
