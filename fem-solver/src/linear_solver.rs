//! Sparse symmetric positive definite systems: the only module that names faer.
//!
//! The pattern is analysed once (fill-reducing order, shape of the factor); numbers are factorised
//! as often as they change, into memory that is kept. One thread, fixed order: equal input gives
//! equal bytes.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};

/// Cholesky factorisation of a sparse matrix whose lower triangle has a fixed pattern.
pub struct Cholesky {
    pattern: SymbolicSparseColMat<usize>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    memory: MemBuffer,
    factorised: bool,
}

/// A pivot is not positive: the matrix holds no stable equilibrium in this unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositive {
    /// The unknown.
    pub unknown: usize,
}

impl Cholesky {
    /// Analyse the lower triangle of an `n` x `n` matrix: the rows of column `j`, increasing and from
    /// the diagonal on, are `rows[starts[j]..starts[j + 1]]`.
    pub fn new(n: usize, starts: Vec<usize>, rows: Vec<usize>) -> Self {
        let pattern = SymbolicSparseColMat::new_checked(n, n, starts, None, rows);
        let parameters = CholeskySymbolicParams {
            amd_params: Default::default(),
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            supernodal_params: SymbolicSupernodalParams::default(),
        };
        let symbolic =
            factorize_symbolic_cholesky(pattern.as_ref(), Side::Lower, SymmetricOrdering::Amd, parameters)
                .expect("indices and memory suffice for a pattern that exists already");
        let factor = vec![0.0; symbolic.len_val()];
        let need =
            symbolic
                .factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
                .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        Self { pattern, symbolic, factor, memory: MemBuffer::new(need), factorised: false }
    }

    /// Numbers in the factor.
    pub fn factor_len(&self) -> usize {
        self.factor.len()
    }

    /// Factorise the matrix with `values` in the order of the pattern.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), NotPositive> {
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), values);
        let outcome = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            matrix,
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        );
        let failed_at = outcome.err().map(|LltError::NonPositivePivot { index }| index);
        self.factorised = failed_at.is_none();
        match failed_at {
            None => Ok(()),
            Some(index) => Err(NotPositive { unknown: self.unknown(index) }),
        }
    }

    /// The unknown of a failed pivot: faer counts in its own order, from 1 in its simplicial
    /// factorisation and from 0 in its supernodal one.
    fn unknown(&self, index: usize) -> usize {
        let index = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(_) => index - 1,
            SymbolicCholeskyRaw::Supernodal(_) => index,
        };
        self.symbolic.perm().map_or(index, |perm| perm.arrays().0[index])
    }

    /// Solve for `x`, which holds the right-hand side. The last factorisation must have succeeded.
    pub fn solve(&mut self, x: &mut [f64]) {
        assert!(self.factorised, "solve follows a factorisation that succeeded");
        let factor = LltRef::new(&self.symbolic, &self.factor);
        let n = x.len();
        let rhs = MatMut::from_column_major_slice_mut(x, n, 1);
        factor.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut self.memory));
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
        let mut cholesky = Cholesky::new(n, starts, rows);
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
    fn a_pivot_that_is_not_positive_is_named() {
        // A dense block takes faer's supernodal path, a diagonal its simplicial one.
        let n = 40;
        for bad in [0, 17, 39] {
            let mut diagonal = Cholesky::new(n, (0..=n).collect(), (0..n).collect());
            let numbers: Vec<f64> = (0..n).map(|i| if i == bad { 0.0 } else { 1.0 }).collect();
            assert_eq!(diagonal.factorise(&numbers), Err(NotPositive { unknown: bad }));
            let starts = (0..=n).map(|j| j * n - j * j.saturating_sub(1) / 2).collect();
            let rows = (0..n).flat_map(|j| j..n).collect();
            let mut dense = Cholesky::new(n, starts, rows);
            let numbers: Vec<f64> = (0..n)
                .flat_map(|j| {
                    (j..n).map(move |i| if i == j { if j == bad { -1.0 } else { 2.0 } } else { 1e-3 })
                })
                .collect();
            assert_eq!(dense.factorise(&numbers), Err(NotPositive { unknown: bad }));
        }
    }
}
