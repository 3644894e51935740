//! Frames to bytes, by the same description.

use taxel_recording::Frame;

use super::stuffing;
use super::{can, json};
use crate::board::layout::{Counting, PacketLayout, PlacedField, Role};
use crate::board::messages::{Body, MessageLayout};
use crate::board::{Board, BuiltIn, Format, Framing, Id, Order, Stamped};
use crate::papillarray;

/// Frames to bytes as the board would send them.
///
/// ```
/// use taxel_board::{Begin, Board, Decoder, Encoder};
/// use taxel_recording::Frame;
///
/// let board = Board::shipped("optoforce-16").expect("shipped files are right");
/// let frame = Frame { sequence: 7, values: vec![1.5, -0.5, 20.0], ..Frame::default() };
/// let mut wire = Vec::new();
/// Encoder::new(&board).encode(&frame, &mut wire);
/// let mut decoder = Decoder::new(&board, Begin::Whole);
/// decoder.push(&wire, None);
/// let back = decoder.next().expect("one frame");
/// assert_eq!(back.sequence, 7);
/// // Within half a step of the wire.
/// assert!((back.values[0] - 1.5).abs() < 0.0379 / 2.0);
/// ```
#[derive(Debug, Clone)]
pub struct Encoder {
    board: Board,
    wired: Vec<usize>,
    values: Vec<f64>,
    /// Values of the frames that wait for the others of their packet, and number and time of the
    /// first.
    waiting: Vec<f64>,
    first: Option<[u64; 2]>,
}

impl Encoder {
    /// An encoder of the packets of `board`.
    pub fn new(board: &Board) -> Self {
        Self {
            wired: board.wired(),
            values: vec![f64::NAN; board.values.len()],
            waiting: Vec::new(),
            first: None,
            board: board.clone(),
        }
    }

    /// Appends the bytes of one frame: a value that the wire cannot hold is its nearest, a
    /// missing one is what the board sends for it, or 0 of a whole number without such.
    pub fn encode(&mut self, frame: &Frame, out: &mut Vec<u8>) {
        for (place, value) in self.wired.iter().zip(&frame.values) {
            self.values[*place] = *value;
        }
        // A packet of several frames waits for all of them.
        let frame = &self.together(frame);
        let frames = self.board.samples.map_or(1, |samples| samples.count);
        if self.waiting.len() < frames * self.values.len() {
            return;
        }
        let values = std::mem::take(&mut self.waiting);
        // What the packets hold beside the values.
        let counter = if frames > 1 {
            self.board.counter()
        } else {
            self.board.counter_on_wire()
        };
        let slots = self.board.frame_rule().required.len() as u64;
        let raw = |slot: usize| match counter {
            Some(counter) if counter.counts_packets() => {
                counter.raw(frame.sequence.wrapping_mul(slots).wrapping_add(slot as u64))
            }
            Some(counter) => counter.raw(frame.sequence),
            None => frame.sequence,
        };
        let of_slot = |slot: usize| Frame {
            sequence: raw(slot),
            time_ns: frame.time_ns,
            ..Frame::default()
        };
        match &self.board.format {
            Format::Lines(lines) => {
                lines.write(&values, raw, frame.time_ns, out);
            }
            Format::BuiltIn(BuiltIn::Papillarray) => {
                papillarray::write(&values, raw(0), frame.time_ns / 1000, out);
            }
            Format::Messages(format) => {
                for message in &format.messages {
                    match &message.body {
                        Body::Bytes(layout)
                            if matches!(self.board.framing, Framing::Messages(_)) =>
                        {
                            can_messages(&self.board, message, layout, &values, &of_slot, out);
                        }
                        Body::Bytes(layout) => {
                            for slot in 0..message.slots() {
                                let values = &values[message.first_value + slot * message.values..];
                                let frame = of_slot(message.first_slot + slot);
                                let bytes = packet_of(&self.board, layout, values, slot, &frame);
                                self.put(&bytes, out);
                            }
                        }
                        Body::Json(fields) => {
                            json::write(message, fields, &values, &of_slot, out);
                        }
                    }
                }
            }
            Format::Packet(layout) => {
                let packets = layout.address.map_or(1, |address| address.count);
                for packet in 0..packets {
                    let values = &values[packet * layout.values..];
                    let bytes = packet_of(&self.board, layout, values, packet, &of_slot(packet));
                    self.put(&bytes, out);
                }
            }
        }
    }

    /// Adds a frame to those that wait; number and time of the packet that it may complete.
    fn together(&mut self, frame: &Frame) -> Frame {
        self.waiting.extend_from_slice(&self.values);
        let first = *self.first.get_or_insert([frame.sequence, frame.time_ns]);
        let frames = self.board.samples.map_or(1, |samples| samples.count);
        if self.waiting.len() >= frames * self.values.len() {
            self.first = None;
        }
        let stamp = self.board.samples.map(|samples| samples.stamp);
        Frame {
            sequence: first[0],
            time_ns: if stamp == Some(Stamped::First) {
                first[1]
            } else {
                frame.time_ns
            },
            ..Frame::default()
        }
    }

    /// Appends a packet as its framing has it.
    fn put(&self, bytes: &[u8], out: &mut Vec<u8>) {
        match &self.board.framing {
            Framing::Cobs(_) => stuffing::to_cobs(bytes, out),
            Framing::Slip(_) => stuffing::to_slip(bytes, out),
            _ => out.extend_from_slice(bytes),
        }
    }
}

fn can_messages(
    board: &Board,
    message: &MessageLayout,
    layout: &PacketLayout,
    values: &[f64],
    of_slot: &impl Fn(usize) -> Frame,
    out: &mut Vec<u8>,
) {
    for slot in 0..message.slots() {
        let Some(Id::Number(id)) = message.ids.get(slot / message.addresses) else {
            continue;
        };
        let values = &values[message.first_value + slot * message.values..];
        let address = slot % message.addresses;
        let frame = of_slot(message.first_slot + slot);
        let mut bytes = packet_of(board, layout, values, address, &frame);
        bytes.resize(message.length.unwrap_or(layout.length), 0);
        can::write(*id, message.extended, &bytes, out);
    }
}

/// The bytes of the packet of this address, whose values are the first of `values`.
fn packet_of(
    board: &Board,
    layout: &PacketLayout,
    values: &[f64],
    packet: usize,
    frame: &Frame,
) -> Vec<u8> {
    let mut bytes = vec![0; layout.length];
    let mut put = |at: usize, mark: &crate::pattern::BytePattern| {
        for (byte, example) in bytes[at..].iter_mut().zip(mark.example()) {
            *byte = example;
        }
    };
    match &board.framing {
        Framing::Fixed(fixed) => {
            if let Some(head) = &fixed.head {
                put(0, head);
            }
            if let Some(tail) = &fixed.tail {
                put(layout.length - tail.len(), tail);
            }
        }
        Framing::Marked(marked) => {
            put(0, &marked.head);
            put(layout.length - marked.tail.len(), &marked.tail);
        }
        Framing::Length(length) => put(0, &length.head),
        Framing::Lines(_) | Framing::Cobs(_) | Framing::Slip(_) | Framing::Messages(_) => {}
    }
    for field in &layout.fields {
        match &field.role {
            Role::Value(place, conversion) => {
                let number = conversion.number(values[*place]);
                // Not a number has no place among whole ones.
                let number = if number.is_nan() && !field.kind.is_float() {
                    0.0
                } else {
                    number
                };
                field.put_number(number, &mut bytes);
            }
            Role::Sequence(_) => field.put_whole(frame.sequence, &mut bytes),
            Role::Time(step_ns) if field.kind.is_float() => {
                field.put_number(frame.time_ns as f64 / step_ns, &mut bytes);
            }
            Role::Time(step_ns) => {
                let steps = (frame.time_ns as f64 / step_ns).round();
                field.put_whole(steps as u64, &mut bytes);
            }
            Role::Status(status) if !field.kind.is_float() => {
                field.put_whole(status.good.first().copied().unwrap_or(0), &mut bytes);
            }
            Role::Status(_) => {}
            Role::Address => {
                let address = layout.address.map_or(0, |range| range.at(packet));
                field.put_number(address as f64, &mut bytes);
            }
            Role::Mark(mark) => {
                for (byte, example) in bytes[field.bit / 8..].iter_mut().zip(mark.example()) {
                    *byte = example;
                }
            }
        }
    }
    if let Framing::Length(length) = &board.framing {
        let order = length.order.unwrap_or(match layout.fields.first() {
            Some(field) => field.order,
            None => Order::Little,
        });
        let place = PlacedField {
            bit: 8 * length.at,
            kind: length.kind,
            order,
            role: Role::Sequence(Counting::PLAIN),
        };
        let behind = length.at + length.kind.bits() / 8;
        let said = crate::board::counted(length.counts, layout, behind).unwrap_or(0);
        place.put_whole(said as u64, &mut bytes);
    }
    if let Some(check) = &layout.check {
        check.put(&mut bytes);
    }
    bytes
}
