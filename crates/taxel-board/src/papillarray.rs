//! Packets of Contactile's PapillArray, which describe themselves: tables of places, and
//! blocks at those places. Facts of langxin11/contactile-papillarray-ros2@3a58a0b3.

use crate::check::CheckKind;

pub(crate) const HEAD: [u8; 4] = [0x55, 0x66, 0x77, 0x88];
pub(crate) const TAIL: [u8; 4] = [0xaa, 0xbb, 0xcc, 0xdd];
/// Longest packet: two sensors of nine pillars have 607 bytes.
pub(crate) const LONGEST: usize = 4096;
/// Sensors and pillars that the values have places for.
pub(crate) const SENSORS: usize = 2;
const PILLARS: usize = 9;
/// Components of a pillar: force and displacement; of a sensor: force and torque.
const COMPONENTS: usize = 6;
const PER_SENSOR: usize = COMPONENTS * (PILLARS + 1);
/// Bytes of one body: a type and six numbers.
const BODY: usize = 2 + 4 * COMPONENTS;

/// What a packet says; NaN for sensors and pillars that it does not have.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reading {
    pub(crate) sequence: u64,
    /// Microseconds.
    pub(crate) time: u64,
    /// SI.
    pub(crate) values: Vec<f64>,
}

/// Names and units of the values.
pub(crate) fn values() -> Vec<(String, &'static str)> {
    let mut values = Vec::new();
    for sensor in 1..=SENSORS {
        for pillar in 1..=PILLARS {
            for (name, unit) in FORCE.into_iter().chain(SHIFT) {
                values.push((format!("s{sensor}.p{pillar}.{name}"), unit));
            }
        }
        for (name, unit) in FORCE.into_iter().chain(TORQUE) {
            values.push((format!("s{sensor}.{name}"), unit));
        }
    }
    values
}

const FORCE: [(&str, &str); 3] = [("fx", "N"), ("fy", "N"), ("fz", "N")];
const SHIFT: [(&str, &str); 3] = [("dx", "mm"), ("dy", "mm"), ("dz", "mm")];
const TORQUE: [(&str, &str); 3] = [("tx", "N mm"), ("ty", "N mm"), ("tz", "N mm")];
/// SI values of the units of the wire: N, and mm or N mm.
const SCALES: [f64; COMPONENTS] = [1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3];

/// Bytes that are read in order.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Bytes of a place in a table.
    place_size: usize,
}

impl Cursor<'_> {
    fn whole(&mut self, size: usize) -> Option<u64> {
        let bytes = self.bytes.get(self.at..self.at + size)?;
        self.at += size;
        Some(
            bytes
                .iter()
                .rev()
                .fold(0, |whole, byte| whole << 8 | u64::from(*byte)),
        )
    }

    fn place(&mut self) -> Option<usize> {
        self.whole(self.place_size).map(|place| place as usize)
    }

    /// A number of entries and the place of each; the first is where the table ends.
    fn table(&mut self, most: usize) -> Option<Vec<usize>> {
        let count = self.whole(2)? as usize;
        if count > most {
            return None;
        }
        (0..count).map(|_| self.place()).collect()
    }

    fn numbers(&mut self) -> Option<[f64; COMPONENTS]> {
        let mut numbers = [0.0; COMPONENTS];
        for number in &mut numbers {
            *number = f64::from(f32::from_bits(self.whole(4)? as u32));
        }
        numbers
            .iter()
            .all(|number| number.is_finite())
            .then_some(numbers)
    }

    /// A type and six numbers.
    fn body(&mut self) -> Option<[f64; COMPONENTS]> {
        (self.whole(2)? == 2).then_some(())?;
        self.numbers()
    }
}

/// Reads a whole packet, from head to tail: `None` where its check, or one of its places, is
/// wrong.
pub(crate) fn read(packet: &[u8]) -> Option<Reading> {
    let inside = packet.strip_prefix(&HEAD)?.strip_suffix(&TAIL)?;
    let (body, check) = inside.split_at_checked(inside.len().checked_sub(2)?)?;
    (u32::from(check[0]) | u32::from(check[1]) << 8 == CheckKind::Sum16.of(body)).then_some(())?;
    let mut cursor = Cursor {
        bytes: body,
        at: 0,
        place_size: 2,
    };
    cursor.place_size = match cursor.whole(1)? {
        size @ (2 | 4) => size as usize,
        _ => return None,
    };
    let mut places = [0; 3];
    for (place, kind) in places.iter_mut().zip([1, 3, 4]) {
        (cursor.whole(2)? == kind).then_some(())?;
        *place = cursor.place()?;
    }
    let [hub, pillars, sensors] = places;
    (cursor.at == hub).then_some(())?;
    let sequence = cursor.whole(4)?;
    let time = cursor.whole(8)?;
    let mut values = vec![f64::NAN; SENSORS * PER_SENSOR];
    let mut put = |at: usize, numbers: [f64; COMPONENTS]| {
        for (value, (number, scale)) in values[at..].iter_mut().zip(numbers.iter().zip(SCALES)) {
            *value = number * scale;
        }
    };
    (cursor.at == pillars).then_some(())?;
    let count = {
        let start = cursor.at;
        let blocks = cursor.table(SENSORS)?;
        for (sensor, block) in blocks.iter().enumerate() {
            (cursor.at == start + block).then_some(())?;
            let block = cursor.at;
            let bodies = cursor.table(PILLARS)?;
            for (pillar, body) in bodies.iter().enumerate() {
                (cursor.at == block + body).then_some(())?;
                put(sensor * PER_SENSOR + pillar * COMPONENTS, cursor.body()?);
            }
        }
        blocks.len()
    };
    let start = cursor.at;
    (start == sensors).then_some(())?;
    let bodies = cursor.table(SENSORS)?;
    (bodies.len() == count).then_some(())?;
    for (sensor, body) in bodies.iter().enumerate() {
        (cursor.at == start + body).then_some(())?;
        put(sensor * PER_SENSOR + PILLARS * COMPONENTS, cursor.body()?);
    }
    (cursor.at == body.len()).then_some(Reading {
        sequence,
        time,
        values,
    })
}

/// Writes a packet of the sensors and pillars that have values.
pub(crate) fn write(values: &[f64], sequence: u64, time: u64, out: &mut Vec<u8>) {
    let body = |at: usize| {
        let numbers = values.get(at..at + COMPONENTS)?;
        numbers
            .iter()
            .zip(SCALES)
            .any(|(number, _)| !number.is_nan())
            .then(|| {
                let mut bytes = vec![2, 0];
                for (number, scale) in numbers.iter().zip(SCALES) {
                    let number = if number.is_nan() { 0.0 } else { number / scale };
                    bytes.extend_from_slice(&(number as f32).to_le_bytes());
                }
                bytes
            })
    };
    // A pillar that reads nothing is one that is not there, if none behind it reads.
    let sensors: Vec<Vec<Vec<u8>>> = (0..SENSORS)
        .map(|sensor| {
            let bodies: Vec<_> = (0..PILLARS)
                .map(|pillar| body(sensor * PER_SENSOR + pillar * COMPONENTS))
                .collect();
            let count = bodies
                .iter()
                .rposition(Option::is_some)
                .map_or(0, |at| at + 1);
            let nothing = || {
                let mut bytes = vec![0; BODY];
                bytes[0] = 2;
                bytes
            };
            bodies
                .into_iter()
                .take(count)
                .map(|body| body.unwrap_or_else(nothing))
                .collect()
        })
        .collect();
    let count = sensors
        .iter()
        .rposition(|bodies| !bodies.is_empty())
        .map_or(1, |at| at + 1);
    let pillars: Vec<_> = sensors[..count]
        .iter()
        .map(|bodies| block(bodies))
        .collect();
    let totals: Vec<_> = (0..count)
        .map(|sensor| {
            body(sensor * PER_SENSOR + PILLARS * COMPONENTS).unwrap_or_else(|| {
                let mut bytes = vec![0; BODY];
                bytes[0] = 2;
                bytes
            })
        })
        .collect();
    let (pillars, totals) = (block(&pillars), block(&totals));
    let mut hub = (sequence as u32).to_le_bytes().to_vec();
    hub.extend_from_slice(&time.to_le_bytes());
    let mut inside = vec![2];
    let mut place = 1 + 3 * 4;
    for (kind, length) in [(1_u16, hub.len()), (3, pillars.len()), (4, totals.len())] {
        inside.extend_from_slice(&kind.to_le_bytes());
        inside.extend_from_slice(&(place as u16).to_le_bytes());
        place += length;
    }
    for part in [hub, pillars, totals] {
        inside.extend_from_slice(&part);
    }
    let check = CheckKind::Sum16.of(&inside) as u16;
    out.extend_from_slice(&HEAD);
    out.extend_from_slice(&inside);
    out.extend_from_slice(&check.to_le_bytes());
    out.extend_from_slice(&TAIL);
}

/// A table of places, and the parts at them.
fn block(parts: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = (parts.len() as u16).to_le_bytes().to_vec();
    let mut place = 2 + 2 * parts.len();
    for part in parts {
        bytes.extend_from_slice(&(place as u16).to_le_bytes());
        place += part.len();
    }
    for part in parts {
        bytes.extend_from_slice(part);
    }
    bytes
}
