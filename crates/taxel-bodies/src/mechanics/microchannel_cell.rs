//! A layer with a row of voids under pressure: how the voids close.

use taxel_fem::assembly::folds::{FOLDING, folds};
use taxel_fem::material::Material;
use taxel_fem::mesh::{Facet, FacetShape, Mesh, VoidCell};
use taxel_fem::problem::Kinematics;
use taxel_fem::problem::{
    Cavity, CavityLaw, Contact, Motion, Pairing, Parameter, Pressure, Problem, Quantity, Rule,
    WallPoint, Walls,
};
use taxel_fem::solver::failure::{Failure, Reason};
use taxel_fem::solver::newton::{Continue, Settings, Solver};

/// Contents of the void.
#[derive(Clone, Debug, PartialEq)]
pub enum Filling {
    /// Nothing that resists.
    Vented,
    /// A pressure that follows the area, by points of area ratio and pressure in Pa.
    Tabulated(Vec<(f64, f64)>),
    /// A trapped gas at a pressure scale in Pa: `p = s (A0/A - 1)`.
    Gas(f64),
    /// Something that keeps its volume.
    Sealed,
}

/// Stiffness of the contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallContact {
    /// Stiffness of folding corners over the shear modulus.
    pub folding: f64,
    /// Stiffness of roof on floor, times height over shear modulus.
    pub opposite: f64,
    /// Overlap of roof and floor that is accepted, over the height.
    pub overlap: f64,
}

impl Default for WallContact {
    fn default() -> Self {
        Self {
            folding: FOLDING,
            opposite: 300.0,
            overlap: 2e-3,
        }
    }
}

/// One answer: the void at one load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closure {
    /// Pressure on the top, Pa.
    pub pressure: f64,
    /// Pressure in the void, Pa.
    pub inside: f64,
    /// Area over its value at rest.
    pub area_ratio: f64,
    /// Smallest distance between roof and floor at equal undeformed place, m.
    pub gap: f64,
    /// True if roof and floor touch: pressed against each other they may overlap or stand apart by what
    /// the contact accepts.
    pub touches: bool,
    /// Length of each wall that has folded onto the other at the upper corner, m.
    pub fold: f64,
    /// Greatest von Mises stress, Pa.
    pub stress: f64,
}

/// Half a cell with its void, bonded below, loaded all over the top.
pub struct VoidStudy {
    /// The problem being solved.
    pub solver: Solver,
    top: Parameter,
    rest: f64,
    /// Pairs of roof and floor close to each other, where the gap is looked at.
    facing: Vec<WallPoint>,
    folding: Option<usize>,
}

impl VoidStudy {
    /// Poses the problem.
    ///
    /// # Errors
    /// When the lengths make no cell.
    pub fn new(
        cell: &VoidCell,
        material: Material,
        filling: &Filling,
        contact: WallContact,
    ) -> Result<Self, Failure> {
        let mesh = cell
            .mesh()
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        Self::on_mesh(mesh, material, filling, contact)
    }

    /// Poses the problem of the ellipse as wide and as high as the void of the cell
    /// ([`VoidCell::elliptic_mesh`]).
    ///
    /// # Errors
    /// When the lengths make no cell.
    pub fn elliptic(
        cell: &VoidCell,
        material: Material,
        filling: &Filling,
        contact: WallContact,
    ) -> Result<Self, Failure> {
        let mesh = cell
            .elliptic_mesh()
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        Self::on_mesh(mesh, material, filling, contact)
    }

    /// Poses the problem on a mesh with the names of a [`VoidCell`].
    ///
    /// # Errors
    /// When the mesh lacks a name.
    fn on_mesh(
        mesh: Mesh,
        material: Material,
        filling: &Filling,
        contact: WallContact,
    ) -> Result<Self, Failure> {
        let problem_error = |error| Failure::at_start(Reason::Problem(error));
        let mut problem = Problem::new(mesh, Kinematics::PlaneStrain).map_err(problem_error)?;
        problem.materials = vec![material; problem.mesh.regions.len()];
        let mut pose = || {
            problem.clamp("bottom")?;
            problem.support("left", 0, Motion::Fixed)?;
            problem.support("right", 0, Motion::Fixed)?;
            let top = problem.parameter("pressure on the top", Rule::Given);
            let inside = problem.parameter("pressure in the void", Rule::Given);
            problem.pressures.push(Pressure {
                surface: problem.surface("top")?,
                parameter: top,
            });
            problem.cavities.push(Cavity {
                wall: problem.surface("void")?,
                axis: 0,
                origin: 0.0,
                pressure: inside,
            });
            Ok((top, inside))
        };
        let (top, inside) = pose().map_err(problem_error)?;
        let rest =
            problem.cavities[0].volume(&problem.mesh, problem.kinematics, &problem.mesh.points);
        problem.set_rule(
            inside,
            match filling {
                Filling::Vented => Rule::Given,
                Filling::Gas(scale) => Rule::Follows(
                    0,
                    CavityLaw::Gas {
                        scale: *scale,
                        rest,
                    },
                ),
                Filling::Tabulated(points) => Rule::Follows(
                    0,
                    CavityLaw::Tabulated {
                        points: points.clone(),
                        rest,
                    },
                ),
                Filling::Sealed => Rule::Prescribes(Quantity::Volume(0)),
            },
        );
        let shear = material.law().shear_modulus();
        let mut folding = None;
        let void = problem.surface("void").map_err(problem_error)?;
        let walls = folds(&problem, &void, contact.folding * shear);
        // A rounded corner has no vertex about which its walls turn.
        if !walls.points.is_empty() {
            folding = Some(problem.contacts.len());
            problem.contacts.push(Contact::Walls(walls));
        }
        problem.contacts.push(Contact::Walls(roof_on_floor_walls(
            &problem.mesh,
            shear,
            contact,
        )));
        let facing = facing_pairs(&problem.mesh, &GAP_POINTS);
        let mut solver = Solver::new(problem)?;
        solver.settings = Settings {
            first_step: 0.1,
            ..Settings::default()
        };
        Ok(Self {
            solver,
            top,
            rest,
            facing,
            folding,
        })
    }

    /// Raises the pressure on the top to a value in Pa.
    ///
    /// # Errors
    /// When the solution fails on the way.
    pub fn press(&mut self, pressure: f64) -> Result<Closure, Failure> {
        self.press_while(pressure, &mut || true)
    }

    /// The same as long as `go_on` says so, which is asked after each step.
    ///
    /// # Errors
    /// As [`Self::press`].
    pub fn press_while(
        &mut self,
        pressure: f64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Closure, Failure> {
        self.control(Rule::Given)?;
        self.load_to(pressure, go_on)
    }

    /// Finds the pressure on the top that brings an area ratio.
    ///
    /// # Errors
    /// When the solution fails on the way.
    pub fn close(&mut self, area_ratio: f64) -> Result<Closure, Failure> {
        self.close_while(area_ratio, &mut || true)
    }

    /// The same as long as `go_on` says so, which is asked after each step.
    ///
    /// # Errors
    /// As [`Self::close`].
    pub fn close_while(
        &mut self,
        area_ratio: f64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Closure, Failure> {
        self.control(Rule::Prescribes(Quantity::Volume(0)))?;
        self.load_to(area_ratio * self.rest, go_on)
    }

    fn control(&mut self, rule: Rule) -> Result<(), Failure> {
        if self.solver.problem().rules()[self.top.0] == rule {
            return Ok(());
        }
        self.solver.set_rule(self.top, rule)
    }

    fn load_to(
        &mut self,
        target: f64,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Closure, Failure> {
        let mut targets = self.solver.targets().to_vec();
        targets[self.top.0] = target;
        self.solver.load_to(&targets, |_, _| {
            if go_on() {
                Continue::Yes
            } else {
                Continue::Stop
            }
        })?;
        self.closure()
    }

    /// The void at the present state.
    ///
    /// # Errors
    /// When the state is not valid.
    pub fn closure(&mut self) -> Result<Closure, Failure> {
        let area = self.solver.evaluate()?.volumes[0];
        let state = self.solver.state();
        let problem = self.solver.problem();
        let places = state.places(&problem.mesh);
        let gaps = self.facing.iter().map(|pair| pair.gap(&places));
        let gap = gaps.fold(f64::INFINITY, f64::min);
        let pressed = problem
            .contacts
            .iter()
            .enumerate()
            .any(|(number, contact)| {
                let Contact::Walls(walls) = contact else {
                    return false;
                };
                let pressures = self.solver.contact(number).pressures;
                walls.points.iter().zip(pressures).any(|(point, pressure)| {
                    matches!(point.pairing, Pairing::Opposite(_)) && pressure > 0.0
                })
            });
        let fold = self.folding.map_or(0.0, |number| {
            let Contact::Walls(walls) = &problem.contacts[number] else {
                return 0.0;
            };
            let folded = walls.points.iter().filter_map(|point| match point.pairing {
                Pairing::Folding { arm, .. } if point.gap(&places) < 0.0 => Some(arm),
                _ => None,
            });
            folded.fold(0.0, f64::max)
        });
        Ok(Closure {
            pressure: state.parameters[0],
            inside: state.parameters[1],
            area_ratio: area / self.rest,
            gap,
            touches: pressed || gap <= 0.0,
            fold,
            stress: self
                .solver
                .greatest_stress()
                .map_or(0.0, |peak| peak.von_mises),
        })
    }
}

/// Places along an edge (with no weight) at which the gap is looked at: its ends, its middle and
/// points between. It is least at a plane of symmetry, where no contact point lies.
const GAP_POINTS: [(f64, f64); 9] = [
    (-1.0, 0.0),
    (-0.75, 0.0),
    (-0.5, 0.0),
    (-0.25, 0.0),
    (0.0, 0.0),
    (0.25, 0.0),
    (0.5, 0.0),
    (0.75, 0.0),
    (1.0, 0.0),
];

/// Pairs of points of roof and floor at equal undeformed place, at these places and weights of
/// each edge of the floor.
fn facing_pairs(mesh: &Mesh, at: &[(f64, f64)]) -> Vec<WallPoint> {
    let side = |name: &str| mesh.surfaces.get(name).cloned().unwrap_or_default();
    let (roof, floor) = (side("void.roof"), side("void.floor"));
    let mut points = Vec::new();
    for facet in floor {
        let below: Vec<u32> = mesh.facet_nodes(facet).collect();
        let x = |node: u32| mesh.points[node as usize];
        let length = (x(below[1])[0] - x(below[0])[0]).abs();
        for &(on_edge, weight) in at {
            let values = FacetShape::Line3.shapes([on_edge, 0.0, 0.0]).values;
            let place: f64 = below.iter().zip(&values).map(|(&n, v)| v * x(n)[0]).sum();
            let Some((above, over)) = find_above(mesh, &roof, place) else {
                continue;
            };
            let over = FacetShape::Line3.shapes([over, 0.0, 0.0]).values;
            let lower: Vec<_> = (0..3).map(|n| (below[n], values[n], 0.0)).collect();
            let upper: Vec<_> = (0..3).map(|n| (above[n], over[n], 0.0)).collect();
            points.push(WallPoint::new(
                &lower,
                &upper,
                weight * length / 2.0,
                Pairing::Opposite([0.0, 1.0, 0.0]),
            ));
        }
    }
    points
}

/// The contact of roof and floor.
fn roof_on_floor_walls(mesh: &Mesh, shear: f64, contact: WallContact) -> Walls {
    let quadrature = FacetShape::Line3.quadrature().into_iter();
    let at: Vec<(f64, f64)> = quadrature
        .map(|point| (point.at[0], point.weight))
        .collect();
    let points = facing_pairs(mesh, &at);
    let gaps = points.iter().map(|pair| pair.gap(&mesh.points));
    // A round void is less high toward its sides.
    let height = gaps.fold(0.0, f64::max);
    Walls {
        points,
        stiffness: contact.opposite * shear / height,
        overlap_limit: contact.overlap * height,
    }
}

/// The edge of the roof over a place, and where on it.
fn find_above(mesh: &Mesh, roof: &[Facet], place: f64) -> Option<(Vec<u32>, f64)> {
    roof.iter().find_map(|&facet| {
        let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
        let (a, b) = (
            mesh.points[nodes[0] as usize][0],
            mesh.points[nodes[1] as usize][0],
        );
        let at = (2.0 * place - a - b) / (b - a);
        (at.abs() <= 1.0 + 1e-9).then_some((nodes, at.clamp(-1.0, 1.0)))
    })
}
