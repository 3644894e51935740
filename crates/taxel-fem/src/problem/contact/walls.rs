//! Walls of one body that meet: opposite faces, and faces that fold onto each other
//! about the corner between them.

use std::collections::BTreeMap;

/// Pairs of points of the body that may not pass through each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Walls {
    /// The pairs, each at a quadrature point of one wall.
    pub points: Vec<WallPoint>,
    /// Contact stiffness of opposite walls, Pa/m.
    pub stiffness: f64,
    /// Overlap of opposite walls that is accepted, m.
    pub overlap_limit: f64,
}

/// Measure of the overlap of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pairing {
    /// Along a fixed direction, from the first wall to the second.
    Opposite([f64; 3]),
    /// Along a fixed direction, and bound to each other: neither overlap nor gap.
    Bound {
        /// The direction, from the first point to the second.
        along: [f64; 3],
        /// Distance along it before deformation, m.
        rest: f64,
    },
    /// About a corner: the angle `(t x d)/s` between the faces, `d` between points at equal
    /// distance `s` from the vertex (in space from the edge, at one place along it), `t` the mean
    /// of their tangents away from it.
    /// The energy is `1/2 k s angle^2` per length, `k` in Pa.
    Folding {
        /// Distance from the vertex along either face before deformation, m.
        arm: f64,
        /// +1 or -1, so that an open corner has a positive angle.
        turn: f64,
        /// Stiffness, Pa.
        stiffness: f64,
        /// Unit vectors across the edge, that of the undeformed body, in which the angle is measured;
        /// in two dimensions the axes.
        across: [[f64; 3]; 2],
    },
}

/// A pair of points: each node counts with a factor in the difference `d` of the two
/// points, and in the sum of their tangents (nothing where these don't matter).
#[derive(Clone, Debug, PartialEq)]
pub struct WallPoint {
    /// The nodes that move the pair.
    pub nodes: Vec<u32>,
    /// Factor of each node in the difference.
    pub difference: Vec<f64>,
    /// Factor of each node in the sum of the tangents.
    pub sum: Vec<f64>,
    /// Length (area) of the wall that the pair stands for.
    pub weight: f64,
    /// Measure of the overlap.
    pub pairing: Pairing,
}

/// Width over which the folding contact sets in, as an angle.
const SOFTENING: f64 = 0.02;

/// Energy of a pair with its derivatives by the difference and the sum.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PairEnergy {
    /// Gradient: difference, then sum.
    pub gradient: [f64; 6],
    /// Second derivative.
    pub curvature: [[f64; 6]; 6],
    /// Distance, m; negative when they overlap.
    pub gap: f64,
    /// Pressure, Pa.
    pub pressure: f64,
}

impl WallPoint {
    /// A pair of two points, each given by its nodes with their shape functions and
    /// the slopes of these along the wall.
    pub fn new(
        first: &[(u32, f64, f64)],
        second: &[(u32, f64, f64)],
        weight: f64,
        pairing: Pairing,
    ) -> Self {
        let mut factors = BTreeMap::<u32, (f64, f64)>::new();
        for (side, sign) in [(first, -1.0), (second, 1.0)] {
            for &(node, value, slope) in side {
                let entry = factors.entry(node).or_default();
                entry.0 += sign * value;
                entry.1 += slope;
            }
        }
        Self {
            nodes: factors.keys().copied().collect(),
            difference: factors.values().map(|f| f.0).collect(),
            sum: factors.values().map(|f| f.1).collect(),
            weight,
            pairing,
        }
    }

    /// Distance between the points of the pair, m; negative where they overlap.
    pub fn gap(&self, places: &[[f64; 3]]) -> f64 {
        self.energy(places, 0.0, 0.0).gap
    }

    /// True if the points of the pair are bound to each other.
    pub(crate) fn is_bound(&self) -> bool {
        matches!(self.pairing, Pairing::Bound { .. })
    }

    /// Difference and sum at these places of the nodes.
    pub(crate) fn vectors(&self, places: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
        let mut vectors = ([0.0; 3], [0.0; 3]);
        for (n, &node) in self.nodes.iter().enumerate() {
            let x = places[node as usize];
            for d in 0..3 {
                vectors.0[d] += self.difference[n] * x[d];
                vectors.1[d] += self.sum[n] * x[d];
            }
        }
        vectors
    }

    /// Energy of the pair, with `multiplier` for opposite walls (Pa).
    pub(crate) fn energy(
        &self,
        places: &[[f64; 3]],
        stiffness: f64,
        multiplier: f64,
    ) -> PairEnergy {
        let (d, m) = self.vectors(places);
        match self.pairing {
            Pairing::Opposite(direction)
            | Pairing::Bound {
                along: direction, ..
            } => {
                let rest = match self.pairing {
                    Pairing::Bound { rest, .. } => rest,
                    _ => 0.0,
                };
                let gap = d[0] * direction[0] + d[1] * direction[1] + d[2] * direction[2] - rest;
                let mut energy = PairEnergy {
                    gap,
                    ..PairEnergy::default()
                };
                let pressure = multiplier - stiffness * gap;
                if pressure > 0.0 || self.is_bound() {
                    energy.pressure = pressure;
                    for i in 0..3 {
                        energy.gradient[i] = -pressure * direction[i] * self.weight;
                        for j in 0..3 {
                            energy.curvature[i][j] =
                                stiffness * direction[i] * direction[j] * self.weight;
                        }
                    }
                }
                energy
            }
            Pairing::Folding {
                arm,
                turn,
                stiffness,
                across,
            } => {
                let plane = |v: [f64; 3]| across.map(|axis| (0..3).map(|i| v[i] * axis[i]).sum());
                let fold = self.fold(plane(d), plane(m), (arm, turn), stiffness);
                in_space(&fold, across)
            }
        }
    }

    /// Energy of a fold by the components of difference and sum across its edge, in the order of
    /// two dimensions.
    fn fold(
        &self,
        d: [f64; 2],
        m: [f64; 2],
        (arm, turn): (f64, f64),
        stiffness: f64,
    ) -> PairEnergy {
        let r = m[0].hypot(m[1]);
        let cross = m[0] * d[1] - m[1] * d[0];
        let angle = turn * cross / (r * arm);
        let mut energy = PairEnergy {
            gap: angle * arm,
            ..PairEnergy::default()
        };
        let (overlap, slope) = softened(-angle);
        if overlap <= 0.0 || r == 0.0 {
            return energy;
        }
        // First and second derivative of the angle by d (0, 1) and m (2, 3).
        let scale = turn / arm;
        let (n, t) = ([m[0] / r, m[1] / r], [d[1], -d[0]]);
        let first = [
            -n[1] * scale,
            n[0] * scale,
            (t[0] / r - cross * m[0] / r.powi(3)) * scale,
            (t[1] / r - cross * m[1] / r.powi(3)) * scale,
        ];
        let mut second = [[0.0; 4]; 4];
        for k in 0..2 {
            for l in 0..2 {
                let same = f64::from(u8::from(k == l));
                // d n_k / d m_l
                let bend = (same - n[k] * n[l]) / r;
                let (row, sign) = if k == 0 { (1, 1.0) } else { (0, -1.0) };
                second[row][2 + l] = sign * bend * scale;
                second[2 + l][row] = second[row][2 + l];
                second[2 + k][2 + l] = (-(t[k] * m[l] + m[k] * t[l]) / r.powi(3)
                    - cross * same / r.powi(3)
                    + 3.0 * cross * m[k] * m[l] / r.powi(5))
                    * scale;
            }
        }
        // Energy k s o^2 / 2 with o = softened(-angle).
        let factor = stiffness * arm * self.weight;
        let force = -factor * overlap * slope;
        let bend = factor * (slope * slope + overlap * softened_bend(-angle));
        let place = [0, 1, 3, 4];
        for k in 0..4 {
            energy.gradient[place[k]] = force * first[k];
            for l in 0..4 {
                energy.curvature[place[k]][place[l]] =
                    bend * first[k] * first[l] + force * second[k][l];
            }
        }
        energy.pressure = stiffness * overlap;
        energy
    }
}

/// Derivatives by the components across an edge as those by all.
fn in_space(fold: &PairEnergy, across: [[f64; 3]; 2]) -> PairEnergy {
    if fold.pressure == 0.0 {
        return *fold;
    }
    let mut energy = PairEnergy {
        gradient: [0.0; 6],
        curvature: [[0.0; 6]; 6],
        ..*fold
    };
    // Difference, then sum, each by its two components.
    let parts = [(0, 0), (0, 1), (3, 0), (3, 1)];
    for (of, k) in parts {
        for i in 0..3 {
            energy.gradient[of + i] += fold.gradient[of + k] * across[k][i];
            for (by, l) in parts {
                for j in 0..3 {
                    energy.curvature[of + i][by + j] +=
                        fold.curvature[of + k][by + l] * across[k][i] * across[l][j];
                }
            }
        }
    }
    energy
}

/// An overlap that sets in smoothly around zero, and its slope.
fn softened(x: f64) -> (f64, f64) {
    let half = SOFTENING / 2.0;
    if x <= -half {
        (0.0, 0.0)
    } else if x >= half {
        (x, 1.0)
    } else {
        (
            (x + half).powi(2) / (2.0 * SOFTENING),
            (x + half) / SOFTENING,
        )
    }
}

fn softened_bend(x: f64) -> f64 {
    if x.abs() < SOFTENING / 2.0 {
        1.0 / SOFTENING
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_forces_of_a_folding_pair_are_the_slopes_of_its_energy() {
        differences([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        // An edge that leans over.
        let (c, s) = (0.8, 0.6);
        differences([[c, 0.0, s], [0.0, 1.0, 0.0]]);
    }

    fn differences(across: [[f64; 3]; 2]) {
        let pairing = Pairing::Folding {
            arm: 1.3,
            turn: 1.0,
            stiffness: 7.0,
            across,
        };
        let point = WallPoint::new(
            &[(0, 0.4, -1.1), (1, 0.6, 1.1)],
            &[(2, 0.7, 0.9), (3, 0.3, -0.9)],
            0.8,
            pairing,
        );
        let places = vec![
            [0.1, 0.2, 0.1],
            [1.2, 0.25, -0.1],
            [1.1, 0.0, 0.2],
            [0.2, 0.1, 0.0],
        ];
        let energy = point.energy(&places, 0.0, 0.0);
        assert!(energy.gap < 0.0);
        // By the vectors: move the nodes through their factors.
        let along = |n: usize, d: usize, energy: &PairEnergy| {
            point.difference[n] * energy.gradient[d] + point.sum[n] * energy.gradient[3 + d]
        };
        for n in 0..4 {
            for d in 0..3 {
                let at = |step: f64| {
                    let mut moved = places.clone();
                    moved[n][d] += step;
                    point.energy(&moved, 0.0, 0.0)
                };
                let (up, down) = (at(1e-6), at(-1e-6));
                let value = |e: &PairEnergy| {
                    let overlap = e.pressure / 7.0;
                    0.5 * 7.0 * 1.3 * overlap * overlap * 0.8
                };
                let slope = (value(&up) - value(&down)) / 2e-6;
                assert!((slope - along(n, d, &energy)).abs() < 1e-7);
                for other in 0..4 {
                    for e in 0..3 {
                        let found = (along(other, e, &up) - along(other, e, &down)) / 2e-6;
                        let mut exact = 0.0;
                        for (p, fp) in [(0, point.difference[other]), (3, point.sum[other])] {
                            for (q, fq) in [(0, point.difference[n]), (3, point.sum[n])] {
                                exact += fp * fq * energy.curvature[p + e][q + d];
                            }
                        }
                        assert!((found - exact).abs() < 1e-5, "{found} {exact}");
                    }
                }
            }
        }
    }
}
