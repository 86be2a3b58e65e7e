//! Rolling resistance between rocks and in heaps of spheres, contact by contact: a moment against the relative angular velocity
//! `w`, limited by `mu_r R* F_n`. That of a rock on surfaces: [`super::resistance`].
//!
//! - constant (type A): the limit itself against `w`, and never more than would halve `w` within the
//!   step (that would stop it, `I w / h`, makes the scheme's predicted rate swing on for ever). A ball on
//!   a flat is braked with `5/7 g mu_r`.
//! - spring (type C): `dM = -k_r w dt` with `k_r = 2.25 k_n (mu_r R*)^2`, and below the limit a dashpot
//!   `2 g_r sqrt(I k_r)`; both together stay below it. It holds a ball at rest on a slope up to `tan = mu_r`. Half increments and
//!   the scaling on unloading are those of the tangential spring, for the same reasons.
//!
//! The whole relative spin is resisted, about the normal too. Shapes resolved by clusters need little
//! of it.
//!
//! Source: Ai, Chen, Rotter, Ooi (2011), Powder Technology 206, 269: types A and C.

use crate::law::contact_point::{ContactPoint, History};
use crate::law::normal::Load;
use crate::law::settings::RollingName;
use crate::law::tangential::left_on_unloading;
use nalgebra::Vector3;

/// `k_r / (k_n (mu_r R*)^2)`.
pub const STIFFNESS: f64 = 2.25;

/// Rolling resistance of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// Which.
    pub kind: RollingName,
    /// Limit of the moment over radius and normal force.
    pub friction: f64,
    /// Damping ratio of the rolling spring.
    pub damping: f64,
    /// The power of the overlap with which the normal stiffness grows.
    pub stiffening: f64,
}

/// Moment of one contact in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RollingMoment {
    /// On the first body in the middle of the step [N m].
    pub moment: Vector3<f64>,
    /// Of the spring alone at the step's end [N m].
    pub spring: Vector3<f64>,
    /// Energy of the spring at the step's end [J].
    pub energy: f64,
}

impl Rolling {
    /// Moment in a step of `h` [s] with elastic `load`, pressed with `pressed` [N].
    pub fn resist(
        &self,
        load: &Load,
        pressed: f64,
        point: &ContactPoint,
        history: &History,
        h: f64,
    ) -> RollingMoment {
        let arm = self.friction * point.radius;
        let limit = arm * pressed;
        match self.kind {
            // A rut is that of a surface, and none here.
            RollingName::Constant | RollingName::Rut => RollingMoment {
                moment: against(&point.spin, limit, point.inertia, h),
                spring: Vector3::zeros(),
                energy: 0.0,
            },
            RollingName::Spring => {
                let stiffness = STIFFNESS * load.stiffness * arm * arm;
                let share = left_on_unloading(point.overlap, history.overlap, self.stiffening);
                let dashpot = 2.0 * self.damping * (point.inertia * stiffness).sqrt();
                let spun = Spun { spin: point.spin, stiffness, dashpot, h };
                let (moment, spring) = stretch(history.moment * share, &spun, limit);
                RollingMoment { moment, spring, energy: 0.5 * spring.norm_squared() / stiffness }
            }
        }
    }
}

/// Stretching of a rolling spring in a step.
pub(super) struct Spun {
    /// Angular velocity in its middle [rad/s].
    pub spin: Vector3<f64>,
    /// Stiffness [N m] and dashpot [N m s].
    pub stiffness: f64,
    pub dashpot: f64,
    /// Length [s].
    pub h: f64,
}

/// Moment in the middle of a step and of the spring at its end [N m], of a spring with the moment `spring` at its start; all stay
/// below `limit`.
pub(super) fn stretch(spring: Vector3<f64>, spun: &Spun, limit: f64) -> (Vector3<f64>, Vector3<f64>) {
    let half = spun.spin * (0.5 * spun.h * spun.stiffness);
    let elastic = cut(spring - half, limit);
    let moment = elastic + within(limit, &elastic, spun.spin * -spun.dashpot);
    (moment, cut(elastic - half, limit))
}

/// A moment, shortened to `limit` [N m].
fn cut(moment: Vector3<f64>, limit: f64) -> Vector3<f64> {
    let size = moment.norm();
    if size > limit { moment * (limit / size) } else { moment }
}

/// `viscous`, shortened until `elastic + viscous` is not above `limit`; `elastic` alone is not.
fn within(limit: f64, elastic: &Vector3<f64>, viscous: Vector3<f64>) -> Vector3<f64> {
    let limit2 = limit * limit;
    let square = viscous.norm_squared();
    // A spring at its limit, and rounding above it.
    if (elastic + viscous).norm_squared() <= limit2 || square == 0.0 {
        return viscous;
    }
    let along = elastic.dot(&viscous);
    let room = (limit2 - elastic.norm_squared()).max(0.0);
    let share = ((along * along + square * room).sqrt() - along) / square;
    viscous * share.clamp(0.0, 1.0)
}

/// Moment of the size `limit` [N m] against `spin` [rad/s], at most what would halve that of an `inertia` [kg m2] within `h` [s].
pub(super) fn against(spin: &Vector3<f64>, limit: f64, inertia: f64, h: f64) -> Vector3<f64> {
    let rate = spin.norm();
    let stop = if h > 0.0 { 0.5 * inertia * rate / h } else { f64::INFINITY };
    spin * if rate > 0.0 { -limit.min(stop) / rate } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(spin: Vector3<f64>) -> ContactPoint {
        ContactPoint {
            normal: -Vector3::z(),
            overlap: 1e-3,
            radius: 0.1,
            velocity: Vector3::zeros(),
            spin,
            inertia: 2.0,
            dashpot: 0.0,
            jump: Vector3::zeros(),
        }
    }

    const LOAD: Load = Load { stiffness: 1e6, force: 100.0, energy: 0.0 };

    #[test]
    fn a_constant_moment_is_the_limit_and_never_turns_the_spin_round() {
        let law = Rolling { kind: RollingName::Constant, friction: 0.05, damping: 0.0, stiffening: 0.5 };
        let history = History::default();
        let fast = law.resist(&LOAD, 100.0, &point(Vector3::y() * 3.0), &history, 1e-4);
        assert!((fast.moment + Vector3::y() * 0.5).norm() < 1e-15);
        // 2 kg m2 at 1e-6 rad/s lose half of it in 1e-4 s under 0.01 N m.
        let slow = law.resist(&LOAD, 100.0, &point(Vector3::y() * 1e-6), &history, 1e-4);
        assert!((slow.moment + Vector3::y() * 0.01).norm() < 1e-15);
        assert_eq!(
            law.resist(&LOAD, 100.0, &point(Vector3::zeros()), &history, 1e-4).moment,
            Vector3::zeros()
        );
    }

    #[test]
    fn below_its_limit_the_rolling_spring_gives_back_what_it_took() {
        let law = Rolling { kind: RollingName::Spring, friction: 0.05, damping: 0.0, stiffening: 0.5 };
        let (spin, h) = (Vector3::new(0.01, -0.02, 0.0), 1e-4);
        let mut history = History { overlap: 1e-3, ..History::default() };
        let mut work = 0.0;
        for _ in 0..10 {
            let turn = law.resist(&LOAD, 100.0, &point(spin), &history, h);
            work -= turn.moment.dot(&spin) * h;
            history.moment = turn.spring;
            // Ten sums of numbers of the size of the energy.
            assert!((work - turn.energy).abs() < 20.0 * f64::EPSILON * work);
        }
        for size in [0.3, 0.499, 0.501, 5.0] {
            history.moment = Vector3::x() * size;
            let turn = law.resist(&LOAD, 100.0, &point(spin), &history, h);
            assert!(turn.moment.norm() <= 0.5 * (1.0 + 1e-15) && turn.spring.norm() <= 0.5 * (1.0 + 1e-15));
        }
    }
}
