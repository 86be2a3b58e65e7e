//! Free rotation by the implicit midpoint rule on the rotations: the angular momentum in space is
//! constant by construction, the energy error is of second order and does not drift.
//!
//! With body-frame angular velocity `w` and `q_m = q o exp(h w / 2)`: `w = I^-1 R(q_m)^T L`, solved
//! by repetition (it contracts by `h |w|`), then `q' = q o exp(h w)`.
//!
//! Source: handbook 1.8, scheme A.

use nalgebra::{UnitQuaternion, Vector3};

/// Repetitions after which the last value is taken; 4 or 5 are needed at `h |w| = 0.05`.
const MOST_PASSES: usize = 50;

/// Orientation after `h` [s] without torque, from `q`, angular momentum [kg m2/s] along the axes of
/// space and principal moments of inertia [kg m2].
pub fn rotate(
    q: &UnitQuaternion<f64>,
    angular_momentum: &Vector3<f64>,
    inertia: &Vector3<f64>,
    h: f64,
) -> UnitQuaternion<f64> {
    if *angular_momentum == Vector3::zeros() {
        return *q;
    }
    if is_spherical(inertia) {
        // The axis stands still: exact.
        let turn = UnitQuaternion::from_scaled_axis(angular_momentum * (h / inertia.x));
        return UnitQuaternion::new_normalize((turn * q).into_inner());
    }
    let mut w = q.inverse_transform_vector(angular_momentum).component_div(inertia);
    for _ in 0..MOST_PASSES {
        let middle = q * UnitQuaternion::from_scaled_axis(w * (0.5 * h));
        let next = middle.inverse_transform_vector(angular_momentum).component_div(inertia);
        let change = (next - w).amax();
        w = next;
        if change <= 1e-15 * w.amax() {
            break;
        }
    }
    UnitQuaternion::new_normalize((q * UnitQuaternion::from_scaled_axis(w * h)).into_inner())
}

/// True if every axis is a principal axis.
pub fn is_spherical(inertia: &Vector3<f64>) -> bool {
    inertia.x == inertia.y && inertia.y == inertia.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Quaternion;

    const INERTIA: Vector3<f64> = Vector3::new(1.0, 2.0, 3.0);
    const START: Vector3<f64> = Vector3::new(0.01, 1.0, 0.02);

    /// Angular velocity in body axes and orientation after `time`, and the largest relative error of energy.
    fn tumble(step: f64, time: f64) -> (Vector3<f64>, UnitQuaternion<f64>, f64) {
        let momentum = INERTIA.component_mul(&START);
        let energy = |w: &Vector3<f64>| 0.5 * w.dot(&INERTIA.component_mul(w));
        let mut q = UnitQuaternion::identity();
        let (mut w, mut worst) = (START, 0.0_f64);
        for _ in 0..(time / step).round() as usize {
            q = rotate(&q, &momentum, &INERTIA, step);
            w = q.inverse_transform_vector(&momentum).component_div(&INERTIA);
            worst = worst.max((energy(&w) / energy(&START) - 1.0).abs());
        }
        (w, q, worst)
    }

    /// V-D11: flips about the intermediate axis. The errors of scheme A are known to three or four
    /// digits; the table's own digits allow 1e-9.
    #[test]
    fn the_error_of_tumbling_is_that_of_the_scheme_and_of_second_order() {
        let exact = Vector3::new(-0.803_664_518_9, -0.595_166_649_9, 0.464_390_876_6);
        for (step, error) in [(0.02, 7.5e-5), (0.01, 1.885e-5), (0.005, 4.713e-6)] {
            let (w, ..) = tumble(step, 10.0);
            let seen = (w - exact).amax();
            assert!((seen / error - 1.0).abs() < 0.01, "step {step}: {seen:.4e}, known {error:.4e}");
        }
        let (.., energy) = tumble(0.01, 10.0);
        assert!((energy / 4.2e-6 - 1.0).abs() < 0.05, "{energy:.3e}");
    }

    /// V-D11: both tables, extrapolated from two steps to order four, which leaves 1e-7.
    #[test]
    fn orientation_and_angular_velocity_tend_to_the_exact_ones() {
        let table = [
            (
                10.0,
                [-0.8036645189, -0.5951666499, 0.4643908766],
                [0.1229716371, 0.2080799102, -0.4188391786, -0.8753025020],
            ),
            (
                20.0,
                [0.0846010027, -0.9964650874, 0.0524637324],
                [-0.0555622888, 0.9968157478, 0.0172940590, -0.0545170845],
            ),
            (
                40.0,
                [-0.5706208052, 0.8212745562, 0.3300040926],
                [0.9521096086, -0.2595907513, 0.1071997944, -0.1208641349],
            ),
        ];
        for (time, w, [q0, q1, q2, q3]) in table {
            let (coarse, fine) = (tumble(0.01, time), tumble(0.005, time));
            let spin = (fine.0 * 4.0 - coarse.0) / 3.0;
            assert!((spin - Vector3::from(w)).amax() < 1e-7, "t = {time}: {spin}");
            let exact = Quaternion::new(q0, q1, q2, q3).coords;
            let same_side = |q: UnitQuaternion<f64>| q.coords * q.coords.dot(&exact).signum();
            let turn = (same_side(fine.1) * 4.0 - same_side(coarse.1)) / 3.0;
            assert!((turn - exact).amax() < 1e-7, "t = {time}: {turn}");
        }
    }

    /// The energy error is bounded: ten times as long a run has no larger one.
    #[test]
    fn energy_does_not_drift() {
        let (.., short) = tumble(0.01, 40.0);
        let (.., long) = tumble(0.01, 400.0);
        assert!(long < 1.05 * short, "{long:.3e} after 400 s, {short:.3e} after 40 s");
    }

    #[test]
    fn a_body_of_equal_moments_turns_exactly_in_one_step_or_many() {
        let momentum = Vector3::new(0.3, -2.0, 0.7);
        let inertia = Vector3::repeat(5.043);
        let start = UnitQuaternion::from_euler_angles(0.2, 0.5, -1.0);
        let once = rotate(&start, &momentum, &inertia, 3.0);
        let mut many = start;
        for _ in 0..300 {
            many = rotate(&many, &momentum, &inertia, 0.01);
        }
        assert!(once.angle_to(&many) < 300.0 * f64::EPSILON);
    }
}
