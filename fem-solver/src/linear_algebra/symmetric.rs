//! A sparse symmetric matrix: pattern once, numbers and factor as often as needed.

use super::elimination::pattern;
use super::linear_solver::Cholesky;

/// Lower triangle by columns, and its factor.
///
/// Behind its unknowns it may have others that are only eliminated (slips of ropes): solutions show the first ones alone, and so does
/// everything else but the factor.
pub struct SymmetricMatrix {
    /// Its order, without what is only eliminated.
    order: usize,
    /// Index at which each column begins, with its diagonal; one more at the end.
    starts: Vec<usize>,
    /// Row of each entry.
    rows: Vec<usize>,
    /// Values in the order of the pattern; the last one takes what belongs to no entry.
    values: Vec<f64>,
    /// Memory of [`SymmetricMatrix::bound`] and [`SymmetricMatrix::solve`].
    sums: Vec<f64>,
    /// Its factor.
    pub cholesky: Cholesky,
}

impl SymmetricMatrix {
    /// Of order `order`, and with `inner` unknowns behind that are only eliminated, with a diagonal and these entries `(row, column)` of the lower triangle, which may repeat.
    pub fn new(order: usize, inner: usize, entries: impl Iterator<Item = (usize, usize)>) -> Self {
        let n = order + inner;
        let (starts, rows) = pattern(n, entries);
        let cholesky = Cholesky::new(n, &starts, &rows);
        Self { order, values: vec![0.0; rows.len() + 1], sums: vec![0.0; n], starts, rows, cholesky }
    }

    /// Its order.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Position of an entry of the pattern among the values; without one, of what belongs to no entry.
    pub fn position(&self, entry: Option<(usize, usize)>) -> u32 {
        let at = entry.map_or(self.rows.len(), |(row, column)| {
            let inside = self.rows[self.starts[column]..self.starts[column + 1]].binary_search(&row);
            self.starts[column] + inside.expect("the pattern holds every entry of every element")
        });
        at as u32
    }

    /// Set all values to 0.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Add to the value at a position.
    #[inline]
    pub fn add(&mut self, position: u32, amount: f64) {
        self.values[position as usize] += amount;
    }

    /// Add to the diagonal entry of column `j`.
    #[inline]
    pub fn add_diagonal(&mut self, j: usize, amount: f64) {
        self.values[self.starts[j]] += amount;
    }

    /// Add `amount` to every diagonal entry.
    pub fn shift(&mut self, amount: f64) {
        (0..self.order()).for_each(|j| self.add_diagonal(j, amount));
    }

    /// Take `part` of itself from every diagonal entry.
    pub fn weaken(&mut self, part: f64) {
        for j in 0..self.order() {
            self.values[self.starts[j]] *= 1.0 - part;
        }
    }

    /// Largest diagonal entry, not below 0.
    pub fn largest_diagonal(&self) -> f64 {
        (0..self.order()).map(|j| self.values[self.starts[j]]).fold(0.0, f64::max)
    }

    /// Take the unknowns that are `fixed`, of all that are eliminated, out of the system: each keeps a diagonal of its own.
    pub fn leave_out(&mut self, fixed: &[bool]) {
        if !fixed.contains(&true) {
            return;
        }
        let diagonal = self.largest_diagonal().max(f64::MIN_POSITIVE);
        for j in 0..fixed.len() {
            for at in self.starts[j]..self.starts[j + 1] {
                let row = self.rows[at];
                if fixed[j] || fixed[row] {
                    self.values[at] = if row == j { diagonal } else { 0.0 };
                }
            }
        }
    }

    /// Factorise; the error is the unknown whose pivot is the first that is not positive.
    pub fn factorise(&mut self) -> Result<(), usize> {
        self.cholesky.factorise(&self.values[..self.rows.len()])
    }

    /// The same with pivots of either sign; returns how many are negative. The error is an unknown where the matrix is no
    /// number.
    pub fn factorise_signed(&mut self) -> Result<usize, usize> {
        self.cholesky.factorise_signed(&self.values[..self.rows.len()])
    }

    /// Solve for `x`, which holds the right-hand side. The last factorisation must have succeeded.
    pub fn solve(&mut self, x: &mut [f64]) {
        let (own, inner) = self.sums.split_at_mut(self.order);
        own.copy_from_slice(x);
        inner.fill(0.0);
        self.cholesky.solve(&mut self.sums);
        x.copy_from_slice(&self.sums[..self.order]);
    }

    /// Call `take` with row, column and value of every entry of the whole matrix.
    pub fn each(&self, mut take: impl FnMut(usize, usize, f64)) {
        for j in 0..self.order() {
            let (start, end) = (self.starts[j], self.starts[j + 1]);
            let end = start + self.rows[start..end].partition_point(|row| *row < self.order);
            take(j, j, self.values[start]);
            for (row, value) in self.rows[start + 1..end].iter().zip(&self.values[start + 1..end]) {
                take(*row, j, *value);
                take(j, *row, *value);
            }
        }
    }

    /// Norm of `|K| x`, entries by their magnitudes.
    pub fn bound(&mut self, x: &[f64]) -> f64 {
        let mut sums = std::mem::take(&mut self.sums);
        sums.fill(0.0);
        self.each(|row, column, value| sums[row] += value.abs() * x[column]);
        self.sums = sums;
        self.sums[..self.order].iter().map(|s| s * s).sum::<f64>().sqrt()
    }

    /// `y = K x`.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        self.each(|row, column, value| y[row] += value * x[column]);
    }
}
