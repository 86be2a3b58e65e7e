//! Contacts of one rock with what stands still, terrain or the sides of a box, at one instant, and their forces.
//!
//! What stands still needs no nodes, no velocities and no forces of its own; all is done along the axes of
//! space, in which it was prepared once. Signs and law are those of [`crate::contact::mesh`].
//!
//! Source: Santasusana et al. (2016), Computational Particle Mechanics 3, 407.

use super::broad_phase::cell_grid::Plane;
use super::broad_phase::terrain_pairs::TerrainPairs;
use super::history::{Frame, SurfaceHistory, Transfer};
use super::narrow_phase::faces::FaceShares;
use super::narrow_phase::selection::keep_contacts;
use super::narrow_phase::{Touch, count};
use super::pipeline::{Mover, Partner, Rows, Site, Sums, forces};
use crate::law::Law;
use crate::law::contact_point::History;
use crate::law::table::SurfaceLaws;
use crate::rock::{Motion, Rock};
use dem_solid::geometry::closest::{Feature, on_face};
use dem_terrain::Terrain;
use nalgebra::{Matrix3, Vector3};

/// The contacts, and buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct SurfaceContacts {
    /// The contacts, by sphere, in the order in which `selection` keeps them.
    pub contacts: Vec<Touch>,
    transfer: Transfer,
    rows: Rows,
    spare: Vec<Touch>,
    faces: FaceShares,
    /// The histories after the step.
    pub histories: Vec<SurfaceHistory>,
}

impl SurfaceContacts {
    /// Room for so many contacts.
    pub fn new(contacts: usize) -> Self {
        let mut it = Self {
            contacts: Vec::with_capacity(contacts),
            histories: Vec::with_capacity(contacts),
            ..Self::default()
        };
        it.transfer.reserve(contacts);
        it.rows.reserve(contacts);
        it
    }

    /// Find the contacts at `now`; `around` must be good there. Where the ground says so they are continuous over kinks.
    pub fn find(&mut self, rock: &Rock, ground: &Terrain, around: &TerrainPairs, now: &Motion) {
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
                    let point = (to_point / distance, distance);
                    self.contacts.push(Touch::new((sphere, number), centre, pair.triangle, point, feature));
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
                    let point = (plane.normal, distance);
                    self.contacts.push(Touch::new((it, sphere), centre, number, point, Feature::Face));
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
        for contact in &mut self.spare {
            let closest = on_face(&centre, ground.corners(contact.element).each_ref());
            (contact.weights, contact.feature) = (closest.weights, closest.feature);
        }
        let nodes = |face: &Touch| ground.triangles[face.element as usize];
        let at = |node: u32| ground.nodes[node as usize] - centre;
        self.faces.share_out(&self.spare, nodes, at, |node| node, &mut self.contacts);
    }

    /// Elastic energy of the contacts that were found [J].
    pub fn energy(&self, laws: SurfaceLaws) -> f64 {
        let of = |c: &Touch| c.share * laws.of(c.element).normal.load(c.radius, c.overlap).energy;
        self.contacts.iter().map(of).sum()
    }

    /// Forces of the contacts that were found at `now`, in the middle of a step of `h` [s]; the histories after
    /// it go to [`SurfaceContacts::histories`]. Without `ground` the contacts are those with planes.
    pub fn forces(
        &mut self,
        rock: &Rock,
        laws: SurfaceLaws,
        ground: Option<&Terrain>,
        now: &Motion,
        h: f64,
        before: &[SurfaceHistory],
    ) -> Sums {
        self.histories.clear();
        let fastest = now.velocity.norm();
        if self.contacts.is_empty() {
            return Sums { fastest, ..Sums::default() };
        }
        if laws.any(|law| law.remembers()) {
            let neighbours = |a: u32, b: u32| ground.is_some_and(|ground| ground.share_a_node(a, b));
            let frame = Frame { to_space: |v: &Vector3<f64>| *v, slip: fastest * h };
            let beside = ground.is_some_and(|ground| ground.continuous);
            self.transfer.find(&self.contacts, frame, before, neighbours, beside);
        }
        let (spin, count) = (rock.spin(now), count(&self.contacts));
        let inertia = rock.inertia.min() / count as f64;
        let mover = Mover { velocity: now.velocity, spin, relative_spin: spin, inertia };
        let Self { contacts, transfer, rows, histories, .. } = self;
        let first = &laws.laws[usize::from(laws.number(contacts[0].element))];
        let known = (first, dashpot(first, rock.mass, count));
        let mut partner = OnSurface { laws, mass: rock.mass, count, known, transfer, before, histories };
        let sums = forces(&mut partner, contacts, &mover, laws.laws, rows, h);
        Sums { fastest, ..sums }
    }

    /// Sphere of the first contact that has been pushed past the centres of the outer spheres, as
    /// [`crate::contact::mesh::MeshForces::passed_centre`] has it.
    pub fn passed_centre(&self, rock: &Rock, now: &Motion, h: f64, depth: f64) -> Option<u32> {
        let spin = rock.spin(now);
        let passed = |contact: &&Touch| {
            let point = contact.centre + contact.normal * contact.distance;
            let relative = now.velocity + spin.cross(&contact.centre);
            rock.holds(&now.orientation.inverse_transform_vector(&point), depth)
                || contact.distance + h * relative.dot(&contact.normal) < 0.0
        };
        self.contacts.iter().find(passed).map(|c| c.sphere)
    }
}

/// A surface that stands still as partner, along the axes of space.
struct OnSurface<'a> {
    laws: SurfaceLaws<'a>,
    /// Mass of the rock [kg].
    mass: f64,
    /// Contacts among which it is shared.
    count: usize,
    /// The law that was asked last, and its dashpot: mostly all have one.
    known: (&'a Law, f64),
    transfer: &'a Transfer,
    before: &'a [SurfaceHistory],
    histories: &'a mut Vec<SurfaceHistory>,
}

/// Dashpot of a contact of a rock of `mass` [kg] that `count` share, with a surface that is fixed [kg^(1/2)].
fn dashpot(law: &Law, mass: f64, count: usize) -> f64 {
    law.damping.as_ref().map_or(0.0, |d| d.coefficient(mass, count, 0.0))
}

impl<'a> Partner for OnSurface<'a> {
    type Contact = Touch;

    #[inline(always)]
    fn law(&self, contact: &Touch) -> u16 {
        self.laws.number(contact.element)
    }

    #[inline(always)]
    fn site(&self, contact: &Touch) -> Site {
        contact.site()
    }

    #[inline(always)]
    fn dashpot(&mut self, contact: &Touch, law: &Law) -> f64 {
        if !std::ptr::eq(law, self.known.0) {
            self.known = (self.laws.of(contact.element), dashpot(law, self.mass, self.count));
        }
        self.known.1
    }

    #[inline(always)]
    fn history(&mut self, number: usize, _: &Touch) -> History {
        self.transfer.of(number, self.before).unwrap_or_default()
    }

    #[inline(always)]
    fn keep(&mut self, contact: &Touch, site: &Site, history: History) {
        let (sphere, element) = (contact.sphere, contact.key);
        self.histories.push(SurfaceHistory { sphere, element, normal: site.normal, history });
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
