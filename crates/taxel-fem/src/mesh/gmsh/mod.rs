//! Meshes of Gmsh: formats MSH 2.2 and 4.1, as text.

mod error;
mod parse;

pub use error::GmshError;

use std::collections::HashMap;

use super::promote::{Middles, key, promote};
use super::{CellShape, Facet, LowerCell, Mesh};
use parse::{Element, Raw};

/// Reads the text of a mesh.
///
/// Elements of the highest dimension become cells, their named physical group the region.
/// Named groups of one dimension less become surfaces, of fewer dimensions sets of nodes.
/// Lower elements without a group are passed over, as are nodes of no cell. Cells of
/// first order, and incomplete ones of second order, are completed. Plane cells drawn
/// clockwise are turned. A surface inside gets the sides of the cells that come first.
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
    let raw = parse::parse(text)?;
    let highest = raw.elements.iter().map(|element| element.kind.dimension);
    let dimension = highest.max().unwrap_or(0);
    if dimension < 2 {
        return Err(GmshError::NoCells);
    }
    let mut import = Import {
        raw: &raw,
        dimension,
        numbers: HashMap::new(),
        points: Vec::new(),
        regions: Vec::new(),
    };
    let (mut mesh, middles) = import.cells()?;
    import.surfaces(&mut mesh)?;
    import.node_sets(&mut mesh, &middles)?;
    let both = mesh.node_sets.keys();
    match both
        .into_iter()
        .find(|name| mesh.surfaces.contains_key(*name))
    {
        Some(name) => Err(GmshError::MixedName { name: name.clone() }),
        None => Ok(mesh),
    }
}

struct Import<'a> {
    raw: &'a Raw,
    dimension: usize,
    /// Numbers in the mesh of the nodes that cells use, by tag.
    numbers: HashMap<i64, u32>,
    points: Vec<[f64; 3]>,
    regions: Vec<String>,
}

impl<'a> Import<'a> {
    fn elements(&self, dimension: usize) -> impl Iterator<Item = &'a Element> + use<'a> {
        let elements = self.raw.elements.iter();
        elements.filter(move |element| element.kind.dimension == dimension)
    }

    /// Names of the groups of an element.
    fn names(&self, element: &Element) -> Result<Vec<&'a str>, GmshError> {
        let dimension = element.kind.dimension;
        let name = |&tag: &i64| {
            let name = self.raw.names.get(&(dimension, tag));
            let name = name.map(String::as_str).filter(|name| !name.is_empty());
            name.ok_or(GmshError::UnnamedGroup {
                line: element.line,
                dimension,
                tag,
            })
        };
        element.groups.iter().map(name).collect()
    }

    fn cells(&mut self) -> Result<(Mesh, Middles), GmshError> {
        let mut cells = Vec::new();
        let mut lines = Vec::new();
        for element in self.elements(self.dimension) {
            let Some(shape) = element.kind.shape else {
                continue;
            };
            let region = self.region(element)?;
            let mut nodes = Vec::new();
            for &place in element.kind.order {
                nodes.push(self.node(element, element.nodes[place])?);
            }
            if self.dimension == 2 && self.clockwise(&nodes[..element.kind.corners]) {
                turn(shape, &mut nodes);
            }
            cells.push(LowerCell {
                shape,
                region,
                nodes,
            });
            lines.push(element.line);
        }
        let (points, regions) = (self.points.clone(), self.regions.clone());
        promote(points, &cells, regions).map_err(|(cell, source)| GmshError::Cell {
            line: lines[cell],
            source,
        })
    }

    fn region(&mut self, element: &Element) -> Result<u16, GmshError> {
        let line = element.line;
        let names = self.names(element)?;
        let &first = names.first().ok_or(GmshError::NoRegion { line })?;
        if let Some(&second) = names.iter().find(|&&name| name != first) {
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
        let mut point = self.raw.points[place];
        if self.dimension == 2 {
            let size = point[0].abs().max(point[1].abs());
            // Gmsh leaves rounding in the third coordinate.
            if point[2].abs() > 1e-9 * size {
                return Err(GmshError::NotPlane {
                    line,
                    node: tag,
                    z: point[2],
                });
            }
            point[2] = 0.0;
        }
        let number = self.points.len() as u32;
        self.points.push(point);
        self.numbers.insert(tag, number);
        Ok(number)
    }

    /// True if the corners of a plane cell run clockwise.
    fn clockwise(&self, corners: &[u32]) -> bool {
        let at = |k: usize| self.points[corners[k % corners.len()] as usize];
        let twice_area: f64 = (0..corners.len())
            .map(|k| at(k)[0] * at(k + 1)[1] - at(k)[1] * at(k + 1)[0])
            .sum();
        twice_area < 0.0
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
                let corners = match mesh.facet_nodes(facet).count() {
                    3 => 2,
                    7 => 3,
                    _ => 4,
                };
                let key = key(mesh.facet_nodes(facet).take(corners));
                sides.entry(key).or_insert(facet);
            }
        }
        for element in self.elements(self.dimension - 1) {
            let names = self.names(element)?;
            let corners = &element.nodes[..element.kind.corners];
            let numbers: Option<Vec<u32>> = corners
                .iter()
                .map(|tag| self.numbers.get(tag).copied())
                .collect();
            let facet = numbers.and_then(|numbers| sides.get(&key(numbers.into_iter())));
            for name in names {
                let &facet = facet.ok_or_else(|| GmshError::NotASide {
                    line: element.line,
                    name: name.to_owned(),
                })?;
                let surface = mesh.surfaces.entry(name.to_owned()).or_default();
                surface.push(facet);
            }
        }
        Ok(())
    }

    fn node_sets(&self, mesh: &mut Mesh, middles: &Middles) -> Result<(), GmshError> {
        for element in (0..self.dimension - 1).flat_map(|d| self.elements(d)) {
            for name in self.names(element)? {
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

/// Turns a plane cell over.
fn turn(shape: CellShape, nodes: &mut Vec<u32>) {
    let order: &[usize] = match shape {
        CellShape::Tri7 => &[0, 2, 1, 5, 4, 3, 6],
        _ => &[0, 3, 2, 1, 7, 6, 5, 4, 8],
    };
    *nodes = order[..nodes.len()]
        .iter()
        .map(|&place| nodes[place])
        .collect();
}

#[cfg(test)]
mod tests;
