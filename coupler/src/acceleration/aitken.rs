//! Aitken's delta-squared in its vector form.
//!
//! `w <- -w r_old.(r - r_old)/|r - r_old|^2`. Source: Irons and Tuck (1969), Int. J. Numer. Meth.
//! Engng 1, 275; Kuettler and Wall (2008), Comput. Mech. 43, 61.

use super::secants::{COMPONENTS, common};
use super::{Acceleration, Checked, check_first, relax};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Smallest |w|. Not an instability (the best w is 1/(1 + k S), and k S reaches 1e4 for a rock on a
/// wire): only there so that a vanishing factor cannot pass for convergence.
const SMALLEST: f64 = 1e-6;

/// Aitken relaxation, started anew in every window.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Aitken {
    /// Factor of the first iteration of each window, in (0, 1].
    pub initial: f64,
    /// Largest factor. Larger ones overshoot when a contact opens or closes between two iterations.
    pub largest: f64,
    #[serde(skip)]
    factor: f64,
    /// Residual of the iteration before, and its nodes.
    #[serde(skip)]
    old: Vec<f64>,
    #[serde(skip)]
    old_nodes: Vec<u32>,
}

impl Default for Aitken {
    fn default() -> Self {
        Self { initial: 0.5, largest: 2.0, factor: 0.5, old: Vec::new(), old_nodes: Vec::new() }
    }
}

impl Aitken {
    /// `r_old.(r - r_old)` and `|r - r_old|^2` over the nodes of both iterations; `None` where there is no such node.
    fn compare(&self, residual: &[f64], nodes: &[u32]) -> Option<[f64; 2]> {
        if self.old_nodes == nodes {
            return Some(products(&self.old, residual, [0.0; 2]));
        }
        let mut sums = None;
        let (old_len, len) = (COMPONENTS * self.old_nodes.len(), COMPONENTS * nodes.len());
        let blocks = self.old.chunks_exact(old_len.max(1)).zip(residual.chunks_exact(len.max(1)));
        for (old, new) in blocks {
            for (before, now) in common(&self.old_nodes, nodes) {
                let old = &old[COMPONENTS * before..][..COMPONENTS];
                let new = &new[COMPONENTS * now..][..COMPONENTS];
                sums = Some(products(old, new, sums.unwrap_or_default()));
            }
        }
        sums
    }
}

/// `sums` with `old.(new - old)` and `|new - old|^2` added.
fn products(old: &[f64], new: &[f64], [mut along, mut square]: [f64; 2]) -> [f64; 2] {
    for (new, old) in new.iter().zip(old) {
        let change = new - old;
        along += old * change;
        square += change * change;
    }
    [along, square]
}

impl Acceleration for Aitken {
    fn start_window(&mut self, most: usize) {
        self.factor = self.initial;
        self.old.clear();
        self.old_nodes.clear();
        self.old.reserve(most);
        self.old_nodes.reserve(most / COMPONENTS);
    }

    fn update(&mut self, x: &mut [f64], residual: &[f64], nodes: &[u32]) {
        match self.compare(residual, nodes) {
            None => self.factor = self.initial,
            // An unchanged residual (0/0) says nothing about the factor: keep it.
            Some([along, square]) if square > 0.0 => {
                let factor = -self.factor * along / square;
                self.factor = factor.signum() * factor.abs().clamp(SMALLEST, self.largest);
            }
            Some(_) => {}
        }
        residual.clone_into(&mut self.old);
        nodes.clone_into(&mut self.old_nodes);
        relax(x, residual, self.factor);
    }

    fn factor(&self) -> f64 {
        self.factor
    }

    fn check(&self) -> Checked {
        check_first("initial", self.initial)?;
        if self.largest < self.initial || self.largest.is_nan() {
            let what =
                format!("the largest factor {} is below the first one, {}", self.largest, self.initial);
            return Err(("largest", what));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// V-C2: scalar Aitken solves x = -r x + b in three evaluations at any r = k S. The third residual
    /// is rounding of the second update, amplified by 1 + r at most.
    #[test]
    fn aitken_needs_three_evaluations_of_a_linear_map_at_any_stiffness() {
        for ratio in [0.0625, 1.0, 6.25, 100.0, 1e4] {
            let map = |x: f64| 1.0 - ratio * x;
            let mut aitken = Aitken { initial: 0.1, ..Aitken::default() };
            aitken.start_window(3);
            let mut x = [0.3; 3];
            for _ in 0..2 {
                let residual = x.map(|x| map(x) - x);
                aitken.update(&mut x, &residual, &[0]);
            }
            let residual = (map(x[0]) - x[0]).abs();
            assert!(residual < 1e-13 * (1.0 + ratio), "residual {residual:e} at k S = {ratio}");
        }
    }

    #[test]
    fn an_unchanged_residual_keeps_the_factor_and_a_new_window_forgets_it() {
        let mut aitken = Aitken { initial: 0.25, ..Aitken::default() };
        aitken.start_window(3);
        let mut x = [0.0; 3];
        aitken.update(&mut x, &[1.0, -1.0, 0.0], &[0]);
        aitken.update(&mut x, &[1.0, -1.0, 0.0], &[0]);
        assert_eq!(aitken.factor(), 0.25);
        aitken.update(&mut x, &[0.5, -0.5, 0.0], &[0]);
        assert_ne!(aitken.factor(), 0.25);
        aitken.start_window(3);
        aitken.update(&mut x, &[1.0, -1.0, 0.0], &[0]);
        assert_eq!(aitken.factor(), 0.25);
    }

    /// Two iterations with as many nodes each, one of them in both: the factor is that of a run in which this node is alone.
    /// Compared number by number, node 5 of the first iteration would stand beside node 6 of the second.
    #[test]
    fn only_the_nodes_of_both_iterations_are_compared() {
        let (first, second) = ([1.0, 2.0, -1.0], [-0.25, 0.5, 0.5]);
        let alone = {
            let mut aitken = Aitken::default();
            aitken.start_window(6);
            aitken.update(&mut [0.0; 6], &[first, first].concat(), &[6]);
            aitken.update(&mut [0.0; 6], &[second, second].concat(), &[6]);
            aitken.factor()
        };
        let mut aitken = Aitken::default();
        aitken.start_window(12);
        aitken.update(&mut [0.0; 12], &[[7.0; 3], first, [8.0; 3], first].concat(), &[5, 6]);
        aitken.update(&mut [0.0; 12], &[second, [9.0; 3], second, [-4.0; 3]].concat(), &[6, 7]);
        assert_eq!(aitken.factor(), alone);
        assert_ne!(alone, aitken.initial);
        aitken.update(&mut [0.0; 12], &[1.0; 12], &[8, 9]);
        assert_eq!(aitken.factor(), aitken.initial, "no node of the iteration before: a fresh start");
    }

    /// x = -r x + b converges under a constant factor below 2/(1 + r), and not above it.
    #[test]
    fn constant_relaxation_converges_below_its_limit_and_diverges_above() {
        let ratio = 6.25;
        let limit = 2.0 / (1.0 + ratio);
        let last = |factor: f64| {
            let mut x = [0.3; 3];
            let mut method = super::super::Constant { factor };
            for _ in 0..200 {
                let residual = x.map(|x| 1.0 - ratio * x - x);
                method.update(&mut x, &residual, &[0]);
            }
            (1.0 - ratio * x[0] - x[0]).abs()
        };
        assert!(last(0.9 * limit) < 1e-10);
        assert!(last(1.1 * limit) > 1.0);
    }
}
