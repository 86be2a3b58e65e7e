//! The nearest point of a surface, and the side on which a point lies.
//!
//! A tree of boxes over the triangles. The side follows from the normal at the nearest point: of the
//! triangle, of both triangles at an edge (their sum), of all at a vertex (weighted with the angles).
//! Source: Baerentzen and Aanaes (2005), IEEE Trans. Vis. Comput. Graph. 11, 243.

use super::surface::Surface;
use crate::geometry::median_tree::{MedianTree, Split};
use crate::geometry::{bounds, double_area};
use nalgebra::Vector3;
use std::cell::Cell;
use std::collections::HashMap;

const LEAF: usize = 4;

/// Rounding of a height, as a share of it, with some room.
const ROUNDING: f64 = 1e-14;

/// Part of a triangle: its inside, the edge from a corner to the next, or a corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceFeature {
    /// The inside.
    Face,
    /// The edge from this corner to the next.
    Edge(usize),
    /// This corner.
    Corner(usize),
}

/// The nearest point of a surface.
#[derive(Debug, Clone, Copy)]
pub struct NearestOnSurface {
    /// The point [m].
    pub point: Vector3<f64>,
    /// Square of its distance [m2].
    pub square: f64,
    /// Triangle on which it lies.
    pub triangle: u32,
    /// Part of the triangle on which it lies.
    pub feature: SurfaceFeature,
}

/// Mean normal of the triangles of a node, and between which heights along it their corners lie: of a patch of a round surface
/// that is a thin slab, where the box is as thick as the patch is wide.
struct SlabOfPatch {
    normal: Vector3<f64>,
    heights: [f64; 2],
}

/// A tree over the triangles of a closed surface.
pub struct SurfaceTree<'a> {
    /// The surface.
    pub surface: &'a Surface,
    /// Its size [m].
    pub size: f64,
    tree: MedianTree<SlabOfPatch>,
    /// Corners of the triangles, leaf by leaf.
    corners: Vec<[Vector3<f64>; 3]>,
    /// By triangle of the surface: unit normal, normals of its edges and corners (not of length 1).
    faces: Vec<Vector3<f64>>,
    edges: Vec<[Vector3<f64>; 3]>,
    vertices: Vec<Vector3<f64>>,
}

impl<'a> SurfaceTree<'a> {
    /// The tree over `surface`, which is closed and has no degenerate triangle.
    pub fn new(surface: &'a Surface) -> Self {
        let count = surface.triangles.len();
        let faces: Vec<_> = (0..count).map(|t| surface.normal(t)).collect();
        let mut vertices = vec![Vector3::zeros(); surface.points.len()];
        let mut sums: HashMap<(u32, u32), Vector3<f64>> = HashMap::with_capacity(count * 2);
        for (t, corner) in surface.triangles.iter().enumerate() {
            let p = surface.corners(t);
            for k in 0..3 {
                let (to, from) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                vertices[corner[k] as usize] += faces[t] * to.angle(&from);
                *sums.entry(key(corner[k], corner[(k + 1) % 3])).or_insert_with(Vector3::zeros) += faces[t];
            }
        }
        let edges =
            surface.triangles.iter().map(|c| [0, 1, 2].map(|k| sums[&key(c[k], c[(k + 1) % 3])])).collect();
        let middles: Vec<Vector3<f64>> =
            (0..count).map(|t| surface.corners(t).iter().sum::<Vector3<f64>>() / 3.0).collect();
        let describe = |some: &[u32]| describe(some, surface, &middles);
        let tree = MedianTree::new(count, LEAF, describe, |t| middles[t as usize], |_| 0.0);
        let corners = tree.order.iter().map(|t| surface.corners(*t as usize)).collect();
        Self { surface, size: surface.size(), tree, corners, faces, edges, vertices }
    }

    /// The nearest point to `from` that is nearer than `within` [m].
    pub fn nearest(&self, from: &Vector3<f64>, within: f64) -> Option<NearestOnSurface> {
        self.nearly_nearest(from, within, 0.0)
    }

    /// A point that is nearer to `from` than `within`, and no more than `slack` [m] further than the
    /// nearest: from the middle of a round solid all points are nearly the nearest.
    pub fn nearly_nearest(&self, from: &Vector3<f64>, within: f64, slack: f64) -> Option<NearestOnSurface> {
        let mut best: Option<NearestOnSurface> = None;
        // A point counts below `square`, a box is entered below `limit`.
        let (mut square, limit) = (within * within, Cell::new(within * within));
        self.tree.nearest_first(
            |node| node.square_to(from),
            |gap, node| gap < limit.get() && node.more.square_to(from) < limit.get(),
            |items| {
                for k in items {
                    let (point, feature) = closest(from, &self.corners[k]);
                    let distance = (point - from).norm_squared();
                    if distance < square {
                        square = distance;
                        let least = (distance.sqrt() - slack).max(0.0).powi(2);
                        limit.set(if slack > 0.0 { least } else { distance });
                        best =
                            Some(NearestOnSurface { point, square, triangle: self.tree.order[k], feature });
                    }
                }
                true
            },
        );
        best
    }

    /// The nearest point to `from`.
    pub fn closest(&self, from: &Vector3<f64>) -> NearestOnSurface {
        self.nearest(from, f64::INFINITY).expect("a surface has triangles")
    }

    /// Distance of `from` to the surface, negative inside [m], and the nearest point.
    pub fn signed(&self, from: &Vector3<f64>) -> (f64, NearestOnSurface) {
        let nearest = self.closest(from);
        let outwards = (from - nearest.point).dot(&self.normal(&nearest)) >= 0.0;
        let distance = nearest.square.sqrt();
        (if outwards { distance } else { -distance }, nearest)
    }

    /// Outward normal at a nearest point, not of length 1 at edges and corners.
    pub fn normal(&self, at: &NearestOnSurface) -> Vector3<f64> {
        self.normal_at(at.triangle as usize, at.feature)
    }

    /// Outward normal at a part of a triangle, not of length 1 at edges and corners.
    pub fn normal_at(&self, triangle: usize, feature: SurfaceFeature) -> Vector3<f64> {
        match feature {
            SurfaceFeature::Face => self.faces[triangle],
            SurfaceFeature::Edge(k) => self.edges[triangle][k],
            SurfaceFeature::Corner(k) => self.vertices[self.surface.triangles[triangle][k] as usize],
        }
    }

    /// Call `found` with every pair of triangles whose boxes overlap, each pair once.
    pub fn pairs(&self, mut found: impl FnMut(u32, u32)) {
        let mut stack = vec![(0_u32, 0_u32)];
        let order = &self.tree.order;
        while let Some((a, b)) = stack.pop() {
            let (first, second) = (self.tree.node(a), self.tree.node(b));
            if (0..3).any(|k| first.lowest[k] > second.highest[k] || second.lowest[k] > first.highest[k]) {
                continue;
            }
            match (first.items(), second.items()) {
                (Some(own), Some(others)) => {
                    for (i, j) in own.flat_map(|i| others.clone().map(move |j| (order[i], order[j]))) {
                        if a != b || i < j {
                            found(i.min(j), i.max(j));
                        }
                    }
                }
                _ if a == b => {
                    let [left, right] = self.tree.children(a);
                    stack.extend([(left, left), (right, right), (left, right)]);
                }
                (None, _) => stack.extend(self.tree.children(a).map(|child| (child, b))),
                (Some(_), None) => stack.extend(self.tree.children(b).map(|child| (a, child))),
            }
        }
    }
}

fn key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// The box around triangles, their slab, and the axis along which their middles lie furthest apart.
fn describe(
    some: &[u32],
    surface: &Surface,
    middles: &[Vector3<f64>],
) -> ([Vector3<f64>; 2], SlabOfPatch, Split) {
    let corners = || some.iter().map(|t| surface.corners(*t as usize));
    let [low, high] = bounds(some.iter().map(|t| middles[*t as usize]));
    // The mean normal is weighted with the areas.
    let normal =
        corners().map(double_area).sum::<Vector3<f64>>().try_normalize(0.0).unwrap_or_else(Vector3::z);
    let heights = corners().flatten().map(|p| normal.dot(&p));
    let heights = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], at| [l.min(at), h.max(at)]);
    (bounds(corners().flatten()), SlabOfPatch { normal, heights }, Split::Axis((high - low).iamax()))
}

impl SlabOfPatch {
    /// Square of the distance of a point from it [m2], rounded down.
    fn square_to(&self, from: &Vector3<f64>) -> f64 {
        let height = self.normal.dot(from);
        let distance =
            (self.heights[0] - height).max(height - self.heights[1]).max(0.0) - ROUNDING * height.abs();
        distance.max(0.0).powi(2)
    }
}

/// The nearest point of a triangle. Source: Ericson (2005), Real-Time Collision Detection, 5.1.5.
fn closest(p: &Vector3<f64>, [a, b, c]: &[Vector3<f64>; 3]) -> (Vector3<f64>, SurfaceFeature) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, SurfaceFeature::Corner(0));
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, SurfaceFeature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), SurfaceFeature::Edge(0));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, SurfaceFeature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), SurfaceFeature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), SurfaceFeature::Edge(1));
    }
    let scale = 1.0 / (va + vb + vc);
    (a + ab * (vb * scale) + ac * (vc * scale), SurfaceFeature::Face)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::builtin;

    #[test]
    fn the_nearest_point_is_that_of_a_look_at_every_triangle() {
        let surface = builtin::ellipsoid(Vector3::new(0.3, 0.5, 0.2), 3);
        let tree = SurfaceTree::new(&surface);
        for i in 0..500 {
            let at = |f: f64| (f64::from(i) * f).sin();
            let p = Vector3::new(at(1.3), at(2.7), at(3.1)) * 0.6;
            let every = (0..surface.triangles.len())
                .map(|t| (closest(&p, &surface.corners(t)).0 - p).norm())
                .fold(f64::INFINITY, f64::min);
            let (signed, nearest) = tree.signed(&p);
            assert!((signed.abs() - every).abs() < 1e-15);
            assert!((nearest.square.sqrt() - every).abs() < 1e-15);
            let inside = (p.x / 0.3).powi(2) + (p.y / 0.5).powi(2) + (p.z / 0.2).powi(2) < 1.0;
            assert!(every < 0.01 || inside == (signed < 0.0), "{p}");
        }
    }

    /// Where the nearest point is a corner or an edge, the side is still right.
    #[test]
    fn the_side_is_right_where_an_edge_or_a_corner_is_nearest() {
        let surface = builtin::cuboid(Vector3::repeat(2.0));
        let tree = SurfaceTree::new(&surface);
        for p in [[1.1, 1.1, 1.1], [1.1, -1.2, 0.3], [-1.3, 0.2, 0.1]] {
            assert!(tree.signed(&p.into()).0 > 0.0);
            assert!(tree.signed(&(Vector3::from(p) * 0.5)).0 < 0.0);
        }
    }

    #[test]
    fn every_pair_of_boxes_that_meet_is_named_once() {
        let surface = builtin::ellipsoid(Vector3::new(0.3, 0.5, 0.2), 2);
        let tree = SurfaceTree::new(&surface);
        let mut found = Vec::new();
        tree.pairs(|a, b| found.push((a, b)));
        found.sort_unstable();
        let unique = found.len();
        found.dedup();
        assert_eq!(unique, found.len());
        let sharing = |a: u32, b: u32| {
            surface.triangles[a as usize].iter().any(|v| surface.triangles[b as usize].contains(v))
        };
        let count = surface.triangles.len() as u32;
        for a in 0..count {
            for b in a + 1..count {
                assert!(!sharing(a, b) || found.binary_search(&(a, b)).is_ok());
            }
        }
    }
}
