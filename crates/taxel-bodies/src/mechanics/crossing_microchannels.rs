//! Two rows of voids that cross above each other, in three dimensions.

use taxel_fem::assembly::folds::folds;
use taxel_fem::field::sections::{sections, slender_resistance};
use taxel_fem::material::Material;
use taxel_fem::mesh::{CrossingVoids, FacetShape, Mesh, QuadraturePoint};
use taxel_fem::problem::Kinematics;
use taxel_fem::problem::contact::{facing_pairs, lattice_points};
use taxel_fem::problem::{
    Cavity, CavityLaw, Contact, Motion, Parameter, Pressure, Problem, ProblemError, Rule,
    WallPoint, Walls,
};
use taxel_fem::solver::failure::{Failure, Reason};
use taxel_fem::solver::newton::{Continue, Solver};

use super::microchannel_cell::{Filling, WallContact};

/// The voids at one load; upper row first, then the lower one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Pressure on the top, Pa.
    pub pressure: f64,
    /// Pressure in the voids, Pa.
    pub inside: [f64; 2],
    /// Volume over its value at rest.
    pub volume_ratio: [f64; 2],
    /// Area of the thinnest section over its value at rest (uniform load: over the
    /// middle of the solid between the voids of the other row).
    pub thinnest: [f64; 2],
    /// Area of the thickest section over its value at rest (at the crossing).
    pub thickest: [f64; 2],
    /// Resistance of a conductor in the void over that at rest, by its sections.
    pub resistance_ratio: [f64; 2],
    /// Smallest distance between roof and floor, m; of an elliptic void where they are at least
    /// half its height apart at rest.
    pub gap: [f64; 2],
    /// The same at rest.
    pub rest_gap: [f64; 2],
    /// Greatest von Mises stress, Pa.
    pub stress: f64,
}

/// A quarter of the cell between the middles of crossing and solid, bonded below.
pub struct CrossingStudy {
    /// The problem being solved.
    pub solver: Solver,
    top: Parameter,
    rest: [f64; 2],
    /// Pairs of roof and floor of each row, close to each other, where the gap is looked at.
    facing: [Vec<WallPoint>; 2],
}

/// The rows: name of the void, axis along which it runs.
const ROWS: [(&str, usize); 2] = [("upper", 0), ("lower", 1)];

impl CrossingStudy {
    /// Poses the problem with a uniform pressure on the top.
    ///
    /// # Errors
    /// When the lengths make no cell.
    pub fn new(
        cell: &CrossingVoids,
        material: Material,
        filling: &Filling,
        contact: WallContact,
    ) -> Result<Self, Failure> {
        let mesh = cell
            .mesh()
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let posed = Self::pose(mesh, material, filling, contact);
        posed.map_err(|error| Failure::at_start(Reason::Problem(error)))?
    }

    fn pose(
        mesh: Mesh,
        material: Material,
        filling: &Filling,
        contact: WallContact,
    ) -> Result<Result<Self, Failure>, ProblemError> {
        let mut problem = Problem::new(mesh, Kinematics::Solid)?;
        problem.materials = vec![material; problem.mesh.regions.len()];
        problem.clamp("bottom")?;
        for (side, component) in [("left", 0), ("right", 0), ("front", 1), ("back", 1)] {
            problem.support(side, component, Motion::Fixed)?;
        }
        let top = problem.parameter("pressure on the top", Rule::Given);
        problem.pressures.push(Pressure {
            surface: problem.surface("top")?,
            parameter: top,
        });
        let mut rest = [0.0; 2];
        for (number, (name, _)) in ROWS.into_iter().enumerate() {
            let pressure = problem.parameter(&format!("pressure in the {name} void"), Rule::Given);
            let cavity = Cavity {
                wall: problem.surface(name)?,
                axis: 2,
                origin: 0.0,
                pressure,
            };
            rest[number] = cavity.volume(&problem.mesh, problem.kinematics, &problem.mesh.points);
            problem.cavities.push(cavity);
            problem.set_rule(pressure, rule(filling, number, rest[number]));
            let shear = material.law().shear_modulus();
            close_void(&mut problem, name, shear, contact)?;
        }
        let facing = ROWS.map(|(name, _)| facing_in_the_middle(&problem.mesh, name));
        Ok(Solver::new(problem).map(|solver| Self {
            solver,
            top,
            rest,
            facing,
        }))
    }

    /// Raises the pressure on the top to a value in Pa.
    ///
    /// # Errors
    /// When the solution fails on the way.
    pub fn press(&mut self, pressure: f64) -> Result<Crossing, Failure> {
        let mut targets = self.solver.targets().to_vec();
        targets[self.top.0] = pressure;
        self.solver.load_to(&targets, |_, _| Continue::Yes)?;
        self.crossing()
    }

    /// The voids at the present state.
    ///
    /// # Errors
    /// When the state is not valid.
    pub fn crossing(&mut self) -> Result<Crossing, Failure> {
        let volumes = self.solver.evaluate()?.volumes;
        let state = self.solver.state();
        let mesh = &self.solver.problem().mesh;
        let places = state.places(mesh);
        let mut crossing = Crossing {
            pressure: state.parameters[0],
            inside: [state.parameters[1], state.parameters[2]],
            volume_ratio: [0.0; 2],
            thinnest: [0.0; 2],
            thickest: [0.0; 2],
            resistance_ratio: [0.0; 2],
            gap: [0.0; 2],
            rest_gap: [0.0; 2],
            stress: self
                .solver
                .greatest_stress()
                .map_or(0.0, |peak| peak.von_mises),
        };
        for (row, (name, along)) in ROWS.into_iter().enumerate() {
            crossing.volume_ratio[row] = volumes[row] / self.rest[row];
            let mut axis = [0.0; 3];
            axis[along] = 1.0;
            let sections = |displacement| {
                sections(mesh, name, displacement, axis)
                    .map_err(|error| Failure::at_start(Reason::Field(error)))
            };
            let rest = sections(None)?;
            let now = sections(Some(&state.displacement))?;
            let ratios = rest
                .iter()
                .zip(&now)
                .map(|(rest, now)| now.area / rest.area);
            crossing.thinnest[row] = ratios.clone().fold(f64::INFINITY, f64::min);
            crossing.thickest[row] = ratios.fold(0.0, f64::max);
            crossing.resistance_ratio[row] =
                slender_resistance(1.0, &now) / slender_resistance(1.0, &rest);
            crossing.gap[row] = gap_of(&self.facing[row], &places, f64::min);
            crossing.rest_gap[row] = gap_of(&self.facing[row], &mesh.points, f64::min);
        }
        Ok(crossing)
    }
}

pub(super) fn rule(filling: &Filling, cavity: usize, rest: f64) -> Rule {
    match filling {
        Filling::Vented => Rule::Given,
        Filling::Gas(scale) => Rule::Follows(
            cavity,
            CavityLaw::Gas {
                scale: *scale,
                rest,
            },
        ),
        Filling::Tabulated(points) => Rule::Follows(
            cavity,
            CavityLaw::Tabulated {
                points: points.clone(),
                rest,
            },
        ),
        Filling::Sealed => Rule::Prescribes(taxel_fem::problem::Quantity::Volume(cavity)),
    }
}

/// Pairs of points of roof and floor at equal undeformed place, at these points of each facet of
/// the floor.
pub(super) fn roof_above_floor(mesh: &Mesh, name: &str, at: &[QuadraturePoint]) -> Vec<WallPoint> {
    let floor = mesh.surfaces.get(&format!("{name}.floor"));
    let roof = mesh.nodes_of(&format!("{name}.roof")).unwrap_or_default();
    facing_pairs(mesh, floor.map_or(&[], Vec::as_slice), roof, at)
}

/// Pairs of roof and floor close to each other, where the gap is looked at: of a round void those at
/// least half as far apart as in its middle, of a rectangular one all.
pub(super) fn facing_in_the_middle(mesh: &Mesh, name: &str) -> Vec<WallPoint> {
    let mut facing = roof_above_floor(mesh, name, &lattice_points());
    let height = gap_of(&facing, &mesh.points, f64::max);
    facing.retain(|pair| pair.gap(&mesh.points) >= 0.5 * height);
    facing
}

/// Least or greatest gap of pairs at these places.
fn gap_of(facing: &[WallPoint], places: &[[f64; 3]], better: fn(f64, f64) -> f64) -> f64 {
    let gaps = facing.iter().map(|pair| pair.gap(places));
    gaps.reduce(better).unwrap_or(f64::INFINITY)
}

/// The contacts of a void: roof on floor, and the walls that fold about its edges.
pub(super) fn close_void(
    problem: &mut Problem,
    name: &str,
    shear: f64,
    contact: WallContact,
) -> Result<(), ProblemError> {
    let walls = roof_on_floor(&problem.mesh, name, shear, contact);
    problem.contacts.push(Contact::Walls(walls));
    let walls = folds(problem, &problem.surface(name)?, contact.folding * shear);
    if !walls.points.is_empty() {
        problem.contacts.push(Contact::Walls(walls));
    }
    Ok(())
}

/// The contact of roof and floor.
fn roof_on_floor(mesh: &Mesh, name: &str, shear: f64, contact: WallContact) -> Walls {
    let points = roof_above_floor(mesh, name, &FacetShape::Quad9.quadrature());
    let gaps = points.iter().map(|pair| pair.gap(&mesh.points));
    // A round void is less high toward its sides.
    let height = gaps.fold(0.0, f64::max);
    Walls {
        points,
        stiffness: contact.opposite * shear / height,
        overlap_limit: contact.overlap * height,
    }
}
