//! Contact of wires with a rock as a whole, by its own faces: however finely spheres cover it, and however finely a wire is divided.
//!
//! A wire that is pressed on a body along its length meets a foundation: the force for each metre of it is
//! `pi/4 E* d`, that of a thin cylinder, with the depth d of the wire's surface below the nearest face. With [`line_in_faces`] the
//! integrals over a straight wire are exact: energy, force and the place where it acts, patch by patch, a patch being what lies below
//! one face. The forces on rock and nodes are the derivatives of the energy, so that elastic contact conserves it, over edges and corners
//! too. At an edge the wire's radius is mitred: there a wire of radius r lies 0.41 r proud of a right angle.
//!
//! The dashpot is that of [`super`] on `s = sqrt(2 U)`: of patch i `c_i = 2 g sqrt(m_i) F_i / sqrt(2 U_i)`, with
//! `1/m_i = U / (U_i m) + sum N_a^2 / m_a`: the mass m that the sum of all forces acts on, levers included, is shared by energy. The
//! rock's part of it, `a_i = c_i (U / (U_i m)) m_i`, acts on the mean rate of all patches, `sum a_i v_i / sum a_i`, and the wire's part on
//! its own rate. On wires that are held this is one linear oscillator in s: the restitution asked for, on faces, edges and corners. Light
//! wires are damped one by one. Friction has the stiffness of the patch.
//!
//! Source: Johnson (1985), Contact Mechanics, 5.6 (cylinders); Popov (2010), Contact Mechanics and Friction, 2.3 and 5 (pi/4 E* L d);
//! the integrals are derived here.
//!
//! [`line_in_faces`]: crate::contact::narrow_phase::line_in_faces

use crate::contact::broad_phase::mesh_pairs::Instant;
use crate::contact::history::{Frame, SurfaceHistory};
use crate::contact::mesh::{Dashpot, MeshForces, MeshScene};
use crate::contact::narrow_phase::Touch;
use crate::contact::pipeline::Sums;
use crate::law::Law;
use crate::law::contact_point::{ContactPoint, History};
use crate::law::normal::Load;
use crate::law::restitution;
use crate::rock::{Motion, Rock};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_4;
use std::mem::take;

/// Least share of a rock's mobility that it shows to forces that hold it from opposite sides.
const SQUEEZED: f64 = 0.25;

impl Law {
    /// Stiffness of a wire's foundation [N/m for each metre of it], of a law of the rock as a whole.
    pub fn foundation(&self) -> Option<f64> {
        self.normal
            .modulus()
            .filter(|_| self.whole && self.yielding.is_none())
            .map(|modulus| FRAC_PI_4 * modulus)
    }
}

/// The sum of the elastic forces on a rock.
#[derive(Default)]
struct TotalPush {
    force: Vector3<f64>,
    torque: Vector3<f64>,
    /// Sum of their sizes [N], and of the energies [J].
    size: f64,
    energy: f64,
}

impl TotalPush {
    fn of(contacts: &[Touch], loads: &[Load]) -> Self {
        let mut push = Self::default();
        for (contact, load) in contacts.iter().zip(loads) {
            let force = contact.normal * load.force;
            push.force += force;
            push.torque += contact.arm().cross(&force);
            push.size += load.force;
            push.energy += load.energy;
        }
        push
    }

    /// Inverse of the mass that it acts on [1/kg].
    fn mobility(&self, rock: &Rock) -> f64 {
        let turned = self.torque.dot(&self.torque.component_div(&rock.inertia));
        let moved = self.force.norm_squared() / rock.mass + turned;
        (moved / (self.size * self.size)).max(SQUEEZED / rock.mass)
    }
}

impl MeshForces {
    /// [`MeshForces::forces`] of contacts with the rock's faces, which have been found.
    pub(in crate::contact) fn forces_on_faces(
        &mut self,
        scene: MeshScene,
        now: &Motion,
        h: f64,
        before: &[SurfaceHistory],
    ) -> Sums {
        let rotation = self.touch.rotation;
        let remembers = scene.laws.any(Law::remembers);
        if remembers {
            let slip = self.node_velocities.iter().map(|v| (v - rotation.tr_mul(&now.velocity)).norm());
            let slip = slip.fold(0.0, f64::max) * h;
            let frame = Frame { to_space: |v: &Vector3<f64>| rotation * v, slip };
            let neighbours = |a: u32, b: u32| scene.contact_mesh.share_a_node(a, b);
            self.transfer.find(&self.touch.contacts, frame, before, neighbours, false);
        }
        let (contacts, loads) = (take(&mut self.touch.contacts), take(&mut self.touch.loads));
        let rocks_rate = self.find_dashpots(scene, now, &contacts, &loads);
        let mut sums = Sums { contacts: contacts.len(), ..Sums::default() };
        let own = |history: History| history.turned(|v| rotation.tr_mul(v));
        for (number, (contact, load)) in contacts.iter().zip(&loads).enumerate() {
            let history = match remembers {
                true => self.transfer.of(number, before).map_or(History::default(), own),
                false => History::default(),
            };
            self.add_on_face(
                scene,
                contact,
                load,
                (self.dashpots[number], rocks_rate),
                history,
                h,
                &mut sums,
            );
        }
        (self.touch.contacts, self.touch.loads) = (contacts, loads);
        sums
    }

    /// Fill in the dashpot of each contact; the mean rate at which the rock moves into all of them [m/s].
    fn find_dashpots(&mut self, scene: MeshScene, now: &Motion, contacts: &[Touch], loads: &[Load]) -> f64 {
        let push = TotalPush::of(contacts, loads);
        let mobility = push.mobility(scene.rock);
        let motion = self.own_motion(scene.rock, now);
        self.dashpots.clear();
        for (contact, load) in contacts.iter().zip(loads) {
            let element = &scene.list.elements[contact.element as usize];
            let velocity = self.relative_velocity(&motion, contact, element, &contact.arm());
            let numbers = element.nodes.map(|n| scene.list.numbers[n as usize]);
            let own = mobility * push.energy / load.energy;
            let mass = 1.0 / (own + scene.contact_mesh.inverse_mass(numbers, contact.weights));
            // Ratio of a linear oscillator; 0 without dashpot.
            let damping = scene.laws.of(element.number).damping;
            let ratio = damping.map_or(0.0, |d| restitution::as_linear(d.ratio, 2.5));
            let coefficient = 2.0 * ratio * mass.sqrt() * load.force / (2.0 * load.energy).sqrt();
            let rate = velocity.dot(&contact.normal);
            self.dashpots.push(Dashpot {
                velocity,
                mass,
                rate,
                coefficient,
                of_rock: coefficient * own * mass,
            });
        }
        let of_rock = |of: fn(&Dashpot) -> f64| self.dashpots.iter().map(of).sum::<f64>();
        of_rock(|d| d.of_rock * d.rate) / of_rock(|d| d.of_rock).max(f64::MIN_POSITIVE)
    }

    /// Add the forces of one contact with its elastic `load`, its dashpot with the mean rate of the rock, and its `history`, along the
    /// rock's own axes.
    #[expect(clippy::too_many_arguments, reason = "one contact, and where it adds to")]
    fn add_on_face(
        &mut self,
        scene: MeshScene,
        contact: &Touch,
        load: &Load,
        (dashpot, rocks_rate): (Dashpot, f64),
        history: History,
        h: f64,
        sums: &mut Sums,
    ) {
        let rotation = self.touch.rotation;
        let element = scene.list.elements[contact.element as usize];
        let law = scene.laws.of(element.number);
        let Dashpot { velocity, mass, rate, coefficient, of_rock } = dashpot;
        let viscous = of_rock * rocks_rate + (coefficient - of_rock) * rate;
        let normal_force = (load.force + viscous).max(0.0);
        // That of the contact of Hertz of the rock's radius that is as stiff.
        let (modulus, radius) = (law.normal.modulus().expect("of a foundation"), scene.rock.mean_radius());
        let overlap = (load.stiffness / (2.0 * modulus)).powi(2) / radius;
        let jump = if history.overlap > 0.0 { self.jump(scene, contact) } else { Vector3::zeros() };
        let point = ContactPoint {
            normal: contact.normal,
            overlap,
            radius,
            velocity,
            spin: Vector3::zeros(),
            inertia: 0.0,
            dashpot: law.damping.map_or(0.0, |d| 2.0 * d.ratio * mass.sqrt()),
            jump,
        };
        let response = law.respond_along(*load, normal_force, &point, &history, h);
        if law.remembers() {
            let (normal, history) = (rotation * contact.normal, response.history(overlap));
            let history = history.turned(|v| rotation * v);
            let (sphere, element) = (contact.sphere, contact.key);
            self.histories.push(SurfaceHistory { sphere, element, normal, history });
        }
        let force = sums.add(&response, &contact.site());
        if let Some(resistance) = &law.resistance {
            sums.rolling.add(resistance, contact.normal * normal_force);
        }
        for (node, weight) in element.nodes.into_iter().zip(contact.weights) {
            self.node_forces[node as usize] -= force * weight;
            let [stiffness, dashpot] = &mut self.node_stiffness[node as usize];
            *stiffness += load.stiffness * weight;
            *dashpot += coefficient * weight;
        }
    }

    /// Find the contacts of the rock's faces at `now` and their elastic energy [J].
    pub(in crate::contact) fn energy_on_faces(&mut self, scene: MeshScene, now: &Motion, at: Instant) -> f64 {
        self.touch.find(&scene, now, at);
        self.touch.loads.iter().map(|load| load.energy).sum()
    }
}
