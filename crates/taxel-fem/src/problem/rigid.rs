//! Rigid motions of a body that its supports do not hold.

use taxel_numerics::dense::cross;

use super::{Contact, Motion, Problem, Quantity, Rule};
use crate::mesh::error::{at, scale};
use crate::mesh::{Mesh, Parts};

/// A rigid motion that nothing holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FreeMotion {
    /// Along a direction.
    Translation([f64; 3]),
    /// About an axis (in the plane: across it) through a point.
    Rotation {
        /// Unit direction of the axis.
        axis: [f64; 3],
        /// A point of the axis, m.
        through: [f64; 3],
    },
}

impl FreeMotion {
    fn scale(&mut self, by: f64) {
        if let Self::Rotation { through, .. } = self {
            scale(through, by);
        }
    }
}

impl std::fmt::Display for FreeMotion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Translation(along) => {
                let most = |k: &usize| along[*k].abs() > 1.0 - 1e-6;
                match (0..3).find(most) {
                    Some(component) => {
                        write!(
                            f,
                            "translation in component {component} ({})",
                            ["x", "y", "z"][component]
                        )
                    }
                    None => write!(f, "translation along {}", at(along)),
                }
            }
            Self::Rotation { axis, through } => {
                write!(f, "rotation about {} through {}", at(axis), at(through))
            }
        }
    }
}

/// Share of a whole motion below which it does not move a support.
const NEGLIGIBLE: f64 = 1e-9;

/// A part of the body that its supports leave free to move.
#[derive(Clone, Debug, PartialEq)]
pub struct FreePart {
    /// Rigid motions that move no held or driven component of it, independent of each other: at
    /// least one.
    pub motions: Vec<FreeMotion>,
    /// Region of the part and undeformed place of one of its nodes, if the body has several parts
    /// that share no node.
    pub region: Option<Box<(String, [f64; 3])>>,
}

impl FreePart {
    /// The same with its places in a unit in which lengths are `by` times as many; true if it has
    /// any.
    pub(crate) fn scale(&mut self, by: f64) -> bool {
        self.motions.iter_mut().for_each(|motion| motion.scale(by));
        if let Some(region) = &mut self.region {
            scale(&mut region.1, by);
        }
        let turns = |motion: &FreeMotion| matches!(motion, FreeMotion::Rotation { .. });
        self.region.is_some() || self.motions.iter().any(turns)
    }
}

impl std::fmt::Display for FreePart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let motions: Vec<String> = self.motions.iter().map(ToString::to_string).collect();
        let motions = motions.join(", and against ");
        match self.region.as_deref() {
            Some((region, place)) => write!(
                f,
                "the part {region:?} of the body near {}, which shares no node with the rest, against {motions}",
                at(place)
            ),
            None => write!(f, "the body against {motions}"),
        }
    }
}

/// What a contact holds of the parts at its surfaces.
pub(crate) struct Hold {
    /// Nodes of its surfaces.
    pub(crate) nodes: Vec<u32>,
    /// Undeformed places at which it presses, each with a direction along which nothing moves there.
    pub(crate) directions: Vec<[[f64; 3]; 2]>,
}

/// The part of each node: nodes of one cell, of one rigid body, of one constraint and of one tie are
/// of one part. Nodes of no cell have none.
fn parts(problem: &Problem) -> Vec<Option<u32>> {
    let mesh = &problem.mesh;
    let mut parts = Parts::of_cells(mesh, |_| true);
    let mut used = vec![false; mesh.points.len()];
    for cell in 0..mesh.cell_count() {
        mesh.cell(cell)
            .iter()
            .for_each(|&node| used[node as usize] = true);
    }
    for body in &problem.rigid_bodies {
        body.nodes
            .iter()
            .for_each(|&node| parts.join(body.nodes[0], node));
    }
    for constraint in &problem.constraints {
        let terms = constraint.terms.iter();
        terms.for_each(|((node, _), _)| parts.join(constraint.dependent.0, *node));
    }
    for contact in &problem.contacts {
        let Contact::Walls(walls) = contact else {
            continue;
        };
        for point in walls.points.iter().filter(|point| point.is_bound()) {
            let nodes = point.nodes.iter();
            nodes.for_each(|&node| parts.join(point.nodes[0], node));
        }
    }
    (0..mesh.points.len() as u32)
        .map(|node| used[node as usize].then(|| parts.root(node)))
        .collect()
}

/// The first part of a body that neither its supports nor these contacts hold; none where all are
/// held.
pub(crate) fn free_part(problem: &Problem, holds: &[Hold]) -> Option<FreePart> {
    let parts = parts(problem);
    let mut roots: Vec<u32> = parts.iter().copied().flatten().collect();
    roots.sort_unstable();
    roots.dedup();
    roots.iter().find_map(|&part| {
        let of = |node: u32| parts[node as usize] == Some(part);
        let motions = free_motions(problem, holds, &of);
        if motions.is_empty() {
            return None;
        }
        let mesh = &problem.mesh;
        let mut cells = 0..mesh.cell_count();
        let cell = cells.find(|&cell| of(mesh.cell(cell)[0]))?;
        let region = (roots.len() > 1).then(|| {
            let place = mesh.points[mesh.cell(cell)[0] as usize];
            Box::new((mesh.regions[mesh.region_of(cell)].clone(), place))
        });
        Some(FreePart { motions, region })
    })
}

/// Independent rigid motions that move no held or driven component of a node of a part, and nothing
/// along a direction that a contact holds; none where all are held.
fn free_motions(
    problem: &Problem,
    holds: &[Hold],
    of_part: &dyn Fn(u32) -> bool,
) -> Vec<FreeMotion> {
    let mesh = &problem.mesh;
    let (middle, size) = extent(mesh);
    let scaled = |x: [f64; 3]| std::array::from_fn(|d| (x[d] - middle[d]) / size);
    let motions = problem.kinematics.rigid_motions();
    // Rows of a triangle: a motion that all of them leave out is free.
    let mut rows: Vec<[f64; 6]> = Vec::new();
    for support in &problem.supports {
        for &node in support.nodes.iter().filter(|&&node| of_part(node)) {
            let x = scaled(mesh.points[node as usize]);
            let mut row = [0.0; 6];
            for &motion in motions {
                row[motion] = moved(motion, x)[support.component];
            }
            reduce(&mut rows, row);
            if rows.len() == motions.len() {
                return Vec::new();
            }
        }
    }
    for body in &problem.rigid_bodies {
        let own = body.nodes.iter().filter(|&&node| of_part(node)).count();
        let x = scaled(body.point);
        for (number, of_body) in body.motions().enumerate() {
            // One node alone passes on no turn.
            if free_of_force(problem, of_body) || own == 0 || number > 2 && own == 1 {
                continue;
            }
            let mut row = [0.0; 6];
            for &motion in motions {
                row[motion] = match number {
                    0..3 => moved(motion, x)[number],
                    turn => f64::from(u8::from(turn == motion)),
                };
            }
            reduce(&mut rows, row);
        }
    }
    for constraint in &problem.constraints {
        let (dependent, component) = constraint.dependent;
        if !of_part(dependent) {
            continue;
        }
        let at = |node: u32| scaled(mesh.points[node as usize]);
        let mut row = [0.0; 6];
        for &motion in motions {
            let terms = constraint.terms.iter();
            let terms = terms.map(|&((node, i), factor)| factor * moved(motion, at(node))[i]);
            row[motion] = moved(motion, at(dependent))[component] - terms.sum::<f64>();
        }
        reduce(&mut rows, row);
    }
    for hold in holds
        .iter()
        .filter(|hold| hold.nodes.iter().any(|&n| of_part(n)))
    {
        for &[place, direction] in &hold.directions {
            let mut row = [0.0; 6];
            for &motion in motions {
                let way = moved(motion, scaled(place));
                row[motion] = (0..3).map(|d| way[d] * direction[d]).sum();
            }
            reduce(&mut rows, row);
        }
    }
    let mut free = Vec::new();
    while let Some(motion) = null_vector(&rows, motions) {
        rows.push(motion);
        free.push(in_words(motion, (middle, size)));
    }
    free
}

/// A combination of rigid motions about the middle of a body of this size.
fn in_words(motion: [f64; 6], (middle, size): ([f64; 3], f64)) -> FreeMotion {
    let [along, turn] = [0, 3].map(|first| [0, 1, 2].map(|d| motion[first + d]));
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    // What rounding leaves is nothing, and the greatest component of a direction is positive.
    let clean = |x: f64| if x.abs() < NEGLIGIBLE { 0.0 } else { x };
    let unit = |v: [f64; 3]| {
        let most = v.into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let whole = length(v).copysign(most.unwrap_or(1.0));
        v.map(|x| clean(x / whole))
    };
    let whole = length(turn);
    if whole < 1e-6 {
        return FreeMotion::Translation(unit(along));
    }
    // The points that stay: turn x along / turn^2 from the middle.
    let from = cross(turn, along).map(|x| x / (whole * whole));
    FreeMotion::Rotation {
        axis: unit(turn),
        through: std::array::from_fn(|d| size * clean(middle[d] / size + from[d])),
    }
}

/// True if a motion of a rigid body is one by force: nothing holds it.
fn free_of_force(problem: &Problem, motion: Motion) -> bool {
    match motion {
        Motion::Driven(parameter, _) => matches!(
            problem.rules().get(parameter.0),
            Some(Rule::Prescribes(Quantity::Force(_)))
        ),
        Motion::Fixed => false,
    }
}

/// Displacement of a place in a rigid motion of unit size.
fn moved(motion: usize, x: [f64; 3]) -> [f64; 3] {
    match motion {
        3 => [0.0, -x[2], x[1]],
        4 => [x[2], 0.0, -x[0]],
        5 => [-x[1], x[0], 0.0],
        translation => std::array::from_fn(|d| f64::from(u8::from(d == translation))),
    }
}

/// Middle and half of the longest side of the box round a body.
fn extent(mesh: &Mesh) -> ([f64; 3], f64) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in &mesh.points {
        for d in 0..3 {
            low[d] = low[d].min(point[d]);
            high[d] = high[d].max(point[d]);
        }
    }
    let size = (0..3).fold(0.0, |most: f64, d| most.max(0.5 * (high[d] - low[d])));
    let middle = std::array::from_fn(|d| f64::midpoint(low[d], high[d]));
    (middle, if size > 0.0 { size } else { 1.0 })
}

/// Adds what a row has beyond the others, orthogonal to them.
fn reduce(rows: &mut Vec<[f64; 6]>, mut row: [f64; 6]) {
    let dot = |a: &[f64; 6], b: &[f64; 6]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    // Twice, for what rounding leaves.
    for _ in 0..2 {
        for known in rows.iter() {
            let share = dot(known, &row);
            for (x, known) in row.iter_mut().zip(known) {
                *x -= share * known;
            }
        }
    }
    let length = dot(&row, &row).sqrt();
    if length > NEGLIGIBLE {
        rows.push(row.map(|x| x / length));
    }
}

/// A combination of these motions that is orthogonal to all rows, translations first.
fn null_vector(rows: &[[f64; 6]], motions: &[usize]) -> Option<[f64; 6]> {
    motions.iter().find_map(|&motion| {
        let mut left = rows.to_vec();
        let mut unit = [0.0; 6];
        unit[motion] = 1.0;
        reduce(&mut left, unit);
        // What is left of the unit vector is free.
        (left.len() > rows.len()).then(|| left[rows.len()])
    })
}
