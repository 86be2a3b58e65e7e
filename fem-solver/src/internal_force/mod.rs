//! What the structure answers to displacements: force, energy, tangent, history.
//!
//! - [`assembly`]: all elements but plain cables, one by one; ruptures
//! - [`kernel`]: all plain cables at once, fast
//! - [`tangent`]: the sparse stiffness of all

pub mod assembly;
pub mod kernel;
pub mod tangent;
