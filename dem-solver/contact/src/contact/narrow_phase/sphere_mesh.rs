//! Which spheres of a rock touch the mesh, and where. All geometry is done in the rock's own frame,
//! in which the spheres stand still: some ten nodes are turned instead of hundreds of spheres.

use crate::contact::broad_phase::mesh_elements::inverse_square;
use crate::contact::broad_phase::mesh_pairs::{Instant, MeshPair, MeshPairs};
use crate::contact::narrow_phase::Touch;
use crate::contact::narrow_phase::faces::FaceShares;
use crate::contact::narrow_phase::line_in_faces::patches as patches_of;
use crate::contact::narrow_phase::selection::keep_contacts;
use crate::interface_mesh::crossings::Crossings;
use crate::interface_mesh::motion::{NodeMotion, Seam};
use crate::interface_mesh::{ContactMesh, Kind};
use crate::law::normal::Load;
use crate::law::table::SurfaceLaws;
use crate::rock::faces::Faces;
use crate::rock::{Motion, Rock};
use dem_solid::geometry::closest::{Feature, on_face, on_line};
use dem_solid::geometry::sphere::Sphere;
use nalgebra::{Matrix3, Vector3};

/// What a rock and its mesh are at an instant.
#[derive(Clone, Copy)]
pub struct MeshScene<'a> {
    /// The rock.
    pub rock: &'a Rock,
    /// Its faces, where the mesh touches them and not its spheres.
    pub faces: Option<&'a Faces>,
    /// The laws of its contacts.
    pub laws: SurfaceLaws<'a>,
    /// What it touches.
    pub contact_mesh: &'a ContactMesh,
    /// Pairs that may touch.
    pub list: &'a MeshPairs,
    /// Motion of the near nodes in the window.
    pub motion: &'a NodeMotion,
    /// True if the net is advanced here, so that its own masses limit the step.
    pub moves_net: bool,
    /// In the first step of a window: how its start differs from the end of the window before.
    pub seam: Option<Seam<'a>>,
}

/// A node of wires of one radius within reach of a sphere.
#[derive(Debug, Clone, Copy)]
struct MeshCorner {
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
    pub contacts: Vec<Touch>,
    /// Of contacts with the rock's faces: their elastic loads.
    pub loads: Vec<Load>,
    nodes: Vec<Vector3<f64>>,
    segments: Vec<Segment>,
    corners: Vec<MeshCorner>,
    spare: Vec<Touch>,
    faces: FaceShares,
    below: Vec<[f64; 2]>,
    patches: Vec<(Touch, Load)>,
}

impl MeshContacts {
    /// Room for the pairs of a rock.
    pub fn reserve(&mut self, nodes: usize, elements: usize, contacts: usize) {
        self.nodes.reserve(nodes);
        self.segments.reserve(elements);
        self.contacts.reserve(contacts);
    }

    /// Find the contacts of the rock at `now`. Where the mesh knows its crossings they are continuous.
    pub fn find(&mut self, scene: &MeshScene, now: &Motion, at: Instant) {
        let list = scene.list;
        self.contacts.clear();
        self.loads.clear();
        if list.pairs.is_empty() {
            return;
        }
        self.see(list, scene.motion, now, at);
        if let Some(faces) = scene.faces {
            self.find_on_faces(scene, faces);
            return;
        }
        let mut rest = &list.pairs[..];
        while let Some(&MeshPair { sphere: number, .. }) = rest.first() {
            let sphere = &scene.rock.spheres[number as usize];
            let first = self.contacts.len();
            while let Some((&pair, others)) = rest.split_first()
                && pair.sphere == number
            {
                rest = others;
                self.try_pair(sphere, pair, list);
            }
            if let Some(crossings) = &scene.contact_mesh.crossings {
                self.share_out(first, (sphere, number), list, crossings);
            } else if self.contacts.len() > first + 1 {
                let kept = keep_contacts(&mut self.contacts[first..]);
                self.contacts.truncate(first + kept);
            }
        }
    }

    /// The patches in which lines, and points, lie below the faces of a rock, by face, then element.
    fn find_on_faces(&mut self, scene: &MeshScene, faces: &Faces) {
        self.patches.clear();
        for (place, element) in (0..).zip(&scene.list.elements) {
            let law = scene.laws.of(element.number);
            // Over the length at t = 0: it does not change, and so neither does the energy by it.
            let stiffness = law.foundation().unwrap_or_default() * scene.contact_mesh.length(element.number);
            let size = scene.rock.mean_radius();
            let Segment { start, edge, radius, .. } = self.segments[place as usize];
            let patches = &mut self.patches;
            patches_of(&faces.planes, [&start, &edge], radius, &mut self.below, |patch| {
                let (load, at) = match element.kind {
                    Kind::Point => (law.normal.load(size, patch.depths[0]), 0.0),
                    _ => patch.load(stiffness),
                };
                let normal = faces.planes[patch.face as usize].normal;
                let point = start + edge * at;
                // From the plane through the centre of mass on.
                let distance = normal.dot(&point);
                let touch = Touch {
                    normal,
                    distance,
                    overlap: patch.depths[0].max(patch.depths[1]),
                    centre: point - normal * distance,
                    radius: size,
                    thickness: radius,
                    weights: [1.0 - at, at, 0.0],
                    share: 1.0,
                    sphere: patch.face,
                    element: place,
                    key: element.number,
                    feature: Feature::Face,
                };
                // Too little for a number: nothing.
                if load.energy > f64::MIN_POSITIVE {
                    patches.push((touch, load));
                }
            });
        }
        self.patches.sort_unstable_by_key(|(touch, _)| (touch.sphere, touch.element));
        self.contacts.extend(self.patches.iter().map(|(touch, _)| *touch));
        self.loads.extend(self.patches.iter().map(|(_, load)| *load));
    }

    /// Make of the candidates from `first` on contacts that are continuous at the nodes of wires and at the edges of faces.
    fn share_out(&mut self, first: usize, ball: (&Sphere, u32), list: &MeshPairs, crossings: &Crossings) {
        // Mostly one face, away from its edges.
        if self.contacts.len() == first + 1 && self.contacts[first].feature == Feature::Face {
            return;
        }
        self.split_lines(first, ball.0, list, crossings);
        let is_face = |c: &Touch| list.elements[c.element as usize].kind == Kind::Face;
        self.spare.sort_by_key(|c| !is_face(c));
        let faces = self.spare.iter().take_while(|c| is_face(c)).count();
        let (faces, points) = self.spare.split_at_mut(faces);
        let nodes = |face: &Touch| list.elements[face.element as usize].nodes;
        let at = |node: u32| self.nodes[node as usize] - ball.0.centre;
        let number_of = |node: u32| list.numbers[node as usize];
        self.faces.share_out(faces, nodes, at, number_of, &mut self.contacts);
        let others = keep_contacts(points);
        self.contacts.extend_from_slice(&points[..others]);
        self.push_corners(ball, list);
    }

    /// Of the candidates from `first` on keep the lines that are touched between their nodes; their nodes go to `corners`, all
    /// else to `spare`.
    fn split_lines(&mut self, first: usize, sphere: &Sphere, list: &MeshPairs, crossings: &Crossings) {
        self.corners.clear();
        self.spare.clear();
        let is_line = |c: &Touch| list.elements[c.element as usize].kind == Kind::Line;
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
                        self.corners.push(MeshCorner { node, thickness, share, element, end });
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
    fn push_corners(&mut self, ball: (&Sphere, u32), list: &MeshPairs) {
        let sphere = ball.0;
        for corner in self.corners.iter().filter(|c| c.share != 0.0) {
            let to_point = self.nodes[corner.node as usize] - sphere.centre;
            let distance = to_point.norm();
            let mut weights = [0.0; 3];
            weights[corner.end] = 1.0;
            let thickness = list.elements[corner.element as usize].radius;
            let point = (to_point / distance, distance);
            self.contacts.push(Touch {
                overlap: sphere.radius + thickness - distance,
                thickness,
                weights,
                share: corner.share,
                key: !Crossings::key(list.numbers[corner.node as usize], corner.thickness),
                ..Touch::new(ball, sphere.centre, corner.element, point, Feature::Node)
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
            let (ball, point) = ((sphere, pair.sphere), (closest.to_point / distance, distance));
            self.contacts.push(Touch {
                overlap: reach - distance,
                thickness: segment.radius,
                weights: closest.weights,
                key: element.number,
                ..Touch::new(ball, sphere.centre, pair.element, point, closest.feature)
            });
        }
    }
}
