//! From the solved deformation to capacitance and resistance, where both are exact.

use super::{Case, Effort};
use crate::field::conduction::Conduction;
use crate::field::electrostatics::{Electrostatics, Infinity, VACUUM_PERMITTIVITY};
use crate::field::geometry::Geometry;
use crate::field::laplace::{Coefficient, Domain, MeshMotion};
use crate::material::{Law, Material, Volumetric};
use crate::mesh::{Axis, Grid3};
use crate::problem::Kinematics;
use crate::problem::{Motion as Support, Problem, Rule};
use crate::solver::failure::Failure;
use crate::solver::newton::{Continue, Solver};

/// An incompressible cube pressed to thickness `l`, its sides free: `C/C0 = l^-2` for
/// faces across the pressing, `R/R0 = l^2` for a current along it. Both on the pulled
/// back and on the moved mesh. Beyond a thickness of 0.66 the cube bulges to one side: the
/// homogeneous state is no longer stable.
pub(super) fn solve(case: &mut Case, _effort: Effort) -> Result<(), Failure> {
    let axis = || Axis::uniform(0.0, 1.0, 2);
    let mesh = Grid3::new([axis()?, axis()?, axis()?], "solid").mesh()?;
    let mut problem = Problem::new(mesh, Kinematics::Solid)?;
    problem.materials.push(Material {
        law: Law::neo_hookean(1.0),
        volumetric: Volumetric::Incompressible,
    });
    for (side, component) in [("left", 0), ("front", 1), ("bottom", 2)] {
        problem.support(side, component, Support::Fixed)?;
    }
    let press = problem.parameter("press", Rule::Given);
    problem.support("top", 2, Support::Driven(press, -1.0))?;
    let mut solver = Solver::new(problem)?;
    for thickness in [0.9_f64, 0.8, 0.7] {
        solver.load_to(&[1.0 - thickness], |_, _| Continue::Yes)?;
        case.sized(&solver);
        let mesh = &solver.problem().mesh;
        let moved = &solver.state().displacement;
        let mut found = Vec::new();
        for (name, motion) in [
            ("pulled back", MeshMotion::PulledBack(moved)),
            ("moved mesh", MeshMotion::Moved(moved)),
        ] {
            let domain = Domain {
                mesh,
                geometry: Geometry::Solid,
                motion,
                exterior: None,
            };
            let media = [("solid", Coefficient::Scalar(1.0))];
            let capacitance = Electrostatics {
                domain,
                permittivities: &media,
                conductors: &["top"],
                floating: &[],
                zero: &["bottom"],
                infinity: Infinity::default(),
            }
            .capacitance()?;
            let resistance = Conduction {
                domain,
                conductivities: &media,
                from: "top",
                to: "bottom",
            }
            .resistance()?;
            let ratio = capacitance.matrix[0][0] / VACUUM_PERMITTIVITY;
            case.relative(
                format!("C/C0 at thickness {thickness}, {name}"),
                thickness.powi(-2),
                ratio,
                1e-8,
            );
            case.relative(
                format!("R/R0 at thickness {thickness}, {name}"),
                thickness * thickness,
                resistance.by_power,
                1e-8,
            );
            case.absolute(
                format!("flux less energy at thickness {thickness}, {name}"),
                0.0,
                resistance.by_flux / resistance.by_power - 1.0,
                1e-8,
            );
            found.push(ratio);
        }
        case.absolute(
            format!("pulled back less moved mesh at thickness {thickness}"),
            0.0,
            found[0] / found[1] - 1.0,
            1e-10,
        );
    }
    Ok(())
}
