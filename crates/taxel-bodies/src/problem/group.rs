//! Parts of a mesh: physical groups by their names, and surfaces and points by where they are.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use taxel_fem::mesh::{Facet, Mesh};
use taxel_ground::quantity::{self, AnyLength, AnyNumber, Checked};

use super::build::{Wrong, component, letter, wrong};
use super::description::{Axis, ProblemFile};

/// A place is on a plane or in a box within this share of the size of the mesh: what is left of
/// coordinates that were written with seven digits.
const SAME_PLACE: f64 = 1e-6;

/// A facet faces a direction that its normal leaves by less than 45 degrees: this is the cosine.
const FACES: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A part of the mesh: the name of a physical group, or a selection by place.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Name of the group, or of what is selected.
    pub name: String,
    /// How it is selected, if it is not a physical group.
    pub selection: Option<Box<Selection>>,
}

/// The part of the surface of the body that meets all that is said here, or a point.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Selection {
    /// Name, for the table and for other keys, which may refer to it as to a physical group; a
    /// description of the selection if left out.
    pub name: Option<String>,
    /// Facets all of whose corners lie in a box: least and greatest x, y and z.
    #[serde(rename = "box", default)]
    pub in_box: Option<BoxCorners>,
    /// Facets that lie in a plane across an axis.
    pub plane: Option<PlaneAt>,
    /// Facets whose outward normal is within 45 degrees of this direction: x, y and z, of any length.
    #[serde(
        default,
        deserialize_with = "quantity::optional_list::<3, AnyNumber, _>"
    )]
    #[schemars(with = "Option<[Checked<AnyNumber>; 3]>")]
    pub normal: Option<[f64; 3]>,
    /// Facets of the cells of this region.
    pub of: Option<String>,
    /// `true`: all of the surface of the body that the other keys leave; alone, the whole surface.
    pub outside: Option<bool>,
    /// Facets between the cells of two regions, inside the body.
    pub between: Option<[String; 2]>,
    /// The node nearest to a point: x, y and z, m. It is a point, and stands alone.
    #[serde(
        default,
        deserialize_with = "quantity::optional_list::<3, AnyLength, _>"
    )]
    #[schemars(with = "Option<[Checked<AnyLength>; 3]>")]
    pub nearest: Option<[f64; 3]>,
}

/// Two opposite corners of a box.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxCorners {
    /// Least x, y and z, m.
    #[serde(deserialize_with = "quantity::list::<3, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 3]")]
    pub from: [f64; 3],
    /// Greatest x, y and z, m.
    #[serde(deserialize_with = "quantity::list::<3, AnyLength, _>")]
    #[schemars(with = "[Checked<AnyLength>; 3]")]
    pub to: [f64; 3],
}

/// A plane across an axis.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneAt {
    /// Axis across the plane.
    pub axis: Axis,
    /// Where it lies on the axis, m.
    #[serde(deserialize_with = "quantity::one::<AnyLength, _>")]
    #[schemars(with = "Checked<AnyLength>")]
    pub at: f64,
}

impl std::ops::Deref for Group {
    type Target = String;

    fn deref(&self) -> &String {
        &self.name
    }
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl<'de> Deserialize<'de> for Group {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Group;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a physical group, or a selection such as { plane = { axis = \"z\", at = \"2 mm\" } }")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<Group, E> {
                Ok(Group {
                    name: name.to_owned(),
                    selection: None,
                })
            }

            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Group, M::Error> {
                let selection = Selection::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Group {
                    name: selection.name(),
                    selection: Some(Box::new(selection)),
                })
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// The two forms, for the schema.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "only its schema is used")]
enum Form {
    /// Name of a physical group of the mesh, or of a selection that has one.
    Name(String),
    /// A part of the surface by where it is.
    Selection(Box<Selection>),
}

impl JsonSchema for Group {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Group".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let mut schema = Form::json_schema(generator);
        let value = "the name of a group, or a [selection](own-body.md#surfaces-by-position)";
        schema.insert(quantity::VALUE.into(), value.into());
        schema
    }
}

impl Selection {
    /// Its name, or what it says with lengths in mm.
    fn name(&self) -> String {
        if let Some(name) = &self.name {
            return name.clone();
        }
        let place = |place: [f64; 3]| place.map(|x| format!("{}", 1e3 * x)).join(" ");
        let mut parts = Vec::new();
        if let Some(BoxCorners { from, to }) = self.in_box {
            parts.push(format!("in {} to {}", place(from), place(to)));
        }
        if let Some(PlaneAt { axis, at }) = self.plane {
            parts.push(format!("{} = {}", letter(axis.number()), 1e3 * at));
        }
        if let Some(normal) = self.normal {
            parts.push(format!(
                "facing {}",
                normal.map(|x| x.to_string()).join(" ")
            ));
        }
        if let Some(region) = &self.of {
            parts.push(format!("of {region}"));
        }
        if let Some([one, other]) = &self.between {
            parts.push(format!("between {one} and {other}"));
        }
        if let Some(point) = self.nearest {
            parts.push(format!("at {}", place(point)));
        }
        if parts.is_empty() {
            parts.push("outside".to_owned());
        }
        parts.join(" ")
    }

    /// Adds what is selected to the named surfaces or points of a mesh; `key` is that of the
    /// selection.
    fn add(&self, mesh: &mut Mesh, axes: &[usize], key: &str) -> Result<(), Wrong> {
        let surface = self.in_box.is_some()
            || self.plane.is_some()
            || self.normal.is_some()
            || self.of.is_some()
            || self.between.is_some()
            || self.outside == Some(true);
        let name = self.name();
        if let Some(point) = self.nearest {
            if surface {
                let message = "a point stands alone";
                return Err(wrong(key, message, "leave the other keys out"));
            }
            let inside: Vec<f64> = axes.iter().map(|&axis| point[axis]).collect();
            let nearest = nearest(mesh, &inside);
            mesh.node_sets.insert(name, nearest.into_iter().collect());
            return Ok(());
        }
        if self.outside == Some(false) || !surface {
            let help =
                "give one or more of: box, plane, normal, of, between, outside = true; or nearest";
            return Err(wrong(key, "nothing is selected", help));
        }
        let facets = self.facets(mesh, axes, key)?;
        if facets.is_empty() {
            let message =
                format!("nothing of the surface of the body is in the selection \"{name}\"");
            let help = "compare it with the size of the body, which `taxel solve --check` prints; lengths of the file are not in units of the mesh";
            return Err(wrong(key, message, help));
        }
        mesh.surfaces.insert(name, facets);
        Ok(())
    }

    fn facets(&self, mesh: &Mesh, axes: &[usize], key: &str) -> Result<Vec<Facet>, Wrong> {
        let region = |name: &String, key: String| {
            let known = mesh.regions.iter().position(|known| known == name);
            known.ok_or_else(|| {
                let message = format!("the mesh has no region \"{name}\"");
                let help = format!("give one of: {}", mesh.regions.join(", "));
                wrong(key, message, &help)
            })
        };
        let of = match &self.of {
            Some(name) => Some(region(name, format!("{key}.of"))?),
            None => None,
        };
        let mut facets = match &self.between {
            Some([one, other]) => mesh.interface([
                region(one, format!("{key}.between.0"))?,
                region(other, format!("{key}.between.1"))?,
            ]),
            None => mesh.boundary(),
        };
        let same = SAME_PLACE * mesh.size();
        let corners = |facet: Facet| {
            let count = mesh.shape(facet.cell as usize).facet_shape().corner_count();
            mesh.facet_nodes(facet)
                .take(count)
                .map(|node| mesh.points[node as usize])
        };
        if let Some(region) = of {
            facets.retain(|facet| mesh.region_of(facet.cell as usize) == region);
        }
        if let Some(PlaneAt { axis, at }) = self.plane {
            let along = component(axes, axis.number()).ok_or_else(|| {
                let message = format!("the mesh does not extend along {}", letter(axis.number()));
                wrong(format!("{key}.plane.axis"), message, "give one of its axes")
            })?;
            facets.retain(|&facet| corners(facet).all(|place| (place[along] - at).abs() <= same));
        }
        if let Some(BoxCorners { from, to }) = self.in_box {
            let inside = |place: [f64; 3]| {
                axes.iter()
                    .zip(place)
                    .all(|(&axis, x)| (from[axis] - same..=to[axis] + same).contains(&x))
            };
            facets.retain(|&facet| corners(facet).all(inside));
        }
        if let Some(normal) = self.normal {
            let wanted: Vec<f64> = axes.iter().map(|&axis| normal[axis]).collect();
            let length = wanted.iter().map(|x| x * x).sum::<f64>().sqrt();
            if length == 0.0 {
                let message = "the direction is zero in the space of the mesh";
                let help = "give a direction such as [0, 1, 0]";
                return Err(wrong(format!("{key}.normal"), message, help));
            }
            facets.retain(|&facet| {
                let outward = mesh.outward(facet);
                let along: f64 = outward.iter().zip(&wanted).map(|(a, b)| a * b).sum();
                along >= FACES * length
            });
        }
        Ok(facets)
    }
}

/// The node of cells that is nearest to a point.
fn nearest(mesh: &Mesh, point: &[f64]) -> Option<u32> {
    let distance = |node: &u32| -> f64 {
        let place = mesh.points[*node as usize];
        place
            .iter()
            .zip(point)
            .map(|(x, at)| (x - at).powi(2))
            .sum()
    };
    (0..mesh.points.len() as u32).min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Adds the selections of a file to the named parts of its mesh.
pub(super) fn select(file: &ProblemFile, mesh: &mut Mesh, axes: &[usize]) -> Result<(), Wrong> {
    let mut known: Vec<&Group> = Vec::new();
    for (key, group) in all(file) {
        let Some(selection) = &group.selection else {
            continue;
        };
        match known.iter().find(|other| other.name == group.name) {
            Some(other) if *other == group => continue,
            Some(_) => {
                let message = format!("another selection is called \"{}\"", group.name);
                return Err(wrong(key, message, "give each its own name"));
            }
            None => {}
        }
        let mut taken = mesh
            .surfaces
            .keys()
            .chain(mesh.node_sets.keys())
            .chain(&mesh.regions);
        if taken.any(|taken| *taken == group.name) {
            let message = format!("the mesh has a group \"{}\"", group.name);
            return Err(wrong(key, message, "give the selection another name"));
        }
        selection.add(mesh, axes, &key)?;
        known.push(group);
    }
    Ok(())
}

/// All groups that a file refers to, with their keys.
fn all(file: &ProblemFile) -> Vec<(String, &Group)> {
    fn list<'f>(key: &str, groups: &'f [Group], to: &mut Vec<(String, &'f Group)>) {
        let numbered = groups.iter().enumerate();
        to.extend(numbered.map(|(at, group)| (format!("{key}.{at}"), group)));
    }
    let mut all = Vec::new();
    for (at, driver) in file.parameter.iter().enumerate() {
        if let Some(super::description::Prescribed::Displacement(point)) = &driver.prescribes {
            all.push((
                format!("parameter.{at}.prescribes.displacement.at"),
                &point.at,
            ));
        }
    }
    for (at, support) in file.support.iter().enumerate() {
        all.push((format!("support.{at}.on"), &support.on));
    }
    for (at, rigid) in file.rigid.iter().enumerate() {
        all.push((format!("rigid.{at}.on"), &rigid.on));
    }
    for (at, constraint) in file.constraint.iter().enumerate() {
        let key = format!("constraint.{at}");
        list(
            &format!("{key}.periodic"),
            constraint.periodic.as_ref().map_or(&[], |pair| &pair[..]),
            &mut all,
        );
        all.extend(
            constraint
                .mean
                .iter()
                .map(|mean| (format!("{key}.mean.on"), &mean.on)),
        );
        all.extend(
            constraint
                .point
                .iter()
                .map(|point| (format!("{key}.point.at"), &point.at)),
        );
        let terms = constraint.follows.iter().enumerate();
        all.extend(terms.map(|(at, term)| (format!("{key}.follows.{at}.at"), &term.at)));
    }
    for (at, load) in file.load.iter().enumerate() {
        all.push((format!("load.{at}.on"), &load.on));
    }
    for (at, obstacle) in file.obstacle.iter().enumerate() {
        all.push((format!("obstacle.{at}.surface"), &obstacle.surface));
    }
    for (at, contact) in file.contact.iter().enumerate() {
        list(
            &format!("contact.{at}.surfaces"),
            &contact.surfaces,
            &mut all,
        );
    }
    for (at, tie) in file.tie.iter().enumerate() {
        list(&format!("tie.{at}.surfaces"), &tie.surfaces, &mut all);
    }
    for (at, cavity) in file.cavity.iter().enumerate() {
        list(&format!("cavity.{at}.wall"), &cavity.wall, &mut all);
    }
    if let Some(capacitance) = &file.capacitance {
        list("capacitance.electrodes", &capacitance.electrodes, &mut all);
        list("capacitance.ground", &capacitance.ground, &mut all);
        list("capacitance.floating", &capacitance.floating, &mut all);
    }
    for (at, resistance) in file.resistance.iter().enumerate() {
        all.push((format!("resistance.{at}.from"), &resistance.from));
        all.push((format!("resistance.{at}.to"), &resistance.to));
    }
    list("output.reactions", &file.output.reactions, &mut all);
    list("output.displacements", &file.output.displacements, &mut all);
    all
}
