//! Bytes, frames and rest values.

use super::{Decoder, Encoder, Message, Topic, known_time, time_or_none};
use crate::frame::{Frame, FrameFlags};

/// Bytes as they came off the wire, about 20 ms of them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct WireMessage {
    /// Time of this computer, ns of UTC.
    pub utc_ns: u64,
    /// Steady clock of this computer at the last byte, ns.
    pub host_ns: u64,
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl Message for WireMessage {
    const TOPIC: Topic = Topic::Wire;

    fn device_time_ns(&self) -> Option<u64> {
        None
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let mut fields = Encoder::new(out);
        fields.time(self.utc_ns);
        fields.u64(self.host_ns);
        fields.bytes(&self.bytes);
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut fields = Decoder::new(bytes)?;
        Some(Self {
            utc_ns: fields.time()?,
            host_ns: fields.u64()?,
            bytes: fields.bytes()?,
        })
    }
}

/// A raw frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameMessage {
    /// Time of this computer at its arrival, ns of UTC.
    pub utc_ns: u64,
    /// The frame.
    pub frame: Frame,
}

impl Message for FrameMessage {
    const TOPIC: Topic = Topic::Raw;

    fn device_time_ns(&self) -> Option<u64> {
        Some(self.frame.time_ns)
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let frame = &self.frame;
        let mut fields = Encoder::new(out);
        fields.time(self.utc_ns);
        fields.u64(frame.sequence);
        fields.u64(frame.time_ns);
        fields.u64(time_or_none(frame.host_ns));
        fields.u8(frame.flags.bits());
        fields.doubles(&frame.values);
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut fields = Decoder::new(bytes)?;
        let utc_ns = fields.time()?;
        let frame = Frame {
            sequence: fields.u64()?,
            time_ns: fields.u64()?,
            host_ns: known_time(fields.u64()?),
            flags: FrameFlags::of_bits(fields.u8()?),
            values: fields.doubles()?,
        };
        Some(Self { utc_ns, frame })
    }
}

/// Kind of a change of the rest values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RestKind {
    /// Those that the run began with.
    #[default]
    Begun,
    /// A rest capture begins, whatever presses.
    Started,
    /// A rest capture begins that nobody asked for.
    StartedUnasked,
    /// A rest capture has ended.
    Captured,
    /// A rest capture was refused; nothing changed.
    Refused,
    /// A return to those of the start.
    Cleared,
    /// A return to those of an earlier change.
    Undone,
}

impl RestKind {
    const ALL: [Self; 7] = [
        Self::Begun,
        Self::Started,
        Self::StartedUnasked,
        Self::Captured,
        Self::Refused,
        Self::Cleared,
        Self::Undone,
    ];

    /// Name in messages and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Begun => "begun",
            Self::Started => "started",
            Self::StartedUnasked => "started_unasked",
            Self::Captured => "captured",
            Self::Refused => "refused",
            Self::Cleared => "cleared",
            Self::Undone => "undone",
        }
    }
}

/// Rest values, and what changed them. It stands in a recording between the frames between
/// which it came.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RestMessage {
    /// Time of this computer, ns of UTC.
    pub utc_ns: u64,
    /// Device time, ns; `None` before the first frame.
    pub device_time_ns: Option<u64>,
    /// What happened.
    pub kind: RestKind,
    /// Who did it, such as `page`.
    pub by: String,
    /// Why it was refused, or where the values are from; may be empty.
    pub message: String,
    /// Frames of a capture that begins; else 0.
    pub frames: u32,
    /// Reading of each channel at rest, SI.
    pub values: Vec<f64>,
    /// Captured reading of each channel, SI, and the noise that the capture measured; `None`
    /// where the channel is as drawn.
    pub captured: Vec<Option<[f64; 2]>>,
    /// True for a channel that read at the high end throughout the capture.
    pub at_end: Vec<bool>,
}

impl Message for RestMessage {
    const TOPIC: Topic = Topic::Rest;

    fn device_time_ns(&self) -> Option<u64> {
        self.device_time_ns
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let part = |of: usize| -> Vec<f64> {
            let known = self.captured.iter();
            known
                .map(|one| one.map_or(f64::NAN, |pair| pair[of]))
                .collect()
        };
        let mut fields = Encoder::new(out);
        fields.time(self.utc_ns);
        fields.u64(time_or_none(self.device_time_ns));
        fields.string(self.kind.name());
        fields.string(&self.by);
        fields.string(&self.message);
        fields.u32(self.frames);
        fields.doubles(&self.values);
        fields.doubles(&part(0));
        fields.doubles(&part(1));
        let at_end: Vec<u8> = self.at_end.iter().map(|at_end| u8::from(*at_end)).collect();
        fields.bytes(&at_end);
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut fields = Decoder::new(bytes)?;
        let mut change = Self {
            utc_ns: fields.time()?,
            device_time_ns: known_time(fields.u64()?),
            ..Self::default()
        };
        let kind = fields.string()?;
        change.kind = RestKind::ALL.into_iter().find(|one| one.name() == kind)?;
        change.by = fields.string()?;
        change.message = fields.string()?;
        change.frames = fields.u32()?;
        change.values = fields.doubles()?;
        let (captured, noise) = (fields.doubles()?, fields.doubles()?);
        change.captured = captured
            .into_iter()
            .zip(noise)
            .map(|(value, noise)| (!value.is_nan()).then_some([value, noise]))
            .collect();
        change.at_end = fields.bytes()?.into_iter().map(|byte| byte != 0).collect();
        Some(change)
    }
}
