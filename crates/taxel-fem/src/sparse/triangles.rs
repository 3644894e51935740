//! Forward and backward substitution for one right-hand side. It is bound by reading
//! the factor: each front is read once each way, in the order of its memory.

use pulp::{Simd, WithSimd};

use super::analysis::{Analysis, Front};
use super::tiles::{SIDE, ZERO, load};
use crate::scalar::Lanes;

/// Replaces `x` by the solution of `L L' x = b`.
pub(super) fn solve(analysis: &Analysis, values: &[Lanes], x: &mut [f64]) {
    pulp::Arch::new().dispatch(Substitution {
        analysis,
        values,
        x,
    });
}

struct Substitution<'a> {
    analysis: &'a Analysis,
    values: &'a [Lanes],
    x: &'a mut [f64],
}

impl WithSimd for Substitution<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self {
            analysis,
            values,
            x,
        } = self;
        let (mut strips, mut sums) = (Vec::new(), Vec::new());
        for front in &analysis.fronts {
            let (columns, rows) = analysis.indices(front);
            gather(x, columns, &[], &mut strips);
            let factor = &values[front.values..][..front.size()];
            let (top, bottom) = factor.split_at(front.pivot_strips() * front.width);
            forward(front.width, top, &mut strips);
            put(x, columns, &strips);
            for (rows, strip) in rows.chunks(SIDE).zip(bottom.chunks_exact(front.width)) {
                let sum = sum(strip, &strips);
                for (&row, value) in rows.iter().zip(sum.0) {
                    x[row as usize] -= value;
                }
            }
        }
        for front in analysis.fronts.iter().rev() {
            let (columns, rows) = analysis.indices(front);
            gather(x, columns, rows, &mut strips);
            let factor = &values[front.values..][..front.size()];
            backward(front, factor, &mut strips, &mut sums);
            put(x, columns, &strips);
        }
    }
}

/// Unknowns and rows of a front as strips.
#[inline(always)]
fn gather(x: &[f64], columns: &[u32], rows: &[u32], strips: &mut Vec<Lanes>) {
    strips.clear();
    for part in columns.chunks(SIDE).chain(rows.chunks(SIDE)) {
        let mut strip = ZERO;
        for (strip, &index) in strip.0.iter_mut().zip(part) {
            *strip = x[index as usize];
        }
        strips.push(strip);
    }
}

#[inline(always)]
fn put(x: &mut [f64], columns: &[u32], strips: &[Lanes]) {
    for (part, strip) in columns.chunks(SIDE).zip(strips) {
        for (&index, value) in part.iter().zip(strip.0) {
            x[index as usize] = value;
        }
    }
}

/// A strip times the unknowns of its columns.
#[inline(always)]
fn sum(strip: &[Lanes], unknowns: &[Lanes]) -> Lanes {
    let (tiles, rest) = strip.as_chunks::<SIDE>();
    let mut sums = [ZERO; 4];
    for (tile, unknowns) in tiles.iter().zip(unknowns) {
        for k in 0..SIDE {
            sums[k % 4] = tile[k].times_plus(unknowns.0[k], sums[k % 4]);
        }
    }
    if let Some(unknowns) = unknowns.get(tiles.len()) {
        for (column, &factor) in rest.iter().zip(&unknowns.0) {
            sums[0] = column.times_plus(factor, sums[0]);
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

/// Solves with the triangle.
#[inline(always)]
fn forward(width: usize, top: &[Lanes], unknowns: &mut [Lanes]) {
    for (number, strip) in top.chunks_exact(width).enumerate() {
        let mut own = unknowns[number] - sum(&strip[..number * SIDE], unknowns);
        let triangle = load(strip, number);
        for k in 0..SIDE {
            let value = own.0[k] * triangle[k].0[k];
            own = (-triangle[k]).times_plus(value, own);
            own.0[k] = value;
        }
        unknowns[number] = own;
    }
}

/// Takes off what stands below and solves with the triangle from the end: strip by
/// strip, from the end of the memory to its beginning.
#[inline(always)]
fn backward(front: &Front, factor: &[Lanes], unknowns: &mut [Lanes], sums: &mut Vec<Lanes>) {
    let (width, pivots) = (front.width, front.pivot_strips());
    sums.clear();
    sums.resize(width, ZERO);
    let below = factor[pivots * width..].chunks_exact(width).rev();
    for (strip, value) in below.zip(unknowns[pivots..].iter().rev()) {
        add(sums, strip, value);
    }
    for number in (0..pivots).rev() {
        let strip = &factor[number * width..][..width];
        let (triangle, known) = (load(strip, number), load(sums, number));
        let own = &mut unknowns[number];
        for k in (0..SIDE).rev() {
            let mut known = total(known[k]);
            for later in k + 1..SIDE {
                known += triangle[k].0[later] * own.0[later];
            }
            own.0[k] = (own.0[k] - known) * triangle[k].0[k];
        }
        add(&mut sums[..number * SIDE], strip, own);
    }
}

/// Adds products with a strip to the sums of its columns.
#[inline(always)]
fn add(sums: &mut [Lanes], strip: &[Lanes], value: &Lanes) {
    for (sum, column) in sums.iter_mut().zip(strip) {
        for lane in 0..SIDE {
            sum.0[lane] = column.0[lane].mul_add(value.0[lane], sum.0[lane]);
        }
    }
}

#[inline(always)]
fn total(lanes: Lanes) -> f64 {
    let a = lanes.0;
    ((a[0] + a[1]) + (a[2] + a[3])) + ((a[4] + a[5]) + (a[6] + a[7]))
}
