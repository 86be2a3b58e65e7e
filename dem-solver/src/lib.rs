//! Rocks as rigid sphere clusters: contact with a moving wall, rotation, flight.
//!
//! The solver knows nothing of who moves the wall. It takes the motion of the interface mesh over a
//! window and gives the force on it, or runs alone on a scene without one.
//!
//! - [`settings`]: the tables of a scene, with units and defaults
//! - [`rock`]: mass, spheres, motion, rotation
//! - [`shape`]: the true solid of a rock as a closed surface
//! - [`cluster`](mod@cluster): spheres that stand for a surface, and their error
//! - [`interface_mesh`]: the structure as contact partner: its elements, their motion in a window
//! - [`terrain`]: triangles that never move, and a static tree over them
//! - [`gate`]: what is refused and warned of before anything starts
//! - [`law`]: the law of contact, part by part
//! - [`contact`]: which spheres touch what, and the forces
//! - [`model`]: the prepared scene, the largest stable step, the state of all rocks
//! - [`integrator`]: the steps of a window
//! - [`granular`]: thousands of separate spheres instead of rocks
//! - [`guard`]: what stops a run that would end with a wrong answer
//! - [`results`]: what is reported
//! - [`solver`]: the contract
//! - [`check`](mod@check): what would be built
//! - [`reference`]: what is read and written, for editors

pub mod check;
pub mod cluster;
pub mod command;
pub mod contact;
pub mod gate;
pub mod geometry;
pub mod granular;
pub mod guard;
pub mod input;
pub mod integrator;
pub mod interface_mesh;
pub mod law;
pub mod model;
pub mod net_contact;
pub mod reference;
pub mod results;
pub mod rock;
pub mod settings;
pub mod shape;
pub mod solver;
pub mod terrain;

pub use solver::DemSolver;

use interface_defs::toolkit::program::Program;

/// The program: run a scene alone, check it, serve a coupler.
pub const PROGRAM: Program = Program {
    name: "dem-solver",
    role: "dem",
    about: "Contact solver: rocks as rigid clusters of spheres, on nets, on terrain and in flight",
    build: |scene, options| match granular::are_alone(scene) {
        true => Ok(Box::new(granular::GranularSolver::new(scene, options)?)),
        false => Ok(Box::new(DemSolver::new(scene, options)?.guarded())),
    },
    check: |scene, net| match granular::are_alone(scene) {
        true => granular::check::check(scene),
        false => check::check_with(scene, net),
    },
    schema: reference::share,
};
