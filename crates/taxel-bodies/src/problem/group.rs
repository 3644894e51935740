//! Parts of a mesh: physical groups by their names, and surfaces and points by where they are.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use taxel_ground::quantity::{self, AnyLength, AnyNumber, Checked};

use super::axes::letter;

/// An axis of the mesh file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

impl Axis {
    /// Number of the axis, 0 for x.
    pub(super) fn number(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
            Self::Z => 2,
        }
    }
}

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
    pub(super) fn name(&self) -> String {
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
}
