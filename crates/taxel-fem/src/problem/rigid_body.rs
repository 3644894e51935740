//! Rigid bodies: nodes that move together, at any rotation.

use taxel_numerics::dense::cross;

use super::{Kinematics, Motion, Parameter, Problem, ProblemError, Quantity, Rule};

/// Nodes that keep their distances: a stiff plate on a face, or a stiff part inside the body.
///
/// A node at `X` goes to `point + travel + R (X - point)`, `R` the rotation by the vector `turn`
/// (its length is the angle in rad, its direction the axis). Each of the six is fixed, or driven
/// by a parameter; one that is free is driven by a parameter of its own
/// ([`Problem::free_parameter`]), on which no force works, or the force or torque of its target.
///
/// In the plane only `travel[0]`, `travel[1]` and `turn[2]` are used, in axisymmetry only
/// `travel[1]`: the others stay fixed.
///
/// A rotation about one axis may be of any angle. Where more than one component of `turn` is
/// driven or free, the angle has to stay below a whole turn; the force along a component of the
/// vector is then not exactly the torque about that axis, which [`RigidBody::torque`] gives.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidBody {
    /// Its nodes.
    pub nodes: Vec<u32>,
    /// The point about which it turns, undeformed, m.
    pub point: [f64; 3],
    /// Displacement of the point.
    pub travel: [Motion; 3],
    /// Rotation vector, rad.
    pub turn: [Motion; 3],
}

/// Motion of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion {
    /// Displacement of its point, m.
    pub travel: [f64; 3],
    /// Rotation vector, rad.
    pub turn: [f64; 3],
}

impl RigidBody {
    /// Some nodes that turn about a point; nothing moves them yet.
    pub fn new(nodes: Vec<u32>, point: [f64; 3]) -> Self {
        Self {
            nodes,
            point,
            travel: [Motion::Fixed; 3],
            turn: [Motion::Fixed; 3],
        }
    }

    /// The six motions: the displacement of the point, then the rotation vector.
    pub fn motions(&self) -> impl Iterator<Item = Motion> {
        self.travel.into_iter().chain(self.turn)
    }

    /// Its motion at these values of the parameters.
    pub fn motion(&self, parameters: &[f64]) -> RigidMotion {
        let value = |motion: Motion| match motion {
            Motion::Fixed => 0.0,
            Motion::Driven(Parameter(number), factor) => factor * parameters[number],
        };
        RigidMotion {
            travel: self.travel.map(value),
            turn: self.turn.map(value),
        }
    }

    /// Sum of the forces on its nodes, N (N/m in plane strain): what has to act on it from
    /// outside. `force` is that of a node, as in [`crate::assembly::system::Assembled::forces`].
    pub fn force(&self, force: impl Fn(u32) -> [f64; 3]) -> [f64; 3] {
        let each = self.nodes.iter().map(|&node| force(node));
        each.fold([0.0; 3], |sum, f| std::array::from_fn(|d| sum[d] + f[d]))
    }

    /// Their torque about the present place of its point, N m (N in plane strain); `place` is the
    /// present place of a node, `motion` that of the body.
    pub fn torque(
        &self,
        motion: &RigidMotion,
        place: impl Fn(u32) -> [f64; 3],
        force: impl Fn(u32) -> [f64; 3],
    ) -> [f64; 3] {
        let each = self.nodes.iter().map(|&node| {
            let x = place(node);
            let arm = std::array::from_fn(|d| x[d] - self.point[d] - motion.travel[d]);
            cross(arm, force(node))
        });
        each.fold([0.0; 3], |sum, t| std::array::from_fn(|d| sum[d] + t[d]))
    }

    /// True if a support that fixes this component of its nodes says what the body does anyway:
    /// its point does not move along that axis, and it turns about no other.
    pub(super) fn keeps(&self, component: usize) -> bool {
        let fixed = |motion: &Motion| matches!(motion, Motion::Fixed | Motion::Driven(_, 0.0));
        fixed(&self.travel[component])
            && (0..3).all(|axis| axis == component || fixed(&self.turn[axis]))
    }
}

impl Kinematics {
    /// Which of the displacement of the point and of the rotation vector a rigid body has here.
    pub const fn rigid_motions(self) -> &'static [usize] {
        match self {
            Self::PlaneStrain => &[0, 1, 5],
            Self::Axisymmetric => &[1],
            Self::Solid => &[0, 1, 2, 3, 4, 5],
        }
    }
}

impl Problem {
    /// Adds a parameter on which nothing works: what it drives is free. Its target is the force
    /// along it, N (the torque of a rotation, N m), zero for none.
    pub fn free_parameter(&mut self, name: &str) -> Parameter {
        let parameter = self.parameter(name, Rule::Given);
        self.set_rule(parameter, Rule::Prescribes(Quantity::Force(parameter)));
        parameter
    }

    /// A rigid body of the nodes of a surface, a node set or a region, not yet part of the
    /// problem: set its motions, and push it to [`Problem::rigid_bodies`]. It turns about
    /// `point`, or about the mean of its nodes.
    ///
    /// # Errors
    /// When the mesh has no such name.
    pub fn rigid_body(
        &self,
        name: &str,
        point: Option<[f64; 3]>,
    ) -> Result<RigidBody, ProblemError> {
        let nodes = match self.mesh.nodes_of(name) {
            Some(nodes) => nodes,
            None => self.nodes_of_region(name)?,
        };
        let count = nodes.len().max(1) as f64;
        let mean = nodes.iter().fold([0.0; 3], |sum: [f64; 3], &node| {
            let x = self.mesh.points[node as usize];
            std::array::from_fn(|d| sum[d] + x[d] / count)
        });
        Ok(RigidBody::new(nodes, point.unwrap_or(mean)))
    }

    fn nodes_of_region(&self, name: &str) -> Result<Vec<u32>, ProblemError> {
        let mesh = &self.mesh;
        let Some(region) = mesh.regions.iter().position(|known| known == name) else {
            return Err(self.unknown_surface(name));
        };
        let cells = (0..mesh.cell_count()).filter(|&cell| mesh.region_of(cell) == region);
        let mut nodes: Vec<u32> = cells.flat_map(|cell| mesh.cell(cell)).copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        Ok(nodes)
    }
}

/// Displacement of the end of an arm that turns, with its derivatives by the rotation vector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turned {
    pub(crate) moved: [f64; 3],
    pub(crate) slopes: [[f64; 3]; 3],
    pub(crate) bends: [[[f64; 3]; 3]; 3],
}

/// `(R - 1) r = a v x r + b v x (v x r)` with `a = sin(p)/p` and `b = (1 - cos(p))/p^2`, `p` the
/// length of `v` (Rodrigues).
pub(crate) fn turned(vector: [f64; 3], arm: [f64; 3]) -> Turned {
    let unit = |k: usize| -> [f64; 3] { std::array::from_fn(|d| f64::from(u8::from(d == k))) };
    let add = |parts: &[(f64, [f64; 3])]| -> [f64; 3] {
        std::array::from_fn(|d| parts.iter().map(|(factor, v)| factor * v[d]).sum())
    };
    let v = vector;
    let [a, b] = factors(v.iter().map(|x| x * x).sum());
    let once = cross(v, arm);
    let twice = cross(v, once);
    // Derivatives of once and twice.
    let once_by: [[f64; 3]; 3] = std::array::from_fn(|k| cross(unit(k), arm));
    let twice_by: [[f64; 3]; 3] =
        std::array::from_fn(|k| add(&[(1.0, cross(unit(k), once)), (1.0, cross(v, once_by[k]))]));
    Turned {
        moved: add(&[(a[0], once), (b[0], twice)]),
        slopes: std::array::from_fn(|k| {
            add(&[
                (2.0 * v[k] * a[1], once),
                (a[0], once_by[k]),
                (2.0 * v[k] * b[1], twice),
                (b[0], twice_by[k]),
            ])
        }),
        bends: std::array::from_fn(|k| {
            std::array::from_fn(|l| {
                let second =
                    |f: [f64; 3]| 4.0 * v[k] * v[l] * f[2] + if k == l { 2.0 * f[1] } else { 0.0 };
                add(&[
                    (second(a), once),
                    (2.0 * v[k] * a[1], once_by[l]),
                    (2.0 * v[l] * a[1], once_by[k]),
                    (second(b), twice),
                    (2.0 * v[k] * b[1], twice_by[l]),
                    (2.0 * v[l] * b[1], twice_by[k]),
                    (b[0], cross(unit(k), once_by[l])),
                    (b[0], cross(unit(l), once_by[k])),
                ])
            })
        }),
    }
}

/// `sin(p)/p` and `(1 - cos(p))/p^2` with their first two derivatives by `s = p^2`.
fn factors(s: f64) -> [[f64; 3]; 2] {
    if s < 1.0 {
        // Their series; what is left out is below 1e-18.
        return [1.0, 2.0].map(|first| {
            let mut sums = [0.0; 3];
            // 1/(2n + first)! with its sign.
            let mut term = 1.0 / first;
            let mut powers = [1.0, 0.0, 0.0];
            for n in 0..10 {
                let n = f64::from(n);
                for (sum, power) in sums.iter_mut().zip(powers) {
                    *sum += term * power;
                }
                term /= -(2.0 * n + first + 1.0) * (2.0 * n + first + 2.0);
                powers = [
                    powers[0] * s,
                    powers[1] * s + powers[0],
                    powers[2] * s + 2.0 * powers[1],
                ];
            }
            sums
        });
    }
    let p = s.sqrt();
    let (sin, cos) = (libm::sin(p), libm::cos(p));
    [
        [
            sin / p,
            (p * cos - sin) / (2.0 * p * s),
            ((3.0 - s) * sin - 3.0 * p * cos) / (4.0 * s * s * p),
        ],
        [
            (1.0 - cos) / s,
            (p * sin - 2.0 * (1.0 - cos)) / (2.0 * s * s),
            (s * cos - 5.0 * p * sin + 8.0 * (1.0 - cos)) / (4.0 * s * s * s),
        ],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_keeps_lengths_and_its_derivatives_are_those_of_its_displacement() {
        let arm = [0.4, -0.7, 0.9];
        // Small, beside the end of the series, beyond a half turn, beyond a whole one.
        let vectors = [
            [1e-9, 0.0, -1e-9],
            [0.3, 0.5, 0.8],
            [0.31, 0.51, 0.81],
            [2.0, -1.5, 2.2],
            [0.0, 0.0, 7.0],
        ];
        for vector in vectors {
            let found = turned(vector, arm);
            let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
            let end = std::array::from_fn(|d| arm[d] + found.moved[d]);
            assert!((length(end) / length(arm) - 1.0).abs() < 1e-14);
            for l in 0..3 {
                let at = |step: f64| {
                    let mut near = vector;
                    near[l] += step;
                    turned(near, arm)
                };
                let (up, down) = (at(1e-5), at(-1e-5));
                for d in 0..3 {
                    let slope = (up.moved[d] - down.moved[d]) / 2e-5;
                    assert!((slope - found.slopes[l][d]).abs() < 1e-9, "{vector:?}");
                    for k in 0..3 {
                        let bend = (up.slopes[k][d] - down.slopes[k][d]) / 2e-5;
                        assert!((bend - found.bends[k][l][d]).abs() < 1e-9, "{vector:?}");
                    }
                }
            }
        }
        // A quarter turn about z.
        let quarter = turned([0.0, 0.0, std::f64::consts::FRAC_PI_2], [1.0, 0.0, 0.0]);
        assert!((quarter.moved[0] + 1.0).abs() < 1e-15);
        assert!((quarter.moved[1] - 1.0).abs() < 1e-15);
    }
}
