//! `taxel export`: a sensor for simulators of robots.

use serde_json::{Map, Value};
use taxel::simulator;

use crate::arguments::{COMMIT, ExportSensor, ExportTo, VERSION};
use crate::{Done, Stop, files, outputs};

pub(crate) fn run(arguments: &ExportSensor) -> Result<Done, Stop> {
    let existing = arguments.overwrite.existing();
    let outputs = [("--output", arguments.output.as_ref())];
    outputs::check(&outputs, &[&arguments.sensor], existing)?;
    let named = files::sensor(&arguments.sensor)?;
    let text = match arguments.to {
        ExportTo::Mjcf => {
            let origin = format!(
                "taxel {VERSION} {COMMIT}, sensor file sha256 {}",
                named.hash
            );
            let model = simulator::mjcf(&named.sensor, arguments.friction);
            format!("<!-- {origin} -->\n{model}")
        }
        ExportTo::Json => {
            let mut about = Map::new();
            for (key, value) in [
                ("sensor", named.sensor.name.as_str()),
                ("sensor_hash", named.hash.as_str()),
                ("version", VERSION),
                ("commit", COMMIT),
            ] {
                about.insert(key.into(), Value::from(value));
            }
            simulator::places(&named.sensor, &about)
        }
    };
    outputs::write(arguments.output.as_deref(), existing, &text)
}
