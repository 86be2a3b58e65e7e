//! Parts of cables: elastic ones without rupture are [`Cable`]s, all others [`Bar`]s.

use super::cable_properties::{CableConfig, Stated};
use super::part::{Key, NewElements, PartCell, PartSettings, StatedSection, part};
use super::{Bar, Cable};
use crate::element::bar::Rupture;
use crate::element::material::Law;
use crate::read::mesh::Kind;
use interface_defs::diagnostic::Diagnostic;

part! {
    /// Cables or bars, one after the other along each cell, with hardening and rupture where stated. A triangle
    /// or quadrilateral of a mesh is a closed polygon of them, the wire of a ring; so is a cell whose last
    /// node is its first. Neighbours share nodes, never cables. `young` to `tension_only`, and `radius`: default what
    /// `[structure.cable]` says.
    CablePart: "cables", (2, usize::MAX) nodes, Line2 | Row | Tri3 | Quad4 {
        /// Young's modulus [Pa].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        young: Option<f64>,
        /// Section [m2].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        area: Option<f64>,
        /// Density [kg/m3].
        #[serde(default, skip_serializing_if = "Option::is_none")]
        density: Option<f64>,
        /// Second Piola-Kirchhoff stress at the unstretched length [Pa]; below 0: slack.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        prestress: Option<f64>,
        /// Whether they carry no compression.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        tension_only: Option<bool>,
        /// Unstretched length of each [m]. Default the distance of its nodes.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        length: Option<f64>,
        /// Hardening: rows `[plastic strain, yield stress]` [-, Pa], the first at 0, constant beyond the
        /// last. Default none: elastic.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        hardening: Vec<[f64; 2]>,
        /// Green-Lagrange strain at which one breaks. Default: never.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rupture_strain: Option<f64>,
    }
}

impl CablePart {
    fn own(&self) -> Stated {
        Stated {
            young: self.young,
            area: self.area,
            density: self.density,
            prestress: self.prestress,
            tension_only: self.tension_only,
            radius: self.radius,
        }
    }

    /// Properties and rupture of its cables, checked.
    fn check(&self, key: &Key, common: Option<&CableConfig>) -> Result<(CableConfig, Rupture), Diagnostic> {
        let own = self.own().complete(key.scene, &key.key, common)?;
        if let Some(length) = self.length {
            key.positive("length", length, "m")?;
        }
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

    fn stated(&self) -> Option<Stated> {
        Some(self.own())
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
            let Cable { nodes, span, length, area, density, radius, .. } = cable;
            made.elements.push(Bar { nodes, span, length, area, density, radius, law, rupture }.into());
        }
        Ok(())
    }

    fn section(&self, common: Option<&CableConfig>) -> Option<StatedSection> {
        Some(StatedSection {
            young: self.young,
            density: self.density,
            area: self.area.or(common.map(|c| c.area)),
            radius: self.radius.or(common.map(|c| c.radius)),
            prestress: self.prestress.or(common.map(|c| c.prestress)),
            strained: self.young.or(common.map(|c| c.young)),
            rupture_force: self.rupture_force,
            rupture_strain: self.rupture_strain,
            ..StatedSection::default()
        })
    }
}
