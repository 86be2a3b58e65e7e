//! Nodes of the interface mesh that fields are laid out for: all of them, or those that were selected.

use crate::linear_algebra::node_major::{difference_to_node_major, to_component_major, to_node_major};

/// The nodes that fields are laid out for. They are nodes of the structure, in the same order.
#[derive(Debug, Clone)]
pub struct Shown {
    /// Nodes of the structure.
    count: usize,
    /// Whether all are shown; those that are selected otherwise.
    all: bool,
    selected: Vec<u32>,
    /// Their degrees of freedom, ascending.
    dofs: Vec<u32>,
}

impl Shown {
    /// All of so many nodes.
    pub fn all(count: usize) -> Self {
        Self { count, all: true, selected: Vec::with_capacity(count), dofs: Vec::with_capacity(3 * count) }
    }

    /// From now on these nodes, or all.
    pub fn select(&mut self, nodes: Option<&[u32]>) {
        self.all = nodes.is_none();
        self.selected.clear();
        self.selected.extend_from_slice(nodes.unwrap_or_default());
        self.dofs.clear();
        for c in 0..3 {
            self.dofs.extend(self.selected.iter().map(|node| (c * self.count) as u32 + node));
        }
    }

    /// Degrees of freedom of the selected nodes, ascending; `None` while all nodes are shown.
    pub fn dofs(&self) -> Option<&[u32]> {
        (!self.all).then_some(&self.dofs[..])
    }

    /// The nodes that are selected; none if all are shown.
    pub fn selected(&self) -> &[u32] {
        &self.selected
    }

    /// The difference `a - b` of two vectors over all degrees of freedom, at these nodes, node-major.
    pub fn difference(&self, a: &[f64], b: &[f64], to: &mut [f64]) {
        if self.all {
            return difference_to_node_major(a, b, self.count, to);
        }
        self.gather(to, |dof| a[dof] - b[dof]);
    }

    /// A vector over all degrees of freedom at these nodes, node-major.
    pub fn take(&self, of: &[f64], to: &mut [f64]) {
        if self.all {
            return to_node_major(of, self.count, to);
        }
        self.gather(to, |dof| of[dof]);
    }

    fn gather(&self, to: &mut [f64], value: impl Fn(usize) -> f64) {
        let (vectors, _) = to.as_chunks_mut::<3>();
        for (vector, node) in vectors.iter_mut().zip(&self.selected) {
            let node = *node as usize;
            *vector = [value(node), value(self.count + node), value(2 * self.count + node)];
        }
    }

    /// From node-major at these nodes to component-major; other nodes stay as they are.
    pub fn put(&self, from: &[f64], to: &mut [f64]) {
        if self.all {
            return to_component_major(from, self.count, to);
        }
        let (vectors, _) = from.as_chunks::<3>();
        for (vector, node) in vectors.iter().zip(&self.selected) {
            for (c, value) in vector.iter().enumerate() {
                to[c * self.count + *node as usize] = *value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn selected_nodes_are_those_of_all() {
        let of: Vec<f64> = (0..12).map(f64::from).collect();
        let base = vec![1.0; 12];
        let mut shown = Shown::all(4);
        let (mut all, mut some) = ([0.0; 12], [0.0; 6]);
        shown.difference(&of, &base, &mut all);
        shown.select(Some(&[1, 3]));
        shown.difference(&of, &base, &mut some);
        assert_eq!((&some[..3], &some[3..]), (&all[3..6], &all[9..]));
        let mut back = vec![-1.0; 12];
        shown.put(&some, &mut back);
        assert_eq!(shown.dofs(), Some(&[1, 3, 5, 7, 9, 11][..]));
        assert_eq!(back, [-1.0, 0.0, -1.0, 2.0, -1.0, 4.0, -1.0, 6.0, -1.0, 8.0, -1.0, 10.0]);
        shown.select(None);
        shown.take(&of, &mut all);
        assert_eq!(all[..3], [0.0, 4.0, 8.0]);
    }
}
