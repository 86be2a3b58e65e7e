//! Distances of places on a solid's surface to the spheres of a cluster and back, and where they are largest.

use super::index::SphereIndex;
use super::pits::{Pit, Pits};
use crate::geometry::sphere::around;
use crate::shape::tree::SurfaceTree;
use nalgebra::Vector3;

/// How much is sampled.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Most samples of the surface.
    pub samples: usize,
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
    /// How far they are apart [m].
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

/// Distances both ways [m], place [m] and direction into the solid of a sample.
pub type Measured = (f64, f64, Vector3<f64>, Vector3<f64>);

/// A solid's surface, the spheres that approximate it, and how much is sampled.
pub struct Probe<'a> {
    /// The solid's surface.
    pub tree: &'a SurfaceTree,
    /// The spheres.
    pub index: SphereIndex,
    /// Size of the solid [m].
    pub size: f64,
    /// How much is sampled.
    pub effort: Effort,
}

impl Probe<'_> {
    /// Distance of the sample to the cluster's surface, and of that to the true surface where the ray ends.
    pub fn at(&self, sample: &Vector3<f64>, inward: &Vector3<f64>) -> (f64, f64) {
        let (gap, sphere) = self.index.nearest(sample);
        let tight = 1e-9 * self.size;
        // A place on a ray of length t lies no further than t from the surface where the ray begins.
        let depth = |t: f64, along: &Vector3<f64>| {
            let near = self.tree.nearest(&(sample + along * t), t * (1.0 + 1e-9));
            near.map_or(t, |n| n.square.sqrt())
        };
        if gap > 0.0 {
            // A ray that no sphere stops leaves the solid at last: it says nothing.
            let end = self.index.entry(sample, inward, self.size);
            return (gap, end.map_or(gap, |t| depth(t, inward)));
        }
        let out = -inward;
        let t = self.exit(sample, &out, sphere);
        let arm = sample - self.index.sphere(sphere).centre;
        let short = arm.try_normalize(tight).map_or(t, |along| self.exit(sample, &along, sphere));
        (t.min(short), depth(t, &out))
    }

    /// Length of the ray from `from`, which lies in `sphere`, along `along` until it leaves all spheres [m].
    fn exit(&self, from: &Vector3<f64>, along: &Vector3<f64>, mut sphere: u32) -> f64 {
        let tight = 1e-9 * self.size;
        let mut t = 0.0;
        for _ in 0..80 {
            let s = self.index.sphere(sphere);
            let arm = from + along * t - s.centre;
            let away = arm.dot(along);
            t += -away + (away * away - arm.norm_squared() + s.radius * s.radius).max(0.0).sqrt();
            let (distance, next) = self.index.nearest(&(from + along * t));
            if distance >= -tight {
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
        for along in arm.try_normalize(1e-9 * self.size).into_iter().chain(starts) {
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

    /// The largest distances, sought from what was measured at samples about `step` [m] apart; a sphere reaches `outside`
    /// [m] out of the solid.
    pub fn largest(&self, mut measured: Vec<Measured>, step: f64, outside: f64) -> Largest {
        let most = |places: &[Place], least: f64| places.iter().map(|p| p.depth).fold(least, f64::max);
        measured.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut places = self.furthest(&measured, step);
        let there = most(&places, 0.0);
        measured.sort_by(|a, b| b.1.total_cmp(&a.1));
        let starts = spread(&measured, self.effort.starts, step).into_iter();
        let rays = starts
            .map(|m| self.uphill(m.2, m.3, step, |point, inward, _| self.at(point, inward).1))
            .collect();
        let found = [rays, self.deepest(&measured, step)].concat();
        let back = most(&found, outside);
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
            let distance = self.shortest(&m.2, &m.3, largest);
            largest = largest.max(distance);
            found.push((distance, m.1, m.2, m.3));
        }
        // Besides those that could be the largest: between samples it may be elsewhere.
        let near = &measured[found.len()..];
        let near = &near[..near.partition_point(|m| m.0 > NEARLY * largest)];
        for m in spread(near, self.effort.starts, step) {
            found.push((self.shortest(&m.2, &m.3, 0.0), m.1, m.2, m.3));
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        let place = |m: &Measured| Place { point: m.2, inward: m.3, depth: m.0 };
        let mut places: Vec<Place> = found.first().map(place).into_iter().collect();
        for m in spread(&found, self.effort.starts, step) {
            // A distance grows no faster than the sample moves.
            if m.0 + self.effort.steps as f64 * 1.5 * step > largest {
                let climbed = self.uphill(m.2, m.3, step, |p, inward, least| self.shortest(p, inward, least));
                largest = largest.max(climbed.depth);
                places.push(climbed);
            }
        }
        places
    }

    /// Where points of spheres, which lie in no other and are seen from the nearest point of the true surface, are furthest
    /// from that. `measured` begins with the deepest ends of rays.
    fn deepest(&self, measured: &[Measured], step: f64) -> Vec<Place> {
        let pits = Pits { tree: self.tree, index: &self.index, tight: 1e-9 * self.size };
        let most = self.effort.pits;
        let mut found: Vec<Pit> = Vec::new();
        let many = (self.effort.points / self.index.count() as usize).clamp(LEAST_POINTS, MOST_POINTS);
        for number in 0..self.index.count() {
            let sphere = self.index.sphere(number);
            let mut deepest = if found.len() < most { 0.0 } else { found[most - 1].depth };
            // One of each sphere: else all would lie around one place.
            let mut best = None;
            for k in 0..many {
                let point = sphere.centre + spiral(k, many) * sphere.radius;
                if let Some(depth) = pits.depth(&point, deepest) {
                    deepest = depth;
                    best = Some(Pit { point, depth, sphere: number });
                }
            }
            found.extend(best);
            if found.len() > 2 * most || number + 1 == self.index.count() {
                found.sort_by(|a, b| b.depth.total_cmp(&a.depth));
                found.truncate(most);
            }
        }
        let rays = spread(measured, most, step).into_iter().filter_map(|m| {
            let point = m.2 + m.3 * self.index.entry(&m.2, &m.3, self.size)?;
            let depth = pits.depth(&point, 0.0)?;
            Some(Pit { point, depth, sphere: self.index.nearest(&point).1 })
        });
        found.extend(rays.collect::<Vec<_>>());
        found.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        let mut known = Vec::new();
        let place = |pit: Pit| {
            let point = self.tree.nearest(&pit.point, f64::INFINITY)?.point;
            let inward = (pit.point - point).try_normalize(pits.tight)?;
            Some(Place { point, inward, depth: pit.depth })
        };
        found.into_iter().filter_map(|pit| place(pits.deepest(pit, &mut known))).collect()
    }

    /// Where the largest value is that small steps along the surface find from a sample.
    fn uphill(
        &self,
        mut point: Vector3<f64>,
        mut inward: Vector3<f64>,
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
                let Some(near) = self.tree.nearest(&(point + direction * step), f64::INFINITY) else {
                    continue;
                };
                let normal = -self.tree.normal(&near).normalize();
                let found = value(&near.point, &normal, best);
                if found > best {
                    (best, point, inward, moved) = (found, near.point, normal, true);
                }
            }
            if !moved {
                step *= 0.5;
                if step < 1e-7 * self.size {
                    break;
                }
            }
        }
        Place { point, inward, depth: best }
    }
}

/// The worst ones of places that begin with them, at most about `many`, none within its own depth of a worse one.
pub fn apart<'a>(places: impl IntoIterator<Item = &'a Place>, many: f64) -> Vec<Place> {
    let mut chosen: Vec<Place> = Vec::new();
    for place in places {
        if chosen.len() as f64 >= many {
            break;
        }
        if chosen.iter().all(|c| (c.point - place.point).norm_squared() > place.depth * place.depth) {
            chosen.push(*place);
        }
    }
    chosen
}

/// The first ones of a list that do not lie next to each other.
fn spread(list: &[Measured], many: usize, step: f64) -> Vec<&Measured> {
    let mut chosen: Vec<&Measured> = Vec::new();
    for m in list {
        if chosen.len() == many {
            break;
        }
        if chosen.iter().all(|c| (c.2 - m.2).norm_squared() > 4.0 * step * step) {
            chosen.push(m);
        }
    }
    chosen
}

/// Direction number `k` of `many` that are spread evenly over the sphere: a spiral with the golden angle.
fn spiral(k: usize, many: usize) -> Vector3<f64> {
    let z = 1.0 - (2 * k + 1) as f64 / many as f64;
    let angle = k as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    Vector3::new(r * angle.cos(), r * angle.sin(), z)
}
