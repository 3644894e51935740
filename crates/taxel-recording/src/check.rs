//! CRC-32/ISO-HDLC, by which recordings and archives are checked.

/// Bytes that are taken at once.
const WIDTH: usize = 8;

/// Remainders of each byte, followed by 0 to 7 bytes of zeros.
const TABLES: [[u32; 256]; WIDTH] = tables();

const fn tables() -> [[u32; 256]; WIDTH] {
    let mut tables = [[0; 256]; WIDTH];
    let mut byte = 0;
    while byte < 256 {
        let mut remainder = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            let carried = remainder & 1 == 1;
            remainder >>= 1;
            if carried {
                remainder ^= 0xedb8_8320;
            }
            bit += 1;
        }
        tables[0][byte] = remainder;
        byte += 1;
    }
    let mut table = 1;
    while table < WIDTH {
        let mut byte = 0;
        while byte < 256 {
            let before = tables[table - 1][byte];
            tables[table][byte] = (before >> 8) ^ tables[0][(before & 0xff) as usize];
            byte += 1;
        }
        table += 1;
    }
    tables
}

/// The check value of `bytes`.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    let mut remainder = !0_u32;
    let (eights, rest) = bytes.as_chunks::<WIDTH>();
    for eight in eights {
        let number = u64::from_le_bytes(*eight) ^ u64::from(remainder);
        let parts = number.to_le_bytes();
        remainder = (0..WIDTH).fold(0, |sum, at| {
            sum ^ TABLES[WIDTH - 1 - at][usize::from(parts[at])]
        });
    }
    for byte in rest {
        let at = (remainder ^ u32::from(*byte)) & 0xff;
        remainder = (remainder >> 8) ^ TABLES[0][at as usize];
    }
    !remainder
}

#[cfg(test)]
mod tests {
    use super::crc32;

    #[test]
    fn the_published_check_value_comes_out() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b""), 0);
        // The crate that other programs use, over all lengths of a remainder.
        let bytes: Vec<u8> = (0..2000_u32).map(|at| ((at * at) >> 3) as u8).collect();
        for length in 0..64 {
            assert_eq!(crc32(&bytes[length..]), crc32fast::hash(&bytes[length..]));
        }
    }
}
