//! The deepest places between the spheres of a cluster: where three of them intersect, or two along a circle.
//!
//! The distance to the solid's surface of a point that moves over a sphere grows until another sphere stops it, and then along
//! the circle of both until a third one does. Points sampled on spheres find about where; the corner itself is computed.

use super::index::{SphereIndex, holds};
use crate::geometry::sphere::{Sphere, around};
use crate::shape::tree::SurfaceTree;
use nalgebra::Vector3;

/// Spheres next to a place that are tried: pairs of them are some hundreds; and of these the ones whose circles are
/// followed to their deepest points.
const MOST_NEIGHBOURS: usize = 16;
const FOLLOWED: usize = 8;
/// Share of its distance to the surface by which the view from a place begins above it.
const ABOVE: f64 = 1e-3;
/// Steps from a place to a deeper one, and along a circle to its deepest point.
const MOST_STEPS: usize = 40;
const TURNS: usize = 3;
/// Most steps over one sphere.
const MOST_TURNS: usize = 60;

/// A place on a sphere, and its distance to the solid's surface [m].
#[derive(Debug, Clone, Copy)]
pub struct Pit {
    /// The place [m].
    pub point: Vector3<f64>,
    /// The distance [m].
    pub depth: f64,
    /// The sphere's number in the index.
    pub sphere: u32,
}

/// A solid's surface and the spheres that approximate it.
pub struct Pits<'a> {
    /// The solid's surface.
    pub tree: &'a SurfaceTree,
    /// The spheres.
    pub index: &'a SphereIndex,
    /// Lengths below this one are rounding [m].
    pub tight: f64,
}

impl Pits<'_> {
    /// The distance of `point` to the solid's surface [m], if it is more than `least`, no sphere contains the point, and
    /// none lies between it and the nearest point of that surface: what is closed in between spheres touches nothing.
    pub fn depth(&self, point: &Vector3<f64>, least: f64) -> Option<f64> {
        // In this order: most points lie in a sphere, and most of the others are near enough.
        if self.index.holds(point, self.tight) || self.tree.nearest(point, least).is_some() {
            return None;
        }
        let near = self.tree.nearest(point, f64::INFINITY)?;
        let (out, length) = (near.point - point, near.square.sqrt());
        // From a little above the spheres that the point lies on.
        let above = point + out * ABOVE;
        let along = out.try_normalize(0.0)?;
        let rest = length * (1.0 - 2.0 * ABOVE);
        if self.index.holds(&above, self.tight) || self.index.entry(&above, &along, rest).is_some() {
            return None;
        }
        Some(length)
    }

    /// The deepest place that is reached from `pit` by corners of three spheres, each deeper than the last. At one of the
    /// places `known`, from which another search went on, this one ends; it adds its own.
    pub fn deepest(&self, mut pit: Pit, known: &mut Vec<Vector3<f64>>) -> Pit {
        for _ in 0..MOST_STEPS {
            let near = |k: &Vector3<f64>| (k - pit.point).norm_squared() <= (10.0 * self.tight).powi(2);
            if known.iter().any(near) {
                break;
            }
            known.push(pit.point);
            match self.deeper(&pit) {
                Some(found) => pit = found,
                None => break,
            }
        }
        pit
    }

    /// A deeper place on the sphere of `pit` than it.
    fn deeper(&self, pit: &Pit) -> Option<Pit> {
        let own = *self.index.sphere(pit.sphere);
        let mut others = self.index.overlapping(&own);
        others.retain(|k| *k != pit.sphere);
        let away = |k: &u32| {
            let s = self.index.sphere(*k);
            ((pit.point - s.centre).norm() - s.radius).abs()
        };
        others.sort_by(|a, b| away(a).total_cmp(&away(b)));
        others.truncate(MOST_NEIGHBOURS);
        let others: Vec<(u32, Sphere)> = others.into_iter().map(|k| (k, *self.index.sphere(k))).collect();
        let look = |best: Option<Pit>, point: Vector3<f64>, sphere: u32| {
            // Most corners lie in one of these.
            if others.iter().any(|(_, s)| holds(s, &point, self.tight)) {
                return best;
            }
            let least = best.map_or(pit.depth * (1.0 + 1e-9) + self.tight, |b| b.depth);
            self.depth(&point, least).map(|depth| Pit { point, depth, sphere }).or(best)
        };
        let circles: Vec<(usize, Circle)> =
            others.iter().enumerate().filter_map(|(i, (_, s))| Some((i, Circle::of(&own, s)?))).collect();
        let mut best = None;
        for (i, circle) in &circles {
            for (_, other) in &others[i + 1..] {
                for corner in circle.corners(other).into_iter().flatten() {
                    best = look(best, corner, others[*i].0);
                }
            }
        }
        if best.is_none() {
            for (i, circle) in circles.iter().take(FOLLOWED) {
                best = look(best, self.bottom(circle, &pit.point), others[*i].0);
            }
        }
        best.or_else(|| self.further(pit, &own))
    }

    /// A deeper place on the sphere `own` beside `pit`, by smaller and smaller steps: in a hole through a plate it is where
    /// both faces are as far.
    fn further(&self, pit: &Pit, own: &Sphere) -> Option<Pit> {
        let mut best = *pit;
        let mut turn = 0.5;
        for _ in 0..MOST_TURNS {
            let before = best.depth;
            for along in around(&((best.point - own.centre) / own.radius), turn) {
                let point = own.centre + along * own.radius;
                if let Some(depth) = self.depth(&point, best.depth * (1.0 + 1e-9) + self.tight) {
                    best = Pit { point, depth, ..best };
                }
            }
            if best.depth == before {
                turn *= 0.5;
            }
            if turn < 1e-5 {
                break;
            }
        }
        (best.depth > pit.depth).then_some(best)
    }

    /// The point of a circle that is deepest, beginning at the one next to `at`.
    fn bottom(&self, circle: &Circle, at: &Vector3<f64>) -> Vector3<f64> {
        let mut point = circle.towards(&(at - circle.centre));
        for _ in 0..TURNS {
            let Some(near) = self.tree.nearest(&point, f64::INFINITY) else { break };
            point = circle.towards(&(point - near.point));
        }
        point
    }
}

/// Where two spheres intersect.
struct Circle {
    centre: Vector3<f64>,
    /// Unit normal of its plane.
    normal: Vector3<f64>,
    radius: f64,
}

impl Circle {
    fn of(a: &Sphere, b: &Sphere) -> Option<Self> {
        let arm = b.centre - a.centre;
        let distance = arm.norm();
        let normal = arm.try_normalize(0.0)?;
        let along = 0.5 * (distance + (a.radius * a.radius - b.radius * b.radius) / distance);
        let square = a.radius * a.radius - along * along;
        (square > 0.0).then(|| Self { centre: a.centre + normal * along, normal, radius: square.sqrt() })
    }

    /// Its point that lies furthest in a direction.
    fn towards(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let flat = direction - self.normal * self.normal.dot(direction);
        let any = || self.normal.cross(&Vector3::ith(self.normal.iamin(), 1.0)).normalize();
        self.centre + flat.try_normalize(1e-12 * self.radius).unwrap_or_else(any) * self.radius
    }

    /// Its points on another sphere.
    fn corners(&self, other: &Sphere) -> Option<[Vector3<f64>; 2]> {
        let arm = other.centre - self.centre;
        let flat = arm - self.normal * self.normal.dot(&arm);
        let length = flat.norm();
        // |arm|^2 - 2 (flat along u) rho + rho^2 = R^2 for the point at the angle whose cosine is sought.
        let cosine = (arm.norm_squared() + self.radius * self.radius - other.radius * other.radius)
            / (2.0 * self.radius * length);
        if cosine.is_nan() || cosine.abs() > 1.0 {
            return None;
        }
        let u = flat / length;
        let side = self.normal.cross(&u) * (1.0 - cosine * cosine).sqrt();
        Some([
            self.centre + (u * cosine + side) * self.radius,
            self.centre + (u * cosine - side) * self.radius,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::builtin;

    /// Three balls of a plate, in a triangle of side s: the corner of all three lies `sqrt(r^2 - s^2 / 3)` above their middle.
    #[test]
    fn the_deepest_place_between_three_balls_is_their_corner() {
        let tree = SurfaceTree::new(&builtin::cuboid(Vector3::new(2.0, 2.0, 0.2)));
        let (r, s) = (0.1_f64, 0.15_f64);
        let centre = |k: u32| {
            let angle = f64::from(k) * std::f64::consts::TAU / 3.0;
            Vector3::new(angle.cos(), angle.sin(), 0.0) * (s / 3.0_f64.sqrt())
        };
        let spheres: Vec<Sphere> = (0..3).map(|k| Sphere { centre: centre(k), radius: r }).collect();
        let index = SphereIndex::new(&spheres);
        let pits = Pits { tree: &tree, index: &index, tight: 1e-12 };
        let start = spheres[0].centre + Vector3::new(-0.5, 0.0, 0.75_f64.sqrt()) * r;
        let depth = pits.depth(&start, 0.0).expect("nothing lies above it");
        let start = Pit { point: start, depth, sphere: index.nearest(&start).1 };
        let found = pits.deepest(start, &mut Vec::new());
        let exact = 0.1 - (r * r - s * s / 3.0).sqrt();
        assert!(depth < 0.5 * exact && (found.depth - exact).abs() < 1e-12, "{found:?}, {exact}");
    }
}
