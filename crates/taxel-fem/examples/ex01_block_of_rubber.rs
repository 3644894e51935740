//! A block of rubber between two bonded plates, compressed by a quarter of its height.
//!
//! Prints the force per depth and writes the deformed block to the file named by the
//! first argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;

use taxel_fem::material::{Law, Material};
use taxel_fem::mesh::{Axis, Grid2};
use taxel_fem::output::Picture;
use taxel_fem::problem::{Kinematics, Motion, Problem, Rule};
use taxel_fem::solver::newton::{Continue, Solver};

fn main() -> Result<(), Box<dyn Error>> {
    // 20 x 10 mm in 16 x 8 cells; lengths in m, stresses in Pa.
    let axes = [
        Axis::uniform(0.0, 20e-3, 16)?,
        Axis::uniform(0.0, 10e-3, 8)?,
    ];
    let mut mesh = Grid2::new(axes, "rubber").mesh()?;
    mesh.name_boundary("lower plate", |[_, y, _]| y < 1e-9);
    mesh.name_boundary("upper plate", |[_, y, _]| y > 10e-3 - 1e-9);

    let mut problem = Problem::new(mesh, Kinematics::PlaneStrain)?;
    problem
        .materials
        .push(Material::incompressible(Law::MooneyRivlin {
            c10: 75.5e3,
            c01: 5.7e3,
        }));
    problem.clamp("lower plate")?;
    problem.support("upper plate", 0, Motion::Fixed)?;
    let travel = problem.parameter("travel", Rule::Given);
    problem.support("upper plate", 1, Motion::Driven(travel, -1.0))?;

    let mut solver = Solver::new(problem)?;
    for millimetres in [0.5, 1.0, 1.5, 2.0, 2.5] {
        solver.load_to(&[1e-3 * millimetres], |_, _| Continue::Yes)?;
        let force = solver.evaluate()?.along[0];
        println!("{millimetres:.1} mm  {:.3} kN/m", 1e-3 * force);
    }
    let displacement = solver.state().displacement.iter();
    let moved: Vec<f64> = displacement.flat_map(|u| [u[0], u[1]]).collect();
    let mesh = &solver.problem().mesh;
    let picture = Picture::plane(mesh)?
        .length_unit("mm", 1e-3)
        .displacement(&moved)?;
    if let Some(file) = std::env::args().nth(1) {
        std::fs::write(file, picture.svg()?)?;
    }
    Ok(())
}
