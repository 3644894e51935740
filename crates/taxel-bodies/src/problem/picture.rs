//! The picture of a body that is being solved.

use taxel_fem::mesh::Mesh;
use taxel_fem::output::{ColourMap, Colours, OutputError, Picture, Values};
use taxel_fem::problem::Contact;
use taxel_fem::solver::stress::{nodal_stress, von_mises};

use super::body::Body;
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
