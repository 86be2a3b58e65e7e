//! Cells of a mesh, and what became of them.

use std::ops::Range;

/// A cell of a mesh, of which elements are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    /// Its nodes.
    pub nodes: Vec<usize>,
    /// The elements of the mesh that it is, by position.
    pub from: Vec<u32>,
}

/// What became of an element of a mesh, by numbers in [`Model::elements`] and [`Model::cables`].
#[derive(Debug, Clone, Default)]
pub struct Made {
    /// Elements.
    pub elements: Range<usize>,
    /// Cables.
    pub cables: Range<usize>,
}
