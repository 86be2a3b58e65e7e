//! Whether a surface runs through itself.
//!
//! Every pair of triangles whose boxes overlap is tested: an edge of one must not pass through the other.
//! Signs of volumes are exact (adaptive precision), so that neighbours that lie in one plane, which
//! rocks have many of, are not taken for crossing ones, and a touch is one.
//! Source of the predicate: Shewchuk (1997), Discrete Comput. Geom. 18, 305.

use super::surface::Surface;
use super::tree::SurfaceTree;
use nalgebra::Vector3;
use robust::{Coord3D, orient3d};

/// The first two triangles that cross or touch without being neighbours, and a point near that place.
pub fn find(surface: &Surface) -> Option<(usize, usize, Vector3<f64>)> {
    let tree = SurfaceTree::new(surface);
    let mut first: Option<(usize, usize)> = None;
    tree.pairs(|a, b| {
        let (a, b) = (a as usize, b as usize);
        if first.is_none_or(|best| (a, b) < best) && cross(surface, a, b) {
            first = Some((a, b));
        }
    });
    let (a, b) = first?;
    let middle = |t: usize| surface.corners(t).iter().sum::<Vector3<f64>>() / 3.0;
    Some((a, b, (middle(a) + middle(b)) / 2.0))
}

fn cross(surface: &Surface, a: usize, b: usize) -> bool {
    let (ta, tb) = (surface.triangles[a], surface.triangles[b]);
    let (pa, pb) = (surface.corners(a), surface.corners(b));
    let shared: Vec<u32> = ta.iter().copied().filter(|v| tb.contains(v)).collect();
    match shared.len() {
        // Neighbours at an edge touch elsewhere only if one is folded onto the other.
        2 => {
            let apex = |t: [u32; 3], p: [Vector3<f64>; 3]| {
                let k = (0..3).find(|k| !shared.contains(&t[*k])).unwrap_or(0);
                p[k]
            };
            let (first, second) = (apex(ta, pa), apex(tb, pb));
            volume(&pa, &second) == 0.0 && {
                let from = surface.points[shared[0] as usize];
                let along = surface.points[shared[1] as usize] - from;
                along.cross(&(first - from)).dot(&along.cross(&(second - from))) > 0.0
            }
        }
        // Neighbours at a corner: the edge opposite to it must not pass through the other triangle.
        1 => {
            let opposite = |t: [u32; 3], p: [Vector3<f64>; 3]| {
                let k = (0..3).find(|k| t[*k] == shared[0]).unwrap_or(0);
                (p[(k + 1) % 3], p[(k + 2) % 3])
            };
            let ((p, q), (r, s)) = (opposite(ta, pa), opposite(tb, pb));
            pierces(&p, &q, &pb) || pierces(&r, &s, &pa)
        }
        0 => (0..3).any(|k| pierces(&pa[k], &pa[(k + 1) % 3], &pb) || pierces(&pb[k], &pb[(k + 1) % 3], &pa)),
        _ => true,
    }
}

/// Six times the volume of a triangle and a point, its sign exact.
fn volume([a, b, c]: &[Vector3<f64>; 3], d: &Vector3<f64>) -> f64 {
    let coord = |p: &Vector3<f64>| Coord3D { x: p.x, y: p.y, z: p.z };
    orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// True if the segment from `p` to `q` touches the triangle.
fn pierces(p: &Vector3<f64>, q: &Vector3<f64>, t: &[Vector3<f64>; 3]) -> bool {
    let (above, below) = (volume(t, p), volume(t, q));
    if above == 0.0 && below == 0.0 {
        return meets_in_plane(p, q, t);
    }
    if above * below > 0.0 {
        return false;
    }
    let side = |k: usize| volume(&[*p, *q, t[k]], &t[(k + 1) % 3]);
    let (a, b, c) = (side(0), side(1), side(2));
    (a >= 0.0 && b >= 0.0 && c >= 0.0) || (a <= 0.0 && b <= 0.0 && c <= 0.0)
}

/// The same for a segment in the triangle's plane: no line along an edge, and none along the segment,
/// keeps them apart.
fn meets_in_plane(p: &Vector3<f64>, q: &Vector3<f64>, t: &[Vector3<f64>; 3]) -> bool {
    let normal = (t[1] - t[0]).cross(&(t[2] - t[0]));
    let apart = |axis: Vector3<f64>| {
        let spread = |points: &[Vector3<f64>]| {
            points
                .iter()
                .map(|x| axis.dot(&(x - t[0])))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        };
        let (a, b) = (spread(&[*p, *q]), spread(t));
        a.0 > b.1 || b.0 > a.1
    };
    let across = |d: Vector3<f64>| normal.cross(&d);
    !(apart(across(q - p)) || (0..3).any(|k| apart(across(t[(k + 1) % 3] - t[k]))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::builtin;

    #[test]
    fn surfaces_with_many_triangles_in_one_plane_do_not_cross() {
        assert_eq!(find(&builtin::cuboid(Vector3::new(0.1, 0.2, 0.3))), None);
        assert_eq!(find(&builtin::cut_cube(Vector3::new(1.1, 1.1, 0.55))), None);
        assert_eq!(find(&builtin::ellipsoid(Vector3::new(0.3, 0.5, 0.2), 4)), None);
    }

    #[test]
    fn a_segment_meets_a_triangle_inside_at_its_border_and_in_its_plane() {
        let t = [Vector3::zeros(), Vector3::x(), Vector3::y()];
        let meets = |p: [f64; 3], q: [f64; 3]| pierces(&p.into(), &q.into(), &t);
        assert!(meets([0.2, 0.2, -1.0], [0.2, 0.2, 1.0]));
        assert!(meets([0.5, 0.0, -1.0], [0.5, 0.0, 1.0]), "through an edge");
        assert!(meets([0.2, 0.2, 0.0], [0.2, 0.2, 1.0]), "an end on it");
        assert!(!meets([0.2, 0.2, 1e-300], [0.2, 0.2, 1.0]));
        assert!(!meets([0.6, 0.6, -1.0], [0.6, 0.6, 1.0]));
        assert!(meets([-1.0, 0.2, 0.0], [1.0, 0.2, 0.0]), "in the plane");
        assert!(!meets([-1.0, -0.2, 0.0], [1.0, -0.2, 0.0]));
    }
}
