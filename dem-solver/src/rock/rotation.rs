//! Free rotation, to rounding and over any time: the angular momentum in space is constant by construction, the
//! orientation follows from its Taylor series.
//!
//! With body-frame angular velocity `w`: `I w' = (I w) x w` and `q' = q o w / 2`. All products of the two are
//! sums of products of earlier coefficients, so that each next one costs a few multiplications. In a time in which a
//! body turns by 0.25 rad at most the terms shrink by that much each; a step of 0.001 rad needs five. That is exact where
//! the midpoint rule (handbook 1.8, scheme A) errs by the square of the step, at less work, and a long flight
//! costs what its turns cost, not its steps.
//!
//! Source: Hairer, Norsett, Wanner (1993), Solving Ordinary Differential Equations I, section I.8.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Largest turn in one series [rad].
const TURN: f64 = 0.25;
/// Half a turn [rad] of which four terms of sine and cosine are exact: the fifth is 0.01^8 / 40320 = 2e-21.
const SMALL: f64 = 0.01;
/// Most terms: 0.25^25 is 1e-15, over its number and 8 below rounding.
const TERMS: usize = 25;

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
        let turn = turn_by(&(angular_momentum * (h / inertia.x)));
        return UnitQuaternion::new_normalize((turn * q).into_inner());
    }
    let turn = angular_momentum.norm() / inertia.min() * h.abs();
    let pieces = (turn / TURN).ceil().max(1.0);
    (0..pieces as u64).fold(*q, |q, _| series(&q, angular_momentum, inertia, h / pieces))
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

/// One series over `h` [s].
fn series(
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

/// True if every axis is a principal axis.
pub fn is_spherical(inertia: &Vector3<f64>) -> bool {
    inertia.x == inertia.y && inertia.y == inertia.z
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// V-D11: flips about the intermediate axis; the tables have ten digits. However long the steps are.
    #[test]
    fn orientation_and_angular_velocity_are_those_of_the_tables() {
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
            for step in [0.01, 0.5, 10.0] {
                let (spin, turn, _) = tumble(step, time);
                let exact = Quaternion::new(q0, q1, q2, q3).coords;
                let off = (turn.coords * turn.coords.dot(&exact).signum() - exact).amax();
                println!("t = {time}, steps of {step}: {:.1e} {off:.1e}", (spin - Vector3::from(w)).amax());
                assert!((spin - Vector3::from(w)).amax() < 1e-9, "t = {time}, step {step}: {spin}");
                assert!(off < 1e-9, "t = {time}, step {step}: {turn}");
            }
        }
    }

    /// 40 000 steps, or 3 000 series of steps as long as the run: rounding adds up to their number at most.
    #[test]
    fn energy_is_kept_to_rounding() {
        for step in [0.01, 400.0] {
            let (.., energy) = tumble(step, 400.0);
            assert!(energy < 4e4 * f64::EPSILON, "steps of {step}: {energy:.3e}");
        }
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
