//! Sparse symmetric positive definite systems.
//!
//! The pattern is analysed once ([`crate::elimination`]); numbers are factorised as often as they change by [`Fronts`],
//! into memory that is kept. One thread, fixed order: on one machine equal input gives equal bytes.

use crate::elimination::analyse;
use crate::fronts::Fronts;

/// Cholesky factorisation of a sparse matrix whose lower triangle has a fixed pattern.
pub struct Cholesky {
    fronts: Fronts,
    factor: Vec<f64>,
    /// What fronts leave to their parents.
    rest: Vec<f64>,
    work: Vec<f64>,
    factorised: bool,
}

/// A pivot is not positive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositive {
    /// The unknown of the first such pivot in the order of elimination.
    pub unknown: usize,
}

impl Cholesky {
    /// Analyse the lower triangle of an `n` x `n` matrix: the rows of column `j`, increasing and from
    /// the diagonal on, are `rows[starts[j]..starts[j + 1]]`.
    pub fn new(n: usize, starts: &[usize], rows: &[usize]) -> Self {
        let fronts = analyse(n, starts, rows);
        let (factor, rest) = (vec![0.0; fronts.factor_len()], vec![0.0; fronts.rest_len()]);
        let work = vec![0.0; fronts.work_len()];
        Self { fronts, factor, rest, work, factorised: false }
    }

    /// Numbers in the factor.
    pub fn factor_len(&self) -> usize {
        self.factor.len()
    }

    /// Factorise the matrix with `values` in the order of the pattern.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), NotPositive> {
        let outcome = self.fronts.factorise(values, &mut self.factor, &mut self.rest);
        self.factorised = outcome.is_ok();
        outcome.map_err(|unknown| NotPositive { unknown })
    }

    /// Solve for `x`, which holds the right-hand side. The last factorisation must have succeeded.
    pub fn solve(&mut self, x: &mut [f64]) {
        assert!(self.factorised, "solve follows a factorisation that succeeded");
        self.fronts.solve(&self.factor, x, &mut self.work);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chain of springs: tridiagonal with `diagonal`, off-diagonal -1.
    fn chain(n: usize) -> (Vec<usize>, Vec<usize>) {
        let starts = (0..=n).map(|j| if j < n { 2 * j } else { 2 * n - 1 }).collect();
        let rows = (0..n).flat_map(|j| [j, j + 1]).take(2 * n - 1).collect();
        (starts, rows)
    }

    fn values(n: usize, diagonal: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..n).flat_map(|j| [diagonal(j), -1.0]).take(2 * n - 1).collect()
    }

    #[test]
    fn a_chain_is_solved_again_and_again_on_one_analysis() {
        let n = 50;
        let (starts, rows) = chain(n);
        let mut cholesky = Cholesky::new(n, &starts, &rows);
        for diagonal in [2.0, 3.0, 2.5] {
            cholesky.factorise(&values(n, |_| diagonal)).expect("is positive definite");
            let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
            let mut b: Vec<f64> = (0..n)
                .map(|i| {
                    let left = if i > 0 { x[i - 1] } else { 0.0 };
                    let right = if i + 1 < n { x[i + 1] } else { 0.0 };
                    diagonal * x[i] - left - right
                })
                .collect();
            cholesky.solve(&mut b);
            // Condition number of the chain is at most (n + 1)^2 / 2.5: eps times that.
            let worst = b.iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < f64::EPSILON * 1100.0, "{worst}");
        }
    }

    #[test]
    fn whatever_the_pattern_the_solution_leaves_no_residual() {
        let mut random = crate::element::checks::random(11);
        for (n, links) in [(1, 0), (2, 1), (7, 9), (30, 20), (61, 100), (200, 150), (200, 900), (90, 9000)] {
            // Links with stiffness from 0 to 1 between unknowns at random, some in parts of their own; ground of 0.1.
            let mut dense = vec![0.0; n * n];
            (0..n).for_each(|i| dense[i * n + i] = 0.1);
            for _ in 0..links {
                let mut any = || (((random() + 0.5) * n as f64) as usize).min(n - 1);
                let (i, j) = (any(), any());
                if i != j {
                    let k = random() + 0.5;
                    for (a, b, k) in [(i, i, k), (j, j, k), (i, j, -k), (j, i, -k)] {
                        dense[a * n + b] += k;
                    }
                }
            }
            let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
            for j in 0..n {
                for i in (j..n).filter(|i| dense[i * n + j] != 0.0) {
                    rows.push(i);
                    values.push(dense[i * n + j]);
                }
                starts.push(rows.len());
            }
            let mut cholesky = Cholesky::new(n, &starts, &rows);
            let b: Vec<f64> = (0..n).map(|_| random()).collect();
            let mut solve = || {
                cholesky.factorise(&values).expect("is positive definite");
                let mut x = b.clone();
                cholesky.solve(&mut x);
                x
            };
            let x = solve();
            assert_eq!(x, solve(), "equal input gives equal bytes");
            let largest = (0..n).map(|i| dense[i * n + i]).fold(0.0, f64::max);
            let size = x.iter().fold(0.0, |a, b| f64::max(a, b.abs()));
            for i in 0..n {
                let left: f64 = (0..n).map(|j| dense[i * n + j] * x[j]).sum();
                // Backward error of Cholesky's method: about n eps |A| |x| (Higham, 2002, theorem 10.3).
                let bound = 4.0 * (n + 1) as f64 * f64::EPSILON * largest * size;
                assert!((left - b[i]).abs() <= bound, "{n} {links}: {left} is not {}", b[i]);
            }
        }
    }

    #[test]
    fn nodes_of_any_number_of_unknowns_are_eliminated_together() {
        // A square of nodes with one to six unknowns, each linked to all of its neighbours.
        let (side, mut random) = (14, crate::element::checks::random(3));
        let widths: Vec<usize> = (0..side * side).map(|i| [3, 2, 6, 1, 3][i % 5]).collect();
        let first: Vec<usize> = widths.iter().scan(0, |n, w| Some(std::mem::replace(n, *n + w))).collect();
        let unknowns = |node: usize| first[node]..first[node] + widths[node];
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for node in 0..side * side {
            let right = (node % side + 1 < side).then_some(node + 1);
            let above = (node + side < side * side).then_some(node + side);
            for j in unknowns(node) {
                for i in
                    [Some(node), right, above].into_iter().flatten().flat_map(unknowns).filter(|i| *i >= j)
                {
                    rows.push(i);
                    // At most 30 others of at most 1/2 stand in a row.
                    values.push(if i == j { 16.0 } else { random() });
                }
                starts.push(rows.len());
            }
        }
        let n = starts.len() - 1;
        let mut cholesky = Cholesky::new(n, &starts, &rows);
        cholesky.factorise(&values).expect("is positive definite");
        let b: Vec<f64> = (0..n).map(|_| random()).collect();
        let mut x = b.clone();
        cholesky.solve(&mut x);
        let mut left = vec![0.0; n];
        for j in 0..n {
            for (i, value) in rows[starts[j]..starts[j + 1]].iter().zip(&values[starts[j]..]) {
                left[*i] += value * x[j];
                left[j] += if *i == j { 0.0 } else { value * x[*i] };
            }
        }
        // As above, and no row of the factor holds more than n numbers.
        let size = x.iter().fold(0.0, |a, b| f64::max(a, b.abs()));
        let bound = 4.0 * (n + 1) as f64 * f64::EPSILON * 16.0 * size;
        for (left, b) in left.iter().zip(&b) {
            assert!((left - b).abs() <= bound, "{left} is not {b}");
        }
    }

    #[test]
    fn without_unknowns_there_is_nothing_to_do() {
        let mut none = Cholesky::new(0, &[0], &[]);
        none.factorise(&[]).expect("nothing can fail");
        none.solve(&mut []);
    }

    #[test]
    fn a_pivot_that_is_not_positive_is_named() {
        let n = 40;
        for bad in [0, 17, 39] {
            let mut diagonal = Cholesky::new(n, &(0..=n).collect::<Vec<_>>(), &(0..n).collect::<Vec<_>>());
            let numbers: Vec<f64> = (0..n).map(|i| if i == bad { 0.0 } else { 1.0 }).collect();
            assert_eq!(diagonal.factorise(&numbers), Err(NotPositive { unknown: bad }));
            let starts: Vec<usize> = (0..=n).map(|j| j * n - j * j.saturating_sub(1) / 2).collect();
            let rows: Vec<usize> = (0..n).flat_map(|j| j..n).collect();
            let mut dense = Cholesky::new(n, &starts, &rows);
            let numbers: Vec<f64> = (0..n)
                .flat_map(|j| {
                    (j..n).map(move |i| if i == j { if j == bad { -1.0 } else { 2.0 } } else { 1e-3 })
                })
                .collect();
            assert_eq!(dense.factorise(&numbers), Err(NotPositive { unknown: bad }));
        }
    }
}
