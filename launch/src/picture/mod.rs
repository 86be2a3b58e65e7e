//! Pictures as SVG.

pub mod scatter;
