//! Tangential spring with Coulomb slip, incremental, scaled down as the contact unloads.
//!
//! Over a step h with slip rate v_t in the middle, `k_t = k_n 2 (1 - nu) / (2 - nu)` (Mindlin, wall
//! rigid) and dashpot `c_t = 2 g sqrt(m* k_t)`:
//! - `f = b f_n - k_t v_t h/2` in the middle, `b = sqrt(d / d_old)` where the overlap shrinks, else 1;
//! - limit `mu F_n`: an elastic part beyond it is scaled to it and has no dashpot; else the dashpot is
//!   scaled until the sum is at the limit;
//! - `f_(n+1) = f - k_t v_t h/2`, within the limit.
//!
//! Two half increments make the middle force of second order; in stick, slip times force is then the
//! change of `f^2 / (2 k_t)` to rounding, so that a loss is a loss. Spin about the normal turns the
//! spring only with the tangent plane.
//!
//! Source: Thornton et al. (2013), Powder Technology 233, 30 (unloading); handbook 1.3, variant U and
//! the reference implementation's limit.

use nalgebra::Vector3;

/// Friction of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tangential {
    /// Coulomb coefficient.
    pub friction: f64,
    /// Tangential over normal stiffness.
    pub stiffness_ratio: f64,
}

/// Tangential force of one contact in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grip {
    /// Force on the rock in the middle of the step [N].
    pub force: Vector3<f64>,
    /// Force of the spring alone at the step's end [N].
    pub spring: Vector3<f64>,
    /// Energy of the spring at the step's end [J].
    pub energy: f64,
}

impl Tangential {
    /// With Poisson's ratio of the rock; the wall is rigid.
    pub fn new(friction: f64, poisson: f64) -> Self {
        Self { friction, stiffness_ratio: 2.0 * (1.0 - poisson) / (2.0 - poisson) }
    }

    /// Force in a step of `h` [s] (0: at an instant) of a contact with normal stiffness
    /// `normal_stiffness` [N/m], slip rate `slip` [m/s] and normal force `pressed` [N]. `spring` is its
    /// force from before [N], in the tangent plane and scaled; `dashpot` is `2 g sqrt(m*)`.
    #[inline]
    pub fn grip(
        &self,
        normal_stiffness: f64,
        dashpot: f64,
        spring: Vector3<f64>,
        slip: Vector3<f64>,
        pressed: f64,
        h: f64,
    ) -> Grip {
        let stiffness = self.stiffness_ratio * normal_stiffness;
        let limit = self.friction * pressed;
        let half = slip * (0.5 * h * stiffness);
        let trial = spring - half;
        let size = trial.norm();
        let (elastic, force) = if size > limit {
            let cut = trial * (limit / size);
            (cut, cut)
        } else {
            let viscous = slip * (-dashpot * stiffness.sqrt());
            (trial, trial + within(limit, &trial, viscous))
        };
        let mut end = elastic - half;
        let size = end.norm();
        if size > limit {
            end *= limit / size;
        }
        Grip { force, spring: end, energy: 0.5 * end.norm_squared() / stiffness }
    }
}

/// `viscous`, shortened until `elastic + viscous` is not above `limit`; `elastic` alone is not.
fn within(limit: f64, elastic: &Vector3<f64>, viscous: Vector3<f64>) -> Vector3<f64> {
    let limit2 = limit * limit;
    if (elastic + viscous).norm_squared() <= limit2 {
        return viscous;
    }
    let (along, square) = (elastic.dot(&viscous), viscous.norm_squared());
    let room = (limit2 - elastic.norm_squared()).max(0.0);
    let share = ((along * along + square * room).sqrt() - along) / square;
    viscous * share.clamp(0.0, 1.0)
}

/// `force` laid into the plane across `normal`. It keeps its size, unless it stood so steeply to the
/// plane (60 degrees) that its direction there would be a guess.
#[inline]
pub fn into_plane(force: &Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    let flat = force - normal * force.dot(normal);
    let (square, whole) = (flat.norm_squared(), force.norm_squared());
    if square > 0.25 * whole { flat * (whole / square).sqrt() } else { flat }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: Tangential = Tangential { friction: 0.5, stiffness_ratio: 0.8 };

    #[test]
    fn in_stick_the_work_of_the_slip_is_the_energy_of_the_spring() {
        let slip = Vector3::new(0.3, -0.1, 0.0);
        let (mut spring, mut work) = (Vector3::new(0.0, 2.0, 0.0), 0.0);
        let before = 0.5 * spring.norm_squared() / (0.8 * 1e5);
        for _ in 0..10 {
            let grip = LAW.grip(1e5, 0.0, spring, slip, 1e3, 1e-4);
            work -= grip.force.dot(&slip) * 1e-4;
            spring = grip.spring;
        }
        let after = 0.5 * spring.norm_squared() / (0.8 * 1e5);
        // Ten sums of numbers as large as the energies.
        assert!((work - (after - before)).abs() < 20.0 * f64::EPSILON * after.max(before));
    }

    #[test]
    fn force_and_spring_stay_within_the_limit_and_oppose_the_slip() {
        for size in [0.0, 10.0, 49.0, 51.0, 500.0] {
            for dashpot in [0.0, 1.0, 300.0] {
                for slip in [Vector3::x(), -Vector3::x(), Vector3::y() * 0.01] {
                    let grip = LAW.grip(1e5, dashpot, Vector3::x() * size, slip, 100.0, 1e-5);
                    assert!(grip.force.norm() <= 50.0 * (1.0 + 1e-15), "{grip:?}");
                    assert!(grip.spring.norm() <= 50.0 * (1.0 + 1e-15), "{grip:?}");
                }
            }
        }
        let sliding = LAW.grip(1e5, 5.0, Vector3::zeros(), Vector3::x(), 100.0, 1.0);
        assert!((sliding.force + Vector3::x() * 50.0).norm() < 1e-13);
    }

    #[test]
    fn a_dashpot_against_the_spring_is_cut_where_the_sum_reaches_the_limit() {
        let grip = LAW.grip(1e5, 1e3, Vector3::x() * 40.0, Vector3::x(), 100.0, 1e-9);
        assert!((grip.force + Vector3::x() * 50.0).norm() < 1e-10, "{grip:?}");
    }

    #[test]
    fn laid_into_the_plane_a_force_keeps_its_size() {
        let normal = Vector3::new(1.0, 2.0, -0.5).normalize();
        let flat = into_plane(&Vector3::new(3.0, 0.1, 0.2), &normal);
        assert!(flat.dot(&normal).abs() < 1e-15);
        assert!((flat.norm() - Vector3::new(3.0_f64, 0.1, 0.2).norm()).abs() < 1e-15);
        assert_eq!(into_plane(&Vector3::zeros(), &normal), Vector3::zeros());
        assert!(into_plane(&(normal * 5.0), &normal).norm() < 1e-14);
    }
}
