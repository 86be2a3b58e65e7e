//! Factors `L S L'` of symmetric matrices that are not positive, `S` being the signs of the pivots.
//!
//! The order of elimination stays that of the positive ones, and no rows are exchanged: the pattern of the factor, its
//! memory and its solution are those of [`crate::linear_algebra::multifrontal`]. A pivot that is too small to divide by is replaced by a small
//! one of its sign; what that changes is repaired by whoever solves, by iterative refinement. The number of negative pivots
//! is the number of negative eigenvalues, whatever the order (Sylvester).
//!
//! Loops are plain here: this is for paths of equilibrium beyond their limits. What is positive is factorised by
//! [`crate::linear_algebra::dense`], which is several times faster.
//!
//! Source: Schenk and Gaertner (2006), Electronic Transactions on Numerical Analysis 23, 158 (small pivots replaced).

use crate::linear_algebra::dense::{ROWS, eliminate, leave_over, rest_place};
use std::ops::Range;

/// A pivot below this part of the matrix's own diagonal entry is replaced.
const SMALLEST: f64 = 1e-9;
/// The same relative to the largest diagonal entry, where the own one is (almost) 0.
const SMALLEST_OF_ALL: f64 = 1e-12;

type SignedTile = [[f64; ROWS]; ROWS];

/// Elimination of the pivots of a front.
pub trait Pivoting {
    /// Eliminate all columns of a panel, which are `columns` in the order of elimination; the error is the first column of
    /// the panel with a pivot that cannot be one.
    fn eliminate(&mut self, panel: &mut [f64], columns: &Range<usize>) -> Result<(), usize>;
    /// Update of the rest of a front of `rows` rows by these pivots.
    fn leave_over(&self, rest: &mut [f64], panel: &[f64], columns: &Range<usize>, rows: usize);
}

/// All pivots must be positive.
pub struct Positive;

impl Pivoting for Positive {
    #[inline(always)]
    fn eliminate(&mut self, panel: &mut [f64], columns: &Range<usize>) -> Result<(), usize> {
        eliminate(panel, columns.len())
    }

    #[inline(always)]
    fn leave_over(&self, rest: &mut [f64], panel: &[f64], columns: &Range<usize>, rows: usize) {
        leave_over(rest, panel, columns.len(), rows);
    }
}

/// Pivots of either sign.
#[derive(Debug, Clone, Default)]
pub struct Signed {
    /// Sign of the pivot of each column, in the order of elimination.
    pub signs: Vec<f64>,
    /// Least size of the pivot of each column.
    least: Vec<f64>,
    /// Pivots that were replaced.
    pub replaced: u64,
}

impl Signed {
    /// Make ready for a matrix whose diagonal entries, in the order of elimination, are `diagonal`.
    pub fn begin(&mut self, diagonal: impl Iterator<Item = f64> + Clone) {
        let largest = diagonal.clone().fold(0.0, |a, b| f64::max(a, b.abs()));
        self.least.clear();
        self.least.extend(diagonal.map(|d| (SMALLEST * d.abs()).max(SMALLEST_OF_ALL * largest)));
        self.signs.clear();
        self.signs.resize(self.least.len(), 1.0);
        self.replaced = 0;
    }

    /// Number of negative pivots.
    pub fn negative(&self) -> usize {
        self.signs.iter().filter(|s| **s < 0.0).count()
    }

    /// Eliminate the columns of one tile in itself; the inverses of the roots of the pivots.
    #[inline(always)]
    fn pivots(&mut self, tile: &mut SignedTile, columns: Range<usize>) -> Result<[f64; ROWS], usize> {
        let mut inverses = [0.0; ROWS];
        for (j, column) in columns.clone().enumerate() {
            let mut pivot = tile[j][j];
            if !pivot.is_finite() {
                return Err(j);
            }
            let sign = if pivot < 0.0 { -1.0 } else { 1.0 };
            if pivot.abs() < self.least[column] {
                pivot = sign * self.least[column];
                self.replaced += 1;
            }
            if pivot == 0.0 {
                // Nothing at all is there: the whole matrix is 0.
                return Err(j);
            }
            let inverse = 1.0 / pivot.abs().sqrt();
            (self.signs[column], inverses[j]) = (sign, inverse);
            tile[j].iter_mut().for_each(|x| *x *= sign * inverse);
            for c in j + 1..columns.len() {
                let factor = sign * tile[j][c];
                let column = tile[j];
                tile[c].iter_mut().zip(column).for_each(|(t, l)| *t -= factor * l);
            }
            tile[j][j] = inverse;
            tile[j][..j].fill(0.0);
        }
        Ok(inverses)
    }
}

/// `sum[c, r] -= sum_k a[k, r] signs[k] b[k, c]`.
#[inline(always)]
fn minus_products(sum: &mut SignedTile, a: &[f64], b: &[f64], signs: &[f64]) {
    for ((a, b), sign) in a.as_chunks::<ROWS>().0.iter().zip(b.as_chunks::<ROWS>().0).zip(signs) {
        for c in 0..ROWS {
            let factor = sign * b[c];
            for r in 0..ROWS {
                sum[c][r] -= factor * a[r];
            }
        }
    }
}

impl Pivoting for Signed {
    #[inline(always)]
    fn eliminate(&mut self, panel: &mut [f64], columns: &Range<usize>) -> Result<(), usize> {
        let pivots = columns.len();
        let tiles = panel.len() / (pivots * ROWS).max(1);
        for first in (0..pivots).step_by(ROWS) {
            let (width, own) = ((pivots - first).min(ROWS), first / ROWS);
            let place = |tile: usize| (tile * pivots + first) * ROWS;
            let mut lower: SignedTile = [[0.0; ROWS]; ROWS];
            let mut inverses = [0.0; ROWS];
            let here = columns.start + first..columns.start + first + width;
            for t in own..tiles {
                let mut sum: SignedTile = [[0.0; ROWS]; ROWS];
                sum.as_flattened_mut()[..width * ROWS].copy_from_slice(&panel[place(t)..][..width * ROWS]);
                let factors = |tile: usize| &panel[tile * pivots * ROWS..place(tile)];
                minus_products(&mut sum, factors(t), factors(own), &self.signs[columns.start..here.start]);
                if t == own {
                    inverses = self.pivots(&mut sum, here.clone()).map_err(|j| first + j)?;
                    lower = sum;
                } else {
                    for j in 0..width {
                        let sign = self.signs[here.start + j];
                        sum[j].iter_mut().for_each(|x| *x *= sign * inverses[j]);
                        for c in j + 1..width {
                            let factor = sign * lower[j][c];
                            let column = sum[j];
                            sum[c].iter_mut().zip(column).for_each(|(s, l)| *s -= factor * l);
                        }
                    }
                }
                panel[place(t)..][..width * ROWS].copy_from_slice(&sum.as_flattened()[..width * ROWS]);
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn leave_over(&self, rest: &mut [f64], panel: &[f64], columns: &Range<usize>, rows: usize) {
        let pivots = columns.len();
        let (first, tiles) = (pivots / ROWS, rows.div_ceil(ROWS));
        let factors = |tile: usize| &panel[tile * pivots * ROWS..(tile + 1) * pivots * ROWS];
        for own in first..tiles {
            for t in own..tiles {
                let mut sum: SignedTile = [[0.0; ROWS]; ROWS];
                minus_products(&mut sum, factors(t), factors(own), &self.signs[columns.clone()]);
                for column in pivots.max(own * ROWS)..rows.min(own * ROWS + ROWS) {
                    let to = &mut rest[rest_place(tiles - first, column - first * ROWS)..];
                    to[(t - own) * ROWS..][..ROWS].copy_from_slice(&sum[column - own * ROWS]);
                }
            }
        }
    }
}
