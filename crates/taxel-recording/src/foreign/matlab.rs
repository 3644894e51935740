//! MAT-files of MATLAB 5 to 7, which `save` writes unless it is told `-v7.3`, and of MATLAB 4 (`-v4`, and
//! `-V4` of Octave): arrays of numbers.

use super::array::{Array, ArrayFile, Data, Item, ItemField};
use super::bytes::Bytes;
use super::definition::Number;
use super::{Container, Fault, Part, unpack};
use crate::foreign_format::Mat4Head;

/// Bytes before the first element.
const HEAD: u64 = 128;
/// Types of elements: an array, and a compressed element.
const MATRIX: u32 = 14;
const PACKED: u32 = 15;

pub(super) fn open(mut bytes: Bytes) -> Result<Box<dyn Container>, Fault> {
    let order = bytes.array::<2>(126)?;
    let big = match order.as_ref().map(|order| &order[..]) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => return Err(Fault::Wrong("its head is damaged".into())),
    };
    let (mut arrays, mut others, mut cut) = (Vec::new(), Vec::new(), None);
    let mut at = HEAD;
    while at < bytes.length() {
        let whole = |at: u64| format!("the file ends before the end of the array at byte {at}");
        let Some(tag) = bytes.array::<8>(at)? else {
            cut = Some(whole(at));
            break;
        };
        let [kind, size] = [word(&tag[..4], big), word(&tag[4..], big)];
        let Some(body) = bytes.get(at + 8, u64::from(size))? else {
            cut = Some(whole(at));
            break;
        };
        at += 8 + u64::from(size);
        let unpacked;
        let matrix = match kind {
            PACKED => {
                unpacked = inflated(body);
                let of_element = |bytes| Fields { bytes, big }.element();
                unpacked.as_deref().and_then(of_element)
            }
            _ => Some((kind, body)),
        };
        match matrix {
            Some((MATRIX, body)) => match matrix_of(body, big) {
                Some(Ok(array)) => arrays.push(array),
                Some(Err(part)) => others.push(part),
                None => others.push(damaged()),
            },
            Some(_) => {}
            None => others.push(damaged()),
        }
    }
    Ok(ArrayFile::of(bytes, arrays, others, cut))
}

/// The arrays of a file of MATLAB 4: each has a head of 20 bytes, a name and its numbers.
pub(super) fn open_4(mut bytes: Bytes) -> Result<Box<dyn Container>, Fault> {
    let (mut arrays, mut others, mut cut) = (Vec::new(), Vec::new(), None);
    let mut at = 0;
    while at < bytes.length() {
        let found = bytes.array::<{ Mat4Head::LENGTH }>(at)?;
        let head = found.and_then(|found| Mat4Head::of(&found));
        let whole = head.and_then(|head| {
            let item = [8, 4, 4, 2, 2, 1][head.precision as usize];
            let parts = if head.complex { 2 } else { 1 };
            let numbers = u64::from(head.rows).checked_mul(head.columns.into())?;
            let begin = at + Mat4Head::LENGTH as u64 + u64::from(head.name);
            let end = begin.checked_add(numbers.checked_mul(item * parts)?)?;
            (end <= bytes.length()).then_some((head, begin, end))
        });
        let Some((head, begin, end)) = whole else {
            cut = Some(format!("the array at byte {at} is not whole"));
            break;
        };
        let name = bytes.get(at + Mat4Head::LENGTH as u64, head.name.into())?;
        let name = name.unwrap_or_default().split(|byte| *byte == 0).next();
        let name = String::from_utf8_lossy(name.unwrap_or_default()).into_owned();
        at = end;
        let unread = match (head.kind, head.complex) {
            (1, _) => Some("it is text"),
            (2, _) => Some("it is sparse: save full(…)"),
            (_, true) => Some("its numbers are complex"),
            _ => None,
        };
        if let Some(why) = unread {
            others.push(Part {
                name,
                kind: "array".into(),
                unread: Some(why.into()),
                ..Part::default()
            });
            continue;
        }
        let number = match head.precision {
            0 => Number::Float(8),
            1 => Number::Float(4),
            2 => Number::Signed(4),
            3 => Number::Signed(2),
            4 => Number::Unsigned(2),
            _ => Number::Unsigned(1),
        };
        let sides = [head.rows, head.columns].map(u64::from);
        arrays.push(array_of(
            name,
            sides.to_vec(),
            number,
            head.big,
            Data::File(begin),
        ));
    }
    Ok(ArrayFile::of(bytes, arrays, others, cut))
}

/// An array of numbers as MATLAB has it, the first index running fastest.
fn array_of(name: String, mut shape: Vec<u64>, number: Number, big: bool, data: Data) -> Array {
    // A row of MATLAB is a series, and so is a column.
    if let [1, length] | [length, 1] = shape[..] {
        shape = vec![length];
    }
    Array {
        name,
        shape,
        item: Item {
            size: number.size(),
            fields: vec![ItemField {
                name: String::new(),
                number,
                big,
                offset: 0,
                count: 1,
            }],
        },
        fortran: true,
        data,
    }
}

/// A whole compressed element; it says its length only inside.
fn inflated(packed: &[u8]) -> Option<Vec<u8>> {
    // DEFLATE makes no more of a byte than 1032.
    unpack::zlib(packed, (packed.len() as u64).saturating_mul(1032))
}

fn damaged() -> Part {
    Part {
        kind: "array".into(),
        unread: Some("it is damaged".into()),
        ..Part::default()
    }
}

fn word(bytes: &[u8], big: bool) -> u32 {
    let four = bytes.try_into().unwrap_or([0; 4]);
    if big {
        u32::from_be_bytes(four)
    } else {
        u32::from_le_bytes(four)
    }
}

/// The elements of an array, one after the other.
struct Fields<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl<'a> Fields<'a> {
    /// Type and bytes of the next element, each of which begins at a multiple of eight bytes.
    fn element(&mut self) -> Option<(u32, &'a [u8])> {
        let tag = self.bytes.get(..8)?;
        let first = word(&tag[..4], self.big);
        if first >> 16 != 0 {
            // Up to four bytes stand in the tag itself.
            let size = (first >> 16) as usize;
            self.bytes = &self.bytes[8..];
            return Some((first & 0xffff, tag.get(4..4 + size)?));
        }
        let size = word(&tag[4..], self.big) as usize;
        let body = self.bytes.get(8..size.checked_add(8)?)?;
        let end = (8 + size).next_multiple_of(8).min(self.bytes.len());
        self.bytes = &self.bytes[end..];
        Some((first, body))
    }
}

/// The type of numbers.
fn number(kind: u32) -> Option<Number> {
    Some(match kind {
        1 => Number::Signed(1),
        2 => Number::Unsigned(1),
        3 => Number::Signed(2),
        4 => Number::Unsigned(2),
        5 => Number::Signed(4),
        6 => Number::Unsigned(4),
        7 => Number::Float(4),
        9 => Number::Float(8),
        12 => Number::Signed(8),
        13 => Number::Unsigned(8),
        _ => return None,
    })
}

/// An array of numbers, or why it is none; `None` where it is damaged.
fn matrix_of(body: &[u8], big: bool) -> Option<Result<Array, Part>> {
    let mut fields = Fields { bytes: body, big };
    let (_, flags) = fields.element()?;
    let flags = word(flags.get(..4)?, big);
    let (_, sides) = fields.element()?;
    let sides = sides.chunks_exact(4).map(|side| u64::from(word(side, big)));
    let shape: Vec<u64> = sides.collect();
    let (_, name) = fields.element()?;
    let name = String::from_utf8_lossy(name).into_owned();
    let class = flags & 0xff;
    // Classes 6 to 15 are numbers; the bit of complex ones is 2048.
    if !(6..=15).contains(&class) || flags & 2048 != 0 {
        let why = match class {
            1..=3 => "cells, structures and objects are not read: save their arrays by themselves",
            4 => "it is text",
            5 => "it is sparse: save full(…)",
            _ => "its numbers are complex, or it is a function",
        };
        return Some(Err(Part {
            name,
            kind: "array".into(),
            unread: Some(why.into()),
            ..Part::default()
        }));
    }
    let (kind, data) = fields.element()?;
    // MATLAB saves numbers in the smallest type that holds them all.
    let number = number(kind)?;
    Some(Ok(array_of(
        name,
        shape,
        number,
        big,
        Data::Memory(data.to_vec()),
    )))
}
