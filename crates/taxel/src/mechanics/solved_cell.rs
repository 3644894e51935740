//! What is solved of a cell that no table has: its closing curve.

use serde::{Deserialize, Serialize};

use super::microchannel::{ClosingCurve, CurveSource, MicrochannelError};
use taxel_numerics::MonotoneCurve;

/// A solved cell, in units of the shear modulus.
///
/// Lengths scale freely, and any incompressible Mooney-Rivlin solid in plane strain is a
/// neo-Hookean one: the curve follows from the ratios of the lengths alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolvedCell {
    /// Share of the area lost per net pressure at rest.
    pub compliance: f64,
    /// Net pressure and area ratio, from the first state after rest on.
    pub points: Vec<[f64; 2]>,
    /// Pressure inside beyond that outside and area ratio, from the first state after rest on, as
    /// far as the solution goes and more pressure bulges it more; empty where it hardly goes.
    pub bulged: Vec<[f64; 2]>,
    /// Area ratio at which roof and floor touch first.
    pub touch: Option<f64>,
    /// Greatest known error of the net pressure at an area ratio, as a share.
    pub error: f64,
    /// Why the solution ended before the last area ratio.
    pub ended: Option<String>,
}

impl SolvedCell {
    /// Fewest points of a curve.
    pub const FEWEST: usize = 4;

    /// The curve for a solid of `shear_modulus`, Pa.
    ///
    /// # Errors
    /// [`MicrochannelError::Curve`]; never of a solution that [`Self::of_cell`] gave.
    pub fn curve(&self, shear_modulus: f64) -> Result<ClosingCurve, MicrochannelError> {
        let through = |given: &[[f64; 2]], slope: f64| {
            let given = given
                .iter()
                .map(|[pressure, ratio]| [pressure * shear_modulus, *ratio]);
            let points = std::iter::once([0.0, 1.0]).chain(given).collect();
            MonotoneCurve::new(points, Some(slope / shear_modulus))
        };
        let curve = through(&self.points, -self.compliance)?;
        let source = CurveSource::Solved {
            error: self.error,
            ended: self.ended.clone(),
        };
        let closing = ClosingCurve::of_source(curve, self.touch, source);
        if self.bulged.is_empty() {
            return Ok(closing);
        }
        Ok(closing.bulging(through(&self.bulged, self.compliance)?))
    }

    /// True of numbers that make a curve.
    pub(crate) fn is_sound(&self) -> bool {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        positive(self.compliance)
            && positive(self.error)
            && self.points.len() >= Self::FEWEST
            && self.points.iter().all(|[_, ratio]| positive(*ratio))
            && self.touch.is_none_or(positive)
            && self.curve(1.0).is_ok()
    }
}
