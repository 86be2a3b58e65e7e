//! Triangles with common corners: the surface of a solid, once it is closed ([`super::closed`]).

use crate::geometry::{bounds, double_area};
use nalgebra::Vector3;
use std::collections::HashMap;

/// A closed surface of one piece, its triangles counter-clockwise as seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Corners [m].
    pub points: Vec<Vector3<f64>>,
    /// Corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Corners of a triangle [m].
    pub fn corners(&self, triangle: usize) -> [Vector3<f64>; 3] {
        self.triangles[triangle].map(|p| self.points[p as usize])
    }

    /// Unit normal of a triangle, outwards.
    pub fn normal(&self, triangle: usize) -> Vector3<f64> {
        double_area(self.corners(triangle)).normalize()
    }

    /// Area of a triangle [m2].
    pub fn area(&self, triangle: usize) -> f64 {
        0.5 * double_area(self.corners(triangle)).norm()
    }

    /// Smallest box around it: lowest and highest corner [m].
    pub fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        bounds(self.points.iter().copied()).into()
    }

    /// Diagonal of the smallest box around it [m].
    pub fn size(&self) -> f64 {
        let (lowest, highest) = self.bounds();
        (highest - lowest).norm()
    }
}

/// Loose triangles with corners of equal coordinates made one: the corners, and their numbers by triangle.
pub fn joined(corners: &[[Vector3<f64>; 3]]) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let mut points = Vec::new();
    let mut known: HashMap<[u64; 3], u32> = HashMap::new();
    let mut number = |p: &Vector3<f64>| {
        // Adding zero makes -0 and 0 one corner.
        *known.entry([p.x, p.y, p.z].map(|c| (c + 0.0).to_bits())).or_insert_with(|| {
            points.push(*p);
            points.len() as u32 - 1
        })
    };
    let triangles = corners.iter().map(|c| [number(&c[0]), number(&c[1]), number(&c[2])]).collect();
    (points, triangles)
}

/// A point as messages name it.
pub(super) fn place(p: &Vector3<f64>) -> String {
    format!("({:.6}, {:.6}, {:.6})", p.x, p.y, p.z)
}
