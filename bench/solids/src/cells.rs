//! Tangent and residual of the quadratic hexahedron, one cell again and again.

use std::error::Error;

use serde_json::json;
use taxel_fem::assembly::kernel::{CellInput, ELIMINATION_RATIO, Kernel, Points};
use taxel_fem::mesh::CellShape;
use taxel_fem::problem::Kinematics;

use crate::measure::Meter;
use crate::problems::{Case, mesh, problem};

const ROUNDS: usize = 5;
const PASSES: usize = 100;

/// Prints the best of some rounds.
pub(crate) fn run() -> Result<(), Box<dyn Error>> {
    let problem = problem(Case::B, mesh(Case::B, 6)?)?;
    let mut kernel = Kernel::new(CellShape::Hex27, Kinematics::Solid, Points::Usual);
    for tangent in [true, false] {
        let mut best = f64::INFINITY;
        let count = PASSES * problem.mesh.cell_count();
        for _ in 0..ROUNDS {
            let meter = Meter::start();
            for _ in 0..PASSES {
                for cell in 0..problem.mesh.cell_count() {
                    let places = places(&problem.mesh, cell);
                    let bent = places.map(|[x, y, z]| [0.1 * z * z, -0.1 * y, 0.1 * x * y]);
                    let input = CellInput {
                        reference: &places,
                        displacement: &bent,
                        pressure: [1.0, 0.5, -0.5, 0.2],
                        material: &problem.materials[0],
                        memory: None,
                        elimination: ELIMINATION_RATIO,
                    };
                    kernel
                        .evaluate(&input, tangent)
                        .map_err(|inverted| format!("{inverted:?}"))?;
                    std::hint::black_box(kernel.tangent(0, 0, 0, 0));
                }
            }
            best = best.min(meter.cpu().min(meter.wall()) / count as f64);
        }
        let line = json!({
            "cell": "Hex27",
            "tangent": tangent,
            "us": (best * 1e8).round() / 100.0,
            "per_s": (1.0 / best).round(),
        });
        println!("{line}");
        let name = if tangent { "tangent" } else { "residual" };
        println!("figure cells.{name} {:.4}", best * 1e6);
    }
    Ok(())
}

fn places(mesh: &taxel_fem::mesh::Mesh, cell: usize) -> [[f64; 3]; 27] {
    let nodes = mesh.cell(cell);
    std::array::from_fn(|n| mesh.points[nodes[n] as usize])
}
