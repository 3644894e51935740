//! Open Sound Control over UDP, version 1.0: for Max, Pure Data, `SuperCollider`, `TouchDesigner`.

use std::io;

use super::datagrams::Datagrams;
use super::frame::FrameMessage;
use super::sink::Sink;
use crate::events::EventRecord;
use crate::outgoing::Outgoing;

/// Sends each frame as messages, one datagram each.
pub(super) struct Osc {
    to: Datagrams,
    message: Message,
}

/// A message that is being written.
#[derive(Default)]
struct Message {
    bytes: Vec<u8>,
    tags: String,
    arguments: Vec<u8>,
}

impl Osc {
    pub(super) fn open(address: &str) -> io::Result<Self> {
        Ok(Self {
            to: Datagrams::open(address)?,
            message: Message::default(),
        })
    }

    fn send(&mut self, address: &str) -> io::Result<()> {
        self.to.send(self.message.of(address))
    }

    fn floats(&mut self, address: &str, values: impl Iterator<Item = f64>) -> io::Result<()> {
        values.for_each(|value| self.message.float(value));
        self.send(address)
    }
}

/// Appends a text with the zeros that end it at a multiple of four bytes.
fn padded(text: &str, out: &mut Vec<u8>) {
    // A zero ends a text, so none may stand in it.
    out.extend(text.bytes().take_while(|byte| *byte != 0));
    let end = (out.len() + 1).next_multiple_of(4);
    out.resize(end, 0);
}

impl Message {
    fn int(&mut self, value: u64) {
        self.tags.push('i');
        let value = i32::try_from(value).unwrap_or(i32::MAX);
        self.arguments.extend(value.to_be_bytes());
    }

    fn float(&mut self, value: f64) {
        self.tags.push('f');
        self.arguments.extend((value as f32).to_be_bytes());
    }

    fn text(&mut self, text: &str) {
        self.tags.push('s');
        padded(text, &mut self.arguments);
    }

    /// The message of the arguments so far to this address; begins the next.
    fn of(&mut self, address: &str) -> &[u8] {
        self.bytes.clear();
        padded(address, &mut self.bytes);
        self.tags.insert(0, ',');
        padded(&self.tags, &mut self.bytes);
        self.bytes.append(&mut self.arguments);
        self.tags.clear();
        &self.bytes
    }
}

impl Sink for Osc {
    fn frame(&mut self, outgoing: &Outgoing) -> io::Result<()> {
        let frame = FrameMessage(&outgoing.bytes);
        self.message.int(frame.sequence());
        self.message.float(frame.seconds());
        self.send("/taxel/frame")?;
        self.floats("/taxel/force", frame.force().into_iter())?;
        self.floats(
            "/taxel/force_deviation",
            frame.force_deviation().into_iter(),
        )?;
        self.floats("/taxel/moment", frame.moment().into_iter())?;
        self.message.text(frame.certainty().unwrap_or("unknown"));
        self.message.text(frame.reason().unwrap_or_default());
        self.send("/taxel/certainty")?;
        for contact in frame.contacts() {
            self.message.int(contact.id);
            let [x, y] = contact.centre;
            for value in [x, y, contact.force[2], contact.force_deviation[2]] {
                self.message.float(value);
            }
            self.message.text(contact.certainty.unwrap_or("unknown"));
            self.send("/taxel/contact")?;
        }
        self.floats("/taxel/readings", frame.readings().map(f64::from))?;
        self.floats("/taxel/values", frame.values().map(f64::from))?;
        self.message.int(frame.contacts().count() as u64);
        self.send("/taxel/contacts")
    }

    fn event(&mut self, event: &EventRecord, _: Option<&Outgoing>) -> io::Result<()> {
        self.message.text(event.kind);
        self.message.int(event.contact);
        self.message.float(event.value);
        self.message
            .text(event.text.as_deref().unwrap_or(event.unit));
        self.send("/taxel/event")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes of the specification of this output.
    #[test]
    fn a_force_is_the_published_vector() {
        let mut message = Message::default();
        for value in [0.0, 0.0, 1.5] {
            message.float(value);
        }
        let expected = b"/taxel/force\0\0\0\0,fff\0\0\0\0\0\0\0\0\0\0\0\0\x3f\xc0\0\0";
        assert_eq!(message.of("/taxel/force"), expected);
        message.int(3);
        message.text("slip");
        // A text ends with at least one zero.
        let expected = b"/e\0\0,is\0\0\0\0\x03slip\0\0\0\0";
        assert_eq!(message.of("/e"), expected);
    }
}
