//! Unbounded surroundings: the outside of a circle or sphere, mapped into it.
//!
//! # Derivation
//! Inversion takes `x` outside the sphere of radius `R` to `y = R^2 x / |x|^2`
//! inside. It is conformal: lengths scale by `s = |dy|/|dx| = |y|^2 / R^2`. With the
//! potential carried along, `|grad_x phi| = s |grad_y phi|`, and the measure is
//! `dx = s^-d dy` in `d` dimensions, so that the energy outside is
//!
//! `int k |grad_x phi|^2 dx = int k s^(2-d) |grad_y phi|^2 dy`.
//!
//! In a plane the weight is one: Laplace's operator keeps its form. In space, and
//! for a turned half plane with its axis through the centre, it is `(R/|y|)^2`: a
//! potential that falls as `1/|x|` grows in proportion to `|y|` from the centre, and
//! the weight times the volume `|y|^2 d|y|` stays bounded. Directions are kept, so
//! media in sectors that reach infinity continue in the same sectors of the image,
//! and planes through the centre stay planes. The centre is the point at infinity.
//!
//! The image lies over the inner mesh and is joined to it by the nodes of the circle.
//!
//! Up to the scale `s` the gradient of the mapping is the mirror `Q = 1 - 2 n n^T` with
//! the direction `n` of the radius: a tensor coefficient is seen as `Q k Q`.

use super::FieldError;
use super::geometry::{Geometry, length, named_nodes, times};
use crate::mesh::{CellShape, Facet, Mesh};
use crate::scalar::Tensor;
use std::collections::BTreeMap;

/// A circle or sphere about a centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre, in the units of the mesh.
    pub centre: [f64; 3],
    /// Radius, in the units of the mesh.
    pub radius: f64,
}

/// The image of the space outside a ball, part of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Exterior {
    /// The ball whose outside is meant.
    pub ball: Ball,
    /// The node at infinity.
    pub infinity: u32,
    /// Regions of the image with the regions of the mesh that they continue.
    media: Vec<(usize, usize)>,
    /// Nodes of the image, out to infinity, that stand on each node of the ball.
    columns: BTreeMap<u32, Vec<u32>>,
}

impl Exterior {
    /// Region whose medium a region of the image continues; none for other regions.
    pub fn inside_of(&self, region: usize) -> Option<usize> {
        let found = self.media.iter().find(|(image, _)| *image == region);
        found.map(|&(_, inside)| inside)
    }

    /// Regions of the image that continue a region.
    pub(super) fn images_of(&self, region: usize) -> impl Iterator<Item = usize> + '_ {
        let media = self.media.iter();
        media
            .filter(move |(_, inside)| *inside == region)
            .map(|(image, _)| *image)
    }

    /// Nodes of the image that continue a surface to infinity: those on its nodes of the ball, as
    /// far as the surface comes to the ball from inside and does not lie on it. `groups` are the
    /// nodes of its facets.
    pub(super) fn continuation(&self, groups: impl Iterator<Item = Vec<u32>>) -> Vec<u32> {
        let mut nodes = Vec::new();
        for group in groups {
            let on_ball = |node: &&u32| self.columns.contains_key(node);
            if group.iter().all(|node| on_ball(&node)) {
                continue;
            }
            for node in group.iter().filter(on_ball) {
                nodes.extend(&self.columns[node]);
            }
        }
        nodes
    }

    /// Factor on the coefficient at a position of the image.
    pub(super) fn weight(&self, geometry: Geometry, at: [f64; 3]) -> f64 {
        if geometry == Geometry::Plane {
            return 1.0;
        }
        let y = length(std::array::from_fn(|i| at[i] - self.ball.centre[i]));
        (self.ball.radius / y).powi(2)
    }

    /// A coefficient as the inversion shows it at a place of the image.
    pub(super) fn mirrored(&self, k: &Tensor<f64>, at: [f64; 3]) -> Tensor<f64> {
        let y: [f64; 3] = std::array::from_fn(|i| at[i] - self.ball.centre[i]);
        let n = y.map(|component| component / length(y));
        let mirror: Tensor<f64> = std::array::from_fn(|i| {
            std::array::from_fn(|j| f64::from(u8::from(i == j)) - 2.0 * n[i] * n[j])
        });
        times(&times(&mirror, k), &mirror)
    }
}

/// Adds the image of the space outside a circle or sphere, or of the half, quarter
/// or eighth of it that the mesh shows, to a mesh whose surface of this name lies on
/// it. Each region at the surface continues as a region of its own, "outside" before its name, in
/// `layers` layers of cells between circle and centre.
///
/// # Errors
/// [`FieldError`]: unknown surface, nodes off the ball, triangular sides, no layer.
pub fn add_exterior(
    mesh: &mut Mesh,
    surface: &str,
    ball: Ball,
    layers: usize,
) -> Result<Exterior, FieldError> {
    positive("number of layers of the outside", layers as f64)?;
    let facets = facets_of(mesh, surface)?;
    for node in named_nodes(mesh, surface)? {
        let distance = length(from(ball.centre, mesh.points[node as usize]));
        // Rounding of the construction of the circle, with a margin.
        let off = (distance - ball.radius).abs();
        if off.is_nan() || off > 1e-9 * ball.radius {
            return Err(FieldError::NotRound {
                surface: surface.to_owned(),
                node,
                distance,
                radius: ball.radius,
            });
        }
    }
    let infinity = mesh.points.len() as u32;
    mesh.points.push(ball.centre);
    let levels = 2 * layers;
    let mut columns = Columns::default();
    let mut media: Vec<(usize, usize)> = Vec::new();
    for facet in facets {
        let inside = mesh.region_of(facet.cell as usize);
        let region = mesh.region(&format!("outside {}", mesh.regions[inside]));
        if !media.contains(&(usize::from(region), inside)) {
            media.push((usize::from(region), inside));
        }
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        for &node in &nodes {
            columns.fill(mesh, node, |start| {
                let step = |level| {
                    let share = level as f64 / levels as f64;
                    std::array::from_fn(|i| start[i] + share * (ball.centre[i] - start[i]))
                };
                (1..levels).map(step).collect()
            });
            columns.close(node, levels, infinity);
        }
        let side = facing(&nodes, Way::Inward);
        columns.cells(mesh, region, &side, layers);
    }
    Ok(Exterior {
        ball,
        infinity,
        media,
        columns: columns.0,
    })
}

/// Layers of cells between a surface and a ball around it.
#[derive(Clone, Copy, Debug)]
pub struct Shell<'a> {
    /// The ball.
    pub ball: Ball,
    /// Number of layers.
    pub layers: usize,
    /// Growth of their thickness outward, from layer to layer.
    pub growth: f64,
    /// Region of the cells; none for that of the cell which each continues.
    pub region: Option<&'a str>,
}

/// Surrounds a mesh by layers of cells between its surface of this name, seen from
/// the centre of the ball, and the ball, whose surface gets the name `outer`. Half or a
/// quarter of a box, cut through the centre, gives half or a quarter of the shell.
///
/// # Errors
/// [`FieldError`]: unknown surface, triangular sides, a node on or outside the ball
/// or at its centre, no layer, growth not positive.
pub fn surround(
    mesh: &mut Mesh,
    surface: &str,
    shell: Shell,
    outer: &str,
) -> Result<(), FieldError> {
    let Shell { ball, layers, .. } = shell;
    positive("number of layers around the box", layers as f64)?;
    positive("growth of the layers", shell.growth)?;
    let facets = facets_of(mesh, surface)?;
    for node in named_nodes(mesh, surface)? {
        let distance = length(from(ball.centre, mesh.points[node as usize]));
        if !(distance > 0.0 && distance < ball.radius) {
            return Err(FieldError::OutOfRange {
                quantity: "distance of the surrounded surface from the centre",
                value: distance,
                allowed: "above zero and below the radius of the ball",
            });
        }
    }
    let shares = shares(layers, shell.growth);
    let region = shell.region.map(|name| mesh.region(name));
    let mut columns = Columns::default();
    let mut sides = Vec::new();
    for facet in facets {
        let own = mesh.region_of(facet.cell as usize) as u16;
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        for &node in &nodes {
            columns.fill(mesh, node, |start| {
                let ray = from(ball.centre, start);
                let factor = ball.radius / length(ray);
                let step = |share: &f64| {
                    std::array::from_fn(|i| start[i] + share * (factor - 1.0) * ray[i])
                };
                shares.iter().map(step).collect()
            });
        }
        let cell = columns.cells(
            mesh,
            region.unwrap_or(own),
            &facing(&nodes, Way::Outward),
            layers,
        );
        let side = if nodes.len() == 3 { 2 } else { 5 };
        sides.push(Facet { cell, side });
    }
    mesh.surfaces.insert(outer.to_owned(), sides);
    Ok(())
}

/// Places of the nodes of growing layers between 0 (left out) and 1.
fn shares(layers: usize, growth: f64) -> Vec<f64> {
    let sizes: Vec<f64> = (0..layers).map(|k| growth.powi(k as i32)).collect();
    let total: f64 = sizes.iter().sum();
    let mut start = 0.0;
    let mut shares = Vec::new();
    for size in sizes {
        shares.push((start + size / 2.0) / total);
        start += size;
        shares.push(start / total);
    }
    shares
}

fn positive(quantity: &'static str, value: f64) -> Result<(), FieldError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(FieldError::OutOfRange {
        quantity,
        value,
        allowed: "above zero",
    })
}

fn from(centre: [f64; 3], point: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| point[i] - centre[i])
}

fn facets_of(mesh: &Mesh, surface: &str) -> Result<Vec<Facet>, FieldError> {
    let facets = mesh.surfaces.get(surface);
    let facets = facets.ok_or_else(|| FieldError::UnknownName {
        kind: "surface",
        name: surface.to_owned(),
        known: mesh.surfaces.keys().cloned().collect::<Vec<_>>().join(", "),
    })?;
    for &Facet { cell, side } in facets {
        if mesh.shape(cell as usize) == CellShape::Tet15 {
            return Err(FieldError::TriangularSide {
                surface: surface.to_owned(),
                cell,
                side,
            });
        }
    }
    Ok(facets.clone())
}

/// Way in which cells are stacked on a side.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Inward,
    Outward,
}

/// Nodes of a side in the order that [`Columns::cells`] wants: a line has the columns
/// to its left, a face looks along them. A line as it is has its outside to the
/// right, a face looks outside.
fn facing(nodes: &[u32], way: Way) -> Vec<u32> {
    let order: &[usize] = match (nodes.len(), way) {
        (3, Way::Outward) => &[1, 0, 2],
        (9, Way::Inward) => &[0, 3, 2, 1, 7, 6, 5, 4, 8],
        _ => return nodes.to_vec(),
    };
    order.iter().map(|&k| nodes[k]).collect()
}

/// Nodes that stand on the nodes of a surface, in levels.
#[derive(Default)]
struct Columns(BTreeMap<u32, Vec<u32>>);

impl Columns {
    /// Makes the column of a node if it is new; `above` gives the points above it.
    fn fill(&mut self, mesh: &mut Mesh, node: u32, above: impl Fn([f64; 3]) -> Vec<[f64; 3]>) {
        self.0.entry(node).or_insert_with(|| {
            let points = above(mesh.points[node as usize]);
            let first = mesh.points.len() as u32;
            mesh.points.extend(&points);
            let own = (0..points.len() as u32).map(|k| first + k);
            std::iter::once(node).chain(own).collect()
        });
    }

    /// Ends a column of `levels` levels in a common node.
    fn close(&mut self, node: u32, levels: usize, last: u32) {
        if let Some(column) = self.0.get_mut(&node)
            && column.len() == levels
        {
            column.push(last);
        }
    }

    /// Stacks cells on a side whose first node order looks along the columns (in a
    /// plane: columns to the left). Returns the number of the last cell.
    fn cells(&self, mesh: &mut Mesh, region: u16, side: &[u32], layers: usize) -> u32 {
        let mut last = 0;
        for layer in 0..layers {
            let at = |level: usize, k: usize| self.0[&side[k]][2 * layer + level];
            last = if side.len() == 3 {
                let nodes = [
                    at(0, 0),
                    at(0, 1),
                    at(2, 1),
                    at(2, 0),
                    at(0, 2),
                    at(1, 1),
                    at(2, 2),
                    at(1, 0),
                    at(1, 2),
                ];
                mesh.add_cell(CellShape::Quad9, region, &nodes)
            } else {
                let mut nodes = [0; 27];
                for k in 0..4 {
                    nodes[k] = at(0, k);
                    nodes[4 + k] = at(2, k);
                    nodes[8 + k] = at(0, 4 + k);
                    nodes[12 + k] = at(2, 4 + k);
                    nodes[16 + k] = at(1, k);
                }
                // Faces of the hexahedron: -x, +x, -y, +y stand on edges 3, 1, 0, 2.
                for (face, edge) in [(20, 7), (21, 5), (22, 4), (23, 6)] {
                    nodes[face] = at(1, edge);
                }
                nodes[24] = at(0, 8);
                nodes[25] = at(2, 8);
                nodes[26] = at(1, 8);
                mesh.add_cell(CellShape::Hex27, region, &nodes)
            };
        }
        last
    }
}
