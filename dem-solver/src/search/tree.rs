//! The tree over a rock's spheres in its own frame. With `shape::hull` the only module that names parry.

use crate::rock::Sphere;
use nalgebra::Vector3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};

/// Built once: a rigid cluster never changes in its own frame.
pub struct SphereTree {
    tree: Bvh,
}

impl SphereTree {
    /// The tree over `spheres`.
    pub fn new(spheres: &[Sphere]) -> Self {
        let leaves: Vec<Aabb> = spheres
            .iter()
            .map(|s| aabb(&s.centre.add_scalar(-s.radius), &s.centre.add_scalar(s.radius)))
            .collect();
        Self { tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves) }
    }

    /// Call `found` with the number of every sphere whose bounding box meets the box from `lowest`
    /// to `highest` [m], in no particular order. Allocates nothing.
    pub fn near(&self, lowest: &Vector3<f64>, highest: &Vector3<f64>, mut found: impl FnMut(u32)) {
        let query = aabb(lowest, highest);
        for sphere in self.tree.intersect_aabb(&query) {
            found(sphere);
        }
    }
}

fn aabb(lowest: &Vector3<f64>, highest: &Vector3<f64>) -> Aabb {
    Aabb::new(Vector::new(lowest.x, lowest.y, lowest.z), Vector::new(highest.x, highest.y, highest.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_finds_what_a_look_at_every_sphere_finds() {
        let sphere = |i: u32| {
            let at = |f: f64| (f64::from(i) * f).sin();
            Sphere { centre: Vector3::new(at(1.3), at(2.7), at(3.1)), radius: 0.02 + 0.01 * at(0.7).abs() }
        };
        for count in [1, 2, 3, 500] {
            let spheres: Vec<Sphere> = (0..count).map(sphere).collect();
            let tree = SphereTree::new(&spheres);
            let (lowest, highest) = (Vector3::new(-0.2, -0.6, -1.0), Vector3::new(0.7, 0.1, 1.0));
            let mut found = Vec::new();
            tree.near(&lowest, &highest, |k| found.push(k));
            found.sort_unstable();
            let meets = |s: &Sphere| {
                (0..3).all(|a| s.centre[a] + s.radius >= lowest[a] && s.centre[a] - s.radius <= highest[a])
            };
            let every: Vec<u32> = (0..count).filter(|k| meets(&spheres[*k as usize])).collect();
            assert_eq!(found, every);
        }
    }
}
