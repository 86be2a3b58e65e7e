//! Dense kernels of the factorisation: elimination in one front, and what it leaves over.
//!
//! A *panel* holds the columns of a front that are eliminated, by tiles of [`ROWS`] rows: tile `t` has its rows of column
//! `k` at `(t * pivots + k) * ROWS`. All loops run along `k`, so that both factors of every product are read one after
//! the other, and sums stay in registers from the first product to the last. On the diagonal stands the inverse of the
//! pivot, above it zeros as far as its tile goes; what lies further up is neither written nor read.
//!
//! Products are rounded before they are taken from sums, as everywhere here: an instruction that fuses both would round differently
//! from processors without it.
//!
//! Source of the blocking: Goto and van de Geijn (2008), ACM TOMS 34, 12.

use std::ops::Range;

/// Rows of a tile: panels begin and end at multiples of it.
pub const ROWS: usize = 8;
/// Pivots that are eliminated before the columns to their right hear of it; whole tiles.
const BLOCK: usize = 96;
/// Products that are summed at a time, so that one tile of factors stays in the first-level cache.
const DEPTH: usize = 256;
/// Tiles of rows that are dealt with at a time, so that their factors stay in the second-level cache.
const HEIGHT: usize = 32;

/// One column of a tile.
type Column = [f64; ROWS];
/// `W` columns of a tile.
type DenseTile<const W: usize> = [Column; W];

/// Eliminate the columns of a panel of `pivots` columns; the error is the column of a pivot that is not positive.
#[inline(always)]
pub fn eliminate(panel: &mut [f64], pivots: usize) -> Result<(), usize> {
    for start in (0..pivots).step_by(BLOCK) {
        let end = (start + BLOCK).min(pivots);
        if start > 0 {
            subtract_eliminated(panel, pivots, start, end);
        }
        for first in (start..end).step_by(ROWS) {
            match end - first {
                1 => columns::<1>(panel, pivots, start, first)?,
                2 => columns::<2>(panel, pivots, start, first)?,
                3 => columns::<3>(panel, pivots, start, first)?,
                4 => columns::<4>(panel, pivots, start, first)?,
                5 => columns::<5>(panel, pivots, start, first)?,
                6 => columns::<6>(panel, pivots, start, first)?,
                7 => columns::<7>(panel, pivots, start, first)?,
                _ => columns::<8>(panel, pivots, start, first)?,
            }
        }
    }
    Ok(())
}

/// Eliminate columns `first..first + W`, which have heard of all before `start`.
#[inline(always)]
fn columns<const W: usize>(
    panel: &mut [f64],
    pivots: usize,
    start: usize,
    first: usize,
) -> Result<(), usize> {
    let (tiles, own) = (panel.len() / (pivots * ROWS), first / ROWS);
    let place = |tile: usize| (tile * pivots + first) * ROWS;
    let factors = |tile: usize| (tile * pivots + start) * ROWS..place(tile);
    let mut lower = load::<W>(&panel[place(own)..]);
    {
        let factors = &panel[factors(own)];
        minus_products::<W>(&mut lower, factors, factors);
    }
    let mut inverses = [0.0; W];
    // By a macro: what is indexed by a variable would not stay in registers.
    macro_rules! pivots {
        ($($j:literal)*) => {$(
            if $j < W {
                let square = lower[$j][$j];
                if !(square > 0.0 && square < f64::INFINITY) {
                    return Err(first + $j);
                }
                let inverse = 1.0 / square.sqrt();
                inverses[$j] = inverse;
                for r in 0..ROWS {
                    lower[$j][r] *= inverse;
                }
                for c in $j + 1..W {
                    let factor = lower[$j][c];
                    for r in 0..ROWS {
                        lower[c][r] -= factor * lower[$j][r];
                    }
                }
                lower[$j][$j] = inverse;
                lower[$j][..$j].fill(0.0);
            }
        )*};
    }
    pivots!(0 1 2 3 4 5 6 7);
    store(&mut panel[place(own)..], &lower);
    for t in own + 1..tiles {
        let mut sum = load::<W>(&panel[place(t)..]);
        minus_products::<W>(&mut sum, &panel[factors(t)], &panel[factors(own)]);
        divide::<W>(&mut sum, &lower, &inverses);
        store(&mut panel[place(t)..], &sum);
    }
    Ok(())
}

/// Divide a tile below the pivots by their lower triangle, whose diagonal is given by its inverse.
#[inline(always)]
fn divide<const W: usize>(tile: &mut DenseTile<W>, lower: &DenseTile<W>, inverses: &[f64; W]) {
    macro_rules! columns {
        ($($j:literal)*) => {$(
            if $j < W {
                for r in 0..ROWS {
                    tile[$j][r] *= inverses[$j];
                }
                for c in $j + 1..W {
                    for r in 0..ROWS {
                        tile[c][r] -= lower[$j][c] * tile[$j][r];
                    }
                }
            }
        )*};
    }
    columns!(0 1 2 3 4 5 6 7);
}

/// Take the products of the columns before `start` from the columns `start..end` of a panel.
#[inline(always)]
fn subtract_eliminated(panel: &mut [f64], pivots: usize, start: usize, end: usize) {
    let tiles = panel.len() / (pivots * ROWS);
    for depth in blocks(0..start, DEPTH) {
        let factors = |tile: usize| (tile * pivots + depth.start) * ROWS..(tile * pivots + depth.end) * ROWS;
        for height in blocks(start / ROWS..tiles, HEIGHT) {
            for column in (start..end).step_by(ROWS) {
                let (own, width) = (column / ROWS, (end - column).min(ROWS));
                let place =
                    |tile: usize| (tile * pivots + column) * ROWS..(tile * pivots + column + width) * ROWS;
                for t in own.max(height.start)..height.end {
                    let sum = products(&panel[factors(t)], &panel[factors(own)]);
                    let to = &mut panel[place(t)];
                    to.iter_mut().zip(sum.as_flattened()).for_each(|(to, sum)| *to += sum);
                }
            }
        }
    }
}

/// Index at which a column of the update begins: with the tile of its diagonal. `tiles` is the number of tiles in the first.
#[inline(always)]
pub fn rest_place(tiles: usize, column: usize) -> usize {
    let before = column / ROWS;
    (before * (2 * tiles + 1 - before) / 2 * ROWS + column % ROWS * (tiles - before)) * ROWS
}

/// Update by the pivots of a front of `rows` rows: less the products of its panel, by columns from row `pivots`
/// on, each from the tile of its diagonal on. What stands above the diagonal is not to be read.
#[inline(always)]
pub fn leave_over(rest: &mut [f64], panel: &[f64], pivots: usize, rows: usize) {
    let (first, tiles) = (pivots / ROWS, rows.div_ceil(ROWS));
    for depth in blocks(0..pivots, DEPTH) {
        let factors =
            |tile: usize| &panel[(tile * pivots + depth.start) * ROWS..(tile * pivots + depth.end) * ROWS];
        for height in blocks(first..tiles, HEIGHT) {
            for own in first..height.end {
                let columns = pivots.max(own * ROWS)..rows.min(own * ROWS + ROWS);
                for t in own.max(height.start)..height.end {
                    let sum = products(factors(t), factors(own));
                    let (leading, row) = ((tiles - own) * ROWS, (t - own) * ROWS);
                    if columns.len() == ROWS {
                        let to = &mut rest[rest_place(tiles - first, (own - first) * ROWS)..];
                        for (c, sum) in sum.iter().enumerate() {
                            put(&mut to[c * leading + row..], sum, depth.start > 0);
                        }
                    } else {
                        for column in columns.clone() {
                            let to = &mut rest[rest_place(tiles - first, column - first * ROWS)..];
                            put(&mut to[row..], &sum[column - own * ROWS], depth.start > 0);
                        }
                    }
                }
            }
        }
    }
}

/// Less the products of two tiles.
#[inline(always)]
fn products(a: &[f64], b: &[f64]) -> DenseTile<ROWS> {
    let mut sum = [[0.0; ROWS]; ROWS];
    minus_products::<ROWS>(&mut sum, a, b);
    sum
}

/// Write a column of a tile, or add it to what is there.
#[inline(always)]
fn put(to: &mut [f64], column: &Column, add: bool) {
    let to: &mut Column = (&mut to[..ROWS]).try_into().expect("a column of a tile");
    if add {
        to.iter_mut().zip(column).for_each(|(to, number)| *to += number);
    } else {
        *to = *column;
    }
}

/// `all` in pieces of at most `length`.
#[inline(always)]
fn blocks(all: Range<usize>, length: usize) -> impl Iterator<Item = Range<usize>> {
    all.clone().step_by(length).map(move |start| start..(start + length).min(all.end))
}

/// `sum[c, r] -= sum_k a[k, r] b[k, c]`.
#[inline(always)]
fn minus_products<const W: usize>(sum: &mut DenseTile<W>, a: &[f64], b: &[f64]) {
    if W <= 4 {
        for (a, b) in a.as_chunks::<ROWS>().0.iter().zip(b.as_chunks::<ROWS>().0) {
            rank_one::<W>(sum, a, b);
        }
        return;
    }
    // Sixteen narrow registers do not hold more than four columns.
    let mut halves = [[[0.0; ROWS]; 4]; 2];
    for (c, column) in sum.iter().enumerate() {
        halves[c / 4][c % 4] = *column;
    }
    for (half, part) in halves.iter_mut().enumerate() {
        for (a, b) in a.as_chunks::<ROWS>().0.iter().zip(b.as_chunks::<ROWS>().0) {
            for c in 0..4 {
                for r in 0..ROWS {
                    part[c][r] -= b[4 * half + c] * a[r];
                }
            }
        }
    }
    for (c, column) in sum.iter_mut().enumerate() {
        *column = halves[c / 4][c % 4];
    }
}

#[inline(always)]
fn rank_one<const W: usize>(sum: &mut DenseTile<W>, a: &Column, b: &Column) {
    for c in 0..W {
        for r in 0..ROWS {
            sum[c][r] -= b[c] * a[r];
        }
    }
}

#[inline(always)]
fn load<const W: usize>(from: &[f64]) -> DenseTile<W> {
    let mut tile = [[0.0; ROWS]; W];
    tile.as_flattened_mut().copy_from_slice(&from[..W * ROWS]);
    tile
}

#[inline(always)]
fn store<const W: usize>(to: &mut [f64], tile: &DenseTile<W>) {
    to[..W * ROWS].copy_from_slice(tile.as_flattened());
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Panel of the front `a`, square and by columns.
    fn panel_of(a: &[f64], rows: usize, pivots: usize) -> Vec<f64> {
        let mut panel = vec![0.0; rows.next_multiple_of(ROWS) * pivots];
        for k in 0..pivots {
            for row in k..rows {
                panel[(row / ROWS * pivots + k) * ROWS + row % ROWS] = a[k * rows + row];
            }
        }
        panel
    }

    #[test]
    fn a_front_of_any_size_is_its_factor_times_itself_and_what_is_left_over() {
        let mut random = crate::element::tests::checks::random(5);
        let sizes = (1..20).flat_map(|p| [0, 1, 5, 8, 21].map(|b| (p, p + b)));
        for (pivots, rows) in sizes.chain([(97, 97), (100, 131), (200, 203), (300, 341)]) {
            // Positive: each diagonal entry is larger than the sum of its row.
            let mut a = vec![0.0; rows * rows];
            for c in 0..rows {
                for r in c..rows {
                    a[c * rows + r] = if r == c { rows as f64 } else { random() };
                }
            }
            let mut panel = panel_of(&a, rows, pivots);
            let (first, tiles) = (pivots / ROWS, rows.div_ceil(ROWS));
            let mut rest = vec![f64::NAN; (tiles - first) * (tiles - first + 1) / 2 * ROWS * ROWS];
            eliminate(&mut panel, pivots).expect("is positive definite");
            leave_over(&mut rest, &panel, pivots, rows);
            let l = |row: usize, k: usize| {
                let number = panel[(row / ROWS * pivots + k) * ROWS + row % ROWS];
                if row == k { 1.0 / number } else { number }
            };
            for c in 0..rows {
                for r in c..rows {
                    let left = if c < pivots {
                        0.0
                    } else {
                        let column = c - first * ROWS;
                        rest[rest_place(tiles - first, column) + r - c / ROWS * ROWS]
                    };
                    // What is left over does not hold what the matrix has below its pivots.
                    let whole = if c < pivots { a[c * rows + r] } else { 0.0 };
                    let product: f64 = (0..pivots.min(c + 1)).map(|k| l(r, k) * l(c, k)).sum();
                    // Sum of as many products as there are pivots, none larger than the diagonal; the inverse of
                    // a pivot is rounded, too (Higham, 2002, theorem 10.3).
                    let bound = 2.0 * (pivots + 3) as f64 * f64::EPSILON * rows as f64;
                    let error = (product + left - whole).abs();
                    assert!(error <= bound, "{pivots} of {rows}: {error:.1e} > {bound:.1e} at {r}, {c}");
                }
            }
            for k in 0..pivots {
                for row in k / ROWS * ROWS..k {
                    assert_eq!(
                        panel[(row / ROWS * pivots + k) * ROWS + row % ROWS],
                        0.0,
                        "above the diagonal"
                    );
                }
            }
        }
    }

    #[test]
    fn the_first_pivot_that_is_not_positive_is_told() {
        for (pivots, bad) in [(1, 0), (7, 3), (30, 29), (120, 100)] {
            let rows = pivots + 4;
            let mut a = vec![0.0; rows * rows];
            (0..rows).for_each(|i| a[i * rows + i] = if i == bad { -1e-3 } else { 1.0 });
            assert_eq!(eliminate(&mut panel_of(&a, rows, pivots), pivots), Err(bad));
        }
    }
}
