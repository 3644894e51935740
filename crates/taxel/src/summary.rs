//! Derived quantities of a sensor file, as `taxel check` prints them.

use crate::layout::Mount;
use crate::sensor::{Sensor, Unreadable};

pub use taxel_ground::summary::{Fact, Value, fact, number, text};

/// All that `taxel check` prints of a sensor: what it is good for, then the order of the signal.
///
/// # Errors
/// [`Unreadable`] when the board cannot read the element; never after
/// [`Sensor::parse`].
pub fn summary(sensor: &Sensor) -> Result<Vec<Fact>, Unreadable> {
    let of_device = sensor.device()?.facts();
    let mut facts = headline(&of_device);
    facts.extend(device(sensor));
    facts.extend(of_device);
    Ok(facts)
}

/// Facts that end the range of a kind of device, and what ends it there.
const RANGES: [(&str, &str); 5] = [
    ("full_scale", "full scale"),
    ("largest_force", "model"),
    ("range_force", "board"),
    ("row_highest_pressure", "model"),
    ("column_highest_pressure", "model"),
];
/// Facts that say how fine a kind of device reads.
const RESOLUTIONS: [&str; 9] = [
    "resolution_at_rest",
    "resolution_x",
    "resolution_y",
    "resolution_z",
    "resolution_force_live",
    "row_resolution",
    "column_resolution",
    "noise_of_a_pressure_at_rest",
    "deviation_of_force_z_at_rest",
];

/// The three things that are asked first: the range, the resolution, and what limits them. Of
/// several the least range and the coarsest resolution.
fn headline(facts: &[Fact]) -> Vec<Fact> {
    let si = |fact: &&Fact| match fact.value {
        Value::Number { si, .. } => si,
        Value::Text(_) => f64::NAN,
    };
    let named = |name: &str| {
        let mut found = facts.iter().filter(|fact| fact.name == name);
        found.find(|fact| si(fact).is_finite())
    };
    let found = RANGES
        .iter()
        .filter_map(|(name, end)| Some((named(name)?, *end)));
    let range = found.min_by(|a, b| si(&a.0).total_cmp(&si(&b.0)));
    let finest = RESOLUTIONS.iter().filter_map(|name| named(name));
    let noises = ["noise_x", "noise_y", "noise_z"];
    let resolution = finest.max_by(|a, b| si(a).total_cmp(&si(b))).or_else(|| {
        noises
            .iter()
            .filter_map(|name| named(name))
            .max_by(|a, b| si(a).total_cmp(&si(b)))
    });
    let of = |name: &str, found: &Fact| {
        let source = format!("{}: {}", found.name, found.source);
        fact("summary", name, found.value.clone(), source)
    };
    let unknown =
        |name: &str, source: &str| fact("summary", name, text("unknown"), source.to_owned());
    let noise = named("noise_of_a_reading").or(resolution);
    let noise = noise.map_or("not known", |fact| &fact.source);
    let limits = match range {
        Some((range, _)) => format!("range: {}; resolution: {noise}", range.source),
        None => format!("resolution: {noise}"),
    };
    vec![
        range.map_or_else(
            || unknown("range", "the sensor file states none"),
            |(range, _)| of("range", range),
        ),
        resolution.map_or_else(
            || {
                unknown(
                    "resolution",
                    "nothing follows from the drawing: taxel calibrate measures it",
                )
            },
            |resolution| of("resolution", resolution),
        ),
        fact(
            "summary",
            "limited_by",
            text(range.map_or("unknown", |(_, end)| end)),
            limits,
        ),
    ]
}

fn device(sensor: &Sensor) -> Vec<Fact> {
    let array = &sensor.array;
    let mount = match array.mount {
        Mount::Flat => String::from("flat"),
        Mount::Cylinder(cylinder) => {
            format!("on a cylinder of {:.4} mm radius", cylinder.radius * 1e3)
        }
    };
    vec![
        fact("device", "name", text(&sensor.name), "name"),
        fact(
            "device",
            "taxels",
            text(&format!("{} x {}", array.rows, array.columns)),
            "array",
        ),
        fact("device", "element", text(sensor.element.key()), "element"),
        fact("device", "mount", text(&mount), "array.mount"),
    ]
}
