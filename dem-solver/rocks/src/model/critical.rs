//! The largest stable step, and the step that is taken.
//!
//! What is assumed of the impact: the rock may fall freely until `end_time` and then lands on a fixed,
//! rigid mesh, flat (every sphere of its largest face touches, each with its share of the mass) or on
//! one sphere. The overlap is that of such an impact, at most half a radius, the default of
//! `limits.penetration`. A yielding net is softer; with the masses of its nodes, which act at the contact
//! once rock and net are computed together, the limit is another one, `2 sqrt(m_node / k)`. Two rocks
//! touch as fast as both can fall, flat or on one sphere each.
//!
//! For position Verlet whose velocity-dependent forces see `v + h/2 a` with the acceleration of the
//! step before, an oscillator of frequency w and damping ratio z is stable up to
//! `(w h / 2)^2 + 2 z w h = 1`, that is `h = 2/w (sqrt(1 + 4 z^2) - 2 z)`. (With the plain velocity it
//! would be z instead of 2 z, but of first order in the damping.)

use super::{Model, Steps};
use dem_contact::contact::whole_rock::Whole;
use dem_contact::law::rolling::STIFFNESS;
use dem_contact::law::{Law, restitution};
use dem_contact::rock::Rock;
use dem_contact::rock::faces::Faces;
use dem_contact::settings::{DemSettings, EffectiveMass, RollingName};
use dem_terrain::Terrain;
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use std::f64::consts::PI;
use toolkit::scene::Scene;

/// Overlap over radius beyond which contact is no small indentation.
pub const DEEP: f64 = 0.5;

/// Wires across a face whose stiffness the step must bear together.
const WIRES: f64 = 8.0;

/// Spheres of one face that a sphere of another may lie between.
const BETWEEN: f64 = 4.0;

/// Steps in the shortest contact, on a fixed mesh, that are enough where a net yields: there the window resolves it.
const COARSE_STEPS_PER_CONTACT: f64 = 20.0;

/// Step of a scene without contact: no force limits it, and the rows are as fine [s].
const STEP_WITHOUT_CONTACT: f64 = 1e-3;

/// Largest turn in one step that the scene leaves open [rad].
pub const TURN: f64 = 0.02;

/// The same of a rock that touches as a whole, in its radius; at 0.25 a run is stopped.
const STRIDE_OF_WHOLE: f64 = 0.2;

/// Largest travel of a surface point in one step that the scene leaves open, in radii of the smallest sphere; at 0.5 a run
/// is stopped lest thin parts pass unseen.
const STRIDE: f64 = 0.4;

impl Steps {
    /// For the rocks of a model under its laws; a step above the critical one is refused unless allowed.
    pub fn new(model: &Model, scene: &Scene) -> Result<Self, Diagnostic> {
        let Model { settings, rocks, wholes, laws, .. } = model;
        let mut steps = Self {
            step: STEP_WITHOUT_CONTACT,
            critical: f64::INFINITY,
            contact: f64::INFINITY,
            longest: STEP_WITHOUT_CONTACT,
            ..Self::default()
        };
        let mut stride = f64::INFINITY;
        let examples = settings.examples();
        let speeds = speeds(model);
        // Of the stiffest contact with a mesh.
        let mut on_mesh = Mode::default();
        for &at in &examples {
            let (rock, table) = (&rocks[at], &settings.rocks[at]);
            let speed = if laws.is_some() { kicked(rocks, &examples, &speeds, at) } else { speeds[at] };
            steps.speed = steps.speed.max(speed);
            let spin = Vector3::from(table.angular_velocity).norm();
            steps.step = steps.step.min(TURN / spin);
            // The fastest that a point of the surface gets when speed turns into spin too.
            let lever = (1.0 + rock.mass * rock.arm * rock.arm / rock.inertia.min()).sqrt();
            // With a net it is the spheres that must not pass; on terrain alone the rock.
            let whole = wholes[at].as_ref().or(model.side_wholes[at].as_ref());
            let alone = whole.filter(|_| !scene.has("structure"));
            let passing = match alone {
                Some(whole) => STRIDE_OF_WHOLE * whole.radius,
                None if rock.faces.is_some() => STRIDE_OF_WHOLE * rock.mean_radius(),
                None => STRIDE * rock.smallest_radius,
            };
            stride = stride.min(passing / (speed * lever));
            // A rock that never moves lands nowhere, and may still be touched by a mesh.
            for law in laws.iter().flat_map(|laws| laws.of(&table.material)) {
                let speed = if speed > 0.0 { speed } else { 1.0 };
                if let Some(whole) = whole.filter(|_| law.whole) {
                    on_mesh = on_mesh.and(steps.limit_whole(rock, whole, law, (1.0 / rock.mass, speed)));
                }
                match (&rock.faces, law.foundation()) {
                    (Some(faces), Some(foundation)) => {
                        on_mesh = on_mesh.and(steps.limit_wires(rock, faces, law, foundation));
                    }
                    _ if alone.is_none() && law.yielding.is_none() || !law.whole => {
                        on_mesh = on_mesh.and(steps.limit(rock, law, speed));
                    }
                    _ => {}
                }
            }
        }
        steps.limit_between(model, &examples, &speeds, on_mesh);
        let coarse = steps.contact / COARSE_STEPS_PER_CONTACT;
        steps.longest = coarse.min(DemSettings::TIME_STEP_SCALE * steps.critical).min(steps.step).min(stride);
        if steps.contact.is_finite() || settings.dem.time_step.is_some() {
            steps.choose(&settings.dem, steps.step.min(stride));
        }
        let impact =
            format!("landing at {:.2} m/s, {:.3e} N/m in each contact", steps.speed, steps.stiffness);
        steps.check(&settings.dem, &impact, scene)?;
        Ok(steps)
    }

    /// Take the step that the scene names or leaves to be found, then `most` [s] at most.
    pub(crate) fn choose(&mut self, dem: &DemSettings, most: f64) {
        let resolved = self.contact / dem.steps_per_contact.unwrap_or(DemSettings::STEPS_PER_CONTACT);
        let stable = dem.scale().map_or(resolved, |share| resolved.min(share * self.critical).min(most));
        self.step = dem.time_step.unwrap_or(stable);
    }

    /// Refuse a step above the critical one, that of an `impact`, unless the scene allows it.
    pub(crate) fn check(&self, dem: &DemSettings, impact: &str, scene: &Scene) -> Result<(), Diagnostic> {
        let Self { step, critical, .. } = self;
        if step <= critical || dem.allow_unstable {
            return Ok(());
        }
        let key = if dem.time_step.is_some() { "dem.time_step" } else { "dem.steps_per_contact" };
        let what =
            format!("a step of {step:.3e} s is above the critical step of {critical:.3e} s ({impact})");
        let cure = format!("leave {key} out, shorten the step, or write allow_unstable = true");
        scene.refuse(key, what, cure)
    }

    fn limit(&mut self, rock: &Rock, law: &Law, speed: f64) -> Mode {
        let radius = rock.smallest_radius;
        let touch = Touch { radius, deepest: DEEP * radius, mass: rock.mass, face: rock.facing };
        self.touching(&touch, &[rock], law, speed, |square| square / rock.inertia.min())
    }

    /// Spheres of these rocks that touch flat, or one alone: `turned` is what rolling springs do to the rocks' inertia.
    fn touching(
        &mut self,
        touch: &Touch,
        rocks: &[&Rock],
        law: &Law,
        speed: f64,
        turned: impl Fn(f64) -> f64,
    ) -> Mode {
        // A force with a lever turns the rocks too, and so less than their mass resists [1/kg].
        let mobility = |lever: fn(&Rock) -> f64| {
            let turned = rocks.iter().map(|rock| lever(rock) * lever(rock) / rock.inertia.min());
            turned.fold(1.0 / touch.mass, |sum, turned| sum + turned)
        };
        let &Touch { radius, deepest, mass, face } = touch;
        let stiffness = |mass: f64| {
            let overlap = law.normal.deepest(radius, mass, speed).min(deepest);
            law.normal.load(radius, overlap).stiffness
        };
        let (flat, single) = (stiffness(mass / face), stiffness(mass));
        let mut square = (face * flat / mass).max(single * mobility(|rock| rock.arm));
        if let Some(tangential) = &law.tangential {
            let ratio = tangential.stiffness_ratio;
            let half_edge = |rock: &Rock| rock.highest_corner.max().max(-rock.lowest_corner.min());
            square = square.max(ratio * face * flat * mobility(half_edge));
            square = square.max(ratio * single * mobility(|rock| rock.arm + rock.smallest_radius));
        }
        if let Some(rolling) = law.rolling.filter(|r| r.kind == RollingName::Spring) {
            let arm = rolling.friction * radius;
            let turned = turned(STIFFNESS * arm * arm);
            square = square.max(turned * face * flat).max(turned * single);
        }
        let ratio = damping_ratio(law, face);
        self.critical = self.critical.min(critical(square.sqrt(), ratio));
        self.contact = self.contact.min(law.normal.impact(radius, mass / face, speed).1);
        self.stiffness = self.stiffness.max(flat);
        Mode { square, ratio }
    }

    /// A rock that touches as a whole, at the stiffest on its widest face.
    fn limit_whole(&mut self, rock: &Rock, whole: &Whole, law: &Law, (mobility, speed): (f64, f64)) -> Mode {
        let seat = whole.landing(rock, law, mobility, speed);
        let mode = Mode { square: seat.square, ratio: seat.ratio };
        self.critical = self.critical.min(critical(mode.square.sqrt(), mode.ratio));
        self.contact = self.contact.min(seat.duration);
        self.stiffness = self.stiffness.max(seat.stiffness);
        mode
    }

    /// A rock that lands on wires by its widest face: [`WIRES`] wires as long as it.
    fn limit_wires(&mut self, rock: &Rock, faces: &Faces, law: &Law, foundation: f64) -> Mode {
        let stiffness = foundation * WIRES * 2.0 * faces.rim;
        // A force at the rim turns the rock too.
        let mobility = 1.0 / rock.mass + faces.rim * faces.rim / rock.inertia.min();
        let ratio = law.damping.map_or(0.0, |d| restitution::as_linear(d.ratio, 2.5));
        let mode = Mode { square: stiffness * mobility, ratio };
        self.critical = self.critical.min(critical(mode.square.sqrt(), ratio));
        self.contact = self.contact.min(PI * (rock.mass / stiffness).sqrt());
        self.stiffness = self.stiffness.max(stiffness);
        mode
    }

    /// Contacts between rocks, each of which may be pressed on a mesh, and between two others, at the
    /// same time: the squares of frequencies of stiffnesses that act together add up at most.
    fn limit_between(&mut self, model: &Model, examples: &[usize], speeds: &[f64], on_mesh: Mode) {
        let Model { settings, rocks, laws: Some(laws), .. } = model else { return };
        let mut between = Mode::default();
        for (k, &b) in examples.iter().enumerate() {
            // Spheres of one table touch each other too.
            let own = usize::from(b >= settings.named());
            for &a in &examples[..k + own] {
                let [one, other] = [a, b].map(|r| &settings.rocks[r].material);
                let Some(number) = laws.number(one, other) else { continue };
                // Two that are as fast as they can be may collide head on.
                let speed = speeds[a] + speeds[b];
                let speed = if speed > 0.0 { speed } else { 1.0 };
                let (two, law) = ([&rocks[a], &rocks[b]], &laws.rocks[number]);
                let wholes = [a, b].map(|r| model.pair_wholes.get(r).and_then(Option::as_ref));
                between = between.and(match wholes {
                    [Some(one), Some(other)] if law.whole => {
                        let mobility = 1.0 / two[0].mass + 1.0 / two[1].mass;
                        let first = self.limit_whole(two[0], one, law, (mobility, speed));
                        first.and(self.limit_whole(two[1], other, law, (mobility, speed)))
                    }
                    _ => self.meet(two, law, speed),
                });
            }
        }
        if between.square > 0.0 {
            let times = if rocks.len() > 2 { 2.0 } else { 1.0 };
            let square = on_mesh.square + times * between.square;
            let limit = critical(square.sqrt(), on_mesh.ratio.max(between.ratio));
            self.critical = self.critical.min(limit);
        }
    }

    /// Two rocks touch flat, each sphere of the smaller face between up to four of the other's, or on one
    /// sphere each.
    fn meet(&mut self, [a, b]: [&Rock; 2], law: &Law, speed: f64) -> Mode {
        let radius = 1.0 / (1.0 / a.smallest_radius + 1.0 / b.smallest_radius);
        let mass = 1.0 / (1.0 / a.mass + 1.0 / b.mass);
        let single_spheres = a.spheres.len() == 1 && b.spheres.len() == 1;
        let face = a.facing.min(b.facing) * if single_spheres { 1.0 } else { BETWEEN };
        let touch = Touch { radius, deepest: DEEP * 2.0 * radius, mass, face };
        let turned = |square: f64| square * (1.0 / a.inertia.min() + 1.0 / b.inertia.min());
        self.touching(&touch, &[a, b], law, speed, turned)
    }
}

/// Spheres that touch together.
struct Touch {
    /// Effective radius of each contact, and the largest overlap in it [m].
    radius: f64,
    deepest: f64,
    /// Mass that they share [kg].
    mass: f64,
    /// How many there are when they touch flat.
    face: f64,
}

/// The fastest oscillation of some contacts.
#[derive(Debug, Clone, Copy, Default)]
struct Mode {
    /// Its frequency squared [1/s2].
    square: f64,
    /// Largest damping ratio.
    ratio: f64,
}

impl Mode {
    /// A bound for either.
    fn and(self, other: Self) -> Self {
        Self { square: self.square.max(other.square), ratio: self.ratio.max(other.ratio) }
    }
}

/// Damping ratio of `face` contacts together that damp by `law`.
pub fn damping_ratio(law: &Law, face: f64) -> f64 {
    law.damping.map_or(0.0, |damping| match damping.mass {
        EffectiveMass::Local => damping.ratio,
        EffectiveMass::Rock => damping.ratio * face.sqrt(),
    })
}

/// Largest speed that each rock may get by itself [m/s]; of a sphere that which any of its table may get.
fn speeds(model: &Model) -> Vec<f64> {
    let settings = &model.settings;
    let (down, gravity) = (settings.down(), settings.gravity.norm());
    let of = |at: usize| {
        let start = model.start(at);
        let energy = model.rocks[at].kinetic_energy(&start) / model.rocks[at].mass;
        let mut speed = start.velocity.norm() + gravity * settings.end_time;
        if let Some(ground) = &model.ground {
            let energy = most_energy(ground, &settings.gravity, &start.position, energy);
            speed = speed.min((2.0 * energy).sqrt());
        }
        if let Some(sides) = &settings.sides {
            speed = speed.min((2.0 * (energy + gravity * sides.height(&down))).sqrt());
        }
        speed
    };
    let mut speeds: Vec<f64> = (0..model.rocks.len()).map(of).collect();
    let (_, loose) = speeds.split_at_mut(settings.named());
    for number in 0..settings.spheres.len() {
        let own = || settings.group.iter().map(move |group| usize::from(*group) == number);
        let fastest =
            loose.iter().zip(own()).filter(|(_, own)| *own).map(|(speed, _)| *speed).fold(0.0, f64::max);
        loose.iter_mut().zip(own()).filter(|(_, own)| *own).for_each(|(speed, _)| *speed = fastest);
    }
    speeds
}

/// Speed with which rock number `at` may land once another has kicked it: head on, elastic, both as fast as they can be [m/s].
/// One heavier than it throws it at up to twice its own speed; its equals take its speed from it and give theirs.
fn kicked(rocks: &[Rock], examples: &[usize], speeds: &[f64], at: usize) -> f64 {
    let (mass, own) = (rocks[at].mass, speeds[at]);
    let after = |&by: &usize| {
        let (other, speed) = (&rocks[by], speeds[by]);
        ((mass - other.mass).abs() * own + 2.0 * other.mass * speed) / (mass + other.mass)
    };
    examples.iter().map(after).fold(own, f64::max)
}

/// Energy over its mass that a rock with `energy` at `start` cannot exceed above the lowest corner of the box around a
/// terrain [J/kg].
fn most_energy(ground: &Terrain, gravity: &Vector3<f64>, start: &Vector3<f64>, energy: f64) -> f64 {
    let drop = |axis: usize| {
        let g = gravity[axis];
        (g * (ground.lowest[axis] - start[axis])).max(g * (ground.highest[axis] - start[axis])).max(0.0)
    };
    energy + drop(0) + drop(1) + drop(2)
}

/// Largest stable step of an oscillator of `frequency` [rad/s] and damping ratio `ratio` [s].
pub fn critical(frequency: f64, ratio: f64) -> f64 {
    2.0 / frequency * ((1.0 + 4.0 * ratio * ratio).sqrt() - 2.0 * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest of |x| after many steps of an oscillator of frequency 1 by the solver's scheme.
    fn swing(ratio: f64, h: f64) -> f64 {
        let (mut x, mut v, mut a) = (1.0, 0.0, 0.0);
        let mut last = 0.0;
        for step in 0..800 {
            let middle = x + 0.5 * h * v;
            a = -middle - 2.0 * ratio * (v + 0.5 * h * a);
            v += h * a;
            x = middle + 0.5 * h * v;
            if step >= 700 {
                last = f64::max(last, x.abs());
            }
        }
        last
    }

    #[test]
    fn the_limit_is_sharp_with_and_without_damping() {
        for ratio in [0.0, 0.05, 0.3, 1.13] {
            let limit = critical(1.0, ratio);
            let (below, above) = (swing(ratio, 0.99 * limit), swing(ratio, 1.01 * limit));
            assert!(below < 10.0 && above > 1e3 * below, "ratio {ratio}: {below} below, {above} above");
        }
    }
}
