//! A solved body as files and pictures show it.

use taxel::predict::SolvedBody;
use taxel_fem::mesh::Mesh;
use taxel_fem::output::{ColourMap, Colours, Encoding, OutputError, Picture, Values, Vtu};
use taxel_fem::solver::newton::Solver;
use taxel_fem::solver::stress::stress_points;

/// A deformed body with its stresses, at one load.
#[derive(Debug, Clone)]
pub struct DeformedBody {
    name: String,
    load: String,
    mesh: Mesh,
    /// Three components for each node, m.
    displacement: Vec<[f64; 3]>,
    /// Means of the cells, Pa.
    von_mises: Vec<f64>,
    mean_stress: Vec<f64>,
    /// Plane surface of a body in space that a picture shows.
    face: &'static str,
}

/// The mesh follows from what the body was made of.
impl PartialEq for DeformedBody {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
            && self.load == other.load
            && self.displacement == other.displacement
    }
}

impl DeformedBody {
    /// The body at the present state of a solver; a picture of a body in space shows its
    /// surface `face`.
    pub(crate) fn of(solver: &Solver, name: &str, load: String, face: &'static str) -> Self {
        let (problem, state) = (solver.problem(), solver.state());
        let cells = problem.mesh.cell_count();
        let (mut von_mises, mut mean_stress) = (vec![0.0; cells], vec![0.0; cells]);
        let mut volume = vec![0.0; cells];
        for point in stress_points(problem, state) {
            let [xx, yy, zz, ..] = point.cauchy;
            von_mises[point.cell] += point.volume * point.von_mises;
            mean_stress[point.cell] += point.volume * (xx + yy + zz) / 3.0;
            volume[point.cell] += point.volume;
        }
        for stress in [&mut von_mises, &mut mean_stress] {
            for (stress, volume) in stress.iter_mut().zip(&volume) {
                *stress /= volume;
            }
        }
        Self {
            name: name.to_owned(),
            load,
            displacement: state.displacement.clone(),
            mesh: problem.mesh.clone(),
            von_mises,
            mean_stress,
            face,
        }
    }

    fn grid(&self) -> Result<String, OutputError> {
        let grid = Vtu::new(&self.mesh)
            .point_field("displacement", 3, self.displacement.as_flattened())?
            .cell_field("von_mises_pa", 1, &self.von_mises)?
            .cell_field("mean_stress_pa", 1, &self.mean_stress)?;
        Ok(grid.text(Encoding::Base64))
    }

    fn drawn(&self) -> Result<String, OutputError> {
        let dimension = self.mesh.dimension();
        let moved: Vec<f64> = self
            .displacement
            .iter()
            .flat_map(|moved| moved[..dimension].to_vec())
            .collect();
        let stress: Vec<f64> = self.von_mises.iter().map(|stress| stress * 1e-3).collect();
        let picture = if dimension == 2 {
            Picture::plane(&self.mesh)?
        } else {
            Picture::surface(&self.mesh, self.face)?
        };
        picture
            .length_unit("um", 1e-6)
            .displacement(&moved)?
            .colours(Colours {
                title: "von Mises stress",
                unit: "kPa",
                values: Values::Cells(&stress),
                range: None,
                map: ColourMap::Sequential,
            })?
            .svg()
    }
}

impl SolvedBody for DeformedBody {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self) -> &str {
        &self.load
    }

    fn vtu(&self) -> Result<String, String> {
        self.grid().map_err(|error| error.to_string())
    }

    fn picture(&self) -> Result<String, String> {
        self.drawn().map_err(|error| error.to_string())
    }
}
