//! What a run felt last, for its report.

use taxel::estimation::State;

use crate::sense::Felt;

/// What was felt in the last frame.
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
    /// Sum of the values of a map, SI.
    pub sum: Option<f64>,
    /// Centre of pressure, m.
    pub centre_of_pressure: Option<[f64; 2]>,
    /// Number of contact regions.
    pub contacts: usize,
    /// Number of taxels in each state.
    pub states: [usize; State::ALL.len()],
    /// Force of each taxel, N; empty but for three-axis units.
    pub taxel_forces: Vec<[f64; 3]>,
    /// Value of each taxel, SI, of a device of one value per taxel.
    pub taxel_values: Vec<f64>,
    /// Signal of each channel of such a device, SI.
    pub signals: Vec<f64>,
}

impl LastTouch {
    /// `reuse` is the one before, whose memory is used again.
    pub(crate) fn new(felt: Felt<'_>, reuse: Option<Self>) -> Self {
        let mut taxel_forces = reuse.map_or_else(Vec::new, |last| last.taxel_forces);
        taxel_forces.clear();
        let states = felt.state_counts();
        match felt {
            Felt::ThreeAxis(touch) => {
                taxel_forces.extend(touch.taxels.iter().map(|taxel| taxel.force));
                Self {
                    sequence: touch.sequence,
                    time_ns: touch.time_ns,
                    force: touch.total.force,
                    deviation: std::array::from_fn(|i| touch.total_covariance[i][i].sqrt()),
                    moment: touch.total.moment,
                    sum: None,
                    centre_of_pressure: touch.centre_of_pressure.map(|(centre, _)| centre),
                    contacts: touch.contacts.len(),
                    states,
                    taxel_forces,
                    taxel_values: Vec::new(),
                    signals: Vec::new(),
                }
            }
            Felt::Signals(touch) => {
                let [force, deviation] = touch.force.unwrap_or([f64::NAN; 2]);
                let unknown = f64::NAN;
                Self {
                    sequence: touch.sequence,
                    time_ns: touch.time_ns,
                    force: [unknown, unknown, force],
                    deviation: [unknown, unknown, deviation],
                    moment: [unknown; 3],
                    sum: None,
                    centre_of_pressure: touch.centre_of_pressure.map(|(centre, _)| centre),
                    contacts: touch.contacts.len(),
                    states,
                    taxel_forces,
                    taxel_values: touch.taxels.iter().map(|taxel| taxel.value).collect(),
                    signals: touch.signals.clone(),
                }
            }
            Felt::Map(touch) => Self {
                sequence: touch.sequence,
                time_ns: touch.time_ns,
                force: [f64::NAN, f64::NAN, touch.force.unwrap_or(f64::NAN)],
                deviation: [f64::NAN; 3],
                moment: [f64::NAN; 3],
                sum: Some(touch.sum),
                centre_of_pressure: touch.centre_of_pressure,
                contacts: touch.contacts.len(),
                states,
                taxel_forces,
                taxel_values: Vec::new(),
                signals: Vec::new(),
            },
        }
    }
}
