//! Two conducting bars side by side in a pressed layer: their shape, and the
//! capacitance between them in the deformed section.
//!
//! # The field's mesh
//! The layer's cells are taken as they lie deformed. Around them stand blocks made anew
//! for each state, conforming node by node: columns above the top and below the base,
//! rows beside the side face, each at the height of its node. Where the side face lies
//! on the base there is no room for rows: they begin above, and the columns below the
//! base begin at the face. Beyond a box the mesh is blended into a circle, outside of
//! which all space is mapped inside ([`crate::field::exterior`]).

use super::layer::{Bar, Layer, LayerStudy};
use crate::field::FieldError;
use crate::field::electrostatics::{Electrostatics, Infinity, VACUUM_PERMITTIVITY};
use crate::field::exterior::{Ball, Exterior, Shell, add_exterior, surround};
use crate::field::laplace::{Coefficient, Domain, Geometry, Motion};
use crate::material::Material;
use crate::mesh::{CellShape, Mesh};
use crate::solver::failure::{Failure, Reason};
use std::collections::{BTreeMap, HashMap};

/// Shape of the bars; present over initial lengths where it says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarShape {
    /// Gap between the facing sides, mean over their height at rest, m.
    pub gap: f64,
    /// Gap at the lower edges, m.
    pub gap_bottom: f64,
    /// Gap at the upper edges, m.
    pub gap_top: f64,
    /// Thickness at the facing side, m.
    pub thickness_at_face: f64,
    /// Thickness, mean along the width at rest, m.
    pub thickness: f64,
    /// Width at half thickness, m.
    pub width: f64,
}

/// What lies around the layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Media {
    /// Relative permittivity of the layer.
    pub layer: f64,
    /// Relative permittivity above and beside it.
    pub above: f64,
    /// Relative permittivity below the base plane; none when that plane is at zero.
    pub below: Option<f64>,
}

/// Capacitances between the bars per depth over the permittivity of vacuum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BarCapacitance {
    /// With the bars at plus and minus half the voltage.
    pub differential: f64,
    /// Between the bars alone, with the base guarded; without a base at zero the same.
    pub mutual: f64,
}

/// A pressed layer with its bars.
pub struct BarStudy {
    /// The pressed layer.
    pub study: LayerStudy,
    bar: Bar,
}

impl BarStudy {
    /// Poses the problem of a layer whose side face comes to lie on the base or has the
    /// layer going on.
    ///
    /// # Errors
    /// When the lengths make no layer.
    pub fn new(
        layer: Layer,
        bar: Bar,
        material: Material,
        stiff: Material,
    ) -> Result<Self, Failure> {
        let layer = Layer {
            bar: Some(bar),
            ..layer
        };
        LayerStudy::new(layer, material, Some(stiff)).map(|study| Self { study, bar })
    }

    /// Lines of nodes through corners of the bar: present places with initial ones.
    fn line(&self, along: usize, at: f64, range: [f64; 2]) -> Vec<(f64, [f64; 3])> {
        let mesh = &self.study.solver.problem().mesh;
        let places = self.study.solver.state().places(mesh);
        let near = 1e-9 * self.study.layer().thickness;
        let mut line: Vec<(f64, [f64; 3])> = mesh
            .points
            .iter()
            .zip(places)
            .filter(|(x, _)| {
                (x[1 - along] - at).abs() < near
                    && x[along] > range[0] - near
                    && x[along] < range[1] + near
            })
            .map(|(x, place)| (x[along], place))
            .collect();
        line.sort_by(|a, b| a.0.total_cmp(&b.0));
        line
    }

    /// Shape of the bars at the present state.
    pub fn shape(&self) -> BarShape {
        let Bar {
            inner,
            width,
            height,
            thickness,
        } = self.bar;
        let (across, upward) = ([inner, inner + width], [height, height + thickness]);
        let face = self.line(1, inner, upward);
        let back = self.line(1, inner + width, upward);
        let [lower, upper] = upward.map(|at| self.line(0, at, across));
        let mean = |line: &[(f64, [f64; 3])], component: usize| average(line, component);
        let end = |line: &[(f64, [f64; 3])], component: usize| {
            line.last().map_or(f64::NAN, |point| point.1[component])
        };
        let start = |line: &[(f64, [f64; 3])], component: usize| {
            line.first().map_or(f64::NAN, |point| point.1[component])
        };
        BarShape {
            gap: 2.0 * mean(&face, 0),
            gap_bottom: 2.0 * start(&face, 0),
            gap_top: 2.0 * end(&face, 0),
            thickness_at_face: end(&face, 1) - start(&face, 1),
            thickness: mean(&upper, 1) - mean(&lower, 1),
            width: middle(&back) - middle(&face),
        }
    }

    /// Capacitances in the present shape, all media at once.
    ///
    /// # Errors
    /// When the deformed section makes no mesh for the field.
    pub fn capacitance(&self, media: &[Media]) -> Result<Vec<BarCapacitance>, Failure> {
        let solve = || -> Result<Vec<BarCapacitance>, FieldError> {
            let section = self.section(self.study.solver.state().displacement.as_slice())?;
            media.iter().map(|media| section.solve(*media)).collect()
        };
        solve().map_err(|error| Failure::at_start(Reason::Field(error)))
    }

    /// The deformed section with its surroundings.
    ///
    /// # Errors
    /// [`FieldError`] when the blocks fit no circle.
    pub fn section(&self, displacement: &[[f64; 3]]) -> Result<Section, FieldError> {
        let mesh = &self.study.solver.problem().mesh;
        Section::new(mesh, displacement, self.study.layer())
    }
}

/// Mean of a component along the initial length, by Simpson's rule on each cell.
fn average(line: &[(f64, [f64; 3])], component: usize) -> f64 {
    let mut sum = 0.0;
    for cell in line.windows(3).step_by(2) {
        let values: [f64; 3] = std::array::from_fn(|k| cell[k].1[component]);
        sum += (cell[2].0 - cell[0].0) * (values[0] + 4.0 * values[1] + values[2]) / 6.0;
    }
    let length = line.last().map_or(0.0, |end| end.0) - line.first().map_or(0.0, |start| start.0);
    sum / length
}

/// Place across at the middle of an upright line, where its cells meet or have a node.
fn middle(line: &[(f64, [f64; 3])]) -> f64 {
    let (Some(first), Some(last)) = (line.first(), line.last()) else {
        return f64::NAN;
    };
    let at = f64::midpoint(first.0, last.0);
    let nearest = line
        .iter()
        .min_by(|a, b| (a.0 - at).abs().total_cmp(&(b.0 - at).abs()));
    nearest.map_or(f64::NAN, |point| point.1[0])
}

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

impl Section {
    fn new(solid: &Mesh, displacement: &[[f64; 3]], layer: &Layer) -> Result<Self, FieldError> {
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
        // A face that may pass below the plane of the base counts as lying on it.
        let lying = lay_down(&mut places, &side, 2.0 * OVERLAP * layer.thickness);
        let extent = places
            .iter()
            .fold(0.0_f64, |most, at| most.max(at[0].max(at[1])));
        let mut sewn = Sewn::default();
        for cell in 0..solid.cell_count() {
            let region = &solid.regions[solid.region_of(cell)];
            let at: Vec<[f64; 2]> = solid
                .cell(cell)
                .iter()
                .map(|&n| places[n as usize])
                .collect();
            sewn.cell(region, &at);
        }
        let at = |nodes: &[u32]| -> Vec<[f64; 2]> {
            nodes.iter().map(|&n| places[n as usize]).collect()
        };
        let side = at(&side);
        let size = BOX * extent;
        sewn.surround_layer(
            &at(&top),
            &at(&bottom),
            &side[..=lying],
            &side[lying..],
            size,
        );
        let mut mesh = sewn.mesh;
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
        let named = |condition: &dyn Fn([f64; 3]) -> bool| -> Vec<u32> {
            (0..mesh.points.len() as u32)
                .filter(|&node| condition(mesh.points[node as usize]))
                .collect()
        };
        let sets = BTreeMap::from([
            ("odd".to_owned(), named(&|p| p[0] == 0.0)),
            ("base".to_owned(), named(&|p| p[1] == 0.0)),
        ]);
        mesh.node_sets = sets;
        Ok(Self { mesh, exterior })
    }

    /// Capacitances among these media.
    ///
    /// # Errors
    /// [`FieldError`]: permittivities that are not positive, cells turned inside out.
    pub fn solve(&self, media: Media) -> Result<BarCapacitance, FieldError> {
        self.solve_moved(media, Motion::None)
    }

    /// The same on a mesh that moves, or pulled back.
    ///
    /// # Errors
    /// As [`Section::solve`].
    pub fn solve_moved(&self, media: Media, motion: Motion) -> Result<BarCapacitance, FieldError> {
        let permittivities = [
            ("layer", media.layer),
            ("above", media.above),
            ("below", media.below.unwrap_or(media.above)),
        ]
        .map(|(name, value)| (name, Coefficient::Scalar(value)));
        let with = |zero: &[&str]| -> Result<f64, FieldError> {
            let found = Electrostatics {
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
            .capacitance()?;
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
}

/// Overlap below which the side face counts as lying on the base, over the thickness.
const OVERLAP: f64 = 1e-3;

/// Puts the part of the side face that touches the base onto it; the number of nodes
/// of the face that lie, less one (the corner always does).
fn lay_down(places: &mut [[f64; 2]], side: &[u32], near: f64) -> usize {
    let height = |places: &[[f64; 2]], k: usize| places[side[k] as usize][1];
    let mut lying = 0;
    for k in (2..side.len()).step_by(2) {
        if height(places, k) < near {
            lying = k;
        }
    }
    for k in 0..=lying {
        places[side[k] as usize][1] = 0.0;
    }
    // The edge that rises from the base must rise all along: its middle lies at least
    // at a quarter of its end.
    if let Some(&end) = side.get(lying + 2) {
        let least = 0.26 * places[end as usize][1];
        let middle = &mut places[side[lying + 1] as usize][1];
        *middle = middle.max(least);
    }
    lying
}

/// A plane mesh sewn together from blocks that share the digits of their places.
#[derive(Default)]
struct Sewn {
    mesh: Mesh,
    known: HashMap<[u64; 2], u32>,
}

impl Sewn {
    fn cell(&mut self, region: &str, at: &[[f64; 2]]) {
        let nodes: Vec<u32> = at.iter().map(|&place| self.node(place)).collect();
        let region = self.mesh.region(region);
        self.mesh.add_cell(CellShape::Quad9, region, &nodes);
    }

    fn node(&mut self, at: [f64; 2]) -> u32 {
        // Plus zero makes minus zero plus.
        let key = at.map(|x| (x + 0.0).to_bits());
        *self.known.entry(key).or_insert_with(|| {
            self.mesh.points.push([at[0], at[1], 0.0]);
            self.mesh.points.len() as u32 - 1
        })
    }

    /// Cells of a block whose nodes `place` gives by number, half cells counted.
    fn block(
        &mut self,
        region: &str,
        counts: [usize; 2],
        place: &dyn Fn(usize, usize) -> [f64; 2],
    ) {
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let at: [[f64; 2]; 9] = std::array::from_fn(|node| {
                    let [x, y, _] = CellShape::Quad9.node_at(node);
                    place(2 * i + (x + 1.0) as usize, 2 * j + (y + 1.0) as usize)
                });
                self.cell(region, &at);
            }
        }
    }

    /// Blocks between the layer and a box of half side `size`: above its `top`, beside
    /// the part of its side face that stands, below its `bottom` and what lies on the
    /// base.
    fn surround_layer(
        &mut self,
        top: &[[f64; 2]],
        bottom: &[[f64; 2]],
        lying: &[[f64; 2]],
        standing: &[[f64; 2]],
        size: f64,
    ) {
        let (foot, head) = (standing[0], standing[standing.len() - 1]);
        let outward = shares(size - head[0], head[1] / 8.0);
        let beside = |from: f64, k: usize| blend(from, size, outward[k]);
        let upward = shares(size - head[1], head[1] / 8.0);
        let xs_top: Vec<f64> = top.iter().map(|at| at[0]).collect();
        let heights = |from: [f64; 2], k: usize| blend(from[1], size, upward[k]);
        let cells = |nodes: usize| (nodes - 1) / 2;
        self.block("above", [cells(top.len()), cells(upward.len())], &|i, j| {
            [xs_top[i], heights(top[i], j)]
        });
        self.block(
            "above",
            [cells(outward.len()), cells(upward.len())],
            &|i, j| [beside(head[0], i), heights(head, j)],
        );
        self.block(
            "above",
            [cells(outward.len()), cells(standing.len())],
            &|i, j| [beside(standing[j][0], i), standing[j][1]],
        );
        let mut base: Vec<f64> = bottom.iter().map(|at| at[0]).collect();
        base.extend(lying.iter().skip(1).map(|at| at[0]));
        base.extend((1..outward.len()).map(|k| beside(foot[0], k)));
        let downward = shares(size, head[1] / 8.0);
        self.block(
            "below",
            [cells(base.len()), cells(downward.len())],
            &|i, j| {
                let last = downward.len() - 1;
                [base[i], -blend(0.0, size, downward[last - j])]
            },
        );
    }
}

fn blend(from: f64, to: f64, share: f64) -> f64 {
    if share == 1.0 {
        to
    } else {
        from + share * (to - from)
    }
}

/// Shares of nodes, half cells counted, of cells that grow from `first` over a length.
fn shares(length: f64, first: f64) -> Vec<f64> {
    let growth = crate::mesh::Growth {
        smallest: first.min(length),
        ratio: 1.5,
        largest: f64::INFINITY,
    };
    let axis = crate::mesh::Axis::new(&[0.0, length], &[crate::mesh::Grading::FromStart(growth)]);
    let ends: Vec<f64> = match &axis {
        Ok(axis) => axis.positions().iter().map(|x| x / length).collect(),
        Err(_) => vec![0.0, 1.0],
    };
    let mut shares = vec![0.0];
    for pair in ends.windows(2) {
        shares.push(f64::midpoint(pair[0], pair[1]));
        shares.push(pair[1]);
    }
    shares
}
