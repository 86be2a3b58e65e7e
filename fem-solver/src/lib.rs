//! Large-displacement statics and dynamics of cable nets.
//!
//! From the scene's tables to a run:
//!
//! - [`config`]: the tables `[structure]`, `[fem]`, `[[gauge]]`
//! - [`read`]: mesh files of other programs
//! - [`model`]: nodes, elements, supports, loads, lumped masses; generated structures
//! - [`element`], [`material`]: each element with energy, force, tangent, history; laws
//! - [`assembly`]: elements one by one
//! - [`kernel`], [`scattered`], [`lanes`]: all cables at once, fast; loops over long vectors
//! - [`tangent`], [`linear_solver`], [`newton`]: the sparse tangent, its Cholesky factor, Newton's iteration
//! - [`elimination`], [`fronts`], [`dense`]: of the factor, the order and the fronts, their traffic, their arithmetic
//! - [`form_finding`], [`critical_step`], [`start`]: the state at t = 0 and the longest step
//! - [`inherited`]: the state at the end, and a run that starts from it
//! - [`explicit`], [`implicit`], [`path`]: one step in time, or along a path of equilibrium
//! - [`loads`], [`march`]: one window: the interface force in, motion out
//! - [`record`], [`probe`], [`height`], [`moving_mean`], [`energy`], [`fields`], [`legend`]: what is reported of it
//! - [`gate`]: what no one can mean, or might not have meant
//! - [`solver`], [`check`]: the contract's two ends
//!
//! Displacements count from the structure as modelled inside, and from t = 0 at the interface.
//! Nothing here knows what loads the structure.

pub mod applied;
pub mod assembly;
pub mod check;
pub mod config;
pub mod critical_step;
pub mod dense;
pub mod element;
pub mod elimination;
pub mod energy;
pub mod explicit;
pub mod failure;
pub mod fields;
pub mod form_finding;
pub mod fronts;
pub mod gaps;
pub mod gate;
pub mod height;
pub mod implicit;
pub mod inherited;
pub mod kernel;
pub mod lanes;
pub mod legend;
pub mod linear_solver;
pub mod loads;
pub mod march;
pub mod material;
pub mod model;
pub mod moving_mean;
pub mod newton;
pub mod path;
pub mod pressure;
pub mod probe;
pub mod read;
pub mod record;
pub mod reference;
pub mod scattered;
pub mod signed;
pub mod solver;
pub mod start;
pub mod state;
pub mod tangent;

pub use solver::FemSolver;

use interface_defs::toolkit::program::Program;

/// The program `fem-solver`.
pub const PROGRAM: Program = Program {
    name: "fem-solver",
    role: "fem",
    about: "Structural solver: nets, ropes, brakes, posts and membranes at large displacements",
    build: |scene, options| Ok(Box::new(FemSolver::new(scene, options)?)),
    check: |scene, _| check::check(scene),
    schema: reference::share,
};
