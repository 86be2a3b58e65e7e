//! The patch by which a rock touches as a whole: contacts that share one load, on terrain, on a side of a box, with another rock.

use crate::contact::pipeline::{Mover, Partner, Site, Sums};
use crate::law::Law;
use crate::law::contact_point::{ContactPoint, History};
use crate::law::normal::Load;
use crate::law::restitution;
use crate::law::yielding::{PlasticIndentation, Pressing};
use nalgebra::Vector3;

/// Contacts under one law that share one load, at one instant.
pub struct ContactPatch<'a> {
    law: &'a Law,
    /// Radius of the contact of balls of the same volumes [m].
    radius: f64,
    /// Equivalent overlap [m], and what it answers.
    overlap: f64,
    load: Load,
    /// Sum of the weights.
    weights: f64,
    /// Rate of the equivalent overlap [m/s].
    rate: f64,
    /// Speed of the rock's centre along the surface [m/s].
    travel: f64,
    /// Mass that the force acts on [kg].
    mass: f64,
    /// Dashpot force along the sum of the contacts [N].
    viscous: f64,
    /// About a seat in ground that gives way: dashpot of all contacts along their normals [N s/m], and `2 g sqrt(m*)` of those
    /// along the surface.
    seated: [f64; 2],
}

impl<'a> ContactPatch<'a> {
    /// Of `contacts`, each with the share that it has in the force on the equivalent overlap; without a load. `mobility` gives the
    /// inverse mass [1/kg] that a force acts on, from its vector and its torque about the rock's centre of mass.
    pub fn new<'c, P: Partner<Contact: 'c>>(
        law: &'a Law,
        [radius, overlap]: [f64; 2],
        partner: &P,
        contacts: impl Iterator<Item = (&'c P::Contact, f64)>,
        rock: &Mover,
        mobility: impl Fn(&Vector3<f64>, &Vector3<f64>) -> f64,
    ) -> Self {
        let (mut weights, mut rate) = (0.0, 0.0);
        let (mut push, mut turn) = (Vector3::zeros(), Vector3::zeros());
        for (contact, weight) in contacts {
            let site = partner.site(contact);
            weights += weight;
            rate += weight * relative_velocity(partner, contact, &site, rock).dot(&site.normal);
            push += site.normal * weight;
            turn += site.arm.cross(&site.normal) * weight;
        }
        let mass = (weights * weights / mobility(&push, &turn)).max(f64::MIN_POSITIVE);
        let travel = rock.velocity.cross(&push).norm() / push.norm();
        let load = Load::default();
        Self { law, radius, overlap, load, weights, rate, travel, mass, viscous: 0.0, seated: [0.0; 2] }
    }

    /// Be loaded with the elastic `load`, and with the dashpot that belongs to it.
    pub fn load_elastically(&mut self, load: Load, sums: &mut Sums) {
        self.load = load;
        sums.elastic += load.energy;
        if let Some(damping) = &self.law.damping {
            let ratio = restitution::as_linear(damping.ratio, 2.5);
            // ds/dt = F dD/dt / s with s = sqrt(2 U).
            let rising = load.force * self.rate / (2.0 * load.energy).sqrt();
            self.viscous = 2.0 * ratio * self.mass.sqrt() * rising;
        }
    }

    /// Be loaded by ground that remembers `dent`, in a step of `h` [s]; whether it pushes.
    pub fn press(&mut self, dent: &mut PlasticIndentation, h: f64, sums: &mut Sums) -> bool {
        let Self { overlap, rate, travel, mass, .. } = *self;
        let felt = dent.press(self.law, self.radius, &Pressing { overlap, rate, travel: travel * h, mass });
        self.load = felt.load;
        self.seated = [felt.dashpot * self.weights, 2.0 * felt.ratio].map(|c| c * mass.sqrt());
        sums.yielded += felt.lost;
        sums.elastic += felt.load.energy;
        self.load.force > 0.0
    }

    /// Add the forces of contact number `number` in a step of `h` [s].
    pub fn add<P: Partner>(
        &self,
        partner: &mut P,
        (number, contact, weight): (usize, &P::Contact, f64),
        rock: &Mover,
        h: f64,
        sums: &mut Sums,
    ) {
        let Self { law, load: whole, .. } = self;
        let share = weight / self.weights;
        if share == 0.0 {
            return;
        }
        let site = partner.site(contact);
        let elastic = whole.force * self.weights;
        // Rocks do not stick.
        let force = (elastic + self.viscous).max(0.0);
        let [along_normal, along_surface] = self.seated;
        let dashpot = law.damping.map_or(along_surface, |d| 2.0 * d.ratio * self.mass.sqrt());
        let velocity = relative_velocity(partner, contact, &site, rock);
        // Of each contact its own: a rock that rocks in its seat comes to rest, too.
        let mut normal_force = force * share;
        if along_normal > 0.0 {
            normal_force = (normal_force + along_normal * share * velocity.dot(&site.normal)).max(0.0);
        }
        let stiffness = whole.stiffness * weight * self.weights;
        // Of the contact of Hertz of this radius that is as stiff.
        let overlap = self.overlap * (stiffness / whole.stiffness).powi(2);
        let load = Load { stiffness, force: elastic * share, energy: whole.energy * share };
        let point = ContactPoint {
            normal: site.normal,
            overlap,
            radius: self.radius,
            velocity,
            spin: rock.relative_spin,
            inertia: rock.inertia,
            dashpot: dashpot * share.sqrt(),
            jump: Vector3::zeros(),
        };
        let history = if law.remembers() { partner.history(number, contact) } else { History::default() };
        let response = law.respond_along(load, normal_force, &point, &history, h);
        if law.remembers() {
            partner.keep(contact, &site, response.history(overlap));
        }
        // The energy of the normal springs is that of the patch.
        let energy = sums.elastic;
        let force = sums.add(&response, &site);
        sums.elastic = energy;
        if let Some(resistance) = &law.resistance {
            sums.rolling.add(resistance, site.normal * normal_force);
        }
        partner.react(contact, &site, &force, &response.moment);
    }
}

/// Velocity of the rock past its partner at a contact [m/s].
fn relative_velocity<P: Partner>(
    partner: &P,
    contact: &P::Contact,
    site: &Site,
    rock: &Mover,
) -> Vector3<f64> {
    rock.velocity + rock.spin.cross(&site.arm) - partner.velocity(contact, site)
}
