//! How finely a group of steps over terrain is cut while a rock touches.
//!
//! The step of a scene is that of the shortest contact that is possible: the largest face, flat, at the highest speed
//! that the terrain allows. Most contacts are longer: of a corner, of an edge, at a tenth of that speed. Here the duration
//! is asked of the contact at hand, by the same formula: the spheres that touch or are about to, what inertia
//! resists each of them, how fast they come nearer, and what energy is in their springs (so that the answer does not
//! change while an impact turns speed into overlap and back). Everything follows from the state at the group's start,
//! and no sphere that was not counted can be reached within it.

use crate::model::Model;
use crate::model::critical::{DEEP, TURN, critical, damping_ratio};
use crate::model::state::Body;
use dem_contact::contact::broad_phase::terrain_pairs::TerrainPairs;
use dem_contact::contact::whole_rock::terrain::WholeRockContacts;
use dem_contact::contact::whole_rock::{Landing, Whole};
use dem_contact::law::Law;
use dem_contact::law::table::SurfaceLaws;
use dem_contact::rock::Rock;
use dem_contact::settings::DemSettings;
use dem_terrain::Terrain;
use nalgebra::Vector3;

/// Spheres within this share of the smallest radius count; a group ends before a rock has moved by it.
const NEAR: f64 = 0.1;
/// The same of a rock that touches as a whole, in its radius.
const NEAR_WHOLE: f64 = 0.01;
/// The same on ground that gives way, where contacts are deeper and longer: longer groups, which cost fewer searches.
const NEAR_YIELDING: f64 = 0.03;
/// Most steps of the scene in a group.
const MAX_SUB_STEPS: usize = 64;
/// Smallest approach that is taken into account, as a share of the speed of the rock's fastest point.
const SLOWEST: f64 = 0.1;

/// Steps of the scene, and the equal parts in which they are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SubSteps {
    /// Steps of the scene's length.
    pub steps: usize,
    /// Steps that are taken.
    pub parts: usize,
}

impl SubSteps {
    /// One step as the scene has it.
    pub const ONE: Self = Self { steps: 1, parts: 1 };
}

/// What is near a rock.
#[derive(Debug, Default)]
struct NearSpheres {
    /// Spheres, and the largest overlap among them [m].
    count: f64,
    deepest: f64,
    /// Sums over them of the inverse inertia against a force along the normal, and along the surface [1/kg].
    across: f64,
    along: f64,
    /// Largest speed along a normal [m/s] and energy of the springs [J].
    approach: f64,
    energy: f64,
}

/// The group of steps that the only rock, with the state `body`, takes next, of at most `most` steps of `h` [s].
pub fn next(
    model: &Model,
    ground: &Terrain,
    laws: SurfaceLaws,
    (around, landed): (&mut TerrainPairs, &mut WholeRockContacts),
    body: &Body,
    h: f64,
    most: usize,
) -> SubSteps {
    let (it, now) = (&model.rocks[0], &body.motion);
    let whole = model.wholes[0].as_ref();
    let share = if model.gives_way(0) { NEAR_YIELDING } else { NEAR_WHOLE };
    let reach = whole.map_or(NEAR * it.smallest_radius, |whole| share * whole.radius);
    around.update(it, &model.trees[0], ground, now, h, reach);
    let turn = now.angular_momentum.norm() / it.inertia.min();
    let fastest = now.velocity.norm() + turn * it.arm + model.settings.gravity.norm() * h;
    let steps = ((reach / (fastest * h)) as usize).clamp(1, most.min(MAX_SUB_STEPS));
    let per_contact = model.settings.dem.steps_per_contact.unwrap_or(DemSettings::STEPS_PER_CONTACT);
    // Never finer than the scene says.
    let cut = |longest: f64| {
        let parts = (h * steps as f64 / longest.min(TURN / turn)).ceil() as usize;
        SubSteps { steps, parts: parts.clamp(1, steps) }
    };
    if let Some(whole) = whole {
        landed.find(it, whole, ground, around, now, reach);
        if landed.contacts.is_empty() {
            return SubSteps { steps, parts: steps };
        }
        return cut(of_whole(it, whole, landed, laws, body, [SLOWEST * fastest, per_contact]));
    }
    let near = near(it, laws, around, body, reach);
    if near.count == 0.0 || steps == 1 {
        return SubSteps { steps, parts: steps };
    }
    let stored = 2.0 * near.energy * near.across / near.count;
    let speed = (near.approach * near.approach + stored).sqrt().max(SLOWEST * fastest);
    let of = |number: &u16| step(&laws.laws[*number as usize], it, &near, speed, per_contact);
    cut(laws.row.iter().map(of).fold(f64::INFINITY, f64::min))
}

/// The step [s] that a rock asks for which touches as a whole; `landed` holds the spheres that do, or are about to.
fn of_whole(
    rock: &Rock,
    whole: &Whole,
    landed: &WholeRockContacts,
    laws: SurfaceLaws,
    Body { motion: now, dent, .. }: &Body,
    [slowest, per_contact]: [f64; 2],
) -> f64 {
    let spin = rock.spin(now);
    let (mut approach, mut mobility) = (slowest, 1.0 / rock.mass);
    for contact in &landed.contacts {
        let arm = contact.arm();
        let lever = now.orientation.inverse_transform_vector(&arm.cross(&contact.normal));
        mobility = mobility.max(1.0 / rock.mass + lever.dot(&lever.component_div(&rock.inertia)));
        approach = approach.max((now.velocity + spin.cross(&arm)).dot(&contact.normal).abs());
    }
    let speed = (approach * approach + 2.0 * landed.energy(whole, laws, dent) * mobility).sqrt();
    let of = |at: &Landing| resolved(at.square, at.ratio, at.duration / per_contact);
    let step = |law: u16| of(&whole.landing(rock, &laws.laws[law as usize], mobility, speed));
    let longest = laws.distinct().map(step).fold(f64::INFINITY, f64::min);
    if dent.deepest == 0.0 {
        return longest;
    }
    // On its way out the rock is slower than what it came in with, and the ground is as stiff as that has made it.
    let law = &laws.laws[dent.law as usize];
    let landing = whole.landing_on_ground(rock, law, mobility, dent.deepest, dent.restitution);
    longest.min(of(&landing))
}

/// The step [s], at most `most`, that resolves an oscillation of this frequency squared [1/s2] and damping ratio.
fn resolved(square: f64, ratio: f64, most: f64) -> f64 {
    (DemSettings::TIME_STEP_SCALE * critical(square.sqrt(), ratio)).min(most)
}

/// The step [s] that a law asks for.
fn step(law: &Law, rock: &Rock, near: &NearSpheres, speed: f64, per_contact: f64) -> f64 {
    let (radius, mass) = (rock.smallest_radius, 1.0 / near.across);
    let (deepest, duration) = law.normal.impact(radius, mass, speed);
    let overlap = deepest.min(DEEP * radius).max(near.deepest);
    let stiffness = law.normal.load(radius, overlap).stiffness;
    let tangential = law.tangential.as_ref().map_or(0.0, |t| t.stiffness_ratio);
    let square = stiffness * near.across.max(tangential * near.along);
    resolved(square, damping_ratio(law, near.count), duration / per_contact)
}

/// What is within `reach` [m] of a rock's surface.
fn near(rock: &Rock, laws: SurfaceLaws, around: &TerrainPairs, body: &Body, reach: f64) -> NearSpheres {
    let now = &body.motion;
    let rotation = now.rotation();
    let to_own = rotation.transpose();
    let velocity = to_own * now.velocity;
    let spin = (to_own * now.angular_momentum).component_div(&rock.inertia);
    let least = rock.inertia.min();
    let mut sum = NearSpheres::default();
    let mut rest = &around.pairs[..];
    while let Some(first) = rest.first() {
        let many = rest.iter().take_while(|p| p.sphere == first.sphere).count();
        let (own, others) = rest.split_at(many);
        rest = others;
        let sphere = &rock.spheres[first.sphere as usize];
        let centre = now.position + rotation * sphere.centre;
        let mut nearest: Option<(f64, Vector3<f64>, u32)> = None;
        for pair in own.iter().filter(|p| p.gap <= around.moved + reach) {
            let face = &around.faces[pair.face as usize];
            if face.off_plane(&centre) > sphere.radius + reach {
                continue;
            }
            let (to_point, _) = face.closest(&centre);
            let distance = to_point.norm();
            if distance < sphere.radius + reach && nearest.is_none_or(|(d, ..)| distance < d) {
                nearest = Some((distance, to_point, pair.triangle));
            }
        }
        let Some((distance, to_point, number)) = nearest.filter(|(d, ..)| *d > 0.0) else { continue };
        let normal = to_own * (to_point / distance);
        let arm = sphere.centre + normal * distance;
        let lever = arm.cross(&normal);
        // By Hertz the stiffness at an overlap goes with the root of the radius.
        let share = (sphere.radius / rock.smallest_radius).sqrt();
        sum.count += share;
        sum.across += share * (1.0 / rock.mass + lever.dot(&lever.component_div(&rock.inertia)));
        sum.along += share * (1.0 / rock.mass + arm.norm_squared() / least);
        sum.approach = sum.approach.max((velocity + spin.cross(&arm)).dot(&normal).abs());
        let overlap = sphere.radius - distance;
        if overlap > 0.0 {
            sum.deepest = sum.deepest.max(overlap);
            sum.energy += laws.of(number).normal.load(sphere.radius, overlap).energy;
        }
    }
    sum
}
