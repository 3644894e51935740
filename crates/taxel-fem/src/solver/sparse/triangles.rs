//! Forward and backward substitution for one right-hand side. It is bound by reading
//! the factor: each front is read once each way, four columns at a time.

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use pulp::{Simd, WithSimd};

/// Columns of a front treated at once.
const WIDE: usize = 4;
/// Partial sums of a scalar product.
const SUMS: usize = 8;

/// Replaces `x` by the solution of `L L' x = b`.
pub(super) fn solve(fronts: &SymbolicSupernodalCholesky<u32>, values: &[f64], x: &mut [f64]) {
    pulp::Arch::new().dispatch(Substitution { fronts, values, x });
}

struct Substitution<'a> {
    fronts: &'a SymbolicSupernodalCholesky<u32>,
    values: &'a [f64],
    x: &'a mut [f64],
}

impl WithSimd for Substitution<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { fronts, values, x } = self;
        let mut below = vec![0.0; x.len()];
        for number in 0..fronts.n_supernodes() {
            let front = Front::of(fronts, values, number);
            let below = &mut below[..front.rows.len()];
            below.fill(0.0);
            front.forward(&mut x[front.first..][..front.width], below);
            for (&row, below) in front.rows.iter().zip(below) {
                x[row as usize] -= *below;
            }
        }
        for number in (0..fronts.n_supernodes()).rev() {
            let front = Front::of(fronts, values, number);
            let below = &mut below[..front.rows.len()];
            for (&row, below) in front.rows.iter().zip(&mut *below) {
                *below = x[row as usize];
            }
            front.backward(&mut x[front.first..][..front.width], below);
        }
    }
}

/// Columns of the factor with the same rows: a triangle, and a rectangle below it.
struct Front<'a> {
    first: usize,
    width: usize,
    rows: &'a [u32],
    values: &'a [f64],
}

impl<'a> Front<'a> {
    #[inline(always)]
    fn of(fronts: &'a SymbolicSupernodalCholesky<u32>, values: &'a [f64], number: usize) -> Self {
        let first = fronts.supernode_begin()[number] as usize;
        let width = fronts.supernode_end()[number] as usize - first;
        let rows = fronts.col_ptr_for_row_idx();
        let rows = &fronts.row_idx()[rows[number] as usize..rows[number + 1] as usize];
        let start = fronts.col_ptr_for_val()[number] as usize;
        Self {
            first,
            width,
            rows,
            values: &values[start..][..width * (width + rows.len())],
        }
    }

    /// A column: its part in the triangle, from the diagonal on, and below it.
    #[inline(always)]
    fn column(&self, column: usize) -> (&'a [f64], &'a [f64]) {
        let height = self.width + self.rows.len();
        let (triangle, rectangle) = self.values[column * height..][..height].split_at(self.width);
        (&triangle[column..], rectangle)
    }

    /// Solves with the triangle and adds what follows below.
    #[inline(always)]
    fn forward(&self, x: &mut [f64], below: &mut [f64]) {
        for column in 0..self.width {
            let (triangle, _) = self.column(column);
            let own = x[column] / triangle[0];
            x[column] = own;
            for (x, entry) in x[column + 1..].iter_mut().zip(&triangle[1..]) {
                *x -= entry * own;
            }
        }
        let (fours, rest) = x.as_chunks::<WIDE>();
        for (number, x) in fours.iter().enumerate() {
            let [a, b, c, d] = std::array::from_fn(|k| self.column(number * WIDE + k).1);
            let entries = a.iter().zip(b).zip(c).zip(d);
            for (below, (((a, b), c), d)) in below.iter_mut().zip(entries) {
                *below += (a * x[0] + b * x[1]) + (c * x[2] + d * x[3]);
            }
        }
        for (number, x) in rest.iter().enumerate() {
            let (_, entries) = self.column(fours.len() * WIDE + number);
            for (below, entry) in below.iter_mut().zip(entries) {
                *below += entry * x;
            }
        }
    }

    /// Takes off what stands below and solves with the triangle from the end.
    #[inline(always)]
    fn backward(&self, x: &mut [f64], below: &[f64]) {
        for column in (0..self.width).rev() {
            let (triangle, rectangle) = self.column(column);
            let (own, later) = x[column..].split_at_mut(1);
            let known = product(rectangle, below) + product(&triangle[1..], later);
            own[0] = (own[0] - known) / triangle[0];
        }
    }
}

/// Scalar product.
#[inline(always)]
fn product(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<SUMS>(), b.as_chunks::<SUMS>());
    let mut sums = [0.0; SUMS];
    for (a, b) in a.iter().zip(b) {
        for k in 0..SUMS {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}
