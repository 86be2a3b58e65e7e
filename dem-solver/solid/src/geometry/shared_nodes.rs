//! Whether the elements of a mesh share the nodes at which they touch.
//!
//! A sum over the parts of a surface without a jump (`contact::narrow_phase::selection`, `contact::narrow_phase::faces`) subtracts what
//! neighbours share, by their nodes. Where one element ends on the edge of another with a node of its own (a T-junction), or
//! two lie side by side with a node each in one place, nothing is subtracted and the contact counts twice. Such nodes lie on
//! lines, or on edges that belong to one face alone.

use crate::geometry::box_tree::{Bounds, BoxTree, morton_order};
use crate::geometry::closest::on_line;
use crate::geometry::is_flat;
use nalgebra::Vector3;

/// Distance from an edge, over its length, at which a node counts as lying on it.
const ON_IT: f64 = 1e-6;

/// Height of a face over its longest edge, in such edges, up to which it has no area.
const FLAT: f64 = 1e-7;

/// Why elements cannot be summed up by the nodes that they share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unshared {
    /// Two elements touch without a common node.
    OnEdge {
        /// The node of one.
        node: u32,
        /// The nodes of the edge of the other, on which it lies.
        edge: [u32; 2],
    },
    /// Two lines or two faces have the same nodes: the first and the last of them.
    Twice(u32, u32),
    /// A face without an area, by its nodes.
    Flat([u32; 3]),
}

impl std::fmt::Display for Unshared {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::OnEdge { node, edge: [a, b] } => {
                write!(f, "node {node} lies on the edge from node {a} to node {b} without belonging to it")
            }
            Self::Twice(a, b) => write!(f, "two elements have the same nodes, among them {a} and {b}"),
            Self::Flat([a, b, c]) => write!(f, "the face of nodes {a}, {b} and {c} has no area"),
        }
    }
}

/// The first place of a mesh where its elements do not share what they should.
pub fn first_fault(nodes: &[Vector3<f64>], lines: Vec<[u32; 2]>, faces: &[[u32; 3]]) -> Option<Unshared> {
    let flat = faces.iter().find(|face| is_flat(face.map(|n| nodes[n as usize]), FLAT));
    let mut edges = free_edges(faces);
    let free = edges.len();
    edges.extend(&lines);
    flat.map(|face| Unshared::Flat(*face))
        .or_else(|| twice(faces.to_vec()))
        .or_else(|| twice(edges[free..].to_vec()))
        .or_else(|| first_unshared(nodes, &edges))
}

/// Two elements of the same nodes.
fn twice<const N: usize>(mut elements: Vec<[u32; N]>) -> Option<Unshared> {
    elements.iter_mut().for_each(|nodes| nodes.sort_unstable());
    elements.sort_unstable();
    let same = elements.windows(2).find(|pair| pair[0] == pair[1])?[0];
    Some(Unshared::Twice(same[0], same[N - 1]))
}

/// The edges of `faces` that belong to one of them alone.
pub fn free_edges<'a>(faces: impl IntoIterator<Item = &'a [u32; 3]>) -> Vec<[u32; 2]> {
    let edges = |[a, b, c]: &[u32; 3]| [[*a, *b], [*b, *c], [*c, *a]].map(|[a, b]| [a.min(b), a.max(b)]);
    let mut all: Vec<[u32; 2]> = faces.into_iter().flat_map(edges).collect();
    all.sort_unstable();
    all.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect()
}

/// The first node of `edges` that lies on another of them; `None`: all share their nodes.
pub fn first_unshared(nodes: &[Vector3<f64>], edges: &[[u32; 2]]) -> Option<Unshared> {
    let ends = |edge: &[u32; 2]| edge.map(|n| nodes[n as usize]);
    let order = morton_order(edges.len(), |e| {
        let [a, b] = ends(&edges[e]);
        (a + b) * 0.5
    });
    let edges: Vec<[u32; 2]> = order.iter().map(|e| edges[*e as usize]).collect();
    let tree = BoxTree::new(edges.len(), |e| {
        let [a, b] = ends(&edges[e]);
        let slack = Vector3::repeat(ON_IT * (b - a).norm());
        Bounds::around(&(a.inf(&b) - slack), &(a.sup(&b) + slack))
    });
    let mut used: Vec<u32> = edges.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    used.into_iter().find_map(|node| {
        let point = nodes[node as usize];
        let mut found = None;
        tree.visit(
            |bounds| bounds.square_to(&point) <= 0.0,
            |e| {
                let [a, b] = ends(&edges[e]);
                let way = b - a;
                let square = way.norm_squared();
                let inverse = if square > 0.0 { 1.0 / square } else { 0.0 };
                let apart = on_line(&point, &a, &way, inverse).to_point.norm_squared();
                let on_it = !edges[e].contains(&node) && apart <= ON_IT * ON_IT * square;
                if on_it {
                    found = Some(Unshared::OnEdge { node, edge: edges[e] });
                }
                !on_it
            },
        );
        found
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(all: &[[f64; 3]]) -> Vec<Vector3<f64>> {
        all.iter().map(|n| Vector3::from(*n)).collect()
    }

    #[test]
    fn wires_that_share_their_nodes_are_told_from_one_that_ends_on_another() {
        let places = nodes(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
        assert_eq!(first_unshared(&places, &[[0, 1], [1, 2], [1, 3]]), None);
        // The wire from 0 to 2 has no node where the one from 3 ends.
        assert_eq!(
            first_unshared(&places, &[[0, 2], [1, 3]]),
            Some(Unshared::OnEdge { node: 1, edge: [0, 2] })
        );
        // Two nodes in one place, a micrometre apart on wires of a metre.
        let twice = nodes(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1e-7, 0.0], [2.0, 0.0, 0.0]]);
        assert!(first_unshared(&twice, &[[0, 1], [2, 3]]).is_some());
        // Wires that cross at a distance are two wires.
        let apart = nodes(&[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, -1.0, 0.01], [1.0, 1.0, 0.01]]);
        assert_eq!(first_unshared(&apart, &[[0, 1], [2, 3]]), None);
    }

    #[test]
    fn of_faces_the_edges_count_that_one_of_them_alone_has() {
        let places =
            nodes(&[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [2.0, 2.0, 0.0], [1.0, 1.0, 0.0]]);
        let shared = [[0, 1, 2], [1, 3, 2]];
        assert_eq!(free_edges(&shared).len(), 4);
        assert_eq!(first_unshared(&places, &free_edges(&shared)), None);
        // One side of the diagonal is cut in two, the other is not.
        let cut = [[0, 1, 2], [1, 3, 4], [4, 3, 2]];
        let unshared = first_unshared(&places, &free_edges(&cut));
        assert_eq!(unshared, Some(Unshared::OnEdge { node: 4, edge: [1, 2] }));
        let fault = |lines: &[[u32; 2]], faces: &[[u32; 3]]| first_fault(&places, lines.to_vec(), faces);
        assert_eq!(fault(&[[0, 1]], &shared), None, "a rope along an edge");
        assert_eq!(fault(&[[0, 1], [1, 0]], &shared), Some(Unshared::Twice(0, 1)));
        assert_eq!(fault(&[], &[[0, 1, 2], [1, 2, 0]]), Some(Unshared::Twice(0, 2)));
        assert_eq!(fault(&[], &[[0, 1, 2], [1, 4, 2]]), Some(Unshared::Flat([1, 4, 2])));
    }
}
