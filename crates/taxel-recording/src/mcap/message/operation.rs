//! How the run went: link, clocks, losses and marks.

use super::{Decoder, Encoder, Message, Topic, known_time, time_or_none};

/// State of the message that stands between the frames before and after a new connection.
pub const RECONNECTED: &str = "reconnected";

/// A state of the link.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LinkMessage {
    /// Time of this computer, ns of UTC.
    pub utc_ns: u64,
    /// Steady clock of this computer, ns.
    pub host_ns: u64,
    /// Segment of the recording, from one connection to the next.
    pub segment: u32,
    /// Name of the state, such as `silent`.
    pub state: String,
    /// Why, in words; may be empty.
    pub reason: String,
}

impl Message for LinkMessage {
    const TOPIC: Topic = Topic::Link;

    fn device_time_ns(&self) -> Option<u64> {
        None
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let mut fields = Encoder::new(out);
        fields.time(self.utc_ns);
        fields.u64(self.host_ns);
        fields.u32(self.segment);
        fields.string(&self.state);
        fields.string(&self.reason);
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut fields = Decoder::new(bytes)?;
        Some(Self {
            utc_ns: fields.time()?,
            host_ns: fields.u64()?,
            segment: fields.u32()?,
            state: fields.string()?,
            reason: fields.string()?,
        })
    }
}

/// Relations of the clocks at one moment: UTC to the steady clock of this computer, and that
/// to the device.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ClockMessage {
    /// Time of this computer, ns of UTC.
    pub utc_ns: u64,
    /// Steady clock of this computer at the same moment, ns.
    pub host_ns: u64,
    /// Segment of the recording, from one connection to the next.
    pub segment: u32,
    /// Device time, ns; `None` where no relation to the device is known.
    pub device_time_ns: Option<u64>,
    /// Host time less device time at this moment, ns.
    pub offset_ns: f64,
    /// Seconds of the host in one of the device.
    pub rate: f64,
    /// Bound of the host time before, ns; `NaN` where it is not known.
    pub lower_ns: f64,
    /// Bound of the host time behind, ns; `NaN` where it is not known.
    pub upper_ns: f64,
}

impl Message for ClockMessage {
    const TOPIC: Topic = Topic::Clock;

    fn device_time_ns(&self) -> Option<u64> {
        self.device_time_ns
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let mut fields = Encoder::new(out);
        fields.time(self.utc_ns);
        fields.u64(self.host_ns);
        fields.u32(self.segment);
        fields.u64(time_or_none(self.device_time_ns));
        fields.f64s([self.offset_ns, self.rate, self.lower_ns, self.upper_ns]);
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut fields = Decoder::new(bytes)?;
        Some(Self {
            utc_ns: fields.time()?,
            host_ns: fields.u64()?,
            segment: fields.u32()?,
            device_time_ns: known_time(fields.u64()?),
            offset_ns: fields.f64()?,
            rate: fields.f64()?,
            lower_ns: fields.f64()?,
            upper_ns: fields.f64()?,
        })
    }
}

/// Losses so far and the condition of the channels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HealthMessage {
    /// Time of this computer, ns of UTC.
    pub utc_ns: u64,
    /// Device time, ns.
    pub device_time_ns: u64,
    /// Frames accepted as new.
    pub accepted: u64,
    /// Frames that never came.
    pub lost: u64,
    /// Frames that came late.
    pub late: u64,
    /// Frames that came twice.
    pub duplicate: u64,
    /// Frames that repeat the readings of the one before.
    pub repeated: u64,
    /// Times the device began a new sequence.
    pub restarts: u64,
    /// Frames with a clipped channel.
    pub clipped: u64,
    /// Frames per second over the last second.
    pub rate: f64,
    /// Names of the channels that something is against.
    pub wrong: Vec<String>,
    /// What, in words, for each of them.
    pub reasons: Vec<String>,
}

impl Message for HealthMessage {
    const TOPIC: Topic = Topic::Health;

    fn device_time_ns(&self) -> Option<u64> {
        Some(self.device_time_ns)
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let mut fields = Encoder::new(out);
        fields.time(self.utc_ns);
        for count in [
            self.device_time_ns,
            self.accepted,
            self.lost,
            self.late,
            self.duplicate,
            self.repeated,
            self.restarts,
            self.clipped,
        ] {
            fields.u64(count);
        }
        fields.f64(self.rate);
        fields.strings(&self.wrong);
        fields.strings(&self.reasons);
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut fields = Decoder::new(bytes)?;
        Some(Self {
            utc_ns: fields.time()?,
            device_time_ns: fields.u64()?,
            accepted: fields.u64()?,
            lost: fields.u64()?,
            late: fields.u64()?,
            duplicate: fields.u64()?,
            repeated: fields.u64()?,
            restarts: fields.u64()?,
            clipped: fields.u64()?,
            rate: fields.f64()?,
            wrong: fields.strings()?,
            reasons: fields.strings()?,
        })
    }
}

/// A mark of the operator.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MarkMessage {
    /// Time of this computer, ns of UTC.
    pub utc_ns: u64,
    /// Steady clock of this computer, ns; `None` where it is not known.
    pub host_ns: Option<u64>,
    /// Device time of the newest frame, ns; `None` before the first.
    pub device_time_ns: Option<u64>,
    /// The text.
    pub text: String,
    /// Who set it, such as `page`.
    pub by: String,
}

impl Message for MarkMessage {
    const TOPIC: Topic = Topic::Marks;

    fn device_time_ns(&self) -> Option<u64> {
        self.device_time_ns
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let mut fields = Encoder::new(out);
        fields.time(self.utc_ns);
        fields.u64(time_or_none(self.host_ns));
        fields.u64(time_or_none(self.device_time_ns));
        fields.string(&self.text);
        fields.string(&self.by);
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut fields = Decoder::new(bytes)?;
        Some(Self {
            utc_ns: fields.time()?,
            host_ns: known_time(fields.u64()?),
            device_time_ns: known_time(fields.u64()?),
            text: fields.string()?,
            by: fields.string()?,
        })
    }
}
