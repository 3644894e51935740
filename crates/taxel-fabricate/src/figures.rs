//! The figures of masks on the grid, as both formats take them.

use crate::error::Refused;
use crate::mask::Mask;
use crate::options::Options;
use crate::plan::Plan;
use crate::rectangle::{Rectangle, lines};

/// Largest way of an edge over the smallest distance between edges of its mask.
const MOST_MOVED: f64 = 1e-3;
/// Rounding of lengths that are multiples of the grid, in grids.
const ROUND_OFF: f64 = 1e-5;
/// Arms of a cross, as shares of the longer side of the field: half its length, half its width.
const CROSS: [f64; 2] = [0.02, 0.002];
/// Distance of a cross from the corner of the field, as a share of the longer side.
const CROSS_AWAY: f64 = 0.05;

/// One mask on the grid.
pub(crate) struct Drawn {
    pub(crate) name: &'static str,
    /// Number of its layer, from 1 on.
    pub(crate) layer: i16,
    /// Corners of its figures, counterclockwise, in grids.
    pub(crate) figures: Vec<[[i32; 2]; 4]>,
    /// Those of its marks.
    pub(crate) marks: Vec<[[i32; 2]; 4]>,
}

/// All masks of a plan on the grid.
pub(crate) fn drawn(plan: &Plan, options: &Options) -> Result<Vec<Drawn>, Refused> {
    let marks = if options.marks {
        crosses(&plan.field)
    } else {
        Vec::new()
    };
    let one = |(number, mask): (usize, &Mask)| {
        let moved = moved(mask, options.grid);
        let allowed = MOST_MOVED * smallest_distance(mask);
        if moved > allowed {
            return Err(Refused::Grid {
                grid: options.grid,
                mask: mask.name,
                moved,
                allowed,
            });
        }
        let mask = mask.drawn(&plan.field, options.polarity);
        let corners = |all: &[Rectangle]| -> Result<Vec<_>, Refused> {
            all.iter().map(|figure| rounded(figure, options)).collect()
        };
        Ok(Drawn {
            name: mask.name,
            layer: 1 + i16::try_from(number).unwrap_or(i16::MAX - 1),
            figures: corners(&mask.figures)?,
            marks: corners(&marks)?,
        })
    };
    plan.masks.iter().enumerate().map(one).collect()
}

/// Four crosses outside the corners of the field, two bars each; the upright bar is in two parts,
/// so that figures do not overlap.
fn crosses(field: &Rectangle) -> Vec<Rectangle> {
    let [x, y] = field.size();
    let long = x.max(y);
    let [half, thin] = CROSS.map(|share| share * long);
    let [right, top] = [0.5 * x, 0.5 * y].map(|side| side + CROSS_AWAY * long);
    let mut bars = Vec::new();
    for [x, y] in [[-right, -top], [right, -top], [right, top], [-right, top]] {
        bars.push(Rectangle::centred([x, y], [2.0 * half, 2.0 * thin]));
        let arm = 0.5 * (half + thin);
        for side in [-arm, arm] {
            bars.push(Rectangle::centred([x, y + side], [2.0 * thin, half - thin]));
        }
    }
    bars
}

/// Smallest distance between two edges of a mask along x or y, m: of its gaps and its widths.
fn smallest_distance(mask: &Mask) -> f64 {
    let along = |axis: usize| {
        let edges = mask.figures.iter();
        let edges = lines(
            edges
                .flat_map(|figure| [figure.low[axis], figure.high[axis]])
                .collect(),
        );
        let distances = edges.windows(2).map(|pair| pair[1] - pair[0]);
        distances.fold(f64::INFINITY, f64::min)
    };
    along(0).min(along(1))
}

/// Farthest that rounding moves an edge of a mask, m.
fn moved(mask: &Mask, grid: f64) -> f64 {
    let ends = mask
        .figures
        .iter()
        .flat_map(|figure| [figure.low, figure.high]);
    let away = |coordinate: f64| {
        let grids = coordinate / grid;
        (grids - grids.round()).abs()
    };
    let farthest = ends.flatten().map(away).fold(0.0, f64::max);
    if farthest < ROUND_OFF {
        0.0
    } else {
        farthest * grid
    }
}

fn rounded(figure: &Rectangle, options: &Options) -> Result<[[i32; 2]; 4], Refused> {
    let reach = figure.low.into_iter().chain(figure.high);
    let reach = reach.fold(0.0, |most: f64, coordinate| most.max(coordinate.abs()));
    if reach / options.grid > f64::from(i32::MAX) - 1.0 {
        return Err(Refused::Reach {
            reach,
            grid: options.grid,
        });
    }
    let mut corners = figure
        .corners()
        .map(|corner| corner.map(|coordinate| (coordinate / options.grid).round() as i32));
    if options.mirror {
        for corner in &mut corners {
            corner[0] = -corner[0];
        }
        corners.reverse();
    }
    Ok(corners)
}
