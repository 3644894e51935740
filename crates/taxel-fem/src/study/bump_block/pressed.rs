//! The block under a force on the flat top at large strain: how its cavities close, where floor
//! and roof touch first, and how they lie on each other beyond.

use super::half::{Mirror, pose};
use super::{BlockDivision, BlockSides, BumpBlock, CAVITIES};
use crate::material::Material;
use crate::mesh::{Facet, FacetShape, Mesh};
use crate::problem::contact::{facing_pairs, lattice_points};
use crate::problem::{Contact, Parameter, WallPoint, Walls};
use crate::solver::failure::{Failure, Reason};
use crate::solver::newton::{Continue, Solver};

/// Permittivity of vacuum, F/m (CODATA 2022).
const VACUUM: f64 = 8.854_187_818_8e-12;
/// Stiffness of floor on roof, times height of the cavity over shear modulus of the elastomer.
const CONTACT_STIFFNESS: f64 = 300.0;
/// Overlap that is accepted, over the height of the cavity.
const OVERLAP: f64 = 1e-3;
/// Largest step of the way to a force.
const LARGEST_STEP: f64 = 0.5;
/// Share of the way to the expected first touch that the search for it goes, each time.
const APPROACH: f64 = 0.95;
/// Least gap over the cavity's height from which on it is taken to fall in proportion.
const NEAR: f64 = 0.08;
/// Solutions in search of the first touch.
const SEARCHES: usize = 12;
/// Share of the expected first touch from which on it is looked for before a force is applied.
const EARLY: f64 = 0.97;

/// What the block is made of and how it is cut into cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressedBlock {
    /// Soft and stiff solid.
    pub solids: [Material; 2],
    /// What holds the outer faces.
    pub sides: BlockSides,
    /// Numbers of cells.
    pub division: BlockDivision,
    /// Relative permittivity of the insulation.
    pub permittivity: f64,
}

/// The block under one force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// Force on the top of the whole block, N.
    pub force: f64,
    /// Mean closing of the cavity between the plates, m.
    pub closing: f64,
    /// Least gap in the cavity, m; negative within the overlap that is accepted.
    pub least_gap: f64,
    /// Where it is at rest, x and y from the axis, m.
    pub least_at: [f64; 2],
    /// Share of the area between the plates on which floor and roof touch.
    pub touching: f64,
    /// Capacitance between the plates without edges, F: ε₀ ∫ dA/(air + insulation/ε_r) over the
    /// distances after deformation.
    pub capacitance: f64,
    /// Mean air gap along the edges of the plate next to the walls and along the outer ones, m.
    pub edge_gaps: [f64; 2],
}

/// A point of the area between the plates.
struct Column {
    /// Number of the point in the contact of floor and roof.
    contact: usize,
    /// From the insulation's upper face to the plate under it.
    insulation: WallPoint,
}

/// The problem of the pressed block.
struct Press<'b> {
    block: &'b BumpBlock,
    permittivity: f64,
    solver: Solver,
    top: Parameter,
    columns: Vec<Column>,
    /// Close to each other over the whole cavity, with their place at rest.
    lattice: Vec<(WallPoint, [f64; 2])>,
    /// Pairs on the edges of the plate: next to the walls, outer.
    edges: [Vec<WallPoint>; 2],
}

/// The block under rising forces.
#[derive(Clone, Debug)]
pub struct PressedPath {
    /// The block under each force that was reached.
    pub states: Vec<Pressed>,
    /// The block at the force at which floor and roof of a cavity touch first; none below it.
    pub touch: Option<Pressed>,
    /// Why the path ends before the last force; none where it does not.
    pub ended: Option<Failure>,
}

impl BumpBlock {
    /// The block at the force at which floor and roof of a cavity touch first, vented, at large
    /// strain.
    ///
    /// # Errors
    /// [`Failure`] when the lengths make no block, or the solution ends before.
    pub fn first_touch(&self, of: &PressedBlock) -> Result<Pressed, Failure> {
        let mut press = Press::pose(self, of)?;
        let rest = press.now();
        let share = press.linear_touch()?;
        press.touch(rest, share)
    }

    /// The block under rising forces on its top, N, vented, at large strain, and its deformed quarter
    /// under the last of them that was reached; `seen` hears each state.
    ///
    /// # Errors
    /// [`Failure`] when the lengths make no block.
    pub fn press(
        &self,
        of: &PressedBlock,
        forces: &[f64],
        mut seen: impl FnMut(&Pressed),
    ) -> Result<(PressedPath, Solver), Failure> {
        let mut press = Press::pose(self, of)?;
        let mut below = press.now();
        let mut expected = press.linear_touch()?;
        let mut path = PressedPath {
            states: Vec::new(),
            touch: None,
            ended: None,
        };
        for force in forces {
            if path.touch.is_none() && *force >= EARLY * expected {
                match press.touch(below, expected) {
                    Ok(touch) => path.touch = Some(touch),
                    Err(failure) => path.ended = Some(failure),
                }
            }
            if path.ended.is_some() {
                break;
            }
            match press.to(*force) {
                Ok(found) => {
                    seen(&found);
                    if path.touch.is_none() {
                        expected = below.touch_after(&found);
                        below = found;
                    }
                    path.states.push(found);
                }
                Err(failure) => path.ended = Some(failure),
            }
        }
        if path.states.iter().all(|state| state.least_gap > 0.0) {
            path.touch = None;
        }
        Ok((path, press.solver))
    }
}

impl Pressed {
    /// Force at which the least gap would be gone in proportion to its change from here to
    /// `next`.
    fn touch_after(&self, next: &Self) -> f64 {
        let fall = (self.least_gap - next.least_gap) / (next.force - self.force);
        next.force + next.least_gap / fall
    }
}

impl<'b> Press<'b> {
    fn pose(block: &'b BumpBlock, of: &PressedBlock) -> Result<Self, Failure> {
        let mesh = block
            .mesh(of.division)
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let (mut problem, loads) = pose(block, mesh, of.solids, of.sides, Mirror::Same)
            .map_err(|error| Failure::at_start(Reason::Problem(error)))?;
        let mesh = &problem.mesh;
        let [gap, ..] = CAVITIES;
        let floor = mesh.surfaces.get(&format!("{gap}.floor"));
        let floor = floor.cloned().unwrap_or_default();
        let roof = mesh.nodes_of(&format!("{gap}.roof")).unwrap_or_default();
        let gauss = FacetShape::Quad9.quadrature();
        let walls = Walls {
            points: facing_pairs(mesh, &floor, roof.clone(), &gauss),
            stiffness: CONTACT_STIFFNESS * of.solids[0].law.shear_modulus() / block.air,
            overlap_limit: OVERLAP * block.air,
        };
        let on_plate = |facet: &Facet| {
            let [near, far] = block.plate;
            let middle = middle(mesh, mesh.facet_nodes(*facet));
            middle.iter().all(|x| near < *x && *x < far)
        };
        let below = -block.air - block.insulation;
        let plate = (0_u32..)
            .zip(&mesh.points)
            .filter(|(_, point)| (point[2] - below).abs() <= 1e-3 * block.insulation)
            .map(|(node, _)| node);
        let plate: Vec<u32> = plate.collect();
        let mut columns = Vec::new();
        for (number, facet) in floor.iter().enumerate() {
            if on_plate(facet) {
                let under = facing_pairs(mesh, &[*facet], plate.iter().copied(), &gauss);
                columns.extend(
                    under
                        .into_iter()
                        .enumerate()
                        .map(|(point, insulation)| Column {
                            contact: number * gauss.len() + point,
                            insulation,
                        }),
                );
            }
        }
        let lattice: Vec<_> = facing_pairs(mesh, &floor, roof, &lattice_points())
            .into_iter()
            .map(|pair| {
                let place = place(mesh, &pair);
                (pair, place)
            })
            .collect();
        let [near, far] = block.plate;
        let on = |edge: f64| -> Vec<WallPoint> {
            let same = |x: f64| (x - edge).abs() <= 1e-6 * far;
            let within = |x: f64| near * (1.0 - 1e-6) <= x && x <= far * (1.0 + 1e-6);
            let own = lattice
                .iter()
                .filter(|(_, [x, y])| within(*x) && within(*y) && (same(*x) || same(*y)));
            own.map(|(pair, _)| pair.clone()).collect()
        };
        let edges = [on(near), on(far)];
        problem.contacts.push(Contact::Walls(walls));
        let mut solver = Solver::new(problem)?;
        solver.settings.largest_step = LARGEST_STEP;
        Ok(Self {
            block,
            permittivity: of.permittivity,
            solver,
            top: loads.top,
            columns,
            lattice,
            edges,
        })
    }

    /// The force at which floor and roof would touch by linear elasticity, N.
    fn linear_touch(&mut self) -> Result<f64, Failure> {
        let slope = self.solver.linear_response(self.top)?.displacement;
        let points = &self.solver.problem().mesh.points;
        let moved: Vec<[f64; 3]> = points
            .iter()
            .zip(&slope)
            .map(|(point, slope)| std::array::from_fn(|d| point[d] + slope[d]))
            .collect();
        let closing = self.lattice.iter();
        let closing = closing.map(|(pair, _)| pair.gap(points) - pair.gap(&moved));
        Ok(self.block.air / closing.fold(f64::MIN_POSITIVE, f64::max))
    }

    /// Loads to the first touch from a state before it, by a force at which it is expected.
    fn touch(&mut self, mut below: Pressed, expected: f64) -> Result<Pressed, Failure> {
        let mut force = below.force + APPROACH * (expected - below.force);
        for _ in 0..SEARCHES {
            let state = self.solver.state().clone();
            let targets = self.solver.targets().to_vec();
            let found = self.to(force)?;
            if found.least_gap <= 0.0 {
                self.solver.restart(state, targets);
                force = f64::midpoint(below.force, force);
                continue;
            }
            let touch = below.touch_after(&found);
            if found.least_gap < NEAR * self.block.air {
                return self.to(touch);
            }
            below = found;
            force = found.force + APPROACH * (touch - found.force);
        }
        Ok(below)
    }

    /// Loads to a force; where the solution ends before, the block stays as it was.
    fn to(&mut self, force: f64) -> Result<Pressed, Failure> {
        let before = (self.solver.state().clone(), self.solver.targets().to_vec());
        let mut targets = before.1.clone();
        if (targets[self.top.0] - force).abs() > 0.0 {
            targets[self.top.0] = force;
            if let Err(failure) = self.solver.load_to(&targets, |_, _| Continue::Yes) {
                self.solver.restart(before.0, before.1);
                return Err(failure);
            }
        }
        Ok(self.now())
    }

    /// The block as it is.
    fn now(&self) -> Pressed {
        let state = self.solver.state();
        let places = state.places(&self.solver.problem().mesh);
        let gaps = self.lattice.iter();
        let gaps = gaps.map(|(pair, at)| (pair.gap(&places), *at));
        let least = gaps.fold((f64::INFINITY, [0.0; 2]), |least, here| {
            if here.0 < least.0 { here } else { least }
        });
        let contact = self.solver.contact(0);
        let [mut area, mut sum, mut touching, mut inverse] = [0.0; 4];
        for column in &self.columns {
            let [weight, air, pressure] = [
                contact.areas[column.contact],
                contact.gaps[column.contact],
                contact.pressures[column.contact],
            ];
            let insulation = column.insulation.gap(&places).abs();
            area += weight;
            sum += weight * air;
            touching += if pressure > 0.0 { weight } else { 0.0 };
            inverse += weight / (air.max(0.0) + insulation / self.permittivity);
        }
        let mean = |pairs: &[WallPoint]| {
            let gaps = pairs.iter().map(|pair| pair.gap(&places).max(0.0));
            gaps.sum::<f64>() / pairs.len() as f64
        };
        Pressed {
            force: state.parameters[self.top.0],
            closing: self.block.air - sum / area,
            least_gap: least.0,
            least_at: least.1,
            touching: touching / area,
            capacitance: VACUUM * inverse,
            edge_gaps: [mean(&self.edges[0]), mean(&self.edges[1])],
        }
    }
}

/// Mean of the places of some nodes, x and y.
fn middle(mesh: &Mesh, nodes: impl Iterator<Item = u32>) -> [f64; 2] {
    let nodes: Vec<u32> = nodes.collect();
    std::array::from_fn(|axis| {
        let sum: f64 = nodes
            .iter()
            .map(|node| mesh.points[*node as usize][axis])
            .sum();
        sum / nodes.len() as f64
    })
}

/// Place of a pair at rest, x and y: of the floor's half of its nodes.
fn place(mesh: &Mesh, pair: &WallPoint) -> [f64; 2] {
    let factors = pair.nodes.iter().zip(&pair.difference);
    factors.fold([0.0; 2], |sum, (node, factor)| {
        let point = mesh.points[*node as usize];
        // The roof counts with one sign, the floor with the other.
        let sign = if point[2] < 0.0 { -factor } else { 0.0 };
        [sum[0] + sign * point[0], sum[1] + sign * point[1]]
    })
}
