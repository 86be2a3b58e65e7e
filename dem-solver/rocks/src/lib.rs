//! The motion of rocks through a run, and what is reported of it.
//!
//! Each of these uses only what stands above it.
//!
//! - [`model`]: the prepared scene, the largest stable step, the state of all rocks
//! - [`gate`]: what is refused and warned of before anything starts
//! - [`guard`]: what stops a run that would end with a wrong answer
//! - [`results`]: what is reported
//! - [`integrator`]: the steps of a window
//! - [`solver`]: the contract; [`granular`]: the same for thousands of separate spheres alone
//! - [`check`](mod@check), [`net_contact`], [`reference`]: what would be built, what a net must know of it, what is read and written, for editors

pub mod check;
pub mod gate;
pub mod granular;
pub mod guard;
pub mod integrator;
pub mod model;
pub mod net_contact;
pub mod reference;
pub mod results;
pub mod solver;

pub use solver::DemSolver;
