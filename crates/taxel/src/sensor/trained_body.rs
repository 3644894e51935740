//! A body without a physical model as a sensor file describes it.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Broken, Mask, require};
use crate::quantity::{self, Checked, PositiveForce};
use crate::trained::TrainedMaps;

/// A body without a physical model, whose channels are learned.
///
/// `[array]` is the area on which touches can be, divided into the cells of its
/// picture.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrainedBody {
    /// Force at the end of the colour scale, N.
    #[serde(deserialize_with = "quantity::one::<PositiveForce, _>")]
    #[schemars(with = "Checked<PositiveForce>")]
    pub full_scale: f64,
    /// The channels in the order of a frame, in groups.
    pub groups: Vec<ChannelGroup>,
    /// Maps learned from recordings of the device; only a calibration gives them.
    #[serde(skip)]
    pub maps: Option<TrainedMaps>,
}

/// Channels that belong together, such as the axes of one chip.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelGroup {
    /// Name of the group.
    pub name: String,
    /// Names of its channels, such as the axes x, y, z.
    pub channels: Vec<String>,
}

/// Most channels of a body.
pub const MOST_CHANNELS: usize = 1024;

impl TrainedBody {
    /// Name of each channel in the order of a frame.
    pub fn channels(&self) -> Vec<String> {
        let names = |group: &ChannelGroup| {
            let name = group.name.clone();
            let channels = group.channels.clone().into_iter();
            channels.map(move |channel| format!("{name} {channel}"))
        };
        self.groups.iter().flat_map(names).collect()
    }

    /// Which of its channels are masked.
    pub fn masked(&self, masks: &[Mask]) -> Vec<bool> {
        let masked = |name: &String| masks.iter().any(|mask| mask.channel.as_ref() == Some(name));
        self.channels().iter().map(masked).collect()
    }

    /// Rules between its keys.
    ///
    /// # Errors
    /// The first broken rule.
    pub(crate) fn check(&self) -> Result<(), Broken> {
        let names = self.channels();
        require(
            (1..=MOST_CHANNELS).contains(&names.len()),
            "element.trained.groups",
            || {
                format!(
                    "{} channels; must be from 1 to {MOST_CHANNELS}",
                    names.len()
                )
            },
            "name the channels in the order of a frame, such as [{ name = \"chip 1\", channels = [\"x\", \"y\", \"z\"] }]",
        )?;
        let twice =
            |(index, name): (usize, &String)| names[..index].contains(name).then(|| name.clone());
        let twice = names.iter().enumerate().find_map(twice);
        require(
            twice.is_none(),
            "element.trained.groups",
            || {
                format!(
                    "the channel \"{}\" is there twice",
                    twice.clone().unwrap_or_default()
                )
            },
            "give each channel a name of its own",
        )
    }
}
