//! The interface mesh: the structure as the contact solver sees it, at t = 0.

use serde::{Deserialize, Serialize};

/// Nodes, lines and faces at t = 0, after form finding. Displacements count from here.
///
/// A node that no line and no face holds is a contact point of its own.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct InterfaceMesh {
    /// Its name, where there are several; may be empty.
    pub name: String,
    /// `[3 * nodes]` [m], node-major.
    pub coordinates: Vec<f64>,
    /// Two nodes each (wires, cables, edges).
    pub lines: Vec<[u32; 2]>,
    /// Three nodes each.
    pub faces: Vec<[u32; 3]>,
    /// Radius of each line [m]; empty = all zero.
    pub line_radius: Vec<f64>,
    /// Lumped mass that each node shows to a contact [kg], infinite where it is held; empty = not known.
    pub masses: Vec<f64>,
    /// Named sets of nodes.
    pub groups: Vec<Group>,
}

/// A named set of nodes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// Its nodes.
    pub nodes: Vec<u32>,
}

impl InterfaceMesh {
    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.coordinates.len() / 3
    }

    /// What is wrong with it (lengths, indices, values that are not finite), or `Ok`.
    pub fn check(&self) -> Result<(), String> {
        let n = self.node_count();
        if self.coordinates.len() != 3 * n {
            return Err(format!("{} coordinates are not a multiple of 3", self.coordinates.len()));
        }
        if let Some(at) = self.coordinates.iter().position(|x| !x.is_finite()) {
            return Err(format!("node {}: coordinate {} is {}", at / 3, at % 3, self.coordinates[at]));
        }
        let ends = self.lines.iter().flatten().chain(self.faces.iter().flatten());
        if let Some(bad) = ends.chain(self.groups.iter().flat_map(|g| &g.nodes)).find(|&&i| i as usize >= n) {
            return Err(format!("an element or a group names node {bad}, there are {n}"));
        }
        if !self.line_radius.is_empty() && self.line_radius.len() != self.lines.len() {
            return Err(format!("{} radii for {} lines", self.line_radius.len(), self.lines.len()));
        }
        if let Some(r) = self.line_radius.iter().find(|r| !(**r >= 0.0 && r.is_finite())) {
            return Err(format!("a line has the radius {r} m"));
        }
        if !self.masses.is_empty() && self.masses.len() != n {
            return Err(format!("{} nodal masses for {n} nodes", self.masses.len()));
        }
        match self.masses.iter().position(|m| m.is_nan() || *m <= 0.0) {
            Some(node) => Err(format!("node {node} has the mass {} kg", self.masses[node])),
            None => Ok(()),
        }
    }

    /// True if both have the same nodes, by coordinates: then the mapping is the identity.
    pub fn same_nodes(&self, other: &Self) -> bool {
        self.coordinates == other.coordinates
    }
}
