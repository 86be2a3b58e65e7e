//! Contacts of a rock as a whole ([`crate::contact::whole_rock`]) with the terrain.
//!
//! Each sphere touches the terrain once, at its nearest point. The overlap is the sphere's radius less the centre's
//! height over the surface, which is below 0 inside: where the sphere that is first is small, the surface passes its
//! centre, and what follows is as deep in as it looks. The overlap is a continuous function of place alone, and so is the energy.
//!
//! Source of the inside: Baerentzen and Aanaes (2005), IEEE Trans. Vis. Comput. Graph. 11, 243.

use crate::contact::broad_phase::terrain_pairs::{TerrainPair, TerrainPairs};
use crate::contact::history::SurfaceHistory;
use crate::contact::pipeline::{Site, Sums};
use crate::contact::terrain::Turned;
use crate::contact::whole_rock::{Pressed, Whole};
use crate::law::Law;
use crate::law::contact_point::{ContactPoint, History};
use crate::law::normal::Load;
use crate::law::restitution;
use crate::law::table::SurfaceLaws;
use crate::law::yielding::Dent;
use crate::rock::{Motion, Rock};
use dem_solid::geometry::closest::{Feature, on_face};
use dem_solid::geometry::triangle::Nearest;
use dem_terrain::Terrain;
use nalgebra::Vector3;

/// A sphere near the terrain, along the axes of space.
#[derive(Debug, Clone, Copy)]
pub struct WholeRockContact {
    /// Unit vector from the sphere into the terrain.
    pub normal: Vector3<f64>,
    /// Height of the sphere's centre over the surface, along the normal; below 0 inside [m].
    pub height: f64,
    /// Overlap; below 0 where it does not touch [m].
    pub overlap: f64,
    /// The sphere's centre from the rock's centre of mass [m].
    pub centre: Vector3<f64>,
    /// Number of the sphere.
    pub sphere: u32,
    /// Number of a triangle that the nearest point lies on.
    pub triangle: u32,
}

impl WholeRockContact {
    /// The nearest point, from the rock's centre of mass [m].
    pub fn arm(&self) -> Vector3<f64> {
        self.centre + self.normal * self.height
    }
}

/// The contacts that share one law, at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Group<'a> {
    pub(super) law: &'a Law,
    /// Its equivalent overlap and what follows.
    pub pressed: Pressed,
    /// Sum of the weights.
    pub(super) weights: f64,
    /// Rate of the equivalent overlap [m/s].
    pub(super) rate: f64,
    /// Speed of the centre along the ground [m/s].
    pub(super) travel: f64,
    /// Dashpot force along the sum of the contacts [N].
    pub(super) viscous: f64,
    /// Mass that the force acts on [kg].
    pub(super) mass: f64,
    /// About a seat in ground that gives way: dashpot of all contacts along their normals [N s/m], and `2 g sqrt(m*)` of those
    /// along the surface.
    pub(super) seated: [f64; 2],
}

/// The contacts, and buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct WholeRockContacts {
    /// The contacts, by sphere.
    pub contacts: Vec<WholeRockContact>,
    /// The histories after the step.
    pub histories: Vec<SurfaceHistory>,
}

impl WholeRockContacts {
    /// Room for so many contacts.
    pub fn new(contacts: usize) -> Self {
        Self { contacts: Vec::with_capacity(contacts), histories: Vec::with_capacity(contacts) }
    }

    /// Find the spheres that are nearer than `reach` [m] at `now`; `around` must be good there.
    pub fn find(
        &mut self,
        rock: &Rock,
        whole: &Whole,
        ground: &Terrain,
        around: &TerrainPairs,
        now: &Motion,
        reach: f64,
    ) {
        self.contacts.clear();
        let rotation = Turned::new(rock, now);
        for own in around.pairs.chunk_by(|a, b| a.sphere == b.sphere) {
            let number = own[0].sphere;
            if !whole.shows(number) || own.iter().all(|pair| pair.gap > around.moved + reach) {
                continue;
            }
            let sphere = &rock.spheres[number as usize];
            let centre = rotation.of(&sphere.centre);
            let place = now.position + centre;
            let Some(near) = look(ground, around, own, &place) else { continue };
            let overlap = sphere.radius - near.height;
            if overlap > -reach {
                let (normal, height) = (near.normal, near.height);
                self.contacts.push(WholeRockContact {
                    normal,
                    height,
                    overlap,
                    centre,
                    sphere: number,
                    triangle: near.triangle,
                });
            }
        }
    }

    /// Those of law number `law` that touch.
    fn of<'a>(&'a self, laws: SurfaceLaws<'a>, law: u16) -> impl Iterator<Item = &'a WholeRockContact> {
        self.contacts.iter().filter(move |c| c.overlap > 0.0 && laws.number(c.triangle) == law)
    }

    /// What the contacts of law number `law` amount to, without velocities; `None` if there is none.
    pub fn group<'a>(&self, whole: &Whole, laws: SurfaceLaws<'a>, law: u16) -> Option<Group<'a>> {
        let sum: f64 = self.of(laws, law).map(|c| whole.part(c.sphere, c.overlap)).sum();
        let law = &laws.laws[law as usize];
        let modulus = law.normal.modulus().expect("checked: it has a modulus");
        let pressed = whole.pressed(modulus, whole.equivalent(sum));
        // Too little for a number: nothing.
        (pressed.overlap > f64::MIN_POSITIVE).then_some(Group {
            law,
            pressed,
            weights: 0.0,
            rate: 0.0,
            travel: 0.0,
            viscous: 0.0,
            mass: 0.0,
            seated: [0.0; 2],
        })
    }

    /// Elastic energy of the contacts that were found [J]; `dent` is what the ground remembers.
    pub fn energy(&self, whole: &Whole, laws: SurfaceLaws, dent: &Dent) -> f64 {
        if laws.any(|law| law.yielding.is_some()) {
            return self.energy_on_ground(whole, laws, dent);
        }
        laws.distinct().filter_map(|law| self.group(whole, laws, law)).map(|g| g.pressed.energy).sum()
    }

    /// Weights, mass and dashpot of a group, which is that of `contacts`.
    pub(super) fn weigh<'c>(
        group: &mut Group,
        whole: &Whole,
        contacts: impl Iterator<Item = &'c WholeRockContact>,
        rock: &Rock,
        now: &Motion,
    ) {
        let spin = rock.spin(now);
        let (mut rate, mut push, mut turn) = (0.0, Vector3::zeros(), Vector3::zeros());
        for contact in contacts {
            let weight = whole.weight(contact.sphere, contact.overlap, group.pressed.overlap);
            let arm = contact.arm();
            group.weights += weight;
            rate += weight * (now.velocity + spin.cross(&arm)).dot(&contact.normal);
            push += contact.normal * weight;
            turn += arm.cross(&contact.normal) * weight;
        }
        let own = now.orientation.inverse_transform_vector(&turn);
        let mobility = push.norm_squared() / rock.mass + own.dot(&own.component_div(&rock.inertia));
        group.mass = group.weights * group.weights / mobility;
        group.rate = rate;
        group.travel = now.velocity.cross(&push).norm() / push.norm();
        if let Some(damping) = &group.law.damping {
            let ratio = restitution::as_linear(damping.ratio, 2.5);
            // ds/dt = F dD/dt / s with s = sqrt(2 U).
            let rising = group.pressed.force * rate / (2.0 * group.pressed.energy).sqrt();
            group.viscous = 2.0 * ratio * group.mass.sqrt() * rising;
        }
    }

    /// Forces of the contacts that were found at `now`, in the middle of a step of `h` [s]; the histories after
    /// it go to [`WholeRockContacts::histories`].
    pub fn forces(
        &mut self,
        rock: &Rock,
        whole: &Whole,
        laws: SurfaceLaws,
        now: &Motion,
        h: f64,
        (before, dent): (&[SurfaceHistory], &mut Dent),
    ) -> Sums {
        if laws.any(|law| law.yielding.is_some()) {
            return self.forces_on_ground(rock, whole, laws, now, h, (before, dent));
        }
        let mut histories = std::mem::take(&mut self.histories);
        histories.clear();
        let mut sums = Sums { fastest: now.velocity.norm(), ..Sums::default() };
        for law in laws.distinct() {
            let Some(mut group) = self.group(whole, laws, law) else { continue };
            Self::weigh(&mut group, whole, self.of(laws, law), rock, now);
            sums.elastic += group.pressed.energy;
            sums.scar(group.law, whole.radius, group.pressed.overlap, now);
            let seat = Seat { group: &group, rock, whole, now, spin: rock.spin(now), h, before };
            self.of(laws, law).for_each(|contact| seat.add(contact, &mut histories, &mut sums));
        }
        histories.sort_unstable_by_key(|m| m.sphere);
        self.histories = histories;
        sums
    }
}

/// What the contacts of a group are computed with.
pub(super) struct Seat<'a> {
    pub(super) group: &'a Group<'a>,
    pub(super) rock: &'a Rock,
    pub(super) whole: &'a Whole,
    pub(super) now: &'a Motion,
    pub(super) spin: Vector3<f64>,
    pub(super) h: f64,
    pub(super) before: &'a [SurfaceHistory],
}

impl Seat<'_> {
    /// Add the forces of one contact.
    pub(super) fn add(
        &self,
        contact: &WholeRockContact,
        histories: &mut Vec<SurfaceHistory>,
        sums: &mut Sums,
    ) {
        let Self { group, rock, whole, now, spin, .. } = self;
        let (pressed, law) = (group.pressed, group.law);
        let weight = whole.weight(contact.sphere, contact.overlap, pressed.overlap);
        let share = weight / group.weights;
        if share == 0.0 {
            return;
        }
        let elastic = pressed.force * group.weights;
        // Rocks do not stick.
        let force = (elastic + group.viscous).max(0.0);
        let [along_normal, along_surface] = group.seated;
        let dashpot = law.damping.map_or(along_surface, |d| 2.0 * d.ratio * group.mass.sqrt());
        let arm = contact.arm();
        let velocity = now.velocity + spin.cross(&arm);
        // Of each contact its own: a rock that rocks in its seat comes to rest, too.
        let mut pressed_by = force * share;
        if along_normal > 0.0 {
            pressed_by = (pressed_by + along_normal * share * velocity.dot(&contact.normal)).max(0.0);
        }
        let stiffness = pressed.stiffness * weight * group.weights;
        // Of the contact of Hertz of the rock's radius that is as stiff.
        let overlap = pressed.overlap * (stiffness / pressed.stiffness).powi(2);
        let load = Load { stiffness, force: elastic * share, energy: pressed.energy * share };
        let point = ContactPoint {
            normal: contact.normal,
            overlap,
            radius: whole.radius,
            velocity,
            spin: *spin,
            inertia: rock.inertia.min() * share,
            dashpot: dashpot * share.sqrt(),
            jump: Vector3::zeros(),
        };
        let found = self.before.binary_search_by_key(&contact.sphere, |m| m.sphere);
        let history = found.map_or(History::default(), |at| self.before[at].history);
        let response = law.respond_pressed(load, pressed_by, &point, &history, self.h);
        if law.remembers() {
            histories.push(SurfaceHistory {
                sphere: contact.sphere,
                element: contact.triangle,
                normal: contact.normal,
                history: response.history(overlap),
            });
        }
        // The energy of the normal springs is that of the group.
        let site = Site {
            normal: contact.normal,
            overlap: contact.overlap,
            radius: whole.radius,
            smaller: whole.radius,
            arm,
            weight: 1.0,
        };
        let elastic = sums.elastic;
        sums.add(&response, &site);
        sums.elastic = elastic;
    }
}

/// Where the terrain is nearest to a point.
struct NearestPoint {
    /// Unit vector into the terrain.
    normal: Vector3<f64>,
    /// Height over it, below 0 inside [m].
    height: f64,
    triangle: u32,
}

/// Where the surface is from `place`, of which `pairs` hold what may be nearest; `None` beside the border.
fn look(
    ground: &Terrain,
    around: &TerrainPairs,
    pairs: &[TerrainPair],
    place: &Vector3<f64>,
) -> Option<NearestPoint> {
    let (mut nearest, mut triangle) = (Nearest::default(), pairs[0].triangle);
    for pair in pairs {
        if nearest.take(&around.faces[pair.face as usize], place) {
            triangle = pair.triangle;
        }
    }
    let distance = nearest.square.sqrt();
    if distance == 0.0 {
        return Some(NearestPoint { normal: -nearest.up.normalize(), height: 0.0, triangle });
    }
    if !nearest.is_inside() {
        return Some(NearestPoint { normal: nearest.to_point / distance, height: distance, triangle });
    }
    // Below the border and beside it nothing is inside.
    let beside = match nearest.feature {
        Feature::Face => false,
        Feature::Edge => nearest.as_near < 2,
        Feature::Node => around.is_on_border(ground, node_of(ground, triangle, place)),
    };
    (!beside).then(|| NearestPoint { normal: -nearest.to_point / distance, height: -distance, triangle })
}

/// The corner of a triangle that is nearest to `place`.
fn node_of(ground: &Terrain, triangle: u32, place: &Vector3<f64>) -> u32 {
    let corners = ground.corners(triangle);
    let weights = on_face(place, corners.each_ref()).weights;
    let first = (0..3).max_by(|a, b| weights[*a].total_cmp(&weights[*b])).expect("three");
    ground.triangles[triangle as usize][first]
}
