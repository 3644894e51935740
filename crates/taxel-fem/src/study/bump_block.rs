//! A bump on an elastic block with four cavities and stiff plates above and below each: how
//! much the plates near each other under a small force on the flat top of the bump.
//!
//! Linear response of a quarter of the block: x and y lead outward from its axis, z upward
//! from the upper faces of the cavities.

use std::collections::BTreeMap;

use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, Facet, Grading, Grid3, Mesh, MeshError, Part};
use crate::problem::load::traction;
use crate::problem::{DeadLoad, Kinematics, Motion, Problem, ProblemError, Rule};
use crate::solver::failure::{Failure, Reason};
use crate::solver::newton::{Continue, Settings, Solver};

/// The block at rest; lengths in m, x alike y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BumpBlock {
    /// From the axis to the outer face.
    pub half: f64,
    /// From the axis to the near and to the far wall of a cavity.
    pub cavity: [f64; 2],
    /// From the axis to the near and to the far edge of a plate.
    pub plate: [f64; 2],
    /// Thickness of the plates.
    pub plate_thickness: f64,
    /// Elastomer from the bottom to the lower plate's upper face.
    pub lower: f64,
    /// Elastomer between the lower plate and the cavity.
    pub insulation: f64,
    /// Height of the cavities.
    pub air: f64,
    /// Elastomer from the cavities to the bump.
    pub upper: f64,
    /// Height of the bump.
    pub bump: f64,
    /// Half side of the bump at its base and at its flat top.
    pub bump_half: [f64; 2],
    /// True if a block like this one follows on each side along x, all of one piece; then the
    /// outer face across x is that of the last block.
    pub in_row: bool,
}

/// Cavities of the quarter that is solved: of the block itself, and of the next one in a row
/// the near and the far one.
const CAVITIES: [&str; 3] = ["gap", "near", "far"];

/// What holds the outer faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockSides {
    /// Nothing: a piece that is cut out.
    Free,
    /// Mirror images under the same load.
    Symmetric,
}

/// Direction of the force, uniform over the flat top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TopForce {
    /// Downward.
    Normal,
    /// Along x.
    Side,
}

/// Numbers of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockDivision {
    /// Across: wall, from wall to plate, inner and outer half of the plate, from plate to
    /// wall, beyond.
    pub across: [usize; 6],
    /// Upward: lower layer, upper layer, bump. Thin layers have one.
    pub upward: [usize; 3],
}

impl BlockDivision {
    /// About 6 thousand unknowns: on the unit of P2 closings are 1 to 4 % off the next one.
    pub const COARSE: Self = Self {
        across: [1, 1, 1, 1, 1, 1],
        upward: [1, 1, 1],
    };
    /// About 25 thousand unknowns: on the unit of P2 closings are within 2 % of graded meshes,
    /// the largest closing within 4 %.
    pub const USUAL: Self = Self {
        across: [1, 2, 2, 2, 2, 2],
        upward: [2, 2, 2],
    };
}

/// Response to a force of 1 N by linear extrapolation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockResponse {
    /// Mean closing of the cavity between the plates of this quarter, m/N of the force on
    /// the whole block.
    pub closing: f64,
    /// Largest closing anywhere in the cavity over the mean.
    pub hottest: f64,
    /// In a row: mean closing of the near and of the far cavity of the next block, m/N.
    pub beside: Option<[f64; 2]>,
    /// Number of unknowns.
    pub unknowns: usize,
}

/// Solids of a linear elastic law: Young's modulus, Pa, and Poisson's ratio below 0.5.
pub fn linear(modulus: f64, poisson: f64) -> Material {
    Material {
        law: Law::LinearElastic {
            shear: 0.5 * modulus / (1.0 + poisson),
        },
        volumetric: Volumetric::Quadratic(modulus / (3.0 * (1.0 - 2.0 * poisson))),
    }
}

/// Strain of the bump under the force that is solved: the response is linear to about this
/// share, and large enough above the rounding of the stiff plates.
const STRAIN: f64 = 3e-4;
/// End of the iteration: rounding of the plates' stress leaves 1e-4 of the first step.
const TOLERANCE: f64 = 1e-3;

impl BumpBlock {
    /// The mesh: regions `soft` and `stiff`, the cavity `gap`, the outer faces.
    ///
    /// # Errors
    /// [`MeshError`] for lengths that make no block.
    pub fn mesh(&self, division: BlockDivision) -> Result<Mesh, MeshError> {
        let middle = self.bump_half[0];
        let marks = [
            0.0,
            self.cavity[0],
            self.plate[0],
            middle,
            self.plate[1],
            self.cavity[1],
            self.half,
        ];
        let across = Axis::new(&marks, &division.across.map(Grading::Uniform))?;
        let along = self.along(&marks, &division.across)?;
        let [lower, upper, bump] = division.upward.map(Grading::Uniform);
        let thin = Grading::Uniform(1);
        let floor = -self.air;
        let below = floor - self.insulation;
        let heights = [
            below - self.lower,
            below - self.plate_thickness,
            below,
            floor,
            0.0,
            self.plate_thickness,
            self.upper,
            self.upper + self.bump,
        ];
        let up = Axis::new(&heights, &[lower, thin, thin, thin, thin, upper, bump])?;
        let within = |x: f64, [low, high]: [f64; 2]| low < x && x < high;
        let part = |[x, y, z]: [f64; 3]| {
            let (x, centre) = self.across_axis(x);
            let under_plate = within(x.abs(), self.plate) && within(y, self.plate);
            let plates = [
                [below - self.plate_thickness, below],
                [0.0, self.plate_thickness],
            ];
            let in_cavity = within(x.abs(), self.cavity) && within(y, self.cavity);
            if z > self.upper && (x.abs() > middle || y > middle) {
                Part::Void("beside")
            } else if within(z, [floor, 0.0]) && in_cavity {
                Part::Void(match (centre > 0.0, x < 0.0) {
                    (false, _) => CAVITIES[0],
                    (true, true) => CAVITIES[1],
                    (true, false) => CAVITIES[2],
                })
            } else if under_plate && plates.iter().any(|plate| within(z, *plate)) {
                Part::Region("stiff")
            } else {
                Part::Region("soft")
            }
        };
        let mut mesh = Grid3::new([along, across, up], "soft").mesh_by(&part)?;
        let top = self.upper + self.bump;
        let pressed: Vec<Facet> = mesh.surfaces.get("top").map_or_else(Vec::new, |surface| {
            let own = |facet: &&Facet| {
                let mut nodes = mesh.facet_nodes(**facet);
                nodes.all(|node| mesh.points[node as usize][0] <= self.half)
            };
            surface.iter().filter(own).copied().collect()
        });
        mesh.surfaces.insert("pressed".to_owned(), pressed);
        // The bumps narrow upward: their cells with them.
        let narrow = 1.0 - self.bump_half[1] / self.bump_half[0];
        for point in &mut mesh.points {
            let factor = 1.0 - narrow * (point[2] - self.upper).max(0.0) / (top - self.upper);
            let (x, centre) = self.across_axis(point[0]);
            point[0] = centre + factor * x;
            point[1] *= factor;
        }
        Ok(mesh)
    }

    /// Place along x from the axis of its block, and where that axis is.
    fn across_axis(&self, x: f64) -> (f64, f64) {
        let centre = if x > self.half { 2.0 * self.half } else { 0.0 };
        (x - centre, centre)
    }

    /// Axis along x: marks and cells of the block, then those of the next one, which lie like
    /// the block and its mirror image.
    fn along(&self, marks: &[f64], cells: &[usize]) -> Result<Axis, MeshError> {
        let (mut marks, mut cells) = (marks.to_vec(), cells.to_vec());
        if self.in_row {
            let (own, counts) = (marks.clone(), cells.clone());
            let centre = 2.0 * self.half;
            let back = own.iter().rev().skip(1).map(|mark| centre - mark);
            marks.extend(back.chain(own.iter().skip(1).map(|mark| centre + mark)));
            cells.extend(counts.iter().rev().chain(&counts));
        }
        let gradings: Vec<_> = cells.into_iter().map(Grading::Uniform).collect();
        Axis::new(&marks, &gradings)
    }

    /// Solves the block of a soft and a stiff solid under a small force.
    ///
    /// # Errors
    /// [`Failure`] when the lengths make no block, or the solution fails.
    pub fn solve(
        &self,
        [soft, stiff]: [Material; 2],
        sides: BlockSides,
        force: TopForce,
        division: BlockDivision,
    ) -> Result<BlockResponse, Failure> {
        let mesh = self
            .mesh(division)
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let area = 4.0 * self.bump_half[1] * self.bump_half[1];
        let shear = soft.law.shear_modulus();
        let size = STRAIN * shear * area;
        let problem = pose(mesh, [soft, stiff], sides, force, area)
            .map_err(|error| Failure::at_start(Reason::Problem(error)))?;
        let mut solver = Solver::new(problem)?;
        solver.settings = Settings {
            first_step: 1.0,
            tolerance: TOLERANCE,
            ..Settings::default()
        };
        solver.load_to(&[size], |_, _| Continue::Yes)?;
        let closing = |cavity| {
            let answer = self.closing(&solver, cavity);
            answer.map_err(|error| Failure::at_start(Reason::Problem(error)))
        };
        let [own, largest] = closing(0)?;
        let beside = if self.in_row {
            Some([closing(1)?[0] / size, closing(2)?[0] / size])
        } else {
            None
        };
        Ok(BlockResponse {
            closing: own / size,
            hottest: largest / own,
            beside,
            unknowns: solver.unknowns(),
        })
    }

    /// Mean closing between the plates and largest closing in a cavity, m.
    fn closing(&self, solver: &Solver, cavity: usize) -> Result<[f64; 2], ProblemError> {
        let problem = solver.problem();
        let mesh = &problem.mesh;
        let moved = &solver.state().displacement;
        let inside = |[x, y, _]: [f64; 3]| {
            let x = self.across_axis(x).0.abs();
            [x, y]
                .iter()
                .all(|x| (self.plate[0]..=self.plate[1]).contains(x))
        };
        let mut mean = 0.0;
        let mut columns = BTreeMap::<[i64; 2], f64>::new();
        for (face, sign) in [("floor", 1.0), ("roof", -1.0)] {
            let name = &format!("{}.{face}", CAVITIES[cavity]);
            let surface = problem.surface(name)?;
            let over = |facets: &[Facet]| {
                let up = |place| [0.0, 0.0, if inside(place) { 1.0 } else { 0.0 }];
                traction(mesh, problem.kinematics, facets, up)
            };
            let weights = over(&surface);
            let whole: f64 = weights.iter().map(|(_, weight)| weight[2]).sum();
            let sum: f64 = weights
                .iter()
                .map(|(node, weight)| weight[2] * moved[*node as usize][2])
                .sum();
            mean += sign * sum / whole;
            for node in mesh.nodes_of(name).unwrap_or_default() {
                let [x, y, _] = mesh.points[node as usize];
                // Places of one column are equal up to rounding.
                let key = [x, y].map(|x| (x / self.half * 1e9).round() as i64);
                *columns.entry(key).or_default() += sign * moved[node as usize][2];
            }
        }
        let largest = columns.into_values().fold(f64::NEG_INFINITY, f64::max);
        Ok([mean, largest])
    }
}

fn pose(
    mesh: Mesh,
    [soft, stiff]: [Material; 2],
    sides: BlockSides,
    force: TopForce,
    area: f64,
) -> Result<Problem, ProblemError> {
    let mut problem = Problem::new(mesh, Kinematics::Solid)?;
    let regions = problem.mesh.regions.iter();
    problem.materials = regions
        .map(|name| if name == "stiff" { stiff } else { soft })
        .collect();
    problem.clamp("bottom")?;
    problem.support("front", 1, Motion::Fixed)?;
    match force {
        TopForce::Normal => problem.support("left", 0, Motion::Fixed)?,
        TopForce::Side => {
            problem.support("left", 1, Motion::Fixed)?;
            problem.support("left", 2, Motion::Fixed)?;
        }
    }
    if sides == BlockSides::Symmetric {
        problem.support("back", 1, Motion::Fixed)?;
        problem.support("right", 0, Motion::Fixed)?;
    }
    let parameter = problem.parameter("force", Rule::Given);
    let top = problem.surface("pressed")?;
    let pull = match force {
        TopForce::Normal => [0.0, 0.0, -1.0 / area],
        TopForce::Side => [1.0 / area, 0.0, 0.0],
    };
    problem.dead_loads.push(DeadLoad {
        forces: traction(&problem.mesh, problem.kinematics, &top, |_| pull),
        parameter,
    });
    Ok(problem)
}
