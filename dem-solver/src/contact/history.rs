//! What a contact with friction remembers from step to step, and who inherits it.
//!
//! Keyed by (sphere, wall element). Where a contact has passed on to another element (a sphere that
//! rolls over a border), the new contact takes over the memory of one that has ended: of an element
//! that shares a node, or of a point that lies as near as the sphere can have slipped. Without it
//! every border would kick.
//!
//! Source: handbook 1.9.

use crate::law::contact_point::Past;
use nalgebra::Vector3;

/// What a contact remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory {
    /// Number of the sphere in its rock.
    pub sphere: u32,
    /// Number of the element in the wall.
    pub element: u32,
    /// Force of the tangential spring at the state's instant [N], along the axes of space.
    pub spring: Vector3<f64>,
    /// Moment of the rolling spring at the state's instant [N m], along the axes of space.
    pub moment: Vector3<f64>,
    /// Normal in the middle of the last step, from the sphere to the wall, along the axes of space.
    pub normal: Vector3<f64>,
    /// Overlap in the middle of the last step [m].
    pub overlap: f64,
    /// Energy of the tangential and rolling springs [J].
    pub energy: f64,
}

impl Memory {
    /// What a contact has from it, along the axes of space.
    #[inline]
    pub fn past(&self) -> Past {
        Past { spring: self.spring, moment: self.moment, overlap: self.overlap, ..Past::default() }
    }
}

/// A contact that looks for its memory.
pub trait Heir {
    /// Number of the sphere.
    fn sphere(&self) -> u32;
    /// Number of the element in the wall.
    fn element(&self) -> u32;
    /// Normal along the axes of space.
    fn normal(&self) -> Vector3<f64>;
    /// How far the normal may have turned in a step [rad].
    fn turn(&self) -> f64;
}

/// Marks a contact without a past.
pub const NONE: u32 = u32::MAX;

/// For each of `count` contacts the place of its memory in `memories`, or [`NONE`]. Both are ordered
/// by sphere; `neighbours` says whether two elements share a node.
pub fn inherit<H: Heir>(
    count: usize,
    contact: impl Fn(usize) -> H,
    memories: &[Memory],
    neighbours: impl Fn(u32, u32) -> bool,
    found: &mut Vec<u32>,
) {
    found.clear();
    found.resize(count, NONE);
    let mut old = 0;
    let mut first = 0;
    while first < count {
        let sphere = contact(first).sphere();
        let last = first + (first..count).take_while(|i| contact(*i).sphere() == sphere).count();
        while old < memories.len() && memories[old].sphere < sphere {
            old += 1;
        }
        let end = old + memories[old..].iter().take_while(|m| m.sphere == sphere).count();
        if end > old {
            let of_sphere = |i| contact(first + i);
            one_sphere(of_sphere, &memories[old..end], old, &neighbours, &mut found[first..last]);
        }
        (first, old) = (last, end);
    }
}

/// Angle between two contacts up to which one that sets in takes over the spring of the other [rad].
const BESIDE: f64 = 0.3;

/// What sets in beside a contact that stays begins with that one's spring: a part beyond a kink and the node or edge
/// that is subtracted then cancel. For those of which `found` has [`NONE`], after [`inherit`].
pub fn inherit_beside<H: Heir>(contact: impl Fn(usize) -> H, memories: &[Memory], found: &mut [u32]) {
    for (i, heir) in found.iter_mut().enumerate().filter(|(_, h)| **h == NONE) {
        let contact = contact(i);
        let normal = contact.normal();
        let own = memories.iter().enumerate().filter(|(_, m)| m.sphere == contact.sphere());
        let apart = own.map(|(k, m)| ((m.normal - normal).norm_squared(), k as u32));
        let nearest = apart.filter(|(a, _)| *a < BESIDE * BESIDE).min_by(|a, b| a.0.total_cmp(&b.0));
        *heir = nearest.map_or(NONE, |(_, k)| k);
    }
}

fn one_sphere<H: Heir>(
    contact: impl Fn(usize) -> H,
    memories: &[Memory],
    offset: usize,
    neighbours: &impl Fn(u32, u32) -> bool,
    found: &mut [u32],
) {
    for (i, place) in found.iter_mut().enumerate() {
        let element = contact(i).element();
        if let Some(same) = memories.iter().position(|m| m.element == element) {
            *place = (offset + same) as u32;
        }
    }
    for i in 0..found.len() {
        if found[i] != NONE {
            continue;
        }
        let contact = contact(i);
        let normal = contact.normal();
        // Of those that nobody has taken, the one whose normal is closest; the first of equals.
        let mut best: Option<(usize, f64)> = None;
        for (k, memory) in memories.iter().enumerate() {
            let place = (offset + k) as u32;
            let apart = (memory.normal - normal).norm();
            let eligible = apart <= contact.turn() || neighbours(contact.element(), memory.element);
            if !found.contains(&place) && eligible && best.is_none_or(|(_, least)| apart < least) {
                best = Some((k, apart));
            }
        }
        if let Some((k, _)) = best {
            found[i] = (offset + k) as u32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy)]
    struct New(u32, u32, Vector3<f64>);

    impl Heir for New {
        fn sphere(&self) -> u32 {
            self.0
        }
        fn element(&self) -> u32 {
            self.1
        }
        fn normal(&self) -> Vector3<f64> {
            self.2
        }
        fn turn(&self) -> f64 {
            1e-3
        }
    }

    fn memory(sphere: u32, element: u32, normal: Vector3<f64>) -> Memory {
        let zero = Vector3::zeros();
        Memory { sphere, element, normal, spring: zero, moment: zero, overlap: 1.0, energy: 0.0 }
    }

    fn heirs(contacts: &[New], memories: &[Memory], neighbours: impl Fn(u32, u32) -> bool) -> Vec<u32> {
        let mut found = Vec::new();
        inherit(contacts.len(), |i| contacts[i], memories, neighbours, &mut found);
        found
    }

    #[test]
    fn a_contact_finds_its_own_memory_among_those_of_many_spheres() {
        let z = Vector3::z();
        let memories = [memory(1, 7, z), memory(3, 4, z), memory(3, 5, z), memory(9, 1, z)];
        let contacts = [New(0, 7, z), New(3, 5, z), New(3, 4, z), New(9, 1, z), New(12, 1, z)];
        assert_eq!(heirs(&contacts, &memories, |_, _| false), [NONE, 2, 1, 3, NONE]);
    }

    #[test]
    fn a_new_element_inherits_from_a_neighbour_or_from_the_same_spot_but_not_from_afar() {
        let (z, near) = (Vector3::z(), Vector3::new(5e-4, 0.0, 1.0).normalize());
        let memories = [memory(3, 4, z)];
        assert_eq!(heirs(&[New(3, 8, Vector3::x())], &memories, |a, b| (a, b) == (8, 4)), [0]);
        assert_eq!(heirs(&[New(3, 8, near)], &memories, |_, _| false), [0]);
        assert_eq!(heirs(&[New(3, 8, Vector3::x())], &memories, |_, _| false), [NONE]);
        assert_eq!(heirs(&[New(2, 8, z)], &memories, |_, _| true), [NONE]);
    }

    #[test]
    fn one_memory_has_one_heir_and_its_own_contact_comes_first() {
        let z = Vector3::z();
        let memories = [memory(3, 4, z)];
        let contacts = [New(3, 2, z), New(3, 4, z), New(3, 6, z)];
        assert_eq!(heirs(&contacts, &memories, |_, _| true), [NONE, 0, NONE]);
        assert_eq!(heirs(&[New(3, 2, z), New(3, 6, z)], &memories, |_, _| true), [0, NONE]);
    }
}
