//! The tables of a scene that are this program's: `[structure]`, `[fem]`, `[[gauge]]`.

pub mod fem;
pub mod generator;
pub mod scheme;
pub mod structure;

pub use fem::{FemConfig, Integrator, NewtonConfig};
pub use structure::StructureConfig;

use crate::element::PartConfig;
use interface_defs::diagnostic::Diagnostic;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toolkit::scene::Scene;

/// Everything that a scene says to this program.
#[derive(Debug, Clone)]
pub struct Config {
    /// `[structure]`.
    pub structure: StructureConfig,
    /// `[fem]`; absent = its defaults.
    pub fem: FemConfig,
    /// `[[gauge]]`.
    pub gauges: Vec<GaugeConfig>,
    /// `gravity` [m/s2].
    pub gravity: [f64; 3],
}

impl Config {
    /// Read and check the tables; the numbers in them that only a model can judge are judged there.
    pub fn of(scene: &Scene) -> Result<Self, Diagnostic> {
        let mut structure: StructureConfig = scene.read("structure")?.ok_or_else(|| {
            scene
                .invalid("structure", "the scene has no table [structure]: there is nothing to build")
                .try_instead("write [structure] with a generator, or with nodes and elements of your own")
        })?;
        for part in &mut structure.parts {
            match part {
                PartConfig::CablePart(ropes) => ropes.complete(),
                PartConfig::SlidingCablePart(ropes) => ropes.complete(),
                _ => {}
            }
        }
        let fem: FemConfig = scene.read("fem")?.unwrap_or_default();
        fem.check(scene)?;
        let gauges = scene.read("gauge")?.unwrap_or_default();
        Ok(Self { structure, fem, gauges, gravity: scene.gravity()? })
    }
}

/// A number, or three, recorded at every step: at a point of the structure or over a group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaugeConfig {
    /// Name; the columns and measures begin with it.
    pub name: String,
    /// Point of the structure as it is modelled, before form finding [m]: its node there is meant.
    pub at: Option<[f64; 3]>,
    /// Name of a group, instead of a point.
    pub group: Option<String>,
    /// `height` only: the group above which it is taken.
    pub above: Option<String>,
    /// `height` only: group with nodes of each post, as the part `posts`. The height is then taken in the plane of the posts,
    /// field by field between them: the residual height of EAD 340059.
    pub posts: Option<String>,
    /// `height` only: normal of the reference slope, along which the height counts. Default against gravity.
    pub normal: Option<[f64; 3]>,
    /// What is recorded there.
    pub quantity: Quantity,
}

/// What a gauge records.
///
/// Forces, tensions and elongations of several members (the elements of a group, the segments of a rope, the supported
/// nodes of a group) are reported as the smallest and the largest of them: columns `_min` and `_max` at the row's end, and
/// measures of the same names over all solver steps, which name the member. A sum is called `_sum`, a mean `_mean`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Displacement since t = 0 [m]: `_ux`, `_uy`, `_uz`; of a group its mean, `_ux_mean`.
    Displacement,
    /// Velocity [m/s]: `_vx`, `_vy`, `_vz`; of a group its mean, `_vx_mean`.
    Velocity,
    /// Force of the supports on the structure [N]: `_fx`, `_fy`, `_fz`; of a group its sum, `_fx_sum`, and the smallest and
    /// largest magnitude at one node, `_force_min`, `_force_max`. A row has means over it (in statics values at its end),
    /// measures have those of single steps.
    Force,
    /// Axial force [N] of the elements at the point, of the part or the group of elements of that name, or of
    /// those with all nodes in a group of nodes; compression is negative: `_tension`; of several `_tension_min`, that of the
    /// most compressed, and `_tension_max`. What is broken counts as 0.
    Tension,
    /// Height [m] that is left between two ropes: how far the lowest node of the group lies above the highest node of the
    /// group `above`, along `normal` (against gravity): `_height`. With `posts`, least distance along `normal` of the two
    /// ropes (the lines of the groups) at one place along the barrier: `_height_1` and on of the fields, in the direction
    /// of the axis along which they stand, and `_height` the least of them. The residual height is that at the
    /// end, the measures `_height_end` and `_height_1_end` and on; with `above` = the feet it is the height of the top rope.
    Height,
    /// Elongation [m] against the structure as modelled, of the same elements: `_elongation`; of several
    /// `_elongation_min`, `_elongation_max`.
    Elongation,
    /// Bending moment [N m] of the beams at the point, there; of a group of beams, the larger of both ends of each. Its
    /// magnitude, of both planes together: `_bending_moment`; of several `_bending_moment_min`, `_bending_moment_max`. What is
    /// broken counts as 0.
    BendingMoment,
    /// Share of its strength that each of the same elements uses: axial force over `rupture_force`, strain over `rupture_strain`, or
    /// in a beam that yields the sum of axial force and moments over those at which its section is plastic, if that is more:
    /// `_utilisation`; of several `_utilisation_min`, `_utilisation_max`. What is broken counts as 1.
    Utilisation,
}
