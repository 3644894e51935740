//! `taxel twin --calibration-data`: synthetic calibration data.

use taxel_calibrate::{Calibrator, IndentationOptions, SyntheticOptions, calibrator};

use crate::arguments::Twin;
use crate::{Done, Stop, files, outputs};
use taxel_files::read_sensors;

pub(crate) fn run(arguments: &Twin) -> Result<Done, Stop> {
    let inputs: Vec<_> = arguments.with.iter().chain([&arguments.sensor]).collect();
    let existing = arguments.overwrite.existing();
    let outputs = [("--output", arguments.output.as_ref())];
    outputs::check(&outputs, &inputs, existing)?;
    let named = read_sensors(&arguments.sensor, &arguments.with)?;
    let sensors: Vec<_> = named.iter().map(files::NamedSensor::described).collect();
    let calibrator = calibrator(&sensors).map_err(|error| Stop::WrongInput(error.to_string()))?;
    let text = if arguments.probe.is_empty() {
        readings(arguments, calibrator.as_ref())
    } else {
        let options = IndentationOptions {
            seed: arguments.seed,
            radii: arguments.probe.iter().map(|radius| radius * 1e-3).collect(),
            grid: arguments.grid * 1e-3,
            noise: arguments.noise,
        };
        let message = "--probe: this device learns nothing from indentations at known positions";
        let presses = calibrator.synthetic_indentations(&options);
        presses.ok_or_else(|| Stop::WrongInput(message.into()))?
    };
    outputs::write(arguments.output.as_deref(), existing, &text)
}

fn readings(arguments: &Twin, calibrator: &dyn Calibrator) -> String {
    calibrator.synthetic(&SyntheticOptions {
        seed: arguments.seed,
        readings: arguments.readings as usize,
        cycles: arguments.cycles as usize,
        compression: arguments.compression,
        noise: arguments.noise,
        hysteresis: arguments.hysteresis,
        drift: arguments.drift,
        tilt: arguments.tilt.to_radians(),
        saturation: arguments.saturation,
    })
}
