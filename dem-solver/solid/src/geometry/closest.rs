//! The closest point of one mesh element to a sphere's centre: first stage of the double hierarchy.
//!
//! An element is convex, so that its closest point is one: inside a face, else on one of its edges,
//! else at one of its nodes. The point comes with the weights that interpolate the element's nodes
//! there; they add up to one, hence `sum N_a x_a` is the point and nodal forces `N_a f` keep force
//! and moment.
//!
//! Source: Santasusana et al. (2016), Computational Particle Mechanics 3, 407 (the hierarchy); Ericson (2005), Real-Time Collision
//! Detection, 5.1.5 (the triangle).

use nalgebra::Vector3;

/// What the closest point lies on, in the order of the hierarchy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// Inside a face.
    Face,
    /// Inside an edge or a line.
    Edge,
    /// At a node.
    Node,
}

/// The closest point of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// From the sphere's centre to it [m].
    pub to_point: Vector3<f64>,
    /// Interpolation weights of the element's nodes.
    pub weights: [f64; 3],
    /// What it lies on.
    pub feature: Feature,
}

/// Closest point of the line from `start` along `edge` to `centre`; `inverse` is
/// `1 / |edge|^2`, 0 for a line without length.
#[inline]
pub fn on_line(centre: &Vector3<f64>, start: &Vector3<f64>, edge: &Vector3<f64>, inverse: f64) -> Closest {
    let from_centre = start - centre;
    let foot = -from_centre.dot(edge) * inverse;
    // Without a branch that would be guessed wrong half of the time.
    let foot = if foot > 0.0 { foot } else { 0.0 };
    let eta = if foot < 1.0 { foot } else { 1.0 };
    let feature = if eta > 0.0 && eta < 1.0 { Feature::Edge } else { Feature::Node };
    Closest { to_point: from_centre + edge * eta, weights: [1.0 - eta, eta, 0.0], feature }
}

/// Closest point of the triangle `corners` to `centre`.
#[inline]
pub fn on_face(centre: &Vector3<f64>, corners: [&Vector3<f64>; 3]) -> Closest {
    let [a, b, c] = corners.map(|p| p - centre);
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(&a), -ac.dot(&a));
    let (d3, d4) = (-ab.dot(&b), -ac.dot(&b));
    let (d5, d6) = (-ab.dot(&c), -ac.dot(&c));
    let node = |to_point, weights| Closest { to_point, weights, feature: Feature::Node };
    if d1 <= 0.0 && d2 <= 0.0 {
        return node(a, [1.0, 0.0, 0.0]);
    }
    if d3 >= 0.0 && d4 <= d3 {
        return node(b, [0.0, 1.0, 0.0]);
    }
    if d6 >= 0.0 && d5 <= d6 {
        return node(c, [0.0, 0.0, 1.0]);
    }
    let edge = |to_point, weights| Closest { to_point, weights, feature: Feature::Edge };
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return edge(a + ab * t, [1.0 - t, t, 0.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return edge(a + ac * t, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return edge(b + (c - b) * t, [0.0, 1.0 - t, t]);
    }
    let scale = 1.0 / (va + vb + vc);
    let (v, w) = (vb * scale, vc * scale);
    // Along the normal: the foot is then the same from every triangle of a plane, to rounding.
    let normal = ab.cross(&ac);
    let to_point = normal * (normal.dot(&a) / normal.norm_squared());
    Closest { to_point, weights: [1.0 - v - w, v, w], feature: Feature::Face }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0_f64).prop_map(Vector3::from)
    }

    fn check(centre: &Vector3<f64>, corners: &[Vector3<f64>], closest: &Closest) {
        let sum: f64 = closest.weights.iter().sum();
        assert!((sum - 1.0).abs() < 1e-14 && closest.weights.iter().all(|n| *n >= -1e-12));
        let at: Vector3<f64> = corners.iter().zip(&closest.weights).map(|(x, n)| x * *n).sum();
        // The weights of a sliver are as exact as its area; proptest finds areas down to 1e-4.
        assert!((at - centre - closest.to_point).norm() < 1e-9, "the weights interpolate the point");
        let distance = closest.to_point.norm();
        for i in 0..=20 {
            for j in 0..=(20 - i) {
                let (v, w) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                let third = if corners.len() == 3 { corners[2] } else { corners[1] };
                let other = corners[0] * (1.0 - v - w) + corners[1] * v + third * w;
                assert!((other - centre).norm() >= distance - 1e-9, "no point is closer");
            }
        }
    }

    proptest! {
        #[test]
        fn no_point_of_a_face_is_closer(centre in point(), a in point(), b in point(), c in point()) {
            prop_assume!((b - a).cross(&(c - a)).norm() > 1e-3);
            check(&centre, &[a, b, c], &on_face(&centre, [&a, &b, &c]));
        }

        #[test]
        fn no_point_of_a_line_is_closer(centre in point(), a in point(), b in point()) {
            let edge = b - a;
            prop_assume!(edge.norm() > 1e-3);
            check(&centre, &[a, b], &on_line(&centre, &a, &edge, 1.0 / edge.norm_squared()));
        }
    }

    #[test]
    fn a_line_without_length_is_its_node() {
        let (start, edge) = (Vector3::new(1.0, 0.0, 0.0), Vector3::zeros());
        let closest = on_line(&Vector3::zeros(), &start, &edge, 0.0);
        assert_eq!((closest.to_point, closest.feature), (start, Feature::Node));
    }
}
