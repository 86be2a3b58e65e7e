//! Forces of all contacts of one rock at one instant.
//!
//! Signs: the normal points from the sphere into the mesh, `v_n > 0` means approaching, the force on
//! the rock is `-F_n n + f_t`, that on the mesh's nodes `-N_a` times it. The contact point, at which
//! velocities are compared and the force acts on the rock, lies on the mesh's surface: `R - d` from
//! the sphere's centre. A wire takes the force at its axis; it has no twist that could take the
//! moment of a friction force about it.
//!
//! Source: Santasusana et al. (2016), Computational Particle Mechanics 3, 407 (spheres on a mesh); the law and its source:
//! [`crate::law::contact_point`].

use super::broad_phase::mesh_pairs::{Instant, PairElement};
use super::history::{Frame, SurfaceHistory, Transfer};
use super::narrow_phase::sphere_mesh::MeshContacts;
pub use super::narrow_phase::sphere_mesh::MeshScene;
use super::narrow_phase::{Touch, count};
use super::pipeline::{Mover, Partner, Rows, Site, Sums, forces};
use crate::law::Law;
use crate::law::contact_point::History;
use crate::rock::{Motion, Rock};
use nalgebra::Vector3;
use std::mem::take;

/// The dashpot of a wire below a face of the rock.
#[derive(Debug, Clone, Copy)]
pub struct Dashpot {
    /// Velocity of the rock past the wire [m/s], and its part along the normal.
    pub velocity: Vector3<f64>,
    /// See there [m/s].
    pub rate: f64,
    /// Mass that it acts on [kg].
    pub mass: f64,
    /// Coefficient [N s/m], and what of it acts on the rate of the rock.
    pub coefficient: f64,
    /// See there [N s/m].
    pub of_rock: f64,
}

/// What evaluates contacts: buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct MeshForces {
    /// The contacts.
    pub touch: MeshContacts,
    /// Forces on the nodes of the pair list [N], along the axes of space.
    pub node_forces: Vec<Vector3<f64>>,
    /// Stiffness [N/m] and dashpots [N s/m] of the contacts on each of these nodes, about.
    pub node_stiffness: Vec<[f64; 2]>,
    pub(super) node_velocities: Vec<Vector3<f64>>,
    pub(super) transfer: Transfer,
    rows: Rows,
    /// Of contacts with the rock's faces.
    pub(super) dashpots: Vec<Dashpot>,
    /// The histories after the step.
    pub histories: Vec<SurfaceHistory>,
}

impl MeshForces {
    /// Room for the contacts of a rock.
    pub fn reserve(&mut self, nodes: usize, elements: usize, contacts: usize) {
        self.touch.reserve(nodes, elements, contacts);
        self.node_forces.reserve(nodes);
        self.node_stiffness.reserve(nodes);
        self.node_velocities.reserve(nodes);
        self.transfer.reserve(contacts);
        self.rows.reserve(contacts);
        self.histories.reserve(contacts);
    }

    /// Find the contacts at `now` and their elastic energy; no forces.
    pub fn energy(&mut self, scene: MeshScene, now: &Motion, at: Instant) -> f64 {
        if scene.faces.is_some() {
            return self.energy_on_faces(scene, now, at);
        }
        self.touch.find(&scene, now, at);
        let of = |c: &Touch| {
            let law = scene.laws.of(scene.list.elements[c.element as usize].number);
            c.share * law.normal.load(c.radius, c.overlap).energy
        };
        self.touch.contacts.iter().map(of).sum()
    }

    /// Find the contacts at `now`, whose velocities are those of that instant, and their forces.
    ///
    /// `h` [s] is the step in whose middle this is, 0 at an instant that no step surrounds; the
    /// histories after it go to [`MeshForces::histories`], forces on the mesh to
    /// [`MeshForces::node_forces`].
    pub fn forces(
        &mut self,
        scene: MeshScene,
        now: &Motion,
        at: Instant,
        h: f64,
        before: &[SurfaceHistory],
    ) -> Sums {
        self.touch.find(&scene, now, at);
        self.histories.clear();
        self.node_forces.clear();
        self.node_stiffness.clear();
        self.node_velocities.clear();
        let fastest = self.node_motion(scene, now, at);
        if self.touch.contacts.is_empty() {
            return Sums { fastest, ..Sums::default() };
        }
        self.node_forces.resize(scene.list.nodes.len(), Vector3::zeros());
        self.node_stiffness.resize(scene.list.nodes.len(), [0.0; 2]);
        let mut sums = match scene.faces {
            Some(_) => self.forces_on_faces(scene, now, h, before),
            None => self.forces_on_spheres(scene, now, (h, fastest), before),
        };
        sums.turn(&self.touch.rotation);
        sums.fastest = fastest;
        for force in &mut self.node_forces {
            *force = self.touch.rotation * *force;
        }
        sums
    }

    /// The same of contacts with the rock's spheres, which have been found; along the rock's own axes.
    fn forces_on_spheres(
        &mut self,
        scene: MeshScene,
        now: &Motion,
        (h, fastest): (f64, f64),
        before: &[SurfaceHistory],
    ) -> Sums {
        if scene.laws.any(|law| law.remembers()) {
            let rotation = self.touch.rotation;
            // A node slips past the rock by at most so much in the step.
            let frame = Frame { to_space: |v: &Vector3<f64>| rotation * v, slip: fastest * h };
            // A node of several wires is nobody's neighbour: it ends as it began, beside a wire.
            let neighbours = |a: u32, b: u32| scene.contact_mesh.share_a_node(a, b);
            let beside = scene.contact_mesh.crossings.is_some();
            self.transfer.find(&self.touch.contacts, frame, before, neighbours, beside);
        }
        let [velocity, spin] = self.own_motion(scene.rock, now);
        let count = count(&self.touch.contacts);
        let inertia = scene.rock.inertia.min() / count as f64;
        let mover = Mover { velocity, spin, relative_spin: spin, inertia };
        let (contacts, mut rows) = (take(&mut self.touch.contacts), take(&mut self.rows));
        let mut partner = OnMesh { scene, count, before, own: self };
        let sums = forces(&mut partner, &contacts, &mover, scene.laws.laws, &mut rows, h);
        (self.touch.contacts, self.rows) = (contacts, rows);
        sums
    }

    /// The first contact whose mesh has been pushed past the centres of the outer spheres: of a lattice further than
    /// `depth` radii into the box that they span, else through the centre of its own sphere within the last `h` [s]; of a rock that
    /// touches by its faces, further than by half of `1 + depth` times the distance of the nearest face from its centre.
    pub fn passed_centre(&self, scene: MeshScene, now: &Motion, h: f64, depth: f64) -> Option<&Touch> {
        let rock = scene.rock;
        if let Some(faces) = scene.faces {
            let most = 0.5 * (1.0 + depth) * faces.nearest;
            return self.touch.contacts.iter().find(|contact| contact.overlap > most);
        }
        let inside =
            |contact: &Touch| rock.holds(&(contact.centre + contact.normal * contact.distance), depth);
        let motion = self.own_motion(rock, now);
        self.touch.contacts.iter().find(|contact| {
            let element = &scene.list.elements[contact.element as usize];
            // A step ago the point lay on the other side.
            let crossed = || {
                let relative = self.relative_velocity(&motion, contact, element, &contact.centre);
                contact.distance + h * relative.dot(&contact.normal) < 0.0
            };
            inside(contact) || crossed()
        })
    }

    /// How long before the middle of this step of `h` [s] the first of the contacts touched, by overlaps, their rates
    /// and the rock's acceleration [s].
    pub fn touched_ago(&self, scene: MeshScene, now: &Motion, h: f64) -> f64 {
        let motion = self.own_motion(scene.rock, now);
        let acceleration = self.touch.rotation.tr_mul(&now.acceleration);
        let ago = self.touch.contacts.iter().map(|contact| {
            let element = &scene.list.elements[contact.element as usize];
            let approach =
                self.relative_velocity(&motion, contact, element, &contact.arm()).dot(&contact.normal);
            // First root of overlap - approach t + bend t^2 / 2, in the form that does not cancel.
            let bend = acceleration.dot(&contact.normal);
            // The middle of a step is drifted to without acceleration.
            let overlap = contact.overlap + bend * h * h / 8.0;
            let root = (approach * approach - 2.0 * bend * overlap).max(0.0).sqrt();
            if approach > 0.0 { 2.0 * overlap / (approach + root) } else { 0.0 }
        });
        ago.fold(0.0, f64::max)
    }

    /// Velocity [m/s] and angular velocity [rad/s] of the rock in its own frame.
    pub(super) fn own_motion(&self, rock: &Rock, now: &Motion) -> [Vector3<f64>; 2] {
        let spin = self.touch.rotation.tr_mul(&now.angular_momentum).component_div(&rock.inertia);
        [self.touch.rotation.tr_mul(&now.velocity), spin]
    }

    /// Velocity of the rock at `arm` past the mesh's point, in the rock's own frame [m/s].
    pub(super) fn relative_velocity(
        &self,
        [velocity, spin]: &[Vector3<f64>; 2],
        contact: &Touch,
        element: &PairElement,
        arm: &Vector3<f64>,
    ) -> Vector3<f64> {
        velocity + spin.cross(arm) - point_velocity(&self.node_velocities, contact, element)
    }

    /// Displacement of the mesh's point between two windows, in the rock's own frame [m].
    #[inline]
    pub(super) fn jump(&self, scene: MeshScene, contact: &Touch) -> Vector3<f64> {
        let Some(seam) = &scene.seam else { return Vector3::zeros() };
        let nodes = scene.list.elements[contact.element as usize].nodes;
        let [a, b, c] = nodes.map(|n| seam.of_node(scene.list.numbers[n as usize]));
        let [na, nb, nc] = contact.weights;
        self.touch.rotation.tr_mul(&(a * na + b * nb + c * nc))
    }

    /// Velocities of the listed nodes, in the rock's own frame; their largest speed past its centre.
    fn node_motion(&mut self, scene: MeshScene, now: &Motion, at: Instant) -> f64 {
        let to_own = self.touch.rotation.transpose();
        let mut fastest = 0.0_f64;
        for &a in &scene.list.nodes {
            let velocity = scene.motion.velocity(at.segment, a as usize, at.along);
            fastest = fastest.max((velocity - now.velocity).norm_squared());
            self.node_velocities.push(to_own * velocity);
        }
        fastest.sqrt()
    }
}

/// The interface mesh as partner, in the rock's own frame.
struct OnMesh<'a> {
    scene: MeshScene<'a>,
    /// Contacts among which the rock is shared.
    count: usize,
    before: &'a [SurfaceHistory],
    own: &'a mut MeshForces,
}

impl OnMesh<'_> {
    #[inline]
    fn element(&self, contact: &Touch) -> &PairElement {
        &self.scene.list.elements[contact.element as usize]
    }
}

impl Partner for OnMesh<'_> {
    type Contact = Touch;

    #[inline(always)]
    fn law(&self, contact: &Touch) -> u16 {
        self.scene.laws.number(self.element(contact).number)
    }

    #[inline(always)]
    fn site(&self, contact: &Touch) -> Site {
        contact.site()
    }

    #[inline(always)]
    fn velocity(&self, contact: &Touch, _: &Site) -> Vector3<f64> {
        point_velocity(&self.own.node_velocities, contact, self.element(contact))
    }

    #[inline(always)]
    fn dashpot(&mut self, contact: &Touch, law: &Law) -> f64 {
        let mass = self.scene.rock.mass;
        let Some(damping) = &law.damping else { return 0.0 };
        let element = *self.element(contact);
        let numbers = element.nodes.map(|n| self.scene.list.numbers[n as usize]);
        let partner = self.scene.contact_mesh.inverse_mass(numbers, contact.weights);
        let coefficient = damping.coefficient(mass, self.count, partner);
        if self.scene.moves_net {
            let dashpot = coefficient * law.normal.load(contact.radius, contact.overlap).stiffness.sqrt();
            for (node, weight) in element.nodes.into_iter().zip(contact.weights) {
                self.own.node_stiffness[node as usize][1] += contact.share * dashpot * weight * weight;
            }
        }
        coefficient
    }

    #[inline(always)]
    fn history(&mut self, number: usize, _: &Touch) -> History {
        let own = |history: History| history.turned(|v| self.own.touch.rotation.tr_mul(v));
        self.own.transfer.of(number, self.before).map_or(History::default(), own)
    }

    #[inline(always)]
    fn jump(&self, contact: &Touch) -> Vector3<f64> {
        self.own.jump(self.scene, contact)
    }

    #[inline(always)]
    fn keep(&mut self, contact: &Touch, site: &Site, history: History) {
        let rotation = self.own.touch.rotation;
        let (normal, history) = (rotation * site.normal, history.turned(|v| rotation * v));
        let (sphere, element) = (contact.sphere, contact.key);
        self.own.histories.push(SurfaceHistory { sphere, element, normal, history });
    }

    #[inline(always)]
    fn react(&mut self, contact: &Touch, site: &Site, force: &Vector3<f64>, _: &Vector3<f64>) {
        // A wire has no twist that could take a moment.
        let nodes = self.element(contact).nodes;
        // Of a Hertzian spring; one without a power is softer.
        let stiffness = 1.5 * force.norm() / site.overlap;
        for (node, weight) in nodes.into_iter().zip(contact.weights) {
            self.own.node_forces[node as usize] -= force * weight;
            self.own.node_stiffness[node as usize][0] += stiffness * weight * weight;
        }
    }
}

/// Velocity of the mesh's point, of the nodes' velocities [m/s].
#[inline]
fn point_velocity(nodes: &[Vector3<f64>], contact: &Touch, element: &PairElement) -> Vector3<f64> {
    let [a, b, c] = element.nodes.map(|n| &nodes[n as usize]);
    let [na, nb, nc] = contact.weights;
    a * na + b * nb + c * nc
}
