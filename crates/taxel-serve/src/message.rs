//! Messages to clients; `docs/live-protocol.md` is their table.

use bytes::{BufMut, Bytes, BytesMut};
use serde::Serialize;
use taxel::acquisition::{FrameFlags, Stream};
use taxel::estimation::{
    ArrayEstimator, Certainty, ChannelState, Contact, Continuity, Scale, State, TaxelTouch, Touch,
    Wiring,
};
use taxel::layout::Mount;

use crate::link::LinkStatus;
use crate::record::RecordingNow;
use crate::replay::ReplayNow;
use crate::tare::BelowZero;

/// The bytes `TXL5`.
const MAGIC: u32 = 0x354C_5854;
/// Version of the protocol.
const PROTOCOL: u32 = 5;

/// Facts about the stream of frames that go with each message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Health<'a> {
    pub(crate) continuity: &'a Continuity,
    /// Frames per second over the last second.
    pub(crate) rate: f64,
    /// From arrival to encoding, s.
    pub(crate) latency: f64,
    pub(crate) tared: bool,
    pub(crate) capturing: bool,
    /// Arrival of the frame by the steady clock, ns since the program began.
    pub(crate) host_ns: Option<u64>,
    pub(crate) flags: FrameFlags,
    /// Frames lost so far; none where the wire cannot tell.
    pub(crate) lost: Option<u64>,
}

/// More contacts than fit a u16 cannot be drawn anyway.
const MOST_CONTACTS: usize = u16::MAX as usize;
/// Bytes before the contacts, and of one contact.
pub(crate) const HEADER: usize = 216;
pub(crate) const CONTACT: usize = 8 * 20;
/// Code of no state.
pub(crate) const NO_STATE: u8 = u8::MAX;

/// Encodes one frame of a device whose values have so many components.
pub(crate) fn frame(touch: &Touch, components: usize, health: &Health<'_>) -> Bytes {
    let (channels, taxels) = (&touch.channels, &touch.taxels);
    let contacts = &touch.contacts[..touch.contacts.len().min(MOST_CONTACTS)];
    let size = HEADER
        + CONTACT * contacts.len()
        + 5 * channels.readings.len()
        + (8 * components + 6) * taxels.len();
    let mut out = BytesMut::with_capacity(size);
    header(&mut out, touch, components, contacts.len(), health);
    for contact in contacts {
        put_contact(&mut out, contact);
    }
    put_floats::<1>(&mut out, channels.readings.iter().map(|reading| [*reading]));
    let value = |taxel: &TaxelTouch| taxel.value;
    if components == 3 {
        put_floats(&mut out, taxels.iter().map(value));
        put_floats(&mut out, taxels.iter().map(TaxelTouch::deviation));
    } else {
        // Of a device of one component, z is the last.
        put_floats(&mut out, taxels.iter().map(value).map(|[_, _, z]| [z]));
        put_floats(
            &mut out,
            taxels
                .iter()
                .map(TaxelTouch::deviation)
                .map(|[_, _, z]| [z]),
        );
    }
    put_floats(&mut out, taxels.iter().map(|taxel| [taxel.residual]));
    out.extend(channels.states.iter().map(|state| *state as u8));
    out.extend(taxels.iter().map(|taxel| taxel.state as u8));
    out.extend(taxels.iter().map(|taxel| u8::from(taxel.counted)));
    out.freeze()
}

/// Appends groups of numbers of single precision; one growth for all, since a check of
/// the capacity for each number took longer than the numbers.
fn put_floats<const N: usize>(out: &mut BytesMut, groups: impl ExactSizeIterator<Item = [f64; N]>) {
    let begin = out.len();
    out.resize(begin + 4 * N * groups.len(), 0);
    let slots = out[begin..].as_chunks_mut::<4>().0.as_chunks_mut::<N>().0;
    for (slots, group) in slots.iter_mut().zip(groups) {
        *slots = group.map(|value| (value as f32).to_le_bytes());
    }
}

fn header(
    out: &mut BytesMut,
    touch: &Touch,
    components: usize,
    contacts: usize,
    health: &Health<'_>,
) {
    out.put_u32_le(MAGIC);
    out.put_u16_le(components as u16);
    out.put_u16_le(contacts as u16);
    out.put_u64_le(touch.sequence);
    out.put_u64_le(touch.time_ns);
    out.put_u64_le(health.lost.unwrap_or(u64::MAX));
    out.put_u64_le(health.continuity.late);
    out.put_u64_le(health.continuity.duplicate + health.continuity.repeated);
    let (centre, covariance) = touch
        .centre_of_pressure
        .unwrap_or(([f64::NAN; 2], [f64::NAN; 3]));
    let numbers = [health.rate, health.latency]
        .into_iter()
        .chain(touch.total.force)
        .chain(touch.total_deviation())
        .chain(touch.total.moment)
        .chain(centre)
        .chain(covariance)
        .chain([touch.sum]);
    numbers.for_each(|number| out.put_f64_le(number));
    out.put_u32_le(touch.taxels.len() as u32);
    out.put_u32_le(touch.channels.readings.len() as u32);
    let flags = [
        health.tared,
        health.capturing,
        touch.clipped > 0,
        touch.history_uncertain,
        touch.merged > 0,
        !touch.zero_known,
    ];
    let bits = flags.iter().enumerate();
    out.put_u32_le(bits.map(|(bit, flag)| u32::from(*flag) << bit).sum());
    out.put_u32_le(touch.left_out as u32);
    out.put_u64_le(health.host_ns.unwrap_or(u64::MAX));
    out.put_u32_le(health.flags.bits().into());
    out.put_u8(touch.total_certainty as u8);
    out.put_u8(touch.total_reason.map_or(NO_STATE, |state| state as u8));
    out.put_u16_le(0);
}

fn put_contact(out: &mut BytesMut, contact: &Contact) {
    let deviation = |axis: usize| contact.force_covariance[axis][axis].sqrt();
    let bound = contact
        .bound
        .map_or(f64::NAN, |state| f64::from(state as u8));
    let numbers = [contact.id as f64, contact.taxels as f64]
        .into_iter()
        .chain(contact.centre)
        .chain(contact.covariance)
        .chain(contact.velocity)
        .chain(contact.force)
        .chain([0, 1, 2].map(deviation))
        .chain([
            contact.torsion,
            contact.peak,
            contact.peak_taxel as f64,
            bound,
            f64::from(contact.certainty as u8),
        ]);
    numbers.for_each(|number| out.put_f64_le(number));
}

/// Program, device and source as the first message names them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Commit of the program.
    pub commit: String,
    /// SHA-256 of the sensor file; empty for a recording that describes itself.
    pub sensor_hash: String,
    /// Source as given on the command line.
    pub source: String,
    /// Name of the device.
    pub device: String,
}

#[derive(Debug, Serialize)]
struct ScaleMessage<'a> {
    quantity: &'a str,
    symbol: &'a str,
    si_per_unit: f64,
}

impl<'a> ScaleMessage<'a> {
    fn new(scale: &'a Scale) -> Self {
        Self {
            quantity: &scale.quantity,
            symbol: &scale.symbol,
            si_per_unit: scale.si_per_unit,
        }
    }
}

#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum MountMessage {
    Flat,
    Cylinder { radius_m: f64 },
}

#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum WiringMessage {
    PerTaxel { channels: usize },
    Crossing,
    Shared,
}

#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "hello")]
struct Hello<'a> {
    protocol: u32,
    name: &'a str,
    source: &'a str,
    version: &'a str,
    commit: &'a str,
    sensor_hash: &'a str,
    rows: usize,
    columns: usize,
    pitch_m: Option<[f64; 2]>,
    mount: MountMessage,
    channels: &'a [String],
    wiring: WiringMessage,
    reading: ScaleMessage<'a>,
    value: ScaleMessage<'a>,
    components: usize,
    signed: bool,
    full_scale: Option<f64>,
    verified: Option<f64>,
    picture: &'a str,
    total_known: bool,
    trained_m: Option<[[f64; 2]; 2]>,
    force_unit: &'a str,
    length_unit: &'a str,
    speed_unit: &'a str,
    period_s: Option<f64>,
    stale_after_s: f64,
    states: [&'a str; State::ALL.len()],
    channel_states: [&'a str; ChannelState::ALL.len()],
    certainties: [&'a str; Certainty::ALL.len()],
}

/// The first message to each client.
pub(crate) fn hello(
    stream: &Stream,
    estimator: &ArrayEstimator,
    provenance: &Provenance,
    stale_after: f64,
) -> String {
    let meaning = estimator.meaning();
    let layout = &meaning.layout;
    let hello = Hello {
        protocol: PROTOCOL,
        name: &provenance.device,
        source: &provenance.source,
        version: &provenance.version,
        commit: &provenance.commit,
        sensor_hash: &provenance.sensor_hash,
        rows: layout.rows,
        columns: layout.columns,
        pitch_m: meaning.pitch(),
        mount: match layout.mount {
            Mount::Flat => MountMessage::Flat,
            Mount::Cylinder(cylinder) => MountMessage::Cylinder {
                radius_m: cylinder.radius,
            },
        },
        channels: &meaning.channels,
        wiring: match meaning.wiring {
            Wiring::PerTaxel(channels) => WiringMessage::PerTaxel { channels },
            Wiring::Crossing { .. } => WiringMessage::Crossing,
            Wiring::Shared { .. } => WiringMessage::Shared,
        },
        reading: ScaleMessage::new(&meaning.reading),
        value: ScaleMessage::new(&meaning.value),
        components: meaning.components,
        signed: meaning.signed,
        full_scale: meaning.full_scale,
        verified: meaning.verified,
        picture: meaning.picture.name(),
        total_known: meaning.total_known,
        trained_m: estimator.trained_area(),
        force_unit: meaning.force_unit(),
        length_unit: meaning.length_unit(),
        speed_unit: meaning.speed_unit(),
        period_s: stream.period,
        stale_after_s: stale_after,
        states: State::ALL.map(State::name),
        channel_states: ChannelState::ALL.map(ChannelState::name),
        certainties: Certainty::ALL.map(Certainty::name),
    };
    serde_json::to_string(&hello).unwrap_or_default()
}

/// The rest values in force.
pub(crate) fn rest(values: &[f64]) -> String {
    serde_json::json!({ "type": "rest", "channels": values }).to_string()
}

/// State of the rest capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tare {
    /// The rest values are those of the calibration.
    None,
    /// A capture is under way.
    Running,
    /// The rest values are captured.
    Done,
    /// The rest values are from a recording.
    Loaded,
    /// The capture at the start was refused; it is taken as soon as nothing touches.
    Waiting,
}

/// The message every 100 ms.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "status")]
pub(crate) struct Status<'a> {
    pub(crate) stale: bool,
    pub(crate) age_s: f64,
    pub(crate) ended: bool,
    pub(crate) clients: usize,
    pub(crate) dropped: u64,
    pub(crate) tare: Tare,
    pub(crate) tare_time_ns: Option<u64>,
    pub(crate) message: &'a str,
    pub(crate) below_zero: Option<&'a BelowZero>,
    pub(crate) link: Option<LinkStatus>,
    pub(crate) recording: Option<RecordingNow>,
    pub(crate) records_to: Option<&'a str>,
    pub(crate) replay: Option<&'a ReplayNow>,
    /// Of a service with several; none of one.
    pub(crate) sensors: Vec<SensorNow<'a>>,
}

/// One of several sensors of a service.
#[derive(Debug, Serialize)]
pub(crate) struct SensorNow<'a> {
    pub(crate) name: &'a str,
    /// Where its page is.
    pub(crate) path: String,
    /// True of the one whose message this is.
    pub(crate) here: bool,
    pub(crate) state: &'static str,
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel::acquisition::{Frame, Quantity, SignalUnit};
    use taxel::estimation::{MapOptions, TouchSession};

    fn stream() -> Stream {
        Stream {
            name: String::new(),
            rows: 1,
            columns: 2,
            channels_per_taxel: 1,
            unit: SignalUnit {
                quantity: Quantity::Raw,
                symbol: "raw".into(),
                si_per_unit: 1.0,
            },
            pitch: None,
            period: None,
            threshold: None,
            present: vec![true, false],
        }
    }

    fn health(continuity: &Continuity) -> Health<'_> {
        Health {
            continuity,
            rate: 60.0,
            latency: 1e-3,
            tared: true,
            capturing: false,
            host_ns: Some(9),
            flags: FrameFlags::UNCHECKED_WIRE,
            lost: Some(continuity.lost),
        }
    }

    fn continuity() -> Continuity {
        let mut continuity = Continuity::default();
        (continuity.lost, continuity.late) = (1, 2);
        (continuity.duplicate, continuity.repeated) = (1, 2);
        continuity
    }

    /// Every offset of the table in `docs/live-protocol.md`, one component.
    #[test]
    fn frame_layout_is_the_documented_one() {
        let mut session = TouchSession::map(&stream(), &MapOptions::default());
        let frame_of = Frame {
            sequence: 7,
            time_ns: 8,
            values: vec![1.5, f64::NAN],
            ..Frame::default()
        };
        let continuity = continuity();
        let observed = session.push(&frame_of).unwrap();
        let bytes = frame(observed.touch, 1, &health(&continuity));
        let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let f64_at = |at: usize| f64::from_bits(u64_at(at));
        assert_eq!(&bytes[..8], b"TXL5\x01\x00\x01\x00");
        assert_eq!([8, 16, 24, 32, 40].map(u64_at), [7, 8, 1, 2, 3]);
        // Of raw values the total force is not known, their sum is.
        assert_eq!([48, 56].map(f64_at), [60.0, 1e-3]);
        assert!(
            [64, 80, 88, 112]
                .map(f64_at)
                .iter()
                .all(|number| number.is_nan())
        );
        assert_eq!([136, 144, 176].map(f64_at), [-0.5, 0.0, 1.5]);
        assert_eq!(
            bytes[184..200],
            [2, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]
        );
        assert_eq!(u64_at(200), 9);
        assert_eq!(bytes[208..216], [1, 0, 0, 0, 0, 255, 0, 0]);
        // The contact: number, taxels, centre, force z, peak and its taxel.
        assert_eq!([216, 224, 232, 240].map(f64_at), [1.0, 1.0, -0.5, 0.0]);
        assert_eq!([304, 344, 352].map(f64_at), [1.5, 1.5, 0.0]);
        assert!(f64_at(360).is_nan());
        assert_eq!(f64_at(368), 0.0);
        let arrays = HEADER + CONTACT;
        assert_eq!(arrays, 376);
        // Readings, values, deviations and residuals of two cells.
        assert_eq!(bytes[arrays..arrays + 4], 1.5_f32.to_le_bytes());
        assert_eq!(bytes[arrays + 8..arrays + 12], 1.5_f32.to_le_bytes());
        let states = arrays + 4 * 2 * 4;
        assert_eq!(
            bytes[states..],
            [
                ChannelState::Ok as u8,
                ChannelState::Masked as u8,
                State::Ok as u8,
                State::Masked as u8,
                1,
                0
            ]
        );
    }

    /// The same with three components and four channels a taxel.
    #[test]
    fn three_components_stand_side_by_side() {
        let sensor = taxel::sensor::Sensor::shipped("three-axis-unit").unwrap();
        let array = sensor.three_axis().unwrap();
        let rest = array.calibration().rest();
        let stream = Stream {
            rows: 1,
            columns: 1,
            channels_per_taxel: 4,
            unit: SignalUnit {
                quantity: Quantity::Capacitance,
                symbol: "fF".into(),
                si_per_unit: 1e-15,
            },
            present: vec![true; 4],
            ..stream()
        };
        let mut session = sensor.device().unwrap().session(&stream).unwrap();
        let mut values = rest.clone();
        values[0] = f64::NAN;
        let frame_of = Frame {
            sequence: 1,
            time_ns: 2,
            values,
            ..Frame::default()
        };
        let continuity = continuity();
        let touch = session.push(&frame_of).unwrap().touch.clone();
        let bytes = frame(&touch, 3, &health(&continuity));
        assert_eq!(bytes[4], 3);
        assert_eq!(bytes.len(), HEADER + 5 * 4 + 8 * 3 + 6);
        let f32_at = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert!(f32_at(216).is_nan());
        assert_eq!(f32_at(220), rest[1] as f32);
        let value = touch.taxels[0].value.map(|value| value as f32);
        assert_eq!([232, 236, 240].map(f32_at), value);
        let deviation = touch.taxels[0].deviation().map(|value| value as f32);
        assert_eq!([244, 248, 252].map(f32_at), deviation);
        let faulty = [ChannelState::Faulty as u8, 0, 0, 0];
        assert_eq!(bytes[260..264], faulty);
        assert_eq!(bytes[264..], [State::Faulty as u8, 1]);
    }
}
