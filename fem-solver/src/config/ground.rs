//! `[structure.ground]`: the ground that nodes of the structure lie on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The ground under the structure: nodes that move are pushed off by it and held back by friction. Without this table the
/// structure passes through the terrain.
///
/// Each node is a sphere with the radius of the lines that end at it. The ground is a smooth surface through the heights of
/// a raster; beyond the raster there is none. Nodes that supports hold in all directions take no part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GroundConfig {
    /// Heights: an ESRI grid (`.asc`), from the directory of the scene. Default `structure.generator.ground`, or
    /// `structure.place.ground`; in a scene with `[terrain]` `rockfall` makes it of that by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Stiffness of each node in the ground [N/m], along the normal as it goes down, and along the ground as long as it sticks. Default: its mass,
    /// but not more than that of half of the nodes, times (1000/s)^2: steps of up to 1 ms follow its motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// Coefficient of friction (Coulomb). The rest shape at t = 0 is without friction, as after a net has been shaken down;
    /// friction acts from there on.
    pub friction: f64,
    /// Speed of a node after a bounce over that before, above 0 and at most 1: it comes off with the stiffness over the
    /// square of this.
    pub restitution: f64,
    /// Groups or parts whose nodes take part. Default: all nodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub groups: Option<Vec<String>>,
    /// Groups or parts whose nodes take no part.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub except: Vec<String>,
}

impl Default for GroundConfig {
    fn default() -> Self {
        Self {
            file: None,
            stiffness: None,
            friction: 0.5,
            restitution: 0.5,
            groups: None,
            except: Vec::new(),
        }
    }
}
