//! What can be seen to be wrong before solving.

use std::collections::HashMap;

use super::constraint::following;
use super::rigid::free_part;
use super::{
    Contact, Kinematics, Motion, Parameter, Problem, ProblemError, Quantity, Rule, SurfacePair,
};
use crate::material::Material;
use crate::mesh::Facet;

/// Every solid has to be stable up to this stretch and down to its inverse.
const STABLE_TO: f64 = 1.25;

impl Problem {
    /// Checks what can be checked before solving.
    ///
    /// # Errors
    /// [`ProblemError`]: materials that are too few, too many or without sense; supports of a
    /// component that there is not, that contradict each other or leave a rigid motion free;
    /// loads on nothing; numbers of parameters, nodes and cavities that there are not.
    pub fn check(&self) -> Result<(), ProblemError> {
        self.check_materials()?;
        self.check_supports()?;
        self.check_rigid_bodies()?;
        self.check_constraints()?;
        self.check_loads()?;
        self.check_rules()?;
        // A contact may hold the body.
        match free_part(self, &[]).filter(|_| self.contacts.is_empty()) {
            Some(part) => Err(ProblemError::NotFixed(part)),
            None => Ok(()),
        }
    }

    fn check_materials(&self) -> Result<(), ProblemError> {
        if let Some(name) = self.mesh.regions.get(self.materials.len()) {
            return Err(ProblemError::NoMaterial(name.clone()));
        }
        let regions = self.mesh.regions.len();
        if self.materials.len() > regions || self.relaxations.len() > regions {
            return Err(ProblemError::SurplusMaterials {
                found: self.materials.len().max(self.relaxations.len()),
                regions: self.mesh.regions.join(", "),
            });
        }
        for (region, material) in self.mesh.regions.iter().zip(&self.materials) {
            Material::new(material.law, material.volumetric)
                .and_then(|material| material.require_stable(1.0 / STABLE_TO, STABLE_TO))
                .map_err(|reason| ProblemError::Unstable {
                    region: region.clone(),
                    reason,
                })?;
        }
        Ok(())
    }

    fn check_supports(&self) -> Result<(), ProblemError> {
        let mut known: HashMap<(u32, usize), Motion> = HashMap::new();
        for support in &self.supports {
            self.check_component(support.component)?;
            if let Motion::Driven(parameter, _) = support.motion {
                self.check_parameter(parameter)?;
            }
            for &node in &support.nodes {
                self.check_node(node)?;
                let slot = (node, support.component);
                let first = *known.entry(slot).or_insert(support.motion);
                if !agree(first, support.motion) {
                    return Err(ProblemError::Contradiction {
                        node,
                        component: support.component,
                        place: self.mesh.points[node as usize],
                        first: self.motion_in_words(first),
                        second: self.motion_in_words(support.motion),
                    });
                }
            }
        }
        Ok(())
    }

    fn check_rigid_bodies(&self) -> Result<(), ProblemError> {
        let mut body_of: HashMap<u32, usize> = HashMap::new();
        for (number, body) in self.rigid_bodies.iter().enumerate() {
            if body.nodes.is_empty() {
                return Err(ProblemError::EmptyRigidBody { body: number });
            }
            for motion in body.motions() {
                if let Motion::Driven(parameter, _) = motion {
                    self.check_parameter(parameter)?;
                }
            }
            for &node in &body.nodes {
                self.check_node(node)?;
                if let Some(other) = body_of
                    .insert(node, number)
                    .filter(|known| *known != number)
                {
                    return Err(self.rigid_node(number, node, format!("rigid body {other}")));
                }
            }
        }
        for support in &self.supports {
            for &node in &support.nodes {
                let Some(&body) = body_of.get(&node) else {
                    continue;
                };
                let redundant = agree(support.motion, Motion::Fixed)
                    && self.rigid_bodies[body].keeps(support.component);
                if !redundant {
                    let motion = self.motion_in_words(support.motion);
                    let other = format!("a support ({motion} in component {})", support.component);
                    return Err(self.rigid_node(body, node, other));
                }
            }
        }
        for (number, constraint) in self.constraints.iter().enumerate() {
            let terms = constraint.terms.iter().map(|(term, _)| term.0);
            for node in std::iter::once(constraint.dependent.0).chain(terms) {
                if let Some(&body) = body_of.get(&node) {
                    return Err(self.rigid_node(body, node, format!("constraint {number}")));
                }
            }
        }
        Ok(())
    }

    fn rigid_node(&self, body: usize, node: u32, other: String) -> ProblemError {
        ProblemError::RigidNode {
            body,
            node,
            place: self.mesh.points[node as usize],
            other,
        }
    }

    fn check_constraints(&self) -> Result<(), ProblemError> {
        for (number, constraint) in self.constraints.iter().enumerate() {
            let terms = constraint.terms.iter().map(|(term, _)| *term);
            for (node, component) in std::iter::once(constraint.dependent).chain(terms) {
                self.check_node(node)?;
                self.check_component(component)?;
            }
            for &(parameter, _) in &constraint.drive {
                self.check_parameter(parameter)?;
            }
            let factors = constraint.terms.iter().map(|(_, factor)| *factor);
            let mut factors = factors.chain(constraint.drive.iter().map(|(_, factor)| *factor));
            if let Some(value) = factors.find(|factor| !factor.is_finite()) {
                return Err(ProblemError::Factor {
                    constraint: number,
                    value,
                });
            }
        }
        following(self).map(drop)
    }

    fn motion_in_words(&self, motion: Motion) -> String {
        match motion {
            Motion::Fixed => "fixed".to_owned(),
            Motion::Driven(parameter, factor) => {
                format!("driven by {factor} times {:?}", self.name(parameter))
            }
        }
    }

    fn check_loads(&self) -> Result<(), ProblemError> {
        for load in &self.pressures {
            self.check_parameter(load.parameter)?;
            self.check_surface("pressure", load.parameter, &load.surface)?;
        }
        for load in &self.dead_loads {
            self.check_parameter(load.parameter)?;
            load.forces
                .iter()
                .try_for_each(|&(node, _)| self.check_node(node))?;
        }
        for cavity in &self.cavities {
            self.check_parameter(cavity.pressure)?;
            self.check_component(cavity.axis)?;
            self.check_surface("cavity", cavity.pressure, &cavity.wall)?;
        }
        for (number, contact) in self.contacts.iter().enumerate() {
            match contact {
                Contact::Obstacle(obstacle) => {
                    if let Some((_, parameter)) = obstacle.travel {
                        self.check_parameter(parameter)?;
                    }
                }
                Contact::Surfaces(pair) => self.check_pair(number, pair)?,
                Contact::Walls(_) => {}
            }
        }
        Ok(())
    }

    fn check_pair(&self, contact: usize, pair: &SurfacePair) -> Result<(), ProblemError> {
        let facets = |surface: &[Facet]| -> Result<f64, ProblemError> {
            surface.iter().try_for_each(|facet| {
                no_more("cell", facet.cell as usize, self.mesh.cell_count())
            })?;
            Ok(surface.len() as f64)
        };
        let (first, second) = (facets(&pair.first)?, facets(&pair.second)?);
        let some = "a surface with facets";
        let positive = "a number above 0";
        let least = f64::MIN_POSITIVE;
        let bounds = [
            (
                "the number of facets of the first surface",
                first,
                1.0,
                some,
            ),
            (
                "the number of facets of the second surface",
                second,
                1.0,
                some,
            ),
            ("the stiffness in Pa/m", pair.stiffness, least, positive),
            ("the friction", pair.friction, 0.0, "0 or more"),
            (
                "the accepted overlap in m",
                pair.overlap_limit,
                least,
                positive,
            ),
            ("the reach in m", pair.reach, least, positive),
        ];
        for (what, value, least, allowed) in bounds {
            if !value.is_finite() || value < least {
                return Err(ProblemError::Contact {
                    contact,
                    what,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }

    fn check_rules(&self) -> Result<(), ProblemError> {
        let cavity = |number: usize| {
            if number < self.cavities.len() {
                Ok(())
            } else {
                Err(ProblemError::NoSuch {
                    what: "cavity",
                    number,
                    count: self.cavities.len(),
                })
            }
        };
        self.rules.iter().try_for_each(|rule| match rule {
            Rule::Given | Rule::Prescribes(Quantity::Arc(_)) => Ok(()),
            Rule::Follows(number, _) | Rule::Prescribes(Quantity::Volume(number)) => {
                cavity(*number)
            }
            Rule::Prescribes(Quantity::Displacement(node, component)) => {
                self.check_node(*node)?;
                self.check_component(*component)
            }
            Rule::Prescribes(Quantity::Force(parameter)) => self.check_parameter(*parameter),
        })
    }

    pub(super) fn check_component(&self, component: usize) -> Result<(), ProblemError> {
        if component < self.kinematics.components() {
            return Ok(());
        }
        Err(ProblemError::Component {
            component,
            kinematics: self.kinematics,
            last: self.kinematics.components() - 1,
        })
    }

    fn check_parameter(&self, parameter: Parameter) -> Result<(), ProblemError> {
        no_more("parameter", parameter.0, self.rules.len())
    }

    fn check_node(&self, node: u32) -> Result<(), ProblemError> {
        no_more("node", node as usize, self.mesh.points.len())
    }

    fn check_surface(
        &self,
        what: &'static str,
        parameter: Parameter,
        surface: &[Facet],
    ) -> Result<(), ProblemError> {
        if surface.is_empty() {
            return Err(ProblemError::EmptySurface {
                what,
                parameter: self.name(parameter).to_owned(),
            });
        }
        surface
            .iter()
            .try_for_each(|facet| no_more("cell", facet.cell as usize, self.mesh.cell_count()))
    }
}

fn no_more(what: &'static str, number: usize, count: usize) -> Result<(), ProblemError> {
    if number < count {
        Ok(())
    } else {
        Err(ProblemError::NoSuch {
            what,
            number,
            count,
        })
    }
}

/// True if two motions of one component are the same but for rounding.
fn agree(one: Motion, other: Motion) -> bool {
    let parts = |motion| match motion {
        Motion::Driven(parameter, factor) if factor != 0.0 => (Some(parameter), factor),
        Motion::Fixed | Motion::Driven(..) => (None, 0.0),
    };
    let ((first, a), (second, b)) = (parts(one), parts(other));
    let same: bool = (a - b).abs() <= 1e-12 * f64::max(a.abs(), b.abs());
    first == second && same
}

impl Kinematics {
    /// Name for people.
    pub(super) const fn words(self) -> &'static str {
        match self {
            Self::PlaneStrain => "plane strain",
            Self::Axisymmetric => "axisymmetry",
            Self::Solid => "space",
        }
    }
}
