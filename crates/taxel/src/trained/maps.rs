//! All that was learned of one device.

use serde::{Deserialize, Serialize};

use super::{ForceMap, PlaceMap, PositionMap, Relation, TrainingError};

/// Maps learned from recordings of a device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainedMaps {
    /// Number of channels of a frame.
    pub channels: usize,
    /// Readings without contact, of runs that begin so.
    pub rest: Option<RestStatistics>,
    /// Where a probe of the trained depth presses; positions on the area of the
    /// device, whose middle is the origin.
    pub position: Option<PositionMap>,
    /// Where a contact is, where a mixture of maps says it better than `position`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<PlaceMap>,
    /// Map of the force.
    pub force: Option<ForceMap>,
    /// What each channel reads beside the others; none of devices of few channels.
    pub relation: Option<Relation>,
}

/// Readings of a device that nothing touches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RestStatistics {
    /// Mean of each channel.
    pub mean: Vec<f64>,
    /// Standard deviation of one reading of each channel.
    pub deviation: Vec<f64>,
    /// Least change of the reading of each channel from frame to frame.
    pub step: Vec<f64>,
    /// Time after a contact in which creep may hide a drift, s: the map of the force knows what the
    /// body then shows, and the baseline is held.
    #[serde(default)]
    pub recovery: f64,
}

impl TrainedMaps {
    /// True if a map needs channel `channel`, counted from 0.
    pub fn use_channel(&self, channel: usize) -> bool {
        let position = self.position.as_ref().map(|map| &map.standard);
        let force = self.force.as_ref().map(|map| &map.standard);
        let place = self.place.as_ref().map(|map| &map.standard);
        let mut standards = position.into_iter().chain(force).chain(place);
        standards.any(|standard| standard.used.contains(&channel))
    }

    /// Checks that the tables of maps from a file belong together.
    ///
    /// # Errors
    /// [`TrainingError::Unsound`] names the first that does not.
    pub fn check(&self) -> Result<(), TrainingError> {
        let unsound = |table| Err(TrainingError::Unsound { table });
        if let Some(rest) = &self.rest {
            let whole = |row: &Vec<f64>| {
                row.len() == self.channels && row.iter().all(|value| value.is_finite())
            };
            let positive = rest.deviation.iter().all(|deviation| *deviation > 0.0);
            let steps = whole(&rest.step) && rest.step.iter().all(|step| *step >= 0.0);
            let recovery = rest.recovery >= 0.0 && rest.recovery.is_finite();
            let sound = whole(&rest.mean) && whole(&rest.deviation) && positive;
            if !(sound && steps && recovery) {
                return unsound("rest");
            }
        }
        if let Some(position) = &self.position {
            position.check()?;
            let tared = !position.tared || self.rest.is_some();
            if position.standard.channels != self.channels || !tared {
                return unsound("position.standard");
            }
        }
        if let Some(place) = &self.place {
            place.check()?;
            let whole = self.position.is_some() && self.rest.is_some();
            if place.standard.channels != self.channels || !whole {
                return unsound("place.standard");
            }
        }
        if let Some(relation) = &self.relation {
            relation.check()?;
            let fits = relation.standard.channels == self.channels;
            if !fits || (relation.tared && self.rest.is_none()) {
                return unsound("relation");
            }
        }
        let Some(force) = &self.force else {
            return if self.position.is_some() {
                Ok(())
            } else {
                unsound("channels")
            };
        };
        force.check()?;
        if force.standard.channels != self.channels {
            return unsound("force.standard");
        }
        if self.rest.is_none() {
            return unsound("rest");
        }
        Ok(())
    }
}
