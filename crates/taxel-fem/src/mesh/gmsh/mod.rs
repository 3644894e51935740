//! Meshes of Gmsh: formats MSH 2.2 and 4.1, as text or binary.

mod error;
mod parse;
mod reader;
mod wedge;

pub use error::{GmshError, Position};

use std::collections::{HashMap, HashSet};

use super::promote::{Middles, key, promote};
use super::{CellShape, Facet, LowerCell, Mesh};
use crate::scalar::determinant;
use parse::{Element, Raw};
use wedge::Wedges;

/// A mesh with what its coordinates are in the file.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// The mesh.
    pub mesh: Mesh,
    /// Axis of the file (0 is x) along each coordinate of the mesh: a plane mesh may be drawn at
    /// one x, y or z, and keeps the two other axes in their order.
    pub axes: Vec<usize>,
    /// Number of cells whose order the file gives inside out; they have been turned.
    pub turned: usize,
}

/// Reads the text of a mesh, see [`read_file`].
///
/// # Errors
/// [`GmshError`] with the line of the file.
///
/// # Example
/// ```
/// let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
///     $PhysicalNames\n2\n1 7 \"left\"\n2 8 \"solid\"\n$EndPhysicalNames\n\
///     $Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n\
///     $Elements\n2\n1 1 2 7 1 3 1\n2 2 2 8 1 1 2 3\n$EndElements\n";
/// let mesh = taxel_fem::mesh::gmsh::read(text)?;
/// assert_eq!(mesh.cell(0).len(), 7);
/// assert_eq!(mesh.surfaces["left"].len(), 1);
/// # Ok::<(), taxel_fem::mesh::gmsh::GmshError>(())
/// ```
pub fn read(text: &str) -> Result<Mesh, GmshError> {
    read_file(text.as_bytes()).map(|drawing| drawing.mesh)
}

/// Reads the bytes of a file, text or binary.
///
/// Elements of the highest dimension become cells, their physical group the region. Groups of one
/// dimension less become surfaces, of fewer dimensions sets of nodes; a group without a name is
/// called by its number. Lower elements without a group are passed over, as are nodes of no cell.
/// Cells of first order, and incomplete ones of second order, are completed. Cells in an order
/// that is inside out are turned. A wedge is cut into three tetrahedra (Dompierre et al. 1999). A surface
/// inside gets the sides of the cells that come first.
///
/// # Errors
/// [`GmshError`] with the line of a text, the byte of a binary file.
pub fn read_file(bytes: &[u8]) -> Result<Drawing, GmshError> {
    let raw = parse::parse(bytes)?;
    let highest = raw.elements.iter().map(|element| element.kind.dimension);
    let dimension = highest.max().unwrap_or(0);
    if dimension < 2 {
        return Err(GmshError::NoCells);
    }
    let mut import = Import {
        axes: axes(&raw, dimension)?,
        raw: &raw,
        dimension,
        numbers: HashMap::new(),
        points: Vec::new(),
        regions: Vec::new(),
        turned: 0,
    };
    let (mut mesh, middles) = import.cells()?;
    import.surfaces(&mut mesh)?;
    import.node_sets(&mut mesh, &middles)?;
    Ok(Drawing {
        mesh,
        axes: import.axes,
        turned: import.turned,
    })
}

/// Share of the size of a mesh by which its plane may be uneven: Gmsh leaves rounding.
const EVEN: f64 = 1e-9;

/// The axes along which the cells extend.
fn axes(raw: &Raw, dimension: usize) -> Result<Vec<usize>, GmshError> {
    if dimension == 3 {
        return Ok(vec![0, 1, 2]);
    }
    let cells = raw.elements.iter();
    let cells = cells.filter(|element| element.kind.dimension == dimension);
    let nodes = cells.flat_map(|cell| cell.nodes.iter().map(|&node| (cell.line, node)));
    let places: Vec<_> = nodes
        .filter_map(|(line, node)| Some((line, node, raw.points[*raw.nodes.get(&node)?])))
        .collect();
    let along = |axis: usize| {
        let all = places.iter().map(|(.., point)| point[axis]);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
    };
    let extents = [0, 1, 2].map(along);
    let size = extents
        .iter()
        .fold(0.0, |most: f64, [low, high]| most.max(high - low));
    let even = |axis: &usize| {
        let [low, high] = extents[*axis];
        high - low <= EVEN * size.max(low.abs()).max(high.abs())
    };
    // z first: the usual plane, also of a mesh that is a line.
    if let Some(across) = [2, 1, 0].into_iter().find(even) {
        return Ok((0..3).filter(|&axis| axis != across).collect());
    }
    let thinnest = (0..3).rev().min_by(|&a, &b| {
        let size = |axis: usize| extents[axis][1] - extents[axis][0];
        size(a).total_cmp(&size(b))
    });
    let across = thinnest.unwrap_or(2);
    let plane = places.first().map_or(0.0, |(.., point)| point[across]);
    let off = |point: &[f64; 3]| point[across] - plane;
    match places.iter().max_by(|a, b| {
        let (a, b) = (off(&a.2).abs(), off(&b.2).abs());
        a.total_cmp(&b)
    }) {
        Some((line, node, point)) => Err(GmshError::NotPlane {
            line: *line,
            node: *node,
            off: off(point),
        }),
        None => Ok(vec![0, 1]),
    }
}

struct Import<'a> {
    axes: Vec<usize>,
    raw: &'a Raw,
    dimension: usize,
    /// Numbers in the mesh of the nodes that cells use, by tag.
    numbers: HashMap<i64, u32>,
    points: Vec<[f64; 3]>,
    regions: Vec<String>,
    turned: usize,
}

impl<'a> Import<'a> {
    fn elements(&self, dimension: usize) -> impl Iterator<Item = &'a Element> + use<'a> {
        let elements = self.raw.elements.iter();
        elements.filter(move |element| element.kind.dimension == dimension)
    }

    /// Names of the groups of an element; each has one.
    fn names(&self, element: &Element) -> impl Iterator<Item = &'a str> + use<'a> {
        let (names, dimension) = (&self.raw.names, element.kind.dimension);
        let groups = element.groups.clone().into_iter();
        groups.filter_map(move |tag| names.get(&(dimension, tag)).map(String::as_str))
    }

    fn cells(&mut self) -> Result<(Mesh, Middles), GmshError> {
        let mut cells = Vec::new();
        let mut lines = Vec::new();
        let mut wedges = Wedges::default();
        for element in self.elements(self.dimension) {
            let Some(shape) = element.kind.shape else {
                continue;
            };
            let region = self.region(element)?;
            let mut nodes = Vec::new();
            for &place in element.kind.order {
                nodes.push(self.node(element, element.nodes[place])?);
            }
            let parts = if element.kind.is_wedge() {
                wedges.cut(&nodes, &mut self.points).to_vec()
            } else {
                vec![nodes]
            };
            let mut turned = false;
            for mut nodes in parts {
                if self.inside_out(shape, &nodes) {
                    turn(shape, &mut nodes);
                    turned = true;
                }
                cells.push(LowerCell {
                    shape,
                    region,
                    nodes,
                });
                lines.push(element.line);
            }
            self.turned += usize::from(turned);
        }
        let hexahedra = cells.iter().zip(&lines);
        let mut hexahedra = hexahedra.filter(|(cell, _)| cell.shape == CellShape::Hex27);
        if let Some((_, &line)) = hexahedra.find(|(cell, _)| wedges.touch(&cell.nodes)) {
            return Err(GmshError::WedgeBesideHexahedron { line });
        }
        let (points, regions) = (self.points.clone(), self.regions.clone());
        promote(points, &cells, regions).map_err(|(cell, source)| GmshError::Cell {
            line: lines[cell],
            source,
        })
    }

    fn region(&mut self, element: &Element) -> Result<u16, GmshError> {
        let line = element.line;
        let mut names = self.names(element);
        let first = names.next().ok_or(GmshError::NoRegion { line })?;
        if let Some(second) = names.find(|name| *name != first) {
            return Err(GmshError::SeveralRegions {
                line,
                first: first.to_owned(),
                second: second.to_owned(),
            });
        }
        let known = self.regions.iter().position(|known| known == first);
        let region = known.unwrap_or_else(|| {
            self.regions.push(first.to_owned());
            self.regions.len() - 1
        });
        Ok(region as u16)
    }

    /// Number of a node of a cell.
    fn node(&mut self, element: &Element, tag: i64) -> Result<u32, GmshError> {
        let line = element.line;
        if let Some(&number) = self.numbers.get(&tag) {
            return Ok(number);
        }
        let place = self.raw.nodes.get(&tag);
        let &place = place.ok_or(GmshError::MissingNode { line, node: tag })?;
        let given = self.raw.points[place];
        let mut point = [0.0; 3];
        for (x, &axis) in point.iter_mut().zip(&self.axes) {
            *x = given[axis];
        }
        let number = self.points.len() as u32;
        self.points.push(point);
        self.numbers.insert(tag, number);
        Ok(number)
    }

    /// True if the corners of a cell run the wrong way round: its area or volume at the corners comes
    /// out negative.
    fn inside_out(&self, shape: CellShape, nodes: &[u32]) -> bool {
        let at = |k: usize| self.points[nodes[k] as usize];
        let corners = corners_of(shape).iter();
        let sum: f64 = corners
            .map(|&[corner, a, b, c]| {
                let edge = |k: usize| std::array::from_fn(|d| at(k)[d] - at(corner)[d]);
                let across = if shape.dimension() == 2 {
                    [0.0, 0.0, 1.0]
                } else {
                    edge(c)
                };
                determinant(&[edge(a), edge(b), across])
            })
            .sum();
        sum < 0.0
    }

    fn surfaces(&self, mesh: &mut Mesh) -> Result<(), GmshError> {
        let mut sides = HashMap::new();
        for cell in 0..mesh.cell_count() {
            let shape = mesh.shape(cell);
            for side in 0..shape.sides().len() {
                let facet = Facet {
                    cell: cell as u32,
                    side: side as u8,
                };
                let corners = shape.facet_shape().corner_count();
                let key = key(mesh.facet_nodes(facet).take(corners));
                sides.entry(key).or_insert(facet);
            }
        }
        for element in self.elements(self.dimension - 1) {
            let corners = &element.nodes[..element.kind.corners];
            let numbers: Option<Vec<u32>> = corners
                .iter()
                .map(|tag| self.numbers.get(tag).copied())
                .collect();
            let facets: Vec<Facet> =
                numbers.map_or_else(Vec::new, |numbers| facets_of(&numbers, &sides));
            for name in self.names(element) {
                if facets.is_empty() {
                    return Err(GmshError::NotASide {
                        line: element.line,
                        name: name.to_owned(),
                    });
                }
                let surface = mesh.surfaces.entry(name.to_owned()).or_default();
                surface.extend(&facets);
            }
        }
        // An element that the file has twice is one part of the surface.
        for surface in mesh.surfaces.values_mut() {
            let mut seen = HashSet::new();
            surface.retain(|facet| seen.insert(*facet));
        }
        Ok(())
    }

    fn node_sets(&self, mesh: &mut Mesh, middles: &Middles) -> Result<(), GmshError> {
        for element in (0..self.dimension - 1).flat_map(|d| self.elements(d)) {
            for name in self.names(element) {
                let set = mesh.node_sets.entry(name.to_owned()).or_default();
                let mut numbers = Vec::new();
                for &tag in &element.nodes {
                    let number = self.numbers.get(&tag).copied();
                    numbers.push(number.ok_or_else(|| GmshError::OffTheCells {
                        line: element.line,
                        node: tag,
                        name: name.to_owned(),
                    })?);
                }
                // The middle of a straight edge is a node too once its cells are complete.
                if numbers.len() == 2 {
                    numbers.extend(middles.get(&key(numbers.iter().copied())));
                }
                set.extend(numbers);
            }
        }
        for set in mesh.node_sets.values_mut() {
            set.sort_unstable();
            set.dedup();
        }
        Ok(())
    }
}

/// The side of these corners, or the two triangles into which a side of a wedge is cut.
fn facets_of(corners: &[u32], sides: &HashMap<[u32; 8], Facet>) -> Vec<Facet> {
    let side = |corners: &[u32]| sides.get(&key(corners.iter().copied())).copied();
    if let Some(facet) = side(corners) {
        return vec![facet];
    }
    let &[a, b, c, d] = corners else {
        return Vec::new();
    };
    let halves = [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]];
    let both = halves.iter().find_map(|[first, second]| {
        let facets = [side(first)?, side(second)?];
        Some(facets.to_vec())
    });
    both.unwrap_or_default()
}

/// Corners of a cell, each with its neighbours in an order that is right-handed; in the plane the last
/// one is none.
fn corners_of(shape: CellShape) -> &'static [[usize; 4]] {
    match shape {
        CellShape::Tri7 => &[[0, 1, 2, 0]],
        CellShape::Quad9 => &[[0, 1, 3, 0], [1, 2, 0, 0], [2, 3, 1, 0], [3, 0, 2, 0]],
        CellShape::Tet15 => &[[0, 1, 2, 3]],
        CellShape::Hex27 => &[
            [0, 1, 3, 4],
            [1, 2, 0, 5],
            [2, 3, 1, 6],
            [3, 0, 2, 7],
            [4, 7, 5, 0],
            [5, 4, 6, 1],
            [6, 5, 7, 2],
            [7, 6, 4, 3],
        ],
    }
}

/// Turns a cell over, by exchanging two of its directions.
fn turn(shape: CellShape, nodes: &mut Vec<u32>) {
    let order: &[usize] = match shape {
        CellShape::Tri7 => &[0, 2, 1, 5, 4, 3, 6],
        CellShape::Quad9 => &[0, 3, 2, 1, 7, 6, 5, 4, 8],
        CellShape::Tet15 => &[0, 2, 1, 3, 6, 5, 4, 7, 9, 8],
        CellShape::Hex27 => &[
            0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17, 22, 23, 20, 21,
            24, 25, 26,
        ],
    };
    *nodes = order[..nodes.len()]
        .iter()
        .map(|&position| nodes[position])
        .collect();
}

#[cfg(test)]
mod tests;
