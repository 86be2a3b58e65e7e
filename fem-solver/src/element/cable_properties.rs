//! Cables of a scene: properties of `[structure.cable]`, what one states itself, and parts of them. Elastic ones without rupture
//! are [`Cable`]s, all others [`Bar`]s.

use super::bar::Rupture;
use super::material::Law;
use super::part::{Key, NewElements, PartCell, PartSettings, part, yes};
use super::{Bar, Cable};
use crate::read::mesh::Kind;
use crate::read::{not_negative, positive};
use interface_defs::diagnostic::Diagnostic;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toolkit::scene::Scene;

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
        Cable { nodes: ends, span, length: length.unwrap_or(span.norm()), of: self.clone() }
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

part! {
    /// Cables or bars, one after the other along each cell, with hardening and rupture where stated. A triangle
    /// or quadrilateral of a mesh is a closed polygon of them, the wire of a ring; so is a cell whose last
    /// node is its first. Neighbours share nodes, never cables. `young` to `tension_only`, and `radius`: default what
    /// `[structure.cable]` says.
    CablePart: "cables", (2, usize::MAX) nodes, Line2 | Row | Tri3 | Quad4 {
        /// Young's modulus [Pa].
        young: Option<f64>,
        /// Section [m2].
        area: Option<f64>,
        /// Density [kg/m3].
        density: Option<f64>,
        /// Second Piola-Kirchhoff stress at the unstretched length [Pa]; below 0: slack.
        prestress: Option<f64>,
        /// Whether they carry no compression.
        tension_only: Option<bool>,
        /// Unstretched length of each [m]. Default the distance of its nodes.
        length: Option<f64>,
        /// Hardening: rows `[plastic strain, yield stress]` [-, Pa], the first at 0, constant beyond the
        /// last. Default none: elastic.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        hardening: Vec<[f64; 2]>,
        /// Green-Lagrange strain at which one breaks. Default: never.
        rupture_strain: Option<f64>,
    }
}

impl CablePart {
    /// The properties of each that it states itself.
    pub fn stated(&self) -> Stated {
        let Self { young, area, density, prestress, tension_only, radius, .. } = *self;
        Stated { young, area, density, prestress, tension_only, radius }
    }

    /// Properties and rupture of its cables, checked.
    fn check(&self, key: &Key, common: Option<&CableConfig>) -> Result<(CableConfig, Rupture), Diagnostic> {
        let own = self.stated().complete(key.scene, &key.key, common)?;
        key.positive(&[("length", self.length.unwrap_or(1.0), "m")])?;
        key.check_table("hardening", &self.hardening)?;
        if self.hardening.first().is_some_and(|row| row[0] != 0.0) {
            return Err(key.invalid("hardening", "the first row must be at the plastic strain 0"));
        }
        Ok((own, key.rupture(self.rupture_force, self.rupture_strain)?))
    }
}

impl PartSettings for CablePart {
    fn closes(&self, kind: Kind) -> bool {
        matches!(kind, Kind::Tri3 | Kind::Quad4)
    }

    fn build(&self, cell: &PartCell, made: &mut NewElements) -> Result<(), Diagnostic> {
        let (own, rupture) = self.check(cell.key, cell.common)?;
        for pair in cell.nodes.windows(2) {
            let cable = own.cable(cell.positions, [pair[0], pair[1]], self.length);
            if self.hardening.is_empty() && rupture == Rupture::NEVER {
                made.cables.push(cable);
                continue;
            }
            let hardening = self.hardening.iter().map(|row| (row[0], row[1])).collect();
            let law = Law { hardening, ..Law::elastic(own.young, own.prestress, own.tension_only) };
            let Cable { nodes, span, length, of: CableConfig { area, density, radius, .. } } = cable;
            let (section, mass) = (Some(area), density * area * length);
            made.elements.push(Bar { nodes, span, length, section, mass, radius, law, rupture }.into());
        }
        Ok(())
    }
}
