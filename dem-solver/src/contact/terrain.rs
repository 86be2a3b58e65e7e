//! Contacts of one rock with what stands still, terrain or the sides of a box, at one instant, and their forces.
//!
//! What stands still needs no nodes, no velocities and no forces of its own; all is done along the axes of
//! space, in which it was prepared once. Signs and law are those of [`crate::contact::mesh`].
//!
//! Source: handbook 1.1 to 1.3, 1.8, 1.9.

use crate::contact::broad_phase::cell_grid::Plane;
use crate::contact::broad_phase::terrain_pairs::Surroundings;
use crate::contact::history::{Heir, Memory, NONE, inherit, inherit_beside};
use crate::contact::narrow_phase::faces::{Faces, Met, Part};
use crate::contact::narrow_phase::selection::{Candidate, keep_contacts};
use crate::contact::rows::{Rows, Sums};
use crate::geometry::closest::{Feature, on_face};
use crate::law::Law;
use crate::law::contact_point::{Meeting, Past};
use crate::law::table::WallLaws;
use crate::rock::{Motion, Rock};
use crate::terrain::Terrain;
use nalgebra::{Matrix3, Vector3};

/// A contact of a sphere with a triangle, along the axes of space.
#[derive(Debug, Clone, Copy)]
pub struct Contact {
    /// Unit vector from the sphere's centre to the triangle's point.
    pub normal: Vector3<f64>,
    /// Distance of the two [m].
    pub distance: f64,
    /// Overlap, above 0 [m].
    pub overlap: f64,
    /// The sphere's centre from the rock's centre of mass [m].
    pub centre: Vector3<f64>,
    /// The sphere's radius [m].
    pub radius: f64,
    /// Number of the sphere.
    pub sphere: u32,
    /// Number of the triangle.
    pub triangle: u32,
    /// How often it counts: 1, but for edges and corners that several triangles share.
    pub share: f64,
    /// What its memory is kept under: the triangle's number, or one beyond all triangles for an edge or a corner.
    key: u32,
    feature: Feature,
}

impl Contact {
    /// Its point, from the rock's centre of mass [m].
    #[inline]
    fn arm(&self) -> Vector3<f64> {
        self.centre + self.normal * self.distance
    }
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
        self.triangle
    }
}

/// The contacts, and buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct Standing {
    /// The contacts, by sphere, in the order of the hierarchy.
    pub contacts: Vec<Contact>,
    heirs: Vec<u32>,
    rows: Rows,
    spare: Vec<Contact>,
    met: Vec<Met>,
    faces: Faces,
    /// The memories after the step.
    pub memories: Vec<Memory>,
}

impl Standing {
    /// Room for so many contacts.
    pub fn new(contacts: usize) -> Self {
        let mut rows = Rows::default();
        rows.reserve(contacts);
        Self {
            rows,
            contacts: Vec::with_capacity(contacts),
            heirs: Vec::with_capacity(contacts),
            memories: Vec::with_capacity(contacts),
            ..Self::default()
        }
    }

    /// Find the contacts at `now`; `around` must be good there. Where the ground says so they are continuous over kinks.
    pub fn find(&mut self, rock: &Rock, ground: &Terrain, around: &Surroundings, now: &Motion) {
        self.contacts.clear();
        let moved = around.moved;
        let rotation = Turned::new(rock, now);
        let mut rest = &around.pairs[..];
        while let Some(first) = rest.first() {
            let (number, before) = (first.sphere, self.contacts.len());
            let sphere = &rock.spheres[number as usize];
            let mut at = None;
            while let Some((pair, others)) = rest.split_first()
                && pair.sphere == number
            {
                rest = others;
                if pair.gap > moved {
                    continue;
                }
                let (centre, place) = *at.get_or_insert_with(|| {
                    let centre = rotation.of(&sphere.centre);
                    (centre, now.position + centre)
                });
                let face = &around.faces[pair.face as usize];
                if face.off_plane(&place) >= sphere.radius {
                    continue;
                }
                let (to_point, feature) = face.closest(&place);
                let square = to_point.norm_squared();
                if square < sphere.radius * sphere.radius {
                    let distance = square.sqrt();
                    self.contacts.push(Contact {
                        normal: to_point / distance,
                        distance,
                        overlap: sphere.radius - distance,
                        centre,
                        radius: sphere.radius,
                        sphere: number,
                        triangle: pair.triangle,
                        share: 1.0,
                        key: pair.triangle,
                        feature,
                    });
                }
            }
            if ground.continuous {
                self.share_out(before, ground, &now.position);
            } else if self.contacts.len() > before + 1 {
                let kept = keep_contacts(&mut self.contacts[before..]);
                self.contacts.truncate(before + kept);
            }
        }
    }

    /// Find the contacts with `planes` at `now`: what lies beyond one is pushed back, however far.
    pub fn find_on_planes(&mut self, rock: &Rock, planes: &[Plane], now: &Motion) {
        self.contacts.clear();
        let rotation = Turned::new(rock, now);
        for (sphere, it) in (0..).zip(&rock.spheres) {
            let centre = rotation.of(&it.centre);
            let place = now.position + centre;
            for (number, plane) in (0..).zip(planes) {
                let distance = plane.offset - plane.normal.dot(&place);
                if distance < it.radius {
                    self.contacts.push(Contact {
                        normal: plane.normal,
                        distance,
                        overlap: it.radius - distance,
                        centre,
                        radius: it.radius,
                        sphere,
                        triangle: number,
                        share: 1.0,
                        key: number,
                        feature: Feature::Face,
                    });
                }
            }
        }
    }

    /// Make of the candidates from `first` on, all of one sphere, contacts that are continuous over edges and corners.
    fn share_out(&mut self, first: usize, ground: &Terrain, position: &Vector3<f64>) {
        // Mostly one triangle, away from its edges. It was written just now: to copy it whole would wait for that.
        match &self.contacts[first..] {
            [] => return,
            [one] if one.feature == Feature::Face => return,
            _ => {}
        }
        self.spare.clear();
        self.spare.extend(self.contacts.drain(first..));
        let centre = position + self.spare[0].centre;
        self.met.clear();
        self.met.extend(self.spare.iter().map(|contact| {
            let corners = ground.corners(contact.triangle);
            let closest = on_face(&centre, corners.each_ref());
            let nodes = ground.triangles[contact.triangle as usize];
            Met { nodes, number: contact.triangle, weights: closest.weights, feature: closest.feature }
        }));
        let at = |node: u32| ground.nodes[node as usize] - centre;
        let (contacts, spare) = (&mut self.contacts, &self.spare);
        self.faces.share_out(&self.met, at, |shared| {
            let face = spare[shared.face];
            let (beyond, feature) = match shared.part {
                Part::Face => return contacts.push(face),
                Part::Edge(number) => (number, Feature::Edge),
                Part::Node(number) => (number, Feature::Node),
            };
            let distance = shared.to_point.norm();
            if distance < face.radius {
                contacts.push(Contact {
                    normal: shared.to_point / distance,
                    distance,
                    overlap: face.radius - distance,
                    share: shared.share,
                    key: !beyond,
                    feature,
                    ..face
                });
            }
        });
    }

    /// Number of contacts, shared points counted by their shares.
    pub fn count(&self) -> usize {
        let sum: f64 = self.contacts.iter().map(|c| c.share).sum();
        if sum >= 1.0 { sum as usize } else { self.contacts.len().min(1) }
    }

    /// Elastic energy of the contacts that were found [J].
    pub fn energy(&self, laws: WallLaws) -> f64 {
        let of = |c: &Contact| c.share * laws.of(c.triangle).normal.load(c.radius, c.overlap).energy;
        self.contacts.iter().map(of).sum()
    }

    /// Forces of the contacts that were found at `now`, in the middle of a step of `h` [s]; the memories after
    /// it go to [`Standing::memories`]. Without `ground` the contacts are those with planes.
    pub fn forces(
        &mut self,
        rock: &Rock,
        laws: WallLaws,
        ground: Option<&Terrain>,
        now: &Motion,
        h: f64,
        before: &[Memory],
    ) -> Sums {
        self.memories.clear();
        let mut sums = Sums { fastest: now.velocity.norm(), ..Sums::default() };
        if self.contacts.is_empty() {
            return sums;
        }
        let remembers = laws.any(|law| law.remembers());
        let stays = |(c, m): (&Contact, &Memory)| (c.sphere, c.key) == (m.sphere, m.element);
        if before.len() == self.contacts.len() && self.contacts.iter().zip(before).all(stays) {
            // As in most steps, each is its own heir.
            self.heirs.clear();
            self.heirs.extend(0..before.len() as u32);
        } else if remembers {
            let neighbours = |a: u32, b: u32| ground.is_some_and(|ground| ground.share_a_node(a, b));
            let view = |contact| View { contact, way: sums.fastest * h };
            inherit(self.contacts.len(), |i| view(&self.contacts[i]), before, neighbours, &mut self.heirs);
            if ground.is_some_and(|ground| ground.continuous) {
                inherit_beside(|i| view(&self.contacts[i]), before, &mut self.heirs);
            }
        }
        let spin = rock.spin(now);
        let contacts = self.count();
        let inertia = rock.inertia.min() / contacts as f64;
        let dashpot =
            |law: &Law| law.damping.as_ref().map_or(0.0, |d| d.coefficient(rock.mass, contacts, 0.0));
        let mut known = laws.of(self.contacts[0].triangle);
        let mut coefficient = dashpot(known);
        self.rows.clear();
        for (i, contact) in self.contacts.iter().enumerate() {
            let number = laws.number(contact.triangle);
            let law = &laws.laws[number as usize];
            if !std::ptr::eq(law, known) {
                (known, coefficient) = (law, dashpot(law));
            }
            let past = match self.heirs.get(i) {
                Some(&heir) if remembers && heir != NONE => before[heir as usize].past(),
                _ => Past::default(),
            };
            let meeting = Meeting {
                normal: contact.normal,
                overlap: contact.overlap,
                radius: contact.radius,
                velocity: now.velocity + spin.cross(&contact.arm()),
                spin,
                inertia,
                dashpot: coefficient,
            };
            self.rows.push(meeting, past, number, laws.laws);
        }
        self.rows.answer(laws.laws, h);
        for (contact, answer) in self.contacts.iter().zip(self.rows.answers()) {
            if laws.of(contact.triangle).remembers() {
                self.memories.push(Memory {
                    sphere: contact.sphere,
                    element: contact.key,
                    spring: answer.spring,
                    moment: answer.rolled,
                    normal: contact.normal,
                    overlap: contact.overlap,
                    energy: answer.sheared,
                });
            }
            sums.add(&answer, contact.share, &contact.arm(), contact.overlap / contact.radius);
        }
        sums
    }

    /// Sphere of the first contact that has been pushed past the centres of the outer spheres, as
    /// [`crate::contact::mesh::Evaluation::passed_centre`] has it.
    pub fn passed_centre(&self, rock: &Rock, now: &Motion, h: f64, depth: f64) -> Option<u32> {
        let spin = rock.spin(now);
        let passed = |contact: &&Contact| {
            let point = contact.centre + contact.normal * contact.distance;
            let relative = now.velocity + spin.cross(&contact.centre);
            rock.holds(&now.orientation.inverse_transform_vector(&point), depth)
                || contact.distance + h * relative.dot(&contact.normal) < 0.0
        };
        self.contacts.iter().find(passed).map(|c| c.sphere)
    }
}

/// Own vectors along the axes of space.
pub(super) enum Turned {
    /// All centres are the centre of mass.
    Centred,
    By(Matrix3<f64>),
}

impl Turned {
    pub(super) fn new(rock: &Rock, now: &Motion) -> Self {
        if rock.arm == 0.0 { Self::Centred } else { Self::By(now.rotation()) }
    }

    #[inline]
    pub(super) fn of(&self, own: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Centred => *own,
            Self::By(rotation) => rotation * own,
        }
    }
}

struct View<'a> {
    contact: &'a Contact,
    way: f64,
}

impl Heir for View<'_> {
    fn sphere(&self) -> u32 {
        self.contact.sphere
    }
    fn element(&self) -> u32 {
        self.contact.key
    }
    fn normal(&self) -> Vector3<f64> {
        self.contact.normal
    }
    fn turn(&self) -> f64 {
        // Twice the way, for the spin that it does not show; and rounding.
        2.0 * self.way / self.contact.distance.abs() + 1e-9
    }
}
