//! Large-displacement statics and dynamics of cable nets.
//!
//! Begin at [`integrator::window`]: one window, the interface force in, motion out. What a step asks of the structure is
//! [`internal_force::InternalForce`]; what an element is, [`element::Element`] says, and what a scene states of it
//! [`element::part::PartSettings`].
//!
//! The folders, from below; each uses only those above it in this list:
//!
//! - [`read`]: mesh files of other programs; bounds of single numbers
//! - [`linear_algebra`]: sparse factors, long vectors
//! - [`ground`]: the surface of the ground, and how far a point is from it
//! - [`element`]: each element with energy, force, tangent, history, and its settings; laws of materials
//! - [`config`]: the tables `[structure]`, `[fem]`, `[[gauge]]`
//! - [`model`]: nodes, elements, supports, loads, lumped masses; generated structures; ranges of their numbers
//! - [`internal_force`]: all elements together: force, energy, tangent, history, ruptures
//! - [`state`]: a state, and the one that a run leaves and another starts from
//! - [`equilibrium`]: Newton's iteration, arc length, form finding
//! - [`results`]: reactions, gauges, energies, fields
//! - [`integrator`]: steps in time, the critical one, the state at t = 0, one window
//! - [`solver`]: the contract's two ends, `check` and `serve`
//!
//! Units are SI throughout. Vectors over all degrees of freedom are component-major: the x of all nodes, then y, then z, then
//! rotations in the same manner; at the interface they are node-major. Displacements count from the structure as modelled
//! inside, and from t = 0 at the interface. Nothing here knows what loads the structure.

pub mod config;
pub mod element;
pub mod equilibrium;
pub mod export;
pub mod ground;
pub mod integrator;
pub mod internal_force;
pub mod linear_algebra;
pub mod model;
pub mod read;
pub mod results;
pub mod solver;
pub mod state;

pub use solver::FemSolver;

use toolkit::program::Program;

/// The program `fem-solver`.
pub const PROGRAM: Program = Program {
    name: "fem-solver",
    role: "fem",
    about: "Structural solver: nets, ropes, brakes, posts and membranes at large displacements",
    build: |scene, options| Ok(Box::new(FemSolver::new(scene, options)?)),
    check: |scene, _, trial| solver::check::check(scene, trial),
    schema: solver::reference::share,
};
