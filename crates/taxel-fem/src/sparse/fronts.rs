//! The numbers of the factor, front by front. A front takes the entries of its columns
//! and what its children left, eliminates its unknowns, and leaves the rest to its
//! parent. Its columns stand in strips of 8 rows, column by column, and so do the tiles
//! of the rest: every product reads and writes memory in order.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use pulp::{Simd, WithSimd};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::Pattern;
use super::analysis::{Analysis, Front, PANEL, Part, triangle};
use super::tiles::{self, EMPTY, SIDE, Tile, ZERO};
use crate::scalar::Lanes;

/// The factor `L` of `L L'`, its diagonal as reciprocals, with the memory to renew it.
pub(super) struct Factor {
    pub(super) values: Vec<Lanes>,
    /// Of each branch.
    branches: Vec<Work>,
    /// Of what is above.
    top: Work,
    /// Threads that share the branches. They are its own: a thread that waits for them does no
    /// work of others meanwhile, whatever it may have locked.
    pool: Option<ThreadPool>,
}

/// Memory to work through a part of the tree.
struct Work {
    stacks: [Vec<Lanes>; 2],
    /// Columns of the present front before its elimination: small ones stay in the
    /// cache.
    columns: Vec<Lanes>,
    /// Where each row stands in it.
    local: Vec<u32>,
    /// Its triangles, complete.
    triangles: Vec<Tile>,
}

impl Work {
    /// None when it does not fit in memory.
    fn new(part: &Part, unknowns: usize) -> Option<Self> {
        // Places in a front are counted in 32 bits.
        u32::try_from(part.largest * SIDE).ok()?;
        let [even, odd] = part.stacks;
        Some(Self {
            stacks: [zeros(even)?, zeros(odd)?],
            columns: zeros(part.largest)?,
            local: vec![0; unknowns],
            triangles: vec![EMPTY; part.widest],
        })
    }
}

/// The matrix and its analysis.
#[derive(Clone, Copy)]
struct Matrix<'a> {
    analysis: &'a Analysis,
    pattern: &'a Pattern,
    values: &'a [f64],
}

impl Factor {
    /// None when it does not fit in memory.
    pub(super) fn new(analysis: &Analysis, unknowns: usize, threads: usize) -> Option<Self> {
        let branches = analysis.branches.iter();
        let threads = ThreadPoolBuilder::new().num_threads(threads);
        // Without threads the branches come one after the other.
        let pool = (!analysis.branches.is_empty()).then(|| threads.build().ok());
        Some(Self {
            pool: pool.flatten(),
            values: zeros(analysis.values)?,
            branches: branches
                .map(|part| Work::new(part, unknowns))
                .collect::<Option<_>>()?,
            top: Work::new(&analysis.top, unknowns)?,
        })
    }

    /// Factorises the matrix of these values; false when it is not positive definite. Threads
    /// share the branches, then the rows of each front above them; the order of all sums is the
    /// same for any number of threads. Among cases that threads share already it is one thread's.
    pub(super) fn renew(&mut self, analysis: &Analysis, pattern: &Pattern, values: &[f64]) -> bool {
        let matrix = Matrix {
            analysis,
            pattern,
            values,
        };
        match self.pool.take() {
            Some(pool) if rayon::current_thread_index().is_none() => {
                let done = pool.install(|| self.renew_parts(matrix, true));
                self.pool = Some(pool);
                done
            }
            pool => {
                self.pool = pool;
                self.renew_parts(matrix, false)
            }
        }
    }

    fn renew_parts(&mut self, matrix: Matrix<'_>, share: bool) -> bool {
        let analysis = matrix.analysis;
        if analysis.branches.is_empty() {
            // All fronts are the top's, in the order of their values.
            return pulp::Arch::new().dispatch(Renewal {
                matrix,
                part: &analysis.top,
                work: &mut self.top,
                values: &mut self.values,
            });
        }
        let (own, top) = divided(analysis, &mut self.values);
        let parts = analysis.branches.iter().zip(&mut self.branches).zip(own);
        let mut tasks = parts.map(|((part, work), values)| Renewal {
            matrix,
            part,
            work,
            values,
        });
        let positive = if share {
            let positive = AtomicBool::new(true);
            rayon::scope(|scope| {
                for task in tasks {
                    let positive = &positive;
                    scope.spawn(move |_| {
                        if !pulp::Arch::new().dispatch(task) {
                            positive.store(false, Ordering::Relaxed);
                        }
                    });
                }
            });
            positive.into_inner()
        } else {
            tasks.all(|task| pulp::Arch::new().dispatch(task))
        };
        positive
            && top.into_iter().all(|(number, values)| {
                let front = (&analysis.fronts[number], share);
                self.top.renew_front(matrix, front, &self.branches, values)
            })
    }
}

/// The values of each branch, and of each front of the top with its number.
type Divided<'a> = (Vec<&'a mut [Lanes]>, Vec<(usize, &'a mut [Lanes])>);

fn divided<'a>(analysis: &Analysis, values: &'a mut [Lanes]) -> Divided<'a> {
    let mut branches: Vec<&'a mut [Lanes]> = Vec::new();
    branches.resize_with(analysis.branches.len(), Default::default);
    let mut top = Vec::new();
    if branches.is_empty() {
        return (branches, top);
    }
    let mut rest = values;
    let mut number = 0;
    while number < analysis.fronts.len() {
        let branch = analysis.fronts[number].branch;
        let part = analysis.branches.get(branch as usize);
        let end = part.map_or(number + 1, |part| part.fronts.end);
        let size = analysis.fronts[number..end].iter().map(Front::size).sum();
        let (own, others) = rest.split_at_mut(size);
        rest = others;
        match branches.get_mut(branch as usize) {
            Some(slice) => *slice = own,
            None => top.push((number, own)),
        }
        number = end;
    }
    (branches, top)
}

fn zeros(count: usize) -> Option<Vec<Lanes>> {
    let mut columns = Vec::new();
    columns.try_reserve_exact(count).ok()?;
    columns.resize(count, ZERO);
    Some(columns)
}

/// A part of the tree by one thread.
struct Renewal<'a> {
    matrix: Matrix<'a>,
    part: &'a Part,
    work: &'a mut Work,
    values: &'a mut [Lanes],
}

impl WithSimd for Renewal<'_> {
    type Output = bool;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self {
            matrix,
            part,
            work,
            values: all,
        } = self;
        let analysis = matrix.analysis;
        let begin = analysis.fronts.get(part.fronts.start).map(|f| f.values);
        let begin = begin.unwrap_or(0);
        for front in &analysis.fronts[part.fronts.clone()] {
            let [even, odd] = &mut work.stacks;
            let (own, below) = if front.stack == 0 {
                (even, &*odd)
            } else {
                (odd, &*even)
            };
            let mut parts = Parts {
                width: front.width,
                columns: &mut work.columns[..front.size()],
                rest: &mut own[front.update..][..front.update_size()],
            };
            let children = analysis.children(front).iter().map(|&child| {
                let child = &analysis.fronts[child as usize];
                let left = &below[child.update..][..child.update_size()];
                (left, analysis.places(child))
            });
            parts.take(simd, matrix, front, &mut work.local, children.clone());
            let factor = &mut all[front.values - begin..][..front.size()];
            let (top, bottom) = factor.split_at_mut(front.pivot_strips() * front.width);
            let strips = front.pivot_strips();
            if !parts.eliminate(simd, top, &mut work.triangles, 0..strips) {
                return false;
            }
            let triangles = &work.triangles[..strips];
            let known = &parts.columns[strips * front.width..];
            solve_all(simd, known, bottom, (top, triangles), (front.width, 0));
            leave(simd, bottom, front.width, 0..front.row_strips(), parts.rest);
            for (left, places) in children {
                parts.take_rest(simd, left, places);
            }
        }
        true
    }
}

impl Work {
    /// A front above the branches, its rows shared by all threads or not.
    fn renew_front(
        &mut self,
        matrix: Matrix<'_>,
        (front, share): (&Front, bool),
        branches: &[Self],
        factor: &mut [Lanes],
    ) -> bool {
        let analysis = matrix.analysis;
        let [even, odd] = &mut self.stacks;
        let (own, below) = if front.stack == 0 {
            (even, &*odd)
        } else {
            (odd, &*even)
        };
        let children = analysis.children(front).iter().map(|&child| {
            let child = &analysis.fronts[child as usize];
            let stack = match branches.get(child.branch as usize) {
                Some(branch) => &branch.stacks[child.stack],
                None => below,
            };
            let left = &stack[child.update..][..child.update_size()];
            (left, analysis.places(child))
        });
        let children: Vec<Child<'_>> = children.collect();
        let mut parts = Parts {
            width: front.width,
            columns: &mut self.columns[..front.size()],
            rest: &mut own[front.update..][..front.update_size()],
        };
        let (width, strips) = (front.width, front.pivot_strips());
        let (top, bottom) = factor.split_at_mut(strips * width);
        pulp::Arch::new().dispatch(Head {
            matrix,
            front,
            parts: &mut parts,
            children: &children,
            local: &mut self.local,
        });
        let least = if share { STRIPS } else { usize::MAX };
        for start in (0..strips).step_by(PANEL) {
            let panel = start..strips.min(start + PANEL);
            let end = panel.end;
            let positive = pulp::Arch::new().dispatch(Panel {
                parts: &mut parts,
                triangles: &mut self.triangles,
                top: &mut *top,
                strips: panel,
            });
            if !positive {
                return false;
            }
            let (done, below) = top.split_at_mut(end * width);
            let above = (&done[start * width..], &self.triangles[start..end]);
            let known = &parts.columns[end * width..strips * width];
            solve_shared(known, below, above, (width, start, least));
        }
        let above = (&*top, &self.triangles[..strips]);
        let known = &parts.columns[strips * width..];
        solve_shared(known, bottom, above, (width, 0, least));
        let rows = 0..front.row_strips();
        leave_shared(bottom, rows, parts.rest, (width, least));
        pulp::Arch::new().dispatch(Tail {
            parts: &mut parts,
            children: &children,
        });
        true
    }
}

/// What a child left, and where its rows stand in its parent.
type Child<'a> = (&'a [Lanes], &'a [u32]);

/// Entries of a shared front.
struct Head<'a, 'p> {
    matrix: Matrix<'a>,
    front: &'a Front,
    parts: &'a mut Parts<'p>,
    children: &'a [Child<'a>],
    local: &'a mut [u32],
}

impl WithSimd for Head<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let children = self.children.iter().copied();
        self.parts
            .take(simd, self.matrix, self.front, self.local, children);
    }
}

/// Unknowns of a shared front that are eliminated before its other rows are solved with them.
struct Panel<'a, 'p> {
    parts: &'a mut Parts<'p>,
    triangles: &'a mut [Tile],
    top: &'a mut [Lanes],
    strips: Range<usize>,
}

impl WithSimd for Panel<'_, '_> {
    type Output = bool;
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        self.parts
            .eliminate(simd, self.top, self.triangles, self.strips)
    }
}

/// The remainders of children on the rows of a shared front.
struct Tail<'a, 'p> {
    parts: &'a mut Parts<'p>,
    children: &'a [Child<'a>],
}

impl WithSimd for Tail<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (left, places) in self.children {
            self.parts.take_rest(simd, left, places);
        }
    }
}

/// Rows of a shared front below a panel.
struct Rows<'a> {
    known: &'a [Lanes],
    strips: &'a mut [Lanes],
    above: (&'a [Lanes], &'a [Tile]),
    /// Width of the front, and the first strip of the panel.
    shape: (usize, usize),
}

impl WithSimd for Rows<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        solve_all(simd, self.known, self.strips, self.above, self.shape);
    }
}

/// Strips of rows that one thread takes at least.
const STRIPS: usize = 12;

fn solve_shared(
    known: &[Lanes],
    strips: &mut [Lanes],
    above: (&[Lanes], &[Tile]),
    (width, first, least): (usize, usize, usize),
) {
    let count = strips.len() / width;
    if count <= least {
        pulp::Arch::new().dispatch(Rows {
            known,
            strips,
            above,
            shape: (width, first),
        });
        return;
    }
    let half = (count / 2).next_multiple_of(3) * width;
    let (one, other) = strips.split_at_mut(half);
    rayon::join(
        || solve_shared(&known[..half], one, above, (width, first, least)),
        || solve_shared(&known[half..], other, above, (width, first, least)),
    );
}

/// Rows of what a shared front leaves.
struct Products<'a> {
    strips: &'a [Lanes],
    width: usize,
    rows: Range<usize>,
    rest: &'a mut [Lanes],
}

impl WithSimd for Products<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        leave(simd, self.strips, self.width, self.rows, self.rest);
    }
}

fn leave_shared(
    strips: &[Lanes],
    rows: Range<usize>,
    rest: &mut [Lanes],
    (width, least): (usize, usize),
) {
    if rows.len() <= least {
        pulp::Arch::new().dispatch(Products {
            strips,
            width,
            rows,
            rest,
        });
        return;
    }
    // Half of the products: rows grow longer.
    let squares = usize::midpoint(rows.start * rows.start, rows.end * rows.end);
    let half = rows.start + (squares.isqrt() - rows.start).next_multiple_of(3);
    let (one, other) = rest.split_at_mut(triangle(half) - triangle(rows.start));
    rayon::join(
        || leave_shared(strips, rows.start..half, one, (width, least)),
        || leave_shared(strips, half..rows.end, other, (width, least)),
    );
}

/// Numbers of the present front.
struct Parts<'a> {
    width: usize,
    columns: &'a mut [Lanes],
    rest: &'a mut [Lanes],
}

impl Parts<'_> {
    /// Entries of the matrix, and remainders of the children on unknowns of this front.
    #[inline(always)]
    fn take<'c, S: Simd>(
        &mut self,
        simd: S,
        matrix: Matrix<'_>,
        front: &Front,
        local: &mut [u32],
        children: impl Iterator<Item = Child<'c>>,
    ) {
        // As a loop it is compiled for wide registers.
        for column in self.columns.iter_mut() {
            *column = ZERO;
        }
        let Matrix {
            analysis,
            pattern,
            values,
        } = matrix;
        self.take_entries(analysis.indices(front), pattern, values, local);
        for (left, places) in children {
            self.take_columns(simd, left, places);
        }
    }

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

    /// Eliminates the unknowns of a panel of strips, which begins by a multiple of three and is
    /// solved with those before it: a part of the triangle of the factor. False when a pivot is not
    /// positive.
    #[inline(always)]
    fn eliminate<S: Simd>(
        &mut self,
        simd: S,
        top: &mut [Lanes],
        triangles: &mut [Tile],
        panel: Range<usize>,
    ) -> bool {
        let (width, start) = (self.width, panel.start);
        for first in panel.clone().step_by(3) {
            let (above, own) = top.split_at_mut(first * width);
            let group = (panel.end - first).min(3) * width;
            let (own, known) = (&mut own[..group], &self.columns[first * width..][..group]);
            let before = (&above[start * width..], &triangles[start..first]);
            solve_all(simd, known, own, before, (width, start));
            for number in first..panel.end.min(first + 3) {
                let (above, own) = own.split_at_mut((number - first) * width);
                let own = &mut own[..width];
                let known = &self.columns[number * width..][..width];
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

/// Solves rows of the factor with the rows above from strip `first` on and their triangles.
#[inline(always)]
fn solve_all<S: Simd>(
    simd: S,
    known: &[Lanes],
    strips: &mut [Lanes],
    above: (&[Lanes], &[Tile]),
    (width, first): (usize, usize),
) {
    let mut threes = strips.chunks_exact_mut(3 * width);
    let mut known = known.chunks_exact(width);
    for three in &mut threes {
        let (one, others) = three.split_at_mut(width);
        let (two, three) = others.split_at_mut(width);
        let mut next = || known.next().unwrap_or_default();
        let known = [next(), next(), next()];
        solve(simd, known, &mut [one, two, three], above, first);
    }
    for (own, known) in threes.into_remainder().chunks_exact_mut(width).zip(known) {
        solve(simd, [known], &mut [own], above, first);
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

/// Leaves the products of some strips of the rows below, by a multiple of three begun, to the
/// parent, their signs changed. `rest` begins with the first of them.
#[inline(always)]
fn leave<S: Simd>(simd: S, strips: &[Lanes], width: usize, rows: Range<usize>, rest: &mut [Lanes]) {
    let (rest, _) = rest.as_chunks_mut::<SIDE>();
    let begin = rows.start * (rows.start + 1) / 2;
    let mut first = rows.start;
    while first + 3 <= rows.end {
        for column in 0..=first {
            let right = &strips[column * width..][..width];
            products::<S, 3>(simd, strips, first, right, (column, begin), rest);
        }
        let right = &strips[(first + 1) * width..][..width];
        products::<S, 2>(simd, strips, first + 1, right, (first + 1, begin), rest);
        let right = &strips[(first + 2) * width..][..width];
        products::<S, 1>(simd, strips, first + 2, right, (first + 2, begin), rest);
        first += 3;
    }
    for row in first..rows.end {
        for column in 0..=row {
            let right = &strips[column * width..][..width];
            products::<S, 1>(simd, strips, row, right, (column, begin), rest);
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
    (column, begin): (usize, usize),
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
        rest[row * (row + 1) / 2 + column - begin] = parts[t];
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
        let analysis = Analysis::of(&pattern, 1);
        assert!(analysis.fronts.len() > 1);
        let factors = [true, false].map(|wide| {
            let mut factor = Factor::new(&analysis, n as usize, 1).unwrap();
            let positive = if wide {
                factor.renew(&analysis, &pattern, &values)
            } else {
                let renewal = Renewal {
                    matrix: Matrix {
                        analysis: &analysis,
                        pattern: &pattern,
                        values: &values,
                    },
                    part: &analysis.top,
                    work: &mut factor.top,
                    values: &mut factor.values,
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
