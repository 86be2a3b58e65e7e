//! A node on the ground: it is pushed off along the normal, and held back by friction.
//!
//! With `p = radius - distance` the depth by which the sphere around the node is in the ground, and `c = 2 g sqrt(k m)`:
//!
//! ```text
//! N = max(0, k p + c dp/dt)        it comes off with e times the speed for g that [`damping_ratio`] says
//! T = k s + c ds/dt, |T| <= mu N   s: way along the ground since it stuck, less what has slipped (Coulomb; return mapping)
//! ```
//!
//! The dashpots bring a node to rest: a law that dissipates on the way in alone (Walton and Braun) lets it swing for ever once it is
//! as deep as its first swing took it, and where that takes it off the ground at every swing, friction lets go as often. In
//! statics nothing has a speed, and springs and friction are all there is.
//!
//! Rates are differences to the history, over the time since then. Depth counts from 0 there, so that the force has no jump where
//! the node comes down.
//!
//! Sources: Schwager and Poeschel (2007), Granular Matter 9, 465; return mapping: Wriggers (2006), Computational Contact
//! Mechanics, 5.2.

use super::{Answer, Element, Energy, Pace};
use crate::element::Slack;
use crate::ground::{ClosestPoint, Surface};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Numbers of its history.
const HISTORY: usize = 12;

/// A swing on the ground has some 35 steps, and its energy, which goes with their square, is off by 0.3 %. Elements are stiffer by so much
/// that no net has shorter steps for that.
const RESOLVED: f64 = 25.0;

/// A node that may lie on the ground.
#[derive(Debug, Clone)]
pub struct GroundContact {
    /// The node.
    pub node: [usize; 1],
    /// The ground.
    pub surface: Arc<Surface>,
    /// The node as modelled, in the coordinates of the surface [m].
    pub place: Vector3<f64>,
    /// Distance that the node keeps from the ground [m].
    pub radius: f64,
    /// Stiffness along the normal, and along the ground where it sticks [N/m].
    pub stiffness: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Speed after a bounce over that before, above 0 and at most 1.
    pub restitution: f64,
    /// `g`, which [`damping_ratio`] makes of that.
    pub ratio: f64,
    /// `m`, the mass of the node [kg].
    pub mass: f64,
}

/// Damping ratio of a linear spring and dashpot that push and do not pull, with the restitution `e` in (0, 1].
pub fn damping_ratio(e: f64) -> f64 {
    let restitution = |g: f64| {
        let exponent = if g < 1.0 {
            let w = (1.0 - g * g).sqrt();
            g / w * (2.0 * g * w).atan2(2.0 * g * g - 1.0)
        } else if g > 1.0 {
            let w = (g * g - 1.0).sqrt();
            2.0 * g / w * w.asinh()
        } else {
            2.0
        };
        (-exponent).exp()
    };
    // It falls with the ratio, below 1 / g^2 from g = 1 on.
    let (mut low, mut high) = (0.0, if e < 1.0 { 1.0 + 1.0 / e.sqrt() } else { 0.0 });
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if restitution(middle) > e { low = middle } else { high = middle }
    }
    high
}

/// Its history.
#[derive(Debug, Clone, Copy, Default)]
struct ContactMemory {
    /// Displacement [m].
    at: Vector3<f64>,
    /// Elongation of the spring of friction [m].
    drawn: Vector3<f64>,
    /// Force of friction on the structure's side: what holds it there [N].
    pull: Vector3<f64>,
    /// Normal force [N]; 0: it did not push.
    normal: f64,
    /// Depth in the ground; 0: it did not touch [m].
    depth: f64,
    /// Dissipated energy [J].
    dissipated: f64,
}

impl ContactMemory {
    fn of(history: &[f64]) -> Self {
        let three = |at: usize| Vector3::new(history[at], history[at + 1], history[at + 2]);
        let [normal, depth, dissipated] = three(9).into();
        Self { at: three(0), drawn: three(3), pull: three(6), normal, depth, dissipated }
    }

    fn write(&self, to: &mut [f64]) {
        let Self { at, drawn, pull, normal, depth, dissipated } = *self;
        let last = Vector3::new(normal, depth, dissipated);
        for (to, from) in to.chunks_exact_mut(3).zip([at, drawn, pull, last]) {
            to.copy_from_slice(from.as_slice());
        }
    }
}

/// A node that touches.
struct GroundTouch {
    foot: ClosestPoint,
    /// `dN/dp` [N/m].
    slope: f64,
    /// `dT/ds` [N/m].
    holding: f64,
    /// Where friction's force would be 0, to here; and the part of that along the ground [m].
    from_anchor: Vector3<f64>,
    way: Vector3<f64>,
    slips: bool,
    sticks: bool,
    memory: ContactMemory,
}

impl GroundContact {
    /// Stiffness of a spring alone whose critical explicit step resolves this contact [N/m]: stable with its dashpots, and short enough
    /// that the energy of a swing is right at each time.
    pub fn stiffest(&self) -> f64 {
        let stable = ((1.0 + self.ratio * self.ratio).sqrt() + self.ratio).powi(2);
        self.stiffness * stable.max(RESOLVED)
    }

    /// Addition of its dashpots to a stiffness [N/m].
    fn viscous(&self, pace: Pace) -> f64 {
        2.0 * self.ratio * (self.stiffness * self.mass).sqrt() * pace.rate
    }

    /// Depth in the ground as modelled [m], 0 or less where it does not; `None` where there is no ground.
    pub fn depth(&self) -> Option<f64> {
        self.surface.foot(&self.place).map(|foot| self.radius - foot.distance)
    }

    /// Force of the ground on the node at `u` at rest, from `history` [N].
    pub fn force(&self, u: &[f64], history: &[f64]) -> Vector3<f64> {
        let touch = self.touch(u, &ContactMemory::of(history), Pace::default());
        touch.map_or_else(Vector3::zeros, |touch| touch.foot.normal * touch.memory.normal - touch.memory.pull)
    }

    /// Its contact at `u`; `None` where it does not touch.
    fn touch(&self, u: &[f64], before: &ContactMemory, pace: Pace) -> Option<GroundTouch> {
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
        let k = self.stiffness;
        let viscous = self.viscous(pace);
        let normal = (k * depth + viscous * (depth - before.depth)).max(0.0);
        // How far it went down in truth: where it came from above the ground, further than its depth.
        let down = if before.depth > 0.0 { depth - before.depth } else { foot.normal.dot(&(before.at - u)) };
        let lost = self.damped(before, (depth, normal), down, pace);
        let memory = ContactMemory {
            at: u,
            depth,
            normal,
            dissipated: before.dissipated + lost,
            ..ContactMemory::default()
        };
        let holding = k + viscous;
        let mut touch = GroundTouch {
            slope: if normal > 0.0 { holding } else { 0.0 },
            holding,
            from_anchor: Vector3::zeros(),
            way: Vector3::zeros(),
            slips: false,
            sticks: before.normal > 0.0 && normal > 0.0 && self.friction > 0.0,
            memory,
            foot,
        };
        if !touch.sticks {
            // Nothing holds it yet, or any more; the spring of friction gives up what it had.
            touch.memory.dissipated += self.stored_by(&before.drawn);
            return Some(touch);
        }
        let along = |v: Vector3<f64>| v - foot.normal * foot.normal.dot(&v);
        touch.from_anchor = k / holding * before.drawn + u - before.at;
        touch.way = along(touch.from_anchor);
        let mut pull = holding * touch.way;
        let (limit, trial) = (self.friction * normal, pull.norm());
        touch.slips = trial > limit;
        if touch.slips {
            pull *= limit / trial;
        }
        let drawn = along((pull + viscous * before.drawn) / holding);
        let drawn_since = drawn - along(before.drawn);
        let slipped = along(u - before.at) - drawn_since;
        touch.memory.dissipated += if pace.by_ends {
            let viscous = before.pull - k * before.drawn + pull - k * drawn;
            0.5 * (viscous.dot(&drawn_since) + (before.pull + pull).dot(&slipped))
        } else {
            // The limit has changed over the step, or the force has come down to it.
            let first = (self.friction * before.normal).min((k * before.drawn.norm()).max(limit));
            let slip = if touch.slips { (trial - limit) / holding } else { 0.0 };
            viscous * drawn_since.norm_squared() + 0.5 * (first + limit) * slip
        };
        (touch.memory.pull, touch.memory.drawn) = (pull, drawn);
        Some(touch)
    }

    /// Energy that the dashpot of the normal has taken since the history [J], where the node went `down` so far [m].
    fn damped(&self, before: &ContactMemory, (depth, normal): (f64, f64), down: f64, pace: Pace) -> f64 {
        let (k, inside) = (self.stiffness, depth - before.depth);
        if pace.by_ends {
            return 0.5 * (before.normal - k * before.depth + normal - k * depth) * down;
        }
        let elastic = 0.5 * k * (before.depth + depth);
        ((elastic + self.viscous(pace) * inside).max(0.0) - elastic) * inside
    }

    /// Energy of friction's spring that is drawn out so far [J].
    fn stored_by(&self, drawn: &Vector3<f64>) -> f64 {
        0.5 * self.stiffness * drawn.norm_squared()
    }

    /// Memory where it does not touch, at `u`.
    fn apart(&self, u: &[f64], before: &ContactMemory, pace: Pace) -> ContactMemory {
        let lost = self.damped(before, (0.0, 0.0), -before.depth, pace) + self.stored_by(&before.drawn);
        let at = Vector3::new(u[0], u[1], u[2]);
        ContactMemory { at, dissipated: before.dissipated + lost, ..ContactMemory::default() }
    }

    /// Derivative of the force that is needed to hold it.
    fn tangent(&self, touch: &GroundTouch, symmetric: bool) -> Matrix3<f64> {
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
            return k + touch.holding * way;
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

    fn add_to(&self, pace: Pace, u: &[f64], history: &[f64], answer: &mut Answer) {
        let before = ContactMemory::of(history);
        let touch = self.touch(u, &before, pace);
        match &touch {
            Some(touch) => {
                let force = touch.memory.pull - touch.foot.normal * touch.memory.normal;
                answer.force.copy_from_slice(force.as_slice());
                touch.memory.write(answer.history);
            }
            None => self.apart(u, &before, pace).write(answer.history),
        }
        let Some(to) = &mut answer.tangent else { return };
        let k = match (answer.slack, &touch) {
            // Wherever it is, it may be on the ground a step later. In a hollow the normal force resists as well.
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
        let before = ContactMemory::of(history);
        let pace = Pace::default();
        let now =
            self.touch(u, &before, pace).map_or_else(|| self.apart(u, &before, pace), |touch| touch.memory);
        let stored = 0.5 * self.stiffness * now.depth * now.depth + self.stored_by(&now.drawn);
        // Where the history is of the middle of an explicit step, the dashpots act as there to its end.
        let viscous = before.pull - self.stiffness * before.drawn;
        let pending = (before.normal - self.stiffness * before.depth) * (now.depth - before.depth)
            + viscous.dot(&(now.drawn - before.drawn));
        Energy { stored, dissipated: now.dissipated + pending }
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
        let ratio = damping_ratio(restitution);
        GroundContact {
            node: [0],
            surface,
            place,
            radius,
            stiffness: 1e5,
            friction,
            restitution,
            ratio,
            mass: 2.0,
        }
    }

    /// Force, tangent and history at `u`.
    fn response_at(
        contact: &GroundContact,
        pace: Pace,
        u: &Vector3<f64>,
        history: &[f64],
    ) -> (Vector3<f64>, Vec<f64>, Vec<f64>) {
        let (mut force, mut tangent, mut after) = (vec![0.0; 3], vec![0.0; 9], history.to_vec());
        let mut answer = Answer {
            force: &mut force,
            tangent: Some(&mut tangent),
            slack: Slack::Exact,
            history: &mut after,
            tension: 0.0,
        };
        contact.respond(pace, u.as_slice(), history, &mut answer);
        (Vector3::from_column_slice(&force), tangent, after)
    }

    fn response(contact: &GroundContact, u: &Vector3<f64>, history: &[f64]) -> (Vector3<f64>, Vec<f64>) {
        let (force, _, after) = response_at(contact, Pace::default(), u, history);
        (force, after)
    }

    #[test]
    fn the_tangent_of_a_moving_node_has_its_dashpots() {
        let (mut noise, contact, mut held) = (random(5), contact(0.5, 0.4), [0, 0]);
        let pace = Pace { rate: 300.0, by_ends: false };
        let start = Vector3::new(0.0, 0.0, -0.03);
        for _ in 0..60 {
            let (_, _, history) = response_at(&contact, pace, &start, &contact.start_history());
            let first = start + 2e-3 * Vector3::new(noise(), noise(), noise());
            let (_, _, history) = response_at(&contact, pace, &first, &history);
            let u = first + Vector3::new(0.04 * noise(), 0.04 * noise(), 4e-3 * noise());
            let (_, k, _) = response_at(&contact, pace, &u, &history);
            let touch = contact.touch(u.as_slice(), &ContactMemory::of(&history), pace).expect("touches");
            held[usize::from(touch.slips)] += usize::from(touch.sticks);
            for j in 0..3 {
                let mut step = Vector3::zeros();
                step[j] = 1e-8;
                let at = |sign: f64| response_at(&contact, pace, &(u + sign * step), &history).0;
                let slope = (at(1.0) - at(-1.0)) / 2e-8;
                let off = (0..3).map(|i| (slope[i] - k[3 * i + j]).abs()).fold(0.0, f64::max);
                assert!(off < 1e-5 * contact.stiffest(), "{off}");
            }
        }
        assert!(held[0] > 5 && held[1] > 5, "{held:?}");
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
        // Down, to and fro along the ground, and off again within 1 s, by the midpoint rule: work against stored and dissipated energy.
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
                let pace = |part: f64| Pace { rate: steps as f64 / part, by_ends: false };
                let force = response_at(&contact, pace(0.5), &(0.5 * (u + next)), &history).0;
                work += force.dot(&(next - u));
                // The midpoint of the step in which it touches may have no force yet; what is stored at its end is no more than this.
                let stiffness = 0.5 * contact.stiffness + contact.viscous(pace(1.0));
                let touch = stiffness * (next - u).norm_squared();
                history = response_at(&contact, pace(1.0), &next, &history).2;
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
    fn a_bounce_leaves_the_share_of_the_speed_that_is_asked_for_and_its_dissipation_is_the_rest() {
        for e in [1.0, 0.6, 0.25, 0.05] {
            let contact = contact(0.0, e);
            let n = contact.surface.foot(&contact.place).expect("ground").normal;
            // A frictionless mass, straight down, by the explicit step.
            let h = 2e-4 / (contact.stiffness / contact.mass).sqrt();
            let (mut u, mut v, mut history) = (0.01 * n, -1.0 * n, contact.start_history());
            let pace = Pace { rate: 1.0 / h, by_ends: true };
            while u.dot(&n) <= 0.0101 || v.dot(&n) < 0.0 {
                let (middle, mut force, mut after) = (u + 0.5 * h * v, vec![0.0; 3], history.clone());
                let mut answer = Answer {
                    force: &mut force,
                    tangent: None,
                    slack: Slack::Exact,
                    history: &mut after,
                    tension: 0.0,
                };
                contact.respond(pace, middle.as_slice(), &history, &mut answer);
                history = after;
                v -= h / contact.mass * Vector3::from_column_slice(&force);
                u = middle + 0.5 * h * v;
            }
            let speed = v.norm();
            assert!((speed - e).abs() < 2e-3, "{speed} for {e}");
            let lost = contact.energy(u.as_slice(), &history).dissipated;
            let expected = 0.5 * contact.mass * (1.0 - speed * speed);
            assert!((lost - expected).abs() < 1e-4 * contact.mass, "{lost} J, {expected} J");
        }
    }
}
