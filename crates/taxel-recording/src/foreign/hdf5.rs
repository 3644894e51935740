//! HDF5: groups and data sets of numbers, in the forms that h5py, MATLAB and PyTables write.
//!
//! What is not read is listed with its reason: strings, references, and of what only
//! `libver="latest"` writes groups of many links and data sets that grow along several axes.

mod chunk_index;

use std::collections::HashSet;

use super::array::{Array, ArrayFile, Data, Item, ItemField, Stripes};
use super::bytes::Bytes;
use super::definition::Number;
use super::{Container, Fault, Part, unpack};
use crate::mcap::Fields;

const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Address of nothing.
const UNDEFINED: u64 = u64::MAX;
/// Data sets that are listed, and links that are followed to find them.
const MOST: usize = 10_000;
/// Deepest tree of an index.
const DEEPEST: usize = 32;
/// Number of the filter that h5py calls LZF.
const LZF: u16 = 32000;
/// Why an index of chunks is not read.
const SEVERAL_AXES: &str = "it may grow along several axes in the form of libver=\"latest\", whose index is not read; h5repack FILE NEW writes the usual one";
/// Longest block of an object's head.
const LONGEST_HEAD: u64 = 1 << 24;

pub(super) fn open(bytes: Bytes) -> Result<Box<dyn Container>, Fault> {
    let mut file = File {
        bytes,
        base: 0,
        arrays: Vec::new(),
        others: Vec::new(),
        seen: HashSet::new(),
    };
    let root = file.root()?;
    file.group("", root, 0)?;
    Ok(ArrayFile::of(file.bytes, file.arrays, file.others, None))
}

struct File {
    bytes: Bytes,
    /// What addresses count from.
    base: u64,
    arrays: Vec<Array>,
    others: Vec<Part>,
    /// Heads that were visited: links may form circles.
    seen: HashSet<u64>,
}

/// What the head of an object says.
#[derive(Default)]
struct Object {
    shape: Option<Vec<u64>>,
    /// Sides that it may grow to.
    most: Option<Vec<u64>>,
    item: Option<Result<Item, &'static str>>,
    layout: Option<Layout>,
    filters: Vec<u16>,
    /// Tree and heap of the names of a group.
    table: Option<(u64, u64)>,
    links: Vec<(String, u64)>,
    dense: bool,
}

enum Layout {
    Compact(Vec<u8>),
    Contiguous(u64),
    /// Address of the tree, and sides of a chunk.
    Chunked(u64, Vec<u64>),
    /// Address of the only chunk, its bytes, and sides of the chunk.
    Single(u64, Option<u64>, Vec<u64>),
    /// An index of the newer form, its address, and sides of a chunk.
    Indexed(chunk_index::Kind, u64, Vec<u64>),
    Unread(&'static str),
}

fn damaged() -> Fault {
    Fault::Wrong("its head or index is damaged".into())
}

impl File {
    fn at(&mut self, address: u64, length: u64) -> Result<&[u8], Fault> {
        let missing = || Fault::Cut(format!("the file ends before byte {address}"));
        let offset = address.checked_add(self.base).ok_or_else(damaged)?;
        self.bytes.get(offset, length)?.ok_or_else(missing)
    }

    /// An address that lies in the file, so that what follows it can be counted.
    fn inside(&self, address: u64) -> Result<u64, Fault> {
        Some(address)
            .filter(|address| *address <= self.bytes.length())
            .ok_or_else(damaged)
    }

    /// Address of the head of the root group.
    fn root(&mut self) -> Result<u64, Fault> {
        let has_mark = self.bytes.array::<8>(0)?.is_some_and(|mark| mark == MAGIC);
        let start = if has_mark { 0 } else { 512 };
        self.base = start;
        let version = self.at(8, 1)?[0];
        let head = match version {
            0 | 1 => {
                let extra = u64::from(version) * 4;
                let sizes = self.at(13, 2)?.to_vec();
                (sizes == [8, 8]).then_some(24 + extra + 32 + 8)
            }
            2 | 3 => {
                let sizes = self.at(9, 2)?.to_vec();
                (sizes == [8, 8]).then_some(36)
            }
            _ => None,
        };
        let head = head.ok_or_else(|| {
            Fault::Wrong("its version, or the length of its addresses, is not read".into())
        })?;
        let address = self.at(head, 8)?;
        Fields(address).u64().ok_or_else(damaged)
    }

    /// Lists the data sets below a group.
    fn group(&mut self, name: &str, address: u64, depth: usize) -> Result<(), Fault> {
        if !self.seen.insert(address) || depth > DEEPEST || self.seen.len() > MOST {
            return Ok(());
        }
        let object = self.object(address)?;
        if object.shape.is_some() || object.item.is_some() {
            self.data_set(name, object)?;
            return Ok(());
        }
        if object.dense {
            self.others.push(Part {
                name: if name.is_empty() { "/".into() } else { name.to_owned() },
                kind: "group".into(),
                unread: Some("its links are in the form of libver=\"latest\", which is not read; h5repack FILE NEW writes the usual one".into()),
                ..Part::default()
            });
        }
        let mut links = object.links;
        if let Some((tree, heap)) = object.table {
            let heap = self.at(heap, 32)?;
            let place = heap.strip_prefix(b"HEAP").and_then(|rest| {
                let mut fields = Fields(rest);
                fields.take(4)?;
                let length = fields.u64()?;
                fields.u64()?;
                Some((fields.u64()?, length))
            });
            let (names, length) = place
                .filter(|(_, length)| *length < LONGEST_HEAD)
                .ok_or_else(damaged)?;
            let names = self.at(names, length)?.to_vec();
            self.symbols(tree, &names, &mut links, 0)?;
        }
        for (link, address) in links {
            let path = if name.is_empty() {
                link
            } else {
                format!("{name}/{link}")
            };
            match self.group(&path, address, depth + 1) {
                // One object that is damaged hides no other.
                Err(Fault::Wrong(why) | Fault::Cut(why)) => self.others.push(Part {
                    name: path,
                    unread: Some(why),
                    ..Part::default()
                }),
                found => found?,
            }
        }
        Ok(())
    }

    /// Links of a group in the tree of the older form.
    fn symbols(
        &mut self,
        address: u64,
        names: &[u8],
        links: &mut Vec<(String, u64)>,
        depth: usize,
    ) -> Result<(), Fault> {
        if depth > DEEPEST || links.len() > MOST {
            return Err(damaged());
        }
        let address = self.inside(address)?;
        let head = self.at(address, 8)?;
        let count = usize::from(u16::from_le_bytes([head[6], head[7]]));
        if head.starts_with(b"TREE") {
            let body = self.at(address + 24, count as u64 * 16 + 8)?.to_vec();
            for pair in body[8..].chunks_exact(16) {
                let child = Fields(pair).u64().ok_or_else(damaged)?;
                self.symbols(child, names, links, depth + 1)?;
            }
            return Ok(());
        }
        if !head.starts_with(b"SNOD") {
            return Err(damaged());
        }
        let entries = self.at(address + 8, count as u64 * 40)?.to_vec();
        for entry in entries.chunks_exact(40) {
            let mut fields = Fields(entry);
            let (Some(name), Some(object)) = (fields.u64(), fields.u64()) else {
                return Err(damaged());
            };
            let name = names
                .get(usize::try_from(name).unwrap_or(usize::MAX)..)
                .unwrap_or_default();
            let name = name.split(|byte| *byte == 0).next().unwrap_or_default();
            if object != UNDEFINED && object != 0 {
                links.push((String::from_utf8_lossy(name).into_owned(), object));
            }
        }
        Ok(())
    }

    /// The head of an object.
    fn object(&mut self, address: u64) -> Result<Object, Fault> {
        let mut object = Object::default();
        let address = self.inside(address)?;
        let head = self.at(address, 16)?.to_vec();
        // Blocks of messages, with the bytes before the body of each.
        let mut blocks;
        let wide;
        let mut tracked = false;
        if head.starts_with(b"OHDR") {
            wide = false;
            let flags = head[5];
            tracked = flags & 4 != 0;
            let mut at =
                6 + if flags & 0x20 != 0 { 16 } else { 0 } + if flags & 0x10 != 0 { 4 } else { 0 };
            let size = 1_u64 << (flags & 3);
            let length = self.at(address + at, size)?;
            let mut whole = [0; 8];
            whole[..length.len()].copy_from_slice(length);
            at += size;
            blocks = vec![(address + at, u64::from_le_bytes(whole))];
        } else if head[0] == 1 {
            wide = true;
            let length = Fields(&head[8..]).u32().ok_or_else(damaged)?;
            blocks = vec![(address + 16, u64::from(length))];
        } else {
            return Err(damaged());
        }
        let mut read = 0;
        while let Some((offset, length)) = blocks.pop() {
            read += 1;
            if length > LONGEST_HEAD || read > MOST {
                return Err(damaged());
            }
            let block = self.at(offset, length)?.to_vec();
            let mut fields = Fields(&block);
            loop {
                let mut next = || {
                    let (kind, size) = if wide {
                        let (kind, size) = (fields.u16()?, fields.u16()?);
                        fields.take(4)?;
                        (kind, size)
                    } else {
                        let (kind, size) = (u16::from(fields.u8()?), fields.u16()?);
                        fields.take(if tracked { 3 } else { 1 })?;
                        (kind, size)
                    };
                    Some((kind, fields.take(usize::from(size))?))
                };
                let Some((kind, body)) = next() else { break };
                if kind == 0x10 {
                    let mut fields = Fields(body);
                    let (offset, length) = fields.u64().zip(fields.u64()).ok_or_else(damaged)?;
                    // In the newer form a mark stands before and a sum behind.
                    blocks.push(if wide {
                        (offset, length)
                    } else {
                        (offset.saturating_add(4), length.saturating_sub(8))
                    });
                } else {
                    object.take(kind, body).ok_or_else(damaged)?;
                }
            }
        }
        Ok(object)
    }

    fn data_set(&mut self, name: &str, object: Object) -> Result<(), Fault> {
        let shape = object.shape.unwrap_or_default();
        let unread = |why: &str| Part {
            name: name.to_owned(),
            kind: "data set".into(),
            count: shape.first().copied().unwrap_or(0),
            unread: Some(why.to_owned()),
            ..Part::default()
        };
        let item = match object.item {
            Some(Ok(item)) => item,
            Some(Err(why)) => {
                self.others.push(unread(why));
                return Ok(());
            }
            None => return Ok(()),
        };
        if let Some(other) = object
            .filters
            .iter()
            .find(|filter| ![1, 2, 3, LZF].contains(*filter))
        {
            let why = format!(
                "it is compressed with filter {other}, which is not read; h5repack -f GZIP=4 FILE NEW writes one that is"
            );
            self.others.push(unread(&why));
            return Ok(());
        }
        let sides = |all: Vec<u64>| all.len() == shape.len() && all.iter().all(|side| *side > 0);
        let data = match object.layout {
            Some(Layout::Compact(bytes)) => Data::Memory(bytes),
            Some(Layout::Contiguous(UNDEFINED)) | None => {
                self.others.push(unread("nothing was written to it"));
                return Ok(());
            }
            Some(Layout::Contiguous(address)) => Data::File(address.saturating_add(self.base)),
            Some(Layout::Single(address, size, chunk)) if sides(chunk.clone()) => {
                let full = chunk
                    .iter()
                    .try_fold(item.size as u64, |all, side| all.checked_mul(*side));
                let size = size.or(full).ok_or_else(damaged)?;
                let piece = Piece {
                    origin: vec![0; shape.len()],
                    address: address.saturating_add(self.base),
                    size,
                    skipped: 0,
                };
                Data::Stripes(Box::new(Chunked::new(chunk, vec![piece], object.filters)))
            }
            Some(Layout::Chunked(address, chunk)) if sides(chunk.clone()) => {
                let mut pieces = Vec::new();
                if address != UNDEFINED {
                    self.pieces(address, shape.len(), &mut pieces, 0)?;
                }
                Data::Stripes(Box::new(Chunked::new(chunk, pieces, object.filters)))
            }
            Some(Layout::Indexed(kind, address, chunk)) if sides(chunk.clone()) => {
                let most = object.most.as_ref().unwrap_or(&shape);
                let grid = chunk_index::Grid::new(&shape, most, &chunk, item.size as u64);
                let pieces = match grid.ok_or_else(damaged)? {
                    grid if kind == chunk_index::Kind::Extensible && !grid.grows_at_front() => {
                        self.others.push(unread(SEVERAL_AXES));
                        return Ok(());
                    }
                    grid => self.indexed(kind, address, &grid)?,
                };
                Data::Stripes(Box::new(Chunked::new(chunk, pieces, object.filters)))
            }
            Some(Layout::Unread(why)) => {
                self.others.push(unread(why));
                return Ok(());
            }
            Some(_) => return Err(damaged()),
        };
        self.arrays.push(Array {
            name: name.to_owned(),
            shape,
            item,
            fortran: false,
            data,
        });
        Ok(())
    }

    /// The chunks in the tree of the older form.
    fn pieces(
        &mut self,
        address: u64,
        rank: usize,
        pieces: &mut Vec<Piece>,
        depth: usize,
    ) -> Result<(), Fault> {
        let address = self.inside(address)?;
        let head = self.at(address, 24)?.to_vec();
        let count = usize::from(u16::from_le_bytes([head[6], head[7]]));
        let (key, level) = (8 + 8 * (rank + 1), head[5]);
        // No more chunks than there are bytes.
        let most = usize::try_from(self.bytes.length()).unwrap_or(usize::MAX);
        if !head.starts_with(b"TREE") || head[4] != 1 || depth > DEEPEST || pieces.len() > most {
            return Err(damaged());
        }
        let body = self.at(address + 24, (count * (key + 8)) as u64)?.to_vec();
        for entry in body.chunks_exact(key + 8) {
            let mut fields = Fields(entry);
            let mut read = || {
                let (size, skipped) = (fields.u32()?, fields.u32()?);
                let origin: Vec<u64> = (0..rank).map(|_| fields.u64()).collect::<Option<_>>()?;
                fields.u64()?;
                Some((size, skipped, origin, fields.u64()?))
            };
            let (size, skipped, origin, child) = read().ok_or_else(damaged)?;
            if level > 0 {
                self.pieces(child, rank, pieces, depth + 1)?;
            } else {
                pieces.push(Piece {
                    origin,
                    address: child.saturating_add(self.base),
                    size: u64::from(size),
                    skipped,
                });
            }
        }
        Ok(())
    }
}

impl Object {
    /// Takes a message of a head; `None` if it is not whole.
    fn take(&mut self, kind: u16, body: &[u8]) -> Option<()> {
        let mut fields = Fields(body);
        match kind {
            0x01 => {
                let (version, rank, flags) = (fields.u8()?, fields.u8()?, fields.u8()?);
                fields.take(if version == 1 { 5 } else { 1 })?;
                let mut sides = || (0..rank).map(|_| fields.u64()).collect::<Option<Vec<_>>>();
                self.shape = Some(sides()?);
                if flags & 1 == 1 {
                    self.most = Some(sides()?);
                }
            }
            0x02 => {
                let (_, flags) = (fields.u8()?, fields.u8()?);
                fields.take(if flags & 1 != 0 { 8 } else { 0 })?;
                self.dense |= fields.u64()? != UNDEFINED;
            }
            0x03 => self.item = Some(item(&mut fields)),
            0x06 => {
                let (_, flags) = (fields.u8()?, fields.u8()?);
                let soft = if flags & 8 != 0 { fields.u8()? } else { 0 };
                fields.take(if flags & 4 != 0 { 8 } else { 0 } + usize::from(flags >> 4 & 1))?;
                let length = match flags & 3 {
                    0 => u64::from(fields.u8()?),
                    1 => u64::from(fields.u16()?),
                    2 => u64::from(fields.u32()?),
                    _ => fields.u64()?,
                };
                let name = fields.take(usize::try_from(length).ok()?)?;
                if soft == 0 {
                    self.links
                        .push((String::from_utf8_lossy(name).into_owned(), fields.u64()?));
                }
            }
            0x08 => self.layout = Some(layout(&mut fields)?),
            0x0b => self.filters = filters(&mut fields)?,
            0x11 => self.table = Some((fields.u64()?, fields.u64()?)),
            _ => {}
        }
        Some(())
    }
}

fn layout(fields: &mut Fields<'_>) -> Option<Layout> {
    let old = Layout::Unread(
        "its layout is one of HDF5 1.4 or before, which is not read; h5repack FILE NEW writes the usual one",
    );
    let new = Layout::Unread(SEVERAL_AXES);
    let version = fields.u8()?;
    if version < 3 {
        return Some(old);
    }
    Some(match (fields.u8()?, version) {
        (0, _) => {
            let size = usize::from(fields.u16()?);
            Layout::Compact(fields.take(size)?.to_vec())
        }
        (1, _) => Layout::Contiguous(fields.u64()?),
        (2, 3) => {
            let rank = fields.u8()?;
            let address = fields.u64()?;
            let mut sides: Vec<u64> = (0..rank)
                .map(|_| fields.u32().map(u64::from))
                .collect::<Option<_>>()?;
            // The last one is the size of an item.
            sides.pop();
            Layout::Chunked(address, sides)
        }
        (2, 4 | 5) => {
            let (flags, rank, size) = (fields.u8()?, fields.u8()?, fields.u8()?);
            let side = |fields: &mut Fields<'_>| {
                let mut whole = [0; 8];
                whole
                    .get_mut(..usize::from(size))?
                    .copy_from_slice(fields.take(usize::from(size))?);
                Some(u64::from_le_bytes(whole))
            };
            let mut sides: Vec<u64> = (0..rank).map(|_| side(fields)).collect::<Option<_>>()?;
            sides.pop();
            let kind = match fields.u8()? {
                1 => None,
                2 => Some((chunk_index::Kind::Implicit, 0)),
                3 => Some((chunk_index::Kind::Fixed, 1)),
                4 => Some((chunk_index::Kind::Extensible, 5)),
                _ => return Some(new),
            };
            if let Some((kind, settings)) = kind {
                // They come again at the head of the index.
                fields.take(settings)?;
                return Some(Layout::Indexed(kind, fields.u64()?, sides));
            }
            let packed = if flags & 2 != 0 {
                let size = fields.u64()?;
                fields.u32()?;
                Some(size)
            } else {
                None
            };
            Layout::Single(fields.u64()?, packed, sides)
        }
        _ => new,
    })
}

fn filters(fields: &mut Fields<'_>) -> Option<Vec<u16>> {
    let (version, count) = (fields.u8()?, fields.u8()?);
    fields.take(if version == 1 { 6 } else { 0 })?;
    let mut filters = Vec::new();
    for _ in 0..count {
        let number = fields.u16()?;
        let named = version == 1 || number >= 256;
        let name = if named { usize::from(fields.u16()?) } else { 0 };
        fields.u16()?;
        let values = usize::from(fields.u16()?);
        let name = if version == 1 {
            name.next_multiple_of(8)
        } else {
            name
        };
        let padding = if version == 1 { values % 2 } else { 0 };
        fields.take(name + 4 * (values + padding))?;
        filters.push(number);
    }
    Some(filters)
}

/// The type of an item, as far as it has numbers.
fn item(fields: &mut Fields<'_>) -> Result<Item, &'static str> {
    const DAMAGED: &str = "its type is damaged";
    let kind = kind(fields, 0).ok_or(DAMAGED)?;
    if kind.fields.is_empty() {
        return Err("it has no numbers: text, references or the like");
    }
    Ok(kind)
}

/// A type and all that belongs to it.
fn kind(fields: &mut Fields<'_>, depth: usize) -> Option<Item> {
    if depth > DEEPEST {
        return None;
    }
    let first = fields.u8()?;
    let (version, class) = (first >> 4, first & 15);
    let bits = fields.take(3)?;
    let size = fields.u32()? as usize;
    let plain = |number: Number| {
        let field = ItemField {
            name: String::new(),
            number,
            big: bits[0] & 1 == 1,
            offset: 0,
            count: 1,
        };
        vec![field]
    };
    let mut item = Item {
        size,
        fields: Vec::new(),
    };
    match class {
        0 => {
            fields.take(4)?;
            if [1, 2, 4, 8].contains(&size) {
                let signed = bits[0] & 8 != 0;
                item.fields = plain(if signed {
                    Number::Signed(size)
                } else {
                    Number::Unsigned(size)
                });
            }
        }
        1 => {
            fields.take(12)?;
            if [2, 4, 8].contains(&size) {
                item.fields = plain(Number::Float(size));
            }
        }
        2 => drop(fields.take(2)?),
        4 => drop(fields.take(4)?),
        5 => drop(fields.take(usize::from(bits[0]))?),
        6 => {
            let count = u16::from_le_bytes([bits[0], bits[1]]);
            item.fields = members(fields, version, count, (size, depth))?;
        }
        8 => {
            let members = usize::from(u16::from_le_bytes([bits[0], bits[1]]));
            let base = kind(fields, depth + 1)?;
            for _ in 0..members {
                let end = fields.0.iter().position(|byte| *byte == 0)? + 1;
                fields.take(if version < 3 {
                    end.next_multiple_of(8)
                } else {
                    end
                })?;
            }
            fields.take(members.checked_mul(base.size)?)?;
            item.fields = base.fields;
        }
        9 => drop(kind(fields, depth + 1)?),
        10 => {
            let rank = fields.u8()?;
            fields.take(if version < 3 { 3 } else { 0 })?;
            let sides = (0..rank)
                .map(|_| fields.u32())
                .try_fold(1_usize, |all, side| all.checked_mul(side? as usize))?;
            if version < 3 {
                fields.take(4 * usize::from(rank))?;
            }
            let base = kind(fields, depth + 1)?;
            if base.fields.len() == 1 && base.size.checked_mul(sides)? <= size {
                item.fields = base.fields;
                item.fields[0].count = item.fields[0].count.checked_mul(sides)?;
            }
        }
        _ => {}
    }
    let end = |field: &ItemField| {
        field
            .number
            .size()
            .checked_mul(field.count)?
            .checked_add(field.offset)
    };
    let fits = item
        .fields
        .iter()
        .all(|field| end(field).is_some_and(|end| end <= size));
    fits.then_some(item)
}

/// The members of a type of so many bytes.
fn members(
    fields: &mut Fields<'_>,
    version: u8,
    members: u16,
    (size, depth): (usize, usize),
) -> Option<Vec<ItemField>> {
    let mut found = Vec::new();
    for _ in 0..members {
        let end = fields.0.iter().position(|byte| *byte == 0)?;
        let name = String::from_utf8_lossy(&fields.0[..end]).into_owned();
        fields.take(if version < 3 {
            (end + 1).next_multiple_of(8)
        } else {
            end + 1
        })?;
        let offset = match version {
            3.. => {
                let bytes = (1..=4).find(|bytes| size >> (8 * bytes) == 0)?;
                let mut whole = [0; 4];
                whole[..bytes].copy_from_slice(fields.take(bytes)?);
                u32::from_le_bytes(whole)
            }
            _ => fields.u32()?,
        };
        let mut count = 1_usize;
        if version == 1 {
            let rank = usize::from(fields.u8()?);
            fields.take(3 + 4 + 4)?;
            for at in 0..4 {
                let side = fields.u32()? as usize;
                count = count.checked_mul(if at < rank { side } else { 1 })?;
            }
        }
        let inner = kind(fields, depth + 1)?;
        let offset = offset as usize;
        if offset.checked_add(inner.size.checked_mul(count)?)? > size {
            return None;
        }
        for field in inner.fields {
            let dot = if field.name.is_empty() { "" } else { "." };
            found.push(ItemField {
                name: format!("{name}{dot}{}", field.name),
                offset: offset + field.offset,
                count: field.count.checked_mul(count)?,
                ..field
            });
        }
    }
    Some(found)
}

/// Bytes of an array in chunks.
#[derive(Debug)]
struct Chunked {
    /// Sides of a chunk, in items.
    sides: Vec<u64>,
    pieces: Vec<Piece>,
    filters: Vec<u16>,
    /// Rows of one stripe of chunks, with the number of the stripe.
    stripe: Option<(u64, Vec<u8>)>,
}

#[derive(Debug)]
struct Piece {
    origin: Vec<u64>,
    address: u64,
    size: u64,
    /// Filters that were left out, one a bit.
    skipped: u32,
}

impl Chunked {
    fn new(sides: Vec<u64>, mut pieces: Vec<Piece>, filters: Vec<u16>) -> Self {
        pieces.sort_by(|a, b| a.origin.cmp(&b.origin));
        Self {
            sides,
            pieces,
            filters,
            stripe: None,
        }
    }
}

impl Stripes for Chunked {
    fn row(
        &mut self,
        bytes: &mut Bytes,
        row: u64,
        shape: &[u64],
        item: usize,
    ) -> Result<&[u8], Fault> {
        let deep = self.sides[0];
        let stripe = row / deep;
        let length = shape[1..]
            .iter()
            .try_fold(item as u64, |all, side| all.checked_mul(*side));
        let length = length.ok_or_else(damaged)?;
        if self
            .stripe
            .as_ref()
            .is_none_or(|(known, _)| *known != stripe)
        {
            let all = length.checked_mul(deep.min(shape[0] - stripe * deep));
            let all = all.filter(|all| *all <= unpack::LONGEST).ok_or_else(|| {
                Fault::Wrong(format!(
                    "its chunks are longer than {} bytes",
                    unpack::LONGEST
                ))
            })?;
            let mut rows = vec![0; all as usize];
            let begin = self
                .pieces
                .partition_point(|piece| piece.origin[0] < stripe * deep);
            let of_stripe = self.pieces[begin..]
                .iter()
                .take_while(|piece| piece.origin[0] == stripe * deep);
            let mut found = false;
            for piece in of_stripe {
                let packed = bytes.get(piece.address, piece.size)?;
                let missing = || Fault::Cut("the file ends before a chunk of its rows".to_owned());
                let chunk = unfiltered(
                    packed.ok_or_else(missing)?,
                    piece,
                    &self.filters,
                    &self.sides,
                    item,
                );
                let chunk =
                    chunk.ok_or_else(|| Fault::Wrong("a chunk of its rows is damaged".into()))?;
                place(&chunk, &piece.origin, &self.sides, shape, item, &mut rows);
                found = true;
            }
            if !found {
                return Err(Fault::Cut(format!(
                    "rows from {} on were not written",
                    stripe * deep + 1
                )));
            }
            self.stripe = Some((stripe, rows));
        }
        let begin = ((row % deep) * length) as usize;
        let rows = self.stripe.as_ref().map(|(_, rows)| rows);
        rows.and_then(|rows| rows.get(begin..begin + length as usize))
            .ok_or_else(damaged)
    }
}

/// A chunk as it was before it was compressed.
fn unfiltered(
    packed: &[u8],
    piece: &Piece,
    filters: &[u16],
    sides: &[u64],
    item: usize,
) -> Option<Vec<u8>> {
    let full = sides
        .iter()
        .try_fold(item as u64, |all, side| all.checked_mul(*side))?;
    let mut bytes = packed.to_vec();
    for (at, filter) in filters.iter().enumerate().rev() {
        if at < 32 && piece.skipped >> at & 1 == 1 {
            continue;
        }
        bytes = match filter {
            // A sum behind the bytes.
            3 => bytes[..bytes.len().checked_sub(4)?].to_vec(),
            1 => unpack::zlib(&bytes, full.saturating_add(4))?,
            &LZF => unpack::lzf(&bytes, full.saturating_add(4))?,
            2 if item > 1 => {
                let count = bytes.len() / item;
                let mut whole = bytes.clone();
                for (place, byte) in bytes[..count * item].iter().enumerate() {
                    whole[place % count * item + place / count] = *byte;
                }
                whole
            }
            _ => bytes,
        };
    }
    (bytes.len() as u64 == full).then_some(bytes)
}

/// Copies a chunk into the rows of its stripe, without what stands out of the array.
fn place(chunk: &[u8], origin: &[u64], sides: &[u64], shape: &[u64], item: usize, rows: &mut [u8]) {
    let rank = shape.len();
    let last = rank - 1;
    // Runs along the last axis are copied at once.
    let run = sides[last].min(shape[last].saturating_sub(origin[last])) as usize;
    let lines = chunk.chunks_exact(sides[last] as usize * item);
    for (line, bytes) in lines.enumerate() {
        let mut rest = line as u64;
        let mut at = if rank == 1 { 0 } else { origin[last] };
        let mut step = if rank == 1 { 1 } else { shape[last] };
        let mut inside = true;
        for axis in (0..last).rev() {
            let index = rest % sides[axis];
            rest /= sides[axis];
            inside &= origin[axis].saturating_add(index) < shape[axis];
            // The first axis counts within the stripe.
            let place = if axis == 0 {
                index
            } else {
                origin[axis].saturating_add(index)
            };
            at = at.saturating_add(place.saturating_mul(step));
            step = step.saturating_mul(shape[axis]);
        }
        let begin = usize::try_from(at)
            .unwrap_or(usize::MAX)
            .saturating_mul(item);
        if inside && let Some(target) = rows.get_mut(begin..begin.saturating_add(run * item)) {
            target.copy_from_slice(&bytes[..run * item]);
        }
    }
}
