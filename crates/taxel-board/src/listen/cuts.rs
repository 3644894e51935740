//! Ways to cut bytes into packets: between zeros, between 0xc0, at equal lengths.

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

/// Bytes before a tail that may be those of a reading.
const LAST_BYTES: usize = 1;
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
    let mut found = columns::describe(&packets, Cut { head: 0, tail: 0 });
    // The two ends are marks: packets of one length have them at theirs too.
    found.found.marks = 2;
    Some(found.proposal(&format!("\n[framing.{kind}]\n"), vec![evidence]))
}

/// Packets of one length, told by bytes that are the same in all.
fn equal(bytes: &[u8]) -> Vec<Proposal> {
    let most = LONGEST.min(bytes.len() / LEAST);
    let marks = |length: usize| -> Vec<usize> {
        (0..length)
            .filter(|place| {
                let column = bytes[*place..].iter().step_by(length);
                let value = common(column.clone());
                let (mut same, mut all) = (0_usize, 0_usize);
                for byte in column {
                    all += 1;
                    same += usize::from(*byte == value);
                }
                same as f64 >= SAME * all as f64
            })
            .collect()
    };
    let mut candidates: Vec<(usize, Vec<usize>)> = (2..=most)
        .map(|length| (length, marks(length)))
        // Zeros are often what no reading has reached, and no mark.
        .filter(|(_, marks)| marks.iter().any(|place| bytes[*place] != 0))
        .collect();
    let share = |(length, marks): &(usize, Vec<usize>)| marks.len() as f64 / *length as f64;
    let best = candidates.iter().map(share).fold(0.0, f64::max);
    candidates.retain(|candidate| share(candidate) >= AS_GOOD * best);
    candidates.sort_by_key(|(length, _)| *length);
    // A multiple of a length has its marks too.
    let mut lengths: Vec<usize> = Vec::new();
    candidates.retain(|(length, _)| {
        let is_new = !lengths.iter().any(|known| length.is_multiple_of(*known));
        lengths.extend(is_new.then_some(*length));
        is_new
    });
    let mut found = Vec::new();
    for (length, marks) in candidates {
        for begin in beginnings(bytes, length, &marks) {
            // The last byte of a reading may be the same in all and no part of the tail.
            let trims = 0..=LAST_BYTES;
            found.extend(trims.filter_map(|trim| cut_at(bytes, length, begin, trim)));
        }
    }
    found
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

/// Packets of one length from one beginning, without so many of the bytes that end all of them
/// alike.
fn cut_at(bytes: &[u8], length: usize, begin: usize, trim: usize) -> Option<Proposal> {
    let packets: Vec<&[u8]> = bytes[begin..].chunks_exact(length).collect();
    if packets.len() + 1 < LEAST {
        return None;
    }
    let column = |place: usize| packets.iter().map(move |packet| &packet[place]);
    let constant = |place: usize| {
        let value = common(column(place));
        let same = column(place).filter(|byte| **byte == value).count();
        (same as f64 >= SAME * packets.len() as f64).then_some(value)
    };
    let constants: Vec<Option<u8>> = (0..length).map(constant).collect();
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
    let tail = tail.get(trim..)?.to_vec();
    if head.is_empty() && tail.is_empty() {
        return None;
    }
    let hex = |bytes: &[u8]| {
        let digits = bytes.iter().map(|byte| format!("{byte:02x}"));
        digits.collect::<Vec<_>>().join(" ")
    };
    let mut keys = vec![format!("length = {length}")];
    let mut evidence = format!("{length} bytes");
    for (name, bytes) in [("head", head), ("tail", &tail)] {
        if !bytes.is_empty() {
            keys.push(format!("{name} = \"{}\"", hex(bytes)));
            let marked = packets.iter().filter(|packet| match name {
                "head" => packet.starts_with(bytes),
                _ => packet.ends_with(bytes),
            });
            let said = if name == "head" { "begins" } else { "ends" };
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
    let cut = Cut {
        head: head.len(),
        tail: tail.len(),
    };
    let whole: Vec<&[u8]> = packets
        .iter()
        .copied()
        .filter(|packet| packet.starts_with(head) && packet.ends_with(&tail))
        .collect();
    let found = columns::describe(&whole, cut);
    let framing = format!("\n[framing.fixed]\n{}\n", keys.join("\n"));
    Some(found.proposal(&framing, vec![evidence]))
}
