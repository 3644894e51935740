//! The numbers of the factor, front by front. A front takes the entries of its columns
//! and what its children left, eliminates its unknowns, and leaves the rest to its
//! parent. Its columns stand in strips of 8 rows, column by column, and so do the tiles
//! of the rest: every product reads and writes memory in order.

use pulp::{Simd, WithSimd};

use super::Pattern;
use super::analysis::{Analysis, Front, triangle};
use super::tiles::{self, EMPTY, SIDE, Tile, ZERO};
use crate::scalar::Lanes;

/// The factor `L` of `L L'`, its diagonal as reciprocals, with the memory to renew it.
pub(super) struct Factor {
    pub(super) values: Vec<Lanes>,
    stacks: [Vec<Lanes>; 2],
    /// Where each row stands in the present front.
    local: Vec<u32>,
    /// Triangles of the present front, complete.
    triangles: Vec<Tile>,
}

impl Factor {
    pub(super) fn new(analysis: &Analysis, unknowns: usize) -> Self {
        let widest = analysis.fronts.iter().map(Front::pivot_strips).max();
        Self {
            values: vec![ZERO; analysis.values],
            stacks: analysis.stacks.map(|size| vec![ZERO; size]),
            local: vec![0; unknowns],
            triangles: vec![EMPTY; widest.unwrap_or(0)],
        }
    }

    /// Factorises the matrix of these values; false when it is not positive definite.
    pub(super) fn renew(&mut self, analysis: &Analysis, pattern: &Pattern, values: &[f64]) -> bool {
        pulp::Arch::new().dispatch(Renewal {
            factor: self,
            analysis,
            pattern,
            values,
        })
    }
}

struct Renewal<'a> {
    factor: &'a mut Factor,
    analysis: &'a Analysis,
    pattern: &'a Pattern,
    values: &'a [f64],
}

impl WithSimd for Renewal<'_> {
    type Output = bool;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self {
            factor,
            analysis,
            pattern,
            values,
        } = self;
        let Factor {
            values: all,
            stacks,
            local,
            triangles,
        } = factor;
        for front in &analysis.fronts {
            let [even, odd] = stacks;
            let (own, below) = if front.stack == 0 {
                (even, &*odd)
            } else {
                (odd, &*even)
            };
            let mut parts = Parts {
                width: front.width,
                columns: &mut all[front.values..][..front.size()],
                rest: &mut own[front.update..][..front.update_size()],
            };
            clear(parts.columns);
            clear(parts.rest);
            parts.take_entries(analysis.indices(front), pattern, values, local);
            for &child in analysis.children(front) {
                let child = &analysis.fronts[child as usize];
                let left = &below[child.update..][..child.update_size()];
                parts.take_child(left, analysis.places(child));
            }
            if !parts.eliminate(simd, triangles) {
                return false;
            }
        }
        true
    }
}

/// `fill` would be a call that knows no wide registers.
#[inline(always)]
fn clear(columns: &mut [Lanes]) {
    for column in columns {
        *column = ZERO;
    }
}

/// Numbers of the present front.
struct Parts<'a> {
    width: usize,
    columns: &'a mut [Lanes],
    rest: &'a mut [Lanes],
}

impl Parts<'_> {
    /// Entries of the matrix.
    #[inline(always)]
    fn take_entries(
        &mut self,
        (columns, rows): (&[u32], &[u32]),
        pattern: &Pattern,
        values: &[f64],
        local: &mut [u32],
    ) {
        let below = self.width.next_multiple_of(SIDE);
        for (number, &column) in columns.iter().enumerate() {
            local[column as usize] = self.place(number);
        }
        for (number, &row) in rows.iter().enumerate() {
            local[row as usize] = self.place(below + number);
        }
        for (number, &column) in columns.iter().enumerate() {
            let entries = pattern.column(column as usize);
            for (&row, value) in pattern.rows[entries.clone()].iter().zip(&values[entries]) {
                let place = local[row as usize] as usize;
                self.columns[place / SIDE + number].0[place % SIDE] = *value;
            }
        }
    }

    /// First entry of a row of the front.
    #[inline(always)]
    fn place(&self, row: usize) -> u32 {
        (row / SIDE * self.width * SIDE + row % SIDE) as u32
    }

    /// What a child left, by the places of its rows here.
    #[inline(always)]
    fn take_child(&mut self, left: &[Lanes], places: &[u32]) {
        let below = self.width.next_multiple_of(SIDE);
        let unknowns = places.partition_point(|&place| (place as usize) < self.width);
        let mut left = left;
        for (number, rows) in places.chunks(SIDE).enumerate() {
            let first = number * SIDE;
            let (strip, others) = left.split_at(first + SIDE);
            left = others;
            // Rows beyond the end hold zeros, and may go anywhere.
            let mut target = [[0usize; SIDE]; 3];
            for lane in 0..SIDE {
                let row = rows[lane.min(rows.len() - 1)] as usize;
                let inner = row.saturating_sub(below);
                target[0][lane] = row % SIDE;
                target[1][lane] = row / SIDE * self.width;
                target[2][lane] = triangle(inner / SIDE);
            }
            let [lanes, outer, inner] = target;
            let early = unknowns.min(first);
            for (&column, entries) in places[..early].iter().zip(strip) {
                let column = column as usize;
                for lane in 0..SIDE {
                    self.columns[outer[lane] + column].0[lanes[lane]] += entries.0[lane];
                }
            }
            for (&column, entries) in places[early..first].iter().zip(&strip[early..]) {
                let column = column as usize - below;
                for lane in 0..SIDE {
                    self.rest[inner[lane] + column].0[lanes[lane]] += entries.0[lane];
                }
            }
            for (corner, &column) in rows.iter().enumerate() {
                let column = column as usize;
                for lane in corner..rows.len() {
                    let value = strip[first + corner].0[lane];
                    if column < self.width {
                        self.columns[outer[lane] + column].0[lanes[lane]] += value;
                    } else {
                        self.rest[inner[lane] + column - below].0[lanes[lane]] += value;
                    }
                }
            }
        }
    }

    /// Eliminates the unknowns; false when a pivot is not positive.
    #[inline(always)]
    fn eliminate<S: Simd>(&mut self, simd: S, triangles: &mut [Tile]) -> bool {
        let width = self.width;
        let strips = width.div_ceil(SIDE);
        let (top, bottom) = self.columns.split_at_mut(strips * width);
        for first in (0..strips).step_by(3) {
            let (above, own) = top.split_at_mut(first * width);
            let group = own.len().min(3 * width);
            let own = &mut own[..group];
            solve_all(simd, own, above, &triangles[..first], 0, width);
            for number in first..strips.min(first + 3) {
                let (above, own) = own.split_at_mut((number - first) * width);
                let own = &mut own[..width];
                solve(simd, [&mut *own], above, &triangles[first..number], first, width);
                let mut corner = [tiles::load(own, number)];
                tiles::subtract(simd, &mut corner, [own], &own[..number * SIDE]);
                if !tiles::pivots(simd, &mut corner[0], width - number * SIDE) {
                    return false;
                }
                triangles[number] = corner[0];
                tiles::store(own, number, &corner[0]);
            }
        }
        let triangles = &triangles[..strips];
        solve_all(simd, bottom, top, triangles, 0, width);
        leave(simd, bottom, width, self.rest);
        true
    }
}

/// Solves rows of the factor with the triangles of the front from `first` on; `above`
/// begins with their rows.
#[inline(always)]
fn solve_all<S: Simd>(
    simd: S,
    strips: &mut [Lanes],
    above: &[Lanes],
    triangles: &[Tile],
    first: usize,
    width: usize,
) {
    let mut threes = strips.chunks_exact_mut(3 * width);
    for three in &mut threes {
        let (one, others) = three.split_at_mut(width);
        let (two, three) = others.split_at_mut(width);
        solve(simd, [one, two, three], above, triangles, first, width);
    }
    for own in threes.into_remainder().chunks_exact_mut(width) {
        solve(simd, [own], above, triangles, first, width);
    }
}

/// The same for some strips at once.
#[inline(always)]
fn solve<S: Simd, const STRIPS: usize>(
    simd: S,
    strips: [&mut [Lanes]; STRIPS],
    above: &[Lanes],
    triangles: &[Tile],
    first: usize,
    width: usize,
) {
    for (number, triangle) in triangles.iter().enumerate() {
        let right = &above[number * width..][..(first + number) * SIDE];
        let mut parts = [EMPTY; STRIPS];
        let mut left = [right; STRIPS];
        for s in 0..STRIPS {
            parts[s] = tiles::load(strips[s], first + number);
            left[s] = &*strips[s];
        }
        tiles::subtract(simd, &mut parts, left, right);
        tiles::divide(simd, &mut parts, triangle);
        for s in 0..STRIPS {
            tiles::store(strips[s], first + number, &parts[s]);
        }
    }
}

/// Takes the products of the rows below off what is left to the parent.
#[inline(always)]
fn leave<S: Simd>(simd: S, strips: &[Lanes], width: usize, rest: &mut [Lanes]) {
    let count = strips.len() / width;
    let (rest, _) = rest.as_chunks_mut::<SIDE>();
    let mut first = 0;
    while first + 3 <= count {
        for column in 0..=first {
            let right = &strips[column * width..][..width];
            products::<S, 3>(simd, strips, first, right, column, rest);
        }
        let right = &strips[(first + 1) * width..][..width];
        products::<S, 2>(simd, strips, first + 1, right, first + 1, rest);
        let right = &strips[(first + 2) * width..][..width];
        products::<S, 1>(simd, strips, first + 2, right, first + 2, rest);
        first += 3;
    }
    for row in first..count {
        for column in 0..=row {
            let right = &strips[column * width..][..width];
            products::<S, 1>(simd, strips, row, right, column, rest);
        }
    }
}

/// The same for tiles of one column.
#[inline(always)]
fn products<S: Simd, const TILES: usize>(
    simd: S,
    strips: &[Lanes],
    first: usize,
    right: &[Lanes],
    column: usize,
    rest: &mut [Tile],
) {
    let mut parts = [EMPTY; TILES];
    let mut left = [right; TILES];
    let mut t = 0;
    while t < TILES {
        let row = first + t;
        parts[t] = rest[row * (row + 1) / 2 + column];
        left[t] = &strips[row * right.len()..][..right.len()];
        t += 1;
    }
    tiles::subtract(simd, &mut parts, left, right);
    let mut t = 0;
    while t < TILES {
        let row = first + t;
        rest[row * (row + 1) / 2 + column] = parts[t];
        t += 1;
    }
}
