//! Splitting of the kinetic energy into those of the three principal axes, each of which turns the body about that axis at
//! a constant rate: half a step about the third, half about the second, one about the first, and back.
//!
//! Second order, symmetric in time and symplectic: the energy errs by `O(h^2)` and does not drift. No equation to
//! solve, and no angle has to be small.
//!
//! Source: Dullweber, Leimkuhler, McLachlan (1997), J. Chem. Phys. 107, 5840-5851; handbook 1.8, scheme B.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// One step.
pub fn turn(
    q: &UnitQuaternion<f64>,
    angular_momentum: &Vector3<f64>,
    inertia: &Vector3<f64>,
    h: f64,
) -> UnitQuaternion<f64> {
    let mut own = q.inverse_transform_vector(angular_momentum);
    let mut q = q.into_inner();
    for (axis, share) in [(2, 0.5), (1, 0.5), (0, 1.0), (1, 0.5), (2, 0.5)] {
        let (sin, cos) = (0.5 * share * h * own[axis] / inertia[axis]).sin_cos();
        let mut along = Vector3::zeros();
        along[axis] = sin;
        q *= Quaternion::from_parts(cos, along);
        // The angular momentum stands still in space, and so turns back in the body.
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let (double_sin, double_cos) = (2.0 * sin * cos, 1.0 - 2.0 * sin * sin);
        (own[j], own[k]) =
            (double_cos * own[j] + double_sin * own[k], double_cos * own[k] - double_sin * own[j]);
    }
    UnitQuaternion::new_normalize(q)
}
