//! How far a cluster's surface and the true surface lie apart, both ways.
//!
//! From every sample of the true surface a ray runs along the normal to the surface of the cluster:
//! inwards where the sample lies outside of all spheres, outwards where it lies inside of one.
//!
//! - surface to spheres: the distance of the sample to the nearest sphere (outside), or to the end of the ray
//! - spheres to surface: the distance of the end of the ray to the true surface; besides, for each sphere,
//!   how far it reaches out of the solid (exact where nothing else is nearer: radius plus signed depth of the centre)
//!
//! Means are weighted with the area of the samples; the largest ones are improved by walking uphill.

use super::index::SphereIndex;
use super::samples::{self, Sizes};
use crate::rock::Sphere;
use crate::shape::Surface;
use crate::shape::tree::SurfaceTree;
use nalgebra::Vector3;
use std::fmt;

/// Most samples of the measurement.
const MOST_SAMPLES: usize = 150_000;
/// Samples from which the largest errors are sought.
const WALKERS: usize = 24;

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
    /// Of `spheres` (at least one) that stand for the solid inside `surface`.
    pub fn of(surface: &Surface, spheres: &[Sphere]) -> Self {
        let tree = SurfaceTree::new(surface);
        let size = surface.size();
        let scene = Probe { tree: &tree, index: SphereIndex::new(spheres), size };
        let outside = spheres.iter().map(|s| s.radius + tree.signed(&s.centre).0).fold(0.0, f64::max);
        let mut sizes = Sizes::new(&tree, size);
        let mut corners =
            |error| samples::corners(surface, &mut sizes, error, 0.9, MOST_SAMPLES + surface.points.len());
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
        let (middles, areas) = middles(surface, &mut sizes, error);
        let (mut there, mut back) = (Spread::default(), Spread::default());
        let total: f64 = areas.iter().sum();
        let mut measured: Vec<(f64, f64, Vector3<f64>, Vector3<f64>)> = Vec::new();
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
        for way in 0..2 {
            let value = |m: &(f64, f64, Vector3<f64>, Vector3<f64>)| if way == 0 { m.0 } else { m.1 };
            measured.sort_by(|a, b| value(b).total_cmp(&value(a)));
            let largest = measured
                .iter()
                .take(WALKERS)
                .map(|m| scene.uphill(m.2, m.3, step, |ab| if way == 0 { ab.0 } else { ab.1 }))
                .fold(0.0, f64::max);
            if way == 0 { there.max = largest } else { back.max = largest.max(outside) }
        }
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

fn middles(surface: &Surface, sizes: &mut Sizes, error: f64) -> (samples::Samples, Vec<f64>) {
    let mut coarse = error;
    loop {
        if let Some(found) =
            samples::middles(surface, sizes, coarse, 0.9, MOST_SAMPLES + surface.triangles.len())
        {
            return found;
        }
        coarse *= 1.5;
    }
}

struct Probe<'a> {
    tree: &'a SurfaceTree,
    index: SphereIndex,
    size: f64,
}

impl Probe<'_> {
    /// Distance of the sample to the cluster's surface, and of that to the true surface where the ray ends.
    fn at(&self, sample: &Vector3<f64>, inward: &Vector3<f64>) -> (f64, f64) {
        let (gap, mut sphere) = self.index.nearest(sample);
        let tight = 1e-9 * self.size;
        let depth = |p: &Vector3<f64>| self.tree.nearest(p, f64::INFINITY).map_or(0.0, |n| n.square.sqrt());
        let (mut t, mut distance) = (0.0, gap);
        if gap > 0.0 {
            // As far as nothing can be met, again and again.
            for _ in 0..80 {
                t += distance;
                distance = self.index.nearest(&(sample + inward * t)).0;
                if distance <= tight || t > self.size {
                    break;
                }
            }
            // A ray that meets no sphere leaves the solid at last: it tells nothing.
            let end = sample + inward * t;
            let back = if distance <= tight { depth(&end) } else { gap };
            return (gap, back);
        }
        let spheres = &self.index;
        for _ in 0..80 {
            let point = sample - inward * t;
            let s = spheres.sphere(sphere);
            let arm = point - s.centre;
            let along = -arm.dot(inward);
            t += -along + (along * along - arm.norm_squared() + s.radius * s.radius).max(0.0).sqrt();
            (distance, sphere) = spheres.nearest(&(sample - inward * t));
            if distance >= -tight {
                break;
            }
        }
        (t, depth(&(sample - inward * t)))
    }

    /// The largest value that is found by small steps along the surface from a sample.
    fn uphill(
        &self,
        mut point: Vector3<f64>,
        mut inward: Vector3<f64>,
        mut step: f64,
        value: impl Fn((f64, f64)) -> f64,
    ) -> f64 {
        let mut best = value(self.at(&point, &inward));
        for _ in 0..30 {
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
                let found = value(self.at(&near.point, &normal));
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
