//! The field's mesh round a deformed layer.
//!
//! Around the layer, whose cells stay as they lie, triangles fill what is above and beside it
//! and what is below the plane of its base, however far the side face overhangs or the top folds
//! beside the probe ([`taxel_fem::mesh::polygon`]). They share the nodes of the outline. Beyond a box
//! the mesh is blended into a circle, outside of which all space is mapped inside
//! ([`taxel_fem::field::exterior`]).

use super::tied::{Node, Outline, Tied, between, joined, reversed};
use super::{BarCapacitance, Media};
use std::collections::BTreeMap;
use taxel_fem::field::FieldError;
use taxel_fem::field::electrostatics::{
    Capacitance, Electrostatics, Infinity, VACUUM_PERMITTIVITY,
};
use taxel_fem::field::exterior::{Ball, Exterior, Shell, add_exterior, surround};
use taxel_fem::field::geometry::Geometry;
use taxel_fem::field::laplace::{Coefficient, Domain, MeshMotion};
use taxel_fem::mesh::{CellShape, Mesh};
use taxel_fem::study::layer::{Layer, SideFace};

/// The deformed half section in unbounded space.
#[derive(Clone, Debug)]
pub struct Section {
    /// Regions `layer`, `bar`, `above`, `below` and their images.
    pub mesh: Mesh,
    exterior: Exterior,
}

/// Half the side of the box over the extent of the layer.
const BOX: f64 = 1.6;
/// Radius of the circle over half the side of the box.
const CIRCLE: f64 = 1.7;
/// Layers of cells from box to circle, and in its image.
const SHELL_LAYERS: usize = 4;
/// Cosine below which a line turns back.
const TURNED_BACK: f64 = -0.9;

impl Section {
    /// The section of a layer whose nodes have moved so.
    ///
    /// # Errors
    /// [`FieldError::Folded`] when the outline of the layer crosses itself.
    pub(super) fn new(
        solid: &Mesh,
        displacement: &[[f64; 3]],
        layer: &Layer,
    ) -> Result<Self, FieldError> {
        let mut places: Vec<[f64; 2]> = solid
            .points
            .iter()
            .zip(displacement)
            .map(|(x, u)| [x[0] + u[0], x[1] + u[1]])
            .collect();
        let line = |name: &str, by: usize| -> Vec<u32> {
            let mut nodes = solid.nodes_of(name).unwrap_or_default();
            let key = |node: u32| solid.points[node as usize][by];
            nodes.sort_by(|&a, &b| key(a).total_cmp(&key(b)));
            nodes
        };
        let (top, bottom, side) = (line("top", 0), line("bottom", 0), line("right", 1));
        if layer.side == SideFace::OnBase {
            lay_down(&mut places, &side, 2.0 * OVERLAP * layer.thickness);
        }
        let cut = cut_at(solid, &bottom, layer);
        let kept = |node: u32| solid.points[node as usize][0] <= cut;
        let mut tied = Tied::default();
        for cell in 0..solid.cell_count() {
            let nodes = solid.cell(cell);
            if nodes.iter().all(|&node| kept(node)) {
                let region = &solid.regions[solid.region_of(cell)];
                tied.cell(CellShape::Quad9, region, &at(&places, nodes));
            }
        }
        let mut across = named(solid, &|p| p[0] == cut);
        across
            .sort_by(|&a, &b| solid.points[a as usize][1].total_cmp(&solid.points[b as usize][1]));
        let parted = |line: &[u32]| {
            let count = line.iter().filter(|&&node| kept(node)).count();
            [at(&places, &line[..count]), at(&places, &line[count - 1..])]
        };
        let [top, far_top] = parted(&top);
        let [bottom, far_bottom] = parted(&bottom);
        let mut far = unfolded(&joined(&[
            far_bottom,
            at(&places, &side),
            reversed(&far_top),
        ]));
        let outline = Outline {
            foot: foot_of(&mut far),
            far,
            top,
            bottom,
            across: at(&places, &across),
        };
        let extent = places
            .iter()
            .fold(0.0_f64, |most, at| most.max(at[0].max(at[1].abs())));
        let size = BOX * extent;
        let base = tied.surround(&outline, size)?;
        let mut mesh = tied.mesh;
        mesh.name_boundary("box", |p| p[0] == size || p[1].abs() == size);
        let ball = Ball {
            centre: [0.0; 3],
            radius: CIRCLE * size,
        };
        let shell = Shell {
            ball,
            layers: SHELL_LAYERS,
            growth: 1.0,
            region: None,
        };
        surround(&mut mesh, "box", shell, "ball")?;
        let exterior = add_exterior(&mut mesh, "ball", ball, SHELL_LAYERS)?;
        // Beyond the box the plane of the base is where the second number is zero.
        let mut plane = named(&mesh, &|p| p[0] > size && p[1] == 0.0);
        plane.extend(base);
        let sets = BTreeMap::from([
            ("odd".to_owned(), named(&mesh, &|p| p[0] == 0.0)),
            ("base".to_owned(), plane),
        ]);
        mesh.node_sets = sets;
        Ok(Self { mesh, exterior })
    }

    /// Capacitances among these media.
    ///
    /// # Errors
    /// [`FieldError`]: permittivities that are not positive, cells turned inside out.
    pub fn solve(&self, media: Media) -> Result<BarCapacitance, FieldError> {
        self.solve_moved(media, MeshMotion::None)
    }

    /// The same on a mesh that moves, or pulled back.
    ///
    /// # Errors
    /// As [`Section::solve`].
    pub fn solve_moved(
        &self,
        media: Media,
        motion: MeshMotion,
    ) -> Result<BarCapacitance, FieldError> {
        let with = |zero: &[&str]| -> Result<f64, FieldError> {
            let found = self.field(media, motion, zero)?;
            Ok(found.matrix[0][0] / VACUUM_PERMITTIVITY)
        };
        // Half of the section carries one bar, at half the voltage.
        if media.below.is_some() {
            let differential = with(&["odd"])? / 2.0;
            return Ok(BarCapacitance {
                differential,
                mutual: differential,
            });
        }
        // The field below a base at zero is empty.
        let differential = with(&["odd", "base"])? / 2.0;
        let to_base = with(&["base"])?;
        Ok(BarCapacitance {
            differential,
            mutual: differential - to_base / 2.0,
        })
    }

    fn field(
        &self,
        media: Media,
        motion: MeshMotion,
        zero: &[&str],
    ) -> Result<Capacitance, FieldError> {
        let permittivities = [
            ("layer", media.layer),
            ("above", media.above),
            ("below", media.below.unwrap_or(media.above)),
        ]
        .map(|(name, value)| (name, Coefficient::Scalar(value)));
        Electrostatics {
            domain: Domain {
                mesh: &self.mesh,
                geometry: Geometry::Plane,
                motion,
                exterior: Some(&self.exterior),
            },
            permittivities: &permittivities,
            conductors: &["bar"],
            floating: &[],
            zero,
            infinity: Infinity::Free,
        }
        .capacitance()
    }
}

/// Overlap below which the side face counts as lying on the base, over the thickness.
const OVERLAP: f64 = 1e-3;

/// Puts the part of the side face that touches the base onto it.
fn lay_down(places: &mut [[f64; 2]], side: &[u32], near: f64) {
    let height = |places: &[[f64; 2]], k: usize| places[side[k] as usize][1];
    let mut lying = 0;
    for k in (2..side.len()).step_by(2) {
        if height(places, k) < near {
            lying = k;
        }
    }
    for &node in &side[..=lying] {
        places[node as usize][1] = 0.0;
    }
    // The edge that rises from the base must rise all along: its middle lies at least
    // at a quarter of its end.
    if let Some(&end) = side.get(lying + 2) {
        let least = 0.26 * places[end as usize][1];
        let middle = &mut places[side[lying + 1] as usize][1];
        *middle = middle.max(least);
    }
}

/// Up to where along the layer at rest its cells carry the field: to a line of the mesh at a
/// quarter of the way from the bar to the end of the load, where cells fold, or to the bar itself.
fn cut_at(solid: &Mesh, bottom: &[u32], layer: &Layer) -> f64 {
    let bar = layer.bar.map_or(0.0, |bar| bar.inner + bar.width);
    let quarter = 0.75 * bar + 0.25 * layer.loaded;
    let corners = bottom
        .iter()
        .step_by(2)
        .map(|&node| solid.points[node as usize][0]);
    let near = 1e-9 * layer.loaded;
    corners
        .filter(|x| (bar - near..layer.loaded - near).contains(x))
        .min_by(|a, b| (a - quarter).abs().total_cmp(&(b - quarter).abs()))
        .unwrap_or(bar)
}

/// A line without the corners at which it turns back on itself: at the edge of a probe and at
/// the foot of a side face the outline folds within the size of a cell.
fn unfolded(line: &[Node]) -> Vec<Node> {
    let mut kept: Vec<Node> = vec![line[0]];
    for pair in line[1..].chunks_exact(2) {
        let (mut middle, next) = (pair[0], pair[1]);
        while let [.., before, _, last] = kept[..]
            && turns_back(before, last, next)
        {
            kept.truncate(kept.len() - 2);
            middle = between(before, next);
        }
        kept.extend([middle, next]);
    }
    kept
}

fn turns_back(a: Node, b: Node, c: Node) -> bool {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
    u[0] * v[0] + u[1] * v[1] < TURNED_BACK * u[0].hypot(u[1]) * v[0].hypot(v[1])
}

/// The corner of a line where it comes up through the plane of the base for the last time: what
/// passes below that plane displaces what is there. The nearest corner is moved to the crossing.
fn foot_of(line: &mut [Node]) -> usize {
    let below = (0..line.len())
        .step_by(2)
        .rev()
        .find(|&k| line[k][1] <= 0.0);
    let below = below.unwrap_or_default();
    let above = (below + 2).min(line.len() - 1);
    let (low, high) = (line[below], line[above]);
    // The ends of the line belong to other cells, too.
    let inside = below > 0 && above + 1 < line.len();
    if low[1] == 0.0 || high[1] <= 0.0 || !inside {
        return below;
    }
    let share = -low[1] / (high[1] - low[1]);
    let foot = if share < 0.5 { below } else { above };
    line[foot] = [low[0] + share * (high[0] - low[0]), 0.0];
    for middle in [foot - 1, foot + 1] {
        line[middle] = between(line[middle - 1], line[middle + 1]);
    }
    foot
}

/// Places of some nodes.
fn at(places: &[Node], nodes: &[u32]) -> Vec<Node> {
    nodes.iter().map(|&node| places[node as usize]).collect()
}

/// Nodes whose places satisfy a condition.
fn named(mesh: &Mesh, condition: &dyn Fn([f64; 3]) -> bool) -> Vec<u32> {
    (0..mesh.points.len() as u32)
        .filter(|&node| condition(mesh.points[node as usize]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::BarStudy;
    use super::*;
    use taxel_fem::material::{Law, Material};
    use taxel_fem::study::layer::{Bar, LayerDivision};

    #[test]
    fn energy_and_flux_agree_where_the_outline_is_bent() {
        let rubber = Material::incompressible(Law::MooneyRivlin { c10: 0.5, c01: 0.0 });
        let layer = Layer {
            thickness: 1.0,
            loaded: 1.8,
            beyond: 0.0,
            side: SideFace::Free,
            bar: None,
            gripped: false,
            division: LayerDivision::at_free_end(1.8),
        };
        let bar = Bar {
            inner: 0.05,
            width: 1.0,
            height: 0.6,
            thickness: 0.1,
        };
        let mut study = BarStudy::new(layer, bar, rubber, rubber).unwrap();
        study.study.press(0.2).unwrap();
        let displacement = study.study.solver.state().displacement.clone();
        let section = study.section(&displacement).unwrap();
        // Below the plane of the base there is some of the layer.
        let solid = |cell: usize| section.mesh.region_of(cell) == 0;
        let lowest = (0..section.mesh.cell_count())
            .filter(|&cell| solid(cell))
            .flat_map(|cell| section.mesh.cell(cell).to_vec())
            .map(|node| section.mesh.points[node as usize][1])
            .fold(0.0, f64::min);
        assert!(lowest < -0.01, "{lowest}");
        let media = Media {
            layer: 2.4,
            above: 1.0,
            below: Some(5.5),
        };
        let found = section.field(media, MeshMotion::None, &["odd"]).unwrap();
        assert!(found.mismatch() < 1e-8, "{}", found.mismatch());
    }

    #[test]
    fn corners_at_which_a_line_turns_back_are_left_out() {
        let line = |corners: &[Node]| -> Vec<Node> {
            let mut line = vec![corners[0]];
            for pair in corners.windows(2) {
                line.extend([between(pair[0], pair[1]), pair[1]]);
            }
            line
        };
        let folded = line(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.5, 0.0], [1.5, 1.0]]);
        let expected = line(&[[0.0, 0.0], [1.0, 0.0], [1.5, 0.0], [1.5, 1.0]]);
        assert_eq!(unfolded(&folded), expected);
        assert_eq!(unfolded(&expected), expected);
    }

    #[test]
    fn the_corner_nearest_to_the_plane_of_the_base_is_moved_onto_it() {
        let middle = |a: Node, b: Node| between(a, b);
        let (a, b, c, d) = ([0.0, 0.0], [1.0, -0.1], [2.0, 0.3], [3.0, 0.5]);
        let mut line = vec![a, middle(a, b), b, middle(b, c), c, middle(c, d), d];
        let foot = foot_of(&mut line);
        assert_eq!((foot, line[foot]), (2, [1.25, 0.0]));
        assert_eq!(line[1], [0.625, 0.0]);
        // The end of the line is not moved.
        let mut line = vec![a, middle(a, b), b, middle(b, c), c];
        let same = line.clone();
        assert_eq!((foot_of(&mut line), line), (2, same));
        // A face that stands on its corner keeps it.
        let mut line = vec![a, middle(a, c), c];
        let same = line.clone();
        assert_eq!((foot_of(&mut line), line), (0, same));
    }
}
