//! A packet of bytes: where each number stands and what it means.

use std::collections::BTreeMap;

use super::ValueOfBoard;
use super::field::{Field, Type};
use super::order::Order;
use crate::check::CheckKind;
use crate::pattern::BytePattern;

/// A packet of bytes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PacketLayout {
    /// Its bytes.
    pub(crate) length: usize,
    pub(crate) fields: Vec<PlacedField>,
    pub(crate) check: Option<PlacedCheck>,
    /// Values of one packet.
    pub(crate) values: usize,
    /// The packets of a frame, where it has several.
    pub(crate) address: Option<AddressRange>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct AddressRange {
    pub(crate) first: i64,
    /// From one to the next.
    pub(crate) step: i64,
    pub(crate) count: usize,
}

impl AddressRange {
    /// What a field says of the addresses of a frame.
    pub(crate) fn of(field: &Field) -> Self {
        let step = field.step.and_then(|step| i64::try_from(step).ok());
        Self {
            first: field.first.unwrap_or(0),
            step: step.unwrap_or(1),
            count: field.count.unwrap_or(1),
        }
    }

    /// All addresses in order.
    pub(crate) fn all(self) -> impl Iterator<Item = i64> {
        (0..self.count).map(move |slot| self.at(slot))
    }

    /// The address of this place.
    pub(crate) fn at(self, slot: usize) -> i64 {
        self.first
            .saturating_add(self.step.saturating_mul(slot.cast_signed() as i64))
    }

    /// Place of an address; `None` for one that no frame has.
    pub(crate) fn slot(self, address: i64) -> Option<usize> {
        let behind = address.checked_sub(self.first)?;
        let slot = usize::try_from(behind / self.step).ok()?;
        (behind % self.step == 0 && slot < self.count).then_some(slot)
    }

    /// The values of all packets, with the address behind the name of each of `own`.
    pub(crate) fn values(self, own: &[ValueOfBoard]) -> Vec<ValueOfBoard> {
        let named = |address: i64| {
            own.iter().map(move |value| ValueOfBoard {
                name: format!("{}.{address}", value.name),
                unit: value.unit.clone(),
            })
        };
        self.all().flat_map(named).collect()
    }
}

/// When the packets or messages of a frame make it whole.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameRule {
    /// Those that it must have, place by place.
    pub(crate) required: Vec<bool>,
    /// Values that stay until they come again.
    pub(crate) kept: Vec<bool>,
    /// The place that ends it; without one, it ends when all have come.
    pub(crate) ends_with: Option<usize>,
    /// Longest time from the first to the last, ns.
    pub(crate) within_ns: Option<u64>,
    /// True if they come in the order of their addresses, up or down, so that without a number the first or last begins
    /// a frame.
    pub(crate) in_order: bool,
}

impl FrameRule {
    /// All of `packets` with `values` together.
    pub(crate) fn all(packets: usize, values: usize) -> Self {
        Self {
            required: vec![true; packets],
            kept: vec![false; values],
            ends_with: None,
            within_ns: None,
            in_order: false,
        }
    }
}

/// A check at its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlacedCheck {
    pub(crate) kind: CheckKind,
    pub(crate) over: [usize; 2],
    /// Bytes from the end of the packet to the first of the check.
    pub(crate) from_end: usize,
    pub(crate) order: Order,
}

/// A number at its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlacedField {
    /// First bit from the beginning of the packet.
    pub(crate) bit: usize,
    pub(crate) kind: Type,
    pub(crate) order: Order,
    pub(crate) role: Role,
}

/// What a number is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Role {
    /// The value of this place.
    Value(usize, Conversion),
    Sequence(Counting),
    /// Time; nanoseconds of one step.
    Time(f64),
    Status(Status),
    Address,
    /// Bytes that stand there.
    Mark(BytePattern),
}

/// Number to value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Conversion {
    pub(crate) mask: Option<u64>,
    pub(crate) shift: u32,
    pub(crate) invert_from: Option<f64>,
    /// Numbers that stand for a missing value, from the first to the second of each pair.
    pub(crate) missing: Vec<[f64; 2]>,
    /// Words that stand for a missing value, in text.
    pub(crate) missing_words: Vec<String>,
    /// SI value of one step.
    pub(crate) scale: f64,
    /// SI value of 0.
    pub(crate) offset: f64,
    /// SI.
    pub(crate) range: Option<[f64; 2]>,
}

/// How a counter counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counting {
    /// From one number to the next.
    pub(crate) step: u64,
    /// Number at which it begins again, where its type does not say it.
    pub(crate) modulus: Option<u64>,
    /// Frames of the same number.
    pub(crate) repeats: u64,
    /// True if each packet of a frame has its own number.
    pub(crate) packets: bool,
}

impl Counting {
    /// One by one.
    pub(crate) const PLAIN: Self = Self {
        step: 1,
        modulus: None,
        repeats: 1,
        packets: false,
    };
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Status {
    pub(crate) name: String,
    pub(crate) good: Vec<u64>,
    pub(crate) bits: BTreeMap<String, u32>,
}

impl Conversion {
    /// Counts as they are.
    pub(crate) fn plain() -> Self {
        Self {
            mask: None,
            shift: 0,
            invert_from: None,
            missing: Vec::new(),
            missing_words: Vec::new(),
            scale: 1.0,
            offset: 0.0,
            range: None,
        }
    }

    /// The value of a number, SI; NaN where it is missing; `None` outside its range.
    pub(crate) fn value(&self, number: f64) -> Option<f64> {
        let stands = |[low, high]: &[f64; 2]| (*low..=*high).contains(&number);
        if self.missing.iter().any(stands) {
            return Some(f64::NAN);
        }
        let number = match self.mask {
            // The bits of a number below zero are those of its complement.
            Some(mask) if number < 0.0 => ((number as i64).cast_unsigned() & mask) as f64,
            Some(mask) => (number as u64 & mask) as f64,
            None => number,
        };
        let number = match self.shift {
            0 => number,
            shift => (number / f64::from(shift).exp2()).floor(),
        };
        let number = self.invert_from.map_or(number, |from| from - number);
        let value = number * self.scale + self.offset;
        if !value.is_finite() {
            return None;
        }
        match self.range {
            Some([low, high]) if value < low || value > high => None,
            _ => Some(value),
        }
    }

    /// The number of a value, the inverse of [`Self::value`] up to rounding.
    pub(crate) fn number(&self, value: f64) -> f64 {
        if value.is_nan() {
            return self.missing.first().map_or(f64::NAN, |[low, _]| *low);
        }
        let number = (value - self.offset) / self.scale;
        let number = self.invert_from.map_or(number, |from| from - number);
        number * f64::from(self.shift).exp2()
    }
}

impl PacketLayout {
    /// Type and conversion of the value at `place` of a packet.
    pub(crate) fn value(&self, place: usize) -> Option<(Option<Type>, &Conversion)> {
        self.fields.iter().find_map(|field| match &field.role {
            Role::Value(value, conversion) if *value == place => {
                Some((Some(field.kind), conversion))
            }
            _ => None,
        })
    }

    /// How the counter counts, and its type.
    pub(crate) fn sequence(&self) -> Option<(Counting, Type)> {
        self.fields.iter().find_map(|field| match field.role {
            Role::Sequence(counting) => Some((counting, field.kind)),
            _ => None,
        })
    }

    /// Nanoseconds of one step of the clock, and its type.
    pub(crate) fn time(&self) -> Option<(f64, Type)> {
        self.fields.iter().find_map(|field| match field.role {
            Role::Time(step) => Some((step, field.kind)),
            _ => None,
        })
    }

    /// True if bytes tell it from another packet.
    pub(crate) fn has_marks(&self) -> bool {
        let is_mark = |field: &PlacedField| matches!(field.role, Role::Mark(_));
        self.fields.iter().any(is_mark)
    }
}

impl PlacedField {
    /// Its number in `packet`, which holds it; a whole number of 64 bits is rounded.
    pub(crate) fn number(&self, packet: &[u8]) -> f64 {
        match self.kind {
            Type::F32 => f64::from(f32::from_bits(self.whole(packet) as u32)),
            Type::F64 => f64::from_bits(self.whole(packet)),
            Type::Signed(_) | Type::SignedBits(_) => {
                let bits = self.kind.bits() as u32;
                let whole = self.whole(packet);
                // The sign bit is moved to the top and back.
                let shift = 64 - bits;
                ((whole << shift).cast_signed() >> shift) as f64
            }
            Type::Unsigned(_) | Type::Bits(_) | Type::Sevens(_) => self.whole(packet) as f64,
        }
    }

    /// Its bits as a whole number without sign.
    pub(crate) fn whole(&self, packet: &[u8]) -> u64 {
        let bits = self.kind.bits();
        if self.kind.is_bits() {
            return (0..bits).fold(0, |whole, n| {
                let place = self.bit + n;
                let byte = u64::from(packet[place / 8]);
                match self.order {
                    Order::Big => whole << 1 | byte >> (7 - place % 8) & 1,
                    Order::Little => whole | (byte >> (place % 8) & 1) << n,
                }
            });
        }
        let bytes = &packet[self.bit / 8..][..bits / 8];
        match self.kind {
            Type::Sevens(_) => self.order.join_bits(bytes, 7),
            _ => self.order.join(bytes),
        }
    }

    /// Writes its bits.
    pub(crate) fn put_whole(&self, whole: u64, packet: &mut [u8]) {
        let bits = self.kind.bits();
        if self.kind.is_bits() {
            for n in 0..bits {
                let place = self.bit + n;
                let (bit, mask) = match self.order {
                    Order::Big => (whole >> (bits - 1 - n) & 1, 7 - place % 8),
                    Order::Little => (whole >> n & 1, place % 8),
                };
                let byte = &mut packet[place / 8];
                *byte = *byte & !(1 << mask) | (bit as u8) << mask;
            }
            return;
        }
        let bytes = &mut packet[self.bit / 8..][..bits / 8];
        let count = bytes.len();
        for (place, byte) in bytes.iter_mut().enumerate() {
            let low = match self.order {
                Order::Little => place,
                Order::Big => count - 1 - place,
            };
            *byte = match self.kind {
                // The highest bit is none of the number.
                Type::Sevens(_) => *byte & 0x80 | (whole >> (7 * low)) as u8 & 0x7f,
                _ => (whole >> (8 * low)) as u8,
            };
        }
    }

    /// Writes a number; one that the type does not hold is its nearest. A missing number of a
    /// whole type is 0.
    pub(crate) fn put_number(&self, number: f64, packet: &mut [u8]) {
        let bits = self.kind.number_bits() as f64;
        let whole = match self.kind {
            Type::F32 => u64::from((number as f32).to_bits()),
            Type::F64 => number.to_bits(),
            Type::Signed(_) | Type::SignedBits(_) => {
                let top = (bits - 1.0).exp2();
                let within = number.round().clamp(-top, top - 1.0);
                (within as i64).cast_unsigned()
            }
            Type::Unsigned(_) | Type::Bits(_) | Type::Sevens(_) => {
                number.round().clamp(0.0, bits.exp2() - 1.0) as u64
            }
        };
        self.put_whole(whole, packet);
    }
}

impl PlacedCheck {
    /// Place of its first byte in a packet of `length` bytes.
    fn at(&self, length: usize) -> Option<usize> {
        length.checked_sub(self.from_end)
    }

    /// True if it holds in `packet`.
    pub(crate) fn holds(&self, packet: &[u8], layout_length: usize) -> bool {
        let Some(at) = self.at(packet.len()) else {
            return false;
        };
        // In a packet of another length, what it covers ends as far from its end.
        let cut = layout_length.saturating_sub(self.over[1]);
        let Some(end) = packet.len().checked_sub(cut) else {
            return false;
        };
        let Some(covered) = packet.get(self.over[0]..end) else {
            return false;
        };
        match self.kind.bytes() {
            0 => self.kind.of(covered) == 0,
            bytes => packet
                .get(at..at + bytes)
                .is_some_and(|found| self.order.join(found) == u64::from(self.kind.of(covered))),
        }
    }

    /// Writes it.
    pub(crate) fn put(&self, packet: &mut [u8]) {
        let Some(at) = self.at(packet.len()) else {
            return;
        };
        let [from, to] = self.over;
        let bytes = self.kind.bytes();
        if bytes == 0 {
            for byte in &mut packet[from..to] {
                *byte &= 0x7f;
                *byte |= ((byte.count_ones() % 2) as u8) << 7;
            }
            return;
        }
        let check = self.kind.of(&packet[from..to]);
        for place in 0..bytes {
            let low = match self.order {
                Order::Little => place,
                Order::Big => bytes - 1 - place,
            };
            packet[at + place] = (check >> (8 * low)) as u8;
        }
    }
}
