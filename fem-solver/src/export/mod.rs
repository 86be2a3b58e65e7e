//! The structure of a scene as one neutral document, `structure.json`: what other programs can hold of it.
//!
//! - [`collect`]: from a scene to the document
//! - [`deck`]: the document
//! - [`section`]: what other programs can hold of a part, and what not
//!
//! `launch/adapters/export` writes it in the formats of other programs. Its schema stands in `docs/structures.md`.

pub mod collect;
pub mod deck;
pub mod section;
