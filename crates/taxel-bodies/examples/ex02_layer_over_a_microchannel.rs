//! A soft layer over a microchannel under pressure: how far the channel closes.
//!
//! Prints area ratio and gap and writes the deformed cell to the file named by the
//! first argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;

use taxel_bodies::mechanics::microchannel_cell::{Filling, VoidStudy, WallContact};
use taxel_fem::material::{Law, Material};
use taxel_fem::mesh::{CornerDivision, VoidCell};
use taxel_fem::output::Picture;

fn main() -> Result<(), Box<dyn Error>> {
    // Half of a periodic cell; lengths in um, stresses in kPa.
    let cell = VoidCell {
        width: 400.0,
        height: 60.0,
        cover: 140.0,
        base: 300.0,
        pitch: 600.0,
        fillet: 0.0,
        division: CornerDivision {
            smallest: 1.0 / 30.0,
            ..CornerDivision::default()
        },
    };
    let rubber = Material::incompressible(Law::MooneyRivlin {
        c10: 75.5,
        c01: 5.7,
    });
    let mut study = VoidStudy::new(&cell, rubber, &Filling::Vented, WallContact::default())?;
    for pressure in [4.0, 8.0, 12.0] {
        let found = study.press(pressure)?;
        let (area, gap) = (found.area_ratio, found.gap);
        println!("{pressure:>4} kPa  area ratio {area:.4}  gap {gap:.2} um");
    }
    let solver = &study.solver;
    let displacement = solver.state().displacement.iter();
    let moved: Vec<f64> = displacement.flat_map(|u| [u[0], u[1]]).collect();
    let picture = Picture::plane(&solver.problem().mesh)?
        .length_unit("um", 1.0)
        .displacement(&moved)?;
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, picture.svg()?)?;
    }
    Ok(())
}
