//! `taxel export`: a sensor for simulators of robots.

use taxel::simulator;

use crate::arguments::{ExportSensor, ExportTo};
use crate::{Done, Stop, files, outputs};

pub(crate) fn run(arguments: &ExportSensor) -> Result<Done, Stop> {
    let existing = arguments.overwrite.existing();
    let outputs = [("--output", arguments.output.as_ref())];
    outputs::check(&outputs, &[&arguments.sensor], existing)?;
    let named = files::sensor(&arguments.sensor)?;
    let text = match arguments.to {
        ExportTo::Mjcf => {
            let model = simulator::mjcf(&named.sensor, arguments.friction);
            format!("<!-- {} -->\n{model}", named.origin())
        }
        ExportTo::Json => simulator::places(&named.sensor, &named.about()),
    };
    outputs::write(arguments.output.as_deref(), existing, &text)
}
