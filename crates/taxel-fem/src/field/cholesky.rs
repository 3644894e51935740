//! Sparse symmetric positive definite systems with many right-hand sides.

use super::FieldError;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{MatMut, Side};

/// Residuals above this, relative to the right-hand side, are refused.
const ALLOWED_RESIDUAL: f64 = 1e-9;

/// A factorised matrix, kept beside its factor to check the solutions.
pub(super) struct Factor {
    lower: SparseColMat<usize, f64>,
    factor: Llt<usize, f64>,
}

impl Factor {
    /// Factorises the matrix of these entries of its lower half (sums of equal places).
    pub(super) fn new(unknowns: usize, entries: &[(u32, u32, f64)]) -> Result<Self, FieldError> {
        let undetermined = || FieldError::Undetermined { unknowns };
        let triplets: Vec<_> = entries
            .iter()
            .map(|&(row, column, value)| Triplet::new(row as usize, column as usize, value))
            .collect();
        let lower = SparseColMat::try_new_from_triplets(unknowns, unknowns, &triplets)
            .map_err(|_| undetermined())?;
        let symbolic =
            SymbolicLlt::try_new(lower.symbolic(), Side::Lower).map_err(|_| undetermined())?;
        let factor = Llt::try_new_with_symbolic(symbolic, lower.as_ref(), Side::Lower)
            .map_err(|_| undetermined())?;
        Ok(Self { lower, factor })
    }

    /// Solves for one right-hand side, with one step of refinement.
    pub(super) fn solve(&self, right: &[f64]) -> Result<Vec<f64>, FieldError> {
        let mut solution = right.to_vec();
        self.solve_in_place(&mut solution);
        let mut correction = self.residual(right, &solution);
        self.solve_in_place(&mut correction);
        for (x, dx) in solution.iter_mut().zip(&correction) {
            *x += dx;
        }
        let scale = largest(right).max(f64::MIN_POSITIVE);
        let residual = largest(&self.residual(right, &solution)) / scale;
        if residual <= ALLOWED_RESIDUAL {
            Ok(solution)
        } else {
            Err(FieldError::Inaccurate {
                residual,
                allowed: ALLOWED_RESIDUAL,
            })
        }
    }

    fn solve_in_place(&self, right: &mut [f64]) {
        let rows = right.len();
        self.factor
            .solve_in_place(MatMut::from_column_major_slice_mut(right, rows, 1));
    }

    fn residual(&self, right: &[f64], solution: &[f64]) -> Vec<f64> {
        let mut residual = right.to_vec();
        for entry in self.lower.as_ref().triplet_iter() {
            let (row, column, value) = (entry.row, entry.col, *entry.val);
            residual[row] -= value * solution[column];
            if row != column {
                residual[column] -= value * solution[row];
            }
        }
        residual
    }
}

/// Largest absolute value; not a number if one of them is none.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, value| {
        if value.abs() <= largest {
            largest
        } else {
            value.abs()
        }
    })
}
