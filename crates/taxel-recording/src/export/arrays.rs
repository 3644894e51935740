//! Arrays for NumPy: SI, with the unit in the name.

use std::fmt::Write as _;
use std::io::{Error, ErrorKind, Read, Result, Write};

use super::ExportMeaning;
use super::zip::{LARGEST, Zip};
use crate::mcap::{
    Channel, EventMessage, FrameMessage, MarkMessage, Message, NO_TIME, Reader, RestMessage,
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
        self.flat = true;
        self.row([value.to_le_bytes()].into_iter(), [0; 8]);
    }

    fn f64(&mut self, value: f64) {
        self.flat = true;
        self.f64s(&[value]);
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

/// Writes arrays in SI into one archive (`numpy.load`). The number of frames.
///
/// # Errors
/// Those of the reader and of `out`; [`ErrorKind::InvalidInput`] for a recording that is too
/// large for one archive.
pub fn write_npz<R: Read>(
    mut reader: Reader<R>,
    meaning: &ExportMeaning,
    out: impl Write,
) -> Result<u64> {
    let value = unit_suffix(&meaning.value.1, &meaning.value.0);
    let reading = match meaning.reading.quantity.name() {
        "capacitance" => "f",
        "pressure" => "pa",
        "force" => "n",
        "voltage" => "v",
        "resistance" => "ohm",
        "charge" => "c",
        other => other,
    };
    let force = unit_suffix(&meaning.force, "");
    let length = if meaning.length == "m" { "m" } else { "cells" };
    let names = [
        ("raw_sequence".to_owned(), "<u8"),
        ("raw_time_ns".to_owned(), "<u8"),
        ("raw_utc_ns".to_owned(), "<u8"),
        ("raw_arrival_ns".to_owned(), "<u8"),
        (format!("raw_readings_{reading}"), "<f8"),
        ("touch_sequence".to_owned(), "<u8"),
        ("touch_time_ns".to_owned(), "<u8"),
        (format!("touch_values_{value}"), "<f4"),
        (format!("touch_deviations_{value}"), "<f4"),
        ("touch_states".to_owned(), "|u1"),
        ("touch_force_n".to_owned(), "<f8"),
        ("touch_force_deviation_n".to_owned(), "<f8"),
        ("touch_moment_n_m".to_owned(), "<f8"),
        (format!("touch_centre_of_pressure_{length}"), "<f8"),
        ("contact_sequence".to_owned(), "<u8"),
        ("contact_time_ns".to_owned(), "<u8"),
        ("contact_id".to_owned(), "<u8"),
        (format!("contact_centre_{length}"), "<f8"),
        (format!("contact_force_{force}"), "<f8"),
        (format!("contact_force_deviation_{force}"), "<f8"),
        ("event_time_ns".to_owned(), "<u8"),
        ("event_contact".to_owned(), "<u8"),
        ("event_value".to_owned(), "<f8"),
        ("event_deviation".to_owned(), "<f8"),
        ("mark_time_ns".to_owned(), "<u8"),
        ("mark_utc_ns".to_owned(), "<u8"),
        ("rest_time_ns".to_owned(), "<u8"),
        (format!("rest_readings_{reading}"), "<f8"),
    ];
    let mut arrays = names.map(|(name, kind)| Array::new(&name, kind));
    let [
        raw_sequence,
        raw_time,
        raw_utc,
        raw_arrival,
        raw_readings,
        touch_sequence,
        touch_time,
        values,
        deviations,
        states,
        forces,
        force_deviations,
        moments,
        centres,
        contact_sequence,
        contact_time,
        contact_id,
        contact_centre,
        contact_force,
        contact_deviation,
        event_time,
        event_contact,
        event_value,
        event_deviation,
        mark_time,
        mark_utc,
        rest_time,
        rest_readings,
    ] = &mut arrays;
    let (mut kinds, mut units, mut marks, mut rests) = (
        Texts::default(),
        Texts::default(),
        Texts::default(),
        Texts::default(),
    );
    let mut size = 0;
    while let Some(entry) = reader.next()? {
        size += entry.bytes.len() as u64;
        if entry.channel != Channel::Wire && size > LARGEST {
            return Err(Error::new(
                ErrorKind::InvalidInput,
                "the recording is too large for one archive (4 GiB): cut it, or export a folder",
            ));
        }
        match entry.channel {
            Channel::Raw => {
                if let Some(FrameMessage { utc_ns, frame }) = FrameMessage::decode(entry.bytes) {
                    raw_sequence.u64(frame.sequence);
                    raw_time.u64(frame.time_ns);
                    raw_utc.u64(utc_ns);
                    raw_arrival.u64(frame.host_ns.unwrap_or(NO_TIME));
                    raw_readings.f64s(&frame.values);
                }
            }
            Channel::Touch => {
                let Some(touch) = TouchMessage::decode(entry.bytes) else {
                    continue;
                };
                touch_sequence.u64(touch.sequence);
                touch_time.u64(touch.device_time_ns);
                values.f32s(&touch.values);
                deviations.f32s(&touch.deviations);
                states.u8s(&touch.states);
                forces.f64s(&touch.force);
                force_deviations.f64s(&touch.force_deviation);
                moments.f64s(&touch.moment);
                centres.f64s(&touch.centre_of_pressure);
                for contact in &touch.contacts {
                    contact_sequence.u64(touch.sequence);
                    contact_time.u64(touch.device_time_ns);
                    contact_id.u64(contact.id);
                    contact_centre.f64s(&contact.centre);
                    contact_force.f64s(&contact.force);
                    contact_deviation.f64s(&contact.force_deviation);
                }
            }
            Channel::Events => {
                if let Some(event) = EventMessage::decode(entry.bytes) {
                    event_time.u64(event.device_time_ns);
                    event_contact.u64(event.contact);
                    event_value.f64(event.value);
                    event_deviation.f64(event.deviation);
                    kinds.0.push(event.kind);
                    units.0.push(event.unit);
                }
            }
            Channel::Marks => {
                if let Some(mark) = MarkMessage::decode(entry.bytes) {
                    mark_time.u64(mark.device_time_ns.unwrap_or(NO_TIME));
                    mark_utc.u64(mark.utc_ns);
                    marks.0.push(mark.text);
                }
            }
            Channel::Rest => {
                if let Some(rest) = RestMessage::decode(entry.bytes) {
                    rest_time.u64(rest.device_time_ns.unwrap_or(NO_TIME));
                    rest_readings.f64s(&rest.values);
                    rests.0.push(rest.kind.name().into());
                }
            }
            Channel::Wire | Channel::Link | Channel::Clock | Channel::Health => {}
        }
    }
    let frames = raw_sequence.rows as u64;
    let mut zip = Zip::new(out);
    // One number a row, also where there is no row.
    let flat = [
        "sequence",
        "time_ns",
        "utc_ns",
        "arrival_ns",
        "_id",
        "event_contact",
        "event_value",
        "event_deviation",
    ];
    for array in &mut arrays {
        array.flat |= flat.iter().any(|end| array.name.ends_with(end));
        array.put(&mut zip)?;
    }
    kinds.put("event_kind", &mut zip)?;
    units.put("event_unit", &mut zip)?;
    marks.put("mark_text", &mut zip)?;
    rests.put("rest_kind", &mut zip)?;
    Texts(meaning.channels.clone()).put("channel_names", &mut zip)?;
    Texts(meaning.states.clone()).put("state_names", &mut zip)?;
    zip.finish()?;
    Ok(frames)
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
