//! A deformed plane mesh, or a plane surface of a mesh in space, as a drawing (SVG).

mod bars;
mod marks;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use taxel_numerics::dense::{cross, dot3};

use super::{ColourMap, OutputError, check_length};
use crate::mesh::{CellShape, FacetShape, Mesh};
use crate::problem::Shape;
use marks::{Mark, ends};

/// Widest and highest drawing of the mesh, in px.
const ROOM: [f64; 2] = [900.0, 700.0];
/// Space round it.
const MARGIN: f64 = 24.0;
/// Space below it, for the scale bar, and to its right, for the colour bar.
const FOOT: f64 = 40.0;
const BAR: f64 = 150.0;
/// Unit of the scale bar where none is given.
const METRE: (&str, f64) = ("m", 1.0);

/// Numbers on nodes or on cells.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// One for each node; between them the shape functions.
    Nodes(&'a [f64]),
    /// One for each cell.
    Cells(&'a [f64]),
}

/// A scalar shown in colours.
#[derive(Clone, Copy, Debug)]
pub struct Colours<'a> {
    /// Name of the scalar, such as `pressure`.
    pub title: &'a str,
    /// Its unit, such as `kPa`; empty for none.
    pub unit: &'a str,
    /// Its values in that unit. What is no number is drawn grey.
    pub values: Values<'a>,
    /// Smallest and largest number of the colours; those of the values when none.
    pub range: Option<[f64; 2]>,
    /// Colours.
    pub map: ColourMap,
}

/// A picture in the making.
///
/// # Example
/// ```
/// use taxel_fem::mesh::{Axis, Grid2};
/// use taxel_fem::output::{ColourMap, Colours, Picture, Values};
/// let axis = || Axis::uniform(0.0, 1e-3, 4);
/// let mesh = Grid2::new([axis()?, axis()?], "solid").mesh()?;
/// let shear: Vec<f64> = mesh.points.iter().flat_map(|x| [0.3 * x[1], 0.0]).collect();
/// let height: Vec<f64> = mesh.points.iter().map(|x| 1e3 * x[1]).collect();
/// let svg = Picture::plane(&mesh)?
///     .length_unit("mm", 1e-3)
///     .displacement(&shear)?
///     .colours(Colours {
///         title: "height",
///         unit: "mm",
///         values: Values::Nodes(&height),
///         range: None,
///         map: ColourMap::Sequential,
///     })?
///     .svg()?;
/// assert!(svg.starts_with("<svg"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    mesh: &'a Mesh,
    faces: Vec<Face>,
    /// The directions of space that are drawn to the right and upward, and that to the eye.
    view: [[f64; 3]; 3],
    /// True if faces hide others.
    solid: bool,
    displacement: Option<&'a [f64]>,
    colours: Option<Colours<'a>>,
    units: Vec<(&'a str, f64)>,
    marks: Vec<Mark<'a>>,
    obstacles: Vec<(Shape, [f64; 3])>,
}

/// A cell, or a side of one, to be drawn.
#[derive(Clone, Debug)]
struct Face {
    shape: CellShape,
    nodes: Vec<u32>,
    cell: usize,
}

impl<'a> Picture<'a> {
    /// All cells of a plane mesh.
    ///
    /// # Errors
    /// [`OutputError::Nothing`], [`OutputError::NotPlane`].
    pub fn plane(mesh: &'a Mesh) -> Result<Self, OutputError> {
        match mesh.dimension() {
            0 => return Err(OutputError::Nothing),
            2 => {}
            dimension => return Err(OutputError::NotPlane { dimension }),
        }
        let face = |cell| Face {
            shape: mesh.shape(cell),
            nodes: mesh.cell(cell).to_vec(),
            cell,
        };
        let faces = (0..mesh.cell_count()).map(face).collect();
        Ok(Self::of(mesh, faces, along([0, 1])))
    }

    /// A named surface of a mesh in space, seen along the axis in which it is thinnest.
    ///
    /// # Errors
    /// [`OutputError::NoSurface`], [`OutputError::Nothing`], [`OutputError::NotPlane`].
    pub fn surface(mesh: &'a Mesh, name: &str) -> Result<Self, OutputError> {
        if mesh.dimension() != 3 {
            return Err(OutputError::NotPlane {
                dimension: mesh.dimension(),
            });
        }
        let facets = mesh
            .surfaces
            .get(name)
            .ok_or_else(|| OutputError::NoSurface {
                name: name.to_owned(),
                known: mesh.surfaces.keys().cloned().collect(),
            })?;
        let face = |&facet| Face {
            shape: match mesh.shape(facet_cell(facet)).facet_shape() {
                FacetShape::Tri7 => CellShape::Tri7,
                _ => CellShape::Quad9,
            },
            nodes: mesh.facet_nodes(facet).collect(),
            cell: facet_cell(facet),
        };
        let faces: Vec<Face> = facets.iter().map(face).collect();
        if faces.is_empty() {
            return Err(OutputError::Nothing);
        }
        let thickness = |axis: usize| {
            let nodes = faces.iter().flat_map(|face| &face.nodes);
            let [low, high] = extent(nodes.map(|&node| mesh.points[node as usize][axis]));
            high - low
        };
        let size = [0, 1, 2].map(thickness);
        let axes = if size[2] <= size[0].min(size[1]) {
            [0, 1]
        } else if size[1] <= size[0] {
            [0, 2]
        } else {
            [1, 2]
        };
        Ok(Self::of(mesh, faces, along(axes)))
    }

    /// The outside of a mesh in space, seen from a direction, z upward: what lies behind is hidden.
    /// `to_eye` leads from the body to the eye, of any length.
    ///
    /// # Errors
    /// [`OutputError::Nothing`], also for a direction of no length; [`OutputError::NotPlane`] for a
    /// plane mesh.
    pub fn body(mesh: &'a Mesh, to_eye: [f64; 3]) -> Result<Self, OutputError> {
        if mesh.dimension() != 3 {
            return Err(OutputError::NotPlane {
                dimension: mesh.dimension(),
            });
        }
        let to_eye = unit(to_eye).ok_or(OutputError::Nothing)?;
        let right = unit(cross([0.0, 0.0, 1.0], to_eye)).unwrap_or([1.0, 0.0, 0.0]);
        let face = |facet| Face {
            shape: match mesh.shape(facet_cell(facet)).facet_shape() {
                FacetShape::Tri7 => CellShape::Tri7,
                _ => CellShape::Quad9,
            },
            nodes: mesh.facet_nodes(facet).collect(),
            cell: facet_cell(facet),
        };
        let faces = mesh.boundary().into_iter().map(face).collect();
        let mut picture = Self::of(mesh, faces, [right, cross(to_eye, right), to_eye]);
        picture.solid = true;
        Ok(picture)
    }

    fn of(mesh: &'a Mesh, faces: Vec<Face>, view: [[f64; 3]; 3]) -> Self {
        Self {
            mesh,
            faces,
            view,
            solid: false,
            displacement: None,
            colours: None,
            units: vec![METRE],
            marks: Vec::new(),
            obstacles: Vec::new(),
        }
    }

    /// Draws the shape displaced, and the outline of the undeformed one faintly: for each
    /// node as many numbers as the mesh has dimensions, in the unit of its coordinates.
    ///
    /// # Errors
    /// [`OutputError::Length`].
    pub fn displacement(mut self, values: &'a [f64]) -> Result<Self, OutputError> {
        let nodes = self.mesh.points.len();
        let components = self.mesh.dimension();
        check_length("displacement", values.len(), components, nodes, "nodes")?;
        self.displacement = Some(values);
        Ok(self)
    }

    /// Shows a scalar in colours.
    ///
    /// # Errors
    /// [`OutputError::Length`].
    pub fn colours(mut self, colours: Colours<'a>) -> Result<Self, OutputError> {
        let (found, items, what) = match colours.values {
            Values::Nodes(values) => (values.len(), self.mesh.points.len(), "nodes"),
            Values::Cells(values) => (values.len(), self.mesh.cell_count(), "cells"),
        };
        check_length(colours.title, found, 1, items, what)?;
        self.colours = Some(colours);
        Ok(self)
    }

    /// Unit of the scale bar and its size in the unit of the mesh; `("m", 1.0)` otherwise.
    #[must_use]
    pub fn length_unit(self, name: &'a str, size: f64) -> Self {
        self.length_units(&[(name, size)])
    }

    /// Units of the scale bar, the smallest first, with their sizes in the unit of the mesh: the
    /// bar has the largest that goes into it.
    #[must_use]
    pub fn length_units(mut self, units: &[(&'a str, f64)]) -> Self {
        self.units = units.to_vec();
        self
    }

    /// The drawing.
    ///
    /// # Errors
    /// [`OutputError::NoPlace`].
    pub fn svg(&self) -> Result<String, OutputError> {
        let view = self.view()?;
        let [width, height] = view.size;
        let bar = self.colours.as_ref().map_or(0.0, bars::bar_width);
        let foot = height + 2.0 * MARGIN + FOOT;
        let (width, height) = (width + 2.0 * MARGIN + bar, foot + self.names_height(&view));
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             width=\"{width:.0}\" height=\"{height:.0}\" font-family=\"sans-serif\" \
             font-size=\"13\" fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
        );
        self.draw_obstacles(&view, &mut text);
        if self.solid {
            self.draw_body(&view, &mut text);
        } else {
            self.draw_faces(&view, &mut text);
            self.draw_edges(&view, &mut text);
        }
        self.draw_scale_bar(&view, &mut text);
        self.draw_colour_bar(&view, &mut text);
        self.draw_names(&view, foot - 8.0, &mut text);
        text.push_str("</svg>\n");
        Ok(text)
    }

    /// Place of a node before any scaling, and how near it is to the eye.
    fn depth_place(&self, node: u32, displaced: bool) -> [f64; 3] {
        let dimension = self.mesh.dimension();
        let mut point = self.mesh.points[node as usize];
        if let Some(moved) = self.displacement.filter(|_| displaced) {
            for (x, u) in point
                .iter_mut()
                .zip(&moved[node as usize * dimension..][..dimension])
            {
                *x += u;
            }
        }
        self.view.map(|along| dot3(along, point))
    }

    /// Place of a node before any scaling.
    fn place(&self, node: u32, displaced: bool) -> [f64; 2] {
        let [right, up, _] = self.depth_place(node, displaced);
        [right, up]
    }

    /// Faces of a body that look to the eye, the farthest first.
    fn draw_body(&self, view: &View, text: &mut String) {
        let corners = |face: &Face| -> Vec<[f64; 3]> {
            let count = face.shape.corner_count();
            let nodes = face.nodes[..count].iter();
            nodes.map(|&node| self.depth_place(node, true)).collect()
        };
        let mut shown: Vec<(f64, &Face)> = Vec::new();
        for face in &self.faces {
            let at = corners(face);
            let twice_area: f64 = (0..at.len())
                .map(|k| {
                    let (a, b) = (at[k], at[(k + 1) % at.len()]);
                    a[0] * b[1] - a[1] * b[0]
                })
                .sum();
            if twice_area > 0.0 {
                let depth = at.iter().map(|x| x[2]).sum::<f64>() / at.len() as f64;
                shown.push((depth, face));
            }
        }
        shown.sort_by(|a, b| a.0.total_cmp(&b.0));
        let range = self.colours.map(|colours| self.range(&colours));
        let marked = self.marked_edges();
        text.push_str("<g stroke-width=\"0.8\" stroke-linejoin=\"round\">\n");
        for (_, face) in shown {
            let mut paths: BTreeMap<String, String> = BTreeMap::new();
            match (self.colours, range) {
                (Some(colours), Some(range)) => match colours.values {
                    Values::Cells(values) => {
                        let fill = fill(&colours, range, values[face.cell]);
                        paths.insert(fill, self.whole_face(view, face));
                    }
                    Values::Nodes(values) => {
                        for (value, path) in self.patches(view, face, values) {
                            let fill = fill(&colours, range, value);
                            paths.entry(fill).or_default().push_str(&path);
                        }
                    }
                },
                _ => {
                    paths.insert("#e8ebf0".to_owned(), self.whole_face(view, face));
                }
            }
            for (fill, path) in paths {
                let _ = writeln!(
                    text,
                    "<path fill=\"{fill}\" stroke=\"{fill}\" d=\"{path}\"/>"
                );
            }
            let _ = writeln!(
                text,
                "<path fill=\"none\" stroke=\"#000\" stroke-opacity=\"0.5\" d=\"{}\"/>",
                self.whole_face(view, face)
            );
            for side in face.shape.sides() {
                if let Some(ink) = marked.get(&ends(face, side)) {
                    text.push_str(&self.draw_marked(view, face, side, ink));
                }
            }
        }
        text.push_str("</g>\n");
    }

    fn view(&self) -> Result<View, OutputError> {
        let nodes = || {
            self.faces
                .iter()
                .flat_map(|face| face.nodes.iter().copied())
        };
        for node in nodes() {
            let place = self.place(node, true);
            if !place.iter().all(|x| x.is_finite()) {
                return Err(OutputError::NoPlace { node, place });
            }
        }
        let limits = [0, 1].map(|k| {
            let both = nodes().flat_map(|node| [false, true].map(|d| self.place(node, d)[k]));
            extent(both)
        });
        let size = limits.map(|[low, high]| high - low);
        let scale = [0, 1]
            .map(|k| {
                if size[k] > 0.0 {
                    ROOM[k] / size[k]
                } else {
                    f64::INFINITY
                }
            })
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        let scale = if scale.is_finite() { scale } else { 1.0 };
        Ok(View {
            scale,
            left: limits[0][0],
            top: limits[1][1],
            size: size.map(|length| length * scale),
        })
    }

    /// Numbers at the ends of the colours.
    fn range(&self, colours: &Colours<'_>) -> [f64; 2] {
        let shown = |face: &Face| -> Vec<f64> {
            match colours.values {
                Values::Nodes(values) => face.nodes.iter().map(|&n| values[n as usize]).collect(),
                Values::Cells(values) => vec![values[face.cell]],
            }
        };
        let all = self.faces.iter().flat_map(shown).filter(|x| x.is_finite());
        let [low, high] = colours.range.unwrap_or_else(|| extent(all));
        if low < high && low.is_finite() && high.is_finite() {
            return [low, high];
        }
        // One number only, or none at all.
        let middle = if low.is_finite() { low } else { 0.0 };
        let half = if middle == 0.0 {
            1.0
        } else {
            0.1 * middle.abs()
        };
        [middle - half, middle + half]
    }

    fn draw_faces(&self, view: &View, text: &mut String) {
        // One path for each colour keeps the file small.
        let mut paths: BTreeMap<String, String> = BTreeMap::new();
        let mut add = |fill: String, path: &str| paths.entry(fill).or_default().push_str(path);
        let range = self.colours.map(|colours| self.range(&colours));
        for face in &self.faces {
            match (self.colours, range) {
                (Some(colours), Some(range)) => match colours.values {
                    Values::Cells(values) => {
                        let fill = fill(&colours, range, values[face.cell]);
                        add(fill, &self.whole_face(view, face));
                    }
                    Values::Nodes(values) => {
                        for (value, path) in self.patches(view, face, values) {
                            add(fill(&colours, range, value), &path);
                        }
                    }
                },
                _ => add("#e8ebf0".to_owned(), &self.whole_face(view, face)),
            }
        }
        // A thin line in the same colour closes the seams between neighbours.
        text.push_str("<g stroke-width=\"1.2\" stroke-linejoin=\"round\">\n");
        for (fill, path) in paths {
            let _ = writeln!(
                text,
                "<path fill=\"{fill}\" stroke=\"{fill}\" d=\"{path}\"/>"
            );
        }
        text.push_str("</g>\n");
    }

    /// A whole face with its curved edges.
    fn whole_face(&self, view: &View, face: &Face) -> String {
        let mut path = String::new();
        for (k, side) in face.shape.sides().iter().enumerate() {
            let curve = self.curve(view, face, side, true);
            if k == 0 {
                let _ = write!(path, "M{}", pair(curve[0]));
            }
            let _ = write!(path, "Q{} {}", pair(curve[1]), pair(curve[2]));
        }
        path.push('Z');
        path
    }

    /// A face in small patches, each with the value in its middle.
    fn patches(&self, view: &View, face: &Face, values: &[f64]) -> Vec<(f64, String)> {
        let at: Vec<[f64; 2]> = face
            .nodes
            .iter()
            .map(|&node| view.put(self.place(node, true)))
            .collect();
        // Patches of 6 px look smooth; long cells have more of them along than across.
        let count = |from: [usize; 2], to: [usize; 2]| {
            let length = |k: usize| {
                let [a, b] = [at[from[k]], at[to[k]]];
                (a[0] - b[0]).hypot(a[1] - b[1])
            };
            (length(0).max(length(1)) / 6.0).ceil().clamp(1.0, 64.0) as usize
        };
        let counts = match face.shape {
            CellShape::Tri7 => [count([0, 1], [1, 2]).max(count([2, 2], [0, 0])); 2],
            _ => [count([0, 3], [1, 2]), count([0, 1], [3, 2])],
        };
        let patch_and_value = |patch: Vec<[f64; 2]>| {
            let middle = [0, 1]
                .map(|k| patch.iter().map(|corner| corner[k]).sum::<f64>() / patch.len() as f64);
            let shapes = face.shape.shapes([middle[0], middle[1], 0.0]).values;
            let value = shapes.iter().zip(&face.nodes);
            let value = value
                .map(|(shape, &node)| shape * values[node as usize])
                .sum();
            let mut path = String::new();
            for (k, corner) in patch.iter().enumerate() {
                let shapes = face.shape.shapes([corner[0], corner[1], 0.0]).values;
                let place = [0, 1].map(|k| {
                    let places = shapes.iter().zip(&at);
                    places.map(|(shape, place)| shape * place[k]).sum()
                });
                let _ = write!(path, "{}{}", if k == 0 { 'M' } else { 'L' }, pair(place));
            }
            path.push('Z');
            (value, path)
        };
        patches(face.shape, counts)
            .into_iter()
            .map(patch_and_value)
            .collect()
    }

    /// Start, control point and end of a side: the quadratic curve through its nodes.
    fn curve(&self, view: &View, face: &Face, side: &[u8], displaced: bool) -> [[f64; 2]; 3] {
        let at = |k: usize| view.put(self.place(face.nodes[usize::from(side[k])], displaced));
        let (start, end, middle) = (at(0), at(1), at(2));
        let control = [0, 1].map(|k| 2.0 * middle[k] - 0.5 * (start[k] + end[k]));
        [start, control, end]
    }

    fn draw_edges(&self, view: &View, text: &mut String) {
        // Each edge once; how many faces have it.
        let mut edges: BTreeMap<[u32; 2], (usize, &Face, &[u8])> = BTreeMap::new();
        for face in &self.faces {
            for side in face.shape.sides() {
                edges.entry(ends(face, side)).or_insert((0, face, side)).0 += 1;
            }
        }
        let mut draw = |style: &str, outline: bool, displaced: bool| {
            let mut path = String::new();
            for (count, face, side) in edges.values() {
                if (*count == 1) == outline {
                    let [start, control, end] = self.curve(view, face, side, displaced);
                    let _ = write!(path, "M{}Q{} {}", pair(start), pair(control), pair(end));
                }
            }
            if !path.is_empty() {
                let _ = writeln!(text, "<path fill=\"none\" {style} d=\"{path}\"/>");
            }
        };
        draw(
            "stroke=\"#000\" stroke-opacity=\"0.45\" stroke-width=\"0.6\"",
            false,
            true,
        );
        if self.displacement.is_some() {
            let faint = "stroke=\"#888\" stroke-width=\"1\" stroke-dasharray=\"4 3\"";
            draw(faint, true, false);
        }
        draw("stroke=\"#111\" stroke-width=\"1.3\"", true, true);
        for (ends, ink) in self.marked_edges() {
            if let Some((_, face, side)) = edges.get(&ends) {
                text.push_str(&self.draw_marked(view, face, side, ink));
            }
        }
    }
}

/// Two axes to the right and upward, and the third to the eye.
fn along(axes: [usize; 2]) -> [[f64; 3]; 3] {
    let axis = |k: usize| std::array::from_fn(|d| f64::from(u8::from(d == k)));
    [axis(axes[0]), axis(axes[1]), axis(3 - axes[0] - axes[1])]
}

/// The direction of a vector; none of zero.
fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot3(vector, vector).sqrt();
    (length > 0.0 && length.is_finite()).then(|| vector.map(|x| x / length))
}

/// From coordinates of the mesh to those of the drawing.
struct View {
    scale: f64,
    left: f64,
    top: f64,
    /// Width and height of the mesh in the drawing.
    size: [f64; 2],
}

impl View {
    fn put(&self, place: [f64; 2]) -> [f64; 2] {
        [
            MARGIN + (place[0] - self.left) * self.scale,
            MARGIN + (self.top - place[1]) * self.scale,
        ]
    }

    /// The way back.
    fn place(&self, put: [f64; 2]) -> [f64; 2] {
        [
            self.left + (put[0] - MARGIN) / self.scale,
            self.top - (put[1] - MARGIN) / self.scale,
        ]
    }
}

fn facet_cell(facet: crate::mesh::Facet) -> usize {
    facet.cell as usize
}

/// Least and largest of some numbers.
fn extent(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    })
}

fn pair([x, y]: [f64; 2]) -> String {
    format!("{x:.2} {y:.2}")
}

fn fill(colours: &Colours<'_>, [low, high]: [f64; 2], value: f64) -> String {
    if value.is_finite() {
        // As many colours as the eye distinguishes.
        let share = (value - low) / (high - low);
        colours.map.hex((share * 128.0).round() / 128.0)
    } else {
        "#bbbbbb".to_owned()
    }
}

/// Corners of the patches of a face in its reference coordinates; triangles are divided
/// by the first count.
fn patches(shape: CellShape, counts: [usize; 2]) -> Vec<Vec<[f64; 2]>> {
    let mut patches = Vec::new();
    let at = |i: usize, j: usize| [i as f64 / counts[0] as f64, j as f64 / counts[1] as f64];
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if shape != CellShape::Tri7 {
                patches.push(corners.map(|x| x.map(|x| 2.0 * x - 1.0)).to_vec());
                continue;
            }
            if i + j < counts[0] {
                patches.push(vec![corners[0], corners[1], corners[3]]);
            }
            if i + j + 1 < counts[0] {
                patches.push(corners[1..].to_vec());
            }
        }
    }
    patches
}

#[cfg(test)]
mod tests;
