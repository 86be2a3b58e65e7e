//! What samples see of the spheres of a cluster while spheres are added to it: only what an added one changes is computed
//! again.

use super::index::{SphereIndex, entry};
use super::probe::{Place, apart};
use super::samples::Samples;
use crate::geometry::sphere::Sphere;
use crate::shape::tree::SurfaceTree;

/// Samples among which the worst places are sought.
const ENOUGH: usize = 100_000;

/// A sample outside of all spheres.
struct SeenPlace {
    place: Place,
    /// Distance to the nearest sphere [m], and along the ray into the solid to the first one that it enters.
    gap: f64,
    ray: f64,
}

/// The samples outside of all spheres so far.
pub struct ViewOfSurface<'a> {
    tree: &'a SurfaceTree,
    seen: Vec<SeenPlace>,
}

impl<'a> ViewOfSurface<'a> {
    /// What `samples` of the surface of `tree` see of `spheres`.
    pub fn new(tree: &'a SurfaceTree, samples: &Samples, spheres: &[Sphere]) -> Self {
        let index = SphereIndex::new(spheres);
        let mut view = Self { tree, seen: Vec::new() };
        let step = (samples.points.len() / ENOUGH).max(1);
        for (point, inward) in samples.points.iter().zip(&samples.inward).step_by(step) {
            let gap = index.nearest(point).0;
            if gap > 0.0 {
                let ray = index.entry(point, inward, f64::INFINITY).unwrap_or(f64::INFINITY);
                let place = Place { point: *point, inward: *inward, depth: 0.0 };
                view.seen.push(SeenPlace { place, gap, ray });
            }
        }
        view.seen.iter_mut().for_each(|s| s.measure(tree));
        view
    }

    /// Spheres more.
    pub fn add(&mut self, spheres: &[Sphere]) {
        for seen in &mut self.seen {
            let before = (seen.gap, seen.ray);
            for sphere in spheres {
                let gap = (seen.place.point - sphere.centre).norm() - sphere.radius;
                // A sphere that the ray enters within its length lies no further from the sample than that.
                if gap < seen.gap.max(seen.ray) {
                    seen.gap = seen.gap.min(gap);
                    let ray = entry(sphere, &seen.place.point, &seen.place.inward);
                    seen.ray = ray.map_or(seen.ray, |t| t.min(seen.ray));
                }
            }
            if (seen.gap, seen.ray) != before && seen.gap > 0.0 {
                seen.measure(self.tree);
            }
        }
        self.seen.retain(|s| s.gap > 0.0);
    }

    /// The places, at most `many`, where the spheres leave the surface furthest; none within its own depth of a worse one.
    pub fn worst(&mut self, many: usize) -> Vec<Place> {
        self.seen.sort_by(|a, b| b.place.depth.total_cmp(&a.place.depth));
        apart(self.seen.iter().map(|s| &s.place), many as f64)
    }
}

impl SeenPlace {
    /// The depth: the distance to the nearest sphere, or if it is more that of the ray's end to the surface. A ray that
    /// enters no sphere says nothing.
    fn measure(&mut self, tree: &SurfaceTree) {
        let end = self.place.point + self.place.inward * self.ray;
        let back = if self.ray.is_finite() {
            tree.nearest(&end, self.ray * (1.0 + 1e-9)).map_or(self.ray, |n| n.square.sqrt())
        } else {
            0.0
        };
        self.place.depth = self.gap.max(back);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cluster::samples::{Sizes, corners};
    use crate::shape::builtin;
    use nalgebra::Vector3;

    /// Added one after the other, or there from the beginning: the same places.
    #[test]
    fn what_is_seen_of_added_spheres_is_what_is_seen_of_all() {
        let surface = builtin::cuboid(Vector3::new(1.0, 0.8, 0.6));
        let tree = SurfaceTree::new(&surface);
        let samples = corners(&surface, &mut Sizes::new(&surface, &tree), 0.05, 0.4, 100_000).expect("fewer");
        let at = |i: u32, f: f64| 0.4 * (f64::from(i) * f).sin();
        let spheres: Vec<Sphere> = (0..12)
            .map(|i| {
                let centre = Vector3::new(at(i, 1.3), 0.8 * at(i, 2.7), 0.6 * at(i, 3.1));
                Sphere { centre, radius: 0.01 - tree.signed(&centre).0 }
            })
            .collect();
        let mut added = ViewOfSurface::new(&tree, &samples, &spheres[..3]);
        spheres[3..].chunks(2).for_each(|some| added.add(some));
        let mut all = ViewOfSurface::new(&tree, &samples, &spheres);
        let depths = |view: &mut ViewOfSurface| view.worst(20).iter().map(|p| p.depth).collect::<Vec<_>>();
        let found = depths(&mut added);
        assert!(found.len() == 20 && found[0] > 0.01);
        assert_eq!(found, depths(&mut all));
    }
}
