//! Arrays of numbers whose first axis is time: NPY and NPZ, and what HDF5 makes of its data sets.

use super::bytes::Bytes;
use super::definition::Number;
use super::{Channel, Container, Fault, Part, Rows, Series, Times, unpack};
use crate::mcap::Fields;
use crate::recording::MOST_TAXELS;

/// Rows by whose numbers it is decided what the channels are, as in a table.
const SAMPLE: u64 = 64;

/// An array in a file.
#[derive(Debug)]
pub(super) struct Array {
    pub(super) name: String,
    pub(super) shape: Vec<u64>,
    pub(super) item: Item,
    /// The first index runs fastest.
    pub(super) fortran: bool,
    pub(super) data: Data,
}

/// What stands in one place of an array: a number, or several with names.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Item {
    pub(super) size: usize,
    pub(super) fields: Vec<ItemField>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct ItemField {
    pub(super) name: String,
    pub(super) number: Number,
    pub(super) big: bool,
    pub(super) offset: usize,
    pub(super) count: usize,
}

/// Where the bytes of an array are.
#[derive(Debug)]
pub(super) enum Data {
    File(u64),
    /// Compressed bytes of a member of a zip: offset, their number, and that of the member with
    /// its head.
    Packed {
        offset: u64,
        size: u64,
        length: u64,
        head: u64,
    },
    Memory(Vec<u8>),
    Stripes(Box<dyn Stripes>),
}

/// An array whose rows are put together from pieces.
pub(super) trait Stripes: std::fmt::Debug + Send {
    /// The bytes of a row of an array of this shape.
    fn row(
        &mut self,
        bytes: &mut Bytes,
        row: u64,
        shape: &[u64],
        item: usize,
    ) -> Result<&[u8], Fault>;
}

impl Array {
    /// Rows along the first axis.
    fn rows(&self) -> u64 {
        self.shape.first().copied().unwrap_or(0)
    }

    /// Items of a row.
    fn items(&self) -> Option<u64> {
        let rest = self.shape.get(1..).unwrap_or_default();
        rest.iter()
            .try_fold(1_u64, |all, side| all.checked_mul(*side))
    }

    fn numbers(&self) -> usize {
        self.item.fields.iter().map(|field| field.count).sum()
    }

    /// Bytes of all.
    pub(super) fn length(&self) -> Option<u64> {
        self.rows()
            .checked_mul(self.items()?)?
            .checked_mul(self.item.size as u64)
    }

    /// Channels of a row.
    fn channels(&self) -> Option<u64> {
        self.items()?.checked_mul(self.numbers() as u64)
    }

    fn kind(&self) -> String {
        let kind = match &self.item.fields[..] {
            [one] if one.name.is_empty() => {
                let word = match one.number {
                    Number::Unsigned(_) => "uint",
                    Number::Signed(_) => "int",
                    Number::Float(_) => "float",
                };
                format!("{word}{}", 8 * one.number.size())
            }
            [] => "no numbers".to_owned(),
            fields => format!("{} fields", fields.len()),
        };
        let shape: Vec<_> = self.shape.iter().map(u64::to_string).collect();
        format!("{kind} {}", shape.join(" x "))
    }

    fn unread(&self) -> Option<String> {
        let most = 4 * MOST_TAXELS;
        Some(match (self.channels(), self.length()) {
            _ if self.shape.is_empty() => "it is one number".into(),
            _ if self.item.fields.is_empty() => "it has no numbers".into(),
            (None, _) | (_, None) => "its shape is impossible".into(),
            (Some(channels), _) if channels == 0 || channels > most => {
                format!("{channels} numbers a row are no frame: its first axis would be time")
            }
            _ => return None,
        })
    }

    /// Names of the channels.
    fn names(&self, alone: bool) -> Vec<String> {
        let begin = if alone { "" } else { self.name.as_str() };
        let items = self.items().unwrap_or(0);
        let mut names = Vec::new();
        for item in 0..items {
            let place = if self.shape.len() < 2 {
                begin.to_owned()
            } else {
                let mut rest = item;
                let mut indices = Vec::new();
                for side in self.shape[1..].iter().rev() {
                    indices.push(rest % side);
                    rest /= side;
                }
                let indices: Vec<_> = indices.iter().rev().map(u64::to_string).collect();
                format!("{begin}[{}]", indices.join(","))
            };
            for field in &self.item.fields {
                let dot = if field.name.is_empty() || place.is_empty() {
                    ""
                } else {
                    "."
                };
                let name = format!("{place}{dot}{}", field.name);
                if field.count == 1 {
                    names.push(name);
                } else {
                    names.extend((0..field.count).map(|at| format!("{name}[{at}]")));
                }
            }
        }
        names
    }

    /// Rows, columns and channels of a taxel.
    fn taxels(&self) -> Option<[usize; 3]> {
        let side = |at: usize| self.shape.get(at).map(|side| *side as usize);
        if self.numbers() != 1 {
            return None;
        }
        match (self.shape.len(), side(1), side(2), side(3)) {
            (3, Some(rows), Some(columns), None) => Some([rows, columns, 1]),
            (4, Some(rows), Some(columns), Some(each @ (1 | 3 | 4))) => Some([rows, columns, each]),
            _ => None,
        }
    }
}

/// Arrays that lie in one file.
#[derive(Debug)]
pub(super) struct ArrayFile {
    bytes: Bytes,
    arrays: Vec<Array>,
    parts: Vec<Part>,
    /// Arrays of each part.
    members: Vec<Vec<usize>>,
    cut: Option<String>,
}

impl ArrayFile {
    /// Arrays of one axis and of the same length are one part together.
    pub(super) fn of(
        bytes: Bytes,
        arrays: Vec<Array>,
        others: Vec<Part>,
        cut: Option<String>,
    ) -> Box<dyn Container> {
        let mut parts = Vec::new();
        let mut members: Vec<Vec<usize>> = Vec::new();
        let is_series = |array: &Array| {
            array.shape.len() == 1 && array.unread().is_none() && array.numbers() == 1
        };
        let folder = |array: &Array| {
            array
                .name
                .rsplit_once('/')
                .map_or("", |(folder, _)| folder)
                .to_owned()
        };
        let wide: Vec<u64> = arrays
            .iter()
            .filter(|array| array.unread().is_none() && !is_series(array))
            .map(Array::rows)
            .collect();
        for (at, array) in arrays.iter().enumerate() {
            let joined = members.iter().position(|known| {
                let first = &arrays[known[0]];
                is_series(array)
                    && is_series(first)
                    && array.rows() == first.rows()
                    && folder(array) == folder(first)
            });
            if let Some(joined) = joined {
                members[joined].push(at);
                let names: Vec<_> = members[joined]
                    .iter()
                    .map(|at| arrays[*at].name.as_str())
                    .collect();
                let part: &mut Part = &mut parts[joined];
                part.name = names.join("+");
                part.kind = format!("{} series of {}", names.len(), array.rows());
                continue;
            }
            members.push(vec![at]);
            parts.push(Part {
                name: array.name.clone(),
                kind: array.kind(),
                count: array.rows(),
                rate: None,
                unread: array.unread(),
            });
        }
        // Series as long as an array of several axes are its times and what was read beside it.
        for (part, known) in parts.iter_mut().zip(&members) {
            let first = &arrays[known[0]];
            if is_series(first)
                && wide.contains(&first.rows())
                && known.len() == 1
                && part.unread.is_none()
            {
                part.unread = Some("it is as long as another array, whose times it may be".into());
            }
        }
        parts.extend(others);
        Box::new(Self {
            bytes,
            arrays,
            parts,
            members,
            cut,
        })
    }

    /// Brings into memory what cannot be read in place.
    fn ready(&mut self, at: usize) -> Result<(), Fault> {
        let array = &mut self.arrays[at];
        let cut = || Fault::Cut(format!("the bytes of {} are not all there", array.name));
        let wanted = array.length().ok_or_else(cut)?;
        match array.data {
            Data::Packed {
                offset,
                size,
                length,
                head,
            } => {
                let packed = self.bytes.get(offset, size)?.ok_or_else(cut)?;
                let mut unpacked = unpack::deflate(packed, length).ok_or_else(|| {
                    Fault::Wrong(format!(
                        "{} is damaged, or larger than {} bytes",
                        array.name,
                        unpack::LONGEST
                    ))
                })?;
                if unpacked.len() as u64 != head.saturating_add(wanted) {
                    return Err(cut());
                }
                unpacked.drain(..head as usize);
                array.data = Data::Memory(unpacked);
            }
            Data::File(offset) if array.fortran && array.shape.len() > 1 => {
                let bytes = self.bytes.get(offset, wanted)?.ok_or_else(cut)?;
                array.data = Data::Memory(bytes.to_vec());
            }
            _ => {}
        }
        Ok(())
    }

    /// Appends a row of an array.
    fn row(&mut self, at: usize, row: u64, out: &mut Vec<f64>) -> Result<(), Fault> {
        let array = &mut self.arrays[at];
        let items = array.items().unwrap_or(0);
        let size = array.item.size as u64;
        let cut = || {
            Fault::Cut(format!(
                "the file ends before row {} of {}",
                row + 1,
                array.name
            ))
        };
        let put = |item: &[u8], out: &mut Vec<f64>| {
            for field in &array.item.fields {
                let bytes = item.get(field.offset..).unwrap_or_default();
                let numbers = bytes.chunks_exact(field.number.size()).take(field.count);
                out.extend(numbers.map(|number| field.number.value(number, field.big)));
            }
        };
        let length = items * size;
        match &mut array.data {
            Data::Memory(bytes) if array.fortran => {
                let rows = array.shape[0];
                let sides = &array.shape[1..];
                for item in 0..items {
                    // Indices as they count up, the last one fastest, to the place with the first one fastest.
                    let (mut rest, mut place, mut step) = (item, row, rows);
                    let mut indices = vec![0; sides.len()];
                    for (index, side) in indices.iter_mut().zip(sides).rev() {
                        *index = rest % side;
                        rest /= side;
                    }
                    for (index, side) in indices.iter().zip(sides) {
                        place += index * step;
                        step *= side;
                    }
                    let begin = (place * size) as usize;
                    put(
                        bytes.get(begin..begin + size as usize).ok_or_else(cut)?,
                        out,
                    );
                }
            }
            Data::Memory(bytes) => {
                let begin = (row * length) as usize;
                let row = bytes.get(begin..begin + length as usize).ok_or_else(cut)?;
                row.chunks_exact(size as usize)
                    .for_each(|item| put(item, out));
            }
            Data::File(offset) => {
                let row = self
                    .bytes
                    .get(offset.saturating_add(row * length), length)?
                    .ok_or_else(cut)?;
                row.chunks_exact(size as usize)
                    .for_each(|item| put(item, out));
            }
            Data::Stripes(chunks) => {
                let row = chunks.row(&mut self.bytes, row, &array.shape, array.item.size)?;
                row.chunks_exact(size as usize)
                    .for_each(|item| put(item, out));
            }
            Data::Packed { .. } => return Err(cut()),
        }
        Ok(())
    }
}

impl Container for ArrayFile {
    fn parts(&self) -> &[Part] {
        &self.parts
    }

    fn cut(&self) -> Option<String> {
        self.cut.clone()
    }

    fn open(mut self: Box<Self>, at: usize) -> Result<Series, Fault> {
        let own = self.members[at].clone();
        let first = &self.arrays[own[0]];
        let (rows, shape) = (first.rows(), first.taxels());
        // Series of the same length may be its times.
        let lent: Vec<usize> = (0..self.arrays.len())
            .filter(|at| !own.contains(at))
            .filter(|at| {
                let array = &self.arrays[*at];
                array.shape == [rows] && array.numbers() == 1 && array.channels() == Some(1)
            })
            .collect();
        let alone = own.len() == 1 && (first.shape.len() > 1 || first.numbers() > 1);
        let mut channels = Vec::new();
        for at in lent.iter().chain(&own) {
            let alone = alone && own.contains(at);
            let names = self.arrays[*at].names(alone);
            channels.extend(names.into_iter().map(|name| Channel { name, unit: None }));
        }
        let all: Vec<usize> = lent.iter().chain(&own).copied().collect();
        for at in &all {
            self.ready(*at)?;
        }
        let mut rows = ArrayRows {
            file: *self,
            all,
            at: 0,
            rows,
        };
        let mut sample = Vec::new();
        while (sample.len() as u64) < SAMPLE {
            let mut row = Vec::new();
            match rows.next(&mut row) {
                Ok(Some(_)) => sample.push(row),
                _ => break,
            }
        }
        rows.at = 0;
        Ok(Series {
            channels,
            shape,
            rows: Box::new(rows),
            times: Times::Channel {
                sample,
                lent: lent.len(),
            },
        })
    }
}

/// The rows of arrays of one length.
#[derive(Debug)]
struct ArrayRows {
    file: ArrayFile,
    all: Vec<usize>,
    at: u64,
    rows: u64,
}

impl Rows for ArrayRows {
    fn next(&mut self, values: &mut Vec<f64>) -> Result<Option<i128>, Fault> {
        if self.at == self.rows {
            return Ok(None);
        }
        for place in 0..self.all.len() {
            self.file.row(self.all[place], self.at, values)?;
        }
        self.at += 1;
        Ok(Some(0))
    }
}

pub(super) fn open_npy(mut bytes: Bytes) -> Result<Box<dyn Container>, Fault> {
    let length = bytes.length();
    let begin = bytes
        .get(0, length.min(LONGEST_HEAD))?
        .unwrap_or_default()
        .to_vec();
    let (mut array, head) = npy("array", &begin)?;
    array.data = Data::File(head);
    let whole = array.length().and_then(|all| all.checked_add(head));
    let cut = whole.is_none_or(|whole| whole > length);
    let cut = cut.then(|| "the file has fewer bytes than its head says".to_owned());
    Ok(ArrayFile::of(bytes, vec![array], Vec::new(), cut))
}

/// Longest head of an array that is read, bytes: NumPy itself reads 10 000.
const LONGEST_HEAD: u64 = 1 << 16;

/// The head of an array, and its length.
fn npy(name: &str, bytes: &[u8]) -> Result<(Array, u64), Fault> {
    let wrong = || Fault::Wrong(format!("the head of {name} is not one of NumPy"));
    let mut fields = Fields(bytes);
    let read = |fields: &mut Fields<'_>| {
        fields.take(6).filter(|magic| *magic == b"\x93NUMPY")?;
        let version = fields.u8()?;
        fields.u8()?;
        let length = if version == 1 {
            u32::from(fields.u16()?)
        } else {
            fields.u32()?
        };
        let text = fields.take(length as usize)?;
        Some(String::from_utf8_lossy(text).into_owned())
    };
    let text = read(&mut fields).ok_or_else(wrong)?;
    let head = (bytes.len() - fields.0.len()) as u64;
    let value = |key: &str| {
        text.split_once(&format!("'{key}':"))
            .map(|(_, rest)| rest.trim_start())
    };
    let shape = value("shape")
        .and_then(|rest| rest.strip_prefix('('))
        .and_then(|rest| rest.split_once(')'));
    let shape = shape.ok_or_else(wrong)?.0;
    let sides = shape
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty());
    let shape: Vec<u64> = sides
        .map(|side| side.trim_end_matches('L').parse().ok())
        .collect::<Option<_>>()
        .ok_or_else(wrong)?;
    let item = value("descr").and_then(item);
    Ok((
        Array {
            name: name.to_owned(),
            shape,
            // What has no numbers is listed all the same.
            item: item.unwrap_or_default(),
            fortran: value("fortran_order").is_some_and(|rest| rest.starts_with("True")),
            data: Data::Memory(Vec::new()),
        },
        head,
    ))
}

/// The type of an array: `'<f8'`, or `[('t', '<f8'), ('p', '<f4', (4,))]`.
fn item(text: &str) -> Option<Item> {
    if let Some(rest) = text.strip_prefix('\'') {
        let (number, big) = code(rest.split_once('\'')?.0)?;
        let field = ItemField {
            name: String::new(),
            number,
            big,
            offset: 0,
            count: 1,
        };
        return Some(Item {
            size: number.size(),
            fields: vec![field],
        });
    }
    let mut rest = text.strip_prefix('[')?;
    let mut item = Item::default();
    while let Some((_, after)) = rest
        .split_once('(')
        .filter(|(before, _)| !before.contains(']'))
    {
        let mut words = after.split('\'');
        let name = words.nth(1)?;
        let kind = words.nth(1)?;
        let after = words.next()?;
        let behind = &rest[after.as_ptr() as usize - rest.as_ptr() as usize..];
        let inner = behind.trim_start_matches([',', ' ']);
        let (count, end) = match inner.strip_prefix('(') {
            None => (1, behind.split_once(')')?.1),
            Some(inner) => {
                let (sides, end) = inner.split_once(')')?;
                let sides = sides
                    .split(',')
                    .map(str::trim)
                    .filter(|side| !side.is_empty());
                let count = sides
                    .map(|side| side.parse::<usize>().ok())
                    .try_fold(1_usize, |all, side| all.checked_mul(side?));
                (count?, end.split_once(')')?.1)
            }
        };
        let bytes = if let Some((number, big)) = code(kind) {
            item.fields.push(ItemField {
                name: name.to_owned(),
                number,
                big,
                offset: item.size,
                count,
            });
            number.size()
        } else {
            // Text is passed over: `|S8`, `<U8` of four bytes each.
            let kind = kind.trim_start_matches(['<', '>', '|', '=']);
            let size = kind.get(1..)?.parse::<usize>().ok()?;
            size.checked_mul(if kind.starts_with('U') { 4 } else { 1 })?
        };
        item.size = item.size.checked_add(bytes.checked_mul(count)?)?;
        rest = end;
    }
    (item.size > 0).then_some(item)
}

fn code(text: &str) -> Option<(Number, bool)> {
    let big = text.starts_with('>');
    let text = text.trim_start_matches(['<', '>', '|', '=']);
    let size = text.get(1..)?.parse::<usize>().ok()?;
    let number = match text.as_bytes()[0] {
        b'f' if [2, 4, 8].contains(&size) => Number::Float(size),
        b'i' if [1, 2, 4, 8].contains(&size) => Number::Signed(size),
        b'u' | b'b' if [1, 2, 4, 8].contains(&size) => Number::Unsigned(size),
        _ => return None,
    };
    Some((number, big))
}

/// Files in an archive that are listed.
const MOST_MEMBERS: usize = 10_000;

pub(super) fn open_npz(mut bytes: Bytes) -> Result<Box<dyn Container>, Fault> {
    let members = directory(&mut bytes)?;
    let mut arrays = Vec::new();
    for member in members {
        let Some(name) = member.name.strip_suffix(".npy") else {
            continue;
        };
        let wrong = |what: &str| Fault::Wrong(format!("{name} {what}"));
        let local = bytes
            .array::<30>(member.at)?
            .ok_or_else(|| wrong("is missing"))?;
        let [names, extra] =
            [26, 28].map(|at| u64::from(u16::from_le_bytes([local[at], local[at + 1]])));
        let offset = member.at + 30 + names + extra;
        let begin = member.size.min(LONGEST_HEAD);
        let begin = bytes.get(offset, begin)?.ok_or_else(|| wrong("is cut"))?;
        let (array, head) = match member.method {
            0 => npy(name, begin)?,
            8 => npy(name, &unpack::beginning(begin, LONGEST_HEAD as usize))?,
            _ => return Err(wrong("is compressed in an unknown way")),
        };
        let data = match member.method {
            0 => Data::File(offset + head),
            _ => Data::Packed {
                offset,
                size: member.size,
                length: member.length,
                head,
            },
        };
        arrays.push(Array { data, ..array });
    }
    if arrays.is_empty() {
        return Err(Fault::Wrong(
            "it is a zip without arrays of NumPy; save a spreadsheet as CSV text".into(),
        ));
    }
    Ok(ArrayFile::of(bytes, arrays, Vec::new(), None))
}

struct Member {
    name: String,
    method: u16,
    size: u64,
    length: u64,
    at: u64,
}

/// The files that the directory at the end of an archive lists.
fn directory(bytes: &mut Bytes) -> Result<Vec<Member>, Fault> {
    let cut = || Fault::Cut("the directory at the end of the archive is missing".to_owned());
    // A comment of up to 64 KiB may follow.
    let tail = bytes.length().min(22 + 0xffff);
    let begin = bytes.length() - tail;
    let end = bytes.get(begin, tail)?.ok_or_else(cut)?;
    let mark = end
        .windows(4)
        .rposition(|four| four == b"PK\x05\x06")
        .ok_or_else(cut)?;
    let mut fields = Fields(&end[mark + 4..]);
    let mut read = || {
        fields.take(8)?;
        Some((fields.u32()?, fields.u32()?))
    };
    let (size, at) = read()
        .map(|(size, at)| (u64::from(size), u64::from(at)))
        .ok_or_else(cut)?;
    let listed = bytes.get(at, size)?.ok_or_else(cut)?;
    let mut fields = Fields(listed);
    let mut members = Vec::new();
    while members.len() < MOST_MEMBERS && !fields.0.is_empty() {
        let mut read = || {
            fields.take(10)?;
            let method = fields.u16()?;
            fields.take(8)?;
            let (mut size, mut length) = (u64::from(fields.u32()?), u64::from(fields.u32()?));
            let [name, extra, comment] =
                [fields.u16()?, fields.u16()?, fields.u16()?].map(usize::from);
            fields.take(8)?;
            let mut at = u64::from(fields.u32()?);
            let name = String::from_utf8_lossy(fields.take(name)?).into_owned();
            let mut extra = Fields(fields.take(extra)?);
            fields.take(comment)?;
            while let Some(kind) = extra.u16() {
                let size_of = extra.u16()?;
                let mut inner = Fields(extra.take(usize::from(size_of))?);
                if kind == 1 {
                    // Sizes of 64 bits, of those that do not fit.
                    for value in [&mut length, &mut size, &mut at] {
                        if *value == u64::from(u32::MAX) {
                            *value = inner.u64()?;
                        }
                    }
                }
            }
            Some(Member {
                name,
                method,
                size,
                length,
                at,
            })
        };
        members.push(read().ok_or_else(cut)?);
    }
    Ok(members)
}
