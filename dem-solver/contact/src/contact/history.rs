//! What a contact with friction remembers from step to step, and which contact takes it over.
//!
//! Keyed by (sphere, element of the surface). Where a contact has passed on to another element (a sphere that
//! rolls over a border), the new contact takes over the history of one that has ended: of an element
//! that shares a node, or of a point that lies as near as the sphere can have slipped. Without it
//! every border would kick.
//!
//! Source: Santasusana et al. (2016), Computational Particle Mechanics 3, 407.

use super::narrow_phase::Touch;
use crate::law::contact_point::History;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// History of a contact of a rock with a surface, at the state's instant, along the axes of space.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SurfaceHistory {
    /// Number of the sphere in its rock.
    pub sphere: u32,
    /// Number of the element of the surface, or one beyond all elements for an edge or a node.
    pub element: u32,
    /// Normal in the middle of the last step, from the sphere into the surface.
    pub normal: Vector3<f64>,
    /// What the law keeps.
    pub history: History,
}

/// The frame of contacts that look for their histories.
pub struct Frame<F> {
    /// A vector along the axes of space.
    pub to_space: F,
    /// Largest slip of the surface past the rock in the step [m].
    pub slip: f64,
}

/// Marks a contact without a history.
const NONE: u32 = u32::MAX;

/// Which history each contact takes over; a buffer that is used again and again.
#[derive(Debug, Clone, Default)]
pub struct Transfer {
    places: Vec<u32>,
}

impl Transfer {
    /// Room for so many contacts.
    pub fn reserve(&mut self, contacts: usize) {
        self.places.reserve(contacts);
    }

    /// Find for each of `contacts` its history in `before`; both are ordered by sphere. `neighbours` says whether two elements share a
    /// node; `beside`: what sets in takes over the history that is nearest in direction, whether that contact stays or has ended.
    pub fn find(
        &mut self,
        contacts: &[Touch],
        frame: Frame<impl Fn(&Vector3<f64>) -> Vector3<f64>>,
        before: &[SurfaceHistory],
        neighbours: impl Fn(u32, u32) -> bool,
        beside: bool,
    ) {
        let stays = |(contact, old): (&Touch, &SurfaceHistory)| {
            (contact.sphere, contact.key) == (old.sphere, old.element)
        };
        self.places.clear();
        if before.len() == contacts.len() && contacts.iter().zip(before).all(stays) {
            // As in most steps, each keeps its own.
            self.places.extend(0..before.len() as u32);
            return;
        }
        self.places.resize(contacts.len(), NONE);
        inherit(contacts, &frame, before, neighbours, &mut self.places);
        if beside {
            inherit_beside(contacts, &frame, before, &mut self.places);
        }
    }

    /// What contact number `number` takes over.
    #[inline]
    pub fn of(&self, number: usize, before: &[SurfaceHistory]) -> Option<History> {
        let place = self.places[number];
        (place != NONE).then(|| before[place as usize].history)
    }
}

/// For each contact the place of its history in `histories`, or [`NONE`]. Both are ordered by sphere; `neighbours` says whether two
/// elements share a node.
fn inherit(
    contacts: &[Touch],
    frame: &Frame<impl Fn(&Vector3<f64>) -> Vector3<f64>>,
    histories: &[SurfaceHistory],
    neighbours: impl Fn(u32, u32) -> bool,
    found: &mut [u32],
) {
    let (mut old, mut first) = (0, 0);
    for own in contacts.chunk_by(|a, b| a.sphere == b.sphere) {
        old += histories[old..].iter().take_while(|m| m.sphere < own[0].sphere).count();
        let end = old + histories[old..].iter().take_while(|m| m.sphere == own[0].sphere).count();
        let last = first + own.len();
        if end > old {
            one_sphere(own, frame, &histories[old..end], old, &neighbours, &mut found[first..last]);
        }
        (first, old) = (last, end);
    }
}

/// Angle between two contacts up to which one that sets in takes over the spring of the other [rad].
const BESIDE: f64 = 0.3;

/// What sets in begins with the spring of the nearest in direction that the sphere had, whether that stays or has ended: a part
/// beyond a kink and the node or edge
/// that is subtracted then cancel. For those of which `found` has [`NONE`], after [`inherit`].
fn inherit_beside(
    contacts: &[Touch],
    frame: &Frame<impl Fn(&Vector3<f64>) -> Vector3<f64>>,
    histories: &[SurfaceHistory],
    found: &mut [u32],
) {
    for (contact, successor) in contacts.iter().zip(found).filter(|(_, h)| **h == NONE) {
        let normal = (frame.to_space)(&contact.normal);
        let own = histories.iter().enumerate().filter(|(_, m)| m.sphere == contact.sphere);
        let apart = own.map(|(k, m)| ((m.normal - normal).norm_squared(), k as u32));
        let nearest = apart.filter(|(a, _)| *a < BESIDE * BESIDE).min_by(|a, b| a.0.total_cmp(&b.0));
        *successor = nearest.map_or(NONE, |(_, k)| k);
    }
}

fn one_sphere(
    contacts: &[Touch],
    frame: &Frame<impl Fn(&Vector3<f64>) -> Vector3<f64>>,
    histories: &[SurfaceHistory],
    offset: usize,
    neighbours: &impl Fn(u32, u32) -> bool,
    found: &mut [u32],
) {
    for (contact, place) in contacts.iter().zip(&mut *found) {
        if let Some(same) = histories.iter().position(|m| m.element == contact.key) {
            *place = (offset + same) as u32;
        }
    }
    for (i, contact) in contacts.iter().enumerate() {
        if found[i] != NONE {
            continue;
        }
        let normal = (frame.to_space)(&contact.normal);
        // How far the normal may have turned in the step: twice the slip, for the spin that the nodes do not show; and rounding.
        let turn = 2.0 * frame.slip / contact.distance.abs() + 1e-9;
        // Of those that nobody has taken, the one whose normal is closest; the first of equals.
        let free = (offset as u32..).zip(histories).filter(|(place, _)| !found.contains(place));
        let apart = free.map(|(place, old)| ((old.normal - normal).norm(), place, old.element));
        let eligible = apart.filter(|(apart, _, old)| *apart <= turn || neighbours(contact.key, *old));
        if let Some((_, place, _)) = eligible.min_by(|a, b| a.0.total_cmp(&b.0)) {
            found[i] = place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dem_solid::geometry::closest::Feature;
    use dem_solid::geometry::sphere::Sphere;

    fn new(sphere: u32, key: u32, normal: Vector3<f64>) -> Touch {
        let ball = Sphere { centre: Vector3::zeros(), radius: 1.0 };
        Touch::new((&ball, sphere), ball.centre, key, (normal, 1.0), Feature::Face)
    }

    fn history(sphere: u32, element: u32, normal: Vector3<f64>) -> SurfaceHistory {
        SurfaceHistory { sphere, element, normal, history: History { overlap: 1.0, ..History::default() } }
    }

    fn successors(
        contacts: &[Touch],
        histories: &[SurfaceHistory],
        neighbours: impl Fn(u32, u32) -> bool,
    ) -> Vec<u32> {
        let mut found = vec![NONE; contacts.len()];
        let frame = Frame { to_space: |v: &Vector3<f64>| *v, slip: 5e-4 };
        inherit(contacts, &frame, histories, neighbours, &mut found);
        found
    }

    #[test]
    fn a_contact_finds_its_own_history_among_those_of_many_spheres() {
        let z = Vector3::z();
        let histories = [history(1, 7, z), history(3, 4, z), history(3, 5, z), history(9, 1, z)];
        let contacts = [new(0, 7, z), new(3, 5, z), new(3, 4, z), new(9, 1, z), new(12, 1, z)];
        assert_eq!(successors(&contacts, &histories, |_, _| false), [NONE, 2, 1, 3, NONE]);
    }

    #[test]
    fn a_new_element_inherits_from_a_neighbour_or_from_the_same_spot_but_not_from_afar() {
        let (z, near) = (Vector3::z(), Vector3::new(5e-4, 0.0, 1.0).normalize());
        let histories = [history(3, 4, z)];
        assert_eq!(successors(&[new(3, 8, Vector3::x())], &histories, |a, b| (a, b) == (8, 4)), [0]);
        assert_eq!(successors(&[new(3, 8, near)], &histories, |_, _| false), [0]);
        assert_eq!(successors(&[new(3, 8, Vector3::x())], &histories, |_, _| false), [NONE]);
        assert_eq!(successors(&[new(2, 8, z)], &histories, |_, _| true), [NONE]);
    }

    #[test]
    fn one_history_has_one_successor_and_its_own_contact_comes_first() {
        let z = Vector3::z();
        let histories = [history(3, 4, z)];
        let contacts = [new(3, 2, z), new(3, 4, z), new(3, 6, z)];
        assert_eq!(successors(&contacts, &histories, |_, _| true), [NONE, 0, NONE]);
        assert_eq!(successors(&[new(3, 2, z), new(3, 6, z)], &histories, |_, _| true), [0, NONE]);
    }
}
