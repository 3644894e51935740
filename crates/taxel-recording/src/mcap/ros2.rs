//! A recording as one for ROS 2: the standard messages that its tools know, and those of taxel behind them.

use std::io::{Read, Result, Write};

use super::TouchMessage;
use super::cdr::Encoder;
use super::message::Message as _;
use super::reader::McapReader;
use super::record::{MAGIC, code, put, put_map, put_text, put_u16, put_u32, put_u64};
use super::schemas::Topic;

/// Frame of the sensor in all heads.
const FRAME: &str = "taxel";

/// A topic of standard messages. Numbers of channels go on behind those of taxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Standard {
    Wrench,
    Image,
    Contacts,
}

impl Standard {
    const ALL: [Self; 3] = [Self::Wrench, Self::Image, Self::Contacts];

    fn number(self) -> u16 {
        100 + self as u16
    }

    /// Name, type, and definition of the type without the types in it.
    fn texts(self) -> [&'static str; 3] {
        match self {
            Self::Wrench => ["/taxel/wrench", "geometry_msgs/msg/WrenchStamped", WRENCH],
            Self::Image => ["/taxel/image", "sensor_msgs/msg/Image", IMAGE],
            Self::Contacts => ["/taxel/contacts", "sensor_msgs/msg/PointCloud2", POINTS],
        }
    }
}

/// Definition of a type with those that it uses.
fn definition(own: &str) -> String {
    let mut text = own.to_owned();
    // A type may use those behind it.
    for (name, fields) in PARTS {
        if text.contains(name) {
            let rule = "=".repeat(80);
            for part in [&rule, "\nMSG: ", name, "\n", fields] {
                text.push_str(part);
            }
        }
    }
    text
}

const WRENCH: &str = "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n";
const IMAGE: &str = "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n";
const POINTS: &str = "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n";
const PARTS: [(&str, &str); 5] = [
    (
        "std_msgs/Header",
        "builtin_interfaces/Time stamp\nstring frame_id\n",
    ),
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "geometry_msgs/Wrench",
        "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
    ),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "sensor_msgs/PointField",
        "string name\nuint32 offset\nuint8 datatype\nuint32 count\n",
    ),
];

fn head(fields: &mut Encoder<'_>, utc_ns: u64) {
    fields.time(utc_ns);
    fields.string(FRAME);
}

/// Codes of the states in which a value is no more than a bound: closed, out of range, saturated.
const BOUNDS: [u8; 3] = [2, 3, 8];
/// Code of a force that is one.
const EXACT: u8 = 0;

/// A force of which `certainty` is the code, not a number where it is no more than a bound: a standard message has no
/// place to say so.
fn exact(force: [f64; 3], certainty: Option<u8>) -> [f64; 3] {
    let bound = certainty.is_some_and(|code| code != EXACT);
    if bound { [f64::NAN; 3] } else { force }
}

/// The total that acts on the sensor, in its right-handed frame: what presses is negative along z.
fn wrench(touch: &TouchMessage, utc_ns: u64, out: &mut Vec<u8>) {
    let mut fields = Encoder::new(out);
    head(&mut fields, utc_ns);
    let certainty = touch.certainty.as_ref();
    let [force, moment] =
        [touch.force, touch.moment].map(|part| exact(part, certainty.map(|of| of.total)));
    let [x, y, pressing] = force;
    fields.f64s([x, y, -pressing]);
    fields.f64s(moment);
}

/// The values of the taxels, row 0 on top, as numbers of 32 bits.
fn image(touch: &TouchMessage, columns: usize, utc_ns: u64, out: &mut Vec<u8>) {
    let mut fields = Encoder::new(out);
    head(&mut fields, utc_ns);
    let each = usize::from(touch.components.max(1));
    let columns = columns.max(1);
    let rows = touch.values.len() / (each * columns);
    let step = 4 * each * columns;
    fields.u32(rows as u32);
    fields.u32(columns as u32);
    fields.string(if each == 3 { "32FC3" } else { "32FC1" });
    fields.u8(0);
    fields.u32(step as u32);
    let values = touch.values.iter().take(rows * columns * each).enumerate();
    let data = values.flat_map(|(place, value)| {
        let state = touch.states.get(place / each);
        let bound = state.is_some_and(|state| BOUNDS.contains(state));
        if bound { f32::NAN } else { *value }.to_le_bytes()
    });
    let data: Vec<u8> = data.collect();
    fields.bytes(&data);
}

/// Numbers of a contact, in their order in a point.
const FIELDS: [&str; 8] = [
    "x",
    "y",
    "z",
    "force_x",
    "force_y",
    "force_z",
    "force_z_deviation",
    "id",
];

/// The contacts as points: on a cylinder, on its developed surface.
fn contacts(touch: &TouchMessage, utc_ns: u64, out: &mut Vec<u8>) {
    let contacts = &touch.contacts;
    let mut fields = Encoder::new(out);
    head(&mut fields, utc_ns);
    let step = 4 * FIELDS.len();
    fields.u32(1);
    fields.u32(contacts.len() as u32);
    fields.count(FIELDS.len());
    for (place, name) in FIELDS.iter().enumerate() {
        fields.string(name);
        fields.u32(4 * place as u32);
        // The code of numbers of 32 bits with a point.
        fields.u8(7);
        fields.u32(1);
    }
    fields.bool(false);
    fields.u32(step as u32);
    fields.u32((step * contacts.len()) as u32);
    let mut data = Vec::with_capacity(step * contacts.len());
    for (number, contact) in contacts.iter().enumerate() {
        let certainty = touch.certainty.as_ref();
        let certainty = certainty.and_then(|of| of.contacts.get(number).copied());
        let [x, y] = contact.centre;
        let [force_x, force_y, force_z] = exact(contact.force, certainty);
        let deviation = contact.force_deviation[2];
        for value in [
            x,
            y,
            0.0,
            force_x,
            force_y,
            force_z,
            deviation,
            contact.id as f64,
        ] {
            data.extend((value as f32).to_le_bytes());
        }
    }
    fields.bytes(&data);
    fields.bool(true);
}

fn channel(out: &mut Vec<u8>, number: u16, [name, kind]: [&str; 2], definition: &str) {
    put(out, code::SCHEMA, |out| {
        put_u16(out, number);
        put_text(out, kind);
        put_text(out, "ros2msg");
        put_text(out, definition);
    });
    put(out, code::CHANNEL, |out| {
        put_u16(out, number);
        put_u16(out, number);
        put_text(out, name);
        put_text(out, "cdr");
        put_map(out, &[]);
    });
}

/// Writes the messages of a recording, whose array has so many columns of taxels, with standard messages
/// of ROS 2 for each touch: `geometry_msgs/WrenchStamped` of the total, `sensor_msgs/Image` of the values and
/// `sensor_msgs/PointCloud2` of the contacts. Stamps are UTC of this computer. Returns how many frames have
/// such messages.
///
/// # Errors
/// Those of the recording and of `out`.
pub fn write_ros2<R: Read>(
    mut reader: McapReader<R>,
    columns: usize,
    library: &str,
    mut out: impl Write,
) -> Result<u64> {
    let mut records = MAGIC.to_vec();
    put(&mut records, code::HEADER, |out| {
        put_text(out, "ros2");
        put_text(out, library);
    });
    for topic in Topic::ALL {
        let names = [topic.name(), topic.type_name()];
        channel(&mut records, topic.number(), names, &topic.definition());
    }
    for topic in Standard::ALL {
        let [name, kind, own] = topic.texts();
        channel(&mut records, topic.number(), [name, kind], &definition(own));
    }
    let mut frames = 0;
    let mut body = Vec::new();
    while let Some(entry) = reader.next()? {
        let mut message = |channel: u16, sequence: u32, bytes: &[u8]| {
            put(&mut records, code::MESSAGE, |out| {
                put_u16(out, channel);
                put_u32(out, sequence);
                put_u64(out, entry.log_time);
                put_u64(out, entry.publish_time);
                out.extend_from_slice(bytes);
            });
        };
        message(entry.topic.number(), entry.sequence, entry.bytes);
        let touch = (entry.topic == Topic::Touch).then(|| TouchMessage::decode(entry.bytes));
        if let Some(touch) = touch.flatten() {
            for topic in Standard::ALL {
                body.clear();
                match topic {
                    Standard::Wrench => wrench(&touch, entry.log_time, &mut body),
                    Standard::Image => image(&touch, columns, entry.log_time, &mut body),
                    Standard::Contacts => contacts(&touch, entry.log_time, &mut body),
                }
                message(topic.number(), entry.sequence, &body);
            }
            frames += 1;
        }
        out.write_all(&records)?;
        records.clear();
    }
    put(&mut records, code::DATA_END, |out| put_u32(out, 0));
    put(&mut records, code::FOOTER, |out| {
        // Without a summary: readers go through the file.
        put_u64(out, 0);
        put_u64(out, 0);
        put_u32(out, 0);
    });
    records.extend_from_slice(&MAGIC);
    out.write_all(&records)?;
    Ok(frames)
}

#[cfg(test)]
mod tests {
    use super::super::{CertaintyMessage, ContactMessage};
    use super::*;

    /// Numbers of 4 bytes at the end of a message, before `after` bytes more.
    fn last(bytes: &[u8], count: usize, after: usize) -> Vec<f32> {
        let bytes = &bytes[..bytes.len() - after];
        let bytes = &bytes[bytes.len() - 4 * count..];
        bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect()
    }

    #[test]
    fn what_is_no_more_than_a_bound_is_no_number_of_a_standard_message() {
        for (code, state) in [(0, 0), (1, 8), (2, 2)] {
            let touch = TouchMessage {
                components: 1,
                values: vec![1.0, 2.0],
                states: vec![0, state],
                force: [0.0, 0.0, 3.0],
                contacts: vec![ContactMessage {
                    force: [0.0, 0.0, 3.0],
                    ..ContactMessage::default()
                }],
                certainty: Some(CertaintyMessage {
                    total: code,
                    contacts: vec![code],
                    ..CertaintyMessage::default()
                }),
                ..TouchMessage::default()
            };
            let is_exact = code == 0;
            let mut body = Vec::new();
            wrench(&touch, 0, &mut body);
            let z = &body[body.len() - 32..body.len() - 24];
            let z = f64::from_le_bytes(z.try_into().unwrap());
            assert_eq!((z == -3.0, z.is_nan()), (is_exact, !is_exact), "{code}");
            body.clear();
            image(&touch, 2, 0, &mut body);
            let found = last(&body, 2, 0);
            assert_eq!((found[0], found[1].is_nan()), (1.0, !is_exact), "{state}");
            body.clear();
            contacts(&touch, 0, &mut body);
            // Behind the numbers of the point is whether all are known.
            let found = last(&body, FIELDS.len(), 1);
            assert_eq!(
                (found[5] == 3.0, found[5].is_nan()),
                (is_exact, !is_exact),
                "{code}"
            );
        }
    }
}
