//! Sections of a prismatic void or solid along its axis, and the slender formula.
//!
//! The sections are those of the reference shape, carried along by the motion; they may
//! turn and warp. What counts for a current along the axis is the part of their area
//! vector `1/2 int x cross dx` that lies in the direction of the line of centres.

use super::FieldError;
use super::geometry::length;
use crate::mesh::Mesh;
use std::collections::{BTreeMap, BTreeSet};
use taxel_numerics::dense::{cross, dot3};

/// A section of the deformed shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Position along the axis in the reference shape, m.
    pub position: f64,
    /// Centre of the deformed section, m.
    pub centre: [f64; 3],
    /// Area across the line of centres, m^2.
    pub area: f64,
}

/// Lines of three nodes (end, end, middle) on a quadrilateral side.
const LINES: [[usize; 3]; 6] = [
    [0, 1, 4],
    [7, 5, 8],
    [3, 2, 6],
    [0, 3, 7],
    [4, 6, 8],
    [1, 2, 5],
];

/// Sections of the void or solid inside a wall, a named surface of quadrilateral sides
/// around it in planes across `axis`: where cells end and in their middles, in order.
/// An open line (half of a shape, cut by a plane of symmetry) is closed by its chord.
///
/// # Errors
/// [`FieldError`]: unknown surface, triangular sides, a displacement of another length,
/// planes whose edges do not make one line.
pub fn sections(
    mesh: &Mesh,
    wall: &str,
    displacement: Option<&[[f64; 3]]>,
    axis: [f64; 3],
) -> Result<Vec<Section>, FieldError> {
    let size = length(axis);
    if !(size > 0.0 && size.is_finite()) {
        return Err(FieldError::OutOfRange {
            quantity: "length of the axis",
            value: size,
            allowed: "above zero",
        });
    }
    let axis = axis.map(|x| x / size);
    let place = |node: u32| dot3(axis, mesh.points[node as usize]);
    let moved = deformed(mesh, displacement)?;
    let stations = stations(&lines(mesh, wall, &place)?, &place);
    let mut sections = Vec::new();
    let mut areas = Vec::new();
    for (position, lines) in &stations {
        let broken = || FieldError::BrokenSection {
            surface: wall.to_owned(),
            position: *position,
            edges: lines.len(),
        };
        let path = path(lines).ok_or_else(broken)?;
        let (centre, area) = centre_and_area(&path, &moved);
        sections.push(Section {
            position: *position,
            centre,
            area: 0.0,
        });
        areas.push(area);
    }
    // Ends and middles alternate; anything else is not a prismatic mesh.
    if sections.len() < 3 || sections.len().is_multiple_of(2) {
        return Err(FieldError::BrokenSection {
            surface: wall.to_owned(),
            position: sections.last().map_or(0.0, |section| section.position),
            edges: stations.iter().map(|(_, lines)| lines.len()).sum(),
        });
    }
    let directions = directions(&sections);
    for ((section, area), direction) in sections.iter_mut().zip(areas).zip(directions) {
        section.area = dot3(area, direction).abs() / length(direction);
    }
    Ok(sections)
}

/// `R = rho int ds/A(s)` along the line of centres, by Simpson's rule on each cell;
/// ohm for a resistivity in ohm m. Holds where the area changes little over a length
/// of the order of the width.
pub fn slender_resistance(resistivity: f64, sections: &[Section]) -> f64 {
    let cells = sections.windows(3).step_by(2);
    let integral: f64 = cells
        .map(|cell| {
            let slopes = slopes(cell);
            let parts = [1.0, 4.0, 1.0].iter().zip(cell).zip(slopes);
            let sum: f64 = parts
                .map(|((weight, section), slope)| weight * length(slope) / section.area)
                .sum();
            sum / 3.0
        })
        .sum();
    resistivity * integral
}

fn deformed(mesh: &Mesh, displacement: Option<&[[f64; 3]]>) -> Result<Vec<[f64; 3]>, FieldError> {
    let mut moved = mesh.points.clone();
    if let Some(u) = displacement {
        if u.len() != moved.len() {
            return Err(FieldError::WrongLength {
                given: u.len(),
                expected: moved.len(),
            });
        }
        for (point, u) in moved.iter_mut().zip(u) {
            (0..3).for_each(|i| point[i] += u[i]);
        }
    }
    Ok(moved)
}

/// Lines across the axis on the wall, each once.
fn lines(
    mesh: &Mesh,
    wall: &str,
    place: &dyn Fn(u32) -> f64,
) -> Result<BTreeSet<[u32; 3]>, FieldError> {
    let facets = mesh.surfaces.get(wall);
    let facets = facets.ok_or_else(|| FieldError::UnknownName {
        kind: "surface",
        name: wall.to_owned(),
        known: mesh.surfaces.keys().cloned().collect::<Vec<_>>().join(", "),
    })?;
    let mut lines = BTreeSet::new();
    for &facet in facets {
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        if nodes.len() != 9 {
            return Err(FieldError::TriangularSide {
                surface: wall.to_owned(),
                cell: facet.cell,
                side: facet.side,
            });
        }
        let extent = nodes
            .iter()
            .map(|&node| place(node))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
                (low.min(at), high.max(at))
            });
        for line in LINES {
            let [start, end, middle] = line.map(|k| nodes[k]);
            let across = [end, middle]
                .iter()
                // Rounding of coordinates, against the size of the side.
                .all(|&node| (place(node) - place(start)).abs() < 1e-6 * (extent.1 - extent.0));
            if across {
                lines.insert([start.min(end), start.max(end), middle]);
            }
        }
    }
    Ok(lines)
}

/// Lines of equal position along the axis.
fn stations(lines: &BTreeSet<[u32; 3]>, place: &dyn Fn(u32) -> f64) -> Vec<(f64, Vec<[u32; 3]>)> {
    let mut sorted: Vec<(f64, [u32; 3])> = lines.iter().map(|&l| (place(l[2]), l)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let span = sorted.last().map_or(0.0, |last| last.0 - sorted[0].0);
    let mut stations: Vec<(f64, Vec<[u32; 3]>)> = Vec::new();
    for (position, line) in sorted {
        match stations.last_mut() {
            Some((known, lines)) if position - *known < 1e-9 * span => lines.push(line),
            _ => stations.push((position, vec![line])),
        }
    }
    stations
}

/// Joins lines end to end; none if they do not make one path.
fn path(lines: &[[u32; 3]]) -> Option<Vec<[u32; 3]>> {
    let mut at_node: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (number, line) in lines.iter().enumerate() {
        for end in &line[..2] {
            at_node.entry(*end).or_default().push(number);
        }
    }
    if at_node.values().any(|lines| lines.len() > 2) {
        return None;
    }
    let open = at_node.iter().find(|(_, lines)| lines.len() == 1);
    let mut node = *open.or_else(|| at_node.iter().next())?.0;
    let mut used = vec![false; lines.len()];
    let mut path = Vec::new();
    while let Some(&next) = at_node[&node].iter().find(|&&line| !used[line]) {
        used[next] = true;
        let [start, end, middle] = lines[next];
        let other = if start == node { end } else { start };
        path.push([node, other, middle]);
        node = other;
    }
    (path.len() == lines.len()).then_some(path)
}

/// Centre and area vector of the surface between a path and its chord.
fn centre_and_area(path: &[[u32; 3]], points: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let origin = points[path[0][0] as usize];
    let gauss = (3.0_f64 / 5.0).sqrt();
    let mut pieces = Vec::new();
    let mut area = [0.0; 3];
    for line in path {
        let [a, b, m] = line.map(|node| points[node as usize]);
        for (x, weight) in [(-gauss, 5.0 / 9.0), (0.0, 8.0 / 9.0), (gauss, 5.0 / 9.0)] {
            let shape = [x * (x - 1.0) / 2.0, x * (x + 1.0) / 2.0, 1.0 - x * x];
            let slope = [x - 0.5, x + 0.5, -2.0 * x];
            let sum = |f: [f64; 3], i: usize| f[0] * a[i] + f[1] * b[i] + f[2] * m[i];
            let from: [f64; 3] = std::array::from_fn(|i| sum(shape, i) - origin[i]);
            let along: [f64; 3] = std::array::from_fn(|i| sum(slope, i));
            let piece = cross(from, along).map(|x| weight * x / 2.0);
            (0..3).for_each(|i| area[i] += piece[i]);
            pieces.push((from, piece));
        }
    }
    // Each piece is a triangle from the origin, its centre two thirds out.
    let square = dot3(area, area).max(f64::MIN_POSITIVE);
    let mut centre = origin;
    for (from, piece) in pieces {
        let share = dot3(piece, area) / square * 2.0 / 3.0;
        (0..3).for_each(|i| centre[i] += share * from[i]);
    }
    (centre, area)
}

/// Slopes of the line of centres at the ends and the middle of a cell, per unit of the
/// reference coordinate -1..1.
fn slopes(cell: &[Section]) -> [[f64; 3]; 3] {
    let factors = [[-1.5, 2.0, -0.5], [-0.5, 0.0, 0.5], [0.5, -2.0, 1.5]];
    factors.map(|f| std::array::from_fn(|i| (0..3).map(|k| f[k] * cell[k].centre[i]).sum::<f64>()))
}

/// Directions of the line of centres at all sections.
fn directions(sections: &[Section]) -> Vec<[f64; 3]> {
    let mut directions = vec![[0.0; 3]; sections.len()];
    for first in (0..sections.len() - 2).step_by(2) {
        let slopes = slopes(&sections[first..first + 3]);
        for (place, slope) in slopes.into_iter().enumerate() {
            let unit = slope.map(|x| x / length(slope));
            (0..3).for_each(|i| directions[first + place][i] += unit[i]);
        }
    }
    directions
}
