//! The sensor file: the only description of a device.

mod checks;
mod liquid_metal_channel;
mod mask;
mod three_axis_capacitor;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::electronics::{Electronics, FrontEnd};
use crate::input::InputError;
use crate::layout::{ArrayDescription, Layout};
use crate::quantity::{self, Checked, NonNegativeLength};
use crate::toml_input;
use crate::transduction::UnitModel;

pub use liquid_metal_channel::{
    ClosingDescription, LayerDescription, Liquid, LiquidMetalChannel, PlaneStrainCell,
    SectionDescription,
};
pub use mask::{CapacitorName, Mask};
pub use three_axis_capacitor::{Outline, ThreeAxisCapacitor};

/// The version of the sensor file that this program reads.
pub const SCHEMA_VERSION: u32 = 1;

/// Shipped sensor files: name and text.
const SHIPPED: [(&str, &str); 2] = [
    (
        "three-axis-8x8",
        include_str!("../../../../sensors/three-axis-8x8.toml"),
    ),
    (
        "three-axis-unit",
        include_str!("../../../../sensors/three-axis-unit.toml"),
    ),
];

/// A device as its file describes it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Version of this format: 1.
    #[schemars(extend("const" = 1))]
    pub schema: u32,
    /// What people call the device.
    pub name: String,
    /// How many taxels and where.
    pub array: ArrayDescription,
    /// What one taxel is.
    pub element: Element,
    /// The board that reads the taxels.
    pub electronics: Electronics,
    /// How far made devices differ from the drawing; used by the twin.
    pub fabrication: Fabrication,
    /// Taxels or capacitors that are known not to work.
    #[serde(default)]
    pub mask: Vec<Mask>,
}

/// What one taxel is made of; the header in the file names the model.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Element {
    /// Four capacitors under one bump (P2).
    ThreeAxisCapacitor(Box<ThreeAxisCapacitor>),
}

/// Scatter of the made device about its drawing.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fabrication {
    /// Standard deviation of the air gap from capacitor to capacitor, m.
    #[serde(deserialize_with = "quantity::one::<NonNegativeLength, _>")]
    #[schemars(with = "Checked<NonNegativeLength>")]
    pub air_gap_deviation: f64,
    /// Seed of this scatter: the same seed is the same piece.
    pub seed: u64,
}

impl Sensor {
    /// Reads a sensor file; `file` is its name for messages.
    ///
    /// # Errors
    /// The first mistake, with its place, key path, allowed range and unit.
    ///
    /// # Example
    /// ```
    /// # let text = taxel::sensor::Sensor::shipped_text("three-axis-8x8").unwrap();
    /// let sensor = taxel::sensor::Sensor::parse("three-axis-8x8.toml", text)?;
    /// assert_eq!(sensor.array.rows, 8);
    /// # Ok::<(), taxel::InputError>(())
    /// ```
    ///
    /// # Example: a wrong unit is shown under the very word
    /// ```
    /// # let text = taxel::sensor::Sensor::shipped_text("three-axis-8x8").unwrap();
    /// let text = text.replace("pitch = \"2 mm\"", "pitch = \"2 mN\"");
    /// let error = taxel::sensor::Sensor::parse("bad.toml", &text).unwrap_err();
    /// assert_eq!(error.key, "array.pitch");
    /// assert!(error.to_string().contains("\"mN\" is a unit of force; a length is needed here"));
    /// ```
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let sensor: Self = toml_input::parse(file, text)?;
        checks::check(&sensor).map_err(|broken| broken.at(file, text))?;
        Ok(sensor)
    }

    /// Names of the shipped sensor files.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// Text of a shipped sensor file.
    pub fn shipped_text(name: &str) -> Option<&'static str> {
        SHIPPED
            .iter()
            .find(|(shipped, _)| *shipped == name)
            .map(|(_, text)| *text)
    }

    /// A shipped sensor.
    pub fn shipped(name: &str) -> Option<Self> {
        Self::shipped_text(name).and_then(|text| Self::parse(name, text).ok())
    }

    /// Where the taxels are.
    pub fn layout(&self) -> Layout {
        Layout::new(&self.array)
    }

    /// The model of one taxel as drawn.
    pub fn unit_model(&self) -> UnitModel {
        let Element::ThreeAxisCapacitor(element) = &self.element;
        element.unit_model()
    }

    /// The board.
    pub fn front_end(&self) -> FrontEnd {
        FrontEnd::new(&self.electronics, self.array.rows, self.array.columns)
    }

    /// Which capacitors of each taxel are masked.
    pub fn masked(&self) -> Vec<[bool; 4]> {
        mask::table(&self.mask, self.array.rows, self.array.columns)
    }

    /// The JSON schema of the sensor file, as committed beside the shipped
    /// files; editors complete and check with it.
    pub fn json_schema() -> String {
        let schema = schemars::schema_for!(Self);
        let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        text.push('\n');
        text
    }
}
