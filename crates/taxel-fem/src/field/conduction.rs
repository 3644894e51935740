//! Steady current through conducting regions: resistance of the deformed shape.

use super::FieldError;
use super::geometry::named_nodes;
use super::laplace::{Coefficient, Domain, region_number};
use super::terminals::{Terminal, respond};

/// Current between two surfaces; all other boundaries are insulated.
#[derive(Clone, Copy, Debug)]
pub struct Conduction<'a> {
    /// Where.
    pub domain: Domain<'a>,
    /// Regions that conduct, with their conductivities in S/m.
    pub conductivities: &'a [(&'a str, Coefficient)],
    /// Surface or node set at 1 V.
    pub from: &'a str,
    /// Surface or node set at zero.
    pub to: &'a str,
}

/// A resistance: ohm, in a plane ohm m (times the reciprocal of the depth).
#[derive(Clone, Debug)]
pub struct Resistance {
    /// From the power at 1 V; its error is the square of that of the potential.
    pub by_power: f64,
    /// From the current through the first surface.
    pub by_flux: f64,
    /// Potential of each node at 1 V in all; zero outside the conductor.
    pub potential: Vec<f64>,
}

impl Conduction<'_> {
    /// Solves for the resistance.
    ///
    /// # Errors
    /// [`FieldError`]: unknown names, surfaces that touch, conductivities not
    /// positive, cells turned inside out, parts without a potential.
    pub fn resistance(&self) -> Result<Resistance, FieldError> {
        let mesh = self.domain.mesh;
        let mut coefficients = vec![None; mesh.regions.len()];
        for (name, conductivity) in self.conductivities {
            coefficients[region_number(mesh, name)?] = Some(*conductivity);
        }
        let terminal = |name: &str| {
            named_nodes(mesh, name).map(|nodes| Terminal {
                name: name.to_owned(),
                nodes,
            })
        };
        // The second end is a terminal too, so that a current through it is seen to
        // exist and surfaces that touch are found.
        let ends = [terminal(self.from)?, terminal(self.to)?];
        let nothing = Terminal {
            name: String::new(),
            nodes: Vec::new(),
        };
        let mut response = respond(&self.domain, &coefficients, &ends, &nothing)?;
        Ok(Resistance {
            by_power: 1.0 / response.by_energy[0][0],
            by_flux: -1.0 / response.by_flux[1][0],
            potential: response.potentials.swap_remove(0),
        })
    }
}
