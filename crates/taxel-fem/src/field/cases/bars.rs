//! Two bars of rectangular section side by side.

use super::grid::{Sizes, line, name_nodes, plane};
use super::{FieldCase, SPACE, check, growth, open, solve};
use crate::field::FieldError;
use crate::field::electrostatics::Infinity;
use crate::field::geometry::Geometry;
use crate::field::laplace::Coefficient;

/// Size of the cells at an edge of a bar, where the field grows as `r^-1/3`: the energy
/// of a cell there falls as the power 4/3 of its size.
fn at_edge(scale: f64, level: u32) -> f64 {
    scale * 5e-3 * 4.0_f64.powi(-(level as i32))
}

/// Two bars of a thickness and width, a gap apart, in unbounded space; a quarter of
/// the plane. `C'/eps0`.
///
/// # Errors
/// [`FieldError`] for lengths, ratios or levels out of range.
pub fn bars(
    thickness: f64,
    gap: f64,
    width: f64,
    reference: f64,
    level: u32,
) -> Result<FieldCase, FieldError> {
    check(
        level,
        &[
            ("width over gap", width / gap),
            ("thickness over gap", thickness / gap),
        ],
    )?;
    let (inner, top) = (gap / 2.0, thickness / 2.0);
    let outer = inner + width;
    let edge = Some(at_edge(gap.min(thickness).min(width), level));
    let size = 1.6 * outer.max(top);
    let sizes = Sizes {
        growth: growth(level),
        largest: 0.3 * size / f64::from(level),
    };
    let xs = line(
        sizes,
        &[(0.0, None), (inner, edge), (outer, edge), (size, None)],
    );
    let ys = line(sizes, &[(0.0, None), (top, edge), (size, None)]);
    let mut mesh = plane(&xs, &ys, &|p| {
        let bar = p[0] > inner && p[0] < outer && p[1] < top;
        Some(if bar { "bar" } else { "space" })
    });
    mesh.name_boundary("box", |p| p[0] == size || p[1] == size);
    let exterior = open(&mut mesh, 1.7 * size, level)?;
    name_nodes(&mut mesh, "odd", &|p| p[0] == 0.0);
    let found = solve(
        &mesh,
        Geometry::Plane,
        &exterior,
        &SPACE,
        &["bar"],
        &["odd"],
        Infinity::Free,
    )?;
    // Two quarters carry one bar, at half the voltage.
    Ok(FieldCase {
        name: format!("bars {thickness} x {width}, gap {gap}"),
        ours: found.matrix[0][0],
        reference,
        cells: mesh.cell_count(),
    })
}

/// Surroundings of the bars in a layer on a base plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Relative permittivity of the layer.
    pub layer: f64,
    /// Where the layer ends sideways, from the middle; none when it is unbounded.
    pub layer_end: Option<f64>,
    /// Relative permittivity above the layer, and beside it where it ends.
    pub above: f64,
    /// Relative permittivity below the base plane; none when the plane is at zero.
    pub below: Option<f64>,
}

/// Bars in a layer, lengths in any one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bars {
    /// Gap between the bars.
    pub gap: f64,
    /// Width of a bar.
    pub width: f64,
    /// Thickness of the bars.
    pub thickness: f64,
    /// Height of their lower faces above the base plane.
    pub height: f64,
    /// Thickness of the layer.
    pub layer: f64,
}

/// Two bars in a layer on a base plane, from half of the section: the differential
/// capacitance, the mutual one, both `C'/eps0`, and the number of cells. Without a plane
/// at zero the two are one: nothing else takes charge.
///
/// # Errors
/// [`FieldError`] for lengths, ratios or levels out of range.
pub fn bars_above_base(
    shape: Bars,
    surroundings: Surroundings,
    level: u32,
) -> Result<(f64, f64, usize), FieldError> {
    let gap = shape.gap;
    let cover = shape.layer - shape.height - shape.thickness;
    check(
        level,
        &[
            ("width over gap", shape.width / gap),
            ("thickness over gap", shape.thickness / gap),
            ("height over gap", shape.height / gap),
            ("cover of the bars over gap", cover / gap),
        ],
    )?;
    let inner = gap / 2.0;
    let outer = inner + shape.width;
    let (bottom, top) = (shape.height, shape.height + shape.thickness);
    // Where the layer ends in the blend to the circle the field has fallen to that of
    // a dipole: what it holds there falls as the cube of this size.
    let size = 25.0 * shape.layer.max(outer);
    let edge = Some(at_edge(
        shape.gap.min(shape.thickness).min(shape.width),
        level,
    ));
    let sizes = Sizes {
        growth: growth(level),
        largest: 0.3 * size / f64::from(level),
    };
    let near = Some(0.3 * shape.layer / f64::from(level));
    let mut across = vec![(0.0, None), (inner, edge), (outer, edge), (size, None)];
    let layer_end = surroundings.layer_end.unwrap_or(f64::INFINITY);
    if layer_end.is_nan() || layer_end <= outer {
        return Err(FieldError::OutOfRange {
            quantity: "end of the layer",
            value: layer_end,
            allowed: "beyond the bars",
        });
    }
    if layer_end < size {
        across.insert(3, (layer_end, near));
    }
    let xs = line(sizes, &across);
    let mut marks = vec![
        (0.0, near),
        (bottom, edge),
        (top, edge),
        (shape.layer, near),
        (size, None),
    ];
    if surroundings.below.is_some() {
        marks.insert(0, (-size, None));
    }
    let ys = line(sizes, &marks);
    let mut mesh = plane(&xs, &ys, &|p| {
        let bar = p[0] > inner && p[0] < outer && p[1] > bottom && p[1] < top;
        Some(match p[1] {
            _ if bar => "bar",
            y if y < 0.0 => "below",
            y if y < shape.layer && p[0] < layer_end => "layer",
            _ => "above",
        })
    });
    mesh.name_boundary("box", |p| p[0] == size || p[1].abs() == size);
    let exterior = open(&mut mesh, 1.7 * size, level)?;
    name_nodes(&mut mesh, "odd", &|p| p[0] == 0.0);
    name_nodes(&mut mesh, "base", &|p| p[1] == 0.0);
    let scalars = [
        ("layer", surroundings.layer),
        ("above", surroundings.above),
        ("below", surroundings.below.unwrap_or(1.0)),
    ];
    let media = scalars.map(|(name, value)| (name, Coefficient::Scalar(value)));
    let grounded = surroundings.below.is_none();
    let media = if grounded { &media[..2] } else { &media[..] };
    let with = |zero: &[&str]| {
        solve(
            &mesh,
            Geometry::Plane,
            &exterior,
            media,
            &["bar"],
            zero,
            Infinity::Free,
        )
        .map(|found| found.matrix[0][0])
    };
    // Half of the section carries one bar, at half the voltage.
    let cells = mesh.cell_count();
    if !grounded {
        let differential = with(&["odd"])? / 2.0;
        return Ok((differential, differential, cells));
    }
    let differential = with(&["odd", "base"])? / 2.0;
    // Both bars alike at 1 V carry what each has to the base.
    let to_base = with(&["base"])?;
    Ok((differential, differential - to_base / 2.0, cells))
}
