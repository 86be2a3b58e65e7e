//! A triangle that never moves, with what its closest point to a sphere's centre is found from.
//!
//! Of the products that [`crate::geometry::closest::on_face`] forms anew for each point all but two are of the edges
//! alone.
//!
//! Source: Ericson (2005), Real-Time Collision Detection, 5.1.5.

use crate::geometry::closest::Feature;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// A triangle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Face {
    /// A corner [m].
    pub start: Vector3<f64>,
    /// From it to the others [m].
    edges: [Vector3<f64>; 2],
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Products of the edges: first with itself, with each other, second with itself [m2].
    products: [f64; 3],
}

impl Face {
    /// Of a triangle with an area.
    #[inline]
    pub fn new([a, b, c]: [Vector3<f64>; 3]) -> Self {
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(&ac).try_normalize(0.0).unwrap_or_default();
        let products = [ab.norm_squared(), ab.dot(&ac), ac.norm_squared()];
        Self { start: a, edges: [ab, ac], normal, products }
    }

    /// The same seen from `origin` in axes that `to_own` turns into.
    #[inline]
    pub fn seen(&self, to_own: &Matrix3<f64>, origin: &Vector3<f64>) -> Self {
        Self {
            start: to_own * (self.start - origin),
            edges: self.edges.map(|e| to_own * e),
            normal: to_own * self.normal,
            products: self.products,
        }
    }

    /// Its corners [m].
    #[inline]
    pub fn corners(&self) -> [Vector3<f64>; 3] {
        [self.start, self.start + self.edges[0], self.start + self.edges[1]]
    }

    /// Height of `centre` over its plane, below 0 behind it [m].
    #[inline]
    pub fn over_plane(&self, centre: &Vector3<f64>) -> f64 {
        self.normal.dot(&(centre - self.start))
    }

    /// Distance of `centre` from its plane, on either side [m].
    #[inline]
    pub fn off_plane(&self, centre: &Vector3<f64>) -> f64 {
        self.over_plane(centre).abs()
    }

    /// From `centre` to its closest point [m], and what that lies on.
    #[inline]
    pub fn closest(&self, centre: &Vector3<f64>) -> (Vector3<f64>, Feature) {
        let at = centre - self.start;
        let [ab, ac] = &self.edges;
        let [bb, bc, cc] = self.products;
        let (d1, d2) = (ab.dot(&at), ac.dot(&at));
        let (d3, d4) = (d1 - bb, d2 - bc);
        let (d5, d6) = (d1 - bc, d2 - cc);
        if d1 <= 0.0 && d2 <= 0.0 {
            return (-at, Feature::Node);
        }
        if d3 >= 0.0 && d4 <= d3 {
            return (ab - at, Feature::Node);
        }
        if d6 >= 0.0 && d5 <= d6 {
            return (ac - at, Feature::Node);
        }
        if d1 * d4 - d3 * d2 <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return (ab * (d1 / bb) - at, Feature::Edge);
        }
        if d5 * d2 - d1 * d6 <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return (ac * (d2 / cc) - at, Feature::Edge);
        }
        let (past_b, past_c) = (d4 - d3, d5 - d6);
        if d3 * d6 - d5 * d4 <= 0.0 && past_b >= 0.0 && past_c >= 0.0 {
            let share = past_b / (past_b + past_c);
            return (ab + (ac - ab) * share - at, Feature::Edge);
        }
        // Along the normal: the foot is then the same from every triangle of a plane, to rounding.
        (self.normal * -self.normal.dot(&at), Feature::Face)
    }
}

/// Two triangles are equally near a point if their squared distances differ by this share: rounding.
const TIE: f64 = 1e-9;

/// The nearest of some triangles to a point, and on which side of them it lies.
#[derive(Debug, Clone, Copy)]
pub struct Nearest {
    /// Square of the distance [m2]; infinite before the first triangle.
    pub square: f64,
    /// To the nearest point [m].
    pub to_point: Vector3<f64>,
    /// What that lies on.
    pub feature: Feature,
    /// Sum of the unit normals of all triangles that are as near.
    pub up: Vector3<f64>,
    /// Their number.
    pub as_near: u32,
}

impl Default for Nearest {
    #[inline]
    fn default() -> Self {
        Self {
            square: f64::INFINITY,
            to_point: Vector3::zeros(),
            feature: Feature::Face,
            up: Vector3::zeros(),
            as_near: 0,
        }
    }
}

impl Nearest {
    /// Take in one more; true if it is nearer than all before.
    #[inline]
    pub fn take(&mut self, face: &Face, place: &Vector3<f64>) -> bool {
        let over = face.over_plane(place);
        if over * over > self.square * (1.0 + TIE) {
            return false;
        }
        let (to_point, feature) = face.closest(place);
        let square = to_point.norm_squared();
        let nearer = square < self.square * (1.0 - TIE);
        if nearer {
            *self = Self { square, to_point, feature, up: face.normal, as_near: 1 };
        } else if square <= self.square * (1.0 + TIE) {
            self.up += face.normal;
            self.as_near += 1;
        }
        nearer
    }

    /// True if the point lies behind them.
    #[inline]
    pub fn is_inside(&self) -> bool {
        self.to_point.dot(&self.up) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::closest::on_face;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0_f64).prop_map(Vector3::from)
    }

    proptest! {
        /// The other way to the same point has no product in common with this one but the area's.
        #[test]
        fn the_closest_point_is_that_of_the_general_way(centre in point(), a in point(), b in point(), c in point()) {
            prop_assume!((b - a).cross(&(c - a)).norm() > 1e-3);
            let face = Face::new([a, b, c]);
            let general = on_face(&centre, [&a, &b, &c]);
            let (to_point, _) = face.closest(&centre);
            prop_assert!((to_point - general.to_point).norm() < 1e-9, "{to_point} {}", general.to_point);
            let turn = nalgebra::UnitQuaternion::from_euler_angles(0.3, -1.0, 2.0);
            let to_own = turn.to_rotation_matrix().into_inner();
            let (seen, _) = face.seen(&to_own, &a).closest(&(to_own * (centre - a)));
            prop_assert!((seen - to_own * to_point).norm() < 1e-9);
        }
    }

    #[test]
    fn a_point_over_the_middle_an_edge_and_a_corner_says_what_it_lies_on() {
        let face = Face::new([Vector3::zeros(), Vector3::x(), Vector3::y()]);
        let feature = |x: f64, y: f64| face.closest(&Vector3::new(x, y, 0.5)).1;
        assert_eq!(
            [feature(0.2, 0.2), feature(0.5, -0.1), feature(-0.1, 0.5)],
            [Feature::Face, Feature::Edge, Feature::Edge]
        );
        assert_eq!(
            [feature(0.6, 0.6), feature(-0.1, -0.1), feature(1.5, 0.0)],
            [Feature::Edge, Feature::Node, Feature::Node]
        );
        assert_eq!(feature(-0.1, 1.2), Feature::Node);
    }
}
