//! Response of a three-axis capacitor to a shear force under a constant pressing force.
//!
//! Prints the four capacitances and writes a chart to the file named by the first
//! argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;

use taxel::device::ThreeAxisPredictor;
use taxel::figure::{Axis, Chart, Figure, Series, Style};
use taxel::sensor::Sensor;

fn main() -> Result<(), Box<dyn Error>> {
    let sensor = Sensor::shipped("three-axis-8x8").ok_or("not shipped")?;
    let predictor = ThreeAxisPredictor::new(&sensor.three_axis()?);
    let mut curves = [const { Vec::new() }; 4];
    for step in -10..=10 {
        let shear = f64::from(step); // mN
        let prediction = predictor.predict([1e-3 * shear, 0.0, 8e-3]); // N
        let capacitance = prediction.response.capacitance().map(|farad| 1e15 * farad);
        for (curve, femtofarad) in curves.iter_mut().zip(capacitance) {
            curve.push([shear, femtofarad]);
        }
        if step % 5 == 0 {
            println!("{shear:>4} mN  {capacitance:.2?} fF");
        }
    }
    let names = ["11", "12", "21", "22"].into_iter().zip(curves);
    let chart = Chart {
        title: String::new(),
        x: Axis::new("shear force along x", "mN"),
        y: Axis::new("capacitance", "fF"),
        series: names
            .map(|(name, curve)| Series::new(name, curve, Style::Line))
            .collect(),
    };
    let figure = Figure::of("Three-axis capacitor under 8 mN", chart, "");
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, figure.svg())?;
    }
    Ok(())
}
