//! `[[gauge]]`: what to record.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A number, or three, recorded at every step: at a point of the structure or over a group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaugeConfig {
    /// Name; the columns and measures begin with it.
    pub name: String,
    /// Point of the structure as it is modelled, before form finding [m]: its node there is meant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<[f64; 3]>,
    /// Name of a group, instead of a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// `height` only: the group above which it is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub above: Option<String>,
    /// What is recorded there.
    pub quantity: Quantity,
}

/// What a gauge records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Displacement since t = 0 [m], mean over the nodes of a group: `_ux`, `_uy`, `_uz`.
    Displacement,
    /// Velocity [m/s], mean over the nodes of a group: `_vx`, `_vy`, `_vz`.
    Velocity,
    /// Force of the supports on the structure [N], sum over a group: `_fx`, `_fy`, `_fz`. Its value
    /// is the mean over the window, its extremes are those of single steps.
    Force,
    /// Largest axial force [N] of the elements at the point, of the part or the group of elements of that name, or of
    /// those with all nodes in a group of nodes: `_tension`.
    Tension,
    /// Height [m] that is left between two ropes: how far the lowest node of the group lies above the highest node of the
    /// group `above`, against gravity: `_height`. The residual height is that at the end, the measure `_height_end`.
    Height,
    /// Largest elongation [m] against the structure as modelled, of the same elements: `_elongation`.
    Elongation,
}
