//! Surfaces of the mesh that touch each other: two bodies, or a body and itself.

use crate::mesh::sight::thickness;
use crate::mesh::{Facet, Mesh};

/// A surface that may not enter another one, or itself.
///
/// Every point of integration of the first surface is kept out of the facet of the second that
/// it looks at along the normal of its own surface (after Poulios and Renard, Comput. Struct. 153,
/// 75, 2015): name the finer or softer one first. A facet of the first surface is
/// integrated in parts that end where the facets of the second over it do before the body is
/// loaded, so that an even pressure passes through meshes that do not match. Where a surface is on both sides, every pair of its points is met
/// twice, each time with half of its area.
///
/// Facets that share a node touch each other only if they face each other before the body is
/// loaded, as at the tip of a slit; the tip of another fold stays open by a cell. Sharp corners of
/// flat faces have a contact of their own ([`crate::assembly::folds`]).
#[derive(Clone, Debug, PartialEq)]
pub struct SurfacePair {
    /// Surface whose points are kept out.
    pub first: Vec<Facet>,
    /// Surface that they are kept out of.
    pub second: Vec<Facet>,
    /// Contact stiffness, Pa/m.
    pub stiffness: f64,
    /// Coefficient of friction (Coulomb), zero without.
    pub friction: f64,
    /// Overlap that is accepted, m.
    pub overlap_limit: f64,
    /// Overlap beyond which two points do not meet any more, m. A step in which a node of the
    /// surfaces moves farther is divided. For a surface that meets itself: less than the
    /// thickness of the body at it.
    pub reach: f64,
}

/// Reach of surfaces of two bodies over the mean side of their facets.
const REACH: f64 = 10.0;

impl SurfacePair {
    /// A pair without friction. The stiffness is 50 times `shear_modulus` (Pa, of the softer
    /// body) over the mean side of a facet of the first surface, the overlap that is accepted
    /// 1e-4 of that side; the reach is ten sides, but for a surface that meets itself one side, or half of
    /// the thickness of the body there where that is less: a body that is pressed flatter than by half
    /// would meet its own far side.
    pub fn new(mesh: &Mesh, surfaces: [Vec<Facet>; 2], shear_modulus: f64) -> Self {
        let [first, second] = surfaces;
        let side = mesh.mean_side(&first);
        let mut pair = Self {
            first,
            second,
            stiffness: 50.0 * shear_modulus / side,
            friction: 0.0,
            overlap_limit: 1e-4 * side,
            reach: side,
        };
        pair.reach = if pair.meets_itself() {
            side.min(0.5 * thickness(mesh, &pair.first))
        } else {
            REACH * side.max(mesh.mean_side(&pair.second))
        };
        pair
    }

    /// True if a facet is on both sides.
    pub fn meets_itself(&self) -> bool {
        let second: std::collections::BTreeSet<Facet> = self.second.iter().copied().collect();
        self.first.iter().any(|facet| second.contains(facet))
    }
}
