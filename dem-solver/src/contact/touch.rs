//! Which spheres of a rock touch the wall, and where. All geometry is done in the rock's own frame,
//! in which the spheres stand still: some ten nodes are turned instead of hundreds of spheres.

use crate::rock::{Motion, Rock};
use crate::search::near::inverse_square;
use crate::search::pairs::{Instant, PairElement, PairList};
use crate::wall::Kind;
use crate::wall::closest::{Feature, on_face, on_line};
use crate::wall::hierarchy::{Candidate, keep_contacts};
use crate::wall::motion::NodeMotion;
use nalgebra::{Matrix3, Vector3};

/// A contact of a sphere with a wall element, in the rock's own frame.
#[derive(Debug, Clone, Copy)]
pub struct Contact {
    /// Unit vector from the sphere's centre to the wall's point.
    pub normal: Vector3<f64>,
    /// Distance of the two [m].
    pub distance: f64,
    /// Overlap, above 0 [m].
    pub overlap: f64,
    /// Weights of the element's nodes at the point.
    pub weights: [f64; 3],
    /// Number of the sphere.
    pub sphere: u32,
    /// Place of the element in the pair list.
    pub element: u32,
    feature: Feature,
}

impl Candidate for Contact {
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

/// The wall as the rock sees it at one instant, and the contacts with it.
#[derive(Debug, Clone, Default)]
pub struct Touch {
    /// From the rock's own frame to space.
    pub rotation: Matrix3<f64>,
    /// Nodes of the pair list, from the rock's centre of mass in its own frame [m].
    pub nodes: Vec<Vector3<f64>>,
    /// The contacts, by sphere, in the order of the hierarchy.
    pub contacts: Vec<Contact>,
    edges: Vec<(Vector3<f64>, f64)>,
    candidates: Vec<Contact>,
}

impl Touch {
    /// Room for the pairs of a rock.
    pub fn reserve(&mut self, nodes: usize, elements: usize, contacts: usize) {
        self.nodes.reserve(nodes);
        self.edges.reserve(elements);
        self.contacts.reserve(contacts);
        self.candidates.reserve(64);
    }

    /// Find the contacts of `rock` at `now`.
    pub fn find(&mut self, rock: &Rock, list: &PairList, motion: &NodeMotion, now: &Motion, at: Instant) {
        self.contacts.clear();
        if list.pairs.is_empty() {
            return;
        }
        self.rotation = now.rotation();
        let to_own = self.rotation.transpose();
        self.nodes.clear();
        for &a in &list.nodes {
            self.nodes.push(to_own * (motion.position(at.segment, a as usize, at.along) - now.position));
        }
        self.edges.clear();
        for element in &list.elements {
            let [a, b, _] = element.nodes.map(|n| self.nodes[n as usize]);
            let edge = b - a;
            self.edges.push((edge, inverse_square(&edge)));
        }
        let mut rest = &list.pairs[..];
        while let Some(first) = rest.first() {
            let sphere = &rock.spheres[first.sphere as usize];
            self.candidates.clear();
            while let Some(pair) = rest.first().filter(|p| p.sphere == first.sphere) {
                rest = &rest[1..];
                let element = &list.elements[pair.element as usize];
                let reach = sphere.radius + element.radius;
                let closest = self.closest(&sphere.centre, element, pair.element);
                let square = closest.to_point.norm_squared();
                if square < reach * reach {
                    let distance = square.sqrt();
                    self.candidates.push(Contact {
                        normal: closest.to_point / distance,
                        distance,
                        overlap: reach - distance,
                        weights: closest.weights,
                        sphere: pair.sphere,
                        element: pair.element,
                        feature: closest.feature,
                    });
                }
            }
            keep_contacts(&mut self.candidates);
            self.contacts.extend_from_slice(&self.candidates);
        }
    }

    #[inline]
    fn closest(
        &self,
        centre: &Vector3<f64>,
        element: &PairElement,
        place: u32,
    ) -> crate::wall::closest::Closest {
        let [a, b, c] = element.nodes.map(|n| &self.nodes[n as usize]);
        match element.kind {
            Kind::Face => on_face(centre, [a, b, c]),
            Kind::Line | Kind::Point => {
                let (edge, inverse) = &self.edges[place as usize];
                on_line(centre, a, edge, *inverse)
            }
        }
    }
}
