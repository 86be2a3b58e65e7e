//! How far a cluster's surface and the true surface lie apart, both ways.
//!
//! From every sample of the true surface a ray runs along the normal to the surface of the cluster:
//! inwards where the sample lies outside of all spheres, outwards where it lies inside of one.
//!
//! - surface to spheres: the distance of the sample to the nearest sphere (outside), or to the end of a ray (inside
//!   of a sphere): the shorter one of the ray along the normal and that from the sphere's centre, and for
//!   the largest ones the shortest of all directions (`Probe::shortest`) - along the normal of a rough
//!   surface a ray may run through spheres for long
//! - spheres to surface: the distance of the end of the normal's ray to the true surface; besides, for each sphere,
//!   how far it reaches out of the solid (exact where nothing else is nearer: radius plus signed depth of the
//!   centre), and the distance of points of it that are seen from the surface
//!
//! Means are weighted with the area of the samples; the largest ones are improved by small steps uphill.

use super::index::SphereIndex;
use super::pits::{Pit, Pits};
use super::samples::{self, Sizes};
use crate::rock::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;
use nalgebra::Vector3;
use std::fmt;

/// How much is looked at.
#[derive(Clone, Copy)]
struct Effort {
    /// Most samples of the surface.
    samples: usize,
    /// Points on all spheres.
    points: usize,
    /// Samples from which the largest errors are sought, and steps from each.
    starts: usize,
    steps: usize,
}

const FULL: Effort = Effort { samples: 150_000, points: 200_000, starts: 48, steps: 30 };
/// Where clusters are compared.
const ROUGH: Effort = Effort { samples: 20_000, points: 25_000, starts: 8, steps: 8 };

/// What share of the largest error samples must have for one that is larger to be sought beside them.
const NEARLY: f64 = 0.7;
/// Samples for each sphere of very many, so that none is missed.
const SAMPLES_EACH: usize = 30;
/// Points on one sphere, least and most.
const LEAST_POINTS: usize = 30;
const MOST_POINTS: usize = 400;
/// Places from which the deepest one between spheres is sought.
const PITS: usize = 64;

/// Columns along each side with which the volume is compared: few where many spheres fill them.
const COLUMNS: usize = 256;
const FEW_COLUMNS: usize = 128;
const MANY_SPHERES: usize = 4000;

/// A mean and a largest distance [m].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Spread {
    /// Mean [m].
    pub mean: f64,
    /// Largest [m].
    pub max: f64,
}

/// The error of a cluster.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Accuracy {
    /// From the true surface to the surface of the cluster.
    pub surface_to_spheres: Spread,
    /// From the surface of the cluster to the true surface.
    pub spheres_to_surface: Spread,
    /// Furthest that a sphere reaches out of the solid [m].
    pub outside: f64,
    /// Volume of all spheres together over that of the solid, minus 1.
    pub volume: f64,
}

impl Accuracy {
    /// Of `spheres` (at least one) that approximate the solid inside `surface`.
    pub fn of(surface: &Surface, spheres: &[Sphere]) -> Self {
        let samples = FULL.samples.max(SAMPLES_EACH * spheres.len());
        Self::measured(surface, spheres, Effort { samples, ..FULL })
    }

    /// The same with fewer samples, in a fraction of the time: to compare clusters.
    pub fn roughly(surface: &Surface, spheres: &[Sphere]) -> Self {
        Self::measured(surface, spheres, ROUGH)
    }

    fn measured(surface: &Surface, spheres: &[Sphere], effort: Effort) -> Self {
        let tree = SurfaceTree::new(surface);
        let size = surface.size();
        let scene = Probe { tree: &tree, index: SphereIndex::new(spheres), size, effort };
        let outside = spheres.iter().map(|s| s.radius + tree.signed(&s.centre).0).fold(0.0, f64::max);
        let mut sizes = Sizes::new(&tree, size);
        let mut corners =
            |error| samples::corners(surface, &mut sizes, error, 0.9, effort.samples + surface.points.len());
        let mut error = 0.1 * size;
        let mut points = corners(error);
        // Samples as dense as the error found with coarser ones asks for.
        for _ in 0..3 {
            let Some(coarse) = &points else { break };
            let found = coarse.points.iter().map(|p| scene.index.nearest(p).0.abs()).fold(0.0, f64::max);
            let finer = found.max(1e-6 * size);
            if finer >= error {
                break;
            }
            match corners(finer) {
                Some(fine) => points = Some(fine),
                None => break,
            }
            error = finer;
        }
        let points = points.unwrap_or_default();
        let (middles, areas) = middles(surface, &mut sizes, error, effort.samples);
        let (mut there, mut back) = (Spread::default(), Spread::default());
        let total: f64 = areas.iter().sum();
        let mut measured: Vec<Measured> = Vec::new();
        for (k, area) in areas.iter().enumerate() {
            let (a, b) = scene.at(&middles.points[k], &middles.inward[k]);
            there.mean += a * area / total;
            back.mean += b * area / total;
            measured.push((a, b, middles.points[k], middles.inward[k]));
        }
        for (p, inward) in points.points.iter().zip(&points.inward) {
            let (a, b) = scene.at(p, inward);
            measured.push((a, b, *p, *inward));
        }
        let step = (total / measured.len() as f64).sqrt();
        measured.sort_by(|a, b| b.0.total_cmp(&a.0));
        there.max = scene.furthest(&measured, step);
        measured.sort_by(|a, b| b.1.total_cmp(&a.1));
        back.max = spread(&measured, effort.starts, step)
            .into_iter()
            .map(|m| scene.uphill(m.2, m.3, step, |point, inward, _| scene.at(point, inward).1))
            .fold(outside, f64::max);
        back.max = scene.deepest(&measured, step, back.max);
        let columns = if spheres.len() > MANY_SPHERES { FEW_COLUMNS } else { COLUMNS };
        let volume = super::volume::excess(surface, spheres, columns);
        Self { surface_to_spheres: there, spheres_to_surface: back, outside, volume }
    }

    /// The largest distance of all [m].
    pub fn largest(&self) -> f64 {
        self.surface_to_spheres.max.max(self.spheres_to_surface.max)
    }
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "surface to spheres {:.3e} m (mean) {:.3e} m (largest), spheres to surface {:.3e} m and {:.3e} m, \
             {:.3e} m outside at most, volume {:+.3} %",
            self.surface_to_spheres.mean,
            self.surface_to_spheres.max,
            self.spheres_to_surface.mean,
            self.spheres_to_surface.max,
            self.outside,
            100.0 * self.volume
        )
    }
}

fn middles(surface: &Surface, sizes: &mut Sizes, error: f64, most: usize) -> (samples::Samples, Vec<f64>) {
    let mut coarse = error;
    loop {
        if let Some(found) = samples::middles(surface, sizes, coarse, 0.9, most + surface.triangles.len()) {
            return found;
        }
        coarse *= 1.5;
    }
}

/// Distances both ways [m], place [m] and direction into the solid of a sample.
type Measured = (f64, f64, Vector3<f64>, Vector3<f64>);

struct Probe<'a> {
    tree: &'a SurfaceTree,
    index: SphereIndex,
    size: f64,
    effort: Effort,
}

impl Probe<'_> {
    /// Distance of the sample to the cluster's surface, and of that to the true surface where the ray ends.
    fn at(&self, sample: &Vector3<f64>, inward: &Vector3<f64>) -> (f64, f64) {
        let (gap, sphere) = self.index.nearest(sample);
        let tight = 1e-9 * self.size;
        let depth = |p: &Vector3<f64>| self.tree.nearest(p, f64::INFINITY).map_or(0.0, |n| n.square.sqrt());
        if gap > 0.0 {
            // A ray that no sphere stops leaves the solid at last: it says nothing.
            return (gap, self.end(sample, inward).map_or(gap, |end| depth(&end)));
        }
        let out = -inward;
        let t = self.exit(sample, &out, sphere);
        let arm = sample - self.index.sphere(sphere).centre;
        let short = arm.try_normalize(tight).map_or(t, |along| self.exit(sample, &along, sphere));
        (t.min(short), depth(&(sample + out * t)))
    }

    /// Where the ray from a sample outside of all spheres enters the first one.
    fn end(&self, sample: &Vector3<f64>, inward: &Vector3<f64>) -> Option<Vector3<f64>> {
        let mut t = 0.0;
        // As far as no sphere can be, again and again.
        for _ in 0..80 {
            let point = sample + inward * t;
            let distance = self.index.nearest(&point).0;
            if distance <= 1e-9 * self.size {
                return Some(point);
            }
            t += distance;
            if t > self.size {
                break;
            }
        }
        None
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

    /// The largest distance from the true surface to that of the cluster; samples begin with the largest estimates.
    fn furthest(&self, measured: &[Measured], step: f64) -> f64 {
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
        for m in spread(&found, self.effort.starts, step) {
            // A distance grows no faster than the sample moves.
            if m.0 + self.effort.steps as f64 * 1.5 * step > largest {
                let climbed = self.uphill(m.2, m.3, step, |p, inward, least| self.shortest(p, inward, least));
                largest = largest.max(climbed);
            }
        }
        largest
    }

    /// The largest distance to the true surface of points of spheres that lie in no other and are seen from the
    /// nearest point of that surface; at least `least` [m]. `measured` begins with the deepest ends of rays.
    fn deepest(&self, measured: &[Measured], step: f64, least: f64) -> f64 {
        let spheres = self.index.count();
        let pits = Pits { tree: self.tree, index: &self.index, tight: 1e-9 * self.size };
        let mut found: Vec<Pit> = Vec::new();
        let many = (self.effort.points / spheres as usize).clamp(LEAST_POINTS, MOST_POINTS);
        for number in 0..spheres {
            let sphere = self.index.sphere(number);
            for k in 0..many {
                let point = sphere.centre + spiral(k, many) * sphere.radius;
                let least = if found.len() < PITS { 0.0 } else { found[PITS - 1].depth };
                if let Some(depth) = pits.depth(&point, least) {
                    found.push(Pit { point, depth, sphere: number });
                }
            }
            if found.len() > 2 * PITS || number + 1 == spheres {
                found.sort_by(|a, b| b.depth.total_cmp(&a.depth));
                found.truncate(PITS);
            }
        }
        let rays = spread(measured, PITS, step).into_iter().filter_map(|m| {
            let point = self.end(&m.2, &m.3)?;
            let depth = pits.depth(&point, 0.0)?;
            Some(Pit { point, depth, sphere: self.index.nearest(&point).1 })
        });
        found.extend(rays.collect::<Vec<_>>());
        found.into_iter().map(|pit| pits.deepest(pit).depth).fold(least, f64::max)
    }

    /// The largest value that is found by small steps along the surface from a sample.
    fn uphill(
        &self,
        mut point: Vector3<f64>,
        mut inward: Vector3<f64>,
        mut step: f64,
        value: impl Fn(&Vector3<f64>, &Vector3<f64>, f64) -> f64,
    ) -> f64 {
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
        best
    }
}

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

/// Samples among which the worst places are sought.
const ENOUGH: usize = 100_000;

/// The places, at most `many`, where `spheres` leave the surface of `tree` furthest, as rays from samples outside of all
/// spheres find them; none within its own depth of a worse one.
pub fn worst(tree: &SurfaceTree, samples: &samples::Samples, spheres: &[Sphere], many: usize) -> Vec<Place> {
    let (lowest, highest) = bounds(&samples.points);
    let scene =
        Probe { tree, index: SphereIndex::new(spheres), size: (highest - lowest).norm(), effort: ROUGH };
    let mut found: Vec<Place> = Vec::new();
    let step = (samples.points.len() / ENOUGH).max(1);
    for (point, inward) in samples.points.iter().zip(&samples.inward).step_by(step) {
        if scene.index.nearest(point).0 > 0.0 {
            let (gap, back) = scene.at(point, inward);
            found.push(Place { point: *point, inward: *inward, depth: gap.max(back) });
        }
    }
    found.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    let mut chosen: Vec<Place> = Vec::new();
    for place in found {
        if chosen.len() == many {
            break;
        }
        if chosen.iter().all(|c| (c.point - place.point).norm_squared() > place.depth * place.depth) {
            chosen.push(place);
        }
    }
    chosen
}

fn bounds(points: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let none = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    points.iter().fold(none, |(low, high), p| (low.inf(p), high.sup(p)))
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

/// Eight directions at the angle `turn` [rad] from `along`.
pub fn around(along: &Vector3<f64>, turn: f64) -> [Vector3<f64>; 8] {
    let side = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize();
    let other = along.cross(&side);
    std::array::from_fn(|k| {
        let angle = k as f64 * std::f64::consts::FRAC_PI_4;
        along * turn.cos() + (side * angle.cos() + other * angle.sin()) * turn.sin()
    })
}

/// Direction number `k` of `many` that are spread evenly over the sphere: a spiral with the golden angle.
fn spiral(k: usize, many: usize) -> Vector3<f64> {
    let z = 1.0 - (2 * k + 1) as f64 / many as f64;
    let angle = k as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    Vector3::new(r * angle.cos(), r * angle.sin(), z)
}
