//! A point mass.

use nalgebra::Vector3;

/// A mass at a node: inertia `m a`, kinetic energy `m v^2 / 2`, weight `m g`.
#[derive(Debug, Clone, PartialEq)]
pub struct PointMass {
    /// Node that carries it.
    pub node: usize,
    /// Mass [kg].
    pub mass: f64,
}

impl PointMass {
    /// Kinetic energy [J] at `velocity` [m/s].
    pub fn kinetic_energy(&self, velocity: &Vector3<f64>) -> f64 {
        0.5 * self.mass * velocity.norm_squared()
    }

    /// Inertial force [N] at `acceleration` [m/s2]; its tangent is the mass in each direction.
    pub fn force(&self, acceleration: &Vector3<f64>) -> Vector3<f64> {
        self.mass * acceleration
    }

    /// Potential energy [J] of its weight at displacement `u` [m] under `gravity` [m/s2]; 0 at `u = 0`.
    pub fn potential(&self, gravity: &Vector3<f64>, u: &Vector3<f64>) -> f64 {
        -self.mass * gravity.dot(u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_of_the_inertial_force_is_the_rate_of_kinetic_energy() {
        let body = PointMass { node: 0, mass: 2.5 };
        let (v, a, step) = (Vector3::new(1.0, -2.0, 0.5), Vector3::new(3.0, 4.0, -9.81), 1e-3);
        // Quadratic in time: the central difference is exact but for rounding.
        let at = |t: f64| body.kinetic_energy(&(v + t * a));
        let rate = (at(step) - at(-step)) / (2.0 * step);
        assert!((rate - body.force(&a).dot(&v)).abs() < 1e-15 * at(0.0) / step * 4.0);
    }

    #[test]
    fn weight_is_minus_the_slope_of_its_potential() {
        let body = PointMass { node: 0, mass: 2.0 };
        let gravity = Vector3::new(0.0, -3.0, -9.0);
        assert_eq!(body.potential(&gravity, &Vector3::new(5.0, 1.0, -1.0)), 2.0 * (3.0 - 9.0));
    }
}
