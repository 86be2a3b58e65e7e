//! Contact of two rocks as wholes.
//!
//! The energy of [`super`], with the radius `R = R_a R_b / (R_a + R_b)` of two balls of the rocks' volumes, and the equivalent overlap
//! over all pairs of spheres: `D^(p+1) = sum_ij (r_ij / R) (d_ij^(p+1) - max(d_ij - h_ij, 0)^(p+1))` with
//! `r_ij = r_i r_j / (r_i + r_j)` and the lesser exposed height h_ij of the two. Two balls are the contact of Hertz to the last digit. The
//! dashpot acts on the mass that the sum of the forces moves of both, levers included.

use super::{POWER, Whole};
use crate::contact::pipeline::{Mover, Partner, Site, Sums};
use crate::law::Law;
use crate::law::contact_point::{ContactPoint, History};
use crate::law::normal::Load;
use crate::law::restitution;
use nalgebra::Vector3;

/// Two rocks as wholes.
#[derive(Debug, Clone, Copy)]
pub struct TwoWholes<'a> {
    /// What each needs.
    pub wholes: [&'a Whole; 2],
}

impl TwoWholes<'_> {
    /// Radius of the contact of balls of their volumes [m].
    pub fn radius(&self) -> f64 {
        let [a, b] = self.wholes.map(|whole| whole.radius);
        a * b / (a + b)
    }

    /// The lesser radius [m].
    pub fn smaller(&self) -> f64 {
        self.wholes[0].radius.min(self.wholes[1].radius)
    }

    /// Size and height of a pair of spheres.
    fn cap(&self, [i, j]: [u32; 2]) -> [f64; 2] {
        let [one, other] = [self.wholes[0].caps[i as usize], self.wholes[1].caps[j as usize]];
        let [r, s] = [one.size * self.wholes[0].radius, other.size * self.wholes[1].radius];
        [r * s / (r + s) / self.radius(), one.height.min(other.height)]
    }

    /// The equivalent overlap of pairs of spheres and their overlaps [m].
    pub fn equivalent(&self, pairs: impl Iterator<Item = ([u32; 2], f64)>) -> f64 {
        let radius = self.radius();
        let power = |depth: f64| (depth / radius).powi(POWER + 1);
        let part = |(spheres, overlap): ([u32; 2], f64)| {
            let [size, height] = self.cap(spheres);
            size * (power(overlap) - power((overlap - height).max(0.0)))
        };
        radius * pairs.map(part).sum::<f64>().powf(1.0 / f64::from(POWER + 1))
    }

    /// How much of the force on the equivalent overlap a pair of spheres has.
    pub fn weight(&self, spheres: [u32; 2], overlap: f64, equivalent: f64) -> f64 {
        let [size, height] = self.cap(spheres);
        let power = |depth: f64| (depth / equivalent).powi(POWER);
        size * (power(overlap) - power((overlap - height).max(0.0)))
    }
}

/// Contacts that share one load.
pub struct Shared<'a> {
    /// Equivalent overlap [m], and the radius that goes with it.
    pub overlap: f64,
    /// See `overlap` [m].
    pub radius: f64,
    /// How much of the force each has.
    pub weights: &'a [f64],
}

impl Shared<'_> {
    /// Forces of `contacts` in the middle of a step of `h` [s], in the frame of the contacts; `mobility` gives the inverse mass [1/kg]
    /// that a force acts on, from its vector and its torque about the rock's centre of mass.
    pub fn forces<P: Partner>(
        &self,
        partner: &mut P,
        contacts: &[P::Contact],
        rock: &Mover,
        law: &Law,
        mobility: impl Fn(&Vector3<f64>, &Vector3<f64>) -> f64,
        h: f64,
    ) -> Sums {
        let velocity = |partner: &P, contact: &P::Contact, site: &Site| {
            rock.velocity + rock.spin.cross(&site.arm) - partner.velocity(contact, site)
        };
        let (mut weights, mut rate, mut push, mut turn) = (0.0, 0.0, Vector3::zeros(), Vector3::zeros());
        for (contact, weight) in contacts.iter().zip(self.weights) {
            let site = partner.site(contact);
            weights += weight;
            rate += weight * velocity(partner, contact, &site).dot(&site.normal);
            push += site.normal * *weight;
            turn += site.arm.cross(&site.normal) * *weight;
        }
        let whole = law.normal.load(self.radius, self.overlap);
        let mass = (weights * weights / mobility(&push, &turn)).max(f64::MIN_POSITIVE);
        let ratio = law.damping.map_or(0.0, |d| d.ratio);
        let rising = whole.force * rate / (2.0 * whole.energy).sqrt();
        let viscous = 2.0 * restitution::as_linear(ratio, 2.5) * mass.sqrt() * rising;
        let mut sums = Sums { elastic: whole.energy, ..Sums::default() };
        for (number, (contact, weight)) in contacts.iter().zip(self.weights).enumerate() {
            let (site, share) = (partner.site(contact), weight / weights);
            if share == 0.0 {
                continue;
            }
            let load = Load {
                stiffness: whole.stiffness * weight * weights,
                force: whole.force * weight,
                energy: whole.energy * share,
            };
            // Of the contact of Hertz of this radius that is as stiff. Rocks do not stick.
            let overlap = self.overlap * (weight * weights).powi(2);
            let pressed = (load.force + viscous * share).max(0.0);
            let history = if law.remembers() { partner.history(number, contact) } else { History::default() };
            let point = ContactPoint {
                normal: site.normal,
                overlap,
                radius: self.radius,
                velocity: velocity(partner, contact, &site),
                spin: rock.relative_spin,
                inertia: rock.inertia,
                dashpot: 2.0 * ratio * (mass * share).sqrt(),
                jump: Vector3::zeros(),
            };
            let response = law.respond_along(load, pressed, &point, &history, h);
            if law.remembers() {
                partner.keep(contact, &site, response.history(overlap));
            }
            let force = sums.add(&response, &site);
            sums.elastic -= load.energy;
            partner.react(contact, &site, &force, &response.moment);
        }
        sums
    }
}
