//! The sphere of a cluster that reaches nearest to a point.

use crate::rock::Sphere;
use nalgebra::Vector3;

const LEAF: usize = 8;

struct Node {
    lowest: Vector3<f64>,
    highest: Vector3<f64>,
    first: u32,
    count: u32,
    largest: f64,
}

/// A tree over the centres of spheres.
pub struct SphereIndex {
    nodes: Vec<Node>,
    /// The spheres, leaf by leaf, and the place of each in the cluster.
    spheres: Vec<Sphere>,
    places: Vec<u32>,
}

impl SphereIndex {
    /// The tree over at least one sphere.
    pub fn new(spheres: &[Sphere]) -> Self {
        let mut order: Vec<u32> = (0..spheres.len() as u32).collect();
        let mut nodes = Vec::new();
        build(&mut nodes, &mut order, 0, spheres);
        let sorted = order.iter().map(|i| spheres[*i as usize]).collect();
        Self { nodes, spheres: sorted, places: order }
    }

    /// Smallest distance of `from` to a sphere's surface, negative inside of one (then that of the sphere in
    /// which it lies deepest) [m], and the number of the sphere for [`sphere`](Self::sphere).
    pub fn nearest(&self, from: &Vector3<f64>) -> (f64, u32) {
        self.nearest_but(from, None)
    }

    /// The same of all spheres but one.
    pub fn nearest_but(&self, from: &Vector3<f64>, but: Option<u32>) -> (f64, u32) {
        let (mut best, mut found) = (f64::INFINITY, 0);
        let mut stack = [(0_u32, f64::NEG_INFINITY); 64];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (at, bound) = stack[height];
            if bound >= best {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for k in node.first as usize..(node.first + node.count) as usize {
                    let sphere = &self.spheres[k];
                    let reach = best + sphere.radius;
                    let square = (from - sphere.centre).norm_squared();
                    if reach > 0.0 && square < reach * reach && but != Some(k as u32) {
                        best = square.sqrt() - sphere.radius;
                        found = k as u32;
                    }
                }
                continue;
            }
            let (left, right) = (at + 1, node.first);
            let (l, r) = (self.bound(left, from), self.bound(right, from));
            let (near, far) = if l <= r { ((left, l), (right, r)) } else { ((right, r), (left, l)) };
            stack[height] = far;
            stack[height + 1] = near;
            height += 2;
        }
        (best, found)
    }

    /// The numbers of all spheres that overlap `sphere`; it is one of them if it is in the index.
    pub fn overlapping(&self, sphere: &Sphere) -> Vec<u32> {
        let mut found = Vec::new();
        let mut stack = vec![0_u32];
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if self.bound(at, &sphere.centre) >= sphere.radius {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.first, at + 1]);
                continue;
            }
            for k in node.first..node.first + node.count {
                let other = &self.spheres[k as usize];
                let sum = sphere.radius + other.radius;
                if (sphere.centre - other.centre).norm_squared() < sum * sum {
                    found.push(k);
                }
            }
        }
        found
    }

    /// How many spheres there are.
    pub fn count(&self) -> u32 {
        self.spheres.len() as u32
    }

    /// A sphere by the number that [`nearest`](Self::nearest) gives.
    pub fn sphere(&self, number: u32) -> &Sphere {
        &self.spheres[number as usize]
    }

    /// Its place in the list of which the index was made.
    pub fn place(&self, number: u32) -> usize {
        self.places[number as usize] as usize
    }

    fn bound(&self, node: u32, from: &Vector3<f64>) -> f64 {
        let node = &self.nodes[node as usize];
        let mut square = 0.0;
        for axis in 0..3 {
            let d = (node.lowest[axis] - from[axis]).max(from[axis] - node.highest[axis]).max(0.0);
            square += d * d;
        }
        square.sqrt() - node.largest
    }
}

fn build(nodes: &mut Vec<Node>, order: &mut [u32], first: u32, spheres: &[Sphere]) {
    let (mut lowest, mut highest) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let mut largest = 0.0_f64;
    for i in order.iter() {
        let sphere = &spheres[*i as usize];
        lowest = lowest.inf(&sphere.centre);
        highest = highest.sup(&sphere.centre);
        largest = largest.max(sphere.radius);
    }
    let at = nodes.len();
    nodes.push(Node { lowest, highest, first, count: order.len() as u32, largest });
    if order.len() <= LEAF {
        return;
    }
    let axis = (highest - lowest).iamax();
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| {
        let at = |i: &u32| spheres[*i as usize].centre[axis];
        at(a).total_cmp(&at(b)).then(a.cmp(b))
    });
    let (left, right) = order.split_at_mut(half);
    build(nodes, left, first, spheres);
    nodes[at].count = 0;
    nodes[at].first = nodes.len() as u32;
    build(nodes, right, first + half as u32, spheres);
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
        for i in 0..500 {
            let p = Vector3::new(at(i, 4.1), at(i, 5.9), at(i, 0.37)) * 1.5;
            let every =
                spheres.iter().map(|s| (p - s.centre).norm() - s.radius).fold(f64::INFINITY, f64::min);
            let (distance, sphere) = index.nearest(&p);
            assert!((distance - every).abs() < 1e-15);
            let s = index.sphere(sphere);
            assert!(((p - s.centre).norm() - s.radius - every).abs() < 1e-15);
            let other =
                spheres.iter().map(|s| (p - s.centre).norm() - s.radius).filter(|d| *d > every + 1e-15);
            let second = other.fold(f64::INFINITY, f64::min);
            assert!((index.nearest_but(&p, Some(sphere)).0 - second).abs() < 1e-15);
            let around = Sphere { centre: p, radius: 0.1 };
            let touching = spheres.iter().filter(|s| (p - s.centre).norm() < s.radius + 0.1).count();
            assert_eq!(index.overlapping(&around).len(), touching);
        }
    }
}
