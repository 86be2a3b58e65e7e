//! The true solid of a rock as a closed surface of triangles.
//!
//! - [`surface`]: triangles with common corners
//! - [`closed`]: welded, consistently oriented, checked; what is wrong and where it is
//! - [`crossing`]: whether a surface runs through itself
//! - [`holes`], [`pieces`]: small holes closed when asked for, one of several surfaces
//! - [`integrals`]: exact volume, centre and inertia
//! - [`tree`]: the nearest point of a surface, on which side of it a point lies
//! - [`builtin`], [`hull`]: shapes that need no file
//! - [`formats`]: readers of files
//! - [`spec`]: one shape from all of these, as a scene or a command line names it

pub mod builtin;
pub mod closed;
pub mod crossing;
pub mod formats;
pub mod holes;
pub mod hull;
pub mod integrals;
pub mod pieces;
pub mod spec;
pub mod surface;
pub mod tree;

pub use integrals::SolidIntegrals;
pub use spec::Shape;
pub use surface::Surface;
