//! The ground that a structure lies on: a smooth surface through heights on a grid, and how far a point is from it.
//!
//! What nodes do on it is an element, [`crate::element::GroundContact`]; where it comes from is in `model/ground.rs`.

mod patch;
mod surface;

pub use surface::{Foot, Surface};
