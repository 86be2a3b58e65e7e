//! Which spheres of a rock touch the wall, and where. All geometry is done in the rock's own frame,
//! in which the spheres stand still: some ten nodes are turned instead of hundreds of spheres.

use crate::rock::{Motion, Rock, Sphere};
use crate::search::near::inverse_square;
use crate::search::pairs::{Instant, Pair, PairList};
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
    /// How often it counts: 1, but for nodes that several wires share.
    pub share: f64,
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

/// A line of the pair list as the rock sees it; a point is one without length. Of a face: a corner, and
/// its unit normal as the edge.
#[derive(Debug, Clone, Copy)]
struct Segment {
    start: Vector3<f64>,
    edge: Vector3<f64>,
    inverse_square: f64,
    radius: f64,
}

/// The wall as the rock sees it at one instant, and the contacts with it.
#[derive(Debug, Clone, Default)]
pub struct Touch {
    /// From the rock's own frame to space.
    pub rotation: Matrix3<f64>,
    /// The contacts, by sphere, in the order of the hierarchy.
    pub contacts: Vec<Contact>,
    nodes: Vec<Vector3<f64>>,
    segments: Vec<Segment>,
}

impl Touch {
    /// Room for the pairs of a rock.
    pub fn reserve(&mut self, nodes: usize, elements: usize, contacts: usize) {
        self.nodes.reserve(nodes);
        self.segments.reserve(elements);
        self.contacts.reserve(contacts);
    }

    /// Number of contacts, shared points counted by their shares.
    pub fn count(&self) -> usize {
        self.contacts.len()
    }

    /// Find the contacts of `rock` at `now`.
    pub fn find(&mut self, rock: &Rock, list: &PairList, motion: &NodeMotion, now: &Motion, at: Instant) {
        self.contacts.clear();
        if list.pairs.is_empty() {
            return;
        }
        self.see(list, motion, now, at);
        let mut rest = &list.pairs[..];
        while let Some(&Pair { sphere: number, .. }) = rest.first() {
            let sphere = &rock.spheres[number as usize];
            let first = self.contacts.len();
            while let Some((&pair, others)) = rest.split_first()
                && pair.sphere == number
            {
                rest = others;
                self.try_pair(sphere, pair, list);
            }
            if self.contacts.len() > first + 1 {
                let kept = keep_contacts(&mut self.contacts[first..]);
                self.contacts.truncate(first + kept);
            }
        }
    }

    /// Turn the wall into the rock's own frame.
    fn see(&mut self, list: &PairList, motion: &NodeMotion, now: &Motion, at: Instant) {
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
    fn try_pair(&mut self, sphere: &Sphere, pair: Pair, list: &PairList) {
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
            self.contacts.push(Contact {
                normal: closest.to_point / distance,
                distance,
                overlap: reach - distance,
                weights: closest.weights,
                share: 1.0,
                sphere: pair.sphere,
                element: pair.element,
                feature: closest.feature,
            });
        }
    }
}
