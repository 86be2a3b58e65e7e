//! What the multi-secant methods know of an interface: how iterate and residual changed together from one iteration to the next,
//! and whose numbers the unknowns are, so that only numbers of one node are compared between two iterations.
//!
//! With the differences `dR` of residuals as columns, `g = argmin |r - dR g|` is found by a QR factorisation, newest column first; a column
//! that newer ones explain is left out. Source: Haelterman et al. (2016), Comput. Struct. 171, 9 (filter QR2).

use super::{Checked, relax};
use serde::{Deserialize, Serialize};

/// Numbers of a node in each block: components of displacement or of velocity.
pub const COMPONENTS: usize = 3;

/// The places that each node of `new` has in `old` and in `new`, for the nodes in both. Both lists ascend.
pub fn common<'a>(old: &'a [u32], new: &'a [u32]) -> impl Iterator<Item = (usize, usize)> + 'a {
    let mut at = 0;
    new.iter().enumerate().filter_map(move |(place, node)| {
        at += old[at..].iter().take_while(|other| *other < node).count();
        (old.get(at) == Some(node)).then_some((at, place))
    })
}

/// Write `old` (blocks of [`COMPONENTS`] numbers for each of the nodes `before`) over `new` (the same for `now`), where a node is in both.
pub fn carry_over(old: &[f64], before: &[u32], new: &mut [f64], now: &[u32]) {
    let blocks = old.chunks_exact((COMPONENTS * before.len()).max(1));
    for (old, new) in blocks.zip(new.chunks_exact_mut((COMPONENTS * now.len()).max(1))) {
        for (from, to) in common(before, now) {
            new[COMPONENTS * to..][..COMPONENTS].copy_from_slice(&old[COMPONENTS * from..][..COMPONENTS]);
        }
    }
}

/// Most columns: beyond, old iterations say nothing of a contact that has opened or closed since.
const MOST_COLUMNS: usize = 50;

/// The setting `columns`.
pub fn check_columns(columns: usize) -> Checked {
    match (1..=MOST_COLUMNS).contains(&columns) {
        true => Ok(()),
        false => {
            Err(("columns", format!("1 to {MOST_COLUMNS} earlier iterations can be used, not {columns}")))
        }
    }
}

/// Differences of iterates and residuals, column by column, oldest first.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Secants {
    /// The nodes of the iteration before, whose numbers all columns hold.
    nodes: Vec<u32>,
    iterate: Vec<f64>,
    residual: Vec<f64>,
    moves: Vec<f64>,
    changes: Vec<f64>,
    /// Window of each column, as counted by `window`.
    windows: Vec<u64>,
    window: u64,
    carried: Vec<f64>,
    basis: Basis,
}

/// The differences of residuals as orthonormal vectors, newest first, and the triangle that takes these back.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct Basis {
    vectors: Vec<f64>,
    /// Row by row, `MOST_COLUMNS` numbers each.
    triangle: Vec<f64>,
    /// Which column each vector is of, counted from the oldest.
    columns: Vec<usize>,
    /// Share of each column.
    shares: Vec<f64>,
}

impl Secants {
    /// A new window of `most` unknowns at most; only columns of the `reused` windows before are kept, `columns` at most.
    pub fn start_window(&mut self, most: usize, columns: usize, reused: u64) {
        self.window += 1;
        let old = self.windows.iter().take_while(|window| **window + reused < self.window).count();
        self.forget(old);
        // Iterates of two windows are not compared: only columns outlast one.
        self.iterate.clear();
        self.residual.clear();
        for (kept, count) in [
            (&mut self.moves, columns * most),
            (&mut self.changes, columns * most),
            (&mut self.carried, columns * most),
            // One more, while a column is compared with the others.
            (&mut self.basis.vectors, (columns + 1) * most),
            (&mut self.iterate, most),
            (&mut self.residual, most),
        ] {
            kept.reserve(count.saturating_sub(kept.len()));
        }
        self.nodes.reserve((most / COMPONENTS).saturating_sub(self.nodes.len()));
        self.windows.reserve(columns.saturating_sub(self.windows.len()));
        self.basis.triangle.resize(MOST_COLUMNS * MOST_COLUMNS, 0.0);
        self.basis.columns.clear();
        self.basis.shares.clear();
        self.basis.columns.reserve(columns);
        self.basis.shares.reserve(columns);
    }

    /// Leave out the oldest `count` columns.
    fn forget(&mut self, count: usize) {
        let len = self.moves.len().checked_div(self.windows.len()).unwrap_or(0);
        self.moves.drain(..count * len);
        self.changes.drain(..count * len);
        self.windows.drain(..count);
    }

    /// Take the step from the iteration before to this one as the newest of `columns` at most. Columns say nothing of a node
    /// that they have not seen: its numbers in them are 0. With no node in common all are forgotten.
    pub fn remember(&mut self, x: &[f64], residual: &[f64], nodes: &[u32], columns: usize) {
        if self.nodes != nodes {
            self.change_nodes(x, residual, nodes);
        }
        if !self.iterate.is_empty() {
            if self.windows.len() == columns {
                self.forget(1);
            }
            self.windows.push(self.window);
            self.moves.extend(x.iter().zip(&self.iterate).map(|(new, old)| new - old));
            self.changes.extend(residual.iter().zip(&self.residual).map(|(new, old)| new - old));
        }
        x.clone_into(&mut self.iterate);
        residual.clone_into(&mut self.residual);
    }

    /// Carry all over to `nodes`. The iteration before is given the numbers of this one for nodes that it did not have: no change.
    fn change_nodes(&mut self, x: &[f64], residual: &[f64], nodes: &[u32]) {
        let Self { nodes: before, carried, iterate, moves, changes, .. } = self;
        if common(before, nodes).next().is_none() {
            iterate.clear();
            self.residual.clear();
            self.forget(self.windows.len());
        } else {
            let len = self.windows.len() * x.len();
            for kept in [moves, changes] {
                carried.clear();
                carried.resize(len, 0.0);
                replace(kept, before, carried, nodes);
            }
            if !iterate.is_empty() {
                for (kept, now) in [(iterate, x), (&mut self.residual, residual)] {
                    now.clone_into(carried);
                    replace(kept, before, carried, nodes);
                }
            }
        }
        nodes.clone_into(&mut self.nodes);
    }

    /// Take `step` times each column from `x`, in the shares with which the columns come nearest to `residual`; a column of which newer
    /// ones leave no more than the share `filter` is left out. `false`: there is no column.
    pub fn reduce(&mut self, x: &mut [f64], residual: &[f64], step: f64, filter: f64) -> bool {
        if self.windows.is_empty() {
            return false;
        }
        let len = x.len();
        self.basis.rebuild(&self.changes, len, filter);
        self.basis.solve(residual);
        for (column, share) in self.basis.columns.iter().zip(&self.basis.shares) {
            let of = column * len..(column + 1) * len;
            relax(x, &self.moves[of.clone()], -share);
            relax(x, &self.changes[of], -step * share);
        }
        true
    }
}

/// `kept`, of the nodes `before`, over `defaults`, of the nodes `now`.
fn replace(kept: &mut Vec<f64>, before: &[u32], defaults: &mut [f64], now: &[u32]) {
    carry_over(kept, before, defaults, now);
    (*defaults).clone_into(kept);
}

impl Basis {
    /// Gram-Schmidt (modified) over the columns `changes`, each of `len` numbers; what newer ones explain up to `filter` is left out.
    fn rebuild(&mut self, changes: &[f64], len: usize, filter: f64) {
        self.vectors.clear();
        self.columns.clear();
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
            if left <= filter * dot(change, change).sqrt() {
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

/// Scalar product of two vectors of equal length.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Three iterations on nodes 4 and 6, one on 6 and 9: as many numbers, one node in common.
    const NODES: [[u32; 2]; 4] = [[4, 6], [4, 6], [4, 6], [6, 9]];

    /// Any numbers, those of an iteration, a node and a component.
    fn number(iteration: usize, node: u32, component: usize) -> f64 {
        (1.0 + iteration as f64 * 1.7 + f64::from(node) * 0.37 + component as f64 * 0.91).sin()
    }

    /// What the columns take from an iterate of zeros after the four iterations, by nodes.
    fn reduced(nodes: impl Fn(usize) -> Vec<u32>) -> Vec<(u32, [f64; 3])> {
        let mut secants = Secants::default();
        secants.start_window(12, 8, 0);
        let of = |nodes: &[u32], shift: usize| -> Vec<f64> {
            nodes.iter().flat_map(|n| (0..3).map(move |c| number(shift, *n, c))).collect()
        };
        for iteration in 0..NODES.len() {
            let nodes = nodes(iteration);
            secants.remember(&of(&nodes, iteration), &of(&nodes, 10 + iteration), &nodes, 8);
        }
        let nodes = nodes(NODES.len() - 1);
        let mut x = vec![0.0; 3 * nodes.len()];
        assert!(secants.reduce(&mut x, &of(&nodes, 20), 0.5, 1e-9));
        nodes.into_iter().zip(x.as_chunks::<3>().0.iter().copied()).collect()
    }

    #[test]
    fn columns_are_compared_where_nodes_are_common_and_say_nothing_of_a_new_node() {
        let alone = reduced(|_| vec![6]);
        let found = reduced(|iteration| NODES[iteration].to_vec());
        assert!(alone[0].1.iter().all(|x| *x != 0.0));
        assert_eq!(found, [alone[0], (9, [0.0; 3])]);
    }

    #[test]
    fn with_no_node_in_common_there_is_a_fresh_start() {
        let mut secants = Secants::default();
        secants.start_window(3, 8, 0);
        for node in [1, 1, 2] {
            let numbers = [0, 1, 2].map(|c| number(3, node, c));
            secants.remember(&numbers, &numbers, &[node], 8);
        }
        assert!(!secants.reduce(&mut [0.0; 3], &[1.0; 3], 1.0, 1e-9));
    }

    proptest! {
        #[test]
        fn common_nodes_are_those_of_both_sets(a in prop::collection::btree_set(0..40u32, 0..20), b in prop::collection::btree_set(0..40u32, 0..20)) {
            let (old, new): (Vec<u32>, Vec<u32>) = (a.iter().copied().collect(), b.iter().copied().collect());
            let pairs: Vec<_> = common(&old, &new).collect();
            prop_assert!(pairs.iter().all(|&(o, n)| old[o] == new[n]));
            let found: BTreeSet<u32> = pairs.iter().map(|&(_, n)| new[n]).collect();
            prop_assert_eq!(found, a.intersection(&b).copied().collect::<BTreeSet<u32>>());
        }
    }

    #[test]
    fn each_block_is_carried_over_node_by_node() {
        let old = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0];
        let mut new = [0.0; 12];
        carry_over(&old, &[3, 7], &mut new, &[5, 7]);
        assert_eq!(new, [0.0, 0.0, 0.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 14.0, 15.0, 16.0]);
    }
}
