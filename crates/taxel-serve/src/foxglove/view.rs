//! A frame as messages of the types that Foxglove draws.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD as STANDARD;
use serde_json::{Map, Value, json};
use taxel::estimation::{Certainty, Meaning, State};
use taxel::layout::{Layout, TaxelFrame};
use taxel_recording::mcap::{Companion, CompanionTopic, TouchMessage};

use crate::events::EventRecord;
use crate::message::{CONTACT, HEADER};
use crate::out::{Columns, ContactOfFrame, FrameMessage};

/// Schemas of the types of Foxglove that are sent, from the package `@foxglove/schemas` (MIT) without
/// their words.
const SCHEMAS: &str = include_str!("schemas.json");
/// Frame of the sensor, and that of its mount.
const SENSOR: &str = "taxel";
const MOUNT: &str = "mount";

/// A topic; its channel is its place in [`Topic::ALL`], counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Topic {
    Frame,
    Events,
    Grid,
    Image,
    Scene,
    Transform,
}

impl Topic {
    const ALL: [Self; 6] = [
        Self::Frame,
        Self::Events,
        Self::Grid,
        Self::Image,
        Self::Scene,
        Self::Transform,
    ];

    /// Those that a recording has one of for each touch, beside our own.
    const RECORDED: [Self; 4] = [Self::Grid, Self::Image, Self::Scene, Self::Transform];

    pub(super) fn of_channel(channel: u32) -> Option<Self> {
        let place = usize::try_from(channel).ok()?.checked_sub(1)?;
        Self::ALL.get(place).copied()
    }

    /// Its name, and that of its type.
    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Frame => ["/taxel/frame", "taxel.Frame"],
            Self::Events => ["/taxel/events", "taxel.Event"],
            Self::Grid => ["/taxel/grid", "foxglove.Grid"],
            Self::Image => ["/taxel/image", "foxglove.RawImage"],
            Self::Scene => ["/taxel/scene", "foxglove.SceneUpdate"],
            Self::Transform => ["/tf", "foxglove.FrameTransform"],
        }
    }
}

/// What turns frames into messages.
#[derive(Debug)]
pub(crate) struct View {
    layout: Layout,
    components: usize,
    full_scale: Option<f64>,
    columns: Columns,
}

/// What is drawn of a frame.
struct Drawn {
    values: Vec<f32>,
    deviations: Vec<f32>,
    states: Vec<u8>,
    contacts: Vec<ContactOfFrame>,
}

impl Drawn {
    fn of_frame(frame: &FrameMessage<'_>) -> Self {
        Self {
            values: frame.values().collect(),
            deviations: frame.deviations().collect(),
            states: frame.states().collect(),
            contacts: frame.contacts().collect(),
        }
    }

    fn of_touch(touch: &TouchMessage) -> Self {
        let codes = touch.certainty.as_ref().map(|of| &*of.contacts);
        let name = |place: usize| {
            let code = usize::from(*codes?.get(place)?);
            Certainty::ALL.get(code).map(|certainty| certainty.name())
        };
        let contacts = touch.contacts.iter().enumerate();
        let contacts = contacts.map(|(place, contact)| ContactOfFrame {
            id: contact.id,
            centre: contact.centre,
            force: contact.force,
            force_deviation: contact.force_deviation,
            certainty: name(place),
        });
        Self {
            values: touch.values.clone(),
            deviations: touch.deviations.clone(),
            states: touch.states.clone(),
            contacts: contacts.collect(),
        }
    }
}

/// A value of JSON of the kind of another, as a schema.
fn kind_of(value: &Value) -> Value {
    match value {
        Value::String(_) => json!({"type": "string"}),
        Value::Bool(_) => json!({"type": "boolean"}),
        Value::Array(members) => {
            let of = members.first().map_or(json!({"type": "number"}), kind_of);
            json!({"type": "array", "items": of})
        }
        Value::Object(fields) => {
            let fields = fields
                .iter()
                .map(|(name, value)| (name.clone(), kind_of(value)));
            json!({"type": "object", "properties": fields.collect::<Map<_, _>>()})
        }
        Value::Null | Value::Number(_) => json!({"type": "number"}),
    }
}

fn vector([x, y, z]: [f64; 3]) -> Value {
    json!({"x": x, "y": y, "z": z})
}

fn time(utc_ns: u64) -> Value {
    json!({"sec": utc_ns / 1_000_000_000, "nsec": utc_ns % 1_000_000_000})
}

/// The rotation of the x axis onto a unit vector, as a quaternion.
fn turned_to([x, y, z]: [f64; 3]) -> Value {
    // Half-way between the two; about z where they are opposed.
    let [i, j, k, w] = if x > -1.0 + f64::EPSILON {
        let size = (2.0 * (1.0 + x)).sqrt();
        [0.0, -z / size, y / size, size / 2.0]
    } else {
        [0.0, 0.0, 1.0, 0.0]
    };
    json!({"x": i, "y": j, "z": k, "w": w})
}

/// Number and pressing force of a contact, which may be a bound or unknown.
fn labelled(contact: &ContactOfFrame) -> String {
    let (id, force, deviation) = (contact.id, contact.force[2], contact.force_deviation[2]);
    match contact.certainty {
        Some("exact") => format!("{id}: {force:.3} ± {deviation:.3}"),
        Some("at_least") => format!("{id}: at least {force:.3}"),
        _ => format!("{id}: not known"),
    }
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// A force (x, y, pressing) at a taxel as a vector of the sensor.
fn force_vector(frame: &TaxelFrame, force: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        force[0] * frame.along_x[i] + force[1] * frame.along_y[i] - force[2] * frame.normal[i]
    })
}

impl View {
    pub(crate) fn new(meaning: &Meaning) -> Self {
        Self {
            layout: meaning.layout.clone(),
            components: meaning.components,
            full_scale: meaning.full_scale,
            columns: Columns::new(meaning),
        }
    }

    /// The topics, with their types.
    pub(super) fn advertised(&self) -> String {
        let channels = (1..).zip(Topic::ALL).map(|(id, topic)| {
            let [name, kind] = topic.names();
            json!({
                "id": id,
                "topic": name,
                "encoding": "json",
                "schemaName": kind,
                "schema": self.schema(topic),
                "schemaEncoding": "jsonschema",
            })
        });
        json!({"op": "advertise", "channels": channels.collect::<Vec<_>>()}).to_string()
    }

    /// The schema of a topic.
    fn schema(&self, topic: Topic) -> String {
        let known: Map<String, Value> = serde_json::from_str(SCHEMAS).unwrap_or_default();
        let schema = known.get(topic.names()[1]).cloned();
        schema.unwrap_or_else(|| self.own_schema(topic)).to_string()
    }

    /// The schema of a message of our own: that of one with a contact.
    fn own_schema(&self, topic: Topic) -> Value {
        let text = if topic == Topic::Events {
            EventRecord::sample().json()
        } else {
            let mut bytes = vec![0; HEADER + CONTACT];
            bytes[6] = 1;
            let mut text = String::new();
            FrameMessage(&bytes).json(&self.columns, "in_step", &mut text);
            text
        };
        kind_of(&serde_json::from_str(&text).unwrap_or_default())
    }

    /// The messages of a topic for a frame.
    pub(super) fn messages(
        &self,
        topic: Topic,
        bytes: &[u8],
        utc_ns: u64,
        events: &[EventRecord],
    ) -> Vec<String> {
        let frame = FrameMessage(bytes);
        vec![match topic {
            Topic::Frame => {
                let mut text = String::new();
                frame.json(&self.columns, "", &mut text);
                text
            }
            Topic::Events => return events.iter().map(EventRecord::json).collect(),
            topic => self.drawn(topic, &Drawn::of_frame(&frame), utc_ns),
        }]
    }

    /// The message of a topic that is drawn.
    fn drawn(&self, topic: Topic, drawn: &Drawn, utc_ns: u64) -> String {
        let message = match topic {
            Topic::Frame | Topic::Events => Value::Null,
            Topic::Grid => self.grid(drawn, utc_ns),
            Topic::Image => self.image(drawn, utc_ns),
            Topic::Scene => self.scene(drawn, utc_ns),
            Topic::Transform => json!({
                "timestamp": time(utc_ns),
                "parent_frame_id": MOUNT,
                "child_frame_id": SENSOR,
                "translation": vector([0.0; 3]),
                "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
            }),
        };
        message.to_string()
    }

    /// Value of each taxel: x, y, pressing.
    fn values(&self, numbers: &[f32]) -> Vec<[f32; 3]> {
        let of_taxel = |numbers: &[f32]| match *numbers {
            [x, y, z] => [x, y, z],
            [z] => [0.0, 0.0, z],
            _ => [f32::NAN; 3],
        };
        numbers.chunks(self.components).map(of_taxel).collect()
    }

    /// Force, deviation of its pressing part and state of each taxel, on the developed surface.
    fn grid(&self, drawn: &Drawn, utc_ns: u64) -> Value {
        let Layout {
            rows,
            columns,
            pitch: [x, y],
            ..
        } = self.layout;
        let values = self.values(&drawn.values);
        let deviations = self.values(&drawn.deviations);
        let states = &drawn.states;
        let mut data = Vec::new();
        // The first row of a grid is at its least y, ours at the greatest.
        for (row, column) in (0..rows)
            .rev()
            .flat_map(|row| (0..columns).map(move |at| (row, at)))
        {
            let at = row * columns + column;
            let value = values.get(at).copied().unwrap_or([f32::NAN; 3]);
            let deviation = deviations.get(at).map_or(f32::NAN, |value| value[2]);
            let state = states.get(at).copied().map_or(f32::NAN, f32::from);
            for number in value.into_iter().chain([deviation, state]) {
                data.extend(number.to_le_bytes());
            }
        }
        let names = ["x", "y", "z", "deviation_z", "state"];
        // 7 is the code of numbers of 32 bits with a point.
        let fields = (0..)
            .zip(names)
            .map(|(place, name)| json!({"name": name, "offset": 4 * place, "type": 7}));
        let corner = [-0.5 * columns as f64 * x, -0.5 * rows as f64 * y, 0.0];
        json!({
            "timestamp": time(utc_ns),
            "frame_id": SENSOR,
            "pose": {"position": vector(corner), "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}},
            "column_count": columns,
            "cell_size": {"x": x, "y": y},
            "row_stride": 4 * names.len() * columns,
            "cell_stride": 4 * names.len(),
            "fields": fields.collect::<Vec<_>>(),
            "data": STANDARD.encode(&data),
        })
    }

    /// Pressing values as an image, row 0 on top.
    fn image(&self, drawn: &Drawn, utc_ns: u64) -> Value {
        // An image has no place for the state of a value: what is a bound is left out.
        let values = self.values(&drawn.values).into_iter().zip(&drawn.states);
        let data = values.flat_map(|([_, _, z], state)| {
            let bound = State::ALL
                .get(usize::from(*state))
                .is_some_and(|state| state.is_bound());
            if bound { f32::NAN } else { z }.to_le_bytes()
        });
        let data: Vec<u8> = data.collect();
        json!({
            "timestamp": time(utc_ns),
            "frame_id": SENSOR,
            "width": self.layout.columns,
            "height": self.layout.rows,
            "encoding": "32FC1",
            "step": 4 * self.layout.columns,
            "data": STANDARD.encode(&data),
        })
    }

    /// An arrow for each taxel, which ends at it, and a ball with its force for each contact.
    fn scene(&self, drawn: &Drawn, utc_ns: u64) -> Value {
        let pitch = self.layout.pitch[0].min(self.layout.pitch[1]);
        let vectors = self.layout.frames.iter().zip(self.values(&drawn.values));
        let vectors: Vec<_> = vectors
            .map(|(at, value)| (at.position, force_vector(at, value.map(f64::from))))
            .filter(|(_, vector)| length(*vector) > 0.0)
            .collect();
        let largest = vectors
            .iter()
            .map(|(_, vector)| length(*vector))
            .fold(0.0, f64::max);
        // The full scale is two pitches long; without one, the largest of the frame.
        let scale = 2.0 * pitch / self.full_scale.unwrap_or(largest).max(f64::MIN_POSITIVE);
        let colour =
            |red: f64, green: f64, blue: f64| json!({"r": red, "g": green, "b": blue, "a": 1.0});
        let arrows = vectors.iter().map(|(position, vector_n)| {
            let size = length(*vector_n);
            let direction = vector_n.map(|part| part / size);
            let long = size * scale;
            let tail = std::array::from_fn(|i| position[i] - long * direction[i]);
            json!({
                "pose": {"position": vector(tail), "orientation": turned_to(direction)},
                "shaft_length": 0.7 * long,
                "shaft_diameter": 0.1 * pitch,
                "head_length": 0.3 * long,
                "head_diameter": 0.25 * pitch,
                "color": colour(0.9, 0.3, 0.1),
            })
        });
        let arrows: Vec<Value> = arrows.collect();
        let (mut spheres, mut texts) = (Vec::new(), Vec::new());
        for contact in &drawn.contacts {
            let [x, y] = contact.centre;
            if !(x.is_finite() && y.is_finite()) {
                continue;
            }
            let pose = |z: f64| json!({"position": vector([x, y, z]), "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}});
            spheres.push(json!({"pose": pose(0.0), "size": vector([0.5 * pitch; 3]), "color": colour(0.1, 0.5, 0.9)}));
            texts.push(json!({
                "pose": pose(pitch),
                "billboard": true,
                "font_size": 0.5 * pitch,
                "scale_invariant": false,
                "color": colour(1.0, 1.0, 1.0),
                "text": labelled(contact),
            }));
        }
        json!({
            "deletions": [],
            "entities": [{
                "timestamp": time(utc_ns),
                "frame_id": SENSOR,
                "id": "touch",
                "lifetime": {"sec": 0, "nsec": 0},
                "frame_locked": true,
                "metadata": [],
                "arrows": arrows,
                "cubes": [],
                "spheres": spheres,
                "cylinders": [],
                "lines": [],
                "triangles": [],
                "texts": texts,
                "models": [],
            }],
        })
    }
}

impl Companion for View {
    fn topics(&self) -> Vec<CompanionTopic> {
        let topic = |(number, topic): (u16, Topic)| {
            let [name, type_name] = topic.names();
            CompanionTopic {
                number,
                name,
                type_name,
                encodings: ["json", "jsonschema"],
                definition: self.schema(topic),
            }
        };
        // Behind those for ROS 2.
        (110..).zip(Topic::RECORDED).map(topic).collect()
    }

    fn encode(&self, place: usize, touch: &TouchMessage, utc_ns: u64, out: &mut Vec<u8>) {
        if let Some(topic) = Topic::RECORDED.get(place) {
            let text = self.drawn(*topic, &Drawn::of_touch(touch), utc_ns);
            out.extend_from_slice(text.as_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_point_along_their_force() {
        for direction in [
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 0.0, -1.0],
            [0.6, -0.8, 0.0],
            [0.0, 0.6, 0.8],
        ] {
            let turned = turned_to(direction);
            let [i, j, k, w] = ["x", "y", "z", "w"].map(|key| turned[key].as_f64().unwrap());
            // The first column of the matrix of a quaternion.
            let x = [
                1.0 - 2.0 * (j * j + k * k),
                2.0 * (i * j + k * w),
                2.0 * (i * k - j * w),
            ];
            for (found, wanted) in x.iter().zip(direction) {
                // Rounding of a few operations on numbers of size one.
                assert!((found - wanted).abs() < 1e-12, "{direction:?} {x:?}");
            }
        }
    }
}
