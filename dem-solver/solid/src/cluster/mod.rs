//! From a closed surface to overlapping spheres, and how well they approximate it.
//!
//! - [`wish`]: what a cluster is to be
//! - [`ball`]: the largest ball in the solid that touches the surface at a point
//! - [`samples`]: points of the surface, as dense as the balls there require
//! - [`gaps`]: how far each of them lies outside of all balls so far
//! - [`cover`]: balls, until nothing lies further outside than a given error
//! - [`make`]: the error that a number of spheres reaches, and the spheres
//! - [`search`]: a second search where the first does not settle, and spheres moved to where the error is largest
//! - [`bound`]: whether that error is small enough, and what to try if it is not
//! - [`index`], [`accuracy`], [`probe`], [`volume`]: the error of any cluster, measured
//! - [`files`]: `x y z r` text and Kratos `.clu`
//! - [`kept`]: a cluster beside its scene, so that a run does not make it twice
//! - [`lattice`]: the spheres that fill a box

pub mod accuracy;
pub mod ball;
pub mod bound;
pub mod cover;
pub mod files;
pub mod gaps;
pub mod index;
pub mod kept;
pub mod lattice;
pub mod make;
pub mod probe;
pub mod samples;
pub mod search;
pub mod volume;
pub mod wish;

pub use accuracy::Accuracy;
pub use bound::Bound;
pub use make::{make, measured};
pub use wish::{Fit, MOST_SPHERES, Wish};
