//! Frames to bytes, by the same description.

use taxel_recording::Frame;

use super::stuffing;
use super::{can, json};
use crate::board::layout::{Counting, PacketLayout, PlacedField, Role};
use crate::board::messages::{Body, MessageLayout};
use crate::board::{Board, BuiltIn, Format, Framing, Id, Order};
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
}

impl Encoder {
    /// An encoder of the packets of `board`.
    pub fn new(board: &Board) -> Self {
        Self {
            wired: board.wired(),
            values: vec![f64::NAN; board.values.len()],
            board: board.clone(),
        }
    }

    /// Appends the bytes of one frame: a value that the wire cannot hold is its nearest, a
    /// missing one is what the board sends for it, or 0 of a whole number without such.
    pub fn encode(&mut self, frame: &Frame, out: &mut Vec<u8>) {
        for (place, value) in self.wired.iter().zip(&frame.values) {
            self.values[*place] = *value;
        }
        // What the packets hold beside the values.
        let counter = self.board.counter();
        let frame = &Frame {
            sequence: counter.map_or(frame.sequence, |counter| counter.raw(frame.sequence)),
            time_ns: frame.time_ns,
            ..Frame::default()
        };
        match &self.board.format {
            Format::Lines(lines) => {
                lines.write(&self.values, frame.sequence, frame.time_ns, out);
            }
            Format::BuiltIn(BuiltIn::Papillarray) => {
                papillarray::write(&self.values, frame.sequence, frame.time_ns / 1000, out);
            }
            Format::Messages(format) => {
                for message in &format.messages {
                    match &message.body {
                        Body::Bytes(layout) => {
                            can_messages(&self.board, message, layout, &self.values, frame, out);
                        }
                        Body::Json(fields) => {
                            json::write(message, fields, &self.values, frame, out);
                        }
                    }
                }
            }
            Format::Packet(layout) => {
                let packets = layout.address.map_or(1, |address| address.count);
                for packet in 0..packets {
                    let values = &self.values[packet * layout.values..];
                    let bytes = packet_of(&self.board, layout, values, packet, frame);
                    match &self.board.framing {
                        Framing::Cobs(_) => stuffing::to_cobs(&bytes, out),
                        Framing::Slip(_) => stuffing::to_slip(&bytes, out),
                        _ => out.extend_from_slice(&bytes),
                    }
                }
            }
        }
    }
}

fn can_messages(
    board: &Board,
    message: &MessageLayout,
    layout: &PacketLayout,
    values: &[f64],
    frame: &Frame,
    out: &mut Vec<u8>,
) {
    for slot in 0..message.slots() {
        let Some(Id::Number(id)) = message.ids.get(slot / message.addresses) else {
            continue;
        };
        let values = &values[message.first_value + slot * message.values..];
        let address = slot % message.addresses;
        let mut bytes = packet_of(board, layout, values, address, frame);
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
                let address = layout
                    .address
                    .map_or(0, |range| range.first + packet.cast_signed() as i64);
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
