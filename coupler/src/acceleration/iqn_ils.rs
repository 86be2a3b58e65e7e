//! Interface quasi-Newton with an inverse Jacobian from a least-squares model.
//!
//! With the differences `dR` of residuals and `dH` of answers (newest first), `g = argmin |r - dR g|` and `x <- x + r - dH g`: what the
//! secants explain of the residual is removed, the rest goes into the iterate as it is. A linear interface of n unknowns is solved in
//! n + 1 iterations. It is Anderson's step with the factor 1, and a coarser filter.
//! Source: Degroote, Bathe and Vierendeels (2009), Comput. Struct. 87, 793; filter of columns by QR (QR2): Haelterman et al. (2016),
//! Comput. Struct. 171, 9.

use super::secants::{Secants, check_columns};
use super::{Acceleration, Checked, check_first, relax};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Interface quasi-Newton with an inverse Jacobian from a least-squares model (IQN-ILS), started anew in every window.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct IqnIls {
    /// Factor of the first iteration of each window, in (0, 1].
    pub initial: f64,
    /// Most earlier iterations that are used, 1 to 50.
    pub columns: usize,
    /// Windows before from which iterations are used. Contacts that open and close make them wrong: on the drop test 1 saves a tenth of
    /// the iterations, 5 cost half as many more.
    pub reused_windows: u64,
    /// Of a column newer ones must leave more than this share, else it is not used, in [0, 1).
    pub filter: f64,
    #[serde(skip)]
    secants: Box<Secants>,
}

impl Default for IqnIls {
    fn default() -> Self {
        Self { initial: 0.5, columns: 20, reused_windows: 0, filter: 1e-2, secants: Box::default() }
    }
}

impl Acceleration for IqnIls {
    fn start_window(&mut self, most: usize) {
        self.secants.start_window(most, self.columns, self.reused_windows);
    }

    fn update(&mut self, x: &mut [f64], residual: &[f64], nodes: &[u32]) {
        self.secants.remember(x, residual, nodes, self.columns);
        let reduced = self.secants.reduce(x, residual, 1.0, self.filter);
        relax(x, residual, if reduced { 1.0 } else { self.initial });
    }

    fn factor(&self) -> f64 {
        self.initial
    }

    fn memory(&mut self) -> Option<&mut Secants> {
        Some(&mut self.secants)
    }

    fn check(&self) -> Checked {
        check_first("initial", self.initial)?;
        check_columns(self.columns)?;
        if !(0.0..1.0).contains(&self.filter) {
            return Err(("filter", format!("the filter is a share in [0, 1), it is {}", self.filter)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::NoRelaxation;
    use super::super::secants::dot;
    use super::*;

    /// `H(x) = b - A x` with stiffness ratios from 0.1 to 1e3, coupled by a chain.
    fn answer(x: &[f64]) -> Vec<f64> {
        let ratio = [0.1, 3.0, 6.25, 40.0, 200.0, 1e3];
        let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
        let row = |i: usize| ratio[i] * (at(i) + 0.2 * (at(i.wrapping_sub(1)) + at(i + 1)));
        (0..x.len()).map(|i| 1.0 + 0.5 * i as f64 - row(i)).collect()
    }

    fn residual(x: &[f64]) -> Vec<f64> {
        answer(x).iter().zip(x).map(|(h, x)| h - x).collect()
    }

    fn size(r: &[f64]) -> f64 {
        dot(r, r).sqrt()
    }

    /// Iterations until the residual is below 1e-9 of its first value.
    fn iterations(method: &mut dyn Acceleration, most: usize) -> usize {
        let mut x = vec![0.3; 6];
        method.start_window(6);
        let first = size(&residual(&x));
        for iteration in 1..=most {
            let r = residual(&x);
            if size(&r) < 1e-9 * first {
                return iteration;
            }
            method.update(&mut x, &r, &[0, 1]);
        }
        most + 1
    }

    /// Six unknowns: seven iterations, and the one that finds the residual gone. Without the secants it diverges.
    #[test]
    fn a_linear_interface_is_solved_in_one_iteration_more_than_it_has_unknowns() {
        let mut method = IqnIls { filter: 1e-9, ..IqnIls::default() };
        assert!(iterations(&mut method, 50) <= 8);
        let mut plain = NoRelaxation {};
        assert_eq!(iterations(&mut plain, 50), 51, "ratios above 1 diverge");
    }

    /// The same window again: its columns are known, and one iteration is left to use them.
    #[test]
    fn columns_of_the_window_before_are_used_where_that_is_asked_for() {
        let mut fresh = IqnIls { filter: 1e-9, ..IqnIls::default() };
        let mut keeps = IqnIls { reused_windows: 1, ..fresh.clone() };
        let counts = [&mut fresh, &mut keeps].map(|method| [(); 2].map(|()| iterations(method, 50)));
        assert_eq!(counts[0][0], counts[0][1]);
        assert_eq!(counts[0][0], counts[1][0]);
        assert!(counts[1][1] <= 3, "{counts:?}");
    }

    /// The second difference of residuals is the first but for 1e-6, and so is the residual that is left: both together explain it, by
    /// steps a million times as long.
    #[test]
    fn a_column_that_newer_ones_explain_is_filtered() {
        let step = |filter: f64| {
            let mut method = IqnIls { filter, ..IqnIls::default() };
            method.start_window(3);
            let iterates = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
            let residuals = [[1.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 1e-6, 0.0]];
            let mut next = [0.0; 3];
            for (x, r) in iterates.iter().zip(&residuals) {
                next = *x;
                method.update(&mut next, r, &[0]);
            }
            let difference: Vec<f64> = next.iter().zip(&iterates[2]).map(|(a, b)| a - b).collect();
            size(&difference)
        };
        assert!(step(1e-2) < 1e-5, "{}", step(1e-2));
        assert!(step(0.0) > 1.0, "{}", step(0.0));
    }

    /// An interface that no iterate solves: nothing that is not finite comes out of it.
    #[test]
    fn an_interface_without_a_solution_gives_finite_iterates() {
        let mut method = IqnIls::default();
        method.start_window(3);
        let mut x = [0.0; 3];
        for iteration in 0..40 {
            let r = [1.0, -1.0, if iteration % 2 == 0 { 1.0 } else { -1.0 }];
            method.update(&mut x, &r, &[0]);
            assert!(x.iter().all(|x| x.is_finite()), "{x:?}");
        }
    }
}
