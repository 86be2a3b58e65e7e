//! Elements of the mesh.

use serde::{Deserialize, Serialize};

/// What kind of element, in the order of the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Two nodes.
    Line,
    /// Three nodes.
    Face,
    /// A node that no line and no face holds.
    Point,
}

/// One element of the mesh. Nodes beyond those of its kind repeat the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element {
    /// What it is.
    pub kind: Kind,
    /// Its nodes.
    pub nodes: [u32; 3],
    /// Radius around the line [m]; 0 for others.
    pub radius: f64,
}

impl Element {
    /// Its nodes, each once.
    pub fn own_nodes(&self) -> &[u32] {
        match self.kind {
            Kind::Line => &self.nodes[..2],
            Kind::Face => &self.nodes,
            Kind::Point => &self.nodes[..1],
        }
    }

    /// True if both hold a node.
    pub fn shares_a_node(&self, other: &Self) -> bool {
        self.own_nodes().iter().any(|n| other.own_nodes().contains(n))
    }
}
