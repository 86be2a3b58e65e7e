//! Elastic force along the normal.
//!
//! Hertz: `k = 2 E* sqrt(R* d)`, `F = 2/3 k d`, energy `2/5 F d`, with
//! `1/E* = (1 - nu^2) / E + (1 - nu'^2) / E'`; the second term is that of the other side, 0 where it is
//! rigid.
//! Linear: constant `k`, `F = k d`, energy `1/2 F d`; from a modulus
//! `k = pi E* R sqrt(a (2 - a))` with a = 0.05, the contact area at 5 % indentation.
//!
//! Source: handbook 1.2, 1.3, 1.5.

use crate::law::elastic::Elastic;
use crate::law::restitution;
use crate::settings::{ContactSettings, LawName};
use std::f64::consts::PI;

/// Nominal indentation at which a modulus makes a linear stiffness.
const INDENTATION: f64 = 0.05;

/// Elastic force along the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Normal {
    /// Force ~ overlap^1.5; holds E* [Pa].
    Hertz(f64),
    /// Force ~ overlap; stiffness [N/m] of every contact.
    Linear(f64),
    /// Force ~ overlap; stiffness per radius [N/m2].
    LinearPerRadius(f64),
}

/// What the normal law answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Tangent stiffness [N/m].
    pub stiffness: f64,
    /// Elastic force [N].
    pub force: f64,
    /// Stored energy [J].
    pub energy: f64,
}

impl Normal {
    /// From the scene's table, which has been checked, between two elastic sides.
    pub fn new(settings: &ContactSettings, sides: Option<&Elastic>) -> Self {
        let modulus = || sides.expect("checked: the law has a modulus or a stiffness").modulus();
        match (settings.law, settings.stiffness) {
            (LawName::HertzMindlin | LawName::HertzRock, _) => Self::Hertz(modulus()),
            (LawName::Linear, Some(stiffness)) => Self::Linear(stiffness),
            (LawName::Linear, None) => {
                let area = (INDENTATION * (2.0 - INDENTATION)).sqrt();
                Self::LinearPerRadius(PI * modulus() * area)
            }
        }
    }

    /// Load at effective radius `radius` [m] and `overlap` > 0 [m].
    #[inline]
    pub fn load(&self, radius: f64, overlap: f64) -> Load {
        match *self {
            Self::Hertz(modulus) => {
                let stiffness = 2.0 * modulus * (radius * overlap).sqrt();
                let force = 2.0 / 3.0 * stiffness * overlap;
                Load { stiffness, force, energy: 0.4 * force * overlap }
            }
            Self::Linear(stiffness) => linear(stiffness, overlap),
            Self::LinearPerRadius(per_radius) => linear(per_radius * radius, overlap),
        }
    }

    /// E* [Pa], where the force follows from it by Hertz.
    pub fn modulus(&self) -> Option<f64> {
        match *self {
            Self::Hertz(modulus) => Some(modulus),
            Self::Linear(_) | Self::LinearPerRadius(_) => None,
        }
    }

    /// Deepest overlap [m] of a sphere of `radius` [m] and `mass` [kg] that meets a fixed wall at `speed` [m/s].
    pub fn deepest(&self, radius: f64, mass: f64, speed: f64) -> f64 {
        let energy = 0.5 * mass * speed * speed;
        match *self {
            Self::Hertz(modulus) => (energy * 15.0 / (8.0 * modulus * radius.sqrt())).powf(0.4),
            Self::Linear(k) => (2.0 * energy / k).sqrt(),
            Self::LinearPerRadius(k) => (2.0 * energy / (k * radius)).sqrt(),
        }
    }

    /// How long such a contact lasts without dashpot [s].
    pub fn duration(&self, radius: f64, mass: f64, speed: f64) -> f64 {
        self.impact(radius, mass, speed).1
    }

    /// Both: deepest overlap [m] and duration [s].
    pub fn impact(&self, radius: f64, mass: f64, speed: f64) -> (f64, f64) {
        let deepest = self.deepest(radius, mass, speed);
        let duration = match self {
            // The integral of 2 dx / sqrt(1 - x^(5/2)) from 0 to 1.
            Self::Hertz(_) => 2.943_275_184_3 * deepest / speed,
            Self::Linear(_) | Self::LinearPerRadius(_) => {
                PI * (mass / self.load(radius, 1.0).stiffness).sqrt()
            }
        };
        (deepest, duration)
    }

    /// Damping ratio that gives the restitution `e`, in (0, 1].
    pub fn damping_ratio(&self, e: f64) -> f64 {
        match self {
            Self::Hertz(_) => restitution::hertz_ratio(e),
            Self::Linear(_) | Self::LinearPerRadius(_) => restitution::linear_ratio(e),
        }
    }

    pub(super) fn describe(&self) -> String {
        match self {
            Self::Hertz(modulus) => format!("Hertz contact, E* = {modulus:.4e} Pa"),
            Self::Linear(k) => format!("linear contact, k = {k:.4e} N/m"),
            Self::LinearPerRadius(k) => format!("linear contact, k = {k:.4e} N/m2 times the radius"),
        }
    }
}

#[inline]
fn linear(stiffness: f64, overlap: f64) -> Load {
    let force = stiffness * overlap;
    Load { stiffness, force, energy: 0.5 * force * overlap }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffness_and_energy_are_derivative_and_integral_of_the_force() {
        for law in [Normal::Hertz(2e9), Normal::Linear(3e6), Normal::LinearPerRadius(5e7)] {
            let (radius, d, step) = (0.07, 0.003, 1e-7);
            let at = |d| law.load(radius, d);
            // Central differences: relative error (step / d)^2 / 24 and rounding 1e-16 d / step.
            let slope = (at(d + step).force - at(d - step).force) / (2.0 * step);
            assert!((slope / at(d).stiffness - 1.0).abs() < 1e-8);
            let power = (at(d + step).energy - at(d - step).energy) / (2.0 * step);
            assert!((power / at(d).force - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn the_deepest_overlap_stores_all_the_energy() {
        for law in [Normal::Hertz(2e9), Normal::Linear(3e6), Normal::LinearPerRadius(5e7)] {
            let (radius, mass, speed) = (0.07, 3.0, 4.0);
            let deepest = law.deepest(radius, mass, speed);
            assert!((law.load(radius, deepest).energy / (0.5 * mass * speed * speed) - 1.0).abs() < 1e-14);
        }
    }

    /// V-D1, all rows: two equal spheres have E*/2, R/2, m/2, a wall E*, R, m. Printed to 9 digits.
    #[test]
    fn overlap_force_and_duration_of_an_impact_are_the_published_ones() {
        let mass = |radius: f64, density: f64| 4.0 / 3.0 * PI * radius.powi(3) * density;
        let rows = [
            (20e9, 0.25, 0.01, 2500.0, 20.0, 0.5, 3.683_040_26e-4, 7_108.241_28, 5.420_100_49e-5),
            (48e9, 0.20, 0.01, 2800.0, 20.0, 0.5, 2.741_127_02e-4, 10_696.889, 4.033_945_57e-5),
            (40e9, 0.35, 0.1, 1800.0, 0.2, 1.0, 5.212_328_83e-5, 7_232.681_03, 7.670_659_05e-4),
            (70e9, 0.30, 0.1, 2699.0, 0.2, 1.0, 4.971_717_52e-5, 11_369.858_3, 7.316_566_41e-4),
        ];
        for (young, nu, radius, density, speed, half, deepest, force, duration) in rows {
            let law = Normal::Hertz(half * young / (1.0 - nu * nu));
            let (r, m) = (half * radius, half * mass(radius, density));
            let d = law.deepest(r, m, speed);
            assert!((d / deepest - 1.0).abs() < 5e-9, "{d} {deepest}");
            assert!((law.load(r, d).force / force - 1.0).abs() < 5e-8);
            assert!((law.duration(r, m, speed) / duration - 1.0).abs() < 5e-9);
        }
    }
}
