//! What a picture shows beside the body: parts of it by name, and the obstacles it meets.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write as _;

use super::{Face, MARGIN, Picture, View, pair};
use crate::output::escape;
use crate::problem::Shape;

/// Colours of marked parts, in turn: far from all colours of a scalar and from each other.
const INKS: [&str; 6] = [
    "#e6194b", "#ff8c1a", "#f032e6", "#ffffff", "#a0522d", "#9aff4d",
];

/// Height of a row of names, px.
const ROW: f64 = 20.0;

/// Distance of the points in which the outline of an obstacle is sought, px.
const STEP: f64 = 5.0;

/// A part of the body that is drawn in a colour of its own.
#[derive(Clone, Debug)]
pub(super) struct Mark<'a> {
    name: &'a str,
    nodes: HashSet<u32>,
}

impl<'a> Picture<'a> {
    /// Draws a part of the body - a surface, a curve or a region - in a colour of its own, with its
    /// name below the picture: the edges of cells between its nodes, of a region its outline. Of a
    /// body in space those on the sides that are seen.
    #[must_use]
    pub fn mark(mut self, name: &'a str, nodes: &[u32]) -> Self {
        let nodes = nodes.iter().copied().collect();
        self.marks.push(Mark { name, nodes });
        self
    }

    /// Draws the section of an obstacle, moved by `shift`, as far as the picture of a plane mesh
    /// goes; a body in space is drawn without.
    #[must_use]
    pub fn obstacle(mut self, shape: Shape, shift: [f64; 3]) -> Self {
        self.obstacles.push((shape, shift));
        self
    }

    /// The last mark of each edge that has one, by its ends.
    pub(super) fn marked_edges(&self) -> BTreeMap<[u32; 2], &'static str> {
        let mut edges = BTreeMap::new();
        for (mark, ink) in self.marks.iter().zip(INKS.iter().cycle()) {
            let within = |node: &u32| mark.nodes.contains(node);
            // Sides of faces that are part of it are only drawn on its outline.
            let mut inner: BTreeMap<[u32; 2], usize> = BTreeMap::new();
            for face in &self.faces {
                let whole = face.nodes.iter().all(within);
                for side in face.shape.sides() {
                    let mut nodes = side.iter().map(|&k| face.nodes[usize::from(k)]);
                    if nodes.all(|node| within(&node)) {
                        *inner.entry(ends(face, side)).or_default() += usize::from(whole);
                    }
                }
            }
            let outline = inner.into_iter().filter(|(_, whole)| *whole < 2);
            edges.extend(outline.map(|(ends, _)| (ends, *ink)));
        }
        edges
    }

    /// A marked side of a face.
    pub(super) fn draw_marked(&self, view: &View, face: &Face, side: &[u8], ink: &str) -> String {
        let [start, control, end] = self.curve(view, face, side, true);
        format!(
            "<path fill=\"none\" stroke=\"{ink}\" stroke-width=\"3\" stroke-linecap=\"round\" \
             d=\"M{}Q{} {}\"/>\n",
            pair(start),
            pair(control),
            pair(end)
        )
    }

    /// Rows of names below the picture, each with what it holds and its place from the left.
    fn rows(&self, width: f64) -> Vec<Vec<(usize, f64)>> {
        let mut rows: Vec<Vec<(usize, f64)>> = Vec::new();
        let mut right = f64::INFINITY;
        for (number, mark) in self.marks.iter().enumerate() {
            let own = 44.0 + 7.5 * mark.name.chars().count() as f64;
            if right + own > width {
                rows.push(Vec::new());
                right = 0.0;
            }
            if let Some(row) = rows.last_mut() {
                row.push((number, right));
            }
            right += own;
        }
        rows
    }

    /// Height that the names of marked parts take.
    pub(super) fn names_height(&self, view: &View) -> f64 {
        ROW * self.rows(view.size[0].max(200.0)).len() as f64
    }

    pub(super) fn draw_names(&self, view: &View, top: f64, text: &mut String) {
        for (row, names) in self.rows(view.size[0].max(200.0)).iter().enumerate() {
            let y = top + ROW * (row as f64 + 0.5);
            for &(number, left) in names {
                let (x, ink) = (MARGIN + left, INKS[number % INKS.len()]);
                let name = escape(self.marks[number].name);
                // A dark line under it shows a light one on paper.
                let _ = writeln!(
                    text,
                    "<path stroke=\"#444\" stroke-width=\"5\" d=\"M{x:.2} {y:.2}h24\"/>\
                     <path stroke=\"{ink}\" stroke-width=\"3\" d=\"M{x:.2} {y:.2}h24\"/>\
                     <text x=\"{:.2}\" y=\"{:.2}\">{name}</text>",
                    x + 30.0,
                    y + 4.5
                );
            }
        }
    }

    /// Outlines of the obstacles: where their distance changes its sign between neighbours of a
    /// net of points all over the picture.
    pub(super) fn draw_obstacles(&self, view: &View, text: &mut String) {
        if self.solid || self.mesh.dimension() != 2 {
            return;
        }
        let counts = view
            .size
            .map(|size| ((size + 2.0 * MARGIN) / STEP).ceil() as usize);
        let at = |i: usize, j: usize| [i as f64 * STEP, j as f64 * STEP];
        for (shape, shift) in &self.obstacles {
            let distance = |i: usize, j: usize| {
                let [x, y] = view.place(at(i, j));
                shape.gap([x, y, 0.0], *shift).distance
            };
            let rows: Vec<Vec<f64>> = (0..=counts[1])
                .map(|j| (0..=counts[0]).map(|i| distance(i, j)).collect())
                .collect();
            let mut path = String::new();
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    // Both triangles of a square: each is crossed by one straight piece, or none.
                    for corners in [
                        [(i, j), (i + 1, j), (i + 1, j + 1)],
                        [(i, j), (i + 1, j + 1), (i, j + 1)],
                    ] {
                        let mut ends = Vec::new();
                        for k in 0..3 {
                            let [one, other] = [corners[k], corners[(k + 1) % 3]];
                            let [a, b] = [one, other].map(|(i, j)| rows[j][i]);
                            if (a < 0.0) != (b < 0.0) {
                                let [from, to] = [one, other].map(|(i, j)| at(i, j));
                                let share = a / (a - b);
                                ends.push([0, 1].map(|d| from[d] + share * (to[d] - from[d])));
                            }
                        }
                        if let [start, end] = ends[..] {
                            let _ = write!(path, "M{}L{}", pair(start), pair(end));
                        }
                    }
                }
            }
            if !path.is_empty() {
                let _ = writeln!(
                    text,
                    "<path fill=\"none\" stroke=\"#777\" stroke-width=\"4\" \
                     stroke-linecap=\"round\" d=\"{path}\"/>"
                );
            }
        }
    }
}

/// Ends of a side of a face, the lesser first.
pub(super) fn ends(face: &Face, side: &[u8]) -> [u32; 2] {
    let mut ends = [0, 1].map(|k| face.nodes[usize::from(side[k])]);
    ends.sort_unstable();
    ends
}
