//! The largest ball in the solid that touches the surface at a point: a ball of the medial axis.
//!
//! A ball that touches at `q` and contains another point `p` of the surface shrinks until it touches at
//! `p` too, `R = |p - q|^2 / (2 m.(p - q))` with the inward normal `m` at `q`, again and again until it
//! contains none. Source: Ma, Bae and Choi (2012), Vis. Comput. 28, 7 ("3D medial axis point
//! approximation using nearest neighbors and the normal field"); here with the nearest point of the surface
//! itself in the place of samples, and on flat faces with the plane in the place of the point.

use crate::geometry::sphere::Sphere;
use crate::shape::tree::{NearestOnSurface, SurfaceFeature, SurfaceTree};
use nalgebra::Vector3;

/// Shrinkings until a ball is made safe by a last test of the distance and taken as it is.
const MOST_SHRINKINGS: usize = 20;

/// Share of the size below which a gap is none: so small a one is only reached on round surfaces, and there it
/// is the chords of their triangles; from the middle very many of these are nearest, and balls are dear. 50 000 balls leave 9e-4 in a cube; one leaves up to 1.8e-4 in a sphere
/// of 20 480 triangles.
pub const FINEST: f64 = 2e-4;

/// Share of the size above which a depth is more than rounding.
const SURE: f64 = 1e-7;

/// Balls that are grown in the solid inside a surface.
#[derive(Clone, Copy)]
pub struct Balls<'a> {
    /// The surface.
    pub tree: &'a SurfaceTree<'a>,
    /// Largest difference of a ball from the largest one [m].
    tolerance: f64,
    /// The same as a share of its radius.
    share: f64,
    /// True if every ball is known to lie in the solid. Others may lie beyond it where it is thinner than the tolerance; clusters of
    /// thick solids have always been made of these, and stay as they are.
    pub careful: bool,
}

impl<'a> Balls<'a> {
    /// Balls in the solid inside the surface of `tree`, to a `tolerance` [m].
    ///
    /// In the middle of a round solid very many triangles are nearest but for a small difference: a
    /// tolerance of a small share of the error that a cover leaves spares looking at all of them.
    pub fn new(tree: &'a SurfaceTree, tolerance: f64) -> Self {
        Self { tree, tolerance, share: 0.0, careful: true }
    }

    /// The same balls to a tenth of their radius, where only their size matters.
    pub fn roughly(&self) -> Self {
        Self { share: 0.1, ..*self }
    }

    /// The largest ball that touches at the surface point `at` (unit `inward` points inwards), smaller by the tolerance.
    pub fn touching(&self, at: &Vector3<f64>, inward: &Vector3<f64>) -> Sphere {
        self.shrunk(at, inward, 0.5 * self.tree.size).0
    }

    /// The same ball, and whether one beyond a thin part of the solid was left out for it: if not, a trusting search finds
    /// the same one.
    fn shrunk(&self, at: &Vector3<f64>, inward: &Vector3<f64>, from: f64) -> (Sphere, bool) {
        let mut radius = from;
        let mut left = false;
        for _ in 0..MOST_SHRINKINGS {
            let centre = at + inward * radius;
            let tolerance = self.tolerance.max(self.share * radius);
            let Some(near) = self.tree.nearly_nearest(&centre, radius - tolerance, tolerance) else {
                if self.leaves(at, inward, tolerance) {
                    left = true;
                    radius = 0.5 * tolerance;
                    continue;
                }
                return (Sphere { centre, radius: radius - tolerance }, left);
            };
            let chord = near.point - at;
            let depth = inward.dot(&chord);
            let smaller = self.tangent(at, inward, &near).unwrap_or(chord.norm_squared() / (2.0 * depth));
            if depth <= 0.0 || smaller >= radius - 0.5 * tolerance {
                return (Sphere { centre, radius: near.square.sqrt() - tolerance }, left);
            }
            radius = smaller;
        }
        let centre = at + inward * radius;
        let free = self.tree.nearest(&centre, radius).map_or(radius, |n| n.square.sqrt());
        (Sphere { centre, radius: free }, left)
    }

    /// Radii [m] of the ball that touches at `at`: known to lie in the solid, and trusted to. Both are sought below `most`.
    pub fn radii(&self, at: &Vector3<f64>, inward: &Vector3<f64>, most: f64) -> [f64; 2] {
        let from = most.min(0.5 * self.tree.size);
        let (ball, left) = Self { careful: true, ..*self }.shrunk(at, inward, from);
        let trusted = if left { Self { careful: false, ..*self }.touching(at, inward) } else { ball };
        [ball.radius, trusted.radius]
    }

    /// True if the solid is thinner at `at` than `tolerance` [m]. A ball beyond it, outside of the solid, contains
    /// none of its surface but for the tolerance either.
    fn leaves(&self, at: &Vector3<f64>, inward: &Vector3<f64>, tolerance: f64) -> bool {
        self.careful
            && tolerance > SURE * self.tree.size
            && self.tree.signed(&(at + inward * tolerance)).0 >= 0.0
    }

    /// Radius of the ball that touches at `at` and at the plane in which `near` lies, if it touches that
    /// in the surface: on flat faces the limit of all further shrinkings at once.
    fn tangent(&self, at: &Vector3<f64>, inward: &Vector3<f64>, near: &NearestOnSurface) -> Option<f64> {
        if near.feature != SurfaceFeature::Face {
            return None;
        }
        let normal = self.tree.normal(near);
        let radius = normal.dot(&(near.point - at)) / (1.0 + normal.dot(inward));
        let touch = at + (inward + normal) * radius;
        (radius > 0.0 && self.tree.nearest(&touch, 1e-9 * self.tree.size).is_some()).then_some(radius)
    }

    /// The largest ball that contains the point `inside` and touches where the surface is nearest to
    /// it; `None` if the point lies outside or on the surface.
    pub fn around(&self, inside: &Vector3<f64>) -> Option<Sphere> {
        let (distance, near) = self.tree.signed(inside);
        if distance >= -1e-12 * self.tree.size {
            return None;
        }
        Some(self.touching(&near.point, &((inside - near.point) / -distance)))
    }

    /// The largest ball that comes as near as `gap` [m] to the surface point `at`, sought along
    /// `inward` (unit) up to the depth of the solid there; with a radius of at least `least` [m] where
    /// there is one, even if it then stays further away.
    pub fn near(&self, at: &Vector3<f64>, inward: &Vector3<f64>, gap: f64, least: f64) -> Option<Sphere> {
        let fits = |ball: &Sphere| (ball.centre - at).norm() - ball.radius <= gap;
        let mut best: Option<Sphere> = None;
        let mut largest = None;
        let first = gap.min(0.01 * self.tree.size);
        let (mut depth, mut fitted, mut failed) = (first, 0.5 * first, f64::INFINITY);
        while depth < self.tree.size {
            let Some(ball) = self.around(&(at + inward * depth)) else { break };
            let tried = depth;
            depth *= 2.0;
            if fits(&ball) {
                // Up to its centre the same ball would be found again.
                depth = depth.max(1.2 * ball.radius);
                if best.is_none_or(|b| ball.radius > b.radius * (1.0 + 1e-9)) {
                    best = Some(ball);
                }
            } else {
                failed = tried;
                if ball.radius >= least {
                    largest = Some(ball);
                    break;
                }
                if best.is_some_and(|b| b.radius >= least) {
                    break;
                }
            }
            if failed == f64::INFINITY {
                fitted = tried;
            }
        }
        // Between the last depth that fits and the first that does not.
        let (mut low, mut high) = (fitted, failed);
        let steps = if high.is_finite() { 4 } else { 0 };
        for _ in 0..steps {
            let middle = 0.5 * (low + high);
            let Some(ball) = self.around(&(at + inward * middle)) else { break };
            if fits(&ball) {
                low = middle;
                if best.is_none_or(|b| ball.radius > b.radius) {
                    best = Some(ball);
                }
            } else if ball.radius < least {
                low = middle;
            } else {
                high = middle;
                if largest.is_none_or(|l| ball.radius < l.radius) {
                    largest = Some(ball);
                }
            }
        }
        match (best, largest) {
            (Some(ball), _) if ball.radius >= least => Some(ball),
            (_, Some(ball)) => Some(ball),
            (best, None) => best,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::builtin;

    #[test]
    fn a_ball_in_a_cube_touches_the_nearest_face_and_another() {
        let surface = builtin::cuboid(Vector3::repeat(2.0));
        let tree = SurfaceTree::new(&surface);
        let balls = Balls::new(&tree, 1e-14);
        let at = |x: f64, y: f64| balls.touching(&Vector3::new(x, y, 1.0), &-Vector3::z());
        assert!((at(0.0, 0.0).radius - 1.0).abs() < 1e-12, "up to the opposite face");
        assert!((at(0.7, 0.1).radius - 0.3).abs() < 1e-12, "as far from the edge");
        assert!((at(0.7, -0.9).radius - 0.1).abs() < 1e-12);
    }

    /// Beyond a plate that is thinner than the tolerance a ball of half its length was found, outside of it.
    #[test]
    fn a_ball_in_a_plate_is_no_larger_than_it_is_thick() {
        let size = Vector3::new(2.0, 1.0, 0.01);
        let surface = builtin::cuboid(size);
        let tree = SurfaceTree::new(&surface);
        let at = Vector3::new(0.3, 0.1, 0.005);
        let none = Balls::new(&tree, 0.1).touching(&at, &-Vector3::z());
        assert!(none.radius <= 0.0, "the tolerance is larger than the plate is thick: {none:?}");
        let ball = Balls::new(&tree, 1e-6).roughly().touching(&at, &-Vector3::z());
        assert!((0.004..=0.005).contains(&ball.radius) && tree.signed(&ball.centre).0 < -0.004, "{ball:?}");
    }

    /// At a right-angled edge a ball of radius r leaves r (sqrt 2 - 1), at a corner r (sqrt 3 - 1).
    #[test]
    fn at_edges_and_corners_the_largest_ball_leaves_the_gap_that_was_allowed() {
        let surface = builtin::cuboid(Vector3::repeat(2.0));
        let tree = SurfaceTree::new(&surface);
        let balls = Balls::new(&tree, 1e-14);
        for gap in [0.1, 1e-3] {
            let edge =
                balls.near(&Vector3::new(1.0, 1.0, 0.2), &-Vector3::new(1.0, 1.0, 0.0).normalize(), gap, 0.0);
            let corner = balls.near(&Vector3::repeat(1.0), &-Vector3::repeat(1.0).normalize(), gap, 0.0);
            for (ball, root) in [(edge, 2.0_f64), (corner, 3.0)] {
                let due = gap / (root.sqrt() - 1.0);
                let radius = ball.expect("a ball").radius;
                // Four halvings between two depths of which one is twice the other.
                assert!(radius <= due * (1.0 + 1e-9) && radius > due * (1.0 - 2.0 / 16.0), "{radius} {due}");
            }
        }
    }

    #[test]
    fn a_least_radius_is_kept_where_the_gap_would_ask_for_less() {
        let surface = builtin::cuboid(Vector3::repeat(2.0));
        let tree = SurfaceTree::new(&surface);
        let balls = Balls::new(&tree, 1e-14);
        let ball = balls.near(&Vector3::repeat(1.0), &-Vector3::repeat(1.0).normalize(), 1e-3, 0.05);
        let radius = ball.expect("a ball").radius;
        assert!((0.05..0.1).contains(&radius), "{radius}");
    }
}
