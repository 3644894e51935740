//! Sparse symmetric matrices and their factorisation.
//!
//! Everything that needs a direct solver goes through [`Factorisation`]. Behind it
//! stands a multifrontal Cholesky: `analysis` makes fronts of a pattern and shares them among
//! threads, `fronts` computes their numbers by the products of `tiles`, `triangles` solves. Where the
//! matrix has lost its definiteness `faer`'s `L B L^T` takes over (`indefinite`).

mod analysis;
mod fronts;
mod indefinite;
pub mod ordering;
mod tiles;
mod triangles;

use analysis::Analysis;
use fronts::Factor;
use indefinite::Indefinite;

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
    /// An iterative solution for a matrix that it can't be found for.
    #[error(
        "the tangent is not positive definite at fixed pressures, or not symmetric: no iterative solution; take the direct solver"
    )]
    NotPositive,
    /// An iterative solution for a body whose nodes move together.
    #[error(
        "rigid bodies and constraints between displacements have no iterative solution; take the direct solver"
    )]
    Constrained,
    /// An iterative solution that does not converge.
    #[error("no linear solution after {most} iterations; allow more, or take the direct solver")]
    Iterations {
        /// Iterations that were allowed.
        most: usize,
    },
    /// A tangent that is not symmetric, by iterations that come no nearer.
    #[error(
        "the tangent is not symmetric, and {directions} directions leave {residual:.1e} of the right side: friction, contact or a pressure that follows the surface outweighs the stiffness of the body"
    )]
    Unsymmetric {
        /// Directions that were searched.
        directions: usize,
        /// Share of the right side that is left.
        residual: f64,
    },
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

/// Multifrontal Cholesky; `L B L^T` of `faer` where that fails.
pub struct Cholesky {
    analysis: Analysis,
    factor: Factor,
    /// Made for the first indefinite matrix.
    indefinite: Option<Indefinite>,
    /// Definiteness of the last matrix.
    definiteness: Definiteness,
}

impl Cholesky {
    /// Analyses a pattern for factorisation by so many threads, 1 at least; [`Self::analyse`]
    /// takes those of the pool that calls it. The factor is the same for any number, bit by bit.
    ///
    /// # Errors
    /// When the factor does not fit in memory.
    pub fn for_threads(pattern: &Pattern, threads: usize) -> Result<Self, LinearError> {
        let analysis = Analysis::of(pattern, threads);
        let unknowns = pattern.size();
        let factor = Factor::new(&analysis, unknowns, threads);
        Ok(Self {
            factor: factor.ok_or(LinearError::Memory { unknowns })?,
            analysis,
            indefinite: None,
            definiteness: Definiteness::Positive,
        })
    }

    /// Number of negative eigenvalues of the last matrix.
    pub(crate) fn negative_eigenvalues(&self) -> usize {
        match (&self.indefinite, self.definiteness) {
            (Some(other), Definiteness::Indefinite) => other.negative(),
            _ => 0,
        }
    }
}

impl Factorisation for Cholesky {
    fn analyse(pattern: &Pattern) -> Result<Self, LinearError> {
        // Cases that threads share already are one thread's each.
        let threads = match rayon::current_thread_index() {
            Some(_) => 1,
            None => rayon::current_num_threads(),
        };
        Self::for_threads(pattern, threads)
    }

    fn refactor(&mut self, pattern: &Pattern, values: &[f64]) -> Result<Definiteness, LinearError> {
        self.definiteness = if self.factor.renew(&self.analysis, pattern, values) {
            Definiteness::Positive
        } else {
            let mut other = match self.indefinite.take() {
                Some(known) => known,
                None => Indefinite::analyse(pattern)?,
            };
            other.refactor(pattern, values)?;
            self.indefinite = Some(other);
            Definiteness::Indefinite
        };
        Ok(self.definiteness)
    }

    fn solve(&mut self, right: &mut [f64]) {
        match &mut self.indefinite {
            Some(other) if self.definiteness == Definiteness::Indefinite => other.solve(right),
            _ => triangles::solve(&self.analysis, &self.factor.values, right),
        }
    }
}

#[cfg(test)]
mod tests;
