//! The edges of the electrodes of a three-axis unit (P2) for a drawing that no table has: the field
//! of each kind of edge at several air gaps, and the law of the air gap through them.

use taxel_fem::field::FieldError;

use super::edge_section::EdgeSection;
use taxel::transduction::{EdgeDrawing, EdgeEnvironment, EdgeLaw, SolvedEdges};

/// Air gaps at which an edge is solved: from this share of the narrowest one ...
const NARROWEST: f64 = 1.0 / 3.0;
/// ... to this share of the widest one, as those of the table ...
const WIDEST: f64 = 4.0 / 3.0;
/// ... in so many equal ratios.
const RATIOS: i32 = 6;
/// Where the field ends, over the side of the electrode: in the solid and in the air above. Twice
/// as far, excesses change by a few 1e-4.
const MARGINS: [f64; 2] = [9.0, 4.0];
/// Level of the mesh.
const LEVEL: u32 = 2;
/// Changes on a finer mesh and with a farther end are seen at one air gap: at others they are up to
/// one and a half times as large.
const SAFETY: f64 = 2.0;
/// Least error that is stated: that of the table.
const LEAST_ERROR: f64 = 1e-3;

/// Laws of the edges of a drawing; `progress` hears the fraction.
///
/// # Errors
/// [`FieldError`] for lengths out of range.
pub(crate) fn solve_edges(
    drawing: &EdgeDrawing,
    progress: &mut dyn FnMut(f64),
) -> Result<SolvedEdges, FieldError> {
    let of = |axis: usize, outer: bool, distance: Option<f64>| {
        Edge::new(drawing, axis, usize::from(outer), distance)
    };
    let square = drawing.electrode[0] == drawing.electrode[1];
    let alone = both(square, |axis| of(axis, false, None))?;
    progress(0.2);
    let same = |[x, y]: [Option<f64>; 2]| square && x == y;
    let inner = drawing.inner.map(Some);
    let inner = both(same(inner), |axis| of(axis, false, inner[axis]))?;
    progress(0.5);
    let outer = both(same(drawing.outer), |axis| {
        of(axis, true, drawing.outer[axis])
    })?;
    progress(0.8);
    let edges = [alone, inner, outer].into_iter().flatten();
    let off = edges.map(|edge| edge.off).fold(0.0, f64::max);
    // The errors of the field are those of the edges along x and, of rectangles, y.
    let axes = if square { 0..1 } else { 0..2 };
    let mut of_field = 0.0_f64;
    for axis in axes {
        for edge in [inner[axis], outer[axis]] {
            of_field = of_field.max(edge.error_of_field()?);
        }
    }
    let error = off + of_field;
    Ok(SolvedEdges {
        inner_over_plane: inner.map(|edge| edge.over_plane),
        outer_over_plane: outer.map(|edge| edge.over_plane),
        inner: inner.map(|edge| edge.law),
        outer: outer.map(|edge| edge.law),
        alone: alone.map(|edge| edge.law),
        error: (SAFETY * error).max(LEAST_ERROR),
    })
}

/// One kind of edge, solved.
#[derive(Clone, Copy)]
struct Edge {
    /// The section at the air gap of the drawing, and its excess.
    section: EdgeSection,
    excess: f64,
    law: EdgeLaw,
    /// Largest relative difference of the law from what it goes through.
    off: f64,
    /// Share of the excess that a grounded plane under the lower layer leaves.
    over_plane: f64,
}

impl Edge {
    /// The edge that an axis crosses, inner (`side` 0) or outer (1), beside a grounded neighbour at a
    /// distance, m.
    fn new(
        drawing: &EdgeDrawing,
        axis: usize,
        side: usize,
        distance: Option<f64>,
    ) -> Result<Self, FieldError> {
        let width = drawing.electrode[axis];
        let [least, greatest] = drawing.air_gap;
        let middle = (least * greatest).sqrt();
        let section = EdgeSection {
            air_gap: middle,
            insulation: drawing.insulation,
            permittivity: drawing.permittivity,
            electrode_thickness: drawing.electrode_thickness,
            half_width: 0.5 * width,
            cavity: drawing.cavity[axis][side],
            environment: distance.map_or(EdgeEnvironment::Isolated, EdgeEnvironment::Grounded),
            above: drawing.above,
            below: drawing.below,
            neighbour_width: width,
            grounded_plane: false,
            margin: MARGINS[0] * width,
            air_above: MARGINS[1] * width,
        };
        let [from, to] = [NARROWEST * least, WIDEST * greatest];
        let points = (0..=RATIOS).map(|k| {
            let air_gap = from * (to / from).powf(f64::from(k) / f64::from(RATIOS));
            let section = EdgeSection { air_gap, ..section };
            Ok([air_gap, section.solve_at(LEVEL)?])
        });
        let points: Vec<[f64; 2]> = points.collect::<Result<_, FieldError>>()?;
        let law = EdgeLaw::through(&points, middle);
        let off = points
            .iter()
            .map(|[air, excess]| (law.excess(*air) / excess - 1.0).abs());
        let excess = section.solve_at(LEVEL)?;
        let over_plane = EdgeSection {
            grounded_plane: true,
            ..section
        };
        Ok(Self {
            over_plane: over_plane.solve_at(LEVEL)? / excess,
            off: off.fold(0.0, f64::max),
            section,
            excess,
            law,
        })
    }

    /// Relative changes of the excess on a finer mesh and where the field ends twice as far away.
    fn error_of_field(&self) -> Result<f64, FieldError> {
        let farther = EdgeSection {
            margin: 2.0 * self.section.margin,
            air_above: 2.0 * self.section.air_above,
            ..self.section
        };
        let changed = [self.section.solve_at(LEVEL + 1)?, farther.solve_at(LEVEL)?];
        Ok(changed
            .iter()
            .map(|excess| (excess / self.excess - 1.0).abs())
            .sum())
    }
}

/// The edges that x and y cross; if they are alike they are solved once.
fn both(
    alike: bool,
    solve: impl Fn(usize) -> Result<Edge, FieldError>,
) -> Result<[Edge; 2], FieldError> {
    let of_x = solve(0)?;
    Ok([of_x, if alike { of_x } else { solve(1)? }])
}
