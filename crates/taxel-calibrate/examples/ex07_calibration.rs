//! Calibration of an in-plane capacitor from synthetic data.
//!
//! Prints the parameters with their standard deviations and writes the measured and fitted
//! values to the file named by the first argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;

use taxel::sensor::Sensor;
use taxel_calibrate::{CalibrateOptions, NamedSensor, ReadingTable, SyntheticOptions, calibrator};

fn main() -> Result<(), Box<dyn Error>> {
    let name = "in-plane-50um";
    let text = Sensor::shipped_text(name).ok_or("not shipped")?;
    let sensor = Sensor::parse(name, text)?;
    let named = [NamedSensor {
        name,
        text,
        sensor: &sensor,
    }];
    let device = calibrator(&named)?;

    let options = SyntheticOptions {
        seed: 7,
        ..SyntheticOptions::default()
    };
    let csv = device.synthetic(&options);
    let table = ReadingTable::parse("synthetic.csv", &csv, device.columns(), device.group())?;
    let outcome = device.calibrate(&table, &CalibrateOptions::default())?;
    for (parameter, estimate) in &outcome.parameters {
        println!(
            "{:<28} {:>12.5e} +- {:.1e} {}",
            parameter.name, estimate.value, estimate.deviation, parameter.unit
        );
    }
    if let Some(file) = std::env::args().nth(1) {
        let figure = outcome.figures.first().ok_or("no figure")?;
        std::fs::write(file, figure.svg())?;
    }
    Ok(())
}
