//! The tangent of a hexahedron by sum factorisation.
//!
//! Functions and points of the cell are products over its three directions, and so is the sum
//! over the points in
//!
//! ```text
//! K_ab = sum_q sum_mn d_m N_a(q) D_mn(q) d_n N_b(q)
//! ```
//!
//! with moduli `D` between the directions of the reference cell. One direction after another is
//! summed, for the nine pairs of functions on its line: 2 x 17 500 operations for a block of
//! components where all points for each pair of nodes take 2 x 59 000 (Orszag 1980). The six blocks
//! of components stand side by side in the lanes.

use super::{MAX_PRESSURES, Moduli, PointStates, ZERO};
use crate::mesh::CellShape;
use crate::scalar::{Lanes, Tensor};

/// Nodes, and points, of the cell.
const COUNT: usize = 27;
/// Pairs of functions, or of places, on a line.
const PAIRS: usize = 9;
/// Components of a block.
const COMPONENTS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// Tables and work space.
pub(super) struct Factored {
    /// Products of two functions on a line: which of the two are slopes (1 the first, 2 the
    /// second), point, pair.
    lines: [[[f64; PAIRS]; 3]; 4],
    /// Number of the node at a place, the last direction fastest.
    nodes: [usize; COUNT],
    /// Moduli by pair of directions and point.
    moduli: Vec<Lanes>,
    /// Coupling with the pressures and what eliminates it, by node and pressure.
    coupling: [Vec<Lanes>; 2],
    /// Entries by pair of nodes.
    pairs: Vec<Lanes>,
}

impl Factored {
    pub(super) fn new() -> Self {
        // The functions on a line are those of the nodes along an edge of the cell.
        let along = |node: usize| CellShape::Hex27.node_at(node).map(|x| x.round() as i8);
        let mut nodes = [0; COUNT];
        for node in 0..COUNT {
            let [x, y, z] = along(node).map(|x| (x + 1) as usize);
            nodes[(x * 3 + y) * 3 + z] = node;
        }
        let mut lines = [[[0.0; PAIRS]; 3]; 4];
        for (q, point) in CellShape::Hex27.quadrature()[..3].iter().enumerate() {
            let x = point.at[2];
            let values = [x * (x - 1.0) / 2.0, 1.0 - x * x, x * (x + 1.0) / 2.0];
            let slopes = [x - 0.5, -2.0 * x, x + 0.5];
            for pair in 0..PAIRS {
                let (a, b) = (pair / 3, pair % 3);
                lines[0][q][pair] = values[a] * values[b];
                lines[1][q][pair] = slopes[a] * values[b];
                lines[2][q][pair] = values[a] * slopes[b];
                lines[3][q][pair] = slopes[a] * slopes[b];
            }
        }
        Self {
            lines,
            nodes,
            moduli: vec![ZERO; PAIRS * COUNT],
            coupling: [(); 2].map(|()| vec![ZERO; COUNT * MAX_PRESSURES]),
            pairs: vec![ZERO; COUNT * COUNT],
        }
    }

    /// Entries by pair of nodes, each with its blocks of components.
    pub(super) fn pairs(&self) -> &[Lanes] {
        &self.pairs
    }

    /// Takes the moduli of the points to the directions of the reference cell, and from points
    /// side by side to blocks side by side.
    #[inline(always)]
    pub(super) fn take_moduli(&mut self, states: &[PointStates], moduli: &[Moduli]) {
        for (group, (state, moduli)) in states.iter().zip(moduli).enumerate() {
            let first = group * Lanes::COUNT;
            let mut block = 0;
            while block < COMPONENTS.len() {
                let turned = turned(&state.back, &moduli[block]);
                let mut pair = 0;
                while pair < PAIRS {
                    let points = &mut self.moduli[pair * COUNT..][..COUNT];
                    let mut lane = 0;
                    while lane < Lanes::COUNT {
                        if first + lane < COUNT {
                            points[first + lane].0[block] = turned[pair].0[lane];
                        }
                        lane += 1;
                    }
                    pair += 1;
                }
                block += 1;
            }
        }
    }

    /// Takes the coupling of displacements with pressures, and the pressures by displacements;
    /// both by component, column of nodes and pressure.
    #[inline(always)]
    pub(super) fn take_coupling(&mut self, coupling: &[Lanes], recovery: &[Lanes]) {
        let width = COUNT.div_ceil(Lanes::COUNT) * MAX_PRESSURES;
        let [left, right] = &mut self.coupling;
        for node in 0..COUNT {
            let (column, place) = (node / Lanes::COUNT, node % Lanes::COUNT);
            for m in 0..MAX_PRESSURES {
                let at = column * MAX_PRESSURES + m;
                let (mut one, mut other) = (ZERO, ZERO);
                let mut block = 0;
                while block < COMPONENTS.len() {
                    let (i, j) = COMPONENTS[block];
                    one.0[block] = coupling[i * width + at].0[place];
                    other.0[block] = recovery[j * width + at].0[place];
                    block += 1;
                }
                left[node * MAX_PRESSURES + m] = one;
                right[node * MAX_PRESSURES + m] = other;
            }
        }
    }

    /// Takes no coupling: pressures are fixed.
    pub(super) fn drop_coupling(&mut self) {
        for part in &mut self.coupling {
            part.fill(ZERO);
        }
    }

    /// All entries.
    #[inline(always)]
    pub(super) fn multiply(&mut self) {
        let [left, right] = &self.coupling;
        let (left, _) = left.as_chunks::<MAX_PRESSURES>();
        let (right, _) = right.as_chunks::<MAX_PRESSURES>();
        let mut first = [[ZERO; PAIRS]; PAIRS];
        for x in 0..PAIRS {
            let mut pair = 0;
            while pair < PAIRS {
                first[pair] = self.sum_first(pair, x);
                pair += 1;
            }
            for y in 0..PAIRS {
                let second = self.sum_second(&first, y);
                let third = self.sum_third(&second);
                let (a, b) = ((x / 3 * 3 + y / 3) * 3, (x % 3 * 3 + y % 3) * 3);
                let mut z = 0;
                while z < PAIRS {
                    let (a, b) = (self.nodes[a + z / 3], self.nodes[b + z % 3]);
                    let mut entry = third[z];
                    let mut m = 0;
                    while m < MAX_PRESSURES {
                        entry = left[a][m].fused(right[b][m], entry);
                        m += 1;
                    }
                    self.pairs[a * COUNT + b] = entry;
                    z += 1;
                }
            }
        }
    }

    /// Sums over the points of the first direction: a pair of directions and the pair of functions,
    /// by the points of the other two.
    #[inline(always)]
    fn sum_first(&self, directions: usize, x: usize) -> [Lanes; PAIRS] {
        let line = &self.lines[kind(0, directions)];
        let (points, _) = self.moduli[directions * COUNT..][..COUNT].as_chunks::<PAIRS>();
        let mut sums = [ZERO; PAIRS];
        let mut r = 0;
        while r < PAIRS {
            let mut q = 0;
            while q < 3 {
                sums[r] = points[q][r].times_plus(line[q][x], sums[r]);
                q += 1;
            }
            r += 1;
        }
        sums
    }

    /// Sums over the points of the second direction, by which functions of the third are slopes
    /// and its points.
    #[inline(always)]
    fn sum_second(&self, first: &[[Lanes; PAIRS]; PAIRS], y: usize) -> [[Lanes; 3]; 4] {
        let mut sums = [[ZERO; 3]; 4];
        self.add_second::<0>(first, y, &mut sums);
        self.add_second::<1>(first, y, &mut sums);
        self.add_second::<2>(first, y, &mut sums);
        self.add_second::<3>(first, y, &mut sums);
        self.add_second::<4>(first, y, &mut sums);
        self.add_second::<5>(first, y, &mut sums);
        self.add_second::<6>(first, y, &mut sums);
        self.add_second::<7>(first, y, &mut sums);
        self.add_second::<8>(first, y, &mut sums);
        sums
    }

    /// The part of a pair of directions: which sum it goes to is known to the compiler.
    #[inline(always)]
    fn add_second<const DIRECTIONS: usize>(
        &self,
        first: &[[Lanes; PAIRS]; PAIRS],
        y: usize,
        sums: &mut [[Lanes; 3]; 4],
    ) {
        let line = &self.lines[kind(1, DIRECTIONS)];
        let third = kind(2, DIRECTIONS);
        let mut q = 0;
        while q < 3 {
            let factor = line[q][y];
            let mut r = 0;
            while r < 3 {
                let own = first[DIRECTIONS][q * 3 + r];
                sums[third][r] = own.times_plus(factor, sums[third][r]);
                r += 1;
            }
            q += 1;
        }
    }

    /// Sums over the points of the third direction, by the pair of functions.
    #[inline(always)]
    fn sum_third(&self, second: &[[Lanes; 3]; 4]) -> [Lanes; PAIRS] {
        let mut sums = [ZERO; PAIRS];
        let mut kind = 0;
        while kind < 4 {
            let mut q = 0;
            while q < 3 {
                let mut z = 0;
                while z < PAIRS {
                    sums[z] = second[kind][q].times_plus(self.lines[kind][q][z], sums[z]);
                    z += 1;
                }
                q += 1;
            }
            kind += 1;
        }
        sums
    }
}

/// Which of two functions on the line of a direction are slopes, for a pair of directions of
/// the moduli.
#[inline(always)]
const fn kind(direction: usize, pair: usize) -> usize {
    (pair / 3 == direction) as usize + 2 * (pair % 3 == direction) as usize
}

/// `H^-1 c H^-T`, by pair of directions.
#[inline(always)]
fn turned(back: &Tensor<Lanes>, moduli: &[Lanes; PAIRS]) -> [Lanes; PAIRS] {
    let mut half = [ZERO; PAIRS];
    let mut whole = [ZERO; PAIRS];
    let mut m = 0;
    while m < 3 {
        let mut l = 0;
        while l < 3 {
            let mut sum = back[m][0] * moduli[l];
            sum = back[m][1].fused(moduli[3 + l], sum);
            half[m * 3 + l] = back[m][2].fused(moduli[6 + l], sum);
            l += 1;
        }
        let mut n = 0;
        while n < 3 {
            let mut sum = half[m * 3] * back[n][0];
            sum = half[m * 3 + 1].fused(back[n][1], sum);
            whole[m * 3 + n] = half[m * 3 + 2].fused(back[n][2], sum);
            n += 1;
        }
        m += 1;
    }
    whole
}
