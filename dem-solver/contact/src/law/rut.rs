//! Rolling resistance of ground that a rock ploughs a rut into: the moment of the ground's push about the rock's centre.
//!
//! Plastic ground does not come back behind a rock that rolls on, so that the front half of the circle of contact carries it alone:
//! `pi a^2 p / 2 = F` gives `a = sqrt(2 F / (pi p))`. The push goes through the centroid of that half circle, `4 a / (3 pi)` ahead,
//! and its moment is `M = 4 a F / (3 pi)`: a rolling friction of `4 a / (3 pi R)`, which grows with the root of the force. A ball that
//! rolls on level ground slows down with `5/7 g 4 a / (3 pi R)`.
//!
//! It holds for flat prints (a well below R), and for rolling ([`super::resistance`]): in an impact all of the circle pushes.
//! Beyond `a = R` it stays at that width.

use std::f64::consts::PI;

/// A rut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rut {
    /// Pressure with which the ground resists [Pa].
    pub pressure: f64,
}

impl Rut {
    /// Lever arm of the ground's `force` [N] ahead of the centre of a rock of `radius` [m] [m].
    pub fn arm(&self, radius: f64, force: f64) -> f64 {
        let half_width = (2.0 * force / (PI * self.pressure)).sqrt().min(radius);
        4.0 * half_width / (3.0 * PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The front half of a circle, in strips: what it carries, and the moment of that.
    #[test]
    fn the_moment_is_that_of_the_front_half_of_the_circle() {
        let (pressure, force) = (2e5, 7_000.0);
        let a = (2.0 * force / (PI * pressure)).sqrt();
        let strips = 200_000;
        let h = a / f64::from(strips);
        let (mut carried, mut moment) = (0.0, 0.0);
        for k in 0..strips {
            let x = h * (f64::from(k) + 0.5);
            let push = pressure * 2.0 * (a * a - x * x).sqrt() * h;
            carried += push;
            moment += push * x;
        }
        let rut = Rut { pressure };
        assert!((carried / force - 1.0).abs() < 1e-6, "{carried}");
        assert!((rut.arm(1.0, force) * force / moment - 1.0).abs() < 1e-6, "{moment}");
        // As wide as the rock, no wider.
        assert_eq!(rut.arm(0.5 * a, force), 4.0 * 0.5 * a / (3.0 * PI));
    }
}
