//! The law applied to several contacts at once: what [`Law::answer`] does to one, with each quantity in a column.
//!
//! Roots and quotients take most of the time of a contact; a processor forms four at once as fast as one. The expressions are
//! those of the scalar code in the same order and without fused products, so that the bytes are the same (a test compares
//! them). Where a contact takes another branch than its neighbours, both are computed and one is chosen. What is rare is done
//! one by one: rolling resistance, a jump between windows, the contacts that are left over.

use super::Law;
use super::normal::{Load, Normal};
use super::pair::{Answer, Meeting, Past};
use super::tangential::Tangential;
use crate::settings::TangentialName;
use interface_defs::wide;
use nalgebra::Vector3;

/// Contacts that are computed together.
const WIDTH: usize = 8;

/// A number of each of them.
type Column = [f64; WIDTH];

/// What goes in.
struct Given {
    normal: [Column; 3],
    velocity: [Column; 3],
    overlap: Column,
    radius: Column,
    dashpot: Column,
    spring: [Column; 3],
    /// Overlap in the step before.
    before: Column,
}

/// What comes out.
struct Found {
    stiffness: Column,
    elastic: Column,
    energy: Column,
    pressed: Column,
    approach: Column,
    force: [Column; 3],
    spring: [Column; 3],
    rubbed: Column,
    sheared: Column,
}

impl Given {
    #[inline(always)]
    fn of(meetings: &[Meeting; WIDTH], pasts: &[Past; WIDTH]) -> Self {
        let of = |read: fn(&Meeting) -> f64| std::array::from_fn(|l| read(&meetings[l]));
        let vector = |read: fn(&Meeting) -> &Vector3<f64>| {
            std::array::from_fn(|a| std::array::from_fn(|l| read(&meetings[l])[a]))
        };
        Self {
            normal: vector(|m| &m.normal),
            velocity: vector(|m| &m.velocity),
            overlap: of(|m| m.overlap),
            radius: of(|m| m.radius),
            dashpot: of(|m| m.dashpot),
            spring: std::array::from_fn(|a| std::array::from_fn(|l| pasts[l].spring[a])),
            before: std::array::from_fn(|l| pasts[l].overlap),
        }
    }
}

impl Found {
    const NONE: Self = Self {
        stiffness: [0.0; WIDTH],
        elastic: [0.0; WIDTH],
        energy: [0.0; WIDTH],
        pressed: [0.0; WIDTH],
        approach: [0.0; WIDTH],
        force: [[0.0; WIDTH]; 3],
        spring: [[0.0; WIDTH]; 3],
        rubbed: [0.0; WIDTH],
        sheared: [0.0; WIDTH],
    };

    #[inline(always)]
    fn of(&self, l: usize) -> Answer {
        let vector = |v: &[Column; 3]| Vector3::new(v[0][l], v[1][l], v[2][l]);
        let load = Load { stiffness: self.stiffness[l], force: self.elastic[l], energy: self.energy[l] };
        Answer {
            load,
            force: vector(&self.force),
            moment: Vector3::zeros(),
            spring: vector(&self.spring),
            rolled: Vector3::zeros(),
            damped: (self.pressed[l] - load.force) * self.approach[l],
            rubbed: self.rubbed[l],
            sheared: self.sheared[l],
            jumped: 0.0,
        }
    }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

wide! {
    /// The elastic load, and the normal force with the dashpot.
    fn press(law: &Law, given: &Given, found: &mut Found) {
        match law.normal {
            Normal::Hertz(modulus) => for l in 0..WIDTH {
                let stiffness = 2.0 * modulus * (given.radius[l] * given.overlap[l]).sqrt();
                let force = 2.0 / 3.0 * stiffness * given.overlap[l];
                found.stiffness[l] = stiffness;
                found.elastic[l] = force;
                found.energy[l] = 0.4 * force * given.overlap[l];
            },
            Normal::Linear(_) | Normal::LinearPerRadius(_) => for l in 0..WIDTH {
                let load = law.normal.load(given.radius[l], given.overlap[l]);
                found.stiffness[l] = load.stiffness;
                found.elastic[l] = load.force;
                found.energy[l] = load.energy;
            },
        }
        let damped = law.damping.is_some();
        for l in 0..WIDTH {
            let n = [given.normal[0][l], given.normal[1][l], given.normal[2][l]];
            let v = [given.velocity[0][l], given.velocity[1][l], given.velocity[2][l]];
            let approach = dot(v, n);
            let viscous = given.dashpot[l] * found.stiffness[l].sqrt() * approach;
            let both = found.elastic[l] + viscous;
            let pushed = if both > 0.0 { both } else { 0.0 };
            let pressed = if damped { pushed } else { found.elastic[l] };
            found.approach[l] = approach;
            found.pressed[l] = pressed;
            for a in 0..3 {
                found.force[a][l] = n[a] * -pressed;
            }
        }
    }
}

wide! {
    /// The tangential spring and its dashpot, within the limits `friction` times the normal force; `carried`: what of the springs
    /// is left.
    fn grip(tangential: &Tangential, given: &Given, friction: &Column, carried: &Column, h: f64, found: &mut Found) {
        let half_step = 0.5 * h;
        for l in 0..WIDTH {
            let n = [given.normal[0][l], given.normal[1][l], given.normal[2][l]];
            let v = [given.velocity[0][l], given.velocity[1][l], given.velocity[2][l]];
            let approach = found.approach[l];
            let slip = [v[0] - n[0] * approach, v[1] - n[1] * approach, v[2] - n[2] * approach];
            // The spring, laid into the plane.
            let old = [given.spring[0][l], given.spring[1][l], given.spring[2][l]];
            let along = dot(old, n);
            let flat = [old[0] - n[0] * along, old[1] - n[1] * along, old[2] - n[2] * along];
            let (square, whole) = (dot(flat, flat), dot(old, old));
            let longer = (whole / square).sqrt();
            let turned = if square > 0.25 * whole { longer } else { 1.0 };
            let left = carried[l];
            let spring = [flat[0] * turned * left, flat[1] * turned * left, flat[2] * turned * left];
            // Half an increment of slip.
            let stiffness = tangential.stiffness_ratio * found.stiffness[l];
            let limit = friction[l] * found.pressed[l];
            let by = half_step * stiffness;
            let half = [slip[0] * by, slip[1] * by, slip[2] * by];
            let trial = [spring[0] - half[0], spring[1] - half[1], spring[2] - half[2]];
            let size = dot(trial, trial).sqrt();
            let slides = size > limit;
            // Sliding: cut, without dashpot.
            let shorter = limit / size;
            let cut = [trial[0] * shorter, trial[1] * shorter, trial[2] * shorter];
            // Sticking: with the dashpot, shortened until both are within the limit.
            let c = -given.dashpot[l] * stiffness.sqrt();
            let viscous = [slip[0] * c, slip[1] * c, slip[2] * c];
            let limit2 = limit * limit;
            let sum = [trial[0] + viscous[0], trial[1] + viscous[1], trial[2] + viscous[2]];
            let (against, viscous2) = (dot(trial, viscous), dot(viscous, viscous));
            let beside = limit2 - dot(trial, trial);
            let room = if beside > 0.0 { beside } else { 0.0 };
            let share = ((against * against + viscous2 * room).sqrt() - against) / viscous2;
            let share = if share < 0.0 { 0.0 } else if share > 1.0 { 1.0 } else { share };
            let share = if dot(sum, sum) <= limit2 { 1.0 } else { share };
            let stuck = [
                trial[0] + viscous[0] * share,
                trial[1] + viscous[1] * share,
                trial[2] + viscous[2] * share,
            ];
            let mut end = [0.0; 3];
            let mut rubbed = [0.0; 3];
            for a in 0..3 {
                let elastic = if slides { cut[a] } else { trial[a] };
                let force = if slides { cut[a] } else { stuck[a] };
                end[a] = elastic - half[a];
                found.force[a][l] += force;
                rubbed[a] = force;
            }
            let size = dot(end, end).sqrt();
            let shorter = limit / size;
            let shorter = if size > limit { shorter } else { 1.0 };
            let end = [end[0] * shorter, end[1] * shorter, end[2] * shorter];
            for a in 0..3 {
                found.spring[a][l] = end[a];
            }
            found.rubbed[l] = 0.0 - dot(rubbed, slip);
            found.sheared[l] = 0.5 * dot(end, end) / stiffness;
        }
    }
}

/// What of the springs is left as the overlaps change, and the friction coefficients.
#[inline(always)]
fn variants(tangential: &Tangential, given: &Given, approach: &Column) -> [Column; 2] {
    let mut carried = [1.0; WIDTH];
    match tangential.history {
        TangentialName::Incremental => {}
        TangentialName::UnloadingScaled => {
            for l in 0..WIDTH {
                let (overlap, before) = (given.overlap[l], given.before[l]);
                let less = (overlap / before).sqrt();
                carried[l] = if overlap < before { less } else { 1.0 };
            }
        }
        TangentialName::Secant => {
            carried = std::array::from_fn(|l| tangential.carried(given.overlap[l], given.before[l]));
        }
    }
    let mut friction = [tangential.friction; WIDTH];
    if tangential.sliding.is_some() {
        friction = std::array::from_fn(|l| {
            let slip = |a: usize| given.velocity[a][l] - given.normal[a][l] * approach[l];
            tangential.coefficient(&Vector3::new(slip(0), slip(1), slip(2)))
        });
    }
    [friction, carried]
}

impl Law {
    /// The answers to `meetings` in the middle of a step of `h` [s] (0: at an instant), added to `answers`.
    pub fn answers(&self, meetings: &[Meeting], pasts: &[Past], h: f64, answers: &mut Vec<Answer>) {
        let ((wide, rest), (wide_pasts, rest_pasts)) =
            (meetings.as_chunks::<WIDTH>(), pasts.as_chunks::<WIDTH>());
        let one_by_one = |meetings: &[Meeting], pasts: &[Past], answers: &mut Vec<Answer>| {
            answers.extend(meetings.iter().zip(pasts).map(|(meeting, past)| self.answer(meeting, past, h)));
        };
        for (meetings, pasts) in wide.iter().zip(wide_pasts) {
            if self.rolling.is_some() || pasts.iter().any(|past| past.jump != Vector3::zeros()) {
                one_by_one(meetings, pasts, answers);
                continue;
            }
            let given = Given::of(meetings, pasts);
            let mut found = Found::NONE;
            press(self, &given, &mut found);
            if let Some(tangential) = &self.tangential {
                let [friction, carried] = variants(tangential, &given, &found.approach);
                grip(tangential, &given, &friction, &carried, h, &mut found);
            }
            answers.extend((0..WIDTH).map(|l| found.of(l)));
        }
        one_by_one(rest, rest_pasts, answers);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Partner;
    use crate::settings::ContactSettings;

    fn law(more: &str) -> Law {
        let text = format!("law = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\n{more}");
        Law::new(&toml::from_str::<ContactSettings>(&text).expect("a table"), Partner::Wall)
    }

    fn bits(answer: &Answer) -> Vec<u64> {
        let Answer { load, force, moment, spring, rolled, damped, rubbed, sheared, jumped } = answer;
        let mut all = vec![load.stiffness, load.force, load.energy, *damped, *rubbed, *sheared, *jumped];
        for vector in [force, moment, spring, rolled] {
            all.extend(vector.iter());
        }
        all.iter().map(|x| x.to_bits()).collect()
    }

    /// Sticking, sliding, with a dashpot that is cut, loading and unloading, without a past, parting, at rest.
    #[test]
    fn several_at_once_are_answered_to_the_bit_as_one_alone() {
        let mut x = 3_u64;
        let mut random = || {
            x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (x >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let laws = [
            "restitution = 1.0\n",
            "restitution = 0.3\n",
            "restitution = 0.3\nfriction = 0.5\n",
            "restitution = 1.0\nfriction = 0.5\ntangential = \"incremental\"\n",
            "restitution = 0.3\nfriction = 0.5\ntangential = \"secant\"\n",
            "restitution = 0.3\nfriction = 0.5\nfriction_dynamic = 0.2\nfriction_decay = 2.0\n",
            "restitution = 0.3\nfriction = 0.5\nrolling_friction = 0.1\nrolling = \"spring\"\n",
        ];
        let mut all: Vec<Law> = laws.iter().map(|more| law(more)).collect();
        all.push(Law::new(
            &toml::from_str::<ContactSettings>(
                "law = \"linear\"\nstiffness = 1e6\npoisson = 0.2\nrestitution = 0.4\nfriction = 0.3\n",
            )
            .expect("a table"),
            Partner::Wall,
        ));
        let (mut slides, mut sticks, mut parts) = (0, 0, 0);
        for law in &all {
            let mut vector = |size: f64| Vector3::new(random(), random(), random()) * size;
            let mut meetings = Vec::new();
            let mut pasts = Vec::new();
            for k in 0..123 {
                let normal = vector(1.0).normalize();
                let overlap = 1e-4 * (1.0 + vector(0.9).x);
                let speed = [0.0, 1e-3, 0.1, 3.0][k % 4];
                meetings.push(Meeting {
                    normal,
                    overlap,
                    radius: 0.1,
                    velocity: vector(speed),
                    spin: vector(speed),
                    inertia: 0.3,
                    dashpot: law.damping.map_or(0.0, |d| d.coefficient(20.0, 3, 0.0)),
                });
                let past = Past {
                    spring: vector([1.0, 30.0, 3000.0][k % 3]),
                    moment: vector(0.1),
                    overlap: overlap * (1.0 + vector(0.3).x),
                    jump: if k % 29 == 3 { vector(1e-6) } else { Vector3::zeros() },
                };
                pasts.push(if k % 7 == 0 { Past::default() } else { past });
            }
            for h in [0.0, 1e-5] {
                let mut answers = Vec::new();
                law.answers(&meetings, &pasts, h, &mut answers);
                for ((meeting, past), found) in meetings.iter().zip(&pasts).zip(&answers) {
                    let alone = law.answer(meeting, past, h);
                    assert_eq!(
                        bits(found),
                        bits(&alone),
                        "{law:?} {meeting:?} {past:?}\n{found:?}\n{alone:?}"
                    );
                    let limit = 0.5 * alone.force.dot(&meeting.normal).abs();
                    let along = (alone.force + meeting.normal * -alone.force.dot(&meeting.normal)).norm();
                    slides += usize::from(along > 0.999 * limit && limit > 0.0);
                    sticks += usize::from(along < 0.9 * limit);
                    parts += usize::from(limit == 0.0);
                }
                assert_eq!(answers.len(), meetings.len());
            }
        }
        assert!(slides > 100 && sticks > 100 && parts > 20, "{slides} {sticks} {parts}");
    }
}
