//! States in which the forces balance, without time.
//!
//! - [`newton`]: Newton's iteration to one state, given its load; implicit steps use it as well; why there is none
//! - [`arc_length`]: along a curve of states, over limit points and branches
//! - [`form_finding`]: the state of a slack net under its dead load

pub mod arc_length;
pub mod form_finding;
pub mod newton;
