//! Contacts of a rock as a whole ([`crate::contact::whole_rock`]) with the terrain.
//!
//! Each sphere touches the terrain once, at its nearest point. The overlap is the sphere's radius less the centre's
//! height over the surface, which is below 0 inside: where the sphere that is first is small, the surface passes its
//! centre, and what follows is as deep in as it looks. The overlap is a continuous function of place alone, and so is the energy.
//!
//! On ground that gives way ([`crate::law::yielding`]) the rock has one depth and one memory, whatever spheres touch and whatever zones
//! they lie in: the equivalent overlap of all its contacts. The law is that of the ground below the sphere that is pressed in most;
//! where another takes over, the force stays.
//!
//! Source of the inside: Baerentzen and Aanaes (2005), IEEE Trans. Vis. Comput. Graph. 11, 243.

use crate::contact::broad_phase::cell_grid::Plane;
use crate::contact::broad_phase::terrain_pairs::{PairsOfSphere, TerrainPairs};
use crate::contact::history::SurfaceHistory;
use crate::contact::narrow_phase::Touch;
use crate::contact::pipeline::{Site, Sums};
use crate::contact::terrain::Turned;
use crate::contact::whole_rock::Whole;
use crate::law::Law;
use crate::law::contact_point::{ContactPoint, History};
use crate::law::normal::Load;
use crate::law::restitution;
use crate::law::table::SurfaceLaws;
use crate::law::yielding::{Dent, Pressing};
use crate::rock::{Motion, Rock};
use dem_solid::geometry::closest::{Feature, on_face};
use dem_solid::geometry::triangle::Nearest;
use dem_terrain::Terrain;
use nalgebra::Vector3;

/// Share by which a distance is taken larger, for rounding and ties.
const ROUNDING: f64 = 1e-6;

/// The contacts, and buffers that are used again and again.
#[derive(Debug, Clone, Default)]
pub struct WholeRockContacts {
    /// The contacts, by sphere: their distance is the height of the centre over the surface, below 0 inside, and their overlap below 0
    /// where they do not touch.
    pub contacts: Vec<Touch>,
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
        for own in around.spheres.iter().filter(|own| own.gap <= around.moved + reach) {
            let number = own.sphere;
            if !whole.shows(number) {
                continue;
            }
            let sphere = &rock.spheres[number as usize];
            let centre = rotation.of(&sphere.centre);
            let place = now.position + centre;
            let Some((normal, height, triangle)) = look(ground, around, own, &place) else { continue };
            let touch = Touch::new((sphere, number), centre, triangle, (normal, height), Feature::Face);
            if touch.overlap > -reach {
                self.contacts.push(touch);
            }
        }
    }

    /// Find the spheres that touch `plane`, number `number`, at `now`: what lies beyond it is pushed back, however far.
    pub fn find_on_plane(
        &mut self,
        rock: &Rock,
        whole: &Whole,
        (number, plane): (u32, &Plane),
        now: &Motion,
    ) {
        self.contacts.clear();
        let rotation = Turned::new(rock, now);
        for (sphere, it) in (0..).zip(&rock.spheres).filter(|(sphere, _)| whole.shows(*sphere)) {
            let centre = rotation.of(&it.centre);
            let distance = plane.offset - plane.normal.dot(&(now.position + centre));
            if distance < it.radius {
                let point = (plane.normal, distance);
                self.contacts.push(Touch::new((it, sphere), centre, number, point, Feature::Face));
            }
        }
    }

    /// Those that touch.
    fn touching(&self) -> impl Iterator<Item = &Touch> {
        self.contacts.iter().filter(|c| c.overlap > 0.0)
    }

    /// Those of law number `law` that touch.
    fn of<'a>(&'a self, laws: SurfaceLaws<'a>, law: u16) -> impl Iterator<Item = &'a Touch> {
        self.touching().filter(move |c| laws.number(c.element) == law)
    }

    /// The equivalent overlap of the contacts of law number `law` [m], and its elastic load; `None` if there is none.
    fn pressed(&self, whole: &Whole, laws: SurfaceLaws, law: u16) -> Option<(f64, Load)> {
        let sum: f64 = self.of(laws, law).map(|c| whole.part(c.sphere, c.overlap)).sum();
        let overlap = whole.equivalent(sum);
        // Too little for a number: nothing.
        (overlap > f64::MIN_POSITIVE)
            .then(|| (overlap, laws.laws[law as usize].normal.load(whole.radius, overlap)))
    }

    /// The equivalent overlap of all that touch [m], and the law below the one that is pressed in most; `None` if none touches.
    fn in_ground(&self, whole: &Whole, laws: SurfaceLaws) -> Option<(f64, u16)> {
        let (mut sum, mut most) = (0.0, (0.0, 0));
        for contact in self.touching() {
            let part = whole.part(contact.sphere, contact.overlap);
            sum += part;
            if part > most.0 {
                most = (part, contact.element);
            }
        }
        let overlap = whole.equivalent(sum);
        (overlap > f64::MIN_POSITIVE).then(|| (overlap, laws.number(most.1)))
    }

    /// Energy of the contacts that were found, as far as it may come back [J]; `dent` is what the ground remembers.
    pub fn energy(&self, whole: &Whole, laws: SurfaceLaws, dent: &Dent) -> f64 {
        if !laws.any(|law| law.yielding.is_some()) {
            let pressed = laws.distinct().filter_map(|law| self.pressed(whole, laws, law));
            return pressed.map(|(_, load)| load.energy).sum();
        }
        let Some((overlap, law)) = self.in_ground(whole, laws) else { return 0.0 };
        // The memory is that of the step's middle; another law takes over in the next.
        let law = if dent.deepest > 0.0 { dent.law } else { law };
        dent.stored(&laws.laws[law as usize], whole.radius, overlap)
    }

    /// Forces of the contacts that were found at `now`, in the middle of a step of `h` [s]; the histories after it go to
    /// [`WholeRockContacts::histories`]. `dent` is what the ground remembers from the step before, and then after this one.
    pub fn forces(
        &mut self,
        rock: &Rock,
        whole: &Whole,
        laws: SurfaceLaws,
        now: &Motion,
        h: f64,
        (before, dent): (&[SurfaceHistory], &mut Dent),
    ) -> Sums {
        let mut histories = std::mem::take(&mut self.histories);
        histories.clear();
        let mut sums = Sums { fastest: now.velocity.norm(), ..Sums::default() };
        if laws.any(|law| law.yielding.is_some()) {
            let Some((overlap, number)) = self.in_ground(whole, laws) else {
                *dent = Dent::default();
                self.histories = histories;
                return sums;
            };
            if dent.law != number {
                let both = [dent.law, number].map(|n| &laws.laws[n as usize]);
                sums.yielded += dent.pass_to(number, both, whole.radius, overlap);
            }
            let law = &laws.laws[number as usize];
            let mut seat = Seat::new(law, whole, overlap, self.touching(), rock, now);
            seat.press(dent, h, &mut sums);
            if seat.load.force > 0.0 {
                seat.scar(&mut sums);
                self.touching().for_each(|contact| seat.add(contact, before, h, &mut histories, &mut sums));
            }
            let deepest = self.touching().map(|c| c.overlap).fold(0.0, f64::max);
            sums.penetration = sums.penetration.max(deepest / whole.radius);
        } else {
            for law in laws.distinct() {
                let Some((overlap, load)) = self.pressed(whole, laws, law) else { continue };
                let of = &laws.laws[law as usize];
                let mut seat = Seat::new(of, whole, overlap, self.of(laws, law), rock, now);
                seat.load_elastically(load);
                sums.elastic += load.energy;
                seat.scar(&mut sums);
                self.of(laws, law)
                    .for_each(|contact| seat.add(contact, before, h, &mut histories, &mut sums));
            }
            histories.sort_unstable_by_key(|m| m.sphere);
        }
        self.histories = histories;
        sums
    }
}

/// Contacts that share one law, at one instant.
struct Seat<'a> {
    law: &'a Law,
    whole: &'a Whole,
    now: &'a Motion,
    /// Angular velocity [rad/s].
    spin: Vector3<f64>,
    /// Equivalent overlap [m], and what it answers.
    overlap: f64,
    load: Load,
    /// Sum of the weights.
    weights: f64,
    /// Rate of the equivalent overlap [m/s].
    rate: f64,
    /// Speed of the centre along the ground [m/s].
    travel: f64,
    /// Mass that the force acts on [kg].
    mass: f64,
    /// Dashpot force along the sum of the contacts [N].
    viscous: f64,
    /// About a seat in ground that gives way: dashpot of all contacts along their normals [N s/m], and `2 g sqrt(m*)` of those
    /// along the surface.
    seated: [f64; 2],
}

impl<'a> Seat<'a> {
    /// Of `contacts`, without a load.
    fn new<'c>(
        law: &'a Law,
        whole: &'a Whole,
        overlap: f64,
        contacts: impl Iterator<Item = &'c Touch>,
        rock: &'a Rock,
        now: &'a Motion,
    ) -> Self {
        let spin = rock.spin(now);
        let (mut weights, mut rate) = (0.0, 0.0);
        let (mut push, mut turn) = (Vector3::zeros(), Vector3::zeros());
        for contact in contacts {
            let weight = whole.weight(contact.sphere, contact.overlap, overlap);
            let arm = contact.arm();
            weights += weight;
            rate += weight * (now.velocity + spin.cross(&arm)).dot(&contact.normal);
            push += contact.normal * weight;
            turn += arm.cross(&contact.normal) * weight;
        }
        let own = now.orientation.inverse_transform_vector(&turn);
        let mobility = push.norm_squared() / rock.mass + own.dot(&own.component_div(&rock.inertia));
        let mass = weights * weights / mobility;
        let travel = now.velocity.cross(&push).norm() / push.norm();
        let load = Load::default();
        let (viscous, seated) = (0.0, [0.0; 2]);
        Self { law, whole, now, spin, overlap, load, weights, rate, travel, mass, viscous, seated }
    }

    /// Be loaded with `load`, and with the dashpot that belongs to it.
    fn load_elastically(&mut self, load: Load) {
        self.load = load;
        if let Some(damping) = &self.law.damping {
            let ratio = restitution::as_linear(damping.ratio, 2.5);
            // ds/dt = F dD/dt / s with s = sqrt(2 U).
            let rising = load.force * self.rate / (2.0 * load.energy).sqrt();
            self.viscous = 2.0 * ratio * self.mass.sqrt() * rising;
        }
    }

    /// Be loaded by ground that remembers `dent`, in a step of `h` [s].
    fn press(&mut self, dent: &mut Dent, h: f64, sums: &mut Sums) {
        let Self { overlap, rate, travel, mass, .. } = *self;
        let felt =
            dent.press(self.law, self.whole.radius, &Pressing { overlap, rate, travel: travel * h, mass });
        self.load = felt.load;
        self.seated = [felt.dashpot * self.weights, 2.0 * felt.ratio].map(|c| c * mass.sqrt());
        sums.yielded += felt.lost;
        sums.elastic += felt.load.energy;
    }

    /// Add the drag of the ground.
    fn scar(&self, sums: &mut Sums) {
        let Some(scarring) = &self.law.scarring else { return };
        let force = scarring.force(self.whole.radius, self.overlap, &self.now.velocity);
        sums.force += force;
        sums.damping_power -= force.dot(&self.now.velocity);
    }

    /// Add the forces of one contact in a step of `h` [s]; `before` are the histories, by sphere.
    fn add(
        &self,
        contact: &Touch,
        before: &[SurfaceHistory],
        h: f64,
        histories: &mut Vec<SurfaceHistory>,
        sums: &mut Sums,
    ) {
        let Self { law, whole, now, spin, load: pressed, .. } = self;
        let weight = whole.weight(contact.sphere, contact.overlap, self.overlap);
        let share = weight / self.weights;
        if share == 0.0 {
            return;
        }
        let elastic = pressed.force * self.weights;
        // Rocks do not stick.
        let force = (elastic + self.viscous).max(0.0);
        let [along_normal, along_surface] = self.seated;
        let dashpot = law.damping.map_or(along_surface, |d| 2.0 * d.ratio * self.mass.sqrt());
        let arm = contact.arm();
        let velocity = now.velocity + spin.cross(&arm);
        // Of each contact its own: a rock that rocks in its seat comes to rest, too.
        let mut pressed_by = force * share;
        if along_normal > 0.0 {
            pressed_by = (pressed_by + along_normal * share * velocity.dot(&contact.normal)).max(0.0);
        }
        let stiffness = pressed.stiffness * weight * self.weights;
        // Of the contact of Hertz of the rock's radius that is as stiff.
        let overlap = self.overlap * (stiffness / pressed.stiffness).powi(2);
        let load = Load { stiffness, force: elastic * share, energy: pressed.energy * share };
        let point = ContactPoint {
            normal: contact.normal,
            overlap,
            radius: whole.radius,
            velocity,
            spin: Vector3::zeros(),
            inertia: 0.0,
            dashpot: dashpot * share.sqrt(),
            jump: Vector3::zeros(),
        };
        let found = before.binary_search_by_key(&contact.sphere, |m| m.sphere);
        let history = found.map_or(History::default(), |at| before[at].history);
        let response = law.respond_along(load, pressed_by, &point, &history, h);
        if law.remembers() {
            histories.push(SurfaceHistory {
                sphere: contact.sphere,
                element: contact.element,
                normal: contact.normal,
                history: response.history(overlap),
            });
        }
        // The energy of the normal springs is that of the group.
        let site = Site { radius: whole.radius, smaller: whole.radius, ..contact.site() };
        let elastic = sums.elastic;
        sums.add(&response, &site);
        sums.elastic = elastic;
        if let Some(resistance) = &law.resistance {
            sums.rolling.add(resistance, contact.normal * pressed_by);
        }
    }
}

/// Where the surface is nearest to `place`, of which `own` holds what may be nearest: unit vector into the terrain, height over it,
/// below 0 inside [m], and a triangle; `None` beside the border.
fn look(
    ground: &Terrain,
    around: &TerrainPairs,
    own: &PairsOfSphere,
    place: &Vector3<f64>,
) -> Option<(Vector3<f64>, f64, u32)> {
    let pairs = around.pairs_of(own);
    let (mut nearest, mut triangle) = (Nearest::default(), pairs[0].triangle);
    // What was further than this when the pairs were searched cannot be the nearest by now.
    let mut most = (own.distance + 2.0 * around.moved) * (1.0 + ROUNDING);
    for pair in pairs {
        if pair.distance <= most && nearest.take(&around.faces[pair.face as usize], place) {
            triangle = pair.triangle;
            most = most.min((nearest.square.sqrt() + around.moved) * (1.0 + ROUNDING));
        }
    }
    let distance = nearest.square.sqrt();
    if distance == 0.0 {
        return Some((-nearest.up.normalize(), 0.0, triangle));
    }
    if !nearest.is_inside() {
        return Some((nearest.to_point / distance, distance, triangle));
    }
    // Below the border and beside it nothing is inside.
    let beside = match nearest.feature {
        Feature::Face => false,
        Feature::Edge => nearest.as_near < 2,
        Feature::Node => around.is_on_border(ground, node_of(ground, triangle, place)),
    };
    (!beside).then(|| (-nearest.to_point / distance, -distance, triangle))
}

/// The corner of a triangle that is nearest to `place`.
fn node_of(ground: &Terrain, triangle: u32, place: &Vector3<f64>) -> u32 {
    let corners = ground.corners(triangle);
    let weights = on_face(place, corners.each_ref()).weights;
    let first = (0..3).max_by(|a, b| weights[*a].total_cmp(&weights[*b])).expect("three");
    ground.triangles[triangle as usize][first]
}
