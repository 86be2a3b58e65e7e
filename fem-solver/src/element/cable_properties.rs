//! Properties of cables: those of `[structure.cable]`, and what one states itself.

use super::Cable;
use crate::read::{not_negative, positive};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toolkit::scene::Scene;

fn yes() -> bool {
    true
}

/// Properties of a cable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CableConfig {
    /// Young's modulus [Pa].
    pub young: f64,
    /// Section [m2].
    pub area: f64,
    /// Density [kg/m3]; 0: without mass.
    pub density: f64,
    /// Second Piola-Kirchhoff stress as modelled [Pa]; below 0: slack. Default 0.
    #[serde(default)]
    pub prestress: f64,
    /// Whether it carries no compression. Default true.
    #[serde(default = "yes")]
    pub tension_only: bool,
    /// Radius for contact [m]. Default 0, a mathematical line.
    #[serde(default)]
    pub radius: f64,
}

impl CableConfig {
    /// Refuse what no cable can be, as `key` of the scene states it.
    pub fn check(&self, scene: &Scene, key: &str) -> Result<(), Diagnostic> {
        positive(scene, &format!("{key}.young"), self.young, "Pa")?;
        positive(scene, &format!("{key}.area"), self.area, "m2")?;
        not_negative(scene, &format!("{key}.density"), self.density, "kg/m3")?;
        not_negative(scene, &format!("{key}.radius"), self.radius, "m")
    }

    /// A cable with these properties between two of the nodes at `positions` [m], unstretched at its own length [m] or as
    /// modelled.
    pub fn cable(&self, positions: &[Vector3<f64>], ends: [usize; 2], length: Option<f64>) -> Cable {
        let span = positions[ends[1]] - positions[ends[0]];
        Cable {
            nodes: ends,
            span,
            length: length.unwrap_or(span.norm()),
            young: self.young,
            area: self.area,
            density: self.density,
            prestress: self.prestress,
            tension_only: self.tension_only,
            radius: self.radius,
        }
    }
}

/// Properties of a cable as far as they are stated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Stated {
    /// Young's modulus [Pa].
    pub young: Option<f64>,
    /// Section [m2].
    pub area: Option<f64>,
    /// Density [kg/m3].
    pub density: Option<f64>,
    /// Second Piola-Kirchhoff stress [Pa].
    pub prestress: Option<f64>,
    /// Whether it carries no compression.
    pub tension_only: Option<bool>,
    /// Radius for contact [m].
    pub radius: Option<f64>,
}

impl Stated {
    /// Properties of one cable, checked: those that `key` of the scene states, else those of all.
    pub fn complete(
        &self,
        scene: &Scene,
        key: &str,
        common: Option<&CableConfig>,
    ) -> Result<CableConfig, Diagnostic> {
        let missing = |name: &str| {
            let what =
                format!("no {name} is stated here, and there is no [structure.cable] that states it for all");
            scene.invalid(key, what)
        };
        let own = CableConfig {
            young: self.young.or(common.map(|c| c.young)).ok_or_else(|| missing("young"))?,
            area: self.area.or(common.map(|c| c.area)).ok_or_else(|| missing("area"))?,
            density: self.density.or(common.map(|c| c.density)).ok_or_else(|| missing("density"))?,
            prestress: self.prestress.or(common.map(|c| c.prestress)).unwrap_or(0.0),
            tension_only: self.tension_only.or(common.map(|c| c.tension_only)).unwrap_or(true),
            radius: self.radius.or(common.map(|c| c.radius)).unwrap_or(0.0),
        };
        own.check(scene, key)?;
        Ok(own)
    }
}
