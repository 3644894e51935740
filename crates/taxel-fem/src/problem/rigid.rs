//! Rigid motions of a body that its supports do not hold.

use super::load::cross;
use super::{Motion, Problem, Quantity, Rule};
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

/// Turns of less than this share of a motion are none.
const UNTURNED: f64 = 1e-6;

impl FreeMotion {
    /// The motion of these shares of the rigid motions, about the middle of a body in units of its
    /// size.
    fn of(shares: [f64; 6], (middle, size): ([f64; 3], f64)) -> Self {
        let [x, y, z, turn @ ..] = shares;
        let along = [x, y, z];
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let whole = length(turn);
        if whole <= UNTURNED * length(along) {
            return Self::Translation(along.map(|x| x / length(along)));
        }
        // The points that stay: turn x along / turn^2 from the middle.
        let axis = turn.map(|x| x / whole);
        let from = cross(axis, along.map(|x| x / whole));
        let through = std::array::from_fn(|d| middle[d] + size * from[d]);
        Self::Rotation { axis, through }
    }
}

impl std::fmt::Display for FreeMotion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let vector = |v: &[f64; 3]| format!("({:.3e}, {:.3e}, {:.3e})", v[0], v[1], v[2]);
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
                    None => write!(f, "translation along {}", vector(along)),
                }
            }
            Self::Rotation { axis, through } => {
                write!(
                    f,
                    "rotation about {} through {}",
                    vector(axis),
                    vector(through)
                )
            }
        }
    }
}

/// Share of a whole motion below which a support does not feel it.
const NEGLIGIBLE: f64 = 1e-9;

/// Share of a motion up to which it is not told: that of a part which strains it, and that of one
/// rigid motion beside another.
const UNTOLD: f64 = 0.1;

/// A part slides on others if none of their nodes moves more than so many times as far as its own
/// on the mean.
const FARTHEST: f64 = 3.0;

/// A part of the body that its supports leave free to move.
#[derive(Clone, Debug, PartialEq)]
pub struct FreePart {
    /// A rigid motion that moves no held or driven component of it.
    pub motion: FreeMotion,
    /// Region of the part and undeformed place of one of its nodes, if the body has several parts
    /// that share no node.
    pub region: Option<Box<(String, [f64; 3])>>,
}

impl std::fmt::Display for FreePart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.region.as_deref() {
            Some((region, [x, y, z])) => write!(
                f,
                "the part {region:?} of the body near ({x:.6e}, {y:.6e}, {z:.6e}), which shares no node with the rest, against {}",
                self.motion
            ),
            None => write!(f, "the body against {}", self.motion),
        }
    }
}

/// The part of each node: nodes of one cell, of one rigid body and of one constraint are of one
/// part. Nodes of no cell have none.
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
    (0..mesh.points.len() as u32)
        .map(|node| used[node as usize].then(|| parts.root(node)))
        .collect()
}

/// The first part of a body that its supports do not hold; none where all are held.
pub(crate) fn free_part(problem: &Problem) -> Option<FreePart> {
    first_part(problem, &|of| free_motion(problem, of))
}

/// The first part that its supports do not hold and that these displacements of all nodes move as
/// if it were rigid, with that motion.
pub(crate) fn rigid_part(problem: &Problem, moved: &[[f64; 3]]) -> Option<FreePart> {
    first_part(problem, &|of| {
        free_motion(problem, of).and_then(|_| rigid_motion(problem, moved, of))
    })
}

/// The first part of a body that has a motion.
fn first_part(
    problem: &Problem,
    motion_of: &dyn Fn(&dyn Fn(u32) -> bool) -> Option<FreeMotion>,
) -> Option<FreePart> {
    let parts = parts(problem);
    let mut roots: Vec<u32> = parts.iter().copied().flatten().collect();
    roots.sort_unstable();
    roots.dedup();
    roots.iter().find_map(|&part| {
        let of = |node: u32| parts[node as usize] == Some(part);
        let motion = motion_of(&of)?;
        let mesh = &problem.mesh;
        let mut cells = 0..mesh.cell_count();
        let cell = cells.find(|&cell| of(mesh.cell(cell)[0]))?;
        let region = (roots.len() > 1).then(|| {
            let place = mesh.points[mesh.cell(cell)[0] as usize];
            Box::new((mesh.regions[mesh.region_of(cell)].clone(), place))
        });
        Some(FreePart { motion, region })
    })
}

/// A rigid motion that moves no held or driven component of a node of a part; none where all are
/// held.
fn free_motion(problem: &Problem, of_part: &dyn Fn(u32) -> bool) -> Option<FreeMotion> {
    let mesh = &problem.mesh;
    let (middle, size) = extent(mesh);
    let motions = problem.kinematics.rigid_motions();
    // Rows of a triangle: a motion that all of them leave out is free.
    let mut rows: Vec<[f64; 6]> = Vec::new();
    for support in &problem.supports {
        for &node in support.nodes.iter().filter(|&&node| of_part(node)) {
            let x: [f64; 3] =
                std::array::from_fn(|d| (mesh.points[node as usize][d] - middle[d]) / size);
            let mut row = [0.0; 6];
            for &motion in motions {
                row[motion] = moved(motion, x)[support.component];
            }
            reduce(&mut rows, row);
            if rows.len() == motions.len() {
                return None;
            }
        }
    }
    for body in &problem.rigid_bodies {
        let own = body.nodes.iter().filter(|&&node| of_part(node)).count();
        let x: [f64; 3] = std::array::from_fn(|d| (body.point[d] - middle[d]) / size);
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
        let at = |node: u32| {
            let x = mesh.points[node as usize];
            std::array::from_fn(|d| (x[d] - middle[d]) / size)
        };
        let mut row = [0.0; 6];
        for &motion in motions {
            let terms = constraint.terms.iter();
            let terms = terms.map(|&((node, i), factor)| factor * moved(motion, at(node))[i]);
            row[motion] = moved(motion, at(dependent))[component] - terms.sum::<f64>();
        }
        reduce(&mut rows, row);
    }
    Some(FreeMotion::of(null_vector(&rows, motions)?, (middle, size)))
}

/// The rigid motion that displacements give to the nodes of a part; none where they strain it, or
/// move others much farther.
fn rigid_motion(
    problem: &Problem,
    displacements: &[[f64; 3]],
    of_part: &dyn Fn(u32) -> bool,
) -> Option<FreeMotion> {
    let mesh = &problem.mesh;
    let (middle, size) = extent(mesh);
    let nodes: Vec<u32> = (0..mesh.points.len() as u32)
        .filter(|&n| of_part(n))
        .collect();
    let field = |of: &dyn Fn(usize) -> [f64; 3]| -> Vec<f64> {
        nodes.iter().flat_map(|&n| of(n as usize)).collect()
    };
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    // Motions of the nodes, orthonormal, each with its shares of the rigid motions.
    let mut motions: Vec<([f64; 6], Vec<f64>)> = Vec::new();
    for &motion in problem.kinematics.rigid_motions() {
        let place = |n: usize| std::array::from_fn(|d| (mesh.points[n][d] - middle[d]) / size);
        let (mut shares, mut own) = ([0.0; 6], field(&|n| moved(motion, place(n))));
        shares[motion] = 1.0;
        for (known_shares, known) in &motions {
            let share = dot(known, &own);
            shares = std::array::from_fn(|k| shares[k] - share * known_shares[k]);
            own.iter_mut()
                .zip(known)
                .for_each(|(x, known)| *x -= share * known);
        }
        let length = dot(&own, &own).sqrt();
        if length > NEGLIGIBLE {
            let own = own.into_iter().map(|x| x / length).collect();
            motions.push((shares.map(|x| x / length), own));
        }
    }
    let found = field(&|n| displacements[n]);
    let (mut rigid, mut shares) = (0.0, [0.0; 6]);
    for (own, motion) in &motions {
        let share = dot(motion, &found);
        rigid += share * share;
        shares = std::array::from_fn(|k| shares[k] + share * own[k]);
    }
    let whole = dot(&found, &found);
    let squares = displacements.iter().map(|u| dot(u, u));
    let farthest = squares.fold(0.0, f64::max);
    let strains = whole - rigid > UNTOLD * UNTOLD * whole;
    let small = whole * FARTHEST * FARTHEST < farthest * nodes.len() as f64;
    let greatest = shares
        .iter()
        .fold(0.0, |most: f64, share| most.max(share.abs()));
    let told = shares.map(|share| {
        if share.abs() < UNTOLD * greatest {
            0.0
        } else {
            share
        }
    });
    (whole > 0.0 && !strains && !small).then(|| FreeMotion::of(told, (middle, size)))
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
