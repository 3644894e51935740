//! Design sweeps: one quantity computed for many drawings.

mod heat_map;
mod microchannel_sections;

use schemars::JsonSchema;
use serde::Deserialize;

use taxel_ground::InputError;
use taxel_ground::quantity::{self, Checked, PositiveLength, PositiveStress};
use taxel_ground::toml_input;

pub use heat_map::{HeatMap, MapCell};
pub use microchannel_sections::{
    DrawnSection, SectionAnswer, SectionRow, SectionState, cells, columns, heat_map, solve_section,
    sweep,
};

/// Shipped studies: name and text.
const SHIPPED: &[(&str, &str)] = &[(
    "p4-sections",
    include_str!("../../studies/p4-sections.toml"),
)];

/// Keys that had another name, with the name that they have now.
const RENAMED: &[(&[&str], &str)] = &[(&["channel_sections"], "microchannel_sections")];

/// A study as its file describes it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Version of this format: 1.
    pub schema: u32,
    /// Name of the study.
    pub name: String,
    /// Sensor file, or name of a shipped one, that says what is not varied.
    pub sensor: String,
    /// Microchannels of other heights and covers (P4 II.D).
    pub microchannel_sections: MicrochannelSections,
}

/// One row of microchannels with heights and covers to sweep.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MicrochannelSections {
    /// Thickness of the whole sheet, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub thickness: f64,
    /// Heights of the microchannels.
    pub heights: Lengths,
    /// Solid above the microchannels.
    pub covers: Lengths,
    /// Pressures on the whole top.
    pub pressures: Pressures,
}

/// Equally spaced lengths.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lengths {
    /// First, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub from: f64,
    /// Last, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub to: f64,
    /// Number of lengths, 1 to 100.
    pub count: usize,
}

/// Equally spaced pressures.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pressures {
    /// First, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub from: f64,
    /// Last, Pa.
    #[serde(deserialize_with = "quantity::one::<PositiveStress, _>")]
    #[schemars(with = "Checked<PositiveStress>")]
    pub to: f64,
    /// Number of pressures, 1 to 100.
    pub count: usize,
}

fn spaced(from: f64, to: f64, count: usize) -> Vec<f64> {
    let steps = count.saturating_sub(1).max(1) as f64;
    (0..count)
        .map(|k| from + (to - from) * k as f64 / steps)
        .collect()
}

impl Lengths {
    /// The lengths, m.
    pub fn values(&self) -> Vec<f64> {
        spaced(self.from, self.to, self.count)
    }
}

impl Pressures {
    /// The pressures, Pa.
    pub fn values(&self) -> Vec<f64> {
        spaced(self.from, self.to, self.count)
    }
}

impl Study {
    /// Reads a study; `file` is its name for messages.
    ///
    /// # Errors
    /// The first mistake with its place.
    pub fn parse(file: &str, text: &str) -> Result<Self, InputError> {
        let help = "rename it in the header";
        if let Some(error) = toml_input::renamed_key(file, text, RENAMED, "now", help) {
            return Err(error);
        }
        let study: Self = toml_input::parse(file, text)?;
        let sections = &study.microchannel_sections;
        let lists = [
            (
                "heights",
                sections.heights.count,
                [sections.heights.from, sections.heights.to],
            ),
            (
                "covers",
                sections.covers.count,
                [sections.covers.from, sections.covers.to],
            ),
            (
                "pressures",
                sections.pressures.count,
                [sections.pressures.from, sections.pressures.to],
            ),
        ];
        for (name, count, [from, to]) in lists {
            let path = ["microchannel_sections", name];
            let wrong = |message: String, help: &str| {
                Err(toml_input::at_key(file, text, &path, &message, help))
            };
            if !(1..=100).contains(&count) {
                return wrong(
                    format!("count = {count} is not between 1 and 100"),
                    "give 1 to 100",
                );
            }
            if to < from || (count > 1 && to == from) {
                return wrong("the values do not rise".into(), "give to above from");
            }
        }
        let tallest = sections.heights.to + sections.covers.to;
        if tallest >= sections.thickness {
            let um = |length: f64| length * 1e6;
            return Err(toml_input::at_key(
                file,
                text,
                &["microchannel_sections", "thickness"],
                &format!(
                    "the tallest microchannel under the thickest cover takes {:.4} um of a sheet of {:.4} um",
                    um(tallest),
                    um(sections.thickness)
                ),
                "give a thicker sheet, or lower microchannels and covers",
            ));
        }
        Ok(study)
    }

    /// Names of the shipped studies.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// Text of a shipped study.
    pub fn shipped_text(name: &str) -> Option<&'static str> {
        SHIPPED
            .iter()
            .find(|(shipped, _)| *shipped == name)
            .map(|(_, text)| *text)
    }
}
