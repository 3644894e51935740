//! Checks of packets: sums and cyclic redundancy checks.

use schemars::JsonSchema;
use serde::Deserialize;

/// Kind of a check. Cyclic redundancy checks have the names of the catalogue of parametrised
/// CRC algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum CheckKind {
    /// Sum of the bytes, 8 bits.
    #[serde(rename = "sum8")]
    Sum8,
    /// Sum of the bytes, 16 bits.
    #[serde(rename = "sum16")]
    Sum16,
    /// Two's complement of the sum of the bytes, 8 bits (LRC).
    #[serde(rename = "negated_sum8")]
    NegatedSum8,
    /// Exclusive or of the bytes, 8 bits.
    #[serde(rename = "xor8")]
    Xor8,
    /// Every byte has an even number of ones; its top bit is no data. No bytes of its own.
    #[serde(rename = "parity")]
    Parity,
    /// Polynomial 0x07.
    #[serde(rename = "CRC-8/SMBUS")]
    Crc8Smbus,
    /// Polynomial 0x31, reflected (Dallas).
    #[serde(rename = "CRC-8/MAXIM-DOW")]
    Crc8MaximDow,
    /// Polynomial 0x1021, initial value 0xffff (CCITT-FALSE).
    #[serde(rename = "CRC-16/IBM-3740")]
    Crc16Ibm3740,
    /// Polynomial 0x8005, reflected.
    #[serde(rename = "CRC-16/ARC")]
    Crc16Arc,
    /// Polynomial 0x8005, reflected, initial value 0xffff.
    #[serde(rename = "CRC-16/MODBUS")]
    Crc16Modbus,
    /// Polynomial 0x1021, initial value 0.
    #[serde(rename = "CRC-16/XMODEM")]
    Crc16Xmodem,
    /// Polynomial 0x04c11db7, reflected (Ethernet, zip).
    #[serde(rename = "CRC-32/ISO-HDLC")]
    Crc32IsoHdlc,
    /// Polynomial 0x1edc6f41, reflected (Castagnoli).
    #[serde(rename = "CRC-32/ISCSI")]
    Crc32Iscsi,
}

/// Parameters of a cyclic redundancy check.
struct Crc {
    width: u32,
    /// Polynomial, reflected where `reflected`.
    polynomial: u32,
    initial: u32,
    reflected: bool,
    final_xor: u32,
}

impl CheckKind {
    /// All kinds.
    pub const ALL: [Self; 13] = [
        Self::Sum8,
        Self::Sum16,
        Self::NegatedSum8,
        Self::Xor8,
        Self::Parity,
        Self::Crc8Smbus,
        Self::Crc8MaximDow,
        Self::Crc16Ibm3740,
        Self::Crc16Arc,
        Self::Crc16Modbus,
        Self::Crc16Xmodem,
        Self::Crc32IsoHdlc,
        Self::Crc32Iscsi,
    ];

    /// Its name in a board file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sum8 => "sum8",
            Self::Sum16 => "sum16",
            Self::NegatedSum8 => "negated_sum8",
            Self::Xor8 => "xor8",
            Self::Parity => "parity",
            Self::Crc8Smbus => "CRC-8/SMBUS",
            Self::Crc8MaximDow => "CRC-8/MAXIM-DOW",
            Self::Crc16Ibm3740 => "CRC-16/IBM-3740",
            Self::Crc16Arc => "CRC-16/ARC",
            Self::Crc16Modbus => "CRC-16/MODBUS",
            Self::Crc16Xmodem => "CRC-16/XMODEM",
            Self::Crc32IsoHdlc => "CRC-32/ISO-HDLC",
            Self::Crc32Iscsi => "CRC-32/ISCSI",
        }
    }

    /// Its bytes in a packet.
    pub fn bytes(self) -> usize {
        match self {
            Self::Parity => 0,
            Self::Sum8 | Self::NegatedSum8 | Self::Xor8 | Self::Crc8Smbus | Self::Crc8MaximDow => 1,
            Self::Sum16
            | Self::Crc16Ibm3740
            | Self::Crc16Arc
            | Self::Crc16Modbus
            | Self::Crc16Xmodem => 2,
            Self::Crc32IsoHdlc | Self::Crc32Iscsi => 4,
        }
    }

    fn crc(self) -> Option<Crc> {
        let crc = |width, polynomial, initial, reflected, final_xor| {
            Some(Crc {
                width,
                polynomial,
                initial,
                reflected,
                final_xor,
            })
        };
        match self {
            Self::Sum8 | Self::Sum16 | Self::NegatedSum8 | Self::Xor8 | Self::Parity => None,
            Self::Crc8Smbus => crc(8, 0x07, 0, false, 0),
            Self::Crc8MaximDow => crc(8, 0x8c, 0, true, 0),
            Self::Crc16Ibm3740 => crc(16, 0x1021, 0xffff, false, 0),
            Self::Crc16Arc => crc(16, 0xa001, 0, true, 0),
            Self::Crc16Modbus => crc(16, 0xa001, 0xffff, true, 0),
            Self::Crc16Xmodem => crc(16, 0x1021, 0, false, 0),
            Self::Crc32IsoHdlc => crc(32, 0xedb8_8320, u32::MAX, true, u32::MAX),
            Self::Crc32Iscsi => crc(32, 0x82f6_3b78, u32::MAX, true, u32::MAX),
        }
    }

    /// The check of `bytes`, in its lowest [`Self::bytes`]; for parity, 1 if a byte is wrong.
    ///
    /// ```
    /// use taxel_board::CheckKind;
    ///
    /// assert_eq!(CheckKind::Crc16Ibm3740.of(b"123456789"), 0x29b1);
    /// assert_eq!(CheckKind::Crc32IsoHdlc.of(b"123456789"), 0xcbf4_3926);
    /// ```
    pub fn of(self, bytes: &[u8]) -> u32 {
        let sum = || {
            bytes
                .iter()
                .fold(0_u32, |sum, byte| sum.wrapping_add(u32::from(*byte)))
        };
        match self {
            Self::Sum8 => sum() & 0xff,
            Self::Sum16 => sum() & 0xffff,
            Self::NegatedSum8 => sum().wrapping_neg() & 0xff,
            Self::Xor8 => u32::from(bytes.iter().fold(0, |all, byte| all ^ byte)),
            Self::Parity => u32::from(bytes.iter().any(|byte| byte.count_ones() % 2 != 0)),
            _ => self.crc().map_or(0, |crc| crc.of(bytes)),
        }
    }
}

impl Crc {
    fn of(&self, bytes: &[u8]) -> u32 {
        let mask = u32::MAX >> (32 - self.width);
        let mut crc = self.initial;
        for byte in bytes {
            if self.reflected {
                crc ^= u32::from(*byte);
                for _ in 0..8 {
                    let low = crc & 1;
                    crc = (crc >> 1) ^ if low == 1 { self.polynomial } else { 0 };
                }
            } else {
                crc ^= u32::from(*byte) << (self.width - 8);
                for _ in 0..8 {
                    let high = crc >> (self.width - 1) & 1;
                    crc = (crc << 1) ^ if high == 1 { self.polynomial } else { 0 };
                }
            }
        }
        (crc ^ self.final_xor) & mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published check values, over `123456789`.
    #[test]
    fn published_check_values() {
        for (kind, value) in [
            (CheckKind::Crc8Smbus, 0xf4),
            (CheckKind::Crc8MaximDow, 0xa1),
            (CheckKind::Crc16Ibm3740, 0x29b1),
            (CheckKind::Crc16Arc, 0xbb3d),
            (CheckKind::Crc16Modbus, 0x4b37),
            (CheckKind::Crc16Xmodem, 0x31c3),
            (CheckKind::Crc32IsoHdlc, 0xcbf4_3926),
            (CheckKind::Crc32Iscsi, 0xe306_9283),
            (CheckKind::Sum8, 0xdd),
            (CheckKind::NegatedSum8, 0x23),
            (CheckKind::Xor8, 0x31),
        ] {
            assert_eq!(kind.of(b"123456789"), value, "{kind:?}");
        }
    }

    /// Against the crate `crc`, on bytes of every length to 300.
    #[test]
    fn agree_with_another_implementation() {
        let bytes: Vec<u8> = (0..300_u32).map(|n| (n * n * 31 + n * 7) as u8).collect();
        for length in 0..bytes.len() {
            let bytes = &bytes[..length];
            let eight = |algorithm| u32::from(crc::Crc::<u8>::new(algorithm).checksum(bytes));
            let sixteen = |algorithm| u32::from(crc::Crc::<u16>::new(algorithm).checksum(bytes));
            let all = |algorithm| crc::Crc::<u32>::new(algorithm).checksum(bytes);
            for (kind, expected) in [
                (CheckKind::Crc8Smbus, eight(&crc::CRC_8_SMBUS)),
                (CheckKind::Crc8MaximDow, eight(&crc::CRC_8_MAXIM_DOW)),
                (CheckKind::Crc16Ibm3740, sixteen(&crc::CRC_16_IBM_3740)),
                (CheckKind::Crc16Arc, sixteen(&crc::CRC_16_ARC)),
                (CheckKind::Crc16Modbus, sixteen(&crc::CRC_16_MODBUS)),
                (CheckKind::Crc16Xmodem, sixteen(&crc::CRC_16_XMODEM)),
                (CheckKind::Crc32IsoHdlc, all(&crc::CRC_32_ISO_HDLC)),
                (CheckKind::Crc32Iscsi, all(&crc::CRC_32_ISCSI)),
            ] {
                assert_eq!(kind.of(bytes), expected, "{kind:?} of {length} bytes");
            }
        }
    }
}
