//! The Taylor series of the free motion: to rounding, over any time.
//!
//! With body-frame angular velocity `w`: `I w' = (I w) x w` and `q' = q o w / 2`. All products of the two are
//! sums of products of earlier coefficients, so that each next one costs a few multiplications. In a time in which a
//! body turns by 0.25 rad at most the terms shrink by that much each; a step of 0.01 rad needs seven. That is exact where
//! the midpoint rule (handbook 1.8, scheme A) errs by the square of the step, at less work, and a long flight
//! costs what its turns cost, not its steps.
//!
//! Source: Hairer, Norsett, Wanner (1993), Solving Ordinary Differential Equations I, section I.8.

use super::{about_axis, is_spherical, pieces, runge_kutta};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Turn below which four stages of Runge and Kutta leave less than rounding [rad]: their error is some 1/100 of its fifth power.
/// Most steps in contact are shorter, and take two thirds of the work of a series.
const SMALL: f64 = 1e-3;
/// Largest turn in one series [rad].
const TURN: f64 = 0.25;
/// Most terms: 0.25^25 is 1e-15, over its number and 8 below rounding.
const TERMS: usize = 25;

/// Orientation after `h` [s] without torque, from `q`, angular momentum [kg m2/s] along the axes of
/// space and principal moments of inertia [kg m2].
pub fn turn(
    q: &UnitQuaternion<f64>,
    angular_momentum: &Vector3<f64>,
    inertia: &Vector3<f64>,
    h: f64,
) -> UnitQuaternion<f64> {
    if *angular_momentum == Vector3::zeros() {
        return *q;
    }
    if is_spherical(inertia) {
        return about_axis(q, angular_momentum, inertia, h);
    }
    if angular_momentum.norm_squared() * h * h <= SMALL * SMALL * inertia.min().powi(2) {
        return runge_kutta::turn(q, angular_momentum, inertia, h);
    }
    let pieces = pieces(angular_momentum, inertia, h, TURN);
    (0..pieces as u64).fold(*q, |q, _| series(&q, angular_momentum, inertia, h / pieces))
}

/// One series over `h` [s].
pub(super) fn series(
    q: &UnitQuaternion<f64>,
    angular_momentum: &Vector3<f64>,
    inertia: &Vector3<f64>,
    h: f64,
) -> UnitQuaternion<f64> {
    let [a, b, c] = (*inertia).into();
    let pull = Vector3::new((b - c) / a, (c - a) / b, (a - b) / c);
    // Coefficients of the powers of the share of `h` that has passed; the rates are angles per `h`.
    let mut w = [Vector3::zeros(); TERMS];
    let mut turned = [Quaternion::identity(); TERMS];
    w[0] = q.inverse_transform_vector(angular_momentum).component_div(inertia) * h;
    let mut sum = turned[0];
    for k in 0..TERMS - 1 {
        let next = 1.0 / (k + 1) as f64;
        let (mut bent, mut real, mut imaginary) = (Vector3::zeros(), 0.0, Vector3::zeros());
        for j in 0..=k {
            let (u, v, r) = (w[j], w[k - j], turned[j]);
            bent += Vector3::new(u.y * v.z, u.z * v.x, u.x * v.y);
            let axis = r.imag();
            real -= axis.dot(&v);
            imaginary += v * r.w + axis.cross(&v);
        }
        w[k + 1] = pull.component_mul(&bent) * next;
        turned[k + 1] = Quaternion::from_parts(real, imaginary) * (0.5 * next);
        sum += turned[k + 1];
        // Two in a row: a single one may vanish.
        if turned[k].norm_squared() + turned[k + 1].norm_squared() < 1e-36 {
            break;
        }
    }
    UnitQuaternion::new_normalize(q.into_inner() * sum)
}
