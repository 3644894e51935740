//! Touch of the last frame of a run, for its report.

use taxel::estimation::{Certainty, ChannelState, Meaning, State, Touch};

/// Touch of the last frame.
#[derive(Debug, Clone, PartialEq)]
pub struct LastTouch {
    /// Sequence number.
    pub sequence: u64,
    /// Device time, ns.
    pub time_ns: u64,
    /// Total force x, y, z, N; `NaN` where unknown.
    pub force: [f64; 3],
    /// Its standard deviations, N.
    pub deviation: [f64; 3],
    /// Total moment, N m.
    pub moment: [f64; 3],
    /// Sum of the values, SI, where it is not the total force.
    pub sum: Option<f64>,
    /// Centre of pressure, m; in cells where the pitch is not known.
    pub centre_of_pressure: Option<[f64; 2]>,
    /// True if positions are in metres.
    pub in_metres: bool,
    /// How much the force says, or the sum where there is no force; and why not all.
    pub certainty: Certainty,
    /// The state that is the reason.
    pub reason: Option<State>,
    /// False while the values are no forces yet.
    pub zero_known: bool,
    /// Channels that give no reading that can be used, masked ones not counted.
    pub faulty_channels: usize,
    /// Number of contact regions.
    pub contacts: usize,
    /// Number of taxels in each state.
    pub states: [usize; State::ALL.len()],
    /// Components of a value.
    pub components: usize,
    /// Value of each taxel, SI; of one component, the last is known.
    pub values: Vec<[f64; 3]>,
    /// Reading of each channel, SI.
    pub readings: Vec<f64>,
}

impl LastTouch {
    /// `reuse` is the one before, whose memory is used again.
    pub(crate) fn new(touch: &Touch, meaning: &Meaning, reuse: Option<Self>) -> Self {
        let (mut values, mut readings) =
            reuse.map_or_else(Default::default, |last| (last.values, last.readings));
        values.clear();
        values.extend(touch.taxels.iter().map(|taxel| taxel.value));
        readings.clone_from(&touch.channels.readings);
        Self {
            sequence: touch.sequence,
            time_ns: touch.time_ns,
            force: touch.total.force,
            deviation: touch.total_deviation(),
            moment: touch.total.moment,
            sum: meaning.adds_up().then_some(touch.sum),
            centre_of_pressure: touch.centre_of_pressure.map(|(centre, _)| centre),
            in_metres: meaning.in_metres,
            certainty: touch.total_certainty,
            reason: touch.total_reason,
            zero_known: touch.zero_known,
            faulty_channels: touch
                .channels
                .states
                .iter()
                .filter(|state| **state == ChannelState::Faulty)
                .count(),
            contacts: touch.contacts.len(),
            states: touch.state_counts(),
            components: meaning.components,
            values,
            readings,
        }
    }
}
