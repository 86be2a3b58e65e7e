//! Which nodes of the interface mesh are sent: all of them, or those that a contact solver may reach, so that a window costs
//! what is in reach and not what the net is.

use crate::field::Items;
use crate::mesh::InterfaceMesh;
use serde::{Deserialize, Serialize};

/// Nodes that were selected, and what of the mesh lies between them.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// Their numbers in the mesh, ascending.
    pub nodes: Vec<u32>,
    /// Lines whose nodes are all selected, in the mesh's order.
    pub lines: Vec<u32>,
    /// Faces likewise.
    pub faces: Vec<u32>,
    /// Coupled nodes, as places in `nodes`: first not above second, each node with itself; as the structure says.
    pub pairs: Vec<[u32; 2]>,
    /// Place of each node of the mesh in `nodes`; [`Selection::OUT`] if it is not selected.
    place: Vec<u32>,
}

/// What a [`Selection`] is made of again.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Selected {
    nodes: Vec<u32>,
    pairs: Vec<[u32; 2]>,
}

impl Selection {
    /// Place of a node that is not selected.
    pub const OUT: u32 = u32::MAX;

    /// Nothing of `mesh`, with room for all of it.
    pub fn new(mesh: &InterfaceMesh) -> Self {
        let all = Items::of(mesh);
        Self {
            nodes: Vec::with_capacity(all.nodes),
            lines: Vec::with_capacity(all.lines),
            faces: Vec::with_capacity(all.faces),
            pairs: Vec::with_capacity(4 * all.nodes),
            place: vec![Self::OUT; all.nodes],
        }
    }

    /// Select `nodes` of `mesh`; pairs are to be filled in. Errs with what is wrong with the list.
    pub fn set(&mut self, mesh: &InterfaceMesh, nodes: impl Iterator<Item = u32>) -> Result<(), String> {
        for node in self.nodes.drain(..) {
            self.place[node as usize] = Self::OUT;
        }
        self.lines.clear();
        self.faces.clear();
        self.pairs.clear();
        for node in nodes {
            let known = self.nodes.len() as u32;
            match self.place.get_mut(node as usize) {
                None => return Err(format!("node {node} is selected, there are {}", self.place.len())),
                Some(place) => *place = known,
            }
            if let Some(last) = self.nodes.last().filter(|last| **last >= node) {
                return Err(format!("node {node} is selected after node {last}"));
            }
            self.nodes.push(node);
        }
        let within = |ends: &[u32]| ends.iter().all(|n| self.place[*n as usize] != Self::OUT);
        let lines = mesh.lines.iter().enumerate().filter(|(_, ends)| within(*ends));
        self.lines.extend(lines.map(|(line, _)| line as u32));
        let faces = mesh.faces.iter().enumerate().filter(|(_, ends)| within(*ends));
        self.faces.extend(faces.map(|(face, _)| face as u32));
        Ok(())
    }

    /// What is selected, to be kept.
    pub fn selected(&self) -> Selected {
        Selected { nodes: self.nodes.clone(), pairs: self.pairs.clone() }
    }

    /// Select in `mesh` what was kept. Errs with what is wrong with the list.
    pub fn select_again(&mut self, mesh: &InterfaceMesh, kept: Selected) -> Result<(), String> {
        self.set(mesh, kept.nodes.into_iter())?;
        self.pairs.extend(kept.pairs);
        Ok(())
    }

    /// Place of a node of the mesh, if it is selected.
    pub fn place(&self, node: u32) -> Option<usize> {
        self.place.get(node as usize).filter(|place| **place != Self::OUT).map(|place| *place as usize)
    }

    /// How many items its fields have.
    pub fn items(&self) -> Items {
        Items {
            nodes: self.nodes.len(),
            lines: self.lines.len(),
            faces: self.faces.len(),
            pairs: self.pairs.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_faces_belong_to_it_with_all_their_nodes() {
        let mesh = InterfaceMesh {
            coordinates: vec![0.0; 15],
            lines: vec![[0, 1], [1, 2], [2, 3], [3, 1]],
            faces: vec![[0, 1, 2], [1, 2, 3]],
            ..Default::default()
        };
        let mut selection = Selection::new(&mesh);
        selection.set(&mesh, [1, 2, 3].into_iter()).expect("nodes of the mesh");
        assert_eq!((selection.lines.as_slice(), selection.faces.as_slice()), (&[1, 2, 3][..], &[1][..]));
        assert_eq!((selection.place(2), selection.place(0), selection.place(9)), (Some(1), None, None));
        selection.set(&mesh, [0].into_iter()).expect("a node of the mesh");
        assert_eq!((selection.lines.len(), selection.place(2)), (0, None));
        assert_eq!(selection.items(), Items { nodes: 1, ..Items::default() });
        let wrong =
            |nodes: &[u32]| Selection::new(&mesh).set(&mesh, nodes.iter().copied()).expect_err("refused");
        assert!(wrong(&[0, 5]).contains("node 5 is selected, there are 5"));
        assert!(wrong(&[2, 2]).contains("node 2 is selected after node 2"));
    }
}
