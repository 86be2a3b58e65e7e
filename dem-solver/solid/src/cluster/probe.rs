//! Distances of places on a solid's surface to the spheres of a cluster and back, and where they are largest.
//!
//! The deepest places between the spheres of a cluster: where three of them intersect, or two along a circle.
//!
//! The distance to the solid's surface of a point that moves over a sphere grows until another sphere stops it, and then along
//! the circle of both until a third one does. Points sampled on spheres find about where; the corner itself is computed.

use super::index::{SphereIndex, holds};
use super::samples::Sample;
use crate::geometry::sphere::{Sphere, around};
use crate::shape::tree::SurfaceTree;
use nalgebra::Vector3;

/// How much is sampled.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Points on all spheres.
    pub points: usize,
    /// Samples from which the largest errors are sought, and steps from each.
    pub starts: usize,
    /// Steps from each of them.
    pub steps: usize,
    /// Spheres from which the deepest place between spheres is sought.
    pub pits: usize,
}

/// What share of the largest error samples must have for one that is larger to be sought beside them.
const NEARLY: f64 = 0.7;
/// Points on one sphere, least and most.
const LEAST_POINTS: usize = 30;
const MOST_POINTS: usize = 400;

/// A place where the two surfaces are far apart.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Point of the true surface [m].
    pub point: Vector3<f64>,
    /// Unit vector into the solid there.
    pub inward: Vector3<f64>,
    /// Distance of the two surfaces [m].
    pub depth: f64,
}

/// The largest distances, from the surface to the spheres and back [m], and the places where large ones were found.
#[derive(Debug, Clone, Default)]
pub struct Largest {
    /// From the surface to the spheres [m].
    pub there: f64,
    /// From the spheres to the surface [m].
    pub back: f64,
    /// Where, the worst ones first.
    pub places: Vec<Place>,
}

/// A sample with the distances from there to the spheres and back [m].
pub type Measured = (f64, f64, Sample);

/// A solid's surface, the spheres that approximate it, and how much is sampled.
pub struct Probe<'a> {
    /// The solid's surface.
    tree: &'a SurfaceTree<'a>,
    /// The spheres.
    pub index: SphereIndex,
    /// Lengths below this one are rounding [m].
    tight: f64,
    /// Furthest that a sphere reaches out of it [m].
    pub outside: f64,
    /// How much is sampled.
    pub effort: Effort,
}

impl<'a> Probe<'a> {
    /// Of a solid.
    pub fn new(tree: &'a SurfaceTree, spheres: &[Sphere], effort: Effort) -> Self {
        let outside = spheres.iter().map(|s| s.radius + tree.signed(&s.centre).0).fold(0.0, f64::max);
        Self { tree, index: SphereIndex::new(spheres), tight: 1e-9 * tree.size, outside, effort }
    }

    /// What is measured at samples.
    pub fn measured(&self, samples: &[Sample]) -> Vec<Measured> {
        let measure = |sample: &Sample| {
            let (there, back) = self.at(&sample.point, &sample.inward);
            (there, back, *sample)
        };
        samples.iter().map(measure).collect()
    }

    /// Distance of the sample to the cluster's surface, and of that to the true surface where the ray ends.
    fn at(&self, sample: &Vector3<f64>, inward: &Vector3<f64>) -> (f64, f64) {
        let (gap, sphere) = self.index.nearest(sample);
        // A place on a ray of length t lies no further than t from the surface where the ray begins.
        let depth = |t: f64, along: &Vector3<f64>| {
            let near = self.tree.nearest(&(sample + along * t), t * (1.0 + 1e-9));
            near.map_or(t, |n| n.square.sqrt())
        };
        if gap > 0.0 {
            // A ray that no sphere stops leaves the solid at last: it says nothing.
            let end = self.index.entry(sample, inward, self.tree.size);
            return (gap, end.map_or(gap, |t| depth(t, inward)));
        }
        let out = -inward;
        let t = self.exit(sample, &out, sphere);
        let arm = sample - self.index.sphere(sphere).centre;
        let short = arm.try_normalize(self.tight).map_or(t, |along| self.exit(sample, &along, sphere));
        (t.min(short), depth(t, &out))
    }

    /// Length of the ray from `from`, which lies in `sphere`, along `along` until it leaves all spheres [m].
    fn exit(&self, from: &Vector3<f64>, along: &Vector3<f64>, mut sphere: u32) -> f64 {
        let mut t = 0.0;
        for _ in 0..80 {
            let s = self.index.sphere(sphere);
            let arm = from + along * t - s.centre;
            let away = arm.dot(along);
            t += -away + (away * away - arm.norm_squared() + s.radius * s.radius).max(0.0).sqrt();
            let (distance, next) = self.index.nearest(&(from + along * t));
            if distance >= -self.tight {
                break;
            }
            sphere = next;
        }
        t
    }

    /// Distance of a sample to the cluster's surface [m]: to the nearest sphere outside of all, else along the shortest
    /// ray out of them that turning by smaller and smaller angles finds. Once it is known to be no more than
    /// `least` it is not sought further.
    fn shortest(&self, sample: &Vector3<f64>, inward: &Vector3<f64>, least: f64) -> f64 {
        let (gap, sphere) = self.index.nearest(sample);
        if gap >= 0.0 {
            return gap;
        }
        let mut best = (self.exit(sample, &-inward, sphere), -inward);
        let arm = sample - self.index.sphere(sphere).centre;
        let starts = (0..6).map(|k| Vector3::ith(k / 2, if k % 2 == 0 { 1.0 } else { -1.0 }));
        for along in arm.try_normalize(self.tight).into_iter().chain(starts) {
            if best.0 <= least {
                return best.0;
            }
            let t = self.exit(sample, &along, sphere);
            if t < best.0 {
                best = (t, along);
            }
        }
        let mut turn = 0.6;
        // No point of the cluster's surface is nearer than that of the sphere in which the sample lies deepest.
        while turn > 1e-4 && best.0 > least && best.0 > -gap * (1.0 + 1e-6) {
            let found = around(&best.1, turn).map(|along| (self.exit(sample, &along, sphere), along));
            let least = found.into_iter().fold(best, |a, b| if b.0 < a.0 { b } else { a });
            if least.0 < best.0 { best = least } else { turn *= 0.5 }
        }
        best.0
    }

    /// The largest distances, sought from what was measured at samples about `step` [m] apart.
    pub fn largest(&self, mut measured: Vec<Measured>, step: f64) -> Largest {
        let most = |places: &[Place], least: f64| places.iter().map(|p| p.depth).fold(least, f64::max);
        measured.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut places = self.furthest(&measured, step);
        let there = most(&places, 0.0);
        measured.sort_by(|a, b| b.1.total_cmp(&a.1));
        let back = |point: &Vector3<f64>, inward: &Vector3<f64>, _: f64| self.at(point, inward).1;
        let starts = spread(&measured, self.effort.starts, step).into_iter();
        let rays = starts.map(|m| self.ascend(m.2, step, back)).collect();
        let found = [rays, self.deepest(&measured, step)].concat();
        let back = most(&found, self.outside);
        places.extend(found);
        places.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        Largest { there, back, places }
    }

    /// Where the true surface lies furthest from that of the cluster; samples begin with the largest estimates.
    fn furthest(&self, measured: &[Measured], step: f64) -> Vec<Place> {
        let mut found: Vec<Measured> = Vec::new();
        let mut largest = 0.0_f64;
        for m in measured {
            // All further estimates are smaller, and none is less than the true distance.
            if m.0 <= largest {
                break;
            }
            let distance = self.shortest(&m.2.point, &m.2.inward, largest);
            largest = largest.max(distance);
            found.push((distance, m.1, m.2));
        }
        // Besides those that could be the largest: between samples it may be elsewhere.
        let near = &measured[found.len()..];
        let near = &near[..near.partition_point(|m| m.0 > NEARLY * largest)];
        for m in spread(near, self.effort.starts, step) {
            found.push((self.shortest(&m.2.point, &m.2.inward, 0.0), m.1, m.2));
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let place = |m: &Measured| Place { point: m.2.point, inward: m.2.inward, depth: m.0 };
        let mut places: Vec<Place> = found.first().map(place).into_iter().collect();
        for m in spread(&found, self.effort.starts, step) {
            // A distance grows no faster than the sample moves.
            if m.0 + self.effort.steps as f64 * 1.5 * step > largest {
                let climbed = self.ascend(m.2, step, |p, inward, least| self.shortest(p, inward, least));
                largest = largest.max(climbed.depth);
                places.push(climbed);
            }
        }
        places
    }

    /// Where points of spheres, which lie in no other and are seen from the nearest point of the true surface, are furthest
    /// from that. `measured` begins with the deepest ends of rays.
    fn deepest(&self, measured: &[Measured], step: f64) -> Vec<Place> {
        let most = self.effort.pits;
        let mut found: Vec<DeepPoint> = Vec::new();
        let count = self.index.spheres.len();
        let many = (self.effort.points / count).clamp(LEAST_POINTS, MOST_POINTS);
        for (number, sphere) in (0..).zip(&self.index.spheres) {
            let mut deepest = if found.len() < most { 0.0 } else { found[most - 1].depth };
            // One of each sphere: else all would lie around one place.
            let mut best = None;
            for k in 0..many {
                let point = sphere.centre + spiral(k, many) * sphere.radius;
                if let Some(depth) = self.depth(&point, deepest) {
                    deepest = depth;
                    best = Some(DeepPoint { point, depth, sphere: number });
                }
            }
            found.extend(best);
            if found.len() > 2 * most || number + 1 == count as u32 {
                found.sort_by(|a, b| b.depth.total_cmp(&a.depth));
                found.truncate(most);
            }
        }
        let rays = spread(measured, most, step).into_iter().filter_map(|m| {
            let Sample { point, inward, .. } = m.2;
            let point = point + inward * self.index.entry(&point, &inward, self.tree.size)?;
            let depth = self.depth(&point, 0.0)?;
            Some(DeepPoint { point, depth, sphere: self.index.nearest(&point).1 })
        });
        found.extend(rays.collect::<Vec<_>>());
        found.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        let mut known = Vec::new();
        let place = |pit: DeepPoint| {
            let point = self.tree.closest(&pit.point).point;
            let inward = (pit.point - point).try_normalize(self.tight)?;
            Some(Place { point, inward, depth: pit.depth })
        };
        found.into_iter().filter_map(|pit| place(self.bottom_of(pit, &mut known))).collect()
    }

    /// Where the largest value is that small steps along the surface find from a sample.
    fn ascend(
        &self,
        Sample { mut point, mut inward, .. }: Sample,
        mut step: f64,
        value: impl Fn(&Vector3<f64>, &Vector3<f64>, f64) -> f64,
    ) -> Place {
        let mut best = value(&point, &inward, 0.0);
        for _ in 0..self.effort.steps {
            let side = inward.cross(&Vector3::ith(inward.iamin(), 1.0)).normalize();
            let other = inward.cross(&side);
            let mut moved = false;
            for direction in
                [side, -side, other, -other, side + other, -side - other, side - other, other - side]
            {
                let near = self.tree.closest(&(point + direction * step));
                let normal = -self.tree.normal(&near).normalize();
                let found = value(&near.point, &normal, best);
                if found > best {
                    (best, point, inward, moved) = (found, near.point, normal, true);
                }
            }
            if !moved {
                step *= 0.5;
                if step < 1e-7 * self.tree.size {
                    break;
                }
            }
        }
        Place { point, inward, depth: best }
    }
}

/// The first ones of a list, at most `many`, each further from all before than the square root of a number that it has.
fn apart<T>(
    list: impl Iterator<Item = T>,
    many: usize,
    point: impl Fn(&T) -> Vector3<f64>,
    square: impl Fn(&T) -> f64,
) -> Vec<T> {
    let mut chosen: Vec<T> = Vec::new();
    for next in list {
        if chosen.len() == many {
            break;
        }
        if chosen.iter().all(|c| (point(c) - point(&next)).norm_squared() > square(&next)) {
            chosen.push(next);
        }
    }
    chosen
}

/// The worst ones of places that begin with them, at most `many`, none within its own depth of a worse one.
pub fn worst(places: impl Iterator<Item = Place>, many: usize) -> Vec<Place> {
    apart(places, many, |p| p.point, |p| p.depth * p.depth)
}

/// The first ones of a list that do not lie next to each other.
fn spread(list: &[Measured], many: usize, step: f64) -> Vec<&Measured> {
    apart(list.iter(), many, |m| m.2.point, |_| 4.0 * step * step)
}

/// Direction number `k` of `many` that are spread evenly over the sphere: a spiral with the golden angle.
fn spiral(k: usize, many: usize) -> Vector3<f64> {
    let z = 1.0 - (2 * k + 1) as f64 / many as f64;
    let angle = k as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    Vector3::new(r * angle.cos(), r * angle.sin(), z)
}

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
struct DeepPoint {
    /// The place [m].
    point: Vector3<f64>,
    /// The distance [m].
    depth: f64,
    /// The sphere's number in the index.
    sphere: u32,
}

impl Probe<'_> {
    /// The distance of `point` to the solid's surface [m], if it is more than `least`, no sphere contains the point, and
    /// none lies between it and the nearest point of that surface: what is closed in between spheres touches nothing.
    fn depth(&self, point: &Vector3<f64>, least: f64) -> Option<f64> {
        // In this order: most points lie in a sphere, and most of the others are near enough.
        if self.index.holds(point, self.tight) || self.tree.nearest(point, least).is_some() {
            return None;
        }
        let near = self.tree.closest(point);
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
    fn bottom_of(&self, mut pit: DeepPoint, known: &mut Vec<Vector3<f64>>) -> DeepPoint {
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
    fn deeper(&self, pit: &DeepPoint) -> Option<DeepPoint> {
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
        let look = |best: Option<DeepPoint>, point: Vector3<f64>, sphere: u32| {
            // Most corners lie in one of these.
            if others.iter().any(|(_, s)| holds(s, &point, self.tight)) {
                return best;
            }
            let least = best.map_or(pit.depth * (1.0 + 1e-9) + self.tight, |b| b.depth);
            self.depth(&point, least).map(|depth| DeepPoint { point, depth, sphere }).or(best)
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
    fn further(&self, pit: &DeepPoint, own: &Sphere) -> Option<DeepPoint> {
        let mut best = *pit;
        let mut turn = 0.5;
        for _ in 0..MOST_TURNS {
            let before = best.depth;
            for along in around(&((best.point - own.centre) / own.radius), turn) {
                let point = own.centre + along * own.radius;
                if let Some(depth) = self.depth(&point, best.depth * (1.0 + 1e-9) + self.tight) {
                    best = DeepPoint { point, depth, ..best };
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
            point = circle.towards(&(point - self.tree.closest(&point).point));
        }
        point
    }
}

/// The circle in which two spheres intersect.
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
        let surface = builtin::cuboid(Vector3::new(2.0, 2.0, 0.2));
        let tree = SurfaceTree::new(&surface);
        let (r, s) = (0.1_f64, 0.15_f64);
        let centre = |k: u32| {
            let angle = f64::from(k) * std::f64::consts::TAU / 3.0;
            Vector3::new(angle.cos(), angle.sin(), 0.0) * (s / 3.0_f64.sqrt())
        };
        let spheres: Vec<Sphere> = (0..3).map(|k| Sphere { centre: centre(k), radius: r }).collect();
        let effort = Effort { points: 0, starts: 0, steps: 0, pits: 0 };
        let probe = Probe { tight: 1e-12, ..Probe::new(&tree, &spheres, effort) };
        let start = spheres[0].centre + Vector3::new(-0.5, 0.0, 0.75_f64.sqrt()) * r;
        let depth = probe.depth(&start, 0.0).expect("nothing lies above it");
        let start = DeepPoint { point: start, depth, sphere: probe.index.nearest(&start).1 };
        let found = probe.bottom_of(start, &mut Vec::new());
        let exact = 0.1 - (r * r - s * s / 3.0).sqrt();
        assert!(depth < 0.5 * exact && (found.depth - exact).abs() < 1e-12, "{found:?}, {exact}");
    }
}
