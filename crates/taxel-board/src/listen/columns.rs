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
}

impl Cut {
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
            let mark = self
                .fields
                .first_mut()
                .filter(|field| field.contains("\"mark\""));
            if let Some(mark) = mark {
                *mark = format!("{{ is = \"mark\", bytes = {} }}", head[0]);
            }
            self.fields.insert(1.min(self.fields.len()), skip(head[1]));
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

    fn order(self) -> &'static str {
        if self.big { "big" } else { "little" }
    }
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
    let counters = counters(packets, body.clone());
    let widest = counters.first().map(|(number, _)| *number);
    let clock = clock(packets, body.clone(), widest);
    // Still bytes above a counter are its own, or the first bytes of a value.
    let counters = counters.into_iter().map(Some);
    let counters = counters.chain(widest.is_none().then_some(None));
    let laid_out = counters.map(|counter| (counter, laid_out(packets, cut, &body, counter, clock)));
    let best = laid_out.min_by(|(_, (_, one)), (_, (_, other))| one.total_cmp(other));
    let Some((counter, (fields, bits))) = best else {
        return found;
    };
    found.fields = fields;
    found.evidence.push(match counter {
        None => "no counter found: lost packets are not counted".into(),
        Some((number, step)) => format!(
            "bytes {} to {} count up by {step}",
            number.at,
            number.range().end - 1
        ),
    });
    found.evidence.extend(clock.map(|(number, median, unit)| {
        format!(
            "bytes {} to {} grow steadily, by {median} from packet to packet: a time, taken for {unit}",
            number.at,
            number.range().end - 1
        )
    }));
    found.found = Found {
        check: check.is_some(),
        counter: counter.is_some(),
        explained: -bits,
        clock: clock.is_some(),
        marks: cut.head + cut.tail,
    };
    let may_carry = |(number, _): (Number, u64)| {
        let values = packets.iter().map(|packet| number.of(packet));
        number.at == cut.head && (number.big || number.bytes == 1) && values.is_sorted()
    };
    if cut.head > 1 && counter.is_some_and(may_carry) {
        found.open = 1;
        found.evidence.push(format!(
            "byte {} may be the upper one of the counter, which has not gone round: no mark",
            cut.head - 1
        ));
        found
            .fields
            .insert(0, "{ is = \"skip\", bytes = 1 }".into());
    }
    let head = cut.head - found.open;
    if head > 0 {
        let mark = format!("{{ is = \"mark\", bytes = {head} }}");
        found.fields.insert(0, mark);
    }
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

/// The fields of the packets with this counter and clock, and what is left to the numbers.
fn laid_out(
    packets: &[&[u8]],
    cut: Cut,
    body: &std::ops::Range<usize>,
    counter: Option<(Number, u64)>,
    clock: Option<(Number, u64, &str)>,
) -> (Vec<String>, f64) {
    let mut fields = Vec::new();
    let (mut place, mut names, mut bits) = (body.start, 1, 0.0);
    for (number, field) in fields_of(counter, clock) {
        bits += values(packets, cut, place..number.at, &mut names, &mut fields);
        let order = if number.bytes > 1 {
            format!(", order = \"{}\"", number.order())
        } else {
            String::new()
        };
        fields.push(format!("{{ {field}{order} }}"));
        place = number.range().end;
    }
    bits += values(packets, cut, place..body.end, &mut names, &mut fields);
    (fields, bits)
}

/// The fields of counter and clock, in the order of their bytes.
fn fields_of(
    counter: Option<(Number, u64)>,
    clock: Option<(Number, u64, &str)>,
) -> Vec<(Number, String)> {
    let counter = counter.map(|(number, step)| {
        let bits = 8 * number.bytes;
        let step = if step == 1 {
            String::new()
        } else {
            format!(", step = {step}")
        };
        (
            number,
            format!("is = \"sequence\", type = \"u{bits}\"{step}"),
        )
    });
    let clock = clock.map(|(number, _, unit)| {
        let bits = 8 * number.bytes;
        (
            number,
            format!("is = \"time\", type = \"u{bits}\", unit = \"{unit}\""),
        )
    });
    let mut known: Vec<_> = counter.into_iter().chain(clock).collect();
    known.sort_by_key(|(number, _)| number.at);
    known
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
fn counters(packets: &[&[u8]], body: std::ops::Range<usize>) -> Vec<(Number, u64)> {
    let Some((widest, step)) = counter(packets, body) else {
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
fn counter(packets: &[&[u8]], body: std::ops::Range<usize>) -> Option<(Number, u64)> {
    let mut best: Option<(Number, u64)> = None;
    for number in numbers(body) {
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
    counter: Option<Number>,
) -> Option<(Number, u64, &'static str)> {
    let apart = |number: &Number| {
        counter.is_none_or(|counter| {
            number.at >= counter.at + counter.bytes || counter.at >= number.at + number.bytes
        })
    };
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
        let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
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
