//! Products, triangles and pivots on tiles of 8 x 8 numbers: all arithmetic of the
//! factorisation. Tiles stay in registers while a front is worked through them.

use pulp::Simd;

use crate::scalar::Lanes;

/// Rows and columns of a tile.
pub(super) const SIDE: usize = Lanes::COUNT;
/// Columns of a tile.
pub(super) type Tile = [Lanes; SIDE];

pub(super) const ZERO: Lanes = Lanes([0.0; SIDE]);
pub(super) const EMPTY: Tile = [ZERO; SIDE];

/// Part of a column that fills a register.
#[inline(always)]
fn part<S: Simd>(column: &Lanes, number: usize) -> S::f64s {
    S::as_simd_f64s(&column.0).0[number]
}

#[inline(always)]
fn set_part<S: Simd>(column: &mut Lanes, number: usize, value: S::f64s) {
    S::as_mut_simd_f64s(&mut column.0).0[number] = value;
}

/// Takes `left right'` off some tiles of the same columns. `left` has the rows of each
/// tile, `right` their columns; both are strips: column by column, 8 rows each.
#[inline(always)]
pub(super) fn subtract<S: Simd, const TILES: usize>(
    simd: S,
    tiles: &mut [Tile; TILES],
    left: [&[Lanes]; TILES],
    right: &[Lanes],
) {
    if S::F64_LANES == SIDE {
        subtract_together(simd, tiles, left, right);
        return;
    }
    for (tile, left) in tiles.iter_mut().zip(left) {
        subtract_half(simd, tile, left, right, 0);
        subtract_half(simd, tile, left, right, HALF);
    }
}

/// Columns of half a tile.
const HALF: usize = SIDE / 2;

/// The same for half a tile, whose sums fit in fewer and smaller registers.
#[inline(always)]
fn subtract_half<S: Simd>(simd: S, tile: &mut Tile, left: &[Lanes], right: &[Lanes], first: usize) {
    let parts = SIDE / S::F64_LANES;
    let mut sums = [[simd.splat_f64s(0.0); HALF]; SIDE];
    for p in 0..parts {
        for c in 0..HALF {
            sums[p][c] = part::<S>(&tile[first + c], p);
        }
    }
    for (own, factors) in left.iter().zip(right) {
        let mut c = 0;
        while c < HALF {
            let factor = simd.splat_f64s(factors.0[first + c]);
            let mut p = 0;
            while p < parts {
                sums[p][c] = simd.negate_mul_add_f64s(part::<S>(own, p), factor, sums[p][c]);
                p += 1;
            }
            c += 1;
        }
    }
    for p in 0..parts {
        for c in 0..HALF {
            set_part::<S>(&mut tile[first + c], p, sums[p][c]);
        }
    }
}

/// With a register for each column.
#[inline(always)]
fn subtract_together<S: Simd, const TILES: usize>(
    simd: S,
    tiles: &mut [Tile; TILES],
    left: [&[Lanes]; TILES],
    right: &[Lanes],
) {
    let depth = right.len();
    let mut left = left;
    let mut t = 0;
    while t < TILES {
        left[t] = &left[t][..depth];
        t += 1;
    }
    let mut sums = [[simd.splat_f64s(0.0); SIDE]; TILES];
    let mut t = 0;
    while t < TILES {
        let mut c = 0;
        while c < SIDE {
            sums[t][c] = part::<S>(&tiles[t][c], 0);
            c += 1;
        }
        t += 1;
    }
    let mut k = 0;
    while k < depth {
        let factors = &right[k].0;
        let mut c = 0;
        while c < SIDE {
            let factor = simd.splat_f64s(factors[c]);
            let mut t = 0;
            while t < TILES {
                let own = part::<S>(&left[t][k], 0);
                sums[t][c] = simd.negate_mul_add_f64s(own, factor, sums[t][c]);
                t += 1;
            }
            c += 1;
        }
        k += 1;
    }
    let mut t = 0;
    while t < TILES {
        let mut c = 0;
        while c < SIDE {
            set_part::<S>(&mut tiles[t][c], 0, sums[t][c]);
            c += 1;
        }
        t += 1;
    }
}

/// Replaces tiles `T` by `T L'^-1`, with the triangle that [`pivots`] left.
#[inline(always)]
pub(super) fn divide<S: Simd, const TILES: usize>(
    simd: S,
    tiles: &mut [Tile; TILES],
    triangle: &Tile,
) {
    let mut k = 0;
    while k < SIDE {
        let factors = triangle[k].0;
        let mut t = 0;
        while t < TILES {
            tiles[t][k] = times(simd, &tiles[t][k], factors[k]);
            let mut c = k + 1;
            while c < SIDE {
                tiles[t][c] = less(simd, &tiles[t][k], factors[c], &tiles[t][c]);
                c += 1;
            }
            t += 1;
        }
        k += 1;
    }
}

#[inline(always)]
fn times<S: Simd>(simd: S, column: &Lanes, factor: f64) -> Lanes {
    let mut product = ZERO;
    let mut number = 0;
    while number < SIDE / S::F64_LANES {
        let own = simd.mul_f64s(part::<S>(column, number), simd.splat_f64s(factor));
        set_part::<S>(&mut product, number, own);
        number += 1;
    }
    product
}

/// `other - column * factor`, fused.
#[inline(always)]
pub(super) fn less<S: Simd>(simd: S, column: &Lanes, factor: f64, other: &Lanes) -> Lanes {
    let mut rest = ZERO;
    let mut number = 0;
    while number < SIDE / S::F64_LANES {
        let (own, other) = (part::<S>(column, number), part::<S>(other, number));
        let factor = simd.splat_f64s(factor);
        let own = simd.negate_mul_add_f64s(own, factor, other);
        set_part::<S>(&mut rest, number, own);
        number += 1;
    }
    rest
}

/// Factorises the lower half of a tile; the diagonal becomes its reciprocal, what is
/// above it zero. Columns from `width` on become those of the unit matrix. False when
/// a pivot is not positive.
#[inline(always)]
pub(super) fn pivots<S: Simd>(simd: S, tile: &mut Tile, width: usize) -> bool {
    let mut columns = *tile;
    let mut positive = true;
    let mut k = 0;
    while k < SIDE {
        if k >= width {
            columns[k] = ZERO;
            columns[k].0[k] = 1.0;
            k += 1;
            continue;
        }
        let pivot = columns[k].0[k];
        positive &= pivot > 0.0 && pivot < f64::INFINITY;
        let reciprocal = 1.0 / pivot.sqrt();
        let mut column = times(simd, &columns[k], reciprocal);
        let mut c = k + 1;
        while c < SIDE {
            columns[c] = less(simd, &column, column.0[c], &columns[c]);
            c += 1;
        }
        let mut row = 0;
        while row < k {
            column.0[row] = 0.0;
            row += 1;
        }
        column.0[k] = reciprocal;
        columns[k] = column;
        k += 1;
    }
    *tile = columns;
    positive
}

/// A tile out of a strip: its columns from 8 `number` on, none beyond the end.
#[inline(always)]
pub(super) fn load(strip: &[Lanes], number: usize) -> Tile {
    let (whole, rest) = strip.as_chunks::<SIDE>();
    if number < whole.len() {
        return whole[number];
    }
    let mut tile = EMPTY;
    let mut c = 0;
    while c < SIDE {
        if c < rest.len() {
            tile[c] = rest[c];
        }
        c += 1;
    }
    tile
}

/// Puts a tile back into its strip.
#[inline(always)]
pub(super) fn store(strip: &mut [Lanes], number: usize, tile: &Tile) {
    let (whole, rest) = strip.as_chunks_mut::<SIDE>();
    if number < whole.len() {
        whole[number] = *tile;
        return;
    }
    let mut c = 0;
    while c < SIDE {
        if c < rest.len() {
            rest[c] = tile[c];
        }
        c += 1;
    }
}

/// The rows of a column moved down, the last ones to its begin: for registers of 8.
#[inline(always)]
pub(super) fn turned<S: Simd>(simd: S, column: &Lanes, rows: usize) -> Lanes {
    let mut turned = ZERO;
    let own = simd.rotate_right_f64s(part::<S>(column, 0), rows);
    set_part::<S>(&mut turned, 0, own);
    turned
}

/// One for the rows from here on and for those before; zero for the others.
#[inline(always)]
pub(super) fn masks(row: usize) -> (Lanes, Lanes) {
    let (mut upper, mut lower) = (ZERO, ZERO);
    for lane in 0..SIDE {
        let which = if lane < row { &mut lower } else { &mut upper };
        which.0[lane] = 1.0;
    }
    (upper, lower)
}
