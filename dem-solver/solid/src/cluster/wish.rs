//! What a cluster is to be.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Most spheres of a cluster.
pub const MOST_SPHERES: u32 = 50_000;

/// Where the spheres end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Fit {
    /// As much outside of the solid as lacks inside: together they have the solid's volume.
    #[default]
    Volume,
    /// As far outside of the solid as inside: the smallest largest error; too much volume.
    Largest,
    /// Never outside of the solid: too little volume.
    Inside,
}

/// What a cluster is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// Number of spheres.
    pub spheres: u32,
    /// Where they end.
    pub fit: Fit,
    /// Least radius [m]; what only smaller ones could reach stays uncovered. 0: as the error asks for.
    pub smallest_radius: f64,
}
