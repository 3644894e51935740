//! `L B L^T` of `faer` for matrices that are not positive definite, with pivots
//! exchanged within its fronts.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, SymbolicCholesky, SymbolicCholeskyRaw,
    SymmetricOrdering, factorize_symbolic_cholesky, supernodal::SupernodalIntranodeLbltRef,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use super::{LinearError, Pattern};

/// A factorisation with its own analysis: few problems ever need it.
pub(super) struct Indefinite {
    symbolic: SymbolicCholesky<u32>,
    scratch: MemBuffer,
    values: Vec<f64>,
    below: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
}

impl Indefinite {
    /// # Errors
    /// When the factor does not fit in memory.
    pub(super) fn analyse(pattern: &Pattern) -> Result<Self, LinearError> {
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let n = pattern.size();
        // Without an ordering of its own the analysis reads the upper triangle.
        let symbolic = factorize_symbolic_cholesky(
            view(&pattern.transposed()),
            Side::Upper,
            SymmetricOrdering::Identity,
            parameters,
        )
        .map_err(|_| LinearError::Memory { unknowns: n })?;
        let scratch = symbolic
            .factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        Ok(Self {
            values: vec![0.0; symbolic.len_val()],
            scratch: MemBuffer::new(scratch),
            symbolic,
            below: vec![0.0; n],
            forward: vec![0; n],
            inverse: vec![0; n],
        })
    }

    /// # Errors
    /// When the matrix is singular.
    pub(super) fn refactor(
        &mut self,
        pattern: &Pattern,
        values: &[f64],
    ) -> Result<(), LinearError> {
        for (number, (one, other)) in self.forward.iter_mut().zip(&mut self.inverse).enumerate() {
            (*one, *other) = (number as u32, number as u32);
        }
        self.symbolic.factorize_numeric_intranode_lblt(
            &mut self.values,
            &mut self.below,
            &mut self.forward,
            &mut self.inverse,
            SparseColMatRef::new(view(pattern), values),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Spec::default(),
        );
        if self.values.iter().all(|value| value.is_finite()) {
            Ok(())
        } else {
            Err(LinearError::Singular)
        }
    }

    /// Number of negative eigenvalues of the last matrix, by the pivots of one and of two rows.
    pub(super) fn negative(&self) -> usize {
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else {
            // The analysis asks for supernodes.
            return 0;
        };
        let rows = self.below.len();
        let factor = SupernodalIntranodeLbltRef::new(
            symbolic,
            &self.values,
            &self.below,
            PermRef::new_checked(&self.forward, &self.inverse, rows),
        );
        let mut negative = 0;
        for number in 0..symbolic.n_supernodes() {
            let front = factor.supernode(number);
            let (start, value) = (front.start(), front.val());
            let count = value.ncols();
            let mut k = 0;
            while k < count {
                let (one, below) = (value[(k, k)], self.below[start + k]);
                if below == 0.0 || k + 1 == count {
                    negative += usize::from(one < 0.0);
                    k += 1;
                    continue;
                }
                let other = value[(k + 1, k + 1)];
                negative += if one * other - below * below < 0.0 {
                    1
                } else {
                    2 * usize::from(one < 0.0)
                };
                k += 2;
            }
        }
        negative
    }

    pub(super) fn solve(&mut self, right: &mut [f64]) {
        let rows = right.len();
        IntranodeLbltRef::new(
            &self.symbolic,
            &self.values,
            &self.below,
            PermRef::new_checked(&self.forward, &self.inverse, rows),
        )
        .solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(right, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
    }
}

fn view(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, u32> {
    let n = pattern.size();
    SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.rows)
}
