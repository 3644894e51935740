//! A Tekscan recording decoded: the frame with the largest total pressure.
//!
//! Prints what the recording is and writes an image of that frame to the file named by
//! the first argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;
use std::fmt::Write as _;

use taxel_recording::Recording;

const FILE: &[u8] = include_bytes!("../tests/recordings/fingertip.csv");

fn main() -> Result<(), Box<dyn Error>> {
    let recording = Recording::open("fingertip.csv", FILE)?;
    let stream = recording.stream().clone();
    println!(
        "{} x {} sensels in {}",
        stream.rows, stream.columns, stream.unit.symbol
    );
    let frames = recording.collect::<Result<Vec<_>, _>>()?;
    let total = |values: &[f64]| values.iter().filter(|value| value.is_finite()).sum::<f64>();
    let strongest = frames
        .iter()
        .max_by(|a, b| total(&a.values).total_cmp(&total(&b.values)))
        .ok_or("no frames")?;
    let highest = strongest.values.iter().copied().fold(0.0, f64::max);
    let highest_shown = highest / stream.unit.si_per_unit;
    println!(
        "{} frames; highest reading {highest_shown:.0}",
        frames.len()
    );

    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"440\">\n",
        stream.columns, stream.rows
    );
    for (index, value) in strongest.values.iter().enumerate() {
        let (row, column) = (index / stream.columns, index % stream.columns);
        let light = 100.0 - 80.0 * (value / highest).clamp(0.0, 1.0);
        writeln!(
            svg,
            "<rect x=\"{column}\" y=\"{row}\" width=\"1\" height=\"1\" fill=\"hsl(215 80% {light:.0}%)\"/>"
        )?;
    }
    svg.push_str("</svg>\n");
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, svg)?;
    }
    Ok(())
}
