//! `[structure.place]`: where a structure of one's own axes stands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Where a mesh file, a generated net or a barrier in axes of its own stands: it is turned about z, then moved.
///
/// Points of the scene (`at` of supports, loads and gauges) and directions count where it stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaceConfig {
    /// Where the origin of its own axes comes to: `[x, y]` on the ground, or `[x, y, z]` [m], in the coordinates of the terrain.
    pub origin: Vec<f64>,
    /// Direction of its own x axis [degrees from y (north), clockwise as seen from above]. Default 90: along x (east).
    #[serde(default = "east")]
    pub azimuth: f64,
    /// Heights of the ground: an ESRI grid (`.asc`), from the directory of the scene. Default `structure.ground.file`; in a
    /// scene with `[terrain]` `rockfall` makes it of that by itself. With three numbers of `origin` nothing asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<PathBuf>,
    /// Whether z of each node counts from the ground below it, in place of from that below the origin: a flat net is draped
    /// so. Default false.
    #[serde(default)]
    pub draped: bool,
}

fn east() -> f64 {
    90.0
}
