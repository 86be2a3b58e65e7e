//! Sparse symmetric systems, positive definite or not.
//!
//! The pattern is analysed once ([`crate::linear_algebra::elimination`]); numbers are factorised as often as they change by [`Fronts`],
//! into memory that is kept. One thread, fixed order: equal input gives equal bytes.

use crate::linear_algebra::elimination::analyse;
use crate::linear_algebra::multifrontal::{Fronts, factorise};
use crate::linear_algebra::signed::Signed;

/// Cholesky factorisation of a sparse matrix whose lower triangle has a fixed pattern.
pub struct Cholesky {
    fronts: Fronts,
    factor: Vec<f64>,
    /// Updates that fronts leave to their parents.
    rest: Vec<f64>,
    work: Vec<f64>,
    factorised: bool,
    /// Signs of the pivots; used while `indefinite`.
    signed: Signed,
    indefinite: bool,
    /// Place of the diagonal entry of each unknown among the values.
    diagonal: Vec<usize>,
}

impl Cholesky {
    /// Analyse the lower triangle of an `n` x `n` matrix: the rows of column `j`, increasing and from
    /// the diagonal on, are `rows[starts[j]..starts[j + 1]]`.
    pub fn new(n: usize, starts: &[usize], rows: &[usize]) -> Self {
        let fronts = analyse(n, starts, rows);
        let (factor, rest) = (vec![0.0; fronts.factor_len], vec![0.0; fronts.rest_len]);
        let work = vec![0.0; fronts.work_len()];
        let (signed, diagonal) = (Signed::default(), starts[..n].to_vec());
        Self { fronts, factor, rest, work, factorised: false, signed, indefinite: false, diagonal }
    }

    /// Numbers in the factor.
    pub fn factor_len(&self) -> usize {
        self.factor.len()
    }

    /// Factorise the matrix with `values` in the order of the pattern. The error is the first unknown, in the order of
    /// elimination, whose pivot is not positive.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), usize> {
        self.run(values, false)
    }

    /// Factorise the matrix with `values`, whatever the signs of its pivots; returns how many are negative. Pivots that are
    /// too small were replaced: solutions are then to be refined. The error is a matrix of no numbers.
    pub fn factorise_signed(&mut self, values: &[f64]) -> Result<usize, usize> {
        let unknowns = self.fronts.unknowns.iter();
        self.signed.begin(unknowns.map(|unknown| values[self.diagonal[*unknown]]));
        self.run(values, true).map(|()| self.signed.negative())
    }

    fn run(&mut self, values: &[f64], indefinite: bool) -> Result<(), usize> {
        let Self { fronts, factor, rest, signed, .. } = self;
        let signed = indefinite.then_some(signed);
        let outcome = factorise(fronts, values, factor, rest, signed);
        (self.factorised, self.indefinite) = (outcome.is_ok(), indefinite);
        outcome
    }

    /// The unknown of the first negative pivot of the last factorisation, if there is one.
    pub fn first_negative(&self) -> Option<usize> {
        let column = self.signed.signs.iter().position(|s| *s < 0.0);
        column.filter(|_| self.indefinite).map(|column| self.fronts.unknowns[column])
    }

    /// Logarithm of the magnitude of the determinant of what was factorised.
    pub fn log_determinant(&self) -> f64 {
        self.fronts.log_determinant(&self.factor)
    }

    /// Solve for `x`, which holds the right-hand side. The last factorisation must have succeeded.
    pub fn solve(&mut self, x: &mut [f64]) {
        assert!(self.factorised, "solve follows a factorisation that succeeded");
        let signs: &[f64] = if self.indefinite { &self.signed.signs } else { &[] };
        self.fronts.solve(&self.factor, signs, x, &mut self.work);
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
        let mut random = crate::element::tests::checks::random(11);
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
    fn an_indefinite_matrix_is_solved_and_its_negative_eigenvalues_are_counted() {
        // A chain of springs on ground that pushes: eigenvalues 2 - 2 cos(pi k / (n + 1)) - shift, in closed form.
        for (n, shift) in [(1, 3.0), (5, 0.5), (40, 0.7), (40, 3.1), (131, 1.9), (131, 4.5)] {
            let (starts, rows) = chain(n);
            let mut signed = Cholesky::new(n, &starts, &rows);
            let eigenvalue =
                |k: usize| 2.0 - 2.0 * (std::f64::consts::PI * k as f64 / (n + 1) as f64).cos() - shift;
            let exact = (1..=n).filter(|k| eigenvalue(*k) < 0.0).count();
            let numbers = values(n, |_| 2.0 - shift);
            assert_eq!(signed.factorise_signed(&numbers), Ok(exact), "{n} {shift}");
            let log: f64 = (1..=n).map(|k| eigenvalue(k).abs().ln()).sum();
            // Pivots of a chain grow and fall; each of n is rounded.
            assert!((signed.log_determinant() - log).abs() < 1e-9 * n as f64, "{n} {shift}");
            let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
            let product = |x: &[f64], i: usize| {
                let left = if i > 0 { x[i - 1] } else { 0.0 };
                let right = if i + 1 < n { x[i + 1] } else { 0.0 };
                (2.0 - shift) * x[i] - left - right
            };
            let mut b: Vec<f64> = (0..n).map(|i| product(&x, i)).collect();
            let rhs = b.clone();
            signed.solve(&mut b);
            // One round of refinement: pivots close to 0 cost digits.
            let mut rest: Vec<f64> = (0..n).map(|i| rhs[i] - product(&b, i)).collect();
            signed.solve(&mut rest);
            let least = (1..=n).map(|k| eigenvalue(k).abs()).fold(f64::INFINITY, f64::min);
            for i in 0..n {
                let error = (b[i] + rest[i] - x[i]).abs();
                assert!(error < 1e3 * f64::EPSILON * 5.0 / least, "{n} {shift}: {error}");
            }
        }
    }

    #[test]
    fn a_first_pivot_of_zero_is_replaced_and_refined_away() {
        // [[0, 1], [1, 1]] has the eigenvalues (1 + sqrt 5) / 2 and (1 - sqrt 5) / 2.
        let mut signed = Cholesky::new(2, &[0, 2, 3], &[0, 1, 1]);
        assert_eq!(signed.factorise_signed(&[0.0, 1.0, 1.0]), Ok(1));
        assert_eq!((signed.signed.replaced, signed.first_negative()), (1, Some(1)));
        let (b, mut x) = ([2.0, 3.0], [0.0, 0.0]);
        for _ in 0..6 {
            let mut rest = [b[0] - x[1], b[1] - x[0] - x[1]];
            signed.solve(&mut rest);
            (x[0], x[1]) = (x[0] + rest[0], x[1] + rest[1]);
        }
        assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12, "{x:?}");
        // Where nothing at all is, nothing is solved.
        assert!(signed.factorise_signed(&[0.0; 3]).is_err());
    }

    #[test]
    fn whatever_its_signs_a_matrix_of_any_pattern_is_solved_and_counted_as_it_is() {
        // Links of either sign between unknowns at random: the count against that of the dense eigenvalues.
        let mut random = crate::element::tests::checks::random(17);
        for (n, links) in [(7, 9), (30, 20), (61, 100), (120, 400), (60, 4000)] {
            let mut dense = nalgebra::DMatrix::<f64>::zeros(n, n);
            (0..n).for_each(|i| dense[(i, i)] = 2.0 * random());
            for _ in 0..links {
                let mut any = || (((random() + 0.5) * n as f64) as usize).min(n - 1);
                let (i, j) = (any(), any());
                let k = random();
                (dense[(i, j)], dense[(j, i)]) = (k, k);
            }
            let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
            for j in 0..n {
                for i in (j..n).filter(|i| *i == j || dense[(*i, j)] != 0.0) {
                    rows.push(i);
                    values.push(dense[(i, j)]);
                }
                starts.push(rows.len());
            }
            let exact = dense.symmetric_eigenvalues().iter().filter(|e| **e < 0.0).count();
            let mut signed = Cholesky::new(n, &starts, &rows);
            assert_eq!(signed.factorise_signed(&values), Ok(exact), "{n} {links}");
            let b = nalgebra::DVector::from_fn(n, |_, _| random());
            let mut x = nalgebra::DVector::<f64>::zeros(n);
            for _ in 0..3 {
                let mut rest = &b - &dense * &x;
                signed.solve(rest.as_mut_slice());
                x += rest;
            }
            let left = (&b - &dense * &x).amax();
            assert!(left < 1e-10 * dense.amax() * x.amax(), "{n} {links}: {left}");
        }
    }

    #[test]
    fn nodes_of_any_number_of_unknowns_are_eliminated_together() {
        // A square of nodes with one to six unknowns, each linked to all of its neighbours.
        let (side, mut random) = (14, crate::element::tests::checks::random(3));
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
            assert_eq!(diagonal.factorise(&numbers), Err(bad));
            let starts: Vec<usize> = (0..=n).map(|j| j * n - j * j.saturating_sub(1) / 2).collect();
            let rows: Vec<usize> = (0..n).flat_map(|j| j..n).collect();
            let mut dense = Cholesky::new(n, &starts, &rows);
            let numbers: Vec<f64> = (0..n)
                .flat_map(|j| {
                    (j..n).map(move |i| if i == j { if j == bad { -1.0 } else { 2.0 } } else { 1e-3 })
                })
                .collect();
            assert_eq!(dense.factorise(&numbers), Err(bad));
        }
    }
}
