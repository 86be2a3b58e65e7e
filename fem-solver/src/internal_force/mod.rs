//! What the structure answers to displacements: force, energy, tangent, history.
//!
//! - [`assembly`]: all elements but plain cables, one by one; ruptures
//! - [`kernel`]: all plain cables at once, fast
//! - [`tangent`]: the sparse stiffness of all
//! - [`mass_scaling`]: masses for longer steps

pub mod assembly;
pub mod kernel;
pub mod mass_scaling;
pub mod tangent;
