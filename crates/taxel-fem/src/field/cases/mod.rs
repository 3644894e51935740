//! Fields with known answers, each at a chosen refinement.
//!
//! `level` is 1 for the coarsest mesh; sizes of cells at edges and the growth between
//! them fall with it. Lengths are in the units of the case, capacitances divided by
//! the permittivity of vacuum.

mod bars;
mod conductor;
mod facing_plates;
pub(super) mod grid;
mod round;
mod strips;

pub use bars::{Bars, Surroundings, bars, bars_above_base};
pub use conductor::corner_square;
pub use facing_plates::{Beside, FacingPlates, Neighbour, SquarePlates};
pub use round::{COAXIAL_DISCS, coaxial_discs, cube, disc, sphere};
pub use strips::{
    COPLANAR_STRIPS, OPPOSED_STRIPS, coplanar_strips, opposed_strips, strip_above_ground,
};

use super::FieldError;
use super::electrostatics::{Capacitance, Electrostatics, Infinity, VACUUM_PERMITTIVITY};
use super::exterior::{Ball, Exterior, Shell, add_exterior, surround};
use super::geometry::Geometry;
use super::laplace::{Coefficient, Domain, MeshMotion};
use crate::mesh::Mesh;

/// A computed number beside the known one.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldCase {
    /// Name of the case.
    pub name: String,
    /// Our value.
    pub ours: f64,
    /// The known value.
    pub reference: f64,
    /// Number of cells.
    pub cells: usize,
}

impl FieldCase {
    /// Relative error, with its sign.
    pub fn error(&self) -> f64 {
        self.ours / self.reference - 1.0
    }
}

/// Nominal field of an ideal incompressible neo-Hookean dielectric under equal biaxial
/// stretch `l`, in units of `sqrt(mu/eps)`: `sqrt(l^-2 - l^-8)`. Its maximum, where
/// the layer is pulled together, is at `l = 4^(1/6)`.
pub fn ideal_dielectric_field(stretch: f64) -> f64 {
    (stretch.powi(-2) - stretch.powi(-8)).sqrt()
}

/// Empty space.
const SPACE: [(&str, Coefficient); 1] = [("space", Coefficient::Scalar(1.0))];

/// Checks a level, and numbers that may span a few powers of ten.
fn check(level: u32, numbers: &[(&'static str, f64)]) -> Result<(), FieldError> {
    if !(1..=8).contains(&level) {
        return Err(FieldError::OutOfRange {
            quantity: "level of refinement",
            value: f64::from(level),
            allowed: "1 to 8",
        });
    }
    for &(quantity, value) in numbers {
        if !(1e-4..=1e4).contains(&value) {
            return Err(FieldError::OutOfRange {
                quantity,
                value,
                allowed: "1e-4 to 1e4",
            });
        }
    }
    Ok(())
}

/// Growth from cell to cell.
fn growth(level: u32) -> f64 {
    4.0_f64.powf(1.0 / f64::from(level))
}

/// Blends the surface "box" into a circle or sphere about the origin and adds the
/// space outside.
fn open(mesh: &mut Mesh, radius: f64, level: u32) -> Result<Exterior, FieldError> {
    let ball = Ball {
        centre: [0.0; 3],
        radius,
    };
    let layers = 2 * level as usize;
    let shell = Shell {
        ball,
        layers,
        growth: 1.0,
        region: None,
    };
    surround(mesh, "box", shell, "ball")?;
    add_exterior(mesh, "ball", ball, layers)
}

/// Capacitances in units of the permittivity of vacuum.
fn solve(
    mesh: &Mesh,
    geometry: Geometry,
    exterior: &Exterior,
    permittivities: &[(&str, Coefficient)],
    conductors: &[&str],
    zero: &[&str],
    infinity: Infinity,
) -> Result<Capacitance, FieldError> {
    let mut found = Electrostatics {
        domain: Domain {
            mesh,
            geometry,
            motion: MeshMotion::None,
            exterior: Some(exterior),
        },
        permittivities,
        conductors,
        floating: &[],
        zero,
        infinity,
    }
    .capacitance()?;
    for entry in found.matrix.iter_mut().flatten() {
        *entry /= VACUUM_PERMITTIVITY;
    }
    Ok(found)
}
