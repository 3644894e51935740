//! Contact stiffness that grows with the pressure.

use crate::problem::{Contact, Problem};

/// Contact stiffness at a point over the square of its pressure, times the shear modulus and the
/// side of a cell. Under a pressure p a wave along the surface that goes with an overlap frees energy in
/// proportion to p; shape change and overlap of the shortest wave, that of a cell, bear it from about
/// k = 2 p²/(μ h) on.
const HARDENING: f64 = 4.0;

/// The greatest share of its contact stiffness that a point takes: enough for a hundred shear moduli
/// where that is 50 moduli over the side of a cell. Beyond it lie multipliers of parts that are driven
/// into each other.
const HARDEST: f64 = 1e3;

/// What the contact stiffness at a point is over the square of its multiplier, 1/(Pa m); nothing
/// for walls.
pub(super) fn hardening(problem: &Problem, contact: &Contact) -> f64 {
    let mesh = &problem.mesh;
    let surfaces = match contact {
        Contact::Obstacle(obstacle) => vec![&obstacle.surface],
        Contact::Surfaces(pair) => vec![&pair.first, &pair.second],
        Contact::Walls(_) => return 0.0,
    };
    let facets = surfaces.iter().flat_map(|surface| surface.iter());
    let moduli = facets.map(|facet| {
        let region = mesh.region_of(facet.cell as usize);
        problem.materials[region].law().shear_modulus()
    });
    let softest = moduli.fold(f64::INFINITY, f64::min);
    HARDENING / (softest * mesh.median_side(surfaces[0]))
}

/// The contact stiffness at a point, Pa/m: that of the contact, or what the pressure of its
/// multiplier asks for.
pub(super) fn hardened(stiffness: f64, hardening: f64, multiplier: f64) -> f64 {
    let asked = hardening * multiplier * multiplier;
    asked.min(HARDEST * stiffness).max(stiffness)
}
