//! Ways to cut bytes into packets: between zeros, between 0xc0, at equal lengths.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::columns::{self, Cut};
use super::{LEAST, Proposal};
use crate::wire::{from_cobs, from_slip};

/// Longest packet of one length that is looked for, bytes.
const LONGEST: usize = 1024;
/// Share of the packets in which a byte must be the same to be a mark: the others are damaged.
const SAME: f64 = 0.98;
/// Share of the greatest share of marks that a shorter length needs: a multiple of the length
/// has the same marks.
const AS_GOOD: f64 = 0.7;

/// Bytes at the inner end of a head or a tail that may be those of a reading, or of a counter, which
/// have not moved so far: all but the lowest of the widest type.
const STILL_BYTES: usize = 3;
/// Bytes of a mark that are enough, where they stand once in it: beside the length they are looked for at
/// one place only.
const MARK: usize = 2;
/// Beginnings within a run of marks that are tried.
const NEAR: usize = 4;

pub(super) fn proposals(bytes: &[u8]) -> Vec<Proposal> {
    let stuffed = [
        (
            "cobs",
            0,
            "zeros (COBS)",
            from_cobs as fn(&[u8], &mut Vec<u8>) -> Option<()>,
        ),
        ("slip", 0xc0, "0xc0 (SLIP)", from_slip),
    ];
    let stuffed = stuffed
        .into_iter()
        .filter_map(|(kind, end, named, undo)| between(bytes, kind, end, named, undo));
    stuffed.chain(equal(bytes)).collect()
}

/// Stuffed packets between two ends.
fn between(
    bytes: &[u8],
    kind: &str,
    end: u8,
    named: &str,
    undo: fn(&[u8], &mut Vec<u8>) -> Option<()>,
) -> Option<Proposal> {
    let mut pieces: Vec<&[u8]> = bytes.split(|byte| *byte == end).collect();
    // The first may have begun before, the last does not end.
    pieces.pop();
    let pieces = pieces.into_iter().skip(1).filter(|piece| !piece.is_empty());
    let (mut packets, mut count) = (Vec::new(), 0_usize);
    for piece in pieces {
        count += 1;
        let mut packet = Vec::new();
        if undo(piece, &mut packet).is_some() {
            packets.push(packet);
        }
    }
    let mut lengths: BTreeMap<usize, usize> = BTreeMap::new();
    for packet in &packets {
        *lengths.entry(packet.len()).or_default() += 1;
    }
    let (length, alike) = lengths.into_iter().max_by_key(|(_, count)| *count)?;
    if alike < LEAST || (alike as f64) < SAME * count as f64 || length < 2 {
        return None;
    }
    packets.retain(|packet| packet.len() == length);
    let packets: Vec<&[u8]> = packets.iter().map(Vec::as_slice).collect();
    let evidence = format!(
        "packets of {length} bytes between {named}: {alike} of {count} pieces unpack to that"
    );
    let mut found = columns::describe(&packets, Cut::new([0, 0], 0, packets.len()));
    // The two ends are marks: packets of one length have them at theirs too.
    found.found.marks = 2;
    Some(found.proposal(&format!("\n[framing.{kind}]\n"), vec![evidence]))
}

/// A length that packets may have.
struct Candidate {
    length: usize,
    /// Places that are the same in all and may be marks.
    marks: Vec<usize>,
    /// Share of all places that are the same in all.
    share: f64,
    /// True if they are not rather readings that have not moved.
    are_marks: bool,
}

/// Packets of one length, told by bytes that are the same in all.
fn equal(bytes: &[u8]) -> Vec<Proposal> {
    let most = LONGEST.min(bytes.len() / LEAST);
    let marks = |length: usize| {
        let still = |place: usize| {
            let column = bytes[place..].iter().step_by(length);
            let value = common(column.clone());
            let (mut same, mut all) = (0_usize, 0_usize);
            for byte in column {
                all += 1;
                same += usize::from(*byte == value);
            }
            (same as f64 >= SAME * all as f64).then_some(value)
        };
        let constants: Vec<_> = (0..length).map(still).collect();
        let share = constants.iter().flatten().count() as f64 / length as f64;
        let (constants, are_marks) = without_readings(constants);
        let marks: Vec<usize> = (0..length)
            .filter(|place| constants[*place].is_some())
            .collect();
        Candidate {
            length,
            marks,
            share,
            are_marks,
        }
    };
    let found: Vec<Candidate> = (2..=most)
        .map(marks)
        // Zeros are often what no reading has reached, and no mark.
        .filter(|found| found.marks.iter().any(|place| bytes[*place] != 0))
        .collect();
    // What may be readings is a mark only where nothing else is one, and packets in which nothing moves are
    // pieces of a stretch of such readings.
    let moves = |found: &Candidate| found.are_marks && found.share < 1.0;
    let any_moves = found.iter().any(moves);
    let candidates = || found.iter().filter(|found| moves(found) || !any_moves);
    let best = candidates().map(|found| found.share).fold(0.0, f64::max);
    let mut candidates: Vec<&Candidate> = candidates()
        .filter(|found| found.share >= AS_GOOD * best)
        .collect();
    candidates.sort_by_key(|found| found.length);
    // A multiple of a length has its marks too.
    let mut lengths: Vec<usize> = Vec::new();
    candidates.retain(|Candidate { length, .. }| {
        let is_new = !lengths.iter().any(|known| length.is_multiple_of(*known));
        lengths.extend(is_new.then_some(*length));
        is_new
    });
    // What goes through the same values again and again is a mark, too, at the length of all of them.
    let parts = found.iter().filter(|part| {
        let is_part = |whole: &&Candidate| {
            part.length < whole.length && whole.length.is_multiple_of(part.length)
        };
        moves(part) && candidates.iter().any(is_part)
    });
    let parts = parts.flat_map(|part| proposals_at(bytes, part));
    let parts: Vec<_> = parts.filter(|proposal| proposal.cyclic).collect();
    let whole = candidates
        .iter()
        .flat_map(|whole| proposals_at(bytes, whole));
    whole.chain(parts).collect()
}

/// The proposals of one length.
fn proposals_at(bytes: &[u8], Candidate { length, marks, .. }: &Candidate) -> Vec<Proposal> {
    let near = beginnings(bytes, *length, marks);
    let mut found = Vec::new();
    for begin in near.iter().copied() {
        // The first or the last bytes of readings may be the same in all and no part of head or
        // tail: what the numbers say best decides.
        let trims =
            (0..=STILL_BYTES).flat_map(|head| (0..=STILL_BYTES).map(move |tail| [0, head, tail]));
        found.extend(trims.filter_map(|trims| cut_at(bytes, *length, begin, trims)));
    }
    // A mark of one byte is as long as the still end of a reading: a check tells them apart.
    let others = marks
        .iter()
        .copied()
        .filter(|at| bytes[*at] != 0 && !near.contains(at));
    let cuts = others.filter_map(|begin| cut_at(bytes, *length, begin, [0; 3]));
    found.extend(cuts.filter(|proposal| proposal.found.check));
    found
}

/// Repetitions of one to four bytes that are no mark but readings of cells that nothing touches.
const ALIKE: usize = 4;

/// The bytes that are the same in all packets without those that are rather readings that have not moved:
/// the same ones again and again. Where nothing else is the same they are kept, and it is false that these
/// are marks.
fn without_readings(constants: Vec<Option<u8>>) -> (Vec<Option<u8>>, bool) {
    let length = constants.len();
    let mut marks = constants.clone();
    for period in [1, 2, 4].into_iter().filter(|period| *period < length) {
        // How far each byte is the same as the one a period before, around the end.
        let mut run = 0;
        for place in 0..2 * length {
            let [own, before] =
                [place, place + length - period].map(|place| constants[place % length]);
            run = if own.is_some() && own == before {
                run + 1
            } else {
                0
            };
            let least = (ALIKE - 1) * period;
            let back = match run.cmp(&least) {
                Ordering::Less => 0,
                Ordering::Equal => (least + period).min(length),
                Ordering::Greater => 1,
            };
            for back in 0..back {
                marks[(place + length - back) % length] = None;
            }
        }
    }
    let is_mark = |byte: &Option<u8>| byte.is_some_and(|byte| byte != 0);
    if marks.iter().any(is_mark) {
        (marks, true)
    } else {
        (constants, false)
    }
}

/// The value that most of a column has.
fn common<'a>(column: impl Iterator<Item = &'a u8>) -> u8 {
    let mut counts = [0_u32; 256];
    for byte in column {
        counts[usize::from(*byte)] += 1;
    }
    let most = (0..=u8::MAX).max_by_key(|value| counts[usize::from(*value)]);
    most.unwrap_or(0)
}

/// Where a packet may begin, best first: behind a carriage return and a line feed, and at the
/// longest run of marks that begins with one that is not zero.
fn beginnings(bytes: &[u8], length: usize, marks: &[usize]) -> Vec<usize> {
    let is_mark = |place: usize| marks.contains(&(place % length));
    let mut found = Vec::new();
    let ends = marks.iter().find(|place| {
        bytes[**place] == b'\r' && is_mark(*place + 1) && bytes[**place + 1] == b'\n'
    });
    found.extend(ends.map(|place| (place + 2) % length));
    let run = |place: usize| (0..length).take_while(|step| is_mark(place + step)).count();
    let is_sign = |place: usize| is_mark(place) && bytes[place % length] != 0;
    let begins = |place: &&usize| is_sign(**place) && !is_sign(**place + length - 1);
    let longest = marks.iter().filter(begins).max_by_key(|place| run(**place));
    // The last bytes of a reading may be the same in all, too, before the marks.
    if let Some(longest) = longest.copied() {
        let within = (longest..longest + run(longest)).map(|place| place % length);
        found.extend(within.filter(|place| bytes[*place] != 0).take(NEAR));
    }
    found.dedup();
    found
}

/// What all packets have at their ends, behind so many bytes; so many of them are no marks.
fn ends(
    packets: &[&[u8]],
    lead: usize,
    [of_head, of_tail]: [usize; 2],
) -> Option<(Vec<u8>, Vec<u8>)> {
    let column = |place: usize| packets.iter().map(move |packet| &packet[place]);
    let constant = |place: usize| {
        let value = common(column(place));
        let same = column(place).filter(|byte| **byte == value).count();
        (same as f64 >= SAME * packets.len() as f64).then_some(value)
    };
    let (constants, _) = without_readings((0..packets[0].len()).map(constant).collect());
    let constants = &constants[lead..];
    let head: Vec<u8> = constants.iter().map_while(|byte| *byte).collect();
    // Zeros behind the marks are rather readings that are zero.
    let head = &head[..head
        .iter()
        .rposition(|byte| *byte != 0)
        .map_or(0, |last| last + 1)];
    let tail: Vec<u8> = constants[head.len()..]
        .iter()
        .rev()
        .map_while(|byte| *byte)
        .collect();
    let tail: Vec<u8> = tail
        .into_iter()
        .rev()
        .skip_while(|byte| *byte == 0)
        .collect();
    let tail = tail.get(of_tail..)?.to_vec();
    let head = head[..head.len().checked_sub(of_head)?].to_vec();
    (!head.is_empty() || !tail.is_empty()).then_some((head, tail))
}

/// Packets of one length from one beginning, with so many bytes of an address before the marks; so many of the bytes
/// with which all of them begin and end are none of the marks.
fn cut_at(
    bytes: &[u8],
    length: usize,
    begin: usize,
    [lead, trims @ ..]: [usize; 3],
) -> Option<Proposal> {
    let packets: Vec<&[u8]> = bytes[begin..].chunks_exact(length).collect();
    if packets.len() + 1 < LEAST {
        return None;
    }
    let (head, tail) = ends(&packets, lead, trims)?;
    let head = &head[..];
    let rows = (bytes.len() / length).saturating_sub(2);
    let cut = Cut {
        lead,
        ..Cut::new([lead + head.len(), tail.len()], length - begin, rows)
    };
    let whole: Vec<&[u8]> = packets
        .iter()
        .copied()
        .filter(|packet| packet[lead..].starts_with(head) && packet.ends_with(&tail))
        .collect();
    let mut found = columns::describe(&whole, cut);
    // Around and around, an address behind the values is one before the values of the next packet; but what a line
    // feed or a check ends is whole.
    if let Some([at, size]) = found
        .behind
        .filter(|_| !found.found.check && tail != *b"\r\n")
    {
        return cut_at(
            bytes,
            length,
            (begin + at) % length,
            [size, trims[0], trims[1]],
        );
    }
    let head = &head[..head.len() - found.open];
    // Of a long mark its outer bytes are enough; the inner ones may be readings that have not moved.
    let run = [&tail[..], head].concat();
    let enough = |mark: &[u8]| {
        run.windows(mark.len())
            .filter(|other| *other == mark)
            .count()
            == 1
    };
    let shortest = |most: usize, of: &dyn Fn(usize) -> Vec<u8>| {
        (MARK..most)
            .find(|length| enough(&of(*length)))
            .unwrap_or(most)
    };
    let kept = [
        shortest(head.len(), &|length| head[..length].to_vec()),
        shortest(tail.len(), &|length| tail[tail.len() - length..].to_vec()),
    ];
    let [inner_head, inner_tail] = [head.len() - kept[0], tail.len() - kept[1]];
    found.pass_over(
        [lead + kept[0], inner_head],
        [length - tail.len(), inner_tail],
    );
    let (head, tail) = (&head[..kept[0]], &tail[inner_tail..]);
    let hex = |bytes: &[u8]| {
        let digits = bytes.iter().map(|byte| format!("{byte:02x}"));
        digits.collect::<Vec<_>>().join(" ")
    };
    let mut keys = vec![format!("length = {length}")];
    let mut evidence = format!("{length} bytes");
    for (name, bytes) in [("head", head), ("tail", tail)] {
        if !bytes.is_empty() {
            let before = found.leading.filter(|_| name == "head");
            let before = before.map_or(String::new(), |[least, most]| match lead {
                1 => format!("{least:02x}-{most:02x} "),
                _ => "?? ".repeat(lead),
            });
            keys.push(format!("{name} = \"{before}{}\"", hex(bytes)));
            let marked = packets.iter().filter(|packet| match name {
                "head" => packet[lead..].starts_with(bytes),
                _ => packet.ends_with(bytes),
            });
            let said = match name {
                "head" if lead > 0 => "has an address and then",
                "head" => "begins",
                _ => "ends",
            };
            let (marked, all) = (marked.count(), packets.len());
            evidence.extend([
                ", ",
                said,
                " ",
                &hex(bytes),
                &format!(" in {marked} of {all}"),
            ]);
        }
    }
    let framing = format!("\n[framing.fixed]\n{}\n", keys.join("\n"));
    Some(found.proposal(&framing, vec![evidence]))
}
