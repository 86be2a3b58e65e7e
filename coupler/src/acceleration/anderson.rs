//! Anderson acceleration: the residuals of earlier iterations of the window are combined to the smallest one.
//!
//! With the differences `dR` of residuals and `dX` of iterates (newest last), `g = argmin |r - dR g|` and
//! `x <- x - dX g + b (r - dR g)`. On a linear interface of n unknowns it ends after n + 1 iterations; it is the family to which
//! the quasi-Newton methods of IQN-ILS belong, and with one column and one unknown it is Aitken's.
//! Source: Anderson (1965), J. ACM 12, 547; Walker and Ni (2011), SIAM J. Numer. Anal. 49, 1715; filter of columns: Haelterman
//! et al. (2016), Comput. Struct. 171, 9.

use super::{Acceleration, relax};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Most columns: beyond, old iterations say nothing of a contact that has opened or closed since.
const MOST_COLUMNS: usize = 50;
/// A difference of residuals that newer ones explain up to this share says nothing new, and divides by almost nothing.
const FILTER: f64 = 1e-9;

/// Anderson acceleration (multi-secant), started anew in every window: for nets on which many contacts act on each other.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Anderson {
    /// Factor of the first iteration of each window, and of what the columns leave of the residual, in (0, 1].
    pub initial: f64,
    /// Most earlier iterations of the window that are used, 1 to 50.
    pub columns: usize,
    #[serde(skip)]
    last: Last,
    #[serde(skip)]
    moves: Vec<f64>,
    #[serde(skip)]
    changes: Vec<f64>,
    #[serde(skip)]
    basis: Basis,
}

/// Iterate and residual of the iteration before.
#[derive(Debug, Clone, Default)]
struct Last {
    iterate: Vec<f64>,
    residual: Vec<f64>,
}

/// The differences of residuals as orthonormal vectors, newest first, and the triangle that takes these back.
#[derive(Debug, Clone, Default)]
struct Basis {
    vectors: Vec<f64>,
    /// Row by row, `MOST_COLUMNS` numbers each.
    triangle: Vec<f64>,
    /// Which column each vector is of, counted from the oldest.
    columns: Vec<usize>,
    /// Share of each column.
    shares: Vec<f64>,
}

impl Default for Anderson {
    fn default() -> Self {
        Self {
            initial: 0.5,
            columns: 8,
            last: Last::default(),
            moves: Vec::new(),
            changes: Vec::new(),
            basis: Basis::default(),
        }
    }
}

impl Basis {
    /// Gram-Schmidt (modified) over the columns `changes`, each of `len` numbers; what newer ones explain is left out.
    fn rebuild(&mut self, changes: &[f64], len: usize) {
        self.vectors.clear();
        self.columns.clear();
        self.triangle.resize(MOST_COLUMNS * MOST_COLUMNS, 0.0);
        for (column, change) in changes.chunks_exact(len).enumerate().rev() {
            let (start, number) = (self.vectors.len(), self.columns.len());
            self.vectors.extend_from_slice(change);
            let (older, vector) = self.vectors.split_at_mut(start);
            for (row, base) in older.chunks_exact(len).enumerate() {
                let along = dot(base, vector);
                self.triangle[row * MOST_COLUMNS + number] = along;
                relax(vector, base, -along);
            }
            let left = dot(vector, vector).sqrt();
            if left <= FILTER * dot(change, change).sqrt() {
                self.vectors.truncate(start);
                continue;
            }
            vector.iter_mut().for_each(|x| *x /= left);
            self.triangle[number * MOST_COLUMNS + number] = left;
            self.columns.push(column);
        }
    }

    /// The shares with which the columns come nearest to `residual`, from the last vector back.
    fn solve(&mut self, residual: &[f64]) {
        let (count, len) = (self.columns.len(), residual.len());
        self.shares.clear();
        self.shares.extend(self.vectors.chunks_exact(len).map(|base| dot(base, residual)));
        for row in (0..count).rev() {
            for later in row + 1..count {
                self.shares[row] -= self.triangle[row * MOST_COLUMNS + later] * self.shares[later];
            }
            self.shares[row] /= self.triangle[row * MOST_COLUMNS + row];
        }
    }
}

impl Anderson {
    /// Take the step from the iteration before to this one as the newest column.
    fn remember(&mut self, x: &[f64], residual: &[f64]) {
        let len = x.len();
        // The set of nodes may change between two iterations: then there is nothing to compare with.
        if self.last.residual.len() != len {
            self.moves.clear();
            self.changes.clear();
        } else {
            if self.moves.len() == self.columns * len {
                self.moves.drain(..len);
                self.changes.drain(..len);
            }
            self.moves.extend(x.iter().zip(&self.last.iterate).map(|(new, old)| new - old));
            self.changes.extend(residual.iter().zip(&self.last.residual).map(|(new, old)| new - old));
        }
        self.last.iterate.clear();
        self.last.iterate.extend_from_slice(x);
        self.last.residual.clear();
        self.last.residual.extend_from_slice(residual);
    }
}

impl Acceleration for Anderson {
    fn start_window(&mut self, most: usize) {
        for (kept, count) in [
            (&mut self.moves, self.columns * most),
            (&mut self.changes, self.columns * most),
            // One more, while a column is compared with the others.
            (&mut self.basis.vectors, (self.columns + 1) * most),
            (&mut self.last.iterate, most),
            (&mut self.last.residual, most),
        ] {
            kept.clear();
            kept.reserve(count);
        }
        self.basis.columns.reserve(self.columns);
        self.basis.shares.reserve(self.columns);
    }

    fn update(&mut self, x: &mut [f64], residual: &[f64]) {
        let len = x.len();
        self.remember(x, residual);
        relax(x, residual, self.initial);
        if self.changes.is_empty() {
            return;
        }
        self.basis.rebuild(&self.changes, len);
        self.basis.solve(residual);
        for (column, share) in self.basis.columns.iter().zip(&self.basis.shares) {
            let of = column * len..(column + 1) * len;
            relax(x, &self.moves[of.clone()], -share);
            relax(x, &self.changes[of], -self.initial * share);
        }
    }

    fn factor(&self) -> f64 {
        self.initial
    }

    fn check(&self) -> Result<(), (&'static str, String)> {
        if !(self.initial > 0.0 && self.initial <= 1.0) {
            return Err(("initial", format!("the first factor must lie in (0, 1], it is {}", self.initial)));
        }
        if !(1..=MOST_COLUMNS).contains(&self.columns) {
            let what = format!("1 to {MOST_COLUMNS} earlier iterations can be used, not {}", self.columns);
            return Err(("columns", what));
        }
        Ok(())
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::super::Aitken;
    use super::*;

    /// `H(x) = b - A x` with stiffness ratios from 0.1 to 1e3, coupled by a chain.
    fn answer(x: &[f64]) -> Vec<f64> {
        let ratio = [0.1, 3.0, 6.25, 40.0, 200.0, 1e3];
        let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
        (0..x.len())
            .map(|i| 1.0 + 0.5 * i as f64 - ratio[i] * (at(i) + 0.2 * (at(i.wrapping_sub(1)) + at(i + 1))))
            .collect()
    }

    /// Iterations until the residual is below 1e-9 of its first value; the last iterate.
    fn iterations(method: &mut dyn Acceleration, most: usize) -> (usize, Vec<f64>) {
        let mut x = vec![0.3; 6];
        method.start_window(6);
        let size = |r: &[f64]| dot(r, r).sqrt();
        let residual = |x: &[f64]| -> Vec<f64> { answer(x).iter().zip(x).map(|(h, x)| h - x).collect() };
        let first = size(&residual(&x));
        for iteration in 1..=most {
            let r = residual(&x);
            if size(&r) < 1e-9 * first {
                return (iteration, x);
            }
            method.update(&mut x, &r);
        }
        (most + 1, x)
    }

    /// Six unknowns: seven iterations and the one that finds the residual gone. Aitken's one factor does not suit six ratios.
    #[test]
    fn a_linear_interface_is_solved_in_as_many_iterations_as_it_has_unknowns() {
        let (count, x) = iterations(&mut Anderson::default(), 50);
        assert!(count <= 8, "{count}");
        answer(&x).iter().zip(&x).for_each(|(h, x)| assert!((h - x).abs() < 1e-6, "{h} {x}"));
        let (aitken, _) = iterations(&mut Aitken::default(), 500);
        assert!(aitken > 4 * count, "{aitken}");
    }

    #[test]
    fn with_one_unknown_it_is_the_secant_method_and_a_new_window_forgets_the_last() {
        let mut method = Anderson { columns: 1, ..Anderson::default() };
        let mut first = Vec::new();
        for ratio in [6.25, 6.25, 1e4] {
            method.start_window(1);
            let mut x = [0.3];
            for _ in 0..2 {
                let residual = [1.0 - ratio * x[0] - x[0]];
                method.update(&mut x, &residual);
            }
            let exact = 1.0 / (1.0 + ratio);
            assert!((x[0] / exact - 1.0).abs() < 1e-9 * ratio, "{} {exact}", x[0]);
            first.push(x[0]);
        }
        assert_eq!(first[0], first[1]);
    }

    /// Equal columns, and a set of nodes that changes: nothing is divided by nothing.
    #[test]
    fn what_says_nothing_new_is_left_out() {
        let mut method = Anderson::default();
        method.start_window(3);
        let mut x = vec![0.0; 3];
        for _ in 0..4 {
            method.update(&mut x, &[1.0, 0.5, -0.5]);
        }
        let mut fewer = vec![x[0], x[1]];
        method.update(&mut fewer, &[0.5, 0.25]);
        assert!(x.iter().chain(&fewer).all(|x| x.is_finite()), "{x:?} {fewer:?}");
    }
}
