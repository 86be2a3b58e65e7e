//! The sphere of a cluster that reaches nearest to a point, and the first one that a ray enters.

use crate::geometry::sphere::Sphere;
use nalgebra::Vector3;

const LEAF: usize = 8;

struct IndexNode {
    lowest: Vector3<f64>,
    highest: Vector3<f64>,
    first: u32,
    count: u32,
    largest: f64,
}

/// A tree over the centres of spheres.
pub struct SphereIndex {
    nodes: Vec<IndexNode>,
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
                    if reach > 0.0 && square < reach * reach {
                        best = square.sqrt() - sphere.radius;
                        found = k as u32;
                    }
                }
                if best <= enough {
                    break;
                }
                continue;
            }
            height = self.push_children(at, from, &mut stack, height);
        }
        (best, found)
    }

    /// Whether a point lies deeper than `by` [m] in one of the spheres.
    pub fn holds(&self, point: &Vector3<f64>, by: f64) -> bool {
        let mut stack = [0_u32; 64];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let at = stack[height];
            let node = &self.nodes[at as usize];
            if self.bound(at, point) >= -by {
                continue;
            }
            if node.count == 0 {
                (stack[height], stack[height + 1]) = (node.first, at + 1);
                height += 2;
            } else if self.spheres[node.first as usize..(node.first + node.count) as usize]
                .iter()
                .any(|s| holds(s, point, by))
            {
                return true;
            }
        }
        false
    }

    /// The two spheres nearest to `from`: distances [m] as of [`nearest`](Self::nearest), and numbers. The second one of a
    /// single sphere is infinitely far away.
    pub fn nearest_two(&self, from: &Vector3<f64>) -> [(f64, u32); 2] {
        let mut found = [(f64::INFINITY, 0); 2];
        let mut stack = [(0_u32, f64::NEG_INFINITY); 64];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (at, bound) = stack[height];
            if bound >= found[1].0 {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count == 0 {
                height = self.push_children(at, from, &mut stack, height);
                continue;
            }
            for k in node.first..node.first + node.count {
                let sphere = &self.spheres[k as usize];
                let distance = (from - sphere.centre).norm() - sphere.radius;
                if distance < found[0].0 {
                    found = [(distance, k), found[0]];
                } else if distance < found[1].0 {
                    found[1] = (distance, k);
                }
            }
        }
        found
    }

    /// Length of the ray from `from`, outside of all spheres, along the unit vector `along` until it enters the first
    /// one [m]; `None` if it enters none within `most`.
    pub fn entry(&self, from: &Vector3<f64>, along: &Vector3<f64>, most: f64) -> Option<f64> {
        let inverse = along.map(|a| 1.0 / a);
        let mut first = most;
        let mut stack = [(0_u32, 0.0); 64];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (at, enters) = stack[height];
            if enters > first {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.count == 0 {
                let mut children = [node.first, at + 1].map(|c| (c, self.enters_box(c, from, &inverse)));
                if children[0].1 < children[1].1 {
                    children.swap(0, 1);
                }
                for child in children.into_iter().filter(|(_, enters)| *enters <= first) {
                    stack[height] = child;
                    height += 1;
                }
                continue;
            }
            for sphere in &self.spheres[node.first as usize..(node.first + node.count) as usize] {
                first = entry(sphere, from, along).map_or(first, |t| t.min(first));
            }
        }
        (first < most).then_some(first)
    }

    /// Length of a ray until it enters the box around the spheres of a node [m]; infinite if it misses it.
    fn enters_box(&self, node: u32, from: &Vector3<f64>, inverse: &Vector3<f64>) -> f64 {
        let node = &self.nodes[node as usize];
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let a = (node.lowest[axis] - node.largest - from[axis]) * inverse[axis];
            let b = (node.highest[axis] + node.largest - from[axis]) * inverse[axis];
            // Along a face of the box 0 times infinity is no number, and counts for nothing here.
            (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
        }
        if enters <= leaves { enters } else { f64::INFINITY }
    }

    /// Put both children of a node on a stack, the nearer one on top; the stack's new height.
    fn push_children(
        &self,
        at: u32,
        from: &Vector3<f64>,
        stack: &mut [(u32, f64); 64],
        height: usize,
    ) -> usize {
        let (left, right) = (at + 1, self.nodes[at as usize].first);
        let (l, r) = (self.bound(left, from), self.bound(right, from));
        let (near, far) = if l <= r { ((left, l), (right, r)) } else { ((right, r), (left, l)) };
        stack[height] = far;
        stack[height + 1] = near;
        height + 2
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

/// Whether a point lies deeper than `by` [m] in `sphere`.
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

fn build(nodes: &mut Vec<IndexNode>, order: &mut [u32], first: u32, spheres: &[Sphere]) {
    let (mut lowest, mut highest) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let (mut least, mut largest) = (f64::INFINITY, 0.0_f64);
    for i in order.iter() {
        let sphere = &spheres[*i as usize];
        lowest = lowest.inf(&sphere.centre);
        highest = highest.sup(&sphere.centre);
        largest = largest.max(sphere.radius);
        least = least.min(sphere.radius);
    }
    let at = nodes.len();
    nodes.push(IndexNode { lowest, highest, first, count: order.len() as u32, largest });
    if order.len() <= LEAF {
        return;
    }
    let axis = (highest - lowest).iamax();
    // Large spheres apart from small ones: the largest of a node decides how near all of it may be.
    let by_size = largest - least > (highest - lowest)[axis];
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| {
        let at = |i: &u32| {
            let sphere = &spheres[*i as usize];
            if by_size { sphere.radius } else { sphere.centre[axis] }
        };
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
