//! Electrical quantities of a deformed body.

use taxel_fem::field::FieldError;
use taxel_fem::field::conduction::Conduction;
use taxel_fem::field::electrostatics::{Electrostatics, Infinity};
use taxel_fem::field::geometry::Geometry as FieldGeometry;
use taxel_fem::field::laplace::{Coefficient, Domain, MeshMotion};
use taxel_fem::solver::newton::Solver;

use super::description::{Capacitance, Geometry, ProblemFile, Resistance};
use super::group::Group;

/// The domain of the fields: the body in its present shape.
fn domain<'a>(file: &ProblemFile, solver: &'a Solver) -> Domain<'a> {
    Domain {
        mesh: &solver.problem().mesh,
        geometry: match file.geometry {
            Geometry::PlaneStrain(_) => FieldGeometry::Plane,
            Geometry::Axisymmetric => FieldGeometry::Axisymmetric,
            Geometry::Solid => FieldGeometry::Solid,
        },
        motion: MeshMotion::PulledBack(&solver.state().displacement),
        exterior: None,
    }
}

fn names(list: &[Group]) -> Vec<&str> {
    list.iter().map(|group| group.as_str()).collect()
}

/// The capacitances between each two electrodes, row by row, and of each to ground, F.
pub(super) fn capacitances(
    file: &ProblemFile,
    asked: &Capacitance,
    solver: &Solver,
) -> Result<Vec<f64>, FieldError> {
    let permittivities: Vec<_> = asked
        .dielectric
        .iter()
        .flat_map(|dielectric| {
            let value = Coefficient::Scalar(dielectric.permittivity);
            let regions = dielectric.regions.iter();
            regions.map(move |region| (region.as_str(), value))
        })
        .collect();
    let found = Electrostatics {
        domain: domain(file, solver),
        permittivities: &permittivities,
        conductors: &names(&asked.electrodes),
        floating: &names(&asked.floating),
        zero: &names(&asked.ground),
        infinity: Infinity::Free,
    }
    .capacitance()?;
    let count = asked.electrodes.len();
    let mut values = Vec::new();
    for i in 0..count {
        values.extend((i + 1..count).map(|j| found.mutual(i, j)));
    }
    if !asked.ground.is_empty() {
        values.extend((0..count).map(|i| found.to_ground(i)));
    }
    // A zero has no sign.
    Ok(values
        .into_iter()
        .map(|value| value * file.depth() + 0.0)
        .collect())
}

/// Names of these capacitances.
pub(super) fn capacitance_names(asked: &Capacitance) -> Vec<String> {
    let electrodes = &asked.electrodes;
    let mut names = Vec::new();
    for (i, one) in electrodes.iter().enumerate() {
        let others = electrodes[i + 1..].iter();
        names.extend(others.map(|other| format!("capacitance_{one}_{other}")));
    }
    if !asked.ground.is_empty() {
        let each = electrodes.iter();
        names.extend(each.map(|one| format!("capacitance_{one}_ground")));
    }
    names
}

/// A resistance, Ω.
pub(super) fn resistance(
    file: &ProblemFile,
    asked: &Resistance,
    solver: &Solver,
) -> Result<f64, FieldError> {
    let conductivities: Vec<_> = asked
        .conductor
        .iter()
        .flat_map(|conductor| {
            let value = Coefficient::Scalar(1.0 / conductor.resistivity);
            let regions = conductor.regions.iter();
            regions.map(move |region| (region.as_str(), value))
        })
        .collect();
    let found = Conduction {
        domain: domain(file, solver),
        conductivities: &conductivities,
        from: &asked.from,
        to: &asked.to,
    }
    .resistance()?;
    Ok(found.by_power / file.depth())
}
