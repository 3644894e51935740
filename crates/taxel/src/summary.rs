//! Derived quantities of a sensor file, as `taxel check` prints them.

use crate::layout::Mount;
use crate::sensor::{Sensor, Unreadable};

pub use taxel_ground::summary::{Fact, Value, fact, number, text};

/// All that `taxel check` prints of a sensor, in the order of the signal.
///
/// # Errors
/// [`Unreadable`] when the board cannot read the element; never after
/// [`Sensor::parse`].
pub fn summary(sensor: &Sensor) -> Result<Vec<Fact>, Unreadable> {
    let mut facts = device(sensor);
    facts.extend(sensor.device()?.facts());
    Ok(facts)
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
