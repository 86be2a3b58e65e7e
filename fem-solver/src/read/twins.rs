//! Elements that Gmsh 2.2 writes once for each of their physical groups.

use super::mesh::Builder;
use std::collections::HashMap;

/// Elements of one entity and shape in version 2.2, which writes an element that is in two physical
/// groups twice.
#[derive(Default)]
pub struct Written {
    /// Physical group of the first.
    physical: i64,
    elements: Vec<u32>,
    /// Elements by their nodes, from where a second physical group appears.
    by_nodes: Option<HashMap<[u32; 6], u32>>,
}

impl Written {
    /// The element with these nodes that was written for another physical group.
    pub fn twin(&mut self, builder: &Builder, physical: i64, nodes: &[u32; 6]) -> Option<u32> {
        if self.elements.is_empty() {
            self.physical = physical;
        }
        if self.by_nodes.is_none() {
            if self.physical == physical {
                return None;
            }
            let key = |element: &u32| (padded(builder.nodes_of(*element)), *element);
            self.by_nodes = Some(self.elements.iter().map(key).collect());
        }
        self.by_nodes.as_ref()?.get(nodes).copied()
    }

    /// Append an element that has no twin.
    pub fn push(&mut self, element: u32, nodes: &[u32; 6]) {
        self.elements.push(element);
        if let Some(by_nodes) = &mut self.by_nodes {
            by_nodes.insert(*nodes, element);
        }
    }
}

/// Nodes of an element as a key of one size.
fn padded(nodes: &[u32]) -> [u32; 6] {
    let mut all = [u32::MAX; 6];
    all[..nodes.len()].copy_from_slice(nodes);
    all
}
