//! The faces of a rock that is a convex polyhedron: what its contact with wires needs of it.

use dem_solid::shape::Surface;
use nalgebra::Vector3;

/// Most faces of a rock that touches wires by them; one with more is round, and its spheres are as good.
const MAX_FACES: usize = 128;

/// Share of its size by which a corner may stand out of a face that counts as convex; and faces whose normals differ by no more
/// are one.
const LEVEL: f64 = 1e-6;

/// The plane of a face, in the rock's own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Unit normal, outwards.
    pub normal: Vector3<f64>,
    /// Its distance from the centre of mass [m].
    pub offset: f64,
}

/// Of a convex polyhedron.
#[derive(Debug, Clone, PartialEq)]
pub struct Faces {
    /// Its faces, in the order of the surface.
    pub planes: Vec<Face>,
    /// Distance of the nearest one from the centre of mass [m].
    pub nearest: f64,
    /// Of the widest face: distance of its furthest corner from its middle [m].
    pub rim: f64,
    /// The corners [m].
    corners: Vec<Vector3<f64>>,
}

impl Faces {
    /// Of a closed surface around the origin; `None` if it is not convex, or round.
    pub fn of(surface: &Surface) -> Option<Self> {
        let size = surface.points.iter().map(|p| p.norm()).fold(0.0, f64::max);
        let mut planes: Vec<Face> = Vec::new();
        for triangle in 0..surface.triangles.len() {
            if surface.area(triangle) <= LEVEL * LEVEL * size * size {
                continue;
            }
            let (normal, corners) = (surface.normal(triangle), surface.corners(triangle));
            let offset = corners.iter().map(|p| normal.dot(p)).fold(f64::NEG_INFINITY, f64::max);
            let known = planes.iter().any(|plane| (plane.normal - normal).norm() < LEVEL);
            if known {
                continue;
            }
            let sticks_out = |p: &Vector3<f64>| normal.dot(p) > offset + LEVEL * size;
            if planes.len() == MAX_FACES || surface.points.iter().any(sticks_out) {
                return None;
            }
            planes.push(Face { normal, offset });
        }
        let nearest = planes.iter().map(|plane| plane.offset).fold(f64::INFINITY, f64::min);
        let rim = |face: &Face| {
            let on = |p: &&Vector3<f64>| face.normal.dot(p) > face.offset - LEVEL * size;
            let own = || surface.points.iter().filter(on);
            let middle = own().sum::<Vector3<f64>>() / own().count().max(1) as f64;
            own().map(|p| (p - middle).norm()).fold(0.0, f64::max)
        };
        let rim = planes.iter().map(rim).fold(0.0, f64::max);
        (nearest > 0.0).then(|| Self { planes, nearest, rim, corners: surface.points.clone() })
    }

    /// The corners [m].
    pub fn corners(&self) -> &[Vector3<f64>] {
        &self.corners
    }

    /// The same with all lengths times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let plane = |face: &Face| Face { offset: face.offset * factor, ..*face };
        Self {
            planes: self.planes.iter().map(plane).collect(),
            nearest: self.nearest * factor,
            rim: self.rim * factor,
            corners: self.corners.iter().map(|p| p * factor).collect(),
        }
    }

    /// True if a line from `a` to `b` with this `radius` [m] lies outside of some face.
    #[inline]
    pub fn is_beside(&self, [a, b]: [&Vector3<f64>; 2], radius: f64) -> bool {
        let outside = |face: &Face| face.normal.dot(a).min(face.normal.dot(b)) > face.offset + radius;
        self.planes.iter().any(outside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rock::solid::Solid;
    use crate::settings::Shape;

    fn faces(shape: Shape) -> Option<Faces> {
        Faces::of(&Solid::new(&shape).expect("built in").0.drawn)
    }

    #[test]
    fn blocks_have_their_faces_and_round_rocks_none() {
        let cube = faces(Shape::Box { size: [0.2, 0.4, 0.6] }).expect("convex");
        assert_eq!(cube.planes.len(), 6);
        assert!((cube.nearest - 0.1).abs() < 1e-15 && (cube.rim - 0.13_f64.sqrt()).abs() < 1e-12);
        let block = faces(Shape::EadBlock { size: 1.0 }).expect("convex");
        assert_eq!(block.planes.len(), 26);
        let hull = faces(Shape::RandomConvex { size: [0.3, 0.5, 0.9], seed: 5, points: 30 }).expect("convex");
        assert!(hull.planes.iter().all(|p| (p.normal.norm() - 1.0).abs() < 1e-12 && p.offset > 0.0));
        assert_eq!(faces(Shape::Sphere { radius: 0.5 }), None);
        assert_eq!(faces(Shape::Ellipsoid { semi_axes: [0.2, 0.3, 0.5] }), None);
    }

    #[test]
    fn a_line_is_beside_the_rock_where_a_face_parts_them() {
        let cube = faces(Shape::Box { size: [1.0; 3] }).expect("convex");
        let line = |z: f64| [Vector3::new(-2.0, 0.1, z), Vector3::new(2.0, 0.1, z)];
        let beside = |z: f64, radius: f64| {
            let [a, b] = line(z);
            cube.is_beside([&a, &b], radius)
        };
        assert!(beside(0.51, 0.0) && !beside(0.51, 0.02) && !beside(0.0, 0.0));
        assert_eq!(cube.scaled(2.0).nearest, 1.0);
    }
}
