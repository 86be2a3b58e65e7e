//! Contact of two rocks as wholes.
//!
//! The energy of [`super`], with the radius `R = R_a R_b / (R_a + R_b)` of two balls of the rocks' volumes, and the equivalent overlap
//! over all pairs of spheres: `D^(p+1) = sum_ij (r_ij / R) (d_ij^(p+1) - max(d_ij - h_ij, 0)^(p+1))` with
//! `r_ij = r_i r_j / (r_i + r_j)` and the lesser exposed height h_ij of the two. Two balls are the contact of Hertz to the last digit. The
//! dashpot acts on the mass that the sum of the forces moves of both, levers included.

use super::{Cap, Whole, equivalent};

/// Two rocks as wholes.
#[derive(Debug, Clone, Copy)]
pub struct TwoWholes<'a> {
    /// What each needs.
    pub wholes: [&'a Whole; 2],
}

impl TwoWholes<'_> {
    /// Radius of the contact of balls of their volumes [m].
    pub fn radius(&self) -> f64 {
        let [a, b] = self.wholes.map(|whole| whole.radius);
        a * b / (a + b)
    }

    /// The lesser radius [m].
    pub fn smaller(&self) -> f64 {
        self.wholes[0].radius.min(self.wholes[1].radius)
    }

    /// What a pair of spheres has of the surface.
    fn cap(&self, [i, j]: [u32; 2]) -> Cap {
        let [one, other] = [self.wholes[0].caps[i as usize], self.wholes[1].caps[j as usize]];
        let [r, s] = [one.size * self.wholes[0].radius, other.size * self.wholes[1].radius];
        Cap { size: r * s / (r + s) / self.radius(), height: one.height.min(other.height) }
    }

    /// The equivalent overlap of pairs of spheres and their overlaps [m].
    pub fn equivalent(&self, pairs: impl Iterator<Item = ([u32; 2], f64)>) -> f64 {
        let radius = self.radius();
        equivalent(radius, pairs.map(|(pair, overlap)| self.cap(pair).part(overlap, radius)).sum())
    }

    /// How much of the force on the equivalent overlap a pair of spheres has.
    pub fn weight(&self, spheres: [u32; 2], overlap: f64, equivalent: f64) -> f64 {
        self.cap(spheres).weight(overlap, equivalent)
    }
}
