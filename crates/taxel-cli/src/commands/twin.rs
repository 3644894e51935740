//! `taxel twin --bench`: readings of a bench that exists in the computer only.

use taxel::calibration::{BenchOptions, calibrator};

use crate::arguments::Twin;
use crate::commands::calibrate::{read_sensors, sensors};
use crate::{Done, Stop, files};

pub(crate) fn run(arguments: &Twin) -> Result<Done, Stop> {
    let named = read_sensors(&arguments.sensor, &arguments.with)?;
    let sensors = sensors(&named);
    let calibrator = calibrator(&sensors).map_err(|error| Stop::WrongInput(error.to_string()))?;
    let text = calibrator.bench(&BenchOptions {
        seed: arguments.seed,
        readings: arguments.readings as usize,
        cycles: arguments.cycles as usize,
        compression: arguments.compression,
        noise: arguments.noise,
        hysteresis: arguments.hysteresis,
        drift: arguments.drift,
        tilt: arguments.tilt.to_radians(),
    });
    files::write(arguments.output.as_deref(), &text)
}
