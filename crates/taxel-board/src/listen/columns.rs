//! What the bytes of packets of one length are: counter, clock, check, numbers.

use super::{Found, LEAST, Proposal, unit_of_clock};
use crate::check::CheckKind;

/// Bytes that are known of a packet: those of its marks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    pub(super) head: usize,
    pub(super) tail: usize,
    /// Columns before this one, and how many rows all have from the first on, or the second of those
    /// columns: so that however packets of one length are cut, the same bytes are compared.
    pub(super) turn: usize,
    pub(super) rows: usize,
    /// Bytes of an address before the marks; they count as those of the head.
    pub(super) lead: usize,
    /// Packets from a reading to the next one of the same channel.
    pub(super) lag: usize,
}

impl Cut {
    pub(super) fn new([head, tail]: [usize; 2], turn: usize, rows: usize) -> Self {
        Self {
            head,
            tail,
            turn,
            rows,
            lead: 0,
            lag: 1,
        }
    }

    /// The rows of the column `at`.
    fn rows<'a, 'b>(&self, packets: &'a [&'b [u8]], at: usize) -> &'a [&'b [u8]] {
        let own = &packets[usize::from(at < self.turn).min(packets.len())..];
        &own[..self.rows.min(own.len())]
    }
}

/// Share of the steps that must be right: the others are losses.
const RIGHT: f64 = 0.95;
/// Share of numbers that must be possible readings for floating point.
const POSSIBLE: f64 = 0.999;
/// Possible sizes of a reading in floating point, in any unit in use.
const SIZES: [f64; 2] = [1e-9, 1e9];

/// What was found in the packets.
#[derive(Debug, Default)]
pub(super) struct Described {
    fields: Vec<String>,
    check: Option<String>,
    evidence: Vec<String>,
    pub(super) found: Found,
    /// Bytes at the end of the head that may move later: the upper ones of a counter that has not yet
    /// gone through all numbers of its lower ones.
    pub(super) open: usize,
    cyclic: bool,
    /// First byte and bytes of an address behind all that moves: it is rather that of the values of the next packet.
    pub(super) behind: Option<[usize; 2]>,
    /// Least and largest address that stands before the marks.
    pub(super) leading: Option<[u64; 2]>,
    /// Its bytes.
    led: usize,
    /// The field of the marks at the begin.
    mark: String,
}

/// The field of marks at the begin, or behind so many bytes of an address: there the head says which they are.
fn mark_of(bytes: usize, led: usize) -> String {
    let is = if led == 0 { "mark" } else { "skip" };
    format!("{{ is = \"{is}\", bytes = {bytes} }}")
}

impl Described {
    /// Takes bytes at the end of the head and at the beginning of the tail, each the first and how many,
    /// for neither marks nor readings.
    pub(super) fn pass_over(&mut self, head: [usize; 2], tail: [usize; 2]) {
        for [at, count] in [head, tail].into_iter().filter(|[_, count]| *count > 0) {
            self.evidence.push(format!(
                "bytes {at} to {} have not moved: passed over, they may be marks or readings",
                at + count - 1
            ));
        }
        let skip = |count: usize| format!("{{ is = \"skip\", bytes = {count} }}");
        if head[1] > 0 {
            let lead = usize::from(self.leading.is_some());
            let mark = self
                .fields
                .get_mut(lead)
                .filter(|field| *field == &self.mark);
            if let Some(mark) = mark {
                *mark = mark_of(head[0] - self.led, self.led);
            }
            let behind = (lead + 1).min(self.fields.len());
            self.fields.insert(behind, skip(head[1]));
        }
        if tail[1] > 0 {
            let at = if self.check.is_some() {
                format!(", at = {}", tail[0])
            } else {
                String::new()
            };
            let passed = format!("{{ is = \"skip\", bytes = {}{at} }}", tail[1]);
            self.fields.push(passed);
        }
    }

    /// Puts the fields of the marks at the begin, and of an address before them, before the others.
    fn put_marks(
        &mut self,
        packets: &[&[u8]],
        cut: Cut,
        counter: Option<Counter>,
        address: Option<Cycle>,
    ) {
        let may_carry = |Counter { number, .. }: Counter| {
            let values = packets.iter().map(|packet| number.of(packet));
            number.at == cut.head && (number.big || number.bytes == 1) && values.is_sorted()
        };
        if cut.head - cut.lead > 1 && counter.is_some_and(may_carry) {
            self.open = 1;
            self.evidence.push(format!(
                "byte {} may be the upper one of the counter, which has not gone round: no mark",
                cut.head - 1
            ));
            self.fields.insert(0, "{ is = \"skip\", bytes = 1 }".into());
        }
        let head = cut.head - cut.lead - self.open;
        if head > 0 {
            self.mark = mark_of(head, cut.lead);
            self.fields.insert(0, self.mark.clone());
        }
        if let Some(address) = address.filter(|_| cut.lead > 0) {
            // A head is passed over unless a field says that it begins there.
            let field = Known::Address(address).whole();
            self.fields.insert(0, field.replace(" }", ", at = 0 }"));
        }
    }

    /// The proposal behind a framing.
    pub(super) fn proposal(self, framing: &str, mut evidence: Vec<String>) -> Proposal {
        evidence.extend(self.evidence);
        let fields: String = self
            .fields
            .iter()
            .map(|field| format!("  {field},\n"))
            .collect::<Vec<_>>()
            .concat();
        let check = self.check.unwrap_or_default();
        Proposal {
            body: format!("{framing}\n[packet]\nfields = [\n{fields}]\n{check}"),
            evidence,
            found: self.found,
            cyclic: self.cyclic,
        }
    }
}

/// A number of one or several bytes in every packet.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Number {
    at: usize,
    bytes: usize,
    big: bool,
}

impl Number {
    fn of(&self, packet: &[u8]) -> u64 {
        let bytes = &packet[self.at..self.at + self.bytes];
        let join = |whole: u64, byte: &u8| whole << 8 | u64::from(*byte);
        if self.big {
            bytes.iter().fold(0, join)
        } else {
            bytes.iter().rev().fold(0, join)
        }
    }

    fn steps(self, packets: &[&[u8]]) -> Vec<u64> {
        let mask = u64::MAX >> (64 - 8 * self.bytes);
        packets
            .windows(2)
            .map(|pair| self.of(pair[1]).wrapping_sub(self.of(pair[0])) & mask)
            .collect()
    }

    fn range(self) -> std::ops::Range<usize> {
        self.at..self.at + self.bytes
    }

    /// True if it has no byte of the other.
    fn is_apart(self, other: Self) -> bool {
        self.at >= other.range().end || other.at >= self.range().end
    }

    fn order(self) -> &'static str {
        if self.big { "big" } else { "little" }
    }
}

/// A number that goes through the same values again and again, a packet each.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cycle {
    number: Number,
    first: u64,
    step: u64,
    count: usize,
    /// False if other numbers keep step with it: a packet has one address, and these are values of one signal.
    alone: bool,
}

/// Cycles that a claim needs: the first and the last may be cut, and what is proposed must take nearly all.
const CYCLES: usize = (2.0 / (1.0 - super::TAKEN)) as usize;

/// The narrowest number that goes through the same values again and again, and does not just count through all
/// that it has.
fn cycle(packets: &[&[u8]], body: std::ops::Range<usize>) -> Option<Cycle> {
    if packets.len() < LEAST {
        return None;
    }
    let narrow = |number: &Number| number.bytes < 4;
    let found = numbers(body).filter(narrow).filter_map(|number| {
        let moves = |at: usize| packets.iter().any(|packet| packet[at] != packets[0][at]);
        if !goes_on(number, packets) || !number.range().all(moves) {
            return None;
        }
        let values: Vec<u64> = packets.iter().map(|packet| number.of(packet)).collect();
        let distinct: std::collections::BTreeSet<u64> = values.iter().copied().collect();
        let (first, last, count) = (*distinct.first()?, *distinct.last()?, distinct.len());
        let step = last.checked_sub(first)?.checked_div(count as u64 - 1)?;
        let regular = distinct
            .iter()
            .zip(0..)
            .all(|(value, place)| *value == first + place * step);
        let all_of_it = first == 0 && count as u64 * step == 1 << (8 * number.bytes);
        let next = |value: u64| if value == last { first } else { value + step };
        let right = values.windows(2).filter(|pair| pair[1] == next(pair[0]));
        let is_one = right.count() as f64 >= RIGHT * (values.len() - 1) as f64;
        let often = count * CYCLES <= values.len();
        // Of two numbers that alternate nothing says more than that.
        (count > 2 && regular && !all_of_it && is_one && often).then_some(Cycle {
            number,
            first,
            step,
            count,
            alone: true,
        })
    });
    let found: Vec<Cycle> = found.collect();
    // Of a wide number whose bytes go in cycles the narrow one is as good.
    let cycle = *found.last()?;
    let in_step = |other: &Cycle| other.count == cycle.count && other.number.is_apart(cycle.number);
    let alone = !found.iter().any(in_step);
    Some(Cycle { alone, ..cycle })
}

/// True if most steps of a number are the same and up in one of three short stretches: all else is no cycle, which
/// saves looking at all packets.
fn goes_on(number: Number, packets: &[&[u8]]) -> bool {
    // Of three numbers in turn two of three steps go up: of seven steps four do.
    let [stretch, least] = [8, 4];
    [0, packets.len() / 2, packets.len() - stretch]
        .into_iter()
        .any(|at| {
            let mut steps = number.steps(&packets[at..(at + stretch).min(packets.len())]);
            steps.sort_unstable();
            let alike = |one: &[u64]| one[0] == one[least - 1] && one[0] > 0;
            steps.windows(least).any(alike)
        })
}

impl Cycle {
    /// What is said of an address.
    fn said(&self) -> String {
        let (first, last) = (self.number.at, self.number.range().end - 1);
        format!(
            "bytes {first} to {last} go from {} by {} through {} numbers again and again: the address of a packet, so many of which make a frame",
            self.first, self.step, self.count
        )
    }

    /// True if each number is the address of a row, a finger or a module: the bytes are rather those of the
    /// packet with the same number than those of the one before. Where they do not say it, a counter begins at 0.
    fn is_address(&self, packets: &[&[u8]], body: std::ops::Range<usize>) -> bool {
        // What counts packets or time says nothing of it.
        let counter = counter(packets, body.clone(), Some(self.number));
        let mut known: Vec<Number> = counter.map(|(number, _)| number).into_iter().collect();
        known.push(self.number);
        known.extend(clock(packets, body, &known).map(|(number, ..)| number));
        let is_value = |at: &usize| known.iter().all(|known| !known.range().contains(at));
        let bits = |one: &[u8], other: &[u8]| {
            let places = (0..one.len()).filter(is_value);
            let steps = places.map(|at| f64::from(one[at].abs_diff(other[at])));
            steps.map(|step| (1.0 + step).log2()).sum::<f64>()
        };
        let gains: Vec<f64> = (packets.windows(self.count + 1))
            .map(|run| {
                let newest = run[self.count];
                bits(newest, run[self.count - 1]) - bits(newest, run[0])
            })
            .collect();
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let spread = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>();
        // Three standard errors: of a thousand wires that say nothing three are misread.
        let error = 3.0 * spread.sqrt() / count;
        mean > error || mean >= -error && self.first != 0
    }
}

/// A number that counts, and how.
#[derive(Debug, Clone, Copy)]
struct Counter {
    number: Number,
    step: u64,
    /// The number behind its largest, where that is not all of its type.
    modulus: Option<u64>,
    /// True if it counts packets, several of which make a frame.
    of_packets: bool,
}

impl Counter {
    /// What is said of it, or that there is none.
    fn said(counter: Option<&Self>) -> String {
        let Some(counter) = counter else {
            return "no counter found: lost packets are not counted".into();
        };
        let around = counter.modulus;
        let around = around.map_or(String::new(), |modulus| format!(", to below {modulus}"));
        let (first, last) = (counter.number.at, counter.number.range().end - 1);
        format!(
            "bytes {first} to {last} count up by {}{around}",
            counter.step
        )
    }
}

/// Ways in which the packets may count, the likeliest first.
fn counted(
    packets: &[&[u8]],
    body: &std::ops::Range<usize>,
    cycle: Option<Cycle>,
    address: Option<Cycle>,
) -> Vec<Counter> {
    let known = address.map(|address| address.number);
    let of = |(number, step): (Number, u64)| {
        let around = cycle.filter(|cycle| cycle.first == 0 && cycle.number == number);
        Counter {
            number,
            step,
            modulus: around.map(|cycle| cycle.step * cycle.count as u64),
            of_packets: address.is_some(),
        }
    };
    let found = counters(packets, body.clone(), known);
    if let Some(address) = address.filter(|_| found.is_empty()) {
        // One for each frame is the same in all of its packets.
        let begins = |packet: &&&[u8]| address.number.of(packet) == address.first;
        let firsts: Vec<&[u8]> = packets.iter().filter(begins).copied().collect();
        let same = |(number, _): &(Number, u64)| {
            let steps = number.steps(packets);
            let still = steps.iter().filter(|step| **step == 0).count();
            still as f64 >= RIGHT * (steps.len() - firsts.len()) as f64
        };
        let found = counters(&firsts, body.clone(), known).into_iter();
        let of_frames = |found| Counter {
            of_packets: false,
            ..of(found)
        };
        return found.filter(same).map(of_frames).collect();
    }
    let alone = cycle.filter(|cycle| {
        address.is_none() && found.is_empty() && cycle.first == 0 && cycle.step.is_power_of_two()
    });
    let alone = alone.map(|cycle| (cycle.number, cycle.step));
    found.into_iter().chain(alone).map(of).collect()
}

/// Describes the packets, all of one length.
pub(super) fn describe(packets: &[&[u8]], cut: Cut) -> Described {
    let mut found = Described::default();
    let length = packets.first().map_or(0, |packet| packet.len());
    let body = cut.head..length - cut.tail;
    let check = check(packets, cut);
    let end = check.map_or(body.end, |(_, _, at, _)| at);
    found.evidence.push(match check {
        Some((kind, ..)) => format!("{} holds in all of {} packets", kind.name(), packets.len()),
        None => "no check found: damage of a value is not seen".into(),
    });
    let body = body.start..end;
    let cycle = if cut.lead > 0 {
        cycle(packets, 0..cut.lead)
    } else {
        cycle(packets, body.clone())
    };
    let address = cycle.filter(|cycle| cycle.alone && cycle.is_address(packets, body.clone()));
    found.cyclic = cycle.is_some();
    let counters = counted(packets, &body, cycle, address);
    let widest = counters.first().map(|counter| counter.number);
    let taken = widest
        .into_iter()
        .chain(address.map(|address| address.number));
    let clock = clock(packets, body.clone(), &taken.collect::<Vec<_>>());
    let cut = Cut {
        lag: address.map_or(1, |address| address.count),
        ..cut
    };
    // One before the marks is no part of the body.
    let within = address.filter(|_| cut.lead == 0);
    // Still bytes above a counter are its own, or the first bytes of a value.
    let counters = counters.into_iter().map(Some);
    let counters = counters.chain(widest.is_none().then_some(None));
    let laid_out = counters.map(|counter| {
        (
            counter,
            laid_out(
                packets,
                cut,
                &body,
                [
                    counter.map(Known::Counter),
                    within.map(Known::Address),
                    clock.map(Known::Clock),
                ],
            ),
        )
    });
    let best = laid_out.min_by(|(_, (_, one)), (_, (_, other))| one.total_cmp(other));
    let Some((counter, (fields, bits))) = best else {
        return found;
    };
    found.fields = fields;
    found.evidence.push(Counter::said(counter.as_ref()));
    found.evidence.extend(address.map(|address| address.said()));
    let last = |address: Cycle| address.first + address.step * (address.count as u64 - 1);
    found.behind = address
        .filter(|address| {
            // Behind it nothing but bytes that may be marks.
            let still = |at: usize| packets.iter().all(|packet| packet[at] == packets[0][at]);
            cut.lead == 0 && (address.number.range().end..body.end).all(still)
        })
        .map(|address| [address.number.at, address.number.bytes]);
    found.leading = address
        .filter(|_| cut.lead > 0)
        .map(|address| [address.first, last(address)]);
    found.led = cut.lead;
    found.found = Found {
        check: check.is_some(),
        counter: counter.is_some() || address.is_some(),
        explained: -bits,
        clock: clock.is_some(),
        marks: cut.head - cut.lead + cut.tail,
    };
    found.put_marks(packets, cut, counter, address);
    if let Some((kind, from, at, big)) = check {
        let order = match (kind.bytes() > 1, big) {
            (true, true) => ", order = \"big\"",
            (true, false) => ", order = \"little\"",
            _ => "",
        };
        found.check = Some(format!(
            "check = {{ kind = \"{}\", over = [{from}, {at}], at = {at}{order} }}\n",
            kind.name()
        ));
        // What stands behind it is neither of a value nor of the tail.
        let behind = at + kind.bytes();
        let bytes = length - cut.tail - behind;
        if bytes > 0 {
            let skipped = format!("{{ is = \"skip\", bytes = {bytes}, at = {behind} }}");
            found.fields.push(skipped);
        }
    }
    found
}

/// A field that is no value.
#[derive(Debug, Clone, Copy)]
enum Known {
    Counter(Counter),
    Address(Cycle),
    Clock((Number, u64, &'static str)),
}

impl Known {
    fn number(&self) -> Number {
        match self {
            Self::Counter(counter) => counter.number,
            Self::Address(address) => address.number,
            Self::Clock((number, ..)) => *number,
        }
    }

    /// The field.
    fn whole(&self) -> String {
        let (number, field) = (self.number(), self.field());
        let order = if number.bytes > 1 {
            format!(", order = \"{}\"", number.order())
        } else {
            String::new()
        };
        format!("{{ {field}{order} }}")
    }

    /// The field without the order of its bytes.
    fn field(&self) -> String {
        let bits = 8 * self.number().bytes;
        let key = |name: &str, value: u64, usual: u64| {
            let said = (value != usual).then(|| format!(", {name} = {value}"));
            said.unwrap_or_default()
        };
        match self {
            Self::Counter(counter) => {
                let step = key("step", counter.step, 1);
                let modulus = key("modulus", counter.modulus.unwrap_or(0), 0);
                let counts = if counter.of_packets {
                    ", counts = \"packets\""
                } else {
                    ""
                };
                format!("is = \"sequence\", type = \"u{bits}\"{step}{modulus}{counts}")
            }
            Self::Address(address) => {
                let first = key("first", address.first, 0);
                let step = key("step", address.step, 1);
                let count = address.count;
                format!("is = \"address\", type = \"u{bits}\", count = {count}{first}{step}")
            }
            Self::Clock((_, _, unit)) => {
                format!("is = \"time\", type = \"u{bits}\", unit = \"{unit}\"")
            }
        }
    }
}

/// The fields of the packets with these that are no values, and what is left to the numbers.
fn laid_out(
    packets: &[&[u8]],
    cut: Cut,
    body: &std::ops::Range<usize>,
    known: [Option<Known>; 3],
) -> (Vec<String>, f64) {
    let mut known: Vec<Known> = known.into_iter().flatten().collect();
    known.sort_by_key(|known| known.number().at);
    let mut fields = Vec::new();
    let (mut place, mut names, mut bits) = (body.start, 1, 0.0);
    for known in known {
        let number = known.number();
        bits += values(packets, cut, place..number.at, &mut names, &mut fields);
        fields.push(known.whole());
        place = number.range().end;
    }
    bits += values(packets, cut, place..body.end, &mut names, &mut fields);
    (fields, bits)
}

/// A check that holds in all packets, with the first byte that it covers, its place and order.
fn check(packets: &[&[u8]], cut: Cut) -> Option<(CheckKind, usize, usize, bool)> {
    if packets.len() < LEAST {
        return None;
    }
    let length = packets.first()?.len();
    // Where a check may stand: before the tail, or behind the marks.
    for kind in CheckKind::ALL {
        let bytes = kind.bytes();
        let Some(last) = (length - cut.tail).checked_sub(bytes).filter(|_| bytes > 0) else {
            continue;
        };
        for at in (cut.head + 1..=last).rev().take(3) {
            for from in [0, cut.head, 1, 2, 3, 4] {
                if from + 2 > at {
                    continue;
                }
                for big in [false, true].into_iter().take(bytes) {
                    let number = Number { at, bytes, big };
                    let holds =
                        |packet: &&[u8]| u64::from(kind.of(&packet[from..at])) == number.of(packet);
                    if !packets.iter().all(holds) {
                        continue;
                    }
                    let mut values: Vec<u64> =
                        packets.iter().map(|packet| number.of(packet)).collect();
                    values.sort_unstable();
                    values.dedup();
                    // A number that hardly changes may agree by chance.
                    if values.len() > packets.len().min(256) / 4 {
                        return Some((kind, from, at, big));
                    }
                }
            }
        }
    }
    None
}

/// Numbers within the body that may be one of several bytes, the widest first.
fn numbers(body: std::ops::Range<usize>) -> impl Iterator<Item = Number> {
    let widths = [(4, false), (4, true), (2, false), (2, true), (1, false)];
    widths.into_iter().flat_map(move |(bytes, big)| {
        let places = body.start..(body.end + 1).saturating_sub(bytes);
        places.map(move |at| Number { at, bytes, big })
    })
}

/// The number that goes up by the same step from packet to packet, and the step: the widest that
/// it can be first, then the narrower ones.
fn counters(
    packets: &[&[u8]],
    body: std::ops::Range<usize>,
    known: Option<Number>,
) -> Vec<(Number, u64)> {
    let Some((widest, step)) = counter(packets, body, known) else {
        return Vec::new();
    };
    let narrower = |bytes: usize| {
        let less = widest.bytes.checked_sub(bytes)?;
        let at = widest.at + if widest.big { less } else { 0 };
        Some(Number {
            at,
            bytes,
            ..widest
        })
    };
    let still = |number: &Number| {
        let own = number.range();
        let mut others = widest.range().filter(|at| !own.contains(at));
        others.all(|at| packets.iter().all(|packet| packet[at] == packets[0][at]))
    };
    let numbers = [4, 2, 1].into_iter().filter_map(narrower).filter(still);
    // Still bytes other than zeros are a counter's only where the numbers say so.
    let takes_more = |number: &Number| {
        let still = |at: usize| packets.iter().all(|packet| packet[at] == packets[0][at]);
        number.range().any(|at| packets[0][at] != 0 && still(at))
    };
    let (less_sure, surer): (Vec<_>, Vec<_>) = numbers.partition(takes_more);
    let numbers = surer.into_iter().chain(less_sure);
    numbers.map(|number| (number, step)).collect()
}

/// The widest number that goes up by the same step from packet to packet, and the step.
fn counter(
    packets: &[&[u8]],
    body: std::ops::Range<usize>,
    known: Option<Number>,
) -> Option<(Number, u64)> {
    let mut best: Option<(Number, u64)> = None;
    let free = |number: &Number| known.is_none_or(|known| known.is_apart(*number));
    for number in numbers(body).filter(free) {
        let mut steps = number.steps(packets);
        let count = steps.len();
        if count + 1 < LEAST {
            return None;
        }
        steps.sort_unstable();
        let step = steps[count / 2];
        let same = steps.iter().filter(|found| **found == step).count();
        // A counter goes through all numbers of its type again and again; by 10 a clock goes.
        let small = (1..=16).contains(&step) && step.is_power_of_two();
        if !small || (same as f64) < RIGHT * count as f64 {
            continue;
        }
        // A wider number whose other bytes never move is the narrower one.
        let moves = |at: usize| packets.iter().any(|packet| packet[at] != packets[0][at]);
        let all_move = number.range().all(moves);
        let widest = best.is_none_or(|(best, _)| number.bytes > best.bytes);
        if widest && (all_move || is_still_above(packets, number)) {
            best = Some((number, step));
        }
    }
    best
}

/// True if the bytes of a number that do not move stand above those that do: it has just not counted so
/// far. Once the lower ones have gone round, only zeros may be its own.
fn is_still_above(packets: &[&[u8]], number: Number) -> bool {
    let mut places: Vec<usize> = number.range().collect();
    if number.big {
        places.reverse();
    }
    let moves = |at: &&usize| {
        let first = packets.first().map(|packet| packet[**at]);
        packets.iter().any(|packet| Some(packet[**at]) != first)
    };
    let moving = places.iter().take_while(moves).count();
    let goes_on = packets.iter().map(|packet| number.of(packet)).is_sorted();
    let may_be_own = |at: &usize| goes_on || packets.iter().all(|packet| packet[*at] == 0);
    let above = &places[moving..];
    moving > 0 && !above.iter().any(|at| moves(&at)) && above.iter().all(may_be_own)
}

/// The number that grows steadily, its usual step and the unit that it may have.
fn clock(
    packets: &[&[u8]],
    body: std::ops::Range<usize>,
    taken: &[Number],
) -> Option<(Number, u64, &'static str)> {
    let apart = |number: &Number| taken.iter().all(|taken| taken.is_apart(*number));
    let wide = [(8, false), (8, true)]
        .into_iter()
        .flat_map(|(bytes, big)| {
            let places = body.start..(body.end + 1).saturating_sub(bytes);
            places.map(move |at| Number { at, bytes, big })
        });
    let all = wide.chain(numbers(body.clone()).filter(|number| number.bytes > 1));
    for number in all.filter(apart) {
        let mut steps = number.steps(packets);
        let count = steps.len();
        if count + 1 < LEAST {
            return None;
        }
        steps.sort_unstable();
        let median = steps[count / 2];
        let steady = |step: &&u64| **step > median / 2 && **step < median.saturating_mul(2);
        let right = steps.iter().filter(steady).count();
        let half = 1_u64 << (8 * number.bytes - 1).min(62);
        let moves = |at: usize| packets.iter().any(|packet| packet[at] != packets[0][at]);
        let [first, second] = if number.big {
            [number.at + number.bytes - 1, number.at + number.bytes - 2]
        } else {
            [number.at, number.at + 1]
        };
        // The low bytes of a clock move; a packet lasts 0.1 ms to 10 s.
        if median > 1
            && median < half / 16
            && median < 10_000_000
            && right as f64 >= RIGHT * count as f64
            && moves(first)
            && (moves(second) || median < 16)
        {
            let unit = unit_of_clock(median as f64)?;
            return Some((number, median, unit));
        }
    }
    None
}

/// A type that a stretch of bytes may have, and how many bits its steps take.
struct Guess {
    kind: &'static str,
    bytes: usize,
    big: bool,
    cost: f64,
}

/// Fields of the values in a stretch of the packets, and what they take: bits for their steps, and
/// something for each number, so that of types with the same bits the widest is taken.
fn values(
    packets: &[&[u8]],
    cut: Cut,
    stretch: std::ops::Range<usize>,
    names: &mut usize,
    fields: &mut Vec<String>,
) -> f64 {
    let length = stretch.len();
    if length == 0 {
        return 0.0;
    }
    let kinds = [
        ("f32", 4),
        ("i32", 4),
        ("i24", 3),
        ("i16", 2),
        ("u16", 2),
        ("u8", 1),
        ("i8", 1),
    ];
    let mut best: Option<Guess> = None;
    for (kind, bytes) in kinds
        .into_iter()
        .filter(|(_, bytes)| length.is_multiple_of(*bytes))
    {
        for big in [false, true] {
            if big && bytes == 1 {
                continue;
            }
            let Some(cost) = cost(packets, cut, stretch.clone(), kind, bytes, big) else {
                continue;
            };
            if best.as_ref().is_none_or(|best| cost < best.cost - 1e-9) {
                best = Some(Guess {
                    kind,
                    bytes,
                    big,
                    cost,
                });
            }
        }
    }
    let Some(Guess {
        kind,
        bytes,
        big,
        cost,
    }) = best
    else {
        fields.push(format!("{{ is = \"skip\", bytes = {length} }}"));
        return 8.0 * length as f64;
    };
    let count = length / bytes;
    let last = *names + count - 1;
    let name = if count == 1 {
        format!("c{names}")
    } else {
        format!("c{{{names}..{last}}}")
    };
    let order = match (bytes > 1, big) {
        (false, _) => "",
        (true, true) => ", order = \"big\"",
        (true, false) => ", order = \"little\"",
    };
    fields.push(format!(
        "{{ is = \"value\", name = \"{name}\", type = \"{kind}\"{order} }}"
    ));
    *names += count;
    cost
}

/// Bits that all numbers of a type take, per packet: those of the first packet, each counted from the
/// one beside it, and then their steps. The right type has the smallest. `None` where the bytes are no such numbers.
fn cost(
    packets: &[&[u8]],
    cut: Cut,
    stretch: std::ops::Range<usize>,
    kind: &str,
    bytes: usize,
    big: bool,
) -> Option<f64> {
    let (mut sum, mut beside) = (0.0, 0.0);
    for at in stretch.step_by(bytes) {
        let number = Number { at, bytes, big };
        let value = |packet: &&[u8]| {
            let whole = number.of(packet);
            match kind {
                "f32" => f64::from(f32::from_bits(whole as u32)),
                _ if kind.starts_with('i') => {
                    let shift = 64 - 8 * bytes as u32;
                    ((whole << shift).cast_signed() >> shift) as f64
                }
                _ => whole as f64,
            }
        };
        let values: Vec<f64> = cut.rows(packets, at).iter().map(value).collect();
        let first = values.first().copied().unwrap_or(0.0);
        let apart: f64 = first - beside;
        beside = first;
        let steps = values.windows(cut.lag + 1);
        let steps = steps.map(|run| (run[cut.lag] - run[0]).abs());
        if kind == "f32" {
            let possible = |value: &&f64| {
                let size = value.abs();
                value.is_finite() && (size == 0.0 || (SIZES[0]..=SIZES[1]).contains(&size))
            };
            let possible = values.iter().filter(possible).count();
            if (possible as f64) < POSSIBLE * values.len() as f64 {
                return None;
            }
            // Steps as shares of the size: a float that is one has three bytes of noise at most.
            let size = values.iter().map(|value| value.abs()).fold(1e-30, f64::max);
            let bits = std::iter::once(apart.abs())
                .chain(steps)
                .map(|step| (1.0 + step / size * 65536.0).log2())
                .sum::<f64>();
            sum += bits / values.len().saturating_sub(1).max(1) as f64;
            continue;
        }
        let bits = std::iter::once(apart.abs()).chain(steps);
        let bits = bits.map(|step| (1.0 + step).log2()).sum::<f64>();
        sum += bits / values.len().saturating_sub(1).max(1) as f64;
    }
    Some(sum)
}
