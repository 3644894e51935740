//! A body that is solved step by step.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::ops::Range;

use taxel_fem::assembly::system::Assembled;
use taxel_fem::output::{Encoding, OutputError, Vtu};
use taxel_fem::problem::{Parameter, Rule};
use taxel_fem::solver::failure::{Failure, Reason};
use taxel_fem::solver::newton::{Continue, Jump, Multipliers, Solver, Step};
use taxel_fem::solver::stress::{StressPoint, nodal_stress, stress_points, von_mises};

use super::axes::{component, letter, turns};
use super::build;
use super::description::{self, Compressibility, Geometry, Prescribed, ProblemFile};
use super::fields;
use super::mistake;
use taxel_ground::InputError;
use taxel_ground::quantity::{self, Dimension};
use taxel_ground::table::{Cell, Column};

/// First way over the size of a body that an obstacle is moved to press.
const SEAT: f64 = 1e-5;

/// Greatest strain of a `linear_elastic` solid without a note: in tension its stress departs from
/// Hooke's law by 1.5 times the strain.
const SMALL_STRAIN: f64 = 0.05;

/// End of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// It is done.
    Done,
    /// It was stopped on the way; the last state stays.
    Stopped,
}

/// Work of the steps that a body has solved; of a restored one, since then.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Parts of steps.
    pub parts: usize,
    /// Newton iterations of all parts.
    pub iterations: usize,
    /// Most iterations of one part.
    pub most: usize,
}

impl Effort {
    fn add(&mut self, part: &Step) {
        self.parts += 1;
        self.iterations += part.iterations;
        self.most = self.most.max(part.iterations);
    }
}

/// A problem with its mesh, being solved.
pub struct Body {
    pub(super) file: ProblemFile,
    pub(super) solver: Solver,
    /// Axis of the mesh file along each component.
    axes: Vec<usize>,
    pub(super) steps: Vec<Vec<f64>>,
    dimensions: Vec<&'static Dimension>,
    /// Steps that are done.
    pub(super) done: usize,
    /// Rows of the steps that are done, and of rest.
    pub(super) rows: Vec<Vec<f64>>,
    notes: Vec<String>,
    effort: Effort,
    /// Jumps of the present step.
    jumps: Vec<Jump>,
    /// The step with the greatest strain of a `linear_elastic` solid, and where.
    strained: Option<(usize, StressPoint)>,
}

impl Body {
    /// Puts a problem and the bytes of its mesh together; `name` and `text` are those of the
    /// problem file, `mesh_name` that of the mesh, for messages.
    ///
    /// # Errors
    /// Mistakes in the mesh with their line; in the problem under the word.
    pub fn new(
        file: ProblemFile,
        (name, text): (&str, &str),
        (mesh_name, mesh): (&str, &[u8]),
    ) -> Result<Self, InputError> {
        let drawing = build::mesh(&file, mesh_name, mesh)?;
        let built = build::build(&file, drawing).map_err(|wrong| wrong.at(name, text))?;
        let solver = Solver::new(built.problem).map_err(|failure| {
            InputError::whole(name, build::told(failure.reason, Reason::scale))
        })?;
        let mut body = Self {
            solver,
            axes: built.axes,
            steps: built.steps,
            dimensions: built.dimensions,
            done: 0,
            rows: Vec::new(),
            notes: built
                .notes
                .iter()
                .map(|note| format!("{mesh_name}: {note}"))
                .collect(),
            effort: Effort::default(),
            jumps: Vec::new(),
            strained: None,
            file,
        };
        let options = body.file.solver;
        let settings = &mut body.solver.settings;
        settings.first_step = options.first_part.unwrap_or(settings.first_step);
        settings.largest_step = options.largest_part.unwrap_or(settings.largest_step);
        settings.smallest_step = options.smallest_part.unwrap_or(settings.smallest_step);
        settings.whole_cells = options.whole_cells;
        settings.multipliers = match options.multipliers {
            description::Multipliers::Automatic => Multipliers::Automatic,
            description::Multipliers::Points => Multipliers::Points,
            description::Multipliers::Corners => Multipliers::Corners,
        };
        body.distinct_columns().map_err(|message| {
            InputError::whole(name, message).help("give one of them another name")
        })?;
        let row = body.values().map_err(|reason| {
            let message = build::told(reason.clone(), Reason::scale);
            let message = format!("the undeformed body: {message}");
            match body.key_of_field(&reason) {
                Some(key) => mistake::wrong(key, message, "mend it there").at(name, text),
                None => InputError::whole(name, message).help(reason.advice()),
            }
        })?;
        body.rows.push(row);
        let overlaps = body.overlaps().into_iter().map(|overlap| {
            format!(
                "{overlap} before anything moves; the first step takes that away, and the forces of \
                 step 0 are not in equilibrium: move it, or turn its direction round, where that is \
                 not meant"
            )
        });
        let overlaps: Vec<String> = overlaps.collect();
        body.notes.extend(overlaps);
        Ok(body)
    }

    /// Refuses a table in which two columns have one name, or one that breaks its line.
    fn distinct_columns(&self) -> Result<(), String> {
        let mut known = HashSet::new();
        for column in self.columns() {
            if column.name.contains(char::is_control) {
                return Err(format!(
                    "the name {:?} has a control character",
                    column.name
                ));
            }
            if !known.insert(column.name.clone()) {
                return Err(format!(
                    "two columns of the table are called \"{}\"",
                    column.name
                ));
            }
        }
        Ok(())
    }

    /// Obstacles and contacts that overlap in the present state beyond what is accepted, in words.
    fn overlaps(&self) -> Vec<String> {
        let contacts = &self.solver.problem().contacts;
        let named = touched(&self.file).zip(contacts).enumerate();
        let overlaps = named.filter_map(|(number, (name, contact))| {
            let overlap = self.solver.contact(number).overlap;
            (overlap > contact.overlap_limit())
                .then(|| format!("{name:?} overlaps by {:.4} mm", 1e3 * overlap))
        });
        overlaps.collect()
    }

    /// Key of the field that can't be found.
    fn key_of_field(&self, reason: &Reason) -> Option<String> {
        let Reason::Field(_) = reason else {
            return None;
        };
        let mut resistances = self.file.resistance.iter();
        let wrong =
            resistances.position(|one| fields::resistance(&self.file, one, &self.solver).is_err());
        Some(wrong.map_or("capacitance.electrodes".to_owned(), |number| {
            format!("resistance.{number}")
        }))
    }

    /// Steps that are done whose state has a cell inside out somewhere.
    pub fn inside_out(&self) -> Vec<usize> {
        let least = |row: &Vec<f64>| row.last().is_some_and(|least| *least <= 0.0);
        let steps = self.rows.iter().enumerate();
        let steps = steps.filter(|(_, row)| least(row));
        steps.map(|(step, _)| step).collect()
    }

    /// Names of obstacles and contacts that touched nothing at the end of any step that is done, nor
    /// touch anything in the present state; none before the first.
    pub fn untouched(&self) -> Vec<&str> {
        let columns = self.columns();
        let contacts = &self.solver.problem().contacts;
        let untouched = touched(&self.file).enumerate().filter(|(number, name)| {
            let least = contacts[*number].least_pressure();
            let now = self.solver.contact(*number).pressures;
            let area = format!("{name}_contact_area");
            let at = columns.iter().position(|column| column.name == area);
            // The first column is the number of the step.
            let areas = self.rows.iter().filter_map(|row| row.get(at? - 1));
            self.done > 0
                && areas.fold(0.0, |most: f64, area| most.max(*area)) == 0.0
                && now.iter().all(|pressure| *pressure <= least)
        });
        untouched.map(|(_, name)| name.as_str()).collect()
    }

    /// Keeps the greatest strain of solids whose law is one of small strain.
    fn compare_strain(&mut self) {
        let linear = |name: &String| {
            let mut materials = self.file.material.iter();
            let of = materials.find(|material| material.regions.contains(name));
            of.is_some_and(|material| matches!(material.law, description::Law::LinearElastic(_)))
        };
        let problem = self.solver.problem();
        let linear: Vec<bool> = problem.mesh.regions.iter().map(linear).collect();
        if !linear.contains(&true) {
            return;
        }
        let points = stress_points(problem, self.solver.state());
        let points = points.filter(|point| linear[problem.mesh.region_of(point.cell)]);
        let amount = |point: &StressPoint| point.strain().abs();
        let most = points.max_by(|a, b| amount(a).total_cmp(&amount(b)));
        let most = most.map(|point| (self.done, point));
        let known = self.strained.map_or(0.0, |(_, known)| amount(&known));
        self.strained = most
            .filter(|(_, point)| amount(point) > known)
            .or(self.strained);
    }

    /// A note of a `linear_elastic` solid that was strained by more than its law is meant for in a
    /// step since the start or the resumption.
    pub fn beyond_small_strain(&self) -> Option<String> {
        let (step, point) = self.strained.as_ref()?;
        let strain = point.strain();
        let mesh = &self.solver.problem().mesh;
        (strain.abs() > SMALL_STRAIN).then(|| {
            format!(
                "after step {step} \"{}\" is strained by {:.0} % near {}: linear_elastic is a law of a few per cent; give it one of large strain, such as neo_hookean",
                mesh.regions[mesh.region_of(point.cell)],
                100.0 * strain,
                build::in_mm(point.place)
            )
        })
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Number of steps that are done.
    pub fn done(&self) -> usize {
        self.done
    }

    /// What is unusual about the mesh and the bodies at rest, in sentences.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// True once the pressures of contacts are kept at the corners of cells because the solution
    /// did not go on with those at points (`multipliers = "automatic"`).
    pub fn went_to_corners(&self) -> bool {
        self.solver.settings.multipliers == Multipliers::Automatic && self.solver.state().corners
    }

    /// Work so far.
    pub fn effort(&self) -> Effort {
        self.effort
    }

    /// Where the last step lost its equilibrium on a rough contact and jumped to another one, in m.
    pub fn jumps(&self) -> &[Jump] {
        &self.jumps
    }

    /// The size of the body and of each region along its axes, with the law of the region and its
    /// Poisson's ratio, in lines for people.
    pub fn description(&self) -> Vec<String> {
        let problem = self.solver.problem();
        let mesh = &problem.mesh;
        let size = |nodes: &[u32]| {
            let sides = (0..self.axes.len()).map(|d| {
                let along = nodes.iter().map(|&node| mesh.points[node as usize][d]);
                let [low, high] = along
                    .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                        [low.min(x), high.max(x)]
                    });
                format!("{:.4}", 1e3 * (high - low))
            });
            let axes = self.axes.iter().map(|&axis| letter(axis));
            format!(
                "{} mm ({})",
                sides.collect::<Vec<_>>().join(" x "),
                axes.collect::<Vec<_>>().join(", ")
            )
        };
        let all: Vec<u32> = (0..mesh.points.len() as u32).collect();
        let mut lines = vec![format!("body: {}", size(&all))];
        for (number, region) in mesh.regions.iter().enumerate() {
            let nodes = mesh.nodes_of_region(region).unwrap_or_default();
            let material = &problem.materials[number];
            lines.push(format!(
                "region \"{region}\": {}, {}, shear modulus {:.4} kPa, Poisson's ratio {:.4}",
                size(&nodes),
                material.law().name(),
                1e-3 * material.law().shear_modulus(),
                material.poisson_ratio()
            ));
        }
        lines
    }

    /// Numbers of unknowns and cells.
    pub fn size(&self) -> [usize; 2] {
        let cells = self.solver.problem().mesh.cell_count();
        [self.solver.unknowns(), cells]
    }

    /// From now on `asked` is called before every iteration and stops the step by true, at the last
    /// part of it that is done.
    pub fn stop_when(&mut self, asked: impl Fn() -> bool + Send + Sync + 'static) {
        self.solver.stop_when(asked);
    }

    /// Solves the next step; `seen` hears how much of it is done after each part, and stops it by
    /// false. Without a step left nothing is done.
    ///
    /// # Errors
    /// [`Failure`] with the last good state, which stays.
    pub fn step(&mut self, seen: impl FnMut(f64) -> bool) -> Result<Ended, Failure> {
        let Some(targets) = self.steps.get(self.done).cloned() else {
            return Ok(Ended::Done);
        };
        // Each step begins anew, so that a solution that is resumed goes the same way.
        let (state, now) = (self.solver.state().clone(), self.solver.targets().to_vec());
        self.solver.restart(state, now);
        self.jumps.clear();
        match self.seat().and_then(|()| self.load(&targets, seen)) {
            Ok(Ended::Done) => {}
            Err(failure) if failure.reason != Reason::Stopped => return Err(failure),
            _ => return Ok(Ended::Stopped),
        }
        let row = self.values().map_err(Failure::at_start)?;
        self.rows.push(row);
        self.done += 1;
        self.compare_strain();
        Ok(Ended::Done)
    }

    /// Loads to the targets of a step.
    fn load(
        &mut self,
        targets: &[f64],
        mut seen: impl FnMut(f64) -> bool,
    ) -> Result<Ended, Failure> {
        let duration = self.file.durations.get(self.done).copied().unwrap_or(0.0);
        if self.solver.targets() == targets && duration == 0.0 {
            let part = self.solver.settle()?;
            self.effort.add(&part);
            return Ok(Ended::Done);
        }
        let mut ended = Ended::Done;
        let (effort, jumps) = (&mut self.effort, &mut self.jumps);
        let mut hear = |_: &_, step: &Step| {
            effort.add(step);
            jumps.extend(step.jump);
            if seen(step.fraction) || step.fraction == 1.0 {
                Continue::Yes
            } else {
                ended = Ended::Stopped;
                Continue::Stop
            }
        };
        self.solver.load_over(duration, targets, &mut hear)?;
        Ok(ended)
    }

    /// Moves obstacles whose force is prescribed until they press: one that only touches, or does
    /// not even touch, has no force that its way could change.
    fn seat(&mut self) -> Result<(), Failure> {
        let supports = self.file.support.iter().map(|support| &support.moved);
        let rigid = self.file.rigid.iter().map(|rigid| &rigid.moved);
        let constraints = self.file.constraint.iter();
        let constraints = constraints.map(|constraint| &constraint.moved);
        let held: Vec<&str> = supports
            .chain(rigid)
            .chain(constraints)
            .filter_map(|moved| Some(moved.as_ref()?.by.as_str()))
            .collect();
        let drivers = self.file.parameter.iter().enumerate();
        let loose: Vec<usize> = drivers
            .filter(|(_, driver)| driver.prescribes == Some(Prescribed::Force))
            .filter(|(_, driver)| !held.contains(&driver.name.as_str()))
            .map(|(number, _)| number)
            .collect();
        for number in loose {
            if self.solver.evaluate()?.along[number] != 0.0 {
                continue;
            }
            let rule = self.solver.problem().rules()[number].clone();
            self.solver.set_rule(Parameter(number), Rule::Given)?;
            let seated = self.drive_until_it_presses(number);
            self.solver.set_rule(Parameter(number), rule)?;
            seated?;
        }
        Ok(())
    }

    /// The same with one, whose way is given meanwhile.
    fn drive_until_it_presses(&mut self, number: usize) -> Result<(), Failure> {
        let size = self.largest_coordinate();
        let mut way = SEAT * size;
        while way < size {
            let mut targets = self.solver.targets().to_vec();
            targets[number] += way;
            self.solver.load_to(&targets, |_, _| Continue::Yes)?;
            if self.solver.evaluate()?.along[number] > 0.0 {
                break;
            }
            way *= 2.0;
        }
        Ok(())
    }

    fn largest_coordinate(&self) -> f64 {
        let points = self.solver.problem().mesh.points.iter().flatten();
        points.fold(0.0, |most: f64, x| most.max(x.abs()))
    }

    /// Columns of the table.
    pub fn columns(&self) -> Vec<Column> {
        let mut columns = vec![Column::plain("step")];
        let file = &self.file;
        if !file.durations.is_empty() {
            columns.push(Column::new("time", "s", 1.0, "s", 3));
        }
        for (driver, dimension) in file.parameter.iter().zip(&self.dimensions) {
            columns.push(column(&driver.name, dimension));
            if driver.prescribes.is_some() {
                let name = format!("{}_found", driver.name);
                columns.push(column(&name, self.found_dimension(&driver.name)));
            }
        }
        let axes: Vec<&str> = self.axes.iter().map(|&axis| letter(axis)).collect();
        let of_force = &axes[self.force_components()];
        let mut vectors = |what: &str, names: &mut dyn Iterator<Item = &String>, dimension| {
            let axes = if what == "displacement" {
                &axes[..]
            } else {
                of_force
            };
            for name in names {
                for axis in axes {
                    columns.push(column(&format!("{name}_{what}_{axis}"), dimension));
                }
            }
        };
        vectors("force", &mut touched(file), &quantity::FORCE);
        vectors(
            "reaction",
            &mut file.output.reactions.iter().map(|group| &group.name),
            &quantity::FORCE,
        );
        vectors(
            "displacement",
            &mut file.output.displacements.iter().map(|group| &group.name),
            &quantity::LENGTH,
        );
        for name in touched(file) {
            for (what, dimension) in [
                ("contact_area", &quantity::AREA),
                ("deformed_contact_area", &quantity::AREA),
                ("greatest_pressure", &quantity::STRESS),
            ] {
                columns.push(column(&format!("{name}_{what}"), dimension));
            }
        }
        let turns = turns(self.solver.problem().kinematics, &self.axes);
        for rigid in &file.rigid {
            let mut vector = |what: &str, axes: &mut dyn Iterator<Item = &str>, dimension| {
                for axis in axes {
                    columns.push(column(&format!("{}_{what}_{axis}", rigid.name), dimension));
                }
            };
            let about = turns.iter().map(|(axis, ..)| letter(*axis));
            let along = of_force.iter().copied();
            vector("force", &mut along.clone(), &quantity::FORCE);
            vector("torque", &mut about.clone(), &quantity::MOMENT);
            vector("travel", &mut along.clone(), &quantity::LENGTH);
            vector("turn", &mut about.clone(), &quantity::ANGLE);
        }
        for cavity in &file.cavity {
            columns.push(column(
                &format!("{}_volume", cavity.name),
                &quantity::VOLUME,
            ));
            if cavity.trapped_gas.is_some() {
                let name = format!("{}_pressure", cavity.name);
                columns.push(column(&name, &quantity::STRESS));
            }
        }
        for channel in &file.channel {
            let name = format!("{}_resistance", channel.cavity);
            columns.push(column(&name, &quantity::RESISTANCE));
        }
        for resistance in &file.resistance {
            let name = format!("{}_resistance", resistance.name);
            columns.push(column(&name, &quantity::RESISTANCE));
        }
        if let Some(capacitance) = &file.capacitance {
            for name in fields::capacitance_names(capacitance) {
                columns.push(column(&name, &quantity::CAPACITANCE));
            }
        }
        columns.push(column("greatest_von_mises", &quantity::STRESS));
        columns.push(Column::new("least_volume_ratio", "", 1.0, "", 4));
        columns
    }

    /// Rows of the table: rest, then each step that is done.
    pub fn cells(&self) -> Vec<Vec<Cell>> {
        let row = |(step, row): (usize, &Vec<f64>)| {
            let numbers = row.iter().map(|value| Cell::Number(*value));
            std::iter::once(Cell::Whole(step as u64))
                .chain(numbers)
                .collect()
        };
        self.rows.iter().enumerate().map(row).collect()
    }

    /// Dimension of a parameter itself, whose values are another quantity.
    fn found_dimension(&self, name: &str) -> &'static Dimension {
        let pressed = self.file.load.iter();
        let pressed = pressed.filter_map(|load| load.pressure.as_deref());
        let cavities = self.file.cavity.iter();
        let cavities = cavities.filter_map(|cavity| cavity.pressure.as_deref());
        let forces = self.file.load.iter();
        let mut forces = forces.filter_map(|load| load.force.as_ref());
        let turned = self.file.rigid.iter();
        let mut turned = turned.filter_map(|rigid| rigid.turned.as_ref());
        if pressed.chain(cavities).any(|by| by == name) {
            &quantity::STRESS
        } else if forces.any(|force| force.by == name) {
            &quantity::FORCE
        } else if turned.any(|turned| turned.by == name) {
            &quantity::ANGLE
        } else {
            &quantity::LENGTH
        }
    }

    /// Components of the whole force of a surface: around an axis of revolution the radial ones
    /// cancel.
    fn force_components(&self) -> Range<usize> {
        let first = usize::from(self.file.geometry == Geometry::Axisymmetric);
        first..self.axes.len()
    }

    /// Appends force, torque, displacement and rotation of each rigid body.
    fn add_rigid_bodies(&self, assembled: &Assembled, values: &mut Vec<f64>) {
        let (problem, state) = (self.solver.problem(), self.solver.state());
        let (components, depth) = (self.axes.len(), self.file.depth());
        let places = state.places(&problem.mesh);
        let turns = turns(problem.kinematics, &self.axes);
        for body in &problem.rigid_bodies {
            let force = |node: u32| {
                let own = &assembled.forces[node as usize * components..][..components];
                let mut force = [0.0; 3];
                force[..components].copy_from_slice(own);
                force
            };
            let motion = body.motion(&state.parameters);
            let torque = body.torque(&motion, |node| places[node as usize], force);
            let along = self.force_components();
            let about = |vector: [f64; 3]| {
                let each = turns.iter();
                each.map(move |&(_, component, sign)| sign * vector[component] + 0.0)
            };
            let whole = body.force(force).map(|force| force * depth + 0.0);
            values.extend(&whole[along.clone()]);
            values.extend(about(torque.map(|torque| torque * depth)));
            values.extend(&motion.travel[along]);
            values.extend(about(motion.turn));
        }
    }

    /// Numbers of the next row, at the present state, SI.
    fn values(&mut self) -> Result<Vec<f64>, Reason> {
        let assembled = self.solver.evaluate().map_err(|failure| failure.reason)?;
        let (file, depth) = (&self.file, self.file.depth());
        let (problem, state) = (self.solver.problem(), self.solver.state());
        let components = self.axes.len();
        let mut values = Vec::new();
        if !file.durations.is_empty() {
            values.push(file.durations[..self.rows.len()].iter().sum());
        }
        for (number, driver) in file.parameter.iter().enumerate() {
            let own = state.parameters[number];
            match &driver.prescribes {
                None => values.push(own),
                Some(Prescribed::Force | Prescribed::Torque) => {
                    values.extend([assembled.along[number] * depth, own]);
                }
                Some(Prescribed::Displacement(of)) => {
                    let node = problem
                        .mesh
                        .nodes_of(&of.at)
                        .and_then(|n| n.first().copied());
                    let along = component(&self.axes, of.along.number());
                    let moved = node.zip(along);
                    let moved = moved.map(|(node, along)| state.displacement[node as usize][along]);
                    values.extend([moved.unwrap_or(f64::NAN), own]);
                }
                Some(Prescribed::Volume(of)) => {
                    let cavity = file.cavity.iter().position(|cavity| cavity.name == of.of);
                    let volume = cavity.map_or(f64::NAN, |at| assembled.volumes[at] * depth);
                    values.extend([volume, own]);
                }
            }
        }
        let probes: Vec<_> = (0..touched(file).count())
            .map(|number| self.solver.contact(number))
            .collect();
        let itself = file
            .contact
            .iter()
            .map(|one| one.surfaces[0] == one.surfaces[1]);
        let obstacles = file.obstacle.iter().map(|_| false);
        for (probe, itself) in probes.iter().zip(obstacles.chain(itself)) {
            // What a surface does to itself it suffers as well.
            let force = if itself { [0.0; 3] } else { probe.force() };
            let force = &force[self.force_components()];
            // A zero has no sign.
            values.extend(force.iter().map(|force| force * depth + 0.0));
        }
        for name in &file.output.reactions {
            let mut sum = vec![0.0; components];
            for node in problem.mesh.nodes_of(name).unwrap_or_default() {
                for (i, sum) in sum.iter_mut().enumerate() {
                    *sum += depth * assembled.forces[node as usize * components + i];
                }
            }
            values.extend(&sum[self.force_components()]);
        }
        for name in &file.output.displacements {
            let nodes = problem.mesh.nodes_of(name).unwrap_or_default();
            let moved = nodes.first().map(|&node| state.displacement[node as usize]);
            let moved = moved.unwrap_or([f64::NAN; 3]);
            values.extend_from_slice(&moved[..components]);
        }
        for (probe, contact) in probes.iter().zip(&problem.contacts) {
            let areas = probe.touching(contact.least_pressure());
            values.extend(areas.map(|area| depth * area));
            values.push(probe.greatest_pressure());
        }
        self.add_rigid_bodies(&assembled, &mut values);
        for (number, cavity) in file.cavity.iter().enumerate() {
            values.push(assembled.volumes[number] * depth);
            if cavity.trapped_gas.is_some() {
                values.push(state.parameters[problem.cavities[number].pressure.0]);
            }
        }
        for channel in &file.channel {
            let cavity = file.cavity.iter().position(|c| c.name == channel.cavity);
            let area = cavity.map_or(f64::NAN, |at| assembled.volumes[at] / channel.share);
            values.push(channel.resistivity * depth / area);
        }
        for resistance in &file.resistance {
            let found = fields::resistance(file, resistance, &self.solver);
            values.push(found.map_err(Reason::Field)?);
        }
        if let Some(capacitance) = &file.capacitance {
            let found = fields::capacitances(file, capacitance, &self.solver);
            values.extend(found.map_err(Reason::Field)?);
        }
        let stress = self.solver.greatest_stress();
        values.push(stress.map_or(0.0, |point| point.von_mises));
        let least = self.solver.least_volume_ratio();
        values.push(least.map_or(1.0, |least| least.ratio));
        Ok(values)
    }

    /// The body at the present state as an unstructured grid of VTK, which ParaView reads: the
    /// undeformed mesh with the displacement of each node in m, its Cauchy stress (xx, yy, zz, xy,
    /// yz, xz), von Mises and mean stress, and where there are contacts their pressure, in Pa.
    ///
    /// # Errors
    /// [`OutputError`]; never of a body that was solved.
    pub fn vtu(&self) -> Result<String, OutputError> {
        let (problem, state) = (self.solver.problem(), self.solver.state());
        let stress = nodal_stress(problem, state);
        let mises: Vec<f64> = stress.iter().map(|stress| von_mises(*stress)).collect();
        let mean = stress.iter().map(|s| (s[0] + s[1] + s[2]) / 3.0);
        let mean: Vec<f64> = mean.collect();
        let grid = Vtu::new(&problem.mesh)
            .point_field("displacement", 3, state.displacement.as_flattened())?
            .point_field("cauchy_stress_pa", 6, stress.as_flattened())?
            .point_field("von_mises_pa", 1, &mises)?
            .point_field("mean_stress_pa", 1, &mean)?;
        let grid = if problem.contacts.is_empty() {
            grid
        } else {
            grid.point_field("contact_pressure_pa", 1, &self.solver.contact_pressure())?
        };
        Ok(grid.text(Encoding::Base64))
    }

    /// A failure with what the file calls its parts.
    pub fn explain(&self, failure: &Failure) -> String {
        let reason = build::told(failure.reason.clone(), Reason::scale);
        let mut message = format!("step {}: {reason}", self.done + 1);
        if let Some((what, name)) = self.named(&failure.reason) {
            let _ = write!(message, " ({what} \"{name}\")");
        }
        let axes: Vec<&str> = self.axes.iter().map(|&axis| letter(axis)).collect();
        if axes.len() == 2 && axes != ["x", "y"] {
            let _ = write!(message, " (places are {} and {})", axes[0], axes[1]);
        }
        let drivers = self.file.parameter.iter().zip(&self.dimensions);
        let reached = failure.parameters.iter().zip(drivers);
        let reached = reached.map(|((name, value), (driver, dimension))| {
            let dimension = match driver.prescribes {
                Some(_) => self.found_dimension(name),
                None => dimension,
            };
            let (unit, size, _) = shown(dimension);
            format!("{name} = {:.6} {unit}", value / size)
        });
        let reached: Vec<String> = reached.collect();
        let _ = write!(
            message,
            ". {:.1} % of the step was solved, up to {}",
            100.0 * failure.fraction,
            if reached.is_empty() {
                String::from("rest")
            } else {
                reached.join(", ")
            }
        );
        let _ = write!(message, "\nhelp: {}", self.advice(failure));
        message
    }

    /// What the file calls the part that a reason has the number of.
    fn named(&self, reason: &Reason) -> Option<(&'static str, &str)> {
        match reason {
            Reason::Chatter { contact, .. }
            | Reason::Leapt { contact, .. }
            | Reason::Overlapped { contact, .. } => {
                Some(("contact", touched(&self.file).nth(*contact)?))
            }
            Reason::CavityCrossed { cavity, .. } => {
                Some(("cavity", &self.file.cavity.get(*cavity)?.name))
            }
            _ => None,
        }
    }

    /// True if the present step prescribes ways and angles alone.
    fn moves_by_ways(&self) -> bool {
        let Some(targets) = self.steps.get(self.done) else {
            return false;
        };
        let moves = |number: usize| self.solver.targets()[number] != targets[number];
        let drivers = self.file.parameter.iter().zip(&self.dimensions).enumerate();
        let mut moving = drivers.filter(|(number, _)| moves(*number));
        moving.all(|(_, (driver, dimension))| {
            driver.prescribes.is_none() && ["m", "rad"].contains(&dimension.si)
        })
    }

    fn advice(&self, failure: &Failure) -> String {
        let reason = &failure.reason;
        let soft = self.file.material.iter().any(|material| {
            matches!(
                material.compressibility,
                Some(Compressibility::Incompressible)
            )
        });
        match reason {
            Reason::Volume { .. } if soft => String::from(
                "free a surface, vent a cavity, or give the solid a bulk modulus: \
                 compressibility = { quadratic = { bulk_modulus = \"…\" } }",
            ),
            Reason::Limit { .. } | Reason::Unstable { .. } | Reason::Hopped { .. }
                if self.moves_by_ways() =>
            {
                String::from(
                    "the ways are prescribed already, and the body buckles or creases: move a support or \
                     an obstacle a little aside, so that it goes to one side; give faces that fold onto each \
                     other a contact",
                )
            }
            Reason::Limit { .. } | Reason::Unstable { .. } | Reason::Hopped { .. } => {
                let cause = if matches!(reason, Reason::Limit { .. }) {
                    "the load has a limit there"
                } else {
                    "the load has a limit there, or the body buckles"
                };
                format!(
                    "{cause}: prescribe a displacement, a force of a moved part or a volume of a \
                     cavity in its place (parameter.prescribes)"
                )
            }
            Reason::NotANumber
            | Reason::NotConverged {
                inside_out: None, ..
            } => {
                // Where nothing was solved, the state is the one at rest.
                let at_rest = self.done == 0 && failure.fraction == 0.0;
                match self.overlaps().first().filter(|_| at_rest) {
                    Some(overlap) => format!(
                        "{overlap} before anything moves, which nothing of the step could take away: \
                         let it begin where it just touches, and let a parameter move it from there"
                    ),
                    None => String::from(
                        "take smaller parts (solver.smallest_part), or larger cells where the body is \
                         strained most; where surfaces touch, try solver.multipliers = \"corners\"",
                    ),
                }
            }
            Reason::Chatter { .. } => String::from(
                "make the cells of the touching surface smaller, give it some friction, or leave a \
                 small gap at rest where faces lie flat on each other",
            ),
            reason => reason.advice().to_owned(),
        }
    }
}

/// Names of obstacles and contacts, in the order of the contacts of the solver.
fn touched(file: &ProblemFile) -> impl Iterator<Item = &String> {
    let obstacles = file.obstacle.iter().map(|obstacle| &obstacle.name);
    obstacles.chain(file.contact.iter().map(|contact| &contact.name))
}

/// Unit for people of a dimension, its SI value and decimals.
fn shown(dimension: &'static Dimension) -> (&'static str, f64, usize) {
    let symbol = match dimension.si {
        "m" => "mm",
        "N" => "mN",
        "Pa" => "kPa",
        "m2" => "mm2",
        "m3" => "mm3",
        "F" => "fF",
        "N m" => "mN m",
        "rad" => "deg",
        si => si,
    };
    let (symbol, size) = dimension.entry(symbol).unwrap_or((dimension.si, 1.0));
    (symbol, size, 5)
}

fn column(name: &str, dimension: &'static Dimension) -> Column {
    let (unit, size, decimals) = shown(dimension);
    let si = match dimension.si {
        "m" => "m",
        "N" => "n",
        "Pa" => "pa",
        "F" => "f",
        "N m" => "n_m",
        si => si,
    };
    Column::new(name, unit, size, si, decimals)
}
