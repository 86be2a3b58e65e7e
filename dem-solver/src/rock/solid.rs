//! The true solid: volume, inertia, surface. The spheres of a cluster overlap and stand only for contact.

use crate::settings::Shape;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Rings and sectors of the surface that is drawn for a sphere.
const RINGS: u32 = 12;
const SECTORS: u32 = 24;

/// The true solid of a rock, centred in its own axes, which are principal axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    shape: Shape,
}

impl Solid {
    /// The solid of a shape.
    pub fn new(shape: &Shape) -> Self {
        Self { shape: *shape }
    }

    /// Volume [m3].
    pub fn volume(&self) -> f64 {
        match self.shape {
            Shape::Box { size: [a, b, c] } => a * b * c,
            Shape::Sphere { radius } => 4.0 / 3.0 * PI * radius * radius * radius,
        }
    }

    /// Principal moments of inertia [kg m2] of `mass` [kg] spread evenly.
    pub fn inertia(&self, mass: f64) -> Vector3<f64> {
        match self.shape {
            Shape::Box { size: [a, b, c] } => {
                Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b) * (mass / 12.0)
            }
            Shape::Sphere { radius } => Vector3::repeat(0.4 * mass * radius * radius),
        }
    }

    /// Closed surface with outward normals, for pictures: points [m] and triangles.
    pub fn surface(&self) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
        match self.shape {
            Shape::Box { size } => box_surface(size.into()),
            Shape::Sphere { radius } => sphere_surface(radius),
        }
    }

    /// In words, with numbers.
    pub fn describe(&self) -> String {
        match self.shape {
            Shape::Box { size: [a, b, c] } => format!("box {a} x {b} x {c} m"),
            Shape::Sphere { radius } => format!("sphere of radius {radius} m"),
        }
    }
}

fn box_surface(size: Vector3<f64>) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let corner = |c: u32| {
        let sign = |bit: u32| if c & bit == 0 { -0.5 } else { 0.5 };
        Vector3::new(sign(1), sign(2), sign(4)).component_mul(&size)
    };
    // Each face by its corners, counter-clockwise from outside.
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    ((0..8).map(corner).collect(), triangles)
}

fn sphere_surface(radius: f64) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let mut points = vec![Vector3::z() * radius];
    for ring in 1..RINGS {
        let polar = PI * f64::from(ring) / f64::from(RINGS);
        for sector in 0..SECTORS {
            let turn = 2.0 * PI * f64::from(sector) / f64::from(SECTORS);
            let (sin, cos) = polar.sin_cos();
            points.push(Vector3::new(sin * turn.cos(), sin * turn.sin(), cos) * radius);
        }
    }
    points.push(-Vector3::z() * radius);
    let last = points.len() as u32 - 1;
    let at = |ring: u32, sector: u32| 1 + (ring - 1) * SECTORS + sector % SECTORS;
    let mut triangles = Vec::new();
    for sector in 0..SECTORS {
        triangles.push([0, at(1, sector), at(1, sector + 1)]);
        triangles.push([last, at(RINGS - 1, sector + 1), at(RINGS - 1, sector)]);
        for ring in 1..RINGS - 1 {
            triangles.push([at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1)]);
            triangles.push([at(ring, sector), at(ring + 1, sector + 1), at(ring, sector + 1)]);
        }
    }
    (points, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn enclosed((points, triangles): (Vec<Vector3<f64>>, Vec<[u32; 3]>)) -> f64 {
        let p = |i: u32| points[i as usize];
        triangles.iter().map(|[a, b, c]| p(*a).dot(&p(*b).cross(&p(*c))) / 6.0).sum()
    }

    #[test]
    fn surfaces_are_closed_and_face_outwards() {
        let solid = Solid::new(&Shape::Box { size: [0.2, 0.4, 0.6] });
        assert!((enclosed(solid.surface()) - solid.volume()).abs() < 1e-15);
        let sphere = Solid::new(&Shape::Sphere { radius: 0.5 });
        // An inscribed polyhedron lacks a part of order (pi / rings)^2 / 2.
        let share = enclosed(sphere.surface()) / sphere.volume();
        assert!((0.95..1.0).contains(&share), "{share}");
    }

    /// V-D10: the sphere of equal volume.
    #[test]
    fn the_sphere_of_the_cubes_volume_has_less_inertia() {
        let cube = Solid::new(&Shape::Box { size: [0.41; 3] });
        let sphere = Solid::new(&Shape::Sphere { radius: 0.254_343_701 });
        assert!((sphere.volume() / cube.volume() - 1.0).abs() < 1e-8);
        assert!((sphere.inertia(180.0).x - 4.657_731_72).abs() < 1e-7);
    }
}
