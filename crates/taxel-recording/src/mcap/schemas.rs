//! The topics of a recording: their numbers, which never change, and their types as ROS 2
//! writes them.

/// Topics of messages for other programs in recordings; channels of these names and with numbers from
/// [`FIRST_BESIDE`] on are ours.
pub(super) const BESIDE: [&str; 6] = [
    "/taxel/wrench",
    "/taxel/image",
    "/taxel/contacts",
    "/taxel/grid",
    "/taxel/scene",
    "/tf",
];
/// Least number of a channel of such messages.
pub(super) const FIRST_BESIDE: u16 = 100;

/// A topic of a recording. Its number is fixed for ever, so that a file whose beginning is
/// destroyed still means something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u16)]
pub enum Topic {
    /// Bytes as they came off the wire.
    Wire = 1,
    /// Raw frames.
    Raw = 2,
    /// Forces, deviations, states, contacts and totals.
    Touch = 3,
    /// Events of contacts.
    Events = 4,
    /// States of the link.
    Link = 5,
    /// Rest values, and what changed them.
    Rest = 6,
    /// Relations of clocks.
    Clock = 7,
    /// Losses and the condition of the channels.
    Health = 8,
    /// Marks of the operator.
    Marks = 9,
}

impl Topic {
    /// All topics, in the order of their numbers.
    pub const ALL: [Self; 9] = [
        Self::Wire,
        Self::Raw,
        Self::Touch,
        Self::Events,
        Self::Link,
        Self::Rest,
        Self::Clock,
        Self::Health,
        Self::Marks,
    ];

    /// The topic of this number.
    pub fn of_number(number: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.number() == number)
    }

    /// Its number.
    pub fn number(self) -> u16 {
        self as u16
    }

    /// Its place in [`Topic::ALL`].
    pub(super) fn place(self) -> usize {
        usize::from(self.number()) - 1
    }

    /// Its name, such as `/taxel/raw`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wire => "/taxel/wire",
            Self::Raw => "/taxel/raw",
            Self::Touch => "/taxel/touch",
            Self::Events => "/taxel/events",
            Self::Link => "/taxel/link",
            Self::Rest => "/taxel/rest",
            Self::Clock => "/taxel/clock",
            Self::Health => "/taxel/health",
            Self::Marks => "/taxel/marks",
        }
    }

    /// Name of the type of its messages.
    pub fn type_name(self) -> &'static str {
        match self {
            Self::Wire => "taxel_msgs/msg/Wire",
            Self::Raw => "taxel_msgs/msg/Frame",
            Self::Touch => "taxel_msgs/msg/Touch",
            Self::Events => "taxel_msgs/msg/Event",
            Self::Link => "taxel_msgs/msg/Link",
            Self::Rest => "taxel_msgs/msg/Rest",
            Self::Clock => "taxel_msgs/msg/Clock",
            Self::Health => "taxel_msgs/msg/Health",
            Self::Marks => "taxel_msgs/msg/Mark",
        }
    }

    /// Definition of the type with those that it uses (`ros2msg`).
    pub fn definition(self) -> String {
        let own = match self {
            Self::Wire => WIRE,
            Self::Raw => RAW,
            Self::Touch => TOUCH,
            Self::Events => EVENT,
            Self::Link => LINK,
            Self::Rest => REST,
            Self::Clock => CLOCK,
            Self::Health => HEALTH,
            Self::Marks => MARK,
        };
        let line = "=".repeat(80);
        let mut text = own.to_owned();
        if own.contains("builtin_interfaces/Time") {
            text.push_str(&line);
            text.push_str("\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
        }
        if own.contains("taxel_msgs/Contact") {
            text.push_str(&line);
            text.push_str("\nMSG: taxel_msgs/Contact\n");
            text.push_str(CONTACT);
        }
        text
    }
}

const WIRE: &str = "\
# Bytes as they came off the wire.
# Time of this computer, UTC.
builtin_interfaces/Time stamp
# Steady clock of this computer at the last byte, ns since the source was opened.
uint64 host_ns
uint8[] bytes
";

const RAW: &str = "\
# One reading of every channel of a device.
# Time of this computer at its arrival, UTC.
builtin_interfaces/Time stamp
# Running number given by the device.
uint64 sequence
# Time of the device, ns.
uint64 device_time_ns
# Steady clock of this computer at its last byte, ns since the source was opened;
# 18446744073709551615 for a frame that did not come over a link.
uint64 arrival_ns
# 1: the wire has no check; 2: the time is not the device's own.
uint8 flags
# SI; NaN where there is no reading.
float64[] values
";

const TOUCH: &str = "\
# Touch on the whole array in one frame.
uint64 sequence
# Time of the device, ns.
uint64 device_time_ns
# Components of a value: 3 for x, y, z; 1 for z alone, which presses.
uint8 components
# Value of each taxel, row by row, component by component, SI.
float32[] values
# Their standard deviations, SI; NaN where not known.
float32[] deviations
# Consistency residual of each taxel in standard deviations; NaN without redundant channels.
float32[] residuals
# State of each taxel: 0 ok, 1 unchecked, 2 closed, 3 out_of_range, 4 not_converged,
# 5 inconsistent, 6 faulty, 7 masked, 8 saturated, 9 ambiguous, 10 below_zero.
uint8[] states
# 1 for a taxel that is part of totals and contacts.
uint8[] counted
# State of each channel: 0 ok, 1 closed, 2 saturated, 3 faulty, 4 masked.
uint8[] channel_states
# Total force, N, its standard deviation, N, and moment, N m; NaN where not known.
float64[3] force
float64[3] force_deviation
float64[3] moment
# Sum of the counted values along z, SI.
float64 sum
# Centre of pressure, m (cells where the pitch is not known), and its covariance xx, xy, yy;
# NaN without contact.
float64[2] centre_of_pressure
float64[3] centre_covariance
# Taxels that are not counted, channels at an end of their range, contacts merged.
uint32 left_out
uint32 clipped
uint32 merged
# True after a pause of a device that relaxes.
bool history_uncertain
# The strongest first.
taxel_msgs/Contact[] contacts
# False while the values are no forces yet: the zero is not taken.
bool zero_known
# How much the total says: 0 exact, 1 at least, 2 unknown; and the state that is the reason, 255 for none.
uint8 total_certainty
uint8 total_reason
# The same of each contact.
uint8[] contact_certainties
";

const CONTACT: &str = "\
# Number of the contact, which stays with it.
uint64 id
uint32 taxels
# m2
float64 area
# Centre on the developed surface, m (cells where the pitch is not known), and its covariance
# xx, xy, yy.
float64[2] centre
float64[3] covariance
# N
float64[3] force
float64[3] force_deviation
# N m
float64 torsion
# Largest value, N, and its taxel.
float64 peak
uint32 peak_taxel
# State of a taxel that makes the force a lower bound; 255 for none.
uint8 bound
# m/s
float64[2] velocity
";

const EVENT: &str = "\
# Something began, changed or ended.
# Its number in this run, from 0.
uint64 index
# Time of the device, ns.
uint64 device_time_ns
# Number of the contact; 0 for none.
uint64 contact
# touch, release, split, merged, step, impact, cyclic, slip, saturated, closed, overload
string kind
# In the unit; NaN where not known.
float64 value
float64 deviation
string unit
# Contact that a split one came off; 0 for none.
uint64 parent
# Contact that a merged one went into; 0 for none.
uint64 into
# Rise time of an impact, s; NaN for none.
float64 rise_time
# Smaller over larger amplitude of a cyclic load; NaN for none.
float64 symmetry
# Unit vector of a slip; NaN for none.
float64[2] direction
# Correlation of a slip along rows; NaN for none.
float64 score
# How much the value says: exact, at_least, unknown.
string certainty
";

const LINK: &str = "\
# State of the link to the device.
# Time of this computer, UTC.
builtin_interfaces/Time stamp
# Steady clock of this computer, ns since the source was opened.
uint64 host_ns
# From one connection to the next.
uint32 segment
# absent, opening, connected, in_step, silent, garbled; reconnected stands between the frames
# before and after a new connection
string state
string reason
";

const REST: &str = "\
# Rest values, and what changed them.
# Time of this computer, UTC.
builtin_interfaces/Time stamp
# Time of the device, ns; 18446744073709551615 before the first frame.
uint64 device_time_ns
# begun, started, started_unasked, captured, refused, cleared, undone
string kind
# start, page, ...
string by
string message
# Frames of a capture that is started.
uint32 frames
# Reading of each channel at rest, SI.
float64[] values
# Captured reading of each channel, SI, and the noise that was measured; NaN where none was.
float64[] captured
float64[] noise
# 1 for a channel that read at the high end throughout the capture.
uint8[] at_end
";

const CLOCK: &str = "\
# Relations of clocks at one moment.
# Time of this computer, UTC.
builtin_interfaces/Time stamp
# Steady clock of this computer, ns since the source was opened.
uint64 host_ns
# From one connection to the next.
uint32 segment
# Host time = device_time_ns + offset_ns at this moment, running rate times as fast.
uint64 device_time_ns
float64 offset_ns
float64 rate
# Bounds of the host time, ns before and after; NaN where not known.
float64 lower_ns
float64 upper_ns
";

const HEALTH: &str = "\
# Losses and the condition of the channels.
# Time of this computer, UTC.
builtin_interfaces/Time stamp
# Time of the device, ns.
uint64 device_time_ns
# Frames so far.
uint64 accepted
uint64 lost
uint64 late
uint64 duplicate
uint64 repeated
uint64 restarts
uint64 clipped
# Frames per second over the last second.
float64 rate
# Names of the channels that something is against, and what.
string[] wrong
string[] reasons
";

const MARK: &str = "\
# A mark of the operator.
# Time of this computer, UTC.
builtin_interfaces/Time stamp
# Steady clock of this computer, ns; 18446744073709551615 where it is not known.
uint64 host_ns
# Time of the device, ns; 18446744073709551615 before the first frame.
uint64 device_time_ns
string text
string by
";
