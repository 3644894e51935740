//! Touch on an array in one frame, whatever the device: the result of estimation.

use super::certainty::Certainty;
use super::contact::Contact;
use crate::layout::Wrench;

/// State of the value of a taxel: how far it can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// Nothing is against the value.
    Ok = 0,
    /// A value without a check, or one that cannot be relied on yet.
    Unchecked = 1,
    /// Electrodes touch each other: the value is a lower bound.
    Closed = 2,
    /// Beyond the full scale, or beyond what the model knows.
    OutOfRange = 3,
    /// The search did not end: the value is its last step.
    NotConverged = 4,
    /// The readings contradict each other or the model: for several frames, or
    /// plainly in this one.
    Inconsistent = 5,
    /// A channel gives no reading, or an impossible one; the value is from the
    /// others, or there is none.
    Faulty = 6,
    /// Not used.
    Masked = 7,
    /// The reading is at the end of what can be read: the value is a bound.
    Saturated = 8,
    /// Several positions, or several values, explain the readings equally well.
    Ambiguous = 9,
    /// Pressing below zero beyond what noise can do: the zero is wrong.
    BelowZero = 10,
}

impl State {
    /// All states in the order of their codes.
    pub const ALL: [Self; 11] = [
        Self::Ok,
        Self::Unchecked,
        Self::Closed,
        Self::OutOfRange,
        Self::NotConverged,
        Self::Inconsistent,
        Self::Faulty,
        Self::Masked,
        Self::Saturated,
        Self::Ambiguous,
        Self::BelowZero,
    ];

    /// True if a value in this state is no more than a bound.
    pub fn is_bound(self) -> bool {
        matches!(self, Self::Saturated | Self::Closed | Self::OutOfRange)
    }

    /// Name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Unchecked => "unchecked",
            Self::Closed => "closed",
            Self::OutOfRange => "out_of_range",
            Self::NotConverged => "not_converged",
            Self::Inconsistent => "inconsistent",
            Self::Faulty => "faulty",
            Self::Masked => "masked",
            Self::Saturated => "saturated",
            Self::Ambiguous => "ambiguous",
            Self::BelowZero => "below_zero",
        }
    }
}

/// Reading of one channel in one frame, as far as it can be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum ChannelState {
    /// Used.
    Ok = 0,
    /// Used; the electrodes of this capacitor touch each other.
    Closed = 1,
    /// At the high end of what can be read: no number, but not a fault.
    Saturated = 2,
    /// No reading, one that the channel cannot give, or the same one for too
    /// long.
    Faulty = 3,
    /// Not used.
    Masked = 4,
}

impl ChannelState {
    /// All states in the order of their codes.
    pub const ALL: [Self; 5] = [
        Self::Ok,
        Self::Closed,
        Self::Saturated,
        Self::Faulty,
        Self::Masked,
    ];

    /// Name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Closed => "closed",
            Self::Saturated => "saturated",
            Self::Faulty => "faulty",
            Self::Masked => "masked",
        }
    }

    /// True if the reading is a number that may be used.
    pub fn usable(self) -> bool {
        matches!(self, Self::Ok | Self::Closed)
    }
}

/// Readings of all channels in one frame, in the order of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChannelReadings {
    /// Reading of each channel, SI; `NaN` for none.
    pub readings: Vec<f64>,
    /// Reading of the empty device, SI; `NaN` where it is not known.
    pub rest: Vec<f64>,
    /// State of each reading.
    pub states: Vec<ChannelState>,
    /// How far each reading that contradicts the others is from what they say, in standard
    /// deviations; `NaN` where it agrees, and where nothing is known of it.
    pub residuals: Vec<f64>,
}

impl ChannelReadings {
    /// No reading of any of `channels` channels.
    pub(super) fn new(channels: usize) -> Self {
        Self {
            readings: vec![f64::NAN; channels],
            rest: vec![f64::NAN; channels],
            states: vec![ChannelState::Ok; channels],
            residuals: vec![f64::NAN; channels],
        }
    }
}

/// Touch on one taxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaxelTouch {
    /// Value along x, y and z in the taxel's frame, SI; z presses. `NaN` where
    /// there is none: a device of one component has z alone.
    pub value: [f64; 3],
    /// Its covariance; `NaN` where it is not known.
    pub covariance: [[f64; 3]; 3],
    /// Signed consistency residual, one standard deviation wide; `NaN` without
    /// redundant channels.
    pub residual: f64,
    /// State of the value.
    pub state: State,
    /// True if the value is part of totals and contacts.
    pub counted: bool,
}

impl TaxelTouch {
    /// A taxel without a value, and why.
    pub fn without_value(state: State) -> Self {
        Self::pressing(f64::NAN, f64::NAN, state)
    }

    /// The value of a device of one component, with its standard deviation.
    pub fn pressing(value: f64, deviation: f64, state: State) -> Self {
        let mut covariance = [[f64::NAN; 3]; 3];
        covariance[2][2] = deviation * deviation;
        Self {
            value: [f64::NAN, f64::NAN, value],
            covariance,
            residual: f64::NAN,
            state,
            counted: false,
        }
    }

    /// Value along z, SI: pressing force or pressure.
    pub fn pressed(&self) -> f64 {
        self.value[2]
    }

    /// Standard deviation of [`TaxelTouch::pressed`], SI.
    pub fn pressed_deviation(&self) -> f64 {
        self.covariance[2][2].sqrt()
    }

    /// Standard deviations of the value, SI.
    pub fn deviation(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.covariance[axis][axis].sqrt())
    }
}

/// Touch on the whole array in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Touch {
    /// Sequence number of the frame.
    pub sequence: u64,
    /// Device time of the frame, ns.
    pub time_ns: u64,
    /// Readings of the channels.
    pub channels: ChannelReadings,
    /// Each taxel, row by row.
    pub taxels: Vec<TaxelTouch>,
    /// Sum of the counted values along z, SI.
    pub sum: f64,
    /// Total force and moment in the sensor's frame over the counted taxels;
    /// `NaN` where the device does not know them.
    pub total: Wrench,
    /// Covariance of the total force, N²; `NaN` where it is not known.
    pub total_covariance: [[f64; 3]; 3],
    /// How much the pressing force of the total says; where the device gives no force, how much
    /// [`Touch::sum`] says. Shear and moment are known only of an exact one.
    pub total_certainty: Certainty,
    /// The state that is the reason why it is not exact, if it is that of a taxel.
    pub total_reason: Option<State>,
    /// False while the values are no forces yet: the device needs a rest capture that is not at
    /// its end.
    pub zero_known: bool,
    /// Standard deviations of the total moment, N m; `NaN` where they are not known.
    pub moment_deviation: [f64; 3],
    /// Centre of the values over all contacts on the developed surface, m, and
    /// its covariance xx, xy, yy, m² (`NaN` where it is not known); `None`
    /// without contact. In cells where the pitch is unknown.
    pub centre_of_pressure: Option<([f64; 2], [f64; 3])>,
    /// How deep the contact presses, as the coordinate z of the training, m, and its standard
    /// deviation; `None` where the device does not know it or without contact.
    pub depth: Option<[f64; 2]>,
    /// Contact regions, strongest first.
    pub contacts: Vec<Contact>,
    /// Regions that are part of a contact beside them, because there are more than a frame
    /// can have ([`super::MOST_CONTACTS`]).
    pub merged: usize,
    /// Index of the contact of each taxel, row by row.
    pub regions: Vec<Option<u32>>,
    /// Taxels that are not part of totals and contacts; the state of each says
    /// why ([`TaxelTouch::counted`]).
    pub left_out: usize,
    /// Channels whose reading was at an end of the range, masked ones not
    /// counted.
    pub clipped: usize,
    /// True if the history of the values is uncertain: a relaxing device, and a
    /// pause longer than three of its relaxation times not long ago.
    pub history_uncertain: bool,
}

/// Force and moment of which nothing is known.
pub(super) const UNKNOWN: Wrench = Wrench {
    force: [f64::NAN; 3],
    moment: [f64::NAN; 3],
};

impl Touch {
    /// Nothing known of `taxels` taxels and `channels` channels.
    pub(super) fn new(channels: usize, taxels: usize) -> Self {
        Self {
            sequence: 0,
            time_ns: 0,
            channels: ChannelReadings::new(channels),
            taxels: vec![TaxelTouch::without_value(State::Masked); taxels],
            sum: 0.0,
            total: UNKNOWN,
            total_covariance: [[f64::NAN; 3]; 3],
            total_certainty: Certainty::Unknown,
            total_reason: None,
            zero_known: true,
            moment_deviation: [f64::NAN; 3],
            centre_of_pressure: None,
            depth: None,
            contacts: Vec::new(),
            merged: 0,
            regions: vec![None; taxels],
            left_out: taxels,
            clipped: 0,
            history_uncertain: false,
        }
    }

    /// Takes back all that adds up values which are no forces.
    pub(super) fn say_nothing(&mut self) {
        self.sum = f64::NAN;
        self.total = UNKNOWN;
        self.total_covariance = [[f64::NAN; 3]; 3];
        self.moment_deviation = [f64::NAN; 3];
        (self.total_certainty, self.total_reason) = (Certainty::Unknown, None);
        (self.centre_of_pressure, self.depth) = (None, None);
        self.contacts.clear();
        self.regions.fill(None);
    }

    /// Number of taxels in each state, in the order of the state codes.
    pub fn state_counts(&self) -> [usize; State::ALL.len()] {
        let mut counts = [0; State::ALL.len()];
        for taxel in &self.taxels {
            counts[taxel.state as usize] += 1;
        }
        counts
    }

    /// Standard deviations of the total force, N.
    pub fn total_deviation(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.total_covariance[axis][axis].sqrt())
    }

    /// Pressing force on the whole array with its standard deviation, N; none
    /// where the device does not know it, or knows no more than a bound.
    pub fn pressing_force(&self) -> Option<[f64; 2]> {
        let force = self.total.force[2];
        (self.total_certainty == Certainty::Exact && !force.is_nan())
            .then(|| [force, self.total_covariance[2][2].sqrt()])
    }
}
