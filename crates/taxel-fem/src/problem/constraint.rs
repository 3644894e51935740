//! Linear multi-point constraints.

use std::collections::BTreeMap;

use super::{Motion, Parameter, Problem, ProblemError};

/// A component of the displacement of one node that follows others:
/// `u = sum factor u_i + sum factor parameter`.
///
/// The component is no unknown any more; its force goes to those that it follows. What it
/// follows may be free, held or driven by a support, or follow others itself. A constraint that
/// repeats what supports and other constraints say already is no mistake, as at the corners of a
/// periodic cell; one that says something else is.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint {
    /// Node and component that follow.
    pub dependent: (u32, usize),
    /// Node and component that they follow, with the factor.
    pub terms: Vec<((u32, usize), f64)>,
    /// Parameters that add to the displacement, with their factors.
    pub drive: Vec<(Parameter, f64)>,
}

/// What a component of displacement follows in the end: free components of nodes, and
/// parameters, each with its factor.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Leaders {
    pub(crate) nodes: BTreeMap<(u32, usize), f64>,
    pub(crate) parameters: BTreeMap<usize, f64>,
}

impl Leaders {
    fn of_motion(motion: Motion) -> Self {
        let mut leaders = Self::default();
        if let Motion::Driven(Parameter(number), factor) = motion {
            leaders.parameters.insert(number, factor);
        }
        leaders
    }

    fn add(&mut self, other: &Self, factor: f64) {
        for (&key, share) in &other.nodes {
            *self.nodes.entry(key).or_insert(0.0) += factor * share;
        }
        for (&key, share) in &other.parameters {
            *self.parameters.entry(key).or_insert(0.0) += factor * share;
        }
    }

    /// True if two say the same but for rounding.
    fn agree(&self, other: &Self) -> bool {
        let mut difference = self.clone();
        difference.add(other, -1.0);
        let largest = |leaders: &Self| {
            let all = leaders.nodes.values().chain(leaders.parameters.values());
            all.fold(0.0, |most: f64, factor| most.max(factor.abs()))
        };
        largest(&difference) <= 1e-9 * largest(self).max(largest(other)).max(1e-300)
    }
}

/// Supports and constraints put together: what each component that is no unknown follows.
pub(crate) type Following = BTreeMap<(u32, usize), Leaders>;

/// Puts the constraints of a problem together. Components of rigid bodies are not in it.
pub(crate) fn following(problem: &Problem) -> Result<Following, ProblemError> {
    let mut found = Following::new();
    for support in &problem.supports {
        for &node in &support.nodes {
            let leaders = Leaders::of_motion(support.motion);
            found.insert((node, support.component), leaders);
        }
    }
    let mut of = BTreeMap::new();
    for (number, constraint) in problem.constraints.iter().enumerate() {
        if !found.contains_key(&constraint.dependent) {
            of.entry(constraint.dependent).or_insert(number);
        }
    }
    let mut open = Vec::new();
    for number in 0..problem.constraints.len() {
        let leaders = leaders(problem, number, &of, &mut found, &mut open)?;
        let dependent = problem.constraints[number].dependent;
        let first = found.entry(dependent).or_insert_with(|| leaders.clone());
        if !first.agree(&leaders) {
            return Err(ProblemError::GivenTwice {
                constraint: number,
                node: dependent.0,
                component: dependent.1,
                place: problem.mesh.points[dependent.0 as usize],
                by: match of.get(&dependent) {
                    Some(other) => format!("constraint {other}"),
                    None => "a support".to_owned(),
                },
            });
        }
    }
    Ok(found)
}

/// What the terms of a constraint follow in the end; `open` are those that ask for it.
fn leaders(
    problem: &Problem,
    number: usize,
    of: &BTreeMap<(u32, usize), usize>,
    found: &mut Following,
    open: &mut Vec<usize>,
) -> Result<Leaders, ProblemError> {
    let constraint = &problem.constraints[number];
    if open.contains(&number) {
        return Err(ProblemError::FollowsItself {
            constraint: number,
            node: constraint.dependent.0,
            component: constraint.dependent.1,
            place: problem.mesh.points[constraint.dependent.0 as usize],
        });
    }
    open.push(number);
    let mut sum = Leaders::default();
    for &(Parameter(parameter), factor) in &constraint.drive {
        *sum.parameters.entry(parameter).or_insert(0.0) += factor;
    }
    for &(term, factor) in &constraint.terms {
        if let (None, Some(&other)) = (found.get(&term), of.get(&term)) {
            let leaders = leaders(problem, other, of, found, open)?;
            found.insert(term, leaders);
        }
        match found.get(&term) {
            Some(leaders) => sum.add(leaders, factor),
            None => *sum.nodes.entry(term).or_insert(0.0) += factor,
        }
    }
    open.pop();
    sum.nodes.retain(|_, factor| *factor != 0.0);
    sum.parameters.retain(|_, factor| *factor != 0.0);
    Ok(sum)
}

impl Problem {
    /// Makes a pair of surfaces periodic: every node of the second moves as the one of the first
    /// that lies opposite, in all components, plus `drive`: a component, a parameter and its
    /// factor each. Both need the same mesh, one shifted from the other.
    ///
    /// # Errors
    /// When the mesh has no such names, or a node has none opposite.
    pub fn periodic(
        &mut self,
        surfaces: [&str; 2],
        drive: &[(usize, Parameter, f64)],
    ) -> Result<(), ProblemError> {
        let nodes = |name: &str| {
            let nodes = self.mesh.nodes_of(name);
            nodes.ok_or_else(|| self.unknown_surface(name))
        };
        let [first, second] = [nodes(surfaces[0])?, nodes(surfaces[1])?];
        let components = self.kinematics.components();
        for (leader, follower) in self.opposite(surfaces, &first, &second)? {
            for component in 0..components {
                let own = drive.iter().filter(|(of, ..)| *of == component);
                self.constraints.push(Constraint {
                    dependent: (follower, component),
                    terms: vec![((leader, component), 1.0)],
                    drive: own.map(|&(_, by, factor)| (by, factor)).collect(),
                });
            }
        }
        Ok(())
    }

    /// Nodes of two surfaces that lie opposite each other, shifted by the distance of their
    /// middles.
    fn opposite(
        &self,
        names: [&str; 2],
        first: &[u32],
        second: &[u32],
    ) -> Result<Vec<(u32, u32)>, ProblemError> {
        let point = |node: u32| self.mesh.points[node as usize];
        let box_of = |nodes: &[u32]| {
            let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for &node in nodes {
                for d in 0..3 {
                    low[d] = low[d].min(point(node)[d]);
                    high[d] = high[d].max(point(node)[d]);
                }
            }
            (low, high)
        };
        let ((low, high), (other, _)) = (box_of(first), box_of(second));
        let size = (0..3).fold(0.0, |most: f64, d| most.max(high[d] - low[d]));
        let grain = SAME * size;
        // Places on a grid of which a node touches two lines at most.
        let key = |x: [f64; 3], from: [f64; 3], lift: f64| -> [i64; 3] {
            std::array::from_fn(|d| ((x[d] - from[d]) / grain + lift).floor() as i64)
        };
        let mut known = BTreeMap::new();
        for &node in first {
            for lift in [0.25, 0.75] {
                known.insert(key(point(node), low, lift), node);
            }
        }
        let mut pairs = Vec::new();
        for &node in second {
            let found = [0.25, 0.75]
                .iter()
                .find_map(|&lift| known.get(&key(point(node), other, lift)));
            match found {
                Some(&leader) => pairs.push((leader, node)),
                None => {
                    return Err(ProblemError::NotOpposite {
                        first: names[0].to_owned(),
                        second: names[1].to_owned(),
                        place: point(node),
                    });
                }
            }
        }
        if first.len() != second.len() {
            let leaders: std::collections::BTreeSet<u32> = pairs.iter().map(|p| p.0).collect();
            let alone = first.iter().find(|node| !leaders.contains(node));
            return Err(ProblemError::NotOpposite {
                first: names[1].to_owned(),
                second: names[0].to_owned(),
                place: alone.map_or([f64::NAN; 3], |&node| point(node)),
            });
        }
        Ok(pairs)
    }

    /// Makes one component of a surface keep a mean displacement over its undeformed area,
    /// `drive` times its parameter (zero without). The node of the largest share follows all
    /// others: on a surface of many thousand nodes the matrix becomes dense there.
    ///
    /// # Errors
    /// When the mesh has no such surface, or the body no such component.
    pub fn keep_mean(
        &mut self,
        surface: &str,
        component: usize,
        drive: Option<(Parameter, f64)>,
    ) -> Result<(), ProblemError> {
        self.check_component(component)?;
        let facets = self.surface(surface)?;
        let shares =
            super::load::traction(&self.mesh, self.kinematics, &facets, |_| [1.0, 0.0, 0.0]);
        let Some(&(node, [largest, ..])) = shares.iter().max_by(|a, b| a.1[0].total_cmp(&b.1[0]))
        else {
            return Ok(());
        };
        let whole: f64 = shares.iter().map(|(_, share)| share[0]).sum();
        let others = shares.iter().filter(|(other, _)| *other != node);
        self.constraints.push(Constraint {
            dependent: (node, component),
            terms: others
                .map(|&(other, share)| ((other, component), -share[0] / largest))
                .collect(),
            drive: drive
                .map(|(by, factor)| (by, factor * whole / largest))
                .into_iter()
                .collect(),
        });
        Ok(())
    }
}

/// Distance over the size of a surface within which two nodes lie opposite each other.
const SAME: f64 = 1e-6;
