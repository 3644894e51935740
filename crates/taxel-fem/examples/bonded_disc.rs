//! Rows of a table of rigid discs on a bonded incompressible layer: apparent stiffness over
//! Young's modulus and the pressure on the base, for each radius over thickness that is named.
//!
//!     cargo run --release -p taxel-fem --example bonded_disc -- 0.6 0.72 0.85
#![allow(clippy::print_stdout, reason = "it prints a table")]

use std::error::Error;

use taxel_fem::study::disc::PressedDisc;

/// Radii over that of the disc, %.
const PERCENT: [u32; 11] = [0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 95];

fn main() -> Result<(), Box<dyn Error>> {
    let aspects: Vec<f64> = std::env::args()
        .skip(1)
        .map(|text| text.parse())
        .collect::<Result<_, _>>()?;
    let columns = PERCENT.map(|percent| format!("p_{percent:02}"));
    println!("contact,a_over_h,stiffness,{}", columns.join(","));
    for (rim, beyond) in [("flush", 0.0), ("wide", 6.0)] {
        for (grip, gripped) in [("gripped", true), ("slip", false)] {
            for &radius in &aspects {
                let disc = PressedDisc {
                    radius,
                    beyond,
                    gripped,
                    largest: 0.02,
                    smallest: 0.002,
                };
                let answer = disc.solve()?;
                let pressure = |percent| answer.pressure_at(f64::from(percent) / 100.0);
                let pressures = PERCENT.map(|percent| format!("{:.6}", pressure(percent)));
                println!(
                    "{grip}_{rim},{radius},{:.5},{}",
                    answer.stiffness,
                    pressures.join(",")
                );
            }
        }
    }
    Ok(())
}
