//! Rocks, what they touch, and the forces between them.
//!
//! - [`law`]: the law of contact, part by part
//! - [`settings`]: the tables of a scene, with units and defaults
//! - [`rock`]: mass, spheres, motion, rotation
//! - [`interface_mesh`]: the structure as contact partner: its elements, their motion in a window
//! - [`contact`]: which spheres touch what, and the forces

pub mod contact;
pub mod interface_mesh;
mod keys;
pub mod law;
pub mod rock;
pub mod settings;
