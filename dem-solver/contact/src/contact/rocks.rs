//! Forces of all contacts between two rocks at one instant.
//!
//! Everything is computed once, in the first rock's own frame, for the first rock; the second takes
//! the opposite at the same point, so that momentum and angular momentum of both together are kept to
//! rounding. The point lies halfway into the overlap: `R - d/2` from either centre.
//!
//! History is kept by pair of spheres. The local mass is `1/m* = N/M_1 + N/M_2`: each rock's share
//! among the N contacts of the two.
//!
//! The law and its source: [`crate::law::contact_point`].

use super::broad_phase::rock_pairs::Pose;
use super::pipeline::{Mover, Partner, Rows, Site, Sums, forces};
use super::whole_rock::patch::ContactPatch;
use super::whole_rock::rocks::TwoWholes;
use crate::law::Law;
use crate::law::contact_point::History;
use crate::rock::{Motion, Rock};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// History of a contact between rocks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RockHistory {
    /// Numbers of the second and of the first rock, in which order pairs are gone through.
    pub rocks: [u32; 2],
    /// Numbers of the spheres of the first and of the second rock.
    pub spheres: [u32; 2],
    /// What the law keeps: what acts on the first rock, at the state's instant, along the axes of space.
    pub history: History,
}

/// Two rocks at an instant.
#[derive(Clone, Copy)]
pub struct RockPair<'a> {
    /// Numbers of the second and of the first.
    pub numbers: [u32; 2],
    /// The rocks.
    pub rocks: [&'a Rock; 2],
    /// Their motions.
    pub motions: [&'a Motion; 2],
    /// Their law.
    pub law: &'a Law,
    /// What they need where they touch as wholes.
    pub wholes: Option<TwoWholes<'a>>,
    /// Pairs of spheres that may touch, ascending.
    pub pairs: &'a [[u32; 2]],
}

/// Sums over the contacts of two rocks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RockPairSums {
    /// Those of the first; the second takes the opposite force. Penetration is over the smaller radius.
    pub first: Sums,
    /// Torque on the second about its own centre of mass [N m].
    pub torque: Vector3<f64>,
}

/// A contact of two spheres, in the first rock's own frame.
#[derive(Debug, Clone, Copy)]
struct RockContact {
    spheres: [u32; 2],
    /// Unit vector from the first centre to the second.
    normal: Vector3<f64>,
    overlap: f64,
    /// Contact point, from the first rock's centre of mass [m].
    point: Vector3<f64>,
}

/// What evaluates contacts: a buffer that is used again and again.
#[derive(Debug, Clone, Default)]
pub struct RockForces {
    contacts: Vec<RockContact>,
    rows: Rows,
}

impl RockForces {
    /// Room for so many contacts.
    pub fn reserve(&mut self, contacts: usize) {
        self.contacts.reserve(contacts);
        self.rows.reserve(contacts);
    }

    fn find(&mut self, two: &RockPair, pose: &Pose, turn: &Matrix3<f64>) {
        self.contacts.clear();
        let [a, b] = two.rocks;
        for &spheres in two.pairs {
            let (first, second) = (&a.spheres[spheres[0] as usize], &b.spheres[spheres[1] as usize]);
            let apart = pose.position + turn * second.centre - first.centre;
            let (square, reach) = (apart.norm_squared(), first.radius + second.radius);
            if square < reach * reach {
                let distance = square.sqrt();
                // Of two centres in one point any direction is as good.
                let normal = if distance > 0.0 { apart / distance } else { Vector3::z() };
                let overlap = reach - distance;
                let point = first.centre + normal * (first.radius - 0.5 * overlap);
                self.contacts.push(RockContact { spheres, normal, overlap, point });
            }
        }
    }

    /// Elastic energy of the contacts [J], their number, and the largest overlap over the smaller radius; no forces.
    pub fn energy(&mut self, two: &RockPair, pose: &Pose) -> (f64, usize, f64) {
        self.find(two, pose, &pose.rotation());
        if let Some(wholes) = &two.wholes {
            let overlap = wholes.equivalent(self.contacts.iter().map(|c| (c.spheres, c.overlap)));
            let deepest = self.contacts.iter().map(|c| c.overlap).fold(0.0, f64::max);
            let energy = two.law.normal.load(wholes.radius(), overlap).energy;
            return (energy, self.contacts.len(), deepest / wholes.smaller());
        }
        let (mut energy, mut deepest) = (0.0, 0.0_f64);
        for contact in &self.contacts {
            let [effective, smaller] = radii(two, contact);
            energy += two.law.normal.load(effective, contact.overlap).energy;
            deepest = deepest.max(contact.overlap / smaller);
        }
        (energy, self.contacts.len(), deepest)
    }

    /// The forces in the middle of a step of `h` [s]. `before` are the histories of these two rocks,
    /// ascending; those after the step are added to `after`.
    pub fn forces(
        &mut self,
        two: &RockPair,
        pose: &Pose,
        h: f64,
        before: &[RockHistory],
        after: &mut Vec<RockHistory>,
    ) -> RockPairSums {
        let turn = pose.rotation();
        self.find(two, pose, &turn);
        let ([a, b], [first, second]) = (two.rocks, two.motions);
        let to_space = first.rotation();
        let velocity = to_space.tr_mul(&(first.velocity - second.velocity));
        let spin = to_space.tr_mul(&first.angular_momentum).component_div(&a.inertia);
        let others = second.orientation.inverse_transform_vector(&second.angular_momentum);
        let other_spin = turn * others.component_div(&b.inertia);
        let fastest = velocity.norm() + spin.norm() * a.arm + other_spin.norm() * b.arm;
        let count = self.contacts.len();
        let first = Sums { fastest, ..Sums::default() };
        if count == 0 {
            return RockPairSums { first, ..RockPairSums::default() };
        }
        let reduced = 1.0 / (1.0 / a.mass + 1.0 / b.mass);
        let dashpot = two.law.damping.as_ref().map_or(0.0, |d| d.coefficient(reduced, count, 0.0));
        let inertia = 1.0 / (1.0 / a.inertia.min() + 1.0 / b.inertia.min()) / count as f64;
        let mover = Mover { velocity, spin, relative_spin: spin - other_spin, inertia };
        let torque = Vector3::zeros();
        let mut partner = OtherRock { two, pose, to_space, other_spin, dashpot, before, after, torque };
        let laws = std::slice::from_ref(two.law);
        let mut first = match &two.wholes {
            None => forces(&mut partner, &self.contacts, &mover, laws, &mut self.rows, h),
            Some(wholes) => {
                let overlap = wholes.equivalent(self.contacts.iter().map(|c| (c.spheres, c.overlap)));
                let weight = |c: &RockContact| wholes.weight(c.spheres, c.overlap, overlap);
                let weighted = || self.contacts.iter().map(|c| (c, weight(c)));
                let mobility = |push: &Vector3<f64>, torque: &Vector3<f64>| {
                    let others = turn.tr_mul(&(torque - pose.position.cross(push)));
                    let turned =
                        |torque: &Vector3<f64>, rock: &Rock| torque.dot(&torque.component_div(&rock.inertia));
                    push.norm_squared() / reduced + turned(torque, a) + turned(&others, b)
                };
                let (mut sums, size) = (Sums::default(), [wholes.radius(), overlap]);
                // Too little for a number: nothing.
                if overlap > f64::MIN_POSITIVE {
                    let mut patch = ContactPatch::new(two.law, size, &partner, weighted(), &mover, mobility);
                    patch.load_elastically(two.law.normal.load(size[0], overlap), &mut sums);
                    for (number, (contact, weight)) in weighted().enumerate() {
                        patch.add(&mut partner, (number, contact, weight), &mover, h, &mut sums);
                    }
                }
                sums
            }
        };
        (first.fastest, first.contacts) = (fastest, count);
        let torque = to_space * partner.torque;
        first.turn(&to_space);
        RockPairSums { first, torque }
    }
}

/// Another rock as partner, in the first rock's own frame.
struct OtherRock<'a> {
    two: &'a RockPair<'a>,
    pose: &'a Pose,
    to_space: Matrix3<f64>,
    /// Angular velocity of the other [rad/s].
    other_spin: Vector3<f64>,
    dashpot: f64,
    /// Histories that are not passed yet.
    before: &'a [RockHistory],
    after: &'a mut Vec<RockHistory>,
    /// Torque on the other about its own centre of mass [N m].
    torque: Vector3<f64>,
}

impl Partner for OtherRock<'_> {
    type Contact = RockContact;

    #[inline]
    fn law(&self, _: &RockContact) -> u16 {
        0
    }

    #[inline]
    fn site(&self, contact: &RockContact) -> Site {
        let [radius, mut smaller] = radii(self.two, contact);
        if let Some(wholes) = &self.two.wholes {
            smaller = wholes.smaller();
        }
        let (normal, overlap, arm) = (contact.normal, contact.overlap, contact.point);
        Site { normal, overlap, radius, smaller, arm, weight: 1.0 }
    }

    #[inline]
    fn velocity(&self, _: &RockContact, site: &Site) -> Vector3<f64> {
        self.other_spin.cross(&(site.arm - self.pose.position))
    }

    #[inline]
    fn dashpot(&mut self, _: &RockContact, _: &Law) -> f64 {
        self.dashpot
    }

    /// Both contacts and histories are gone through in ascending order.
    fn history(&mut self, _: usize, contact: &RockContact) -> History {
        while let Some((old, rest)) = self.before.split_first()
            && old.spheres <= contact.spheres
        {
            self.before = rest;
            if old.spheres == contact.spheres {
                return old.history.turned(|v| self.to_space.tr_mul(v));
            }
        }
        History::default()
    }

    fn keep(&mut self, contact: &RockContact, _: &Site, history: History) {
        let (rocks, spheres) = (self.two.numbers, contact.spheres);
        let history = history.turned(|v| self.to_space * v);
        self.after.push(RockHistory { rocks, spheres, history });
    }

    #[inline]
    fn react(&mut self, _: &RockContact, site: &Site, force: &Vector3<f64>, moment: &Vector3<f64>) {
        self.torque -= (site.arm - self.pose.position).cross(force) + moment;
    }
}

/// Effective radius of two spheres, and the smaller of their radii [m].
fn radii(two: &RockPair, contact: &RockContact) -> [f64; 2] {
    let radius = |side: usize| two.rocks[side].spheres[contact.spheres[side] as usize].radius;
    let (r, s) = (radius(0), radius(1));
    [r * s / (r + s), r.min(s)]
}
