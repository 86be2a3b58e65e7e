//! Geometry, and the solid of a rock: its true shape, and the spheres that stand for it in contact.
//!
//! Each of these uses only what stands above it.
//!
//! - [`row`](mod@row): long rows of numbers, in memory or in a file
//! - [`geometry`]: spheres, triangles, closest points, trees of boxes
//! - [`random`]: numbers that look like chance
//! - [`input`]: files that users give, their lines and numbers
//! - [`shape`]: the true solid of a rock as a closed surface, from built-in shapes and files ([`shape::formats`])
//! - [`cluster`](mod@cluster): spheres that stand for a surface, and their error

pub mod cluster;
pub mod geometry;
pub mod input;
pub mod random;
pub mod row;
pub mod shape;
