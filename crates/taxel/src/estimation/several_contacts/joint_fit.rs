//! Positions, sizes and forces of all contacts together.

use taxel_numerics::dense::{cholesky, cholesky_solve};

use super::{Fitted, MOST, OWN, Scene, Shape};
use crate::estimation::position_fit::WINDOW;

/// Steps of the joint fit.
const ITERATIONS: usize = 15;

/// What a step of the joint fit needs.
pub(super) struct Linearised {
    pub(super) misfit: f64,
    /// Fisher matrix of all unknowns with what is known of them beforehand, its lower triangle.
    pub(super) matrix: Vec<Vec<f64>>,
    /// Slope of half the misfit downwards.
    pub(super) slope: Vec<f64>,
}

impl Scene<'_> {
    /// Positions, sizes and forces together, by Levenberg and Marquardt.
    pub(super) fn refined(&self, mut shapes: Vec<Shape>) -> Fitted {
        if let Some((forces, _)) = self.best_forces(&shapes) {
            for (one, force) in shapes.iter_mut().zip(forces) {
                one.force = if force > 0.0 { force } else { one.force };
            }
        }
        let limits = self.limits();
        let mut here = self.linearised(&shapes);
        let mut damping = 1e-2;
        for _ in 0..ITERATIONS {
            let mut matrix = here.matrix.clone();
            for (k, row) in matrix.iter_mut().enumerate() {
                row[k] *= 1.0 + damping;
            }
            let Some(factor) = cholesky(matrix) else {
                break;
            };
            let step = cholesky_solve(&factor, &here.slope);
            let moved: Vec<Shape> = shapes
                .iter()
                .zip(step.chunks(OWN))
                .map(|(one, step)| Shape {
                    at: [0, 1].map(|axis| (one.at[axis] + step[axis]).clamp(0.0, limits[axis])),
                    size: (one.size + step[2]).clamp(0.0, limits[2]),
                    force: (one.force + step[3]).max(0.1 * one.force),
                })
                .collect();
            let next = self.linearised(&moved);
            if next.misfit < here.misfit {
                let done = here.misfit - next.misfit < 1e-3;
                (shapes, here, damping) = (moved, next, 0.2 * damping);
                if done {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        Fitted {
            shapes,
            misfit: here.misfit,
        }
    }

    /// The forces that fit best at the positions and sizes as they are, and their misfit;
    /// `None` where two contacts are one.
    pub(super) fn best_forces(&self, shapes: &[Shape]) -> Option<([f64; MOST], f64)> {
        let count = shapes.len();
        // Of each element the shares of all contacts, and the force behind them.
        let mut columns = vec![[0.0; MOST + 1]; self.forces.len()];
        for (k, one) in shapes.iter().enumerate() {
            self.shares(one, |element, [share, ..]| {
                columns[element][k] = share * self.roots[element];
            });
        }
        let mut products = [[0.0; MOST + 1]; MOST + 1];
        for (column, force) in columns.iter_mut().zip(&self.weighted) {
            column[count] = *force;
            for i in 0..=count {
                for j in 0..=i {
                    products[i][j] += column[i] * column[j];
                }
            }
        }
        // Cholesky: what is left of the last product is the misfit.
        for i in 0..=count {
            for j in 0..=i {
                let known: f64 = (0..j).map(|k| products[i][k] * products[j][k]).sum();
                let rest = products[i][j] - known;
                products[i][j] = if j < i {
                    rest / products[j][j]
                } else if i == count {
                    rest
                } else if rest > 0.0 {
                    rest.sqrt()
                } else {
                    return None;
                };
            }
        }
        let mut forces = [0.0; MOST];
        for i in (0..count).rev() {
            let known: f64 = (i + 1..count).map(|k| products[k][i] * forces[k]).sum();
            forces[i] = (products[count][i] - known) / products[i][i];
        }
        Some((forces, products[count][count]))
    }

    /// The misfit with its slopes along all unknowns.
    pub(super) fn linearised(&self, shapes: &[Shape]) -> Linearised {
        let mut left = self.weighted.clone();
        let slopes = |one: &Shape| {
            let mut rows = vec![[0.0; OWN]; self.forces.len()];
            self.shares(one, |element, [share, x, y, size]| {
                let root = self.roots[element];
                let force = one.force * root;
                left[element] -= force * share;
                rows[element] = [force * x, force * y, force * size, share * root];
            });
            rows
        };
        let rows: Vec<Vec<[f64; OWN]>> = shapes.iter().map(slopes).collect();
        let unknowns = OWN * shapes.len();
        let (mut matrix, mut slope) = (vec![vec![0.0; unknowns]; unknowns], vec![0.0; unknowns]);
        for (p, a) in rows.iter().enumerate() {
            for (row, left) in a.iter().zip(&left) {
                for (sum, entry) in slope[OWN * p..].iter_mut().zip(row) {
                    *sum += entry * left;
                }
            }
            for (q, b) in rows[..=p].iter().enumerate() {
                let mut block = [[0.0; OWN]; OWN];
                for (a, b) in a.iter().zip(b) {
                    for (sums, a) in block.iter_mut().zip(a) {
                        for (sum, b) in sums.iter_mut().zip(b) {
                            *sum += a * b;
                        }
                    }
                }
                for (row, sums) in matrix[OWN * p..].iter_mut().zip(block) {
                    row[OWN * q..][..OWN].copy_from_slice(&sums);
                }
            }
        }
        // Anywhere within the window, of any of the sizes: variances of even
        // distributions.
        let along_axis = 12.0 / (2.0 * WINDOW as f64).powi(2);
        let size = 12.0 / (self.tables.len() as f64).powi(2);
        for (k, one) in shapes.iter().enumerate() {
            let priors = [along_axis, along_axis, size, one.force.powi(-2)];
            for (own, prior) in priors.into_iter().enumerate() {
                matrix[OWN * k + own][OWN * k + own] += prior;
            }
        }
        Linearised {
            misfit: left.iter().map(|left| left * left).sum(),
            matrix,
            slope,
        }
    }
}
