//! Discs, a sphere and a cube in unbounded space.

use super::grid::{Sizes, line, name_nodes, plane, solid};
use super::{FieldCase, SPACE, check, growth, open, solve};
use crate::field::FieldError;
use crate::field::electrostatics::Infinity;
use crate::field::exterior::{Ball, Shell, add_exterior, surround};
use crate::field::geometry::Geometry;
use std::f64::consts::{FRAC_PI_2, PI};

/// Coaxial discs of radius `a` a distance `d` apart: `d/a` with `C/(eps a)` of Love's
/// integral equation (1949).
pub const COAXIAL_DISCS: [(f64, f64); 5] = [
    (2.0, 5.5521089),
    (1.0, 7.2831399),
    (0.5, 10.7182992),
    (0.2, 20.7030490),
    (0.05, 68.9285251),
];

/// Two coaxial discs, distance over radius `ratio`; one half, whose middle plane is at
/// zero. `C/(eps0 a)`.
///
/// # Errors
/// [`FieldError`] for ratios or levels out of range.
pub fn coaxial_discs(ratio: f64, reference: f64, level: u32) -> Result<FieldCase, FieldError> {
    check(level, &[("distance over radius", ratio)])?;
    let height = 0.5 * ratio;
    let (capacitance, cells) = disc_at(height, &["middle"], ratio.min(1.0), level)?;
    Ok(FieldCase {
        name: format!("coaxial discs, d/a = {ratio}"),
        // The disc is at half the voltage.
        ours: capacitance / 2.0,
        reference,
        cells,
    })
}

/// An isolated disc, `C/(eps0 a) = 8`.
///
/// # Errors
/// [`FieldError`] for levels out of range.
pub fn disc(level: u32) -> Result<FieldCase, FieldError> {
    check(level, &[])?;
    let (capacitance, cells) = disc_at(0.0, &[], 1.0, level)?;
    Ok(FieldCase {
        name: "isolated disc".into(),
        ours: 2.0 * capacitance,
        reference: 8.0,
        cells,
    })
}

/// Capacitance of a disc of radius one at a height above the middle plane, the upper
/// half space alone.
fn disc_at(height: f64, zero: &[&str], scale: f64, level: u32) -> Result<(f64, usize), FieldError> {
    // The field grows as r^-1/2 at the edge.
    let edge = Some(scale * 1e-3 * 4.0_f64.powi(-(level as i32)));
    let size = 1.5_f64.max(1.5 * height) + 0.3;
    let sizes = Sizes {
        growth: growth(level),
        largest: 0.4 / f64::from(level),
    };
    let radii = line(sizes, &[(0.0, None), (1.0, edge), (size, None)]);
    let heights = if height > 0.0 {
        line(sizes, &[(0.0, None), (height, edge), (size, None)])
    } else {
        line(sizes, &[(0.0, edge), (size, None)])
    };
    let mut mesh = plane(&radii, &heights, &|_| Some("space"));
    name_nodes(&mut mesh, "disc", &|p| p[1] == height && p[0] <= 1.0);
    mesh.name_boundary("box", |p| p[0] == size || p[1] == size);
    let exterior = open(&mut mesh, 1.7 * size, level)?;
    name_nodes(&mut mesh, "middle", &|p| p[1] == 0.0);
    let found = solve(
        &mesh,
        Geometry::Axisymmetric,
        &exterior,
        &SPACE,
        &["disc"],
        zero,
        Infinity::Zero,
    )?;
    Ok((found.matrix[0][0], mesh.cell_count()))
}

/// An isolated sphere, `C/(eps0 a) = 4 pi`; a quarter of its section.
///
/// # Errors
/// [`FieldError`] for levels out of range.
pub fn sphere(level: u32) -> Result<FieldCase, FieldError> {
    check(level, &[])?;
    let count = 4 * level as usize;
    let sizes = |length: f64| Sizes {
        growth: 1.0,
        largest: length / count as f64,
    };
    let radii = line(sizes(1.0), &[(1.0, None), (2.0, None)]);
    let angles = line(sizes(FRAC_PI_2), &[(0.0, None), (FRAC_PI_2, None)]);
    let mut mesh = plane(&radii, &angles, &|_| Some("space"));
    name_nodes(&mut mesh, "sphere", &|p| p[0] == 1.0);
    mesh.name_boundary("ball", |p| p[0] == 2.0);
    for point in &mut mesh.points {
        let [radius, angle, _] = *point;
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        *point = [radius * cosine, radius * sine, 0.0];
    }
    let ball = Ball {
        centre: [0.0; 3],
        radius: 2.0,
    };
    let exterior = add_exterior(&mut mesh, "ball", ball, 2)?;
    let found = solve(
        &mesh,
        Geometry::Axisymmetric,
        &exterior,
        &SPACE,
        &["sphere"],
        &[],
        Infinity::Zero,
    )?;
    Ok(FieldCase {
        name: "isolated sphere".into(),
        ours: 2.0 * found.matrix[0][0],
        reference: 4.0 * PI,
        cells: mesh.cell_count(),
    })
}

/// An isolated cube of side one, `C/(4 pi eps0 a) = 0.660678154`; an eighth of it.
///
/// # Errors
/// [`FieldError`] for levels out of range.
pub fn cube(level: u32) -> Result<FieldCase, FieldError> {
    check(level, &[])?;
    // The field grows as r^-1/3 at the edges.
    let smallest = 0.5 * 8.0_f64.powi(-(level as i32));
    let sizes = Sizes {
        growth: growth(level),
        largest: 0.5 / f64::from(level),
    };
    let side = line(sizes, &[(0.0, None), (0.5, Some(smallest))]);
    let mut mesh = solid([&side, &side, &side], "cube");
    mesh.name_boundary("face", |p| p.contains(&0.5));
    let ball = Ball {
        centre: [0.0; 3],
        radius: 1.5,
    };
    let layers = side.len() + level as usize;
    let shell = Shell {
        ball,
        layers,
        growth: growth(level),
        region: Some("space"),
    };
    surround(&mut mesh, "face", shell, "ball")?;
    let exterior = add_exterior(&mut mesh, "ball", ball, 1 + level as usize)?;
    let found = solve(
        &mesh,
        Geometry::Solid,
        &exterior,
        &SPACE,
        &["cube"],
        &[],
        Infinity::Zero,
    )?;
    Ok(FieldCase {
        name: "isolated cube".into(),
        ours: 8.0 * found.matrix[0][0] / (4.0 * PI),
        reference: 0.660678154,
        cells: mesh.cell_count(),
    })
}
