//! Arrays for NumPy: SI, with the unit in the name.

use std::fmt::Write as _;
use std::io::{Error, ErrorKind, Read, Result, Write};

use super::ExportMeaning;
use super::zip::{LARGEST, Zip};
use crate::mcap::{
    EventMessage, FrameMessage, MarkMessage, McapReader, Message, NO_TIME, RestMessage, Topic,
    TouchMessage,
};

/// Numbers of one array as they come.
#[derive(Debug)]
struct Array {
    name: String,
    /// NumPy's name of the type.
    kind: &'static str,
    /// Length of a row; `None` until the first one comes.
    width: Option<usize>,
    /// True for one number a row.
    flat: bool,
    rows: usize,
    bytes: Vec<u8>,
}

/// A text of each row.
#[derive(Debug, Default)]
struct Texts(Vec<String>);

impl Array {
    fn new(name: &str, kind: &'static str) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            width: None,
            flat: false,
            rows: 0,
            bytes: Vec::new(),
        }
    }

    /// One number a row.
    fn flat(name: &str, kind: &'static str) -> Self {
        Self {
            flat: true,
            ..Self::new(name, kind)
        }
    }

    /// Appends a row; one of another width than the first is filled or cut.
    fn row<const N: usize>(
        &mut self,
        values: impl ExactSizeIterator<Item = [u8; N]>,
        empty: [u8; N],
    ) {
        let width = *self.width.get_or_insert(values.len());
        let missing = width.saturating_sub(values.len());
        for value in values.take(width) {
            self.bytes.extend_from_slice(&value);
        }
        for _ in 0..missing {
            self.bytes.extend_from_slice(&empty);
        }
        self.rows += 1;
    }

    fn f64s(&mut self, values: &[f64]) {
        let values = values.iter().map(|value| value.to_le_bytes());
        self.row(values, f64::NAN.to_le_bytes());
    }

    fn f32s(&mut self, values: &[f32]) {
        let values = values.iter().map(|value| value.to_le_bytes());
        self.row(values, f32::NAN.to_le_bytes());
    }

    fn u8s(&mut self, values: &[u8]) {
        self.row(values.iter().map(|value| [*value]), [u8::MAX]);
    }

    fn u64(&mut self, value: u64) {
        self.row([value.to_le_bytes()].into_iter(), [0; 8]);
    }

    fn put<W: Write>(&self, zip: &mut Zip<W>) -> Result<()> {
        let shape = if self.flat {
            format!("({},)", self.rows)
        } else {
            format!("({}, {})", self.rows, self.width.unwrap_or(0))
        };
        zip.member(
            &format!("{}.npy", self.name),
            &npy(self.kind, &shape, &self.bytes),
        )
    }
}

impl Texts {
    fn put<W: Write>(&self, name: &str, zip: &mut Zip<W>) -> Result<()> {
        let longest = self.0.iter().map(|text| text.chars().count()).max();
        let longest = longest.unwrap_or(0).max(1);
        let mut bytes = Vec::with_capacity(4 * longest * self.0.len());
        for text in &self.0 {
            let letters = text.chars().map(u32::from);
            for letter in letters.chain(std::iter::repeat(0)).take(longest) {
                bytes.extend_from_slice(&letter.to_le_bytes());
            }
        }
        let shape = format!("({},)", self.0.len());
        zip.member(
            &format!("{name}.npy"),
            &npy(&format!("<U{longest}"), &shape, &bytes),
        )
    }
}

/// A file of one array.
fn npy(kind: &str, shape: &str, bytes: &[u8]) -> Vec<u8> {
    let mut head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    // The head ends at a multiple of 64.
    let filled = (10 + head.len() + 1).next_multiple_of(64) - 11;
    let _ = writeln!(head, "{:1$}", "", filled - head.len());
    let length = (head.len() as u16).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], head.as_bytes(), bytes].concat()
}

/// The arrays of each kind of message.
#[derive(Debug)]
struct Arrays {
    raw: [Array; 5],
    touch: [Array; 9],
    contact: [Array; 6],
    event: [Array; 4],
    mark: [Array; 2],
    rest: [Array; 2],
    event_kinds: Texts,
    event_units: Texts,
    marks: Texts,
    rest_kinds: Texts,
}

impl Arrays {
    fn new(meaning: &ExportMeaning) -> Self {
        let value = unit_suffix(&meaning.value.1, &meaning.value.0);
        let reading = match meaning.reading.quantity.name() {
            "capacitance" => "f",
            "pressure" => "pa",
            "force" => "n",
            "voltage" => "v",
            "resistance" => "ohm",
            "charge" => "c",
            "flux_density" => "t",
            other => other,
        };
        let force = unit_suffix(&meaning.force, "");
        let length = if meaning.length == "m" { "m" } else { "cells" };
        let (whole, double) = ("<u8", "<f8");
        Self {
            raw: [
                Array::flat("raw_sequence", whole),
                Array::flat("raw_time_ns", whole),
                Array::flat("raw_utc_ns", whole),
                Array::flat("raw_arrival_ns", whole),
                Array::new(&format!("raw_readings_{reading}"), double),
            ],
            touch: [
                Array::flat("touch_sequence", whole),
                Array::flat("touch_time_ns", whole),
                Array::new(&format!("touch_values_{value}"), "<f4"),
                Array::new(&format!("touch_deviations_{value}"), "<f4"),
                Array::new("touch_states", "|u1"),
                Array::new("touch_force_n", double),
                Array::new("touch_force_deviation_n", double),
                Array::new("touch_moment_n_m", double),
                Array::new(&format!("touch_centre_of_pressure_{length}"), double),
            ],
            contact: [
                Array::flat("contact_sequence", whole),
                Array::flat("contact_time_ns", whole),
                Array::flat("contact_id", whole),
                Array::new(&format!("contact_centre_{length}"), double),
                Array::new(&format!("contact_force_{force}"), double),
                Array::new(&format!("contact_force_deviation_{force}"), double),
            ],
            event: [
                Array::flat("event_time_ns", whole),
                Array::flat("event_contact", whole),
                Array::flat("event_value", double),
                Array::flat("event_deviation", double),
            ],
            mark: [
                Array::flat("mark_time_ns", whole),
                Array::flat("mark_utc_ns", whole),
            ],
            rest: [
                Array::flat("rest_time_ns", whole),
                Array::new(&format!("rest_readings_{reading}"), double),
            ],
            event_kinds: Texts::default(),
            event_units: Texts::default(),
            marks: Texts::default(),
            rest_kinds: Texts::default(),
        }
    }

    fn push(&mut self, topic: Topic, bytes: &[u8]) {
        match topic {
            Topic::Raw => {
                if let Some(message) = FrameMessage::decode(bytes) {
                    self.frame(&message);
                }
            }
            Topic::Touch => {
                if let Some(touch) = TouchMessage::decode(bytes) {
                    self.touch(&touch);
                }
            }
            Topic::Events => {
                if let Some(event) = EventMessage::decode(bytes) {
                    let [time, contact, value, deviation] = &mut self.event;
                    time.u64(event.device_time_ns);
                    contact.u64(event.contact);
                    value.f64s(&[event.value]);
                    deviation.f64s(&[event.deviation]);
                    self.event_kinds.0.push(event.kind);
                    self.event_units.0.push(event.unit);
                }
            }
            Topic::Marks => {
                if let Some(mark) = MarkMessage::decode(bytes) {
                    let [time, utc] = &mut self.mark;
                    time.u64(mark.device_time_ns.unwrap_or(NO_TIME));
                    utc.u64(mark.utc_ns);
                    self.marks.0.push(mark.text);
                }
            }
            Topic::Rest => {
                if let Some(rest) = RestMessage::decode(bytes) {
                    let [time, readings] = &mut self.rest;
                    time.u64(rest.device_time_ns.unwrap_or(NO_TIME));
                    readings.f64s(&rest.values);
                    self.rest_kinds.0.push(rest.kind.name().into());
                }
            }
            Topic::Wire | Topic::Link | Topic::Clock | Topic::Health => {}
        }
    }

    fn frame(&mut self, FrameMessage { utc_ns, frame }: &FrameMessage) {
        let [sequence, time, utc, arrival, readings] = &mut self.raw;
        sequence.u64(frame.sequence);
        time.u64(frame.time_ns);
        utc.u64(*utc_ns);
        arrival.u64(frame.host_ns.unwrap_or(NO_TIME));
        readings.f64s(&frame.values);
    }

    fn touch(&mut self, touch: &TouchMessage) {
        let [
            sequence,
            time,
            values,
            deviations,
            states,
            force,
            force_deviation,
            moment,
            centre,
        ] = &mut self.touch;
        sequence.u64(touch.sequence);
        time.u64(touch.device_time_ns);
        values.f32s(&touch.values);
        deviations.f32s(&touch.deviations);
        states.u8s(&touch.states);
        force.f64s(&touch.force);
        force_deviation.f64s(&touch.force_deviation);
        moment.f64s(&touch.moment);
        centre.f64s(&touch.centre_of_pressure);
        let [sequence, time, id, centre, force, deviation] = &mut self.contact;
        for contact in &touch.contacts {
            sequence.u64(touch.sequence);
            time.u64(touch.device_time_ns);
            id.u64(contact.id);
            centre.f64s(&contact.centre);
            force.f64s(&contact.force);
            deviation.f64s(&contact.force_deviation);
        }
    }

    fn put(&self, meaning: &ExportMeaning, out: impl Write) -> Result<()> {
        let mut zip = Zip::new(out);
        let numbers = self.raw.iter().chain(&self.touch).chain(&self.contact);
        for array in numbers
            .chain(&self.event)
            .chain(&self.mark)
            .chain(&self.rest)
        {
            array.put(&mut zip)?;
        }
        self.event_kinds.put("event_kind", &mut zip)?;
        self.event_units.put("event_unit", &mut zip)?;
        self.marks.put("mark_text", &mut zip)?;
        self.rest_kinds.put("rest_kind", &mut zip)?;
        Texts(meaning.channels.clone()).put("channel_names", &mut zip)?;
        Texts(meaning.states.clone()).put("state_names", &mut zip)?;
        zip.finish()
    }
}

/// Writes arrays in SI into one archive (`numpy.load`). The number of frames.
///
/// # Errors
/// Those of the reader and of `out`; [`ErrorKind::InvalidInput`] for a recording that is too
/// large for one archive.
pub fn write_npz<R: Read>(
    mut reader: McapReader<R>,
    meaning: &ExportMeaning,
    out: impl Write,
) -> Result<u64> {
    let mut arrays = Arrays::new(meaning);
    let mut size = 0;
    while let Some(entry) = reader.next()? {
        size += entry.bytes.len() as u64;
        if entry.topic != Topic::Wire && size > LARGEST {
            return Err(Error::new(
                ErrorKind::InvalidInput,
                "the recording is too large for one archive (4 GiB): cut it, or export a folder",
            ));
        }
        arrays.push(entry.topic, entry.bytes);
    }
    arrays.put(meaning, out)?;
    Ok(arrays.raw[0].rows as u64)
}

/// SI unit as it ends the name of an array.
fn unit_suffix(symbol: &str, quantity: &str) -> String {
    match (symbol, quantity) {
        ("N" | "mN" | "uN" | "kN", _) | (_, "force") => "n",
        ("Pa" | "kPa" | "MPa" | "mmHg" | "psi", _) | (_, "pressure") => "pa",
        _ => "si",
    }
    .to_owned()
}
