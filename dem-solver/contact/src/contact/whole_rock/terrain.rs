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
use crate::contact::pipeline::{Mover, Partner, Site, Sums};
use crate::contact::terrain::Turned;
use crate::contact::whole_rock::Whole;
use crate::contact::whole_rock::patch::ContactPatch;
use crate::law::Law;
use crate::law::contact_point::History;
use crate::law::normal::Load;
use crate::law::table::SurfaceLaws;
use crate::law::yielding::PlasticIndentation;
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
    pub fn energy(&self, whole: &Whole, laws: SurfaceLaws, dent: &PlasticIndentation) -> f64 {
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
        (before, dent): (&[SurfaceHistory], &mut PlasticIndentation),
    ) -> Sums {
        let mut histories = std::mem::take(&mut self.histories);
        histories.clear();
        let (fastest, contacts) = (now.velocity.norm(), self.contacts.len());
        let mut sums = Sums { fastest, contacts, ..Sums::default() };
        let spin = rock.spin(now);
        // No law of a surface resists the rolling of each contact.
        let mover = Mover { velocity: now.velocity, spin, relative_spin: spin, inertia: 0.0 };
        let mobility = |push: &Vector3<f64>, turn: &Vector3<f64>| {
            let own = now.orientation.inverse_transform_vector(turn);
            push.norm_squared() / rock.mass + own.dot(&own.component_div(&rock.inertia))
        };
        let radius = whole.radius;
        let mut ground = Standing { radius, before, histories: &mut histories };
        if laws.any(|law| law.yielding.is_some()) {
            let Some((overlap, number)) = self.in_ground(whole, laws) else {
                *dent = PlasticIndentation::default();
                self.histories = histories;
                return sums;
            };
            if dent.law != number {
                let both = [dent.law, number].map(|n| &laws.laws[n as usize]);
                sums.yielded += dent.pass_to(number, both, radius, overlap);
            }
            let law = &laws.laws[number as usize];
            let own = || self.touching().map(|c| (c, whole.weight(c.sphere, c.overlap, overlap)));
            let mut patch = ContactPatch::new(law, [radius, overlap], &ground, own(), &mover, mobility);
            if patch.press(dent, h, &mut sums) {
                scar(law, whole, overlap, now, &mut sums);
                own().for_each(|(c, weight)| patch.add(&mut ground, (0, c, weight), &mover, h, &mut sums));
            }
            let deepest = self.touching().map(|c| c.overlap).fold(0.0, f64::max);
            sums.penetration = sums.penetration.max(deepest / radius);
        } else {
            for number in laws.distinct() {
                let Some((overlap, load)) = self.pressed(whole, laws, number) else { continue };
                let law = &laws.laws[number as usize];
                let own = || self.of(laws, number).map(|c| (c, whole.weight(c.sphere, c.overlap, overlap)));
                let mut patch = ContactPatch::new(law, [radius, overlap], &ground, own(), &mover, mobility);
                patch.load_elastically(load, &mut sums);
                scar(law, whole, overlap, now, &mut sums);
                own().for_each(|(c, weight)| patch.add(&mut ground, (0, c, weight), &mover, h, &mut sums));
            }
            histories.sort_unstable_by_key(|m| m.sphere);
        }
        self.histories = histories;
        sums
    }
}

/// What stands still as partner of a rock as a whole, along the axes of space.
struct Standing<'a> {
    /// Radius of the rock as a whole [m].
    radius: f64,
    /// Histories from the step before, by sphere, and those after it.
    before: &'a [SurfaceHistory],
    histories: &'a mut Vec<SurfaceHistory>,
}

impl Partner for Standing<'_> {
    type Contact = Touch;

    /// A patch has one law, and the dashpot of its load.
    fn law(&self, _: &Touch) -> u16 {
        0
    }

    fn dashpot(&mut self, _: &Touch, _: &Law) -> f64 {
        0.0
    }

    #[inline]
    fn site(&self, contact: &Touch) -> Site {
        Site { radius: self.radius, smaller: self.radius, ..contact.site() }
    }

    #[inline]
    fn history(&mut self, _: usize, contact: &Touch) -> History {
        let found = self.before.binary_search_by_key(&contact.sphere, |m| m.sphere);
        found.map_or(History::default(), |at| self.before[at].history)
    }

    #[inline]
    fn keep(&mut self, contact: &Touch, site: &Site, history: History) {
        let Touch { sphere, element, .. } = *contact;
        self.histories.push(SurfaceHistory { sphere, element, normal: site.normal, history });
    }
}

/// Add the drag of the ground on a rock that is in by `overlap` [m].
fn scar(law: &Law, whole: &Whole, overlap: f64, now: &Motion, sums: &mut Sums) {
    let Some(scarring) = &law.scarring else { return };
    let force = scarring.force(whole.radius, overlap, &now.velocity);
    sums.force += force;
    sums.damping_power -= force.dot(&now.velocity);
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
