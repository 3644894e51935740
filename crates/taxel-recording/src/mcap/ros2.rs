//! The standard messages that the tools of ROS 2 know.

use super::TouchMessage;
use super::cdr::Encoder;
use super::companion::{Companion, CompanionTopic};
use super::schemas::FIRST_BESIDE;

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
        FIRST_BESIDE + self as u16
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

/// Standard messages of ROS 2 for each touch of an array: `geometry_msgs/WrenchStamped` of the total,
/// `sensor_msgs/Image` of the values and `sensor_msgs/PointCloud2` of the contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ros2Messages {
    /// Columns of taxels.
    pub columns: usize,
}

impl Companion for Ros2Messages {
    fn topics(&self) -> Vec<CompanionTopic> {
        let topic = |topic: Standard| {
            let [name, type_name, own] = topic.texts();
            CompanionTopic {
                number: topic.number(),
                name,
                type_name,
                encodings: ["cdr", "ros2msg"],
                definition: definition(own),
            }
        };
        Standard::ALL.into_iter().map(topic).collect()
    }

    fn encode(&self, place: usize, touch: &TouchMessage, utc_ns: u64, out: &mut Vec<u8>) {
        match Standard::ALL.get(place) {
            Some(Standard::Wrench) => wrench(touch, utc_ns, out),
            Some(Standard::Image) => image(touch, self.columns, utc_ns, out),
            Some(Standard::Contacts) => contacts(touch, utc_ns, out),
            None => {}
        }
    }
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
