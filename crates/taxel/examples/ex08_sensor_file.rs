//! A sensor file of one's own: a mistake in it, what follows from it, and its drawing.
//!
//! Prints the first two and writes the drawing to the file named by the first argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;

use taxel::sensor::Sensor;
use taxel::summary::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let text = Sensor::shipped_text("in-plane-50um").ok_or("not shipped")?;

    let wrong = text.replace("gap = \"50 um\"", "gap = \"50 mN\"");
    match Sensor::parse("mine.toml", &wrong) {
        Err(error) => println!("{error}\n"),
        Ok(_) => return Err("a gap in mN was accepted".into()),
    }

    let mine = text.replace("gap = \"50 um\"", "gap = \"60 um\"");
    let sensor = Sensor::parse("mine.toml", &mine)?;
    let device = sensor.device()?;
    for fact in device.facts() {
        if let (
            "estimation",
            Value::Number {
                si, unit, scale, ..
            },
        ) = (fact.group, fact.value)
        {
            println!("{} {:.4} {unit}", fact.name, si / scale);
        }
    }
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, device.drawing().svg())?;
    }
    Ok(())
}
