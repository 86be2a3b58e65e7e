//! Hertz contact of a rock as a whole: however finely spheres cover it, it is one body that touches.
//!
//! With spheres of their own stiffness a landing is the softer the smaller the sphere that carries it, and the stiffer
//! the more of them do. Here the spheres say where the surface is, and the rock says how stiff it is. Sphere i, of
//! radius r_i and with the exposed area a_i = 2 pi r_i h_i, overlaps by d_i:
//! - `D^(p+1) = sum_i (r_i / R) (d_i^(p+1) - max(d_i - h_i, 0)^(p+1))` is the equivalent overlap: the one at which a ball of the
//!   rock's own radius R (of equal volume) has the same integral of depth^p over its surface. It is dominated by the
//!   deepest places, and converges as the spheres get smaller, over a face, an edge and a corner alike;
//! - `U = 8/15 E* sqrt(R) D^(5/2)` is the energy, that of Hertz. Forces are its derivatives, `F_i = F w_i` with
//!   `F = 4/3 E* sqrt(R) D^(3/2)` and `w_i = dD / dd_i`, so that elastic contact conserves energy;
//! - the dashpot acts on `s = sqrt(2 U)`: `F_v = 2 g sqrt(m*) ds/dt`, with the mass m* that the force acts on and the damping ratio g
//!   of a linear spring. With any U, `m v dv/dx = -U' - c v` is then the linear oscillator `v dv/ds = -s/m - 2 g v / sqrt(m)`:
//!   the restitution asked for is met exactly over faces, edges and corners;
//! - stiffness and dashpot of the tangential parts are shared out as the force is.
//!
//! One ball is the contact of Hertz to the last digit. The same energy by volume of overlap (p = 1) is that of Feng (2021),
//! Comput. Methods Appl. Mech. Engrg. 373, 113454; there the stiffness of a face is infinite at the first touch.

pub mod patch;
pub mod rocks;
pub mod terrain;
pub mod wires;

use crate::law::Law;
use crate::law::yielding;
use crate::rock::{Rock, exposed};
use std::f64::consts::PI;

/// The exponent p. Over a plane face the force goes with overlap^(5p/(2p+2)-1), that is 1.35; a larger one gives spheres
/// less weight by their size, and faces a stiffer seat.
const POWER: i32 = 16;

/// A sphere's part in the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cap {
    /// Its radius over the rock's.
    size: f64,
    /// Depth at which the plane that cuts it has passed as much area as is exposed [m]; 0: it is inside others.
    height: f64,
}

impl Cap {
    /// Its part, overlapping by `overlap` > 0 [m], in the sum that is (D / R)^(p+1) of a `radius` R [m].
    #[inline]
    fn part(&self, overlap: f64, radius: f64) -> f64 {
        let power = |depth: f64| (depth / radius).powi(POWER + 1);
        self.size * (power(overlap) - power((overlap - self.height).max(0.0)))
    }

    /// How much of the force on the equivalent overlap it has: `dD / dd_i`.
    #[inline]
    fn weight(&self, overlap: f64, equivalent: f64) -> f64 {
        let power = |depth: f64| (depth / equivalent).powi(POWER);
        self.size * (power(overlap) - power((overlap - self.height).max(0.0)))
    }
}

/// The equivalent overlap of a sum of parts at `radius` [m].
#[inline]
fn equivalent(radius: f64, sum: f64) -> f64 {
    radius * sum.powf(1.0 / f64::from(POWER + 1))
}

/// What of a rock its contacts as a whole need.
#[derive(Debug, Clone, PartialEq)]
pub struct Whole {
    /// Radius of the ball of its volume [m].
    pub radius: f64,
    caps: Vec<Cap>,
}

impl Whole {
    /// Of a rock.
    pub fn new(rock: &Rock) -> Self {
        let radius = rock.mean_radius();
        let cap = |(sphere, area): (&dem_solid::geometry::sphere::Sphere, f64)| Cap {
            size: sphere.radius / radius,
            height: area / (2.0 * PI * sphere.radius),
        };
        Self { radius, caps: rock.spheres.iter().zip(exposed::areas(&rock.spheres)).map(cap).collect() }
    }

    /// The same of the rock with all its lengths times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let cap = |cap: &Cap| Cap { height: cap.height * factor, ..*cap };
        Self { radius: self.radius * factor, caps: self.caps.iter().map(cap).collect() }
    }

    /// True if the sphere is part of the surface.
    #[inline]
    pub fn shows(&self, sphere: u32) -> bool {
        self.caps[sphere as usize].height > 0.0
    }

    /// The part of a sphere that overlaps by `overlap` > 0 [m] in the sum that is (D / R)^(p+1).
    #[inline]
    pub fn part(&self, sphere: u32, overlap: f64) -> f64 {
        self.caps[sphere as usize].part(overlap, self.radius)
    }

    /// The equivalent overlap of a sum of [`Whole::part`]s [m].
    #[inline]
    pub fn equivalent(&self, sum: f64) -> f64 {
        equivalent(self.radius, sum)
    }

    /// How much of the force on the equivalent overlap a sphere has: `dD / dd_i`.
    #[inline]
    pub fn weight(&self, sphere: u32, overlap: f64, equivalent: f64) -> f64 {
        self.caps[sphere as usize].weight(overlap, equivalent)
    }

    /// The stiffest landing at `speed` [m/s] under `law`: flat, on a plane face as wide as the rock, where the force acts on the
    /// inverse mass `mobility` [1/kg].
    pub fn landing(&self, rock: &Rock, law: &Law, mobility: f64, speed: f64) -> Landing {
        let energy = 0.5 * speed * speed / mobility;
        let rim = rock.highest_corner.max().max(-rock.lowest_corner.min());
        let equivalent = law.normal.deepest(self.radius, 1.0 / mobility, speed);
        if let Some(yielding) = &law.yielding {
            let restitution = yielding.restitution(speed, equivalent);
            return self.landing_on_ground(rock, law, mobility, equivalent, restitution);
        }
        let p = f64::from(POWER);
        let overlap = self.of_face(rim, equivalent);
        let scale = energy / (overlap * overlap);
        let turning = rim * rim / rock.inertia.min();
        let square = scale * (SEAT[0] * mobility).max(SEAT[1] * turning);
        // dF/dD (dD/dd)^2, of a face.
        let stiffness = 3.75 * scale * (p / (p + 1.0)).powi(2);
        let square = square.max(Self::along(law, [stiffness, 1.0], mobility + turning));
        let duration = SEAT_DURATION * overlap / speed;
        Landing { duration, stiffness, square, ratio: law.damping.map_or(0.0, |d| d.ratio) }
    }

    /// Square of the frequency of the tangential spring [1/s2] at a normal stiffness [N/m] that goes with the square of `slope`, where
    /// it moves `mobility` [1/kg].
    fn along(law: &Law, [stiffness, slope]: [f64; 2], mobility: f64) -> f64 {
        law.tangential.map_or(0.0, |t| t.stiffness_ratio * stiffness * slope * slope * mobility)
    }

    /// Overlap of a face with this `rim` [m] that has the equivalent overlap `equivalent` [m]:
    /// `D^(p+1) = (p+1) A d^p / (2 pi R)`, with `A = pi rim^2`.
    fn of_face(&self, rim: f64, equivalent: f64) -> f64 {
        let p = f64::from(POWER);
        let area = (p + 1.0) * rim * rim / (2.0 * self.radius);
        (equivalent.powf(p + 1.0) / area).powf(1.0 / p).min(equivalent)
    }

    /// The stiffest that ground is which gives way, on a face: on the way out from `deepest` [m] with `restitution`.
    pub fn landing_on_ground(
        &self,
        rock: &Rock,
        law: &Law,
        mobility: f64,
        deepest: f64,
        restitution: f64,
    ) -> Landing {
        let rim = rock.highest_corner.max().max(-rock.lowest_corner.min());
        let overlap = self.of_face(rim, deepest);
        let p = f64::from(POWER);
        let slope = p / (p + 1.0) * deepest / overlap;
        let load = law.normal.load(self.radius, deepest);
        let steeper = yielding::stiffening(law.normal.powers().overlap, restitution);
        let stiffness = steeper * load.force / deepest * slope * slope;
        let turning = rim * rim / rock.inertia.min();
        // Where a tilt makes the overlaps differ, the force grows by its p-th part of the overlap, too.
        let square = (stiffness * (mobility + turning)).max(load.force * slope * p / overlap * turning);
        let square = square.max(Self::along(law, [load.stiffness, slope], mobility + turning));
        let duration = PI / (stiffness * mobility).sqrt();
        Landing { duration, stiffness, square, ratio: yielding::seat_damping(restitution) }
    }
}

/// A landing of a rock as a whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landing {
    /// Duration without dashpot [s].
    pub duration: f64,
    /// Largest stiffness along the normal [N/m].
    pub stiffness: f64,
    /// Square of the fastest frequency [1/s2].
    pub square: f64,
    /// Damping ratio.
    pub ratio: f64,
}

/// Second derivatives of the energy over energy / overlap^2, for U ~ d^n with n = 5p / (2p + 2) on a face: n (n - 1) along
/// the normal; F p / d = n p at its rim, where a tilt makes the overlaps differ.
const SEAT: [f64; 2] = {
    let p = POWER as f64;
    let n = 5.0 * p / (2.0 * p + 2.0);
    [n * (n - 1.0), n * p]
};

/// Duration of an elastic landing on a face, in overlap over speed: `2 B(1/n, 1/2) / n`.
const SEAT_DURATION: f64 = 2.993_9;

#[cfg(test)]
mod tests {
    use super::*;
    use dem_solid::geometry::sphere::Sphere;
    use nalgebra::Vector3;

    fn whole(radius: f64, spheres: &[Sphere]) -> Whole {
        let cap =
            |(s, area): (&Sphere, f64)| Cap { size: s.radius / radius, height: area / (2.0 * PI * s.radius) };
        Whole { radius, caps: spheres.iter().zip(exposed::areas(spheres)).map(cap).collect() }
    }

    /// Pressed by `depth` on a plane across z below it, of the lowest end `lowest`.
    fn overlap(whole: &Whole, spheres: &[Sphere], lowest: f64, depth: f64) -> f64 {
        let overlaps = spheres.iter().map(|s| lowest + depth - (s.centre.z - s.radius));
        let parts = overlaps.enumerate().filter(|(_, d)| *d > 0.0).map(|(k, d)| whole.part(k as u32, d));
        whole.equivalent(parts.sum())
    }

    #[test]
    fn one_sphere_has_the_equivalent_overlap_that_it_has() {
        let spheres = [Sphere { centre: Vector3::z() * 0.3, radius: 0.3 }];
        let whole = whole(0.3, &spheres);
        for depth in [1e-9, 1e-4, 0.05, 0.3] {
            assert!((overlap(&whole, &spheres, 0.0, depth) / depth - 1.0).abs() < 1e-12, "{depth}");
            assert!((whole.weight(0, depth, depth) - 1.0).abs() < 1e-12);
        }
    }

    /// The weights against central differences, energy, force and stiffness likewise.
    #[test]
    fn weights_force_and_stiffness_are_derivatives() {
        let sphere = |x: f64, radius: f64| Sphere { centre: Vector3::new(x, 0.0, 0.0), radius };
        let spheres = [sphere(0.0, 0.1), sphere(0.12, 0.05), sphere(0.3, 0.2)];
        let whole = whole(0.4, &spheres);
        // The second is deeper in than its exposed height.
        let depths = [0.021, 0.09, 0.02];
        assert!(depths[1] > whole.caps[1].height);
        let equivalent =
            |d: [f64; 3]| whole.equivalent((0..3).map(|k| whole.part(k as u32, d[k])).sum::<f64>());
        let at = equivalent(depths);
        for k in 0..3 {
            let moved = |by: f64| {
                let mut d = depths;
                d[k] += by;
                equivalent(d)
            };
            let h = 1e-6 * depths[k];
            let slope = (moved(h) - moved(-h)) / (2.0 * h);
            let weight = whole.weight(k as u32, depths[k], at);
            assert!((slope - weight).abs() < 1e-7, "{k}: {slope} {weight}");
        }
        let of = |d: f64| crate::law::normal::Load::hertz(2e9, whole.radius, d);
        let h = 1e-6 * at;
        assert!(((of(at + h).energy - of(at - h).energy) / (2.0 * h) / of(at).force - 1.0).abs() < 1e-8);
        assert!(((of(at + h).force - of(at - h).force) / (2.0 * h) / of(at).stiffness - 1.0).abs() < 1e-8);
    }

    /// A ball of radius 1 that small spheres cover closely, and a plane face: the integrals over the smooth surface.
    #[test]
    fn what_small_spheres_cover_closely_is_pressed_as_the_smooth_surface_is() {
        let p = f64::from(POWER);
        let small = 0.3;
        let ball: Vec<Sphere> = (0..6000)
            .map(|k| Sphere {
                centre: dem_solid::geometry::sphere::direction(k, 6000) * (1.0 - small),
                radius: small,
            })
            .collect();
        let of_ball = whole(1.0, &ball);
        for depth in [0.02, 0.05] {
            let found = overlap(&of_ball, &ball, -1.0, depth);
            assert!((found / depth - 1.0).abs() < 0.03, "ball: {found} {depth}");
        }
        let flat: Vec<Sphere> = (0..1600)
            .map(|k| Sphere {
                centre: Vector3::new(0.025 * f64::from(k % 40), 0.025 * f64::from(k / 40), 0.05),
                radius: 0.05,
            })
            .collect();
        let of_flat = whole(1.0, &flat);
        for depth in [0.01_f64, 0.03] {
            let found = overlap(&of_flat, &flat, 0.0, depth);
            let exact = ((p + 1.0) * depth.powf(p) / (2.0 * PI)).powf(1.0 / (p + 1.0));
            assert!((found / exact - 1.0).abs() < 0.1, "face: {found} {exact}");
        }
    }

    /// The closed form against a sum over the landing.
    #[test]
    fn the_duration_of_a_landing_on_a_face_is_the_integral() {
        let p = f64::from(POWER);
        let n = 5.0 * p / (2.0 * p + 2.0);
        // With x = sin(a)^(2/n) the integrand of 2 dx / sqrt(1 - x^n) is 4/n sin(a)^(2/n - 1).
        let parts = 200_000;
        let sum: f64 = (0..parts)
            .map(|i| (0.5 * PI * (f64::from(i) + 0.5) / f64::from(parts)).sin().powf(2.0 / n - 1.0))
            .sum();
        let duration = 4.0 / n * sum * 0.5 * PI / f64::from(parts);
        assert!((SEAT_DURATION / duration - 1.0).abs() < 1e-3, "{duration}");
    }
}
