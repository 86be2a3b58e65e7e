//! Contacts of one sphere with faces, without a jump over edges and corners.
//!
//! Beside the nearest point the double hierarchy keeps a second one as soon as it lies before the first one's tangent plane.
//! At a kink towards the sphere that is where the foot leaves the edge and enters the next face: a contact sets in there with
//! the overlap that the edge has, and force and energy jump. As with wires ([`crate::contact::narrow_phase::selection`]) what has no jump is a sum over
//! all parts of the surface, u being the energy of a contact as a function of the distance:
//!
//! `U = sum over faces u(distance) - sum over inner edges u(distance) + sum over inner corners u(distance)`.
//!
//! Each part is convex, so that its distance has a continuous gradient: force and energy are continuous, and
//! the force is the energy's gradient. For a sphere of any radius the sum counts the pieces of the surface within it (less
//! the holes that they enclose): one for a plane, however it is cut, for a ridge, for a peak; one for a flat valley that the
//! sphere bridges with its edge inside, two for a groove that it touches on both sides.
//!
//! An edge of m faces counts `-(m - 1)`, a corner of k faces `1 - k` and each of its edges' `m - 1`. What parts a
//! sphere does not reach is not asked: where an edge or a corner is within it, all their faces are. FaceShares must share the nodes
//! that they share: two that lie on each other with nodes of their own count twice.

use super::Touch;
use crate::contact::broad_phase::mesh_elements::inverse_square;
use dem_solid::geometry::closest::{Feature, on_line};
use nalgebra::Vector3;

/// Number that edges begin with: beyond all nodes.
const EDGES: u32 = 1 << 31;

#[derive(Debug, Clone, Copy)]
struct Edge {
    /// Its ends, the smaller number first.
    nodes: [u32; 2],
    /// FaceShares that it belongs to.
    faces: f64,
    /// Multiplicity with which it counts.
    share: f64,
    /// The first of its faces, and which of that one's corners its ends are.
    face: usize,
    ends: [usize; 2],
}

#[derive(Debug, Clone, Copy)]
struct Corner {
    node: u32,
    share: f64,
    face: usize,
    end: usize,
}

/// A contact with an edge or a corner of a face, with what it stands for, if the sphere reaches it.
fn part(
    face: &Touch,
    to_point: Vector3<f64>,
    weights: [f64; 3],
    share: f64,
    (number, feature): (u32, Feature),
) -> Option<Touch> {
    let distance = to_point.norm();
    let overlap = face.radius + face.thickness - distance;
    let normal = to_point / distance;
    (overlap > 0.0).then_some(Touch {
        normal,
        distance,
        overlap,
        weights,
        share,
        key: !number,
        feature,
        ..*face
    })
}

/// Buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct FaceShares {
    edges: Vec<Edge>,
    corners: Vec<Corner>,
}

impl FaceShares {
    /// Add to `contacts` those of a sphere with the faces `touched`, which are all that it overlaps. `nodes` are those of an element,
    /// `at` gives a node's place from the sphere's centre [m], `number` its number in the mesh.
    pub fn share_out(
        &mut self,
        touched: &[Touch],
        nodes: impl Fn(&Touch) -> [u32; 3],
        at: impl Fn(u32) -> Vector3<f64>,
        number: impl Fn(u32) -> u32,
        contacts: &mut Vec<Touch>,
    ) {
        self.edges.clear();
        self.corners.clear();
        let sorted = |face: &Touch| {
            let mut nodes = nodes(face);
            nodes.sort_unstable();
            nodes
        };
        for (k, face) in touched.iter().enumerate() {
            // A line, a point, and the twin of another are nothing of their own.
            let [a, b, c] = sorted(face);
            if a == b || b == c || touched[..k].iter().any(|twin| sorted(twin) == [a, b, c]) {
                continue;
            }
            self.count(k, face, nodes(face));
            if face.feature == Feature::Face {
                contacts.push(*face);
            }
        }
        for edge in &self.edges {
            for corner in self.corners.iter_mut().filter(|c| edge.nodes.contains(&c.node)) {
                corner.share += edge.faces - 1.0;
            }
        }
        for edge in &self.edges {
            if edge.faces < 2.0 && edge.share == 0.0 {
                continue;
            }
            let face = &touched[edge.face];
            let ends = edge.ends.map(|k| nodes(face)[k]);
            let [a, b] = ends.map(&at);
            let way = b - a;
            let closest = on_line(&Vector3::zeros(), &a, &way, inverse_square(&way));
            let mut share = edge.share;
            match closest.feature {
                Feature::Node => {
                    let end = ends[usize::from(closest.weights[1] > 0.0)];
                    for corner in self.corners.iter_mut().filter(|c| c.node == end) {
                        corner.share -= edge.faces - 1.0;
                    }
                }
                _ => share -= edge.faces - 1.0,
            }
            if share != 0.0 {
                let mut weights = [0.0; 3];
                weights[edge.ends[0]] = closest.weights[0];
                weights[edge.ends[1]] = closest.weights[1];
                let number = EDGES | (3 * face.key + edge.ends[0] as u32);
                contacts.extend(part(face, closest.to_point, weights, share, (number, Feature::Edge)));
            }
        }
        for corner in self.corners.iter().filter(|c| c.share != 0.0) {
            let mut weights = [0.0; 3];
            weights[corner.end] = 1.0;
            let (face, of) = (&touched[corner.face], (number(corner.node), Feature::Node));
            contacts.extend(part(face, at(corner.node), weights, corner.share, of));
        }
    }

    /// Count in the edges and corners of face number `place`, and the one of them that its closest point lies on.
    fn count(&mut self, place: usize, face: &Touch, nodes_of_face: [u32; 3]) {
        // The parts that the closest point lies on are those whose weights are not exactly 0.
        let zero = face.weights.iter().rposition(|weight| *weight == 0.0).unwrap_or(0);
        let on_edge =
            |ends: [usize; 2]| f64::from(u8::from(face.feature == Feature::Edge && !ends.contains(&zero)));
        for ends in [[0, 1], [1, 2], [2, 0]] {
            let mut nodes = ends.map(|k| nodes_of_face[k]);
            nodes.sort_unstable();
            let share = on_edge(ends);
            match self.edges.iter_mut().find(|e| e.nodes == nodes) {
                Some(edge) => {
                    edge.faces += 1.0;
                    edge.share += share;
                }
                None => self.edges.push(Edge { nodes, faces: 1.0, share, face: place, ends }),
            }
        }
        for (end, (node, weight)) in nodes_of_face.into_iter().zip(face.weights).enumerate() {
            let on_node = f64::from(u8::from(face.feature == Feature::Node && weight == 1.0));
            match self.corners.iter_mut().find(|c| c.node == node) {
                Some(corner) => corner.share += on_node - 1.0,
                None => self.corners.push(Corner { node, share: on_node, face: place, end }),
            }
        }
    }
}
