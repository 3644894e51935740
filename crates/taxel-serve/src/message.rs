//! Messages to clients; `docs/live-protocol.md` is their table.

use bytes::{BufMut, Bytes, BytesMut};
use serde::Serialize;
use taxel::acquisition::{Quantity, Stream};
use taxel::calibration::Calibration;
use taxel::estimation::{
    Contact, Continuity, MapTouch, Observer, Picture, Scale, SignalMeaning, SignalTouch, State,
    TaxelTouch, Touch, Track,
};
use taxel::layout::Mount;

use crate::sense::{Felt, Sense, Sensed};

const MAGIC: u32 = 0x314C_5854;
/// Version of the protocol.
const PROTOCOL: u32 = 2;

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
}

/// Encodes one frame.
pub(crate) fn frame(sensed: &Sensed<'_>, health: &Health<'_>) -> Bytes {
    let mut out = match sensed.felt {
        Felt::ThreeAxis(touch) => three_axis(touch, health),
        Felt::Signals(touch) => signals(touch, health),
        Felt::Map(touch) => map(touch, health),
    };
    let contacts = sensed.felt.contacts().0.len().min(MOST_CONTACTS);
    identities(&mut out, contacts, sensed.observer);
    out.freeze()
}

/// Number and velocity of the track of each contact, behind all that version 1
/// of the protocol has.
fn identities(out: &mut BytesMut, contacts: usize, observer: &Observer) {
    for contact in 0..contacts {
        let track = observer.track_of(contact);
        let id = track.map_or(0, |track| track.id);
        let [x, y] = track.map_or([f64::NAN; 2], Track::velocity);
        for number in [id as f64, x, y] {
            out.put_f64_le(number);
        }
    }
}

/// More contacts than fit a u16 cannot be drawn anyway.
const MOST_CONTACTS: usize = u16::MAX as usize;
/// Bytes of a contact, and of its track.
const CONTACT: usize = 88 + 24;

/// What the header of a frame holds beside its health.
struct Header<'a> {
    kind: u16,
    sequence: u64,
    time_ns: u64,
    force: [f64; 3],
    deviation: [f64; 3],
    moment: [f64; 3],
    centre: ([f64; 2], [f64; 3]),
    taxels: usize,
    clipped: bool,
    history_uncertain: bool,
    contacts: &'a [Contact],
}

const NO_CENTRE: ([f64; 2], [f64; 3]) = ([f64::NAN; 2], [f64::NAN; 3]);

fn header(out: &mut BytesMut, header: &Header<'_>, health: &Health<'_>) {
    let contacts = &header.contacts[..header.contacts.len().min(MOST_CONTACTS)];
    out.put_u32_le(MAGIC);
    out.put_u16_le(header.kind);
    out.put_u16_le(contacts.len() as u16);
    out.put_u64_le(header.sequence);
    out.put_u64_le(header.time_ns);
    out.put_u64_le(health.continuity.lost);
    out.put_u64_le(health.continuity.late);
    out.put_u64_le(health.continuity.duplicate + health.continuity.repeated);
    let (centre, covariance) = header.centre;
    let numbers = [health.rate, health.latency]
        .into_iter()
        .chain(header.force)
        .chain(header.deviation)
        .chain(header.moment)
        .chain(centre)
        .chain(covariance);
    numbers.for_each(|number| out.put_f64_le(number));
    out.put_u32_le(header.taxels as u32);
    let flags = [
        health.tared,
        health.capturing,
        header.clipped,
        header.history_uncertain,
    ];
    out.put_u32_le(
        flags
            .iter()
            .enumerate()
            .map(|(bit, flag)| u32::from(*flag) << bit)
            .sum(),
    );
    for contact in contacts {
        let numbers = [contact.taxels as f64]
            .into_iter()
            .chain(contact.centre)
            .chain(contact.covariance)
            .chain(contact.force)
            .chain([contact.peak, contact.peak_taxel as f64]);
        numbers.for_each(|number| out.put_f64_le(number));
    }
}

fn three_axis(touch: &Touch, health: &Health<'_>) -> BytesMut {
    let taxels = &touch.taxels;
    let mut out = BytesMut::with_capacity(184 + CONTACT * touch.contacts.len() + 47 * taxels.len());
    let fields = Header {
        kind: 1,
        sequence: touch.sequence,
        time_ns: touch.time_ns,
        force: touch.total.force,
        deviation: std::array::from_fn(|axis| touch.total_covariance[axis][axis].sqrt()),
        moment: touch.total.moment,
        centre: touch.centre_of_pressure.unwrap_or(NO_CENTRE),
        taxels: taxels.len(),
        clipped: touch.clipped > 0,
        history_uncertain: touch.history_uncertain,
        contacts: &touch.contacts,
    };
    header(&mut out, &fields, health);
    for value in taxels.iter().flat_map(|taxel| taxel.capacitance) {
        out.put_f32_le(value as f32);
    }
    let mut triples = |values: &dyn Fn(&TaxelTouch) -> [f64; 3]| {
        taxels
            .iter()
            .flat_map(values)
            .for_each(|value| out.put_f32_le(value as f32));
    };
    triples(&|taxel| taxel.force);
    triples(&TaxelTouch::deviation);
    for taxel in taxels {
        out.put_f32_le(taxel.residual as f32);
    }
    let bits = |set: [bool; 4]| (0..4).map(|i| u8::from(set[i]) << i).sum::<u8>();
    out.extend(taxels.iter().map(|taxel| taxel.state as u8));
    out.extend(taxels.iter().map(|taxel| bits(taxel.touching)));
    out.extend(taxels.iter().map(|taxel| bits(taxel.unusable)));
    out
}

fn signals(touch: &SignalTouch, health: &Health<'_>) -> BytesMut {
    let (taxels, channels) = (&touch.taxels, touch.signals.len());
    let size = 184 + CONTACT * touch.contacts.len() + 4 + 8 * channels + 9 * taxels.len();
    let mut out = BytesMut::with_capacity(size);
    let unknown = f64::NAN;
    let [force, deviation] = touch.force.unwrap_or([unknown; 2]);
    let fields = Header {
        kind: 3,
        sequence: touch.sequence,
        time_ns: touch.time_ns,
        force: [unknown, unknown, force],
        deviation: [unknown, unknown, deviation],
        moment: [unknown; 3],
        centre: touch.centre_of_pressure.unwrap_or(NO_CENTRE),
        taxels: taxels.len(),
        clipped: touch.clipped > 0,
        history_uncertain: false,
        contacts: &touch.contacts,
    };
    header(&mut out, &fields, health);
    out.put_u32_le(channels as u32);
    let numbers = touch.signals.iter().chain(&touch.rest);
    numbers.for_each(|signal| out.put_f32_le(*signal as f32));
    let values = taxels.iter().map(|taxel| taxel.value);
    let numbers = values.chain(taxels.iter().map(|taxel| taxel.deviation));
    numbers.for_each(|value| out.put_f32_le(value as f32));
    out.extend(taxels.iter().map(|taxel| taxel.state as u8));
    out
}

fn map(touch: &MapTouch, health: &Health<'_>) -> BytesMut {
    let mut out =
        BytesMut::with_capacity(184 + CONTACT * touch.contacts.len() + 5 * touch.values.len());
    let unknown = f64::NAN;
    let fields = Header {
        kind: 2,
        sequence: touch.sequence,
        time_ns: touch.time_ns,
        force: [unknown, unknown, touch.force.unwrap_or(touch.sum)],
        deviation: [unknown; 3],
        moment: [unknown; 3],
        centre: (touch.centre_of_pressure.unwrap_or(NO_CENTRE.0), NO_CENTRE.1),
        taxels: touch.values.len(),
        clipped: false,
        history_uncertain: false,
        contacts: &touch.contacts,
    };
    header(&mut out, &fields, health);
    touch
        .values
        .iter()
        .for_each(|value| out.put_f32_le(*value as f32));
    touch
        .states
        .iter()
        .for_each(|state| out.put_u8(*state as u8));
    out
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
struct UnitMessage<'a> {
    quantity: &'a str,
    symbol: &'a str,
    si_per_unit: f64,
}

#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum MountMessage {
    Flat,
    Cylinder { radius_m: f64 },
}

#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "hello")]
struct Hello<'a> {
    protocol: u32,
    kind: &'a str,
    name: &'a str,
    source: &'a str,
    version: &'a str,
    commit: &'a str,
    sensor_hash: &'a str,
    rows: usize,
    columns: usize,
    pitch_m: Option<[f64; 2]>,
    mount: MountMessage,
    unit: UnitMessage<'a>,
    signals: Option<SignalsMessage<'a>>,
    full_scale_n: Option<f64>,
    usable_force_n: Option<f64>,
    period_s: Option<f64>,
    stale_after_s: f64,
    states: [&'a str; State::ALL.len()],
    total_force_known: bool,
}

/// What the numbers of a device of one value per taxel are.
#[derive(Debug, Serialize)]
struct SignalsMessage<'a> {
    channels: &'a [String],
    signal: UnitMessage<'a>,
    value: UnitMessage<'a>,
    full_scale: f64,
    signed: bool,
    grayscale: bool,
}

impl<'a> SignalsMessage<'a> {
    fn new(meaning: &'a SignalMeaning) -> Self {
        let unit = |scale: &Scale| UnitMessage {
            quantity: scale.quantity,
            symbol: scale.symbol,
            si_per_unit: scale.si_per_unit,
        };
        Self {
            channels: &meaning.channels,
            signal: unit(&meaning.signal),
            value: unit(&meaning.value),
            full_scale: meaning.full_scale,
            signed: meaning.signed,
            grayscale: meaning.picture == Picture::Grayscale,
        }
    }
}

/// The first message to each client.
pub(crate) fn hello(
    stream: &Stream,
    sense: &Sense,
    provenance: &Provenance,
    stale_after: f64,
) -> String {
    let (calibration, meaning) = (sense.calibration(), sense.meaning());
    let pressure = stream.unit.quantity == Quantity::Pressure;
    let unit = if calibration.is_some() {
        UnitMessage {
            quantity: "capacitance",
            symbol: "fF",
            si_per_unit: 1e-15,
        }
    } else {
        let quantity = if pressure { "pressure" } else { "raw" };
        UnitMessage {
            quantity,
            symbol: &stream.unit.symbol,
            si_per_unit: stream.unit.si_per_unit,
        }
    };
    let mount = match calibration.map(|calibration| calibration.layout.mount) {
        Some(Mount::Cylinder(cylinder)) => MountMessage::Cylinder {
            radius_m: cylinder.radius,
        },
        _ => MountMessage::Flat,
    };
    let hello = Hello {
        protocol: PROTOCOL,
        kind: sense.kind(),
        name: &provenance.device,
        source: &provenance.source,
        version: &provenance.version,
        commit: &provenance.commit,
        sensor_hash: &provenance.sensor_hash,
        rows: meaning.map_or(stream.rows, |meaning| meaning.rows),
        columns: meaning.map_or(stream.columns, |meaning| meaning.columns),
        pitch_m: match (calibration, meaning) {
            (Some(calibration), _) => {
                let [x, y] = calibration.layout.pitch;
                Some([y, x])
            }
            (None, Some(meaning)) => Some(meaning.pitch),
            (None, None) => stream.pitch,
        },
        mount,
        unit,
        signals: meaning.map(SignalsMessage::new),
        full_scale_n: calibration.map(|calibration| calibration.full_scale),
        usable_force_n: calibration.map(|calibration| calibration.usable_force),
        period_s: stream.period,
        stale_after_s: stale_after,
        states: State::ALL.map(State::name),
        total_force_known: calibration.is_some()
            || meaning.is_some()
            || (pressure && stream.pitch.is_some()),
    };
    serde_json::to_string(&hello).unwrap_or_default()
}

/// The rest capacitances in force.
pub(crate) fn rest(calibration: &Calibration) -> String {
    serde_json::json!({ "type": "rest", "capacitance_f": calibration.rest() }).to_string()
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use taxel::acquisition::{Frame, SignalUnit};
    use taxel::estimation::{ObserverOptions, Seen};

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

    /// Every offset of the table in `docs/live-protocol.md` (kind 2).
    #[test]
    fn frame_layout_is_the_documented_one() {
        let touch = MapTouch {
            sequence: 7,
            time_ns: 8,
            values: vec![1.5, f64::NAN],
            states: vec![State::Ok, State::Masked],
            sum: 1.5,
            force: None,
            centre_of_pressure: Some([0.25, -0.5]),
            contacts: vec![Contact {
                taxels: 1,
                centre: [0.25, -0.5],
                covariance: [f64::NAN; 3],
                area: 1.0,
                force: [0.0, 0.0, 1.5],
                force_covariance: [[f64::NAN; 3]; 3],
                torsion: 0.0,
                peak: 1.5,
                peak_taxel: 0,
                bound: None,
            }],
            regions: vec![Some(0), None],
        };
        let mut continuity = Continuity::default();
        (continuity.lost, continuity.late) = (1, 2);
        (continuity.duplicate, continuity.repeated) = (1, 2);
        let health = Health {
            continuity: &continuity,
            rate: 60.0,
            latency: 1e-3,
            tared: true,
            capturing: false,
        };
        let mut observer = Observer::new(ObserverOptions::new(&stream()));
        let frame_of = Frame {
            sequence: 7,
            time_ns: 8,
            values: touch.values.clone(),
        };
        let seen = Seen {
            contacts: &touch.contacts,
            regions: &touch.regions,
            taxel: &|_| (State::Ok, f64::NAN),
        };
        observer.push(&frame_of, &seen);
        let sensed = Sensed {
            felt: Felt::Map(&touch),
            observer: &observer,
            captured: None,
        };
        let bytes = frame(&sensed, &health);
        let u64_at = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let f64_at = |at: usize| f64::from_bits(u64_at(at));
        assert_eq!(&bytes[..8], b"TXL1\x02\x00\x01\x00");
        assert_eq!([8, 16, 24, 32, 40].map(u64_at), [7, 8, 1, 2, 3]);
        assert_eq!(
            [48, 56, 80, 136, 144].map(f64_at),
            [60.0, 1e-3, 1.5, 0.25, -0.5]
        );
        assert!(f64_at(152).is_nan());
        assert_eq!(bytes[176..184], [2, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!([184, 192, 256, 264].map(f64_at), [1.0, 0.25, 1.5, 0.0]);
        assert_eq!(bytes[272..276], 1.5_f32.to_le_bytes());
        assert_eq!(bytes[280..282], [State::Ok as u8, State::Masked as u8]);
        assert_eq!([282, 290, 298].map(f64_at), [1.0, 0.0, 0.0]);
        assert_eq!(bytes.len(), 306);
    }
}
