//! Where the chunks of a data set are, in the forms of HDF5 1.10 and later: all behind each other, an
//! array of addresses of a fixed length, or one that grows in blocks of doubling length.

use super::{File, Piece, UNDEFINED, damaged};
use crate::foreign::Fault;
use crate::mcap::Fields;

/// Kind of an index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// None: the chunks follow each other.
    Implicit,
    /// An array of a fixed length.
    Fixed,
    /// An array that grows.
    Extensible,
}

/// The chunks of a data set, in the order of an index: the last axis first.
pub(super) struct Grid {
    /// Sides of a chunk, in items.
    sides: Vec<u64>,
    /// Chunks along each axis, of all that the index has room for; of one that grows as many as it has.
    room: Vec<u64>,
    /// Chunks along each axis.
    used: Vec<u64>,
    /// True of an axis that has no end.
    endless: Vec<bool>,
    /// Bytes of a chunk.
    bytes: u64,
}

impl Grid {
    /// `None` where the sides do not fit each other.
    pub(super) fn new(shape: &[u64], most: &[u64], sides: &[u64], item: u64) -> Option<Self> {
        let endless: Vec<bool> = most.iter().map(|most| *most == UNDEFINED).collect();
        let chunks = |lengths: &[u64]| -> Vec<u64> {
            let pairs = lengths.iter().zip(sides);
            pairs.map(|(length, side)| length.div_ceil(*side)).collect()
        };
        let used = chunks(shape);
        let mut room = chunks(most);
        for ((room, used), endless) in room.iter_mut().zip(&used).zip(&endless) {
            *room = if *endless { *used } else { *room };
        }
        let fits =
            most.len() == shape.len() && room.iter().zip(&used).all(|(room, used)| room >= used);
        let bytes = sides
            .iter()
            .try_fold(item, |all, side| all.checked_mul(*side))?;
        fits.then_some(Self {
            sides: sides.to_vec(),
            room,
            used,
            endless,
            bytes,
        })
    }

    /// True if only the first axis has no end: the index is then in the order of the axes.
    pub(super) fn grows_at_front(&self) -> bool {
        self.endless.iter().skip(1).all(|endless| !endless)
    }

    /// Number of chunks that the index has room for.
    fn count(&self) -> Option<u64> {
        self.room
            .iter()
            .try_fold(1_u64, |all, side| all.checked_mul(*side))
    }

    /// The first item of a chunk; `None` of one beyond the data set.
    fn origin(&self, index: u64) -> Option<Vec<u64>> {
        let mut rest = index;
        let mut origin = vec![0; self.room.len()];
        for axis in (0..origin.len()).rev() {
            let at = rest % self.room[axis].max(1);
            rest /= self.room[axis].max(1);
            if at >= self.used[axis] {
                return None;
            }
            origin[axis] = at * self.sides[axis];
        }
        (rest == 0).then_some(origin)
    }
}

/// The elements of an array: an address each, of filtered chunks with their length.
struct Elements<'a> {
    grid: &'a Grid,
    /// Bytes of an element, and whether the chunks are filtered.
    size: u64,
    filtered: bool,
    next: u64,
    pieces: Vec<Piece>,
}

impl Elements<'_> {
    fn take(&mut self, bytes: &[u8], base: u64) -> Result<(), Fault> {
        for element in bytes.chunks_exact(self.size as usize) {
            let index = self.next;
            self.next += 1;
            let mut fields = Fields(element);
            let address = fields.u64().ok_or_else(damaged)?;
            let Some(origin) = self.grid.origin(index).filter(|_| address != UNDEFINED) else {
                continue;
            };
            let (size, skipped) = if self.filtered {
                let (length, mask) = fields
                    .0
                    .split_at_checked(fields.0.len().saturating_sub(4))
                    .ok_or_else(damaged)?;
                let mut whole = [0; 8];
                whole
                    .get_mut(..length.len())
                    .ok_or_else(damaged)?
                    .copy_from_slice(length);
                (
                    u64::from_le_bytes(whole),
                    Fields(mask).u32().ok_or_else(damaged)?,
                )
            } else {
                (self.grid.bytes, 0)
            };
            self.pieces.push(Piece {
                origin,
                address: address.saturating_add(base),
                size,
                skipped,
            });
        }
        Ok(())
    }
}

impl File {
    /// The chunks of an index.
    pub(super) fn indexed(
        &mut self,
        kind: Kind,
        address: u64,
        grid: &Grid,
    ) -> Result<Vec<Piece>, Fault> {
        if address == UNDEFINED {
            return Ok(Vec::new());
        }
        let address = self.inside(address)?;
        let count = grid.count().filter(|count| *count <= self.bytes.length());
        let count = count.ok_or_else(damaged)?;
        if kind == Kind::Implicit {
            let piece = |index: u64| {
                Some(Piece {
                    origin: grid.origin(index)?,
                    address: address
                        .saturating_add(self.base)
                        .saturating_add(index.saturating_mul(grid.bytes)),
                    size: grid.bytes,
                    skipped: 0,
                })
            };
            return Ok((0..count).filter_map(piece).collect());
        }
        let mark = if kind == Kind::Fixed {
            b"FAHD"
        } else {
            b"EAHD"
        };
        let head = self.at(address, 12)?.to_vec();
        if !head.starts_with(mark) || head[4] != 0 || head[6] < 8 {
            return Err(damaged());
        }
        let mut elements = Elements {
            grid,
            size: u64::from(head[6]),
            filtered: head[5] == 1,
            next: 0,
            pieces: Vec::new(),
        };
        if elements.filtered != (elements.size > 8) {
            return Err(damaged());
        }
        match kind {
            Kind::Fixed => self.fixed(address, head[7], &mut elements)?,
            _ => self.extensible(address, &head, &mut elements)?,
        }
        Ok(elements.pieces)
    }

    fn fixed(
        &mut self,
        head: u64,
        page_bits: u8,
        elements: &mut Elements<'_>,
    ) -> Result<(), Fault> {
        let fields = self.at(head + 8, 16)?.to_vec();
        let mut fields = Fields(&fields);
        let (count, block) = fields.u64().zip(fields.u64()).ok_or_else(damaged)?;
        if block == UNDEFINED {
            return Ok(());
        }
        let block = self.inside(block)?;
        if self.at(block, 4)? != b"FADB" {
            return Err(damaged());
        }
        self.paged(block + 14, count, page_bits, elements)
    }

    /// `count` elements from an address on: at once, or in pages with a sum behind each.
    fn paged(
        &mut self,
        at: u64,
        count: u64,
        page_bits: u8,
        elements: &mut Elements<'_>,
    ) -> Result<(), Fault> {
        let page = 1_u64
            .checked_shl(u32::from(page_bits))
            .ok_or_else(damaged)?;
        let end = elements.next + count;
        if count <= page {
            return self.run(at, count, elements);
        }
        let pages = count.div_ceil(page);
        let written = self.at(at, pages.div_ceil(8))?.to_vec();
        let mut at = at + pages.div_ceil(8) + 4;
        for number in 0..pages {
            let length = page.min(end - elements.next);
            // The first page is the highest bit.
            if written[(number / 8) as usize] >> (7 - number % 8) & 1 == 1 {
                self.run(at, length, elements)?;
            } else {
                elements.next += length;
            }
            at += length * elements.size + 4;
        }
        Ok(())
    }

    fn run(&mut self, at: u64, count: u64, elements: &mut Elements<'_>) -> Result<(), Fault> {
        let length = count.checked_mul(elements.size).ok_or_else(damaged)?;
        let base = self.base;
        let bytes = self.at(at, length)?;
        elements.take(bytes, base)
    }

    fn extensible(
        &mut self,
        head: u64,
        settings: &[u8],
        elements: &mut Elements<'_>,
    ) -> Result<(), Fault> {
        let [bits, own, least, pointers, page_bits] = [
            settings[7],
            settings[8],
            settings[9],
            settings[10],
            settings[11],
        ];
        // Six counts stand before the address of the first block.
        let first = self.at(head + 12 + 48, 8)?.to_vec();
        let first = Fields(&first).u64().ok_or_else(damaged)?;
        if first == UNDEFINED {
            return Ok(());
        }
        let first = self.inside(first)?;
        if self.at(first, 4)? != b"EAIB"
            || bits > 64
            || !least.is_power_of_two()
            || !pointers.is_power_of_two()
        {
            return Err(damaged());
        }
        self.run(first + 14, u64::from(own), elements)?;
        let of_offset = u64::from(bits.div_ceil(8));
        let mut at = first + 14 + u64::from(own) * elements.size;
        let rows = 1 + u32::from(bits).saturating_sub(least.ilog2());
        let direct = 2 * pointers.ilog2();
        for row in 0..rows {
            let (blocks, length) = (
                1_u64 << (row / 2),
                (1_u64 << row.div_ceil(2)).checked_mul(u64::from(least)),
            );
            let length = length.ok_or_else(damaged)?;
            let all = elements.grid.count().unwrap_or(0);
            if elements.next >= all {
                return Ok(());
            }
            let addresses = if row < direct {
                let addresses = self.at(at, 8 * blocks)?.to_vec();
                at += 8 * blocks;
                addresses
            } else {
                let block = self.at(at, 8)?.to_vec();
                at += 8;
                let block = Fields(&block).u64().ok_or_else(damaged)?;
                if block == UNDEFINED {
                    elements.next = elements.next.saturating_add(blocks.saturating_mul(length));
                    continue;
                }
                let block = self.inside(block)?;
                if self.at(block, 4)? != b"EASB" {
                    return Err(damaged());
                }
                // Which pages were written, for each block of several.
                let pages = length >> page_bits.min(63);
                let written = if pages > 1 {
                    blocks * pages.div_ceil(8)
                } else {
                    0
                };
                self.at(block + 14 + of_offset + written, 8 * blocks)?
                    .to_vec()
            };
            for address in addresses.chunks_exact(8) {
                let address = Fields(address).u64().ok_or_else(damaged)?;
                if address == UNDEFINED {
                    elements.next = elements.next.saturating_add(length);
                    continue;
                }
                let block = self.inside(address)?;
                if self.at(block, 4)? != b"EADB"
                    || elements.pieces.len() > self.bytes.length() as usize
                {
                    return Err(damaged());
                }
                let (mut at, page) = (block + 14 + of_offset, 1_u64 << page_bits.min(63));
                let end = elements.next.saturating_add(length);
                if length > page {
                    // Pages, each with a sum behind it, behind that of the head of the block.
                    at += 4;
                }
                while elements.next < end.min(all) {
                    let count = page.min(end - elements.next);
                    self.run(at, count, elements)?;
                    at += count * elements.size + 4;
                }
                elements.next = end;
            }
        }
        Ok(())
    }
}
