//! Sparse symmetric positive definite systems: the only module that names faer.
//!
//! The pattern is analysed once (fill-reducing order, shape of the factor); numbers are factorised
//! as often as they change, into memory that is kept. One thread, fixed order: equal input gives
//! equal bytes.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
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

/// A pivot is not positive: see [`Cholesky::first_not_positive`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositive;

impl Cholesky {
    /// Analyse the lower triangle of an `n` x `n` matrix: the rows of column `j`, increasing and from
    /// the diagonal on, are `rows[starts[j]..starts[j + 1]]`.
    pub fn new(n: usize, starts: Vec<usize>, rows: Vec<usize>) -> Self {
        let pattern = SymbolicSparseColMat::new_checked(n, n, starts, None, rows);
        // faer's own choice takes 3.3 ms for a net of 1 875 unknowns, blocks of columns take 1.5 ms.
        let symbolic = analyse(&pattern, SupernodalThreshold::FORCE_SUPERNODAL);
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
        self.factorised = outcome.is_ok();
        outcome.map(|_| ()).map_err(|_| NotPositive)
    }

    /// The unknown of the first pivot that is not positive, in the order of elimination; `None` if all
    /// are. Slow, and for messages: what faer tells of a failed block of columns is not its place, so the
    /// matrix is factorised anew, column by column.
    pub fn first_not_positive(&self, values: &[f64]) -> Option<usize> {
        let symbolic = analyse(&self.pattern, SupernodalThreshold::FORCE_SIMPLICIAL);
        let mut factor = vec![0.0; symbolic.len_val()];
        let need = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let outcome = symbolic.factorize_numeric_llt(
            &mut factor,
            SparseColMatRef::new(self.pattern.as_ref(), values),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(need)),
            Default::default(),
        );
        // There it counts columns from 1, in its own order.
        let LltError::NonPositivePivot { index } = outcome.err()?;
        Some(symbolic.perm().map_or(index - 1, |perm| perm.arrays().0[index - 1]))
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

fn analyse(pattern: &SymbolicSparseColMat<usize>, threshold: SupernodalThreshold) -> SymbolicCholesky<usize> {
    let parameters = CholeskySymbolicParams {
        amd_params: Default::default(),
        supernodal_flop_ratio_threshold: threshold,
        supernodal_params: SymbolicSupernodalParams::default(),
    };
    factorize_symbolic_cholesky(pattern.as_ref(), Side::Lower, SymmetricOrdering::Amd, parameters)
        .expect("indices and memory suffice for a pattern that exists already")
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
            assert_eq!(cholesky.first_not_positive(&values(n, |_| diagonal)), None);
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
        let n = 40;
        for bad in [0, 17, 39] {
            let mut diagonal = Cholesky::new(n, (0..=n).collect(), (0..n).collect());
            let numbers: Vec<f64> = (0..n).map(|i| if i == bad { 0.0 } else { 1.0 }).collect();
            assert_eq!(diagonal.factorise(&numbers), Err(NotPositive));
            assert_eq!(diagonal.first_not_positive(&numbers), Some(bad));
            let starts = (0..=n).map(|j| j * n - j * j.saturating_sub(1) / 2).collect();
            let rows = (0..n).flat_map(|j| j..n).collect();
            let mut dense = Cholesky::new(n, starts, rows);
            let numbers: Vec<f64> = (0..n)
                .flat_map(|j| {
                    (j..n).map(move |i| if i == j { if j == bad { -1.0 } else { 2.0 } } else { 1e-3 })
                })
                .collect();
            assert_eq!(dense.factorise(&numbers), Err(NotPositive));
            assert_eq!(dense.first_not_positive(&numbers), Some(bad));
        }
    }
}
