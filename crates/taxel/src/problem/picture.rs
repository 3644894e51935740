//! The picture of a body that is being solved.

use taxel_fem::mesh::Mesh;
use taxel_fem::output::{ColourMap, Colours, OutputError, Picture, Values};
use taxel_fem::problem::Contact;
use taxel_fem::solver::stress::{nodal_stress, von_mises};

use super::body::Body;
use crate::quantity;

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
        let (unit, size) = self.length_unit();
        picture
            .length_unit(unit, size)
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

    /// The largest unit that goes into the scale bar of a picture, about a fifth of its width.
    fn length_unit(&self) -> (&'static str, f64) {
        let mesh = &self.solver.problem().mesh;
        let extent = |d: usize| -> f64 {
            let along = mesh.points.iter().map(|point| point[d]);
            let [low, high] = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            });
            high - low
        };
        let width = if mesh.dimension() == 2 {
            extent(0)
        } else {
            (0..3).map(extent).fold(0.0, f64::max)
        };
        let units = quantity::LENGTH.units.iter().rev();
        let mut fitting = units.filter(|(_, size)| *size <= 0.2 * width * (1.0 + 1e-9));
        *fitting.next().unwrap_or(&quantity::LENGTH.units[0])
    }
}
