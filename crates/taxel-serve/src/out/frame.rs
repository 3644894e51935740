//! Reading a binary message again. The layout is that of `docs/live-protocol.md`.

use std::fmt::Write as _;

use taxel::estimation::{Certainty, Meaning, State};

use crate::message::{CONTACT, HEADER};

/// What the columns of a line are.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    /// Keys of SI units: of a reading, of a value, of a contact's force, of a length.
    reading: &'static str,
    value: &'static str,
    force: &'static str,
    length: &'static str,
}

/// Names of the codes of a message; none for one that stands for nothing.
fn certainty(code: u8) -> Option<&'static str> {
    Certainty::ALL
        .get(usize::from(code))
        .map(|certainty| certainty.name())
}

fn state(code: u8) -> Option<&'static str> {
    State::ALL.get(usize::from(code)).map(|state| state.name())
}

/// SI unit of a quantity, as a key has it and as a header has it.
pub(super) fn unit(quantity: &str) -> (&'static str, &'static str) {
    match quantity {
        "capacitance" => ("f", "F"),
        "voltage" => ("v", "V"),
        "resistance" | "resistance change" => ("ohm", "ohm"),
        "charge" => ("c", "C"),
        "flux_density" => ("t", "T"),
        "force" => ("n", "N"),
        "pressure" => ("pa", "Pa"),
        "counts" => ("counts", "counts"),
        _ => ("si", "SI"),
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// A contact of a frame.
pub(crate) struct ContactOfFrame {
    pub(crate) id: u64,
    pub(crate) centre: [f64; 2],
    pub(crate) force: [f64; 3],
    pub(crate) force_deviation: [f64; 3],
    /// How much the force says, by name.
    pub(crate) certainty: Option<&'static str>,
}

impl Columns {
    pub(super) fn reading(&self) -> &'static str {
        self.reading
    }

    pub(super) fn value(&self) -> &'static str {
        self.value
    }

    pub(super) fn length(&self) -> &'static str {
        self.length
    }

    pub(crate) fn new(meaning: &Meaning) -> Self {
        Self {
            reading: unit(&meaning.reading.quantity).0,
            value: unit(&meaning.value.quantity).0,
            force: match meaning.force_unit() {
                "N" => "n",
                "Pa" => "pa",
                _ => "si",
            },
            length: if meaning.in_metres { "m" } else { "cells" },
        }
    }
}

/// A binary message.
pub(crate) struct FrameMessage<'a>(pub(crate) &'a [u8]);

impl FrameMessage<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut found = [0; N];
        if let Some(bytes) = self.0.get(at..at + N) {
            found.copy_from_slice(bytes);
        }
        found
    }

    fn u16(&self, at: usize) -> usize {
        u16::from_le_bytes(self.bytes(at)).into()
    }

    fn u32(&self, at: usize) -> usize {
        u32::from_le_bytes(self.bytes(at)) as usize
    }

    fn u64(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.bytes(at))
    }

    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.bytes(at))
    }

    fn floats(&self, at: usize, count: usize) -> impl Iterator<Item = f32> + '_ {
        let bytes = self.0.get(at..at + 4 * count).unwrap_or_default();
        bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|value| f32::from_le_bytes(*value))
    }

    fn f64s<const N: usize>(&self, at: usize) -> [f64; N] {
        std::array::from_fn(|place| self.f64(at + 8 * place))
    }

    pub(super) fn sequence(&self) -> u64 {
        self.u64(8)
    }

    /// Device time, s.
    pub(super) fn seconds(&self) -> f64 {
        self.u64(16) as f64 * 1e-9
    }

    /// Total force, N.
    pub(super) fn force(&self) -> [f64; 3] {
        self.f64s(64)
    }

    pub(super) fn force_deviation(&self) -> [f64; 3] {
        self.f64s(88)
    }

    /// Total moment, N m.
    pub(super) fn moment(&self) -> [f64; 3] {
        self.f64s(112)
    }

    /// Centre of pressure.
    pub(super) fn centre(&self) -> [f64; 2] {
        self.f64s(136)
    }

    pub(super) fn sum(&self) -> f64 {
        self.f64(176)
    }

    /// How much the total says, by name.
    pub(super) fn certainty(&self) -> Option<&'static str> {
        let [total] = self.bytes(212);
        certainty(total)
    }

    /// Code of how much the total says.
    pub(super) fn certainty_code(&self) -> u8 {
        let [total] = self.bytes(212);
        total
    }

    /// The state that is the reason, by name.
    pub(super) fn reason(&self) -> Option<&'static str> {
        let [reason] = self.bytes(213);
        state(reason)
    }

    pub(crate) fn contacts(&self) -> impl Iterator<Item = ContactOfFrame> + '_ {
        (0..self.u16(6)).map(|contact| {
            let at = HEADER + CONTACT * contact;
            ContactOfFrame {
                id: self.f64(at) as u64,
                centre: self.f64s(at + 16),
                force: self.f64s(at + 72),
                force_deviation: self.f64s(at + 96),
                certainty: certainty(self.f64(at + 152) as u8),
            }
        })
    }

    pub(super) fn readings(&self) -> impl Iterator<Item = f32> + '_ {
        self.arrays().0
    }

    /// Values of the taxels, component by component.
    pub(crate) fn values(&self) -> impl Iterator<Item = f32> + '_ {
        self.arrays().1
    }

    /// Their standard deviations.
    pub(crate) fn deviations(&self) -> impl Iterator<Item = f32> + '_ {
        let (taxels, channels) = (self.u32(184), self.u32(188));
        let values = self.u16(4) * taxels;
        let at = HEADER + CONTACT * self.u16(6) + 4 * (channels + values);
        self.floats(at, values)
    }

    /// State of each taxel, by its code.
    pub(crate) fn states(&self) -> impl Iterator<Item = u8> + '_ {
        let (taxels, channels) = (self.u32(184), self.u32(188));
        // Readings, values, deviations, residuals and the states of the channels come before them.
        let floats = channels + (2 * self.u16(4) + 1) * taxels;
        let at = HEADER + CONTACT * self.u16(6) + 4 * floats + channels;
        self.0
            .get(at..at + taxels)
            .unwrap_or_default()
            .iter()
            .copied()
    }

    fn zero_known(&self) -> bool {
        self.u32(192) & 32 == 0
    }

    /// Adds what the total says, and whether there is a zero.
    fn push_certainty(&self, out: &mut String) {
        let [total, reason] = self.bytes(212);
        out.push_str(",\"total_certainty\":");
        push_name(out, certainty(total));
        out.push_str(",\"total_reason\":");
        push_name(out, state(reason));
        let _ = write!(out, ",\"zero_known\":{}", self.zero_known());
    }

    fn arrival(&self) -> Option<u64> {
        Some(self.u64(200)).filter(|host_ns| *host_ns != u64::MAX)
    }

    pub(super) fn lost(&self) -> Option<u64> {
        Some(self.u64(24)).filter(|lost| *lost != u64::MAX)
    }

    /// Adds the frame as one object of JSON, and the end of the line.
    pub(crate) fn json(&self, columns: &Columns, link: &str, out: &mut String) {
        let _ = write!(
            out,
            "{{\"sequence\":{},\"time_ns\":{}",
            self.u64(8),
            self.u64(16)
        );
        match self.arrival() {
            Some(host_ns) => drop(write!(out, ",\"host_ns\":{host_ns}")),
            None => out.push_str(",\"host_ns\":null"),
        }
        let _ = write!(out, ",\"flags\":{}", self.u32(208));
        match self.lost() {
            Some(lost) => drop(write!(out, ",\"lost\":{lost}")),
            None => out.push_str(",\"lost\":null"),
        }
        match link {
            "" => out.push_str(",\"link\":null"),
            link => drop(write!(out, ",\"link\":\"{link}\"")),
        }
        let mut number = Number::new();
        let mut field = |out: &mut String, key: std::fmt::Arguments<'_>, value: f64| {
            let _ = write!(out, ",\"{key}\":");
            number.push(out, value);
        };
        for (axis, name) in AXES.into_iter().enumerate() {
            field(out, format_args!("force_{name}_n"), self.f64(64 + 8 * axis));
        }
        for (axis, name) in AXES.into_iter().enumerate() {
            field(
                out,
                format_args!("force_{name}_deviation_n"),
                self.f64(88 + 8 * axis),
            );
        }
        for (axis, name) in AXES.into_iter().enumerate() {
            field(
                out,
                format_args!("moment_{name}_n_m"),
                self.f64(112 + 8 * axis),
            );
        }
        let (length, force, value) = (columns.length, columns.force, columns.value);
        field(out, format_args!("centre_x_{length}"), self.f64(136));
        field(out, format_args!("centre_y_{length}"), self.f64(144));
        field(out, format_args!("sum_{value}"), self.f64(176));
        self.push_certainty(out);
        out.push_str(",\"contacts\":[");
        for contact in 0..self.u16(6) {
            let at = HEADER + CONTACT * contact;
            let comma = if contact > 0 { "," } else { "" };
            let (id, taxels) = (self.f64(at), self.f64(at + 8));
            let _ = write!(out, "{comma}{{\"id\":{id},\"taxels\":{taxels}");
            field(out, format_args!("x_{length}"), self.f64(at + 16));
            field(out, format_args!("y_{length}"), self.f64(at + 24));
            for (axis, name) in AXES.into_iter().enumerate() {
                let force_at = at + 72 + 8 * axis;
                field(
                    out,
                    format_args!("force_{name}_{force}"),
                    self.f64(force_at),
                );
            }
            let name = certainty(self.f64(at + 152) as u8);
            out.push_str(",\"certainty\":");
            push_name(out, name);
            out.push('}');
        }
        let (readings, values) = self.arrays();
        let _ = write!(out, "],\"readings_{}\":[", columns.reading);
        number.list(out, readings);
        let _ = write!(out, "],\"values_{value}\":[");
        number.list(out, values);
        out.push_str("]}\n");
    }

    /// Readings of the channels, and values of the taxels.
    fn arrays(
        &self,
    ) -> (
        impl Iterator<Item = f32> + '_,
        impl Iterator<Item = f32> + '_,
    ) {
        let (components, contacts) = (self.u16(4), self.u16(6));
        let (taxels, channels) = (self.u32(184), self.u32(188));
        let at = HEADER + CONTACT * contacts;
        (
            self.floats(at, channels),
            self.floats(at + 4 * channels, components * taxels),
        )
    }
}

/// Adds a name of ours, which needs no escape, as JSON.
fn push_name(out: &mut String, name: Option<&str>) {
    match name {
        Some(name) => drop(write!(out, "\"{name}\"")),
        None => out.push_str("null"),
    }
}

/// Writes numbers with as many digits as they have.
pub(super) struct Number(zmij::Buffer);

/// A number of either width.
pub(super) trait Digits: zmij::Float + Copy {
    fn known(self) -> bool;
}

impl Digits for f64 {
    fn known(self) -> bool {
        self.is_finite()
    }
}

impl Digits for f32 {
    fn known(self) -> bool {
        self.is_finite()
    }
}

impl Number {
    pub(super) fn new() -> Self {
        Self(zmij::Buffer::new())
    }

    pub(super) fn push(&mut self, out: &mut String, value: impl Digits) {
        out.push_str(if value.known() {
            self.0.format_finite(value)
        } else {
            "null"
        });
    }

    pub(super) fn field(&mut self, out: &mut String, value: impl Digits) {
        out.push(',');
        if value.known() {
            out.push_str(self.0.format_finite(value));
        }
    }

    fn list(&mut self, out: &mut String, values: impl Iterator<Item = f32>) {
        for (place, value) in values.enumerate() {
            if place > 0 {
                out.push(',');
            }
            self.push(out, value);
        }
    }
}
