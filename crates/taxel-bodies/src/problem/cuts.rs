//! Where a mesh ends though the body does not: cuts by planes of symmetry, and parts that meet
//! without common nodes.

use std::collections::{BTreeSet, HashSet};

use taxel_fem::mesh::{Facet, Mesh, Parts};
use taxel_fem::problem::{self as solid, Kinematics};

use super::description::ProblemFile;
use super::group::Group;

/// A wall has an opening across an axis if its volume changes by more than this share as its origin
/// moves by its extent.
const CLOSED: f64 = 1e-6;
/// Places on an axis are one within this share of the extent of the wall.
const SAME_PLACE: f64 = 1e-6;

/// From where on its axis the volume of a cavity is measured.
#[derive(Debug, Default)]
pub(super) struct Origin {
    /// The place, m: that of the cut at an end of the wall whose nodes supports hold along the
    /// axis, or else zero.
    pub(super) place: f64,
    /// True if neither the wall nor a support says so.
    pub(super) unknown: bool,
    /// Nodes of the wall at that place, where it is open there.
    pub(super) rim: Vec<u32>,
}

/// From where the volume of a cavity is measured; `held` says which nodes supports hold along its
/// axis.
pub(super) fn origin(
    cavity: &solid::Cavity,
    mesh: &Mesh,
    kinematics: Kinematics,
    held: impl Fn(u32) -> bool,
) -> Origin {
    let axis = cavity.axis;
    if kinematics == Kinematics::Axisymmetric && axis == 0 {
        return Origin::default();
    }
    let nodes = cavity
        .wall
        .iter()
        .flat_map(|&facet| mesh.facet_nodes(facet));
    let nodes: Vec<u32> = nodes.collect();
    let along = |node: &u32| mesh.points[*node as usize][axis];
    let size = |d: usize| {
        let [low, high] = ends(nodes.iter().map(|&node| mesh.points[node as usize][d]));
        high - low
    };
    let extent = (0..3).map(size).fold(0.0, f64::max);
    let [low, high] = ends(nodes.iter().map(along));
    let from = |origin: f64| {
        let cavity = solid::Cavity {
            origin,
            ..cavity.clone()
        };
        cavity.volume(mesh, kinematics, &mesh.points)
    };
    let (volume, moved) = (from(low), from(low + extent));
    if (volume - moved).abs() <= CLOSED * volume.abs().max(moved.abs()) {
        return Origin::default();
    }
    let same = |a: f64, b: f64| (a - b).abs() <= SAME_PLACE * extent;
    let [first, last] = ends(nodes.iter().filter(|node| held(**node)).map(along));
    let cut = !same(low, high) && same(first, last) && (same(first, low) || same(first, high));
    let place = if cut { first } else { 0.0 };
    let mut rim = nodes.clone();
    rim.retain(|node| same(along(node), place));
    Origin {
        place,
        unknown: !cut && !same(low, 0.0) && !same(high, 0.0),
        rim,
    }
}

fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    })
}

/// True if cells of these regions lead from one group of nodes to another over common nodes.
pub(super) fn connected(mesh: &Mesh, regions: &[&str], from: &[u32], to: &[u32]) -> bool {
    let conducts = |region: usize| regions.contains(&mesh.regions[region].as_str());
    let mut parts = Parts::of_cells(mesh, conducts);
    let begins: BTreeSet<u32> = from.iter().map(|&node| parts.root(node)).collect();
    to.iter().any(|&node| begins.contains(&parts.root(node)))
}

/// The first group of nodes of electrodes that no field links to another of them, over common nodes of
/// these regions and over floating conductors; ground is a group like an electrode.
pub(super) fn isolated(
    mesh: &Mesh,
    regions: &[&str],
    electrodes: &[Vec<u32>],
    floating: &[Vec<u32>],
) -> Option<usize> {
    let fills = |region: usize| regions.contains(&mesh.regions[region].as_str());
    let mut parts = Parts::of_cells(mesh, fills);
    for nodes in electrodes.iter().chain(floating) {
        for &node in nodes {
            parts.join(nodes[0], node);
        }
    }
    let roots = electrodes
        .iter()
        .map(|nodes| Some(parts.root(*nodes.first()?)));
    let roots: Vec<Option<u32>> = roots.collect();
    let alone = |root: &Option<u32>| roots.iter().filter(|other| *other == root).count() == 1;
    roots.iter().position(alone)
}

/// What the file says of parts that meet without common nodes: surfaces of contacts and ties, periodic
/// ones, and rigid bodies.
pub(super) struct Meetings {
    /// Nodes of the two surfaces of each; those of a rigid body are both.
    sides: Vec<[HashSet<u32>; 2]>,
    /// Nodes whose cells may be in each other there, which what meets has to settle: those of the
    /// surfaces, and of a contact those of the two bodies.
    within: Vec<[HashSet<u32>; 2]>,
}

impl Meetings {
    pub(super) fn of(file: &ProblemFile, mesh: &Mesh) -> Self {
        let contacts = file.contact.iter().map(|contact| &contact.surfaces);
        let ties = file.tie.iter().map(|tie| &tie.surfaces);
        let constraints = file.constraint.iter();
        let periodic = constraints.filter_map(|one| one.periodic.as_ref());
        let nodes = |name: &str| -> HashSet<u32> {
            let nodes = mesh.nodes_of(name).or_else(|| mesh.nodes_of_region(name));
            nodes.unwrap_or_default().into_iter().collect()
        };
        let of_pair = |names: &[Group; 2]| [nodes(&names[0]), nodes(&names[1])];
        let rigid = file
            .rigid
            .iter()
            .map(|rigid| [nodes(&rigid.on), nodes(&rigid.on)]);
        let stuck = ties.chain(periodic).map(of_pair).chain(rigid);
        let mut sides: Vec<_> = contacts.map(of_pair).collect();
        let mut parts = Parts::of_cells(mesh, |_| true);
        let roots: Vec<u32> = (0..mesh.points.len() as u32)
            .map(|node| parts.root(node))
            .collect();
        let body = |side: &HashSet<u32>| -> HashSet<u32> {
            let there: HashSet<u32> = side.iter().map(|&node| roots[node as usize]).collect();
            let all = 0..mesh.points.len() as u32;
            all.filter(|&node| there.contains(&roots[node as usize]))
                .collect()
        };
        let mut within: Vec<_> = sides
            .iter()
            .map(|pair| [body(&pair[0]), body(&pair[1])])
            .collect();
        for pair in stuck {
            within.push(pair.clone());
            sides.push(pair);
        }
        Self { sides, within }
    }

    fn meet(pairs: &[[HashSet<u32>; 2]], on: impl Fn(&HashSet<u32>, usize) -> bool) -> bool {
        let mut pairs = pairs.iter();
        pairs.any(|[first, second]| on(first, 0) && on(second, 1) || on(first, 1) && on(second, 0))
    }

    /// True if two nodes lie on the two sides: where those begin in touch, the nodes of both are meant
    /// to lie at one place.
    pub(super) fn are_nodes(&self, nodes: [u32; 2]) -> bool {
        Self::meet(&self.sides, |side, which| side.contains(&nodes[which]))
    }

    /// True if two facets lie on the two sides.
    pub(super) fn are_facets(&self, mesh: &Mesh, facets: [Facet; 2]) -> bool {
        Self::meet(&self.sides, |side, which| {
            let mut nodes = mesh.facet_nodes(facets[which]);
            nodes.all(|node| side.contains(&node))
        })
    }

    /// True if two cells reach to the two sides: how deep those are in each other is the matter of
    /// what joins them or keeps them apart.
    pub(super) fn are_cells(&self, mesh: &Mesh, cells: [u32; 2]) -> bool {
        Self::meet(&self.within, |side, which| {
            let mut nodes = mesh.cell(cells[which] as usize).iter();
            nodes.any(|node| side.contains(node))
        })
    }
}

/// What is solved on both sides of two surfaces without common nodes, and does not pass from one to
/// the other: a field or a current. `names` are those of the surfaces.
pub(super) fn stopped(
    file: &ProblemFile,
    mesh: &Mesh,
    surfaces: &[Vec<Facet>; 2],
    names: &[Group; 2],
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
        let ends = |name: &Group| lists.iter().any(|list| list.contains(name));
        let filled = |region: &str| {
            let mut fills = asked.dielectric.iter().flat_map(|part| &part.regions);
            let mut conducts = lists.iter().copied().flatten();
            fills.any(|name| name == region) || conducts.any(|group| group.name == region)
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a panic is how a test fails")]
mod tests {
    use super::*;
    use taxel_fem::mesh::{Axis, Grid2};
    use taxel_fem::problem::Parameter;

    /// A quarter of a tube, cut by two planes, has one volume wherever it is drawn.
    #[test]
    fn a_cut_cavity_is_measured_from_its_cut() {
        let axes = [Axis::uniform(1.0, 2.0, 2), Axis::uniform(0.0, 1.0, 16)];
        let drawn = Grid2::new(axes.map(Result::unwrap), "rubber")
            .mesh()
            .unwrap();
        let wall = drawn.surfaces["left"].clone();
        let volume = |place: [f64; 2], along: usize| {
            let mut mesh = drawn.clone();
            for point in &mut mesh.points {
                let angle = std::f64::consts::FRAC_PI_2 * point[1];
                let [radius, ..] = *point;
                *point = [
                    place[0] + radius * angle.cos(),
                    place[1] + radius * angle.sin(),
                    0.0,
                ];
            }
            let mut cavity = solid::Cavity {
                wall: wall.clone(),
                axis: along,
                origin: 0.0,
                pressure: Parameter(0),
            };
            let cut = |node: u32| (mesh.points[node as usize][along] - place[along]).abs() < 1e-9;
            let origin = origin(&cavity, &mesh, Kinematics::PlaneStrain, cut);
            assert!(!origin.unknown);
            let ends = origin.rim.iter().all(|&node| cut(node));
            assert!(ends && !origin.rim.is_empty());
            cavity.origin = origin.place;
            cavity.volume(&mesh, Kinematics::PlaneStrain, &mesh.points)
        };
        let exact = std::f64::consts::FRAC_PI_4;
        for place in [[0.0, 0.0], [50.0, 30.0], [-7.0, 7.0], [0.5, -0.5]] {
            for along in [0, 1] {
                let found = volume(place, along);
                assert!(
                    (found / exact - 1.0).abs() < 1e-4,
                    "{place:?} {along}: {found}"
                );
            }
        }
    }
}
