//! Elements: each answers with energy, force and tangent at given displacements.
//!
//! Displacements count from the structure as it is modelled. With `W` the energy, the internal
//! force is `f = dW/du` and the tangent `K = df/du`; the tests of each file differentiate one to
//! find the other. What many cables do at once, and fast, is in [`crate::kernel`].

pub mod cable;
pub mod mass;
pub mod spring;

pub use cable::Cable;
pub use mass::PointMass;
pub use spring::Spring;
