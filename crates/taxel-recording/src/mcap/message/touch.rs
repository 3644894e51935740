//! What was estimated: touch, contacts and events.

use super::{Decoder, Encoder, Message, Topic};

/// Touch on the whole array in one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TouchMessage {
    /// Sequence number of the frame.
    pub sequence: u64,
    /// Device time of the frame, ns.
    pub device_time_ns: u64,
    /// Components of a value: 3, or 1 for z alone.
    pub components: u8,
    /// Value of each taxel, row by row, component by component, SI.
    pub values: Vec<f32>,
    /// Their standard deviations, SI; `NaN` where not known.
    pub deviations: Vec<f32>,
    /// Consistency residual of each taxel in standard deviations; `NaN` for none.
    pub residuals: Vec<f32>,
    /// Code of the state of each taxel.
    pub states: Vec<u8>,
    /// 1 for each taxel that is part of totals and contacts.
    pub counted: Vec<u8>,
    /// Code of the state of each channel.
    pub channel_states: Vec<u8>,
    /// Total force, N; `NaN` where not known.
    pub force: [f64; 3],
    /// Its standard deviation, N.
    pub force_deviation: [f64; 3],
    /// Total moment, N m.
    pub moment: [f64; 3],
    /// Sum of the counted values along z, SI.
    pub sum: f64,
    /// Centre of pressure, m, or cells where the pitch is not known; `NaN` without contact.
    pub centre_of_pressure: [f64; 2],
    /// Its covariance xx, xy, yy.
    pub centre_covariance: [f64; 3],
    /// Taxels that are not counted.
    pub left_out: u32,
    /// Channels at an end of their range.
    pub clipped: u32,
    /// Contacts that are part of others.
    pub merged: u32,
    /// True after a pause of a device that relaxes.
    pub history_uncertain: bool,
    /// Contacts, the strongest first.
    pub contacts: Vec<ContactMessage>,
    /// How much the numbers say; none in a recording of a version that did not say it.
    pub certainty: Option<CertaintyMessage>,
}

/// How much the total and the forces of the contacts say: 0 exact, 1 at least, 2 unknown.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CertaintyMessage {
    /// False while the values are no forces yet.
    pub zero_known: bool,
    /// How much the total says.
    pub total: u8,
    /// Code of the state of a taxel that is the reason, if one is.
    pub reason: Option<u8>,
    /// How much the force of each contact says.
    pub contacts: Vec<u8>,
}

/// One contact of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContactMessage {
    /// Number of the contact, which stays with it.
    pub id: u64,
    /// Number of its taxels.
    pub taxels: u32,
    /// Area, m².
    pub area: f64,
    /// Centre on the developed surface, m, or cells where the pitch is not known.
    pub centre: [f64; 2],
    /// Its covariance xx, xy, yy.
    pub covariance: [f64; 3],
    /// Force, N.
    pub force: [f64; 3],
    /// Its standard deviation, N.
    pub force_deviation: [f64; 3],
    /// Moment about the normal, N m.
    pub torsion: f64,
    /// Largest value, N.
    pub peak: f64,
    /// The taxel that has it.
    pub peak_taxel: u32,
    /// Code of the state that makes the force a lower bound, if one does.
    pub bound: Option<u8>,
    /// Velocity, m/s.
    pub velocity: [f64; 2],
}

/// Fewest bytes of a contact.
const LEAST_CONTACT: usize = 8 * 18;
/// Code of no state.
const NO_STATE: u8 = u8::MAX;

impl ContactMessage {
    fn encode(&self, fields: &mut Encoder<'_>) {
        fields.u64(self.id);
        fields.u32(self.taxels);
        fields.f64(self.area);
        fields.f64s(self.centre);
        fields.f64s(self.covariance);
        fields.f64s(self.force);
        fields.f64s(self.force_deviation);
        fields.f64(self.torsion);
        fields.f64(self.peak);
        fields.u32(self.peak_taxel);
        fields.u8(self.bound.unwrap_or(NO_STATE));
        fields.f64s(self.velocity);
    }

    fn decode(fields: &mut Decoder<'_>) -> Option<Self> {
        Some(Self {
            id: fields.u64()?,
            taxels: fields.u32()?,
            area: fields.f64()?,
            centre: fields.f64s()?,
            covariance: fields.f64s()?,
            force: fields.f64s()?,
            force_deviation: fields.f64s()?,
            torsion: fields.f64()?,
            peak: fields.f64()?,
            peak_taxel: fields.u32()?,
            bound: Some(fields.u8()?).filter(|code| *code != NO_STATE),
            velocity: fields.f64s()?,
        })
    }
}

impl Message for TouchMessage {
    const TOPIC: Topic = Topic::Touch;

    fn device_time_ns(&self) -> Option<u64> {
        Some(self.device_time_ns)
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let mut fields = Encoder::new(out);
        fields.u64(self.sequence);
        fields.u64(self.device_time_ns);
        fields.u8(self.components);
        fields.floats(&self.values);
        fields.floats(&self.deviations);
        fields.floats(&self.residuals);
        fields.bytes(&self.states);
        fields.bytes(&self.counted);
        fields.bytes(&self.channel_states);
        fields.f64s(self.force);
        fields.f64s(self.force_deviation);
        fields.f64s(self.moment);
        fields.f64(self.sum);
        fields.f64s(self.centre_of_pressure);
        fields.f64s(self.centre_covariance);
        fields.u32(self.left_out);
        fields.u32(self.clipped);
        fields.u32(self.merged);
        fields.bool(self.history_uncertain);
        fields.count(self.contacts.len());
        for contact in &self.contacts {
            contact.encode(&mut fields);
        }
        if let Some(certainty) = &self.certainty {
            fields.bool(certainty.zero_known);
            fields.u8(certainty.total);
            fields.u8(certainty.reason.unwrap_or(NO_STATE));
            fields.bytes(&certainty.contacts);
        }
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut fields = Decoder::new(bytes)?;
        let mut touch = Self {
            sequence: fields.u64()?,
            device_time_ns: fields.u64()?,
            components: fields.u8()?,
            values: fields.floats()?,
            deviations: fields.floats()?,
            residuals: fields.floats()?,
            states: fields.bytes()?,
            counted: fields.bytes()?,
            channel_states: fields.bytes()?,
            force: fields.f64s()?,
            force_deviation: fields.f64s()?,
            moment: fields.f64s()?,
            sum: fields.f64()?,
            centre_of_pressure: fields.f64s()?,
            centre_covariance: fields.f64s()?,
            left_out: fields.u32()?,
            clipped: fields.u32()?,
            merged: fields.u32()?,
            history_uncertain: fields.bool()?,
            contacts: Vec::new(),
            certainty: None,
        };
        let contacts = fields.count(LEAST_CONTACT)?;
        for _ in 0..contacts {
            touch.contacts.push(ContactMessage::decode(&mut fields)?);
        }
        if !fields.is_at_end() {
            touch.certainty = Some(CertaintyMessage {
                zero_known: fields.bool()?,
                total: fields.u8()?,
                reason: Some(fields.u8()?).filter(|code| *code != NO_STATE),
                contacts: fields.bytes()?,
            });
        }
        Some(touch)
    }
}

/// Something began, changed or ended.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventMessage {
    /// Its number in this run, from 0.
    pub index: u64,
    /// Device time, ns.
    pub device_time_ns: u64,
    /// Number of the contact; 0 for none.
    pub contact: u64,
    /// Name of what happened.
    pub kind: String,
    /// Its value in `unit`; `NaN` where it is not known.
    pub value: f64,
    /// Standard deviation of the value; `NaN` where it is not known.
    pub deviation: f64,
    /// Unit of the value.
    pub unit: String,
    /// Contact that a split one came off.
    pub parent: Option<u64>,
    /// Contact that a merged one went into.
    pub into: Option<u64>,
    /// Rise time of an impact from 10 to 90 %, s.
    pub rise_time: Option<f64>,
    /// Smaller over larger amplitude of a cyclic load.
    pub symmetry: Option<f64>,
    /// Unit vector of a slip.
    pub direction: Option<[f64; 2]>,
    /// Correlation of a slip along rows.
    pub score: Option<f64>,
    /// How much the value says, by name; none without a value, and in a recording of a version
    /// that did not say it.
    pub certainty: Option<String>,
}

impl Message for EventMessage {
    const TOPIC: Topic = Topic::Events;

    fn device_time_ns(&self) -> Option<u64> {
        Some(self.device_time_ns)
    }

    fn encode(&self, out: &mut Vec<u8>) {
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let mut fields = Encoder::new(out);
        fields.u64(self.index);
        fields.u64(self.device_time_ns);
        fields.u64(self.contact);
        fields.string(&self.kind);
        fields.f64(self.value);
        fields.f64(self.deviation);
        fields.string(&self.unit);
        fields.u64(self.parent.unwrap_or(0));
        fields.u64(self.into.unwrap_or(0));
        fields.f64(number(self.rise_time));
        fields.f64(number(self.symmetry));
        fields.f64s(self.direction.unwrap_or([f64::NAN; 2]));
        fields.f64(number(self.score));
        fields.string(self.certainty.as_deref().unwrap_or_default());
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let known = |value: f64| (!value.is_nan()).then_some(value);
        let contact = |id: u64| (id != 0).then_some(id);
        let mut fields = Decoder::new(bytes)?;
        Some(Self {
            index: fields.u64()?,
            device_time_ns: fields.u64()?,
            contact: fields.u64()?,
            kind: fields.string()?,
            value: fields.f64()?,
            deviation: fields.f64()?,
            unit: fields.string()?,
            parent: contact(fields.u64()?),
            into: contact(fields.u64()?),
            rise_time: known(fields.f64()?),
            symmetry: known(fields.f64()?),
            direction: Some(fields.f64s()?).filter(|direction: &[f64; 2]| !direction[0].is_nan()),
            score: known(fields.f64()?),
            certainty: if fields.is_at_end() {
                None
            } else {
                Some(fields.string()?).filter(|name| !name.is_empty())
            },
        })
    }
}
