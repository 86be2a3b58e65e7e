//! The sphere of a cluster that reaches nearest to a point, and the first one that a ray enters.

use crate::geometry::bounds;
use crate::geometry::median_tree::{MedianNode, MedianTree, Split};
use crate::geometry::sphere::Sphere;
use nalgebra::Vector3;
use std::cell::Cell;

const LEAF: usize = 8;

/// A tree over the centres of spheres; of a node it knows the largest radius [m].
pub struct SphereIndex {
    tree: MedianTree<f64>,
    /// The spheres, leaf by leaf.
    pub spheres: Vec<Sphere>,
}

/// Least distance of a point from the spheres of a node [m], negative where it may lie in one.
fn bound(node: &MedianNode<f64>, from: &Vector3<f64>) -> f64 {
    node.square_to(from).sqrt() - node.more
}

impl SphereIndex {
    /// The tree over at least one sphere.
    pub fn new(spheres: &[Sphere]) -> Self {
        let sphere = |k: u32| &spheres[k as usize];
        let describe = |some: &[u32]| describe(some, spheres);
        let tree = MedianTree::new(spheres.len(), LEAF, describe, |k| sphere(k).centre, |k| sphere(k).radius);
        let sorted = tree.order.iter().map(|i| spheres[*i as usize]).collect();
        Self { tree, spheres: sorted }
    }

    /// The largest distance of points from the nearest sphere, 0 if all lie inside of some [m].
    pub fn furthest<'a>(&self, points: impl Iterator<Item = &'a Vector3<f64>>) -> f64 {
        points.fold(0.0, |most, p| self.search(p, most).0.max(most))
    }

    /// Smallest distance of `from` to a sphere's surface, negative inside of one (then that of the sphere in
    /// which it lies deepest) [m], and the number of the sphere for [`sphere`](Self::sphere).
    pub fn nearest(&self, from: &Vector3<f64>) -> (f64, u32) {
        self.search(from, f64::NEG_INFINITY)
    }

    /// The same, but ended at the first sphere that is no further than `enough` [m].
    fn search(&self, from: &Vector3<f64>, enough: f64) -> (f64, u32) {
        let (best, mut found) = (Cell::new(f64::INFINITY), 0);
        self.tree.nearest_first(
            |node| bound(node, from),
            |least, _| least < best.get(),
            |items| {
                for k in items {
                    let sphere = &self.spheres[k];
                    let reach = best.get() + sphere.radius;
                    let square = (from - sphere.centre).norm_squared();
                    if reach > 0.0 && square < reach * reach {
                        best.set(square.sqrt() - sphere.radius);
                        found = k as u32;
                    }
                }
                best.get() > enough
            },
        );
        (best.get(), found)
    }

    /// True if a point lies deeper than `by` [m] in one of the spheres.
    pub fn holds(&self, point: &Vector3<f64>, by: f64) -> bool {
        let mut held = false;
        self.tree.visit(
            |node| bound(node, point) < -by,
            |items| {
                held = self.spheres[items].iter().any(|s| holds(s, point, by));
                !held
            },
        );
        held
    }

    /// The two spheres nearest to `from`: distances [m] as of [`nearest`](Self::nearest), and numbers. The second one of a
    /// single sphere is infinitely far away.
    pub fn nearest_two(&self, from: &Vector3<f64>) -> [(f64, u32); 2] {
        let found = Cell::new([(f64::INFINITY, 0); 2]);
        self.tree.nearest_first(
            |node| bound(node, from),
            |least, _| least < found.get()[1].0,
            |items| {
                for k in items {
                    let sphere = &self.spheres[k];
                    let this = ((from - sphere.centre).norm() - sphere.radius, k as u32);
                    let [first, second] = found.get();
                    if this.0 < first.0 {
                        found.set([this, first]);
                    } else if this.0 < second.0 {
                        found.set([first, this]);
                    }
                }
                true
            },
        );
        found.get()
    }

    /// Length of the ray from `from`, outside of all spheres, along the unit vector `along` until it enters the first
    /// one [m]; `None` if it enters none within `most`.
    pub fn entry(&self, from: &Vector3<f64>, along: &Vector3<f64>, most: f64) -> Option<f64> {
        let inverse = along.map(|a| 1.0 / a);
        let first = Cell::new(most);
        self.tree.nearest_first(
            |node| enters_box(node, from, &inverse),
            |enters, _| enters <= first.get(),
            |items| {
                for sphere in &self.spheres[items] {
                    first.set(entry(sphere, from, along).map_or(first.get(), |t| t.min(first.get())));
                }
                true
            },
        );
        (first.get() < most).then_some(first.get())
    }

    /// The numbers of all spheres that overlap `sphere`; it is one of them if it is in the index.
    pub fn overlapping(&self, sphere: &Sphere) -> Vec<u32> {
        let mut found = Vec::new();
        self.tree.visit(
            |node| bound(node, &sphere.centre) < sphere.radius,
            |items| {
                for k in items {
                    let other = &self.spheres[k];
                    let sum = sphere.radius + other.radius;
                    if (sphere.centre - other.centre).norm_squared() < sum * sum {
                        found.push(k as u32);
                    }
                }
                true
            },
        );
        found
    }

    /// A sphere by the number that [`nearest`](Self::nearest) gives.
    pub fn sphere(&self, number: u32) -> &Sphere {
        &self.spheres[number as usize]
    }

    /// Its place in the list of which the index was made.
    pub fn place(&self, number: u32) -> usize {
        self.tree.order[number as usize] as usize
    }
}

/// Length of a ray until it enters the box around the spheres of a node [m]; infinite if it misses it.
fn enters_box(node: &MedianNode<f64>, from: &Vector3<f64>, inverse: &Vector3<f64>) -> f64 {
    let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let a = (node.lowest[axis] - node.more - from[axis]) * inverse[axis];
        let b = (node.highest[axis] + node.more - from[axis]) * inverse[axis];
        // Along a face of the box 0 times infinity is no number, and counts for nothing here.
        (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
    }
    if enters <= leaves { enters } else { f64::INFINITY }
}

/// True if a point lies deeper than `by` [m] in `sphere`.
pub fn holds(sphere: &Sphere, point: &Vector3<f64>, by: f64) -> bool {
    let within = sphere.radius - by;
    within > 0.0 && (point - sphere.centre).norm_squared() < within * within
}

/// Length of a ray from a point outside of `sphere` until it enters it [m].
pub fn entry(sphere: &Sphere, from: &Vector3<f64>, along: &Vector3<f64>) -> Option<f64> {
    let arm = sphere.centre - from;
    let middle = arm.dot(along);
    let square = middle * middle - arm.norm_squared() + sphere.radius * sphere.radius;
    (middle > 0.0 && square > 0.0).then(|| middle - square.sqrt())
}

/// The box around centres, the largest radius, and by what the spheres are split: large ones apart from small ones where their
/// radii differ most, since the largest of a node decides how near all of it may be.
fn describe(some: &[u32], spheres: &[Sphere]) -> ([Vector3<f64>; 2], f64, Split) {
    let all = || some.iter().map(|i| &spheres[*i as usize]);
    let [lowest, highest] = bounds(all().map(|s| s.centre));
    let largest = all().map(|s| s.radius).fold(0.0, f64::max);
    let least = all().map(|s| s.radius).fold(f64::INFINITY, f64::min);
    let axis = (highest - lowest).iamax();
    let by_size = largest - least > (highest - lowest)[axis];
    ([lowest, highest], largest, if by_size { Split::Size } else { Split::Axis(axis) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_sphere_is_that_of_a_look_at_every_one() {
        let at = |i: u32, f: f64| (f64::from(i) * f).sin();
        let spheres: Vec<Sphere> = (0..400)
            .map(|i| Sphere {
                centre: Vector3::new(at(i, 1.3), at(i, 2.7), at(i, 3.1)),
                radius: 0.01 + 0.2 * at(i, 0.7).powi(4),
            })
            .collect();
        let index = SphereIndex::new(&spheres);
        let mut furthest = 0.0_f64;
        let mut points = Vec::new();
        for i in 0..500 {
            let p = Vector3::new(at(i, 4.1), at(i, 5.9), at(i, 0.37)) * 1.5;
            let every =
                spheres.iter().map(|s| (p - s.centre).norm() - s.radius).fold(f64::INFINITY, f64::min);
            let (distance, sphere) = index.nearest(&p);
            furthest = furthest.max(every);
            points.push(p);
            assert!((index.furthest(points.iter()) - furthest).abs() < 1e-15);
            assert!((distance - every).abs() < 1e-15);
            let s = index.sphere(sphere);
            assert!(((p - s.centre).norm() - s.radius - every).abs() < 1e-15);
            let other =
                spheres.iter().map(|s| (p - s.centre).norm() - s.radius).filter(|d| *d > every + 1e-15);
            let second = other.fold(f64::INFINITY, f64::min);
            assert_eq!(index.holds(&p, 0.03), every < -0.03);
            let two = index.nearest_two(&p);
            assert_eq!(two[0], (distance, sphere));
            assert!((two[1].0 - second).abs() < 1e-15);
            let along = Vector3::new(at(i, 1.9), at(i, 0.53), at(i, 6.7)).normalize();
            let enters = spheres.iter().filter_map(|s| entry(s, &p, &along)).fold(2.0, f64::min);
            if distance > 0.0 {
                assert_eq!(index.entry(&p, &along, 2.0).unwrap_or(2.0), enters);
            }
            let around = Sphere { centre: p, radius: 0.1 };
            let touching = spheres.iter().filter(|s| (p - s.centre).norm() < s.radius + 0.1).count();
            assert_eq!(index.overlapping(&around).len(), touching);
        }
    }
}
