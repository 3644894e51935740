//! The picture of a body that is being solved.

use taxel_fem::mesh::Mesh;
use taxel_fem::output::{ColourMap, Colours, OutputError, Picture, Values};
use taxel_fem::problem::Contact;
use taxel_fem::solver::stress::{nodal_stress, von_mises};

use super::body::Body;
use taxel::transduction::SketchPart;
use taxel_ground::quantity;

/// Direction to the eye where the file gives none.
const FROM: [f64; 3] = [1.0, -2.0, 1.0];

impl Body {
    /// The deformed body with the von Mises stress of its nodes (SVG): a plane body whole, with
    /// its conductors and the obstacles, a body in space from outside.
    ///
    /// # Errors
    /// [`OutputError`]; for a direction to the eye of no length.
    pub fn picture(&self) -> Result<String, OutputError> {
        let (problem, state) = (self.solver.problem(), self.solver.state());
        let mesh = &problem.mesh;
        let dimension = mesh.dimension();
        let moved: Vec<f64> = state
            .displacement
            .iter()
            .flat_map(|moved| moved[..dimension].to_vec())
            .collect();
        let stress = nodal_stress(problem, state);
        let stress: Vec<f64> = stress.iter().map(|s| von_mises(*s) * 1e-3).collect();
        let mut picture = if dimension == 2 {
            Picture::plane(mesh)?
        } else {
            Picture::body(mesh, self.file.picture.from.unwrap_or(FROM))?
        };
        let conductors = self.conductors(mesh);
        for (name, nodes) in &conductors {
            picture = picture.mark(name, nodes);
        }
        for contact in &problem.contacts {
            if let Contact::Obstacle(obstacle) = contact {
                picture = picture.obstacle(obstacle.shape, obstacle.shift(&state.parameters));
            }
        }
        picture
            .length_units(quantity::LENGTH.units)
            .displacement(&moved)?
            .colours(Colours {
                title: "von Mises",
                unit: "kPa",
                values: Values::Nodes(&stress),
                range: None,
                map: ColourMap::Sequential,
            })?
            .svg()
    }

    /// The section of a plane body at rest, its outer lines closed and its electrodes as lines; nothing
    /// of a body in space. Lengths in m to five digits.
    pub(crate) fn sketch(&self) -> Vec<SketchPart> {
        let mesh = &self.solver.problem().mesh;
        if mesh.dimension() != 2 {
            return Vec::new();
        }
        let rounded = |x: f64| format!("{x:.4e}").parse().unwrap_or(x);
        let place = |node: u32| {
            let [x, y, _] = mesh.points[node as usize];
            [x, y].map(rounded)
        };
        let sides = mesh.boundary().into_iter().map(|facet| {
            let mut nodes: Vec<u32> = mesh.facet_nodes(facet).collect();
            in_order(&mut nodes, &|node| mesh.points[node as usize]);
            nodes
        });
        let loops = closed(sides.collect());
        let body = loops.into_iter().map(|nodes| SketchPart {
            electrode: None,
            points: nodes.into_iter().map(place).collect(),
        });
        // A region that conducts is no line.
        let lines = self.conductors(mesh).into_iter();
        let lines = lines.filter(|(name, _)| !mesh.regions.iter().any(|region| region == name));
        let electrodes = lines.map(|(name, mut nodes)| {
            in_order(&mut nodes, &|node| mesh.points[node as usize]);
            SketchPart {
                electrode: Some(name.to_owned()),
                points: nodes.into_iter().map(place).collect(),
            }
        });
        body.chain(electrodes).collect()
    }

    /// Electrodes and other conductors of the capacitances, with their nodes.
    fn conductors(&self, mesh: &Mesh) -> Vec<(&str, Vec<u32>)> {
        let Some(asked) = &self.file.capacitance else {
            return Vec::new();
        };
        let names = [&asked.electrodes, &asked.ground, &asked.floating];
        let nodes = |name: &str| mesh.nodes_of_region(name).or_else(|| mesh.nodes_of(name));
        let named = names
            .into_iter()
            .flatten()
            .map(|name| Some((name.as_str(), nodes(name)?)));
        named.flatten().collect()
    }
}

/// Orders nodes of a line along the axis in which it extends most.
fn in_order(nodes: &mut [u32], at: &dyn Fn(u32) -> [f64; 3]) {
    let extent = |axis: usize| {
        let along = nodes.iter().map(|node| at(*node)[axis]);
        let [low, high] = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        });
        high - low
    };
    let axis = usize::from(extent(0) < extent(1));
    nodes.sort_by(|a, b| at(*a)[axis].total_cmp(&at(*b)[axis]));
}

/// Loops of sides that meet at their ends, each through all of its nodes once.
fn closed(mut sides: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let mut loops = Vec::new();
    while let Some(mut nodes) = sides.pop() {
        while let Some(last) = nodes.last().copied().filter(|last| *last != nodes[0]) {
            let meets = |side: &Vec<u32>| side.first() == Some(&last) || side.last() == Some(&last);
            let Some(next) = sides.iter().position(meets) else {
                break;
            };
            let mut next = sides.swap_remove(next);
            if next.first() != Some(&last) {
                next.reverse();
            }
            nodes.extend(&next[1..]);
        }
        loops.push(nodes);
    }
    loops
}
