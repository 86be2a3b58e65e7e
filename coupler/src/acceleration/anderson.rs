//! Anderson acceleration: the residuals of earlier iterations of the window are combined to the smallest one.
//!
//! With the differences `dR` of residuals and `dX` of iterates (newest last), `g = argmin |r - dR g|` and
//! `x <- x - dX g + b (r - dR g)`. On a linear interface of n unknowns it ends after n + 1 iterations; it is the family to which
//! the quasi-Newton methods of IQN-ILS belong, and with one column and one unknown it is Aitken's.
//! Source: Anderson (1965), J. ACM 12, 547; Walker and Ni (2011), SIAM J. Numer. Anal. 49, 1715; filter of columns: Haelterman
//! et al. (2016), Comput. Struct. 171, 9.

use super::secants::{Secants, check_columns};
use super::{Acceleration, Checked, check_first, relax};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    secants: Box<Secants>,
}

impl Default for Anderson {
    fn default() -> Self {
        Self { initial: 0.5, columns: 8, secants: Box::default() }
    }
}

impl Acceleration for Anderson {
    fn start_window(&mut self, most: usize) {
        self.secants.start_window(most, self.columns, 0);
    }

    fn update(&mut self, x: &mut [f64], residual: &[f64], nodes: &[u32]) {
        self.secants.remember(x, residual, nodes, self.columns);
        relax(x, residual, self.initial);
        self.secants.reduce(x, residual, self.initial, FILTER);
    }

    fn factor(&self) -> f64 {
        self.initial
    }

    fn memory(&mut self) -> Option<&mut Secants> {
        Some(&mut self.secants)
    }

    fn check(&self) -> Checked {
        check_first("initial", self.initial)?;
        check_columns(self.columns)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Aitken;
    use super::super::secants::dot;
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
            method.update(&mut x, &r, &[0, 1]);
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
            method.start_window(3);
            let mut x = [0.3, 0.0, 0.0];
            for _ in 0..2 {
                let residual = [1.0 - ratio * x[0] - x[0], 0.0, 0.0];
                method.update(&mut x, &residual, &[0]);
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
        method.start_window(6);
        let mut x = [0.0; 6];
        for _ in 0..4 {
            method.update(&mut x, &[1.0, 0.5, -0.5, 0.0, 0.0, 0.0], &[3, 4]);
        }
        let mut fewer = [x[0], x[1], x[2]];
        method.update(&mut fewer, &[0.5, 0.25, 0.0], &[3]);
        assert!(x.iter().chain(&fewer).all(|x| x.is_finite()), "{x:?} {fewer:?}");
    }
}
