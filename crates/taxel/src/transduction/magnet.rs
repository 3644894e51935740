//! Field of a permanent magnet that is magnetised evenly along its own z, exactly, with its
//! slopes by the position and the tilt of the magnet.
//!
//! Outside of a magnet its field has neither curl nor divergence, so that the nine derivatives by
//! the position are five numbers.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::quantity::{self, Checked, PositiveLength};
use taxel_numerics::dense::cross;
use taxel_numerics::special::{cel, complete_elliptic_k, complete_elliptic_remainder};

/// The vacuum permeability, N/A² (CODATA 2022).
pub const VACUUM_PERMEABILITY: f64 = 1.256_637_061_27e-6;

/// Shape of a magnet.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MagnetShape {
    /// A disc or rod that is magnetised along its axis.
    Cylinder(CylinderMagnet),
    /// A block that is magnetised along z.
    Cuboid(CuboidMagnet),
    /// A ball, whose field is exactly that of a dipole.
    Sphere(SphereMagnet),
}

/// A cylindrical magnet.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderMagnet {
    /// Diameter, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub diameter: f64,
    /// Length along its axis, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub height: f64,
}

/// A magnet with rectangular faces.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CuboidMagnet {
    /// Sides along x, y and z, m.
    #[serde(deserialize_with = "quantity::list::<3, PositiveLength, _>")]
    #[schemars(with = "[Checked<PositiveLength>; 3]")]
    pub sides: [f64; 3],
}

/// A magnet that is a ball.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereMagnet {
    /// Diameter, m.
    #[serde(deserialize_with = "quantity::one::<PositiveLength, _>")]
    #[schemars(with = "Checked<PositiveLength>")]
    pub diameter: f64,
}

/// Where a magnet is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagnetPose {
    /// Its middle, m.
    pub position: [f64; 3],
    /// The rotation vector in the plane, along x and y, that turns its axis from z, rad.
    pub tilt: [f64; 2],
}

/// A field and its slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagnetField {
    /// Along x, y and z, T.
    pub field: [f64; 3],
    /// Of each component by the position of the magnet along x, y and z, T/m, and by its tilt about
    /// x and y, T/rad.
    pub by_pose: [[f64; 5]; 3],
}

/// A field and its gradient in the frame of the magnet, over its remanence.
struct Local {
    field: [f64; 3],
    /// Symmetric, 1/m.
    gradient: [[f64; 3]; 3],
}

/// A distance, m, below which a point on the line of an edge counts as beside it: its square is
/// still a number.
const ON_AN_EDGE: f64 = 1e-150;

impl MagnetShape {
    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        match self {
            Self::Cylinder(of) => 0.25 * PI * of.diameter.powi(2) * of.height,
            Self::Cuboid(of) => of.sides.iter().product(),
            Self::Sphere(of) => PI / 6.0 * of.diameter.powi(3),
        }
    }

    /// Width along x and height along z, m.
    pub fn outline(&self) -> [f64; 2] {
        match self {
            Self::Cylinder(of) => [of.diameter, of.height],
            Self::Cuboid(of) => [of.sides[0], of.sides[2]],
            Self::Sphere(of) => [of.diameter; 2],
        }
    }

    /// Field of a magnet of this shape and `remanence`, T, at a point, m.
    ///
    /// Exact: a cylinder is a solenoid, by elliptic integrals (Derby and Olbert 2010), a block two
    /// charged rectangles, a ball a dipole.
    ///
    /// # Example: one diameter above a disc of neodymium
    /// ```
    /// use taxel::transduction::{CylinderMagnet, MagnetPose, MagnetShape};
    /// let disc = MagnetShape::Cylinder(CylinderMagnet { diameter: 3e-3, height: 1e-3 });
    /// let pose = MagnetPose { position: [0.0; 3], tilt: [0.0; 2] };
    /// let [_, _, up] = disc.field(1.2, &pose, [0.0, 0.0, 3e-3]).field;
    /// // On its axis the field is remanence/2 (3.5/√(3.5² + 1.5²) − 2.5/√(2.5² + 1.5²)), lengths in mm.
    /// let expected = 0.6 * (3.5 / 14.5_f64.sqrt() - 2.5 / 8.5_f64.sqrt());
    /// assert!((up - expected).abs() < 1e-12); // 0.0370 T
    /// ```
    pub fn field(&self, remanence: f64, pose: &MagnetPose, point: [f64; 3]) -> MagnetField {
        let (turn, by_tilt) = rotation(pose.tilt);
        let from: [f64; 3] = std::array::from_fn(|axis| point[axis] - pose.position[axis]);
        let local = match self {
            Self::Cylinder(of) => cylinder(0.5 * of.diameter, 0.5 * of.height, back(&turn, from)),
            Self::Cuboid(of) => cuboid(of.sides.map(|side| 0.5 * side), back(&turn, from)),
            Self::Sphere(of) => sphere(0.5 * of.diameter, back(&turn, from)),
        };
        let field = times(&turn, local.field).map(|b| remanence * b);
        // R G Rᵀ, whose rows are its columns.
        let rows = local.gradient.map(|row| times(&turn, row));
        let gradient: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                remanence * (0..3).map(|k| turn[i][k] * rows[k][j]).sum::<f64>()
            })
        });
        let mut by_pose = [[0.0; 5]; 3];
        for (row, slopes) in by_pose.iter_mut().zip(&gradient) {
            for (slope, by_point) in row.iter_mut().zip(slopes) {
                *slope = -by_point;
            }
        }
        for (tilt, axis) in by_tilt.into_iter().enumerate() {
            // The field turns with the magnet, and the point goes the other way in its frame.
            let turned = cross(axis, field);
            let moved = times(&gradient, cross(axis, from));
            for (component, row) in by_pose.iter_mut().enumerate() {
                row[3 + tilt] = turned[component] - moved[component];
            }
        }
        MagnetField { field, by_pose }
    }
}

fn times(matrix: &[[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

fn back(matrix: &[[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|j| (0..3).map(|i| matrix[i][j] * vector[i]).sum())
}

/// The rotation by a vector in the plane, and the axes about which it goes on turning as that
/// vector grows along x and along y.
fn rotation([x, y]: [f64; 2]) -> ([[f64; 3]; 3], [[f64; 3]; 2]) {
    let angle = x.hypot(y);
    // sin θ/θ, (1 − cos θ)/θ² and (θ − sin θ)/θ³; below 0.01 two terms of their series are exact.
    let square = angle * angle;
    let (first, second, third) = if angle < 1e-2 {
        (
            1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)),
            0.5 - square / 24.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)),
            1.0 / 6.0 - square / 120.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)),
        )
    } else {
        (
            angle.sin() / angle,
            (1.0 - angle.cos()) / square,
            (angle - angle.sin()) / (square * angle),
        )
    };
    let by = |linear: f64, quadratic: f64| {
        // I + linear [t]× + quadratic [t]×²
        [
            [1.0 - quadratic * y * y, quadratic * x * y, linear * y],
            [quadratic * x * y, 1.0 - quadratic * x * x, -linear * x],
            [-linear * y, linear * x, 1.0 - quadratic * square],
        ]
    };
    let left = by(second, third);
    (
        by(first, second),
        [0, 1].map(|axis: usize| [left[0][axis], left[1][axis], left[2][axis]]),
    )
}

/// A cylinder of radius `a` and half height `b`: the solenoid whose surface current is the
/// magnetisation. Its slope along the axis is the difference of the loops at its ends.
fn cylinder(a: f64, b: f64, [x, y, z]: [f64; 3]) -> Local {
    let rho = x.hypot(y);
    let mut along = 0.0;
    // Across, over ρ.
    let mut across = 0.0;
    let [mut slope_along, mut slope_across] = [0.0; 2];
    let gamma = (a - rho) / (a + rho);
    for (sign, height) in [(1.0, z + b), (-1.0, z - b)] {
        let far = (a + rho).powi(2) + height * height;
        let near = (a - rho).powi(2) + height * height;
        let kc = (near / far).sqrt();
        let [k, rest] = complete_elliptic_remainder(kc);
        let m_over_rho = 4.0 * a / far;
        let m = m_over_rho * rho;
        let root = far.sqrt();
        // cel(kc, 1, 1, −1) = −2 K rest m, without its cancellation near the axis.
        across -= sign * a / (PI * root) * 2.0 * k * rest * m_over_rho;
        let third = if gamma * gamma > 0.0 {
            cel(kc, gamma * gamma, 1.0, gamma)
        } else {
            // On the shell of the solenoid, the mean of both sides.
            complete_elliptic_k(kc)
        };
        along += sign * a / (PI * (a + rho)) * height / root * third;
        let e = k * (1.0 - 0.5 * m - m * m * rest);
        let loop_along = k + (a * a - rho * rho - height * height) / near * e;
        slope_along += sign * loop_along / (2.0 * PI * root);
        // (a² + ρ² + ζ²)/near E − K = K m² (1/2 − (2 − m) rest)/(2 kc²)
        let loop_across = k * m * (0.5 - (2.0 - m) * rest) / (2.0 * kc * kc);
        slope_across += sign * height / (2.0 * PI * root) * loop_across * m_over_rho;
    }
    let [ex, ey] = if rho > 0.0 {
        [x / rho, y / rho]
    } else {
        [1.0, 0.0]
    };
    // ∂Bρ/∂ρ − Bρ/ρ, from the divergence.
    let stretch = -2.0 * across - slope_along;
    let xy = stretch * ex * ey;
    let [xz, yz] = [slope_across * ex, slope_across * ey];
    Local {
        field: [across * x, across * y, along],
        gradient: [
            [across + stretch * ex * ex, xy, xz],
            [xy, across + stretch * ey * ey, yz],
            [xz, yz, slope_along],
        ],
    }
}

/// A block of these half sides: charges on its upper and lower face.
fn cuboid(half: [f64; 3], point: [f64; 3]) -> Local {
    let mut field = [0.0; 3];
    let mut gradient = [[0.0; 3]; 3];
    let squared = |a: f64, b: f64| (a * a + b * b).max(ON_AN_EDGE * ON_AN_EDGE);
    for corner in 0..8 {
        let sign = |axis: usize| if corner >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| point[axis] + sign(axis) * half[axis]);
        // The upper face, z − c, has the positive charge.
        let weight = -sign(0) * sign(1) * sign(2) / (4.0 * PI);
        let r = (x * x + y * y + z * z).sqrt().max(ON_AN_EDGE);
        let [beside_x, beside_y] = [squared(y, z), squared(x, z)];
        field[0] -= weight * (y / beside_y.sqrt()).asinh();
        field[1] -= weight * (x / beside_x.sqrt()).asinh();
        field[2] += weight * z.signum() * (x * y).atan2(z.abs() * r);
        let [xx, yy] = [x * y / (r * beside_y), x * y / (r * beside_x)];
        let [xz, yz] = [y * z / (r * beside_y), x * z / (r * beside_x)];
        let here = [[xx, -1.0 / r, xz], [-1.0 / r, yy, yz], [xz, yz, -xx - yy]];
        for (row, of_corner) in gradient.iter_mut().zip(here) {
            for (slope, part) in row.iter_mut().zip(of_corner) {
                *slope += weight * part;
            }
        }
    }
    if point.iter().zip(half).all(|(at, half)| at.abs() < half) {
        field[2] += 1.0;
    }
    Local { field, gradient }
}

/// A ball of this radius: a dipole outside, an even field inside.
fn sphere(radius: f64, point: [f64; 3]) -> Local {
    let r = point.iter().map(|x| x * x).sum::<f64>().sqrt();
    if r < radius {
        return Local {
            field: [0.0, 0.0, 2.0 / 3.0],
            gradient: [[0.0; 3]; 3],
        };
    }
    let unit = point.map(|x| x / r);
    let scale = (radius / r).powi(3) / 3.0;
    let up = |axis: usize| f64::from(u8::from(axis == 2));
    let same = |i: usize, j: usize| f64::from(u8::from(i == j));
    let n = unit[2];
    Local {
        field: std::array::from_fn(|j| scale * (3.0 * n * unit[j] - up(j))),
        gradient: std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let bend = up(i) * unit[j] + up(j) * unit[i] + n * same(i, j);
                3.0 * scale / r * (bend - 5.0 * n * unit[i] * unit[j])
            })
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [MagnetShape; 3] = [
        MagnetShape::Cylinder(CylinderMagnet {
            diameter: 3e-3,
            height: 1e-3,
        }),
        MagnetShape::Cuboid(CuboidMagnet {
            sides: [3e-3, 2e-3, 1e-3],
        }),
        MagnetShape::Sphere(SphereMagnet { diameter: 3e-3 }),
    ];

    #[test]
    fn slopes_by_the_pose_are_those_of_differences() {
        let points = [
            [2e-3, -1e-3, -4e-3],
            [0.0, 0.0, 3e-3],
            [1e-9, 0.0, -3e-3],
            [1.5e-3, 0.0, -2e-3],
            [4e-3, 4e-3, 0.0],
        ];
        for shape in SHAPES {
            for tilt in [[0.0; 2], [1e-3, -2e-3], [0.2, -0.5]] {
                for point in points {
                    let pose = [1e-4, -2e-4, 3e-4, tilt[0], tilt[1]];
                    let at = |pose: [f64; 5]| {
                        let pose = MagnetPose {
                            position: [pose[0], pose[1], pose[2]],
                            tilt: [pose[3], pose[4]],
                        };
                        shape.field(1.2, &pose, point)
                    };
                    let found = at(pose);
                    for by in 0..5 {
                        // Central differences: h² of the third derivative, about 1e-8 of a slope at a
                        // thousandth of the distance, plus rounding of 1e-16/1e-4.
                        let (step, size) = if by < 3 { (1e-7, 1e-3) } else { (1e-4, 1.0) };
                        let [low, high] = [-step, step].map(|step| {
                            let mut moved = pose;
                            moved[by] += step;
                            at(moved).field
                        });
                        for axis in 0..3 {
                            let slope = (high[axis] - low[axis]) / (2.0 * step);
                            let off = (slope - found.by_pose[axis][by]).abs() * size;
                            let scale = found.field.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
                            assert!(
                                off < 1e-6 * scale,
                                "{shape:?} {point:?} {by} {axis}: {off:e}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn far_away_every_magnet_is_the_dipole_of_its_moment() {
        // A point so far that the next pole is (3/500)² = 4e-5 of the dipole.
        let point = [0.2, -0.3, 0.35];
        let pose = MagnetPose {
            position: [0.0; 3],
            tilt: [0.1, 0.3],
        };
        for shape in SHAPES {
            let diameter = (6.0 * shape.volume() / PI).cbrt();
            let ball = MagnetShape::Sphere(SphereMagnet { diameter });
            let [found, dipole] = [shape, ball].map(|shape| shape.field(1.2, &pose, point).field);
            for (found, dipole) in found.into_iter().zip(dipole) {
                assert!(
                    (found / dipole - 1.0).abs() < 1e-4,
                    "{shape:?}: {found} {dipole}"
                );
            }
        }
    }

    #[test]
    fn the_field_goes_on_through_the_axis_the_shell_and_the_lines_of_the_edges() {
        let pose = MagnetPose {
            position: [0.0; 3],
            tilt: [0.0; 2],
        };
        for shape in SHAPES {
            for point in [
                [0.0, 0.0, 2e-3],
                [1.5e-3, 0.0, 2e-3],
                [1.5e-3, 3e-3, 0.5e-3],
            ] {
                let [here, beside] = [0.0, 1e-12]
                    .map(|off| shape.field(1.0, &pose, [point[0] + off, point[1], point[2]]));
                for (here, beside) in here.field.iter().zip(beside.field) {
                    // A slope of at most 1000 T/m over 1 pm.
                    assert!((here - beside).abs() < 1e-9, "{shape:?} {point:?}");
                }
                let slopes = here
                    .by_pose
                    .into_iter()
                    .flatten()
                    .zip(beside.by_pose.into_iter().flatten());
                for (here, beside) in slopes {
                    // ... and 1e6 T/m² of a slope, with the rounding of small differences.
                    assert!((here - beside).abs() < 1e-4, "{shape:?} {point:?}");
                }
            }
        }
    }
}
