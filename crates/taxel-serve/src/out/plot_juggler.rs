//! JSON by datagrams, as the UDP server of `PlotJuggler` takes it.

use std::fmt::Write as _;
use std::io;

use taxel::estimation::Meaning;

use super::datagrams::Datagrams;
use super::frame::{Columns, FrameMessage, Number};
use super::sink::Sink;
use crate::outgoing::Outgoing;

/// The longest datagram, bytes: that of UDP over IPv4.
const LONGEST: usize = 65_507;

/// Sends each frame as an object whose numbers have names that become curves.
pub(super) struct PlotJuggler {
    to: Datagrams,
    columns: Columns,
    /// Names of channels and of taxels, as JSON.
    channels: Vec<String>,
    taxels: Vec<String>,
    components: usize,
    text: String,
    number: Number,
}

impl PlotJuggler {
    pub(super) fn open(address: &str, meaning: &Meaning) -> io::Result<Self> {
        let quoted = |name: &String| serde_json::Value::from(name.as_str()).to_string();
        let layout = &meaning.layout;
        let taxel = |index: usize| {
            let (row, column) = (index / layout.columns, index % layout.columns);
            format!("\"r{row}c{column}\"")
        };
        Ok(Self {
            to: Datagrams::open(address)?,
            columns: Columns::new(meaning),
            channels: meaning.channels.iter().map(quoted).collect(),
            taxels: (0..layout.taxels()).map(taxel).collect(),
            components: meaning.components,
            text: String::new(),
            number: Number::new(),
        })
    }

    /// Adds an object of numbers; what is not known is left out, since a curve has no place for it.
    fn numbers<'a>(
        &mut self,
        key: &str,
        unit: &str,
        numbers: impl Iterator<Item = (&'a str, f64)>,
    ) {
        let _ = write!(self.text, ",\"{key}_{unit}\":{{");
        let mut comma = "";
        for (name, value) in numbers.filter(|(_, value)| value.is_finite()) {
            let _ = write!(self.text, "{comma}{name}:");
            self.number.push(&mut self.text, value);
            comma = ",";
        }
        self.text.push('}');
    }
}

const AXES: [&str; 3] = ["\"x\"", "\"y\"", "\"z\""];

impl Sink for PlotJuggler {
    fn frame(&mut self, outgoing: &Outgoing) -> io::Result<()> {
        let frame = FrameMessage(&outgoing.bytes);
        self.text.clear();
        let _ = write!(
            self.text,
            "{{\"timestamp\":{},\"taxel\":{{\"sequence\":{}",
            frame.seconds(),
            frame.sequence()
        );
        if let Some(lost) = frame.lost() {
            let _ = write!(self.text, ",\"lost\":{lost}");
        }
        let contacts = frame.contacts().count();
        let _ = write!(self.text, ",\"contacts\":{contacts}");
        if let Some(certainty) = frame.certainty() {
            let _ = write!(self.text, ",\"total_certainty\":\"{certainty}\"");
        }
        let axes = |values: [f64; 3]| AXES.into_iter().zip(values);
        self.numbers("force", "n", axes(frame.force()));
        self.numbers("force_deviation", "n", axes(frame.force_deviation()));
        self.numbers("moment", "n_m", axes(frame.moment()));
        let length = self.columns.length();
        self.numbers("centre", length, AXES.into_iter().zip(frame.centre()));
        let channels = std::mem::take(&mut self.channels);
        let readings = frame.readings().map(f64::from);
        let reading = self.columns.reading();
        self.numbers(
            "readings",
            reading,
            channels.iter().map(String::as_str).zip(readings),
        );
        self.channels = channels;
        let value = self.columns.value();
        let (taxels, components) = (std::mem::take(&mut self.taxels), self.components);
        for (component, axis) in ["x", "y", "z"][3 - components..].iter().enumerate() {
            let names = || taxels.iter().map(String::as_str);
            let of_axis = |values: &mut dyn Iterator<Item = f32>| -> Vec<f64> {
                values
                    .skip(component)
                    .step_by(components)
                    .map(f64::from)
                    .collect()
            };
            let values = of_axis(&mut frame.values());
            self.numbers(&format!("values_{axis}"), value, names().zip(values));
            let deviations = of_axis(&mut frame.deviations());
            self.numbers(
                &format!("deviations_{axis}"),
                value,
                names().zip(deviations),
            );
        }
        self.taxels = taxels;
        self.text.push_str("}}");
        if self.text.len() > LONGEST {
            let message = format!(
                "a frame takes {} bytes, and a datagram has {LONGEST} at most; use jsonl:tcp:PORT",
                self.text.len()
            );
            return Err(io::Error::other(message));
        }
        self.to.send(self.text.as_bytes())
    }
}
