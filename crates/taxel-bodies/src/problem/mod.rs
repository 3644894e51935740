//! A body of one's own: problem file and mesh to the steps of a solution.
//!
//! [`ProblemFile`] is what a person writes. With the bytes of its mesh it becomes a [`Body`],
//! which goes from step to step and answers with a row of the table, the deformed mesh and a
//! picture.

mod axes;
mod body;
mod build;
mod cuts;
mod description;
mod fields;
mod group;
mod mistake;
mod picture;
mod saved;
mod selection;

pub use body::{Body, Effort, Ended};
pub use description::{
    Along, Bulk, Capacitance, Cavity, Channel, Compressibility, Conductor, Contact, Cylinder,
    Dielectric, Driver, Gent, Geometry, Law, Load, MeshFile, NeoHookean, Obstacle, OfCavity,
    OgdenTerm, Output, Picture, Plane, PlaneStrain, PointAlong, Prescribed, ProblemFile, Punch,
    RegionMaterial, Resistance, Shape, SolverOptions, Sphere, Support, Tie, Yeoh,
};
pub use group::{Axis, BoxCorners, Group, PlaneAt, Selection};
pub use saved::SavedError;

use taxel_ground::InputError;
use taxel_ground::schema;

/// Shipped problems: name, text and mesh.
const SHIPPED: &[(&str, &str, &[u8])] = &[
    (
        "dome",
        include_str!("../../problems/dome.toml"),
        include_bytes!("../../problems/dome.msh"),
    ),
    (
        "channel",
        include_str!("../../problems/channel.toml"),
        include_bytes!("../../problems/channel.msh"),
    ),
    (
        "fingertip",
        include_str!("../../problems/fingertip.toml"),
        include_bytes!("../../problems/fingertip.msh"),
    ),
    (
        "pad",
        include_str!("../../problems/pad.toml"),
        include_bytes!("../../problems/pad.msh"),
    ),
];

const REFERENCE_HEAD: &str = "\
# Problem-file reference

Every key of a problem file. `taxel schema problem-reference` prints this page from the types that read the file, so it
is current. [The guide](own-body.md) explains how to write one.

Each section is a table of the file; its title is the path of the table, and the path of a key is that title, a dot and
the key. Keys that belong to one value of several are required where that value is chosen. `[]` in a path stands for
each entry of a list, which is written as a table in double brackets: `[[support]]`. A required key has no default. Any
other key is refused.
";

impl ProblemFile {
    /// Reads a problem; `file` is its name for messages. Rules that need the mesh are those of
    /// [`Body::new`].
    ///
    /// # Errors
    /// The first mistake with its place.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        taxel_material::parse_problem(file, text)
    }

    /// Names of the shipped problems.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, ..)| *name)
    }

    /// Text of a shipped problem.
    pub fn shipped_text(name: &str) -> Option<&'static str> {
        let mut shipped = SHIPPED.iter();
        shipped
            .find(|(known, ..)| *known == name)
            .map(|(_, text, _)| *text)
    }

    /// Mesh of a shipped problem, the bytes of its file.
    pub fn shipped_mesh(name: &str) -> Option<&'static [u8]> {
        let mut shipped = SHIPPED.iter();
        shipped
            .find(|(known, ..)| *known == name)
            .map(|(.., mesh)| *mesh)
    }

    /// The JSON schema of the problem file; editors complete and check with it.
    pub fn json_schema() -> String {
        taxel_material::schema::<Self>()
    }

    /// The reference of the problem file, Markdown: every key with its meaning, unit and range.
    pub fn reference() -> String {
        schema::reference::<Self>(REFERENCE_HEAD)
    }

    /// Depth of a plane body, m; 1 of others, whose results are those of the whole.
    pub(crate) fn depth(&self) -> f64 {
        match self.geometry {
            Geometry::PlaneStrain(plane) => plane.depth,
            Geometry::Axisymmetric | Geometry::Solid => 1.0,
        }
    }
}
