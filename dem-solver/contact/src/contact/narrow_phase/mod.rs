//! Closest points of the pairs of a list, and which of several that one sphere touches are contacts.
//!
//! - [`sphere_mesh`]: spheres and elements of the interface mesh
//! - [`line_in_faces`]: lines in a rock that is a convex polyhedron
//! - [`selection`]: which of several closest points are contacts; [`faces`]: without a jump over edges

pub mod faces;
pub mod line_in_faces;
pub mod selection;
pub mod sphere_mesh;

use super::pipeline::Site;
use dem_solid::geometry::closest::Feature;
use dem_solid::geometry::sphere::Sphere;
use nalgebra::Vector3;

/// A sphere of a rock and the closest point of an element of a surface, in the frame in which contacts are found: along the axes of
/// space on terrain, in the rock's own frame on the interface mesh.
#[derive(Debug, Clone, Copy)]
pub struct Touch {
    /// Unit vector from the sphere's centre to the point.
    pub normal: Vector3<f64>,
    /// Distance of the two [m].
    pub distance: f64,
    /// Overlap, above 0 [m].
    pub overlap: f64,
    /// The sphere's centre from the rock's centre of mass [m].
    pub centre: Vector3<f64>,
    /// The sphere's radius [m].
    pub radius: f64,
    /// Radius around the element [m].
    pub thickness: f64,
    /// Weights of the element's nodes at the point; on terrain where they are needed.
    pub weights: [f64; 3],
    /// Multiplicity with which it counts: 1, but for nodes and edges that several elements share.
    pub share: f64,
    /// Number of the sphere.
    pub sphere: u32,
    /// The element: of terrain the number of the triangle, of the mesh the place in the pair list.
    pub element: u32,
    /// What its memory is kept under: the number of the element, or one beyond all elements for a node or an edge.
    pub key: u32,
    /// What the point lies on.
    pub feature: Feature,
}

impl Touch {
    /// Of sphere number `sphere`, which is `ball` at `centre`, with element number `element`, which has no thickness.
    #[inline(always)]
    pub fn new(
        (ball, sphere): (&Sphere, u32),
        centre: Vector3<f64>,
        element: u32,
        (normal, distance): (Vector3<f64>, f64),
        feature: Feature,
    ) -> Self {
        Self {
            normal,
            distance,
            overlap: ball.radius - distance,
            centre,
            radius: ball.radius,
            thickness: 0.0,
            weights: [0.0; 3],
            share: 1.0,
            sphere,
            element,
            key: element,
            feature,
        }
    }

    /// The point on the surface, from the rock's centre of mass [m].
    #[inline]
    pub fn arm(&self) -> Vector3<f64> {
        self.centre + self.normal * (self.distance - self.thickness)
    }

    /// Its geometry as a contact.
    #[inline]
    pub fn site(&self) -> Site {
        let (normal, overlap, radius, weight) = (self.normal, self.overlap, self.radius, self.share);
        Site { normal, overlap, radius, smaller: radius, arm: self.arm(), weight }
    }
}

/// Number of contacts, shared points counted by their shares.
pub fn count(contacts: &[Touch]) -> usize {
    let sum: f64 = contacts.iter().map(|c| c.share).sum();
    if sum >= 1.0 { sum as usize } else { contacts.len().min(1) }
}
