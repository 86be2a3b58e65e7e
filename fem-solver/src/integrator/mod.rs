//! From one instant to the next.
//!
//! - [`window`]: one window: the interface force in, motion out; halving, load steps: begin here
//! - [`start`]: the state at t = 0; [`critical_step`]: the longest stable step
//! - [`explicit`]: central differences; [`implicit`]: generalised alpha, Bossak, Newmark
//! - [`interface_force`]: the interface force within a window; [`shown`]: the nodes that fields are laid out for
//! - [`local`]: force and tangent at selected nodes, so that a contact solver can move them itself

pub mod critical_step;
pub mod explicit;
pub mod implicit;
pub mod interface_force;
pub mod local;
pub mod shown;
pub mod start;
pub mod window;
