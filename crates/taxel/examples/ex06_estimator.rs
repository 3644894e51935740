//! An estimator fed by hand: frames of the simulated twin to total force.
//!
//! Prints estimated and true force and writes both over time to the file named by the
//! first argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;

use taxel::acquisition::{Delivery, Quantity, Stimulus, Twin};
use taxel::estimation::{ArrayEstimator, ThreeAxisOptions, ThreeAxisReader};
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::sensor::Sensor;

fn main() -> Result<(), Box<dyn Error>> {
    let sensor = Sensor::shipped("three-axis-8x8").ok_or("not shipped")?;
    let script = Stimulus::shipped_text("finger").ok_or("not shipped")?;
    let stimulus = Stimulus::parse("finger", script)?;
    let mut twin = Twin::new(&sensor, &stimulus, 1)?;

    let calibration = sensor.three_axis()?.calibration();
    let options = ThreeAxisOptions::default();
    let reader = ThreeAxisReader::new(calibration, Quantity::Counts, options)?;
    let mut estimator = ArrayEstimator::new(Box::new(reader));
    estimator.begin_rest_capture(50);

    let (mut estimated, mut truth) = (Vec::new(), Vec::new());
    for _ in 0..1000 {
        // A twin also loses frames, if its script says so.
        let Delivery::Frame(frame) = twin.next_delivery() else {
            continue;
        };
        let (touch, _) = estimator.push(&frame)?;
        let seconds = 1e-9 * frame.time_ns as f64;
        let forces = twin.true_forces(frame.time_ns);
        let pressing = 1e3 * forces.iter().map(|force| force[2]).sum::<f64>();
        let force = 1e3 * touch.total.force[2];
        estimated.push([seconds, force]);
        truth.push([seconds, pressing]);
        if frame.sequence % 200 == 0 {
            let deviation = 1e3 * touch.total_covariance[2][2].sqrt();
            println!("{seconds:5.2} s  {force:7.3} +- {deviation:.3} mN, true {pressing:7.3} mN");
        }
    }
    let chart = Chart {
        title: String::new(),
        x: Axis::new("time", "s"),
        y: Axis::new("total pressing force", "mN"),
        series: vec![
            Series::new("true", truth, Style::Line),
            Series::new("estimated", estimated, Style::Line),
        ],
    };
    let figure = Figure::of("Finger on the 8 x 8 array", chart, "");
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, figure.svg())?;
    }
    Ok(())
}
