//! A block with two crossing rows of voids under pressures on parts of its top, or
//! under round punches.
//!
//! The voids run through to the sides of the block. There each is closed by a cap that
//! has no stiffness and passes nothing on: the block is as a piece cut out of a sheet,
//! and what is inside is counted up to the straight line between the ends of the side
//! walls.

use taxel_fem::field::sections::{sections, slender_resistance};
use taxel_fem::material::Material;
use taxel_fem::mesh::{Footprint, VOID_ROWS, VoidBlock};
use taxel_fem::problem::Kinematics;
use taxel_fem::problem::{
    Cavity, Contact, Motion, Obstacle, Parameter, Pressure, Problem, ProblemError, Quantity, Rule,
    Shape, WallPoint,
};
use taxel_fem::solver::failure::{Failure, Reason};
use taxel_fem::solver::newton::{Continue, Settings, Solver};

use super::crossing_microchannels::{close_void, facing_in_the_middle, rule};
use super::microchannel_cell::{Filling, WallContact};

/// Support of the sides of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// Nothing.
    Free,
    /// The block goes on as its mirror image.
    Mirrored,
}

/// Load on the footprint of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BlockLoad {
    /// A pressure that stays normal to the surface.
    Pressure,
    /// A flat round punch without friction that just fits into the footprint; its rim is
    /// rounded with this radius, m.
    Punch(f64),
}

/// One void at one load.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockVoid {
    /// Pressure inside, Pa.
    pub inside: f64,
    /// Volume over its value at rest.
    pub volume_ratio: f64,
    /// Area of the thinnest section over its value at rest.
    pub thinnest: f64,
    /// Area of the thickest section over its value at rest.
    pub thickest: f64,
    /// Area of the section at the side of the block over its value at rest; of two sides
    /// the larger.
    pub rim: f64,
    /// Resistance of a conductor in the void over that at rest, by its sections.
    pub resistance_ratio: f64,
    /// Smallest distance between roof and floor, m; of an elliptic void where they are at least
    /// half its height apart at rest.
    pub gap: f64,
}

/// A block at one load.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockState {
    /// Pressure on each footprint, Pa, or depth of each punch, m.
    pub drives: Vec<f64>,
    /// Force on the whole block, from the support below, N.
    pub force: f64,
    /// Distance from the axis of each punch to the farthest point that touches it, before
    /// deformation, m; zero of a pressure.
    pub contact_radii: Vec<f64>,
    /// Greatest von Mises stress, Pa.
    pub stress: f64,
    /// All upper voids, in the order of y, and all lower ones, in the order of x.
    pub voids: [Vec<BlockVoid>; 2],
}

/// A block, bonded below.
pub struct BlockStudy {
    /// The problem being solved.
    pub solver: Solver,
    block: VoidBlock,
    loads: Vec<BlockLoad>,
    drives: Vec<Parameter>,
    voids: Vec<MeshedVoid>,
}

/// A void that is in the mesh, with its pressure.
struct MeshedVoid {
    row: usize,
    number: usize,
    name: String,
    pressure: Parameter,
    rest: f64,
    /// Pairs of roof and floor close to each other, where the gap is looked at.
    facing: Vec<WallPoint>,
}

impl BlockStudy {
    /// Poses the problem; a load for each footprint, `fillings` of the upper and of the lower
    /// voids.
    ///
    /// # Errors
    /// When the lengths make no block.
    pub fn new(
        block: VoidBlock,
        sides: Sides,
        loads: &[BlockLoad],
        material: Material,
        fillings: [&Filling; 2],
        contact: WallContact,
    ) -> Result<Self, Failure> {
        let mesh = block
            .mesh()
            .map_err(|error| Failure::at_start(Reason::Mesh(error)))?;
        let pose = || {
            let mut problem = Problem::new(mesh, Kinematics::Solid)?;
            problem.materials = vec![material; problem.mesh.regions.len()];
            hold(&mut problem, &block, sides)?;
            let shear = material.law().shear_modulus();
            let voids = add_voids(&mut problem, &block, fillings, (shear, contact))?;
            let drives = loads
                .iter()
                .enumerate()
                .map(|(number, load)| match *load {
                    BlockLoad::Pressure => add_pressure(&mut problem, number),
                    BlockLoad::Punch(rim) => {
                        let punch = (number, rim);
                        add_punch(&mut problem, &block, punch, (shear, contact))
                    }
                })
                .collect::<Result<Vec<_>, _>>()?;
            Ok((problem, voids, drives))
        };
        let (problem, voids, drives) =
            pose().map_err(|error: ProblemError| Failure::at_start(error.into()))?;
        let mut solver = Solver::new(problem)?;
        solver.settings = patient();
        let punched = loads.iter().any(|load| *load != BlockLoad::Pressure);
        if punched && !(block.is_half(0) && block.is_half(1)) {
            solver.settings.first_step = BESIDE;
        }
        Ok(Self {
            solver,
            block,
            loads: loads.to_vec(),
            drives,
            voids,
        })
    }

    /// Raises the pressure on each footprint to a value in Pa, or drives its punch to a
    /// depth in m.
    ///
    /// # Errors
    /// When the solution fails on the way.
    pub fn drive(&mut self, values: &[f64]) -> Result<BlockState, Failure> {
        let given = vec![Rule::Given; values.len()];
        self.load_to(&given, values, &mut |_| {})?;
        self.state()
    }

    /// Presses with a pressure on each footprint in Pa, or a force of its punch on the whole
    /// block in N.
    ///
    /// # Errors
    /// When the solution fails on the way.
    pub fn push(&mut self, values: &[f64]) -> Result<BlockState, Failure> {
        self.push_heard(values, &mut |_| {})
    }

    /// The same; `heard` receives the fraction of the way after each step.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn push_heard(
        &mut self,
        values: &[f64],
        heard: &mut dyn FnMut(f64),
    ) -> Result<BlockState, Failure> {
        let of_loads = |of: &dyn Fn(&BlockLoad, Parameter) -> Rule| -> Vec<Rule> {
            let loads = self.loads.iter().zip(&self.drives);
            loads.map(|(load, drive)| of(load, *drive)).collect()
        };
        let by_force = of_loads(&|load, drive| match load {
            BlockLoad::Pressure => Rule::Given,
            BlockLoad::Punch(_) => Rule::Prescribes(Quantity::Force(drive)),
        });
        let state = self.solver.state();
        let touch: Vec<f64> = self
            .loads
            .iter()
            .zip(&self.drives)
            .map(|(load, drive)| match load {
                BlockLoad::Pressure => state.parameters[drive.0],
                BlockLoad::Punch(_) => FIRST_TOUCH * self.block.voids.upper,
            })
            .collect();
        let untouched = |(load, drive): (&BlockLoad, &Parameter)| {
            *load != BlockLoad::Pressure && state.parameters[drive.0] == 0.0
        };
        if self.loads.iter().zip(&self.drives).any(untouched) {
            // Before it touches, no depth answers to a force.
            let given = vec![Rule::Given; touch.len()];
            self.load_to(&given, &touch, &mut |_| {})?;
            heard(0.0);
        }
        let copies = self.copies();
        let targets: Vec<f64> = self
            .loads
            .iter()
            .zip(values)
            .map(|(load, value)| match load {
                BlockLoad::Pressure => *value,
                BlockLoad::Punch(_) => value / copies,
            })
            .collect();
        self.load_to(&by_force, &targets, heard)?;
        self.state()
    }

    fn load_to(
        &mut self,
        rules: &[Rule],
        values: &[f64],
        heard: &mut dyn FnMut(f64),
    ) -> Result<(), Failure> {
        for (drive, rule) in self.drives.iter().zip(rules) {
            if self.solver.problem().rules()[drive.0] != *rule {
                self.solver.set_rule(*drive, rule.clone())?;
            }
        }
        let mut targets = self.solver.targets().to_vec();
        for (drive, value) in self.drives.iter().zip(values) {
            targets[drive.0] = *value;
        }
        self.solver.load_to(&targets, |_, step| {
            heard(step.fraction);
            Continue::Yes
        })
    }

    /// Number of times the mesh fits into the block.
    fn copies(&self) -> f64 {
        [0, 1]
            .map(|axis| if self.block.is_half(axis) { 2.0 } else { 1.0 })
            .into_iter()
            .product()
    }

    /// The block at the present state.
    ///
    /// # Errors
    /// When the state is not valid.
    pub fn state(&mut self) -> Result<BlockState, Failure> {
        let assembled = self.solver.evaluate()?;
        let bottom = self.solver.problem().mesh.nodes_of("bottom");
        let support: f64 = bottom
            .unwrap_or_default()
            .into_iter()
            .map(|node| assembled.forces[3 * node as usize + 2])
            .sum();
        let mut voids = self
            .block
            .counts
            .map(|count| vec![BlockVoid::default(); count]);
        for (number, void) in self.voids.iter().enumerate() {
            let found = self.void(number, assembled.volumes[number])?;
            // Where only a half is meshed, the other side has its mirror image.
            let mirrored = self.block.counts[void.row] - 1 - void.number;
            if self.block.is_half(1 - void.row) {
                voids[void.row][mirrored] = found;
            }
            voids[void.row][void.number] = found;
        }
        let stress = self.solver.greatest_stress();
        Ok(BlockState {
            drives: self
                .drives
                .iter()
                .map(|drive| self.solver.state().parameters[drive.0])
                .collect(),
            force: self.copies() * support,
            contact_radii: self.contact_radii(),
            stress: stress.map_or(0.0, |peak| peak.von_mises),
            voids,
        })
    }

    fn void(&self, number: usize, volume: f64) -> Result<BlockVoid, Failure> {
        let void = &self.voids[number];
        let state = self.solver.state();
        let mut axis = [0.0; 3];
        axis[void.row] = 1.0;
        let sections = |displacement| {
            sections(&self.solver.problem().mesh, &void.name, displacement, axis)
                .map_err(|error| Failure::at_start(Reason::Field(error)))
        };
        let (rest, now) = (sections(None)?, sections(Some(&state.displacement))?);
        let ratios: Vec<f64> = rest
            .iter()
            .zip(&now)
            .map(|(rest, now)| now.area / rest.area)
            .collect();
        let near_side = if self.block.is_half(void.row) {
            None
        } else {
            ratios.first()
        };
        let far_side = ratios.last();
        let greatest = |from: &mut dyn Iterator<Item = &f64>| from.copied().fold(0.0, f64::max);
        let places = state.places(&self.solver.problem().mesh);
        let gaps = void.facing.iter().map(|pair| pair.gap(&places));
        Ok(BlockVoid {
            inside: state.parameters[void.pressure.0],
            volume_ratio: volume / void.rest,
            thinnest: ratios.iter().copied().fold(f64::INFINITY, f64::min),
            thickest: greatest(&mut ratios.iter()),
            rim: greatest(&mut near_side.into_iter().chain(far_side)),
            resistance_ratio: slender_resistance(1.0, &now) / slender_resistance(1.0, &rest),
            gap: gaps.fold(f64::INFINITY, f64::min),
        })
    }

    fn contact_radii(&self) -> Vec<f64> {
        let contacts = self.solver.problem().contacts.iter().enumerate();
        let mut punches = contacts
            .filter(|(_, contact)| matches!(contact, Contact::Obstacle(_)))
            .map(|(number, _)| number);
        let radius = |(load, footprint): (&BlockLoad, &Footprint)| {
            if *load == BlockLoad::Pressure {
                return 0.0;
            }
            let Some(punch) = punches.next() else {
                return 0.0;
            };
            let [x, y] = footprint.centre;
            let probe = self.solver.contact(punch);
            let touching = probe.at.iter().zip(&probe.pressures);
            touching
                .filter(|(_, pressure)| **pressure > 0.0)
                .map(|(at, _)| (at[0] - x).hypot(at[1] - y))
                .fold(0.0, f64::max)
        };
        let pressed = self.loads.iter().zip(&self.block.footprints);
        pressed.map(radius).collect()
    }
}

/// A pressure that ends within a surface has a tangent that is not symmetric there; with
/// its symmetric part the last digits come slowly. In space an iteration takes seconds:
/// steps are as large as they converge, and a way that needs many small ones is given up.
fn patient() -> Settings {
    Settings {
        tolerance: 1e-6,
        iterations: 40,
        easy_iterations: 9,
        stall_iterations: Some(12),
        first_step: 1.0,
        smallest_step: 0.03,
        ..Settings::default()
    }
}

/// First share of the force of a punch beside the middle: it also tilts the top, and points
/// come to touch one after the other.
const BESIDE: f64 = 0.1;

/// Depth at which a punch is taken to have touched, over the height of the upper voids.
/// Far less drowns in the rounding of places.
const FIRST_TOUCH: f64 = 1e-2;

fn hold(problem: &mut Problem, block: &VoidBlock, sides: Sides) -> Result<(), ProblemError> {
    problem.clamp("bottom")?;
    for (axis, [near, far]) in [["left", "right"], ["front", "back"]]
        .into_iter()
        .enumerate()
    {
        if sides == Sides::Mirrored || block.is_half(axis) {
            problem.support(near, axis, Motion::Fixed)?;
        }
        if sides == Sides::Mirrored {
            problem.support(far, axis, Motion::Fixed)?;
        }
    }
    Ok(())
}

fn add_pressure(problem: &mut Problem, number: usize) -> Result<Parameter, ProblemError> {
    let name = format!("footprint{number}");
    let parameter = problem.parameter(&format!("pressure on {name}"), Rule::Given);
    problem.pressures.push(Pressure {
        surface: problem.surface(&name)?,
        parameter,
    });
    Ok(parameter)
}

fn add_punch(
    problem: &mut Problem,
    block: &VoidBlock,
    (number, rim): (usize, f64),
    (shear, contact): (f64, WallContact),
) -> Result<Parameter, ProblemError> {
    let parameter = problem.parameter(&format!("depth of punch {number}"), Rule::Given);
    let voids = &block.voids;
    let footprint = &block.footprints[number];
    let [x, y] = footprint.centre;
    let top = voids.base + voids.lower + voids.between + voids.upper + voids.cover;
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface: problem.surface("top")?,
        shape: Shape::Punch {
            point: [x, y, top],
            axis: [0.0, 0.0, 1.0],
            flat: footprint.size[0] / 2.0 - rim,
            rim,
        },
        travel: Some(([0.0, 0.0, -1.0], parameter)),
        // As stiff as roof on floor: the top gives way by the height of a void.
        stiffness: contact.opposite * shear / voids.upper,
        friction: 0.0,
        overlap_limit: contact.overlap * voids.upper,
    }));
    Ok(parameter)
}

fn add_voids(
    problem: &mut Problem,
    block: &VoidBlock,
    fillings: [&Filling; 2],
    (shear, contact): (f64, WallContact),
) -> Result<Vec<MeshedVoid>, ProblemError> {
    let mut voids = Vec::new();
    for row in 0..2 {
        for number in block.meshed(row) {
            let name = format!("{}{number}", VOID_ROWS[row]);
            let pressure = problem.parameter(&format!("pressure in {name}"), Rule::Given);
            // Measured across the void: its ends are open along it.
            let cavity = Cavity {
                wall: problem.surface(&name)?,
                axis: 1 - row,
                origin: block.middle(row, number),
                pressure,
            };
            let rest = cavity.volume(&problem.mesh, problem.kinematics, &problem.mesh.points);
            problem.set_rule(pressure, rule(fillings[row], problem.cavities.len(), rest));
            problem.cavities.push(cavity);
            close_void(problem, &name, shear, contact)?;
            let facing = facing_in_the_middle(&problem.mesh, &name);
            voids.push(MeshedVoid {
                row,
                number,
                name,
                pressure,
                rest,
                facing,
            });
        }
    }
    Ok(voids)
}
