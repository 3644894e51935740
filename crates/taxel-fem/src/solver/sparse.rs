//! Sparse symmetric matrices and their factorisation.
//!
//! Everything that needs a direct solver goes through [`Factorisation`]; what
//! stands behind it today is `faer`'s supernodal Cholesky, and its `L B L^T` where
//! the matrix has lost its definiteness.

mod triangles;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LltRef, SymbolicCholesky, SymbolicCholeskyRaw,
    SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

/// Lower triangle of a symmetric matrix by columns: where its entries are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pattern {
    /// First entry of each column, and the number of entries at the end.
    pub column_starts: Vec<u32>,
    /// Row of each entry, ascending in a column, the diagonal first.
    pub rows: Vec<u32>,
}

impl Pattern {
    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.column_starts.len().saturating_sub(1)
    }

    /// Number of entries of the lower triangle.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }

    /// Rows of a column.
    pub fn column(&self, column: usize) -> std::ops::Range<usize> {
        self.column_starts[column] as usize..self.column_starts[column + 1] as usize
    }

    /// `A x` for the symmetric matrix with these values.
    pub fn multiply(&self, values: &[f64], x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; x.len()];
        for column in 0..self.size() {
            let mut entries = self.column(column);
            let Some(diagonal) = entries.next() else {
                continue;
            };
            let mut sum = values[diagonal] * x[column];
            for entry in entries {
                let row = self.rows[entry] as usize;
                product[row] += values[entry] * x[column];
                sum += values[entry] * x[row];
            }
            product[column] += sum;
        }
        product
    }

    /// The same entries as an upper triangle by columns.
    fn transposed(&self) -> Self {
        let mut column_starts = vec![0; self.size() + 1];
        for &row in &self.rows {
            column_starts[row as usize + 1] += 1;
        }
        for column in 0..self.size() {
            column_starts[column + 1] += column_starts[column];
        }
        let mut next = column_starts.clone();
        let mut rows = vec![0; self.rows.len()];
        for column in 0..self.size() {
            for entry in self.column(column) {
                let place = &mut next[self.rows[entry] as usize];
                rows[*place as usize] = column as u32;
                *place += 1;
            }
        }
        Self {
            column_starts,
            rows,
        }
    }

    fn view(&self) -> SymbolicSparseColMatRef<'_, u32> {
        let n = self.size();
        SymbolicSparseColMatRef::new_checked(n, n, &self.column_starts, None, &self.rows)
    }
}

/// Sign of a factorised matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Definiteness {
    /// All pivots are positive: the equilibrium is stable under its constraints.
    Positive,
    /// Some pivots are not.
    Indefinite,
}

/// Why a linear system has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LinearError {
    /// The pattern does not fit in memory or in the index type.
    #[error("the matrix of {unknowns} unknowns can't be analysed: out of memory")]
    Memory {
        /// Number of unknowns.
        unknowns: usize,
    },
    /// The matrix has a row that nothing holds.
    #[error("the matrix is singular: a part of the body is not held, or a value is not a number")]
    Singular,
    /// The solution does not satisfy the equations.
    #[error(
        "the linear solution leaves a relative residual of {residual:.1e}; at most {limit:.0e} is accepted"
    )]
    Inaccurate {
        /// Norm of `b - A x` over that of `b`.
        residual: f64,
        /// Largest value accepted.
        limit: f64,
    },
}

/// A direct solver whose analysis of the pattern is kept.
pub trait Factorisation {
    /// Orders nothing, analyses once: call it with the pattern of the topology.
    ///
    /// # Errors
    /// When the factor does not fit in memory.
    fn analyse(pattern: &Pattern) -> Result<Self, LinearError>
    where
        Self: Sized;

    /// Factorises the matrix of these values with the analysis at hand.
    ///
    /// # Errors
    /// When the matrix is singular.
    fn refactor(&mut self, pattern: &Pattern, values: &[f64]) -> Result<Definiteness, LinearError>;

    /// Replaces right-hand sides, one after the other, by the solutions.
    fn solve(&mut self, right: &mut [f64]);
}

/// Largest backward error that [`solve_checked`] accepts.
pub const RESIDUAL_LIMIT: f64 = 1e-11;

/// Solves, computes the residual, refines once where it is large.
///
/// # Errors
/// When the residual stays above [`RESIDUAL_LIMIT`].
pub fn solve_checked(
    factor: &mut impl Factorisation,
    pattern: &Pattern,
    values: &[f64],
    right: &[f64],
) -> Result<Vec<f64>, LinearError> {
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut x = right.to_vec();
    factor.solve(&mut x);
    let entry = values
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    let mut residual = f64::INFINITY;
    for _ in 0..3 {
        let mut rest = pattern.multiply(values, &x);
        for (rest, &right) in rest.iter_mut().zip(right) {
            *rest = right - *rest;
        }
        let scale = norm(right) + entry * norm(&x);
        residual = norm(&rest) / scale.max(f64::MIN_POSITIVE);
        if residual <= RESIDUAL_LIMIT * 1e-2 {
            return Ok(x);
        }
        if !residual.is_finite() {
            return Err(LinearError::Singular);
        }
        factor.solve(&mut rest);
        for (x, rest) in x.iter_mut().zip(&rest) {
            *x += rest;
        }
    }
    if residual <= RESIDUAL_LIMIT {
        return Ok(x);
    }
    Err(LinearError::Inaccurate {
        residual,
        limit: RESIDUAL_LIMIT,
    })
}

/// Supernodal Cholesky; `L B L^T` within the supernodes where that fails.
pub struct Cholesky {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    scratch: MemBuffer,
    /// Present while the last matrix was indefinite.
    indefinite: Option<Pivots>,
}

struct Pivots {
    below: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
}

/// Small neighbouring supernodes are merged while few zeros come in.
const MERGE: [(usize, f64); 4] = [(8, 1.0), (32, 0.8), (96, 0.2), (usize::MAX, 0.08)];

impl Factorisation for Cholesky {
    fn analyse(pattern: &Pattern) -> Result<Self, LinearError> {
        let parameters = CholeskySymbolicParams {
            supernodal_params: SymbolicSupernodalParams {
                relax: Some(&MERGE),
            },
            // Fronts of nodes are dense from the start, however small.
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        // Without an ordering of its own the analysis reads the upper triangle.
        let symbolic = factorize_symbolic_cholesky(
            pattern.transposed().view(),
            Side::Upper,
            SymmetricOrdering::Identity,
            parameters,
        )
        .map_err(|_| LinearError::Memory {
            unknowns: pattern.size(),
        })?;
        let scratch = symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        Ok(Self {
            values: vec![0.0; symbolic.len_val()],
            scratch: MemBuffer::new(scratch),
            symbolic,
            indefinite: None,
        })
    }

    fn refactor(&mut self, pattern: &Pattern, values: &[f64]) -> Result<Definiteness, LinearError> {
        if pattern.size() == 0 {
            return Ok(Definiteness::Positive);
        }
        let matrix = SparseColMatRef::new(pattern.view(), values);
        self.indefinite = None;
        let factor = self.symbolic.factorize_numeric_llt(
            &mut self.values,
            matrix,
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Spec::default(),
        );
        match factor {
            Ok(_) => Ok(Definiteness::Positive),
            Err(LltError::NonPositivePivot { .. }) => self.refactor_indefinite(matrix),
        }
    }

    fn solve(&mut self, right: &mut [f64]) {
        if right.is_empty() {
            return;
        }
        let rows = right.len();
        if self.indefinite.is_none()
            && let SymbolicCholeskyRaw::Supernodal(fronts) = self.symbolic.raw()
        {
            triangles::solve(fronts, &self.values, right);
            return;
        }
        let right = MatMut::from_column_major_slice_mut(right, rows, 1);
        let stack = MemStack::new(&mut self.scratch);
        match &self.indefinite {
            None => LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
                Conj::No,
                right,
                Par::Seq,
                stack,
            ),
            Some(pivots) => IntranodeLbltRef::new(
                &self.symbolic,
                &self.values,
                &pivots.below,
                PermRef::new_checked(&pivots.forward, &pivots.inverse, rows),
            )
            .solve_in_place_with_conj(Conj::No, right, Par::Seq, stack),
        }
    }
}

impl Cholesky {
    fn refactor_indefinite(
        &mut self,
        matrix: SparseColMatRef<'_, u32, f64>,
    ) -> Result<Definiteness, LinearError> {
        let n = matrix.nrows();
        let need = self
            .symbolic
            .factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default())
            .or(self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        self.scratch = MemBuffer::new(need);
        let mut pivots = Pivots {
            below: vec![0.0; n],
            forward: (0..n as u32).collect(),
            inverse: (0..n as u32).collect(),
        };
        self.symbolic.factorize_numeric_intranode_lblt(
            &mut self.values,
            &mut pivots.below,
            &mut pivots.forward,
            &mut pivots.inverse,
            matrix,
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Spec::default(),
        );
        if self.values.iter().any(|value| !value.is_finite()) {
            return Err(LinearError::Singular);
        }
        self.indefinite = Some(pivots);
        Ok(Definiteness::Indefinite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second difference on a square of `n x n` points, shifted on the diagonal.
    fn grid(n: u32, shift: f64) -> (Pattern, Vec<f64>) {
        let mut pattern = Pattern {
            column_starts: vec![0],
            rows: Vec::new(),
        };
        let mut values = Vec::new();
        for i in 0..n * n {
            let mut push = |row: u32, value: f64| {
                pattern.rows.push(row);
                values.push(value);
            };
            push(i, 4.0 + shift);
            if i % n + 1 < n {
                push(i + 1, -1.0);
            }
            if i / n + 1 < n {
                push(i + n, -1.0);
            }
            pattern.column_starts.push(pattern.rows.len() as u32);
        }
        (pattern, values)
    }

    #[test]
    fn definite_and_indefinite_matrices_are_solved_with_one_analysis() {
        let (pattern, definite) = grid(20, 0.0);
        let (_, indefinite) = grid(20, -1.234);
        let mut factor = Cholesky::analyse(&pattern).unwrap();
        for (values, expected) in [
            (&definite, Definiteness::Positive),
            (&indefinite, Definiteness::Indefinite),
            (&definite, Definiteness::Positive),
        ] {
            assert_eq!(factor.refactor(&pattern, values), Ok(expected));
            let x: Vec<f64> = (0..400).map(|i| f64::from(i).sin()).collect();
            let right = pattern.multiply(values, &x);
            let found = solve_checked(&mut factor, &pattern, values, &right).unwrap();
            for (found, x) in found.iter().zip(&x) {
                assert!((found - x).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_refused() {
        // A loose chain: no support, the sum of each row is zero.
        let pattern = Pattern {
            column_starts: vec![0, 2, 4, 5],
            rows: vec![0, 1, 1, 2, 2],
        };
        let values = [1.0, -1.0, 2.0, -1.0, 1.0];
        let mut factor = Cholesky::analyse(&pattern).unwrap();
        let factored = factor.refactor(&pattern, &values);
        let solved =
            factored.and_then(|_| solve_checked(&mut factor, &pattern, &values, &[1.0, 0.0, 0.0]));
        assert!(solved.is_err(), "{solved:?}");
    }
}
