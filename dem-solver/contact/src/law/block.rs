//! The law applied to several contacts at once: what [`Law::respond`] does to one, with each quantity in a column.
//!
//! Roots and quotients take most of the time of a contact; a processor forms four at once as fast as one. The formulas are those
//! of one contact ([`Law::normal_force`], [`friction_force`]), inlined into each lane, so that the bytes are the same (a test
//! compares them). What is rare is done one by one: rolling resistance, a jump between windows, the contacts that are left over.

use crate::law::Law;
use crate::law::contact_point::{ContactPoint, History, Response};
use crate::law::normal::Load;
use crate::law::tangential::{FrictionForce, Slip, Tangential, dot, friction_force, into_plane, slip_rate};
use crate::settings::TangentialName;
use nalgebra::Vector3;
use toolkit::wide;

/// Contacts that are computed together.
pub const WIDTH: usize = 8;

/// A number of each of them.
type Column = [f64; WIDTH];

/// Fewest contacts of a block for which all of it is computed at once.
pub const WORTH: usize = 3;

/// Inputs.
#[derive(Debug, Clone, Default)]
struct Given {
    normal: [Column; 3],
    velocity: [Column; 3],
    spin: [Column; 3],
    overlap: Column,
    radius: Column,
    dashpot: Column,
    inertia: Column,
    spring: [Column; 3],
    moment: [Column; 3],
    jump: [Column; 3],
    /// Overlap in the step before.
    before: Column,
}

/// Results.
#[derive(Debug, Clone, Default)]
struct Found {
    stiffness: Column,
    elastic: Column,
    energy: Column,
    normal_force: Column,
    approach: Column,
    damping_power: Column,
    force: [Column; 3],
    spring: [Column; 3],
    friction_power: Column,
    tangential_energy: Column,
}

/// Up to [`WIDTH`] contacts under one law.
#[derive(Debug, Clone, Default)]
pub struct Block {
    /// Number of the law.
    pub law: u16,
    /// Contacts in it.
    pub count: usize,
    /// True if the law has rolling resistance; without it what belongs to that is neither written nor read.
    rolls: bool,
    /// True if one of them has moved between two windows; likewise.
    jumps: bool,
    given: Given,
    found: Found,
    /// Whether they were computed one by one, and what that has given in place of `found`.
    scalar: bool,
    alone: [Response; WIDTH],
}

const ZERO: Column = [0.0; WIDTH];

impl Block {
    /// Begin anew under `law`, which has this number.
    pub fn begin(&mut self, number: u16, law: &Law) {
        (self.law, self.count, self.rolls, self.jumps) = (number, 0, law.rolling.is_some(), false);
    }

    /// True if there is no room left.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count == WIDTH
    }

    /// Add a contact; there must be room.
    #[inline(always)]
    pub fn push(&mut self, point: &ContactPoint, history: &History) {
        let (l, to) = (self.count % WIDTH, &mut self.given);
        for a in 0..3 {
            to.normal[a][l] = point.normal[a];
            to.velocity[a][l] = point.velocity[a];
            to.spring[a][l] = history.spring[a];
        }
        to.overlap[l] = point.overlap;
        to.radius[l] = point.radius;
        to.dashpot[l] = point.dashpot;
        to.before[l] = history.overlap;
        self.count += 1;
        if self.rolls {
            for a in 0..3 {
                to.spin[a][l] = point.spin[a];
                to.moment[a][l] = history.moment[a];
            }
            to.inertia[l] = point.inertia;
        }
        if point.jump != Vector3::zeros() {
            if !self.jumps {
                (to.jump, self.jumps) = ([ZERO; 3], true);
            }
            for a in 0..3 {
                to.jump[a][l] = point.jump[a];
            }
        }
    }

    /// Contact number `l`.
    #[inline(always)]
    fn contact(&self, l: usize) -> (ContactPoint, History) {
        let (given, zero) = (&self.given, Vector3::zeros());
        let vector = |v: &[Column; 3]| Vector3::new(v[0][l], v[1][l], v[2][l]);
        let point = ContactPoint {
            jump: if self.jumps { vector(&given.jump) } else { zero },
            normal: vector(&given.normal),
            overlap: given.overlap[l],
            radius: given.radius[l],
            velocity: vector(&given.velocity),
            spin: if self.rolls { vector(&given.spin) } else { zero },
            inertia: if self.rolls { given.inertia[l] } else { 0.0 },
            dashpot: given.dashpot[l],
        };
        let history = History {
            spring: vector(&given.spring),
            moment: if self.rolls { vector(&given.moment) } else { zero },
            overlap: given.before[l],
        };
        (point, history)
    }

    /// The response of contact number `l`.
    #[inline(always)]
    pub fn response(&self, l: usize) -> Response {
        if self.scalar {
            return self.alone[l];
        }
        let (found, zero) = (&self.found, Vector3::zeros());
        let vector = |v: &[Column; 3]| Vector3::new(v[0][l], v[1][l], v[2][l]);
        let load = Load { stiffness: found.stiffness[l], force: found.elastic[l], energy: found.energy[l] };
        Response {
            load,
            force: vector(&found.force),
            moment: zero,
            spring: vector(&found.spring),
            rolled: zero,
            damping_power: found.damping_power[l],
            friction_power: found.friction_power[l],
            tangential_energy: found.tangential_energy[l],
            jump_energy: 0.0,
        }
    }

    /// Compute the responses in the middle of a step of `h` [s] (0: at an instant).
    pub fn compute(&mut self, law: &Law, h: f64) {
        self.scalar = self.count < WORTH || self.jumps || self.rolls;
        if self.scalar {
            for l in 0..self.count {
                let (point, history) = self.contact(l);
                self.alone[l] = law.respond(&point, &history, h);
            }
            return;
        }
        let (given, found) = (&self.given, &mut self.found);
        normal_forces(law, given, found);
        match &law.tangential {
            Some(tangential) => {
                let [friction, carried] = variants(tangential, given, &found.approach);
                friction_forces(tangential.stiffness_ratio, given, &friction, &carried, h, found);
            }
            None => (found.spring, found.friction_power, found.tangential_energy) = ([ZERO; 3], ZERO, ZERO),
        }
    }
}

wide! {
    /// The elastic load, and the normal force with the dashpot.
    fn normal_forces(law: &Law, given: &Given, found: &mut Found) {
        [found.stiffness, found.elastic, found.energy] = law.normal.loads(&given.radius, &given.overlap);
        for l in 0..WIDTH {
            let n = [given.normal[0][l], given.normal[1][l], given.normal[2][l]];
            let v = [given.velocity[0][l], given.velocity[1][l], given.velocity[2][l]];
            let approach = dot(v, n);
            let load =
                Load { stiffness: found.stiffness[l], force: found.elastic[l], energy: found.energy[l] };
            let normal_force = law.normal_force(&load, given.dashpot[l], approach);
            found.approach[l] = approach;
            found.normal_force[l] = normal_force;
            found.damping_power[l] = (normal_force - load.force) * approach;
            found.force[0][l] = n[0] * -normal_force;
            found.force[1][l] = n[1] * -normal_force;
            found.force[2][l] = n[2] * -normal_force;
        }
    }
}

wide! {
    /// The tangential springs and their dashpots, within the limits `friction` times the normal force; `carried`: what of the
    /// springs is left.
    fn friction_forces(
        ratio: f64,
        given: &Given,
        friction: &Column,
        carried: &Column,
        h: f64,
        found: &mut Found,
    ) {
        for l in 0..WIDTH {
            let n = [given.normal[0][l], given.normal[1][l], given.normal[2][l]];
            let v = [given.velocity[0][l], given.velocity[1][l], given.velocity[2][l]];
            let flat = into_plane([given.spring[0][l], given.spring[1][l], given.spring[2][l]], n);
            let spring = [flat[0] * carried[l], flat[1] * carried[l], flat[2] * carried[l]];
            let slip = Slip {
                rate: slip_rate(v, n, found.approach[l]),
                stiffness: ratio * found.stiffness[l],
                dashpot: given.dashpot[l],
                limit: friction[l] * found.normal_force[l],
                h,
            };
            let FrictionForce { force, spring, power, energy } = friction_force(spring, &slip);
            found.force[0][l] += force[0];
            found.force[1][l] += force[1];
            found.force[2][l] += force[2];
            found.spring[0][l] = spring[0];
            found.spring[1][l] = spring[1];
            found.spring[2][l] = spring[2];
            found.friction_power[l] = power;
            found.tangential_energy[l] = energy;
        }
    }
}

/// What of the springs is left as the overlaps change, and the friction coefficients.
#[inline(always)]
fn variants(tangential: &Tangential, given: &Given, approach: &Column) -> [Column; 2] {
    let mut carried = [1.0; WIDTH];
    match tangential.history {
        TangentialName::Incremental => {}
        TangentialName::UnloadingScaled if tangential.stiffening <= 1.0 => {
            let overlaps = given.overlap.iter().zip(&given.before);
            for (carried, (overlap, before)) in carried.iter_mut().zip(overlaps) {
                let less = (overlap / before).sqrt();
                *carried = if overlap < before { less } else { 1.0 };
            }
        }
        TangentialName::UnloadingScaled | TangentialName::Secant => {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::PartnerKind;
    use crate::settings::ContactSettings;

    fn law(more: &str) -> Law {
        let text = format!("law = \"hertz_mindlin\"\nyoung = 1e8\npoisson = 0.2\n{more}");
        Law::new(
            &ContactSettings::of("", text.parse().expect("TOML")).expect("a table"),
            PartnerKind::Surface,
        )
    }

    fn bits(response: &Response) -> Vec<u64> {
        let Response {
            load,
            force,
            moment,
            spring,
            rolled,
            damping_power,
            friction_power,
            tangential_energy,
            jump_energy,
        } = response;
        let mut all = vec![
            load.stiffness,
            load.force,
            load.energy,
            *damping_power,
            *friction_power,
            *tangential_energy,
            *jump_energy,
        ];
        for vector in [force, moment, spring, rolled] {
            all.extend(vector.iter());
        }
        all.iter().map(|x| x.to_bits()).collect()
    }

    /// Sticking, sliding, with a dashpot that is cut, loading and unloading, without a history, parting, at rest.
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
            &ContactSettings::of(
                "",
                "law = \"linear\"\nstiffness = 1e6\npoisson = 0.2\nrestitution = 0.4\nfriction = 0.3\n"
                    .parse()
                    .expect("TOML"),
            )
            .expect("a table"),
            PartnerKind::Surface,
        ));
        let (mut slides, mut sticks, mut parts) = (0, 0, 0);
        for law in &all {
            let mut vector = |size: f64| Vector3::new(random(), random(), random()) * size;
            let mut points = Vec::new();
            let mut histories = Vec::new();
            for k in 0..123 {
                let normal = vector(1.0).normalize();
                let overlap = 1e-4 * (1.0 + vector(0.9).x);
                let speed = [0.0, 1e-3, 0.1, 3.0][k % 4];
                points.push(ContactPoint {
                    normal,
                    overlap,
                    radius: 0.1,
                    velocity: vector(speed),
                    spin: vector(speed),
                    inertia: 0.3,
                    dashpot: law.damping.map_or(0.0, |d| d.coefficient(20.0, 3, 0.0)),
                    jump: if k % 29 == 3 && k % 7 != 0 { vector(1e-6) } else { Vector3::zeros() },
                });
                let history = History {
                    spring: vector([1.0, 30.0, 3000.0][k % 3]),
                    moment: vector(0.1),
                    overlap: overlap * (1.0 + vector(0.3).x),
                };
                histories.push(if k % 7 == 0 { History::default() } else { history });
            }
            for h in [0.0, 1e-5] {
                let mut found = Vec::new();
                let mut block = Block::default();
                for (points, histories) in points.chunks(WIDTH).zip(histories.chunks(WIDTH)) {
                    block.begin(0, law);
                    points.iter().zip(histories).for_each(|(point, history)| block.push(point, history));
                    block.compute(law, h);
                    found.extend((0..points.len()).map(|l| block.response(l)));
                }
                for ((point, history), together) in points.iter().zip(&histories).zip(&found) {
                    let alone = law.respond(point, history, h);
                    assert_eq!(
                        bits(together),
                        bits(&alone),
                        "{law:?} {point:?} {history:?}\n{together:?}\n{alone:?}"
                    );
                    let limit = 0.5 * alone.force.dot(&point.normal).abs();
                    let along = (alone.force + point.normal * -alone.force.dot(&point.normal)).norm();
                    slides += usize::from(along > 0.999 * limit && limit > 0.0);
                    sticks += usize::from(along < 0.9 * limit);
                    parts += usize::from(limit == 0.0);
                }
                assert_eq!(found.len(), points.len());
            }
        }
        assert!(slides > 100 && sticks > 100 && parts > 20, "{slides} {sticks} {parts}");
    }
}
