//! The numbers of the factor, front by front. A front takes the entries of its columns
//! and what its children left, eliminates its unknowns, and leaves the rest to its
//! parent. Its columns stand in strips of 8 rows, column by column, and so do the tiles
//! of the rest: every product reads and writes memory in order.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use super::Pattern;
use super::analysis::{Analysis, Front, triangle};
use super::tiles::{self, EMPTY, SIDE, Tile, ZERO};
use crate::scalar::Lanes;

/// The factor `L` of `L L'`, its diagonal as reciprocals, with the memory to renew it.
pub(super) struct Factor {
    pub(super) values: Vec<Lanes>,
    stacks: [Vec<Lanes>; 2],
    /// Columns of the present front before its elimination: small ones stay in the
    /// cache.
    columns: Vec<Lanes>,
    /// Where each row stands in it.
    local: Vec<u32>,
    /// Its triangles, complete.
    triangles: Vec<Tile>,
}

impl Factor {
    /// None when it does not fit in memory.
    pub(super) fn new(analysis: &Analysis, unknowns: usize) -> Option<Self> {
        let largest = analysis.fronts.iter().map(Front::size).max().unwrap_or(0);
        let widest = analysis.fronts.iter().map(Front::pivot_strips).max();
        // Places in a front are counted in 32 bits.
        u32::try_from(largest * SIDE).ok()?;
        let [even, odd] = analysis.stacks;
        Some(Self {
            values: zeros(analysis.values)?,
            stacks: [zeros(even)?, zeros(odd)?],
            columns: zeros(largest)?,
            local: vec![0; unknowns],
            triangles: vec![EMPTY; widest.unwrap_or(0)],
        })
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

fn zeros(count: usize) -> Option<Vec<Lanes>> {
    let mut columns = Vec::new();
    columns.try_reserve_exact(count).ok()?;
    columns.resize(count, ZERO);
    Some(columns)
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
            columns,
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
                columns: &mut columns[..front.size()],
                rest: &mut own[front.update..][..front.update_size()],
            };
            let children = analysis.children(front).iter().map(|&child| {
                let child = &analysis.fronts[child as usize];
                let left = &below[child.update..][..child.update_size()];
                (left, analysis.places(child))
            });
            // As a loop it is compiled for wide registers.
            for column in parts.columns.iter_mut() {
                *column = ZERO;
            }
            parts.take_entries(analysis.indices(front), pattern, values, local);
            for (left, places) in children.clone() {
                parts.take_columns(simd, left, places);
            }
            let factor = &mut all[front.values..][..front.size()];
            if !parts.eliminate(simd, factor, triangles) {
                return false;
            }
            for (left, places) in children {
                parts.take_rest(simd, left, places);
            }
        }
        true
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

    /// Adds the remainder of a child on unknowns of this front, by its rows here.
    #[inline(always)]
    fn take_columns<S: Simd>(&mut self, simd: S, left: &[Lanes], places: &[u32]) {
        let width = self.width;
        let unknowns = places.partition_point(|&place| (place as usize) < width);
        let begin = |row: usize| row / SIDE * width;
        add(simd, left, places, 0..unknowns, 0, begin, self.columns);
    }

    /// Adds the remainder of a child on rows of this front.
    #[inline(always)]
    fn take_rest<S: Simd>(&mut self, simd: S, left: &[Lanes], places: &[u32]) {
        let width = self.width;
        let unknowns = places.partition_point(|&place| (place as usize) < width);
        let below = width.next_multiple_of(SIDE);
        let begin = |row: usize| triangle(row.saturating_sub(below) / SIDE);
        let rows = unknowns..places.len();
        add(simd, left, places, rows, below, begin, self.rest);
    }

    /// Eliminates the unknowns; false when a pivot is not positive.
    #[inline(always)]
    fn eliminate<S: Simd>(
        &mut self,
        simd: S,
        factor: &mut [Lanes],
        triangles: &mut [Tile],
    ) -> bool {
        let width = self.width;
        let strips = width.div_ceil(SIDE);
        let (top, bottom) = factor.split_at_mut(strips * width);
        let (known_top, known) = self.columns.split_at(strips * width);
        for first in (0..strips).step_by(3) {
            let (above, own) = top.split_at_mut(first * width);
            let group = own.len().min(3 * width);
            let (own, known) = (&mut own[..group], &known_top[first * width..][..group]);
            solve_all(simd, known, own, (above, &triangles[..first]), width);
            for number in first..strips.min(first + 3) {
                let (above, own) = own.split_at_mut((number - first) * width);
                let own = &mut own[..width];
                let known = &known_top[number * width..][..width];
                let above = (&*above, &triangles[first..number]);
                solve(simd, [known], &mut [&mut *own], above, first);
                let mut corner = [tiles::load(known, number)];
                tiles::subtract(simd, &mut corner, [own], &own[..number * SIDE]);
                if !tiles::pivots(simd, &mut corner[0], width - number * SIDE) {
                    return false;
                }
                triangles[number] = corner[0];
                tiles::store(own, number, &corner[0]);
            }
        }
        let triangles = &triangles[..strips];
        solve_all(simd, known, bottom, (top, triangles), width);
        leave(simd, bottom, width, self.rest);
        true
    }
}

/// Adds some columns of what a child left at the places of their rows. `begin` gives the
/// first column of the strip of a row in `target`, `offset` the place of its column 0.
#[inline(always)]
fn add<S: Simd>(
    simd: S,
    left: &[Lanes],
    places: &[u32],
    columns: Range<usize>,
    offset: usize,
    begin: impl Fn(usize) -> usize,
    target: &mut [Lanes],
) {
    let mut left = left;
    for (number, rows) in places.chunks(SIDE).enumerate() {
        let first = number * SIDE;
        let (strip, others) = left.split_at(first + SIDE);
        left = others;
        // Rows beyond the end hold zeros, and may go anywhere.
        let (mut lanes, mut begins) = ([0; SIDE], [0; SIDE]);
        for lane in 0..SIDE {
            let row = rows[lane.min(rows.len() - 1)] as usize;
            lanes[lane] = row % SIDE;
            begins[lane] = begin(row);
        }
        let whole = columns.start.min(first)..columns.end.min(first);
        let entries = places[whole.clone()].iter().zip(&strip[whole]);
        if S::F64_LANES == SIDE && rows.len() == SIDE && rows[SIDE - 1] - rows[0] == 7 {
            // Neighbours stay neighbours: they go to two strips at once.
            let (upper, lower) = tiles::masks(lanes[0]);
            for (&column, entries) in entries {
                let column = column as usize - offset;
                let turned = tiles::turned(simd, entries, lanes[0]);
                let one = &mut target[begins[0] + column];
                *one = *one + turned * upper;
                let other = &mut target[begins[SIDE - 1] + column];
                *other = *other + turned * lower;
            }
        } else {
            for (&column, entries) in entries {
                let column = column as usize - offset;
                for lane in 0..SIDE {
                    target[begins[lane] + column].0[lanes[lane]] += entries.0[lane];
                }
            }
        }
        // Of the last tile the lower half.
        for number in columns.start.max(first)..columns.end.min(first + rows.len()) {
            let column = places[number] as usize - offset;
            for lane in number - first..rows.len() {
                target[begins[lane] + column].0[lanes[lane]] += strip[number].0[lane];
            }
        }
    }
}

/// Solves rows of the factor with the rows above and their triangles.
#[inline(always)]
fn solve_all<S: Simd>(
    simd: S,
    known: &[Lanes],
    strips: &mut [Lanes],
    above: (&[Lanes], &[Tile]),
    width: usize,
) {
    let mut threes = strips.chunks_exact_mut(3 * width);
    let mut known = known.chunks_exact(width);
    for three in &mut threes {
        let (one, others) = three.split_at_mut(width);
        let (two, three) = others.split_at_mut(width);
        let mut next = || known.next().unwrap_or_default();
        let known = [next(), next(), next()];
        solve(simd, known, &mut [one, two, three], above, 0);
    }
    for (own, known) in threes.into_remainder().chunks_exact_mut(width).zip(known) {
        solve(simd, [known], &mut [own], above, 0);
    }
}

/// The same for some strips at once, with the triangles from `first` on.
#[inline(always)]
fn solve<S: Simd, const STRIPS: usize>(
    simd: S,
    known: [&[Lanes]; STRIPS],
    strips: &mut [&mut [Lanes]; STRIPS],
    (above, triangles): (&[Lanes], &[Tile]),
    first: usize,
) {
    let width = known[0].len();
    for (number, triangle) in triangles.iter().enumerate() {
        let right = &above[number * width..][..(first + number) * SIDE];
        let mut parts = [EMPTY; STRIPS];
        let mut left = [right; STRIPS];
        for s in 0..STRIPS {
            parts[s] = tiles::load(known[s], first + number);
            left[s] = &*strips[s];
        }
        tiles::subtract(simd, &mut parts, left, right);
        tiles::divide(simd, &mut parts, triangle);
        for s in 0..STRIPS {
            tiles::store(strips[s], first + number, &parts[s]);
        }
    }
}

/// Leaves the products of the rows below to the parent, their signs changed.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_registers_give_the_same_factor() {
        // Two dense parts that a third one joins.
        let (n, part) = (177u32, 59);
        let mut pattern = Pattern {
            column_starts: vec![0],
            rows: Vec::new(),
        };
        let mut values = Vec::new();
        for column in 0..n {
            for row in column..n {
                if row / part == column / part || row >= 2 * part {
                    pattern.rows.push(row);
                    values.push(if row == column {
                        f64::from(n)
                    } else {
                        f64::from(row * column).sin()
                    });
                }
            }
            pattern.column_starts.push(pattern.rows.len() as u32);
        }
        let analysis = Analysis::of(&pattern);
        assert!(analysis.fronts.len() > 1);
        let factors = [true, false].map(|wide| {
            let mut factor = Factor::new(&analysis, n as usize).unwrap();
            let positive = if wide {
                factor.renew(&analysis, &pattern, &values)
            } else {
                let renewal = Renewal {
                    factor: &mut factor,
                    analysis: &analysis,
                    pattern: &pattern,
                    values: &values,
                };
                renewal.with_simd(pulp::Scalar)
            };
            assert!(positive);
            factor.values
        });
        for (wide, narrow) in factors[0].iter().zip(&factors[1]) {
            for lane in 0..SIDE {
                // Rounding of sums of at most 177 products, entries of at most 14.
                assert!((wide.0[lane] - narrow.0[lane]).abs() < 1e-12);
            }
        }
    }
}
