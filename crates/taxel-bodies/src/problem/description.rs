//! The problem file as its text describes it.

use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

use super::group::{Axis, Group};
use taxel::mechanics::{LinearElastic, MooneyRivlin};
use taxel_ground::quantity::{
    self, AnyLength, AnyNumber, AnyQuantity, AnyStress, Checked, NonNegativeTime, PositiveFraction,
    PositiveLength, PositiveNumber, PositiveResistivity, PositiveStress, Ratio,
    RelativePermittivity,
};
use taxel_material::Relaxation;

/// Two names, no more and no fewer.
fn pair<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[Group; 2], D::Error> {
    Vec::deserialize(deserializer)?
        .try_into()
        .map_err(|names: Vec<Group>| {
            let found = names.len();
            D::Error::custom(format!("the list has {found} names; exactly 2 are needed"))
        })
}

fn optional_pair<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<[Group; 2]>, D::Error> {
    pair(deserializer).map(Some)
}

fn times<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    let times = Vec::<Checked<NonNegativeTime>>::deserialize(deserializer)?;
    Ok(times.into_iter().map(|time| time.0).collect())
}

/// A body as its file describes it: mesh, solids, supports, loads and what is asked for.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProblemFile {
    /// Version of this format: 1.
    #[schemars(extend("const" = 1))]
    pub schema: u32,
    /// Name of the problem.
    pub name: String,
    /// Body that the mesh stands for.
    pub geometry: Geometry,
    /// The mesh.
    pub mesh: MeshFile,
    /// Solids of the regions.
    pub material: Vec<RegionMaterial>,
    /// What drives supports, obstacles and loads, step by step.
    pub parameter: Vec<Driver>,
    /// Time that each step takes, s, at a constant rate; 0 is sudden. Only solids that relax feel it:
    /// a step that changes nothing but lasts is relaxation, under a prescribed force creep.
    #[serde(default, deserialize_with = "times")]
    #[schemars(with = "Vec<Checked<NonNegativeTime>>")]
    pub durations: Vec<f64>,
    /// Surfaces, curves and points that do not move, or are moved.
    #[serde(default)]
    pub support: Vec<Support>,
    /// Parts of the body that are rigid.
    #[serde(default)]
    pub rigid: Vec<Rigid>,
    /// Surfaces and points that move together.
    #[serde(default)]
    pub constraint: Vec<Constraint>,
    /// Pressures and forces.
    #[serde(default)]
    pub load: Vec<Load>,
    /// Rigid obstacles that surfaces of the body touch.
    #[serde(default)]
    pub obstacle: Vec<Obstacle>,
    /// Surfaces of the mesh that touch each other: those of two bodies, or of a body and itself.
    #[serde(default)]
    pub contact: Vec<Contact>,
    /// Surfaces that stick together although their meshes do not match.
    #[serde(default)]
    pub tie: Vec<Tie>,
    /// Cavities: their volume, and what fills them.
    #[serde(default)]
    pub cavity: Vec<Cavity>,
    /// Capacitances between electrodes in the deformed body.
    pub capacitance: Option<Capacitance>,
    /// Resistances between surfaces of conducting regions of the deformed body.
    #[serde(default)]
    pub resistance: Vec<Resistance>,
    /// Resistances of cavities that run along the depth of a plane body, filled by a liquid
    /// that conducts.
    #[serde(default)]
    pub channel: Vec<Channel>,
    /// What else the table shows.
    #[serde(default)]
    pub output: Output,
    /// The picture of the deformed body.
    #[serde(default)]
    pub picture: Picture,
    /// The search for each step.
    #[serde(default)]
    pub solver: SolverOptions,
}

/// Body that a mesh stands for.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Geometry {
    /// A section in a plane, without stretch across it.
    PlaneStrain(PlaneStrain),
    /// Half of a section, with the radius first and the axis of revolution second.
    Axisymmetric,
    /// A body in space.
    Solid,
}

/// A plane section and its extent across the plane.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneStrain {
    /// Extent across the plane, m: forces, volumes, capacitances and resistances are those of
    /// this depth.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub depth: f64,
}

/// File of a mesh.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshFile {
    /// Mesh of Gmsh, MSH 2.2 or 4.1, text or binary; its name counts from the folder of this file.
    pub file: String,
    /// Length of one unit of its coordinates, m, such as `"1 mm"`.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub unit: f64,
}

/// The solid of some regions.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionMaterial {
    /// Physical groups of the mesh.
    pub regions: Vec<String>,
    /// A law by its name, one of `taxel material list`, or `{ file = "silicone.toml" }`: a law file of
    /// `taxel material fit`, from the folder of this file. Its solid is incompressible unless
    /// `compressibility` says otherwise.
    pub material: Option<String>,
    /// Resistance to a change of shape; in the place of `material`.
    #[schemars(with = "Option<Law>")]
    pub law: Law,
    /// Resistance to a change of volume; not for `linear_elastic`, whose Poisson's ratio says it.
    pub compressibility: Option<Compressibility>,
    /// Parts of the stress that relax; the law is then the answer to a sudden load, and `durations`
    /// says how long each step takes. A law file brings its own.
    #[serde(default)]
    pub relaxation: Vec<Relaxation>,
    /// `true`: Poisson's ratio is below zero and meant so, as of some foams. Without it a solid whose
    /// moduli say so is refused, because it is usually a slip of units.
    pub auxetic: Option<bool>,
}

/// Law of a solid; the key names the model.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Law {
    /// W = μ/2 (I1 − 3).
    NeoHookean(NeoHookean),
    /// W = C10 (I1 − 3) + C01 (I2 − 3).
    MooneyRivlin(MooneyRivlin),
    /// W = C10 x + C20 x² + C30 x³ with x = I1 − 3.
    Yeoh(Yeoh),
    /// W = −μ Jm/2 ln(1 − (I1 − 3)/Jm): it stiffens without bound near I1 = 3 + Jm.
    Gent(Gent),
    /// W = Σ μ/α (λ1^α + λ2^α + λ3^α − 3), one to four terms.
    Ogden(Vec<OgdenTerm>),
    /// A stiff part: linear at small strain, at any rotation.
    LinearElastic(LinearElastic),
}

/// W = μ/2 (I1 − 3).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NeoHookean {
    /// Shear modulus μ, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub shear_modulus: f64,
}

/// W = C10 x + C20 x² + C30 x³ with x = I1 − 3.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Yeoh {
    /// Factor of x, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub c10: f64,
    /// Factor of x², Pa.
    #[serde(deserialize_with = "quantity::one::<AnyStress, _>")]
    #[schemars(with = "Checked<AnyStress>")]
    pub c20: f64,
    /// Factor of x³, Pa.
    #[serde(deserialize_with = "quantity::one::<AnyStress, _>")]
    #[schemars(with = "Checked<AnyStress>")]
    pub c30: f64,
}

/// W = −μ Jm/2 ln(1 − (I1 − 3)/Jm).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gent {
    /// Shear modulus μ, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub shear_modulus: f64,
    /// Limit Jm of I1 − 3.
    #[serde(deserialize_with = "quantity::one::<PositiveNumber, _>")]
    #[schemars(with = "Checked<PositiveNumber>")]
    pub limit: f64,
}

/// One term of Ogden's law.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OgdenTerm {
    /// Modulus μ, Pa.
    #[serde(deserialize_with = "quantity::one::<AnyStress, _>")]
    #[schemars(with = "Checked<AnyStress>")]
    pub modulus: f64,
    /// Exponent α, not zero.
    #[serde(deserialize_with = "quantity::one::<AnyNumber, _>")]
    #[schemars(with = "Checked<AnyNumber>")]
    pub exponent: f64,
}

/// Resistance of a solid to a change of volume.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Compressibility {
    /// The volume stays as it is.
    Incompressible,
    /// U = K/2 (J − 1)².
    Quadratic(Bulk),
    /// U = K/4 (J² − 1 − 2 ln J).
    Logarithmic(Bulk),
}

/// Bulk modulus of a solid.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bulk {
    /// Bulk modulus K, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub bulk_modulus: f64,
}

/// A parameter: one value for each step. It is a way of a support, a rigid body or an obstacle, an
/// angle of a rigid body, a pressure or a force, as its use says.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Driver {
    /// Name, to which supports, loads and obstacles refer.
    pub name: String,
    /// Values at the end of each step; all parameters have equally many. It begins at zero.
    pub values: Vec<AnyQuantity>,
    /// The quantity that the values are, if the parameter itself is to be found.
    pub prescribes: Option<Prescribed>,
}

/// A quantity that a step prescribes in the place of its parameter.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Prescribed {
    /// Force with which the parameter pushes its supports, rigid bodies and obstacles, N.
    Force,
    /// Torque with which the parameter turns its rigid bodies, N m.
    Torque,
    /// Displacement of a point, m.
    Displacement(PointAlong),
    /// Volume of a cavity, m³.
    Volume(OfCavity),
}

/// A named point and an axis.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointAlong {
    /// Physical group of one point.
    pub at: Group,
    /// Axis of the displacement.
    pub along: Axis,
}

/// A cavity by its name.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OfCavity {
    /// Name of the cavity.
    pub of: String,
}

/// A part of the body that is held or moved.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// Physical group: a surface (in the plane a curve), a curve or a point.
    pub on: Group,
    /// Axes along which it does not move.
    #[serde(default)]
    pub held: Vec<Axis>,
    /// Motion along the axes that are named in it.
    pub moved: Option<Along>,
}

/// A parameter with its factor along each axis.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Along {
    /// Name of the parameter.
    pub by: String,
    /// Factor along x.
    #[serde(default, deserialize_with = "quantity::some::<AnyNumber, _>")]
    #[schemars(with = "Option<Checked<AnyNumber>>")]
    pub x: Option<f64>,
    /// Factor along y.
    #[serde(default, deserialize_with = "quantity::some::<AnyNumber, _>")]
    #[schemars(with = "Option<Checked<AnyNumber>>")]
    pub y: Option<f64>,
    /// Factor along z.
    #[serde(default, deserialize_with = "quantity::some::<AnyNumber, _>")]
    #[schemars(with = "Option<Checked<AnyNumber>>")]
    pub z: Option<f64>,
}

/// A part of the body whose points keep their distances: a stiff plate on a surface, or a region.
/// It moves and turns freely along and about the axes that are not named.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rigid {
    /// Name, for the table.
    pub name: String,
    /// Physical group: a surface (in the plane a curve), a curve or a region.
    pub on: Group,
    /// The point about which it turns: x, y and z before it moves, m; the mean of its nodes if
    /// left out.
    #[serde(
        default,
        deserialize_with = "quantity::optional_list::<3, AnyLength, _>"
    )]
    #[schemars(with = "Option<[Checked<AnyLength>; 3]>")]
    pub point: Option<[f64; 3]>,
    /// Axes along which that point does not move.
    #[serde(default)]
    pub held: Vec<Axis>,
    /// Motion of that point along the axes that are named in it.
    pub moved: Option<Along>,
    /// Axes about which it does not turn; in the plane the one across it.
    #[serde(default)]
    pub unturned: Vec<Axis>,
    /// Rotation about the axes that are named in it, rad: the components of the rotation vector.
    pub turned: Option<Along>,
}

/// Surfaces or points that move together: exactly one of `periodic`, `mean` and `point`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Constraint {
    /// Physical groups of two surfaces with the same mesh, one shifted from the other: each point
    /// of the second moves as the one of the first opposite to it.
    #[serde(default, deserialize_with = "optional_pair")]
    pub periodic: Option<[Group; 2]>,
    /// A surface whose mean displacement along an axis is given.
    pub mean: Option<MeanAlong>,
    /// A point that follows others along an axis.
    pub point: Option<PointAlong>,
    /// What the point follows: the sum of these displacements.
    #[serde(default)]
    pub follows: Vec<Term>,
    /// What is added to the displacement that follows, along the axes named in it; for `mean` the
    /// mean itself. Nothing if left out.
    pub moved: Option<Along>,
}

/// A surface and an axis.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeanAlong {
    /// Physical group: a surface (in the plane a curve).
    pub on: Group,
    /// Axis of the displacement.
    pub along: Axis,
}

/// A share of the displacement of a point.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// Physical group of one point.
    pub at: Group,
    /// Axis of the displacement.
    pub along: Axis,
    /// Its factor.
    #[serde(deserialize_with = "quantity::one::<AnyNumber, _>")]
    #[schemars(with = "Checked<AnyNumber>")]
    pub factor: f64,
}

/// A pressure or a force.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Physical group: a surface (in the plane a curve); for a force also a curve or a point.
    pub on: Group,
    /// Parameter of a pressure that stays normal to the deformed surface, pressing positive.
    pub pressure: Option<String>,
    /// A force of fixed direction, spread evenly over the undeformed surface.
    pub force: Option<Along>,
}

/// A rigid obstacle.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Name, for the table.
    pub name: String,
    /// Physical group: the surface of the body that may touch it.
    pub surface: Group,
    /// Shape, before it moves.
    pub shape: Shape,
    /// Its motion.
    pub moved: Option<Along>,
    /// Coefficient of friction (Coulomb); 0 without.
    #[serde(deserialize_with = "quantity::one::<Ratio, _>")]
    #[schemars(with = "Checked<Ratio>")]
    pub friction: f64,
    /// Overlap that is accepted, m; 1e-4 of the mean side of a cell there if left out.
    #[serde(default, deserialize_with = "quantity::some::<PositiveLength, _>")]
    #[schemars(with = "Option<Checked<PositiveLength>>")]
    pub overlap: Option<f64>,
}

/// Shape of an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// All that lies behind a plane.
    Plane(Plane),
    /// A ball; in the plane a cylinder across it.
    Sphere(Sphere),
    /// A cylinder that lies in space.
    Cylinder(Cylinder),
    /// A flat punch with a rounded rim.
    Punch(Punch),
}

/// All that lies behind a plane.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// A point of the plane: x, y and z, m.
    #[serde(deserialize_with = "quantity::list::<3, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 3]")]
    pub point: [f64; 3],
    /// Direction to the free side: x, y and z, of any length.
    #[serde(deserialize_with = "quantity::list::<3, AnyNumber, _>")]
    #[schemars(with = "[Checked<AnyNumber>; 3]")]
    pub normal: [f64; 3],
}

/// A ball.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Centre: x, y and z, m.
    #[serde(deserialize_with = "quantity::list::<3, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 3]")]
    pub centre: [f64; 3],
    /// Radius, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub radius: f64,
}

/// A cylinder.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// A point of its axis: x, y and z, m.
    #[serde(deserialize_with = "quantity::list::<3, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 3]")]
    pub point: [f64; 3],
    /// Direction of its axis: x, y and z, of any length.
    #[serde(deserialize_with = "quantity::list::<3, AnyNumber, _>")]
    #[schemars(with = "[Checked<AnyNumber>; 3]")]
    pub axis: [f64; 3],
    /// Radius, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub radius: f64,
}

/// A flat punch, round in space and in axisymmetry, a bar in plane strain.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Punch {
    /// Middle of its face: x, y and z, m.
    #[serde(deserialize_with = "quantity::list::<3, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 3]")]
    pub point: [f64; 3],
    /// Direction from the face into the punch: x, y and z, of any length.
    #[serde(deserialize_with = "quantity::list::<3, AnyNumber, _>")]
    #[schemars(with = "[Checked<AnyNumber>; 3]")]
    pub axis: [f64; 3],
    /// Radius (half width) of the flat part of its face, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub flat: f64,
    /// Radius of its rim, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub rim: f64,
}

/// Two surfaces of the mesh that may not pass through each other.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Name, for the table.
    pub name: String,
    /// Physical groups of the two surfaces, the one with the finer mesh first; the same one twice
    /// for a surface that touches itself, such as the wall of a channel.
    #[serde(deserialize_with = "pair")]
    pub surfaces: [Group; 2],
    /// Coefficient of friction (Coulomb); 0 without.
    #[serde(deserialize_with = "quantity::one::<Ratio, _>")]
    #[schemars(with = "Checked<Ratio>")]
    pub friction: f64,
    /// Overlap that is accepted, m; 1e-4 of the mean side of a cell there if left out.
    #[serde(default, deserialize_with = "quantity::some::<PositiveLength, _>")]
    #[schemars(with = "Option<Checked<PositiveLength>>")]
    pub overlap: Option<f64>,
    /// Overlap beyond which two points do not meet any more, m: less than the thickness of a body
    /// at a surface that touches itself. If left out, ten times the mean side of a cell there; for a
    /// surface with itself one side, or half of the thickness of the body where that is less.
    #[serde(default, deserialize_with = "quantity::some::<PositiveLength, _>")]
    #[schemars(with = "Option<Checked<PositiveLength>>")]
    pub reach: Option<f64>,
}

/// Two surfaces that stick together.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tie {
    /// Physical groups of the two surfaces, the one with the finer mesh first. The second has to
    /// cover the first, within 0.1 of the mean side of a cell.
    #[serde(deserialize_with = "pair")]
    pub surfaces: [Group; 2],
}

/// A cavity in or under the body.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cavity {
    /// Name, for the table.
    pub name: String,
    /// Physical groups: the surfaces around it. What they leave open must lie across another axis
    /// than `along`, or be a cut that a support holds along it, or else at 0.
    pub wall: Vec<Group>,
    /// Axis along which the volume is integrated; the last one of the mesh if left out.
    pub along: Option<Axis>,
    /// Parameter of the pressure inside; without it the cavity is vented.
    pub pressure: Option<String>,
    /// Pressure scale s of a gas that is trapped in it, Pa: p = s (V0/V − 1).
    #[serde(default, deserialize_with = "quantity::some::<PositiveStress, _>")]
    #[schemars(with = "Option<Checked<PositiveStress>>")]
    pub trapped_gas: Option<f64>,
}

/// Capacitances between electrodes in the deformed body.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Capacitance {
    /// Electrodes: physical groups. A region is a conductor throughout.
    pub electrodes: Vec<Group>,
    /// Physical groups at zero: ground, or planes of odd symmetry.
    #[serde(default)]
    pub ground: Vec<Group>,
    /// Physical groups of conductors without charge.
    #[serde(default)]
    pub floating: Vec<Group>,
    /// What is between the electrodes.
    pub dielectric: Vec<Dielectric>,
}

/// Permittivity of some regions.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Dielectric {
    /// Physical groups of the mesh.
    pub regions: Vec<String>,
    /// Permittivity relative to vacuum.
    #[serde(deserialize_with = "quantity::one::<RelativePermittivity, _>")]
    #[schemars(with = "Checked<RelativePermittivity>")]
    pub permittivity: f64,
}

/// A resistance between two surfaces of the deformed body.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Resistance {
    /// Name, for the table.
    pub name: String,
    /// Physical group where the current enters.
    pub from: Group,
    /// Physical group where it leaves.
    pub to: Group,
    /// Regions that conduct.
    pub conductor: Vec<Conductor>,
}

/// Resistivity of some regions.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Conductor {
    /// Physical groups of the mesh.
    pub regions: Vec<String>,
    /// Resistivity, Ω m.
    #[serde(deserialize_with = "quantity::one::<PositiveResistivity, _>")]
    #[schemars(with = "Checked<PositiveResistivity>")]
    pub resistivity: f64,
}

/// A cavity that runs along the depth of a plane body: R = ρ depth / area.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Name of its cavity.
    pub cavity: String,
    /// Share of the section that is in the mesh, above 0 and at most 1: 0.5 of one half.
    #[serde(deserialize_with = "quantity::one::<PositiveFraction, _>")]
    #[schemars(with = "Checked<PositiveFraction>")]
    pub share: f64,
    /// Resistivity of the liquid, Ω m.
    #[serde(deserialize_with = "quantity::one::<PositiveResistivity, _>")]
    #[schemars(with = "Checked<PositiveResistivity>")]
    pub resistivity: f64,
}

/// What the table shows beside parameters, obstacles, cavities and electrical quantities.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Physical groups of whose supports the table shows the forces on the body.
    #[serde(default)]
    pub reactions: Vec<Group>,
    /// Physical groups of points whose displacements the table shows.
    #[serde(default)]
    pub displacements: Vec<Group>,
}

/// The picture of the deformed body.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Picture {
    /// Direction from the body to the eye of a body in space: x, y and z; `[1, -2, 1]` if left
    /// out.
    #[serde(
        default,
        deserialize_with = "quantity::optional_list::<3, AnyNumber, _>"
    )]
    #[schemars(with = "Option<[Checked<AnyNumber>; 3]>")]
    pub from: Option<[f64; 3]>,
}

/// The search for each step; what is left out is what `taxel_fem` takes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolverOptions {
    /// First part of a step that is tried, above 0 and at most 1; 0.1 if left out.
    #[serde(default, deserialize_with = "quantity::some::<PositiveFraction, _>")]
    #[schemars(with = "Option<Checked<PositiveFraction>>")]
    pub first_part: Option<f64>,
    /// Largest part of a step that is tried; 1 if left out.
    #[serde(default, deserialize_with = "quantity::some::<PositiveFraction, _>")]
    #[schemars(with = "Option<Checked<PositiveFraction>>")]
    pub largest_part: Option<f64>,
    /// Part of a step below which it fails; 1e-4 if left out.
    #[serde(default, deserialize_with = "quantity::some::<PositiveFraction, _>")]
    #[schemars(with = "Option<Checked<PositiveFraction>>")]
    pub smallest_part: Option<f64>,
    /// Accepts no state with a cell inside out anywhere, corners included; false if left out.
    #[serde(default)]
    pub whole_cells: bool,
    /// Where the pressures of contacts are kept; automatic if left out.
    #[serde(default)]
    pub multipliers: Multipliers,
}

/// Where the pressures of contacts are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Multipliers {
    /// At each point as far as that goes, from there on at the corners of cells; a note says so.
    #[default]
    Automatic,
    /// At each point: the most accurate pressures.
    Points,
    /// At the corners of cells: goes deeper under pressures above the shear modulus.
    Corners,
}
