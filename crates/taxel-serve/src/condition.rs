//! Faults of channels, for messages and the report.

use serde::Serialize;
use taxel::estimation::{ArrayEstimator, Condition, TouchSession};

/// A channel that something is against.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WrongChannel {
    /// Its index in a frame.
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

/// A taxel whose readings an exchange of two of its channels explains.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SwappedChannels {
    /// The taxel.
    pub taxel: usize,
    /// Names of pairs of channels, one of which has changed places.
    pub pairs: Vec<[String; 2]>,
}

/// Condition of all channels.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ChannelConditions {
    /// Channels of the device.
    pub channels: usize,
    /// Channels that are not used.
    #[serde(skip)]
    pub masked_channels: usize,
    /// Channels that something is against.
    pub wrong_channels: usize,
    /// They, but no more than the first 512.
    pub wrong: Vec<WrongChannel>,
    /// Taxels with channels that changed places.
    pub swapped: Vec<SwappedChannels>,
}

/// Channels that a message lists.
const LISTED: usize = 512;
/// While something is wrong its evidence is sent again after this time, ns.
const AGAIN_NS: u64 = 1_000_000_000;

impl ChannelConditions {
    pub(crate) fn of(session: &TouchSession) -> Self {
        let (meaning, observer) = (session.meaning(), session.observer());
        let channels = observer.health().channels();
        let wrong = || {
            let all = channels.iter().enumerate();
            all.filter(|(_, channel)| channel.condition.wrong())
        };
        Self {
            channels: channels.len(),
            masked_channels: channels
                .iter()
                .filter(|channel| channel.condition == Condition::Masked)
                .count(),
            wrong_channels: wrong().count(),
            wrong: wrong()
                .take(LISTED)
                .map(|(index, channel)| WrongChannel {
                    channel: index,
                    name: meaning.channels.get(index).cloned().unwrap_or_default(),
                    taxels: meaning.wiring.taxels(index).collect(),
                    condition: channel.condition.name(),
                    since_ns: channel.since_ns,
                    evidence: channel.evidence,
                    reason: channel.reason(),
                })
                .collect(),
            swapped: swapped(session.estimator()),
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

fn swapped(estimator: &ArrayEstimator) -> Vec<SwappedChannels> {
    let per_unit = estimator.rules().rest.channels_per_unit;
    let names = &estimator.meaning().channels;
    let units = 0..names.len() / per_unit.max(1);
    let name = |unit: usize, channel: usize| {
        let name = names.get(unit * per_unit + channel).cloned();
        name.unwrap_or_default()
    };
    units
        .map(|taxel| SwappedChannels {
            taxel,
            pairs: estimator
                .swapped(taxel)
                .iter()
                .map(|pair| pair.map(|channel| name(taxel, channel)))
                .collect(),
        })
        .filter(|unit| !unit.pairs.is_empty())
        .collect()
}

/// Decides when the conditions are sent again.
#[derive(Debug, Default)]
pub(crate) struct ConditionSender {
    sent: Option<(u64, u64, u64)>,
}

impl ConditionSender {
    /// The message, if something has changed since the last one.
    pub(crate) fn message(
        &mut self,
        time_ns: u64,
        repeated: u64,
        session: &TouchSession,
    ) -> Option<String> {
        let health = session.observer().health();
        let changes = health.changes();
        let due = self.sent.is_none_or(|(sent, when, before)| {
            let long_ago = time_ns.abs_diff(when) >= AGAIN_NS;
            changes != sent || long_ago && (health.wrong() || repeated != before)
        });
        due.then(|| {
            self.sent = Some((changes, time_ns, repeated));
            ChannelConditions::of(session).message(repeated)
        })
    }
}
