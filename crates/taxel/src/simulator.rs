//! A sensor for simulators of robots: bodies and sites for MuJoCo, and places as JSON for any other.
//!
//! A simulator knows rigid bodies and points of contact. Each taxel becomes a body with a force
//! sensor; layers, permittivities and noise stay here, where
//! [`crate::sensor::Sensor::loads_from_contacts`] and the twin have them.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use crate::layout::{Layout, TaxelFrame};
use crate::sensor::Sensor;
use crate::svg::escape;
use crate::table;

/// Thickness of the box of a taxel, as a share of the smaller pitch: the face of contact is the
/// upper one, at the surface of the sensor.
const THICKNESS: f64 = 0.25;

/// Part of a model of MuJoCo (MJCF) to include in a robot: a body, a box and a site for each taxel,
/// named `taxel_r_c`, and sensors of the three force axes of each; `friction` is that of sliding.
///
/// The sensor of a taxel reads in its own frame: along x, along y, along the outward normal; a
/// press is negative along it. The box of a taxel is as large as its cell, its upper face lies on
/// the surface of the sensor.
///
/// # Example
/// ```
/// let sensor = taxel::sensor::Sensor::shipped("three-axis-8x8").unwrap();
/// let model = taxel::simulator::mjcf(&sensor, 1.0);
/// assert_eq!(model.matches("<site name=\"taxel_").count(), 64);
/// ```
pub fn mjcf(sensor: &Sensor, friction: f64) -> String {
    let layout = sensor.layout();
    let [x, y] = layout.pitch;
    let half = 0.5 * THICKNESS * x.min(y);
    let mut text = format!(
        "<mujoco model=\"{}\">\n  <worldbody>\n    <body name=\"taxel_sensor\">\n",
        escape(&sensor.name)
    );
    for taxel in 0..layout.taxels() {
        let name = name(&layout, taxel);
        let frame = &layout.frames[taxel];
        let _ = write!(
            text,
            "      <body name=\"{name}\" pos=\"{}\" quat=\"{}\">\n        \
             <geom name=\"{name}\" type=\"box\" size=\"{} {} {half}\" pos=\"0 0 {}\" friction=\"{friction} 0.005 0.0001\"/>\n        \
             <site name=\"{name}\" pos=\"0 0 0\" size=\"{}\"/>\n      </body>\n",
            numbers(&frame.position),
            numbers(&quaternion(frame)),
            0.5 * x,
            0.5 * y,
            -half,
            0.1 * x.min(y),
        );
    }
    text.push_str("    </body>\n  </worldbody>\n  <sensor>\n");
    for taxel in 0..layout.taxels() {
        let name = name(&layout, taxel);
        let _ = writeln!(text, "    <force name=\"{name}\" site=\"{name}\"/>");
    }
    text.push_str("  </sensor>\n</mujoco>\n");
    text
}

/// Poses of the taxels and what an engine must know beside them, as JSON in SI units: `poses` has a
/// row x, y, z, qw, qx, qy, qz for each taxel in the frame of the sensor, row by row.
pub fn places(sensor: &Sensor, about: &Map<String, Value>) -> String {
    let layout = sensor.layout();
    let pose = |frame: &TaxelFrame| -> Vec<f64> {
        frame
            .position
            .into_iter()
            .chain(quaternion(frame))
            .collect()
    };
    let names: Vec<_> = (0..layout.taxels())
        .map(|taxel| name(&layout, taxel))
        .collect();
    let noise = crate::summary::summary(sensor).ok().and_then(|facts| {
        let fact = facts
            .into_iter()
            .find(|fact| fact.name == "resolution_at_rest" || fact.name == "resolution_z")?;
        match fact.value {
            crate::summary::Value::Number { si, .. } => Some(si),
            crate::summary::Value::Text(_) => None,
        }
    });
    let mut whole = about.clone();
    let rest = json!({
        "rows": layout.rows,
        "columns": layout.columns,
        "pitch_m": layout.pitch,
        "frame": "x along the columns, y from the last row to row 0, z outwards, origin at the centre of the array on its surface",
        "names": names,
        "poses_columns": ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"],
        "poses": layout.frames.iter().map(pose).collect::<Vec<_>>(),
        "force_columns": ["along_x_n", "along_y_n", "pressing_n"],
        "frame_period_s": sensor.electronics.period(),
        "noise_n": noise,
    });
    if let Value::Object(rest) = rest {
        whole.extend(rest);
    }
    table::json(&Value::Object(whole))
}

fn name(layout: &Layout, taxel: usize) -> String {
    format!(
        "taxel_{}_{}",
        taxel / layout.columns,
        taxel % layout.columns
    )
}

/// The turn of a taxel's frame, which is about y alone: w, x, y, z.
fn quaternion(frame: &TaxelFrame) -> [f64; 4] {
    let half = 0.5 * frame.normal[0].atan2(frame.normal[2]);
    [half.cos(), 0.0, half.sin(), 0.0]
}

fn numbers(values: &[f64]) -> String {
    let texts: Vec<String> = values.iter().map(f64::to_string).collect();
    texts.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{ArrayDescription, Cylinder, Mount};

    #[test]
    fn quaternions_turn_the_axes_onto_those_of_the_taxels() {
        let layout = Layout::new(&ArrayDescription {
            rows: 2,
            columns: 8,
            pitch: [2e-3; 2],
            mount: Mount::Cylinder(Cylinder {
                radius: 4e-3,
                unstretched_plane: None,
            }),
        });
        for frame in &layout.frames {
            let [w, x, y, z] = quaternion(frame);
            // Columns of the matrix of a turn.
            let along_x = [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y + w * z),
                2.0 * (x * z - w * y),
            ];
            let normal = [
                2.0 * (x * z + w * y),
                2.0 * (y * z - w * x),
                1.0 - 2.0 * (x * x + y * y),
            ];
            for (found, expected) in [(along_x, frame.along_x), (normal, frame.normal)] {
                for axis in 0..3 {
                    assert!(
                        (found[axis] - expected[axis]).abs() < 1e-14,
                        "{found:?} {expected:?}"
                    );
                }
            }
        }
    }
}
