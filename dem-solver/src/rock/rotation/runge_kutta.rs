//! The classical Runge-Kutta scheme on the quaternion: `q' = q w / 2` with `w = I^-1 R(q)^T L`.
//!
//! Fourth order. Energy and length of the quaternion drift, by `O(h^5)` in each step; the length is mended, the energy
//! is not.
//!
//! Source: Munjiza, Latham, John (2003), Int. J. Numer. Methods Eng. 56, 35-55; handbook 1.8, scheme C.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// One step.
#[inline]
pub fn turn(
    q: &UnitQuaternion<f64>,
    angular_momentum: &Vector3<f64>,
    inertia: &Vector3<f64>,
    h: f64,
) -> UnitQuaternion<f64> {
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
    UnitQuaternion::new_normalize(start + (a + (b + c) * 2.0 + d) * (h / 6.0))
}

/// `v` along the axes of a body that is turned by `q`, whose length need not be 1: a stage leaves it.
#[inline]
fn own(q: &Quaternion<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    let (w, u) = (q.w, q.imag());
    let (real, axis) = (w * w, u.norm_squared());
    (v * (real - axis) + u * (2.0 * u.dot(v)) - u.cross(v) * (2.0 * w)) / (real + axis)
}
