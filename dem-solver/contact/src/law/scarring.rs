//! Drag of ground that a rock ploughs through while it touches: `F = C rho A v^2 / 2` against the velocity of its centre.
//!
//! A is the outline of what is below the surface, seen along it: of the ball of the rock's volume that is in by the equivalent
//! overlap D ([`crate::contact::whole_rock`]), the segment `R^2 acos(1 - D/R) - (R - D) sqrt(2 R D - D^2)`. It does not depend on
//! how finely spheres cover the rock.
//!
//! Source: Lu et al. (2019), Rock Mech. Rock Eng. 52, 2343.

use nalgebra::Vector3;

/// Drag in the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scarring {
    /// Coefficient C.
    pub drag: f64,
    /// Density of the ground [kg/m3].
    pub density: f64,
}

/// Outline of a ball of `radius` [m] below a plane that it passes by `depth` [m], seen along the plane [m2].
pub fn outline(radius: f64, depth: f64) -> f64 {
    let depth = depth.clamp(0.0, 2.0 * radius);
    let up = radius - depth;
    radius * radius * (up / radius).acos() - up * (depth * (radius + up)).sqrt()
}

impl Scarring {
    /// Force on a rock of `radius` [m] that is in by `depth` [m] and moves with `velocity` [m/s] [N].
    pub fn force(&self, radius: f64, depth: f64, velocity: &Vector3<f64>) -> Vector3<f64> {
        velocity * (-0.5 * self.drag * self.density * outline(radius, depth) * velocity.norm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn the_outline_is_the_integral_of_its_chords() {
        assert!((outline(0.4, 0.4) / (0.5 * PI * 0.16) - 1.0).abs() < 1e-14);
        assert!((outline(0.4, 0.9) / (PI * 0.16) - 1.0).abs() < 1e-14 && outline(0.4, 0.0) == 0.0);
        let (parts, depth) = (200_000, 0.13);
        let h = depth / f64::from(parts);
        let chord = |x: f64| 2.0 * (x * (0.8 - x)).sqrt();
        let sum: f64 = (0..parts).map(|k| chord(h * (f64::from(k) + 0.5)) * h).sum();
        assert!((outline(0.4, depth) / sum - 1.0).abs() < 1e-7);
    }
}
