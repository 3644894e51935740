//! Values of a frame that come in several packets, messages or lines.

use super::packet::Reading;
use crate::board::layout::FrameRule;
use crate::board::{Board, shortened};

/// What has come of a frame.
#[derive(Debug, Clone)]
pub(super) struct Assembly {
    rule: FrameRule,
    values: Vec<f64>,
    come: Vec<bool>,
    sequence: Option<u64>,
    time: Option<f64>,
    bad_status: bool,
    /// Arrival of its first packet, ns.
    began_ns: Option<u64>,
    /// True before the first whole frame of a wire that begins anywhere.
    cut: bool,
    /// True while packets are passed over whose frame has no first one.
    torn: bool,
    order: Order,
    /// The place that came first.
    first: usize,
    /// Frames of which some packets did not come.
    pub(super) incomplete: u64,
    packets: Option<PacketNumbers>,
    arrived: Arrived,
}

/// In which order the places of a frame come.
#[derive(Debug, Clone, Default)]
struct Order {
    last: Option<usize>,
    /// Packets whose place follows that of the one before, and precedes it.
    rising: u64,
    falling: u64,
}

impl Order {
    /// Takes the place of a packet, one of `places`; the place that begins a frame.
    fn begin(&mut self, place: usize, places: usize) -> usize {
        if let Some(last) = self.last.replace(place) {
            self.rising += u64::from((last + 1) % places == place);
            self.falling += u64::from((place + 1) % places == last);
        }
        if self.falling > self.rising {
            places - 1
        } else {
            0
        }
    }
}

/// What arrived, for the operator of a board whose frames are never whole.
#[derive(Debug, Clone, Default)]
struct Arrived {
    names: Vec<String>,
    /// Packets of each place.
    packets: Vec<u64>,
    whole: u64,
    /// Frames that were given up for the number of the next packet.
    numbered: u64,
}

/// Numbers of packets that follow each other through the frames.
#[derive(Debug, Clone)]
struct PacketNumbers {
    of_frame: i64,
    step: i64,
    modulus: Option<i64>,
    last: Option<i64>,
}

impl PacketNumbers {
    /// Of a board whose counter counts packets.
    fn new(board: &Board, of_frame: usize) -> Option<Self> {
        let counter = board.counter_on_wire()?;
        let whole = |number: u64| i64::try_from(number).ok();
        Some(Self {
            of_frame: of_frame.cast_signed() as i64,
            step: whole(counter.counts()[0])?,
            modulus: counter.numbers().and_then(whole),
            last: None,
        })
        .filter(|_| counter.counts_packets())
    }

    /// The number of the frame of the packet at this place.
    fn frame(&mut self, raw: u64, slot: usize) -> u64 {
        let raw = i64::try_from(raw).unwrap_or(i64::MAX);
        let number = match (self.last, self.modulus) {
            (Some(last), Some(modulus)) => {
                let ahead = (raw - last).rem_euclid(modulus);
                last + if ahead > modulus / 2 {
                    ahead - modulus
                } else {
                    ahead
                }
            }
            _ => raw,
        };
        self.last = Some(number);
        let first = number / self.step - slot.cast_signed() as i64;
        first.div_euclid(self.of_frame).max(0).cast_unsigned()
    }
}

/// A whole frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Whole {
    pub(super) values: Vec<f64>,
    pub(super) sequence: Option<u64>,
    pub(super) time: Option<f64>,
    pub(super) bad_status: bool,
}

impl Assembly {
    /// `cut` for a wire that may begin within a frame.
    pub(super) fn new(board: &Board, cut: bool) -> Self {
        let rule = board.frame_rule();
        let slots = rule.required.len();
        Self {
            values: vec![f64::NAN; board.values.len()],
            come: vec![false; rule.required.len()],
            rule,
            sequence: None,
            time: None,
            bad_status: false,
            began_ns: None,
            cut,
            torn: false,
            order: Order::default(),
            first: 0,
            incomplete: 0,
            packets: PacketNumbers::new(board, slots),
            arrived: Arrived {
                names: board.slot_names(),
                packets: vec![0; slots],
                ..Arrived::default()
            },
        }
    }

    /// Takes a packet that arrived at `host_ns`; the frame that it makes whole.
    pub(super) fn packet(&mut self, reading: &Reading, host_ns: Option<u64>) -> Option<Whole> {
        let required = self.rule.required[reading.slot];
        let begin = self.order.begin(reading.slot, self.come.len());
        self.arrived.packets[reading.slot] += 1;
        let packets = self.packets.as_mut();
        let frame = reading.sequence.zip(packets);
        let frame = frame.map(|(raw, packets)| packets.frame(raw, reading.slot));
        let sequence = frame.or(reading.sequence);
        if required && self.is_another(reading, sequence, host_ns) {
            self.give_up();
        }
        let ordered = self.rule.in_order && sequence.is_none();
        // The order has shown since it began.
        if ordered && self.begun() && self.first != begin {
            self.give_up();
        }
        if !self.begun() {
            self.first = reading.slot;
            // With what is left of one frame and the begin of the next all would have come, too.
            if ordered && reading.slot != begin {
                if !std::mem::replace(&mut self.torn, true) {
                    self.give_up();
                }
                return None;
            }
            self.torn = false;
            self.began_ns = host_ns;
        }
        let places = reading.first..reading.first + reading.values.len();
        self.values[places].copy_from_slice(&reading.values);
        self.sequence = sequence.or(self.sequence);
        self.time = reading.time.or(self.time);
        self.bad_status |= reading.bad_status;
        self.come[reading.slot] = required;
        let ends = match self.rule.ends_with {
            Some(slot) => reading.slot == slot,
            None => required,
        };
        if !ends {
            return None;
        }
        if self.come == self.rule.required {
            self.cut = false;
            self.arrived.whole += 1;
            let values = self.take();
            let whole = Whole {
                values,
                sequence: self.sequence.take(),
                time: self.time.take(),
                bad_status: std::mem::take(&mut self.bad_status),
            };
            return Some(whole);
        }
        if self.rule.ends_with.is_some() {
            self.give_up();
        }
        None
    }

    /// Why no frame has become whole, after what would have made several.
    pub(super) fn reason(&self) -> Option<String> {
        let Arrived {
            names,
            packets,
            whole,
            numbered,
        } = &self.arrived;
        let places = packets.len();
        if *whole > 0 || places < 2 || packets.iter().sum::<u64>() < 3 * places as u64 {
            return None;
        }
        let of = |arrived: bool| {
            let of_place = names.iter().zip(packets).zip(&self.rule.required);
            let found: Vec<&str> = of_place
                .filter(|((_, packets), required)| **required && (**packets > 0) == arrived)
                .map(|((name, _), _)| name.as_str())
                .collect();
            shortened(&found)
        };
        let never = of(false);
        Some(if !never.is_empty() {
            format!(
                "no frame is complete: of its {places} packets {} came, {never} never; compare first, step and count of the address, or the ids, with what the board sends",
                of(true)
            )
        } else if *numbered > 0 {
            format!(
                "no frame is complete: all of its {places} packets come, each with another number; if the board counts packets, write counts = \"packets\" for the sequence"
            )
        } else {
            format!(
                "no frame is complete: all of its {places} packets come, but not one of each in turn; compare framing.messages.frame with their order"
            )
        })
    }

    /// True if a packet belongs to another frame than what has come.
    fn is_another(
        &mut self,
        reading: &Reading,
        sequence: Option<u64>,
        host_ns: Option<u64>,
    ) -> bool {
        let late = match (self.rule.within_ns, self.began_ns, host_ns) {
            (Some(within), Some(began), Some(now)) => now.saturating_sub(began) > within,
            _ => false,
        };
        let numbered = match (self.sequence, sequence) {
            (Some(own), Some(other)) => own != other,
            _ => false,
        };
        self.arrived.numbered += u64::from(numbered && self.begun());
        self.begun() && (self.come[reading.slot] || late || numbered)
    }

    /// Packets, messages or lines of a frame.
    pub(super) fn places(&self) -> usize {
        self.come.len()
    }

    /// Values of a frame.
    pub(super) fn values(&self) -> usize {
        self.values.len()
    }

    fn begun(&self) -> bool {
        self.come.contains(&true)
    }

    fn give_up(&mut self) {
        // What was sent before the first connection was not lost.
        self.incomplete += u64::from(!std::mem::take(&mut self.cut));
        self.clear();
    }

    /// A value of a line.
    pub(super) fn put(&mut self, place: usize, value: f64) {
        self.values[place] = value;
    }

    /// The values; the next frame begins.
    pub(super) fn take(&mut self) -> Vec<f64> {
        let values = self.values.clone();
        self.next_frame();
        values
    }

    /// A new connection.
    pub(super) fn reconnect(&mut self, cut: bool) {
        self.cut = cut;
        self.torn = false;
        if let Some(packets) = &mut self.packets {
            packets.last = None;
        }
        self.clear();
        self.values.fill(f64::NAN);
    }

    /// Forgets what has come.
    pub(super) fn clear(&mut self) {
        self.next_frame();
        self.sequence = None;
        self.time = None;
        self.bad_status = false;
    }

    fn next_frame(&mut self) {
        for (value, kept) in self.values.iter_mut().zip(&self.rule.kept) {
            if !kept {
                *value = f64::NAN;
            }
        }
        self.come.fill(false);
        self.began_ns = None;
    }
}
