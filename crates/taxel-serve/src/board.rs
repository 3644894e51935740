//! Boards as the links and the virtual device take them.

use taxel::acquisition::Frame;
use taxel_board::{
    Begin, Board, Counts, Decoder, Encoder, HELLO_QUESTION, Poll as BoardPoll, Sent, Usb, UsbName,
};

use crate::device::Encode;
use crate::link::{Decode, Greeting, LinkAddress, Poll, SerialSettings, UsbMatch, WireCounts};

/// Frames of another board in a sample before it is named.
const FOUND: u64 = 4;

/// The bytes of a board as frames.
pub struct BoardDecoder {
    decoder: Decoder,
    begin: Begin,
    name: String,
    class: char,
    text: bool,
}

impl BoardDecoder {
    /// The decoder of `board` for a link at `address`.
    pub fn new(board: &Board, address: &LinkAddress) -> Self {
        let begin = begin(address);
        Self {
            decoder: Decoder::new(board, begin),
            begin,
            name: board.name.clone(),
            class: board.detection().class.letter(),
            text: board.carries_text(),
        }
    }
}

/// How the bytes of a link at `address` begin, at each connect.
pub fn begin(address: &LinkAddress) -> Begin {
    match address {
        // A server that was sending before begins anywhere; so does a port.
        LinkAddress::Serial(_) | LinkAddress::Tcp(_) | LinkAddress::Udp { .. } => Begin::Cut,
        LinkAddress::StandardInput
        | LinkAddress::Pipe(_)
        | LinkAddress::Program(_)
        | LinkAddress::WebSocket { .. } => Begin::Whole,
    }
}

impl Decode for BoardDecoder {
    fn push(&mut self, bytes: &[u8], host_ns: u64) {
        self.decoder.push(bytes, Some(host_ns));
    }

    fn next(&mut self) -> Option<Frame> {
        self.decoder.next()
    }

    fn finish(&mut self) {
        self.decoder.finish();
    }

    fn reconnected(&mut self) {
        self.decoder.reconnect(self.begin);
    }

    fn question(&self) -> &[u8] {
        if self.decoder.awaits_hello() {
            HELLO_QUESTION
        } else {
            &[]
        }
    }

    fn changed(&self) -> Option<&str> {
        self.decoder.changed()
    }

    fn counts(&self) -> WireCounts {
        wire_counts(&self.decoder.counts())
    }

    fn board(&self) -> String {
        self.name.clone()
    }

    fn wire_class(&self) -> char {
        self.class
    }

    fn expects_text(&self) -> bool {
        self.text
    }

    fn remark(&self) -> Option<String> {
        self.decoder.remark()
    }

    fn others(&self, sample: &[u8]) -> Vec<String> {
        let known = Board::shipped_names().filter_map(|name| Some((name, Board::shipped(name)?)));
        known
            .filter(|(_, board)| board.name != self.name && speaks(board, sample))
            .map(|(name, _)| name.to_owned())
            .collect()
    }
}

/// Counts of a decoder as the status of a link has them.
pub(crate) fn wire_counts(counts: &Counts) -> WireCounts {
    WireCounts {
        delivered: counts.delivered,
        lost: counts.lost,
        missing_estimate: counts.missing_estimate,
        damaged: counts.damaged,
        passed_over_bytes: counts.passed_over,
        other: counts.other,
        bad_status: counts.bad_status,
        wrong_number: counts.wrong_number,
        wrong_time: counts.wrong_time,
        unconfirmed: counts.unconfirmed,
        incomplete: counts.incomplete,
        late: counts.late,
        duplicate: counts.duplicate,
        ambiguous: counts.ambiguous,
        restarts: counts.restarts,
    }
}

/// True if most of `sample` is packets of `board`.
fn speaks(board: &Board, sample: &[u8]) -> bool {
    let mut decoder = Decoder::new(board, Begin::Cut);
    decoder.push(sample, None);
    while decoder.next().is_some() {}
    let counts = decoder.counts();
    counts.delivered + counts.bad_status >= FOUND && counts.passed_over * 4 < sample.len() as u64
}

/// Frames as the bytes of a board.
pub struct BoardEncoder(Encoder);

impl BoardEncoder {
    /// The encoder of `board`.
    pub fn new(board: &Board) -> Self {
        Self(Encoder::new(board))
    }
}

impl Encode for BoardEncoder {
    fn encode(&mut self, frame: &Frame, bytes: &mut Vec<u8>) {
        self.0.encode(frame, bytes);
    }
}

/// How the serial port of a board is opened.
pub fn serial_settings(board: &Board) -> SerialSettings {
    let Some(serial) = &board.link.serial else {
        return SerialSettings::default();
    };
    SerialSettings {
        baud: serial.baud,
        native_usb: serial.native_usb,
        usb: serial.usb.iter().map(usb_match).collect(),
        dtr: Some(serial.dtr),
        rts: Some(serial.rts),
        reset_on_open: serial.reset_on_open,
    }
}

fn usb_match(usb: &Usb) -> UsbMatch {
    let split = |name: &Option<UsbName>| match name {
        None => (None, None),
        Some(UsbName::Name(name)) => (None, Some(name.clone())),
        Some(UsbName::Number(number)) => (Some(*number), None),
    };
    let ((vendor, vendor_name), (product, product_name)) =
        (split(&usb.vendor), split(&usb.product));
    UsbMatch {
        vendor,
        vendor_name,
        product,
        product_name,
        serial: usb.serial.clone(),
    }
}

/// What is said to a board over a link at `address`.
pub fn greeting(board: &Board, address: &LinkAddress) -> Greeting {
    let bytes = |sent: &Option<Sent>| sent.as_ref().map_or(Vec::new(), |sent| sent.0.clone());
    let poll = |poll: &Option<BoardPoll>| {
        poll.as_ref().map(|poll| Poll {
            send: poll.send.0.clone(),
            every: poll.every,
        })
    };
    let (serial, network) = (&board.link.serial, &board.link.network);
    match (address, serial, network) {
        (
            LinkAddress::Tcp(_)
            | LinkAddress::WebSocket { .. }
            | LinkAddress::Udp { .. }
            | LinkAddress::Program(_),
            _,
            Some(network),
        ) => Greeting {
            start: bytes(&network.start),
            stop: bytes(&network.stop),
            poll: poll(&network.poll),
        },
        // A serial board behind a bridge is greeted as at its port.
        (LinkAddress::Serial(_) | LinkAddress::Tcp(_), Some(serial), _) => Greeting {
            start: bytes(&serial.start),
            stop: bytes(&serial.stop),
            poll: poll(&serial.poll),
        },
        _ => Greeting::default(),
    }
}
