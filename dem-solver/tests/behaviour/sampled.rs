//! The largest distance between a solid's surface and the union of a cluster's spheres, as points sampled on both
//! show it: points on a grid, then finer ones around the furthest. Distances to triangles by a library, to spheres by a
//! look at every one.

use dem_solver::geometry::sphere::Sphere;
use dem_solver::shape::Surface;
use nalgebra::Vector3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;

/// Points on all spheres, at least so many on each, and points of the solid's surface.
const ON_SPHERES: usize = 200_000;
const ON_EACH: usize = 12;
const ON_SURFACE: usize = 8000;
/// Points around which finer ones are taken, how many, and how often.
const FURTHEST: usize = 40;
const AROUND: usize = 60;
const LEVELS: usize = 7;

/// Largest distances as sampled [m], neither of which is more than the true one.
#[derive(Debug, Clone, Copy)]
pub struct Sampled {
    /// From the solid's surface, where it lies outside of all spheres, to the nearest sphere.
    pub there: f64,
    /// From points of spheres that lie in no other to the solid's surface, if nothing lies between them, or if a ray along
    /// a normal of the surface ends there: what is closed in between spheres touches nothing.
    pub back: f64,
}

impl Sampled {
    /// Of a cluster of a solid.
    pub fn of(surface: &Surface, spheres: &[Sphere]) -> Self {
        let sampler = Sampler::new(surface, spheres);
        let there = sampler.over_surface(|p, _| sampler.gap(p));
        let rays = sampler.over_surface(|p, inward| sampler.pit(p, inward));
        Self { there, back: sampler.back().max(rays) }
    }

    /// The larger one [m].
    pub fn largest(&self) -> f64 {
        self.there.max(self.back)
    }
}

struct Sampler<'a> {
    surface: &'a Surface,
    mesh: TriMesh,
    spheres: &'a [Sphere],
    /// The spheres that overlap each.
    neighbours: Vec<Vec<u32>>,
}

/// Point number `k` of `many` on the unit sphere: rings of equal height have equal areas.
fn on_ball(k: usize, many: usize) -> Vector3<f64> {
    let z = 1.0 - (2 * k + 1) as f64 / many as f64;
    let angle = 2.399_963 * k as f64;
    let r = (1.0 - z * z).sqrt();
    Vector3::new(r * angle.cos(), r * angle.sin(), z)
}

impl<'a> Sampler<'a> {
    fn new(surface: &'a Surface, spheres: &'a [Sphere]) -> Self {
        let points = surface.points.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
        let mesh = TriMesh::new(points, surface.triangles.clone()).expect("a mesh");
        let mut neighbours = vec![Vec::new(); spheres.len()];
        for (i, a) in spheres.iter().enumerate() {
            for (j, b) in spheres.iter().enumerate().skip(i + 1) {
                if (a.centre - b.centre).norm_squared() < (a.radius + b.radius).powi(2) {
                    neighbours[i].push(j as u32);
                    neighbours[j].push(i as u32);
                }
            }
        }
        Self { surface, mesh, spheres, neighbours }
    }

    fn nearest(&self, p: &Vector3<f64>) -> Vector3<f64> {
        let found = self.mesh.project_local_point(Vector::new(p.x, p.y, p.z), false).point;
        Vector3::new(found.x, found.y, found.z)
    }

    /// Whether a point of sphere `own` lies in no other.
    fn bare(&self, p: &Vector3<f64>, own: usize) -> bool {
        self.neighbours[own].iter().all(|k| {
            let s = &self.spheres[*k as usize];
            (p - s.centre).norm_squared() >= s.radius * s.radius
        })
    }

    /// Whether no sphere lies between a point of sphere `own` and another point.
    fn free(&self, from: &Vector3<f64>, to: &Vector3<f64>, own: usize) -> bool {
        let line = to - from;
        if line.dot(&(from - self.spheres[own].centre)) < 0.0 {
            return false;
        }
        self.spheres.iter().enumerate().filter(|(k, _)| *k != own).all(|(_, s)| {
            let share = (line.dot(&(s.centre - from)) / line.norm_squared()).clamp(0.0, 1.0);
            (from + line * share - s.centre).norm() >= s.radius
        })
    }

    fn gap(&self, p: &Vector3<f64>) -> f64 {
        self.spheres.iter().map(|s| (p - s.centre).norm() - s.radius).fold(f64::INFINITY, f64::min)
    }

    /// How far the first sphere that a ray from `p` enters lies from the solid's surface.
    fn pit(&self, p: &Vector3<f64>, inward: &Vector3<f64>) -> f64 {
        let enters = |s: &Sphere| {
            let arm = s.centre - p;
            let along = arm.dot(inward);
            let square = along * along - arm.norm_squared() + s.radius * s.radius;
            // Of a sample inside of a sphere no ray is asked for.
            if arm.norm_squared() < s.radius * s.radius {
                Some(0.0)
            } else {
                (square > 0.0 && along > 0.0).then(|| along - square.sqrt())
            }
        };
        let first = self.spheres.iter().filter_map(enters).fold(f64::INFINITY, f64::min);
        let end = p + inward * first;
        if first > 0.0 && first.is_finite() { (self.nearest(&end) - end).norm() } else { 0.0 }
    }

    /// The largest value of points of the solid's surface, each with its direction into the solid.
    fn over_surface(&self, value: impl Fn(&Vector3<f64>, &Vector3<f64>) -> f64) -> f64 {
        let total: f64 = (0..self.surface.triangles.len()).map(|t| self.surface.area(t)).sum();
        let place = |(t, share): &(usize, [f64; 2])| {
            let [a, b, c] = self.surface.corners(*t);
            a + (b - a) * share[0] + (c - a) * share[1]
        };
        let apart = (total / ON_SURFACE as f64).sqrt();
        let mut found = Vec::new();
        for t in 0..self.surface.triangles.len() {
            let [a, b, c] = self.surface.corners(t);
            let rows = (self.surface.area(t) / total * ON_SURFACE as f64).sqrt().ceil().max(1.0) as usize;
            for i in 0..=rows {
                for j in 0..=rows - i {
                    let share = [i as f64 / rows as f64, j as f64 / rows as f64];
                    let p = a + (b - a) * share[0] + (c - a) * share[1];
                    found.push((value(&p, &-self.surface.normal(t)), (t, share)));
                }
            }
            keep_furthest(&mut found, place, apart);
        }
        let mut size = apart;
        for _ in 0..LEVELS {
            for at in 0..found.len() {
                let (_, (t, share)) = found[at];
                let [a, b, c] = self.surface.corners(t);
                let steps = [size / (b - a).norm(), size / (c - a).norm()];
                for k in 0..AROUND {
                    let move_by = on_ball(k, AROUND);
                    let u = (share[0] + steps[0] * move_by.x).clamp(0.0, 1.0);
                    let v = (share[1] + steps[1] * move_by.y).clamp(0.0, 1.0 - u);
                    found.push((value(&place(&(t, [u, v])), &-self.surface.normal(t)), (t, [u, v])));
                }
            }
            keep_furthest(&mut found, place, 0.1 * apart);
            size *= 0.5;
        }
        found.first().map_or(0.0, |f| f.0.max(0.0))
    }

    /// Distance of a point of sphere `own` to the solid's surface, if it lies in no other sphere and nothing between.
    fn depth(&self, p: &Vector3<f64>, own: usize, least: f64) -> Option<f64> {
        if !self.bare(p, own) {
            return None;
        }
        let touch = self.nearest(p);
        let distance = (touch - p).norm();
        (distance > least && self.free(p, &touch, own)).then_some(distance)
    }

    fn back(&self) -> f64 {
        let many = (ON_SPHERES / self.spheres.len()).clamp(ON_EACH, 2000);
        let place = |(own, along): &(usize, Vector3<f64>)| {
            self.spheres[*own].centre + along * self.spheres[*own].radius
        };
        let mut found: Vec<(f64, (usize, Vector3<f64>))> = Vec::new();
        let mut least = 0.0;
        for (own, sphere) in self.spheres.iter().enumerate() {
            for k in 0..many {
                let along = on_ball(k, many);
                if let Some(depth) = self.depth(&(sphere.centre + along * sphere.radius), own, least) {
                    found.push((depth, (own, along)));
                }
            }
            if found.len() > 20 * FURTHEST || own + 1 == self.spheres.len() {
                keep_furthest(&mut found, place, 0.1 * sphere.radius);
                least = if found.len() < FURTHEST { 0.0 } else { found[FURTHEST - 1].0 };
            }
        }
        let mut size = (12.0 / many as f64).sqrt();
        for _ in 0..LEVELS {
            for at in 0..found.len() {
                let (least, (own, along)) = found[at];
                for k in 0..AROUND {
                    let turned = (along + on_ball(k, AROUND) * size).normalize();
                    let p = self.spheres[own].centre + turned * self.spheres[own].radius;
                    if let Some(depth) = self.depth(&p, own, least) {
                        found.push((depth, (own, turned)));
                    }
                }
            }
            let least =
                found.iter().map(|(_, (own, _))| self.spheres[*own].radius).fold(f64::INFINITY, f64::min);
            keep_furthest(&mut found, place, 0.1 * least);
            size *= 0.6;
        }
        found.first().map_or(0.0, |f| f.0)
    }
}

/// The furthest ones of a list, none within `apart` [m] of another.
fn keep_furthest<T>(found: &mut Vec<(f64, T)>, place: impl Fn(&T) -> Vector3<f64>, apart: f64) {
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<Vector3<f64>> = Vec::new();
    found.retain(|(_, at)| {
        let p = place(at);
        let new = kept.len() < FURTHEST && kept.iter().all(|k| (k - p).norm() > apart);
        if new {
            kept.push(p);
        }
        new
    });
}
