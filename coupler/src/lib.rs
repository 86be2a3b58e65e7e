//! Gauss-Seidel coupling of two solvers that know nothing of each other.
//!
//! Folders and files follow the method: [`handshake`] (who is there, what crosses the interface),
//! [`schedule`] (windows), [`predictor`], [`coupling`] (the loop), [`interface`] (motion and force on
//! the meshes), [`mapping`], [`acceleration`], [`convergence`], [`energy`] (balance and booked work),
//! [`records`] (result files), [`settings`] (`[coupling]`), [`program`] (command line).

pub mod acceleration;
pub mod convergence;
pub mod coupling;
pub mod energy;
pub mod handshake;
pub mod interface;
pub mod mapping;
pub mod predictor;
pub mod program;
pub mod records;
pub mod reference;
mod registry;
mod rows;
pub mod schedule;
pub mod settings;
pub mod trust;
