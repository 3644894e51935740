//! Elements of a user's own: a key of the sensor file for parts that taxel does not ship.

use std::collections::HashMap;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny};

use crate::InputError;
use crate::sensor::{Described, Element, Sensor};
use crate::solutions::TablesOnly;
use crate::stage::{OwnElement, OwnParts};
use crate::toml_input;

type Factory = fn(&str, &str, &str) -> Result<Arc<dyn OwnElement>, InputError>;

/// Reads sensor files with elements of a user's own beside those that taxel ships.
///
/// # Example
/// `crates/taxel/examples/own_element.rs` is an element of its own in 80 lines.
#[derive(Debug, Default)]
pub struct Registry {
    elements: Vec<(&'static str, Factory)>,
}

/// The one table of a file that is of a user's own.
#[derive(Deserialize, JsonSchema)]
#[serde(bound = "E: DeserializeOwned")]
struct OwnTable<E> {
    element: HashMap<String, E>,
}

/// The place of the element in what is read without it.
#[derive(Debug, Clone, PartialEq, JsonSchema)]
struct Skipped;

impl<'de> Deserialize<'de> for Skipped {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        IgnoredAny::deserialize(deserializer).map(|_| Self)
    }
}

impl Registry {
    /// Adds the element that stands below `element.KEY`.
    #[must_use]
    pub fn with<E: OwnElement + DeserializeOwned + JsonSchema + 'static>(
        mut self,
        key: &'static str,
    ) -> Self {
        self.elements.push((key, |file, text, key| {
            let mut read: OwnTable<E> = taxel_material::parse_sensor(file, text, &|_| 1.0)?;
            read.element.remove(key).map_or_else(
                || Err(InputError::whole(file, format!("element.{key} is missing"))),
                |element| Ok(Arc::new(element) as Arc<dyn OwnElement>),
            )
        }));
        self
    }

    /// Reads a sensor file; `file` is its name for messages.
    ///
    /// # Errors
    /// As [`Sensor::parse`].
    pub fn parse(&self, file: &str, text: &str) -> Result<Sensor, InputError> {
        let own = self
            .elements
            .iter()
            .find(|(key, _)| toml_input::has(text, &["element", key]));
        let Some((key, factory)) = own else {
            return Sensor::parse(file, text);
        };
        let element = factory(file, text, key)?;
        let read: Described<Skipped> = taxel_material::parse_sensor(file, text, &|_| 1.0)?;
        read.with(Element::Own(OwnParts { key, element }))
            .sound(file, text, &mut TablesOnly)
    }
}
