//! Contacts of one sphere with faces, without a jump over edges and corners.
//!
//! Beside the nearest point the double hierarchy keeps a second one as soon as it lies before the first one's tangent plane.
//! At a kink towards the sphere that is where the foot leaves the edge and enters the next face: a contact sets in there with
//! the overlap that the edge has, and force and energy jump. As with wires ([`crate::wall::hierarchy`]) the way without a jump is a sum over
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
//! sphere does not reach is not asked: where an edge or a corner is within it, all their faces are. Faces must share the nodes
//! at which they meet: two that lie on each other with nodes of their own count twice.

use super::touch::Contact;
use crate::rock::Sphere;
use crate::search::near::inverse_square;
use crate::search::pairs::PairList;
use crate::wall::closest::{Feature, on_line};
use nalgebra::Vector3;

/// Number that the keys of edges begin with: beyond those of nodes, which are counted from the other end.
const EDGES: u32 = 1 << 31;

#[derive(Debug, Clone, Copy)]
struct Edge {
    /// Places of its ends in the pair list, the smaller one first.
    nodes: [u32; 2],
    /// Faces that it belongs to.
    faces: f64,
    /// How often it counts.
    share: f64,
    /// The first of its faces, and which of that one's corners its ends are.
    element: u32,
    ends: [usize; 2],
}

#[derive(Debug, Clone, Copy)]
struct Corner {
    node: u32,
    share: f64,
    element: u32,
    end: usize,
}

/// Buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct Faces {
    edges: Vec<Edge>,
    corners: Vec<Corner>,
}

impl Faces {
    /// Add to `contacts` those of sphere `number` with the faces `met`, which are all that it overlaps; `nodes` are those of
    /// `list` in the sphere's frame.
    pub fn share_out(
        &mut self,
        sphere: &Sphere,
        number: u32,
        met: &[Contact],
        list: &PairList,
        nodes: &[Vector3<f64>],
        contacts: &mut Vec<Contact>,
    ) {
        self.edges.clear();
        self.corners.clear();
        let corners = |face: &Contact| {
            let mut nodes = list.elements[face.element as usize].nodes;
            nodes.sort_unstable();
            nodes
        };
        for (k, face) in met.iter().enumerate() {
            // A line, a point, and the twin of another are nothing of their own.
            let [a, b, c] = corners(face);
            if a == b || b == c || met[..k].iter().any(|twin| corners(twin) == [a, b, c]) {
                continue;
            }
            self.count(face, list);
            if face.feature == Feature::Face {
                contacts.push(*face);
            }
        }
        for edge in &self.edges {
            for corner in self.corners.iter_mut().filter(|c| edge.nodes.contains(&c.node)) {
                corner.share += edge.faces - 1.0;
            }
        }
        let within = |to_point: Vector3<f64>, element: u32, weights, share, part, feature| {
            let distance = to_point.norm();
            let overlap = sphere.radius + list.elements[element as usize].radius - distance;
            let normal = to_point / distance;
            let node = Some(part);
            (overlap > 0.0).then_some(Contact {
                normal,
                distance,
                overlap,
                weights,
                share,
                sphere: number,
                element,
                node,
                feature,
            })
        };
        for edge in &self.edges {
            if edge.faces < 2.0 && edge.share == 0.0 {
                continue;
            }
            let element = &list.elements[edge.element as usize];
            let [a, b] = edge.ends.map(|k| nodes[element.nodes[k] as usize]);
            let way = b - a;
            let closest = on_line(&sphere.centre, &a, &way, inverse_square(&way));
            let mut share = edge.share;
            match closest.feature {
                Feature::Node => {
                    let end = element.nodes[edge.ends[usize::from(closest.weights[1] > 0.0)]];
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
                let part = EDGES | (3 * element.number + edge.ends[0] as u32);
                contacts.extend(within(closest.to_point, edge.element, weights, share, part, Feature::Edge));
            }
        }
        for corner in self.corners.iter().filter(|c| c.share != 0.0) {
            let mut weights = [0.0; 3];
            weights[corner.end] = 1.0;
            let to_point = nodes[corner.node as usize] - sphere.centre;
            let part = list.numbers[corner.node as usize];
            contacts.extend(within(to_point, corner.element, weights, corner.share, part, Feature::Node));
        }
    }

    /// Count in the edges and corners of a face, and the one of them that its closest point lies on.
    fn count(&mut self, face: &Contact, list: &PairList) {
        let corners = list.elements[face.element as usize].nodes;
        let [a, b, c] = face.weights;
        // The parts that the closest point lies on are those whose weights are not exactly 0.
        let on_edge = |ends: [usize; 2]| {
            let zero = if c == 0.0 {
                2
            } else if b == 0.0 {
                1
            } else {
                0
            };
            f64::from(u8::from(face.feature == Feature::Edge && !ends.contains(&zero)))
        };
        for ends in [[0, 1], [1, 2], [2, 0]] {
            let mut nodes = ends.map(|k| corners[k]);
            nodes.sort_unstable();
            let share = on_edge(ends);
            match self.edges.iter_mut().find(|e| e.nodes == nodes) {
                Some(edge) => {
                    edge.faces += 1.0;
                    edge.share += share;
                }
                None => self.edges.push(Edge { nodes, faces: 1.0, share, element: face.element, ends }),
            }
        }
        for (end, (node, weight)) in corners.into_iter().zip([a, b, c]).enumerate() {
            let on_node = f64::from(u8::from(face.feature == Feature::Node && weight == 1.0));
            match self.corners.iter_mut().find(|c| c.node == node) {
                Some(corner) => corner.share += on_node - 1.0,
                None => self.corners.push(Corner { node, share: on_node, element: face.element, end }),
            }
        }
    }
}
