//! The true solid: volume, inertia, surface. The spheres of a cluster overlap and stand only for contact.

use dem_solid::shape::{Shape, SolidIntegrals, Surface};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// The true solid of a rock. Where nothing else is said, in its principal axes with the origin in the
/// centre of mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// What it is made of.
    pub shape: Shape,
    /// Of the shape in its own axes; volume and inertia are exact where there is a formula ([`Solid::volume`], [`Solid::inertia`]).
    pub body: SolidIntegrals,
    /// Closed surface with outward normals, for pictures.
    pub drawn: Surface,
}

impl Solid {
    /// The solid of a shape, and what was mended in its file.
    pub fn new(shape: &Shape) -> Result<(Self, Vec<String>), Diagnostic> {
        let (drawn, notes) = shape.surface(true)?;
        let mut solid = Self { shape: shape.clone(), body: SolidIntegrals::of(&drawn), drawn };
        if solid.is_symmetric() {
            // Exactly, where the integrals leave a trace of rounding.
            solid.body.centre = Vector3::zeros();
        } else {
            solid.drawn.points = solid.drawn.points.iter().map(|p| solid.own(p)).collect();
        }
        Ok((solid, notes))
    }

    /// The same solid with all its lengths times `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let mut drawn = self.drawn.clone();
        drawn.points.iter_mut().for_each(|p| *p *= factor);
        let body = SolidIntegrals {
            volume: self.body.volume * factor.powi(3),
            centre: self.body.centre * factor,
            gyration: self.body.gyration * (factor * factor),
            ..self.body
        };
        Self { shape: self.shape.scaled(factor), body, drawn }
    }

    /// True if the shape's own axes are principal and its origin is the centre of mass, by symmetry.
    fn is_symmetric(&self) -> bool {
        !matches!(self.shape, Shape::RandomConvex { .. } | Shape::ConvexHull { .. } | Shape::Mesh { .. })
    }

    /// Volume [m3].
    pub fn volume(&self) -> f64 {
        match self.shape {
            Shape::Box { size: [a, b, c] } => a * b * c,
            Shape::Sphere { radius } => 4.0 / 3.0 * PI * radius * radius * radius,
            Shape::Ellipsoid { semi_axes: [a, b, c] } => 4.0 / 3.0 * PI * a * b * c,
            _ => self.body.volume,
        }
    }

    /// Principal moments of inertia [kg m2] of `mass` [kg] spread evenly.
    pub fn inertia(&self, mass: f64) -> Vector3<f64> {
        match self.shape {
            Shape::Box { size: [a, b, c] } => {
                Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b) * (mass / 12.0)
            }
            Shape::Sphere { radius } => Vector3::repeat(0.4 * mass * radius * radius),
            Shape::Ellipsoid { semi_axes: [a, b, c] } => {
                Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b) * (mass / 5.0)
            }
            _ => self.body.gyration * mass,
        }
    }

    /// From the principal axes to the shape's own; `None` where they are the same.
    pub fn turn(&self) -> Option<UnitQuaternion<f64>> {
        (!self.is_symmetric()).then(|| UnitQuaternion::from_rotation_matrix(&self.body.axes))
    }

    /// A point of the shape's own axes in the principal axes, from the centre of mass [m].
    pub fn own(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.turn().map_or(*point, |turn| turn.inverse_transform_vector(&(point - self.body.centre)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid(shape: Shape) -> Solid {
        Solid::new(&shape).expect("built in").0
    }

    #[test]
    fn surfaces_are_closed_and_face_outwards() {
        let enclosed = |s: &Solid| SolidIntegrals::of(&s.drawn).volume;
        let cuboid = solid(Shape::Box { size: [0.2, 0.4, 0.6] });
        assert!((enclosed(&cuboid) - cuboid.volume()).abs() < 1e-15);
        let sphere = solid(Shape::Sphere { radius: 0.5 });
        // An inscribed polyhedron of 1280 triangles: edges of 0.15 radii, a lack of (0.15)^2 / 4 at most.
        let share = enclosed(&sphere) / sphere.volume();
        assert!((0.99..1.0).contains(&share), "{share}");
    }

    /// V-D10: the sphere of equal volume.
    #[test]
    fn the_sphere_of_the_cubes_volume_has_less_inertia() {
        let cube = solid(Shape::Box { size: [0.41; 3] });
        let sphere = solid(Shape::Sphere { radius: 0.254_343_701 });
        assert!((sphere.volume() / cube.volume() - 1.0).abs() < 1e-8);
        assert!((sphere.inertia(180.0).x - 4.657_731_72).abs() < 1e-7);
    }

    /// The closed form of the ellipsoid against the integrals over a fine polyhedron: edges of 0.038 radii, on
    /// average 1.2e-4 to 1.8e-4 radii inside; three times that in volume, five times in inertia over mass times volume.
    #[test]
    fn closed_forms_agree_with_the_integrals_over_the_surface() {
        for shape in [Shape::Ellipsoid { semi_axes: [0.2, 0.3, 0.5] }, Shape::Box { size: [0.2, 0.3, 0.5] }] {
            let solid = solid(shape.clone());
            let body = SolidIntegrals::of(&shape.surface(false).expect("built in").0);
            assert!((solid.volume() / body.volume - 1.0).abs() < 6e-4);
            for (a, b) in solid.inertia(1.0).iter().zip(body.gyration.iter()) {
                assert!((a / b - 1.0).abs() < 6e-4);
            }
        }
    }

    #[test]
    fn a_solid_without_symmetry_is_told_in_its_principal_axes() {
        let shape = Shape::RandomConvex { size: [0.3, 0.5, 0.9], seed: 5, points: 40 };
        let solid = solid(shape);
        let drawn = SolidIntegrals::of(&solid.drawn);
        assert!(drawn.centre.norm() < 1e-15);
        let tensor = solid.inertia(1.0);
        for (a, b) in tensor.iter().zip(drawn.gyration.iter()) {
            assert!((a / b - 1.0).abs() < 1e-12, "{tensor} {}", drawn.gyration);
        }
        let turn = solid.turn().expect("turned");
        let corner = Vector3::new(0.1, 0.2, 0.3);
        assert!((turn * solid.own(&corner) + solid.body.centre - corner).norm() < 1e-15);
    }
}
