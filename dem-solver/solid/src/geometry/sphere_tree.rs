//! The tree over a rock's spheres in its own frame.

use crate::geometry::box_tree::{Bounds, BoxTree, morton_order};
use crate::geometry::sphere::Sphere;
use crate::geometry::triangle::Face;
use nalgebra::Vector3;

/// Built once: a rigid cluster never changes in its own frame.
#[derive(Debug, Clone)]
pub struct SphereTree {
    tree: BoxTree,
    /// The spheres in the tree's order, and their numbers in the rock.
    spheres: Vec<(Sphere, u32)>,
    /// Distance of their furthest point from the centre of mass [m].
    pub reach: f64,
}

/// A triangle in the rock's own frame, with what leaves boxes out.
#[derive(Debug, Clone, Copy)]
pub struct Slab {
    bounds: [Vector3<f64>; 2],
    start: Vector3<f64>,
    /// Unit normal; zero for a triangle without area, which its box alone then bounds.
    normal: Vector3<f64>,
}

impl Slab {
    /// Of a face.
    #[inline]
    pub fn new(face: &Face) -> Self {
        let [a, b, c] = face.corners();
        Self { bounds: [a.inf(&b).inf(&c), a.sup(&b).sup(&c)], start: a, normal: face.normal }
    }

    /// Of a box from its middle and half edges [m]: how high its middle lies over the plane, how far it reaches from there along the normal,
    /// and how far it lies beside the box around the triangle.
    #[inline(always)]
    pub fn clearance(&self, (middle, half): (Vector3<f64>, Vector3<f64>)) -> [f64; 3] {
        let [lowest, highest] = &self.bounds;
        let beside = (lowest - middle - half).sup(&(middle - half - highest)).max();
        [self.normal.dot(&(middle - self.start)), self.normal.abs().dot(&half), beside]
    }

    /// True if a point of the box may be nearer than `limit` [m], or up to `deep` [m] behind the face.
    #[inline]
    fn may_hold(&self, bounds: &Bounds, limit: f64, deep: f64) -> bool {
        let [over, wide, beside] = self.clearance(bounds.middle_and_half());
        over - wide <= limit && over + wide >= -limit.max(deep) && beside <= limit.max(deep)
    }
}

impl SphereTree {
    /// The tree over `spheres`.
    pub fn new(spheres: &[Sphere]) -> Self {
        let order = morton_order(spheres.len(), |i| spheres[i].centre);
        let sorted: Vec<_> = order.into_iter().map(|i| (spheres[i as usize], i)).collect();
        let bounds = |i: usize| {
            let Sphere { centre, radius } = sorted[i].0;
            Bounds::around(&centre.add_scalar(-radius), &centre.add_scalar(radius))
        };
        let reach = spheres.iter().map(|s| s.centre.norm() + s.radius).fold(0.0, f64::max);
        Self { tree: BoxTree::new(sorted.len(), bounds), spheres: sorted, reach }
    }

    /// The radius of a rock that is one sphere around its centre of mass [m].
    #[inline]
    pub fn single(&self) -> Option<f64> {
        match &self.spheres[..] {
            [(sphere, _)] if sphere.centre == Vector3::zeros() => Some(sphere.radius),
            _ => None,
        }
    }

    /// Call `found` with the number of every sphere whose bounding box overlaps the box from `lowest`
    /// to `highest` [m], in no particular order. Allocates nothing.
    pub fn near(&self, lowest: &Vector3<f64>, highest: &Vector3<f64>, mut found: impl FnMut(u32)) {
        let query = Bounds::around(lowest, highest);
        self.tree.visit(
            |bounds| bounds.meets(&query),
            |i| {
                let (Sphere { centre, radius }, number) = &self.spheres[i];
                let meets = |a: usize| centre[a] + radius >= lowest[a] && centre[a] - radius <= highest[a];
                if meets(0) && meets(1) && meets(2) {
                    found(*number);
                }
                true
            },
        );
    }

    /// Call `found` with every sphere, and its number, that may be nearer than `limit` [m] to the triangle, or whose centre lies up
    /// to `deep` [m] behind it. Allocates nothing.
    pub fn near_face(&self, face: &Slab, limit: f64, deep: f64, mut found: impl FnMut(&Sphere, u32)) {
        self.tree.visit(
            |bounds| face.may_hold(bounds, limit, deep),
            |i| {
                let (sphere, number) = &self.spheres[i];
                found(sphere, *number);
                true
            },
        );
    }

    /// Call `found` with every sphere of the boxes into which `enter` leads, until it answers false.
    #[inline]
    pub fn visit(&self, enter: impl FnMut(&Bounds) -> bool, mut found: impl FnMut(&Sphere) -> bool) {
        self.tree.visit(enter, |i| found(&self.spheres[i].0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::closest::on_face;

    fn spheres(count: u32) -> Vec<Sphere> {
        let sphere = |i: u32| {
            let at = |f: f64| (f64::from(i) * f).sin();
            Sphere { centre: Vector3::new(at(1.3), at(2.7), at(3.1)), radius: 0.02 + 0.01 * at(0.7).abs() }
        };
        (0..count).map(sphere).collect()
    }

    #[test]
    fn the_tree_finds_what_a_look_at_every_sphere_finds() {
        for count in [1, 2, 3, 500] {
            let spheres = spheres(count);
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

    #[test]
    fn no_sphere_near_a_triangle_is_left_out_and_most_others_are() {
        let spheres = spheres(500);
        let tree = SphereTree::new(&spheres);
        let corners = [[-2.0, -1.0, -0.9], [2.0, -1.0, 0.9], [0.0, 2.0, 0.1]].map(Vector3::from);
        let [a, b, c] = &corners;
        let near = |s: &Sphere| on_face(&s.centre, [a, b, c]).to_point.norm() <= s.radius + 0.03;
        let (mut found, mut seen) = (Vec::new(), 0);
        tree.near_face(&Slab::new(&Face::new([*a, *b, *c])), 0.03, 0.0, |s, k| {
            seen += 1;
            if near(s) {
                found.push(k);
            }
        });
        found.sort_unstable();
        let every: Vec<u32> = (0..500).filter(|k| near(&spheres[*k as usize])).collect();
        assert_eq!(found, every);
        assert!(!every.is_empty() && seen < 200, "{seen} spheres looked at for {}", every.len());
    }
}
