//! Linear systems too large for a factor: minimal residuals with two levels.
//!
//! The mixed system of `assembly::mixed` is symmetric and not definite: MINRES (Paige and
//! Saunders 1975), preconditioned block by block (Elman, Silvester and Wathen 2014, chapter 4).
//! For `A` that is the sum of one symmetric Gauss-Seidel sweep and of the exact solution on the
//! corners of the cells; for the pressures the mass matrix over the shear modulus, cell by cell,
//! which `C' A^-1 C` equals up to a factor near one. Neither depends on the bulk modulus or,
//! much, on the size of the cells, and so does the number of iterations.

use taxel_numerics::dense::dot;

use crate::assembly::dofs::Unknowns;
use crate::assembly::kernel::MAX_PRESSURES;
use crate::assembly::mixed::{Coupling, Mixed, MixedParts};
use crate::mesh::Mesh;
use crate::sparse::{Cholesky, Definiteness, Factorisation, LinearError, Pattern};

/// Settings of an iterative solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iterations {
    /// Share of the right side, in the norm of the preconditioner, that may remain; default 1e-9.
    pub tolerance: f64,
    /// Most iterations; default 1000.
    pub most: usize,
}

impl Default for Iterations {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            most: 1000,
        }
    }
}

/// The coarse level with its factor.
pub(crate) struct TwoLevels {
    pub(crate) settings: Iterations,
    factor: Cholesky,
    /// Iterations of the last solution.
    pub(crate) iterations: usize,
}

/// A tangent in its mixed form.
pub(crate) struct MixedTangent<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) unknowns: &'a Unknowns,
    /// Of `A`.
    pub(crate) values: &'a [f64],
    pub(crate) mixed: &'a Mixed,
    pub(crate) parts: &'a MixedParts,
}

/// Displacements and pressures.
#[derive(Clone)]
struct Both {
    moved: Vec<f64>,
    pressed: Vec<[f64; MAX_PRESSURES]>,
}

impl Both {
    fn dot(&self, other: &Self) -> f64 {
        let pressed = self.pressed.iter().zip(&other.pressed);
        let pressed: f64 = pressed
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>())
            .sum();
        dot(&self.moved, &other.moved) + pressed
    }

    fn add(&mut self, factor: f64, other: &Self) {
        for (own, other) in self.moved.iter_mut().zip(&other.moved) {
            *own += factor * other;
        }
        let own = self.pressed.as_flattened_mut();
        for (own, other) in own.iter_mut().zip(other.pressed.as_flattened()) {
            *own += factor * other;
        }
    }

    fn scale(&mut self, factor: f64) {
        for own in &mut self.moved {
            *own *= factor;
        }
        for own in self.pressed.as_flattened_mut() {
            *own *= factor;
        }
    }
}

impl TwoLevels {
    pub(crate) fn new(mixed: &Mixed, settings: Iterations) -> Result<Self, LinearError> {
        Ok(Self {
            settings,
            factor: Cholesky::analyse(&mixed.corners.pattern)?,
            iterations: 0,
        })
    }

    /// Takes a new tangent.
    ///
    /// # Errors
    /// When it is singular or not positive definite on the corners or in an unknown.
    pub(crate) fn renew(&mut self, tangent: &MixedTangent<'_>) -> Result<(), LinearError> {
        let (pattern, values) = (&tangent.unknowns.pattern, tangent.values);
        let corners = (&tangent.mixed.corners.pattern, &tangent.parts.corners);
        let positive = self.factor.refactor(corners.0, corners.1)? == Definiteness::Positive;
        let diagonals = (0..pattern.size()).all(|k| values[pattern.column(k).start] > 0.0);
        if positive && diagonals {
            Ok(())
        } else {
            Err(LinearError::NotPositive)
        }
    }

    /// Solves for the displacements.
    ///
    /// # Errors
    /// When too many iterations are needed.
    pub(crate) fn solve(
        &mut self,
        tangent: &MixedTangent<'_>,
        right: &[f64],
    ) -> Result<Vec<f64>, LinearError> {
        let zero = Both {
            moved: vec![0.0; right.len()],
            pressed: vec![[0.0; MAX_PRESSURES]; tangent.parts.stiffness.len()],
        };
        let mut x = zero.clone();
        // Lanczos's vectors `v` and `z = P^-1 v`, as in Elman, Silvester and Wathen's algorithm.
        let (mut v, mut v_before) = (zero.clone(), zero.clone());
        v.moved.copy_from_slice(right);
        let mut z = self.precondition(tangent, &v);
        let (mut gamma, mut gamma_before) = (v.dot(&z).sqrt(), 1.0);
        let start = gamma;
        let mut rest = gamma;
        let ((mut c, mut s), (mut c_before, mut s_before)) = ((1.0, 0.0), (1.0, 0.0));
        let (mut w, mut w_before) = (zero.clone(), zero);
        self.iterations = 0;
        while rest.abs() > self.settings.tolerance * start {
            if self.iterations == self.settings.most {
                return Err(LinearError::Iterations {
                    most: self.settings.most,
                });
            }
            self.iterations += 1;
            z.scale(1.0 / gamma);
            let mut next = tangent.product(&z);
            let delta = z.dot(&next);
            next.add(-delta / gamma, &v);
            next.add(-gamma / gamma_before, &v_before);
            v_before = std::mem::replace(&mut v, next);
            let z_next = self.precondition(tangent, &v);
            let square = v.dot(&z_next);
            if square.is_nan() || square < 0.0 {
                return Err(LinearError::NotPositive);
            }
            let gamma_next = square.sqrt();
            let diagonal = c * delta - c_before * s * gamma;
            let radius = diagonal.hypot(gamma_next);
            let second = s * delta + c_before * c * gamma;
            let third = s_before * gamma;
            (c_before, s_before) = (c, s);
            (c, s) = (diagonal / radius, gamma_next / radius);
            let mut new = std::mem::replace(&mut z, z_next);
            new.add(-third, &w_before);
            new.add(-second, &w);
            new.scale(1.0 / radius);
            w_before = std::mem::replace(&mut w, new);
            x.add(c * rest, &w);
            rest *= -s;
            (gamma_before, gamma) = (gamma, gamma_next);
        }
        Ok(x.moved)
    }

    /// The preconditioner.
    fn precondition(&mut self, tangent: &MixedTangent<'_>, r: &Both) -> Both {
        let pattern = &tangent.unknowns.pattern;
        let mut moved = sweep(pattern, tangent.values, &r.moved);
        // On the corners.
        let follows = &tangent.mixed.follows;
        let mut coarse = vec![0.0; tangent.mixed.corners.count()];
        for (follows, r) in follows.iter().zip(&r.moved) {
            for &(corner, weight) in follows {
                coarse[corner as usize] += weight * r;
            }
        }
        self.factor.solve(&mut coarse);
        for (follows, moved) in follows.iter().zip(&mut moved) {
            for &(corner, weight) in follows {
                *moved += weight * coarse[corner as usize];
            }
        }
        // D^-1 over one and the ratio of the moduli is the mass matrix over the shear modulus.
        let parts = tangent.parts;
        let each = parts.stiffness.iter().zip(&parts.softness).zip(&r.pressed);
        let pressed = each.map(|((stiffness, softness), r)| {
            let factor = softness / (softness + 1.0);
            times(stiffness, r).map(|p| factor * p)
        });
        Both {
            pressed: pressed.collect(),
            moved,
        }
    }
}

/// One forward and one backward sweep from zero: `(D + L) D^-1 (D + L')` inverted.
fn sweep(pattern: &Pattern, values: &[f64], right: &[f64]) -> Vec<f64> {
    let mut x = right.to_vec();
    for column in 0..pattern.size() {
        let entries = pattern.column(column);
        let (rows, values) = (&pattern.rows[entries.clone()], &values[entries]);
        let own = x[column] / values[0];
        for (&row, value) in rows[1..].iter().zip(&values[1..]) {
            x[row as usize] -= value * own;
        }
    }
    for column in (0..pattern.size()).rev() {
        let entries = pattern.column(column);
        let (rows, values) = (&pattern.rows[entries.clone()], &values[entries]);
        let mut sum = x[column];
        for (&row, value) in rows[1..].iter().zip(&values[1..]) {
            sum -= value * x[row as usize];
        }
        x[column] = sum / values[0];
    }
    x
}

type Small = [[f64; MAX_PRESSURES]; MAX_PRESSURES];

fn times(matrix: &Small, x: &[f64; MAX_PRESSURES]) -> [f64; MAX_PRESSURES] {
    matrix.map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum())
}

impl MixedTangent<'_> {
    fn product(&self, x: &Both) -> Both {
        let mut moved = self.unknowns.pattern.multiply(self.values, &x.moved);
        let mut pressed = Vec::with_capacity(x.pressed.len());
        let mut rest = self.parts.coupling.as_slice();
        for (cell, p) in x.pressed.iter().enumerate() {
            let nodes = self.mesh.cell(cell);
            let mut coupling = Coupling {
                nodes,
                unknowns: self.unknowns,
                values: &[],
            };
            let (own, others) = rest.split_at(coupling.size());
            rest = others;
            coupling.values = own;
            let mut sums = [0.0; MAX_PRESSURES];
            coupling.each(|number, row| {
                for m in 0..MAX_PRESSURES {
                    moved[number] += row[m] * p[m];
                    sums[m] += row[m] * x.moved[number];
                }
            });
            let softened = times(&self.parts.compliance[cell], p);
            for m in 0..MAX_PRESSURES {
                sums[m] -= softened[m];
            }
            pressed.push(sums);
        }
        Both { moved, pressed }
    }
}
