//! Free rotation of a rock: one step of each scheme that a scene may name in `[dem] rotation`.
//!
//! A step of the solver is drift, kick, drift ([`crate::integrator::step`]): torque acts in the kick alone, on the angular
//! momentum in space, and in the drifts the body turns freely. A scheme here only says how it turns: from the orientation, the
//! constant angular momentum and the moments of inertia to the orientation `h` later. Whatever the scheme, the
//! angular momentum is kept to the last bit, and with torque the whole is of second order, as the kick is.
//!
//! - [`exact`]: the Taylor series of the free motion, to rounding; the default
//! - [`midpoint`]: implicit midpoint rule on the rotation group, second order
//! - [`splitting`]: turns about the principal axes one after the other, second order
//! - [`runge_kutta`]: the classical four stages on the quaternion, fourth order
//!
//! Which to take is measured (`cargo run --release -p dem-solver --example rotation -- launch/scenes/slope-edge.toml`). A
//! slab of three moments at 10 rad/s about its middle axis, 10 s in turns of 1e-4 s (of 1e-5 s), and the scene `slope-edge`
//! (1 000 spheres, 362 000 of 364 000 steps in flight):
//!
//! | scheme | one turn [us] | orientation [rad] | energy | `slope-edge` to its end [s] |
//! |---|---|---|---|---|
//! | exact | 0.37 (0.13) | 1e-12 | 2e-14 | 0.029 |
//! | midpoint | 0.38 (0.32) | 3.6e-6 | 4e-9 | 0.28 |
//! | splitting | 0.21 (0.21) | 1.6e-6 | 7e-8 | 0.15 |
//! | Runge-Kutta | 0.16 (0.16) | 1e-12 | 7e-15 | 0.14 |
//!
//! In contact the two turns of a step are 5 to 7 % of its instructions. A flight is crossed in one go by the exact scheme
//! alone, the others step through it. It is the default.
//!
//! *To add one*: a file with a function of the same signature, a line in each `match` below, a name in
//! [`Rotation`].

pub mod exact;
pub mod midpoint;
pub mod runge_kutta;
pub mod splitting;

use crate::settings::Rotation;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Largest turn in one step of a scheme that is not exact [rad]; a longer one is cut into equal parts. Beyond it the
/// midpoint's iteration would not contract, and none of them would mean anything.
const TURN: f64 = 0.5;
/// Most pieces: a tenth of a second of work.
const MOST: f64 = 1e5;
/// Half a turn [rad] of which four terms of sine and cosine are exact: the fifth is 0.01^8 / 40320 = 2e-21.
const SMALL: f64 = 0.01;

impl Rotation {
    /// Orientation after `h` [s] without torque, from `q`, angular momentum [kg m2/s] along the axes of
    /// space and principal moments of inertia [kg m2].
    pub fn turn(
        self,
        q: &UnitQuaternion<f64>,
        angular_momentum: &Vector3<f64>,
        inertia: &Vector3<f64>,
        h: f64,
    ) -> UnitQuaternion<f64> {
        let one = match self {
            Self::Midpoint => midpoint::turn,
            Self::Splitting => splitting::turn,
            Self::RungeKutta => runge_kutta::turn,
            Self::Exact => return exact::turn(q, angular_momentum, inertia, h),
        };
        if *angular_momentum == Vector3::zeros() {
            return *q;
        }
        if is_spherical(inertia) {
            return about_axis(q, angular_momentum, inertia, h);
        }
        let pieces = pieces(angular_momentum, inertia, h, TURN);
        (0..pieces as u64).fold(*q, |q, _| one(&q, angular_momentum, inertia, h / pieces))
    }

    /// The same over a flight of `time` [s] that a run without shortcuts takes in `steps` steps, of two drifts each: what those
    /// give, but for rounding. In one go where the scheme is exact.
    pub fn fly(
        self,
        q: &UnitQuaternion<f64>,
        angular_momentum: &Vector3<f64>,
        inertia: &Vector3<f64>,
        time: f64,
        steps: usize,
    ) -> UnitQuaternion<f64> {
        if self == Self::Exact || is_spherical(inertia) || *angular_momentum == Vector3::zeros() {
            return exact::turn(q, angular_momentum, inertia, time);
        }
        let drifts = 2 * steps.max(1);
        (0..drifts).fold(*q, |q, _| self.turn(&q, angular_momentum, inertia, time / drifts as f64))
    }
}

/// True if every axis is a principal axis.
pub fn is_spherical(inertia: &Vector3<f64>) -> bool {
    inertia.x == inertia.y && inertia.y == inertia.z
}

/// Where every axis is a principal one the axis of the turn stands still: exact.
fn about_axis(
    q: &UnitQuaternion<f64>,
    angular_momentum: &Vector3<f64>,
    inertia: &Vector3<f64>,
    h: f64,
) -> UnitQuaternion<f64> {
    let turn = turn_by(&(angular_momentum * (h / inertia.x)));
    UnitQuaternion::new_normalize((turn * q).into_inner())
}

/// The turn by `angle` [rad]. Of a small one the sine and cosine of half of it follow from four terms, to rounding.
fn turn_by(angle: &Vector3<f64>) -> UnitQuaternion<f64> {
    let square = 0.25 * angle.norm_squared();
    if square > SMALL * SMALL {
        return UnitQuaternion::from_scaled_axis(*angle);
    }
    let cos = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0));
    let sin = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, angle * (0.5 * sin)))
}

/// Equal pieces of `h` [s] in which a body turns by `limit` [rad] at most. Never more than [`MOST`]: a body that
/// diverges has to end as well.
fn pieces(angular_momentum: &Vector3<f64>, inertia: &Vector3<f64>, h: f64, limit: f64) -> f64 {
    (angular_momentum.norm() / inertia.min() * h.abs() / limit).ceil().clamp(1.0, MOST)
}

/// Angular velocity in the body's own axes [rad/s].
fn spin(q: &UnitQuaternion<f64>, angular_momentum: &Vector3<f64>, inertia: &Vector3<f64>) -> Vector3<f64> {
    q.inverse_transform_vector(angular_momentum).component_div(inertia)
}

#[cfg(test)]
mod tests;
