//! Currents in sheets.

use super::grid::{Sizes, line, plane};
use super::{FieldCase, check, growth};
use crate::field::FieldError;
use crate::field::conduction::Conduction;
use crate::field::geometry::Geometry;
use crate::field::laplace::{Coefficient, Domain, MeshMotion};
use std::f64::consts::{LN_2, PI};

/// A right-angled bend of a strip of width one: what its corner square adds to the
/// arms, in squares, `1 - (2/pi) ln 2` by conformal mapping.
///
/// # Errors
/// [`FieldError`] for levels out of range.
pub fn corner_square(level: u32) -> Result<FieldCase, FieldError> {
    check(level, &[])?;
    // What the corner disturbs falls as exp(-2 pi length) in the energy: 1e-11 here.
    let arm = 4.0;
    // The current density grows as r^-1/3 at the inner corner.
    let edge = Some(1e-3 * 8.0_f64.powi(-(level as i32)));
    let sizes = Sizes {
        growth: growth(level),
        largest: 0.5 / f64::from(level),
    };
    let marks = [(0.0, None), (1.0, edge), (1.0 + arm, None)];
    let ends = line(sizes, &marks);
    let mut mesh = plane(&ends, &ends, &|p| {
        (p[0] < 1.0 || p[1] < 1.0).then_some("sheet")
    });
    mesh.name_boundary("one end", |p| p[0] == 1.0 + arm);
    mesh.name_boundary("other end", |p| p[1] == 1.0 + arm);
    let found = Conduction {
        domain: Domain {
            mesh: &mesh,
            geometry: Geometry::Plane,
            motion: MeshMotion::None,
            exterior: None,
        },
        conductivities: &[("sheet", Coefficient::Scalar(1.0))],
        from: "one end",
        to: "other end",
    }
    .resistance()?;
    Ok(FieldCase {
        name: "corner square of a bend".into(),
        ours: found.by_power - 2.0 * arm,
        reference: 1.0 - 2.0 / PI * LN_2,
        cells: mesh.cell_count(),
    })
}
