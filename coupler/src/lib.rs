//! Gauss-Seidel coupling of two solvers that know nothing of each other.
//!
//! # Where to begin
//!
//! `windows` is the loop: `Coupling::run` agrees with both solvers and goes from window to window. `window` is one of them,
//! in the order of its life: `predict`, `iterate` (`pass` is one exchange: motion to the contact solver, its force to the structure;
//! `judge`; `accelerate`), then `commit` or `reject`. [`coupling`] is what both work with, and the books. Everything else serves them:
//!
//! - before the loop: [`program`] (command line), [`settings`] (the table `[coupling]`: keys, defaults, checks), [`handshake`]
//!   (who is there, which fields cross the interface, the interface mesh)
//! - in a window: [`schedule`] (which window is next), [`interface`] (first iterate, motion and force on both
//!   meshes), [`mapping`] (the matrix between them), [`patch`] (the nodes that cross), `solver_slot` (asks one solver), [`convergence`] (residual and tolerances),
//!   [`acceleration`] (residual to next iterate)
//! - whether solvers keep the contract: [`guard`] (what is looked at), [`examination`] (when), [`conform`] (one program, clause by clause)
//! - seen from outside: `observer`
//! - after it: `derived` (results that no solver reports), [`energy`] (balance and work at the interface), [`records`] (result files) with `rows` (which windows
//!   become rows) and `fields` (the interface of a foreign structure for ParaView), [`trust`] (what speaks against a run)
//! - instead of it: [`replay`] (one solver is asked what a recording says)
//!
//! A new acceleration or mapping is one file and two lines in the `mod.rs` of its folder.

pub mod acceleration;
pub mod conform;
pub mod convergence;
pub mod coupling;
mod derived;
pub mod energy;
pub mod examination;
mod fields;
pub mod guard;
pub mod handshake;
pub mod interface;
pub mod mapping;
mod observer;
pub mod passing;
pub mod patch;
pub mod program;
pub mod records;
pub mod reference;
mod registry;
pub mod replay;
mod rows;
pub mod schedule;
pub mod settings;
pub mod side;
mod solver_slot;
pub mod trust;
mod window;
mod windows;
