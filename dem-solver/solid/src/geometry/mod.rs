//! Geometry that knows nothing of rocks and laws: spheres, triangles, closest points, a tree of boxes, whether elements share
//! their nodes; lines and areas seen from above.

pub mod box_tree;
pub mod closest;
pub mod median_tree;
pub mod plan;
pub mod shared_nodes;
pub mod sphere;
pub mod sphere_tree;
pub mod triangle;

use nalgebra::Vector3;

/// Lowest and highest corner of the box around points [m].
pub fn bounds(points: impl IntoIterator<Item = Vector3<f64>>) -> [Vector3<f64>; 2] {
    let nowhere = [f64::INFINITY, f64::NEG_INFINITY].map(Vector3::repeat);
    points.into_iter().fold(nowhere, |[low, high], p| [low.inf(&p), high.sup(&p)])
}

/// Normal of a triangle, as long as twice its area [m2].
pub fn double_area([a, b, c]: [Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a))
}

/// True if the height of a triangle over its longest edge is at most `share` of that edge.
pub fn is_flat(corners: [Vector3<f64>; 3], share: f64) -> bool {
    let [a, b, c] = corners;
    let longest = (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared());
    // Twice the area over the longest edge squared is the height over that edge, in edges.
    double_area(corners).norm() <= share * longest
}

/// Number the corners in the order in which the triangles name them, so that what is near lies together in memory; one that none
/// names is left out.
pub fn by_first_use(points: &mut Vec<Vector3<f64>>, triangles: &mut [[u32; 3]]) {
    let mut place = vec![u32::MAX; points.len()];
    let mut ordered = Vec::with_capacity(points.len());
    for corner in triangles.as_flattened_mut() {
        let at = &mut place[*corner as usize];
        if *at == u32::MAX {
            *at = ordered.len() as u32;
            ordered.push(points[*corner as usize]);
        }
        *corner = *at;
    }
    *points = ordered;
}
