//! From a problem file and its mesh to the boundary value problem of the solver.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use taxel_fem::assembly::folds::{FOLDING, folds};
use taxel_fem::assembly::surfaces::tie;
use taxel_fem::material::viscoelastic::{PronyTerm, Relaxation};
use taxel_fem::material::{self, Material, Volumetric};
use taxel_fem::mesh::gmsh::{self, Drawing};
use taxel_fem::mesh::neighbours;
use taxel_fem::mesh::quality::{Quality, hinges, is_curved};
use taxel_fem::mesh::sight::void_between;
use taxel_fem::mesh::{Facet, Mesh, MeshError};
use taxel_fem::problem::load::traction;
use taxel_fem::problem::{self as solid, Contact, DeadLoad, Kinematics, Motion, Parameter, Rule};

use super::axes::{component, letter, turns};
use super::cuts;
use super::description::{
    self, Along, Compressibility, Geometry, Law, Prescribed, ProblemFile, RegionMaterial, Shape,
};
use super::group::{Axis, Group};
use super::mistake::{Wrong, wrong};
use super::selection::select;
use taxel_ground::InputError;
use taxel_ground::quantity::{self, AnyQuantity, Dimension};

/// Contact stiffness of an obstacle over shear modulus and mean side of a cell, without friction and with
/// it: the multipliers make the result independent of it. Rough points find another equilibrium less often
/// with a stiff one.
const STIFFNESS: [f64; 2] = [1e3, 50.0];
/// Overlap that is accepted over the mean side of a cell.
const OVERLAP: f64 = 1e-4;
/// A cavity is closed at rest if its volume is at most this share of its wall times a cell's side.
const CLOSED: f64 = 1e-9;
/// A step is refused in which an obstacle comes to overlap a part that supports give no way out by
/// more than this share of the mean side of a cell: the solver would give it up.
const DRIVEN_INTO: f64 = 0.1;
/// A point lies on the axis of revolution within this share of the greatest radius.
const ON_AXIS: f64 = 1e-9;
/// Sizes of a body, m, beyond which a note asks for the unit of the mesh.
const USUAL_SIZES: [f64; 2] = [10e-6, 10.0];

/// What to do where a mesh has no group of the kind that is needed.
const NO_GROUP: &str = "the mesh names none of its parts: make it a physical group in Gmsh, or select it by place, such as { plane = { axis = \"z\", at = \"2 mm\" } }";

/// An error of the solver, whose lengths are in m, with its lengths in mm.
pub(super) fn told<E: std::fmt::Display>(mut error: E, scale: fn(&mut E, f64) -> bool) -> String {
    if scale(&mut error, 1e3) {
        format!("{error} (lengths in mm)")
    } else {
        error.to_string()
    }
}

/// A problem with what its parts are called in the file.
pub(super) struct Built {
    pub(super) problem: solid::Problem,
    /// Axis of the file along each component.
    pub(super) axes: Vec<usize>,
    /// Targets at the end of each step.
    pub(super) steps: Vec<Vec<f64>>,
    /// Dimension of the values of each parameter of the file.
    pub(super) dimensions: Vec<&'static Dimension>,
    /// What is unusual about the mesh, in sentences.
    pub(super) notes: Vec<String>,
}

/// Reads a mesh in m.
pub(super) fn mesh(file: &ProblemFile, name: &str, bytes: &[u8]) -> Result<Drawing, InputError> {
    let mut drawing =
        gmsh::read_file(bytes).map_err(|error| InputError::whole(name, error.to_string()))?;
    for point in &mut drawing.mesh.points {
        *point = point.map(|x| x * file.mesh.unit);
    }
    Ok(drawing)
}

pub(super) fn build(file: &ProblemFile, mut drawing: Drawing) -> Result<Built, Wrong> {
    if file.schema != 1 {
        let message = format!(
            "schema {} is not known; this program reads schema 1",
            file.schema
        );
        return Err(wrong("schema", message, "write schema = 1"));
    }
    if file.name.trim().is_empty() {
        return Err(wrong("name", "the name is empty", "name the problem"));
    }
    let kinematics = match file.geometry {
        Geometry::PlaneStrain(_) => Kinematics::PlaneStrain,
        Geometry::Axisymmetric => Kinematics::Axisymmetric,
        Geometry::Solid => Kinematics::Solid,
    };
    select(file, &mut drawing.mesh, &drawing.axes)?;
    let mut quality = Quality::of(&drawing.mesh);
    let meetings = cuts::Meetings::of(file, &drawing.mesh);
    quality.coincident.retain(|pair| !meetings.are_nodes(*pair));
    let mut notes = Vec::new();
    if let (true, Err(error)) = (quality.inverted.is_empty(), quality.require(&drawing.mesh)) {
        notes.push(told(error, MeshError::scale));
    } else if let Err(error) = quality.require(&drawing.mesh) {
        let mut bad = quality.inverted.iter();
        let help = if bad.any(|bad| is_curved(&drawing.mesh, bad.cell)) {
            "the sides of such a cell are bent too far: optimise the mesh (in Gmsh: Mesh.HighOrderOptimize = 2), save it in first order (Mesh.ElementOrder = 1), or make the cells there smaller"
        } else {
            "mend the mesh"
        };
        let message = told(error, MeshError::scale);
        return Err(wrong("mesh.file", message, help));
    }
    if drawing.turned > 0 {
        notes.push(format!(
            "{} cells are given inside out, and were turned",
            drawing.turned
        ));
    }
    notes.extend(hinge(&drawing.mesh));
    notes.extend(unusual_size(&drawing.mesh));
    if kinematics == Kinematics::Axisymmetric {
        right_of_axis(&drawing.mesh)?;
    }
    let problem = solid::Problem::new(drawing.mesh, kinematics).map_err(|error| {
        wrong(
            "geometry",
            error.to_string(),
            "give the geometry of the mesh",
        )
    })?;
    let mut builder = Builder {
        file,
        problem,
        axes: drawing.axes,
        depth: file.depth(),
        uses: vec![None; file.parameter.len()],
        constraint_of: Vec::new(),
        boundary: OnceCell::new(),
        notes,
    };
    distinct(file)?;
    parts_of_steps(file)?;
    durations(file)?;
    eye(file)?;
    builder.parameters()?;
    builder.materials()?;
    builder.supports()?;
    builder.rigid_bodies()?;
    builder.constraints()?;
    builder.loads()?;
    builder.cavities()?;
    builder.obstacles()?;
    builder.contacts()?;
    builder.ties()?;
    builder.folds()?;
    builder.joined_or_apart()?;
    builder.voids_between_electrodes();
    builder.rules()?;
    builder.names()?;
    let (steps, dimensions) = builder.steps()?;
    builder
        .problem
        .check()
        .map_err(|error| builder.refused(&error))?;
    builder.driven_into_obstacles(&steps)?;
    Ok(Built {
        problem: builder.problem,
        axes: builder.axes,
        steps,
        dimensions,
        notes: builder.notes,
    })
}

/// The overlap that a contact accepts, m: at most a side of a cell.
fn overlap(given: Option<f64>, side: f64, key: &str) -> Result<f64, Wrong> {
    let overlap = given.unwrap_or(OVERLAP * side);
    if overlap <= side {
        return Ok(overlap);
    }
    let message = format!(
        "{:.4} mm is more than the mean side of a cell there, {:.4} mm",
        1e3 * overlap,
        1e3 * side
    );
    let help = "leave it out, or give a small share of that side";
    Err(wrong(format!("{key}.overlap"), message, help))
}

/// A note of parts that hang together by a point.
fn hinge(mesh: &Mesh) -> Option<String> {
    let hinges = hinges(mesh);
    let &first = hinges.first()?;
    Some(format!(
        "cells meet near {} without a side between them (at {} in all): parts of the body turn about each other there; join them by a side, or part them",
        in_mm(mesh.points[first as usize]),
        hinges.len()
    ))
}

/// A note of a body that is larger or smaller than soft bodies are.
fn unusual_size(mesh: &Mesh) -> Option<String> {
    let along = |d: usize| mesh.points.iter().map(move |point| point[d]);
    let extents = (0..3).map(|d| {
        let ends = along(d).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        });
        ends[1] - ends[0]
    });
    let size = extents.fold(0.0, f64::max);
    let [least, most] = USUAL_SIZES;
    (size < least || size > most).then(|| {
        format!(
            "the body is {:.3e} mm long: is mesh.unit right?",
            1e3 * size
        )
    })
}

/// A place in mm.
pub(super) fn in_mm(place: [f64; 3]) -> String {
    let [x, y, z] = place.map(|x| 1e3 * x);
    format!("({x:.4}, {y:.4}, {z:.4}) mm")
}

/// Refuses parts of steps whose smallest is not the smallest.
fn parts_of_steps(file: &ProblemFile) -> Result<(), Wrong> {
    let Some(smallest) = file.solver.smallest_part else {
        return Ok(());
    };
    for (name, part) in [
        ("first_part", file.solver.first_part),
        ("largest_part", file.solver.largest_part),
    ] {
        if let Some(part) = part.filter(|part| *part < smallest) {
            let message = format!("{smallest} is more than {name}, which is {part}");
            let help = "give the smallest part the least value";
            return Err(wrong("solver.smallest_part", message, help));
        }
    }
    Ok(())
}

/// Refuses a direction to the eye that has no length.
fn eye(file: &ProblemFile) -> Result<(), Wrong> {
    match file.picture.from {
        Some([0.0, 0.0, 0.0]) => {
            let help = "give a direction such as [1, -2, 1]";
            Err(wrong("picture.from", "the direction is zero", help))
        }
        _ => Ok(()),
    }
}

/// Refuses a section that crosses its axis of revolution.
fn right_of_axis(mesh: &Mesh) -> Result<(), Wrong> {
    let radii = mesh.points.iter().map(|point| point[0]);
    let most = radii
        .clone()
        .fold(0.0, |most: f64, radius| most.max(radius.abs()));
    let least = radii.fold(0.0, f64::min);
    if least >= -ON_AXIS * most {
        return Ok(());
    }
    let message = format!(
        "the mesh reaches a radius of {:.4} mm: its first axis is the radius, at least 0",
        1e3 * least
    );
    let help = "draw the half of the section on the positive side of the axis";
    Err(wrong("geometry", message, help))
}

/// Keys and names of the parts in a list of the file.
fn names<'f, T>(list: &str, parts: &'f [T], name: fn(&T) -> &String) -> Vec<(String, &'f String)> {
    let numbered = parts.iter().enumerate();
    let named = numbered.map(|(number, part)| (format!("{list}.{number}"), name(part)));
    named.collect()
}

/// Refuses names that are empty or given twice: each column of the table has its own.
fn distinct(file: &ProblemFile) -> Result<(), Wrong> {
    let touched = [
        names("obstacle", &file.obstacle, |obstacle| &obstacle.name),
        names("contact", &file.contact, |contact| &contact.name),
        names("rigid", &file.rigid, |rigid| &rigid.name),
    ];
    let resistances = [
        names("channel", &file.channel, |channel| &channel.cavity),
        names("resistance", &file.resistance, |resistance| {
            &resistance.name
        }),
    ];
    let groups = [
        names("parameter", &file.parameter, |parameter| &parameter.name),
        touched.concat(),
        names("cavity", &file.cavity, |cavity| &cavity.name),
        resistances.concat(),
        names("output.reactions", &file.output.reactions, |name| name),
        names("output.displacements", &file.output.displacements, |name| {
            name
        }),
    ];
    for group in groups {
        for (at, (part, name)) in group.iter().enumerate() {
            let message = if name.trim().is_empty() {
                "the name is empty".to_owned()
            } else if group[..at].iter().any(|(_, before)| before == name) {
                format!("another one is called \"{name}\"")
            } else {
                continue;
            };
            let key = match part.split_once('.') {
                Some(("channel", _)) => format!("{part}.cavity"),
                Some(("output", _)) => part.clone(),
                _ => format!("{part}.name"),
            };
            return Err(wrong(
                key,
                message,
                "give each its own name, and name each once",
            ));
        }
    }
    Ok(())
}

struct Builder<'a> {
    file: &'a ProblemFile,
    problem: solid::Problem,
    axes: Vec<usize>,
    /// Depth of a plane body, m; 1 of others.
    depth: f64,
    /// Dimension of each parameter by its first use, with the key of that use.
    uses: Vec<Option<(&'static Dimension, String)>>,
    /// Number in the file of each constraint of the problem.
    constraint_of: Vec<usize>,
    /// Sides of cells that belong to one cell only.
    boundary: OnceCell<HashSet<Facet>>,
    /// What is unusual, in sentences.
    notes: Vec<String>,
}

impl Builder<'_> {
    /// The key at which an error of the whole problem is shown.
    fn refused(&self, error: &solid::ProblemError) -> Wrong {
        use solid::ProblemError as Error;
        let (file, mesh) = (self.file, self.mesh());
        let mut message = told(error.clone(), solid::ProblemError::scale);
        if message.contains(" component ") && self.axes != [0, 1, 2][..self.axes.len()] {
            let axes: Vec<&str> = self.axes.iter().map(|&axis| letter(axis)).collect();
            message = format!(
                "{message} (the components are those along {})",
                axes.join(" and ")
            );
        }
        match error {
            Error::Unstable { region, .. } => {
                let of = |material: &RegionMaterial| material.regions.contains(region);
                let number = file.material.iter().position(of).unwrap_or(0);
                let help = "use constants of a stable law";
                wrong(format!("material.{number}.law"), message, help)
            }
            Error::NotFixed(_) => {
                let help = "hold a surface, a curve or a point along that direction; or let the part stick by common nodes or a [[tie]]";
                wrong("support", message, help)
            }
            Error::Contradiction {
                node, component, ..
            } => {
                // The last support of that node along that axis.
                let along = self.axes[*component];
                let moves = |support: &description::Support| {
                    let moved = support.moved.as_ref();
                    let moved = moved.is_some_and(|by| [by.x, by.y, by.z][along].is_some());
                    let held = support.held.iter().any(|axis| axis.number() == along);
                    let nodes = mesh.nodes_of(&support.on).unwrap_or_default();
                    (held || moved) && nodes.contains(node)
                };
                let number = file.support.iter().rposition(moves).unwrap_or(0);
                let help =
                    "move only one of the two groups along that axis, or end one before the other";
                wrong(format!("support.{number}.on"), message, help)
            }
            Error::RigidNode { body, .. } => wrong(
                format!("rigid.{body}.on"),
                message,
                "end one of the two groups before the other, or let the rigid body do both",
            ),
            Error::GivenTwice { constraint, .. }
            | Error::FollowsItself { constraint, .. }
            | Error::Factor { constraint, .. } => {
                let number = self.constraint_of.get(*constraint).copied().unwrap_or(0);
                let constraint = &file.constraint[number];
                let key = if constraint.periodic.is_some() {
                    "periodic"
                } else if constraint.mean.is_some() {
                    "mean"
                } else {
                    "point"
                };
                wrong(
                    format!("constraint.{number}.{key}"),
                    message,
                    "leave out what says it a second time",
                )
            }
            _ => wrong("name", message, "mend the problem"),
        }
    }

    fn mesh(&self) -> &Mesh {
        &self.problem.mesh
    }

    fn parameters(&mut self) -> Result<(), Wrong> {
        for (number, driver) in self.file.parameter.iter().enumerate() {
            let key = format!("parameter.{number}");
            if driver.name == "step" {
                let message = "the table calls the number of the step so";
                return Err(wrong(format!("{key}.name"), message, "give another name"));
            }
            let first = self.file.parameter[0].values.len();
            if driver.values.is_empty() || driver.values.len() != first {
                let message = match driver.values.len() {
                    0 => "no value: one for each step is needed".to_owned(),
                    own => format!(
                        "{own} values, but the first parameter has {first}: one for each step"
                    ),
                };
                let help = "give every parameter as many values as there are steps, at least one";
                return Err(wrong(format!("{key}.values"), message, help));
            }
            self.problem.parameter(&driver.name, Rule::Given);
        }
        Ok(())
    }

    /// A parameter by its name, in a use that gives it a dimension.
    fn parameter(
        &mut self,
        name: &str,
        dimension: &'static Dimension,
        key: &str,
    ) -> Result<Parameter, Wrong> {
        let drivers = &self.file.parameter;
        let Some(number) = drivers.iter().position(|driver| driver.name == name) else {
            let known: Vec<&str> = drivers.iter().map(|driver| driver.name.as_str()).collect();
            let message = format!("there is no parameter \"{name}\"");
            return Err(wrong(key, message, &one_of(&known, "add a [[parameter]]")));
        };
        match &self.uses[number] {
            Some((known, first)) if *known != dimension => {
                let message = format!(
                    "parameter \"{name}\" is {} here, but {} in {first}",
                    dimension.name, known.name
                );
                return Err(wrong(key, message, "drive the two by two parameters"));
            }
            _ => self.uses[number] = Some((dimension, key.to_owned())),
        }
        Ok(Parameter(number))
    }

    fn materials(&mut self) -> Result<(), Wrong> {
        let mut of_region: Vec<Option<Material>> = vec![None; self.mesh().regions.len()];
        self.problem.relaxations = vec![None; of_region.len()];
        for (number, material) in self.file.material.iter().enumerate() {
            let key = format!("material.{number}");
            let solid = solid_of(material, &key)?;
            if material.regions.is_empty() {
                let help = "name physical groups of the mesh";
                return Err(wrong(format!("{key}.regions"), "the list is empty", help));
            }
            for (at, name) in material.regions.iter().enumerate() {
                let key = format!("{key}.regions.{at}");
                let region = self.region(name, &key)?;
                self.problem.relaxations[region] = relaxation(material, &key)?;
                if of_region[region].replace(solid).is_some() {
                    let message = format!("region \"{name}\" has a material already");
                    return Err(wrong(key, message, "give each region one material"));
                }
            }
        }
        for (region, material) in of_region.into_iter().enumerate() {
            let Some(material) = material else {
                let message = format!("region \"{}\" has no material", self.mesh().regions[region]);
                let help = "add a [[material]] with this region, or add it to the regions of one";
                return Err(wrong("material", message, help));
            };
            self.problem.materials.push(material);
        }
        Ok(())
    }

    fn region(&self, name: &str, key: &str) -> Result<usize, Wrong> {
        let regions = &self.mesh().regions;
        regions
            .iter()
            .position(|known| known == name)
            .ok_or_else(|| {
                let message = format!("the mesh has no region \"{name}\"");
                let known: Vec<&str> = regions.iter().map(String::as_str).collect();
                wrong(key, message, &one_of(&known, NO_GROUP))
            })
    }

    /// Nodes of a surface, curve or point.
    fn nodes(&self, name: &str, key: &str) -> Result<Vec<u32>, Wrong> {
        self.mesh()
            .nodes_of(name)
            .filter(|nodes| !nodes.is_empty())
            .ok_or_else(|| self.unknown_group(name, key))
    }

    /// Node of a named point.
    fn point(&self, name: &str, key: &str) -> Result<u32, Wrong> {
        let nodes = self.nodes(name, key)?;
        if let [node] = nodes[..] {
            return Ok(node);
        }
        let message = format!("\"{name}\" has {} nodes, not one", nodes.len());
        Err(wrong(key, message, "name a physical point of the mesh"))
    }

    fn surface(&self, name: &str, key: &str) -> Result<Vec<Facet>, Wrong> {
        if let Some(surface) = self.mesh().surfaces.get(name) {
            return Ok(surface.clone());
        }
        let known: Vec<&str> = self.mesh().surfaces.keys().map(String::as_str).collect();
        let message = format!("the mesh has no surface \"{name}\"");
        Err(wrong(key, message, &one_of(&known, NO_GROUP)))
    }

    /// A surface that has the body on one side only, as what presses on it needs.
    fn outer_surface(&self, name: &str, key: &str) -> Result<Vec<Facet>, Wrong> {
        let surface = self.surface(name, key)?;
        let mesh = self.mesh();
        let boundary = || mesh.boundary().into_iter().collect();
        let boundary = self.boundary.get_or_init(boundary);
        let mut inner = surface.iter().filter(|facet| !boundary.contains(facet));
        let Some(&facet) = inner.next() else {
            return Ok(surface);
        };
        let nodes = mesh.facet_nodes(facet);
        let place = nodes.last().map_or([0.0; 3], |n| mesh.points[n as usize]);
        let message = format!(
            "\"{name}\" lies inside the body near {}, with cells on both sides",
            in_mm(place)
        );
        let help =
            "name an outer surface; for a slit or a cavity there, part the cells in the mesh";
        Err(wrong(key, message, help))
    }

    fn unknown_group(&self, name: &str, key: &str) -> Wrong {
        let mesh = self.mesh();
        let names = mesh.surfaces.keys().chain(mesh.node_sets.keys());
        let known: Vec<&str> = names.map(String::as_str).collect();
        let message = format!("the mesh has no surface, curve or point \"{name}\"");
        wrong(key, message, &one_of(&known, NO_GROUP))
    }

    /// Component of displacement along an axis of the file.
    fn component(&self, axis: Axis, key: &str) -> Result<usize, Wrong> {
        component(&self.axes, axis.number()).ok_or_else(|| {
            let message = format!("the mesh does not extend along {}", letter(axis.number()));
            let known: Vec<&str> = self.axes.iter().map(|&axis| letter(axis)).collect();
            wrong(
                key,
                message,
                &format!("its axes are {}", known.join(" and ")),
            )
        })
    }

    /// The factors along the components of the mesh.
    fn factors(&self, along: &Along, key: &str) -> Result<Vec<(usize, f64)>, Wrong> {
        let axes = [(Axis::X, along.x), (Axis::Y, along.y), (Axis::Z, along.z)];
        let mut factors = Vec::new();
        for (axis, factor) in axes {
            if let Some(factor) = factor {
                let key = format!("{key}.{}", letter(axis.number()));
                factors.push((self.component(axis, &key)?, factor));
            }
        }
        if factors.iter().all(|(_, factor)| *factor == 0.0) {
            let message = format!("\"{}\" moves nothing here: no factor is given", along.by);
            let help = format!("add a factor, such as {} = 1.0", letter(self.axes[0]));
            return Err(wrong(key, message, &help));
        }
        Ok(factors)
    }

    fn supports(&mut self) -> Result<(), Wrong> {
        for (number, support) in self.file.support.iter().enumerate() {
            let key = format!("support.{number}");
            self.nodes(&support.on, &format!("{key}.on"))?;
            if support.held.is_empty() && support.moved.is_none() {
                let help = "give held = [\"x\"], or moved = { by = \"…\", x = 1.0 }";
                return Err(wrong(key, "neither held nor moved", help));
            }
            let mut motions = Vec::new();
            for (at, &axis) in support.held.iter().enumerate() {
                let component = self.component(axis, &format!("{key}.held.{at}"))?;
                motions.push((component, Motion::Fixed));
            }
            if let Some(moved) = &support.moved {
                let key = format!("{key}.moved");
                let factors = self.factors(moved, &key)?;
                let by = self.parameter(&moved.by, &quantity::LENGTH, &format!("{key}.by"))?;
                for (component, factor) in factors {
                    if motions.iter().any(|(other, _)| *other == component) {
                        let axis = letter(self.axes[component]);
                        let message = format!("{axis} is held and moved at once");
                        return Err(wrong(key, message, "take it out of one of the two"));
                    }
                    motions.push((component, Motion::Driven(by, factor)));
                }
            }
            for (component, motion) in motions {
                self.problem
                    .support(&support.on, component, motion)
                    .map_err(|error| {
                        wrong(
                            format!("{key}.on"),
                            told(error, solid::ProblemError::scale),
                            "",
                        )
                    })?;
            }
        }
        Ok(())
    }

    fn rigid_bodies(&mut self) -> Result<(), Wrong> {
        for (number, rigid) in self.file.rigid.iter().enumerate() {
            let key = format!("rigid.{number}");
            let point = rigid.point.map(|point| self.inside(point));
            let found = self.problem.rigid_body(&rigid.on, point);
            let mut body = found.map_err(|_| {
                let mesh = self.mesh();
                let names = mesh.surfaces.keys().chain(mesh.node_sets.keys());
                let known: Vec<&str> = names.chain(&mesh.regions).map(String::as_str).collect();
                let message = format!("the mesh has no surface, curve or region \"{}\"", rigid.on);
                wrong(format!("{key}.on"), message, &one_of(&known, NO_GROUP))
            })?;
            let components = self.axes.len();
            // The six motions: none where nothing names them.
            let mut motions: [Option<Motion>; 6] = [None; 6];
            for (list, axes) in [("held", &rigid.held), ("unturned", &rigid.unturned)] {
                for (at, &axis) in axes.iter().enumerate() {
                    let key = format!("{key}.{list}.{at}");
                    let motion = match list {
                        "held" => self.component(axis, &key)?,
                        _ => 3 + self.turn(axis, &key)?.0,
                    };
                    motions[motion] = Some(Motion::Fixed);
                }
            }
            for (word, along) in [("moved", &rigid.moved), ("turned", &rigid.turned)] {
                let Some(along) = along else {
                    continue;
                };
                let key = format!("{key}.{word}");
                let (dimension, parts) = if word == "moved" {
                    (&quantity::LENGTH, self.factors(along, &key)?)
                } else {
                    (&quantity::ANGLE, self.turns(along, &key)?)
                };
                let by = self.parameter(&along.by, dimension, &format!("{key}.by"))?;
                for (motion, factor) in parts {
                    if motions[motion].is_some() {
                        let message = "one axis is held and moved at once";
                        return Err(wrong(key, message, "take it out of one of the two"));
                    }
                    motions[motion] = Some(Motion::Driven(by, factor));
                }
            }
            for &motion in self.problem.kinematics.rigid_motions() {
                let given = motions[motion].unwrap_or_else(|| {
                    let about = turns(self.problem.kinematics, &self.axes);
                    let about = about.iter().find(|(_, turn, _)| motion == 3 + turn);
                    let name = match about {
                        Some((axis, ..)) => format!("{} about {}", rigid.name, letter(*axis)),
                        None => format!("{} along {}", rigid.name, letter(self.axes[motion])),
                    };
                    Motion::Driven(self.problem.free_parameter(&name), 1.0)
                });
                if motion < components {
                    body.travel[motion] = given;
                } else if motion >= 3 {
                    body.turn[motion - 3] = given;
                }
            }
            self.problem.rigid_bodies.push(body);
        }
        Ok(())
    }

    /// Number of the component of the rotation vector about an axis of the file, and its sign: in
    /// the plane the one across it.
    fn turn(&self, axis: Axis, key: &str) -> Result<(usize, f64), Wrong> {
        let turns = turns(self.problem.kinematics, &self.axes);
        let found = turns.iter().find(|(known, ..)| *known == axis.number());
        found
            .map(|&(_, component, sign)| (component, sign))
            .ok_or_else(|| {
                let known: Vec<&str> = turns.iter().map(|(axis, ..)| letter(*axis)).collect();
                let message = format!("this body does not turn about {}", letter(axis.number()));
                let help = if known.is_empty() {
                    "leave it out: an axisymmetric body does not turn".to_owned()
                } else {
                    format!("it turns about {}", known.join(", "))
                };
                wrong(key, message, &help)
            })
    }

    /// The factors about the axes of a rotation, by the number of the motion.
    fn turns(&self, along: &Along, key: &str) -> Result<Vec<(usize, f64)>, Wrong> {
        let axes = [(Axis::X, along.x), (Axis::Y, along.y), (Axis::Z, along.z)];
        let mut factors = Vec::new();
        for (axis, factor) in axes {
            if let Some(factor) = factor {
                let key = format!("{key}.{}", letter(axis.number()));
                let (component, sign) = self.turn(axis, &key)?;
                factors.push((3 + component, sign * factor));
            }
        }
        if factors.iter().all(|(_, factor)| *factor == 0.0) {
            let message = format!("\"{}\" turns nothing here: no factor is given", along.by);
            return Err(wrong(key, message, "add a factor, such as z = 1.0"));
        }
        Ok(factors)
    }

    fn constraints(&mut self) -> Result<(), Wrong> {
        for (number, constraint) in self.file.constraint.iter().enumerate() {
            let key = format!("constraint.{number}");
            let mut drive = Vec::new();
            if let Some(moved) = &constraint.moved {
                let key = format!("{key}.moved");
                let factors = self.factors(moved, &key)?;
                let by = self.parameter(&moved.by, &quantity::LENGTH, &format!("{key}.by"))?;
                drive.extend(factors.into_iter().map(|(i, factor)| (i, by, factor)));
            }
            // Only along the axis of what follows.
            let only = |component: usize| -> Result<Option<(Parameter, f64)>, Wrong> {
                match drive.iter().find(|(i, ..)| *i != component) {
                    Some((other, ..)) => {
                        let axis = letter(self.axes[*other]);
                        let message = "this constraint is along another axis";
                        let help = format!("leave {axis} out");
                        Err(wrong(format!("{key}.moved.{axis}"), message, &help))
                    }
                    None => Ok(drive.first().map(|&(_, by, factor)| (by, factor))),
                }
            };
            if constraint.point.is_none() && !constraint.follows.is_empty() {
                let message = "only a point follows others";
                let help = "give point = { at = \"…\", along = \"x\" }";
                return Err(wrong(format!("{key}.follows"), message, help));
            }
            match (&constraint.periodic, &constraint.mean, &constraint.point) {
                (Some(surfaces), None, None) => {
                    for (at, name) in surfaces.iter().enumerate() {
                        self.nodes(name, &format!("{key}.periodic.{at}"))?;
                    }
                    let names = [surfaces[0].as_str(), surfaces[1].as_str()];
                    self.problem.periodic(names, &drive).map_err(|error| {
                        let help = "mesh both alike, and name surfaces that are shifted only";
                        wrong(
                            format!("{key}.periodic"),
                            told(error, solid::ProblemError::scale),
                            help,
                        )
                    })?;
                }
                (None, Some(mean), None) => {
                    let component = self.component(mean.along, &format!("{key}.mean.along"))?;
                    self.surface(&mean.on, &format!("{key}.mean.on"))?;
                    let drive = only(component)?;
                    self.problem
                        .keep_mean(&mean.on, component, drive)
                        .map_err(|error| {
                            wrong(
                                format!("{key}.mean"),
                                told(error, solid::ProblemError::scale),
                                "",
                            )
                        })?;
                }
                (None, None, Some(point)) => {
                    let node = self.point(&point.at, &format!("{key}.point.at"))?;
                    let component = self.component(point.along, &format!("{key}.point.along"))?;
                    let mut terms = Vec::new();
                    for (at, term) in constraint.follows.iter().enumerate() {
                        let key = format!("{key}.follows.{at}");
                        let other = self.point(&term.at, &format!("{key}.at"))?;
                        let along = self.component(term.along, &format!("{key}.along"))?;
                        terms.push(((other, along), term.factor));
                    }
                    if terms.is_empty() {
                        let help = "add follows = [{ at = \"…\", along = \"x\", factor = 1 }]; \
                                    a point that is moved alone is a support";
                        return Err(wrong(format!("{key}.point"), "it follows nothing", help));
                    }
                    let drive = only(component)?.into_iter().collect();
                    self.problem.constraints.push(solid::Constraint {
                        dependent: (node, component),
                        terms,
                        drive,
                    });
                }
                _ => {
                    let message = "exactly one of periodic, mean and point is needed";
                    return Err(wrong(key, message, "two constraints are two tables"));
                }
            }
            self.constraint_of
                .resize(self.problem.constraints.len(), number);
        }
        Ok(())
    }

    fn loads(&mut self) -> Result<(), Wrong> {
        for (number, load) in self.file.load.iter().enumerate() {
            let key = format!("load.{number}");
            match (&load.pressure, &load.force) {
                (Some(by), None) => {
                    let surface = self.outer_surface(&load.on, &format!("{key}.on"))?;
                    let parameter =
                        self.parameter(by, &quantity::STRESS, &format!("{key}.pressure"))?;
                    self.problem
                        .pressures
                        .push(solid::Pressure { surface, parameter });
                }
                (None, Some(force)) => self.force(&load.on, force, &key)?,
                _ => {
                    let message = "exactly one of pressure and force is needed";
                    return Err(wrong(key, message, "give one; two loads are two tables"));
                }
            }
        }
        Ok(())
    }

    /// A force of fixed direction, spread evenly over a surface or the points of a group.
    fn force(&mut self, on: &str, force: &Along, key: &str) -> Result<(), Wrong> {
        let nodes = self.nodes(on, &format!("{key}.on"))?;
        let key = format!("{key}.force");
        let factors = self.factors(force, &key)?;
        let parameter = self.parameter(&force.by, &quantity::FORCE, &format!("{key}.by"))?;
        let mut direction = [0.0; 3];
        for (component, factor) in factors {
            direction[component] = factor / self.depth;
        }
        let shares: Vec<(u32, f64)> = match self.mesh().surfaces.get(on) {
            Some(surface) => {
                let unit = |_| [1.0, 0.0, 0.0];
                let areas = traction(self.mesh(), self.problem.kinematics, surface, unit);
                areas
                    .into_iter()
                    .map(|(node, area)| (node, area[0]))
                    .collect()
            }
            None => nodes.into_iter().map(|node| (node, 1.0)).collect(),
        };
        let total: f64 = shares.iter().map(|(_, share)| share).sum();
        let forces = shares
            .into_iter()
            .map(|(node, share)| (node, direction.map(|d| d * share / total)));
        self.problem.dead_loads.push(DeadLoad {
            forces: forces.collect(),
            parameter,
        });
        Ok(())
    }

    fn cavities(&mut self) -> Result<(), Wrong> {
        for (number, cavity) in self.file.cavity.iter().enumerate() {
            let key = format!("cavity.{number}");
            let mut wall = Vec::new();
            for (at, name) in cavity.wall.iter().enumerate() {
                let key = format!("{key}.wall.{at}");
                for facet in self.outer_surface(name, &key)? {
                    if wall.contains(&facet) {
                        let message = format!("\"{name}\" was part of the wall before");
                        return Err(wrong(key, message, "name each surface once"));
                    }
                    wall.push(facet);
                }
            }
            if wall.is_empty() {
                let message = "the cavity has no wall";
                return Err(wrong(format!("{key}.wall"), message, "name its surfaces"));
            }
            let axis = match cavity.along {
                Some(axis) => self.component(axis, &format!("{key}.along"))?,
                None => self.axes.len() - 1,
            };
            let pressure = match (&cavity.pressure, cavity.trapped_gas) {
                (Some(_), Some(_)) => {
                    let message = "a trapped gas has the pressure that follows from its volume";
                    return Err(wrong(
                        format!("{key}.pressure"),
                        message,
                        "leave one of the two out",
                    ));
                }
                (Some(by), None) => {
                    self.parameter(by, &quantity::STRESS, &format!("{key}.pressure"))?
                }
                (None, _) => {
                    let name = format!("pressure in {}", cavity.name);
                    self.problem.parameter(&name, Rule::Given)
                }
            };
            let mut cavity_there = solid::Cavity {
                wall,
                axis,
                origin: 0.0,
                pressure,
            };
            let mesh = self.mesh();
            let held = self.held(axis);
            let origin = cuts::origin(&cavity_there, mesh, self.problem.kinematics, |node| {
                held.contains(&node)
            });
            cavity_there.origin = origin.place;
            let driven = self.driven(axis);
            if let Some(by) = origin.rim.iter().find_map(|node| driven.get(node)) {
                return Err(self.leaves_its_origin(&cavity_there, by, &key));
            }
            if origin.unknown {
                self.notes.push(format!(
                    "cavity \"{}\": its wall is open, and its volume is measured from {} = 0; a cut elsewhere is found where a support holds it along {1}",
                    cavity.name,
                    letter(self.axes[axis])
                ));
            }
            let mesh = self.mesh();
            let rest = cavity_there.volume(mesh, self.problem.kinematics, &mesh.points);
            let areas = traction(mesh, self.problem.kinematics, &cavity_there.wall, |_| {
                [1.0, 0.0, 0.0]
            });
            let area: f64 = areas.iter().map(|(_, area)| area[0].abs()).sum();
            if rest.abs() <= CLOSED * mesh.mean_side(&cavity_there.wall) * area {
                let message = "the wall has no volume at rest: its faces lie on each other";
                let help =
                    "draw a slit a little open; or press its faces apart by a [[load]] on each";
                return Err(wrong(format!("{key}.wall"), message, help));
            }
            if rest.is_nan() || rest <= 0.0 {
                let message = format!(
                    "the volume at rest comes out as {:.3e} m3: the wall is not that of a cavity",
                    rest * self.depth
                );
                let help =
                    "name all of its surfaces, or integrate along the axis across its openings";
                return Err(wrong(format!("{key}.wall"), message, help));
            }
            if let Some(scale) = cavity.trapped_gas {
                let law = solid::CavityLaw::Gas { scale, rest };
                self.problem.set_rule(pressure, Rule::Follows(number, law));
            }
            self.problem.cavities.push(cavity_there);
        }
        Ok(())
    }

    /// Nodes that supports hold along a component.
    fn held(&self, component: usize) -> BTreeSet<u32> {
        let axis = self.axes[component];
        let holds =
            |support: &&description::Support| support.held.iter().any(|held| held.number() == axis);
        let supports = self.file.support.iter().filter(holds);
        let nodes = supports.filter_map(|support| self.mesh().nodes_of(&support.on));
        nodes.flatten().collect()
    }

    /// Nodes that supports and rigid bodies move along a component, with what moves them.
    fn driven(&self, component: usize) -> BTreeMap<u32, String> {
        let axis = self.axes[component];
        let moves = |along: &Option<Along>| {
            let factors = along.as_ref().map(|along| [along.x, along.y, along.z]);
            let factor = factors.and_then(|factors| factors[axis]);
            factor.is_some_and(|factor| factor != 0.0)
        };
        let supports = self.file.support.iter().filter(|own| moves(&own.moved));
        let supports = supports.map(|own| (&own.on, format!("the support of \"{}\"", own.on)));
        let rigid = self.file.rigid.iter().filter(|own| {
            let held = own.held.iter().any(|held| held.number() == axis);
            !held || own.turned.is_some()
        });
        let rigid = rigid.map(|own| (&own.on, format!("the rigid body \"{}\"", own.name)));
        let mesh = self.mesh();
        let mut driven = BTreeMap::new();
        for (on, by) in supports.chain(rigid) {
            let nodes = mesh.nodes_of(on).or_else(|| mesh.nodes_of_region(on));
            for node in nodes.into_iter().flatten() {
                driven.insert(node, by.clone());
            }
        }
        driven
    }

    /// The mistake of a cavity whose opening moves away from where its volume is measured.
    fn leaves_its_origin(&self, cavity: &solid::Cavity, by: &str, key: &str) -> Wrong {
        let mesh = self.mesh();
        let closed = (0..self.axes.len()).filter(|&axis| {
            let other = solid::Cavity {
                axis,
                ..cavity.clone()
            };
            let origin = cuts::origin(&other, mesh, self.problem.kinematics, |_| false);
            origin.rim.is_empty() && !origin.unknown
        });
        let closed: Vec<String> = closed
            .map(|axis| format!("along = \"{}\"", letter(self.axes[axis])))
            .collect();
        let along = letter(self.axes[cavity.axis]);
        let message = format!(
            "its wall is open across {along}, and {by} moves the edge of that opening along {along}: its volume would be measured from where the opening was",
        );
        let help = if closed.is_empty() {
            "hold the opening, and move what presses the body".into()
        } else {
            format!(
                "give {}; or hold the opening, and move what presses the body",
                closed.join(" or ")
            )
        };
        wrong(format!("{key}.along"), message, &help)
    }

    fn obstacles(&mut self) -> Result<(), Wrong> {
        for (number, obstacle) in self.file.obstacle.iter().enumerate() {
            let key = format!("obstacle.{number}");
            let surface = self.outer_surface(&obstacle.surface, &format!("{key}.surface"))?;
            let shape = self.shape(&obstacle.shape, &format!("{key}.shape"))?;
            self.notes.extend(self.ring(&shape, &obstacle.name));
            let travel = match &obstacle.moved {
                Some(moved) => {
                    let key = format!("{key}.moved");
                    let mut direction = [0.0; 3];
                    for (component, factor) in self.factors(moved, &key)? {
                        direction[component] = factor;
                    }
                    let by = self.parameter(&moved.by, &quantity::LENGTH, &format!("{key}.by"))?;
                    Some((direction, by))
                }
                None => None,
            };
            let side = self.mesh().mean_side(&surface);
            let stiffest = self.moduli(&surface)[1];
            self.problem
                .contacts
                .push(Contact::Obstacle(solid::Obstacle {
                    surface,
                    shape,
                    travel,
                    stiffness: STIFFNESS[usize::from(obstacle.friction > 0.0)] * stiffest / side,
                    friction: obstacle.friction,
                    overlap_limit: overlap(obstacle.overlap, side, &key)?,
                }));
        }
        Ok(())
    }

    /// Refuses obstacles that lie in, or come to lie in, facets whose nodes supports hold or move in
    /// all components.
    fn driven_into_obstacles(&self, steps: &[Vec<f64>]) -> Result<(), Wrong> {
        let problem = &self.problem;
        let mesh = self.mesh();
        let components = problem.kinematics.components();
        let mut motions = HashMap::<u32, [Option<Motion>; 3]>::new();
        for support in &problem.supports {
            for &node in &support.nodes {
                motions.entry(node).or_default()[support.component] = Some(support.motion);
            }
        }
        let given = |parameter: Parameter| problem.rules()[parameter.0] == Rule::Given;
        let rest = vec![0.0; problem.rules().len()];
        let all: Vec<&Vec<f64>> = std::iter::once(&rest).chain(steps).collect();
        let contacts = problem.contacts.iter().zip(&self.file.obstacle);
        for (number, (contact, named)) in contacts.enumerate() {
            let Contact::Obstacle(obstacle) = contact else {
                continue;
            };
            if obstacle.travel.is_some_and(|(_, by)| !given(by)) {
                continue;
            }
            let side = mesh.mean_side(&obstacle.surface);
            let most = (DRIVEN_INTO * side).max(obstacle.overlap_limit);
            for &facet in &obstacle.surface {
                let nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
                // Where a facet is on the mean, by the targets; none where it may give way.
                let place = |targets: &[f64]| -> Option<[f64; 3]> {
                    let mut sum = [0.0; 3];
                    for node in &nodes {
                        let at = mesh.points[*node as usize];
                        for d in 0..3 {
                            sum[d] += at[d] / nodes.len() as f64;
                        }
                        let moved = motions.get(node)?;
                        for d in 0..components {
                            if let Motion::Driven(by, factor) = moved[d]? {
                                given(by).then_some(())?;
                                sum[d] += factor * targets[by.0] / nodes.len() as f64;
                            }
                        }
                    }
                    Some(sum)
                };
                for (step, targets) in all.iter().enumerate() {
                    let Some(place) = place(targets) else {
                        break;
                    };
                    let gap = obstacle.shape.gap(place, obstacle.shift(targets));
                    let overlap = -gap.distance;
                    if overlap <= most {
                        continue;
                    }
                    let message = format!(
                        "\"{}\" is {:.4} mm deep in \"{}\" near {} {}, where supports leave that surface no way out",
                        named.name,
                        1e3 * overlap,
                        named.surface,
                        in_mm(place),
                        if step == 0 {
                            "at rest".to_owned()
                        } else {
                            format!("at the end of step {step}")
                        },
                    );
                    let key = if step == 0 { "shape" } else { "moved" };
                    let help = "shorten its way, place it elsewhere, or leave the part that supports hold out of its surface";
                    return Err(wrong(format!("obstacle.{number}.{key}"), message, help));
                }
            }
        }
        Ok(())
    }

    /// Least and greatest shear modulus at a surface, Pa.
    fn moduli(&self, surface: &[Facet]) -> [f64; 2] {
        let moduli = surface.iter().map(|facet| {
            let region = self.mesh().region_of(facet.cell as usize);
            self.problem.materials[region].law().shear_modulus()
        });
        moduli.fold([f64::INFINITY, 0.0], |[least, most], modulus| {
            [least.min(modulus), most.max(modulus)]
        })
    }

    fn two_surfaces(&self, names: &[Group; 2], key: &str) -> Result<[Vec<Facet>; 2], Wrong> {
        let surface = |at: usize| self.outer_surface(&names[at], &format!("{key}.surfaces.{at}"));
        Ok([surface(0)?, surface(1)?])
    }

    fn contacts(&mut self) -> Result<(), Wrong> {
        for (number, contact) in self.file.contact.iter().enumerate() {
            let key = format!("contact.{number}");
            let surfaces = self.two_surfaces(&contact.surfaces, &key)?;
            // The softer of the two bodies decides.
            let modulus = self.moduli(&surfaces[0])[1].min(self.moduli(&surfaces[1])[1]);
            if contact.surfaces[0] != contact.surfaces[1] {
                self.notes.extend(self.shared(contact, &surfaces, &key)?);
            }
            let stopped = cuts::stopped(self.file, self.mesh(), &surfaces, &contact.surfaces);
            self.notes.extend(stopped.map(|what| {
                format!(
                    "contact \"{}\": {what} does not pass it, touching or not",
                    contact.name
                )
            }));
            let side = self.mesh().mean_side(&surfaces[1]);
            let mut pair = solid::SurfacePair::new(self.mesh(), surfaces, modulus);
            pair.friction = contact.friction;
            pair.overlap_limit = overlap(contact.overlap, side, &key)?;
            pair.reach = contact.reach.unwrap_or(pair.reach);
            self.problem.contacts.push(Contact::Surfaces(pair));
        }
        Ok(())
    }

    /// A note of two surfaces that share nodes.
    fn shared(
        &self,
        contact: &description::Contact,
        [first, second]: &[Vec<Facet>; 2],
        key: &str,
    ) -> Result<Option<String>, Wrong> {
        let [one, other] = &contact.surfaces;
        if first.iter().any(|facet| second.contains(facet)) {
            let message = format!("\"{one}\" and \"{other}\" have a part in common");
            let help = "name two surfaces without a common part, or one surface twice";
            return Err(wrong(format!("{key}.surfaces"), message, help));
        }
        let mesh = self.mesh();
        let nodes = |surface: &[Facet]| -> HashSet<u32> {
            let facets = surface.iter();
            facets.flat_map(|&facet| mesh.facet_nodes(facet)).collect()
        };
        let (first, second) = (nodes(first), nodes(second));
        let shared = first.intersection(&second);
        let count = shared.clone().count();
        Ok(shared.min().map(|&node| {
            format!(
                "contact \"{}\": \"{one}\" and \"{other}\" share {count} {}, one of them near {}; cells that meet there touch each other if they face each other before the load, or at a sharp corner of flat faces; the tip of another fold stays open by one cell",
                contact.name,
                if count == 1 { "node" } else { "nodes" },
                in_mm(mesh.points[node as usize])
            )
        }))
    }

    fn ties(&mut self) -> Result<(), Wrong> {
        for (number, tied) in self.file.tie.iter().enumerate() {
            let key = format!("tie.{number}");
            let surfaces = self.two_surfaces(&tied.surfaces, &key)?;
            if let Some(what) = cuts::stopped(self.file, self.mesh(), &surfaces, &tied.surfaces) {
                let message = format!("{what} does not pass a tie: it needs common nodes");
                let help = "mesh the two parts as one, or make both surfaces electrodes";
                return Err(wrong(format!("{key}.surfaces"), message, help));
            }
            let modulus = self.moduli(&surfaces[0])[1].max(self.moduli(&surfaces[1])[1]);
            let walls = tie(&self.problem, surfaces, modulus).map_err(|error| {
                let help = "name the finer surface first, and one that covers it second";
                wrong(
                    format!("{key}.surfaces"),
                    told(error, solid::ProblemError::scale),
                    help,
                )
            })?;
            self.problem.contacts.push(Contact::Walls(walls));
        }
        Ok(())
    }

    /// Sharp corners of surfaces that touch, about which they may fold. They come last: the contacts
    /// before have the order of the file.
    fn folds(&mut self) -> Result<(), Wrong> {
        for (number, contact) in self.file.contact.iter().enumerate() {
            let [mut surface, other] =
                self.two_surfaces(&contact.surfaces, &format!("contact.{number}"))?;
            if contact.surfaces[0] != contact.surfaces[1] {
                surface.extend(other);
            }
            let stiffness = FOLDING * self.moduli(&surface)[0];
            let walls = folds(&self.problem, &surface, stiffness);
            if !walls.points.is_empty() {
                self.problem.contacts.push(Contact::Walls(walls));
            }
        }
        Ok(())
    }

    /// Refuses cells that fill one place, and surfaces that lie on each other with nothing that joins
    /// them or keeps them apart.
    fn joined_or_apart(&self) -> Result<(), Wrong> {
        let mesh = self.mesh();
        let meetings = cuts::Meetings::of(self.file, mesh);
        let boundary: Vec<Facet> = mesh.boundary();
        let mut pairs = neighbours::abutting(mesh, &boundary);
        pairs.retain(|pair| !meetings.are_facets(mesh, *pair));
        if let Some(&[first, second]) = pairs.first() {
            let [one, other] = [first, second].map(|facet| self.called(facet));
            let message = format!(
                "{one} and {other} lie on each other near {} without common nodes ({} pairs of sides in all), and nothing joins them or keeps them apart",
                in_mm(middle(mesh, first)),
                pairs.len()
            );
            let help = "add a [[tie]] of the two surfaces if they stick, a [[contact]] if they may part or slide, or mesh them with common nodes (in Gmsh: BooleanFragments before meshing, or Coherence Mesh where the nodes coincide)";
            return Err(wrong("mesh.file", message, help));
        }
        let Some(overlap) = neighbours::overlap(mesh, |cells| meetings.are_cells(mesh, cells))
        else {
            return Ok(());
        };
        let region = |cell: u32| &mesh.regions[mesh.region_of(cell as usize)];
        let [one, other] = overlap.cells.map(region);
        let message = format!(
            "cells of {} fill one place near {}, {:.4} mm deep in each other ({} pairs of cells in all): what is there would count twice",
            if one == other {
                format!("region \"{one}\"")
            } else {
                format!("regions \"{one}\" and \"{other}\"")
            },
            in_mm(overlap.place),
            1e3 * overlap.depth,
            overlap.pairs
        );
        let help = "cut one out of the other before meshing (in Gmsh: BooleanFragments or BooleanDifference), or move them apart";
        Err(wrong("mesh.file", message, help))
    }

    /// Notes of electrodes that see each other through what is not meshed, where no field is solved.
    fn voids_between_electrodes(&mut self) {
        let Some(asked) = &self.file.capacitance else {
            return;
        };
        let mesh = self.mesh();
        let facets = |group: &Group| {
            let region = mesh.sides_of_region(group);
            region.or_else(|| mesh.surfaces.get(group.as_str()).cloned())
        };
        let conductors = asked.electrodes.iter().chain(&asked.ground);
        let conductors: Vec<_> = conductors
            .filter_map(|group| Some((group, facets(group)?)))
            .collect();
        let mut notes = Vec::new();
        for (at, (one, from)) in conductors.iter().enumerate() {
            for (other, to) in &conductors[..at] {
                let grounds = [one, other].map(|group| asked.ground.contains(group));
                let Some(void) = void_between(mesh, from, to).filter(|_| grounds != [true; 2])
                else {
                    continue;
                };
                notes.push(format!(
                    "capacitance: \"{other}\" and \"{one}\" see each other through {:.4} mm that is not meshed, near {}, on {:.0} % of the lines between them; the field there is left out, so that their capacitance comes out too small and may change the wrong way; mesh it as a region of permittivity 1 and of a very soft solid",
                    1e3 * void.length,
                    in_mm(void.place),
                    100.0 * void.share
                ));
            }
        }
        self.notes.extend(notes);
    }

    /// A surface that a facet belongs to, or else its region, in words.
    fn called(&self, facet: Facet) -> String {
        let mesh = self.mesh();
        let mut surfaces = mesh.surfaces.iter();
        match surfaces.find(|(_, facets)| facets.contains(&facet)) {
            Some((name, _)) => format!("surface \"{name}\""),
            None => format!(
                "a side of region \"{}\"",
                mesh.regions[mesh.region_of(facet.cell as usize)]
            ),
        }
    }

    fn shape(&self, shape: &Shape, key: &str) -> Result<solid::Shape, Wrong> {
        let unit = |vector: [f64; 3], key: String| {
            let inside = self.inside(vector);
            let length = inside.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length > 0.0 {
                return Ok(inside.map(|x| x / length));
            }
            let message = "the direction is zero in the space of the mesh";
            Err(wrong(key, message, "give a direction such as [0, 1, 0]"))
        };
        Ok(match *shape {
            Shape::Plane(plane) => solid::Shape::HalfSpace {
                point: self.inside(plane.point),
                normal: unit(plane.normal, format!("{key}.plane.normal"))?,
            },
            Shape::Sphere(sphere) => solid::Shape::Sphere {
                centre: self.inside(sphere.centre),
                radius: sphere.radius,
            },
            Shape::Cylinder(_) if self.problem.kinematics != Kinematics::Solid => {
                let message = "a cylinder with an axis is of a body in space";
                let help = "in a plane a sphere is the section of a cylinder across it";
                return Err(wrong(format!("{key}.cylinder"), message, help));
            }
            Shape::Cylinder(cylinder) => solid::Shape::Cylinder {
                point: self.inside(cylinder.point),
                axis: unit(cylinder.axis, format!("{key}.cylinder.axis"))?,
                radius: cylinder.radius,
            },
            Shape::Punch(punch) => solid::Shape::Punch {
                point: self.inside(punch.point),
                axis: unit(punch.axis, format!("{key}.punch.axis"))?,
                flat: punch.flat,
                rim: punch.rim,
            },
        })
    }

    /// A note of an obstacle that turns about the axis beside it.
    fn ring(&self, shape: &solid::Shape, name: &str) -> Option<String> {
        let ([radius, ..], what) = match *shape {
            solid::Shape::Sphere { centre, .. } => (centre, "centre"),
            solid::Shape::Punch { point, .. } => (point, "axis"),
            _ => return None,
        };
        let turns = self.problem.kinematics == Kinematics::Axisymmetric && radius != 0.0;
        turns.then(|| {
            format!("obstacle \"{name}\": its {what} is {:.4} mm off the axis of revolution, so it is a ring", 1e3 * radius)
        })
    }

    /// A place or direction of the file in the components of the mesh.
    fn inside(&self, given: [f64; 3]) -> [f64; 3] {
        let mut inside = [0.0; 3];
        for (x, &axis) in inside.iter_mut().zip(&self.axes) {
            *x = given[axis];
        }
        inside
    }

    /// What parameters prescribe in their own place.
    fn rules(&mut self) -> Result<(), Wrong> {
        for (number, driver) in self.file.parameter.iter().enumerate() {
            let Some(prescribed) = &driver.prescribes else {
                continue;
            };
            let key = format!("parameter.{number}.prescribes");
            let parameter = Parameter(number);
            let (quantity, dimension): (_, &'static Dimension) = match prescribed {
                Prescribed::Force => {
                    let moves = self.uses[number].as_ref();
                    if moves.is_none_or(|(dimension, _)| **dimension != quantity::LENGTH) {
                        let message = "only a parameter that moves something has a force";
                        return Err(wrong(key, message, "leave prescribes out"));
                    }
                    (solid::Quantity::Force(parameter), &quantity::FORCE)
                }
                Prescribed::Torque => {
                    let turns = self.uses[number].as_ref();
                    if turns.is_none_or(|(dimension, _)| **dimension != quantity::ANGLE) {
                        let message = "only a parameter that turns a rigid body has a torque";
                        return Err(wrong(key, message, "leave prescribes out"));
                    }
                    (solid::Quantity::Force(parameter), &quantity::MOMENT)
                }
                Prescribed::Displacement(of) => {
                    let node = self.point(&of.at, &format!("{key}.displacement.at"))?;
                    let component =
                        self.component(of.along, &format!("{key}.displacement.along"))?;
                    (
                        solid::Quantity::Displacement(node, component),
                        &quantity::LENGTH,
                    )
                }
                Prescribed::Volume(of) => {
                    let cavities = &self.file.cavity;
                    let Some(cavity) = cavities.iter().position(|cavity| cavity.name == of.of)
                    else {
                        let known: Vec<&str> = cavities.iter().map(|c| c.name.as_str()).collect();
                        let message = format!("there is no cavity \"{}\"", of.of);
                        let help = one_of(&known, "add a [[cavity]]");
                        return Err(wrong(format!("{key}.volume.of"), message, &help));
                    };
                    (solid::Quantity::Volume(cavity), &quantity::VOLUME)
                }
            };
            if self.uses[number].is_none() {
                return Err(self.unused(number));
            }
            self.problem.set_rule(parameter, Rule::Prescribes(quantity));
            self.uses[number] = Some((dimension, key));
        }
        Ok(())
    }

    fn unused(&self, number: usize) -> Wrong {
        let message = format!(
            "nothing uses parameter \"{}\"",
            self.file.parameter[number].name
        );
        let help = "name it in a support, a load, an obstacle or a cavity, or leave it out";
        wrong(format!("parameter.{number}.name"), message, help)
    }

    /// Names that only the outputs and the fields use.
    fn names(&self) -> Result<(), Wrong> {
        let output = &self.file.output;
        for (at, name) in output.reactions.iter().enumerate() {
            self.nodes(name, &format!("output.reactions.{at}"))?;
        }
        for (at, name) in output.displacements.iter().enumerate() {
            let key = format!("output.displacements.{at}");
            self.point(name, &key)?;
        }
        if let Some(capacitance) = &self.file.capacitance {
            self.capacitance_names(capacitance)?;
        }
        for (number, resistance) in self.file.resistance.iter().enumerate() {
            let key = format!("resistance.{number}");
            let from = self.nodes(&resistance.from, &format!("{key}.from"))?;
            let to = self.nodes(&resistance.to, &format!("{key}.to"))?;
            for (of, conductor) in resistance.conductor.iter().enumerate() {
                for (at, name) in conductor.regions.iter().enumerate() {
                    self.region(name, &format!("{key}.conductor.{of}.regions.{at}"))?;
                }
            }
            let regions = resistance.conductor.iter().flat_map(|part| &part.regions);
            let regions: Vec<&str> = regions.map(String::as_str).collect();
            if !cuts::connected(self.mesh(), &regions, &from, &to) {
                let message = format!(
                    "no conductor leads from \"{}\" to \"{}\": a current passes common nodes alone, neither contacts nor ties",
                    resistance.from, resistance.to
                );
                let help = "add the regions between them, or give two nodes that lie at one place one number";
                return Err(wrong(format!("{key}.conductor"), message, help));
            }
        }
        for (number, channel) in self.file.channel.iter().enumerate() {
            let key = format!("channel.{number}.cavity");
            if self.problem.kinematics != Kinematics::PlaneStrain {
                let message = "a channel runs along the depth of a plane_strain body";
                return Err(wrong(
                    key,
                    message,
                    "use [[resistance]] with a meshed conductor",
                ));
            }
            if !self
                .file
                .cavity
                .iter()
                .any(|cavity| cavity.name == channel.cavity)
            {
                let known: Vec<&str> = self.file.cavity.iter().map(|c| c.name.as_str()).collect();
                let message = format!("there is no cavity \"{}\"", channel.cavity);
                return Err(wrong(key, message, &one_of(&known, "add a [[cavity]]")));
            }
        }
        Ok(())
    }

    fn capacitance_names(&self, capacitance: &description::Capacitance) -> Result<(), Wrong> {
        // Nodes of a conductor: those of a region, a surface, a curve or a point.
        let group = |name: &str, key: String| {
            let region = self.mesh().nodes_of_region(name);
            region.map_or_else(|| self.nodes(name, &key), Ok)
        };
        let lists = [
            ("electrodes", &capacitance.electrodes),
            ("ground", &capacitance.ground),
            ("floating", &capacitance.floating),
        ];
        let mut nodes = [const { Vec::new() }; 3];
        for ((list, names), nodes) in lists.iter().zip(&mut nodes) {
            for (at, name) in names.iter().enumerate() {
                nodes.push(group(name, format!("capacitance.{list}.{at}"))?);
            }
        }
        let least = 2 - usize::from(!capacitance.ground.is_empty());
        if capacitance.electrodes.len() < least {
            let message = "a capacitance needs two electrodes, or one and a ground";
            return Err(wrong("capacitance.electrodes", message, "add one"));
        }
        for (number, dielectric) in capacitance.dielectric.iter().enumerate() {
            for (at, name) in dielectric.regions.iter().enumerate() {
                self.region(
                    name,
                    &format!("capacitance.dielectric.{number}.regions.{at}"),
                )?;
            }
        }
        let [mut electrodes, ground, floating] = nodes;
        electrodes.extend((!ground.is_empty()).then(|| ground.concat()));
        let fills = capacitance.dielectric.iter().flat_map(|part| &part.regions);
        let fills: Vec<&str> = fills.map(String::as_str).collect();
        let conductors = lists.iter().flat_map(|(_, names)| *names);
        let conductors: Vec<&String> = conductors.map(|group| &group.name).collect();
        let known =
            |region: &&String| fills.contains(&region.as_str()) || conductors.contains(region);
        if let Some(region) = self.mesh().regions.iter().find(|region| !known(region)) {
            let message = format!("region \"{region}\" has no permittivity");
            let help = "add it to the regions of a dielectric, or name it among the electrodes";
            return Err(wrong("capacitance.dielectric", message, help));
        }
        if let Some(alone) = cuts::isolated(self.mesh(), &fills, &electrodes, &floating)
            && let Some(name) = capacitance.electrodes.get(alone)
        {
            let message = format!(
                "no dielectric leads from \"{name}\" to another electrode or to ground: a field passes common nodes alone, neither contacts nor ties"
            );
            let help = "add the regions between them to a dielectric, or give two nodes that lie at one place one number";
            let key = format!("capacitance.electrodes.{alone}");
            return Err(wrong(key, message, help));
        }
        Ok(())
    }

    /// Targets of all steps in the order of the parameters, and their dimensions.
    #[allow(clippy::type_complexity)]
    fn steps(&self) -> Result<(Vec<Vec<f64>>, Vec<&'static Dimension>), Wrong> {
        let mut dimensions = Vec::new();
        let count = self.file.parameter.first().map_or(0, |p| p.values.len());
        let mut steps = vec![vec![0.0; self.problem.rules().len()]; count];
        for (number, driver) in self.file.parameter.iter().enumerate() {
            let Some((dimension, _)) = &self.uses[number] else {
                return Err(self.unused(number));
            };
            dimensions.push(*dimension);
            for (step, value) in driver.values.iter().enumerate() {
                let key = format!("parameter.{number}.values.{step}");
                steps[step][number] = self.target(number, dimension, *value, &key)?;
            }
        }
        Ok((steps, dimensions))
    }

    fn target(
        &self,
        number: usize,
        dimension: &'static Dimension,
        given: AnyQuantity,
        key: &str,
    ) -> Result<f64, Wrong> {
        if given.dimension != dimension {
            let use_of = self.uses[number]
                .as_ref()
                .map_or("", |(_, key)| key.as_str());
            let message = format!(
                "this is {}; {use_of} needs {}",
                given.dimension.name, dimension.name
            );
            let help = format!("use one of: {}", dimension.symbols());
            return Err(wrong(key, message, &help));
        }
        // Solved per unit of depth; a force of a dead load has the depth in its direction.
        let prescribed = self.file.parameter[number].prescribes.as_ref();
        if matches!(prescribed, Some(Prescribed::Volume(_))) && given.value <= 0.0 {
            let message = "a cavity has a volume above 0";
            let help = "give the volume that is left; walls that meet before need a [[contact]]";
            return Err(wrong(key, message, help));
        }
        Ok(match prescribed {
            Some(Prescribed::Force | Prescribed::Torque | Prescribed::Volume(_)) => {
                given.value / self.depth
            }
            _ => given.value,
        })
    }
}

/// What to do where a name is not known: take one that is, or what `none` says where there is none.
pub(super) fn one_of(known: &[&str], none: &str) -> String {
    match known {
        [] => none.to_owned(),
        known => format!("give one of: {}", known.join(", ")),
    }
}

/// Where a facet is on the mean of its nodes.
fn middle(mesh: &Mesh, facet: Facet) -> [f64; 3] {
    let count = mesh.facet_nodes(facet).count() as f64;
    mesh.facet_nodes(facet).fold([0.0; 3], |sum, node| {
        std::array::from_fn(|d| sum[d] + mesh.points[node as usize][d] / count)
    })
}

/// What of the stress of a material relaxes.
fn relaxation(material: &RegionMaterial, key: &str) -> Result<Option<Relaxation>, Wrong> {
    if material.relaxation.is_empty() {
        return Ok(None);
    }
    let terms = material.relaxation.iter().map(|term| PronyTerm {
        fraction: term.fraction,
        time: term.time,
    });
    let terms: Vec<PronyTerm> = terms.collect();
    Relaxation::new(&terms).map(Some).map_err(|error| {
        let help = "give fractions of the sudden stress that leave some of it";
        wrong(format!("{key}.relaxation"), error.to_string(), help)
    })
}

/// Solids that relax need the time of each step, and of the others nobody asks it.
fn durations(file: &ProblemFile) -> Result<(), Wrong> {
    let relaxes = file.material.iter().any(|one| !one.relaxation.is_empty());
    let steps = file.parameter.first().map_or(0, |one| one.values.len());
    let found = file.durations.len();
    if relaxes && found != steps {
        let message = format!("{found} times for {steps} steps of a solid that relaxes");
        let help =
            "give each step its time: durations = [\"0.1 s\", …], \"0 s\" where it is sudden";
        return Err(wrong("durations", message, help));
    }
    if !relaxes && found > 0 {
        let help = "take durations out, or give a material its relaxation";
        return Err(wrong(
            "durations",
            "no solid relaxes: time changes nothing",
            help,
        ));
    }
    Ok(())
}

/// The solid that a material describes.
fn solid_of(material: &RegionMaterial, key: &str) -> Result<Material, Wrong> {
    let volumetric = match (&material.law, material.compressibility) {
        (Law::LinearElastic(_), Some(_)) => {
            let message = "Poisson's ratio says how a linear_elastic solid gives way";
            let help = "leave compressibility out";
            return Err(wrong(format!("{key}.compressibility"), message, help));
        }
        (Law::LinearElastic(_), None) if material.auxetic.is_some() => {
            let message = "Poisson's ratio says itself whether a linear_elastic solid is auxetic";
            return Err(wrong(format!("{key}.auxetic"), message, "leave it out"));
        }
        (Law::LinearElastic(solid), None) => {
            return Material::linear_elastic(solid.young_modulus, solid.poisson_ratio)
                .map_err(|error| wrong(format!("{key}.law"), error.to_string(), ""));
        }
        (_, None) => {
            let help = "add compressibility = \"incompressible\", or \
                        { quadratic = { bulk_modulus = \"…\" } }";
            return Err(wrong(key, "compressibility is missing", help));
        }
        (_, Some(Compressibility::Incompressible)) => Volumetric::Incompressible,
        (_, Some(Compressibility::Quadratic(bulk))) => Volumetric::Quadratic(bulk.bulk_modulus),
        (_, Some(Compressibility::Logarithmic(bulk))) => Volumetric::Logarithmic(bulk.bulk_modulus),
    };
    let law = match &material.law {
        Law::NeoHookean(solid) => Ok(material::Law::neo_hookean(solid.shear_modulus)),
        Law::MooneyRivlin(solid) => Ok(material::Law::MooneyRivlin {
            c10: solid.c10,
            c01: solid.c01,
        }),
        Law::Yeoh(solid) => Ok(material::Law::Yeoh {
            c10: solid.c10,
            c20: solid.c20,
            c30: solid.c30,
        }),
        Law::Gent(solid) => Ok(material::Law::Gent {
            shear: solid.shear_modulus,
            limit: solid.limit,
        }),
        Law::Ogden(terms) => {
            let terms: Vec<_> = terms
                .iter()
                .map(|term| material::OgdenTerm {
                    modulus: term.modulus,
                    exponent: term.exponent,
                })
                .collect();
            material::Law::ogden(&terms)
        }
        Law::LinearElastic(solid) => {
            Material::linear_elastic(solid.young_modulus, solid.poisson_ratio)
                .map(|solid| *solid.law())
        }
    };
    law.and_then(|law| Material::new(law, volumetric))
        .map_err(|error| {
            wrong(
                format!("{key}.law"),
                error.to_string(),
                "give other constants",
            )
        })
        .and_then(|solid| as_meant(material, solid, key))
}

/// Refuses a solid that grows wider when it is stretched, unless the file says so: moduli in two units
/// look like that.
fn as_meant(material: &RegionMaterial, solid: Material, key: &str) -> Result<Material, Wrong> {
    let ratio = solid.poisson_ratio();
    let auxetic = material.auxetic == Some(true);
    if auxetic == (ratio < 0.0) {
        return Ok(solid);
    }
    if auxetic {
        let message = format!("Poisson's ratio is {ratio:.4}: the solid is not auxetic");
        return Err(wrong(format!("{key}.auxetic"), message, "leave it out"));
    }
    let message = format!(
        "Poisson's ratio is {ratio:.4}: with a bulk modulus below two thirds of the shear modulus, {:.4} kPa, the solid grows wider when it is stretched",
        1e-3 * solid.law().shear_modulus()
    );
    let help = "compare the units of the moduli; a solid that is meant so says auxetic = true";
    Err(wrong(format!("{key}.compressibility"), message, help))
}
