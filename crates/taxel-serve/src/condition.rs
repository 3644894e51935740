//! What is wrong with channels, for messages and the report.

use serde::Serialize;
use taxel::estimation::{Observer, Wiring};

use crate::sense::{Sense, capacitor_name};

/// A channel that something is against.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WrongChannel {
    /// Its place in a frame.
    pub channel: usize,
    /// Its name, as recordings have it.
    pub name: String,
    /// The taxels it belongs to.
    pub taxels: Vec<usize>,
    /// Name of the condition.
    pub condition: &'static str,
    /// Since when, ns of device time.
    pub since_ns: u64,
    /// The number that shows it.
    pub evidence: f64,
    /// The condition in words with its evidence.
    pub reason: String,
}

/// A three-axis unit whose readings an exchange of two capacitors explains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SwappedUnit {
    /// The unit.
    pub taxel: usize,
    /// Pairs, one of which has changed places.
    pub pairs: Vec<[&'static str; 2]>,
}

/// Condition of all channels.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ChannelConditions {
    /// Channels of the device.
    pub channels: usize,
    /// Channels that something is against.
    pub wrong_channels: usize,
    /// They, but no more than the first 512.
    pub wrong: Vec<WrongChannel>,
    /// Units with capacitors that changed places.
    pub swapped: Vec<SwappedUnit>,
}

/// Channels that a message lists.
const LISTED: usize = 512;
/// While something is wrong its evidence is told again after this time, ns.
const AGAIN_NS: u64 = 1_000_000_000;

impl ChannelConditions {
    pub(crate) fn of(sense: &Sense) -> Self {
        let observer = sense.observer();
        let channels = observer.health().channels();
        let wrong = || {
            let all = channels.iter().enumerate();
            all.filter(|(_, channel)| channel.condition.wrong())
        };
        Self {
            channels: channels.len(),
            wrong_channels: wrong().count(),
            wrong: wrong()
                .take(LISTED)
                .map(|(index, channel)| WrongChannel {
                    channel: index,
                    name: sense.channel_name(index),
                    taxels: observer.wiring().taxels(index).collect(),
                    condition: channel.condition.name(),
                    since_ns: channel.since_ns,
                    evidence: channel.evidence,
                    reason: channel.reason(),
                })
                .collect(),
            swapped: swapped(observer),
        }
    }

    fn message(&self, repeated: u64) -> String {
        #[derive(Serialize)]
        #[serde(tag = "type", rename = "health")]
        struct Message<'a> {
            repeated: u64,
            #[serde(flatten)]
            conditions: &'a ChannelConditions,
        }
        let message = Message {
            repeated,
            conditions: self,
        };
        serde_json::to_string(&message).unwrap_or_default()
    }
}

fn swapped(observer: &Observer) -> Vec<SwappedUnit> {
    let Wiring::PerTaxel(4) = observer.wiring() else {
        return Vec::new();
    };
    let units = 0..observer.health().channels().len() / 4;
    units
        .map(|taxel| SwappedUnit {
            taxel,
            pairs: observer
                .swapped(taxel)
                .iter()
                .map(|pair| pair.map(capacitor_name))
                .collect(),
        })
        .filter(|unit| !unit.pairs.is_empty())
        .collect()
}

/// Decides when the conditions are told again.
#[derive(Debug, Default)]
pub(crate) struct Teller {
    told: Option<(u64, u64, u64)>,
}

impl Teller {
    /// The message, if something has changed since the last one.
    pub(crate) fn message(&mut self, time_ns: u64, repeated: u64, sense: &Sense) -> Option<String> {
        let health = sense.observer().health();
        let changes = health.changes();
        let due = self.told.is_none_or(|(told, when, before)| {
            let long_ago = time_ns.abs_diff(when) >= AGAIN_NS;
            changes != told || long_ago && (health.wrong() || repeated != before)
        });
        due.then(|| {
            self.told = Some((changes, time_ns, repeated));
            ChannelConditions::of(sense).message(repeated)
        })
    }
}
