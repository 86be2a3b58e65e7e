//! Implicit midpoint rule on the rotation group: the body turns about one axis of its own through the step, with the angular
//! velocity that it has in the middle of it,
//!
//! `w = I^-1 R(q exp(h w / 2))^T L`, `q -> q exp(h w)`.
//!
//! Second order, symmetric in time; the energy errs by `O(h^2)` and does not drift. The equation is solved by
//! insertion, which gains a factor of about `h |w| / 2` each time, to rounding: what is left would add up.
//!
//! Source: Simo and Wong (1991), Int. J. Numer. Methods Eng. 31, 19-52; handbook 1.8, scheme A.

use super::spin;
use nalgebra::{UnitQuaternion, Vector3};

/// Insertions at which it ends in any case; half a radian takes 30 to rounding.
const MOST: usize = 60;

/// One step.
pub fn turn(
    q: &UnitQuaternion<f64>,
    angular_momentum: &Vector3<f64>,
    inertia: &Vector3<f64>,
    h: f64,
) -> UnitQuaternion<f64> {
    let mut w = spin(q, angular_momentum, inertia);
    let limit = f64::EPSILON * w.norm();
    for _ in 0..MOST {
        let middle = q * UnitQuaternion::from_scaled_axis(w * (0.5 * h));
        let next = spin(&middle, angular_momentum, inertia);
        let change = (next - w).norm();
        w = next;
        if change <= limit {
            break;
        }
    }
    UnitQuaternion::new_normalize((q * UnitQuaternion::from_scaled_axis(w * h)).into_inner())
}
