//! A node on the ground: it is pushed off along the normal, and held back by friction.
//!
//! With `p = radius - distance` the depth by which the sphere around the node is in the ground:
//!
//! ```text
//! N = k p                          where it is deeper than ever since it touched
//! N = max(0, k/e^2 (p - p_0))      else, p_0 = (1 - e^2) p_max: it comes off with e times the speed (Walton and Braun)
//! T = k s,  |T| <= mu N            s: way along the ground since it stuck (Coulomb; return mapping)
//! ```
//!
//! Sources: Walton and Braun (1986), J. Rheol. 30, 949; return mapping: Wriggers (2006), Computational Contact Mechanics, 5.2.

use super::{Answer, Element, Energy};
use crate::element::Slack;
use crate::ground::{Foot, Surface};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Numbers of its history.
const HISTORY: usize = 7;

/// A node that may lie on the ground.
#[derive(Debug, Clone)]
pub struct GroundContact {
    /// The node.
    pub node: [usize; 1],
    /// The ground.
    pub surface: Arc<Surface>,
    /// The node as modelled, in the coordinates of the surface [m].
    pub place: Vector3<f64>,
    /// How far the node stays above the ground [m].
    pub radius: f64,
    /// Stiffness along the normal while it goes down, and along the ground where it sticks [N/m].
    pub stiffness: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Speed after a bounce over that before, above 0 and at most 1.
    pub restitution: f64,
}

/// What it remembers.
#[derive(Debug, Clone, Copy, Default)]
struct Memory {
    /// Displacement at which friction is without force [m].
    anchor: Vector3<f64>,
    /// Normal force [N]; 0: it did not touch.
    normal: f64,
    /// Force of friction [N].
    tangential: f64,
    /// Largest depth since it touched [m].
    deepest: f64,
    /// Dissipated energy [J].
    dissipated: f64,
}

impl Memory {
    fn of(history: &[f64]) -> Self {
        let [x, y, z, normal, tangential, deepest, dissipated] = *history else { return Self::default() };
        Self { anchor: Vector3::new(x, y, z), normal, tangential, deepest, dissipated }
    }

    fn write(&self, to: &mut [f64]) {
        let Self { anchor: a, normal, tangential, deepest, dissipated } = *self;
        to.copy_from_slice(&[a.x, a.y, a.z, normal, tangential, deepest, dissipated]);
    }
}

/// A node that touches.
struct Touch {
    foot: Foot,
    /// `dN/dp` [N/m].
    slope: f64,
    /// Way along the ground since it stuck, before it slips [m].
    way: Vector3<f64>,
    /// Displacement from the anchor [m].
    from_anchor: Vector3<f64>,
    /// Force of friction on the structure's side: what holds it there [N].
    pull: Vector3<f64>,
    slips: bool,
    sticks: bool,
    /// Energy stored now [J].
    stored: f64,
    memory: Memory,
}

impl GroundContact {
    /// Most that the stiffness can be [N/m].
    pub fn stiffest(&self) -> f64 {
        self.stiffness / (self.restitution * self.restitution)
    }

    /// How deep it lies in the ground as modelled [m], 0 or less where it does not; `None` where there is no ground.
    pub fn depth(&self) -> Option<f64> {
        self.surface.foot(&self.place).map(|foot| self.radius - foot.distance)
    }

    /// Force of the ground on the node at `u`, from `history` [N].
    pub fn force(&self, u: &[f64], history: &[f64]) -> Vector3<f64> {
        let touch = self.touch(u, &Memory::of(history));
        touch.map_or_else(Vector3::zeros, |touch| touch.foot.normal * touch.memory.normal - touch.pull)
    }

    /// What it does at `u`; `None` where it does not touch.
    fn touch(&self, u: &[f64], before: &Memory) -> Option<Touch> {
        let u = Vector3::new(u[0], u[1], u[2]);
        let at = self.place + u;
        if !self.surface.may_reach(&at, self.radius) {
            return None;
        }
        let foot = self.surface.foot(&at)?;
        let depth = self.radius - foot.distance;
        if depth <= 0.0 {
            return None;
        }
        let (share, stiffest) = (self.restitution * self.restitution, self.stiffest());
        let lost = 0.5 * self.stiffness * (1.0 - share);
        let mut memory = *before;
        let slope = if depth >= before.deepest {
            memory.deepest = depth;
            memory.normal = self.stiffness * depth;
            memory.dissipated += lost * (depth * depth - before.deepest * before.deepest);
            self.stiffness
        } else {
            memory.normal = stiffest * (depth - (1.0 - share) * before.deepest).max(0.0);
            if memory.normal > 0.0 { stiffest } else { 0.0 }
        };
        let sticks = before.normal > 0.0 && memory.normal > 0.0 && self.friction > 0.0;
        if !sticks {
            // Nothing holds it yet, or any more; the spring of friction gives up what it had.
            memory.dissipated += self.let_go(before);
            memory.anchor = u;
        }
        let from_anchor = u - memory.anchor;
        let way = from_anchor - foot.normal * foot.normal.dot(&from_anchor);
        let limit = self.friction * memory.normal;
        let (trial, mut held) = (self.stiffness * way.norm(), way);
        let slips = trial > limit;
        if slips {
            held = way * (limit / trial);
            memory.anchor = u - held;
            // The limit has changed over the step, or the force has come down to it.
            let first = (self.friction * before.normal).min(before.tangential.max(limit));
            memory.dissipated += 0.5 * (first + limit) * (trial - limit) / self.stiffness;
        }
        memory.tangential = trial.min(limit);
        let stored =
            0.5 * memory.normal * memory.normal / stiffest + 0.5 * self.stiffness * held.norm_squared();
        Some(Touch {
            foot,
            slope,
            way,
            from_anchor,
            pull: self.stiffness * held,
            slips,
            sticks,
            stored,
            memory,
        })
    }

    /// Energy that friction's spring loses at once [J].
    fn let_go(&self, before: &Memory) -> f64 {
        0.5 * before.tangential * before.tangential / self.stiffness
    }

    /// Memory where it does not touch.
    fn apart(&self, before: &Memory) -> Memory {
        Memory { dissipated: before.dissipated + self.let_go(before), ..Memory::default() }
    }

    /// Derivative of the force that is needed to hold it.
    fn tangent(&self, touch: &Touch, symmetric: bool) -> Matrix3<f64> {
        let (n, curvature) = (&touch.foot.normal, &touch.foot.curvature);
        let mut k = touch.slope * n * n.transpose() - touch.memory.normal * curvature;
        if !touch.sticks {
            return k;
        }
        let across = curvature * touch.from_anchor;
        let way = Matrix3::identity()
            - n * n.transpose()
            - n.dot(&touch.from_anchor) * curvature
            - n * across.transpose();
        if !touch.slips {
            return k + self.stiffness * way;
        }
        let (length, limit) = (touch.way.norm(), self.friction * touch.memory.normal);
        let along = touch.way / length;
        k += (limit / length) * (way - along * (along.transpose() * way));
        if !symmetric {
            k -= self.friction * touch.slope * along * n.transpose();
        }
        k
    }
}

impl Element for GroundContact {
    fn nodes(&self) -> &[usize] {
        &self.node
    }

    fn start_history(&self) -> Vec<f64> {
        vec![0.0; HISTORY]
    }

    fn add_to(&self, u: &[f64], history: &[f64], answer: &mut Answer) {
        let before = Memory::of(history);
        let touch = self.touch(u, &before);
        match &touch {
            Some(touch) => {
                let force = touch.pull - touch.foot.normal * touch.memory.normal;
                answer.force.copy_from_slice(force.as_slice());
                touch.memory.write(answer.history);
            }
            None => self.apart(&before).write(answer.history),
        }
        let Some(to) = &mut answer.tangent else { return };
        let k = match (answer.slack, &touch) {
            // Wherever it is, it may be on the ground a step later, and spring back from it. In a hollow the normal force resists as well.
            (Slack::Taut, touch) => {
                let hollow = touch.as_ref().map_or(0.0, |t| t.memory.normal * t.foot.curvature.norm());
                Matrix3::from_diagonal_element(self.stiffest() + hollow)
            }
            (_, None) => Matrix3::zeros(),
            // That a slipping node is held back by more as it goes down has no energy: the symmetric part of that alone would
            // take stiffness away, and statics, which has no inertia, would not get on.
            (slack, Some(touch)) => self.tangent(touch, matches!(slack, Slack::Regularised(_))),
        };
        for row in 0..3 {
            for column in 0..3 {
                to[3 * row + column] = k[(row, column)];
            }
        }
    }

    fn energy(&self, u: &[f64], history: &[f64]) -> Energy {
        let before = Memory::of(history);
        match self.touch(u, &before) {
            Some(touch) => Energy { stored: touch.stored, dissipated: touch.memory.dissipated },
            None => Energy { stored: 0.0, dissipated: self.apart(&before).dissipated },
        }
    }

    fn lump(&self, _mass: &mut [f64], _inertia: &mut [f64]) {}

    fn coarseness(&self) -> f64 {
        // Rounding to the nearest number is wrong by half a bit.
        0.5 * self.stiffness * (self.place.norm() + self.surface.cell())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::checks::{Case, random};
    use crate::read::heights::Heights;

    /// A hilly ground of 4 m by 4 m.
    fn hills() -> Arc<Surface> {
        let mut text = "ncols 17\nnrows 17\nxllcenter 0\nyllcenter 0\ncellsize 0.25\n".to_owned();
        for k in 0..17 * 17 {
            let (x, y) = (0.25 * (k % 17) as f64, 4.0 - 0.25 * (k / 17) as f64);
            text += &format!("{:?} ", 0.5 * (1.3 * x).sin() + 0.4 * (0.9 * y + 0.5 * x).cos());
        }
        let heights = Heights::parse("g.asc", &text).expect("a grid");
        Arc::new(Surface::new(&heights, [0.0; 2], [4.0; 2]))
    }

    fn contact(friction: f64, restitution: f64) -> GroundContact {
        let (surface, radius) = (hills(), 0.02);
        let xy = Vector3::new(-0.1, 0.3, 0.0);
        let place = xy + Vector3::z() * (surface.height(&xy).expect("ground") + radius);
        GroundContact { node: [0], surface, place, radius, stiffness: 1e5, friction, restitution }
    }

    fn response(contact: &GroundContact, u: &Vector3<f64>, history: &[f64]) -> (Vector3<f64>, Vec<f64>) {
        let (mut force, mut after) = (vec![0.0; 3], history.to_vec());
        let mut answer = Answer {
            force: &mut force,
            tangent: None,
            slack: Slack::Exact,
            history: &mut after,
            tension: 0.0,
        };
        contact.respond(u.as_slice(), history, &mut answer);
        (Vector3::from_column_slice(&force), after)
    }

    #[test]
    fn the_tangent_is_the_slope_of_the_force_wherever_it_sticks_slips_or_comes_off() {
        let mut noise = random(3);
        for (friction, restitution) in [(0.0, 1.0), (0.4, 1.0), (0.4, 0.5), (0.0, 0.3)] {
            let contact = contact(friction, restitution);
            let places = [Vector3::zeros()];
            let mut pressed = 0;
            for _ in 0..60 {
                // Down by some centimetres, then elsewhere by some millimetres.
                let first = Vector3::new(0.05 * noise(), 0.05 * noise(), -0.03 + 0.02 * noise());
                let (_, history) = response(&contact, &first, &contact.start_history());
                let then = first + 0.01 * Vector3::new(noise(), noise(), noise());
                let (force, _) = response(&contact, &then, &history);
                pressed += usize::from(force.norm() > 0.0);
                // The force of friction is not the slope of its energy; of an elastic smooth ground the force is.
                let mut case = Case::new(&contact, &places, then.as_slice()).with_history(&history);
                case.conservative = friction == 0.0;
                case.derivatives();
            }
            assert!(pressed > 30, "{pressed}");
        }
    }

    #[test]
    fn what_goes_in_and_does_not_come_back_is_what_it_dissipates() {
        // Down, to and fro along the ground, and off again, in small steps: work against stored and dissipated energy.
        for (friction, restitution) in [(0.3, 1.0), (0.3, 0.5), (0.0, 0.5)] {
            let contact = contact(friction, restitution);
            let steps = 40_000;
            let way = |k: usize| {
                let t = k as f64 / steps as f64;
                let along = 0.1 * (9.0 * t).sin();
                let depth =
                    0.06 * (std::f64::consts::PI * (2.2 * t).min(1.0)).sin() * (1.0 + 0.2 * (20.0 * t).cos());
                let (x, y) = (along, 0.4 * along);
                let ground =
                    contact.surface.height(&(contact.place + Vector3::new(x, y, 0.0))).expect("ground");
                // It begins above the ground: a sphere that touches a slope below its middle is in it.
                let above = 0.02 * (1.0 - 20.0 * t).max(0.0);
                Vector3::new(x, y, ground + contact.radius - contact.place.z - depth + above + 0.01 * t)
            };
            let (mut u, mut history) = (way(0), contact.start_history());
            let (mut work, mut most, mut last) = (0.0, 0.0_f64, 0.0);
            for k in 1..=steps {
                let next = way(k);
                let (force, _) = response(&contact, &(0.5 * (u + next)), &history);
                work += force.dot(&(next - u));
                // The midpoint of the step in which it touches may have no force yet; what is stored at its end is no more than this.
                let touch = 0.5 * contact.stiffness * (next - u).norm_squared();
                history = response(&contact, &next, &history).1;
                u = next;
                let energy = contact.energy(u.as_slice(), &history);
                assert!(energy.dissipated >= last, "dissipation is not given back");
                last = energy.dissipated;
                most = most.max(energy.stored + energy.dissipated);
                let off = work - energy.stored - energy.dissipated;
                assert!(off.abs() <= 2e-3 * most + touch, "{off} of {most} J at {k}");
            }
            let end = contact.energy(u.as_slice(), &history);
            assert!(end.stored == 0.0 && end.dissipated > 0.05 * most, "{end:?} {most}");
        }
    }

    #[test]
    fn a_bounce_gives_back_the_square_of_the_restitution() {
        for e in [1.0, 0.6, 0.25] {
            let contact = contact(0.0, e);
            let down = |depth: f64| {
                let foot = contact.surface.foot(&contact.place).expect("ground");
                foot.normal * (contact.radius - depth - foot.distance)
            };
            let (depth, steps) = (0.01, 20_000);
            let (mut history, mut given, mut back) = (contact.start_history(), 0.0, 0.0);
            for k in 0..2 * steps {
                let at = |k: usize| down(depth * (1.0 - (k as f64 / steps as f64 - 1.0).abs()));
                let (from, to) = (at(k), at(k + 1));
                let work = response(&contact, &(0.5 * (from + to)), &history).0.dot(&(to - from));
                if k < steps {
                    given += work
                } else {
                    back -= work
                }
                history = response(&contact, &to, &history).1;
            }
            // Steps across the point where it comes off: some 1 / steps.
            assert!((back / given - e * e).abs() < 1e-3, "{back} of {given} J, {}", e * e);
            assert!((given / (0.5 * contact.stiffness * depth * depth) - 1.0).abs() < 1e-3);
        }
    }
}
