//! Rolling resistance of a rock on surfaces: one moment for the body, however many spheres and partners it touches.
//!
//! - Limit: `mu_r R` times the sustained load, with R of the ball of the rock's volume. That load is the weight along the mean
//!   normal of the contacts. What it may do is saved up while the rock rolls, and spent with at most `mu_r R F` of the contact force F: in the
//!   mean over the hops of a rough rock the moment is that of the weight, and none acts in flight.
//! - A rock rolls while it touches, and in hops that a throw 1 % of R high (`HOP`) would take. After a longer flight it has
//!   nothing saved: an impact, whose force is hundreds of times the weight, is not braked by what the ground asks of rolling.
//! - `rolling_friction_impact` mu_i is for losses of spin in impacts: `mu_i R` times the force beyond the weight, and the share that the
//!   speed of the rim, `w R`, has in its sum with that of the centre. So it fades as the spin does, and turns nothing round.
//! - Below the limit a spring holds the rock, `k = mu_r R m g / THETA`, with a dashpot; both together stay below the limit. A ball at
//!   rest on a slope stays there up to `tan = mu_r`; on level ground it slows down with `5/7 g mu_r`, braked in full from `THETA` rad on.
//! - Of ground that a rock ploughs a rut into, `mu_r` is that of the [`Rut`] under this load.
//!
//! The whole spin is resisted, about the normal too. Type C of Ai, Chen, Rotter, Ooi (2011), Powder Technology 206, 269, with the stiffness of
//! the body in place of that of a contact.

use crate::law::rolling::{self, Spun};
use crate::law::rut::Rut;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Height of a hop over the rock's radius up to which it is part of rolling.
const HOP: f64 = 0.01;
/// Angle at which the moment is full [rad].
const THETA: f64 = 1e-3;
/// Damping ratio of the spring where the scene names none.
pub const DAMPING: f64 = 0.3;

/// Resistance of a surface to a rock that rolls on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resistance {
    /// mu_r; of a rut 0.
    pub friction: f64,
    /// mu_i.
    pub impact: f64,
    /// Damping ratio of the spring.
    pub damping: f64,
    /// The rut; `None`: the coefficient is given.
    pub rut: Option<Rut>,
}

/// What presses a rock on surfaces that resist its rolling.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RollingLoad {
    /// Sum of the normal forces, into the surfaces [N].
    pressed: Vector3<f64>,
    /// Sum of their sizes [N], and of these times mu_r and mu_i.
    sum: f64,
    rolling: f64,
    impact: f64,
    damping: f64,
    rut: Option<Rut>,
}

impl RollingLoad {
    /// True if nothing presses.
    pub fn is_none(&self) -> bool {
        self.sum == 0.0
    }

    /// Take in the normal force `pressed` [N] of a contact, into the surface.
    #[inline]
    pub fn add(&mut self, of: &Resistance, pressed: Vector3<f64>) {
        let size = pressed.norm();
        self.pressed += pressed;
        self.sum += size;
        self.rolling += of.friction * size;
        self.impact += of.impact * size;
        self.damping = self.damping.max(of.damping);
        self.rut = of.rut.or(self.rut);
    }

    /// Take in those with another partner.
    pub fn add_all(&mut self, other: &Self) {
        self.pressed += other.pressed;
        self.sum += other.sum;
        self.rolling += other.rolling;
        self.impact += other.impact;
        self.damping = self.damping.max(other.damping);
        self.rut = other.rut.or(self.rut);
    }

    /// Turn it by `rotation` to another frame.
    pub fn turn(&mut self, rotation: &nalgebra::Matrix3<f64>) {
        self.pressed = rotation * self.pressed;
    }
}

/// A rock, as its rolling is resisted.
#[derive(Debug, Clone, Copy)]
pub struct Roller {
    /// Radius of the ball of its volume [m].
    pub radius: f64,
    /// Its weight [N].
    pub weight: Vector3<f64>,
    /// Its mass [kg].
    pub mass: f64,
    /// Least moment of inertia [kg m2].
    pub inertia: f64,
    /// Speed of its centre in the middle of the step [m/s].
    pub speed: f64,
    /// Its angular velocity there [rad/s].
    pub spin: Vector3<f64>,
}

/// What a rock that rolls takes from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RollingState {
    /// Moment of the spring at the step's end [N m].
    spring: Vector3<f64>,
    /// What is saved up [N m s], and at which rate [N m].
    saved: f64,
    rate: f64,
    /// When it touched last [s].
    touched: f64,
}

impl Default for RollingState {
    fn default() -> Self {
        Self { spring: Vector3::zeros(), saved: 0.0, rate: 0.0, touched: f64::NEG_INFINITY }
    }
}

impl RollingState {
    /// Resist `rock` in a step from `start` of `h` [s]: the moment on it [N m], and the energy of the spring after it [J].
    pub fn resist(&mut self, load: &RollingLoad, rock: &Roller, start: f64, h: f64) -> (Vector3<f64>, f64) {
        let (radius, gravity) = (rock.radius, rock.weight.norm() / rock.mass);
        // Squeezed from both sides alike it has no mean normal, and no weight along it.
        let weight = rock.weight.dot(&load.pressed).max(0.0) / load.pressed.norm().max(f64::MIN_POSITIVE);
        let friction = match load.rut {
            Some(rut) => rut.arm(radius, weight) / radius,
            None => load.rolling / load.sum,
        };
        let hop = (8.0 * HOP * radius / gravity).sqrt();
        let gap = start - self.touched;
        if gap > hop || gap.is_infinite() {
            *self = Self::default();
        } else {
            self.saved += self.rate * gap;
        }
        self.rate = friction * radius * weight;
        self.saved =
            if self.rate > 0.0 { (self.saved + self.rate * h).min(self.rate * hop.max(h)) } else { 0.0 };
        self.touched = start + h;
        let limit = (friction * radius * load.sum).min(self.saved / h);
        let stiffness = friction * radius * rock.weight.norm() / THETA;
        let mut moment = Vector3::zeros();
        let mut energy = 0.0;
        if stiffness > 0.0 {
            // It rolls about the point of contact.
            let inertia = rock.inertia + rock.mass * radius * radius;
            let dashpot = 2.0 * load.damping * (inertia * stiffness).sqrt();
            let spun = Spun { spin: rock.spin, stiffness, dashpot, h };
            (moment, self.spring) = rolling::stretch(self.spring, &spun, limit);
            energy = 0.5 * self.spring.norm_squared() / stiffness;
            self.saved = (self.saved - moment.norm() * h).max(0.0);
        }
        let beyond = (1.0 - weight / load.sum).max(0.0) * load.impact * radius;
        if beyond > 0.0 {
            let rim = rock.spin.norm() * radius;
            let share = if rim > 0.0 { rim / (rim + rock.speed) } else { 0.0 };
            moment += rolling::against(&rock.spin, beyond * share, rock.inertia, h);
        }
        (moment, energy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    const LAW: Resistance = Resistance { friction: 0.1, impact: 0.0, damping: DAMPING, rut: None };
    const RADIUS: f64 = 0.5;
    const WEIGHT: f64 = 1000.0;

    fn roller(spin: f64) -> Roller {
        let mass = WEIGHT / 10.0;
        let inertia = 0.4 * mass * RADIUS * RADIUS;
        let weight = Vector3::z() * -WEIGHT;
        Roller { radius: RADIUS, weight, mass, inertia, speed: 1.0, spin: Vector3::y() * spin }
    }

    fn load(law: &Resistance, force: f64) -> RollingLoad {
        let mut load = RollingLoad::default();
        load.add(law, Vector3::z() * -force);
        load
    }

    /// What the moments of steps of `h` take from the spin, under `force(step)`; a step without force is one of flight.
    fn impulse(h: f64, steps: usize, force: impl Fn(usize) -> f64) -> f64 {
        let mut state = RollingState::default();
        let pressed = (0..steps).map(|k| (k, force(k))).filter(|(_, f)| *f > 0.0);
        let moments = pressed.map(|(k, f)| state.resist(&load(&LAW, f), &roller(10.0), k as f64 * h, h).0);
        -moments.map(|m| m.y * h).sum::<f64>()
    }

    #[test]
    fn the_moment_is_that_of_the_weight_whether_the_rock_rolls_smoothly_or_in_hops() {
        let limit = 0.1 * RADIUS * WEIGHT;
        let (h, steps) = (1e-4, 10_000);
        let smooth = impulse(h, steps, |_| WEIGHT);
        // Full from the first 1e-3 rad on: a tenth of a millisecond of spin.
        assert!((smooth / limit - 1.0).abs() < 1e-3, "{smooth}");
        // Contacts of 2 ms each 20 ms, each with ten times the weight; half a period is missing at the end.
        let hops = impulse(h, steps, |k| if k % 200 < 20 { 10.0 * WEIGHT } else { 0.0 });
        assert!((hops / limit - 1.0).abs() < 0.02, "{hops}");
        // The same each 0.25 s are impacts: 8 ms of contact in all.
        let impacts = impulse(h, steps, |k| if k % 2500 < 20 { 125.0 * WEIGHT } else { 0.0 });
        assert!((impacts / limit - 0.008).abs() < 1e-3, "{impacts}");
    }

    #[test]
    fn a_rock_squeezed_from_both_sides_alike_or_without_weight_is_not_resisted() {
        let mut squeezed = load(&LAW, WEIGHT);
        squeezed.add(&LAW, Vector3::z() * WEIGHT);
        let free = Roller { weight: Vector3::zeros(), ..roller(1.0) };
        for (load, rock) in [(squeezed, roller(1.0)), (load(&LAW, WEIGHT), free)] {
            let mut state = RollingState::default();
            for step in 0..3 {
                assert_eq!(state.resist(&load, &rock, 1e-4 * f64::from(step), 1e-4), (Vector3::zeros(), 0.0));
            }
            assert!(state.saved == 0.0, "{state:?}");
        }
    }

    #[test]
    fn losses_of_spin_in_an_impact_fade_with_the_spin_and_turn_nothing_round() {
        let law = Resistance { friction: 0.0, impact: 0.2, ..LAW };
        let press =
            |spin| RollingState::default().resist(&load(&law, 101.0 * WEIGHT), &roller(spin), 0.0, 1e-4).0.y;
        // 10 rad/s at 0.5 m against 1 m/s: 5 / 6 of 0.2 R 100 W.
        assert!((press(10.0) + 5.0 / 6.0 * 0.2 * RADIUS * 100.0 * WEIGHT).abs() < 1e-9, "{}", press(10.0));
        assert!(press(1e-3).abs() <= 1e-3 * 0.2 * RADIUS * RADIUS * 100.0 * WEIGHT);
        assert_eq!(press(0.0), 0.0);
        let mut turned = load(&law, 2.0);
        turned.turn(&Matrix3::identity());
        assert_eq!(turned, load(&law, 2.0));
    }
}
