//! Which spheres may touch which wall elements, at a cost that follows the touching pairs.
//!
//! 1. [`near`]: wall elements around a rock. Found by a pass over the wall, then kept until rock and
//!    wall have moved by a skin.
//! 2. [`pairs`]: (sphere, element) pairs within a smaller skin, from the [`tree`] over the spheres in
//!    the rock's own frame, which is built once and never changes.
//!
//! Over [`terrain`] the same with triangles that stand still, and [`course`] says when a flying rock may meet one.
//! [`rocks`] lists pairs of spheres of two rocks likewise.
//!
//! All lists only leave out what cannot touch, and what is done with them runs in one fixed order,
//! so that no result depends on when a list was made.

pub mod boxes;
pub mod cells;
pub mod course;
pub mod near;
pub mod pairs;
pub mod rocks;
pub mod shared;
pub mod terrain;
pub mod tree;
