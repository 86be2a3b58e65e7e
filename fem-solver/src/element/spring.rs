//! A grounded spring: one stiffness for each direction, without force where it is modelled.

use nalgebra::{Matrix3, Vector3};

/// A spring between a node and the ground.
///
/// `W = sum k_i u_i^2 / 2`, `f_i = k_i u_i`, `K = diag(k)`. Its foot belongs to the supports: the
/// ground pushes the structure with `-f`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// Node that it holds.
    pub node: usize,
    /// Stiffness in x, y and z [N/m].
    pub stiffness: Vector3<f64>,
}

impl Spring {
    /// Stored energy [J] at displacement `u` [m].
    pub fn energy(&self, u: &Vector3<f64>) -> f64 {
        0.5 * self.force(u).dot(u)
    }

    /// Internal force [N]: what must be applied to hold the node at `u` [m].
    pub fn force(&self, u: &Vector3<f64>) -> Vector3<f64> {
        self.stiffness.component_mul(u)
    }

    /// Tangent [N/m].
    pub fn tangent(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.stiffness)
    }

    /// Critical step [s] of central differences for a node of `mass` [kg] on this spring alone.
    pub fn critical_step(&self, mass: f64) -> f64 {
        2.0 * (mass / self.stiffness.max()).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_is_the_slope_of_the_energy_and_the_tangent_that_of_the_force() {
        let spring = Spring { node: 0, stiffness: Vector3::new(2e5, 0.0, 7e3) };
        let u = Vector3::new(0.1, -0.2, 0.3);
        let step = 1e-4;
        for i in 0..3 {
            let mut e = Vector3::zeros();
            e[i] = step;
            // The energy is quadratic: the central difference is exact but for rounding, eps W / step.
            let slope = (spring.energy(&(u + e)) - spring.energy(&(u - e))) / (2.0 * step);
            let rounding = 1e-15 * spring.energy(&u) / step;
            assert!((slope - spring.force(&u)[i]).abs() <= rounding, "{slope} in direction {i}");
            let change = (spring.force(&(u + e)) - spring.force(&(u - e))) / (2.0 * step);
            assert!((change - spring.tangent().column(i)).norm() <= 1e-15 * spring.force(&u).norm() / step);
        }
    }

    #[test]
    fn the_critical_step_is_two_over_the_frequency() {
        let spring = Spring { node: 0, stiffness: Vector3::new(0.0, 0.0, 400.0) };
        assert_eq!(spring.critical_step(4.0), 0.2);
    }
}
