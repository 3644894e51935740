//! Linear response of a body at a state, from rest on.

use super::failure::Failure;
use super::newton::Solver;
use crate::assembly::system::Assembled;
use crate::problem::Parameter;

/// Bulk over shear modulus at which a solid that keeps its volume is taken here: without an
/// iteration that ends at the exact volume, the share that it gives way is the reciprocal.
const STIFF: f64 = 1e8;

/// Change of a body with a parameter, all other parameters held.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearResponse {
    /// Change of the displacement of each node, m per unit of the parameter.
    pub displacement: Vec<[f64; 3]>,
    /// Change of the force along each parameter, N (N/m in plane strain) per unit.
    pub forces: Vec<f64>,
    /// Change of the volume of each cavity (area in plane strain) per unit.
    pub volumes: Vec<f64>,
}

impl Solver {
    /// Slope of everything by a parameter at the accepted state, at rest before the first step:
    /// one linear system, without the rounding of a difference of two states. Rules of other
    /// parameters are not followed. Bodies that keep their volume are taken with a bulk modulus
    /// of 1e8 shear moduli; the slope is then exact to about 1e-6.
    ///
    /// # Errors
    /// When the tangent is singular there.
    ///
    /// # Example
    /// ```
    /// use taxel_fem::material::{Law, Material, Volumetric};
    /// use taxel_fem::mesh::{Axis, Grid2};
    /// use taxel_fem::problem::{Kinematics, Motion, Problem, Rule};
    /// use taxel_fem::solver::newton::Solver;
    ///
    /// let axis = || Axis::uniform(0.0, 1.0, 2);
    /// let mesh = Grid2::new([axis()?, axis()?], "rubber").mesh()?;
    /// let mut problem = Problem::new(mesh, Kinematics::PlaneStrain)?;
    /// problem.materials.push(Material::new(Law::neo_hookean(1e5), Volumetric::Incompressible)?);
    /// problem.support("left", 0, Motion::Fixed)?;
    /// problem.support("bottom", 1, Motion::Fixed)?;
    /// let pull = problem.parameter("pull", Rule::Given);
    /// problem.support("top", 1, Motion::Driven(pull, 1.0))?;
    /// // Modulus of plane strain, 4 G.
    /// let slope = Solver::new(problem)?.linear_response(pull)?.forces[0];
    /// assert!((slope / 4e5 - 1.0).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn linear_response(&mut self, parameter: Parameter) -> Result<LinearResponse, Failure> {
        let mut responses = self.linear_responses(&[parameter])?;
        Ok(responses.swap_remove(0))
    }

    /// [`Self::linear_response`] to each of several parameters, with one factorisation.
    ///
    /// # Errors
    /// When the tangent is singular there.
    pub fn linear_responses(
        &mut self,
        parameters: &[Parameter],
    ) -> Result<Vec<LinearResponse>, Failure> {
        let usual = std::mem::replace(&mut self.system.elimination, STIFF);
        let assembled = self.assemble(&self.state.clone());
        self.system.elimination = usual;
        let assembled = assembled.map_err(Failure::at_start)?;
        self.renew(&assembled)
            .map_err(|error| Failure::at_start(error.into()))?;
        let each = parameters.iter();
        each.map(|&parameter| self.solved(&assembled, parameter))
            .collect()
    }

    /// The response with the tangent that is factorised.
    fn solved(
        &mut self,
        assembled: &Assembled,
        parameter: Parameter,
    ) -> Result<LinearResponse, Failure> {
        let coupling = assembled.couplings[parameter.0].iter();
        let load: Vec<f64> = coupling.map(|c| -c).collect();
        let unknowns = self
            .solve(assembled, &load)
            .map_err(|error| Failure::at_start(error.into()))?;
        let mut parameters = vec![0.0; self.problem.rules().len()];
        parameters[parameter.0] = 1.0;
        let mut displacement = vec![[0.0; 3]; self.problem.mesh.points.len()];
        self.system
            .displace(&mut displacement, &unknowns, &parameters);
        let along =
            |slope: &[f64]| -> f64 { slope.iter().zip(&unknowns).map(|(a, b)| a * b).sum() };
        let forces = (0..parameters.len()).map(|k| {
            let beyond = assembled.force_slopes[k].iter();
            let beyond: f64 = beyond
                .map(|&(number, slope)| slope * unknowns[number])
                .sum();
            along(&assembled.couplings[k]) + beyond + assembled.cross[k][parameter.0]
        });
        Ok(LinearResponse {
            forces: forces.collect(),
            volumes: assembled
                .volume_slopes
                .iter()
                .map(|slope| along(slope))
                .collect(),
            displacement,
        })
    }
}
