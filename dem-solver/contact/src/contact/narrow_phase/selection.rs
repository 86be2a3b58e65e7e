//! Which of several elements' closest points are contacts of a sphere: second stage of the double
//! hierarchy.
//!
//! Point b is no contact of its own beside the nearer point a if it lies on or behind the plane
//! through a that touches the shell around the sphere's centre: `n_a . n_b s_b >= s_a`. A plane
//! therefore gives one contact however many elements it is made of, and a corner two. The relation
//! is not transitive: points are taken in the order (distance, feature, element), so that the
//! outcome depends on nothing but the points.
//!
//! At a kink towards the sphere the second of two wires is touched with the overlap of their common node,
//! not with none: the force jumps. [`Crossings`](crate::interface_mesh::crossings::Crossings) is the rule without a jump: let u be the energy of a
//! contact as a function of the distance. For a wire of segments the energy is
//!
//! `U = sum over segments u(distance) - sum over inner nodes u(distance)`.
//!
//! Each distance to a convex set has a continuous gradient, hence force and energy are continuous, and
//! the force is the energy's gradient. Where the foot lies inside one segment of a straight wire, the
//! others' closest points are nodes and cancel with those that are subtracted: one contact, however
//! many segments. At a kink the segment beyond it sets in with what the node takes away. At an edge
//! away from the sphere the node alone is left, as before. At a crossing each wire counts for itself,
//! and where a wire ends at another, the end is subtracted too: a node of k segments, p of whose pairs
//! go straight on, counts `-(k - max(p, 1))`. Wires of several radii are subtracted each with its own radius, and the thickest stays:
//! every subtracted node then belongs to a segment that is at least as near, and the energy is never below 0. (With one radius for
//! all, that of a post, the ropes at its head pulled a rock in.)
//!
//! It counts the pieces of a wire within the sphere, less the holes that they enclose: a ring of wire
//! that lies in the sphere as a whole, nodes and all, would hold too little. The overlap at which that
//! begins is large: `L^2 / 8R` for segments of length L around a sphere of radius R. Faces have the same, with their
//! edges and corners: [`crate::contact::narrow_phase::faces`].
//!
//! Source: Santasusana et al. (2016), Computational Particle Mechanics 3, 407-428 (the double hierarchy). The
//! sum over segments and nodes is the inclusion and exclusion of a wire's parts, derived here.

use super::Touch;
use std::cmp::Ordering;

/// Share by which a point may lie before the plane and still count as on it.
///
/// Points of one plane are equal under the rule but for rounding: of coordinates of some 1000 m
/// against distances of some centimetres, 1e-11. Two faces whose kink is below sqrt(2 * 1e-10), that
/// is 1.4e-5 rad, count as one plane.
const LEVEL: f64 = 1e-10;

/// Move those of one sphere's candidates that are contacts to the front, in the order of the
/// hierarchy, and say how many they are.
pub fn keep_contacts(candidates: &mut [Touch]) -> usize {
    candidates.sort_unstable_by(order);
    let mut kept = candidates.len().min(1);
    for next in 1..candidates.len() {
        let (b, nearer) = (&candidates[next], &candidates[..kept]);
        let behind = |a: &Touch| a.normal.dot(&b.normal) * b.distance >= a.distance * (1.0 - LEVEL);
        if !nearer.iter().any(behind) {
            candidates.swap(kept, next);
            kept += 1;
        }
    }
    kept
}

fn order(a: &Touch, b: &Touch) -> Ordering {
    a.distance.total_cmp(&b.distance).then(a.feature.cmp(&b.feature)).then(a.element.cmp(&b.element))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dem_solid::geometry::closest::Feature;
    use dem_solid::geometry::sphere::Sphere;
    use nalgebra::Vector3;

    fn point(element: u32, feature: Feature, to_point: [f64; 3]) -> Touch {
        let to_point = Vector3::from(to_point);
        let distance = to_point.norm();
        let ball = Sphere { centre: Vector3::zeros(), radius: distance };
        Touch::new((&ball, 0), ball.centre, element, (to_point / distance, distance), feature)
    }

    fn survivors(points: &[Touch]) -> Vec<u32> {
        let mut points = points.to_vec();
        let kept = keep_contacts(&mut points);
        points.truncate(kept);
        points.iter().map(|p| p.element).collect()
    }

    #[test]
    fn points_of_one_plane_are_one_contact() {
        let plane = |element, x: f64, y: f64| point(element, Feature::Edge, [x, y, -0.1]);
        let foot = point(7, Feature::Face, [0.0, 0.0, -0.1]);
        assert_eq!(survivors(&[plane(1, 0.03, 0.0), foot, plane(2, -0.01, 0.02)]), [7]);
    }

    #[test]
    fn a_corner_is_two_contacts_and_a_cell_of_wires_four() {
        let walls = [point(1, Feature::Face, [0.0, 0.0, -0.1]), point(2, Feature::Face, [0.11, 0.0, 0.0])];
        assert_eq!(survivors(&walls), [1, 2]);
        let wire = |element, x: f64, y: f64| point(element, Feature::Edge, [x, y, -0.05]);
        let cell = [wire(3, 0.07, 0.0), wire(1, -0.07, 0.0), wire(2, 0.0, 0.07), wire(0, 0.0, -0.07)];
        assert_eq!(survivors(&cell), [0, 1, 2, 3]);
    }

    #[test]
    fn a_shared_node_is_one_contact_of_the_first_element() {
        let node = |element| point(element, Feature::Node, [0.01, 0.02, -0.1]);
        assert_eq!(survivors(&[node(4), node(2), node(9), node(3)]), [2]);
    }

    /// The relation is not transitive (a discards b, b would discard c, a does not discard c).
    #[test]
    fn the_outcome_does_not_depend_on_the_order_in_which_points_come() {
        let at = |element, degrees: f64, s: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            point(element, Feature::Edge, [sin * s, 0.0, -cos * s])
        };
        let points = [at(0, 0.0, 1.0), at(1, 24.0, 1.1), at(2, 48.0, 1.21), at(3, -30.0, 1.05)];
        let expected = survivors(&points);
        assert_eq!(expected, [0, 3, 2]);
        let orders = [[1, 0, 3, 2], [3, 2, 1, 0], [2, 3, 0, 1], [2, 0, 1, 3]];
        for order in orders {
            assert_eq!(survivors(&order.map(|i| points[i])), expected);
        }
    }
}
