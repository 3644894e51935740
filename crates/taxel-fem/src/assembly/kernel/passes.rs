//! Passes over the nodes of a cell, several nodes at once.
//!
//! Loops over points run through slices of equal length and loops over components
//! have constant bounds: checks and calls inside would cost more than the arithmetic.

use super::{
    BLOCK, Compliance, Kernel, MAX_PRESSURES, Moduli, PointStates, ZERO, small_and_inverse, sum,
};
use crate::scalar::{Lanes, PLACE};

/// Rows of a panel of the product.
pub(super) const ROWS: usize = 4;

impl Kernel {
    /// Spatial gradients, nodal forces and the elimination of the pressure, for `C`
    /// components and `D` directions.
    #[inline(always)]
    pub(super) fn node_passes<const C: usize, const D: usize>(&mut self, compliance: &Compliance) {
        let points = self.points;
        let [small, inverse] = small_and_inverse(&compliance.matrix, C + 1);
        (self.compliance, self.stiffness) = (small, inverse);
        for m in 0..=C {
            self.pressure_shift[m] = 0.0;
            for n in 0..=C {
                self.pressure_shift[m] += inverse[m][n] * sum(compliance.residual[n]);
            }
        }
        for column in 0..self.columns {
            let gradients = &mut self.gradients[column * points * D..][..points * D];
            spatial::<C, D>(
                &self.states,
                &self.column_slopes[column * points * C..][..points * C],
                &self.column_values[column * points..][..points],
                gradients,
            );
            let (force, coupling) = forces::<C, D>(&self.states, gradients);
            for i in 0..C {
                let at = i * self.columns + column;
                let mut whole = force[i];
                let follow = &mut self.recovery[at * MAX_PRESSURES..][..MAX_PRESSURES];
                for m in 0..=C {
                    whole = coupling[i][m].times_plus(self.pressure_shift[m], whole);
                    let mut sum = ZERO;
                    for n in 0..=C {
                        sum = coupling[i][n].times_plus(inverse[m][n], sum);
                    }
                    follow[m] = sum;
                }
                self.force[at] = whole;
                self.coupling.as_chunks_mut::<MAX_PRESSURES>().0[at] = coupling[i];
            }
        }
    }

    /// The tangent, block by block of components: sums over points and directions of
    /// products of gradients, as small dense matrix products.
    #[inline(always)]
    pub(super) fn tangent_pass<const D: usize>(&mut self, wide: bool) {
        let components = self.kinematics.components();
        for i in 0..components {
            for j in i..components {
                let block = BLOCK[i][j];
                let gradients = &self.gradients;
                weigh::<D>(
                    &self.moduli,
                    block,
                    self.points,
                    gradients,
                    &mut self.product,
                );
                let width = self.columns * MAX_PRESSURES;
                let (begin, end) = (self.row(block, 0), self.row(block + 1, 0));
                // Of fixed pressures nothing is added.
                let part = if self.condensed { width } else { 0 };
                let product = Product {
                    left: [gradients, &self.coupling[i * width..][..part]],
                    right: [&self.product, &self.recovery[j * width..][..part]],
                    columns: self.columns,
                    rows: self.nodes,
                    symmetric: i == j,
                };
                product.multiply(&mut self.blocks[begin..end], wide);
            }
        }
    }
}

/// Spatial gradients of the functions of a column of nodes.
#[inline(always)]
fn spatial<const C: usize, const D: usize>(
    states: &[PointStates],
    slopes: &[Lanes],
    values: &[Lanes],
    gradients: &mut [Lanes],
) {
    let (slopes, _) = slopes.as_chunks::<C>();
    let (gradients, _) = gradients.as_chunks_mut::<D>();
    let points = slopes.iter().zip(values).zip(gradients);
    for (point, ((slope, value), gradient)) in points.enumerate() {
        let back = &states[point / Lanes::COUNT].back;
        let lane = point % Lanes::COUNT;
        for k in 0..C {
            let mut sum = ZERO;
            for m in 0..C {
                sum = slope[m].times_plus(back[m][k].0[lane], sum);
            }
            gradient[k] = sum;
        }
        if D > C {
            gradient[2] = value.times_plus(back[2][2].0[lane], ZERO);
        }
    }
}

type Forces<const C: usize> = ([Lanes; C], [[Lanes; MAX_PRESSURES]; C]);

/// Forces on a column of nodes and their dependence on the pressure.
#[inline(always)]
fn forces<const C: usize, const D: usize>(
    states: &[PointStates],
    gradients: &[Lanes],
) -> Forces<C> {
    let mut force = [ZERO; C];
    let mut coupling = [[ZERO; MAX_PRESSURES]; C];
    let (gradients, _) = gradients.as_chunks::<D>();
    for (point, gradient) in gradients.iter().enumerate() {
        let state = &states[point / Lanes::COUNT];
        let lane = point % Lanes::COUNT;
        for i in 0..C {
            for k in 0..C {
                force[i] = gradient[k].times_plus(state.stress[PLACE[i][k]].0[lane], force[i]);
            }
            for m in 0..MAX_PRESSURES {
                coupling[i][m] = gradient[i].times_plus(state.volume[m].0[lane], coupling[i][m]);
            }
        }
        // The hoop.
        if D > C {
            force[0] = gradient[2].times_plus(state.stress[2].0[lane], force[0]);
            for m in 0..MAX_PRESSURES {
                coupling[0][m] = gradient[2].times_plus(state.volume[m].0[lane], coupling[0][m]);
            }
        }
    }
    (force, coupling)
}

/// Gradients times the moduli of a block.
#[inline(always)]
fn weigh<const D: usize>(
    moduli: &[Moduli],
    block: usize,
    points: usize,
    gradients: &[Lanes],
    product: &mut [Lanes],
) {
    let columns = gradients.chunks_exact(points * D);
    for (gradients, product) in columns.zip(product.chunks_exact_mut(points * D)) {
        let (gradients, _) = gradients.as_chunks::<D>();
        let (product, _) = product.as_chunks_mut::<D>();
        for (point, (gradient, product)) in gradients.iter().zip(product).enumerate() {
            let moduli = &moduli[point / Lanes::COUNT][block];
            let lane = point % Lanes::COUNT;
            for k in 0..D {
                let mut sum = ZERO;
                for l in 0..D {
                    sum = gradient[l].times_plus(moduli[k * 3 + l].0[lane], sum);
                }
                product[k] = sum;
            }
        }
    }
}

/// `sum of left' right` over two pairs of matrices of `columns` columns each.
struct Product<'a> {
    left: [&'a [Lanes]; 2],
    right: [&'a [Lanes]; 2],
    columns: usize,
    rows: usize,
    /// The product is symmetric; what stands left of its diagonal is not wanted.
    symmetric: bool,
}

impl Product<'_> {
    /// In panels of some rows that stay in registers.
    #[inline(always)]
    fn multiply(&self, target: &mut [f64], wide: bool) {
        let mut row = 0;
        while row < self.rows {
            let mut column = if self.symmetric {
                row / Lanes::COUNT
            } else {
                0
            };
            while column < self.columns {
                column += match self.columns - column {
                    4 if wide => self.panel::<4>(target, row, column),
                    3 if wide => self.panel::<3>(target, row, column),
                    2 if wide => self.panel::<2>(target, row, column),
                    _ => self.panel::<1>(target, row, column),
                };
            }
            row += ROWS;
        }
    }

    /// One panel; its width.
    #[inline(always)]
    fn panel<const WIDE: usize>(&self, target: &mut [f64], row: usize, column: usize) -> usize {
        let (group, half) = (row / Lanes::COUNT, row % Lanes::COUNT / ROWS);
        let mut panel = [[ZERO; WIDE]; ROWS];
        let mut pair = 0;
        while pair < 2 {
            let depth = self.left[pair].len() / self.columns;
            let left = &self.left[pair][group * depth..][..depth];
            let mut right = [left; WIDE];
            let mut c = 0;
            while c < WIDE {
                right[c] = &self.right[pair][(column + c) * depth..][..depth];
                c += 1;
            }
            let mut at = 0;
            while at < depth {
                let factors = &left[at].0.as_chunks::<ROWS>().0[half];
                let mut r = 0;
                while r < ROWS {
                    let mut c = 0;
                    while c < WIDE {
                        panel[r][c] = right[c][at].times_plus(factors[r], panel[r][c]);
                        c += 1;
                    }
                    r += 1;
                }
                at += 1;
            }
            pair += 1;
        }
        // Whole arrays: a copy of slices would be a call, and keep the panel in memory.
        let (target, _) = target.as_chunks_mut::<{ Lanes::COUNT }>();
        let mut r = 0;
        while r < ROWS {
            let mut c = 0;
            while c < WIDE {
                target[(row + r) * self.columns + column + c] = panel[r][c].0;
                c += 1;
            }
            r += 1;
        }
        WIDE
    }
}
