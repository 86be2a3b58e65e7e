//! Which spheres of a rock touch the mesh, and where. All geometry is done in the rock's own frame,
//! in which the spheres stand still: some ten nodes are turned instead of hundreds of spheres.

use crate::contact::broad_phase::mesh_elements::inverse_square;
use crate::contact::broad_phase::mesh_pairs::{Instant, MeshPair, MeshPairs, PairElement};
use crate::contact::narrow_phase::faces::{FacePart, Faces, TouchedFace};
use crate::contact::narrow_phase::selection::{Candidate, keep_contacts};
use crate::interface_mesh::Kind;
use crate::interface_mesh::crossings::Crossings;
use crate::interface_mesh::motion::NodeMotion;
use crate::rock::{Motion, Rock};
use dem_solid::geometry::closest::{Feature, on_face, on_line};
use dem_solid::geometry::sphere::Sphere;
use nalgebra::{Matrix3, Vector3};

/// A contact of a sphere with a mesh element, in the rock's own frame.
#[derive(Debug, Clone, Copy)]
pub struct MeshContact {
    /// Unit vector from the sphere's centre to the mesh's point.
    pub normal: Vector3<f64>,
    /// Distance of the two [m].
    pub distance: f64,
    /// Overlap, above 0 [m].
    pub overlap: f64,
    /// Weights of the element's nodes at the point.
    pub weights: [f64; 3],
    /// How often it counts: 1, but for nodes that several wires share.
    pub share: f64,
    /// Number of the sphere.
    pub sphere: u32,
    /// Place of the element in the pair list.
    pub element: u32,
    /// Number of the mesh's node (with its radius) or edge that it stands for, if it counts for all elements there.
    pub node: Option<u32>,
    /// What the point lies on.
    pub feature: Feature,
}

impl MeshContact {
    /// What its memory is kept under: the element's number `element`, or a number beyond all elements.
    pub fn key(&self, element: u32) -> u32 {
        self.node.map_or(element, |node| !node)
    }
}

/// A node of wires of one radius within reach of a sphere.
#[derive(Debug, Clone, Copy)]
struct Corner {
    /// Its place in the pair list.
    node: u32,
    /// Number of the radius.
    thickness: usize,
    /// Wires whose closest point it is, less those that are too many.
    share: f64,
    /// A wire that it belongs to, and which of its ends.
    element: u32,
    end: usize,
}

impl Candidate for MeshContact {
    fn distance(&self) -> f64 {
        self.distance
    }
    fn normal(&self) -> &Vector3<f64> {
        &self.normal
    }
    fn feature(&self) -> Feature {
        self.feature
    }
    fn element(&self) -> u32 {
        self.element
    }
}

/// A line of the pair list as the rock sees it; a point is one without length. Of a face: a corner, and
/// its unit normal as the edge.
#[derive(Debug, Clone, Copy)]
struct Segment {
    start: Vector3<f64>,
    edge: Vector3<f64>,
    inverse_square: f64,
    radius: f64,
}

/// The mesh as the rock sees it at one instant, and the contacts with it.
#[derive(Debug, Clone, Default)]
pub struct MeshContacts {
    /// From the rock's own frame to space.
    pub rotation: Matrix3<f64>,
    /// The contacts, by sphere, in the order in which `selection` keeps them.
    pub contacts: Vec<MeshContact>,
    nodes: Vec<Vector3<f64>>,
    segments: Vec<Segment>,
    corners: Vec<Corner>,
    spare: Vec<MeshContact>,
    faces: Faces,
    touched_faces: Vec<TouchedFace>,
}

impl MeshContacts {
    /// Room for the pairs of a rock.
    pub fn reserve(&mut self, nodes: usize, elements: usize, contacts: usize) {
        self.nodes.reserve(nodes);
        self.segments.reserve(elements);
        self.contacts.reserve(contacts);
    }

    /// Number of contacts, shared points counted by their shares.
    pub fn count(&self) -> usize {
        let sum: f64 = self.contacts.iter().map(|c| c.share).sum();
        if sum >= 1.0 { sum as usize } else { self.contacts.len().min(1) }
    }

    /// Find the contacts of `rock` at `now`. With `crossings` they are continuous.
    pub fn find(
        &mut self,
        rock: &Rock,
        list: &MeshPairs,
        motion: &NodeMotion,
        now: &Motion,
        at: Instant,
        crossings: Option<&Crossings>,
    ) {
        self.contacts.clear();
        if list.pairs.is_empty() {
            return;
        }
        self.see(list, motion, now, at);
        let mut rest = &list.pairs[..];
        while let Some(&MeshPair { sphere: number, .. }) = rest.first() {
            let sphere = &rock.spheres[number as usize];
            let first = self.contacts.len();
            while let Some((&pair, others)) = rest.split_first()
                && pair.sphere == number
            {
                rest = others;
                self.try_pair(sphere, pair, list);
            }
            if let Some(crossings) = crossings {
                self.share_out(first, sphere, number, list, crossings);
            } else if self.contacts.len() > first + 1 {
                let kept = keep_contacts(&mut self.contacts[first..]);
                self.contacts.truncate(first + kept);
            }
        }
    }

    /// Make of the candidates from `first` on contacts that are continuous at the nodes of wires and at the edges of faces.
    fn share_out(
        &mut self,
        first: usize,
        sphere: &Sphere,
        number: u32,
        list: &MeshPairs,
        crossings: &Crossings,
    ) {
        // Mostly one face, away from its edges.
        if self.contacts.len() == first + 1 && self.contacts[first].feature == Feature::Face {
            return;
        }
        self.split_lines(first, sphere, list, crossings);
        let is_face = |c: &MeshContact| list.elements[c.element as usize].kind == Kind::Face;
        self.spare.sort_by_key(|c| !is_face(c));
        let faces = self.spare.iter().take_while(|c| is_face(c)).count();
        let (faces, points) = self.spare.split_at_mut(faces);
        self.touched_faces.clear();
        self.touched_faces.extend(faces.iter().map(|face| {
            let PairElement { nodes, number, .. } = list.elements[face.element as usize];
            TouchedFace { nodes, number, weights: face.weights, feature: face.feature }
        }));
        let at = |node: u32| self.nodes[node as usize] - sphere.centre;
        let contacts = &mut self.contacts;
        self.faces.share_out(&self.touched_faces, at, |shared| {
            let face = faces[shared.face];
            let (node, feature) = match shared.part {
                FacePart::Face => return contacts.push(face),
                FacePart::Edge(number) => (number, Feature::Edge),
                FacePart::Node(place) => (list.numbers[place as usize], Feature::Node),
            };
            let distance = shared.to_point.norm();
            let overlap = sphere.radius + list.elements[face.element as usize].radius - distance;
            if overlap > 0.0 {
                contacts.push(MeshContact {
                    normal: shared.to_point / distance,
                    distance,
                    overlap,
                    weights: shared.weights,
                    share: shared.share,
                    sphere: number,
                    element: face.element,
                    node: Some(node),
                    feature,
                });
            }
        });
        let others = keep_contacts(points);
        self.contacts.extend_from_slice(&points[..others]);
        self.push_corners(sphere, number, list);
    }

    /// Of the candidates from `first` on keep the lines that are touched between their nodes; their nodes go to `corners`, all
    /// else to `spare`.
    fn split_lines(&mut self, first: usize, sphere: &Sphere, list: &MeshPairs, crossings: &Crossings) {
        self.corners.clear();
        self.spare.clear();
        let is_line = |c: &MeshContact| list.elements[c.element as usize].kind == Kind::Line;
        let mut kept = first;
        for i in first..self.contacts.len() {
            let contact = self.contacts[i];
            if !is_line(&contact) {
                self.spare.push(contact);
                continue;
            }
            let element = &list.elements[contact.element as usize];
            let reach = sphere.radius + element.radius;
            let thickness = crossings.thickness(element.radius);
            for end in 0..2 {
                let node = element.nodes[end];
                let known = self.corners.iter().position(|c| (c.node, c.thickness) == (node, thickness));
                let apart = self.nodes[node as usize] - sphere.centre;
                let corner = match known {
                    Some(known) => known,
                    None if apart.norm_squared() < reach * reach => {
                        let excess = crossings.excess(list.numbers[node as usize], thickness);
                        let (share, element) = (-excess, contact.element);
                        self.corners.push(Corner { node, thickness, share, element, end });
                        self.corners.len() - 1
                    }
                    None => continue,
                };
                // The closest point of the wire is this end.
                if contact.weights[end] == 1.0 {
                    self.corners[corner].share += 1.0;
                }
            }
            if contact.feature != Feature::Node {
                self.contacts[kept] = contact;
                kept += 1;
            }
        }
        self.contacts.truncate(kept);
    }

    /// Add the nodes that lines share, each as often as it counts.
    fn push_corners(&mut self, sphere: &Sphere, number: u32, list: &MeshPairs) {
        for corner in self.corners.iter().filter(|c| c.share != 0.0) {
            let to_point = self.nodes[corner.node as usize] - sphere.centre;
            let distance = to_point.norm();
            let mut weights = [0.0; 3];
            weights[corner.end] = 1.0;
            self.contacts.push(MeshContact {
                normal: to_point / distance,
                distance,
                overlap: sphere.radius + list.elements[corner.element as usize].radius - distance,
                weights,
                share: corner.share,
                sphere: number,
                element: corner.element,
                node: Some(Crossings::key(list.numbers[corner.node as usize], corner.thickness)),
                feature: Feature::Node,
            });
        }
    }

    /// Turn the mesh into the rock's own frame.
    fn see(&mut self, list: &MeshPairs, motion: &NodeMotion, now: &Motion, at: Instant) {
        self.rotation = now.rotation();
        let to_own = self.rotation.transpose();
        self.nodes.clear();
        for &a in &list.nodes {
            self.nodes.push(to_own * (motion.position(at.segment, a as usize, at.along) - now.position));
        }
        self.segments.clear();
        for element in &list.elements {
            let [start, end, third] = element.nodes.map(|n| self.nodes[n as usize]);
            let edge = match element.kind {
                Kind::Line | Kind::Point => end - start,
                Kind::Face => (end - start).cross(&(third - start)).try_normalize(0.0).unwrap_or_default(),
            };
            let inverse_square = inverse_square(&edge);
            self.segments.push(Segment { start, edge, inverse_square, radius: element.radius });
        }
    }

    /// Add the pair to the contacts if it touches.
    #[inline]
    fn try_pair(&mut self, sphere: &Sphere, pair: MeshPair, list: &MeshPairs) {
        let segment = &self.segments[pair.element as usize];
        let reach = sphere.radius + segment.radius;
        let element = &list.elements[pair.element as usize];
        let closest = match element.kind {
            Kind::Line | Kind::Point => {
                on_line(&sphere.centre, &segment.start, &segment.edge, segment.inverse_square)
            }
            // Most pairs of a list are too far from the plane: that is seen at once, rounding left aside.
            Kind::Face if segment.edge.dot(&(sphere.centre - segment.start)).abs() > reach * (1.0 + 1e-9) => {
                return;
            }
            Kind::Face => on_face(&sphere.centre, element.nodes.map(|n| &self.nodes[n as usize])),
        };
        let square = closest.to_point.norm_squared();
        if square < reach * reach {
            let distance = square.sqrt();
            self.contacts.push(MeshContact {
                normal: closest.to_point / distance,
                distance,
                overlap: reach - distance,
                weights: closest.weights,
                share: 1.0,
                sphere: pair.sphere,
                element: pair.element,
                node: None,
                feature: closest.feature,
            });
        }
    }
}
