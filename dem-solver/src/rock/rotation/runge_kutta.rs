//! The classical Runge-Kutta scheme on the quaternion: `q' = q w / 2` with `w = I^-1 R(q)^T L`.
//!
//! Fourth order. Energy and length of the quaternion drift, by `O(h^5)` in each step; the length is mended, the energy
//! is not.
//!
//! Source: Munjiza, Latham, John (2003), Int. J. Numer. Methods Eng. 56, 35-55; handbook 1.8, scheme C.

use super::spin;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// One step.
pub fn turn(
    q: &UnitQuaternion<f64>,
    angular_momentum: &Vector3<f64>,
    inertia: &Vector3<f64>,
    h: f64,
) -> UnitQuaternion<f64> {
    let start = q.into_inner();
    let rate = |q: &Quaternion<f64>| {
        let w = spin(&UnitQuaternion::new_normalize(*q), angular_momentum, inertia);
        q * Quaternion::from_parts(0.0, w * 0.5)
    };
    let a = rate(&start);
    let b = rate(&(start + a * (0.5 * h)));
    let c = rate(&(start + b * (0.5 * h)));
    let d = rate(&(start + c * h));
    UnitQuaternion::new_normalize(start + (a + (b + c) * 2.0 + d) * (h / 6.0))
}
