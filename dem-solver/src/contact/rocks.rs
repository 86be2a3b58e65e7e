//! Forces of all contacts between two rocks at one instant.
//!
//! Everything is computed once, in the first rock's own frame, for the first rock; the second takes
//! the opposite at the same point, so that momentum and angular momentum of both together are kept to
//! rounding. The point lies halfway into the overlap: `R - d/2` from either centre.
//!
//! History is kept by pair of spheres. The local mass is `1/m* = N/M_1 + N/M_2`: each rock's share
//! among the N contacts of the two.
//!
//! Source: handbook 1.1 to 1.3, 1.8.

use super::rows::{Rows, Sums};
use crate::contact::broad_phase::rock_pairs::Pose;
use crate::law::Law;
use crate::law::contact_point::{Meeting, Past};
use crate::rock::{Motion, Rock};
use nalgebra::{Matrix3, Vector3};

/// What a contact between rocks remembers from step to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// Numbers of the second and of the first rock, in which order pairs are gone through.
    pub rocks: [u32; 2],
    /// Numbers of the spheres of the first and of the second rock.
    pub spheres: [u32; 2],
    /// Force of the tangential spring on the first rock at the state's instant [N], along the axes of space.
    pub spring: Vector3<f64>,
    /// Moment of the rolling spring likewise [N m].
    pub moment: Vector3<f64>,
    /// Overlap in the middle of the last step [m].
    pub overlap: f64,
}

/// Two rocks at an instant.
#[derive(Clone, Copy)]
pub struct Two<'a> {
    /// Numbers of the second and of the first.
    pub numbers: [u32; 2],
    /// The rocks.
    pub rocks: [&'a Rock; 2],
    /// Their motions.
    pub motions: [&'a Motion; 2],
    /// Their law.
    pub law: &'a Law,
    /// Pairs of spheres that may touch, ascending.
    pub pairs: &'a [[u32; 2]],
}

/// Sums over the contacts of two rocks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Both {
    /// Those of the first; the second takes the opposite force. Penetration is over the smaller radius.
    pub first: Sums,
    /// Torque on the second about its own centre of mass [N m].
    pub torque: Vector3<f64>,
    /// Number of contacts.
    pub contacts: usize,
}

/// A contact of two spheres, in the first rock's own frame.
#[derive(Debug, Clone, Copy)]
struct Contact {
    spheres: [u32; 2],
    /// Unit vector from the first centre to the second.
    normal: Vector3<f64>,
    overlap: f64,
    /// Where it is, from the first rock's centre of mass [m].
    point: Vector3<f64>,
}

/// What evaluates contacts: a buffer that is used again and again.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    contacts: Vec<Contact>,
    rows: Rows,
}

impl Evaluation {
    /// Room for so many contacts.
    pub fn reserve(&mut self, contacts: usize) {
        self.contacts.reserve(contacts);
        self.rows.reserve(contacts);
    }

    fn find(&mut self, two: &Two, pose: &Pose, turn: &Matrix3<f64>) {
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
                self.contacts.push(Contact { spheres, normal, overlap, point });
            }
        }
    }

    /// Elastic energy of the contacts [J], their number, and the largest overlap over the smaller radius; no forces.
    pub fn energy(&mut self, two: &Two, pose: &Pose) -> (f64, usize, f64) {
        self.find(two, pose, &pose.rotation());
        let (mut energy, mut deepest) = (0.0, 0.0_f64);
        for contact in &self.contacts {
            let [effective, smaller] = radii(two, contact);
            energy += two.law.normal.load(effective, contact.overlap).energy;
            deepest = deepest.max(contact.overlap / smaller);
        }
        (energy, self.contacts.len(), deepest)
    }

    /// The forces in the middle of a step of `h` [s]. `before` are the memories of these two rocks,
    /// ascending; those after the step are added to `after`.
    pub fn forces(&mut self, two: &Two, pose: &Pose, h: f64, before: &[Held], after: &mut Vec<Held>) -> Both {
        let turn = pose.rotation();
        self.find(two, pose, &turn);
        let ([a, b], [first, second], law) = (two.rocks, two.motions, two.law);
        let to_space = first.rotation();
        let velocity = to_space.tr_mul(&(first.velocity - second.velocity));
        let spin = [
            to_space.tr_mul(&first.angular_momentum).component_div(&a.inertia),
            turn * second
                .orientation
                .inverse_transform_vector(&second.angular_momentum)
                .component_div(&b.inertia),
        ];
        let mut both = Both { contacts: self.contacts.len(), ..Both::default() };
        both.first.fastest = velocity.norm() + spin[0].norm() * a.arm + spin[1].norm() * b.arm;
        if self.contacts.is_empty() {
            return both;
        }
        let many = self.contacts.len() as f64;
        let reduced = 1.0 / (1.0 / a.mass + 1.0 / b.mass);
        let dashpot = law.damping.as_ref().map_or(0.0, |d| d.coefficient(reduced, self.contacts.len(), 0.0));
        let inertia = 1.0 / (1.0 / a.inertia.min() + 1.0 / b.inertia.min()) / many;
        let mut old = before;
        self.rows.clear();
        for contact in &self.contacts {
            let arms = [contact.point, contact.point - pose.position];
            let meeting = Meeting {
                normal: contact.normal,
                overlap: contact.overlap,
                radius: radii(two, contact)[0],
                velocity: velocity + spin[0].cross(&arms[0]) - spin[1].cross(&arms[1]),
                spin: spin[0] - spin[1],
                inertia,
                dashpot,
            };
            self.rows.push(meeting, past(&mut old, contact, &to_space), 0, std::slice::from_ref(law));
        }
        self.rows.answer(std::slice::from_ref(law), h);
        for (contact, answer) in self.contacts.iter().zip(self.rows.answers()) {
            if law.remembers() {
                after.push(Held {
                    rocks: two.numbers,
                    spheres: contact.spheres,
                    spring: to_space * answer.spring,
                    moment: to_space * answer.rolled,
                    overlap: contact.overlap,
                });
            }
            let force =
                both.first.add(&answer, 1.0, &contact.point, contact.overlap / radii(two, contact)[1]);
            both.torque -= (contact.point - pose.position).cross(&force) + answer.moment;
        }
        both.first.force = to_space * both.first.force;
        both.first.torque = to_space * both.first.torque;
        both.torque = to_space * both.torque;
        both
    }
}

/// Effective radius of two spheres, and the smaller of their radii [m].
fn radii(two: &Two, contact: &Contact) -> [f64; 2] {
    let radius = |side: usize| two.rocks[side].spheres[contact.spheres[side] as usize].radius;
    let (r, s) = (radius(0), radius(1));
    [r * s / (r + s), r.min(s)]
}

/// What a contact has from before; both it and the memories are looked through in ascending order.
fn past(old: &mut &[Held], contact: &Contact, to_space: &Matrix3<f64>) -> Past {
    while let Some((memory, rest)) = old.split_first()
        && memory.spheres <= contact.spheres
    {
        *old = rest;
        if memory.spheres == contact.spheres {
            let own = |v: &Vector3<f64>| to_space.tr_mul(v);
            return Past {
                spring: own(&memory.spring),
                moment: own(&memory.moment),
                overlap: memory.overlap,
                ..Past::default()
            };
        }
    }
    Past::default()
}
