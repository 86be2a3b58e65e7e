//! Which spheres may touch which elements of a partner, at a cost that follows the touching pairs.
//!
//! 1. [`mesh_elements`]: elements of the interface mesh around a rock. Found by a pass over the mesh, then kept until rock and
//!    mesh have moved by a skin.
//! 2. [`mesh_pairs`]: (sphere, element) pairs within a smaller skin, from the [`dem_solid::geometry::sphere_tree`] over the spheres in
//!    the rock's own frame, which is built once and never changes.
//!
//! [`terrain_pairs`] does the same with triangles that stand still, and [`time_of_impact`] says when a flying rock may touch
//! one. [`rock_pairs`] lists pairs of spheres of two rocks, [`cell_grid`] pairs of loose spheres.
//!
//! All lists only leave out what cannot touch, and what is done with them runs in one fixed order,
//! so that no result depends on when a list was made.

pub mod cell_grid;
pub mod mesh_elements;
pub mod mesh_pairs;
pub mod rock_pairs;
pub mod terrain_pairs;
pub mod time_of_impact;
