//! How good a mapping is: how far each contact node is from the point of the structure that it follows.

use super::Matrix;
use super::elements::Elements;
use interface_defs::InterfaceMesh;
use std::fmt;

/// A node that is farther off than this share of the structure's mesh size around it is said.
const FAR: f64 = 0.5;

/// Sum of the weights' magnitudes beyond which a mapping enlarges what it maps; radial basis functions on a regular net have 1.9, where
/// their nodes lie off its curvature 2.3.
const ENLARGED: f64 = 3.0;

/// A mapping, judged at t = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    nodes: usize,
    structure_nodes: usize,
    /// The node that is farthest off, relative to the mesh size.
    worst: Worst,
    /// Nodes that are off by more than half of the mesh size.
    far: usize,
    /// Largest sum of the weights' magnitudes of a contact node, and which one that is.
    enlarged: (f64, usize),
}

/// A contact node that is off what it follows.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Worst {
    node: usize,
    place: [f64; 3],
    distance: f64,
    size: f64,
}

impl Worst {
    fn share(&self) -> f64 {
        if self.distance == 0.0 { 0.0 } else { self.distance / self.size }
    }
}

impl Quality {
    /// Judge `matrix` between these meshes.
    pub fn of(matrix: &Matrix, structure: &InterfaceMesh, contact: &InterfaceMesh) -> Self {
        let sizes = Elements::new(structure).sizes;
        let mut followed = vec![0.0; contact.coordinates.len()];
        matrix.consistent(&structure.coordinates, &mut followed);
        let none = Worst { node: 0, place: [0.0; 3], distance: 0.0, size: 1.0 };
        let mut quality = Self {
            nodes: contact.node_count(),
            structure_nodes: structure.node_count(),
            worst: none,
            far: 0,
            enlarged: (0.0, 0),
        };
        let places = contact.coordinates.as_chunks::<3>().0.iter().zip(followed.as_chunks::<3>().0);
        for (node, (place, followed)) in places.enumerate() {
            let row = matrix.row(node);
            let square: f64 = place.iter().zip(followed).map(|(a, b)| (a - b) * (a - b)).sum();
            let total: f64 = row.iter().map(|(_, weight)| weight.abs()).sum();
            let size = row.iter().map(|(column, weight)| sizes[*column as usize] * weight.abs()).sum::<f64>()
                / total;
            let off = Worst { node, place: *place, distance: square.sqrt(), size };
            quality.far += usize::from(off.share() > FAR);
            if off.share() > quality.worst.share() {
                quality.worst = off;
            }
            if total > quality.enlarged.0 {
                quality.enlarged = (total, node);
            }
        }
        quality
    }

    /// What the user should know.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let Worst { node, place: [x, y, z], distance, size } = self.worst;
        if self.far > 0 {
            warnings.push(format!(
                "coupling.mapping: {} of {} nodes of the contact solver's mesh are off the point of the structure that they follow by more \
                 than half of its mesh size; the farthest is node {node} at ({x:.4}, {y:.4}, {z:.4}) m, by {distance:.3e} m at a mesh size of \
                 {size:.3e} m: a force there keeps its sum and not its moment, which errs by up to {distance:.3e} N m a newton; use meshes \
                 of the same surface, or another mapping",
                self.far, self.nodes
            ));
        }
        let (total, node) = self.enlarged;
        if total > ENLARGED {
            warnings.push(format!(
                "coupling.mapping: node {node} of the contact solver's mesh follows the structure with weights of {total:.1} in total, where 1 \
                 is best: it extrapolates, and enlarges what it maps; use type = \"nearest_projection\", or meshes that cover each other"
            ));
        }
        warnings
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Worst { node, distance, size, .. } = self.worst;
        write!(
            f,
            "{} contact nodes follow {} nodes of the structure: farthest off is node {node}, by {distance:.3e} m at a mesh size of {size:.3e} \
             m; {} by more than half of it; largest sum of weights {:.3}",
            self.nodes, self.structure_nodes, self.far, self.enlarged.0
        )
    }
}
