//! Free rotation of a rock.
//!
//! A step of the solver is drift, kick, drift (`integrator::step`): torque acts in the kick alone, on the angular
//! momentum in space, and in the drifts the body turns freely: from the orientation, the constant angular momentum and the
//! moments of inertia to the orientation `h` later. The angular momentum is kept to the last bit, and with torque the whole is
//! of second order, as the kick is.
//!
//! The turn is the Taylor series of the free motion, to rounding, over any time. With body-frame angular velocity `w`:
//! `I w' = (I w) x w` and `q' = q o w / 2`. All products of the two are sums of products of earlier coefficients, so that each
//! next one costs a few multiplications. In a time in which a body turns by 0.25 rad at most the terms shrink by that much
//! each; a step of 0.01 rad needs seven. A long flight costs what its turns cost, not its steps.
//!
//! The midpoint rule, splitting, and Runge-Kutta steps of fourth order were measured against it and are gone:
//! `docs/performance.md` has the numbers.
//!
//! Source: Hairer, Norsett, Wanner (1993), Solving Ordinary Differential Equations I, section I.8.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

type Turn = UnitQuaternion<f64>;
type Vector = Vector3<f64>;

/// Most pieces: a tenth of a second of work.
const MAX_PIECES: f64 = 1e5;
/// Half a turn [rad] of which four terms of sine and cosine are exact: the fifth is 0.01^8 / 40320 = 2e-21.
const SMALL_ANGLE: f64 = 0.01;

/// Turn below which four stages of Runge and Kutta leave less than rounding [rad]: their error is some 1/100 of its fifth power.
/// Most steps in contact are shorter, and take two thirds of the work of a series.
const SHORT: f64 = 1e-3;
/// Largest turn in one series [rad].
const TURN: f64 = 0.25;
/// Most terms: 0.25^25 is 1e-15, over its number and 8 below rounding.
const TERMS: usize = 25;

/// Orientation after `h` [s] without torque, from `q`, angular momentum [kg m2/s] along the axes of
/// space and principal moments of inertia [kg m2].
pub fn turn(q: &Turn, angular_momentum: &Vector, inertia: &Vector, h: f64) -> Turn {
    if *angular_momentum == Vector::zeros() {
        return *q;
    }
    if is_spherical(inertia) {
        // The axis of the turn stands still: exact.
        let turn = turn_by(&(angular_momentum * (h / inertia.x)));
        return Turn::new_normalize((turn * q).into_inner());
    }
    if angular_momentum.norm_squared() * h * h <= SHORT * SHORT * inertia.min().powi(2) {
        return short(q, angular_momentum, inertia, h);
    }
    // Never more than so many: a body that diverges has to end as well.
    let pieces = (angular_momentum.norm() / inertia.min() * h.abs() / TURN).ceil().clamp(1.0, MAX_PIECES);
    (0..pieces as u64).fold(*q, |q, _| series(&q, angular_momentum, inertia, h / pieces))
}

/// One series over `h` [s].
fn series(q: &Turn, angular_momentum: &Vector, inertia: &Vector, h: f64) -> Turn {
    let [a, b, c] = (*inertia).into();
    let pull = Vector::new((b - c) / a, (c - a) / b, (a - b) / c);
    // Coefficients of the powers of the share of `h` that has passed; the rates are angles per `h`.
    let mut w = [Vector::zeros(); TERMS];
    let mut turned = [Quaternion::identity(); TERMS];
    w[0] = q.inverse_transform_vector(angular_momentum).component_div(inertia) * h;
    let mut sum = turned[0];
    for k in 0..TERMS - 1 {
        let next = 1.0 / (k + 1) as f64;
        let (mut bent, mut real, mut imaginary) = (Vector::zeros(), 0.0, Vector::zeros());
        for j in 0..=k {
            let (u, v, r) = (w[j], w[k - j], turned[j]);
            bent += Vector::new(u.y * v.z, u.z * v.x, u.x * v.y);
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
    Turn::new_normalize(q.into_inner() * sum)
}

/// One step of the classical Runge-Kutta scheme on the quaternion: `q' = q w / 2` with `w = I^-1 R(q)^T L`.
///
/// Source: Munjiza, Latham, John (2003), Int. J. Numer. Methods Eng. 56, 35-55.
#[inline]
fn short(q: &Turn, angular_momentum: &Vector, inertia: &Vector, h: f64) -> Turn {
    let start = q.into_inner();
    let inverse = inertia.map(|i| 1.0 / i);
    let rate = |q: &Quaternion<f64>| {
        let w = own(q, angular_momentum).component_mul(&inverse);
        q * Quaternion::from_parts(0.0, w * 0.5)
    };
    let a = rate(&start);
    let b = rate(&(start + a * (0.5 * h)));
    let c = rate(&(start + b * (0.5 * h)));
    let d = rate(&(start + c * h));
    Turn::new_normalize(start + (a + (b + c) * 2.0 + d) * (h / 6.0))
}

/// `v` along the axes of a body that is turned by `q`, whose length need not be 1: a stage leaves it.
#[inline]
fn own(q: &Quaternion<f64>, v: &Vector) -> Vector {
    let (w, u) = (q.w, q.imag());
    let (real, axis) = (w * w, u.norm_squared());
    (v * (real - axis) + u * (2.0 * u.dot(v)) - u.cross(v) * (2.0 * w)) / (real + axis)
}

/// True if every axis is a principal axis.
pub fn is_spherical(inertia: &Vector) -> bool {
    inertia.x == inertia.y && inertia.y == inertia.z
}

/// The turn by `angle` [rad]. Of a small one the sine and cosine of half of it follow from four terms, to rounding.
fn turn_by(angle: &Vector) -> Turn {
    let square = 0.25 * angle.norm_squared();
    if square > SMALL_ANGLE * SMALL_ANGLE {
        return Turn::from_scaled_axis(*angle);
    }
    let cos = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0));
    let sin = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
    Turn::new_unchecked(Quaternion::from_parts(cos, angle * (0.5 * sin)))
}

#[cfg(test)]
mod tests;
