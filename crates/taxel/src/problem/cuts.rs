//! Where a mesh ends though the body does not: cuts by planes of symmetry, and parts that meet
//! without common nodes.

use taxel_fem::mesh::{Facet, Mesh};
use taxel_fem::problem::{self as solid, Kinematics};

use super::description::ProblemFile;

/// A wall has an opening across an axis if its volume changes by more than this share as its origin
/// moves by its extent.
const CLOSED: f64 = 1e-6;
/// Places on an axis are one within this share of the extent of the wall.
const SAME_PLACE: f64 = 1e-6;

/// The place on its axis from which the volume of a cavity is measured, m: that of the cut through
/// it, where its wall holds nodes along the axis (`held`), or else zero.
///
/// # Errors
/// Why there is no such cut.
pub(super) fn origin(
    cavity: &solid::Cavity,
    mesh: &Mesh,
    kinematics: Kinematics,
    held: impl Fn(u32) -> bool,
) -> Result<f64, String> {
    let axis = cavity.axis;
    if kinematics == Kinematics::Axisymmetric && axis == 0 {
        return Ok(0.0);
    }
    let nodes = cavity
        .wall
        .iter()
        .flat_map(|&facet| mesh.facet_nodes(facet));
    let nodes: Vec<u32> = nodes.collect();
    let along = |node: &u32| mesh.points[*node as usize][axis];
    let [low, high] = ends(nodes.iter().map(along));
    let extent = high - low;
    let from = |origin: f64| {
        solid::Cavity {
            origin,
            ..cavity.clone()
        }
        .volume(mesh, kinematics, &mesh.points)
    };
    let (volume, moved) = (from(low), from(high));
    if (volume - moved).abs() <= CLOSED * volume.abs().max(moved.abs()) {
        return Ok(0.0);
    }
    let [first, last] = ends(nodes.iter().filter(|node| held(**node)).map(along));
    if last - first <= SAME_PLACE * extent && first.is_finite() {
        return Ok(first);
    }
    if low.abs().min(high.abs()) <= SAME_PLACE * extent {
        return Ok(0.0);
    }
    Err(format!(
        "the wall is open along this axis, and no end of it, {:.4} and {:.4} mm, is at 0 or held along it by a support",
        1e3 * low,
        1e3 * high
    ))
}

fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    })
}

/// What is solved on both sides of two surfaces without common nodes, and does not pass from one to
/// the other: a field or a current. `names` are those of the surfaces.
pub(super) fn stopped(
    file: &ProblemFile,
    mesh: &Mesh,
    surfaces: &[Vec<Facet>; 2],
    names: &[String; 2],
) -> Option<String> {
    let beside = |surface: &Vec<Facet>, regions: &dyn Fn(&str) -> bool| {
        surface
            .iter()
            .any(|facet| regions(&mesh.regions[mesh.region_of(facet.cell as usize)]))
    };
    let both =
        |regions: &dyn Fn(&str) -> bool| surfaces.iter().all(|surface| beside(surface, regions));
    let capacitance = file.capacitance.as_ref().filter(|asked| {
        let lists = [&asked.electrodes, &asked.ground, &asked.floating];
        let ends = |name: &String| lists.iter().any(|list| list.contains(name));
        let filled = |region: &str| {
            let named = |name: &String| name == region;
            asked
                .dielectric
                .iter()
                .any(|part| part.regions.iter().any(named))
                || lists.iter().any(|list| list.iter().any(named))
        };
        !names.iter().all(ends) && both(&filled)
    });
    if capacitance.is_some() {
        return Some("the electric field of [capacitance]".into());
    }
    let crossing = file.resistance.iter().find(|asked| {
        let conducts = |region: &str| {
            let mut parts = asked.conductor.iter();
            parts.any(|part| part.regions.iter().any(|name| name == region))
        };
        both(&conducts)
    });
    crossing.map(|asked| format!("the current of resistance \"{}\"", asked.name))
}
