//! A layer bonded to a rigid plane and pressed flat from above, in plane strain.
//!
//! The top of the loaded part sinks by a given amount and slides without friction, or is
//! gripped; half of a symmetric layer is in the mesh. What becomes of the ends is the choice
//! of the body: they end with the load, or the layer goes on beside it.

use crate::material::Material;
use crate::mesh::{Axis, Grading, Grid2, Growth, Mesh, MeshError};
use crate::problem::Kinematics;
use crate::problem::{Contact, Motion, Obstacle, Parameter, Problem, ProblemError, Rule, Shape};
use crate::solver::failure::{Failure, Reason};
use crate::solver::newton::{Continue, Settings, Solver};

/// Condition at the end of the layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SideFace {
    /// The base is no wider than the layer: the face may pass below its plane.
    Free,
    /// The base is wider: the bulging face comes to lie on it, without friction.
    OnBase,
}

/// A rectangular bar in the layer, bonded to it on all sides; its mirror image lies in
/// the other half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// From the plane of symmetry to the bar, m: half of the gap between the two bars.
    pub inner: f64,
    /// Width, m.
    pub width: f64,
    /// Height of the lower face above the base, m.
    pub height: f64,
    /// Thickness, m.
    pub thickness: f64,
}

/// The layer at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Thickness `H`, m.
    pub thickness: f64,
    /// Half of the loaded length, m.
    pub loaded: f64,
    /// Length of the layer beside the load, m; its top is free there.
    pub beyond: f64,
    /// Its end.
    pub side: SideFace,
    /// The bars in it.
    pub bar: Option<Bar>,
    /// True if the top sticks to the load; otherwise it slides without friction.
    pub gripped: bool,
    /// Sizes of the cells.
    pub division: LayerDivision,
}

/// Sizes of the cells over the thickness of the layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerDivision {
    /// Smallest cell at corners of the layer.
    pub smallest: f64,
    /// Smallest cell at corners of the bars, over the shortest length there (thickness,
    /// width or gap).
    pub at_bar: f64,
    /// Largest ratio of neighbours.
    pub growth: f64,
    /// Largest cell.
    pub largest: f64,
}

impl Default for LayerDivision {
    fn default() -> Self {
        Self {
            smallest: 0.05,
            at_bar: 0.05,
            growth: 1.5,
            largest: 0.1,
        }
    }
}

/// Half lengths over thickness from which the side face is drawn out far at its foot.
const LONG: f64 = 3.0;
/// Half lengths over thickness up to which it is drawn out little.
const SHORT: f64 = 1.5;

impl LayerDivision {
    /// Cells for a layer of this loaded half length over its thickness.
    ///
    /// At the foot of the side face the stretch has no bound, and the pressure keeps the volume of
    /// each cell in the mean only: cells turn inside out there, the sooner the smaller they are
    /// and the longer the layer. More points of integration hold larger cells.
    pub fn for_aspect(aspect: f64) -> Self {
        let usual = Self::default();
        if aspect <= LONG {
            return usual;
        }
        Self {
            smallest: 0.2,
            largest: 0.2,
            ..usual
        }
    }

    /// Cells for a layer of this loaded half length over its thickness on a base no wider than
    /// itself: the foot of its side face is drawn out further. The force is within 2 % of a table
    /// up to a compression of 0.2.
    pub fn at_free_end(aspect: f64) -> Self {
        let usual = Self::for_aspect(aspect);
        Self {
            smallest: if aspect > SHORT && aspect <= LONG {
                0.1
            } else {
                usual.smallest
            },
            ..usual
        }
    }

    /// Cells for a layer that goes on beside a probe.
    ///
    /// At the edge of the probe the stress is infinite and the surface folds. Cells turn inside
    /// out there, the sooner the smaller they are. With these the force is within 0.4 % of a
    /// table up to a compression of 0.05, and within 6 % up to 0.15.
    pub fn beside_probe() -> Self {
        Self {
            smallest: 0.1,
            ..Self::default()
        }
    }
}

/// Marks that lie closer, over the thickness, are one.
const SAME: f64 = 1e-6;

/// Contact stiffness of the side face on the base, times thickness over shear modulus.
const STIFFNESS: f64 = 10_000.0;
/// Overlap of side face and base that is accepted, over the thickness.
const OVERLAP: f64 = 1e-3;

impl Layer {
    /// The mesh: regions `layer` and `bar`; surfaces `left`, `right`, `bottom`, `top`;
    /// the nodes `pressed`.
    ///
    /// # Errors
    /// [`MeshError`] for lengths that make no layer.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        let grid = Grid2::new([self.across()?, self.upward()?], "layer");
        let grid = match self.bar {
            Some(bar) => grid.region(
                "bar",
                [
                    [bar.inner, bar.inner + bar.width],
                    [bar.height, bar.height + bar.thickness],
                ],
            ),
            None => grid,
        };
        let mut mesh = grid.mesh()?;
        let top = mesh.nodes_of("top").unwrap_or_default();
        // A billionth of the length is the rounding of the places.
        let end = self.loaded * (1.0 + 1e-9);
        let pressed = top
            .into_iter()
            .filter(|&node| mesh.points[node as usize][0] <= end)
            .collect();
        mesh.node_sets.insert("pressed".to_owned(), pressed);
        Ok(mesh)
    }

    fn growth(&self, smallest: f64) -> Growth {
        let largest = self.division.largest * self.thickness;
        Growth {
            smallest: smallest.min(largest),
            ratio: self.division.growth,
            largest,
        }
    }

    /// Smallest cells at the corners of the layer and of the bar.
    fn sizes(&self) -> [Growth; 2] {
        let corner = self.growth(self.division.smallest * self.thickness);
        let at_bar = self.bar.map_or(f64::INFINITY, |bar| {
            let shortest = bar.thickness.min(bar.width).min(2.0 * bar.inner);
            self.division.at_bar * shortest
        });
        [corner, self.growth(at_bar)]
    }

    fn across(&self) -> Result<Axis, MeshError> {
        let [corner, at_bar] = self.sizes();
        let mut marks = vec![(0.0, None)];
        if let Some(bar) = self.bar {
            marks.push((bar.inner, Some(at_bar)));
            marks.push((bar.inner + bar.width, Some(at_bar)));
        }
        marks.push((self.loaded, Some(corner)));
        if self.beyond > 0.0 {
            marks.push((self.loaded + self.beyond, None));
        }
        // A bar may reach beyond the load, or end with it.
        marks.sort_by(|a, b| a.0.total_cmp(&b.0));
        marks.dedup_by(|b, a| {
            let same = b.0 - a.0 <= SAME * self.thickness;
            if same {
                a.1 = a.1.or(b.1);
            }
            same
        });
        graded(&marks, self.growth(f64::INFINITY))
    }

    fn upward(&self) -> Result<Axis, MeshError> {
        let [corner, at_bar] = self.sizes();
        let mut marks = vec![(0.0, (self.beyond == 0.0).then_some(corner))];
        if let Some(bar) = self.bar {
            marks.push((bar.height, Some(at_bar)));
            marks.push((bar.height + bar.thickness, Some(at_bar)));
        }
        // At its rim the load concentrates only where the layer goes on.
        marks.push((self.thickness, (self.beyond > 0.0).then_some(corner)));
        graded(&marks, self.growth(f64::INFINITY))
    }
}

/// An axis through marks, with small cells at those that have a growth.
fn graded(marks: &[(f64, Option<Growth>)], free: Growth) -> Result<Axis, MeshError> {
    let mut breakpoints = vec![marks[0].0];
    let mut gradings = Vec::new();
    for pair in marks.windows(2) {
        let ((start, first), (end, last)) = (pair[0], pair[1]);
        match (first, last) {
            (Some(first), Some(last)) => {
                // Each half grows from its own end.
                let middle = f64::midpoint(start, end);
                gradings.push(Grading::FromStart(first));
                breakpoints.push(middle);
                gradings.push(Grading::FromEnd(last));
            }
            (Some(first), None) => gradings.push(Grading::FromStart(first)),
            (None, Some(last)) => gradings.push(Grading::FromEnd(last)),
            (None, None) => gradings.push(Grading::FromStart(free)),
        }
        breakpoints.push(end);
    }
    Axis::new(&breakpoints, &gradings)
}

/// The layer under one load; forces of the whole, per depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressedLayer {
    /// Sinking of the top over the thickness.
    pub compression: f64,
    /// Force over the loaded length at rest, Pa.
    pub mean_stress: f64,
    /// Length of the side face that lies on the base, m of the face at rest.
    pub on_base: f64,
    /// Greatest von Mises stress, Pa. It grows with refinement where the theory has it
    /// without bound: at bonded and at reentrant corners.
    pub stress: f64,
    /// The least volume ratio over all cells; zero or less where one is inside out.
    pub least_volume_ratio: f64,
}

/// Half a layer with what presses it.
pub struct LayerStudy {
    /// The problem being solved.
    pub solver: Solver,
    layer: Layer,
    travel: Parameter,
}

impl LayerStudy {
    /// Poses the problem; `bar` is the solid of the bars, where there are any.
    ///
    /// # Errors
    /// When the lengths make no layer.
    pub fn new(layer: Layer, material: Material, bar: Option<Material>) -> Result<Self, Failure> {
        let mesh = layer
            .mesh()
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let (problem, travel) = pose(mesh, layer, material, bar.unwrap_or(material))
            .map_err(|error| Failure::at_start(Reason::Problem(error)))?;
        let mut solver = Solver::new(problem)?;
        solver.settings = Settings {
            // Where the side face rolls onto the base, points change sides on the way.
            iterations: 25,
            // Cells inside out at the foot of the side face take up to a tenth off the force.
            // At the edge of a probe they do less than the fold of the surface there.
            whole_cells: layer.beyond == 0.0,
            ..Settings::default()
        };
        Ok(Self {
            solver,
            layer,
            travel,
        })
    }

    /// The layer at rest.
    pub fn layer(&self) -> &Layer {
        &self.layer
    }

    /// Lets the top sink to a compression, 0 to below 1.
    ///
    /// # Errors
    /// When the solution fails on the way; it stays at the last good state.
    pub fn press(&mut self, compression: f64) -> Result<PressedLayer, Failure> {
        let mut targets = self.solver.targets().to_vec();
        targets[self.travel.0] = compression * self.layer.thickness;
        if targets != self.solver.targets() {
            self.solver.load_to(&targets, |_, _| Continue::Yes)?;
        }
        self.pressed()
    }

    /// The layer at the present state.
    ///
    /// # Errors
    /// When the state is not valid.
    pub fn pressed(&mut self) -> Result<PressedLayer, Failure> {
        let along = self.solver.evaluate()?.along[self.travel.0];
        let travel = self.solver.state().parameters[self.travel.0];
        let stress = self.solver.greatest_stress();
        let least = self.solver.least_volume_ratio();
        Ok(PressedLayer {
            least_volume_ratio: least.map_or(1.0, |least| least.ratio),
            compression: travel / self.layer.thickness,
            mean_stress: along / self.layer.loaded,
            on_base: self.on_base(),
            stress: stress.map_or(0.0, |peak| peak.von_mises),
        })
    }

    /// Height at rest of the highest point of the side face that presses on the base.
    fn on_base(&self) -> f64 {
        if self.layer.side == SideFace::Free {
            return 0.0;
        }
        let probe = self.solver.contact(0);
        let touching = probe.pressures.iter().zip(&probe.at);
        touching
            .filter(|(pressure, _)| **pressure > 0.0)
            .fold(0.0, |highest: f64, (_, at)| highest.max(at[1]))
    }
}

fn pose(
    mesh: Mesh,
    layer: Layer,
    material: Material,
    bar: Material,
) -> Result<(Problem, Parameter), ProblemError> {
    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain)?;
    let regions = problem.mesh.regions.iter();
    problem.materials = regions
        .map(|name| if name == "bar" { bar } else { material })
        .collect();
    problem.clamp("bottom")?;
    problem.support("left", 0, Motion::Fixed)?;
    let travel = problem.parameter("travel of the top", Rule::Given);
    problem.support("pressed", 1, Motion::Driven(travel, -1.0))?;
    if layer.gripped {
        problem.support("pressed", 0, Motion::Fixed)?;
    }
    if layer.side == SideFace::OnBase {
        let surface = problem.surface("right")?;
        problem.contacts.push(Contact::Obstacle(Obstacle {
            surface,
            shape: Shape::HalfSpace {
                point: [0.0; 3],
                normal: [0.0, 1.0, 0.0],
            },
            travel: None,
            stiffness: STIFFNESS * material.law.shear_modulus() / layer.thickness,
            friction: 0.0,
            overlap_limit: OVERLAP * layer.thickness,
        }));
    }
    Ok((problem, travel))
}
