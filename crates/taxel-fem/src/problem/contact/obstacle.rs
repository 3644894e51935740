//! Rigid obstacles of simple shape.

use taxel_numerics::dense::dot3;

use crate::mesh::Facet;
use crate::problem::Parameter;

/// A surface of the body that may not enter a rigid obstacle.
#[derive(Clone, Debug, PartialEq)]
pub struct Obstacle {
    /// Surface of the body.
    pub surface: Vec<Facet>,
    /// Shape of the obstacle.
    pub shape: Shape,
    /// Direction in which a parameter moves it, with that parameter (m).
    pub travel: Option<([f64; 3], Parameter)>,
    /// Contact stiffness, Pa/m.
    pub stiffness: f64,
    /// Coefficient of friction (Coulomb), zero without.
    pub friction: f64,
    /// Overlap that is accepted, m.
    pub overlap_limit: f64,
}

impl Obstacle {
    /// Its travel at these parameters of the problem, m.
    pub fn shift(&self, parameters: &[f64]) -> [f64; 3] {
        match self.travel {
            Some((direction, parameter)) => direction.map(|x| x * parameters[parameter.0]),
            None => [0.0; 3],
        }
    }
}

/// Shape of an obstacle, at the place where its travel is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// All that lies behind a plane; the normal points to the free side.
    HalfSpace {
        /// A point of the plane.
        point: [f64; 3],
        /// Unit normal.
        normal: [f64; 3],
    },
    /// A ball (a cylinder across the plane in two dimensions).
    Sphere {
        /// Centre.
        centre: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// A cylinder lying in space.
    Cylinder {
        /// A point of its axis.
        point: [f64; 3],
        /// Unit direction of its axis.
        axis: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// A flat punch with a rounded rim and a straight shaft above it, pointing along `-axis`
    /// (round in space and in axisymmetry, a rounded bar in plane strain).
    Punch {
        /// Middle of its face.
        point: [f64; 3],
        /// Unit direction from the face into the punch.
        axis: [f64; 3],
        /// Radius (half width) where the face is flat.
        flat: f64,
        /// Radius of the rim.
        rim: f64,
    },
}

/// Distance to an obstacle with its derivatives by the place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gap {
    /// Signed distance, m; negative inside.
    pub distance: f64,
    /// Gradient: the unit normal out of the obstacle.
    pub normal: [f64; 3],
    /// Second derivative, 1/m.
    pub curvature: [[f64; 3]; 3],
}

impl Shape {
    /// Distance of a place from the obstacle moved by `shift`.
    pub fn gap(&self, place: [f64; 3], shift: [f64; 3]) -> Gap {
        let x: [f64; 3] = std::array::from_fn(|d| place[d] - shift[d]);
        let minus = |point: [f64; 3]| -> [f64; 3] { std::array::from_fn(|d| x[d] - point[d]) };
        match *self {
            Self::HalfSpace { point, normal } => Gap {
                distance: dot3(minus(point), normal),
                normal,
                curvature: [[0.0; 3]; 3],
            },
            Self::Sphere { centre, radius } => from_centre(minus(centre), radius),
            Self::Cylinder {
                point,
                axis,
                radius,
            } => {
                let from = minus(point);
                let along = dot3(from, axis);
                let across = std::array::from_fn(|d| from[d] - along * axis[d]);
                let mut gap = from_centre(across, radius);
                let free = if dot3(across, across) > 0.0 {
                    let r = dot3(across, across).sqrt();
                    1.0 / r
                } else {
                    0.0
                };
                for i in 0..3 {
                    for j in 0..3 {
                        gap.curvature[i][j] -= axis[i] * axis[j] * free;
                    }
                }
                gap
            }
            Self::Punch {
                point,
                axis,
                flat,
                rim,
            } => punch(minus(point), axis, flat, rim),
        }
    }
}

/// Distance from a ball of this radius, `from` measured from its centre.
fn from_centre(from: [f64; 3], radius: f64) -> Gap {
    let r = dot3(from, from).sqrt();
    if r == 0.0 {
        // The centre itself: any way out is as long.
        return Gap {
            distance: -radius,
            normal: [0.0, -1.0, 0.0],
            curvature: [[0.0; 3]; 3],
        };
    }
    let normal = from.map(|x| x / r);
    Gap {
        distance: r - radius,
        normal,
        curvature: std::array::from_fn(|i| {
            std::array::from_fn(|j| (f64::from(u8::from(i == j)) - normal[i] * normal[j]) / r)
        }),
    }
}

/// Distance from a flat face of radius `flat` whose rim is a quarter circle, and from the shaft
/// above the rim.
fn punch(from: [f64; 3], axis: [f64; 3], flat: f64, rim: f64) -> Gap {
    let height = dot3(from, axis);
    let across: [f64; 3] = std::array::from_fn(|d| from[d] - height * axis[d]);
    let r = dot3(across, across).sqrt();
    if r <= flat {
        return Gap {
            distance: -height,
            normal: axis.map(|x| -x),
            curvature: [[0.0; 3]; 3],
        };
    }
    let radial = across.map(|x| x / r);
    if height > rim {
        let around = |i: usize, j: usize| {
            f64::from(u8::from(i == j)) - axis[i] * axis[j] - radial[i] * radial[j]
        };
        return Gap {
            distance: r - flat - rim,
            normal: radial,
            curvature: std::array::from_fn(|i| std::array::from_fn(|j| around(i, j) / r)),
        };
    }
    // Nearest point of the circle on which the centres of the rim lie.
    let to_rim: [f64; 3] = std::array::from_fn(|d| from[d] - axis[d] * rim - radial[d] * flat);
    let distance = dot3(to_rim, to_rim).sqrt();
    let mut gap = from_centre(to_rim, rim);
    if distance > 0.0 {
        // Turning about the axis the centre moves along its circle.
        let n = gap.normal;
        let around = [
            axis[1] * radial[2] - axis[2] * radial[1],
            axis[2] * radial[0] - axis[0] * radial[2],
            axis[0] * radial[1] - axis[1] * radial[0],
        ];
        let share = dot3(n, radial) / r - 1.0 / distance;
        for i in 0..3 {
            for j in 0..3 {
                gap.curvature[i][j] += around[i] * around[j] * share;
            }
        }
    }
    gap
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_and_curvature_are_the_derivatives_of_the_distance() {
        let unit = |v: [f64; 3]| v.map(|x| x / dot3(v, v).sqrt());
        let shapes = [
            Shape::HalfSpace {
                point: [0.1, 0.2, 0.0],
                normal: unit([0.3, 1.0, 0.2]),
            },
            Shape::Sphere {
                centre: [0.0, 2.0, 0.5],
                radius: 1.0,
            },
            Shape::Cylinder {
                point: [0.0, 2.0, 0.5],
                axis: unit([1.0, 0.1, 0.3]),
                radius: 1.0,
            },
            Shape::Punch {
                point: [0.0, 1.0, 0.0],
                axis: unit([0.0, 1.0, 0.1]),
                flat: 0.3,
                rim: 0.4,
            },
        ];
        for shape in shapes {
            for place in [
                [0.1, 0.5, 0.2],
                [0.6, 0.9, 0.3],
                [-0.9, 1.2, 0.1],
                [0.7, 1.9, -0.4],
            ] {
                let gap = shape.gap(place, [0.01, 0.02, 0.0]);
                for d in 0..3 {
                    let at = |step: f64| {
                        let mut moved = place;
                        moved[d] += step;
                        shape.gap(moved, [0.01, 0.02, 0.0])
                    };
                    let (up, down) = (at(1e-5), at(-1e-5));
                    let slope = (up.distance - down.distance) / 2e-5;
                    assert!((slope - gap.normal[d]).abs() < 1e-8, "{shape:?}");
                    for i in 0..3 {
                        let bend = (up.normal[i] - down.normal[i]) / 2e-5;
                        assert!((bend - gap.curvature[i][d]).abs() < 1e-7, "{shape:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_punch_has_a_shaft_above_its_rim() {
        let punch = Shape::Punch {
            point: [0.0; 3],
            axis: [0.0, 1.0, 0.0],
            flat: 0.3,
            rim: 0.1,
        };
        let gap = |x: f64, y: f64| punch.gap([x, y, 0.0], [0.0; 3]).distance;
        // Face, rim at 45 degrees, end of the rim, shaft.
        assert_eq!(gap(0.2, -0.1), 0.1);
        let diagonal = 0.2 / 2.0_f64.sqrt();
        assert!((gap(0.3 + diagonal, 0.1 - diagonal) - 0.1).abs() < 1e-15);
        assert!((gap(0.5, 0.1) - 0.1).abs() < 1e-15);
        for height in [0.1001, 0.2, 5.0] {
            assert!((gap(0.5, height) - 0.1).abs() < 1e-15, "{height}");
        }
    }
}
