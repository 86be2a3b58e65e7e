//! Closest points of the pairs of a list, and which of several that one sphere touches are contacts.
//!
//! - [`sphere_mesh`]: spheres and elements of the interface mesh
//! - [`selection`]: which of several closest points are contacts; [`faces`]: without a jump over edges

pub mod faces;
pub mod selection;
pub mod sphere_mesh;
