//! The document `structure.json`, in SI units: nodes, elements, sets, sections, supports.

use super::section::Section;
use crate::read::mesh::Kind;
use serde::Serialize;

/// Version of the document: another one where a reader of this one would misunderstand it.
pub const VERSION: u32 = 1;

/// Nodes or elements by a name.
#[derive(Debug, Clone, Serialize)]
pub struct Set {
    /// Its name.
    pub name: String,
    /// Numbers of its members, in the order of the document.
    pub members: Vec<u64>,
}

/// A node.
#[derive(Debug, Clone, Serialize)]
pub struct DeckNode {
    /// Its number.
    pub number: u64,
    /// Its place [m].
    pub at: [f64; 3],
}

/// An element.
#[derive(Debug, Clone, Serialize)]
pub struct DeckElement {
    /// Its number.
    pub number: u64,
    /// Its shape: `line2`, `line3`, `tri3`, `tri6` or `quad4`.
    pub kind: Kind,
    /// Numbers of its nodes.
    pub nodes: Vec<u64>,
    /// Its section, by position.
    pub section: usize,
}

/// Nodes that are held.
#[derive(Debug, Clone, Serialize)]
pub struct Support {
    /// Name of their set.
    pub set: String,
    /// Numbers of the nodes in it.
    pub nodes: Vec<u64>,
    /// Those of them that have rotations, as ends of beams have.
    pub turning: Vec<u64>,
    /// Directions and axes that are held, of `x`, `y`, `z`, `rx`, `ry`, `rz`; rotations of `turning` alone.
    pub held: Vec<&'static str>,
}

/// A structure as other programs know one.
#[derive(Debug, Default, Serialize)]
pub struct Deck {
    /// [`VERSION`].
    pub version: u32,
    /// `SI`: m, kg, s, N, Pa.
    pub units: &'static str,
    /// Whether nodes are where they come to rest.
    pub at_rest: bool,
    /// Nodes.
    pub nodes: Vec<DeckNode>,
    /// Elements, those of the parts `none` left out.
    pub elements: Vec<DeckElement>,
    /// What they are made of.
    pub sections: Vec<Section>,
    /// Sets of nodes; each set of elements has one of its name.
    pub node_sets: Vec<Set>,
    /// Sets of elements.
    pub element_sets: Vec<Set>,
    /// Supports.
    pub supports: Vec<Support>,
    /// Gravity [m/s2]; none where the structure has no weight.
    pub gravity: Option<[f64; 3]>,
    /// What of the scene is not in the document.
    pub left_out: Vec<String>,
    /// What is unusual in the scene's structure.
    pub warnings: Vec<String>,
}
