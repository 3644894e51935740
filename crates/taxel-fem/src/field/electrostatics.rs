//! Capacitances between conductors among dielectrics.
//!
//! Planes of symmetry: what is not named is a mirror (no flux passes); a plane of
//! odd symmetry is named in [`Electrostatics::zero`]. Results are those of the
//! modelled part.

use super::FieldError;
use super::geometry::named_nodes;
use super::laplace::{Coefficient, Domain};
use super::terminals::{Response, Square, Terminal, respond};

/// Permittivity of vacuum, F/m (CODATA 2022).
pub const VACUUM_PERMITTIVITY: f64 = 8.8541878188e-12;

/// The potential far away, when the mesh carries the image of the unbounded space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Infinity {
    /// Takes the value at which no charge sits there; in a plane, the charges of the
    /// conductors then add up to zero.
    #[default]
    Free,
    /// At zero.
    Zero,
}

/// Conductors among dielectrics.
#[derive(Clone, Copy, Debug)]
pub struct Electrostatics<'a> {
    /// Where.
    pub domain: Domain<'a>,
    /// Permittivity of each region relative to vacuum.
    pub permittivities: &'a [(&'a str, Coefficient)],
    /// Conductors: regions (left out of the field), surfaces or node sets.
    pub conductors: &'a [&'a str],
    /// Conductors without charge, whose potential follows; named like the others.
    pub floating: &'a [&'a str],
    /// Surfaces, node sets or regions at zero: ground, planes of odd symmetry.
    pub zero: &'a [&'a str],
    /// The potential far away.
    pub infinity: Infinity,
}

/// Capacitances of conductors: F, in a plane F/m.
#[derive(Clone, Debug)]
pub struct Capacitance {
    /// Names of the conductors, in the order of the rows.
    pub conductors: Vec<String>,
    /// Maxwell's matrix: charge of `i` when `j` is at 1 V and the others at zero.
    pub matrix: Vec<Vec<f64>>,
    /// The same from the fluxes through the conductors.
    pub by_flux: Vec<Vec<f64>>,
    /// Potential of each node for each conductor at 1 V; zero outside the field.
    pub potentials: Vec<Vec<f64>>,
}

impl Electrostatics<'_> {
    /// Solves for all conductors at once.
    ///
    /// # Errors
    /// [`FieldError`]: unknown names, conductors that touch, missing permittivities,
    /// cells turned inside out, parts of the field without a conductor.
    pub fn capacitance(&self) -> Result<Capacitance, FieldError> {
        let names: Vec<&str> = [self.conductors, self.floating].concat();
        let mut left_out = Vec::new();
        let mut terminals = Vec::new();
        for name in &names {
            terminals.push(self.terminal(name, &mut left_out)?);
        }
        let mut zero = Terminal {
            name: self.zero.join(", "),
            nodes: Vec::new(),
        };
        for name in self.zero {
            let part = self.terminal(name, &mut left_out)?;
            zero.nodes.extend(part.nodes);
        }
        if let (Infinity::Zero, Some(exterior)) = (self.infinity, self.domain.exterior) {
            zero.nodes.push(exterior.infinity);
        }
        let relative = self.domain.coefficients(self.permittivities, &left_out)?;
        let absolute: Vec<_> = relative
            .into_iter()
            .map(|k| k.map(|k| k.scaled(VACUUM_PERMITTIVITY)))
            .collect();
        let mut response = respond(&self.domain, &absolute, &terminals, &zero)?;
        for floating in (self.conductors.len()..names.len()).rev() {
            float(&mut response, floating)?;
        }
        Ok(Capacitance {
            conductors: self.conductors.iter().map(|&name| name.into()).collect(),
            matrix: response.by_energy,
            by_flux: response.by_flux,
            potentials: response.potentials,
        })
    }

    fn terminal(&self, name: &str, left_out: &mut Vec<usize>) -> Result<Terminal, FieldError> {
        let mesh = self.domain.mesh;
        let region = mesh.regions.iter().position(|known| known == name);
        let exterior = self.domain.exterior;
        let nodes = if let Some(region) = region {
            // A conductor that reaches the ball goes on outside it.
            let images = exterior.into_iter().flat_map(|e| e.images_of(region));
            let regions: Vec<usize> = std::iter::once(region).chain(images).collect();
            left_out.extend(&regions);
            (0..mesh.cell_count())
                .filter(|&cell| regions.contains(&mesh.region_of(cell)))
                .flat_map(|cell| mesh.cell(cell).iter().copied())
                .collect()
        } else {
            let mut nodes = named_nodes(mesh, name)?;
            if let Some(exterior) = exterior {
                nodes.extend(exterior.continuation(self.groups(name, &nodes).into_iter()));
            }
            nodes
        };
        Ok(Terminal {
            name: name.to_owned(),
            nodes,
        })
    }
}

impl Electrostatics<'_> {
    /// Nodes of the facets of a surface; of a node set, its nodes in each side of a cell that it
    /// has whole.
    fn groups(&self, name: &str, nodes: &[u32]) -> Vec<Vec<u32>> {
        let mesh = self.domain.mesh;
        if let Some(facets) = mesh.surfaces.get(name) {
            return facets
                .iter()
                .map(|&facet| mesh.facet_nodes(facet).collect())
                .collect();
        }
        let mut named = vec![false; mesh.points.len()];
        for &node in nodes {
            named[node as usize] = true;
        }
        let mut groups = Vec::new();
        for cell in 0..mesh.cell_count() {
            let own = mesh.cell(cell);
            for side in mesh.shape(cell).sides() {
                let side: Vec<u32> = side.iter().map(|&local| own[usize::from(local)]).collect();
                if side.iter().all(|&node| named[node as usize]) {
                    groups.push(side);
                }
            }
        }
        groups
    }
}

/// Removes the last conductor by giving it the potential at which it has no charge.
fn float(response: &mut Response, last: usize) -> Result<(), FieldError> {
    let own = response.by_energy[last][last];
    // A conductor whose potential nothing fixes has only rounding left here.
    if own.is_nan() || own <= 1e-12 * response.stiffness[last] {
        return Err(FieldError::Undetermined { unknowns: 1 });
    }
    let follows: Vec<f64> = (0..last)
        .map(|k| -response.by_energy[last][k] / own)
        .collect();
    let floating = response.potentials.remove(last);
    for (potential, factor) in response.potentials.iter_mut().zip(&follows) {
        for (value, at_floating) in potential.iter_mut().zip(&floating) {
            *value += factor * at_floating;
        }
    }
    eliminate(&mut response.by_energy, &follows);
    eliminate(&mut response.by_flux, &follows);
    Ok(())
}

fn eliminate(matrix: &mut Square, follows: &[f64]) {
    let last = follows.len();
    matrix.truncate(last);
    for row in matrix {
        let to_floating = row[last];
        row.truncate(last);
        for (entry, factor) in row.iter_mut().zip(follows) {
            *entry += to_floating * factor;
        }
    }
}

impl Capacitance {
    /// Number of a conductor.
    ///
    /// # Errors
    /// [`FieldError::UnknownName`].
    pub fn number(&self, name: &str) -> Result<usize, FieldError> {
        let found = self.conductors.iter().position(|known| known == name);
        found.ok_or_else(|| FieldError::UnknownName {
            kind: "conductor",
            name: name.to_owned(),
            known: self.conductors.join(", "),
        })
    }

    /// Capacitance between two conductors alone, the others and ground guarded.
    pub fn mutual(&self, i: usize, j: usize) -> f64 {
        -self.matrix[i][j]
    }

    /// Capacitance of a conductor to all that is at zero, infinity included.
    pub fn to_ground(&self, i: usize) -> f64 {
        self.matrix[i].iter().sum()
    }

    /// Twice the energy with two conductors at plus and minus 1/2 V, the others at zero.
    pub fn differential(&self, i: usize, j: usize) -> f64 {
        let c = &self.matrix;
        (c[i][i] + c[j][j] - 2.0 * c[i][j]) / 4.0
    }

    /// Largest difference between energies and fluxes, relative to the largest entry.
    pub fn mismatch(&self) -> f64 {
        let all = self
            .matrix
            .iter()
            .flatten()
            .zip(self.by_flux.iter().flatten());
        let (mut difference, mut largest) = (0.0_f64, f64::MIN_POSITIVE);
        for (energy, flux) in all {
            difference = difference.max((energy - flux).abs());
            largest = largest.max(energy.abs());
        }
        difference / largest
    }
}
