//! Strips of no thickness in unbounded space.

use super::grid::{Sizes, line, name_nodes, plane};
use super::{FieldCase, SPACE, check, growth, open, solve};
use crate::field::FieldError;
use crate::field::electrostatics::Infinity;
use crate::field::geometry::Geometry;
use crate::field::laplace::Coefficient;

/// Coplanar strips of width `s` a gap `g` apart: the ratio `s/g` with
/// `C'/eps = K(k')/K(k)`, `k = g/(g + 2 s)`, by conformal mapping.
pub const COPLANAR_STRIPS: [(f64, f64); 9] = [
    (0.1, 0.830644062),
    (0.5, 1.27926157),
    (1.0, 1.56340192),
    (2.0, 1.90067024),
    (5.0, 2.40777018),
    (10.0, 2.82038435),
    (20.0, 3.24658110),
    (50.0, 3.82060377),
    (100.0, 4.25872722),
];

/// Opposed strips of width `w` a distance `d` apart: the ratio `w/d` with `C'/eps` of
/// an integral equation solved to 1e-13.
pub const OPPOSED_STRIPS: [(f64, f64); 5] = [
    (0.1, 0.85135115),
    (1.0, 2.11577897),
    (5.0, 6.49067575),
    (10.0, 11.68133008),
    (50.0, 52.16105440),
];

/// Size of the cells at an edge where the field grows as `r^-1/2`: the energy of a cell
/// there is in proportion to its size.
fn at_edge(scale: f64, level: u32) -> f64 {
    scale * 1e-3 * 4.0_f64.powi(-(level as i32))
}

/// Two coplanar strips, width over gap `ratio`; a quarter of the plane, whose vertical
/// axis is at zero. `C'/eps0`.
///
/// # Errors
/// [`FieldError`] for ratios or levels out of range.
pub fn coplanar_strips(ratio: f64, reference: f64, level: u32) -> Result<FieldCase, FieldError> {
    let (ours, cells) = coplanar_strips_in(&SPACE, ratio, level)?;
    Ok(FieldCase {
        name: format!("coplanar strips, s/g = {ratio}"),
        ours,
        reference,
        cells,
    })
}

/// Capacitance in a medium and number of cells.
fn coplanar_strips_in(
    medium: &[(&str, Coefficient)],
    ratio: f64,
    level: u32,
) -> Result<(f64, usize), FieldError> {
    check(level, &[("width over gap", ratio)])?;
    let (half_gap, width) = (0.5 / ratio, 1.0);
    let outer = half_gap + width;
    let edge = Some(at_edge((2.0 * half_gap).min(width), level));
    let size = 1.6 * outer;
    let sizes = Sizes {
        growth: growth(level),
        largest: 0.5 * outer / f64::from(level),
    };
    let xs = line(
        sizes,
        &[(0.0, None), (half_gap, edge), (outer, edge), (size, None)],
    );
    let ys = line(sizes, &[(0.0, edge), (size, None)]);
    let mut mesh = plane(&xs, &ys, &|_| Some("space"));
    name_nodes(&mut mesh, "strip", &|p| {
        p[1] == 0.0 && p[0] >= half_gap && p[0] <= outer
    });
    mesh.name_boundary("box", |p| p[0] == size || p[1] == size);
    let exterior = open(&mut mesh, 1.7 * size, level)?;
    name_nodes(&mut mesh, "odd", &|p| p[0] == 0.0);
    let found = solve(
        &mesh,
        Geometry::Plane,
        &exterior,
        medium,
        &["strip"],
        &["odd"],
        Infinity::Free,
    )?;
    // Two quarters carry one strip, at half the voltage.
    Ok((found.matrix[0][0], mesh.cell_count()))
}

/// Two opposed strips, width over distance `ratio`; a quarter of the plane, whose
/// horizontal axis is at zero. `C'/eps0`.
///
/// # Errors
/// [`FieldError`] for ratios or levels out of range.
pub fn opposed_strips(ratio: f64, reference: f64, level: u32) -> Result<FieldCase, FieldError> {
    above_plane(ratio, reference, level, false)
}

/// A strip of twice the distance above a ground plane that is named in the inner mesh only, and
/// goes on from there to infinity: the same field as that of [`opposed_strips`]. `C'/eps0`.
///
/// # Errors
/// [`FieldError`] for ratios or levels out of range.
pub fn strip_above_ground(ratio: f64, reference: f64, level: u32) -> Result<FieldCase, FieldError> {
    above_plane(ratio, reference, level, true)
}

fn above_plane(
    ratio: f64,
    reference: f64,
    level: u32,
    inside_only: bool,
) -> Result<FieldCase, FieldError> {
    check(level, &[("width over distance", ratio)])?;
    let (half_width, height) = (0.5 * ratio, 0.5);
    let edge = Some(at_edge(ratio.min(1.0), level));
    let size = 1.5 * half_width.max(height) + height;
    let sizes = Sizes {
        growth: growth(level),
        largest: 0.3 * size / f64::from(level),
    };
    let xs = line(sizes, &[(0.0, None), (half_width, edge), (size, None)]);
    let ys = line(sizes, &[(0.0, None), (height, edge), (size, None)]);
    let mut mesh = plane(&xs, &ys, &|_| Some("space"));
    name_nodes(&mut mesh, "strip", &|p| {
        p[1] == height && p[0] <= half_width
    });
    mesh.name_boundary("box", |p| p[0] == size || p[1] == size);
    let exterior = open(&mut mesh, 1.7 * size, level)?;
    let first = exterior.infinity;
    name_nodes(&mut mesh, "odd", &|p| p[1] == 0.0);
    if inside_only && let Some(nodes) = mesh.node_sets.get_mut("odd") {
        // Nodes of the image are added last.
        nodes.retain(|&node| node < first);
    }
    let found = solve(
        &mesh,
        Geometry::Plane,
        &exterior,
        &SPACE,
        &["strip"],
        &["odd"],
        Infinity::Free,
    )?;
    // Two quarters carry one strip, at half the voltage.
    Ok(FieldCase {
        name: if inside_only {
            format!("strip above a ground plane, w/d = {ratio}")
        } else {
            format!("opposed strips, w/d = {ratio}")
        },
        ours: found.matrix[0][0],
        reference,
        cells: mesh.cell_count(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crystal_is_empty_space_stretched() {
        // k = diag(1, 4): with y halved the medium is isotropic again, times sqrt(4). It
        // reaches infinity, where the inversion mirrors it.
        let crystal = Coefficient::Tensor([1.0, 4.0, 1.0, 0.0, 0.0, 0.0]);
        let found = coplanar_strips_in(&[("space", crystal)], 1.0, 3).unwrap().0;
        let error = found / (2.0 * 1.56340192) - 1.0;
        assert!(error > 0.0 && error < 1e-4, "{error:e}");
    }
}
