//! Forces of all contacts of one rock at one instant.
//!
//! Signs: the normal points from the sphere into the wall, `v_n > 0` means approaching, the force on
//! the rock is `-F_n n + f_t`, that on the wall's nodes `-N_a` times it. The contact point, at which
//! velocities are compared and the force acts on the rock, lies on the wall's surface: `R - d` from
//! the sphere's centre. A wire takes the force at its axis; it has no twist that could take the
//! moment of a friction force about it.
//!
//! Source: handbook 1.1 to 1.3, 1.8, 1.9.

use crate::contact::broad_phase::mesh_pairs::{Instant, PairElement, PairList};
use crate::contact::history::{Heir, Memory, NONE, inherit, inherit_beside};
use crate::contact::narrow_phase::sphere_mesh::{Contact, Touch};
use crate::contact::rows::{Rows, Sums};
use crate::interface_mesh::Wall;
use crate::interface_mesh::motion::NodeMotion;
use crate::law::contact_point::{Meeting, Past};
use crate::law::table::WallLaws;
use crate::rock::{Motion, Rock};
use nalgebra::Vector3;

/// What a rock and its wall are at an instant.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// The rock.
    pub rock: &'a Rock,
    /// The laws of its contacts.
    pub laws: WallLaws<'a>,
    /// What it touches.
    pub wall: &'a Wall,
    /// Pairs that may touch.
    pub list: &'a PairList,
    /// Motion of the near nodes in the window.
    pub motion: &'a NodeMotion,
    /// In the first step of a window: how its start differs from the end of the window before.
    pub seam: Option<Seam<'a>>,
}

/// Where two windows join. The motion of a window is a prediction; the next one begins where the structure really is.
#[derive(Debug, Clone, Copy)]
pub struct Seam<'a> {
    /// Displacement of all nodes at the end of the window before, as it was predicted [m].
    pub predicted: &'a [f64],
    /// Their displacement at the start of this one [m].
    pub actual: &'a [f64],
}

impl Seam<'_> {
    /// What a node has moved from the one to the other [m].
    fn of_node(&self, node: u32) -> Vector3<f64> {
        let at = 3 * node as usize;
        Vector3::from_fn(|i, _| self.actual[at + i] - self.predicted[at + i])
    }
}

/// What evaluates contacts: buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct Evaluation {
    /// The contacts.
    pub touch: Touch,
    /// Forces on the nodes of the pair list [N], along the axes of space.
    pub node_forces: Vec<Vector3<f64>>,
    node_velocities: Vec<Vector3<f64>>,
    heirs: Vec<u32>,
    rows: Rows,
    /// The memories after the step.
    pub memories: Vec<Memory>,
}

impl Evaluation {
    /// Room for the contacts of a rock.
    pub fn reserve(&mut self, nodes: usize, elements: usize, contacts: usize) {
        self.touch.reserve(nodes, elements, contacts);
        self.node_forces.reserve(nodes);
        self.node_velocities.reserve(nodes);
        self.heirs.reserve(contacts);
        self.rows.reserve(contacts);
        self.memories.reserve(contacts);
    }

    /// Find the contacts at `now` and their elastic energy; no forces.
    pub fn energy(&mut self, scene: Scene, now: &Motion, at: Instant) -> f64 {
        self.touch.find(scene.rock, scene.list, scene.motion, now, at, scene.wall.crossings.as_ref());
        let spheres = &scene.rock.spheres;
        let elements = &scene.list.elements;
        let of = |c: &Contact| {
            let law = scene.laws.of(elements[c.element as usize].number);
            c.share * law.normal.load(spheres[c.sphere as usize].radius, c.overlap).energy
        };
        self.touch.contacts.iter().map(of).sum()
    }

    /// Find the contacts at `now`, whose velocities are those of that instant, and their forces.
    ///
    /// `h` [s] is the step in whose middle this is, 0 at an instant that no step surrounds; the
    /// memories after it go to [`Evaluation::memories`], forces on the wall to
    /// [`Evaluation::node_forces`].
    pub fn forces(&mut self, scene: Scene, now: &Motion, at: Instant, h: f64, before: &[Memory]) -> Sums {
        self.touch.find(scene.rock, scene.list, scene.motion, now, at, scene.wall.crossings.as_ref());
        self.memories.clear();
        self.node_forces.clear();
        self.node_velocities.clear();
        let mut sums = Sums { fastest: self.node_motion(scene, now, at), ..Sums::default() };
        if self.touch.contacts.is_empty() {
            return sums;
        }
        self.node_forces.resize(scene.list.nodes.len(), Vector3::zeros());
        let motion = self.own_motion(scene.rock, now);
        let remembers = scene.laws.any(|law| law.remembers());
        if remembers {
            self.find_heirs(scene, sums.fastest * h, before);
        }
        let needs_rates = scene.laws.any(|law| law.needs_rates());
        let rolls = scene.laws.any(|law| law.rolling.is_some());
        let contacts = self.touch.count();
        let inertia = if rolls { scene.rock.inertia.min() / contacts as f64 } else { 0.0 };
        self.rows.clear();
        for (i, contact) in self.touch.contacts.iter().enumerate() {
            let sphere = &scene.rock.spheres[contact.sphere as usize];
            let element = &scene.list.elements[contact.element as usize];
            let number = scene.laws.number(element.number);
            let law = &scene.laws.laws[number as usize];
            let relative = if needs_rates {
                self.relative_velocity(&motion, contact, element, &arm(scene, contact))
            } else {
                Vector3::zeros()
            };
            let dashpot = law.damping.as_ref().map_or(0.0, |damping| {
                let wall = inverse_mass(scene, element, contact.weights);
                damping.coefficient(scene.rock.mass, contacts, wall)
            });
            let meeting = Meeting {
                normal: contact.normal,
                overlap: contact.overlap,
                radius: sphere.radius,
                velocity: relative,
                spin: motion[1],
                inertia,
                dashpot,
            };
            let mut past = if remembers { self.past(self.heirs[i], before) } else { Past::default() };
            if let Some(seam) = &scene.seam
                && past.overlap > 0.0
            {
                past.jump = self.touch.rotation.tr_mul(&jump(seam, scene, element, contact.weights));
            }
            self.rows.push(meeting, past, number, scene.laws.laws);
        }
        self.rows.answer(scene.laws.laws, h);
        for (contact, answer) in self.touch.contacts.iter().zip(self.rows.answers()) {
            let sphere = &scene.rock.spheres[contact.sphere as usize];
            let element = &scene.list.elements[contact.element as usize];
            if scene.laws.of(element.number).remembers() {
                self.memories.push(Memory {
                    sphere: contact.sphere,
                    element: contact.key(element.number),
                    spring: self.touch.rotation * answer.spring,
                    moment: self.touch.rotation * answer.rolled,
                    normal: self.touch.rotation * contact.normal,
                    overlap: contact.overlap,
                    energy: answer.sheared,
                });
            }
            let arm = arm(scene, contact);
            let force = sums.add(&answer, contact.share, &arm, contact.overlap / sphere.radius);
            let [a, b, c] = element.nodes.map(|n| n as usize);
            let [na, nb, nc] = contact.weights;
            let f = &mut self.node_forces;
            f[a] -= force * na;
            f[b] -= force * nb;
            f[c] -= force * nc;
        }
        sums.force = self.touch.rotation * sums.force;
        sums.torque = self.touch.rotation * sums.torque;
        for force in &mut self.node_forces {
            *force = self.touch.rotation * *force;
        }
        sums
    }

    /// The first contact whose wall has been pushed past the centres of the outer spheres: of a lattice further than
    /// `depth` radii into the box that they span, else through the centre of its own sphere within the last `h` [s].
    pub fn passed_centre(&self, scene: Scene, now: &Motion, h: f64, depth: f64) -> Option<&Contact> {
        let rock = scene.rock;
        let inside = |contact: &Contact| {
            let centre = &rock.spheres[contact.sphere as usize].centre;
            rock.holds(&(centre + contact.normal * contact.distance), depth)
        };
        let motion = self.own_motion(rock, now);
        self.touch.contacts.iter().find(|contact| {
            let element = &scene.list.elements[contact.element as usize];
            let centre = &rock.spheres[contact.sphere as usize].centre;
            // A step ago the point lay on the other side.
            let crossed = || {
                let relative = self.relative_velocity(&motion, contact, element, centre);
                contact.distance + h * relative.dot(&contact.normal) < 0.0
            };
            inside(contact) || crossed()
        })
    }

    /// How long before the middle of this step of `h` [s] the first of the contacts touched, by overlaps, their rates
    /// and the rock's acceleration [s].
    pub fn touched_ago(&self, scene: Scene, now: &Motion, h: f64) -> f64 {
        let motion = self.own_motion(scene.rock, now);
        let acceleration = self.touch.rotation.tr_mul(&now.acceleration);
        let ago = self.touch.contacts.iter().map(|contact| {
            let element = &scene.list.elements[contact.element as usize];
            let arm = arm(scene, contact);
            let approach = self.relative_velocity(&motion, contact, element, &arm).dot(&contact.normal);
            // First root of overlap - approach t + bend t^2 / 2, in the form that does not cancel.
            let bend = acceleration.dot(&contact.normal);
            // The middle of a step is drifted to without acceleration.
            let overlap = contact.overlap + bend * h * h / 8.0;
            let root = (approach * approach - 2.0 * bend * overlap).max(0.0).sqrt();
            if approach > 0.0 { 2.0 * overlap / (approach + root) } else { 0.0 }
        });
        ago.fold(0.0, f64::max)
    }

    /// What a contact has from before, in the rock's own frame.
    #[inline]
    fn past(&self, heir: u32, before: &[Memory]) -> Past {
        if heir == NONE {
            return Past::default();
        }
        let memory = &before[heir as usize];
        let own = |v: &Vector3<f64>| self.touch.rotation.tr_mul(v);
        Past {
            spring: own(&memory.spring),
            moment: own(&memory.moment),
            overlap: memory.overlap,
            ..Past::default()
        }
    }

    /// Velocity [m/s] and angular velocity [rad/s] of the rock in its own frame.
    fn own_motion(&self, rock: &Rock, now: &Motion) -> [Vector3<f64>; 2] {
        let spin = self.touch.rotation.tr_mul(&now.angular_momentum).component_div(&rock.inertia);
        [self.touch.rotation.tr_mul(&now.velocity), spin]
    }

    /// Velocity of the rock at `arm` past the wall's point, in the rock's own frame [m/s].
    #[inline]
    fn relative_velocity(
        &self,
        [velocity, spin]: &[Vector3<f64>; 2],
        contact: &Contact,
        element: &PairElement,
        arm: &Vector3<f64>,
    ) -> Vector3<f64> {
        let [a, b, c] = element.nodes.map(|n| &self.node_velocities[n as usize]);
        let [na, nb, nc] = contact.weights;
        velocity + spin.cross(arm) - (a * na + b * nb + c * nc)
    }

    /// Velocities of the listed nodes, in the rock's own frame; their largest speed past its centre.
    fn node_motion(&mut self, scene: Scene, now: &Motion, at: Instant) -> f64 {
        let to_own = self.touch.rotation.transpose();
        let mut fastest = 0.0_f64;
        for &a in &scene.list.nodes {
            let velocity = scene.motion.velocity(at.segment, a as usize, at.along);
            fastest = fastest.max((velocity - now.velocity).norm_squared());
            self.node_velocities.push(to_own * velocity);
        }
        fastest.sqrt()
    }

    /// Find the memories of the contacts; a node slips past the rock by at most `way` [m] in the step.
    fn find_heirs(&mut self, scene: Scene, way: f64, before: &[Memory]) {
        if before.is_empty() {
            self.heirs.clear();
            self.heirs.resize(self.touch.contacts.len(), NONE);
            return;
        }
        let touch = &self.touch;
        // A node of several wires is nobody's neighbour: it ends as it began, beside a wire.
        let neighbours = |a: u32, b: u32| scene.wall.share_a_node(a, b);
        let view = |contact| View { contact, touch, list: scene.list, way };
        inherit(touch.contacts.len(), |i| view(&touch.contacts[i]), before, neighbours, &mut self.heirs);
        if scene.wall.crossings.as_ref().is_some() {
            inherit_beside(|i| view(&touch.contacts[i]), before, &mut self.heirs);
        }
    }
}

/// The point of a contact on the surface, from the rock's centre of mass [m].
#[inline]
fn arm(scene: Scene, contact: &Contact) -> Vector3<f64> {
    let element = &scene.list.elements[contact.element as usize];
    let sphere = &scene.rock.spheres[contact.sphere as usize];
    sphere.centre + contact.normal * (contact.distance - element.radius)
}

/// `sum N_a^2 / m_a` of the wall's point [1/kg]; 0 where the wall does not tell its masses.
#[inline]
fn inverse_mass(scene: Scene, element: &PairElement, weights: [f64; 3]) -> f64 {
    scene.wall.inverse_mass(element.nodes.map(|n| scene.list.numbers[n as usize]), weights)
}

/// What the wall's point has moved between two windows [m].
fn jump(seam: &Seam, scene: Scene, element: &PairElement, weights: [f64; 3]) -> Vector3<f64> {
    let [a, b, c] = element.nodes.map(|n| seam.of_node(scene.list.numbers[n as usize]));
    a * weights[0] + b * weights[1] + c * weights[2]
}

struct View<'a> {
    contact: &'a Contact,
    touch: &'a Touch,
    list: &'a PairList,
    way: f64,
}

impl Heir for View<'_> {
    fn sphere(&self) -> u32 {
        self.contact.sphere
    }
    fn element(&self) -> u32 {
        self.contact.key(self.list.elements[self.contact.element as usize].number)
    }
    fn normal(&self) -> Vector3<f64> {
        self.touch.rotation * self.contact.normal
    }
    fn turn(&self) -> f64 {
        // Twice the way, for the spin that the nodes do not show; and rounding.
        2.0 * self.way / self.contact.distance + 1e-9
    }
}
