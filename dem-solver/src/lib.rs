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
//! Five libraries, each of which uses only those before it; their first pages say what is in them.
//!
//! - `dem-solid`: [`geometry`], [`input`], [`shape`], [`cluster`](mod@cluster)
//! - `dem-terrain`: [`terrain`]
//! - `dem-contact`: [`law`], [`settings`], [`rock`], [`interface_mesh`], [`contact`]
//! - `dem-rocks`: [`model`], [`gate`], [`guard`], [`results`], [`integrator`], [`solver`], [`granular`], [`check`](mod@check)
//! - `dem-study`: [`study`], many releases on one terrain, `rockfall ensemble`
//!
//! Here is the program that is made of them, and [`command`], `rockfall cluster`.

pub mod command;

pub use dem_contact::{contact, interface_mesh, law, rock, settings};
pub use dem_rocks::{
    DemSolver, check, gate, granular, guard, integrator, model, net_contact, reference, results, solver,
};
pub use dem_solid::{cluster, geometry, input, random, shape};
pub use dem_study as study;
pub use dem_terrain as terrain;

use toolkit::program::Program;

/// The program: run a scene alone, check it, serve a coupler.
pub const PROGRAM: Program = Program {
    name: "dem-solver",
    role: "dem",
    about: "Contact solver: rocks as rigid clusters of spheres, on nets, on terrain and in flight",
    build: |scene, options| match granular::are_alone(scene) {
        true => Ok(Box::new(granular::GranularSolver::new(scene, options)?)),
        false => Ok(Box::new(DemSolver::new(scene, options)?.guarded())),
    },
    check: |scene, net, trial| match granular::are_alone(scene) {
        true => granular::check::check(scene),
        false => check::check_with(scene, net, trial),
    },
    schema: reference::share,
};
