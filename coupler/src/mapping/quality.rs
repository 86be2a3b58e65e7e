//! How good a mapping is: how far each contact node is from the point of the structure that it follows.

use super::Matrix;
use super::elements::Elements;
use interface_defs::{Diagnostic, InterfaceMesh, code};
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
    pub fn warnings(&self) -> Vec<Diagnostic> {
        let warn = |what: String| Diagnostic::warning(code::TRUST, what).about("coupling.mapping");
        let mut warnings = Vec::new();
        let Worst { node, place: [x, y, z], distance, size } = self.worst;
        if self.far > 0 {
            let what = format!(
                "{} of {} nodes of the contact solver's mesh are off the point of the structure that they follow by more than half of its \
                 mesh size; the farthest is node {node} at ({x:.4}, {y:.4}, {z:.4}) m, by {distance:.3e} m at a mesh size of {size:.3e} m: \
                 a force there keeps its sum and not its moment, which errs by up to {distance:.3e} N m a newton",
                self.far, self.nodes
            );
            warnings.push(warn(what).try_instead("use meshes of the same surface, or another mapping"));
        }
        let (total, node) = self.enlarged;
        if total > ENLARGED {
            let what = format!(
                "node {node} of the contact solver's mesh follows the structure with weights of {total:.1} in total, where 1 is best: it \
                 extrapolates, and enlarges what it maps"
            );
            let hint = "use type = \"nearest_projection\", or meshes that cover each other";
            warnings.push(warn(what).try_instead(hint));
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of three nodes 0.5 m apart; what is mapped follows points on it with weights made by hand.
    #[test]
    fn distances_and_weights_are_those_of_the_worst_node() {
        let structure = InterfaceMesh {
            coordinates: vec![0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0],
            lines: vec![[0, 1], [1, 2]],
            ..Default::default()
        };
        let contact = InterfaceMesh {
            coordinates: vec![0.1, 0.0, 0.0, 0.75, 0.3, 0.4, 0.25, 0.0, 0.2],
            ..Default::default()
        };
        // The first extrapolates to 0.1; the others follow 0.75 and 0.25.
        let rows = [vec![(1, 1.8), (2, -0.8)], vec![(1, 0.5), (2, 0.5)], vec![(0, 0.5), (1, 0.5)]];
        let of = |first: Vec<(u32, f64)>| {
            let rows = std::iter::once(first).chain(rows[1..].iter().cloned());
            Quality::of(&Matrix::from_rows(3, rows), &structure, &contact)
        };
        let quality = of(rows[0].clone());
        assert!((quality.worst.distance - 0.5).abs() < 1e-15 && (quality.worst.size - 0.5).abs() < 1e-15);
        assert_eq!((quality.worst.node, quality.worst.place, quality.far), (1, [0.75, 0.3, 0.4], 1));
        assert_eq!((quality.enlarged.1, quality.warnings().len()), (0, 1));
        assert!((quality.enlarged.0 - 2.6).abs() < 1e-15);
        let wild = of(vec![(0, 2.8), (1, -3.8), (2, 2.0)]).warnings();
        assert!(
            wild.iter().any(|w| w.message.contains("node 0") && w.message.contains("weights of 8.6")),
            "{wild:?}"
        );
        let text = quality.to_string();
        assert!(
            text.contains("3 contact nodes follow 3 nodes") && text.contains("node 1, by 5.000e-1 m"),
            "{text}"
        );
    }
}
