//! What follows from a board file, as `taxel check` prints it.

use taxel_ground::summary::{Fact, fact, number, text};

use super::class::Class;
use super::description::{BuiltIn, Carrier, Framing};
use super::messages::{MessageFormat, MessageLayout};
use super::rules::shortened;
use super::{Board, Format};

impl Board {
    /// What follows from the file, in the order of the signal: link, packets, values, what the
    /// wire can and cannot detect.
    pub fn facts(&self) -> Vec<Fact> {
        let mut facts = vec![fact("board", "name", text(&self.name), "name")];
        if let Some(rate) = self.rate {
            facts.push(fact("board", "rate", number(rate, "hz", "Hz", 1.0), "rate"));
        }
        self.link_facts(&mut facts);
        self.packet_facts(&mut facts);
        self.value_facts(&mut facts);
        self.detection_facts(&mut facts);
        facts
    }

    fn link_facts(&self, facts: &mut Vec<Fact>) {
        let Some(serial) = &self.link.serial else {
            return;
        };
        let mut add = |name: &str, value: String| {
            facts.push(fact("link", name, text(&value), "link.serial"));
        };
        let meaning = if serial.native_usb {
            " (USB itself: the number means nothing)"
        } else {
            ""
        };
        add("baud", format!("{}{meaning}", serial.baud));
        if let Some(start) = &serial.start {
            add("sent_at_start", hexadecimal(&start.0));
        }
        if let Some(stop) = &serial.stop {
            add("sent_at_end", hexadecimal(&stop.0));
        }
        if let Some(poll) = &serial.poll {
            let every = poll.every;
            add(
                "sent_again",
                format!("{} every {every} s", hexadecimal(&poll.send.0)),
            );
        }
        if serial.reset_on_open {
            add("open", "opening the port restarts the board".into());
        }
        if let (Some(bytes), Some(rate), false) =
            (self.bytes_per_frame(), self.rate, serial.native_usb)
        {
            let share = bytes as f64 * rate / (f64::from(serial.baud) / 10.0);
            add("share_of_baud", format!("{:.0} %", 100.0 * share));
        }
    }

    fn packet_facts(&self, facts: &mut Vec<Fact>) {
        let framing = match (&self.framing, &self.format) {
            (_, Format::BuiltIn(BuiltIn::Papillarray)) => {
                "packets that describe themselves (papillarray)"
            }
            (Framing::Lines(_), _) => "lines of text",
            (Framing::Fixed(_), _) => "packets of one length",
            (Framing::Marked(_), _) => "packets between head and tail",
            (Framing::Length(_), _) => "packets that say how long they are",
            (Framing::Cobs(_), _) => "stuffed packets ended by 0 (COBS)",
            (Framing::Slip(_), _) => "packets between 0xc0 (SLIP)",
            (Framing::Messages(messages), _) => match messages.carrier {
                Carrier::Can => "CAN messages as text (SLCAN, candump)",
                Carrier::Json => "JSON objects",
            },
        };
        facts.push(fact("packet", "framing", text(framing), "framing"));
        if let Format::Messages(messages) = &self.format {
            let of_frame: usize = messages.messages.iter().map(MessageLayout::slots).sum();
            let mut add = |name: &str, value: String| {
                facts.push(fact("packet", name, text(&value), "message, framing"));
            };
            add("messages_of_a_frame", of_frame.to_string());
            add("frame_ends", frame_end(messages));
        }
        if let Format::Packet(layout) = &self.format {
            facts.push(fact(
                "packet",
                "bytes",
                text(&layout.length),
                "packet.fields",
            ));
            if self.says_hello() {
                let hello =
                    "the board's hello says what the frames hold; without one, what follows";
                facts.push(fact("packet", "fields", text(&hello), "framing.cobs.hello"));
            }
            if let Some(address) = layout.address {
                facts.push(fact(
                    "packet",
                    "packets_of_a_frame",
                    text(&address.count),
                    "packet.fields",
                ));
            }
            if let Some(samples) = self.samples {
                let frames = format!(
                    "{}, {} ms apart",
                    samples.count,
                    short(samples.every_ns * 1e-6)
                );
                facts.push(fact(
                    "packet",
                    "frames_of_a_packet",
                    text(&frames),
                    "packet.samples",
                ));
            }
            if let Some(check) = &layout.check {
                facts.push(fact(
                    "packet",
                    "check",
                    text(check.kind.name()),
                    "packet.check",
                ));
            }
        }
        if let (Some(bytes), Some(rate)) = (self.bytes_per_frame(), self.rate) {
            let value = number(bytes as f64 * rate, "bytes_per_s", "bytes/s", 1.0);
            facts.push(fact("packet", "throughput", value, "packet, rate"));
        }
    }

    fn value_facts(&self, facts: &mut Vec<Fact>) {
        let names: Vec<&str> = self.names().collect();
        facts.push(fact(
            "values",
            "channels",
            text(&names.len()),
            "packet, wiring",
        ));
        facts.push(fact(
            "values",
            "names",
            text(&shortened(&names)),
            "packet, wiring",
        ));
        let mut groups: Vec<(String, Vec<&str>)> = Vec::new();
        for (channel, place) in self.channels().zip(self.wired()) {
            let about = self.about_value(place, &channel.unit.symbol);
            match groups.iter_mut().find(|(other, _)| *other == about) {
                Some((_, names)) => names.push(&channel.name),
                None => groups.push((about, vec![&channel.name])),
            }
        }
        for (about, names) in groups {
            facts.push(fact(
                "values",
                shortened(&names),
                text(&about),
                "packet.fields",
            ));
        }
    }

    /// Unit, step and ends of a value.
    fn about_value(&self, place: usize, symbol: &str) -> String {
        let Some((kind, conversion)) = self.conversion(place) else {
            return symbol.to_owned();
        };
        let unit = self.values[place].unit.si_per_unit;
        let mut about = match kind {
            Some(kind) => format!("{kind}, {symbol}"),
            None => symbol.to_owned(),
        };
        if kind.is_some_and(|kind| !kind.is_float()) {
            about.extend([", steps of ", &short(conversion.scale.abs() / unit)]);
        }
        if let Some([low, high]) = conversion.range {
            about.extend([", ", &short(low / unit), " to ", &short(high / unit)]);
        }
        about
    }

    fn detection_facts(&self, facts: &mut Vec<Fact>) {
        let detection = self.detection();
        let mut add = |name: &str, value: String, from: &'static str| {
            facts.push(fact("wire", name, text(&value), from));
        };
        add(
            "class",
            format!(
                "{}: {}",
                detection.class.letter(),
                detection.class.meaning()
            ),
            "framing, packet",
        );
        let damage = if detection.class == Class::A {
            "damaged at random"
        } else {
            "with one byte changed at random"
        };
        add(
            "damage_passes",
            format!("{} of the packets {damage}", short(detection.byte_passes)),
            "framing, packet",
        );
        let counter = match (detection.counter, self.rate) {
            (None, _) => "no counter: lost frames are estimated from rate and silence".to_owned(),
            (Some(u64::MAX), _) => {
                "a counter without an end: every lost frame is counted".to_owned()
            }
            (Some(numbers), Some(rate)) => format!(
                "{numbers} numbers: a gap of more than {} s is told by its time",
                short(numbers as f64 / rate / 2.0)
            ),
            (Some(numbers), None) => {
                format!("{numbers} numbers; without a rate long gaps are ambiguous")
            }
        };
        add("lost_frames", counter, "packet.fields");
        let clock = match (detection.clock, detection.counter, self.rate) {
            (true, _, _) => "of the board",
            (false, Some(_), Some(_)) => "counter times the stated rate",
            _ => "arrival at this computer",
        };
        add("device_time", clock.to_owned(), "packet.fields");
        let delay = match self.link.delay {
            Some([least, most]) => format!("{} to {} ms", short(1e3 * least), short(1e3 * most)),
            None => "not known, at least 0: stamps that go one way cannot show it".to_owned(),
        };
        add("delay", delay, "link.delay");
    }
}

/// When a frame of messages is complete.
fn frame_end(messages: &MessageFormat) -> String {
    let rule = &messages.rule;
    let needed = rule.required.iter().filter(|required| **required).count();
    let mut end = match rule.ends_with {
        None if needed == 1 => "with each message".into(),
        None => format!("when all {needed} messages have come"),
        Some(slot) => {
            let of = |message: &&MessageLayout| {
                (message.first_slot..message.first_slot + message.slots()).contains(&slot)
            };
            let message = messages.messages.iter().find(of);
            let id = message.and_then(|message| {
                let number = (slot - message.first_slot) / message.addresses;
                message.ids.get(number).map(ToString::to_string)
            });
            let last = id.unwrap_or_else(|| "the last".into());
            format!("with the message {last}, if all {needed} have come")
        }
    };
    if let Some(within) = rule.within_ns {
        end.extend([", within ", &short(within as f64 * 1e-6), " ms"]);
    }
    end
}

fn hexadecimal(bytes: &[u8]) -> String {
    let digits: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    digits.join(" ")
}

/// Three significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        let digits = 2 - value.abs().log10().floor().clamp(-6.0, 9.0) as i32;
        let scale = 10_f64.powi(digits);
        ((value * scale).round() / scale).to_string()
    } else {
        format!("{value:.2e}")
    }
}
