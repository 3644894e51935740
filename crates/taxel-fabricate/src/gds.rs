//! GDSII stream format: boundaries in one structure, one layer for each mask.

use crate::figures::Drawn;
use crate::text::ascii;

/// Layer of the notes.
const NOTES: i16 = 63;
/// Data type of the figures and of the marks.
const TYPES: [i16; 2] = [0, 1];
/// Most characters of a text.
const LONGEST: usize = 512;

/// The stream; `grid` in m is its unit, the notes stand at `at`, m, `step` below each other.
pub(crate) fn gds(
    masks: &[Drawn],
    grid: f64,
    notes: &[String],
    at: [f64; 2],
    step: f64,
) -> Vec<u8> {
    let mut stream = Stream(Vec::new());
    // No clock is read: the same sensor gives the same bytes.
    let time = [1970, 1, 1, 0, 0, 0, 1970, 1, 1, 0, 0, 0];
    stream.short(0x0002, &[600]);
    stream.short(0x0102, &time);
    stream.text(0x0206, "TAXEL");
    // A unit of the user is 1 um.
    let units: Vec<u8> = [grid / 1e-6, grid].into_iter().flat_map(real).collect();
    stream.record(0x0305, &units);
    stream.short(0x0502, &time);
    stream.text(0x0606, "MASKS");
    for mask in masks {
        for (kind, figures) in TYPES.into_iter().zip([&mask.figures, &mask.marks]) {
            for figure in figures {
                stream.record(0x0800, &[]);
                stream.short(0x0D02, &[mask.layer]);
                stream.short(0x0E02, &[kind]);
                let closed = figure.iter().chain([&figure[0]]);
                stream.long(0x1003, closed.flatten().copied());
                stream.record(0x1100, &[]);
            }
        }
    }
    for (line, note) in notes.iter().enumerate() {
        let place = [at[0], at[1] - step * line as f64];
        stream.record(0x0C00, &[]);
        stream.short(0x0D02, &[NOTES]);
        stream.short(0x1602, &[0]);
        stream.long(
            0x1003,
            place
                .map(|coordinate| (coordinate / grid).round() as i32)
                .into_iter(),
        );
        stream.text(0x1906, &note.chars().take(LONGEST).collect::<String>());
        stream.record(0x1100, &[]);
    }
    stream.record(0x0700, &[]);
    stream.record(0x0400, &[]);
    stream.0
}

struct Stream(Vec<u8>);

impl Stream {
    /// A record: its length, its kind, its data.
    fn record(&mut self, kind: u16, data: &[u8]) {
        self.0.extend((data.len() as u16 + 4).to_be_bytes());
        self.0.extend(kind.to_be_bytes());
        self.0.extend(data);
    }

    fn short(&mut self, kind: u16, values: &[i16]) {
        let data: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_be_bytes())
            .collect();
        self.record(kind, &data);
    }

    fn long(&mut self, kind: u16, values: impl Iterator<Item = i32>) {
        let data: Vec<u8> = values.flat_map(i32::to_be_bytes).collect();
        self.record(kind, &data);
    }

    /// Texts have an even number of bytes.
    fn text(&mut self, kind: u16, text: &str) {
        let mut data = ascii(text).into_bytes();
        if data.len() % 2 == 1 {
            data.push(0);
        }
        self.record(kind, &data);
    }
}

/// A number above zero in eight bytes: sign and exponent of 16 in excess of 64, then a fraction of
/// 56 bits.
fn real(value: f64) -> [u8; 8] {
    let (mut exponent, mut fraction) = (64_u8, value);
    while fraction >= 1.0 {
        fraction /= 16.0;
        exponent += 1;
    }
    while fraction < 1.0 / 16.0 {
        fraction *= 16.0;
        exponent -= 1;
    }
    // Below 2^56: a fraction of 53 bits never rounds up to 1.
    let mut bytes = ((fraction * 2.0_f64.powi(56)) as u64).to_be_bytes();
    bytes[0] = exponent;
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_the_format_prints_them() {
        // The two units that nearly every file has: 1e-3 and 1e-9.
        assert_eq!(real(1e-3), [0x3E, 0x41, 0x89, 0x37, 0x4B, 0xC6, 0xA7, 0xF0]);
        assert_eq!(real(1e-9)[..4], [0x39, 0x44, 0xB8, 0x2F]);
        assert_eq!(real(1.0), [0x41, 0x10, 0, 0, 0, 0, 0, 0]);
    }
}
