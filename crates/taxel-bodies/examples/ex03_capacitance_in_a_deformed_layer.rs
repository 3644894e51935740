//! Two electrodes in a compressed layer: the gap opens and the capacitance falls.
//!
//! Prints gap and capacitance per depth over the permittivity of vacuum, and writes the
//! deformed half of the layer to the file named by the first argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;

use taxel_bodies::transduction::electrode_section::{BarStudy, Media};
use taxel_fem::material::{Law, Material};
use taxel_fem::output::Picture;
use taxel_fem::study::layer::{Bar, Layer, LayerDivision, SideFace};

fn main() -> Result<(), Box<dyn Error>> {
    let rubber = Material::incompressible(Law::MooneyRivlin { c10: 0.5, c01: 0.0 });
    // P1's layer with a gap of 50 um; lengths in um.
    let layer = Layer {
        thickness: 950.0,
        loaded: 4750.0,
        beyond: 0.0,
        side: SideFace::OnBase,
        bar: None,
        gripped: false,
        division: LayerDivision::for_aspect(5.0),
    };
    let electrode = Bar {
        inner: 25.0,
        width: 1000.0,
        height: 550.0,
        thickness: 100.0,
    };
    let mut study = BarStudy::new(layer, electrode, rubber, rubber)?;
    let media = Media {
        layer: 2.4,
        above: 1.0,
        below: Some(2.4),
    };
    for compression in [0.0, 0.05, 0.1, 0.15] {
        if compression > 0.0 {
            study.study.press(compression)?;
        }
        let gap = study.shape().gap;
        let capacitance = study.capacitance(&[media])?[0].differential;
        println!("compression {compression:.2}  gap {gap:6.2} um  capacitance {capacitance:.4}");
    }
    let solver = &study.study.solver;
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
