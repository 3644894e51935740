//! What is compressed, to a length that is known before.

use std::io::Read as _;

/// Longest piece that is unpacked at once: 64 times the usual chunk of 4 MB.
pub(super) const LONGEST: u64 = 1 << 28;

/// Frames of LZ4; `None` if they are not whole or longer than `length`.
pub(super) fn lz4(mut bytes: &[u8], length: u64) -> Option<Vec<u8>> {
    let limit = usize::try_from(length.min(LONGEST)).ok()?;
    let mut out = Vec::new();
    let mut take = |count: usize| -> Option<&[u8]> {
        let (taken, rest) = bytes.split_at_checked(count)?;
        bytes = rest;
        Some(taken)
    };
    if take(4)? != [0x04, 0x22, 0x4d, 0x18] {
        return None;
    }
    let flags = take(2)?[0];
    let (checked, sized, summed, named) = (
        flags & 16 != 0,
        flags & 8 != 0,
        flags & 4 != 0,
        flags & 1 != 0,
    );
    take(usize::from(sized) * 8 + usize::from(named) * 4 + 1)?;
    loop {
        let size = u32::from_le_bytes(take(4)?.try_into().ok()?);
        if size == 0 {
            break;
        }
        let block = take((size & 0x7fff_ffff) as usize)?;
        if size >> 31 == 1 {
            if out.len() + block.len() > limit {
                return None;
            }
            out.extend_from_slice(block);
        } else {
            lz4_block(block, &mut out, limit)?;
        }
        take(usize::from(checked) * 4)?;
    }
    take(usize::from(summed) * 4)?;
    Some(out)
}

fn lz4_block(bytes: &[u8], out: &mut Vec<u8>, limit: usize) -> Option<()> {
    let mut at = 0;
    let long = |at: &mut usize, first: u8| -> Option<usize> {
        let mut length = usize::from(first);
        if first == 15 {
            loop {
                let more = *bytes.get(*at)?;
                *at += 1;
                length += usize::from(more);
                if more != 255 {
                    break;
                }
            }
        }
        Some(length)
    };
    loop {
        let token = *bytes.get(at)?;
        at += 1;
        let literal = long(&mut at, token >> 4)?;
        let literals = bytes.get(at..at.checked_add(literal)?)?;
        at += literal;
        if out.len() + literal > limit {
            return None;
        }
        out.extend_from_slice(literals);
        if at == bytes.len() {
            return Some(());
        }
        let back = usize::from(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?));
        at += 2;
        let length = long(&mut at, token & 15)? + 4;
        let from = out.len().checked_sub(back).filter(|_| back > 0)?;
        if out.len() + length > limit {
            return None;
        }
        for place in from..from + length {
            out.push(out[place]);
        }
    }
}

/// A stream of bzip2, likewise.
pub(super) fn bzip2(bytes: &[u8], length: u64) -> Option<Vec<u8>> {
    super::bzip2::unpacked(bytes, usize::try_from(length.min(LONGEST)).ok()?)
}

/// LZF, as h5py writes it, likewise.
pub(super) fn lzf(bytes: &[u8], length: u64) -> Option<Vec<u8>> {
    let limit = usize::try_from(length.min(LONGEST)).ok()?;
    let (mut out, mut at) = (Vec::new(), 0);
    while let Some(first) = bytes.get(at) {
        let first = usize::from(*first);
        at += 1;
        if first < 32 {
            out.extend_from_slice(bytes.get(at..at + first + 1)?);
            at += first + 1;
        } else {
            let mut count = first >> 5;
            if count == 7 {
                count += usize::from(*bytes.get(at)?);
                at += 1;
            }
            let back = ((first & 31) << 8) + usize::from(*bytes.get(at)?) + 1;
            at += 1;
            let from = out.len().checked_sub(back)?;
            for place in from..from + count + 2 {
                out.push(out[place]);
            }
        }
        if out.len() > limit {
            return None;
        }
    }
    Some(out)
}

/// Frames of Zstandard, likewise.
pub(super) fn zstd(bytes: &[u8], length: u64) -> Option<Vec<u8>> {
    let decoder = ruzstd::decoding::StreamingDecoder::new(bytes).ok()?;
    let mut out = Vec::new();
    decoder
        .take(length.min(LONGEST) + 1)
        .read_to_end(&mut out)
        .ok()?;
    (out.len() as u64 <= length).then_some(out)
}

/// Bare DEFLATE, likewise.
pub(super) fn deflate(bytes: &[u8], length: u64) -> Option<Vec<u8>> {
    let limit = usize::try_from(length.min(LONGEST)).ok()?;
    miniz_oxide::inflate::decompress_to_vec_with_limit(bytes, limit).ok()
}

/// DEFLATE with the head of zlib, likewise.
pub(super) fn zlib(bytes: &[u8], length: u64) -> Option<Vec<u8>> {
    let limit = usize::try_from(length.min(LONGEST)).ok()?;
    miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(bytes, limit).ok()
}

/// The beginning of what bare DEFLATE unpacks to, as far as `bytes` reach.
pub(super) fn beginning(bytes: &[u8], length: usize) -> Vec<u8> {
    miniz_oxide::inflate::decompress_to_vec_with_limit(bytes, length)
        .unwrap_or_else(|error| error.output)
}
