//! The contact solver: rocks as rigid clusters of spheres, on nets, on terrain, in boxes and in flight.
//!
//! It takes the motion of an interface mesh over a window and gives the forces on its nodes; it knows nothing of who moves
//! that mesh, and runs alone on a scene without one. Lengths are in m, masses in kg, times in s, and their products; angles in
//! radians. Rocks move in the axes of space, counted from the terrain's own origin where there is terrain ([`model::Model::origin`]).
//!
//! # Where to begin
//!
//! [`solver::DemSolver`] is the solver as the coupler sees it. Its `solve` is one window: [`integrator`] cuts it into steps; in
//! the middle of each, [`contact`] finds what touches and sums up what [`law`] answers; the rest of the step moves the rocks.
//! What a window starts from and ends with is a [`model::state::State`]; what never changes in a run is a [`model::Model`].
//!
//! # From the ground up
//!
//! Each of these uses only what stands above it.
//!
//! - [`geometry`]: spheres, triangles, closest points, trees of boxes
//! - [`input`]: files that users give, their lines and numbers
//! - [`shape`]: the true solid of a rock as a closed surface, from built-in shapes and files ([`shape::formats`])
//! - [`cluster`](mod@cluster): spheres that stand for a surface, and their error
//! - [`terrain`]: triangles that never move, from files ([`terrain::formats`]), and what is asked of them
//! - [`law`]: the law of contact, part by part
//! - [`settings`]: the tables of a scene, with units and defaults
//! - [`rock`]: mass, spheres, motion, rotation
//! - [`interface_mesh`]: the structure as contact partner: its elements, their motion in a window
//! - [`contact`]: which spheres touch what, and the forces
//! - [`model`]: the prepared scene, the largest stable step, the state of all rocks
//! - [`gate`]: what is refused and warned of before anything starts
//! - [`guard`]: what stops a run that would end with a wrong answer
//! - [`results`]: what is reported
//! - [`integrator`]: the steps of a window
//! - [`solver`]: the contract; [`granular`]: the same for thousands of separate spheres alone
//! - [`study`]: many releases on one terrain, `rockfall ensemble`
//! - [`check`](mod@check), [`command`], [`reference`]: what would be built, `rockfall cluster`, what is read and written, for editors

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
pub mod study;
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
