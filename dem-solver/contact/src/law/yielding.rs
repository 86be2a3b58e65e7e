//! Ground that remembers how deep it was pressed: loading and unloading differ, and the energy between them is lost.
//!
//! With y the depth below the level at which the rock found the ground, Y the largest so far, f and U force and energy of the
//! first loading (`U ~ y^n`), m* the mass that the force acts on:
//! - loading, y = Y: `F = f(y)`. An impact that ended here would have begun with `u = sqrt(2 U / m*)`, and is to give back
//!   `e(u)^2 U`;
//! - below, y < Y: `F = k2 (y - y0)`, 0 below y0, with `k2 = n/2 (f(Y) / Y) / e^2` and `y0 = Y (1 - 2 e^2 / n)`: the stored energy
//!   `k2 (y - y0)^2 / 2` at Y is `e^2 U`. Of a linear loading `k2 = k1 / e^2`. The restitution `e(v)` is met at any speed v;
//! - the rest, `(1 - e^2) U(Y)`, is lost as Y grows;
//! - where the force has gone to 0 the dent stays below the rock until it has left the ground, or has moved on by the dent's half
//!   width `sqrt(2 R y0)`: then it stands on new ground at the depth where it is;
//! - a rock that comes back before that swings about its seat. There a dashpot `2 g sqrt(m* k2)` with
//!   `g = -ln e / sqrt(pi^2 + ln^2 e)` takes from each swing what the impact would have: else it would never rest.
//!
//! On other ground the force stays as it is, and no energy is made (see [`PlasticIndentation::pass_to`]).
//!
//! Source: Walton and Braun (1986), J. Rheol. 30, 949, for the two branches; e(v) as prescribed, docs/ground.md.

use super::Law;
use super::normal::Load;
use super::normal::ground::Rule;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Least restitution that is computed: below it a quarter of a per cent of the energy comes back, and steps get short.
pub const LEAST: f64 = 0.05;

/// What comes back of an impact on ground that gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yielding {
    /// Restitution of a slow impact.
    pub restitution: f64,
    /// Dependence on the impact.
    pub rule: Rule,
}

impl Yielding {
    /// Restitution of an impact with `speed` [m/s] that goes in by `depth` [m].
    pub fn restitution(&self, speed: f64, depth: f64) -> f64 {
        let e = self.restitution
            * match self.rule {
                Rule::Constant => 1.0,
                Rule::PfeifferBowen(k) => 1.0 / (1.0 + (speed / k).powi(2)),
                Rule::Bourrier(k) => k / (k + speed),
                Rule::Walton(s) => 1.0 / (1.0 + s * depth).sqrt(),
            };
        e.max(LEAST)
    }

    /// In words, with numbers.
    pub fn describe(&self) -> String {
        let rule = match self.rule {
            Rule::Constant => String::new(),
            Rule::PfeifferBowen(k) => format!(" / (1 + (v / {k} m/s)^2)"),
            Rule::Bourrier(k) => format!(" * {k} / ({k} + v)"),
            Rule::Walton(s) => format!(" / sqrt(1 + {s} depth)"),
        };
        format!(", restitution {}{rule}", self.restitution)
    }
}

/// Stiffness of the unloading over force over depth, of a loading whose energy goes with depth^`n`.
pub fn stiffening(n: f64, restitution: f64) -> f64 {
    0.5 * n / (restitution * restitution)
}

/// Damping ratio of swings about the seat.
pub fn seat_damping(restitution: f64) -> f64 {
    let log = restitution.ln();
    -log / (PI * PI + log * log).sqrt()
}

/// What the ground below a rock remembers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PlasticIndentation {
    /// Number of its law.
    pub law: u16,
    /// Depth at which the rock found the ground [m]: 0 at its surface.
    pub level: f64,
    /// Largest depth below that level [m]; 0: nothing is remembered.
    pub deepest: f64,
    /// Restitution of the impact that ends there.
    pub restitution: f64,
    /// True if the rock has come back before it was free.
    pub seated: bool,
    /// Travel since the force went to 0 [m].
    pub travel: f64,
}

/// A rock as it is pressed into ground.
#[derive(Debug, Clone, Copy)]
pub struct Pressing {
    /// Equivalent overlap [m].
    pub overlap: f64,
    /// Its rate [m/s].
    pub rate: f64,
    /// Travel of the rock along the ground in the step [m].
    pub travel: f64,
    /// Mass that the force acts on [kg].
    pub mass: f64,
}

/// What a rock feels of ground that gives way.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Felt {
    /// Stiffness of the first loading there [N/m], force [N] and energy that may come back [J].
    pub load: Load,
    /// Energy lost since the step before [J].
    pub lost: f64,
    /// `2 g sqrt(k2)` of the dashpot about the seat [N^(1/2) m^(-1/2)].
    pub dashpot: f64,
    /// Its g.
    pub ratio: f64,
}

impl PlasticIndentation {
    /// Stiffness [N/m] and depth without force [m] of the unloading.
    fn unloading(&self, law: &Law, radius: f64) -> (f64, f64) {
        let n = law.normal.powers().overlap;
        let force = law.normal.load(radius, self.deepest).force;
        let square = self.restitution * self.restitution;
        (stiffening(n, self.restitution) * force / self.deepest, self.deepest * (1.0 - 2.0 * square / n))
    }

    /// Energy that was lost down to the largest depth [J].
    fn lost(&self, law: &Law, radius: f64) -> f64 {
        if self.deepest == 0.0 {
            return 0.0;
        }
        (1.0 - self.restitution * self.restitution) * law.normal.load(radius, self.deepest).energy
    }

    /// Energy that may come back at `overlap` [m] of a rock of `radius` [m], without a step.
    pub fn stored(&self, law: &Law, radius: f64, overlap: f64) -> f64 {
        let depth = overlap - self.level;
        if depth <= 0.0 {
            return 0.0;
        }
        if depth >= self.deepest {
            // What of it is lost is known once the step is taken.
            return law.normal.load(radius, depth).energy - self.lost(law, radius);
        }
        let (stiffness, free) = self.unloading(law, radius);
        0.5 * stiffness * (depth - free).max(0.0).powi(2)
    }

    /// Be pressed by a rock of `radius` [m].
    pub fn press(&mut self, law: &Law, radius: f64, rock: &Pressing) -> Felt {
        let Pressing { overlap, rate, travel, mass } = *rock;
        let yielding = law.yielding.as_ref().expect("asked of ground that gives way");
        let depth = overlap - self.level;
        if depth <= 0.0 {
            *self = Self { law: self.law, level: overlap, ..Self::default() };
            return Felt::default();
        }
        let first = law.normal.load(radius, depth.max(self.deepest));
        if depth >= self.deepest {
            let before = self.lost(law, radius);
            let e = yielding.restitution((2.0 * first.energy / mass).sqrt(), depth);
            // What is lost stays lost, though the mass may change.
            let kept = (e * e * first.energy).min(first.energy - before);
            *self = Self {
                deepest: depth,
                restitution: (kept / first.energy).sqrt().max(LEAST),
                seated: false,
                travel: 0.0,
                ..*self
            };
            let load = Load { energy: kept, ..first };
            return Felt { load, lost: first.energy - kept - before, ..Felt::default() };
        }
        let (stiffness, free) = self.unloading(law, radius);
        if depth <= free {
            self.travel += travel;
            if self.travel * self.travel > 2.0 * radius * (self.level + free) {
                *self = Self { law: self.law, level: overlap, ..Self::default() };
            }
            return Felt::default();
        }
        self.travel = 0.0;
        self.seated |= rate > 0.0;
        let force = stiffness * (depth - free);
        let load = Load { stiffness: first.stiffness, force, energy: 0.5 * force * (depth - free) };
        let ratio = if self.seated { seat_damping(self.restitution) } else { 0.0 };
        Felt { load, lost: 0.0, dashpot: 2.0 * ratio * stiffness.sqrt(), ratio }
    }

    /// Become the dent in other ground, of law number `number`: it is pressed by the same force at `overlap` [m], and holds no
    /// more energy. Returns the energy lost [J].
    pub fn pass_to(&mut self, number: u16, [from, to]: [&Law; 2], radius: f64, overlap: f64) -> f64 {
        let depth = overlap - self.level;
        let held = self.stored(from, radius, overlap);
        if held <= 0.0 || self.deepest == 0.0 {
            let level = if self.deepest > 0.0 { overlap } else { self.level };
            *self = Self { law: number, level, ..Self::default() };
            return 0.0;
        }
        let (stiffness, free) = self.unloading(from, radius);
        let loading = depth >= self.deepest;
        let force = if loading { from.normal.load(radius, depth).force } else { stiffness * (depth - free) };
        let unit = to.normal.load(radius, 1.0);
        let deepest = (force / unit.force).powf(1.0 / (to.normal.powers().overlap - 1.0));
        let whole = to.normal.load(radius, deepest).energy;
        let most = to.yielding.as_ref().map_or(1.0, |y| y.restitution);
        let restitution = (held / whole).sqrt().min(most);
        if restitution < LEAST {
            *self = Self { law: number, level: overlap, ..Self::default() };
            return held;
        }
        *self = Self { law: number, level: overlap - deepest, deepest, restitution, ..Self::default() };
        held - restitution * restitution * whole
    }
}

#[cfg(test)]
mod tests;
