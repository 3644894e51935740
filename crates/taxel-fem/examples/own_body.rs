//! A body of one's own: a mesh of Gmsh, a solid, supports, a plate that presses, and the forces.
//!
//! Takes the mesh of the soft dome (crates/taxel-bodies/problems/dome.msh), prints the force of the plate
//! step by step and writes the deformed section to the file named by the second argument (SVG).
#![allow(clippy::print_stdout, reason = "an example prints its results")]

use std::error::Error;

use taxel_fem::material::Material;
use taxel_fem::mesh::gmsh;
use taxel_fem::output::Picture;
use taxel_fem::problem::{Contact, Kinematics, Motion, Obstacle, Problem, Rule, Shape};
use taxel_fem::solver::newton::{Continue, Solver};

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = std::env::args().skip(1);
    // Lengths in mm and stresses in kPa give forces in mN.
    let drawing = gmsh::read_file(&std::fs::read(files.next().ok_or("name a mesh")?)?)?;
    let mut problem = Problem::new(drawing.mesh, Kinematics::Axisymmetric)?;
    problem.materials = vec![Material::neo_hookean(180.0, 0.5)?];
    problem.clamp("base")?;
    problem.support("axis", 0, Motion::Fixed)?;
    let travel = problem.parameter("travel", Rule::Given);
    problem.contacts.push(Contact::Obstacle(Obstacle {
        surface: problem.surface("skin")?,
        shape: Shape::HalfSpace {
            point: [0.0, 5.0, 0.0],
            normal: [0.0, -1.0, 0.0],
        },
        travel: Some(([0.0, -1.0, 0.0], travel)),
        stiffness: 1e4,
        friction: 0.0,
        overlap_limit: 5e-4,
    }));
    let mut solver = Solver::new(problem)?;
    for way in [0.5, 1.0, 1.5] {
        solver.load_to(&[way], |_, _| Continue::Yes)?;
        println!("{way} mm  {:.2} mN", solver.evaluate()?.along[travel.0]);
    }
    let moved = solver.state().displacement.iter();
    let moved: Vec<f64> = moved.flat_map(|u| [u[0], u[1]]).collect();
    let picture = Picture::plane(&solver.problem().mesh)?.length_unit("mm", 1.0);
    if let Some(file) = files.next() {
        std::fs::write(file, picture.displacement(&moved)?.svg()?)?;
    }
    Ok(())
}
