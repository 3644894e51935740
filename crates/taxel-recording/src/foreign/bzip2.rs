//! Streams of bzip2, as bags of ROS 1 have them: Huffman codes, moves to front, the transform of
//! Burrows and Wheeler, and runs.

/// Bits, the highest of each byte first.
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Bits<'_> {
    fn take(&mut self, count: usize) -> Option<u64> {
        (0..count).try_fold(0, |whole, _| {
            let byte = *self.bytes.get(self.at / 8)?;
            let bit = byte >> (7 - self.at % 8) & 1;
            self.at += 1;
            Some(whole << 1 | u64::from(bit))
        })
    }

    fn bit(&mut self) -> Option<bool> {
        Some(self.take(1)? == 1)
    }
}

/// Longest code, bits.
const LONGEST: usize = 20;
/// Symbols that a table codes at once.
const GROUP: usize = 50;

/// A table of codes: of each length the first code, and where its symbols begin.
struct Codes {
    counts: [usize; LONGEST + 1],
    symbols: Vec<usize>,
}

impl Codes {
    fn read(bits: &mut Bits<'_>, symbols: usize) -> Option<Self> {
        let mut length = bits.take(5)? as usize;
        let mut lengths = Vec::with_capacity(symbols);
        for _ in 0..symbols {
            while bits.bit()? {
                length = if bits.bit()? {
                    length.checked_sub(1)?
                } else {
                    length + 1
                };
            }
            lengths.push(Some(length).filter(|length| (1..=LONGEST).contains(length))?);
        }
        let mut counts = [0; LONGEST + 1];
        for length in &lengths {
            counts[*length] += 1;
        }
        let mut symbols: Vec<usize> = (0..symbols).collect();
        symbols.sort_by_key(|symbol| lengths[*symbol]);
        Some(Self { counts, symbols })
    }

    fn next(&self, bits: &mut Bits<'_>) -> Option<usize> {
        let (mut code, mut first, mut begin) = (0_usize, 0, 0);
        for count in &self.counts[1..] {
            code = code << 1 | usize::from(bits.bit()?);
            first <<= 1;
            if code >= first && code - first < *count {
                return self.symbols.get(begin + code - first).copied();
            }
            first += count;
            begin += count;
        }
        None
    }
}

/// What a stream unpacks to; `None` if it is not whole or longer than `limit`.
pub(super) fn unpacked(bytes: &[u8], limit: usize) -> Option<Vec<u8>> {
    let mut bits = Bits { bytes, at: 0 };
    let level = match bits.take(32)?.to_be_bytes()[4..] {
        [b'B', b'Z', b'h', level @ b'1'..=b'9'] => usize::from(level - b'0'),
        _ => return None,
    };
    let mut out = Vec::new();
    loop {
        match bits.take(48)? {
            0x3141_5926_5359 => {
                let sum = bits.take(32)? as u32;
                let begin = out.len();
                block(&mut bits, 100_000 * level, limit, &mut out)?;
                if sum != checked(&out[begin..]) {
                    return None;
                }
            }
            0x1772_4538_5090 => return Some(out),
            _ => return None,
        }
    }
}

/// The sum of a block: a CRC of 32 bits, the highest first.
fn checked(bytes: &[u8]) -> u32 {
    let of_byte = |sum: u32, byte: &u8| {
        (0..8).fold(sum ^ u32::from(*byte) << 24, |sum, _| {
            sum << 1 ^ if sum >> 31 == 1 { 0x04c1_1db7 } else { 0 }
        })
    };
    !bytes.iter().fold(u32::MAX, of_byte)
}

fn block(bits: &mut Bits<'_>, longest: usize, limit: usize, out: &mut Vec<u8>) -> Option<()> {
    // Only versions before 0.9.5 shuffled.
    if bits.bit()? {
        return None;
    }
    let origin = bits.take(24)? as usize;
    let rows = bits.take(16)?;
    let mut front = Vec::new();
    for row in (0..16).filter(|row| rows >> (15 - row) & 1 == 1) {
        let columns = bits.take(16)?;
        let used = (0..16_u8).filter(|column| columns >> (15 - column) & 1 == 1);
        front.extend(used.map(|column| 16 * row + column));
    }
    let (tables, groups) = (bits.take(3)? as usize, bits.take(15)? as usize);
    if !(2..=6).contains(&tables) || front.is_empty() {
        return None;
    }
    let mut order: Vec<usize> = (0..tables).collect();
    let mut selectors = Vec::new();
    for _ in 0..groups {
        let mut place = 0;
        while bits.bit()? {
            place += 1;
        }
        if place >= tables {
            return None;
        }
        order[..=place].rotate_right(1);
        selectors.push(order[0]);
    }
    let end = front.len() + 1;
    let tables: Vec<Codes> = (0..tables)
        .map(|_| Codes::read(bits, end + 1))
        .collect::<Option<_>>()?;
    let mut last = Vec::new();
    let (mut run, mut weight) = (0_usize, 1_usize);
    'block: for selector in selectors {
        for _ in 0..GROUP {
            let symbol = tables[selector].next(bits)?;
            if symbol < 2 {
                run += weight << symbol;
                weight <<= 1;
                if run > longest {
                    return None;
                }
                continue;
            }
            last.resize(last.len() + run, front[0]);
            (run, weight) = (0, 1);
            if symbol == end {
                break 'block;
            }
            front[..symbol].rotate_right(1);
            last.push(front[0]);
            if last.len() > longest {
                return None;
            }
        }
    }
    let mut starts = [0_usize; 257];
    for byte in &last {
        starts[usize::from(*byte) + 1] += 1;
    }
    for byte in 0..256 {
        starts[byte + 1] += starts[byte];
    }
    let mut next = vec![0; last.len()];
    for (place, byte) in last.iter().enumerate() {
        next[starts[usize::from(*byte)]] = place;
        starts[usize::from(*byte)] += 1;
    }
    let mut at = *next.get(origin)?;
    let (mut before, mut same) = (None, 0);
    for _ in 0..last.len() {
        let byte = last[at];
        at = next[at];
        if same == 4 {
            // Four alike are followed by how many more there are.
            out.resize(out.len() + usize::from(byte), before.unwrap_or(0));
            (before, same) = (None, 0);
        } else {
            same = if before == Some(byte) { same + 1 } else { 1 };
            before = Some(byte);
            out.push(byte);
        }
        if out.len() > limit {
            return None;
        }
    }
    Some(())
}
